"""Range images as shaded reliefs, to look at and to draw on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from .. import _check
from .._option import parsed
from ..bands import by_bands, chosen, quantiles
from ..cancellation import apart
from ..frame import read_frame
from ..options import ScanLineParams

if TYPE_CHECKING:
    from .._typed import GeometryOptions


def backdrop(src: np.ndarray, geometry: GeometryOptions, shape: tuple[int, int] | None = None) -> np.ndarray:
    """A new picture to draw on: the one given, or the subdued relief of a range image."""
    (params,) = parsed(geometry, ScanLineParams)
    if isinstance(src, np.ndarray) and src.dtype == np.uint8 and src.ndim == 3 and src.shape[2] == 3 and src.size:
        picture = src.copy()
    else:
        picture = subdued(relief_of(read_frame(src, params).depth))
    if shape is not None and picture.shape[:2] != shape:
        raise _check.fail("src", f"of shape {shape}", _check.described(src), cv2.Error.StsUnmatchedSizes)
    return picture


def relief_of(depth: np.ndarray) -> np.ndarray:
    """Depth as colour, near bright and far dark, under light from the upper left; hatched without data."""
    valid = np.isfinite(depth)
    if not valid.any():
        return hatch(depth.shape)
    low, high = quantiles(np.where(valid, depth, np.nan), 0.01, 0.99)
    depth = _filled(depth, valid)

    def painted(depth: np.ndarray, shade: np.ndarray) -> np.ndarray:
        level = np.clip((high - depth) / (high - low), 0, 1) if high > low else np.full(depth.shape, 0.5)
        colour = cv2.applyColorMap(np.rint(255 * level).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
        return np.rint(colour * shade[..., np.newaxis]).astype(np.uint8)

    return hatched(by_bands(painted, depth, _shade(depth, valid)), valid)


def _shade(depth: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Light that a surface of this depth reflects, in [0.25, 1]; steepness relative to the image's own slopes."""
    smooth = cv2.GaussianBlur(depth.astype(np.float32), (0, 0), 1.5)
    dx, dy = cv2.Scharr(smooth, cv2.CV_32F, 1, 0), cv2.Scharr(smooth, cv2.CV_32F, 0, 1)
    slope = by_bands(np.hypot, dx, dy)
    typical = 2 * np.float32(quantiles(np.where(valid, slope, np.float32(np.nan)), 0.75)[0]) or 1.0

    def light(slope: np.ndarray, dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
        cosine = (0.52 * typical - 0.6 * dx - 0.6 * dy) / np.hypot(slope, typical)
        return np.clip(0.3 + 0.75 * cosine, 0.25, 1)

    return by_bands(light, slope, dx, dy)


def _filled(depth: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Depth with every gap filled from the nearest valid pixel."""
    values = np.concatenate(list(chosen(depth, valid)))
    return by_bands(lambda number: values[number], nearest(valid))


def nearest(inside: np.ndarray) -> np.ndarray:
    """For every pixel, which of the pixels inside, counted row by row, is nearest."""
    outside = (~inside).view(np.uint8)
    kind = {"distanceType": cv2.DIST_L2, "maskSize": cv2.DIST_MASK_5, "labelType": cv2.DIST_LABEL_PIXEL}
    _, labels = apart(inside.size, cv2.distanceTransformWithLabels, outside, **kind)
    rank = np.zeros(labels.max() + 1, np.intp)
    count = 0
    for own in chosen(labels, inside):
        rank[own] = np.arange(count, count + len(own))
        count += len(own)
    return by_bands(lambda own: rank[own], labels)


def hatch(shape: tuple[int, int]) -> np.ndarray:
    return by_bands(lambda row: _hatched_rows(row, shape[1]), np.arange(shape[0])[:, None])


def hatched(picture: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """The picture where it is valid."""

    def shown(row: np.ndarray, picture: np.ndarray, valid: np.ndarray) -> np.ndarray:
        return np.where(valid[..., np.newaxis], picture, _hatched_rows(row, valid.shape[1]))

    return by_bands(shown, np.arange(len(valid))[:, None], picture, valid)


def _hatched_rows(row: np.ndarray, width: int) -> np.ndarray:
    dark = np.where((row + np.arange(width)) % 8 < 2, np.uint8(72), np.uint8(36))
    return dark[..., np.newaxis].repeat(3, axis=2)


def subdued(picture: np.ndarray) -> np.ndarray:
    """Darker and nearly grey, so that what is drawn on it stands out."""
    grey = cv2.cvtColor(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return cv2.addWeighted(picture, 0.15, grey, 0.5, 0)
