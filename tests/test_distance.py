"""Distance transforms against brute force over all pairs of pixels, in exact arithmetic."""

from __future__ import annotations

import contextlib
import heapq
import itertools
import threading
import time
from fractions import Fraction

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge.constants import SALIENCE_ADDITIVE, SALIENCE_MULTIPLICATIVE
from rangeedge.distance import (
    distanceTransform,
    distanceTransformWithLabels,
    salienceDistanceTransform,
    salienceDistanceTransformWithLabels,
)

TRANSFORMS = [distanceTransform, salienceDistanceTransform]
METHODS = [SALIENCE_MULTIPLICATIVE, SALIENCE_ADDITIVE]


# Oracles: every source against every pixel, in order of index, so that the first of equals stays.


def brute_multiplicative(salience):
    """min |p - q| / s(q) of an 8-bit map, compared as integers: d^2 v'^2 < d'^2 v^2."""
    height, width = salience.shape
    rows, cols = np.mgrid[:height, :width]
    squared, level = np.zeros((height, width), np.int64), np.zeros((height, width), np.int64)
    labels = np.full((height, width), -1, np.int32)
    for y, x in np.argwhere(salience):
        d2, v = (rows - y) ** 2 + (cols - x) ** 2, int(salience[y, x])
        nearer = (labels < 0) | (d2 * level**2 < squared * v**2)
        squared[nearer], level[nearer], labels[nearer] = d2[nearer], v, y * width + x
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.sqrt(squared.astype(np.float64)) / (level / 255.0)
    return np.where(labels < 0, np.inf, distance).astype(np.float32), labels


def brute_additive(salience, lambda_=10.0):
    """sqrt(min |p - q|^2 + f(q)), f in whole steps of 2^-20."""
    height, width = salience.shape
    rows, cols = np.mgrid[:height, :width]
    squared, labels = np.full((height, width), np.inf), np.full((height, width), -1, np.int32)
    for y, x in np.argwhere(salience):
        s = float(salience[y, x]) / (255.0 if salience.dtype == np.uint8 else 1.0)
        penalty = np.rint(lambda_ * lambda_ * (1.0 / (s * s) - 1.0) * 2**20) / 2**20
        cost = (rows - y) ** 2 + (cols - x) ** 2 + penalty
        nearer = cost < squared
        squared[nearer], labels[nearer] = cost[nearer], y * width + x
    return np.sqrt(squared).astype(np.float32), labels


def brute_distance(edges):
    return brute_multiplicative(np.where(edges != 0, 255, 0).astype(np.uint8))


def assert_same(result, expected):
    for got, want in zip(result, expected, strict=True):
        assert got.dtype == want.dtype
        np.testing.assert_array_equal(got, want)


# Maps that catch distance transforms out.


def random_map(rng, shape, density, levels=255):
    values = np.ceil(rng.integers(1, levels + 1, shape) * (255 / levels))
    return np.where(rng.random(shape) < density, values, 0).astype(np.uint8)


def ramps(shape):
    """Edges whose strength rises along them."""
    salience = np.zeros(shape, np.uint8)
    cv2.rectangle(salience, (shape[1] // 5, shape[0] // 4), (4 * shape[1] // 5, 3 * shape[0] // 4), 255, 1)
    return np.where(salience, np.linspace(1, 255, shape[1])[None, :], 0).astype(np.uint8)


def walls(shape):
    """Weak walls before a strong edge, which reappears behind them."""
    salience = np.zeros(shape, np.uint8)
    salience[:, shape[1] // 8] = 250
    for k, level in enumerate((3, 9, 27, 80), start=2):
        salience[shape[0] // 8 : -shape[0] // 8, k * shape[1] // 8] = level
    return salience


def single(shape, y, x, level):
    salience = np.zeros(shape, np.uint8)
    salience[y, x] = level
    return salience


def maps():
    rng = np.random.default_rng(7)
    yield "sparse", random_map(rng, (97, 131), 0.003)
    yield "random", random_map(rng, (64, 80), 0.08)
    yield "dense", random_map(rng, (24, 40), 1.0)
    yield "few levels, many ties", random_map(rng, (60, 60), 0.05, levels=4)
    yield "equal, many ties", random_map(rng, (60, 60), 0.05, levels=1)
    yield "ramps", ramps((120, 150))
    yield "walls", walls((128, 128))
    yield "one strong among weak", np.maximum(random_map(rng, (70, 70), 0.1) // 85, single((70, 70), 3, 66, 255))
    yield "single", single((33, 47), 20, 41, 17)
    yield "corner", single((9, 8), 8, 7, 255)
    yield "row", random_map(rng, (1, 300), 0.05)
    yield "column", random_map(rng, (300, 1), 0.05)
    yield "pixel", single((1, 1), 0, 0, 1)
    yield "nothing", np.zeros((12, 20), np.uint8)


CASES = [pytest.param(salience, id=name) for name, salience in maps()]


@pytest.mark.parametrize("salience", CASES)
def test_every_transform_equals_brute_force_at_every_thread_count(salience, monkeypatch):
    monkeypatch.setattr("rangeedge.distance._WORTH_THREADS", 0)
    distance, product, added = brute_distance(salience), brute_multiplicative(salience), brute_additive(salience)
    for threads in (1, 2, 3, 8):
        monkeypatch.setattr(cv2, "getNumThreads", lambda threads=threads: threads)
        assert_same(distanceTransformWithLabels(salience), distance)
        assert_same(salienceDistanceTransformWithLabels(salience), product)
        assert_same(salienceDistanceTransformWithLabels(salience, SALIENCE_ADDITIVE), added)


@pytest.mark.parametrize("seed", range(40))
def test_random_shapes_equal_brute_force(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(1, 50, 2))
    salience = random_map(rng, shape, rng.choice([0.02, 0.1, 0.5]), levels=rng.choice([1, 3, 17, 255]))
    lambda_ = rng.choice([0.0, 0.5, 3.0, 40.0])
    assert_same(distanceTransformWithLabels(salience), brute_distance(salience))
    assert_same(salienceDistanceTransformWithLabels(salience), brute_multiplicative(salience))
    assert_same(
        salienceDistanceTransformWithLabels(salience, SALIENCE_ADDITIVE, lambda_=lambda_),
        brute_additive(salience, lambda_),
    )


@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("free", [7, 63, 64, 150, 170, 171, 172, 173, 179, 180, 181, 200])
def test_short_and_long_distances_equal_brute_force(free, wrap):
    """The nearest of few sources lies up to `free` columns and rows away, on either side of what is treated apart."""
    rng = np.random.default_rng(free)
    for shape in ((5, free + 70), (free + 3, 64), (40, 63)):
        edges = np.zeros(shape, np.uint8)
        edges[:, 0] = rng.random(shape[0]) < 0.3
        edges[0] |= rng.random(shape[1]) < 0.02
        edges[-1, -1] = 1
        rows, cols = np.nonzero(edges)
        across = np.abs(np.arange(shape[1])[:, None] - cols)
        if wrap:
            across = np.minimum(across, shape[1] - across)
        squared = (np.arange(shape[0])[:, None, None] - rows) ** 2 + across**2
        expected = np.sqrt(squared.min(axis=2).astype(np.float64)).astype(np.float32)
        np.testing.assert_array_equal(distanceTransform(edges, wrap=wrap), expected)
        halves = distanceTransform(edges, wrap=wrap, pixelSize=0.5)
        np.testing.assert_array_equal(halves, expected / 2)


def test_large_map_equals_brute_force_at_every_thread_count(monkeypatch):
    rng = np.random.default_rng(3)
    salience = np.maximum(ramps((256, 256)), random_map(rng, (256, 256), 0.004))
    expected = brute_multiplicative(salience)
    for threads in (1, 2, 3, 8):
        monkeypatch.setattr(cv2, "getNumThreads", lambda threads=threads: threads)
        assert_same(salienceDistanceTransformWithLabels(salience), expected)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_by_hand(transform):
    edges = np.array([[255, 0, 0], [0, 0, 0]], np.uint8)
    expected = np.sqrt(np.array([[0, 1, 4], [1, 2, 5]], np.float64)).astype(np.float32)
    np.testing.assert_array_equal(transform(edges), expected)


def test_salience_by_hand():
    salience = np.array([[51, 0, 0, 0, 0, 0, 0, 255]], np.uint8)  # s = 1/5 and 1
    distance, labels = salienceDistanceTransformWithLabels(salience)
    assert distance.tolist() == [[0, 5, 5, 4, 3, 2, 1, 0]]
    assert labels.tolist() == [[0, 0, 7, 7, 7, 7, 7, 7]]
    added, _ = salienceDistanceTransformWithLabels(salience, SALIENCE_ADDITIVE, lambda_=1.0)  # f = 24 and 0
    np.testing.assert_array_equal(added, np.sqrt(np.float32([[24, 25, 25, 16, 9, 4, 1, 0]])))


def test_equals_opencv_up_to_its_rounding():
    edges = random_map(np.random.default_rng(5), (200, 300), 0.01)
    theirs = cv2.distanceTransform((edges == 0).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    np.testing.assert_allclose(distanceTransform(edges), theirs, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_full_salience_is_the_distance_transform(method):
    edges = random_map(np.random.default_rng(6), (150, 190), 0.02, levels=1)
    expected = distanceTransformWithLabels(edges)
    assert_same(salienceDistanceTransformWithLabels(edges, method), expected)
    assert_same(salienceDistanceTransformWithLabels(edges != 0, method), expected)
    assert_same(salienceDistanceTransformWithLabels((edges != 0).astype(np.float32), method), expected)


def test_both_forms_agree_at_lambda_from_a_single_edge():
    salience = single((1, 40), 0, 3, 60)
    product = salienceDistanceTransform(salience)
    added = salienceDistanceTransform(salience, SALIENCE_ADDITIVE, lambda_=12.0)
    assert added[0, 15] == pytest.approx(product[0, 15], rel=1e-6)
    assert added[0, 14] > product[0, 14]
    assert added[0, 16] < product[0, 16]


def test_float_salience_is_compared_exactly():
    """Levels so close together that only rational arithmetic tells all products apart."""
    rng = np.random.default_rng(8)
    levels = np.float32(0.75) + np.arange(-2, 3, dtype=np.float32) * np.spacing(np.float32(0.75))
    salience = np.where(rng.random((14, 15)) < 0.3, rng.choice(levels, (14, 15)), 0).astype(np.float32)
    _, labels = salienceDistanceTransformWithLabels(salience)
    sources = [(int(y), int(x), Fraction(float(salience[y, x])) ** 2) for y, x in np.argwhere(salience)]
    for (row, col), label in np.ndenumerate(labels):
        nearest = min(sources, key=lambda q: (((q[0] - row) ** 2 + (q[1] - col) ** 2) / q[2], q[0], q[1]))
        assert divmod(int(label), 15) == nearest[:2]


def test_float_salience_equals_brute_force_in_double():
    rng = np.random.default_rng(9)
    salience = np.where(rng.random((60, 70)) < 0.05, 10.0 ** rng.uniform(-6, 0, (60, 70)), 0).astype(np.float32)
    rows, cols = np.mgrid[:60, :70]
    everything = [np.hypot(rows - y, cols - x) / float(salience[y, x]) for y, x in np.argwhere(salience)]
    np.testing.assert_allclose(salienceDistanceTransform(salience), np.min(everything, axis=0), rtol=1e-7)
    assert_same(salienceDistanceTransformWithLabels(salience, SALIENCE_ADDITIVE), brute_additive(salience))


@pytest.mark.parametrize("method", METHODS)
def test_faintest_salience(method):
    salience = np.zeros((3, 30), np.float32)
    salience[1, 4] = 2.0**-30
    distance, labels = salienceDistanceTransformWithLabels(salience, method)
    assert distance[1, 6] == (2.0**31 if method == SALIENCE_MULTIPLICATIVE else np.float32(10 * 2.0**30))
    assert (labels == 34).all()
    salience[1, 4] = np.nextafter(np.float32(2.0**-30), np.float32(0))
    assert np.isinf(salienceDistanceTransform(salience, method)).all()


@pytest.mark.parametrize("shape", [(1, 70001), (70001, 1)])
def test_lines_whose_squares_overflow_32_bits(shape):
    edges = np.zeros(70001, np.uint8)
    edges[[0, 70000]] = 255
    position = np.arange(70001)
    expected = np.minimum(position, 70000 - position).astype(np.float32), np.where(position <= 35000, 0, 70000)
    expected = expected[0].reshape(shape), expected[1].astype(np.int32).reshape(shape)
    assert_same(distanceTransformWithLabels(edges.reshape(shape)), expected)
    for method in METHODS:
        assert_same(salienceDistanceTransformWithLabels(edges.reshape(shape), method), expected)


def test_far_and_weak():
    salience = np.zeros((2, 20000), np.uint8)
    salience[0, 0], salience[1, 19990] = 255, 1
    distance, labels = salienceDistanceTransformWithLabels(salience)
    x = np.arange(20000.0)
    strong = np.sqrt(x**2 + np.array([[0.0], [1.0]]) ** 2)
    weak = 255 * np.sqrt((x - 19990) ** 2 + np.array([[1.0], [0.0]]) ** 2)
    np.testing.assert_array_equal(labels, np.where(strong <= weak, 0, 39990))
    np.testing.assert_allclose(distance, np.minimum(strong, weak), rtol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_distances_follow_flips_and_transposition(method):
    salience = random_map(np.random.default_rng(10), (53, 70), 0.03)
    distance = salienceDistanceTransform(salience, method)
    np.testing.assert_array_equal(salienceDistanceTransform(salience[::-1], method), distance[::-1])
    np.testing.assert_array_equal(salienceDistanceTransform(salience[:, ::-1], method), distance[:, ::-1])
    np.testing.assert_array_equal(salienceDistanceTransform(salience.T, method), distance.T)


def test_multiplicative_form_scales_with_salience():
    salience = random_map(np.random.default_rng(11), (50, 60), 0.05).astype(np.float32) / 256
    np.testing.assert_array_equal(salienceDistanceTransform(salience / 4), 4 * salienceDistanceTransform(salience))


@pytest.mark.parametrize("method", METHODS)
def test_stronger_edges_bring_every_pixel_nearer(method):
    salience = random_map(np.random.default_rng(12), (50, 60), 0.05)
    stronger = np.where(salience, np.minimum(salience.astype(int) + 40, 255), 0).astype(np.uint8)
    assert (salienceDistanceTransform(stronger, method) <= salienceDistanceTransform(salience, method)).all()
    assert (distanceTransform(salience) <= salienceDistanceTransform(salience, method)).all()


def test_without_edges_everything_is_infinitely_far():
    nothing = np.zeros((40, 50), np.uint8)
    for distance, labels in (
        distanceTransformWithLabels(nothing),
        *(salienceDistanceTransformWithLabels(nothing, method) for method in METHODS),
    ):
        assert np.isposinf(distance).all()
        assert (labels == -1).all()


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_input_is_kept_and_may_be_strided(transform):
    big = random_map(np.random.default_rng(13), (80, 90), 0.05)
    view, before = big[::2, 1::3], big.copy()
    np.testing.assert_array_equal(transform(view), transform(view.copy()))
    np.testing.assert_array_equal(transform(np.asfortranarray(big)), transform(big))
    np.testing.assert_array_equal(big, before)
    big.flags.writeable = False
    transform(big)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_bool_counts_as_full(transform):
    edges = np.random.default_rng(14).random((30, 40)) < 0.05
    np.testing.assert_array_equal(transform(edges), transform(edges.astype(np.uint8) * 255))


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_dst_follows_opencv(transform):
    edges = random_map(np.random.default_rng(15), (20, 30), 0.1)
    expected = transform(edges)
    fitting, strided = np.empty((20, 30), np.float32), np.empty((20, 60), np.float32)[:, ::2]
    for dst in (fitting, strided):
        assert transform(edges, dst=dst) is dst
        np.testing.assert_array_equal(dst, expected)
    for other in (np.zeros((20, 30), np.float64), np.zeros((3, 3), np.float32)):
        np.testing.assert_array_equal(transform(edges, dst=other), expected)
        assert not other.any()


# Pixels that are not square, rows that wrap around.


def brute_lengths(shape, y, x, pixel, wrap):
    """Squared length from every pixel to (y, x)."""
    rows, cols = np.mgrid[: shape[0], : shape[1]]
    aside = np.abs(cols - x)
    if wrap:
        aside = np.minimum(aside, shape[1] - aside)
    return (pixel[0] * aside) ** 2 + (pixel[1] * (rows - y)) ** 2


def brute_in_lengths(salience, method, lambda_, pixel, wrap):
    least = np.full(salience.shape, np.inf)
    for y, x in np.argwhere(salience):
        s = salience[y, x] / 255.0
        squared = brute_lengths(salience.shape, y, x, pixel, wrap)
        cost = squared / s**2 if method == SALIENCE_MULTIPLICATIVE else squared + lambda_**2 * (1 / s**2 - 1)
        least = np.minimum(least, cost)
    return np.sqrt(least)


@pytest.mark.parametrize("wrap", [False, True])
@pytest.mark.parametrize("pixel", [(1.0, 1.0), (0.25, 0.25), (1.0, 2.5), (0.03, 0.002), (100.0, 1.0)])
def test_pixel_sizes_and_wrapping_equal_brute_force(pixel, wrap):
    rng = np.random.default_rng(16)
    options = {"pixelSize": pixel, "wrap": wrap}
    for density in (0.004, 0.05, 0.5):
        for shape in ((23, 40), (40, 23), (1, 9), (9, 1), (70, 70)):
            salience = random_map(rng, shape, density)
            edges = np.where(salience, 255, 0).astype(np.uint8)
            exact = brute_in_lengths(edges, SALIENCE_MULTIPLICATIVE, 0, pixel, wrap)
            np.testing.assert_allclose(distanceTransform(edges, **options), exact, rtol=1e-7)
            for method in METHODS:
                exact = brute_in_lengths(salience, method, 4 * pixel[0], pixel, wrap)
                found, labels = salienceDistanceTransformWithLabels(salience, method, lambda_=4 * pixel[0], **options)
                np.testing.assert_allclose(found, exact, rtol=1e-6)
                for (row, col), label in np.ndenumerate(labels[::5, ::7]):
                    if label >= 0:
                        one = np.zeros_like(salience)
                        one.flat[label] = salience.flat[label]
                        alone = brute_in_lengths(one, method, 4 * pixel[0], pixel, wrap)[5 * row, 7 * col]
                        assert alone == pytest.approx(exact[5 * row, 7 * col], rel=1e-6)


def test_wrapping_by_hand():
    edges = np.array([[255, 0, 0, 0, 0, 0]], np.uint8)
    distance, labels = distanceTransformWithLabels(edges, wrap=True)
    assert distance.tolist() == [[0, 1, 2, 3, 2, 1]]
    assert not labels.any()
    two = np.array([[0, 255, 0, 0, 0, 255]], np.uint8)  # column 3 is between both, so are 0 and the way round
    assert distanceTransformWithLabels(two, wrap=True)[1].tolist() == [[1, 1, 1, 1, 5, 5]]


@pytest.mark.parametrize("transform", [distanceTransformWithLabels, salienceDistanceTransformWithLabels])
def test_wrapped_maps_may_be_rolled(transform):
    salience = random_map(np.random.default_rng(17), (40, 61), 0.03)
    distance, _ = transform(salience, wrap=True)
    for columns in (1, 17, 30, 60):
        rolled, _ = transform(np.roll(salience, columns, axis=1), wrap=True)
        np.testing.assert_array_equal(rolled, np.roll(distance, columns, axis=1))


def test_a_length_scales_every_distance():
    salience = random_map(np.random.default_rng(18), (40, 50), 0.05)
    for method in METHODS:
        unit = salienceDistanceTransform(salience, method, lambda_=3.0)
        doubled = salienceDistanceTransform(salience, method, lambda_=6.0, pixelSize=2.0)
        np.testing.assert_array_equal(doubled, 2 * unit)
    np.testing.assert_array_equal(distanceTransform(salience, pixelSize=(4, 4)), 4 * distanceTransform(salience))


# Barriers.


def in_sight(barrier, one, other):
    """Whether the straight line between two middles crosses no barrier pixel and slips between no two, by fractions."""
    (y0, x0), (y1, x1) = one, other
    for y, x in itertools.product(range(min(y0, y1), max(y0, y1) + 1), range(min(x0, x1), max(x0, x1) + 1)):
        if barrier[y, x]:
            enter, leave = Fraction(0), Fraction(1)
            for start, way, cell in ((y0, y1 - y0, y), (x0, x1 - x0, x)):
                low, high = Fraction(2 * cell - 1, 2) - start, Fraction(2 * cell + 1, 2) - start
                if way:
                    enter, leave = max(enter, min(low / way, high / way)), min(leave, max(low / way, high / way))
                elif not low < 0 < high:
                    leave = enter
            if enter < leave:
                return False
        through = (2 * (y - y0) + 1) * (x1 - x0) == (2 * (x - x0) + 1) * (y1 - y0)
        if through and y < max(y0, y1) and x < max(x0, x1):
            square = barrier[y : y + 2, x : x + 2]
            if (square[0, 0] and square[1, 1]) or (square[0, 1] and square[1, 0]):
                return False
    return True


def brute_geodesic(edges, barrier, pixel=(1.0, 1.0), wrap=False):
    """Dijkstra over all pairs of pixels in sight of each other; of a map that wraps over five of it side by side."""
    if wrap:
        width = edges.shape[1]
        around = brute_geodesic(np.tile(edges, (1, 5)), np.tile(barrier, (1, 5)), pixel)
        return around[:, 2 * width : 3 * width]
    free = [tuple(p) for p in np.argwhere(barrier == 0)]
    length = {p: 0.0 if edges[p] else np.inf for p in free}
    queue = [(0.0, p) for p in free if edges[p]]
    while queue:
        so_far, p = heapq.heappop(queue)
        for q in free:
            longer = so_far + np.hypot(pixel[0] * (p[1] - q[1]), pixel[1] * (p[0] - q[0]))
            if longer < length[q] and in_sight(barrier, p, q):
                length[q] = longer
                heapq.heappush(queue, (longer, q))
    result = np.full(edges.shape, np.inf)
    for p, value in length.items():
        result[p] = value
    return result


@pytest.mark.parametrize("seed", range(12))
def test_ways_around_barriers_against_brute_force(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 12, 2))
    barrier, edges = rng.random(shape) < rng.choice([0.15, 0.3, 0.45]), rng.random(shape) < 0.06
    shortest = brute_geodesic(edges, barrier)
    found, labels = distanceTransformWithLabels(edges, barrier=barrier)
    reached = np.isfinite(shortest)
    np.testing.assert_array_equal(np.isfinite(found), reached)
    np.testing.assert_array_equal(labels >= 0, reached)
    assert (edges & ~barrier).flat[labels[reached]].all()
    assert (found[reached] >= shortest[reached] * (1 - 1e-6)).all()
    assert (found[reached] <= shortest[reached] * 1.0824 + 1e-6).all()
    close = found[reached] <= shortest[reached] * (1 + 1e-6)
    assert close.size < 20 or close.mean() > 0.85


@st.composite
def mazes(draw):
    """Edges, a barrier of any density, the size of a pixel and whether the map wraps; all small."""
    wrap = draw(st.booleans())
    shape = draw(st.integers(1, 6)), draw(st.integers(1, 5 if wrap else 8))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    barrier = rng.random(shape) < draw(st.sampled_from([0, 0.15, 0.3, 0.5, 1]))
    edges = rng.random(shape) < draw(st.sampled_from([0, 0.05, 0.2, 1]))
    return edges, barrier, draw(st.sampled_from([(1.0, 1.0), (3.0, 1.0), (1.0, 100.0), (0.001, 0.0005)])), wrap


@settings(max_examples=60, deadline=None)
@given(mazes())
def test_mazes_of_any_pixels_against_brute_force(maze):
    edges, barrier, pixel, wrap = maze
    found, labels = distanceTransformWithLabels(edges, barrier=barrier, pixelSize=pixel, wrap=wrap)
    shortest = brute_geodesic(edges, barrier, pixel, wrap)
    reached = np.isfinite(shortest)
    np.testing.assert_array_equal(np.isfinite(found), reached)
    np.testing.assert_array_equal(labels >= 0, reached)
    assert (edges & ~barrier).flat[labels[reached]].all()
    assert (found >= shortest * (1 - 1e-6)).all()
    # What steps to eight neighbours are longer than a straight line at most: halfway between two of them.
    diagonal = np.arctan2(pixel[1], pixel[0])
    assert (found <= shortest / np.cos(max(diagonal, np.pi / 2 - diagonal) / 2) * (1 + 1e-6)).all()
    # Where the nearest edge is in sight, there is nothing longer about it.
    straight = distanceTransform(edges & ~barrier, pixelSize=pixel, wrap=wrap)
    seen = reached & (shortest <= straight * (1 + 1e-7))
    np.testing.assert_allclose(found[seen], shortest[seen], rtol=1e-6)


def test_of_two_edges_as_near_the_one_in_sight_counts():
    edges, barrier = np.zeros((5, 4), np.uint8), np.zeros((5, 4), np.uint8)
    edges[4, 0] = edges[4, 2] = 1
    barrier[1, 2] = barrier[2, 0] = barrier[3, 3] = 1  # the second is in the way to the edge at the left
    distance, labels = distanceTransformWithLabels(edges, barrier=barrier)
    assert distance[0, 1] == np.float32(np.sqrt(17))
    assert labels[0, 1] == 4 * 4 + 2


def test_either_way_round_is_as_good():
    edges, barrier = np.zeros((2, 4), np.uint8), np.zeros((2, 4), np.uint8)
    edges[0, 0] = 1
    barrier[0, 1] = 1
    distance = distanceTransform(edges, barrier=barrier, wrap=True)
    assert distance[0, 2] == 2
    assert distance[1, 2] == np.float32(np.sqrt(5))


def test_barrier_by_hand():
    edges, barrier = np.zeros((5, 7), np.uint8), np.zeros((5, 7), np.uint8)
    edges[2, 1] = 1
    barrier[1:4, 3] = 255  # a wall with a way around either end
    distance = distanceTransform(edges, barrier=barrier)
    assert np.isposinf(distance[1:4, 3]).all()
    assert distance[2, 2] == 1
    assert distance[0, 3] == np.float32(np.sqrt(8))  # in sight, past the corner of the wall
    assert distance[2, 4] == pytest.approx(np.sqrt(8) + np.sqrt(2) + 1)
    barrier[:, 3] = 255
    behind = distanceTransform(edges, barrier=barrier)
    assert np.isposinf(behind[:, 3:]).all()
    assert np.isfinite(behind[:, :3]).all()
    assert np.isfinite(distanceTransform(edges, barrier=barrier, wrap=True)[:, 4:]).all()


def test_no_way_leads_through_a_diagonal_line():
    edges, barrier = np.zeros((9, 9), np.uint8), np.eye(9, dtype=bool)
    edges[0, 8] = 1
    distance = distanceTransform(edges, barrier=barrier)
    assert np.isposinf(distance[np.tril_indices(9)]).all()
    assert np.isfinite(distance[np.triu_indices(9, 1)]).all()


def test_without_barrier_pixels_ways_are_straight(monkeypatch):
    monkeypatch.setattr("rangeedge.distance._WORTH_THREADS", 0)
    edges = random_map(np.random.default_rng(19), (60, 80), 0.01, levels=1)
    for options in ({}, {"wrap": True}, {"pixelSize": (1.0, 3.0)}):
        expected = distanceTransformWithLabels(edges, **options)
        assert_same(distanceTransformWithLabels(edges, barrier=np.zeros_like(edges), **options), expected)


def test_barriers_at_every_thread_count(monkeypatch):
    monkeypatch.setattr("rangeedge.distance._WORTH_THREADS", 0)
    rng = np.random.default_rng(20)
    edges, barrier = rng.random((90, 70)) < 0.003, rng.random((90, 70)) < 0.3
    results = []
    for threads in (1, 2, 3, 8):
        monkeypatch.setattr(cv2, "getNumThreads", lambda threads=threads: threads)
        results.append(distanceTransformWithLabels(edges, barrier=barrier, wrap=True, pixelSize=(1.0, 0.5)))
    for result in results[1:]:
        assert_same(result, results[0])


# Awkward inputs.


@pytest.mark.parametrize("method", METHODS)
def test_any_layout_of_a_salience_map(method):
    salience = random_map(np.random.default_rng(21), (30, 40), 0.1)
    strength = salience.astype(np.float32) / 256
    expected = salienceDistanceTransform(strength, method)
    unaligned = np.frombuffer(b"\0" + strength.tobytes(), np.uint8)[1:].view(np.float32).reshape(strength.shape)
    assert not unaligned.flags.aligned
    for same in (unaligned, np.asfortranarray(strength), np.repeat(strength, 2, axis=1)[:, ::2]):
        np.testing.assert_array_equal(salienceDistanceTransform(same, method), expected)
    full = salience > 0
    np.testing.assert_array_equal(
        salienceDistanceTransform(full.T, method), salienceDistanceTransform(np.ascontiguousarray(full.T), method)
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_a_map_that_another_thread_writes_to(method, dtype):
    """Any answer will do, and none may read beyond an array."""
    salience = np.full((200, 220), 1, dtype)
    stop = threading.Event()

    def write():
        values = itertools.cycle([0, 1] if dtype == np.uint8 else [np.nan, 0.5, 0, 1e-9])
        while not stop.is_set():
            salience[:] = next(values)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            with contextlib.suppress(rangeedge.error):  # of NaN
                salienceDistanceTransform(salience, method)
    finally:
        stop.set()
        writer.join()


@pytest.mark.parametrize("shape", ["ramp", "cone"])
def test_time_is_bounded_where_salience_rises_steadily(shape):
    """Far sources are the stronger ones there, so that nearly all of them compete."""

    def worst(side):
        y, x = np.mgrid[:side, :side]
        if shape == "ramp":
            return np.where(x < side / 4, 1 - x / side, 0).astype(np.float32)
        radius = np.hypot(y - side / 2, x - side / 2)
        return np.where(radius < 0.3 * side, 0, radius / radius.max()).astype(np.float32)

    def seconds(salience):
        def once():
            start = time.process_time()
            salienceDistanceTransform(salience)
            return time.process_time() - start

        return min(once() for _ in range(3))

    dense = np.random.default_rng(22).random((900, 900), np.float32)
    assert seconds(worst(900)) < 3.5 * seconds(dense)


@pytest.mark.parametrize("transform", [*TRANSFORMS, distanceTransformWithLabels, salienceDistanceTransformWithLabels])
@pytest.mark.parametrize(
    "bad",
    [
        None,
        [[0, 255]],
        np.zeros((0, 4), np.uint8),
        np.zeros(4, np.uint8),
        np.zeros((2, 2, 3), np.uint8),
        np.zeros((2, 2), np.int32),
        np.zeros((2, 2), np.float64),
        np.zeros((2, 2), complex),
        np.broadcast_to(np.uint8(0), (2**16, 2**15)),
        np.broadcast_to(np.uint8(0), (1, 2**24 + 1)),
    ],
    ids=["None", "list", "empty", "1-D", "3-D", "int32", "float64", "complex", "2^31 pixels", "side over 2^24"],
)
def test_bad_images(transform, bad):
    with pytest.raises(rangeedge.error) as caught:
        transform(bad)
    assert caught.value.func == transform.__name__
    assert "`edges`" in str(caught.value) or "`salience`" in str(caught.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1e-6, 1.0001, 80.0])
def test_float_salience_outside_its_range(value):
    salience = np.full((3, 4), 0.5, np.float32)
    salience[1, 2] = value
    for method in METHODS:
        with pytest.raises(rangeedge.error, match=r"salience.*\[0, 1\]"):
            salienceDistanceTransform(salience, method)


@pytest.mark.parametrize("method", [2, -1, True, 0.0, "additive", None])
def test_bad_method(method):
    with pytest.raises(rangeedge.error, match="SALIENCE_ADDITIVE"):
        salienceDistanceTransform(np.zeros((2, 2), np.uint8), method)


@pytest.mark.parametrize("lambda_", [-1.0, np.nan, np.inf, 1e7, "ten", None])
def test_bad_lambda(lambda_):
    with pytest.raises(rangeedge.error, match="lambda_"):
        salienceDistanceTransform(np.zeros((2, 2), np.uint8), SALIENCE_ADDITIVE, lambda_=lambda_)


@pytest.mark.parametrize("transform", TRANSFORMS)
def test_bad_dst(transform):
    edges, locked = np.zeros((2, 2), np.uint8), np.zeros((2, 2), np.float32)
    locked.flags.writeable = False
    for dst in (locked, [[0.0, 0.0]]):
        with pytest.raises(rangeedge.error, match="dst"):
            transform(edges, dst=dst)


EVERY = [*TRANSFORMS, distanceTransformWithLabels, salienceDistanceTransformWithLabels]


@pytest.mark.parametrize("transform", EVERY)
@pytest.mark.parametrize("size", [0, -1.0, (1, 0), (1, 2, 3), np.inf, np.nan, "1", (1.0, 101.0), 1e31])
def test_bad_pixel_size(transform, size):
    with pytest.raises(rangeedge.error, match=rf"{transform.__name__}:.*`pixelSize`"):
        transform(np.zeros((2, 2), np.uint8), pixelSize=size)


@pytest.mark.parametrize("transform", EVERY)
def test_bad_wrap(transform):
    with pytest.raises(rangeedge.error, match=rf"{transform.__name__}:.*`wrap`"):
        transform(np.zeros((2, 2), np.uint8), wrap=1)


@pytest.mark.parametrize("transform", [distanceTransform, distanceTransformWithLabels])
@pytest.mark.parametrize("barrier", [np.zeros((2, 3), np.uint8), np.zeros((2, 2)), [[0, 1], [0, 0]]])
def test_bad_barrier(transform, barrier):
    with pytest.raises(rangeedge.error, match=rf"{transform.__name__}:.*`barrier`"):
        transform(np.zeros((2, 2), np.uint8), barrier=barrier)


@pytest.mark.parametrize(
    ("near", "far", "levels"),
    [
        ((20, 10), (37, 20), (8191323, 15407528)),
        ((16, 16), (37, 8), (3438579, 5752639)),
        ((17, 15), (23, 8), (4278727, 4595792)),
    ],
)
def test_quotients_that_differ_less_than_doubles_do(near, far, levels):
    """500 / 8191323^2 and 1769 / 15407528^2 have one value in double precision; the smaller one wins nevertheless."""
    squares = [y * y + x * x for y, x in (near, far)]
    exact = [Fraction(squared, level * level) for squared, level in zip(squares, levels, strict=True)]
    products = [float(squares[0]) * (levels[1] * levels[1]), float(squares[1]) * (levels[0] * levels[0])]
    assert products[0] == products[1]
    assert exact[0] != exact[1]
    nearest = int(exact[1] < exact[0])
    for sign in (1, -1):  # either of them comes first in the image
        salience = np.zeros((81, 81), np.float32)
        places = [(40 + sign * near[0], 40 + near[1]), (40 - sign * far[0], 40 - far[1])]
        for place, level in zip(places, levels, strict=True):
            salience[place] = level / 2**24
        labels = salienceDistanceTransformWithLabels(salience, SALIENCE_MULTIPLICATIVE)[1]
        assert labels[40, 40] == np.ravel_multi_index(places[nearest], salience.shape)


def test_labels_around_barriers_are_those_of_the_ways():
    edges, barrier = np.zeros((11, 13), np.uint8), np.zeros((11, 13), np.uint8)
    barrier[:10, 5] = 255
    edges[0, 3] = edges[0, 12] = 255  # the first is nearer to the pixels beside the wall, but for the wall
    distance, labels = distanceTransformWithLabels(edges, barrier=barrier)
    assert (distance[0, 6:] == np.arange(6, -1, -1)).all()
    assert (labels[0, 6:] == 12).all()
    for source in (3, 12):
        alone = np.zeros_like(edges)
        alone[0, source] = 255
        own = labels == source
        np.testing.assert_allclose(distance[own], distanceTransform(alone, barrier=barrier)[own], rtol=1e-6)
