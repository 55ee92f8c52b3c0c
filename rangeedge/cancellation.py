"""Calls that are given up before they are done."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any, ParamSpec, TypeVar

from . import _core

_LARGE = 1 << 20  # pixels, from which on a step is worth a thread
_PATIENCE = 0.05  # seconds between two steps of who waits
_P = ParamSpec("_P")
_R = TypeVar("_R")


def apart(pixels: int, function: Callable[_P, _R], *args: _P.args, **options: _P.kwargs) -> _R:
    """What a function of another library returns, which for so many pixels may take long in one step.

    Of many it works on a thread of its own, and the call that waits for it can be given up: then the thread goes on
    until the step is done, and what comes of it is dropped. Python waits for it at its end.
    """
    if pixels < _LARGE:
        return function(*args, **options)
    future: Future[_R] = Future()

    def work() -> None:
        try:
            future.set_result(function(*args, **options))
        except BaseException as problem:
            future.set_exception(problem)

    threading.Thread(target=work).start()
    while not wait([future], _PATIENCE).done:
        pass
    return future.result()


class Cancellation:
    """Gives up calls when another thread says so.

    Calls within the ``with`` block of a cancellation, in the thread that has entered it, raise
    ``concurrent.futures.CancelledError`` soon after `cancel` was called on any thread: within some 0.1 s, between two
    steps of Python or within a kernel. What else stands in the block goes on. Once cancelled it stays so. Blocks may be
    nested; each of them counts. Frames of `mapFrames` and `rangeedge.batch.runBatch` count as well, also where other
    processes work on them, which end.

    Ctrl-C needs none of this: it ends a call in Python's main thread as soon, by ``KeyboardInterrupt``. Either way no
    file is left behind, no lock is held, and an array given as `dst` is as it was or holds the whole result.

    Examples
    --------
    >>> import numpy as np, rangeedge, threading
    >>> from concurrent.futures import CancelledError
    >>> noise = np.random.default_rng(0).normal(size=(1500, 1500))
    >>> cancellation = rangeedge.Cancellation()
    >>> threading.Timer(0.05, cancellation.cancel).start()
    >>> with cancellation:
    ...     try:
    ...         edges = rangeedge.detectEdges(noise, noise=1e-3)
    ...     except CancelledError:
    ...         print("took too long")
    took too long
    """

    def __init__(self) -> None:
        self._flag = _core.Cancellation()

    def cancel(self) -> None:
        """Give up the calls within the block, on whatever thread it is."""
        self._flag.set()

    @property
    def cancelled(self) -> bool:
        """Whether `cancel` was called."""
        return self._flag.is_set()

    def __enter__(self) -> Cancellation:
        self._flag.__enter__()
        return self

    def __exit__(self, *raised: Any) -> None:
        self._flag.__exit__()
