"""From a range image in any of its forms to the coordinates in which scan lines are plane curves (paper, 4.1)."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from . import _core
from ._check import array, described, error, fail, image8
from .noise_model import WHITE, NoiseModel
from .options import ScanLineParams

_THREAD_PIXELS = 1 << 14  # an image smaller than this is not worth a second thread
SRC = "a depth image of shape (H, W), or points of shape (H, W, 3) or (H, W, 4)"


def threads_worth(pixels: int) -> int:
    """How many threads an image of so many pixels is worth."""
    return cv2.getNumThreads() if pixels >= _THREAD_PIXELS else 1


@dataclass(frozen=True)
class Frame:
    """A range image as the kernels take it: invalid pixels are NaN, ordinates grow toward the viewer.

    `samples` holds inverse depth (`projective`) or height of shape (H, W), or points of shape (H, W, 3). `to_plane`
    takes (column, row, 1) to normalised image coordinates or to lengths; `axis` is the viewing direction; `heightMap`
    says that heights grow toward the viewer in the image, too; `spaced` that the spacing of pixels is known in the unit
    of the values, which on a grid 1 does not say. `step` is the length to whose multiples the values were rounded, 0 if
    none is known. `noise` is a model or a map of deviations.
    """

    samples: np.ndarray
    projective: bool
    to_plane: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    heightMap: bool = False
    spaced: bool = True
    step: float = 0.0
    noise: NoiseModel | np.ndarray | None = None

    @property
    def shape(self) -> tuple[int, int]:
        return self.samples.shape[:2]

    @property
    def threads(self) -> int:
        """How many threads the image is worth."""
        return threads_worth(self.shape[0] * self.shape[1])

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
    def points(self) -> np.ndarray:
        """(H, W, 3) coordinates of every pixel, NaN where invalid."""
        if self.samples.ndim == 3:
            return self.samples.astype(np.float64)
        v, u = np.indices(self.shape)
        a, b, c, d, e, f = self.to_plane
        x, y = a * u + b * v + c, d * u + e * v + f
        if not self.projective:
            return np.stack([x, y, self.ordinate if self.heightMap else -self.ordinate], axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = 1 / self.ordinate.astype(np.float64)
        return np.stack([x * z, y * z, z], axis=-1)

    @property
    def toward_viewer(self) -> np.ndarray | None:
        """The direction toward the viewer; None where it is that of the origin."""
        if self.projective:
            return None
        if self.samples.ndim == 3:
            return -np.asarray(self.axis)
        return np.array([0.0, 0.0, 1.0 if self.heightMap else -1.0])

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): directions of x and y on the plane of the image and of the depth, as rows, in which points are given.

        As scan lines of points have them: x lies along that of the points as far as the direction of view lets it.
        """
        if self.samples.ndim == 2:
            return np.diag([1.0, 1.0, -1.0 if self.heightMap else 1.0])
        axis = np.asarray(self.axis)
        right = np.array([1.0, 0.0, 0.0]) - axis[0] * axis
        length = np.linalg.norm(right)
        right = right / length if length > 0 else np.array([0.0, 1.0, 0.0])
        return np.stack([right, np.cross(axis, right), axis])

    def with_noise(self, noise: NoiseModel | float | np.ndarray) -> Frame:
        """The same image with its noise, which must be positive at every valid pixel."""
        if isinstance(noise, np.ndarray):
            expected = f"a number, a NoiseModel, or a real array of shape {self.shape}, > 0 at valid pixels"
            if noise.shape != self.shape:
                raise fail("noise", expected, described(noise), cv2.Error.StsBadSize)
            if not np.all((noise > 0) & np.isfinite(noise), where=self.valid > 0):
                raise error(f"`noise` must be {expected}", cv2.Error.StsOutOfRange)
        elif not isinstance(noise, NoiseModel):
            noise = NoiseModel(a=noise)
        elif min(noise.a, noise.b, noise.c) < 0 and not (noise(np.abs(self.depth[self.valid > 0])) > 0).all():
            raise fail("noise", "a model that is positive at every depth of the image", noise)
        measured = copy(self)  # with what has been computed already
        object.__setattr__(measured, "noise", noise)
        return measured

    @property
    def correlation(self) -> float:
        """How much larger the noise is over several pixels than between neighbours."""
        return 1.0 if isinstance(self.noise, np.ndarray) else self.noise.correlation

    @cached_property
    def kernel(self) -> _core.Frame:
        """The image with its noise as every kernel takes it."""
        if isinstance(self.noise, np.ndarray):
            noise = _core.Noise(0.0, 0.0, 0.0, WHITE, self.noise)
        else:
            noise = _core.Noise(self.noise.a, self.noise.b, self.noise.c, self.noise.of_fits())
        return _core.Frame(self.samples, self.projective, self.to_plane, self.axis, noise)


def read_frame(src: np.ndarray, params: ScanLineParams, mask: np.ndarray | None = None) -> Frame:
    """Bring a range image to the form that kernels take; its noise comes later."""
    src = array("src", src, SRC, ndim=(2, 3))
    K, pixelSize, heightMap = params.K, params.pixelSize, params.heightMap
    if K is not None and pixelSize is not None:
        raise fail("pixelSize", "None where K is given", described(pixelSize))
    if K is not None and heightMap:
        raise fail("heightMap", "False where K is given (its values are depths)", heightMap)
    inside = None if mask is None else image8("mask", mask, src.shape[:2]) != 0
    if src.ndim == 3:
        for name in ("K", "pixelSize"):
            if getattr(params, name) is not None:
                raise fail(name, "None where src holds points", described(getattr(params, name)))
        return _points(src, inside, heightMap)
    if K is not None:
        return _pinhole(src, params.depthFactor, inside, K)
    return _grid(src, params.depthFactor, inside, pixelSize, heightMap)


def _lengths(src: np.ndarray, depthFactor: float, heightMap: bool = False) -> np.ndarray:
    """Values as float lengths, invalid integers as NaN; float32 and float64 arrays are passed on unchanged.

    Depths of 0 or less are invalid. Heights may be negative: among signed ones only the least of the type is invalid.
    """
    if src.dtype.kind == "f":
        return np.ascontiguousarray(src, dtype=np.float64 if src.dtype.itemsize > 4 else np.float32)
    if src.dtype.kind == "b":
        raise fail("src", SRC + " of numbers", described(src), cv2.Error.StsUnsupportedFormat)
    real = np.float32 if src.dtype.itemsize <= 2 else np.float64
    lengths = np.divide(src, real(depthFactor), dtype=real, order="C")
    lengths[src <= (np.iinfo(src.dtype).min if heightMap else 0)] = np.nan
    return lengths


def _step(src: np.ndarray, depthFactor: float) -> float:
    """The length of one unit of integers."""
    return 1 / depthFactor if src.dtype.kind in "iu" else 0.0


def _pinhole(src: np.ndarray, depthFactor: float, inside: np.ndarray | None, K: np.ndarray) -> Frame:
    # The kernel divides by the factor what depth cameras give; other integers are divided here.
    depth = np.ascontiguousarray(src) if src.dtype == np.uint16 else _lengths(src, depthFactor)
    inverse = np.empty(depth.shape, np.float32 if depth.dtype == np.uint16 else depth.dtype)
    _core.invert_depth(depth, depthFactor, None if inside is None else inside.view(np.uint8), inverse)
    return Frame(inverse, True, tuple(np.linalg.inv(K)[:2].ravel().tolist()), step=_step(src, depthFactor))


def _grid(
    src: np.ndarray,
    depthFactor: float,
    inside: np.ndarray | None,
    pixelSize: tuple[float, float] | None,
    heightMap: bool,
) -> Frame:
    values = _lengths(src, depthFactor, heightMap)
    height = values if heightMap else -values
    infinite = np.isinf(height)
    if infinite.any():
        height = np.where(infinite, height.dtype.type(np.nan), height)
    if inside is not None:
        height = height.copy() if np.shares_memory(height, src) else height
        height[~inside] = np.nan
    dx, dy = pixelSize or (1.0, 1.0)
    to_plane, spaced = (dx, 0.0, 0.0, 0.0, dy, 0.0), (dx, dy) != (1.0, 1.0)
    return Frame(height, False, to_plane, heightMap=heightMap, spaced=spaced, step=_step(src, depthFactor))


def _points(src: np.ndarray, inside: np.ndarray | None, heightMap: bool) -> Frame:
    if src.shape[2] not in (3, 4) or src.dtype.kind != "f":
        raise fail("src", SRC + ", points being floats", described(src), cv2.Error.StsUnsupportedFormat)
    dtype = np.float64 if src.dtype.itemsize > 4 else np.float32
    points = np.array(src[..., :3], dtype=dtype, order="C")
    # Three zeros are what cameras write where they see nothing.
    points[~np.isfinite(points).all(axis=2) | (points == 0).all(axis=2)] = np.nan
    if inside is not None:
        points[~inside] = np.nan
    if heightMap:
        return Frame(points, False, axis=(0.0, 0.0, -1.0), heightMap=True)
    central = points[np.isfinite(points[..., 2])].astype(np.float64)
    if not len(central) or not _is_projective(points):
        return Frame(points, False)
    axis = _viewing_axis(central)
    with np.errstate(invalid="ignore"):
        points[~(points @ np.asarray(axis, dtype) > 0)] = np.nan
    return Frame(points, True, axis=axis)


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
