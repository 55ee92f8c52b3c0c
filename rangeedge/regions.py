"""Regions: surfaces grown from seeds under the noise model, one label each."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._args import boolean, image8, integer, labels32s, number
from .detector import found_edges
from .distance import distanceTransform
from .edges import ScanLineParams
from .geometry import RangeFrame, range_frame
from .noise import kernel_noise, noise_of
from .seeds import extractSeeds, label_statistics, seeding
from .selection import Selection
from .surfaces import surface_map, surfaces_of


class Growing(NamedTuple):
    """How seeds are found and regions grow from them, with the defaults of `segmentRegions`."""

    minDistance: float = 3.0
    separation: float = 0.65
    tolerance: float = 3.0
    smoothAngle: float = 8.0
    minArea: int = 100

    def checked(self, func: str) -> Growing:
        """The same with every value of its own type; an error names `func`."""
        return Growing(
            *seeding(func, self.minDistance, self.separation),
            number(func, "tolerance", self.tolerance, 0, above=True),
            number(func, "smoothAngle", self.smoothAngle, 0, 30),
            integer(func, "minArea", self.minArea, 1),
        )


_DEFAULT = Growing()


def growRegions(
    src: np.ndarray,
    markers: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    tolerance: float = _DEFAULT.tolerance,
    smoothAngle: float = _DEFAULT.smoothAngle,
    minArea: int = _DEFAULT.minArea,
    newSeeds: bool = False,
) -> np.ndarray:
    """Grow regions from markers: pixels go to the surface they lie on, edges keep surfaces apart.

    growRegions(src, markers, *[, edges[, K[, pixelSize[, heightMap[, depthFactor[, mask[, noise[, tolerance
    [, smoothAngle[, minArea[, newSeeds]]]]]]]]]]]) -> labels

    1. *Surfaces*: each marker gets a plane by least squares; a quadratic where the plane fails; two planes that meet
       in a crease where those are better than the quadratic, as behind a gap in an edge.
    2. *Growing*: surfaces compete for the free pixels around them, up to `tolerance` standard deviations, and not into
       edges: for tiles of 8 x 8 and 4 x 4 pixels without an edge first, the smallest misfit first, then pixel by pixel.
       They are fitted anew while they grow. A quadratic that has turned around a crease is cut in two.
    3. *Merging*: patches that one surface describes as well as their own join; so do patches that meet along most of
       their border under less than `smoothAngle`, or three times that where one of them is curved. What is small beside
       its neighbour joins one, and never links two, unless it lies between them like the bend of a strip.
    4. *Borders*: edge pixels, and others that are left, go to the neighbouring surface they fit best, up to twice the
       tolerance. Strips along rounded edges and regions below `minArea` fall to their neighbours.

    Residuals are perpendicular to nothing but the image: of inverse depth for a camera, of height on a grid, where
    planes are planes. Their standard deviation is that of the noise, scaled by up to 8 to how much tiles of pixels err
    together and to the typical misfit of the markers, since the noise of many sensors is correlated between pixels; on
    slopes that of the pixel's place comes on top. Labels do not depend on the number of threads.

    Parameters
    ----------
    src, K, pixelSize, heightMap, depthFactor, mask
        Range image and its geometry, as for `edgeStrength`.
    markers : (H, W) CV_32S
        Labels > 0 on the pixels to start from, as from `extractSeeds`; several may lie on one surface.
    edges : (H, W) CV_8U or bool, optional
        Edge map, non-zero on edges.
    noise : NoiseModel, float or (H, W) array, optional
        Noise of the range image; estimated from it by default.
    tolerance : float
        How far a pixel may lie off its surface, in standard deviations, > 0.
    smoothAngle : float
        Angle in degrees below which surfaces that meet without an edge go on into each other, from 0 to 30.
    minArea : int
        Least area of a region, in pixels.
    newSeeds : bool
        Whether areas that no marker reaches grow regions of their own; among edges too dense to be any, where one
        surface fits all of such an area.

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
    >>> depth = np.tile(np.abs(np.arange(60.0) - 30), (60, 1))
    >>> markers = np.zeros((60, 60), np.int32)
    >>> markers[20:40, 10:20], markers[20:40, 40:50] = 7, 9
    >>> growRegions(depth, markers, noise=0.1)[0, [0, 29, 31, 59]]
    array([1, 1, 2, 2], dtype=int32)
    """
    func = "growRegions"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    growing = Growing(tolerance=tolerance, smoothAngle=smoothAngle, minArea=minArea)
    return _grow(func, frame, markers, edges, noise, growing, newSeeds)


def growRegionsWithStats(
    src: np.ndarray,
    markers: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    tolerance: float = _DEFAULT.tolerance,
    smoothAngle: float = _DEFAULT.smoothAngle,
    minArea: int = _DEFAULT.minArea,
    newSeeds: bool = False,
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Grow regions from markers, and describe each: extent, centre and surface.

    growRegionsWithStats(src, markers, *[, edges[, ...]]) -> retval, labels, stats, centroids, surfaces

    Parameters are those of `growRegions`, results those of `segmentRegionsWithStats`.

    Examples
    --------
    >>> markers = np.zeros((40, 50), np.int32)
    >>> markers[10:30, 10:30] = 1
    >>> count, labels, stats, centroids, surfaces = growRegionsWithStats(np.ones((40, 50)), markers)
    >>> count, stats[1], surfaces["normal"][1] + 0.0
    (2, array([   0,    0,   50,   40, 2000], dtype=int32), array([ 0.,  0., -1.]))
    """
    func = "growRegionsWithStats"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    growing = Growing(tolerance=tolerance, smoothAngle=smoothAngle, minArea=minArea)
    return described_regions(frame, _grow(func, frame, markers, edges, noise, growing, newSeeds), heightMap)


def segmentRegions(
    src: np.ndarray,
    *,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    edges: np.ndarray | None = None,
    minDistance: float = _DEFAULT.minDistance,
    separation: float = _DEFAULT.separation,
    tolerance: float = _DEFAULT.tolerance,
    smoothAngle: float = _DEFAULT.smoothAngle,
    minArea: int = _DEFAULT.minArea,
) -> np.ndarray:
    """Segment a range image into surfaces: one label for each face of a polyhedron, cylinder, sphere.

    segmentRegions(src, *[, K[, pixelSize[, heightMap[, depthFactor[, mask[, noise[, edges[, minDistance[, separation
    [, tolerance[, smoothAngle[, minArea]]]]]]]]]]]]) -> labels

    `detectEdges`, `distanceTransform` to the edges and to pixels without data, `extractSeeds`, `growRegions` with
    new seeds where none has reached.

    Parameters
    ----------
    src, K, pixelSize, heightMap, depthFactor, mask
        Range image and its geometry, as for `edgeStrength`.
    noise : NoiseModel, float or (H, W) array, optional
        Noise of the range image; estimated from it by default.
    edges : (H, W) CV_8U or bool, optional
        Edge map to use instead of that of `detectEdges` with its defaults.
    minDistance, separation
        Of the seeds, as for `extractSeeds`.
    tolerance, smoothAngle, minArea
        Of the regions, as for `growRegions`.

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

    >>> x = np.arange(90)
    >>> depth = np.tile(np.where(x < 30, 60.0, abs(x - 60)), (60, 1))
    >>> segmentRegions(depth, noise=0.1)[30, [0, 29, 31, 57, 63, 89]]
    array([1, 1, 2, 2, 3, 3], dtype=int32)
    """
    func = "segmentRegions"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    growing = Growing(minDistance, separation, tolerance, smoothAngle, minArea)
    return _segment(func, frame, noise, edges, growing)


def segmentRegionsWithStats(
    src: np.ndarray,
    *,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    edges: np.ndarray | None = None,
    minDistance: float = _DEFAULT.minDistance,
    separation: float = _DEFAULT.separation,
    tolerance: float = _DEFAULT.tolerance,
    smoothAngle: float = _DEFAULT.smoothAngle,
    minArea: int = _DEFAULT.minArea,
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Segment a range image into surfaces, and describe each: extent, centre and surface.

    segmentRegionsWithStats(src, *[, K[, ...]]) -> retval, labels, stats, centroids, surfaces

    Parameters
    ----------
    src, K, ...
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
    >>> x = np.arange(90)
    >>> depth = np.tile(np.where(x < 30, 60.0, abs(x - 60)), (60, 1))
    >>> count, labels, stats, centroids, surfaces = segmentRegionsWithStats(depth, noise=0.1)
    >>> count, surfaces["curved"].tolist(), surfaces["normal"][1].round(3) + 0.0
    (4, [False, False, False, False], array([ 0.,  0., -1.]))
    """
    func = "segmentRegionsWithStats"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    growing = Growing(minDistance, separation, tolerance, smoothAngle, minArea)
    return described_regions(frame, _segment(func, frame, noise, edges, growing), heightMap)


def _segment(func: str, frame: RangeFrame, noise: Any, edges: np.ndarray | None, growing: Growing) -> np.ndarray:
    growing = growing.checked(func)
    noise = noise_of(frame) if noise is None else noise
    if edges is None:
        edges = found_edges(func, frame, ScanLineParams(noise=noise), Selection().checked(func)).thin
    else:
        edges = image8(func, "edges", edges, frame.shape)
    return seeded_regions(func, frame, edges, noise, growing)[1]


def seeded_regions(
    func: str, frame: RangeFrame, edges: np.ndarray, noise: Any, growing: Growing
) -> tuple[np.ndarray, np.ndarray]:
    """Seeds between the edges of a checked range image, and the regions that grow from them."""
    distance = distanceTransform((edges != 0) | (frame.valid == 0))
    _, seeds = extractSeeds(distance, minDistance=growing.minDistance, separation=growing.separation)
    return seeds, _grow(func, frame, seeds, edges, noise, growing, True)


def _grow(
    func: str,
    frame: RangeFrame,
    markers: np.ndarray,
    edges: np.ndarray | None,
    noise: Any,
    growing: Growing,
    newSeeds: bool,
) -> np.ndarray:
    markers = labels32s(func, "markers", markers, frame.shape)
    edges = None if edges is None else image8(func, "edges", edges, frame.shape)
    growing = growing.checked(func)
    parameters = _core.RegionParameters(
        tolerance=growing.tolerance,
        smooth_angle=growing.smoothAngle,
        min_area=growing.minArea,
        new_seeds=boolean(func, "newSeeds", newSeeds),
    )
    arguments = surface_map(frame, *kernel_noise(func, noise, frame))
    arguments["edges"] = edges
    labels = np.empty(frame.shape, np.int32)
    _core.grow_regions(**arguments, markers=markers, parameters=parameters, labels=labels)
    return labels


def described_regions(
    frame: RangeFrame, labels: np.ndarray, heightMap: bool
) -> tuple[int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `segmentRegionsWithStats` returns of labelled regions."""
    count = int(labels.max()) + 1
    return count, labels, *label_statistics(labels, count), surfaces_of(frame, labels, count, heightMap)
