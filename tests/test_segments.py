"""Straight segments and vertices: by hand on made-up chains, and against the true edges of rendered boxes."""

import itertools

import numpy as np
import pytest

import rangeedge
from rangeedge import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, EdgeChain, fitSegments, linkEdges
from rangeedge.chains import CHAIN, POINT
from rangeedge.segments import SEGMENT, _variance_along
from rangeedge.synthetic import (
    box,
    gaussianNoise,
    kinectCamera,
    kinectNoise,
    pinholeCamera,
    plane,
    renderScene,
    sphere,
)

K = np.array([[525.0, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])
CAMERA = pinholeCamera(K, (640, 480))
SIZE, CENTRE = np.array([0.3, 0.25, 0.2]), np.array([0.0, 0.0, 1.0])


def chain_of(places, kind=EDGE_CONVEX, crease=60.0, *, straight=True, closed=False, noise=0.0, seed=0):
    """A chain through places in space, seen from above, 100 pixels a unit."""
    places = np.asarray(places, float)
    points = np.zeros(len(places), POINT)
    points["point"], points["x"], points["y"] = places, 100 * places[:, 0], 100 * places[:, 1]
    points["measured"] = places + np.random.default_rng(seed).normal(0, noise, places.shape)
    chain = np.zeros((), CHAIN)
    chain["kind"], chain["crease"], chain["straight"], chain["closed"] = kind, crease, straight, closed
    return EdgeChain(chain, points)


def line(a, b, count=50, **options):
    return chain_of(np.linspace(a, b, count), **options)


@pytest.fixture(scope="module", params=[3, 5])
def fitted(request):
    axes = np.linalg.qr(np.random.default_rng(request.param).normal(size=(3, 3)))[0]
    rendering = renderScene([plane((0, 0, 1.3), (0.05, -0.3, -1)), box(CENTRE, SIZE, axes)], CAMERA)
    signs = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
    return fitSegments(linkEdges(rendering.depth, K=K)), CENTRE + signs * SIZE @ axes.T


def test_corners_between_creases_are_exact(fitted):
    (segments, vertices), corners = fitted
    assert len(segments) == 9
    assert len(vertices) == 7
    off = np.linalg.norm(vertices["point"][:, None] - corners, axis=2).min(axis=1)
    assert off.max() < 2e-4
    creases = np.flatnonzero(segments["kind"] == EDGE_CONVEX)
    inner = np.intersect1d(*segments["vertices"][creases[:2]])
    assert off[inner] < 1e-5


def test_lengths_and_angles_are_those_of_the_box(fitted):
    segments = fitted[0].segments
    for length in segments["length"]:
        assert np.abs(SIZE - length).min() < 3e-4
    convex = segments[segments["kind"] == EDGE_CONVEX]
    assert np.allclose(convex["dihedral"], 90, atol=0.05)
    assert np.isnan(segments["dihedral"][segments["kind"] == EDGE_JUMP]).all()


def test_a_segment_holds_what_its_chain_says():
    (segment,), vertices = fitSegments([line((1, 2, 3), (1, 5, 7), kind=EDGE_CONCAVE)])
    assert len(vertices) == 0
    assert np.allclose(segment["ends"], [[1, 2, 3], [1, 5, 7]])
    assert segment["pixels"].tolist() == [[100, 200], [100, 500]]
    assert np.allclose(segment["direction"], [0, 0.6, 0.8])
    assert segment["length"] == pytest.approx(5)
    assert (segment["kind"], segment["dihedral"], segment["count"], segment["chain"]) == (EDGE_CONCAVE, 240, 50, 0)
    assert segment["vertices"].tolist() == [-1, -1]
    assert segment["rms"] < 1e-12


def test_deviations_are_those_of_repeated_fits():
    rng = np.random.default_rng(1)
    truth = np.linspace((0, 0, 0), (4, 0, 0), 40)
    found = []
    for _ in range(300):
        measured = truth + rng.normal(0, 0.01, truth.shape)
        found.append(chain_of(measured))
        found[-1].points["measured"] = measured
    segments = fitSegments(found, reach=0).segments
    assert np.median(segments["rms"]) == pytest.approx(0.01 * np.sqrt(2), rel=0.05)
    common = 0.5 * np.median(segments["rms"])  # what all points are taken to have in common, here nothing
    across = segments["ends"][:, :, 1:].reshape(-1, 2)
    end = np.sqrt((across**2).sum(axis=1).mean())
    assert np.hypot(end, common) == pytest.approx(np.median(segments["endDeviation"]), rel=0.15)
    tilt = np.sqrt((np.linalg.norm(segments["direction"][:, 1:], axis=1) ** 2).mean())
    assert np.degrees(np.hypot(tilt, common / 4)) == pytest.approx(np.median(segments["directionDeviation"]), rel=0.15)


def test_three_lines_meet_in_a_vertex_and_end_there():
    corner = np.array([2.0, 2.0, 1.0])
    chains = [line(corner + 0.05 * np.array(d), corner + np.array(d)) for d in ((1, 0, 0), (0, 1, 0.2), (-1, -1, 1))]
    segments, vertices = fitSegments(chains, reach=20)
    assert vertices["count"].tolist() == [3]
    assert np.allclose(vertices["point"], corner)
    assert np.allclose([vertices["x"][0], vertices["y"][0]], [200, 200])
    assert segments["vertices"].tolist() == [[0, -1]] * 3
    assert np.allclose(segments["ends"][:, 0], corner)
    assert np.allclose(segments["length"], [1, np.sqrt(1.04), np.sqrt(3)])


def test_lines_that_pass_each_other_in_depth_do_not_meet():
    chains = [line((0, 0, 1), (1, 0, 1)), line((1.02, 0.02, 1.1), (1.02, 1, 1.1))]
    assert len(fitSegments(chains).vertices) == 0
    chains[1] = line((1.02, 0.02, 1), (1.02, 1, 1))
    assert len(fitSegments(chains).vertices) == 1
    assert len(fitSegments(chains, reach=1).vertices) == 0


def test_continuations_of_one_line_do_not_meet_far_away():
    chains = [line((0, 0, 1), (1, 0, 1)), line((1.03, 0.001, 1), (2, 0.001, 1.0))]
    assert len(fitSegments(chains).vertices) == 0


def test_curved_chains_are_divided_by_a_tolerance():
    angle = np.linspace(0, np.pi / 2, 200)
    arc = chain_of(np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)]), straight=False)
    assert len(fitSegments([arc]).segments) == 0
    for tolerance, least in ((0.05, 2), (0.005, 4)):
        segments = fitSegments([arc], tolerance, reach=0).segments
        assert least <= len(segments) <= 3 * least
        sagitta = 1 - np.sqrt(1 - (segments["length"].max() / 2) ** 2)
        assert sagitta <= tolerance * 1.05


def test_closed_chains_are_divided_all_around():
    corners = np.array([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1)])
    sides = [np.linspace(a, b, 30, endpoint=False) for a, b in itertools.pairwise(corners)]
    square = np.concatenate(sides)
    segments, vertices = fitSegments([chain_of(square, straight=False, closed=True)], 0.01)
    assert len(segments) == len(vertices) == 4
    assert np.allclose(segments["length"], 1)


def test_short_chains_and_no_chains_give_none():
    assert len(fitSegments([line((0, 0, 1), (1, 0, 1), 7)]).segments) == 0
    assert len(fitSegments([line((0, 0, 1), (1, 0, 1), 7)], minPoints=7).segments) == 1
    assert repr(fitSegments([])) == "<0 segments, 0 vertices>"


def test_the_rim_of_a_sphere_is_no_segment():
    rendering = renderScene([plane((0, 0, 1.5), (0, 0, -1)), sphere((0, 0, 1.0), 0.15)], CAMERA)
    assert len(fitSegments(linkEdges(rendering.depth, K=K)).segments) == 0


def test_noise_shows_in_the_deviations():
    axes = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    rendering = renderScene([plane((0, 0, 1.3), (0.05, -0.3, -1)), box(CENTRE, SIZE, axes)], CAMERA)
    quiet, loud = (
        fitSegments(linkEdges(gaussianNoise(rendering, sigma, 1).src, K=K)).segments for sigma in (0.0003, 0.003)
    )
    for segments in (quiet, loud):
        convex = segments[segments["kind"] == EDGE_CONVEX]
        assert len(convex) == 3
    medians = [np.median(s["endDeviation"][s["kind"] == EDGE_CONVEX]) for s in (quiet, loud)]
    assert medians[1] > 2 * medians[0]


def test_deviations_of_jumps_are_those_of_lines_between_the_same_pixels():
    errors, deviations = [], []
    rows, cols = np.mgrid[:70, :90]
    for slope, offset in np.random.default_rng(4).uniform((0.05, 0), (0.95, 1), (40, 2)):
        depth = np.where(cols < 20 + offset + slope * rows, 1.0, 3.0)
        (segment,) = fitSegments(linkEdges(depth, pixelSize=1, noise=1e-3)).segments
        x, y, _ = segment["ends"].T
        errors.append((x - (20 + offset + slope * y)) / np.hypot(1, slope))
        deviations.append(segment["endDeviation"])
    ratio = np.concatenate(errors).reshape(-1, 2) / np.array(deviations)[:, None]
    assert 0.6 < np.sqrt(np.mean(ratio**2)) < 1.4
    assert np.median(deviations) < 0.05  # a scan line alone is off by 0.29


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fitSegments(3), "fitSegments: `chains` must be EdgeChains"),
        (lambda: fitSegments([1]), "fitSegments: `chains` must be EdgeChains"),
        (lambda: fitSegments([], 0), "fitSegments: `tolerance` must be a finite number > 0"),
        (lambda: fitSegments([], reach=-1), "fitSegments: `reach` must be"),
        (lambda: fitSegments([], minPoints=1), "fitSegments: `minPoints` must be an integer >= 2"),
    ],
)
def test_bad_arguments_are_named(call, text):
    with pytest.raises(rangeedge.error) as problem:
        call()
    assert text in str(problem.value)


def test_a_short_segment_between_two_others_keeps_its_length():
    ways = [((1, 1, 0), (1.05, 1, 0)), ((1, 1, 0), (1, 2, 0)), ((1.05, 1, 0), (1.05, 2, 0.3))]
    counts = (12, 50, 50)
    segments, vertices = fitSegments(
        [line(*way, count=n, noise=0.02, seed=k) for k, (way, n) in enumerate(zip(ways, counts, strict=True))], reach=6
    )
    assert len(vertices) == 1
    assert segments["vertices"].tolist() == [[0, -1], [0, -1], [0, -1]]
    assert 0.01 < segments["length"][0] < 0.05


def test_deviation_of_lengths_between_corners():
    """Of boxes whose edges are known: none of an end that is no corner, else about as large as the errors are."""
    sizes, ratios = (0.2, 0.25, 0.3), []
    for seed in range(14):
        axes = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        scene = [plane((0, 0, 1.3), (0.05, -0.3, -1)), box((0, 0, 1.0), sizes, axes)]
        scan = kinectNoise(renderScene(scene, kinectCamera()), seed=seed)
        segments = fitSegments(linkEdges(scan.src, **scan.geometry)).segments
        known = np.isfinite(segments["lengthDeviation"])
        assert np.array_equal(known, (segments["vertices"] >= 0).all(axis=1))
        for segment in segments[known & (segments["kind"] == EDGE_CONVEX)]:
            error = min(abs(segment["length"] - size) for size in sizes)
            if error < 0.02:  # others are parts of edges
                ratios.append(error / segment["lengthDeviation"])
    assert len(ratios) > 5
    assert 0.3 < np.quantile(ratios, 0.68) < 1.8


def test_deviation_of_a_length_is_that_of_the_lines_that_cross_its_ends():
    """At right angles it is the deviation of these lines, and twice as much where they meet at 30 degrees."""
    lines = np.zeros(3, SEGMENT)
    lines["direction"] = (1, 0, 0), (0, 1, 0), (np.cos(np.radians(30)), np.sin(np.radians(30)), 0)
    lines["endDeviation"] = 5, 0.1, 0.1
    assert _variance_along(lines, 0, [0, 1]) ** 0.5 == pytest.approx(0.1)
    assert _variance_along(lines, 0, [0, 2]) ** 0.5 == pytest.approx(0.2)
    assert _variance_along(lines, 0, [0, 1, 2]) ** -1 == pytest.approx(0.1**-2 + 0.2**-2)
