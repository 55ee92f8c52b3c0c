"""TIFF files of every layout, by tifffile, Pillow and OpenCV."""

from __future__ import annotations

import io

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from PIL import Image

import rangeedge
from rangeedge import imreadRange, imwriteRange
from rangeedge.io.tiff import read_tiff, write_tiff

DTYPES = ["u2", "i2", "u4", "i4", "u8", "f2", "f4", "f8"]


def random_image(shape, dtype, seed):
    """Values that pack well, and for floats some that are none."""
    random = np.random.default_rng(seed)
    image = np.cumsum(random.integers(0, 3, shape), axis=1).astype(dtype)
    if image.dtype.kind == "f":
        image.ravel()[random.integers(image.size, size=1 + image.size // 9)] = np.nan
    return image


@settings(max_examples=250, deadline=None)
@given(st.data())
def test_layouts(data):
    compression = data.draw(st.sampled_from([None, "lzw", "deflate", "packbits", "lzma", "zstd"]))
    if compression in ("lzw", "zstd"):
        pytest.importorskip("imagecodecs")
    image = random_image(
        (data.draw(st.integers(1, 40)), data.draw(st.integers(2, 40)), data.draw(st.sampled_from([1, 3, 4]))),
        data.draw(st.sampled_from(DTYPES)),
        data.draw(st.integers(0, 99)),
    )
    options = {"compression": compression, "photometric": "minisblack"}
    options |= data.draw(st.sampled_from([{}, {"byteorder": ">"}, {"bigtiff": True}]))
    options |= data.draw(st.sampled_from([{}, {"tile": (16, 16)}, {"tile": (32, 16)}, {"rowsperstrip": 3}]))
    predictors = [1, 3] if image.dtype.kind == "f" else [1, 2]
    if compression in ("lzw", "deflate", "zstd"):
        options["predictor"] = data.draw(st.sampled_from(predictors))
    separate = image.shape[2] > 1 and data.draw(st.booleans())
    expected = image[..., 0] if image.shape[2] == 1 else image
    if image.shape[2] > 1:
        options["planarconfig"] = "separate" if separate else "contig"
    stream = io.BytesIO()
    tifffile.imwrite(stream, np.moveaxis(image, 2, 0) if separate else expected, **options)
    found = read_tiff(stream.getvalue()).src
    assert found.dtype == image.dtype
    assert_array_equal(found, expected)


@pytest.mark.parametrize("compression", [None, "tiff_lzw", "tiff_adobe_deflate", "tiff_deflate", "packbits"])
@pytest.mark.parametrize("mode", ["I;16", "I", "F"])
def test_files_of_pillow(tmp_path, mode, compression):
    dtype = {"I;16": np.uint16, "I": np.int32, "F": np.float32}[mode]
    image = random_image((17, 23), dtype, 1)
    Image.fromarray(image).save(tmp_path / "a.tif", compression=compression)
    assert_array_equal(imreadRange(tmp_path / "a.tif").src, image)


@pytest.mark.parametrize("compression", [1, 5, 8, 32946])
@pytest.mark.parametrize("predictor", [1, 2])
@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.float64])
def test_files_of_opencv(dtype, compression, predictor):
    image = random_image((17, 23), dtype, 2)
    options = [cv2.IMWRITE_TIFF_COMPRESSION, compression, cv2.IMWRITE_TIFF_PREDICTOR, predictor]
    if predictor == 2 and dtype != np.uint16:
        options = options[:2]
    written, data = cv2.imencode(".tiff", image, options)
    assert written
    assert_array_equal(read_tiff(data.tobytes()).src, image)


@pytest.mark.parametrize("dtype", [d for d in DTYPES])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_others_read_what_we_write(dtype, channels):
    image = random_image((5, 7, channels), dtype, 3)
    image = image[..., 0] if channels == 1 else image
    with tifffile.TiffFile(io.BytesIO(write_tiff(image))) as file:
        assert_array_equal(file.asarray(), image)
    if channels == 1 and dtype in ("u2", "f4", "f8"):
        found = cv2.imdecode(np.frombuffer(write_tiff(image), np.uint8), cv2.IMREAD_UNCHANGED)
        assert_array_equal(found, image)


def test_a_reduced_image_may_come_first(tmp_path):
    image = random_image((20, 20), np.float32, 4)
    with tifffile.TiffWriter(tmp_path / "a.tif") as writer:
        writer.write(image[::2, ::2], photometric="minisblack", subfiletype=1)
        writer.write(image, photometric="minisblack")
        writer.write(image > 0, photometric="mask", subfiletype=4)
    assert_array_equal(imreadRange(tmp_path / "a.tif").src, image)


def test_strips_that_are_not_there(tmp_path):
    """More rows than strips: not filled with anything, but refused."""
    stream = io.BytesIO()
    tifffile.imwrite(stream, np.ones((8, 8), np.float32), rowsperstrip=2, photometric="minisblack")
    data = stream.getvalue()
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        rows = file.pages.first.tags["ImageLength"].valueoffset
    (tmp_path / "a.tif").write_bytes(data[:rows] + (10).to_bytes(4, "little") + data[rows + 4 :])
    with pytest.raises(rangeedge.error, match=r"truncated|4 strips or tiles where 5"):
        imreadRange(tmp_path / "a.tif")


def test_what_is_written_leaves_its_source_alone(tmp_path):
    image = np.ones((4, 6), ">f4")
    image.setflags(write=False)
    imwriteRange(tmp_path / "a.tif", image[:, ::2])
    assert_array_equal(imreadRange(tmp_path / "a.tif").src, image[:, ::2])
