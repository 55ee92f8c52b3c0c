"""Every stage beside what a user would pick instead: `python tests/perf/benchmark.py [--sizes 640x480] [--out FILE]`.

All calls on an image take turns in one process, so that a busy machine slows them alike; compare ratios. Images are
rendered, and real ones where the data are installed; larger sizes repeat them mirrored, so that the content per pixel
stays the same. With one thread, times are those the processor spent. Each combination prints a table; JSON goes to
`--out`.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from skimage.morphology import skeletonize
from skimage.segmentation import watershed

import rangeedge
from rangeedge.app.bench import stages, timed
from rangeedge.app.demo import RenderedScene

SHARED = Path(__file__).resolve().parents[3] / "shared"
DIRECTIONS = {"rows": 1, "columns": 2, "diagonals 45": 4, "diagonals 135": 8}
CREASE = 30.0  # degrees

Call = Callable[[], Any]


def frames() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Depths in metres, float32 with NaN where there is none, and camera matrices."""
    scene = RenderedScene()
    found = {
        "rendered": (np.where(scene.src > 0, scene.src / np.float32(1000), np.float32("nan")), scene.geometry["K"])
    }
    if (SHARED / "data" / "load.py").exists():
        spec = importlib.util.spec_from_file_location("load", SHARED / "data" / "load.py")
        load = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(load)
        frame = load.mosd("learn14")
        fx, fy, cx, cy = frame["K"]
        found["kinect"] = (frame["z"], np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]))
    return found


def staircase(width: int, height: int) -> np.ndarray:
    """Heights that grow ever faster: a quadratic misses them most at its end, and few pixels are cut off at a time."""
    return np.tile(np.exp(np.linspace(0, 20, width)).astype(np.float32), (height, 1))


def resized(depth: np.ndarray, width: int, height: int) -> np.ndarray:
    def places(count: int, wanted: int) -> np.ndarray:
        return np.pad(np.arange(count), (0, max(0, wanted - count)), "symmetric")[:wanted]

    return np.ascontiguousarray(depth[np.ix_(places(depth.shape[0], height), places(depth.shape[1], width))])


def millimetres(depth: np.ndarray) -> np.ndarray:
    return np.nan_to_num(depth * 1000).round().astype(np.uint16)


def ours(src: np.ndarray, K: np.ndarray) -> dict[str, Call]:
    """The stages, and the chain from depths to seeds."""
    noise = rangeedge.estimateNoise(src, K=K)
    calls = dict(stages(src, None, {"K": K}))
    calls["edgeStrength"] = partial(rangeedge.edgeStrength, src, K=K)
    for name, direction in DIRECTIONS.items():
        calls["  " + name] = partial(rangeedge.edgeStrength, src, K=K, noise=noise, directions=direction)
    calls["chain to seeds"] = partial(chain, src, K)
    calls["segmentRegions"] = partial(rangeedge.segmentRegions, src, K=K)
    return calls


def chain(src: np.ndarray, K: np.ndarray) -> Any:
    """Depths, thin edges, distance, salience distance, seeds."""
    jump, crease, _, _ = rangeedge.edgeStrength(src, K=K)
    thin = rangeedge.thinEdges(rangeedge.selectEdges(jump, crease, 0.0, CREASE))
    strength = rangeedge.overallStrength(jump, crease, 0.1)
    rangeedge.salienceDistanceTransform(np.where(thin, strength, 0).astype(np.uint8))
    return rangeedge.extractSeeds(rangeedge.distanceTransform(thin))


def peers(src: np.ndarray, depth: np.ndarray, K: np.ndarray) -> dict[str, Call]:
    """What OpenCV and scikit-image have for the same ends."""
    thick = cv2.dilate(rangeedge.detectEdges(src, K=K), np.ones((3, 3), np.uint8))
    free = cv2.bitwise_not(rangeedge.thinEdges(thick))
    distance = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    markers = rangeedge.extractSeeds(distance)[1]
    calls = {
        "cv2.distanceTransform": partial(cv2.distanceTransform, free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE),
        "skimage skeletonize": partial(skeletonize, thick > 0),
        "skimage watershed": partial(watershed, -distance, markers),
    }
    rows, cols = depth.shape
    if hasattr(cv2, "RgbdNormals_create"):  # OpenCV 5
        method = cv2.RgbdNormals_RGBD_NORMALS_METHOD_FALS
        normals = cv2.RgbdNormals_create(rows, cols, cv2.CV_32F, K, 7, 50.0, method)
        calls["cv2 FALS normals + angles"] = lambda: angles(normals.apply(cv2.depthTo3d(depth, K)))
    return calls


def angles(normals: np.ndarray) -> list[np.ndarray]:
    """Where opposite neighbours, two pixels away, differ by more than a crease."""
    ones, least = np.ones((1, normals.shape[2]), np.float32), np.cos(np.radians(CREASE))
    pairs = ((normals[:-4], normals[4:]), (normals[:, :-4], normals[:, 4:]))
    return [cv2.transform(cv2.multiply(a, b), ones) < least for a, b in pairs]


def worst_cases(width: int, height: int) -> dict[str, Call]:
    white = np.random.default_rng(0).normal(0, 1, (height, width)).astype(np.float32)
    return {
        "white noise, eps 1000 times finer": partial(rangeedge.edgeStrength, white, eps=1e-3, noise=1e-3),
        "few pixels at a time": partial(rangeedge.edgeStrength, staircase(width, height), eps=1e-6, noise=1e-6),
    }


def evaluations(depth: np.ndarray, K: np.ndarray) -> float:
    """Residuals per pixel that splitting evaluates, counted by splitting once more in NumPy."""
    model = rangeedge.estimateNoise(depth, K=K)
    with np.errstate(divide="ignore", invalid="ignore"):
        q = 1 / depth
    scale = 1 / (rangeedge.ScanLineParams().epsFactor * model.correlation * model(depth) * q * q)
    mirrored, tilted = q[:, ::-1], scale[:, ::-1]
    total = sum(_evaluations_of_lines(zip(a, b, strict=True)) for a, b in ((q, scale), (q.T, scale.T)))
    for image, scales in ((q, scale), (mirrored, tilted)):
        offsets = range(1 - len(q), q.shape[1])
        total += _evaluations_of_lines((image.diagonal(k), scales.diagonal(k)) for k in offsets)
    return total / depth.size


def _evaluations_of_lines(lines: Any) -> int:
    total = 0
    for y, scale in lines:
        borders = np.flatnonzero(np.diff(np.isfinite(y).astype(np.int8), prepend=0, append=0))
        pending = list(zip(borders[::2], borders[1::2] - 1, strict=True))
        while pending:
            first, last = pending.pop()
            if last - first < 3:
                continue
            total += last - first - 1
            m = (first + last) // 2
            left, right = (y[m] - y[first]) / (m - first), (y[last] - y[m]) / (last - m)
            a = (right - left) / (last - first)
            t = np.arange(first + 1 - m, last - m)
            inner = slice(first + 1, last)
            residuals = np.abs(y[inner] - (y[m] + t * (left + a * (m - first) + a * t))) * scale[inner]
            k = first + 1 + int(np.argmax(residuals))
            if residuals[k - first - 1] > 1:
                cut = k if abs(y[k] - y[k - 1]) <= abs(y[k + 1] - y[k]) else k - 1
                pending += [(first, cut), (cut + 1, last)]
    return total


def peak_bytes_per_pixel(width: int, height: int) -> float:
    """Of `edgeStrength` on float32 depths with a camera, beyond its input and outputs, in a process of its own.

    The kernel's own count of this process: that of `resource` starts with the memory of the parent.
    """
    code = (
        "import re, sys, numpy as np, rangeedge\n"
        "def peak():\n"
        "    return 1024 * int(re.search(r'VmHWM:\\s+(\\d+) kB', open('/proc/self/status').read())[1])\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from benchmark import frames, resized\n"
        "depth, K = frames()['rendered']\n"
        "rangeedge.edgeStrength(depth, K=K)\n"
        f"depth = resized(depth, {width}, {height})\n"
        "before = peak()\n"
        "kept = rangeedge.edgeStrength(depth, K=K)\n"
        "print((peak() - before) / depth.size - 13)\n"
    )
    return float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)


def measured(depth: np.ndarray, K: np.ndarray, dtype: str, threads: int, repeat: int) -> dict[str, dict[str, float]]:
    cv2.setNumThreads(threads)
    src = depth if dtype == "float32" else millimetres(depth)
    clock = time.process_time if threads == 1 else time.perf_counter  # the former where nothing runs at the same time
    return timed({**ours(src, K), **peers(src, depth, K)}, repeat, clock)


def show(title: str, times: dict[str, dict[str, float]], pixels: int) -> None:
    canny = times["cv2.Canny"]
    print(f"\n{title}\n{'milliseconds':28}{'min':>10}{'median':>10}{'ns/pixel':>10}{'x Canny':>9}")
    for name, t in times.items():
        per_pixel, ratio = 1e6 * t["min"] / pixels, t["median"] / canny["median"]
        print(f"{name:28}{t['min']:10.2f}{t['median']:10.2f}{per_pixel:10.1f}{ratio:9.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", default="640x480,1280x720,1920x1080,4096x4096")
    parser.add_argument("--dtypes", default="float32,uint16")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--repeat", type=int, default=10)
    parser.add_argument("--out", help="a JSON file")
    args = parser.parse_args()
    results = []
    for size in args.sizes.split(","):
        width, height = map(int, size.split("x"))
        repeat = max(1, min(args.repeat, args.repeat * 1920 * 1080 // (width * height)))
        for name, (depth, K) in frames().items():
            image = resized(depth, width, height)
            for dtype in args.dtypes.split(","):
                for threads in map(int, args.threads.split(",")):
                    times = measured(image, K, dtype, threads, repeat)
                    show(f"{name}, {size}, {dtype}, {threads} threads", times, width * height)
                    results.append(
                        {"frame": name, "size": size, "dtype": dtype, "threads": threads, "milliseconds": times}
                    )
    cv2.setNumThreads(1)
    for name, (depth, K) in frames().items():
        per_pixel = evaluations(depth, K)
        noise = rangeedge.estimateNoise(depth, K=K)
        t = timed(
            {"edgeStrength": partial(rangeedge.edgeStrength, depth, K=K, noise=noise)}, args.repeat, time.process_time
        )
        each = 1e6 * t["edgeStrength"]["min"] / (per_pixel * depth.size)
        print(f"\n{name}: {per_pixel:.1f} residuals per pixel, {each:.2f} ns of edgeStrength each")
        results.append({"frame": name, "evaluations": per_pixel, "nanoseconds": each})
    worst = timed(worst_cases(640, 480), 1, time.process_time)
    for name, t in worst.items():
        print(f"{name}, 640x480, 1 thread: {t['min']:.0f} ms")
    memory = peak_bytes_per_pixel(4096, 4096)
    print(f"peak memory beyond input and outputs, 4096x4096: {memory:.1f} bytes per pixel")
    results += [
        {"worst": worst},
        {"bytesPerPixel": memory, "maxrss": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss},
    ]
    if args.out:
        Path(args.out).write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
