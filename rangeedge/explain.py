"""Why a pixel is an edge, or why not: the scan lines through it, and the test that decided."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from . import _core
from ._check import fail, integer
from ._option import parsed, takes
from .constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, EDGE_OCCLUDING
from .detector import run_detector, selected, thin_lines
from .edges import kindNames, measure_strength
from .frame import Frame
from .noise import measured_frame
from .noise_model import NoiseModel
from .options import DETECTION, ScanLineParams, Selection
from .pixels import components
from .sectors import around
from .traces import Cut, ScanLine, scan_lines

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import DetectionOptions

_EVERYTHING: dict[str, Any] = {"minLength": 1, "lineSignificance": 0.0, "dynamic": False}
_RAISED, _LOWERED = 1.001, 0.999  # past a limit, beyond the rounding of the maps
_NAN = float("nan")
_CORRELATED = 1.5  # a correlation from which it is worth a word
_TESTS = ("gap", "single", "smooth", "smeared", "significance")  # in the order in which cuts get to them


class Neighbour(NamedTuple):
    """An edge or a candidate beside a pixel."""

    x: int
    y: int
    distance: float  # between the pixels
    edge: bool  # or only a candidate
    jump: float
    crease: float
    kind: int


class Explanation(NamedTuple):
    """What `explainPixel` returns; `print` shows it in words, `drawExplanation` as a picture."""

    x: int
    y: int
    edge: bool  # as the map of `detectEdges` has it
    stage: str  # where it was decided, one of `explainPixel`'s list
    reason: str
    value: float  # what the deciding test compares, and with what; NaN where there is no number
    limit: float
    change: Mapping[str, Any]  # options that turn the answer, tried on this image; {} where none was found
    nearest: tuple[Neighbour, ...]  # of a pixel that is none: the nearest edge, and a candidate that is nearer
    depth: float
    noise: float  # standard deviation of the depth there, as neighbours differ
    jump: float
    crease: float
    kind: int
    significance: float
    lines: tuple[ScanLine, ...]
    correlation: float = 1.0  # times as large is the noise of many pixels, on which tolerances depend

    def __repr__(self) -> str:
        return f"Explanation(x={self.x}, y={self.y}, edge={self.edge}, stage={self.stage!r}, change={self.change})"

    def __str__(self) -> str:
        return "\n".join(_said(self))

    def _repr_png_(self) -> bytes:
        from .draw import drawExplanation
        from .draw.shown import as_png

        return as_png(drawExplanation(self))


@takes(DETECTION)
def explainPixel(
    src: np.ndarray,
    x: int,
    y: int,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    eps: float | None = None,
    *,
    reach: int = 24,
    mask: np.ndarray | None = None,
    **options: Unpack[DetectionOptions],
) -> Explanation:
    """Say why a pixel is an edge, or why it is none, and which option would change that.

    explainPixel(src, x, y[, jumpThreshold[, creaseThreshold[, eps]]], *[, reach[, mask[, K[, ...]]]]) -> retval

    Runs `detectEdges` and follows the pixel through it. `retval.stage` is where it was decided:

        no data        the pixel has none
        no cut         no scan line is cut there: its surface goes on
        candidate      a scan line is cut there, but the cut fails a test by itself
        significance   the candidate and its neighbours together do not stand out of the noise
        far side       the pixel is on the farther side of a jump, whose line lies on the nearer one
        threshold      it is an edge, weaker than the thresholds
        stray          a crease without enough of them around it
        line           the line of which it is part is too short, or not significant, or does not stand out, or is too
                       weak for the high thresholds (`hysteresis`)
        thinned        it is selected, but the line one pixel wide passes beside it
        edge           none of these

    Parameters
    ----------
    src
        As in `detectEdges`.
    x, y : int
        The pixel: column and row.
    reach : int
        How far around the pixel scan lines are shown, > 0, in pixels.
    mask
        As in `detectEdges`.
    {options}

    Returns
    -------
    retval : Explanation
        Among others `edge`, `stage`, `reason`, the `value` that was compared with `limit`, `change`, a dict of options
        that turn the answer for this pixel (tried before they are named), `nearest`, where within `reach`
        the nearest edge is, and the nearest candidate if that is nearer, each with place, distance, strengths and kind,
        and `lines`: for every direction samples, segments with their curves, tolerances and cuts, these with strengths,
        significances and the test that each failed. Depths and jumps are in the unit of the image, angles in degrees,
        significances in standard deviations, ordinates inverse depths (with a camera) or heights.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    drawExplanation : The scan lines as a picture, after Figure 3 of the paper.

    Notes
    -----
    Paper, 4.1 and 4.2, Figures 3 and 4.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import explainPixel
    >>> roof = 0.2 * np.abs(np.arange(64) - 30.3) * np.ones((48, 1))
    >>> why = explainPixel(roof, 30, 20, noise=0.001)
    >>> why.edge, why.stage, round(why.crease)
    (False, 'threshold', 23)
    >>> why.change
    {'creaseThreshold': 22.5}
    """
    given = {"jumpThreshold": jumpThreshold, "creaseThreshold": creaseThreshold, "eps": eps, **options}
    params, selection = parsed(given, ScanLineParams, Selection)
    frame = measured_frame(src, params, mask)
    height, width = frame.shape
    x, y = integer("x", x, 0), integer("y", y, 0)
    if x >= width or y >= height:
        raise fail("x, y", f"a pixel of the image, {width} x {height}", f"({x}, {y})")
    return explain(frame, params, selection, x, y, integer("reach", reach, 1))


def explain(frame: Frame, params: ScanLineParams, selection: Selection, x: int, y: int, reach: int) -> Explanation:
    """The explanation of a pixel of a checked range image."""
    return _Case(frame, params, selection, x, y).explanation(reach)


class _Verdict(NamedTuple):
    """Where it was decided and why, what was compared with what, and changes of options to try."""

    stage: str
    reason: str
    value: float = _NAN
    limit: float = _NAN
    trials: tuple[dict[str, Any], ...] = ()


class _Case:
    """One pixel, on its way through the detector."""

    def __init__(self, frame: Frame, params: ScanLineParams, selection: Selection, x: int, y: int) -> None:
        self.frame, self.params, self.selection, self.x, self.y = frame, params, selection.of(params), x, y
        self.given = selection
        self.thin, self.strength = run_detector(frame, params, selection)
        self.edge = bool(self.thin[y, x])
        jump, crease, kind, significance = (m[y, x].item() for m in self.strength)
        self.jump, self.crease, self.kind, self.significance = jump, crease, kind, significance

    def explanation(self, reach: int) -> Explanation:
        frame, x, y = self.frame, self.x, self.y
        lines = scan_lines(frame, self.params, x, y, reach) if frame.valid[y, x] else ()
        verdict = self._verdict(lines)
        depth = float(frame.depth[y, x])
        return Explanation(
            x=x, y=y, edge=self.edge, stage=verdict.stage, reason=verdict.reason, value=verdict.value,
            limit=verdict.limit, change=self._change(verdict.trials),
            nearest=() if self.edge else tuple(self._nearest(reach)),
            depth=-depth if frame.heightMap else depth, noise=_noise_at(frame, x, y, depth), jump=self.jump,
            crease=self.crease, kind=self.kind, significance=self.significance, lines=lines,
            correlation=frame.correlation,
        )  # fmt: skip

    def _verdict(self, lines: tuple[ScanLine, ...]) -> _Verdict:
        at, jump, crease, own = (self.y, self.x), self.jump, self.crease, self.selection
        if not self.frame.valid[at]:
            return _Verdict("no data", "The pixel has no data, or is masked out.")
        if self.edge:
            return self._of_edge()
        if selected(self.frame, self.strength, own)[at]:
            return _Verdict("thinned", "It is selected, but edges are one pixel wide: the line passes beside it.")
        jump_least, crease_least = (own.jumpThreshold or 0) * own.hysteresis, own.creaseThreshold * own.hysteresis
        nearer = bool(self.kind & EDGE_OCCLUDING)
        if (nearer and 0 < jump >= jump_least) or 0 < crease >= crease_least:
            return self._of_line(crease_least)
        if self.kind & EDGE_JUMP and not nearer:
            return _Verdict("far side", "It is on the farther side of a jump, whose line lies on the nearer side.")
        if nearer:
            text = f"Its jump of {jump:.4g} is below jumpThreshold, {own.jumpThreshold:g}."
            return _Verdict("threshold", text, jump, jump_least, ({"jumpThreshold": _below(jump)},))
        if crease > 0:
            text = f"Its crease of {crease:.3g} degrees is below creaseThreshold, {own.creaseThreshold:g}."
            lower = {"creaseThreshold": _below(crease)}
            return _Verdict("threshold", text, crease, crease_least, (lower, {**lower, **_EVERYTHING}))
        return self._of_cut(lines)

    def _of_edge(self) -> _Verdict:
        own, jump, crease = self.selection, self.jump, self.crease
        if self.kind & EDGE_OCCLUDING and jump > 0:
            text, limit = f"It is on the nearer side of a jump of {jump:.4g}.", own.jumpThreshold or 0.0
            higher = {"jumpThreshold": _above(jump / own.hysteresis)}
        elif crease > 0:
            text, limit = f"Its surfaces meet at {crease:.3g} degrees, at least creaseThreshold.", own.creaseThreshold
            higher = {"creaseThreshold": _above(crease / own.hysteresis)}
        else:
            text, limit, higher = "It lies beside pixels without data, and boundaryEdges is set.", _NAN, {}
        border = {"boundaryEdges": False}
        return _Verdict("edge", text, jump or crease or _NAN, limit, (higher, border, {**higher, **border}))

    def _of_line(self, least: float) -> _Verdict:
        """Of a pixel that reaches the thresholds: stray, or on a line that does not stay."""
        at, own = (self.y, self.x), self.selection
        lines = selected(self.frame, self.strength, replace(own, **_EVERYTHING))
        if not lines[at]:
            beside = self.strength.crease[max(self.y - 1, 0) : self.y + 2, max(self.x - 1, 0) : self.x + 2]
            strong = np.sort(beside[beside > 0])[::-1]
            count = int(np.count_nonzero(strong >= np.float32(least)))
            if count >= _core.company or self.jump > 0:
                text = "No pixel of its line reaches the thresholds, only hysteresis times these."
                return _Verdict("line", text, own.hysteresis, 1, ({"creaseThreshold": _below(self.crease)},))
            needed = _core.company
            lower = {"creaseThreshold": _below(float(strong[needed - 1]))} if len(strong) >= needed else {}
            text = f"A stray crease: of the nine pixels around it {count} reach creaseThreshold, {needed} are needed."
            return _Verdict("stray", text, count, needed, (lower, {**lower, **_EVERYTHING}))
        length = self._length(self._with_pixel(lines))
        if length < own.minLength:
            text, shorter = f"Its line is {length} pixels long; minLength is {own.minLength}.", {"minLength": length}
            return _Verdict("line", text, length, own.minLength, (shorter, {**shorter, "lineSignificance": 0.0}))
        line = self._with_pixel(around(self.frame, _widened, lines)) & (lines > 0)
        squares = np.square(self.strength.significance[line], dtype=np.float64)
        whole = float(np.sqrt(squares.mean() * self._length(line) / _core.usual_length))
        if whole < own.lineSignificance:
            text = f"The significance of its line is {whole:.3g}; lineSignificance is {own.lineSignificance:g}."
            return _Verdict("line", text, whole, own.lineSignificance, ({"lineSignificance": _below(whole)},))
        return _Verdict("line", "Its line does not stand out of the others.", trials=({"dynamic": False},))

    def _with_pixel(self, lines: np.ndarray) -> np.ndarray:
        """The pixels of the line that holds the pixel asked for."""
        labels = around(self.frame, lambda lines, wrap: components(lines > 0, wrap)[1], lines)
        return labels == labels[self.y, self.x]

    def _length(self, line: np.ndarray) -> int:
        """The longer side of its bounding box, and all around the number of its places."""
        places = enumerate(np.nonzero(line))
        return max(len(np.unique(at)) if axis == self.frame.seam else 1 + int(np.ptp(at)) for axis, at in places)

    def _of_cut(self, lines: tuple[ScanLine, ...]) -> _Verdict:
        """Of a pixel of which no candidate is left: the cut beside it that came farthest."""
        place = (self.x, self.y)
        beside = [(line, cut) for line in lines for cut in line.cuts if place in (cut.before, cut.after) and cut.test]
        if not beside:
            return _Verdict("no cut", "No scan line is cut there: as far as the noise tells, the surface goes on.")
        line, cut = max(beside, key=lambda pair: (_TESTS.index(pair[1].test), pair[1].significance, pair[1].crease))
        stage = "significance" if cut.test == "significance" else "candidate"
        return _Verdict(stage, f"On its {line.name}, {cut.fate}.", cut.value, cut.limit, tuple(_for_cut(cut)))

    def _change(self, trials: tuple[dict[str, Any], ...]) -> dict[str, Any]:
        """The first that turns the answer."""
        own = {**vars(self.params), **vars(self.selection)}
        for trial in trials:
            change = {name: value for name, value in trial.items() if own[name] != value}
            params, selection = (_with(options, change) for options in (self.params, self.given))
            if not change:
                continue
            strength = self.strength if params == self.params else measure_strength(self.frame, params)
            thin = thin_lines(self.frame, selected(self.frame, strength, selection.of(params)))
            if bool(thin[self.y, self.x]) != self.edge:
                return change
        return {}

    def _nearest(self, reach: int) -> Iterator[Neighbour]:
        """The nearest edge, and the nearest candidate where that is nearer.

        None of these is the farther side of a jump, nor what touches an edge, whose line that is part of.
        """
        top, left = max(self.y - reach, 0), max(self.x - reach, 0)
        part = np.s_[top : self.y + reach + 1, left : self.x + reach + 1]
        jump, crease, kind, _ = (values[part] for values in self.strength)
        rows, cols = np.ogrid[: kind.shape[0], : kind.shape[1]]
        distance = np.hypot(rows + top - self.y, cols + left - self.x)
        distance[(distance == 0) | (distance > reach)] = np.inf
        edge, bits = self.thin[part] > 0, np.uint8(EDGE_OCCLUDING | EDGE_CONVEX | EDGE_CONCAVE)
        farthest = np.inf
        lines = cv2.dilate(self.thin, np.ones((3, 3), np.uint8))[part] > 0
        for marked in (edge, (kind & bits > 0) & ~lines):
            place = np.unravel_index(np.argmin(np.where(marked, distance, np.inf)), kind.shape)
            if marked[place] and distance[place] < farthest:
                farthest = float(distance[place])
                strengths = (values[place].item() for values in (jump, crease, kind))
                yield Neighbour(int(place[1]) + left, int(place[0]) + top, farthest, bool(edge[place]), *strengths)


def _for_cut(cut: Cut) -> Iterator[dict[str, Any]]:
    """Changes of options that may let a cut pass."""
    if cut.test == "gap":
        yield {"maxGap": int(cut.value)}
    elif cut.test == "smeared":
        yield {"maxSmear": 0}
    elif cut.test in ("significance", "single"):
        lower = {"creaseThreshold": _below(cut.crease / 2)} if cut.crease > 0 else {}
        for least in sorted({_below(cut.value), 0.0}, reverse=True):
            yield {"minSignificance": least}
            yield {"minSignificance": least, "lineSignificance": 0.0}
            yield {"minSignificance": least, **lower, **_EVERYTHING}


def _widened(lines: np.ndarray, wrap: bool) -> np.ndarray:
    """Each pixel with the eight around it."""
    framed = np.pad(lines, ((0, 0), (1, 1)), mode="wrap" if wrap else "constant")
    return cv2.dilate(framed, np.ones((3, 3), np.uint8))[:, 1:-1]


def _with(options: Any, change: Mapping[str, Any]) -> Any:
    """Options with those of a change that are theirs."""
    return replace(options, **{name: value for name, value in change.items() if name in options.options})


def _noise_at(frame: Frame, x: int, y: int, depth: float) -> float:
    if isinstance(frame.noise, NoiseModel):
        return float(frame.noise(abs(depth))) if np.isfinite(depth) else _NAN
    return float(frame.noise[y, x]) if frame.noise is not None else _NAN


def _below(value: float) -> float:
    """A number of three digits not above a strength."""
    return _rounded(value * _LOWERED, np.floor)


def _above(value: float) -> float:
    return _rounded(value * _RAISED, np.ceil)


def _rounded(value: float, towards: Any) -> float:
    if not value > 0:
        return 0.0
    unit = 10.0 ** (int(np.floor(np.log10(value))) - 2)
    return float(f"{towards(value / unit) * unit:.6g}")


def _said(why: Explanation) -> Iterator[str]:
    yield f"Pixel ({why.x}, {why.y}), {'an edge' if why.edge else 'no edge'}. {why.reason}"
    if np.isfinite(why.depth):
        waves = f" ({why.correlation:.2g} times that over many pixels)" if why.correlation >= _CORRELATED else ""
        yield (
            f"  depth {why.depth:.5g}, noise {why.noise:.2g}{waves};"
            f" jump {why.jump:.4g}, crease {why.crease:.3g} degrees, significance {why.significance:.3g},"
            f" {kindNames(why.kind)}"
        )
    if why.change:
        options = ", ".join(f"{name}={value!r}" for name, value in why.change.items())
        yield f"  With {options} it is {'none' if why.edge else 'one'}."
    for found in why.nearest:
        yield f"  {_beside(found)}"
    for line in why.lines:
        segment = line.segments[(line.segments["first"] <= line.at) & (line.segments["last"] >= line.at)]
        size = f"in a segment of {int(segment['last'][0] - segment['first'][0]) + 1} pixels" if len(segment) else ""
        curve = f", {'curved' if segment['a'][0] else 'straight'}" if len(segment) else ""
        yield f"{line.name}: {size}{curve}, tolerance {line.samples['toleranceDepth'][line.at]:.2g}"
        for cut in sorted(line.cuts, key=lambda c: abs(c.sample - line.at))[:3]:
            yield f"  cut {cut.sample - line.at:+.1f} px, at ({cut.x:.1f}, {cut.y:.1f}), {cut.kind}: {cut.fate}"


def _beside(found: Neighbour) -> str:
    size = f"a jump of {found.jump:.4g}" if found.kind & EDGE_JUMP else f"a crease of {found.crease:.3g} degrees"
    what = "edge" if found.edge else "candidate, itself no edge,"
    away = f"{found.distance:.3g} {'pixel' if found.distance == 1 else 'pixels'} away"
    return f"The nearest {what} is ({found.x}, {found.y}), {away}: {size}, {kindNames(found.kind)}."
