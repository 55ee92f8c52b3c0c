"""How results show themselves in a notebook: as PNG."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from ..selection import strengthImage
from .edges import drawEdges
from .lines import drawChains, drawSegments
from .overview import drawPanels
from .palette import colour_index, paint

if TYPE_CHECKING:
    from ..chains import EdgeChains
    from ..edges import EdgeStrength
    from ..segments import Segments

_MARGIN = 8  # pixels around lines of which the image is not known
_CREASE_CUT = 64.0  # degrees, as the paper has it


def as_png(picture: np.ndarray) -> bytes:
    """The content of a file."""
    return cv2.imencode(".png", picture)[1].tobytes()


def of_image(src: np.ndarray, geometry: Mapping[str, Any]) -> bytes:
    """The shaded relief of a range image."""
    return as_png(drawEdges(src, np.zeros(np.shape(src)[:2], np.uint8), **geometry))


def of_strength(strength: EdgeStrength) -> bytes:
    """Strengths and kinds beside each other."""
    jump, crease, kind, _ = strength
    cut = float(np.median(jump[jump > 0])) if jump.any() else 1.0
    kinds = paint(np.zeros((*kind.shape, 3), np.uint8), colour_index(kind != 0, kind))
    panels = [
        (f"jump, white from {cut:.3g}", strengthImage(jump, cut)),
        (f"crease, white from {_CREASE_CUT:g} degrees", strengthImage(crease, _CREASE_CUT)),
        ("kind", kinds),
    ]
    return as_png(drawPanels(panels, 3, key=True))


def of_chains(chains: EdgeChains) -> bytes:
    """Chains on black."""
    return as_png(drawChains(_canvas(np.column_stack([chains.points["x"], chains.points["y"]])), chains))


def of_segments(found: Segments) -> bytes:
    """Segments and vertices on black."""
    return as_png(drawSegments(_canvas(found.segments["pixels"].reshape(-1, 2)), *found))


def _canvas(places: np.ndarray) -> np.ndarray:
    """Black, as large as places in pixels need."""
    known = places[np.isfinite(places).all(axis=1)]
    width, height = (known.max(axis=0) if len(known) else np.zeros(2)) + _MARGIN
    return np.zeros((int(height) + 1, int(width) + 1, 3), np.uint8)
