"""Regions: hand cases, properties, surfaces, and figures on real and rendered scenes."""

import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge.evaluation import hooverScores
from rangeedge.frame import read_frame
from rangeedge.noise import NoiseModel
from rangeedge.options import ScanLineParams
from rangeedge.regions import growRegions, growRegionsWithStats, segmentRegions, segmentRegionsWithStats
from rangeedge.seeds import find_seeds
from rangeedge.surfaces import _curved, surfaces_of
from rangeedge.synthetic import (
    abwCamera,
    abwNoise,
    curvedScene,
    gaussianNoise,
    kinectCamera,
    kinectNoise,
    perceptronCamera,
    perceptronNoise,
    pinholeCamera,
    planePair,
    polyhedraScene,
    renderScene,
    sphere,
)

SIGMA = 0.2
CAMERA = pinholeCamera(np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]]), (160, 120))


def noisy(depth, seed=0):
    return depth + np.random.default_rng(seed).normal(0, SIGMA, depth.shape)


def columns(profile, rows=80):
    return np.tile(np.asarray(profile, float), (rows, 1))


X = np.arange(120.0)
ROOF = noisy(columns(np.abs(X - 60)))
STEP = noisy(columns(np.where(X < 50, 0.0, 12.0)))


def one_region_each(labels, *areas, share=0.98):
    """Each area has a label of its own, on nearly all of its pixels."""
    found = []
    for area in areas:
        counts = np.bincount(labels[area].ravel())
        label = int(counts.argmax())
        assert label > 0
        assert counts[label] >= share * counts.sum()
        found.append(label)
    assert len(set(found)) == len(areas)


def markers_at(shape, *boxes):
    markers = np.zeros(shape, np.int32)
    for label, (rows, cols) in enumerate(boxes, 1):
        markers[rows, cols] = label
    return markers


def same_partition(a, b):
    pairs = np.unique(np.stack([a.ravel(), b.ravel()]), axis=1)
    return len(np.unique(pairs[0])) == len(np.unique(pairs[1])) == pairs.shape[1]


LEFT, RIGHT = np.s_[:, :58], np.s_[:, 63:]


class TestGrowing:
    @pytest.mark.parametrize("slope", [0.3, 1.0, 3.0])
    def test_roof(self, slope):
        src = noisy(columns(slope * np.abs(X - 60)))
        markers = markers_at(src.shape, (slice(30, 50), slice(20, 40)), (slice(30, 50), slice(80, 100)))
        labels = growRegions(src, markers, noise=SIGMA)
        one_region_each(labels, LEFT, RIGHT)
        assert labels.dtype == np.int32
        assert labels.max() == 2

    def test_step_without_edges_is_not_crossed(self):
        labels = growRegions(STEP, markers_at(STEP.shape, (slice(30, 50), slice(10, 30))), noise=SIGMA)
        assert (labels[:, :50] == 1).all()
        assert not labels[:, 51:].any()

    def test_edges_are_not_crossed(self):
        src = noisy(columns(0.2 * X))
        edges = np.zeros(src.shape, np.uint8)
        edges[:, 60] = 255
        labels = growRegions(src, markers_at(src.shape, (slice(30, 50), slice(10, 30))), edges=edges, noise=SIGMA)
        assert labels[:, :60].all()
        free = growRegions(src, markers_at(src.shape, (slice(30, 50), slice(10, 30))), noise=SIGMA)
        assert free.all()

    def test_markers_of_one_plane_merge(self):
        src = noisy(columns(0.5 * X))
        markers = markers_at(src.shape, (slice(0, 20), slice(0, 20)), (slice(60, 80), slice(90, 120)))
        assert (growRegions(src, markers, noise=SIGMA) == 1).all()

    def test_marker_on_two_planes_is_cut(self):
        markers = np.zeros(ROOF.shape, np.int32)
        markers[20:60, 35:85] = 1
        one_region_each(growRegions(ROOF, markers, noise=SIGMA), LEFT, RIGHT)

    def test_leak_through_a_gap_is_cut(self):
        src = noisy(columns(0.35 * np.abs(X - 60)))
        edges = np.zeros(src.shape, np.uint8)
        edges[:, 60] = 255
        edges[30:50, 60] = 0
        markers = markers_at(src.shape, (slice(30, 50), slice(20, 40)))
        one_region_each(growRegions(src, markers, edges=edges, noise=SIGMA, newSeeds=True), LEFT, RIGHT)

    def test_curved_surface_is_one_region(self):
        src = noisy(columns(0.02 * (X - 60) ** 2))
        markers = markers_at(src.shape, (slice(30, 50), slice(10, 25)), (slice(30, 50), slice(55, 70)))
        assert (growRegions(src, markers, noise=SIGMA, newSeeds=True) == 1).mean() > 0.99

    def test_new_seeds_reach_what_markers_do_not(self):
        markers = markers_at(STEP.shape, (slice(30, 50), slice(10, 30)))
        one_region_each(growRegions(STEP, markers, noise=SIGMA, newSeeds=True), np.s_[:, :50], np.s_[:, 50:])

    def test_edges_too_dense_to_be_any(self):
        # A face of which half the pixels are edges, as of a surface seen at a grazing angle.
        edges = np.zeros(STEP.shape, np.uint8)
        edges[:, 50:] = np.random.default_rng(1).random((80, 70)) < 0.5
        markers = markers_at(STEP.shape, (slice(30, 50), slice(10, 30)))
        labels = growRegions(STEP, markers, edges=edges, noise=SIGMA, newSeeds=True)
        one_region_each(labels, np.s_[:, :50], np.s_[:, 50:])
        assert not growRegions(STEP, markers, edges=edges, noise=SIGMA)[:, 50:].any()

    @pytest.mark.parametrize(("width", "regions"), [(6, 2), (8, 2), (9, 2), (16, 3), (24, 3)])
    def test_narrow_strip_goes_on_around_a_bend(self, width, regions):
        row, col = np.mgrid[:80, :80].astype(float)
        across = np.minimum(row - 10, 69 - col)  # from the outer side of an L
        strip = (across >= 0) & (across < width) & (col >= 10) & (row < 70)
        outline = strip & ~cv2.erode(strip.astype(np.uint8), np.ones((3, 3))).astype(bool)
        height = noisy(np.where(strip, 50 + 4 * across, 0.0))
        labels = segmentRegions(height, edges=outline, noise=SIGMA)
        along_row, along_col = labels[10 + width // 2, 30], labels[50, 69 - width // 2]
        assert len({labels[0, 0], along_row, along_col}) == regions

    @pytest.mark.parametrize("tolerance", [2.0, 3.0, 4.0])
    def test_a_small_face_that_is_hardly_raised_belongs_to_the_one_around_it(self, tolerance):
        markers = markers_at(STEP.shape, (slice(5, 25), slice(10, 110)), (slice(42, 52), slice(52, 62)))
        for raised, count in ((2.5, 1), (3.7, 2)):  # tolerances
            face = np.zeros(STEP.shape)
            face[40:54, 50:64] = raised * tolerance * SIGMA
            assert growRegions(noisy(face), markers, heightMap=True, noise=SIGMA, tolerance=tolerance).max() == count

    def test_a_strip_stays_where_edges_part_it_from_what_is_beside_it(self):
        # Too steep to go on into the planes on either side, and all within twice the tolerance of these.
        profile = columns(np.where(np.abs(X - 60) < 4, 0.5 * (X - 60), 0), 100)
        src = profile + np.random.default_rng(0).normal(0, 0.33, profile.shape)
        strip = slice(5, 95), slice(58, 63)
        markers = markers_at(src.shape, (slice(10, 90), slice(10, 50)), (slice(10, 90), slice(70, 110)), strip)
        for open_rows, stays in ((10, True), (26, False), (60, False)):
            edges = np.zeros(src.shape, np.uint8)
            edges[open_rows:, [56, 64]] = 255
            labels = growRegions(src, markers, edges=edges, heightMap=True, noise=0.33)
            own = np.bincount(labels[strip].ravel()).argmax()
            assert (np.count_nonzero(labels == own) < 1000) == stays

    def test_waves_of_the_noise_count_up_to_a_bound(self):
        # Eight times what neighbours differ by: of two planes with waves, those within 36 deviations are one.
        rng = np.random.default_rng(0)
        waves = cv2.resize(rng.normal(0, 1, (26, 31)), (120, 100), interpolation=cv2.INTER_CUBIC)
        src = 12 * waves / waves.std() + rng.normal(0, 1, waves.shape)
        markers = markers_at(src.shape, (slice(5, 95), slice(5, 55)), (slice(5, 95), slice(65, 115)))
        for step, count in ((30, 1), (45, 2)):
            assert growRegions(src + step * (X >= 60), markers, heightMap=True, noise=1.0).max() == count

    @pytest.mark.parametrize(("off", "labelled"), [(9, True), (15, False)])
    def test_pixels_of_edges_may_lie_farther_off(self, off, labelled):
        src = noisy(columns(0.1 * X))
        src[20:60:4, 60] += off * SIGMA
        edges = np.zeros(src.shape, np.uint8)
        edges[:, 60] = 255
        labels = growRegions(src, markers_at(src.shape, (slice(10, 70), slice(10, 110))), edges=edges, noise=SIGMA)
        assert (labels[20:60:4, 60] > 0).all() == labelled

    def test_borders_move_to_where_surfaces_meet(self):
        # The edge is drawn beside the ridge, up to where pixels lie off the wrong plane by more than the tolerance.
        src = columns(np.where(X > 60, 0.25 * (X - 60), 0), 100)
        src += np.random.default_rng(0).normal(0, 0.5, src.shape)
        markers = markers_at(src.shape, (slice(10, 90), slice(10, 50)), (slice(10, 90), slice(75, 110)))
        edges = np.zeros(src.shape, np.uint8)
        edges[:, 67] = 255
        labels = growRegions(src, markers, edges=edges, heightMap=True, noise=0.5)
        assert abs(np.mean((labels == 1).sum(axis=1)) - 60) < 3

    def test_edges_on_a_smooth_surface_do_not_part_it(self):
        src = noisy(columns(0.2 * X))
        edges = np.zeros(src.shape, np.uint8)
        edges[:, 60] = 255
        markers = markers_at(src.shape, (slice(30, 50), slice(10, 30)), (slice(30, 50), slice(90, 110)))
        assert (growRegions(src, markers, edges=edges, noise=SIGMA) == 1).all()

    @pytest.mark.parametrize("seed", range(3))
    def test_noise_with_long_waves(self, seed):
        # Neighbours err together over some 10 pixels, by 5 times what each errs by itself; markers are no larger.
        rng = np.random.default_rng(seed)
        waves = cv2.GaussianBlur(rng.normal(size=(160, 240)), (0, 0), 5)
        src = columns(0.1 * np.arange(240), 160) + 5 * SIGMA * waves / waves.std() + rng.normal(0, SIGMA, waves.shape)
        rows, cols = np.indices(src.shape)
        markers = np.where((rows % 20 < 10) & (cols % 20 < 10), 1 + rows // 20 * 12 + cols // 20, 0).astype(np.int32)
        assert (growRegions(src, markers, noise=SIGMA, newSeeds=True) == 1).mean() > 0.99

    def test_no_markers(self):
        assert not growRegions(STEP, np.zeros(STEP.shape, np.int32)).any()

    def test_negative_markers_are_none(self):
        assert not growRegions(STEP, np.full(STEP.shape, -1, np.int32)).any()

    def test_outliers_fit_nothing(self):
        src = STEP.copy()
        src[10:14, 10:14] += np.arange(16).reshape(4, 4) * 7 + 50
        labels = growRegions(src, markers_at(src.shape, (slice(30, 50), slice(10, 30))), noise=SIGMA, newSeeds=True)
        assert not labels[10:14, 10:14].any()

    def test_small_regions_fall_away(self):
        src = STEP.copy()
        src[20:29, 20:29] += 30  # 81 pixels
        markers = markers_at(src.shape, (slice(50, 70), slice(10, 30)), (slice(22, 27), slice(22, 27)))
        assert growRegions(src, markers, noise=SIGMA, minArea=50)[24, 24] > 0
        assert growRegions(src, markers, noise=SIGMA, minArea=100)[24, 24] == 0
        area = np.count_nonzero(growRegions(src, markers, noise=SIGMA, minArea=50)[20:29, 20:29] == 2)
        for least, stays in ((area, True), (area + 1, False)):
            assert (growRegions(src, markers, noise=SIGMA, minArea=least)[24, 24] == 2) == stays

    def test_invalid_pixels_have_no_label(self):
        src = ROOF.copy()
        src[:, 30:34] = np.nan
        labels = segmentRegions(src, noise=SIGMA)
        assert not labels[:, 30:34].any()
        assert labels[np.isfinite(src)].all()


class TestSegmentation:
    def test_step_and_roof(self):
        one_region_each(segmentRegions(STEP), np.s_[:, :50], np.s_[:, 50:])
        one_region_each(segmentRegions(ROOF), LEFT, RIGHT)

    def test_no_data(self):
        assert not segmentRegions(np.full((20, 30), np.nan)).any()
        assert not segmentRegions(np.zeros((20, 30), np.uint16), K=np.eye(3)).any()

    def test_without_noise(self):
        one_region_each(segmentRegions(columns(np.abs(X - 60))), LEFT, RIGHT)
        assert (segmentRegions(np.ones((30, 40))) == 1).all()

    def test_regions_are_connected_and_in_raster_order(self):
        scan = kinectNoise(renderScene(polyhedraScene(3, kinectCamera()), kinectCamera()), seed=3)
        labels = segmentRegions(scan.src, **scan.geometry)
        assert not labels[scan.src == 0].any()
        names, first = np.unique(labels, return_index=True)
        assert names.tolist() == list(range(labels.max() + 1))
        assert (np.diff(first[1:]) > 0).all()
        for k in names[1:]:
            assert cv2.connectedComponents((labels == k).view(np.uint8), connectivity=4)[0] == 2

    def test_deterministic_for_any_number_of_threads(self):
        threads = cv2.getNumThreads()
        results = []
        try:
            for n in (1, 2, 3):
                cv2.setNumThreads(n)
                results.append(segmentRegions(ROOF))
        finally:
            cv2.setNumThreads(threads)
        assert all(np.array_equal(results[0], r) for r in results)

    def test_many_threads_cost_little_where_growth_is_slow(self):
        """A path of three pixels across, along which thousands of rounds have a pixel or two each."""
        depth = 1 + 0.001 * np.random.default_rng(0).standard_normal((800, 800))
        walls, markers = np.zeros(depth.shape, np.uint8), np.zeros(depth.shape, np.int32)
        walls[3::8, :-3] = walls[7::8, 3:] = 255
        markers[:3, :6] = 1
        threads, seconds, results = cv2.getNumThreads(), [], []
        try:
            for n in (1, 128):
                cv2.setNumThreads(n)
                start = time.process_time()
                results.append(growRegions(depth, markers, edges=walls, pixelSize=0.01, noise=0.002))
                seconds.append(time.process_time() - start)
        finally:
            cv2.setNumThreads(threads)
        assert np.array_equal(*results)
        assert seconds[1] < seconds[0] + 1.5

    @pytest.mark.parametrize("scene", [polyhedraScene, curvedScene])
    def test_threads_share_large_images(self, scene):
        camera = kinectCamera()
        scan = kinectNoise(renderScene(scene(5, camera), camera), seed=5)
        threads = cv2.getNumThreads()
        try:
            results = []
            for n in (1, 2, 5):
                cv2.setNumThreads(n)
                results.append(segmentRegionsWithStats(scan.src, **scan.geometry))
        finally:
            cv2.setNumThreads(threads)
        for result in results[1:]:
            for found, expected in zip(result, results[0], strict=True):
                assert np.array_equal(found, expected)

    def test_integers_as_floats(self):
        pair = planePair((0.5, 0, -1), (-0.5, 0, -1), point=(0, 0, 1))
        millimetres = kinectNoise(renderScene(pair, CAMERA), seed=1, holes=0).src
        metres = np.where(millimetres > 0, millimetres / np.float32(1000), np.nan).astype(np.float32)
        K = CAMERA.geometry["K"]
        expected = segmentRegions(millimetres, K=K)
        assert expected.max() == 2
        assert np.array_equal(segmentRegions(metres, K=K), expected)

    def test_mask(self):
        mask = np.ones(ROOF.shape, bool)
        mask[:, :20] = False
        masked = np.where(mask, ROOF, np.nan)
        labels = segmentRegions(ROOF, mask=mask, noise=SIGMA)
        assert not labels[~mask].any()
        assert np.array_equal(labels, segmentRegions(masked, noise=SIGMA))

    def test_height_map_is_negative_depth(self):
        assert np.array_equal(segmentRegions(-ROOF, heightMap=True), segmentRegions(ROOF))

    def test_unit_does_not_matter(self):
        expected = segmentRegions(ROOF, noise=SIGMA)
        assert np.array_equal(segmentRegions(1024 * ROOF, pixelSize=1024, noise=1024 * SIGMA), expected)
        assert np.array_equal(segmentRegions(ROOF, noise=NoiseModel(a=SIGMA)), expected)

    @pytest.mark.parametrize("turn", [np.fliplr, np.flipud, np.transpose], ids=["fliplr", "flipud", "transpose"])
    def test_symmetric_up_to_ties(self, turn):
        edges = np.zeros(ROOF.shape, np.uint8)
        edges[:, 60] = 255
        expected = turn(segmentRegions(ROOF, noise=SIGMA, edges=edges))
        found = segmentRegions(np.ascontiguousarray(turn(ROOF)), noise=SIGMA, edges=np.ascontiguousarray(turn(edges)))
        agreeing = turn(edges) == 0
        assert same_partition(found[agreeing], expected[agreeing])

    def test_inputs_untouched_and_any_layout(self):
        src = np.asfortranarray(ROOF)
        before = src.copy()
        assert np.array_equal(segmentRegions(src), segmentRegions(ROOF))
        assert np.array_equal(src, before)
        assert np.array_equal(segmentRegions(np.repeat(ROOF, 2, axis=1)[:, ::2]), segmentRegions(ROOF))

    def test_points_as_depth(self):
        rendering = renderScene(planePair((0.5, 0, -1), (-0.5, 0.2, -1), point=(0, 0, 1)), CAMERA)
        depth = gaussianNoise(rendering, 0.002, seed=1)
        (u, v), z, K = np.meshgrid(np.arange(160), np.arange(120)), depth.src, depth.geometry["K"]
        points = np.stack([(u - K[0, 2]) * z / K[0, 0], (v - K[1, 2]) * z / K[1, 1], z], axis=-1)
        truth = rendering.labels
        for labels in (segmentRegions(depth.src, **depth.geometry), segmentRegions(points.astype(np.float32))):
            assert hooverScores(labels, truth).correct == truth.max() == labels.max()

    @pytest.mark.parametrize("offset", [1e4, 5e5, 5e6])
    def test_large_offsets_of_doubles(self, offset):
        # As in UTM coordinates: the offset costs no resolution.
        height = columns(np.where(X < 50, 0.0, 0.01)) + np.random.default_rng(0).normal(0, 0.0005, (80, 120))
        assert segmentRegions(height, heightMap=True, noise=0.0005).max() == 2
        labels = segmentRegions(offset + height, heightMap=True, noise=0.0005)
        one_region_each(labels, np.s_[:, :49], np.s_[:, 51:])

    def test_large_offset_of_singles_is_rounding(self):
        # Multiples of 0.5 around a slope of 0.1: one plane, since nobody can know better.
        plane = (5e6 + columns(0.1 * X)).astype(np.float32)
        assert (segmentRegions(plane, heightMap=True, noise=1e-3) == 1).all()

    def test_pixels_without_data_are_far_from_seeds(self, monkeypatch):
        # A gap of 9 columns, too wide to be bridged: seeds keep their distance from it as from an edge.
        src = columns(0.1 * X)
        src[:, 40:49] = np.nan
        seen = []
        monkeypatch.setattr("rangeedge.regions.find_seeds", lambda d, *a: seen.append(d) or find_seeds(d, *a))
        segmentRegions(src, noise=SIGMA, edges=np.zeros(src.shape, np.uint8))
        assert seen[0][40, [38, 39, 40, 48, 49, 50]].tolist() == [2, 1, 0, 0, 1, 2]

    def test_skew_of_the_camera_matters(self):
        # A face-on plane, and one turned about the vertical axis, meet without an edge: one surface up to 8 degrees.
        rows, cols = np.mgrid[:120, :160]
        pixels = np.stack([cols.ravel(), rows.ravel(), np.ones(cols.size)])
        markers = markers_at(cols.shape, (slice(30, 90), slice(20, 60)), (slice(30, 90), slice(100, 140)))
        for skew in (0.0, 100.0):
            K = CAMERA.geometry["K"].copy()
            K[0, 1] = skew
            x = (np.linalg.inv(K) @ pixels)[0].reshape(cols.shape)
            x -= x[60, 80]  # the planes meet in the middle
            for degrees, count in ((6.5, 1), (9.5, 2)):
                turned = 1 + np.tan(np.radians(degrees)) * x  # inverse depth
                depth = 1 / np.where(x > 0, turned, 1) + np.random.default_rng(3).normal(0, 1e-4, x.shape)
                assert growRegions(depth, markers, K=K, noise=1e-4).max() == count

    def test_one_marker_beside_thousands(self):
        # Cells that touch one long region alone, and join it: linear in their number.
        src = np.zeros((400, 480))
        rows, cols = np.indices(src.shape)
        inside = rows % 8 > 0
        src[inside & (cols % 8 == 7)] = np.nan
        markers = np.where(inside, 2 + (rows // 8) * 60 + cols // 8, 1).astype(np.int32)
        labels = growRegions(src, markers, noise=0.01)
        assert (labels == np.isfinite(src)).all()


class TestSurfaces:
    def test_planes(self):
        rendering = renderScene(planePair((0.5, 0, -1), (-0.5, 0.2, -1), point=(0, 0, 1)), CAMERA)
        K = rendering.camera.geometry["K"]
        scan = gaussianNoise(rendering, 0.002, seed=1)
        count, labels, stats, centroids, surfaces = segmentRegionsWithStats(scan.src, K=K)
        assert count == len(stats) == len(centroids) == len(surfaces) == 3
        assert np.array_equal(stats[:, cv2.CC_STAT_AREA], np.bincount(labels.ravel(), minlength=3))
        for k in (1, 2):
            inside = labels == k
            expected = rendering.normals[inside].mean(axis=0)
            s = surfaces[k]
            assert not s["curved"]
            assert s["normal"] @ expected > np.cos(np.radians(1.0)) * np.linalg.norm(expected)
            assert np.allclose(s["quadric"][:6], 0)
            points = rendering.points[inside]
            assert np.abs(points @ s["quadric"][6:9] + s["quadric"][9]).mean() < 0.001
            assert 0.001 < s["rms"] < 0.003
            assert np.allclose(centroids[k], np.argwhere(inside)[:, ::-1].mean(axis=0))

    def test_sphere(self):
        rendering = renderScene([sphere((0.05, 0, 1.0), 0.3)], CAMERA)
        scan = gaussianNoise(rendering, 0.001, seed=1)
        markers = np.zeros(rendering.depth.shape, np.int32)
        markers[50:70, 75:95] = 1
        count, labels, _, _, surfaces = growRegionsWithStats(scan.src, markers, newSeeds=True, **scan.geometry)
        assert count == 2
        assert (labels > 0).sum() > 0.95 * np.isfinite(scan.src).sum()
        q = surfaces["quadric"][1]
        assert surfaces["curved"][1]
        assert np.allclose(q[1:3] / q[0], 1, atol=0.1)
        assert np.allclose(-q[6:9] / (2 * q[:3]), (0.05, 0, 1.0), atol=0.02)
        assert surfaces["rms"][1] < 0.003

    def test_height_map_and_grid(self):
        height = noisy(columns(0.5 * X))
        _, _, _, _, surfaces = segmentRegionsWithStats(height, heightMap=True, pixelSize=(2.0, 1.0), noise=SIGMA)
        normal = np.array([-0.25, 0, 1]) / np.hypot(0.25, 1)
        assert np.allclose(surfaces["normal"][1], normal, atol=1e-3)
        _, _, _, _, surfaces = segmentRegionsWithStats(height, pixelSize=(2.0, 1.0), noise=SIGMA)
        assert np.allclose(surfaces["normal"][1], (0.25 / np.hypot(0.25, 1), 0, -1 / np.hypot(0.25, 1)), atol=1e-3)

    @pytest.mark.filterwarnings("error")
    @pytest.mark.parametrize("pixelSize", [1e300, 1e-300, (1e-200, 1e200), (1e300, 1e-300)])
    def test_extreme_scales(self, pixelSize):
        plane = np.arange(3000.0).reshape(50, 60)
        count, _, stats, _, surfaces = segmentRegionsWithStats(plane, pixelSize=pixelSize, noise=1.0)
        assert (count, stats[1, cv2.CC_STAT_AREA]) == (2, 3000)
        assert np.isfinite(surfaces["rms"]).all()
        assert np.linalg.norm(surfaces["normal"][1]) == pytest.approx(1)

    def test_against_direct_fits(self):
        # Plane and quadric of each region from its points, once more and one by one.
        camera = abwCamera()
        scan = abwNoise(renderScene(curvedScene(4, camera), camera), seed=4)
        count, labels, stats, centroids, surfaces = segmentRegionsWithStats(scan.src, **scan.geometry)
        v, u = np.indices(labels.shape)
        points = read_frame(scan.src, ScanLineParams(**scan.geometry)).points
        assert surfaces["curved"].any()
        for k in range(1, count):
            inside = labels == k
            p = points[inside]
            assert np.allclose(surfaces["centroid"][k], p.mean(axis=0))
            assert np.allclose(centroids[k], (u[inside].mean(), v[inside].mean()))
            assert stats[k].tolist() == [
                u[inside].min(), v[inside].min(), np.ptp(u[inside]) + 1, np.ptp(v[inside]) + 1, inside.sum()
            ]  # fmt: skip
            x, y, z = p.T
            columns = np.stack([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z, np.ones_like(x)])
            q = surfaces["quadric"][k]
            a, b, c, d, e, f, g, h, i, _ = q
            gradient = np.stack([2*a*x + d*y + e*z + g, d*x + 2*b*y + f*z + h, e*x + f*y + 2*c*z + i])  # fmt: skip
            length = np.linalg.norm(gradient, axis=0)
            distance = q @ columns / np.maximum(length, 0.01)
            assert np.sqrt(np.mean(length**2)) == pytest.approx(1, rel=1e-3)
            assert surfaces["rms"][k] == pytest.approx(np.sqrt(np.mean(distance**2)), rel=1e-3)
            if not surfaces["curved"][k]:
                singular = np.linalg.svd(p - p.mean(axis=0), compute_uv=False)[2]
                assert surfaces["rms"][k] == pytest.approx(singular / np.sqrt(len(p)), rel=1e-5)

    def test_nothing(self):
        count, labels, stats, centroids, surfaces = segmentRegionsWithStats(np.full((5, 6), np.nan))
        assert (count, len(stats), len(centroids), len(surfaces)) == (1, 1, 1, 1)
        assert not labels.any()
        assert surfaces["rms"][0] == 0


def scores(scene, camera, noise, seeds):
    """Summed over scenes; true parts of which the scanner sees fewer than 100 pixels are left out."""
    total = []
    for seed in seeds:
        rendering = renderScene(scene(seed, camera), camera)
        scan = noise(rendering, seed=seed)
        seen = np.isfinite(scan.src[..., 2]) if scan.src.ndim == 3 else scan.src > 0
        truth = np.where(seen, rendering.labels, 0)
        truth[(np.bincount(truth.ravel()) < 100)[truth]] = 0
        total.append(hooverScores(segmentRegions(scan.src, **scan.geometry), truth, ignore=truth == 0))
    return sum(total[1:], total[0])


@pytest.mark.parametrize(
    ("camera", "noise"),
    [(abwCamera(), abwNoise), (perceptronCamera(), perceptronNoise), (kinectCamera(), kinectNoise)],
    ids=["abw", "perceptron", "kinect"],
)
class TestRenderedScenes:
    def test_polyhedra(self, camera, noise):
        s = scores(polyhedraScene, camera, noise, [11])
        assert s.correct >= 0.9 * s.truth
        assert s.under <= 1
        assert s.noise <= 1

    def test_curved(self, camera, noise):
        s = scores(curvedScene, camera, noise, [11])
        assert s.correct >= 0.7 * s.truth


@pytest.mark.parametrize(("side", "curved"), [(6, False), (8, True)])
def test_few_pixels_tell_no_curvature(side, curved):
    y, x = np.mgrid[:20, :20]
    labels = np.zeros((20, 20), np.int32)
    labels[5 : 5 + side, 5 : 5 + side] = 1
    frame = read_frame(0.1 * ((x - 8.0) ** 2 + (y - 8.0) ** 2), ScanLineParams(heightMap=True))
    assert surfaces_of(frame, labels, 2)["curved"].tolist() == [False, curved]


@pytest.mark.parametrize("share", [0.75, 0.85])
def test_a_surface_is_curved_if_a_fifth_less_is_left_than_by_a_plane(share):
    y, x = np.mgrid[-10:10, -10:10] + 0.5
    chequered, bulge = (-1.0) ** (x + y), x**2 - np.mean(x**2)
    bulge *= np.sqrt(1 / share**2 - 1) / np.sqrt(np.mean(bulge**2))
    labels, curved = np.ones(x.shape, np.int32), [False, share < 0.8]
    frame = read_frame(chequered + bulge + 0.3 * x + 100, ScanLineParams(heightMap=True))
    assert surfaces_of(frame, labels, 2)["curved"].tolist() == curved
    # Seen from within: of inverse distances over rays.
    rays = np.stack([x / 20, y / 20, np.ones(x.shape)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    terms = rays.reshape(-1, 3)
    products = np.stack([terms[:, i] * terms[:, j] for i in range(3) for j in range(i, 3)], axis=1)
    whole = np.column_stack([terms, products])
    noise, bend = chequered.ravel(), products[:, 0]
    noise = noise - whole @ np.linalg.lstsq(whole, noise, rcond=None)[0]
    bend = bend - terms @ np.linalg.lstsq(terms, bend, rcond=None)[0]
    bend *= np.sqrt(1 / share**2 - 1) * np.linalg.norm(noise) / np.linalg.norm(bend)
    inverse = (terms @ (0.2, 0, 1) + 1e-3 * (noise + bend)).reshape(x.shape)
    around = SimpleNamespace(samples=rays / inverse[..., None])
    assert _curved(around, labels, 2).tolist() == curved


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # the loader leaves a file open
def test_real_faces(load, score):
    counts = []
    for name in load.mosd_faces_names(complete=True)[:4]:
        frame = load.mosd_faces(name)
        labels = segmentRegions(frame["z"], K=score.matrix(frame["K"]))
        ignored = ~np.isfinite(frame["z"]) | (frame["label"] == 0)
        counts.append(score.hoover(labels, frame["label"], ignore=ignored))
    total = {k: sum(c[k] for c in counts) for k in counts[0]}
    assert total["correct"] >= 0.85 * total["truth"]
    assert total["noise"] <= 2
    assert total["under"] <= 1


BAD_FIELDS = [
    ({"tolerance": 0.0}, "tolerance"),
    ({"smoothAngle": 31}, "smoothAngle"),
    ({"minArea": 0}, "minArea"),
    ({"minArea": 1.5}, "minArea"),
    ({"noise": -1.0}, "noise"),
    ({"noise": np.ones((3, 3))}, "noise"),
    ({"edges": np.zeros((3, 3), np.uint8)}, "edges"),
    ({"mask": np.zeros((3, 3), np.uint8)}, "mask"),
    ({"K": np.zeros((2, 2))}, "K"),
]


@pytest.mark.parametrize(
    ("options", "name"), [*BAD_FIELDS, ({"minDistance": 0}, "minDistance"), ({"separation": 1}, "separation")]
)
def test_errors_of_segmentation(options, name):
    for function in (segmentRegions, segmentRegionsWithStats):
        with pytest.raises(rangeedge.error, match=f"{function.__name__}: `{name}`"):
            function(np.ones((20, 30), np.float32), **options)


@pytest.mark.parametrize("options", [{"tolerance": 0}, {"minArea": 0}, {"separation": 1.0}])
def test_parameters_are_checked_before_anything_is_computed(options, monkeypatch):
    for name in ("measured_frame", "run_detector"):
        monkeypatch.setattr(f"rangeedge.regions.{name}", lambda *_: pytest.fail("computed"))
    with pytest.raises(rangeedge.error, match=f"`{next(iter(options))}`"):
        segmentRegions(np.ones((20, 30), np.float32), **options)


@pytest.mark.parametrize(
    ("options", "name"),
    [*BAD_FIELDS, ({"newSeeds": 1}, "newSeeds"), ({"markers": np.zeros((20, 30))}, "markers"),
     ({"markers": np.zeros((20, 31), np.int32)}, "markers"), ({"src": [[1.0]]}, "src")],
)  # fmt: skip
def test_errors_of_growing(options, name):
    arguments = {"src": np.ones((20, 30), np.float32), "markers": np.zeros((20, 30), np.int32)} | options
    for function in (growRegions, growRegionsWithStats):
        with pytest.raises(rangeedge.error, match=f"{function.__name__}: `{name}`"):
            function(**arguments)
