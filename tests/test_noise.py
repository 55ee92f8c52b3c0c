"""Noise models, and their estimate from one image."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import CREASE_MAX, NoiseModel, _core, edgePoints, edgeStrength, estimateNoise
from rangeedge.synthetic import demoScene, gaussianNoise, pinholeCamera, renderScene

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
    assert estimateNoise(1.5 + together, K=K).correlation > 1.8
    assert estimateNoise(1.5 + together, K=K).correlation <= 2.5


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


# The kernel against the same statistics by sorting.

LAG, WINDOWS, BINS, BIN_SIZE = 6, 1 << 15, 8, 50


def third_differences(ordinate, lag):
    """|y0 - 3 y1 + 3 y2 - y3| along rows and columns, and the means of the four; of a large image some lines."""
    sizes, means = [np.empty(0)], [np.empty(0)]
    for y in (ordinate, ordinate.T):
        if len(y) > 3 * lag:
            y = y[:, :: 1 + y.size // WINDOWS].astype(np.float64)
            y0, y1, y2, y3 = (y[k * lag : len(y) - (3 - k) * lag] for k in range(4))
            d = np.abs(y3 - y0 - 3 * (y2 - y1))
            sizes.append(d[np.isfinite(d)])
            means.append(((y0 + y1 + y2 + y3) / 4)[np.isfinite(d)])
    return np.concatenate(sizes), np.concatenate(means)


def trimmed_deviation(differences):
    kept = int(0.75 * len(differences))
    if kept == 0:
        return 0.0
    ordered = np.sort(differences)
    sigma = np.sqrt(np.mean(ordered[:kept] ** 2) / 20) / 0.607
    moved = ordered[ordered > 0]
    if len(moved) == 0 or len(moved) < 0.05 * len(differences):
        return sigma
    return max(sigma, moved[int(0.05 * len(moved))] / np.sqrt(12))


def by_ordinate(differences, ordinates):
    """The median ordinate and the deviation of bins with as many differences each; ordinates in single precision."""
    ordinates = ordinates.astype(np.float32).astype(np.float64)
    count = max(1, min(BINS, len(ordinates) // BIN_SIZE))
    order = np.argsort(ordinates)
    differences, ordinates = differences[order], ordinates[order]
    borders = np.quantile(ordinates, np.arange(1, count) / count).astype(np.float32)
    bins = np.searchsorted(borders, ordinates, side="left")
    parts = [bins == b for b in range(count) if (bins == b).any()]
    return [np.median(ordinates[p]) for p in parts], [trimmed_deviation(differences[p]) for p in parts]


def images():
    rng = np.random.default_rng(21)
    slope = np.arange(300) * 0.01 + np.arange(220)[:, None] * 0.003
    yield slope + 0.01 * rng.standard_normal(slope.shape)
    yield np.round(slope / 0.05) * 0.05  # mostly zero differences
    yield np.where(rng.random(slope.shape) < 0.2, NAN, slope + 0.002 * rng.standard_normal(slope.shape))
    yield rng.standard_normal((40, 7))
    yield rng.standard_normal((3, 25)) - 5
    yield np.full((30, 30), 2.0)
    yield rng.standard_normal((700, 500)).cumsum(axis=1)  # large: not every line


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_statistics_are_those_of_sorted_differences(dtype, threads):
    for y in images():
        y = y.astype(dtype)
        near, far, lowest, highest, ordinates, deviations = _core.noise_statistics(y, threads)
        differences, means = third_differences(y, 1)
        np.testing.assert_allclose(near, trimmed_deviation(differences), rtol=1e-6)
        np.testing.assert_allclose(far, trimmed_deviation(third_differences(y, LAG)[0]), rtol=1e-6)
        np.testing.assert_allclose([lowest, highest], [means.min(), means.max()], rtol=1e-6)
        np.testing.assert_allclose([ordinates, deviations], by_ordinate(differences, means), rtol=1e-6, atol=1e-12)


# Models.


def test_a_model_is_a_quadratic_of_depth():
    z = np.array([0.5, 1.0, 4.0])
    np.testing.assert_allclose(NoiseModel(1.0, 2.0, 3.0)(z), 1 + 2 * z + 3 * z * z, rtol=1e-15)
    assert NoiseModel(c=0.0014)(2.0) == pytest.approx(0.0056)


def test_presets():
    assert NoiseModel.kinect1()(2.0) == pytest.approx(0.0057)
    assert NoiseModel.kinect2()(1.0) == pytest.approx(0.0013)
    assert NoiseModel.stereo(600.0, 0.05)(3.0) == pytest.approx(9 * 0.08 / 30)
    assert NoiseModel.stereo(600.0, 0.05, subpixel=0.04)(3.0) == pytest.approx(9 * 0.04 / 30)
    z = np.linspace(0.3, 10, 100)
    for model in (NoiseModel.kinect1(), NoiseModel.kinect2(), NoiseModel.stereo(600, 0.05)):
        assert (model(z) > 0).all()
        assert model.correlation >= 1


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
    np.testing.assert_allclose(white["significance"], 2 * correlated["significance"], rtol=1e-5)


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
        (dict(), "a"),
    ],
)
def test_bad_models_are_refused(arguments, name):
    with pytest.raises(rangeedge.error, match=f"NoiseModel: .*`{name}`"):
        NoiseModel(**arguments)


@pytest.mark.parametrize("arguments", [(0, 1), (1, 0), (1, 1, 0), (NAN, 1), ("a", 1)])
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
