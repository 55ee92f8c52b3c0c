"""Argument checks and output handling, shared by every public function."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import Any

import cv2
import numpy as np


class error(cv2.error, ValueError):
    """Raised on every bad argument; caught by ``except cv2.error`` and by ``except ValueError``.

    Like OpenCV's own, it carries ``code`` (one of ``cv2.Error``), ``func``, ``err`` and ``msg``.
    """

    def __init__(self, func: str, err: str, code: int = cv2.Error.StsBadArg) -> None:
        msg = f"rangeedge: error: ({code}) {func}: {err}"
        super().__init__(msg)
        self.code, self.func, self.err, self.msg = code, func, err, msg

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.func, self.err, self.code)


def fail(func: str, name: str, expected: str, got: Any, code: int = cv2.Error.StsBadArg) -> error:
    """The exception for argument `name` of `func`; the caller raises it."""
    return error(func, f"`{name}` must be {expected}, got {got}", code)


@contextmanager
def errors_of(func: str) -> Iterator[None]:
    """Errors of the functions called inside name `func`, which is what the user called."""
    try:
        yield
    except error as problem:
        raise error(func, problem.err, problem.code) from None


def described(value: Any) -> str:
    """An argument in a few words: arrays by dtype and shape, everything else as it prints."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} array of shape {value.shape}"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def array(func: str, name: str, value: Any, expected: str, ndim: Collection[int] = (2,)) -> np.ndarray:
    """A non-empty array of real numbers with one of the allowed numbers of dimensions."""
    if not isinstance(value, np.ndarray):
        raise fail(func, name, expected, type(value).__name__)
    if isinstance(value, np.ma.MaskedArray):
        raise fail(func, name, f"{expected}, masked pixels filled with NaN or left out by `mask`", "a masked array")
    if value.ndim not in ndim:
        raise fail(func, name, expected, described(value), cv2.Error.StsBadSize)
    if value.size == 0:
        raise fail(func, name, f"{expected}, not empty", described(value), cv2.Error.StsBadSize)
    if value.dtype.kind not in "buif":
        raise fail(func, name, expected, described(value), cv2.Error.StsUnsupportedFormat)
    # Kernels count pixels in 32 bits, in an image with a margin of one.
    if value.ndim > 1 and (value.shape[0] + 2) * (value.shape[1] + 2) >= 2**31:
        expected = f"{expected} of fewer than 2^31 pixels, a margin of one included"
        raise fail(func, name, expected, described(value), cv2.Error.StsBadSize)
    return value


def image8(func: str, name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """An 8-bit (or bool) single-channel image as C-contiguous uint8; values are kept."""
    expected = "an 8-bit or bool array of shape (H, W)" if shape is None else f"an 8-bit or bool array of shape {shape}"
    value = array(func, name, value, expected)
    if value.dtype not in (np.uint8, np.bool_):
        raise fail(func, name, expected, described(value), cv2.Error.StsUnsupportedFormat)
    if shape is not None and value.shape != shape:
        raise fail(func, name, expected, described(value), cv2.Error.StsUnmatchedSizes)
    return np.ascontiguousarray(value).view(np.uint8)


def image32f(func: str, name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """A real single-channel image as C-contiguous float32; 8-bit and float64 are converted."""
    expected = "a real array of shape (H, W)" if shape is None else f"a real array of shape {shape}"
    value = array(func, name, value, expected)
    if shape is not None and value.shape != shape:
        raise fail(func, name, expected, described(value), cv2.Error.StsUnmatchedSizes)
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(value, dtype=np.float32)


def labels32s(func: str, name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """A label image as C-contiguous int32."""
    expected = "an int32 array of shape (H, W)" if shape is None else f"an int32 array of shape {shape}"
    value = array(func, name, value, expected)
    if value.dtype != np.int32:
        raise fail(func, name, expected, described(value), cv2.Error.StsUnsupportedFormat)
    if shape is not None and value.shape != shape:
        raise fail(func, name, expected, described(value), cv2.Error.StsUnmatchedSizes)
    return np.ascontiguousarray(value)


def number(
    func: str, name: str, value: Any, low: float = -np.inf, high: float = np.inf, *, above: bool = False
) -> float:
    """A finite real number in [low, high], or in (low, high] with `above`."""
    bound = f"{'>' if above else '>='} {low:g}" if np.isfinite(low) else ""
    if np.isfinite(high):
        bound = f"{bound} and <= {high:g}".removeprefix(" and ")
    expected = f"a finite number {bound}".rstrip()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise fail(func, name, expected, described(value))
    value = float(value)
    if not np.isfinite(value) or value < low or value > high or (above and value == low):
        raise fail(func, name, expected, described(value), cv2.Error.StsOutOfRange)
    return value


def integer(func: str, name: str, value: Any, low: int, high: int = 2**31 - 1) -> int:
    """An integer in [low, high]; bool is none."""
    expected = f"an integer >= {low}" if high == 2**31 - 1 else f"an integer from {low} to {high}"
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise fail(func, name, expected, described(value))
    if not low <= value <= high:
        raise fail(func, name, expected, described(value), cv2.Error.StsOutOfRange)
    return int(value)


def flag(func: str, name: str, value: Any, choices: dict[str, int]) -> int:
    """One of the named constants."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or value not in choices.values():
        raise fail(func, name, "one of " + ", ".join(f"{k} ({v})" for k, v in choices.items()), described(value))
    return int(value)


def boolean(func: str, name: str, value: Any) -> bool:
    """True or False, nothing that merely counts as one."""
    if not isinstance(value, (bool, np.bool_)):
        raise fail(func, name, "True or False", described(value))
    return bool(value)


def camera_matrix(func: str, name: str, value: Any) -> np.ndarray:
    """The 3x3 matrix of a pinhole camera, as float64."""
    expected = "a 3x3 camera matrix [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with finite entries and fx, fy > 0"
    try:
        matrix = np.array(value)
    except ValueError:
        raise fail(func, name, expected, described(value)) from None
    if matrix.dtype.kind not in "iuf":
        raise fail(func, name, expected, described(value))
    matrix = matrix.astype(np.float64)
    if matrix.shape != (3, 3):
        raise fail(func, name, expected, described(value), cv2.Error.StsBadSize)
    upper = matrix[0, 0] > 0 and matrix[1, 1] > 0 and matrix[1, 0] == 0 and np.array_equal(matrix[2], (0, 0, 1))
    if not (upper and np.isfinite(matrix).all()):
        raise fail(func, name, expected, matrix.tolist())
    return matrix


def pixel_size(func: str, name: str, value: Any) -> tuple[float, float]:
    """The spacing (dx, dy) of a grid; one number is both."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(value, (tuple, list)):
        value = (value, value)
    if len(value) != 2:
        raise fail(func, name, "a length or a pair (dx, dy)", described(value), cv2.Error.StsBadSize)
    dx, dy = (number(func, name, h, 0, above=True) for h in value)
    return dx, dy


def deliver(func: str, name: str, result: np.ndarray, dst: np.ndarray | None) -> np.ndarray:
    """`result`, written into `dst` where that has its shape and dtype, as cv2 does it.

    A `dst` of another shape or dtype is left alone and `result` itself is returned; a read-only one is an error.
    """
    if dst is None:
        return result
    if not isinstance(dst, np.ndarray):
        raise fail(func, name, "an array or None", type(dst).__name__)
    if dst.shape != result.shape or dst.dtype != result.dtype:
        return result
    if not dst.flags.writeable:
        raise fail(func, name, "writable", "a read-only array")
    dst[...] = result
    return dst


def strength32f(func: str, name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """An image of finite strengths >= 0 as C-contiguous float32."""
    value = image32f(func, name, value, shape)
    if not (value.min() >= 0 and value.max() < np.inf):  # NaN fails either comparison
        raise fail(func, name, "finite and >= 0 everywhere", f"values from {value.min():g} to {value.max():g}")
    return value


def threshold(func: str, name: str, value: Any) -> float:
    """A number >= 0; infinity, which no strength reaches, switches the test off."""
    if isinstance(value, (float, np.floating)) and value == np.inf:
        return np.inf
    return number(func, name, value, 0)
