"""What has become of every frame: a line of JSON each, in a file beside the results.

A line is appended when the results of its frame are complete. Of a run that goes on with the results of another, the
lines are kept that still hold; so every frame has one line at the end, and what has none is not done.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2

from .._check import error
from ..io.atomic import write_atomically

Line = dict[str, Any]


def read_lines(path: Path) -> dict[str, Line]:
    """The lines of a manifest by the names of frames. One that was cut off, at the end, is none."""
    found: dict[str, Line] = {}
    try:
        text = path.read_text("utf-8", "replace")
    except FileNotFoundError:
        return found
    for line in text.splitlines():
        with contextlib.suppress(ValueError, KeyError, TypeError, RecursionError):
            entry = json.loads(line)
            found[entry["frame"]] = entry
    return found


class Manifest:
    """A manifest that nobody else writes to, open for appending."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines: dict[str, Line] = {}

    @contextlib.contextmanager
    def opened(self) -> Iterator[Manifest]:
        """Locks the manifest and reads it; the lock ends with the process, however that ends."""
        with _named(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.path.with_name(f".{self.path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o666)
        try:
            try:
                _lock(lock)
            except (BlockingIOError, PermissionError):
                raise error(
                    f"another run is writing to {str(self.path.parent)!r}; wait for it, or give another `out`"
                ) from None
            self.lines = read_lines(self.path)
            yield self
        finally:
            os.close(lock)

    def keep(self, names: set[str]) -> None:
        """Leave only the lines of these frames, in the file; none in memory."""
        kept, self.lines = (line for name, line in self.lines.items() if name in names), {}
        with _named(self.path):
            write_atomically(self.path, b"".join(map(_encoded, kept)))

    def append(self, line: Line) -> None:
        """Add a line, in one piece or not at all."""
        with _named(self.path):
            descriptor = os.open(self.path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
            try:
                before = os.fstat(descriptor).st_size
                data = _encoded(line)
                try:
                    if os.write(descriptor, data) < len(data):
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                except OSError:
                    os.ftruncate(descriptor, before)
                    raise
            finally:
                os.close(descriptor)


def _lock(descriptor: int) -> None:
    """Takes a file for this process, until it closes it or ends; a file that another has taken is refused."""
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _encoded(line: Mapping[str, Any]) -> bytes:
    return json.dumps(line, allow_nan=False).encode() + b"\n"


@contextlib.contextmanager
def _named(path: Path) -> Iterator[None]:
    """What cannot be written is an error that names the file."""
    try:
        yield
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error(f"cannot write to {str(path)!r}: {what}", cv2.Error.StsError) from reason


def changed(path: str) -> int | None:
    """When a file was changed, in nanoseconds."""
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return None


def complete(root: Path, line: Line) -> bool:
    """Whether the files of a line are there, as long as they were."""
    try:
        return all((root / name).stat().st_size == size for name, size in line["outputs"].items())
    except (OSError, KeyError, AttributeError, TypeError):
        return False
