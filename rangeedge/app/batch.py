"""Edges of many range images: each into a folder of its own, those done already left alone."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from .. import __version__
from .._check import boolean, described, error, fail, integer
from .._option import parsed, takes
from ..io import RangeImage, imreadRange
from ..options import DETECTION, ScanLineParams, Selection
from .results import EdgeResults, edge_files, find_edges, plain, write_folder


class BatchItem(NamedTuple):
    """What became of one image."""

    path: str
    folder: str
    state: str  # "written", "skipped" or "failed"
    message: str  # of the error, or empty


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

    The results of ``a/frame1.png`` go to ``out/frame1/``. An image that cannot be processed does not stop the others.
    A folder without its report, which is written last, is not done; so a batch that was interrupted goes on where it
    stopped when it is run again.

    Parameters
    ----------
    paths : iterable of paths
        Range images, as `imreadRange` takes them. No two may have the same name before the suffix.
    out : path
        Folder of the folders, made where it is missing.
    jobs : int
        How many images are worked on at a time.
    force : bool
        Whether to process images again that have a folder newer than they are, made with the same options.
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
        If two images would be written to the same folder, or an argument is bad, as far as that shows without an image.

    Examples
    --------
    >>> import tempfile
    >>> from rangeedge.batch import detectBatch
    >>> [item.state for item in detectBatch(["missing.png"], tempfile.mkdtemp())]
    ['failed']
    """
    if isinstance(paths, (str, bytes, os.PathLike)):
        raise fail("paths", "an iterable of file names", described(paths))
    jobs = integer("jobs", jobs, 1)
    force = boolean("force", force)
    parsed(options, ScanLineParams, Selection)
    options |= {name: value for name, value in (("mask", mask), ("calibration", calibration)) if value is not None}
    folders: dict[Path, str] = {}
    for path in map(os.fspath, paths):
        folder = Path(out) / Path(path).stem
        if folder in folders:
            raise error(f"{folders[folder]!r} and {path!r} would be written to the same folder")
        folders[folder] = path
    return _results([(path, folder) for folder, path in folders.items()], jobs, force, options)


def _results(tasks: list[tuple[str, Path]], jobs: int, force: bool, options: dict[str, Any]) -> Iterator[BatchItem]:
    with ThreadPoolExecutor(jobs) as pool:
        try:
            yield from pool.map(lambda task: _process(*task, force, options), tasks)
        finally:
            pool.shutdown(cancel_futures=True)


def _process(path: str, folder: Path, force: bool, options: dict[str, Any]) -> BatchItem:
    if not force and _is_done(path, folder, options):
        return BatchItem(path, str(folder), "skipped", "")
    try:
        detect_file(path, folder, options)
    except Exception as problem:  # whatever it is, the other images go on
        message = problem.msg if isinstance(problem, cv2.error) else f"{type(problem).__name__}: {problem}"
        return BatchItem(path, str(folder), "failed", message)
    return BatchItem(path, str(folder), "written", "")


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


def _is_done(path: str, folder: Path, options: dict[str, Any]) -> bool:
    """Whether a folder holds the results of these options, and is newer than the image."""
    try:
        report = json.loads((folder / "report.json").read_bytes())
        newer = (folder / "report.json").stat().st_mtime_ns >= Path(path).stat().st_mtime_ns
        return newer and report["rangeedge"] == __version__ and report["options"] == plain(options)
    except (OSError, ValueError, KeyError, TypeError):
        return False
