"""Many frames: each a line of the manifest and files of its own, those done already left alone."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._check import boolean, described, error, fail, integer
from .._option import parsed, takes
from ..io import RangeImage, imreadRange
from ..io.atomic import writing
from ..io.source import file_name
from ..options import DETECTION, LINKING, Growing, Linking, ScanLineParams, Selection
from ..recording import FrameSource, framesOf
from ..recording.manifest import MANIFEST, Line, Manifest
from ..recording.stores import FORMS, Outputs, packed, prepare_zarr, write_chunks, write_file
from .results import EdgeResults, edge_files, encoded, find_edges, write_folder
from .run import BatchItem, Job, root_of, run_frames
from .tasks import TASKS, Counts, picture_of


@takes(DETECTION)
def detectBatch(
    paths: Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    jobs: int = 1,
    force: bool = False,
    mask: np.ndarray | None = None,
    calibration: int | None = None,
    **options: Any,
) -> Iterator[BatchItem]:
    """Detect the edges of many images and write them as the command `rangeedge detect` does.

    detectBatch(paths, out, *[, jobs[, force[, ...]]]) -> items

    The results of ``a/frame1.png`` go to ``out/frame1/``. `runBatch` does the same and more.

    Parameters
    ----------
    paths : iterable of paths
        Range images and recordings, as `framesOf` takes them.
    out : path
        Folder of the folders, made where it is missing.
    jobs : int
        How many images are worked on at a time; with more than 1 in processes of their own, see `mapFrames`.
    force : bool
        Whether to process images again that have been done since they were changed, with the same options.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used, of all images.
    calibration : {1, 2}, optional
        Of an ABW scanner, as for `imreadRange`.
    {options}

    All these hold for all images; a geometry given here replaces that of a file.

    Returns
    -------
    items : iterator of BatchItem
        One a path, in their order, each as soon as it and those before it are done.

    Raises
    ------
    rangeedge.error
        As from `runBatch`.

    Examples
    --------
    >>> import tempfile
    >>> from rangeedge.batch import detectBatch
    >>> [item.state for item in detectBatch(["missing.png"], tempfile.mkdtemp())]
    ['failed']
    """
    if isinstance(paths, (str, bytes, os.PathLike)) or not isinstance(paths, Iterable):
        raise fail("paths", "an iterable of file names", described(paths))
    paths = [file_name(path, "paths") for path in paths]
    options |= {name: value for name, value in (("mask", mask), ("calibration", calibration)) if value is not None}
    return runBatch(paths, out, jobs=jobs, force=force, **options)


@takes({**LINKING, **Growing.options})
def runBatch(
    inputs: str | os.PathLike[str] | FrameSource | Iterable[str | os.PathLike[str] | FrameSource],
    out: str | os.PathLike[str],
    task: str = "detect",
    *,
    form: str | None = None,
    jobs: int = 1,
    client: Any = None,
    batch: int = 1,
    force: bool = False,
    resume: bool = False,
    topics: Iterable[str] = (),
    calibration: int | None = None,
    mask: np.ndarray | None = None,
    **options: Any,
) -> Iterator[BatchItem]:
    """Find the edges, regions or lines of every frame of recordings, and write them with a manifest.

    runBatch(inputs, out[, task], *[, form[, jobs[, client[, ...]]]]) -> items

    A frame that cannot be processed does not stop the others. Of every frame ``manifest.jsonl`` (of a store, a file
    ``STORE.manifest.jsonl`` beside it) has one line: ``frame``, ``input``, ``part``, ``state``, ``outputs`` with their
    sizes, ``parameters``, ``counts``, ``seconds``, ``warnings`` where there are any, and ``error`` where it failed. It
    is appended when all files of the frame are complete. A run that was interrupted goes on where it stopped when it is
    started again: frames are done whose line says so, with the same parameters, whose file has not been changed since,
    and whose outputs are there.

    Parameters
    ----------
    inputs : path or iterable of paths
        Range images and recordings, as `framesOf` takes them.
    out : path
        A folder, or a Zarr store: a name that ends with ``.zarr``. Made where it is missing.
    task : {"detect", "segment", "lines"}
        What the command of that name does.
    form : {"folder", "npz", "png", "zarr"}, optional
        What is written a frame: a folder as by the command; an NPZ file of the arrays; a PNG file of the edges or of
        the labels (16 bits); chunks of a store, one a frame of each array, which is the default where `out` is one. For
        ``detect`` the arrays are edges, jump, crease, kind and significance, for ``segment`` labels, for ``lines``
        (NPZ only) points, chains, segments and vertices.
    jobs : int
        Frames worked on at a time; with more than 1 in processes of their own, see `mapFrames`.
    client : dask.distributed.Client, optional
        Whose workers do the work; they must see the files under the same names.
    batch : int
        Frames that make one task of Dask's.
    force : bool
        Whether to process frames again that are done.
    resume : bool
        Whether it is an error where there is no manifest to go on from.
    topics : iterable of str
        Those of a bag that are taken; by default all with depths.
    calibration : {1, 2}, optional
        Of an ABW scanner, as for `imreadRange`.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used, of all frames.
    {options}

    All these hold for all frames; a geometry given here replaces that of a file or recording.

    Returns
    -------
    items : iterator of BatchItem
        One a frame, in their order, each as soon as it and those before it are done.

    Raises
    ------
    rangeedge.error
        An argument is bad, as far as that shows without an image; a file is given twice; another run is writing to the
        same place, or it cannot be written. Where the disk is full the run stops, and may be started again.

    Examples
    --------
    >>> import os
    >>> import tempfile
    >>> import numpy as np
    >>> from rangeedge.batch import runBatch
    >>> path = os.path.join(tempfile.mkdtemp(), "walk.npy")
    >>> stack = np.full((2, 48, 64), 2000, np.uint16)
    >>> stack[:, 12:36, 16:48] = 1500
    >>> np.save(path, stack)
    >>> out = tempfile.mkdtemp()
    >>> [item.state for item in runBatch(path, out, form="png", noise=0.001, pixelSize=0.01)]
    ['written', 'written']
    >>> [item.state for item in runBatch(path, out, form="png", noise=0.001, pixelSize=0.01)]
    ['skipped', 'skipped']
    >>> sorted(os.listdir(os.path.join(out, "walk")))
    ['0000.png', '0001.png']
    """
    root = root_of(out)
    if not isinstance(task, str) or task not in TASKS:
        raise fail("task", " or ".join(map(repr, TASKS)), described(task))
    form = form or ("zarr" if root.suffix == ".zarr" else "folder")
    if form not in FORMS:
        raise fail("form", " or ".join(map(repr, FORMS)), described(form))
    if (form == "zarr" and not TASKS[task].frames) or (form == "png" and not TASKS[task].picture):
        raise fail("form", f"'folder' or 'npz' for {task!r}", repr(form))
    jobs, batch = integer("jobs", jobs, 1), integer("batch", batch, 1)
    force, resume = boolean("force", force), boolean("resume", resume)
    for name in options.keys() - TASKS[task].options.keys():
        raise error(f"`{name}` is no option of {task!r}")
    parsed(options, ScanLineParams, Selection, Growing, Linking)
    frames = framesOf(inputs, topics=topics, calibration=calibration)
    options |= {} if mask is None else {"mask": mask}
    told = {} if calibration is None else {"calibration": calibration}
    job = _FrameJob(root, options, told, task, form)
    with writing(root, "cannot write to"):
        if root.exists() and not root.is_dir():
            raise ValueError("it is a file, no folder")
    path = root.with_name(f"{root.name}.{MANIFEST}") if form == "zarr" else root / MANIFEST
    if resume and not path.exists():
        raise error(f"there is no {str(path)!r} to resume from")
    return run_frames(job, frames, Manifest(path), force, jobs=jobs, client=client, batch=batch)


@dataclass(frozen=True)
class _FrameJob(Job):
    """Frames each on its own."""

    task: str
    form: str

    def prepare(self, frames: list[FrameSource], fresh: bool) -> None:
        if self.form == "zarr":
            prepare_zarr(self.out, TASKS[self.task].frames, frames, self.options, fresh)

    def place(self, frame: FrameSource) -> Path:
        if self.form == "zarr":
            return self.out
        return self.out / (frame.name if self.form == "folder" else f"{frame.name}.{self.form}")

    def parameters(self, frame: FrameSource) -> dict[str, Any]:
        return {"task": self.task, "form": self.form, **super().parameters(frame)}

    def is_done(self, index: int, frame: FrameSource, lines: Mapping[str, Line]) -> bool:
        here = self.form != "zarr" or lines.get(frame.name, {}).get("index") == index
        return here and super().is_done(index, frame, lines)

    def __call__(self, task: tuple[int, FrameSource]) -> tuple[Outputs, Counts]:
        index, frame = task
        image, own = frame.read(**self.options), TASKS[self.task]
        if self.form == "folder":
            files, counts = own.files(image, frame.title, self.options)
            write_folder(self.out / frame.name, files)
            return {f"{frame.name}/{name}": len(data) for name, data in files.items()}, counts
        arrays, counts = own.arrays(image)
        if self.form == "zarr":
            return write_chunks(self.out, index, arrays), counts
        data = packed(arrays) if self.form == "npz" else encoded(".png", picture_of(arrays, own.picture))
        return write_file(self.out, f"{frame.name}.{self.form}", data), counts


def detect_file(path: str, folder: Path, options: dict[str, Any]) -> EdgeResults:
    """Edges of one image, written into a folder."""
    image = read_image(path, options)
    found = find_edges(image.src, **image.geometry)
    write_folder(folder, edge_files(found, path, options))
    return found


def read_image(path: str, options: dict[str, Any]) -> RangeImage:
    """An image of which `geometry` holds all options; a geometry among these replaces that of the file."""
    options = dict(options)
    return imreadRange(path, calibration=options.pop("calibration", None)).withGeometry(**options)
