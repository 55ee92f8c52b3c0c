"""Edge strengths and points against the oracle, and of images of the wildest values."""

from dataclasses import fields

import cv2
import numpy as np
import oracle
import pytest
from scenes import NAMES, K, seen, surfaces

from rangeedge import (
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_COLS,
    DIR_DIAG45,
    FIT_INTERP,
    MEASURE_ENDPOINT,
    NoiseModel,
    ScanLineParams,
    detectEdges,
    edgePoints,
    edgeStrength,
)

NAN = np.nan


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
        atol = 1e-5 if name in ("x", "y") else 1e-6  # positions are in single precision
        assert_close(got[name][decided], want[decided], 1e-3 if normal else rtol, name, atol)
    strength, want = edgeStrength(src, **options), oracle.edge_strength(image, expected)
    for name, a, b in zip(NAMES, strength, want, strict=True):
        if params.crease == CREASE_MAX or name in ("jump", "significance"):
            assert_close(a, b, rtol, name)
    return got


def assert_close(got, want, rtol, name, atol=1e-6):
    np.testing.assert_allclose(got, want, rtol=rtol, atol=atol, err_msg=name)


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
