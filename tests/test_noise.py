"""Noise models, and their estimate from one image."""

import cv2
import numpy as np
import oracle
import pytest
from scipy.stats import norm

import rangeedge
from rangeedge import (
    CREASE_MAX,
    DIR_ROWS,
    NoiseModel,
    detectEdges,
    edgePoints,
    edgeStrength,
    estimateNoise,
    segmentRegions,
)
from rangeedge.synthetic import demoScene, gaussianNoise, pinholeCamera, polyhedraScene, renderScene

NAN = np.nan
K = np.array([[525.0, 0, 159.5], [0, 525, 119.5], [0, 0, 1]])
SHAPE = (240, 320)


def depths(kind):
    u = np.arange(SHAPE[1]) - 159.5
    v = np.arange(SHAPE[0])[:, None]
    if kind == "one depth":
        return np.full(SHAPE, 1.5)
    if kind == "slanted":
        return 1 / (1 / 1.5 + 0.0012 * u + 0.0003 * v)
    return 1 / (1 / 2.0 + 0.0022 * u) + 0 * v  # from 1.2 to 7


MODELS = [NoiseModel(0.003), NoiseModel(c=0.0014), NoiseModel(0.002, 0, 0.001)]


@pytest.mark.parametrize("kind", ["one depth", "slanted", "deep"])
@pytest.mark.parametrize("model", MODELS)
def test_white_noise_of_every_model_is_estimated(model, kind):
    z = depths(kind)
    noisy = z + model(z) * np.random.default_rng(1).standard_normal(SHAPE)
    estimate = estimateNoise(noisy, K=K)
    at = np.quantile(z, np.linspace(0.05, 0.95, 7))
    np.testing.assert_allclose(estimate(at), model(at), rtol=0.1)
    assert 1 <= estimate.correlation < 1.1


@pytest.mark.parametrize("sigma", [1e-4, 0.003, 5.0])
def test_white_noise_on_a_grid_is_estimated(sigma):
    noisy = 100 + sigma * np.random.default_rng(2).standard_normal(SHAPE)
    estimate = estimateNoise(noisy)
    np.testing.assert_allclose(estimate.a, sigma, rtol=0.03)
    assert estimate.b == estimate.c == 0
    assert estimateNoise(-noisy, heightMap=True) == estimate


def test_edges_do_not_count_as_noise():
    camera = pinholeCamera(np.array([[262.5, 0, 159.5], [0, 262.5, 119.5], [0, 0, 1]]), (320, 240))
    scan = gaussianNoise(renderScene(demoScene(), camera), NoiseModel(0.003), seed=3)
    estimate = estimateNoise(scan.src, **scan.geometry)
    np.testing.assert_allclose(estimate(np.array([0.9, 1.2, 1.6])), 0.003, rtol=0.1)


@pytest.mark.parametrize("step", [0.001, 0.004])
def test_rounding_counts_as_noise(step):
    # Noise of half a step makes the rounding independent: variances add.
    sigma = step / 2
    z = np.round((depths("slanted") + sigma * np.random.default_rng(4).standard_normal(SHAPE)) / step) * step
    expected = np.hypot(sigma, step / np.sqrt(12))
    np.testing.assert_allclose(estimateNoise(z, K=K)(np.array([1.3, 1.5, 1.8])), expected, rtol=0.1)


def test_integers_are_estimated_in_metres():
    z = depths("slanted") + 0.003 * np.random.default_rng(5).standard_normal(SHAPE)
    millimetres = np.round(1000 * z).astype(np.uint16)
    np.testing.assert_allclose(estimateNoise(millimetres, K=K)(1.5), 0.003, rtol=0.1)
    with pytest.warns(rangeedge.RangeEdgeWarning, match="depthFactor=1 "):
        np.testing.assert_allclose(estimateNoise(millimetres, K=K, depthFactor=1.0)(1500.0), 3.0, rtol=0.1)


def test_points_have_the_noise_of_their_depths():
    z = depths("slanted") + 0.003 * np.random.default_rng(6).standard_normal(SHAPE)
    v, u = np.indices(SHAPE)
    points = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(K).T * z[..., None]
    a, b = estimateNoise(points), estimateNoise(z, K=K)
    np.testing.assert_allclose([a(1.5), a.correlation], [b(1.5), b.correlation], rtol=1e-6)


def test_neighbours_that_err_together_are_noticed():
    white = np.random.default_rng(7).standard_normal(SHAPE)
    together = 0.003 * cv2.GaussianBlur(white, (0, 0), 1.0)
    assert estimateNoise(1.5 + together, K=K).correlation > 1.5
    assert estimateNoise(1.5 + 0.003 * white, K=K).correlation == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize("mask", ["nan", "mask"])
def test_pixels_without_data_do_not_count(mask):
    rng = np.random.default_rng(8)
    z = 1.5 + 0.003 * rng.standard_normal(SHAPE)
    use = np.ones(SHAPE, bool)
    use[60:180, 80:200] = False
    z[~use] += rng.standard_normal((~use).sum())
    estimate = estimateNoise(np.where(use, z, NAN), K=K) if mask == "nan" else estimateNoise(z, K=K, mask=use)
    np.testing.assert_allclose(estimate(1.5), 0.003, rtol=0.05)


def test_an_image_without_noise_has_a_little():
    for z, kwargs in ((depths("slanted"), dict(K=K)), (np.full(SHAPE, 2.0), dict(K=K)), (depths("slanted"), {})):
        estimate = estimateNoise(z, **kwargs)
        assert 0 < estimate(2.0) <= 1e-3
    assert estimateNoise(np.full((9, 9), 2.0), K=K)(2.0) == pytest.approx(6e-5)


@pytest.mark.parametrize("kwargs", [{}, dict(K=K)])
@pytest.mark.parametrize("shape", [(1, 1), (1, 3), (3, 1), (4, 4), (1, 40)])
def test_tiny_and_empty_images_have_some_noise(shape, kwargs):
    for src in (np.full(shape, NAN), np.ones(shape), np.random.default_rng(9).random(shape) + 1):
        estimate = estimateNoise(src, **kwargs)
        assert np.isfinite(estimate(1.0))
        assert estimate(1.0) > 0
        edgeStrength(src, **kwargs)


# What must not fool it.


@pytest.mark.parametrize("level", [2.0, 2.004, 8.0])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7])
@pytest.mark.parametrize("place", ["side", "rows", "blocks"])
def test_constant_areas_do_not_count(place, share, level):
    """Filled holes, a saturated background, a simulated wall."""
    v, u = np.indices((480, 640))
    constant = {
        "side": u < share * 640,
        "rows": v < share * 480,
        "blocks": (u // 40 * 7 + v // 40 * 13) % 100 < 100 * share,
    }
    z = 2 + 0.003 * np.random.default_rng(31).standard_normal(u.shape)
    z[constant[place]] = level
    np.testing.assert_allclose(estimateNoise(z.astype(np.float32), K=K)(2.0), 0.003, rtol=0.1)


def tilted(z0, angle, azimuth):
    """Depths of a plane that is tilted against the optical axis."""
    v, u = np.indices(SHAPE)
    x, y = (u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]
    slope, turned = np.tan(np.radians(angle)), np.radians(azimuth)
    return z0 / (1 + slope * (np.cos(turned) * x + np.sin(turned) * y))


@pytest.mark.parametrize("kind", ["integers", "floats"])
@pytest.mark.parametrize("angle", [0, 10, 30, 50])
def test_planes_rounded_to_millimetres_are_planes(angle, kind):
    for z0 in (0.4, 1.0, 3.0):
        for azimuth in (0, 30, 90):
            millimetres = np.rint(1000 * tilted(z0, angle, azimuth))
            src = millimetres.astype(np.uint16) if kind == "integers" else millimetres / 1000
            assert not detectEdges(src, K=K).any()
            assert segmentRegions(src, K=K).max() == 1
            if kind == "integers" or angle > 0:  # else the image has a single value
                assert estimateNoise(src, K=K)(z0) > 0.95 * 0.001 / np.sqrt(12)


@pytest.mark.parametrize("unit", [256, 100])
@pytest.mark.parametrize("angle", [16, 20, 30, 40])
def test_planes_rounded_coarsely_are_planes(unit, angle):
    """Near the camera the same value is seen over many pixels, and over few farther away."""
    for z0 in (0.3, 0.5, 1.0, 2.0):
        for azimuth in (0, 27):
            src = np.rint(unit * tilted(z0, angle, azimuth)).astype(np.uint16)
            assert not detectEdges(src, K=K, depthFactor=unit).any()


HOLES = {
    "checkerboard": lambda v, u: (u + v) % 2 > 0,
    "comb": lambda v, u: u % 2 > 0,
    "comb of three": lambda v, u: u % 3 > 0,
    "gaps": lambda v, u: (u % 5 > 3) | (v % 5 > 3),
    "points": lambda v, u: (u % 3 > 0) | (v % 3 > 0),
}


@pytest.mark.parametrize("holes", HOLES)
def test_a_pattern_of_holes_changes_nothing(holes):
    z = 2 + 0.003 * np.random.default_rng(32).standard_normal(SHAPE)
    z[HOLES[holes](*np.indices(SHAPE))] = NAN
    np.testing.assert_allclose(estimateNoise(z, K=K)(2.0), 0.003, rtol=0.1)


def test_near_and_far_are_told_apart():
    """Blocks at 0.6 and 4 m side by side, with the noise of triangulation."""
    v, u = np.indices((480, 640))
    z = np.where((u // 80 + v // 80) % 2 > 0, 0.6, 4.0)
    z = z + 0.002 * z**2 * np.random.default_rng(33).standard_normal(z.shape)
    estimate = estimateNoise(z, K=K)
    np.testing.assert_allclose(estimate(np.array([0.6, 4.0])), 0.002 * np.array([0.36, 16]), rtol=0.1)


@pytest.mark.parametrize("geometry", [dict(), dict(K=K)])
@pytest.mark.parametrize("levels", [(1.0, 0.8), (1.0, 0.8, 0.75, 0.5)])
def test_constant_faces_without_noise_keep_their_steps(levels, geometry):
    z = np.full((90, 120), levels[0])
    for i, level in enumerate(levels[1:]):
        z[20 + 5 * i : 60 - 3 * i, 10 + 30 * i : 35 + 30 * i] = level
    assert estimateNoise(z, **geometry)(1.0) < 1e-4
    edges = detectEdges(z, **geometry) > 0
    nearer = z < cv2.dilate(z, np.ones((3, 3)))
    assert edges[nearer].mean() > 0.95  # thinning rounds corners off
    assert not (edges & ~cv2.dilate(nearer.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)).any()


def test_an_image_without_noise_is_silent():
    camera = pinholeCamera(np.array([[196.8, 0, 119.63], [0, 196.8, 89.71], [0, 0, 1]]), (240, 180), 1.2)
    for seed in (1, 2):
        scene = renderScene(polyhedraScene(seed, camera), camera)
        estimate = estimateNoise(scene.depth, **camera.geometry)
        assert estimate(1.2) < 1e-4
        assert max(estimate.fits[4:]) <= 1.3
        edges = detectEdges(scene.depth, **camera.geometry, maxSmear=0) > 0  # narrow faces are no smears
        truth = scene.edges(0.01, 30.0)
        assert cv2.dilate(edges.astype(np.uint8), np.ones((5, 5)))[(truth > 0) & (truth < 4)].mean() > 0.99


@pytest.mark.filterwarnings("ignore:.*far from the others")
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("geometry", [dict(), dict(K=K), dict(heightMap=True)])
def test_the_worst_images_have_some_noise(geometry, dtype):
    rng = np.random.default_rng(34)
    noise, steps = rng.standard_normal((60, 70)), rng.integers(0, 2, (60, 70))
    huge = float(np.finfo(dtype).max) / 4
    tiny = float(np.finfo(dtype).tiny) * 4
    images = [np.full((60, 70), value) for value in (0, 1, -1, huge, tiny, np.inf, NAN)]
    images += [value * (1 + scale * noise) for value in (1, 1e30, 1e-30, huge / 9, tiny) for scale in (1e-9, 1e-3, 0.3)]
    images += [
        1.0 + steps,
        np.where(steps, NAN, noise),
        np.where(steps, huge, tiny),
        noise[:1],
        noise[:, :1],
        noise[:7, :7],
    ]
    for image in images:
        with np.errstate(all="ignore"):
            src = image.astype(dtype)
        estimate = estimateNoise(src, **geometry)
        values = np.array([estimate.a, estimate.c, *estimate.fits])
        assert np.isfinite(values).all()
        assert (values >= 0).all()
        assert max(estimate.a, estimate.b, estimate.c) > 0
        edgeStrength(src, **geometry)


# Invariance.


def numbers_of(estimate):
    return np.array([estimate.a, estimate.b, estimate.c, *estimate.fits])


def cluttered(shape=(240, 320)):
    """Planes and steps under noise with waves."""
    v, u = np.indices(shape)
    rng = np.random.default_rng(35)
    z = 1.5 + 0.001 * u + 0.0005 * v - 0.3 * (np.hypot(u - 100, v - 80) < 50) - 0.2 * (u + v > 420)
    waves = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), 3.0)
    return z + 0.002 * z**2 * (rng.standard_normal(shape) + 8 * waves)


@pytest.mark.parametrize("geometry", [dict(), dict(K=K)])
def test_mirrored_and_transposed_images_have_the_same_noise(geometry):
    z = cluttered()
    expected = numbers_of(estimateNoise(z, **geometry))
    for moved in (z[:, ::-1], z[::-1], z[::-1, ::-1]):
        np.testing.assert_allclose(numbers_of(estimateNoise(moved, **geometry)), expected, rtol=1e-9)
    transposed = numbers_of(estimateNoise(z.T, **geometry))
    directions = np.r_[:7, 28:49, 7:28]  # a, b, c, the waves; columns, rows
    np.testing.assert_allclose(transposed[directions], expected, rtol=1e-9)


@pytest.mark.parametrize("geometry", [dict(), dict(K=K)])
@pytest.mark.parametrize("scale", [1 / 64, 1024.0])
def test_the_unit_of_length_does_not_matter(scale, geometry):
    z = cluttered()
    one, other = estimateNoise(z, **geometry), estimateNoise(scale * z, **geometry)
    np.testing.assert_allclose(other(scale * 1.5), scale * one(1.5), rtol=1e-6)
    np.testing.assert_allclose(other.fits[4:], one.fits[4:], rtol=1e-6)


def test_threads_change_no_bit_of_the_estimate():
    threads, estimates = cv2.getNumThreads(), []
    try:
        for n in (1, 2, 3):
            cv2.setNumThreads(n)
            estimates.append(estimateNoise(cluttered(), K=K))
    finally:
        cv2.setNumThreads(threads)
    assert estimates[0] == estimates[1] == estimates[2]


# The noise of fits.

LEVELS = (4, 8, 16, 32)


def waves_and_white(length, correlation, seed=36, shape=(480, 640)):
    """Normal noise in which samples d apart go together by exp(-d^2 / length^2), and white noise of deviation 1."""
    rng = np.random.default_rng(seed)
    waves = cv2.GaussianBlur(rng.standard_normal(shape), (0, 0), length / 2)
    return rng.standard_normal(shape) + np.sqrt(correlation**2 - 1) * waves / waves.std()


@pytest.mark.parametrize(("correlation", "length"), [(1, 1), (2, 2), (2, 4), (2, 8), (2, 16), (5, 4), (5, 8)])
def test_the_noise_of_fits_is_what_a_model_of_three_numbers_predicts(correlation, length):
    """Its errors: slopes within 20 %; values from 10 % less to 60 % more, as steps of three windows tell them."""
    estimate = estimateNoise(2 + 0.002 * waves_and_white(length, correlation))
    expected = NoiseModel(0.002, correlation=correlation, length=length)
    fitted, predicted = (np.reshape(model.of_fits()[4:], (2, -1)) for model in (estimate, expected))
    fitted = estimate.a / 0.002 * fitted
    slope, value, residual = (np.r_[:4], np.r_[5:9], 20)
    np.testing.assert_allclose(fitted[:, slope], predicted[:, slope], rtol=0.2)
    assert (fitted[:, value] > 0.9 * predicted[:, value]).all()
    assert (fitted[:, value] < 1.6 * predicted[:, value]).all()
    np.testing.assert_allclose(fitted[:, residual], predicted[:, residual], rtol=0.1)


def test_white_noise_has_no_waves():
    estimate = estimateNoise(2 + 0.003 * np.random.default_rng(37).standard_normal((480, 640)), K=K)
    np.testing.assert_allclose(np.reshape(estimate.fits[4:], (2, -1))[:, :20], 1, atol=0.3)
    np.testing.assert_allclose(estimate.fits[24], 1.25, rtol=0.03)


def test_bands_are_noise_of_the_columns():
    """Every row has an offset of its own: along rows it is not seen, across them it counts, whatever is averaged."""
    rng = np.random.default_rng(38)
    bands = cv2.GaussianBlur(rng.standard_normal((480, 1)), (0, 0), 3.0) * np.ones(640)
    estimate = estimateNoise(2 + 0.002 * (rng.standard_normal((480, 640)) + 2 * bands / bands.std()))
    rows, cols = np.reshape(estimate.fits[4:], (2, -1))
    np.testing.assert_allclose(rows[:4], 1, atol=0.15)
    assert (cols[1:4] > 3).all()
    assert (cols[11:14] > 1.8 * cols[1:4]).all()  # shared by five columns: sqrt(5) times


def steps(lines, n):
    """D and G (core/noise/fits.hpp) of fits to n samples, at all places of lines, in units of white noise."""
    k = np.arange(n) - (n - 1) / 2
    m2 = n * (n * n - 1) / 12
    kernels = [np.r_[k, -2 * k, k] / m2 / np.sqrt(6 / m2)]
    mean, slope = np.full(n, 1 / n), k / m2
    gap = np.r_[mean + slope * n / 2, -2 * mean, mean - slope * n / 2]
    kernels.append(gap / np.sqrt(6 / n + n * n / (2 * m2)))
    return [np.lib.stride_tricks.sliding_window_view(lines, 3 * n, axis=1)[:, :: n // 2 + 1] @ w for w in kernels]


def waves(rng, radius):
    """Noise that is smooth over some pixels, with as much white noise that it is no curved surface."""
    smooth = cv2.GaussianBlur(rng.standard_normal((480, 640)), (0, 0), radius)
    return smooth / smooth.std() + 0.25 * rng.standard_normal((480, 640))


KINDS = {
    "white": lambda rng: rng.standard_normal((480, 640)),
    "blurred by 1": lambda rng: waves(rng, 1.0),
    "blurred by 2": lambda rng: waves(rng, 2.0),
    "blurred by 4": lambda rng: waves(rng, 4.0),
    "blurred by 8": lambda rng: waves(rng, 8.0),
    "quantised": lambda rng: np.rint(0.7 * rng.standard_normal((480, 640)) + 0.37 * np.arange(640)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_significance_of_k_means_the_same_on_all_noise(kind):
    """Steps beyond k deviations are as rare as with a normal deviate, within a factor of 2."""
    rng = np.random.default_rng(39)
    noise = KINDS[kind](rng)
    estimate = estimateNoise(2 + 0.003 * noise)
    image = oracle.Image(2 + 0.003 * noise, noise=estimate)
    line = image.line([(u, 0) for u in range(640)], DIR_ROWS)
    for n in LEVELS:
        slope, value = steps(0.003 * noise, n)
        deviation = line.deviation(0, n)
        for sizes, factor in ((slope, line.noise.factor("slope", n)), (value, line.noise.factor("value", n))):
            for k in (1, 2):
                rate = np.mean(np.abs(sizes) > k * deviation * factor)
                assert rate < 2 * 2 * norm.sf(k), (n, k)
            if sizes is slope:
                assert np.mean(np.abs(sizes) > 1 * deviation * factor) > norm.sf(1), n


@pytest.mark.parametrize("kind", KINDS)
def test_noise_alone_makes_no_lines(kind):
    noise = KINDS[kind](np.random.default_rng(40))
    edges = detectEdges(2 + 0.003 * noise / noise.std(), K=np.array([[600.0, 0, 319.5], [0, 600, 239.5], [0, 0, 1]]))
    assert np.count_nonzero(edges) <= 0.001 * edges.size


@pytest.mark.parametrize("radius", [1.5, 2.0, 2.5, 3.0, 4.0, 6.0])
def test_noise_as_smooth_as_a_surface_makes_no_lines(radius):
    """Without any white noise: it is told from a shape by its waves, which end within some pixels."""
    for seed in (41, 42):
        smooth = cv2.GaussianBlur(np.random.default_rng(seed).standard_normal((480, 640)), (0, 0), radius)
        for amplitude in (0.001, 0.004):
            z = (1 + amplitude * smooth / smooth.std()).astype(np.float32)
            edges = detectEdges(z, K=np.array([[600.0, 0, 319.5], [0, 600, 239.5], [0, 0, 1]]))
            assert np.count_nonzero(edges) <= 0.0003 * edges.size


# Models.


def test_a_model_is_a_quadratic_of_depth():
    z = np.array([0.5, 1.0, 4.0])
    np.testing.assert_allclose(NoiseModel(1.0, 2.0, 3.0)(z), 1 + 2 * z + 3 * z * z, rtol=1e-15)
    assert NoiseModel(c=0.0014)(2.0) == pytest.approx(0.0056)


def test_presets():
    assert NoiseModel.kinect1()(2.0) == pytest.approx(0.004)
    assert NoiseModel.kinect2()(1.0) == pytest.approx(0.00297)
    stereo = NoiseModel.stereo(600.0, 0.05)
    assert stereo.correlation * stereo(3.0) == pytest.approx(9 * 0.08 / 30)
    assert NoiseModel.stereo(600.0, 0.05, 0.04, 2.0, 6.0) == NoiseModel(c=0.04 / 60, correlation=2.0, length=6.0)
    z = np.linspace(0.3, 10, 100)
    for model in (
        NoiseModel.realsense(),
        NoiseModel.azureKinect(),
        NoiseModel.kinect1(),
        NoiseModel.kinect2(),
        NoiseModel.structuredLight(),
        stereo,
    ):
        assert (model(z) > 0).all()
        # Waves make fits to many samples worse than white noise would, and slopes more so than single values.
        rows = model.of_fits()[4:]
        assert 1 <= rows[0] < rows[3]
        assert rows[3] > model.correlation > 1


@pytest.mark.parametrize("model", [NoiseModel(0.004), NoiseModel(0.001, 0.001, 0.002)])
@pytest.mark.parametrize("geometry", [dict(K=K), dict(pixelSize=0.003), dict()])
def test_a_map_of_the_same_values_does_the_same(model, geometry):
    z = depths("slanted")[:60, :80].copy()
    z[20:40, 30:60] -= 0.2
    z += model(z) * np.random.default_rng(10).standard_normal(z.shape)
    z[5:8, 5:8] = NAN
    with_model = edgeStrength(z, noise=model, **geometry)
    with_map = edgeStrength(z, noise=model(z), **geometry)
    assert with_model.jump.any()
    for a, b in zip(with_model, with_map, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6)


def test_a_number_is_a_constant_model():
    z = depths("one depth")[:40, :50].copy()
    z[10:30, 10:30] = 1.2
    z += 0.003 * np.random.default_rng(11).standard_normal(z.shape)
    a, b = edgePoints(z, noise=0.003, K=K), edgePoints(z, noise=NoiseModel(a=0.003), K=K)
    assert len(a) > 0
    assert np.array_equal(a, b)


def test_no_noise_given_is_the_estimate():
    z = depths("slanted") + 0.003 * np.random.default_rng(12).standard_normal(SHAPE)
    z[100:140, 100:180] -= 0.1
    a, b = edgePoints(z, K=K), edgePoints(z, K=K, noise=estimateNoise(z, K=K))
    assert len(a) > 0
    assert np.array_equal(a, b)


def test_more_correlation_means_less_significance():
    z = np.where(np.arange(40) < 20, 1.0, 1.25) * np.ones((30, 1))
    options = dict(eps=0.1, mergeSignificance=0.0, minSignificance=0.0, crease=CREASE_MAX, maxShift=0.0)
    white, correlated = (edgePoints(z, noise=NoiseModel(0.02, correlation=c), **options) for c in (1.0, 2.0))
    assert len(white) == len(correlated)
    ratio = white["significance"] / correlated["significance"]
    inside = (white["y"] > 4) & (white["y"] < 25)  # one or two samples in a corner of the image are off as they are
    np.testing.assert_allclose(ratio[inside], 2, rtol=1e-5)
    assert ((ratio > 0.999) & (ratio < 2.001)).all()


def test_a_map_where_there_is_no_data_may_hold_anything():
    z = np.full((9, 9), 1.0)
    z[4, 4] = NAN
    sigma = np.full((9, 9), 0.01)
    sigma[4, 4] = NAN
    edgeStrength(z, noise=sigma)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (dict(a=NAN), "a"),
        (dict(b=np.inf), "b"),
        (dict(c="1"), "c"),
        (dict(a=True), "a"),
        (dict(a=1, correlation=0.5), "correlation"),
        (dict(a=1, correlation=NAN), "correlation"),
        (dict(a=1, length=-1), "length"),
        (dict(a=1, fits=3), "fits"),
        (dict(a=1, fits=(1.0, 2.0)), "fits"),
        (dict(a=1, fits=("x",) * 46), "fits"),
        (dict(a=1, fits=(0.0,) * 4 + (1.0,) * 42), "fits"),
        (dict(a=1, fits=(1.0,) * 4 + (0.0,) * 42), "fits"),
        (dict(), "a"),
    ],
)
def test_bad_models_are_refused(arguments, name):
    with pytest.raises(rangeedge.error, match=f"NoiseModel: .*`{name}`"):
        NoiseModel(**arguments)


@pytest.mark.parametrize("arguments", [(0, 1), (1, 0), (1, 1, 0), (NAN, 1), ("a", 1), (1, 1, 1, 0.5)])
def test_bad_stereo_models_are_refused(arguments):
    with pytest.raises(rangeedge.error, match=r"NoiseModel\.stereo: `"):
        NoiseModel.stereo(*arguments)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (dict(src=None), "src"),
        (dict(src=np.zeros((0, 4))), "src"),
        (dict(K=np.eye(2)), "K"),
        (dict(pixelSize=-1), "pixelSize"),
        (dict(mask=np.ones((3, 3), np.uint8)), "mask"),
        (dict(depthFactor=0), "depthFactor"),
    ],
)
def test_bad_arguments_of_the_estimate_are_named(arguments, name):
    with pytest.raises(rangeedge.error, match=f"estimateNoise: `{name}` must be"):
        estimateNoise(**{"src": np.ones((8, 8)), **arguments})


def test_a_model_that_is_negative_somewhere_is_refused():
    z = np.full((20, 20), 2.0)
    with pytest.raises(rangeedge.error, match="edgeStrength: `noise` must be a model that is positive"):
        edgeStrength(z, K=K, noise=NoiseModel(0.001, -0.001))
    assert edgeStrength(z, K=K, noise=NoiseModel(0.003, -0.001)).jump.max() == 0
