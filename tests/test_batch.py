"""Many images: folders, failures, and going on where it stopped."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from rangeedge import NoiseModel, error, imwriteRange
from rangeedge.app.cli import main
from rangeedge.app.results import EDGE_FILES, plain
from rangeedge.batch import detectBatch

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


def test_one_image_twice(images, tmp_path):
    with pytest.raises(error, match="is given twice"):
        detectBatch([images[0], images[0]], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_command_reports_failures_at_the_end(images, tmp_path, capsys):
    argv = ["batch", *map(str, images), "-K", "50,50,19.5,14.5", "--out", str(tmp_path / "out")]
    assert main([*argv, "--jobs", "2"]) == 1
    said, complaint = capsys.readouterr()
    assert said.splitlines()[-1] == "2 written, 0 skipped, 1 failed"
    assert complaint.startswith(str(images[1]))
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
