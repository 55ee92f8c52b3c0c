"""Calls of every public function with arrays and options of all kinds: what comes is an answer or `rangeedge.error`.

    python tests/fuzz.py --minutes 60

calls every function for its share of the time, in other processes, and prints how many answers and errors
came, and one call for each place where the rules are broken; a build with sanitizers (CONTRIBUTING.md) finds more.
`pytest tests/test_fuzz.py` makes a few of the same calls.

Rules: no exception but `rangeedge.error`; no warning but `RangeEdgeWarning`; inputs as they were; the same answer, bit
for bit, from a second call with another number of threads and arguments by position; a `dst` that fits is returned,
even where it is an input, any other left alone; a process of at most 8 GiB, and calls that come back.

With `--writers` another thread writes into the arrays meanwhile: whatever comes of it, it comes.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import faulthandler
import functools
import inspect
import itertools
import multiprocessing
import os
import sys
import threading
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from fuzz_arguments import FUNCTIONS, calls, destination, seeded
from fuzz_files import READERS, contents, expect_reading
from hypothesis import HealthCheck, Phase, given, seed, settings

import rangeedge

BUNCH = 40  # calls, after which the time is looked at
LATE = 300  # seconds in which a bunch must come back
AT, BEGUN, FAILED = range(3)  # which function, which bunch, how many failures
SPAWN = multiprocessing.get_context("spawn")
MEMORY = 8 << 30  # bytes of a process, which sanitizers do not keep to
PACKAGE = str(Path(rangeedge.__file__).parent)
SPOILT = np.array([0, 1, -1, 3, 1e9, 2**31 - 1, -(2**31), 0.5, np.nan, np.inf, -np.inf])


def leaves(result: Any) -> list[Any]:
    if isinstance(result, rangeedge.error):
        return ["error"]  # of which the words may tell how an argument was given
    if isinstance(result, rangeedge.frames.FrameResult):
        result = result._replace(seconds=0.0)
    if isinstance(result, (tuple, list)):
        return [leaf for part in result for leaf in leaves(part)]
    if dataclasses.is_dataclass(result) and not isinstance(result, type):
        return [leaf for field in dataclasses.fields(result) for leaf in leaves(getattr(result, field.name))]
    return [result]


def frozen(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes() if value.dtype.kind != "O" else repr(value)
    return type(value) if callable(value) else repr(value)


@functools.cache
def kinds_of(name: str) -> dict[str, Any]:
    """The parameters of a function and how they are passed."""
    return {name: p.kind for name, p in inspect.signature(FUNCTIONS[name]).parameters.items()}


def called(name: str, given_values: dict[str, Any], *, by_position: bool = False) -> Any:
    """The answer; as many arguments as can be, or as must be, by position."""
    by_name, args = dict(given_values), []
    for parameter, kind in kinds_of(name).items():
        must = kind is inspect.Parameter.POSITIONAL_ONLY
        if parameter not in by_name or not (must or (by_position and kind is inspect.Parameter.POSITIONAL_OR_KEYWORD)):
            break
        args.append(by_name.pop(parameter))
    result = FUNCTIONS[name](*args, **by_name)
    return list(result) if isinstance(result, Iterator) else result


def outcome(name: str, given_values: dict[str, Any], threads: int, *, by_position: bool = False) -> Any:
    cv2.setNumThreads(threads)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", rangeedge.RangeEdgeWarning)
        try:
            return called(name, given_values, by_position=by_position)
        except rangeedge.error as problem:
            return problem


def expect_rules(name: str, given_values: dict[str, Any]) -> bool:
    """Makes a call twice and asserts that it keeps the rules; whether it is answered."""
    dst = given_values.get(destination(name))
    inputs = {k: v for k, v in given_values.items() if isinstance(v, np.ndarray) and k != destination(name)}
    in_place = isinstance(dst, np.ndarray) and any(np.may_share_memory(dst, v) for v in inputs.values())
    before = {k: frozen(v) for k, v in inputs.items()}
    old = frozen(dst)
    threads = cv2.getNumThreads()
    first_values = {k: v for k, v in given_values.items() if k != destination(name)} if in_place else given_values
    try:
        first = outcome(name, first_values, 1)
        kept = [frozen(leaf) for leaf in leaves(first)]
        if isinstance(dst, np.ndarray) and first is not dst:
            assert frozen(dst) == old, "a `dst` that is not returned was written"
        assert before == {k: frozen(v) for k, v in inputs.items()}, "an input was modified"
        second = outcome(name, given_values, 3, by_position=True)
    finally:
        cv2.setNumThreads(threads)
    refused_in_place = in_place and isinstance(second, rangeedge.error) and "read-only" in str(second)
    assert refused_in_place or kept == [frozen(leaf) for leaf in leaves(second)], "the answer changes"
    if second is not dst:
        assert before == {k: frozen(v) for k, v in inputs.items()}, "an input was modified"
    return not isinstance(first, rangeedge.error)


def expect_survival(name: str, given_values: dict[str, Any], start: int) -> bool:
    """Makes calls while another thread writes into their arrays; whether any is answered."""
    given_values = {
        k: np.array(v) if isinstance(v, np.ndarray) and v.dtype.kind in "buif" else v for k, v in given_values.items()
    }
    arrays = [v for v in given_values.values() if isinstance(v, np.ndarray) and v.size and v.dtype.kind in "buif"]
    done = threading.Event()

    def spoil() -> None:
        """Writes what no check lets pass, and at once what was there, so that checks pass now and then."""
        rng = np.random.default_rng(start)
        while arrays and not done.is_set():
            array = arrays[rng.integers(len(arrays))]
            where = rng.integers(0, array.size, rng.integers(1, 1 + array.size))
            before = array.flat[where]
            with np.errstate(all="ignore"):
                array.flat[where] = rng.choice(SPOILT).astype(array.dtype)
            array.flat[where[::-1]] = before[::-1]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        writer = threading.Thread(target=spoil)
        writer.start()
        answered = False
        try:
            for _ in range(8):
                with contextlib.suppress(Exception):  # of NumPy too, by what was checked before it was written
                    called(name, given_values)
                    answered = True
        finally:
            done.set()
            writer.join()
    return answered


def fuzz(
    name: str,
    examples: int,
    bunch: int | None = None,
    *,
    shrink: bool = False,
    writers: bool = False,
    seen: Counter[str] | None = None,
) -> None:
    """Makes that many calls of a function, those of a numbered bunch or always the same; counts what came of them."""

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=bunch is None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate, Phase.shrink] if shrink else [Phase.generate],
    )
    @given(contents(name) if name in READERS else seeded(name) if writers else calls(name))
    def run(drawn: Any) -> None:
        if name in READERS:
            answered = expect_reading(name, drawn)
        else:
            answered = expect_survival(name, *drawn) if writers else expect_rules(name, drawn)
        if seen is not None:
            seen["answers" if answered else "errors"] += 1

    (run if bunch is None else seed(bunch)(run))()


def place(problem: BaseException) -> str:
    """Where an exception came from: the last line of the package, and its type."""
    frames = [f for f in traceback.extract_tb(problem.__traceback__) if "hypothesis" not in f.filename]
    frames = [f for f in frames if PACKAGE in f.filename] or frames
    return f"{type(problem).__name__} at {frames[-1].filename}:{frames[-1].lineno}"


def fuzz_for(options: argparse.Namespace, name: str, progress: Any) -> None:
    """Calls a function until the time is up; prints one call for each place where one fails."""
    start, found, seen = time.monotonic(), set(), Counter()
    for bunch in itertools.count(options.bunch):
        if time.monotonic() > start + 60 * options.minutes / len(options.only) or sum(seen.values()) >= options.calls:
            break
        progress[BEGUN] = bunch
        faulthandler.dump_traceback_later(LATE, exit=True)
        try:
            fuzz(name, BUNCH, bunch, shrink=options.shrink, writers=options.writers, seen=seen)
        except Exception as problem:
            if place(problem) not in found:
                found.add(place(problem))
                print(f"{name}: {place(problem)}: {problem}", *getattr(problem, "__notes__", []), sep="\n", flush=True)
    faulthandler.cancel_dump_traceback_later()
    progress[FAILED] += len(found)
    print(
        f"{name:36} {seen['answers']:7} answers {seen['errors']:7} errors {time.monotonic() - start:6.0f} s"
        f" {len(found)} kinds of failures",
        flush=True,
    )


def fuzz_all(options: argparse.Namespace, progress: Any) -> None:
    """Calls one function after the other."""
    while progress[AT] < len(options.only):
        fuzz_for(options, options.only[progress[AT]], progress)
        progress[AT] += 1


def apart(options: argparse.Namespace, progress: Any) -> None:
    """The same in a process of its own, of limited memory where the system can."""
    if sys.platform == "linux" and "asan" not in os.environ.get("LD_PRELOAD", ""):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
    fuzz_all(options, progress)


def fuzz_apart(options: argparse.Namespace, progress: Any) -> None:
    """The same in other processes: where one dies, that is a failure, and the next function has a new one."""
    while progress[AT] < len(options.only):
        process = SPAWN.Process(target=apart, args=(options, progress))
        process.start()
        process.join()
        if process.exitcode:
            name, bunch = options.only[progress[AT]], progress[BEGUN]
            print(f"{name}: died, exit code {process.exitcode}; again by --here --only {name} --bunch {bunch}")
            progress[FAILED] += 1
            progress[AT] += 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--calls", type=int, default=2**62, help="end earlier, after so many of each function")
    parser.add_argument("--only", nargs="*", choices=[*FUNCTIONS, *READERS], metavar="NAME")
    parser.add_argument("--bunch", type=int, default=0, metavar="N", help="begin with this bunch of calls")
    parser.add_argument("--here", action="store_true", help="all in this process, which a crash ends")
    parser.add_argument("--writers", action="store_true", help="write into the arrays while calls run")
    parser.add_argument(
        "--shrink", action="store_true", help="make calls that fail as small as possible, which takes long"
    )
    parser.add_argument("--files", action="store_true", help="of readers, files that were changed")
    options = parser.parse_args()
    options.only = options.only or [*FUNCTIONS] * (not options.files) + [*READERS] * options.files
    progress = SPAWN.Array("q", 3)
    (fuzz_all if options.here else fuzz_apart)(options, progress)
    return int(progress[FAILED] > 0)


if __name__ == "__main__":
    sys.exit(main())
