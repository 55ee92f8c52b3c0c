"""Range images in TIFF files: one channel, or the three of points, integers or floats, in strips or tiles.

Uncompressed, PackBits, LZW, deflate and LZMA, each with any predictor; ZSTD and LERC by imagecodecs, where it is
installed.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from types import ModuleType

import numpy as np

from .. import _core
from . import tiff_tags as tag
from .geotiff import described_by
from .range_image import RangeImage
from .source import expect_at_least, expect_pixels, expect_unpacked, inflate
from .tiff_tags import Page

_UNCOMPRESSED = 1
_RGB = 2
_COLOURS = {_RGB: "RGB", 3: "a palette", 5: "CMYK", 6: "YCbCr", 8: "CIELab"}
_SHARED = 2**24  # bytes that strips and tiles may have beyond those of the file, which some of them share
Shape = tuple[int, int, int]  # rows, columns, samples
Window = tuple[int, int, int, int]  # first row and column, and those behind the last

_KINDS = {1: "u", 2: "i", 3: "f", 4: "u"}  # by sample format


def read_tiff(data: bytes) -> RangeImage:
    """The only image of the file; overviews and masks beside it are passed over."""
    found = images_of_tiff(data, tag.PAGES)
    if len(found) != 1:
        raise ValueError(
            f"it holds {len(found)} images; store the one that is meant in a file of its own (x, y and z as the three "
            "channels of one image)"
        )
    return read_page(found[0])


def images_of_tiff(data: bytes, limit: int) -> list[Page]:
    """The pages that are images, of at most `limit` pages."""
    reduced, mask = 1, 4
    return [page for page in tag.pages(data, limit) if not page.value(tag.NEW_SUBFILE_TYPE, 0) & (reduced | mask)]


def read_page(page: Page) -> RangeImage:
    """One image of a file."""
    return described_by(page, _pixels(page, page.data))


def read_window(page: Page, window: Window) -> RangeImage:
    """A part of an image, which may be larger than those that are read as a whole."""
    return described_by(page, _pixels(page, page.data, window))


def size_of_page(page: Page) -> RangeImage:
    """The geometry of an image, and zeros in its type: (rows, 1); of points it is refused."""
    dtype, samples = _sample_type(page)
    if samples != 1:
        raise ValueError("it holds points, not one channel of depths or heights")
    return described_by(page, np.zeros((page.value(tag.LENGTH), 1), dtype.newbyteorder("=")))


def _pixels(page: Page, data: bytes, window: Window | None = None) -> np.ndarray:
    """The image, or a part of it, as (rows, cols), or (rows, cols, samples) of points."""
    rows, cols = page.value(tag.LENGTH), page.value(tag.WIDTH)
    window = window or (0, 0, rows, cols)
    shape = (window[2] - window[0], window[3] - window[1])
    expect_pixels(*shape)
    _expect_no_colours(page)
    dtype, samples = _sample_type(page)
    size = rows * cols * samples * dtype.itemsize
    compression = page.value(tag.COMPRESSION, _UNCOMPRESSED)
    if compression == _UNCOMPRESSED:
        expect_at_least(len(data), size)
    else:
        expect_unpacked(size, len(data))
    separate = page.value(tag.PLANAR_CONFIGURATION, 1) == 2 and samples > 1
    if compression not in _DECODERS:
        raise ValueError(f"it is compressed by {_OTHERS.get(compression, f'method {compression}')}; use deflate or LZW")
    image = _from_segments(page, rows, cols, samples, separate, dtype, window)
    if page.value(tag.PHOTOMETRIC, 1) == _RGB and not (image < 0).any():
        raise _colours("RGB")  # half of all points have a coordinate below zero
    return image.reshape(shape if samples == 1 else (*shape, samples))


def _colours(photometric: str) -> ValueError:
    return ValueError(
        f"it holds colours ({photometric}), no range image; store points with photometric 'minisblack', as "
        "imwriteRange does, or pass them as an array"
    )


def _expect_no_colours(page: Page) -> None:
    """Refuses colours. Points that tifffile has stored as RGB, its former default, are in the order x, y, z.

    Others may have exchanged the first and the last channel, as cv2.imwrite does.
    """
    photometric = page.value(tag.PHOTOMETRIC, 1)
    by_tifffile = page.text(tag.SOFTWARE).startswith("tifffile") if tag.SOFTWARE in page else False
    floats = _all_of(page, tag.SAMPLE_FORMAT) == [3]
    if photometric in _COLOURS and not (photometric == _RGB and by_tifffile and floats):
        raise _colours(_COLOURS[photometric])


def _sample_type(page: Page) -> tuple[np.dtype, int]:
    """The type of a sample, and how many there are a pixel."""
    samples = page.value(tag.SAMPLES_PER_PIXEL, 1)
    bits, kinds = _all_of(page, tag.BITS_PER_SAMPLE), _all_of(page, tag.SAMPLE_FORMAT)
    if len(bits) != 1 or len(kinds) != 1 or kinds[0] not in _KINDS:
        raise ValueError(f"it holds samples of {bits[:9]} bits of the formats {kinds[:9]}")
    (width,), (kind,) = bits, kinds
    if width <= 8:
        raise ValueError(f"it holds {width} bits (8 bits are too coarse for edges); a range image has 16 or more")
    if width not in (16, 32, 64):
        raise ValueError(f"it holds samples of {width} bits, not of 16, 32 or 64")
    if samples not in (1, 3, 4):
        raise ValueError(f"it holds {samples} channels; a range image has one, or the three of x, y and z")
    return np.dtype(f"{page.order}{_KINDS[kind]}{width // 8}"), samples


def _all_of(page: Page, code: int) -> list[int]:
    """The different values of a tag, 1 where there is none."""
    return np.unique(page.values(code, (1,))).tolist()


def _from_segments(
    page: Page, rows: int, cols: int, samples: int, separate: bool, dtype: np.dtype, window: Window
) -> np.ndarray:
    """A part of an image of shape (rows, cols, samples) from the strips or tiles that have a share in it."""
    if page.value(tag.FILL_ORDER, 1) != 1:
        raise ValueError("the bits of its bytes are in reverse order")
    planes, depth = (samples, 1) if separate else (1, samples)
    tiled = tag.TILE_OFFSETS in page
    if tiled:
        height, width = page.value(tag.TILE_LENGTH), page.value(tag.TILE_WIDTH)
        offsets, counts = page.values(tag.TILE_OFFSETS), page.values(tag.TILE_BYTE_COUNTS)
    else:
        height, width = min(page.value(tag.ROWS_PER_STRIP, rows), rows), cols
        offsets, counts = page.values(tag.STRIP_OFFSETS), page.values(tag.STRIP_BYTE_COUNTS)
    if height < 1 or width < 1 or height * width > 4 * rows * cols + 2**20:
        raise ValueError(f"its strips or tiles have {width} x {height} pixels")
    down, right = -(-rows // height), -(-cols // width)
    if len(offsets) != planes * down * right or len(counts) != len(offsets):
        raise ValueError(f"it has {len(offsets)} strips or tiles where {planes * down * right} are needed")
    if counts.min() < 0 or counts.sum(dtype=np.float64) > len(page.data) + _SHARED:
        raise ValueError("its strips or tiles overlap")

    decode = _DECODERS[page.value(tag.COMPRESSION, _UNCOMPRESSED)]
    predictor = page.value(tag.PREDICTOR, 1) if decode is not _stored else 1
    above, before, below, behind = window
    image = np.empty((below - above, behind - before, samples), dtype.newbyteorder("="))
    for index, (offset, count) in enumerate(zip(offsets.tolist(), counts.tolist(), strict=True)):
        plane, place = divmod(index, down * right)
        top, left = place // right * height, place % right * width
        if top >= below or top + height <= above or left >= behind or left + width <= before:
            continue
        segment_rows = height if tiled else min(height, rows - top)
        expect_at_least(len(page.data), offset + count)
        packed = np.frombuffer(page.data, np.uint8, count, offset)
        shape = (segment_rows, width, depth)
        plain = decode(packed, shape, dtype)
        if len(plain) < _size(shape, dtype):
            raise ValueError(f"a strip or tile unpacks to {len(plain)} bytes where {_size(shape, dtype)} are needed")
        segment = _unpredicted(plain, shape, dtype, predictor)
        y, x = max(top, above), max(left, before)
        own = segment[y - top : below - top, x - left : behind - left]
        image[y - above : y - above + len(own), x - before : x - before + own.shape[1], plane : plane + depth] = own
    return image


def _unpredicted(plain: bytes | bytearray | memoryview, shape: Shape, dtype: np.dtype, predictor: int) -> np.ndarray:
    """Samples from what the predictor left of them: differences along the row, or of the bytes of floats."""
    rows, cols, depth = shape
    if predictor == 1:
        return np.frombuffer(plain, dtype, rows * cols * depth).reshape(shape)
    if predictor == 2:
        whole = dtype.newbyteorder("=").str.replace("f", "u").replace("i", "u")
        steps = np.frombuffer(plain, dtype.str[0] + whole[1:], rows * cols * depth).reshape(shape).astype(whole)
        return np.add.accumulate(steps, axis=1, dtype=whole).view(dtype.newbyteorder("="))
    if predictor == 3 and dtype.kind == "f":
        # The most significant bytes of a row come first, then the next ones; of all that the differences.
        size = dtype.itemsize
        steps = np.frombuffer(plain, np.uint8, rows * cols * depth * size).reshape(rows, -1, depth)
        planes = np.add.accumulate(steps, axis=1, dtype=np.uint8).reshape(rows, size, cols * depth)
        return np.ascontiguousarray(planes.transpose(0, 2, 1)).view(f">f{size}").reshape(shape)
    raise ValueError(f"it has the predictor {predictor} on {dtype}")


def _size(shape: Shape, dtype: np.dtype) -> int:
    return math.prod(shape) * dtype.itemsize


# Each decoder returns the bytes of a strip or tile of this shape and type; fewer where its data ends.


def _stored(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> memoryview:
    return packed[: _size(shape, dtype)].data


def _lzw(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> memoryview:
    plain = np.empty(_size(shape, dtype), np.uint8)
    return plain[: _core.lzw_unpack(packed, plain)].data


def _deflate(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> bytearray:
    return inflate(packed.data, _size(shape, dtype))


def _lzma(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> bytes:
    import lzma  # not every Python has it

    return lzma.LZMADecompressor(memlimit=2**28).decompress(packed.tobytes(), _size(shape, dtype))


def _pack_bits(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> bytes:
    """Runs: a byte n below 128 announces n + 1 bytes, one above says that the next is repeated 257 - n times."""
    data, plain, at, size = packed.tobytes(), bytearray(), 0, _size(shape, dtype)
    while at < len(data) and len(plain) < size:
        head = data[at]
        if head < 128:
            plain += data[at + 1 : at + 2 + head]
            at += 2 + head
        elif head > 128:
            plain += data[at + 1 : at + 2] * (257 - head)
            at += 2
        else:
            at += 1
    return bytes(plain)


def _zstd(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> bytes:
    return _imagecodecs("ZSTD").zstd_decode(packed.tobytes(), out=_size(shape, dtype))


def _lerc(packed: np.ndarray, shape: Shape, dtype: np.dtype) -> bytes:
    """Perhaps packed again by deflate or ZSTD. What its mask leaves out is NaN, of integers 0."""
    codecs = _imagecodecs("LERC")
    blob = packed.tobytes()
    if blob[:1] == b"\x78":
        blob = bytes(inflate(blob, 2 * _size(shape, dtype) + 2**16))
    elif blob[:4] == b"\x28\xb5\x2f\xfd":
        blob = codecs.zstd_decode(blob, out=2 * _size(shape, dtype) + 2**16)
    plain = np.empty(shape if shape[2] > 1 else shape[:2], dtype.newbyteorder("="))
    plain, mask = codecs.lerc_decode(blob, masks=True, out=plain)
    if mask is not None and not mask.all():
        plain[~mask] = np.nan if dtype.kind == "f" else 0
    return plain.astype(dtype).tobytes()


def _imagecodecs(compression: str) -> ModuleType:
    try:
        import imagecodecs
    except ImportError:
        raise ImportError(
            f"it is compressed by {compression}, for which imagecodecs is needed: pip install 'rangeedge[tiff]', or "
            "store it uncompressed or by deflate"
        ) from None
    return imagecodecs


# By the number of the compression.
_DECODERS: dict[int, Callable[[np.ndarray, Shape, np.dtype], bytes | bytearray | memoryview]] = {
    _UNCOMPRESSED: _stored,
    5: _lzw,
    8: _deflate,
    32946: _deflate,
    32773: _pack_bits,
    34925: _lzma,
    34887: _lerc,
    50000: _zstd,
}
_OTHERS = {6: "JPEG", 7: "JPEG", 34712: "JPEG 2000", 50001: "WebP", 50002: "JPEG XL"}


def write_tiff(src: np.ndarray) -> bytes:
    """An uncompressed TIFF of one channel, or of the three or four of points."""
    samples = 1 if src.ndim == 2 else src.shape[2]
    if src.dtype.kind not in "iuf" or src.dtype.itemsize not in (2, 4, 8) or src.nbytes >= 2**32 - 1024:
        raise ValueError("integers or floats of 16, 32 or 64 bits, of less than 4 GiB")
    pixels = src.astype(src.dtype.newbyteorder("<"), copy=False).tobytes()
    short, long = 3, 4
    tags = [
        (tag.WIDTH, long, [src.shape[1]]),
        (tag.LENGTH, long, [src.shape[0]]),
        (tag.BITS_PER_SAMPLE, short, [8 * src.dtype.itemsize] * samples),
        (tag.COMPRESSION, short, [_UNCOMPRESSED]),
        (tag.PHOTOMETRIC, short, [1]),
        (tag.STRIP_OFFSETS, long, [8]),
        (tag.SAMPLES_PER_PIXEL, short, [samples]),
        (tag.ROWS_PER_STRIP, long, [src.shape[0]]),
        (tag.STRIP_BYTE_COUNTS, long, [len(pixels)]),
        (tag.PLANAR_CONFIGURATION, short, [1]),
        (tag.EXTRA_SAMPLES, short, [0] * (samples - 1)),
        (tag.SAMPLE_FORMAT, short, [{"u": 1, "i": 2, "f": 3}[src.dtype.kind]] * samples),
    ]
    tags = [(code, kind, values) for code, kind, values in tags if values]
    start = 8 + len(pixels) + len(pixels) % 2
    behind = start + 2 + 12 * len(tags) + 4
    entries, more = struct.pack("<H", len(tags)), b""
    for code, kind, values in tags:
        packed = struct.pack(f"<{len(values)}{'H' if kind == short else 'I'}", *values)
        if len(packed) > 4:
            packed, more = struct.pack("<I", behind + len(more)), more + packed
        entries += struct.pack("<HHI", code, kind, len(values)) + packed.ljust(4, b"\0")
    return struct.pack("<2sHI", b"II", 42, start) + pixels + bytes(len(pixels) % 2) + entries + bytes(4) + more
