"""Lines as tables of vertices: CSV, PLY and OBJ."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import numpy as np

from ..edges import KINDS, kindNames
from .polylines import REGION, Line, no_pixels

_CSV = ("line", "kind", "closed", "u", "v", "x", "y", "z")
_VERTEX = np.dtype([(name, "<f8") for name in "xyzuv"])
_EDGE = np.dtype([("vertex1", "<i4"), ("vertex2", "<i4"), ("kind", "u1"), ("angle", "<f4")])
_PLY_HEAD = """ply
format binary_little_endian 1.0
element vertex {vertices}
property double x
property double y
property double z
property double u
property double v
element edge {edges}
property int vertex1
property int vertex2
property uchar kind
property float angle
end_header
"""


def write_csv(lines: list[Line]) -> bytes:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    names = list(dict.fromkeys(name for line in lines for name in line.properties))
    table.writerow([*_CSV, *names])
    for i, line in enumerate(lines):
        values = [json.dumps(line.properties[name]) if name in line.properties else "" for name in names]
        for pixel, point in zip(line.pixels.tolist(), line.points.tolist(), strict=True):
            table.writerow([i, line.kind, int(line.closed), *pixel, *point, *values])
    return text.getvalue().encode()


def read_csv(data: bytes) -> list[Line]:
    table = csv.reader(io.StringIO(data.decode()))
    head = next(table, [])
    if tuple(head[: len(_CSV)]) != _CSV:
        raise ValueError(f"its columns must begin with {', '.join(_CSV)}")
    rows: dict[str, list[list[str]]] = {}
    for row in table:
        rows.setdefault(row[0], []).append(row)
    lines = []
    for own in rows.values():
        numbers = np.array([row[3:8] for row in own], np.float64)
        texts = dict(zip(head[len(_CSV) :], own[0][len(_CSV) :], strict=True))
        known = {name: json.loads(text) for name, text in texts.items() if text}
        lines.append(Line(own[0][1], own[0][2] == "1", numbers[:, :2], numbers[:, 2:], known))
    return lines


def kind_bits(kind: str) -> int:
    """The bits of a kind by its name; 0 of a region."""
    return sum(KINDS[word] for word in kind.split() if word in KINDS)


def kind_name(bits: int) -> str:
    return kindNames(bits) if bits else REGION


def write_ply(lines: list[Line]) -> bytes:
    counts = np.array([len(line.points) for line in lines], int)
    vertices = np.zeros(counts.sum(), _VERTEX)
    for names, values in (("xyz", [line.points for line in lines]), ("uv", [line.pixels for line in lines])):
        for name, column in zip(names, np.concatenate([np.zeros((0, len(names))), *values]).T, strict=True):
            vertices[name] = column
    edges = []
    for line, first in zip(lines, np.cumsum(counts) - counts, strict=True):
        own = np.zeros(max(len(line.points) - (not line.closed), 0), _EDGE)
        own["vertex1"] = first + np.arange(len(own))
        own["vertex2"] = first + (np.arange(len(own)) + 1) % len(line.points)
        own["kind"], own["angle"] = kind_bits(line.kind), line.angle
        edges.append(own)
    table = np.concatenate([np.zeros(0, _EDGE), *edges])
    return _PLY_HEAD.format(vertices=len(vertices), edges=len(table)).encode() + vertices.tobytes() + table.tobytes()


def read_ply(data: bytes) -> list[Line]:
    head, mark, body = data.partition(b"end_header\n")
    counts = [int(row.split()[2]) for row in head.decode().splitlines() if row.startswith("element ")]
    if not mark or len(counts) != 2 or head + mark != _PLY_HEAD.format(vertices=counts[0], edges=counts[1]).encode():
        raise ValueError("its header is not that of lines")
    if len(body) != counts[0] * _VERTEX.itemsize + counts[1] * _EDGE.itemsize:
        raise ValueError("its length is not what its header says")
    vertices = np.frombuffer(body, _VERTEX, counts[0])
    edges = np.frombuffer(body, _EDGE, counts[1], counts[0] * _VERTEX.itemsize)
    places = np.stack([vertices[name] for name in "xyzuv"], axis=1) if len(vertices) else np.zeros((0, 5))
    begins = np.ones(len(edges), bool)
    begins[1:] = (edges["vertex1"][1:] != edges["vertex2"][:-1]) | (edges["vertex1"][1:] <= edges["vertex1"][:-1])
    lines = []
    for own in np.split(edges, np.flatnonzero(begins)[1:]) if len(edges) else []:
        first, last = int(own["vertex1"][0]), int(own["vertex2"][-1])
        closed = last == first
        index = np.append(own["vertex1"], [] if closed else [last]).astype(int)
        angle = {} if np.isnan(own["angle"][0]) else {"angle": float(own["angle"][0])}
        lines.append(Line(kind_name(int(own["kind"][0])), closed, places[index, 3:], places[index, :3], angle))
    return lines


def write_obj(lines: list[Line]) -> bytes:
    text, first = [], 1
    for i, line in enumerate(lines):
        text.append(f"o {line.kind.replace(' ', '_')}_{i}")
        text += [f"v {x!r} {y!r} {z!r}" for x, y, z in line.points.tolist()]
        index = [*range(first, first + len(line.points)), *([first] if line.closed and len(line.points) else [])]
        text.append("l " + " ".join(map(str, index)))
        first += len(line.points)
    return "".join(f"{row}\n" for row in text).encode()


def read_obj(data: bytes) -> list[Line]:
    vertices, found, kind = [], [], REGION
    for row in data.decode().splitlines():
        word, _, rest = row.partition(" ")
        if word == "o":
            kind = rest.rpartition("_")[0].replace("_", " ")
        elif word == "v":
            vertices.append([float(value) for value in rest.split()[:3]])
        elif word == "l":
            found.append((kind, [int(value.split("/")[0]) - 1 for value in rest.split()]))
    places = np.array(vertices, np.float64).reshape(-1, 3)
    lines: list[Line] = []
    for name, index in found:
        closed = len(index) > 2 and index[0] == index[-1]
        points = places[index[:-1] if closed else index]
        nothing: dict[str, Any] = {}
        lines.append(Line(name, closed, no_pixels(points), points, nothing))
    return lines
