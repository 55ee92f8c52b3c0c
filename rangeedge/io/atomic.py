"""Files that are written as a whole or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import cv2

from .._check import error


@contextlib.contextmanager
def writing(path: str | os.PathLike[str], what: str = "cannot write") -> Iterator[None]:
    """What cannot be written is an error that names the file or folder."""
    try:
        yield
    except (OSError, ValueError) as reason:
        if isinstance(reason, error):
            raise
        why = getattr(reason, "strerror", None) or reason
        raise error(f"{what} {os.fspath(path)!r}: {why}", cv2.Error.StsError) from reason


def write_atomically(path: str | os.PathLike[str], data: bytes) -> None:
    """Make `data` the content of the file, in one step: readers see the old content or the new one.

    Where the system can (Linux, most file systems), the data goes to a file without a name, which a killed process
    leaves no trace of; elsewhere to a temporary file beside the target.
    """
    target = Path(path)
    _expect_replaceable(target)
    temporary = target.with_name(f".{uuid.uuid4().hex}.tmp")
    try:
        put(temporary, nameless(target.parent, data), data)
        os.replace(temporary, target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _expect_replaceable(target: Path) -> None:
    """A device or a pipe would be replaced by a file, which nobody means."""
    try:
        mode = os.stat(target).st_mode
    except OSError:  # nothing there; the directory's own troubles are met when it is written
        return
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise OSError(f"{str(target)!r} is not a file")


def nameless(folder: Path, data: bytes) -> BinaryIO | None:
    """A complete file without a name, which is gone once it is closed or the process killed; None where none can be."""
    if not hasattr(os, "O_TMPFILE"):
        return None
    try:
        descriptor = os.open(folder, os.O_WRONLY | os.O_TMPFILE, 0o666)
    except OSError:
        return None
    file = os.fdopen(descriptor, "wb")
    try:
        file.write(data)
        file.flush()
    except BaseException:
        file.close()
        raise
    return file


def put(path: Path, file: BinaryIO | None, data: bytes) -> None:
    """Give `path` to a nameless file of that content; write the content there where that cannot be."""
    if file is not None:
        with file, contextlib.suppress(OSError):
            # With a descriptor, which an absolute path makes idle, Python calls linkat, which follows the link.
            os.link(f"/proc/self/fd/{file.fileno()}", path, src_dir_fd=file.fileno(), follow_symlinks=True)
            return
    path.write_bytes(data)
