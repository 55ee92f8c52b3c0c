"""Maps whose first column follows the last: turning the image turns the result."""

import time

import cv2
import numpy as np
import pytest

from rangeedge import (
    EdgeStrength,
    distanceTransform,
    error,
    extractSeeds,
    extractSeedsWithStats,
    salienceDistanceTransform,
    selectEdges,
    thinEdges,
)

MAPS = 60


def maps():
    """Random edge bands, and by how many columns to turn them."""
    rng = np.random.default_rng(7)
    for _ in range(MAPS):
        height, width = rng.integers(3, 30), rng.integers(20, 60)
        dots = rng.random((height, width)) < rng.choice([0.005, 0.02, 0.05])
        dots[rng.integers(height), rng.integers(width)] = True
        bands = cv2.dilate(dots.astype(np.uint8), np.ones((rng.integers(1, 4), rng.integers(1, 13))))
        yield turned(bands, width // 2), int(rng.integers(1, width)), rng


def turned(image, columns):
    return np.ascontiguousarray(np.roll(image, columns, 1))


@pytest.mark.parametrize("spurLength", [0, 5])
def test_thin_lines_turn_with_the_image(spurLength):
    different = 0
    for edges, columns, _ in maps():
        thin = thinEdges(edges, spurLength=spurLength, wrap=True)
        np.testing.assert_array_equal(
            turned(thin, columns), thinEdges(turned(edges, columns), spurLength=spurLength, wrap=True)
        )
        assert not (thin[edges == 0]).any()
        assert around(thin) == around(edges)
        different += (thin != thinEdges(edges, spurLength=spurLength)).any()
    assert different > MAPS / 4


def around(edges):
    """The number of 8-connected components on a cylinder."""
    count, labels = cv2.connectedComponents((edges > 0).astype(np.uint8))
    parents = list(range(count))

    def find(i):
        return i if parents[i] == i else find(parents[i])

    for row in range(len(edges)):
        for other in range(max(row - 1, 0), min(row + 2, len(edges))):
            if labels[row, -1] and labels[other, 0]:
                parents[find(labels[row, -1])] = find(labels[other, 0])
    return len({find(i) for i in range(1, count)})


@pytest.mark.parametrize(
    "options", [{}, {"hysteresis": 0.5}, {"minLength": 6}, {"hysteresis": 0.4, "minLength": 9}], ids=str
)
def test_selected_edges_turn_with_the_image(options):
    different = 0
    for edges, columns, rng in maps():
        jump = (edges * rng.random(edges.shape)).astype(np.float32)
        crease = (edges * (90 * rng.random(edges.shape))).astype(np.float32)
        found = selectEdges(jump, crease, 0.6, 50, wrap=True, **options)
        there = selectEdges(turned(jump, columns), turned(crease, columns), 0.6, 50, wrap=True, **options)
        np.testing.assert_array_equal(turned(found, columns), there)
        plain = selectEdges(jump, crease, 0.6, 50, **options)
        assert (found[plain > 0] == 255).all()  # nothing is shorter or farther from a strong pixel
        different += (found != plain).any()
        strength = EdgeStrength(jump, crease, np.where(jump > 0, 9, 2).astype(np.uint8), 20 * jump)
        found = selectEdges(strength, 0.3, 30, wrap=True, **options)
        there = selectEdges(EdgeStrength(*(turned(m, columns) for m in strength)), 0.3, 30, wrap=True, **options)
        np.testing.assert_array_equal(turned(found, columns), there)
    assert different > 3 or not options


def test_a_line_across_the_seam_is_as_long_as_elsewhere():
    jump = np.zeros((3, 12), np.float32)
    jump[1, [10, 11, 0, 1]] = 1
    nothing = np.zeros_like(jump)
    assert (selectEdges(jump, nothing, 1, minLength=4, wrap=True) > 0).sum() == 4
    assert not selectEdges(jump, nothing, 1, minLength=5, wrap=True).any()
    assert not selectEdges(jump, nothing, 1, minLength=4).any()
    ring = np.ones((1, 12), np.float32)
    assert selectEdges(ring, 0 * ring, 1, minLength=12, wrap=True).all()
    assert not selectEdges(ring, 0 * ring, 1, minLength=13, wrap=True).any()


def test_many_pieces_take_no_longer_where_the_map_wraps():
    dots = np.zeros((500, 8000), np.float32)
    dots[::3, ::3] = 1

    def seconds(wrap):
        began = time.process_time()
        selectEdges(dots, np.zeros_like(dots), 0.5, minLength=5, wrap=wrap)
        return time.process_time() - began

    assert min(seconds(True) for _ in range(3)) < 4 * min(seconds(False) for _ in range(3))


def test_lines_that_stand_out_do_so_across_the_seam():
    rng = np.random.default_rng(3)
    jump = np.where(rng.random((60, 80)) < 0.02, rng.random((60, 80)), 0).astype(np.float32)
    jump[30] = 1.5
    jump[30, 20:60] = 0
    found = selectEdges(jump, 0 * jump, 0.1, dynamic=True, wrap=True)
    assert found[30, :18].all()
    assert found[30, 62:].all()
    assert (found > 0).sum() < 60


def test_seeds_turn_with_the_image():
    for edges, columns, rng in maps():
        distance = distanceTransform(edges, wrap=True)
        mask = (rng.random(edges.shape) < 0.97).astype(np.uint8)
        options = {"minDistance": 1.5, "separation": float(rng.uniform(0.3, 0.95)), "wrap": True}
        count, seeds = extractSeeds(distance, mask=mask, **options)
        again, there = extractSeeds(turned(distance, columns), mask=turned(mask, columns), **options)
        assert count == again
        pairs = np.unique(np.stack([turned(seeds, columns).ravel(), there.ravel()]), axis=1)
        assert pairs.shape[1] == count  # one of the other for each, and 0 for 0


def test_a_seed_across_the_seam_is_one():
    distance = np.float32([[3, 2, 1, 0, 1, 2, 3, 4]])
    assert extractSeeds(distance, minDistance=2, wrap=True)[1].tolist() == [[1, 0, 0, 0, 0, 0, 1, 1]]
    assert extractSeeds(distance, minDistance=2)[0] == 3
    stats = extractSeedsWithStats(distance, minDistance=2, wrap=True)[2]
    assert stats[1, cv2.CC_STAT_AREA] == 3
    everywhere = np.full((4, 5), np.inf, np.float32)
    assert extractSeeds(everywhere, wrap=True)[1].tolist() == np.ones((4, 5), int).tolist()


def test_distances_turn_with_the_image():
    for edges, columns, rng in maps():
        np.testing.assert_array_equal(
            turned(distanceTransform(edges, wrap=True), columns), distanceTransform(turned(edges, columns), wrap=True)
        )
        salience = (edges * rng.integers(0, 256, edges.shape)).astype(np.uint8)
        there = salienceDistanceTransform(turned(salience, columns), wrap=True)
        np.testing.assert_allclose(turned(salienceDistanceTransform(salience, wrap=True), columns), there, rtol=1e-6)


def test_ways_around_barriers_turn_with_the_image():
    for edges, columns, rng in maps():
        walls = (rng.random(edges.shape) < 0.2).astype(np.uint8)
        here = turned(distanceTransform(edges, barrier=walls, wrap=True), columns)
        there = distanceTransform(turned(edges, columns), barrier=turned(walls, columns), wrap=True)
        np.testing.assert_allclose(here, there, rtol=0.08)  # by so much a way may be longer than the shortest
        np.testing.assert_array_less(distanceTransform(turned(edges, columns), wrap=True) * (1 - 1e-6), there + 1e-30)


@pytest.mark.parametrize(
    "call",
    [
        lambda: thinEdges(np.zeros((3, 4), np.uint8), wrap=2),
        lambda: selectEdges(np.zeros((3, 4)), np.zeros((3, 4)), 1, wrap="yes"),
        lambda: extractSeeds(np.zeros((3, 4), np.float32), wrap=None),
    ],
)
def test_wrap_is_yes_or_no(call):
    with pytest.raises(error, match="`wrap` must be"):
        call()
