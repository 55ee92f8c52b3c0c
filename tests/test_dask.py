"""Dask does what one process does, byte for byte, whatever dies on the way."""

import functools
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import rangeedge
from rangeedge import detectEdges, error, mapFrames
from rangeedge.app.cli import main
from rangeedge.batch import eachFrame, framesOf, runBatch

distributed = pytest.importorskip("distributed")
array = pytest.importorskip("dask.array")

PACKAGE = Path(rangeedge.__file__).parents[1]
OPTIONS = {"noise": 0.001, "pixelSize": 0.01}
FRAMES = 24


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    stack = np.full((FRAMES, 60, 80), 1500, np.uint16)
    for index, depth in enumerate(stack):
        depth[16:40, 10 + index : 70] = 1000
    path = tmp_path_factory.mktemp("recording") / "walk.npy"
    np.save(path, stack)
    return path


@pytest.fixture(scope="module")
def undisturbed(recording, tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    assert {item.state for item in runBatch(recording, out, form="npz", **OPTIONS)} == {"written"}
    return results(out)


def results(out):
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*.npz")}


def assert_complete(out, undisturbed):
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    assert [(line["index"], line["state"]) for line in lines] == [(index, "written") for index in range(FRAMES)]
    assert results(out) == undisturbed


@pytest.fixture(scope="module")
def client():
    """Of two worker processes that see the package under test."""
    before = os.environ.get("PYTHONPATH", "")
    os.environ["PYTHONPATH"] = f"{PACKAGE}{os.pathsep}{Path(__file__).parent}"
    try:
        with (
            distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
    finally:
        os.environ["PYTHONPATH"] = before


@pytest.mark.parametrize("batch", [1, 5])
def test_equals_the_run_of_one_process(client, recording, undisturbed, tmp_path, batch):
    items = list(runBatch(recording, tmp_path / "out", form="npz", client=client, batch=batch, **OPTIONS))
    assert {item.state for item in items} == {"written"}
    assert_complete(tmp_path / "out", undisturbed)
    again = runBatch(recording, tmp_path / "out", form="npz", **OPTIONS)
    assert {item.state for item in again} == {"skipped"}


def test_the_command_by_its_scheduler(client, recording, undisturbed, tmp_path, capsys):
    options = ["--noise", "0.001", "--pixel-size", "0.01", "--form", "npz", "--dask", client.scheduler.address]
    assert main(["batch", str(recording), "--out", str(tmp_path / "out"), *options, "--per-task", "3"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"{FRAMES} written, 0 skipped, 0 failed"
    assert_complete(tmp_path / "out", undisturbed)


def test_frames_of_functions(client, recording):
    stack = np.load(recording)
    found = list(mapFrames(stack, functools.partial(detectEdges, **OPTIONS), client, batch=7))
    for result, src in zip(found, stack, strict=True):
        assert np.array_equal(result.value, detectEdges(src, **OPTIONS))
    missing = list(mapFrames([stack[0], "missing.png"], functools.partial(detectEdges, **OPTIONS), client))
    assert [bool(result.error) for result in missing] == [False, True]


def test_arrays_of_dask_go_through_functions_as_they_are(client, recording):
    stack = np.load(recording)
    lazy = array.from_array(stack, chunks=(4, -1, -1))
    edges = lazy.map_blocks(eachFrame(detectEdges, **OPTIONS), dtype=np.uint8, meta=np.empty((0, 0, 0), np.uint8))
    expected = np.stack([detectEdges(src, **OPTIONS) for src in stack])
    assert np.array_equal(edges.compute(), expected)
    each = mapFrames(lazy, functools.partial(detectEdges, **OPTIONS))
    assert np.array_equal(np.stack([result.value for result in each]), expected)


def test_one_image_in_blocks_of_dask(client):
    depth = np.full((200, 300), 2.0)
    depth[40:160, 50:250] = 1.5
    function = functools.partial(detectEdges, **OPTIONS)
    whole = array.from_array(depth, chunks=100)
    blocks = whole.map_overlap(function, depth=30, boundary="none", dtype=np.uint8, meta=np.empty((0, 0), np.uint8))
    assert np.array_equal(blocks.compute(), function(depth))


def slowly(path, index):
    time.sleep(0.1)
    return framesOf(path)[index].read()


def slow(recording):
    """Frames that take a while."""
    loads = [functools.partial(slowly, str(recording), index) for index in range(FRAMES)]
    frames = zip(framesOf(recording), loads, strict=True)
    return [type(frame)(frame.name, frame.path, frame.part, load) for frame, load in frames]


@pytest.mark.skipif(os.name == "nt", reason="there is no such signal")
def test_a_killed_worker_costs_nothing(client, recording, undisturbed, tmp_path):
    items = runBatch(slow(recording), tmp_path / "out", form="npz", client=client, **OPTIONS)
    assert next(items).state == "written"
    os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
    assert {item.state for item in items} == {"written"}
    assert_complete(tmp_path / "out", undisturbed)


def test_a_scheduler_that_is_started_anew_costs_nothing(recording, undisturbed, tmp_path):
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{found.getsockname()[1]}"
    environment = {**os.environ, "PYTHONPATH": f"{PACKAGE}{os.pathsep}{Path(__file__).parent}"}
    running = []

    def start(*argv):
        command = [sys.executable, "-m", "distributed.cli." + argv[0], *argv[1:]]
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        process = subprocess.Popen(command, cwd=PACKAGE, env=environment, **silent)
        running.append(process)
        return process

    def cluster():
        port = address.rpartition(":")[2]
        scheduler = start("dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
        return scheduler, start("dask_worker", address, "--no-nanny", "--nthreads", "1", "--no-dashboard")

    try:
        scheduler, worker = cluster()
        with distributed.Client(address, timeout=30) as client:
            client.wait_for_workers(1, timeout=30)
            items = runBatch(slow(recording), tmp_path / "out", form="npz", client=client, **OPTIONS)
            assert next(items).state == "written"
            for process in (scheduler, worker):
                process.kill()
                process.wait()
            threading.Timer(0.5, cluster).start()
            assert {item.state for item in items} == {"written"}
        assert_complete(tmp_path / "out", undisturbed)
    finally:
        for process in running:
            process.kill()
            process.wait()


def test_no_scheduler(recording, tmp_path, capsys):
    argv = ["batch", str(recording), "--out", str(tmp_path / "out"), "--dask"]
    assert main([*argv, str(tmp_path / "scheduler.json")]) == 2
    assert "no scheduler of Dask at" in capsys.readouterr().err


def test_without_the_package(recording, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["batch", str(recording), "--out", str(tmp_path / "out"), "--dask", "local"]) == 2
    assert "pip install 'rangeedge[dask]'" in capsys.readouterr().err
    with pytest.raises(error, match="must be a dask"):
        mapFrames([], detectEdges, "local")
