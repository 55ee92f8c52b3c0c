"""Flying pixels: those that hang between two surfaces, since a step is smeared over them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._check import deliver
from ._option import parsed, takes
from .edges import kernel_options
from .frame import Frame
from .noise import measured_frame
from .noise_model import NoiseModel
from .options import SCAN_LINES, ScanLineParams
from .sectors import sectors_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import ScanLineOptions

_DIRECTIONS = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if down or right]
_LAST_STEP, _STEP = 2.5, 1.5  # of a limb, at most as high as so many times the one before
_SMOOTHED = 1.8  # correlation of the noise of sensors that smooth their depths over some pixels
_SECOND_DIFFERENCE = 6**0.5  # its standard deviation, in those of depths


@takes(SCAN_LINES)
def flyingPixels(
    src: np.ndarray,
    eps: float | None = None,
    dst: np.ndarray | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[ScanLineOptions],
) -> np.ndarray:
    """Find the pixels that belong to no surface: depths mixed of a near one and the one behind it.

    flyingPixels(src[, eps[, dst]], *[, mask[, K[, ...]]]) -> dst

    A pixel at the rim of a surface sees the one behind it as well, and so does whatever interpolates depths: a sensor,
    stereo matching, registration to another camera, `cv2.resize`. On a scan line it is a sample of a short ramp between
    two surfaces, of depth z between the depths z1 and z2 to which these extend:

        0.15 < (z - z1) / (z2 - z1) < 0.85,  z1 to z2 being a jump that exceeds the noise.

    Ramps have up to `maxSmear` pixels, and steps between these that are not too uneven. They count only if they meet
    the viewing ray at less than 20 degrees, at which a surface would hardly be seen, or at less than 45 degrees where
    they have no more than two pixels; on a grid of `pixelSize` 1, as None is, there are no such angles, and all count.
    A pixel that continues a slope is none, as at the limb of a round surface: along a row, a column or a diagonal it
    falls off from the three pixels beside it no less than these do, and up to 2.5 times as far as the last of them.
    Not so where the sensor smooths its depths, of which a noise with a `correlation` above 1.8 tells: smeared steps
    fall off as limbs do.
    `edgeStrength` has no creases on these pixels, and one jump of the full height across them.

    Parameters
    ----------
    src, eps, K, ...
        As in `edgeStrength`.
    dst : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.

    Returns
    -------
    dst : ndarray of shape (H, W), CV_8U
        255 on flying pixels, 0 elsewhere, also where pixels are invalid.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    edgeStrength : The jumps themselves.

    Notes
    -----
    From the approximation of scan lines (paper, 4.1).

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import flyingPixels
    >>> depth = np.full((30, 40), 0.7)
    >>> depth[:, :20], depth[:, 20] = 0.6, 0.65
    >>> flying = flyingPixels(depth, noise=0.001, K=[[250, 0, 20], [0, 250, 15], [0, 0, 1]])
    >>> flying[15, 18:23]
    array([  0,   0, 255,   0,   0], dtype=uint8)
    """
    (params,) = parsed({"eps": eps, **options}, ScanLineParams)
    frame = measured_frame(src, params, mask)
    return deliver("dst", _flying(frame, params), dst)


def _flying(frame: Frame, params: ScanLineParams) -> np.ndarray:
    flying = np.zeros(frame.shape, np.uint8)
    parts = sectors_of(frame)
    for part in parts:
        part.put(flying, _flying(part.frame, params))
    if not parts:
        _core.flying_pixels(frame.kernel, kernel_options(frame, params), frame.threads, flying)
        keep_limbs(frame, params, flying)
    return flying


def keep_limbs(frame: Frame, params: ScanLineParams, flying: np.ndarray) -> None:
    """Clear the pixels of `flying` that continue a slope: up to `maxSmear` in a row, the next after the others."""
    if isinstance(frame.noise, NoiseModel) and frame.noise.correlation > _SMOOTHED:
        return
    pixels = np.flatnonzero(flying)
    for _ in range(params.maxSmear):
        limb = _continues(frame, flying, pixels)
        flying.ravel()[pixels[limb]] = 0
        pixels = pixels[~limb]
        if not limb.any():
            break


def _continues(frame: Frame, flying: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Which pixels continue, in one of the eight directions, the slope of the three beside them, none of which fly.

    The limb of a round surface falls off as the square root of the pixels to its end: the last step has up to 2.4 times
    the height of the one before, any other up to 1.3 times.
    """
    height, width = frame.shape
    row, col = np.divmod(pixels, width)
    depth = frame.depth.ravel()[pixels]
    noise = frame.noise.ravel()[pixels] if isinstance(frame.noise, np.ndarray) else frame.noise(np.abs(depth))
    slack = _SECOND_DIFFERENCE * noise
    found = np.zeros(len(pixels), bool)
    for down, right in _DIRECTIONS:
        last_row, last_col = row + 3 * down, col + 3 * right
        inside = (last_row >= 0) & (last_row < height) & (last_col >= 0) & (last_col < width)
        beside = pixels[inside] + (down * width + right) * np.arange(1, 4)[:, None]
        line = np.vstack([depth[inside], np.where(flying.ravel()[beside], np.nan, frame.depth.ravel()[beside])])
        here, last, before = -np.diff(line, axis=0)
        sign, more = np.where(last < 0, -1, 1), slack[inside]
        here, last, before = here * sign, last * sign, before * sign
        with np.errstate(invalid="ignore"):
            found[inside] |= (
                (here >= last - more)
                & (here <= _LAST_STEP * last + more)
                & (last >= before - more)
                & (last <= _STEP * np.abs(before) + more)
                & (here + last + before > 2 * more)  # along the rim of a surface depths stay
            )
    return found
