"""Frames that are files of a folder: plain ones, and sequences of the TUM RGB-D benchmark."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from .._check import error
from ..io import imreadRange
from ..io.camera import read_camera
from .source import FrameSource, places

_SUFFIXES = {
    *(".png", ".pgm", ".tif", ".tiff", ".exr", ".pfm", ".npy", ".npz", ".zarr", ".pcd", ".ply", ".asc"),
    *(".bag", ".mcap", ".rs", ".sun", ".ras", ".perc"),
}
_CAMERAS = ("camera_info", "camera", "depth_camera", "intrinsics", "camera_intrinsic", "calibration")
_CAMERA_SUFFIXES = (".yaml", ".yml", ".json", ".xml", ".txt")

# https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats: integers of a fifth of a millimetre; the depths are
# registered by the factory's calibration, for which the camera of ROS' driver stands.
_TUM_FACTOR = 5000.0
_TUM_CAMERA = (525.0, 525.0, 319.5, 239.5)


def file_frame(path: str, name: str, geometry: dict[str, Any] | None = None, **options: Any) -> FrameSource:
    """A range image in a file of its own."""
    load = functools.partial(imreadRange, path, **options)
    return FrameSource(name, path, "", load, geometry or {})


def is_tum(folder: Path) -> bool:
    """Whether a folder is a sequence of the TUM RGB-D benchmark."""
    return (folder / "depth.txt").is_file()


def tum_frames(folder: Path) -> list[FrameSource]:
    """The depth images that ``depth.txt`` names: lines of a time and a file, in their order; each once."""
    files: dict[str, None] = {}
    for number, line in enumerate((folder / "depth.txt").read_text("utf-8-sig", "replace").splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = line.split()
        if len(words) != 2 or "\0" in line:
            raise error(f"cannot read '{folder / 'depth.txt'}': line {number} is {line[:60]!r}, no time and file")
        files[words[1]] = None
    if not files:
        raise error(f"'{folder / 'depth.txt'}' names no images")
    place = folder.resolve().name
    known = {"depthFactor": _TUM_FACTOR}
    frames = [file_frame(str(folder / name), f"{place}/{Path(name).stem}", known) for name in files]
    usual = {"K": _TUM_CAMERA} if "freiburg" in place else {}
    return seen_by(frames, folder, usual)


def folder_files(folder: Path) -> list[Path]:
    """The files of a folder that may be range images, by their suffix and in the order of their names."""
    files = [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES and not path.name.startswith(".")]
    return sorted(files, key=_natural)


def _natural(path: Path) -> list[tuple[int, int, str]]:
    """A key by which frame 10 comes after frame 9."""
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in re.split(r"(\d+)", path.name) if part]


def seen_by(
    frames: list[FrameSource], folder: Path, usual: Mapping[str, Any] = MappingProxyType({})
) -> list[FrameSource]:
    """Frames with the camera of a file of a common name in the folder, or the usual one, where they have none."""
    known, obstacle = usual, ""
    named = (folder / (stem + suffix) for stem in _CAMERAS for suffix in _CAMERA_SUFFIXES)
    path = next((path for path in named if path.is_file()), None)
    if path is not None:
        try:
            camera = read_camera(path)
            found = {"K": camera.K, "distCoeffs": camera.distCoeffs, "imageSize": camera.size}
            known = {name: value for name, value in found.items() if value is not None}
        except (ValueError, OSError) as reason:
            obstacle = f"the camera of its folder cannot be used: {getattr(reason, 'err', reason)}; or give -K"
    return [
        frame
        if places(frame.geometry)
        else replace(frame, geometry={**frame.geometry, **known}, obstacle=frame.obstacle or obstacle)
        for frame in frames
    ]
