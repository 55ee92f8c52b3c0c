"""Files that are written as a whole or not at all."""

from __future__ import annotations

import os
import stat
import uuid
from pathlib import Path


def write_atomically(path: str | os.PathLike[str], data: bytes) -> None:
    """Make `data` the content of the file, in one step: readers see the old content or the new one.

    Where the system can (Linux, most file systems), the data goes to a file without a name, which a killed process
    leaves no trace of; elsewhere to a temporary file beside the target.
    """
    target = Path(path)
    _expect_replaceable(target)
    temporary = target.with_name(f".{uuid.uuid4().hex}.tmp")
    try:
        if not _write_nameless(temporary, data):
            temporary.write_bytes(data)
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


def _write_nameless(temporary: Path, data: bytes) -> bool:
    """Writes to a file that gets its name when it is complete; False where there are no such files."""
    if not hasattr(os, "O_TMPFILE"):
        return False
    try:
        descriptor = os.open(temporary.parent, os.O_WRONLY | os.O_TMPFILE, 0o666)
    except OSError:
        return False
    with os.fdopen(descriptor, "wb") as file:
        file.write(data)
        file.flush()
        try:
            # With a descriptor, which an absolute path makes idle, Python calls linkat, which follows the link.
            os.link(f"/proc/self/fd/{descriptor}", temporary, src_dir_fd=descriptor, follow_symlinks=True)
        except OSError:
            return False
    return True
