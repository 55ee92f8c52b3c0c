"""The edges of scan lines: position, strengths and kind of what is between two segments (paper, 4.2)."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rangeedge import (
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    MEASURE_ENDPOINT,
)

from .approximation import Segment, approximated
from .curves import meeting
from .lines import STEPS, Image, Line, paths
from .neighbours import Candidate, Neighbourhood

LONE_SIGNIFICANCE = 3.0
JUMP_TOLERANCES, JUMP_ALONE = 2.0, 8.0
BEND_REACH, BEND_SAMPLES = 4, 8
LEAST_OUTLINED = 3  # samples of a surface beside a wide gap
SMEAR_ENDS = 4  # samples
VEIL, VEIL_OF_TWO = 20.0, 45.0  # degrees
OVERSHOOT, OWN_SHARE, LEAST_RAMP = 0.2, 0.15, 0.5  # of a smeared step
MOST_EVEN = 2.01  # times the steps of an even ramp


def edge_points(image):
    return Detector(image).candidates()


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

    def _of_line(self, line):
        segments = approximated(line, self.p)
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
        x_there, y_there = line.doubles(samples)
        before, after = (  # the tangents at the ends of the sides
            s.curve.value(end) + s.curve.slope(end) * (x_there - end)
            for s, end in zip((left, right), ends, strict=True)
        )
        if line.projective and min(*before, *after) <= 0:
            return None
        steps = np.subtract(after, before)
        if not (np.all(steps > 0) or np.all(steps < 0)):
            return None
        here, before, after = (line.height(np.array(y)) for y in (y_there, before, after))
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
        smeared = [k for k in range(a + 1, b) if not math.isnan(line.y[k]) and line.seen[k]]
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
        # It lies where the ramp passes its middle.
        low = max([left.last] + [k for k, p in zip(samples, share, strict=True) if p < 0.5])
        high = min(k for k in [*samples, right.first] if k > low)
        candidate = replace(candidate, **_at(line, low, high, (low + high) / 2), shift=0.0, smeared=True)
        self.smeared.update(line.pixels[k] for k in smeared)
        return candidate, long[1]

    def _outline(self, line, left, right, a, b):
        """The jump at the end of the nearer of two surfaces, beside a wide gap between samples a and b; or None."""
        if not self.p.shadowEdges:
            return None
        ends = [(float(line.x[a]), left.curve), (float(line.x[b]), right.curve)]
        (x, near), (x_far, far) = sorted(ends, key=lambda end: end[1].value(end[0]), reverse=True)
        y, y_far, below = near.value(x), far.value(x_far), max(_extended(far, x_far, x))
        if line.projective and not min(y, y_far, below) > 0:
            return None
        if self.image.spaced and line.grazing_angle(a, b) > VEIL:
            return None
        difference = min(y - below, y - y_far)
        if not self.image.spaced:
            difference = min(difference, min(_extended(near, x, x_far)) - y_far)
        noise = _EdgeNoise(_SideNoise(line, left, a, x), _SideNoise(line, right, b, x))
        if not _is_jump(line, a, b, difference, noise.of_jump("value")):
            return None
        first = near is left.curve
        return Candidate(
            **_at(line, a, b, a + 0.5 if first else b - 0.5),
            shift=0.0,
            jump=min(
                _range_around(line, a, b), *(abs(line.height(y) - line.height(other)) for other in (below, y_far))
            ),
            crease=0.0,
            significance=difference / noise.of_jump("shared_value"),
            kind=EDGE_JUMP | (EDGE_OCCLUDING if first else EDGE_OCCLUDED),
            direction=line.direction,
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
        rounding = 1e-9 * (xb - xa)
        if xa - rounding <= x <= xb + rounding:
            sample = a + (b - a) * (x - xa) / (xb - xa)
            return (a, b, x, sample, True) if abs(sample - (a + b) / 2) <= self.p.maxShift else stay
        # The first sample passed over, and the curve to which it would belong.
        step, k, end, curve = (-1, a, left.first, right.curve) if x < xa else (1, b, right.last, left.curve)
        while k != end:
            here, there = float(line.x[k]), float(line.x[k + step])
            if abs(float(line.y[k]) - curve.value(here)) > line.tolerance[k]:
                return stay
            if min(here, there) - rounding <= x <= max(here, there) + rounding:
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
        difference = abs(yf - yg)
        f, g = _SideNoise(line, left, before, xf), _SideNoise(line, right, after, xg)
        noise = _EdgeNoise(f, g, line.turn(xf, zf, mf), line.turn(xg, zg, mg))
        least = min(LONE_SIGNIFICANCE, self.p.minSignificance)
        if difference < least * noise.of_jump("value"):
            jump = 0.0
        crease = math.degrees(abs(bend)) if abs(bend) >= least * noise.of_crease("slope") else 0.0
        kind = 0
        if jump > 0 and _is_jump(line, before, after, difference, noise.of_jump("value")):
            if _is_smooth(line, before, after, right.first - left.last, difference):
                jump = 0.0
            else:
                kind |= EDGE_JUMP | (EDGE_OCCLUDING if yf > yg else EDGE_OCCLUDED)
        step = float(line.x[after] - line.x[before]) / (after - before)
        if kind & EDGE_JUMP or _bends_smoothly(line, before, after, abs(mf - mg) * step):
            crease = 0.0
        if crease > 0:
            kind |= EDGE_CONVEX if bend > 0 else EDGE_CONCAVE
        jump_significance = difference / noise.of_jump("shared_value") if jump > 0 else 0.0
        crease_significance = abs(bend) / noise.of_crease("shared_slope") if crease > 0 else 0.0
        place, along = (np.array(p) for p in line.place(x))
        sides = [(yf, mf, f.slope("slope") ** 2), (yg, mg, g.slope("slope") ** 2)]
        unit = float(np.hypot(*along))
        spread = noise.of_jump("value") / (abs(mf - mg) * step) if mf != mg else math.inf
        return Candidate(
            **_at(line, before, after, sample),
            shift=sample - (left.last + right.first) / 2,
            jump=jump,
            crease=crease,
            significance=crease_significance if crease > 0 else jump_significance,
            kind=kind,
            direction=line.direction,
            place=place,
            along=along / unit,
            sides=[(value, slope / unit, variance / unit**2) for value, slope, variance in sides],
            spread=spread,
        )


def _extended(curve, x, to):
    """To where a curve leads from an abscissa to another one, by itself and straight on."""
    return curve.value(to), curve.value(x) + curve.slope(x) * (to - x)


def _at(line, before, after, sample):
    """Where a candidate is: its position, and the pixels with data on either side."""
    (u, v), (dx, dy) = line.pixels[0], STEPS[line.direction]
    a, b = max(np.flatnonzero(line.seen[: before + 1])), after + min(np.flatnonzero(line.seen[after:]))
    return dict(x=u + sample * dx, y=v + sample * dy, pixels=(line.pixels[a], line.pixels[b]))


def _range_around(line, before, after):
    """Of the depths of two samples on either side of an edge."""
    around = [line.height(float(line.y[k])) for k in (before - 1, before, after, after + 1) if 0 <= k < len(line.y)]
    return np.nanmax(around) - np.nanmin(around)


def _is_jump(line, before, after, difference, deviation):
    tolerance = max(line.tolerance[before], line.tolerance[after])
    return difference > JUMP_TOLERANCES * tolerance and difference > JUMP_ALONE * deviation


def _is_smooth(line, before, after, n, step):
    """Whether the samples around an edge run on too smoothly for a step of that size, n samples wide."""
    sharp = 2.5 * n - 1.5
    cut_off = before < 2 or after + 2 >= len(line.y)  # by the border, so that half of the differences are to be seen
    return _largest_third_difference(line, before, after, 2) < step / (2 * sharp if cut_off else sharp)


def _bends_smoothly(line, before, after, slope):
    """The same for a change of slope, from one sample to the next."""
    return _largest_third_difference(line, before, after, BEND_REACH) < slope / BEND_SAMPLES


def _largest_third_difference(line, before, after, margin):
    y = line.y[max(before - margin, 0) : after + margin + 1].astype(np.float64)
    return np.abs(np.diff(y, 3)).max() if len(y) > 3 and np.isfinite(y).all() else math.inf


def _in_smear(c, smeared):
    """A jump whose nearer side is smeared, unless it is that of a smeared step, or a crease within or beside smear."""
    if c.kind & EDGE_JUMP:
        return not c.smeared and c.pixels[0 if c.kind & EDGE_OCCLUDING else 1] in smeared
    return not _around(c.pixels).isdisjoint(smeared)


def _around(pixels):
    return {(u + i, v + j) for u, v in pixels for i in (-1, 0, 1) for j in (-1, 0, 1)}


@dataclass
class _SideNoise:
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
        return self.line.noise.factor(name, n) * self.line.deviation([self.k], n) * math.sqrt(variance)


@dataclass
class _EdgeNoise:
    """What it does to the difference of the curves of two sides, and to the angle between them, in radians."""

    before: _SideNoise
    after: _SideNoise
    turn_before: float = 0.0
    turn_after: float = 0.0

    def of_jump(self, name):
        return math.hypot(self.before.value(name), self.after.value(name))

    def of_crease(self, name):
        return math.hypot(self.turn_before * self.before.slope(name), self.turn_after * self.after.slope(name))
