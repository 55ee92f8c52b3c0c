"""A job on every frame, with a manifest: those done already left alone, and each done whole or not at all."""

from __future__ import annotations

import functools
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .. import __version__
from .._check import error
from ..frames import outcomes_of
from ..io import RangeImage
from ..plausible import collected
from ..recording import FrameSource
from ..recording.manifest import Line, Manifest, changed, complete
from ..recording.workers import expect_guard
from .results import plain
from .tasks import Counts

if TYPE_CHECKING:
    from ..recording.workers import Outcome

_STAGE = re.compile(r"\.[0-9a-f]{32}\.tmp")  # what a run that was killed may leave behind


class BatchItem(NamedTuple):
    """What became of one frame."""

    path: str
    folder: str
    state: str  # "written", "skipped" or "failed"
    message: str  # of the error, or empty
    warnings: tuple[str, ...] = ()  # of a frame that was written


@dataclass(frozen=True)
class Job:
    """What is done with each frame, by a call with its index and itself in the process that does it.

    `options` are those of the function; `told` is what else a result depends on.
    """

    out: Path
    options: dict[str, Any]
    told: dict[str, Any]

    def __call__(self, task: tuple[int, FrameSource]) -> tuple[dict[str, int], Counts]:
        """Do it: the files written with their sizes, and what was found."""
        raise NotImplementedError

    def prepare(self, frames: list[FrameSource], fresh: bool) -> None:
        """Make room for the results, `fresh` where there are none to be kept."""

    def place(self, frame: FrameSource) -> Path:
        """Where its results are."""
        return self.out

    def parameters(self, frame: FrameSource) -> dict[str, Any]:
        """All that its results depend on but its pixels."""
        known = RangeImage(np.empty(0), dict(frame.geometry)).withGeometry(**self.options).geometry
        parameters: dict[str, Any] = plain({**known, **self.told})
        return parameters

    def is_done(self, index: int, frame: FrameSource, lines: Mapping[str, Line]) -> bool:
        """Whether its line in the manifest still holds."""
        line = lines.get(frame.name)
        return (
            line is not None
            and line.get("state") == "written"
            and line.get("rangeedge") == __version__
            and (line.get("input"), line.get("part")) == (frame.path, frame.part)
            and line.get("modified") == changed(frame.path)
            and line.get("parameters") == self.parameters(frame)
            and complete(self.out, line)
        )


def _warned(job: Job, task: tuple[int, FrameSource]) -> tuple[dict[str, int], Counts, tuple[str, ...]]:
    """A frame, with what there is to be warned of."""
    with collected() as warnings:
        outputs, counts = job(task)
    return outputs, counts, tuple(dict.fromkeys(warnings))


def run_frames(
    job: Job, frames: list[FrameSource], manifest: Manifest, force: bool, **workers: Any
) -> Iterator[BatchItem]:
    """What becomes of each frame, in their order, each when it and those before it are done."""
    expect_guard(workers.get("jobs", 1))
    _expect_apart(job, frames)
    with manifest.opened():
        _sweep(job.out)
        done = set() if force else {f.name for i, f in enumerate(frames) if job.is_done(i, f, manifest.lines)}
        manifest.keep(done)
        job.prepare(frames, fresh=not done)
        pending = [(index, frame) for index, frame in enumerate(frames) if frame.name not in done]
        modified = {frame.path: changed(frame.path) for _, frame in pending}
        outcomes: Any = outcomes_of(functools.partial(_warned, job), pending, **workers)
        try:
            yield from _items(job, frames, manifest, done, modified, outcomes)
        except BaseException:
            outcomes.close()
            if workers.get("client") is None:  # whose workers may still be writing
                _sweep(job.out)
            raise


def _items(
    job: Job,
    frames: list[FrameSource],
    manifest: Manifest,
    done: set[str],
    modified: dict[str, Any],
    outcomes: Iterator[Outcome],
) -> Iterator[BatchItem]:
    """What becomes of each frame, noted down before it is told."""
    for index, frame in enumerate(frames):
        where = str(job.place(frame))
        if frame.name in done:
            yield BatchItem(frame.title, where, "skipped", "")
            continue
        outcome = next(outcomes)
        outputs, counts, warnings = outcome.value or ({}, {}, ())
        line: Line = {
            "frame": frame.name,
            "input": frame.path,
            "part": frame.part,
            "index": index,
            "state": "failed" if outcome.error else "written",
            "outputs": outputs,
            "counts": counts,
            "seconds": round(outcome.seconds, 4),
            "parameters": job.parameters(frame),
            "modified": modified[frame.path],
            "rangeedge": __version__,
        }
        said = {"error": outcome.error, "warnings": list(warnings)}
        manifest.append(line | {name: value for name, value in said.items() if value})
        yield BatchItem(frame.title, where, line["state"], outcome.error, warnings)
        if outcome.full:
            raise error(f"nothing more can be written to {str(job.out)!r}; make room, and run it again")


def _expect_apart(job: Job, frames: list[FrameSource]) -> None:
    """Refuse to write over what is read."""
    inputs = {os.path.realpath(frame.path): frame.path for frame in frames}
    for frame in frames:
        place = os.path.realpath(job.place(frame))
        if place in inputs:
            raise error(f"results would replace the input {inputs[place]!r}; give another `out`")


def _sweep(out: Path) -> None:
    """Remove what a killed run has left unfinished."""
    for folder, folders, files in os.walk(out):
        for name in filter(_STAGE.fullmatch, folders):
            shutil.rmtree(Path(folder, name), ignore_errors=True)
        for name in filter(_STAGE.fullmatch, files):
            Path(folder, name).unlink(missing_ok=True)
        folders[:] = [name for name in folders if not _STAGE.fullmatch(name)]
