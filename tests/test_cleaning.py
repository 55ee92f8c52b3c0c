"""Depths without flying pixels, without holes, and with less noise."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import CLEAN_FILLED, CLEAN_REMOVED, CLEAN_SMOOTHED, NoiseModel, cleanDepth
from rangeedge.synthetic import (
    abwCamera,
    abwNoise,
    demoScene,
    gaussianNoise,
    kinectCamera,
    kinectNoise,
    pinholeCamera,
    plane,
    polyhedraScene,
    renderScene,
    roof,
    sphere,
    step,
)

K = np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
CAMERA = pinholeCamera(K, (160, 120))


def seen(scene, sigma=0.0, seed=0):
    rendering = renderScene(scene, CAMERA)
    noise = np.random.default_rng(seed).normal(0, sigma, rendering.depth.shape) if sigma else 0
    return rendering, rendering.depth + noise


def rms(error):
    return float(np.sqrt(np.mean(np.square(error))))


def from_edges(rendering):
    """Pixels to the nearest true edge."""
    seen = np.ones(rendering.depth.shape, np.uint8)
    for name in ("first", "second"):
        seen.ravel()[rendering.crossings[name]] = 0
    return cv2.distanceTransform(seen, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("sensor", ["kinect", "time of flight", "structured light"])
def test_noise_on_surfaces_is_halved_and_edges_stay(sensor, seed):
    camera = abwCamera() if sensor == "structured light" else kinectCamera()
    rendering = renderScene(polyhedraScene(seed, camera), camera)
    if sensor == "kinect":
        scan = kinectNoise(rendering, seed=seed)
    elif sensor == "time of flight":
        scan = gaussianNoise(rendering, NoiseModel(a=2.8e-3, c=0.17e-3), seed)
    else:
        scan = abwNoise(rendering, seed=seed)
    cleaned, changed = cleanDepth(scan.src, **scan.geometry)
    assert cleaned.dtype == scan.src.dtype
    unit = 1000 if sensor == "kinect" else 1
    before, after = (z[..., 2] if z.ndim == 3 else z / unit for z in (scan.src, cleaned))
    both = (before > 0) & (after > 0)
    inside = both & (from_edges(rendering) > 3)
    assert rms((after - rendering.depth)[inside]) < rms((before - rendering.depth)[inside]) / 2
    near = both & ~inside & ((changed & CLEAN_REMOVED) == 0)
    assert np.median(np.abs(after - rendering.depth)[near]) < np.median(np.abs(before - rendering.depth)[near])
    assert rms((after - rendering.depth)[near]) < 1.02 * rms((before - rendering.depth)[near])


@pytest.mark.parametrize("model", [NoiseModel(a=0.07e-3, c=0.15e-3), NoiseModel(a=2.8e-3, c=0.17e-3)])
def test_pixels_that_only_look_flying_are_not_moved(model):
    rendering = renderScene(demoScene(), kinectCamera())  # every pixel sees one surface
    scan = gaussianNoise(rendering, model)
    cleaned, _ = cleanDepth(scan.src, **scan.geometry)
    near = np.isfinite(cleaned) & (from_edges(rendering) <= 3)
    assert near.sum() > 40000
    assert rms((cleaned - rendering.depth)[near]) < 0.7 * rms((scan.src - rendering.depth)[near])


def test_a_hole_in_a_slope_continues_it():
    rendering, depth = seen([plane((0, 0, 1.0), (0.5, 0.3, -1))], 0.001)
    depth[50:66, 70:90] = np.nan
    cleaned, changed = cleanDepth(depth, K=K)
    assert (changed[50:66, 70:90] == CLEAN_FILLED).all()
    assert np.abs(cleaned - rendering.depth)[50:66, 70:90].max() < 0.001
    assert (changed[:40] == CLEAN_SMOOTHED).mean() > 0.999


@pytest.mark.parametrize("convex", [True, False])
def test_a_hole_over_a_crease_is_divided_where_the_surfaces_meet(convex):
    rendering, depth = seen(roof(60, orientation=10, convex=convex), 0.0005)
    depth[45:63, 70:91] = np.nan
    cleaned, changed = cleanDepth(depth, K=K)
    assert (changed[45:63, 70:91] == CLEAN_FILLED).all()
    # A mean over the crease would be off by some 6 mm there.
    assert np.abs(cleaned - rendering.depth)[45:63, 70:91].max() < 0.001


def test_a_hole_in_the_border_of_a_jump_is_divided_along_it():
    rendering, depth = seen(step(0.2), 0.0005)
    depth[50:62, 73:87] = np.nan
    cleaned, changed = cleanDepth(depth, K=K)
    assert (changed[50:62, 73:87] == CLEAN_FILLED).all()
    wrong = np.abs(cleaned - rendering.depth)[50:62, 73:87] > 0.001
    assert wrong.mean() < 0.1
    filled = cleaned[50:62, 73:87]
    assert (np.abs(filled - rendering.depth[50:62, 73:87]) < 0.001).any()
    # No depth between both: nothing is filled across an edge.
    assert ((np.abs(filled - 1.0) < 0.005) | (np.abs(filled - 1.2) < 0.005)).all()


def test_a_shadow_belongs_to_the_farther_surface():
    rendering, depth = seen(step(0.2), 0.0005)
    border = int(np.argmax(rendering.depth[60] > 1.1))
    depth[:, border : border + 10] = np.nan
    cleaned, changed = cleanDepth(depth, K=K)
    shadow = (slice(15, 105), slice(border, border + 10))  # the ends go on beyond the image
    assert (changed[shadow] == CLEAN_FILLED).all()
    assert np.abs(cleaned - rendering.depth)[shadow].max() < 0.001


def test_wide_holes_stay():
    _, depth = seen([plane((0, 0, 1.0), (0, 0, -1))], 0.001)
    depth[40:80, 40:80] = np.nan
    depth[50:53, 100:150] = np.nan
    cleaned, changed = cleanDepth(depth, K=K, maxHole=10)
    assert np.isnan(cleaned[45:75, 45:75]).all()
    assert (changed[50:53, 100:150] == CLEAN_FILLED).all()
    assert (cleanDepth(depth, K=K, maxHole=0).changed & CLEAN_FILLED == 0).all()
    assert (cleanDepth(depth, K=K, maxHole=70).changed[40:80, 40:80] == CLEAN_FILLED).all()


def test_flying_pixels_go_to_the_surface_they_are_nearer_to():
    depth = np.full((60, 80), 0.7)
    depth[:, :40] = 0.6
    depth[:, 40] = np.where(np.arange(60) < 30, 0.63, 0.67)
    camera = [[500, 0, 40], [0, 500, 30], [0, 0, 1]]
    cleaned, changed = cleanDepth(depth, noise=0.0005, K=camera)
    assert (changed[5:55, 40] == CLEAN_REMOVED | CLEAN_FILLED).all()
    assert cleaned[5:25, 40] == pytest.approx(0.6, abs=1e-3)
    assert cleaned[35:55, 40] == pytest.approx(0.7, abs=1e-3)
    cleaned, changed = cleanDepth(depth, noise=0.0005, K=camera, maxHole=0)
    assert (changed[5:55, 40] == CLEAN_REMOVED).all()
    assert np.isnan(cleaned[5:55, 40]).all()
    cleaned, changed = cleanDepth(depth, noise=0.0005, K=camera, removeFlying=False)
    assert (changed & CLEAN_REMOVED == 0).all()


def test_what_is_not_noise_stays():
    rendering, depth = seen([plane((0, 0, 1.0), (0, 0, -1)), sphere((0, 0, 1.0), 0.2)], 0.0005)
    depth[20, 20] = 0.9  # something small in front of the plane
    cleaned, changed = cleanDepth(depth, K=K, removeFlying=False)
    assert cleaned[20, 20] == 0.9
    assert changed[20, 20] == 0
    inside = from_edges(rendering) > 3
    inside[20, 20] = False
    error = [rms((z - rendering.depth)[inside]) for z in (depth, cleaned)]
    assert error[1] < error[0]


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.float32, np.float64])
def test_type_unit_and_input_are_kept(dtype):
    rendering, depth = seen(demoScene(), 0.001)
    src = np.rint(1000 * depth).astype(dtype) if np.issubdtype(dtype, np.integer) else depth.astype(dtype)
    src[50:55, 60:66] = 0
    before = src.copy()
    cleaned, changed = cleanDepth(src, K=K)
    assert np.array_equal(src, before)
    assert cleaned.dtype == dtype
    assert changed.dtype == np.uint8
    assert np.array_equal(cleaned[changed == 0], src[changed == 0])
    scale = 1000 if np.issubdtype(dtype, np.integer) else 1
    assert np.median(np.abs(cleaned / scale - rendering.depth)) < 0.0005


def test_heights_and_points_are_cleaned_likewise():
    rng = np.random.default_rng(4)
    x = np.arange(120.0) * np.ones((90, 1))
    truth = np.abs(x - 60)
    height = truth + rng.normal(0, 0.05, truth.shape)
    height[30:40, 55:66] = np.nan
    cleaned, changed = cleanDepth(height, pixelSize=1.0, heightMap=True)
    assert (changed[30:40, 55:66] == CLEAN_FILLED).all()
    assert rms((cleaned - truth)[:, 3:-3]) < 0.03
    points = np.dstack([x, np.arange(90.0)[:, None] * np.ones(120), height])
    moved, changed = cleanDepth(points, heightMap=True)
    assert (changed & CLEAN_FILLED == 0).all()
    assert np.array_equal(moved[..., :2], points[..., :2])
    assert np.nanmax(np.abs(moved[..., 2] - cleaned)[:, 3:-3]) < 0.05


def test_points_move_along_their_lines_of_sight():
    _, depth = seen([plane((0, 0, 1.0), (0.5, 0.3, -1))], 0.001)
    points = rangeedge.backproject(depth, K=K)
    moved, changed = cleanDepth(points)
    assert (changed == CLEAN_SMOOTHED).mean() > 0.99
    assert np.allclose(np.cross(moved, points), 0, atol=1e-9)
    assert np.allclose(moved[..., 2], cleanDepth(depth, K=K).depth, atol=1e-5)


def test_labels_are_taken_and_what_is_masked_is_kept():
    _, depth = seen(roof(20), 0.002)
    labels = np.where(np.arange(160) < 80, 1, 2) * np.ones((120, 1), np.int32)
    mask = np.ones(depth.shape, np.uint8)
    mask[:30] = 0
    cleaned, changed = cleanDepth(depth, labels.astype(np.int32), K=K, mask=mask)
    assert np.array_equal(cleaned[:30], depth[:30])
    assert (changed[:30] == 0).all()
    assert (changed[30:] == CLEAN_SMOOTHED).mean() > 0.99
    assert labels.min() == 1
    assert (cleanDepth(depth, labels.astype(np.int32), K=K, radius=0).changed == 0).all()


@pytest.mark.parametrize("width", [5, 9, 10, 14, 19])
def test_narrow_images_are_smoothed_as_flat_ones(width):
    rng = np.random.default_rng(width)
    relief = 0.02 * np.sin(np.arange(240) / 6) * (np.arange(240) > 120)  # detail on one half
    depth = 1 + relief[:, None] + rng.normal(0, 0.002, (240, width))
    labels = np.ones(depth.shape, np.int32)
    upright, _ = cleanDepth(depth, labels, removeFlying=False, noise=0.002)
    flat, _ = cleanDepth(depth.T.copy(), labels.T.copy(), removeFlying=False, noise=0.002)
    assert np.allclose(upright, flat.T, atol=1e-6)
    assert rms(upright - 1 - relief[:, None]) < 0.8 * rms(depth - 1 - relief[:, None])


def test_results_do_not_depend_on_threads():
    scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
    threads = cv2.getNumThreads()
    found = []
    for count in (1, 3):
        cv2.setNumThreads(count)
        found.append(cleanDepth(scan.src, **scan.geometry))
    cv2.setNumThreads(threads)
    assert np.array_equal(found[0].depth, found[1].depth)
    assert np.array_equal(found[0].changed, found[1].changed)


def test_distorted_lenses_see_the_same_surface():
    _, depth = seen([plane((0, 0, 1.0), (0.5, 0.3, -1))], 0.001)
    depth[50:60, 70:80] = np.nan
    _, changed = cleanDepth(depth, K=K, distCoeffs=(0.01, 0, 0, 0))
    assert (changed[50:60, 70:80] == CLEAN_FILLED).all()


def test_nothing_is_left_as_it_is():
    for empty in (np.zeros((20, 30), np.uint16), np.full((20, 30), np.nan)):
        cleaned, changed = cleanDepth(empty, K=K)
        assert np.array_equal(cleaned, empty, equal_nan=empty.dtype.kind == "f")
        assert not changed.any()
    assert cleanDepth(np.ones((1, 1)), K=K).depth == 1


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: cleanDepth(3), "cleanDepth: `src` must be"),
        (lambda: cleanDepth(np.ones((3, 4)), np.ones((3, 4))), "cleanDepth: `labels` must be an int32 array"),
        (lambda: cleanDepth(np.ones((3, 4)), np.ones((4, 4), np.int32)), "`labels` must be an int32 array of shape"),
        (lambda: cleanDepth(np.ones((3, 4)), np.full((3, 4), 10**8, np.int32)), "labels of up to 65535"),
        (lambda: cleanDepth(np.ones((3, 4)), maxHole=-1), "`maxHole` must be an integer >= 0"),
        (lambda: cleanDepth(np.ones((3, 4)), radius=-1), "`radius` must be a finite number >= 0"),
        (lambda: cleanDepth(np.ones((3, 4)), removeFlying=1), "`removeFlying` must be True or False"),
        (lambda: cleanDepth(np.ones((3, 4)), hole=1), "unknown argument `hole`"),
        (lambda: cleanDepth(np.ones((3, 4)), mask=np.ones((2, 2), np.uint8)), "`mask` must be"),
    ],
)
def test_bad_arguments_are_named(call, text):
    with pytest.raises(rangeedge.error) as problem:
        call()
    assert text in str(problem.value)


def room(sigma):
    """Points of a room 4 x 3 x 2.4 m, seen all around by a scanner in it, with noise along its rays."""
    azimuth = np.radians(np.arange(0, 360, 0.5))
    elevation = np.radians(np.arange(-30, 30, 1.0))[:, None]
    rays = np.stack(
        np.broadcast_arrays(
            np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
        ),
        axis=-1,
    )
    with np.errstate(divide="ignore"):
        truth = (np.array([2, 1.5, 1.2]) / np.abs(rays)).min(axis=2)
    noise = np.random.default_rng(0).normal(0, sigma, truth.shape)
    return truth, rays * (truth + noise)[..., None]


@pytest.mark.parametrize("sky", [0, 40])
def test_rooms_seen_all_around_are_cleaned(sky):
    truth, points = room(0.005)
    # Columns of which different parts are open to the sky look in different directions on the whole.
    points[np.arange(60)[:, None] >= 60 - np.random.default_rng(1).integers(0, sky + 1, points.shape[1])] = np.nan
    cleaned, changed = cleanDepth(points)
    seen = np.isfinite(points[..., 0])
    before, after = ((np.linalg.norm(p, axis=2) - truth)[seen] for p in (points, cleaned))
    assert (changed == CLEAN_SMOOTHED)[seen].mean() > 0.95
    assert rms(after) < rms(before) / 2
    points, cleaned = points[seen], cleaned[seen]
    assert np.allclose(np.cross(cleaned, points), 0, atol=1e-6)


@pytest.mark.parametrize(
    ("dtype", "invalid", "expected"),
    [
        (np.uint16, -1, 0),
        (np.uint16, 70000, 0),
        (np.uint16, 1.5, 0),
        (np.uint16, (-1, 1.5, 65535, 0), 65535),
        (np.int16, 65535, 0),
        (np.int16, (65535, -1), -1),
        (np.int32, np.inf, 0),
    ],
)
def test_removed_pixels_hold_what_their_type_can(dtype, invalid, expected):
    depth = np.where(np.arange(100) < 50, 1500, 1200) * np.ones((80, 1))
    depth[:, 49] = 1350
    K = (100, 100, 49.5, 39.5)
    cleaned, changed = cleanDepth(depth.astype(dtype), K=K, noise=0.001, invalid=invalid, maxHole=0)
    removed = changed & CLEAN_REMOVED > 0
    assert removed[5:-5, 49].all()
    assert np.unique(cleaned[removed]).tolist() == [expected]
