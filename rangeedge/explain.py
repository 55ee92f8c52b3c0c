"""Why a pixel is an edge, or why not: the scan lines through it, and the test that decided."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from ._check import fail, integer
from ._option import parsed, takes
from .constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, EDGE_OCCLUDING
from .edges import kind_in_words, measure_strength
from .frame import Frame
from .least_change import least_change
from .noise import measured_frame
from .noise_model import NoiseModel
from .options import DETECTION, ScanLineParams, Selection
from .plausible import warn_of_selection
from .traces import ScanLine
from .verdict import Case

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import DetectionOptions

_NAN = float("nan")
_CORRELATED = 1.5  # a correlation from which it is worth a word


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
    change: Mapping[str, Any]  # the least that turns the answer, tried on this image; {} where none was found
    nearest: tuple[Neighbour, ...]  # of a pixel that is none: the nearest edge, and a candidate that is nearer
    depth: float
    noise: float  # standard deviation of the depth there, as neighbours differ
    jump: float
    crease: float
    kind: int
    significance: float
    lines: tuple[ScanLine, ...]
    correlation: float = 1.0  # times as large is the noise of many pixels, on which tolerances depend
    others: int = 0  # edge pixels that come or go with the change, beside this one
    obstacle: str = ""  # where no change was found: what stands in the way after the test that decided
    unit: str = ""  # of lengths; "" where only the user knows

    @property
    def correlated(self) -> bool:
        """Whether the noise of neighbours is alike, so that it is worth a word."""
        return self.correlation >= _CORRELATED

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
        that turn the answer for this pixel, and `others`, how many other edge pixels come or go with them; `nearest`,
        where within `reach` the nearest edge is, and the nearest candidate if that is nearer, each with place,
        distance, strengths and kind; and `lines`: for every direction samples, segments with their curves, tolerances
        and cuts, these with strengths, significances and the test that each failed. Depths and jumps are in `unit`,
        that of the image, angles in degrees, significances in standard deviations, ordinates inverse depths (with a
        camera) or heights.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    drawExplanation : The scan lines as a picture, after Figure 3 of the paper.

    Notes
    -----
    Paper, 4.1 and 4.2, Figures 3 and 4. `change` is tried by the detector before it is named: with it the answer is the
    other one, with half of it not. It holds more than one option where several tests stand in the way; where several
    options would each do, it is that with which the fewest other edge pixels change.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import explainPixel
    >>> roof = 0.2 * np.abs(np.arange(64) - 30.3) * np.ones((48, 1))
    >>> why = explainPixel(roof, 30, 20, noise=0.001)
    >>> why.edge, why.stage, round(why.crease)
    (False, 'threshold', 23)
    >>> why.change
    {'creaseThreshold': 22.0}
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
    warn_of_selection(frame, selection)
    case = Case(frame, measure_strength(frame, params), params, selection, x, y)
    lines = case.lines(reach)
    verdict = case.verdict(lines)
    found = least_change(case, selection, verdict)
    depth = float(frame.depth[y, x])
    return Explanation(
        x=x, y=y, edge=case.edge, stage=verdict.stage, reason=verdict.reason, value=verdict.value,
        limit=verdict.limit, change=found.change, nearest=() if case.edge else tuple(_nearest(case, reach)),
        depth=-depth if frame.heightMap else depth, noise=_noise_at(frame, x, y, depth), jump=case.jump,
        crease=case.crease, kind=case.kind, significance=case.significance, lines=lines,
        correlation=frame.correlation, others=found.others, obstacle=found.obstacle, unit=frame.unit,
    )  # fmt: skip


def _nearest(case: Case, reach: int) -> Iterator[Neighbour]:
    """The nearest edge, and the nearest candidate where that is nearer.

    None of these is the farther side of a jump, nor what touches an edge, whose line that is part of.
    """
    top, left = max(case.y - reach, 0), max(case.x - reach, 0)
    part = np.s_[top : case.y + reach + 1, left : case.x + reach + 1]
    jump, crease, kind, _ = (values[part] for values in case.strength)
    rows, cols = np.ogrid[: kind.shape[0], : kind.shape[1]]
    distance = np.hypot(rows + top - case.y, cols + left - case.x)
    distance[(distance == 0) | (distance > reach)] = np.inf
    edge, bits = case.thin[part] > 0, np.uint8(EDGE_OCCLUDING | EDGE_CONVEX | EDGE_CONCAVE)
    farthest = np.inf
    lines = cv2.dilate(case.thin, np.ones((3, 3), np.uint8))[part] > 0
    for marked in (edge, (kind & bits > 0) & ~lines):
        place = np.unravel_index(np.argmin(np.where(marked, distance, np.inf)), kind.shape)
        if marked[place] and distance[place] < farthest:
            farthest = float(distance[place])
            strengths = (values[place].item() for values in (jump, crease, kind))
            yield Neighbour(int(place[1]) + left, int(place[0]) + top, farthest, bool(edge[place]), *strengths)


def _noise_at(frame: Frame, x: int, y: int, depth: float) -> float:
    if isinstance(frame.noise, NoiseModel):
        return float(frame.noise(abs(depth))) if np.isfinite(depth) else _NAN
    return float(frame.noise[y, x]) if frame.noise is not None else _NAN


def _said(why: Explanation) -> Iterator[str]:
    unit = f" {why.unit}" if why.unit else ""
    waves = f" (correlated: {why.correlation:.2g} times that over many pixels)" if why.correlated else ""
    yield f"Pixel ({why.x}, {why.y}), {'an edge' if why.edge else 'no edge'}. {why.reason}"
    if np.isfinite(why.depth):
        yield (
            f"  depth {why.depth:.5g}{unit}, noise {why.noise:.2g}{unit}{waves};"
            f" jump {why.jump:.4g}{unit}, crease {why.crease:.3g} degrees, significance {why.significance:.3g};"
            f" {kind_in_words(why.kind)}"
        )
    if why.change:
        options = ", ".join(f"{name}={value!r}" for name, value in why.change.items())
        others = f" {why.others} other edge pixels come or go with that." if why.others else ""
        yield f"  With {options} it is {'none' if why.edge else 'one'}.{others}"
    elif why.obstacle:
        yield f"  No change of options was found that makes it {'none' if why.edge else 'one'}. {why.obstacle}"
    for found in why.nearest:
        yield f"  {_beside(found, unit)}"
    for line in why.lines:
        segment = line.segments[(line.segments["first"] <= line.at) & (line.segments["last"] >= line.at)]
        size = f"in a segment of {int(segment['last'][0] - segment['first'][0]) + 1} pixels" if len(segment) else ""
        curve = f", {'curved' if segment['a'][0] else 'straight'}" if len(segment) else ""
        yield f"{line.name}: {size}{curve}, tolerance {line.samples['toleranceDepth'][line.at]:.2g}{unit}"
        for cut in sorted(line.cuts, key=lambda c: abs(c.sample - line.at))[:3]:
            kind = kind_in_words(cut.bits)
            yield f"  cut {cut.sample - line.at:+.1f} px, at ({cut.x:.1f}, {cut.y:.1f}), {kind}: {cut.fate}"


def _beside(found: Neighbour, unit: str) -> str:
    size = f"a jump of {found.jump:.4g}{unit}" if found.kind & EDGE_JUMP else f"a crease of {found.crease:.3g} degrees"
    what = "edge" if found.edge else "candidate, itself no edge,"
    away = f"{found.distance:.3g} {'pixel' if found.distance == 1 else 'pixels'} away"
    return f"The nearest {what} is ({found.x}, {found.y}), {away}: {size} ({kind_in_words(found.kind)})."
