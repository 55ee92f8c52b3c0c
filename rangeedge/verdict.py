"""A pixel on its way through the detector: where it is decided whether it is an edge, and which option decides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np

from . import _core
from .constants import EDGE_JUMP, EDGE_OCCLUDING
from .detection import selected, thin_lines
from .edges import EdgeStrength
from .frame import Frame
from .options import ScanLineParams, Selection
from .pixels import components
from .sectors import around
from .traces import Cut, ScanLine, scan_lines

# What keeps every line, but does not make edges of borders.
_EVERY_LINE: dict[str, Any] = {"minLength": 1, "lineSignificance": 0.0, "dynamic": False, "boundaryEdges": False}
_RAISED, _LOWERED = 1.001, 0.999  # past a limit, beyond the rounding of the maps
_NAN = float("nan")
_TESTS = ("gap", "single", "smooth", "smeared", "significance")  # in the order in which cuts get to them
Change = Mapping[str, Any]  # options and their values


class Verdict(NamedTuple):
    """Where it was decided and why, what was compared with what, and changes of options that would decide otherwise.

    Each change turns this test, one alone being enough; whether the pixel then passes those after it is not said.
    """

    stage: str
    reason: str
    value: float = _NAN
    limit: float = _NAN
    changes: tuple[Change, ...] = ()


class Case:
    """A pixel of a range image, with the strengths that were measured in it and the options that select of them."""

    def __init__(
        self, frame: Frame, strength: EdgeStrength, params: ScanLineParams, selection: Selection, x: int, y: int
    ) -> None:
        self.frame, self.strength, self.params, self.selection = frame, strength, params, selection.of(params)
        self.x, self.y = x, y
        self.selected = selected(frame, strength, self.selection)
        self.thin = thin_lines(frame, self.selected)
        self.edge = bool(self.thin[y, x])
        jump, crease, kind, significance = (m[y, x].item() for m in strength)
        self.jump, self.crease, self.kind, self.significance = jump, crease, kind, significance

    def lines(self, reach: int) -> tuple[ScanLine, ...]:
        """The scan lines through the pixel, so many pixels each way."""
        there = self.frame.valid[self.y, self.x]
        return scan_lines(self.frame, self.params, self.x, self.y, reach) if there else ()

    def verdict(self, scanned: tuple[ScanLine, ...]) -> Verdict:
        """Of the pixel and its scan lines."""
        at, jump, crease, own = (self.y, self.x), self.jump, self.crease, self.selection
        if not self.frame.valid[at]:
            return Verdict("no data", "The pixel has no data, or is masked out.")
        if self.edge:
            return self._of_edge()
        if self.selected[at]:
            return Verdict("thinned", "It is selected, but edges are one pixel wide: the line passes beside it.")
        jump_least, crease_least = (own.jumpThreshold or 0) * own.hysteresis, own.creaseThreshold * own.hysteresis
        nearer = bool(self.kind & EDGE_OCCLUDING)
        jumps = nearer and 0 < jump >= jump_least
        if jumps or 0 < crease >= crease_least:
            lines = selected(self.frame, self.strength, replace(own, **_EVERY_LINE))
            return self._of_line(lines) if lines[at] else self._of_weak(jumps, crease_least)
        if self.kind & EDGE_JUMP and not nearer:
            return Verdict("far side", "It is on the farther side of a jump, whose line lies on the nearer side.")
        if nearer:
            text = f"Its jump of {jump:.4g} is below jumpThreshold, {own.jumpThreshold:g}."
            return Verdict("threshold", text, jump, jump_least, (_lower("jumpThreshold", jump / own.hysteresis),))
        if crease > 0:
            text = f"Its crease of {crease:.3g} degrees is below creaseThreshold, {own.creaseThreshold:g}."
            lower = _lower("creaseThreshold", crease / own.hysteresis)
            return Verdict("threshold", text, crease, crease_least, (lower,))
        return self._of_cut(scanned)

    def _of_edge(self) -> Verdict:
        own, jump, crease = self.selection, self.jump, self.crease
        lines = selected(self.frame, self.strength, replace(own, boundaryEdges=False))
        if not lines[self.y, self.x]:
            text = "It lies beside pixels without data, and boundaryEdges is set."
            return Verdict("edge", text, changes=({"boundaryEdges": False},))
        jump_least = own.jumpThreshold or 0.0
        if self.kind & EDGE_OCCLUDING and 0 < jump >= own.hysteresis * jump_least:
            text = f"It is on the nearer side of a jump of {jump:.4g}."
            higher = _raise("jumpThreshold", jump / own.hysteresis)
            return Verdict("edge", text, jump, jump_least, (higher, *self._against(lines)))
        text = f"Its surfaces meet at {crease:.3g} degrees, at least creaseThreshold."
        higher = _raise("creaseThreshold", crease / own.hysteresis)
        return Verdict("edge", text, crease, own.creaseThreshold, (higher, *self._against(lines)))

    def _against(self, lines: np.ndarray) -> Iterator[Change]:
        """Changes that drop the line of the pixel, or the pixel before it gets there."""
        yield _raise("lineSignificance", self._line_significance(self._widened_line(lines)))
        yield {"minLength": self._length(self._with_pixel(lines)) + 1}
        yield _raise("minSignificance", self.significance)

    def _of_line(self, lines: np.ndarray) -> Verdict:
        """Of a pixel on a line that does not stay."""
        own = self.selection
        length = self._length(self._with_pixel(lines))
        if length < own.minLength:
            text = f"Its line is {length} pixels long; minLength is {own.minLength}."
            return Verdict("line", text, length, own.minLength, ({"minLength": length},))
        whole = self._line_significance(self._widened_line(lines))
        if whole < own.lineSignificance:
            text = f"The significance of its line is {whole:.3g}; lineSignificance is {own.lineSignificance:g}."
            return Verdict("line", text, whole, own.lineSignificance, (_lower("lineSignificance", whole),))
        return Verdict("line", "Its line does not stand out of the others.", changes=({"dynamic": False},))

    def _of_weak(self, jumps: bool, least: float) -> Verdict:
        """Of a pixel that reaches the thresholds, or hysteresis times these, and still is on no line."""
        own = self.selection
        beside = self.strength.crease[max(self.y - 1, 0) : self.y + 2, max(self.x - 1, 0) : self.x + 2]
        strong = np.sort(beside[beside > 0])[::-1]
        count, needed = int(np.count_nonzero(strong >= np.float32(least))), _core.company
        if count < needed and not jumps:
            text = f"A stray crease: of the nine pixels around it {count} reach creaseThreshold, {needed} are needed."
            enough = [_lower("creaseThreshold", c / own.hysteresis) for c in strong[needed - 1 : needed].tolist()]
            return Verdict("stray", text, count, needed, tuple(enough))
        text = "No pixel of its line reaches the thresholds, only hysteresis times these."
        lower = _lower("jumpThreshold", self.jump) if jumps else _lower("creaseThreshold", self.crease)
        return Verdict("line", text, own.hysteresis, 1, (lower,))

    def _line_significance(self, line: np.ndarray) -> float:
        """As lineSignificance has it."""
        squares = np.square(self.strength.significance[line], dtype=np.float64)
        return float(np.sqrt(squares.mean() * self._length(line) / _core.usual_length))

    def _widened_line(self, lines: np.ndarray) -> np.ndarray:
        """The pixels of the line that holds the pixel, over gaps of two pixels."""
        return self._with_pixel(around(self.frame, _widened, lines)) & (lines > 0)

    def _with_pixel(self, lines: np.ndarray) -> np.ndarray:
        """The pixels of the line that holds the pixel."""
        labels = around(self.frame, lambda lines, wrap: components(lines > 0, wrap)[1], lines)
        return labels == labels[self.y, self.x]

    def _length(self, line: np.ndarray) -> int:
        """The longer side of its bounding box, and all around the number of its places."""
        places = enumerate(np.nonzero(line))
        return max(len(np.unique(at)) if axis == self.frame.seam else 1 + int(np.ptp(at)) for axis, at in places)

    def _of_cut(self, lines: tuple[ScanLine, ...]) -> Verdict:
        """Of a pixel of which no candidate is left: the cut beside it that came farthest."""
        place = (self.x, self.y)
        beside = [(line, cut) for line in lines for cut in line.cuts if place in (cut.before, cut.after) and cut.test]
        if not beside:
            return Verdict("no cut", "No scan line is cut there: as far as the noise tells, the surface goes on.")
        line, cut = max(beside, key=lambda pair: (_TESTS.index(pair[1].test), pair[1].significance, pair[1].crease))
        stage = "significance" if cut.test == "significance" else "candidate"
        return Verdict(stage, f"On its {line.name}, {cut.fate}.", cut.value, cut.limit, tuple(_for_cut(cut)))


def _for_cut(cut: Cut) -> Iterator[Change]:
    """Changes of options that may let a cut pass."""
    if cut.test == "gap":
        yield {"maxGap": int(cut.value)}
    elif cut.test == "smeared":
        yield {"maxSmear": 0}
    elif cut.test in ("significance", "single"):
        yield _lower("minSignificance", cut.value)


def _widened(lines: np.ndarray, wrap: bool) -> np.ndarray:
    """Each pixel with the eight around it."""
    framed = np.pad(lines, ((0, 0), (1, 1)), mode="wrap" if wrap else "constant")
    return cv2.dilate(framed, np.ones((3, 3), np.uint8))[:, 1:-1]


def _lower(name: str, value: float) -> Change:
    return {name: value * _LOWERED}


def _raise(name: str, value: float) -> Change:
    return {name: value * _RAISED}
