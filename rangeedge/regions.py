"""Regions: surfaces grown from seeds under the noise model, one label each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._check import boolean, image8, labels32s
from ._option import parsed, takes
from .detection import run_detector
from .distance import distanceTransform
from .frame import Frame
from .noise import measured_frame
from .options import GROWING, SEGMENTING, Growing, ScanLineParams, Selection
from .panorama import joined_labels
from .sectors import around, sectors_of
from .seeds import find_seeds, label_statistics
from .surfaces import surface_map, surfaces_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import GrowingOptions, SegmentingOptions


@takes(GROWING)
def growRegions(
    src: np.ndarray,
    markers: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    newSeeds: bool = False,
    **options: Unpack[GrowingOptions],
) -> np.ndarray:
    """Grow regions from markers: pixels go to the surface they lie on, edges keep surfaces apart.

    growRegions(src, markers, *[, edges[, mask[, newSeeds[, K[, ...]]]]]) -> labels

    1. *Surfaces*: each marker gets a plane by least squares; a quadratic where the plane fails; two planes that meet
       in a crease where those are better than the quadratic, as behind a gap in an edge.
    2. *Growing*: surfaces compete for the free pixels around them, up to `tolerance` standard deviations, and not into
       edges: for tiles of 8 x 8 and 4 x 4 pixels without an edge first, the smallest misfit first, then pixel by pixel.
       They are fitted anew while they grow. A quadratic that has turned around a crease is cut in two.
    3. *Merging*: patches that one surface describes as well as their own join; so do patches that meet along most of
       their border under less than `smoothAngle`, or three times that where one of them is curved. What is small beside
       its neighbour joins one, and never links two, unless it lies between them like the bend of a strip. Strips of
       few pixels across that meet end to end, with no edge between, are one.
    4. *Borders*: edge pixels, and others that are left, go to the neighbouring surface they fit best, up to twice the
       tolerance. Strips along rounded edges and regions below `minArea` fall to their neighbours.

    Residuals are perpendicular to nothing but the image: of inverse depth for a camera, of height on a grid, where
    planes are planes. Their standard deviation is that of the noise, scaled by up to 8 to how much tiles of pixels err
    together and to the typical misfit of the markers, since the noise of many sensors is correlated between pixels; on
    slopes that of the pixel's place comes on top. Labels do not depend on the number of threads.

    Parameters
    ----------
    src : ndarray
        Range image, as for `edgeStrength`.
    markers : (H, W) CV_32S
        Labels > 0 on the pixels to start from, as from `extractSeeds`; several may lie on one surface.
    edges : (H, W) CV_8U or bool, optional
        Edge map, non-zero on edges.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    newSeeds : bool
        Whether areas that no marker reaches grow regions of their own; among edges too dense to be any, where one
        surface fits all of such an area.
    {options}

    Returns
    -------
    labels : (H, W) CV_32S
        1, 2, ... in raster order of first pixels; every region is 4-connected. 0 without data and where nothing fits.

    Raises
    ------
    rangeedge.error
        If an argument has a wrong type, shape or range.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import growRegions
    >>> depth = np.tile(np.abs(np.arange(60.0) - 30), (60, 1))
    >>> markers = np.zeros((60, 60), np.int32)
    >>> markers[20:40, 10:20], markers[20:40, 40:50] = 7, 9
    >>> growRegions(depth, markers, noise=0.1)[0, [0, 29, 31, 59]]
    array([1, 1, 2, 2], dtype=int32)
    """
    return _grown(src, markers, edges, mask, newSeeds, options)[1]


@takes(GROWING)
def growRegionsWithStats(
    src: np.ndarray,
    markers: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    newSeeds: bool = False,
    **options: Unpack[GrowingOptions],
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Grow regions from markers, and describe each: extent, centre and surface.

    growRegionsWithStats(src, markers, *[, edges[, ...]]) -> retval, labels, stats, centroids, surfaces

    Parameters are those of `growRegions`, results those of `segmentRegionsWithStats`.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import growRegionsWithStats
    >>> markers = np.zeros((40, 50), np.int32)
    >>> markers[10:30, 10:30] = 1
    >>> count, labels, stats, centroids, surfaces = growRegionsWithStats(np.ones((40, 50)), markers)
    >>> count, stats[1], surfaces["normal"][1] + 0.0
    (2, array([   0,    0,   50,   40, 2000], dtype=int32), array([ 0.,  0., -1.]))
    """
    return described_regions(*_grown(src, markers, edges, mask, newSeeds, options))


@takes(SEGMENTING)
def segmentRegions(
    src: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    **options: Unpack[SegmentingOptions],
) -> np.ndarray:
    """Segment a range image into surfaces: one label for each face of a polyhedron, cylinder, sphere.

    segmentRegions(src, *[, edges[, mask[, K[, ...]]]]) -> labels

    `detectEdges`, `distanceTransform` to the edges and to pixels without data, `extractSeeds`, `growRegions` with
    new seeds where none has reached.

    Parameters
    ----------
    src : ndarray
        Range image, as for `edgeStrength`.
    edges : (H, W) CV_8U or bool, optional
        Edge map to use instead of that of `detectEdges` with its defaults.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    {options}

    Returns
    -------
    labels : (H, W) CV_32S
        1, 2, ... in raster order of first pixels; every region is 4-connected. 0 without data and where nothing fits.

    Raises
    ------
    rangeedge.error
        If an argument has a wrong type, shape or range.

    Examples
    --------
    A step and a roof:

    >>> import numpy as np
    >>> from rangeedge import segmentRegions
    >>> x = np.arange(90)
    >>> depth = np.tile(np.where(x < 30, 60.0, abs(x - 60)), (60, 1))
    >>> segmentRegions(depth, noise=0.1)[30, [0, 29, 31, 57, 63, 89]]
    array([1, 1, 2, 2, 3, 3], dtype=int32)
    """
    return _segmented(src, edges, mask, options)[1]


@takes(SEGMENTING)
def segmentRegionsWithStats(
    src: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    mask: np.ndarray | None = None,
    **options: Unpack[SegmentingOptions],
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Segment a range image into surfaces, and describe each: extent, centre and surface.

    segmentRegionsWithStats(src, *[, edges[, mask[, K[, ...]]]]) -> retval, labels, stats, centroids, surfaces

    Parameters
    ----------
    src, edges, mask, K, ...
        As for `segmentRegions`.

    Returns
    -------
    retval : int
        Number of labels, that of the background included, as from `cv2.connectedComponentsWithStats`.
    labels : (H, W) CV_32S
        As from `segmentRegions`.
    stats : (retval, 5) CV_32S
        Columns ``cv2.CC_STAT_LEFT``, ``CC_STAT_TOP``, ``CC_STAT_WIDTH``, ``CC_STAT_HEIGHT``, ``CC_STAT_AREA``; row 0 is
        the background.
    centroids : (retval, 2) CV_64F
        Means (x, y) of the pixels.
    surfaces : (retval,) structured array
        Fields, in the coordinates and the unit of the range image (those of the camera with `K`; columns and rows times
        `pixelSize` on a grid):

        - ``curved``: whether a plane does not describe the region;
        - ``centroid``, ``normal``: mean of the points, and unit normal there, toward the viewer;
        - ``quadric``: (a, b, ..., j) of a x^2 + b y^2 + c z^2 + d xy + e xz + f yz + g x + h y + i z + j = 0, scaled so
          that the value is about the distance from the surface; of a plane, only g, h, i, j are not 0;
        - ``rms``: root mean square distance of the points from the surface.

        Row 0 is 0.

    Raises
    ------
    rangeedge.error
        As `segmentRegions`.

    Notes
    -----
    Quadrics after Taubin, PAMI 13(11), 1991.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import segmentRegionsWithStats
    >>> x = np.arange(90)
    >>> depth = np.tile(np.where(x < 30, 60.0, abs(x - 60)), (60, 1))
    >>> count, labels, stats, centroids, surfaces = segmentRegionsWithStats(depth, noise=0.1)
    >>> count, surfaces["curved"].tolist(), surfaces["normal"][1].round(3) + 0.0
    (4, [False, False, False, False], array([ 0.,  0., -1.]))
    """
    return described_regions(*_segmented(src, edges, mask, options))


def _grown(
    src: np.ndarray,
    markers: np.ndarray,
    edges: np.ndarray | None,
    mask: np.ndarray | None,
    newSeeds: bool,
    options: Mapping[str, Any],
) -> tuple[Frame, np.ndarray]:
    params, growing = parsed(options, ScanLineParams, Growing)
    frame = measured_frame(src, params, mask)
    markers = labels32s("markers", markers, frame.shape)
    edges = None if edges is None else image8("edges", edges, frame.shape)
    return frame, _grow(frame, markers, edges, growing, boolean("newSeeds", newSeeds))


def _segmented(
    src: np.ndarray, edges: np.ndarray | None, mask: np.ndarray | None, options: Mapping[str, Any]
) -> tuple[Frame, np.ndarray]:
    params, growing = parsed(options, ScanLineParams, Growing)
    frame = measured_frame(src, params, mask)
    edges = run_detector(frame, params, Selection())[0] if edges is None else image8("edges", edges, frame.shape)
    return frame, seeded_regions(frame, edges, growing)[1]


def seeded_regions(frame: Frame, edges: np.ndarray, growing: Growing) -> tuple[np.ndarray, np.ndarray]:
    """Seeds between the edges of a checked range image, and the regions that grow from them."""
    distance = around(frame, distanceTransform, (edges != 0) | (frame.valid == 0))
    seeds = around(frame, lambda distance, wrap: find_seeds(distance, growing, None, wrap)[1], distance)
    return seeds, _grow(frame, seeds, edges, growing, True)


def _grow(frame: Frame, markers: np.ndarray, edges: np.ndarray | None, growing: Growing, new_seeds: bool) -> np.ndarray:
    parts = sectors_of(frame)
    if parts:
        grown = [
            _grow(part.frame, part.take(markers), None if edges is None else part.take(edges), growing, new_seeds)
            for part in parts
        ]
        return joined_labels(frame, parts, grown, growing.minArea)
    options = _core.RegionOptions(
        tolerance=growing.tolerance,
        smooth_angle=growing.smoothAngle,
        min_area=growing.minArea,
        new_seeds=new_seeds,
    )
    labels = np.empty(frame.shape, np.int32)
    _core.grow_regions(surface_map(frame, edges), markers, options, frame.threads, labels)
    return labels


def described_regions(frame: Frame, labels: np.ndarray) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `segmentRegionsWithStats` returns of labelled regions."""
    count = int(labels.max()) + 1
    return count, labels, *label_statistics(labels, count), surfaces_of(frame, labels, count)
