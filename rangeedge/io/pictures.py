"""Pictures of one channel: PNG, PGM and PFM."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import cv2
import numpy as np

from .. import _core
from ..cancellation import apart
from .source import HEADER_LIMIT, expect_at_least, expect_pixels, expect_unpacked, inflate
from .text import numbers

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_PNG_COLOURS = {0: "grey values", 2: "colours", 3: "a palette", 4: "opacity", 6: "colours"}  # by colour type


def read_png(data: bytes) -> np.ndarray:
    """Grey values of 16 bits; OpenCV, which reads them too, prints and does not tell what is wrong."""
    width, height, bits, colour, method, filters, interlaced, packed = _png_chunks(data)
    if colour not in _PNG_COLOURS or bits not in (1, 2, 4, 8, 16) or method or filters or interlaced > 1:
        raise ValueError("its header is garbled")
    if colour != 0:
        raise ValueError(f"it holds {_PNG_COLOURS[colour]}, no range image, which is a PNG of one channel of 16 bits")
    if bits != 16:
        raise ValueError(f"it holds {bits} bits (8 bits are too coarse for edges); a range image is a PNG of 16 bits")
    expect_pixels(height, width)
    expect_unpacked(2 * width * height, len(data))

    if not interlaced:
        (picture,) = _unfiltered(packed, [(height, width)])
        return picture
    picture = np.empty((height, width), ">u2")
    parts = [part for p in _ADAM7 if (part := picture[p]).size]
    for part, pixels in zip(parts, _unfiltered(packed, [part.shape for part in parts]), strict=True):
        part[...] = pixels
    return picture


# The pixels of each pass of an interlaced picture.
_ADAM7 = (
    *(np.s_[::8, ::8], np.s_[::8, 4::8], np.s_[4::8, ::4], np.s_[::4, 2::4]),
    *(np.s_[2::4, ::2], np.s_[::2, 1::2], np.s_[1::2, :]),
)


def _unfiltered(packed: bytes, shapes: list[tuple[int, int]]) -> Iterator[np.ndarray]:
    """Pictures of these shapes, one after the other."""
    size = sum(rows * (1 + 2 * cols) for rows, cols in shapes)
    filtered = np.frombuffer(inflate(packed, size), np.uint8)
    expect_at_least(len(filtered), size)
    at = 0
    for rows, cols in shapes:
        plain = np.empty((rows, 2 * cols), np.uint8)
        end = at + rows * (1 + 2 * cols)
        if not _core.png_unfilter(filtered[at:end], 2, plain):
            raise ValueError("it is garbled: a row has an unknown filter")
        yield plain.view(">u2")
        at = end


def _png_chunks(data: bytes) -> tuple[int, int, int, int, int, int, int, bytes]:
    """The header's values, and the packed pixels of all chunks that hold them."""
    header, packed = b"", []
    at, kind = 8, b""
    while kind != b"IEND":
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        if at + 12 + length > len(data):
            raise ValueError("it is truncated, or the lengths of its chunks are garbled")
        body = memoryview(data)[at + 8 : at + 8 + length]
        if zlib.crc32(body, zlib.crc32(kind)) != int.from_bytes(data[at + 8 + length : at + 12 + length], "big"):
            raise ValueError(f"it is garbled: the check sum of its chunk {kind.decode('latin-1')!r} is wrong")
        if at == 8 and kind == b"IHDR":
            header = bytes(body)
        elif kind == b"IDAT":
            packed.append(body)
        at += 12 + length
    if len(header) != 13:
        raise ValueError("its header is garbled")
    return *struct.unpack(">IIBBBBB", header), b"".join(packed)


def write_png(src: np.ndarray) -> bytes:
    if src.ndim != 2 or src.dtype != np.uint16:
        raise ValueError("(H, W) uint16")
    written, data = apart(src.size, cv2.imencode, ".png", src)
    if not written:
        raise ValueError("what OpenCV can encode")
    return data.tobytes()


def read_pgm(data: bytes) -> np.ndarray:
    """Grey values, as text (P2) or big-endian words (P5)."""
    (magic, *words), start = _netpbm_header(data, 4)
    width, height, top = (_natural(word) for word in words)
    expect_pixels(height, width)
    if not 0 < top < 65536:
        raise ValueError(f"its largest value {top} is not from 1 to 65535")
    if top < 256:
        raise ValueError("it holds 8 bits (8 bits are too coarse for edges); a range image is a PGM of 16 bits")
    if magic == b"P2":
        values = numbers(data, start, width * height)
    else:
        values = np.frombuffer(data, ">u2", width * height, _body(data, start, 2 * width * height))
    if values.min() < 0 or values.max() > top:
        raise ValueError(f"it holds values outside of 0 to {top}, which its header names as the largest")
    return values.astype(np.uint16).reshape(height, width)


def write_pgm(src: np.ndarray) -> bytes:
    if src.ndim != 2 or src.dtype != np.uint16:
        raise ValueError("(H, W) uint16")
    return b"P5\n%d %d\n65535\n" % src.shape[::-1] + src.astype(">u2").tobytes()


def read_pfm(data: bytes) -> np.ndarray:
    """Rows from bottom to top; a negative scale means little-endian, its size is a hint that no reader agrees on."""
    (magic, *words, scale), start = _netpbm_header(data, 4)
    if magic == b"PF":
        raise ValueError("it holds colours, no range image")
    width, height = (_natural(word) for word in words)
    expect_pixels(height, width)
    try:
        order = "<" if float(scale) < 0 else ">"
    except ValueError:
        raise ValueError(f"its PFM header is garbled: scale {scale.decode('latin-1')!r}") from None
    body = _body(data, start, 4 * width * height)
    return np.frombuffer(data, order + "f4", width * height, body).reshape(height, width)[::-1]


def write_pfm(src: np.ndarray) -> bytes:
    if src.ndim != 2 or src.dtype.kind != "f":
        raise ValueError("(H, W) floats")
    with np.errstate(over="ignore", invalid="ignore"):
        return b"Pf\n%d %d\n-1.0\n" % src.shape[::-1] + src[::-1].astype("<f4").tobytes()


def _netpbm_header(data: bytes, count: int) -> tuple[list[bytes], int]:
    """The first `count` words, comments left out, and where the last one ends."""
    words: list[bytes] = []
    head = data[:HEADER_LIMIT]
    at = 0
    while len(words) < count:
        while head[at : at + 1].isspace():
            at += 1
        start = at
        if head[at : at + 1] == b"#":
            at = min((end for end in (head.find(b"\n", at), head.find(b"\r", at)) if end >= 0), default=len(head))
            continue
        while at < len(head) and not head[at : at + 1].isspace():
            at += 1
        if at == len(head):
            raise ValueError("it ends within its header")
        words.append(head[start:at])
    return words, at


def _natural(word: bytes) -> int:
    if not word.isdigit() or len(word) > 9:
        raise ValueError(f"its header holds {word[:40].decode('latin-1')!r} where a number is needed")
    return int(word)


def _body(data: bytes, start: int, size: int) -> int:
    """Where the pixels begin after a header: behind one white space, or two that end a line; two bytes may follow."""
    start += 2 if data[start : start + 2] == b"\r\n" else 1
    expect_at_least(len(data) - start, size)
    if len(data) - start > size + 2:
        raise ValueError(f"it holds {len(data) - start} bytes where {size} are needed")
    return start
