"""Edges over range images."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import _check
from .._option import takes
from ..options import GEOMETRY
from .palette import colour_index, paint
from .relief import backdrop

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._typed import GeometryOptions


@takes(GEOMETRY)
def drawEdges(
    src: np.ndarray,
    edges: np.ndarray,
    kind: np.ndarray | None = None,
    dst: np.ndarray | None = None,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Draw edges over the shaded relief of a range image, or over a picture.

    drawEdges(src, edges[, kind[, dst]], *[, K[, ...]]) -> dst

    With `kind`: jump vermilion on the nearer side and purple on the farther side, convex yellow, concave blue, beside
    no data grey, anything else white; a jump hides a crease. Without it every edge is white. Pixels without data are
    hatched.

    Parameters
    ----------
    src : ndarray
        A range image (H, W), points (H, W, 3) or (H, W, 4) of floats, or a CV_8UC3 picture to draw on.
    edges : ndarray of shape (H, W), CV_8U or bool
        Edge map, non-zero on edges.
    kind : ndarray of shape (H, W), CV_8U, optional
        Bits `EDGE_JUMP`, `EDGE_CONVEX`, ... of every pixel, as `edgeStrength` returns them.
    dst : ndarray of shape (H, W, 3), CV_8U, optional
        Receives the result where shape and type fit; it may be `src` itself.
    {options}

    Returns
    -------
    dst : ndarray of shape (H, W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If an image has a wrong type or shape, or shapes differ.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawEdges
    >>> depth, edges = np.ones((4, 6), np.float32), np.zeros((4, 6), np.uint8)
    >>> edges[:, 2] = 255
    >>> drawEdges(depth, edges)[0, 2]
    array([255, 255, 255], dtype=uint8)
    """
    canvas = backdrop(src, geometry)
    edges = _check.image8("edges", edges, canvas.shape[:2])
    kind = None if kind is None else _check.image8("kind", kind, edges.shape)
    paint(canvas, colour_index(edges != 0, kind))
    return _check.deliver("dst", canvas, dst)
