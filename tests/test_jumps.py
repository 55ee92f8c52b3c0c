"""Jumps: of smeared steps, on the nearer side, within the depths around them, beside shadow, and not where none is."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import (
    DIR_COLS,
    DIR_ROWS,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    ScanLineParams,
    detectEdges,
    edgePoints,
    edgeStrength,
)
from rangeedge.detection import run_detector
from rangeedge.frame import read_frame
from rangeedge.options import Selection

K = np.array([[250.0, 0, 59.5], [0, 250, 39.5], [0, 0, 1]])
V, U = np.indices((80, 120)).astype(float)
ACROSS = {
    "vertical": U - 59.5,
    "horizontal": V - 39.5,
    "diagonal": (U - V - 20) / 2**0.5,
    "oblique": (2 * U + V - 160) / 5**0.5,
}
INNER = np.s_[20:60, 25:95]


def noisy(z, sigma=0.0005, seed=0):
    return z + np.random.default_rng(seed).normal(0, sigma, z.shape)


# Smeared steps.


def smeared(across, pixels, near=0.6, far=0.7):
    """A step whose depth changes evenly over so many pixels."""
    share = np.clip(across / pixels + 0.5, 0, 1) if pixels else (across > 0).astype(float)
    return near * (1 - share) + far * share


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("offset", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("pixels", [0, 1, 2, 3, 4, 5])
@pytest.mark.parametrize("across", ACROSS)
def test_a_smeared_step_is_one_jump_of_its_full_height(across, pixels, offset, mirrored):
    distance = ACROSS[across] - offset
    z = noisy(smeared(-distance if mirrored else distance, pixels))
    jump, crease, kind, _ = (strength[INNER] for strength in edgeStrength(z, K=K))
    line = 0 if across == "horizontal" else 1
    rim = kind & EDGE_OCCLUDING > 0
    assert rim.any(line).mean() > 0.95 or across == "oblique"
    np.testing.assert_allclose(jump.max(line)[rim.any(line)], 0.1, atol=0.003)
    # A sample that is mixed by a few per cent belongs to its side and may leave weak creases there, but no line.
    assert np.count_nonzero(crease) <= 0.01 * crease.size
    assert not detectEdges(z, K=K)[INNER][np.abs(distance)[INNER] > pixels / 2 + 2.5].any()
    # On the nearer surface, no farther from the middle of the step than half its width and a pixel or two.
    before = -distance[INNER][rim] * (-1 if mirrored else 1)
    assert before.min() > -0.3 * pixels - 0.5
    assert before.max() < pixels / 2 + 2
    # One line, that the detector draws without gaps wherever such lines are not broken by thinning.
    assert np.ptp(before) < 2.7
    if across in ("vertical", "horizontal"):
        edges = detectEdges(z, K=K)[INNER] > 0
        assert (edges.sum(line) == 1).mean() >= 0.9
        assert np.array_equal(edges, detectEdges(z, 0.09, np.inf, K=K)[INNER] > 0)


@pytest.mark.parametrize("interpolation", [cv2.INTER_LINEAR, cv2.INTER_CUBIC, cv2.INTER_AREA])
@pytest.mark.parametrize("scale", [0.6, 1.5, 2.3])
def test_the_rim_of_a_resized_box_is_found_with_its_height(scale, interpolation):
    z = np.full((120, 160), 0.7)
    z[40:90, 50:110] = 0.6
    z = cv2.resize(z, None, fx=scale, fy=scale, interpolation=interpolation)
    edges = detectEdges(z, 0.09, np.inf, K=K, noise=0.0005)
    rim = 2 * (50 + 60) * scale
    assert 0.9 * rim < np.count_nonzero(edges) < 1.05 * rim
    _, _, w, h = cv2.boundingRect(edges)
    assert abs(w - 60 * scale) <= 3
    assert abs(h - 50 * scale) <= 3
    jump, _, kind, _ = edgeStrength(z, K=K, noise=0.0005)
    rim = jump[kind & EDGE_OCCLUDING > 0]
    assert abs(np.median(rim) - 0.1) < 0.002
    assert interpolation == cv2.INTER_CUBIC or rim.max() < 0.102  # which rings


def test_a_smeared_step_between_slanted_surfaces_has_the_height_it_has_there():
    near, far = 0.6 + 0.0004 * (U - 60), 0.75 - 0.0003 * (U - 60) + 0.0005 * V
    share = np.clip((U - 59.5) / 3 + 0.5, 0, 1)
    jump = edgeStrength(noisy(near * (1 - share) + far * share), K=K).jump
    rows = np.arange(10, 70)
    np.testing.assert_allclose(jump[rows, 50:70].max(1), (far - near)[rows, 59], atol=0.003)


@pytest.mark.parametrize("maxSmear", [0, 2])
def test_more_smeared_pixels_than_allowed_are_surfaces(maxSmear):
    z = noisy(smeared(ACROSS["vertical"], 4))
    strength = edgeStrength(z, K=K, maxSmear=maxSmear)
    assert not (strength.jump[INNER] > 0.09).any()
    assert (strength.crease[INNER].max(1) > 30).all()


def test_a_narrow_slanted_surface_that_is_wide_enough_in_space_stays():
    # A chamfer four pixels wide, at 45 degrees, between two faces.
    z = 1.0 + np.clip(U - 58.5, 0, 5) * 1.0 / 250
    strength = edgeStrength(noisy(z, 0.00005), K=K)
    edges = detectEdges(noisy(z, 0.00005), K=K)
    assert not (strength.kind[INNER] & EDGE_JUMP).any()
    assert (np.count_nonzero(edges[INNER], axis=1) == 2).mean() > 0.9


@pytest.mark.parametrize("width", [1, 2, 3])
def test_a_thin_object_keeps_two_jumps(width):
    z = np.full((80, 120), 0.7)
    z[:, 60 : 60 + width] = 0.6
    points = edgePoints(noisy(z), K=K, directions=DIR_ROWS)
    points = points[points["jump"] > 0.05]
    assert len(points) >= 2 * 80 - 2  # two samples may make a line that leads from the one surface to the other
    np.testing.assert_allclose(np.unique(points["x"]), [59.5, 59.5 + width], atol=1e-3)


def test_a_narrow_surface_between_two_others_is_none_of_their_smear():
    z = np.full((80, 120), 0.7)
    z[:, :60], z[:, 60:63] = 0.6, 0.65
    strength = edgeStrength(noisy(z), K=K)
    np.testing.assert_allclose(strength.jump[:, [59, 60, 62, 63]], 0.05, atol=0.004)


# The nearer side.


@pytest.mark.parametrize("degrees", [0, 20, 40, 60])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_outline_of_a_turned_card_is_on_the_card(degrees, axis):
    v, u = np.indices((120, 160))
    ray = np.dstack([(u - 79.5) / 130, (v - 59.5) / 130, np.ones(u.shape)])
    card = (abs(u - 80) < 30) & (abs(v - 60) < 30)
    angle = np.radians(degrees)
    normal = np.array([[np.sin(angle), 0, -np.cos(angle)], [0, np.sin(angle), -np.cos(angle)]][axis])
    z = noisy(np.where(card, normal[2] * 1.2 / (ray @ normal), 2.5), 0.001)
    camera = np.array([[130, 0, 79.5], [0, 130, 59.5], [0, 0, 1]])
    edges = detectEdges(z, K=camera) > 0
    assert (edges & card).sum() >= 4 * 58 - 8
    assert not (edges & ~card).any()
    assert not detectEdges(z, np.inf, K=camera).any()
    with pytest.warns(rangeedge.RangeEdgeWarning, match="jumpThreshold"):
        assert not detectEdges(z, 2.0, K=camera).any()


@pytest.mark.parametrize("seed", range(4))
def test_a_pixel_is_a_jump_or_a_crease(seed):
    rng = np.random.default_rng(seed)
    z = 2 + 0.02 * (U * rng.normal() + V * rng.normal()) / 5
    for _ in range(4):
        a, b = 0.02 * rng.normal(size=2)
        z = np.minimum(z, 1.8 + 0.2 * rng.normal() + a * (U - 60) + b * (V - 40))
    jump, crease, kind, _ = edgeStrength(noisy(np.maximum(z, 0.5), 0.001), K=K)
    is_jump, is_crease = kind & EDGE_JUMP > 0, kind & (EDGE_CONVEX | EDGE_CONCAVE) > 0
    assert is_jump.any()
    assert is_crease.any()
    assert not (is_jump & is_crease).any()
    assert not crease[is_jump].any()
    assert (crease[is_crease] > 0).all()
    assert (jump[is_jump] > 0).all()
    sides = kind & (EDGE_OCCLUDING | EDGE_OCCLUDED)
    assert np.array_equal(sides > 0, is_jump)


# No larger than the depths around.


@pytest.mark.parametrize("gap", [0, 2, 5, 8])
@pytest.mark.parametrize("width", [2, 3, 4])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_jump_stays_within_the_depths_around_it(width, gap, mirrored):
    # A strip seen at a grazing angle: as a straight line of 1/z it runs on to the horizon.
    z = np.full((80, 120), 4.0)
    z[:, 60 : 60 + width] = 4.0 / (1 - 0.07 * (np.arange(width) + 1))
    z[:, 60 + width + gap :] = 5.4
    z[:, 60 + width : 60 + width + gap] = np.nan
    z = noisy(z[:, ::-1] if mirrored else z, 0.004)
    strength = edgeStrength(z, K=K, noise=0.004)
    assert strength.jump.max() < np.nanmax(z) - np.nanmin(z)


def test_a_plane_runs_on_across_a_gap():
    z = 1 + 0.02 * U
    z[:, 60:67] = np.nan
    assert not detectEdges(noisy(z, 0.001)).any()


PATTERNS = {
    "checkerboard": (U + V) % 2 == 0,
    "every other column": U % 2 == 0,
    "one of three rows": V % 3 == 0,
    "one of four": (U % 2 == 0) & (V % 2 == 0),
}


@pytest.mark.parametrize("pattern", PATTERNS)
def test_gaps_of_a_regular_pattern_are_no_jumps(pattern):
    z = noisy(1 + 0.02 * U + 0.01 * V, 0.001)
    z[~PATTERNS[pattern]] = np.nan
    strength = edgeStrength(z, noise=0.001, pixelSize=0.01)
    assert not (strength.kind & EDGE_JUMP).any()
    assert not strength.jump.any()


def test_isolated_pixels_are_no_jumps():
    rng = np.random.default_rng(0)
    z = np.full((80, 120), np.nan)
    z[rng.random(z.shape) < 0.02] = 1
    z *= rng.uniform(1, 3, z.shape)
    touching = cv2.boxFilter(np.isfinite(z).astype(np.float32), -1, (3, 3), normalize=False) > 1
    z[touching] = np.nan
    assert np.isfinite(z).sum() > 50
    assert not edgeStrength(z, K=K, noise=0.001).jump.any()


# Beside shadow.


def before_a_wall(shadow, wall=1.3):
    """A box, with a shadow to its left."""
    z = np.full((80, 120), wall)
    z[20:60, 40:80] = 0.9
    z[20:60, 40 - shadow : 40] = np.nan
    return noisy(z)


@pytest.mark.parametrize("shadow", [3, 9, 20, 35])
def test_an_outline_beside_shadow_is_found(shadow):
    z = before_a_wall(shadow)
    edges = detectEdges(z, K=K) > 0
    assert edges[22:58, 40].all()
    assert not edges[22:58, :40].any()
    strength = edgeStrength(z, K=K)
    np.testing.assert_allclose(strength.jump[22:58, 40], 0.4, atol=0.01)
    assert (strength.kind[22:58, 40] & EDGE_OCCLUDING).all()
    assert (strength.kind[22:58, 39 - shadow] & EDGE_OCCLUDED).all()
    found = detectEdges(z, K=K, shadowEdges=False)[22:58, 40].all()
    assert found == (shadow <= 8)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("slope", [0.0, 0.3, 0.6, 0.9])
def test_a_hole_in_a_surface_has_no_outline(slope, seed):
    # The farther side of a floor that is seen at a grazing angle is much farther, but it runs on to the nearer side.
    z = 1 / (1 - slope * (V - 40) / 50)
    z[30:50, 30:90] = np.nan
    assert not detectEdges(noisy(z, 0.0003, seed), K=K, noise=0.0003).any()
    assert not detectEdges(noisy(-z, 0.0003, seed), noise=0.0003, shadowEdges=True, directions=DIR_COLS).any()


def test_surfaces_side_by_side_have_no_outline_at_the_hole_between_them():
    # From one to the other a visible surface may lead: the step is lower than the hole is wide.
    z = np.where(U < 60, 1.0, 1.03)
    z[:, 50:70] = np.nan
    assert not detectEdges(noisy(z), K=K).any()


def test_every_border_with_no_data_is_an_edge_on_request():
    z = before_a_wall(20)
    z[:, 100:] = np.nan  # nothing is seen beyond
    edges, more = detectEdges(z, K=K) > 0, detectEdges(z, K=K, boundaryEdges=True) > 0
    assert not edges[:, 97:].any()
    assert more[2:78, 99].all()
    assert more[22:58, 19].all()
    assert (cv2.dilate(more.astype(np.uint8), np.ones((3, 3))) >= edges).all()


# No jumps on smooth surfaces.


def smooth_surfaces():
    r2 = (U - 60) ** 2 + (V - 40) ** 2
    yield "hill", 5 * np.exp(-r2 / 300), dict(heightMap=True, pixelSize=0.5)
    yield "bump", 2 - 0.5 * np.exp(-r2 / 700), dict(K=K)
    yield "waves", 10 + 0.5 * np.sin(U / 8) * np.cos(V / 11), dict(heightMap=True, pixelSize=0.5)
    yield "oblique waves", 2 + 0.2 * np.sin(U / 9 + V / 7), dict(K=K)
    yield "saddle", ((U - 60) ** 2 - (V - 40) ** 2) / 2000, dict(heightMap=True)
    yield "dish", 1.5 + 0.3 * np.sqrt(1 + r2 / 1e3), dict(K=K)
    yield "cubic", ((U - 60) / 30) ** 3 + (V / 50) ** 3, dict(heightMap=True, pixelSize=0.2)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("surface", list(smooth_surfaces()), ids=lambda surface: surface[0])
def test_smooth_surfaces_have_no_edges(surface, dtype):
    _, z, geometry = surface
    assert not detectEdges(z.astype(dtype), **geometry).any()
    # A step on it is found, apart from places where it makes a terrace of a slope.
    stepped = z + np.where(U > 70, 0.2 * np.ptp(z), 0)
    assert detectEdges(stepped.astype(dtype), **geometry)[10:70, 68:73].any(axis=1).mean() > 0.85


# The geometry is the frame's.


def test_a_frame_has_the_same_edges_without_the_parameters_that_made_it():
    # A slanted face of five pixels, wide enough in space: without the camera it would be smear.
    z = noisy(1.0 + np.clip(U - 58.5, 0, 5) * 0.02 / 5, 0.00005)
    frame = read_frame(z, ScanLineParams(K=K)).with_noise(0.00005)
    edges, _ = run_detector(frame, ScanLineParams(), Selection())
    assert edges.any()
    assert np.array_equal(edges, detectEdges(z, K=K, noise=0.00005))
    assert not np.array_equal(edges, detectEdges(z, noise=0.00005))
