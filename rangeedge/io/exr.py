"""Depth in OpenEXR files, by the package OpenEXR."""

from __future__ import annotations

import io
from types import ModuleType

import numpy as np

from ..cancellation import apart
from .source import expect_pixels, expect_unpacked

BACKGROUND = 1e10  # what Blender writes where a ray hits nothing

_POSITIONS = ("", "position", "points", "xyz")  # layers whose X, Y and Z are points


def read_exr(data: bytes) -> np.ndarray:
    """The channel of depth of whichever part has one, or X, Y and Z as points; the background is NaN."""
    openexr = _openexr()
    _expect_bounds(openexr, data)
    with openexr.File(io.BytesIO(data), separate_channels=True) as file:
        channels = {
            f"{part.name()}.{name}" if len(file.parts) > 1 else name: channel.pixels
            for part in file.parts
            for name, channel in part.channels.items()
        }
        if not channels:  # OpenEXR leaves out what it cannot unpack
            raise ValueError("its pixels are truncated or garbled")
        image = np.array(_depth_or_points(channels))  # the pixels belong to the file
    if image.dtype == np.float16:
        image = image.astype(np.float32)
    if image.dtype.kind == "f":
        image[(image >= BACKGROUND) & (image < np.inf)] = np.nan
    return image


def _expect_bounds(openexr: ModuleType, data: bytes) -> None:
    """Refuses sizes that the file cannot hold, by the headers alone."""
    with openexr.File(io.BytesIO(data), separate_channels=True, header_only=True) as file:
        unpacked = 0
        for part in file.parts:
            low, high = (corner.astype(np.int64) for corner in part.header["dataWindow"])
            cols, rows = (high - low + 1).tolist()
            expect_pixels(rows, cols)
            unpacked += 4 * rows * cols * len(part.header["channels"])
        expect_unpacked(unpacked, len(data))


def _depth_or_points(channels: dict[str, np.ndarray]) -> np.ndarray:
    """The one channel that holds depth; else points; else the only channel, or one of three equal colours."""
    layers: dict[str, dict[str, str]] = {}
    for name in channels:
        layer, _, channel = name.lower().rpartition(".")
        layers.setdefault(layer, {})[channel] = name
    listed = ", ".join(channels)

    depths = [depth for layer, found in layers.items() if (depth := _depth_channel(layer, found))]
    if len(depths) > 1:
        raise ValueError(f"which of its channels {', '.join(depths)} is meant? Store that one alone")
    if depths:
        return channels[depths[0]]
    positions = [found for layer, found in layers.items() if _last(layer) in _POSITIONS and found.keys() >= set("xyz")]
    if len(positions) == 1:
        return np.stack([channels[positions[0][axis]] for axis in "xyz"], axis=-1)
    values = list(channels.values())
    if len(values) == 1 or (
        len(layers) == 1 and all(np.array_equal(values[0], value, equal_nan=True) for value in values[1:])
    ):
        return values[0]
    raise ValueError(f"none of its channels ({listed}) is called Z or Depth, nor X, Y and Z; render the depth pass")


def _last(layer: str) -> str:
    return layer.rpartition(".")[2]


def _depth_channel(layer: str, found: dict[str, str]) -> str | None:
    """Z or Depth, but of no vector and of no mist; or the only channel of a layer called Depth."""
    if _last(layer) == "depth" and len(found) == 1:
        return next(iter(found.values()))
    if _last(layer) == "mist" or found.keys() >= {"x", "y"}:
        return None
    return next((found[name] for name in ("z", "depth", "d") if name in found), None)


def write_exr(src: np.ndarray) -> bytes:
    """Depth as channel Z."""
    if src.ndim != 2 or src.dtype != np.float32:
        raise ValueError("(H, W) float32")
    openexr = _openexr()
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    stream = io.BytesIO()
    apart(src.size, openexr.File(header, {"Z": np.ascontiguousarray(src)}).write, stream)
    return stream.getvalue()


def _openexr() -> ModuleType:
    try:
        import OpenEXR  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        raise ImportError(
            "for EXR the package OpenEXR is needed: pip install 'rangeedge[exr]', or store the depth as .tiff or .npy"
        ) from None
    return OpenEXR
