"""A range image by its geometry options, in the form that kernels take: for programs with kernels of their own."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._check import named
from .frame import Frame, read_frame
from .options import ScanLineParams


def range_frame(function: str, src: np.ndarray, mask: np.ndarray | None = None, **geometry: Any) -> Frame:
    """The frame of `src`; errors name `function`."""
    return named(function)(lambda: read_frame(src, ScanLineParams(**geometry), mask))()
