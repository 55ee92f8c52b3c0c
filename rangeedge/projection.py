"""Depth to points and back."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ._check import array, fail
from ._option import parsed, takes
from .bands import bands, by_bands
from .frame import Frame, read_frame
from .options import GEOMETRY, ScanLineParams

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import GeometryOptions

_ONE_PIXEL = np.zeros((1, 1))


@takes(GEOMETRY)
def backproject(src: np.ndarray, *, mask: np.ndarray | None = None, **options: Unpack[GeometryOptions]) -> np.ndarray:
    """Turn a range image into the points that its pixels see.

    backproject(src, *[, mask[, K[, pixelSize[, heightMap[, depthFactor]]]]]) -> points

    With a camera (x, y, z) = z K^-1 (u, v, 1), u being the column, v the row and z the depth of a pixel; on a grid
    (x, y, z) = (u dx, v dy, value).

    Parameters
    ----------
    src : ndarray
        (H, W) depth or height, or points (H, W, 3) or (H, W, 4), as in `edgeStrength`: of points invalid ones become
        NaN.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    {options}

    Returns
    -------
    points : ndarray of shape (H, W, 3), CV_64F
        In the unit of the image; x goes right, y down, and z away from a camera. NaN where a pixel is invalid.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    project : The way back.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import backproject
    >>> depth = np.array([[1000, 2000, 0]], np.uint16)
    >>> backproject(depth, K=[[500, 0, 1], [0, 500, 0], [0, 0, 1]])[0].tolist()
    [[-0.002, 0.0, 1.0], [0.0, 0.0, 2.0], [nan, nan, nan]]
    """
    (params,) = parsed(options, ScanLineParams)
    frame = read_frame(src, params, mask)
    if params.K is None or (src.dtype.kind == "f" and src.dtype.itemsize > 4):
        return _without_invalid(frame)
    factor = params.depthFactor if src.dtype.kind in "iu" else 1.0

    def points(v: np.ndarray, src: np.ndarray, valid: np.ndarray) -> np.ndarray:
        # Not by way of the inverse, which float32 would round.
        depth = np.divide(src, factor, dtype=np.float64)
        depth[valid == 0] = np.nan
        return np.stack([*frame.places(v), np.ones(depth.shape)], axis=-1) * depth[..., None]

    return by_bands(points, frame.rows, src, frame.valid)


def _without_invalid(frame: Frame) -> np.ndarray:
    points = frame.points
    for rows in bands(points):
        points[rows][frame.valid[rows] == 0] = np.nan
    return points


@takes(GEOMETRY)
def project(points: np.ndarray, **options: Unpack[GeometryOptions]) -> np.ndarray:
    """Find the pixels at which points are seen, and their depths.

    project(points, *[, K[, pixelSize[, heightMap[, depthFactor]]]]) -> pixels

    With a camera (u, v, 1) ~ K (x, y, z) and the value is z; on a grid (u, v) = (x / dx, y / dy) and the value is z.

    Parameters
    ----------
    points : ndarray of shape (..., 3) of real numbers
        In the unit of the image, as `backproject` returns them.
    {options}

    Returns
    -------
    pixels : ndarray of shape (..., 3), CV_64F
        Column and row as fractions of pixels, which may lie outside the image, and the depth or height: that in the
        unit of the points, also of images of integers. NaN where a coordinate is, and where a point lies at or behind
        the plane of the camera.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    backproject : The way there.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import project
    >>> project(np.array([[-0.002, 0.0, 1.0], [0.0, 0.0, 2.0]]), K=[[500, 0, 1], [0, 500, 0], [0, 0, 1]]).tolist()
    [[0.0, 0.0, 1.0], [1.0, 0.0, 2.0]]
    """
    expected = "an array of shape (..., 3) of real numbers"
    points = array("points", points, expected, ndim=range(1, 9))
    if points.shape[-1] != 3:
        raise fail("points", expected, f"one of shape {points.shape}")
    (params,) = parsed(options, ScanLineParams)
    frame = read_frame(_ONE_PIXEL, replace(params, imageSize=None))
    rows = points.reshape(-1, 3)
    return by_bands(lambda own: to_pixels(own.astype(np.float64), frame), rows).reshape(points.shape)


def to_pixels(points: np.ndarray, frame: Frame) -> np.ndarray:
    """Column, row and depth or height of (..., 3) points, in an image that has a camera matrix or a grid."""
    a, b, c, d, e, f = frame.to_plane
    inverse = np.linalg.inv([[a, b, c], [d, e, f], [0.0, 0.0, 1.0]])
    value = points[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        place = points[..., :2] / np.where(value > 0, value, np.nan)[..., None] if frame.projective else points[..., :2]
    pixels = np.concatenate([place @ inverse[:2, :2].T + inverse[:2, 2], value[..., None]], axis=-1)
    pixels[~np.isfinite(pixels).all(axis=-1)] = np.nan
    return pixels
