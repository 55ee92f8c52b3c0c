"""The least change of options that turns the answer for a pixel, each step of the search tried by the detector."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from .detection import selected, thin_lines
from .edges import EdgeStrength, measure_strength
from .options import ScanLineParams, Selection
from .verdict import Case, Change, Verdict

_TESTS_IN_TURN = 6  # that a change may have to turn
_SHARP = 0.05  # share of a change to which its size is found
_HALVINGS = 12
_ROUND = 0.1  # share of a change that it may grow by to be a rounder number
_FINEST = 6  # digits
_LARGE = 1 << 21  # pixels of an image of which one change is tried, not every one
_ANGLES = 180.0  # degrees, beyond which no threshold makes sense


class Found(NamedTuple):
    """A change of options that turns the answer for a pixel; {} where none is known."""

    change: dict[str, Any]
    others: int = 0  # edge pixels that come and go with it, beside the pixel itself
    obstacle: str = ""  # where there is none: what stands in the way once the first test is passed


class Trials:
    """The detector on one image with changed options."""

    def __init__(self, case: Case, selection: Selection) -> None:
        self.case, self.given = case, selection
        self.base = {**vars(case.params), **vars(case.selection)}
        largest = 2 * float(case.strength.jump.max(initial=0)) / case.selection.hysteresis
        self.base["jumpThreshold"] = min(self.base["jumpThreshold"] or 0.0, largest)  # inf, or as good as that
        self.base["creaseThreshold"] = min(self.base["creaseThreshold"], _ANGLES / case.selection.hysteresis)
        self._latest: tuple[ScanLineParams, EdgeStrength] = case.params, case.strength

    def options(self, change: Change) -> tuple[ScanLineParams, Selection]:
        own = [{n: value for n, value in change.items() if n in kind.options} for kind in (ScanLineParams, Selection)]
        return replace(self.case.params, **own[0]), replace(self.given, **own[1])

    def strength(self, params: ScanLineParams) -> EdgeStrength:
        if params == self.case.params:
            return self.case.strength
        if params != self._latest[0]:
            self._latest = params, measure_strength(self.case.frame, params)
        return self._latest[1]

    def edges(self, change: Change) -> np.ndarray:
        params, selection = self.options(change)
        return thin_lines(self.case.frame, selected(self.case.frame, self.strength(params), selection.of(params)))

    def turns(self, change: Change) -> bool:
        """Whether the answer for the pixel is another one."""
        return bool(self.edges(change)[self.case.y, self.case.x]) != self.case.edge

    def changed(self, change: Change) -> Case:
        """The pixel under changed options."""
        params, selection = self.options(change)
        return Case(self.case.frame, self.strength(params), params, selection, self.case.x, self.case.y)

    def others(self, change: Change) -> int:
        """How many other edge pixels come or go."""
        return int(np.count_nonzero(self.edges(change) != self.case.thin)) - 1


def least_change(case: Case, selection: Selection, verdict: Verdict) -> Found:
    """Of the changes that turn the answer that which turns the fewest other pixels, and no larger than need be.

    Selection as it was given; `case` has it as it holds for these parameters.
    """
    trials = Trials(case, selection)
    tried = [_followed(trials, dict(first)) for first in verdict.changes[: 1 if case.thin.size > _LARGE else None]]
    turning = [change for change, _ in tried if change]
    if not turning:
        return Found({}, obstacle=next((obstacle for _, obstacle in tried), ""))
    change = _narrowed(trials, min(turning, key=lambda change: (len(change), trials.others(change))))
    return Found(change, trials.others(change))


def _followed(trials: Trials, change: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """The change, with what the tests after the one that it turns need; {} and why where one cannot be turned."""
    reason = ""
    for _ in range(_TESTS_IN_TURN):
        change = {name: value for name, value in change.items() if trials.base[name] != value}
        if not change:
            break
        case = trials.changed(change)
        if case.edge != trials.case.edge:
            return change, ""
        verdict = case.verdict(case.lines(1))
        given = ", ".join(
            f"{name}={value if isinstance(value, int) else f'{value:.4g}'}" for name, value in change.items()
        )
        reason = "" if verdict.stage == "no cut" else f"With {given}: {verdict.reason}"
        more = next(iter(verdict.changes), {})
        if all(change.get(name) == value for name, value in more.items()):
            break
        change |= more
    return {}, reason


def _narrowed(trials: Trials, change: dict[str, Any]) -> dict[str, Any]:
    """The change without what it does not need, each of its numbers as near to the present one as a round one is."""
    for _ in range(_TESTS_IN_TURN):
        for name in tuple(change):
            others = {other: value for other, value in change.items() if other != name}
            if others and trials.turns(others):
                change = others
            else:
                change[name] = _nearest(trials, change, name)
        half = {name: _between(trials.base[name], value, 0.5) for name, value in change.items()}
        half = {name: value for name, value in half.items() if value != trials.base[name]}
        if not half or not trials.turns(half):
            break
        change = half
    return change


def _nearest(trials: Trials, change: Change, name: str) -> Any:
    """The value of an option, the others of the change as they are, that is nearest to the present one and turns."""
    base, far = trials.base[name], change[name]
    if isinstance(far, bool):
        return far
    near, share = base, 1 - _SHARP
    for _ in range(_HALVINGS):
        middle = _between(near, far, share)
        if middle in (near, far):
            middle = far - int(math.copysign(1, far - base))
        if middle == near or abs(far - near) < 1.01 * _SHARP * abs(far - base):
            break
        near, far = (near, middle) if trials.turns({**change, name: middle}) else (middle, far)
        share = 0.5
    if isinstance(far, int):
        return far
    return next((v for v in _round_numbers(name, base, near, far) if trials.turns({**change, name: v})), far)


def _between(base: Any, value: Any, share: float) -> Any:
    """A share of the way from one to the other; of what cannot be divided none of it."""
    if isinstance(value, bool):
        return base
    way = share * (value - base)
    return base + int(way) if isinstance(value, int) else base + way


def _round_numbers(name: str, base: float, near: float, far: float) -> Iterator[float]:
    """Numbers from `near` on, away from `base`, and hardly beyond `far`: the roundest first."""
    most, outward = (1 + _ROUND) * abs(far - base), math.ceil if far > base else math.floor
    top = math.floor(math.log10(max(abs(far), abs(base))))
    for power, start in itertools.product(range(top, top - _FINEST, -1), (near, far)):
        unit = 10.0**power
        value = float(f"{outward(start / unit) * unit:.{_FINEST + 3}g}")
        known = value > 0 and (name != "creaseThreshold" or value <= _ANGLES)
        if known and abs(near - base) < abs(value - base) <= most:
            yield value
