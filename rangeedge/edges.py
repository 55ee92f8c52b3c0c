"""The detector: edge candidates, strengths and kinds from scan line approximation (P§4)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import cv2
import numpy as np

from . import _core
from ._args import array, fail, flag, image32f, integer, number
from ._constants import *  # noqa
from .geometry import RangeFrame, range_frame
from .noise import NoiseModel, noise_of


@dataclass(frozen=True)
class ScanLineParams:
    eps: float | None = None
    epsFactor: float = 6.0
    K: Any = None
    pixelSize: Any = None
    heightMap: bool = False
    depthFactor: float = 1000.0
    noise: Any = None
    directions: int = DIR_ALL
    fit: int = FIT_LSQ
    measure: int = MEASURE_MIDPOINT
    crease: int = CREASE_MAX
    maxShift: float = 4.0
    maxGap: int = 0
    minSignificance: float = 10.0


class EdgeStrength(NamedTuple):
    jump: np.ndarray
    crease: np.ndarray
    kind: np.ndarray
    significance: np.ndarray


def _kernel_parameters(p: ScanLineParams):
    return _core.Parameters(eps=p.eps or 0.0, eps_factor=p.epsFactor, directions=p.directions, interpolate=p.fit == FIT_INTERP,
        endpoint=p.measure == MEASURE_ENDPOINT, max_shift=p.maxShift, max_gap=p.maxGap, min_significance=p.minSignificance, threads=cv2.getNumThreads())


def edgeStrength(src, eps=None, *, mask=None, **options) -> EdgeStrength:
    p = ScanLineParams(eps=eps, **options)
    frame = range_frame("edgeStrength", src, p.K, p.pixelSize, p.heightMap, p.depthFactor, mask)
    noise = p.noise if p.noise is not None else noise_of(frame)
    if not isinstance(noise, NoiseModel):
        noise = NoiseModel(c=noise) if frame.projective else NoiseModel(a=noise)
    h, w = frame.shape
    s = EdgeStrength(*(np.empty((h, w), t) for t in (np.float32, np.float32, np.uint8, np.float32)))
    _core.edge_strength(*frame.kernel_args, (noise.a, noise.b, noise.c), None, _kernel_parameters(p), *s)
    return s


def detectEdges(src, jumpThreshold=None, creaseThreshold=30.0, eps=None, edges=None, *, mask=None, **options):
    s = edgeStrength(src, eps, mask=mask, **options)
    jump = np.where(s.kind & EDGE_JUMP, s.jump, 0) if jumpThreshold is None else s.jump
    from .selection import selectEdges
    e = ((jump > (jumpThreshold or 0)) | (s.crease >= creaseThreshold)).astype(np.uint8) * 255
    from skimage.morphology import skeletonize
    return skeletonize(e > 0).astype(np.uint8) * 255
