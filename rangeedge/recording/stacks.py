"""Many frames in one file: NPY, NPZ and Zarr of shape (N, H, W) or (N, H, W, 3), and TIFF files of many pages."""

from __future__ import annotations

import functools
import math
import mmap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..io import RangeImage
from ..io.arrays import source_name
from ..io.files import as_range_image
from ..io.source import FILE_LIMIT, expect_pixels, opened
from ..io.tiff import images_of_tiff, read_page
from ..io.tiff_tags import Page
from .archives import npz_stack
from .source import FrameSource, extra, failures_named, kept

_TIFF_HEADS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_MOST = 2**20  # frames of a file
_GEOMETRY = ("K", "distCoeffs", "pixelSize", "heightMap", "depthFactor")


def stack_frames(path: str) -> list[FrameSource]:
    """The frames of a file that holds several; none where it is a range image of its own."""
    geometry: Mapping[str, Any] = {}
    load: Callable[[str, int], RangeImage]
    if is_zarr(path):
        array, geometry = zarr_array(path)
        count, load = _frames(array.shape, array.dtype), _zarr_frame
    else:
        with opened(path, math.inf) as (stream, _):
            head = stream.read(6)
        if head == b"\x93NUMPY":
            array = npy_array(path)
            count, load = _frames(array.shape, array.dtype), _npy_frame
        elif head[:4] == b"PK\x03\x04":
            archive = npz_stack(path)
            geometry = archive.geometry
            count, load = _frames(archive.shape, archive.dtype), _npz_frame
            if count:
                archive.check()
        elif head[:4] in _TIFF_HEADS:
            pages = len(_pages(path))
            count, load = pages if pages > 1 else 0, _tiff_frame
        else:
            return []
    digits = max(4, len(str(count - 1)))
    return [
        FrameSource(
            f"{Path(path).stem}/{index:0{digits}d}",
            path,
            f"frame {index}",
            functools.partial(_checked, load, path, index),
            geometry,
        )
        for index in range(count)
    ]


def _frames(shape: tuple[int, ...], dtype: np.dtype) -> int:
    """How many frames an array of this shape holds; 0 where it is one range image."""
    if len(shape) in (3, 4) and shape[0] > _MOST:
        raise ValueError(f"it holds {shape[0]} frames, more than the {_MOST} that are listed of a file")
    if len(shape) == 4 or (len(shape) == 3 and not (dtype.kind == "f" and shape[2] in (1, 3, 4))):
        expect_pixels(*shape[1:3])
        return shape[0]
    return 0


def _checked(load: Callable[[str, int], RangeImage], path: str, index: int) -> RangeImage:
    with failures_named(f"{path!r}, frame {index}"):
        image = load(path, index)
        return image._replace(src=as_range_image(image.src))


@kept(4)
def npy_array(path: str) -> np.ndarray:
    """The array of a file, read where it is looked at."""
    with opened(path, math.inf):
        return np.load(path, mmap_mode="r", allow_pickle=False)


def _npy_frame(path: str, index: int) -> RangeImage:
    return RangeImage(np.array(npy_array(path)[index]))


def _npz_frame(path: str, index: int) -> RangeImage:
    return RangeImage(npz_stack(path).frame(index))


@kept(4)
def _pages(path: str) -> list[Page]:
    with opened(path, math.inf) as (stream, _):
        return images_of_tiff(mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ), _MOST)  # type: ignore[arg-type]


def _tiff_frame(path: str, index: int) -> RangeImage:
    return read_page(_pages(path)[index])


def is_zarr(path: str) -> bool:
    """Whether a folder is a Zarr store, of either version."""
    return any((Path(path) / name).exists() for name in ("zarr.json", ".zarray", ".zgroup"))


@kept(4)
def zarr_array(path: str) -> tuple[Any, Mapping[str, Any]]:
    """The array of a store, or that of a group which is named as in NPZ files; attributes may hold the geometry."""
    zarr = extra("zarr", "zarr", f"{path!r}")
    with failures_named(repr(path)):
        found = zarr.open(path, mode="r")
        attributes = dict(found.attrs)
        if hasattr(found, "array_keys"):
            found = found[source_name(sorted(found.array_keys()))]
            attributes |= dict(found.attrs)
        if (size := math.prod(found.chunks) * found.dtype.itemsize) > FILE_LIMIT:
            raise ValueError(f"its chunks have {size} bytes each, more than the {FILE_LIMIT} that are unpacked")
        return found, {key: attributes[key] for key in _GEOMETRY if key in attributes}


def _zarr_frame(path: str, index: int) -> RangeImage:
    array, _ = zarr_array(path)
    expect_pixels(*array.shape[1:3])
    return RangeImage(np.asarray(array[index]))
