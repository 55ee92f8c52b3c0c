"""Organized point clouds in PCD and PLY files, as bytes.

The readers return (H, W, 3) float32 points in the axes of the file, NaN where there is none, and raise ValueError with
a reason for everything else. Sizes in a header are checked against the bytes that follow before anything is allocated.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

_UNORGANIZED = "the cloud is unorganized ({}): scan lines need the rows and columns it was taken in"


def read_pcd(data: bytes) -> np.ndarray:
    """Points of a PCD file, version 0.7: ascii, binary or binary_compressed."""
    header, start = _pcd_header(data)
    width, height = _pcd_integers(header, "WIDTH", 1)[0], _pcd_integers(header, "HEIGHT", 1)[0]
    if height < 2:
        raise ValueError(_UNORGANIZED.format(f"HEIGHT {height}"))
    if width < 1 or _pcd_integers(header, "POINTS", 1, [width * height]) != [width * height]:
        raise ValueError(f"WIDTH {width} and HEIGHT {height} disagree with POINTS {header.get('POINTS')}")

    layout = _pcd_layout(header)
    decode = {"ascii": _pcd_ascii, "binary": _pcd_binary, "binary_compressed": _pcd_compressed}
    encoding = " ".join(header["DATA"]).lower()
    if encoding not in decode:
        raise ValueError(f"unknown DATA {encoding!r}")
    columns = decode[encoding](data[start:], layout, width * height)
    return _points(columns).reshape(height, width, 3)


def write_pcd(points: np.ndarray) -> bytes:
    """A binary PCD file of (H, W, 3) points, H > 1."""
    height, width = points.shape[:2]
    if height < 2:
        raise ValueError("at least two rows (a PCD file of one row is an unorganized cloud)")
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {width}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width * height}\nDATA binary\n"
    )
    return header.encode() + points[..., :3].astype("<f4").tobytes()


class _Field(NamedTuple):
    name: str
    type: np.dtype
    count: int


def _pcd_header(data: bytes) -> tuple[dict[str, list[str]], int]:
    """The header's lines by their first word, and where the data starts."""
    header: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in header:
        end = data.find(b"\n", start)
        if end < 0:
            raise ValueError("the header ends before its DATA line")
        words = data[start:end].decode("latin-1").split()
        if words and not words[0].startswith("#"):
            header[words[0]] = words[1:]
        start = end + 1
    return header, start


def _pcd_integers(header: dict[str, list[str]], key: str, count: int, default: list[int] | None = None) -> list[int]:
    if key not in header and default is not None:
        return default
    words = header.get(key, [])
    if len(words) != count or not all(word.isdecimal() for word in words):
        raise ValueError(f"the header has no proper {key} line")
    return [int(word) for word in words]


def _pcd_layout(header: dict[str, list[str]]) -> list[_Field]:
    names, kinds = header.get("FIELDS", []), header.get("TYPE", [])
    sizes = _pcd_integers(header, "SIZE", len(names))
    counts = _pcd_integers(header, "COUNT", len(names), [1] * len(names))
    types = {(kind, size): np.dtype(f"<{kind.lower()}{size}") for kind in "IU" for size in (1, 2, 4, 8)}
    types |= {("F", 4): np.dtype("<f4"), ("F", 8): np.dtype("<f8")}
    if len(kinds) != len(names) or not all(pair in types for pair in zip(kinds, sizes, strict=True)):
        raise ValueError(f"FIELDS, SIZE and TYPE do not fit: {names}, {sizes}, {kinds}")
    return [_Field(n, types[k, s], c) for n, k, s, c in zip(names, kinds, sizes, counts, strict=True)]


def _pcd_ascii(body: bytes, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    per_point = sum(field.count for field in layout)
    numbers = _numbers(body, points * per_point).reshape(points, per_point)
    starts = np.cumsum([0, *(field.count for field in layout)])
    return {field.name: numbers[:, start] for field, start in zip(layout, starts[:-1], strict=True) if field.count == 1}


def _pcd_binary(body: bytes, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    stride = sum(field.type.itemsize * field.count for field in layout)
    _require(body, points * stride)
    columns, offset = {}, 0
    for field in layout:
        if field.count == 1:
            columns[field.name] = np.ndarray(points, field.type, body, offset, stride)
        offset += field.type.itemsize * field.count
    return columns


def _pcd_compressed(body: bytes, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    """Field after field instead of point after point, compressed as one block."""
    _require(body, 8)
    packed, unpacked = struct.unpack_from("<II", body)
    _require(body, 8 + packed)
    if unpacked != points * sum(field.type.itemsize * field.count for field in layout):
        raise ValueError(f"the header describes {points} points, the compressed block holds {unpacked} bytes")
    block = lzf_decompress(body[8 : 8 + packed], unpacked)
    columns, offset = {}, 0
    for field in layout:
        if field.count == 1:
            columns[field.name] = np.frombuffer(block, field.type, points, offset)
        offset += field.type.itemsize * field.count * points
    return columns


def lzf_decompress(data: bytes, size: int) -> bytes:
    """The `size` bytes that LibLZF packed into `data`.

    A control byte below 32 announces that many literal bytes and one more. Any other holds the length of a repetition
    in its upper three bits (7: the next byte is added) and, with the byte that follows, its distance in the lower 13.
    """
    out = bytearray()
    at = 0
    try:
        while at < len(data) and len(out) <= size:
            control = data[at]
            at += 1
            if control < 32:
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            length += 2
            distance = ((control & 31) << 8) + data[at] + 1
            at += 1
            if distance > len(out):
                raise ValueError("the compressed block refers to bytes before its start")
            repeated = out[-distance:][:length]
            out += (repeated * (length // distance + 1))[:length]
    except IndexError:
        raise ValueError("the compressed block ends early") from None
    if len(out) != size or at != len(data):
        raise ValueError(f"the compressed block does not unpack to {size} bytes")
    return bytes(out)


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

    points = _points(tables["vertex"])
    rows, cols = _ply_size(header, tables, len(points))
    if "range_grid" not in tables:
        if rows * cols != len(points):
            raise ValueError(f"{rows} rows of {cols} columns do not hold its {len(points)} vertices")
        return points.reshape(rows, cols, 3)

    index = next(iter(tables["range_grid"].values()))
    if rows * cols != len(index):
        raise ValueError(f"{rows} rows of {cols} columns do not hold the {len(index)} pixels of its range_grid")
    if not index.max() < len(points):
        raise ValueError(f"its range_grid refers to vertex {index.max():g} of {len(points)}")
    image = np.full((rows * cols, 3), np.nan, np.float32)
    hit = index >= 0
    image[hit] = points[index[hit].astype(np.int64)]
    return image.reshape(rows, cols, 3)


def write_ply(points: np.ndarray) -> bytes:
    """A binary PLY file of (H, W, 3) points with a range_grid, as Stanford's scans have it."""
    height, width = points.shape[:2]
    valid = np.isfinite(points[..., :3]).all(axis=-1).ravel()
    vertices = points[..., :3].reshape(-1, 3)[valid].astype("<f4")
    header = (
        f"ply\nformat binary_little_endian 1.0\nobj_info num_cols {width}\nobj_info num_rows {height}\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element range_grid {width * height}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    # A pixel is a byte 0, or a byte 1 and the index of its vertex.
    entry = np.zeros(len(valid), [("count", "u1"), ("index", "<i4")])
    entry["count"] = valid
    entry["index"][valid] = np.arange(len(vertices))
    used = np.repeat(valid[:, None], 5, axis=1)
    used[:, 0] = True
    return header.encode() + vertices.tobytes() + entry.view(np.uint8).reshape(-1, 5)[used].tobytes()


class _Property(NamedTuple):
    name: str
    type: str
    length_type: str | None  # of a list; None: one value


class _Element(NamedTuple):
    name: str
    count: int
    properties: list[_Property]


_PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
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
        try:
            firsts = self._firsts(element)
        except (struct.error, IndexError, OverflowError):
            raise ValueError(f"it ends within its element {element.name}") from None
        columns = np.array(firsts, dtype=np.float64).reshape(element.count, len(element.properties)).T
        return {prop.name: column for prop, column in zip(element.properties, columns, strict=True)}

    def _scalars(self, element: _Element) -> dict[str, np.ndarray]:
        layout = np.dtype([(prop.name, self.byte_order + prop.type) for prop in element.properties])
        end = self.at + element.count * layout.itemsize
        _require(self.data, end)
        records = np.ndarray(element.count, layout, self.data, self.at)
        self.at = end
        return {prop.name: records[prop.name] for prop in element.properties}

    def _firsts(self, element: _Element) -> list[float]:
        readers = [
            (self._struct(prop.length_type) if prop.length_type else None, self._struct(prop.type))
            for prop in element.properties
        ]
        data, at, firsts = self.data, self.at, []
        for _ in range(element.count):
            for length_reader, item_reader in readers:
                length = 1
                if length_reader is not None:
                    length = _length(length_reader.unpack_from(data, at)[0])
                    at += length_reader.size
                firsts.append(item_reader.unpack_from(data, at)[0] if length else -1)
                at += length * item_reader.size
        _require(data, at)
        self.at = at
        return firsts

    def _struct(self, kind: str) -> struct.Struct:
        return struct.Struct(self.byte_order + _STRUCT_CODES[kind])


class _PlyText(_PlyBody):
    """The same of an ascii file, where every value is a word."""

    def __init__(self, data: bytes, start: int) -> None:
        super().__init__(data[start:].split(), 0, "")

    def _scalars(self, element: _Element) -> dict[str, np.ndarray]:
        width = len(element.properties)
        end = self.at + element.count * width
        _require(self.data, end, "values")
        columns = np.array([float(word) for word in self.data[self.at : end]]).reshape(element.count, width).T
        self.at = end
        return {prop.name: column for prop, column in zip(element.properties, columns, strict=True)}

    def _firsts(self, element: _Element) -> list[float]:
        firsts = []
        for _ in range(element.count):
            for prop in element.properties:
                length = 1
                if prop.length_type is not None:
                    length = _length(int(self.data[self.at]))
                    self.at += 1
                firsts.append(float(self.data[self.at]) if length else -1)
                self.at += length
        _require(self.data, self.at, "values")
        return firsts


def _length(length: float) -> int:
    if length < 0 or length != int(length):
        raise ValueError(f"it has a list of length {length}")
    return int(length)


def _ply_header(data: bytes) -> tuple[dict[str, int], list[_Element], _PlyBody]:
    """The sizes named in comments, the elements, and the body."""
    end = re.search(rb"^end_header[ \t]*\r?\n", data, re.MULTILINE)
    if end is None:
        raise ValueError("its header has no end")
    sizes: dict[str, int] = {}
    elements: list[_Element] = []
    encoding = ""
    for line in data[: end.start()].decode("latin-1").splitlines():
        match line.split():
            case ["format", encoding, _]:
                pass
            case ["comment" | "obj_info", key, value] if value.isdecimal():
                sizes[key.lower().rstrip(":=")] = int(value)
            case ["element", name, count] if count.isdecimal():
                elements.append(_Element(name, int(count), []))
            case ["property", "list", length, kind, name] if elements and {length, kind} <= _PLY_TYPES.keys():
                elements[-1].properties.append(_Property(name, _PLY_TYPES[kind], _PLY_TYPES[length]))
            case ["property", kind, name] if elements and kind in _PLY_TYPES:
                elements[-1].properties.append(_Property(name, _PLY_TYPES[kind], None))
            case ["ply" | "comment" | "obj_info", *_] | []:
                pass
            case _:
                raise ValueError(f"its header has the line {line[:60]!r}")
    if encoding == "ascii":
        return sizes, elements, _PlyText(data, end.end())
    if encoding not in ("binary_little_endian", "binary_big_endian"):
        raise ValueError(f"unknown format {encoding!r}")
    return sizes, elements, _PlyBody(data, end.end(), "<" if encoding == "binary_little_endian" else ">")


def _ply_size(header: dict[str, int], tables: dict[str, dict[str, np.ndarray]], vertices: int) -> tuple[int, int]:
    """Rows and columns of the scan."""
    for rows, cols in (("num_rows", "num_cols"), ("height", "width"), ("rows", "cols")):
        if rows in header and cols in header and header[rows] * header[cols] > 0:
            return header[rows], header[cols]
    view = tables.get("camera", {})
    if {"viewportx", "viewporty"} <= view.keys() and len(view["viewportx"]) == 1:
        rows, cols = int(view["viewporty"][0]), int(view["viewportx"][0])
        if cols > 1 and rows > 1 and rows * cols == vertices:
            return rows, cols
    raise ValueError(_UNORGANIZED.format("no obj_info num_cols and num_rows, no comment with width and height"))


def _points(columns: dict[str, np.ndarray]) -> np.ndarray:
    """(N, 3) float32 of the columns x, y and z, NaN wherever one of them is not finite."""
    if not {"x", "y", "z"} <= columns.keys():
        raise ValueError(f"its points have no x, y and z but {', '.join(columns) or 'nothing'}")
    with np.errstate(over="ignore", invalid="ignore"):
        points = np.stack([columns[axis] for axis in "xyz"], axis=-1).astype(np.float32)
    points[~np.isfinite(points).all(axis=-1)] = np.nan
    return points


def _require(data: Sequence[Any], size: int, unit: str = "bytes") -> None:
    if len(data) < size:
        raise ValueError(f"it is truncated: {len(data)} {unit} where {size} are needed")


def _numbers(text: bytes, count: int) -> np.ndarray:
    words = text.split()
    if len(words) != count:
        raise ValueError(f"it holds {len(words)} values where {count} are needed")
    return np.array([float(word) for word in words])
