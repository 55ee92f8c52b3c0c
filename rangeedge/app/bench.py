"""How long each stage takes on this machine, beside `cv2.Canny` and a copy of the image."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from .. import __version__
from .._check import integer
from .._option import parsed, takes
from ..detector import detectEdges, detectEdgesWithStrength
from ..distance import distanceTransform, salienceDistanceTransform
from ..edges import edgePoints, edgeStrength
from ..frame import read_frame
from ..noise import estimateNoise
from ..options import GEOMETRY, ScanLineParams
from ..seeds import extractSeeds
from ..selection import overallStrength, selectEdges
from ..thinning import thinEdges


@takes(GEOMETRY)
def benchmark(src: np.ndarray, *, repeat: int = 20, mask: np.ndarray | None = None, **geometry: Any) -> dict[str, Any]:
    """Time the stages in turn, again and again, in one process.

    benchmark(src, *[, repeat[, mask[, K[, pixelSize[, heightMap[, depthFactor]]]]]]) -> retval

    Parameters
    ----------
    src, mask, K, pixelSize, heightMap, depthFactor
        The range image, as for `detectEdges`.
    repeat : int
        How often each stage runs, after one run that does not count.

    Returns
    -------
    retval : dict
        ``stages`` maps names to ``{"min": milliseconds, "median": milliseconds}``; besides, the size of the image,
        the number of threads and the versions.

    Raises
    ------
    rangeedge.error
        On a bad argument.
    """
    repeat = integer("repeat", repeat, 1)
    times = timed(stages(src, mask, geometry), repeat)
    return {
        "width": src.shape[1],
        "height": src.shape[0],
        "threads": cv2.getNumThreads(),
        "rangeedge": __version__,
        "opencv": cv2.__version__,
        "numpy": np.__version__,
        "stages": times,
    }


def table(result: dict[str, Any]) -> str:
    """The result of `benchmark`, to read."""
    lines = [f"{result['width']} x {result['height']} pixels, {result['threads']} threads, OpenCV {result['opencv']}"]
    lines += [f"{'milliseconds':28}{'min':>10}{'median':>10}"]
    lines += [f"{name:28}{t['min']:10.3f}{t['median']:10.3f}" for name, t in result["stages"].items()]
    return "\n".join(lines)


def stages(src: np.ndarray, mask: np.ndarray | None, geometry: dict[str, Any]) -> dict[str, Callable[[], Any]]:
    """What is timed, by name; results of earlier stages are the input of later ones."""
    (params,) = parsed(geometry, ScanLineParams)
    depth = read_frame(src, params, mask).depth
    grey = cv2.normalize(np.nan_to_num(depth), None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    noise = estimateNoise(src, mask=mask, **geometry)
    _, strength = detectEdgesWithStrength(src, noise=noise, mask=mask, **geometry)
    selected = selectEdges(strength)
    thin = thinEdges(selected)
    salience = overallStrength(strength.jump, strength.crease, max(float(strength.jump.max()), 1e-6))
    distance = distanceTransform(thin)
    return {
        "detectEdges": lambda: detectEdges(src, mask=mask, **geometry),
        "  estimateNoise": lambda: estimateNoise(src, mask=mask, **geometry),
        "  edgeStrength, noise given": lambda: edgeStrength(src, noise=noise, mask=mask, **geometry),
        "  selectEdges": lambda: selectEdges(strength),
        "  thinEdges": lambda: thinEdges(selected),
        "edgePoints, noise given": lambda: edgePoints(src, noise=noise, mask=mask, **geometry),
        "distanceTransform": lambda: distanceTransform(thin),
        "salienceDistanceTransform": lambda: salienceDistanceTransform(salience),
        "extractSeeds": lambda: extractSeeds(distance),
        "cv2.Canny": lambda: cv2.Canny(grey, 50, 100),
        "copy of the image": src.copy,
    }


def timed(
    calls: dict[str, Callable[[], Any]], repeat: int, clock: Callable[[], float] = time.perf_counter
) -> dict[str, dict[str, float]]:
    """Least and median milliseconds of each call. They take turns, so that a busy machine slows all alike."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(1 + repeat):
        for name, call in calls.items():
            start = clock()
            call()
            times[name].append(1000 * (clock() - start))
    return {name: {"min": min(t[1:]), "median": statistics.median(t[1:])} for name, t in times.items()}
