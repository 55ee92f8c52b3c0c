"""How noisy a range image is: an estimate from the image itself, so that thresholds follow it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._option import parsed, takes
from .forms import range_array
from .frame import Frame, read_frame
from .noise_model import LARGEST_CORRELATION, NoiseModel, correlation_of, independent
from .options import GEOMETRY, ScanLineParams
from .plausible import question_geometry, warn_of_thresholds

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import GeometryOptions


@takes(GEOMETRY)
def estimateNoise(src: np.ndarray, *, mask: np.ndarray | None = None, **options: Unpack[GeometryOptions]) -> NoiseModel:
    """Estimate the noise of a range image from the image itself.

    estimateNoise(src, *[, K[, pixelSize[, heightMap[, depthFactor[, mask]]]]]) -> retval

    Third differences along rows and columns vanish on every quadratic; on noise they have sqrt(20) times its
    deviation. Edges are few among them: sigma is the root mean square of the smaller three quarters, corrected for the
    trimming. Per bin of depth, sigma(z) = a + c z^2 with a, c >= 0 is fitted to it; on a grid sigma = a. Areas of
    constant values do not count, unless nearly all of the image is constant and its levels meet in clean steps.

    How much fits to n = 4, 8, 16, 32 pixels are off, on one scan line and on five neighbouring ones together, is
    measured likewise: by D = s1 - 2 s2 + s3 and G = z1 - 2 z2 + z3 - (s3 - s1) n / 2 of the slopes s and means z of
    three adjacent fits, which vanish on every quadratic too, and whose deviations for white noise are known. What the
    medians exceed these by are the factors in `fits`, along rows and along columns; |D| by depth tells how the waves of
    the noise grow with it. Whoever detects edges with the model counts with that; its `correlation` sums it up.

    A scanner that turns measures each of its pixels for itself, and its lines are no quadratics of the number of a
    pixel: there the factors are the lesser of rows and columns, and at most 1.5.

    Parameters
    ----------
    src : ndarray
        The range image, as in `edgeStrength`. Windows with an invalid pixel do not count.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    {options}

    Returns
    -------
    retval : NoiseModel
        In the unit of the image. Never below 3e-5 of the distance (of the range of heights on a grid), so that
        the rounding of noise-free images counts as noise, nor below that of rounding to whole units of integers, or
        to the step of which depths are multiples, step / sqrt(12); that is also what is left where no window is valid.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import estimateNoise
    >>> noise = np.random.default_rng(0).normal(0, 0.003, (120, 160))
    >>> K = np.array([[150, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
    >>> model = estimateNoise(1.5 + noise, K=K)
    >>> round(model(1.5), 3)
    0.003
    """
    (params,) = parsed(options, ScanLineParams)
    return estimated(_plausible_frame(src, params, mask))


def measured_frame(src: np.ndarray, params: ScanLineParams, mask: np.ndarray | None = None) -> Frame:
    """A range image in the form that kernels take, with its noise: as given, else as estimated."""
    frame = _plausible_frame(src, params, mask)
    warn_of_thresholds(frame, eps=params.eps, noise=params.noise)
    return frame.with_noise(estimated(frame) if params.noise is None else params.noise)


def _plausible_frame(src: np.ndarray, params: ScanLineParams, mask: np.ndarray | None) -> Frame:
    """A range image in the form that kernels take, and a word where it can hardly be what the options say."""
    frame = read_frame(src, params, mask)
    question_geometry(range_array(src)[0], frame, params)
    return frame


def estimated(frame: Frame) -> NoiseModel:
    """The noise of a checked range image."""
    numbers = _core.estimate_noise(frame.ordinate, frame.projective, frame.step, frame.threads)
    (a, b, c, _), fits = numbers[:4], tuple(numbers[4:])
    if frame.ranges:
        fits = independent(fits)
    return NoiseModel(a, b, c, min(max(1.0, correlation_of(fits)), LARGEST_CORRELATION), fits=fits)
