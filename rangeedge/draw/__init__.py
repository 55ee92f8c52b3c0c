"""Pictures of range images, edges, regions and distances: BGR, as ``cv2.imwrite`` and ``cv2.imshow`` expect them."""

from .boundaries import drawBoundaries
from .distance import colorizeDistance
from .edges import drawEdges
from .explanation import drawExplanation
from .lines import drawArcs, drawChains, drawSegments
from .overview import drawOverview, drawPanels, edge_overview, line_overview, region_overview
from .regions import drawRegions

__all__ = [
    "colorizeDistance",
    "drawArcs",
    "drawBoundaries",
    "drawChains",
    "drawEdges",
    "drawExplanation",
    "drawOverview",
    "drawPanels",
    "drawRegions",
    "drawSegments",
    "edge_overview",
    "line_overview",
    "region_overview",
]
