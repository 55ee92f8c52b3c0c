"""Pictures of outlines, in the colours of `drawRegions`."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import cv2
import numpy as np

from .. import _check
from .._option import takes
from ..boundaries import RegionBoundaries
from ..options import GEOMETRY
from .lines import canvas_of, fixed
from .regions import REGION_COLOURS, shared_out

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._typed import GeometryOptions

_SHIFT = 4  # binary digits of fractions of a pixel, as `fixed` has them
_LINE = (255, 255, 255)
_HALO = (32, 32, 32)
_MEETING = 3  # regions at a corner that is drawn


@takes(GEOMETRY)
def drawBoundaries(
    src: np.ndarray,
    boundaries: RegionBoundaries,
    alpha: float = 0.45,
    dst: np.ndarray | None = None,
    *,
    scale: int = 1,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Draw outlines of regions over the shaded relief of a range image, or over a picture.

    drawBoundaries(src, boundaries[, alpha[, dst]], *[, scale[, K[, ...]]]) -> dst

    Regions are filled with the colours of `drawRegions`, their borders are white lines, and corners in which three of
    them meet are white dots.

    Parameters
    ----------
    src : ndarray
        A range image (H, W), points (H, W, 3) or (H, W, 4) of floats, or a CV_8UC3 picture to draw on.
    boundaries : RegionBoundaries
        From `regionBoundaries`.
    alpha : float
        Opacity of the regions, in [0, 1].
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
    >>> from rangeedge import drawBoundaries, regionBoundaries
    >>> labels = np.zeros((20, 30), np.int32)
    >>> labels[2:12, 3:23] = 1
    >>> drawBoundaries(np.ones((20, 30)), regionBoundaries(labels), scale=4).shape
    (80, 120, 3)
    """
    if not isinstance(boundaries, RegionBoundaries):
        raise _check.fail("boundaries", "RegionBoundaries", _check.described(boundaries))
    alpha = _check.number("alpha", alpha, 0, 1)
    canvas, scale = canvas_of(src, scale, geometry)
    if alpha > 0:
        filled = canvas.copy()
        colours = _colours(boundaries.arcs)
        for region in boundaries:
            rings = [fixed(_places(ring), scale) for ring in (region.outline, *region.holes)]
            cv2.fillPoly(filled, rings, colours[region.label], cv2.LINE_AA, _SHIFT)
        canvas = cv2.addWeighted(filled, alpha, canvas, 1 - alpha, 0)
    lines = [fixed(boundaries.vertices[arc["first"] : arc["first"] + arc["count"]], scale) for arc in boundaries.arcs]
    width = max(1, (scale + 1) // 2)
    for colour, more in ((_HALO, 2), (_LINE, 0)):
        cv2.polylines(canvas, lines, False, colour, width + more, cv2.LINE_AA, _SHIFT)
    for place in fixed(_corners(boundaries), scale).tolist():
        for colour, more in ((_HALO, 2), (_LINE, 1)):
            cv2.circle(canvas, place, (width + more) << _SHIFT, colour, cv2.FILLED, cv2.LINE_AA, _SHIFT)
    return _check.deliver("dst", canvas, dst)


def _places(points: np.ndarray) -> np.ndarray:
    return np.column_stack([points["x"], points["y"]])


def _colours(arcs: np.ndarray) -> dict[int, tuple[int, ...]]:
    """Colours of labels, of neighbours different ones."""
    names, index = np.unique([arcs["right"], arcs["left"]], return_inverse=True)
    neighbours = defaultdict(set)
    for i, j in index.reshape(2, -1).T.tolist():
        if i != j and min(names[i], names[j]) > 0:
            neighbours[i].add(j)
            neighbours[j].add(i)
    choice = shared_out(names, neighbours)
    return dict(zip(names.tolist(), map(tuple, REGION_COLOURS[choice].tolist()), strict=True))


def _corners(boundaries: RegionBoundaries) -> np.ndarray:
    """Where three regions meet."""
    arcs = boundaries.arcs
    ends = np.concatenate([boundaries.vertices[at] for at in (arcs["first"], arcs["first"] + arcs["count"] - 1)])
    around = np.concatenate([np.stack([arcs["right"], arcs["left"]], axis=1)] * 2)
    places, corner = np.unique(ends, axis=0, return_inverse=True)
    known = np.unique(np.column_stack([np.repeat(corner.ravel(), 2), around.ravel()]), axis=0)
    count = np.bincount(known[known[:, 1] > 0, 0], minlength=len(places))
    return places[count >= _MEETING]
