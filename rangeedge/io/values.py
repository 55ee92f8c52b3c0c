"""What the readers and writers of every format share."""

from __future__ import annotations

import numpy as np


def float32(src: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        return src.astype(np.float32)


def expect(found: int, needed: int, unit: str = "bytes") -> None:
    if found != needed:
        raise ValueError(f"it holds {found} {unit} where {needed} are needed")
