"""Arrays of NumPy, alone (NPY) or with the geometry (NPZ)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

from .range_image import RangeImage
from .source import expect_size, expect_unpacked

_SOURCES = ("src", "xyz", "points", "depth", "z")
_GEOMETRY_BYTES = 4096  # more than any geometry takes


def read_npy(data: bytes) -> np.ndarray:
    """The array, by NumPy's reader of the header; object arrays, which would be unpickled, are refused."""
    stream = io.BytesIO(data)
    headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(stream)
    if version not in headers:
        raise ValueError(f"NPY version {version} holds no range image")
    shape, fortran, dtype = headers[version](stream)
    if dtype.hasobject or min(shape, default=1) < 0:
        raise ValueError(f"an array of shape {shape} of {dtype} is no range image")
    expect_size(len(data) - stream.tell(), int(np.prod(shape, dtype=object)) * dtype.itemsize)
    array = np.frombuffer(data, dtype, offset=stream.tell()).reshape(shape, order="F" if fortran else "C")
    return array if dtype.names is None else _points_of_records(array)


def _points_of_records(records: np.ndarray) -> np.ndarray:
    """Points of a structured array with fields x, y and z, as ROS' PointCloud2 gives it."""
    names = {name.lower(): name for name in records.dtype.names or ()}
    if not {"x", "y", "z"} <= names.keys() or records.ndim != 2:
        fields = ", ".join(records.dtype.names or ())
        raise ValueError(f"records ({fields}) of shape {records.shape} are no range image: x, y and z in (H, W) are")
    points = np.stack([records[names[axis]] for axis in "xyz"], axis=-1)
    return points if points.dtype.kind == "f" else points.astype(np.float64)


def write_npy(src: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, src, allow_pickle=False)
    return stream.getvalue()


def read_npz(data: bytes) -> RangeImage:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        arrays = {name.removesuffix(".npy"): name for name in archive.namelist() if name.endswith(".npy")}
        geometry = {key: arrays.pop(key) for key in _GEOMETRY if key in arrays}
        found = [key for key in _SOURCES if key in arrays] or list(arrays)
        if not found or (len(arrays) > 1 and found == list(arrays) and found[0] not in _SOURCES):
            raise ValueError(f"none of its arrays ({', '.join(arrays)}) is named {', '.join(_SOURCES)}")

        def member(name: str) -> np.ndarray:
            with archive.open(name) as packed:
                return read_npy(packed.read(archive.getinfo(name).file_size))

        for name in geometry.values():
            if archive.getinfo(name).file_size > _GEOMETRY_BYTES:
                raise ValueError(f"{name} has {archive.getinfo(name).file_size} bytes, no geometry")
        expect_unpacked(archive.getinfo(arrays[found[0]]).file_size, len(data))
        return RangeImage(
            member(arrays[found[0]]), {key: _GEOMETRY[key](member(name)) for key, name in geometry.items()}
        )


# What an array in an NPZ file stands for.
_GEOMETRY: dict[str, Callable[[np.ndarray], Any]] = {
    "K": lambda value: np.array(value, dtype=np.float64),
    "pixelSize": lambda value: tuple(np.broadcast_to(value.astype(np.float64), 2).tolist()),
    "heightMap": lambda value: bool(value.item()),
    "depthFactor": lambda value: float(value.item()),
}


def write_npz(src: np.ndarray, **geometry: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, src=src, **geometry)
    return stream.getvalue()
