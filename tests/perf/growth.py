"""How time and memory of every stage grow with the image, per pixel, on one thread."""

from __future__ import annotations

import cv2
import numpy as np
from frames import Frame, mirrored, room, terrain
from stages import spent, stages

SIZES = ((640, 480), (1920, 1080), (4096, 4096))
MOST = 1.3  # times what a pixel takes in the smallest image


def growth() -> None:
    """A table of each kind of image; what grows faster than the image is marked."""
    scene = room(640, 480)
    cv2.setNumThreads(1)
    kinds = {
        "a cluttered room, repeated": lambda width, height: mirrored(scene, width, height),
        "terrain": lambda width, height: terrain(round((width * height) ** 0.5)),
    }
    for kind, make in kinds.items():
        print(f"\n{kind}: nanoseconds and bytes per pixel, one thread; * more than {MOST} times the smallest")
        print(f"{'':32}" + "".join(f"{f'{width}x{height}':>22}" for width, height in SIZES))
        rows: dict[str, list[tuple[float, float]]] = {}
        for width, height in SIZES:
            for name, cost in _per_pixel(make(width, height)).items():
                rows.setdefault(name, []).append(cost)
        for name, costs in rows.items():
            print(f"{name:32}" + "".join(f"{_cell(cost, costs[0]):>22}" for cost in costs))


def _per_pixel(frame: Frame) -> dict[str, tuple[float, float]]:
    """Nanoseconds, the least of a few runs, and bytes."""
    repeat = int(np.clip(8e6 / frame.pixels, 1, 5))
    costs = {}
    for name, call in stages(frame).items():
        seconds, size = spent(call)
        seconds = min([seconds, *(spent(call)[0] for _ in range(repeat - 1))])
        costs[name] = (1e9 * seconds / frame.pixels, size / frame.pixels)
    return costs


def _cell(cost: tuple[float, float], least: tuple[float, float]) -> str:
    marks = ["*" if value > MOST * first + 1 else "" for value, first in zip(cost, least, strict=True)]
    return f"{cost[0]:.1f}{marks[0]} ns {cost[1]:.0f}{marks[1]} B"
