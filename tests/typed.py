"""Writes `rangeedge/_typed.py`, by which editors and type checkers know the options, from `rangeedge/options.py`.

python tests/typed.py            # after an option was added or changed
"""

import textwrap
from pathlib import Path

from rangeedge import options
from rangeedge._option import Option
from rangeedge.options import DETECTION, SELECTION

TARGET = Path(__file__).resolve().parents[1] / "rangeedge" / "_typed.py"
KEYWORDS = {
    "Geometry": options.GEOMETRY,
    "ScanLine": {name: own for name, own in options.SCAN_LINES.items() if name != "eps"},
    "Refinement": {name: own for name, own in options.SELECTION.items() if not name.endswith("Threshold")},
    "Seeding": options.SEEDING,
    "Growing": options.GROWING,
    "Segmenting": options.SEGMENTING,
    "Closing": options.CLOSING,
    "Cleaning": options.CLEANING,
    "Joining": options.Linking.options,
}
HEAD = '''"""The options as editors and type checkers know them, by ``python tests/typed.py`` from `options.py`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .noise_model import NoiseModel
    from .options import ScanLineParams, Selection


'''


def text() -> str:
    """What the file should hold."""
    keywords = "\n\n".join(typed_dict(name, group) for name, group in KEYWORDS.items())
    return f"{HEAD}{keywords}\n\n{DETECTION_CLASS}\n\n{LINKING_CLASS}\n\n{accessors()}"


def typed_dict(name: str, group: dict[str, Option]) -> str:
    lines = [f"    {own.name}: {own.annotation}\n" for own in group.values()]
    return f"class {name}Options(TypedDict, total=False):\n{''.join(lines)}"


DETECTION_CLASS = "class DetectionOptions(ScanLineOptions, RefinementOptions, total=False):\n    pass\n"
LINKING_CLASS = "class LinkingOptions(DetectionOptions, JoiningOptions, total=False):\n    pass\n"


def accessors() -> str:
    """A `getX` and a `setX` for every parameter of the detector."""
    methods = []
    for name, own in DETECTION.items():
        upper, home = name[0].upper() + name[1:], "_selection" if name in SELECTION else "_params"
        doc = textwrap.indent(textwrap.fill(own.text, 112, break_on_hyphens=False), "        ")
        methods.append(
            f"    def get{upper}(self) -> {own.kept or own.annotation}:\n"
            f'        """get{upper}() -> retval\n\n{doc}\n        """\n'
            f"        return self.{home}.{name}  # type: ignore[return-value]\n"
            if own.kept
            else f"    def get{upper}(self) -> {own.annotation}:\n"
            f'        """get{upper}() -> retval\n\n{doc}\n        """\n'
            f"        return self.{home}.{name}\n"
        )
        methods.append(
            f"    def set{upper}(self, {name}: {own.annotation}, /) -> None:\n"
            f'        """set{upper}({name}) -> None\n\n{doc}\n        """\n'
            f'        self._set("{name}", {name})\n'
        )
    head = (
        "class Accessors:\n"
        '    """`setX` and `getX` of every option of `detectEdges`."""\n\n'
        "    __slots__ = ()\n"
        "    _params: ScanLineParams\n"
        "    _selection: Selection\n\n"
        "    def _set(self, name: str, value: Any) -> None:\n"
        "        raise NotImplementedError\n\n"
    )
    return head + "\n".join(methods)


if __name__ == "__main__":
    TARGET.write_text(text(), "utf-8")
