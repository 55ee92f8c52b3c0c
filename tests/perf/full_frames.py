"""The whole chain on full frames: `python tests/perf/full_frames.py [--threads 1,2] [--frames room,terrain] [--worst]`.

Every call on a frame takes turns with the others in one process, so that a busy machine slows all alike; numbers in
brackets are the ratio of medians to `cv2.distanceTransform` (DIST_MASK_PRECISE) of the same size, which are to be
compared between machines. With one thread, times are those the processor spent. Frames are generated, as cluttered as
real rooms are; real ones come on top where the data are installed.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

import rangeedge
from rangeedge.app.bench import timed

SHARED = Path(__file__).resolve().parents[3] / "shared"
CREASE = 30.0  # degrees


class Frame(NamedTuple):
    src: np.ndarray
    geometry: dict[str, Any]
    regions: bool = True  # whether surfaces can be seen on one image plane


def room(width: int, height: int) -> Frame:
    """Facets at all slants and depths before a wall, seen by a camera whose disparities are noisy and rounded."""
    rng = np.random.default_rng(width)
    focal = 0.82 * width
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    inverse = 1 / 4.0 + 0.00003 * (640 / width) * u
    for _ in range(120):
        size = rng.uniform(20, 120, 2) * width / 640
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        rows = slice(max(0, int(y - size[1] / 2)), int(y + size[1] / 2))
        cols = slice(max(0, int(x - size[0] / 2)), int(x + size[0] / 2))
        slope = rng.normal(0, 0.0006, 2) * 640 / width
        facet = 1 / rng.uniform(1, 3.8) + slope[0] * (u[rows, cols] - x) + slope[1] * (v[rows, cols] - y)
        inverse[rows, cols] = np.maximum(inverse[rows, cols], facet)
    disparity = 0.075 * focal * inverse + rng.normal(0, 0.08, inverse.shape)
    depth = 0.075 * focal / (np.round(8 * disparity) / 8)
    K = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    return Frame((1000 * depth).round().astype(np.uint16), {"K": K})


def terrain(side: int) -> Frame:
    """Smooth ground with houses whose roofs slope, as an elevation model of half a metre has it."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(side) / 100, np.arange(side) / 100)
    ground = 12 * np.sin(0.31 * x + 0.5) * np.cos(0.23 * y) + 3 * np.sin(1.7 * x) * np.sin(1.3 * y + 1)
    for _ in range(side * side // 6000):
        row, col = rng.integers(0, side - 50, 2)
        height, width = rng.integers(12, 48, 2)
        house = ground[row : row + height, col : col + width]
        slope = rng.uniform(0, 0.5) * np.abs(np.arange(height) - height / 2)
        house[...] = house.mean() + rng.uniform(4, 12) - slope[:, None]
    ground += rng.normal(0, 0.03, ground.shape)
    return Frame(ground.astype(np.float32), {"heightMap": True, "pixelSize": 0.5})


def lidar(rows: int, cols: int) -> Frame:
    """A scanner that turns in a hall with pillars: points all around."""
    rng = np.random.default_rng(0)
    azimuth = 2 * np.pi * np.arange(cols) / cols
    ranges = 12 / np.maximum(np.abs(np.cos(azimuth)), 1.5 * np.abs(np.sin(azimuth)))
    for centre, half, distance in zip(
        rng.uniform(0, 2 * np.pi, 30), rng.uniform(0.02, 0.08, 30), rng.uniform(3, 7, 30), strict=True
    ):
        off = np.abs((azimuth - centre + np.pi) % (2 * np.pi) - np.pi)
        ranges = np.where(off < half, np.minimum(ranges, distance), ranges)
    elevation = np.linspace(0.4, -0.4, rows)[:, None]
    floor = 1.8 / np.maximum(np.sin(-elevation), 1e-9)
    distance = np.minimum(ranges / np.cos(elevation), floor) + rng.normal(0, 0.01, (rows, cols))
    across = distance * np.cos(elevation)
    points = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), distance * np.sin(elevation)], axis=-1)
    return Frame(points.astype(np.float32), {}, regions=False)


def frames() -> dict[str, Callable[[], Frame]]:
    """Every frame by name."""
    found: dict[str, Callable[[], Frame]] = {
        "room 640x480": partial(room, 640, 480),
        "room 1280x720": partial(room, 1280, 720),
        "room 1920x1080": partial(room, 1920, 1080),
        "lidar 1024x128": partial(lidar, 128, 1024),
        "terrain 640x640": partial(terrain, 640),
        "terrain 2000x2000": partial(terrain, 2000),
    }
    if (SHARED / "data" / "load.py").exists():
        spec = importlib.util.spec_from_file_location("load", SHARED / "data" / "load.py")
        load = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(load)
        for name in ("tum_fr3", "7scenes_0", "sun_kinect2"):
            found[name] = partial(_with_camera, load.rgbd, name)
    return found


def _with_camera(read: Callable[[str], dict[str, Any]], name: str) -> Frame:
    frame = read(name)
    fx, fy, cx, cy = frame["K"]
    return Frame(frame["z"], {"K": np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])})


def calls(frame: Frame) -> dict[str, Callable[[], Any]]:
    src, geometry, regions = frame
    noise = rangeedge.estimateNoise(src, **geometry)
    edges, strength = rangeedge.detectEdgesWithStrength(src, noise=noise, **geometry)
    selected = rangeedge.selectEdges(strength)
    salience = np.where(edges, rangeedge.overallStrength(strength.jump, strength.crease, 0.1), 0).astype(np.uint8)
    distance = rangeedge.distanceTransform(edges)
    grey = cv2.normalize(strength.crease, None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    named = {
        "estimateNoise": partial(rangeedge.estimateNoise, src, **geometry),
        "edgeStrength, noise given": partial(rangeedge.edgeStrength, src, noise=noise, **geometry),
        "detectEdges": partial(rangeedge.detectEdges, src, **geometry),
        "thinEdges": partial(rangeedge.thinEdges, selected),
        "distanceTransform": partial(rangeedge.distanceTransform, edges),
        "salienceDistanceTransform": partial(rangeedge.salienceDistanceTransform, salience),
        "extractSeeds": partial(rangeedge.extractSeeds, distance),
        "depth to seeds": partial(chain, src, geometry),
        "cv2.distanceTransform PRECISE": partial(
            cv2.distanceTransform, cv2.bitwise_not(edges), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
        ),
        "cv2.Canny": partial(cv2.Canny, grey, 50, 100),
        "copy of the image": src.copy,
    }
    if regions:
        named["regions, edges given"] = partial(rangeedge.segmentRegions, src, edges=edges, noise=noise, **geometry)
        named["segmentRegions"] = partial(rangeedge.segmentRegions, src, **geometry)
    return named


def chain(src: np.ndarray, geometry: dict[str, Any]) -> Any:
    """Thin edges, distance, salience distance, seeds."""
    edges, strength = rangeedge.detectEdgesWithStrength(src, **geometry)
    overall = rangeedge.overallStrength(strength.jump, strength.crease, 0.1)
    rangeedge.salienceDistanceTransform(np.where(edges, overall, 0).astype(np.uint8))
    return rangeedge.extractSeeds(rangeedge.distanceTransform(edges))


def worst_cases(width: int, height: int) -> dict[str, Callable[[], Any]]:
    """What takes longest; "typical" is what to compare with."""
    rng = np.random.default_rng(0)
    v, u = np.indices((height, width))
    typical = room(width, height)
    white = rng.normal(0, 0.1, (height, width)).astype(np.float32)
    flat = white / 100 + 1
    comb = np.where(v % 8 == 0, 1, 0).astype(np.int32)
    teeth = (v % 8 >= 2) & (v % 8 < 6) & (u % 6 >= 2)
    comb[teeth] = (2 + v // 8 * (width // 6 + 1) + u // 6)[teeth]
    falling = np.where(u < width / 4, (width - u) / width, 0).astype(np.float32)
    radius = np.hypot(v - height / 2, u - width / 2)
    disc = np.where(radius > 0.3 * height, radius / radius.max(), 0).astype(np.float32)
    stairs = np.exp(np.linspace(0, 20, width))[None].repeat(height, 0).astype(np.float32)
    return {
        "typical segmentRegions": partial(rangeedge.segmentRegions, typical.src, **typical.geometry),
        "white noise, sigma told 1000 times too small": partial(rangeedge.segmentRegions, white, noise=1e-4),
        "alternating ramps": partial(rangeedge.segmentRegions, (-1.0) ** (u + v) * (1.0 + u + v), noise=1e-3),
        "a staircase": partial(rangeedge.segmentRegions, stairs, noise=1e-6),
        "a comb of markers": partial(rangeedge.growRegions, flat, comb, noise=1e-3),
        "thinEdges, all pixels edges": partial(rangeedge.thinEdges, np.ones((height, width), np.uint8)),
        "salience that falls steadily": partial(rangeedge.salienceDistanceTransform, falling),
        "salience around a disc": partial(rangeedge.salienceDistanceTransform, disc),
    }


def show(title: str, times: dict[str, dict[str, float]], pixels: int) -> None:
    unit = times["cv2.distanceTransform PRECISE"]["median"]
    print(f"\n{title}\n{'milliseconds':32}{'min':>9}{'median':>9}{'(PRECISE)':>11}{'ns/pixel':>10}")
    for name, t in times.items():
        ratio, per_pixel = f"({t['median'] / unit:.1f})", 1e6 * t["min"] / pixels
        print(f"{name:32}{t['min']:9.2f}{t['median']:9.2f}{ratio:>11}{per_pixel:10.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", default="", help="parts of names, separated by commas; all without")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--repeat", type=int, default=10)
    parser.add_argument("--worst", action="store_true", help="the worst cases instead, at 640x480 and 2000x2000")
    parser.add_argument("--out", help="a JSON file")
    args = parser.parse_args()
    results = []
    if args.worst:
        cv2.setNumThreads(1)
        for width, height in ((640, 480), (2000, 2000)):
            times = timed(worst_cases(width, height), 1, time.process_time)
            results.append({"frame": f"worst {width}x{height}", "milliseconds": times})
            print(f"\n{width}x{height}, 1 thread")
            for name, t in times.items():
                ratio = t["min"] / times["typical segmentRegions"]["min"]
                print(f"{name:48}{t['min']:9.1f} ms{ratio:8.1f} times typical")
    for name, make in {} if args.worst else frames().items():
        if not any(part in name for part in args.frames.split(",")):
            continue
        frame = make()
        pixels = frame.src.shape[0] * frame.src.shape[1]
        repeat = max(2, min(args.repeat, args.repeat * 640 * 480 * 4 // pixels))
        for threads in map(int, args.threads.split(",")):
            cv2.setNumThreads(threads)
            clock = time.process_time if threads == 1 else time.perf_counter
            times = timed(calls(frame), repeat, clock)
            show(f"{name}, {threads} threads", times, pixels)
            results.append({"frame": name, "threads": threads, "milliseconds": times})
    if args.out:
        Path(args.out).write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
