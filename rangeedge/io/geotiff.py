"""What a GeoTIFF says of its pixels: which have no data, how large they are and where.

Tags: OGC 19-008r4, GeoTIFF 1.1, and ``GDAL_NODATA`` of the Geospatial Data Abstraction Library.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import tiff_tags as tag
from .range_image import RangeImage
from .tiff_tags import Page

METRES_PER_DEGREE = 6371008.8 * np.pi / 180  # along a meridian of the mean sphere
_UNREAL = 1e38  # no length is as large; the largest float stands for no data in many files

_MODEL_TYPE, _RASTER_TYPE, _GEODETIC_SYSTEM, _PROJECTED_SYSTEM = 1024, 1025, 2048, 3072  # geo keys
_OWN_SYSTEM = 32767  # one that the file itself defines
_GEOGRAPHIC, _PIXEL_IS_POINT = 2, 2


def described_by(page: Page, image: np.ndarray) -> RangeImage:
    """The image, pixels without data marked (floats NaN, integers the value that `without_data` names)."""
    image = _without_data(image, page.text(tag.GDAL_NODATA) if tag.GDAL_NODATA in page else "")
    image = _scaled(image, page.text(tag.GDAL_METADATA) if tag.GDAL_METADATA in page else "")
    georeference = _georeference(page)
    if georeference is None or image.ndim != 2:
        return RangeImage(image, georeference=georeference, epsg=_epsg(page))
    geometry: dict[str, Any] = {"pixelSize": _pixel_size(page, georeference, image.shape[0]), "heightMap": True}
    if image.dtype.kind != "f":
        geometry["depthFactor"] = 1.0
    return RangeImage(image, geometry, georeference=georeference, epsg=_epsg(page))


def _without_data(image: np.ndarray, nodata: str) -> np.ndarray:
    """Marks pixels that hold the value of no data: floats NaN, unsigned integers 0, signed ones their least value."""
    try:
        value = float(nodata) if nodata else np.nan
    except ValueError:
        raise ValueError(f"its tag GDAL_NODATA holds {nodata[:40]!r}, no number") from None
    if image.dtype.kind == "f":
        if image.dtype.itemsize > 2:  # half floats end before that
            magnitude = np.abs(image)
            image[(magnitude >= _UNREAL) & (magnitude < np.inf)] = np.nan
        if np.isfinite(value):
            with np.errstate(over="ignore"):
                image[image == image.dtype.type(value)] = np.nan
    elif np.isfinite(value) and value == int(value):
        info = np.iinfo(image.dtype)
        if info.min <= value <= info.max:
            image[image == int(value)] = info.min
    return image


def _scaled(image: np.ndarray, metadata: str) -> np.ndarray:
    """Values in their unit: those stored, times GDAL's scale, plus its offset; as floats where these change them."""
    values = {"scale": 1.0, "offset": 0.0}
    for item in metadata.split("<")[:-1]:
        attributes, _, found = item.partition(">")
        for role in values:
            if f'role="{role}"' in attributes:
                try:
                    values[role] = float(found)
                except ValueError:
                    raise ValueError(f"its {role} is {found[:40]!r}, no number") from None
    if values == {"scale": 1.0, "offset": 0.0}:
        return image
    if not all(np.isfinite(value) for value in values.values()) or values["scale"] == 0:
        raise ValueError(f"its scale {values['scale']} and offset {values['offset']} make no lengths")
    lengths = image.astype(np.float64) * values["scale"] + values["offset"]
    if image.dtype.kind != "f":
        lengths[image == np.iinfo(image.dtype).min] = np.nan
    return lengths


def _georeference(page: Page) -> np.ndarray | None:
    """Map coordinates of pixel centres as an affine map of (column, row, 1)."""
    if tag.MODEL_TRANSFORMATION in page:
        matrix = page.values(tag.MODEL_TRANSFORMATION).astype(np.float64)
        if matrix.shape != (16,):
            raise ValueError("its ModelTransformation has not 16 values")
        affine = matrix.reshape(4, 4)[:2, [0, 1, 3]]
    elif tag.MODEL_PIXEL_SCALE in page and tag.MODEL_TIE_POINT in page:
        scale = page.values(tag.MODEL_PIXEL_SCALE).astype(np.float64)
        tie = page.values(tag.MODEL_TIE_POINT).astype(np.float64)
        if len(scale) < 2 or len(tie) < 6:
            raise ValueError("its ModelPixelScale and ModelTiepoint are too short")
        col, row, _, x, y, _ = tie[:6]
        affine = np.array([[scale[0], 0, x - scale[0] * col], [0, -scale[1], y + scale[1] * row]])
    else:
        return None
    if not np.isfinite(affine).all() or np.linalg.det(affine[:, :2]) == 0:
        raise ValueError(f"its georeference {affine.tolist()} is none")
    if _geo_key(page, _RASTER_TYPE) != _PIXEL_IS_POINT:
        affine[:, 2] += affine[:, :2] @ (0.5, 0.5)  # it counts from the corner of the first pixel
    return affine


def _pixel_size(page: Page, georeference: np.ndarray, rows: int) -> tuple[float, float]:
    """Spacing of columns and rows in the unit of the map; degrees become metres, at the latitude of the middle row."""
    dx, dy = np.hypot(*georeference[:, :2]).tolist()
    if _geo_key(page, _MODEL_TYPE) == _GEOGRAPHIC:
        latitude = georeference[1] @ (0, (rows - 1) / 2, 1)
        dx, dy = dx * METRES_PER_DEGREE * float(np.cos(np.deg2rad(latitude))), dy * METRES_PER_DEGREE
    return dx, dy


def _epsg(page: Page) -> int | None:
    """The code of the reference system."""
    for key in (_PROJECTED_SYSTEM, _GEODETIC_SYSTEM):
        code = _geo_key(page, key)
        if code and code != _OWN_SYSTEM:
            return code
    return None


def _geo_key(page: Page, key: int) -> int | None:
    """A short value of the directory of geo keys: entries of four words, the first of which is the header."""
    words = page.values(tag.GEO_KEYS)
    entries = words[4 : len(words) // 4 * 4].reshape(-1, 4)
    found = np.flatnonzero((entries[:, 0] == key) & (entries[:, 1] == 0))
    return int(entries[found[0], 3]) if len(found) else None
