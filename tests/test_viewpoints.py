"""Clouds in other frames than the scanner's, and lenses with distortion: the same scene gives the same edges."""

import cv2
import numpy as np
import pytest
from scans import SHAPE, K, depth_of, near, rays_of, sweep, turned

import rangeedge
from rangeedge import detectEdges, edgeStrength, segmentRegions
from rangeedge.frame import read_frame
from rangeedge.options import ScanLineParams
from rangeedge.resection import resect
from rangeedge.viewpoint import View, distorted_rays, mean_ray, view_of


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("place", [(0.2, 0, 1.1), (4, -7, 1.1), (430, 250, 1)])
def test_clouds_in_another_frame(place, given):
    z = depth_of(rays_of())
    right = detectEdges(z, K=K)
    points = (rays_of() * z[..., None]) @ turned((30, 100, -20)).T + np.array(place)
    options = {"origin": place} if given else {}
    np.testing.assert_allclose(read_frame(points, ScanLineParams(**options)).origin, place, atol=0.02)
    edges = detectEdges(points, **options)
    assert near(edges > 0, right > 0) > 0.98
    assert near(right > 0, edges > 0) > 0.98
    assert segmentRegions(points, **options).max() == segmentRegions(z, K=K).max()


FIELDS = [(64, 45, (180, -180)), (96, 22, (135, -135)), (100, 15, (60, -60))]


@pytest.mark.parametrize("place", [(100, -20, 3), (1, 0, 0), (0, 0, 1), (0.3, 0.2, 0.1), (400000, 5e6, 120)])
@pytest.mark.parametrize(("rows", "elevation", "azimuth"), FIELDS)
def test_scans_in_another_frame(rows, elevation, azimuth, place):
    rays, ranges, _ = sweep(rows, elevation, azimuth)
    points = rays * (ranges + 0.005 * np.random.default_rng(1).standard_normal(ranges.shape))[..., None]
    right = detectEdges(points) > 0
    moved = points @ turned((20, -50, 140)).T + np.array(place)
    np.testing.assert_allclose(read_frame(moved, ScanLineParams()).origin, place, atol=0.05)
    edges = detectEdges(moved) > 0
    assert near(edges, right) > 0.98
    assert near(right, edges) > 0.98


@pytest.mark.parametrize("place", [(0, 0, 0), (0, 0, 1), (4, 0, 0), (0.3, 0.2, 0.1), (400000, 5e6, 120)])
@pytest.mark.parametrize(("rows", "up", "around"), [(128, 10, 10), (128, 8, 12), (64, 12, 15), (64, 14, 20)])
def test_narrow_scans_in_another_place(rows, up, around, place):
    rays, ranges, _ = sweep(rows, up, (around, -around))  # columns and walls are upright, as if seen in parallel
    ranges[rows // 3 : 2 * rows // 3, 150:330] *= 0.6  # a card before the wall
    points = rays * (ranges + 0.005 * np.random.default_rng(3).standard_normal(ranges.shape))[..., None]
    right = detectEdges(points) > 0
    frame = read_frame(points + np.array(place), ScanLineParams())
    assert frame.projective
    np.testing.assert_allclose(frame.origin, place, atol=0.05)
    edges = detectEdges(points + np.array(place)) > 0
    assert right.any()
    assert near(edges, right) > 0.98
    assert near(right, edges) > 0.98


@pytest.mark.parametrize("place", [(0, 0, 0), (0.05, 0.02, 0), (-4, -0.3, -0.2), (56, -31, 18), (-900, 1200, -2000)])
@pytest.mark.parametrize("scene", ["wall", "corner", "card"])
def test_images_of_few_planes_in_another_frame(scene, place):
    rays = rays_of()
    x, y = rays[..., 0], rays[..., 1]
    z = {"wall": 3 / (1 + 0.3 * x), "corner": 3 / (1 + 0.5 * abs(x - 0.01)), "card": 3 + 0 * x}[scene]
    z = np.where((abs(x) < 0.2) & (abs(y) < 0.15), 2.0, z) if scene == "card" else z
    z = z + 0.001 * np.random.default_rng(4).standard_normal(z.shape)
    right = detectEdges(z, K=K) > 0
    points = (rays * z[..., None]) @ turned((30, 100, -20)).T + np.array(place)
    edges = detectEdges(points) > 0
    assert edges.any() == right.any()
    if right.any():
        assert near(edges, right) > 0.98
        assert near(right, edges) > 0.98


def test_points_and_their_pixels_tell_the_viewpoint():
    points = rays_of() * depth_of(rays_of(), 0)[..., None]
    own = resect(points)
    assert own.here < 1e-9
    assert own.parallel > 5
    moved = resect(points @ turned((30, 100, -20)).T + (4, -7, 1.1))
    assert moved.moved < 1e-9
    assert moved.here > 5
    np.testing.assert_allclose(moved.place, (4, -7, 1.1), atol=1e-9)
    v, u = np.indices(SHAPE)
    grid = resect(np.dstack([0.02 * u - 3, 0.03 * v + 1, np.sin(u / 9) * np.cos(v / 7)]))
    assert grid.parallel < 1e-9
    assert grid.here > 5
    assert resect(np.full((9, 9, 3), np.nan)) == (np.inf, np.inf, np.inf, None)


def test_rows_of_a_scan_that_are_shifted_are_refused():
    rays, ranges, _ = sweep(64, 22.5, (180, -180))
    points = rays * ranges[..., None]
    raw = np.stack([np.roll(row, (0, 6, 12, 18)[i % 4], axis=0) for i, row in enumerate(points)])
    with pytest.raises(rangeedge.error, match="by origin"):
        detectEdges(raw)


def test_points_that_are_seen_from_nowhere_are_refused():
    points = np.random.default_rng(3).normal(size=(20, 30, 3)) + np.array([0, 0, 5])
    with pytest.raises(rangeedge.error, match="by origin"):
        edgeStrength(points)
    good = rays_of() * depth_of(rays_of())[..., None]
    with pytest.raises(rangeedge.error, match="`origin` must be where the rays of the points meet"):
        edgeStrength(good, origin=(1, 2, 0))
    for other in ({"K": K}, {"pixelSize": 1.0}):
        with pytest.raises(rangeedge.error, match="None where src holds points"):
            edgeStrength(good, **other)
    with pytest.raises(rangeedge.error, match="`origin` must be None where src holds no points"):
        edgeStrength(good[..., 2], K=K, origin=(0, 0, 0))
    with pytest.raises(rangeedge.error, match="`origin` must be None where heightMap"):
        edgeStrength(good, heightMap=True, origin=(0, 0, 0))


def test_the_direction_of_view_is_the_middle_of_a_wide_field():
    angles = np.linspace(-1.4, 1.4, 60)  # 160 degrees, of which the mean ray has a length of 0.7
    fan = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    np.testing.assert_allclose(mean_ray([fan]), (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(mean_ray([fan[:7], 3 * fan[7:]]), (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(mean_ray([fan, -fan]), (0, 0, 1))  # that of all around has none


@pytest.mark.parametrize("pixel", [(15, 0), (15, -1), (0, 16), (-1, 16)])
def test_a_wrong_pixel_at_the_end_of_a_line_leaves_the_viewpoint(pixel):
    z = 2 + 0.3 * np.sin(np.arange(64) / 9) * np.ones((48, 1))
    v, u = np.indices(z.shape)
    points = np.dstack([(u - 32) / 60 * z, (v - 24) / 60 * z, z])
    points[pixel] = (0.5, 1.5, 2)
    assert view_of(points, None) == View(True)


# A lens with distortion.


@pytest.mark.parametrize("coefficients", [(-0.25, 0.08, 0, 0), (0.15, -0.1, 0.001, -0.002, 0.02)])
def test_a_lens_with_distortion(coefficients):
    v, u = np.indices(SHAPE)
    pixels = np.stack([u, v], -1).reshape(-1, 1, 2).astype(float)
    rays = cv2.undistortPoints(pixels, K, np.array(coefficients))[:, 0].reshape(*SHAPE, 2)
    z = depth_of(np.dstack([rays, np.ones(SHAPE)]))
    found = edgeStrength(z, K=K, distCoeffs=coefficients)
    edges = detectEdges(z, K=K, distCoeffs=coefficients)
    # The edges of the undistorted scene, where the lens shows them.
    right = detectEdges(depth_of(rays_of()), K=K)
    v, u = np.nonzero(right)
    x = np.column_stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(len(u))])
    seen = cv2.projectPoints(x[:, None], np.zeros(3), np.zeros(3), K, np.array(coefficients))[0][:, 0]
    seen = np.rint(seen[((seen > 3) & (seen < np.array(SHAPE[::-1]) - 4)).all(axis=1)]).astype(int)
    there = np.zeros(SHAPE, bool)
    there[seen[:, 1], seen[:, 0]] = True
    inner = np.s_[4:-4, 4:-4]
    assert near(there[inner], edges[inner] > 0, 3) > 0.97
    assert near(edges[inner] > 0, there[inner], 3) > 0.97
    corner = (found.crease > 0) & (edges > 0) & (found.jump == 0)
    assert np.median(found.crease[corner]) == pytest.approx(90, abs=1)


def test_rays_through_a_skewed_lens_meet_their_pixels():
    camera, coefficients = np.array([[180.0, 25, 70], [0, 140, 55], [0, 0, 1]]), np.array([-0.2, 0.06, 0.001, -0.002])
    rays = distorted_rays(camera, coefficients, (110, 140)).reshape(-1, 1, 3)
    seen = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), coefficients)[0][:, 0]
    pixels = np.column_stack([seen, np.ones(len(seen))]) @ camera.T
    v, u = np.indices((110, 140))
    np.testing.assert_allclose(pixels[:, :2], np.column_stack([u.ravel(), v.ravel()]), atol=1e-6)


def test_no_distortion_changes_nothing():
    z = depth_of(rays_of())
    for a, b in zip(edgeStrength(z, K=K), edgeStrength(z, K=K, distCoeffs=np.zeros(5)), strict=True):
        np.testing.assert_array_equal(a, b)
    with pytest.raises(rangeedge.error, match="`distCoeffs` must be None where K is not given"):
        edgeStrength(z, distCoeffs=np.zeros(4))
