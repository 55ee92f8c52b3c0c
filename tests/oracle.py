"""The detector once more, slowly: what the kernels compute, written for reading.

Geometry is done on points and tangents in space, fits by linear algebra on the samples themselves, with nothing
carried over from one step to the next. Only splitting is done in the precision of the image, as the kernels do it.
"""

from __future__ import annotations

import math
from collections import Counter
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
CURVED_SIGNIFICANCE = 5.0  # of the quadratic term
STRADDLING = 2.0  # how much more, in significance, a segment across an edge may cost
TIE_COST = 1e-6  # of a cut, a sample
LONE_SIGNIFICANCE = 3.0
JUMP_TOLERANCES, JUMP_ALONE = 2.0, 12.0
REACH, CAPPED, LONE_SHARE = 4.0, 8.0, 1 / 3  # pixels; standard deviations
LEAST_SLOPE = 0.3
LEAST_SPREAD, LEAST_DIRECTIONS = 0.05, (0.02, 1e-9)
LEAST_OUTLINED = 3  # samples of a surface beside a wide gap
SMEAR_ENDS = 4  # samples
VEIL, VEIL_OF_TWO = 20.0, 45.0  # degrees
OVERSHOOT, OWN_SHARE, LEAST_RAMP = 0.2, 0.15, 0.5  # of a smeared step
MOST_EVEN = 2.01  # times the steps of an even ramp
SMALLEST = 1e-30

TIE = 1e-5  # relative: closer comparisons count as decided by rounding
PARALLEL = 1e-14  # what rounding makes of parallel tangents here

STEPS = {DIR_ROWS: (1, 0), DIR_COLS: (0, 1), DIR_DIAG45: (1, -1), DIR_DIAG135: (1, 1)}  # (dx, dy)
KINDS = EDGE_JUMP | EDGE_CONVEX | EDGE_CONCAVE


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
    m = midpoint(y, x, first, last)
    left, right, inverse = x[m] - x[first], x[last] - x[m], 1 / (x[last] - x[first])
    if m == first:
        a, b = y.dtype.type(0), (y[last] - y[first]) * inverse
    else:
        slope_left, slope_right = (y[m] - y[first]) / left, (y[last] - y[m]) / right
        a = (slope_right - slope_left) * inverse
        b = (slope_left * right + slope_right * left) * inverse
    residuals = []
    for i in range(first + 1, last):
        t = x[i] - x[m]
        residual = abs(y[i] - (y[m] + t * (b + a * t)))
        residuals.append(residual if scale is None else residual * scale[i])
    worst = np.nanmax(residuals)
    if not worst > eps:
        return [(first, last)]
    extreme = [first + 1 + i for i, residual in enumerate(residuals) if residual == worst]
    outer = {extreme[0], extreme[-1]}
    nearest = min(abs(2 * k - first - last) for k in outer)
    cuts = {_cut_at(y, first, last, k) for k in outer if abs(2 * k - first - last) == nearest}
    bounds = [first - 1, *sorted(cuts), last]
    return [s for a, b in pairwise(bounds) for s in _split_run(y, x, eps, scale, a + 1, b)]


def _cut_at(y, first, last, k):
    """The last sample before the cut beside an extreme sample."""
    left, right = abs(y[k] - y[k - 1]), abs(y[k + 1] - y[k])
    return k if left < right or (left == right and k < (first + last) / 2) else k - 1


def midpoint(y, x, first, last):
    """The middle sample, or that of two which is closer to the straight line between the ends.

    The first sample where they are equally far on either side of it: then that line is the curve.
    """
    (m, n), slope = middles(first, last), (y[last] - y[first]) / (x[last] - x[first])
    left = y[m] - y[first] - slope * (x[m] - x[first])
    right = y[n] - y[last] + slope * (x[last] - x[n])
    if m < n and left == -right and left != 0:
        return first
    return n if abs(right) < abs(left) else m


def middles(first, last):
    """The two samples in the middle, which are one where their number is odd."""
    return (first + last) // 2, (first + last + 1) // 2


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
    return Curve(origin, unit, base, coefficients, inverse @ inverse.T, float(residuals @ residuals))


def least_squares(x, y, sigma):
    """A line, or a quadratic where that is significant."""
    line = fitted(x, y, min(1, len(x) - 1))
    if len(x) <= 3:
        return line
    curve = fitted(x, y, 2)
    significance = abs(curve.coefficients[2]) / (sigma * math.sqrt(curve.covariance[2, 2]))
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
    sigma: np.ndarray  # of the ordinates
    tolerance: np.ndarray
    scale: np.ndarray | None  # inverse tolerances, where they differ
    place: Any = None  # abscissa to the position (X, Y) in the plane of the image

    def sigma_in(self, s):
        """In the middle of a segment."""
        return self.sigma[list(middles(s.first, s.last))].mean()

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
        ordinate = np.asarray(y, np.float64)
        depth = 1 / ordinate if self.projective else np.abs(ordinate)
        to_ordinate = ordinate**2 if self.projective else np.ones_like(ordinate)
        sigma = np.maximum(self.noise.correlation * self.noise(depth) * to_ordinate, SMALLEST)
        scale = self._inverse_tolerances(y)
        tolerance = 1 / scale.astype(np.float64)
        n = self.noise
        scaled = n.b != 0 or (n.a if self.projective else n.c) != 0
        if self.params.eps is not None:
            scaled = self.projective
        elif not scaled:
            tolerance = self.params.epsFactor * sigma
        if not scaled and self.params.eps is not None:
            tolerance = np.full(len(y), self.params.eps)
        return Line(pixels, direction, self.projective, x, y, sigma, tolerance, scale if scaled else None, place)

    def _inverse_tolerances(self, y):
        """In the precision of the image; of noise as a polynomial: sigma(1 / q) q^2 = a q^2 + b q + c."""
        n, eps, real = self.noise, self.params.eps, y.dtype.type
        factor = real(self.params.epsFactor * n.correlation if eps is None else eps)
        a, b, c = (factor * real(v) for v in ((n.a, n.b, n.c) if eps is None else (1.0, 0.0, 0.0)))
        y = y if self.projective else abs(y)
        tolerance = (a * y + b) * y + c if self.projective else a + (b + c * y) * y
        return 1 / np.where(tolerance > real(SMALLEST), tolerance, real(SMALLEST))

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


# The steps of the paper, 4.


class Detector:
    def __init__(self, image: Image):
        self.image, self.p = image, image.params
        self.smeared = Counter()  # how often a pixel is found to be one over which a step is smeared

    def candidates(self):
        found = []
        for direction in (DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135):
            if self.p.directions & direction:
                for pixels in paths(direction, *self.image.shape):
                    found += self._of_line(self.image.line(pixels, direction))
        least = bin(self.p.directions).count("1")
        smeared = {p for p in self.smeared if sum(self.smeared[q] for q in _around([p])) >= least}
        return Neighbourhood([c for c in found if not _in_smear(c, smeared)], self.image).pooled()

    def segments(self, line):
        eps = line.y.dtype.type(1 if line.scale is not None else np.nanmax(line.tolerance, initial=0))
        with np.errstate(all="ignore"):
            return [Segment(a, b) for a, b in split(line.y, line.x, eps, line.scale)]

    def _of_line(self, line):
        segments = self.segments(line)
        if self.p.fit == FIT_INTERP:
            for s in segments:
                k = {s.first, s.last}
                if s.size > 2:
                    k.add(midpoint(line.y, line.x, s.first, s.last))
                s.curve = fitted(_doubles(line.x, sorted(k)), _doubles(line.y, sorted(k)), len(k) - 1)
        else:
            for s in segments:
                s.curve = self._fit(line, s)
            for refinement in REFINEMENTS if self.p.mergeSignificance > 0 else ():
                segments = getattr(self, "_" + refinement)(line, segments)
        found, i = [], 0
        while i + 1 < len(segments):
            candidate, i = self._smeared_step(line, segments, i) or (self._at_cut(line, *segments[i : i + 2]), i + 1)
            if candidate and (candidate.jump > 0 or candidate.crease > 0):
                found.append(candidate)
        return found

    def _at_cut(self, line, left, right):
        gap = right.first - left.last - 1
        if gap > self.p.maxGap:
            long = min(left.size, right.size) >= LEAST_OUTLINED
            return self._outline(line, left, right, left.last, right.first) if long else None
        if gap and min(left.size, right.size) == 1:
            return None
        return self._measured(line, left, right, *self._position(line, left, right))

    def _smeared_step(self, line, segments, i):
        """The jump over the short segments after the i-th one, and the number of the long one after them; or None."""
        long = [j for j in range(i, len(segments)) if segments[j].size > self.p.maxSmear][:2]
        if len(long) < 2 or long[0] != i or long[1] == i + 1:
            return None
        left, short, right = segments[i], segments[i + 1 : long[1]], segments[long[1]]
        samples = [k for s in short for k in range(s.first, s.last + 1)]
        gaps = [b.first - a.last - 1 for a, b in pairwise(segments[i : long[1] + 1])]
        if len(samples) > self.p.maxSmear + SMEAR_ENDS:
            return None
        ends = float(line.x[left.last]), float(line.x[right.first])
        before, after = (  # the tangents at the ends of the sides
            s.curve.value(end) + s.curve.slope(end) * (_doubles(line.x, samples) - end)
            for s, end in zip((left, right), ends, strict=True)
        )
        if line.projective and min(*before, *after) <= 0:
            return None
        steps = np.subtract(after, before)
        if not (np.all(steps > 0) or np.all(steps < 0)):
            return None
        here, before, after = (line.height(np.array(y)) for y in (_doubles(line.y, samples), before, after))
        share = (here - before) / (after - before)
        slack = np.maximum(OVERSHOOT, line.tolerance[samples] / abs(steps))
        n = len(samples)
        if np.any(share < -slack) or np.any(share > 1 + slack):
            return None
        if share[-1] - share[0] < LEAST_RAMP * (n - 1) / (n + 1):
            return None
        rising = [k for k, p in zip(samples, share, strict=True) if p > OWN_SHARE]
        falling = [k for k, p in zip(samples, share, strict=True) if p < 1 - OWN_SHARE]
        a = max([left.last] + [k for k in samples if not rising or k < rising[0]])
        b = min([right.first] + [k for k in samples if not falling or k > falling[-1]])
        smeared = [k for k in range(a + 1, b) if not math.isnan(line.y[k])]
        steepest = max(np.diff([0.0, *share, 1.0]))
        if len(smeared) > self.p.maxSmear or steepest > MOST_EVEN / (len(smeared) + 1):
            return None
        if self.image.spaced and line.grazing_angle(a, b) > (VEIL if len(smeared) > 2 else VEIL_OF_TWO):
            return None
        middle = (float(line.x[a]) + float(line.x[b])) / 2
        if max(gaps) > self.p.maxGap:
            candidate = self._outline(line, left, right, a, b)
        else:
            candidate = self._measured(line, left, right, a, b, middle, (a + b) / 2, False)
        if not candidate or not candidate.kind & EDGE_JUMP:
            return None
        self.smeared.update(line.pixels[k] for k in smeared)
        return candidate, long[1]

    def _fit(self, line, s):
        k = np.arange(s.first, s.last + 1)
        sigma = line.sigma_in(s)
        return least_squares(_doubles(line.x, k), _doubles(line.y, k), sigma)

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
                union.curve = self._fit(line, union)
                segments = [*segments[:i], union, *segments[i + 2 :]]

    def _cost(self, line, left, right):
        """By how much one curve for both raises the sum of squared residuals, in variances of the noise."""
        if not _adjacent(line, left, right):
            return math.inf
        k, sigma = np.arange(left.first, right.last + 1), line.sigma[[left.last, right.first]].mean()
        one = least_squares(_doubles(line.x, k), _doubles(line.y, k), sigma)
        rise = (one.sum_squares - left.curve.sum_squares - right.curve.sum_squares) / sigma**2
        return rise + TIE_COST * len(k)

    def _dissolved(self, line, segments):
        """In every round, segments go that cost less than the others up to two away."""
        segments = list(segments)
        while True:
            parts = [self._without(line, *segments[i - 1 : i + 2]) for i in range(1, len(segments) - 1)]
            costs = [math.inf] * 3 + [cost for cost, _ in parts] + [math.inf] * 3
            chosen = [
                i
                for i in range(1, len(segments) - 1)
                if costs[i + 2] < min(costs[i : i + 2]) and costs[i + 2] <= min(costs[i + 3 : i + 5])
            ]
            if not chosen:
                return segments
            for i in reversed(chosen):
                segments[i - 1 : i + 2] = parts[i - 1][1]

    def _without(self, line, left, s, right):
        """What it costs to take out the middle one of three segments, and what the outer two then are."""
        stays = math.inf, None
        if not _adjacent(line, left, s) or not _adjacent(line, s, right):
            return stays
        x = meeting(left.curve, right.curve, (float(line.x[s.first]) + float(line.x[s.last])) / 2)
        if x is None or not line.x[s.first - 1] <= x <= line.x[s.last + 1]:
            return stays
        cut = max([s.first - 1] + [k for k in range(s.first, s.last + 1) if line.x[k] <= x])
        pair, sigma = [Segment(left.first, cut), Segment(cut + 1, right.last)], line.sigma_in(s)
        for part in pair:
            k = np.arange(part.first, part.last + 1)
            part.curve = least_squares(_doubles(line.x, k), _doubles(line.y, k), sigma)
        rise = sum(p.curve.sum_squares for p in pair) - sum(p.curve.sum_squares for p in (left, s, right))
        cost = rise / sigma**2
        return (cost, pair) if cost < (STRADDLING * self.p.mergeSignificance) ** 2 else stays

    def _outline(self, line, left, right, a, b):
        """The jump at the end of the nearer of two surfaces, beside a wide gap between samples a and b; or None."""
        if not self.p.shadowEdges:
            return None
        ends = [(float(line.x[a]), left.curve), (float(line.x[b]), right.curve)]
        (x, near), (x_far, far) = sorted(ends, key=lambda end: end[1].value(end[0]), reverse=True)
        y, y_far, below = near.value(x), far.value(x_far), far.value(x)
        if line.projective and not min(y, y_far, below) > 0:
            return None
        if self.image.spaced and line.grazing_angle(a, b) > VEIL:
            return None
        difference = min(y - below, y - y_far)
        if not self.image.spaced:
            difference = min(difference, near.value(x_far) - y_far)
        significance = difference / (line.sigma[[a, b]].mean() * math.hypot(*_deviations(near, far, x)))
        if not (significance > JUMP_ALONE and difference > JUMP_TOLERANCES * max(line.tolerance[[a, b]])):
            return None
        first = near is left.curve
        sample, (u, v), (dx, dy) = a + 0.5 if first else b - 0.5, line.pixels[0], STEPS[line.direction]
        return Candidate(
            x=u + sample * dx,
            y=v + sample * dy,
            shift=0.0,
            jump=min(
                _range_around(line, a, b), *(abs(line.height(y) - line.height(other)) for other in (below, y_far))
            ),
            crease=0.0,
            significance=significance,
            kind=EDGE_JUMP | (EDGE_OCCLUDING if first else EDGE_OCCLUDED),
            direction=line.direction,
            pixels=(line.pixels[a], line.pixels[b]),
            place=np.zeros(2),
            along=np.zeros(2),
            sides=[(0.0, 0.0, math.inf)] * 2,
        )

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
        height = line.height
        jump = 0.0 if meets else abs(height(yf) - height(yg))
        jump = min(jump, _range_around(line, before, after))
        bend = line.crease(xf, (zf, mf), xg, (zg, mg))
        sigma = (line.sigma[before] + line.sigma[after]) / 2
        jump_deviation = sigma * math.sqrt(left.curve.value_variance(xf) + right.curve.value_variance(xg))
        crease_deviation = sigma * math.sqrt(
            line.turn(xf, zf, mf) ** 2 * left.curve.slope_variance(xf)
            + line.turn(xg, zg, mg) ** 2 * right.curve.slope_variance(xg)
        )
        least = min(LONE_SIGNIFICANCE, self.p.minSignificance)
        jump_significance, crease_significance = abs(yf - yg) / jump_deviation, abs(bend) / crease_deviation
        if jump_significance < least:
            jump = 0.0
        crease = math.degrees(abs(bend)) if crease_significance >= least else 0.0
        kind = 0
        error = JUMP_TOLERANCES * max(line.tolerance[before], line.tolerance[after])
        if jump > 0 and abs(yf - yg) > error and jump_significance > JUMP_ALONE:
            least = abs(yf - yg) / (2.5 * (right.first - left.last) - 1.5)
            around = line.y[max(before - 2, 0) : after + 3]
            if _smooth(around, least if len(around) == after - before + 5 else least / 2):
                jump = 0.0
            else:
                kind |= EDGE_JUMP | (EDGE_OCCLUDING if yf > yg else EDGE_OCCLUDED)
                crease = 0.0
        if crease > 0:
            kind |= EDGE_CONVEX if bend > 0 else EDGE_CONCAVE
        (u, v), (dx, dy) = line.pixels[0], STEPS[line.direction]
        place, along = (np.array(p) for p in line.place(x))
        sides = [(yf, mf, left.curve.slope_variance(xf)), (yg, mg, right.curve.slope_variance(xg))]
        unit = float(np.hypot(*along))
        return Candidate(
            x=u + sample * dx,
            y=v + sample * dy,
            shift=sample - (left.last + right.first) / 2,
            jump=jump,
            crease=crease,
            significance=max(jump_significance if jump > 0 else 0.0, crease_significance if crease > 0 else 0.0),
            kind=kind,
            direction=line.direction,
            pixels=(line.pixels[before], line.pixels[after]),
            place=place,
            along=along / unit,
            sides=[(value, slope / unit, variance / unit**2) for value, slope, variance in sides],
        )


def _range_around(line, before, after):
    """Of the depths of two samples on either side of an edge."""
    around = [line.height(float(line.y[k])) for k in (before - 1, before, after, after + 1) if 0 <= k < len(line.y)]
    return np.nanmax(around) - np.nanmin(around)


def _deviations(f, g, x):
    return math.sqrt(f.value_variance(x)), math.sqrt(g.value_variance(x))


def _smooth(y, least):
    """Whether samples have third differences, and all of them are smaller."""
    return len(y) > 3 and bool(np.isfinite(y).all()) and np.abs(np.diff(y.astype(np.float64), 3)).max() < least


def _in_smear(c, smeared):
    """A jump whose nearer side is smeared, or a crease of which a pixel is smeared or beside one that is."""
    if c.kind & EDGE_JUMP:
        return c.pixels[0 if c.kind & EDGE_OCCLUDING else 1] in smeared
    return not _around(c.pixels).isdisjoint(smeared)


def _around(pixels):
    return {(u + i, v + j) for u, v in pixels for i in (-1, 0, 1) for j in (-1, 0, 1)}


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
    at_pixels = {}
    for c in candidates:
        for (u, v), occluding in zip(c.pixels, (EDGE_OCCLUDING, EDGE_OCCLUDED), strict=True):
            at_pixels.setdefault((v, u), []).append((c, EDGE_OCCLUDING if c.kind & occluding else EDGE_OCCLUDED))
    for p, there in at_pixels.items():
        jump[p] = max(c.jump for c, _ in there)
        jumps = [(c, side) for c, side in there if c.kind & EDGE_JUMP]
        sure = max((c.significance for c, _ in jumps), default=0.0)
        if not any(c.crease > 0 and c.significance > sure for c, _ in there):
            for _, side in jumps:
                kind[p] |= EDGE_JUMP | side
        if kind[p] & EDGE_JUMP:
            significance[p] = sure
            continue
        significance[p] = max(c.significance for c, _ in there)
        creases = [(np.float32(c.crease), c.kind & EDGE_CONVEX, c) for c, _ in there if c.crease > 0]
        if creases:
            largest = max(creases, key=lambda found: found[:2])[2]
            crease[p] = largest.crease
            kind[p] |= largest.kind & (EDGE_CONVEX | EDGE_CONCAVE)
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
