"""The stages of a frame as calls without arguments, and what they take: milliseconds and bytes."""

from __future__ import annotations

import ctypes
import re
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from frames import Frame

import rangeedge

JUMP_CUT = 0.1  # metres of a jump that is as salient as any
PRECISE, CANNY, COPY, READING = "cv2.distanceTransform PRECISE", "cv2.Canny", "copy of the image", "reading the image"
CHAIN = "depth to seeds"
Call = Callable[[], Any]


def salience_of(strength: Any, edges: np.ndarray) -> np.ndarray:
    """Salience of thin edges, 0 elsewhere."""
    jump, crease = (cv2.copyTo(image, edges) for image in (strength.jump, strength.crease))
    return rangeedge.overallStrength(jump, crease, JUMP_CUT)


def chain(src: np.ndarray, geometry: dict[str, Any]) -> Any:
    """Thin edges, distance, salience distance, seeds."""
    edges, strength = rangeedge.detectEdgesWithStrength(src, **geometry)
    rangeedge.salienceDistanceTransform(salience_of(strength, edges))
    return rangeedge.extractSeeds(rangeedge.distanceTransform(edges))


def stages(frame: Frame) -> dict[str, Call]:
    """Every stage by name; results of earlier ones are the input of later ones."""
    src, geometry, regions = frame
    noise = rangeedge.estimateNoise(src, **geometry)
    edges, strength = rangeedge.detectEdgesWithStrength(src, noise=noise, **geometry)
    selected = rangeedge.selectEdges(strength)
    salience = salience_of(strength, edges)
    distance = rangeedge.distanceTransform(edges)
    calls: dict[str, Call] = {
        "estimateNoise": partial(rangeedge.estimateNoise, src, **geometry),
        "edgeStrength, noise given": partial(rangeedge.edgeStrength, src, noise=noise, **geometry),
        "edgeStrength": partial(rangeedge.edgeStrength, src, **geometry),
        "selectEdges": partial(rangeedge.selectEdges, strength),
        "thinEdges": partial(rangeedge.thinEdges, selected),
        "detectEdges": partial(rangeedge.detectEdges, src, **geometry),
        "overallStrength of thin edges": partial(salience_of, strength, edges),
        "distanceTransform": partial(rangeedge.distanceTransform, edges),
        "salienceDistanceTransform": partial(rangeedge.salienceDistanceTransform, salience),
        "extractSeeds": partial(rangeedge.extractSeeds, distance),
        CHAIN: partial(chain, src, geometry),
    }
    if regions:
        calls["regions, edges given"] = partial(rangeedge.segmentRegions, src, edges=edges, noise=noise, **geometry)
        calls["segmentRegions"] = partial(rangeedge.segmentRegions, src, **geometry)
    return calls


def others(frame: Frame) -> dict[str, Call]:
    """What to compare with, on the same frame."""
    depth = frame.src if frame.src.ndim == 2 else frame.src[..., 2]
    edges = rangeedge.detectEdges(frame.src, **frame.geometry)
    grey = cv2.normalize(np.nan_to_num(depth).astype(np.float32), None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    return {
        PRECISE: partial(cv2.distanceTransform, cv2.bitwise_not(edges), cv2.DIST_L2, cv2.DIST_MASK_PRECISE),
        CANNY: partial(cv2.Canny, grey, 50, 100),
        COPY: frame.src.copy,
        READING: frame.src.max,
    }


def candidates(frame: Frame) -> int:
    """Pixels at which the detector finds an edge of any strength."""
    strength = rangeedge.edgeStrength(frame.src, **frame.geometry)
    return int(np.count_nonzero((strength.jump > 0) | (strength.crease > 0)))


class Times:
    """Milliseconds of calls, by name and number of threads."""

    def __init__(self, calls: dict[str, Call], threads: Sequence[int], repeat: int) -> None:
        """All calls take turns, with every number of threads, so that a busy machine slows all alike."""
        self.names = list(calls)
        self._all: dict[tuple[str, int], list[float]] = {(name, n): [] for name in calls for n in threads}
        before = cv2.getNumThreads()
        for turn in range(1 + repeat):
            for n in threads:
                cv2.setNumThreads(n)
                for name, call in calls.items():
                    start = time.perf_counter()
                    call()
                    if turn:  # the first one does not count
                        self._all[name, n].append(1000 * (time.perf_counter() - start))
        cv2.setNumThreads(before)

    def least(self, name: str, threads: int) -> float:
        return min(self._all[name, threads])

    def median(self, name: str, threads: int) -> float:
        return statistics.median(self._all[name, threads])


def spent(call: Call) -> tuple[float, float]:
    """Seconds of processor time, and bytes at most beyond what was there before; NaN where the system is not Linux."""
    _forget_peak()
    before = _memory("VmRSS")
    start = time.process_time()
    kept = call()
    seconds = time.process_time() - start
    peak = _memory("VmHWM")
    del kept
    return seconds, peak - before


def _memory(what: str) -> float:
    status = Path("/proc/self/status")
    return 1024.0 * int(re.search(rf"{what}:\s+(\d+) kB", status.read_text())[1]) if status.exists() else np.nan


def _forget_peak() -> None:
    """Memory that was freed goes back, and the peak starts anew."""
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)
        Path("/proc/self/clear_refs").write_text("5")
