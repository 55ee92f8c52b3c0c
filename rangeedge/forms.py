"""What people pass as a range image, as one array: its values, and where it has any."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from ._check import array, described, fail

SRC = "a depth image of shape (H, W), or points of shape (H, W, 3) or (H, W, 4)"
_COORDINATES = ("x", "y", "z")
_LEAST_CLOUD = 200  # rows of three or four numbers that are a list of points
_LONGEST_LINE = 10000  # points that a scanner of one line takes


def range_array(src: Any) -> tuple[np.ndarray, np.ndarray | None]:
    """A range image as an array of numbers of two or three dimensions, and where it is not masked.

    Taken are arrays, masked ones, records with fields x, y and z, `cv2.UMat`, and whatever hands out its memory on the
    CPU by ``__array__`` or DLPack. A third dimension of length 1 is dropped.
    """
    values = _as_array(src)
    seen = None
    if isinstance(values, np.ma.MaskedArray):
        masked, values = np.ma.getmaskarray(values), values.data
        if masked.dtype.names:
            masked = np.logical_or.reduce([masked[name] for name in masked.dtype.names])
        seen = ~(masked.any(axis=2) if masked.ndim == 3 else masked)
    if values.dtype.names:
        values = _of_records(values)
    if values.ndim == 3 and values.shape[2] == 1:
        values = values[..., 0]
    if _is_list_of_points(values):
        expected = "an organized cloud of shape (H, W, 3): scan lines need the rows and columns of the sensor, and a"
        raise fail("src", f"{expected} list of points has none; reshape it if they are in order", described(values))
    return array("src", values, SRC, ndim=(2, 3)), seen


def _as_array(src: Any) -> np.ndarray:
    if isinstance(src, np.ndarray):
        return src
    if isinstance(src, cv2.UMat):
        values = src.get()
        return np.empty(0) if values is None else values
    try:
        if hasattr(src, "__dlpack__") and not hasattr(src, "__array__"):
            return np.from_dlpack(src)
        if hasattr(src, "__array__") or hasattr(src, "__array_interface__"):
            return np.asarray(src)
    except (TypeError, ValueError, AttributeError, RuntimeError, BufferError) as reason:
        raise fail("src", f"{SRC}, on the CPU", f"{type(src).__name__} ({reason})") from None
    raise fail("src", SRC, f"{type(src).__name__}{_hint(src)}")


def _hint(src: Any) -> str:
    """What to do about something that is no array."""
    if src is None:
        return " (cv2.imread gives None where it finds no image)"
    if isinstance(src, str) or hasattr(src, "__fspath__"):
        return " (imreadRange reads files)"
    return " (numpy.asarray makes an array of it)" if isinstance(src, (list, tuple, memoryview, bytes)) else ""


def _of_records(records: np.ndarray) -> np.ndarray:
    """The coordinates of points in records, as messages and files of clouds hold them."""
    if not set(_COORDINATES) <= set(records.dtype.names):
        raise fail("src", "records with fields x, y and z", f"fields {', '.join(records.dtype.names)}")
    if records.ndim != 2 or 1 in records.shape:
        raise fail(
            "src",
            "records of shape (H, W): scan lines need the rows and columns of the sensor; reshape those of an"
            " organized cloud by its height and width",
            f"records of shape {records.shape}",
            cv2.Error.StsBadSize,
        )
    return np.stack([records[name] for name in _COORDINATES], axis=-1)


def _is_list_of_points(values: np.ndarray) -> bool:
    if values.dtype.kind != "f":
        return False
    if values.ndim == 3:
        return 1 in values.shape[:2] and values.shape[2] in (3, 4) and max(values.shape) > _LONGEST_LINE
    if values.ndim == 2 and values.shape[0] in (3, 4) and values.shape[1] > _LONGEST_LINE:
        return True
    return values.ndim == 2 and values.shape[1] in (3, 4) and values.shape[0] > _LEAST_CLOUD
