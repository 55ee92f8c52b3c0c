"""What an option may be: each check takes its name and a value, and returns the value in the option's own type."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _check
from ._option import Check
from .noise_model import NoiseModel


def real(low: float = -np.inf, high: float = np.inf, *, above: bool = False) -> Check:
    return lambda name, value: _check.number(name, value, low, high, above=above)


def whole(low: int, high: int = 2**31 - 1) -> Check:
    return lambda name, value: _check.integer(name, value, low, high)


def or_none(check: Check) -> Check:
    return lambda name, value: None if value is None else check(name, value)


def one_of(constants: Mapping[str, int]) -> Check:
    return lambda name, value: _check.flag(name, value, constants)


def camera(name: str, value: Any) -> np.ndarray:
    return read_only(_check.camera_matrix(name, value))


def distortion(name: str, value: Any) -> np.ndarray:
    return read_only(_check.distortion(name, value))


def noise_value(name: str, value: Any) -> NoiseModel | float | np.ndarray:
    """A model, a number, or a copy of a map; whether it fits the image shows when that is there."""
    if isinstance(value, NoiseModel):
        return value
    if not isinstance(value, np.ndarray):
        if isinstance(value, str) or callable(value):
            model = "a NoiseModel, such as NoiseModel.kinect1()"
            raise _check.fail(name, f"a number, {model}, or a real array of shape (H, W)", _check.described(value))
        return _check.number(name, value, 0, above=True)
    expected = "a number, a NoiseModel, or a real array of shape (H, W)"
    value = _check.array(name, value, expected)
    if value.dtype.kind == "b":
        raise _check.fail(name, expected, _check.described(value))
    return read_only(value.astype(np.float32, order="C"))


def read_only(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


def below_one(name: str, value: Any) -> float:
    value = _check.number(name, value, 0, 1, above=True)
    if value == 1:
        raise _check.fail(name, "below 1", _check.described(value))
    return value
