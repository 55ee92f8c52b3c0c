"""How good edges and regions are: scores against ground truth."""

from .edges import (
    TRUTH_AMBIGUOUS,
    TRUTH_CONCAVE,
    TRUTH_CONVEX,
    TRUTH_IGNORED,
    TRUTH_JUMP,
    TRUTH_NODATA,
    TRUTH_NONE,
    EdgeScores,
    TypeScores,
    baddeleyDelta,
    evaluateEdges,
    prattFOM,
)
from .regions import HooverScores, hooverScores

__all__ = [
    "TRUTH_AMBIGUOUS",
    "TRUTH_CONCAVE",
    "TRUTH_CONVEX",
    "TRUTH_IGNORED",
    "TRUTH_JUMP",
    "TRUTH_NODATA",
    "TRUTH_NONE",
    "EdgeScores",
    "HooverScores",
    "TypeScores",
    "baddeleyDelta",
    "evaluateEdges",
    "hooverScores",
    "prattFOM",
]
