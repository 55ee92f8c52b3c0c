"""Sheets of pictures beside each other: titles, axes in pixels, the key to colours."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from .palette import EDGE_KINDS

BACKGROUND = (32, 32, 32)
_INK = (235, 235, 235)
_FONT, _FONT_SCALE, _BAR = cv2.FONT_HERSHEY_SIMPLEX, 0.55, 28
_SMALL, _BELOW, _TICK = 0.4, 20, 4  # size of the numbers at axes, the height that they take, length of a tick
_TICKS = 6  # about as many along a side


def sheet(
    panels: list[tuple[str, np.ndarray]], title: str | None, columns: int | None = None, *, key: bool = True
) -> np.ndarray:
    """Captioned panels in a grid near 16:9, a title above and the key to the colours below."""
    height, width = panels[0][1].shape[:2]
    width = max(width, *(_text_width(caption) for caption, _ in panels))
    cells = [_cell(caption, picture, width) for caption, picture in panels]
    height, width = cells[0].shape[:2]
    columns = columns or min(
        (1, 2, 4) if len(cells) == 4 else (1, 2, 3, 6),
        key=lambda n: abs(np.log(n * width / (-(-len(cells) // n) * height) * 9 / 16)),
    )
    cells += [np.full_like(cells[0], BACKGROUND)] * (-len(cells) % columns)
    rows = [np.hstack(cells[i : i + columns]) for i in range(0, len(cells), columns)]
    top = [] if title is None else [_bar(title, rows[0].shape[1])]
    return np.vstack([*top, *rows, *([key_to(rows[0].shape[1])] if key else [])])


def with_axes(picture: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """A picture of an image of this shape with its rows and columns numbered below and on the left."""
    height, width = picture.shape[:2]
    steps = [_step(count) for count in shape]
    left = _TICK + 4 + max(_number_width(k) for k in range(0, shape[0], steps[0]))
    framed = cv2.copyMakeBorder(picture, 0, _BELOW, left, 0, cv2.BORDER_CONSTANT, value=BACKGROUND)
    for row in range(0, shape[0], steps[0]):
        y = int((row + 0.5) * height / shape[0])
        cv2.line(framed, (left - _TICK, y), (left - 1, y), _INK, 1)
        _number(framed, row, left - _TICK - 2 - _number_width(row), min(max(y + 4, 10), height))
    for col in range(0, shape[1], steps[1]):
        x = left + int((col + 0.5) * width / shape[1])
        cv2.line(framed, (x, height), (x, height + _TICK - 1), _INK, 1)
        if col and x + _number_width(col) // 2 < left + width:
            _number(framed, col, x - _number_width(col) // 2, height + 16)
    cv2.putText(framed, "px", (2, height + 16), _FONT, _SMALL, _INK, 1, cv2.LINE_AA)
    return framed


def _step(count: int) -> int:
    """A round number of pixels, of which a side has a few."""
    power = 10 ** max(int(np.log10(max(count / _TICKS, 1))), 0)
    return next(step * power for step in (1, 2, 5, 10) if step * power * _TICKS >= count)


def _number(picture: np.ndarray, number: int, x: int, y: int) -> None:
    cv2.putText(picture, str(number), (x, y), _FONT, _SMALL, _INK, 1, cv2.LINE_AA)


def _number_width(number: int) -> int:
    return cv2.getTextSize(str(number), _FONT, _SMALL, 1)[0][0]


def _cell(caption: str, picture: np.ndarray, width: int) -> np.ndarray:
    """A picture under its caption, with a margin to the right and below."""
    cell = np.full((_BAR + picture.shape[0] + 4, width + 4, 3), BACKGROUND, np.uint8)
    cell[:_BAR] = _bar(caption, width + 4)
    cell[_BAR : _BAR + picture.shape[0], : picture.shape[1]] = picture
    return cell


def _bar(text: str, width: int) -> np.ndarray:
    bar = np.full((_BAR, width, 3), BACKGROUND, np.uint8)
    return cv2.putText(bar, _encodable(text), (6, _BAR - 9), _FONT, _FONT_SCALE, _INK, 1, cv2.LINE_AA)


def _text_width(text: str) -> int:
    return cv2.getTextSize(_encodable(text), _FONT, _FONT_SCALE, 1)[0][0] + 12


def _encodable(text: str) -> str:
    """A text without the lone surrogates that names of files may hold, which OpenCV 5 does not survive."""
    return text.encode("utf-8", "replace").decode()


def sentence(text: str, width: int) -> list[np.ndarray]:
    """Bars of text no wider than a picture."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and _text_width(longer) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return [_bar(line, width) for line in lines]


def key_to(width: int, entries: Sequence[tuple[tuple[int, int, int], str]] = EDGE_KINDS) -> np.ndarray:
    """Colours with their meaning, by default those of edges, on as many lines as they need."""
    lines, x = [_bar("", width)], 6
    for colour, text in entries:
        needed = _text_width(text) + 24
        if x > 6 and x + needed > width:
            lines.append(_bar("", width))
            x = 6
        cv2.rectangle(lines[-1], (x, 7), (x + 14, 21), colour, cv2.FILLED)
        cv2.putText(lines[-1], text, (x + 22, _BAR - 9), _FONT, _FONT_SCALE, _INK, 1, cv2.LINE_AA)
        x += needed
    return np.vstack(lines)
