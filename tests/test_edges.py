"""Edge strengths and points: what they mean, and what they are made from."""

import inspect
import pickle
from dataclasses import fields

import cv2
import numpy as np
import pytest
from scenes import NAMES, K, seen, surfaces

import rangeedge
from rangeedge import (
    CREASE_MAX,
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    EDGE_BOUNDARY,
    EDGE_CONCAVE,
    EDGE_CONVEX,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    FIT_INTERP,
    FIT_LSQ,
    MEASURE_MIDPOINT,
    ScanLineParams,
    detectEdges,
    edgePoints,
    edgeStrength,
    explainPixel,
)

NAN = np.nan


# What the outputs mean.


def test_a_step_has_its_height_and_its_sides():
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    jump, crease, kind, significance = edgeStrength(z, noise=0.001)
    np.testing.assert_allclose(jump[:, 19:21], 0.25, rtol=1e-6)
    assert not crease.any()
    assert (kind[:, 19] == EDGE_JUMP | EDGE_OCCLUDED).all()
    assert (kind[:, 20] == EDGE_JUMP | EDGE_OCCLUDING).all()
    assert (significance[:, 19:21] >= 10).all()
    for map_ in (jump, kind, significance):
        assert not map_[:, :19].any()
        assert not map_[:, 21:].any()


@pytest.mark.parametrize("height", [False, True])
@pytest.mark.parametrize("ridge", [False, True])
def test_a_roof_has_its_angle_its_place_and_its_kind(ridge, height):
    z = np.abs(np.arange(41) - 20.25) * 0.5 * np.ones((41, 1))  # a depth map of this is nearest in the middle
    z = z if ridge else -z
    z = -z if height else z
    points = edgePoints(z, noise=0.001, heightMap=height, directions=DIR_ROWS)
    np.testing.assert_allclose(points["x"], 20.25, atol=1e-4)
    np.testing.assert_allclose(points["crease"], 2 * np.degrees(np.arctan(0.5)), atol=1e-3)
    assert (points["y"] == np.arange(41)).all()
    assert (points["kind"] == (EDGE_CONVEX if ridge else EDGE_CONCAVE)).all()
    assert (points["jump"] == 0).all()
    strength = edgeStrength(z, noise=0.001, heightMap=height)
    assert (strength.crease[:, 20:22] > 0).all()
    assert not strength.crease[:, :20].any()
    assert not strength.crease[:, 22:].any()


def test_the_pixel_size_turns_slopes_into_angles():
    z = np.abs(np.arange(41) - 20.25) * np.ones((41, 1))
    for dx in (0.5, 2.0):
        points = edgePoints(z, noise=0.001, directions=DIR_ROWS, pixelSize=(dx, 7.0))
        np.testing.assert_allclose(points["crease"], 2 * np.degrees(np.arctan(1 / dx)), atol=1e-3)
        points = edgePoints(z.T, noise=0.001, directions=DIR_COLS, pixelSize=(7.0, dx))
        np.testing.assert_allclose(points["crease"], 2 * np.degrees(np.arctan(1 / dx)), atol=1e-3)


def test_strengths_are_those_of_the_points_beside_them():
    z = surfaces(np.random.default_rng(8), (40, 50))
    options = dict(noise=0.003, maxShift=0.0, maxGap=0, maxSmear=0)  # for pixels half a step from their point
    points, strength = edgePoints(z, **options), edgeStrength(z, **options)
    jump = np.zeros_like(strength.jump)
    step = {1: (0.5, 0), 2: (0, 0.5), 4: (0.5, -0.5), 8: (0.5, 0.5)}
    for p in points:
        dx, dy = step[int(p["direction"])]
        for sign in (-1, 1):
            u, v = int(p["x"] + sign * dx), int(p["y"] + sign * dy)
            jump[v, u] = max(jump[v, u], p["jump"])
    assert len(points) > 50
    assert np.array_equal(jump, strength.jump)


def test_points_come_by_direction_then_line_then_place():
    points = edgePoints(surfaces(np.random.default_rng(9), (40, 50)), noise=0.003)
    assert (np.diff(points["direction"].astype(int)) >= 0).all()
    rows = points[points["direction"] == DIR_ROWS]
    assert (np.lexsort((rows["x"], rows["y"])) == np.arange(len(rows))).all()


def test_directions_select_scan_lines():
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    assert not edgeStrength(z, noise=0.001, directions=DIR_COLS).jump.any()
    for direction in (DIR_ROWS, DIR_DIAG45, DIR_DIAG135):
        points = edgePoints(z, noise=0.001, directions=direction)
        assert (points["direction"] == direction).all()
        assert len(points) >= 25


def test_boundaries_are_marked_beside_invalid_pixels_only():
    z = np.ones((9, 11))
    z[4, 5] = NAN
    kind = edgeStrength(z, noise=0.001).kind
    expected = np.zeros((9, 11), np.uint8)
    expected[3:6, 4:7] = EDGE_BOUNDARY
    expected[4, 5] = 0
    assert np.array_equal(kind, expected)


@pytest.mark.parametrize("options", [dict(), dict(crease=CREASE_MAX), dict(fit=FIT_INTERP), dict(minSignificance=0.0)])
def test_pixels_without_data_get_nothing(options):
    z = np.abs(np.arange(41) - 20.25) * 0.5 * np.ones((41, 1))  # a roof
    z[:, 19:22] = NAN
    noisy = surfaces(np.random.default_rng(15), (50, 60))
    noisy[np.random.default_rng(16).random(noisy.shape) < 0.2] = NAN
    for src, geometry in ((z, {}), (noisy, dict(pixelSize=0.02)), (noisy, dict(K=K)), (seen(noisy), {})):
        strength = edgeStrength(src, noise=0.003, **geometry, **options)
        nothing = ~np.isfinite(src).reshape(*src.shape[:2], -1).all(-1)
        assert strength.significance.any()
        assert not any(m[nothing].any() for m in strength)


@pytest.mark.parametrize(("maxGap", "seen"), [(3, True), (2, False), (0, False)])
def test_gaps_of_no_data_are_bridged_up_to_a_width(maxGap, seen):
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    z[:, 19:22] = NAN
    strength = edgeStrength(z, noise=0.001, maxGap=maxGap, directions=DIR_ROWS, shadowEdges=False)
    assert (strength.jump[:, 18] > 0).all() == seen
    assert (strength.jump[:, 22] > 0).all() == seen
    if seen:
        np.testing.assert_allclose(strength.jump[:, [18, 22]], 0.25, rtol=1e-6)


@pytest.mark.parametrize("hole", [slice(12, 13), slice(12, 14), slice(25, 27)])
def test_surfaces_run_on_across_small_holes(hole):
    z = np.abs(np.arange(41) - 20.25) * 0.5 * np.ones((41, 1))  # a roof
    whole = edgePoints(z, noise=0.01, directions=DIR_ROWS)
    z[:, hole] = NAN
    found = edgePoints(z, noise=0.01, directions=DIR_ROWS)
    assert len(found) == len(whole) == 41
    for name in ("x", "y", "crease", "kind"):
        np.testing.assert_allclose(found[name], whole[name], rtol=1e-5)
    wider = z.copy()
    wider[:, hole.start : hole.start + 3] = NAN
    assert (edgePoints(wider, noise=0.01, directions=DIR_ROWS)["significance"] < found["significance"]).all()


@pytest.mark.parametrize("hole", [19, 20, slice(19, 21)])
def test_steps_do_not_run_on_across_small_holes(hole):
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    z[:, hole] = NAN
    strength = edgeStrength(z, noise=0.001, directions=DIR_ROWS)
    beside = [18 if hole != 20 else 19, 21 if hole != 19 else 20]
    np.testing.assert_allclose(strength.jump[:, beside], 0.25, rtol=1e-6)
    strength.jump[:, beside] = 0
    assert not strength.jump.any()


def test_small_holes_everywhere_hide_no_crease():
    rng = np.random.default_rng(5)
    z = 3 / (1 + 0.3 * np.abs(np.arange(160) - 79.6) / 80) + 0.004 * rng.normal(size=(120, 160))
    camera = dict(K=(160, 160, 79.5, 59.5))
    assert (detectEdges(z, **camera) > 0).sum() == 120
    z[rng.random(z.shape) < 0.1] = NAN
    edges = detectEdges(z, **camera) > 0
    assert edges[:, 77:83].any(axis=1).sum() >= 110
    assert edges.sum() == edges[:, 77:83].sum()


@pytest.mark.parametrize("waves", [0, 1, 4])
@pytest.mark.parametrize("share", [0.05, 0.2, 0.4])
def test_small_holes_make_no_edges_of_noise(waves, share):
    rng = np.random.default_rng(6)
    noise = rng.normal(size=(240, 320))
    noise = cv2.GaussianBlur(noise, (0, 0), waves) if waves else noise
    z = 1.5 / (1 - 0.4 * (np.arange(320) - 160) / 300) + 0.003 * noise / noise.std()
    z[rng.random(z.shape) < share] = NAN
    assert not detectEdges(z, K=(300, 300, 159.5, 119.5)).any()


@pytest.mark.parametrize("unknown", [NAN, 0, 1e-9])
def test_the_noise_across_small_holes_is_that_beside_them(unknown):
    rng = np.random.default_rng(7)
    z = 1.5 + 0.003 * rng.normal(size=(120, 160))
    holes = rng.random(z.shape) < 0.1
    z[holes] = NAN
    sigma = np.full(z.shape, 0.003, np.float32)
    expected = edgePoints(z, pixelSize=0.01, noise=sigma, minSignificance=0)
    sigma[holes] = unknown
    found = edgePoints(z, pixelSize=0.01, noise=sigma, minSignificance=0)
    assert len(expected) > 0
    np.testing.assert_array_equal(found, expected)


def test_eps_is_the_tolerance_of_splitting():
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    options = dict(noise=0.001, mergeSignificance=0.0, minSignificance=0.0)
    assert edgeStrength(z, 0.1, **options).jump.any()
    with pytest.warns(rangeedge.RangeEdgeWarning, match="eps=0.3 exceeds the range of depths"):
        assert not edgeStrength(z, 0.3, **options).jump.any()
    assert edgeStrength(z, epsFactor=100.0, **options).jump.any()
    assert not edgeStrength(z, epsFactor=300.0, **options).jump.any()
    assert not edgeStrength(z, noise=0.2).jump.any()


def test_more_significance_leaves_fewer_candidates():
    z = surfaces(np.random.default_rng(10), (60, 60))
    counts = [len(edgePoints(z, noise=0.003, minSignificance=s)) for s in (0, 5, 10, 20)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[2] > 0
    assert (edgePoints(z, noise=0.003, minSignificance=10.0)["significance"] >= 10).all()


def test_types_and_shapes_of_the_results():
    strength = edgeStrength(np.ones((5, 7)), noise=0.01)
    assert strength._fields == NAMES
    assert [m.dtype for m in strength] == [np.float32, np.float32, np.uint8, np.float32]
    assert all(m.shape == (5, 7) and m.flags.c_contiguous for m in strength)
    assert len(edgePoints(np.ones((5, 7)), noise=0.01)) == 0


# Arguments.


@pytest.mark.parametrize("function", [edgeStrength, edgePoints])
@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (dict(src=[[1.0, 2.0]]), "src"),
        (dict(src=None), "src"),
        (dict(src=np.zeros(5)), "src"),
        (dict(src=np.zeros((0, 5))), "src"),
        (dict(src=np.zeros((5, 5, 2))), "src"),
        (dict(src=np.zeros((5, 5, 3), np.int32)), "src"),
        (dict(src=np.zeros((5, 5, 3, 1))), "src"),
        (dict(src=np.zeros((5, 5), complex)), "src"),
        (dict(src=np.zeros((5, 5), bool)), "src"),
        (dict(eps=0), "eps"),
        (dict(eps=-0.1), "eps"),
        (dict(eps=NAN), "eps"),
        (dict(eps="0.1"), "eps"),
        (dict(epsFactor=0), "epsFactor"),
        (dict(epsFactor=np.inf), "epsFactor"),
        (dict(K=np.eye(2)), "K"),
        (dict(K="camera"), "K"),
        (dict(K=np.diag([1.0, 1, 2])), "K"),
        (dict(K=np.diag([-1.0, 1, 1])), "K"),
        (dict(K=np.diag([1.0, 0, 1])), "K"),
        (dict(K=np.diag([NAN, 1, 1])), "K"),
        (dict(K=[[1, 0, 0], [0.1, 1, 0], [0, 0, 1]]), "K"),
        (dict(K=np.eye(3), pixelSize=1.0), "pixelSize"),
        (dict(K=np.eye(3), heightMap=True), "heightMap"),
        (dict(src=np.zeros((5, 5, 3)), K=np.eye(3)), "K"),
        (dict(src=np.zeros((5, 5, 3)), pixelSize=1.0), "pixelSize"),
        (dict(pixelSize=0), "pixelSize"),
        (dict(pixelSize=(1, -1)), "pixelSize"),
        (dict(pixelSize=(1, 2, 3)), "pixelSize"),
        (dict(pixelSize=NAN), "pixelSize"),
        (dict(heightMap=1), "heightMap"),
        (dict(depthFactor=0), "depthFactor"),
        (dict(depthFactor=-1), "depthFactor"),
        (dict(mask=np.ones((4, 5), np.uint8)), "mask"),
        (dict(mask=np.ones((5, 5))), "mask"),
        (dict(mask=[[1]]), "mask"),
        (dict(noise=0), "noise"),
        (dict(noise=-1.0), "noise"),
        (dict(noise=NAN), "noise"),
        (dict(noise="loud"), "noise"),
        (dict(noise=np.ones((4, 5))), "noise"),
        (dict(noise=np.zeros((5, 5))), "noise"),
        (dict(noise=np.full((5, 5), NAN)), "noise"),
        (dict(noise=np.ones((5, 5), complex)), "noise"),
        (dict(directions=0), "directions"),
        (dict(directions=16), "directions"),
        (dict(directions=1.0), "directions"),
        (dict(fit=2), "fit"),
        (dict(fit=True), "fit"),
        (dict(measure=-1), "measure"),
        (dict(crease="max"), "crease"),
        (dict(maxShift=-1), "maxShift"),
        (dict(maxShift=NAN), "maxShift"),
        (dict(maxGap=1.5), "maxGap"),
        (dict(maxGap=-1), "maxGap"),
        (dict(mergeSignificance=-1), "mergeSignificance"),
        (dict(minSignificance=-1), "minSignificance"),
        (dict(minSignificance=None), "minSignificance"),
    ],
)
def test_bad_arguments_are_named(function, arguments, name):
    arguments = {"src": np.ones((5, 5)), **arguments}
    with pytest.raises(rangeedge.error, match=f"{function.__name__}: `{name}` must be") as raised:
        function(**arguments)
    assert isinstance(raised.value, cv2.error)
    assert isinstance(raised.value, ValueError)
    assert raised.value.func == function.__name__


@pytest.mark.parametrize("function", [edgeStrength, edgePoints])
def test_an_unknown_argument_is_refused_with_a_hint(function):
    with pytest.raises(rangeedge.error, match=r"unknown argument `maxShfit`; did you mean `maxShift`\?"):
        function(np.ones((5, 5)), maxShfit=1)
    with pytest.raises(rangeedge.error, match=r"unknown argument `zzz`$"):
        function(np.ones((5, 5)), zzz=1)


def test_params_check_themselves():
    for name, value in dict(eps=0, epsFactor=-1, directions=0, fit=7, maxShift=NAN, maxGap=0.5).items():
        with pytest.raises(rangeedge.error, match=f"ScanLineParams: `{name}` must be"):
            ScanLineParams(**{name: value})


def test_the_paper_setting():
    paper = ScanLineParams.paper()
    assert (paper.fit, paper.measure, paper.crease) == (FIT_INTERP, MEASURE_MIDPOINT, CREASE_MAX)
    assert (paper.maxShift, paper.maxGap, paper.mergeSignificance, paper.minSignificance) == (0, 0, 0, 0)
    assert ScanLineParams.paper(eps=0.5, maxShift=2.0).maxShift == 2
    assert ScanLineParams().fit == FIT_LSQ


@pytest.mark.parametrize("function", [edgeStrength, edgePoints])
def test_signatures_show_every_parameter_with_its_default(function):
    shown = inspect.signature(function).parameters
    for f in fields(ScanLineParams):
        assert shown[f.name].default == f.default


def test_inputs_are_never_modified():
    rng = np.random.default_rng(12)
    z = surfaces(rng, (20, 24)).astype(np.float32)
    z[3, 4], z[5, 6] = np.inf, 0
    mask = (rng.random((20, 24)) < 0.8).astype(np.uint8)
    noise = np.full((20, 24), 0.003)
    points = np.dstack([z, z, z, z])
    inputs = [z, mask, noise, points, K]
    copies = [a.copy() for a in inputs]
    for a in (z, mask, noise, points):
        a.flags.writeable = False
    edgeStrength(z, mask=mask, noise=noise, K=K)
    edgeStrength(z, mask=mask, heightMap=True)
    edgeStrength(points, mask=mask, noise=noise)
    edgePoints(np.where(np.isfinite(z), z * 1000, 0).astype(np.uint16), mask=mask > 0, K=K)
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(inputs, copies, strict=True))


def test_memory_layout_does_not_matter():
    z = surfaces(np.random.default_rng(13), (24, 30)).astype(np.float32)
    mask = np.random.default_rng(14).integers(0, 2, (24, 30), dtype=np.uint8)
    expected = edgeStrength(z, noise=0.003, K=K, mask=mask)
    wide = np.zeros((48, 60), np.float32)
    wide[::2, ::2] = z
    for view in (wide[::2, ::2], np.asfortranarray(z), z[::-1].copy()[::-1], z.astype(">f4")):
        got = edgeStrength(view, noise=0.003, K=K.tolist(), mask=np.asfortranarray(mask))
        assert all(np.array_equal(a, b) for a, b in zip(expected, got, strict=True))


@pytest.mark.parametrize("dtype", [np.float16, ">f8", np.longdouble])
def test_other_floats_are_converted(dtype):
    z = np.where(np.arange(40) < 20, 1.25, 1.0) * np.ones((30, 1))
    expected = edgeStrength(z, noise=0.001)
    got = edgeStrength(z.astype(dtype), noise=0.001)
    assert all(np.allclose(a, b, rtol=1e-5) for a, b in zip(expected, got, strict=True))


def test_significance_is_what_the_threshold_compares():
    rng = np.random.default_rng(8)
    z = np.where(np.arange(80) < 40, 1.0, 1.05) * np.ones((60, 1)) + rng.normal(0, 0.005, (60, 80))
    all_of_them = edgePoints(z, noise=0.005, maxShift=0.0, minSignificance=6.0)
    for least in (9.0, 12.0, 20.0):
        kept = edgePoints(z, noise=0.005, maxShift=0.0, minSignificance=least)
        assert len(kept) == (all_of_them["significance"] >= least).sum()


@pytest.mark.parametrize("reach", [0.3, 1.0, 4.0])
def test_edges_stay_within_reach_of_their_cut(reach):
    z = np.abs(np.arange(80) - 40.2) * 0.5 * np.ones((60, 1)) + np.random.default_rng(9).normal(0, 0.3, (60, 80))
    options = dict(noise=0.3, minSignificance=0.0, crease=CREASE_MAX, directions=DIR_ROWS)
    cuts, moved = edgePoints(z, maxShift=0.0, **options), edgePoints(z, maxShift=reach, **options)
    assert len(cuts) == len(moved)
    assert 0 < np.abs(cuts["x"] - moved["x"]).max() <= reach + 1e-5


def test_errors_travel_between_processes():
    with pytest.raises(rangeedge.error) as raised:
        edgeStrength(None)
    copy = pickle.loads(pickle.dumps(raised.value))
    assert (copy.func, copy.err, copy.code, str(copy)) == (
        raised.value.func,
        raised.value.err,
        raised.value.code,
        str(raised.value),
    )


# Words


@pytest.mark.parametrize(
    ("kind", "words"),
    [(0, "none"), (1, "jump"), (np.uint8(9), "jump occluding"), (17, "jump occluded"), (2, "convex"), (4, "concave"),
     (32, "boundary"), (63, "jump occluding occluded convex concave boundary")],
)  # fmt: skip
def test_names_of_kinds(kind, words):
    assert rangeedge.kindNames(kind) == words


@pytest.mark.parametrize("kind", [-1, 64, 1.0, True, "jump", np.zeros(3, np.uint8)])
def test_no_kinds(kind):
    with pytest.raises(rangeedge.error, match="kindNames: `kind` must be an integer from 0 to 63, got"):
        rangeedge.kindNames(kind)


def test_results_print_counts_and_ranges():
    jump, crease, significance = np.zeros((3, 4, 5), np.float32)
    jump[1, 1:3], crease[0, 0], significance[1] = (0.25, 1.5), 45, 13
    strength = rangeedge.EdgeStrength(jump, crease, np.zeros((4, 5), np.uint8), significance)
    expected = (
        "EdgeStrength(5 x 4 pixels; jump at 2 from 0.25 to 1.5; crease at 1 from 45 to 45 degrees; "
        "significance at 5 from 13 to 13)"
    )
    assert repr(strength) == str(strength) == expected
    image = rangeedge.RangeImage(np.array([[0, 700, 1200]], np.uint16), {"K": np.eye(3)})
    assert repr(image) == "RangeImage(uint16 of shape (1, 3), 2 values from 700 to 1200, K)"
    assert "no data" in repr(rangeedge.RangeImage(np.full((2, 2), np.nan), {}))
    assert repr(rangeedge.NoiseModel(a=1e-3, correlation=2)) == "NoiseModel(a=0.001, correlation=2)"
    assert repr(rangeedge.ScanLineParams(K=np.eye(3))) == "ScanLineParams(K=float64 array of shape (3, 3))"


@pytest.mark.parametrize("sign", [1, -1])
def test_of_equal_creases_the_convex_one_tells_the_type(sign):
    """In the middle of a saddle rows and columns bend by 90 degrees, one way and the other."""
    y, x = np.mgrid[-20:21, -20:21].astype(float)
    options = {"pixelSize": 1, "noise": 0.001, "crease": rangeedge.CREASE_MAX}
    saddle = sign * (np.abs(x) - np.abs(y))
    across = [rangeedge.edgeStrength(saddle, directions=d, **options) for d in (rangeedge.DIR_ROWS, rangeedge.DIR_COLS)]
    assert {int(s.kind[20, 20]) for s in across} == {rangeedge.EDGE_CONVEX, rangeedge.EDGE_CONCAVE}
    assert across[0].crease[20, 20] == across[1].crease[20, 20]
    both = rangeedge.edgeStrength(saddle, directions=rangeedge.DIR_ROWS | rangeedge.DIR_COLS, **options)
    assert both.kind[20, 20] == rangeedge.EDGE_CONVEX


def test_segments_end_where_three_pixels_have_no_data():
    rng = np.random.default_rng(0)
    x = np.arange(60)
    z = 5 + 0.01 * x + np.where(x > 30, 0.05 * (x - 30), 0) + rng.normal(0, 0.01, (40, 60))
    hole = cv2.dilate((rng.random(z.shape) < 0.02).astype(np.uint8), np.ones((4, 4), np.uint8)) > 0
    hole[20, 30] = False
    z[hole] = np.nan
    for line in explainPixel(z, 30, 20, noise=0.01, pixelSize=1, reach=60).lines:
        missing = np.isnan(line.samples["depth"])
        wide = missing[:-2] & missing[1:-1] & missing[2:]
        for segment in line.segments:
            first, last = int(segment["first"]), int(segment["last"])
            assert not any(wide[k] for k in range(first, last - 1))
