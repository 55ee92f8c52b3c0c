"""Every sample runs, on its own scene or on an image, and writes what it says."""

import csv
import importlib
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import EDGE_CONVEX, EDGE_JUMP, detectEdges, imreadRange, imwriteRange, readLines
from rangeedge.synthetic import box, demoScene, kinectCamera, kinectNoise, pinholeCamera, plane, renderScene, sphere

SAMPLES = Path(__file__).resolve().parents[1] / "samples"
PICTURES = {
    "overview": ["overview.jpg"],
    "edges": ["edges.png"],
    "explain": ["explain.png"],
    "thinning": ["thinning.png"],
    "distance_map": ["distance_map.png"],
    "salience_map": ["salience_map.png"],
    "seeds": ["seeds.png", "seeds.tiff"],
    "segmentation": ["segmentation.png"],
    "pipeline": ["candidates.png"],
    "box_dimensions": ["box_dimensions.png"],
    "clean_depth": ["clean_depth.png"],
    "weld_line": ["weld_line.png"],
    "roof_ridges": ["roof_ridges.png"],
    "stair_edges": ["stair_edges.png"],
    "live": ["live.png"],
}
OTHERS = {"calibration", "camera", "elevation", "paper", "ros2_node", "scan_line", "scores", "tune"}


@pytest.fixture(autouse=True)
def from_samples(monkeypatch):
    monkeypatch.syspath_prepend(SAMPLES)
    yield
    for name in (*OTHERS, *PICTURES):
        sys.modules.pop(name, None)


def run(name, *argv):
    return importlib.import_module(name).main([str(arg) for arg in argv])


@pytest.fixture
def image(tmp_path):
    """A box on a table, 200 x 150 pixels, seen by a camera whose matrix is in the file."""
    camera = pinholeCamera(np.array([[180.0, 0, 99.5], [0, 180.0, 74.5], [0, 0, 1]]), (200, 150))
    lying = np.array([[0.9, 0.3, -0.3], [-0.3, 0.95, 0.0], [0.3, 0.1, 0.95]])
    axes = np.linalg.qr(lying)[0]
    scene = [plane((0, 0, 1.2), (0, -0.5, -1)), box((0, 0, 0.95), (0.25, 0.2, 0.15), axes)]
    depth = renderScene(scene, camera).depth + np.random.default_rng(0).normal(0, 0.001, (150, 200))
    path = tmp_path / "box.npz"
    imwriteRange(path, np.rint(1000 * depth).astype(np.uint16), **camera.geometry)
    return path


def test_every_sample_is_tested():
    assert {path.stem for path in SAMPLES.glob("*.py")} == {*OTHERS, *PICTURES}


@pytest.mark.parametrize("name", PICTURES)
def test_runs_on_an_image(name, image, tmp_path, capsys):
    out = tmp_path / "pictures"
    run(name, image, "--out", out)
    said = capsys.readouterr().out
    for picture in PICTURES[name]:
        content = cv2.imread(str(out / picture), cv2.IMREAD_UNCHANGED)
        assert content.shape[0] >= 150
        assert content.shape[1] >= 200
        assert content.max() > 0
        assert str(out / picture) in said


@pytest.mark.parametrize("name", ["edges", "seeds"])
def test_runs_on_a_grid_without_edges(name, tmp_path):
    imwriteRange(tmp_path / "flat.npz", np.zeros((60, 80), np.float32), pixelSize=0.5, heightMap=True)
    run(name, tmp_path / "flat.npz", "--out", tmp_path)
    assert (tmp_path / PICTURES[name][0]).exists()


def test_pipeline_grips_every_object_of_the_scene(tmp_path):
    run("pipeline", "--out", tmp_path)
    with open(tmp_path / "candidates.csv", newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    assert len(rows) > 10
    for row in rows:
        place, normal = (np.array([row[prefix + axis] for axis in "xyz"]) for prefix in ("", "normal_"))
        assert abs(np.linalg.norm(normal) - 1) < 1e-3
        assert normal @ place < 0
        assert row["free"] >= 0.015
        assert row["unevenness"] <= 0.003
    # Tops of boxes are parallel to the table, which is seen under 32 degrees.
    tops = [row for row in rows if abs(row["normal_y"] + np.cos(np.radians(32))) < 0.03]
    assert len(tops) >= 3


def test_the_box_is_measured_within_three_millimetres(tmp_path):
    sizes = run("box_dimensions", "--out", tmp_path)
    assert np.allclose([size.length for size in sizes], (0.20, 0.25, 0.30), atol=0.003)
    assert all(abs(size.length - truth) < size.deviation for size, truth in zip(sizes, (0.2, 0.25, 0.3), strict=True))
    assert min(size.strips for size in sizes) > 50


def test_the_larger_box_is_measured_among_others(tmp_path):
    """Two boxes on a table, seen under 30 degrees, a ball before the larger one; the table leaves the image."""
    turn, tilt = (cv2.Rodrigues(np.array(angle))[0] for angle in ((0, 0.6, 0), (-0.52, 0, 0)))

    def placed(x, depth, y):
        return tuple((tilt.T @ (x, y, depth) + (0, 0, 1.2)).tolist())

    scene = [
        plane((0, 0, 2.5), (0, 0, -1)),
        box(placed(0, 0, 0.4), (4.0, 0.5, 1.0), tilt.T),
        box(placed(0.1, 0.1, 0.05), (0.4, 0.2, 0.3), tilt.T @ turn),
        box(placed(-0.4, 0.0, 0.1), (0.1, 0.1, 0.1), tilt.T @ turn),
        sphere(placed(0.05, -0.3, 0.1), 0.05),
    ]
    scan = kinectNoise(renderScene(scene, kinectCamera()), seed=1)
    imwriteRange(tmp_path / "scene.npz", scan.src, **scan.geometry)
    sizes = run("box_dimensions", tmp_path / "scene.npz", "--out", tmp_path)
    assert np.allclose([size.length for size in sizes], (0.2, 0.3, 0.4), atol=0.01)


def test_where_there_is_no_box_none_is_measured(tmp_path):
    np.save(tmp_path / "flat.npy", np.full((60, 80), 2.0, np.float32))
    assert run("box_dimensions", tmp_path / "flat.npy", "-K", "80,80,39.5,29.5", "--out", tmp_path) == []


def test_depths_are_cleaned_better_than_by_filters(tmp_path):
    found = run("clean_depth", "--out", tmp_path)
    surfaces, edges, holes, filled = found["cleanDepth"]
    assert surfaces < found["as measured"][0] / 2
    assert edges < found["as measured"][1] / 2
    assert holes < 1.5
    assert filled > 0.95 * found["inpaint"][3]
    assert all(surfaces < other[0] for name, other in found.items() if name != "cleanDepth")


def test_toes_of_the_weld_are_found_within_twenty_micrometres(tmp_path):
    left, right = run("weld_line", "--out", tmp_path)
    for off in (left, right):
        assert len(off) > 600
        assert np.sqrt(np.mean(off**2)) < 0.02
    assert len(readLines(tmp_path / "weld_line.csv")) == 2


def test_ridges_and_eaves_lie_on_the_map(tmp_path):
    off = run("roof_ridges", "--out", tmp_path)
    assert len(off[EDGE_CONVEX]) == 3
    assert 16 <= len(off[EDGE_JUMP]) <= 18  # two eaves and four verges a house, which meet below the ends of the ridge
    assert max(off[EDGE_CONVEX]) < 0.05
    assert max(off[EDGE_JUMP]) < 0.25  # a pixel
    lines = readLines(tmp_path / "roof_ridges.geojson")
    east, north, _ = np.concatenate([line.points for line in lines]).T
    assert 358000 < east.min() < east.max() < 358080
    assert 5811935 < north.min() < north.max() < 5812000


def test_steps_are_measured_within_two_millimetres(tmp_path):
    rises, treads = run("stair_edges", "--out", tmp_path)
    assert np.allclose(rises, np.full(4, 0.17), atol=0.002)
    assert np.allclose(treads, np.full(4, 0.28), atol=0.002)


def test_pipeline_needs_a_camera(tmp_path, capsys):
    imwriteRange(tmp_path / "flat.npy", np.zeros((60, 80), np.float32))
    with pytest.raises(SystemExit) as end:
        run("pipeline", tmp_path / "flat.npy", "--out", tmp_path / "out")
    assert end.value.code == 2
    assert "pinhole camera" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_pipeline_heeds_the_depth_factor(image, tmp_path):
    src, geometry = imreadRange(image)
    imwriteRange(tmp_path / "tenths.npz", 10 * src, K=geometry["K"], depthFactor=10000)
    run("pipeline", image, "--out", tmp_path / "one")
    run("pipeline", tmp_path / "tenths.npz", "--out", tmp_path / "other")
    one, other = ((tmp_path / name / "candidates.csv").read_text() for name in ("one", "other"))
    assert one == other
    assert one.count("\n") > 1


def test_paper_prints_and_draws(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    run("paper", "--frequency", 4, "--pairs", 3, "--sigma", 0, "--out", tmp_path / "new" / "folder")
    printed = capsys.readouterr().out
    assert "CREASE_MAX     theory, all 5151 pairs: |E| 6.08 ± 7.23" in printed
    assert "CREASE_NORMAL  theory, all 5151 pairs: |E| 0.00 ± 0.00" in printed
    assert "CREASE_NORMAL  detector, sigma 0, 3 of 3 pairs" in printed
    for number in (6, 7, 8, 10, 11):
        assert cv2.imread(str(tmp_path / "new" / "folder" / f"figure{number}.png")).std() > 10
    quiet = [float(line.split("F ")[1].split(",")[0]) for line in printed.splitlines() if line.startswith("  eps")]
    assert len(quiet) == 3
    assert min(quiet) > 0.99
    off = [float(line.split(": ")[1].split(",")[0]) for line in printed.splitlines() if line.startswith("  adapted")]
    assert off[0] < 0.5


def test_calibration_prints_shares_near_those_of_a_normal_deviate(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    run("calibration", "--out", tmp_path)
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if " n = " in line]
    assert len(lines) == 6 * 4 * 2
    ratios = np.array([[float(word) for word in line[-5:]] for line in lines])
    slopes = np.array(["slope" in line for line in lines])
    assert ((ratios[slopes, :2] > 0.5) & (ratios[slopes, :2] < 2)).all()
    assert (ratios[:, :2] < 2).all()
    assert cv2.imread(str(tmp_path / "calibration.png")).std() > 10


@pytest.mark.parametrize("argv", [["--frequency", "1"], ["--frequency", "x"], ["--sigma", "-1"]])
def test_paper_refuses_bad_options(argv, capsys):
    pytest.importorskip("matplotlib")
    with pytest.raises(SystemExit) as exit_:
        run("paper", "--frequency", "3", "--pairs", "1", *argv)
    assert exit_.value.code == 2
    assert "usage" in capsys.readouterr().err


def test_live_shows_every_frame_of_a_recording(tmp_path, capsys):
    depth = np.full((3, 60, 80), 1500, np.uint16)
    depth[:, 20:40, 30:50] = 1000
    np.savez(tmp_path / "walk.npz", depth=depth, K=np.array([[80.0, 0, 39.5], [0, 80, 29.5], [0, 0, 1]]))
    run("live", tmp_path / "walk.npz", "--out", tmp_path)
    said = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in said[:3]] == ["frame 0", "frame 1", "frame 2"]
    assert all("2 regions" in line for line in said[:3])


def test_the_node_publishes_the_edges_of_a_bag(tmp_path, capsys):
    pytest.importorskip("rosbags")
    from rosbags.highlevel import AnyReader

    run("ros2_node", "--out", tmp_path)
    assert "edges of 3 images" in capsys.readouterr().out
    src, geometry = kinectNoise(renderScene(demoScene(), kinectCamera()))[:2]
    edges = detectEdges(src, **geometry)
    with AnyReader([tmp_path / "edges"]) as reader:
        messages = [reader.deserialize(data, connection.msgtype) for connection, _, data in reader.messages()]
    assert [message.header.stamp.sec for message in messages] == [0, 1, 2]
    for message in messages:
        assert message.encoding == "mono8"
        assert np.array_equal(message.data.reshape(message.height, message.width), edges)


def test_scan_line_has_one_strong_candidate(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    run("scan_line", "--out", tmp_path)
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    (creases,) = [[float(word) for word in line[2:]] for line in lines if line[0] == "crease"]
    assert sorted(creases)[-1] > 30
    assert sorted(creases)[-2] < 4
    assert cv2.imread(str(tmp_path / "scan_line.png")).std() > 10


def test_tuning_loses_edges_when_everything_must_be_certain(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    run("tune", "--out", tmp_path)
    recall = [float(line.split()[4]) for line in capsys.readouterr().out.splitlines() if "recall" in line]
    assert len(recall) == 28
    assert all(sweep[-1] < 0.7 * max(sweep) for sweep in np.reshape(recall, (4, 7)))
    assert cv2.imread(str(tmp_path / "tune.png")).std() > 10


def test_tuning_an_image_of_ones_own_counts_edges_by_kind(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    step = np.where(np.arange(80) < 30, 900, 1200) * np.ones((60, 1))
    cv2.imwrite(str(tmp_path / "step.png"), step.astype(np.uint16))
    run("tune", tmp_path / "step.png", "-K", "100,100,39.5,29.5", "--out", tmp_path)
    counted = [line.split()[1:] for line in capsys.readouterr().out.splitlines() if "convex" in line]
    assert len(counted) == 28
    assert counted[2] == ["jump", "60", "convex", "0", "concave", "0"]  # of a straight jump of 60 rows
    assert (tmp_path / "tune.png").exists()
    edges = np.zeros((60, 80), np.uint8)
    edges[:, 29] = 255
    cv2.imwrite(str(tmp_path / "truth.png"), edges)
    run("tune", tmp_path / "step.png", "-K", "100,100,39.5,29.5", "--truth", tmp_path / "truth.png", "--out", tmp_path)
    assert "precision 1  recall 1\n" in capsys.readouterr().out


def test_elevation_has_walls_ridges_and_toes(tmp_path, capsys):
    run("elevation", "--out", tmp_path)
    said = dict(line.split(": ") for line in capsys.readouterr().out.splitlines() if line.endswith("pixels"))
    assert all(int(count.split()[0]) > 150 for count in said.values())
    assert (tmp_path / "lines.geojson").stat().st_size > 1000
    assert cv2.imread(str(tmp_path / "elevation.png")).shape[1] > 900


def test_camera_runs_frames_through_one_detector(image, tmp_path, capsys):
    run("camera", "--out", tmp_path)
    assert capsys.readouterr().out.count("edge pixels in") == 8
    detector = rangeedge.createScanLineDetector()
    detector.load(tmp_path / "detector.yml")
    assert detector.getK()[0, 0] == 525
    run("camera", image, image, "-K", "180,180,99.5,74.5", "--out", tmp_path)
    assert capsys.readouterr().out.count("edge pixels in") == 2
    with pytest.raises(SystemExit):
        run("camera", image)


def test_scores_prefer_rangeedge(tmp_path, capsys):
    run("scores", "--out", tmp_path)
    ours, canny, regions, _ = capsys.readouterr().out.splitlines()
    values = [[float(word.split()[-1]) for word in line.split(",")] for line in (ours, canny)]
    assert values[0][0] > 0.98 > values[1][0]
    assert values[0][1] > values[1][1]
    assert values[0][2] < values[1][2]
    assert regions.startswith("regions after Hoover: truth ")
