"""Files, names, folders and streams that nobody means: one line says what is wrong, and nothing crashes."""

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import createScanLineDetector
from rangeedge.app.cli import main
from rangeedge.batch import framesOf, runBatch

ROOT = Path(rangeedge.__file__).parents[1]
CAMERA = ["-K", "60,60,40,30"]
OPTIONS = {"K": (60, 60, 40, 30)}


@pytest.fixture
def image(tmp_path):
    depth = np.full((60, 80), 1500, np.uint16)
    depth[20:40, 20:60] = 1200
    path = tmp_path / "depth.png"
    cv2.imwrite(str(path), depth)
    return path


def command(*arguments, first=":", redirection="", **more):
    """What the command writes, as a process of its own: exit code, standard output and errors."""
    line = f'{first}; exec "$0" -m rangeedge "$@" {redirection}'
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OPENCV_FOR_THREADS_NUM": "1"} | more
    run = subprocess.run(
        ["sh", "-c", line, sys.executable, *map(os.fspath, arguments)],
        capture_output=True,
        cwd=ROOT,
        env=environment,
        timeout=120,
    )
    return run.returncode, run.stdout, run.stderr


def code_of(*arguments):
    """The exit code of the command."""
    try:
        return main(list(map(os.fspath, arguments)))
    except SystemExit as end:
        return end.code


# Files of parameters


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".json", '{"ScanLineDetector":' * 100000 + "1" + "}" * 100000),
        (".json", '{"ScanLineDetector": {"maxGap": ' + "[" * 100000 + "]" * 100000 + "}}"),
        (".yml", "%YAML:1.0\n---\nScanLineDetector: " + "[" * 100000 + "]" * 100000),
        (".yml", "%YAML:1.0\n---\nScanLineDetector:\n   " + "- " * 100000 + "1\n"),
        (".xml", "<opencv_storage>" + "<ScanLineDetector>" * 100000 + "</ScanLineDetector>" * 100000),
    ],
    ids=["json maps", "json lists", "yaml brackets", "yaml dashes", "xml"],
)
def test_parameters_nested_without_end(tmp_path, suffix, text):
    path = tmp_path / f"deep{suffix}"
    path.write_text(text)
    with pytest.raises(rangeedge.error, match=r"ScanLineDetector\.load: .*deep"):
        createScanLineDetector().load(path)


@pytest.mark.parametrize("key", ["rows", "cols", "data", "dt"])
@pytest.mark.parametrize("suffix", ["yml", "json", "xml"])
def test_matrices_that_lack_a_part(tmp_path, suffix, key):
    detector, path = createScanLineDetector(), tmp_path / f"detector.{suffix}"
    detector.setK((525, 525, 320, 240))
    detector.save(path)
    path.write_text(path.read_text().replace(key, f"x{key}"))
    with pytest.raises(rangeedge.error, match="`K`"):
        detector.load(path)
    if suffix == "json" and key != "dt":
        fs = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        with pytest.raises(rangeedge.error, match="`K` is a damaged matrix"):
            detector.read(fs.getNode("ScanLineDetector"))


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".json", '{"ScanLineDetector": {"maxGap": 3, "maxGap": 4}}'),
        (".yml", "ScanLineDetector:\n  maxGap: 3\n  maxGap: 4\n"),
        (".yml", "ScanLineDetector: {maxGap: 3, maxGap: 4}\n"),
        (".xml", "<a><ScanLineDetector><maxGap>3</maxGap><maxGap>4</maxGap></ScanLineDetector></a>"),
    ],
)
def test_a_parameter_given_twice(tmp_path, suffix, text):
    path = tmp_path / f"twice{suffix}"
    path.write_text(text)
    with pytest.raises(rangeedge.error, match="maxGap"):
        createScanLineDetector().load(path)


def test_parameters_of_other_systems(tmp_path):
    """With a mark of the byte order, and lines as Windows ends them."""
    path = tmp_path / "detector.yml"
    path.write_bytes(b"\xef\xbb\xbf%YAML:1.0\r\n---\r\nScanLineDetector:\r\n   maxGap: 4\r\n")
    detector = createScanLineDetector()
    detector.load(path)
    assert detector.getMaxGap() == 4


@pytest.mark.parametrize("what", ["--params", "--mask", "-K"])
def test_named_pipes_are_not_waited_for(image, tmp_path, what, capsys):
    os.mkfifo(tmp_path / "pipe.yml")
    assert code_of("detect", image, what, tmp_path / "pipe.yml", "--out", tmp_path / "out") == 2
    assert "it is a named pipe, not a file" in capsys.readouterr().err


def test_lines_in_a_named_pipe(tmp_path):
    os.mkfifo(tmp_path / "lines.csv")
    with pytest.raises(rangeedge.error, match="it is a named pipe"):
        rangeedge.readLines(tmp_path / "lines.csv")


def test_lines_nested_without_end(tmp_path):
    path = tmp_path / "deep.geojson"
    path.write_text("[" * 100000)
    with pytest.raises(rangeedge.error, match="it holds no lines"):
        rangeedge.readLines(path)


# Words of the command line


@pytest.mark.parametrize("size", ["inf,inf", "nan,5", "1e400,1", "5", "0,0", "-1,5", "2.5,3", ""])
def test_sizes_that_are_none(image, tmp_path, size, capsys):
    assert code_of("detect", image, *CAMERA, f"--image-size={size}", "--out", tmp_path / "out") == 2
    assert "must be" in capsys.readouterr().err


# Folders and names


@pytest.mark.parametrize(
    "arguments",
    [
        ("detect", "--out"),
        ("segment", "--out"),
        ("lines", "--out"),
        ("batch", "--out"),
        ("explain", "--at=5,5", "--out"),
    ],
    ids=lambda arguments: arguments[0],
)
@pytest.mark.parametrize("out", ["a" * 300, "depth.png/out"])
def test_outputs_that_cannot_be_made(image, arguments, out, monkeypatch, capsys):
    monkeypatch.chdir(image.parent)
    assert main([arguments[0], "depth.png", *CAMERA, *arguments[1:], out]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "cannot write" in told
    assert os.listdir() == ["depth.png"]


@pytest.mark.parametrize("name", ["detect", "segment", "lines", "batch"])
def test_the_current_folder_is_gone(image, name):
    gone = f"mkdir '{image.parent}/gone' && cd '{image.parent}/gone' && rmdir ../gone"
    code, _, told = command(name, image, *CAMERA, "--out", "out", first=gone)
    assert code == 2
    assert told.startswith(b"rangeedge: error:")
    assert b"cannot write to 'out" in told


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo], ids=["folder", "pipe"])
def test_a_manifest_that_is_none(image, tmp_path, make):
    out = tmp_path / "out"
    out.mkdir()
    make(out / "manifest.jsonl")
    with pytest.raises(rangeedge.error, match=r"cannot read .*manifest\.jsonl"):
        list(runBatch(image, out, **OPTIONS))


@pytest.mark.parametrize(
    "line",
    [
        '{"frame": "other", "seconds": NaN}',
        '{"frame": "other", "seconds": 1e999}',
        '{"frame": "other", "x": ' + "[" * 100000,
        '{"frame": {}}',
        "[]",
        "3",
        '{"frame": "other", "x": ' + "1" * 10000 + "}",
    ],
    ids=lambda line: line[:24],
)
def test_lines_of_a_manifest_that_others_wrote(image, tmp_path, line):
    out = tmp_path / "out"
    assert [item.state for item in runBatch(image, out, **OPTIONS)] == ["written"]
    manifest = out / "manifest.jsonl"
    manifest.write_text(f"{line}\n{manifest.read_text()}{line}\n")
    assert [item.state for item in runBatch(image, out, **OPTIONS)] == ["skipped"]
    assert [json.loads(line)["frame"] for line in manifest.read_text().splitlines()] == ["depth"]


@pytest.mark.parametrize("change", [{"outputs": {}}, {"seconds": float("inf")}, {"counts": None}])
def test_a_line_that_was_edited_is_done_again(image, tmp_path, change):
    out = tmp_path / "out"
    list(runBatch(image, out, **OPTIONS))
    manifest = out / "manifest.jsonl"
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | change) + "\n")
    assert [item.state for item in runBatch(image, out, **OPTIONS)] == ["written"]


# Streams


@pytest.mark.parametrize("redirection", [">&-", "2>&-", ">&- 2>&-", "<&-"])
@pytest.mark.parametrize("name", ["detect", "batch"])
def test_closed_streams(image, tmp_path, name, redirection):
    out = tmp_path / "out"
    code, _, told = command(name, image, *CAMERA, "--out", out, redirection=redirection)
    assert (code, told) == (0, b"")
    assert list(out.rglob("report.json"))


@pytest.mark.parametrize("name", ["detect", "segment", "lines", "batch", "explain"])
@pytest.mark.parametrize("encoding", ["utf-8", "ascii", "latin-1"])
def test_names_that_the_output_cannot_take(image, name, encoding):
    odd = os.fsencode(image.parent) + b"/caf\xe9 \xe2\x82\xac.png"
    os.rename(image, odd)
    more = ["--at", "5,5"] if name == "explain" else []
    out = image.parent / ("out.png" if name == "explain" else "out")
    code, said, told = command(name, os.fsdecode(odd), *CAMERA, *more, "--out", out, PYTHONIOENCODING=encoding)
    assert (code, told) == (0, b"")
    assert said


def test_the_program_keeps_its_own_streams(image, tmp_path, monkeypatch):
    """A stream that is no file of Python's is written to as it is."""

    class Own:
        errors = "strict"

        def __init__(self):
            self.text = ""

        def write(self, text):
            self.text += text

        def flush(self):
            pass

    own = Own()
    monkeypatch.setattr(sys, "stdout", own)
    assert main(["detect", str(image), *CAMERA, "--out", str(tmp_path / "out")]) == 0
    assert "edge pixels" in own.text


# Arrays of others


class OfAnotherDevice:
    def __dlpack__(self, **_):
        raise AttributeError("no memory of the CPU")


@pytest.mark.parametrize("src", [cv2.UMat(), OfAnotherDevice()], ids=["UMat", "DLPack"])
def test_images_without_memory(src):
    with pytest.raises(rangeedge.error, match="`src` must be"):
        rangeedge.detectEdges(src)


class NoPath(os.PathLike):
    def __fspath__(self):
        return 5


@pytest.mark.parametrize(
    "call",
    [
        lambda: rangeedge.detectEdges(np.ones((8, 8)), K=NoPath()),
        lambda: createScanLineDetector().save(NoPath()),
        lambda: createScanLineDetector().load(NoPath()),
        lambda: framesOf([NoPath()]),
    ],
)
def test_paths_that_are_none(call):
    with pytest.raises(rangeedge.error, match="must be a file name"):
        call()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"task": []}, "`task` must be 'detect'"),
        ({"topics": 5}, "`topics` must be an iterable"),
        ({"topics": "camera"}, "`topics` must be an iterable"),
        ({"topics": [5]}, "`topics` must be an iterable"),
        ({"out": ""}, "`out` must be the name of a folder"),
        ({"inputs": ""}, "`inputs` must be names of files"),
    ],
)
def test_arguments_of_a_run_that_are_none(image, tmp_path, arguments, message):
    with pytest.raises(rangeedge.error, match=message):
        runBatch(**{"inputs": image, "out": tmp_path / "out", **OPTIONS, **arguments})
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["detect", "segment", "lines", "clean", "batch", "explain"])
def test_no_output_is_not_the_current_folder(image, name, monkeypatch, capsys):
    """As of a variable of the shell that has no value."""
    monkeypatch.chdir(image.parent)
    more = ["--at=5,5"] if name == "explain" else []
    assert code_of(name, image, *CAMERA, *more, "--out", "") == 2
    assert "argument --out: must be a name" in capsys.readouterr().err
    assert os.listdir() == ["depth.png"]


@pytest.mark.parametrize("flag", ["--params", "--task", "--topic", "--noise"])
def test_values_of_two_dashes(image, tmp_path, flag, capsys):
    assert code_of("batch", image, f"{flag}=--", "--out", tmp_path / "out") == 2
    assert f"argument {flag}: expected one argument" in capsys.readouterr().err


def test_an_image_by_the_name_of_the_manifest(image, tmp_path):
    os.rename(image, tmp_path / "manifest.jsonl.png")
    out = tmp_path / "out"
    assert [item.state for item in runBatch(tmp_path / "manifest.jsonl.png", out, **OPTIONS)] == ["written"]
    assert sorted(path.name for path in out.iterdir() if path.is_dir()) == ["manifest.jsonl.png"]


def test_a_name_with_a_nul_among_others(image, tmp_path):
    states = [item.state for item in runBatch([f"{image}\0", image], tmp_path / "out", **OPTIONS)]
    assert states == ["failed", "written"]


@pytest.mark.parametrize("suffix", ["png", "npy", "npz"])
def test_a_file_that_was_replaced_by_an_older_one(tmp_path, suffix):
    """Another file of the same time, as copies that keep it have, or archives."""
    path, out = tmp_path / f"walk.{suffix}", tmp_path / "out"
    options = {**OPTIONS, "noise": 0.001}

    def store(depth, count):
        if suffix == "png":
            cv2.imwrite(str(path), np.pad(np.full((60, 80), depth, np.uint16), count))
        else:
            (np.save if suffix == "npy" else np.savez)(path, np.full((count, 60, 80), depth, np.uint16))
        os.utime(path, (1e9, 1e9))
        return framesOf(path)[0].read().src.max()

    assert store(1500, 1) == 1500
    list(runBatch(path, out, **options))
    assert store(1600, 2) == 1600
    assert {item.state for item in runBatch(path, out, **options)} == {"written"}


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("kind", [np.matrix, np.recarray, np.memmap])
def test_arrays_of_other_classes(kind):
    """A row of np.matrix has two axes, and its product is that of matrices."""
    depth = np.where(np.arange(60) < 30, 1.0, 2.0) + np.random.default_rng(0).normal(0, 0.001, (40, 60))
    noise = np.full((40, 60), 0.001)
    of_class = depth.view(kind)
    for function in (rangeedge.edgeStrength, rangeedge.cleanDepth, rangeedge.segmentRegionsWithStats):
        for one, other in zip(function(of_class, noise=noise.view(kind)), function(depth, noise=noise), strict=True):
            np.testing.assert_array_equal(one, other)
            assert type(one) is type(other)
    flying = rangeedge.flyingPixels(of_class)
    np.testing.assert_array_equal(flying, rangeedge.flyingPixels(depth))


@pytest.mark.parametrize(
    "call",
    [
        lambda z: rangeedge.detectEdges(z, K=np.array([60, 60, 30, 20j])),
        lambda z: rangeedge.detectEdges(z, K=(60, 60, 30, 20), distCoeffs=[0.1j, 0, 0, 0]),
        lambda z: rangeedge.sweepToPoints(z, elevation=np.full(40, 1j), azimuth=np.arange(60)),
        lambda z: rangeedge.synthetic.cylinder((0, 0, 1j), (0, 0, 1), 1, 1),
        lambda z: rangeedge.writeLines("x.geojson", rangeedge.linkEdges(z), transform=[1j] * 6),
    ],
)
def test_complex_numbers_are_no_lengths(call):
    with pytest.raises(rangeedge.error, match=r"`.*` must be"):
        call(np.ones((40, 60)))


@pytest.mark.parametrize("name", ["K", "distCoeffs"])
def test_complex_numbers_in_a_file(tmp_path, name):
    np.savez(tmp_path / "a.npz", src=np.ones((4, 5)), **{"K": np.array([60, 60, 2, 2]), name: np.full(4, 1j)})
    with pytest.raises(rangeedge.error, match="complex"):
        rangeedge.imreadRange(tmp_path / "a.npz")


@pytest.mark.parametrize("heightMap", [False, True])
@pytest.mark.parametrize("dtype", [np.int64, np.uint64])
def test_integers_that_double_precision_would_round(dtype, heightMap):
    """Steps of 1 are lost beyond 2^53: no edges would be found, in silence."""
    options = {"depthFactor": 1.0, "noise": 0.1, "heightMap": heightMap}
    step = np.where(np.arange(60) < 30, 1000, 1004) * np.ones((40, 1), dtype)
    expected = rangeedge.detectEdges(step, **options)
    assert expected.any()
    for offset in (0, 2**50, -(2**50) if heightMap and dtype == np.int64 else 0):
        moved = (step.astype(object) + offset).astype(dtype)
        np.testing.assert_array_equal(rangeedge.detectEdges(moved, **options), expected)
    for offset in (2**53 - 1000, 2**62, -(2**53) - 1004 if heightMap and dtype == np.int64 else 2**62):
        moved = (step.astype(object) + offset).astype(dtype)
        with pytest.raises(rangeedge.error, match=r"integers beyond 2\^53.*subtract"):
            rangeedge.detectEdges(moved, **options)
    marked = step.copy()
    marked[:3] = np.iinfo(dtype).max
    without = rangeedge.detectEdges(step, mask=marked < 2000, **options)
    for invalid in (float(np.iinfo(dtype).max), [(5000, np.inf)]):
        np.testing.assert_array_equal(rangeedge.detectEdges(marked, invalid=invalid, **options), without)


def test_other_interpreters_of_a_process_are_refused():
    """Where the first interpreter has not imported it either; the process ends as it should."""
    program = """
import warnings
try:
    import _interpreters as interpreters
except ImportError:
    import _xxsubinterpreters as interpreters
warnings.simplefilter("ignore")
other = interpreters.create()
told = None
try:
    told = interpreters.run_string(other, "import warnings; warnings.simplefilter('ignore'); import rangeedge._core")
except Exception as refused:
    told = refused
print(told)
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, timeout=120)
    assert (run.returncode, run.stderr) == (0, "")
    assert "interpreter" in run.stdout


@pytest.mark.parametrize("correlation", [1, 1 + 1e-12, 2, 1e6])
@pytest.mark.parametrize("length", [0, 5e-324, 1e-200, 1e-3, 1e160, 1e308])
def test_waves_of_any_length(correlation, length):
    """Shorter than any pixel they are white noise, without end one error of all pixels."""
    model = rangeedge.NoiseModel(0.001, correlation=correlation, length=length)
    factors = model.of_fits()
    assert np.isfinite(factors).all()
    depth = np.where(np.arange(60) < 30, 1.0, 2.0) + np.random.default_rng(0).normal(0, 0.001, (40, 60))
    why = rangeedge.explainPixel(depth, 29, 20, K=(60, 60, 30, 20), noise=model)
    assert why.edge or correlation == 1e6
    if 0 < length < 1:
        short = rangeedge.NoiseModel(0.001, correlation=correlation, length=0.1).of_fits()
        np.testing.assert_allclose(factors, short, rtol=1e-6)


@pytest.mark.parametrize("correlation", [1e6 + 1, 1e200, np.inf, np.nan, 0.5])
def test_waves_beyond_all_bounds(correlation):
    with pytest.raises(rangeedge.error, match="`correlation` must be a finite number >= 1 and <= 1e\\+06"):
        rangeedge.NoiseModel(0.001, correlation=correlation)


@pytest.mark.parametrize("radius", [1e-300, 1e160, 1e300])
def test_solids_beyond_double_precision(radius):
    with contextlib.suppress(rangeedge.error):
        rangeedge.synthetic.renderScene(rangeedge.synthetic.twoCylinders(radius), rangeedge.synthetic.kinectCamera())
