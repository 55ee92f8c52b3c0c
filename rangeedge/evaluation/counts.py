"""Counts that add up over frames."""

from __future__ import annotations

from dataclasses import fields, replace


def ratio(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")


class Counts:
    """Counts that add up over frames: by ``a + b`` and by ``sum(scores)``."""

    def __add__(self, other):
        if type(other) is not type(self):
            return NotImplemented
        names = [field.name for field in fields(self)]
        return replace(self, **{name: getattr(self, name) + getattr(other, name) for name in names})

    def __radd__(self, other):
        return self if other == 0 else NotImplemented
