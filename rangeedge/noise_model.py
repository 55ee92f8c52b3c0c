"""How noisy a range image is, as a function of depth and of how many pixels are looked at: a model by sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ._check import described, error, fail, named, number, public

_LEVELS = (4, 8, 16, 32, 64)  # numbers of samples of a fit for which its noise is given
_NEIGHBOURS = 5  # scan lines that are looked at together
_DIRECTION = 4 * len(_LEVELS) + 1  # numbers for rows, and for columns
LARGEST_CORRELATION = 1e6
_INDEPENDENT = 1.5  # the largest factor of pixels that are measured one by one
_LONG = 64  # samples of a fit whose residuals are looked at
_RESIDUAL = 1.25  # what residuals count more, as curves through three samples are off themselves
_LARGEST_RESIDUAL = 12.0  # in units of the factor on slopes of the shortest fits

# The noise of fits as the kernels take it (core/image/noise.hpp): the coefficients of the waves, and for rows and
# columns each, at five numbers of samples, the factors on the deviations of slopes and values of one line, and of
# several lines together, and the deviation of residuals.
WHITE = (0.0,) * 4 + (1.0,) * (2 * _DIRECTION)


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviation of a measured length as a function of depth, and how it carries over to fits.

    NoiseModel([a[, b[, c[, correlation[, length[, fits]]]]]])

    sigma(z) = a + b z + c z^2, all in the unit of the range image, is the deviation that neighbours show. Calling the
    model evaluates it. Where neighbours err together, fits to many pixels are off by more than that tells:
    `correlation` and `length` describe it roughly, `fits` as `estimateNoise` measures it.

    Parameters
    ----------
    a, b, c : float
        Coefficients, such that sigma is nowhere negative in the range measured. A triangulating sensor has only `c`
        (its noise is constant in inverse depth), a time-of-flight sensor mainly `a`.
    correlation : float
        How much larger the deviation of all pixels is than that of neighbours: beside white noise of the deviation
        sigma there are waves of sigma sqrt(correlation^2 - 1). 1 for white noise, about 2 for a Kinect, whose matching
        windows make neighbours err together, 5 for active stereo.
    length : float
        In pixels: waves at a distance of d pixels go together by exp(-d^2 / length^2). 0: whatever the number of
        pixels, deviations of fits count `correlation` times.
    fits : tuple of float, optional
        46 numbers, the noise of fits by their number of samples n, in units of what white noise of sigma does: four
        coefficients of the waves, a' + b' z + c' z^2 + d' z^3; then along rows and along columns, for n = 4, 8, 16, 32,
        64 each, factors of slopes and of values, the same of five lines together, and the deviation of samples from
        fits longer than the waves. With it `correlation` and `length` do not count.

    Raises
    ------
    rangeedge.error
        If a coefficient is not finite, all are zero, `correlation` is below 1 or above 10^6, `length` below 0, or
        `fits` is not what `estimateNoise` gives.

    Examples
    --------
    >>> from rangeedge import NoiseModel
    >>> NoiseModel(c=0.0014)(2.0)
    0.0056
    >>> NoiseModel.kinect1()
    NoiseModel(c=0.001, correlation=2.1, length=3.5)
    """

    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    correlation: float = 1.0
    length: float = 0.0
    fits: tuple[float, ...] | None = None

    @named("NoiseModel")
    def __post_init__(self) -> None:
        for name in ("a", "b", "c"):
            number(name, getattr(self, name))
        number("correlation", self.correlation, 1, LARGEST_CORRELATION)
        number("length", self.length, 0)
        if self.a == self.b == self.c == 0:
            raise error("one of `a`, `b`, `c` must differ from 0")
        if self.fits is None:
            return
        what = f"the {len(WHITE)} numbers of a model of `estimateNoise`"
        if not isinstance(self.fits, Sequence) or len(self.fits) != len(WHITE):
            raise fail("fits", what, described(self.fits))
        object.__setattr__(self, "fits", tuple(number("fits", value, 0) for value in self.fits))
        if min(self.fits[4:]) == 0 or not any(self.fits[:4]):
            raise fail("fits", what, "zeros")

    def __repr__(self) -> str:
        defaults = vars(NoiseModel(1.0)) | {"a": 0.0}
        told = {name: value for name, value in vars(self).items() if name != "fits" and value != defaults[name]}
        return f"NoiseModel({', '.join(f'{name}={value:.4g}' for name, value in told.items())})"

    def __call__(self, z: Any) -> Any:
        return self.a + (self.b + self.c * z) * z

    def of_fits(self) -> tuple[float, ...]:
        """The noise of fits as the kernels take it."""
        if self.fits is not None:
            return self.fits
        return (self.a, self.b, self.c, 0.0, *(_direction(self.correlation, self.length) * 2))

    @classmethod
    def realsense(cls) -> NoiseModel:
        """RealSense D4xx, metres: measured by `estimateNoise` on eight frames of six data sets, 0.3 to 1.5 m."""
        return cls(a=0.1e-3, c=0.45e-3, correlation=5.0, length=10.0)

    @classmethod
    def azureKinect(cls) -> NoiseModel:
        """Azure Kinect, registered to its colour image, metres: measured by `estimateNoise` on one frame, 0.45 m."""
        return cls(a=0.26e-3, c=0.66e-3, correlation=5.4, length=5.0)

    @classmethod
    def kinect1(cls) -> NoiseModel:
        """Kinect v1 and Xtion, metres: measured by `estimateNoise` on 27 frames, 0.7 to 4 m.

        Khoshelham and Oude Elberink (2012) have c = 1.425e-3 for the deviation of all samples of a plane. Neighbours
        err together, so that they differ by less, and fits to many samples by more than that tells.
        """
        return cls(c=1.0e-3, correlation=2.1, length=3.5)

    @classmethod
    def kinect2(cls) -> NoiseModel:
        """Kinect v2, metres: measured by `estimateNoise` on one frame of a room, 2.4 m."""
        return cls(a=2.8e-3, c=0.17e-3, correlation=2.1, length=2.0)

    @classmethod
    def structuredLight(cls) -> NoiseModel:
        """Scanners with structured light, metres: measured by `estimateNoise` on five frames of a PhoXi at 0.8 m."""
        return cls(a=0.07e-3, c=0.15e-3, correlation=1.7, length=9.0)

    @classmethod
    @public
    def stereo(
        cls,
        focalLength: float,
        baseline: float,
        subpixel: float = 0.08,
        correlation: float = 4.5,
        length: float = 4.5,
    ) -> NoiseModel:
        """Stereo and active stereo: the depths of all pixels together are off by z^2 subpixel / (focalLength baseline).

        NoiseModel.stereo(focalLength, baseline[, subpixel[, correlation[, length]]]) -> model

        Parameters
        ----------
        focalLength : float
            In pixels, > 0.
        baseline : float
            Distance of the cameras in the unit of the image, > 0.
        subpixel : float
            Deviation of the disparities of all pixels, in pixels, > 0.
        correlation, length : float
            As in `NoiseModel`: neighbours differ by `correlation` times less. The defaults are measured by
            `estimateNoise` on semi-global matching of simulated active stereo.

        Returns
        -------
        model : NoiseModel
            c = subpixel / (correlation focalLength baseline).

        Raises
        ------
        rangeedge.error
            On a bad argument.

        Examples
        --------
        >>> from rangeedge import NoiseModel
        >>> NoiseModel.stereo(425, 0.05)
        NoiseModel(c=0.0008366, correlation=4.5, length=4.5)
        """
        focalLength = number("focalLength", focalLength, 0, above=True)
        baseline = number("baseline", baseline, 0, above=True)
        subpixel = number("subpixel", subpixel, 0, above=True)
        correlation = number("correlation", correlation, 1)
        return cls(c=subpixel / (correlation * focalLength * baseline), correlation=correlation, length=length)


def independent(fits: tuple[float, ...]) -> tuple[float, ...]:
    """The noise of fits where pixels are measured one by one: the lesser of rows and columns, and low."""
    rows, columns = fits[4 : 4 + _DIRECTION], fits[4 + _DIRECTION :]
    least = [min(row, column, _INDEPENDENT) for row, column in zip(rows, columns, strict=True)]
    return (*fits[:4], *least, *least)


def correlation_of(fits: tuple[float, ...]) -> float:
    """How much larger the deviation is over many pixels than between neighbours."""
    return (fits[4 + _DIRECTION - 1] + fits[4 + 2 * _DIRECTION - 1]) / (2 * _RESIDUAL)


@lru_cache
def _direction(correlation: float, length: float) -> tuple[float, ...]:
    """The factors along either direction for waves that are correlated by exp(-d^2 / length^2)."""
    if length == 0:
        return (correlation,) * _DIRECTION
    waves = correlation**2 - 1  # the variance of the waves, in that of white noise
    lines = np.arange(_NEIGHBOURS)
    together = float(_correlated(lines, length).mean()) * _NEIGHBOURS
    single, shared = [], []
    for part in (_slope_difference, _gap):
        for n in _LEVELS:
            weights = part(n)
            share = waves * weights @ _correlated(np.arange(2 * n), length) @ weights / (weights @ weights)
            single.append(float(np.sqrt(1 + share)))
            shared.append(float(np.sqrt(1 + together * share)))
    fit, places = np.vander(np.linspace(-1, 1, _LONG), 3), np.arange(_LONG)
    left = np.eye(_LONG) - fit @ np.linalg.pinv(fit)  # what a quadratic leaves of the samples
    residual = np.sqrt(1 + waves * np.sum(left * _correlated(places, length)) / (_LONG - 3))
    return (*single, *shared, float(min(_RESIDUAL * residual, _LARGEST_RESIDUAL * single[0])))


def _correlated(places: np.ndarray, length: float) -> np.ndarray:
    with np.errstate(over="ignore", divide="ignore"):  # of waves without end, or shorter than any pixel
        apart, square = np.subtract.outer(places, places) ** 2, np.square(np.float64(length))
        return np.exp(-np.divide(apart, square, out=np.zeros(apart.shape), where=apart > 0))


def _slope_difference(n: int) -> np.ndarray:
    """The weights of 2 n samples in the difference of the slopes of the lines fitted to either half."""
    slope = (np.arange(n) - (n - 1) / 2) / (n * (n * n - 1) / 12)
    return np.concatenate([-slope, slope])


def _gap(n: int) -> np.ndarray:
    """The weights of 2 n samples in the gap of these lines at the common border."""
    slope = (np.arange(n) - (n - 1) / 2) / (n * (n * n - 1) / 12)
    return np.concatenate([-1 / n - slope * n / 2, 1 / n - slope * n / 2])
