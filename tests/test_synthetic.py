"""Scenes against their equations, truth known by hand, and the statistics of every noise model."""

import cv2
import numpy as np
import pytest

from rangeedge import error
from rangeedge import synthetic as syn
from rangeedge.constants import (
    DIR_ALL,
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
)
from rangeedge.io.calibration import perceptronPoints

SMALL = np.array([[130.0, 0, 79.5], [0, 130.0, 59.5], [0, 0, 1]])
CAMERAS = {
    "pinhole": syn.pinholeCamera(SMALL, (160, 120)),
    "orthographic": syn.orthographicCamera((0.008, 0.008), (160, 120), 1.0),
}
CLOSED = {
    "box": (syn.box((0.02, 0.01, 1.2), (0.3, 0.2, 0.25), cv2.Rodrigues(np.array([0.5, 0.6, 0.2]))[0]), 3),
    "sphere": (syn.sphere((0.05, -0.02, 1.1), 0.2), 1),
    "cylinder": (syn.cylinder((0, 0, 1.2), (0.4, 1, -0.7), 0.15, 0.4), 2),
    "cone": (syn.cone((0, -0.3, 1.1), (0.1, 1, -0.4), 0.2, 0.5), 2),
}


@pytest.fixture(params=CAMERAS)
def camera(request):
    return CAMERAS[request.param]


@pytest.fixture(scope="module")
def demo():
    return syn.renderScene(syn.demoScene(), syn.kinectCamera())


def seen(rendering):
    return rendering.labels > 0


class TestHits:
    """Every point satisfies the equation of the surface that it was said to be on."""

    def test_sphere(self, camera):
        rendering = syn.renderScene([syn.sphere((0.05, -0.02, 1.1), 0.2)], camera)
        points, normals = rendering.points[seen(rendering)], rendering.normals[seen(rendering)]
        assert len(points) > 500
        np.testing.assert_allclose(np.linalg.norm(points - (0.05, -0.02, 1.1), axis=1), 0.2, atol=1e-12)
        np.testing.assert_allclose(normals, (points - (0.05, -0.02, 1.1)) / 0.2, atol=1e-11)

    def test_plane(self, camera):
        normal = np.array([0.3, -0.5, -0.8])
        rendering = syn.renderScene([syn.plane((0, 0, 1), normal)], camera)
        np.testing.assert_allclose((rendering.points - (0, 0, 1)) @ normal, 0, atol=1e-12)
        np.testing.assert_allclose(
            rendering.normals, np.broadcast_to(normal / np.linalg.norm(normal), rendering.normals.shape), atol=1e-15
        )

    def test_cylinder(self, camera):
        axis = np.array([0.4, 1, -0.7]) / np.linalg.norm([0.4, 1, -0.7])
        rendering = syn.renderScene([CLOSED["cylinder"][0]], camera)
        local = rendering.points - (0, 0, 1.2)
        along = local @ axis
        across = np.linalg.norm(local - along[..., None] * axis, axis=-1)
        mantle, caps = rendering.faces == 0, rendering.faces > 0
        assert mantle.sum() > 300
        assert caps.sum() > 100
        np.testing.assert_allclose(across[mantle], 0.15, atol=1e-12)
        assert np.abs(along[mantle]).max() <= 0.2 + 1e-8
        np.testing.assert_allclose(np.abs(along[caps]), 0.2, atol=1e-12)
        assert across[caps].max() <= 0.15 + 1e-8

    def test_cone(self, camera):
        axis = np.array([0.1, 1, -0.4]) / np.linalg.norm([0.1, 1, -0.4])
        rendering = syn.renderScene([CLOSED["cone"][0]], camera)
        local = rendering.points - (0, -0.3, 1.1)
        along = local @ axis
        across = np.linalg.norm(local - along[..., None] * axis, axis=-1)
        mantle, base = rendering.faces == 0, rendering.faces == 1
        assert mantle.sum() > 300
        assert base.sum() > 50
        np.testing.assert_allclose(across[mantle], along[mantle] * 0.2 / 0.5, atol=1e-8)
        assert along[mantle].min() >= 0
        assert along[mantle].max() <= 0.5 + 1e-8
        np.testing.assert_allclose(along[base], 0.5, atol=1e-12)

    def test_box(self, camera):
        axes = cv2.Rodrigues(np.array([0.5, 0.6, 0.2]))[0]
        rendering = syn.renderScene([CLOSED["box"][0]], camera)
        local = np.abs((rendering.points[seen(rendering)] - (0.02, 0.01, 1.2)) @ axes) * 2 / (0.3, 0.2, 0.25)
        np.testing.assert_allclose(local.max(1), 1, atol=1e-7)

    @pytest.mark.parametrize("name", CLOSED)
    def test_nothing_farther_than_the_front(self, camera, name):
        """Marching along each ray finds the body no earlier than the ray caster does, and finds it there."""
        solid = CLOSED[name][0]
        rendering = syn.renderScene([solid], camera)
        origins, directions = (part[::7] for part in camera.rays(*camera.pixels()))
        quadrics = [quadric for face in solid.faces for quadric in (face.quadric, *face.clips)]

        def inside(points):
            one = np.column_stack([points, np.ones(len(points))])
            return np.all([((one @ quadric) * one).sum(1) <= 0 for quadric in quadrics], axis=0)

        first = np.full(len(origins), np.nan)
        for depth in np.arange(0.6, 1.7, 0.01):
            new = np.isnan(first) & inside(origins + depth * directions)
            first[new] = depth
        found = rendering.depth.ravel()[::7]
        both = np.isfinite(first) & np.isfinite(found)
        assert both.sum() > 0.9 * np.isfinite(found).sum()
        assert not (np.isfinite(first) & np.isnan(found)).any()
        assert (first[both] - found[both]).min() > -1e-9
        assert (first[both] - found[both]).max() < 0.01 + 1e-9

    @pytest.mark.parametrize("name", CLOSED)
    def test_normals_are_unit_and_face_the_viewer(self, camera, name):
        rendering = syn.renderScene([CLOSED[name][0]], camera)
        _, directions = camera.rays(*camera.pixels())
        normals = rendering.normals[seen(rendering)]
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
        assert (normals * directions[seen(rendering).ravel()]).sum(1).max() <= 0

    @pytest.mark.parametrize("name", CLOSED)
    def test_faces(self, camera, name):
        rendering = syn.renderScene([CLOSED[name][0]], camera)
        assert rendering.labels.max() == CLOSED[name][1]
        assert np.isnan(rendering.depth[~seen(rendering)]).all()
        assert np.isfinite(rendering.depth[seen(rendering)]).all()

    def test_no_cracks_between_faces(self):
        """Rays exactly through the edges of a box hit the box."""
        camera = syn.orthographicCamera((0.1, 0.1), (11, 11), 1.0)
        rendering = syn.renderScene([syn.box((0, 0, 1), (0.6, 0.6, 0.6), np.eye(3))], camera)
        assert seen(rendering).sum() == 49
        np.testing.assert_allclose(rendering.depth[2:9, 2:9], 0.7, atol=1e-9)


class TestTruth:
    def test_step(self, camera):
        rendering = syn.renderScene(syn.step(0.05), camera)
        assert (rendering.edges(0.01, 10)[:, 79:81] == 1).all()
        assert (rendering.edges(0.01, 10) > 0).sum() == 2 * 120
        np.testing.assert_allclose(rendering.jump[:, 79:81], 0.05, rtol=1e-6)
        assert (rendering.kind[:, 79] == EDGE_JUMP | EDGE_OCCLUDING).all()
        assert (rendering.kind[:, 80] == EDGE_JUMP | EDGE_OCCLUDED).all()
        np.testing.assert_allclose(rendering.crossings["x"], 79.5, atol=1e-6)
        assert not rendering.edges(0.06, 10).any()

    @pytest.mark.parametrize("orientation", [0, 25, 90, -45])
    def test_slanted_step(self, orientation):
        """On parallel rays the jump of parallel planes is the same everywhere, whatever their slant."""
        rendering = syn.renderScene(syn.step(0.03, orientation, 60), CAMERAS["orthographic"])
        assert len(rendering.crossings) > 300
        np.testing.assert_allclose(rendering.crossings["jump"], 0.03, rtol=1e-9)
        np.testing.assert_allclose(rendering.crossings["crease"], 0, atol=1e-6)
        across = np.cos(np.radians(orientation)), np.sin(np.radians(orientation))
        shift = (rendering.crossings["x"] - 79.5) * across[0] + (rendering.crossings["y"] - 59.5) * across[1]
        np.testing.assert_allclose(shift, 0, atol=1e-6)

    @pytest.mark.parametrize("convex", [True, False])
    @pytest.mark.parametrize(("angle", "orientation", "slant"), [(40, 0, 0), (90, 30, 20), (5, 90, -50), (120, -60, 0)])
    def test_roof(self, camera, angle, orientation, slant, convex):
        rendering = syn.renderScene(syn.roof(angle, orientation, slant, convex), camera)
        crossings = rendering.crossings
        assert len(crossings) > 300
        np.testing.assert_allclose(crossings["crease"], angle, atol=1e-9)
        assert (crossings["jump"] == 0).all()
        assert (crossings["convex"] == convex).all()
        across = np.cos(np.radians(orientation)), np.sin(np.radians(orientation))
        shift = (crossings["x"] - 79.5) * across[0] + (crossings["y"] - 59.5) * across[1]
        np.testing.assert_allclose(shift, 0, atol=1e-5)
        types = rendering.kind & (EDGE_JUMP | EDGE_CONVEX | EDGE_CONCAVE)
        edge = types > 0
        assert (types[edge] == (EDGE_CONVEX if convex else EDGE_CONCAVE)).all()
        np.testing.assert_allclose(rendering.crease[edge], angle, atol=1e-5)
        assert (rendering.edges(0.001, angle - 1)[edge] == (2 if convex else 3)).all()
        assert not np.isin(rendering.edges(0.001, angle + 1), (1, 2, 3)).any()

    def test_roof_bulges_as_it_says(self, camera):
        convex, concave = (syn.renderScene(syn.roof(60, convex=c), camera).depth[60] for c in (True, False))
        assert convex[80] < convex[20]
        assert convex[80] < convex[140]
        assert concave[80] > concave[20]
        assert concave[80] > concave[140]

    def test_crease_at_one_side_of_the_view_is_as_sharp(self):
        """The angle is the one in space, wherever in the image the crease lies."""
        pair = syn.planePair((-0.5, 0.2, -1), (0.7, 0.1, -1), (0.3, 0.2, 1.0))
        rendering = syn.renderScene(pair, CAMERAS["pinhole"])
        a, b = (np.array(n) / np.linalg.norm(n) for n in ((-0.5, 0.2, -1), (0.7, 0.1, -1)))
        np.testing.assert_allclose(rendering.crossings["crease"], np.degrees(np.arccos(a @ b)), atol=1e-9)
        assert rendering.crossings["convex"].all()

    def test_two_cylinders(self, camera):
        rendering = syn.renderScene(syn.twoCylinders(), camera)
        assert rendering.labels.max() == 2
        np.testing.assert_allclose(rendering.crossings["crease"], 36.3, atol=1e-4)
        assert not rendering.crossings["convex"].any()
        assert (rendering.crossings["jump"] == 0).all()
        np.testing.assert_allclose(rendering.crossings["x"], 79.5, atol=1e-5)
        np.testing.assert_allclose(rendering.depth[60, 79:81], 1.0, atol=2e-3)

    def test_sphere_has_no_edges_inside(self, camera):
        rendering = syn.renderScene([syn.sphere((0, 0, 1), 0.2)], camera)
        assert len(rendering.crossings) == 0
        assert set(np.unique(rendering.edges(0, 0))) == {0, 4}
        assert set(np.unique(rendering.kind)) == {0, EDGE_BOUNDARY}
        beside = cv2.dilate((~seen(rendering)).astype(np.uint8), np.ones((3, 3))) > 0
        np.testing.assert_array_equal(rendering.kind == EDGE_BOUNDARY, beside & seen(rendering))

    def test_sphere_before_a_wall(self):
        """On parallel rays the silhouette is a circle at the depth of the centre."""
        camera = CAMERAS["orthographic"]
        rendering = syn.renderScene([syn.plane((0, 0, 1.5), (0, 0, -1)), syn.sphere((0, 0, 1), 0.2)], camera)
        crossings = rendering.crossings
        np.testing.assert_allclose(np.hypot(crossings["x"] - 79.5, crossings["y"] - 59.5) * 0.008, 0.2, atol=1e-8)
        np.testing.assert_allclose(crossings["jump"], 0.5, atol=1e-3)
        np.testing.assert_array_equal(rendering.depth.ravel()[crossings["first"]] < 1.4, crossings["nearer"])
        near = seen(rendering) & (rendering.depth < 1.4)
        assert (near[(rendering.kind & EDGE_OCCLUDING) > 0]).all()
        assert (~near[(rendering.kind & EDGE_OCCLUDED) > 0]).all()

    def test_box_on_table(self):
        """Seen straight from above: a jump of the box's height all around, and no crease."""
        camera = CAMERAS["orthographic"]
        scene = [syn.plane((0, 0, 1), (0, 0, -1)), syn.box((0, 0, 0.95), (0.4, 0.3, 0.1))]
        rendering = syn.renderScene(scene, camera)
        np.testing.assert_allclose(rendering.crossings["jump"], 0.1, atol=1e-9)
        assert rendering.labels.max() == 2

    def test_contact_of_box_and_table_is_concave(self):
        rendering = syn.renderScene(
            [syn.plane((0, 0.2, 1), (0, -1, 0)), syn.box((0, 0.1, 1.2), (0.4, 0.2, 0.2), np.eye(3))], CAMERAS["pinhole"]
        )
        contact = (rendering.crossings["jump"] == 0) & ~rendering.crossings["convex"]
        np.testing.assert_allclose(rendering.crossings["crease"][contact], 90, atol=1e-9)
        # y = 0.2 at depth 1.1 of the front.
        rows = rendering.crossings["y"][contact]
        np.testing.assert_allclose(rows, 59.5 + 130 * 0.2 / 1.1, atol=1e-5)

    def test_jump_outranks_crease_and_both_sides_are_marked(self, demo):
        crossings, edges = demo.crossings, demo.edges(0.01, 20).ravel()
        for field, low, classes in (("jump", 0.01, {1}), ("crease", 20, {1, 2, 3})):
            strong = crossings[crossings[field] > low]
            for side in ("first", "second"):
                assert set(np.unique(edges[strong[side]])) <= classes
        assert {1, 2, 3} <= set(np.unique(edges))

    def test_largest_jump_and_crease(self):
        scene = [syn.plane((0, 0, 1.5), (0.2, 0.1, -1)), CLOSED["box"][0]]
        rendering = syn.renderScene(scene, CAMERAS["pinhole"])
        jump, crease = np.zeros(160 * 120), np.zeros(160 * 120)
        for crossing in rendering.crossings:
            for side in (crossing["first"], crossing["second"]):
                jump[side] = max(jump[side], crossing["jump"])
                if crossing["jump"] == 0:
                    crease[side] = max(crease[side], crossing["crease"])
        assert (jump > 0).sum() > 100
        assert (crease > 0).sum() > 100
        np.testing.assert_array_equal(rendering.jump.ravel(), jump.astype(np.float32))
        np.testing.assert_array_equal(rendering.crease.ravel(), crease.astype(np.float32))

    def test_crossings_lie_between_neighbours(self, camera):
        rendering = syn.renderScene([syn.plane((0, 0, 1.5), (0.2, 0.1, -1)), CLOSED["box"][0]], camera)
        crossings = rendering.crossings
        first, second = (np.stack(np.divmod(crossings[s], 160)[::-1]) for s in ("first", "second"))
        assert (np.abs(first - second).max(0) == 1).all()
        assert np.bitwise_or.reduce(crossings["direction"]) == DIR_ALL
        at = np.stack([crossings["x"], crossings["y"]])
        np.testing.assert_allclose(
            np.linalg.norm(at - first, axis=0) + np.linalg.norm(at - second, axis=0),
            np.linalg.norm(first - second, axis=0),
            atol=1e-6,
        )
        faces = rendering.faces.ravel()
        assert (faces[crossings["first"]] != faces[crossings["second"]]).all()

    def test_labels_are_the_connected_parts_of_faces(self):
        """A bar before a plane cuts it in two."""
        rendering = syn.renderScene(
            [syn.plane((0, 0, 2), (0, 0, -1)), syn.box((0, 0, 1), (0.1, 9, 0.1))], CAMERAS["orthographic"]
        )
        assert sorted(np.unique(rendering.labels)) == [1, 2, 3]
        assert rendering.labels[60, 10] != rendering.labels[60, 150]
        assert rendering.faces[60, 10] == rendering.faces[60, 150] == 0

    @pytest.mark.parametrize("make", [syn.polyhedraScene, syn.curvedScene])
    @pytest.mark.parametrize("seed", [0, 1, 2])
    def test_labels_are_connected_and_within_one_face(self, make, seed):
        rendering = syn.renderScene(make(seed, CAMERAS["pinhole"]), CAMERAS["pinhole"])
        assert rendering.labels.max() > 10
        assert (rendering.labels > 0).all()
        for label in range(1, rendering.labels.max() + 1):
            here = rendering.labels == label
            assert cv2.connectedComponents(here.astype(np.uint8), connectivity=8)[0] == 2
            assert len(np.unique(rendering.faces[here])) == 1
        assert {1, 2, 3} <= set(np.unique(rendering.edges(0.01, 15)))


class TestCameras:
    def test_pinhole_agrees_with_cv2(self):
        rendering = syn.renderScene([CLOSED["box"][0]], CAMERAS["pinhole"])
        points = rendering.points[seen(rendering)]
        projected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), SMALL, None)[0][:, 0]
        rows, cols = np.nonzero(seen(rendering))
        np.testing.assert_allclose(projected, np.column_stack([cols, rows]), atol=1e-9)
        np.testing.assert_array_equal(rendering.depth[seen(rendering)], points[:, 2])

    def test_orthographic_grid(self):
        points = syn.renderScene([syn.plane((0, 0, 1), (0.5, 0, -1))], CAMERAS["orthographic"]).points
        np.testing.assert_allclose(np.diff(points[..., 0], axis=1), 0.008, atol=1e-12)
        np.testing.assert_allclose(np.diff(points[..., 1], axis=0), 0.008, atol=1e-12)
        np.testing.assert_allclose(points[:, :, :2].mean((0, 1)), 0, atol=1e-12)

    def test_perceptron_rays_are_unit_and_span_its_field(self):
        camera = syn.perceptronCamera()
        _, directions = camera.rays(np.array([-0.5, 511.5, 255.5, 255.5]), np.array([255.5, 255.5, -0.5, 511.5]))
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-12)
        angles = np.degrees(np.arccos([directions[0] @ directions[1], directions[2] @ directions[3]]))
        np.testing.assert_allclose(angles, [51.65, 36.73], atol=1e-9)
        assert directions[0, 0] < 0 < directions[1, 0]
        assert directions[2, 1] < 0 < directions[3, 1]

    def test_abw_view(self):
        width, height = syn.abwCamera().view()
        assert width == pytest.approx(511 * 930 / 1586.072821)
        assert height == pytest.approx(511 * 930 / 1586.072821 / 1.4508)


@pytest.fixture(scope="module")
def slope():
    """A slanted plane by a Kinect."""
    return syn.renderScene([syn.plane((0, 0, 1.5), (0.3, 0.6, -1))], syn.kinectCamera())


@pytest.fixture(scope="module")
def abw():
    camera = syn.abwCamera()
    return syn.renderScene(syn.polyhedraScene(3, camera), camera)


@pytest.fixture(scope="module")
def perceptron():
    camera = syn.perceptronCamera()
    return syn.renderScene([syn.plane((0, 0, 450), (0.2, 0.3, -1))], camera)


class TestNoise:
    def test_gaussian(self, slope):
        scan = syn.gaussianNoise(slope, 0.004, 1)
        noise = scan.src - slope.depth
        assert scan.src.dtype == np.float32
        assert scan.raw is None
        assert set(scan.geometry) == {"K"}
        assert noise.std() == pytest.approx(0.004, rel=0.02)
        assert abs(noise.mean()) < 4 * 0.004 / 554
        neighbours = np.mean(noise[:, 1:] * noise[:, :-1]) / noise.var()
        assert abs(neighbours) < 0.02

    def test_gaussian_follows_depth(self, slope):
        noise = syn.gaussianNoise(slope, lambda z: 0.002 * z**2).src - slope.depth
        assert (noise / slope.depth**2).std() == pytest.approx(0.002, rel=0.02)

    def test_triangulation(self):
        camera = syn.orthographicCamera((0.5, 0.5), (256, 256))
        rendering = syn.renderScene([syn.plane((0, 0, 256), (0, 0, -1)), syn.box((0, 0, 246), (40, 40, 20))], camera)
        scan = syn.triangulationNoise(rendering, 0.05, light=(156, 0, 0))
        lost = np.isnan(scan.src)
        assert np.nanstd(scan.src - rendering.depth) == pytest.approx(0.05, rel=0.02)
        assert scan.geometry == {"pixelSize": (0.5, 0.5)}
        # The ray from x = 156, z = 0 over the box's left upper edge, x = -20, z = 236, meets z = 256 at x = -34.9.
        x = rendering.points[128, lost[128], 0]
        assert x.min() == pytest.approx(-20 - 20 * 176 / 236, abs=0.5)
        assert x.max() == pytest.approx(-20, abs=0.5)
        assert not lost[0].any()

    def test_abw_steps(self, abw):
        scan = syn.abwNoise(abw)
        valid = scan.raw > 0
        assert scan.raw.dtype == np.uint8
        assert scan.src.shape == (512, 512, 3)
        assert scan.geometry == {}
        np.testing.assert_array_equal(np.isnan(scan.src).any(-1), ~valid)
        steps = (scan.src[valid][:, 2].astype(np.float64) - 771.016866) * 0.791686
        np.testing.assert_allclose(steps, scan.raw[valid], atol=1e-3)
        assert 0.02 < (~valid).mean() < 0.4

    def test_abw_noise(self, abw):
        scan = syn.abwNoise(abw, 0.6)
        valid = scan.raw > 0
        noise = (scan.src[..., 2] - abw.depth)[valid]
        assert noise.std() == pytest.approx(np.hypot(0.6, 1 / 0.791686 / np.sqrt(12)), rel=0.02)
        assert abs(noise.mean()) < 0.01
        exact = syn.abwNoise(abw, 0.0)
        assert np.abs((exact.src[..., 2] - abw.depth)[exact.raw > 0]).max() <= 0.5 / 0.791686 + 1e-3

    def test_abw_points_lie_on_the_lines_of_sight(self, abw):
        scan = syn.abwNoise(abw)
        valid = scan.raw > 0
        ratio = scan.src[valid] / scan.src[valid][:, 2:]
        np.testing.assert_allclose(ratio, abw.points[valid] / abw.points[valid][:, 2:], atol=1e-6)

    def test_perceptron(self, perceptron):
        scan = syn.perceptronNoise(perceptron, 0.8)
        origins, directions = perceptron.camera.rays(*perceptron.camera.pixels())
        along = scan.src.reshape(-1, 3) - origins
        ranges = (along * directions).sum(1)
        np.testing.assert_allclose(along, ranges[:, None] * directions, atol=1e-3)
        noise = ranges - perceptron.depth.ravel()
        assert noise.std() == pytest.approx(np.hypot(0.8, 0.20236 / np.sqrt(12)), rel=0.02)
        assert scan.raw.dtype == np.uint16
        assert scan.raw.max() <= 4095
        assert scan.geometry == {}

    def test_perceptron_steps(self, perceptron):
        scan = syn.perceptronNoise(perceptron, 0.0)
        ranges = np.linalg.norm(
            scan.src - perceptron.camera.rays(*perceptron.camera.pixels())[0].reshape(512, 512, 3), axis=-1
        )
        assert np.abs(ranges - perceptron.depth).max() <= 0.20236 / 2 + 1e-3
        # Along one line of sight one code is one step.
        apart = perceptronPoints(scan.raw + np.uint16(1)) - scan.src
        np.testing.assert_allclose(np.linalg.norm(apart, axis=-1), 0.20236, atol=2e-4)

    def test_perceptron_mixes_depths_at_jumps_only(self):
        camera = syn.perceptronCamera()
        rendering = syn.renderScene(syn.step(60.0, 20.0, distance=400.0), camera)
        scan = syn.perceptronNoise(rendering, 0.0)
        z = scan.src[..., 2]
        edge = rendering.jump > 0
        between = (z > 405) & (z < 455)
        assert 0 < between[edge].mean() < 0.8
        assert not between[~edge].any()

    def test_kinect_steps(self, slope):
        scan = syn.kinectNoise(slope)
        valid = scan.raw > 0
        assert scan.src.dtype == np.uint16
        assert set(scan.geometry) == {"K"}
        np.testing.assert_array_equal(scan.src > 0, valid)
        np.testing.assert_array_equal(scan.src[valid], np.rint(1000 * 525 * 0.075 * 8 / scan.raw[valid]))
        assert (~valid).mean() == pytest.approx(0.005, abs=0.001)

    def test_kinect_noise_is_constant_in_inverse_depth_and_correlated(self, slope):
        scan = syn.kinectNoise(slope, 0.0014, holes=0)
        noise = 1000 / scan.src.astype(np.float64) - 1 / slope.depth
        step = 1 / (525 * 0.075 * 8)
        for rows in (slice(0, 160), slice(320, 480)):
            assert noise[rows].std() == pytest.approx(np.hypot(0.0014, step / np.sqrt(12)), rel=0.05)
        assert np.mean(noise[:, 1:] * noise[:, :-1]) / noise.var() > 0.4
        far = np.mean(noise[:, 20:] * noise[:, :-20]) / noise.var()
        assert abs(far) < 0.02

    def test_kinect_shadow_lies_left_of_the_nearer_surface(self):
        """Width of the shadow: f b (1 / z_near - 1 / z_far) pixels."""
        camera = syn.kinectCamera()
        scene = [syn.plane((0, 0, 2), (0, 0, -1)), syn.box((0, 0, 1.05), (0.4, 0.4, 0.1))]
        scan = syn.kinectNoise(syn.renderScene(scene, camera), 0.0, jitter=0, holes=0)
        lost = np.flatnonzero(scan.src[240] == 0)
        assert len(lost) == pytest.approx(525 * 0.075 * (1 - 1 / 2), abs=1)
        assert (np.diff(lost) == 1).all()
        left_edge = 319.5 - 525 * 0.2
        assert lost[-1] == pytest.approx(left_edge, abs=1)

    def test_kinect_jitter_moves_edges_and_nothing_else(self):
        camera = syn.kinectCamera()
        rendering = syn.renderScene(syn.step(0.5, slant=30), camera)
        scan = syn.kinectNoise(rendering, 0.0, jitter=1.0, holes=0)
        exact = syn.kinectNoise(rendering, 0.0, jitter=0.0, holes=0)
        moved = scan.src != exact.src
        rows, cols = np.nonzero(moved)
        assert len(rows) > 100
        assert np.abs(cols - 319.5).max() < 6
        assert len(np.unique(rows)) > 200

    @pytest.mark.parametrize(
        ("noise", "scene"),
        [
            (lambda r, s: syn.gaussianNoise(r, 0.1, s), "slope"),
            (lambda r, s: syn.triangulationNoise(r, 0.1, s), "slope"),
            (lambda r, s: syn.abwNoise(r, 0.6, s), "abw"),
            (lambda r, s: syn.perceptronNoise(r, 0.8, s), "perceptron"),
            (lambda r, s: syn.kinectNoise(r, 0.0014, s), "slope"),
        ],
    )
    def test_same_seed_same_scan(self, request, noise, scene):
        rendering = request.getfixturevalue(scene)
        before = rendering.depth.copy()
        first, second = noise(rendering, 7), noise(rendering, np.random.default_rng(7))
        np.testing.assert_array_equal(first.src, second.src)
        assert not np.array_equal(first.src, noise(rendering, 8).src, equal_nan=True)
        np.testing.assert_array_equal(rendering.depth, before)


class TestScenes:
    @pytest.mark.parametrize("make", [syn.polyhedraScene, syn.curvedScene])
    def test_seeds(self, make):
        camera = CAMERAS["pinhole"]
        depth = [syn.renderScene(make(seed, camera), camera).depth for seed in (5, 5, 6)]
        np.testing.assert_array_equal(depth[0], depth[1])
        assert not np.array_equal(depth[0], depth[2])

    def test_demo(self, demo):
        assert np.isfinite(demo.depth).all()
        assert 20 <= demo.labels.max() <= 40
        assert 0.5 < demo.depth.min() < demo.depth.max() < 4

    def test_polyhedron_is_a_box(self):
        planes = np.array([[1, 0, 0, 2], [-2, 0, 0, 2], [0, 1, 0, 1], [0, -1, 0, 1], [0, 0, 1, 5], [0, 0, -1, -4.0]])
        solid = syn.polyhedron(planes)
        np.testing.assert_allclose(solid.center, (0.5, 0, 4.5), atol=1e-12)
        assert solid.radius == pytest.approx(np.linalg.norm([1.5, 1, 0.5]))


def bad(call, *words):
    with pytest.raises(error) as caught:
        call()
    for word in words:
        assert word in str(caught.value)


class TestErrors:
    def test_solids(self):
        bad(lambda: syn.plane((0, 0), (0, 0, 1)), "plane", "`point`")
        bad(lambda: syn.plane((0, 0, 1), (0, 0, 0)), "plane", "`normal`")
        bad(lambda: syn.plane("abc", (0, 0, 1)), "`point`")
        bad(lambda: syn.box((0, 0, 1), (1, 0, 1)), "box", "`size`")
        bad(lambda: syn.box((0, 0, 1), (1, 1, 1), 2 * np.eye(3)), "`rotation`")
        bad(lambda: syn.sphere((0, 0, np.nan), 1), "sphere", "`center`")
        bad(lambda: syn.sphere((0, 0, 1), 0), "`radius`")
        bad(lambda: syn.cylinder((0, 0, 1), (0, 1, 0), 1, -1), "cylinder", "`height`")
        bad(lambda: syn.cone((0, 0, 1), (0, 1, 0), True, 1), "cone", "`radius`")

    def test_polyhedra(self):
        cube = np.array([[1, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1], [0, 0, 1, 1], [0, 0, -1, 1.0]])
        syn.polyhedron(cube)
        bad(lambda: syn.polyhedron(cube[:5]), "polyhedron", "`planes`")
        bad(lambda: syn.polyhedron(cube * (1, 1, 1, -1)), "`planes`")
        bad(lambda: syn.polyhedron(cube[:, :3]), "`planes`")
        bad(lambda: syn.polyhedron(cube[:1]), "`planes`")
        bad(lambda: syn.polyhedron(np.vstack([cube, [0, 0, 0, 1]])), "`planes`")

    def test_cameras(self):
        bad(lambda: syn.pinholeCamera(np.eye(2), (10, 10)), "pinholeCamera", "`K`")
        bad(lambda: syn.pinholeCamera(SMALL, 10), "`size`")
        bad(lambda: syn.pinholeCamera(SMALL, (10, 1)), "`size[1]`")
        bad(lambda: syn.pinholeCamera(SMALL, (10, 10), 0), "`distance`")
        bad(lambda: syn.orthographicCamera((1, 0), (10, 10)), "orthographicCamera", "`pixelSize`")
        bad(lambda: syn.orthographicCamera(1, (10, 10)), "`pixelSize`")

    def test_rendering(self, abw):
        camera = CAMERAS["pinhole"]
        bad(lambda: syn.renderScene([], camera), "renderScene", "`scene`")
        bad(lambda: syn.renderScene(syn.sphere((0, 0, 1), 1), camera), "`scene`")
        bad(lambda: syn.renderScene(syn.step(1.0), None), "`camera`")
        bad(lambda: abw.edges(-1, 20), "edges", "`jumpThreshold`")
        bad(lambda: abw.edges(0, 190), "`creaseThreshold`")

    def test_noise(self, slope, abw, perceptron):
        bad(lambda: syn.gaussianNoise(slope.depth, 0.1), "gaussianNoise", "`rendering`")
        bad(lambda: syn.gaussianNoise(slope, -0.1), "`sigma`")
        bad(lambda: syn.gaussianNoise(slope, lambda z: -z), "`sigma`")
        bad(lambda: syn.gaussianNoise(slope, 0.1, 0.5), "`seed`")
        bad(lambda: syn.gaussianNoise(slope, 0.1, -1), "`seed`")
        bad(lambda: syn.triangulationNoise(slope, light=(0, 0)), "triangulationNoise", "`light`")
        bad(lambda: syn.abwNoise(slope), "abwNoise", "abwCamera")
        bad(lambda: syn.abwNoise(perceptron), "abwNoise", "abwCamera")
        bad(lambda: syn.perceptronNoise(abw), "perceptronNoise", "perceptronCamera")
        bad(lambda: syn.kinectNoise(perceptron), "kinectNoise", "pinhole")
        bad(lambda: syn.kinectNoise(slope, holes=1.5), "`holes`")

    def test_scenes(self):
        bad(lambda: syn.roof(0), "roof", "`angle`")
        bad(lambda: syn.roof(100, slant=45), "`slant`")
        bad(lambda: syn.step(-1), "step", "`height`")
        bad(lambda: syn.planePair((0, 0, -1), (0, 0, -2)), "planePair", "`second`")
        bad(lambda: syn.planePair((0, 0, 1), (1, 0, -2)), "`first`")
        bad(lambda: syn.planePair((0, 0, -1), (1, 0, -2), convex=1), "`convex`")
        bad(lambda: syn.twoCylinders(181), "twoCylinders", "`angle`")
        bad(lambda: syn.polyhedraScene(-1, CAMERAS["pinhole"]), "polyhedraScene", "`seed`")
        bad(lambda: syn.curvedScene(0, SMALL), "curvedScene", "`camera`")


def test_nothing_in_view():
    for camera, noise in (
        (syn.kinectCamera(), syn.kinectNoise),
        (syn.abwCamera(), syn.abwNoise),
        (syn.perceptronCamera(), syn.perceptronNoise),
        (syn.kinectCamera(), syn.triangulationNoise),
    ):
        rendering = syn.renderScene([syn.sphere((0, 0, -5), 1)], camera)
        assert not rendering.labels.any()
        assert not rendering.kind.any()
        assert not rendering.jump.any()
        assert not np.nan_to_num(noise(rendering).src).any()
