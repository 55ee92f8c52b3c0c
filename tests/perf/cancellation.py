"""How long every function goes on once it is given up: by Ctrl-C, and by `Cancellation` from another thread.

    python tests/perf/cancellation.py                      # 4000 x 4000 pixels
    python tests/perf/cancellation.py --only draw --places
    python tests/perf/cancellation.py --only draw --tries 10

A call is given up between two steps of Python, or at a checkpoint of a kernel: so the longest stretch between two of
these is the longest delay. Of a stretch counts what is less, wall time or processor time of the process, as other
programs may run.
`--tries` gives up so many calls of each kind at moments chosen by chance instead. For Linux.
"""

from __future__ import annotations

import argparse
import gc
import os
import random
import signal
import statistics
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from concurrent.futures import CancelledError
from pathlib import Path
from types import FrameType
from typing import Any

import material

import rangeedge

PACKAGE = str(Path(rangeedge.__file__).parent)
TICK = 0.004  # seconds
SHOWN = 0.06  # seconds of a stretch whose place is told


class Stretches:
    """The stretches of a call between places at which it can be given up, by the place at their end."""

    def __init__(self) -> None:
        self.longest: dict[str, float] = {}
        self._since = self._now()

    def restart(self) -> None:
        self._since = self._now()

    def end(self, frame: FrameType | None) -> None:
        now = self._now()
        length = min(b - a for a, b in zip(self._since, now, strict=True))
        self._since = now
        if length > 0.5 * SHOWN:
            place = _place(frame)
            self.longest[place] = max(length, self.longest.get(place, 0.0))

    @staticmethod
    def _now() -> tuple[float, float]:
        return time.perf_counter(), time.process_time()

    def __str__(self) -> str:
        return f"{1000 * max(self.longest.values(), default=0.0):6.0f} ms"

    def places(self) -> list[str]:
        ordered = sorted(self.longest.items(), key=lambda item: -item[1])
        return [f"{1000 * length:6.0f} ms {place}" for place, length in ordered if length > SHOWN]


def _place(frame: FrameType | None) -> str:
    while frame is not None and not frame.f_code.co_filename.startswith(PACKAGE):
        frame = frame.f_back
    if frame is None:
        return "outside"
    return f"{frame.f_code.co_filename[len(PACKAGE) + 1 :]}:{frame.f_lineno} {frame.f_code.co_name}"


def measure(name: str, call: Callable[[], Any], places: bool) -> None:
    stretches = Stretches()
    before = signal.signal(signal.SIGALRM, lambda _, frame: stretches.end(frame))
    start = time.perf_counter()
    stretches.restart()
    signal.setitimer(signal.ITIMER_REAL, TICK, TICK)
    try:
        call()
        stretches.end(sys._getframe())
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    print(f"{name:44} {time.perf_counter() - start:7.2f} s  longest stretch {stretches}", flush=True)
    if places:
        print("".join(f"    {line}\n" for line in stretches.places()), end="", flush=True)


def give_up(name: str, call: Callable[[], Any], tries: int) -> None:
    """Delays of calls that are given up by chance, at any moment of the time that one takes."""
    start = time.perf_counter()
    call()
    took = time.perf_counter() - start
    chance = random.Random(name)
    delays = {}
    for kind in ("Ctrl-C", "Cancellation"):
        waits = [_delay(call, kind, chance.uniform(0, took)) for _ in range(tries)]
        waits = [wait for wait in waits if wait is not None]
        delays[kind] = f"{kind} " + (
            f"{1000 * max(waits):6.0f} ms, median {1000 * statistics.median(waits):4.0f}" if waits else "none"
        )
    print(f"{name:42} {took:7.2f} s  {delays['Ctrl-C']}  {delays['Cancellation']}", flush=True)


def _delay(call: Callable[[], Any], kind: str, after: float) -> float | None:
    """Seconds until a call that is given up has returned; None where it was done before."""
    said: list[float] = []
    cancellation = rangeedge.Cancellation()

    def say() -> None:
        said.append(time.perf_counter())
        if kind == "Ctrl-C":
            os.kill(os.getpid(), signal.SIGINT)
        else:
            cancellation.cancel()

    timer = threading.Timer(after, say)
    try:
        timer.start()
        with cancellation:
            call()
        timer.cancel()
        timer.join()
        time.sleep(0.01)  # let a late one come
    except (KeyboardInterrupt, CancelledError):
        return time.perf_counter() - said[0]
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=4000, help="of the image, in pixels")
    parser.add_argument("--only", default="", metavar="PARTS", help="of names of functions, separated by commas")
    parser.add_argument("--places", action="store_true", help="tell where stretches are long")
    parser.add_argument("--tries", type=int, default=0, help="give up so many calls of each kind instead")
    parser.add_argument("--here", metavar="GROUP", help=argparse.SUPPRESS)
    options = parser.parse_args()
    wanted = options.only.split(",")
    if not options.here:
        for group in material.GROUPS:
            if any(any(part in f"{group}: {name}" for part in wanted) for name in material.calls(group, 64)):
                subprocess.run([sys.executable, __file__, "--here", group, *sys.argv[1:]], check=False)
        return
    warnings.simplefilter("ignore")
    for name, prepare in material.calls(options.here, options.side).items():
        title = f"{options.here}: {name}"
        if any(part in title for part in wanted):
            try:
                call = prepare()
                give_up(title, call, options.tries) if options.tries else measure(title, call, options.places)
            except (rangeedge.error, ValueError, MemoryError) as problem:
                print(f"{title:42} {problem}", flush=True)
            gc.collect()


if __name__ == "__main__":
    main()
