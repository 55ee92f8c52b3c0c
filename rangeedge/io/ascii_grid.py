"""Elevation models in ASCII grids, as ESRI's ArcInfo and GDAL's AAIGrid write them."""

from __future__ import annotations

import numpy as np

from .range_image import RangeImage
from .source import expect_pixels
from .text import header_lines, number, numbers

_KEYS = ("ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy", "nodata_value")


def is_ascii_grid(head: bytes) -> bool:
    return head[:5].lower() in (b"ncols", b"nrows") and head[5:6].isspace()


def read_ascii_grid(data: bytes) -> RangeImage:
    """Heights from the north-western corner on; the value of no data becomes NaN."""
    header, start = {}, 0
    for line, end in header_lines(data):
        words = line.split()
        if len(words) != 2 or words[0].lower() not in _KEYS:
            break
        header[words[0].lower()] = number(words[1].encode("latin-1"))
        start = end
    rows, cols = header.get("nrows", 0.0), header.get("ncols", 0.0)
    if not (rows == rows // 1 and cols == cols // 1):
        raise ValueError(f"its header promises {cols:g} columns and {rows:g} rows")
    expect_pixels(int(rows), int(cols))
    dx, dy = (header.get(key, header.get("cellsize", np.nan)) for key in ("dx", "dy"))
    if not (0 < dx < np.inf and 0 < dy < np.inf):
        raise ValueError("its header has no proper CELLSIZE")

    heights = numbers(data, start, int(rows) * int(cols)).reshape(int(rows), int(cols))
    heights[heights == header.get("nodata_value", -9999.0)] = np.nan
    west = header["xllcorner"] + dx / 2 if "xllcorner" in header else header.get("xllcenter", 0.0)
    south = header["yllcorner"] + dy / 2 if "yllcorner" in header else header.get("yllcenter", 0.0)
    georeference = np.array([[dx, 0, west], [0, -dy, south + dy * (rows - 1)]])
    return RangeImage(heights, {"pixelSize": (dx, dy), "heightMap": True}, georeference=georeference)
