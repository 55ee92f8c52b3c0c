"""How near the strength of a crease edge comes to the true angle: the simulation of the paper, 5, and the detector."""

from .creases import creaseAngle, directionalAngles, geodesicDome
from .detection import measureDetector
from .errors import ErrorStatistics, errorStatistics, estimationError
from .simulation import MAX_SLANT, OptimalityAnalysis, analyseOptimality

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
