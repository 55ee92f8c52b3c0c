"""Time and peak memory of every function on the image that costs it most.

    python tests/perf/functions.py               # 1000 x 1000 pixels
    python tests/perf/functions.py --side 4000 --only salience

Each runs in a process of its own: its processor time, and by how much its memory grew, per pixel. For Linux.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from stages import spent

import rangeedge as rr
from rangeedge import evaluation


def calls(side: int) -> dict[str, Callable[[], Any]]:
    """The functions, each on what it takes longest for."""
    v, u = np.indices((side, side))
    noise = np.random.default_rng(0).normal(1, 0.1, (side, side)).astype(np.float32)
    camera = (side, side, side / 2, side / 2)
    speckles, full = ((noise > 1.1) * 255).astype(np.uint8), np.full((side, side), 255, np.uint8)
    patches = (u // 8 + (side // 8) * (v // 8)).astype(np.int32) + 1
    seeds = np.zeros((side, side), np.int32)
    seeds[::8, ::8] = np.arange(1, seeds[::8, ::8].size + 1).reshape(seeds[::8, ::8].shape)
    ramp = np.where(u < side // 4, 1 - u / side, 0).astype(np.float32)
    walls = np.zeros((side, side), np.uint8)
    walls[5::6] = 255
    walls[5::12, :2] = walls[11::12, -2:] = 0
    corner = np.zeros((side, side), np.uint8)
    corner[0, 0] = 255
    loud = {"noise": 1e-4}  # where all is an edge
    cut = noise[: side // 4, : side // 4]
    return {
        "backproject": lambda: rr.backproject(noise, K=camera),
        "estimateNoise": lambda: rr.estimateNoise(noise),
        "splitScanLine": lambda: rr.splitScanLine((-1.0) ** np.arange(side * 20) * np.arange(side * 20), 0.1),
        "edgeStrength": lambda: rr.edgeStrength(noise, **loud),
        "edgePoints": lambda: rr.edgePoints(noise, **loud),
        "flyingPixels": lambda: rr.flyingPixels(noise, K=camera, **loud),
        "selectEdges": lambda: rr.selectEdges(ramp, 90 * ramp, 0.1, dynamic=True),
        "thinEdges": lambda: rr.thinEdges(full),
        "detectEdges": lambda: rr.detectEdges(noise, **loud),
        "explainPixel": lambda: rr.explainPixel(noise, side // 2, side // 2, **loud),
        "linkEdges": lambda: rr.linkEdges(noise, **loud),
        "fitSegments": lambda: rr.fitSegments(rr.linkEdges(cut, **loud)),
        "closeContours": lambda: rr.closeContours(speckles, noise),
        "distanceTransform": lambda: rr.distanceTransform(corner, barrier=walls),
        "salienceDistanceTransform": lambda: rr.salienceDistanceTransform(ramp),
        "extractSeeds": lambda: rr.extractSeedsWithStats(rr.distanceTransform(speckles)),
        "growRegions": lambda: rr.growRegionsWithStats(noise, seeds, **loud),
        "segmentRegions": lambda: rr.segmentRegionsWithStats(noise, **loud),
        "regionBoundaries": lambda: rr.regionBoundaries(patches, noise),
        "regionAdjacency": lambda: rr.regionAdjacency(noise, patches, noise=0.1),
        "regionCorners": lambda: rr.regionCorners(noise, patches, noise=0.1),
        "cleanDepth": lambda: rr.cleanDepth(noise, K=camera, **loud),
        "drawRegions": lambda: rr.drawRegions(patches, noise),
        "drawBoundaries": lambda: rr.drawBoundaries(noise, rr.regionBoundaries(patches)),
        "hooverScores": lambda: evaluation.hooverScores(patches, seeds + 1),
        "baddeleyDelta": lambda: evaluation.baddeleyDelta(speckles, full),
    }


def measure(name: str, side: int) -> None:
    call = calls(side)[name]
    warnings.simplefilter("ignore")
    seconds, size = spent(call)
    pixels = side * side
    print(f"{name:27} {seconds:8.2f} s {1e6 * seconds / pixels:8.2f} us {size / pixels:8.0f} bytes", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=1000, help="of the image, in pixels")
    parser.add_argument("--only", default="", metavar="PART", help="of the name of a function")
    parser.add_argument("--here", metavar="NAME", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.here:
        measure(options.here, options.side)
        return
    for name in calls(8):
        if options.only in name:
            run = subprocess.run([sys.executable, __file__, "--here", name, "--side", str(options.side)], check=False)
            if run.returncode:
                print(f"{name:27} exit code {run.returncode}", flush=True)


if __name__ == "__main__":
    main()
