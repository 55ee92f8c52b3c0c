"""Errors of the strength that directional sections give together, and their statistics (paper, 5)."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from .. import _check
from ..constants import CREASE_MAX
from ..options import CREASES
from .creases import SECTIONS, angle_between, normal_pair, section_angles, slopes_along


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
    normals1, normals2 = normal_pair(normals1, normals2)
    crease = _check.flag("crease", crease, CREASES)
    return combined_strength(normals1, normals2, crease) - angle_between(normals1, normals2)


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
    sums = ErrorSums()
    sums.add(errors[np.isfinite(errors)])
    return sums.statistics()


def combined_strength(normals1: np.ndarray, normals2: np.ndarray, crease: int) -> np.ndarray:
    """Crease strength in degrees that the four sections give together."""
    slopes1, slopes2 = slopes_along(normals1), slopes_along(normals2)
    angles = section_angles(slopes1, slopes2)
    if crease == CREASE_MAX:
        return angles.max(-1)
    strength = np.empty(angles.shape[:-1])
    best = np.sort(np.argpartition(angles, 1, axis=-1)[..., 2:], axis=-1)
    for d, e in itertools.combinations(range(4), 2):
        chosen = (best[..., 0] == d) & (best[..., 1] == e)
        recovered = (np.broadcast_to(_normals_from(s, d, e), (*chosen.shape, 3)) for s in (slopes1, slopes2))
        strength[chosen] = angle_between(*(normals[chosen] for normals in recovered))
    return strength


def _normals_from(slopes: np.ndarray, d: int, e: int) -> np.ndarray:
    """Unit normals of the planes with these slopes along the sections d and e: their tangents' cross product."""
    tangents = (np.stack(np.broadcast_arrays(*SECTIONS[s], slopes[..., s]), axis=-1) for s in (d, e))
    normals = np.cross(*tangents)
    return normals / (np.linalg.norm(normals, axis=-1, keepdims=True) * np.sign(normals[..., 2:]))


class ErrorSums:
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
        deviation = max(self._square / self._count - mean * mean, 0) ** 0.5
        bias, over = self._signed / self._count, self._over / self._count
        return ErrorStatistics(self._count, mean, deviation, bias, self._largest, over)
