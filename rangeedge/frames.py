"""A function on every frame of a recording: here, by processes of this machine, or by Dask on others."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._check import array, described, fail, integer, public
from .io import RangeImage, imreadRange
from .io.source import file_name

if TYPE_CHECKING:
    from .recording import FrameSource
    from .recording.workers import Outcome


class FrameResult(NamedTuple):
    """What became of one frame: what the function returned, or the error that stopped it."""

    frame: int
    value: Any
    error: str
    seconds: float


@public
def mapFrames(
    frames: np.ndarray | Iterable[np.ndarray | RangeImage | FrameSource | str | os.PathLike[str]],
    function: Callable[..., Any],
    client: Any = None,
    *,
    jobs: int = 1,
    batch: int = 1,
) -> Iterator[FrameResult]:
    """Call a function on every frame.

    mapFrames(frames, function[, client], *[, jobs[, batch]]) -> results

    A frame that fails does not stop the others. Few frames are in flight, and results that nobody takes are not waited
    for, so memory does not grow with the length of a recording.

    Parameters
    ----------
    frames : (N, H, W) or (N, H, W, 3) array of NumPy or dask.array, or iterable
        Of range images: arrays, `RangeImage`, file names as `imreadRange` takes them, or the frames that
        `rangeedge.batch.framesOf` lists, which are read where they are needed.
    function : callable
        Called as ``function(src, **geometry)`` with what the file or the recording knows, such as `detectEdges`, or
        ``functools.partial(detectEdges, creaseThreshold=20)``; what is given there replaces what the file knows.
        For other processes it must be one that `pickle` knows: of a module, no lambda.
    client : dask.distributed.Client, optional
        Whose workers do the work, with the extra ``[dask]``. They need rangeedge, and the files under the same names.
    jobs : int
        Processes of this machine, without `client`; 1 is this process itself. A program that calls with more than 1
        does so under ``if __name__ == "__main__":``, as for `concurrent.futures.ProcessPoolExecutor`.
    batch : int
        Frames that make one task of Dask's, which costs its scheduler some milliseconds.

    Returns
    -------
    results : iterator of FrameResult
        ``frame`` (its number), ``value``, ``error`` (empty where all went well) and ``seconds``; in the order of the
        frames, each as soon as it and those before it are done.

    Raises
    ------
    rangeedge.error
        On a bad argument, or if Dask's scheduler is gone for good. What goes wrong with a frame is in its result; a
        frame that kills its worker (lack of memory) is run once more alone and has then failed.

    Notes
    -----
    A function that takes one image becomes one for blocks (n, H, W) of ``dask.array.map_blocks`` by
    `rangeedge.batch.eachFrame`.

    Examples
    --------
    >>> import functools
    >>> import numpy as np
    >>> from rangeedge import detectEdges, mapFrames
    >>> stack = np.full((3, 48, 64), 2.0)
    >>> stack[:, 12:36, 16:48] = 1.5
    >>> results = mapFrames(stack, functools.partial(detectEdges, noise=0.001, pixelSize=0.01))
    >>> [(result.frame, int(np.count_nonzero(result.value))) for result in results]
    [(0, 104), (1, 104), (2, 104)]
    """
    if not callable(function):
        raise fail("function", "callable", described(function))
    jobs, batch = integer("jobs", jobs, 1), integer("batch", batch, 1)
    if client is not None and not hasattr(client, "submit"):
        raise fail("client", "a dask.distributed.Client or None", described(client))
    outcomes = outcomes_of(functools.partial(_on_frame, function), _each(frames), jobs=jobs, client=client, batch=batch)
    return (FrameResult(index, *outcome[:3]) for index, outcome in enumerate(outcomes))


def outcomes_of(
    call: Callable[[Any], Any], tasks: Iterable[Any], *, jobs: int = 1, client: Any = None, batch: int = 1
) -> Iterator[Outcome]:
    """A function on many tasks, by whom it is to be done."""
    if client is not None:
        from .recording.cluster import run_dask

        return run_dask(call, tasks, client, batch)
    from .recording.workers import expect_guard, run_here, run_local

    expect_guard(jobs)
    return run_here(call, tasks) if jobs == 1 else run_local(call, tasks, jobs)


def _each(frames: Any) -> Iterator[Any]:
    """The frames one by one; of an array of dask.array each is computed by itself when its turn comes."""
    if isinstance(frames, (str, bytes, os.PathLike)) or not isinstance(frames, (Iterable, np.ndarray)):
        raise fail("frames", "an array (N, H, W) or an iterable of range images", described(frames))
    if isinstance(frames, np.ndarray):
        frames = array("frames", frames, "an array of shape (N, H, W) or (N, H, W, 3)", (3, 4))
    if hasattr(frames, "dask"):
        return (np.asarray(frames[index]) for index in range(frames.shape[0]))
    return iter(frames)


def _on_frame(function: Callable[..., Any], frame: Any) -> Any:
    from .recording import FrameSource

    if isinstance(frame, FrameSource):
        frame = frame.read()
    elif isinstance(frame, (str, os.PathLike)):
        frame = imreadRange(file_name(frame))
    image = frame if isinstance(frame, RangeImage) else RangeImage(frame)
    given = getattr(function, "keywords", {})
    known = image.withGeometry(**given).geometry
    return function(image.src, **{name: value for name, value in known.items() if name not in given})


class eachFrame:
    """A function of one range image as one of blocks (n, H, W), for ``dask.array.map_blocks``.

    eachFrame(function, *[, option[, ...]]) -> function

    Parameters
    ----------
    function : callable
        Of an image (H, W), with a result of that shape, such as `detectEdges`.
    options
        Its keywords.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import detectEdges
    >>> from rangeedge.batch import eachFrame
    >>> stack = np.full((2, 48, 64), 2.0)
    >>> stack[:, 12:36, 16:48] = 1.5
    >>> edges = eachFrame(detectEdges, noise=0.001, pixelSize=0.01)  # array.map_blocks(edges, dtype=np.uint8)
    >>> edges(stack).shape
    (2, 48, 64)
    """

    def __init__(self, function: Callable[..., np.ndarray], **options: Any) -> None:
        self.function, self.options = function, options

    def __call__(self, block: np.ndarray) -> np.ndarray:
        return np.stack([self.function(np.ascontiguousarray(src), **self.options) for src in block])
