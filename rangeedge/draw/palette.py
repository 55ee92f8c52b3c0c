"""The colours of edges, which tell apart for the usual forms of colour blindness, after Okabe and Ito."""

from __future__ import annotations

import numpy as np

from ..constants import EDGE_BOUNDARY, EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, EDGE_OCCLUDED

PLAIN = (255, 255, 255)  # an edge of no known kind
KINDS = (  # later entries hide earlier ones
    (EDGE_BOUNDARY, (150, 150, 150), "beside no data"),
    (EDGE_CONCAVE, (233, 180, 86), "concave"),
    (EDGE_CONVEX, (66, 228, 240), "convex"),
    (EDGE_JUMP, (0, 94, 213), "jump, nearer side"),
    (EDGE_OCCLUDED, (167, 121, 204), "jump, farther side"),
)
EDGE_KINDS = [*((colour, text) for _, colour, text in reversed(KINDS)), (PLAIN, "other")]
LINE_KINDS = [  # of chains and segments, which have one line for both sides of a jump
    *(
        (colour, text.split(",")[0])
        for bit, colour, text in reversed(KINDS)
        if bit & (EDGE_JUMP | EDGE_CONVEX | EDGE_CONCAVE)
    ),
    (PLAIN, "corner"),
]
_EDGE_COLOURS = np.array([(0, 0, 0), PLAIN, *(colour for _, colour, _ in KINDS)], np.uint8)


def colour_index(edges: np.ndarray, kind: np.ndarray | None) -> np.ndarray:
    """Index into the colours of edges; 0 is no edge, and the larger one hides the smaller."""
    index = edges.astype(np.uint8)
    if kind is not None:
        for i, (bit, _, _) in enumerate(KINDS, start=2):
            index[edges & (kind & bit != 0)] = i
    return index


def paint(canvas: np.ndarray, index: np.ndarray) -> np.ndarray:
    canvas[index > 0] = _EDGE_COLOURS[index[index > 0]]
    return canvas


def kind_colour(kind: int) -> tuple[int, int, int]:
    """The colour of an edge by the bits of its kind."""
    return next((colour for bit, colour, _ in reversed(KINDS) if kind & bit), PLAIN)
