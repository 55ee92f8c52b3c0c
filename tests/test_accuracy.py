"""How true the edges are: noise-free scenes whose edges are known exactly, the paper's example, real frames."""

import warnings

import cv2
import numpy as np
import pytest

from rangeedge import (
    CREASE_MAX,
    DIR_ROWS,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    MEASURE_ENDPOINT,
    ScanLineParams,
    detectEdges,
    edgePoints,
    edgeStrength,
)
from rangeedge.synthetic import (
    curvedScene,
    cylinder,
    demoScene,
    gaussianNoise,
    orthographicCamera,
    pinholeCamera,
    plane,
    polyhedraScene,
    renderScene,
    roof,
    sphere,
    step,
    twoCylinders,
)

JUMP, CREASE = 0.01, 20.0  # thresholds of what counts as an edge, metres and degrees

# Off the symmetry of pixels, so that no edge falls between two by construction.
PINHOLE = pinholeCamera(np.array([[196.8, 0, 119.63], [0, 196.8, 89.71], [0, 0, 1]]), (240, 180), 1.2)
GRID = orthographicCamera((0.005, 0.006), (240, 180))
CAMERAS = {"pinhole": PINHOLE, "grid": GRID}


def strength_of(rendering, **options):
    return edgeStrength(rendering.depth, **rendering.camera.geometry, **options)


def within(mask, reach):
    """Pixels at most `reach` away from a pixel of the mask."""
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) <= reach


def edge_pixels(strength):
    return ((strength.kind & EDGE_JUMP > 0) & (strength.jump > JUMP)) | (strength.crease > CREASE)


@pytest.fixture(scope="module", params=[(k, c) for k in ("demo", "polyhedra", "curved") for c in CAMERAS], ids="-".join)
def seen(request):
    kind, camera = request.param
    make = {
        "demo": lambda _: demoScene(),
        "polyhedra": lambda c: polyhedraScene(1, c),
        "curved": lambda c: curvedScene(2, c),
    }
    rendering = renderScene(make[kind](CAMERAS[camera]), CAMERAS[camera])
    return kind, rendering, strength_of(rendering)


# Scenes.


def test_every_edge_is_found_within_a_pixel(seen):
    _, rendering, strength = seen
    truth = rendering.edges(JUMP, CREASE)
    edges = (truth > 0) & (truth < 4)
    assert edges.sum() > 1000
    # A neighbouring pixel, diagonal ones included.
    assert within(edge_pixels(strength_of(rendering, maxSmear=0)), 1.5)[edges].mean() > 0.999
    # A steep face of up to five pixels may be taken for smear, whose edge is in its middle.
    assert within(edge_pixels(strength), 3.5)[edges].mean() > 0.995


def test_polyhedra_have_no_other_edges(seen):
    kind, rendering, strength = seen
    if kind != "polyhedra":
        pytest.skip("curved surfaces have their own test")
    false = edge_pixels(strength) & ~within(rendering.edges(0.0, 0.0) > 0, 3.0)
    assert false.sum() == 0


def test_convex_and_concave_are_never_swapped(seen):
    kind, rendering, strength = seen
    truth = rendering.edges(JUMP, CREASE)
    swapped = np.zeros(truth.shape, bool)
    for here, wrong, other in ((2, EDGE_CONCAVE, False), (3, EDGE_CONVEX, True)):
        crossings = rendering.crossings[rendering.crossings["convex"] == other]
        of_other = np.zeros(truth.size, bool)
        of_other[crossings["first"]] = of_other[crossings["second"]] = True
        says = (strength.kind & wrong > 0) & (strength.kind & EDGE_JUMP == 0)
        # Where edges of both kinds meet, either may be the larger.
        swapped |= (truth == here) & says & ~within(of_other.reshape(truth.shape), 4.0)
    assert swapped.sum() <= (0 if kind == "polyhedra" else 2)  # steep silhouettes beside a crease


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("orientation", [0, 20, 45, 90])
@pytest.mark.parametrize("slant", [0, 30])
def test_jumps_have_their_height(slant, orientation, camera):
    rendering = renderScene(step(0.05, orientation, slant), camera)
    strength = strength_of(rendering)
    edges = rendering.jump > 0
    assert (strength.kind[edges] & EDGE_JUMP > 0).all()
    assert not strength.jump[~edges].any()
    inner = np.zeros(edges.shape, bool)
    inner[4:-4, 4:-4] = True  # at the border a diagonal has a single pixel on one side, which shows no slope
    assert (edges & inner).sum() > 300
    np.testing.assert_allclose(strength.jump[edges & inner], rendering.jump[edges & inner], rtol=0.01)


@pytest.mark.parametrize("angle", [10, 40, 90, 130])
@pytest.mark.parametrize("convex", [True, False])
@pytest.mark.parametrize("slant", [0, 8])
def test_creases_across_the_rows_of_a_grid_have_their_angle(slant, convex, angle):
    rendering = renderScene(roof(angle, 0, slant, convex), GRID)
    points = edgePoints(rendering.depth, **GRID.geometry, directions=DIR_ROWS, crease=CREASE_MAX)
    assert len(points) == 180
    np.testing.assert_allclose(points["crease"], angle, atol=0.1)
    np.testing.assert_allclose(points["x"], rendering.crossings["x"][0], atol=0.01)
    assert (points["kind"] & EDGE_CONVEX > 0).all() == convex
    assert (points["kind"] & EDGE_CONCAVE > 0).all() != convex


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("orientation", [0, 27, 45, 70, 90])
@pytest.mark.parametrize("convex", [True, False])
@pytest.mark.parametrize("angle", [10, 40, 90, 130])
def test_creases_of_any_orientation_have_the_angle_of_their_normals(angle, convex, orientation, camera):
    rendering = renderScene(roof(angle, orientation, 5, convex), camera)
    strength = strength_of(rendering)
    found = strength.crease > 0
    assert within(found, 1.5)[rendering.crease > 0].all()
    assert within(rendering.crease > 0, 1.5)[found].all()
    error = np.abs(strength.crease[found] - angle)
    assert np.median(error) < 0.1
    assert np.quantile(error, 0.95) < 0.5
    # At the border of the image two samples of one surface may be left, and a weak edge of the other kind with them.
    strong = strength.crease > angle / 2
    assert strong.sum() > 0.99 * found.sum()
    assert not (strength.kind[strong] & (EDGE_CONCAVE if convex else EDGE_CONVEX)).any()


# Smooth surfaces.

SMOOTH = {
    "plane": [plane((0, 0, 1.2), (0.3, 0.4, -1))],
    "sphere": [sphere((0, 0, 1.2), 0.45)],
    "cylinder": [cylinder((0, 0, 1.2), (0.1, 1, 0.2), 0.4, 9.0)],
    "slanted cylinder": [cylinder((0, 0, 1.2), (1, 0.2, 0.5), 0.2, 9.0)],
}


def false_edges(rendering, src, reach=7.0):
    """Edge pixels farther than `reach` from a silhouette."""
    edges = detectEdges(src, **rendering.camera.geometry) > 0
    return int((edges & ~within(~np.isfinite(rendering.depth), reach)).sum())


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
def test_a_plane_has_no_edges(camera):
    rendering = renderScene(SMOOTH["plane"], camera)
    strength = strength_of(rendering)
    assert not strength.jump.any()
    assert not strength.crease.any()
    assert not detectEdges(rendering.depth, **camera.geometry).any()
    assert false_edges(rendering, gaussianNoise(rendering, 0.001).src) == 0


@pytest.mark.parametrize("name", ["sphere", "cylinder"])
@pytest.mark.parametrize("sigma", [0.0005, 0.001, 0.002])
def test_smooth_surfaces_have_no_edges_in_noise(sigma, name):
    rendering = renderScene(SMOOTH[name], PINHOLE)
    assert false_edges(rendering, gaussianNoise(rendering, sigma).src) == 0


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("name", ["sphere", "cylinder", "slanted cylinder"])
def test_smooth_surfaces_have_no_edges_without_noise(name, camera):
    rendering = renderScene(SMOOTH[name], camera)
    # Without noise the tolerance is so fine that, near the silhouette, samples are too sparse for the curvature.
    assert false_edges(rendering, rendering.depth, reach=12.0) == 0


# Two cylinders (paper, 4.1, Fig. 3, and 4.2, Table 2).

TWO_CYLINDERS = {
    "paper": ScanLineParams.paper(),
    "paper, second measure": ScanLineParams.paper(measure=MEASURE_ENDPOINT),
    "least squares": ScanLineParams(mergeSignificance=0.0, minSignificance=0.0, crease=CREASE_MAX, maxShift=1.0),
}


@pytest.mark.parametrize("name", TWO_CYLINDERS)
@pytest.mark.parametrize("eps", [0.0006, 0.001, 0.0015])
def test_only_the_true_edge_of_two_cylinders_is_strong(eps, name):
    camera = pinholeCamera(np.array([[525.0, 0, 99.63], [0, 525, 5.7], [0, 0, 1]]), (200, 12), 1.0)
    rendering = renderScene(twoCylinders(36.3), camera)
    options = {**vars(TWO_CYLINDERS[name]), **camera.geometry, "eps": eps, "directions": DIR_ROWS}
    points = edgePoints(rendering.depth, **options)
    left, right = np.flatnonzero(np.isfinite(rendering.depth[6]))[[0, -1]]
    points = points[(points["x"] > left + 4) & (points["x"] < right - 4)]
    true = np.abs(points["x"] - 99.63) <= 1
    assert true.sum() == 12  # one a row
    assert (points["crease"][true] > 30).all()
    assert (~true).sum() >= 24  # oversegmented
    assert (points["crease"][~true] < 6).all()
    assert (points["kind"][true] & EDGE_CONCAVE > 0).all()
    assert not (points["kind"][true] & EDGE_CONVEX).any()


# Real frames. Their loader leaves files open.

leaking = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


def matrix(K):
    return None if K is None else np.array([[K[0], 0, K[2]], [0, K[1], K[3]], [0, 0, 1]], np.float64)


def run_frame(frame):
    """Everything the detector does to one frame; warnings are errors."""
    points = frame.get("xyz")
    src, kwargs = (frame["z"], dict(K=matrix(frame["K"]))) if points is None else (points, {})
    before = src.copy()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        strength = edgeStrength(src, **kwargs)
        edges = detectEdges(src, **kwargs)
    assert np.array_equal(src, before, equal_nan=True)
    nothing = ~np.isfinite(frame["z"])
    for values in strength:
        assert np.isfinite(values).all()
        assert not values[nothing].any()
    assert (strength.crease <= 180).all()
    assert 0.001 < (edges > 0).sum() / (~nothing).sum() < 0.5


@leaking
@pytest.mark.parametrize("name", ["mosd learn0", "phoxi 0", "stanford bun000", "synpeb 100"])
def test_a_frame_of_each_kind_of_scanner(load, name):
    kind, which = name.split()
    run_frame(getattr(load, kind)(int(which) if which.isdigit() else which))


@leaking
@pytest.mark.slow
def test_every_frame_runs_without_warning(load):
    names = []
    for folder, frame in load.everything():
        try:
            run_frame(frame)
        except Exception as problem:
            raise AssertionError(f"{folder} {frame['name']}") from problem
        names.append(frame["name"])
    assert len(names) > 50


@leaking
@pytest.mark.parametrize("names", [2, pytest.param(None, marks=pytest.mark.slow)], ids=["two frames", "all frames"])
def test_edges_of_boxes_before_a_kinect(load, score, names):
    counts = []
    for name in load.mosd_faces_names(complete=True)[:names]:
        frame = load.mosd_faces(name)
        kwargs = dict(K=matrix(frame["K"]))
        edges, kind = detectEdges(frame["z"], **kwargs), edgeStrength(frame["z"], **kwargs).kind
        classes = np.where(kind & EDGE_CONVEX, score.CONVEX, np.where(kind & EDGE_CONCAVE, score.CONCAVE, 0))
        counts.append(score.edge_counts(edges > 0, frame["edges"], np.isfinite(frame["z"]), kind=classes))
    summary = score.edge_summary(counts)
    assert summary["f"] > 0.95
    assert summary["kind"] > 0.95
    assert summary["shift"] < 1.0
