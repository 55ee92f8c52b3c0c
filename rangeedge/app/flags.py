"""How the command line spells options: the flags of each, their help, and what reads their values."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Mapping
from typing import Any

import cv2
import numpy as np

from .._option import Option
from ..detector import createScanLineDetector
from ..options import DETECTION, GEOMETRY, SCAN_LINES, SELECTION, Growing
from .texts import GROUPS, PARAMS, SAVE_PARAMS


def add_geometry(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--params", type=reader(_saved), metavar="FILE", help=PARAMS)
    parser.add_argument("--save-params", dest="save_params", metavar="FILE", help=SAVE_PARAMS)
    group = parser.add_argument_group("geometry of the image")
    projection = group.add_mutually_exclusive_group()
    for name, option in GEOMETRY.items():
        add_option(projection if name in ("K", "pixelSize") else group, option)
    group.add_argument("--mask", type=_mask, metavar="FILE", help="8-bit image, not 0 where pixels are used")
    group.add_argument(
        "--calibration", type=int, choices=(1, 2), help="of an ABW scanner (default: by the file's name)"
    )


def add_detector(parser: argparse.ArgumentParser) -> None:
    add_options(parser, "which edges are kept", SELECTION)
    own = {name: option for name, option in SCAN_LINES.items() if name not in GEOMETRY}
    add_options(parser, "how edges are found", own)


def add_options(parser: argparse.ArgumentParser, title: str, options: Mapping[str, Option]) -> None:
    group = parser.add_argument_group(title, GROUPS.get(title))
    for option in options.values():
        add_option(group, option)


def add_option(group: Any, option: Option) -> None:
    own, text = flag_of(option.name), _help(option)
    if option.read is bool:
        action = argparse.BooleanOptionalAction if option.default else "store_true"
        group.add_argument(own, action=action, dest=option.name, help=text)
    elif option.choices:
        read = reader(lambda word: _chosen(option, word))
        group.add_argument(own, type=read, metavar="|".join(option.choices), dest=option.name, help=text)
    else:
        group.add_argument(own, type=reader(option.read), metavar=option.metavar, dest=option.name, help=text)


def flag_of(name: str) -> str:
    return "-K" if name == "K" else "--" + re.sub(r"([A-Z])", lambda m: "-" + m[1].lower(), name)


def _help(option: Option) -> str:
    """What the option means, in the words of the command line."""
    if option.flagged:
        return option.flagged
    text, default = re.sub(r" \(paper,[^)]*\)|the paper has ", "", option.text), option.default
    for name in (*DETECTION, *Growing.options):
        text = text.replace(f"`{name}`", flag_of(name))
    for word, value in option.choices.items():
        text = text.replace(next(name for name, other in option.constants.items() if other == value), word)
        default = word if value == option.default else default
    known = [option.unit] if option.unit else []
    if default is not None and default is not False:
        known.append(f"default: {f'{default:g}' if isinstance(default, float) else default}")
    return text.replace("``numpy.inf``", "inf").replace("%", "%%") + (f" ({'; '.join(known)})" if known else "")


def reader(read: Callable[[str], Any]) -> Callable[[str], Any]:
    """A type of argparse, which wants complaints in an exception of its own."""

    def reading(text: str) -> Any:
        try:
            return read(text)
        except ValueError as problem:
            raise argparse.ArgumentTypeError(getattr(problem, "err", str(problem))) from None

    return reading


def _chosen(option: Option, word: str) -> int:
    if word not in option.choices:
        raise ValueError(f"must be {' or '.join(option.choices)}, got {word!r}")
    return option.choices[word]


def _saved(path: str) -> dict[str, Any]:
    """What differs from the defaults in a file of parameters."""
    detector = createScanLineDetector()
    detector.load(path)
    values = {name: getattr(detector, f"get{name[0].upper()}{name[1:]}")() for name in DETECTION}
    return {name: value for name, value in values.items() if not np.array_equal(value, DETECTION[name].default)}


def save(path: str, options: Mapping[str, Any]) -> None:
    """Save the parameters of the detector among the options, for --params."""
    detector = createScanLineDetector()
    for name, value in options.items():
        if name in DETECTION:
            getattr(detector, f"set{name[0].upper()}{name[1:]}")(value)
    detector.save(path)


def pixel(text: str) -> tuple[int, int]:
    """Column and row."""
    words = text.replace(",", " ").split()
    if len(words) != 2 or not all(word.isdecimal() for word in words):
        raise ValueError(f"must be two whole numbers, column and row, got {text!r}")
    return int(words[0]), int(words[1])


def _mask(text: str) -> np.ndarray:
    try:
        picture = cv2.imdecode(np.fromfile(text, np.uint8), cv2.IMREAD_UNCHANGED)
    except (OSError, cv2.error) as reason:
        raise argparse.ArgumentTypeError(f"cannot read {text!r}: {getattr(reason, 'strerror', reason)}") from None
    if picture is None or picture.dtype != np.uint8 or picture.ndim != 2:
        raise argparse.ArgumentTypeError(f"must be an 8-bit image of one channel, {text!r} is none")
    return picture
