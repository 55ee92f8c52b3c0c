"""Arrays of NumPy, alone (NPY) or with the geometry (NPZ)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Collection
from typing import IO, Any

import numpy as np

from .._check import reals
from .range_image import RangeImage
from .source import FILE_LIMIT, expect_size, expect_unpacked

_SOURCES = ("src", "xyz", "points", "depth", "z")
_AT_A_TIME = 2**22  # bytes that are packed in one call
_GEOMETRY_BYTES = 4096  # more than any geometry takes


def read_npy(data: bytes) -> np.ndarray:
    """The array, by NumPy's reader of the header; object arrays, which would be unpickled, are refused."""
    stream = io.BytesIO(data)
    shape, fortran, dtype = read_header(stream)
    expect_size(len(data) - stream.tell(), int(np.prod(shape, dtype=object)) * dtype.itemsize)
    array = np.frombuffer(data, dtype, offset=stream.tell()).reshape(shape, order="F" if fortran else "C")
    return array if dtype.names is None else _points_of_records(array)


def read_header(stream: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, order (whether that of Fortran) and type of the array that follows."""
    headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(stream)  # type: ignore[arg-type]
    if version not in headers:
        raise ValueError(f"NPY version {version} holds no range image")
    shape, fortran, dtype = headers[version](stream)  # type: ignore[arg-type]
    if dtype.hasobject or min(shape, default=1) < 0:
        raise ValueError(f"an array of shape {shape} of {dtype} is no range image")
    return shape, fortran, dtype


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
        member, geometry = source_of(archive, len(data))
        return RangeImage(_member(archive, member, FILE_LIMIT), geometry)


def source_of(archive: zipfile.ZipFile, size: int) -> tuple[zipfile.ZipInfo, dict[str, Any]]:
    """Which member of an NPZ file of `size` bytes is the range image, and the geometry beside it."""
    members = _members(archive)
    geometry = {key: members.pop(key) for key in _GEOMETRY if key in members}
    src = members[source_name(members)]
    expect_unpacked(src.file_size, size)
    return src, {key: _GEOMETRY[key](_member(archive, member, _GEOMETRY_BYTES)) for key, member in geometry.items()}


def source_name(names: Collection[str]) -> str:
    """The name of the array that is the range image, of those that are no geometry."""
    named = [key for key in _SOURCES if key in names]
    if not named and len(names) != 1:
        raise ValueError(f"none of its arrays ({', '.join(names)}) is named {', '.join(_SOURCES)}")
    return named[0] if named else next(iter(names))


def arrays_of_npz(data: bytes, limit: int) -> dict[str, np.ndarray]:
    """All arrays of at most `limit` bytes each."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: _member(archive, member, limit) for name, member in _members(archive).items()}


def _members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The arrays of an archive by their names."""
    return {m.filename.removesuffix(".npy"): m for m in archive.infolist() if m.filename.endswith(".npy")}


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, limit: int) -> np.ndarray:
    if member.file_size > limit:
        raise ValueError(f"{member.filename} has {member.file_size} bytes, more than the {limit} that are read of it")
    with archive.open(member) as packed:
        return read_npy(packed.read(member.file_size))


# What an array in an NPZ file stands for.
_GEOMETRY: dict[str, Callable[[np.ndarray], Any]] = {
    "K": reals,
    "distCoeffs": reals,
    "pixelSize": lambda value: tuple(np.broadcast_to(reals(value), 2).tolist()),
    "heightMap": lambda value: bool(value.item()),
    "depthFactor": lambda value: float(reals(value).item()),
}


def write_npz(src: np.ndarray, **geometry: Any) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in {"src": src, **geometry}.items():
            data = memoryview(write_npy(np.asanyarray(value)))
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                for start in range(0, len(data), _AT_A_TIME):
                    member.write(data[start : start + _AT_A_TIME])
    return stream.getvalue()
