"""Chains and segments to files: tables, polylines in space, maps."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

import cv2
import numpy as np

from .._check import described, error, fail, public
from ..chains import EdgeChain, EdgeChains
from ..edges import kindNames
from ..segments import SEGMENT, Segments
from .atomic import write_atomically
from .source import file_name


class _Line(NamedTuple):
    """A polyline with what is known of it as a whole."""

    pixels: np.ndarray
    points: np.ndarray
    closed: bool
    kind: int
    angle: float  # crease or dihedral angle in degrees
    properties: dict[str, Any]


@public
def writeLines(
    filename: str | os.PathLike[str],
    lines: EdgeChains | Sequence[EdgeChain] | Segments | np.ndarray,
    transform: Sequence[float] | None = None,
) -> None:
    """Write chains or segments to a file.

    writeLines(filename, lines[, transform]) -> None

    The suffix decides on the format. ``.csv``: a table of points, or of segments. ``.ply``: vertices x, y, z and edges
    vertex1, vertex2 with kind and angle (the crease of a chain, the dihedral angle of a segment). ``.obj``: a polyline
    a chain. ``.geojson``: a LineString each, in the order x, y, z, with its properties. Either the whole file is
    written or nothing.

    Parameters
    ----------
    filename : str or path
    lines : EdgeChains, sequence of EdgeChain, Segments, or its array of segments
        From `linkEdges` or `fitSegments`.
    transform : six floats, optional
        Only for GeoJSON: x0, dx, rx, y0, ry, dy as GDAL has them, with which pixel (u, v) lies at the coordinates
        x0 + (u + 0.5) dx + (v + 0.5) rx and y0 + (u + 0.5) ry + (v + 0.5) dy. None writes those of the points.

    Raises
    ------
    rangeedge.error
        On a bad argument, an unknown suffix, or if the file cannot be written.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from rangeedge import linkEdges, writeLines
    >>> roof = np.abs(np.arange(64) + 0.3 * np.arange(48)[:, None] - 40.3)
    >>> path = os.path.join(tempfile.mkdtemp(), "ridge.obj")
    >>> writeLines(path, linkEdges(roof, pixelSize=1, noise=0.001))
    >>> with open(path) as file:
    ...     print(file.readline().strip())
    o convex_0
    """
    name = file_name(filename, "filename")
    suffix = PurePath(name).suffix.lower()
    if suffix not in _WRITERS:
        raise error(f"cannot write {name!r}: the suffix must be one of {', '.join(_WRITERS)}")
    if transform is not None:
        transform = _transform(transform, suffix)
    data = encoded_lines(suffix, lines, transform)
    try:
        write_atomically(name, data)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error(f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason


def encoded_lines(suffix: str, lines: Any, transform: Sequence[float] | None = None) -> bytes:
    """Chains or segments as the content of a file."""
    segments = lines.segments if isinstance(lines, Segments) else lines
    found = list(_of_segments(segments) if _are_segments(segments) else _of_chains(segments))
    return _WRITERS[suffix](found, transform)


def _transform(transform: Sequence[float], suffix: str) -> list[float]:
    if suffix != ".geojson":
        raise fail("transform", f"None for {suffix}", described(transform))
    values = np.asarray(transform, dtype=object)
    try:
        numbers = [float(value) for value in values.ravel()]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 6 or not np.isfinite(numbers).all():
        raise fail("transform", "six finite numbers", described(transform))
    return numbers


def _are_segments(lines: Any) -> bool:
    return isinstance(lines, np.ndarray) and lines.dtype == SEGMENT


def _of_chains(chains: Any) -> Iterator[_Line]:
    if not isinstance(chains, Sequence) or not all(isinstance(chain, EdgeChain) for chain in chains):
        raise fail("lines", "EdgeChains, a sequence of EdgeChain, or Segments", described(chains))
    for chain in chains:
        points = chain.points[np.isfinite(chain.points["point"]).all(axis=1)]
        known = {name: getattr(chain, name) for name in ("jump", "crease", "significance", "length", "closed")}
        pixels = np.column_stack([points["x"], points["y"]])
        yield _Line(pixels, points["point"], chain.closed, chain.kind, chain.crease, known)


def _of_segments(segments: np.ndarray) -> Iterator[_Line]:
    for segment in segments:
        names = ("jump", "dihedral", "length", "rms", "endDeviation", "directionDeviation")
        known = {name: float(segment[name]) for name in names}
        known["vertices"] = segment["vertices"].tolist()
        yield _Line(segment["pixels"], segment["ends"], False, int(segment["kind"]), float(segment["dihedral"]), known)


def _csv(lines: list[_Line], transform: Sequence[float] | None) -> bytes:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    names = list(lines[0].properties) if lines else []
    table.writerow(["line", "kind", "u", "v", "x", "y", "z", *names])
    for i, line in enumerate(lines):
        values = [json.dumps(value) if isinstance(value, list) else value for value in line.properties.values()]
        for pixel, point in zip(line.pixels.tolist(), line.points.tolist(), strict=True):
            table.writerow([i, kindNames(line.kind), *pixel, *point, *values])
    return text.getvalue().encode()


def _ways(lines: list[_Line]) -> tuple[np.ndarray, np.ndarray]:
    """The first and second vertex of every edge, and the number of its line."""
    pairs, owners, first = [], [], 0
    for i, line in enumerate(lines):
        index = first + np.arange(len(line.points))
        pair = np.column_stack([index[:-1], index[1:]])
        if line.closed:
            pair = np.vstack([pair, [index[-1], index[0]]])
        pairs.append(pair), owners.append(np.full(len(pair), i))
        first += len(index)
    return (np.concatenate(pairs), np.concatenate(owners)) if lines else (np.zeros((0, 2), int), np.zeros(0, int))


def _ply(lines: list[_Line], transform: Sequence[float] | None) -> bytes:
    pairs, owners = _ways(lines)
    edges = np.zeros(len(pairs), [("vertex1", "<i4"), ("vertex2", "<i4"), ("kind", "u1"), ("angle", "<f4")])
    edges["vertex1"], edges["vertex2"] = pairs.T
    edges["kind"] = np.array([line.kind for line in lines], np.uint8)[owners] if lines else 0
    edges["angle"] = np.array([line.angle for line in lines])[owners] if lines else 0
    vertices = np.concatenate([line.points for line in lines]) if lines else np.zeros((0, 3))
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element edge {len(edges)}",
        "property int vertex1",
        "property int vertex2",
        "property uchar kind",
        "property float angle",
        "end_header\n",
    ]
    return "\n".join(header).encode() + vertices.astype("<f8").tobytes() + edges.tobytes()


def _obj(lines: list[_Line], transform: Sequence[float] | None) -> bytes:
    text, first = [], 1
    for i, line in enumerate(lines):
        text.append(f"o {kindNames(line.kind).replace(' ', '_')}_{i}")
        text += [f"v {x!r} {y!r} {z!r}" for x, y, z in line.points.tolist()]
        index = [*range(first, first + len(line.points)), *([first] if line.closed else [])]
        text.append("l " + " ".join(map(str, index)))
        first += len(line.points)
    return "".join(f"{row}\n" for row in text).encode()


def _geojson(lines: list[_Line], transform: Sequence[float] | None) -> bytes:
    features = []
    for line in lines:
        points = line.points
        if transform is not None:
            x0, dx, rx, y0, ry, dy = transform
            u, v = line.pixels.T + 0.5
            points = np.column_stack([x0 + u * dx + v * rx, y0 + u * ry + v * dy, points[:, 2]])
        if line.closed:
            points = np.vstack([points, points[:1]])
        known = {"kind": kindNames(line.kind), **line.properties}
        known = {name: None if isinstance(v, float) and not np.isfinite(v) else v for name, v in known.items()}
        geometry = {"type": "LineString", "coordinates": points.tolist()}
        features.append({"type": "Feature", "geometry": geometry, "properties": known})
    return json.dumps({"type": "FeatureCollection", "features": features}, allow_nan=False).encode()


_WRITERS: dict[str, Callable[[list[_Line], Sequence[float] | None], bytes]] = {
    ".csv": _csv,
    ".ply": _ply,
    ".obj": _obj,
    ".geojson": _geojson,
}
