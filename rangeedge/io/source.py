"""Files as bytes, and how much of them may be believed: every reader is bounded by the size of its file and by limits.

A file has at most `FILE_LIMIT` bytes and a header at most `HEADER_LIMIT`. An image has at most `PIXEL_LIMIT` pixels.
What is compressed may unpack to `UNPACKED_FREELY` bytes, beyond that only to `UNPACKED_RATIO` times the file.
"""

from __future__ import annotations

import os
import stat
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

import cv2

from .. import _check

FILE_LIMIT = 2**32
HEADER_LIMIT = 2**16
PIXEL_LIMIT = 2**28
UNPACKED_FREELY = 2**28
UNPACKED_RATIO = 100

_AT_A_TIME = 2**22  # bytes that are unpacked in one call

_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def file_name(path: Any, argument: str = "path") -> str:
    """The name that `path` stands for."""
    try:
        name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else None
    except TypeError:  # from a path that returns no name
        name = None
    if name is None:
        raise _check.fail(argument, "a file name (str or path)", type(path).__name__)
    return os.fsdecode(name)


@contextmanager
def opened(name: str, limit: float | None = None) -> Iterator[tuple[BinaryIO, int]]:
    """A regular file and its size. Whatever goes wrong inside is an error that names the file."""
    try:
        with _regular(name) as stream:
            size = os.fstat(stream.fileno()).st_size
            if size > (FILE_LIMIT if limit is None else limit):
                raise ValueError(f"it has {size} bytes, more than the 4 GiB that are read")
            yield stream, size
    except OSError as reason:
        what = reason.strerror or str(reason)
        raise _check.error(f"cannot read {name!r}: {what}", cv2.Error.StsObjectNotFound) from reason
    except Exception as reason:  # NumPy, zipfile and OpenCV raise two dozen types on a garbled file
        what = reason.err if isinstance(reason, cv2.error) else str(reason)
        if not isinstance(reason, (ValueError, ImportError, cv2.error)):
            what = f"it is garbled ({type(reason).__name__}: {reason})"
        raise _check.error(f"cannot read {name!r}: {what}", cv2.Error.StsParseError) from reason


def _regular(name: str) -> BinaryIO:
    _expect_regular(os.stat(name))
    # Not to wait for the writer of a pipe that has taken the file's place.
    descriptor = os.open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        _expect_regular(os.fstat(descriptor))
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def _expect_regular(found: os.stat_result) -> None:
    for is_kind, kind in _KINDS:
        if is_kind(found.st_mode):
            raise ValueError(f"it is {kind}, not a file")


def expect_pixels(rows: int, cols: int) -> None:
    """Refuses a size that no range image has, before anything is allocated for it."""
    if rows < 1 or cols < 1:
        raise ValueError(f"it holds {cols} x {rows} pixels, no image")
    if rows * cols > PIXEL_LIMIT:
        raise ValueError(f"{cols} x {rows} pixels are more than the {PIXEL_LIMIT} that are read")


def expect_unpacked(unpacked: int, packed: int) -> None:
    """Refuses a compressed file that would fill the memory."""
    if unpacked > max(UNPACKED_FREELY, UNPACKED_RATIO * packed):
        raise ValueError(
            f"it unpacks from {packed} bytes to {unpacked}: more than 256 MiB and than {UNPACKED_RATIO} times its size "
            "are taken for a bomb; store it uncompressed"
        )


def expect_size(found: int, needed: int, unit: str = "bytes") -> None:
    if found != needed:
        raise ValueError(f"it holds {found} {unit} where {needed} are needed")


def expect_at_least(found: int, needed: int, unit: str = "bytes") -> None:
    if found < needed:
        raise ValueError(f"it is truncated: {found} {unit} where {needed} are needed")


def inflate(packed: bytes | memoryview, size: int) -> bytearray:
    """The first `size` bytes, or as many as there are, of what zlib has packed.

    Some at a time: Python looks for an interrupt in between.
    """
    stream = zlib.decompressobj()
    plain = bytearray()
    while packed and len(plain) < size:
        plain += stream.decompress(packed, min(_AT_A_TIME, size - len(plain)))
        packed = stream.unconsumed_tail
    return plain
