"""Files small and garbled that would fill the memory, take hours or kill the process: refused, soon."""

import json
import os
import struct
import time
import zipfile
import zlib

import cv2
import numpy as np
import pytest
from test_inputs import chunk
from test_recordings import rvl

import rangeedge
from rangeedge import Line, imreadRange, readLines, writeLines
from rangeedge.batch import framesOf
from rangeedge.io.camera import read_camera
from rangeedge.recording.manifest import read_lines
from rangeedge.recording.messages import depth_of_compressed

SLOW = 2.0  # seconds of processor time
LINE_SUFFIXES = ("csv", "ply", "obj", "geojson", "svg")


@pytest.fixture(autouse=True)
def soon():
    start = time.process_time()
    yield
    assert time.process_time() - start < SLOW


# TIFF


def tiff(tags, data=b""):
    """A file of these tags (code, type, count, value) behind the data, which begins at byte 8."""
    entries = b"".join(struct.pack("<HHII", *entry) for entry in sorted(tags))
    return struct.pack("<2sHI", b"II", 42, 8 + len(data)) + data + struct.pack("<H", len(tags)) + entries + bytes(4)


def float_tags(rows, cols, *more):
    tags = {256: (4, 1, cols), 257: (4, 1, rows), 258: (3, 1, 32), 259: (3, 1, 1), 262: (3, 1, 1), 273: (4, 1, 8)}
    tags |= {277: (3, 1, 1), 278: (4, 1, rows), 279: (4, 1, 4 * rows * cols), 339: (3, 1, 3)}
    return [(code, *entry) for code, entry in {**tags, **dict(more)}.items()]


def test_tiff_whose_metadata_never_end(tmp_path):
    pixels, metadata = np.ones(20, "<f4").tobytes(), b'role="scale"' * 40_000
    path = tmp_path / "a.tif"
    path.write_bytes(tiff(float_tags(4, 5, (42112, (2, len(metadata), 88))), pixels + metadata))
    assert (imreadRange(path).src == 1).all()


def test_tiff_of_pages_that_overlap(tmp_path):
    """Each of the 4000 pages has 60 000 entries, which are those of the others as well."""
    entries, pages = 60_000, 4000
    table = np.zeros(entries + pages, [("code", "<u2"), ("kind", "<u2"), ("count", "<u4"), ("v", "<u2"), ("n", "<u2")])
    table["code"], table["kind"], table["count"], table["n"] = np.arange(len(table)) % 65536, 3, 1, entries
    data = bytearray(struct.pack("<2sHIH", b"II", 42, 8, entries) + table.tobytes())
    for page in range(pages):
        end = 8 + 12 * page + 2 + 12 * entries
        data[end : end + 4] = struct.pack("<I", 8 + 12 * (page + 1))
    path = tmp_path / "a.tif"
    path.write_bytes(data)
    for read in (imreadRange, lambda path: framesOf(path)[0].read()):
        with pytest.raises(rangeedge.error, match="pages overlap"):
            read(path)


def test_tiff_whose_strips_are_one(tmp_path):
    """Each of 20 000 rows is the same strip of 4 MB, which unpacks to one row."""
    rows, cols = 20_000, 4
    strip = b"\x78\x01" + b"\0\0\0\xff\xff" * 800_000 + b"\x01\x10\x00\xef\xff" + bytes(16)
    places = [np.full(rows, value, "<u4").tobytes() for value in (8, len(strip))]
    start = 8 + len(strip)
    more = ((259, (3, 1, 8)), (278, (4, 1, 1)), (273, (4, rows, start)), (279, (4, rows, start + 4 * rows)))
    path = tmp_path / "a.tif"
    path.write_bytes(tiff(float_tags(rows, cols, *more), strip + b"".join(places)))
    with pytest.raises(rangeedge.error, match="strips or tiles overlap"):
        imreadRange(path)


@pytest.mark.parametrize("counts", [-1, -(2**31)])
def test_tiff_of_strips_of_negative_size(tmp_path, counts):
    path = tmp_path / "a.tif"
    path.write_bytes(tiff(float_tags(4, 5, (279, (9, 1, counts % 2**32))), np.ones(20, "<f4").tobytes()))
    with pytest.raises(rangeedge.error, match="overlap"):
        imreadRange(path)


@pytest.mark.parametrize(("code", "kind"), [(339, 1), (34735, 3)])
def test_tiff_of_endless_tags(tmp_path, code, kind):
    pixels, values = np.ones(20, "<f4").tobytes(), 10_000_000
    path = tmp_path / "a.tif"
    content = (b"\3" if kind == 1 else b"\0\0") * values
    path.write_bytes(tiff(float_tags(4, 5, (code, (kind, values, 88))), pixels + content))
    assert (imreadRange(path).src == 1).all()


# Recordings


def npy_header(stream, shape, kind="<u2"):
    np.lib.format.write_array_header_1_0(stream, {"descr": kind, "fortran_order": False, "shape": shape})


@pytest.mark.parametrize("shape", [(10**12, 0, 5), (2**20 + 1, 1, 0), (10**9, 0, 0, 3)])
def test_frames_without_pixels(tmp_path, shape):
    with open(tmp_path / "a.npy", "wb") as stream:
        npy_header(stream, shape)
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive, archive.open("src.npy", "w") as member:
        npy_header(member, shape)
    for name in ("a.npy", "b.npz"):
        (frame,) = framesOf(tmp_path / name)
        with pytest.raises(rangeedge.error, match="frames, more than the 1048576 that are listed"):
            frame.read()


def test_zarr_of_more_than_there_is(tmp_path):
    zarr = pytest.importorskip("zarr")
    zarr.create_array(str(tmp_path / "many.zarr"), shape=(10**11, 480, 640), chunks=(1, 480, 640), dtype="u2")
    zarr.create_array(str(tmp_path / "large.zarr"), shape=(1, 200_000, 200_000), chunks=(1, 1000, 1000), dtype="u2")
    zarr.create_array(str(tmp_path / "chunks.zarr"), shape=(2, 480, 640), chunks=(1, 200_000, 200_000), dtype="u2")
    for name, what in (
        ("many", "frames, more than"),
        ("large", "pixels are more"),
        ("chunks", "more than .* that are unpacked"),
    ):
        with pytest.raises(rangeedge.error, match=what):
            framesOf(tmp_path / f"{name}.zarr")[0].read()


def compressed(data, form="16UC1; compressedDepth png"):
    class Message:
        format = form

    Message.data = bytes(12) + data
    return Message


def test_depth_that_unpacks_to_gigabytes():
    header = struct.pack(">IIBBBBB", 16_000, 16_000, 16, 0, 0, 0, 0)
    png = (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(bytes(10**6)))
        + chunk(b"IEND", b"")
    )
    with pytest.raises(ValueError, match="taken for a bomb"):
        depth_of_compressed(compressed(png))


@pytest.mark.parametrize("numbers", [(0, 2**64 - 2), (2**64 - 5, 1), (0, 3, 2**40, 1, 1)])
def test_rvl_of_numbers_beyond_32_bits(numbers):
    nibbles = []
    for number in numbers:
        while number > 7:
            nibbles.append(number & 7 | 8)
            number >>= 3
        nibbles.append(number)
    nibbles += [0] * (-len(nibbles) % 8)
    words = [sum(n << (28 - 4 * i) for i, n in enumerate(nibbles[k : k + 8])) for k in range(0, len(nibbles), 8)]
    packed = struct.pack("<ii", 4, 4) + np.array(words, "<u4").tobytes()
    with pytest.raises(ValueError, match="numbers are garbled"):
        depth_of_compressed(compressed(packed, "16UC1; compressedDepth rvl"))


def test_rvl_of_depths_beyond_16_bits():
    packed = bytearray(rvl(np.full((4, 4), 7, np.uint16)))
    assert (depth_of_compressed(compressed(bytes(packed), "16UC1; compressedDepth rvl")) == 7).all()
    far = rvl(np.array([[2**15] * 4] * 4, np.int64) * np.array([1, -1, 1, -1]))
    with pytest.raises(ValueError, match="more than 16 bits"):
        depth_of_compressed(compressed(bytes(far), "16UC1; compressedDepth rvl"))


def test_manifests_nested_deeply(tmp_path):
    (tmp_path / "m").write_text('{"frame": ' + "[" * 100_000 + '\n{"frame": "a"}\n')
    assert read_lines(tmp_path / "m") == {"a": {"frame": "a"}}


# Parameters and cameras

NESTED = {
    "json": '{"ScanLineDetector": ' + "[" * 10**5,
    "maps.json": '{"ScanLineDetector": ' + '{"a": ' * 10**5,
    "yml": "%YAML:1.0\n---\nScanLineDetector: " + "[" * 10**5,
    "closed.yml": "ScanLineDetector: " + "[" * 10**5 + "]" * 10**5,
    "maps.yml": "ScanLineDetector: " + "{a: " * 10**5,
    "dashes.yml": "ScanLineDetector:\n   " + "- " * 10**5 + "1\n",
    "blocks.yml": "ScanLineDetector:\n" + "".join(" " * i + "a:\n" for i in range(1, 1000)),
    "xml": '<?xml version="1.0"?><opencv_storage><ScanLineDetector>' + "<a>" * 10**5,
    "closed.xml": "<opencv_storage><ScanLineDetector>"
    + "<a>" * 500
    + "</a>" * 500
    + "</ScanLineDetector></opencv_storage>",
}


@pytest.mark.parametrize("name", NESTED)
def test_parameters_and_cameras_nested_deeply(tmp_path, name):
    """OpenCV follows them by recursion until the process ends."""
    path = tmp_path / name
    path.write_text(NESTED[name])
    for read in (rangeedge.createScanLineDetector().load, read_camera):
        with pytest.raises(rangeedge.error, match="cannot read"):
            read(path)


def test_nodes_nested_deeply():
    text = '{"node": ' + '{"a": ' * 500 + "1" + "}" * 501
    fs = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    with pytest.raises(rangeedge.error, match="nested more than"):
        rangeedge.createScanLineDetector().read(fs.getNode("node"))


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
def test_parameters_with_any_byte_changed(tmp_path, suffix):
    """Read by OpenCV, some of these end the process."""
    detector = rangeedge.createScanLineDetector(rangeedge.ScanLineParams(K=(50, 50, 16, 12), noise=np.ones((2, 3))))
    path = tmp_path / f"a.{suffix}"
    detector.save(path)
    content, rng = path.read_bytes(), np.random.default_rng(0)
    for _ in range(100):
        changed = bytearray(content)
        for at in rng.integers(len(changed), size=2):
            changed[at : at + 2] = rng.integers(256, size=rng.integers(4), dtype=np.uint8).tobytes()
        path.write_bytes(changed)
        try:
            detector.load(path)
        except rangeedge.error:
            continue


@pytest.mark.parametrize("matrix", ["rows: -1", "rows: 100000", "rows: 2\n      dt: 99999999d", "rows: x", "dt: 5"])
def test_parameters_of_damaged_matrices(tmp_path, matrix):
    path = tmp_path / "a.yml"
    keys = {"rows": "2", "cols": "1", "dt": "d", "data": "[ 1., 2. ]"}
    keys |= dict(line.strip().split(": ") for line in matrix.split("\n"))
    body = "".join(f"      {key}: {value}\n" for key, value in keys.items())
    path.write_text(f"ScanLineDetector:\n   noise: !!opencv-matrix\n{body}")
    with pytest.raises(rangeedge.error, match="`noise` is a damaged matrix"):
        rangeedge.createScanLineDetector().load(path)


def test_yaml_of_blanks(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("K: [" + " " * 500_000 + '"]\n')
    with pytest.raises(rangeedge.error, match="no camera"):
        read_camera(path)


# Lines


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="of POSIX")
@pytest.mark.parametrize("suffix", ["csv", "yml"])
def test_what_never_ends(tmp_path, suffix):
    read = readLines if suffix == "csv" else rangeedge.createScanLineDetector().load
    os.mkfifo(tmp_path / f"pipe.{suffix}")
    os.symlink("/dev/zero", tmp_path / f"zero.{suffix}")
    for name, what in (("pipe", "a named pipe"), ("zero", "a device")):
        with pytest.raises(rangeedge.error, match=what):
            read(tmp_path / f"{name}.{suffix}")


FEATURE = {
    "geometry": {"type": "LineString", "coordinates": [[1, 2, 3]]},
    "properties": {"kind": "jump", "closed": False},
}


def with_properties(**properties):
    known = {**FEATURE["properties"], **properties}
    return json.dumps({"features": [{**FEATURE, "properties": known}]})


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        ("geojson", '{"features": ' + "[" * 100_000),
        ("geojson", "[]"),
        ("geojson", with_properties(kind=5)),
        ("geojson", with_properties(kind="")),
        ("geojson", with_properties(kind="\udcff")),
        ("geojson", with_properties(kind='"><script>')),
        ("geojson", with_properties(closed="x")),
        ("geojson", with_properties(crease="x")),
        ("geojson", with_properties().replace("1, 2", "1" * 400)),
        ("csv", "line,kind,closed,u,v,x,y,z\n0," + "j" * 200_000 + ",0,1,2,3,4,5\n"),
        ("csv", "line,kind,closed,u,v,x,y,z,a\n0,jump,0,1,2,3,4,5," + "[" * 100_000 + "\n"),
        ("csv", "line,kind,closed,u,v,x,y,z\n0\n"),
        ("obj", "v 1 2 3\nl " + "9" * 30 + " 1\n"),
        ("svg", "<svg>" * 10_000),
        ("svg", '<svg xmlns="http://www.w3.org/2000/svg"><path class="jump" d="M 1,2" data-properties="5"/></svg>'),
    ],
    ids=range(15),
)
def test_garbled_lines(tmp_path, suffix, content):
    path = tmp_path / f"a.{suffix}"
    path.write_text(content)
    with pytest.raises(rangeedge.error, match="it holds no lines"):
        readLines(path)


PIXELS, POINTS = np.ones((2, 2)), np.ones((2, 3))
ODD_LINES = [
    Line(5, False, PIXELS, POINTS, {}),
    Line("", False, PIXELS, POINTS, {}),
    Line("jump\udcff", False, PIXELS, POINTS, {}),
    Line('"<a', False, PIXELS, POINTS, {}),
    Line("jump", 1, PIXELS, POINTS, {}),
    Line("jump", False, None, None, {}),
    Line("jump", False, PIXELS, np.ones((3, 3)), {}),
    Line("jump", False, PIXELS, POINTS.astype(object), {}),
    Line("jump", False, PIXELS, POINTS, None),
    Line("jump", False, PIXELS, POINTS, {"a": object()}),
    Line("jump", False, PIXELS, POINTS, {5: 1}),
    Line("jump", False, PIXELS, POINTS, {"crease": "x"}),
]


@pytest.mark.parametrize("line", ODD_LINES, ids=range(len(ODD_LINES)))
def test_lines_that_are_none(tmp_path, line):
    for suffix in LINE_SUFFIXES:
        with pytest.raises(rangeedge.error, match=r"`(lines|closed)` must be"):
            writeLines(tmp_path / f"a.{suffix}", [line])
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("suffix", LINE_SUFFIXES)
def test_lines_of_extreme_values(tmp_path, suffix):
    """Written as they are, or refused as a whole."""
    values = [1e300, -1e300, np.inf, np.nan, 5e-324]
    lines = [Line("jump", False, np.full((2, 2), v), np.full((2, 3), v), {"jump": v, "list": [v]}) for v in values]
    path = tmp_path / f"a.{suffix}"
    for line in lines:
        try:
            writeLines(path, [line])
        except rangeedge.error:
            assert not path.exists()
        else:
            assert len(readLines(path)) == 1
            path.unlink()
