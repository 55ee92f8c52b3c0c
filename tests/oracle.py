"""The detector once more, slowly: what the kernels compute, written for reading.

Geometry is done on points and tangents in space, fits by linear algebra on the samples themselves, with nothing
carried over from one step to the next. Only splitting is done in the precision of the image, as the kernels do it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from rangeedge import (
    CREASE_NORMAL,
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    FIT_INTERP,
    MEASURE_ENDPOINT,
    NoiseModel,
    ScanLineParams,
)

# What the kernels fix and no parameter sets.
REFINEMENTS = ("merged", "dissolved")  # of least-squares approximations, in this order
CURVED_SIGNIFICANCE = 6.0  # of the quadratic term
STRADDLING = 2.0  # how much more, in significance, a segment across an edge may cost
LONE_SIGNIFICANCE = 3.0
JUMP_TOLERANCES, JUMP_ALONE = 2.0, 8.0
REACH, CAPPED, LONE_SHARE = 4.0, 8.0, 1 / 3  # pixels; standard deviations
LEAST_SLOPE = 0.3
LEAST_SPREAD, LEAST_DIRECTIONS = 0.05, (0.02, 1e-9)
SMALLEST = 1e-30

TIE = 1e-5  # relative: closer comparisons count as decided by rounding
PARALLEL = 1e-14  # what rounding makes of parallel tangents here

STEPS = {DIR_ROWS: (1, 0), DIR_COLS: (0, 1), DIR_DIAG45: (1, -1), DIR_DIAG135: (1, 1)}  # (dx, dy)
KINDS = EDGE_JUMP | EDGE_CONVEX | EDGE_CONCAVE


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


def along(direction, model):
    """The noise of fits along a direction, diagonals being between rows and columns."""
    rows, cols = np.reshape(model.of_fits()[4:], (2, -1))
    return FitNoise.of({DIR_ROWS: rows, DIR_COLS: cols}.get(direction, np.sqrt(rows * cols)))


def wave_share(n):
    """How much of the noise of a fit to n samples is waves, the rest being that of single samples."""
    return float(np.interp(n, [2, 4, 8, 16], [0, 0.4, 0.7, 1]))


# Splitting (paper, 4.1).


def split(y, x, eps, scale=None):
    """Segments [first, last] of one line; `y`, `x`, `eps` and `scale` are NumPy scalars of one precision."""
    segments = []
    for run in _runs(y, x):
        segments += _split_run(y, x, eps, scale, *run)
    return segments


def _runs(y, x):
    """Maximal stretches of valid samples with increasing abscissae."""
    runs, first = [], None
    for k in range(len(y)):
        if math.isnan(y[k]):
            first = None
        elif first is None or not x[k] > x[k - 1]:
            first = k
            runs.append([k, k])
        else:
            runs[-1][1] = k
    return runs


def _split_run(y, x, eps, scale, first, last):
    if last - first + 1 <= 3:
        return [(first, last)]
    m = (first + last) // 2
    left, right = x[m] - x[first], x[last] - x[m]
    slope_left, slope_right = (y[m] - y[first]) / left, (y[last] - y[m]) / right
    a = (slope_right - slope_left) / (left + right)
    b = slope_left + a * left
    worst, k = -math.inf, first
    for i in range(first + 1, last):
        t = x[i] - x[m]
        residual = abs(y[i] - (y[m] + t * (b + a * t)))
        if scale is not None:
            residual = residual * scale[i]
        if residual > worst:
            worst, k = residual, i
    if not worst > eps:
        return [(first, last)]
    cut = k if abs(y[k] - y[k - 1]) <= abs(y[k + 1] - y[k]) else k - 1  # the last sample before it
    return _split_run(y, x, eps, scale, first, cut) + _split_run(y, x, eps, scale, cut + 1, last)


# Curves.


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


# Scan lines.


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
    place: Any = None  # abscissa to the position (X, Y) in the plane of the image

    def deviation(self, k, n):
        """Of the samples around k, as a fit to n of them counts with it."""
        return self.sigma[k] + wave_share(n) * (self.waves[k] - self.sigma[k])

    def deviation_from_quadratic(self, k, n):
        """The same, as the quadratic term counts with it: the difference of the slopes of two halves."""
        return self.noise.factor("slope", n // 2) * self.deviation(k, n)

    def fit(self, first, last, k=None):
        """Least squares over samples, with the noise at sample k: the one in their middle, the right one of two."""
        n = last - first + 1
        deviation = self.deviation_from_quadratic(first + n // 2 if k is None else k, n)
        return least_squares(*(np.asarray(v[first : last + 1], np.float64) for v in (self.x, self.y)), deviation)

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


@dataclass
class Segment:
    first: int
    last: int
    curve: Curve = None

    @property
    def size(self):
        return self.last - self.first + 1


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
    spacing: tuple[float, float] = (1.0, 1.0)
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
    def z_sign(self):
        return -1.0 if self.height else 1.0

    def line(self, pixels, direction):
        if self.data.ndim == 3:
            x, y, place = self._points(pixels)
        else:
            x, y, place = self._grid(pixels)
        ordinate = np.asarray(y, np.float64)
        noise, waves = along(direction, self.noise), self.noise.of_fits()[:4]
        sigma = self._of_ordinate((self.noise.a, self.noise.b, self.noise.c, 0.0), ordinate)
        factor = self.params.epsFactor * noise.residual
        c = [factor * w for w in waves] if self.params.eps is None else [self.params.eps, 0.0, 0.0, 0.0]
        of_tolerance = self._of_ordinate(c, y)
        # The same everywhere: a length on a grid, or one that grows with the square of the depth.
        even = c[1] == c[3] == (c[0] if self.projective else c[2]) == 0
        scale = None if even else 1 / of_tolerance
        tolerance = np.full(len(y), max(c[2 if self.projective else 0], SMALLEST)) if even else 1 / np.float64(scale)
        waves = self._of_ordinate(waves, ordinate)
        return Line(pixels, direction, self.projective, x, y, sigma, waves, noise, tolerance, scale, place)

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
        to_plane = np.diag([*self.spacing, 1.0]) if self.K is None else np.linalg.inv(self.K)
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


# The steps of the paper, 4.


class Detector:
    def __init__(self, image: Image):
        self.image, self.p = image, image.params

    def candidates(self):
        found = []
        for direction in (DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135):
            if self.p.directions & direction:
                for pixels in paths(direction, *self.image.shape):
                    found += self._of_line(self.image.line(pixels, direction))
        return Neighbourhood(found, self.image).pooled()

    def segments(self, line):
        eps = line.y.dtype.type(1 if line.scale is not None else np.nanmax(line.tolerance, initial=0))
        with np.errstate(all="ignore"):
            return [Segment(a, b) for a, b in split(line.y, line.x, eps, line.scale)]

    def _of_line(self, line):
        segments = self.segments(line)
        if self.p.fit == FIT_INTERP:
            for s in segments:
                k = np.unique([s.first, (s.first + s.last) // 2, s.last])
                s.curve = fitted(_doubles(line.x, k), _doubles(line.y, k), len(k) - 1)
        else:
            for s in segments:
                s.curve = line.fit(s.first, s.last)
            for refinement in REFINEMENTS if self.p.mergeSignificance > 0 else ():
                segments = getattr(self, "_" + refinement)(line, segments)
        found = []
        for left, right in pairwise(segments):
            if right.first - left.last - 1 <= self.p.maxGap:
                candidate = self._measured(line, left, right, *self._position(line, left, right))
                if candidate.jump > 0 or candidate.crease > 0:
                    found.append(candidate)
        return found

    def _merged(self, line, segments):
        """In every round, cuts that cost less than those beside them are taken back."""
        limit = self.p.mergeSignificance**2
        while True:
            costs = [self._cost(line, *pair) for pair in pairwise(segments)]
            around = [math.inf, *costs, math.inf]
            chosen = [i for i, cost in enumerate(costs) if cost < limit and cost < around[i] and cost <= around[i + 2]]
            if not chosen:
                return segments
            for i in reversed(chosen):
                union = Segment(segments[i].first, segments[i + 1].last)
                union.curve = line.fit(union.first, union.last)
                segments = [*segments[:i], union, *segments[i + 2 :]]

    def _cost(self, line, left, right):
        """By how much one curve for both raises the sum of squared residuals, in variances of the shorter one's fit."""
        if not _adjacent(line, left, right):
            return math.inf
        one = line.fit(left.first, right.last, left.last)
        rise = one.sum_squares - left.curve.sum_squares - right.curve.sum_squares
        return rise / self._joining_deviation(line, left.last, min(left.size, right.size)) ** 2

    @staticmethod
    def _joining_deviation(line, k, n):
        """By slope or value, whichever is the noisier one, of a fit to n samples around k."""
        return max(line.noise.factor("slope", n), line.noise.factor("value", n)) * line.deviation(k, n)

    def _dissolved(self, line, segments):
        segments = list(segments)
        i = 1
        while i + 1 < len(segments):
            pair = self._without(line, *segments[i - 1 : i + 2])
            if pair is None:
                i += 1
            else:
                segments[i - 1 : i + 2] = pair
                i = max(1, i - 1)
        return segments

    def _without(self, line, left, s, right):
        """The outer two of three segments with the samples of the middle one, or None."""
        if not _adjacent(line, left, s) or not _adjacent(line, s, right):
            return None
        x = meeting(left.curve, right.curve, (float(line.x[s.first]) + float(line.x[s.last])) / 2)
        if x is None or not line.x[s.first - 1] <= x <= line.x[s.last + 1]:
            return None
        cut = max([s.first - 1] + [k for k in range(s.first, s.last + 1) if line.x[k] <= x])
        pair, k = [Segment(left.first, cut), Segment(cut + 1, right.last)], s.first + s.size // 2
        squares = sum(line.fit(part.first, part.last, k).sum_squares for part in pair)
        rise = squares - sum(part.curve.sum_squares for part in (left, s, right))
        if not rise < (STRADDLING * self.p.mergeSignificance * self._joining_deviation(line, k, s.size)) ** 2:
            return None
        for part in pair:
            part.curve = line.fit(part.first, part.last)
        return pair

    def _position(self, line, left, right):
        """Pixels before and after the edge, its abscissa, its place in samples, and whether the curves meet there."""
        a, b = left.last, right.first
        xa, xb = float(line.x[a]), float(line.x[b])
        middle = (xa + xb) / 2
        stay = (a, b, middle, (a + b) / 2, False)
        x = meeting(left.curve, right.curve, middle) if self.p.maxShift > 0 else None
        if x is None:
            return stay
        if xa <= x <= xb:
            sample = a + (b - a) * (x - xa) / (xb - xa)
            return (a, b, x, sample, True) if abs(sample - (a + b) / 2) <= self.p.maxShift else stay
        # The first sample passed over, and the curve to which it would belong.
        step, k, end, curve = (-1, a, left.first, right.curve) if x < xa else (1, b, right.last, left.curve)
        while k != end:
            here, there = float(line.x[k]), float(line.x[k + step])
            if abs(float(line.y[k]) - curve.value(here)) > line.tolerance[k]:
                return stay
            if min(here, there) <= x <= max(here, there):
                sample = k + step * (x - here) / (there - here)
                if abs(sample - (a + b) / 2) > self.p.maxShift:
                    return stay
                before = k - 1 if step < 0 else k
                return before, before + 1, x, sample, True
            k += step
        return stay

    def _measured(self, line, left, right, before, after, x, sample, meets):
        if self.p.measure == MEASURE_ENDPOINT:
            xf, xg = float(line.x[before]), float(line.x[after])
            zf, zg = float(line.y[before]), float(line.y[after])
            mf, mg = left.curve.slope(xf), right.curve.slope(xg)
            yf, yg = zf + mf * (x - xf), zg + mg * (x - xg)
        else:
            xf = xg = x
            yf, yg = zf, zg = left.curve.value(x), right.curve.value(x)
            mf, mg = left.curve.slope(x), right.curve.slope(x)
        height = (lambda y: 1 / y) if line.projective else (lambda y: y)
        jump = 0.0 if meets else abs(height(yf) - height(yg))
        bend = line.crease(xf, (zf, mf), xg, (zg, mg))
        f, g = _SideDeviation(line, left, before, xf), _SideDeviation(line, right, after, xg)
        turns = line.turn(xf, zf, mf), line.turn(xg, zg, mg)

        def significances(value, slope):
            """Of the jump and the crease, by these factors on what white noise does."""
            jump_deviation = math.hypot(f.value(value), g.value(value))
            crease_deviation = math.hypot(turns[0] * f.slope(slope), turns[1] * g.slope(slope))
            return abs(yf - yg) / jump_deviation, abs(bend) / crease_deviation

        jump_alone, crease_alone = significances("value", "slope")
        jump_shared, crease_shared = significances("shared_value", "shared_slope")
        least = min(LONE_SIGNIFICANCE, self.p.minSignificance)
        if jump_alone < least:
            jump = 0.0
        crease = math.degrees(abs(bend)) if crease_alone >= least else 0.0
        kind = 0
        error = JUMP_TOLERANCES * max(line.tolerance[before], line.tolerance[after])
        if jump > 0 and abs(yf - yg) > error and jump_alone > JUMP_ALONE:
            kind |= EDGE_JUMP | (EDGE_OCCLUDING if yf > yg else EDGE_OCCLUDED)
        if crease > 0:
            kind |= EDGE_CONVEX if bend > 0 else EDGE_CONCAVE
        (u, v), (dx, dy) = line.pixels[0], STEPS[line.direction]
        place, along = (np.array(p) for p in line.place(x))
        sides = [(yf, mf, f.slope("slope") ** 2), (yg, mg, g.slope("slope") ** 2)]
        unit = float(np.hypot(*along))
        return Candidate(
            x=u + sample * dx,
            y=v + sample * dy,
            shift=sample - (left.last + right.first) / 2,
            jump=jump,
            crease=crease,
            significance=max(jump_shared if jump > 0 else 0.0, crease_shared if crease > 0 else 0.0),
            kind=kind,
            direction=line.direction,
            pixels=(line.pixels[before], line.pixels[after]),
            place=place,
            along=along / unit,
            sides=[(value, slope / unit, variance / unit**2) for value, slope, variance in sides],
        )


@dataclass
class _SideDeviation:
    """What noise does to the curve of a segment at an abscissa, beside sample k; `name` is that of a factor."""

    line: Line
    segment: Segment
    k: int
    x: float

    def value(self, name):
        return self._of(name, self.segment.curve.value_variance(self.x))

    def slope(self, name):
        return self._of(name, self.segment.curve.slope_variance(self.x))

    def _of(self, name, variance):
        n = self.segment.size
        return self.line.noise.factor(name, n) * self.line.deviation(self.k, n) * math.sqrt(variance)


def _doubles(values, k):
    return np.asarray(values[k], np.float64)


def _adjacent(line, left, right):
    return right.first == left.last + 1 and line.x[right.first] > line.x[left.last]


@dataclass
class Candidate:
    x: float
    y: float
    shift: float
    jump: float
    crease: float
    significance: float
    kind: int
    direction: int
    pixels: tuple
    place: np.ndarray
    along: np.ndarray
    sides: list


# Neighbours.


@dataclass
class Neighbourhood:
    found: list[Candidate]
    image: Image

    def pooled(self):
        params = self.image.params
        if params.minSignificance == 0 == params.maxShift and params.crease != CREASE_NORMAL:
            return self.found
        joint = [replace(c, significance=self._joint_significance(c)) for c in self.found]
        kept = Neighbourhood([c for c in joint if c.significance >= params.minSignificance], self.image)
        kept = Neighbourhood([kept._aligned(c) for c in kept.found], self.image)
        return kept._with_normals() if params.crease == CREASE_NORMAL else kept.found

    def _common_line(self, c, share=1.0):
        """Unit normal of the line on which a candidate and its neighbours lie, and its distance; None for a point."""
        near = list(self._near(c))
        w = np.array([weight for _, weight in near])
        at = np.array([(n.x - c.x, n.y - c.y) for n, _ in near])
        mean = np.average(at, axis=0, weights=w)
        spread = (w[:, None] * (at - mean)).T @ (at - mean) / w.sum()
        if not np.trace(spread) > share * LEAST_SPREAD:
            return None
        across = np.linalg.eigh(spread)[1][:, 0]
        return across, float(across @ mean)

    def _aligned(self, c):
        """A crease moved along its scan line onto the line it has in common with its neighbours."""
        line = self._common_line(c) if c.crease > 0 and not c.kind & EDGE_JUMP else None
        if line is None:
            return c
        across, distance = line
        dx, dy = STEPS[c.direction]
        slope = dx * across[0] + dy * across[1]
        if abs(slope) < LEAST_SLOPE or abs(c.shift + distance / slope) > self.image.params.maxShift:
            return c
        x, y = c.x + distance / slope * dx, c.y + distance / slope * dy
        u = math.floor(x) if dx else round(x)
        v = math.floor(y) if dy > 0 else math.ceil(y) if dy < 0 else round(y)
        pixels = ((u, v), (u + dx, v + dy))
        if not all(self.image.has_data(*pixel) for pixel in pixels):
            return c
        return replace(c, x=x, y=y, shift=c.shift + distance / slope, pixels=pixels)

    def _near(self, c):
        """Candidates of a common kind within reach, with weights."""
        for n in self.found:
            rest = 1 - ((n.x - c.x) ** 2 + (n.y - c.y) ** 2) / REACH**2
            if rest > 0 and n.kind & c.kind & KINDS:
                yield n, rest**2

    def _joint_significance(self, c):
        evidence = sum(weight * min(n.significance, CAPPED) ** 2 for n, weight in self._near(c))
        return max(math.sqrt(evidence), LONE_SHARE * c.significance)

    def _with_normals(self):
        return [replace(c, crease=self._stable_angle(c)) if c.crease > 0 else c for c in self.found]

    def _stable_angle(self, c):
        """NaN where rounding decides on which side of the edge, or whether at all, a neighbour counts."""
        angles = [self._normal_angle(c, 1 + d, d) for d in (-TIE, TIE)]
        angles = [c.crease if a is None else a for a in angles]
        return angles[0] if math.isclose(*angles, rel_tol=TIE) else math.nan

    def _normal_angle(self, c, share, turned):
        line = self._common_line(c, share)
        if line is None:
            return None
        near = list(self._near(c))
        w = np.array([weight for _, weight in near])
        across = line[0]
        across = across + turned * np.array([-across[1], across[0]])
        normals = []
        for side in (0, 1):
            rows, slopes, weights, values = [], [], [], []
            for n, weight in near:
                forward = np.dot(STEPS[n.direction], across) > 0
                value, slope, variance = n.sides[side if forward else 1 - side]
                rows.append(n.along)
                slopes.append(slope)
                weights.append(weight / max(variance, SMALLEST))  # 0 where the samples fix no slope
                values.append(value)
            rows, slopes, weights = np.array(rows), np.array(slopes), np.array(weights)
            a = rows.T @ (weights[:, None] * rows)
            bounds = np.array([a[0, 0] * a[1, 1], np.trace(a) ** 2]) * LEAST_DIRECTIONS
            if not (np.linalg.det(a) > share * bounds).all():
                return None
            gradient = np.linalg.solve(a, rows.T @ (weights * slopes))
            if self.image.projective:
                place = np.average([n.place for n, _ in near], axis=0, weights=w)
                normals.append(np.array([*gradient, np.average(values, weights=w) - gradient @ place]))
            else:
                normals.append(np.array([*gradient, 1.0]))
        a, b = normals
        return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b)))


# Combination.


def edge_points(image):
    return Detector(image).candidates()


def edge_strength(image, candidates):
    """jump, crease, kind, significance of every pixel."""
    rows, cols = image.shape
    jump, crease, significance = (np.zeros((rows, cols)) for _ in range(3))
    kind = np.zeros((rows, cols), np.uint8)
    for c in candidates:
        for (u, v), occluding in zip(c.pixels, (EDGE_OCCLUDING, EDGE_OCCLUDED), strict=True):
            if c.kind & EDGE_JUMP:
                kind[v, u] |= EDGE_JUMP | (EDGE_OCCLUDING if c.kind & occluding else EDGE_OCCLUDED)
            angle, largest = np.float32(c.crease), np.float32(crease[v, u])
            if angle > largest or (angle == largest and c.kind & EDGE_CONVEX):
                crease[v, u] = c.crease
                kind[v, u] &= ~np.uint8(EDGE_CONVEX | EDGE_CONCAVE)
                kind[v, u] |= c.kind & (EDGE_CONVEX | EDGE_CONCAVE)
            jump[v, u] = max(jump[v, u], c.jump)
            significance[v, u] = max(significance[v, u], c.significance)
    kind[beside_invalid(image)] |= EDGE_BOUNDARY
    return jump, crease, kind, significance


def beside_invalid(image):
    rows, cols = image.shape
    beside = np.zeros((rows, cols), bool)
    for v in range(rows):
        for u in range(cols):
            around = [(i, j) for i in (u - 1, u, u + 1) for j in (v - 1, v, v + 1) if 0 <= i < cols and 0 <= j < rows]
            beside[v, u] = image.has_data(u, v) and not all(image.has_data(*pixel) for pixel in around)
    return beside
