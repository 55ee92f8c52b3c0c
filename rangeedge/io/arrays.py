"""Arrays of NumPy, alone (NPY) or with the geometry (NPZ)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

from .values import expect


def read_npy(data: bytes) -> np.ndarray:
    """The array, by NumPy's reader of the header; object arrays, which would be unpickled, are refused."""
    stream = io.BytesIO(data)
    headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(stream)
    if version not in headers:
        raise ValueError(f"NPY version {version} holds no range image")
    shape, fortran, dtype = headers[version](stream)
    if dtype.hasobject or dtype.names is not None or min(shape, default=1) < 0:
        raise ValueError(f"an array of shape {shape} of {dtype} is no range image")
    expect(len(data) - stream.tell(), int(np.prod(shape, dtype=object)) * dtype.itemsize)
    flat = np.frombuffer(data, dtype, offset=stream.tell())
    return flat.reshape(shape, order="F" if fortran else "C")


def write_npy(src: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, src, allow_pickle=False)
    return stream.getvalue()


def read_npz(data: bytes) -> tuple[np.ndarray, dict[str, Any]]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        arrays = {name.removesuffix(".npy"): name for name in archive.namelist() if name.endswith(".npy")}
        geometry = {key: arrays.pop(key) for key in _GEOMETRY if key in arrays}
        found = [key for key in ("src", "xyz", "points", "depth", "z") if key in arrays] or list(arrays)
        if not found or (len(arrays) > 1 and found == list(arrays)):
            raise ValueError(f"none of its arrays ({', '.join(arrays)}) is named src, xyz, points, depth or z")
        src = read_npy(archive.read(arrays[found[0]]))
        return src, {key: _GEOMETRY[key](read_npy(archive.read(m))) for key, m in geometry.items()}


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
