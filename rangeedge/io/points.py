"""Organized points: what the readers and writers of clouds share."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..bands import by_bands


def unorganized(why: str) -> ValueError:
    return ValueError(
        f"the cloud is unorganized ({why}): scan lines need the rows and columns it was taken in; save the organized "
        "cloud (H, W, 3) of the sensor, or its depth image"
    )


def points_of(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """(N, 3) float32 of the columns x, y and z, NaN wherever one of them is not finite."""
    names = {name.lower(): name for name in columns}
    if not {"x", "y", "z"} <= names.keys():
        raise ValueError(f"its points have no x, y and z but {', '.join(columns) or 'nothing'}")

    def seen(*axes: np.ndarray) -> np.ndarray:
        points = np.empty((len(axes[0]), 3), np.float32)
        with np.errstate(over="ignore", invalid="ignore"):
            for k, values in enumerate(axes):
                points[:, k] = values
        points[~np.isfinite(points).all(axis=1)] = np.nan
        return points

    return by_bands(seen, *(columns[names[axis]] for axis in "xyz"))


def float32(values: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        return by_bands(lambda own: own.astype(np.float32), values)


def writer_of_points(encode: Callable[[np.ndarray], bytes]) -> Callable[[np.ndarray], bytes]:
    """Of (H, W, 3) float32 points."""

    def write(src: np.ndarray) -> bytes:
        if src.ndim != 3:
            raise ValueError("points (H, W, 3); cv2.depthTo3d makes them of a depth image")
        return encode(float32(src[..., :3]))

    return write
