"""The approximation of a scan line by segments: splitting (paper, 4.1), and the merging of what noise has split."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rangeedge import FIT_INTERP

from .curves import Curve, meeting
from .lines import middles

STRADDLING = 2.0  # how much more, in significance, a segment across an edge may cost
TIE_COST = 1e-6  # of a cut, a sample


@dataclass
class Segment:
    first: int
    last: int
    curve: Curve = None

    @property
    def size(self):
        return self.last - self.first + 1


def approximated(line, params):
    """The segments of a line, with their curves."""
    eps = line.y.dtype.type(1 if line.scale is not None else np.nanmax(line.tolerance, initial=0))
    with np.errstate(all="ignore"):
        segments = [Segment(a, b) for a, b in split(line.y, line.x, eps, line.scale)]
    if params.fit == FIT_INTERP:
        for s in segments:
            middle = {midpoint(line.y, line.x, s.first, s.last)} if s.size > 2 else set()
            s.curve = line.interpolation(sorted({s.first, s.last} | middle))
        return segments
    for s in segments:
        s.curve = line.fit(s.first, s.last)
    if params.mergeSignificance > 0:
        segments = merged(line, segments, params.mergeSignificance)
        segments = dissolved(line, segments, params.mergeSignificance)
    return segments


# Splitting.


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
    rounding = 4 * np.finfo(y.dtype).eps * abs(y[k])
    return k if left < right - rounding or (left <= right + rounding and k < (first + last) / 2) else k - 1


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


# Merging.


def merged(line, segments, significance):
    """In every round, cuts that cost less than those beside them are taken back."""
    while True:
        costs = [_cost(line, *pair) for pair in pairwise(segments)]
        around = [math.inf, *costs, math.inf]
        chosen = [
            i for i, cost in enumerate(costs) if cost < significance**2 and cost < around[i] and cost <= around[i + 2]
        ]
        if not chosen:
            return segments
        for i in reversed(chosen):
            union = Segment(segments[i].first, segments[i + 1].last)
            union.curve = line.fit(union.first, union.last)
            segments = [*segments[:i], union, *segments[i + 2 :]]


def _cost(line, left, right):
    """By how much one curve for both raises the sum of squared residuals, in variances of the shorter one's fit."""
    if not adjacent(line, left, right):
        return math.inf
    border = [left.last, right.first]
    one = line.fit(left.first, right.last, border)
    rise = one.sum_squares - left.curve.sum_squares - right.curve.sum_squares
    cost = rise / _deviation(line, border, min(left.size, right.size)) ** 2
    return cost + TIE_COST * (left.size + right.size)


def _deviation(line, samples, n):
    """Of a fit to n samples, by slope or value, whichever is the noisier one."""
    return max(line.noise.factor(name, n) for name in ("slope", "value")) * line.deviation(samples, n)


def dissolved(line, segments, significance):
    """In every round, segments go that cost less than the others up to two away."""
    segments = list(segments)
    while True:
        parts = [_without(line, *segments[i - 1 : i + 2], significance) for i in range(1, len(segments) - 1)]
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
            for s in parts[i - 1][1]:
                s.curve = line.fit(s.first, s.last)


def _without(line, left, s, right, significance):
    """What it costs to take out the middle one of three segments, and what the outer two then are."""
    stays = math.inf, None
    if not adjacent(line, left, s) or not adjacent(line, s, right):
        return stays
    x = meeting(left.curve, right.curve, (float(line.x[s.first]) + float(line.x[s.last])) / 2)
    if x is None or not line.x[s.first - 1] <= x <= line.x[s.last + 1]:
        return stays
    cut = max([s.first - 1] + [k for k in range(s.first, s.last + 1) if line.x[k] <= x])
    pair, middle = [Segment(left.first, cut), Segment(cut + 1, right.last)], middles(s.first, s.last)
    squares = sum(line.fit(part.first, part.last, middle).sum_squares for part in pair)
    rise = squares - sum(part.curve.sum_squares for part in (left, s, right))
    cost = rise / _deviation(line, middle, s.size) ** 2
    return (cost, pair) if cost < (STRADDLING * significance) ** 2 else stays


def adjacent(line, left, right):
    return right.first == left.last + 1 and line.x[right.first] > line.x[left.last]
