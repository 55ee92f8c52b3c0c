"""Files of all formats, changed, for `fuzz.py`: what comes of reading one is an answer or `rangeedge.error`, soon.

Rules: no exception but `rangeedge.error`; no warning but `RangeEdgeWarning`; less than two seconds of processor time
and a gigabyte of memory for any small file.
"""

from __future__ import annotations

import functools
import json
import re
import shutil
import struct
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

import rangeedge
from rangeedge.batch import framesOf
from rangeedge.io.camera import read_camera
from rangeedge.recording.large import open_large, window_source
from rangeedge.recording.manifest import read_lines

SLOW = 2.0  # seconds of processor time
LARGE = 2**30  # bytes
Files = dict[str, bytes]  # of a recording, by their names; of anything else one

SCENE = np.where(np.arange(33) < 15, 1.0, 2.0) * np.ones((24, 1)) + 0.02 * np.arange(24)[:, None]
STACK = np.round(1000 * np.stack([SCENE, SCENE[::-1], SCENE + 1])).astype(np.uint16)
NUMBERS = ["0", "-1", "1e999", "nan", "65536", "2147483647", "4294967296", "9" * 19, "1" * 400, "", "x", "[" * 300]
WORDS = [0, 1, 2, 127, 128, 255, 256, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1]


def of_folder(write: Callable[[Path], Any]) -> Files:
    """What a function writes into a folder."""
    with tempfile.TemporaryDirectory() as name:
        write(Path(name))
        paths = [path for path in sorted(Path(name).rglob("*")) if path.is_file()]
        return {str(path.relative_to(name)): path.read_bytes() for path in paths}


def images() -> list[Files]:
    from test_inputs import INPUTS

    return [{"image": entry.content} for entry in INPUTS if entry.content]


def lines() -> list[Files]:
    chains = rangeedge.linkEdges(SCENE, K=(50, 50, 16, 12))
    outlines = rangeedge.regionBoundaries((SCENE > 1.5).astype(np.int32) + 1, SCENE, K=(50, 50, 16, 12))
    of_kinds = [chains, rangeedge.fitSegments(chains, minPoints=2), rangeedge.fitArcs(chains), outlines]
    suffixes = ["csv", "ply", "obj", "geojson", "svg", "dxf"]
    found = []
    for i, own in enumerate(of_kinds):
        for suffix in suffixes:
            if not (suffix == "svg" and i == 2):
                found.append(of_folder(lambda f, own=own, end=suffix: rangeedge.writeLines(f / f"lines.{end}", own)))
    return found


def parameters() -> list[Files]:
    noises = [None, 0.01, rangeedge.NoiseModel.realsense(), np.full((3, 4), 0.01)]
    options = {"K": (50, 50, 16, 12), "invalid": (0, (5, 9)), "pixelSize": None}
    detectors = [rangeedge.createScanLineDetector(rangeedge.ScanLineParams(noise=n, **options)) for n in noises]
    return [
        of_folder(lambda f, own=own, end=suffix: own.save(f / f"parameters.{end}"))
        for own in detectors
        for suffix in ("yml", "xml", "json")
    ]


def cameras() -> list[Files]:
    from test_camera_files import FILES

    contents = (values[1] for values in FILES)
    return [{"camera": content if isinstance(content, bytes) else content.encode()} for content in contents if content]


def stacks() -> list[Files]:
    geometry = {"K": np.array([[50.0, 0, 16], [0, 50, 12], [0, 0, 1]]), "depthFactor": 500}
    found = [
        of_folder(lambda f: np.save(f / "a.npy", STACK)),
        of_folder(lambda f: np.save(f / "a.npy", np.asfortranarray(STACK))),
        of_folder(lambda f: np.savez(f / "a.npz", depth=STACK, **geometry)),
        of_folder(lambda f: np.savez_compressed(f / "a.npz", depth=np.asfortranarray(STACK), **geometry)),
        of_folder(lambda f: rangeedge.imwriteRange(f / "a.tif", STACK[0])),
    ]
    if tifffile := optional("tifffile"):
        options = {"photometric": "minisblack"}
        found += [
            of_folder(lambda f: tifffile.imwrite(f / "a.tif", STACK, **options)),
            of_folder(lambda f: tifffile.imwrite(f / "a.tif", STACK, compression="zlib", tile=(16, 16), **options)),
        ]
    return found


def folders() -> list[Files]:
    texts = {
        "depth.txt": b"# time file\n1.5 a.png\n2.5 b.png\n",
        "intrinsics.json": b'{"K": [50, 0, 9, 0, 50, 9, 0, 0, 1]}',
    }
    pictures = of_folder(lambda f: [rangeedge.imwriteRange(f / f"{name}.png", STACK[0]) for name in "ab"])
    found = [{**texts, **pictures}]
    if zarr := optional("zarr"):
        for version in (2, 3):
            found.append(
                of_folder(lambda f, v=version: zarr.create_array(str(f), data=STACK, chunks=(1, 24, 33), zarr_format=v))
            )
    return found


def bags() -> list[Files]:
    if not optional("rosbags"):
        return []
    from test_recordings import camera_message, cloud_message, compressed_message, image_message, written_bag

    points = np.stack([SCENE, SCENE, SCENE], axis=-1).astype(np.float32)
    messages = [
        ("/a/camera_info", 1, camera_message()),
        ("/a/image", 2, image_message(STACK[0])),
        ("/b/image/compressedDepth", 3, compressed_message(STACK[1])),
        ("/c/points", 4, cloud_message(points)),
    ]
    return [
        of_folder(lambda f, kind=kind: written_bag(f / ("walk.bag" if kind == "ros1" else "walk"), kind, messages))
        for kind in ("ros1", "ros2", "mcap")
    ]


def manifests() -> list[Files]:
    line = {"frame": "a/0001", "state": "done", "outputs": {"a/thin.png": 100}, "seconds": 0.5}
    return [{"manifest": b"".join(json.dumps({**line, "frame": f"a/{i}"}).encode() + b"\n" for i in range(4))}]


def optional(name: str) -> Any:
    """A package that may be missing."""
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def read_frames(path: Path) -> list[Any]:
    """The frames of a recording, as far as they can be read."""
    return [attempt(frame.read) for frame in framesOf(path)[:4]]


def read_stack(path: Path) -> list[Any]:
    """The same, and a part of an image that may be too large to be read as a whole."""
    image = attempt(lambda: open_large(str(path)))
    window = None if isinstance(image, rangeedge.error) else window_source(image, "part", (2, 3, 9, 20), "part")
    return [*read_frames(path), attempt(window.read) if window else image]


def attempt(read: Callable[[], Any]) -> Any:
    try:
        return read()
    except rangeedge.error as problem:
        return problem


def load_parameters(path: Path) -> Any:
    detector = rangeedge.createScanLineDetector()
    detector.load(path)
    return detector.getEps(), detector.getNoise()


def read_root(path: Path) -> list[Any]:
    """A recording that is a folder, or a file or a folder in one."""
    inside = [name for name in ("walk.bag", "walk") if (path / name).exists()]
    return read_frames(path / inside[0] if inside else path)


# What makes examples, and what reads them: a file, or the folder it is in.
READERS: dict[str, tuple[Callable[[], list[Files]], Callable[[Path], Any], bool]] = {
    "file: images": (images, rangeedge.imreadRange, False),
    "file: lines": (lines, rangeedge.readLines, False),
    "file: parameters": (parameters, load_parameters, False),
    "file: cameras": (cameras, read_camera, False),
    "file: stacks": (stacks, read_stack, False),
    "file: manifests": (manifests, read_lines, False),
    "file: folders": (folders, read_root, True),
    "file: bags": (bags, read_root, True),
}


@functools.cache
def examples(name: str) -> list[Files]:
    return READERS[name][0]()


def changed(content: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """A file with a small change of one of many kinds."""
    data = bytearray(content)
    size = max(1, len(data))
    ends = [64, 512, size]
    at = int(rng.integers(min(size, rng.choice(ends))))
    at = size - 1 - at if rng.random() < 0.2 else at
    kind = rng.integers(9)
    if kind == 0 and data:
        data[at] ^= 1 << int(rng.integers(8))
    elif kind == 1 and data:
        data[at] = int(rng.choice([0, 255, rng.integers(256)]))
    elif kind == 2:
        del data[at:]
    elif kind == 3:
        del data[at : at + int(rng.integers(1, 40))]
    elif kind == 4:
        data[at:at] = data[int(rng.integers(size)) :][: int(rng.integers(1, 200))]
    elif kind == 5:
        start = int(rng.integers(max(1, len(other))))
        data[at : at + int(rng.integers(40))] = other[start : start + int(rng.integers(1, 200))]
    elif kind == 6:
        order, (form, bits) = rng.choice(["<", ">"]), [("H", 16), ("I", 32), ("Q", 64)][int(rng.integers(3))]
        word = struct.pack(f"{order}{form}", WORDS[int(rng.integers(len(WORDS)))] % 2**bits)
        data[at : at + len(word)] = word
    elif kind == 7 and (found := list(re.finditer(rb"[-+]?\d[\d.]*", bytes(data[:4096])))):
        number = found[int(rng.integers(len(found)))]
        data[number.start() : number.end()] = NUMBERS[int(rng.integers(len(NUMBERS)))].encode()
    else:
        data[at:at] = bytes([int(rng.choice(list(b"\0\n\r\t []{}<>\"'\\-:,#!&*|")))]) * int(rng.choice([1, 2, 5000]))
    return bytes(data)


def contents(name: str) -> Any:
    """Examples of a reader, of each of which one file is changed."""

    def make(which: int, other: int, start: int) -> Files:
        rng = np.random.default_rng(start)
        files = dict(examples(name)[which])
        others = list(examples(name)[other].values())
        for _ in range(rng.choice([0, 1, 1, 1, 2, 3, 4])):
            part = list(files)[int(rng.integers(len(files)))]
            files[part] = changed(files[part], others[int(rng.integers(len(others)))], rng)
        return files

    numbers = st.integers(0, len(examples(name)) - 1)
    return st.builds(make, numbers, numbers, st.integers(0, 2**32 - 1))


def peak() -> int:
    """Bytes that the process has had at most, where the system says it."""
    if sys.platform != "linux":
        return 0
    import resource

    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def expect_reading(name: str, files: Files) -> bool:
    """Reads files and asserts that the rules are kept; whether what they hold is there."""
    _, read, whole = READERS[name]
    root = Path(tempfile.mkdtemp())
    before = peak()
    try:
        for part, content in files.items():
            path = root / part
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        start = time.process_time()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", rangeedge.RangeEdgeWarning)
            found = attempt(lambda: read(root if whole else path))
        assert time.process_time() - start < SLOW, "it takes long"
        assert peak() - before < LARGE, "it takes much memory"
    finally:
        shutil.rmtree(root)
    return not isinstance(found, rangeedge.error)
