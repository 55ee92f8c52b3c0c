"""One scene in all forms of a range image, and the frame that kernels take."""

import numpy as np
import pytest

import rangeedge
from rangeedge import CREASE_MAX, edgePoints, edgeStrength
from rangeedge.frame import read_frame
from rangeedge.geometry import range_frame
from rangeedge.options import ScanLineParams
from rangeedge.synthetic import (
    Camera,
    box,
    cylinder,
    orthographicCamera,
    perceptronCamera,
    pinholeCamera,
    plane,
    polyhedraScene,
    renderScene,
    roof,
    sphere,
)

NAN = np.nan
K = np.array([[180.0, 0.0, 61.3], [0, 170.0, 44.2], [0, 0, 1]])
NAMES = ("jump", "crease", "kind", "significance")
NOISE = 0.001


def frame_of(src, mask=None, **geometry):
    return read_frame(src, ScanLineParams(**geometry), mask)


def scene():
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return [
        plane((0, 0, 1.3), (0.2, 0.1, -1)),
        box((-0.12, 0, 1.0), (0.16, 0.14, 0.18), turn),
        sphere((0.13, 0.08, 1.05), 0.07),
        cylinder((0.14, -0.09, 1.05), (1, 0.3, 0.2), 0.05, 0.2),
    ]


@pytest.fixture(scope="module")
def pinhole():
    return renderScene(scene(), pinholeCamera(K, (120, 90)))


@pytest.fixture(scope="module")
def grid():
    return renderScene(scene(), orthographicCamera((0.006, 0.005), (100, 90)))


def seen(z):
    """The points that the camera sees at these depths."""
    v, u = np.indices(z.shape)
    return np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(K).T * z[..., None]


def noisy(depth):
    depth = depth + NOISE * np.random.default_rng(2).standard_normal(depth.shape)
    depth[10:14, 20:26] = NAN
    return depth


def assert_same(a, b, rtol=1e-4, share=0.0):
    """Equal to `rtol`; up to a `share` of the pixels may differ where rounding decides."""
    assert a.jump.any()
    assert a.crease.any()
    for name, x, y in zip(NAMES, a, b, strict=True):
        differ = ~np.isclose(x, y, rtol=rtol, atol=1e-5)
        assert differ.mean() <= share, f"{name} differs at {differ.sum()} pixels"


# All forms of one image.


@pytest.mark.parametrize("crease", [{}, dict(crease=CREASE_MAX)])
def test_points_of_a_pinhole_camera_are_its_depths(pinhole, crease):
    z = noisy(pinhole.depth)
    points = seen(z)
    by_depth = edgeStrength(z, K=K, noise=NOISE, **crease)
    assert_same(by_depth, edgeStrength(points, noise=NOISE, **crease))
    with_fourth = np.dstack([points, np.full(z.shape, NAN)])
    assert_same(by_depth, edgeStrength(with_fourth, noise=NOISE, **crease))
    single = edgeStrength(points.astype(np.float32), noise=NOISE, **crease)
    assert_same(edgeStrength(z.astype(np.float32), K=K, noise=NOISE, **crease), single, rtol=1e-2, share=0.01)


def test_points_on_a_grid_are_its_depths(grid):
    z = noisy(grid.depth)
    points = np.dstack([grid.points[..., :2], z])
    by_depth = edgeStrength(z, pixelSize=(0.006, 0.005), noise=NOISE)
    assert_same(by_depth, edgeStrength(points, noise=NOISE))


def test_heights_are_negative_depths(grid):
    z = noisy(grid.depth)
    by_depth = edgeStrength(z, pixelSize=0.006, noise=NOISE)
    by_height = edgeStrength(-z, pixelSize=0.006, noise=NOISE, heightMap=True)
    assert all(np.array_equal(a, b) for a, b in zip(by_depth, by_height, strict=True))
    by_height = edgeStrength(5 - z, pixelSize=0.006, noise=NOISE, heightMap=True)
    assert_same(by_depth, by_height, rtol=1e-3)


def test_points_of_heights_grow_toward_the_viewer(grid):
    z = noisy(grid.depth)
    x, y = grid.points[..., 0], grid.points[..., 1]
    by_depth = edgeStrength(np.dstack([x, y, z]), noise=NOISE)
    # Turned by 180 degrees about the y axis, the scene has its viewer at +z.
    by_height = edgeStrength(np.dstack([-x, y, -z]), noise=NOISE, heightMap=True)
    assert_same(by_depth, by_height)


def test_a_turned_scanner_sees_the_same(pinhole):
    # Points in another frame: a panoramic scanner looks along no axis of its own.
    z = noisy(pinhole.depth)
    points = seen(z)
    turned = np.dstack([points[..., 2], points[..., 0], points[..., 1]])  # looks along x
    a, b = edgeStrength(points, noise=NOISE), edgeStrength(turned, noise=NOISE)
    near = np.isclose(a.crease, b.crease, rtol=0.05, atol=0.5)
    assert near.mean() > 0.97
    np.testing.assert_array_equal(a.kind & 32, b.kind & 32)


def test_millimetres_are_metres(pinhole):
    millimetres = np.nan_to_num(np.round(1000 * noisy(pinhole.depth))).astype(np.uint16)
    metres = np.where(millimetres > 0, millimetres / np.float32(1000), NAN).astype(np.float32)
    expected = edgeStrength(metres, K=K, noise=NOISE)
    for src in (millimetres, millimetres.astype(np.int16), millimetres.astype(">u2")):
        assert_same(expected, edgeStrength(src, K=K, noise=NOISE), rtol=1e-6)
    for src in (millimetres.astype(np.int32), millimetres.astype(np.int64)):  # in double precision
        assert_same(expected, edgeStrength(src, K=K, noise=NOISE), rtol=1e-2, share=0.01)
    tenths = edgeStrength(millimetres, K=K, noise=10 * NOISE, depthFactor=100)
    np.testing.assert_allclose(tenths.jump, 10 * expected.jump, rtol=1e-3, atol=1e-5)
    assert edgeStrength(millimetres, noise=NOISE).jump.any()


def test_a_mask_is_no_data(pinhole):
    z = noisy(pinhole.depth)
    use = np.random.default_rng(3).random(z.shape) < 0.9
    points = seen(z)
    for src, geometry in ((z, dict(K=K)), (z, dict(pixelSize=0.006)), (points, {}), (z.astype(np.float32), dict(K=K))):
        without = src.copy()
        without[~use] = NAN
        expected = edgeStrength(without, noise=NOISE, **geometry)
        for mask in (use, use.astype(np.uint8), 255 * use.astype(np.uint8), use.astype(np.uint8) * 2):
            got = edgeStrength(src, mask=mask, noise=NOISE, **geometry)
            assert all(np.array_equal(a, b) for a, b in zip(expected, got, strict=True))


def test_data_is_what_no_mask_and_no_value_takes_away(pinhole):
    z = pinhole.depth.copy()
    rng = np.random.default_rng(4)
    inside, measured, known = (rng.random(z.shape) < 0.8 for _ in range(3))
    z[~known] = 99
    src = np.ma.masked_array(z, mask=~measured)
    for invalid, seen in ((None, inside & measured), (99.0, inside & measured & known)):
        frame = read_frame(src, ScanLineParams(K=K, invalid=invalid), inside)
        assert np.array_equal(frame.valid > 0, seen)


def test_a_skewed_camera_sees_the_same_roof():
    # The angle of a crease does not depend on the camera.
    for matrix in (K, K + np.array([[0, 25.0, 0], [0, 0, 0], [0, 0, 0]]), K + np.diag([0, 80.0, 0])):
        rendering = renderScene(roof(50.0, 20.0, 5.0), pinholeCamera(matrix, (120, 90)))
        strength = edgeStrength(rendering.depth, K=matrix, noise=1e-5)
        angles = strength.crease[strength.crease > 0]
        assert len(angles) > 100
        np.testing.assert_allclose(np.median(angles), 50.0, atol=0.05)


def test_an_oblong_grid_sees_the_same_roof():
    for pitch in ((0.005, 0.005), (0.005, 0.012), (0.009, 0.004)):
        rendering = renderScene(roof(50.0, 20.0, 5.0), orthographicCamera(pitch, (100, 90)))
        strength = edgeStrength(rendering.depth, pixelSize=pitch, noise=1e-5)
        angles = strength.crease[strength.crease > 0]
        assert len(angles) > 100
        np.testing.assert_allclose(np.median(angles), 50.0, atol=0.05)


# Validity.


@pytest.mark.parametrize("bad", [0.0, -1.0, NAN, np.inf, -np.inf, 1e-320])
def test_depths_of_a_camera_are_positive_and_finite(bad):
    z = np.full((7, 9), 1.5)
    z[3, 4] = bad
    valid = frame_of(z, K=K).valid
    assert valid[3, 4] == 0
    assert valid.sum() == 62


@pytest.mark.parametrize(("value", "valid"), [(0.0, 1), (-1.0, 1), (NAN, 0), (np.inf, 0), (-np.inf, 0)])
@pytest.mark.parametrize("height", [False, True])
def test_values_of_a_grid_are_finite(value, valid, height):
    z = np.full((7, 9), 1.5)
    z[3, 4] = value
    assert frame_of(z, heightMap=height).valid[3, 4] == valid


def test_integers_are_positive():
    z = np.array([[0, 1, -3, 32767]], np.int16)
    assert frame_of(z).valid.tolist() == [[0, 1, 0, 1]]
    assert frame_of(z, K=K).valid.tolist() == [[0, 1, 0, 1]]
    np.testing.assert_allclose(frame_of(z).depth[0, [1, 3]], [0.001, 32.767], rtol=1e-6)


@pytest.mark.parametrize("coordinate", [0, 1, 2])
@pytest.mark.parametrize("bad", [NAN, np.inf, -np.inf])
def test_points_are_finite_in_every_coordinate(coordinate, bad):
    points = np.random.default_rng(4).normal(size=(5, 6, 3)) + np.array([0, 0, 5])
    points[2, 3, coordinate] = bad
    valid = frame_of(points).valid
    assert valid[2, 3] == 0
    assert valid.sum() == 29


def test_the_depth_of_a_frame_is_along_the_viewing_axis(pinhole, grid):
    np.testing.assert_allclose(frame_of(pinhole.depth, K=K).depth, pinhole.depth)
    np.testing.assert_allclose(frame_of(pinhole.points).depth, pinhole.depth)
    np.testing.assert_allclose(frame_of(grid.depth).depth, grid.depth)
    np.testing.assert_allclose(frame_of(grid.points).depth, grid.depth)


# What kind of scanner took the points.


def test_projection_is_recognised(pinhole, grid):
    assert frame_of(pinhole.points).projective
    assert not frame_of(grid.points).projective
    assert frame_of(noisy(pinhole.points)).projective
    assert not frame_of(grid.points + np.array([0.3, 0.2, 0])).projective
    assert not frame_of(grid.points, heightMap=True).projective


def test_a_scanner_with_mirrors_counts_as_projective():
    camera = perceptronCamera()
    coarse = Camera((64, 64), lambda x, y: camera.rays(8 * x + 3.5, 8 * y + 3.5), {}, 450.0)
    for seed in range(3):
        assert frame_of(renderScene(polyhedraScene(seed, coarse), coarse).points).projective
    assert frame_of(renderScene([plane((0, 0, 450), (0.3, 0.2, -1))], coarse).points).projective


@pytest.mark.parametrize("shape", [(1, 1, 3), (1, 5, 3), (5, 1, 3), (2, 2, 3), (1, 2, 4)])
def test_few_points_make_a_frame(shape):
    rng = np.random.default_rng(5)
    for points in (np.full(shape, NAN), np.zeros(shape), np.ones(shape), -np.ones(shape)):
        assert not any(m.any() for m in edgeStrength(points)[:2])
        assert len(edgePoints(points)) == 0
    assert all(np.isfinite(m).all() for m in edgeStrength(rng.normal(size=shape)))


def test_points_in_one_line_of_sight_are_survived():
    points = np.zeros((6, 8, 3))
    points[..., 2] = np.arange(8) + 1
    assert all(np.isfinite(m).all() for m in edgeStrength(points))


def test_scan_lines_may_fold_back_at_occlusions():
    # A structured-light row whose abscissa steps back where the nearer surface begins.
    x = np.concatenate([np.linspace(0, 1, 30), np.linspace(0.9, 1.9, 30)])
    z = np.concatenate([np.full(30, 2.0), np.full(30, 1.0)])
    points = np.stack([np.tile(x, (5, 1)), np.tile(np.arange(5.0)[:, None], (1, 60)), np.tile(z, (5, 1))], -1)
    frame = frame_of(points)
    if not frame.projective:
        strength = edgeStrength(points, noise=0.001, directions=1)
        assert (strength.jump[:, 29] > 0).all()
        assert (strength.jump[:, 30] > 0).all()
        np.testing.assert_allclose(strength.jump[:, 29:31], 1.0, rtol=1e-5)


def test_the_frame_does_not_share_what_it_changes(pinhole):
    z = pinhole.depth.copy()
    mask = np.zeros(z.shape, np.uint8)
    for kwargs in (dict(heightMap=True), dict(K=K), dict()):
        frame_of(z, mask=mask, **kwargs)
        assert np.array_equal(z, pinhole.depth)


@pytest.mark.parametrize("function", [rangeedge.estimateNoise, edgeStrength, rangeedge.segmentRegionsWithStats])
def test_errors_name_the_function(function):
    with pytest.raises(rangeedge.error, match=rf"{function.__name__}: `src` must be"):
        function(np.zeros(3))
    with pytest.raises(rangeedge.error, match=rf"{function.__name__}: `mask` must be"):
        function(np.zeros((3, 3)), mask=np.zeros((3, 4), np.uint8))


def test_points_left_out_do_not_turn_the_viewing_axis():
    z = np.where(np.arange(60) < 30, 1.0, 1.2) * np.ones((50, 1))
    K = np.array([[80.0, 0, 29.5], [0, 80, 24.5], [0, 0, 1]])
    v, u = np.mgrid[:50, :60]
    points = np.dstack([(u - 29.5) / 80 * z, (v - 24.5) / 80 * z, z])
    expected = edgeStrength(z, K=K, noise=0.001).jump.max()
    nothing, behind = points.copy(), points.copy()
    nothing[3, 4] = 0
    behind[3, 4] = (0.1, 0.1, -1)
    mask = np.ones(z.shape, np.uint8)
    mask[3, 4] = 0
    for src, inside in ((nothing, None), (nothing, mask), (behind, mask)):
        assert edgeStrength(src, noise=0.001, mask=inside).jump.max() == pytest.approx(expected, rel=1e-6)


def test_whole_heights_may_be_negative():
    heights = np.arange(-200, 200, dtype=np.int16).reshape(20, 20)
    heights[3, 4] = -32768
    frame = frame_of(heights, heightMap=True, depthFactor=10.0)
    assert frame.valid.sum() == 399
    assert frame.valid[3, 4] == 0
    np.testing.assert_array_equal(frame.ordinate[0], np.float32(heights[0] / 10))
    assert frame_of(heights).valid.sum() == 199
    assert frame_of(heights.clip(0).astype(np.uint16), heightMap=True).valid.sum() == 199


def test_frames_are_read_by_keyword_and_errors_name_the_caller():
    frame = range_frame("mine", np.full((4, 5), 2.0, np.float32), K=(5, 5, 2, 1.5), mask=np.eye(4, 5, dtype=np.uint8))
    assert frame.projective
    assert np.array_equal(frame.valid, np.eye(4, 5))
    with pytest.raises(rangeedge.error, match="mine: `K`"):
        range_frame("mine", np.ones((4, 5)), K=3)
