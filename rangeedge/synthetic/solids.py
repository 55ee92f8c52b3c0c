"""Solids to be seen by rays: every face is a quadric, planes included, cut off by other quadrics.

A point p is on the quadric Q, a symmetric 4x4 matrix, where (p, 1)' Q (p, 1) = 0, and inside where that is negative.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from .. import _check

Vector = Sequence[float] | np.ndarray
Rays = tuple[np.ndarray, np.ndarray]  # origins and directions, (N, 3) each

_ON_FACE = 1e-9  # so far a point may lie outside a face and still belong to it: no cracks between faces


class Face(NamedTuple):
    """The part of a surface that lies inside all of its clips."""

    quadric: np.ndarray
    clips: tuple[np.ndarray, ...]


class Solid(NamedTuple):
    """A body bounded by faces, and a sphere around it (radius infinite where it has no bounds)."""

    faces: tuple[Face, ...]
    center: np.ndarray
    radius: float


def half_space(normal: np.ndarray, point: np.ndarray) -> np.ndarray:
    quadric = np.zeros((4, 4))
    quadric[:3, 3] = quadric[3, :3] = normal / 2
    quadric[3, 3] = -normal @ point
    return quadric


def _revolution(center: np.ndarray, axis: np.ndarray, flattening: float, radius: float) -> np.ndarray:
    """Sphere (flattening 0), cylinder (1) or cone with its apex at `center` (1 + tan^2 of the half angle, radius 0)."""
    quadric = np.empty((4, 4))
    quadric[:3, :3] = np.eye(3) - flattening * np.outer(axis, axis)
    quadric[:3, 3] = quadric[3, :3] = -quadric[:3, :3] @ center
    quadric[3, 3] = center @ quadric[:3, :3] @ center - radius**2
    return quadric


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def _gradient(quadric: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ quadric[:3, :3] + quadric[:3, 3]


def _value(quadric: np.ndarray, points: np.ndarray) -> np.ndarray:
    if not quadric[:3, :3].any():
        return points @ (2 * quadric[:3, 3]) + quadric[3, 3]
    return _dot(_gradient(quadric, points) + quadric[:3, 3], points) + quadric[3, 3]


def _roots(quadric: np.ndarray, rays: Rays, *, graze: bool = False) -> tuple[np.ndarray, ...]:
    """Where rays meet a quadric, as multiples of their directions; with `graze` one that misses counts as a tangent."""
    origins, directions = rays
    c = _value(quadric, origins)
    with np.errstate(divide="ignore", invalid="ignore"):
        if not quadric[:3, :3].any():
            return (-c / (directions @ (2 * quadric[:3, 3])),)
        a = _dot(directions @ quadric[:3, :3], directions)
        b = _dot(directions, _gradient(quadric, origins))
        discriminant = b * b - a * c
        q = -(b + np.copysign(np.sqrt(np.maximum(discriminant, 0) if graze else discriminant), b))
        return q / a, c / q


def hit(face: Face, rays: Rays, limit: np.ndarray | float = np.inf) -> np.ndarray:
    """Where rays meet a face first; infinite where they do not, or not before `limit`."""
    origins, directions = rays
    nearest = np.full(len(directions), np.inf)
    for root in _roots(face.quadric, rays):
        hits = np.flatnonzero((root > 0) & (root < np.minimum(nearest, limit)))
        if face.clips:
            points = origins[hits] + root[hits, None] * directions[hits]
        for clip in face.clips:
            inside = _value(clip, points) <= _ON_FACE
            hits, points = hits[inside], points[inside]
        nearest[hits] = root[hits]
    return nearest


def extended(face: Face, rays: Rays, near: np.ndarray) -> np.ndarray:
    """Where rays meet the unbounded surface of a face: of two places the one closer to `near`."""
    roots = _roots(face.quadric, rays, graze=True)
    if len(roots) == 1:
        return roots[0]
    first, second = roots
    return np.where(np.abs(first - near) <= np.abs(second - near), first, second)


def normals_toward_viewer(face: Face, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Unit normals that face the viewer."""
    normals = _gradient(face.quadric, points)
    normals *= np.where(_dot(normals, directions) > 0, -1.0, 1.0)[:, None]
    with np.errstate(invalid="ignore"):
        return normals / np.linalg.norm(normals, axis=-1)[:, None]


def cast(scene: Sequence[Solid], rays: Rays) -> tuple[np.ndarray, np.ndarray]:
    """Nearest hit of each ray and the number of its face; infinite and -1 where there is none."""
    origins, directions = rays
    nearest = np.full(len(directions), np.inf)
    faces = np.full(len(directions), -1, np.int32)
    # Squared distance of a line of sight from c: |c - o|^2 - ((c - o) d)^2 / |d|^2.
    o_o, o_d, d_d = _dot(origins, origins), _dot(origins, directions), _dot(directions, directions)
    number = 0
    for solid in scene:
        near = slice(None)
        if np.isfinite(solid.radius):
            c = solid.center
            distance = c @ c - 2 * (origins @ c) + o_o - (directions @ c - o_d) ** 2 / d_d
            near = np.flatnonzero(distance <= solid.radius**2 * (1 + _ON_FACE))
        subset, so_far, seen = (origins[near], directions[near]), nearest[near], faces[near]
        for face in solid.faces:
            hits = hit(face, subset, so_far)
            nearer = np.isfinite(hits)
            so_far[nearer], seen[nearer] = hits[nearer], number
            number += 1
        nearest[near], faces[near] = so_far, seen
    return nearest, faces


@_check.public
def plane(point: Vector, normal: Vector) -> Solid:
    """An unbounded plane through a point.

    plane(point, normal) -> solid

    Examples
    --------
    >>> from rangeedge.synthetic import plane
    >>> len(plane((0, 0, 2), (0, 0, -1)).faces)
    1
    """
    point = vector("point", point)
    return Solid((Face(half_space(unit_vector("normal", normal), point), ()),), point, np.inf)


@_check.public
def polyhedron(planes: np.ndarray) -> Solid:
    """A bounded convex polyhedron, the intersection of half spaces.

    polyhedron(planes) -> solid

    Parameters
    ----------
    planes
        (N, 4) rows a, b, c, d: the points with a x + b y + c z <= d.

    Raises
    ------
    error
        The half spaces have no bounded intersection.
    """
    expected = "an (N, 4) array of half spaces with a bounded intersection"
    planes = np.asarray(_check.array("planes", planes, expected), np.float64)
    if planes.shape[1] != 4 or not np.isfinite(planes).all() or not planes[:, :3].any(1).all():
        raise _check.fail("planes", expected, _check.described(planes))
    planes = planes / np.linalg.norm(planes[:, :3], axis=1)[:, None]
    corners = _corners(planes)
    if np.linalg.matrix_rank(corners - corners.mean(0) if len(corners) else corners) < 3 or _unbounded(planes):
        raise _check.fail("planes", expected, "an empty, flat or unbounded one")
    sides = [half_space(p[:3], p[:3] * p[3]) for p in planes]
    faces = tuple(Face(side, tuple(other for other in sides if other is not side)) for side in sides)
    center = (corners.min(0) + corners.max(0)) / 2
    return Solid(faces, center, float(np.linalg.norm(corners - center, axis=1).max()))


def _corners(planes: np.ndarray) -> np.ndarray:
    scale = 1 + np.abs(planes[:, 3]).max()
    corners = []
    for three in combinations(planes, 3):
        three = np.array(three)
        if abs(np.linalg.det(three[:, :3])) > 1e-9:
            corner = np.linalg.solve(three[:, :3], three[:, 3])
            if (planes[:, :3] @ corner <= planes[:, 3] + 1e-9 * scale).all():
                corners.append(corner)
    return np.array(corners).reshape(-1, 3)


def _unbounded(planes: np.ndarray) -> bool:
    """Whether some direction leaves through none of the planes; the extreme ones lie in two planes each."""
    for two in combinations(planes[:, :3], 2):
        direction = np.cross(*two)
        if np.linalg.norm(direction) > 1e-9:
            for way in (direction, -direction):
                if (planes[:, :3] @ way <= 1e-12).all():
                    return True
    return False


@_check.public
def box(center: Vector, size: Vector, rotation: np.ndarray | None = None) -> Solid:
    """A box with sides `size` along the columns of `rotation` (without it, x, y and z).

    box(center, size[, rotation]) -> solid
    """
    center, size = vector("center", center), vector("size", size)
    if (size <= 0).any():
        raise _check.fail("size", "three numbers > 0", _check.described(size))
    axes = np.eye(3) if rotation is None else _rotation(rotation)
    normals = np.vstack([axes.T, -axes.T])
    return polyhedron(np.column_stack([normals, normals @ center + np.tile(size, 2) / 2]))


def _rotation(value: Any) -> np.ndarray:
    expected = "a (3, 3) matrix with orthonormal columns"
    value = np.asarray(_check.array("rotation", value, expected), np.float64)
    if value.shape != (3, 3) or not np.allclose(value @ value.T, np.eye(3), atol=1e-6):
        raise _check.fail("rotation", expected, _check.described(value))
    return value


@_check.public
def sphere(center: Vector, radius: float) -> Solid:
    """A sphere.

    sphere(center, radius) -> solid
    """
    center = vector("center", center)
    radius = _check.number("radius", radius, 0, above=True)
    return Solid((Face(_revolution(center, np.zeros(3), 0.0, radius), ()),), center, radius)


@_check.public
def cylinder(center: Vector, axis: Vector, radius: float, height: float) -> Solid:
    """A closed cylinder: its mantle and two caps.

    cylinder(center, axis, radius, height) -> solid
    """
    center, axis = vector("center", center), unit_vector("axis", axis)
    radius = _check.number("radius", radius, 0, above=True)
    height = _check.number("height", height, 0, above=True)
    mantle = _revolution(center, axis, 1.0, radius)
    caps = [half_space(way, center + way * height / 2) for way in (axis, -axis)]
    faces = (Face(mantle, tuple(caps)), *(Face(cap, (mantle,)) for cap in caps))
    return Solid(faces, center, float(np.hypot(radius, height / 2)))


@_check.public
def cone(apex: Vector, axis: Vector, radius: float, height: float) -> Solid:
    """A closed cone: its mantle and its base, which lies `height` from the apex along `axis` and has `radius`.

    cone(apex, axis, radius, height) -> solid
    """
    apex, axis = vector("apex", apex), unit_vector("axis", axis)
    radius = _check.number("radius", radius, 0, above=True)
    height = _check.number("height", height, 0, above=True)
    mantle = _revolution(apex, axis, 1 + (radius / height) ** 2, 0.0)
    base, tip = half_space(axis, apex + axis * height), half_space(-axis, apex)
    faces = (Face(mantle, (base, tip)), Face(base, (mantle,)))
    return Solid(faces, apex + axis * height / 2, float(np.hypot(radius, height / 2)))


def vector(name: str, value: Any, length: int = 3) -> np.ndarray:
    """A checked argument as float64."""
    try:
        result = _check.reals(value)
    except (TypeError, ValueError, OverflowError):
        result = np.empty(0)
    if result.shape != (length,) or not np.isfinite(result).all():
        raise _check.fail(name, f"{length} finite numbers", _check.described(value))
    return result


def unit_vector(name: str, value: Any) -> np.ndarray:
    """A checked argument, scaled to length 1."""
    result = vector(name, value)
    if not result.any():
        raise _check.fail(name, "a vector other than zero", _check.described(value))
    return result / np.linalg.norm(result)
