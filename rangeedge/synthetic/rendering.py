"""Range images of solids, and the exact edges in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from .. import _check
from ..bands import bands, distinct
from ..constants import (
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
from .cameras import Camera
from .solids import Face, Rays, Solid, cast, extended, hit, normals_toward_viewer

_STEPS = {DIR_ROWS: (1, 0), DIR_COLS: (0, 1), DIR_DIAG45: (1, -1), DIR_DIAG135: (1, 1)}  # (dx, dy) to the next pixel
_BISECTIONS = 24  # an edge is located within 2**-24 pixels
TOUCHING = 1e-6  # surfaces closer than this share of their depth meet in a crease


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
        (H, W) float32: the largest jump, and the largest crease between faces that meet (paper, 2), at either side.
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

    @_check.public
    def edges(self, jumpThreshold: float, creaseThreshold: float) -> np.ndarray:
        """The edges stronger than two thresholds, marked on both sides.

        edges(jumpThreshold, creaseThreshold) -> classes

        (H, W) uint8: 1 jump higher than `jumpThreshold`; 2 convex, 3 concave crease sharper than `creaseThreshold`
        degrees; 4 a pixel beside one that sees nothing; 0 none of these. A jump outranks a crease, the sharper crease
        the other one.
        """
        low = _check.number("jumpThreshold", jumpThreshold, 0)
        angle = _check.number("creaseThreshold", creaseThreshold, 0, 180)
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


@_check.public
def renderScene(scene: Sequence[Solid], camera: Camera) -> Rendering:
    """Cast a ray through every pixel, and find the exact edges between the pixels.

    renderScene(scene, camera) -> rendering

    Between two neighbouring pixels (8-neighbours) on different faces the place where the visible face changes is found
    by bisection on the faces themselves. Both surfaces are intersected with the line of sight there, extended beyond
    the border of the face where need be: the difference of the depths is the jump, the angle between the normals the
    crease, as the paper defines them (paper, 2, Fig. 2). Solids are convex, so no face occludes itself.

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
        raise _check.fail("scene", "a non-empty sequence of solids", _check.described(scene))
    if not isinstance(camera, Camera):
        raise _check.fail("camera", "a Camera", _check.described(camera))
    width, height = camera.size
    every = [face for solid in scene for face in solid.faces]
    depth, faces = np.empty((height, width)), np.empty((height, width), np.int32)
    points, normals = np.empty((height, width, 3)), np.full((height, width, 3), np.nan)
    for rows in bands(points):
        origins, directions = camera.rays(*camera.pixels(rows))
        own, seen = cast(scene, (origins, directions))
        own[seen < 0] = np.nan
        depth[rows], faces[rows] = own.reshape(-1, width), seen.reshape(-1, width)
        places = origins + own[:, None] * directions
        points[rows] = places.reshape(-1, width, 3)
        toward = normals[rows].reshape(-1, 3)
        for face, here in grouped(every, seen):
            toward[here] = normals_toward_viewer(face, places[here], directions[here])
    crossings = _crossings(every, camera, depth.ravel(), faces)
    return Rendering(tuple(scene), camera, depth, points, normals, faces, _labels(faces), crossings)


def grouped(every: Sequence[Face], numbers: np.ndarray) -> Iterator[tuple[Face, np.ndarray]]:
    """Each face that occurs in `numbers`, with the places where."""
    for number in _those_of(numbers):
        yield every[number], np.flatnonzero(numbers == number)


def _those_of(faces: np.ndarray) -> np.ndarray:
    """The numbers of the faces that are seen."""
    numbers = distinct(faces)
    return numbers[numbers >= 0]


def _labels(faces: np.ndarray) -> np.ndarray:
    labels = np.zeros(faces.shape, np.int32)
    used = 0
    for number in _those_of(faces):
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
    faces = faces.ravel()
    start, end = (np.stack(np.divmod(side, camera.size[0])[::-1]).astype(np.float64) for side in (first, second))
    way = end - start
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

    # Both surfaces on the line of sight where the view changes from one to the other (paper, 2: x0, f1 and f2).
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
    pairs = []
    for direction, (dx, dy) in _STEPS.items():
        first = faces[max(0, -dy) : height - max(0, dy), : width - dx]
        second = faces[max(0, dy) : height + min(0, dy), dx:]
        for rows in bands(first):
            a, b = first[rows], second[rows]
            row, col = np.nonzero((a != b) & (a >= 0) & (b >= 0))
            pixel = (row + rows.start + max(0, -dy)) * width + col
            pairs.append((pixel, pixel + dy * width + dx, np.full(len(pixel), direction)))
    return tuple(np.concatenate(column) for column in zip(*pairs, strict=True))


def _angle(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angle between unit vectors in degrees, exact near 0 and 180 as well."""
    return np.degrees(2 * np.arctan2(np.linalg.norm(first - second, axis=-1), np.linalg.norm(first + second, axis=-1)))
