"""The command `rangeedge batch`: its arguments, its progress, and what it says at the end."""

from __future__ import annotations

import argparse
import functools
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from .._check import error
from ..recording import framesOf
from ..recording.stores import FORMS
from .batch import runBatch
from .blocks import runBlocks
from .flags import place, reader
from .run import BatchItem
from .tasks import TASKS
from .understood import warning_in_flags

BATCH_ARGUMENTS = {
    *("inputs", "task", "form", "jobs", "dask", "perTask", "resume", "force", "topics", "blocks", "overlap"),
    "jumpCut",
}

_NAMED = 3  # frames of a kind of failure or warning
_OPTIONS = {name for task in TASKS.values() for name in task.options}
_FLAGS = {"blockSize": "--blocks", "batch": "--per-task", "topics": "--topic", "inputs": "INPUT", "out": "--out"}
_ORIGIN = re.compile(r"^rangeedge: error: \(-?\d+\) (?:\w+: )?")
_NAMES_AND_NUMBERS = re.compile(r"'[^']*'|[-+.\d]+")

_INPUTS = """Any number of: range images as for `detect`; folders of such; patterns ("frames/*.png");
NPY, NPZ or Zarr of shape (N, H, W); TIFF of many pages; sequences of the TUM RGB-D benchmark (folders with depth.txt);
with the extra [bags] ROS bags and MCAP files with depth images or organized clouds."""


def add_batch_arguments(parser: argparse.ArgumentParser) -> None:
    """All but the options that `detect`, `segment` and `lines` have as well."""
    parser.add_argument("inputs", metavar="INPUT", nargs="+", help=_INPUTS)
    parser.add_argument(
        "--out",
        required=True,
        type=reader(place),
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
    own.add_argument("--overlap", type=int, default=None, metavar="N", help="pixels around a block (default: 256)")
    own.add_argument(
        "--jump-cut",
        type=float,
        default=None,
        metavar="X",
        dest="jumpCut",
        help="with --blocks, write distances by salience too; a jump of that length counts in full",
    )
    own.add_argument(
        "--topic",
        action="append",
        default=[],
        dest="topics",
        metavar="TOPIC",
        help="of a bag; may be given again (default: all with depths, one a camera)",
    )
    own.add_argument("--jobs", type=int, default=1, metavar="N", help="frames worked on at a time (default: 1)")
    own.add_argument(
        "--dask",
        default=None,
        metavar="ADDRESS",
        help="let Dask do it (extra [dask]): tcp://HOST:PORT or scheduler.json of a scheduler, or local, with --jobs"
        " workers",
    )
    own.add_argument(
        "--per-task",
        type=int,
        default=None,
        metavar="N",
        dest="perTask",
        help="frames a task of Dask's (default: 1); 16 where frames take milliseconds",
    )
    own.add_argument(
        "--resume",
        action="store_true",
        default=False,
        help="go on with what is there (as without), and refuse to begin anew",
    )
    own.add_argument("--force", action="store_true", default=False, help="process frames again that are done already")


def run_batch(args: argparse.Namespace, options: dict[str, Any], flag: Callable[[str], str]) -> int:
    """The exit code: 0 all done, 1 some frames failed, 130 interrupted. `flag` spells options."""
    words = functools.partial(_in_words, flag)
    try:
        _expect_partners(args)
        if args.dask is None:
            return _run(args, options, None, words)
        from ..recording.cluster import connect

        with connect(args.dask, args.jobs) as client:
            try:
                return _run(args, options, client, words)
            finally:
                if args.dask == "local":
                    client.cluster.close()
    except error as problem:
        raise error(words(problem.err), problem.code) from problem


def _expect_partners(args: argparse.Namespace) -> None:
    """Refuse what would have no effect."""
    for name, partner in (("overlap", "blocks"), ("jumpCut", "blocks"), ("perTask", "dask")):
        if getattr(args, name) is not None and getattr(args, partner) is None:
            raise error(f"`{name}` goes with `{partner}`, which is not given")
    if args.blocks is not None and args.form is not None:
        raise error("`form` does not go with `blocks`: they are written to a Zarr store, or as GeoTIFFs")


def _run(args: argparse.Namespace, options: dict[str, Any], client: Any, words: Callable[[str], str]) -> int:
    told = {"jobs": args.jobs, "client": client, "force": args.force, "resume": args.resume, **options}
    if args.blocks is not None:
        if len(args.inputs) != 1:
            raise error(f"`blocks` does one INPUT, not {len(args.inputs)}")
        size = {"blockSize": args.blocks} | ({} if args.overlap is None else {"overlap": args.overlap})
        items = runBlocks(args.inputs[0], args.out, args.task, jumpCut=args.jumpCut, **size, **told)
        total = None
    else:
        frames = framesOf(args.inputs, topics=args.topics, calibration=options.get("calibration"))
        told |= {} if args.perTask is None else {"batch": args.perTask}
        items, total = runBatch(frames, args.out, args.task, form=args.form, **told), len(frames)
    counts: Counter[str] = Counter()
    progress = _progress(items, total)
    failures, warnings = _Kinds("failed", progress.say), _Kinds("warning", progress.say)
    try:
        for item in progress:
            counts[item.state] += 1
            if item.state == "failed":
                failures.add(item.path, words(_ORIGIN.sub("", item.message)))
            for text in item.warnings:
                warnings.add(item.path, words(text))
    except BaseException as reason:
        if counts and isinstance(reason, (KeyboardInterrupt, ValueError)):
            whole = "" if total is None else f" of {total} frames"
            failures.tell_more()
            print(f"stopped: {_summary(counts)}{whole}; run the same again to go on", file=sys.stderr)
        raise
    print(_summary(counts), flush=True)
    warnings.tell_more()
    failures.tell_more()
    return 1 if counts["failed"] else 0


class _Kinds:
    """Messages on frames, of which the first of each kind is told: others differ in names and numbers alone."""

    def __init__(self, what: str, say: Callable[[str], None]) -> None:
        self._what, self._say = what, say
        self._found: dict[str, list[str]] = {}

    def add(self, title: str, text: str) -> None:
        alike = self._found.setdefault(_NAMES_AND_NUMBERS.sub("", text), [])
        alike.append(title)
        if len(alike) == 1:
            self._say(f"{self._what}: {text}" if title in text else f"{self._what}: {title}: {text}")

    def tell_more(self) -> None:
        """How many others there are, and which ones if they are few."""
        for first, *more in self._found.values():
            if more:
                names = ", ".join(more[:_NAMED]) + (", ..." if len(more) > _NAMED else "")
                self._say(f"{self._what}: as {first}: {len(more)} more, see the manifest: {names}")


def _in_words(flag: Callable[[str], str], text: str) -> str:
    """A message in the words of the command line."""

    def spelled(name: re.Match[str]) -> str:
        known = name[1] in BATCH_ARGUMENTS or name[1] in _OPTIONS
        return _FLAGS.get(name[1]) or (flag(name[1]) if known else name[0])

    return warning_in_flags(re.sub(r"`(\w+)`", spelled, text), flag)


def _summary(counts: Counter[str]) -> str:
    return ", ".join(f"{counts[state]} {state}" for state in ("written", "skipped", "failed"))


def _progress(items: Iterable[BatchItem], total: int | None) -> _Lines:
    """A bar with rate and remaining time where a person looks on; else a line a frame."""
    if sys.stderr.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            return _Bar(tqdm(items, total=total, unit="frame", file=sys.stderr, smoothing=0.05, dynamic_ncols=True))
    return _Lines(items)


class _Lines:
    """Frames, with a line each."""

    def __init__(self, items: Iterable[BatchItem]) -> None:
        self._items = items

    def __iter__(self) -> Iterator[BatchItem]:
        for item in self._items:
            print(f"{item.state:8s}{item.path}", flush=True)
            yield item

    def say(self, text: str) -> None:
        """Something else, while it goes on."""
        print(text, file=sys.stderr, flush=True)


class _Bar(_Lines):
    """Frames, with a bar of tqdm, above which all else is said."""

    def __iter__(self) -> Iterator[BatchItem]:
        return iter(self._items)

    def say(self, text: str) -> None:
        self._items.write(text, file=sys.stderr)  # type: ignore[attr-defined]
