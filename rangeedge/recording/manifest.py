"""What has become of every frame: a line of JSON each, in a file beside the results.

A line is appended when the results of its frame are complete. Of a run that goes on with the results of another, the
lines are kept that still hold; so every frame has one line at the end, and what has none is not done.
"""

from __future__ import annotations

import contextlib
import errno
import json
import math
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .._check import error
from ..io.atomic import write_atomically, writing
from ..io.source import opened

Line = dict[str, Any]
MANIFEST = "manifest.jsonl"


def read_lines(path: Path) -> dict[str, Line]:
    """The lines of a manifest by the names of frames. One that was cut off, at the end, is none."""
    found: dict[str, Line] = {}
    if not path.exists():
        return found
    with opened(str(path), math.inf) as (stream, _):
        for line in stream:
            with contextlib.suppress(ValueError, KeyError, TypeError, RecursionError):
                entry = json.loads(line, parse_float=_finite, parse_constant=_finite)
                found[entry["frame"]] = entry
    return found


def _finite(text: str) -> float:
    """A number; a line that holds another was not written here."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


class Manifest:
    """A manifest that nobody else writes to, open for appending."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines: dict[str, Line] = {}

    @contextlib.contextmanager
    def opened(self) -> Iterator[Manifest]:
        """Locks the manifest and reads it; the lock ends with the process, however that ends."""
        with writing(self.path, "cannot write to"):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            lock = os.open(self.path.with_name(f".{self.path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o666)
        try:
            with writing(self.path, "cannot lock"):
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
        with writing(self.path, "cannot write to"):
            write_atomically(self.path, b"".join(map(_encoded, kept)))

    def append(self, line: Line) -> None:
        """Add a line, in one piece or not at all."""
        with writing(self.path, "cannot write to"):
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


def state_of(path: str) -> Line:
    """What tells whether a file was changed: its time in nanoseconds, and its size in bytes."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return {"modified": None, "bytes": None}
    return {"modified": found.st_mtime_ns, "bytes": found.st_size}


def complete(root: Path, line: Line) -> bool:
    """Whether the files of a line are there, as long as they were."""
    try:
        outputs = line["outputs"].items()
        return bool(outputs) and all((root / name).stat().st_size == size for name, size in outputs)
    except (OSError, KeyError, AttributeError, TypeError):
        return False
