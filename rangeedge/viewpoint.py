"""Where a range image was seen from: the lines of sight of organized points, and those through a lens."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from ._check import error
from .bands import bands

Point = tuple[float, float, float]

_LINES = 16  # rows and columns, each, that are looked at
_OFF_PLANE = 0.01  # of its length, by which a scan line may lie off its plane or cone on average
_PREFERRED = 3.0  # times the offsets of another viewpoint that those of the given one may have
_LEAST_IMAGE = 8  # rows and columns that tell more than where rays are planes
_FIXED = 1e-6  # least share of the largest eigenvalue, that planes fix a viewpoint
_STEPS = 20  # of Newton's method, until undistorted rays meet their pixels


class View(NamedTuple):
    """How organized points were seen: along rays from `origin`, or in parallel along z.

    `axis` is the direction of view; `ranges` says that rows are cones, or rays too far apart for a plane image.
    """

    projective: bool
    origin: Point = (0.0, 0.0, 0.0)
    axis: Point = (0.0, 0.0, 1.0)
    ranges: bool = False


def view_of(points: np.ndarray, origin: Point | None) -> View:
    """How points (H, W, 3) were seen, NaN where there are none.

    The rows and columns of a plane image lie in planes through the viewpoint, or along z where rays are parallel; those
    of a scanner that turns lie on cones around it.
    """
    rows, columns = _lines_of(points)
    if origin is not None:
        place = np.asarray(origin)
        rows, columns = [line - place for line in rows], [line - place for line in columns]
    if not rows and not columns:
        return _plane_view(points, origin)
    flat = _off(_off_planes, rows, columns)
    parallel = _off(_off_parallel, rows, columns) if origin is None else np.inf
    if min(flat, parallel) <= _OFF_PLANE or (origin is None and min(points.shape[:2]) < _LEAST_IMAGE):
        if _median(_off_parallel, rows + columns) < _median(_off_planes, rows + columns) and origin is None:
            return View(False)
        return _plane_view(points, origin)
    turning = _off(_off_cones, rows, columns)
    if origin is not None:
        if turning > _OFF_PLANE:
            raise error("`origin` must be where the rays of the points meet: their rows and columns do not meet there")
        return _turning_view(points, origin)
    found = _common_point(rows + columns)
    moved = np.inf
    if found is not None:
        moved = _off(_off_planes, [line - found for line in rows], [line - found for line in columns])
    if turning <= _OFF_PLANE and turning <= _PREFERRED * moved:
        return _turning_view(points, None)
    if moved > _OFF_PLANE:
        raise error(
            "`src` must hold points whose rays meet in one point: their rows and columns neither meet in (0, 0, 0) nor"
            " tell another viewpoint; transform them into the frame of the sensor, or say where that is by origin"
        )
    return _plane_view(points, tuple(found.tolist()))


def _plane_view(points: np.ndarray, origin: Point | None) -> View:
    origin = origin or (0.0, 0.0, 0.0)
    nearest = min((own[:, 2].min() for own in _seen(points, origin)), default=None)
    if nearest is None:
        return View(False)
    if nearest > 0:
        return View(True, origin)
    return View(True, origin, mean_ray(_seen(points, origin)))


def _turning_view(points: np.ndarray, origin: Point | None) -> View:
    origin = origin or (0.0, 0.0, 0.0)
    return View(True, origin, mean_ray(_seen(points, origin)), ranges=True)


def _seen(points: np.ndarray, origin: Point) -> Iterator[np.ndarray]:
    """The points there are from the viewpoint, some at a time."""
    for rows in bands(points):
        own = points[rows]
        own = own[np.isfinite(own[..., 2])].astype(np.float64) - np.asarray(origin)
        if len(own):
            yield own


def mean_ray(parts: Iterable[np.ndarray]) -> Point:
    """The mean of the rays of points (N, 3), which come in parts; the z axis where they go everywhere."""
    total, count = np.zeros((1, 3)), 0
    for points in parts:
        total = np.concatenate([total, unit_rays(points)]).sum(axis=0, keepdims=True)  # one after the other
        count += len(points)
    axis = total[0] / max(count, 1)
    length = np.linalg.norm(axis)
    return tuple((axis / length).tolist()) if length > 0.1 else (0.0, 0.0, 1.0)


def unit_rays(vectors: np.ndarray) -> np.ndarray:
    """Directions of vectors."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), np.finfo(np.float64).tiny)


def _lines_of(points: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Points of some rows and columns, of those with three or more."""
    height, width = points.shape[:2]
    rows = [points[v] for v in np.unique(np.linspace(0, height - 1, _LINES).astype(int))]
    columns = [points[:, u] for u in np.unique(np.linspace(0, width - 1, _LINES).astype(int))]
    return tuple(
        [line for line in (line[np.isfinite(line[:, 0])].astype(np.float64) for line in lines) if len(line) > 2]
        for lines in (rows, columns)
    )


def _median(off, lines) -> float:
    return float(np.median([off(line) for line in lines]))


def _off(off, rows, columns) -> float:
    """How far rows or columns, whichever are farther, lie off."""
    return max(_median(off, lines) for lines in (rows, columns) if lines)


def _off_plane_of(line: np.ndarray, normal: np.ndarray) -> float:
    """Root mean square distance of points from the plane through the first, as a share of their extent."""
    length, extent = np.linalg.norm(normal), np.linalg.norm(line.max(axis=0) - line.min(axis=0))
    if not (length > 0 and extent > 0):
        return 0.0
    return float(np.sqrt(np.mean(((line - line[0]) @ normal) ** 2)) / (length * extent))


def _off_planes(line: np.ndarray) -> float:
    """From the plane of the first and last ray."""
    return _off_plane_of(line, np.cross(line[0], line[-1]))


def _off_parallel(line: np.ndarray) -> float:
    """From the plane along z through the first and last point."""
    return _off_plane_of(line, np.cross((0.0, 0.0, 1.0), line[-1] - line[0]))


def _off_cones(line: np.ndarray) -> float:
    """Of rays from a circle on the unit sphere, as a share of their extent."""
    rays = unit_rays(line)
    rays = rays - rays.mean(axis=0)
    if not np.isfinite(rays).all():  # lengths that cannot be squared
        return np.inf
    values = np.linalg.eigvalsh(rays.T @ rays / len(rays))
    return float(np.sqrt(max(values[0], 0.0) / values[2])) if values[2] > 0 else 0.0


def _common_point(lines: list[np.ndarray]) -> np.ndarray | None:
    """The point nearest to the planes of lines, by least squares; None where they do not fix one."""
    normals, offsets, weights = [], [], []
    for line in lines:
        middle = line.mean(axis=0)
        moments = (line - middle).T @ (line - middle) / len(line)
        if not np.isfinite(moments).all():  # lengths that cannot be squared
            continue
        values, vectors = np.linalg.eigh(moments)
        if values[2] <= 0:
            continue
        normals.append(vectors[:, 0])
        offsets.append(vectors[:, 0] @ middle)
        # A straight line lies in many planes.
        weights.append(values[1] / (max(values[0], 0.0) + 1e-9 * values[2]))
    n, d, w = np.array(normals), np.array(offsets), np.array(weights)
    if len(n) < 3:
        return None
    w = np.minimum(w, 100 * np.median(w))
    spread = np.linalg.eigvalsh((n * w[:, None]).T @ n)
    if spread[0] <= _FIXED * spread[2]:
        return None
    return np.linalg.solve((n * w[:, None]).T @ n, (n * w[:, None]).T @ d)


def distorted_rays(K: np.ndarray, distCoeffs: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The line of sight (x, y, 1) of every pixel through a lens with distortion as cv2 has it, (H, W, 3)."""
    return _distorted_rays(K.tobytes(), distCoeffs.tobytes(), shape)


@lru_cache(maxsize=4)
def _distorted_rays(camera: bytes, coefficients: bytes, shape: tuple[int, int]) -> np.ndarray:
    K, distCoeffs = np.frombuffer(camera).reshape(3, 3), np.frombuffer(coefficients)
    pixels = np.indices(shape)[::-1].reshape(2, -1).T.astype(np.float64)
    straight = np.array([[K[0, 0], 0, K[0, 2]], [0, K[1, 1], K[1, 2]], [0, 0, 1]])
    pixels = pixels - np.stack([K[0, 1] / K[1, 1] * (pixels[:, 1] - K[1, 2]), 0 * pixels[:, 1]], 1)  # without skew
    places = cv2.undistortPoints(pixels[:, None], straight, distCoeffs)[:, 0]
    for _ in range(_STEPS):  # cv2 stops early
        rays = np.column_stack([places, np.ones(len(places))])
        seen = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), straight, distCoeffs)[0][:, 0]
        off = (pixels - seen) / np.diag(straight)[:2]
        places = places + off
        if np.abs(off).max() < 1e-12:
            break
    rays = np.column_stack([places, np.ones(len(places))]).reshape(*shape, 3)
    rays.setflags(write=False)
    return rays
