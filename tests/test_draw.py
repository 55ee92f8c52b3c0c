"""Pictures: shapes, colours at known pixels, and that any image at all can be drawn."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge.constants import (
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
)
from rangeedge.draw import colorizeDistance, drawEdges, drawOverview, drawRegions
from rangeedge.draw.lines import write_lengths
from rangeedge.draw.overview import _beside_small_holes, _depth_caption, edge_overview
from rangeedge.draw.regions import _middles, write_numbers
from rangeedge.draw.sheet import _step, with_axes
from rangeedge.frame import read_frame
from rangeedge.segments import SEGMENT, VERTEX

VERMILION, PURPLE, YELLOW, BLUE, GREY, WHITE = (
    (0, 94, 213),
    (167, 121, 204),
    (66, 228, 240),
    (233, 180, 86),
    (150, 150, 150),
    (255, 255, 255),
)
K = np.array([[500.0, 0, 31.5], [0, 500.0, 23.5], [0, 0, 1]])


def depth_image(height=48, width=64):
    """A tilted plane with a nearer box on it and a corner without data."""
    depth = np.broadcast_to(1 + 0.002 * np.arange(height)[:, np.newaxis], (height, width)).astype(np.float32).copy()
    depth[height // 3 : height // 2, width // 3 : width // 2] -= 0.2
    depth[: height // 8, : width // 8] = np.nan
    return depth


def strength_of(shape):
    jump, crease, significance = (np.zeros(shape, np.float32) for _ in range(3))
    kind = np.zeros(shape, np.uint8)
    jump[:, 0], kind[:, 0] = 0.2, EDGE_JUMP | EDGE_OCCLUDING
    crease[-1], kind[-1] = 40, EDGE_CONVEX
    return jump, crease, kind, significance


def colour(picture, row, col):
    return tuple(picture[row, col].tolist())


class TestDrawEdges:
    def test_colours_of_the_kinds(self):
        picture = np.zeros((1, 8, 3), np.uint8)
        kind = np.array(
            [[EDGE_JUMP | EDGE_OCCLUDING, EDGE_JUMP | EDGE_OCCLUDED, EDGE_CONVEX, EDGE_CONCAVE, EDGE_BOUNDARY, 0,
              EDGE_JUMP | EDGE_OCCLUDED | EDGE_CONVEX | EDGE_BOUNDARY, EDGE_CONVEX]], np.uint8,
        )  # fmt: skip
        edges = np.array([[255, 1, 255, 255, 255, 255, 255, 0]], np.uint8)
        drawn = drawEdges(picture, edges, kind)
        expected = [VERMILION, PURPLE, YELLOW, BLUE, GREY, WHITE, PURPLE, (0, 0, 0)]
        assert [colour(drawn, 0, i) for i in range(8)] == expected

    def test_without_kind_all_edges_are_white(self):
        depth, edges = depth_image(), np.zeros((48, 64), bool)
        edges[20, 10:50] = True
        drawn = drawEdges(depth, edges)
        assert np.array_equal((drawn == 255).all(axis=2), edges)

    def test_background_shows_relief_and_leaves_room_for_edges(self):
        drawn = drawEdges(depth_image(), np.zeros((48, 64), np.uint8))
        assert drawn.max() < 200
        grey = cv2.cvtColor(drawn, cv2.COLOR_BGR2GRAY).astype(int)
        assert grey[20, 26] > grey[20, 50] + 5  # the box is nearer and so brighter
        assert grey[18, 20] != grey[18, 40]  # its flanks are lit differently

    def test_light_comes_from_the_upper_left(self):
        col, row = np.meshgrid(np.arange(81), np.arange(81))
        height = np.sqrt(np.maximum(40**2 - (col - 40) ** 2 - (row - 40) ** 2, 0)).astype(np.float32)
        none = np.zeros(height.shape, np.uint8)
        for drawn in (drawEdges(height, none, heightMap=True), drawEdges(100 - height, none)):
            assert drawn[25, 25].sum() > drawn[55, 55].sum() + 30

    def test_pixels_without_data_are_hatched_grey(self):
        none = np.zeros((48, 64), np.uint8)
        millimetres = np.nan_to_num(1000 * depth_image()).astype(np.uint16)
        zeros = np.nan_to_num(depth_image())
        for drawn in (drawEdges(depth_image(), none), drawEdges(millimetres, none), drawEdges(zeros, none, K=K)):
            corner = drawn[:6, :8]
            assert np.ptp(corner, axis=2).max() <= 1
            assert len(np.unique(corner[..., 0])) == 2
            assert (drawn[30, 40] != drawn[30, 40, 0]).any()
        heights = drawEdges(zeros, none)  # on a grid, zero is a height
        assert len(np.unique(heights[1:4, 1:4].reshape(-1, 3), axis=0)) == 1

    def test_points_show_their_depth(self):
        depth = depth_image()
        row, col = np.indices(depth.shape)
        points = np.dstack([(col - 31.5) / 500 * depth, (row - 23.5) / 500 * depth, depth]).astype(np.float32)
        edges = np.zeros(depth.shape, np.uint8)
        expected = drawEdges(depth, edges)
        for cloud in (points, np.dstack([points, np.zeros_like(depth)])):
            assert np.abs(drawEdges(cloud, edges).astype(int) - expected).max() <= 2

    def test_dst_and_inputs(self):
        depth, edges = depth_image(), np.zeros((48, 64), np.uint8)
        edges[5:9] = 255
        before = depth.copy(), edges.copy()
        dst = np.empty((48, 64, 3), np.uint8)
        assert drawEdges(depth, edges, None, dst) is dst
        assert np.array_equal(dst, drawEdges(depth, edges))
        assert np.array_equal(depth, before[0], equal_nan=True)
        assert np.array_equal(edges, before[1])
        picture = np.full((48, 64, 3), 9, np.uint8)
        drawn = drawEdges(picture, edges)
        assert (picture == 9).all()
        assert (drawn[0] == 9).all()
        assert drawEdges(picture, edges, dst=picture) is picture
        assert np.array_equal(picture, drawn)

    @pytest.mark.parametrize("shape", [(1, 1), (1, 50), (50, 1), (2, 3)])
    @pytest.mark.parametrize("value", [1.0, np.nan])
    def test_any_size_and_no_data(self, shape, value):
        drawn = drawEdges(np.full(shape, value, np.float32), np.full(shape, 255, np.uint8))
        assert drawn.shape == (*shape, 3)
        assert (drawn == 255).all()

    @pytest.mark.parametrize(
        ("change", "name"),
        [
            ({"src": None}, "src"),
            ({"src": np.zeros((48, 64, 2), np.float32)}, "src"),
            ({"src": np.zeros((48, 64, 3), np.int32)}, "src"),
            ({"edges": np.zeros((48, 63), np.uint8)}, "edges"),
            ({"edges": np.zeros((48, 64), np.int32)}, "edges"),
            ({"kind": np.zeros((47, 64), np.uint8)}, "kind"),
            ({"kind": np.zeros((48, 64), np.float32)}, "kind"),
            ({"dst": "picture"}, "dst"),
            ({"K": np.eye(2)}, "K"),
            ({"heightMap": 1}, "heightMap"),
        ],
    )
    def test_errors(self, change, name):
        arguments = {"src": depth_image(), "edges": np.zeros((48, 64), np.uint8)} | change
        with pytest.raises(rangeedge.error, match=f"drawEdges.*`{name}`"):
            drawEdges(**arguments)


class TestDrawRegions:
    def test_no_label_is_black(self):
        labels = np.array([[0, 1, -1]], np.int32)
        drawn = drawRegions(labels)
        assert colour(drawn, 0, 0) == colour(drawn, 0, 2) == (0, 0, 0)
        assert drawn[0, 1].any()
        assert not drawRegions(np.zeros((3, 4), np.int32)).any()

    def test_one_colour_a_region_and_another_for_every_neighbour(self):
        rng = np.random.default_rng(0)
        sites = rng.integers(0, 120, (60, 2))
        row, col = np.indices((120, 120))
        distance = (row[..., None] - sites[:, 0]) ** 2 + (col[..., None] - sites[:, 1]) ** 2
        labels = (9 * distance.argmin(axis=2) + 1).astype(np.int32)  # all would take the first colour
        filled = labels.copy()
        change = np.zeros(labels.shape, bool)
        change[:, 1:] |= labels[:, 1:] != labels[:, :-1]
        change[1:] |= labels[1:] != labels[:-1]
        labels[change] = 0  # a gap between regions
        drawn = drawRegions(labels).astype(np.int32) @ [1, 256, 65536]
        for label in np.unique(filled):
            assert len(np.unique(drawn[labels == label])) == 1
        # Across the gap of one or two pixels: the colours on both sides differ.
        for near, far, a, b in (
            (labels[:, :-2], labels[:, 2:], drawn[:, :-2], drawn[:, 2:]),
            (labels[:-2], labels[2:], drawn[:-2], drawn[2:]),
        ):
            pair = (near > 0) & (far > 0) & (near != far)
            assert pair.any()
            assert (a[pair] != b[pair]).all()

    def test_more_neighbours_than_colours(self):
        labels = np.zeros((40, 40), np.int32)
        labels[20:] = 1
        labels[:20] = np.arange(2, 42)
        drawn = drawRegions(labels)
        assert (drawn[19] != drawn[20]).any(axis=1).all()
        assert (drawn[0, 1:] != drawn[0, :-1]).any(axis=1).all()

    def test_colours_of_a_label_do_not_depend_on_far_ones(self):
        labels = np.zeros((9, 30), np.int32)
        labels[:, :5] = 3
        alone = drawRegions(labels)
        labels[:, 20:] = 4
        assert np.array_equal(drawRegions(labels)[:, :5], alone[:, :5])

    def test_alpha_blends_with_the_picture(self):
        labels = np.array([[0, 1]], np.int32)
        picture = np.full((1, 2, 3), 100, np.uint8)
        opaque = drawRegions(labels)[0, 1].astype(float)
        assert colour(drawRegions(labels, picture, 0.25), 0, 0) == (100, 100, 100)
        assert np.abs(drawRegions(labels, picture, 0.25)[0, 1] - (0.25 * opaque + 75)).max() <= 0.5
        assert np.array_equal(drawRegions(labels, picture, 1.0)[0, 1], opaque)
        assert np.array_equal(drawRegions(labels, picture, 0), picture)
        assert (picture == 100).all()

    def test_on_a_range_image(self):
        depth = depth_image()
        labels = np.where(np.arange(64) < 32, 0, 5) * np.ones((48, 1), np.int32)
        drawn = drawRegions(labels.astype(np.int32), depth)
        plain = drawEdges(depth, np.zeros(depth.shape, np.uint8))
        assert np.array_equal(drawn[:, :32], plain[:, :32])
        assert (drawn[:, 32:] != plain[:, 32:]).any(axis=2).all()

    def test_dst(self):
        labels = np.array([[1, 2]], np.int32)
        dst = np.empty((1, 2, 3), np.uint8)
        assert drawRegions(labels, dst=dst) is dst
        assert np.array_equal(dst, drawRegions(labels))

    @pytest.mark.parametrize(
        ("change", "name"),
        [
            ({"labels": np.zeros((3, 4), np.int64)}, "labels"),
            ({"labels": np.zeros((3, 4, 1), np.int32)}, "labels"),
            ({"src": np.zeros((3, 5, 3), np.uint8)}, "src"),
            ({"src": np.zeros((3, 5), np.float32)}, "src"),
            ({"alpha": 1.5}, "alpha"),
            ({"alpha": None}, "alpha"),
        ],
    )
    def test_errors(self, change, name):
        with pytest.raises(rangeedge.error, match=f"drawRegions.*`{name}`"):
            drawRegions(**({"labels": np.ones((3, 4), np.int32)} | change))


class TestColorizeDistance:
    @staticmethod
    def inferno(level):
        return cv2.applyColorMap(np.uint8([[level]]), cv2.COLORMAP_INFERNO)[0, 0].tolist()

    def test_linear(self):
        drawn = colorizeDistance(np.float32([[0, 2.5, 5, 10]]))
        assert drawn[0].tolist() == [self.inferno(level) for level in (0, 64, 128, 255)]

    def test_log(self):
        drawn = colorizeDistance(np.float32([[0, 1, 3, 15]]), log=True)
        assert drawn[0].tolist() == [self.inferno(level) for level in (0, 64, 128, 255)]

    def test_fixed_scale(self):
        drawn = colorizeDistance(np.float32([[0, 5, 99]]), maxDistance=10)
        assert drawn[0].tolist() == [self.inferno(level) for level in (0, 128, 255)]

    @pytest.mark.parametrize("log", [False, True])
    def test_infinite_is_grey(self, log):
        drawn = colorizeDistance(np.float32([[np.inf, 0, 4]]), log=log)
        assert drawn[0].tolist() == [[128, 128, 128], self.inferno(0), self.inferno(255)]
        assert (colorizeDistance(np.full((3, 4), np.inf, np.float32), log=log) == 128).all()

    @pytest.mark.parametrize(("value", "level"), [(0, 0), (7, 255)])
    def test_constant(self, value, level):
        drawn = colorizeDistance(np.full((3, 4), value, np.float32))
        assert (drawn == self.inferno(level)).all()

    def test_types_dst_and_input(self):
        distance = np.arange(12, dtype=np.float32).reshape(3, 4)
        expected = colorizeDistance(distance)
        assert np.array_equal(colorizeDistance(distance.astype(np.float64)), expected)
        dst = np.empty((3, 4, 3), np.uint8)
        assert colorizeDistance(distance, dst) is dst
        assert np.array_equal(dst, expected)
        assert np.array_equal(distance.ravel(), np.arange(12))

    @pytest.mark.parametrize(
        ("arguments", "name"),
        [
            ({"distance": np.float32([[-1]])}, "distance"),
            ({"distance": np.float32([[np.nan]])}, "distance"),
            ({"distance": np.zeros(3, np.float32)}, "distance"),
            ({"distance": np.float32([[1]]), "maxDistance": 0}, "maxDistance"),
            ({"distance": np.float32([[1]]), "maxDistance": np.inf}, "maxDistance"),
            ({"distance": np.float32([[1]]), "log": 1}, "log"),
        ],
    )
    def test_errors(self, arguments, name):
        with pytest.raises(rangeedge.error, match=f"colorizeDistance.*`{name}`"):
            colorizeDistance(**arguments)


class TestDrawOverview:
    @pytest.mark.parametrize(
        "shape", [(1, 1), (1, 40), (40, 1), (7, 5), (48, 64), (300, 100), (480, 640), (64, 2048), (900, 1300)]
    )
    @pytest.mark.parametrize("with_distance", [False, True])
    def test_any_size(self, shape, with_distance):
        strength = strength_of(shape)
        distance = np.ones(shape, np.float32) if with_distance else None
        picture = drawOverview(np.ones(shape, np.float32), strength, strength[2], distance, title="A title")
        assert picture.dtype == np.uint8
        assert picture.ndim == 3
        assert picture.shape[2] == 3
        assert max(picture.shape) <= 6 * 700
        for kind in (VERMILION, YELLOW):
            assert (picture == kind).all(axis=2).sum() > 14 * 14  # more than the key alone shows

    def test_lines_of_one_pixel_survive_reduction(self):
        shape = (900, 1300)
        edges = np.zeros(shape, np.uint8)
        edges[::101] = 255
        blank = (np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.uint8), None)
        picture = drawOverview(np.ones(shape, np.float32), blank, edges)
        rows = (picture == 255).all(axis=2).sum(axis=1)
        assert np.count_nonzero(rows >= 640) >= len(range(0, 900, 101))

    def test_panels(self):
        depth, strength = depth_image(), strength_of((48, 64))
        edges = (strength[2] > 0).astype(np.uint8)
        plain = drawOverview(depth, strength, edges, K=K)
        assert drawOverview(depth, strength, edges, title="x", K=K).shape[0] > plain.shape[0]
        with_distance = drawOverview(depth, strength, edges, cv2.distanceTransform(1 - edges, cv2.DIST_L2, 5), K=K)
        changed = (with_distance != plain).any(axis=2)
        assert 0.08 < changed.mean() < 1 / 6  # one panel of six

    def test_cuts(self):
        depth, strength = depth_image(), strength_of((48, 64))
        bright = [np.count_nonzero(drawOverview(depth, strength, strength[2], jumpCut=cut) == 255) for cut in (0.2, 20)]
        assert bright[0] > bright[1]

    @pytest.mark.parametrize(
        "src", [np.full((48, 64), np.nan, np.float32), np.zeros((48, 64), np.uint16), np.full((48, 64, 3), np.nan)]
    )
    def test_no_data(self, src):
        distance = np.full((48, 64), np.inf, np.float32)
        strength = tuple(np.zeros_like(part) for part in strength_of((48, 64)))
        assert drawOverview(src, strength, strength[2], distance).any()

    def test_infinite_distance(self):
        strength = strength_of((48, 64))
        picture = drawOverview(depth_image(), strength, strength[2], np.full((48, 64), np.inf, np.float32))
        assert (picture == 128).all(axis=2).mean() > 0.08

    def test_inputs_kept(self):
        depth, strength = depth_image(), strength_of((48, 64))
        before = [part.copy() for part in (depth, *strength)]
        drawOverview(depth, strength, strength[2], strength[3])
        for part, copy in zip((depth, *strength), before, strict=True):
            assert np.array_equal(part, copy, equal_nan=True)

    @pytest.mark.parametrize(
        ("change", "name"),
        [
            ({"src": np.zeros((48, 64, 3), np.uint8)}, "src"),
            ({"strength": np.zeros((48, 64), np.float32)}, "strength"),
            ({"strength": strength_of((48, 64))[:3]}, "strength"),
            ({"strength": strength_of((48, 63))}, "strength.jump"),
            ({"edges": np.zeros((4, 6), np.uint8)}, "edges"),
            ({"distance": np.zeros((4, 6), np.float32)}, "distance"),
            ({"title": 3}, "title"),
            ({"jumpCut": 0}, "jumpCut"),
            ({"creaseCut": "64"}, "creaseCut"),
        ],
    )
    def test_errors(self, change, name):
        arguments = {
            "src": depth_image(),
            "strength": strength_of((48, 64)),
            "edges": np.zeros((48, 64), np.uint8),
        } | change
        with pytest.raises(rangeedge.error, match=f"drawOverview.*`{name}`"):
            drawOverview(**arguments)


class TestNumbers:
    def test_regions_have_their_labels_where_there_is_room(self):
        labels = np.zeros((80, 120), np.int32)
        labels[5:60, 5:60], labels[10:50, 70:110], labels[70:73, 70:73] = 7, 12, 3
        picture = np.zeros((160, 240, 3), np.uint8)
        assert write_numbers(picture, labels) == 2
        rows, cols = np.nonzero(picture.any(axis=2))
        assert labels[rows // 2, cols // 2].min() > 0  # inside of their regions
        left = picture[:, :130].any(axis=2)
        assert abs(np.nonzero(left)[1].mean() - 2 * 32) < 6
        assert abs(np.nonzero(left)[0].mean() - 2 * 32) < 6
        assert not picture[136:].any()

    def test_middles_are_farthest_from_the_border(self):
        labels = np.int32([[1, 1, 1, 1, 1, 2, 2, 2]] * 5)
        found = {label: (place, room) for label, place, room in _middles(labels)}
        assert found[1] == ((2, 2), pytest.approx(3, abs=0.1))
        assert found[2][0][1] == 6

    @pytest.mark.parametrize(("count", "step"), [(5, 1), (6, 1), (7, 2), (12, 2), (480, 100), (640, 200), (4000, 1000)])
    def test_axes_have_round_steps(self, count, step):
        assert _step(count) == step

    def test_axes_lie_outside_of_the_picture(self):
        picture = np.full((100, 200, 3), 77, np.uint8)
        framed = with_axes(picture, (50, 100))
        assert (framed[:100, -200:] == 77).all()
        assert framed[100:].any()

    def test_lengths_stay_clear_of_each_other_and_of_vertices(self):
        segments = np.zeros(3, SEGMENT)
        segments["pixels"] = [[(10, 50), (90, 50)], [(10, 52), (90, 52)], [(10, 90), (14, 90)]]
        segments["length"] = 1, 2, 3.123
        canvas = np.zeros((400, 400, 3), np.uint8)
        assert write_lengths(canvas, segments[:1], np.zeros(0, VERTEX), 4) == 1
        assert write_lengths(canvas, segments, np.zeros(0, VERTEX), 4) == 2  # the last one is shorter than its number
        blocked = np.zeros(80, VERTEX)
        blocked["x"], blocked["y"] = np.repeat(np.linspace(10, 90, 40), 2), np.tile([46, 50], 40)
        assert write_lengths(canvas, segments[:1], blocked, 4) == 0


def test_rims_of_small_holes_are_no_kinds_of_candidates():
    valid = np.ones((30, 40), bool)
    valid[5, 5] = valid[20:23, 20:23] = False
    small = _beside_small_holes(valid)
    assert small[4:7, 4:7].all()
    assert not small[19:24, 19:24].any()


@pytest.mark.parametrize(
    ("values", "options", "caption"),
    [
        (np.uint16([[1500, 2000, 0]] * 3), {}, "Depth 1.5 to 2 m, near bright, 67 % valid"),
        (np.uint16([[5000, 7500, 0]] * 3), {"depthFactor": 5000.0}, "Depth 1 to 1.5 units, near bright, 67 % valid"),
        (np.array([[1.5, 2.0]] * 3), {"heightMap": True}, "Height 1.5 to 2 units, high bright, 100 % valid"),
        (np.full((3, 3), np.nan), {}, "Depth: no data"),
    ],
)
def test_units_are_those_of_the_user(values, options, caption):
    frame = read_frame(values, rangeedge.ScanLineParams(**options))
    assert _depth_caption(frame) == caption


def test_overview_of_a_command_is_that_of_the_function():
    depth = np.where(np.arange(64) < 30, 1500, 2000).astype(np.uint16) * np.ones((48, 1), np.uint16)
    edges, strength = rangeedge.detectEdgesWithStrength(depth, K=K)
    distance = rangeedge.distanceTransform(edges)
    frame = read_frame(depth, rangeedge.ScanLineParams(K=K))
    shown = edge_overview(frame, strength, edges, distance, "a title")
    assert np.array_equal(shown, drawOverview(depth, strength, edges, distance, title="a title", K=K))
