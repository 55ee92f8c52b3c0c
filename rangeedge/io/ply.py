"""Organized point clouds in PLY files, as bytes."""

from __future__ import annotations

import math
import struct
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import NamedTuple

import numpy as np

from .. import _core
from ..bands import bands, by_bands, chosen
from .points import points_of, unorganized
from .source import expect_at_least, expect_pixels
from .text import header_lines, number, words


def read_ply(data: bytes) -> np.ndarray:
    """Points of a PLY file whose rows and columns are known.

    They are where the header says so (Stanford's ``obj_info num_cols``, a comment with width and height), or from
    PCL's ``element camera``. With an element ``range_grid`` the vertices are those that a scanner returned, and the
    grid holds one or none for each pixel; without, there is one vertex a pixel.
    """
    header, elements, body = _ply_header(data)
    wanted = {"vertex", "range_grid", "camera"} & {element.name for element in elements}
    if "vertex" not in wanted:
        raise ValueError("it has no element vertex")
    tables: dict[str, dict[str, np.ndarray]] = {}
    for element in elements:
        if wanted <= tables.keys():
            break
        tables[element.name] = body.table(element)

    points = points_of(tables["vertex"])
    rows, cols = _ply_size(header, tables, len(points))
    expect_pixels(rows, cols)
    if "range_grid" not in tables:
        if rows * cols != len(points):
            raise ValueError(f"{rows} rows of {cols} columns do not hold its {len(points)} vertices")
        return points.reshape(rows, cols, 3)

    index = next(iter(tables["range_grid"].values()))
    if rows * cols != len(index):
        raise ValueError(f"{rows} rows of {cols} columns do not hold the {len(index)} pixels of its range_grid")
    if not index.max() < len(points):
        raise ValueError(f"its range_grid refers to vertex {index.max():g} of {len(points)}")

    def seen(index: np.ndarray) -> np.ndarray:
        hit = index >= 0
        own = np.full((len(index), 3), np.nan, np.float32)
        own[hit] = points[index[hit].astype(np.int64)]
        return own

    return by_bands(seen, index).reshape(rows, cols, 3)


def write_ply(points: np.ndarray) -> bytes:
    """A binary PLY file of (H, W, 3) points with a range_grid, as Stanford's scans have it."""
    height, width = points.shape[:2]
    valid = by_bands(lambda own: np.isfinite(own).all(axis=-1), points).ravel()
    vertices = b"".join(own.astype("<f4").tobytes() for own in chosen(points.reshape(-1, 3), valid))
    count = len(vertices) // 12
    header = (
        f"ply\nformat binary_little_endian 1.0\nobj_info num_cols {width}\nobj_info num_rows {height}\n"
        f"element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element range_grid {width * height}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    # A pixel is a byte 0, or a byte 1 and the index of its vertex.
    grid, first = [], 0
    for some in bands(valid):
        own = valid[some]
        entry = np.zeros(len(own), [("count", "u1"), ("index", "<i4")])
        entry["count"] = own
        entry["index"][own] = np.arange(first, first := first + np.count_nonzero(own))
        used = np.repeat(own[:, None], 5, axis=1)
        used[:, 0] = True
        grid.append(entry.view(np.uint8).reshape(-1, 5)[used].tobytes())
    return b"".join([header.encode(), vertices, *grid])


class _Property(NamedTuple):
    name: str
    type: str
    length_type: str | None  # of a list; None: one value


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


_PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
_COUNTS = ("u1", "u2", "u4", "i4")  # lengths of lists that the kernel reads; below zero they exceed the file
_STRUCT_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}


class _PlyBody:
    """What follows the header, read element after element."""

    def __init__(self, data: bytes, start: int, byte_order: str) -> None:
        self.data, self.at, self.byte_order = data, start, byte_order

    def table(self, element: _Element) -> dict[str, np.ndarray]:
        """The columns of an element; of a list its first item, -1 where it is empty."""
        if not element.properties:
            raise ValueError(f"its element {element.name} has no properties")
        if all(prop.length_type is None for prop in element.properties):
            return self._scalars(element)
        if self.byte_order and len(element.properties) == 1 and element.properties[0].length_type in _COUNTS:
            return self._lists(element)
        try:
            firsts = np.array(array("d", self._firsts(element)))
        except (struct.error, IndexError, OverflowError):
            raise ValueError(f"it ends within its element {element.name}") from None
        return _columns(element, firsts)

    def _scalars(self, element: _Element) -> dict[str, np.ndarray]:
        layout = np.dtype([(prop.name, self.byte_order + prop.type) for prop in element.properties])
        end = self.at + element.count * layout.itemsize
        expect_at_least(len(self.data), end)
        records = np.ndarray(element.count, layout, self.data, self.at)
        self.at = end
        return {prop.name: records[prop.name] for prop in element.properties}

    def _lists(self, element: _Element) -> dict[str, np.ndarray]:
        """The first items of an element that is one list, as of a range_grid or of faces."""
        (prop,) = element.properties
        data = np.frombuffer(self.data, np.uint8, offset=self.at)
        length, item = np.dtype(prop.length_type), np.dtype(self.byte_order + prop.type)
        expect_at_least(len(data), element.count * length.itemsize)
        at = np.empty(element.count, np.int64)
        end = _core.ply_first_items(data, length.itemsize, self.byte_order == ">", item.itemsize, at)
        expect_at_least(len(data), end)
        self.at += end
        anywhere = np.ndarray(max(len(data) - item.itemsize + 1, 0), item, self.data, self.at - end, strides=(1,))

        def first(at: np.ndarray) -> np.ndarray:
            values = np.full(len(at), -1.0)
            values[at >= 0] = anywhere[at[at >= 0]]
            return values

        return {prop.name: by_bands(first, at)}

    def _firsts(self, element: _Element) -> Iterator[float]:
        readers = [
            (self._struct(prop.length_type) if prop.length_type else None, self._struct(prop.type))
            for prop in element.properties
        ]
        data, at = self.data, self.at
        for _ in range(element.count):
            for length_reader, item_reader in readers:
                length = 1
                if length_reader is not None:
                    length = _length(length_reader.unpack_from(data, at)[0])
                    at += length_reader.size
                yield item_reader.unpack_from(data, at)[0] if length else -1
                at += length * item_reader.size
        expect_at_least(len(data), at)
        self.at = at

    def _struct(self, kind: str) -> struct.Struct:
        return struct.Struct(self.byte_order + _STRUCT_CODES[kind])


class _PlyText(_PlyBody):
    """The same of an ascii file, where every value is a word."""

    def __init__(self, data: bytes, start: int) -> None:
        super().__init__(data, start, "")
        self._words = chain.from_iterable(words(data, start))

    def _scalars(self, element: _Element) -> dict[str, np.ndarray]:
        values = element.count * len(element.properties)
        expect_at_least((len(self.data) - self.at + 1) // 2, values, "values")
        found = np.fromiter(map(number, islice(self._words, values)), np.float64)
        expect_at_least(len(found), values, "values")
        return _columns(element, found)

    def _firsts(self, element: _Element) -> Iterator[float]:
        for _ in range(element.count):
            for prop in element.properties:
                length = 1 if prop.length_type is None else _length(self._next(element))
                yield self._next(element) if length else -1
                for _ in range(length - 1):
                    self._next(element)

    def _next(self, element: _Element) -> float:
        word = next(self._words, None)
        if word is None:
            raise ValueError(f"it ends within its element {element.name}")
        return number(word)


def _columns(element: _Element, values: np.ndarray) -> dict[str, np.ndarray]:
    columns = values.reshape(element.count, len(element.properties)).T
    return {prop.name: column for prop, column in zip(element.properties, columns, strict=True)}


def _length(length: float) -> int:
    if not 0 <= length < math.inf or length != int(length):
        raise ValueError(f"it has a list of length {length}")
    return int(length)


def _ply_header(data: bytes) -> tuple[dict[str, int], list[_Element], _PlyBody]:
    """The sizes named in comments, the elements, and the body."""
    sizes: dict[str, int] = {}
    elements: list[_Element] = []
    encoding = ""
    for line, end in header_lines(data):
        match line.split():
            case ["format", encoding, _]:
                pass
            case ["comment" | "obj_info", key, value] if value.isdecimal():
                sizes[key.lower().rstrip(":=")] = int(value[:16])
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count[:16]), []))
            case ["property", "list", length, kind, name] if elements and {length, kind} <= _PLY_TYPES.keys():
                elements[-1].properties.append(_Property(name, _PLY_TYPES[kind], _PLY_TYPES[length]))
            case ["property", kind, name] if elements and kind in _PLY_TYPES:
                elements[-1].properties.append(_Property(name, _PLY_TYPES[kind], None))
            case ["ply" | "comment" | "obj_info", *_] | []:
                pass
            case ["end_header"]:
                return sizes, elements, _body(encoding, data, end)
            case _:
                raise ValueError(f"its header has the line {line[:60]!r}")
    raise ValueError("its header has no end")


def _body(encoding: str, data: bytes, start: int) -> _PlyBody:
    if encoding == "ascii":
        return _PlyText(data, start)
    if encoding not in ("binary_little_endian", "binary_big_endian"):
        raise ValueError(f"unknown format {encoding!r}")
    return _PlyBody(data, start, "<" if encoding == "binary_little_endian" else ">")


def _ply_size(header: dict[str, int], tables: dict[str, dict[str, np.ndarray]], vertices: int) -> tuple[int, int]:
    """Rows and columns of the scan."""
    for rows, cols in (("num_rows", "num_cols"), ("height", "width"), ("rows", "cols")):
        if rows in header and cols in header and header[rows] * header[cols] > 0:
            return header[rows], header[cols]
    view = tables.get("camera", {})
    if {"viewportx", "viewporty"} <= view.keys() and len(view["viewportx"]) == 1:
        height, width = int(view["viewporty"][0]), int(view["viewportx"][0])
        if height > 1 and width > 1 and height * width == vertices:
            return height, width
    raise unorganized("no obj_info num_cols and num_rows, no comment with width and height")
