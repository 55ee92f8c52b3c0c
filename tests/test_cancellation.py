"""Calls that are given up: by Ctrl-C, from another thread, and when Python ends."""

import _thread
import functools
import importlib
import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import CancelledError
from pathlib import Path

import numpy as np
import pytest

import rangeedge
from rangeedge import _check, evaluation
from rangeedge.batch import runBatch
from rangeedge.cancellation import apart

SOON = 0.2  # seconds
TRIES = 3  # of which the quickest counts, as other programs may run
SIDE = 1500  # pixels
ROOT = Path(rangeedge.__file__).parents[1]


def noise(side=SIDE):
    return np.random.default_rng(0).normal(1, 0.1, (side, side)).astype(np.float32)


def ramp(side=3000):
    """Saliences whose multiplicative transform is slow: weights that fall as the distance grows."""
    return np.tile(
        np.maximum(1 - np.arange(side) / side, 0).astype(np.float32) * (np.arange(side) < side / 4), (side, 1)
    )


def comb(side=3000):
    """An edge in the corner of a maze of walls."""
    walls = np.zeros((side, side), np.uint8)
    walls[5::6] = 255
    walls[5::12, :2] = walls[11::12, -2:] = 0
    edges = np.zeros_like(walls)
    edges[0, 0] = 255
    return edges, walls


def calls():
    z = noise()
    edges, walls = comb()
    full = np.full((2500, 2500), 255, np.uint8)
    labels = np.arange(SIDE * SIDE, dtype=np.int32).reshape(SIDE, SIDE) // 3
    markers = np.zeros(z.shape, np.int32)
    markers[::4, ::4] = np.arange(1, markers[::4, ::4].size + 1).reshape(markers[::4, ::4].shape)
    alternating = (-1.0) ** np.arange(40000) * np.arange(40000)
    return {
        "edgeStrength": lambda: rangeedge.edgeStrength(z, noise=1e-4),
        "edgePoints": lambda: rangeedge.edgePoints(z, noise=1e-4),
        "detectEdges": lambda: rangeedge.detectEdges(z, noise=1e-4),
        "flyingPixels": lambda: rangeedge.flyingPixels(z, K=(SIDE, SIDE, SIDE / 2, SIDE / 2), noise=1e-4),
        "linkEdges": lambda: rangeedge.linkEdges(z, noise=1e-4),
        "segmentRegions": lambda: rangeedge.segmentRegions(z, noise=1e-4),
        "segmentRegionsWithStats": lambda: rangeedge.segmentRegionsWithStats(z, noise=1e-4),
        "growRegions": lambda: rangeedge.growRegions(np.tile(z, (2, 2)), np.tile(markers, (2, 2)), noise=1e-4),
        "regionAdjacency": lambda: rangeedge.regionAdjacency(z, labels),
        "regionBoundaries": lambda: rangeedge.regionBoundaries((4 * z).astype(np.int32)),
        "closeContours": lambda: rangeedge.closeContours((z > 1.1).astype(np.uint8), z),
        "thinEdges": lambda: rangeedge.thinEdges(full),
        "distanceTransform": lambda: rangeedge.distanceTransform(edges, barrier=walls),
        "salienceDistanceTransform": lambda: rangeedge.salienceDistanceTransform(ramp()),
        "splitScanLine": lambda: rangeedge.splitScanLine(alternating, 0.1),
    }


def interrupted(call, after):
    """Seconds from Ctrl-C to the end of a call; None where that was done before."""
    rung = []

    def ring():
        rung.append(time.monotonic())
        _thread.interrupt_main()

    timer = threading.Timer(after, ring)
    timer.start()
    try:
        call()
        timer.cancel()
        timer.join()
        time.sleep(0.01)  # let a late one come
    except KeyboardInterrupt:
        return time.monotonic() - rung[0]
    return None


@pytest.mark.parametrize("name", list(calls()))
def test_ctrl_c_ends_a_call_soon(name):
    call = calls()[name]
    for after in (0.05, 0.5):
        waits = []
        while len(waits) < TRIES and (not waits or min(waits) > SOON):
            wait = interrupted(call, after)
            if wait is None:
                break
            waits.append(wait)
        assert not waits or min(waits) < SOON, f"{waits} s after {after} s"
        assert waits or after > 0.05, "done too early for this test"


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_ctrl_c_in_a_terminal_ends_the_program():
    program = f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
import numpy as np, rangeedge
z = np.random.default_rng(0).normal(1, .1, (2500, 2500))
print("go", flush=True)
rangeedge.detectEdges(z, noise=1e-4)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        assert run.stdout.readline() == b"go\n"
        time.sleep(0.3)
        run.send_signal(signal.SIGINT)
        began = time.monotonic()
        assert b"KeyboardInterrupt" in run.communicate()[1]
        assert time.monotonic() - began < 5 * SOON  # the end of Python takes a while, too


def test_another_signal_that_raises_ends_a_call():
    if not hasattr(signal, "setitimer"):
        pytest.skip("no timer signals")

    def raise_timeout(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, raise_timeout)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(TimeoutError):
            rangeedge.detectEdges(noise(), noise=1e-4)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_a_call_is_given_up_from_another_thread():
    z = noise()
    waits = []
    for _ in range(TRIES):
        cancellation, said = rangeedge.Cancellation(), []

        def cancel(cancellation=cancellation, said=said):
            said.append(time.monotonic())
            cancellation.cancel()

        threading.Timer(0.1, cancel).start()
        with cancellation, pytest.raises(CancelledError, match="given up"):
            rangeedge.segmentRegions(z, noise=1e-4)
        waits.append(time.monotonic() - said[0])
        assert cancellation.cancelled
    assert min(waits) < SOON


def test_only_the_thread_that_has_entered_is_concerned():
    z, cancellation, results = noise(300), rangeedge.Cancellation(), []
    expected = rangeedge.detectEdges(z)
    cancellation.cancel()

    def detect():
        results.append(rangeedge.detectEdges(z))

    with cancellation:
        with pytest.raises(CancelledError):
            rangeedge.detectEdges(z)
        thread = threading.Thread(target=detect)
        thread.start()
        thread.join()
    assert np.array_equal(results[0], expected)
    assert np.array_equal(rangeedge.detectEdges(z), expected)  # the block is left


def test_blocks_may_be_nested():
    z, outer, inner = noise(300), rangeedge.Cancellation(), rangeedge.Cancellation()
    with outer:
        with inner:
            outer.cancel()
            with pytest.raises(CancelledError):
                rangeedge.detectEdges(z)
        assert not inner.cancelled
    with inner, inner:
        rangeedge.detectEdges(z)
    with inner:
        pass
    inner.cancel()
    rangeedge.detectEdges(z)


def test_a_block_that_is_left_leaves_the_one_around_it():
    z, outer, inner = noise(300), rangeedge.Cancellation(), rangeedge.Cancellation()
    with outer:
        with inner:
            rangeedge.detectEdges(z)
        inner.cancel()
        rangeedge.detectEdges(z)
        outer.cancel()
        with pytest.raises(CancelledError):
            rangeedge.detectEdges(z)


def test_what_was_given_up_leaves_dst_alone_and_the_next_call_right():
    z = noise(400)
    expected, dst = rangeedge.distanceTransform(z > 1.2), np.full(z.shape, -1, np.float32)
    cancellation = rangeedge.Cancellation()
    cancellation.cancel()
    with cancellation, pytest.raises(CancelledError):
        rangeedge.distanceTransform(z > 1.2, dst=dst)
    assert (dst == -1).all()
    assert np.array_equal(rangeedge.distanceTransform(z > 1.2, dst=dst), expected)


@pytest.mark.parametrize("jobs", [1, 2])
def test_frames_that_are_given_up_are_no_failures(jobs):
    z, cancellation = noise(700), rangeedge.Cancellation()
    results = rangeedge.mapFrames([z] * 100, functools.partial(rangeedge.detectEdges, noise=1e-3), jobs=jobs)
    with cancellation:
        assert not next(results).error
        threading.Timer(0.1, cancellation.cancel).start()
        with pytest.raises(CancelledError):
            assert not [result.error for result in results if result.error]
    assert cancellation.cancelled


def test_a_batch_that_is_given_up_goes_on_where_it_stopped(tmp_path):
    path, out, cancellation = tmp_path / "stack.npy", tmp_path / "out", rangeedge.Cancellation()
    np.save(path, np.stack([noise(100)] * 4))
    items = runBatch(path, out, form="png", pixelSize=1, noise=0.1)
    with cancellation:
        assert next(items).state == "written"
        cancellation.cancel()
        with pytest.raises(CancelledError):
            next(items)
    states = [json.loads(line)["state"] for line in (out / "manifest.jsonl").read_text().splitlines()]
    assert states == ["written"]
    states = [item.state for item in runBatch(path, out, form="png", pixelSize=1, noise=0.1)]
    assert states == ["skipped", "written", "written", "written"]


def cancelling(function, cancellation, reached):
    """The function, during which another thread gives up the call."""

    def call(*args, **options):
        thread = threading.Thread(target=cancellation.cancel)
        thread.start()
        thread.join()
        reached.append("after")
        return function(*args, **options)

    return call


@pytest.mark.parametrize(
    ("module", "step", "call"),
    [
        ("rangeedge.frame", "checked", lambda: rangeedge.backproject(noise(100))),
        ("rangeedge.draw.relief", "subdued", lambda: rangeedge.drawEdges(noise(100), np.zeros((100, 100), np.uint8))),
        ("rangeedge.evaluation.edges", "_skeleton", None),
        ("rangeedge.io.files", "as_range_image", None),
    ],
)
def test_what_is_no_kernel_is_given_up_as_well(module, step, call, monkeypatch, tmp_path):
    """Between two steps of Python, also within what catches other exceptions."""
    owner, cancellation, reached = importlib.import_module(module), rangeedge.Cancellation(), []
    if step == "as_range_image":
        path = tmp_path / "image.npy"
        np.save(path, noise(10))
        call = functools.partial(rangeedge.imreadRange, path)
    elif call is None:
        edges = (noise(100) > 1.2).astype(np.uint8)
        call = functools.partial(evaluation.evaluateEdges, edges, edges)
    monkeypatch.setattr(owner, step, cancelling(getattr(owner, step), cancellation, reached))
    with cancellation, pytest.raises(CancelledError, match="given up") as raised:
        call()
    assert not reached
    assert raised.value.__suppress_context__
    call()  # outside the block
    assert reached


def test_calls_within_calls_end_together(monkeypatch):
    """The outer call as well as the inner one, and no exception comes after them."""
    cancellation, reached = rangeedge.Cancellation(), []
    outer = _check.named("outer")(lambda: reached.append(rangeedge.kindNames(cancel())))
    cancel = cancelling(lambda: 1, cancellation, [])
    with cancellation:
        with pytest.raises(CancelledError):
            outer()
        assert not reached
        for _ in range(1000):  # a step that could be given up
            pass
        with pytest.raises(CancelledError):
            rangeedge.kindNames(1)
    outer()
    assert reached == ["jump"]


def test_only_calls_are_given_up():
    """What stands between them in the block goes on."""
    cancellation, done = rangeedge.Cancellation(), 0
    with cancellation:
        cancelling(lambda: None, cancellation, [])()
        for _ in range(1000):
            done += 1
    assert done == 1000


def test_calls_are_given_up_while_others_come_and_go():
    """No exception reaches another call, another thread, or what is between calls."""
    ends, strange = {"whole": 0, "given up": 0}, []

    def work(seed):
        try:
            for k in range(200):
                cancellation = rangeedge.Cancellation()
                timer = threading.Timer(1e-4 * ((seed + k) % 7), cancellation.cancel)
                timer.start()
                try:
                    with cancellation:
                        rangeedge.colorizeDistance(np.ones((64, 64)))
                    ends["whole"] += 1
                except CancelledError:
                    ends["given up"] += 1
                timer.join()
                assert rangeedge.kindNames(1) == "jump"
        except BaseException as problem:
            strange.append(problem)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not strange
    assert min(ends.values()) > 10


def test_a_step_of_another_library_is_left_to_its_thread():
    started, go_on, ended, cancellation = (*(threading.Event() for _ in range(3)), rangeedge.Cancellation())

    def step():
        started.set()
        go_on.wait(10)
        ended.set()

    call = _check.named("call")(lambda: apart(1 << 30, step))
    threading.Thread(target=lambda: (started.wait(10), cancellation.cancel())).start()
    with cancellation, pytest.raises(CancelledError):
        call()
    assert not ended.is_set()
    go_on.set()
    assert ended.wait(10)
    for pixels in (1, 1 << 30):
        assert apart(pixels, divmod, 7, 2) == (3, 1)
        with pytest.raises(ZeroDivisionError):
            apart(pixels, divmod, 7, 0)


@pytest.mark.parametrize("wait", [0.02, 0.1])
def test_python_may_end_while_kernels_work(wait):
    program = f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
import numpy as np, rangeedge, threading, time
z = np.random.default_rng(0).normal(1, .1, (2000, 2000))
for _ in range(2):
    threading.Thread(target=lambda: rangeedge.detectEdges(z, noise=1e-4), daemon=True).start()
time.sleep({wait})
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert (run.returncode, run.stderr) == (0, "")


def test_python_may_end_while_one_kernel_follows_the_other():
    # Of a function that calls nothing of OpenCV, whose own functions abort the process then.
    program = f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
import numpy as np, rangeedge, threading, time
z = np.random.default_rng(0).normal(1, .1, (300, 300))
labels = (4 * z).astype(np.int32)
def work():
    while True:
        rangeedge.regionBoundaries(labels)
for _ in range(4):
    threading.Thread(target=work, daemon=True).start()
time.sleep(0.3)
"""
    for _ in range(3):
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
        assert (run.returncode, run.stderr) == (0, "")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_fork_ends_though_other_threads_were_waiting_for_the_lock():
    program = f"""
import sys; sys.path.insert(0, {str(ROOT)!r})
import numpy as np, os, rangeedge, signal, threading, time
z = np.random.default_rng(0).normal(1, .1, (60, 80))
def work():
    while True:
        rangeedge.edgeStrength(z, noise=0.1)
for _ in range(4):
    threading.Thread(target=work, daemon=True).start()
time.sleep(0.3)
for _ in range(20):
    child = os.fork()
    if not child:
        signal.alarm(10)
        sys.exit()
    assert os.waitpid(child, 0)[1] == 0
"""
    subprocess.run([sys.executable, "-W", "ignore", "-c", program], check=True, timeout=60)


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
@pytest.mark.parametrize("jobs", [1, 2])
def test_an_interrupted_batch_ends_and_leaves_nothing(tmp_path, jobs):
    for k in range(4):
        np.save(tmp_path / f"{k}.npy", noise(1200))
    command = [sys.executable, "-m", "rangeedge", "batch", str(tmp_path), "--out", str(tmp_path / "out")]
    command += ["--pixel-size", "1", "--noise", "1e-4", "--jobs", str(jobs)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT, env=environment) as run:
        manifest = tmp_path / "out" / "manifest.jsonl"
        while not manifest.exists() and run.poll() is None:
            time.sleep(0.05)
        time.sleep(0.7)
        run.send_signal(signal.SIGINT)
        began = time.monotonic()
        said = run.communicate()[1]
        assert run.returncode == 130, said
        assert time.monotonic() - began < 25 * SOON  # the end of Python takes a while, too
    assert not list(tmp_path.rglob("*.tmp"))
