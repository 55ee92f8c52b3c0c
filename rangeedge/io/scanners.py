"""Files of the classic range scanners: ABW, Perceptron, Technical Arts."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

from .calibration import SCANNER_SIZE, abwPoints, perceptronPoints
from .values import expect, float32

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
    expect(len(data) - start, width * height)
    return abwPoints(np.frombuffer(data, np.uint8, width * height, start).reshape(height, width), calibration)


_PERCEPTRON_LINES = 10


def read_perceptron(data: bytes) -> np.ndarray:
    """Ten lines ``key : value``, rows and columns first, an empty one, then big-endian words.

    The range is in their lower 12 bits. As the empty line is not the same everywhere, the words are counted from the
    end of the file.
    """
    header = re.match(rb"(?:[^\n]*\n){%d}" % _PERCEPTRON_LINES, data)
    if header is None:
        raise ValueError(f"it ends within the {_PERCEPTRON_LINES} lines of its header")
    lines = header[0].splitlines()
    rows, cols = (int(line.split(b":")[1]) for line in lines[:2])
    if (rows, cols) != SCANNER_SIZE:
        raise ValueError(f"{rows} rows of {cols} columns are no Perceptron image")
    start = len(data) - rows * cols * 4
    if start < header.end() or data[header.end() : start].strip():
        raise ValueError(f"{len(data) - header.end()} bytes after its header where {rows * cols * 4} are needed")
    words = np.frombuffer(data, ">i4", rows * cols, start)
    return perceptronPoints((words & 4095).reshape(rows, cols))


TECHNICAL_ARTS_HEADER = re.compile(rb"(?:[\x20-\x7e\t\r]*\n){3}")


def read_technical_arts(data: bytes) -> tuple[np.ndarray, dict[str, Any]]:
    """Three lines with the numbers of rows and columns, then the images flag, X, Y and Z as text."""
    header = TECHNICAL_ARTS_HEADER.match(data)[0].decode("ascii").lower()
    sizes = [int(word) for word in re.findall(r"\d{1,9}", header)[:2]]
    if len(sizes) < 2:
        raise ValueError("it is no known text format: its first three lines do not give rows and columns")
    rows, cols = sizes[::-1] if 0 <= header.find("col") < header.find("row") else sizes
    words = data[len(header) :].split()
    expect(len(words), 4 * rows * cols, "values")
    flag, x, y, z = np.array([float(word) for word in words]).reshape(4, rows, cols)
    points = float32(np.stack([x, y, z], axis=-1))
    points[flag == 0] = np.nan
    return points, {"heightMap": True}
