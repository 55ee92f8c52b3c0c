"""Options as words: what the command line reads. A ValueError says what is wrong with a word."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from .constants import DIR_ALL, DIR_COLS, DIR_DIAG45, DIR_DIAG135, DIR_ROWS
from .noise_model import NoiseModel

DIRECTIONS = {"rows": DIR_ROWS, "cols": DIR_COLS, "diag45": DIR_DIAG45, "diag135": DIR_DIAG135, "all": DIR_ALL}
SENSORS = {
    "realsense": NoiseModel.realsense,
    "azureKinect": NoiseModel.azureKinect,
    "kinect1": NoiseModel.kinect1,
    "kinect2": NoiseModel.kinect2,
    "structuredLight": NoiseModel.structuredLight,
}


def camera(text: str) -> np.ndarray | str:
    """A camera matrix of 4, 9 or 12 numbers, else the name of a file."""
    if os.path.exists(text):
        return text
    from .io.camera import matrix_of

    return matrix_of(_numbers(text, (4, 9, 12), "four numbers fx,fy,cx,cy, or the name of a camera's file"))


def distortion(text: str) -> list[float]:
    return _numbers(text, (4, 5, 8, 12, 14), "4, 5, 8, 12 or 14 numbers k1,k2,p1,p2[,k3[,...]]")


def point(text: str) -> list[float]:
    return _numbers(text, (3,), "three numbers x,y,z")


def invalid_values(text: str) -> list[float | list[float]]:
    """Values and ranges low:high, joined by commas; "none" of them."""
    if text == "none":
        return []
    ranges = []
    for part in text.split(","):
        numbers = _numbers(part.replace(":", ","), (1, 2), "values and ranges low:high, joined by commas")
        ranges.append(numbers[0] if len(numbers) == 1 else numbers)
    return ranges


def pixel_size(text: str) -> float | tuple[float, ...]:
    numbers = _numbers(text, (1, 2), "one length or two, dx,dy")
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def image_size(text: str) -> list[int]:
    """Width and height as 640,480 or 640x480."""
    width, height = _numbers(text.lower().replace("x", ","), (2,), "a width and a height, 640,480")
    if not (width.is_integer() and height.is_integer()):
        raise ValueError(f"must be whole numbers, got {text!r}")
    return [int(width), int(height)]


def noise(text: str) -> float | NoiseModel:
    if text in SENSORS:
        return SENSORS[text]()
    names = ", ".join(SENSORS)
    numbers = _numbers(
        text, (1, 3, 4, 5), f"a length, a,b,c, a,b,c,correlation, a,b,c,correlation,length or one of {names}"
    )
    return numbers[0] if len(numbers) == 1 else NoiseModel(*numbers)


def directions(text: str) -> int:
    chosen = 0
    for word in text.split(","):
        if word not in DIRECTIONS:
            raise ValueError(f"must be of {', '.join(DIRECTIONS)}, joined by commas, got {text!r}")
        chosen |= DIRECTIONS[word]
    return chosen


def _numbers(text: str, counts: Sequence[int], form: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise ValueError(f"must be {form}, got {text!r}")
    return numbers
