"""A range image and what was found in it, in one labelled picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np

from .. import _check
from .._option import parsed, takes
from ..frame import read_frame
from ..options import GEOMETRY, ScanLineParams
from ..selection import strengthImage
from .distance import checked_distance, distance_colours
from .palette import EDGE_KINDS, LINE_KINDS, colour_index, paint
from .regions import drawRegions
from .relief import hatched, relief_of, subdued

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._typed import GeometryOptions

_BACKGROUND = (32, 32, 32)
_INK = (235, 235, 235)
_FONT, _FONT_SCALE, _BAR = cv2.FONT_HERSHEY_SIMPLEX, 0.55, 28
_PANEL_MIN, _PANEL_MAX = 320, 640  # longer side of a panel in pixels


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

    The panels: shaded relief, strength of jump and of crease, the kinds of all candidates, the selected edges over
    the relief, and the distance map; below them the key to the colours.

    Parameters
    ----------
    src : ndarray
        Range image (H, W), or points (H, W, 3) or (H, W, 4) of floats.
    strength : EdgeStrength
        What :func:`edgeStrength` returns: jump, crease, kind and significance, each (H, W).
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
    depth = read_frame(src, parsed(geometry, ScanLineParams)[0]).depth
    jump, crease, kind = _strength(strength, depth.shape)
    edges = _check.image8("edges", edges, depth.shape) != 0
    if distance is not None:
        distance = checked_distance(distance, depth.shape)
    if title is not None and not isinstance(title, str):
        raise _check.fail("title", "a string or None", type(title).__name__)
    if jumpCut is None:
        jumpCut = float(np.median(jump[jump > 0])) if jump.any() else 1.0
    jumpCut = _check.number("jumpCut", jumpCut, 0, above=True)
    creaseCut = _check.number("creaseCut", creaseCut, 0, above=True)

    size = _panel_size(depth.shape)
    relief = _resized(relief_of(depth), size)
    black = np.zeros_like(relief)
    panels = [
        (_depth_caption(depth, geometry.get("heightMap", False)), relief),
        (f"Jump strength, white from {jumpCut:.3g}", _grey(jump, jumpCut, size)),
        (f"Crease strength, white from {creaseCut:.3g} deg", _grey(crease, creaseCut, size)),
        ("Kinds of all candidates", paint(black, _thick(colour_index(kind != 0, kind), size))),
        ("Selected edges", paint(subdued(relief), _thick(colour_index(edges, kind), size))),
    ]
    if distance is not None:
        caption, picture = _distance_panel(distance, np.isfinite(depth))
        panels.append((caption, _resized(picture, size)))
    return _sheet(panels, title)


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
        sheet = np.full((height, width, 3), _BACKGROUND, np.uint8)
        sheet[: picture.shape[0], : picture.shape[1]] = picture
        full.append((title, sheet))
    columns = None if columns is None else min(_check.integer("columns", columns, 1), len(full))
    return _sheet(full, None, columns, key=_check.boolean("key", key))


def line_overview(picture: np.ndarray, caption: str) -> np.ndarray:
    """A picture of lines under a caption, with the key to their colours."""
    return np.vstack([*_sentence(caption, picture.shape[1]), picture, _key(picture.shape[1], LINE_KINDS)])


def region_overview(
    surface: np.ndarray,
    seeds: np.ndarray,
    edges: np.ndarray,
    kind: np.ndarray,
    labels: np.ndarray,
    *,
    title: str,
    heightMap: bool = False,
) -> np.ndarray:
    """Range image, edges, seeds and regions in one labelled picture, after the manner of `drawOverview`."""
    depth = read_frame(surface, ScanLineParams(heightMap=heightMap)).depth
    size = _panel_size(depth.shape)
    relief = _resized(relief_of(depth), size)
    seeds, regions = (_resized(drawRegions(part, subdued(relief_of(depth)), 0.8), size) for part in (seeds, labels))
    thin = _thick(colour_index(edges != 0, kind), size)
    panels = [
        (_depth_caption(depth, heightMap), relief),
        ("Edges", paint(subdued(relief), thin)),
        ("Seeds", seeds),
        (f"{len(np.unique(labels[labels > 0]))} regions", regions),
    ]
    return _sheet(panels, title)


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


def _depth_caption(depth: np.ndarray, heightMap: bool) -> str:
    name, sign = ("Height", -1) if heightMap else ("Depth", 1)
    values = sign * depth[np.isfinite(depth)]
    if not values.size:
        return f"{name}: no data"
    colours = "high bright" if heightMap else "near bright"
    return f"{name} {values.min():.4g} to {values.max():.4g}, {colours}, {100 * values.size / depth.size:.0f} % valid"


def _distance_panel(distance: np.ndarray, valid: np.ndarray) -> tuple[str, np.ndarray]:
    """Distances on surfaces, with a scale of their own; hatched without data."""
    finite = distance[valid & np.isfinite(distance)]
    longest = float(finite.max(initial=0))
    colours = distance_colours(distance, longest or None, False)
    caption = f"Distance to the edges, up to {longest:.3g}" if finite.size else "Distance: no edges"
    return caption, hatched(colours, valid)


def _sheet(
    panels: list[tuple[str, np.ndarray]], title: str | None, columns: int | None = None, *, key: bool = True
) -> np.ndarray:
    """Captioned panels in a grid near 16:9, a title above and the key to the colours below."""
    height, width = panels[0][1].shape[:2]
    width = max(width, *(_text_width(caption) for caption, _ in panels))
    cells = [_cell(caption, picture, width) for caption, picture in panels]
    height, width = cells[0].shape[:2]
    columns = columns or min(
        (1, 2, 4) if len(cells) == 4 else (1, 2, 3, 6),
        key=lambda n: abs(np.log(n * width / (-(-len(cells) // n) * height) * 9 / 16)),
    )
    cells += [np.full_like(cells[0], _BACKGROUND)] * (-len(cells) % columns)
    rows = [np.hstack(cells[i : i + columns]) for i in range(0, len(cells), columns)]
    top = [] if title is None else [_bar(title, rows[0].shape[1])]
    return np.vstack([*top, *rows, *([_key(rows[0].shape[1])] if key else [])])


def _cell(caption: str, picture: np.ndarray, width: int) -> np.ndarray:
    """A picture under its caption, with a margin to the right and below."""
    cell = np.full((_BAR + picture.shape[0] + 4, width + 4, 3), _BACKGROUND, np.uint8)
    cell[:_BAR] = _bar(caption, width + 4)
    cell[_BAR : _BAR + picture.shape[0], : picture.shape[1]] = picture
    return cell


def _bar(text: str, width: int) -> np.ndarray:
    bar = np.full((_BAR, width, 3), _BACKGROUND, np.uint8)
    return cv2.putText(bar, _encodable(text), (6, _BAR - 9), _FONT, _FONT_SCALE, _INK, 1, cv2.LINE_AA)


def _text_width(text: str) -> int:
    return cv2.getTextSize(_encodable(text), _FONT, _FONT_SCALE, 1)[0][0] + 12


def _encodable(text: str) -> str:
    """A text without the lone surrogates that names of files may hold, which OpenCV 5 does not survive."""
    return text.encode("utf-8", "replace").decode()


def _sentence(text: str, width: int) -> list[np.ndarray]:
    """Bars of text no wider than a picture."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and _text_width(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return [_bar(line, width) for line in lines]


def _key(width: int, entries: Sequence[tuple[tuple[int, int, int], str]] = EDGE_KINDS) -> np.ndarray:
    """Colours with their meaning, by default those of edges, on as many lines as they need."""
    lines, x = [_bar("", width)], 6
    for colour, text in entries:
        needed = _text_width(text) + 24
        if x > 6 and x + needed > width:
            lines.append(_bar("", width))
            x = 6
        cv2.rectangle(lines[-1], (x, 7), (x + 14, 21), colour, cv2.FILLED)
        cv2.putText(lines[-1], text, (x + 22, _BAR - 9), _FONT, _FONT_SCALE, _INK, 1, cv2.LINE_AA)
        x += needed
    return np.vstack(lines)
