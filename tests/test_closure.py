"""Contour closure: hand cases, and a recursive oracle written for reading."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import _core
from rangeedge.closure import closeContours
from rangeedge.noise import measured_frame
from rangeedge.options import ScanLineParams
from rangeedge.surfaces import surface_map

CROSS = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
SQUARE = np.ones((3, 3), np.uint8)


def parts(closed, valid=None):
    free = closed == 0 if valid is None else (closed == 0) & valid
    return cv2.connectedComponents(free.astype(np.uint8), connectivity=4)[0] - 1


def roof(size=60, slope=1.0):
    return np.tile(slope * np.abs(np.arange(size) - size // 2), (size, 1))


def wall(size=60, gap=10, at=None):
    edges = np.zeros((size, size), np.uint8)
    edges[:, size // 2 if at is None else at] = 255
    start = (size - gap) // 2
    edges[start : start + gap] = 0
    return edges


def noisy(depth, sigma=0.1, seed=0):
    return depth + np.random.default_rng(seed).normal(0, sigma, depth.shape)


def is_surface(src, inside, sigma=0.1, tolerance=3.0, share=0.9):
    """The kernel's verdict on a connected set of pixels: nothing dilated."""
    regions = np.zeros(inside.shape, np.int32)
    options = _core.ClosureOptions(correlation=1.0, tolerance=tolerance, share=share, dilations=0, min_area=1)
    frame = measured_frame(src, ScanLineParams(noise=sigma))
    _core.verified_regions(surface_map(frame, (~inside).view(np.uint8)), options, 1, regions)
    assert not regions.any() or np.array_equal(regions, inside.astype(np.int32))
    return bool(regions.any())


class TestVerification:
    """The region test of the kernel against least squares by numpy."""

    @staticmethod
    def accepted(src, labels, **test):
        return [False] + [is_surface(src, labels == k, **test) for k in range(1, labels.max() + 1)]

    def test_planes_and_steps(self):
        src = noisy(np.where(np.arange(60) < 20, 5.0, 0.3 * np.arange(60)) + np.zeros((40, 1)))
        labels = np.ones((40, 60), np.int32)
        labels[:, 20:] = 2
        assert self.accepted(src, labels) == [0, 1, 1]
        assert self.accepted(src, np.ones_like(labels)) == [0, 0]

    def test_quadratic_but_no_roof(self):
        x = np.arange(60) - 30.0
        labels = np.ones((60, 60), np.int32)
        assert self.accepted(noisy(np.tile(0.01 * x * x, (60, 1))), labels) == [0, 1]
        assert self.accepted(noisy(np.tile(0.02 * np.abs(x), (60, 1))), labels) == [0, 0]

    @pytest.mark.parametrize("share", [0.85, 0.95])
    def test_share_of_outliers(self, share):
        rng = np.random.default_rng(3)
        src = noisy(np.zeros((50, 50)))
        outliers = rng.choice(2500, 250, replace=False)
        src.ravel()[outliers] += rng.choice([-1, 1], 250)
        x, y = np.meshgrid(np.arange(50), np.arange(50))
        columns = np.stack([np.ones(2500), x.ravel(), y.ravel()], axis=1)
        residual = src.ravel() - columns @ np.linalg.lstsq(columns, src.ravel(), rcond=None)[0]
        expected = np.mean(np.abs(residual) <= 0.3) >= share
        assert self.accepted(src, np.ones((50, 50), np.int32), share=share) == [0, expected]

    def test_small_sets_are_nothing(self):
        labels = np.zeros((5, 5), np.int32)
        labels[0] = 1
        assert self.accepted(np.zeros((5, 5)), labels) == [0, 0]


class TestHandCases:
    @pytest.mark.parametrize("gap", [1, 6, 16, 30])
    def test_gap_between_two_planes_is_closed(self, gap):
        edges = wall(gap=gap)
        closed = closeContours(edges, noisy(roof()), noise=0.1)
        assert parts(edges) == 1
        assert parts(closed) == 2
        drawn = np.argwhere(closed & ~edges)
        assert (np.abs(drawn[:, 1] - 30) <= 2).all()
        assert (closed[edges > 0] == 255).all()

    def test_gap_wider_than_allowed_stays(self):
        edges = wall(gap=30)
        assert np.array_equal(closeContours(edges, noisy(roof()), noise=0.1, maxGap=10), edges)

    def test_gap_on_one_plane_stays(self):
        edges = wall(gap=10)
        assert np.array_equal(closeContours(edges, noisy(np.zeros((60, 60))), noise=0.1), edges)

    def test_gap_on_a_curved_surface_stays(self):
        edges = wall(gap=10)
        depth = np.tile(0.01 * (np.arange(60) - 30.0) ** 2, (60, 1))
        assert np.array_equal(closeContours(edges, noisy(depth), noise=0.1), edges)

    def test_only_failing_regions_are_dilated(self):
        """A gap in the good region right beside stays as it is."""
        depth = np.hstack([roof(), np.full((60, 60), 30.0)])
        edges = np.hstack([wall(gap=10), wall(gap=10)])
        edges[:, 60] = 255
        closed = closeContours(edges, noisy(depth), noise=0.1)
        assert parts(closed) == 3
        assert np.array_equal(closed[:, 60:], edges[:, 60:])

    def test_invalid_pixels_bound_regions(self):
        depth = noisy(roof())
        depth[:25, 30] = depth[35:, 30] = np.nan
        edges = np.zeros((60, 60), np.uint8)
        closed = closeContours(edges, depth, noise=0.1)
        assert parts(closed, np.isfinite(depth)) == 2

    def test_nothing_to_dilate_ends_at_once(self):
        edges = np.zeros((60, 60), np.uint8)
        assert not closeContours(edges, noisy(roof()), noise=0.1, maxGap=2**31 - 1).any()

    def test_no_data_at_all(self):
        closed = closeContours(np.zeros((8, 9), np.uint8), np.full((8, 9), np.nan), noise=0.1)
        assert not closed.any()


def oracle(edges, src, noise, max_gap=40, min_area=50):
    """Hypotheses tested one by one, recursion written out."""
    inside = np.isfinite(src) & (edges == 0)
    verified = []

    def examine(area, step):
        count, labels = cv2.connectedComponents(area.astype(np.uint8), connectivity=4)
        for k in range(1, count):
            hypothesis = labels == k
            if hypothesis.sum() < min_area:
                continue
            if is_surface(src, hypothesis, noise):
                verified.append(hypothesis)
            elif step < (max_gap + 1) // 2:
                kernel = SQUARE if step % 2 else CROSS
                outside = cv2.dilate(
                    (~hypothesis).astype(np.uint8), kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0
                )
                examine(hypothesis & (outside == 0), step + 1)

    examine(inside, 0)
    owner = np.zeros(src.shape, int)
    for k, region in enumerate(verified, 1):
        owner[region] = k
    return owner, inside


def grown_owners(owner, inside):
    """For every region, where it is among the nearest when all of them grow back at equal speed: (regions, H, W)."""
    distances = np.where(owner == np.arange(1, owner.max() + 1)[:, None, None], 0, np.inf)
    for distance in distances:
        while True:
            near = _nearest(distance)
            better = inside & (near < distance)
            if not better.any():
                break
            distance[better] = near[better]
    return np.isfinite(distances) & (distances == distances.min(axis=0))


def meetings(owners):
    """Left of or above a pixel of another region: where that may be, and where no tie makes it a matter of order."""
    may, must = np.zeros((2, *owners.shape[1:]), bool)
    single = owners.sum(axis=0) == 1
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1, :], np.s_[1:, :])):
        a, b = owners[:, here[0], here[1]], owners[:, there[0], there[1]]
        both = a.any(axis=0) & b.any(axis=0)
        may[here] |= both & ((a != b).any(axis=0) | (a.sum(axis=0) > 1))
        must[here] |= single[here] & single[there] & (a != b).any(axis=0)
    return may, must


def _nearest(distance):
    padded = np.pad(distance, 1, constant_values=np.inf)
    return np.min([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]], axis=0) + 1


@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_oracle(seed):
    """New edges lie where the verified regions of the oracle, grown back at equal speed, meet; and nowhere else."""
    rng = np.random.default_rng(seed)
    columns = np.sort(rng.choice(np.arange(12, 68), 2, replace=False))
    x = np.arange(80.0)
    profile = np.interp(x, [0, *columns, 79], rng.uniform(0, 40, 4))
    src = noisy(np.tile(profile, (50, 1)), seed=seed)
    edges = np.zeros((50, 80), np.uint8)
    edges[:, columns] = 255
    edges[rng.random((50, 80)) < 0.1] = 0
    edges[10:18, columns[0]] = 0
    owner, inside = oracle(edges, src, 0.1)
    closed = closeContours(edges, src, noise=0.1)
    _, grown = cv2.connectedComponents(((closed == 0) & inside).astype(np.uint8), connectivity=4)
    for k in range(1, owner.max() + 1):  # every verified region is one, and apart from all others
        labels = np.unique(grown[(owner == k) & (closed == 0)])
        assert len(labels) == 1
        assert labels[0] not in np.unique(grown[(owner > 0) & (owner != k) & (closed == 0)])
    added = (closed > 0) & (edges == 0)
    may, must = meetings(grown_owners(owner, inside))
    assert must.any()
    assert not (added & ~may).any()
    assert added[must].all()


class TestProperties:
    src, edges = noisy(roof()), wall(gap=12)

    def test_dst_and_types(self):
        expected = closeContours(self.edges, self.src, noise=0.1)
        dst = np.empty((60, 60), np.uint8)
        assert closeContours(self.edges > 0, self.src, noise=0.1, dst=dst) is dst
        assert np.array_equal(dst, expected)
        assert set(np.unique(expected)) <= {0, 255}

    def test_inputs_untouched_and_any_layout(self):
        src, edges = np.asfortranarray(self.src), np.asfortranarray(self.edges)
        before = src.copy(), edges.copy()
        assert np.array_equal(closeContours(edges, src, noise=0.1), closeContours(self.edges, self.src, noise=0.1))
        assert np.array_equal(src, before[0])
        assert np.array_equal(edges, before[1])

    def test_idempotent(self):
        once = closeContours(self.edges, self.src, noise=0.1)
        assert np.array_equal(closeContours(once, self.src, noise=0.1), once)

    def test_closed_map_gains_only(self):
        closed = closeContours(self.edges, self.src, noise=0.1)
        assert (closed >= self.edges).all()


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"edges": np.zeros((5, 5), np.float32)}, "edges"),
        ({"edges": np.zeros((5, 6), np.uint8)}, "edges"),
        ({"src": "depth"}, "src"),
        ({"tolerance": 0}, "tolerance"),
        ({"share": 1.5}, "share"),
        ({"maxGap": -1}, "maxGap"),
        ({"minArea": 0}, "minArea"),
        ({"noise": -1.0}, "noise"),
        ({"dst": 3}, "dst"),
    ],
)
def test_errors(changes, name):
    arguments = {"edges": np.zeros((5, 5), np.uint8), "src": np.zeros((5, 5), np.float32)} | changes
    with pytest.raises(rangeedge.error, match=f"closeContours: `{name}`"):
        closeContours(**arguments)
