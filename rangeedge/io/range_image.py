"""Range images and their geometry from and to files."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from .. import _check
from ..frame import read_frame
from ..options import ScanLineParams
from .arrays import read_npy, read_npz, write_npy, write_npz
from .atomic import write_atomically
from .pcd import read_pcd, write_pcd
from .pictures import read_pfm, read_picture, read_png, write_pfm, write_picture
from .ply import read_ply, write_ply
from .points import write_points
from .scanners import (
    ABW_MAGIC,
    TECHNICAL_ARTS_HEADER,
    abw_calibration,
    read_abw,
    read_perceptron,
    read_technical_arts,
)


class RangeImage(NamedTuple):
    """A range image as the detector takes it: ``edgeStrength(image.src, **image.geometry)``.

    `geometry` holds those of `K`, `pixelSize`, `heightMap` and `depthFactor` that the file knows.
    """

    src: np.ndarray
    geometry: dict[str, Any]


@_check.public
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
    >>> import os
    >>> import tempfile
    >>> import numpy as np
    >>> from rangeedge import imreadRange, imwriteRange
    >>> path = os.path.join(tempfile.mkdtemp(), "plane.npz")
    >>> imwriteRange(path, np.full((480, 640), 1500, np.uint16), K=[[525, 0, 320], [0, 525, 240], [0, 0, 1]])
    True
    >>> image = imreadRange(path)
    >>> image.src.shape, image.src.dtype, list(image.geometry)
    ((480, 640), dtype('uint16'), ['K'])
    """
    name, data = _read_bytes(path)
    if calibration is not None:
        calibration = _check.integer("calibration", calibration, 1, 2)
        if not data.startswith(ABW_MAGIC):
            raise _check.fail("calibration", f"None, as {name!r} is no ABW image", calibration)
    try:
        if data.startswith(ABW_MAGIC):
            return RangeImage(read_abw(data, calibration or abw_calibration(name)), {})
        image = _reader(data)(data)
        image = RangeImage(*image) if isinstance(image, tuple) else RangeImage(image, {})
        src = _range_image(image.src)
        if image.geometry:
            read_frame(src, ScanLineParams(**image.geometry))
    except Exception as reason:  # NumPy, zipfile and OpenCV raise two dozen types on a garbled file
        what = reason.err if isinstance(reason, cv2.error) else reason
        if not isinstance(reason, (ValueError, cv2.error)):
            what = f"it is garbled ({type(reason).__name__}: {reason})"
        raise _check.error(f"cannot read {name!r}: {what}", cv2.Error.StsParseError) from reason
    return RangeImage(src, image.geometry)


@_check.public
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
    >>> import os
    >>> import tempfile
    >>> import numpy as np
    >>> from rangeedge import imwriteRange
    >>> imwriteRange(os.path.join(tempfile.mkdtemp(), "plane.png"), np.full((4, 5), 1500, np.uint16))
    True
    """
    name = _path(path)
    given = {"K": K, "pixelSize": pixelSize, "heightMap": heightMap, "depthFactor": depthFactor}
    given = {key: value for key, value in given.items() if value is not None}
    read_frame(src, ScanLineParams(**given))
    suffix = Path(name).suffix.lower()
    if suffix not in _WRITERS:
        raise _check.fail("path", f"a file name with one of the suffixes {' '.join(_WRITERS)}", repr(name))
    if given and suffix != ".npz":
        raise _check.fail(next(iter(given)), f"None for {suffix} (only .npz holds a geometry)", "a value")
    if need := _unfit(src):
        raise _check.fail("src", need, _check.described(src), cv2.Error.StsUnsupportedFormat)
    try:
        data = _WRITERS[suffix](_native(src), **given)
    except ValueError as reason:
        raise _check.fail("src", f"{reason} for {suffix}", _check.described(src)) from None
    except cv2.error as reason:
        raise _check.error(f"OpenCV cannot write {name!r}: {reason.err}") from reason
    try:
        write_atomically(name, data)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise _check.error(f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason
    return True


def _path(path: Any) -> str:
    if not isinstance(path, (str, os.PathLike)):
        raise _check.fail("path", "a file name", type(path).__name__)
    return os.fsdecode(path)


def _read_bytes(path: Any) -> tuple[str, bytes]:
    name = _path(path)
    try:
        return name, Path(name).read_bytes()
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise _check.error(f"cannot read {name!r}: {what}", cv2.Error.StsObjectNotFound) from reason


def _range_image(array: np.ndarray) -> np.ndarray:
    """What a file holds as a range image of our own; a third axis of length 1 is dropped."""
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[..., 0]
    if need := _unfit(array):
        raise ValueError(f"it holds an {_check.described(array)}, no range image, which is {need}")
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


def _reader(data: bytes) -> Callable[[bytes], Read]:
    for pattern, reader in _READERS:
        if pattern.match(data):
            return reader
    if data[:2] in (b"\x1f\x8b", b"\x1f\x9d"):
        raise ValueError("it is compressed (gzip or compress); unpack it first")
    raise ValueError("it is none of PNG, TIFF, PGM, EXR, PFM, NPY, NPZ, PCD, PLY, ABW, Perceptron, Technical Arts")


Read = np.ndarray | tuple[np.ndarray, dict[str, Any]]

_READERS: tuple[tuple[re.Pattern[bytes], Callable[[bytes], Read]], ...] = (
    (re.compile(rb"\x89PNG\r\n\x1a\n"), read_png),
    (re.compile(rb"II[*+]\0|MM\0[*+]"), read_picture),  # TIFF, BigTIFF
    (re.compile(rb"P[25]\s"), read_picture),  # PGM
    (re.compile(rb"\x76\x2f\x31\x01"), read_picture),  # EXR
    (re.compile(rb"P[fF]\s"), read_pfm),
    (re.compile(rb"\x93NUMPY"), read_npy),
    (re.compile(rb"PK\x03\x04"), read_npz),
    (re.compile(rb"ply\s"), read_ply),
    (re.compile(rb"(?:#[^\n]*\n|\s)*(?:VERSION|FIELDS)\s"), read_pcd),
    (re.compile(rb"[^:\n]*:[ \t]*\d+\s*\n[^:\n]*:[ \t]*\d+\s*\n"), read_perceptron),
    (TECHNICAL_ARTS_HEADER, read_technical_arts),
)

_WRITERS: dict[str, Callable[..., bytes]] = {
    ".png": write_picture(".png", "uint16"),
    ".pgm": write_picture(".pgm", "uint16"),
    ".tif": write_picture(".tiff", "uint16", "float32", "float64"),
    ".tiff": write_picture(".tiff", "uint16", "float32", "float64"),
    ".exr": write_picture(".exr", "float32"),
    ".pfm": write_pfm,
    ".npy": write_npy,
    ".npz": write_npz,
    ".pcd": write_points(write_pcd),
    ".ply": write_points(write_ply),
}
