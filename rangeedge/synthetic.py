"""Ray-cast scenes with exact edge truth, and the noise of range scanners.

A scene is a list of solids. Every surface is a quadric, planes included, cut off by other quadrics; so one ray caster serves
all, and the truth between two pixels comes from the surfaces themselves, not from differences of samples.

Coordinates are those of the camera: x to the right, y down, z away from the viewer, in any one unit of length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import cv2
import numpy as np

from . import _args
from ._constants import (
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

Vector = Sequence[float] | np.ndarray
Seed = int | np.random.Generator
Rays = tuple[np.ndarray, np.ndarray]  # origins and directions, (N, 3) each

_STEPS = {DIR_ROWS: (1, 0), DIR_COLS: (0, 1), DIR_DIAG45: (1, -1), DIR_DIAG135: (1, 1)}  # (dx, dy) to the next pixel
_BISECTIONS = 24  # an edge is located within 2**-24 pixels
_TOUCHING = 1e-6  # surfaces closer than this share of their depth meet in a crease
_ON_FACE = 1e-9  # so far a point may lie outside a face and still belong to it: no cracks between faces

# ABW structured-light scanner, calibration 2 of the segmentation comparison by Hoover et al.: depth = r / scale + offset.
_ABW_OFFSET, _ABW_SCALE, _ABW_FOCAL, _ABW_ASPECT = 771.016866, 0.791686, 1586.072821, 1.4508
# Perceptron time-of-flight scanner, from the same source: mirror distances h1 and h2, angles, zero range and range step.
_PERCEPTRON_H1, _PERCEPTRON_H2, _PERCEPTRON_GAMMA = 3.0, 5.5, np.radians(45.0)
_PERCEPTRON_FIELD = np.radians((51.65, 36.73))
_PERCEPTRON_ZERO, _PERCEPTRON_STEP = 830.3, 0.20236
# Kinect v1: baseline in metres, disparity step in pixels.
_KINECT_BASELINE, _KINECT_STEP = 0.075, 1 / 8


# Surfaces: p is on the quadric Q where (p, 1)' Q (p, 1) = 0, and inside where that is negative.


class _Face(NamedTuple):
    quadric: np.ndarray
    clips: tuple[np.ndarray, ...]  # the face is the part of the surface inside all of these


class Solid(NamedTuple):
    """A body bounded by faces, and a sphere around it (radius infinite where it has no bounds)."""

    faces: tuple[_Face, ...]
    center: np.ndarray
    radius: float


def _half_space(normal: np.ndarray, point: np.ndarray) -> np.ndarray:
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


def _gradient(quadric: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ quadric[:3, :3] + quadric[:3, 3]


def _value(quadric: np.ndarray, points: np.ndarray) -> np.ndarray:
    if not quadric[:3, :3].any():
        return points @ (2 * quadric[:3, 3]) + quadric[3, 3]
    return ((_gradient(quadric, points) + quadric[:3, 3]) * points).sum(-1) + quadric[3, 3]


def _roots(quadric: np.ndarray, rays: Rays, *, graze: bool = False) -> tuple[np.ndarray, ...]:
    """Where rays meet a quadric, as multiples of their directions; with `graze` a ray that misses counts as a tangent."""
    origins, directions = rays
    c = _value(quadric, origins)
    with np.errstate(divide="ignore", invalid="ignore"):
        if not quadric[:3, :3].any():
            return (-c / (directions @ (2 * quadric[:3, 3])),)
        a = ((directions @ quadric[:3, :3]) * directions).sum(-1)
        b = (directions * _gradient(quadric, origins)).sum(-1)
        discriminant = b * b - a * c
        q = -(b + np.copysign(np.sqrt(np.maximum(discriminant, 0) if graze else discriminant), b))
        return q / a, c / q


def _hit(face: _Face, rays: Rays) -> np.ndarray:
    """Where rays meet a face first; infinite where they do not."""
    origins, directions = rays
    nearest = np.full(len(directions), np.inf)
    for root in _roots(face.quadric, rays):
        hits = np.flatnonzero((root > 0) & (root < nearest))
        points = origins[hits] + root[hits, None] * directions[hits]
        for clip in face.clips:
            inside = _value(clip, points) <= _ON_FACE
            hits, points = hits[inside], points[inside]
        nearest[hits] = root[hits]
    return nearest


def _extended(face: _Face, rays: Rays, near: np.ndarray) -> np.ndarray:
    """Where rays meet the unbounded surface of a face: of two places the one closer to `near`."""
    roots = _roots(face.quadric, rays, graze=True)
    if len(roots) == 1:
        return roots[0]
    first, second = roots
    return np.where(np.abs(first - near) <= np.abs(second - near), first, second)


def _normals(face: _Face, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Unit normals that face the viewer."""
    normals = _gradient(face.quadric, points)
    normals *= np.where((normals * directions).sum(-1) > 0, -1.0, 1.0)[:, None]
    with np.errstate(invalid="ignore"):
        return normals / np.linalg.norm(normals, axis=-1)[:, None]


def _cast(scene: Sequence[Solid], rays: Rays) -> tuple[np.ndarray, np.ndarray]:
    """Nearest hit of each ray and the number of its face; infinite and -1 where there is none."""
    origins, directions = rays
    nearest = np.full(len(directions), np.inf)
    faces = np.full(len(directions), -1, np.int32)
    lengths = (directions**2).sum(-1)
    number = 0
    for solid in scene:
        candidates = np.arange(len(directions))
        if np.isfinite(solid.radius):
            to_center = solid.center - origins
            along = (to_center * directions).sum(-1)
            distance = (to_center**2).sum(-1) - along**2 / lengths
            candidates = np.flatnonzero(distance <= solid.radius**2 * (1 + _ON_FACE))
        subset = origins[candidates], directions[candidates]
        for face in solid.faces:
            hits = _hit(face, subset)
            nearer = hits < nearest[candidates]
            nearest[candidates[nearer]] = hits[nearer]
            faces[candidates[nearer]] = number
            number += 1
    return nearest, faces


# Solids.


def _vector(func: str, name: str, value: Any, length: int = 3) -> np.ndarray:
    try:
        vector = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (length,) or not np.isfinite(vector).all():
        raise _args.fail(func, name, f"{length} finite numbers", _args.described(value))
    return vector


def _unit(func: str, name: str, value: Any) -> np.ndarray:
    vector = _vector(func, name, value)
    if not vector.any():
        raise _args.fail(func, name, "a vector other than zero", _args.described(value))
    return vector / np.linalg.norm(vector)


def plane(point: Vector, normal: Vector) -> Solid:
    """An unbounded plane through a point.

    plane(point, normal) -> solid

    Examples
    --------
    >>> from rangeedge.synthetic import plane
    >>> len(plane((0, 0, 2), (0, 0, -1)).faces)
    1
    """
    point = _vector("plane", "point", point)
    return Solid((_Face(_half_space(_unit("plane", "normal", normal), point), ()),), point, np.inf)


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
    planes = np.asarray(_args.array("polyhedron", "planes", planes, expected), np.float64)
    if planes.shape[1] != 4 or not np.isfinite(planes).all() or not planes[:, :3].any(1).all():
        raise _args.fail("polyhedron", "planes", expected, _args.described(planes))
    planes = planes / np.linalg.norm(planes[:, :3], axis=1)[:, None]
    corners = _corners(planes)
    if np.linalg.matrix_rank(corners - corners.mean(0) if len(corners) else corners) < 3 or _unbounded(planes):
        raise _args.fail("polyhedron", "planes", expected, "an empty, flat or unbounded one")
    sides = [_half_space(p[:3], p[:3] * p[3]) for p in planes]
    faces = tuple(_Face(side, tuple(other for other in sides if other is not side)) for side in sides)
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


def box(center: Vector, size: Vector, rotation: np.ndarray | None = None) -> Solid:
    """A box with sides `size` along the columns of `rotation` (without it, x, y and z).

    box(center, size[, rotation]) -> solid
    """
    center, size = _vector("box", "center", center), _vector("box", "size", size)
    if (size <= 0).any():
        raise _args.fail("box", "size", "three numbers > 0", _args.described(size))
    axes = np.eye(3) if rotation is None else _rotation("box", rotation)
    normals = np.vstack([axes.T, -axes.T])
    return polyhedron(np.column_stack([normals, normals @ center + np.tile(size, 2) / 2]))


def _rotation(func: str, value: Any) -> np.ndarray:
    expected = "a (3, 3) matrix with orthonormal columns"
    value = np.asarray(_args.array(func, "rotation", value, expected), np.float64)
    if value.shape != (3, 3) or not np.allclose(value @ value.T, np.eye(3), atol=1e-6):
        raise _args.fail(func, "rotation", expected, _args.described(value))
    return value


def sphere(center: Vector, radius: float) -> Solid:
    """A sphere.

    sphere(center, radius) -> solid
    """
    center = _vector("sphere", "center", center)
    radius = _args.number("sphere", "radius", radius, 0, above=True)
    return Solid((_Face(_revolution(center, np.zeros(3), 0.0, radius), ()),), center, radius)


def cylinder(center: Vector, axis: Vector, radius: float, height: float) -> Solid:
    """A closed cylinder: its mantle and two caps.

    cylinder(center, axis, radius, height) -> solid
    """
    center, axis = _vector("cylinder", "center", center), _unit("cylinder", "axis", axis)
    radius = _args.number("cylinder", "radius", radius, 0, above=True)
    height = _args.number("cylinder", "height", height, 0, above=True)
    mantle = _revolution(center, axis, 1.0, radius)
    caps = [_half_space(way, center + way * height / 2) for way in (axis, -axis)]
    faces = (_Face(mantle, tuple(caps)), *(_Face(cap, (mantle,)) for cap in caps))
    return Solid(faces, center, float(np.hypot(radius, height / 2)))


def cone(apex: Vector, axis: Vector, radius: float, height: float) -> Solid:
    """A closed cone: its mantle and its base, which lies `height` from the apex along `axis` and has `radius`.

    cone(apex, axis, radius, height) -> solid
    """
    apex, axis = _vector("cone", "apex", apex), _unit("cone", "axis", axis)
    radius = _args.number("cone", "radius", radius, 0, above=True)
    height = _args.number("cone", "height", height, 0, above=True)
    mantle = _revolution(apex, axis, 1 + (radius / height) ** 2, 0.0)
    base, tip = _half_space(axis, apex + axis * height), _half_space(-axis, apex)
    faces = (_Face(mantle, (base, tip)), _Face(base, (mantle,)))
    return Solid(faces, apex + axis * height / 2, float(np.hypot(radius, height / 2)))


# Cameras.


@dataclass(frozen=True)
class Camera:
    """Where the pixels of a range image look.

    Attributes
    ----------
    size
        (width, height) of the image.
    rays
        Function of pixel coordinates x, y (fractions allowed), each of shape (N,), that returns origins and directions of
        the lines of sight, (N, 3) each. The depth of a point is its multiple of the direction: z for the pinhole and the
        orthographic camera, the distance along the ray for the angular scanner.
    geometry
        The arguments `edgeStrength` needs beside the depths; empty where it needs points.
    distance
        Depth at which the ready-made scenes stand.
    """

    size: tuple[int, int]
    rays: Callable[[np.ndarray, np.ndarray], Rays]
    geometry: dict[str, Any]
    distance: float

    def pixels(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x and y of all pixels, row by row."""
        width, height = self.size
        y, x = np.divmod(np.arange(width * height), width)
        return x.astype(np.float64), y.astype(np.float64)

    def view(self) -> tuple[float, float]:
        """Width and height of what the camera sees at its working distance."""
        width, height = self.size
        origins, directions = self.rays(np.array([0.0, width - 1.0]), np.array([0.0, height - 1.0]))
        points = origins + ((self.distance - origins[:, 2]) / directions[:, 2])[:, None] * directions
        return tuple(np.abs(points[1] - points[0])[:2].tolist())


def _size(func: str, size: Any) -> tuple[int, int]:
    if not isinstance(size, Sequence) or len(size) != 2:
        raise _args.fail(func, "size", "(width, height)", _args.described(size))
    return _args.integer(func, "size[0]", size[0], 2), _args.integer(func, "size[1]", size[1], 2)


def pinholeCamera(K: np.ndarray, size: tuple[int, int], distance: float = 1.0) -> Camera:
    """A camera whose rays meet in one point.

    pinholeCamera(K, size[, distance]) -> camera

    Parameters
    ----------
    K
        (3, 3) intrinsic matrix without skew.
    size
        (width, height) of the image.
    distance
        Depth at which the ready-made scenes stand.
    """
    size = _size("pinholeCamera", size)
    distance = _args.number("pinholeCamera", "distance", distance, 0, above=True)
    expected = "an intrinsic matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"
    K = np.array(_args.array("pinholeCamera", "K", K, expected), np.float64)
    if K.shape != (3, 3) or not np.isfinite(K).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
        raise _args.fail("pinholeCamera", "K", expected, _args.described(K))
    if K[0, 1] or K[1, 0] or (K[2] != (0, 0, 1)).any():
        raise _args.fail("pinholeCamera", "K", expected, _args.described(K.tolist()))

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        directions = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(x)], -1)
        return np.zeros_like(directions), directions

    return Camera(size, rays, {"K": K}, distance)


def orthographicCamera(pixelSize: tuple[float, float], size: tuple[int, int], distance: float | None = None) -> Camera:
    """A camera whose rays are parallel to z and form a regular grid around the z axis.

    orthographicCamera(pixelSize, size[, distance]) -> camera

    Parameters
    ----------
    pixelSize
        (dx, dy) in the unit of the scene.
    size
        (width, height) of the image.
    distance
        Depth at which the ready-made scenes stand; without it, twice the width of the view.
    """
    size = _size("orthographicCamera", size)
    pitch = _vector("orthographicCamera", "pixelSize", pixelSize, 2)
    if (pitch <= 0).any():
        raise _args.fail("orthographicCamera", "pixelSize", "two numbers > 0", _args.described(pixelSize))
    distance = 2 * size[0] * pitch[0] if distance is None else distance
    distance = _args.number("orthographicCamera", "distance", float(distance), 0, above=True)

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        zero = np.zeros_like(x)
        origins = np.stack([(x - (size[0] - 1) / 2) * pitch[0], (y - (size[1] - 1) / 2) * pitch[1], zero], -1)
        return origins, np.broadcast_to((0.0, 0.0, 1.0), origins.shape)

    return Camera(size, rays, {"pixelSize": (float(pitch[0]), float(pitch[1]))}, distance)


def kinectCamera() -> Camera:
    """The depth camera of a Kinect v1: 640x480, f = 525 pixels, in metres.

    kinectCamera() -> camera
    """
    return pinholeCamera(np.array([[525.0, 0, 319.5], [0, 525.0, 239.5], [0, 0, 1]]), (640, 480), 1.2)


def abwCamera() -> Camera:
    """The ABW structured-light scanner of Hoover et al. (1996), 512x512, second calibration, in millimetres.

    abwCamera() -> camera

    It sees depths from 772 to 1093; its pixels are 0.6 by 0.4 wide there.
    """
    K = np.array([[_ABW_FOCAL, 0, 255.0], [0, _ABW_ASPECT * _ABW_FOCAL, 255.0], [0, 0, 1]])
    return pinholeCamera(K, (512, 512), 930.0)


def perceptronCamera() -> Camera:
    """The Perceptron time-of-flight scanner of Hoover et al. (1996), 512x512, in its own unit (about 1 cm).

    perceptronCamera() -> camera

    Two mirrors turn the beam in equal angles, so the points form no regular grid and the rays do not meet in one point.
    """

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        alpha, beta = _PERCEPTRON_FIELD[0] * (255.5 - x) / 512, _PERCEPTRON_FIELD[1] * (255.5 - y) / 512
        dz = -_PERCEPTRON_H1 * (1 - np.cos(alpha)) / np.tan(_PERCEPTRON_GAMMA)
        dy = dz * np.tan(_PERCEPTRON_GAMMA + beta / 2)
        dx = (_PERCEPTRON_H2 + dy) * np.tan(alpha)
        # The scanner's x points to the left and its y up.
        directions = np.stack([-np.sin(alpha), -np.cos(alpha) * np.sin(beta), np.cos(alpha) * np.cos(beta)], -1)
        return np.stack([-dx, -dy, dz], -1), directions

    return Camera((512, 512), rays, {}, 450.0)


# Rendering.


@dataclass(frozen=True)
class Rendering:
    """A noise-free range image and everything that is true about it.

    Attributes
    ----------
    depth
        (H, W) float64, along the lines of sight (see `Camera`); NaN where nothing is seen.
    points, normals
        (H, W, 3) float64; the normals are unit vectors toward the viewer. NaN where nothing is seen.
    labels
        (H, W) int32: the connected parts of visible faces, 1..n; 0 where nothing is seen.
    crossings
        Structured array of every place where a scan line (row, column, diagonal) passes from one face to another between two
        neighbouring pixels `first` and `second` (indices of the flattened image): its position `x`, `y` in pixels, exact to
        1e-6; the `jump` there, the difference of both depths along the line of sight, 0 where the faces meet; the `crease`,
        the angle between both normals in degrees; whether it is `convex`; whether `first` is `nearer`; the `direction`.
    jump, crease
        (H, W) float32: the largest jump, and the largest crease between faces that meet (P§2), at either side of a crossing.
    kind
        (H, W) uint8: bits EDGE_*, as `edgeStrength` returns them; convex or concave is that of the largest crease.
    """

    scene: tuple[Solid, ...]
    camera: Camera
    depth: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    labels: np.ndarray
    crossings: np.ndarray

    @cached_property
    def jump(self) -> np.ndarray:
        return self._largest("jump", self.crossings["jump"] > 0)

    @cached_property
    def crease(self) -> np.ndarray:
        return self._largest("crease", self.crossings["jump"] == 0)

    @cached_property
    def kind(self) -> np.ndarray:
        classes = self.edges(0.0, 0.0)
        kind = np.choose(classes, [0, EDGE_JUMP, EDGE_CONVEX, EDGE_CONCAVE, EDGE_BOUNDARY]).astype(np.uint8)
        kind[_beside(~np.isfinite(self.depth))] |= EDGE_BOUNDARY
        jumps = self.crossings[self.crossings["jump"] > 0]
        near = np.where(jumps["nearer"], jumps["first"], jumps["second"])
        far = np.where(jumps["nearer"], jumps["second"], jumps["first"])
        kind.ravel()[near] |= EDGE_OCCLUDING
        kind.ravel()[far] |= EDGE_OCCLUDED
        return kind

    def edges(self, jumpThreshold: float, creaseThreshold: float) -> np.ndarray:
        """The edges stronger than two thresholds, marked on both sides.

        edges(jumpThreshold, creaseThreshold) -> classes

        (H, W) uint8: 1 jump higher than `jumpThreshold`; 2 convex, 3 concave crease sharper than `creaseThreshold` degrees;
        4 a pixel beside one that sees nothing; 0 none of these. A jump outranks a crease, the sharper crease the other one.
        """
        low = _args.number("edges", "jumpThreshold", jumpThreshold, 0)
        angle = _args.number("edges", "creaseThreshold", creaseThreshold, 0, 180)
        classes = np.zeros(self.depth.size, np.uint8)
        classes[_beside(~np.isfinite(self.depth)).ravel()] = 4
        creases = self.crossings[(self.crossings["jump"] <= low) & (self.crossings["crease"] > angle)]
        creases = creases[np.argsort(creases["crease"], kind="stable")]
        sides = np.column_stack([creases["first"], creases["second"]]).ravel()
        classes[sides] = np.repeat(np.where(creases["convex"], 2, 3), 2)
        jumps = self.crossings[self.crossings["jump"] > low]
        classes[jumps["first"]] = classes[jumps["second"]] = 1
        return classes.reshape(self.depth.shape)

    def _largest(self, field: str, which: np.ndarray) -> np.ndarray:
        largest = np.zeros(self.depth.size, np.float32)
        chosen = self.crossings[which]
        for side in ("first", "second"):
            np.maximum.at(largest, chosen[side], chosen[field].astype(np.float32))
        return largest.reshape(self.depth.shape)


def _beside(mask: np.ndarray) -> np.ndarray:
    """Pixels outside a mask with one of their eight neighbours in it."""
    return (cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0) & ~mask


def renderScene(scene: Sequence[Solid], camera: Camera) -> Rendering:
    """Cast a ray through every pixel, and find the exact edges between the pixels.

    renderScene(scene, camera) -> rendering

    Between two neighbouring pixels (8-neighbours) on different faces the place where the visible face changes is found by
    bisection on the faces themselves. Both surfaces are intersected with the line of sight there, extended beyond the border
    of the face where need be: the difference of the depths is the jump, the angle between the normals the crease, as the
    paper defines them (P§2, Fig. 2). Faces are convex or seen from outside, so none occludes itself.

    Parameters
    ----------
    scene
        Solids, see `plane`, `box`, `polyhedron`, `sphere`, `cylinder`, `cone`; they may intersect.
    camera
        See `pinholeCamera`, `orthographicCamera`, `kinectCamera`, `abwCamera`, `perceptronCamera`.

    Raises
    ------
    error
        `scene` is empty or no sequence of solids, `camera` is none.

    Examples
    --------
    >>> from rangeedge.synthetic import kinectCamera, renderScene, step
    >>> rendering = renderScene(step(0.05), kinectCamera())
    >>> rendering.edges(0.01, 30.0)[240, 317:323]
    array([0, 0, 1, 1, 0, 0], dtype=uint8)
    >>> round(float(rendering.jump.max()), 6)
    0.05
    """
    if not isinstance(scene, Sequence) or not scene or not all(isinstance(solid, Solid) for solid in scene):
        raise _args.fail("renderScene", "scene", "a non-empty sequence of solids", _args.described(scene))
    if not isinstance(camera, Camera):
        raise _args.fail("renderScene", "camera", "a Camera", _args.described(camera))
    width, height = camera.size
    rays = origins, directions = camera.rays(*camera.pixels())
    depth, faces = _cast(scene, rays)
    depth[faces < 0] = np.nan
    points = origins + depth[:, None] * directions
    normals = np.full_like(points, np.nan)
    every = [face for solid in scene for face in solid.faces]
    for face, here in _grouped(every, faces):
        normals[here] = _normals(face, points[here], directions[here])
    crossings = _crossings(every, camera, depth, faces)
    shape = (height, width)
    faces = faces.reshape(shape)
    labels = _labels(faces)
    planes = (3,)
    return Rendering(
        tuple(scene),
        camera,
        depth.reshape(shape),
        points.reshape(shape + planes),
        normals.reshape(shape + planes),
        faces,
        labels,
        crossings,
    )


def _grouped(every: Sequence[_Face], numbers: np.ndarray) -> Iterator[tuple[_Face, np.ndarray]]:
    """Each face that occurs in `numbers`, with the places where."""
    order = np.argsort(numbers, kind="stable")
    present, starts = np.unique(numbers[order], return_index=True)
    for number, here in zip(present, np.split(order, starts[1:]), strict=True):
        if number >= 0:
            yield every[number], here


def _labels(faces: np.ndarray) -> np.ndarray:
    labels = np.zeros(faces.shape, np.int32)
    for number in np.unique(faces[faces >= 0]):
        _, parts = cv2.connectedComponents((faces == number).astype(np.uint8), connectivity=8)
        labels += np.where(parts > 0, parts + labels.max(), 0).astype(np.int32)
    return labels


_CROSSING = np.dtype(
    [
        ("x", np.float64),
        ("y", np.float64),
        ("jump", np.float64),
        ("crease", np.float64),
        ("convex", np.bool_),
        ("nearer", np.bool_),
        ("direction", np.uint8),
        ("first", np.int32),
        ("second", np.int32),
    ]
)


def _crossings(every: Sequence[_Face], camera: Camera, depth: np.ndarray, faces: np.ndarray) -> np.ndarray:
    first, second, direction = _neighbours(camera.size, faces)
    x, y = camera.pixels()
    start, way = np.stack([x[first], y[first]]), np.stack([x[second] - x[first], y[second] - y[first]])
    groups = [list(_grouped(every, faces[side])) for side in (first, second)]

    def rays_at(share: np.ndarray) -> Rays:
        return camera.rays(*(start + share * way))

    def hits(side: int, rays: Rays) -> np.ndarray:
        result = np.empty(len(first))
        for face, here in groups[side]:
            result[here] = _hit(face, (rays[0][here], rays[1][here]))
        return result

    low, high = np.zeros(len(first)), np.ones(len(first))
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        rays = rays_at(middle)
        depth_first = hits(0, rays)
        is_first = np.isfinite(depth_first) & (depth_first <= hits(1, rays))
        low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)

    # Both surfaces where the view changes from one to the other (P§2: x0, f1 and f2).
    ahead = [
        after - before for before, after in zip(rays_at(np.zeros_like(low)), rays_at(np.ones_like(low)), strict=True)
    ]
    meets, normals, slopes = [], [], []
    for side, (pixels, share) in enumerate(((first, low), (second, high))):
        origins, directions = rays_at(share)
        meet, normal = np.empty(len(first)), np.empty((len(first), 3))
        for face, here in groups[side]:
            origin, along = origins[here], directions[here]
            meet[here] = _extended(face, (origin, along), depth[pixels[here]])
            normal[here] = _normals(face, origin + meet[here, None] * along, along)
        with np.errstate(divide="ignore"):
            slope = -(normal * (ahead[0] + meet[:, None] * ahead[1])).sum(-1) / (normal * directions).sum(-1)
        meets.append(meet), normals.append(normal), slopes.append(slope)

    jump = np.abs(meets[0] - meets[1])
    crossings = np.empty(len(first), _CROSSING)
    crossings["x"], crossings["y"] = start + (low + high) / 2 * way
    crossings["jump"] = np.where(jump <= _TOUCHING * meets[0], 0, jump)
    crossings["crease"] = _angle(*normals)
    crossings["convex"] = slopes[0] < slopes[1]
    crossings["nearer"] = meets[0] < meets[1]
    crossings["direction"], crossings["first"], crossings["second"] = direction, first, second
    return crossings


def _neighbours(size: tuple[int, int], faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of neighbouring pixels that see different faces, and the direction from the first to the second."""
    width, height = size
    indices = np.arange(width * height).reshape(height, width)
    pairs = []
    for direction, (dx, dy) in _STEPS.items():
        rows = (slice(max(0, -dy), height - max(0, dy)), slice(max(0, dy), height + min(0, dy)))
        first, second = indices[rows[0], : width - dx].ravel(), indices[rows[1], dx:].ravel()
        differ = (faces[first] != faces[second]) & (faces[first] >= 0) & (faces[second] >= 0)
        pairs.append((first[differ], second[differ], np.full(differ.sum(), direction)))
    return tuple(np.concatenate(column) for column in zip(*pairs, strict=True))


def _angle(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angle between unit vectors in degrees, exact near 0 and 180 as well."""
    return np.degrees(2 * np.arctan2(np.linalg.norm(first - second, axis=-1), np.linalg.norm(first + second, axis=-1)))


# Scanners.


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
    reached, _ = _cast(rendering.scene, (np.broadcast_to(light, points.shape), directions))
    shadow = np.zeros(rendering.depth.shape, np.bool_)
    shadow.ravel()[seen] = reached < 1 - _TOUCHING
    return shadow


def _smooth_noise(rng: np.random.Generator, shape: tuple[int, int], radius: float) -> np.ndarray:
    """Standard normal noise correlated over `radius` pixels (1 sigma of the Gaussian window)."""
    margin = int(np.ceil(4 * radius))
    white = rng.standard_normal((shape[0] + 2 * margin, shape[1] + 2 * margin))
    window = cv2.getGaussianKernel(2 * margin + 1, radius)
    smooth = cv2.sepFilter2D(white, cv2.CV_64F, window, window)[margin:-margin, margin:-margin]
    return smooth / (window**2).sum()


def gaussianNoise(rendering: Rendering, sigma: float | Sequence[float], seed: Seed = 0) -> Scan:
    """White Gaussian noise along the lines of sight.

    gaussianNoise(rendering, sigma[, seed]) -> scan

    Parameters
    ----------
    sigma
        Standard deviation, or the coefficients (a, b, c) of a + b z + c z^2 for depth z.
    seed
        An integer >= 0, or a generator to draw from; the same seed gives the same scan.

    Raises
    ------
    error
        A negative sigma, or an argument of another type.
    """
    rng = _checked("gaussianNoise", rendering, seed)
    if np.ndim(sigma) == 0:
        deviation = _args.number("gaussianNoise", "sigma", sigma, 0)
    else:
        deviation = np.polynomial.Polynomial(_vector("gaussianNoise", "sigma", sigma))(rendering.depth)
        if np.nanmin(deviation) < 0:
            raise _args.fail("gaussianNoise", "sigma", ">= 0 at every depth", _args.described(sigma))
    return _scan(rendering, rendering.depth + deviation * rng.standard_normal(rendering.depth.shape))


def triangulationNoise(
    rendering: Rendering, sigma: float = 0.05, seed: Seed = 0, *, light: Vector | None = None
) -> Scan:
    """A quiet laser triangulation scanner: little white noise, and no data where the laser casts a shadow.

    triangulationNoise(rendering[, sigma[, seed[, light]]]) -> scan

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
    depth[_shadow(rendering, _vector("triangulationNoise", "light", light))] = np.nan
    return _scan(rendering, depth)


def abwNoise(rendering: Rendering, sigma: float = 0.6, seed: Seed = 0) -> Scan:
    """The ABW structured-light scanner of Hoover et al. (1996): eight bits of range, shadows of the projector.

    abwNoise(rendering[, sigma[, seed]]) -> scan

    The range r is an integer from 1 to 255, the depth r / 0.791686 + 771.016866, so one step is 1.263 and hides more than a
    pixel's width. `src` are points (H, W, 3) computed from `raw`, the 8-bit image; 0 there, NaN in `src`, is no data.

    Parameters
    ----------
    rendering
        By `abwCamera`, or another pinhole camera in millimetres.
    sigma
        Standard deviation of the depth before it is rounded.

    See `gaussianNoise` for the rest.
    """
    rng = _checked("abwNoise", rendering, seed)
    sigma = _args.number("abwNoise", "sigma", sigma, 0)
    if "K" not in rendering.camera.geometry:
        raise _args.fail("abwNoise", "rendering", "a picture by a pinhole camera", "one by another camera")
    depth = rendering.depth + sigma * rng.standard_normal(rendering.depth.shape)
    steps = np.rint((depth - _ABW_OFFSET) * _ABW_SCALE)
    lost = ~((steps >= 1) & (steps <= 255)) | _shadow(rendering, np.array([rendering.camera.distance / 3, 0.0, 0.0]))
    raw = np.where(lost, 0, steps).astype(np.uint8)
    return Scan(_points(rendering, np.where(lost, np.nan, steps / _ABW_SCALE + _ABW_OFFSET)), {}, raw)


def perceptronNoise(rendering: Rendering, sigma: float = 0.8, seed: Seed = 0) -> Scan:
    """The Perceptron time-of-flight scanner of Hoover et al. (1996): twelve bits of range, noisy, mixed at jumps.

    perceptronNoise(rendering[, sigma[, seed]]) -> scan

    `src` are points (H, W, 3) on an irregular grid, computed from `raw`, the 12-bit range in steps of 0.20236. Beside a jump
    the beam meets both surfaces, and the pixel gets a depth in between.

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
    # The light's way inside the scanner counts as well.
    left, up, forth = (_rays(rendering)[0] * (-1, -1, 1)).T.reshape(3, *depth.shape)
    inside = (forth - _PERCEPTRON_H2 + np.hypot(left, _PERCEPTRON_H2 + up)) / _PERCEPTRON_STEP - _PERCEPTRON_ZERO
    steps = np.rint(depth / _PERCEPTRON_STEP + inside)
    lost = ~((steps >= 0) & (steps <= 4095))
    raw = np.where(lost, 0, steps).astype(np.uint16)
    return Scan(_points(rendering, np.where(lost, np.nan, (steps - inside) * _PERCEPTRON_STEP)), {}, raw)


def _mixed(rendering: Rendering, radius: float) -> np.ndarray:
    """Depths averaged over a beam of `radius` pixels; only beside jumps, where that makes a difference."""
    beside = np.flatnonzero(rendering.jump > 0)
    x, y = (c[beside] for c in rendering.camera.pixels())
    parts = [
        _cast(rendering.scene, rendering.camera.rays(x + dx * radius, y + dy * radius))[0]
        for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    depth = rendering.depth.copy()
    depth.ravel()[beside] = np.mean(parts, 0)
    return depth


def kinectNoise(
    rendering: Rendering, sigma: float = 0.0014, seed: Seed = 0, *, jitter: float = 0.8, holes: float = 0.005
) -> Scan:
    """A Kinect v1: noise in inverse depth, correlated between pixels; ragged edges, shadows, holes; whole millimetres.

    kinectNoise(rendering[, sigma[, seed[, jitter[, holes]]]]) -> scan

    The disparity f b / z (b = 75 mm) is disturbed, rounded to 1/8 pixel and turned back into depth, so noise and resolution
    grow with z^2 (Khoshelham and Oude Elberink, 2012: 1.4 mm and 2.9 mm at 1 m). `src` is uint16, 0 is no data.

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
    for face, here in _grouped(every, np.where(faces == rendering.faces, -1, faces).ravel()):
        depth.ravel()[here] = _extended(face, (origins[here], directions[here]), near.ravel()[here])
    return depth


# Scenes.


def planePair(first: Vector, second: Vector, point: Vector = (0.0, 0.0, 1.0), convex: bool = True) -> list[Solid]:
    """Two half planes that meet in a line through a point: a wedge (convex) or a valley (concave).

    planePair(first, second[, point[, convex]]) -> scene

    The crease is the angle between the normals `first` and `second`, which face the viewer.

    Raises
    ------
    error
        The normals are parallel, or one of them faces away from the viewer.
    """
    first, second = _unit("planePair", "first", first), _unit("planePair", "second", second)
    point = _vector("planePair", "point", point)
    if np.linalg.norm(np.cross(first, second)) < 1e-9:
        raise _args.fail("planePair", "second", "not parallel to `first`", _args.described(second))
    for name, normal in (("first", first), ("second", second)):
        if normal[2] >= 0:
            raise _args.fail("planePair", name, "a normal with z < 0, toward the viewer", _args.described(normal))
    side = 1.0 if _args.boolean("planePair", "convex", convex) else -1.0
    pair = ((first, second), (second, first))
    return [
        Solid((_Face(_half_space(n, point), (_half_space(side * other, point),)),), point, np.inf) for n, other in pair
    ]


def roof(angle: float, orientation: float = 0.0, slant: float = 0.0, convex: bool = True, distance: float = 1.0):
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
        border = _half_space(side * across, np.zeros(3))
        scene.append(Solid((_Face(_half_space(normal, depth * axis), (border,)),), depth * axis, np.inf))
    return scene


def _across(func: str, orientation: Any) -> np.ndarray:
    turn = np.radians(_args.number(func, "orientation", orientation))
    return np.array([np.cos(turn), np.sin(turn), 0.0])


def twoCylinders(angle: float = 36.3, radius: float = 0.1, distance: float = 1.0) -> list[Solid]:
    """Two parallel upright cylinders that meet in a concave crease of `angle` degrees, as in the paper's Fig. 3, Table 2.

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


def _places(func: str, seed: Seed, camera: Camera) -> tuple[np.random.Generator, _Table, float, Iterator]:
    """A table before the camera and six places on it, with the room that each has."""
    if not isinstance(camera, Camera):
        raise _args.fail(func, "camera", "a Camera", _args.described(camera))
    rng = seed if isinstance(seed, np.random.Generator) else np.random.default_rng(_args.integer(func, "seed", seed, 0))
    table = _Table(camera.distance, rng.uniform(45, 60))
    width, height = camera.view()
    ahead = height / np.sin(np.radians(table.tilt))
    room = min(width / 3, ahead / 2)
    places = [
        (x * width / 3 + rng.uniform(-0.1, 0.1) * room, 0.0, z * ahead / 2 + rng.uniform(-0.1, 0.1) * room)
        for z in (-0.5, 0.4)
        for x in (-0.95, 0, 0.95)
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
