"""PNG, PGM, TIFF and EXR by OpenCV, and PFM."""

from __future__ import annotations

import re
from collections.abc import Callable

import cv2
import numpy as np

from .values import expect, float32


def read_picture(data: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if picture is None:
        raise ValueError("OpenCV cannot decode it: it is truncated or garbled, or of a kind this OpenCV lacks")
    return picture


def read_png(data: bytes) -> np.ndarray:
    """Checks first what libpng believes: the chunks' lengths, and a size that deflate (1032 to 1 at best) can reach."""
    at = 8
    while data[at + 4 : at + 8] != b"IEND":
        if at + 12 > len(data):
            raise ValueError("it is truncated, or the lengths of its chunks are garbled")
        at += 12 + int.from_bytes(data[at : at + 4], "big")
    if int.from_bytes(data[16:20], "big") * int.from_bytes(data[20:24], "big") > 1032 * len(data):
        raise ValueError("its header promises more pixels than it can hold")
    return read_picture(data)


def write_picture(suffix: str, *dtypes: str) -> Callable[[np.ndarray], bytes]:
    def write(src: np.ndarray) -> bytes:
        if src.ndim != 2 or src.dtype not in dtypes:
            raise ValueError(f"(H, W) {' or '.join(dtypes)}")
        written, data = cv2.imencode(suffix, src)
        if not written:
            raise cv2.error(f"no encoder for {suffix}")
        return data.tobytes()

    return write


_PFM_HEADER = re.compile(rb"P[fF]\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,40})\s")


def read_pfm(data: bytes) -> np.ndarray:
    """Rows from bottom to top; a negative scale means little-endian, its size is a hint that no reader agrees on."""
    header = _PFM_HEADER.match(data)
    if header is None:
        raise ValueError("its PFM header is garbled")
    if data.startswith(b"PF"):
        raise ValueError("it holds colours, no range image")
    width, height = int(header[1]), int(header[2])
    expect(len(data) - header.end(), width * height * 4)
    order = "<" if float(header[3]) < 0 else ">"
    return np.frombuffer(data, order + "f4", width * height, header.end()).reshape(height, width)[::-1]


def write_pfm(src: np.ndarray) -> bytes:
    if src.ndim != 2 or src.dtype.kind != "f":
        raise ValueError("(H, W) floats")
    return b"Pf\n%d %d\n-1.0\n" % src.shape[::-1] + float32(src)[::-1].astype("<f4").tobytes()
