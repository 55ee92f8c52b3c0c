"""The scan lines through a pixel as the detector sees them, and what became of each of their cuts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from . import _core
from .constants import DIR_COLS, DIR_DIAG45, DIR_DIAG135, DIR_ROWS, EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from .edges import kernel_options, kindNames
from .frame import Frame
from .options import ScanLineParams
from .sectors import sectors_of

_NAMES = {DIR_ROWS: "row", DIR_COLS: "column", DIR_DIAG45: "diagonal 45", DIR_DIAG135: "diagonal 135"}
_SAMPLE = ("x", "y", "abscissa", "ordinate", "depth", "fitted", "fittedDepth", "tolerance", "toleranceDepth")
_SEGMENT = ("first", "last", "mean", "a", "b", "c")
_CUT = (
    *("cut", "sample", "before", "after", "jump", "crease", "difference", "tolerance"),
    *("jumpSignificance", "jumpShared", "creaseSignificance", "creaseShared"),
    *("jumps", "smooth", "bends", "convex", "smeared", "outline", "passed"),
)  # as core/edges/trace.hpp has them
Candidates = dict[str, np.ndarray]


class Cut(NamedTuple):
    """A cut of a scan line between two segments, and what became of it."""

    sample: float  # position along the line, in samples of it
    x: float  # position in the image, where neighbours have not moved it
    y: float
    before: tuple[int, int]  # pixels (x, y) on either side, at last
    after: tuple[int, int]
    jump: float  # length, before any test
    crease: float  # degrees, along this line
    jumpSignificance: float  # standard deviations, of this line alone
    creaseSignificance: float
    significance: float  # joined with its neighbours; 0 where it did not come so far
    bits: int  # EDGE_*
    test: str  # that it failed: "" where it passed all
    value: float  # what the test compares, and with what
    limit: float
    option: str  # on which the limit depends; "" where there is none
    fate: str  # all of this in words

    @property
    def kind(self) -> str:
        """The bits in words."""
        return kindNames(self.bits)


class ScanLine(NamedTuple):
    """The scan line of one direction around a pixel."""

    direction: int  # DIR_*
    at: int  # index of the pixel in `samples`
    samples: np.ndarray  # x, y, abscissa, ordinate, depth, fitted, fittedDepth, tolerance, toleranceDepth
    segments: np.ndarray  # first, last (samples), mean, a, b, c: ordinate = a t^2 + b t + c, t = abscissa - mean
    cuts: tuple[Cut, ...]

    @property
    def name(self) -> str:
        """Row, column or diagonal."""
        return _NAMES[self.direction]


def scan_lines(frame: Frame, params: ScanLineParams, x: int, y: int, reach: int) -> tuple[ScanLine, ...]:
    """The lines through a pixel with data, `reach` pixels each way."""
    part, place = _part_with(frame, x, y)
    found = _core.kept_and_weak(part.kernel, kernel_options(part, params), part.threads)
    directions = [direction for direction in _NAMES if direction & params.directions]
    return tuple(_Line(part, params, direction, place, found).around(x, y, reach) for direction in directions)


def _part_with(frame: Frame, x: int, y: int) -> tuple[Frame, tuple[int, int]]:
    """The sector of an image that has a pixel, and where in it; the image itself where there are none."""
    for part in sectors_of(frame):
        along = (x if part.axis else y) - part.start
        if 0 <= along < part.end - part.first:
            return part.frame, (along + part.first, y) if part.axis else (x, along + part.first)
    return frame, (x, y)


class _Fate(NamedTuple):
    """What became of a cut: the fields of `Cut` of these names."""

    test: str
    value: float
    limit: float
    option: str
    fate: str


class _Line:
    """A whole scan line of a frame."""

    def __init__(
        self,
        frame: Frame,
        params: ScanLineParams,
        direction: int,
        place: tuple[int, int],
        found: tuple[Candidates, Candidates],
    ) -> None:
        self.frame, self.params, self.direction, self.place = frame, params, direction, place
        traced = _core.trace_line(frame.kernel, kernel_options(frame, params), direction, *place)
        self.samples, self.segments = _table(_SAMPLE, traced[0]), _table(_SEGMENT, traced[1])
        self.cuts = [dict(zip(_CUT, row, strict=True)) for row in traced[2].tolist()]
        if frame.heightMap:
            for name in ("depth", "fittedDepth"):
                self.samples[name] *= -1
        self.at = int(np.flatnonzero((self.samples["x"] == place[0]) & (self.samples["y"] == place[1]))[0])
        self.step = self._place(1) - self._place(0) if len(self.samples) > 1 else np.array([1.0, 0.0])
        self.kept, self.weak = map(self._own, found)

    def around(self, x: int, y: int, reach: int) -> ScanLine:
        """What is near the pixel, which is (x, y) in the whole image."""
        first, end = max(0, self.at - reach), min(len(self.samples), self.at + reach + 1)
        move = (x - self.place[0], y - self.place[1])
        cuts = [cut for cut in self.cuts if first <= cut["before"] and cut["after"] < end]
        cuts += self._uncompared(first, end)
        samples = self.samples[first:end].copy()
        segments = self.segments[(self.segments["last"] >= first) & (self.segments["first"] < end)].copy()
        for name, offset in (("x", move[0]), ("y", move[1])):
            samples[name] += offset
        for name in ("first", "last"):
            segments[name] -= first
        found = tuple(self._cut(cut, first, move) for cut in sorted(cuts, key=lambda cut: cut["cut"]))
        return ScanLine(self.direction, self.at - first, samples, segments, found)

    def _place(self, sample: int) -> np.ndarray:
        return np.array([self.samples["x"][sample], self.samples["y"][sample]])

    def _own(self, found: Candidates) -> list[dict[str, Any]]:
        """The candidates of this line, each with the place of its cut."""
        (x0, y0), (dx, dy) = self._place(0), self.step
        off = (found["x"] - x0) * dy - (found["y"] - y0) * dx
        own = np.flatnonzero((found["direction"] == self.direction) & (np.abs(off) < 1e-2))
        along = (found["x"][own] - x0) / dx if dx else (found["y"][own] - y0) / dy
        cuts = along - found["shift"][own]
        rows = [{name: values[i].item() for name, values in found.items()} for i in own]
        return [{**row, "cut": cut} for row, cut in zip(rows, cuts.tolist(), strict=True)]

    def _uncompared(self, first: int, end: int) -> Iterator[dict[str, float]]:
        """Gaps between segments that the detector did not look at."""
        for left, right in pairwise(self.segments):
            before, after = float(left["last"]), float(right["first"])
            if after == before + 1 or before < first or after >= end:
                continue
            if not any(before <= cut["before"] <= after or before <= cut["sample"] <= after for cut in self.cuts):
                middle = (before + after) / 2
                yield {**dict.fromkeys(_CUT, 0.0), "cut": middle, "sample": middle, "before": before, "after": after}

    def _cut(self, c: dict[str, float], first: int, move: tuple[int, int]) -> Cut:
        kept, weak = (self._candidate(found, c["cut"]) for found in (self.kept, self.weak))
        candidate = kept or weak
        x, y = self._place(0) + c["sample"] * self.step + move
        if candidate:
            bits = candidate["kind"]
            sides = [divmod(candidate[side], self.frame.shape[1])[::-1] for side in ("before", "after")]
        else:
            bits = EDGE_JUMP if c["jumps"] else 0 if not c["crease"] else EDGE_CONVEX if c["convex"] else EDGE_CONCAVE
            sides = [self._place(int(c[side])).astype(int).tolist() for side in ("before", "after")]
        before, after = ((u + move[0], v + move[1]) for u, v in sides)
        return Cut(
            c["sample"] - first, float(x), float(y), before, after, c["jump"], c["crease"], c["jumpSignificance"],
            c["creaseSignificance"], candidate["significance"] if candidate else 0.0, bits, *self._fate(c, kept, weak),
        )  # fmt: skip

    @staticmethod
    def _candidate(found: list[dict[str, Any]], cut: float) -> dict[str, Any] | None:
        return next((candidate for candidate in found if abs(candidate["cut"] - cut) < 0.02), None)

    def _fate(self, c: dict[str, float], kept: dict[str, Any] | None, weak: dict[str, Any] | None) -> _Fate:
        least, most = self.params.minSignificance, self.params.maxGap
        what = f"a jump of {c['jump']:.4g}" if c["jumps"] else f"a crease of {c['crease']:.3g} degrees"
        if kept:
            value = kept["significance"]
            return _Fate("", value, least, "minSignificance", f"{what} stands {value:.3g} deviations out of the noise")
        if weak:
            value = weak["significance"]
            text = f"{what}, with its neighbours, stands {value:.3g} deviations out of the noise; minSignificance is"
            return _Fate("significance", value, least, "minSignificance", f"{text} {least:g}")
        if c["passed"]:
            return _Fate("smeared", 0.0, 0.0, "maxSmear", f"{what} lies beside a step that is smeared over some pixels")
        gap = c["after"] - c["before"] - 1
        if c["outline"]:
            text = f"beyond {gap:g} pixels without data the surface goes on, or steps back by less than the noise"
            return _Fate("gap", gap, most, "maxGap", text)
        if not (c["jump"] or c["crease"]) and gap > 0:
            why = f"maxGap is {most}" if gap > most else "one of them has a single pixel"
            return _Fate(
                "gap", gap, most, "maxGap", f"surfaces {gap:g} pixels without data apart are not compared: {why}"
            )
        if c["smooth"] or c["bends"]:
            return _Fate("smooth", 0.0, 0.0, "", f"{what} is what curves make of samples that run on smoothly")
        lone = min(_core.lone_significance, least)
        value = max(c["jumpSignificance"] if c["jump"] else 0.0, c["creaseSignificance"])
        text = f"{what} is {value:.3g} deviations of the noise by itself; {lone:g} are needed"
        return _Fate("single", value, lone, "minSignificance", text)


def _table(names: Sequence[str], rows: np.ndarray) -> np.ndarray:
    table = np.empty(len(rows), [(name, "f8") for name in names])
    for i, name in enumerate(names):
        table[name] = rows[:, i]
    return table
