"""Argument checks and output handling, shared by every public function; and the error that they raise.

A check names the argument. `public` names the function: it stands on every function that users call.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import cv2
import numpy as np

from . import _core

if TYPE_CHECKING:
    from .io.camera import Camera

# Kernels count in 32 bits what a pixel may have four of: edge points, one a direction of scan lines, and borders.
PIXEL_LIMIT = 2**29

_call = _core.Call()
_P = ParamSpec("_P")
_R = TypeVar("_R")


class error(cv2.error, ValueError):
    """Raised on every bad argument; caught by ``except cv2.error`` and by ``except ValueError``.

    Like OpenCV's own, it carries ``code`` (one of ``cv2.Error``), ``func``, ``err`` and ``msg``.
    """

    def __init__(self, err: str, code: int = cv2.Error.StsBadArg, func: str = "") -> None:
        super().__init__()
        self.code, self.err = code, err
        self.name(func)

    def name(self, func: str) -> None:
        """Make `func` the function that the error speaks of."""
        self.func = func
        self.msg = f"rangeedge: error: ({self.code}) {f'{func}: ' if func else ''}{self.err}"
        self.args = (self.msg,)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.err, self.code, self.func)


def public(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Mark a function that users call: the errors raised in it name it, and not those that it calls."""
    return named(function.__qualname__)(function)


def named(name: str) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Let the errors raised in a function name `name`, which is what the user has called."""

    def naming(function: Callable[_P, _R]) -> Callable[_P, _R]:
        @functools.wraps(function)
        def call(*args: _P.args, **kwargs: _P.kwargs) -> _R:
            # Values may be so large or so small that they overflow: what comes of it counts as invalid, in silence.
            with np.errstate(all="ignore"), _call:
                try:
                    return function(*args, **kwargs)
                except error as problem:
                    problem.name(name)
                    raise

        return call

    return naming


def fail(name: str, expected: str, got: Any, code: int = cv2.Error.StsBadArg) -> error:
    """The exception for the argument `name`; the caller raises it."""
    return error(f"`{name}` must be {expected}, got {got}", code)


def described(value: Any) -> str:
    """An argument in a few words: arrays by dtype and shape, everything else as it prints."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} array of shape {value.shape}"
    try:
        text = repr(value)
    except Exception:  # of a class of the user's, or an integer of thousands of digits
        return f"a {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def array(name: str, value: Any, expected: str, ndim: Collection[int] = (2,)) -> np.ndarray:
    """A non-empty array of real numbers with one of the allowed numbers of dimensions."""
    if not isinstance(value, np.ndarray):
        raise fail(name, expected, type(value).__name__)
    if isinstance(value, np.ma.MaskedArray):
        raise fail(name, f"{expected}, masked pixels filled with NaN or left out by `mask`", "a masked array")
    if value.ndim not in ndim:
        raise fail(name, expected, described(value), cv2.Error.StsBadSize)
    if value.size == 0:
        raise fail(name, f"{expected}, not empty", described(value), cv2.Error.StsBadSize)
    if value.dtype.kind not in "buif":
        raise fail(name, expected, described(value), cv2.Error.StsUnsupportedFormat)
    if value.ndim > 1 and (value.shape[0] + 2) * (value.shape[1] + 2) >= PIXEL_LIMIT:
        limit = f"2^{PIXEL_LIMIT.bit_length() - 1}"
        expected = f"{expected} of fewer than {limit} pixels, a margin of one included (runBlocks takes larger images)"
        raise fail(name, expected, described(value), cv2.Error.StsBadSize)
    return value


def image8(name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """An 8-bit (or bool) single-channel image as C-contiguous uint8; values are kept.

    A copy, as all images are that kernels read more than once and trust: another thread may be writing to the original.
    """
    expected = "an 8-bit or bool array of shape (H, W)" if shape is None else f"an 8-bit or bool array of shape {shape}"
    value = array(name, value, expected)
    if value.dtype not in (np.uint8, np.bool_):
        raise fail(name, expected, described(value), cv2.Error.StsUnsupportedFormat)
    if shape is not None and value.shape != shape:
        raise fail(name, expected, described(value), cv2.Error.StsUnmatchedSizes)
    return np.array(value, order="C").view(np.uint8)


def image32f(name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """A real single-channel image as C-contiguous, aligned float32, a copy; 8-bit and float64 are converted."""
    expected = "a real array of shape (H, W)" if shape is None else f"a real array of shape {shape}"
    value = array(name, value, expected)
    if shape is not None and value.shape != shape:
        raise fail(name, expected, described(value), cv2.Error.StsUnmatchedSizes)
    with np.errstate(over="ignore"):
        return np.array(value, np.float32, order="C")


def labels32s(name: str, value: Any, shape: tuple[int, int] | None = None, *, listed: bool = False) -> np.ndarray:
    """A label image as C-contiguous, aligned int32, a copy; with `listed`, a table with a row a label has room."""
    expected = "an int32 array of shape (H, W)" if shape is None else f"an int32 array of shape {shape}"
    value = array(name, value, expected)
    if value.dtype != np.int32:
        raise fail(name, expected, described(value), cv2.Error.StsUnsupportedFormat)
    if shape is not None and value.shape != shape:
        raise fail(name, expected, described(value), cv2.Error.StsUnmatchedSizes)
    value = np.array(value, order="C")
    most = max(value.size, 2**16 - 1)
    if listed and value.max() > most:
        raise fail(
            name, f"{expected}, labels of up to {most}", f"labels of up to {value.max()}", cv2.Error.StsOutOfRange
        )
    return value


def number(name: str, value: Any, low: float = -np.inf, high: float = np.inf, *, above: bool = False) -> float:
    """A finite real number in [low, high], or in (low, high] with `above`."""
    bound = f"{'>' if above else '>='} {low:g}" if np.isfinite(low) else ""
    if np.isfinite(high):
        bound = f"{bound} and <= {high:g}".removeprefix(" and ")
    expected = f"a finite number {bound}".rstrip()
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise fail(name, expected, described(value))
    number = real(value)
    if not np.isfinite(number) or number < low or number > high or (above and number == low):
        raise fail(name, expected, described(value), cv2.Error.StsOutOfRange)
    return number


def real(value: float | np.integer | np.floating) -> float:
    """A number in double precision; infinite where it is beyond that."""
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def reals(value: Any) -> np.ndarray:
    """Numbers, nested as they may be, in double precision; a TypeError or ValueError where there are others."""
    array = np.array(value)
    if array.dtype.kind not in "buifO" or isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{array.dtype} is no real number")
    return array.astype(np.float64)


def integer(name: str, value: Any, low: int, high: int = 2**31 - 1) -> int:
    """An integer in [low, high]; bool is none."""
    expected = f"an integer >= {low}" if high == 2**31 - 1 else f"an integer from {low} to {high}"
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise fail(name, expected, described(value))
    if not low <= value <= high:
        raise fail(name, expected, described(value), cv2.Error.StsOutOfRange)
    return int(value)


def flag(name: str, value: Any, choices: dict[str, int]) -> int:
    """One of the named constants."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or value not in choices.values():
        raise fail(name, "one of " + ", ".join(f"{k} ({v})" for k, v in choices.items()), described(value))
    return int(value)


def boolean(name: str, value: Any) -> bool:
    """True or False, nothing that merely counts as one."""
    if not isinstance(value, (bool, np.bool_)):
        raise fail(name, "True or False", described(value))
    return bool(value)


def camera_matrix(name: str, value: Any) -> np.ndarray:
    """The 3x3 matrix of a pinhole camera given in any form, as float64."""
    from .io.camera import matrix_of

    try:
        return matrix_of(value)
    except (TypeError, ValueError, OverflowError) as reason:
        expected = "a camera: (fx, fy, cx, cy), 9 numbers, 3x3, 3x4, or the name of a file of one"
        raise fail(name, expected, f"{described(value)} ({reason})") from None


def camera_file(name: str, path: str | os.PathLike[str]) -> Camera:
    """The camera that a file describes."""
    from .io.camera import read_camera

    try:
        return read_camera(path)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "err", None) or getattr(reason, "strerror", None) or reason
        raise fail(name, "a camera or the name of a file of one", f"{os.fspath(path)!r} ({what})") from None


def distortion(name: str, value: Any) -> np.ndarray:
    """Coefficients of distortion as float64, as many as cv2 knows."""
    expected = "4, 5, 8, 12 or 14 finite numbers"
    try:
        coefficients = reals(value).ravel()
    except (TypeError, ValueError, OverflowError):
        raise fail(name, expected, described(value)) from None
    if len(coefficients) not in (4, 5, 8, 12, 14) or not np.isfinite(coefficients).all():
        raise fail(name, expected, described(value))
    return coefficients


def point(name: str, value: Any) -> tuple[float, float, float]:
    """Three finite coordinates."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(value, (tuple, list)) or len(value) != 3:
        raise fail(name, "three coordinates (x, y, z)", described(value))
    x, y, z = (number(name, coordinate) for coordinate in value)
    return x, y, z


def invalid_values(name: str, value: Any) -> tuple[tuple[float, float], ...]:
    """Ranges (low, high) of a number, or of a sequence of numbers and pairs."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    ranges = []
    for item in value if isinstance(value, (tuple, list)) else (value,):
        item = item.tolist() if isinstance(item, np.ndarray) else item
        low, high = item if isinstance(item, (tuple, list)) and len(item) == 2 else (item, item)
        for bound in (low, high):
            if isinstance(bound, (bool, np.bool_)) or not isinstance(bound, (int, float, np.integer, np.floating)):
                raise fail(name, "a number, or a sequence of numbers and of pairs (low, high)", described(value))
        if low > high:
            raise fail(name, "low <= high in every pair", described(item), cv2.Error.StsOutOfRange)
        ranges.append((real(low), real(high)))
    return tuple(ranges)


def pixel_size(name: str, value: Any) -> tuple[float, float]:
    """The spacing (dx, dy) of a grid; one number is both."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(value, (tuple, list)):
        value = (value, value)
    if len(value) != 2:
        raise fail(name, "a length or a pair (dx, dy)", described(value), cv2.Error.StsBadSize)
    dx, dy = (number(name, h, 0, above=True) for h in value)
    return dx, dy


def image_size(name: str, value: Any) -> tuple[int, int]:
    """Width and height of an image."""
    value = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise fail(name, "a width and a height in pixels", described(value), cv2.Error.StsBadSize)
    width, height = (integer(name, side, 1) for side in value)
    return width, height


def deliver(name: str, result: np.ndarray, dst: np.ndarray | None) -> np.ndarray:
    """`result`, written into `dst` where that has its shape and dtype, as cv2 does it.

    A `dst` of another shape or dtype is left alone and `result` itself is returned; a read-only one is an error.
    """
    if dst is None:
        return result
    if not isinstance(dst, np.ndarray):
        raise fail(name, "an array or None", type(dst).__name__)
    if dst.shape != result.shape or dst.dtype != result.dtype:
        return result
    if not dst.flags.writeable:
        raise fail(name, "writable", "a read-only array")
    dst[...] = result
    return dst


def strength32f(name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    """An image of finite strengths >= 0 as C-contiguous float32."""
    value = image32f(name, value, shape)
    if not (value.min() >= 0 and value.max() < np.inf):  # NaN fails either comparison
        raise fail(name, "finite and >= 0 everywhere", f"values from {value.min():g} to {value.max():g}")
    return value


def threshold(name: str, value: Any) -> float:
    """A number >= 0; infinity, which no strength reaches, switches the test off."""
    if isinstance(value, (float, np.floating)) and value == np.inf:
        return np.inf
    return number(name, value, 0)
