"""Outlines of regions as polygons with holes."""

import itertools

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import rangeedge
from rangeedge import RegionBoundaries, drawBoundaries, project, regionBoundaries, segmentRegions
from rangeedge.synthetic import box, demoScene, kinectCamera, kinectNoise, pinholeCamera, plane, renderScene

K = np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
CAMERA = pinholeCamera(K, (160, 120))
IMAGES = hnp.arrays(np.int32, st.tuples(st.integers(1, 8), st.integers(1, 8)), elements=st.integers(-1, 3))


def labelled(rows):
    return np.array([[int(c) for c in row] for row in rows.split()], np.int32)


def places(points):
    return [(x + 0.5, y + 0.5) for x, y in points[["x", "y"]].tolist()]


def box_corner():
    axes = cv2.Rodrigues(np.array([0.5, 0.6, 0.2]))[0]
    return renderScene([plane((0, 0, 1.5), (0, 0, -1)), box((0, 0, 1.0), (0.3, 0.25, 0.2), axes)], CAMERA), axes


def test_one_pixel_is_a_square():
    (region,) = regionBoundaries(labelled("000 050 000"))
    assert places(region.outline) == [(1, 1), (2, 1), (2, 2), (1, 2)]
    assert (region.label, region.area, region.holes) == (5, 1.0, [])
    assert np.isnan(region.outline["point"]).all()


def test_a_region_with_a_hole_that_is_a_region():
    outer, inner = regionBoundaries(labelled("1111 1221 1111"))
    assert places(outer.outline) == [(0, 0), (4, 0), (4, 3), (0, 3)]
    assert [places(hole) for hole in outer.holes] == [[(1, 1), (1, 2), (3, 2), (3, 1)]]
    assert places(inner.outline) == [(1, 1), (3, 1), (3, 2), (1, 2)]
    assert (outer.area, inner.area) == (10, 2)


def test_regions_share_their_arcs():
    found = regionBoundaries(labelled("112 112 332"), tolerance=0)
    arcs = {
        (min(a["right"], a["left"]), max(a["right"], a["left"])): found.vertices[a["first"] : a["first"] + a["count"]]
        for a in found.arcs
    }
    assert sorted(arcs) == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    assert sorted((arcs[1, 2] + 0.5).tolist()) == [[2, 0], [2, 2]]
    assert sorted((arcs[1, 3] + 0.5).tolist()) == [[0, 2], [2, 2]]


def test_pixels_that_touch_at_a_corner_are_two_regions():
    found = regionBoundaries(labelled("10 01"), tolerance=0)
    assert [(region.label, region.area, sorted(places(region.outline))) for region in found] == [
        (1, 1.0, [(0, 0), (0, 1), (1, 0), (1, 1)]),
        (1, 1.0, [(1, 1), (1, 2), (2, 1), (2, 2)]),
    ]
    ring, *_ = regionBoundaries(labelled("111 101 110"), tolerance=0)
    assert ring.area == 7
    assert len(ring.holes) == 1 or len(ring.outline) > 8


@settings(max_examples=150, deadline=None)
@given(IMAGES)
def test_areas_are_numbers_of_pixels(labels):
    found = regionBoundaries(labels, tolerance=0)
    for label in range(1, 4):
        assert sum(region.area for region in found if region.label == label) == (labels == label).sum()
    rings = found.rings
    assert (rings["area"][~rings["hole"]] > 0).all()
    assert (rings["area"][rings["hole"]] < 0).all()
    components = sum(cv2.connectedComponents((labels == k).astype(np.uint8), connectivity=4)[0] - 1 for k in (1, 2, 3))
    assert len(found) == components


@settings(max_examples=100, deadline=None)
@given(IMAGES)
def test_polygons_fill_exactly_their_pixels(labels):
    filled = np.zeros_like(labels)
    v, u = np.indices(labels.shape)
    for region in regionBoundaries(labels, tolerance=0):
        inside = np.zeros(labels.shape, bool)
        for ring in (region.outline, *region.holes):
            x, y = ring["x"], ring["y"]
            for x0, y0, x1, y1 in zip(x, y, np.roll(x, -1), np.roll(y, -1), strict=True):
                if y0 != y1:  # a vertical side, left of a pixel or not
                    inside ^= (min(y0, y1) < v) & (v < max(y0, y1)) & (u > x0)
                assert x0 == x1 or y0 == y1
        assert not filled[inside].any()
        filled[inside] = region.label
    assert np.array_equal(filled, np.maximum(labels, 0))


@settings(max_examples=100, deadline=None)
@given(IMAGES, st.floats(0.1, 3))
def test_simplified_neighbours_have_the_same_vertices(labels, tolerance):
    found = regionBoundaries(labels, tolerance=tolerance)
    ways = {}
    for region in found:
        for ring in (region.outline, *region.holes):
            line = places(ring)
            for a, b in zip(line, line[1:] + line[:1], strict=True):
                ways[a, b] = ways.get((a, b), 0) + 1
    # Whatever one region passes in one direction the other passes in the other, or nothing does.
    beside_none = {
        tuple(map(tuple, pair))
        for arc in found.arcs[(found.arcs["right"] <= 0) | (found.arcs["left"] <= 0)]
        for line in [found.vertices[arc["first"] : arc["first"] + arc["count"]] + 0.5]
        for pair in [*zip(line[:-1].tolist(), line[1:].tolist(), strict=True)]
    }
    for a, b in ways:
        assert (b, a) in ways or (a, b) in beside_none or (b, a) in beside_none


def crossings(found):
    """Pairs of segments of all arcs that have more in common than one end of both."""
    lines = [found.vertices[arc["first"] : arc["first"] + arc["count"]].tolist() for arc in found.arcs]
    segments = [(tuple(a), tuple(b)) for line in lines for a, b in itertools.pairwise(line)]

    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def holds(a, b, c):
        return side(a, b, c) == 0 and all(min(a[k], b[k]) <= c[k] <= max(a[k], b[k]) for k in (0, 1))

    count = 0
    for s, t in itertools.combinations(segments, 2):
        common = set(s) & set(t)
        touching = [c for pair, other in ((s, t), (t, s)) for c in other if holds(*pair, c) and c not in common]
        across = side(*s, t[0]) * side(*s, t[1]) < 0 and side(*t, s[0]) * side(*t, s[1]) < 0
        count += bool(touching) or len(common) == 2 or (across and not common)
    return count


@settings(max_examples=150, deadline=None)
@given(IMAGES, st.sampled_from([0.3, 0.75, 1.0, 2.0, 5.0]), st.integers(1, 3))
def test_simplified_outlines_do_not_cross(labels, tolerance, size):
    found = regionBoundaries(np.kron(labels, np.ones((size, size), np.int32)), tolerance=tolerance)
    assert crossings(found) == 0
    assert all(region.area > 0 and len(region.outline) >= 3 for region in found)


def test_narrow_regions_keep_their_area():
    # Two lines of pixels beside each other, which a tolerance of two pixels would make one line.
    found = regionBoundaries(labelled("0000000000 1111111111 2222222222 0000000000"), tolerance=2.0)
    assert [region.area > 0 for region in found] == [True, True]
    assert crossings(found) == 0


@pytest.mark.parametrize("tolerance", [0.5, 2.0, 5.0])
def test_outlines_moved_onto_lines_do_not_cross(tolerance):
    axes = cv2.Rodrigues(np.array([0.5, 0.6, 0.2]))[0]
    plates = [box((0, 0.03 * k, 1.0 - 0.01 * k), (0.3, 0.02, 0.012), axes) for k in range(-3, 4)]
    rendering = renderScene([plane((0, 0, 1.2), (0.2, 0, -1)), *plates], CAMERA)
    depth = rendering.depth + np.random.default_rng(0).normal(0, 0.002, rendering.depth.shape)
    assert crossings(regionBoundaries(rendering.labels, depth, tolerance, K=K)) == 0


def test_no_border_lies_farther_off_than_the_tolerance():
    yy, xx = np.indices((80, 90))
    labels = ((xx - 45) ** 2 + (yy - 40) ** 2 < 900).astype(np.int32)
    exact = regionBoundaries(labels, tolerance=0)[0].outline
    counts = []
    for tolerance in (0.5, 1, 3):
        (disc,) = regionBoundaries(labels, tolerance=tolerance)
        polygon = np.column_stack([disc.outline["x"], disc.outline["y"]]).astype(np.float32)
        off = [abs(cv2.pointPolygonTest(polygon, (float(x), float(y)), True)) for x, y in exact[["x", "y"]].tolist()]
        assert max(off) <= tolerance + 1e-6
        counts.append(len(polygon))
    assert counts == sorted(counts, reverse=True)
    assert counts[1] < len(exact) / 4


def test_tolerances_are_lengths_in_units():
    depth = np.full((60, 80), 2.0)
    rng = np.random.default_rng(0)
    labels = np.zeros(depth.shape, np.int32)
    for row, ragged in enumerate(rng.integers(0, 4, 60)):
        labels[row, 10 : 60 + ragged] = 1
    camera = np.array([[100.0, 0, 40], [0, 100, 30], [0, 0, 1]])
    fine = regionBoundaries(labels, depth, 2.0, K=camera)
    units = regionBoundaries(labels, depth, 0.04, units=True, K=camera)  # a pixel is 0.02 long
    assert np.array_equal(fine.points, units.points)
    assert len(regionBoundaries(labels, depth, 0.04, units=True, pixelSize=0.01).points) < len(fine.points)


def test_corners_are_where_three_planes_meet():
    rendering, axes = box_corner()
    found = regionBoundaries(rendering.labels, rendering.depth, K=K)
    true = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * (0.15, 0.125, 0.1) @ axes.T
    true += np.array([0, 0, 1.0])
    corner = true[np.argmin(true[:, 2])]  # the nearest corner, of three visible faces
    faces = [region for region in found if np.isclose(region.outline["point"], corner, atol=1e-5).all(axis=1).any()]
    assert len(faces) == 3
    at = project(corner, K=K)[:2]
    for face in faces:
        off = np.hypot(face.outline["x"] - at[0], face.outline["y"] - at[1])
        assert off.min() < 1e-3


def test_vertices_lie_on_the_surface_of_their_region():
    rendering, _ = box_corner()
    found = regionBoundaries(rendering.labels, rendering.depth, K=K)
    for region in found:
        points = region.outline["point"]
        seen = project(points, K=K)
        assert np.allclose(seen[:, :2], np.column_stack([region.outline["x"], region.outline["y"]]), atol=1e-6)
        pixels = rendering.labels == region.label
        normal = rendering.normals[pixels][0]
        assert np.abs((points - rendering.points[pixels][0]) @ normal).max() < 1e-5


@pytest.mark.parametrize("heightMap", [False, True])
def test_planes_of_grids_meet_in_their_line(heightMap):
    x = np.arange(40.0) * np.ones((30, 1))
    labels = np.where(x < 20.3, 1, 2).astype(np.int32)
    for region in regionBoundaries(labels, np.abs(x - 20.3), pixelSize=1.0, heightMap=heightMap):
        outline = region.outline
        assert np.allclose(outline["point"][:, :2], np.column_stack([outline["x"], outline["y"]]))
        assert np.abs(outline["x"] - 20.3).min() < 0.001
        expected = (20.3 - outline["x"]) if region.label == 1 else (outline["x"] - 20.3)
        assert np.allclose(outline["point"][:, 2], expected, atol=0.001)


def test_vertices_of_a_curved_region_lie_on_its_quadratic():
    def height(x, y):
        return 0.02 * x**2 + 0.03 * y**2 - 0.015 * x * y

    y, x = np.mgrid[:40, :50].astype(float)
    labels = (np.hypot(x - 20, y - 18) < 15).astype(np.int32)
    (region,) = regionBoundaries(labels, height(x, y), pixelSize=1.0, heightMap=True)
    points = region.outline["point"]
    assert np.allclose(points[:, 2], height(points[:, 0], points[:, 1]), atol=1e-3)


def test_points_have_outlines_on_their_surfaces():
    x, y = np.meshgrid(0.1 * np.arange(40.0), 0.2 * np.arange(30.0))
    labels = np.where(x < 2, 1, 2).astype(np.int32)
    for region in regionBoundaries(labels, np.dstack([x, y, np.abs(x - 2)]), heightMap=True):
        px, py, pz = region.outline["point"].T
        inside = (region.outline["x"] > 0) & (region.outline["x"] < 39)
        assert np.allclose(px[inside], 0.1 * region.outline["x"][inside], atol=1e-5)
        assert np.allclose(pz, (2 - px) if region.label == 1 else (px - 2), atol=1e-5)
        assert py.min() >= 0


def test_a_noisy_frame_stays_planar():
    scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
    labels = segmentRegions(scan.src, **scan.geometry)
    found = regionBoundaries(labels, scan.src, **scan.geometry)
    assert np.isfinite(found.points["point"]).all()
    exact = regionBoundaries(labels, tolerance=0)
    for label in np.unique(labels[labels > 0]):
        area = (labels == label).sum()
        assert sum(region.area for region in exact if region.label == label) == area
        assert sum(region.area for region in found if region.label == label) == pytest.approx(area, rel=0.06)


def test_sequences_and_slices():
    found = regionBoundaries(labelled("1122 1122 3333"))
    assert isinstance(found, RegionBoundaries)
    assert [region.label for region in found] == [1, 2, 3]
    assert found[-1].label == 3
    assert [region.label for region in found[1:]] == [2, 3]
    assert "3 outlines" in repr(found)
    assert "region 1" in repr(found[0])
    with pytest.raises(IndexError):
        found[3]
    assert len(regionBoundaries(np.zeros((4, 5), np.int32))) == 0
    assert list(regionBoundaries(np.zeros((4, 5), np.int32), np.ones((4, 5)))) == []


def test_pictures_show_borders_and_colours():
    labels = np.zeros((40, 50), np.int32)
    labels[5:35, 5:25], labels[5:35, 25:45] = 1, 2
    labels[15:20, 10:15] = 0
    picture = drawBoundaries(np.zeros((40, 50, 3), np.uint8), regionBoundaries(labels), 1.0, scale=8)
    assert picture.shape == (320, 400, 3)
    left, right, hole = picture[240, 100], picture[240, 300], picture[140, 100]
    assert left.any()
    assert right.any()
    assert (left != right).any()
    assert not hole.any()
    assert picture[160, 25 * 8].tolist() == [255, 255, 255]
    dst = np.zeros((40, 50, 3), np.uint8)
    assert drawBoundaries(np.ones((40, 50)), regionBoundaries(labels), dst=dst) is dst


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: regionBoundaries(np.ones((3, 4))), "regionBoundaries: `labels` must be an int32 array"),
        (lambda: regionBoundaries(np.ones((3, 4), np.int32), np.ones((3, 5))), "`labels` must be an int32 array of"),
        (lambda: regionBoundaries(np.full((3, 4), 10**9, np.int32), np.ones((3, 4))), "labels of up to 65535"),
        (lambda: regionBoundaries(np.ones((3, 4), np.int32), tolerance=-1), "`tolerance` must be a finite number >= 0"),
        (lambda: regionBoundaries(np.ones((3, 4), np.int32), units=1), "`units` must be True or False"),
        (lambda: drawBoundaries(np.ones((3, 4)), 3), "drawBoundaries: `boundaries` must be RegionBoundaries"),
        (lambda: drawBoundaries(np.ones((3, 4)), regionBoundaries(np.ones((3, 4), np.int32)), 2), "`alpha` must be"),
    ],
)
def test_bad_arguments_are_named(call, text):
    with pytest.raises(rangeedge.error) as problem:
        call()
    assert text in str(problem.value)


def test_rooms_seen_all_around_have_outlines_in_space():
    azimuth = np.radians(np.arange(0, 360, 1.0))
    elevation = np.radians(np.arange(-30, 30, 2.0))[:, None]
    parts = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
    rays = np.stack(np.broadcast_arrays(*parts), axis=-1)
    with np.errstate(divide="ignore"):
        ways = np.array([2, 1.5, 1.2]) / np.abs(rays)
    points = rays * ways.min(axis=2)[..., None]
    labels = (
        1 + 2 * ways.argmin(axis=2) + (np.take_along_axis(rays, ways.argmin(axis=2)[..., None], 2)[..., 0] > 0)
    ).astype(np.int32)
    found = regionBoundaries(labels, points)
    for region in found:
        axis, positive = divmod(region.label - 1, 2)
        side = (2, 1.5, 1.2)[axis] * (1 if positive else -1)
        assert np.allclose(region.outline["point"][:, axis], side, atol=1e-6)
