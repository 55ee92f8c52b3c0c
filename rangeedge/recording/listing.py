"""What the inputs of a batch hold, frame by frame, each under a name of its own."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from .._check import described, error, fail, public
from ..io.source import file_name
from .bags import bag_frames, is_bag
from .manifest import MANIFEST
from .sequences import file_frame, folder_files, is_tum, seen_by, tum_frames
from .source import FrameSource, Unreadable
from .stacks import is_zarr, stack_frames


@public
def framesOf(
    inputs: str | os.PathLike[str] | FrameSource | Iterable[str | os.PathLike[str] | FrameSource],
    *,
    topics: Iterable[str] = (),
    calibration: int | None = None,
) -> list[FrameSource]:
    """List the frames of recordings, without reading them.

    framesOf(inputs, *[, topics[, calibration]]) -> frames

    Parameters
    ----------
    inputs : path, or iterable of paths
        Each is one of: a file that `imreadRange` takes; a pattern such as ``frames/*.png``; a folder of such files, in
        the order of the numbers in their names; NPY, NPZ or Zarr of shape (N, H, W), or (N, H, W, 3) of points; a TIFF
        of many pages; a sequence of the TUM RGB-D benchmark, a folder with ``depth.txt``; with the extra ``[bags]`` a
        bag of ROS 1 or 2 or an MCAP file, with depth images (16UC1, 32FC1, compressedDepth) or organized PointCloud2.
        Frames that have been listed are taken as they are: ``framesOf("walk.bag")[::10]``.
    topics : iterable of str
        Those of a bag that are taken; by default all with depths, one a camera.
    calibration : {1, 2}, optional
        Of an ABW scanner, as for `imreadRange`.

    Returns
    -------
    frames : list of FrameSource
        Their ``name`` is unique: of files that share theirs it keeps the folders, and if need be the suffix. ``read()``
        returns the range image, with the camera of the recording where it has one: of ``camera_info`` beside a topic;
        of a file ``camera.yaml``, ``intrinsics.json`` or the like beside images; of the attributes of a Zarr store.
        A file that is missing or garbled is a frame too, whose ``read()`` fails; of a recording that cannot be listed,
        there is one such frame.

    Raises
    ------
    rangeedge.error
        A file is given twice, a pattern or a folder holds nothing, a topic is missing, or a package is.

    Examples
    --------
    >>> import os
    >>> import tempfile
    >>> import numpy as np
    >>> from rangeedge.batch import framesOf
    >>> path = os.path.join(tempfile.mkdtemp(), "walk.npy")
    >>> np.save(path, np.full((3, 48, 64), 1500, np.uint16))
    >>> [frame.name for frame in framesOf(path)]
    ['walk/0000', 'walk/0001', 'walk/0002']
    >>> framesOf(path)[1].read().src.shape
    (48, 64)
    """
    if isinstance(inputs, (str, os.PathLike, FrameSource)):
        inputs = [inputs]
    if isinstance(inputs, bytes) or not isinstance(inputs, Iterable):
        raise fail("inputs", "a path or an iterable of paths", described(inputs))
    names = tuple(topics) if isinstance(topics, Iterable) and not isinstance(topics, (str, bytes)) else (None,)
    if not all(isinstance(name, str) for name in names):
        raise fail("topics", "an iterable of the names of topics", described(topics))
    topics = tuple(map(str, names))
    options: dict[str, Any] = {} if calibration is None else {"calibration": calibration}
    frames = [
        frame
        for given in inputs
        for frame in ([given] if isinstance(given, FrameSource) else _listed(given, topics, options))
    ]
    if topics and not any(is_bag(Path(frame.path)) for frame in frames):
        raise error(f"`topics` = {', '.join(topics)}, but no input is a bag or MCAP file")
    return _named_apart(frames)


def _listed(given: str | os.PathLike[str], topics: tuple[str, ...], options: dict[str, Any]) -> list[FrameSource]:
    return [frame for path in _expanded(file_name(given, "inputs")) for frame in _frames(path, topics, options)]


def _expanded(path: str) -> list[str]:
    """The files that a pattern stands for; a file of just that name comes first."""
    if not any(mark in path for mark in "*?[") or os.path.lexists(path):
        return [path]
    found = sorted(glob.glob(path, recursive=True))
    if not found:
        raise error(f"no file fits the pattern {path!r}")
    return found


def _frames(path: str, topics: tuple[str, ...], options: dict[str, Any]) -> list[FrameSource]:
    where = Path(path)
    if not path or not where.exists():
        return [file_frame(path, _stem(path), **options)]
    bag = is_bag(where)
    if where.is_dir() and not (bag or is_tum(where) or is_zarr(path)):
        return _of_folder(where, topics, options)
    try:
        found = bag_frames(path, topics) if bag else tum_frames(where) if is_tum(where) else stack_frames(path)
    except (error, ValueError, OSError) as problem:
        if isinstance(problem, error) and isinstance(problem.__cause__, ImportError):
            raise
        if topics and bag:
            raise
        reason = problem.err if isinstance(problem, error) else f"cannot read {path!r}: {problem}"
        return [FrameSource(_stem(path), path, "", Unreadable(reason))]
    return found or [file_frame(path, _stem(path), **options)]


def _of_folder(folder: Path, topics: tuple[str, ...], options: dict[str, Any]) -> list[FrameSource]:
    found = [frame for path in folder_files(folder) for frame in _frames(str(path), topics, options)]
    if not found:
        deeper = any(path.is_dir() for path in folder.iterdir())
        way = f"; of the folders in it, give those with images, or the pattern {str(folder / '**' / '*.png')!r}"
        raise error(f"the folder {str(folder)!r} holds no range images{way if deeper else ''}")
    return seen_by(found, folder)


def _stem(path: str) -> str:
    """The name of a file without its suffix; with it where only dots would be left, which lead out of the folder."""
    name = Path(path).name
    if not name.strip("."):
        raise fail("inputs", "names of files", repr(path))
    stem = Path(name).stem
    return stem if stem.strip(".") else name


def _named_apart(frames: list[FrameSource]) -> list[FrameSource]:
    """Frames of unique names: those that collide keep their suffix, then as much of their folder as it takes.

    The name of one is not that of the folder of others either, whose results would be among its own, nor that of the
    manifest.
    """
    paths = [_absolute(frame.path) for frame in frames]
    places = Counter((path, frame.part) for path, frame in zip(paths, frames, strict=True))
    twice = next((path for (path, _), count in places.items() if count > 1), None)
    if twice is not None:
        raise error(f"{twice!r} is given twice")
    folders = [Path(path).parent.parts[1:] for path in paths]
    beside = Counter((folder, frame.name) for folder, frame in zip(folders, frames, strict=True))
    above = {"/".join(parts[:end]) for parts in (f.name.split("/") for f in frames) for end in range(1, len(parts))}
    above.add(MANIFEST)
    short = [
        _with_suffix(frame) if beside[folder, frame.name] > 1 or frame.name in above else frame.name
        for folder, frame in zip(folders, frames, strict=True)
    ]
    names = short
    for deep in range(1, max(map(len, folders), default=0) + 1):
        shared = {name for name, count in Counter(names).items() if count > 1}
        if not shared:
            break
        names = [
            "/".join((*folder[-deep:], own)) if name in shared else name
            for folder, own, name in zip(folders, short, names, strict=True)
        ]
    for frame, name in zip(frames, names, strict=True):
        if not all(part.strip(".") for part in name.split("/")):
            raise error(f"{frame.title!r} has no name for a file of its results: {name!r}")
    return [replace(frame, name=name) for frame, name in zip(frames, names, strict=True)]


def _absolute(path: str) -> str:
    try:
        return os.path.abspath(path)
    except OSError as reason:  # the current folder has been removed
        raise error(f"cannot read {path!r}: {reason.strerror}") from reason


def _with_suffix(frame: FrameSource) -> str:
    return Path(frame.path).name + frame.name.removeprefix(Path(frame.path).stem)
