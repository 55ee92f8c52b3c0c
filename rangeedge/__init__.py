"""Edges in range images by scan line approximation, and what follows from them."""

from ._args import error
from ._constants import *  # noqa: F403
from .detector import detectEdges
from .distance import *
from .edges import EdgeStrength, ScanLineParams, edgePoints, edgeStrength, splitScanLine
from .noise import NoiseModel, estimateNoise
__version__ = "0.1.0"
