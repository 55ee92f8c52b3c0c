"""Which regions touch, by hand on small grids and against the true faces of rendered scenes."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, regionAdjacency, regionCorners
from rangeedge.contacts import Borders
from rangeedge.synthetic import box, cylinder, gaussianNoise, pinholeCamera, plane, renderScene, roof

K = np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]])
CAMERA = pinholeCamera(K, (320, 240))
AXES = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


@pytest.mark.parametrize("sigma", [0, 0.001])
def test_faces_of_a_box_meet_at_right_angles_and_jump_to_the_wall(sigma):
    rendering = renderScene([plane((0, 0, 1.4), (0.05, -0.3, -1)), box((0, 0, 1.0), (0.3, 0.25, 0.2), AXES)], CAMERA)
    wall = rendering.labels[0, 0]
    pairs = regionAdjacency(gaussianNoise(rendering, sigma).src, rendering.labels, K=K, noise=max(sigma, 1e-4))
    assert len(pairs) == 6
    for pair in pairs:
        if wall in (pair["first"], pair["second"]):
            assert pair["kind"] == EDGE_JUMP
            assert np.isnan(pair["dihedral"])
            assert np.isnan(pair["point"]).all()
            assert 0.02 < pair["jump"] < 0.6
        else:
            assert pair["kind"] == EDGE_CONVEX
            assert pair["jump"] == 0
            assert pair["dihedral"] == pytest.approx(90, abs=0.01 if not sigma else 0.5)
            # The line is one of the edges: parallel to an axis, half the size away along both others.
            along = np.abs(AXES.T @ pair["direction"])
            assert along.max() == pytest.approx(1, abs=1e-6 if not sigma else 1e-3)
            place = np.abs(AXES.T @ (pair["point"] - [0, 0, 1.0]))
            across = np.arange(3) != along.argmax()
            limit = 1e-6 if not sigma else 1e-3
            assert np.allclose(place[across], np.array([0.15, 0.125, 0.1])[across], atol=limit)


def test_a_box_on_a_table_is_concave_at_its_foot():
    cos, sin = np.cos(0.6), np.sin(0.6)
    axes = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    scene = [plane((0, 0, 1.0) + axes @ (0, 0.1, 0), axes @ (0, -1, 0)), box((0, 0, 1.0), (0.2, 0.2, 0.2), axes)]
    rendering = renderScene(scene, CAMERA)
    pairs = regionAdjacency(rendering.depth, rendering.labels, K=K, noise=1e-4)
    (concave,) = pairs[pairs["kind"] == EDGE_CONCAVE]
    assert concave["dihedral"] == pytest.approx(270, abs=0.01)
    assert np.abs(concave["direction"]).round(6).tolist() == [1, 0, 0]


def labelled(rows):
    return np.array([[int(c) for c in row] for row in rows.split()], np.int32)


def test_contacts_are_counted_along_rows_and_columns():
    labels = np.kron(labelled("1122 1122 1333"), np.ones((4, 4), np.int32))
    flat = np.zeros(labels.shape)
    pairs = regionAdjacency(flat, labels, minContacts=1, noise=0.1)
    assert pairs[["first", "second", "contacts"]].tolist() == [(1, 2, 8), (1, 3, 8), (2, 3, 8)]
    assert len(regionAdjacency(flat, labels, minContacts=9, noise=0.1)) == 0


def test_gaps_without_region_are_crossed_up_to_a_width():
    labels = labelled("1100022 1100022 1100022")
    flat = np.zeros(labels.shape)
    assert len(regionAdjacency(flat, labels, 2, noise=0.1)) == 0
    assert regionAdjacency(flat, labels, 3, noise=0.1)["contacts"].tolist() == [3]
    labels[:, 3] = 3  # another region between them
    pairs = regionAdjacency(flat, labels, 3, noise=0.1)
    assert pairs[["first", "second"]].tolist() == [(1, 3), (2, 3)]


@pytest.mark.parametrize("heightMap", [False, True])
def test_a_valley_of_depths_is_a_ridge_of_heights(heightMap):
    x = np.arange(41) * np.ones((30, 1))
    labels = np.where(x < 20.2, 1, 2).astype(np.int32)
    (pair,) = regionAdjacency(np.abs(x - 20.2), labels, heightMap=heightMap, noise=0.001)
    assert pair["kind"] == (EDGE_CONCAVE if heightMap else EDGE_CONVEX)
    assert pair["dihedral"] == pytest.approx(270 if heightMap else 90)
    assert np.allclose(pair["point"], [20.2, 14.5, 0], atol=1e-6)
    assert np.abs(pair["direction"]).round(6).tolist() == [0, 1, 0]


def test_curved_surfaces_have_an_angle_but_no_line():
    rendering = renderScene([plane((0, 0.1, 1.0), (0, -0.6, -1)), cylinder((0, 0.1, 1.0), (1, 0, 0), 0.1, 0.3)], CAMERA)
    pairs = regionAdjacency(rendering.depth, rendering.labels, K=K, noise=1e-4)
    assert len(pairs) >= 1
    assert np.isnan(pairs["direction"]).any()


def test_no_regions_no_pairs():
    assert len(regionAdjacency(np.zeros((5, 6)), np.zeros((5, 6), np.int32), noise=0.1)) == 0
    assert len(regionAdjacency(np.zeros((1, 1)), np.ones((1, 1), np.int32), noise=0.1)) == 0


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: regionAdjacency(np.ones((3, 4)), np.ones((3, 4))), "regionAdjacency: `labels` must be an int32 array"),
        (lambda: regionAdjacency(np.ones((3, 4)), np.ones((3, 5), np.int32)), "`labels` must be"),
        (lambda: regionAdjacency(np.ones((3, 4)), np.ones((3, 4), np.int32), -1), "`gap` must be an integer from 0"),
        (lambda: regionAdjacency(np.ones((3, 4)), np.ones((3, 4), np.int32), 1, 0), "`minContacts` must be"),
    ],
)
def test_bad_arguments_are_named(call, text):
    with pytest.raises(rangeedge.error) as problem:
        call()
    assert text in str(problem.value)


@pytest.mark.parametrize("sigma", [0, 0.0005])
def test_borders_have_the_length_of_the_edges_and_corners_lie_where_planes_meet(sigma):
    size = np.array([0.3, 0.25, 0.2])
    scene = [plane((0, 0, 1.5), (0, -0.2, -1)), box((0, 0, 1.0), tuple(size), AXES)]
    rendering = renderScene(scene, CAMERA)
    depth = rendering.depth + (np.random.default_rng(0).normal(0, sigma, rendering.depth.shape) if sigma else 0)
    geometry = CAMERA.geometry
    pairs = regionAdjacency(depth, rendering.labels, noise=max(sigma, 1e-5), **geometry)
    convex = pairs[pairs["kind"] == EDGE_CONVEX]
    assert len(convex) == 3
    for pair in convex:
        side = np.abs(AXES.T @ pair["direction"]).argmax()
        assert pair["length"] == pytest.approx(size[side], rel=0.05)
    (corner,) = regionCorners(depth, rendering.labels, noise=max(sigma, 1e-5), **geometry)
    ends = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2 @ AXES.T + (0, 0, 1.0)
    assert np.linalg.norm(ends - corner["point"], axis=1).min() < (2e-6 if not sigma else 3e-4)
    assert corner["convex"] == 3
    assert corner["labels"].tolist() == sorted({*convex["first"].tolist(), *convex["second"].tolist()})
    at = rangeedge.project(corner["point"], **geometry)
    assert (corner["x"], corner["y"]) == pytest.approx(tuple(at[:2]))
    points = rangeedge.backproject(depth, **geometry)
    (same,) = regionCorners(points, rendering.labels, noise=max(sigma, 1e-5))
    assert np.allclose(same["point"], corner["point"], atol=1e-6)
    assert np.hypot(same["x"] - corner["x"], same["y"] - corner["y"]) < 4


def test_lengths_of_slanted_borders_and_of_jumps():
    v, u = np.indices((60, 80)).astype(float)
    for slope in (0.0, 0.5, 1.0, 2.0):
        labels = np.where(u < 10 + slope * v / 2, 1, 2).astype(np.int32)
        pairs = regionAdjacency(np.where(labels == 1, 5.0, 9.0), labels, pixelSize=0.1, noise=0.01)
        assert pairs["kind"].tolist() == [1]
        assert pairs["length"][0] == pytest.approx(0.1 * 60 * np.hypot(1, slope / 2), rel=0.06)


def test_planes_that_do_not_meet_in_a_corner_have_none():
    x = np.arange(60.0) * np.ones((30, 1))
    labels = (1 + x // 20).astype(np.int32)
    folded = np.select([x < 20, x < 40], [20 - x, 0 * x], x - 40)
    assert len(regionCorners(folded, labels, noise=0.001)) == 0
    assert len(regionCorners(np.zeros((5, 6)), np.zeros((5, 6), np.int32), noise=0.1)) == 0
    with pytest.raises(rangeedge.error, match="regionCorners: `labels` must be"):
        regionCorners(np.zeros((5, 6)), np.zeros((5, 6)))


@pytest.mark.parametrize("convex", [True, False])
def test_edges_rounded_off_by_the_sensor_keep_their_angle(convex):
    rendering = renderScene(roof(90, orientation=10, convex=convex), CAMERA)
    depth = cv2.GaussianBlur(rendering.depth, (0, 0), 2.0)
    labels = rendering.labels.copy()
    labels[:, :145] = labels[:, 175:] = 0  # narrow faces
    labels[:110] = labels[130:] = 0
    (pair,) = regionAdjacency(depth, labels, K=K, noise=0.0005)
    assert pair["dihedral"] == pytest.approx(90 if convex else 270, abs=3)


@pytest.mark.parametrize("curved", [False, True])
def test_pairs_and_corners_do_not_depend_on_other_regions(curved):
    rng = np.random.default_rng(4)
    v, u = np.indices((60, 80)).astype(float)
    if curved:
        relief, labels = 0.02 * (u % 20 - 10) ** 2, v // 20 * 8 + u // 10
    else:
        planes = np.stack([a * (u - 40) + b * (v - 30) - 12 * (a * a + b * b) for a, b in rng.uniform(-1, 1, (12, 2))])
        relief, labels = planes.max(axis=0), planes.argmax(axis=0)
    src = relief + np.where((u > 40) & (v > 30), 6, 0) + rng.normal(0, 0.01, u.shape)
    labels = labels.astype(np.int32) + 1
    pairs, corners = (function(src, labels, 0, 2, noise=0.01) for function in (regionAdjacency, regionCorners))
    assert set(pairs["kind"].tolist()) == (
        {EDGE_JUMP, EDGE_CONVEX, EDGE_CONCAVE} if curved else {EDGE_JUMP, EDGE_CONVEX}
    )
    assert len(corners) > 2 or curved

    def is_alone(found, function, names):
        own = function(src, np.where(np.isin(labels, names), labels, 0), 0, 2, noise=0.01)
        return len(own) == len(found) and all(
            np.allclose(own[name], found[name], rtol=1e-9, atol=1e-9, equal_nan=True) for name in own.dtype.names
        )

    for first, second in {(pair["first"], pair["second"]) for pair in pairs}:
        own = pairs[(pairs["first"] == first) & (pairs["second"] == second)]
        assert is_alone(own, regionAdjacency, [first, second])
    for corner in corners:
        assert is_alone(corner[None], regionCorners, corner["labels"])


def test_means_and_medians_of_borders():
    border = np.array([0, 0, 0, 1, 1, 1, 1, 2])
    borders = Borders(*[np.arange(3)] * 3, np.array([0, 3, 7, 8]), border, *[np.zeros(0)] * 5)
    values = np.array([5.0, 1, 3, 8, 2, 4, 1, np.nan])
    assert np.array_equal(borders.medians(values), [3, 3, np.nan], equal_nan=True)
    assert borders.means(np.stack([values, -values], axis=1))[:2].tolist() == [[3, -3], [3.75, -3.75]]
