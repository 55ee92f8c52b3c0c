"""Frames that are files of a folder: plain ones, and sequences of the TUM RGB-D benchmark."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import Any

from .._check import error
from ..io import imreadRange
from ..io.camera import read_camera
from .source import FrameSource

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
    """The depth images that ``depth.txt`` names: lines of a time and a file, in their order."""
    frames = []
    geometry: dict[str, Any] = {"depthFactor": _TUM_FACTOR, **_camera(folder)}
    if "K" not in geometry and "freiburg" in folder.resolve().name:
        geometry["K"] = _TUM_CAMERA
    for number, line in enumerate((folder / "depth.txt").read_text("utf-8", "replace").splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = line.split()
        if len(words) != 2:
            raise error(f"cannot read '{folder / 'depth.txt'}': line {number} is {line[:60]!r}, no time and file")
        name = f"{folder.resolve().name}/{Path(words[1]).stem}"
        frames.append(file_frame(str(folder / words[1]), name, geometry))
    return frames


def folder_files(folder: Path) -> tuple[list[Path], dict[str, Any]]:
    """The files of a folder that may be range images, by their suffix and in the order of their names; its camera."""
    files = [path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES and not path.name.startswith(".")]
    return sorted(files, key=_natural), _camera(folder)


def _natural(path: Path) -> list[tuple[int, int, str]]:
    """A key by which frame 10 comes after frame 9."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", path.name) if part]


def _camera(folder: Path) -> dict[str, Any]:
    """The camera that a file of a usual name in the folder describes."""
    for path in (folder / (stem + suffix) for stem in _CAMERAS for suffix in _CAMERA_SUFFIXES):
        if path.is_file():
            try:
                camera = read_camera(path)
            except (ValueError, OSError) as reason:
                raise error(f"cannot read the camera {str(path)!r} of a folder: {reason}; give -K") from None
            found = {"K": camera.K, "distCoeffs": camera.distCoeffs}
            return {name: value for name, value in found.items() if value is not None}
    return {}
