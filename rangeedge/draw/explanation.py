"""A picture of why a pixel is an edge or none: its scan lines after Figure 3 of the paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np

from .. import _check
from ..edges import kind_in_words
from ..explain import Explanation
from ..traces import Cut, ScanLine
from .palette import KINDS, kind_colour

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 620, 300, 74, 12, 34, 30
_PAPER, _INK, _AXIS, _FAINT = (255, 255, 255), (40, 40, 40), (150, 150, 150), (190, 190, 190)
_BAND, _SAMPLES, _PIXEL = (240, 226, 208), (60, 60, 60), (0, 94, 213)
_CURVES = ((178, 114, 0), (115, 158, 0))  # of neighbouring segments, in turn
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SIZE = 0.46  # of text
_SHIFT = 4  # binary digits of fractions of a pixel
_SYMBOL = 34  # width of what the key explains


@_check.public
def drawExplanation(explanation: Explanation) -> np.ndarray:
    """Draw the scan lines around a pixel: samples, tolerance, the curves of the segments, and the cuts between them.

    drawExplanation(explanation) -> retval

    One panel a direction, after Figure 3 of the paper: depth (or height) over pixels along the line. Dots are
    samples, the pale band is the tolerance of splitting around the curves, which are blue and green in turn; cuts that
    are candidates of edges are full vertical lines in the colours of `drawEdges`, those that failed a test are broken
    grey ones, each with its number in the text below the panel. The pixel is ringed. A key explains all of this.

    Parameters
    ----------
    explanation : Explanation
        From `explainPixel`.

    Returns
    -------
    retval : ndarray of shape (h, w, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If `explanation` is none.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawExplanation, explainPixel
    >>> roof = 0.2 * np.abs(np.arange(64) - 30.3) * np.ones((48, 1))
    >>> drawExplanation(explainPixel(roof, 30, 20, noise=0.001)).shape[2]
    3
    """
    if not isinstance(explanation, Explanation):
        raise _check.fail("explanation", "an Explanation from explainPixel", _check.described(explanation))
    head = [line.strip() for line in str(explanation).splitlines()]
    head = head[: next((i for i, line in enumerate(head) if line.split(":")[0] in _DIRECTIONS), len(head))]
    columns = 2 if len(explanation.lines) > 1 else 1
    panels = [_panel(line, explanation.unit) for line in explanation.lines]
    panels += [np.full((_HEIGHT + _notes_height(), _WIDTH, 3), _PAPER, np.uint8)] * (-len(panels) % columns)
    rows = [np.hstack(panels[i : i + columns]) for i in range(0, len(panels), columns)]
    width = rows[0].shape[1] if rows else 2 * _WIDTH
    return np.vstack([_text(_wrapped(head, width), width), *rows, *([_key(explanation, width)] if rows else [])])


_DIRECTIONS = ("row", "column", "diagonal 45", "diagonal 135")
_NOTES, _LINE = 3, 19  # cuts explained under a panel, and the height of a line of text


def _notes_height() -> int:
    return 2 * _NOTES * _LINE + 10


def _text(lines: list[str], width: int) -> np.ndarray:
    picture = np.full((_LINE * len(lines) + 12, width, 3), _PAPER, np.uint8)
    for i, line in enumerate(lines):
        _write(picture, line, (10, _LINE * (i + 1)), _SIZE)
    return picture


def _key(explanation: Explanation, width: int) -> np.ndarray:
    """What dots, bands and lines mean; of kinds those that are there."""
    seen = {kind_colour(cut.bits) for line in explanation.lines for cut in line.cuts if not cut.test}
    wider = f", {explanation.correlation:.2g} times wider as noise is correlated" if explanation.correlated else ""
    entries = [
        (_symbol_of_samples, "samples, the pixel ringed"),
        (_symbol_of_band, f"tolerance around the curves of segments{wider}"),
        *((_symbol_of_kind(colour), f"candidate: {text}") for _, colour, text in reversed(KINDS) if colour in seen),
        (_symbol_of_lost, "cut that failed a test"),
    ]
    lines, x = [np.full((_LINE + 6, width, 3), _PAPER, np.uint8)], 10
    for symbol, text in entries:
        needed = _SYMBOL + 28 + cv2.getTextSize(text, _FONT, _SIZE, 1)[0][0]
        if x > 10 and x + needed > width:
            lines.append(np.full_like(lines[0], _PAPER))
            x = 10
        symbol(lines[-1][:, x : x + _SYMBOL])
        _write(lines[-1], text, (x + _SYMBOL + 8, _LINE - 2), _SIZE)
        x += needed
    return np.vstack(lines)


def _symbol_of_samples(picture: np.ndarray) -> None:
    y = len(picture) // 2
    for x in (6, 17, 28):
        _dot(picture, (x << _SHIFT, y << _SHIFT))
    cv2.circle(picture, (17, y), 8, _PIXEL, 2, cv2.LINE_AA)


def _symbol_of_band(picture: np.ndarray) -> None:
    y = len(picture) // 2
    picture[y - 8 : y + 9] = _BAND
    for colour, x in zip(_CURVES, (0, _SYMBOL // 2), strict=True):
        cv2.line(picture, (x, y), (x + _SYMBOL // 2 - 2, y), colour, 2)


def _symbol_of_kind(colour: tuple[int, int, int]) -> Callable[[np.ndarray], None]:
    return lambda picture: _full_line(picture, _SYMBOL // 2, 2, len(picture) - 3, colour)


def _symbol_of_lost(picture: np.ndarray) -> None:
    _broken_line(picture, _SYMBOL // 2, 2, len(picture) - 3)


def _dot(picture: np.ndarray, place: Sequence[int]) -> None:
    """Of a sample, at a place in fractions of a pixel."""
    cv2.circle(picture, place, 3 << _SHIFT, _SAMPLES, cv2.FILLED, cv2.LINE_AA, _SHIFT)


def _full_line(picture: np.ndarray, x: int, top: int, bottom: int, colour: tuple[int, int, int]) -> None:
    cv2.line(picture, (x, top), (x, bottom), _INK, 4)
    cv2.line(picture, (x, top), (x, bottom), colour, 2)


def _broken_line(picture: np.ndarray, x: int, top: int, bottom: int) -> None:
    for y in range(top, bottom, 8):
        cv2.line(picture, (x, y), (x, min(y + 3, bottom)), _FAINT, 1)


def _write(
    picture: np.ndarray, text: str, place: tuple[int, int], size: float, colour: tuple[int, int, int] = _INK
) -> None:
    cv2.putText(picture, text, place, _FONT, size, colour, 1, cv2.LINE_AA)


def _wrapped(lines: list[str], width: int) -> list[str]:
    """Lines of text no wider than a picture."""
    result = []
    for line in lines:
        words, current = line.split(" "), ""
        for word in words:
            longer = f"{current} {word}" if current else word
            if current and cv2.getTextSize(longer, _FONT, _SIZE, 1)[0][0] > width - 20:
                result.append(current)
                current = word
            else:
                current = longer
        result.append(current)
    return result


class _Plot:
    """Where depths over samples are in a panel."""

    def __init__(self, line: ScanLine) -> None:
        s = line.samples
        depths = np.concatenate([s["depth"], s["fittedDepth"]])
        depths = depths[np.isfinite(depths)]
        low, high = (depths.min(), depths.max()) if depths.size else (0.0, 1.0)
        least = 6 * float(np.nanmax(s["toleranceDepth"], initial=0.0)) or 1e-6
        middle, half = (low + high) / 2, 0.55 * max(high - low, least)
        self.low, self.high, self.count = middle - half, middle + half, len(s)
        self.upright = np.array_equal(s["depth"], s["ordinate"], equal_nan=True)  # heights

    def x(self, sample: float | np.ndarray) -> np.ndarray:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (np.asarray(sample) + 0.5) / self.count

    def y(self, depth: float | np.ndarray) -> np.ndarray:
        """Nearer is higher, as the scanner would be above."""
        share = np.clip((np.asarray(depth) - self.low) / (self.high - self.low), -1, 2)
        share = 1 - share if self.upright else share
        return _TOP + (_HEIGHT - _TOP - _BOTTOM) * share

    def at(self, samples: np.ndarray, depths: np.ndarray) -> np.ndarray:
        places = np.column_stack([self.x(samples), self.y(depths)])
        return np.rint(places * (1 << _SHIFT)).astype(np.int32)


def _panel(line: ScanLine, unit: str) -> np.ndarray:
    panel = np.full((_HEIGHT, _WIDTH, 3), _PAPER, np.uint8)
    plot = _Plot(line)
    _bands(panel, plot, line)
    _axes(panel, plot, line, unit)
    near = sorted(line.cuts, key=lambda cut: abs(cut.sample - line.at))[:_NOTES]
    noted = sorted(near, key=lambda cut: cut.sample)
    for cut in line.cuts:
        _draw_cut(panel, plot, cut)
    _curves(panel, plot, line)
    seen = np.flatnonzero(np.isfinite(line.samples["depth"]))
    for place in plot.at(seen, line.samples["depth"][seen]).tolist():
        _dot(panel, place)
    here = plot.at(np.array([line.at]), line.samples["depth"][[line.at]])[0].tolist()
    cv2.circle(panel, here, 8 << _SHIFT, _PIXEL, 2, cv2.LINE_AA, _SHIFT)
    for i, cut in enumerate(noted, 1):
        _number_cut(panel, int(plot.x(cut.sample)), i)
    notes = [f"{i}  {kind_in_words(cut.bits)}: {cut.fate}." for i, cut in enumerate(noted, 1)]
    below = _text(_wrapped(notes or ["no cut"], _WIDTH)[: 2 * _NOTES], _WIDTH)
    below = cv2.copyMakeBorder(
        below[: _notes_height()], 0, max(0, _notes_height() - len(below)), 0, 0, cv2.BORDER_CONSTANT, value=_PAPER
    )
    return np.vstack([panel, below])


def _axes(panel: np.ndarray, plot: _Plot, line: ScanLine, unit: str) -> None:
    cv2.rectangle(panel, (_LEFT, _TOP), (_WIDTH - _RIGHT, _HEIGHT - _BOTTOM), _AXIS, 1)
    first, last = (f"({line.samples['x'][i]:.0f}, {line.samples['y'][i]:.0f})" for i in (0, -1))
    _write(panel, f"{line.name}, from {first} to {last}", (_LEFT, _TOP - 12), 0.5)
    ticks, digits = _ticks(plot.low, plot.high)
    for value in ticks:
        y = int(plot.y(value))
        cv2.line(panel, (_LEFT - 4, y), (_LEFT, y), _AXIS, 1)
        text = f"{value:.{digits}f}"
        _write_before(panel, text, y + 5)
    name = "height" if plot.upright else "depth"
    _write_before(panel, f"{name}, {unit}" if unit else name, _TOP - 12)
    _write_before(panel, "pixels", _HEIGHT - _BOTTOM + 19)
    for offset in range(-plot.count // 10 * 10, plot.count, 10):
        if 0 <= line.at + offset < plot.count:
            x = int(plot.x(line.at + offset))
            cv2.line(panel, (x, _HEIGHT - _BOTTOM), (x, _HEIGHT - _BOTTOM + 4), _AXIS, 1)
            _write(panel, f"{offset:+d}" if offset else "0", (x - 10, _HEIGHT - _BOTTOM + 19), 0.42)


def _write_before(panel: np.ndarray, text: str, y: int) -> None:
    """Left of the axis, up to it."""
    _write(panel, text, (_LEFT - 8 - cv2.getTextSize(text, _FONT, 0.42, 1)[0][0], y), 0.42)


def _ticks(low: float, high: float) -> tuple[np.ndarray, int]:
    """About five round values, and the digits after the point that they need."""
    power = int(np.floor(np.log10((high - low) / 4)))
    step = next(s for s in (1, 2, 5, 10) if s * 10.0**power >= (high - low) / 5) * 10.0**power
    ticks = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
    return ticks, max(0, -int(np.floor(np.log10(step) + 1e-9)))


def _segments(line: ScanLine) -> list[np.ndarray]:
    """The samples of every segment that are shown."""
    count = len(line.samples)
    parts = [np.arange(max(0, int(s["first"])), min(count, int(s["last"]) + 1)) for s in line.segments]
    return [part[np.isfinite(line.samples["fittedDepth"][part])] for part in parts]


def _bands(panel: np.ndarray, plot: _Plot, line: ScanLine) -> None:
    for part in _segments(line):
        if len(part) > 1:
            fitted, off = line.samples["fittedDepth"][part], line.samples["toleranceDepth"][part]
            outline = np.concatenate([plot.at(part, fitted - off), plot.at(part, fitted + off)[::-1]])
            cv2.fillPoly(panel, [outline], _BAND, cv2.LINE_AA, _SHIFT)
    panel[:_TOP] = panel[_HEIGHT - _BOTTOM :] = _PAPER


def _curves(panel: np.ndarray, plot: _Plot, line: ScanLine) -> None:
    for i, part in enumerate(_segments(line)):
        if len(part):
            places = plot.at(part, line.samples["fittedDepth"][part])
            cv2.polylines(panel, [places], False, _CURVES[i % 2], 2, cv2.LINE_AA, _SHIFT)


def _draw_cut(panel: np.ndarray, plot: _Plot, cut: Cut) -> None:
    x = int(plot.x(cut.sample))
    if cut.test:
        _broken_line(panel, x, _TOP, _HEIGHT - _BOTTOM)
    else:
        _full_line(panel, x, _TOP, _HEIGHT - _BOTTOM, kind_colour(cut.bits))


def _number_cut(panel: np.ndarray, x: int, number: int) -> None:
    """At the end of the line of a cut that nothing else is written at."""
    place = (x + 5 if x + 16 < _WIDTH - _RIGHT else x - 14, _HEIGHT - _BOTTOM - 6)
    cv2.putText(panel, str(number), place, _FONT, 0.46, _PAPER, 4, cv2.LINE_AA)
    _write(panel, str(number), place, 0.46)
