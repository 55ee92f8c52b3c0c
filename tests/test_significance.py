"""What the noise of fits does to splitting, to curves and to significance, and which strengths count."""

import numpy as np
import pytest
from scenes import K, seen, surfaces

from rangeedge import (
    CREASE_MAX,
    DIR_ROWS,
    EDGE_JUMP,
    EDGE_OCCLUDING,
    EdgeStrength,
    NoiseModel,
    ScanLineParams,
    createScanLineDetector,
    detectEdges,
    edgePoints,
    edgeStrength,
    selectEdges,
)

NAN = np.nan
LEVELS = 5  # numbers of samples for which factors are given
RAW = dict(minSignificance=0.0, maxShift=0.0, crease=CREASE_MAX)  # every candidate by itself


def fits(sigma, waves=1.0, slope=1.0, value=1.0, shared_slope=1.0, shared_value=1.0, residual=1.0):
    """A model of this deviation, waves in units of it, with the same factors for every number of samples."""
    one = [f for f in (slope, value, shared_slope, shared_value) for _ in range(LEVELS)] + [residual]
    return NoiseModel(sigma, fits=(waves * sigma, 0.0, 0.0, 0.0, *one, *one))


GEOMETRIES = {"grid": (lambda z: z, dict(pixelSize=0.02)), "camera": (lambda z: z, dict(K=K)), "points": (seen, {})}


# Significance.


U = np.arange(60)
EDGES = {  # and the factor by which each counts
    "jump": (np.where(U < 30, 1.25, 1.0), "shared_value"),
    "jump beside shadow": (np.where((U > 15) & (U < 35), NAN, np.where(U < 30, 1.25, 1.0)), "shared_value"),
    "crease": (1 + 0.03 * np.abs(U - 29.6), "shared_slope"),
}


@pytest.mark.parametrize("edge", EDGES)
def test_significance_is_in_deviations_of_what_neighbours_tell_together(edge):
    profile, own = EDGES[edge]
    z = profile * np.ones((30, 1))

    def of(**factors):
        points = edgePoints(z, noise=fits(0.003, **factors), directions=DIR_ROWS, **RAW)
        assert len(points) == 30
        return points["significance"]

    (other,) = {"shared_value", "shared_slope"} - {own}
    np.testing.assert_allclose(of(**{own: 2.5}) * 2.5, of(), rtol=1e-5)
    np.testing.assert_allclose(of(**{other: 2.5}), of(), rtol=1e-5)


def test_a_line_is_as_significant_as_its_pixels_and_the_more_so_the_longer_it_is():
    jump, significance = np.zeros((2, 9, 60), np.float32)
    jump[2, 3:13] = jump[6, 3:43] = 1
    significance[2, 3:13:2], significance[2, 4:14:2] = 7, 1  # root mean square 5
    significance[6, 3:43] = 3  # over four times as many pixels
    kind = np.where(jump > 0, EDGE_JUMP | EDGE_OCCLUDING, 0).astype(np.uint8)
    strength = EdgeStrength(jump, np.zeros_like(jump), kind, significance)
    for least, short, long in ((0, True, True), (4.99, True, True), (5.01, False, True), (6.01, False, False)):
        expected = jump > 0
        expected[2] &= short
        expected[6] &= long
        assert np.array_equal(selectEdges(strength, 1.0, lineSignificance=least) > 0, expected)


def test_a_line_may_have_gaps_of_two_pixels():
    # Pieces of 9 pixels, each of a significance of 5, with 1, 2 and 3 pixels between them, along a row and a diagonal.
    def kept(gap, down, least):
        jump = np.zeros((30, 30), np.float32)
        for k in (*range(9), *range(9 + gap, 18 + gap)):
            jump[5 + k * down, 5 + k] = 1
        kind = np.where(jump > 0, EDGE_JUMP | EDGE_OCCLUDING, 0).astype(np.uint8)
        strength = EdgeStrength(jump, np.zeros_like(jump), kind, jump * 5)
        edges = selectEdges(strength, 0.5, lineSignificance=least) > 0
        assert np.array_equal(edges, jump > 0) or not edges.any()
        return edges.any()

    for down in (0, 1):
        for gap in (1, 2):
            assert kept(gap, down, 5 * np.sqrt((18 + gap) / 10) - 0.01)
            assert not kept(gap, down, 5 * np.sqrt((18 + gap) / 10) + 0.01)
        assert kept(3, down, 5 * np.sqrt(9 / 10) - 0.01)
        assert not kept(3, down, 5 * np.sqrt(9 / 10) + 0.01)


def test_a_piece_of_a_line_has_the_least_length_itself():
    jump = np.zeros((9, 40), np.float32)
    jump[4, 5:20] = jump[4, 22:25] = 1
    kind = np.where(jump > 0, EDGE_JUMP | EDGE_OCCLUDING, 0).astype(np.uint8)
    strength = EdgeStrength(jump, np.zeros_like(jump), kind, jump * 30)
    for least, pixels in ((3, 18), (4, 15)):
        assert (selectEdges(strength, 0.5, minLength=least) > 0).sum() == pixels


def test_the_detector_leaves_lines_out_that_are_not_significant():
    z = 1 + 0.002 * np.abs(U - 29.6) * np.ones((50, 1)) + np.random.default_rng(2).normal(0, 0.004, (50, 60))
    options = dict(noise=0.004, pixelSize=0.002)
    assert detectEdges(z, **options).any()
    assert detectEdges(z, lineSignificance=14.0, **options).any()
    assert not detectEdges(z, lineSignificance=200.0, **options).any()


def test_all_lines_stay_where_every_candidate_does_unless_a_significance_is_asked_for():
    z = 1 + 0.002 * np.abs(U - 29.6) * np.ones((50, 1)) + np.random.default_rng(2).normal(0, 0.006, (50, 60))
    known = dict(noise=0.006, pixelSize=0.002)
    for params, meant, other in (
        (ScanLineParams.paper(**known), 0, 20),
        (ScanLineParams(minSignificance=0, **known), 0, 20),
        (ScanLineParams(minSignificance=1, **known), 20, 0),
    ):
        detector = createScanLineDetector(params)
        edges = detector.detectEdges(z, creaseThreshold=20)
        assert np.array_equal(edges, detector.detectEdges(z, creaseThreshold=20, lineSignificance=meant))
        assert not np.array_equal(edges, detector.detectEdges(z, creaseThreshold=20, lineSignificance=other))


# Splitting.


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_lines_are_split_where_they_exceed_the_waves(geometry):
    form, options = GEOMETRIES[geometry]
    src = form(surfaces(np.random.default_rng(2), (40, 50)))
    model = fits(0.001, waves=3.0, residual=1.5)
    options = dict(options, epsFactor=2.0, mergeSignificance=0.0, **RAW)

    def cuts(**tolerance):
        points = edgePoints(src, noise=model, **{**options, **tolerance})
        return set(zip(points["x"].tolist(), points["y"].tolist(), points["direction"].tolist(), strict=True))

    assert cuts() == cuts(eps=2.0 * 1.5 * 3.0 * 0.001)
    assert len(cuts(eps=2.0 * 1.5 * 0.001)) > 1.2 * len(cuts()) > 0


# Curves.


@pytest.mark.parametrize("factor", [1.0, 3.0])
@pytest.mark.parametrize(("significance", "curved"), [(4.0, False), (5.8, False), (6.2, True), (12.0, True)])
def test_a_quadratic_term_needs_six_deviations(significance, curved, factor):
    """The jump from a straight line to an arc tells whether that was taken for one."""
    n, sigma = 40, 0.001
    t = np.arange(n) - (n - 1) / 2
    p = t**2 - np.mean(t**2)  # orthogonal to straight lines
    c = significance * factor * sigma / np.sqrt(p @ p)
    height = np.concatenate([np.zeros(n), 1 + c * p])
    points = edgePoints(
        height * np.ones((3, 1)), noise=fits(sigma, slope=factor, shared_slope=factor), heightMap=True,
        directions=DIR_ROWS, **RAW,
    )  # fmt: skip
    assert len(points) == 3
    # A straight line at its mean, or as much as the depths of the samples there allow.
    np.testing.assert_allclose(points["jump"], 1 + c * p[0] if curved else 1, atol=0.01 * c * p[0], rtol=0)


def waves(length, sharp):
    """Heights of 1 up and down over 2 pi `length` pixels, round ones or with creases."""
    phase = np.arange(120) / length
    height = np.arcsin(np.sin(phase)) * 2 / np.pi if sharp else np.sin(phase)
    return height * np.ones((40, 1))


@pytest.mark.parametrize("noise", [0.02, 0.05, 0.1])
@pytest.mark.parametrize("length", [8, 10, 14])
def test_smooth_waves_have_no_creases_where_noise_makes_straight_lines_of_them(length, noise):
    """Straight lines meet at angles; where no sample bends as sharply, these are no creases."""
    options = dict(noise=noise, heightMap=True, crease=CREASE_MAX)
    assert not edgePoints(waves(length, sharp=False), **options)["crease"].any()
    creases = edgePoints(waves(length, sharp=True), directions=DIR_ROWS, **options)["crease"]
    assert np.count_nonzero(creases) >= 40 * 2


# The noise of one place.


@pytest.mark.parametrize("options", [dict(pixelSize=0.02), dict(K=[[30.0, 0, 24.5], [0, 28, 19.5], [0, 0, 1]])])
def test_the_noise_at_a_border_is_that_of_both_sides(options):
    """Where it changes from pixel to pixel, no side is preferred: a mirrored image has mirrored edges."""
    found = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        z = surfaces(rng, (40, 50))
        noise = (0.003 * rng.uniform(0.4, 2.5, z.shape)).astype(np.float32)
        before = edgeStrength(z, noise=noise, **options)
        after = edgeStrength(z[:, ::-1], noise=noise[:, ::-1], **options)
        assert np.array_equal(before.kind[:, ::-1], after.kind)
        np.testing.assert_allclose(before.significance[:, ::-1], after.significance, rtol=1e-3)
        found += np.count_nonzero(before.kind)
    assert found > 1000
