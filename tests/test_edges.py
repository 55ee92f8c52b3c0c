"""Edge strengths and points: against the oracle, under symmetries, for every kind of input."""

import inspect
import pickle
from dataclasses import fields

import cv2
import numpy as np
import oracle
import pytest

import rangeedge
from rangeedge import (
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_ALL,
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    FIT_INTERP,
    FIT_LSQ,
    MEASURE_ENDPOINT,
    MEASURE_MIDPOINT,
    NoiseModel,
    ScanLineParams,
    detectEdges,
    edgePoints,
    edgeStrength,
)

NAN = np.nan
K = np.array([[30.0, 0.3, 9.2], [0, 28, 7.7], [0, 0, 1]])
NAMES = ("jump", "crease", "kind", "significance")


def surfaces(rng, shape, noise=0.003):
    """Slanted and curved surfaces in front of each other, 0.5 to 2 away."""
    v, u = np.indices(shape).astype(float)
    v, u = v - shape[0] / 2, u - shape[1] / 2
    z = 1.5 + 0.01 * (u * rng.normal() + v * rng.normal())
    for _ in range(3):
        a, b, c = 0.03 * rng.normal(size=3)
        z = np.minimum(z, 1.4 + 0.2 * rng.normal() + a * u + b * v + 0.05 * abs(c) * u**2)
    return np.maximum(z, 0.5) + noise * rng.normal(size=shape)


def seen(z):
    """The points that a pinhole camera sees at these depths."""
    v, u = np.indices(z.shape)
    return (np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(K).T * z[..., None]).astype(z.dtype)


# Against the oracle.


def same_as_oracle(src, image, **geometry):
    """Compare edgePoints and edgeStrength with the oracle; returns the points."""
    params = image.params
    options = {f.name: getattr(params, f.name) for f in fields(ScanLineParams)}
    options |= {"noise": image.noise, **geometry}
    got, expected = edgePoints(src, **options), oracle.edge_points(image)
    assert len(got) == len(expected)
    assert sum(np.isnan(c.crease) for c in expected) <= 0.2 * len(expected)
    rtol = 1e-3 if src.dtype == np.float32 else 1e-5
    for name in got.dtype.names:
        want = np.array([getattr(c, name) for c in expected], np.float64)
        decided = np.isfinite(want)
        # Normals come from slopes in single precision.
        normal = name == "crease" and params.crease == CREASE_NORMAL
        assert_close(got[name][decided], want[decided], 1e-3 if normal else rtol, name)
    strength, want = edgeStrength(src, **options), oracle.edge_strength(image, expected)
    for name, a, b in zip(NAMES, strength, want, strict=True):
        if params.crease == CREASE_MAX or name in ("jump", "significance"):
            assert_close(a, b, rtol, name)
    return got


def assert_close(got, want, rtol, name):
    np.testing.assert_allclose(got, want, rtol=rtol, atol=1e-6, err_msg=name)


SETTINGS = [
    dict(),
    dict(crease=CREASE_MAX),
    dict(minSignificance=2.3, crease=CREASE_MAX),
    dict(minSignificance=0.0, mergeSignificance=0.0),
    dict(minSignificance=0.0, mergeSignificance=3.3, crease=CREASE_MAX),
    dict(minSignificance=2.3, mergeSignificance=3.3),
    dict(minSignificance=2.3, maxShift=0.0, maxGap=0),
    dict(minSignificance=7.7, maxShift=1.7, maxGap=2),
    dict(minSignificance=0.0, measure=MEASURE_ENDPOINT),
    dict(fit=FIT_INTERP, minSignificance=2.3),
    dict(fit=FIT_INTERP, measure=MEASURE_ENDPOINT, minSignificance=0.0, maxShift=0.0),
    dict(fit=FIT_INTERP, directions=DIR_COLS | DIR_DIAG45, minSignificance=2.3),
    dict(crease=CREASE_NORMAL, minSignificance=2.3),
    dict(crease=CREASE_NORMAL, fit=FIT_INTERP, minSignificance=0.0),
    dict(eps=0.012, minSignificance=2.3),
    dict(minSignificance=0.0, maxGap=1, maxSmear=2),
    dict(minSignificance=2.3, maxGap=0, maxSmear=7, shadowEdges=False),
    dict(eps=0.012, crease=CREASE_NORMAL),
    dict(ScanLineParams.paper(eps=0.01).__dict__),
]
# As estimated from a stereo camera: waves that grow with the depth, and of which fits along columns know more.
FITS = (
    0.0004, 0.0002, 0.0003, 0.0004,
    1.4, 3.3, 8.2, 17.8, 25.1, 1.0, 1.4, 4.7, 14.8, 20.8, 1.5, 4.0, 16.7, 40.1, 56.6, 1.3, 2.1, 9.2, 32.1, 45.2, 2.6,
    1.8, 3.9, 9.9, 17.7, 25.0, 1.2, 2.0, 6.9, 13.5, 19.0, 2.1, 4.8, 15.9, 39.8, 56.2, 1.5, 2.8, 10.4, 26.8, 37.8, 3.5,
)  # fmt: skip
NOISE = [
    NoiseModel(0.003),
    NoiseModel(c=0.0015, correlation=1.3),
    NoiseModel(0.001, 0.0004, 0.0003),
    NoiseModel(b=0.002),
    NoiseModel(0.002, c=0.0004, correlation=2.2, length=3.5),
    NoiseModel(0.001, c=0.0003, fits=FITS),
]
SMALL, LARGE = [(1, 1), (1, 17), (13, 1), (2, 9), (3, 3)], (14, 23)


@pytest.mark.parametrize("setting", range(len(SETTINGS)))
def test_images_of_every_shape_as_the_oracle_has_them(setting):
    rng = np.random.default_rng(setting)
    found = 0
    for i, shape in enumerate([*SMALL, LARGE]):
        z = surfaces(rng, shape)
        if shape == LARGE:
            z = cv2.blur(z, (3, 1))  # steps smeared over two pixels of a row
        if i % 2:
            z[rng.random(shape) < 0.08] = NAN
            z[:, 5:8] = NAN  # shadow
        z = z.astype([np.float32, np.float64][(i + setting) % 2])
        common = dict(params=ScanLineParams(**SETTINGS[setting]), noise=NOISE[(i + setting) % len(NOISE)])
        cases = [
            (z, oracle.Image(z, spacing=(0.02, 0.03), **common), dict(pixelSize=(0.02, 0.03))),
            (z, oracle.Image(z, K=K, projective=True, **common), dict(K=K)),
            (z, oracle.Image(z, spacing=(0.02, 0.02), height=True, **common), dict(pixelSize=0.02, heightMap=True)),
            (seen(z), oracle.Image(seen(z), projective=True, **common), dict()),
        ]
        if shape == LARGE:
            cases = cases[setting // 2 % 2 :: 2]
        for src, image, geometry in cases:
            found += len(same_as_oracle(src, image, **geometry))
    assert found > 0


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("geometry", ["grid", "camera", "points"])
def test_long_segments_as_the_oracle_has_them(geometry, noise):
    """The noise of fits changes with their number of samples: up to 64 and beyond."""
    rng = np.random.default_rng(17)
    u = np.arange(170.0)
    z = np.interp(u, [0, 30, 100, 101, 169], [1.6, 1.3, 1.5, 1.2, 1.4]) + 0.02 * (u > 140) * np.ones((3, 1))
    z = z + cv2.GaussianBlur(0.01 * rng.standard_normal(z.shape), (0, 0), 3.0) + 0.001 * rng.standard_normal(z.shape)
    for params in (ScanLineParams(), ScanLineParams(minSignificance=1.5, mergeSignificance=2.0, epsFactor=2.0)):
        src = seen(z) if geometry == "points" else z
        image = oracle.Image(
            src, K=K if geometry == "camera" else None, projective=geometry != "grid", noise=noise, params=params
        )
        found = same_as_oracle(src, image, **(dict(K=K) if geometry == "camera" else {}))
        assert len(found) > 0


def checkerboard(shape):
    return np.indices(shape).sum(0) % 2 == 0


WILD = {
    "all invalid": lambda rng: np.full((7, 9), NAN),
    "one valid": lambda rng: np.where(np.arange(63).reshape(7, 9) == 31, 1.0, NAN),
    "checkerboard of invalid": lambda rng: np.where(checkerboard((9, 12)), rng.normal(2, 0.1, (9, 12)), NAN),
    "checkerboard of values": lambda rng: np.where(checkerboard((9, 12)), 1.0, 2.0),
    "constant": lambda rng: np.full((9, 12), 1.25),
    "ramp": lambda rng: 1 + np.arange(12) * 0.125 + np.arange(9)[:, None] * 0.25,
    "quadratic": lambda rng: 1 + np.arange(16.0) ** 2 / 64 * np.ones((6, 1)),
    "step": lambda rng: np.where(np.arange(14) < 6, 1.0, 1.5) * np.ones((6, 1)),
    "denormal": lambda rng: rng.choice([0.0, 1e-42, -1e-42, 3e-42], (8, 11)),
    "tiny on one": lambda rng: 1 + rng.choice([0, 2.0**-23], (8, 11)),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", WILD)
@pytest.mark.parametrize("paper", [False, True])
def test_singular_images_as_the_oracle_has_them(name, dtype, paper):
    z = WILD[name](np.random.default_rng(5)).astype(dtype)
    params = ScanLineParams.paper() if paper else ScanLineParams(minSignificance=2.3)
    image = oracle.Image(z, noise=NoiseModel(0.003), params=params)
    points = same_as_oracle(z, image)
    assert len(points) == 0 or name in ("checkerboard of invalid", "checkerboard of values", "step")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_huge_values_make_huge_jumps(dtype):
    z = np.where(np.arange(20) < 9, -1e30, 1e30).astype(dtype) * np.ones((12, 1), dtype)
    strength = edgeStrength(z, noise=0.01)
    np.testing.assert_allclose(strength.jump[:, 8:10], 2e30, rtol=1e-5)
    assert not strength.jump[:, :8].any()
    assert not strength.jump[:, 10:].any()


def test_a_jump_too_large_for_single_precision_is_the_largest_number():
    z = np.where(np.arange(20) < 9, -1e100, 1e100) * np.ones((12, 1))
    assert (edgeStrength(z, noise=0.01).jump[:, 8:10] == np.finfo(np.float32).max).all()
    assert detectEdges(z, noise=0.01)[:, 8:10].any(axis=1).all()


@pytest.mark.parametrize("geometry", [dict(), dict(K=K)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("options", SETTINGS)
def test_strengths_are_finite_whatever_the_values(options, dtype, geometry):
    rng = np.random.default_rng(11)
    values = [1e30, -1e30, 0, 1, 1e-30, 1e-42, -1e-42, np.inf, -np.inf, NAN]
    for shape in ((1, 1), (1, 9), (9, 1), (17, 15)):
        src = rng.choice(values, shape).astype(dtype)
        for noise in (None, 0.01):
            strength = edgeStrength(src, **{**options, **geometry, "noise": noise})
            for map_ in strength:
                assert np.isfinite(map_).all()
                assert (map_ >= 0).all()
            assert (strength.crease <= 180).all()


# Symmetries. No rule prefers a side. Positions are in single precision, so that what neighbours add differs in the last
# digits.


def boxes():
    """A box on a slanted plane, 33 x 33: every run has an odd number of samples."""
    v, u = np.indices((33, 33)).astype(float)
    z = 2.0 + 0.004 * u + 0.002 * v
    z[8:25, 8:25] = 1.5
    return z


MOVES = {
    "left to right": (lambda a: a[:, ::-1], {DIR_DIAG45: DIR_DIAG135, DIR_DIAG135: DIR_DIAG45}),
    "upside down": (lambda a: a[::-1], {DIR_DIAG45: DIR_DIAG135, DIR_DIAG135: DIR_DIAG45}),
    "transposed": (lambda a: a.T, {DIR_ROWS: DIR_COLS, DIR_COLS: DIR_ROWS}),
    "turned": (lambda a: a[::-1, ::-1], {}),
}


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("direction", [DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135, DIR_ALL])
def test_strengths_move_with_the_image(move, direction):
    moved, directions = MOVES[move]
    z = boxes()
    options = dict(noise=0.001, crease=CREASE_MAX)
    before = edgeStrength(z, directions=direction, **options)
    after = edgeStrength(moved(z), directions=directions.get(direction, direction), **options)
    assert before.jump.any()
    for name, a, b in zip(NAMES, before, after, strict=True):
        np.testing.assert_allclose(moved(a), b, rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("direction", [DIR_ROWS, DIR_COLS])
def test_transposing_changes_no_bit(direction):
    # A transposed image has the same lines, read the same way, so that every tie falls alike.
    z = surfaces(np.random.default_rng(2), (40, 30))
    other = DIR_COLS if direction == DIR_ROWS else DIR_ROWS
    # Without a shift neighbours are not asked, whose sums round as their order has it.
    options = dict(noise=0.003, crease=CREASE_MAX, minSignificance=0.0, maxShift=0.0)
    before = edgeStrength(z, directions=direction, **options)
    after = edgeStrength(z.T, directions=other, **options)
    assert all(map_.any() for map_ in before)
    assert all(np.array_equal(a.T, b) for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("step", [0, 2**-8], ids=["noisy", "coarse"])
@pytest.mark.parametrize("crease", [CREASE_NORMAL, CREASE_MAX])
def test_candidates_of_a_moved_image_are_the_same_with_all_their_strengths(move, step, crease):
    moved, _ = MOVES[move]
    for seed in range(5):
        z = surfaces(np.random.default_rng(seed), (64, 80))
        z = np.round(z / step) * step if step else z
        before, after = (edgeStrength(a, noise=0.003, crease=crease) for a in (z, moved(z)))
        assert np.count_nonzero(before.significance) > 200
        assert np.array_equal(moved(before.significance) > 0, after.significance > 0)
        assert np.array_equal(moved(before.kind), after.kind)
        np.testing.assert_allclose(moved(before.jump), after.jump, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(moved(before.significance), after.significance, rtol=1e-4)


@pytest.mark.parametrize("shift", [(1, 0), (0, 3), (5, 7)])
@pytest.mark.parametrize("geometry", ["grid", "pinhole"])
def test_strengths_shift_with_the_image(shift, geometry):
    # A frame of no data keeps every run as it is.
    z = np.pad(surfaces(np.random.default_rng(4), (30, 34)), 12, constant_values=NAN)
    moved = np.roll(z, shift, (0, 1))
    if geometry == "grid":
        kwargs, moved_kwargs, rtol = dict(pixelSize=0.02), dict(pixelSize=0.02), 1e-5
    else:
        moved_K = K + np.array([[0, 0, shift[1]], [0, 0, shift[0]], [0, 0, 0]])
        kwargs, moved_kwargs, rtol = dict(K=K), dict(K=moved_K), 1e-4
    before, after = edgeStrength(z, noise=0.003, **kwargs), edgeStrength(moved, noise=0.003, **moved_kwargs)
    assert before.jump.any()
    if geometry == "grid":
        assert np.array_equal(np.roll(before.jump, shift, (0, 1)), after.jump)
    for name, a, b in zip(NAMES, before, after, strict=True):
        np.testing.assert_allclose(np.roll(a, shift, (0, 1)), b, rtol=rtol, atol=0, err_msg=name)


@pytest.mark.parametrize("scale", [4.0, 1000.0])
@pytest.mark.parametrize("geometry", ["grid", "pinhole", "points"])
def test_strengths_do_not_depend_on_the_unit_of_length(scale, geometry):
    z = surfaces(np.random.default_rng(6), (30, 34))
    if geometry == "points":
        z = seen(z)
    kwargs = dict(K=K) if geometry == "pinhole" else {}
    grid = geometry == "grid"
    before = edgeStrength(z, noise=0.003, **kwargs, **(dict(pixelSize=0.02) if grid else {}))
    after = edgeStrength(z * scale, noise=0.003 * scale, **kwargs, **(dict(pixelSize=0.02 * scale) if grid else {}))
    assert before.jump.any()
    np.testing.assert_allclose(before.jump * scale, after.jump, rtol=1e-5)
    np.testing.assert_allclose(before.crease, after.crease, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(before.significance, after.significance, rtol=1e-4)
    assert np.array_equal(before.kind, after.kind)


# Threads.


@pytest.mark.parametrize("options", [dict(), dict(crease=CREASE_NORMAL), dict(fit=FIT_INTERP, minSignificance=0.0)])
def test_threads_change_no_bit(options):
    z = surfaces(np.random.default_rng(7), (150, 140)).astype(np.float32)
    assert z.size >= 1 << 14
    threads, results = cv2.getNumThreads(), []
    try:
        for n in (1, 2, 3):
            cv2.setNumThreads(n)
            results.append((*edgeStrength(z, noise=0.003, **options), edgePoints(z, noise=0.003, **options)))
    finally:
        cv2.setNumThreads(threads)
    assert results[0][0].any()
    for other in results[1:]:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(results[0], other, strict=True))


# What the outputs mean.


def test_a_step_has_its_height_and_its_sides():
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    jump, crease, kind, significance = edgeStrength(z, noise=0.001)
    np.testing.assert_allclose(jump[:, 19:21], 0.25, rtol=1e-6)
    assert not crease.any()
    assert (kind[:, 19] == EDGE_JUMP | EDGE_OCCLUDED).all()
    assert (kind[:, 20] == EDGE_JUMP | EDGE_OCCLUDING).all()
    assert (significance[:, 19:21] >= 10).all()
    for map_ in (jump, kind, significance):
        assert not map_[:, :19].any()
        assert not map_[:, 21:].any()


@pytest.mark.parametrize("height", [False, True])
@pytest.mark.parametrize("ridge", [False, True])
def test_a_roof_has_its_angle_its_place_and_its_kind(ridge, height):
    z = np.abs(np.arange(41) - 20.25) * 0.5 * np.ones((41, 1))  # a depth map of this is nearest in the middle
    z = z if ridge else -z
    z = -z if height else z
    points = edgePoints(z, noise=0.001, heightMap=height, directions=DIR_ROWS)
    np.testing.assert_allclose(points["x"], 20.25, atol=1e-4)
    np.testing.assert_allclose(points["crease"], 2 * np.degrees(np.arctan(0.5)), atol=1e-3)
    assert (points["y"] == np.arange(41)).all()
    assert (points["kind"] == (EDGE_CONVEX if ridge else EDGE_CONCAVE)).all()
    assert (points["jump"] == 0).all()
    strength = edgeStrength(z, noise=0.001, heightMap=height)
    assert (strength.crease[:, 20:22] > 0).all()
    assert not strength.crease[:, :20].any()
    assert not strength.crease[:, 22:].any()


def test_the_pixel_size_turns_slopes_into_angles():
    z = np.abs(np.arange(41) - 20.25) * np.ones((41, 1))
    for dx in (0.5, 2.0):
        points = edgePoints(z, noise=0.001, directions=DIR_ROWS, pixelSize=(dx, 7.0))
        np.testing.assert_allclose(points["crease"], 2 * np.degrees(np.arctan(1 / dx)), atol=1e-3)
        points = edgePoints(z.T, noise=0.001, directions=DIR_COLS, pixelSize=(7.0, dx))
        np.testing.assert_allclose(points["crease"], 2 * np.degrees(np.arctan(1 / dx)), atol=1e-3)


def test_strengths_are_those_of_the_points_beside_them():
    z = surfaces(np.random.default_rng(8), (40, 50))
    points = edgePoints(z, noise=0.003, maxShift=0.0, maxGap=0)
    strength = edgeStrength(z, noise=0.003, maxShift=0.0, maxGap=0)
    jump = np.zeros_like(strength.jump)
    step = {1: (0.5, 0), 2: (0, 0.5), 4: (0.5, -0.5), 8: (0.5, 0.5)}
    for p in points:
        dx, dy = step[int(p["direction"])]
        for sign in (-1, 1):
            u, v = int(p["x"] + sign * dx), int(p["y"] + sign * dy)
            jump[v, u] = max(jump[v, u], p["jump"])
    assert len(points) > 50
    assert np.array_equal(jump, strength.jump)


def test_points_come_by_direction_then_line_then_place():
    points = edgePoints(surfaces(np.random.default_rng(9), (40, 50)), noise=0.003)
    assert (np.diff(points["direction"].astype(int)) >= 0).all()
    rows = points[points["direction"] == DIR_ROWS]
    assert (np.lexsort((rows["x"], rows["y"])) == np.arange(len(rows))).all()


def test_directions_select_scan_lines():
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    assert not edgeStrength(z, noise=0.001, directions=DIR_COLS).jump.any()
    for direction in (DIR_ROWS, DIR_DIAG45, DIR_DIAG135):
        points = edgePoints(z, noise=0.001, directions=direction)
        assert (points["direction"] == direction).all()
        assert len(points) >= 25


def test_boundaries_are_marked_beside_invalid_pixels_only():
    z = np.ones((9, 11))
    z[4, 5] = NAN
    kind = edgeStrength(z, noise=0.001).kind
    expected = np.zeros((9, 11), np.uint8)
    expected[3:6, 4:7] = EDGE_BOUNDARY
    expected[4, 5] = 0
    assert np.array_equal(kind, expected)


@pytest.mark.parametrize("options", [dict(), dict(crease=CREASE_MAX), dict(fit=FIT_INTERP), dict(minSignificance=0.0)])
def test_pixels_without_data_get_nothing(options):
    z = np.abs(np.arange(41) - 20.25) * 0.5 * np.ones((41, 1))  # a roof
    z[:, 19:22] = NAN
    noisy = surfaces(np.random.default_rng(15), (50, 60))
    noisy[np.random.default_rng(16).random(noisy.shape) < 0.2] = NAN
    for src, geometry in ((z, {}), (noisy, dict(pixelSize=0.02)), (noisy, dict(K=K)), (seen(noisy), {})):
        strength = edgeStrength(src, noise=0.003, **geometry, **options)
        nothing = ~np.isfinite(src).reshape(*src.shape[:2], -1).all(-1)
        assert strength.significance.any()
        assert not any(m[nothing].any() for m in strength)


@pytest.mark.parametrize(("maxGap", "seen"), [(3, True), (2, False), (0, False)])
def test_gaps_of_no_data_are_bridged_up_to_a_width(maxGap, seen):
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    z[:, 19:22] = NAN
    strength = edgeStrength(z, noise=0.001, maxGap=maxGap, directions=DIR_ROWS, shadowEdges=False)
    assert (strength.jump[:, 18] > 0).all() == seen
    assert (strength.jump[:, 22] > 0).all() == seen
    if seen:
        np.testing.assert_allclose(strength.jump[:, [18, 22]], 0.25, rtol=1e-6)


def test_eps_is_the_tolerance_of_splitting():
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    options = dict(noise=0.001, mergeSignificance=0.0, minSignificance=0.0)
    assert edgeStrength(z, 0.1, **options).jump.any()
    with pytest.warns(rangeedge.RangeEdgeWarning, match="eps=0.3 exceeds the range of depths"):
        assert not edgeStrength(z, 0.3, **options).jump.any()
    assert edgeStrength(z, epsFactor=100.0, **options).jump.any()
    assert not edgeStrength(z, epsFactor=300.0, **options).jump.any()
    assert not edgeStrength(z, noise=0.2).jump.any()


def test_more_significance_leaves_fewer_candidates():
    z = surfaces(np.random.default_rng(10), (60, 60))
    counts = [len(edgePoints(z, noise=0.003, minSignificance=s)) for s in (0, 5, 10, 20)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[2] > 0
    assert (edgePoints(z, noise=0.003, minSignificance=10.0)["significance"] >= 10).all()


def test_types_and_shapes_of_the_results():
    strength = edgeStrength(np.ones((5, 7)), noise=0.01)
    assert strength._fields == NAMES
    assert [m.dtype for m in strength] == [np.float32, np.float32, np.uint8, np.float32]
    assert all(m.shape == (5, 7) and m.flags.c_contiguous for m in strength)
    assert len(edgePoints(np.ones((5, 7)), noise=0.01)) == 0


# Arguments.


@pytest.mark.parametrize("function", [edgeStrength, edgePoints])
@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (dict(src=[[1.0, 2.0]]), "src"),
        (dict(src=None), "src"),
        (dict(src=np.zeros(5)), "src"),
        (dict(src=np.zeros((0, 5))), "src"),
        (dict(src=np.zeros((5, 5, 2))), "src"),
        (dict(src=np.zeros((5, 5, 3), np.int32)), "src"),
        (dict(src=np.zeros((5, 5, 3, 1))), "src"),
        (dict(src=np.zeros((5, 5), complex)), "src"),
        (dict(src=np.zeros((5, 5), bool)), "src"),
        (dict(eps=0), "eps"),
        (dict(eps=-0.1), "eps"),
        (dict(eps=NAN), "eps"),
        (dict(eps="0.1"), "eps"),
        (dict(epsFactor=0), "epsFactor"),
        (dict(epsFactor=np.inf), "epsFactor"),
        (dict(K=np.eye(2)), "K"),
        (dict(K="camera"), "K"),
        (dict(K=np.diag([1.0, 1, 2])), "K"),
        (dict(K=np.diag([-1.0, 1, 1])), "K"),
        (dict(K=np.diag([1.0, 0, 1])), "K"),
        (dict(K=np.diag([NAN, 1, 1])), "K"),
        (dict(K=[[1, 0, 0], [0.1, 1, 0], [0, 0, 1]]), "K"),
        (dict(K=np.eye(3), pixelSize=1.0), "pixelSize"),
        (dict(K=np.eye(3), heightMap=True), "heightMap"),
        (dict(src=np.zeros((5, 5, 3)), K=np.eye(3)), "K"),
        (dict(src=np.zeros((5, 5, 3)), pixelSize=1.0), "pixelSize"),
        (dict(pixelSize=0), "pixelSize"),
        (dict(pixelSize=(1, -1)), "pixelSize"),
        (dict(pixelSize=(1, 2, 3)), "pixelSize"),
        (dict(pixelSize=NAN), "pixelSize"),
        (dict(heightMap=1), "heightMap"),
        (dict(depthFactor=0), "depthFactor"),
        (dict(depthFactor=-1), "depthFactor"),
        (dict(mask=np.ones((4, 5), np.uint8)), "mask"),
        (dict(mask=np.ones((5, 5))), "mask"),
        (dict(mask=[[1]]), "mask"),
        (dict(noise=0), "noise"),
        (dict(noise=-1.0), "noise"),
        (dict(noise=NAN), "noise"),
        (dict(noise="loud"), "noise"),
        (dict(noise=np.ones((4, 5))), "noise"),
        (dict(noise=np.zeros((5, 5))), "noise"),
        (dict(noise=np.full((5, 5), NAN)), "noise"),
        (dict(noise=np.ones((5, 5), complex)), "noise"),
        (dict(directions=0), "directions"),
        (dict(directions=16), "directions"),
        (dict(directions=1.0), "directions"),
        (dict(fit=2), "fit"),
        (dict(fit=True), "fit"),
        (dict(measure=-1), "measure"),
        (dict(crease="max"), "crease"),
        (dict(maxShift=-1), "maxShift"),
        (dict(maxShift=NAN), "maxShift"),
        (dict(maxGap=1.5), "maxGap"),
        (dict(maxGap=-1), "maxGap"),
        (dict(mergeSignificance=-1), "mergeSignificance"),
        (dict(minSignificance=-1), "minSignificance"),
        (dict(minSignificance=None), "minSignificance"),
    ],
)
def test_bad_arguments_are_named(function, arguments, name):
    arguments = {"src": np.ones((5, 5)), **arguments}
    with pytest.raises(rangeedge.error, match=f"{function.__name__}: `{name}` must be") as raised:
        function(**arguments)
    assert isinstance(raised.value, cv2.error)
    assert isinstance(raised.value, ValueError)
    assert raised.value.func == function.__name__


@pytest.mark.parametrize("function", [edgeStrength, edgePoints])
def test_an_unknown_argument_is_refused_with_a_hint(function):
    with pytest.raises(rangeedge.error, match=r"unknown argument `maxShfit`; did you mean `maxShift`\?"):
        function(np.ones((5, 5)), maxShfit=1)
    with pytest.raises(rangeedge.error, match=r"unknown argument `zzz`$"):
        function(np.ones((5, 5)), zzz=1)


def test_params_check_themselves():
    for name, value in dict(eps=0, epsFactor=-1, directions=0, fit=7, maxShift=NAN, maxGap=0.5).items():
        with pytest.raises(rangeedge.error, match=f"ScanLineParams: `{name}` must be"):
            ScanLineParams(**{name: value})


def test_the_paper_setting():
    paper = ScanLineParams.paper()
    assert (paper.fit, paper.measure, paper.crease) == (FIT_INTERP, MEASURE_MIDPOINT, CREASE_MAX)
    assert (paper.maxShift, paper.maxGap, paper.mergeSignificance, paper.minSignificance) == (0, 0, 0, 0)
    assert ScanLineParams.paper(eps=0.5, maxShift=2.0).maxShift == 2
    assert ScanLineParams().fit == FIT_LSQ


@pytest.mark.parametrize("function", [edgeStrength, edgePoints])
def test_signatures_show_every_parameter_with_its_default(function):
    shown = inspect.signature(function).parameters
    for f in fields(ScanLineParams):
        assert shown[f.name].default == f.default


def test_inputs_are_never_modified():
    rng = np.random.default_rng(12)
    z = surfaces(rng, (20, 24)).astype(np.float32)
    z[3, 4], z[5, 6] = np.inf, 0
    mask = (rng.random((20, 24)) < 0.8).astype(np.uint8)
    noise = np.full((20, 24), 0.003)
    points = np.dstack([z, z, z, z])
    inputs = [z, mask, noise, points, K]
    copies = [a.copy() for a in inputs]
    for a in (z, mask, noise, points):
        a.flags.writeable = False
    edgeStrength(z, mask=mask, noise=noise, K=K)
    edgeStrength(z, mask=mask, heightMap=True)
    edgeStrength(points, mask=mask, noise=noise)
    edgePoints(np.where(np.isfinite(z), z * 1000, 0).astype(np.uint16), mask=mask > 0, K=K)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(inputs, copies, strict=True))


def test_memory_layout_does_not_matter():
    z = surfaces(np.random.default_rng(13), (24, 30)).astype(np.float32)
    mask = np.random.default_rng(14).integers(0, 2, (24, 30), dtype=np.uint8)
    expected = edgeStrength(z, noise=0.003, K=K, mask=mask)
    wide = np.zeros((48, 60), np.float32)
    wide[::2, ::2] = z
    for view in (wide[::2, ::2], np.asfortranarray(z), z[::-1].copy()[::-1], z.astype(">f4")):
        got = edgeStrength(view, noise=0.003, K=K.tolist(), mask=np.asfortranarray(mask))
        assert all(np.array_equal(a, b) for a, b in zip(expected, got, strict=True))


@pytest.mark.parametrize("dtype", [np.float16, ">f8", np.longdouble])
def test_other_floats_are_converted(dtype):
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    expected = edgeStrength(z, noise=0.001)
    got = edgeStrength(z.astype(dtype), noise=0.001)
    assert all(np.allclose(a, b, rtol=1e-5) for a, b in zip(expected, got, strict=True))


def test_significance_is_what_the_threshold_compares():
    rng = np.random.default_rng(8)
    z = np.where(np.arange(80) < 40, 1.0, 1.05) * np.ones((60, 1)) + rng.normal(0, 0.005, (60, 80))
    all_of_them = edgePoints(z, noise=0.005, maxShift=0.0, minSignificance=6.0)
    for least in (9.0, 12.0, 20.0):
        kept = edgePoints(z, noise=0.005, maxShift=0.0, minSignificance=least)
        assert len(kept) == (all_of_them["significance"] >= least).sum()


@pytest.mark.parametrize("reach", [0.3, 1.0, 4.0])
def test_edges_stay_within_reach_of_their_cut(reach):
    z = np.abs(np.arange(80) - 40.2) * 0.5 * np.ones((60, 1)) + np.random.default_rng(9).normal(0, 0.3, (60, 80))
    options = dict(noise=0.3, minSignificance=0.0, crease=CREASE_MAX, directions=DIR_ROWS)
    cuts, moved = edgePoints(z, maxShift=0.0, **options), edgePoints(z, maxShift=reach, **options)
    assert len(cuts) == len(moved)
    assert 0 < np.abs(cuts["x"] - moved["x"]).max() <= reach + 1e-5


def test_errors_travel_between_processes():
    with pytest.raises(rangeedge.error) as raised:
        edgeStrength(None)
    copy = pickle.loads(pickle.dumps(raised.value))
    assert (copy.func, copy.err, copy.code, str(copy)) == (
        raised.value.func,
        raised.value.err,
        raised.value.code,
        str(raised.value),
    )


# Words


@pytest.mark.parametrize(
    ("kind", "words"),
    [(0, "none"), (1, "jump"), (np.uint8(9), "jump occluding"), (17, "jump occluded"), (2, "convex"), (4, "concave"),
     (32, "boundary"), (63, "jump occluding occluded convex concave boundary")],
)  # fmt: skip
def test_names_of_kinds(kind, words):
    assert rangeedge.kindNames(kind) == words


@pytest.mark.parametrize("kind", [-1, 64, 1.0, True, "jump", np.zeros(3, np.uint8)])
def test_no_kinds(kind):
    with pytest.raises(rangeedge.error, match="kindNames: `kind` must be an integer from 0 to 63, got"):
        rangeedge.kindNames(kind)


def test_results_print_counts_and_ranges():
    jump, crease, significance = np.zeros((3, 4, 5), np.float32)
    jump[1, 1:3], crease[0, 0], significance[1] = (0.25, 1.5), 45, 13
    strength = rangeedge.EdgeStrength(jump, crease, np.zeros((4, 5), np.uint8), significance)
    expected = (
        "EdgeStrength(5 x 4 pixels; jump at 2 from 0.25 to 1.5; crease at 1 from 45 to 45 degrees; "
        "significance at 5 from 13 to 13)"
    )
    assert repr(strength) == str(strength) == expected
    image = rangeedge.RangeImage(np.array([[0, 700, 1200]], np.uint16), {"K": np.eye(3)})
    assert repr(image) == "RangeImage(uint16 of shape (1, 3), 2 values from 700 to 1200, K)"
    assert "no data" in repr(rangeedge.RangeImage(np.full((2, 2), np.nan), {}))
    assert repr(rangeedge.NoiseModel(a=1e-3, correlation=2)) == "NoiseModel(a=0.001, correlation=2)"
    assert repr(rangeedge.ScanLineParams(K=np.eye(3))) == "ScanLineParams(K=float64 array of shape (3, 3))"
