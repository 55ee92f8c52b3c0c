"""Arrays of all kinds for `fuzz.py`: contents, types, and how they lie in memory."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

TINY, LARGE = 5e-324, 1.7e308
DTYPES = ["u1", "?", "u2", "i2", "i4", "u4", "i8", "f2", "f4", "f8", "g"]
SHAPES = [(1, 1), (1, 2), (1, 7), (9, 1), (2, 2), (3, 5), (16, 16), (24, 33), (33, 24), (64, 80), (7, 120), (1, 300)]
KINDS = ["constant", "zero", "plane", "step", "roof", "noise", "checkers", "alternating", "ties", "labels", "binary"]
KINDS += ["extreme", "far", "small", "large", "nothing"]
LAYOUTS = ["plain", "plain", "readonly", "fortran", "reversed", "strided", "swapped", "unaligned"]

seeds = st.integers(0, 2**16)


def content(shape: tuple[int, ...], kind: str, rng: np.random.Generator) -> np.ndarray:
    """Numbers of an image in double precision."""
    v, u = np.indices(shape[:2])
    plane = 2 + 0.01 * u + 0.02 * v
    image = {
        "constant": np.ones(shape[:2]),
        "zero": np.zeros(shape[:2]),
        "plane": plane,
        "step": plane + (u > shape[1] // 2),
        "roof": 3 - 0.1 * np.abs(u - shape[1] / 2),
        "noise": rng.normal(1, 0.1, shape[:2]),
        "checkers": 1.0 + (u + v) % 2,
        "alternating": (-1.0) ** (u + v) * (1 + u + v),
        "ties": 1.0 + np.abs(u - v) % 8,
        "labels": (u // 4 + 8 * (v // 4)) % 23,
        "binary": (rng.random(shape[:2]) < 0.2) * 255,
        "extreme": rng.choice([0, 1, -1, TINY, 1e-300, 1e-40, 1e38, 1e300, LARGE, np.inf, -np.inf, np.nan], shape[:2]),
        "far": plane + (u > shape[1] // 2) * 0.01 + 5e5,
        "small": plane * 1e-200,
        "large": plane * 1e200,
        "nothing": np.full(shape[:2], np.nan),
    }[kind].astype(float)
    if len(shape) == 3:
        with np.errstate(all="ignore"):
            image = np.stack(
                [(u - shape[1] / 2) * image, (v - shape[0] / 2) * image, image, image][: shape[2]], axis=-1
            )
    return image


def laid_out(array: np.ndarray, layout: str) -> np.ndarray:
    """The same numbers elsewhere in memory."""
    if layout == "fortran":
        return np.asfortranarray(array)
    if layout == "reversed":
        return np.ascontiguousarray(array[::-1, ::-1])[::-1, ::-1]
    if layout == "strided":
        return np.repeat(np.repeat(array, 2, axis=0), 3, axis=1)[::2, ::3]
    if layout == "swapped":
        return array.astype(array.dtype.newbyteorder())
    if layout == "unaligned":
        raw = np.empty(array.nbytes + 1, np.uint8)[1:]
        raw[:] = np.frombuffer(array.tobytes(), np.uint8)
        return raw.view(array.dtype).reshape(array.shape)
    array = np.ascontiguousarray(array)
    array.flags.writeable = layout != "readonly"
    return array


class Subclass(np.ndarray):
    """An array that is more than one."""


# What is like an array and none, or one that nobody expects.
WRAPPED = {
    "masked": lambda array: np.ma.masked_invalid(array) if array.dtype.kind == "f" else np.ma.masked_equal(array, 1),
    "subclass": lambda array: array.view(Subclass),
    "memoryview": lambda array: memoryview(np.ascontiguousarray(array.astype(array.dtype.newbyteorder("=")))),
    "list": lambda array: array.tolist(),
    "object": lambda array: array.astype(object),
    "complex": lambda array: array.astype(complex),
    "times": lambda array: np.zeros(array.shape, "m8[s]"),
    "texts": lambda array: array.astype("U3"),
    "records": lambda array: np.zeros(array.shape, [("x", "f4"), ("y", "f4"), ("z", "f4")]),
    "deeper": lambda array: array[None],
    "channel": lambda array: array[..., None],
    "row": lambda array: array.ravel(),
    "empty": lambda array: array[:0],
    "narrow": lambda array: array[:, :0] if array.ndim > 1 else array[:0],
    "broadcast": lambda array: np.broadcast_to(array.flat[0], array.shape),
    "overlapping": lambda array: np.lib.stride_tricks.as_strided(array, array.shape, (0,) * array.ndim),
}


@st.composite
def images(draw: Any, shape: tuple[int, int], dtypes: list[str] = DTYPES, deep: bool = False) -> np.ndarray:
    """An image of that shape, of points if `deep`."""
    kind, rng = draw(st.sampled_from(KINDS)), np.random.default_rng(draw(seeds))
    if deep and draw(st.booleans()):
        shape, dtypes = (*shape, draw(st.sampled_from([3, 4]))), ["f4", "f8"]
    image = content(shape, kind, rng)
    if draw(st.booleans()):
        image[rng.random(shape[:2]) < 0.1] = np.nan
    dtype = np.dtype(draw(st.sampled_from(dtypes)))
    scale, layout = draw(st.sampled_from([1, 1000])), draw(st.sampled_from(LAYOUTS))
    with np.errstate(all="ignore"):
        if dtype.kind in "iu":
            image = np.clip(np.nan_to_num(image * scale), 0, np.iinfo(dtype).max // 2)
        return laid_out(image.astype(dtype), layout)


@st.composite
def wrapped(draw: Any, arrays: Any) -> Any:
    """Something like one of the arrays, which a function need not take."""
    with np.errstate(all="ignore"):
        return WRAPPED[draw(st.sampled_from(list(WRAPPED)))](draw(arrays))
