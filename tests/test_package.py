"""The package as a whole: its names and signatures, what importing it costs, its types, and the documented examples."""

import ast
import doctest
import importlib
import importlib.metadata
import inspect
import json
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import _core

PUBLIC = """
    error RangeEdgeWarning Cancellation RangeImage imreadRange imwriteRange sweepToPoints backproject project NoiseModel
    estimateNoise ScanLineParams splitScanLine EdgeStrength edgeStrength edgePoints kindNames flyingPixels
    strengthImage overallStrength selectEdges thinEdges detectEdges detectEdgesWithStrength ScanLineDetector
    Explanation explainPixel
    createScanLineDetector mapFrames EdgeChain EdgeChains linkEdges Segments fitSegments fitArcs
    Line toLines writeLines readLines closeContours
    distanceTransform distanceTransformWithLabels salienceDistanceTransform salienceDistanceTransformWithLabels
    extractSeeds extractSeedsWithStats growRegions growRegionsWithStats segmentRegions segmentRegionsWithStats
    RegionBoundary RegionBoundaries regionBoundaries regionAdjacency regionCorners cleanDepth
    drawEdges drawChains drawSegments drawArcs drawRegions drawBoundaries colorizeDistance drawOverview drawPanels
    drawExplanation
    DIR_ROWS DIR_COLS DIR_DIAG45 DIR_DIAG135 DIR_ALL FIT_LSQ FIT_INTERP MEASURE_MIDPOINT MEASURE_ENDPOINT
    CREASE_MAX CREASE_NORMAL EDGE_JUMP EDGE_CONVEX EDGE_CONCAVE EDGE_OCCLUDING EDGE_OCCLUDED EDGE_BOUNDARY
    CLEAN_SMOOTHED CLEAN_REMOVED CLEAN_FILLED
    THIN_SKELETON THIN_LEE THIN_ITERATIVE THIN_MEDIAL SALIENCE_MULTIPLICATIVE SALIENCE_ADDITIVE
""".split()  # noqa: SIM905
IMPORT_SHARE = 1.0  # of what NumPy and OpenCV take together
PACKAGE = Path(rangeedge.__file__).parent


def isolated(code, *options, **environment):
    """What `code` prints in a new interpreter that sees the package under test."""
    command = [sys.executable, *options, "-c", f"import sys; sys.path.insert(0, {str(PACKAGE.parent)!r}); {code}"]
    run = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **environment})
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


def modules():
    """Every module of the package but the one that runs when it is executed."""
    names = [m.name for m in pkgutil.walk_packages([str(PACKAGE)], "rangeedge.")]
    return [rangeedge, *(importlib.import_module(name) for name in names if not name.endswith(("._core", ".__main__")))]


def examples():
    finder = doctest.DocTestFinder(exclude_empty=True)
    for module in modules():
        for example in finder.find(module):
            if example.examples:
                yield pytest.param(example, id=example.name.removeprefix("rangeedge."))


def test_exports_are_the_public_names():
    assert sorted(rangeedge.__all__) == sorted(PUBLIC)
    for name in PUBLIC:
        assert getattr(rangeedge, name) is not None


def test_star_import_brings_the_public_names_only():
    assert json.loads(
        isolated("before = set(dir()); from rangeedge import *; import json; print(json.dumps(sorted(dir())))")
    ) == sorted([*PUBLIC, "before", "json", "sys", *module_attributes()])


def module_attributes():
    return json.loads(isolated("import json; print(json.dumps([n for n in dir() if n.startswith('__')]))"))


def test_version_is_that_of_the_distribution():
    assert re.fullmatch(r"\d+\.\d+\.\d+", rangeedge.__version__)
    try:
        distribution = importlib.metadata.version("rangeedge")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("rangeedge is not installed but built in place")
    assert distribution == rangeedge.__version__


def test_bits_of_a_family_are_distinct():
    for family, count in (("DIR_", 4), ("EDGE_", 6)):
        bits = [getattr(rangeedge, n) for n in PUBLIC if n.startswith(family) and n != "DIR_ALL"]
        assert sorted(bits) == [1 << k for k in range(count)]
    assert rangeedge.DIR_ALL == 15


def test_error_is_caught_as_opencv_s_and_as_value_error():
    for kind in (cv2.error, ValueError, rangeedge.error):
        with pytest.raises(kind, match=r"distanceTransform: `edges` must be"):
            rangeedge.distanceTransform(None)


@pytest.mark.parametrize("name", ["batch", "evaluation", "optimality", "synthetic"])
def test_submodules_are_there_without_importing_them(name):
    loaded, listed, found = json.loads(
        isolated(
            "import json, rangeedge as r;"
            f"print(json.dumps(['rangeedge.{name}' in sys.modules, {name!r} in dir(r), r.{name}.__name__]))"
        )
    )
    assert (loaded, listed, found) == (False, True, f"rangeedge.{name}")


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="module 'rangeedge' has no attribute 'evaluate'"):
        _ = rangeedge.evaluate


@pytest.mark.parametrize("name", ["edgeStrength", "edgePoints", "detectEdges", "detectEdgesWithStrength"])
def test_signatures_show_every_parameter_and_its_default(name):
    shown = inspect.signature(getattr(rangeedge, name)).parameters
    for field, default in vars(rangeedge.ScanLineParams()).items():
        assert shown[field].default == default
        if field != "eps":
            assert shown[field].kind is inspect.Parameter.KEYWORD_ONLY
    assert not any(p.kind is inspect.Parameter.VAR_KEYWORD for p in shown.values())


@pytest.mark.parametrize("name", [n for n in PUBLIC if inspect.isroutine(getattr(rangeedge, n))])
def test_functions_are_documented_with_their_call_form(name):
    function = getattr(rangeedge, name)
    lines = inspect.getdoc(function).splitlines()
    assert lines[0].endswith(".")
    assert any(re.match(rf"{name}\(", line) for line in lines[2:3])
    assert all(p.annotation is not p.empty for p in list(inspect.signature(function).parameters.values())[:1])


def test_import_warns_of_nothing():
    isolated("import rangeedge", "-W", "error")
    isolated("import rangeedge.optimality, rangeedge.batch", "-W", "error")


def test_dir_lists_the_public_names_and_nothing_else():
    listed = [name for name in dir(rangeedge) if not name.startswith("__")]
    assert sorted(listed) == sorted([*PUBLIC, "batch", "evaluation", "optimality", "synthetic"])
    assert "batch" not in rangeedge.__all__


def test_import_is_quick_and_leaves_scikit_image_for_later(tmp_path):
    measure = (
        "import json, time; t = [time.process_time()]; import numpy, cv2; t.append(time.process_time());"
        "import rangeedge; t.append(time.process_time()); share = (t[2] - t[1]) / (t[1] - t[0]);"
        "print(json.dumps([share, [m for m in ('skimage', 'scipy', 'matplotlib') if m in sys.modules]]))"
    )
    compiled = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(tmp_path)}  # by the first run
    runs = [json.loads(isolated(measure, **compiled)) for _ in range(4)]
    assert all(heavy == [] for _, heavy in runs)
    assert min(share for share, _ in runs) < IMPORT_SHARE


def test_the_package_carries_its_types():
    assert (PACKAGE / "py.typed").exists()


@pytest.fixture
def stub():
    """The types of the compiled module."""
    path = PACKAGE / "_core.pyi"
    if (PACKAGE / "core").exists() and not path.exists():
        pytest.skip("the module was built in place and its stub left in the build folder")
    return path.read_text()


def test_stub_names_what_the_compiled_module_has(stub):
    nodes = ast.parse(stub).body
    defined = {node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    defined |= {node.target.id for node in nodes if isinstance(node, ast.AnnAssign)}
    assert defined == {name for name in dir(_core) if not name.startswith("_")}


def test_stub_is_generated_from_the_compiled_module(stub):
    stubgen = pytest.importorskip("nanobind.stubgen")
    generator = stubgen.StubGen(_core)
    generator.put(_core)
    assert generator.get() == stub


@pytest.mark.skipif(np.lib.NumpyVersion(np.__version__) < "2.0.0", reason="examples print scalars as NumPy 2 does")
@pytest.mark.parametrize("example", list(examples()))
def test_examples_of_the_documentation(example):
    example.globs = {}
    report = []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    runner.run(example, out=report.append)
    assert runner.failures == 0, "".join(report)
