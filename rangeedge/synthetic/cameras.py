"""Cameras and scanners: where the pixels of a range image look."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _check
from ..io.calibration import (
    ABW_ASPECT,
    ABW_CALIBRATIONS,
    ABW_CENTRE,
    PERCEPTRON_FIELD,
    PERCEPTRON_LASER_TO_MIRROR,
    PERCEPTRON_MIRROR_SLOPE,
    PERCEPTRON_MIRROR_TO_MIRROR,
    SCANNER_SIZE,
)
from .solids import Rays, vector


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

    def pixels(self, rows: slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates x and y of all pixels of rows, one row after the other."""
        width, height = self.size
        first, stop, _ = rows.indices(height)
        y, x = np.divmod(np.arange(width * first, width * stop), width)
        return x.astype(np.float64), y.astype(np.float64)

    def view(self) -> tuple[float, float]:
        """Width and height of what the camera sees at its working distance."""
        width, height = self.size
        origins, directions = self.rays(np.array([0.0, width - 1.0]), np.array([0.0, height - 1.0]))
        points = origins + ((self.distance - origins[:, 2]) / directions[:, 2])[:, None] * directions
        return tuple(np.abs(points[1] - points[0])[:2].tolist())


def _size(size: Any) -> tuple[int, int]:
    if not isinstance(size, Sequence) or len(size) != 2:
        raise _check.fail("size", "(width, height)", _check.described(size))
    return _check.integer("size[0]", size[0], 2), _check.integer("size[1]", size[1], 2)


@_check.public
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
    size = _size(size)
    distance = _check.number("distance", distance, 0, above=True)
    K = _check.camera_matrix("K", K).copy()
    inverse = np.linalg.inv(K)

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        directions = np.stack([x, y, np.ones_like(x)], -1) @ inverse.T
        return np.zeros_like(directions), directions

    return Camera(size, rays, {"K": K}, distance)


@_check.public
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
    size = _size(size)
    pitch = vector("pixelSize", pixelSize, 2)
    if (pitch <= 0).any():
        raise _check.fail("pixelSize", "two numbers > 0", _check.described(pixelSize))
    distance = 2 * size[0] * pitch[0] if distance is None else distance
    distance = _check.number("distance", distance, 0, above=True)

    def rays(x: np.ndarray, y: np.ndarray) -> Rays:
        zero = np.zeros_like(x)
        origins = np.stack([(x - (size[0] - 1) / 2) * pitch[0], (y - (size[1] - 1) / 2) * pitch[1], zero], -1)
        return origins, np.broadcast_to((0.0, 0.0, 1.0), origins.shape)

    return Camera(size, rays, {"pixelSize": (float(pitch[0]), float(pitch[1]))}, distance)


@_check.public
def kinectCamera() -> Camera:
    """The depth camera of a Kinect v1: 640x480, f = 525 pixels, in metres.

    kinectCamera() -> camera
    """
    return pinholeCamera(np.array([[525.0, 0, 319.5], [0, 525.0, 239.5], [0, 0, 1]]), (640, 480), 1.2)


@_check.public
def abwCamera() -> Camera:
    """The ABW structured-light scanner of Hoover et al. (1996), 512x512, second calibration, in millimetres.

    abwCamera() -> camera

    It sees depths from 772 to 1093; its pixels are 0.6 by 0.4 wide there.
    """
    focal = ABW_CALIBRATIONS[2].focal
    K = np.array([[focal, 0, ABW_CENTRE], [0, ABW_ASPECT * focal, ABW_CENTRE], [0, 0, 1]])
    return pinholeCamera(K, SCANNER_SIZE[::-1], 930.0)


@_check.public
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
