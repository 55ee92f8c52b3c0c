"""What `rangeedge lines` writes: edges as chains and segments, for tables, viewers and maps."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .. import __version__
from .._check import named
from .._option import parsed, takes
from ..chains import EdgeChains, link_frame
from ..draw import line_overview
from ..draw.lines import canvas_of, draw_segments, write_lengths
from ..frame import Frame
from ..io import RangeImage
from ..io.lines import encoded_lines
from ..noise import measured_frame
from ..options import LINKING, Linking, ScanLineParams, Selection
from ..plausible import warn_of_selection
from ..segments import Segments, fitSegments
from .results import encoded, on_map, plain
from .understood import understood

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


class LineResults(NamedTuple):
    """Everything that `lines` writes, as arrays."""

    frame: Frame
    chains: EdgeChains
    segments: np.ndarray
    vertices: np.ndarray
    known: dict[str, Any]

    @property
    def bent(self) -> int:
        """How many chains have no segment."""
        return len(self.chains) - len(np.unique(self.segments["chain"]))


@named("linkEdges")
@takes(LINKING)
def find_lines(
    src: np.ndarray, *, mask: np.ndarray | None = None, tolerance: float | None = None, **options: Any
) -> LineResults:
    """The chains of an image, their segments, and what is known of the image."""
    params, selection, linking = parsed(options, ScanLineParams, Selection, Linking)
    frame = measured_frame(src, params, mask)
    warn_of_selection(frame, selection)
    chains = link_frame(frame, params, selection, linking)
    segments, vertices = fitSegments(chains, tolerance)
    return LineResults(frame, chains, segments, vertices, understood(frame, params, selection, src))


def line_files(found: LineResults, title: str, options: Mapping[str, Any], image: RangeImage) -> dict[str, bytes]:
    """The files of LINE_FILES, lines on the map if `image` lies on one."""
    view = {name: image.geometry[name] for name in ("K", "heightMap") if name in image.geometry}
    scale = min(max(1, -(-_SCALE_PIXELS // image.src.shape[1])), 16)
    segments = Segments(found.segments, found.vertices)
    picture, scale = canvas_of(image.src, scale, view)
    draw_segments(picture, *segments, scale)
    crowded = len(found.segments) - write_lengths(picture, *segments, scale)
    room = f" ({crowded} without room)" if crowded else ""
    caption = f"{title}: {len(found.segments)} segments and their lengths{room}, unit: {found.known['unit']}"
    report = {
        "image": title,
        "rangeedge": __version__,
        "options": plain(options),
        "height": found.frame.shape[0],
        "width": found.frame.shape[1],
        "validPixels": int(np.count_nonzero(found.frame.valid)),
        "chains": len(found.chains),
        "points": len(found.chains.points),
        "segments": len(found.segments),
        "chainsWithoutSegment": found.bent,
        "vertices": len(found.vertices),
        "understood": plain(found.known),
        "noise": plain(found.frame.noise),
    }
    return {
        "lines.png": encoded(".png", line_overview(picture, found.frame.shape, caption)),
        "chains.csv": encoded_lines(".csv", found.chains),
        "chains.ply": encoded_lines(".ply", found.chains),
        "chains.geojson": encoded_lines(".geojson", found.chains, **on_map(image)),
        "segments.csv": encoded_lines(".csv", segments),
        "segments.obj": encoded_lines(".obj", segments),
        "report.json": json.dumps(report, indent=2, allow_nan=False).encode() + b"\n",
    }
