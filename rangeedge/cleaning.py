"""Depths without flying pixels, without holes, and with less noise."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from . import _core
from ._check import image8, labels32s
from ._option import parsed, takes
from .constants import CLEAN_FILLED, CLEAN_REMOVED, CLEAN_SMOOTHED
from .detection import selected, thin_lines
from .edges import kernel_options, no_strength
from .flying import keep_limbs
from .forms import range_array
from .frame import Frame
from .noise import measured_frame
from .options import CLEANING, Cleaning, Growing, ScanLineParams, Selection
from .regions import seeded_regions
from .sectors import sectors_of
from .surfaces import places, relative_ordinate
from .viewpoint import distorted_rays

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import CleaningOptions


class CleanedDepth(NamedTuple):
    """What `cleanDepth` returns: a range image, and bits CLEAN_* that say what was done to each of its pixels."""

    depth: np.ndarray
    changed: np.ndarray


@takes(CLEANING)
def cleanDepth(
    src: np.ndarray,
    labels: np.ndarray | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[CleaningOptions],
) -> CleanedDepth:
    """Remove flying pixels, fill holes from the surface they lie in, and smooth the noise within surfaces.

    cleanDepth(src[, labels], *[, mask[, maxHole[, radius[, removeFlying[, K[, ...]]]]]]) -> depth, changed

    1. *Flying pixels*, between two surfaces (`flyingPixels`), are removed: they are holes.
    2. *Surfaces*, those of `segmentRegions`, are planes in inverse depth (in height on a grid), or quadratics.
    3. *Holes* up to `maxHole` wide go to the surface around them. Where two of them meet, the hole is divided along the
       line in which they do. Where they part in a jump, it goes to the farther one, which the nearer one hides from the
       light or from the second camera of the sensor. Nothing is filled across an edge.
    4. *Noise*, what a surface leaves of its pixels, is averaged over the same surface, weighted by a^(|du| + |dv|) of a
       standard deviation of `radius` pixels, so that slopes and edges stay. Where the mean over few pixels differs from
       that by more than three deviations, the surface has detail there, and that counts.

    Valid pixels on no surface are kept as they are.

    Parameters
    ----------
    src : ndarray
        Range image, as for `edgeStrength`. Holes among points stay: where their pixels look is not known. So do those
        that go on beyond the image.
    labels : (H, W) CV_32S, optional
        Surfaces to use instead of those that `segmentRegions` finds, which takes most of the time.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used; others are kept.
    {options}

    Returns
    -------
    depth : ndarray of the shape, type and unit of `src`
        Removed pixels without data are 0 among integers (the least value of the type in a `heightMap` of signed ones),
        NaN among floats, or the first value of `invalid`. Integers are rounded.
    changed : (H, W) CV_8U
        0 where a pixel is as it was; else bits: CLEAN_SMOOTHED; CLEAN_REMOVED, it was a flying pixel; CLEAN_FILLED, it
        was a hole.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    flyingPixels, segmentRegions : The first steps.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import CLEAN_FILLED, cleanDepth
    >>> noise = np.random.default_rng(0).normal(0, 0.002, (96, 128))
    >>> truth = np.full((96, 128), 1.2)
    >>> truth[:, 64:] = 1.0
    >>> depth = truth + noise
    >>> depth[40:50, 58:70] = np.nan
    >>> cleaned, changed = cleanDepth(depth, K=(150, 150, 63.5, 47.5))
    >>> bool((changed[40:50, 58:70] == CLEAN_FILLED).all()), float(np.abs(cleaned - truth)[:, :58].mean().round(3))
    (True, 0.0)
    """
    params, cleaning = parsed(options, ScanLineParams, Cleaning)
    frame = measured_frame(src, params, mask)
    values = range_array(src)[0]
    given = None if labels is None else labels32s("labels", labels, frame.shape, listed=True)
    inside = None if mask is None else image8("mask", mask, frame.shape)
    return _cleaned(values, frame, params, cleaning, given, inside)


def _cleaned(
    values: np.ndarray,
    frame: Frame,
    params: ScanLineParams,
    cleaning: Cleaning,
    given: np.ndarray | None,
    inside: np.ndarray | None,
) -> CleanedDepth:
    parts = sectors_of(frame)
    if parts:
        whole = CleanedDepth(np.empty_like(values), np.empty(frame.shape, np.uint8))
        for part in parts:
            own = (None if a is None else part.take(a) for a in (given, inside))
            for all_values, found in zip(
                whole, _cleaned(part.take(values), part.frame, params, cleaning, *own), strict=True
            ):
                part.put(all_values, found)
        return whole
    flying = np.zeros(frame.shape, np.uint8)
    edges = _edges_and_flying(frame, params, flying) if given is None or cleaning.removeFlying else None
    if not cleaning.removeFlying:
        flying[:] = 0
    kept = _without(frame, flying > 0)
    if given is None:
        found = seeded_regions(kept, edges, Growing())[1]
    else:
        found = np.where(kept.valid > 0, np.maximum(given, 0), 0).astype(np.int32)
    flies = flying > 0
    if values.ndim == 3:
        points = _smoothed_points(frame, params, found, flies, cleaning.radius)
        return _delivered(values, points, np.isfinite(points[..., 0]), flies, frame, params, cleaning)
    missing = kept.valid == 0
    if inside is not None:
        missing &= inside != 0
    ordinate = _smoothed(frame, params, found, _narrow(missing, cleaning.maxHole), flies, cleaning.radius)
    lengths = _lengths(values, ordinate, frame, params)
    return _delivered(values, lengths, np.isfinite(ordinate), flies, frame, params, cleaning)


def _edges_and_flying(frame: Frame, params: ScanLineParams, flying: np.ndarray) -> np.ndarray:
    """The edges, thin, and in `flying` 255 where pixels fly: both by one approximation of the scan lines."""
    strength = no_strength(frame.shape)
    _core.edge_strength_and_flying(frame.kernel, kernel_options(frame, params), frame.threads, *strength, flying)
    keep_limbs(frame, params, flying)
    return thin_lines(frame, selected(frame, strength, Selection()))


def _without(frame: Frame, removed: np.ndarray) -> Frame:
    if not removed.any():
        return frame
    samples = frame.samples.copy()
    samples[removed] = np.nan
    return replace(frame, samples=samples)


def _narrow(missing: np.ndarray, most: int) -> np.ndarray:
    """Where no disc of diameter `most` fits into what is missing; there is nothing around the image."""
    if most == 0 or not missing.any():
        return np.zeros(missing.shape, np.uint8)
    around = np.pad(missing, most, constant_values=True)
    reach = most / 2 + 0.5  # from centres of pixels to those of pixels with data
    middles = _distance(around) > reach
    if not middles.any():
        return missing.view(np.uint8)
    return (missing & (_distance(~middles) > reach)[most:-most, most:-most]).view(np.uint8)


def _distance(where: np.ndarray) -> np.ndarray:
    """From every pixel of `where` to the nearest other one; infinite if there is none."""
    if where.all():
        return np.full(where.shape, np.inf)
    return cv2.distanceTransform(where.view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


def _smoothed(
    frame: Frame, params: ScanLineParams, labels: np.ndarray, holes: np.ndarray, flying: np.ndarray, radius: float
) -> np.ndarray:
    """The ordinate along the axis of every pixel that lies on a surface, NaN elsewhere."""
    measured, offset, _ = relative_ordinate(frame)
    relative = np.where(flying, np.float32(np.nan), measured)
    mixed = np.where(flying, measured, np.float32(np.nan))
    x, y, _ = places(frame)
    if x is not None and params.distCoeffs is not None:
        rays = distorted_rays(params.K, params.distCoeffs, frame.shape) * params.K[0, 0]
        x, y = (np.ascontiguousarray(rays[..., k], np.float32) for k in (0, 1))
    zero = -offset if frame.projective else -np.inf
    smoothed = np.empty(frame.shape, np.float32)
    count = int(labels.max()) + 1
    _core.clean_surfaces(relative, x, y, holes, mixed, count, zero, max(radius, 0.01), frame.threads, labels, smoothed)
    return smoothed.astype(np.float64) + offset


def _smoothed_points(
    frame: Frame, params: ScanLineParams, labels: np.ndarray, flying: np.ndarray, radius: float
) -> np.ndarray:
    """(H, W, 3) points moved along their lines of sight onto surfaces, NaN elsewhere."""
    ordinate = _smoothed(frame, params, labels, np.zeros(frame.shape, np.uint8), flying, radius)
    which = np.isfinite(ordinate) & (frame.valid > 0)
    points, axis = frame.samples[which].astype(np.float64), np.asarray(frame.axis)
    along = points @ axis
    if frame.projective:
        points *= (1 / (ordinate[which] * along))[:, None]
    else:
        points += (-ordinate[which] - along)[:, None] * axis
    moved = np.full((*frame.shape, 3), np.nan)
    moved[which] = points + np.asarray(frame.origin)
    return moved


def _lengths(values: np.ndarray, ordinate: np.ndarray, frame: Frame, params: ScanLineParams) -> np.ndarray:
    """What an image of the type of `values` holds for ordinates."""
    with np.errstate(divide="ignore", invalid="ignore"):
        lengths = 1 / ordinate if frame.projective else ordinate * (1 if frame.heightMap else -1)
    if values.dtype.kind == "f":
        return lengths
    info = np.iinfo(values.dtype)
    return np.clip(np.rint(np.nan_to_num(lengths) * params.depthFactor), info.min + 1, info.max)


def _delivered(
    values: np.ndarray,
    new: np.ndarray,
    known: np.ndarray,
    flying: np.ndarray,
    frame: Frame,
    params: ScanLineParams,
    cleaning: Cleaning,
) -> CleanedDepth:
    """The image with its `new` values where these are `known` and wanted."""
    there = (frame.valid > 0) & ~flying
    smoothed, filled = known & there & (cleaning.radius > 0), known & ~there
    depth = values.copy()
    lengths = depth[..., :3] if depth.ndim == 3 else depth
    lengths[smoothed | filled] = new[smoothed | filled]
    lengths[flying & ~filled] = _no_data(values, params)
    changed = CLEAN_SMOOTHED * smoothed + CLEAN_REMOVED * flying + CLEAN_FILLED * filled
    return CleanedDepth(depth, changed.astype(np.uint8))


def _no_data(values: np.ndarray, params: ScanLineParams) -> float:
    """What marks a pixel without data."""
    single = [low for low, high in params.invalid or () if low == high]
    if single:
        return single[0]
    if values.dtype.kind == "f":
        return np.nan
    return np.iinfo(values.dtype).min if params.heightMap else 0
