"""The kernels that unpack files, against slow ones that are written for reading, and on any bytes at all."""

from __future__ import annotations

import io
import zlib

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from rangeedge import _core

UNTOUCHED = 0xA5


def unpacked(kernel, packed, size):
    """What the kernel returns and writes into the middle of a larger array."""
    margin = 64
    out = np.full(size + 2 * margin, UNTOUCHED, np.uint8)
    result = kernel(np.frombuffer(bytes(packed), np.uint8), out[margin : margin + size])
    assert (out[:margin] == UNTOUCHED).all()
    assert (out[margin + size :] == UNTOUCHED).all()
    return result, out[margin : margin + size].tobytes()


def lzf(packed, size):
    fits, plain = unpacked(_core.lzf_unpack, packed, size)
    return plain if fits else None


def slow_lzf(packed, size):
    out, at = bytearray(), 0
    try:
        while at < len(packed):
            control = packed[at]
            at += 1
            if control < 32:
                run = packed[at : at + control + 1]
                if len(run) <= control:
                    return None
                out += run
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += packed[at]
                at += 1
            back = ((control & 31) << 8) + packed[at] + 1
            at += 1
            if back > len(out):
                return None
            for _ in range(length + 2):
                out.append(out[-back])
    except IndexError:
        return None
    return bytes(out) if len(out) == size else None


@pytest.mark.parametrize(
    ("packed", "plain"),
    [
        (b"\x02abc", b"abc"),
        (b"\x02abc\x20\x02", b"abcabc"),  # length 1 + 2, distance 2 + 1
        (b"\x00a\x40\x00", b"aaaaa"),  # length 2 + 2 over itself, distance 1
        (b"\x01ab\xe0\x03\x01", b"ab" * 7),  # length 7 + 3 + 2, distance 2
        (bytes([31, *range(32)]) * 10 + b"\x21\x3f", bytes(range(32)) * 10 + bytes(range(3))),  # distance 256 + 63 + 1
        (b"", b""),
    ],
)
def test_lzf(packed, plain):
    assert lzf(packed, len(plain)) == plain
    assert lzf(packed, len(plain) + 1) is None
    for end in range(len(packed)):
        assert lzf(packed[:end], len(plain)) is None


def test_lzf_refers_to_nothing_before_the_start():
    assert lzf(b"\x00a\x20\x00", 4) == b"aaaa"
    assert lzf(b"\x00a\x20\x01", 4) is None


@settings(max_examples=500, deadline=None)
@given(st.lists(st.sampled_from([*range(8), 31, 32, 33, 64, 96, 224, 255]), max_size=60), st.integers(0, 400))
def test_any_bytes_as_lzf(packed, size):
    expected = slow_lzf(bytes(packed), size)
    assert lzf(packed, size) == expected
    if expected is None and (whole := slow_lzf_size(bytes(packed))) is not None:
        assert lzf(packed, whole) == slow_lzf(bytes(packed), whole)


def slow_lzf_size(packed):
    """The size to which a block unpacks; None where it is garbled."""
    return next((size for size in range(5000) if slow_lzf(packed, size) is not None), None)


class Bits:
    def __init__(self, data):
        self.bits = "".join(f"{byte:08b}" for byte in data)
        self.at = 0

    def next(self, width):
        if self.at + width > len(self.bits):
            return 257
        self.at += width
        return int(self.bits[self.at - width : self.at], 2)


def slow_lzw(packed, size):
    """TIFF 6.0, section 13, with the strings in a table."""
    codes, out = Bits(packed), b""
    table, before, width = {}, None, 9
    while len(out) < size:
        code = codes.next(width)
        if code == 257:
            break
        if code == 256:
            table, before, width = {i: bytes([i]) for i in range(256)} | {256: b"", 257: b""}, None, 9
            continue
        table = table or {i: bytes([i]) for i in range(256)} | {256: b"", 257: b""}
        if before is None:
            if code > 255:
                break
            text = table[code]
        else:
            if code > len(table):
                break
            if code == len(table) == 4096:
                break
            text = table[code] if code < len(table) else before + before[:1]
            if len(table) < 4096:
                table[len(table)] = before + text[:1]
                if len(table) + 1 >= 1 << width and width < 12:
                    width += 1
        out += text
        before = text
    return out[:size]


def lzw(packed, size):
    count, plain = unpacked(_core.lzw_unpack, packed, size)
    assert count <= size
    return plain[:count]


def strip_of(array):
    """The only strip of a TIFF of bytes that OpenCV has packed by LZW."""
    _, data = cv2.imencode(".tiff", array, [cv2.IMWRITE_TIFF_COMPRESSION, 5, cv2.IMWRITE_TIFF_PREDICTOR, 1])
    with tifffile.TiffFile(io.BytesIO(data.tobytes())) as file:
        (offset,), (count,) = file.pages.first.dataoffsets, file.pages.first.databytecounts
        return data[offset : offset + count].tobytes()


@pytest.mark.parametrize("levels", [2, 20, 256])
@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (8, 997)])
def test_lzw_of_others(levels, shape):
    array = np.random.default_rng(levels).integers(0, levels, shape, dtype=np.uint8)
    packed = strip_of(array)
    assert lzw(packed, array.size) == array.tobytes() == slow_lzw(packed, array.size)
    for end in range(0, len(packed), 1 + len(packed) // 20):
        assert lzw(packed[:end], array.size) == slow_lzw(packed[:end], array.size)


def codes_of(codes, width=9):
    bits = "".join(f"{code:0{width}b}" for code in codes)
    bits += "0" * (-len(bits) % 8)
    return bytes(int(bits[i : i + 8], 2) for i in range(0, len(bits), 8))


@settings(max_examples=500, deadline=None)
@given(st.lists(st.sampled_from([0, 1, 255, 256, 257, 258, 259, 260, 270, 511]), max_size=60), st.integers(0, 300))
@example([256, 7, 258, 259, 260, 257], 10)  # each string is the one that is just being made
@example([256, 258], 10)
def test_any_codes_as_lzw(codes, size):
    packed = codes_of(codes)
    assert lzw(packed, size) == slow_lzw(packed, size)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=300), st.integers(0, 5000))
def test_any_bytes_as_lzw(packed, size):
    assert lzw(packed, size) == slow_lzw(packed, size)


def slow_unfilter(filtered, rows, row_bytes, pixel_bytes):
    """PNG, section 9, pixel for pixel, with a margin of zeros."""
    out = np.zeros((rows + 1, pixel_bytes + row_bytes), int)
    stored = np.frombuffer(filtered, np.uint8).reshape(rows, 1 + row_bytes).astype(int)
    for v in range(rows):
        for u in range(row_bytes):
            a, b, c = out[v + 1, u], out[v, u + pixel_bytes], out[v, u]
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            prediction = (0, a, b, (a + b) // 2, paeth)[stored[v, 0]]
            out[v + 1, u + pixel_bytes] = (stored[v, 1 + u] + prediction) % 256
    return out[1:, pixel_bytes:].astype(np.uint8)


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_png_filters(data):
    rows, cols = data.draw(st.integers(1, 6)), data.draw(st.integers(1, 9))
    random = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    filtered = random.integers(0, 256, (rows, 1 + 2 * cols), dtype=np.uint8)
    filtered[:, 0] = random.integers(0, 5, rows)
    out = np.zeros((rows, 2 * cols), np.uint8)
    assert _core.png_unfilter(filtered.ravel(), 2, out)
    assert_array_equal(out, slow_unfilter(filtered.tobytes(), rows, 2 * cols, 2))
    filtered[-1, 0] = data.draw(st.integers(5, 255))
    assert not _core.png_unfilter(filtered.ravel(), 2, out)


def test_zlib_is_bounded():
    """What the readers rely on: a decompressor stops at the size that it is given."""
    bomb = zlib.compress(bytes(10**7))
    assert len(zlib.decompressobj().decompress(bomb, 100)) == 100
