"""Where the points of a plane image were seen from, by the pixels that see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_SAMPLES = 24  # rows and columns of points that are looked at
_LEAST = 24  # points
_FIXED = 0.3  # largest misfit that fixes a viewpoint, as a share of the next best one


class Resection(NamedTuple):
    """How far, in pixels, points lie from where a plane image has them: root mean squares, infinite without one."""

    here: float  # seen from (0, 0, 0)
    parallel: float  # along z
    moved: float  # seen from `place`
    place: np.ndarray | None


def resect(points: np.ndarray) -> Resection:
    """The plane images that fit points (H, W, 3) best, NaN where there are none.

    A plane image of a point X has its pixel at (a, b) / c with (a, b, c) = P (X, 1): P is found by the direct linear
    transform, and the viewpoint is where P (X, 1) = 0.
    """
    v_step, u_step = (max(side // _SAMPLES, 1) for side in points.shape[:2])
    seen = points[::v_step, ::u_step].astype(np.float64)
    pixels = np.stack(np.indices(seen.shape[:2])[::-1], axis=-1) * (u_step, v_step)
    valid = np.isfinite(seen).all(axis=-1)
    seen, pixels = seen[valid], pixels[valid].astype(np.float64)
    middle = seen.mean(axis=0) if len(seen) else np.zeros(3)
    scale = np.sqrt(((seen - middle) ** 2).sum(axis=1).mean()) if len(seen) else 0.0
    if len(seen) < _LEAST or not 0 < scale < np.inf:
        return Resection(np.inf, np.inf, np.inf, None)
    ones = np.ones((len(seen), 1))
    lengths = np.maximum(np.linalg.norm(seen, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    here, _ = _projected(seen / lengths, pixels)
    parallel = _affine(np.hstack([(seen - middle)[:, :2] / scale, ones]), pixels)
    moved, matrix = _projected(np.hstack([(seen - middle) / scale, ones]), pixels)
    if matrix is not None:
        centre = np.linalg.svd(matrix)[2][-1]
        place = centre[:3] / centre[3] * scale + middle
        if np.isfinite(place).all():  # not where rays are parallel
            return Resection(here, parallel, moved, place)
    return Resection(here, parallel, np.inf, None)


def _projected(vectors: np.ndarray, pixels: np.ndarray) -> tuple[float, np.ndarray | None]:
    """How far pixels lie from the best projective image of vectors, and its matrix; None where that is not fixed."""
    middle, extent = pixels.mean(axis=0), np.ptp(pixels, axis=0).max()
    if extent == 0:
        return np.inf, None
    places = (pixels - middle) / extent
    zeros = np.zeros_like(vectors)
    equations = np.vstack(
        [
            np.hstack([vectors, zeros, -places[:, :1] * vectors]),
            np.hstack([zeros, vectors, -places[:, 1:] * vectors]),
        ]
    )
    _, misfits, solutions = np.linalg.svd(equations, full_matrices=False)
    matrix = solutions[-1].reshape(3, -1)
    images = vectors @ matrix.T
    if not ((images[:, 2] > 0).all() or (images[:, 2] < 0).all()):
        return np.inf, None
    off = images[:, :2] / images[:, 2:] - places
    return float(extent) * _rms(off), matrix if misfits[-1] <= _FIXED * misfits[-2] else None


def _affine(vectors: np.ndarray, pixels: np.ndarray) -> float:
    """How far pixels lie from the best affine image of vectors."""
    matrix, *_ = np.linalg.lstsq(vectors, pixels, rcond=None)
    return _rms(vectors @ matrix - pixels)


def _rms(off: np.ndarray) -> float:
    return float(np.sqrt((off**2).sum(axis=1).mean()))
