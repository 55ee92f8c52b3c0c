"""Images that are larger than memory: TIFF, NPY and Zarr, of which windows are read."""

from __future__ import annotations

import functools
import math
import mmap
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._check import error
from ..io import RangeImage
from ..io.files import as_range_image
from ..io.source import opened
from ..io.tiff import Window, images_of_tiff, read_window, size_of_page
from ..io.tiff_tags import PAGES, WIDTH, Page
from .source import FrameSource
from .stacks import is_zarr, zarr_array


class LargeImage(NamedTuple):
    """What is known of an image before its pixels are read."""

    path: str
    shape: tuple[int, int]
    dtype: np.dtype
    geometry: Mapping[str, Any]
    georeference: np.ndarray | None


def open_large(path: str) -> LargeImage:
    """An image of one channel, of any size."""
    if is_zarr(path):
        array, geometry = zarr_array(path)
        return LargeImage(path, _expect_image(path, array.shape), array.dtype, geometry, None)
    with opened(path, math.inf) as (stream, _):
        if stream.read(6) == b"\x93NUMPY":
            array = np.load(path, mmap_mode="r", allow_pickle=False)
            return LargeImage(path, _expect_image(path, array.shape), array.dtype, {}, None)
        page = _page(path)
        sized = size_of_page(page)
        shape = (sized.src.shape[0], page.value(WIDTH))
        return LargeImage(path, shape, sized.src.dtype, sized.geometry, sized.georeference)


def _expect_image(path: str, shape: tuple[int, ...]) -> tuple[int, int]:
    if len(shape) != 2:
        raise error(f"{path!r} holds an array of shape {shape}, no image (H, W) that could be done in blocks")
    rows, cols = shape
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
