"""The curves of segments, and what noise does to them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rangeedge import DIR_COLS, DIR_ROWS

CURVED_SIGNIFICANCE = 6.0  # of the quadratic term


# The noise of fits to n samples (core/image/noise.hpp).


@dataclass
class FitNoise:
    """Along one direction, in units of what white noise would do to slopes, values and residuals.

    Factors are given at n = 4, 8, 16, 32, 64, and linear in log n from 1 at n = 2 up to there.
    """

    slope: np.ndarray
    value: np.ndarray
    shared_slope: np.ndarray  # of neighbouring lines together, in units of one line
    shared_value: np.ndarray
    residual: float

    @classmethod
    def of(cls, numbers):
        return cls(*np.reshape(numbers[:-1], (4, -1)), numbers[-1])

    def factor(self, name, n):
        return float(np.interp(math.log2(max(n, 1)), [1, 2, 3, 4, 5, 6], [1, *getattr(self, name)]))


def noise_along(direction, model):
    """The noise of fits along a direction, diagonals being between rows and columns."""
    rows, cols = np.reshape(model.of_fits()[4:], (2, -1))
    return FitNoise.of({DIR_ROWS: rows, DIR_COLS: cols}.get(direction, np.sqrt(rows * cols)))


def wave_share(n):
    """How much of the noise of a fit to n samples is waves, the rest being that of single samples."""
    return float(np.interp(n, [2, 4, 8, 16], [0, 0.4, 0.7, 1]))


# Polynomials.


@dataclass
class Curve:
    """A polynomial of degree 0 to 2 around `origin`, with the covariance of its coefficients at unit noise."""

    origin: float
    unit: float  # abscissae are divided by it, for conditioning
    base: float
    coefficients: np.ndarray
    covariance: np.ndarray
    sum_squares: float

    def _powers(self, x):
        return ((x - self.origin) / self.unit) ** np.arange(len(self.coefficients))

    def _derivatives(self, x):
        t = (x - self.origin) / self.unit
        return np.array([0.0, 1.0, 2 * t][: len(self.coefficients)]) / self.unit

    def value(self, x):
        return self.base + float(self._powers(x) @ self.coefficients)

    def slope(self, x):
        return float(self._derivatives(x) @ self.coefficients)

    def value_variance(self, x):
        return float(self._powers(x) @ self.covariance @ self._powers(x))

    def slope_variance(self, x):
        if len(self.coefficients) == 1:
            return math.inf
        return float(self._derivatives(x) @ self.covariance @ self._derivatives(x))

    @property
    def quadratic(self):
        return float(self.coefficients[2]) / self.unit**2 if len(self.coefficients) == 3 else 0.0


def fitted(x, y, degree):
    origin, base = float(np.mean(x)), float(np.mean(y))
    unit = max(float(np.max(np.abs(x - origin))), 1e-300)
    a = ((x - origin) / unit)[:, None] ** np.arange(degree + 1)
    q, r = np.linalg.qr(a)
    coefficients = np.linalg.solve(r, q.T @ (y - base))
    inverse = np.linalg.inv(r)
    residuals = (y - base) - a @ coefficients
    sum_squares = float(residuals @ residuals) if len(x) > degree + 1 else 0.0  # exactly: ties hang on it
    return Curve(origin, unit, base, coefficients, inverse @ inverse.T, sum_squares)


def least_squares(x, y, deviation):
    """A line, or a quadratic where its term is significant, at this deviation of the samples from it."""
    line = fitted(x, y, min(1, len(x) - 1))
    if len(x) <= 3:
        return line
    curve = fitted(x, y, 2)
    significance = abs(curve.coefficients[2]) / (deviation * math.sqrt(curve.covariance[2, 2]))
    return curve if significance > CURVED_SIGNIFICANCE else line


def meeting(f, g, near):
    """The intersection of two curves closest to `near`, or None."""
    c, b, a = f.value(near) - g.value(near), f.slope(near) - g.slope(near), f.quadratic - g.quadratic
    discriminant = b * b - 4 * a * c
    if discriminant < 0 or (b == 0 and a == 0) or (b == 0 and discriminant == 0):
        return None
    root = math.sqrt(discriminant)
    return near - 2 * c / (b - root if b < 0 else b + root)
