"""Depth to points and back."""

import numpy as np
import pytest

import rangeedge
from rangeedge import backproject, project
from rangeedge.synthetic import box, orthographicCamera, pinholeCamera, plane, renderScene

K = np.array([[180.0, 2.0, 61.3], [0, 170.0, 44.2], [0, 0, 1]])
SCENE = [plane((0, 0, 1.3), (0.2, 0.1, -1)), box((0, 0, 1.0), (0.16, 0.14, 0.18), np.eye(3))]


@pytest.fixture(scope="module")
def rendering():
    return renderScene(SCENE, pinholeCamera(K, (120, 90)))


def test_points_of_a_camera_are_those_that_its_rays_hit(rendering):
    assert np.allclose(backproject(rendering.depth, K=K), rendering.points, rtol=1e-12, equal_nan=True)


def test_float32_depths_are_not_rounded_further(rendering):
    depth = rendering.depth.astype(np.float32)
    assert np.array_equal(backproject(depth, K=K)[..., 2], depth.astype(np.float64), equal_nan=True)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.int32, np.uint32])
def test_integers_are_divided_by_the_factor_and_0_is_invalid(dtype):
    points = backproject(np.array([[0, 100, 50]], dtype), K=K, depthFactor=200)
    assert np.isnan(points[0, 0]).all()
    assert np.allclose(points[0, 1:, 2], [0.5, 0.25])
    assert np.allclose(points[0, 1], 0.5 * np.linalg.solve(K, [1, 0, 1]))


def test_a_grid_has_its_spacing():
    camera = orthographicCamera((0.5, 0.25), (7, 5), 3.0)
    depth = np.arange(35.0).reshape(5, 7) + 1
    points = backproject(depth, **camera.geometry)
    assert points[4, 6].tolist() == [3.0, 1.0, 35.0]
    heights = backproject(-depth, heightMap=True, **camera.geometry)
    assert heights[4, 6].tolist() == [3.0, 1.0, -35.0]


def test_invalid_pixels_and_those_outside_the_mask_are_nan():
    depth = np.array([[1.0, np.nan, 0.0, -1.0, 2.0]])
    valid = np.isfinite(backproject(depth, K=K)).all(axis=-1)
    assert valid.tolist() == [[True, False, False, False, True]]
    masked = backproject(depth, K=K, mask=np.array([[0, 1, 1, 1, 1]], bool))
    assert np.isfinite(masked).all(axis=-1).tolist() == [[False, False, False, False, True]]
    assert np.isnan(masked[0, :4]).all()


def test_points_pass_through_and_zeros_are_invalid():
    points = np.array([[[0.0, 0, 0], [1, 2, 3]]])
    passed = backproject(points)
    assert np.isnan(passed[0, 0]).all()
    assert passed[0, 1].tolist() == [1, 2, 3]
    assert passed is not points


@pytest.mark.parametrize(
    "geometry", [{"K": K}, {"pixelSize": (0.5, 0.2)}, {"pixelSize": 2, "heightMap": True}, {}], ids=str
)
def test_projection_is_the_way_back(geometry):
    values = np.random.default_rng(0).uniform(1, 2, (6, 8))
    pixels = project(backproject(values, **geometry), **geometry)
    v, u = np.indices(values.shape)
    assert np.allclose(pixels, np.stack([u, v, values], axis=-1), atol=1e-9)


def test_the_matrix_projects_as_in_textbooks():
    point = np.array([0.1, -0.2, 0.8])
    u, v, w = K @ point
    assert np.allclose(project(point, K=K), [u / w, v / w, 0.8])


def test_points_behind_the_camera_are_nan():
    pixels = project(np.array([[0.0, 0, -1], [0, 0, 0], [np.nan, 0, 1], [0, 0, 1]]), K=K)
    assert np.isnan(pixels[:3]).all()
    assert np.isfinite(pixels[3]).all()


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: project([1, 2, 3], K=K), "project: `points` must be an array of shape"),
        (lambda: project(np.ones((4, 2)), K=K), "project: `points` must be an array of shape"),
        (lambda: project(np.ones(3), K=np.eye(2)), "K` must be a camera"),
        (lambda: project(np.ones(3), f=3), "project: unknown argument `f`"),
        (lambda: backproject(np.ones((3, 4, 2))), "backproject: `src` must be"),
        (lambda: backproject(np.ones((3, 4)), K=K, heightMap=True), "backproject: `heightMap` must be False"),
        (lambda: backproject(np.ones((3, 4)), mask=np.ones((3, 3), bool)), "backproject: `mask` must be"),
    ],
)
def test_bad_arguments_are_named(call, text):
    with pytest.raises(rangeedge.error) as problem:
        call()
    assert text in str(problem.value)


def test_inputs_stay_as_they_were(rendering):
    depth = rendering.depth.copy()
    backproject(depth, K=K)
    assert np.array_equal(depth, rendering.depth, equal_nan=True)
