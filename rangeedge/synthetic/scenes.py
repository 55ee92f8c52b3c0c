"""Ready-made scenes: pairs of planes, steps, roofs, and solids on a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _check
from .cameras import Camera
from .scans import Seed
from .solids import Face, Solid, Vector, box, cone, cylinder, half_space, plane, polyhedron, sphere, unit_vector, vector


@_check.public
def planePair(first: Vector, second: Vector, point: Vector = (0.0, 0.0, 1.0), convex: bool = True) -> list[Solid]:
    """Two half planes that meet in a line through a point: a wedge (convex) or a valley (concave).

    planePair(first, second[, point[, convex]]) -> scene

    The crease is the angle between the normals `first` and `second`, which face the viewer.

    Raises
    ------
    error
        The normals are parallel, or one of them faces away from the viewer.
    """
    first, second = unit_vector("first", first), unit_vector("second", second)
    point = vector("point", point)
    if np.linalg.norm(np.cross(first, second)) < 1e-9:
        raise _check.fail("second", "not parallel to `first`", _check.described(second))
    for name, normal in (("first", first), ("second", second)):
        if normal[2] >= 0:
            raise _check.fail(name, "a normal with z < 0, toward the viewer", _check.described(normal))
    side = 1.0 if _check.boolean("convex", convex) else -1.0
    pair = ((first, second), (second, first))
    return [
        Solid((Face(half_space(n, point), (half_space(side * other, point),)),), point, np.inf) for n, other in pair
    ]


@_check.public
def roof(
    angle: float, orientation: float = 0.0, slant: float = 0.0, convex: bool = True, distance: float = 1.0
) -> list[Solid]:
    """Two half planes that meet on the optical axis under a crease of `angle` degrees.

    roof(angle[, orientation[, slant[, convex[, distance]]]]) -> scene

    Parameters
    ----------
    angle
        Between both normals: 0 < angle < 180.
    orientation
        Of the crease line in the image, in degrees from the vertical, clockwise.
    slant
        By which the normals are turned together across the crease: at 0 both planes fall off alike.

    Examples
    --------
    >>> from rangeedge.synthetic import kinectCamera, renderScene, roof
    >>> rendering = renderScene(roof(40.0, convex=False), kinectCamera())
    >>> round(float(rendering.crease.max()), 4), int(rendering.kind[240, 320])
    (40.0, 4)
    """
    half = np.radians(_check.number("angle", angle, 0, 180, above=True)) / 2
    turn = np.radians(_check.number("slant", slant, -90, 90))
    distance = _check.number("distance", distance, 0, above=True)
    convex = _check.boolean("convex", convex)
    if half + abs(turn) >= np.pi / 2:
        raise _check.fail("slant", "small enough to keep both planes in view", _check.described(slant))
    across = _across(orientation)
    normals = [np.sin(a) * across - np.cos(a) * np.array([0, 0, 1.0]) for a in (turn - half, turn + half)]
    return planePair(*normals, (0.0, 0.0, distance), convex)


@_check.public
def step(height: float, orientation: float = 0.0, slant: float = 0.0, distance: float = 1.0) -> list[Solid]:
    """Two parallel half planes, the one on the right `height` farther away; their border lies on the optical axis.

    step(height[, orientation[, slant[, distance]]]) -> scene

    Parameters
    ----------
    height
        Difference of depth on the optical axis; without slant, along the whole border.
    orientation
        Of the border in the image, in degrees from the vertical, clockwise.
    slant
        Angle in degrees between the optical axis and the normals, turned across the border.
    """
    height = _check.number("height", height, 0, above=True)
    turn = np.radians(_check.number("slant", slant, -89, 89))
    distance = _check.number("distance", distance, 0, above=True)
    across, axis = _across(orientation), np.array([0.0, 0.0, 1.0])
    normal = np.sin(turn) * across - np.cos(turn) * axis
    scene = []
    for side, depth in ((1, distance), (-1, distance + height)):
        border = half_space(side * across, np.zeros(3))
        scene.append(Solid((Face(half_space(normal, depth * axis), (border,)),), depth * axis, np.inf))
    return scene


def _across(orientation: Any) -> np.ndarray:
    turn = np.radians(_check.number("orientation", orientation))
    return np.array([np.cos(turn), np.sin(turn), 0.0])


@_check.public
def twoCylinders(angle: float = 36.3, radius: float = 0.1, distance: float = 1.0) -> list[Solid]:
    """Two parallel upright cylinders that meet in a concave crease of `angle` degrees (paper, 4.1, Fig. 3 and Table 2).

    twoCylinders([angle[, radius[, distance]]]) -> scene

    The crease lies on the optical axis at `distance`.
    """
    half = np.radians(_check.number("angle", angle, 0, 180, above=True)) / 2
    radius = _check.number("radius", radius, 0, above=True)
    distance = _check.number("distance", distance, 0, above=True)
    offset, depth = radius * np.sin(half), distance + radius * np.cos(half)
    return [cylinder((side * offset, 0.0, depth), (0, 1, 0), radius, 100 * distance) for side in (-1, 1)]


@dataclass(frozen=True)
class _Table:
    """A plane seen from above under `tilt`; a place on it is (right, up, ahead) from its point on the optical axis."""

    distance: float
    tilt: float

    @property
    def axes(self) -> np.ndarray:
        """Columns: right, up, ahead."""
        sin, cos = np.sin(np.radians(self.tilt)), np.cos(np.radians(self.tilt))
        return np.array([[1, 0, 0], [0, -cos, -sin], [0, -sin, cos]]).T

    def at(self, *place: float) -> np.ndarray:
        return np.array([0, 0, self.distance]) + self.axes @ np.array(place)

    def turned(self, angle: float) -> np.ndarray:
        """Right, up and ahead, turned about up by `angle` degrees."""
        sin, cos = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        return self.axes @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])

    def top(self) -> Solid:
        return plane(self.at(0, 0, 0), self.axes[:, 1])

    def prism(
        self, place: Sequence[float], angle: float, sides: int, bottom: float, top: float, height: float
    ) -> Solid:
        """A straight prism, frustum or pyramid over a regular polygon with inner radii `bottom` and `top`."""
        turns = 2 * np.pi * np.arange(sides) / sides
        normals = np.column_stack(
            [
                np.cos(turns) * height,
                np.full(sides, bottom - top),
                np.sin(turns) * height,
                np.full(sides, bottom * height),
            ]
        )
        return self.stand(np.vstack([normals, [(0, 1, 0, height), (0, -1, 0, 0)]]), place, angle)

    def wedge(self, place: Sequence[float], angle: float, width: float, length: float, height: float) -> Solid:
        """A gable roof on the table."""
        slopes = [(side * height, width / 2, 0, width / 2 * height) for side in (-1, 1)]
        gables = [(0, 0, side, length / 2) for side in (-1, 1)]
        return self.stand(np.array([*slopes, *gables, (0, -1, 0, 0)]), place, angle)

    def block(self, place: Sequence[float], angle: float, width: float, height: float, length: float) -> Solid:
        right, up, ahead = place
        return box(self.at(right, up + height / 2, ahead), (width, height, length), self.turned(angle))

    def stand(self, planes: np.ndarray, place: Sequence[float], angle: float) -> Solid:
        normals = planes[:, :3] @ self.turned(angle).T
        return polyhedron(np.column_stack([normals, planes[:, 3] + normals @ self.at(*place)]))


def _places(seed: Seed, camera: Camera) -> tuple[np.random.Generator, _Table, float, list]:
    """A table before the camera, and six places on it with the room that each has."""
    if not isinstance(camera, Camera):
        raise _check.fail("camera", "a Camera", _check.described(camera))
    rng = seed if isinstance(seed, np.random.Generator) else np.random.default_rng(_check.integer("seed", seed, 0))
    table = _Table(camera.distance, rng.uniform(45, 60))
    width, height = camera.view()
    ahead = height / np.sin(np.radians(table.tilt))
    room = min(0.29 * width, 0.44 * ahead)
    places = [
        (x * width + rng.uniform(-0.1, 0.1) * room, 0.0, z * ahead + rng.uniform(-0.1, 0.1) * room)
        for z in (-0.18, 0.22)
        for x in (-0.29, 0, 0.29)
    ]
    return rng, table, room, places


@_check.public
def polyhedraScene(seed: Seed, camera: Camera) -> list[Solid]:
    """Six polyhedra on a table that fill the view of a camera: boxes, stacks, wedges, pyramids, prisms.

    polyhedraScene(seed, camera) -> scene

    Examples
    --------
    >>> from rangeedge.synthetic import abwCamera, abwNoise, polyhedraScene, renderScene
    >>> camera = abwCamera()
    >>> abwNoise(renderScene(polyhedraScene(1, camera), camera)).raw.shape
    (512, 512)
    """
    rng, table, room, places = _places(seed, camera)
    scene = [table.top()]
    for place, kind in zip(places, rng.permutation(6), strict=True):
        size, angle = room * rng.uniform(0.75, 0.95, 3), rng.uniform(0, 90)
        if kind == 0:
            scene.append(table.block(place, angle, size[0] * 0.7, size[1] * 0.5, size[2] * 0.7))
        elif kind == 1:
            scene.append(table.block(place, angle, size[0] * 0.8, size[1] * 0.25, size[2] * 0.8))
            above = (place[0], size[1] * 0.25, place[2])
            scene.append(table.block(above, angle + rng.uniform(20, 70), size[0] * 0.4, size[1] * 0.3, size[2] * 0.4))
        elif kind == 2:
            scene.append(table.wedge(place, angle, size[0] * 0.8, size[1] * 0.8, size[2] * 0.45))
        elif kind == 3:
            scene.append(table.prism(place, angle, 4, size[0] * 0.4, size[0] * 0.2, size[1] * 0.4))
        elif kind == 4:
            scene.append(table.prism(place, angle, 6, size[0] * 0.4, size[0] * 0.4, size[1] * 0.35))
        else:
            scene.append(table.prism(place, angle, 3, size[0] * 0.28, size[0] * 0.28, size[1] * 0.5))
    return scene


@_check.public
def curvedScene(seed: Seed, camera: Camera) -> list[Solid]:
    """Six solids on a table that fill the view of a camera: spheres, cylinders, cones, a cylinder on a box.

    curvedScene(seed, camera) -> scene
    """
    rng, table, room, places = _places(seed, camera)
    up = table.axes[:, 1]
    scene = [table.top()]
    for place, kind in zip(places, rng.permutation(6), strict=True):
        radius, height, angle = room * rng.uniform(0.3, 0.4), room * rng.uniform(0.4, 0.5), rng.uniform(0, 360)
        x, _, z = place
        if kind == 0:
            scene.append(sphere(table.at(x, rng.uniform(0.2, 0.8) * radius, z), radius))
        elif kind == 1:
            scene.append(cylinder(table.at(x, height / 2, z), up, radius, height))
        elif kind == 2:
            lying = table.turned(angle)[:, 0]
            scene.append(cylinder(table.at(x, 0.3 * radius, z), lying, radius * 0.8, room * 0.75))
        elif kind == 3:
            scene.append(cone(table.at(x, 1.4 * height, z), -up, radius, 1.4 * height))
        elif kind == 4:
            scene.append(table.block(place, angle, 2 * radius, 0.5 * height, 2 * radius))
            scene.append(cylinder(table.at(x, height * 0.75, z), up, radius * 0.6, height * 0.5))
        else:
            lying = table.turned(angle)
            for side in (-0.5, 0.5):
                center = table.at(x, 0, z) + lying[:, 2] * side * radius
                scene.append(cylinder(center, lying[:, 0], radius * 0.6, room * 0.7))
    return scene


@_check.public
def demoScene() -> list[Solid]:
    """Boxes, a sphere, a cylinder, a cone and a roof on a table before a wall, in metres: for `kinectCamera`.

    demoScene() -> scene
    """
    table = _Table(1.3, 32.0)
    right, up, ahead = table.axes.T
    return [
        plane(table.at(0, -0.6, 0), up),
        plane(table.at(0, 0, 0.85), -ahead + 0.15 * right),
        table.block((0, -0.04, 0.05), 0, 1.3, 0.04, 0.95),
        table.block((-0.36, 0, 0.22), 25, 0.26, 0.26, 0.2),
        table.block((-0.34, 0.26, 0.22), 50, 0.12, 0.1, 0.12),
        table.block((0.06, 0, -0.24), -20, 0.24, 0.07, 0.15),
        table.wedge((0.02, 0, 0.32), 70, 0.22, 0.26, 0.16),
        sphere(table.at(-0.22, 0.085, -0.17), 0.09),
        cylinder(table.at(0.4, 0.15, 0.2), up, 0.085, 0.3),
        cylinder(table.at(0.4, 0.045, -0.2), right + 0.6 * ahead, 0.06, 0.24),
        cone(table.at(0.2, 0.2, 0.02), -up, 0.08, 0.2),
        table.prism((-0.44, 0, -0.22), 20, 6, 0.08, 0.05, 0.1),
    ]
