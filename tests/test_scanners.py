"""Scanners that turn: the same scene gives the same edges, surfaces and chains, all around."""

import cv2
import numpy as np
import pytest
from scans import COLUMNS, WALLS, K, borders, camera_axes, depth_of, near, rays_of, sweep

import rangeedge
from rangeedge import detectEdges, edgePoints, edgeStrength, segmentRegions
from rangeedge.frame import read_frame
from rangeedge.options import ScanLineParams
from rangeedge.panorama import _reversed


@pytest.mark.parametrize("tilt", [0, 10])
@pytest.mark.parametrize("noise", [0, 0.005, 0.015])
@pytest.mark.parametrize("rows", [16, 32, 64, 128])
def test_a_room_all_around(rows, noise, tilt):
    rays, ranges, faces = sweep(rows, 22.5, (180, -180), tilt)
    points = rays * (ranges + noise * np.random.default_rng(0).standard_normal(ranges.shape))[..., None]
    assert read_frame(points, ScanLineParams()).valid.all()
    truth = borders(faces)
    for cloud in (points, camera_axes(points).astype(np.float32)):
        edges = detectEdges(cloud) > 0
        assert near(edges, truth) >= 0.95
        assert near(truth, edges) >= 0.95


def test_a_pillar_has_an_outline_and_no_creases():
    rays, ranges, faces = sweep(64, 22.5, (45, -45))
    across, toward = (rays[..., :2] ** 2).sum(axis=2), rays[..., :2] @ (2.5, 1.0)
    inside = toward**2 - across * (2.5**2 + 1 - 0.25**2)
    there = np.where(inside > 0, (toward - np.sqrt(np.maximum(inside, 0))) / across, np.inf)
    faces = np.where(there < ranges, 6, faces)
    ranges = np.minimum(there, ranges) + 0.005 * np.random.default_rng(0).standard_normal(ranges.shape)
    edges, truth = detectEdges(rays * ranges[..., None]) > 0, borders(faces)
    truth[:, [0, -1]] = False  # no neighbours here
    assert near(edges, truth, 3) > 0.97
    assert near(truth, edges, 3) > 0.97


def test_walls_meet_at_right_angles_and_the_seam_is_no_border():
    rays, ranges, faces = sweep(128, 10, (180, -180))
    turn = COLUMNS // 2 - int(np.argmax(faces[64] != np.roll(faces[64], 1)))
    noise = 0.003 * np.random.default_rng(1).standard_normal(ranges.shape)
    points = np.roll(rays * (ranges + noise)[..., None], turn + COLUMNS // 2, axis=1)  # a corner between last and first
    turned = np.roll(faces, turn + COLUMNS // 2, axis=1)
    assert (turned[:, 0] != turned[:, -1]).mean() > 0.5
    crease = edgeStrength(points).crease
    wall = (turned < 4) & (np.roll(turned, 1, 1) < 4)
    beside = wall & (turned != np.roll(turned, 1, 1))
    for edge in (beside[:, :1], beside[:, 1:]):
        columns = crease[:, :1] if edge.shape[1] == 1 else crease[:, 1:]
        assert edge.sum() > 50
        assert np.median(columns[edge]) == pytest.approx(90, abs=0.5)


def test_points_and_strengths_of_sectors_agree():
    rays, ranges, _ = sweep(32, 15, (180, -180))
    cloud = rays * ranges[..., None]
    found, points = edgeStrength(cloud, noise=0.001), edgePoints(cloud, noise=0.001)
    assert points["x"].min() >= -0.5
    assert points["x"].max() < COLUMNS - 0.5
    assert set(np.unique(np.rint(points["x"]) // 128)) >= {0, 1, 2, 3}
    assert ((found.crease > 60).sum(axis=1) > 0).mean() > 0.9


def test_a_plane_has_no_edges_whatever_cone_it_is_seen_along():
    rays, _, _ = sweep(64, 30, (60, -60), 7)
    normal = np.array([0.9, 0.3, -0.2])
    points = rays * (2 / (rays @ normal))[..., None]
    points[~(rays @ normal > 0.2)] = np.nan
    found = edgeStrength(points)
    assert found.jump.max() < 0.01  # where the ray grazes the plane, 10 away
    assert found.crease.max() < 2
    assert not detectEdges(points).any()


def test_pixels_that_fly_are_found_all_around():
    rays, ranges, _ = sweep(64, 15, (180, -180))
    ranges = np.full_like(ranges, 4.0)
    ranges[:, 100:200], ranges[:, 99], ranges[:, 200] = 3.0, 3.5, 3.5
    flying = rangeedge.flyingPixels(rays * ranges[..., None], noise=0.002) > 0
    assert flying[5:-5, [99, 200]].mean() > 0.9
    assert not np.delete(flying, [99, 200], axis=1).any()


def test_range_images_are_the_points_of_their_angles():
    rays, ranges, _ = sweep(32, 15, (180, -180))
    points = rangeedge.sweepToPoints(ranges, np.linspace(15, -15, 32))
    np.testing.assert_allclose(points, rays * ranges[..., None], atol=1e-12)
    up, around = np.broadcast_arrays(np.linspace(15, -15, 32)[:, None], np.linspace(180, -180, COLUMNS, endpoint=False))
    millimetres = np.rint(1000 * ranges).astype(np.uint16)
    millimetres[3, 4] = 0
    whole = rangeedge.sweepToPoints(millimetres, up, around)
    assert np.isnan(whole[3, 4]).all()
    assert np.isfinite(whole).all(axis=2).sum() == ranges.size - 1
    np.testing.assert_allclose(np.linalg.norm(whole, axis=2)[5], ranges[5], atol=6e-4)
    for name, options in (("elevation", {"elevation": [1, 2]}), ("azimuth", {"elevation": up, "azimuth": [np.nan]})):
        with pytest.raises(rangeedge.error, match=f"sweepToPoints: `{name}` must be"):
            rangeedge.sweepToPoints(ranges, **options)


# Whatever comes after the edges, all around.


def room(rows=64, columns=0, noise=0.003, tilt=0):
    """Points of the room and its faces, turned by some columns."""
    rays, ranges, faces = sweep(rows, 22.5, (180, -180), tilt)
    points = rays * (ranges + noise * np.random.default_rng(4).standard_normal(ranges.shape))[..., None]
    return np.roll(points, columns, 1), np.roll(faces, columns, 1)


def test_surfaces_of_a_sector_are_planes():
    rays, ranges, faces = sweep(64, 20, (50, -50))
    points = rays * (ranges + 0.003 * np.random.default_rng(4).standard_normal(ranges.shape))[..., None]
    count, _, _, _, surfaces = rangeedge.segmentRegionsWithStats(points)
    assert count - 1 == len(np.unique(faces))
    assert not surfaces["curved"].any()


@pytest.mark.parametrize("half", [85, 130])
def test_surfaces_of_several_sectors_that_do_not_close(half):
    rays, ranges, faces = sweep(64, 20, (half, -half))
    points = rays * (ranges + 0.003 * np.random.default_rng(4).standard_normal(ranges.shape))[..., None]
    labels = segmentRegions(points)
    for label in range(1, labels.max() + 1):
        own = np.bincount(faces[labels == label], minlength=len(WALLS))
        assert own.max() > 0.95 * own.sum()
    assert np.count_nonzero(labels) > 0.98 * labels.size
    assert near((detectEdges(points) > 0)[:, 4:-4], borders(faces)[:, 4:-4]) > 0.95


@pytest.mark.parametrize("origin", [None, (4, -7, 1.1)])
@pytest.mark.parametrize("columns", [0, 100, 250])
def test_surfaces_all_around(columns, origin):
    points, faces = room(columns=columns)
    if origin:
        points = points + origin
    count, labels, _, _, surfaces = rangeedge.segmentRegionsWithStats(points, origin=origin)
    assert count - 1 == 7  # the ceiling is seen in two parts
    for face in range(6):
        own = np.bincount(labels[faces == face], minlength=count)
        assert np.sort(own)[-2:].sum() > 0.99 * own.sum()
    for label in range(1, count):
        face = np.bincount(faces[labels == label]).argmax()
        axis, place = WALLS[face]
        assert abs(surfaces["normal"][label][axis]) > 0.9999
        assert surfaces["centroid"][label][axis] == pytest.approx(place + (origin or (0, 0, 0))[axis], abs=0.002)
        assert surfaces["rms"][label] < 0.004
        assert not surfaces["curved"][label]


def test_a_sphere_all_around_is_curved():
    rays, _, _ = sweep(64, 22.5, (180, -180))
    off = np.array([0.5, 0.3, 0.0])  # the centre
    along = rays @ off
    points = rays * (along + np.sqrt(9 - off @ off + along**2))[..., None]
    count, labels, _, _, surfaces = rangeedge.segmentRegionsWithStats(points, noise=0.002)
    assert count == 2
    assert (labels == 1).all()
    assert surfaces["curved"][1]
    assert surfaces["rms"][1] < 1e-3


def test_regions_all_around_do_not_depend_on_threads_nor_on_the_seam():
    points, _ = room(128)
    threads = cv2.getNumThreads()
    try:
        cv2.setNumThreads(1)
        labels = segmentRegions(points)
        cv2.setNumThreads(4)
        np.testing.assert_array_equal(segmentRegions(points), labels)
    finally:
        cv2.setNumThreads(threads)
    quarter = COLUMNS // 4  # sectors fall on sectors
    there = segmentRegions(np.roll(points, quarter, 1))
    assert np.unique(np.stack([np.roll(labels, quarter, 1), there]).reshape(2, -1), axis=1).shape[1] == labels.max()
    upright = segmentRegions(np.ascontiguousarray(points.transpose(1, 0, 2)))
    assert upright.max() == labels.max()
    assert (detectEdges(points) == detectEdges(np.ascontiguousarray(points.transpose(1, 0, 2))).T).mean() > 0.995


def test_what_walls_touch_all_around():
    for columns, origin in ((0, None), (250, (4, -7, 1.1))):
        points, _ = room(columns=columns)
        points = points + (origin or (0, 0, 0))
        labels = segmentRegions(points, origin=origin)
        pairs = rangeedge.regionAdjacency(points, labels, origin=origin)
        pairs = pairs[pairs["contacts"] > 5]
        assert (pairs["kind"] == rangeedge.EDGE_CONCAVE).all()
        np.testing.assert_allclose(pairs["dihedral"], 270, atol=0.5)
        assert len(pairs) == 13 or len(pairs) == 14  # a corner of the ceiling is hardly seen
        assert pairs["contacts"].sum() > 1100


def test_adjacent_surfaces_of_a_cloud_in_another_frame():
    z = depth_of(rays_of())
    labels, place = segmentRegions(z, K=K), np.array([4, -7, 1.1])
    here = rangeedge.regionAdjacency(z, labels, K=K)
    there = rangeedge.regionAdjacency(rays_of() * z[..., None] + place, labels, origin=place)
    np.testing.assert_array_equal(here["kind"], there["kind"])
    for name in ("contacts", "jump", "dihedral"):
        np.testing.assert_allclose(here[name], there[name], atol=1e-3)
    np.testing.assert_allclose(here["point"] + place, there["point"], atol=1e-3)


def test_chains_of_a_cloud_in_another_frame():
    z, place = depth_of(rays_of()), np.array([4, -7, 1.1])
    here = rangeedge.linkEdges(z, K=K)
    there = rangeedge.linkEdges(rays_of() * z[..., None] + place, origin=place)
    assert len(here) == len(there)
    np.testing.assert_array_equal(here.chains["kind"], there.chains["kind"])
    for name in ("point", "behind", "measured"):
        np.testing.assert_allclose(here.points[name] + place, there.points[name], atol=0.02)


@pytest.mark.parametrize("noise", [0, 0.003])
@pytest.mark.parametrize("columns", [0, 100, 250])
def test_chains_all_around(columns, noise):
    points, _ = room(columns=columns, noise=noise)
    chains = rangeedge.linkEdges(points)
    places = chains.points["point"]
    off = np.sort(np.stack([np.abs(places[:, axis] - place) for axis, place in WALLS], 1), 1)
    assert np.median(off[:, 1]) < 0.01  # every point lies on two walls
    assert np.quantile(off[:, 1], 0.95) < 0.1
    assert chains.chains["pixels"].max() < 160  # none runs back around
    segments, _ = rangeedge.fitSegments(chains, tolerance=0.05)
    for length, number in ((9.0, 2), (8.0, 2), (3.0, 4)):  # of the floor, and between floor and ceiling
        assert (np.abs(segments["length"] - length) < 0.05).sum() >= number


def test_a_chain_the_other_way_round_has_its_sides_exchanged():
    points = np.zeros(3, [("x", "f8"), ("normals", "f8", (2, 3))])
    points["x"], points["normals"][:, 0], points["normals"][:, 1] = (1, 2, 3), (1, 0, 0), (0, 1, 0)
    turned = _reversed(points)
    assert turned["x"].tolist() == [3, 2, 1]
    assert (turned["normals"] == [(0, 1, 0), (1, 0, 0)]).all()
    assert (points["normals"][:, 0] == (1, 0, 0)).all()


def test_a_jump_all_around_is_one_chain():
    rays, _, _ = sweep(64, 15, (180, -180))
    ranges = np.full(rays.shape[:2], 4.0)
    ranges[20:40] = 3.0  # a ring
    chains = rangeedge.linkEdges(rays * ranges[..., None], noise=0.002)
    rings = [chain for chain in chains if len(chain) > 100]
    assert len(rings) == 2
    for ring in rings:
        assert ring.closed
        assert ring.pixels == pytest.approx(COLUMNS, rel=0.05)
        assert ring.jump == pytest.approx(1, abs=0.05)
        assert ring.length == pytest.approx(2 * np.pi * 3, rel=0.05)


def test_contours_are_closed_all_around():
    points, faces = room()
    whole = detectEdges(points) > 0
    broken = whole.copy()
    broken[30:34] = False  # in all vertical edges
    broken[:, 508:] = broken[:, :4] = False  # and in those along the seam
    closed = rangeedge.closeContours(broken.astype(np.uint8), points) > 0
    assert (closed | ~broken).all()
    assert near(closed & ~broken, borders(faces)) > 0.95
    assert (closed & ~broken).sum() > 0.7 * (whole & ~broken).sum()


def test_noise_is_smoothed_all_around():
    rays, ranges, _ = sweep(64, 22.5, (180, -180))
    truth = rays * ranges[..., None]
    points, _ = room(64)
    cleaned, changed = rangeedge.cleanDepth(points)
    off = np.linalg.norm(cleaned - truth, axis=2), np.linalg.norm(points - truth, axis=2)
    assert off[0].max() < 0.05
    assert np.sqrt((off[0] ** 2).mean()) < 0.7 * np.sqrt((off[1] ** 2).mean())
    assert (changed == rangeedge.CLEAN_SMOOTHED).mean() > 0.98


def test_pixels_at_the_seam_are_explained():
    points, _ = room(columns=57)
    edges = detectEdges(points)
    for x in (0, 1, COLUMNS - 2, COLUMNS - 1):
        for y in (10, 30, 50):
            why = rangeedge.explainPixel(points, x, y)
            assert why.edge == bool(edges[y, x])
            assert why.stage != "line"


@pytest.mark.parametrize("origin", [None, (4, -7, 1.1)])
@pytest.mark.parametrize("units", [False, True])
def test_outlines_all_around_lie_on_their_walls(units, origin):
    points, faces = room(columns=57)
    if origin:
        points = points + origin
    labels = (faces + 1).astype(np.int32)
    tolerance = 0.05 if units else 1.0
    outlines = rangeedge.regionBoundaries(labels, points, tolerance, units=units, origin=origin)
    assert {outline.label for outline in outlines} == set(range(1, 7))
    for outline in outlines:
        axis, place = WALLS[outline.label - 1]
        off = outline.outline["point"][:, axis] - place - (origin or (0, 0, 0))[axis]
        assert np.abs(off).max() < 0.01
