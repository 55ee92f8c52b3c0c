"""A recording by every way of working on it, and a reckoning for clusters: `python tests/perf/recordings.py`.

A loop without the package's batch, `--jobs 1`, `--jobs 2`, and Dask with two processes write the edges of the same
frames as PNG, each in a process of its own, OpenCV with one thread a worker. Measured are frames a second, processor
time of all processes together (which a busy machine changes little), time to the first result and memory while it
goes on; and every file is compared with the loop's. Then what a task costs its scheduler, by functions that do nothing.
From these follows what 1 to 100 machines can do together. Needs the extra [dask].
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import cv2
import distributed
import numpy as np
import psutil

from rangeedge import detectEdges
from rangeedge.batch import framesOf, runBatch
from rangeedge.recording.cluster import connect, run_dask
from rangeedge.recording.workers import run_local
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene

WAYS = ("loop", "jobs 1", "jobs 2", "dask 2")
SAMPLES = 10  # of the memory
MACHINES = (1, 2, 5, 10, 20, 50, 100)
CORES = 16  # of a machine
THREADS = 64  # of each worker, to measure what a task costs
NETWORK = 1.25e9  # bytes a second of what serves the frames: 10 Gbit/s


def record(path: Path, count: int) -> np.ndarray:
    """The built-in scene as a depth camera sees it, moving sideways, with ten draws of its noise."""
    scan = renderScene(demoScene(), kinectCamera())
    seen = [kinectNoise(scan, seed=seed) for seed in range(10)]
    rows, cols = seen[0].src.shape
    stack = np.lib.format.open_memmap(path, "w+", np.uint16, (count, rows, cols))
    for index in range(count):
        stack[index] = np.roll(seen[index % 10].src, index // 10 % 40, axis=1)
    return np.array(seen[0].geometry["K"])


def family() -> list[psutil.Process]:
    return [psutil.Process(), *psutil.Process().children(recursive=True)]


def memory() -> float:
    """MiB that this process and all below have for themselves."""
    known = [process.memory_info() for process in family()]
    return sum(one.rss - one.shared for one in known) / 2**20


def spent() -> float:
    """Seconds of processor time of the same."""
    return sum(sum(process.cpu_times()[:2]) for process in family())


def plain_loop(recording: Path, K: np.ndarray, out: Path) -> Any:
    out.mkdir(parents=True)
    for index, src in enumerate(np.load(recording, mmap_mode="r")):
        yield cv2.imwrite(str(out / f"{index:04d}.png"), detectEdges(np.array(src), K=K))


def batch(recording: Path, K: np.ndarray, out: Path, way: str, per_task: int) -> Any:
    told = {"form": "png", "K": K}
    name, count = way.split()
    frames = framesOf(recording)
    if name == "jobs":
        yield from runBatch(frames, out, jobs=int(count), **told)
        return
    with connect("local", int(count)) as client:
        yield from runBatch(frames, out, client=client, batch=per_task, **told)
        client.cluster.close()


def run(way: str, recording: Path, out: Path, per_task: int) -> dict[str, Any]:
    """One way over the whole recording."""
    cv2.setNumThreads(1)
    K = np.load(recording.with_suffix(".K.npy"))
    count = len(np.load(recording, mmap_mode="r"))
    before, start, seen, first = spent(), time.perf_counter(), [], 0.0
    items = plain_loop(recording, K, out) if way == "loop" else batch(recording, K, out, way, per_task)
    for index, item in enumerate(items):
        assert item is True or item.state == "written", item
        first = first or time.perf_counter() - start
        if index % (count // SAMPLES) == count // SAMPLES - 1:
            seen.append(round(memory()))
        if index == count - 1:
            wall, used = time.perf_counter() - start, spent() - before
    return {
        "way": way,
        "framesPerSecond": count / wall,
        "cpuMs": 1000 * used / count,
        "firstResult": first,
        "memoryMiB": seen,
        "load": os.getloadavg()[0],
    }


def pictures(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in out.rglob("*.png")}


def nothing(task: Any) -> None:
    """What costs only its way."""


def overheads(recording: Path, count: int = 2000) -> dict[str, float]:
    """Milliseconds of the processor that a frame costs who hands it out; of Dask both scheduler and client.

    Dask's workers have many threads, and so as many tasks are on their way as with many machines: messages then
    travel together.
    """
    tasks = list(enumerate(framesOf(recording))) * (1 + count // len(framesOf(recording)))
    found = {}
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=THREADS, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        list(run_dask(nothing, tasks[:20], client))
        for size in (1, 16):
            start = time.process_time()
            assert not any(outcome.error for outcome in run_dask(nothing, tasks[:count], client, size))
            found[f"dask {size}"] = 1000 * (time.process_time() - start) / count
    start = time.process_time()
    list(run_local(nothing, tasks[:count], 2))
    found["processes"] = 1000 * (time.process_time() - start) / count
    # a frame costs f + t / size in tasks of that many
    found["task"] = (found["dask 1"] - found["dask 16"]) / (1 - 1 / 16)
    found["frame"] = max(0.0, found["dask 1"] - found["task"])
    return found


def reckoned(cost: float, overhead: dict[str, float], read: float, written: float) -> list[dict[str, float]]:
    """Frames a second of many machines, by whatever gives out first: cores, scheduler, or what serves the frames."""
    rows = []
    for machines in MACHINES:
        row: dict[str, float] = {"machines": machines, "cores": 1000 * CORES * machines / cost}
        for size in (1, 16, 64):
            row[f"scheduler {size}"] = 1000 / (overhead["task"] / size + overhead["frame"])
        row["network"] = NETWORK / (read + written)
        rows.append(row)
    return rows


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=2000)
    arguments.add_argument("--per-task", type=int, default=8, help="frames a task of Dask's")
    arguments.add_argument("--ways", default=",".join(WAYS))
    arguments.add_argument("--out", type=Path, help="JSON")
    arguments.add_argument("--way", help=argparse.SUPPRESS)
    arguments.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    args = arguments.parse_args()
    if args.way:  # a process of its own
        found = run(args.way, args.folder / "walk.npy", args.folder / args.way.replace(" ", ""), args.per_task)
        print(json.dumps(found))
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        np.save(folder / "walk.K.npy", record(folder / "walk.npy", args.frames))
        found = []
        for way in args.ways.split(","):
            argv = [sys.executable, __file__, "--way", way, "--folder", str(folder), "--per-task", str(args.per_task)]
            done = subprocess.run(argv, check=True, capture_output=True, text=True)
            found.append(json.loads(done.stdout.splitlines()[-1]))
            print(
                "{way:8s}{framesPerSecond:7.1f} frames/s,{cpuMs:6.2f} ms of the processor a frame, first result after"
                " {firstResult:.2f} s, MiB {memoryMiB}, load {load:.1f}".format(**found[-1]),
                flush=True,
            )
        ours = [pictures(folder / entry["way"].replace(" ", "")) for entry in found]
        assert all(other == ours[0] and len(other) == args.frames for other in ours)
        print("all results are the same, byte for byte")
        overhead = overheads(folder / "walk.npy")
        print("\nms of the processor:", ", ".join(f"{name} {value:.3f}" for name, value in overhead.items()))
        read = (folder / "walk.npy").stat().st_size / args.frames
        written = sum(map(len, ours[0].values())) / args.frames
        cost = next(entry["cpuMs"] for entry in found if entry["way"] != "loop")
        rows = reckoned(cost, overhead, read, written)
        print(f"\nframes/s that {CORES} cores a machine, the scheduler and 10 Gbit/s allow")
        print("".join(f"{name:>14s}" for name in rows[0]))
        for row in rows:
            print("".join(f"{value:14.0f}" for value in row.values()))
        if args.out:
            args.out.write_text(json.dumps({"runs": found, "overhead": overhead, "reckoned": rows}, indent=2))


if __name__ == "__main__":
    main()
