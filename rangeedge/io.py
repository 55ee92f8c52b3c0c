"""Range images and their geometry from and to files."""

from __future__ import annotations

import io
import os
import re
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from . import _args, pointcloud
from ._files import write_atomically
from .geometry import range_frame
from .scanners import SCANNER_SIZE, abwPoints, perceptronPoints

ABW_CALIBRATION_1 = frozenset({0, 19, 21, 25, 27, 28, 29})  # abw.test.N of the first calibration
_ABW_MAGIC = b"\x59\xa6\x6a\x95"  # Sun rasterfile


class RangeImage(NamedTuple):
    """A range image as the detector takes it: ``edgeStrength(image.src, **image.geometry)``.

    `geometry` holds those of `K`, `pixelSize`, `heightMap` and `depthFactor` that the file knows.
    """

    src: np.ndarray
    geometry: dict[str, Any]


def imreadRange(path: str | os.PathLike[str], *, calibration: int | None = None) -> RangeImage:
    """Read a range image and what its file says about its geometry.

    imreadRange(path, *[, calibration]) -> image

    The content of the file decides on the format:

    - PNG, TIFF, PGM, EXR (by OpenCV, EXR where it was built with it): one channel, 16-bit or float;
    - PFM: the values as stored, whatever the scale in its header;
    - NPY, and NPZ with an array ``src``, ``xyz``, ``points``, ``depth`` or ``z`` (or only one array) and perhaps the
      geometry under the names of the keywords;
    - PCD 0.7 (ascii, binary, compressed) and PLY (ascii, binary), organized: the points in the axes of the file. In
      Stanford's scans z grows toward the scanner, which is ``heightMap=True``;
    - ABW, a Sun rasterfile: points by `abwPoints`;
    - Perceptron: points by `perceptronPoints`;
    - Technical Arts (Michigan), ASCII: points in the axes of the file, taken in parallel along z, which grows toward
      the scanner; so ``geometry`` is ``{"heightMap": True}``.

    Parameters
    ----------
    path : str or path
        A file, not compressed by gzip or compress.
    calibration : {1, 2}, optional
        Of the ABW scanner. By default 1 for ``abw.test.N`` with N one of 0, 19, 21, 25, 27, 28, 29, else 2.

    Returns
    -------
    image : RangeImage
        ``src``: (H, W) integers or floats, or (H, W, 3) float points, NaN where there is none; with the exception of
        PCD, PLY and the scanners (float32) in the type of the file. ``geometry``: a dict of keywords.

    Raises
    ------
    rangeedge.error
        The file is missing, truncated or garbled, its format is unknown, or what it holds is no range image: colour,
        8 bits, an unorganized cloud.

    Notes
    -----
    ``np.load`` could run code from a file; this function never unpickles anything.

    Examples
    --------
    >>> import tempfile
    >>> path = os.path.join(tempfile.mkdtemp(), "plane.npz")
    >>> imwriteRange(path, np.full((480, 640), 1500, np.uint16), K=[[525, 0, 320], [0, 525, 240], [0, 0, 1]])
    True
    >>> image = imreadRange(path)
    >>> image.src.shape, image.src.dtype, list(image.geometry)
    ((480, 640), dtype('uint16'), ['K'])
    """
    name, data = _read_bytes("imreadRange", path)
    if calibration is not None:
        calibration = _args.integer("imreadRange", "calibration", calibration, 1, 2)
        if not data.startswith(_ABW_MAGIC):
            raise _args.fail("imreadRange", "calibration", f"None, as {name!r} is no ABW image", calibration)
    try:
        if data.startswith(_ABW_MAGIC):
            return RangeImage(_read_abw(data, calibration or _abw_calibration(name)), {})
        image = _reader(data)(data)
        image = image if isinstance(image, RangeImage) else RangeImage(image, {})
        src = _range_image(image.src)
        if image.geometry:
            range_frame("imreadRange", src, **image.geometry)
    except Exception as reason:  # NumPy, zipfile and OpenCV raise two dozen types on a garbled file
        what = reason.err if isinstance(reason, cv2.error) else reason
        if not isinstance(reason, (ValueError, cv2.error)):
            what = f"it is garbled ({type(reason).__name__}: {reason})"
        raise _args.error("imreadRange", f"cannot read {name!r}: {what}", cv2.Error.StsParseError) from reason
    return RangeImage(src, image.geometry)


def imwriteRange(
    path: str | os.PathLike[str],
    src: np.ndarray,
    *,
    K: Any = None,
    pixelSize: float | tuple[float, float] | None = None,
    heightMap: bool | None = None,
    depthFactor: float | None = None,
) -> bool:
    """Write a range image, and into NPZ its geometry; `imreadRange` returns the same.

    imwriteRange(path, src, *[, K[, pixelSize[, heightMap[, depthFactor]]]]) -> retval

    The suffix decides on the format:

    ========================= =========================================
    ``.png``, ``.pgm``        (H, W) uint16
    ``.tif``, ``.tiff``       (H, W) uint16, float32 or float64
    ``.exr``                  (H, W) float32, where OpenCV has it
    ``.pfm``                  (H, W) float, stored in 32 bits
    ``.npy``                  any range image
    ``.npz``                  any range image, and the geometry
    ``.pcd``, ``.ply``        points, stored in 32 bits
    ========================= =========================================

    Either the whole file is written or nothing: a file of this name stays as it was until the new one is complete.

    Parameters
    ----------
    path : str or path
    src : (H, W) integers or floats, or (H, W, 3) or (H, W, 4) float points
        Range image as for `detectEdges`, 8 bits excepted. PCD and PLY leave a fourth channel out.
    K, pixelSize, heightMap, depthFactor : optional
        Geometry as for `detectEdges`. Only NPZ has room for it.

    Returns
    -------
    retval : bool
        True, as from `cv2.imwrite`.

    Raises
    ------
    rangeedge.error
        Unknown suffix, a range image or a geometry that the format cannot hold, or a path that cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> imwriteRange(os.path.join(tempfile.mkdtemp(), "plane.png"), np.full((4, 5), 1500, np.uint16))
    True
    """
    name = _path("imwriteRange", path)
    given = {"K": K, "pixelSize": pixelSize, "heightMap": heightMap, "depthFactor": depthFactor}
    given = {key: value for key, value in given.items() if value is not None}
    range_frame("imwriteRange", src, **given)
    suffix = Path(name).suffix.lower()
    if suffix not in _WRITERS:
        raise _args.fail(
            "imwriteRange", "path", f"a file name with one of the suffixes {' '.join(_WRITERS)}", repr(name)
        )
    if given and suffix != ".npz":
        raise _args.fail(
            "imwriteRange", next(iter(given)), f"None for {suffix} (only .npz holds a geometry)", "a value"
        )
    if need := _unfit(src):
        raise _args.fail("imwriteRange", "src", need, _args.described(src), cv2.Error.StsUnsupportedFormat)
    try:
        data = _WRITERS[suffix](_native(src), **given)
    except ValueError as reason:
        raise _args.fail("imwriteRange", "src", f"{reason} for {suffix}", _args.described(src)) from None
    except cv2.error as reason:
        raise _args.error("imwriteRange", f"OpenCV cannot write {name!r}: {reason.err}") from reason
    try:
        write_atomically(name, data)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise _args.error("imwriteRange", f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason
    return True


def _path(func: str, path: Any) -> str:
    if not isinstance(path, (str, os.PathLike)):
        raise _args.fail(func, "path", "a file name", type(path).__name__)
    return os.fsdecode(path)


def _read_bytes(func: str, path: Any) -> tuple[str, bytes]:
    name = _path(func, path)
    try:
        return name, Path(name).read_bytes()
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise _args.error(func, f"cannot read {name!r}: {what}", cv2.Error.StsObjectNotFound) from reason


def _range_image(array: np.ndarray) -> np.ndarray:
    """What a file holds as a range image of our own; a third axis of length 1 is dropped."""
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[..., 0]
    if need := _unfit(array):
        raise ValueError(f"it holds an {_args.described(array)}, no range image, which is {need}")
    return _native(array)


def _native(array: np.ndarray) -> np.ndarray:
    """In native byte order, C-contiguous and writeable; copied only where it is not."""
    return np.require(array, array.dtype.newbyteorder("="), ["C", "W"])


def _unfit(array: np.ndarray) -> str | None:
    """What a range image would be, where `array` is none."""
    integer, real = array.dtype.kind in "ui", array.dtype.kind == "f"
    if array.size == 0:
        return "not empty"
    if integer and array.dtype.itemsize == 1:
        return "of 16 bits or floats (8 bits are too coarse for edges)"
    if (array.ndim == 2 and (integer or real)) or (array.ndim == 3 and array.shape[2] in (3, 4) and real):
        return None
    return "a depth image of shape (H, W), or float points of shape (H, W, 3) or (H, W, 4)"


def _reader(data: bytes) -> Callable[[bytes], np.ndarray | RangeImage]:
    for pattern, reader in _READERS:
        if pattern.match(data):
            return reader
    if data[:2] in (b"\x1f\x8b", b"\x1f\x9d"):
        raise ValueError("it is compressed (gzip or compress); unpack it first")
    raise ValueError("it is none of PNG, TIFF, PGM, EXR, PFM, NPY, NPZ, PCD, PLY, ABW, Perceptron, Technical Arts")


def _read_picture(data: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if picture is None:
        raise ValueError("OpenCV cannot decode it: it is truncated or garbled, or of a kind this OpenCV lacks")
    return picture


def _read_png(data: bytes) -> np.ndarray:
    """Checks first what libpng believes: the chunks' lengths, and a size that deflate (1032 to 1 at best) can reach."""
    at = 8
    while data[at + 4 : at + 8] != b"IEND":
        if at + 12 > len(data):
            raise ValueError("it is truncated, or the lengths of its chunks are garbled")
        at += 12 + int.from_bytes(data[at : at + 4], "big")
    if int.from_bytes(data[16:20], "big") * int.from_bytes(data[20:24], "big") > 1032 * len(data):
        raise ValueError("its header promises more pixels than it can hold")
    return _read_picture(data)


def _write_picture(suffix: str, *dtypes: str) -> Callable[[np.ndarray], bytes]:
    def write(src: np.ndarray) -> bytes:
        if src.ndim != 2 or src.dtype not in dtypes:
            raise ValueError(f"(H, W) {' or '.join(dtypes)}")
        written, data = cv2.imencode(suffix, src)
        if not written:
            raise cv2.error(f"no encoder for {suffix}")
        return data.tobytes()

    return write


_PFM_HEADER = re.compile(rb"P[fF]\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,40})\s")


def _read_pfm(data: bytes) -> np.ndarray:
    """Rows from bottom to top; a negative scale means little-endian, its size is a hint that no reader agrees on."""
    header = _PFM_HEADER.match(data)
    if header is None:
        raise ValueError("its PFM header is garbled")
    if data.startswith(b"PF"):
        raise ValueError("it holds colours, no range image")
    width, height = int(header[1]), int(header[2])
    _expect(len(data) - header.end(), width * height * 4)
    order = "<" if float(header[3]) < 0 else ">"
    return np.frombuffer(data, order + "f4", width * height, header.end()).reshape(height, width)[::-1]


def _write_pfm(src: np.ndarray) -> bytes:
    if src.ndim != 2 or src.dtype.kind != "f":
        raise ValueError("(H, W) floats")
    return b"Pf\n%d %d\n-1.0\n" % src.shape[::-1] + _float32(src)[::-1].astype("<f4").tobytes()


def _read_npy(data: bytes) -> np.ndarray:
    """The array, by NumPy's reader of the header; object arrays, which would be unpickled, are refused."""
    stream = io.BytesIO(data)
    headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(stream)
    if version not in headers:
        raise ValueError(f"NPY version {version} holds no range image")
    shape, fortran, dtype = headers[version](stream)
    if dtype.hasobject or dtype.names is not None or min(shape, default=1) < 0:
        raise ValueError(f"an array of shape {shape} of {dtype} is no range image")
    _expect(len(data) - stream.tell(), int(np.prod(shape, dtype=object)) * dtype.itemsize)
    flat = np.frombuffer(data, dtype, offset=stream.tell())
    return flat.reshape(shape, order="F" if fortran else "C")


def _write_npy(src: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, src, allow_pickle=False)
    return stream.getvalue()


def _read_npz(data: bytes) -> RangeImage:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        arrays = {name.removesuffix(".npy"): name for name in archive.namelist() if name.endswith(".npy")}
        geometry = {key: arrays.pop(key) for key in _GEOMETRY if key in arrays}
        found = [key for key in ("src", "xyz", "points", "depth", "z") if key in arrays] or list(arrays)
        if not found or (len(arrays) > 1 and found == list(arrays)):
            raise ValueError(f"none of its arrays ({', '.join(arrays)}) is named src, xyz, points, depth or z")
        src = _read_npy(archive.read(arrays[found[0]]))
        return RangeImage(src, {key: _GEOMETRY[key](_read_npy(archive.read(m))) for key, m in geometry.items()})


# What an array in an NPZ file stands for.
_GEOMETRY: dict[str, Callable[[np.ndarray], Any]] = {
    "K": lambda value: np.array(value, dtype=np.float64),
    "pixelSize": lambda value: tuple(np.broadcast_to(value.astype(np.float64), 2).tolist()),
    "heightMap": lambda value: bool(value.item()),
    "depthFactor": lambda value: float(value.item()),
}


def _write_npz(src: np.ndarray, **geometry: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, src=src, **geometry)
    return stream.getvalue()


def _write_points(encode: Callable[[np.ndarray], bytes]) -> Callable[[np.ndarray], bytes]:
    def write(src: np.ndarray) -> bytes:
        if src.ndim != 3:
            raise ValueError("points (H, W, 3); cv2.depthTo3d makes them of a depth image")
        return encode(_float32(src))

    return write


def _abw_calibration(name: str) -> int:
    number = re.search(r"abw\.test\.(\d+)", Path(name).name)
    return 1 if number and int(number[1]) in ABW_CALIBRATION_1 else 2


def _read_abw(data: bytes, calibration: int) -> np.ndarray:
    """A Sun rasterfile of 8 bits: eight big-endian words, a colour map, rows padded to an even number of bytes."""
    if len(data) < 32:
        raise ValueError("it ends within its header")
    _, width, height, depth, _, kind, _, map_length = struct.unpack_from(">8I", data)
    if (height, width) != SCANNER_SIZE or depth != 8 or kind not in (0, 1):
        raise ValueError(f"a Sun rasterfile of {width} x {height}, {depth} bits, type {kind} is no ABW image")
    start = 32 + map_length
    _expect(len(data) - start, width * height)
    return abwPoints(np.frombuffer(data, np.uint8, width * height, start).reshape(height, width), calibration)


_PERCEPTRON_LINES = 10


def _read_perceptron(data: bytes) -> np.ndarray:
    """Ten lines ``key : value``, rows and columns first, an empty one, then big-endian words.

    The range is in their lower 12 bits. As the empty line is not the same everywhere, the words are counted from the
    end of the file.
    """
    header = re.match(rb"(?:[^\n]*\n){%d}" % _PERCEPTRON_LINES, data)
    if header is None:
        raise ValueError(f"it ends within the {_PERCEPTRON_LINES} lines of its header")
    lines = header[0].splitlines()
    rows, cols = (int(line.split(b":")[1]) for line in lines[:2])
    if (rows, cols) != SCANNER_SIZE:
        raise ValueError(f"{rows} rows of {cols} columns are no Perceptron image")
    start = len(data) - rows * cols * 4
    if start < header.end() or data[header.end() : start].strip():
        raise ValueError(f"{len(data) - header.end()} bytes after its header where {rows * cols * 4} are needed")
    words = np.frombuffer(data, ">i4", rows * cols, start)
    return perceptronPoints((words & 4095).reshape(rows, cols))


_TECHNICAL_ARTS_HEADER = re.compile(rb"(?:[\x20-\x7e\t\r]*\n){3}")


def _read_technical_arts(data: bytes) -> RangeImage:
    """Three lines with the numbers of rows and columns, then the images flag, X, Y and Z as text."""
    header = _TECHNICAL_ARTS_HEADER.match(data)[0].decode("ascii").lower()
    sizes = [int(word) for word in re.findall(r"\d{1,9}", header)[:2]]
    if len(sizes) < 2:
        raise ValueError("it is no known text format: its first three lines do not give rows and columns")
    rows, cols = sizes[::-1] if 0 <= header.find("col") < header.find("row") else sizes
    words = data[len(header) :].split()
    _expect(len(words), 4 * rows * cols, "values")
    flag, x, y, z = np.array([float(word) for word in words]).reshape(4, rows, cols)
    points = _float32(np.stack([x, y, z], axis=-1))
    points[flag == 0] = np.nan
    return RangeImage(points, {"heightMap": True})


def _float32(src: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):
        return src.astype(np.float32)


def _expect(found: int, needed: int, unit: str = "bytes") -> None:
    if found != needed:
        raise ValueError(f"it holds {found} {unit} where {needed} are needed")


_READERS: tuple[tuple[re.Pattern[bytes], Callable[[bytes], np.ndarray | RangeImage]], ...] = (
    (re.compile(rb"\x89PNG\r\n\x1a\n"), _read_png),
    (re.compile(rb"II[*+]\0|MM\0[*+]"), _read_picture),  # TIFF, BigTIFF
    (re.compile(rb"P[25]\s"), _read_picture),  # PGM
    (re.compile(rb"\x76\x2f\x31\x01"), _read_picture),  # EXR
    (re.compile(rb"P[fF]\s"), _read_pfm),
    (re.compile(rb"\x93NUMPY"), _read_npy),
    (re.compile(rb"PK\x03\x04"), _read_npz),
    (re.compile(rb"ply\s"), pointcloud.read_ply),
    (re.compile(rb"(?:#[^\n]*\n|\s)*(?:VERSION|FIELDS)\s"), pointcloud.read_pcd),
    (re.compile(rb"[^:\n]*:[ \t]*\d+\s*\n[^:\n]*:[ \t]*\d+\s*\n"), _read_perceptron),
    (_TECHNICAL_ARTS_HEADER, _read_technical_arts),
)

_WRITERS: dict[str, Callable[..., bytes]] = {
    ".png": _write_picture(".png", "uint16"),
    ".pgm": _write_picture(".pgm", "uint16"),
    ".tif": _write_picture(".tiff", "uint16", "float32", "float64"),
    ".tiff": _write_picture(".tiff", "uint16", "float32", "float64"),
    ".exr": _write_picture(".exr", "float32"),
    ".pfm": _write_pfm,
    ".npy": _write_npy,
    ".npz": _write_npz,
    ".pcd": _write_points(pointcloud.write_pcd),
    ".ply": _write_points(pointcloud.write_ply),
}
