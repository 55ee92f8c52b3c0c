"""Why a pixel is an edge or none: the answer is that of the detector, and what is said to turn it does."""

import re
import warnings

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import EDGE_CONVEX, NoiseModel, detectEdges, drawExplanation, explainPixel
from rangeedge.app.cli import main
from rangeedge.draw.explanation import _ticks
from rangeedge.edges import EdgeStrength
from rangeedge.frame import read_frame
from rangeedge.options import DETECTION, ScanLineParams, Selection
from rangeedge.synthetic import box, pinholeCamera, plane, renderScene
from rangeedge.verdict import Case

CAMERA = pinholeCamera(np.array([[80.0, 0, 39.5], [0, 80.0, 29.5], [0, 0, 1]]), (80, 60))
K = CAMERA.geometry["K"]
STAGES = ["no data", "no cut", "candidate", "significance", "far side", "threshold", "stray", "line", "thinned", "edge"]


def depths(seed, noise=0.002):
    """A box before a wall, in millimetres, with some holes."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    scene = [plane((0, 0, 1.3), (0.1, -0.4, -1)), box((0, 0, 0.9), (0.25, 0.2, 0.15), axes)]
    depth = renderScene(scene, CAMERA).depth + rng.normal(0, noise, (60, 80))
    depth[rng.integers(0, 60, 20), rng.integers(0, 80, 20)] = 0
    return np.rint(1000 * depth).astype(np.uint16)


CASES = {
    "default": (depths(0), {"K": K}),
    "thresholds": (depths(1), {"K": K, "jumpThreshold": 0.25, "creaseThreshold": 60, "noise": 0.002}),
    "hysteresis": (depths(2), {"K": K, "creaseThreshold": 80, "hysteresis": 0.5, "minLength": 12}),
    "noisy": (depths(3, 0.02), {"K": K}),
    "boundary": (depths(4), {"K": K, "boundaryEdges": True}),
    "lines": (depths(5, 0.008), {"K": K, "lineSignificance": 30, "dynamic": True}),
    "heights": (-depths(6) / 1000.0, {"heightMap": True, "pixelSize": 0.01, "noise": 0.002}),
    "rows": (depths(7), {"K": K, "directions": 1}),
    "paper": (depths(8), {"K": K, "fit": 1, "maxShift": 0, "mergeSignificance": 0, "minSignificance": 0}),
}


def near_edges(edges, every):
    """Pixels on and beside edges, and some far from them."""
    near = cv2.dilate(edges, np.ones((5, 5), np.uint8)) > 0
    near[::7, ::7] = True
    return list(zip(*np.nonzero(near.T), strict=True))[::every]


def halved(change, options):
    """Half of a change of these options: of a number half the way, of a switch nothing."""
    own = {**{name: option.default for name, option in DETECTION.items()}, **options}
    own["jumpThreshold"] = own["jumpThreshold"] or 0.0
    if own["lineSignificance"] is None:
        own["lineSignificance"] = 20.0 if own["minSignificance"] > 0 else 0.0
    half = {}
    for name, value in change.items():
        if not isinstance(value, bool):
            way = (value - own[name]) / 2
            half[name] = own[name] + (int(way) if isinstance(value, int) else way)
    return half


def check_change(why, src, options):
    """With the change the answer is the other one, with half of it not, and so many other pixels change as it says."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rangeedge.RangeEdgeWarning)  # of thresholds above every depth
        before = detectEdges(src, **options)
        turned = detectEdges(src, **{**options, **why.change})
        half = detectEdges(src, **{**options, **halved(why.change, options)})
    assert (turned[why.y, why.x] > 0) != why.edge, why
    assert (half[why.y, why.x] > 0) == why.edge, why
    assert why.others == np.count_nonzero(before != turned) - 1


@pytest.mark.parametrize("name", CASES)
def test_agrees_with_the_map(name):
    src, options = CASES[name]
    edges = detectEdges(src, **options)
    explained = changed = 0
    for x, y in near_edges(edges, 11):
        why = explainPixel(src, int(x), int(y), **options)
        assert why.edge == (edges[y, x] > 0)
        assert why.edge == (why.stage == "edge")
        assert why.stage in STAGES
        if why.change:
            check_change(why, src, options)
        explained, changed = explained + why.edge, changed + (why.edge and bool(why.change))
        if why.edge:
            assert why.nearest == ()
        elif why.nearest and why.nearest[0].edge:
            rows, cols = np.nonzero(edges)
            nearest = why.nearest[0]
            assert edges[nearest.y, nearest.x] > 0
            assert nearest.distance == np.hypot(rows - y, cols - x).min() == np.hypot(nearest.y - y, nearest.x - x)
        else:
            rows, cols = np.nonzero(edges)
            assert np.hypot(rows - y, cols - x).min() > 24
    assert changed >= 0.9 * explained > 3


ROOF = 0.06 * np.abs(np.arange(80) - 40.3) * np.ones((60, 1)) + np.random.default_rng(0).normal(0, 0.02, (60, 80))
SCENES = {
    "box": (depths(0), {"K": K}),
    "noisy": (depths(3, 0.008), {"K": K}),
    "other": (depths(11, 0.004), {"K": K}),
    "roof": (ROOF, {"noise": 0.02, "creaseThreshold": 5}),
}
STRICT = {
    "creaseThreshold": {"creaseThreshold": 110},
    "jumpThreshold": {"jumpThreshold": 0.9},
    "lineSignificance": {"lineSignificance": 500.0},
    "minLength": {"minLength": 200},
    "minSignificance": {"minSignificance": 300.0},
    "hysteresis": {"creaseThreshold": 150.0, "jumpThreshold": 3.0, "hysteresis": 0.7},
    "several": {"lineSignificance": 500.0, "minLength": 200, "creaseThreshold": 110},
}


@pytest.mark.parametrize("name", SCENES)
def test_of_an_edge_that_an_option_suppresses_the_option_is_named(name):
    """Together with those that the pieces of lines that are left then need; and never more of it than necessary."""
    src, known = SCENES[name]
    edges = detectEdges(src, **known)
    count = {True: 0, False: 0}
    for strict in STRICT.values():
        options = {**known, **strict}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rangeedge.RangeEdgeWarning)
            gone = np.argwhere((edges > 0) & (detectEdges(src, **options) == 0))[::23]
            found = [explainPixel(src, int(x), int(y), **options) for y, x in gone]
        for why in found:
            count[bool(why.change)] += 1
            if why.change:
                assert why.change.keys() & {*strict, "lineSignificance", "minLength"}
                check_change(why, src, options)
    assert count[True] > 3 * count[False]


def test_change_is_a_round_number_that_hardly_exceeds_what_is_needed():
    step = np.where(np.arange(40) < 20, 1.0, 1.2468) * np.ones((30, 1))
    step[:, 35:] = 2.0
    roof = 0.2 * np.abs(np.arange(64) - 30.3) * np.ones((48, 1))  # 22.62 degrees
    assert explainPixel(step, 19, 15, 0.3, noise=0.001).change == {"jumpThreshold": 0.246}
    assert explainPixel(step, 19, 15, noise=0.001).change == {"jumpThreshold": 0.25}
    assert explainPixel(roof, 30, 20, noise=0.001).change == {"creaseThreshold": 22.0}
    assert explainPixel(roof, 30, 20, creaseThreshold=60.0, noise=0.001).change == {"creaseThreshold": 20.0}


def test_thresholds_that_switch_a_kind_off_have_a_change_too():
    step = np.where(np.arange(40) < 20, 1.0, 1.2468) * np.ones((30, 1))
    roof = 0.2 * np.abs(np.arange(64) - 30.3) * np.ones((48, 1))  # 22.62 degrees
    off = explainPixel(step, 19, 15, np.inf, noise=0.001).change["jumpThreshold"]
    assert 0.22 <= off <= 0.2468
    off = explainPixel(roof, 30, 20, creaseThreshold=np.inf, noise=0.001).change["creaseThreshold"]
    assert 10 <= off <= 22.62


def test_of_several_options_that_drop_a_line_the_one_is_named_that_changes_the_fewest_others():
    """A short step beside long ones, larger than these, and as significant."""
    surface = np.ones((60, 60))
    surface[:, 30:] += 0.3
    surface[10:22, 5:15] = 0.5
    why = explainPixel(surface, 9, 10, noise=0.001)
    assert (why.edge, why.change) == (True, {"lineSignificance": 230.0})
    assert why.others == np.count_nonzero(detectEdges(surface, noise=0.001)[:, :20]) - 1


@pytest.mark.parametrize("name", ["default", "heights", "noisy"])
def test_lines_are_those_of_edge_points(name):
    """Cuts that passed are the points of `edgePoints` on the lines through the pixel, but for the second adaptation."""
    src, options = CASES[name]
    own = {n: v for n, v in options.items() if n in rangeedge.ScanLineParams.options}
    points = rangeedge.edgePoints(src, **own)
    for x, y in ((40, 30), (33, 22), (50, 40)):
        if src[y, x] == 0:
            continue
        why = explainPixel(src, x, y, reach=100, **options)
        assert [line.direction for line in why.lines] == [1, 2, 4, 8]
        for line in why.lines:
            on = points[points["direction"] == line.direction]
            if line.direction == 1:
                on = on[on["y"] == y]
            elif line.direction == 2:
                on = on[on["x"] == x]
            else:
                sign = 1 if line.direction == 4 else -1
                on = on[np.abs((on["x"] - x) + sign * (on["y"] - y)) < 1e-3]
            passed = [cut for cut in line.cuts if not cut.test]
            assert len(passed) == len(on)
            assert np.allclose(sorted(cut.significance for cut in passed), np.sort(on["significance"]), rtol=1e-5)


def test_samples_and_curves_of_a_roof():
    roof = 0.2 * np.abs(np.arange(64) - 30.3) * np.ones((48, 1))
    row = explainPixel(roof, 30, 20, noise=0.001, directions=1).lines[0]
    assert row.name == "row"
    assert row.samples["x"][row.at] == 30
    assert row.samples["y"][row.at] == 20
    assert np.allclose(row.samples["depth"], roof[20, 6:55])
    assert np.allclose(row.samples["fittedDepth"], row.samples["depth"], atol=1e-9)
    assert row.segments["first"].tolist() == [-6, 25]
    assert row.segments["last"].tolist() == [24, 57]
    (cut,) = row.cuts
    assert (cut.x, cut.y) == pytest.approx((30.3, 20))
    assert cut.crease == pytest.approx(2 * np.degrees(np.arctan(0.2)), abs=1e-5)
    assert (cut.before, cut.after) == ((30, 20), (31, 20))


def test_names_the_nearest_edge_and_a_nearer_candidate():
    surface = np.zeros((40, 80))
    surface[:, 20:] = 0.5  # the jump, seen from the nearer side
    surface[:, 40:] += 0.1 * np.arange(40)  # a crease of 5.7 degrees, below the threshold
    why = explainPixel(surface, 35, 20, noise=0.001)
    candidate, edge = why.nearest[1], why.nearest[0]
    assert (edge.x, edge.y, edge.distance, edge.edge, edge.jump) == (19, 20, 16, True, pytest.approx(0.5, abs=1e-6))
    assert candidate.edge is False
    assert abs(candidate.x - 39.5) <= 0.5
    assert candidate.crease == pytest.approx(np.degrees(np.arctan(0.1)), abs=0.01)
    assert "The nearest edge is (19, 20), 16 pixels away: a jump of 0.5 (jump, nearer side)." in str(why)
    assert "The nearest candidate, itself no edge, is (" in str(why)
    assert explainPixel(np.ones((40, 80)), 35, 20, noise=0.001).nearest == ()


def test_every_stage_by_hand():
    step = np.where(np.arange(40) < 20, 1.0, 1.25) * np.ones((30, 1))
    step[3, 3] = np.nan
    step[:, 35:] = 2.0
    explained = {
        (19, 15): "edge",
        (20, 15): "far side",
        (5, 15): "no cut",
        (3, 3): "no data",
    }
    for (x, y), stage in explained.items():
        assert explainPixel(step, x, y, noise=0.001).stage == stage
    assert explainPixel(step, 19, 15, 0.3, noise=0.001).stage == "threshold"
    assert explainPixel(step, 19, 15, 0.3, noise=0.001).change == {"jumpThreshold": 0.25}
    assert explainPixel(step, 19, 15, noise=0.001, minLength=31).change == {"minLength": 30}
    weak = explainPixel(step, 19, 15, noise=0.001, lineSignificance=1e6)
    assert (weak.stage, list(weak.change)) == ("line", ["lineSignificance"])
    assert weak.value < weak.limit == 1e6
    lost = explainPixel(step, 19, 15, noise=0.001, minSignificance=1e4)
    assert (lost.stage, lost.limit) == ("significance", 1e4)
    assert lost.change["minSignificance"] < lost.value


def test_a_stray_crease_needs_the_fourth_strongest_around_it():
    params = ScanLineParams(pixelSize=1)
    frame = read_frame(np.ones((9, 9)), params).with_noise(0.01)
    crease = np.zeros((9, 9), np.float32)
    crease[[4, 3, 5, 4, 4], [4, 4, 4, 5, 3]] = 40, 35, 27.25, 25.5, 20
    kind = np.where(crease > 0, EDGE_CONVEX, 0).astype(np.uint8)
    strength = EdgeStrength(np.zeros_like(crease), crease, kind, np.full_like(crease, 50))
    verdict = Case(frame, strength, params, Selection(), 4, 4).verdict(())
    assert (verdict.stage, verdict.value, verdict.limit) == ("stray", 2, 4)
    assert verdict.changes[0]["creaseThreshold"] == pytest.approx(25.5, rel=0.01)


def test_faint_crease_names_its_significance():
    rng = np.random.default_rng(0)
    roof = 0.02 * np.abs(np.arange(64) - 30.0) * np.ones((48, 1)) + rng.normal(0, 0.05, (48, 64))
    stages = {explainPixel(roof, x, 24, noise=0.05).stage for x in range(26, 36)}
    assert "edge" not in stages


def test_what_is_still_in_the_way_is_said():
    """A line that minLength drops, beside which the pixel lies: without that option it is selected, and thinned."""
    roof = 0.5 * np.abs(np.arange(64) - 30.4) * np.ones((48, 1))
    strength = rangeedge.edgeStrength(roof, noise=0.001)
    thin = detectEdges(roof, noise=0.001)
    y, x = np.argwhere((strength.crease > 30) & (thin == 0))[20]
    why = explainPixel(roof, int(x), int(y), noise=0.001, minLength=60)
    assert (why.stage, why.change) == ("line", {})
    assert why.obstacle.startswith("With minLength=48: It is selected, but edges are one pixel wide")
    assert f"No change of options was found that makes it one. {why.obstacle}" in str(why)


def test_panorama():
    """A scanner that turns in a square room: the pixel is found in its sector."""
    turn, rise = np.meshgrid(np.linspace(-np.pi, np.pi, 720, endpoint=False), np.linspace(0.3, -0.3, 16))
    rays = np.stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)], axis=-1)
    room = rays * (3 / np.abs(rays[..., :2]).max(axis=-1, keepdims=True))
    edges = detectEdges(room, noise=0.001)
    corners = np.flatnonzero(edges[8])
    assert np.allclose(corners, [90, 270, 450, 630], atol=1)
    for x in corners.tolist():
        why = explainPixel(room, x, 8, noise=0.001)
        assert why.edge
        row = why.lines[0]
        assert (row.samples["x"][row.at], row.samples["y"][row.at]) == (x, 8)
        assert any(abs(cut.x - x) < 1 and not cut.test for cut in row.cuts)


def test_words_and_picture():
    src, options = CASES["default"]
    why = explainPixel(src, 40, 30, **options)
    text = str(why)
    assert text.startswith("Pixel (40, 30), ")
    assert all(f"\n{name}: " in text for name in ("row", "column", "diagonal 45", "diagonal 135"))
    picture = drawExplanation(why)
    assert picture.shape[0] > 700
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    assert np.array_equal(cv2.imdecode(np.frombuffer(why._repr_png_(), np.uint8), 1), picture)
    without = explainPixel(src, *np.argwhere(src.T == 0)[0].tolist(), **options)
    assert (without.stage, without.lines) == ("no data", ())
    assert drawExplanation(without).ndim == 3


@pytest.mark.parametrize(
    ("low", "high", "ticks", "digits"),
    [
        (0.7185, 0.7445, [0.72, 0.73, 0.74], 2),
        (0.57, 1.08, [0.6, 0.8, 1.0], 1),
        (-3.0, 41.0, [0, 10, 20, 30, 40], 0),
        (1000.0, 1000.001, [1000.0002, 1000.0004, 1000.0006, 1000.0008], 4),
    ],
)
def test_depths_are_marked_at_round_numbers(low, high, ticks, digits):
    found, needed = _ticks(low, high)
    assert found[(found > low + 1e-9) & (found < high - 1e-9)] == pytest.approx(ticks, abs=1e-9)
    assert needed == digits


@pytest.mark.parametrize(
    ("arguments", "words"),
    [((80, 3), "80 x 60"), ((-1, 3), "`x`"), ((1.5, 3), "`x`"), ((3, 60), "80 x 60")],
)
def test_bad_pixels(arguments, words):
    with pytest.raises(rangeedge.error, match=words):
        explainPixel(depths(0), *arguments, K=K)
    with pytest.raises(rangeedge.error, match="reach"):
        explainPixel(depths(0), 1, 1, K=K, reach=0)
    with pytest.raises(rangeedge.error, match="explanation"):
        drawExplanation(None)


def test_command(tmp_path, capsys):
    cv2.imwrite(str(tmp_path / "depth.png"), depths(0))
    command = ["explain", str(tmp_path / "depth.png"), "-K", "80,80,39.5,29.5", "--at", "40,30"]
    assert main([*command, "--out", str(tmp_path / "why.png")]) == 0
    assert capsys.readouterr().out == f"{explainPixel(depths(0), 40, 30, K=K)}\n"
    assert cv2.imread(str(tmp_path / "why.png")) is not None
    assert main([*command[:-1], "400,30"]) == 2
    assert "80 x 60" in capsys.readouterr().err
    for wrong in ("40", "a,b", "40,30,1"):
        with pytest.raises(SystemExit):
            main([*command[:-1], wrong])


def test_command_names_options_as_it_takes_them(tmp_path, capsys):
    """What it advises, typed as it stands, turns the answer."""
    cv2.imwrite(str(tmp_path / "depth.png"), depths(0))
    thin = detectEdges(depths(0), K=K)
    y, x = np.argwhere(thin)[len(np.argwhere(thin)) // 2]
    command = ["explain", str(tmp_path / "depth.png"), "-K", "80,80,39.5,29.5", "--at", f"{x},{y}"]
    for options in ([], ["--line-significance", "1e6"]):
        assert main([*command, *options]) == 0
        said = capsys.readouterr().out
        advice = re.search(
            r"^  With (.*) it is (none|one)\.( \d+ other edge pixels come or go with that\.)?$", said, re.MULTILINE
        )
        assert not re.search(r"creaseThreshold|jumpThreshold|minLength|lineSignificance", said)
        assert main([*command, *options, *advice[1].split(", ")]) == 0
        assert (", no edge." in capsys.readouterr().out) == (advice[2] == "none")


def test_noise_that_is_larger_over_many_pixels_is_said_to_be():
    image, known = depths(1), {"K": K}
    waves = explainPixel(image, 10, 10, noise=NoiseModel(0.002, correlation=4.2), **known)
    assert waves.correlation == 4.2
    assert "noise 0.002 m (correlated: 4.2 times that over many pixels);" in str(waves)
    assert "noise 0.002 m;" in str(explainPixel(image, 10, 10, noise=0.002, **known))
