"""Every sample runs, on its own scene or on an image, and writes what it says."""

import csv
import importlib
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import imreadRange, imwriteRange
from rangeedge.synthetic import box, pinholeCamera, plane, renderScene

SAMPLES = Path(__file__).resolve().parents[1] / "samples"
PICTURES = {
    "edges": ["edges.png"],
    "explain": ["explain.png"],
    "thinning": ["thinning.png"],
    "distance_map": ["distance_map.png"],
    "salience_map": ["salience_map.png"],
    "seeds": ["seeds.png", "seeds.tiff"],
    "segmentation": ["segmentation.png"],
    "pipeline": ["candidates.png"],
    "box_dimensions": ["box_dimensions.png"],
}
OTHERS = {"calibration", "camera", "common", "elevation", "paper", "scan_line", "scores", "tune"}


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


def test_scores_prefer_rangeedge(capsys):
    run("scores")
    ours, canny, regions = capsys.readouterr().out.splitlines()
    values = [[float(word.split()[-1]) for word in line.split(",")] for line in (ours, canny)]
    assert values[0][0] > 0.98 > values[1][0]
    assert values[0][1] > values[1][1]
    assert values[0][2] < values[1][2]
    assert regions.startswith("regions after Hoover: truth ")
