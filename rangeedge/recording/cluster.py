"""The same function on many tasks, by Dask: its scheduler, its queue, its retries.

A worker that dies is Dask's business, which runs its tasks elsewhere and after some deaths gives them up. Tasks are
lost with a scheduler that is started anew; they are handed to the new one once.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from .._check import error
from .source import extra
from .workers import Outcome, attempt

_AHEAD = 3  # tasks a thread of the workers that are in flight
_OFTEN = 5.0  # seconds, after which new workers are noticed
_PATIENCE = 60.0  # seconds that a scheduler may take to come back


def connect(address: str, jobs: int) -> Any:
    """A client of Dask: of the scheduler at an address or in a file of its, or of a `local` one with `jobs` workers."""
    distributed = extra("distributed", "dask", f"`dask` = {address!r}")
    if address == "local":
        one = {"distributed.nanny.pre-spawn-environ.OPENCV_FOR_THREADS_NUM": 1}  # of the threads that OpenCV starts
        with extra("dask", "dask", "a cluster").config.set(one):
            cluster = distributed.LocalCluster(n_workers=jobs, threads_per_worker=1, dashboard_address=None)
        return distributed.Client(cluster)
    try:
        if address.endswith(".json"):
            if not Path(address).is_file():
                raise OSError("there is no such file")
            return distributed.Client(scheduler_file=address)
        return distributed.Client(address, timeout=20)
    except (OSError, ValueError, TimeoutError) as reason:
        raise error(
            f"no scheduler of Dask at {address!r}: {reason}; give tcp://HOST:PORT, its scheduler.json, or local"
        ) from reason


def run_dask(call: Callable[[Any], Any], tasks: Iterable[Any], client: Any, batch: int = 1) -> Iterator[Outcome]:
    """Outcomes in the order of the tasks, of which `batch` are one task of Dask's."""
    tasks = iter(tasks)
    waiting: deque[tuple[list[Any], Any]] = deque()
    room, asked = 0, -np.inf
    while True:
        if time.monotonic() > asked + _OFTEN:
            room, asked = _in_flight(client), time.monotonic()
        while len(waiting) < room and (group := list(islice(tasks, batch))):
            waiting.append((group, _submitted(client, call, group)))
        if not waiting:
            return
        group, future = waiting.popleft()
        outcomes = _result(client, group, future)
        if outcomes is None:  # the scheduler has been lost, and all of these with it
            lost = [group, *(group for group, _ in waiting)]
            _await_scheduler(client)
            waiting = deque((group, _submitted(client, call, group)) for group in lost)
            group, future = waiting.popleft()
            outcomes = _result(client, group, future)
        if outcomes is None:
            outcomes = [Outcome(None, "the scheduler of Dask was lost, twice", 0.0)] * len(group)
        yield from outcomes


def _in_flight(client: Any) -> int:
    threads = sum(client.nthreads().values()) if client.status == "running" else 0
    return _AHEAD * max(1, threads)


def _submitted(client: Any, call: Callable[[Any], Any], group: list[Any]) -> Any:
    return client.submit(attempt_each, call, group, pure=False)


def attempt_each(call: Callable[[Any], Any], group: list[Any]) -> list[Outcome]:
    return [attempt(call, task) for task in group]


def _result(client: Any, group: list[Any], future: Any) -> list[Outcome] | None:
    """The outcomes of a group, failed ones if Dask has given it up; None if it was lost with its scheduler."""
    from concurrent.futures import CancelledError

    start = time.perf_counter()
    try:
        outcomes: list[Outcome] = future.result()
        return outcomes
    except (CancelledError, OSError, TimeoutError):  # among them distributed's own, which derive from these
        return None
    except Exception as problem:
        message = f"{type(problem).__name__}: {problem}"
        return [Outcome(None, message, (time.perf_counter() - start) / len(group))] * len(group)


def _await_scheduler(client: Any) -> None:
    """Waits for the client to find a scheduler again, and that for workers."""
    try:
        deadline = time.monotonic() + _PATIENCE
        while client.status != "running":
            if client.status == "closed" or time.monotonic() > deadline:
                raise TimeoutError(f"none for {_PATIENCE:.0f} s")
            time.sleep(0.1)
        client.wait_for_workers(1, timeout=max(1.0, deadline - time.monotonic()))
    except (TimeoutError, OSError) as reason:
        raise error(f"the scheduler of Dask is gone ({reason})") from None
