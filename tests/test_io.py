"""Every format there and back, and what cannot be read or written."""

from __future__ import annotations

import importlib.util
import io
import os
import struct
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from numpy.testing import assert_array_equal

import rangeedge
from rangeedge.io import imreadRange, imwriteRange
from rangeedge.io.atomic import write_atomically

DATA = Path(__file__).parents[2] / "shared" / "data"
K = [[525.0, 0, 319.5], [0, 524.0, 239.5], [0, 0, 1]]


def depth16(shape=(7, 5)):
    return np.random.default_rng(1).integers(0, 65536, shape, dtype=np.uint16)


def depth32(shape=(7, 5)):
    values = np.random.default_rng(2).uniform(-1, 4, shape).astype(np.float32)
    values[1, 2], values[3, 0] = np.nan, np.inf
    return values


def points32(shape=(7, 5)):
    values = np.random.default_rng(3).normal(size=(*shape, 3)).astype(np.float32)
    values[0, 0] = values[4, 1:3] = np.nan
    return values


def same(a, b):
    assert a.dtype == b.dtype
    assert a.shape == b.shape
    assert_array_equal(a, b)


def written(tmp_path, name, *lines, body=b""):
    """A file of text lines and bytes."""
    path = tmp_path / name
    path.write_bytes("".join(f"{line}\n" for line in lines).encode() + body)
    return path


# What our own writers store

ROUND_TRIPS = [
    (".png", depth16()),
    (".pgm", depth16()),
    (".tif", depth16()),
    (".tiff", depth32()),
    (".tiff", depth32().astype(np.float64)),
    (".tif", depth16().astype(np.int16)),
    (".tiff", points32()),
    (".tif", np.dstack([points32(), depth32()]).astype(np.float64)),
    (".pfm", depth32()),
    (".npy", depth16()),
    (".npy", depth32()),
    (".npy", depth16().astype(np.int32)),
    (".npy", points32().astype(np.float64)),
    (".npz", depth16()),
    (".npz", np.dstack([points32(), depth32()])),
    (".pcd", points32()),
    (".ply", points32()),
    (".PLY", points32()),
]


@pytest.mark.parametrize(("suffix", "src"), ROUND_TRIPS, ids=lambda v: getattr(v, "dtype", v))
def test_what_is_written_is_read(tmp_path, suffix, src):
    before = src.copy()
    assert imwriteRange(tmp_path / f"a{suffix}", src) is True
    assert_array_equal(src, before)
    image = imreadRange(str(tmp_path / f"a{suffix}"))
    same(image.src, src)
    assert image.geometry == {}
    assert image.src.flags.writeable
    assert [p.name for p in tmp_path.iterdir()] == [f"a{suffix}"]


@pytest.mark.parametrize(("suffix", "src"), ROUND_TRIPS, ids=lambda v: getattr(v, "dtype", v))
def test_views_are_written_as_their_copies(tmp_path, suffix, src):
    for name, view in (("flip", src[::-1, ::2]), ("swap", src.astype(src.dtype.newbyteorder(">")))):
        imwriteRange(tmp_path / f"{name}{suffix}", view)
        assert_array_equal(imreadRange(tmp_path / f"{name}{suffix}").src, view)


@pytest.mark.parametrize(
    ("src", "geometry"),
    [
        (depth32(), {"K": K}),
        (depth16(), {"K": np.float32(K), "depthFactor": 5000}),
        (depth32(), {"pixelSize": (0.5, 0.25), "heightMap": True}),
        (points32(), {"heightMap": True}),
        (depth32(), {"heightMap": False}),
    ],
)
def test_npz_keeps_the_geometry(tmp_path, src, geometry):
    imwriteRange(tmp_path / "a.npz", src, **geometry)
    image = imreadRange(tmp_path / "a.npz")
    same(image.src, src)
    assert image.geometry.keys() == geometry.keys()
    for key, value in geometry.items():
        assert_array_equal(image.geometry[key], value)
    if "K" in geometry:
        assert image.geometry["K"].dtype == np.float64


def test_one_pixel_size_stands_for_both(tmp_path):
    imwriteRange(tmp_path / "a.npz", depth32(), pixelSize=0.5)
    assert imreadRange(tmp_path / "a.npz").geometry == {"pixelSize": (0.5, 0.5)}


def test_invalid_points_come_back_as_nan_from_ply(tmp_path):
    points = points32()
    points[2, 2] = (1, np.inf, 3)
    imwriteRange(tmp_path / "a.ply", points)
    points[2, 2] = np.nan
    same(imreadRange(tmp_path / "a.ply").src, points)
    imwriteRange(tmp_path / "none.ply", np.full((2, 3, 3), np.nan))
    same(imreadRange(tmp_path / "none.ply").src, np.full((2, 3, 3), np.nan, np.float32))


def test_exr_there_and_back(tmp_path):
    pytest.importorskip("OpenEXR")
    imwriteRange(tmp_path / "a.exr", depth32())
    same(imreadRange(tmp_path / "a.exr").src, depth32())


def test_exr_without_its_package(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(rangeedge.error, match=r"pip install 'rangeedge\[exr\]'"):
        imwriteRange(tmp_path / "a.exr", depth32())
    assert not list(tmp_path.iterdir())
    with pytest.raises(rangeedge.error, match=r"pip install 'rangeedge\[exr\]'"):
        imreadRange(written(tmp_path, "a.exr", body=b"\x76\x2f\x31\x01"))


def test_zstd_without_its_package(tmp_path, monkeypatch):
    pytest.importorskip("imagecodecs")
    tifffile.imwrite(tmp_path / "a.tif", depth32(), compression="zstd")
    same(imreadRange(tmp_path / "a.tif").src, depth32())
    monkeypatch.setitem(sys.modules, "imagecodecs", None)
    with pytest.raises(rangeedge.error, match=r"compressed by ZSTD, .* pip install 'rangeedge\[tiff\]'"):
        imreadRange(tmp_path / "a.tif")


# The same formats as others write them


def test_pfm_of_either_byte_order_and_any_scale(tmp_path):
    upward = np.array([[4, 5, 6], [1, 2, 3]], np.float32)
    for scale, order in (("-1", "<"), ("1.0", ">"), ("-0.003922", "<"), ("2e3", ">")):
        body = f"Pf\n3 2\n{scale}\n".encode() + upward.astype(f"{order}f4").tobytes()
        same(imreadRange(written(tmp_path, "a.pfm", body=body)).src, upward[::-1])


def test_format_is_decided_by_content(tmp_path):
    imwriteRange(tmp_path / "a.png", depth16())
    (tmp_path / "a.png").rename(tmp_path / "a.xyz")
    same(imreadRange(tmp_path / "a.xyz").src, depth16())


def test_npy_of_fortran_order_big_endian_and_one_channel(tmp_path):
    np.save(tmp_path / "a.npy", np.asfortranarray(depth16().astype(">u2")[..., None]))
    same(imreadRange(tmp_path / "a.npy").src, depth16())


def test_npz_of_others(tmp_path):
    np.savez(tmp_path / "a.npz", rgb=np.zeros((7, 5, 3), np.uint8), z=depth32(), K=np.array(K))
    image = imreadRange(tmp_path / "a.npz")
    same(image.src, depth32())
    assert list(image.geometry) == ["K"]
    np.savez(tmp_path / "b.npz", depth32())
    same(imreadRange(tmp_path / "b.npz").src, depth32())
    np.savez(tmp_path / "c.npz", a=depth32(), b=depth32())
    with pytest.raises(rangeedge.error, match=r"none of its arrays \(a, b\)"):
        imreadRange(tmp_path / "c.npz")


# Bad files


def npy(array, **kwargs):
    stream = io.BytesIO()
    np.save(stream, array, **kwargs)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))[1].tobytes(), "colours"),
        (cv2.imencode(".png", np.zeros((4, 4, 3), np.uint16))[1].tobytes(), "colours"),
        (cv2.imencode(".png", np.zeros((4, 4), np.uint8))[1].tobytes(), "8 bits"),
        (cv2.imencode(".pgm", np.zeros((4, 4), np.uint8))[1].tobytes(), "8 bits"),
        (cv2.imencode(".jpg", np.zeros((4, 4), np.uint8))[1].tobytes(), "a JPEG"),
        (npy(np.array([[{}, {}]]), allow_pickle=True), "no range image"),
        (npy(np.zeros((2, 2), "c8")), "shape"),
        (npy(np.zeros((2, 2), bool)), "shape"),
        (npy(np.zeros((2, 2, 2), "f4")), "shape"),
        (npy(np.zeros((0, 2), "f4")), "not empty"),
        (npy(np.zeros(4, "f4")), "shape"),
        (npy(np.float32(1)), "shape"),
        (npy(np.zeros((2, 2), "f4")).replace(b"(2, 2)", b"(9, 9)"), "holds 16 bytes where 324"),
        (b"PF\n1 1\n-1\n" + bytes(12), "colours"),
        (b"\x1f\x8b\x08\x00", "unpack it first"),
        (struct.pack(">8I", 0x59A66A95, 512, 512, 24, 0, 1, 0, 0), "no ABW image"),
        (struct.pack(">8I", 0x59A66A95, 512, 512, 8, 0, 1, 1, 2**32 - 1), "needed"),
        (b"", "empty"),
    ],
)
def test_files_that_are_no_range_images(tmp_path, data, what):
    with pytest.raises(rangeedge.error, match=what):
        imreadRange(written(tmp_path, "a", body=data))


def test_npz_with_a_geometry_that_is_none(tmp_path):
    for key, value in (("K", np.eye(2)), ("pixelSize", [1, 2, 3]), ("heightMap", [1, 0]), ("depthFactor", -1.0)):
        np.savez(tmp_path / "a.npz", src=depth32(), **{key: value})
        with pytest.raises(rangeedge.error, match="cannot read"):
            imreadRange(tmp_path / "a.npz")


def test_missing_files_and_bad_paths(tmp_path):
    for path in (tmp_path / "none.png", tmp_path, "a\0b", ""):
        with pytest.raises(rangeedge.error, match="cannot read"):
            imreadRange(path)
    for path in (None, 3, b"a.png"):
        with pytest.raises(rangeedge.error, match="`path`"):
            imreadRange(path)
        with pytest.raises(rangeedge.error, match="`path`"):
            imwriteRange(path, depth16())


@pytest.mark.parametrize(
    ("name", "src", "geometry", "what"),
    [
        ("a.jpg", depth16(), {}, "suffixes"),
        ("a", depth16(), {}, "suffixes"),
        ("a.png", depth32(), {}, "uint16 for .png"),
        ("a.exr", points32(), {}, r"\(H, W\)"),
        ("a.pfm", depth16(), {}, r"\(H, W\) floats"),
        ("a.pcd", depth32(), {}, "depthTo3d"),
        ("a.ply", depth16(), {}, "depthTo3d"),
        ("a.pcd", points32()[1:2], {}, "at least two rows"),
        ("a.npy", np.zeros((3, 3), np.uint8), {}, "16 bits"),
        ("a.npy", np.zeros((3, 3), bool), {}, "`src`"),
        ("a.npy", np.zeros((3, 0), np.float32), {}, "`src`"),
        ("a.npy", [[1.0]], {}, "`src`"),
        ("a.npz", points32(), {"K": K}, "`K`"),
        ("a.npz", depth32(), {"K": np.eye(2)}, "`K`"),
        ("a.npz", depth32(), {"pixelSize": -1}, "`pixelSize`"),
        ("a.npz", depth32(), {"heightMap": 1}, "`heightMap`"),
        ("a.npz", depth32(), {"depthFactor": 0}, "`depthFactor`"),
        ("a.png", depth16(), {"K": K}, "only .npz"),
        ("none/a.png", depth16(), {}, "cannot write"),
        ("a\0.png", depth16(), {}, "cannot write"),
    ],
)
def test_what_cannot_be_written_leaves_nothing(tmp_path, name, src, geometry, what):
    with pytest.raises(rangeedge.error, match=what):
        imwriteRange(f"{tmp_path}/{name}", src, **geometry)
    assert not list(tmp_path.iterdir())


def test_a_failed_write_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(rangeedge.error, match="No space left"):
        imwriteRange(path, depth16())
    with pytest.raises(OSError, match="No space left"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


KILLED = """
import os, signal, sys
from rangeedge import io
from rangeedge.io import atomic
os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
sys.modules["os"].link = lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL)
atomic.write_atomically(sys.argv[1], b"new")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="files without a name are of Linux")
def test_a_killed_write_leaves_nothing(tmp_path):
    """Killed when all is written, and only the name is missing."""
    run = subprocess.run([sys.executable, "-c", KILLED, tmp_path / "a"], check=False)
    assert run.returncode == -9
    assert not list(tmp_path.iterdir())


def test_files_without_a_name_are_not_everywhere(tmp_path, monkeypatch):
    for name in ("O_TMPFILE", "link"):
        with monkeypatch.context() as patch:
            if name == "link":

                def refuse(*_, **__):
                    raise OSError("no links here")

                patch.setattr(os, "link", refuse)
            else:
                patch.delattr(os, name, raising=False)
            write_atomically(tmp_path / "a", name.encode())
        assert (tmp_path / "a").read_bytes() == name.encode()
        assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="of POSIX")
def test_a_pipe_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    with pytest.raises(rangeedge.error, match="is not a file"):
        imwriteRange(tmp_path / "a.png", depth16())
    assert [p.is_fifo() for p in tmp_path.iterdir()] == [True]


# Real frames


@pytest.fixture(scope="module")
def real():
    if not (DATA / "load.py").exists():
        pytest.skip(f"the real frames are not at {DATA}")
    spec = importlib.util.spec_from_file_location("load", DATA / "load.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")  # of load.py
def test_real_pcd(real):
    path = DATA / "synpeb_synthetic" / "test_100.pcd"
    found = real.read_pcd(str(path))
    same(imreadRange(path).src, np.dstack([found[axis] for axis in "xyz"]).astype(np.float32))


def test_real_png(real):
    for name in real.mosd_names()[:3]:
        src = imreadRange(DATA / "mosd" / f"{name}_depth.png").src
        assert src.dtype == np.uint16
        z = np.where(src == 0, np.nan, src / 1000).astype(np.float32)
        assert_array_equal(z, real.mosd(name)["z"])
