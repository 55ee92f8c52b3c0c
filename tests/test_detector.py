"""The detector in one call, and the detector as an object: the same edges, parameters that survive a file."""

import inspect
import os

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import (
    DIR_COLS,
    DIR_ROWS,
    EDGE_JUMP,
    EDGE_OCCLUDED,
    EDGE_OCCLUDING,
    EdgeStrength,
    NoiseModel,
    ScanLineParams,
    createScanLineDetector,
    detectEdges,
    detectEdgesWithStrength,
    edgePoints,
    edgeStrength,
    selectEdges,
    thinEdges,
)
from rangeedge.detector import ScanLineDetector
from rangeedge.options import DETECTION, SCAN_LINES

K = np.array([[200, 0, 47.5], [0, 210, 35.5], [0, 0, 1]])
FORMATS = ["xml", "yml", "yaml", "json"]
DEFAULTS = {name: option.default for name, option in DETECTION.items()}
FIELDS = list(DETECTION)
FLAGS = ("fit", "measure", "crease")  # of the values 0 and 1


def another(name, default):
    """A value of the field that is not its default, and long in decimals where it can be."""
    special = {"eps": 0.1 + 0.2, "K": K, "pixelSize": (0.1, 0.3), "directions": DIR_ROWS | DIR_COLS}
    special |= {
        "jumpThreshold": 0.1 + 0.7,
        "noise": NoiseModel(1e-3, -1e-4, 1.425e-3, correlation=1.7),
        "minSignificance": 1e-300,
        "lineSignificance": 20 / 3,
        "distCoeffs": np.array([0.1, -0.2 / 3, 1e-3, 0, 0.01]),
        "invalid": ((-9999.0, -9999.0), (8.1, np.inf)),
        "origin": (0.1, -2.0, 1 / 3),
        "imageSize": (64, 48),
    }
    if name in special:
        return special[name]
    if isinstance(default, bool):
        return not default
    if isinstance(default, int):
        return 1 - default if name in FLAGS else default + 1
    return default / 3


OTHER = {name: another(name, default) for name, default in DEFAULTS.items()}


def accessor(kind, name):
    return f"{kind}{name[0].upper()}{name[1:]}"


def set_all(detector, values):
    for name, value in values.items():
        getattr(detector, accessor("set", name))(value)


def get_all(detector):
    return {name: getattr(detector, accessor("get", name))() for name in FIELDS}


def same(first, second):
    for name in FIELDS:
        if isinstance(first[name], np.ndarray):
            assert first[name].dtype == second[name].dtype, name
            np.testing.assert_array_equal(first[name], second[name], name)
        else:
            assert first[name] == second[name], name
            assert type(first[name]) is type(second[name]), name


@pytest.fixture(scope="module")
def scene():
    """Depths of a pinhole camera, in metres: a box before a wall, which meets a floor at 90 degrees."""
    v = np.arange(72)[:, None] - K[1, 2]
    floor = 0.25 * K[1, 1] / np.maximum(v, 1e-9)
    depth = np.minimum(np.full((72, 96), 2.0), floor)
    depth[16:40, 30:66] = 1.5
    return depth


@pytest.fixture
def detector():
    return createScanLineDetector(ScanLineParams(K=K, noise=0.001))


# detectEdges


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 1), (1, 40), (40, 1), (2, 2), (3, 3)])
@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.float64])
def test_tiny_images_have_no_edges(dtype, shape):
    for camera in (dict(K=np.eye(3)), {}):
        edges = detectEdges(np.full(shape, 2).astype(dtype), noise=0.01, **camera)
        assert edges.shape == shape
        assert not edges.any()


@pytest.mark.parametrize("function", [detectEdges, edgeStrength])
def test_images_too_large_to_count_are_refused(function):
    for shape in ((23170, 23170), (46340, 46340), (180_000_000, 1)):
        huge = np.broadcast_to(np.float32(1), shape)
        with pytest.raises(rangeedge.error, match=r"`src` must be .* of fewer than 2\^29 pixels"):
            function(huge)


@pytest.mark.parametrize(
    "options",
    [{}, {"jumpThreshold": 0.2}, {"creaseThreshold": 91.0}, {"hysteresis": 0.5}, {"minLength": 30}, {"dynamic": True}],
)
def test_one_way_from_strengths_to_edges(scene, options):
    noisy = scene + np.random.default_rng(0).normal(0, 0.001, scene.shape)
    expected = detectEdges(noisy, K=K, **options)
    strength = edgeStrength(noisy, K=K)
    np.testing.assert_array_equal(thinEdges(selectEdges(strength, **options)), expected)
    edges, found = detectEdgesWithStrength(noisy, K=K, **options)
    np.testing.assert_array_equal(edges, expected)
    assert isinstance(found, EdgeStrength)
    for one, other in zip(found, strength, strict=True):
        np.testing.assert_array_equal(one, other)


def test_edges_with_strength_run_the_scan_lines_once(scene, monkeypatch):
    calls = []
    kernel = rangeedge.detection.measure_strength
    monkeypatch.setattr("rangeedge.detection.measure_strength", lambda *args: calls.append(args) or kernel(*args))
    detectEdgesWithStrength(scene, K=K)
    assert len(calls) == 1


def test_detect_edges_is_strength_selection_thinning(scene):
    strength = edgeStrength(scene, K=K, noise=0.001)
    jump = np.where(strength.kind & EDGE_OCCLUDING, strength.jump, np.float32(0))
    for options in ({}, {"hysteresis": 0.5}, {"minLength": 30}, {"dynamic": True}):
        selection = {"minLength": inspect.signature(detectEdges).parameters["minLength"].default, **options}
        expected = thinEdges(selectEdges(jump, strength.crease, 0.2, 40, **selection))
        found = detectEdges(scene, 0.2, 40, K=K, noise=0.001, **options)
        assert found.dtype == np.uint8
        assert set(np.unique(found)) <= {0, 255}
        np.testing.assert_array_equal(found, expected)


def test_stray_crease_pixels_do_not_count_nor_jumps_on_the_farther_side():
    crease, jump = np.zeros((2, 9, 9), np.float32)
    kind = np.zeros((9, 9), np.uint8)
    crease[4:6, 1:8] = 40
    crease[1, 3:5] = 40
    jump[8] = jump[7] = 1
    kind[7], kind[8] = EDGE_OCCLUDING | EDGE_JUMP, EDGE_OCCLUDED | EDGE_JUMP
    edges = selectEdges(EdgeStrength(jump, crease, kind, np.full((9, 9), 30.0, np.float32)), minLength=1)
    expected = np.zeros((9, 9), np.uint8)
    expected[4:6, 1:8] = expected[7] = 255
    np.testing.assert_array_equal(edges, expected)


@pytest.mark.parametrize("creaseThreshold", [0, 1e-300])
def test_stray_creases_do_not_count_at_no_threshold_either(creaseThreshold):
    nothing, crease = np.zeros((2, 9, 9), np.float32)
    crease[4:6, 1:8] = 1
    crease[1, 3:5] = 1
    strength = EdgeStrength(nothing, crease, nothing.astype(np.uint8), nothing)
    edges = selectEdges(strength, creaseThreshold=creaseThreshold, minLength=1, lineSignificance=0)
    assert not edges[1].any()
    assert edges[4:6, 1:8].all()


def test_creases_of_a_single_line_stay():
    line = 0.1 * np.abs(np.arange(60.0) - 30)[None]
    for src in (line, line.T):
        edges = detectEdges(np.ascontiguousarray(src), 1.0, 5.0, noise=0.001, minLength=1)
        assert 29 <= np.flatnonzero(edges).mean() <= 31


def test_no_crease_reaches_more_than_a_float_holds(scene):
    assert not detectEdges(scene, np.inf, 1e300, K=K, noise=0.001).any()


def test_rim_of_the_nearer_surface_is_the_jump_edge(scene):
    edges = detectEdges(scene, creaseThreshold=np.inf, K=K, noise=0.001)
    rim = np.zeros(scene.shape, bool)
    rim[16:40, 30:66] = True
    rim[17:39, 31:65] = False
    assert (edges[rim] == 255).mean() > 0.95
    assert not edges[~rim].any()


def test_crease_edge_lies_where_wall_and_floor_meet(scene):
    edges = detectEdges(scene, np.inf, K=K, noise=0.001)
    rows, cols = np.nonzero(edges)
    meeting = K[1, 2] + 0.25 * K[1, 1] / 2.0
    assert len(np.unique(cols)) > 90
    assert np.abs(rows - meeting).max() <= 1


def test_thresholds_are_in_units(scene):
    def edges(jump, crease):
        return np.count_nonzero(detectEdges(scene, jump, crease, K=K, noise=0.001))

    assert edges(0.49, np.inf) == edges(None, np.inf) == edges(0, np.inf) > 0
    assert edges(0.51, np.inf) == 0
    assert edges(np.inf, 89) > 0
    assert edges(np.inf, 91) == 0


def test_edges_receives_the_result_in_place(scene):
    expected = detectEdges(scene, K=K, noise=0.001)
    dst = np.full(scene.shape, 7, np.uint8)
    assert detectEdges(scene, edges=dst, K=K, noise=0.001) is dst
    np.testing.assert_array_equal(dst, expected)
    strided = np.zeros((72, 192), np.uint8)[:, ::2]
    assert detectEdges(scene, edges=strided, K=K, noise=0.001) is strided
    np.testing.assert_array_equal(strided, expected)
    other = np.full((3, 3), 7, np.uint8)
    assert detectEdges(scene, edges=other, K=K, noise=0.001) is not other
    assert (other == 7).all()


def test_source_and_mask_are_left_alone_and_the_mask_counts(scene):
    src, mask = scene.copy(), np.ones(scene.shape, np.uint8)
    mask[:, 60:] = 0
    before = mask.copy()
    edges = detectEdges(src, mask=mask, K=K, noise=0.001)
    np.testing.assert_array_equal(src, scene)
    np.testing.assert_array_equal(mask, before)
    assert not edges[:, 60:].any()
    assert edges[:, :55].any()


def test_empty_view_has_no_edges():
    assert not detectEdges(np.full((20, 30), np.nan)).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"jumpThreshold": -1}, "`jumpThreshold` must be a finite number >= 0, got -1"),
        ({"jumpThreshold": False}, "`jumpThreshold` must be"),
        ({"jumpThreshold": "0.1"}, "`jumpThreshold` must be"),
        ({"jumpThreshold": []}, "`jumpThreshold` must be"),
        ({"jumpThreshold": np.nan}, "`jumpThreshold` must be"),
        ({"creaseThreshold": -1}, "`creaseThreshold` must be"),
        ({"creaseThreshold": None}, "`creaseThreshold` must be"),
        ({"hysteresis": 0}, "`hysteresis` must be"),
        ({"minLength": 0}, "`minLength` must be"),
        ({"dynamic": 1}, "`dynamic` must be True or False"),
        ({"eps": 0}, "`eps` must be"),
        ({"mask": np.ones((2, 2), np.uint8)}, "`mask` must be"),
        ({"edges": 3}, "`edges` must be"),
        ({"maxshift": 3}, "unknown argument `maxshift`; did you mean `maxShift`?"),
    ],
)
def test_errors_name_detect_edges(scene, options, message):
    with pytest.raises(rangeedge.error, match=r"^rangeedge: error: \(-\d+\) detectEdges: ") as caught:
        detectEdges(scene, **options)
    assert caught.value.func == "detectEdges"
    assert message in caught.value.err


@pytest.mark.parametrize("options", [{"creaseThreshold": -1}, {"minLength": 0}, {"dynamic": 1}])
def test_selection_is_checked_before_anything_is_computed(scene, detector, options, monkeypatch):
    monkeypatch.setattr("rangeedge.detector.measured_frame", lambda *_: pytest.fail("computed"))
    with pytest.raises(rangeedge.error, match=f"detectEdges: `{next(iter(options))}`"):
        detectEdges(scene, **options)
    with pytest.raises(rangeedge.error, match=f"detectEdges: `{next(iter(options))}`"):
        detector.detectEdges(scene, **options)


def test_a_read_only_destination_is_an_error(scene):
    dst = np.zeros(scene.shape, np.uint8)
    dst.setflags(write=False)
    with pytest.raises(rangeedge.error, match="detectEdges: `edges` must be writable"):
        detectEdges(scene, edges=dst, K=K)


# The object


def test_object_finds_what_the_functions_find(scene, detector):
    options = {"K": K, "noise": 0.001}
    mask = np.ones(scene.shape, bool)
    mask[:5] = False
    for ours, theirs in zip(detector.detect(scene, mask), edgeStrength(scene, mask=mask, **options), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(detector.detectPoints(scene, mask), edgePoints(scene, mask=mask, **options))
    selection = {"mask": mask, "hysteresis": 0.5, "minLength": 9, "dynamic": True}
    np.testing.assert_array_equal(
        detector.detectEdges(scene, 0.2, 40, **selection), detectEdges(scene, 0.2, 40, **options, **selection)
    )
    np.testing.assert_array_equal(detector.detectEdges(scene), detectEdges(scene, **options))
    edges, strength = detector.detectEdgesWithStrength(scene, 0.2, 40, **selection)
    np.testing.assert_array_equal(edges, detectEdges(scene, 0.2, 40, **options, **selection))
    np.testing.assert_array_equal(strength.significance, edgeStrength(scene, mask=mask, **options).significance)
    dst = np.zeros(scene.shape, np.uint8)
    assert detector.detectEdges(scene, edges=dst) is dst


def test_method_takes_the_options_of_the_function():
    function, method = (inspect.signature(f).parameters for f in (detectEdges, ScanLineDetector.detectEdges))
    for name, parameter in method.items():
        if name != "self":
            assert parameter.default in (function[name].default, ...)  # ... is the detector's own
            assert function[name].kind is parameter.kind
            assert function[name].annotation == parameter.annotation
    assert set(function) - set(method) == set(SCAN_LINES)


def test_parameters_act(scene, detector):
    before = detector.detect(scene)
    detector.setDirections(DIR_ROWS)
    rows = detector.detect(scene)
    assert 0 < np.count_nonzero(rows.jump) < np.count_nonzero(before.jump)
    detector.setDirections(15)
    np.testing.assert_array_equal(detector.detect(scene).crease, before.crease)


def test_every_field_is_set_and_got():
    assert set(OTHER) == set(FIELDS)
    detector = createScanLineDetector()
    same(get_all(detector), DEFAULTS)
    for name, value in OTHER.items():
        getattr(detector, accessor("set", name))(value)
        got = getattr(detector, accessor("get", name))()
        assert np.array_equal(got, value), name
        assert not np.array_equal(got, DEFAULTS[name]), name
    same(get_all(detector), OTHER)


def test_accessors_are_documented():
    for name in FIELDS:
        for kind in ("get", "set"):
            method = getattr(ScanLineDetector, accessor(kind, name))
            first, _, text = method.__doc__.partition("\n\n")
            assert first in (f"get{name[0].upper()}{name[1:]}() -> retval", f"{accessor('set', name)}({name}) -> None")
            assert len(text) > 20, name
            assert " ".join(text.split()) in " ".join(detectEdges.__doc__.split())
            assert inspect.signature(method).return_annotation is not inspect.Signature.empty


def test_a_refused_value_leaves_the_old_one(detector):
    before = get_all(detector)
    bad = {name: "nonsense" for name in FIELDS if name != "K"}
    bad |= {"K": np.eye(2), "eps": 0, "pixelSize": (1, -1), "noise": np.zeros(3), "depthFactor": 0, "heightMap": 1}
    for name, value in bad.items():
        method = accessor("set", name)
        with pytest.raises(rangeedge.error, match=rf"ScanLineDetector\.{method}: `{name}` must be"):
            getattr(detector, method)(value)
    same(get_all(detector), before)


def test_parameters_are_the_detector_s_own():
    matrix, sigmas = K.copy(), np.full((4, 5), 0.01)
    detector = createScanLineDetector(ScanLineParams(K=matrix, noise=sigmas))
    matrix[0, 0] = sigmas[0, 0] = -1
    assert detector.getK()[0, 0] == 200
    assert detector.getNoise()[0, 0] == np.float32(0.01)
    with pytest.raises(ValueError, match="read-only"):
        detector.getK()[0, 0] = 3


@pytest.mark.parametrize("params", [3, {}, ScanLineParams, "default"])
def test_only_parameters_make_a_detector(params):
    with pytest.raises(rangeedge.error, match="createScanLineDetector: `params` must be a ScanLineParams or None"):
        createScanLineDetector(params)


@pytest.mark.parametrize(
    "options", [{"K": np.ones((3, 3))}, {"noise": -1}, {"noise": np.ones((2, 2), bool)}, {"pixelSize": (1, 2, 3)}]
)
def test_parameters_that_wait_for_an_image_are_checked_at_once(options):
    name = next(iter(options))
    with pytest.raises(rangeedge.error, match=f"ScanLineParams: `{name}` must be"):
        ScanLineParams(**options)


@pytest.mark.parametrize(
    ("name", "way_out"),
    [("epsFactor", r"call setEpsFactor\(epsFactor\)"), ("threshold", "its parameters have setters")],
)
def test_a_misspelt_attribute_is_refused(detector, name, way_out):
    with pytest.raises(AttributeError, match=f"ScanLineDetector has no attribute '{name}' to set; {way_out}"):
        setattr(detector, name, 3)


def test_thresholds_are_the_detector_s_own_and_yield_for_a_frame(scene, detector):
    def thin(**options):
        return detectEdges(scene, K=K, noise=0.001, **options)

    detector.setJumpThreshold(np.inf)
    detector.setCreaseThreshold(40)
    detector.setMinLength(9)
    own = {"jumpThreshold": np.inf, "creaseThreshold": 40, "minLength": 9}
    np.testing.assert_array_equal(detector.detectEdges(scene), thin(**own))
    assert thin(**own).any()
    np.testing.assert_array_equal(detector.detectEdges(scene, None), thin(**{**own, "jumpThreshold": None}))
    np.testing.assert_array_equal(detector.detectEdges(scene, minLength=99), thin(**{**own, "minLength": 99}))
    np.testing.assert_array_equal(detector.detectEdges(scene), thin(**own))


def test_clear_empty_name_and_repr(detector):
    assert not detector.empty()
    assert detector.getDefaultName() == "ScanLineDetector"
    assert repr(detector) == "ScanLineDetector(K=float64 array of shape (3, 3), noise=0.001)"
    detector.clear()
    same(get_all(detector), DEFAULTS)
    assert repr(detector) == "ScanLineDetector()"


# Files


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize(
    "change",
    [
        {},
        {"noise": None, "K": None, "eps": None, "pixelSize": None},
        {"noise": 0.0025},
        {"noise": NoiseModel.kinect1()},
        {"noise": NoiseModel(2.0, fits=(2.0, 0, 0, 0, *np.linspace(0.5, 12, 42) ** 1.1))},
        {"noise": np.random.default_rng(3).uniform(0.1, 9, (7, 5)).astype(np.float32)},
        {"noise": np.float32([[np.nan, 0.1], [np.inf, 1e-30]])},
        {"pixelSize": 0.7, "K": None},
        {"epsFactor": 7, "depthFactor": 2**40},
        {"jumpThreshold": np.inf, "creaseThreshold": np.inf},
        {"jumpThreshold": None},
    ],
    ids=lambda change: "-".join(f"{k}_{type(v).__name__}" for k, v in change.items()) or "all",
)
def test_files_return_what_was_saved(tmp_path, suffix, change):
    detector, other = createScanLineDetector(), createScanLineDetector(ScanLineParams(K=np.eye(3), noise=4.0, eps=1.0))
    set_all(detector, {**OTHER, **change})
    path = tmp_path / f"detector.{suffix}"
    detector.save(path)
    assert os.listdir(tmp_path) == [path.name]
    other.load(path)
    same(get_all(other), get_all(detector))
    start = {"xml": b"<?xml", "json": b"{"}.get(suffix, b"%YAML")
    assert path.read_bytes().startswith(start)


def test_loaded_detector_detects_the_same(tmp_path, scene, detector):
    detector.setNoise(np.linspace(0.001, 0.002, scene.size).reshape(scene.shape))
    detector.save(str(tmp_path / "d.yml"))
    other = createScanLineDetector()
    other.load(str(tmp_path / "d.yml"))
    for first, second in zip(detector.detect(scene), other.detect(scene), strict=True):
        np.testing.assert_array_equal(first, second)


def test_write_and_read_share_a_file_with_others(tmp_path, detector):
    path = str(tmp_path / "pipeline.yml")
    fs = cv2.FileStorage(path, cv2.FILE_STORAGE_WRITE)
    fs.write("exposure", 1.5)
    detector.write(fs, "left")
    fs.startWriteStruct("right", cv2.FileNode_MAP)
    createScanLineDetector(ScanLineParams(eps=0.5)).write(fs)
    fs.endWriteStruct()
    fs.release()
    fs = cv2.FileStorage(path, cv2.FILE_STORAGE_READ)
    left, right = createScanLineDetector(), createScanLineDetector(ScanLineParams(maxGap=0))
    left.read(fs.getNode("left"))
    right.read(fs.getNode("right"))
    same(get_all(left), get_all(detector))
    assert (right.getEps(), right.getMaxGap()) == (0.5, ScanLineParams().maxGap)
    assert fs.getNode("exposure").real() == 1.5


def test_a_file_may_be_written_by_hand(tmp_path, detector):
    path = tmp_path / "hand.yml"
    path.write_text(
        "%YAML:1.0\n---\nScanLineDetector:\n   eps: 1\n   pixelSize: [ 2, 0.5 ]\n   noise: 3\n   maxGap: 2\n"
    )
    detector.load(path)
    same(get_all(detector), {**DEFAULTS, "eps": 1.0, "pixelSize": (2.0, 0.5), "noise": 3.0, "maxGap": 2})


def test_a_file_of_version_0_1_is_read(tmp_path, detector):
    """It has no thresholds."""
    path = tmp_path / "old.yml"
    path.write_text(
        "%YAML:1.0\n---\nsavedBy: rangeedge\nScanLineDetector:\n   eps: 0.25\n   epsFactor: 3.5\n   heightMap: 1\n"
        "   depthFactor: 1000.\n   noise:\n      a: 0.5\n      b: 0.\n      c: 0.\n      correlation: 1.\n"
        "   directions: 15\n   fit: 0\n   measure: 0\n   crease: 1\n   maxShift: 4.\n   maxGap: 2\n"
        "   mergeSignificance: 5.\n   minSignificance: 12.\ncomplete: 1\n"
    )
    detector.load(path)
    old = {"eps": 0.25, "noise": NoiseModel(a=0.5), "heightMap": True, "maxShift": 4.0, "maxGap": 2}
    old |= {"mergeSignificance": 5.0, "minSignificance": 12.0}
    same(get_all(detector), {**DEFAULTS, **old})
    path.write_text(path.read_text().removesuffix("complete: 1\n"))
    with pytest.raises(rangeedge.error, match="is not complete"):
        detector.load(path)


BAD_NODES = {
    "eps: -1": "`eps` must be",
    "eps: small": "`eps` must be",
    "maxShfit: 3": "unknown argument `maxShfit`; did you mean `maxShift`?",
    "maxGap: 2.5": "`maxGap` must be an integer",
    "heightMap: 2": "`heightMap` must be True or False",
    "noise: { a: 1, d: 2 }": "`noise` must be",
    "noise: { a: 1, fits: 3 }": "`fits` must be",
    "noise: { a: 1, fits: [ 1, 2 ] }": "`fits` must be",
    "noise: { a: 1, fits: [ x ] }": "`fits` must be",
    "noise: { a: 0 }": "one of `a`, `b`, `c` must differ from 0",
    "K: [ 1, 2 ]": "`K` must be",
    "pixelSize: [ 1, 2, 3 ]": "`pixelSize` must be",
    "directions: 16": "`directions` must be",
    "noise: { rows: 2, cols: 2, dt: f }": "`noise` is a damaged matrix",
    "noise: { rows: 2, cols: 2, dt: f, data: [ 1 ] }": "`noise` is a damaged matrix",
    "heightMap: { rows: 1, cols: 2, dt: f, data: [ 0, 1 ] }": "`heightMap` must be True or False",
    "eps: { rows: 1, cols: 2, dt: f, data: [ 0, 1 ] }": "`eps` must be",
    "noise: { a: { rows: 1, cols: 1, dt: f, data: [ 1 ] } }": "`a` must be",
}


@pytest.mark.parametrize("line", BAD_NODES)
def test_bad_values_in_a_file(tmp_path, detector, line):
    before, path = get_all(detector), tmp_path / "bad.yml"
    path.write_text(f"%YAML:1.0\n---\nScanLineDetector:\n   {line}\n")
    with pytest.raises(rangeedge.error) as caught:
        detector.load(path)
    assert caught.value.func == "ScanLineDetector.load"
    assert str(path) in caught.value.err
    assert BAD_NODES[line] in caught.value.err
    same(get_all(detector), before)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"hello",
        b"\xff\xfe\x00\x01",
        b"\x89PNG\r\n\x1a\n",
        b"\0" * 64,
        b'<?xml version="1.0"?>\n<opencv_storage>\n<ScanLineDetector>',
        b'<?xml version="1.0"?>\n<opencv_storage>\n<ScanLineDetector>3</ScanLineDetector>\n</opencv_storage>',
        b"%YAML:1.0\n---\nScanLineDetector: [ 1, 2 ]\n",
        b"%YAML:1.0\n---\nScanLineDetector:\n   eps: [",
        b"%YAML:1.0\n---\nAnotherDetector:\n   eps: 1\n",
        b"%YAML:1.0\n---\n",
        b'{ "ScanLineDetector": ',
        b"{}",
    ],
)
def test_files_that_hold_no_detector(tmp_path, detector, content):
    before, path = get_all(detector), tmp_path / "bad.yml"
    path.write_bytes(content)
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.load: .*bad\.yml"):
        detector.load(path)
    same(get_all(detector), before)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_truncated_file_is_an_error_or_whole(tmp_path, suffix):
    detector = createScanLineDetector()
    set_all(detector, OTHER)
    whole, cut = tmp_path / f"whole.{suffix}", tmp_path / f"cut.{suffix}"
    detector.save(whole)
    content = whole.read_bytes()
    for size in range(len(content)):
        cut.write_bytes(content[:size])
        other = createScanLineDetector()
        try:
            other.load(cut)
        except rangeedge.error:
            same(get_all(other), DEFAULTS)
        else:  # nothing is missing but the end of the last line
            assert size > len(content) - 20
            same(get_all(other), OTHER)


def test_missing_files_and_bad_names(tmp_path, detector):
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.load: cannot read .*none\.yml.*: No such file"):
        detector.load(tmp_path / "none.yml")
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.load: cannot read"):
        detector.load(tmp_path)
    for name in (None, 3, b"x.yml"):
        with pytest.raises(rangeedge.error, match="`filename` must be a file name"):
            detector.load(name)
        with pytest.raises(rangeedge.error, match="`filename` must be a file name"):
            detector.save(name)
    for name in ("detector", "detector.txt", "detector.npz", ".yml"):
        with pytest.raises(rangeedge.error, match=r"with one of the suffixes \.xml \.yml \.yaml \.json"):
            detector.save(tmp_path / name)
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.save: cannot write"):
        detector.save(tmp_path / "no" / "folder.xml")
    assert os.listdir(tmp_path) == []


def test_a_failed_save_leaves_the_old_file(tmp_path, detector, monkeypatch):
    path = tmp_path / "d.json"
    detector.save(path)
    before = path.read_bytes()
    detector.setEps(0.5)

    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(rangeedge.error, match="No space left on device"):
        detector.save(path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize("fs", [None, "file.yml", cv2.FileStorage()])
def test_write_wants_an_open_storage(detector, fs):
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.write: `fs` must be a cv2\.FileStorage opened"):
        detector.write(fs)


def test_write_refuses_a_storage_opened_for_reading(tmp_path, detector):
    detector.save(tmp_path / "d.yml")
    fs = cv2.FileStorage(str(tmp_path / "d.yml"), cv2.FILE_STORAGE_READ)
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.write: "):
        detector.write(fs, "again")


def test_read_wants_a_node_that_is_a_map(tmp_path, detector):
    (tmp_path / "n.yml").write_text("%YAML:1.0\n---\nnumber: 3\nlist: [ 1 ]\n")
    fs = cv2.FileStorage(str(tmp_path / "n.yml"), cv2.FILE_STORAGE_READ)
    for node in (None, "x", fs.getNode("number"), fs.getNode("list"), fs.getNode("nothing")):
        with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.read: `node` must be"):
            detector.read(node)
