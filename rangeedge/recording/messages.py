"""Messages of ROS as range images: sensor_msgs/Image, CompressedImage (compressedDepth), PointCloud2, CameraInfo.

Units after REP 118: integers are millimetres, floats metres. Messages of ROS 1 and 2 alike, as `rosbags` or `rclpy`
have them: only their fields are looked at.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..io import RangeImage
from ..io.pictures import PNG_MAGIC, read_png
from ..io.source import expect_at_least, expect_pixels

_DEPTHS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4", "64FC1": "f8"}
_FLOATS = {7: "f4", 8: "f8"}  # of the fields of a cloud
_LONGEST = 11  # digits of a number of RVL, which has 32 bits
_HEADER = 12  # bytes before the picture of compressedDepth: format, and the two numbers of quantization

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
CLOUD = "sensor_msgs/msg/PointCloud2"
CAMERA = "sensor_msgs/msg/CameraInfo"


def range_image_of(message: Any) -> RangeImage:
    """The range image that a message of any of the three kinds holds."""
    if hasattr(message, "point_step"):
        return RangeImage(points_of_cloud(message))
    if hasattr(message, "encoding"):
        return RangeImage(depth_of_image(message))
    return RangeImage(depth_of_compressed(message))


def depth_of_image(message: Any) -> np.ndarray:
    """The depths of an Image, in the type of its encoding."""
    if message.encoding not in _DEPTHS:
        raise ValueError(f"its encoding is {message.encoding!r}, no depth, which is {', '.join(_DEPTHS)}")
    expect_pixels(message.height, message.width)
    dtype = np.dtype((">" if message.is_bigendian else "<") + _DEPTHS[message.encoding])
    rows = _rows(message.data, message.height, message.step, message.width * dtype.itemsize)
    return rows.view(dtype).astype(dtype.newbyteorder("="))


def _rows(data: Any, height: int, step: int, used: int) -> np.ndarray:
    """The `used` bytes of each row, of which one begins every `step` bytes."""
    content = np.frombuffer(data, np.uint8)
    if step < used:
        raise ValueError(f"its rows have {step} bytes where {used} are needed")
    expect_at_least(len(content), (height - 1) * step + used)
    return np.ascontiguousarray(np.lib.stride_tricks.as_strided(content, (height, used), (step, 1)))


def depth_of_compressed(message: Any) -> np.ndarray:
    """The depths of a CompressedImage of compressed_depth_image_transport.

    The format is ``16UC1; compressedDepth``, perhaps followed by ``png`` or ``rvl``. Floats are stored as integers v of
    the inverse depth, depth = a / (v - b) with the two numbers a and b of the header; v = 0 is no data.
    """
    encoding, _, transport = (part.strip() for part in message.format.partition(";"))
    if not transport.startswith("compressedDepth") or encoding not in ("16UC1", "32FC1"):
        raise ValueError(f"its format is {message.format!r}, no compressedDepth of 16UC1 or 32FC1")
    content = np.frombuffer(message.data, np.uint8)
    expect_at_least(len(content), _HEADER + 8)
    a, b = np.frombuffer(message.data, "<f4", 2, 4).tolist()
    packed = content[_HEADER:]
    if transport.endswith("rvl"):
        stored = _unpacked_rvl(packed)
    elif packed[:8].tobytes() == PNG_MAGIC:
        stored = read_png(packed.tobytes()).astype(np.uint16)
    else:
        raise ValueError("its picture is garbled, or no PNG")
    if encoding == "16UC1":
        return stored
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(stored > 0, a / (stored - np.float32(b)), np.nan).astype(np.float32)


def _unpacked_rvl(packed: np.ndarray) -> np.ndarray:
    """Depths of the codec RVL (A. Wilson, Fast Lossless Depth Image Compression, 2017).

    A stream of numbers, each of them digits of three bits, least ones first, with a fourth bit where another follows;
    the digits lie in 32-bit words from the highest on. The numbers are: how many zeros, how many depths, the depths as
    differences, signs in the lowest bit; and so on.
    """
    expect_at_least(len(packed), 8)
    cols, rows = np.frombuffer(packed.tobytes(), "<i4", 2).tolist()
    expect_pixels(rows, cols)
    words = np.frombuffer(packed[8 : 8 + (len(packed) - 8) // 4 * 4].tobytes(), "<u4")
    digits = (words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32)).ravel() & 15
    last = np.flatnonzero(digits < 8)
    expect_at_least(len(last), 2, "numbers")
    first = np.concatenate([[0], last[:-1] + 1])
    if (last - first >= _LONGEST).any():
        raise ValueError("its numbers are garbled")
    place = np.arange(last[-1] + 1) - np.repeat(first, last - first + 1)
    values = (digits[: last[-1] + 1].astype(np.int64) & 7) << (3 * place)
    numbers = np.add.reduceat(values, first)
    depth = np.zeros(rows * cols, np.uint16)
    at = pixel = 0
    previous = np.int64(0)
    while pixel < len(depth):
        expect_at_least(len(numbers), at + 2, "numbers")
        zeros, count = numbers[at : at + 2].tolist()
        pixel, at = pixel + zeros, at + 2
        expect_at_least(len(numbers), at + count, "numbers")
        if pixel + count > len(depth):
            raise ValueError("its runs are longer than the picture")
        steps = numbers[at : at + count]
        values = previous + np.cumsum((steps >> 1) ^ -(steps & 1))
        if count and not 0 <= values.min() <= values.max() < 2**16:
            raise ValueError("its depths have more than 16 bits")
        depth[pixel : pixel + count] = values
        previous = values[-1] if count else previous
        pixel, at = pixel + count, at + count
    return depth.reshape(rows, cols)


def points_of_cloud(message: Any) -> np.ndarray:
    """The points (H, W, 3) of an organized PointCloud2."""
    if message.height < 2:
        raise ValueError(f"its {message.width} points are unorganized, not in the rows that scan lines need")
    expect_pixels(message.height, message.width)
    fields = {field.name: field for field in message.fields}
    if not {"x", "y", "z"} <= fields.keys():
        raise ValueError(f"its fields are {', '.join(fields)}: no x, y and z")
    kinds = {fields[axis].datatype for axis in "xyz"}
    if not kinds <= _FLOATS.keys():
        raise ValueError(f"its coordinates are of the datatypes {sorted(kinds)}, no floats")
    order = ">" if message.is_bigendian else "<"
    layout = np.dtype(
        {
            "names": list("xyz"),
            "formats": [order + _FLOATS[fields[axis].datatype] for axis in "xyz"],
            "offsets": [fields[axis].offset for axis in "xyz"],
            "itemsize": message.point_step,
        }
    )
    rows = _rows(message.data, message.height, message.row_step, message.width * message.point_step)
    records = rows.view(layout)
    return np.stack([records[axis].astype(np.float32) for axis in "xyz"], axis=-1)


def camera_of(message: Any, rectified: bool = False) -> dict[str, Any]:
    """The camera of a CameraInfo as keywords; that of rectified images has no distortion. Empty if not calibrated."""

    def values(name: str) -> np.ndarray:
        return np.array(getattr(message, name, getattr(message, name.lower(), ())), dtype=np.float64)

    K = values("P").reshape(3, 4)[:, :3] if rectified else values("K").reshape(3, 3)
    if not (K[0, 0] > 0 and K[1, 1] > 0):
        return {}
    K, size = _as_sent(message, K)
    known = {"K": K} if size is None else {"K": K, "imageSize": size}
    distortion = values("D")
    if rectified or not distortion.any():
        return known
    if message.distortion_model not in ("plumb_bob", "rational_polynomial"):
        raise ValueError(f"its distortion is {message.distortion_model!r}; rectify the images, or give -K")
    return {**known, "distCoeffs": distortion}


def _as_sent(message: Any, K: np.ndarray) -> tuple[np.ndarray, tuple[int, int] | None]:
    """The matrix of the images as they are sent, cut and with pixels taken together, and the size of these."""
    region = getattr(message, "roi", None)
    left, top = (region.x_offset, region.y_offset) if region else (0, 0)
    width = (region and region.width) or getattr(message, "width", 0)
    height = (region and region.height) or getattr(message, "height", 0)
    across, down = (max(1, getattr(message, name, 1)) for name in ("binning_x", "binning_y"))
    K = K - np.array([[0, 0, left], [0, 0, top], [0, 0, 0]])
    K /= np.array([[across], [down], [1]])
    return K, (width // across, height // down) if width and height else None
