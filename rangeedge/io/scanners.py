"""Files of the classic range scanners: ABW, Perceptron, Technical Arts."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np

from .calibration import SCANNER_SIZE, abwPoints, perceptronPoints
from .points import float32
from .range_image import RangeImage
from .source import HEADER_LIMIT, expect_pixels, expect_size
from .text import numbers

ABW_CALIBRATION_1 = frozenset({0, 19, 21, 25, 27, 28, 29})  # abw.test.N of the first calibration
ABW_MAGIC = b"\x59\xa6\x6a\x95"  # Sun rasterfile


def abw_calibration(name: str) -> int:
    number = re.search(r"abw\.test\.(\d+)", Path(name).name)
    return 1 if number and int(number[1]) in ABW_CALIBRATION_1 else 2


def read_abw(data: bytes, calibration: int) -> np.ndarray:
    """A Sun rasterfile of 8 bits: eight big-endian words, a colour map, rows padded to an even number of bytes."""
    if len(data) < 32:
        raise ValueError("it ends within its header")
    _, width, height, depth, _, kind, _, map_length = struct.unpack_from(">8I", data)
    if (height, width) != SCANNER_SIZE or depth != 8 or kind not in (0, 1):
        raise ValueError(f"a Sun rasterfile of {width} x {height}, {depth} bits, type {kind} is no ABW image")
    start = 32 + map_length
    expect_size(len(data) - start, width * height)
    return abwPoints(np.frombuffer(data, np.uint8, width * height, start).reshape(height, width), calibration)


_PERCEPTRON_LINES = 10
_PERCEPTRON_HEADER = re.compile(rb"(?:[^\n]*\n){%d}" % _PERCEPTRON_LINES)
_PERCEPTRON_START = re.compile(rb"[^:\n]*:[ \t]*\d{1,9}\s*\n[^:\n]*:[ \t]*\d{1,9}\s*\n")


def is_perceptron(head: bytes) -> bool:
    return _PERCEPTRON_START.match(head) is not None


def read_perceptron(data: bytes) -> np.ndarray:
    """Ten lines ``key : value``, rows and columns first, an empty one (or none), then big-endian words.

    The range is in their lower 12 bits. Words that seem to begin with an end of line are those of a file that has lost
    its last bytes: no reflectance is as large.
    """
    header = _PERCEPTRON_HEADER.match(data[:HEADER_LIMIT])
    if header is None:
        raise ValueError(f"it ends within the {_PERCEPTRON_LINES} lines of its header")
    lines = header[0].splitlines()
    rows, cols = (int(line.split(b":")[1]) for line in lines[:2])
    if (rows, cols) != SCANNER_SIZE:
        raise ValueError(f"{rows} rows of {cols} columns are no Perceptron image")
    start = header.end()
    for ending in (b"\n", b"\r\n"):
        if data.startswith(ending, start):
            start += len(ending)
            break
    expect_size(len(data) - start, rows * cols * 4)
    words = np.frombuffer(data, ">i4", rows * cols, start)
    return perceptronPoints((words & 4095).reshape(rows, cols))


_TECHNICAL_ARTS_HEADER = re.compile(rb"(?:[\x20-\x7e\t\r]{0,200}\n){3}")
_FIRST_NUMBER = re.compile(rb"\s*[-+]?[\d.]")


def is_technical_arts(head: bytes) -> bool:
    header = _TECHNICAL_ARTS_HEADER.match(head)
    return header is not None and _FIRST_NUMBER.match(head, header.end()) is not None


def read_technical_arts(data: bytes) -> RangeImage:
    """Three lines with the numbers of rows and columns, then the images flag, X, Y and Z as text."""
    start = _TECHNICAL_ARTS_HEADER.match(data[:HEADER_LIMIT]).end()  # type: ignore[union-attr]
    header = data[:start].decode("ascii").lower()
    sizes = [int(word) for word in re.findall(r"(?<![\w.+-])\d{1,9}(?![\w.])", header)[:2]]
    if len(sizes) < 2:
        raise ValueError("it is no known text format: its first three lines do not give rows and columns")
    rows, cols = sizes[::-1] if 0 <= header.find("col") < header.find("row") else sizes
    expect_pixels(rows, cols)
    flag, x, y, z = numbers(data, start, 4 * rows * cols).reshape(4, rows, cols)
    points = float32(np.stack([x, y, z], axis=-1))
    points[flag == 0] = np.nan
    return RangeImage(points, {"heightMap": True})
