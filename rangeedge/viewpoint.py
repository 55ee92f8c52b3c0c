"""Where a range image was seen from: the lines of sight of organized points, and those through a lens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from ._check import error
from .bands import bands
from .resection import resect

Point = tuple[float, float, float]

_LINES = 16  # rows and columns, each, that are looked at
_OFF_PLANE = 0.01  # of its length, by which a scan line may lie off its plane or cone on average
_SHARP = 0.5  # pixels, by which a plane image may be off its points
_EXACT = 1e-3  # pixels, below which images are the same
_LEAST_OFF = 1e-4  # of its length, by which a scan line may lie off anyway
_PREFERRED = 3.0  # times the offsets of another viewpoint that those of (0, 0, 0) may have
_LEAST_IMAGE = 8  # rows and columns that tell more than where rays are planes
_GRID = 32  # rows and columns of points that tell whether rays cross each other
_UNFOLDED = 0.98  # least share of its cells that lie the same way round
_LEAST_FIELD = 0.05  # of view, of a scanner that turns: from far away any line lies on a cone
_NARROWED, _HEIGHTS = 4, 25  # how often, and at how many heights, the apex of cones is looked for
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


@np.errstate(all="ignore")  # lengths that cannot be squared
def view_of(points: np.ndarray, origin: Point | None) -> View:
    """How points (H, W, 3) were seen, NaN where there are none.

    The rows and columns of a plane image lie in planes through the viewpoint, or along z where rays are parallel; those
    of a scanner that turns lie on cones around it.
    """
    lines = _Lines.of(points)
    if not lines.rows and not lines.columns:
        return _plane_view(points, origin)
    if origin is not None:
        return _view_from(points, origin, lines.seen_from(origin))
    if min(points.shape[:2]) >= _LEAST_IMAGE and (view := _plane_image(points)):
        return view
    flat, parallel, turning = lines.off_planes(), lines.off_parallel(), lines.off_cones()
    if min(flat, parallel) <= _LEAST_OFF or min(points.shape[:2]) < _LEAST_IMAGE:
        return View(False) if parallel < flat else _plane_view(points, None)
    moved, moved_off = _best(lines, _Lines.off_planes, [_common_point(lines.rows + lines.columns)])
    turned, turned_off = _best(lines, _Lines.off_cones, _apexes(lines))
    if min(flat, parallel, turning) <= min(_OFF_PLANE, max(_PREFERRED * min(moved_off, turned_off), _LEAST_OFF)):
        if min(flat, parallel) > _OFF_PLANE:
            return _turning_view(points, None)
        return View(False) if parallel < flat else _plane_view(points, None)
    if moved_off <= min(_OFF_PLANE, turned_off):
        return _plane_view(points, moved)
    if turned_off <= _OFF_PLANE:
        return _turning_view(points, turned)
    raise error(
        "`src` must hold points whose rays meet in one point: their rows and columns neither meet in (0, 0, 0) nor"
        " tell another viewpoint; transform them into the frame of the sensor, or say where that is by origin"
    )


def _plane_image(points: np.ndarray) -> View | None:
    """The view of points that are the plane image of a regular grid of pixels; None where they are none."""
    fits = resect(points)
    best = min(fits.here, fits.parallel, fits.moved)
    if best > _SHARP:
        return None
    if min(fits.here, fits.parallel) <= max(_PREFERRED * best, _EXACT):
        return View(False) if fits.parallel < fits.here else _plane_view(points, None)
    return _plane_view(points, tuple(fits.place.tolist()))


def _view_from(points: np.ndarray, origin: Point, lines: _Lines) -> View:
    """The view from where the caller says."""
    if lines.off_planes() <= _OFF_PLANE:
        return _plane_view(points, origin)
    if lines.off_cones() <= _OFF_PLANE:
        return _turning_view(points, origin)
    raise error("`origin` must be where the rays of the points meet: their rows and columns do not meet there")


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


class _Lines(NamedTuple):
    """Points of some rows and columns, of those with three or more, and of a coarse grid of both."""

    rows: list[np.ndarray]
    columns: list[np.ndarray]
    grid: np.ndarray  # (h, w, 3)

    @classmethod
    def of(cls, points: np.ndarray) -> _Lines:
        height, width = points.shape[:2]
        rows = [points[v] for v in np.unique(np.linspace(0, height - 1, _LINES).astype(int))]
        columns = [points[:, u] for u in np.unique(np.linspace(0, width - 1, _LINES).astype(int))]
        grid = points[:: max(height // _GRID, 1), :: max(width // _GRID, 1)]
        return cls(_finite(rows), _finite(columns), grid.astype(np.float64))

    def seen_from(self, place: np.ndarray | Point) -> _Lines:
        return _Lines([r - place for r in self.rows], [c - place for c in self.columns], self.grid - place)

    def off_planes(self) -> float:
        """How far lines lie off planes through the viewpoint; infinite where the lines of sight cross each other."""
        rays = unit_rays(self.grid)
        ahead = rays @ np.nanmean(rays.reshape(-1, 3), axis=0) if np.isfinite(rays).any() else 1.0
        folded = _folds(rays * np.where(ahead < 0, -1.0, 1.0)[..., np.newaxis])  # also of points behind
        return np.inf if folded else self._off(_off_planes)

    def off_cones(self) -> float:
        """How far lines lie off cones around the viewpoint; infinite where rays cross each other, or lie too close."""
        rays = unit_rays(self.grid)
        seen = rays[np.isfinite(rays).all(axis=-1)]
        narrow = len(seen) > 0 and np.ptp(seen, axis=0).max() < _LEAST_FIELD
        return np.inf if narrow or _folds(rays) else self._off(_off_cones)

    def off_parallel(self) -> float:
        """How far lines lie off planes along z; infinite where they cross each other."""
        return np.inf if _folds(self.grid[..., :2]) else self._off(_off_parallel)

    def _off(self, off: Callable[[np.ndarray], float]) -> float:
        """Of rows or columns, whichever are farther off."""
        return max(float(np.median([off(line) for line in lines])) for lines in (self.rows, self.columns) if lines)


def _finite(lines: list[np.ndarray]) -> list[np.ndarray]:
    finite = [line[np.isfinite(line[:, 0])].astype(np.float64) for line in lines]
    return [line for line in finite if len(line) > 2]


def _folds(places: np.ndarray) -> bool:
    """Whether a grid of places in a plane, or on the unit sphere, turns over: then the points were not seen so."""
    along, across = places[:-1, 1:] - places[:-1, :-1], places[1:, :-1] - places[:-1, :-1]
    if places.shape[-1] == 2:
        turn = along[..., 0] * across[..., 1] - along[..., 1] * across[..., 0]
    else:
        turn = (np.cross(along, across) * places[:-1, :-1]).sum(axis=-1)
    turn = turn[np.isfinite(turn)]
    left = int((turn > 0).sum())
    return max(left, len(turn) - left) < _UNFOLDED * len(turn)


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


def _best(lines: _Lines, off: Callable[[_Lines], float], places: list[np.ndarray | None]) -> tuple[Point | None, float]:
    """The place that lines fit best, and how far they are off it."""
    known = [place for place in places if place is not None and np.isfinite(place).all()]
    tried = [(off(lines.seen_from(place)), tuple(place.tolist())) for place in known]
    return min(tried)[::-1] if tried else (None, np.inf)


def _common_point(lines: list[np.ndarray]) -> np.ndarray | None:
    """The point nearest to the planes of lines, by least squares; None where they do not fix one."""
    moments, sums = _planes_of(lines)
    values = np.linalg.eigvalsh(moments)
    return np.linalg.solve(moments, sums) if values[0] > _FIXED * values[2] else None


def _apexes(lines: _Lines) -> list[np.ndarray]:
    """Where cones of a scanner that turns may begin: on the axis in which the planes of its columns, or rows, meet."""
    ways = ((lines.columns, lines.rows), (lines.rows, lines.columns))
    return [_apex_on(*_axis_of(flat), around) for flat, around in ways if len(flat) > 2 and around]


def _axis_of(lines: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """A point of the line in which planes meet, the nearest to the lines' middle, and its direction."""
    middle = np.concatenate(lines).mean(axis=0)
    moments, sums = _planes_of([line - middle for line in lines])
    values, vectors = np.linalg.eigh(moments)
    across = vectors[:, 1:]
    return middle + across @ ((across.T @ sums) / np.maximum(values[1:], np.finfo(float).tiny)), vectors[:, 0]


def _apex_on(place: np.ndarray, axis: np.ndarray, lines: list[np.ndarray]) -> np.ndarray:
    """The point of an axis around which lines lie on cones best."""

    def off(height: float) -> float:
        return float(np.mean([_off_cones(line - place - height * axis) for line in lines]))

    heights = np.concatenate([(line - place) @ axis for line in lines])
    low, high = heights.min(), heights.max()
    for _ in range(_NARROWED):
        tried = np.linspace(low, high, _HEIGHTS)
        best = tried[np.argmin([off(height) for height in tried])]
        low, high = best - (tried[1] - tried[0]), best + (tried[1] - tried[0])
    return place + best * axis


def _planes_of(lines: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The weighted sums of the planes of lines, N' W N and N' W d of N x = d."""
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
    n, d, w = np.array(normals).reshape(-1, 3), np.array(offsets), np.array(weights)
    w = np.minimum(w, 100 * np.median(w)) if len(w) else w
    return (n * w[:, None]).T @ n, (n * w[:, None]).T @ d


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
