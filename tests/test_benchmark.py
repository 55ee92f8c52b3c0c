"""The benchmark runs, and prints what it says."""

import re
import sys
from pathlib import Path

import cv2
import pytest


@pytest.fixture
def perf(monkeypatch):
    """The modules of the benchmark; the number of threads is afterwards what it was."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "perf"))
    threads = cv2.getNumThreads()
    import benchmark
    import frames
    import worst

    yield benchmark, frames, worst
    cv2.setNumThreads(threads)


def test_a_frame_has_every_stage_and_its_peers(perf, capsys):
    benchmark, frames, _ = perf
    benchmark.show("small room", frames.room(96, 64), 1)
    text = capsys.readouterr().out
    rows = dict(re.findall(r"^(\w[\w., ]*?)  +([\d. ]+)$", text, re.MULTILINE))
    for name in ("detectEdges", "thinEdges", "extractSeeds", "depth to seeds", "cv2.Canny", "copy of the image"):
        assert len(rows[name].split()) == 10  # twice least and median, gain, four ratios, nanoseconds
    assert "small room: uint16, 96 x 64" in text
    assert re.search(r"^\d+ candidates, ", text, re.MULTILINE)


def test_frames_that_are_not_there_are_named(perf, capsys, monkeypatch, tmp_path):
    _, frames, _ = perf
    monkeypatch.setattr(frames, "SHARED", tmp_path)
    assert set(frames.frames()) == {"room 640x480", "room 1920x1080", "lidar 128x1024, points", "terrain 2000x2000"}
    assert re.search(r"tum_fr3 is left out: no .*RANGEEDGE_SHARED", capsys.readouterr().out)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from Linux")
def test_worst_images_are_compared_with_a_typical_one(perf, capsys):
    _, _, worst = perf
    worst.worst([(64, 48), (96, 64)], ["barrier"])
    text = capsys.readouterr().out
    cost = r" +([\d.]+)[* ] +([\d.]+)[* ]"
    rows = re.findall(r"^(\w+(?:, \w+)?): (.*?) " + 4 * cost + "$", text, re.MULTILINE)
    assert {function for function, *_ in rows} == {"distanceTransform, barrier"}
    assert len(rows) > 4
    for _, name, *costs in rows:
        assert all(float(cost) > 0 for cost in costs[::2])
        assert name != "typical" or costs[1::2] == 4 * ["1.0"]


@pytest.mark.filterwarnings("ignore")
def test_every_function_has_images_that_are_worse(perf):
    _, _, worst = perf
    images = worst.Images(32, 24)
    for function, cases in worst.functions().items():
        names = []
        for name, make in cases(images):
            make()()
            names.append(name)
        assert names[0] == "typical"
        assert len(names) == len(set(names)) > 2, function


@pytest.mark.parametrize(
    ("costs", "marks"), [((10.0, 30.0), ""), ((30.0, 10.0), "*"), ((101.0, 101.0), "*"), ((100.0, 100.0), "")]
)
def test_what_takes_too_much_is_marked(perf, costs, marks):
    _, _, worst = perf
    cost, smallest = costs
    cells = worst._cells((cost, 1.0), (10.0, 1.0), (smallest, 1.0))
    assert cells.replace(" ", "").count("*") == len(marks)
