"""Contour closure: hand cases, and the faces of rendered scenes."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import closeContours, thinEdges
from rangeedge.synthetic import box, pinholeCamera, plane, renderScene


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

    def test_a_crease_without_any_edge_is_one_gap(self):
        edges = np.zeros((60, 60), np.uint8)
        closed = closeContours(edges, noisy(roof()), noise=0.1)
        assert parts(closed) == 2
        assert (np.abs(np.argwhere(closed)[:, 1] - 30) <= 1).all()
        assert not closeContours(edges, noisy(roof()), noise=0.1, maxGap=59).any()

    def test_the_line_follows_the_crease_where_edges_lead_aside(self):
        """Edges end at a gap and point past each other; the surfaces meet where they do."""
        edges = wall(gap=20)
        edges[20:24, 31], edges[36:40, 29] = 255, 255
        closed = closeContours(edges, noisy(roof()), noise=0.1)
        columns = np.nonzero(closed[24:36])[1]
        assert len(columns) >= 12
        assert (np.abs(columns - 30) <= 1).all()
        assert parts(closed) >= 2

    def test_jumps_are_closed_where_surfaces_part(self):
        rows = np.arange(60)
        rim = np.rint(25 + 0.3 * rows).astype(int)
        depth = np.where(np.arange(60) < rim[:, None], 5.0, 15.0)
        edges = np.zeros((60, 60), np.uint8)
        edges[rows, rim - 1] = 255
        edges[20:40] = 0
        closed = closeContours(edges, noisy(depth), noise=0.1)
        assert parts(closed) == 2
        drawn = np.argwhere(closed & ~edges)
        assert (np.abs(drawn[:, 1] + 0.5 - rim[drawn[:, 0]]) <= 1).all()

    def test_two_parts_of_one_plane_are_not_parted(self):
        """A false edge with a gap, and a third surface that reaches into it."""
        depth = np.full((60, 60), 5.0)
        depth[40:, 20:40] = 1.0
        edges = wall(gap=6)
        edges[39:, 20] = edges[39:, 39] = edges[39, 20:40] = 255
        closed = closeContours(edges, noisy(depth), noise=0.1)
        assert np.array_equal(closed, edges)

    def test_no_data_at_all(self):
        closed = closeContours(np.zeros((8, 9), np.uint8), np.full((8, 9), np.nan), noise=0.1)
        assert not closed.any()


class TestScenes:
    """Rendered boxes, whose true edges are dashed at random: every face becomes one component again."""

    K = np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]])

    def scene(self, seed):
        rng = np.random.default_rng(seed)
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        scene = [plane((0, 0, 1.4), (0.05, -0.3, -1)), box((0, 0, 1.0), (0.3, 0.25, 0.35), axes)]
        rendering = renderScene(scene, pinholeCamera(self.K, (320, 240)))
        truth = thinEdges(rendering.edges(0.01, 30))
        edges = truth.copy()
        places = np.argwhere(truth)
        for row, col in places[rng.choice(len(places), 10, replace=False)]:
            cv2.circle(edges, (int(col), int(row)), int(rng.integers(2, 12)), 0, -1)
        return rendering, edges, cv2.distanceTransform(255 - truth, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)

    @pytest.mark.parametrize("seed", range(6))
    def test_faces_are_components_again(self, seed):
        rendering, edges, distance = self.scene(seed)
        src = rendering.depth + np.random.default_rng(seed).normal(0, 0.001, rendering.depth.shape)
        closed = closeContours(edges, src, K=self.K, noise=0.001)
        drawn = (closed > 0) & (edges == 0)
        assert drawn.any()
        assert distance[drawn].max() <= 2.5
        _, found = cv2.connectedComponents((closed == 0).astype(np.uint8), connectivity=4)
        for label in range(1, rendering.labels.max() + 1):
            inside = (rendering.labels == label) & (distance > 4)
            if np.count_nonzero(inside) < 200:
                continue
            most = np.bincount(found[inside]).argmax()
            assert most > 0
            assert np.mean(found[inside] == most) > 0.99
            assert np.mean(rendering.labels[(found == most) & (distance > 4)] == label) > 0.99


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
