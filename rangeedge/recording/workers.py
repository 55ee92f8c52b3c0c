"""The same function on many tasks, in this process or in a few of this machine: `concurrent.futures` does the work.

Results come in the order of the tasks, and few of these are in flight, so that memory stays flat. A task that raises
is an outcome as any other. Where a worker dies, nobody knows by which of the tasks in flight: each of them is run again
alone, and the one that kills its worker once more has failed.
"""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, NamedTuple

import cv2

from .. import _core
from .._check import error

_PATIENCE = 0.05  # seconds between questions whether the wait is given up
_AHEAD = 3  # tasks a worker that are in flight: one at work, one waiting, one whose result waits for those before
_MOST_ON_WINDOWS = 61  # processes that can be waited for together
_UNGUARDED = 73  # exit code of a worker that was about to run the whole program again
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}


class Outcome(NamedTuple):
    """What became of a task: the value of the function, or what went wrong."""

    value: Any
    error: str
    seconds: float
    full: bool = False  # whether nothing more can be written


def attempt(call: Callable[[Any], Any], task: Any) -> Outcome:
    """The function on one task, whatever it raises."""
    start = time.perf_counter()
    try:
        return Outcome(call(task), "", time.perf_counter() - start)
    except CancelledError:
        raise
    except Exception as problem:  # the other tasks go on
        message = problem.msg if isinstance(problem, cv2.error) else f"{type(problem).__name__}: {problem}"
        return Outcome(None, message, time.perf_counter() - start, _is_full(problem))


def _is_full(problem: BaseException | None) -> bool:
    """Whether the disk is full, or may not be written any more."""
    while problem is not None:
        if isinstance(problem, OSError) and problem.errno in _FULL:
            return True
        problem = problem.__cause__
    return False


def expect_guard(jobs: int) -> None:
    """Of a worker that runs the program itself as it begins: end, and leave it to its parent to say why."""
    if jobs > 1 and getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(_UNGUARDED)


def run_here(call: Callable[[Any], Any], tasks: Iterable[Any]) -> Iterator[Outcome]:
    """One task after the other, in this process."""
    return (attempt(call, task) for task in tasks)


def run_local(call: Callable[[Any], Any], tasks: Iterable[Any], jobs: int) -> Iterator[Outcome]:
    """That many tasks at a time, each in a process of its own; outcomes in the order of the tasks."""
    pool = _pool(jobs)
    waiting: deque[tuple[Any, Future[Outcome]]] = deque()
    tasks, workers = iter(tasks), {}
    try:
        while True:
            while len(waiting) < _AHEAD * jobs and (task := next(tasks, waiting)) is not waiting:
                waiting.append((task, _submitted(pool, call, task)))
                workers.update(pool._processes or {})
            if not waiting:
                return
            task, future = waiting.popleft()
            try:
                outcome = _awaited(future)
            except BrokenProcessPool:
                pool.shutdown(cancel_futures=True)
                if any(worker.exitcode == _UNGUARDED for worker in workers.values()):
                    raise error(
                        f"`jobs` = {jobs} starts processes that run the program up to here themselves: put what it does"
                        " under if __name__ == '__main__':"
                    ) from None
                suspects = [(task, future), *waiting]
                waiting.clear()
                yield from (_alone(call, *suspect) for suspect in suspects)
                pool = _pool(jobs)
            else:
                yield outcome
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _submitted(pool: ProcessPoolExecutor, call: Callable[[Any], Any], task: Any) -> Future[Outcome]:
    try:
        return pool.submit(attempt, call, task)
    except BrokenProcessPool as broken:  # since the last result
        future: Future[Outcome] = Future()
        future.set_exception(broken)
        return future


def _awaited(future: Future[Outcome]) -> Outcome:
    """The result, unless the wait for it is given up."""
    while not wait([future], _PATIENCE).done:
        _core.checkpoint()
    return future.result()


def _alone(call: Callable[[Any], Any], task: Any, future: Future[Outcome]) -> Outcome:
    """The outcome that a task had when its pool broke, or else has in a pool of its own."""
    if future.done() and not future.cancelled() and future.exception() is None:
        return future.result()
    start = time.perf_counter()
    pool = _pool(1)
    try:
        return _awaited(pool.submit(attempt, call, task))
    except BrokenProcessPool:
        return Outcome(None, "the worker process was killed, twice", time.perf_counter() - start)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _pool(jobs: int) -> ProcessPoolExecutor:
    """Workers that are made by a server: a copy of a process with threads, as OpenCV starts them, may hang.

    Windows has no such server: there each begins anew.
    """
    served = "forkserver" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("forkserver" if served else "spawn")
    if served:
        context.set_forkserver_preload([__name__, "rangeedge.app.results"])
    else:
        jobs = min(jobs, _MOST_ON_WINDOWS)
    threads = max(1, (os.cpu_count() or 1) // jobs)
    return ProcessPoolExecutor(jobs, context, _begin, (threads,))


def _begin(threads: int) -> None:
    """Of a worker: an interrupt is the business of the process that waits for it, and so is its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(threads)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
