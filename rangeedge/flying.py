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
from .options import SCAN_LINES, ScanLineParams
from .sectors import sectors_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import ScanLineOptions


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
    return flying
