"""The worst images of every stage, beside a typical one of the same size, on one thread."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import cv2
import numpy as np
from frames import room
from stages import Call, salience_of, spent

import rangeedge

MOST = 10.0  # times what a typical image takes


def worst(width: int, height: int, wanted: list[str]) -> None:
    """A table of all images of the stages wanted; what takes more than it should is marked."""
    cv2.setNumThreads(1)
    print(f"\nWorst images, {width}x{height}, one thread; * more than {MOST:g} times a typical one")
    print(f"{'nanoseconds and bytes per pixel':60}{'time':>9}{'ratio':>8}{'bytes':>8}{'ratio':>8}")
    for stage, images in _all_stages(width, height).items():
        if not any(part in stage for part in wanted):
            continue
        least: tuple[float, float] | None = None
        for name, call in images():
            call()
            runs = [spent(call) for _ in range(2)]
            time, size = (min(values) / (width * height) for values in zip(*runs, strict=True))
            cost = 1e9 * time, max(size, 1.0)  # less than a byte is nothing
            least = least or cost
            ratios = [value / first for value, first in zip(cost, least, strict=True)]
            marked = [f"{ratio:.1f}{'*' if ratio > MOST else ' '}" for ratio in ratios]
            print(f"{f'{stage}: {name}':60}{cost[0]:9.1f}{marked[0]:>8}{cost[1]:8.1f}{marked[1]:>8}")


def _all_stages(width: int, height: int) -> dict[str, Callable[[], Iterator[tuple[str, Call]]]]:
    """Images of each stage, the first of which is typical."""
    frame = room(width, height)
    noise = rangeedge.estimateNoise(frame.src, **frame.geometry)
    edges, strength = rangeedge.detectEdgesWithStrength(frame.src, noise=noise, **frame.geometry)
    selected = rangeedge.selectEdges(strength)
    salience = salience_of(strength, edges)
    maps = edge_maps(width, height)
    surface = (height, width)

    def of_depths(function: Callable[..., object], told: bool) -> Iterator[tuple[str, Call]]:
        yield "typical", partial(function, frame.src, **frame.geometry, **({"noise": noise} if told else {}))
        for name, (depth, sigma) in depths(width, height).items():
            yield name, partial(function, depth, **({"noise": sigma} if told else {}))

    def of_edges(function: Callable[..., object], typical: np.ndarray) -> Iterator[tuple[str, Call]]:
        yield "typical", partial(function, typical)
        for name, image in maps.items():
            yield name, partial(function, image)

    def of_salience(method: int) -> Iterator[tuple[str, Call]]:
        yield "typical", partial(rangeedge.salienceDistanceTransform, salience, method)
        for name, image in (saliences(width, height) | maps).items():
            yield name, partial(rangeedge.salienceDistanceTransform, image, method)

    def of_distances() -> Iterator[tuple[str, Call]]:
        yield "typical", partial(rangeedge.extractSeeds, rangeedge.distanceTransform(edges))
        for name, image in maps.items():
            yield f"distances to {name}", partial(rangeedge.extractSeeds, rangeedge.distanceTransform(image))
        for name, image in landscapes(width, height).items():
            yield name, partial(rangeedge.extractSeeds, image)

    def of_markers() -> Iterator[tuple[str, Call]]:
        markers = rangeedge.extractSeeds(rangeedge.distanceTransform(edges))[1]
        grow = partial(rangeedge.growRegions, edges=edges, noise=noise, **frame.geometry)
        yield "typical", partial(grow, frame.src, markers)
        flat = 1 + np.random.default_rng(0).normal(0, 1e-3, surface).astype(np.float32)
        for name, image in markings(width, height).items():
            yield name, partial(rangeedge.growRegions, flat, image, noise=1e-3)

    return {
        "estimateNoise": partial(of_depths, rangeedge.estimateNoise, False),
        "edgeStrength": partial(of_depths, rangeedge.edgeStrength, True),
        "detectEdges": partial(of_depths, rangeedge.detectEdges, True),
        "thinEdges": partial(of_edges, rangeedge.thinEdges, selected),
        "distanceTransform": partial(of_edges, rangeedge.distanceTransform, edges),
        "distanceTransformWithLabels": partial(of_edges, rangeedge.distanceTransformWithLabels, edges),
        "salience, multiplicative": partial(of_salience, rangeedge.SALIENCE_MULTIPLICATIVE),
        "salience, additive": partial(of_salience, rangeedge.SALIENCE_ADDITIVE),
        "extractSeeds": of_distances,
        "growRegions": of_markers,
        "segmentRegions": partial(of_depths, rangeedge.segmentRegions, True),
    }


def depths(width: int, height: int) -> dict[str, tuple[np.ndarray, float]]:
    """Depths, and the noise that is told."""
    v, u = np.indices((height, width), dtype=np.float32)
    white = np.random.default_rng(0).normal(0, 0.1, v.shape).astype(np.float32)
    gaps = np.where((u + v) % 2 == 0, np.float32(1), np.float32("nan"))
    return {
        "white noise": (white + 2, 0.1),
        "white noise, told 1000 times too small": (white + 2, 1e-4),
        "ramps that alternate": ((-1.0) ** (u + v) * (1.0 + u + v), 1e-3),
        "a staircase": (np.exp(np.linspace(0, 20, width, dtype=np.float32))[None].repeat(height, 0), 1e-6),
        "one plane": (2 + u / width, 1e-3),
        "a pixel in two": (gaps, 1e-3),
        "no pixel": (np.full_like(white, np.nan), 1e-3),
    }


def edge_maps(width: int, height: int) -> dict[str, np.ndarray]:
    v, u = np.indices((height, width))
    rng = np.random.default_rng(0)
    radius, angle = np.hypot(v - height / 2, u - width / 2), np.arctan2(v - height / 2, u - width / 2)
    maps = {
        "all pixels": np.ones_like(u),
        "no pixel": np.zeros_like(u),
        "one pixel": (v == height // 2) & (u == width // 2),
        "every other pixel": (u + v) % 2,
        "a pixel in two by chance": rng.random(u.shape) < 0.5,
        "a comb": (v % 64 == 0) | (u % 4 == 0),
        "a spiral of lines": (radius + angle * 8 / np.pi) % 16 < 2,
        "a spiral of bands": (radius + angle * 8 / np.pi) % 16 < 12,
        "a frame": (u == 0) | (v == 0) | (u == width - 1) | (v == height - 1),
    }
    return {name: 255 * (image > 0).astype(np.uint8) for name, image in maps.items()}


def saliences(width: int, height: int) -> dict[str, np.ndarray]:
    v, u = np.indices((height, width))
    radius = np.hypot(v - height / 2, u - width / 2)
    noise = np.random.default_rng(0).integers(0, 256, u.shape)
    return {
        "falls steadily": np.where(u < width / 4, (width - u) / width, 0).astype(np.float32),
        "falls all over, 8 bits": (255 - u * 254 // width).astype(np.uint8),
        "around a disc": np.where(radius > 0.3 * height, radius / radius.max(), 0).astype(np.float32),
        "noise": noise.astype(np.uint8),
    }


def landscapes(width: int, height: int) -> dict[str, np.ndarray]:
    v, u = np.indices((height, width), dtype=np.float32)
    return {
        "a plateau": np.full_like(u, 9),
        "a ramp": 1 + u,
        "a ramp that alternates": (1 + u) * (1 + (u + v) % 2),
        "two values that alternate": 9 + (u + v) % 2,
        "noise": 9 + np.random.default_rng(0).random(u.shape, np.float32),
        "infinite": np.full_like(u, np.inf),
    }


def markings(width: int, height: int) -> dict[str, np.ndarray]:
    v, u = np.indices((height, width))
    comb = np.where(v % 8 == 0, 1, 0)
    teeth = (v % 8 >= 2) & (v % 8 < 6) & (u % 6 >= 2)
    comb[teeth] = (2 + v // 8 * (width // 6 + 1) + u // 6)[teeth]
    marks = {
        "a comb of markers": comb,
        "one marker": (v == height // 2) & (u == width // 2),
        "no marker": np.zeros_like(u),
        "one marker on all pixels": np.ones_like(u),
        "a marker on every other pixel": np.where((u + v) % 2 == 0, 1 + v * width + u, 0),
    }
    return {name: image.astype(np.int32) for name, image in marks.items()}
