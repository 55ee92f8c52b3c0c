"""Headers and numbers that files hold as text."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .source import HEADER_LIMIT

_CHUNK = 2**20


def header_lines(data: bytes) -> Iterator[tuple[str, int]]:
    """Lines of a header and where each one ends, whatever ends them: LF, CR LF or, as on an old Macintosh, CR."""
    head = data[:HEADER_LIMIT]
    feed, carriage = head.find(b"\n"), head.find(b"\r")
    ending = b"\r" if carriage >= 0 and (feed < 0 or carriage + 1 < feed) else b"\n"
    start = 0
    while (end := head.find(ending, start)) >= 0:
        yield head[start:end].decode("latin-1").rstrip("\r"), end + 1
        start = end + 1


def number(word: bytes) -> float:
    """A number, also one that is none as C and Windows write it: -nan(ind), nan(0x8000), 1.#QNAN, -1.#IND, 1.#INF."""
    try:
        return float(word)
    except ValueError:
        digits = word.lower().lstrip(b"+-")
        if digits.startswith((b"nan", b"1.#")):
            return float("nan")
        shown = word[:40].decode("latin-1")
        raise ValueError(f"it holds {shown!r} where a number is needed") from None


def numbers(text: bytes, start: int, count: int) -> np.ndarray:
    """The `count` numbers that `text` consists of from `start` on."""
    if count > (len(text) - start + 1) // 2:
        raise ValueError(f"it is truncated: {len(text) - start} bytes of text where {count} values are needed")
    values = np.empty(count)
    found = 0
    for some in words(text, start):
        if found + len(some) > count:
            raise ValueError(f"it holds more than the {count} values that are needed")
        try:
            values[found : found + len(some)] = list(map(float, some))
        except ValueError:
            values[found : found + len(some)] = list(map(number, some))
        found += len(some)
    if found != count:
        raise ValueError(f"it holds {found} values where {count} are needed")
    return values


def words(text: bytes, start: int) -> Iterator[list[bytes]]:
    """The words of a text, some at a time."""
    while start < len(text):
        piece = text[start : start + _CHUNK]
        found = piece.split()
        start += len(piece)
        if start < len(text) and found and not piece[-1:].isspace():  # the last word may go on
            if len(found[-1]) == _CHUNK:
                raise ValueError("it holds a word of a million characters")
            start -= len(found.pop())
        yield found
