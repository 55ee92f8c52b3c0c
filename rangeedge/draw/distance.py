"""Distance maps in colours."""

from __future__ import annotations

import cv2
import numpy as np

from .. import _check
from ..bands import by_bands, chosen

_UNREACHED = (128, 128, 128)  # infinitely far from every edge


@_check.public
def colorizeDistance(
    distance: np.ndarray, dst: np.ndarray | None = None, *, maxDistance: float | None = None, log: bool = False
) -> np.ndarray:
    """Colour a distance map from black at the edges to pale yellow far from them.

    colorizeDistance(distance[, dst], *[, maxDistance[, log]]) -> dst

    The colour map is ``cv2.COLORMAP_INFERNO`` over distance / maxDistance, or over
    log(1 + distance) / log(1 + maxDistance), which brings out the neighbourhood of edges. Infinite distances,
    as in a map without edges, are grey.

    Parameters
    ----------
    distance : ndarray of shape (H, W), CV_32F or any real type
        Distances >= 0; infinity is allowed.
    dst : ndarray of shape (H, W, 3), CV_8U, optional
        Receives the result where shape and type fit.
    maxDistance : float, optional
        Distance from which on the last colour holds, > 0; by default the largest finite one of `distance`.
    log : bool
        Whether the scale is logarithmic, as Rosin and West show theirs.

    Returns
    -------
    dst : ndarray of shape (H, W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If `distance` is not a real (H, W) image or holds NaN or a negative value, or if `maxDistance` is not a
        finite number > 0.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import colorizeDistance
    >>> colorizeDistance(np.float32([[0, 1, np.inf]]))[0]
    array([[  4,   0,   0],
           [164, 255, 252],
           [128, 128, 128]], dtype=uint8)
    """
    distance = checked_distance(distance)
    if maxDistance is not None:
        maxDistance = _check.number("maxDistance", maxDistance, 0, above=True)
    log = _check.boolean("log", log)
    return _check.deliver("dst", distance_colours(distance, maxDistance, log), dst)


def checked_distance(distance: np.ndarray, shape: tuple[int, int] | None = None) -> np.ndarray:
    distance = _check.image32f("distance", distance, shape)
    if not distance.min() >= 0:  # NaN fails the comparison too
        raise _check.fail("distance", ">= 0 everywhere", f"a least value of {distance.min():g}")
    return distance


def distance_colours(distance: np.ndarray, maxDistance: float | None, log: bool) -> np.ndarray:
    if maxDistance is None:
        maxDistance = max(float(own.max(initial=0)) for own in chosen(distance, np.isfinite(distance))) or 1.0

    def coloured(distance: np.ndarray) -> np.ndarray:
        finite = np.isfinite(distance)
        scaled = np.where(finite, np.minimum(distance, maxDistance), 0) / maxDistance
        if log:
            scaled = np.log1p(scaled * maxDistance) / np.log1p(maxDistance)
        colours = cv2.applyColorMap(np.rint(255 * scaled).astype(np.uint8), cv2.COLORMAP_INFERNO)
        colours[~finite] = _UNREACHED
        return colours

    return by_bands(coloured, distance)
