"""Arguments for `fuzz.py`: for every parameter of every function values that are meant, and a few that are not."""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
from fuzz_arrays import LARGE, SHAPES, TINY, images, seeds, wrapped
from hypothesis import strategies as st

import rangeedge
from rangeedge import evaluation, optimality, synthetic
from rangeedge.io import calibration

NUMBERS = [
    *(0, 1, -1, 2, 3, 8, 30, 64, 255, 1000, 2**31 - 1, 2**31, 2**63, -(2**63), 10**400),
    *(0.0, -0.0, 0.1, 0.5, 0.9, 1e-3, 1e-6, 1e-30, 1e-38, 1e-45, 1e-60, 1e-300, TINY),
    *(1e6, 1e30, 1e38, 1e39, 1e300, LARGE),
    *(np.inf, -np.inf, np.nan, np.float32(0.25), np.int8(3), np.uint64(7), np.float16(2), True, False),
]  # fmt: skip
ODD = [None, "", "x", b"x", (), [], {}, object(), 1j, (1, 2), [[1], [2, 3]], np.zeros(0), np.array("x"), np.float32]
ODD += [np.array(0.5), np.array([0.5]), Ellipsis, NotImplemented, range(3), rangeedge.NoiseModel(0.1)]
USUAL = [0.01, 0.1, 0.5, 1, 1.0, 2, 3, 5, 8, 20, 30.0, 90.0]

values = st.sampled_from(NUMBERS)
usual = st.sampled_from(USUAL)

FLAGS = {
    "fit": [rangeedge.FIT_LSQ, rangeedge.FIT_INTERP],
    "measure": [rangeedge.MEASURE_MIDPOINT, rangeedge.MEASURE_ENDPOINT],
    "crease": [rangeedge.CREASE_MAX, rangeedge.CREASE_NORMAL],
    "directions": list(range(1, 16)),
    "method": [0, 1, 2, 3],
    "calibration": [1, 2],
    **{
        name: [False, True]
        for name in (
            *("heightMap", "dynamic", "boundaryEdges", "wrap", "newSeeds", "log", "lengths", "radii", "key"),
            *("shadowEdges", "removeFlying", "convex"),
        )
    },
}
CAMERAS = [(50, 50, 16, 12), (1e-3, 1e3, 0, 0), (1e300, 1e-300, 0, 0), [[60, 2, 9], [0, 60, 9], [0, 0, 1]]]
VECTORS = [(0, 0, 1), (0.1, -0.2, 1.5), [1e300, 0, 0], np.array([0, 0, 2.0]), (0, 0, 0), (TINY, 0, 0), (1e-200, 0, 1)]
PLANES = np.array(
    [[1.0, 0, 0, 1], [-1, 0, 0, 1], [0, 1, 0, 1], [0, -1, 0, 1], [0, 0, 1, 3], [0, 0, -1, -1]]  # of a box
)
UNITS = np.array([[0, 0, 1], [0.6, 0, 0.8], [0, -0.6, 0.8], [0, 0.28, 0.96], [0.48, 0.6, 0.64]])
GIVEN = {
    "K": CAMERAS,
    "distCoeffs": [[0.1, -0.2, 0.001, 0.002], np.zeros(5), [1e300] * 8],
    "pixelSize": [(1, 2), 0.5, (1e-200, 1e200), (1e300, 1e300), 1e-45],
    "origin": [(0, 0, 0), (1, 2, 3), (1e300, 0, 0)],
    "invalid": [0, (1, 2), (0, (5, 9)), np.nan],
    "noise": [0.01, 1e-4, rangeedge.NoiseModel(0.01, 0, 1e-3), rangeedge.NoiseModel(1e-300, 0, 1e300)],
    "imageSize": [(33, 24), (640, 480), (10**6, 1)],
    "scale": [1, 2, 3],
    "title": ["", "x\udcff", "\0\n"],
    "transform": [(0, 1, 0, 0, 0, 1)],
    "seed": [0, 7],
    "fits": [None, (0.1,) * 47, (0.0,) * 47, (1e300,) * 47],
    "planes": [PLANES, PLANES[:5], PLANES * 1e150, PLANES * 1e-200],
    "errors": [np.array([0.1, -2, 3]), np.full(3, 1e300), np.zeros(5)],
    "creaseTruth": [np.full((24, 33), 20, np.float32)],
    "jumpTruth": [np.full((24, 33), 0.5, np.float32)],
    "rotation": [None, np.eye(3), np.eye(3)[[1, 2, 0]], np.zeros((3, 3))],
    **dict.fromkeys(("center", "apex", "axis", "point", "normal", "first", "second", "light"), VECTORS),
    **{f"normals{i}": [UNITS, UNITS[::-1], UNITS[:1], UNITS * 1e-200, -UNITS] for i in (1, 2)},
}
MASKS = ("mask", "edges", "barrier", "ignore")
DEEP = ("src",)
LABELS = ("labels", "markers")
ABOVE = ("distance", "salience", "strength", "jump", "crease")
CODES = ("code",)


@st.composite
def arguments(draw: Any, name: str, shape: tuple[int, int]) -> Any:
    """A value for a parameter of that name: mostly one that is meant, sometimes none that is."""
    oddity = draw(st.sampled_from(range(40)))
    if oddity == 0:
        return draw(st.sampled_from(ODD))
    if oddity == 1:
        other = images(draw(st.sampled_from(SHAPES)), deep=True)
        return draw(st.one_of(other, wrapped(other)))
    if oddity == 2:
        if name in ("noise", "pixelSize"):
            return draw(images(shape, ["f4", "f8"]))
        if name in (*MASKS, *LABELS, *DEEP, *ABOVE):
            return draw(wrapped(arguments(name, shape).filter(lambda value: isinstance(value, np.ndarray))))
    if name in FLAGS:
        return draw(st.sampled_from(FLAGS[name]))
    if name in GIVEN:
        return draw(st.sampled_from(GIVEN[name])) if oddity > 3 else draw(values)
    if name in MASKS:
        return draw(images(shape, ["u1", "?"]))
    if name in LABELS:
        return draw(images(shape, ["i4"]))
    if name in CODES:
        image = draw(images(shape, ["u1", "u2", "i4"]))
        return image if image.dtype == np.uint8 else np.minimum(image, 4095)
    if name == "truth":
        return draw(images(shape, ["u1", "i4"]))
    if name in DEEP:
        return draw(images(shape, deep=True))
    if name in ABOVE:
        image = np.abs(draw(images(shape, ["u1", "f4"] if name == "salience" else ["u1", "f4", "f8"])))
        if image.dtype.kind == "f" and oddity > 7:
            image = np.where(image < np.inf, image, 0)
            return np.minimum(image, 1, dtype=image.dtype) if name == "salience" else image
        return image
    if name == "points":
        return draw(images((*shape, 3), ["f4", "f8"]))
    if name == "frames":
        return draw(images((draw(st.integers(1, 3)), *shape)))
    if name == "z":
        return draw(images((1, shape[0] * shape[1])))[0]
    if name in ("elevation", "azimuth"):
        return np.linspace(-80, 80, shape[name == "azimuth"])
    if name in ("x", "y"):
        return draw(st.integers(0, shape[1 - "xy".index(name)]))
    return draw(values if oddity < 8 else usual)


SCENE = np.where(np.arange(33) < 15, 1.0, 2.0) * np.ones((24, 1)) + 0.02 * np.arange(24)[:, None]
STRENGTH = rangeedge.edgeStrength(SCENE)
CHAINS = rangeedge.linkEdges(SCENE)
SEGMENTS, VERTICES = rangeedge.fitSegments(CHAINS, minPoints=2)
REGIONS = (SCENE > 1.5).astype(np.int32) + 1
BOUNDARIES = rangeedge.regionBoundaries(REGIONS, SCENE)
BROKEN = SEGMENTS.copy()
BROKEN["pixels"], BROKEN["ends"], BROKEN["vertices"] = np.inf, np.nan, 10**6
HOLE = np.where(np.hypot(*np.ogrid[-12:12, -16:17]) < 9, 2.0, 1.0)
RIMS = rangeedge.linkEdges(HOLE, noise=0.001)
ARCS = rangeedge.fitArcs(RIMS)
BROKEN_ARCS = ARCS.copy()
BROKEN_ARCS["center"], BROKEN_ARCS["ends"], BROKEN_ARCS["angle"] = np.nan, np.inf, np.inf
EXPLAINED = [rangeedge.explainPixel(SCENE, x, 3, reach=reach) for x, reach in ((14, 20), (0, 3), (20, 40))]
PICTURE = np.zeros((24, 33, 3), np.uint8)
LINES = rangeedge.toLines(CHAINS)
BROKEN_LINES = [
    [rangeedge.Line(5, False, np.zeros((2, 2)), np.zeros((2, 3)), {})],
    [rangeedge.Line("jump", False, None, None, None)],
    [rangeedge.Line("jump", True, np.zeros((2, 2)), np.zeros((3, 3)), {})],
    [rangeedge.Line("jump", True, np.zeros((0, 2)), np.zeros((0, 3)), {"a": object()})],
]
CAMERA = synthetic.pinholeCamera(np.array([[40.0, 0, 16], [0, 40, 12], [0, 0, 1]]), (33, 24))
SCENES = [synthetic.demoScene(), synthetic.roof(60), [], [synthetic.sphere((0, 0, 1), 0.2)], [None]]
RENDERING = synthetic.renderScene(synthetic.roof(60), CAMERA)
# The cameras of the scanners are known by their geometry, here of small images.
OF_ABW, OF_PERCEPTRON = (
    synthetic.renderScene([synthetic.plane((0, 0, 900), (0, 0, 1))], dataclasses.replace(camera, size=(33, 24)))
    for camera in (synthetic.abwCamera(), synthetic.perceptronCamera())
)
NOISY = ("gaussianNoise", "triangulationNoise", "kinectNoise")
EVERY_PARAMS = st.fixed_dictionaries(
    {}, optional={name: arguments(name, (24, 33)) for name in inspect.signature(rangeedge.ScanLineParams).parameters}
)


def params_of(options: dict[str, Any]) -> rangeedge.ScanLineParams:
    """These options where they can be, else those of the paper."""
    try:
        return rangeedge.ScanLineParams(**options)
    except rangeedge.error:
        return rangeedge.ScanLineParams.paper()


MADE = {
    ("selectEdges", "strength"): [STRENGTH],
    ("drawOverview", "strength"): [STRENGTH],
    ("fitSegments", "chains"): [CHAINS, list(CHAINS), CHAINS[:0]],
    ("drawChains", "chains"): [CHAINS, CHAINS[:0]],
    ("drawSegments", "segments"): [SEGMENTS, SEGMENTS[:0], BROKEN],
    ("drawSegments", "vertices"): [VERTICES, VERTICES[:0]],
    ("fitArcs", "chains"): [RIMS, list(RIMS), CHAINS, RIMS[:0]],
    ("drawArcs", "arcs"): [ARCS, ARCS[:0], BROKEN_ARCS],
    ("drawBoundaries", "boundaries"): [BOUNDARIES],
    ("drawEdges", "kind"): [STRENGTH.kind],
    ("toLines", "lines"): [CHAINS, list(CHAINS), SEGMENTS, BROKEN, ARCS, BROKEN_ARCS, BOUNDARIES, LINES, *BROKEN_LINES],
    ("drawPanels", "panels"): [[("a", PICTURE)], [("a", PICTURE), ("x\udcff", PICTURE[:9, :5, 0])]],
    ("drawExplanation", "explanation"): EXPLAINED,
    ("mapFrames", "function"): [rangeedge.detectEdges, rangeedge.edgePoints, rangeedge.thinEdges],
    ("kindNames", "kind"): [5],
    ("overallStrength", "crease"): [STRENGTH.crease],
    ("overallStrength", "jump"): [STRENGTH.jump],
    ("evaluateEdges", "kind"): [STRENGTH.kind],
    ("evaluateEdges", "jump"): [STRENGTH.jump],
    ("evaluateEdges", "crease"): [STRENGTH.crease],
    ("box", "size"): [(1, 2, 3), (TINY, 1, 1), (1e300, 1, 1), (1, 1, -1)],
    ("planePair", "first"): [UNITS[1], UNITS[2], UNITS[0]],
    ("planePair", "second"): [UNITS[0], UNITS[3], -UNITS[1]],
    ("planePair", "point"): [(0, 0, 1), (0.1, 0, 2)],
    ("abwNoise", "rendering"): [OF_ABW],
    ("perceptronNoise", "rendering"): [OF_PERCEPTRON],
    ("pinholeCamera", "size"): [(33, 24), (2, 2)],
    ("orthographicCamera", "size"): [(33, 24), (2, 2)],
    ("renderScene", "scene"): SCENES,
    **{(name, "camera"): [CAMERA] for name in ("renderScene", "polyhedraScene", "curvedScene")},
    **{(name, "rendering"): [RENDERING] for name in NOISY},
}
# Others would be hundreds of processes, or hours.
ALWAYS = {
    ("mapFrames", "jobs"): [1],
    ("mapFrames", "client"): [None, 5],
    ("analyseOptimality", "frequency"): [1, 2, 0, -1, 1.5, True, 10**400],
    ("measureDetector", "size"): [16, 20, 24, 0, -1, 1.5, True],
    **{(name, "size"): [(33, 24), (2, 2), (1, 1), (2.5, 2), 5] for name in ("pinholeCamera", "orthographicCamera")},
}
LIKE_SCENE = {name for name, _ in MADE if name.startswith(("draw", "overall", "evaluate"))}
FILES = ("imreadRange", "imwriteRange", "readLines", "writeLines")  # tests/test_broken_files.py is about these


class Method:
    """A method of a detector, of a new one at every call."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.__signature__ = inspect.signature(getattr(rangeedge.createScanLineDetector(), name))

    def __call__(self, *args: Any, **given: Any) -> Any:
        detector = rangeedge.createScanLineDetector()
        found = getattr(detector, self.name)(*args, **given)
        if self.name.startswith("set"):
            return found, getattr(detector, f"get{self.name.removeprefix('set')}")()
        return found


def routines(module: Any) -> dict[str, Callable[..., Any]]:
    """The functions that a module offers."""
    return {name: found for name in module.__all__ if inspect.isroutine(found := getattr(module, name))}


METHODS = [name for name in dir(rangeedge.ScanLineDetector) if name.startswith(("set", "detect"))]
MODELS = ("azureKinect", "kinect1", "kinect2", "realsense", "stereo", "structuredLight")
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: function for name, function in routines(rangeedge).items() if name not in FILES},
    **{name: function for module in (evaluation, optimality, synthetic) for name, function in routines(module).items()},
    **{name: getattr(calibration, name) for name in ("abwPoints", "perceptronPoints")},
    "NoiseModel": rangeedge.NoiseModel,
    **{f"NoiseModel.{name}": getattr(rangeedge.NoiseModel, name) for name in MODELS},
    "ScanLineParams": rangeedge.ScanLineParams,
    "ScanLineParams.paper": rangeedge.ScanLineParams.paper,
    **{f"ScanLineDetector.{name}": Method(name) for name in METHODS},
}


def destination(name: str) -> str:
    """The parameter that takes the array to be written."""
    return "edges" if name.endswith("detectEdges") else "dst"


@functools.cache
def parameters_of(name: str) -> tuple[list[str], list[str]]:
    """Those that must be given, and the others."""
    parameters = inspect.signature(FUNCTIONS[name]).parameters.values()
    named = [p for p in parameters if p.kind is not inspect.Parameter.VAR_KEYWORD]
    needed = [p.name for p in named if p.default is inspect.Parameter.empty]
    return needed, [p.name for p in named if p.name not in needed]


@st.composite
def calls(draw: Any, name: str) -> dict[str, Any]:
    """Arguments by name for a function: those that must be given, and a few others."""
    shape = SCENE.shape if name in LIKE_SCENE else draw(st.sampled_from(SHAPES))
    needed, optional = parameters_of(name)
    chosen = draw(st.lists(st.sampled_from(optional), max_size=4, unique=True)) if optional else []
    given: dict[str, Any] = {}
    always = [argument for function, argument in ALWAYS if function == name]
    for argument in dict.fromkeys([*needed, *always, *chosen]):
        made = MADE.get((name, argument))
        if argument in always:
            given[argument] = draw(st.sampled_from(ALWAYS[name, argument]))
        elif made and draw(st.integers(0, 9)):
            given[argument] = draw(st.sampled_from(made))
        elif argument == "params":
            given[argument] = draw(EVERY_PARAMS.map(params_of))
        elif argument == destination(name):
            arrays = [value for value in given.values() if isinstance(value, np.ndarray)]
            fitting = images(shape, [draw(st.sampled_from(["f4", "u1", "f8", "i4"]))])
            others = [None, "x", np.zeros((3, 3)), [0.0], *arrays]
            given[argument] = draw(st.one_of(fitting, wrapped(fitting), st.sampled_from(others)))
        else:
            given[argument] = draw(arguments(argument, shape))
    return given


def seeded(name: str) -> Any:
    """Calls of a function with the seed of what is written into their arrays meanwhile."""
    return st.tuples(calls(name), seeds)
