"""What `rangeedge lines` writes: edges as chains and segments, for tables, viewers and maps."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from .. import __version__
from ..chains import EdgeChains, linkEdges
from ..draw import drawSegments
from ..io import RangeImage
from ..io.lines import encoded_lines
from ..segments import Segments, fitSegments
from .results import encoded, on_map, plain

_SCALE_PIXELS = 1200  # at least as wide is the picture

LINE_FILES = {
    "lines.png": "the straight segments with their lengths: orange jumps, yellow convex, blue concave; corners white",
    "chains.csv": "every point of every chain: pixel, coordinates, jump, crease, significance",
    "chains.ply": "the chains as edges between vertices, with kind and crease",
    "chains.geojson": "the chains as LineStrings",
    "segments.csv": "ends of every straight segment, length, dihedral angle (concave above 180 degrees), deviations",
    "segments.obj": "the segments as polylines",
    "report.json": "the image, the options, and what was found, in numbers",
}


def find_lines(image: RangeImage) -> tuple[EdgeChains, Segments]:
    """The chains of an image, and their segments."""
    chains = linkEdges(image.src, **image.geometry)
    return chains, fitSegments(chains)


def line_files(
    image: RangeImage, chains: EdgeChains, found: Segments, title: str, options: Mapping[str, Any]
) -> dict[str, bytes]:
    """The files of LINE_FILES."""
    view = {name: image.geometry[name] for name in ("K", "heightMap") if name in image.geometry}
    scale = min(max(1, -(-_SCALE_PIXELS // image.src.shape[1])), 16)
    picture = drawSegments(image.src, *found, scale=scale, lengths=True, **view)
    report = {
        "image": title,
        "rangeedge": __version__,
        "options": plain(options),
        "chains": len(chains),
        "points": len(chains.points),
        "segments": len(found.segments),
        "vertices": len(found.vertices),
    }
    return {
        "lines.png": encoded(".png", picture),
        "chains.csv": encoded_lines(".csv", chains),
        "chains.ply": encoded_lines(".ply", chains),
        "chains.geojson": encoded_lines(".geojson", chains, **on_map(image)),
        "segments.csv": encoded_lines(".csv", found),
        "segments.obj": encoded_lines(".obj", found),
        "report.json": json.dumps(report, indent=2, allow_nan=False).encode() + b"\n",
    }
