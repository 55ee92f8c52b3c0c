"""Seeds: peaks of distance maps, against a readable oracle and the watersheds that take them."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge.distance import distanceTransform, salienceDistanceTransform
from rangeedge.seeds import extractSeeds, extractSeedsWithStats


def oracle(distance, min_distance, separation):
    """Seeds as a set of pixel sets: the component of each peak that no path leaves above its level."""
    found = set()
    for level in np.unique(distance[distance >= min_distance]):
        above = (distance >= np.float32(separation) * np.float32(level)) & (distance > 0)
        count, labels = cv2.connectedComponents(above.astype(np.uint8), connectivity=8)
        for k in range(1, count):
            if distance[labels == k].max() == level:
                found.add(frozenset(np.flatnonzero(labels == k).tolist()))
    return found


def as_sets(markers):
    return {frozenset(np.flatnonzero(markers == k).tolist()) for k in range(1, markers.max() + 1)}


def random_edges(seed, shape=(40, 50), share=0.03):
    return np.random.default_rng(seed).random(shape) < share


class TestHandCases:
    def test_two_peaks_apart(self):
        distance = np.float32([[0, 1, 2, 3, 2, 1, 2, 3, 4, 3, 2, 1, 0]])
        count, markers = extractSeeds(distance, minDistance=2, separation=0.75)
        assert count == 3
        assert markers.tolist() == [[0, 0, 0, 1, 0, 0, 0, 2, 2, 2, 0, 0, 0]]

    def test_shallow_saddle_joins(self):
        distance = np.float32([[0, 4, 3, 5, 0]])
        assert extractSeeds(distance, separation=0.7)[0] == 2  # 3 >= 0.7 * 4
        assert extractSeeds(distance, separation=0.8)[0] == 3

    def test_saddle_at_the_level_joins(self):
        assert extractSeeds(np.float32([[0, 4, 3, 4, 0]]), separation=0.75)[0] == 2

    def test_min_distance_is_reached_by_equality(self):
        distance = np.float32([[0, 3, 0, 2.9, 0]])
        assert extractSeeds(distance, minDistance=3)[1].tolist() == [[0, 1, 0, 0, 0]]

    def test_diagonal_paths_count(self):
        distance = np.float32([[4, 0], [0, 4]])
        assert extractSeeds(distance)[0] == 2

    def test_plateau_is_one_seed(self):
        _, markers = extractSeeds(np.full((5, 6), 4, np.float32))
        assert (markers == 1).all()

    def test_no_edges_at_all(self):
        _, markers = extractSeeds(distanceTransform(np.zeros((6, 7), np.uint8)))
        assert (markers == 1).all()

    def test_separation_that_vanishes(self):
        # 0 in single precision: nothing lies lower than no pixel at all, not even beside infinity.
        distance = distanceTransform(np.zeros((40, 60), np.uint8))
        assert (extractSeeds(distance, separation=1e-60)[1] == 1).all()
        distance[:, 30] = 0
        expected = np.ones((40, 60), np.int32)
        expected[:, 30], expected[:, 31:] = 0, 2
        assert np.array_equal(extractSeeds(distance, separation=1e-60)[1], expected)
        assert rangeedge.segmentRegions(np.ones((40, 60)), separation=1e-60).max() == 1

    def test_nothing(self):
        count, markers = extractSeeds(np.zeros((3, 4), np.float32))
        assert count == 1
        assert not markers.any()

    def test_a_gap_in_a_wall_does_not_join(self):
        edges = np.zeros((60, 120), np.uint8)
        edges[[0, -1]] = edges[:, [0, -1]] = edges[:, 60] = 255
        edges[25:35, 60] = 0
        count, markers = extractSeeds(distanceTransform(edges))
        assert count == 3
        assert set(np.unique(markers[:, :60])) == {0, 1}


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("separation", [0.4, 0.65, 0.9])
def test_oracle(seed, separation):
    distance = distanceTransform(random_edges(seed))
    _, markers = extractSeeds(distance, minDistance=2.0, separation=separation)
    assert as_sets(markers) == oracle(distance, 2.0, separation)


@pytest.mark.parametrize("seed", range(4))
def test_oracle_with_ties_and_mask(seed):
    # Few values, so that plateaus and equal passes abound.
    rng = np.random.default_rng(seed)
    distance = cv2.blur(rng.random((30, 40), np.float32), (5, 5))
    distance = np.round((distance - distance.min()) * 20).astype(np.float32)
    mask = rng.random(distance.shape) < 0.95
    _, markers = extractSeeds(distance, minDistance=2.0, separation=0.5, mask=mask)
    assert as_sets(markers) == oracle(np.where(mask, distance, 0), 2.0, 0.5)


@pytest.mark.parametrize("threads", [1, 5])
@pytest.mark.parametrize("seed", range(2))
def test_ways_uphill_that_cross_the_rows_of_every_thread(seed, threads):
    smooth = cv2.GaussianBlur(np.random.default_rng(seed).random((60, 300)), (0, 0), 8)
    distance = (200 * (smooth - smooth.min())).astype(np.float32)
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    try:
        markers = extractSeeds(distance, minDistance=2.0, separation=0.8)[1]
    finally:
        cv2.setNumThreads(before)
    assert as_sets(markers) == oracle(distance, 2.0, 0.8)


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("seed", range(3))
def test_wrap_knows_no_first_column(seed, threads):
    # Few values, so that plateaus and ties lie across the seam; large enough for every thread to get some rows.
    rng = np.random.default_rng(seed)
    smooth = cv2.GaussianBlur(rng.random((64, 301)), (0, 0), 3, borderType=cv2.BORDER_REFLECT)
    distance = np.round(60 * (smooth - smooth.min()))[:, 20:-20].astype(np.float32)
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    try:
        found = [
            as_sets(relabelled(np.roll(extractSeeds(np.roll(distance, k, 1), wrap=True)[1], -k, 1)))
            for k in (0, 1, 2, 77)
        ]
    finally:
        cv2.setNumThreads(before)
    assert len(found[0]) > 2
    assert all(sets == found[0] for sets in found[1:])


def test_threads_do_not_matter():
    distance = distanceTransform(random_edges(7, (300, 400), 0.002))
    threads = cv2.getNumThreads()
    try:
        results = []
        for n in (1, 2, 7):
            cv2.setNumThreads(n)
            results.append(extractSeeds(distance)[1])
    finally:
        cv2.setNumThreads(threads)
    assert results[0].max() > 20
    assert all(np.array_equal(results[0], r) for r in results)


@pytest.mark.skipif(sys.platform != "linux", reason="the peak is in other units elsewhere, or unknown")
def test_many_threads_share_their_memory():
    """Of some 400 000 seeds: by how many MiB the peak rises."""
    code = f"""
import resource, sys
sys.path.insert(0, {str(Path(rangeedge.__file__).parents[1])!r})
import cv2
import numpy as np
from rangeedge import extractSeeds
distance = np.random.default_rng(0).random((2000, 2000), np.float32)
cv2.setNumThreads(128)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
count, _ = extractSeeds(distance, minDistance=0.01, separation=0.999)
assert count > 400_000
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(run.stdout) < 120


@pytest.mark.parametrize("seed", range(3))
def test_oracle_on_salience(seed):
    rng = np.random.default_rng(seed)
    salience = np.where(random_edges(seed), rng.integers(20, 256, (40, 50)), 0).astype(np.uint8)
    distance = salienceDistanceTransform(salience)
    _, markers = extractSeeds(distance, minDistance=4.0)
    assert as_sets(markers) == oracle(distance, 4.0, 0.65)


class TestProperties:
    distance = distanceTransform(random_edges(11, (80, 90)))

    def test_numbered_in_raster_order(self):
        count, markers = extractSeeds(self.distance)
        labels, first = np.unique(markers, return_index=True)
        assert labels.tolist() == list(range(count))
        assert (np.diff(first[1:]) > 0).all()

    @pytest.mark.parametrize("turn", [np.flipud, np.fliplr, np.transpose], ids=["flipud", "fliplr", "transpose"])
    def test_symmetric(self, turn):
        _, markers = extractSeeds(self.distance)
        _, turned = extractSeeds(np.ascontiguousarray(turn(self.distance)))
        assert as_sets(turned) == as_sets(relabelled(turn(markers)))

    def test_scale(self):
        _, markers = extractSeeds(self.distance)
        _, scaled = extractSeeds(4 * self.distance, minDistance=12)
        assert np.array_equal(markers, scaled)

    def test_mask_cuts(self):
        mask = np.ones(self.distance.shape, bool)
        mask[:, 40] = False
        _, markers = extractSeeds(self.distance, mask=mask)
        expected = self.distance.copy()
        expected[:, 40] = 0
        assert np.array_equal(markers, extractSeeds(expected)[1])
        assert not markers[:, 40].any()

    def test_any_layout_and_untouched(self):
        wide = np.asfortranarray(self.distance.astype(np.float64))
        before = wide.copy()
        assert np.array_equal(extractSeeds(wide)[1], extractSeeds(self.distance)[1])
        assert np.array_equal(wide, before)

    def test_seeds_do_not_touch(self):
        _, markers = extractSeeds(self.distance, separation=0.9)
        grown = cv2.dilate(markers.astype(np.float32), np.ones((3, 3)))
        shrunk = -cv2.dilate(np.where(markers > 0, -markers, -np.inf).astype(np.float32), np.ones((3, 3)))
        assert (grown == shrunk)[markers > 0].all()


def relabelled(markers):
    _, inverse = np.unique(markers, return_inverse=True)
    return inverse.reshape(markers.shape)


class TestStats:
    def test_as_connected_components(self):
        count, markers, stats, centroids = extractSeedsWithStats(TestProperties.distance)
        expected = cv2.connectedComponentsWithStats((markers > 0).view(np.uint8), connectivity=8)
        assert count == expected[0]
        assert stats.dtype == np.int32
        assert np.array_equal(stats, expected[2])
        np.testing.assert_allclose(centroids, expected[3])

    def test_full_image_has_an_empty_background(self):
        _, _, stats, centroids = extractSeedsWithStats(np.full((2, 3), 5, np.float32))
        assert stats.tolist() == [[0, 0, 0, 0, 0], [0, 0, 3, 2, 6]]
        assert np.isnan(centroids[0]).all()


class TestWatersheds:
    edges = np.zeros((40, 60), np.uint8)
    edges[:, 30] = edges[20, :30] = 255
    distance = distanceTransform(edges)

    def test_cv2(self):
        count, markers = extractSeeds(self.distance)
        picture = cv2.cvtColor(self.edges, cv2.COLOR_GRAY2BGR)
        flooded = cv2.watershed(picture, markers.copy())
        assert count == 4
        assert set(np.unique(flooded)) == {-1, 1, 2, 3}
        assert flooded[5, 5] != flooded[35, 5] != flooded[5, 55]

    def test_skimage(self):
        from skimage.segmentation import watershed

        count, markers = extractSeeds(self.distance)
        flooded = watershed(-self.distance, markers)
        assert set(np.unique(flooded)) == set(range(1, count))
        assert np.array_equal(flooded[markers > 0], markers[markers > 0])


@pytest.mark.parametrize(
    ("distance", "options", "name"),
    [
        ([[1.0]], {}, "distance"),
        (np.zeros((2, 2, 2), np.float32), {}, "distance"),
        (np.float32([[-1.0]]), {}, "distance"),
        (np.float32([[np.nan]]), {}, "distance"),
        (np.ones((2, 2), np.float32), {"minDistance": 0}, "minDistance"),
        (np.ones((2, 2), np.float32), {"minDistance": "3"}, "minDistance"),
        (np.ones((2, 2), np.float32), {"separation": 1.0}, "separation"),
        (np.ones((2, 2), np.float32), {"separation": 0.0}, "separation"),
        (np.ones((2, 2), np.float32), {"mask": np.ones((3, 2), np.uint8)}, "mask"),
    ],
)
def test_errors(distance, options, name):
    for function in (extractSeeds, extractSeedsWithStats):
        with pytest.raises(rangeedge.error, match=f"{function.__name__}: `{name}`"):
            function(distance, **options)
