"""One image larger than memory, in blocks that overlap: edges, exact distances, and regions joined across seams."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from .._check import boolean, described, error, fail, integer, number
from .._option import parsed, takes
from ..distance import distanceTransform, salienceDistanceTransform
from ..frame import expect_size
from ..io import RangeImage
from ..io.source import file_name
from ..io.tiff import Window
from ..noise import estimateNoise
from ..options import DETECTION, MEASURED, Growing, ScanLineParams, Selection
from ..recording import FrameSource
from ..recording.blocks import Grid, clearance, inside, joined, matches
from ..recording.large import LargeImage, open_large, window_source, write_geotiff
from ..recording.manifest import Line, Manifest, read_lines
from ..recording.source import extra
from ..recording.stores import Outputs, open_arrays, packed, prepare_arrays, write_file, write_region
from ..regions import segmentRegions
from ..selection import overallStrength
from .results import plain
from .run import BatchItem, Job, root_of, run_frames
from .tasks import TASKS, Counts

_REACH = 4096  # pixels around a block in which the nearest edge is looked for
_SALIENCE_REACH = 1024  # the same where weak edges count for less: distances by salience soon exceed any reach
_STRIP = 32  # pixels across a seam in which labels of both sides are compared
_PATCHES = 16  # of the image, of which the noise is estimated
_PATCH = 512  # pixels
_MOST_BLOCKS = 2**20


@takes({**DETECTION, **Growing.options})
def runBlocks(
    image: str | os.PathLike[str],
    out: str | os.PathLike[str],
    task: str = "detect",
    *,
    blockSize: int = 2048,
    overlap: int = 256,
    jobs: int = 1,
    client: Any = None,
    force: bool = False,
    resume: bool = False,
    mask: np.ndarray | None = None,
    jumpCut: float | None = None,
    **options: Any,
) -> Iterator[BatchItem]:
    """Find the edges or regions of an image that is larger than memory.

    runBlocks(image, out[, task], *[, blockSize[, overlap[, jobs[, client[, ...]]]]]) -> items

    Every block is done with `overlap` pixels around it, of which nothing is kept; the noise is estimated once, of
    patches spread over the image. The results are arrays of a Zarr store, in chunks of a block.

    Parameters
    ----------
    image : path
        A TIFF of any size, from which windows are read, with its pixel size and its value of no data; (H, W) NPY or
        Zarr.
    out : path
        A Zarr store, whose name ends with ``.zarr``, with ``georeference`` and ``pixelSize`` as attributes; or a
        folder, with the store ``blocks.zarr`` and in the end a GeoTIFF of each array.
    task : {"detect", "segment"}
        ``detect`` writes edges, jump, crease, kind, significance, and the distance to the nearest edge; ``segment``
        writes labels, and labels of each block by itself, parts.
    blockSize, overlap : int
        In pixels.
    jobs, client, force, resume
        As for `runBatch`: a block is what a frame is there, and the manifests are beside the store.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used. A mask and a map of the noise may be such as ``numpy.load(mmap_mode="r")``
        returns: no more than a block of them is read at a time.
    jumpCut : float, optional
        With it, ``detect`` writes salience too: `salienceDistanceTransform` of `overallStrength` with that cut.
    {options}

    Returns
    -------
    items : iterator of BatchItem
        One a block and step, edges first, then distances, or parts first, then labels; and one a GeoTIFF.

    Raises
    ------
    rangeedge.error
        As from `runBatch`.

    Notes
    -----
    Distances are those of the whole image wherever they are less than 4096 pixels; of a pixel farther from every edge
    than that, the distance to the nearest one that was seen, or inf. Salience distances are exact below 1024 pixels,
    and beyond never too small; ``unsurePixels`` in the manifest counts those that may differ. Scan lines are divided
    from end to end, and so edges may differ where a block ends them earlier; components of edges and regions are cut
    off beyond the overlap. Labels of two blocks become one where they share half of the smaller, in the 32 pixels
    beyond the seam that both blocks have labelled.

    Examples
    --------
    >>> import os
    >>> import tempfile
    >>> from importlib.util import find_spec
    >>> import numpy as np
    >>> from rangeedge.batch import runBlocks
    >>> path = os.path.join(tempfile.mkdtemp(), "terrain.npy")
    >>> np.save(path, np.where(np.arange(300) < 150, 0.0, 5.0) * np.ones((200, 1)))
    >>> if find_spec("zarr"):
    ...     items = list(runBlocks(path, path + ".zarr", blockSize=128, overlap=32, noise=0.01, heightMap=True))
    """
    name, root = file_name(image, "image"), root_of(out)
    if not isinstance(task, str) or task not in _PASSES:
        raise fail("task", " or ".join(map(repr, _PASSES)), described(task))
    folder = None if root.suffix == ".zarr" else root
    root = root if folder is None else root / "blocks.zarr"
    size, overlap, jobs = integer("blockSize", blockSize, 64), integer("overlap", overlap, 0), integer("jobs", jobs, 1)
    force, resume = boolean("force", force), boolean("resume", resume)
    for option in options.keys() - TASKS[task].options.keys():
        raise error(f"`{option}` is no option of {task!r}")
    extra("zarr", "zarr", "an image in blocks")
    large = open_large(name)
    if jumpCut is not None:
        jumpCut = number("jumpCut", jumpCut, 0, above=True)
        if task != "detect":
            raise fail("jumpCut", f"None for {task!r}", described(jumpCut))
    maps = {} if mask is None else {"mask": mask}
    if isinstance(options.get("noise"), np.ndarray) and options["noise"].ndim:
        maps["noise"] = options.pop("noise")
    params, *_ = parsed(options, ScanLineParams, Selection, Growing)
    if params.imageSize is not None:  # of the whole image, of which blocks are parts
        expect_size(large.shape, params.imageSize)
        options |= {"K": params.K, "distCoeffs": params.distCoeffs, "imageSize": None}
    for what, values in maps.items():
        if not isinstance(values, np.ndarray) or values.shape != large.shape:
            raise fail(what, f"an array of shape {large.shape}", described(values))
    first = _manifest(root, _PASSES[task][0])
    if resume and not first.exists():
        raise error(f"there is no {str(first)!r} to resume from")
    grid = Grid(large.shape, size)
    if len(grid) > _MOST_BLOCKS:
        rows, cols = large.shape
        raise fail("blockSize", f"such that {cols} x {rows} pixels are at most {_MOST_BLOCKS} blocks", size)
    steps = _PASSES[task] if jumpCut is None else (*_PASSES[task], "salience")
    items = _passes(steps, large, grid, root, overlap, options, maps, jumpCut, force, jobs=jobs, client=client)
    return items if folder is None else _and_files(items, steps, large, grid, root)


def _and_files(
    items: Iterator[BatchItem], steps: Sequence[str], image: LargeImage, grid: Grid, root: Path
) -> Iterator[BatchItem]:
    """The blocks, and when all are done the arrays as files beside the store."""
    whole = True
    for item in items:
        whole &= item.state != "failed"
        yield item
    if whole:
        arrays = open_arrays(root, "r")
        for name in (name for step in steps for name in _STEPS[step].kinds if name != "parts"):
            path = root.with_name(f"{name}.tif")
            write_geotiff(path, arrays[name], image, grid.size)
            yield BatchItem(image.path, str(path), "written", "")


def _manifest(root: Path, step: str) -> Path:
    return root.with_name(f"{root.name}.{step}.manifest.jsonl")


def _passes(
    steps: Sequence[str],
    image: LargeImage,
    grid: Grid,
    root: Path,
    overlap: int,
    options: dict[str, Any],
    maps: Mapping[str, np.ndarray],
    jumpCut: float | None,
    force: bool,
    **workers: Any,
) -> Iterator[BatchItem]:
    """The steps of a task; those after the first anew where one has written anything."""
    if "noise" not in maps:
        options = {**options, "noise": _noise(image, options, maps.get("mask"))}
    told: dict[str, Any] = {"blockSize": grid.size, "overlap": overlap}
    sources = list(_sources(image, grid, overlap, maps))
    known = {**image.geometry, **({} if image.georeference is None else {"georeference": image.georeference})}
    again = force
    for step in steps:
        own = {"jumpCut": jumpCut} if step == "salience" else _numbering(root, grid) if step == "labels" else {}
        job, manifest = _STEPS[step](root, options, told | own, grid, known), Manifest(_manifest(root, step))
        for item in run_frames(job, sources, manifest, again, **workers):
            force |= item.state == "written" and step == steps[0]
            yield item
        again = force


@dataclass(frozen=True)
class _Block(FrameSource):
    """A block with what overlaps it, and the same parts of maps that go with the image."""

    maps: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False)


def _sources(image: LargeImage, grid: Grid, overlap: int, maps: Mapping[str, np.ndarray]) -> Iterator[FrameSource]:
    digits = len(str(max(image.shape)))
    for index in range(len(grid)):
        top, left, bottom, right = grid.window(index)
        name = f"{top:0{digits}d}_{left:0{digits}d}"
        part = f"rows {top} to {bottom}, columns {left} to {right}"
        around = grid.window(index, overlap)
        source = window_source(image, name, around, part)
        parts = {what: inside(values, around, (0, 0)) for what, values in maps.items()}
        yield _Block(name, source.path, part, source.load, source.geometry, maps=parts)


def _noise(image: LargeImage, options: dict[str, Any], mask: np.ndarray | None) -> Any:
    """The noise as given, or as patches tell that are spread over the image, with rows and columns of NaN between."""
    if options.get("noise") is not None:
        return options["noise"]
    size = min(_PATCH, *image.shape)
    side = int(np.sqrt(_PATCHES))
    tops, lefts = (np.unique(np.linspace(0, extent - size, side).astype(int)).tolist() for extent in image.shape)

    def patch(top: int, left: int) -> np.ndarray:
        window = (top, left, top + size, left + size)
        src = window_source(image, "", window, "").read().src
        if mask is not None:
            src[inside(mask, window, (0, 0)) == 0] = _nothing(src)
        return np.pad(src, 1, constant_values=_nothing(src))

    rows = [np.hstack([patch(top, left) for left in lefts]) for top in tops]
    known = {name: value for name, value in {**image.geometry, **options}.items() if name in MEASURED}
    return estimateNoise(np.vstack(rows), **known)


def _nothing(patch: np.ndarray) -> float:
    """What stands for no data."""
    return np.nan if patch.dtype.kind == "f" else np.iinfo(patch.dtype).min


@dataclass(frozen=True)
class _BlockJob(Job):
    """A step on every block; where a camera is given, it is seen from the first pixel of each."""

    grid: Grid
    map: Mapping[str, Any]  # what the attributes of the store say of its pixels
    kinds: ClassVar[Mapping[str, str]]  # the arrays that it fills, and their types

    def prepare(self, frames: list[FrameSource], fresh: bool) -> None:
        size = min(self.grid.size, max(self.grid.shape))
        arrays = {name: (kind, self.grid.shape, (size, size)) for name, kind in self.kinds.items()}
        prepare_arrays(self.out, arrays, fresh)
        open_arrays(self.out).attrs.update(plain(self.map))

    def is_done(self, index: int, frame: FrameSource, lines: Mapping[str, Line]) -> bool:
        return lines.get(frame.name, {}).get("index") == index and super().is_done(index, frame, lines)

    def parameters(self, frame: FrameSource) -> dict[str, Any]:
        return {**super().parameters(frame), **plain(_maps_of(frame))}

    def write(self, index: int, arrays: dict[str, np.ndarray]) -> Outputs:
        return write_region(self.out, arrays, self.grid.window(index), self.grid.place(index))

    def image(self, source: FrameSource, around: tuple[int, ...]) -> tuple[np.ndarray, dict[str, Any]]:
        """A block with what overlaps it, and its geometry."""
        src, geometry = source.read(**self.options, **_maps_of(source))
        if geometry.get("K") is not None:
            camera = ScanLineParams(K=geometry["K"], distCoeffs=geometry.get("distCoeffs"))
            K = np.array(camera.K)
            K[:2, 2] -= around[1], around[0]
            geometry |= {"K": K, "distCoeffs": camera.distCoeffs}
        return src, geometry


def _maps_of(source: FrameSource) -> Mapping[str, np.ndarray]:
    return source.maps if isinstance(source, _Block) else {}


class _Edges(_BlockJob):
    kinds = TASKS["detect"].frames

    def __call__(self, task: tuple[int, FrameSource]) -> tuple[Outputs, Counts]:
        index, source = task
        window, around = self.grid.window(index), self.grid.window(index, self.told["overlap"])
        src, geometry = self.image(source, around)
        found, _ = TASKS["detect"].arrays(RangeImage(src, geometry))
        own = {name: inside(values, window, around) for name, values in found.items()}
        return self.write(index, own), {"edgePixels": int(np.count_nonzero(own["edges"]))}


class _Distances(_BlockJob):
    kinds: ClassVar[Mapping[str, str]] = {"distance": "f4"}
    reach: ClassVar[int] = _REACH

    def seen(self, arrays: Any, around: Window) -> np.ndarray:
        """The distances of a window, to edges in that window."""
        top, left, bottom, right = around
        return distanceTransform(arrays["edges"][top:bottom, left:right])

    def __call__(self, task: tuple[int, FrameSource]) -> tuple[Outputs, Counts]:
        """With as much around the block as it takes to know that no edge beyond is nearer."""
        index, _ = task
        (name,) = self.kinds
        window, margin = self.grid.window(index), self.told["overlap"]
        while True:
            around = self.grid.window(index, margin)
            distance = inside(self.seen(open_arrays(self.out), around), window, around)
            unsure = distance > clearance(window, around, self.grid.shape)
            if not unsure.any() or margin >= self.reach:
                return self.write(index, {name: distance}), {"unsurePixels": int(np.count_nonzero(unsure))}
            farthest = distance[unsure].max()
            margin = min(self.reach, int(np.ceil(farthest)) if np.isfinite(farthest) else 2 * margin + 64)


class _Saliences(_Distances):
    """A salience is at most 1, and so no edge is nearer by it than it is."""

    kinds: ClassVar[Mapping[str, str]] = {"salience": "f4"}
    reach: ClassVar[int] = _SALIENCE_REACH

    def seen(self, arrays: Any, around: Window) -> np.ndarray:
        top, left, bottom, right = around
        jump, crease = (arrays[name][top:bottom, left:right] for name in ("jump", "crease"))
        return salienceDistanceTransform(overallStrength(jump, crease, self.told["jumpCut"]))


class _Parts(_BlockJob):
    kinds: ClassVar[Mapping[str, str]] = {"parts": "i4"}

    def __call__(self, task: tuple[int, FrameSource]) -> tuple[Outputs, Counts]:
        """Labels of a block by itself, and what it calls the pixels beyond its seams."""
        index, source = task
        window, around = self.grid.window(index), self.grid.window(index, self.told["overlap"])
        src, geometry = self.image(source, around)
        labels = segmentRegions(src, **geometry)
        own = np.unique(inside(labels, window, around))
        numbers = np.zeros(labels.max() + 1, np.int32)
        numbers[own[own > 0]] = np.arange(1, np.count_nonzero(own) + 1)
        labels = numbers[labels]
        strips = {
            str(other): inside(labels, strip, around)
            for other, strip in self.grid.beyond(index, min(_STRIP, self.told["overlap"]))
        }
        outputs = self.write(index, {"parts": inside(labels, window, around)})
        outputs |= write_file(self.out, _strips(self.out, index), packed(strips))
        return outputs, {"regions": int(labels.max())}


class _Labels(_BlockJob):
    kinds: ClassVar[Mapping[str, str]] = {"labels": "i4"}

    def __call__(self, task: tuple[int, FrameSource]) -> tuple[Outputs, Counts]:
        """The labels of a block as they are called in the whole."""
        index, _ = task
        top, left, bottom, right = self.grid.window(index)
        parts = open_arrays(self.out)["parts"][top:bottom, left:right]
        first, behind = self.told["first"][index : index + 2] + 1
        own = np.concatenate([[0], self.told["numbers"][first:behind]]).astype(np.int32)
        return self.write(index, {"labels": own[parts]}), {"regions": len(np.unique(own)) - 1}


# The steps of a task, the second of which needs the whole of the first.
_PASSES = {"detect": ("edges", "distance"), "segment": ("parts", "labels")}
_STEPS: dict[str, type[_BlockJob]] = {
    "edges": _Edges,
    "distance": _Distances,
    "salience": _Saliences,
    "parts": _Parts,
    "labels": _Labels,
}


def _strips(root: Path, index: int) -> str:
    """The file of what a block calls the pixels beyond its seams; beside the store, which has arrays alone."""
    return f"../{root.name}.seams/{index}.npz"


def _numbering(root: Path, grid: Grid) -> dict[str, np.ndarray]:
    """How many labels come before those of each block, and the numbers of all in the whole."""
    lines = {line["index"]: line for line in read_lines(_manifest(root, "parts")).values()}
    counts = [lines[index]["counts"].get("regions", 0) for index in range(len(grid))]
    first = np.concatenate([[0], np.cumsum(counts)])
    parts, pairs = open_arrays(root)["parts"], []
    for index in range(len(grid)):
        if lines[index]["state"] != "written":
            continue
        with np.load(root / _strips(root, index)) as strips:
            for other, (top, left, bottom, right) in grid.beyond(index, _STRIP):
                ones = strips[str(other)]
                others = parts[top:bottom, left:right][: ones.shape[0], : ones.shape[1]]
                found = matches(ones, others)
                pairs += [(first[index] + one, first[other] + another) for one, another in found]
    return {"first": first, "numbers": joined(int(first[-1]), pairs)}
