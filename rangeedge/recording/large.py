"""Images that are larger than memory: TIFF, NPY and Zarr, of which windows are read."""

from __future__ import annotations

import functools
import math
import mmap
import os
import uuid
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from .._check import error
from ..io import RangeImage
from ..io.files import as_range_image, unfit
from ..io.source import opened
from ..io.tiff import Window, images_of_tiff, read_window, size_of_page
from ..io.tiff_tags import (
    GEO_KEYS,
    GEO_REALS,
    GEO_TEXTS,
    MODEL_PIXEL_SCALE,
    MODEL_TIE_POINT,
    MODEL_TRANSFORMATION,
    PAGES,
    WIDTH,
    Page,
)
from .source import FrameSource, extra, failures_named
from .stacks import is_zarr, zarr_array

_TILE = 256  # pixels of a tile of the files that are written
_GEO_TAGS = (MODEL_PIXEL_SCALE, MODEL_TIE_POINT, MODEL_TRANSFORMATION, GEO_KEYS, GEO_REALS, GEO_TEXTS)
_ASCII, _SHORTS, _REALS = 2, 3, 12  # types of tags


class LargeImage(NamedTuple):
    """What is known of an image before its pixels are read."""

    path: str
    shape: tuple[int, int]
    dtype: np.dtype
    geometry: Mapping[str, Any]
    georeference: np.ndarray | None
    tags: tuple[tuple[int, int, int, Any], ...] = ()  # of a GeoTIFF: code, type, count and value


def open_large(path: str) -> LargeImage:
    """An image of one channel, of any size."""
    if is_zarr(path):
        array, geometry = zarr_array(path)
        with failures_named(repr(path)):
            return LargeImage(path, _expect_image(array), array.dtype, geometry, None)
    with opened(path, math.inf) as (stream, _):
        if stream.read(6) == b"\x93NUMPY":
            array = np.load(path, mmap_mode="r", allow_pickle=False)
            return LargeImage(path, _expect_image(array), array.dtype, {}, None)
        page = _page(path)
        sized = size_of_page(page)
        shape = (sized.src.shape[0], page.value(WIDTH))
        return LargeImage(path, shape, sized.src.dtype, sized.geometry, sized.georeference, _geo_tags(page))


def _geo_tags(page: Page) -> tuple[tuple[int, int, int, Any], ...]:
    """What places the image on the map, as it stands in the file."""
    tags: list[tuple[int, int, int, Any]] = []
    for code in _GEO_TAGS:
        if code in page:
            values = page.values(code)
            if values.dtype.kind == "S":
                tags.append((code, _ASCII, len(values), values.tobytes()))
            else:
                tags.append(
                    (code, _REALS if values.dtype.kind == "f" else _SHORTS, len(values), tuple(values.tolist()))
                )
    return tuple(tags)


def write_geotiff(path: Path, array: Any, image: LargeImage, rows: int) -> None:
    """An array of a store as a GeoTIFF of deflated tiles, some `rows` at a time; the whole file or none."""
    tifffile = extra("tifffile", "zarr", "a GeoTIFF")
    height, width = array.shape
    band = -(-rows // _TILE) * _TILE

    def tiles() -> Iterator[np.ndarray]:
        for start in range(0, height, band):
            part = np.asarray(array[start : start + band])
            part = np.pad(part, ((0, -len(part) % _TILE), (0, -width % _TILE)))
            for top in range(0, len(part), _TILE):
                for left in range(0, part.shape[1], _TILE):
                    yield part[top : top + _TILE, left : left + _TILE]

    temporary = path.with_name(f".{uuid.uuid4().hex}.tmp")
    try:
        with tifffile.TiffWriter(temporary, bigtiff=array.nbytes > 2**31) as writer:
            writer.write(
                tiles(),
                shape=array.shape,
                dtype=array.dtype,
                tile=(_TILE, _TILE),
                compression="zlib",
                photometric="minisblack",
                metadata=None,
                extratags=[(*tag, True) for tag in image.tags],
            )
        os.replace(temporary, path)
    except OSError as reason:
        raise error(f"cannot write {str(path)!r}: {reason.strerror or reason}", cv2.Error.StsError) from reason
    finally:
        temporary.unlink(missing_ok=True)


def _expect_image(array: Any) -> tuple[int, int]:
    need = unfit(array) if len(array.shape) == 2 else "of shape (H, W)"
    if need:
        raise ValueError(f"it holds an array of {array.dtype} of shape {array.shape}; images done in blocks are {need}")
    rows, cols = array.shape
    return rows, cols


def _page(path: str) -> Page:
    """The only image of a TIFF; the memory that reading takes is given back with it."""
    if Path(path).suffix.lower() not in (".tif", ".tiff"):
        raise ValueError("blocks are read of TIFF, NPY and Zarr")
    with open(path, "rb") as stream:
        found = images_of_tiff(mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ), PAGES)  # type: ignore[arg-type]
    if len(found) != 1:
        raise ValueError(f"it holds {len(found)} images")
    return found[0]


def window_source(image: LargeImage, name: str, window: Window, part: str) -> FrameSource:
    """A part of an image as a frame, with the camera as it is seen from there."""
    return FrameSource(name, image.path, part, functools.partial(_window, image.path, window), image.geometry)


def _window(path: str, window: Window) -> RangeImage:
    top, left, bottom, right = window
    if is_zarr(path):
        src = np.asarray(zarr_array(path)[0][top:bottom, left:right])
    else:
        with opened(path, math.inf) as (stream, _):
            if stream.read(6) == b"\x93NUMPY":
                src = np.array(np.load(path, mmap_mode="r", allow_pickle=False)[top:bottom, left:right])
            else:
                src = read_window(_page(path), window).src
    return RangeImage(as_range_image(src))
