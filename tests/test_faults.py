"""What goes wrong in long runs: whatever it is, every frame has one line at the end, and the results are the same."""

import functools
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
import types
from multiprocessing.context import ForkServerContext
from pathlib import Path

import numpy as np
import pytest

import rangeedge
from rangeedge import error, imreadRange, mapFrames
from rangeedge.app.cli import main
from rangeedge.batch import FrameSource, framesOf, runBatch
from rangeedge.recording.manifest import Manifest

PACKAGE = Path(rangeedge.__file__).parents[1]
OPTIONS = {"noise": 0.001, "pixelSize": 0.01}
FRAMES = 40


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A box that moves before a wall, as a stack."""
    stack = np.full((FRAMES, 60, 80), 1500, np.uint16)
    for index, depth in enumerate(stack):
        depth[16:40, 10 + index : 70] = 1000
    path = tmp_path_factory.mktemp("recording") / "walk.npy"
    np.save(path, stack)
    return path


@pytest.fixture(scope="module")
def undisturbed(recording, tmp_path_factory):
    """The results of a run that nothing happened to."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    assert {item.state for item in runBatch(recording, out, form="npz", **OPTIONS)} == {"written"}
    return results(out)


def results(out):
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*.npz")}


def manifest(out):
    """State by frame; every frame has one line."""
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    states = {line["frame"]: line["state"] for line in lines}
    assert len(states) == len(lines)
    return states


def assert_complete(out, undisturbed):
    states = manifest(out)
    assert len(states) == FRAMES
    assert set(states.values()) == {"written"}
    assert results(out) == undisturbed
    assert not [path for path in out.rglob("*.tmp")]


posix = pytest.mark.skipif(os.name == "nt", reason="of POSIX: groups of processes, signals, devices")


def killing(path, index, marker):
    """A frame; the first to come here is killed on the way."""
    if marker is None or not os.path.exists(marker):
        if marker is not None:
            Path(marker).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return framesOf(path)[index].read()


@posix
def test_a_killed_worker_costs_nothing(recording, undisturbed, tmp_path):
    frames = framesOf(recording)
    load = functools.partial(killing, str(recording), 7, str(tmp_path / "marker"))
    frames[7] = FrameSource(frames[7].name, frames[7].path, frames[7].part, load)
    items = list(runBatch(frames, tmp_path / "out", form="npz", jobs=2, **OPTIONS))
    assert (tmp_path / "marker").exists()
    assert {item.state for item in items} == {"written"}
    assert_complete(tmp_path / "out", undisturbed)


@posix
def test_a_frame_that_kills_every_worker_fails_alone(recording, undisturbed, tmp_path):
    frames = framesOf(recording)
    load = functools.partial(killing, str(recording), 7, None)
    frames[7] = FrameSource(frames[7].name, frames[7].path, frames[7].part, load)
    items = list(runBatch(frames, tmp_path / "out", form="npz", jobs=2, **OPTIONS))
    assert [i for i, item in enumerate(items) if item.state == "failed"] == [7]
    assert "the worker process was killed, twice" in items[7].message
    assert [item.state for item in runBatch(recording, tmp_path / "out", form="npz", **OPTIONS)].count("written") == 1
    assert_complete(tmp_path / "out", undisturbed)


def command(recording, out, *more):
    options = ["--noise", "0.001", "--pixel-size", "0.01", "--form", "npz", *more]
    return ["batch", str(recording), "--out", str(out), *options]


def started(argv, **more):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-m", "rangeedge", *argv], cwd=PACKAGE, **pipes, **more)


def await_lines(out, count, process):
    deadline = time.monotonic() + 60
    while not (out / "manifest.jsonl").exists() or (out / "manifest.jsonl").read_bytes().count(b"\n") < count:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.002)


@posix
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_killed_run_is_completed(recording, undisturbed, tmp_path, jobs, capsys):
    out = tmp_path / "out"
    process = started(command(recording, out, "--jobs", str(jobs)), start_new_session=True)
    await_lines(out, 3, process)
    process.kill()
    process.communicate()
    with open(out / "manifest.jsonl", "a") as file:
        file.write('{"frame": "walk/0039", "state": "wri')  # as if the line had been cut off
    stage = out / f".{'0123456789abcdef' * 2}.tmp"
    stage.mkdir()
    (stage / "thin.png").write_bytes(b"half")
    assert main(command(recording, out, "--resume")) == 0
    assert "0 written" not in capsys.readouterr().out
    assert_complete(out, undisturbed)
    deadline = time.monotonic() + 20
    while group_lives(process.pid):  # workers end with the process that they worked for
        assert time.monotonic() < deadline
        time.sleep(0.05)


def group_lives(group):
    """Whether a process of a group runs; zombies do not."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, owner = stat.read_text().rpartition(")")[2].split()[:3]
        except (OSError, ValueError):
            continue
        if int(owner) == group and state != "Z":
            return True
    return False


@posix
def test_an_interrupt_says_what_is_done(recording, tmp_path):
    out = tmp_path / "out"
    argv = command(recording, out, "--jobs", "2", "--form", "folder")
    process = started(argv, start_new_session=True)
    await_lines(out, 3, process)
    os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does it
    said, complaint = process.communicate(timeout=30)
    assert process.returncode == 130, complaint
    done = manifest(out)
    assert len(done) < FRAMES
    assert complaint.strip() == (
        f"stopped: {len(done)} written, 0 skipped, 0 failed of {FRAMES} frames; run the same again to go on"
    )
    assert said.count("written ") == len(done)
    assert main(argv) == 0
    assert list(manifest(out).values()) == ["written"] * FRAMES
    assert len(list(out.rglob("report.json"))) == FRAMES


def test_outputs_are_trusted_only_as_they_were_written(recording, undisturbed, tmp_path):
    out = tmp_path / "out"
    list(runBatch(recording, out, form="npz", **OPTIONS))
    (out / "walk" / "0003.npz").write_bytes(b"half")
    (out / "walk" / "0004.npz").unlink()
    states = [item.state for item in runBatch(recording, out, form="npz", **OPTIONS)]
    assert [index for index, state in enumerate(states) if state == "written"] == [3, 4]
    assert_complete(out, undisturbed)
    other = [item.state for item in runBatch(recording, out, form="npz", **{**OPTIONS, "minLength": 5})]
    assert other.count("written") == FRAMES


def test_two_runs_on_one_output(recording, tmp_path, capsys):
    out = tmp_path / "out"
    with Manifest(out / "manifest.jsonl").opened():
        assert main(command(recording, out)) == 2
        assert "another run is writing to" in capsys.readouterr().err
    assert main(command(recording, out)) == 0


class LocksOfWindows:
    """What `msvcrt` has of them: a byte that belongs to one descriptor."""

    LK_NBLCK = 2

    def __init__(self, monkeypatch):
        self.owner = None
        monkeypatch.setattr(os, "close", functools.partial(self.close, os.close))

    def locking(self, descriptor, mode, count):
        assert (os.fstat(descriptor).st_size, mode, count) == (0, self.LK_NBLCK, 1)
        if self.owner is not None:
            raise PermissionError(13, "Permission denied")
        self.owner = descriptor

    def close(self, close, descriptor):
        if descriptor == self.owner:
            self.owner = None
        close(descriptor)


def test_two_runs_on_one_output_on_windows(recording, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "msvcrt", LocksOfWindows(monkeypatch))
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setattr("rangeedge.recording.manifest.sys", types.SimpleNamespace(platform="win32"))
    test_two_runs_on_one_output(recording, tmp_path, capsys)


def test_lines_end_on_windows_as_elsewhere(tmp_path, monkeypatch):
    """Windows would write two characters for the end of a line, but for a flag."""
    opened, binary = os.open, 1 << 40
    flags = []
    monkeypatch.setattr(os, "O_BINARY", binary, raising=False)
    monkeypatch.setattr(os, "open", lambda path, how, *mode: flags.append(how) or opened(path, how & ~binary, *mode))
    with Manifest(tmp_path / "manifest.jsonl").opened() as ledger:
        ledger.keep(set())
        flags.clear()
        ledger.append({"frame": "a"})
    assert [flag & binary for flag in flags] == [binary]


def test_workers_where_there_is_no_server_of_them(recording, undisturbed, tmp_path, monkeypatch):
    monkeypatch.setattr(multiprocessing, "get_all_start_methods", lambda: ["spawn"])
    monkeypatch.setattr(ForkServerContext, "set_forkserver_preload", lambda *_: pytest.fail("no such server"))
    assert {item.state for item in runBatch(recording, tmp_path / "out", form="npz", jobs=2, **OPTIONS)} == {"written"}
    assert_complete(tmp_path / "out", undisturbed)


def test_resume_wants_something_to_resume(recording, tmp_path, capsys):
    assert main(command(recording, tmp_path / "other", "--resume")) == 2
    assert "to resume from" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def test_output_that_cannot_be_written(recording, tmp_path, capsys):
    (tmp_path / "file").write_text("no folder")
    nowhere = [Path("/proc/out")] if sys.platform == "linux" else []
    for out in (tmp_path / "file", tmp_path / "file" / "out", *nowhere):
        assert main(command(recording, out)) == 2
        assert "cannot write to" in capsys.readouterr().err


def test_a_line_that_does_not_fit_leaves_the_manifest_as_it_was(tmp_path, monkeypatch):
    with Manifest(tmp_path / "manifest.jsonl").opened() as ledger:
        ledger.keep(set())
        ledger.append({"frame": "a"})
        write = os.write
        monkeypatch.setattr(os, "write", lambda descriptor, data: write(descriptor, data[:5]))
        with pytest.raises(error, match="No space left"):
            ledger.append({"frame": "b"})
    assert (tmp_path / "manifest.jsonl").read_text() == '{"frame": "a"}\n'


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 64 KiB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    argv = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    try:
        mounted = subprocess.run(argv, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("a file system may not be mounted here")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_stops_the_run_until_there_is_room(recording, undisturbed, small_disk, jobs, capsys):
    out = small_disk / "out"
    assert main(command(recording, out, "--jobs", str(jobs))) == 2
    complaint = capsys.readouterr().err
    assert "stopped: " in complaint
    assert "No space left" in complaint or "nothing more can be written" in complaint
    states = manifest(out)
    assert 0 < list(states.values()).count("written") < FRAMES
    assert list(states.values()).count("failed") <= 1
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    assert main(command(recording, out, "--jobs", str(jobs))) == 0
    assert_complete(out, undisturbed)


def test_garbled_frames_among_good_ones(tmp_path):
    stack = np.full((6, 60, 80), 1500, np.uint16)
    for index in range(6):
        rangeedge.imwriteRange(tmp_path / f"frame{index}.png", stack[index])
    (tmp_path / "frame1.png").write_bytes(b"")
    (tmp_path / "frame3.png").write_bytes((tmp_path / "frame3.png").read_bytes()[:60])
    (tmp_path / "frame4.png").write_bytes(os.urandom(1000))
    items = list(runBatch(tmp_path, tmp_path / "out", form="png", jobs=2, **OPTIONS))
    failed = [Path(item.path).name for item in items if item.state == "failed"]
    assert failed == ["frame1.png", "frame3.png", "frame4.png"]
    assert all(item.message for item in items if item.state == "failed")
    assert list(manifest(tmp_path / "out").values()).count("failed") == 3


def test_frames_of_functions_in_order_and_with_their_errors(recording):
    results = list(mapFrames([*np.load(recording)[:3], "missing.png"], area, jobs=2))
    assert [(result.frame, result.value) for result in results] == [(0, 4800), (1, 4800), (2, 4800), (3, None)]
    assert "missing.png" in results[3].error
    given = list(mapFrames([rangeedge.RangeImage(np.zeros((3, 4)), {"pixelSize": 2.0})], spaced))
    assert given[0].value == 2.0
    replaced = functools.partial(spaced, pixelSize=3.0)
    assert next(mapFrames([rangeedge.RangeImage(np.zeros((3, 4)), {"pixelSize": 2.0})], replaced)).value == 3.0


def area(src):
    return src.size


def spaced(src, pixelSize):
    return pixelSize


@pytest.mark.parametrize(
    ("frames", "more", "message"),
    [
        ("one.png", {}, "`frames` must be an array"),
        (np.zeros((3, 4)), {}, "`frames` must be an array"),
        ([], {"jobs": 0}, "`jobs`"),
        ([], {"batch": 0}, "`batch`"),
        ([], {"client": 5}, "`client` must be a dask"),
    ],
)
def test_bad_arguments(frames, more, message):
    with pytest.raises(error, match=f"mapFrames: {message}"):
        mapFrames(frames, imreadRange, **more)
    with pytest.raises(error, match="mapFrames: `function` must be callable"):
        mapFrames([], 5)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"task": "paint"}, "`task` must be 'detect' or 'segment' or 'lines'"),
        ({"form": "jpg"}, "`form` must be"),
        ({"task": "lines", "form": "png"}, "`form` must be 'folder' or 'npz' for 'lines'"),
        ({"task": "detect", "minArea": 9}, "`minArea` is no option of 'detect'"),
        ({"task": "segment", "bridge": 9.0}, "`bridge` is no option of 'segment'"),
        ({"eps": -1.0}, "`eps`"),
    ],
)
def test_bad_arguments_of_a_run(recording, tmp_path, more, message):
    with pytest.raises(error, match=f"runBatch: {message}"):
        runBatch(recording, tmp_path / "out", **more)
    assert not (tmp_path / "out").exists()
