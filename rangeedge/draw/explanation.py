"""A picture of why a pixel is an edge or none: its scan lines after Figure 3 of the paper."""

from __future__ import annotations

import cv2
import numpy as np

from .. import _check
from ..explain import Explanation
from ..traces import Cut, ScanLine
from .palette import kind_colour

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 620, 300, 74, 12, 34, 30
_PAPER, _INK, _AXIS, _FAINT = (255, 255, 255), (40, 40, 40), (150, 150, 150), (190, 190, 190)
_BAND, _SAMPLES, _PIXEL = (240, 226, 208), (60, 60, 60), (0, 94, 213)
_CURVES = ((178, 114, 0), (115, 158, 0))  # of neighbouring segments, in turn
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SIZE = 0.46  # of text
_SHIFT = 4  # binary digits of fractions of a pixel


@_check.public
def drawExplanation(explanation: Explanation) -> np.ndarray:
    """Draw the scan lines around a pixel: samples, tolerance, the curves of the segments, and the cuts between them.

    drawExplanation(explanation) -> retval

    One panel a direction, after Figure 3 of the paper: depth (or height) over pixels along the line. Dots are
    samples, the pale band is the tolerance of splitting around the curves, which are blue and green in turn; cuts that
    are candidates of edges are full vertical lines in the colours of `drawEdges`, those that failed a test are broken
    grey ones, each with its number in the text below the panel. The pixel is ringed.

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
    panels = [_panel(line) for line in explanation.lines]
    panels += [np.full((_HEIGHT + _notes_height(), _WIDTH, 3), _PAPER, np.uint8)] * (-len(panels) % columns)
    rows = [np.hstack(panels[i : i + columns]) for i in range(0, len(panels), columns)]
    width = rows[0].shape[1] if rows else 2 * _WIDTH
    return np.vstack([_text(_wrapped(head, width), width), *rows])


_DIRECTIONS = ("row", "column", "diagonal 45", "diagonal 135")
_NOTES, _LINE = 3, 19  # cuts explained under a panel, and the height of a line of text


def _notes_height() -> int:
    return 2 * _NOTES * _LINE + 10


def _text(lines: list[str], width: int) -> np.ndarray:
    picture = np.full((_LINE * len(lines) + 12, width, 3), _PAPER, np.uint8)
    for i, line in enumerate(lines):
        _write(picture, line, (10, _LINE * (i + 1)), _SIZE)
    return picture


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


def _panel(line: ScanLine) -> np.ndarray:
    panel = np.full((_HEIGHT, _WIDTH, 3), _PAPER, np.uint8)
    plot = _Plot(line)
    _bands(panel, plot, line)
    _axes(panel, plot, line)
    near = sorted(line.cuts, key=lambda cut: abs(cut.sample - line.at))[:_NOTES]
    noted = sorted(near, key=lambda cut: cut.sample)
    for cut in line.cuts:
        _draw_cut(panel, plot, cut)
    _curves(panel, plot, line)
    seen = np.flatnonzero(np.isfinite(line.samples["depth"]))
    for place in plot.at(seen, line.samples["depth"][seen]).tolist():
        cv2.circle(panel, place, 5 << (_SHIFT - 1), _SAMPLES, cv2.FILLED, cv2.LINE_AA, _SHIFT)
    here = plot.at(np.array([line.at]), line.samples["depth"][[line.at]])[0].tolist()
    cv2.circle(panel, here, 8 << _SHIFT, _PIXEL, 2, cv2.LINE_AA, _SHIFT)
    for i, cut in enumerate(noted, 1):
        _number_cut(panel, int(plot.x(cut.sample)), i)
    notes = [f"{i}  {cut.kind}: {cut.fate}." for i, cut in enumerate(noted, 1)]
    below = _text(_wrapped(notes or ["no cut"], _WIDTH)[: 2 * _NOTES], _WIDTH)
    below = cv2.copyMakeBorder(
        below[: _notes_height()], 0, max(0, _notes_height() - len(below)), 0, 0, cv2.BORDER_CONSTANT, value=_PAPER
    )
    return np.vstack([panel, below])


def _axes(panel: np.ndarray, plot: _Plot, line: ScanLine) -> None:
    cv2.rectangle(panel, (_LEFT, _TOP), (_WIDTH - _RIGHT, _HEIGHT - _BOTTOM), _AXIS, 1)
    first, last = (f"({line.samples['x'][i]:.0f}, {line.samples['y'][i]:.0f})" for i in (0, -1))
    _write(panel, f"{line.name}, from {first} to {last}", (_LEFT, _TOP - 12), 0.5)
    ticks, digits = _ticks(plot.low, plot.high)
    for value in ticks:
        y = int(plot.y(value))
        cv2.line(panel, (_LEFT - 4, y), (_LEFT, y), _AXIS, 1)
        text = f"{value:.{digits}f}"
        _write_before(panel, text, y + 5)
    _write_before(panel, "height" if plot.upright else "depth", _TOP - 12)
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


def _curves(panel: np.ndarray, plot: _Plot, line: ScanLine) -> None:
    for i, part in enumerate(_segments(line)):
        if len(part):
            places = plot.at(part, line.samples["fittedDepth"][part])
            cv2.polylines(panel, [places], False, _CURVES[i % 2], 2, cv2.LINE_AA, _SHIFT)


def _draw_cut(panel: np.ndarray, plot: _Plot, cut: Cut) -> None:
    x = int(plot.x(cut.sample))
    if not cut.test:
        cv2.line(panel, (x, _TOP), (x, _HEIGHT - _BOTTOM), _INK, 4)
        cv2.line(panel, (x, _TOP), (x, _HEIGHT - _BOTTOM), kind_colour(cut.bits), 2)
    else:
        for y in range(_TOP, _HEIGHT - _BOTTOM, 8):
            cv2.line(panel, (x, y), (x, y + 3), _FAINT, 1)


def _number_cut(panel: np.ndarray, x: int, number: int) -> None:
    """At the end of the line of a cut that nothing else is written at."""
    place = (x + 5 if x + 16 < _WIDTH - _RIGHT else x - 14, _HEIGHT - _BOTTOM - 6)
    cv2.putText(panel, str(number), place, _FONT, 0.46, _PAPER, 4, cv2.LINE_AA)
    _write(panel, str(number), place, 0.46)
