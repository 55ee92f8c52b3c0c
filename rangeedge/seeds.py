"""Seeds: compact markers in the middle of surfaces, far from every edge (paper, 7)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from . import _core
from ._check import array, boolean, error, fail, image8, image32f
from ._option import takes
from .frame import threads_worth
from .options import SEEDING, Seeding

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import SeedingOptions


@takes(SEEDING)
def extractSeeds(
    distance: np.ndarray, *, mask: np.ndarray | None = None, wrap: bool = False, **options: Unpack[SeedingOptions]
) -> tuple[int, np.ndarray]:
    """Markers in the middle of surfaces: the peaks of a distance map, each with the plateau around it.

    extractSeeds(distance, *[, mask[, wrap[, minDistance[, separation]]]]) -> retval, markers

    A pixel is a peak by itself where every 8-connected path to a higher one drops below ``separation`` times its
    distance; its seed is what can be reached from it without doing so, {p: D(p) >= separation D(peak)}. So a gap in an
    edge does not join the seeds of both sides, as long as it is narrower than `separation` times the narrower side.
    Seeds never touch.

    Parameters
    ----------
    distance : (H, W) CV_32F
        Distance to the nearest edge, from `distanceTransform` or `salienceDistanceTransform`; >= 0, +inf allowed. Where
        pixels have no data, count them as edges of the map that is transformed, or leave them out by `mask`.
    mask : (H, W) CV_8U or bool, optional
        Where it is zero there are no seeds, nor ways between them.
    wrap : bool
        Whether the first column follows the last, as in a scan all around.
    {options}

    Returns
    -------
    retval : int
        Number of labels, that of the background included, as from `cv2.connectedComponents`: there are
        ``retval - 1`` seeds.
    markers : (H, W) CV_32S
        1, 2, ... on the seeds in raster order of their first pixels, 0 elsewhere: what `cv2.watershed`,
        `skimage.segmentation.watershed` and `growRegions` take as it is.

    Raises
    ------
    error
        If `distance` is not a real (H, W) image of values >= 0, `mask` does not fit it, or a parameter is out of range.

    Notes
    -----
    Peaks as in h-maxima (Soille, Morphological Image Analysis, 6.3), with h as a share of the peak instead of a
    constant, so that small and large surfaces are treated alike.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import extractSeeds
    >>> distance = np.float32([[0, 1, 2, 3, 2, 1, 2, 3, 4, 3, 2, 1, 0]])
    >>> extractSeeds(distance, minDistance=2, separation=0.75)
    (3, array([[0, 0, 0, 1, 0, 0, 0, 2, 2, 2, 0, 0, 0]], dtype=int32))
    """
    return find_seeds(distance, Seeding(**options), mask, boolean("wrap", wrap))


@takes(SEEDING)
def extractSeedsWithStats(
    distance: np.ndarray, *, mask: np.ndarray | None = None, wrap: bool = False, **options: Unpack[SeedingOptions]
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    """Markers in the middle of surfaces, with the extent and the centre of each.

    extractSeedsWithStats(distance, *[, mask[, wrap[, minDistance[, separation]]]]) -> retval, markers, stats, centroids

    Parameters
    ----------
    distance, mask, wrap
        As for `extractSeeds`.
    {options}

    Returns
    -------
    retval, markers
        As from `extractSeeds`.
    stats : (retval, 5) CV_32S
        Columns ``cv2.CC_STAT_LEFT``, ``CC_STAT_TOP``, ``CC_STAT_WIDTH``, ``CC_STAT_HEIGHT``, ``CC_STAT_AREA``; row 0 is
        the background.
    centroids : (retval, 2) CV_64F
        Means (x, y) of the pixels; NaN for an empty background.

    Raises
    ------
    error
        As `extractSeeds`.

    Examples
    --------
    >>> import cv2
    >>> import numpy as np
    >>> from rangeedge import extractSeedsWithStats
    >>> distance = np.float32([[0, 1, 2, 3, 2, 1, 2, 3, 4, 3, 2, 1, 0]])
    >>> _, _, stats, centroids = extractSeedsWithStats(distance, minDistance=2, separation=0.75)
    >>> stats[1:, cv2.CC_STAT_AREA], centroids[1:, 0]
    (array([1, 3], dtype=int32), array([3., 8.]))
    """
    count, markers = find_seeds(distance, Seeding(**options), mask, boolean("wrap", wrap))
    return count, markers, *label_statistics(markers, count)


def label_statistics(labels: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Bounding box and area, and centroid, of every label 0 .. count - 1, as `cv2.connectedComponentsWithStats`."""
    boxes, centroids = np.empty((count, 5), np.int32), np.empty((count, 2))
    _core.label_statistics(labels, threads_worth(labels.size), boxes, centroids)
    return boxes, centroids


def find_seeds(distance: np.ndarray, seeding: Seeding, mask: np.ndarray | None, wrap: bool) -> tuple[int, np.ndarray]:
    """Number of labels, and markers of the seeds in a distance map."""
    distance = image32f("distance", array("distance", distance, "a real array of shape (H, W)"))
    if distance.size >= 2**30:
        raise error(f"`distance` must have fewer than 2^30 pixels, got {distance.size}", cv2.Error.StsOutOfRange)
    if not distance.min() >= 0:  # NaN fails, too
        raise fail("distance", ">= 0 everywhere", f"a least value of {distance.min():g}")
    mask = None if mask is None else image8("mask", mask, distance.shape)
    markers = np.empty(distance.shape, np.int32)
    threads = threads_worth(distance.size)
    count = _core.extract_seeds(distance, mask, wrap, seeding.minDistance, seeding.separation, threads, markers) + 1
    return count, markers
