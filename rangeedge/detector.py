"""The detector as one call, and as an object for streams of frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._args import deliver
from ._constants import EDGE_OCCLUDING
from .edges import frame_of, params_of, strength_of, takes_scan_line_params
from .selection import selectEdges
from .thinning import thinEdges


@takes_scan_line_params
def detectEdges(
    src: np.ndarray,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    eps: float | None = None,
    edges: np.ndarray | None = None,
    *,
    mask: np.ndarray | None = None,
    hysteresis: float = 1.0,
    minLength: int = 6,
    dynamic: bool = False,
    **options: Any,
) -> np.ndarray:
    params = params_of("detectEdges", eps, options)
    strength = strength_of("detectEdges", frame_of("detectEdges", src, params, mask), params)
    jump = np.where(strength.kind & EDGE_OCCLUDING, strength.jump, np.float32(0))
    selected = selectEdges(
        jump, strength.crease, jumpThreshold or 0.0, creaseThreshold,
        hysteresis=hysteresis, minLength=minLength, dynamic=dynamic,
    )
    return deliver("detectEdges", "edges", thinEdges(selected), edges)
