"""Where the results of frames go: a folder each, a file each, or chunks of a Zarr store. Each is there whole or not.

A store writes in the process that has found the results, and returns the files with their sizes, which tell later
whether they are still as they were.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._check import error, public
from ..io.atomic import write_atomically, writing
from ..io.tiff import Window
from .source import FrameSource, extra

Outputs = dict[str, int]
Shape = tuple[int, ...]
FORMS = ("folder", "npz", "png", "zarr")


@public
def write_file(root: Path, name: str, data: bytes) -> Outputs:
    """A file of a frame, in the folders that its name has."""
    path = root / name
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)
    return {name: len(data)}


def packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Arrays as an NPZ file, which does not depend on when it is written."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, values in arrays.items():
            member = io.BytesIO()
            np.save(member, values, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def prepare_zarr(
    root: Path, kinds: Mapping[str, str], frames: Iterable[FrameSource], given: Mapping[str, Any], fresh: bool
) -> None:
    """Make room in a store for frames of the size that the first readable one has: an array (N, H, W) a result."""
    frames = list(frames)
    size = None if fresh else _size_of_store(root, kinds)
    size = size or _size(frames, given)
    if size is not None:
        shape, chunk = (len(frames), *size), (1, *size)
        prepare_arrays(root, {name: (kind, shape, chunk) for name, kind in kinds.items()}, fresh)


def _size_of_store(root: Path, kinds: Iterable[str]) -> tuple[int, int] | None:
    arrays = open_arrays(root, "a")
    sizes = {arrays[name].shape[1:] for name in kinds if name in arrays}
    return sizes.pop() if len(sizes) == 1 else None


def _size(frames: Iterable[FrameSource], given: Mapping[str, Any]) -> tuple[int, int] | None:
    """The size of the frames, the first that two of them have: one that is of another size must not come first."""
    seen: list[tuple[int, int]] = []
    for frame in frames:
        try:
            rows, cols = frame.read(**given).src.shape[:2]
        except Exception:  # its own turn says what is wrong with it
            continue
        if (rows, cols) in seen:
            return rows, cols
        seen.append((rows, cols))
    return seen[0] if seen else None


def open_arrays(root: Path, mode: str = "r+") -> Any:
    """The arrays of a store by their names."""
    return extra("zarr", "zarr", "a Zarr store").open_group(str(root), mode=mode)


def prepare_arrays(root: Path, arrays: Mapping[str, tuple[str, Shape, Shape]], fresh: bool) -> None:
    """Make room in a store, for arrays of a type, a shape and chunks; what is there stays where it is not `fresh`."""
    with writing(root, "cannot write to"):
        group = open_arrays(root, "a")
        for name, (kind, shape, chunks) in arrays.items():
            if fresh or name not in group:
                group.create_array(name, shape=shape, chunks=chunks, dtype=kind, fill_value=0, overwrite=True)
            else:
                group[name].resize(shape)


def write_chunks(root: Path, index: int, arrays: Mapping[str, np.ndarray]) -> Outputs:
    """The results of one frame, each a chunk."""
    group = open_arrays(root)
    for name, values in arrays.items():
        rows, cols = group[name].shape[1:]
        if values.shape != (rows, cols):
            raise error(
                f"it has {values.shape[1]} x {values.shape[0]} pixels, the store has frames of {cols} x {rows}; "
                "write frames of several sizes into a folder"
            )
    return _written(root, group, arrays, (index,), (index, 0, 0))


def write_region(root: Path, arrays: Mapping[str, np.ndarray], window: Window, place: tuple[int, int]) -> Outputs:
    """The results of one block, each the chunk at a row and column."""
    top, left, bottom, right = window
    return _written(root, open_arrays(root), arrays, (slice(top, bottom), slice(left, right)), place)


def _written(root: Path, group: Any, arrays: Mapping[str, np.ndarray], where: Any, place: Shape) -> Outputs:
    outputs = {}
    with extra("zarr", "zarr", "a Zarr store").config.set({"array.write_empty_chunks": True}):
        for name, values in arrays.items():
            group[name][where] = values
            chunk = f"{name}/{group[name].metadata.encode_chunk_key(place)}"
            outputs[chunk] = (root / chunk).stat().st_size
    return outputs
