"""Files of the classic scanners, and their points by hand."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_cloud_files import grid32
from test_io import depth16, same, written

import rangeedge
from rangeedge import imreadRange, imwriteRange
from rangeedge.io.calibration import abwPoints, perceptronPoints

SUN = struct.pack(">8I", 0x59A66A95, 512, 512, 8, 512 * 512, 1, 0, 0)


def test_abw_by_hand():
    code = np.zeros((512, 512), np.uint8)
    code[255, 255], code[155, 355], code[355, 255] = 100, 200, 200
    first, second = abwPoints(code, 1), abwPoints(code, 2)
    # 100 / 0.773545 + 785.410786 and 100 / 0.791686 + 771.016866, on the axis
    assert_allclose(first[255, 255], [0, 0, 914.6859], rtol=1e-6)
    assert_allclose(second[255, 255], [0, 0, 897.3296], rtol=1e-6)
    # depth 1043.9610 at 100 columns to the right, 100 rows up: / 16.10981722, and / 1.4508 for the row
    assert_allclose(first[155, 355], [64.8027, -44.6669, 1043.9610], rtol=2e-6)
    assert_allclose(first[355, 255], [0, 44.6669, 1043.9610], rtol=2e-6)
    assert np.isnan(first).all(axis=2).sum() == 512 * 512 - 3
    assert np.isnan(first[code == 0]).all()
    assert first.dtype == np.float32


def test_abw_file(tmp_path):
    code = np.random.default_rng(0).integers(0, 256, (512, 512), dtype=np.uint8)
    for name, calibration in (("abw.test.19.range", 1), ("abw.test.1.range", 2), ("x.ras", 2), ("abw.test.190", 2)):
        path = written(tmp_path, name, body=SUN + code.tobytes())
        same(imreadRange(path).src, abwPoints(code, calibration))
    same(imreadRange(path, calibration=1).src, abwPoints(code, 1))
    coloured = SUN[:24] + struct.pack(">II", 1, 6) + b"\1" * 6 + code.tobytes()
    same(imreadRange(written(tmp_path, "map.ras", body=coloured)).src, abwPoints(code, 2))


def test_perceptron_by_hand():
    code = np.full((512, 512), 1000, np.uint16)
    points = perceptronPoints(code)
    assert points.dtype == np.float32
    # Straight ahead, between columns 255 and 256, the beam leaves the mirrors as if they were not there:
    # (1000 + 830.3) * 0.20236 = 370.3795
    centre = points[255:257, 255:257].reshape(4, 3)
    assert_allclose(centre[:, 2], 370.3795, atol=1e-3)
    assert_allclose(centre.mean(axis=0)[:2], 0, atol=1e-3)
    # Column 0: alpha = 51.65 * 255.5 / 512 = 25.774560, beta = 0.035869 degrees; dz = -3 (1 - cos alpha) = -0.298464,
    # dy = dz tan(45 + beta / 2) = -0.298651, dx = (5.5 + dy) tan alpha = 2.511582, ray = 370.401981.
    assert_allclose(points[255, 0], [-163.573957, 0.089836, 333.252872], rtol=2e-6, atol=1e-5)
    assert_allclose(points[255, 511], [163.573957, 0.089836, 333.252872], rtol=2e-6, atol=1e-5)
    # Row 0: beta = 36.73 * 255.5 / 512 = 18.329131 degrees upward.
    assert_allclose(points[0, 255], [-0.330900, -116.475098, 351.588431], rtol=1e-5)
    assert_allclose(perceptronPoints(np.zeros((1, 1), int))[0, 0], [-75.581497, -47.210334, 143.456863], rtol=1e-6)


def perceptron_header(rows=512, cols=512):
    return [f"rows : {rows}", f"columns : {cols}", *(f"key {i} : value {i}" for i in range(8))]


@pytest.mark.parametrize("gap", [b"", b"\n", b"\r\n"])
def test_perceptron_file(tmp_path, gap):
    random = np.random.default_rng(0)
    code, reflectance = random.integers(0, 4096, (512, 512)), random.integers(-(2**19), 2**19, (512, 512))
    if gap:
        code[0, 0], reflectance[0, 0] = 0x20A, 0x0A0A0  # words that begin with white space
    body = gap + (code + 4096 * reflectance).astype(">i4").tobytes()
    same(imreadRange(written(tmp_path, "perc.test.3", *perceptron_header(), body=body)).src, perceptronPoints(code))


def technical_arts(header, rows=2, cols=3, order=slice(None)):
    flag = np.array([[1, 1, 0], [1, 1, 1]])[:rows, :cols]
    images = [flag, *np.where(flag[..., None], grid32(), 0).transpose(2, 0, 1)]
    return [*header, *(" ".join(f"{v:g}" for v in row) for image in images for row in image)]


@pytest.mark.parametrize(
    "header",
    [
        ("rows 2", "columns 3", ""),
        ("2 rows", "3 cols", "pixel float"),
        ("", "2 3", ""),
        ("image", "ncols = 3", "nrows = 2"),
    ],
)
def test_technical_arts(tmp_path, header):
    image = imreadRange(written(tmp_path, "cube.dat", *technical_arts(header)))
    same(image.src, grid32())
    assert image.geometry == {"heightMap": True}


def test_scanners_refuse_what_is_no_code():
    for code in (np.zeros((2, 2), np.uint16), np.zeros((2, 2, 3), np.uint8), [[1]]):
        with pytest.raises(rangeedge.error, match="`code`"):
            abwPoints(code)
    for code in (np.full((2, 2), 4096), np.full((2, 2), -1), np.zeros((2, 2)), None):
        with pytest.raises(rangeedge.error, match="`code`"):
            perceptronPoints(code)
    for calibration in (0, 3, None, True, 1.0):
        with pytest.raises(rangeedge.error, match="`calibration`"):
            abwPoints(np.zeros((2, 2), np.uint8), calibration)


@pytest.mark.parametrize("end", [0, 4, 31, 32, 1000, -1])
def test_truncated_scans(tmp_path, end):
    header = "".join(f"{line}\n" for line in perceptron_header()).encode()
    for data in (SUN + bytes(512 * 512), header + b"\n" + bytes(512 * 512 * 4)):
        path = written(tmp_path, "scan", body=data)
        assert imreadRange(path).src.shape == (512, 512, 3)
        path.write_bytes(data[:end] if end >= 0 else data + b"x")
        with pytest.raises(rangeedge.error, match="cannot read"):
            imreadRange(path)


@pytest.mark.parametrize(
    ("lines", "what"),
    [
        (perceptron_header(4, 4), "no Perceptron"),
        (["a poem", "in three lines", "without numbers", "at all"], "none of PNG"),
        (["2", "lines"], "none of PNG"),
        (["rows 2", "cols 3", "", "1 2 3"], "where 24 values"),
    ],
)
def test_text_headers_that_are_refused(tmp_path, lines, what):
    with pytest.raises(rangeedge.error, match=what):
        imreadRange(written(tmp_path, "a", *lines))


def test_calibration_belongs_to_abw(tmp_path):
    imwriteRange(tmp_path / "a.png", depth16())
    with pytest.raises(rangeedge.error, match="no ABW image"):
        imreadRange(tmp_path / "a.png", calibration=1)
    with pytest.raises(rangeedge.error, match="`calibration`"):
        imreadRange(tmp_path / "a.png", calibration=3)
