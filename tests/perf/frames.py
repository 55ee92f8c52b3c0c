"""The range images that are timed: generated ones, and real ones where the data are installed."""

from __future__ import annotations

import importlib.util
import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

SHARED = Path(os.environ.get("RANGEEDGE_SHARED", Path(__file__).resolve().parents[3] / "shared"))

# Real frames by name: of the first collection, read by its own loader, and of the second, described by a JSON file.
FIRST = {"table": "learn14", "tum_fr3": "tum_fr3", "7scenes_0": "7scenes_0", "sun_kinect2": "sun_kinect2"}
SECOND = {
    "D435 1280x720": "cleargrasp_d435/080_opaque.json",
    "RealSense 1920x1080": "robotdemo_hd/0.json",
    "Ouster 128x1024, points": "ouster/OS-0-128_xyz.json",
}


class Frame(NamedTuple):
    src: np.ndarray
    geometry: dict[str, Any]
    regions: bool = True  # whether surfaces can be seen on one image plane

    @property
    def pixels(self) -> int:
        return self.src.shape[0] * self.src.shape[1]


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


def mirrored(frame: Frame, width: int, height: int) -> Frame:
    """The frame repeated mirrored to a size, so that the content of a pixel stays the same."""

    def places(count: int, wanted: int) -> np.ndarray:
        return np.pad(np.arange(count), (0, max(0, wanted - count)), "symmetric")[:wanted]

    rows, cols = frame.src.shape[:2]
    src = np.ascontiguousarray(frame.src[np.ix_(places(rows, height), places(cols, width))])
    return frame._replace(src=src)


def frames() -> dict[str, Callable[[], Frame]]:
    """Every frame by name, the real ones first; says which are missing."""
    found: dict[str, Callable[[], Frame]] = {}
    for name, what in FIRST.items():
        found[name] = partial(_of_first, what)
    for name, what in SECOND.items():
        found[name] = partial(_of_second, SHARED / "data2" / what)
    needed = {name: SHARED / "data" / "load.py" for name in FIRST}
    needed |= {name: SHARED / "data2" / what for name, what in SECOND.items()}
    for name, path in needed.items():
        if not path.exists():
            print(f"{name} is left out: no {path}; RANGEEDGE_SHARED may name the folder of the data")
            del found[name]
    return found | {
        "room 640x480": partial(room, 640, 480),
        "room 1920x1080": partial(room, 1920, 1080),
        "lidar 128x1024, points": partial(lidar, 128, 1024),
        "terrain 2000x2000": partial(terrain, 2000),
    }


def _of_first(name: str) -> Frame:
    spec = importlib.util.spec_from_file_location("load", SHARED / "data" / "load.py")
    load = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(load)
    frame = load.mosd(name) if name.startswith("learn") else load.rgbd(name)
    fx, fy, cx, cy = frame["K"]
    return Frame(frame["z"], {"K": np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])})


def _of_second(path: Path) -> Frame:
    about = json.loads(path.read_text())
    file = path.parent / about["file"]
    src = np.load(file) if file.suffix == ".npy" else cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    if src.dtype == np.float16:
        src = src.astype(np.float32)
    geometry: dict[str, Any] = {}
    if about.get("K"):
        geometry["K"] = np.array(about["K"])
    if src.dtype.kind == "u":
        geometry["depthFactor"] = about.get("depthFactor") or 1000.0
    return Frame(src, geometry, regions=src.ndim == 2)
