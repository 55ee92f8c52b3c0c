"""Range images and their geometry from and to files."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from .. import _check
from ..frame import checked
from ..options import ScanLineParams
from .arrays import read_npy, read_npz, write_npy, write_npz
from .ascii_grid import is_ascii_grid, read_ascii_grid
from .atomic import write_atomically
from .exr import read_exr, write_exr
from .pcd import is_pcd, read_pcd, write_pcd
from .pictures import PNG_MAGIC, read_pfm, read_pgm, read_png, write_pfm, write_pgm, write_png
from .ply import read_ply, write_ply
from .points import writer_of_points
from .range_image import RangeImage
from .scanners import (
    ABW_MAGIC,
    abw_calibration,
    is_perceptron,
    is_technical_arts,
    read_abw,
    read_perceptron,
    read_technical_arts,
)
from .source import HEADER_LIMIT, file_name, opened
from .tiff import read_tiff, write_tiff


@_check.public
def imreadRange(path: str | os.PathLike[str], *, calibration: int | None = None) -> RangeImage:
    """Read a range image and what its file says about its geometry.

    imreadRange(path, *[, calibration]) -> image

    The content of the file decides on the format, whatever its name:

    - PNG, one channel of 16 bits;
    - TIFF and BigTIFF, one channel, or x, y and z as three: integers or floats of 16 to 64 bits, strips or tiles,
      uncompressed or packed by LZW, deflate, LZMA or PackBits; by ZSTD or LERC with the extra ``[tiff]``.
      GDAL's value of no data is honoured (floats become NaN, unsigned integers 0, signed ones their least value), and
      so are floats of 1e38 and more. Of a GeoTIFF the pixel size is known too (degrees as metres at its middle
      latitude), ``heightMap=True``, and for integers ``depthFactor=1``;
    - EXR with the extra ``[exr]``: the channel Z or Depth of any part or layer, else X, Y and Z, else the only channel;
      1e10 and more, which renderers write where there is nothing, is NaN;
    - PGM of 16 bits; PFM: the values as stored, whatever the scale in its header;
    - NPY, and NPZ with an array ``src``, ``xyz``, ``points``, ``depth`` or ``z`` (or only one array) and perhaps the
      geometry under the names of the keywords; records with fields x, y and z are points;
    - PCD 0.5 to 0.7 (ascii, binary, compressed) and PLY (ascii, binary), organized: the points in the axes of the file.
      In Stanford's scans z grows toward the scanner, which is ``heightMap=True``;
    - ASCII grids of elevation (ESRI): with pixel size, georeference and ``heightMap=True``;
    - ABW, a Sun rasterfile: points by `abwPoints`;
    - Perceptron: points by `perceptronPoints`;
    - Technical Arts (Michigan), ASCII: points in the axes of the file, taken in parallel along z, which grows toward
      the scanner; so ``geometry`` is ``{"heightMap": True}``.

    Parameters
    ----------
    path : str or path
        A regular file, not compressed by gzip or compress.
    calibration : {1, 2}, optional
        Of the ABW scanner. By default 1 for ``abw.test.N`` with N one of 0, 19, 21, 25, 27, 28, 29, else 2.

    Returns
    -------
    image : RangeImage
        ``src``: (H, W) integers or floats, or (H, W, 3) float points, NaN where there is none; with the exception of
        PCD, PLY and the scanners (float32) in the type of the file. ``geometry``: a dict of keywords. Attributes
        ``viewpoint`` (PCD) and ``georeference`` (GeoTIFF), see `RangeImage`.

    Raises
    ------
    rangeedge.error
        The file is missing, truncated or garbled, its format is unknown, or what it holds is no range image: colours,
        8 bits, an unorganized cloud. It is no regular file, or beyond the bounds below.

    Notes
    -----
    ``np.load`` could run code from a file; this function never unpickles anything.

    Memory and time are bounded: a file has at most 4 GiB and an image at most 2^28 pixels, and what is compressed
    unpacks to at most 256 MiB or 100 times the size of its file.

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
    name = file_name(path)
    if calibration is not None:
        calibration = _check.integer("calibration", calibration, 1, 2)
    with opened(name) as (stream, size):
        head = stream.read(HEADER_LIMIT)
        abw = head.startswith(ABW_MAGIC)
        if calibration is not None and not abw:
            raise ValueError("it is no ABW image, which alone has a calibration")
        read = _reader(head)
        stream.seek(0)
        data = stream.read(size)
        found = read_abw(data, calibration or abw_calibration(name)) if abw else read(data)
        image = found if isinstance(found, RangeImage) else RangeImage(found)
        image = image._replace(src=as_range_image(image.src))
        if image.geometry:
            checked(image.src[:1, :1], ScanLineParams(**image.geometry))  # whether they fit
        return image


@_check.public
def imwriteRange(
    path: str | os.PathLike[str],
    src: np.ndarray,
    *,
    K: Any = None,
    distCoeffs: Any = None,
    pixelSize: float | tuple[float, float] | None = None,
    heightMap: bool | None = None,
    depthFactor: float | None = None,
) -> bool:
    """Write a range image, and into NPZ its geometry; `imreadRange` returns the same.

    imwriteRange(path, src, *[, K[, distCoeffs[, pixelSize[, heightMap[, depthFactor]]]]]) -> retval

    The suffix decides on the format:

    ========================= =========================================
    ``.png``, ``.pgm``        (H, W) uint16
    ``.tif``, ``.tiff``       any range image of 16, 32 or 64 bits
    ``.exr``                  (H, W) float32, with the extra ``[exr]``
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
    K, distCoeffs, pixelSize, heightMap, depthFactor : optional
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
    name = file_name(path)
    given = {"K": K, "distCoeffs": distCoeffs, "pixelSize": pixelSize, "heightMap": heightMap}
    given = {key: value for key, value in {**given, "depthFactor": depthFactor}.items() if value is not None}
    params = ScanLineParams(**given)
    src, _ = checked(src, params)
    if K is not None:
        camera = {"K": params.K, "distCoeffs": params.distCoeffs}
        given.update({key: value for key, value in camera.items() if value is not None})
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
    except ImportError as reason:
        raise _check.error(f"cannot write {name!r}: {reason}") from reason
    try:
        write_atomically(name, data)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise _check.error(f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason
    return True


def as_range_image(array: np.ndarray) -> np.ndarray:
    """What a file holds as a range image of our own; a third axis of length 1 is dropped."""
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[..., 0]
    if need := _unfit(array):
        raise ValueError(f"it holds an {_check.described(array)}, no range image, which is {need}")
    return _native(array)


def _native(array: np.ndarray) -> np.ndarray:
    """In native byte order, aligned, C-contiguous and writeable; copied only where it is not."""
    return np.require(array, array.dtype.newbyteorder("="), ["C", "W", "A"])


def _unfit(array: np.ndarray) -> str | None:
    """What a range image would be, where `array` is none."""
    integer, real = array.dtype.kind in "ui", array.dtype.kind == "f"
    if array.size == 0:
        return "not empty"
    if integer and array.dtype.itemsize == 1:
        return "of 16 bits or floats (8 bits are too coarse for edges)"
    if array.ndim == 2 and real and array.shape[1] in (3, 4) and array.shape[0] > 16 * array.shape[1]:
        return "an organized cloud of shape (H, W, 3), with the rows and columns that scan lines need"
    if (array.ndim == 2 and (integer or real)) or (array.ndim == 3 and array.shape[2] in (3, 4) and real):
        return None
    return "a depth image of shape (H, W), or float points of shape (H, W, 3) or (H, W, 4)"


class _Format(NamedTuple):
    name: str
    is_it: Callable[[bytes], bool]
    read: Callable[[bytes], np.ndarray | RangeImage]


def _begins(*magics: bytes) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(magics)


def _is_netpbm(*magics: bytes) -> Callable[[bytes], bool]:
    return lambda head: head[:2] in magics and (head[2:3].isspace() or head[2:3] == b"#")


def _is_ply(head: bytes) -> bool:
    return head[:3] == b"ply" and head[3:4].isspace()


_FORMATS = (
    _Format("PNG", _begins(PNG_MAGIC), read_png),
    _Format("TIFF", _begins(b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), read_tiff),
    _Format("EXR", _begins(b"\x76\x2f\x31\x01"), read_exr),
    _Format("PGM", _is_netpbm(b"P2", b"P5"), read_pgm),
    _Format("PFM", _is_netpbm(b"Pf", b"PF"), read_pfm),
    _Format("NPY", _begins(b"\x93NUMPY"), read_npy),
    _Format("NPZ", _begins(b"PK\x03\x04"), read_npz),
    _Format("PLY", _is_ply, read_ply),
    _Format("PCD", is_pcd, read_pcd),
    _Format("ASCII grid", is_ascii_grid, read_ascii_grid),
    _Format("ABW", _begins(ABW_MAGIC), lambda data: read_abw(data, 2)),
    _Format("Perceptron", is_perceptron, read_perceptron),
    _Format("Technical Arts", is_technical_arts, read_technical_arts),
)

# What people have instead, and the way out.
_OTHERS = {
    (
        b"\x1f\x8b",
        b"\x1f\x9d",
        b"BZh",
        b"\xfd7zXZ",
        b"\x28\xb5\x2f\xfd",
    ): "it is compressed (gzip, ...); unpack it first",
    (b"\xff\xd8\xff",): "it is a JPEG, whose 8 lossy bits are no depth; store 16 bits as PNG or TIFF",
    (b"BM", b"GIF8"): "it is a picture of 8 bits (BMP, GIF); store 16 bits as PNG or TIFF",
    (b"P3", b"P6"): "it holds colours (PPM), no range image",
    (b"\x89HDF",): "it is an HDF5 file; save the array that is meant by numpy.save",
    (
        b"MATLAB 5.0",
    ): "it is a MATLAB file; save the array that is meant by numpy.save(name, scipy.io.loadmat(...)[key])",
    (b"LASF", b"ASTM-E57"): "it is an unorganized cloud (LAS, E57): scan lines need rows and columns",
    (b"#ROSBAG", b"\x89MCAP"): "it is a recording of ROS; save one depth image or organized cloud of it",
    tuple(
        b"\x80%c" % protocol for protocol in range(2, 6)
    ): "it is a pickle, which could run code; save the array itself",
}


def _reader(head: bytes) -> Callable[[bytes], np.ndarray | RangeImage]:
    for form in _FORMATS:
        if form.is_it(head):
            return form.read
    for magics, what in _OTHERS.items():
        if head.startswith(magics):
            raise ValueError(what)
    raise ValueError(f"it is {'none of ' + ', '.join(form.name for form in _FORMATS) if head else 'empty'}")


_WRITERS: dict[str, Callable[..., bytes]] = {
    ".png": write_png,
    ".pgm": write_pgm,
    ".tif": write_tiff,
    ".tiff": write_tiff,
    ".exr": write_exr,
    ".pfm": write_pfm,
    ".npy": write_npy,
    ".npz": write_npz,
    ".pcd": writer_of_points(write_pcd),
    ".ply": writer_of_points(write_ply),
}
