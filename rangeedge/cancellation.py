"""Calls that are given up before they are done."""

from __future__ import annotations

from typing import Any

from . import _core


class Cancellation:
    """Gives up calls when another thread says so.

    Calls within the ``with`` block of a cancellation, in the thread that has entered it, raise
    ``concurrent.futures.CancelledError`` soon after `cancel` was called on any thread: within some 0.1 s, but for what
    other libraries do in one step (a file that is read, the skeletons of scikit-image). Once cancelled it stays so.
    Blocks may be nested; each of them counts. Frames of `mapFrames` and `rangeedge.batch.runBatch` count as well, also
    where other processes work on them: these end what they have begun, and no results come of it.

    Ctrl-C needs none of this: it ends a call in Python's main thread as soon, by ``KeyboardInterrupt``. Either way
    nothing is left behind, and an array given as `dst` is as it was.

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
