"""Range images of solids, and the exact edges in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

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
from .scanners import (
    ABW_ASPECT,
    ABW_CALIBRATIONS,
    ABW_CENTRE,
    PERCEPTRON_FIELD,
    PERCEPTRON_LASER_TO_MIRROR,
    PERCEPTRON_MIRROR_SLOPE,
    PERCEPTRON_MIRROR_TO_MIRROR,
    SCANNER_SIZE,
)
from .solids import Face, Rays, Solid, cast, extended, hit, normals_toward_viewer, vector

_STEPS = {DIR_ROWS: (1, 0), DIR_COLS: (0, 1), DIR_DIAG45: (1, -1), DIR_DIAG135: (1, 1)}  # (dx, dy) to the next pixel
_BISECTIONS = 24  # an edge is located within 2**-24 pixels
TOUCHING = 1e-6  # surfaces closer than this share of their depth meet in a crease


@dataclass(frozen=True)
class Camera:
    """Where the pixels of a range image look.

    Attributes
    ----------
    size
        (width, height) of the image.
    rays
        Function of pixel coordinates x, y (fractions allowed), each of shape (N,), that returns origins and directions
        of the lines of sight, (N, 3) each. The depth of a point is its multiple of the direction: z for the pinhole and
        the orthographic camera, the distance along the ray for the angular scanner.
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
        (3, 3) intrinsic matrix.
    size
        (width, height) of the image.
    distance
        Depth at which the ready-made scenes stand.
    """
    size = _size("pinholeCamera", size)
    distance = _args.number("pinholeCamera", "distance", distance, 0, above=True)
    K = _args.camera_matrix("pinholeCamera", "K", K).copy()
    inverse = np.linalg.inv(K)

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        directions = np.stack([x, y, np.ones_like(x)], -1) @ inverse.T
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
    pitch = vector("orthographicCamera", "pixelSize", pixelSize, 2)
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
    focal = ABW_CALIBRATIONS[2].focal
    K = np.array([[focal, 0, ABW_CENTRE], [0, ABW_ASPECT * focal, ABW_CENTRE], [0, 0, 1]])
    return pinholeCamera(K, SCANNER_SIZE[::-1], 930.0)


def perceptronCamera() -> Camera:
    """The Perceptron time-of-flight scanner of Hoover et al. (1996), 512x512, in its own unit (about 1 cm).

    perceptronCamera() -> camera

    Two mirrors turn the beam in equal angles, so the points form no regular grid and the rays do not meet in one point.
    """
    height, width = SCANNER_SIZE
    field_x, field_y = PERCEPTRON_FIELD

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        alpha, beta = field_x * ((width - 1) / 2 - x) / width, field_y * ((height - 1) / 2 - y) / height
        dz = -PERCEPTRON_LASER_TO_MIRROR * (1 - np.cos(alpha)) / np.tan(PERCEPTRON_MIRROR_SLOPE)
        dy = dz * np.tan(PERCEPTRON_MIRROR_SLOPE + beta / 2)
        dx = (PERCEPTRON_MIRROR_TO_MIRROR + dy) * np.tan(alpha)
        # The scanner's x points to the left and its y up.
        directions = np.stack([-np.sin(alpha), -np.cos(alpha) * np.sin(beta), np.cos(alpha) * np.cos(beta)], -1)
        return np.stack([-dx, -dy, dz], -1), directions

    return Camera((width, height), rays, {}, 450.0)


@dataclass(frozen=True)
class Rendering:
    """A noise-free range image and everything that is true about it.

    Attributes
    ----------
    scene, camera
        What was rendered.
    depth
        (H, W) float64, along the lines of sight (see `Camera`); NaN where nothing is seen.
    points, normals
        (H, W, 3) float64; the normals are unit vectors toward the viewer. NaN where nothing is seen.
    faces
        (H, W) int32: the number of the visible face, counted through the solids of the scene from 0; -1 for none.
    labels
        (H, W) int32: the connected parts of visible faces, 1..n; 0 where nothing is seen.
    crossings
        Structured array of every place where a scan line (row, column, diagonal) passes from one face to another
        between two neighbouring pixels `first` and `second` (indices of the flattened image): its position `x`, `y` in
        pixels, exact to 1e-6; the `jump` there, the difference of both depths along the line of sight, 0 where the
        faces meet; the `crease`, the angle between both normals in degrees; whether it is `convex`; whether `first` is
        the `nearer`; the `direction`, one of DIR_*.
    jump, crease
        (H, W) float32: the largest jump, and the largest crease between faces that meet (P§2), at either side.
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

        (H, W) uint8: 1 jump higher than `jumpThreshold`; 2 convex, 3 concave crease sharper than `creaseThreshold`
        degrees; 4 a pixel beside one that sees nothing; 0 none of these. A jump outranks a crease, the sharper crease
        the other one.
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

    Between two neighbouring pixels (8-neighbours) on different faces the place where the visible face changes is found
    by bisection on the faces themselves. Both surfaces are intersected with the line of sight there, extended beyond
    the border of the face where need be: the difference of the depths is the jump, the angle between the normals the
    crease, as the paper defines them (P§2, Fig. 2). Solids are convex, so no face occludes itself.

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
    depth, faces = cast(scene, rays)
    depth[faces < 0] = np.nan
    points = origins + depth[:, None] * directions
    normals = np.full_like(points, np.nan)
    every = [face for solid in scene for face in solid.faces]
    for face, here in grouped(every, faces):
        normals[here] = normals_toward_viewer(face, points[here], directions[here])
    crossings = _crossings(every, camera, depth, faces)
    faces = faces.reshape(height, width)
    return Rendering(
        tuple(scene),
        camera,
        depth.reshape(height, width),
        points.reshape(height, width, 3),
        normals.reshape(height, width, 3),
        faces,
        _labels(faces),
        crossings,
    )


def grouped(every: Sequence[Face], numbers: np.ndarray) -> Iterator[tuple[Face, np.ndarray]]:
    """Each face that occurs in `numbers`, with the places where."""
    for number in np.unique(numbers[numbers >= 0]):
        yield every[number], np.flatnonzero(numbers == number)


def _labels(faces: np.ndarray) -> np.ndarray:
    labels = np.zeros(faces.shape, np.int32)
    used = 0
    for number in np.unique(faces[faces >= 0]):
        here = faces == number
        count, parts = cv2.connectedComponents(here.view(np.uint8), connectivity=8)
        labels[here] = parts[here] + used
        used += count - 1
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


def _crossings(every: Sequence[Face], camera: Camera, depth: np.ndarray, faces: np.ndarray) -> np.ndarray:
    first, second, direction = _neighbours(camera.size, faces)
    x, y = camera.pixels()
    start, way = np.stack([x[first], y[first]]), np.stack([x[second] - x[first], y[second] - y[first]])
    groups = [list(grouped(every, faces[side])) for side in (first, second)]

    def rays_at(share: np.ndarray) -> Rays:
        return camera.rays(*(start + share * way))

    def hits(side: int, rays: Rays) -> np.ndarray:
        result = np.empty(len(first))
        for face, here in groups[side]:
            result[here] = hit(face, (rays[0][here], rays[1][here]))
        return result

    low, high = np.zeros(len(first)), np.ones(len(first))
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        rays = rays_at(middle)
        depth_first = hits(0, rays)
        is_first = np.isfinite(depth_first) & (depth_first <= hits(1, rays))
        low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)

    # Both surfaces on the line of sight where the view changes from one to the other (P§2: x0, f1 and f2).
    place = (low + high) / 2
    origins, directions = rays_at(place)
    ahead = [
        after - before for before, after in zip(rays_at(np.zeros_like(low)), rays_at(np.ones_like(low)), strict=True)
    ]
    meets, normals, slopes = [], [], []
    for side, pixels in enumerate((first, second)):
        meet, normal = np.empty(len(first)), np.empty((len(first), 3))
        for face, here in groups[side]:
            origin, along = origins[here], directions[here]
            meet[here] = extended(face, (origin, along), depth[pixels[here]])
            normal[here] = normals_toward_viewer(face, origin + meet[here, None] * along, along)
        with np.errstate(divide="ignore"):
            slope = -(normal * (ahead[0] + meet[:, None] * ahead[1])).sum(-1) / (normal * directions).sum(-1)
        meets.append(meet), normals.append(normal), slopes.append(slope)

    jump = np.abs(meets[0] - meets[1])
    crossings = np.empty(len(first), _CROSSING)
    crossings["x"], crossings["y"] = start + place * way
    crossings["jump"] = np.where(jump <= TOUCHING * meets[0], 0, jump)
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
