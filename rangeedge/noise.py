"""How noisy a range image is: a model by sensor, or an estimate from the image itself, so that thresholds follow it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from . import _core
from ._args import described, error, fail, number
from .geometry import RangeFrame, range_frame

_CORRELATION_MAX = 2.5  # beyond it, curvature rather than noise
_FINEST = 3e-5  # of the distance, or of the range of heights: no range sensor resolves more


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviation of a measured length as a function of depth.

    NoiseModel([a[, b[, c[, correlation]]]])

    sigma(z) = a + b z + c z^2, all in the unit of the range image. Calling the model evaluates it.

    Parameters
    ----------
    a, b, c : float
        Coefficients, such that sigma is nowhere negative in the range measured. A triangulating sensor has only `c`
        (its noise is constant in inverse depth), a time-of-flight sensor mainly `a`.
    correlation : float
        How much larger the deviation is over several pixels than between neighbours; 1 for white noise, about 2 for
        a Kinect, whose matching windows make neighbours err together. Fits count with `correlation` times sigma.

    Raises
    ------
    rangeedge.error
        If a coefficient is not finite, all are zero, or `correlation` is below 1.

    Examples
    --------
    >>> NoiseModel(c=0.0014)(2.0)
    0.0056
    """

    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    correlation: float = 1.0

    def __post_init__(self) -> None:
        for name in ("a", "b", "c"):
            number("NoiseModel", name, getattr(self, name))
        number("NoiseModel", "correlation", self.correlation, 1)
        if self.a == self.b == self.c == 0:
            raise error("NoiseModel", "one of `a`, `b`, `c` must differ from 0")

    def __call__(self, z: Any) -> Any:
        return self.a + (self.b + self.c * z) * z

    @classmethod
    def kinect1(cls) -> NoiseModel:
        """Kinect v1 and Xtion, metres: 1.425e-3 z^2 (Khoshelham and Oude Elberink 2012)."""
        return cls(c=1.425e-3, correlation=2.0)

    @classmethod
    def kinect2(cls) -> NoiseModel:
        """Kinect v2, metres, facing surfaces: 1.5 mm - 0.5 mm z + 0.3 mm z^2 (Fankhauser et al. 2015)."""
        return cls(1.5e-3, -0.5e-3, 0.3e-3, correlation=2.0)

    @classmethod
    def stereo(cls, focalLength: float, baseline: float, subpixel: float = 0.08) -> NoiseModel:
        """Stereo and active stereo: z^2 subpixel / (focalLength baseline), with the focal length in pixels.

        `subpixel` is the deviation of the disparity in pixels, `baseline` a length in the unit of the image.
        """
        focalLength = number("NoiseModel.stereo", "focalLength", focalLength, 0, above=True)
        baseline = number("NoiseModel.stereo", "baseline", baseline, 0, above=True)
        return cls(c=number("NoiseModel.stereo", "subpixel", subpixel, 0, above=True) / (focalLength * baseline))


def estimateNoise(
    src: np.ndarray,
    *,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
) -> NoiseModel:
    """Estimate the noise of a range image from the image itself.

    estimateNoise(src, *[, K[, pixelSize[, heightMap[, depthFactor[, mask]]]]]) -> retval

    Third differences along rows and columns vanish on every quadratic; on noise they have sqrt(20) times its
    deviation. Edges are few among them: sigma is the root mean square of the smaller three quarters, corrected for the
    trimming. Per bin of depth, a + c z^2 with a, c >= 0 is fitted to it. The correlation is the ratio of the same
    estimate at a lag of 6 pixels to that between neighbours, between 1 and 2.5.

    Parameters
    ----------
    src, K, pixelSize, heightMap, depthFactor, mask
        The range image and its geometry, as in `edgeStrength`. Windows with an invalid pixel do not count.

    Returns
    -------
    retval : NoiseModel
        In the unit of the image. Never below 3e-5 of the distance (of the range of heights on a grid), so that
        the rounding of noise-free images counts as noise; that is also what is left where no window is valid.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(0).normal(0, 0.003, (120, 160))
    >>> K = np.array([[150, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
    >>> model = estimateNoise(1.5 + noise, K=K)
    >>> round(model(1.5), 4)
    0.003
    """
    return noise_of(range_frame("estimateNoise", src, K, pixelSize, heightMap, depthFactor, mask))


def noise_of(frame: RangeFrame) -> NoiseModel:
    """The noise of a checked range image."""
    near, far, lowest, highest, ordinates, sigmas = _core.noise_statistics(frame.ordinate, frame.threads)
    correlation = float(np.clip(far / near, 1, _CORRELATION_MAX)) if near > 0 else 1.0
    if not frame.projective:
        extent = highest - lowest if highest > lowest else 1.0
        return NoiseModel(a=max(near, _FINEST * extent), correlation=correlation)
    if len(ordinates) == 0:
        return NoiseModel(b=_FINEST)
    z = 1 / ordinates
    a, c = _fitted(z, np.maximum(sigmas * z * z, _FINEST * z))
    if a + c / highest**2 < _FINEST / highest:
        return NoiseModel(b=_FINEST, correlation=correlation)
    return NoiseModel(a=a, c=c, correlation=correlation)


def _fitted(z: np.ndarray, sigma: np.ndarray) -> tuple[float, float]:
    """a, c >= 0 of sigma = a + c z^2, by least squares of relative errors: quiet depths count, not those of edges."""
    columns = np.stack([np.ones_like(z), z * z], axis=1) / sigma[:, None]
    both = np.linalg.lstsq(columns, np.ones_like(z), rcond=None)[0]
    if (both >= 0).all():
        return float(both[0]), float(both[1])
    single = columns.sum(axis=0) / np.square(columns).sum(axis=0)
    residuals = np.square(columns * single - 1).sum(axis=0)
    return (float(single[0]), 0.0) if residuals[0] < residuals[1] else (0.0, float(single[1]))


def kernel_noise(func: str, noise: Any, frame: RangeFrame) -> _core.Noise:
    """The `noise` argument of a detector as kernels take it."""
    if noise is None:
        noise = noise_of(frame)
    elif not isinstance(noise, (NoiseModel, np.ndarray)):
        noise = NoiseModel(a=number(func, "noise", noise, 0, above=True))
    if isinstance(noise, NoiseModel):
        if min(noise.a, noise.b, noise.c) < 0 and not (noise(np.abs(frame.depth[frame.valid > 0])) > 0).all():
            raise fail(func, "noise", "a model that is positive at every depth of the image", noise)
        return _core.Noise(noise.a, noise.b, noise.c, noise.correlation)
    expected = f"a number, a NoiseModel, or a real array of shape {frame.shape}, > 0 at valid pixels"
    if noise.shape != frame.shape or noise.dtype.kind not in "iuf":
        raise fail(func, "noise", expected, described(noise), cv2.Error.StsBadSize)
    sigmas = np.ascontiguousarray(noise, dtype=np.float32)
    if not np.all((sigmas > 0) & np.isfinite(sigmas), where=frame.valid > 0):
        raise error(func, f"`noise` must be {expected}", cv2.Error.StsOutOfRange)
    return _core.Noise(0.0, 0.0, 0.0, 1.0, sigmas)
