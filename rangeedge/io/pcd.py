"""Organized point clouds in PCD files (Point Cloud Library), versions 0.5 to 0.7."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from .. import _core
from .points import points_of, unorganized
from .range_image import RangeImage
from .source import expect_at_least, expect_pixels, expect_unpacked
from .text import header_lines, number, numbers

Header = dict[str, list[str]]


def is_pcd(head: bytes) -> bool:
    """Whether the first line that is neither empty nor a comment is one of a PCD header."""
    if head.startswith(b"# .PCD"):
        return True
    for line, _ in header_lines(head):
        words = line.split()
        if words and not words[0].startswith("#"):
            return words[0].upper() in ("VERSION", "FIELDS", "COLUMNS")
    return False


def read_pcd(data: bytes) -> RangeImage:
    """Points in the axes of the file: ascii, binary or binary_compressed."""
    header, start = _header(data)
    width, height = _naturals(header, "WIDTH", 1)[0], _naturals(header, "HEIGHT", 1, [1])[0]
    if height < 2:
        raise unorganized(f"HEIGHT {height}")
    if _naturals(header, "POINTS", 1, [width * height]) != [width * height]:
        raise ValueError(f"WIDTH {width} and HEIGHT {height} disagree with POINTS {header.get('POINTS')}")
    expect_pixels(height, width)

    layout = _layout(header)
    decode = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}
    encoding = " ".join(header["DATA"]).lower()
    if encoding not in decode:
        raise ValueError(f"unknown DATA {encoding!r}")
    points = points_of(decode[encoding](data, start, layout, width * height))
    viewpoint = _viewpoint(header)
    geometry = {"origin": viewpoint[:3]} if viewpoint is not None and any(viewpoint[:3]) else {}
    return RangeImage(points.reshape(height, width, 3), geometry, viewpoint=viewpoint)


def write_pcd(points: np.ndarray) -> bytes:
    """A binary PCD file of (H, W, 3) points, H > 1."""
    height, width = points.shape[:2]
    if height < 2:
        raise ValueError("at least two rows (a PCD file of one row is an unorganized cloud)")
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {width}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width * height}\nDATA binary\n"
    )
    return header.encode() + points.astype("<f4").tobytes()


@dataclass(frozen=True)
class _Field:
    name: str
    type: np.dtype
    count: int

    @property
    def size(self) -> int:
        return self.type.itemsize * self.count


def _header(data: bytes) -> tuple[Header, int]:
    """The header's lines by their first word, and where the data starts."""
    header: Header = {}
    for line, end in header_lines(data):
        words = line.split()
        if words and not words[0].startswith("#"):
            header[words[0].upper()] = words[1:]
            if "DATA" in header:
                return header, end
    raise ValueError("the header ends before its DATA line")


def _naturals(header: Header, key: str, count: int, default: list[int] | None = None) -> list[int]:
    if key not in header and default is not None:
        return default
    words = header.get(key, [])
    if len(words) != count or not all(word.isdecimal() and len(word) < 20 for word in words):
        raise ValueError(f"the header has no proper {key} line")
    return [int(word) for word in words]


def _layout(header: Header) -> list[_Field]:
    names = header.get("FIELDS") or header.get("COLUMNS") or []  # the latter in version 0.5
    kinds = header.get("TYPE", ["F"] * len(names))
    sizes = _naturals(header, "SIZE", len(names), [4] * len(names))
    counts = _naturals(header, "COUNT", len(names), [1] * len(names))
    types = {(kind, size): np.dtype(f"<{kind.lower()}{size}") for kind in "IU" for size in (1, 2, 4, 8)}
    types |= {("F", 4): np.dtype("<f4"), ("F", 8): np.dtype("<f8")}
    if len(kinds) != len(names) or not all(pair in types for pair in zip(kinds, sizes, strict=True)):
        raise ValueError(f"FIELDS, SIZE and TYPE do not fit: {names}, {sizes}, {kinds}")
    return [_Field(n, types[k, s], c) for n, k, s, c in zip(names, kinds, sizes, counts, strict=True)]


def _viewpoint(header: Header) -> tuple[float, ...] | None:
    """Translation and quaternion (w, x, y, z) of the sensor."""
    words = header.get("VIEWPOINT")
    if words is None:
        return None
    values = np.array([number(word.encode("latin-1")) for word in words])
    if values.shape != (7,) or not np.isfinite(values).all():
        raise ValueError("the header has no proper VIEWPOINT line")
    length = np.linalg.norm(values[3:])
    values[3:] = values[3:] / length if length > 0 else (1, 0, 0, 0)
    return tuple(values.tolist())


def _ascii(data: bytes, start: int, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    per_point = sum(field.count for field in layout)
    table = numbers(data, start, points * per_point).reshape(points, per_point)
    starts = np.cumsum([0, *(field.count for field in layout)])
    return {field.name: table[:, first] for field, first in zip(layout, starts[:-1], strict=True) if field.count == 1}


def _binary(data: bytes, start: int, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    stride = sum(field.size for field in layout)
    expect_at_least(len(data) - start, points * stride)
    columns = {}
    for field in layout:
        if field.count == 1:
            columns[field.name] = np.ndarray(points, field.type, data, start, stride)
        start += field.size
    return columns


def _compressed(data: bytes, start: int, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    """Field after field instead of point after point, compressed as one block."""
    expect_at_least(len(data), start + 8)
    packed, unpacked = struct.unpack_from("<II", data, start)
    expect_at_least(len(data), start + 8 + packed)
    if unpacked != points * sum(field.size for field in layout):
        raise ValueError(f"the header describes {points} points, the compressed block holds {unpacked} bytes")
    expect_unpacked(unpacked, packed)
    block = np.empty(unpacked, np.uint8)
    if not _core.lzf_unpack(np.frombuffer(data, np.uint8, packed, start + 8), block):
        raise ValueError(f"the compressed block is garbled: it does not unpack to {unpacked} bytes")
    columns, at = {}, 0
    for field in layout:
        if field.count == 1:
            columns[field.name] = np.frombuffer(block, field.type, points, at)
        at += field.size * points
    return columns
