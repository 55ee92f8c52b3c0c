"""Organized points: what the readers and writers of clouds share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .values import float32

UNORGANIZED = "the cloud is unorganized ({}): scan lines need the rows and columns it was taken in"


def points_of(columns: dict[str, np.ndarray]) -> np.ndarray:
    """(N, 3) float32 of the columns x, y and z, NaN wherever one of them is not finite."""
    if not {"x", "y", "z"} <= columns.keys():
        raise ValueError(f"its points have no x, y and z but {', '.join(columns) or 'nothing'}")
    with np.errstate(over="ignore", invalid="ignore"):
        points = np.stack([columns[axis] for axis in "xyz"], axis=-1).astype(np.float32)
    points[~np.isfinite(points).all(axis=-1)] = np.nan
    return points


def require(data: Sequence[Any], size: int, unit: str = "bytes") -> None:
    if len(data) < size:
        raise ValueError(f"it is truncated: {len(data)} {unit} where {size} are needed")


def numbers(text: bytes, count: int) -> np.ndarray:
    words = text.split()
    if len(words) != count:
        raise ValueError(f"it holds {len(words)} values where {count} are needed")
    return np.array([float(word) for word in words])


def write_points(encode: Callable[[np.ndarray], bytes]) -> Callable[[np.ndarray], bytes]:
    def write(src: np.ndarray) -> bytes:
        if src.ndim != 3:
            raise ValueError("points (H, W, 3); cv2.depthTo3d makes them of a depth image")
        return encode(float32(src))

    return write
