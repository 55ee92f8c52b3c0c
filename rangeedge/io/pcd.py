"""Organized point clouds in PCD files (Point Cloud Library), as bytes."""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

from .points import UNORGANIZED, numbers, points_of, require


def read_pcd(data: bytes) -> np.ndarray:
    """Points of a PCD file, version 0.7: ascii, binary or binary_compressed."""
    header, start = _pcd_header(data)
    width, height = _pcd_integers(header, "WIDTH", 1)[0], _pcd_integers(header, "HEIGHT", 1)[0]
    if height < 2:
        raise ValueError(UNORGANIZED.format(f"HEIGHT {height}"))
    if width < 1 or _pcd_integers(header, "POINTS", 1, [width * height]) != [width * height]:
        raise ValueError(f"WIDTH {width} and HEIGHT {height} disagree with POINTS {header.get('POINTS')}")

    layout = _pcd_layout(header)
    decode = {"ascii": _pcd_ascii, "binary": _pcd_binary, "binary_compressed": _pcd_compressed}
    encoding = " ".join(header["DATA"]).lower()
    if encoding not in decode:
        raise ValueError(f"unknown DATA {encoding!r}")
    columns = decode[encoding](data[start:], layout, width * height)
    return points_of(columns).reshape(height, width, 3)


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
    table = numbers(body, points * per_point).reshape(points, per_point)
    starts = np.cumsum([0, *(field.count for field in layout)])
    return {field.name: table[:, start] for field, start in zip(layout, starts[:-1], strict=True) if field.count == 1}


def _pcd_binary(body: bytes, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    stride = sum(field.type.itemsize * field.count for field in layout)
    require(body, points * stride)
    columns, offset = {}, 0
    for field in layout:
        if field.count == 1:
            columns[field.name] = np.ndarray(points, field.type, body, offset, stride)
        offset += field.type.itemsize * field.count
    return columns


def _pcd_compressed(body: bytes, layout: list[_Field], points: int) -> dict[str, np.ndarray]:
    """Field after field instead of point after point, compressed as one block."""
    require(body, 8)
    packed, unpacked = struct.unpack_from("<II", body)
    require(body, 8 + packed)
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
