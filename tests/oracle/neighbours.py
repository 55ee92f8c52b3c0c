"""Candidates of several scan lines together: what they add to each other, and the maps they give (paper, 4.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rangeedge import (
    CREASE_NORMAL,
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
)

from .lines import SMALLEST, STEPS, Image

REACH, CAPPED, LONE_SHARE = 4.0, 8.0, 1 / 3  # pixels; standard deviations
MOST_SPREADS = math.inf, 4  # of the first alignment and the second one
LEAST_SLOPE = 0.3
LEAST_SPREAD, LEAST_DIRECTIONS = 0.05, (0.02, 1e-9)

TIE = 1e-5  # relative: closer comparisons count as decided by rounding
KINDS = EDGE_JUMP | EDGE_CONVEX | EDGE_CONCAVE


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
    spread: float = math.inf  # standard deviation of the position of a crease, in samples
    smeared: bool = False  # a step over several samples, in whose middle it lies


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
        for spreads in MOST_SPREADS:
            kept = Neighbourhood([kept._aligned(c, spreads) for c in kept.found], self.image)
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

    def _aligned(self, c, spreads):
        """A crease moved along its scan line onto the line it has in common with its neighbours."""
        line = self._common_line(c) if c.crease > 0 and not c.kind & EDGE_JUMP else None
        if line is None:
            return c
        across, distance = line
        dx, dy = STEPS[c.direction]
        slope = dx * across[0] + dy * across[1]
        if abs(slope) < LEAST_SLOPE:
            return c
        shift = distance / slope
        if abs(c.shift + shift) > self.image.params.maxShift or abs(shift) > spreads * c.spread:
            return c
        x, y = c.x + shift * dx, c.y + shift * dy
        u = math.floor(x) if dx else round(x)
        v = math.floor(y) if dy > 0 else math.ceil(y) if dy < 0 else round(y)
        pixels = ((u, v), (u + dx, v + dy))
        if not all(self.image.has_data(*pixel) for pixel in pixels):
            return c
        return replace(c, x=x, y=y, shift=c.shift + shift, pixels=pixels)

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
