"""What people pass, and what plainly does not fit it: read right, refused with the way out, or warned of."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import RangeEdgeWarning, ScanLineParams, detectEdges, edgeStrength, estimateNoise
from rangeedge.frame import read_frame

K = np.array([[100.0, 0, 39.5], [0, 110, 29.5], [0, 0, 1]])
Z = np.where(np.arange(80) < 40, 1.0, 1.3) * np.ones((60, 1)) + np.random.default_rng(0).normal(0, 0.001, (60, 80))
RIGHT = edgeStrength(Z, K=K)
INF = np.inf


def same(found):
    return all(np.array_equal(a, b) for a, b in zip(found, RIGHT, strict=True))


class Owner:
    def __array__(self, dtype=None, copy=None):
        return Z


class Packed:
    def __init__(self, values):
        self.values = values

    def __dlpack__(self, **options):
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


@pytest.mark.parametrize(
    "src", [Z[..., None], np.ma.array(Z), Owner(), Packed(Z.copy()), cv2.UMat(Z)], ids=lambda src: type(src).__name__
)
def test_forms_of_an_image(src):
    assert same(edgeStrength(src, K=K))


def test_masked_pixels_have_no_data():
    hidden = np.zeros(Z.shape, bool)
    hidden[10:20, 10:30] = True
    right = edgeStrength(np.where(hidden, np.nan, Z), K=K)
    for a, b in zip(edgeStrength(np.ma.array(Z, mask=hidden), K=K), right, strict=True):
        np.testing.assert_array_equal(a, b)


def test_records_are_points():
    v, u = np.indices(Z.shape)
    points = np.stack([(u - 39.5) / 100 * Z, (v - 29.5) / 110 * Z, Z], -1).astype(np.float32)
    records = np.zeros(Z.shape, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("rgb", "u4")])
    for i, name in enumerate("xyz"):
        records[name] = points[..., i]
    np.testing.assert_array_equal(detectEdges(records), detectEdges(points))
    with pytest.raises(rangeedge.error, match="rows and columns of the sensor"):
        detectEdges(records.ravel())
    with pytest.raises(rangeedge.error, match="fields x, y and z"):
        detectEdges(records[["x", "y"]])


@pytest.mark.parametrize(
    ("src", "way_out"),
    [
        ("depth.png", "imreadRange reads files"),
        (None, "NoneType"),
        (np.zeros((5000, 3)), "reshape it if they are in order"),
        (np.zeros((1, 20000, 3)), "reshape it if they are in order"),
        ([[1.0, 2.0]], "list"),
    ],
)
def test_what_is_no_image_is_refused(src, way_out):
    with pytest.raises(rangeedge.error, match=f"edgeStrength: `src` must be .*{way_out}"):
        edgeStrength(src)


# Cameras.


@pytest.mark.parametrize(
    "camera",
    [
        (100, 110, 39.5, 29.5),
        K.ravel().tolist(),
        np.column_stack([K, np.zeros(3)]),
        "fx: 100\nfy: 110\ncx: 39.5\ncy: 29.5\n",
    ],
)
def test_forms_of_a_camera(camera, tmp_path):
    if isinstance(camera, str):
        (tmp_path / "camera.yaml").write_text(camera)
        camera = tmp_path / "camera.yaml"
    assert same(edgeStrength(Z, K=camera))


def test_the_distortion_of_a_file_counts(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text('{"K": [100, 0, 39.5, 0, 110, 29.5, 0, 0, 1], "D": [0.1, 0, 0, 0, 0]}')
    params = ScanLineParams(K=str(path))
    np.testing.assert_array_equal(params.K, K)
    np.testing.assert_array_equal(params.distCoeffs, [0.1, 0, 0, 0, 0])
    with pytest.raises(rangeedge.error, match=r"ScanLineParams: `K` must be a camera .*missing\.yaml"):
        ScanLineParams(K="missing.yaml")


# Values of no data.


@pytest.mark.parametrize(
    ("values", "invalid"),
    [
        (-9999, -9999),
        (np.float32(-3.4028234663852886e38), -3.4028234663852886e38),
        (65535, (0, 65535)),
        (9.5, [(8, INF)]),
        (0, [-1, (-0.5, 0.5)]),
    ],
)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_values_of_no_data(values, invalid, dtype):
    hole = np.hypot(*(np.indices(Z.shape) - 20)) < 6
    z = Z.astype(dtype)
    z[hole] = values
    for geometry in ({"K": K}, {"pixelSize": 0.01}, {"heightMap": True}):
        valid = read_frame(z, ScanLineParams(invalid=invalid, **geometry)).valid
        np.testing.assert_array_equal(valid == 0, hole)


def test_values_of_no_data_are_those_stored():
    z = np.rint(1000 * Z).astype(np.int16)
    z[3, 4], z[5, 6] = 8000, 4095
    valid = read_frame(z, ScanLineParams(K=K, invalid=[4095, (5000, INF)])).valid
    assert np.argwhere(valid == 0).tolist() == [[3, 4], [5, 6]]
    points = np.dstack([Z, Z, Z])
    points[3, 4], points[5, 6, 2], points[7, 8, :2] = -1, 9, -1
    valid = read_frame(points, ScanLineParams(heightMap=True, invalid=[-1, (8, 10)])).valid
    assert np.argwhere(valid == 0).tolist() == [[3, 4], [5, 6]]


@pytest.mark.parametrize("invalid", ["0", [(2, 1)], [None], True, [(1, 2, 3)]])
def test_what_is_no_value_of_no_data(invalid):
    with pytest.raises(rangeedge.error, match="ScanLineParams: `invalid` must be"):
        ScanLineParams(invalid=invalid)


def test_zeros_of_a_plain_image_are_asked_about():
    z = np.full((80, 100), 1.5)
    z[:4, :4] = 0
    with pytest.raises(rangeedge.error, match="edgeStrength: `src` is 0 at 16 of 8000 pixels: say invalid=0"):
        edgeStrength(z)
    assert not edgeStrength(z, noise=0.001, invalid=0).jump.any()
    assert edgeStrength(z, noise=0.001, invalid=()).jump.any()
    assert not edgeStrength(z, noise=0.001, K=K).jump.any()


# Warnings.


HOLES = np.zeros(Z.shape, bool)
HOLES[10:14, 20:25] = True
CAMERA = np.random.default_rng(5).random((480, 640))


@pytest.mark.parametrize(
    ("src", "options", "text"),
    [
        (np.full((480, 640), 1500, np.uint16), {}, "looks like the image of a depth camera"),
        ((40 * Z).astype(np.uint8), {"pixelSize": 1.0}, "8 bits"),
        (Z, {"K": K, "eps": 5.0}, "eps=5 exceeds"),
        (Z, {"K": K, "noise": 5.0}, "noise=5 exceeds"),
        ((2000 * Z).astype(np.uint16), {"K": K, "depthFactor": 1.0}, "depthFactor=1 "),
        (np.where(HOLES, 65535, 2000 * Z).astype(np.uint16), {"K": K}, "20 of .* are exactly 65535,.*invalid=65535"),
        (np.where(HOLES, -9999, Z), {"heightMap": True}, "20 of .* are exactly -9999"),
        (np.where(HOLES, -9999, 3000 * Z), {"heightMap": True}, "20 of .* are exactly -9999"),
        (np.where(HOLES, -32767, 100 * Z).astype(np.int16), {"heightMap": True}, "20 of .* are exactly -32767"),
        (np.where(HOLES, np.finfo("f4").min, Z).astype("f4"), {"heightMap": True}, "20 of .* are exactly -3.40282e.38"),
        (np.where(HOLES, 1e10, Z).astype("f4"), {"K": K}, "20 of .* are exactly 1e.10"),
        (Z, {"K": (0.0035, 0.0035, 0.0024, 0.0018)}, "hardly in pixels of an image"),
        (Z, {"K": (140, 140, 3190, 59.5)}, "hardly in pixels of an image"),
        (Z, {"K": (39.5, 29.5, 140, 140)}, "its order is fx, fy, cx, cy"),
        (np.full((128, 1024), 1500, np.uint16), {}, "range image of a scanner that turns .*sweepToPoints"),
        (np.where(CAMERA < 0.05, np.nan, 2 + CAMERA / 10), {}, "looks like the image of a depth camera"),
    ],
)
def test_what_hardly_fits_is_warned_of(src, options, text):
    with pytest.warns(RangeEdgeWarning, match=text) as found:
        edgeStrength(src, **options)
    assert found[0].filename == __file__


def test_values_far_from_others_are_no_matter_where_they_are_said_to_be_one():
    for values in (0, (0, 65535), ()):
        edgeStrength(np.where(HOLES, 65535, 2000 * Z).astype(np.uint16), K=K, invalid=values, noise=0.001)
    edgeStrength(np.where(HOLES, 1e10, Z), K=K, invalid=[(1e9, INF)])


def test_an_angle_that_no_crease_has_is_warned_of():
    with pytest.warns(RangeEdgeWarning, match="creaseThreshold=181 switches creases off"):
        detectEdges(Z, None, 181.0, K=K)
    detectEdges(Z, None, INF, K=K)


def test_a_threshold_beyond_the_scene_is_warned_of():
    with pytest.warns(RangeEdgeWarning, match="jumpThreshold=50 exceeds"):
        detectEdges(Z, 50.0, K=K)
    detectEdges(Z, INF, K=K)
    assert estimateNoise(Z, K=K)(1.0) == pytest.approx(0.001, rel=0.1)


def test_points_behind_the_viewpoint_are_warned_of():
    v, u = np.indices((40, 50))
    points = np.stack([(u - 25) / 50.0, (v - 20) / 50.0, np.ones(u.shape)], -1) * 2
    points[:, :10] *= -1
    with pytest.warns(RangeEdgeWarning, match="more than a tenth of the points"):
        edgeStrength(points)
