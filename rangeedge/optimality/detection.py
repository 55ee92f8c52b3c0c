"""Errors of the detector itself, on rendered images of two planes."""

from __future__ import annotations

import cv2
import numpy as np

from .. import _check
from ..constants import CREASE_MAX
from ..edges import edgeStrength
from ..options import CREASES
from .creases import angle_between, normal_pair


@_check.public
def measureDetector(
    normals1: np.ndarray,
    normals2: np.ndarray,
    sigma: float = 0.0,
    crease: int = CREASE_MAX,
    *,
    size: int = 48,
    seed: int = 0,
) -> np.ndarray:
    """The error E of `edgeStrength` itself, on a rendered image of every pair of planes.

    measureDetector(normals1, normals2[, sigma[, crease]], *[, size[, seed]]) -> errors

    Each pair is drawn by parallel projection on a grid of unit pitch, in turn as a convex and a concave edge through
    a random point within an eighth of `size` of the image centre. The strength is the median along the quarter of the
    true edge line about that point, at every place the largest within a pixel.

    Parameters
    ----------
    normals1, normals2 : (n, 3) real arrays
        As for `creaseAngle`.
    sigma : float
        Standard deviation of white noise added to the depth, in pixel pitches.
    crease : int
        `CREASE_MAX` or `CREASE_NORMAL`.
    size : int
        Height and width of the image, 16 to 512.
    seed : int
        Of the noise and of the places of the edges.

    Returns
    -------
    (n,) float64 array
        In degrees; NaN where less than half of the line was detected, and of equal normals.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type, shape or range.
    """
    normals1, normals2 = np.broadcast_arrays(*normal_pair(normals1, normals2))
    if normals1.ndim != 2:
        raise _check.fail("normals1", "of shape (n, 3)", normals1.shape, cv2.Error.StsBadSize)
    sigma = _check.number("sigma", sigma, 0.0)
    crease = _check.flag("crease", crease, CREASES)
    size = _check.integer("size", size, 16, 512)
    rng = np.random.default_rng(_check.integer("seed", seed, 0))

    errors = np.empty(len(normals1))
    for k, (normal1, normal2) in enumerate(zip(normals1, normals2, strict=True)):
        centre = (size - 1) / 2 + rng.uniform(-size / 8, size / 8, 2)
        depth = _plane_pair(normal1, normal2, centre, size, convex=k % 2 == 0)
        depth += rng.normal(0, sigma, depth.shape)
        # Without noise what is left is the rounding of single precision.
        strength = edgeStrength(depth, pixelSize=1.0, noise=max(sigma, 1e-4), crease=crease).crease
        direction = _edge_direction(normal1, normal2)
        found = _strength_along(strength, direction, centre) if np.isfinite(direction).all() else 0.0
        errors[k] = found - angle_between(normal1, normal2) if found > 0 else np.nan
    return errors


def _plane_pair(normal1: np.ndarray, normal2: np.ndarray, centre: np.ndarray, size: int, convex: bool) -> np.ndarray:
    """Depth image of the edge in which two planes through the point `centre` (x, y) meet."""
    y, x = np.mgrid[:size, :size] - centre[::-1, None, None]
    planes = [-(a * x + b * y) / c for a, b, c in (normal1, normal2)]
    return np.maximum(*planes) if convex else np.minimum(*planes)


def _edge_direction(normal1: np.ndarray, normal2: np.ndarray) -> np.ndarray:
    """Unit direction (x, y) of the image of the line in which two planes meet; NaN of planes that are parallel."""
    difference = normal1[:2] / normal1[2] - normal2[:2] / normal2[2]
    return np.array([-difference[1], difference[0]]) / np.linalg.norm(difference)


def _strength_along(strength: np.ndarray, direction: np.ndarray, centre: np.ndarray) -> float:
    """Median strength along the line through `centre` (x, y), an eighth of the image to either side."""
    reach = len(strength) // 8
    points = centre + np.arange(-reach, reach + 1)[:, None] * direction
    x, y = np.rint(points).astype(int).T
    return float(np.median(cv2.dilate(strength, np.ones((3, 3), np.uint8))[y, x]))
