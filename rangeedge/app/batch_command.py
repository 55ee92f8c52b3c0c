"""The command `rangeedge batch`: its arguments, its progress, and what it says at the end."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from .._check import error
from ..recording import framesOf
from ..recording.stores import FORMS
from .batch import runBatch
from .blocks import runBlocks
from .run import BatchItem
from .tasks import TASKS

BATCH_ARGUMENTS = {
    *("inputs", "task", "form", "jobs", "dask", "perTask", "resume", "force", "topics", "blocks", "overlap"),
}

_INPUTS = """Any number of: range images as for `detect`; folders of such; patterns ("frames/*.png");
NPY, NPZ or Zarr of shape (N, H, W); TIFF of many pages; sequences of the TUM RGB-D benchmark (folders with depth.txt);
with the extra [bags] ROS bags and MCAP files with depth images or organized clouds."""


def add_batch_arguments(parser: argparse.ArgumentParser) -> None:
    """All but the options that `detect`, `segment` and `lines` have as well."""
    parser.add_argument("inputs", metavar="INPUT", nargs="+", help=_INPUTS)
    parser.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="DIR|STORE",
        help="made where it is missing: a folder, or a Zarr store, whose name ends with .zarr (extra [zarr])",
    )
    own = parser.add_argument_group("what is done, and by whom")
    own.add_argument("--task", choices=list(TASKS), default="detect", help="as that command does (default: detect)")
    own.add_argument(
        "--form",
        choices=FORMS,
        default=None,
        help="what is written a frame: a folder as by the command; the arrays as npz; edges or labels as png; chunks of"
        " a Zarr store (default: folder, or zarr where STORE is one)",
    )
    own.add_argument(
        "--blocks",
        type=int,
        default=None,
        metavar="N",
        help="do one INPUT, larger than memory (TIFF; NPY or Zarr of shape (H, W)), in blocks of N pixels; in DIR they"
        " become GeoTIFFs",
    )
    own.add_argument("--overlap", type=int, default=256, metavar="N", help="pixels around a block (default: 256)")
    own.add_argument("--topic", action="append", default=[], dest="topics", help="of a bag (default: all with depths)")
    own.add_argument("--jobs", type=int, default=1, metavar="N", help="frames worked on at a time (default: 1)")
    own.add_argument(
        "--dask",
        default=None,
        metavar="ADDRESS",
        help="let Dask do it (extra [dask]): tcp://HOST:PORT or scheduler.json of a scheduler, or local, with --jobs"
        " workers",
    )
    own.add_argument("--per-task", type=int, default=1, metavar="N", dest="perTask", help="frames a task of Dask's")
    own.add_argument("--resume", action="store_true", default=False, help="refuse to begin where nothing was begun")
    own.add_argument("--force", action="store_true", default=False, help="process frames again that are done already")


def run_batch(args: argparse.Namespace, options: dict[str, Any]) -> int:
    """The exit code: 0 all done, 1 some frames failed, 130 interrupted."""
    if args.dask is None:
        return _run(args, options, None)
    from ..recording.cluster import connect

    with connect(args.dask, args.jobs) as client:
        try:
            return _run(args, options, client)
        finally:
            if args.dask == "local":
                client.cluster.close()


def _run(args: argparse.Namespace, options: dict[str, Any], client: Any) -> int:
    told = {"jobs": args.jobs, "client": client, "force": args.force, "resume": args.resume, **options}
    if args.blocks is not None:
        if len(args.inputs) != 1:
            raise error(f"--blocks does one INPUT, not {len(args.inputs)}")
        size = {"blockSize": args.blocks, "overlap": args.overlap}
        items, total = runBlocks(args.inputs[0], args.out, args.task, **size, **told), None
    else:
        frames = framesOf(args.inputs, topics=args.topics, calibration=options.get("calibration"))
        items, total = runBatch(frames, args.out, args.task, form=args.form, batch=args.perTask, **told), len(frames)
    counts: Counter[str] = Counter()
    failed: list[BatchItem] = []
    try:
        for item in _with_progress(items, total):
            counts[item.state] += 1
            if item.state == "failed":
                failed.append(item)
    except BaseException as reason:
        if isinstance(reason, (KeyboardInterrupt, ValueError)):
            whole = "" if total is None else f" of {total} frames"
            print(f"stopped: {_summary(counts)}{whole}; run the same again to go on", file=sys.stderr)
        raise
    print(_summary(counts))
    for item in failed:
        print(f"{item.path}: {item.message}", file=sys.stderr)
    return 1 if failed else 0


def _summary(counts: Counter[str]) -> str:
    return ", ".join(f"{counts[state]} {state}" for state in ("written", "skipped", "failed"))


def _with_progress(items: Iterable[BatchItem], total: int | None) -> Iterator[BatchItem]:
    """A bar with rate and remaining time where a person looks on; else a line a frame."""
    if sys.stderr.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            yield from tqdm(items, total=total, unit="frame", file=sys.stderr)
            return
    for item in items:
        print(f"{item.state:8s}{item.path}", flush=True)
        yield item
