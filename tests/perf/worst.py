"""What the worst images known take of every function, beside a typical image of as many pixels, on one thread.

    python tests/perf/worst.py                                  # at 640 x 480
    python tests/perf/worst.py --sizes 1000x1000,4000x4000      # and how it grows
    python tests/perf/worst.py --only thinEdges,regions         # parts of names of functions
    python tests/perf/worst.py --sizes 20000x64,1000000x1       # shapes that are unusual themselves

Processor time, and by how much memory grows, per pixel. For Linux.
"""

from __future__ import annotations

import argparse
import gc
import math
import warnings
from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any

import adversaries
import cv2
import numpy as np
from frames import room
from stages import Call, salience_of, spent

import rangeedge as rr
from rangeedge import evaluation

MOST = 10.0  # times what a typical image takes
MOST_GROWTH = 2.0  # times what a pixel takes in the smallest image
Cases = Iterator[tuple[str, Callable[[], Call]]]


def worst(sizes: list[tuple[int, int]], wanted: list[str]) -> None:
    """A table of the functions wanted; what takes more than it should is marked."""
    cv2.setNumThreads(1)
    named = ", ".join(f"{width}x{height}" for width, height in sizes)
    print(f"\nWorst images, {named}, one thread: nanoseconds and bytes per pixel, and as multiples of a typical image")
    print(
        f"* more than {MOST:g} times a typical image, or than {MOST_GROWTH:g} times as much per pixel in a larger one"
    )
    print(f"{'':60}" + f"{'time':>9}{'ratio':>8}{'bytes':>8}{'ratio':>8}" * len(sizes))
    for function in functions():
        if not any(part in function for part in wanted):
            continue
        typical: list[tuple[float, float]] = []
        columns = [measured(function, size) for size in sizes]
        for row in zip(*columns, strict=True):
            costs = [cost for _, cost in row]
            typical = typical or costs
            cells = [_cells(cost, usual, costs[0]) for cost, usual in zip(costs, typical, strict=True)]
            print(f"{f'{function}: {row[0][0]}':60}" + "".join(cells), flush=True)


def _cells(cost: tuple[float, float], typical: tuple[float, float], smallest: tuple[float, float]) -> str:
    grows = ["*" if value > MOST_GROWTH * first + 1 else " " for value, first in zip(cost, smallest, strict=True)]
    ratios = [value / usual for value, usual in zip(cost, typical, strict=True)]
    times = [f"{ratio:.1f}{'*' if ratio > MOST else ' '}" for ratio in ratios]
    return f"{cost[0]:8.1f}{grows[0]}{times[0]:>8}{cost[1]:7.1f}{grows[1]}{times[1]:>8}"


def measured(function: str, size: tuple[int, int]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Nanoseconds and bytes per pixel of a function on its images, the typical one first."""
    pixels = size[0] * size[1]
    for name, make in functions()[function](Images(*size)):
        call = make()
        if pixels < 1 << 20:
            call()  # what is done once, and imports
        runs = [spent(call) for _ in range(3 if pixels < 1 << 20 else 1)]
        seconds, size_of = (min(values) / pixels for values in zip(*runs, strict=True))
        yield name, (1e9 * seconds, max(size_of, 1.0))  # less than a byte is nothing
        del call
        gc.collect()


class Images:
    """A typical image, what is found in it, and images of that many rows and columns that are not."""

    def __init__(self, width: int, height: int) -> None:
        self.shape = height, width
        self.side = math.isqrt(width * height * 3 // 4) or 1

    @cached_property
    def frame(self) -> Any:
        return room(self.shape[0] * self.shape[1] // self.side, self.side)

    @cached_property
    def noise(self) -> rr.NoiseModel:
        return rr.estimateNoise(self.frame.src, **self.frame.geometry)

    @property
    def told(self) -> dict[str, Any]:
        return {"noise": self.noise, **self.frame.geometry}

    @cached_property
    def found(self) -> tuple[np.ndarray, rr.EdgeStrength]:
        return rr.detectEdgesWithStrength(self.frame.src, **self.told)

    @cached_property
    def edges(self) -> np.ndarray:
        return self.found[0]

    @cached_property
    def regions(self) -> np.ndarray:
        return rr.segmentRegions(self.frame.src, edges=self.edges, **self.told)

    @cached_property
    def flat(self) -> np.ndarray:
        return np.random.default_rng(0).normal(1, 1e-3, self.shape).astype(np.float32)

    def of_depths(self, function: Callable[..., Any], told: bool = True, only: str = "", **geometry: Any) -> Cases:
        """Calls of a function on depths."""
        src = self.frame.src
        own = self.told if told else self.frame.geometry
        yield "typical", lambda: partial(function, src, **own)
        for name, (make, sigma) in adversaries.DEPTHS.items():
            noise = {"noise": sigma} if told else {}
            if only in name and (told or not name.startswith("noise, told")):
                yield name, lambda make=make, noise=noise: partial(function, make(self.shape), **noise, **geometry)

    def of(self, function: Callable[..., Any], typical: Call, images: adversaries.Images, dtype: Any = None) -> Cases:
        """Calls of a function on the images of a kind."""
        yield "typical", lambda: partial(function, typical())
        for name, make in images.items():
            yield name, lambda make=make: partial(function, np.array(make(self.shape), dtype, order="C"))


def functions() -> dict[str, Callable[[Images], Cases]]:
    """Every function, and its images."""
    return {
        "backproject": lambda images: images.of_depths(rr.backproject, told=False),
        "estimateNoise": lambda images: images.of_depths(rr.estimateNoise, told=False),
        "splitScanLine": _lines,
        "edgeStrength": lambda images: images.of_depths(rr.edgeStrength),
        "edgeStrength, noise not told": lambda images: images.of_depths(rr.edgeStrength, told=False),
        "edgePoints": lambda images: images.of_depths(rr.edgePoints, only="noise"),
        "flyingPixels": lambda images: images.of_depths(rr.flyingPixels, only="noise", K=(500, 500, 0, 0)),
        "selectEdges": _strengths,
        "selectEdges, dynamic": partial(_strengths, dynamic=True),
        "thinEdges": lambda images: images.of(rr.thinEdges, lambda: rr.selectEdges(images.found[1]), adversaries.EDGES),
        "detectEdges": lambda images: images.of_depths(rr.detectEdges),
        "explainPixel": lambda images: images.of_depths(partial(_explained, rr.explainPixel), only="noise"),
        "linkEdges": lambda images: images.of_depths(rr.linkEdges),
        "fitSegments": _chains,
        "closeContours": lambda images: images.of(
            lambda edges: rr.closeContours(edges, *(_depths(images, edges))), lambda: images.edges, adversaries.EDGES
        ),
        "distanceTransform": lambda images: images.of(rr.distanceTransform, lambda: images.edges, adversaries.EDGES),
        "distanceTransformWithLabels": lambda images: images.of(
            rr.distanceTransformWithLabels, lambda: images.edges, adversaries.EDGES
        ),
        "distanceTransform, barrier": _barriers,
        "salience, multiplicative": partial(_saliences, rr.SALIENCE_MULTIPLICATIVE),
        "salience, additive": partial(_saliences, rr.SALIENCE_ADDITIVE),
        "extractSeeds": _seeds,
        "growRegions": _markers,
        "segmentRegions": lambda images: images.of_depths(rr.segmentRegions),
        "segmentRegionsWithStats": lambda images: images.of_depths(rr.segmentRegionsWithStats, only="noise"),
        "regionBoundaries": _labels(rr.regionBoundaries),
        "regionAdjacency": _labels(lambda labels, src, told: rr.regionAdjacency(src, labels, **told), True),
        "regionCorners": _labels(lambda labels, src, told: rr.regionCorners(src, labels, **told), True),
        "cleanDepth": lambda images: images.of_depths(rr.cleanDepth, K=(500, 500, 0, 0)),
        "drawRegions": _labels(rr.drawRegions),
        "drawBoundaries": _labels(
            lambda labels: rr.drawBoundaries(labels * np.float32(1), rr.regionBoundaries(labels))
        ),
        "hooverScores": _labels(lambda labels: evaluation.hooverScores(labels, labels)),
        "baddeleyDelta": lambda images: images.of(
            lambda edges: evaluation.baddeleyDelta(edges, 255 - edges), lambda: images.edges, adversaries.EDGES
        ),
    }


def _lines(images: Images) -> Cases:
    rows, cols = images.shape

    def split(line: np.ndarray, tolerance: float) -> None:
        for _ in range(rows):
            rr.splitScanLine(line, tolerance)

    yield "typical", lambda: partial(split, np.resize(images.frame.src, cols) * 1e-3, 0.01)
    for name, make in adversaries.LINES.items():
        yield name, lambda make=make: partial(split, make(cols), 0.1)


def _explained(function: Callable[..., Any], src: np.ndarray, **told: Any) -> Any:
    return function(src, src.shape[1] // 2, src.shape[0] // 2, **told)


def _strengths(images: Images, dynamic: bool = False) -> Cases:
    strength = images.found[1]
    yield "typical", lambda: partial(rr.selectEdges, strength, dynamic=dynamic)
    for name, make in (adversaries.SALIENCES | {"noise, float": adversaries.uniform}).items():
        jump = make(images.shape).astype(np.float32)
        yield name, lambda jump=jump: partial(rr.selectEdges, jump, jump, 0.1, dynamic=dynamic)


def _chains(images: Images) -> Cases:
    yield "typical", lambda: partial(rr.fitSegments, rr.linkEdges(images.frame.src, **images.told))
    for name, (make, sigma) in adversaries.DEPTHS.items():
        chains = partial(rr.linkEdges, noise=sigma)
        yield name, lambda make=make, chains=chains: partial(rr.fitSegments, chains(make(images.shape)))


def _depths(images: Images, edges: np.ndarray) -> tuple[np.ndarray]:
    return (images.frame.src if edges is images.edges else images.flat,)


def _barriers(images: Images) -> Cases:
    jumps = (images.found[1].kind & rr.EDGE_JUMP > 0) & (images.edges > 0)
    yield "typical", lambda: partial(rr.distanceTransform, images.edges * ~jumps, barrier=jumps)
    corner = np.zeros(images.shape, np.uint8)
    corner[0, 0] = 255
    for name, make in adversaries.BARRIERS.items():
        yield name, lambda make=make: partial(rr.distanceTransform, corner, barrier=make(images.shape) * (corner == 0))


def _saliences(method: int, images: Images) -> Cases:
    function = partial(rr.salienceDistanceTransform, method=method)
    salience = salience_of(images.found[1], images.edges)
    return images.of(function, lambda: salience, adversaries.SALIENCES | adversaries.EDGES)


def _seeds(images: Images) -> Cases:
    yield from images.of(
        rr.extractSeeds, lambda: rr.distanceTransform(images.edges), adversaries.LANDSCAPES, np.float32
    )
    for name, make in adversaries.EDGES.items():
        distance = partial(rr.distanceTransform)
        yield (
            f"distances to {name}",
            lambda make=make, distance=distance: partial(rr.extractSeeds, distance(make(images.shape))),
        )


def _markers(images: Images) -> Cases:
    markers = rr.extractSeeds(rr.distanceTransform(images.edges))[1]
    yield "typical", lambda: partial(rr.growRegions, images.frame.src, markers, edges=images.edges, **images.told)
    for name, make in adversaries.MARKERS.items():
        for src, depth, sigma in (("", images.flat, 1e-3), (", in noise", adversaries.white_noise(images.shape), 1e-4)):
            grow = partial(rr.growRegions, depth, noise=sigma)
            yield name + src, lambda make=make, grow=grow: partial(grow, make(images.shape).astype(np.int32))


def _labels(function: Callable[..., Any], with_depths: bool = False) -> Callable[[Images], Cases]:
    """Of a function of labels, and of the depths and their noise if it takes them."""

    def cases(images: Images) -> Cases:
        own = (images.frame.src, images.told) if with_depths else ()
        yield "typical", lambda: partial(function, images.regions, *own)
        other = (adversaries.white_noise(images.shape), {"noise": 0.1}) if with_depths else ()
        for name, make in adversaries.LABELS.items():
            yield name, lambda make=make: partial(function, make(images.shape).astype(np.int32), *other)

    return cases


def size_of(text: str) -> tuple[int, int]:
    width, height = map(int, text.split("x"))
    return width, height


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="640x480", help="of the images, WIDTHxHEIGHT, separated by commas")
    parser.add_argument("--only", default="", metavar="PARTS", help="of names of functions, separated by commas")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    worst([size_of(size) for size in options.sizes.split(",")], options.only.split(","))


if __name__ == "__main__":
    main()
