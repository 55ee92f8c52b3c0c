"""Many images: folders, failures, and going on where it stopped."""

import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

from rangeedge import (
    NoiseModel,
    detectEdges,
    detectEdgesWithStrength,
    error,
    imwriteRange,
    linkEdges,
    segmentRegions,
)
from rangeedge.app.cli import main
from rangeedge.app.lines import LINE_FILES
from rangeedge.app.results import EDGE_FILES, encoded, plain
from rangeedge.batch import detectBatch, framesOf, runBatch

K = np.array([[50, 0, 19.5], [0, 50, 14.5], [0, 0, 1]])
LEDGER = {"manifest.jsonl", ".manifest.jsonl.lock"}  # beside the results


@pytest.fixture
def images(tmp_path):
    """Three images, the second of which is none."""
    paths = [tmp_path / f"frame{i}.png" for i in range(3)]
    for shift, path in enumerate(paths):
        depth = np.full((30, 40), 1500, np.uint16)
        depth[8:20, 10 + shift : 28] = 1000
        imwriteRange(path, depth)
    paths[1].write_bytes(b"garbled")
    return paths


def states(items):
    return [item.state for item in items]


@pytest.mark.parametrize("jobs", [1, 3])
def test_failures_do_not_stop_the_others(images, tmp_path, jobs):
    items = list(detectBatch(images, tmp_path / "out", jobs=jobs, K=K))
    assert states(items) == ["written", "failed", "written"]
    assert "none of PNG" in items[1].message
    assert items[0].message == ""
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"frame0", "frame2", *LEDGER}
    assert {path.name for path in (tmp_path / "out" / "frame2").iterdir()} == set(EDGE_FILES)


def test_goes_on_where_it_stopped(images, tmp_path):
    out = tmp_path / "out"
    assert states(detectBatch(images[:1], out, K=K)) == ["written"]
    before = (out / "frame0" / "report.json").stat().st_mtime_ns
    assert states(detectBatch(images, out, K=K)) == ["skipped", "failed", "written"]
    assert (out / "frame0" / "report.json").stat().st_mtime_ns == before


def test_does_again_what_is_out_of_date(images, tmp_path):
    out, first = tmp_path / "out", images[:1]
    assert states(detectBatch(first, out, K=K)) == ["written"]
    assert states(detectBatch(first, out, K=K, force=True)) == ["written"]
    assert states(detectBatch(first, out, K=K, minLength=9)) == ["written"]
    assert states(detectBatch(first, out, K=K, minLength=9)) == ["skipped"]
    mask = np.ones((30, 40), np.uint8)
    assert states(detectBatch(first, out, K=K, mask=mask)) == ["written"]
    assert states(detectBatch(first, out, K=K, mask=mask.copy())) == ["skipped"]
    mask[3, 4] = 0
    assert states(detectBatch(first, out, K=K, mask=mask)) == ["written"]
    report = out / "frame0" / "report.json"
    os.utime(images[0], ns=(0, report.stat().st_mtime_ns + 1))
    assert states(detectBatch(first, out, K=K, mask=mask)) == ["written"]
    os.utime(images[0], ns=(0, 0))
    report.write_text("{")
    assert states(detectBatch(first, out, K=K, mask=mask)) == ["written"]
    assert json.loads(report.read_text())["width"] == 40


def test_options_that_do_not_fit_an_image_fail_that_image(images, tmp_path):
    items = list(detectBatch(images, tmp_path / "out", K=K, mask=np.ones((5, 6), np.uint8)))
    assert states(items) == ["failed"] * 3
    assert "`mask`" in items[0].message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"jobs": 0}, "`jobs`"),
        ({"force": 1}, "`force`"),
        ({"jobs": True}, "`jobs`"),
        ({"eps": -1.0}, "`eps`"),
        ({"hysteresis": 2}, "`hysteresis`"),
        ({"maxshift": 3}, "unknown argument `maxshift`; did you mean `maxShift`"),
    ],
)
def test_bad_arguments_are_refused_before_any_image(images, tmp_path, options, message):
    with pytest.raises(error, match=f"detectBatch: {message}"):
        detectBatch(images, tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("kind", [str, bytes, Path])
def test_one_path_is_no_list_of_them(images, tmp_path, kind):
    one = os.fsencode(images[0]) if kind is bytes else kind(images[0])
    with pytest.raises(error, match="detectBatch: `paths` must be an iterable of file names"):
        detectBatch(one, tmp_path / "out")


def test_options_of_numpy_and_infinities(images, tmp_path):
    options = {"creaseThreshold": np.float32(30), "jumpThreshold": np.inf, "minLength": np.int64(4), "K": K}
    assert states(detectBatch(images[:1], tmp_path / "out", **options)) == ["written"]
    assert states(detectBatch(images[:1], tmp_path / "out", **options)) == ["skipped"]
    report = json.loads((tmp_path / "out" / "frame0" / "report.json").read_text(), parse_constant=pytest.fail)
    assert report["options"]["jumpThreshold"] == "inf"
    assert report["options"]["creaseThreshold"] == 30


def test_options_as_json():
    nested = {
        "K": ((np.float32(1.5), 2), [np.nan]),
        "flag": np.True_,
        "noise": NoiseModel(np.float64(0.5)),
        "eps": None,
    }
    assert plain(nested) == {
        "K": [[1.5, 2], ["nan"]],
        "flag": True,
        "noise": {"a": 0.5, "b": 0, "c": 0, "correlation": 1, "length": 0, "fits": None},
        "eps": None,
    }
    assert plain(np.array([1, -np.inf])) == [1, "-inf"]


def test_images_of_one_name_keep_their_suffix_or_their_folders(images, tmp_path):
    other = images[0].with_suffix(".tiff")
    imwriteRange(other, np.full((30, 40), 1500, np.uint16))
    items = list(detectBatch([images[0], other], tmp_path / "one", K=K))
    assert [Path(item.folder).name for item in items] == ["frame0.png", "frame0.tiff"]
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "frame0.png").write_bytes(images[0].read_bytes())
    items = list(detectBatch([*images, tmp_path / "more" / "frame0.png"], tmp_path / "two", K=K))
    folders = [Path(item.folder).relative_to(tmp_path / "two").as_posix() for item in items]
    assert folders == [f"{tmp_path.name}/frame0", "frame1", "frame2", "more/frame0"]
    assert all((tmp_path / "two" / folder / "report.json").exists() for folder in (folders[0], folders[3]))


def test_no_frame_has_the_name_of_the_folder_of_others(images, tmp_path):
    np.save(tmp_path / "frame0.npy", np.full((2, 30, 40), 1500, np.uint16))
    items = list(detectBatch([images[0], tmp_path / "frame0.npy"], tmp_path / "out", K=K))
    folders = [Path(item.folder).relative_to(tmp_path / "out").as_posix() for item in items]
    assert folders == ["frame0.png", "frame0/0000", "frame0/0001"]


def test_results_never_replace_what_is_read(images, tmp_path):
    before = images[0].read_bytes()
    with pytest.raises(error, match=r"would replace the input .*frame0\.png"):
        list(runBatch(images, tmp_path, form="png", K=K))
    assert images[0].read_bytes() == before
    assert not (tmp_path / "manifest.jsonl").exists()


def test_warnings_are_in_the_manifest(tmp_path):
    stack = np.full((3, 120, 160), 1500, np.uint16)
    stack[:, 30:80, 40:110] = 1000
    np.save(tmp_path / "walk.npy", stack)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        items = list(runBatch(tmp_path / "walk.npy", tmp_path / "out", form="png", jobs=2))
        clear = list(runBatch(tmp_path / "walk.npy", tmp_path / "clear", form="png", pixelSize=5.0))
    assert all("geometry is not given" in warning for item in items for warning in item.warnings)
    assert [len(item.warnings) for item in items] == [1] * 3
    for out, found in (("out", items), ("clear", clear)):
        lines = [json.loads(line) for line in (tmp_path / out / "manifest.jsonl").read_text().splitlines()]
        assert [tuple(line.get("warnings", ())) for line in lines] == [item.warnings for item in found]


def test_one_image_twice(images, tmp_path):
    with pytest.raises(error, match="is given twice"):
        detectBatch([images[0], images[0]], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_command_reports_failures_at_the_end(images, tmp_path, capsys):
    argv = ["batch", *map(str, images), "-K", "50,50,19.5,14.5", "--out", str(tmp_path / "out")]
    assert main([*argv, "--jobs", "2"]) == 1
    said, complaint = capsys.readouterr()
    assert said.splitlines()[-1] == "2 written, 0 skipped, 1 failed"
    assert complaint.startswith(f"failed: cannot read '{images[1]}': it is none of PNG")
    images[1].unlink()
    assert main([*argv[:2], *argv[4:], "--force"]) == 0


def test_command_refuses_bad_options(images, tmp_path, capsys):
    argv = ["batch", *map(str, images), "--out", str(tmp_path / "out")]
    assert main([*argv, "--jobs", "0"]) == 2
    assert "jobs" in capsys.readouterr().err


def test_names_of_dots_stay_in_the_folder(images, tmp_path):
    names = ["..png", "...png", "....png", ".png", "a..png"]
    for name in names:
        (tmp_path / name).write_bytes(images[0].read_bytes())
    items = list(detectBatch([tmp_path / name for name in names], tmp_path / "a" / "b", K=K))
    assert states(items) == ["written"] * 5
    folders = {"..png", "...png", "....png", ".png", "a."}
    assert {path.name for path in (tmp_path / "a" / "b").iterdir()} == folders | LEDGER
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b"]
    assert all((tmp_path / "a" / "b" / name / "report.json").is_file() for name in folders)


@pytest.mark.parametrize("name", ["", "a/..", "..."])
def test_what_names_no_file(tmp_path, name):
    with pytest.raises(error, match="`inputs` must be names of files"):
        detectBatch([name], tmp_path)


def test_a_folder_without_images(tmp_path):
    with pytest.raises(error, match="holds no range images"):
        detectBatch([tmp_path], tmp_path / "out")
    with pytest.raises(error, match="no file fits the pattern"):
        detectBatch([tmp_path / "*.png"], tmp_path / "out")


def test_bad_names(images, tmp_path):
    for paths in ([None], [5], [b"x.png"], 5, None):
        with pytest.raises(error, match="detectBatch: `paths` must be"):
            detectBatch(paths, tmp_path)
    for out in (None, 5, b"x"):
        with pytest.raises(error, match="detectBatch: `out` must be a file name"):
            detectBatch(images, out)


@pytest.fixture
def stack(tmp_path):
    """Three frames with the camera of `K`."""
    depth = np.full((3, 30, 40), 1500, np.uint16)
    for shift, frame in enumerate(depth):
        frame[8:20, 10 + shift : 28] = 1000
    np.savez(tmp_path / "walk.npz", src=depth, K=K)
    return tmp_path / "walk.npz", depth


class TestForms:
    def lines(self, path):
        return [json.loads(line) for line in path.read_text().splitlines()]

    def test_files_of_arrays(self, stack, tmp_path):
        path, depth = stack
        assert states(runBatch(path, tmp_path / "out", form="npz")) == ["written"] * 3
        for index, src in enumerate(depth):
            edges, strength = detectEdgesWithStrength(src, K=K)
            with np.load(tmp_path / "out" / "walk" / f"000{index}.npz") as found:
                assert set(found) == {"edges", *strength._fields}
                assert np.array_equal(found["edges"], edges)
                assert all(np.array_equal(found[name], values) for name, values in strength._asdict().items())

    def test_regions_and_lines(self, stack, tmp_path):
        path, depth = stack
        assert states(runBatch(path, tmp_path / "png", "segment", form="png", minArea=20)) == ["written"] * 3
        assert states(runBatch(path, tmp_path / "folder", "segment", minArea=20)) == ["written"] * 3
        assert states(runBatch(path, tmp_path / "lines", "lines", bridge=3.0)) == ["written"] * 3
        assert states(runBatch(path, tmp_path / "npz", "lines", form="npz")) == ["written"] * 3
        labels = cv2.imread(str(tmp_path / "png" / "walk" / "0001.png"), cv2.IMREAD_UNCHANGED)
        assert np.array_equal(labels, segmentRegions(depth[1], K=K, minArea=20))
        assert (tmp_path / "folder" / "walk" / "0001" / "labels.png").read_bytes() == encoded(".png", labels)
        assert {file.name for file in (tmp_path / "lines" / "walk" / "0002").iterdir()} == set(LINE_FILES)
        with np.load(tmp_path / "npz" / "walk" / "0000.npz") as found:
            assert np.array_equal(found["points"], linkEdges(depth[0], K=K).points)

    def test_the_manifest_says_what_was_done(self, stack, tmp_path):
        path, depth = stack
        list(runBatch([path, tmp_path / "missing.png"], tmp_path / "out", form="png", minLength=4))
        first, *_, last = self.lines(tmp_path / "out" / "manifest.jsonl")
        edges = np.count_nonzero(detectEdges(depth[0], K=K, minLength=4))
        assert (first["frame"], first["input"], first["part"]) == ("walk/0000", str(path), "frame 0")
        assert first["outputs"] == {"walk/0000.png": (tmp_path / "out" / "walk" / "0000.png").stat().st_size}
        assert first["counts"] == {"edgePixels": edges}
        assert first["seconds"] > 0
        expected = {"task": "detect", "form": "png", "minLength": 4, "K": f"float64 array of shape {K.shape}"}
        assert {**first["parameters"], "K": expected["K"]} == expected
        assert (last["state"], last["outputs"]) == ("failed", {})
        assert "missing.png" in last["error"]

    @pytest.mark.parametrize("change", [lambda data: data[:-1], lambda data: data + b"0"], ids=["shorter", "longer"])
    def test_results_of_another_length_are_made_anew(self, stack, tmp_path, change):
        path, out = stack[0], tmp_path / "out"
        assert states(runBatch(path, out, form="png")) == ["written"] * 3
        result = out / "walk" / "0001.png"
        whole = result.read_bytes()
        result.write_bytes(change(whole))
        assert states(runBatch(path, out, form="png")) == ["skipped", "written", "skipped"]
        assert result.read_bytes() == whole

    def test_chunks_of_a_store(self, stack, tmp_path):
        zarr = pytest.importorskip("zarr")
        path, depth = stack
        out = tmp_path / "out.zarr"
        assert states(runBatch(path, out)) == ["written"] * 3
        group = zarr.open_group(str(out), mode="r")
        assert sorted(group.array_keys()) == ["crease", "edges", "jump", "kind", "significance"]
        assert group["edges"].chunks == (1, 30, 40)
        assert np.array_equal(group["edges"][:], [detectEdges(src, K=K) for src in depth])
        assert len(self.lines(tmp_path / "out.zarr.manifest.jsonl")) == 3
        assert states(runBatch(path, out)) == ["skipped"] * 3
        (out / "jump" / "c" / "1" / "0" / "0").unlink()
        assert states(runBatch(path, out)) == ["skipped", "written", "skipped"]

    def test_a_store_grows_and_refuses_frames_of_other_sizes(self, stack, tmp_path):
        zarr = pytest.importorskip("zarr")
        path, depth = stack
        np.savez(tmp_path / "walk2.npz", src=depth[:, :20], K=K)
        (tmp_path / "none.png").write_bytes(b"")
        out = tmp_path / "out.zarr"
        assert states(runBatch(path, out, "segment")) == ["written"] * 3
        inputs = [path, tmp_path / "walk2.npz", tmp_path / "none.png"]
        items = list(runBatch(inputs, out, "segment"))
        assert states(items) == ["skipped"] * 3 + ["failed"] * 4
        assert "40 x 20 pixels, the store has frames of 40 x 30" in items[3].message
        assert zarr.open_group(str(out), mode="r")["labels"].shape == (7, 30, 40)

    def test_the_size_of_a_store_is_that_of_two_frames(self, tmp_path):
        zarr = pytest.importorskip("zarr")
        for index, rows in enumerate((20, 30, 30)):
            imwriteRange(tmp_path / f"{index}.png", np.full((rows, 40), 1500, np.uint16))
        items = list(runBatch(tmp_path, tmp_path / "out.zarr", K=K))
        assert states(items) == ["failed", "written", "written"]
        assert zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["edges"].shape == (3, 30, 40)

    def test_extras_that_are_missing_are_named(self, stack, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "zarr", None)
        with pytest.raises(error, match=r"needs zarr: pip install 'rangeedge\[zarr\]'"):
            list(runBatch(stack[0], tmp_path / "out.zarr"))
        (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
        for module in ("rosbags", "rosbags.highlevel"):
            monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(error, match=r"needs rosbags: pip install 'rangeedge\[bags\]'"):
            framesOf(tmp_path / "a.bag")


class TestCommand:
    def argv(self, path, tmp_path, *more):
        return ["batch", str(path), "--out", str(tmp_path / "out"), *more]

    def test_options_of_each_task(self, stack, tmp_path, capsys):
        argv = self.argv(stack[0], tmp_path, "--task", "segment", "--form", "png", "--min-area", "20")
        assert main(argv) == 0
        assert capsys.readouterr().out.splitlines()[-1] == "3 written, 0 skipped, 0 failed"
        assert main(self.argv(stack[0], tmp_path, "--min-area", "20")) == 2
        assert "--min-area is no option of 'detect'" in capsys.readouterr().err

    def test_a_bar_where_a_person_looks_on(self, stack, tmp_path, capsys, monkeypatch):
        pytest.importorskip("tqdm")
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
        assert main(self.argv(stack[0], tmp_path, "--form", "png")) == 0
        said, shown = capsys.readouterr()
        assert said == "3 written, 0 skipped, 0 failed\n"
        assert "3/3" in shown
        assert "frame/s" in shown

    def test_without_tqdm_a_line_a_frame(self, stack, tmp_path, capsys, monkeypatch):
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
        monkeypatch.setitem(sys.modules, "tqdm", None)
        assert main(self.argv(stack[0], tmp_path, "--form", "png")) == 0
        said, shown = capsys.readouterr()
        assert said.count("written ") == 3
        assert shown == ""

    def test_each_kind_of_failure_and_of_warning_is_told_once(self, tmp_path, capsys):
        for index in range(6):
            imwriteRange(tmp_path / f"{index}.png", np.full((120, 160), 1500, np.uint16))
        for index in (1, 2, 4):
            (tmp_path / f"{index}.png").write_bytes(b"garbled")
        assert main(self.argv(tmp_path, tmp_path, "--form", "png")) == 1
        said = capsys.readouterr().err.splitlines()
        assert [line.split(": ")[0] for line in said] == ["warning", "failed", "warning", "failed"]
        first, broken, more_warnings, more_failures = said
        assert first.startswith(f"warning: {tmp_path / '0.png'}: ")
        assert "give -K" in first
        assert broken.startswith(f"failed: cannot read '{tmp_path / '1.png'}': it is none of PNG")
        assert more_warnings == (
            f"warning: as {tmp_path / '0.png'}: 2 more, see the manifest: {tmp_path / '3.png'}, {tmp_path / '5.png'}"
        )
        assert more_failures == (
            f"failed: as {tmp_path / '1.png'}: 2 more, see the manifest: {tmp_path / '2.png'}, {tmp_path / '4.png'}"
        )

    @pytest.mark.skipif(sys.platform != "linux", reason="elsewhere every name is text")
    def test_names_that_are_no_text(self, tmp_path, capsys):
        name = os.fsdecode(bytes(tmp_path / "a") + b"\xff.png")
        imwriteRange(name, np.full((30, 40), 1500, np.uint16))
        assert main(self.argv(name, tmp_path, "-K", "50,50,19.5,14.5")) == 0
        assert "a\\udcff.png" in capsys.readouterr().out
        assert (tmp_path / "out" / Path(name).stem / "report.json").is_file()

    @pytest.mark.parametrize(
        ("more", "message"),
        [
            (["--overlap", "9"], "--overlap goes with --blocks"),
            (["--per-task", "9"], "--per-task goes with --dask"),
            (["--blocks", "99", "--form", "png"], "--form does not go with --blocks"),
            (["--blocks", "9"], "--blocks must be an integer >= 64, got 9"),
            (["--topic", "/depth"], "--topic = /depth, but no input is a bag"),
            (["--jobs", "-1"], "--jobs must be an integer >= 1"),
        ],
    )
    def test_mistakes_are_told_in_the_words_of_the_command_line(self, stack, tmp_path, capsys, more, message):
        assert main(self.argv(stack[0], tmp_path, *more)) == 2
        assert message in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "call",
    [
        "list(runBatch('stack.npy', 'out', form='png', jobs=2, noise=0.001, pixelSize=0.01))",
        "list(rangeedge.mapFrames(np.load('stack.npy'), rangeedge.detectEdges, jobs=2))",
    ],
)
def test_program_that_begins_itself_again_is_told_so_once(call, tmp_path):
    np.save(tmp_path / "stack.npy", np.full((4, 48, 64), 2.0))
    head = "import numpy as np\nimport rangeedge\nfrom rangeedge.batch import runBatch\n"
    (tmp_path / "script.py").write_text(head + call)
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert done.stderr.count("Traceback") == 1
    assert done.stderr.splitlines()[-1].endswith("put what it does under if __name__ == '__main__':")
