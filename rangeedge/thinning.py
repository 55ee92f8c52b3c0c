"""Thin edge maps: one pixel wide, connected as before."""

from __future__ import annotations

import cv2
import numpy as np

from . import _check
from .constants import THIN_ITERATIVE, THIN_LEE, THIN_SKELETON

_METHODS = {"THIN_SKELETON": THIN_SKELETON, "THIN_LEE": THIN_LEE, "THIN_ITERATIVE": THIN_ITERATIVE}


@_check.public
def thinEdges(edges: np.ndarray, method: int = THIN_SKELETON, dst: np.ndarray | None = None) -> np.ndarray:
    """Thin an edge map to lines one pixel wide that are connected as the map was.

    thinEdges(edges[, method[, dst]]) -> dst

    The result is scikit-image's for the whole map, pixel for pixel; only the bounding box of the edges is
    worked on. It is a subset of `edges` and has the same number of 8-connected components; thinning it once
    more changes nothing. Where several lines meet, a few pixels may stay that no connection needs;
    `THIN_LEE` leaves the fewest.

    Parameters
    ----------
    edges : ndarray of shape (H, W), CV_8U or bool
        Edge map, non-zero on edges.
    method : int
        `THIN_SKELETON` (Zhang and Suen; default, the fastest), `THIN_LEE` (Lee, Kashyap and Chu) or
        `THIN_ITERATIVE` (Guo and Hall).
    dst : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit; it may be `edges` itself.

    Returns
    -------
    dst : ndarray of shape (H, W), CV_8U
        255 on thin edges, 0 elsewhere.

    Raises
    ------
    rangeedge.error
        If `edges` is not an 8-bit or bool (H, W) image or `method` is not one of the constants.

    References
    ----------
    .. [1] T. Y. Zhang and C. Y. Suen, "A fast parallel algorithm for thinning digital patterns", 1984.
    .. [2] T.-C. Lee, R. L. Kashyap and C.-N. Chu, "Building skeleton models via 3-D medial surface/axis
       thinning algorithms", 1994.
    .. [3] Z. Guo and R. W. Hall, "Parallel thinning with two-subiteration algorithms", 1989.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import thinEdges
    >>> edges = np.zeros((4, 6), np.uint8)
    >>> edges[1:3] = 255
    >>> thinEdges(edges)
    array([[  0,   0,   0,   0,   0,   0],
           [255, 255, 255, 255, 255, 255],
           [  0,   0,   0,   0,   0,   0],
           [  0,   0,   0,   0,   0,   0]], dtype=uint8)
    """
    edges = _check.image8("edges", edges)
    method = _check.flag("method", method, _METHODS)
    thin = np.zeros_like(edges)
    x, y, width, height = cv2.boundingRect(edges)
    if width:
        box = np.s_[y : y + height, x : x + width]
        thin[box] = _skeleton(edges[box] != 0, method)
        thin *= 255
    return _check.deliver("dst", thin, dst)


def _skeleton(edges: np.ndarray, method: int) -> np.ndarray:
    """The skeleton of a bool image as bool."""
    from skimage import morphology

    if method == THIN_ITERATIVE:
        return morphology.thin(edges)
    return morphology.skeletonize(edges, method="lee" if method == THIN_LEE else "zhang") != 0
