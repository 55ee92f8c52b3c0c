"""Options as words: what the command line reads. A ValueError says what is wrong with a word."""

from __future__ import annotations

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


def camera(text: str) -> np.ndarray:
    fx, fy, cx, cy = _numbers(text, (4,), "four numbers fx,fy,cx,cy")
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def pixel_size(text: str) -> float | tuple[float, ...]:
    numbers = _numbers(text, (1, 2), "one length or two, dx,dy")
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


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
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise ValueError(f"must be {form}, got {text!r}")
    return numbers
