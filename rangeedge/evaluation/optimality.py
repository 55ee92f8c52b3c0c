"""How near the strength of a crease comes to the true angle: the simulation of the paper, 5, and the detector."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import cv2
import numpy as np

from .. import _check
from ..constants import CREASE_MAX, CREASE_NORMAL
from ..edges import edgeStrength

MAX_SLANT = 70.0  # degrees; steeper planes are rarely seen (paper, 5)

_CREASE = {"CREASE_MAX": CREASE_MAX, "CREASE_NORMAL": CREASE_NORMAL}
# Unit directions (x, y) in the image of rows, columns and the two diagonals.
_SECTIONS = np.array([(1, 0), (0, 1), (0.5**0.5, -(0.5**0.5)), (0.5**0.5, 0.5**0.5)])

_ERROR_EDGES = np.arange(-6.0, 61.0, 0.5)
_SLANT_EDGES = np.linspace(0, MAX_SLANT, 29)


class ErrorStatistics(NamedTuple):
    """Estimation errors E in brief; all but `count` and `over` in degrees."""

    count: int
    mean: float  # of |E|
    deviation: float  # of |E|
    bias: float  # mean of E
    largest: float  # |E|
    over: float  # share of the pairs whose strength is above the true angle

    def __str__(self) -> str:
        return (
            f"|E| {self.mean:.2f} ± {self.deviation:.2f}, largest {self.largest:.2g}, bias {self.bias:+.2f}, "
            f"over-estimated {100 * self.over:.0f} %"
        )


class OptimalityAnalysis(NamedTuple):
    """What Figure 6 of the paper shows. Bins without a pair are NaN."""

    statistics: ErrorStatistics
    errorEdges: np.ndarray  # (n + 1,) limits of the bins of E
    histogram: np.ndarray  # (n,) pairs per bin of E
    slantEdges: np.ndarray  # (m + 1,) limits of the bins of slant, and of the angle A
    slantMean: np.ndarray  # (m, m) mean of |E| over the slants of both planes
    slantDeviation: np.ndarray  # (m, m)
    sectionMean: np.ndarray  # (m,) mean of |E| over the angle A of the optimal section with the z axis
    sectionDeviation: np.ndarray  # (m,)


@_check.public
def geodesicDome(frequency: int, maxSlant: float = 180.0) -> np.ndarray:
    """Near-uniform directions: the cells of a geodesic dome over the icosahedron.

    geodesicDome(frequency[, maxSlant]) -> directions

    Every edge of the icosahedron is divided into f equal parts, which makes f^2 triangles of each of its 20 faces;
    their centres are projected onto the unit sphere (paper, 5).

    Parameters
    ----------
    frequency : int
        The number f of parts, 1 to 256.
    maxSlant : float
        Only directions at less than this angle to the z axis, in degrees.

    Returns
    -------
    (n, 3) float64 array
        Unit vectors, 20 f^2 of them without `maxSlant`.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type or range.

    Examples
    --------
    >>> from rangeedge.optimality import geodesicDome
    >>> geodesicDome(4).shape, geodesicDome(4, maxSlant=70).shape
    ((320, 3), (102, 3))
    """
    frequency = _check.integer("frequency", frequency, 1, 256)
    maxSlant = _check.number("maxSlant", maxSlant, 0.0, 180.0, above=True)
    i, j = np.indices((frequency, frequency)).reshape(2, -1)
    upward = np.stack([i, j], 1)[i + j < frequency] + 1 / 3
    downward = np.stack([i, j], 1)[i + j < frequency - 1] + 2 / 3
    weights = np.concatenate([upward, downward]) / frequency
    weights = np.column_stack([1 - weights.sum(1), weights])
    centres = (weights @ _icosahedron_faces()).reshape(-1, 3)
    directions = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    if maxSlant == 180:
        return directions
    return directions[directions[:, 2] > np.cos(np.radians(maxSlant))]


@_check.public
def creaseAngle(normals1: np.ndarray, normals2: np.ndarray) -> np.ndarray:
    """The true strength of a crease edge: the angle between the normals of its two planes.

    creaseAngle(normals1, normals2) -> angles

    Paper, 2, formula 1, in degrees; accurate for the smallest and the largest angles too.

    Parameters
    ----------
    normals1, normals2 : (..., 3) real arrays
        Normals (a, b, c) of the planes a x + b y + c z = 0, of any length, towards the viewer (c > 0).
        Their shapes broadcast.

    Returns
    -------
    (...) float64 array
        From 0 to 180.

    Raises
    ------
    rangeedge.error
        On normals of the wrong type or shape, or that do not face the viewer.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.optimality import creaseAngle
    >>> float(creaseAngle(np.array([1.0, 0, 1]), np.array([-1.0, 0, 1])).round(9))
    90.0
    """
    return _angle_between(*_normal_pair(normals1, normals2))


@_check.public
def directionalAngles(normals1: np.ndarray, normals2: np.ndarray) -> np.ndarray:
    """Strengths of a crease edge as the four directional sections see it.

    directionalAngles(normals1, normals2) -> angles

    The section along the unit image direction d shows the plane (a, b, c) as a line of slope -(a dx + b dy) / c;
    its strength is the angle between the two lines (paper, 4.2), in degrees.

    Parameters
    ----------
    normals1, normals2 : (..., 3) real arrays
        As for `creaseAngle`.

    Returns
    -------
    (..., 4) float64 array
        Angles of rows, columns, the 45 and the 135 degree diagonal, from 0 to 180.

    Raises
    ------
    rangeedge.error
        On normals of the wrong type or shape, or that do not face the viewer.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.optimality import directionalAngles
    >>> directionalAngles(np.array([1.0, 0, 1]), np.array([-1.0, 0, 1])).round(2)
    array([90.  ,  0.  , 70.53, 70.53])
    """
    normals1, normals2 = _normal_pair(normals1, normals2)
    return _section_angles(_slopes(normals1), _slopes(normals2))


@_check.public
def estimationError(normals1: np.ndarray, normals2: np.ndarray, crease: int = CREASE_MAX) -> np.ndarray:
    """The error E of a combination of the four directional strengths, free of noise and sampling.

    estimationError(normals1, normals2[, crease]) -> errors

    E = combined strength - true angle (paper, 5). `CREASE_MAX` combines as the paper does: the largest of
    `directionalAngles`. `CREASE_NORMAL` takes the tangents of both planes in the two sections with the largest angles;
    their cross products are the normals, so that E is 0 but for rounding.

    Parameters
    ----------
    normals1, normals2 : (..., 3) real arrays
        As for `creaseAngle`.
    crease : int
        `CREASE_MAX` or `CREASE_NORMAL`.

    Returns
    -------
    (...) float64 array
        In degrees, positive where the strength is over-estimated.

    Raises
    ------
    rangeedge.error
        On normals of the wrong type or shape, or that do not face the viewer, or another `crease`.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import CREASE_NORMAL
    >>> from rangeedge.optimality import estimationError
    >>> roof = np.array([1.0, 0.5, 1]), np.array([-1.0, 0.5, 1])
    >>> estimationError(*roof).round(2), abs(estimationError(*roof, CREASE_NORMAL)) < 1e-9
    (np.float64(6.38), np.True_)
    """
    normals1, normals2 = _normal_pair(normals1, normals2)
    crease = _check.flag("crease", crease, _CREASE)
    return _combined(normals1, normals2, crease) - _angle_between(normals1, normals2)


@_check.public
def errorStatistics(errors: np.ndarray) -> ErrorStatistics:
    """Mean and deviation of |E|, bias, largest |E| and share of over-estimates; NaN entries are left out.

    errorStatistics(errors) -> ErrorStatistics

    Parameters
    ----------
    errors : real array
        Errors in degrees, as `estimationError` and `measureDetector` return them.

    Returns
    -------
    ErrorStatistics

    Raises
    ------
    rangeedge.error
        On anything but a real array.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.optimality import errorStatistics
    >>> print(errorStatistics(np.array([3.0, -1.0, np.nan])))
    |E| 2.00 ± 1.00, largest 3, bias +1.00, over-estimated 50 %
    """
    errors = _check.array("errors", errors, "a real array", range(1, 33)).astype(np.float64)
    sums = _Sums()
    sums.add(errors[np.isfinite(errors)])
    return sums.statistics()


@_check.public
def analyseOptimality(frequency: int = 32, crease: int = CREASE_MAX) -> OptimalityAnalysis:
    """Estimation errors of all pairs of plane orientations: the simulation of the paper, 5.

    analyseOptimality([frequency[, crease]]) -> OptimalityAnalysis

    The orientations are those of `geodesicDome` with a slant below 70 degrees; every unordered pair is taken once.
    |E| enters the means and deviations, as in the figures that the paper states.

    Parameters
    ----------
    frequency : int
        Of the dome, 2 to 64; the paper's is 32, which gives 22 million pairs.
    crease : int
        `CREASE_MAX` or `CREASE_NORMAL`.

    Returns
    -------
    OptimalityAnalysis

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type or range.

    Examples
    --------
    >>> from rangeedge.optimality import analyseOptimality
    >>> print(analyseOptimality(8).statistics)
    |E| 6.41 ± 7.60, largest 47, bias +5.99, over-estimated 80 %
    """
    frequency = _check.integer("frequency", frequency, 2, 64)
    crease = _check.flag("crease", crease, _CREASE)
    normals = geodesicDome(frequency, MAX_SLANT)
    bins = len(_SLANT_EDGES) - 1
    slant = _bin(np.degrees(np.arccos(normals[:, 2])), _SLANT_EDGES)

    sums = _Sums()
    histogram = np.zeros(len(_ERROR_EDGES) - 1, np.int64)
    over_slants, over_section = _BinnedSums(bins * bins), _BinnedSums(bins)
    for i, j in _pair_blocks(len(normals)):
        first, second = normals[i], normals[j]
        later = j > i
        true = _angle_between(first, second)
        error = (_combined(first, second, crease) - true)[later]
        sums.add(error)
        histogram += np.bincount(_bin(error, _ERROR_EDGES), minlength=histogram.size)
        for one, other in ((i, j), (j, i)):
            over_slants.add((slant[one] * bins + slant[other])[later], np.abs(error))
        over_section.add(_bin(_section_slant(first, second, true)[later], _SLANT_EDGES), np.abs(error))

    mean, deviation = (values.reshape(bins, bins) for values in over_slants.mean_and_deviation())
    return OptimalityAnalysis(
        sums.statistics(),
        _ERROR_EDGES,
        histogram,
        _SLANT_EDGES,
        mean,
        deviation,
        *over_section.mean_and_deviation(),
    )


@_check.public
def measureDetector(
    normals1: np.ndarray,
    normals2: np.ndarray,
    sigma: float = 0.0,
    crease: int = CREASE_MAX,
    *,
    size: int = 48,
    seed: int = 0,
) -> np.ndarray:
    """The error E of `edgeStrength` itself, on a rendered image of every pair of planes.

    measureDetector(normals1, normals2[, sigma[, crease]], *[, size[, seed]]) -> errors

    Each pair is drawn by parallel projection on a grid of unit pitch, in turn as a convex and a concave edge through
    a random point within an eighth of `size` of the image centre. The strength is the median along the quarter of the
    true edge line about that point, at every place the largest within a pixel.

    Parameters
    ----------
    normals1, normals2 : (n, 3) real arrays
        As for `creaseAngle`.
    sigma : float
        Standard deviation of white noise added to the depth, in pixel pitches.
    crease : int
        `CREASE_MAX` or `CREASE_NORMAL`.
    size : int
        Height and width of the image, 16 to 512.
    seed : int
        Of the noise and of the places of the edges.

    Returns
    -------
    (n,) float64 array
        In degrees; NaN where less than half of the line was detected.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type, shape or range.
    """
    normals1, normals2 = np.broadcast_arrays(*_normal_pair(normals1, normals2))
    if normals1.ndim != 2:
        raise _check.fail("normals1", "of shape (n, 3)", normals1.shape, cv2.Error.StsBadSize)
    sigma = _check.number("sigma", sigma, 0.0)
    crease = _check.flag("crease", crease, _CREASE)
    size = _check.integer("size", size, 16, 512)
    rng = np.random.default_rng(_check.integer("seed", seed, 0))

    errors = np.empty(len(normals1))
    for k, (normal1, normal2) in enumerate(zip(normals1, normals2, strict=True)):
        centre = (size - 1) / 2 + rng.uniform(-size / 8, size / 8, 2)
        depth = _plane_pair(normal1, normal2, centre, size, convex=k % 2 == 0)
        depth += rng.normal(0, sigma, depth.shape)
        # Without noise what is left is the rounding of single precision.
        strength = edgeStrength(depth, pixelSize=1.0, noise=max(sigma, 1e-4), crease=crease).crease
        found = _strength_along(strength, _edge_direction(normal1, normal2), centre)
        errors[k] = found - _angle_between(normal1, normal2) if found > 0 else np.nan
    return errors


def _icosahedron_faces() -> np.ndarray:
    """The 20 faces of the icosahedron, as (20, 3, 3) corners."""
    golden = (1 + 5**0.5) / 2
    rectangle = [(0.0, s, t * golden) for s in (1, -1) for t in (1, -1)]
    corners = np.array([np.roll(corner, turn) for turn in range(3) for corner in rectangle])
    adjacent = np.isclose(np.linalg.norm(corners[:, None] - corners, axis=2), 2)
    triples = itertools.combinations(range(len(corners)), 3)
    return corners[[t for t in triples if all(adjacent[a, b] for a, b in itertools.combinations(t, 2))]]


def _normal_pair(normals1: Any, normals2: Any) -> tuple[np.ndarray, np.ndarray]:
    """Both arrays of normals, checked, as unit vectors."""
    pair = []
    for name, value in (("normals1", normals1), ("normals2", normals2)):
        expected = "a real array of shape (..., 3)"
        value = _check.array(name, value, expected, range(1, 33)).astype(np.float64)
        if value.shape[-1] != 3:
            raise _check.fail(name, expected, _check.described(value), cv2.Error.StsBadSize)
        if not (np.isfinite(value).all() and (value[..., 2] > 0).all()):
            expected = "finite normals towards the viewer (c > 0)"
            raise _check.fail(name, expected, "others", cv2.Error.StsOutOfRange)
        pair.append(value / np.linalg.norm(value, axis=-1, keepdims=True))
    try:
        np.broadcast_shapes(pair[0].shape, pair[1].shape)
    except ValueError:
        expected = f"an array that broadcasts with {pair[0].shape}"
        raise _check.fail("normals2", expected, pair[1].shape, cv2.Error.StsUnmatchedSizes) from None
    return pair[0], pair[1]


def _angle_between(unit1: np.ndarray, unit2: np.ndarray) -> np.ndarray:
    """Angle of unit vectors in degrees; the arc cosine would lose half the digits of small angles."""
    apart = sum((unit1[..., k] - unit2[..., k]) ** 2 for k in range(3))
    along = sum((unit1[..., k] + unit2[..., k]) ** 2 for k in range(3))
    return np.degrees(2 * np.arctan2(np.sqrt(apart), np.sqrt(along)))


def _slopes(normals: np.ndarray) -> np.ndarray:
    """Slope dz/ds of a plane along each of the four sections, as (..., 4)."""
    return -(normals[..., :2] @ _SECTIONS.T) / normals[..., 2:]


def _section_angles(slopes1: np.ndarray, slopes2: np.ndarray) -> np.ndarray:
    inclination1, inclination2 = (np.moveaxis(np.arctan(slopes), -1, 0) for slopes in (slopes1, slopes2))
    # Sections lie outermost in memory: the maximum over them is then as fast as over whole images.
    missing = max(inclination1.ndim, inclination2.ndim)
    inclination1, inclination2 = (
        a.reshape(a.shape[:1] + (1,) * (missing - a.ndim) + a.shape[1:]) for a in (inclination1, inclination2)
    )
    return np.moveaxis(np.degrees(np.abs(inclination1 - inclination2)), 0, -1)


def _combined(normals1: np.ndarray, normals2: np.ndarray, crease: int) -> np.ndarray:
    """Crease strength in degrees that the four sections give together."""
    slopes1, slopes2 = _slopes(normals1), _slopes(normals2)
    angles = _section_angles(slopes1, slopes2)
    if crease == CREASE_MAX:
        return angles.max(-1)
    strength = np.empty(angles.shape[:-1])
    best = np.sort(np.argpartition(angles, 1, axis=-1)[..., 2:], axis=-1)
    for d, e in itertools.combinations(range(4), 2):
        chosen = (best[..., 0] == d) & (best[..., 1] == e)
        recovered = (np.broadcast_to(_normals_from(s, d, e), (*chosen.shape, 3)) for s in (slopes1, slopes2))
        strength[chosen] = _angle_between(*(normals[chosen] for normals in recovered))
    return strength


def _normals_from(slopes: np.ndarray, d: int, e: int) -> np.ndarray:
    """Unit normals of the planes with these slopes along the sections d and e: their tangents' cross product."""
    tangents = (np.stack(np.broadcast_arrays(*_SECTIONS[s], slopes[..., s]), axis=-1) for s in (d, e))
    normals = np.cross(*tangents)
    return normals / (np.linalg.norm(normals, axis=-1, keepdims=True) * np.sign(normals[..., 2:]))


def _section_slant(normals1: np.ndarray, normals2: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """The angle A in degrees between the z axis and the section that holds both normals: there E would be 0."""
    upright = normals1[..., 0] * normals2[..., 1] - normals1[..., 1] * normals2[..., 0]
    sine = np.sin(np.radians(angle))
    return np.degrees(np.arcsin(np.minimum(np.abs(upright) / np.where(sine > 0, sine, 1), 1)))


def _pair_blocks(n: int, pairs: int = 1 << 18) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Index arrays (b, 1) and (1, m) that cover all i < j; a block has about `pairs` elements."""
    start = 0
    while start < n - 1:
        stop = min(n - 1, start + max(1, pairs // (n - start)))
        yield np.arange(start, stop)[:, None], np.arange(start, n)[None]
        start = stop


def _bin(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Index of the uniform bin of each value; the outer bins take what lies beyond."""
    index = np.floor((values - edges[0]) / (edges[1] - edges[0]))
    return np.clip(index, 0, len(edges) - 2).astype(np.intp)


class _Sums:
    """Sums over errors E from which their statistics follow."""

    def __init__(self) -> None:
        self._count = self._over = 0
        self._absolute = self._square = self._signed = 0.0
        self._largest = 0.0

    def add(self, errors: np.ndarray) -> None:
        absolute = np.abs(errors)
        self._count += errors.size
        self._over += int((errors > 1e-6).sum())
        self._absolute += float(absolute.sum())
        self._square += float((errors**2).sum())
        self._signed += float(errors.sum())
        self._largest = max(self._largest, float(absolute.max(initial=0)))

    def statistics(self) -> ErrorStatistics:
        if not self._count:
            return ErrorStatistics(0, *[float("nan")] * 5)
        mean = self._absolute / self._count
        deviation = max(self._square / self._count - mean**2, 0) ** 0.5
        bias, over = self._signed / self._count, self._over / self._count
        return ErrorStatistics(self._count, mean, deviation, bias, self._largest, over)


class _BinnedSums:
    """Count, sum and sum of squares per bin."""

    def __init__(self, bins: int) -> None:
        self._sums = np.zeros((3, bins))

    def add(self, index: np.ndarray, values: np.ndarray) -> None:
        for row, weights in zip(self._sums, (None, values, values**2), strict=True):
            row += np.bincount(index, weights, minlength=row.size)

    def mean_and_deviation(self) -> tuple[np.ndarray, np.ndarray]:
        count, total, square = self._sums
        count = np.where(count > 0, count, np.nan)
        mean = total / count
        return mean, np.sqrt(np.maximum(square / count - mean**2, 0))


def _plane_pair(normal1: np.ndarray, normal2: np.ndarray, centre: np.ndarray, size: int, convex: bool) -> np.ndarray:
    """Depth image of the edge in which two planes through the point `centre` (x, y) meet."""
    y, x = np.mgrid[:size, :size] - centre[::-1, None, None]
    planes = [-(a * x + b * y) / c for a, b, c in (normal1, normal2)]
    return np.maximum(*planes) if convex else np.minimum(*planes)


def _edge_direction(normal1: np.ndarray, normal2: np.ndarray) -> np.ndarray:
    """Unit direction (x, y) of the image of the line in which two planes meet."""
    difference = normal1[:2] / normal1[2] - normal2[:2] / normal2[2]
    return np.array([-difference[1], difference[0]]) / np.linalg.norm(difference)


def _strength_along(strength: np.ndarray, direction: np.ndarray, centre: np.ndarray) -> float:
    """Median strength along the line through `centre` (x, y), an eighth of the image to either side."""
    reach = len(strength) // 8
    points = centre + np.arange(-reach, reach + 1)[:, None] * direction
    x, y = np.rint(points).astype(int).T
    return float(np.median(cv2.dilate(strength, np.ones((3, 3), np.uint8))[y, x]))
