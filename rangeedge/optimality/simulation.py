"""Errors over all pairs of plane orientations: the simulation of the paper, 5."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .. import _check
from ..constants import CREASE_MAX
from ..options import CREASES
from .creases import angle_between, geodesicDome
from .errors import ErrorStatistics, ErrorSums, combined_strength

MAX_SLANT = 70.0  # degrees; steeper planes are rarely seen (paper, 5)

_ERROR_EDGES = np.arange(-6.0, 61.0, 0.5)
_SLANT_EDGES = np.linspace(0, MAX_SLANT, 29)


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
    crease = _check.flag("crease", crease, CREASES)
    normals = geodesicDome(frequency, MAX_SLANT)
    bins = len(_SLANT_EDGES) - 1
    slant = _bin(np.degrees(np.arccos(normals[:, 2])), _SLANT_EDGES)

    sums = ErrorSums()
    histogram = np.zeros(len(_ERROR_EDGES) - 1, np.int64)
    over_slants, over_section = _BinnedSums(bins * bins), _BinnedSums(bins)
    for i, j in _pair_blocks(len(normals)):
        first, second = normals[i], normals[j]
        later = j > i
        true = angle_between(first, second)
        error = (combined_strength(first, second, crease) - true)[later]
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
