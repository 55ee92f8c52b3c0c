"""How near the strength of a crease edge comes to the true angle: `rangeedge.evaluation.optimality`."""

from .evaluation.optimality import (
    MAX_SLANT,
    ErrorStatistics,
    OptimalityAnalysis,
    analyseOptimality,
    creaseAngle,
    directionalAngles,
    errorStatistics,
    estimationError,
    geodesicDome,
    measureDetector,
)

__all__ = [
    "MAX_SLANT",
    "ErrorStatistics",
    "OptimalityAnalysis",
    "analyseOptimality",
    "creaseAngle",
    "directionalAngles",
    "errorStatistics",
    "estimationError",
    "geodesicDome",
    "measureDetector",
]
