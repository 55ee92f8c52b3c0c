"""What the command line writes: every result as a file that other tools open, a whole folder in one step."""

from __future__ import annotations

import dataclasses
import io
import json
import os
import shutil
import uuid
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from ._args import described, error
from .detector import selected_of
from .distance import distanceTransform
from .draw import drawOverview
from .edges import EdgeStrength, frame_of, params_of, points_of, strength_of
from .geometry import RangeFrame
from .noise import noise_of
from .thinning import thinEdges

SELECTION = ("jumpThreshold", "creaseThreshold", "hysteresis", "minLength", "dynamic")

EDGE_FILES = {
    "overview.png": "everything in one picture",
    "thin.png": "the edges, one pixel wide: 255, elsewhere 0",
    "edges.png": "the edges before thinning: 255, elsewhere 0",
    "kind.png": "bits of every pixel: 1 jump, 2 convex, 4 concave, 8 nearer side, 16 farther side, 32 beside no data",
    "jump.tiff": "jump strength of every candidate, a length (float32)",
    "crease.tiff": "crease strength of every candidate, in degrees (float32)",
    "significance.tiff": "strength over its standard deviation (float32)",
    "distance.tiff": "distance to the nearest thin edge, in pixels (float32)",
    "points.csv": "candidates with subpixel positions: x, y, jump, crease, kind, significance, direction",
    "report.json": "the image, the options, and what was found, in numbers",
}


class EdgeResults(NamedTuple):
    """Everything that `detect` writes, as arrays."""

    frame: RangeFrame
    noise: Any
    heightMap: bool
    strength: EdgeStrength
    points: np.ndarray
    edges: np.ndarray
    thin: np.ndarray
    distance: np.ndarray

    @property
    def surface(self) -> np.ndarray:
        """The range image as pictures take it: float32, NaN without data, heights where it is a height map."""
        depth = self.frame.depth.astype(np.float32)
        return -depth if self.heightMap else depth


def find_edges(src: np.ndarray, *, mask: np.ndarray | None = None, **options: Any) -> EdgeResults:
    """What `detectEdges` returns, with all that it computes on the way."""
    func = "detectEdges"
    selection = {name: options.pop(name) for name in SELECTION if name in options}
    params = params_of(func, options.pop("eps", None), options)
    frame = frame_of(func, src, params, mask)
    if params.noise is None:
        params = dataclasses.replace(params, noise=noise_of(frame))
    strength = strength_of(func, frame, params)
    edges = selected_of(func, strength, **selection)
    thin = thinEdges(edges)
    points = points_of(func, frame, params)
    return EdgeResults(frame, params.noise, params.heightMap, strength, points, edges, thin, distanceTransform(thin))


def edge_files(found: EdgeResults, title: str, options: Mapping[str, Any]) -> dict[str, bytes]:
    """The files of EDGE_FILES."""
    from . import __version__

    report = {
        "image": title,
        "rangeedge": __version__,
        "options": plain(options),
        "height": found.frame.shape[0],
        "width": found.frame.shape[1],
        "validPixels": int(np.count_nonzero(found.frame.valid)),
        "edgePixels": int(np.count_nonzero(found.thin)),
        "edgePoints": len(found.points),
        "noise": plain(found.noise),
    }
    overview = drawOverview(
        found.surface, found.strength, found.thin, found.distance, title=title, heightMap=found.heightMap
    )
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
        "report.json": json.dumps(report, indent=2).encode() + b"\n",
    }


def plain(value: Any) -> Any:
    """Options as JSON knows them."""
    if isinstance(value, Mapping):
        return {key: plain(v) for key, v in value.items()}
    if dataclasses.is_dataclass(value):
        return dataclasses.asdict(value)
    if isinstance(value, np.ndarray):
        return value.tolist() if value.size <= 9 else f"{described(value)}, crc32 {zlib.crc32(value.tobytes()):08x}"
    return list(value) if isinstance(value, tuple) else value


def encoded(suffix: str, picture: np.ndarray) -> bytes:
    """A picture as the content of a file."""
    return cv2.imencode(suffix, picture)[1].tobytes()


def _points_csv(points: np.ndarray) -> bytes:
    formats = {"x": "%.3f", "y": "%.3f", "kind": "%d", "direction": "%d"}
    text = io.StringIO()
    text.write(",".join(points.dtype.names) + "\n")
    row = ",".join(formats.get(name, "%.6g") for name in points.dtype.names) + "\n"
    text.writelines(row % point for point in points.tolist())
    return text.getvalue().encode()


def write_folder(out: str | os.PathLike[str], files: Mapping[str, bytes]) -> None:
    """Write files into a folder, which is made where it is missing: all of them, or none.

    Complete under temporary names first, then renamed, so no reader ever sees a part of a file.
    """
    out = Path(out)
    ancestor = next(path for path in (out, *out.absolute().parents) if path.exists())
    stage = ancestor / f".{uuid.uuid4().hex}.tmp"
    try:
        stage.mkdir()
        try:
            for name, data in files.items():
                (stage / name).write_bytes(data)
            if out.exists():
                for name in files:
                    os.replace(stage / name, out / name)
            else:
                out.absolute().parent.mkdir(parents=True, exist_ok=True)
                stage.rename(out)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error("write", f"cannot write to {os.fspath(out)!r}: {what}", cv2.Error.StsError) from reason
