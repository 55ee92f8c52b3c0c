"""How noisy a range image is: sigma as a function of depth, given or estimated (design: thresholds follow the noise)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._args import image32f, number
from .geometry import RangeFrame, range_frame


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviation of a measured length, sigma(z) = a + b z + c z^2, in the unit of the range image."""

    a: float = 0.0
    b: float = 0.0
    c: float = 0.0

    def __call__(self, z: Any) -> Any:
        return self.a + (self.b + self.c * z) * z


def third_difference_sigma(frame: RangeFrame) -> float:
    """Standard deviation of the ordinate's noise from third differences along rows and columns."""
    ordinate = frame.ordinate
    parts = []
    for axis in (0, 1):
        if ordinate.shape[axis] > 3:
            d = np.diff(ordinate, 3, axis=axis).ravel()
            parts.append(np.abs(d[np.isfinite(d)], dtype=np.float64))
    d = np.concatenate(parts) / np.sqrt(20) if parts else np.empty(0)
    if d.size == 0:
        return 0.0
    sigma = 1.4826 * np.median(d)
    return float(sigma)


def estimateNoise(src, *, K=None, pixelSize=None, heightMap=False, depthFactor=1000.0, mask=None) -> NoiseModel:
    frame = range_frame("estimateNoise", src, K, pixelSize, heightMap, depthFactor, mask)
    return noise_of(frame)


def noise_of(frame: RangeFrame) -> NoiseModel:
    sigma = third_difference_sigma(frame)
    return NoiseModel(c=sigma) if frame.projective else NoiseModel(a=sigma)
