"""What is said goes to the standard output and to that of errors, whatever these take, and whether there are any."""

from __future__ import annotations

import contextlib
import os
import sys


def prepare() -> None:
    """Let the streams take every text: names of files may have characters, or bytes, that their encoding has not."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # the program was started with a closed one
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif getattr(stream, "errors", None) == "strict":
            with contextlib.suppress(AttributeError):  # of a program that has put its own stream there
                stream.reconfigure(errors="backslashreplace")


def silence() -> None:
    """Nothing more goes to the standard output, not even what is still on its way."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
