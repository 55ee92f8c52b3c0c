"""Edges as chains of points: against the exact edges of rendered boxes, and every rule by a scene that shows it."""

import itertools

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import (
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EdgeChain,
    EdgeChains,
    edgePoints,
    linkEdges,
    project,
)
from rangeedge.synthetic import box, kinectNoise, orthographicCamera, pinholeCamera, plane, renderScene, roof, sphere

K = np.array([[525.0, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])
CAMERA = pinholeCamera(K, (640, 480))
SIZE, CENTRE = np.array([0.3, 0.25, 0.2]), np.array([0.0, 0.0, 1.0])


class Box:
    """A box before a wall, and its twelve edges."""

    def __init__(self, seed):
        axes = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        self.rendering = renderScene([plane((0, 0, 1.3), (0.05, -0.3, -1)), box(CENTRE, SIZE, axes)], CAMERA)
        self.edges = []
        for axis, *signs in itertools.product(range(3), (-0.5, 0.5), (-0.5, 0.5)):
            ends = np.insert(np.tile(signs, (2, 1)), axis, (-0.5, 0.5), axis=1) * SIZE
            self.edges.append(CENTRE + ends @ axes.T)
        places = np.column_stack([self.rendering.crossings["x"], self.rendering.crossings["y"]])
        distances = np.array([distance_to(places, *project(e, K=K)[:, :2]) for e in self.edges])
        seen = np.bincount(distances.argmin(axis=0)[distances.min(axis=0) < 0.01], minlength=12)
        self.visible = [k for k in range(12) if seen[k] > 60]  # four directions: longer than about 20 pixels

    def owner(self, chain):
        """The visible edge that most points of a chain are next to; and whether it runs on along another one."""
        places = np.column_stack([chain.points["x"], chain.points["y"]])
        distances = np.array([distance_to(places, *project(self.edges[k], K=K)[:, :2]) for k in self.visible])
        own = np.bincount(distances.argmin(axis=0)).argmax()
        return self.visible[own], np.count_nonzero(distances[own] > 2) > 5

    def offsets(self, chain, edge):
        """Of its points from the line of an edge, in pixels and in space."""
        a, b = project(self.edges[edge], K=K)[:, :2]
        places = np.column_stack([chain.points["x"], chain.points["y"]])
        return distance_to_line(places, a, b), distance_to_line(chain.points["point"], *self.edges[edge])


def distance_to(places, a, b):
    way = b - a
    t = np.clip((places - a) @ way / (way @ way), 0, 1)
    return np.linalg.norm(places - a - t[:, None] * way, axis=1)


def distance_to_line(places, a, b):
    way = (b - a) / np.linalg.norm(b - a)
    return np.linalg.norm(places - a - np.outer((places - a) @ way, way), axis=1)


@pytest.fixture(scope="module", params=[3, 4, 5])
def scene(request):
    return Box(request.param)


@pytest.fixture(scope="module")
def chains(scene):
    return linkEdges(scene.rendering.depth, K=K)


def test_every_edge_of_a_box_is_one_chain(scene, chains):
    owners = [scene.owner(chain) for chain in chains]
    assert sorted(edge for edge, _ in owners) == scene.visible
    assert not any(across for _, across in owners)
    assert all(chain.straight and not chain.closed for chain in chains)


def test_points_of_creases_lie_on_the_edge_and_angles_are_right(scene, chains):
    creases = [chain for chain in chains if chain.kind == EDGE_CONVEX]
    assert len(creases) == 3
    for chain in creases:
        pixels, lengths = scene.offsets(chain, scene.owner(chain)[0])
        assert pixels.max() < 0.005
        assert lengths.max() < 3e-5
        if chain.pixels > 20:
            assert abs(chain.crease - 90) < 0.25


def test_points_of_jumps_lie_on_the_edge_within_a_fraction_of_a_pixel(scene, chains):
    offsets = np.concatenate([scene.offsets(c, scene.owner(c)[0])[0] for c in chains if c.kind == EDGE_JUMP])
    assert np.sqrt(np.mean(offsets**2)) < 0.015
    assert offsets.max() < 0.06  # as far as the pixels on its two sides tell


def test_normals_are_those_of_the_surfaces_and_look_at_the_viewer(scene, chains):
    truth = scene.rendering.normals
    for chain in chains:
        points = chain.points[len(chain) // 4 : -len(chain) // 4]
        along = np.diff(np.column_stack([points["x"], points["y"]]), axis=0).mean(axis=0)
        left = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        for side, sign in enumerate((1, -1)):
            if chain.kind == EDGE_JUMP and side == 1:
                continue  # the wall, of which a jump may be seen across the edge of another face
            u = np.rint(points["x"] + 3 * sign * left[0]).astype(int)
            v = np.rint(points["y"] + 3 * sign * left[1]).astype(int)
            angle = np.degrees(np.arccos(np.clip((points["normals"][:, side] * truth[v, u]).sum(axis=1), -1, 1)))
            assert np.median(angle) < (1 if chain.kind == EDGE_CONVEX else 2)


def test_the_nearer_surface_of_a_jump_is_on_the_left(scene, chains):
    depth = scene.rendering.depth
    for chain in chains:
        if chain.kind != EDGE_JUMP:
            continue
        p = chain.points
        along = np.array([p["x"][-1] - p["x"][0], p["y"][-1] - p["y"][0]])
        left = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        middle = p[len(p) // 2]
        near, far = (
            depth[int(np.rint(middle["y"] + s * left[1])), int(np.rint(middle["x"] + s * left[0]))] for s in (2, -2)
        )
        assert near < far
        assert middle["jump"] == pytest.approx(middle["behind"][2] - middle["point"][2])
        assert middle["jump"] == pytest.approx(far - near, abs=0.03)


def test_linking_leaves_a_third_of_the_noise():
    before, after, pieces, edges = [], [], 0, 0
    for seed in (3, 4, 5):
        scene = Box(seed)
        scan = kinectNoise(scene.rendering, seed=seed)
        lines = [project(scene.edges[k], K=K)[:, :2] for k in scene.visible]
        raw = edgePoints(scan.src, **scan.geometry)
        places = np.column_stack([raw["x"], raw["y"]]).astype(float)
        nearest = np.min([distance_to(places, *line) for line in lines], axis=0)
        before.append(nearest[nearest < 4])
        for chain in linkEdges(scan.src, **scan.geometry):
            edge, across = scene.owner(chain)
            assert not across
            pieces += len(chain) >= 10
            after.append(scene.offsets(chain, edge)[0])
        edges += len(scene.visible)
    rms = [float(np.sqrt(np.mean(np.concatenate(offsets) ** 2))) for offsets in (before, after)]
    assert rms[1] < rms[0] / 3
    assert pieces <= 1.3 * edges


def test_the_outline_of_a_sphere_is_one_closed_chain():
    rendering = renderScene([plane((0, 0, 1.5), (0, 0, -1)), sphere((0.02, 0.01, 1.0), 0.15)], CAMERA)
    (chain,) = linkEdges(rendering.depth, K=K)
    assert chain.closed
    assert not chain.straight
    # The cone of tangents meets the plane z = 1 in an ellipse, nearly a circle.
    radius = 525 * 0.15 / np.sqrt(1 - 0.15**2)
    assert chain.pixels == pytest.approx(2 * np.pi * radius, rel=0.01)
    centre = np.array([319.5 + 525 * 0.02, 239.5 + 525 * 0.01])
    distances = np.hypot(chain.points["x"] - centre[0], chain.points["y"] - centre[1])
    assert np.abs(distances - radius).max() < 0.8


def two_steps():
    """A step of 1 that a narrow bar of another depth crosses."""
    depth = np.where(np.arange(80) + 0.2 * np.arange(60)[:, None] < 45.3, 3.0, 4.0)
    return depth


def test_gaps_are_bridged_up_to_a_width():
    depth = two_steps()
    depth[28:31] = np.nan
    assert len(linkEdges(depth, pixelSize=1, noise=0.001)) == 1
    assert len(linkEdges(depth, pixelSize=1, noise=0.001, bridge=0)) == 2


@pytest.mark.parametrize("bridge", [3, 6, 10])
def test_an_edge_goes_on_behind_what_is_narrower_than_the_bridge(bridge):
    for height in (bridge // 2, bridge, bridge + 3):
        depth = two_steps()
        depth[28 : 28 + height] = 2.0
        chains = linkEdges(depth, pixelSize=1, noise=0.001, bridge=bridge)
        assert sum(np.ptp(chain.points["y"]) > 30 for chain in chains) == (height < bridge)


def test_gaps_are_not_bridged_between_edges_that_do_not_continue_each_other():
    depth = two_steps()
    depth[30:] = np.where(np.arange(80) + 0.2 * np.arange(30, 60)[:, None] < 38.3, 3.0, 4.0)
    chains = linkEdges(depth, pixelSize=1, noise=0.001)
    tall = [chain for chain in chains if np.ptp(chain.points["y"]) > 15]
    assert len(tall) == 2


@pytest.mark.parametrize("row", [40.0, 60.0, 71.0])
def test_a_rim_that_is_straight_in_the_image_ends_where_it_bends_in_depth(row):
    y, x = np.mgrid[:120, :80]
    depth = np.where(x < 40, 5 + 0.3 * np.abs(y - row), 30.0)
    depth += np.random.default_rng(0).normal(0, 0.001, depth.shape)
    rim = [chain for chain in linkEdges(depth, pixelSize=1, noise=0.001) if chain.kind == EDGE_JUMP]
    upper, lower = sorted(rim, key=lambda chain: chain.points["y"].mean())
    assert abs(upper.points["y"].max() - row) < 1.5
    assert abs(lower.points["y"].min() - row) < 1.5


def test_a_jump_ends_where_its_nearer_side_changes():
    y, x = np.mgrid[:60, :80]
    depth = np.where((x < 40) == (y < 30), 3.0, 4.0)
    chains = linkEdges(depth, pixelSize=1, noise=0.001)
    assert len(chains) == 4
    assert all(chain.kind == EDGE_JUMP and 20 < chain.pixels < 45 for chain in chains)


def test_a_chain_is_of_one_kind():
    """A ridge that goes on as a valley."""
    x = np.arange(81) - 40.2
    depth = np.vstack([np.tile(10 + np.abs(x), (40, 1)), np.tile(10 - np.abs(x), (40, 1))])
    kinds = [chain.kind for chain in linkEdges(depth, pixelSize=1, noise=0.001) if np.ptp(chain.points["y"]) > 20]
    assert sorted(kinds) == [EDGE_CONVEX, EDGE_CONCAVE]


def test_outlines_are_followed_around_corners_on_request():
    depth = np.full((80, 100), 2.0)
    turned = cv2.boxPoints(((50, 40), (50, 30), 20.0))
    cv2.fillPoly(depth, [np.rint(turned).astype(np.int32)], 1.0)
    sides = linkEdges(depth, pixelSize=0.01, noise=0.0001)
    assert len(sides) == 4
    assert all(side.straight for side in sides)
    (outline,) = linkEdges(depth, pixelSize=0.01, noise=0.0001, cornerAngle=180)
    assert outline.closed
    assert outline.pixels == pytest.approx(160, abs=8)


def test_all_forms_of_an_image_give_the_same_chains():
    matrix = np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])
    rendering = renderScene(roof(100.0), pinholeCamera(matrix, (160, 120)))
    of_depth = linkEdges(rendering.depth, K=matrix)
    of_points = linkEdges(rendering.points)
    assert len(of_depth) == len(of_points) == 1
    for name in ("x", "y", "point", "normals", "crease"):
        assert np.allclose(of_depth.points[name], of_points.points[name], atol=2e-3), name


def test_a_height_map_is_a_depth_map_upside_down():
    camera = orthographicCamera((0.5, 0.5), (90, 70), 100.0)
    rendering = renderScene([plane((0, 0, 110.0), (0, 0, -1)), box((0, 0, 100.0), (20, 16, 8), np.eye(3))], camera)
    depth = linkEdges(rendering.depth, **camera.geometry)
    height = linkEdges(-rendering.depth, heightMap=True, **camera.geometry)
    assert len(depth) == len(height) > 0
    flip = np.array([1, 1, -1])
    assert np.allclose(depth.points["point"] * flip, height.points["point"])
    assert np.allclose(depth.points["normals"] * flip, height.points["normals"], equal_nan=True)
    assert (height.points["normals"][:, 0, 2] > 0.5).all()


def test_lengths_add_up(chains):
    for chain in chains:
        places = np.column_stack([chain.points["x"], chain.points["y"]])
        assert chain.pixels == pytest.approx(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
        assert chain.length == pytest.approx(np.linalg.norm(np.diff(chain.points["point"], axis=0), axis=1).sum())


@pytest.mark.parametrize("points", [False, True])
def test_outlines_of_data_are_chains_on_request(scene, points):
    background = ~(scene.rendering.faces > 0)
    if points:
        src, geometry = np.where(background[..., None], np.nan, scene.rendering.points), {}
    else:
        src, geometry = np.where(background, np.nan, scene.rendering.depth), {"K": K}
    without = linkEdges(src, **geometry)
    chains = linkEdges(src, boundaryEdges=True, **geometry)
    outlines = [chain for chain in chains if chain.kind == EDGE_BOUNDARY]
    assert sorted(c.kind for c in chains if c.kind != EDGE_BOUNDARY) == sorted(c.kind for c in without)
    silhouette = [k for k in scene.visible if k not in {scene.owner(c)[0] for c in without}]
    assert sorted(scene.owner(chain)[0] for chain in outlines) == silhouette
    for chain in outlines:
        pixels, lengths = scene.offsets(chain, scene.owner(chain)[0])
        assert np.sqrt(np.mean(pixels**2)) < 0.05
        assert np.sqrt(np.mean(lengths**2)) < 8e-4
        assert np.isnan(chain.points["behind"]).all()
        assert not chain.points["jump"].any()
        p = chain.points[len(chain) // 2]
        along = np.array([np.ptp(chain.points[n]) * np.sign(chain.points[n][-1] - chain.points[n][0]) for n in "xy"])
        left = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        assert not background[int(np.rint(p["y"] + 2 * left[1])), int(np.rint(p["x"] + 2 * left[0]))]
        assert background[int(np.rint(p["y"] - 2 * left[1])), int(np.rint(p["x"] - 2 * left[0]))]


def test_threads_do_not_matter():
    scan = kinectNoise(Box(3).rendering)
    threads = cv2.getNumThreads()
    try:
        found = []
        for count in (1, 2, 5):
            cv2.setNumThreads(count)
            found.append(linkEdges(scan.src, **scan.geometry))
    finally:
        cv2.setNumThreads(threads)
    for other in found[1:]:
        assert other.points.tobytes() == found[0].points.tobytes()
        assert other.chains.tobytes() == found[0].chains.tobytes()


def test_no_edges_no_chains():
    for depth in (np.ones((40, 50)), np.full((40, 50), np.nan), np.ones((1, 1))):
        chains = linkEdges(depth, K=K, noise=0.001)
        assert len(chains) == len(chains.points) == 0
        assert repr(chains) == "<0 edge chains of 0 points>"


@pytest.mark.parametrize("cornerAngle", [1, 8, 180])
def test_points_are_finite_on_images_of_blocks(cornerAngle):
    """Small loops, short lines, lines at the border and beside holes."""
    rng = np.random.default_rng(0)
    for size in (1, 2, 3, 4, 6):
        depth = np.kron(rng.uniform(1, 2, (12, 15)).round(1), np.ones((size, size)))
        depth[rng.random(depth.shape) < 0.03] = np.nan
        options = {"cornerAngle": cornerAngle, "bridge": 40, "minLength": 1, "lineSignificance": 0, "noise": 0.001}
        chains = linkEdges(depth, pixelSize=0.01, **options)
        for name in ("x", "y", "point"):
            assert np.isfinite(chains.points[name]).all()
        assert (chains.points["x"] > -1).all()
        assert (chains.points["x"] < depth.shape[1]).all()


def test_chains_are_a_sequence_and_print(chains):
    assert isinstance(chains, EdgeChains)
    assert all(isinstance(chain, EdgeChain) for chain in chains)
    assert len(chains[1:3]) == 2
    assert sum(len(chain) for chain in chains) == len(chains.points)
    assert chains[-1].points["x"][-1] == chains.points["x"][-1]
    with pytest.raises(IndexError):
        chains[len(chains)]
    assert "jump straight chain" in repr(next(c for c in chains if c.kind == EDGE_JUMP))
    assert repr(chains).startswith(f"<{len(chains)} edge chains of {len(chains.points)} points: 3 convex, ")


def test_the_image_stays_as_it_was(scene):
    depth = scene.rendering.depth.copy()
    linkEdges(depth, K=K)
    assert np.array_equal(depth, scene.rendering.depth, equal_nan=True)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"bridge": -1}, "linkEdges: `bridge` must be a finite number >= 0"),
        ({"cornerAngle": 0}, "linkEdges: `cornerAngle` must be a finite number > 0 and <= 180"),
        ({"cornerAngle": 200}, "`cornerAngle` must be"),
        ({"brigde": 3}, "did you mean `bridge`?"),
        ({"K": np.eye(2)}, "`K` must be a camera"),
    ],
)
def test_bad_options_are_named(options, text):
    with pytest.raises(rangeedge.error) as problem:
        linkEdges(np.ones((4, 5)), **options)
    assert text in str(problem.value)


def bar(depth_along):
    """A bar whose straight side passes rows and columns, and whose depth is a function of the row."""
    rows, cols = np.mgrid[:96, :80].astype(float)
    return np.where(cols + 0.27 * rows < 50.3, depth_along(rows), 400.0)


@pytest.mark.parametrize(
    ("depth_along", "parts"),
    [
        pytest.param(lambda v: 100 + 0.6 * v, 1, id="straight"),
        pytest.param(lambda v: 100 + 0.006 * (v - 40) ** 2, 1, id="bent"),
        pytest.param(lambda v: 100 + 0.6 * np.abs(v - 45.2), 2, id="one-corner"),
        pytest.param(lambda v: 100 + np.abs((v + 2) % 64 - 32), 3, id="two-corners"),
    ],
)
@pytest.mark.parametrize("noise", [0, 0.1])
def test_an_edge_straight_in_the_image_ends_where_it_turns_in_space(depth_along, parts, noise):
    depth = bar(depth_along) + noise * np.random.default_rng(5).normal(size=(96, 80))
    jumps = [c for c in linkEdges(depth, pixelSize=1, noise=max(noise, 1e-3)) if c.jump > 100]
    assert len(jumps) == parts
    for chain in jumps:
        place = chain.points["point"]
        assert distance_to_line(place, place[0], place[-1]).max() < (3 if parts > 1 else 20)
    assert sum(len(chain) for chain in jumps) >= 85


@pytest.mark.parametrize("radius", [4, 6, 8])
def test_the_outline_of_a_small_disc_is_closed(radius):
    y, x = np.mgrid[:40, :40] - 19.5
    (chain,) = linkEdges(np.where(np.hypot(x, y) < radius, 1.0, 2.0), pixelSize=0.01, noise=0.001)
    assert chain.closed
    assert 8 <= len(chain.points) < 80
