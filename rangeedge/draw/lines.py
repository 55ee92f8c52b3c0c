"""Pictures of chains, of segments and of arcs, in the colours of `drawEdges`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np

from .._check import boolean, deliver, described, fail, integer
from .._option import takes
from ..arcs import ARC, arc_points
from ..chains import EdgeChain, EdgeChains
from ..options import GEOMETRY
from ..projection import project
from ..segments import SEGMENT, VERTEX
from .palette import kind_colour
from .relief import backdrop

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._typed import GeometryOptions

_SHIFT = 4  # binary digits of fractions of a pixel
_VERTEX = (255, 255, 255)
_INK, _HALO = (255, 255, 255), (0, 0, 0)
_BESIDE = (4, -4)  # pixels of the picture, from a place to the text about it
_PLACES = (0.5, 0.35, 0.65, 0.2, 0.8)  # along a segment, for its length
_APART = 4  # pixels between texts


@takes(GEOMETRY)
def drawChains(
    src: np.ndarray,
    chains: EdgeChains | Sequence[EdgeChain],
    dst: np.ndarray | None = None,
    *,
    scale: int = 1,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Draw chains as smooth lines over the shaded relief of a range image, or over a picture.

    drawChains(src, chains[, dst], *[, scale[, K[, ...]]]) -> dst

    Jumps are vermilion, convex edges yellow, concave ones blue. Open chains have a dot at either end.

    Parameters
    ----------
    src : ndarray
        A range image (H, W), points (H, W, 3) or (H, W, 4) of floats, or a CV_8UC3 picture to draw on.
    chains : EdgeChains or sequence of EdgeChain
    dst : ndarray of shape (scale H, scale W, 3), CV_8U, optional
        Receives the result where shape and type fit.
    scale : int
        Pixels of the picture to one of the image, from 1 to 16.
    {options}

    Returns
    -------
    dst : ndarray of shape (scale H, scale W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawChains, linkEdges
    >>> roof = np.abs(np.arange(64) + 0.3 * np.arange(48)[:, None] - 40.3)
    >>> drawChains(roof, linkEdges(roof, pixelSize=1, noise=0.001), scale=4).shape
    (192, 256, 3)
    """
    if not isinstance(chains, Sequence) or not all(isinstance(chain, EdgeChain) for chain in chains):
        raise fail("chains", "EdgeChains, or a sequence of EdgeChain", described(chains))
    canvas, scale = canvas_of(src, scale, geometry)
    for chain in chains:
        places = np.column_stack([chain.points["x"], chain.points["y"]])
        places = places[np.isfinite(places).all(axis=1)]
        _line(canvas, places, chain.kind, scale, closed=chain.closed)
        if not chain.closed:
            for end in places[[0, -1]]:
                _dot(canvas, end, kind_colour(chain.kind), scale)
    return deliver("dst", canvas, dst)


@takes(GEOMETRY)
def drawSegments(
    src: np.ndarray,
    segments: np.ndarray,
    vertices: np.ndarray | None = None,
    dst: np.ndarray | None = None,
    *,
    scale: int = 1,
    lengths: bool = False,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Draw segments and the vertices in which they meet over the relief of a range image, or over a picture.

    drawSegments(src, segments[, vertices[, dst]], *[, scale[, lengths[, K[, ...]]]]) -> dst

    Colours are those of `drawChains`; vertices are white dots.

    Parameters
    ----------
    src, dst, scale
        As in `drawChains`.
    {options}
    segments, vertices : structured ndarray
        From `fitSegments`.
    lengths : bool
        Whether to write the length of each segment beside it, in the unit of the image; those of long segments first,
        and only where there is room.

    Returns
    -------
    dst : ndarray of shape (scale H, scale W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawSegments, fitSegments, linkEdges
    >>> roof = np.abs(np.arange(64) + 0.3 * np.arange(48)[:, None] - 40.3)
    >>> found = fitSegments(linkEdges(roof, pixelSize=1, noise=0.001))
    >>> drawSegments(roof, *found, lengths=True).shape
    (48, 64, 3)
    """
    for name, value, dtype in (("segments", segments, SEGMENT), ("vertices", vertices, VERTEX)):
        missing = value is None and name == "vertices"
        if not missing and (not isinstance(value, np.ndarray) or value.dtype != dtype):
            raise fail(name, "a structured array from fitSegments", described(value))
    lengths = boolean("lengths", lengths)
    canvas, scale = canvas_of(src, scale, geometry)
    ends = np.zeros(0, VERTEX) if vertices is None else vertices
    draw_segments(canvas, segments, ends, scale)
    if lengths:
        write_lengths(canvas, segments, ends, scale)
    return deliver("dst", canvas, dst)


def draw_segments(canvas: np.ndarray, segments: np.ndarray, vertices: np.ndarray, scale: int) -> None:
    for segment in segments:
        _line(canvas, segment["pixels"], int(segment["kind"]), scale)
    for vertex in vertices:
        _dot(canvas, np.array([vertex["x"], vertex["y"]]), _VERTEX, scale)


@takes(GEOMETRY)
def drawArcs(
    src: np.ndarray,
    arcs: np.ndarray,
    dst: np.ndarray | None = None,
    *,
    scale: int = 1,
    radii: bool = False,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Draw arcs and circles in space over the relief of a range image, or over a picture.

    drawArcs(src, arcs[, dst], *[, scale[, radii[, K[, ...]]]]) -> dst

    Colours are those of `drawChains`; centres are white dots. Where an arc lies in the image follows from the geometry,
    as `project` says.

    Parameters
    ----------
    src, dst, scale
        As in `drawChains`.
    {options}
    arcs : structured ndarray
        From `fitArcs`.
    radii : bool
        Whether to write the radius of each arc beside its centre.

    Returns
    -------
    dst : ndarray of shape (scale H, scale W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawArcs, fitArcs, linkEdges
    >>> y, x = np.mgrid[:80, :80]
    >>> hole = np.where(np.hypot(x - 40.2, y - 38.7) < 25, 5.0, 1.0)
    >>> drawArcs(hole, fitArcs(linkEdges(hole, pixelSize=1, noise=0.001)), pixelSize=1).shape
    (80, 80, 3)
    """
    if not isinstance(arcs, np.ndarray) or arcs.dtype != ARC:
        raise fail("arcs", "a structured array from fitArcs", described(arcs))
    canvas, scale = canvas_of(src, scale, geometry)
    for arc in arcs:
        points = arc_points(arc)
        if not len(points):
            continue
        places = project(points, **geometry)[:, :2]
        center = project(arc["center"], **geometry)[:2]
        if np.isfinite(places).all():
            _line(canvas, places, int(arc["kind"]), scale, closed=bool(arc["angle"] >= 360))
        if np.isfinite(center).all():
            _dot(canvas, center, _VERTEX, scale)
            if radii:
                _label(canvas, center, f"r {arc['radius']:.4g}", scale)
    return deliver("dst", canvas, dst)


def canvas_of(src: np.ndarray, scale: int, geometry: GeometryOptions) -> tuple[np.ndarray, int]:
    scale = integer("scale", scale, 1, 16)
    canvas = backdrop(src, geometry)
    if scale > 1:
        canvas = cv2.resize(canvas, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    return canvas, scale


def fixed(places: np.ndarray, scale: int) -> np.ndarray:
    """Places as integers of OpenCV, pixel centres being whole numbers in the image as in the picture."""
    return np.rint(((places + 0.5) * scale - 0.5) * (1 << _SHIFT)).astype(np.int32)


def _line(canvas: np.ndarray, places: np.ndarray, kind: int, scale: int, *, closed: bool = False) -> None:
    width = max(1, (scale + 1) // 2)
    cv2.polylines(canvas, [fixed(places, scale)], closed, kind_colour(kind), width, cv2.LINE_AA, _SHIFT)


def _dot(canvas: np.ndarray, place: np.ndarray, colour: tuple[int, int, int], scale: int) -> None:
    x, y = fixed(place, scale).tolist()
    cv2.circle(canvas, (x, y), (scale + 1) << _SHIFT, colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)


def write_lengths(canvas: np.ndarray, segments: np.ndarray, vertices: np.ndarray, scale: int) -> int:
    """Lengths beside segments, of which the long ones choose first, where nothing else is; the result is how many.

    Neither other lengths are, nor vertices; and a segment is no shorter than the text about it.
    """
    taken = np.zeros(canvas.shape[:2], np.uint8)
    for vertex in vertices:
        _dot(taken, np.array([vertex["x"], vertex["y"]]), (1, 1, 1), scale)
    count = 0
    seen = scale * np.linalg.norm(segments["pixels"][:, 1] - segments["pixels"][:, 0], axis=1)
    for i in np.argsort(-seen, kind="stable"):
        text = f"{segments['length'][i]:.3g}"
        (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, _text_size(scale), 1)
        if seen[i] < width:
            break
        first, last = segments["pixels"][i]
        for share in _PLACES:
            place = first + share * (last - first)
            x, y = (fixed(place, scale) >> _SHIFT) + _BESIDE
            box = np.s_[max(y - height - _APART, 0) : y + _APART + 1, max(x - _APART, 0) : x + width + _APART]
            if min(x, y - height) >= 0 and x + width < taken.shape[1] and y < len(taken) and not taken[box].any():
                taken[box] = 1
                _label(canvas, place, text, scale)
                count += 1
                break
    return count


def _text_size(scale: int) -> float:
    return 0.3 + 0.06 * scale


def _label(canvas: np.ndarray, place: np.ndarray, text: str, scale: int) -> None:
    x, y = ((fixed(place, scale) >> _SHIFT) + _BESIDE).tolist()
    for colour, width in ((_HALO, 3), (_INK, 1)):
        cv2.putText(canvas, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, _text_size(scale), colour, width, cv2.LINE_AA)
