"""Files that are cut, changed or made up: read, or refused by `rangeedge.error`, quickly and in silence."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from test_inputs import INPUTS, XYZ, chunk, pcd, ply, text, tiff
from test_scanner_files import perceptron_header

import rangeedge
from rangeedge import imreadRange
from rangeedge.io import source

GRID = ("element range_grid 6", "property list uchar int vertex_indices")
ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")
MUTANTS = int(os.environ.get("RANGEEDGE_FUZZ", "20"))  # of each file; set it for a longer run
SLOW = 2.0  # seconds, for any small file
READ = [entry for entry in INPUTS if entry.content and not isinstance(entry.right, str)]


def image_or_reason(path):
    start = time.perf_counter()
    try:
        found = imreadRange(path)
    except rangeedge.error as reason:
        found = str(reason)
    assert time.perf_counter() - start < SLOW
    assert not isinstance(found, str) or repr(str(path)) in found
    return found


@pytest.mark.parametrize("entry", READ, ids=lambda entry: entry.kind)
def test_truncated_files(tmp_path, entry):
    """A file that has lost its end is refused, unless only what does not belong to the pixels is missing."""
    path = tmp_path / "cut"
    size = len(entry.content)
    for end in {*range(0, size, 1 + size // 20), *range(max(0, size - 10), size)}:
        path.write_bytes(entry.content[:end])
        found = image_or_reason(path)
        if isinstance(found, str):
            continue
        missing = entry.content[end:]
        if "as" in entry.kind.lower().split() or "ascii" in entry.kind.lower():  # text
            assert len(missing.split()) <= 1
            assert_array_equal(found.src.ravel()[:-1], entry.right.ravel()[:-1])
        else:
            assert "trailing" in entry.kind or entry.content.startswith((b"II", b"MM")), f"{end} of {size} bytes"
            assert_array_equal(found.src, entry.right)


@pytest.mark.parametrize("entry", READ, ids=lambda entry: entry.kind)
def test_changed_files(tmp_path, capfd, entry):
    random = np.random.default_rng(len(entry.content) + MUTANTS)
    path = tmp_path / "changed"
    for _ in range(MUTANTS):
        content = bytearray(entry.content)
        for _ in range(random.integers(1, 4)):
            at = random.integers(min(len(content), random.choice((64, 512, len(content)))))
            content[at] = random.choice((random.integers(256), content[at] ^ 1 << random.integers(8), 0, 255))
        if random.random() < 0.2:
            at = random.integers(len(content))
            content[at:at] = content[random.integers(len(content)) :][:16]
        path.write_bytes(bytes(content))
        found = image_or_reason(path)
        if not isinstance(found, str):
            assert found.src.ndim in (2, 3)
            assert found.src.size <= 10**6
    if "EXR" not in entry.kind:  # OpenEXR prints what it finds wrong
        assert capfd.readouterr() == ("", "")


# Made up

SUN = struct.pack(">8I", 0x59A66A95, 512, 512, 8, 512 * 512, 1, 0, 0)
SIZE = ("obj_info num_cols 3", "obj_info num_rows 2")
PREFIXES = [
    *(
        b"\x89PNG\r\n\x1a\n",
        b"II*\0",
        b"MM\0*",
        b"II+\0\x08\0\0\0",
        b"\x76\x2f\x31\x01",
        b"Pf\n3 2\n-1\n",
        b"Pf ",
        b"PF\n",
    ),
    *(b"P5\n3 2\n65535\n", b"P2 ", b"PK\x03\x04", b"ncols 3\nnrows 2\n", b"ply\n", SUN, SUN[:4], b""),
    *(
        b"\x93NUMPY\x01\x00",
        b"\x93NUMPY",
        b"\x93NUMPY\x01\x00\x4f\x00{'descr': '<f4', 'fortran_order': False, 'shape': (",
    ),
    *(b"VERSION .7\n", b"# x\nFIELDS x y z\n", b"rows : 512\ncols : 512\n", b"rows 2\ncols 3\n\n"),
    *(pcd(data, b"", WIDTH=3, HEIGHT=2, POINTS=6) for data in ("ascii", "binary", "binary_compressed")),
    *(ply(*SIZE, "element vertex 6", "property uchar x", *GRID, body=b"", encoding=e) for e in ENCODINGS),
    ply(*SIZE, "element vertex ", body=b"")[:-11],
]


@settings(max_examples=400, deadline=None)
@given(prefix=st.sampled_from(PREFIXES), rest=st.binary(max_size=300))
@example(prefix=b"\x93NUMPY\x01\x00", rest=b"\x00")
def test_any_bytes(tmp_path_factory, prefix, rest):
    path = tmp_path_factory.getbasetemp() / "made up"
    path.write_bytes(prefix + rest)
    found = image_or_reason(path)
    if not isinstance(found, str):
        assert found.src.size
        assert found.src.ndim in (2, 3)


# What would fill the memory, or never end


def png_header(rows, cols):
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", cols, rows, 16, 0, 0, 0, 0))


def zipped(tmp_path, **sizes):
    """An NPZ of zeros."""
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, size in sizes.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array_header_1_0(
                    member, {"descr": "<f4", "fortran_order": False, "shape": (size // 4000, 1000)}
                )
                for _ in range(size // 4000):
                    member.write(bytes(4000))
    return path.read_bytes()


BIG = source.UNPACKED_FREELY + 2**20
BOMBS = [
    ("PNG", lambda _: png_header(11_600, 11_600) + chunk(b"IEND", b""), "taken for a bomb"),
    ("PNG of too many pixels", lambda _: png_header(2**31 - 1, 2**31 - 1) + chunk(b"IEND", b""), "pixels are more"),
    ("TIFF", lambda _: tiff(np.zeros((10_000, 10_000), np.float32), compression="zlib"), "taken for a bomb"),
    ("NPZ", lambda folder: zipped(folder, src=BIG), "taken for a bomb"),
    ("NPZ, beside", lambda folder: zipped(folder, src=8000, K=10**7), "K.npy has"),
    ("PCD blank", lambda _: b"\n" * 10**7, "none of PNG"),
    ("PCD of blanks", lambda _: b" " * 10**7, "none of PNG"),
    ("PCD of comments", lambda _: b"#\n" * 10**7, "none of PNG"),
    ("PCD without an end", lambda _: b"VERSION .7\n" * 10**6, "before its DATA"),
    ("PCD of all points there are", lambda _: pcd("binary", b"", WIDTH=10**9, HEIGHT=10**9, POINTS=10**18), "are more"),
    ("PCD of long counts", lambda _: pcd("binary", b"", COUNT=f"1 1 {10**12}"), "truncated"),
    ("PCD of one long word", lambda _: pcd("ascii", b"1" * 5 * 10**6), "word of a million"),
    ("PLY without an end", lambda _: b"ply\n" + b"comment\n" * 10**6, "no end"),
    ("PLY of many vertices", lambda _: ply(f"element vertex {10**15}", "property char x", body=b""), "truncated"),
    ("PLY of many lists", lambda _: ply("element vertex 1" + "0" * 15, GRID[1], body=b""), "truncated"),
    ("one line", lambda _: b"a" * 10**7, "none of PNG"),
    ("NUL", lambda _: bytes(10**7), "none of PNG"),
]


@pytest.mark.parametrize(("make", "what"), [b[1:] for b in BOMBS], ids=[b[0] for b in BOMBS])
def test_bombs_are_refused(tmp_path, make, what):
    path = tmp_path / "bomb"
    path.write_bytes(make(tmp_path))
    start = time.perf_counter()
    with pytest.raises(rangeedge.error, match=what):
        imreadRange(path)
    assert time.perf_counter() - start < SLOW


@pytest.mark.parametrize("length", ["1.5", "-1", "nan", "inf"])
def test_lists_have_whole_lengths(tmp_path, length):
    path = tmp_path / "grid.ply"
    lists = text("1 2 3", "4 5 6", "1 0", f"{length} 1")
    header = ("obj_info num_cols 2", "obj_info num_rows 1", "element vertex 2", *XYZ, "element range_grid 2", GRID[1])
    path.write_bytes(ply(*header, body=lists, encoding="ascii"))
    with pytest.raises(rangeedge.error, match="list of length"):
        imreadRange(path)


def test_what_packs_well_is_no_bomb(tmp_path):
    """A wall that fills the image, of a size that any computer has memory for."""
    wall = np.full((3000, 3000), 1500, np.uint16)
    for form, contents in (("PNG", cv2.imencode(".png", wall)[1].tobytes()), ("TIFF", tiff(wall, compression="zlib"))):
        assert len(contents) * source.UNPACKED_RATIO < wall.nbytes
        path = tmp_path / form
        path.write_bytes(contents)
        assert_array_equal(imreadRange(path).src, wall)


IN_LITTLE_MEMORY = """
import resource, sys, rangeedge
for path in sys.argv[2:]:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        rangeedge.imreadRange(path)
    except rangeedge.error:
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < int(sys.argv[1]), path
    else:
        raise AssertionError(path)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peaks are in KiB on Linux")
def test_bombs_take_no_more_than_their_file(tmp_path):
    paths = []
    for name, make, _ in BOMBS:
        (tmp_path / name).mkdir()
        paths.append(tmp_path / name / "bomb")
        paths[-1].write_bytes(make(tmp_path / name))
    largest = max(path.stat().st_size for path in paths)
    assert largest < 2**25
    command = [sys.executable, "-c", IN_LITTLE_MEMORY, str(2 * largest // 1024), *paths]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr


def test_limits_are_exact(tmp_path, monkeypatch):
    path = tmp_path / "a.npy"
    np.save(path, np.zeros((2, 4), np.float32))
    size = path.stat().st_size
    monkeypatch.setattr(source, "FILE_LIMIT", size)
    assert imreadRange(path).src.shape == (2, 4)
    monkeypatch.setattr(source, "FILE_LIMIT", size - 1)
    with pytest.raises(rangeedge.error, match="more than the 4 GiB"):
        imreadRange(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="of POSIX")
def test_what_is_no_regular_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path, what in ((tmp_path / "pipe", "a named pipe"), (tmp_path, "a directory"), ("/dev/zero", "a device")):
        with pytest.raises(rangeedge.error, match=what):
            imreadRange(path)


class Odd(os.PathLike):
    def __init__(self, name):
        self.name = name

    def __fspath__(self):
        return self.name


def test_odd_names(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((2, 4)))
    assert imreadRange(Odd(os.fsencode(tmp_path / "a.npy"))).src.shape == (2, 4)
    for name in (Odd(3), Odd(None), 3, None, b"a.npy"):
        with pytest.raises(rangeedge.error, match="`path` must be a file name"):
            imreadRange(name)
    for name in ("a\0b", "", "\udcff\ud800", tmp_path / ("a" * 300), tmp_path / "none"):
        with pytest.raises(rangeedge.error, match="cannot read"):
            imreadRange(name)
    if sys.platform == "linux":
        odd = os.fsencode(tmp_path) + b"/caf\xe9.npy"
        Path(os.fsdecode(odd)).write_bytes((tmp_path / "a.npy").read_bytes())
        assert imreadRange(Odd(odd)).src.shape == (2, 4)


@pytest.mark.parametrize("gap", [b"", b"\n", b"\r\n"])
def test_perceptron_files_short_by_some_bytes(tmp_path, gap):
    path = tmp_path / "perc.test.1"
    words = np.random.default_rng(0).integers(0, 2**20, 512 * 512).astype(">i4").tobytes()
    whole = text(*perceptron_header()) + gap + words
    path.write_bytes(whole)
    assert imreadRange(path).src.shape == (512, 512, 3)
    for missing in range(1, 9):
        path.write_bytes(whole[:-missing])
        with pytest.raises(rangeedge.error, match="where 1048576 are needed"):
            imreadRange(path)
