"""A range image and what was found in it, in one labelled picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np

from .. import _check
from .._option import parsed, takes
from ..constants import EDGE_BOUNDARY
from ..edges import EdgeStrength
from ..frame import Frame, read_frame
from ..options import GEOMETRY, ScanLineParams
from ..selection import strengthImage
from .distance import checked_distance, distance_colours
from .palette import LINE_KINDS, colour_index, paint
from .regions import drawRegions, write_numbers
from .relief import hatched, relief_of, subdued
from .sheet import BACKGROUND, key_to, sentence, sheet, with_axes

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._typed import GeometryOptions

_PANEL_MIN, _PANEL_MAX = 320, 640  # longer side of a panel in pixels
_SMALL_HOLE = 3  # pixels that a hole is narrower than, whose rim is not shown


@takes(GEOMETRY)
def drawOverview(
    src: np.ndarray,
    strength: tuple[np.ndarray, ...],
    edges: np.ndarray,
    distance: np.ndarray | None = None,
    *,
    title: str | None = None,
    jumpCut: float | None = None,
    creaseCut: float = 64.0,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Show a range image and what was found in it in one labelled picture.

    drawOverview(src, strength, edges[, distance], *[, title[, jumpCut[, creaseCut[, K[, ...]]]]]) -> retval

    The panels: shaded relief, strength of jump and of crease, the kinds of all candidates (but for the rims of holes
    narrower than three pixels), the selected edges over the relief, and the distance map, with rows and columns
    numbered; below them the key to the colours. Lengths are in metres where the image holds integers and `depthFactor`
    is 1000, else in its units.

    Parameters
    ----------
    src : ndarray
        Range image (H, W), or points (H, W, 3) or (H, W, 4) of floats.
    strength : EdgeStrength
        What `edgeStrength` returns: jump, crease, kind and significance, each (H, W).
    edges : ndarray of shape (H, W), CV_8U or bool
        Selected edges, non-zero on edges.
    distance : ndarray of shape (H, W), CV_32F, optional
        Distance map; without it that panel is left out.
    title : str, optional
        A line above the panels.
    jumpCut, creaseCut : float
        Strengths shown white, > 0; by default the median jump, and 64 degrees.
    {options}

    Returns
    -------
    retval : ndarray of shape (h, w, 3), CV_8U
        Large enough to read at its own size, whatever the size of `src`.

    Raises
    ------
    rangeedge.error
        If an image has a wrong type or shape, or shapes differ.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawOverview
    >>> depth, none = np.ones((48, 64), np.float32), np.zeros((48, 64), np.float32)
    >>> kind = np.zeros((48, 64), np.uint8)
    >>> drawOverview(depth, (none, none, kind, none), kind).dtype
    dtype('uint8')
    """
    frame = read_frame(src, parsed(geometry, ScanLineParams)[0])
    jump, crease, kind = _strength(strength, frame.shape)
    edges = _check.image8("edges", edges, frame.shape) != 0
    if distance is not None:
        distance = checked_distance(distance, frame.shape)
    if title is not None and not isinstance(title, str):
        raise _check.fail("title", "a string or None", type(title).__name__)
    if jumpCut is None:
        jumpCut = float(np.median(jump[jump > 0])) if jump.any() else 1.0
    jumpCut = _check.number("jumpCut", jumpCut, 0, above=True)
    creaseCut = _check.number("creaseCut", creaseCut, 0, above=True)
    return _edge_sheet(frame, (jump, crease, kind), edges, distance, title, (jumpCut, creaseCut))


def edge_overview(
    frame: Frame, strength: EdgeStrength, edges: np.ndarray, distance: np.ndarray, title: str
) -> np.ndarray:
    """What `drawOverview` draws, of a checked range image."""
    jumps = strength.jump[strength.jump > 0]
    cuts = float(np.median(jumps)) if jumps.size else 1.0, 64.0
    return _edge_sheet(frame, strength[:3], edges != 0, distance, title, cuts)


def _edge_sheet(
    frame: Frame,
    strength: tuple[np.ndarray, ...],
    edges: np.ndarray,
    distance: np.ndarray | None,
    title: str | None,
    cuts: tuple[float, float],
) -> np.ndarray:
    jump, crease, kind = strength
    depth, unit = np.float32(frame.depth), frame.unit or "units"
    valid = np.isfinite(depth)
    size = _panel_size(depth.shape)
    relief = _resized(relief_of(depth), size)
    black = np.zeros_like(relief)
    shown = np.where(_beside_small_holes(valid), kind & ~np.uint8(EDGE_BOUNDARY), kind)
    panels = [
        (_depth_caption(frame), relief),
        (f"Jump strength, white from {cuts[0]:.3g} {unit}", _grey(jump, cuts[0], size)),
        (f"Crease strength, white from {cuts[1]:.3g} degrees", _grey(crease, cuts[1], size)),
        ("Kinds of all candidates", paint(black, _thick(colour_index(shown != 0, shown), size))),
        ("Selected edges", paint(subdued(relief), _thick(colour_index(edges, kind), size))),
    ]
    if distance is not None:
        caption, picture = _distance_panel(distance, valid)
        panels.append((caption, _resized(picture, size)))
    return sheet([(caption, with_axes(picture, depth.shape)) for caption, picture in panels], title)


def _beside_small_holes(valid: np.ndarray) -> np.ndarray:
    """Pixels beside no other hole than such as no square of three pixels fits into."""
    square = np.ones((_SMALL_HOLE, _SMALL_HOLE), np.uint8)
    large = cv2.morphologyEx((~valid).view(np.uint8), cv2.MORPH_OPEN, square, borderValue=1)
    return cv2.dilate(large, np.ones((3, 3), np.uint8)) == 0


@_check.public
def drawPanels(
    panels: Sequence[tuple[str, np.ndarray]], columns: int | None = None, *, key: bool = False
) -> np.ndarray:
    """Show pictures beside each other, each under its title.

    drawPanels(panels[, columns], *[, key]) -> retval

    Parameters
    ----------
    panels : sequence of (str, ndarray)
        Titles and pictures, (H, W, 3) or (H, W), CV_8U. Smaller ones than the largest are placed top left.
    columns : int, optional
        How many stand beside each other at most; by default what makes the whole about as wide as a screen.
    key : bool
        Whether to add the meaning of the colours of edges, as `drawEdges` has them.

    Returns
    -------
    retval : ndarray of shape (h, w, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If there is no panel, or one is no title with a picture of 8 bits.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawPanels
    >>> black = np.zeros((100, 160), np.uint8)
    >>> drawPanels([("before", black), ("after", black)], 2).shape
    (132, 328, 3)
    """
    pictures = []
    for panel in panels if isinstance(panels, (list, tuple)) else ():
        if not isinstance(panel, tuple) or len(panel) != 2 or not isinstance(panel[0], str):
            raise _check.fail("panels", "a sequence of (title, picture)", _check.described(panel))
        title, picture = panel
        if not isinstance(picture, np.ndarray) or picture.dtype != np.uint8 or picture.shape[2:] not in ((), (3,)):
            raise _check.fail("panels", "pictures (H, W) or (H, W, 3), CV_8U", _check.described(picture))
        pictures.append((title, cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture))
    if not pictures:
        raise _check.fail("panels", "a sequence of (title, picture), one at least", _check.described(panels))
    height, width = (max(picture.shape[axis] for _, picture in pictures) for axis in (0, 1))
    full = []
    for title, picture in pictures:
        canvas = np.full((height, width, 3), BACKGROUND, np.uint8)
        canvas[: picture.shape[0], : picture.shape[1]] = picture
        full.append((title, canvas))
    columns = None if columns is None else min(_check.integer("columns", columns, 1), len(full))
    return sheet(full, None, columns, key=_check.boolean("key", key))


def line_overview(picture: np.ndarray, shape: tuple[int, int], caption: str) -> np.ndarray:
    """A picture of lines in an image of this shape under a caption, with the key to their colours."""
    framed = with_axes(picture, shape)
    return np.vstack([*sentence(caption, framed.shape[1]), framed, key_to(framed.shape[1], LINE_KINDS)])


def region_overview(
    frame: Frame, seeds: np.ndarray, edges: np.ndarray, kind: np.ndarray, labels: np.ndarray, title: str
) -> np.ndarray:
    """Range image, edges, seeds and regions in one labelled picture, after the manner of `drawOverview`."""
    depth = np.float32(frame.depth)
    size = _panel_size(depth.shape)
    relief = _resized(relief_of(depth), size)
    sown, regions = (_resized(drawRegions(part, subdued(relief_of(depth)), 0.8), size) for part in (seeds, labels))
    thin = _thick(colour_index(edges != 0, kind), size)
    count, numbered = len(np.unique(labels[labels > 0])), write_numbers(regions, labels)
    how = "" if numbered == count else f" ({count - numbered} without room)"
    panels = [
        (_depth_caption(frame), relief),
        ("Edges", paint(subdued(relief), thin)),
        (f"{len(np.unique(seeds[seeds > 0]))} seeds", sown),
        (f"{count} regions, numbered by label{how}", regions),
    ]
    return sheet([(caption, with_axes(picture, depth.shape)) for caption, picture in panels], title)


def _strength(strength: tuple[np.ndarray, ...], shape: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """Jump, crease and kind out of an EdgeStrength."""
    if not isinstance(strength, tuple) or len(strength) != 4:
        raise _check.fail("strength", "an EdgeStrength (jump, crease, kind, significance)", type(strength).__name__)
    jump, crease, kind, _ = strength
    return (
        _check.strength32f("strength.jump", jump, shape),
        _check.strength32f("strength.crease", crease, shape),
        _check.image8("strength.kind", kind, shape),
    )


def _grey(strength: np.ndarray, cut: float, size: tuple[int, int]) -> np.ndarray:
    return cv2.cvtColor(_thick(strengthImage(strength, cut), size), cv2.COLOR_GRAY2BGR)


def _panel_size(shape: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a panel: whole multiples of a small image, a large one reduced, a panorama less so."""
    longer = max(shape)
    limit = _PANEL_MAX * np.clip(shape[1] / shape[0] / 2, 1, 3)
    scale = min(limit / longer, -(-_PANEL_MIN // longer))
    return max(round(shape[1] * scale), 1), max(round(shape[0] * scale), 1)


def _resized(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    smaller = size[0] < picture.shape[1]
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA if smaller else cv2.INTER_NEAREST)


def _thick(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Resized so that lines one pixel wide survive: the largest value that falls on a pixel."""
    step = -(-image.shape[1] // size[0])
    return cv2.resize(cv2.dilate(image, np.ones((step, step), np.uint8)), size, interpolation=cv2.INTER_NEAREST)


def _depth_caption(frame: Frame) -> str:
    name, sign = ("Height", -1) if frame.heightMap else ("Depth", 1)
    values = sign * frame.depth[frame.valid > 0]
    if not values.size:
        return f"{name}: no data"
    colours = "high bright" if frame.heightMap else "near bright"
    share = 100 * values.size / frame.valid.size
    return f"{name} {values.min():.4g} to {values.max():.4g} {frame.unit or 'units'}, {colours}, {share:.0f} % valid"


def _distance_panel(distance: np.ndarray, valid: np.ndarray) -> tuple[str, np.ndarray]:
    """Distances on surfaces, with a scale of their own; hatched without data."""
    finite = distance[valid & np.isfinite(distance)]
    longest = float(finite.max(initial=0))
    colours = distance_colours(distance, longest or None, False)
    caption = f"Distance to the edges, up to {longest:.3g} pixels" if finite.size else "Distance: no edges"
    return caption, hatched(colours, valid)
