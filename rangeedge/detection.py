"""Detection on a checked range image: strengths, those of them that count, and their middle lines."""

from __future__ import annotations

import numpy as np

from .edges import EdgeStrength, measure_strength
from .frame import Frame
from .options import ScanLineParams, Selection
from .plausible import warn_of_selection
from .sectors import around
from .selection import select_strength
from .thinning import thinEdges


def run_detector(frame: Frame, params: ScanLineParams, selection: Selection) -> tuple[np.ndarray, EdgeStrength]:
    """The edges of a checked range image: strengths, those of them that count, and their middle lines."""
    warn_of_selection(frame, selection)
    strength = measure_strength(frame, params)
    return thin_lines(frame, selected(frame, strength, selection.of(params))), strength


def selected(frame: Frame, strength: EdgeStrength, selection: Selection) -> np.ndarray:
    """The strengths of a range image that count, as a map."""
    return around(frame, lambda *maps, wrap: select_strength(EdgeStrength(*maps), selection, wrap), *strength)


def thin_lines(frame: Frame, edges: np.ndarray) -> np.ndarray:
    """The middle lines of an edge map of a range image."""
    return around(frame, thinEdges, edges)
