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
from contextlib import contextmanager
from multiprocessing import connection
from typing import Any, NamedTuple

import cv2

from .. import _core
from .._check import error

_PATIENCE = 0.05  # seconds between questions whether the wait is given up
_GRACE = 0.1  # seconds in which a worker may tidy up
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
        with _at_work():
            return Outcome(call(task), "", time.perf_counter() - start)
    except CancelledError:
        raise
    except _Ended:
        os._exit(1)
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
    pool = _Pool(jobs)
    waiting: deque[tuple[Any, Future[Outcome]]] = deque()
    tasks = iter(tasks)
    try:
        while True:
            while len(waiting) < _AHEAD * jobs and (task := next(tasks, waiting)) is not waiting:
                waiting.append((task, _submitted(pool, call, task)))
            if not waiting:
                return
            task, future = waiting.popleft()
            try:
                outcome = _awaited(future)
            except BrokenProcessPool:
                if pool.unguarded():
                    raise error(
                        f"`jobs` = {jobs} starts processes that run the program up to here themselves: put what it does"
                        " under if __name__ == '__main__':"
                    ) from None
                pool.end()
                suspects = [(task, future), *waiting]
                waiting.clear()
                yield from (_alone(call, *suspect) for suspect in suspects)
                pool = _Pool(jobs)
            else:
                yield outcome
    finally:
        pool.end()


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
    pool = _Pool(1)
    try:
        return _awaited(pool.submit(attempt, call, task))
    except BrokenProcessPool:
        return Outcome(None, "the worker process was killed, twice", time.perf_counter() - start)
    finally:
        pool.end()


class _Pool(ProcessPoolExecutor):
    """Workers that are made by a server: a copy of a process with threads, as OpenCV starts them, may hang.

    Windows has no such server: there each begins anew.
    """

    def __init__(self, jobs: int) -> None:
        served = "forkserver" in multiprocessing.get_all_start_methods()
        context = multiprocessing.get_context("forkserver" if served else "spawn")
        if served:
            context.set_forkserver_preload([__name__, "rangeedge.app.results"])
        else:
            jobs = min(jobs, _MOST_ON_WINDOWS)
        threads = max(1, (os.cpu_count() or 1) // jobs)
        super().__init__(jobs, context, _begin, (threads,))
        self._workers = self._processes

    def unguarded(self) -> bool:
        """Whether it broke because a worker was about to run the whole program again."""
        self.shutdown(cancel_futures=True)
        return any(worker.exitcode == _UNGUARDED for worker in self._workers.values())

    def end(self) -> None:
        """Idle workers end, and those at work give it up; whoever is in the midst of a long step is killed."""
        self.shutdown(wait=False, cancel_futures=True)
        alive = {worker.sentinel: worker for worker in list(self._workers.values())}
        for worker in alive.values():
            worker.terminate()
        end = time.monotonic() + _GRACE
        while alive and (ended := connection.wait(list(alive), max(end - time.monotonic(), 0))):
            for sentinel in ended:
                del alive[sentinel]
        for worker in alive.values():
            worker.kill()


class _Ended(BaseException):
    """The end of a worker that is at work, which tidies up on the way."""


_working = False


@contextmanager
def _at_work() -> Iterator[None]:
    global _working
    _working = True
    try:
        yield
    finally:
        _working = False


def _end(*_: Any) -> None:
    if _working:
        raise _Ended
    os._exit(1)


def _begin(threads: int) -> None:
    """Of a worker: an interrupt is the business of the process that waits for it, and so is its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end)
    cv2.setNumThreads(threads)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
