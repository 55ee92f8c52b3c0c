"""What the command line writes: every result as a file that other tools open, a whole folder in one step."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import math
import os
import shutil
import uuid
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from .. import __version__
from .._check import described, error, named
from .._option import parsed, takes
from ..boundaries import RegionBoundaries, boundaries_of
from ..cancellation import apart
from ..detection import selected, thin_lines
from ..distance import distanceTransform
from ..draw import drawRegions, edge_overview, region_overview
from ..edges import EdgeStrength, measure_both
from ..frame import Frame
from ..io import RangeImage
from ..io.atomic import nameless, put
from ..io.lines import encoded_lines
from ..noise import measured_frame
from ..options import DETECTION, Growing, ScanLineParams, Selection
from ..plausible import warn_of_selection
from ..regions import described_regions, seeded_regions
from ..sectors import around
from .understood import understood

_REPORT = "report.json"
_OUTLINE = 1.0  # pixels that outlines may be off
_LABELS = 65535  # that 16 bits hold

REGION_FILES = {
    "overview.png": "everything in one picture",
    "labels.png": "the region of every pixel, 1, 2, ...; 0 is none (16 bits, dark to the eye)",
    "seeds.png": "the first seeds, in the same way; regions begin too where none of them has reached (16 bits)",
    "surfaces.csv": "of every region: box, area, centroid, normal, quadric, deviation",
    "outlines.svg": "the outlines of the regions over the image",
    "outlines.geojson": "the same as polygons in the coordinates of the surfaces, or of the map",
    "thin.png": "the edges, one pixel wide: 255, elsewhere 0",
    _REPORT: "the image, the options, and what was found, in numbers",
}

EDGE_FILES = {
    "overview.png": "everything in one picture",
    "thin.png": "the edges, one pixel wide: 255, elsewhere 0",
    "edges.png": "the edges before thinning: 255, elsewhere 0",
    "kind.png": "bits, dark to the eye: 1 jump, 2 convex, 4 concave, 8 nearer side, 16 farther side, 32 beside no data",
    "jump.tiff": "jump strength of every candidate, a length (float32)",
    "crease.tiff": "crease strength of every candidate, in degrees (float32)",
    "significance.tiff": "strength over its standard deviation (float32)",
    "distance.tiff": "distance to the nearest thin edge, in pixels (float32)",
    "points.csv": "candidates with subpixel positions: x, y, jump, crease, kind, significance, direction",
    _REPORT: "the image, the options, and what was found, in numbers",
}


class EdgeResults(NamedTuple):
    """Everything that `detect` writes, as arrays."""

    frame: Frame
    strength: EdgeStrength
    points: np.ndarray
    edges: np.ndarray
    thin: np.ndarray
    distance: np.ndarray
    known: dict[str, Any]

    @property
    def surface(self) -> np.ndarray:
        """The range image as pictures take it: float32, NaN without data, heights where it is a height map."""
        depth = self.frame.depth.astype(np.float32)
        return -depth if self.frame.heightMap else depth


@named("detectEdges")
@takes(DETECTION)
def find_edges(src: np.ndarray, *, mask: np.ndarray | None = None, **options: Any) -> EdgeResults:
    """What `detectEdges` returns, with all that it computes on the way."""
    params, selection = parsed(options, ScanLineParams, Selection)
    return _edges_of(src, mask, params, selection)


def _edges_of(src: np.ndarray, mask: np.ndarray | None, params: ScanLineParams, selection: Selection) -> EdgeResults:
    frame = measured_frame(src, params, mask)
    warn_of_selection(frame, selection)
    strength, points = measure_both(frame, params)
    edges = selected(frame, strength, selection.of(params))
    thin = thin_lines(frame, edges)
    known = understood(frame, params, selection, src)
    return EdgeResults(frame, strength, points, edges, thin, around(frame, distanceTransform, thin), known)


class RegionResults(NamedTuple):
    """Everything that `segment` writes, as arrays."""

    edges: EdgeResults
    seeds: np.ndarray
    labels: np.ndarray
    stats: np.ndarray
    surfaces: np.ndarray


@named("segmentRegions")
@takes({**DETECTION, **Growing.options})
def find_regions(src: np.ndarray, *, mask: np.ndarray | None = None, **options: Any) -> RegionResults:
    """What `segmentRegionsWithStats` returns, with all that it computes on the way."""
    params, selection, growing = parsed(options, ScanLineParams, Selection, Growing)
    found = _edges_of(src, mask, params, selection)
    seeds, labels = seeded_regions(found.frame, found.thin, growing)
    _, _, stats, _, surfaces = described_regions(found.frame, labels)
    return RegionResults(found, seeds, labels, stats, surfaces)


def edge_files(found: EdgeResults, title: str, options: Mapping[str, Any]) -> dict[str, bytes]:
    """The files of EDGE_FILES."""
    overview = edge_overview(found.frame, found.strength, found.thin, found.distance, title)
    return {
        "overview.png": encoded(".png", overview),
        "thin.png": encoded(".png", found.thin),
        "edges.png": encoded(".png", found.edges),
        "kind.png": encoded(".png", found.strength.kind),
        "jump.tiff": encoded(".tiff", found.strength.jump),
        "crease.tiff": encoded(".tiff", found.strength.crease),
        "significance.tiff": encoded(".tiff", found.strength.significance),
        "distance.tiff": encoded(".tiff", found.distance),
        "points.csv": _points_csv(found.points),
        _REPORT: _report(found, title, options, edgePoints=len(found.points)),
    }


def on_map(image: RangeImage | None) -> dict[str, Any]:
    """What GeoJSON takes of an image that lies on a map."""
    return {} if image is None else {"transform": image.georeference, "epsg": image.epsg}


def outlines_of(found: RegionResults) -> RegionBoundaries:
    """The outlines of the regions."""
    return boundaries_of(found.labels, found.edges.frame, _OUTLINE)


@named("segment")
def region_files(
    found: RegionResults, title: str, options: Mapping[str, Any], image: RangeImage | None = None
) -> dict[str, bytes]:
    """The files of REGION_FILES, outlines on the map if `image` lies on one."""
    edges, count, seeds = found.edges, len(found.surfaces) - 1, int(found.seeds.max())
    if count > _LABELS:
        raise error(f"labels.png has room for {_LABELS} regions, {count} were found; raise `minArea`")
    if seeds > _LABELS:
        raise error(f"seeds.png has room for {_LABELS} seeds, {seeds} were found; raise `minDistance`")
    overview = region_overview(edges.frame, found.seeds, edges.thin, edges.strength.kind, found.labels, title)
    outlines = outlines_of(found)
    picture = drawRegions(found.labels, edges.surface, alpha=0.3, heightMap=edges.frame.heightMap)
    return {
        "overview.png": encoded(".png", overview),
        "outlines.svg": encoded_lines(".svg", outlines, picture=picture),
        "outlines.geojson": encoded_lines(".geojson", outlines, **on_map(image)),
        "labels.png": encoded(".png", found.labels.astype(np.uint16)),
        "seeds.png": encoded(".png", found.seeds.astype(np.uint16)),
        "surfaces.csv": _surfaces_csv(found.stats, found.surfaces),
        "thin.png": encoded(".png", edges.thin),
        _REPORT: _report(edges, title, options, regions=count, seeds=seeds),
    }


def _report(found: EdgeResults, title: str, options: Mapping[str, Any], **more: int) -> bytes:
    report = {
        "image": title,
        "rangeedge": __version__,
        "options": plain(options),
        "height": found.frame.shape[0],
        "width": found.frame.shape[1],
        "validPixels": int(np.count_nonzero(found.frame.valid)),
        "edgePixels": int(np.count_nonzero(found.thin)),
        **more,
        "understood": plain(found.known),
        "noise": plain(found.frame.noise),
    }
    return json.dumps(report, indent=2, allow_nan=False).encode() + b"\n"


def plain(value: Any) -> Any:
    """Options as JSON knows them; what is no finite number as a string."""
    if isinstance(value, Mapping):
        return {key: plain(v) for key, v in value.items()}
    if dataclasses.is_dataclass(value):
        return plain(dataclasses.asdict(value))
    if isinstance(value, np.ndarray) and value.size > 9:
        return f"{described(value)}, crc32 {zlib.crc32(value.tobytes()):08x}"
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, (tuple, list)):
        return [plain(v) for v in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def encoded(suffix: str, picture: np.ndarray) -> bytes:
    """A picture as the content of a file."""
    return apart(picture.size, cv2.imencode, suffix, picture)[1].tobytes()


def _points_csv(points: np.ndarray) -> bytes:
    formats = {"x": "%.3f", "y": "%.3f", "kind": "%d", "direction": "%d"}
    text = io.StringIO()
    text.write(",".join(points.dtype.names) + "\n")
    row = ",".join(formats.get(name, "%.6g") for name in points.dtype.names) + "\n"
    text.writelines(row % point for point in points.tolist())
    return text.getvalue().encode()


def _surfaces_csv(stats: np.ndarray, surfaces: np.ndarray) -> bytes:
    """Row by row what `segmentRegionsWithStats` returns, the background left out."""
    names = ["label", "left", "top", "width", "height", "area", "curved"]
    names += [f"{vector}_{axis}" for vector in ("centroid", "normal") for axis in "xyz"]
    names += [f"quadric_{coefficient}" for coefficient in "abcdefghij"] + ["rms"]
    lines = [",".join(names)]
    for label, (box, surface) in enumerate(zip(stats[1:].tolist(), surfaces[1:], strict=True), 1):
        reals = (
            np.concatenate([surface["centroid"], surface["normal"], surface["quadric"], [surface["rms"]]]) + 0.0
        )  # -0 is 0
        whole = [label, *box, int(surface["curved"])]
        lines.append(",".join([*map(str, whole), *(f"{value:.9g}" for value in reals.tolist())]))
    return ("\n".join(lines) + "\n").encode()


@named("write")
def write_folder(out: str | os.PathLike[str], files: Mapping[str, bytes]) -> None:
    """Write files into a folder, which is made where it is missing.

    Complete without names first, or under temporary ones, then renamed: no reader ever sees a part of a file, and a new
    folder appears with all of them or not at all. In an existing folder they are replaced one by one, where the report
    is removed first and comes last: a folder that has one holds results of one run.
    """
    out = Path(out)
    ancestor = next(path for path in (out, *out.absolute().parents) if path.exists())
    stage = ancestor / f".{uuid.uuid4().hex}.tmp"
    try:
        with contextlib.ExitStack() as stack:
            whole = {name: nameless(ancestor, data) for name, data in files.items()}
            for file in filter(None, whole.values()):
                stack.enter_context(file)
            stage.mkdir()
            stack.callback(shutil.rmtree, stage, ignore_errors=True)
            for name, data in files.items():
                put(stage / name, whole[name], data)
            if out.exists():
                (out / _REPORT).unlink(missing_ok=True)
                for name in sorted(files, key=lambda name: name == _REPORT):  # the report comes last
                    os.replace(stage / name, out / name)
            else:
                out.absolute().parent.mkdir(parents=True, exist_ok=True)
                stage.rename(out)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error(f"cannot write to {os.fspath(out)!r}: {what}", cv2.Error.StsError) from reason
