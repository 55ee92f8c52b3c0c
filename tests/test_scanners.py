"""Scanners that turn, lenses with distortion, clouds in other frames: the same scene gives the same edges."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import detectEdges, edgePoints, edgeStrength, segmentRegions
from rangeedge.frame import read_frame
from rangeedge.options import ScanLineParams
from rangeedge.panorama import _reversed
from rangeedge.viewpoint import View, distorted_rays, mean_ray, view_of

WALLS = ((0, 5.0), (0, -4.0), (1, 3.5), (1, -4.5), (2, -1.2), (2, 1.8))  # axis, place
COLUMNS = 512


def sweep(rows, elevation, azimuth, tilt=0.0):
    """Unit rays, ranges and faces of a room around a scanner that turns."""
    up = np.radians(np.linspace(elevation, -elevation, rows))[:, None]
    around = np.radians(np.linspace(*azimuth, COLUMNS, endpoint=azimuth[0] - azimuth[1] < 359))[None]
    rays = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up) + 0 * around], -1)
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    seen = rays @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    ranges, faces = np.full(rays.shape[:2], np.inf), np.zeros(rays.shape[:2], int)
    for face, (axis, place) in enumerate(WALLS):
        with np.errstate(divide="ignore"):
            there = place / seen[..., axis]
        nearer = (there > 0) & (there < ranges)
        ranges[nearer], faces[nearer] = there[nearer], face
    return rays, ranges, faces


def borders(faces):
    """Pixels beside another face, first and last column being neighbours."""
    found = (faces != np.roll(faces, 1, 1)) | (faces != np.roll(faces, -1, 1))
    found[1:] |= faces[1:] != faces[:-1]
    found[:-1] |= faces[1:] != faces[:-1]
    return found


def near(pixels, others, reach=2):
    """Share of pixels within `reach` of others, around the seam as well."""
    far = cv2.distanceTransform((~np.tile(others, 3)).astype(np.uint8), cv2.DIST_L2, 5)
    return (far[:, pixels.shape[1] : 2 * pixels.shape[1]][pixels] <= reach).mean()


def camera_axes(points):
    return np.stack([-points[..., 1], -points[..., 2], points[..., 0]], -1)


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


# Other frames than the sensor's.


K = np.array([[140.0, 0, 79.5], [0, 140, 59.5], [0, 0, 1]])
SHAPE = (120, 160)


def rays_of(shape=SHAPE):
    v, u = np.indices(shape)
    return np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(shape)], -1)


def depth_of(rays, noise=0.001):
    """A wall, a floor and a card before them."""
    x, y = rays[..., 0], rays[..., 1]
    with np.errstate(divide="ignore"):
        z = np.minimum(3.0, np.where(y > 0, 0.8 / y, np.inf))
    z = np.where((abs(x) < 0.25) & (y > -0.2) & (y < 0.15), 2.0 + 0.4 * x, z)
    return z + noise * np.random.default_rng(2).standard_normal(z.shape)


def turned(degrees):
    return cv2.Rodrigues(np.radians(np.array(degrees, float)))[0]


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("place", [(0.2, 0, 1.1), (4, -7, 1.1), (430, 250, 1)])
def test_clouds_in_another_frame(place, given):
    z = depth_of(rays_of())
    right = detectEdges(z, K=K)
    points = (rays_of() * z[..., None]) @ turned((30, 100, -20)).T + np.array(place)
    options = {"origin": place} if given else {}
    np.testing.assert_allclose(read_frame(points, ScanLineParams(**options)).origin, place, atol=0.02)
    edges = detectEdges(points, **options)
    assert near(edges > 0, right > 0) > 0.98
    assert near(right > 0, edges > 0) > 0.98
    assert segmentRegions(points, **options).max() == segmentRegions(z, K=K).max()


FIELDS = [(64, 45, (180, -180)), (96, 22, (135, -135)), (100, 15, (60, -60))]


@pytest.mark.parametrize("place", [(100, -20, 3), (1, 0, 0), (0, 0, 1), (0.3, 0.2, 0.1), (400000, 5e6, 120)])
@pytest.mark.parametrize(("rows", "elevation", "azimuth"), FIELDS)
def test_scans_in_another_frame(rows, elevation, azimuth, place):
    rays, ranges, _ = sweep(rows, elevation, azimuth)
    points = rays * (ranges + 0.005 * np.random.default_rng(1).standard_normal(ranges.shape))[..., None]
    right = detectEdges(points) > 0
    moved = points @ turned((20, -50, 140)).T + np.array(place)
    np.testing.assert_allclose(read_frame(moved, ScanLineParams()).origin, place, atol=0.05)
    edges = detectEdges(moved) > 0
    assert near(edges, right) > 0.98
    assert near(right, edges) > 0.98


@pytest.mark.parametrize("place", [(0, 0, 0), (0, 0, 1), (4, 0, 0), (0.3, 0.2, 0.1), (400000, 5e6, 120)])
@pytest.mark.parametrize(("rows", "up", "around"), [(128, 10, 10), (128, 8, 12), (64, 12, 15), (64, 14, 20)])
def test_narrow_scans_in_another_place(rows, up, around, place):
    rays, ranges, _ = sweep(rows, up, (around, -around))  # columns and walls are upright, as if seen in parallel
    ranges[rows // 3 : 2 * rows // 3, 150:330] *= 0.6  # a card before the wall
    points = rays * (ranges + 0.005 * np.random.default_rng(3).standard_normal(ranges.shape))[..., None]
    right = detectEdges(points) > 0
    frame = read_frame(points + np.array(place), ScanLineParams())
    assert frame.projective
    np.testing.assert_allclose(frame.origin, place, atol=0.05)
    edges = detectEdges(points + np.array(place)) > 0
    assert right.any()
    assert near(edges, right) > 0.98
    assert near(right, edges) > 0.98


@pytest.mark.parametrize("place", [(0, 0, 0), (0.05, 0.02, 0), (-4, -0.3, -0.2), (56, -31, 18), (-900, 1200, -2000)])
@pytest.mark.parametrize("scene", ["wall", "corner", "card"])
def test_images_of_few_planes_in_another_frame(scene, place):
    rays = rays_of()
    x, y = rays[..., 0], rays[..., 1]
    z = {"wall": 3 / (1 + 0.3 * x), "corner": 3 / (1 + 0.5 * abs(x - 0.01)), "card": 3 + 0 * x}[scene]
    z = np.where((abs(x) < 0.2) & (abs(y) < 0.15), 2.0, z) if scene == "card" else z
    z = z + 0.001 * np.random.default_rng(4).standard_normal(z.shape)
    right = detectEdges(z, K=K) > 0
    points = (rays * z[..., None]) @ turned((30, 100, -20)).T + np.array(place)
    edges = detectEdges(points) > 0
    assert edges.any() == right.any()
    if right.any():
        assert near(edges, right) > 0.98
        assert near(right, edges) > 0.98


def test_rows_of_a_scan_that_are_shifted_are_refused():
    rays, ranges, _ = sweep(64, 22.5, (180, -180))
    points = rays * ranges[..., None]
    raw = np.stack([np.roll(row, (0, 6, 12, 18)[i % 4], axis=0) for i, row in enumerate(points)])
    with pytest.raises(rangeedge.error, match="by origin"):
        detectEdges(raw)


def test_points_that_are_seen_from_nowhere_are_refused():
    points = np.random.default_rng(3).normal(size=(20, 30, 3)) + np.array([0, 0, 5])
    with pytest.raises(rangeedge.error, match="by origin"):
        edgeStrength(points)
    good = rays_of() * depth_of(rays_of())[..., None]
    with pytest.raises(rangeedge.error, match="`origin` must be where the rays of the points meet"):
        edgeStrength(good, origin=(1, 2, 0))
    for other in ({"K": K}, {"pixelSize": 1.0}):
        with pytest.raises(rangeedge.error, match="None where src holds points"):
            edgeStrength(good, **other)
    with pytest.raises(rangeedge.error, match="`origin` must be None where src holds no points"):
        edgeStrength(good[..., 2], K=K, origin=(0, 0, 0))
    with pytest.raises(rangeedge.error, match="`origin` must be None where heightMap"):
        edgeStrength(good, heightMap=True, origin=(0, 0, 0))


def test_the_direction_of_view_is_the_middle_of_a_wide_field():
    angles = np.linspace(-1.4, 1.4, 60)  # 160 degrees, of which the mean ray has a length of 0.7
    fan = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    np.testing.assert_allclose(mean_ray([fan]), (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(mean_ray([fan[:7], 3 * fan[7:]]), (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(mean_ray([fan, -fan]), (0, 0, 1))  # that of all around has none


@pytest.mark.parametrize("pixel", [(15, 0), (15, -1), (0, 16), (-1, 16)])
def test_a_wrong_pixel_at_the_end_of_a_line_leaves_the_viewpoint(pixel):
    z = 2 + 0.3 * np.sin(np.arange(64) / 9) * np.ones((48, 1))
    v, u = np.indices(z.shape)
    points = np.dstack([(u - 32) / 60 * z, (v - 24) / 60 * z, z])
    points[pixel] = (0.5, 1.5, 2)
    assert view_of(points, None) == View(True)


# A lens with distortion.


@pytest.mark.parametrize("coefficients", [(-0.25, 0.08, 0, 0), (0.15, -0.1, 0.001, -0.002, 0.02)])
def test_a_lens_with_distortion(coefficients):
    v, u = np.indices(SHAPE)
    pixels = np.stack([u, v], -1).reshape(-1, 1, 2).astype(float)
    rays = cv2.undistortPoints(pixels, K, np.array(coefficients))[:, 0].reshape(*SHAPE, 2)
    z = depth_of(np.dstack([rays, np.ones(SHAPE)]))
    found = edgeStrength(z, K=K, distCoeffs=coefficients)
    edges = detectEdges(z, K=K, distCoeffs=coefficients)
    # The edges of the undistorted scene, where the lens shows them.
    right = detectEdges(depth_of(rays_of()), K=K)
    v, u = np.nonzero(right)
    x = np.column_stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(len(u))])
    seen = cv2.projectPoints(x[:, None], np.zeros(3), np.zeros(3), K, np.array(coefficients))[0][:, 0]
    seen = np.rint(seen[((seen > 3) & (seen < np.array(SHAPE[::-1]) - 4)).all(axis=1)]).astype(int)
    there = np.zeros(SHAPE, bool)
    there[seen[:, 1], seen[:, 0]] = True
    inner = np.s_[4:-4, 4:-4]
    assert near(there[inner], edges[inner] > 0, 3) > 0.97
    assert near(edges[inner] > 0, there[inner], 3) > 0.97
    corner = (found.crease > 0) & (edges > 0) & (found.jump == 0)
    assert np.median(found.crease[corner]) == pytest.approx(90, abs=1)


def test_rays_through_a_skewed_lens_meet_their_pixels():
    camera, coefficients = np.array([[180.0, 25, 70], [0, 140, 55], [0, 0, 1]]), np.array([-0.2, 0.06, 0.001, -0.002])
    rays = distorted_rays(camera, coefficients, (110, 140)).reshape(-1, 1, 3)
    seen = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), coefficients)[0][:, 0]
    pixels = np.column_stack([seen, np.ones(len(seen))]) @ camera.T
    v, u = np.indices((110, 140))
    np.testing.assert_allclose(pixels[:, :2], np.column_stack([u.ravel(), v.ravel()]), atol=1e-6)


def test_no_distortion_changes_nothing():
    z = depth_of(rays_of())
    for a, b in zip(edgeStrength(z, K=K), edgeStrength(z, K=K, distCoeffs=np.zeros(5)), strict=True):
        np.testing.assert_array_equal(a, b)
    with pytest.raises(rangeedge.error, match="`distCoeffs` must be None where K is not given"):
        edgeStrength(z, distCoeffs=np.zeros(4))


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
