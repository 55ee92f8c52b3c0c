"""Which regions touch, by hand on small grids and against the true faces of rendered scenes."""

import numpy as np
import pytest

import rangeedge
from rangeedge import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, regionAdjacency
from rangeedge.synthetic import box, cylinder, gaussianNoise, pinholeCamera, plane, renderScene

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
