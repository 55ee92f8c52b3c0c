"""What a batch does with each of its frames: edges, regions or lines, as a whole folder or as arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from .._check import error
from .._option import Option
from ..detector import detectEdgesWithStrength
from ..io import RangeImage
from ..options import DETECTION, LINKING, Growing
from ..regions import segmentRegions
from .results import edge_files, find_edges, find_regions, region_files

Arrays = dict[str, np.ndarray]
Counts = dict[str, int]


class Task(NamedTuple):
    """Of one name, what is found in a range image: all that the command of that name writes, or the arrays alone."""

    options: Mapping[str, Option]
    files: Callable[[RangeImage, str, Mapping[str, Any]], tuple[dict[str, bytes], Counts]]
    arrays: Callable[[RangeImage], tuple[Arrays, Counts]]
    picture: str  # the array that a PNG file holds, as it is
    frames: Mapping[str, str] = {}  # the arrays of the size of the image, and their types


def _edge_files(image: RangeImage, title: str, options: Mapping[str, Any]) -> tuple[dict[str, bytes], Counts]:
    found = find_edges(image.src, **image.geometry)
    return edge_files(found, title, options), {"edgePixels": int(np.count_nonzero(found.thin))}


def _edge_arrays(image: RangeImage) -> tuple[Arrays, Counts]:
    edges, strength = detectEdgesWithStrength(image.src, **image.geometry)
    return {"edges": edges, **strength._asdict()}, {"edgePixels": int(np.count_nonzero(edges))}


def _region_files(image: RangeImage, title: str, options: Mapping[str, Any]) -> tuple[dict[str, bytes], Counts]:
    found = find_regions(image.src, **image.geometry)
    return region_files(found, title, options, image), {"regions": len(found.surfaces) - 1}


def _region_arrays(image: RangeImage) -> tuple[Arrays, Counts]:
    labels = segmentRegions(image.src, **image.geometry)
    return {"labels": labels}, {"regions": int(labels.max())}


def _line_files(image: RangeImage, title: str, options: Mapping[str, Any]) -> tuple[dict[str, bytes], Counts]:
    from .lines import find_lines, line_files

    found = find_lines(image.src, **image.geometry)
    counts = {"chains": len(found.chains), "segments": len(found.segments)}
    return line_files(found, title, options, image), counts


def _line_arrays(image: RangeImage) -> tuple[Arrays, Counts]:
    from .lines import find_lines

    _, chains, segments, vertices, _ = find_lines(image.src, **image.geometry)
    arrays = {"points": chains.points, "chains": chains.chains, "segments": segments, "vertices": vertices}
    return arrays, {"chains": len(chains), "segments": len(segments)}


_STRENGTHS = {"jump": "f4", "crease": "f4", "kind": "u1", "significance": "f4"}

TASKS = {
    "detect": Task(DETECTION, _edge_files, _edge_arrays, "edges", {"edges": "u1", **_STRENGTHS}),
    "segment": Task({**DETECTION, **Growing.options}, _region_files, _region_arrays, "labels", {"labels": "i4"}),
    "lines": Task(LINKING, _line_files, _line_arrays, ""),
}


def picture_of(arrays: Arrays, name: str) -> np.ndarray:
    """An array as PNG has room for it."""
    values = arrays[name]
    if values.dtype == np.uint8:
        return values
    if values.max(initial=0) > 65535:
        raise error(f"a PNG has room for 65535 regions, {values.max()} were found; raise `minArea`, or write npz")
    return values.astype(np.uint16)
