"""From a range image in any of its forms to the coordinates in which scan lines are plane curves (paper, 4.1)."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from . import _core
from ._check import described, error, fail, image8
from .bands import bands, by_bands
from .forms import SRC, range_array
from .noise_model import WHITE, NoiseModel
from .options import ScanLineParams
from .plausible import warn_of_dropped
from .sectors import Turn, turn_of
from .viewpoint import distorted_rays, view_of

_THREAD_PIXELS = 1 << 14  # an image smaller than this is not worth a second thread


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
    none is known. `curved` says that the rays of a scan line need not lie in a plane, `ranges` that depths are measured
    along the rays and not along `axis`; `origin` is the viewpoint in the frame in which points came, and zero in that
    of `samples`. `noise` is a model or a map of deviations.
    """

    samples: np.ndarray
    projective: bool
    to_plane: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    heightMap: bool = False
    spaced: bool = True
    step: float = 0.0
    curved: bool = False
    ranges: bool = False
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: NoiseModel | np.ndarray | None = None

    @property
    def shape(self) -> tuple[int, int]:
        return self.samples.shape[:2]

    @property
    def unit(self) -> str:
        """Of lengths, where it is known: integers and `depthFactor` 1000 are millimetres, lengths metres then."""
        return "m" if self.step == 1 / 1000 else ""

    @property
    def threads(self) -> int:
        """How many threads the image is worth."""
        return threads_worth(self.shape[0] * self.shape[1])

    @cached_property
    def turn(self) -> Turn | None:
        """How far the image looks around, where that is too far for one axis of view."""
        return turn_of(self.samples) if self.ranges else None

    @property
    def seam(self) -> int | None:
        """The axis along which first and last line are neighbours: 1 where rows wrap; None where there is none."""
        return self.turn.axis if self.turn and self.turn.closed else None

    @cached_property
    def ordinate(self) -> np.ndarray:
        """Inverse depth or height of every pixel, NaN where invalid."""
        if self.samples.ndim == 2:
            return self.samples
        return by_bands(self._ordinate_of, self.samples)

    def _ordinate_of(self, points: np.ndarray) -> np.ndarray:
        if self.ranges:
            return 1 / np.linalg.norm(points, axis=2)
        along = points @ np.asarray(self.axis, points.dtype)
        if not self.projective:
            return -along
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(along > 0, 1 / along, np.nan).astype(points.dtype)

    @cached_property
    def valid(self) -> np.ndarray:
        """uint8, 1 where a pixel has data."""
        return by_bands(np.isfinite, self.ordinate).view(np.uint8)

    @cached_property
    def depth(self) -> np.ndarray:
        """Distance along the viewing axis, NaN where invalid."""
        return by_bands(lambda own: 1 / own if self.projective else -own, self.ordinate)

    @cached_property
    def points(self) -> np.ndarray:
        """(H, W, 3) coordinates of every pixel, NaN where invalid."""
        if self.samples.ndim == 3:
            return by_bands(lambda own: own + np.asarray(self.origin, np.float64), self.samples)
        return by_bands(self._points_of, self.rows, self.ordinate)

    def _points_of(self, v: np.ndarray, ordinate: np.ndarray) -> np.ndarray:
        x, y = self.places(v)
        if not self.projective:
            return np.stack([x, y, ordinate if self.heightMap else -ordinate], axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = 1 / ordinate.astype(np.float64)
        return np.stack([x * z, y * z, z], axis=-1)

    @property
    def rows(self) -> np.ndarray:
        """The number of every row, (H, 1)."""
        return np.arange(self.shape[0])[:, None]

    def places(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The coordinates x and y of the pixels of some `rows` on the plane of the image."""
        u = np.arange(self.shape[1])
        a, b, c, d, e, f = self.to_plane
        return a * u + b * v + c, d * u + e * v + f

    def toward_viewer(self, points: np.ndarray) -> np.ndarray:
        """The directions toward the viewer from points (..., 3)."""
        if self.projective:
            return np.asarray(self.origin) - points
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
        return _core.Frame(self.samples, self.projective, self.to_plane, self.axis, self.curved, self.ranges, noise)


def read_frame(src: np.ndarray, params: ScanLineParams, mask: np.ndarray | None = None) -> Frame:
    """Bring a range image to the form that kernels take; its noise comes later."""
    src, seen = checked(src, params)
    if mask is not None:
        inside = image8("mask", mask, src.shape[:2]) != 0
        seen = inside if seen is None else seen & inside
    if params.invalid is not None:
        found = _holds(src, params.invalid)
        if found.any():
            seen = ~found if seen is None else seen & ~found
    if src.ndim == 3:
        return _points(src, seen, params)
    if params.K is not None:
        return _pinhole(src, seen, params)
    return _grid(src, seen, params)


def checked(src: np.ndarray, params: ScanLineParams) -> tuple[np.ndarray, np.ndarray | None]:
    """A range image as an array, and where it is not masked; options that fit neither it nor each other are refused."""
    src, seen = range_array(src)
    points = src.ndim == 3
    if points and (src.shape[2] not in (3, 4) or src.dtype.kind != "f"):
        raise fail("src", SRC + ", points being floats", described(src), cv2.Error.StsUnsupportedFormat)
    if src.dtype.kind == "b":
        raise fail("src", SRC + " of numbers", described(src), cv2.Error.StsUnsupportedFormat)
    K, pixelSize = params.K, params.pixelSize
    if K is not None and pixelSize is not None:
        raise fail("pixelSize", "None where K is given", described(pixelSize))
    if K is not None and params.heightMap:
        raise fail("heightMap", "False where K is given (its values are depths)", params.heightMap)
    if K is None and params.distCoeffs is not None:
        raise fail("distCoeffs", "None where K is not given", described(params.distCoeffs))
    if K is None and params.imageSize is not None:
        raise fail("imageSize", "None where K is not given", described(params.imageSize))
    if params.imageSize is not None and params.imageSize != (src.shape[1], src.shape[0]):
        raise _other_size(src.shape, params.imageSize)
    for name in ("K", "pixelSize") if points else ("origin",):
        if getattr(params, name) is not None:
            form = "points" if points else "no points"
            raise fail(name, f"None where src holds {form}", described(getattr(params, name)))
    if params.origin is not None and params.heightMap:
        raise fail("origin", "None where heightMap is given (its lines of sight are parallel)", params.origin)
    return src, seen


def _other_size(shape: tuple[int, ...], size: tuple[int, int]) -> Exception:
    """What to say of an image that K does not hold for."""
    (width, height), (own_width, own_height) = size, (shape[1], shape[0])
    x, y = own_width / width, own_height / height
    return error(
        f"`src` has {own_width} x {own_height} pixels, but K holds for {width} x {height}: where the image was resized,"
        f" give (x fx, y fy, x (cx + 0.5) - 0.5, y (cy + 0.5) - 0.5) with x = {x:.6g} and y = {y:.6g}; where it was"
        " cropped, subtract its first column and row from cx and cy; or say by imageSize what K holds for",
        cv2.Error.StsUnmatchedSizes,
    )


def _holds(src: np.ndarray, ranges: tuple[tuple[float, float], ...]) -> np.ndarray:
    """Where the image holds a value of these ranges; single values are compared in the type of the image."""
    found = np.zeros(src.shape[:2], bool)
    for low, high in ranges:
        values = src if src.ndim == 2 or low == high else src[..., 2]
        inside = values == low if low == high else (values >= low) & (values <= high)
        found |= inside if inside.ndim == 2 else inside[..., :3].all(axis=2)
    return found


def _lengths(src: np.ndarray, depthFactor: float, heightMap: bool = False) -> np.ndarray:
    """Values as float lengths, invalid integers as NaN; float32 and float64 arrays are passed on unchanged.

    Depths of 0 or less are invalid. Heights may be negative: among signed ones only the least of the type is invalid.
    """
    if src.dtype.kind == "f":
        return np.require(src, np.float64 if src.dtype.itemsize > 4 else np.float32, ["C", "A"])
    real = np.float32 if src.dtype.itemsize <= 2 else np.float64
    lengths = np.divide(src, real(depthFactor), dtype=real, order="C")
    lengths[src <= (np.iinfo(src.dtype).min if heightMap else 0)] = np.nan
    return lengths


def _step(src: np.ndarray, depthFactor: float) -> float:
    """The length of one unit of integers."""
    return 1 / depthFactor if src.dtype.kind in "iu" else 0.0


def _pinhole(src: np.ndarray, seen: np.ndarray | None, params: ScanLineParams) -> Frame:
    # The kernel divides by the factor what depth cameras give; other integers are divided here.
    factor, K = params.depthFactor, params.K
    depth = np.require(src, np.uint16, ["C", "A"]) if src.dtype == np.uint16 else _lengths(src, factor)
    inverse = np.empty(depth.shape, np.float32 if depth.dtype == np.uint16 else depth.dtype)
    _core.invert_depth(depth, factor, None if seen is None else seen.view(np.uint8), inverse)
    if params.distCoeffs is None or not params.distCoeffs.any():
        return Frame(inverse, True, tuple(np.linalg.inv(K)[:2].ravel().tolist()), step=_step(src, factor))
    rays = distorted_rays(K, params.distCoeffs, depth.shape)
    points = by_bands(lambda ray, q: ray.astype(inverse.dtype) / q[..., None], rays, inverse)
    return Frame(points, True, curved=True, step=_step(src, factor))


def _grid(src: np.ndarray, seen: np.ndarray | None, params: ScanLineParams) -> Frame:
    heightMap, pixelSize = params.heightMap, params.pixelSize
    values = _lengths(src, params.depthFactor, heightMap)
    height = values if heightMap else -values
    infinite = np.isinf(height)
    if infinite.any():
        height = np.where(infinite, height.dtype.type(np.nan), height)
    if seen is not None:
        height = height.copy() if np.shares_memory(height, src) else height
        height[~seen] = np.nan
    dx, dy = pixelSize or (1.0, 1.0)
    frame = Frame(height, False, (dx, 0.0, 0.0, 0.0, dy, 0.0), heightMap=heightMap, spaced=(dx, dy) != (1.0, 1.0))
    return replace(frame, step=_step(src, params.depthFactor))


def _points(src: np.ndarray, seen: np.ndarray | None, params: ScanLineParams) -> Frame:
    dtype = np.float64 if src.dtype.itemsize > 4 else np.float32

    def kept(src: np.ndarray, seen: np.ndarray | None) -> np.ndarray:
        points = np.array(src[..., :3], dtype=dtype, order="C")
        # Three zeros are what cameras write where they see nothing.
        points[~np.isfinite(points).all(axis=2) | (points == 0).all(axis=2)] = np.nan
        if seen is not None:
            points[~seen] = np.nan
        return points

    points = by_bands(kept, src, seen)
    if params.heightMap:
        return Frame(points, False, axis=(0.0, 0.0, -1.0), heightMap=True)
    view = view_of(points, params.origin)
    if any(view.origin):

        def moved(src: np.ndarray, points: np.ndarray) -> np.ndarray:
            relative = (src[..., :3] - np.asarray(view.origin)).astype(dtype)
            return np.ascontiguousarray(relative * np.where(np.isnan(points), np.nan, 1), dtype)

        points = by_bands(moved, src, points)
    if not view.projective:
        return Frame(points, False)
    if view.ranges:
        return Frame(points, True, axis=view.axis, curved=True, ranges=True, origin=view.origin)
    given = kept_points = 0
    for rows in bands(points):
        own = points[rows]
        given += np.count_nonzero(np.isfinite(own[..., 0]))
        with np.errstate(invalid="ignore"):
            own[~(own @ np.asarray(view.axis, dtype) > 0)] = np.nan
        kept_points += np.count_nonzero(np.isfinite(own[..., 0]))
    warn_of_dropped(given, kept_points)
    return Frame(points, True, axis=view.axis, origin=view.origin)
