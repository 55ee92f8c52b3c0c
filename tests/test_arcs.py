"""Circles and arcs in space."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge import (
    EDGE_CONVEX,
    EDGE_JUMP,
    EdgeChain,
    drawArcs,
    fitArcs,
    linkEdges,
    readLines,
    toLines,
    writeLines,
)
from rangeedge.arcs import ARC
from rangeedge.chains import CHAIN, POINT
from rangeedge.synthetic import cylinder, gaussianNoise, pinholeCamera, plane, renderScene

K = np.array([[525.0, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])
CAMERA = pinholeCamera(K, (640, 480))


def chain_of(places, *, measured=None, closed=False, straight=False):
    points, header = np.zeros(len(places), POINT), np.zeros(1, CHAIN)
    points["point"], points["measured"] = places, places if measured is None else measured
    header["count"], header["kind"] = len(places), EDGE_CONVEX
    header["closed"], header["straight"] = closed, straight
    return EdgeChain(header[0], points)


def circle(center, normal, radius, first=0.0, last=360.0, count=40):
    """Points about a normal, counterclockwise from the first to the last angle."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    a = np.cross(normal, (1.0, 0, 0) if abs(normal[0]) < 0.9 else (0, 1.0, 0))
    a /= np.linalg.norm(a)
    t = np.radians(np.linspace(first, last, count, endpoint=last - first < 360))
    return center + radius * (np.outer(np.cos(t), a) + np.outer(np.sin(t), np.cross(normal, a)))


def test_three_quarters_of_a_circle_of_radius_two():
    t = np.radians(np.linspace(0, 270, 28))
    (arc,) = fitArcs([chain_of(np.column_stack([1 + 2 * np.cos(t), 5 + 2 * np.sin(t), np.full(28, 3.0)]))])
    np.testing.assert_allclose(arc["center"], (1, 5, 3), atol=1e-9)
    np.testing.assert_allclose(arc["normal"], (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(arc["ends"], [(3, 5, 3), (1, 3, 3)], atol=1e-9)
    assert arc["radius"] == pytest.approx(2)
    assert arc["angle"] == pytest.approx(270)
    assert (arc["kind"], arc["count"], arc["chain"]) == (EDGE_CONVEX, 28, 0)
    assert max(arc[name] for name in ("rms", "centerDeviation", "normalDeviation", "radiusDeviation")) < 1e-9


numbers = st.floats(-1, 1)


@settings(deadline=None, max_examples=60)
@given(
    center=st.tuples(numbers, numbers, numbers),
    normal=st.tuples(numbers, numbers, numbers).filter(lambda n: np.linalg.norm(n) > 0.1),
    radius=st.floats(0.01, 10),
    first=st.floats(-180, 180),
    angle=st.floats(61, 359),
)
def test_any_arc_is_found_whichever_way_it_runs(center, normal, radius, first, angle):
    places = circle(center, normal, radius, first, first + angle)
    there, back = fitArcs([chain_of(places), chain_of(places[::-1])])
    for arc, turned in ((there, 1), (back, -1)):
        np.testing.assert_allclose(arc["center"], center, atol=1e-6 * (1 + radius))
        assert arc["radius"] == pytest.approx(radius, rel=1e-6)
        assert arc["angle"] == pytest.approx(angle, abs=1e-3)
        np.testing.assert_allclose(arc["normal"], turned * np.divide(normal, np.linalg.norm(normal)), atol=1e-5)
        np.testing.assert_allclose(arc["ends"], places[[0, -1]][::turned], atol=1e-6 * (1 + radius))


def test_what_is_no_arc():
    line = np.linspace((0, 0, 1), (1, 2, 3), 40)
    ellipse = circle((0, 0, 1), (0, 0, 1), 1) * (1, 0.7, 1)
    helix = circle((0, 0, 1), (0, 0, 1), 1) + np.outer(np.linspace(0, 0.5, 40), (0, 0, 1))
    short = circle((0, 0, 1), (0, 0, 1), 1, 0, 50)
    few = circle((0, 0, 1), (0, 0, 1), 1, count=15)
    same = np.zeros((40, 3))
    unknown = np.full((40, 3), np.nan)
    assert len(fitArcs([chain_of(p) for p in (line, ellipse, helix, short, few, same, unknown)])) == 0
    assert len(fitArcs([chain_of(circle((0, 0, 1), (0, 0, 1), 1), straight=True)])) == 0
    assert len(fitArcs([])) == 0


def test_options_say_what_is_an_arc():
    ellipse = circle((0, 0, 1), (0, 0, 1), 1) * (1, 0.9, 1)
    short = circle((0, 0, 1), (0, 0, 1), 1, 0, 50, 12)
    found = fitArcs([chain_of(ellipse), chain_of(short)], 0.05, minAngle=40, minPoints=12)
    assert found["chain"].tolist() == [0, 1]
    assert found["radius"] == pytest.approx([0.95, 1], abs=0.01)


def test_points_far_off_do_not_count():
    places = circle((0, 0, 1), (0, 0, 1), 1, 0, 300)
    places[7] *= 1.5
    (arc,) = fitArcs([chain_of(places)])
    assert arc["radius"] == pytest.approx(1)
    assert arc["count"] == 39


def test_deviations_are_those_of_repeated_fits():
    rng = np.random.default_rng(3)
    truth = circle((1, 2, 3), (0, 0, 1), 1, 0, 120, 60)
    arcs = fitArcs(
        [chain_of(p, measured=p) for p in (truth + rng.normal(0, 0.01, truth.shape) for _ in range(200))], 0.1
    )
    assert len(arcs) == 200
    # What all points are taken to have in common adds half of a single one's; here they have nothing.
    share = np.sqrt(1 / 58 + 0.5**2) * np.sqrt(60)
    for name, error, scale in (
        ("radiusDeviation", arcs["radius"] - 1, share),
        ("centerDeviation", np.linalg.norm(arcs["center"] - (1, 2, 3), axis=1), share),
        ("normalDeviation", np.degrees(np.linalg.norm(arcs["normal"][:, :2], axis=1)) / np.sqrt(2), share),
    ):
        assert np.sqrt(np.mean(error**2)) * scale == pytest.approx(np.median(arcs[name]), rel=0.35), name


@pytest.mark.parametrize("noise", [0, 0.001])
def test_the_rim_of_a_can(noise):
    center, axis, radius, height = np.array((0.02, 0.01, 1.0)), np.array((0.3, -0.5, -0.8)), 0.1, 0.12
    axis /= np.linalg.norm(axis)
    scan = gaussianNoise(renderScene([plane((0, 0, 1.5), (0, 0, -1)), cylinder(center, axis, radius, height)], CAMERA),
                         noise or 1e-6, 1)  # fmt: skip
    arcs = fitArcs(linkEdges(scan.src, K=K))
    top = center + axis * height / 2
    rim = arcs[np.linalg.norm(arcs["center"] - top, axis=1) < 0.01]
    assert set(rim["kind"]) == (
        {EDGE_JUMP, EDGE_CONVEX} if noise else {EDGE_CONVEX}
    )  # the outline of both is one chain
    assert np.abs(rim["radius"] - radius).max() < (0.002 if noise else 0.001)
    assert np.degrees(np.arccos(np.abs(rim["normal"] @ axis))).max() < 1
    assert (np.abs(rim["radius"] - radius) < 4 * rim["radiusDeviation"]).all()


def test_a_hole_is_drawn_and_written(tmp_path):
    y, x = np.mgrid[:80, :80]
    hole = np.where(np.hypot(x - 40.2, y - 38.7) < 25, 5.0, 1.0)
    arcs = fitArcs(linkEdges(hole, pixelSize=1, noise=0.001))
    (arc,) = arcs
    assert arc["angle"] == 360
    np.testing.assert_allclose(arc["center"], (40.2, 38.7, 1), atol=0.1)
    assert arc["radius"] == pytest.approx(25, abs=0.1)
    black = np.zeros((80, 80, 3), np.uint8)
    picture = drawArcs(black, arcs, pixelSize=1)
    rows, cols = np.nonzero(picture.any(axis=2))
    from_center = np.hypot(cols - 40.2, rows - 38.7)
    assert ((np.abs(from_center - 25) < 2) | (from_center < 4)).all()
    assert (np.abs(from_center - 25) < 1).sum() > 150
    assert not np.array_equal(picture, drawArcs(black, arcs, pixelSize=1, radii=True))
    assert not black.any()
    (line,) = toLines(arcs)
    assert line.closed
    np.testing.assert_allclose(np.linalg.norm(line.points - arc["center"], axis=1), arc["radius"])
    for suffix in ("csv", "ply", "obj", "geojson"):
        writeLines(tmp_path / f"hole.{suffix}", arcs)
        (read,) = readLines(tmp_path / f"hole.{suffix}")
        np.testing.assert_allclose(read.points, line.points, atol=1e-6)


@pytest.mark.parametrize("name", ["center", "normal", "ends", "angle"])
def test_of_an_arc_that_is_not_finite_nothing_is_drawn_or_written(name, tmp_path):
    arcs = fitArcs([chain_of(circle((0, 0, 1), (0, 0, 1), 1))])
    for value in (np.nan, np.inf):
        broken = arcs.copy()
        broken[name] = value
        assert toLines(broken) == []
        drawArcs(np.zeros((8, 8, 3), np.uint8), broken, pixelSize=1)
        for suffix in ("csv", "ply", "obj", "geojson"):
            writeLines(tmp_path / f"arc.{suffix}", broken)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: fitArcs(3), "fitArcs: `chains` must be EdgeChains"),
        (lambda: fitArcs([], 0), "fitArcs: `tolerance` must be"),
        (lambda: fitArcs([], minAngle=0), "fitArcs: `minAngle` must be"),
        (lambda: fitArcs([], minAngle=361), "fitArcs: `minAngle` must be"),
        (lambda: fitArcs([], minPoints=4), "fitArcs: `minPoints` must be"),
        (lambda: drawArcs(np.ones((8, 8)), np.zeros(3)), "drawArcs: `arcs` must be a structured array from fitArcs"),
        (lambda: drawArcs(np.ones((8, 8)), np.zeros(0, ARC), scale=0), "drawArcs: `scale` must be"),
        (lambda: writeLines("arc.svg", np.zeros(1, ARC)), "writeLines: `lines` must be lines with pixels"),
    ],
)
def test_errors(call, text):
    with pytest.raises(rangeedge.error, match=text):
        call()
