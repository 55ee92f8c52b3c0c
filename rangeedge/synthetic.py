"""Ray-cast scenes with exact edge truth, and the noise of range scanners.

A scene is a list of solids, `renderScene` what a camera sees of it, and each noise model turns that into what a scanner
would deliver. Coordinates are those of the camera, x to the right, y down, z away from the viewer, in any one unit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np

from . import _args
from .raycast import (
    TOUCHING,
    Camera,
    Rendering,
    abwCamera,
    grouped,
    kinectCamera,
    orthographicCamera,
    perceptronCamera,
    pinholeCamera,
    renderScene,
)
from .scanners import (
    ABW_CALIBRATIONS,
    PERCEPTRON_MIRROR_TO_MIRROR,
    PERCEPTRON_STANDOFF,
    PERCEPTRON_STEP,
    abwPoints,
    perceptronPoints,
)
from .solids import (
    Face,
    Rays,
    Solid,
    Vector,
    box,
    cast,
    cone,
    cylinder,
    extended,
    half_space,
    plane,
    polyhedron,
    sphere,
    unit_vector,
    vector,
)

__all__ = [
    "Camera",
    "Rendering",
    "Scan",
    "Solid",
    "abwCamera",
    "abwNoise",
    "box",
    "cone",
    "curvedScene",
    "cylinder",
    "demoScene",
    "gaussianNoise",
    "kinectCamera",
    "kinectNoise",
    "orthographicCamera",
    "perceptronCamera",
    "perceptronNoise",
    "pinholeCamera",
    "plane",
    "planePair",
    "polyhedraScene",
    "polyhedron",
    "renderScene",
    "roof",
    "sphere",
    "step",
    "triangulationNoise",
    "twoCylinders",
]

Seed = int | np.random.Generator

# Kinect v1: baseline in metres, disparity step in pixels.
_KINECT_BASELINE, _KINECT_STEP = 0.075, 1 / 8


class Scan(NamedTuple):
    """A noisy range image as a scanner delivers it: ``edgeStrength(scan.src, **scan.geometry)``.

    `raw` holds the scanner's own integers: range of ABW and Perceptron, disparity steps of the Kinect; None elsewhere.
    """

    src: np.ndarray
    geometry: dict[str, Any]
    raw: np.ndarray | None = None


def _checked(func: str, rendering: Any, seed: Any) -> np.random.Generator:
    if not isinstance(rendering, Rendering):
        raise _args.fail(func, "rendering", "a Rendering", _args.described(rendering))
    if not isinstance(seed, np.random.Generator):
        seed = _args.integer(func, "seed", seed, 0)
    return np.random.default_rng(seed)


def _rays(rendering: Rendering) -> Rays:
    return rendering.camera.rays(*rendering.camera.pixels())


def _points(rendering: Rendering, depth: np.ndarray) -> np.ndarray:
    origins, directions = _rays(rendering)
    points = origins + depth.reshape(-1, 1) * directions
    return points.reshape(*depth.shape, 3).astype(np.float32)


def _scan(rendering: Rendering, depth: np.ndarray) -> Scan:
    geometry = dict(rendering.camera.geometry)
    return Scan(depth.astype(np.float32) if geometry else _points(rendering, depth), geometry)


def _shadow(rendering: Rendering, light: np.ndarray) -> np.ndarray:
    """Pixels whose point the light does not reach."""
    seen = np.flatnonzero(np.isfinite(rendering.depth))
    points = rendering.points.reshape(-1, 3)[seen]
    directions = points - light
    reached, _ = cast(rendering.scene, (np.broadcast_to(light, points.shape), directions))
    shadow = np.zeros(rendering.depth.shape, np.bool_)
    shadow.ravel()[seen] = reached < 1 - TOUCHING
    return shadow


def _smooth_noise(rng: np.random.Generator, shape: tuple[int, int], radius: float) -> np.ndarray:
    """Standard normal noise correlated over `radius` pixels (1 sigma of the Gaussian window)."""
    margin = int(np.ceil(4 * radius))
    white = rng.standard_normal((shape[0] + 2 * margin, shape[1] + 2 * margin))
    window = cv2.getGaussianKernel(2 * margin + 1, radius)
    smooth = cv2.sepFilter2D(white, cv2.CV_64F, window, window)[margin:-margin, margin:-margin]
    return smooth / (window**2).sum()


def gaussianNoise(rendering: Rendering, sigma: float | Callable[[np.ndarray], np.ndarray], seed: Seed = 0) -> Scan:
    """White Gaussian noise along the lines of sight.

    gaussianNoise(rendering, sigma[, seed]) -> scan

    Parameters
    ----------
    sigma
        Standard deviation, or a function of depth that returns it, such as a `NoiseModel`.
    seed
        An integer >= 0, or a generator to draw from; the same seed gives the same scan.

    Raises
    ------
    error
        A negative sigma, or an argument of another type.
    """
    rng = _checked("gaussianNoise", rendering, seed)
    deviation = sigma(rendering.depth) if callable(sigma) else _args.number("gaussianNoise", "sigma", sigma, 0)
    if (np.asarray(deviation) < 0).any():
        raise _args.fail("gaussianNoise", "sigma", ">= 0 at every depth", _args.described(sigma))
    return _scan(rendering, rendering.depth + deviation * rng.standard_normal(rendering.depth.shape))


def triangulationNoise(
    rendering: Rendering, sigma: float = 0.05, seed: Seed = 0, *, light: Vector | None = None
) -> Scan:
    """A quiet laser triangulation scanner: little white noise, and no data where the laser casts a shadow.

    triangulationNoise(rendering[, sigma[, seed]], *[, light]) -> scan

    Parameters
    ----------
    sigma
        Standard deviation of the depth in the unit of the scene; 0.03 to 0.08 mm is usual for a table-top scanner.
    light
        Position of the laser; without it, beside the camera at a third of its working distance, to the right.

    See `gaussianNoise` for the rest.
    """
    rng = _checked("triangulationNoise", rendering, seed)
    sigma = _args.number("triangulationNoise", "sigma", sigma, 0)
    light = (rendering.camera.distance / 3, 0.0, 0.0) if light is None else light
    depth = rendering.depth + sigma * rng.standard_normal(rendering.depth.shape)
    depth[_shadow(rendering, vector("triangulationNoise", "light", light))] = np.nan
    return _scan(rendering, depth)


def abwNoise(rendering: Rendering, sigma: float = 0.6, seed: Seed = 0) -> Scan:
    """The ABW structured-light scanner of Hoover et al. (1996): eight bits of range, shadows of the projector.

    abwNoise(rendering[, sigma[, seed]]) -> scan

    The range r is an integer from 1 to 255, the depth r / 0.791686 + 771.016866: one step is 1.263, the width of two
    pixels. `src` is `abwPoints` of `raw`, the 8-bit image; 0 there, NaN in `src`, is no data.

    Parameters
    ----------
    rendering
        By `abwCamera`.
    sigma
        Standard deviation of the depth before it is rounded.

    See `gaussianNoise` for the rest.
    """
    rng = _checked("abwNoise", rendering, seed)
    sigma = _args.number("abwNoise", "sigma", sigma, 0)
    if not np.array_equal(rendering.camera.geometry.get("K", 0), abwCamera().geometry["K"]):
        raise _args.fail("abwNoise", "rendering", "a picture by abwCamera()", "one by another camera")
    offset, scale, _ = ABW_CALIBRATIONS[2]
    depth = rendering.depth + sigma * rng.standard_normal(rendering.depth.shape)
    steps = np.rint((depth - offset) * scale)
    lost = ~((steps >= 1) & (steps <= 255)) | _shadow(rendering, np.array([rendering.camera.distance / 3, 0.0, 0.0]))
    raw = np.where(lost, 0, steps).astype(np.uint8)
    return Scan(abwPoints(raw), {}, raw)


def perceptronNoise(rendering: Rendering, sigma: float = 0.8, seed: Seed = 0) -> Scan:
    """The Perceptron time-of-flight scanner of Hoover et al. (1996): twelve bits of range, noisy, mixed at jumps.

    perceptronNoise(rendering[, sigma[, seed]]) -> scan

    `src` is `perceptronPoints` of `raw`, the 12-bit range in steps of 0.20236: points on an irregular grid. Beside a
    jump the beam meets both surfaces, and the pixel gets a depth in between. No data is 0 in `raw`, NaN in `src`.

    Parameters
    ----------
    rendering
        By `perceptronCamera`.
    sigma
        Standard deviation along the beam.

    See `gaussianNoise` for the rest.
    """
    rng = _checked("perceptronNoise", rendering, seed)
    sigma = _args.number("perceptronNoise", "sigma", sigma, 0)
    if rendering.camera.geometry:
        raise _args.fail("perceptronNoise", "rendering", "a picture by perceptronCamera()", "one by another camera")
    depth = _mixed(rendering, 0.35)
    depth += sigma * rng.standard_normal(depth.shape)
    # The way from the laser to the last mirror counts as well; rays start on that mirror.
    x, y, z = _rays(rendering)[0].T.reshape(3, *depth.shape)
    inside = z - PERCEPTRON_MIRROR_TO_MIRROR + np.hypot(x, PERCEPTRON_MIRROR_TO_MIRROR - y)
    steps = np.rint((depth + inside) / PERCEPTRON_STEP - PERCEPTRON_STANDOFF)
    lost = ~((steps >= 1) & (steps <= 4095))
    raw = np.where(lost, 0, steps).astype(np.uint16)
    points = perceptronPoints(raw)
    points[lost] = np.nan
    return Scan(points, {}, raw)


def _mixed(rendering: Rendering, radius: float) -> np.ndarray:
    """Depths averaged over a beam of `radius` pixels; only beside jumps, where that makes a difference."""
    beside = np.flatnonzero(rendering.jump > 0)
    x, y = (c[beside] for c in rendering.camera.pixels())
    parts = [
        cast(rendering.scene, rendering.camera.rays(x + dx * radius, y + dy * radius))[0]
        for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    depth = rendering.depth.copy()
    depth.ravel()[beside] = np.mean(parts, 0)
    return depth


def kinectNoise(
    rendering: Rendering, sigma: float = 0.0014, seed: Seed = 0, *, jitter: float = 0.8, holes: float = 0.005
) -> Scan:
    """A Kinect v1: noise in inverse depth, correlated between pixels; ragged edges, shadows, holes; whole millimetres.

    kinectNoise(rendering[, sigma[, seed]], *[, jitter[, holes]]) -> scan

    The disparity f b / z (b = 75 mm) is disturbed, rounded to 1/8 pixel and turned back into depth, so that noise and
    resolution grow with z^2 (Khoshelham and Oude Elberink, 2012: 1.4 mm and 2.9 mm at 1 m). `src` is uint16, 0 is no
    data.

    Parameters
    ----------
    rendering
        By `kinectCamera`, or another pinhole camera in metres.
    sigma
        Standard deviation of the inverse depth in 1/m before rounding.
    jitter
        Standard deviation in pixels by which the border between two faces wanders.
    holes
        Share of pixels lost at random, in small blobs.

    See `gaussianNoise` for the rest.
    """
    rng = _checked("kinectNoise", rendering, seed)
    sigma = _args.number("kinectNoise", "sigma", sigma, 0)
    jitter = _args.number("kinectNoise", "jitter", jitter, 0, 10)
    holes = _args.number("kinectNoise", "holes", holes, 0, 1)
    geometry = rendering.camera.geometry
    if "K" not in geometry:
        raise _args.fail("kinectNoise", "rendering", "a picture by a pinhole camera", "one by another camera")
    depth = _jittered(rendering, rng, jitter)
    shape = depth.shape
    per_step = geometry["K"][0, 0] * _KINECT_BASELINE / _KINECT_STEP
    disparity = per_step * (1 / depth + sigma * _smooth_noise(rng, shape, 1.0))
    disparity[_shadow(rendering, np.array([_KINECT_BASELINE, 0.0, 0.0]))] = np.nan
    blobs = _smooth_noise(rng, shape, 1.5)
    disparity[blobs > np.quantile(blobs, 1 - holes)] = np.nan
    steps = np.rint(disparity)
    with np.errstate(divide="ignore"):
        millimetres = np.rint(1000 * per_step / steps)
    raw = np.where((steps > 0) & (millimetres <= 65535), steps, 0).astype(np.uint16)
    return Scan(np.where(raw > 0, millimetres, 0).astype(np.uint16), dict(geometry), raw)


def _jittered(rendering: Rendering, rng: np.random.Generator, jitter: float) -> np.ndarray:
    """Depths where each pixel sees the face of a pixel nearby, extended to its own line of sight."""
    height, width = shape = rendering.depth.shape
    offset = [np.rint(jitter * _smooth_noise(rng, shape, 1.0)).astype(int) for _ in range(2)]
    row, col = np.indices(shape)
    source = (np.clip(row + offset[0], 0, height - 1), np.clip(col + offset[1], 0, width - 1))
    faces, near = rendering.faces[source], rendering.depth[source]
    depth = np.where(faces == rendering.faces, rendering.depth, near)
    origins, directions = _rays(rendering)
    every = [face for solid in rendering.scene for face in solid.faces]
    for face, here in grouped(every, np.where(faces == rendering.faces, -1, faces).ravel()):
        depth.ravel()[here] = extended(face, (origins[here], directions[here]), near.ravel()[here])
    return depth


def planePair(first: Vector, second: Vector, point: Vector = (0.0, 0.0, 1.0), convex: bool = True) -> list[Solid]:
    """Two half planes that meet in a line through a point: a wedge (convex) or a valley (concave).

    planePair(first, second[, point[, convex]]) -> scene

    The crease is the angle between the normals `first` and `second`, which face the viewer.

    Raises
    ------
    error
        The normals are parallel, or one of them faces away from the viewer.
    """
    first, second = unit_vector("planePair", "first", first), unit_vector("planePair", "second", second)
    point = vector("planePair", "point", point)
    if np.linalg.norm(np.cross(first, second)) < 1e-9:
        raise _args.fail("planePair", "second", "not parallel to `first`", _args.described(second))
    for name, normal in (("first", first), ("second", second)):
        if normal[2] >= 0:
            raise _args.fail("planePair", name, "a normal with z < 0, toward the viewer", _args.described(normal))
    side = 1.0 if _args.boolean("planePair", "convex", convex) else -1.0
    pair = ((first, second), (second, first))
    return [
        Solid((Face(half_space(n, point), (half_space(side * other, point),)),), point, np.inf) for n, other in pair
    ]


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
    half = np.radians(_args.number("roof", "angle", angle, 0, 180, above=True)) / 2
    turn = np.radians(_args.number("roof", "slant", slant, -90, 90))
    distance = _args.number("roof", "distance", distance, 0, above=True)
    convex = _args.boolean("roof", "convex", convex)
    if half + abs(turn) >= np.pi / 2:
        raise _args.fail("roof", "slant", "small enough to keep both planes in view", _args.described(slant))
    across = _across("roof", orientation)
    normals = [np.sin(a) * across - np.cos(a) * np.array([0, 0, 1.0]) for a in (turn - half, turn + half)]
    return planePair(*normals, (0.0, 0.0, distance), convex)


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
    height = _args.number("step", "height", height, 0, above=True)
    turn = np.radians(_args.number("step", "slant", slant, -89, 89))
    distance = _args.number("step", "distance", distance, 0, above=True)
    across, axis = _across("step", orientation), np.array([0.0, 0.0, 1.0])
    normal = np.sin(turn) * across - np.cos(turn) * axis
    scene = []
    for side, depth in ((1, distance), (-1, distance + height)):
        border = half_space(side * across, np.zeros(3))
        scene.append(Solid((Face(half_space(normal, depth * axis), (border,)),), depth * axis, np.inf))
    return scene


def _across(func: str, orientation: Any) -> np.ndarray:
    turn = np.radians(_args.number(func, "orientation", orientation))
    return np.array([np.cos(turn), np.sin(turn), 0.0])


def twoCylinders(angle: float = 36.3, radius: float = 0.1, distance: float = 1.0) -> list[Solid]:
    """Two parallel upright cylinders that meet in a concave crease of `angle` degrees (P§4.1, Fig. 3 and Table 2).

    twoCylinders([angle[, radius[, distance]]]) -> scene

    The crease lies on the optical axis at `distance`.
    """
    half = np.radians(_args.number("twoCylinders", "angle", angle, 0, 180, above=True)) / 2
    radius = _args.number("twoCylinders", "radius", radius, 0, above=True)
    distance = _args.number("twoCylinders", "distance", distance, 0, above=True)
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


def _places(func: str, seed: Seed, camera: Camera) -> tuple[np.random.Generator, _Table, float, list]:
    """A table before the camera, and six places on it with the room that each has."""
    if not isinstance(camera, Camera):
        raise _args.fail(func, "camera", "a Camera", _args.described(camera))
    rng = seed if isinstance(seed, np.random.Generator) else np.random.default_rng(_args.integer(func, "seed", seed, 0))
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
    rng, table, room, places = _places("polyhedraScene", seed, camera)
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


def curvedScene(seed: Seed, camera: Camera) -> list[Solid]:
    """Six solids on a table that fill the view of a camera: spheres, cylinders, cones, a cylinder on a box.

    curvedScene(seed, camera) -> scene
    """
    rng, table, room, places = _places("curvedScene", seed, camera)
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
