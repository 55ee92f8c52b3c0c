"""Thin edge maps: one pixel wide, connected as before."""

from __future__ import annotations

import cv2
import numpy as np

from . import _check, _core
from .cancellation import apart
from .constants import THIN_ITERATIVE, THIN_LEE, THIN_MEDIAL, THIN_SKELETON
from .pixels import all_around

_METHODS = {
    "THIN_SKELETON": THIN_SKELETON,
    "THIN_LEE": THIN_LEE,
    "THIN_ITERATIVE": THIN_ITERATIVE,
    "THIN_MEDIAL": THIN_MEDIAL,
}


@_check.public
def thinEdges(
    edges: np.ndarray,
    method: int = THIN_MEDIAL,
    dst: np.ndarray | None = None,
    *,
    spurLength: int = 5,
    wrap: bool = False,
) -> np.ndarray:
    """Thin an edge map to lines one pixel wide that are connected as the map was.

    thinEdges(edges[, method[, dst]], *[, spurLength[, wrap]]) -> dst

    The lines are a subset of `edges` with the same number of 8-connected components and of holes, they are as long
    as the bands they come from, and run into the image border where these do. No pixel can be spared but the ends of
    lines: a square of four is left only where lines meet. Thinning once more changes nothing.

    Parameters
    ----------
    edges : ndarray of shape (H, W), CV_8U or bool
        Edge map, non-zero on edges.
    method : int
        Where in its band a line runs. `THIN_MEDIAL` (default, and the fastest): in the middle; bands are peeled from
        all sides alike [1]_, so that a mirrored map gives mirrored lines, bands of an even width aside, where one of
        the two middle pixels has to go. The others run where scikit-image's skeleton does, `THIN_SKELETON` where that
        of Zhang and Suen [2]_ does, `THIN_LEE` of Lee, Kashyap and Chu [3]_, `THIN_ITERATIVE` of Guo and Hall [4]_;
        bands that these shorten or delete, and blocks that they leave, are thinned as by `THIN_MEDIAL`.
    dst : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit; it may be `edges` itself.
    spurLength : int
        Branches that end freely after fewer pixels than that are removed, those inside the band that they leave not
        counted; 0 keeps all. A line with two free ends is no branch, however short.
    wrap : bool
        Whether the first column follows the last, as in a scan all around.

    Returns
    -------
    dst : ndarray of shape (H, W), CV_8U
        255 on thin edges, 0 elsewhere.

    Raises
    ------
    rangeedge.error
        If `edges` is not an 8-bit or bool (H, W) image, `method` is not one of the constants, or `spurLength` is
        negative or no integer.

    References
    ----------
    .. [1] G. Bertrand and M. Couprie, "Two-dimensional parallel thinning algorithms based on critical kernels", 2008.
    .. [2] T. Y. Zhang and C. Y. Suen, "A fast parallel algorithm for thinning digital patterns", 1984.
    .. [3] T.-C. Lee, R. L. Kashyap and C.-N. Chu, "Building skeleton models via 3-D medial surface/axis
       thinning algorithms", 1994.
    .. [4] Z. Guo and R. W. Hall, "Parallel thinning with two-subiteration algorithms", 1989.

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
    spurLength = _check.integer("spurLength", spurLength, 0)
    if _check.boolean("wrap", wrap):
        return _check.deliver("dst", all_around(edges, lambda wide: _thin(wide, method, spurLength)), dst)
    return _check.deliver("dst", _thin(edges, method, spurLength), dst)


def _thin(edges: np.ndarray, method: int, spur_length: int) -> np.ndarray:
    thin = np.empty_like(edges)
    _core.thin_lines(edges, None if method == THIN_MEDIAL else _skeleton(edges, method), spur_length, thin)
    return thin


def _skeleton(edges: np.ndarray, method: int) -> np.ndarray:
    """scikit-image's skeleton, 0 and 1; only the bounding box of the edges is worked on."""
    from skimage import morphology

    skeleton = np.zeros_like(edges)
    x, y, width, height = cv2.boundingRect(edges)
    if width:
        box = np.s_[y : y + height, x : x + width]
        if method == THIN_ITERATIVE:
            skeleton[box] = apart(edges.size, morphology.thin, edges[box] != 0)
        else:
            kind = "lee" if method == THIN_LEE else "zhang"
            skeleton[box] = apart(edges.size, morphology.skeletonize, edges[box] != 0, method=kind) != 0
    return skeleton
