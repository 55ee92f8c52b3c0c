"""Edges in range images by scan line approximation, and what follows from them: distances, seeds and regions.

First steps
-----------
>>> import numpy as np
>>> import rangeedge
>>> depth = np.full((480, 640), 1500, np.uint16)  # millimetres of a depth camera, 0 where nothing is seen
>>> depth[120:360, 160:480] = 1200
>>> edges = rangeedge.detectEdges(depth, K=(525, 525, 319.5, 239.5))  # 0 and 255, one pixel wide
>>> int(np.count_nonzero(edges))
1112

The image is depths of a camera (`K`), heights or depths on a grid (`pixelSize`, `heightMap=True`), or organized points
(H, W, 3). `imreadRange` reads files. Thresholds follow the noise of the image; `explainPixel` says why a pixel is an
edge or none, and which option changes that.

What there is, in the order data flows
--------------------------------------
read and write      imreadRange, imwriteRange, backproject, project, sweepToPoints
noise, repair       estimateNoise, NoiseModel, flyingPixels, cleanDepth
edges               detectEdges, detectEdgesWithStrength, createScanLineDetector (streams), mapFrames
why                 explainPixel, drawExplanation
strengths           edgeStrength, edgePoints, kindNames, splitScanLine, strengthImage, overallStrength
select and thin     selectEdges, thinEdges, closeContours
lines in space      linkEdges, fitSegments, fitArcs, writeLines, readLines
distances           distanceTransform, salienceDistanceTransform, ...WithLabels
seeds, surfaces     extractSeeds, growRegions, segmentRegions, ...WithStats
their outlines      regionBoundaries, regionAdjacency, regionCorners
pictures (BGR)      drawEdges, drawRegions, drawBoundaries, drawChains, drawSegments, colorizeDistance, drawOverview
parameters          ScanLineDetector.save and .load, the same files as `--params` of the shell and the explorer
give up a call      Cancellation, Ctrl-C
more                rangeedge.synthetic, rangeedge.evaluation, rangeedge.optimality, rangeedge.batch

`help(rangeedge.detectEdges)` has every option. From a shell: `rangeedge --help`; sliders: `rangeedge explore`.
Every bad value raises `rangeedge.error`, which is a `cv2.error` and a `ValueError`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._check import error
from .adjacency import regionAdjacency, regionCorners
from .arcs import fitArcs
from .boundaries import RegionBoundaries, RegionBoundary, regionBoundaries
from .cancellation import Cancellation
from .chains import EdgeChain, EdgeChains, linkEdges
from .cleaning import cleanDepth
from .closure import closeContours
from .constants import (
    CLEAN_FILLED,
    CLEAN_REMOVED,
    CLEAN_SMOOTHED,
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_ALL,
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    FIT_INTERP,
    FIT_LSQ,
    MEASURE_ENDPOINT,
    MEASURE_MIDPOINT,
    SALIENCE_ADDITIVE,
    SALIENCE_MULTIPLICATIVE,
    THIN_ITERATIVE,
    THIN_LEE,
    THIN_MEDIAL,
    THIN_SKELETON,
)
from .detector import ScanLineDetector, createScanLineDetector, detectEdges, detectEdgesWithStrength
from .distance import (
    distanceTransform,
    distanceTransformWithLabels,
    salienceDistanceTransform,
    salienceDistanceTransformWithLabels,
)
from .draw import (
    colorizeDistance,
    drawArcs,
    drawBoundaries,
    drawChains,
    drawEdges,
    drawExplanation,
    drawOverview,
    drawPanels,
    drawRegions,
    drawSegments,
)
from .edges import EdgeStrength, edgePoints, edgeStrength, kindNames, splitScanLine
from .explain import Explanation, explainPixel
from .flying import flyingPixels
from .frames import mapFrames
from .io import RangeImage, imreadRange, imwriteRange
from .io.lines import readLines, writeLines
from .io.polylines import Line, toLines
from .noise import estimateNoise
from .noise_model import NoiseModel
from .options import ScanLineParams
from .plausible import RangeEdgeWarning
from .projection import backproject, project
from .regions import growRegions, growRegionsWithStats, segmentRegions, segmentRegionsWithStats
from .seeds import extractSeeds, extractSeedsWithStats
from .segments import Segments, fitSegments
from .selection import overallStrength, selectEdges, strengthImage
from .sweep import sweepToPoints
from .thinning import thinEdges

if TYPE_CHECKING:
    from . import batch as batch
    from . import evaluation as evaluation
    from . import optimality as optimality
    from . import synthetic as synthetic

__version__ = "0.1.0"

# In the order data flows.
__all__ = [  # noqa: RUF022
    "error",
    "RangeEdgeWarning",
    "Cancellation",
    "RangeImage",
    "imreadRange",
    "imwriteRange",
    "sweepToPoints",
    "backproject",
    "project",
    "NoiseModel",
    "estimateNoise",
    "ScanLineParams",
    "splitScanLine",
    "EdgeStrength",
    "edgeStrength",
    "edgePoints",
    "kindNames",
    "flyingPixels",
    "strengthImage",
    "overallStrength",
    "selectEdges",
    "thinEdges",
    "detectEdges",
    "detectEdgesWithStrength",
    "Explanation",
    "explainPixel",
    "ScanLineDetector",
    "createScanLineDetector",
    "mapFrames",
    "EdgeChain",
    "EdgeChains",
    "linkEdges",
    "Segments",
    "fitSegments",
    "fitArcs",
    "Line",
    "toLines",
    "writeLines",
    "readLines",
    "closeContours",
    "distanceTransform",
    "distanceTransformWithLabels",
    "salienceDistanceTransform",
    "salienceDistanceTransformWithLabels",
    "extractSeeds",
    "extractSeedsWithStats",
    "growRegions",
    "growRegionsWithStats",
    "segmentRegions",
    "segmentRegionsWithStats",
    "RegionBoundary",
    "RegionBoundaries",
    "regionBoundaries",
    "regionAdjacency",
    "regionCorners",
    "cleanDepth",
    "drawEdges",
    "drawChains",
    "drawSegments",
    "drawArcs",
    "drawRegions",
    "drawBoundaries",
    "colorizeDistance",
    "drawOverview",
    "drawPanels",
    "drawExplanation",
    "DIR_ROWS",
    "DIR_COLS",
    "DIR_DIAG45",
    "DIR_DIAG135",
    "DIR_ALL",
    "FIT_LSQ",
    "FIT_INTERP",
    "MEASURE_MIDPOINT",
    "MEASURE_ENDPOINT",
    "CREASE_MAX",
    "CREASE_NORMAL",
    "EDGE_JUMP",
    "EDGE_CONVEX",
    "EDGE_CONCAVE",
    "EDGE_OCCLUDING",
    "EDGE_OCCLUDED",
    "EDGE_BOUNDARY",
    "CLEAN_SMOOTHED",
    "CLEAN_REMOVED",
    "CLEAN_FILLED",
    "THIN_SKELETON",
    "THIN_LEE",
    "THIN_ITERATIVE",
    "THIN_MEDIAL",
    "SALIENCE_MULTIPLICATIVE",
    "SALIENCE_ADDITIVE",
]

_SUBMODULES = ("batch", "evaluation", "optimality", "synthetic")  # imported when first asked for

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name in _SUBMODULES:
            return import_module(f".{name}", __name__)
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message, name=name, obj=sys.modules[__name__])  # "did you mean", says Python then


def __dir__() -> list[str]:
    special = [name for name in globals() if name.startswith("__") and name.endswith("__")]
    return sorted([*special, *__all__, *_SUBMODULES])
