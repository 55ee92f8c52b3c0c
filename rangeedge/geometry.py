"""From a range image in any of its forms to the coordinates in which scan lines are plane curves (P§4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np

from . import _core
from ._args import array, boolean, camera_matrix, described, fail, image8, number, pixel_size

THREAD_PIXELS = 1 << 14  # an image smaller than this is not worth a second thread
SRC = "a depth image of shape (H, W), or points of shape (H, W, 3) or (H, W, 4)"


@dataclass(frozen=True)
class RangeFrame:
    """A range image as the kernels take it: invalid pixels are NaN, ordinates grow toward the viewer.

    `samples` holds inverse depth (`projective`) or height of shape (H, W), or points of shape (H, W, 3).
    `to_plane` takes (column, row, 1) to normalised image coordinates or to lengths; `axis` is the viewing direction.
    """

    samples: np.ndarray
    projective: bool
    to_plane: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)

    @property
    def shape(self) -> tuple[int, int]:
        return self.samples.shape[:2]

    @property
    def threads(self) -> int:
        """How many threads the image is worth."""
        return cv2.getNumThreads() if self.shape[0] * self.shape[1] >= THREAD_PIXELS else 1

    @cached_property
    def ordinate(self) -> np.ndarray:
        """Inverse depth or height of every pixel, NaN where invalid."""
        if self.samples.ndim == 2:
            return self.samples
        along = self.samples @ np.asarray(self.axis, self.samples.dtype)
        if not self.projective:
            return -along
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(along > 0, 1 / along, np.nan).astype(self.samples.dtype)

    @cached_property
    def valid(self) -> np.ndarray:
        """uint8, 1 where a pixel has data."""
        return np.isfinite(self.ordinate).view(np.uint8)

    @cached_property
    def depth(self) -> np.ndarray:
        """Distance along the viewing axis, NaN where invalid."""
        return 1 / self.ordinate if self.projective else -self.ordinate

    @property
    def kernel_args(self) -> tuple[Any, ...]:
        """What every kernel on scan lines takes first."""
        return self.samples, self.projective, self.to_plane, self.axis


def range_frame(
    func: str,
    src: np.ndarray,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
) -> RangeFrame:
    """Check `src` and its geometry once, and bring them to one form."""
    src = array(func, "src", src, SRC, ndim=(2, 3))
    heightMap = boolean(func, "heightMap", heightMap)
    depthFactor = number(func, "depthFactor", depthFactor, 0, above=True)
    if K is not None and pixelSize is not None:
        raise fail(func, "pixelSize", "None where K is given", described(pixelSize))
    if K is not None and heightMap:
        raise fail(func, "heightMap", "False where K is given (its values are depths)", heightMap)
    inside = None if mask is None else image8(func, "mask", mask, src.shape[:2]) != 0
    if src.ndim == 3:
        return _points(func, src, inside, K, pixelSize, heightMap)
    if heightMap and src.dtype.kind == "i":
        expected = "heights as floats (or unsigned integers, 0 for no data) where heightMap is True"
        raise fail(func, "src", expected, described(src), cv2.Error.StsUnsupportedFormat)
    if K is not None:
        return _pinhole(func, src, depthFactor, inside, camera_matrix(func, "K", K))
    spacing = (1.0, 1.0) if pixelSize is None else pixel_size(func, "pixelSize", pixelSize)
    frame = _grid(_lengths(func, src, depthFactor), spacing, heightMap)
    if inside is None:
        return frame
    samples = frame.samples.copy() if np.shares_memory(frame.samples, src) else frame.samples
    samples[~inside] = np.nan
    return RangeFrame(samples, frame.projective, frame.to_plane, frame.axis)


def _lengths(func: str, src: np.ndarray, depthFactor: float) -> np.ndarray:
    """Values as float lengths, invalid integers as NaN; float32 and float64 arrays are passed on unchanged."""
    if src.dtype.kind == "f":
        return np.ascontiguousarray(src, dtype=np.float64 if src.dtype.itemsize > 4 else np.float32)
    if src.dtype.kind == "b":
        raise fail(func, "src", SRC + " of numbers", described(src), cv2.Error.StsUnsupportedFormat)
    real = np.float32 if src.dtype.itemsize <= 2 else np.float64
    lengths = np.divide(src, real(depthFactor), dtype=real, order="C")
    lengths[src <= 0] = np.nan
    return lengths


def _pinhole(func: str, src: np.ndarray, depthFactor: float, inside: np.ndarray | None, K: np.ndarray) -> RangeFrame:
    # The kernel divides by the factor what depth cameras give; other integers are divided here.
    depth = np.ascontiguousarray(src) if src.dtype == np.uint16 else _lengths(func, src, depthFactor)
    inverse = np.empty(depth.shape, np.float32 if depth.dtype == np.uint16 else depth.dtype)
    _core.invert_depth(depth, depthFactor, None if inside is None else inside.view(np.uint8), inverse)
    return RangeFrame(inverse, True, tuple(np.linalg.inv(K)[:2].ravel().tolist()))


def _grid(values: np.ndarray, spacing: tuple[float, float], heightMap: bool) -> RangeFrame:
    height = values if heightMap else -values
    infinite = np.isinf(height)
    if infinite.any():
        height = np.where(infinite, height.dtype.type(np.nan), height)
    return RangeFrame(height, False, (spacing[0], 0.0, 0.0, 0.0, spacing[1], 0.0))


def _points(
    func: str, src: np.ndarray, inside: np.ndarray | None, K: Any, pixelSize: Any, heightMap: bool
) -> RangeFrame:
    if src.shape[2] not in (3, 4) or src.dtype.kind != "f":
        raise fail(func, "src", SRC + ", points being floats", described(src), cv2.Error.StsUnsupportedFormat)
    for name, value in (("K", K), ("pixelSize", pixelSize)):
        if value is not None:
            raise fail(func, name, "None where src holds points", described(value))
    dtype = np.float64 if src.dtype.itemsize > 4 else np.float32
    points = np.array(src[..., :3], dtype=dtype, order="C")
    # Three zeros are what cameras write where they see nothing.
    points[~np.isfinite(points).all(axis=2) | (points == 0).all(axis=2)] = np.nan
    if inside is not None:
        points[~inside] = np.nan
    if heightMap:
        return RangeFrame(points, False, axis=(0.0, 0.0, -1.0))
    central = points[np.isfinite(points[..., 2])].astype(np.float64)
    if not len(central) or not _is_projective(points):
        return RangeFrame(points, False)
    axis = _viewing_axis(central)
    with np.errstate(invalid="ignore"):
        points[~(points @ np.asarray(axis, dtype) > 0)] = np.nan
    return RangeFrame(points, True, axis=axis)


def _viewing_axis(points: np.ndarray) -> tuple[float, ...]:
    """The z axis where all points lie before it, else the mean of their rays."""
    if points[:, 2].min() > 0:
        return 0.0, 0.0, 1.0
    axis = (points / np.linalg.norm(points, axis=1, keepdims=True)).mean(axis=0)
    length = np.linalg.norm(axis)
    return tuple((axis / length).tolist()) if length > 0.1 else (0.0, 0.0, 1.0)


def _is_projective(points: np.ndarray) -> bool:
    """Whether rows and columns lie in planes through the origin rather than in planes along the z axis."""
    z = np.array([0.0, 0.0, 1.0])
    through_origin, along_axis = [], []
    height, width = points.shape[:2]
    lines = [points[v] for v in np.unique(np.linspace(0, height - 1, 16).astype(int))]
    lines += [points[:, u] for u in np.unique(np.linspace(0, width - 1, 16).astype(int))]
    for line in lines:
        line = line[np.isfinite(line[:, 0])].astype(np.float64)
        if len(line) < 3:
            continue
        for normal, found in (
            (np.cross(line[0], line[-1]), through_origin),
            (np.cross(z, line[-1] - line[0]), along_axis),
        ):
            length = np.linalg.norm(normal)
            offset = (line - line[0]) @ normal
            found.append(np.sqrt(np.mean(offset**2)) / length if length > 0 else 0.0)
    return not along_axis or np.median(through_origin) <= np.median(along_axis)
