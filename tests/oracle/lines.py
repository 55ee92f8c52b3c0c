"""Range images, and their scan lines as curves in planes (paper, 4.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from rangeedge import DIR_COLS, DIR_DIAG45, DIR_DIAG135, DIR_ROWS, NoiseModel, ScanLineParams

from .curves import FitNoise, fitted, least_squares, noise_along, wave_share

SMALLEST = 1e-30  # deviation of the noise
BRIDGED = 2  # samples of a hole across which lines may run on
PARALLEL = 1e-14  # what rounding makes of parallel tangents here

STEPS = {DIR_ROWS: (1, 0), DIR_COLS: (0, 1), DIR_DIAG45: (1, -1), DIR_DIAG135: (1, 1)}  # (dx, dy)


@dataclass
class Line:
    """One scan line: ordinates `y` (inverse depth or height) over abscissae `x`, and its way through space."""

    pixels: list[tuple[int, int]]  # (column, row)
    direction: int
    projective: bool
    x: np.ndarray
    y: np.ndarray
    sigma: np.ndarray  # of the ordinates, as neighbours tell it
    waves: np.ndarray  # of the ordinates, in fits to many samples
    noise: FitNoise
    tolerance: np.ndarray
    scale: np.ndarray | None  # inverse tolerances, where they differ
    seen: np.ndarray  # whether a sample is of the image, not across a small hole
    place: Any = None  # abscissa to the position (X, Y) in the plane of the image

    def deviation(self, samples, n):
        """Of the noise at some samples, as a fit to n of them counts with it."""
        return float(np.mean(self.sigma[samples] + wave_share(n) * (self.waves[samples] - self.sigma[samples])))

    def fit(self, first, last, samples=None):
        """Least squares over samples, with the noise at those in their middle, or at others.

        The quadratic term is the difference of the slopes of two halves, and as noisy.
        """
        n = last - first + 1
        deviation = self.noise.factor("slope", n // 2) * self.deviation(samples or middles(first, last), n)
        return least_squares(*self.doubles(slice(first, last + 1)), deviation)

    def interpolation(self, samples):
        return fitted(*self.doubles(samples), len(samples) - 1)

    def doubles(self, samples):
        return np.asarray(self.x[samples], np.float64), np.asarray(self.y[samples], np.float64)

    def height(self, y):
        """The depth of an ordinate, or a height."""
        with np.errstate(divide="ignore"):
            return np.float64(1) / y if self.projective else y

    def grazing_angle(self, i, k):
        """Between the straight line from sample i to sample k and the viewing ray to its middle, in degrees."""
        points = []
        for j in (i, k):
            (X, Y), _ = self.place(float(self.x[j]))
            y = float(self.y[j])
            points.append(np.array([X, Y, 1]) / y if self.projective else np.array([X, Y, -y]))
        way = points[1] - points[0]
        ray = points[0] + points[1] if self.projective else np.array([0, 0, 1.0])
        return math.degrees(math.atan2(float(np.linalg.norm(np.cross(way, ray))), abs(float(way @ ray))))

    def tangent(self, x, value, slope):
        """Derivative by the abscissa of a curve in space, the ray to its point, and how the ray moves."""
        (X, Y), (dX, dY) = self.place(x)
        ahead = np.array([dX, dY, 0.0])
        if not self.projective:
            return np.array([dX, dY, -slope]), np.array([0.0, 0.0, 1.0]), ahead
        ray = np.array([X, Y, 1.0])
        return ahead / value - slope / value**2 * ray, ray, ahead

    def crease(self, x_f, f, x_g, g):
        """Angle in radians from the tangent of f = (value, slope) to that of g, positive away from the viewer."""
        (t, ray, ahead), (u, _, _) = self.tangent(x_f, *f), self.tangent(x_g, *g)
        normal = np.cross(t, u)
        if np.linalg.norm(normal) < PARALLEL * np.linalg.norm(t) * np.linalg.norm(u):
            return 0.0
        angle = math.atan2(float(np.linalg.norm(normal)), float(t @ u))
        return math.copysign(angle, float(normal @ np.cross(ahead, ray)))

    def turn(self, x, value, slope):
        """How fast the tangent t turns with the slope: |t x dt/dslope| / |t|^2."""
        t, ray, _ = self.tangent(x, value, slope)
        change = ray / value**2 if self.projective else ray
        return float(np.linalg.norm(np.cross(t, change)) / (t @ t))


def bridged(x, y, tolerance, widest):
    """The holes [first, end) of one or two samples, across which a line runs on as it does beside them."""
    x, y = np.float64(x), np.float64(y)
    slopes = np.full(len(y) + 1, np.nan)  # before every sample, and after the last
    with np.errstate(all="ignore"):
        slopes[1:-1] = np.diff(y) / np.diff(x)
    slopes[~np.isfinite(slopes)] = 0
    valid = np.flatnonzero(~np.isnan(y))
    for a, b in pairwise(valid):
        if not (0 < b - a - 1 <= min(BRIDGED, widest) and x[b] > x[a]):
            continue
        rises = [0.0, slopes[a] * (x[b] - x[a]), slopes[b + 1] * (x[b] - x[a])]
        slack = 2 * max(tolerance[a], tolerance[b])
        if min(rises) - slack <= y[b] - y[a] <= max(rises) + slack:
            yield a + 1, b


def interpolate(values, first, end):
    """Puts straight lines across a hole."""
    dtype, n = values.dtype.type, end - first + 1
    for i in range(1, n):
        values[first + i - 1] = (dtype(n - i) * values[first - 1] + dtype(i) * values[end]) / dtype(n)


def middles(first, last):
    """The two samples in the middle, or twice the one where their number is odd."""
    return [(first + last) // 2, (first + last + 1) // 2]


def paths(direction, rows, cols):
    """Pixels (column, row) of every scan line, in the kernels' order: diagonals from the left or lower border."""
    dx, dy = STEPS[direction]
    if direction == DIR_ROWS:
        starts = [(0, v) for v in range(rows)]
    elif direction == DIR_COLS:
        starts = [(u, 0) for u in range(cols)]
    elif direction == DIR_DIAG45:
        starts = [(0, v) for v in range(rows)] + [(u, rows - 1) for u in range(1, cols)]
    else:
        starts = [(0, v) for v in range(rows - 1, -1, -1)] + [(u, 0) for u in range(1, cols)]
    for u, v in starts:
        pixels = []
        while 0 <= u < cols and 0 <= v < rows:
            pixels.append((u, v))
            u, v = u + dx, v + dy
        yield pixels


@dataclass
class Image:
    """A range image: depth or height of shape (H, W), or points of shape (H, W, 3); NaN where invalid."""

    data: np.ndarray
    K: np.ndarray | None = None
    spacing: tuple[float, float] | None = None
    projective: bool = False
    height: bool = False
    noise: NoiseModel = field(default_factory=lambda: NoiseModel(a=1.0))
    params: ScanLineParams = field(default_factory=ScanLineParams)

    @property
    def shape(self):
        return self.data.shape[:2]

    def has_data(self, u, v):
        rows, cols = self.shape
        return 0 <= u < cols and 0 <= v < rows and bool(np.isfinite(self.data[v, u]).all())

    @property
    def spaced(self):
        """Whether the spacing of pixels is known as a length."""
        return self.projective or self.spacing not in (None, (1.0, 1.0)) or self.data.ndim == 3

    @property
    def z_sign(self):
        return -1.0 if self.height else 1.0

    def line(self, pixels, direction):
        if self.data.ndim == 3:
            x, y, place = self._points(pixels)
        else:
            x, y, place = self._grid(pixels)
        noise, waves = noise_along(direction, self.noise), self.noise.of_fits()[:4]
        factor = self.params.epsFactor * noise.residual
        c = [factor * w for w in waves] if self.params.eps is None else [self.params.eps, 0.0, 0.0, 0.0]
        # The same everywhere: a length on a grid, or one that grows with the square of the depth.
        even = c[1] == c[3] == (c[0] if self.projective else c[2]) == 0
        scale = None if even else 1 / self._of_ordinate(c, y)
        largest = np.full(len(y), max(c[2 if self.projective else 0], SMALLEST))
        seen = np.array([self.has_data(u, v) for u, v in pixels])
        for first, end in list(bridged(x, y, largest if even else 1 / np.float64(scale), self.params.maxGap)):
            for values in (x, y) if even else (x, y, scale):
                interpolate(values, first, end)
        ordinate = np.asarray(y, np.float64)
        return Line(
            pixels,
            direction,
            self.projective,
            x,
            y,
            sigma=self._of_ordinate((self.noise.a, self.noise.b, self.noise.c, 0.0), ordinate),
            waves=self._of_ordinate(waves, ordinate),
            noise=noise,
            tolerance=largest if even else 1 / np.float64(scale),
            scale=scale,
            seen=seen,
            place=place,
        )

    def _of_ordinate(self, coefficients, y):
        """The deviation c0 + c1 z + c2 z^2 + c3 z^3 of lengths z, at ordinates, in the precision of these."""
        c0, c1, c2, c3 = (y.dtype.type(c) for c in coefficients)
        z = np.abs(y)
        with np.errstate(all="ignore"):
            # With a camera z = 1 / y, and an ordinate is off by y^2 of what the depth is off.
            of_y = (((c0 * y + c1) * y + c2) * y + c3) / y if self.projective else ((c3 * z + c2) * z + c1) * z + c0
        return np.where(of_y > y.dtype.type(SMALLEST), of_y, y.dtype.type(SMALLEST))

    def _grid(self, pixels):
        u, v = np.array(pixels).T
        values = self.data[v, u]
        y = 1 / values if self.projective else values if self.height else -values
        x = np.arange(len(pixels)).astype(values.dtype)
        to_plane = np.diag([*(self.spacing or (1.0, 1.0)), 1.0]) if self.K is None else np.linalg.inv(self.K)
        start = to_plane @ [*pixels[0], 1.0]
        dx, dy = STEPS[self._direction(pixels)]
        step = to_plane @ [dx, dy, 0.0]
        return x, y, lambda k: ((start + k * step)[:2], step[:2])

    def _direction(self, pixels):
        if len(pixels) == 1:
            return DIR_ROWS  # no matter: nothing is cut
        step = (pixels[1][0] - pixels[0][0], pixels[1][1] - pixels[0][1])
        return next(d for d, s in STEPS.items() if s == step)

    def _points(self, pixels):
        """The curve in the plane of its first and last point and of the viewpoint or the viewing axis z."""
        dtype = self.data.dtype
        points = np.array([self.data[v, u] for u, v in pixels], np.float64)
        points[:, 2] *= self.z_sign  # away from the viewer
        if self.height:
            points[:, 0] *= -1  # a rotation, not a mirror image
        valid = np.flatnonzero(np.isfinite(points).all(1))
        empty = np.full(len(pixels), np.nan, dtype)
        if len(valid) < 2:
            return empty, empty, None
        a, b, axis = points[valid[0]], points[valid[-1]], np.array([0.0, 0.0, 1.0])
        normal = np.cross(a, b) if self.projective else np.cross(axis, b - a)
        if not np.linalg.norm(normal) > 0:
            return empty, empty, None
        normal /= np.linalg.norm(normal)
        away = axis - (axis @ normal) * normal
        cosine = np.linalg.norm(away)  # between the axis and the plane
        away /= cosine
        along = np.cross(normal, away)
        a_depth, b_depth = (a @ away, b @ away) if self.projective else (1, 1)
        if (b @ along) / b_depth < (a @ along) / a_depth:
            along = -along
        if self.projective:
            z = (points @ away) * cosine
            with np.errstate(divide="ignore", invalid="ignore"):
                x, y = (points @ along) / z, 1 / z
            y[~(z > 0)] = np.nan
            offset = away / cosine  # the ray in the plane that is nearest to the axis, at depth 1
        else:
            x, y = points @ along, -(points @ away)
            offset = a - (a @ along) * along
        return x.astype(dtype), y.astype(dtype), lambda w: ((offset + w * along)[:2], along[:2])
