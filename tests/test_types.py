"""What an editor and `mypy --strict` know of the package: right programs pass, wrong ones are told so."""

import subprocess
import sys
from pathlib import Path

import pytest
import typed

import rangeedge

GOOD = """
import numpy as np
import rangeedge
from rangeedge import EdgeStrength, NoiseModel, RangeImage, ScanLineParams

depth = np.ones((30, 40), np.float32)
K = np.eye(3)
options = {"maxGap": 3}

edges: np.ndarray = rangeedge.detectEdges(depth, 0.1, 25.0, K=K, minLength=9, noise=NoiseModel.kinect1())
edges = rangeedge.detectEdges(depth, jumpThreshold=None, eps=0.1, hysteresis=0.5, dynamic=True, mask=depth > 0)
strength: EdgeStrength = rangeedge.edgeStrength(depth, K=[[1, 0, 0], [0, 1, 0], [0, 0, 1]], maxGap=3)
both, same = rangeedge.detectEdgesWithStrength(depth, pixelSize=(0.1, 0.2), heightMap=True)
points = rangeedge.edgePoints(depth, directions=rangeedge.DIR_ROWS | rangeedge.DIR_COLS)
edges = rangeedge.thinEdges(rangeedge.selectEdges(strength, creaseThreshold=20, minLength=3))
edges = rangeedge.selectEdges(strength.jump, strength.crease, 0.1, 20.0, hysteresis=0.5)
jump, crease, kind, significance = same
name: str = rangeedge.kindNames(int(kind[0, 0]))

detector = rangeedge.createScanLineDetector(ScanLineParams(0.1, noise=0.01, K=K))
detector.setEps(None)
detector.setEps(3)
detector.setCreaseThreshold(20)
detector.setNoise(NoiseModel(a=0.1))
factor: float = detector.getEpsFactor()
matrix: np.ndarray | None = detector.getK()
gap: int = detector.getMaxGap()
edges = detector.detectEdges(depth, minLength=7)
jump = detector.detect(depth).jump

model: NoiseModel = rangeedge.estimateNoise(depth, K=K)
labels: np.ndarray = rangeedge.segmentRegions(depth, K=K, tolerance=2.0, minDistance=4)
count, labels, stats, centroids, surfaces = rangeedge.growRegionsWithStats(depth, labels, edges=edges, minArea=9)
closed = rangeedge.closeContours(edges, depth, share=0.8)
count, markers = rangeedge.extractSeeds(rangeedge.distanceTransform(edges), separation=0.5)
image: RangeImage = rangeedge.imreadRange("depth.png")
edges = rangeedge.detectEdges(image.src, **image.geometry)
bit: int = rangeedge.EDGE_JUMP | rangeedge.EDGE_OCCLUDING
"""

BAD = [
    ("rangeedge.detectEdges(depth, creaseTreshold=3)", 'argument "creaseTreshold"'),
    ('rangeedge.detectEdges(depth, creaseThreshold="30")', 'incompatible type "str"'),
    ('rangeedge.detectEdges(depth, maxGap="8")', 'incompatible type "str"'),
    ("rangeedge.detectEdges()", "Missing positional argument"),
    ("rangeedge.edgeStrength(depth, minLength=3)", 'argument "minLength"'),
    ("rangeedge.edgePoints(depth, maxshift=3)", 'argument "maxshift"'),
    ("rangeedge.detectEdgesWithStrength(depth).jump", 'has no attribute "jump"'),
    ('detector.setEps("a")', 'incompatible type "str"'),
    ("detector.setEpsilon(3)", 'has no attribute "setEpsilon"'),
    ("detector.setMaxGap(2.5)", 'incompatible type "float"'),
    ("detector.epsFactor = 3", 'has no attribute "epsFactor"'),
    ("detector.detectEdges(depth, minLenght=3)", 'argument "minLenght"'),
    ("text: str = detector.getMaxShift()", 'expression has type "float"'),
    ("rangeedge.ScanLineParams(epsilon=3)", 'argument "epsilon"'),
    ("rangeedge.segmentRegions(depth, minLength=3)", 'argument "minLength"'),
    ('rangeedge.growRegions(depth, depth, tolerance="3")', 'incompatible type "str"'),
    ("rangeedge.selectEdges(depth, depth)", "No overload variant"),
    ('rangeedge.kindNames("jump")', 'incompatible type "str"'),
    ("rangeedge.evaluateEdge", 'has no attribute "evaluateEdge"'),
]
HEAD = "import numpy as np\nimport rangeedge\ndepth = np.ones((3, 4))\ndetector = rangeedge.createScanLineDetector()\n"


@pytest.fixture(scope="module")
def complaints(tmp_path_factory):
    """What mypy says of both programs, by file and line."""
    pytest.importorskip("mypy")
    folder = tmp_path_factory.mktemp("types")
    (folder / "good.py").write_text(GOOD)
    (folder / "bad.py").write_text(HEAD + "".join(f"{line}\n" for line, _ in BAD))
    # The package as a user sees it: where it is not installed, it is not to be checked itself.
    home = Path(rangeedge.__file__).parents[1]
    config = "" if home.name == "site-packages" else f"mypy_path = {home}\n[mypy-rangeedge.*]\nignore_errors = True\n"
    (folder / "mypy.ini").write_text(f"[mypy]\n{config}")
    argv = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--config-file", "mypy.ini"]
    run = subprocess.run([*argv, "good.py", "bad.py"], cwd=folder, capture_output=True, text=True, check=False)
    assert run.stderr == ""
    found = {}
    for line in run.stdout.splitlines():
        place, _, text = line.partition(": ")
        found.setdefault(place, []).append(text)
    return found


def test_a_right_program_has_no_errors(complaints):
    assert {place: texts for place, texts in complaints.items() if place.startswith("good.py")} == {}


@pytest.mark.parametrize("number", range(len(BAD)), ids=[line for line, _ in BAD])
def test_a_wrong_line_is_an_error(complaints, number):
    place = f"bad.py:{number + 1 + HEAD.count(chr(10))}"
    assert any(BAD[number][1] in text for text in complaints.get(place, []) if text.startswith("error"))


def test_types_are_those_of_the_options():
    assert Path(rangeedge._typed.__file__).read_text("utf-8") == typed.text(), "run python tests/typed.py"
