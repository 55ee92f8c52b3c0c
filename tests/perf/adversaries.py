"""Images that cost a function more than a typical one: what it takes many rounds for, finds much of, or cannot tell.

Every kind is a dictionary of functions of (rows, columns), so that an image is made when it is wanted.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

Shape = tuple[int, int]
Images = dict[str, Callable[[Shape], np.ndarray]]


def uniform(shape: Shape) -> np.ndarray:
    return np.random.default_rng(0).random(shape, np.float32)


def white_noise(shape: Shape) -> np.ndarray:
    return np.random.default_rng(0).normal(2, 0.1, shape).astype(np.float32)


def _indices(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    v, u = np.indices(shape, sparse=True)
    return v, u


def _polar(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    v, u = _indices(shape)
    return np.hypot(v - shape[0] / 2, u - shape[1] / 2), np.arctan2(v - shape[0] / 2, u - shape[1] / 2)


def _spiral(shape: Shape, width: float) -> np.ndarray:
    radius, angle = _polar(shape)
    return (radius + angle * 8 / np.pi) % 16 < width


def _where(wanted: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[[Shape], np.ndarray]:
    """An edge map of the pixels at which wanted(row, column)."""
    return lambda shape: np.broadcast_to(wanted(*_indices(shape)), shape).astype(np.uint8) * np.uint8(255)


def _by_chance(share: float) -> Callable[[Shape], np.ndarray]:
    return lambda shape: (uniform(shape) < share) * np.uint8(255)


EDGES: Images = {
    "all pixels": _where(lambda v, u: (v >= 0) & (u >= 0)),
    "no pixel": _where(lambda v, u: (v < 0) | (u < 0)),
    "one pixel": lambda shape: _where(lambda v, u: (v == shape[0] // 2) & (u == shape[1] // 2))(shape),
    "every other pixel": _where(lambda v, u: (u + v) % 2 > 0),
    "every other diagonal": _where(lambda v, u: (u + v) % 3 > 0),
    "a pixel in five by chance": _by_chance(0.2),
    "a pixel in two by chance": _by_chance(0.5),
    "nine pixels in ten by chance": _by_chance(0.9),
    "a comb": _where(lambda v, u: (v % 64 == 0) | (u % 4 == 0)),
    "stairs": _where(lambda v, u: (u + v // 3 * 4) % 12 < 3),
    "rings": lambda shape: (_polar(shape)[0] % 5 < 2) * np.uint8(255),
    "a spiral of lines": lambda shape: _spiral(shape, 2) * np.uint8(255),
    "a spiral of bands": lambda shape: _spiral(shape, 12) * np.uint8(255),
    "a frame": lambda shape: cv2.copyMakeBorder(
        np.zeros((max(shape[0] - 2, 0), max(shape[1] - 2, 0)), np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=255
    )[: shape[0], : shape[1]],
}


# Depths, and the noise that is told of them.
DEPTHS: dict[str, tuple[Callable[[Shape], np.ndarray], float]] = {
    "white noise": (white_noise, 0.1),
    "noise, told 5 times too small": (white_noise, 0.02),
    "noise, told 10 times too small": (white_noise, 0.01),
    "noise, told 1000 times too small": (white_noise, 1e-4),
    "ramps that alternate": (lambda s: np.subtract(1, 2 * (sum(_indices(s)) % 2)) * (1.0 + sum(_indices(s))), 1e-3),
    "a zigzag": (lambda s: np.abs(sum(_indices(s)) % 6 - 3) + 0.01 * white_noise(s) + 1, 1e-4),
    "pyramids": (lambda s: (1 + sum(np.abs(i % 8 - 4) for i in _indices(s))).astype(np.float32), 1e-4),
    "rings": (lambda s: (1 + np.abs(_polar(s)[0] % 8 - 4)).astype(np.float32), 1e-4),
    "a staircase": (lambda s: np.exp(np.linspace(0, 20, s[1], dtype=np.float32))[None].repeat(s[0], 0), 1e-6),
    "a walk by chance": (lambda s: np.cumsum(white_noise(s) - 2, axis=1, dtype=np.float32), 1e-2),
    "one plane": (lambda s: np.broadcast_to(2 + _indices(s)[1] / np.float32(s[1]), s), 1e-3),
    "a pixel in two": (lambda s: np.where(sum(_indices(s)) % 2 == 0, np.float32(1), np.float32("nan")), 1e-3),
    "no pixel": (lambda s: np.full(s, np.nan, np.float32), 1e-3),
}

SALIENCES: Images = {
    "falls steadily": lambda s: (
        np.where(np.arange(s[1]) < s[1] / 4, 1 - np.arange(s[1]) / s[1], 0).astype(np.float32)[None].repeat(s[0], 0)
    ),
    "falls all over, 8 bits": lambda s: (255 - np.arange(s[1]) * 254 // s[1]).astype(np.uint8)[None].repeat(s[0], 0),
    "around a disc": lambda s: np.where(_polar(s)[0] > 0.3 * s[0], _polar(s)[0] / _polar(s)[0].max(), 0).astype(
        np.float32
    ),
    "noise": lambda s: (256 * uniform(s)).astype(np.uint8),
}

# Distances in which seeds are looked for.
LANDSCAPES: Images = {
    "a plateau": lambda s: np.full(s, 9, np.float32),
    "a ramp": lambda s: np.broadcast_to(1 + _indices(s)[1], s).astype(np.float32),
    "a ramp that alternates": lambda s: ((1 + _indices(s)[1]) * (1 + sum(_indices(s)) % 2)).astype(np.float32),
    "two values that alternate": lambda s: (9 + sum(_indices(s)) % 2).astype(np.float32),
    "noise": lambda s: 9 + uniform(s),
    "a spiral uphill": lambda s: (9 + (_polar(s)[0] + _polar(s)[1] * 8 / np.pi) % 16).astype(np.float32),
    "infinite": lambda s: np.full(s, np.inf, np.float32),
}


def _comb_of_markers(shape: Shape) -> np.ndarray:
    v, u = np.indices(shape)
    comb = np.where(v % 8 == 0, 1, 0)
    teeth = (v % 8 >= 2) & (v % 8 < 6) & (u % 6 >= 2)
    comb[teeth] = (2 + v // 8 * (shape[1] // 6 + 1) + u // 6)[teeth]
    return comb


MARKERS: Images = {
    "a comb of markers": _comb_of_markers,
    "one marker": lambda s: EDGES["one pixel"](s) // 255,
    "no marker": lambda s: np.zeros(s, np.int32),
    "one marker on all pixels": lambda s: np.ones(s, np.int32),
    "a marker on every other pixel": lambda s: np.where(
        sum(_indices(s)) % 2 == 0, 1 + np.arange(s[0] * s[1]).reshape(s), 0
    ),
    "markers of 4 x 4 pixels": lambda s: _blocks(s, 6) * (_indices(s)[0] % 6 < 4) * (_indices(s)[1] % 6 < 4),
}


def _blocks(shape: Shape, side: int) -> np.ndarray:
    v, u = _indices(shape)
    return 1 + v // side * ((shape[1] - 1) // side + 1) + u // side


def _bricks(shape: Shape) -> np.ndarray:
    v, u = _indices(shape)
    return 1 + v // 8 * ((shape[1] + 3) // 8 + 1) + (u + v // 8 % 2 * 4) // 8


LABELS: Images = {
    "blocks of 8 x 8": lambda s: _blocks(s, 8),
    "blocks of 3 x 3": lambda s: _blocks(s, 3),
    "bricks": _bricks,
    "a label a pixel": lambda s: _blocks(s, 1),
    "one label": lambda s: np.ones(s, np.int32),
    "two labels by chance": lambda s: 1 + (uniform(s) < 0.5),
    "one among many": lambda s: np.where(uniform(s) < 0.7, 1, _blocks(s, 1)),
    "rows": lambda s: np.broadcast_to(1 + _indices(s)[0], s),
}


def _serpentine(shape: Shape, period: int) -> np.ndarray:
    walls = np.zeros(shape, np.uint8)
    walls[period - 1 :: period] = 255
    walls[period - 1 :: 2 * period, :2] = walls[2 * period - 1 :: 2 * period, -2:] = 0
    return walls


BARRIERS: Images = {
    "a pixel in a hundred by chance": _by_chance(0.01),
    "a serpentine": lambda s: _serpentine(s, 6),
    "a narrow serpentine": lambda s: _serpentine(s, 3),
    "teeth": _where(lambda v, u: (v > 0) & (u % 6 == 5)),
    "a spiral": lambda s: _spiral(s, 2) * np.uint8(255),
    "none": lambda s: np.zeros(s, np.uint8),
}

# Scan lines of so many samples.
LINES: dict[str, Callable[[int], np.ndarray]] = {
    "a ramp that alternates": lambda n: np.where(np.arange(n) % 2, -1.0, 1.0) * (1 + np.arange(n)),
    "powers": lambda n: np.exp(np.linspace(0, 600, n)),
    "a walk by chance": lambda n: np.cumsum(uniform((1, n))[0] - 0.5),
    "noise": lambda n: white_noise((1, n))[0],
    "a line": lambda n: np.arange(n) * 0.5,
}
