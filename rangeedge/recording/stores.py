"""Where the results of frames go: a folder each, a file each, or chunks of a Zarr store. Each is there whole or not.

A store writes in the process that has found the results, and returns the files with their sizes, which tell later
whether they are still as they were.
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from .._check import error, public
from ..io.atomic import write_atomically
from .source import FrameSource, extra

Outputs = dict[str, int]
FORMS = ("folder", "npz", "png", "zarr")


@public
def write_file(root: Path, name: str, data: bytes) -> Outputs:
    """A file of a frame, in the folders that its name has."""
    path = root / name
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error(f"cannot write {os.fspath(path)!r}: {what}", cv2.Error.StsError) from reason
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
    zarr = extra("zarr", "zarr", "a Zarr store")
    frames = list(frames)
    try:
        group = zarr.open_group(str(root), mode="a")
        have = {name: group[name] for name in kinds if name in group}
        if not fresh and have.keys() == kinds.keys():
            for array in have.values():
                array.resize((len(frames), *array.shape[1:]))
            return
        size = _size(frames, given)
        if size is None:
            return
        for name, kind in kinds.items():
            group.create_array(
                name, shape=(len(frames), *size), chunks=(1, *size), dtype=np.dtype(kind), fill_value=0, overwrite=True
            )
        group.attrs["frames"] = [frame.name for frame in frames]
    except OSError as reason:
        raise error(f"cannot write to {str(root)!r}: {reason.strerror or reason}", cv2.Error.StsError) from reason


def _size(frames: Iterable[FrameSource], given: Mapping[str, Any]) -> tuple[int, int] | None:
    for frame in frames:
        try:
            return frame.read(**given).src.shape[:2]
        except Exception:  # its own turn says what is wrong with it
            continue
    return None


def write_chunks(root: Path, index: int, arrays: Mapping[str, np.ndarray]) -> Outputs:
    """The results of one frame, each a chunk."""
    zarr = extra("zarr", "zarr", "a Zarr store")
    outputs = {}
    with zarr.config.set({"array.write_empty_chunks": True}):  # what is there has been done
        group = zarr.open_group(str(root), mode="r+")
        for name, values in arrays.items():
            array = group[name]
            if values.shape != array.shape[1:]:
                rows, cols = array.shape[1:]
                raise error(
                    f"it has {values.shape[1]} x {values.shape[0]} pixels, the store has frames of {cols} x {rows}; "
                    "write frames of several sizes into a folder"
                )
            array[index] = values
            chunk = f"{name}/{array.metadata.encode_chunk_key((index, 0, 0))}"
            outputs[chunk] = (root / chunk).stat().st_size
    return outputs
