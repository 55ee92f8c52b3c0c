"""Calls of every public function with arrays and options of all kinds: what comes is an answer or `rangeedge.error`.

    python tests/fuzz.py --minutes 60

calls every function for its share of the time, each in a process of its own, and prints how many answers and errors
came, and one call for each place where the rules are broken; a build with sanitizers (CONTRIBUTING.md) finds more.
`pytest tests/test_fuzz.py` makes a few of the same calls.

Rules: no exception but `rangeedge.error`; no warning but `RangeEdgeWarning`; inputs as they were; the same answer, bit
for bit, from a second call with another number of threads; a `dst` that fits is returned, any other left alone.
"""

from __future__ import annotations

import argparse
import inspect
import itertools
import os
import subprocess
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge import evaluation

TINY, LARGE = 5e-324, 1.7e308
BUNCH = 40  # calls, after which the time is looked at
BEGINS = "bunch "  # what a process says before its number
PACKAGE = str(Path(rangeedge.__file__).parent)
NUMBERS = [
    *(0, 1, -1, 2, 3, 8, 30, 64, 255, 1000, 2**31 - 1, 2**31, 2**63, -(2**63), 10**400),
    *(0.0, -0.0, 0.1, 0.5, 0.9, 1e-3, 1e-6, 1e-30, 1e-38, 1e-45, 1e-60, 1e-300, TINY),
    *(1e6, 1e30, 1e38, 1e39, 1e300, LARGE),
    *(np.inf, -np.inf, np.nan, np.float32(0.25), np.int8(3), np.uint64(7), np.float16(2), True, False),
]  # fmt: skip
ODD = [None, "", "x", b"x", (), [], {}, object(), 1j, (1, 2), [[1], [2, 3]], np.zeros(0), np.array("x"), np.float32]
DTYPES = ["u1", "?", "u2", "i2", "i4", "u4", "i8", "f2", "f4", "f8", "g"]
SHAPES = [(1, 1), (1, 7), (9, 1), (2, 2), (3, 5), (16, 16), (24, 33), (33, 24), (64, 80), (7, 120)]

USUAL = [0.01, 0.1, 0.5, 1, 1.0, 2, 3, 5, 8, 20, 30.0, 90.0]

values = st.sampled_from(NUMBERS)
usual = st.sampled_from(USUAL)
seeds = st.integers(0, 2**16)


def content(shape: tuple[int, ...], kind: str, rng: np.random.Generator) -> np.ndarray:
    """Numbers of an image in double precision."""
    v, u = np.indices(shape[:2])
    plane = 2 + 0.01 * u + 0.02 * v
    image = {
        "constant": np.ones(shape[:2]),
        "zero": np.zeros(shape[:2]),
        "plane": plane,
        "step": plane + (u > shape[1] // 2),
        "roof": 3 - 0.1 * np.abs(u - shape[1] / 2),
        "noise": rng.normal(1, 0.1, shape[:2]),
        "checkers": 1.0 + (u + v) % 2,
        "alternating": (-1.0) ** (u + v) * (1 + u + v),
        "labels": (u // 4 + 8 * (v // 4)) % 23,
        "binary": (rng.random(shape[:2]) < 0.2) * 255,
        "extreme": rng.choice([0, 1, -1, TINY, 1e-300, 1e-40, 1e38, 1e300, LARGE, np.inf, -np.inf, np.nan], shape[:2]),
        "far": plane + (u > shape[1] // 2) * 0.01 + 5e5,
        "small": plane * 1e-200,
        "large": plane * 1e200,
        "nothing": np.full(shape[:2], np.nan),
    }[kind].astype(float)
    if len(shape) == 3:
        with np.errstate(all="ignore"):
            image = np.stack(
                [(u - shape[1] / 2) * image, (v - shape[0] / 2) * image, image, image][: shape[2]], axis=-1
            )
    return image


KINDS = ["constant", "zero", "plane", "step", "roof", "noise", "checkers", "alternating", "labels", "binary", "extreme"]
KINDS += ["far", "small", "large", "nothing"]


def laid_out(array: np.ndarray, layout: str) -> np.ndarray:
    """The same numbers elsewhere in memory."""
    if layout == "fortran":
        return np.asfortranarray(array)
    if layout == "reversed":
        return np.ascontiguousarray(array[::-1, ::-1])[::-1, ::-1]
    if layout == "strided":
        return np.repeat(np.repeat(array, 2, axis=0), 3, axis=1)[::2, ::3]
    if layout == "swapped":
        return array.astype(array.dtype.newbyteorder())
    if layout == "unaligned":
        raw = np.empty(array.nbytes + 1, np.uint8)[1:]
        raw[:] = np.frombuffer(array.tobytes(), np.uint8)
        return raw.view(array.dtype).reshape(array.shape)
    array = np.ascontiguousarray(array)
    array.flags.writeable = layout != "readonly"
    return array


LAYOUTS = ["plain", "plain", "readonly", "fortran", "reversed", "strided", "swapped", "unaligned"]


@st.composite
def images(draw: Any, shape: tuple[int, int], dtypes: list[str] = DTYPES, deep: bool = False) -> np.ndarray:
    kind, rng = draw(st.sampled_from(KINDS)), np.random.default_rng(draw(seeds))
    if deep and draw(st.booleans()):
        shape, dtypes = (*shape, draw(st.sampled_from([3, 4]))), ["f4", "f8"]
    image = content(shape, kind, rng)
    if draw(st.booleans()):
        image[rng.random(shape[:2]) < 0.1] = np.nan
    dtype = np.dtype(draw(st.sampled_from(dtypes)))
    scale, layout = draw(st.sampled_from([1, 1000])), draw(st.sampled_from(LAYOUTS))
    with np.errstate(all="ignore"):
        if dtype.kind in "iu":
            image = np.clip(np.nan_to_num(image * scale), 0, np.iinfo(dtype).max // 2)
        return laid_out(image.astype(dtype), layout)


FLAGS = {
    "fit": [rangeedge.FIT_LSQ, rangeedge.FIT_INTERP],
    "measure": [rangeedge.MEASURE_MIDPOINT, rangeedge.MEASURE_ENDPOINT],
    "crease": [rangeedge.CREASE_MAX, rangeedge.CREASE_NORMAL],
    "directions": list(range(1, 16)),
    "method": [0, 1, 2, 3],
    **{
        name: [False, True]
        for name in (
            *("heightMap", "dynamic", "boundaryEdges", "wrap", "newSeeds", "log", "lengths", "key"),
            *("shadowEdges", "removeFlying"),
        )
    },
}
CAMERAS = [(50, 50, 16, 12), (1e-3, 1e3, 0, 0), (1e300, 1e-300, 0, 0), [[60, 2, 9], [0, 60, 9], [0, 0, 1]]]
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
}
MASKS = ("mask", "edges", "barrier", "ignore")
DEEP = ("src",)
LABELS = ("labels", "markers")
ABOVE = ("distance", "salience", "strength", "jump", "crease")


@st.composite
def arguments(draw: Any, name: str, shape: tuple[int, int]) -> Any:
    """A value for a parameter of that name: mostly one that is meant, sometimes none that is."""
    oddity = draw(st.sampled_from(range(40)))
    if oddity == 0:
        return draw(st.sampled_from(ODD))
    if oddity == 1:
        return draw(images(draw(st.sampled_from(SHAPES)), deep=True))
    if name in ("noise", "pixelSize") and oddity == 2:
        return draw(images(shape, ["f4", "f8"]))
    if name in FLAGS:
        return draw(st.sampled_from(FLAGS[name]))
    if name in GIVEN:
        return draw(st.sampled_from(GIVEN[name])) if oddity > 3 else draw(values)
    if name in MASKS:
        return draw(images(shape, ["u1", "?"]))
    if name in LABELS:
        return draw(images(shape, ["i4"]))
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
    if name in "xy":
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
    ("toLines", "lines"): [CHAINS, list(CHAINS), SEGMENTS, BROKEN, ARCS, BROKEN_ARCS, BOUNDARIES],
    ("drawPanels", "panels"): [[("a", PICTURE)], [("a", PICTURE), ("x\udcff", PICTURE[:9, :5, 0])]],
    ("drawExplanation", "explanation"): EXPLAINED,
    ("mapFrames", "function"): [rangeedge.detectEdges, rangeedge.edgePoints, rangeedge.thinEdges],
    ("mapFrames", "jobs"): [1],  # others would be hundreds of processes
    ("kindNames", "kind"): [5],
    ("overallStrength", "crease"): [STRENGTH.crease],
    ("overallStrength", "jump"): [STRENGTH.jump],
    ("createScanLineDetector", "params"): [rangeedge.ScanLineParams(noise=0.1)],
}
LIKE_SCENE = {name for name, _ in MADE if name.startswith(("draw", "overall"))}
FILES = ("imreadRange", "imwriteRange", "readLines", "writeLines")  # tests/test_broken_files.py is about these
FUNCTIONS = {
    name: function
    for name in rangeedge.__all__
    if inspect.isroutine(function := getattr(rangeedge, name)) and name not in FILES
}
FUNCTIONS |= {name: getattr(evaluation, name) for name in ("hooverScores", "baddeleyDelta", "prattFOM")}


def destination(name: str) -> str:
    """The parameter that takes the array to be written."""
    return "edges" if name == "detectEdges" else "dst"


@st.composite
def calls(draw: Any, name: str) -> dict[str, Any]:
    """Keyword arguments for a function: those that must be given, and a few others."""
    shape = SCENE.shape if name in LIKE_SCENE else draw(st.sampled_from(SHAPES))
    parameters = inspect.signature(FUNCTIONS[name]).parameters
    needed = [p for p in parameters if parameters[p].default is inspect.Parameter.empty]
    optional = [p for p in parameters if p not in needed]
    chosen = draw(st.lists(st.sampled_from(optional), max_size=4, unique=True)) if optional else []
    given_values = {}
    for argument in [*needed, *chosen]:
        made = MADE.get((name, argument))
        if made and (argument == "jobs" or draw(st.integers(0, 9))):
            given_values[argument] = draw(st.sampled_from(made))
        elif argument == destination(name):
            like = draw(st.sampled_from(["f4", "u1", "f8", "i4"]))
            given_values[argument] = draw(
                st.one_of(images(shape, [like]), st.sampled_from([None, "x", np.zeros((3, 3))]))
            )
        else:
            given_values[argument] = draw(arguments(argument, shape))
    return given_values


def leaves(result: Any) -> list[Any]:
    if isinstance(result, rangeedge.frames.FrameResult):
        result = result._replace(seconds=0.0)
    if isinstance(result, (tuple, list)):
        return [leaf for part in result for leaf in leaves(part)]
    return [result]


def frozen(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes() if value.dtype.kind != "O" else repr(value)
    return repr(value)


def outcome(name: str, given_values: dict[str, Any], threads: int) -> Any:
    cv2.setNumThreads(threads)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", rangeedge.RangeEdgeWarning)
        try:
            result = FUNCTIONS[name](**given_values)
            return list(result) if isinstance(result, Iterator) else result
        except rangeedge.error as problem:
            return problem


def expect_rules(name: str, given_values: dict[str, Any]) -> bool:
    """Makes a call twice and asserts that it keeps the rules; whether it is answered."""
    arrays = {k: v for k, v in given_values.items() if isinstance(v, np.ndarray) and k != destination(name)}
    before = {k: frozen(v) for k, v in arrays.items()}
    dst = given_values.get(destination(name))
    old = frozen(dst)
    threads = cv2.getNumThreads()
    try:
        first = outcome(name, given_values, 1)
        kept = [frozen(leaf) for leaf in leaves(first)]
        if isinstance(dst, np.ndarray) and first is not dst:
            assert frozen(dst) == old, "a `dst` that is not returned was written"
        second = outcome(name, given_values, 3)
    finally:
        cv2.setNumThreads(threads)
    assert kept == [frozen(leaf) for leaf in leaves(second)], "the answer changes"
    assert before == {k: frozen(v) for k, v in arrays.items()}, "an input was modified"
    return not isinstance(first, rangeedge.error)


def fuzz(
    name: str, examples: int, bunch: int | None = None, *, shrink: bool = False, seen: Counter[str] | None = None
) -> None:
    """Makes that many calls of a function, those of a numbered bunch or always the same; counts what came of them."""

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=bunch is None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate, Phase.shrink] if shrink else [Phase.generate],
    )
    @given(calls(name))
    def run(given_values: dict[str, Any]) -> None:
        answered = expect_rules(name, given_values)
        if seen is not None:
            seen["answers" if answered else "errors"] += 1

    (run if bunch is None else seed(bunch)(run))()


def place(problem: BaseException) -> str:
    """Where an exception came from: the last line of the package, and its type."""
    frames = [f for f in traceback.extract_tb(problem.__traceback__) if "hypothesis" not in f.filename]
    frames = [f for f in frames if PACKAGE in f.filename] or frames
    return f"{type(problem).__name__} at {frames[-1].filename}:{frames[-1].lineno}"


def fuzz_for(name: str, seconds: float, first: int, *, shrink: bool = False) -> int:
    """Calls a function until the time is up; prints one call for each place where one fails, and returns how many."""
    start, found, seen = time.monotonic(), set(), Counter()
    for bunch in itertools.count(first):
        if time.monotonic() > start + seconds:
            break
        print(f"{BEGINS}{bunch}", flush=True)
        try:
            fuzz(name, BUNCH, bunch, shrink=shrink, seen=seen)
        except Exception as problem:
            if place(problem) not in found:
                found.add(place(problem))
                print(f"{name}: {place(problem)}: {problem}", *getattr(problem, "__notes__", []), sep="\n", flush=True)
    print(
        f"{name:36} {seen['answers']:7} answers {seen['errors']:7} errors {time.monotonic() - start:6.0f} s"
        f" {len(found)} kinds of failures",
        flush=True,
    )
    return len(found)


def fuzz_apart(name: str, seconds: float, first: int, *, shrink: bool = False) -> int:
    """The same in a process of its own, whose death is a failure, too."""
    bunch = first
    command = [sys.executable, "-u", __file__, "--minutes", str(seconds / 60), "--only", name, "--bunch", str(first)]
    with subprocess.Popen([*command, "--here", *["--shrink"] * shrink], stdout=subprocess.PIPE, text=True) as run:
        for line in run.stdout:
            if line.startswith(BEGINS):
                bunch = int(line.removeprefix(BEGINS))
            else:
                print(line, end="", flush=True)
    if run.returncode in (0, 1):
        return run.returncode
    print(f"{name}: died, exit code {run.returncode}; again by --here --only {name} --bunch {bunch}", flush=True)
    return 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--only", nargs="*", default=list(FUNCTIONS), choices=FUNCTIONS, metavar="FUNCTION")
    parser.add_argument("--bunch", type=int, default=0, metavar="N", help="begin with this bunch of calls")
    parser.add_argument("--here", action="store_true", help="all in this process, which a crash ends")
    parser.add_argument(
        "--shrink", action="store_true", help="make calls that fail as small as possible, which takes long"
    )
    parser.add_argument("--files", action="store_true", help="mutated files, too")
    options = parser.parse_args()
    seconds = 60 * options.minutes / len(options.only)
    fuzzing = fuzz_for if options.here else fuzz_apart
    failed = sum(fuzzing(name, seconds, options.bunch, shrink=options.shrink) for name in options.only)
    if options.files:
        environment = {**os.environ, "RANGEEDGE_FUZZ": "1000"}
        files = Path(__file__).with_name("test_broken_files.py")
        failed += subprocess.run([sys.executable, "-m", "pytest", "-q", files], env=environment, check=False).returncode
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
