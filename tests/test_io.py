"""Every format there and back, by hand-made files, truncated, and garbled."""

from __future__ import annotations

import importlib.util
import io
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import rangeedge
from rangeedge import _core
from rangeedge.io import imreadRange, imwriteRange
from rangeedge.io.atomic import write_atomically
from rangeedge.io.calibration import abwPoints, perceptronPoints

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


def image_or_reason(path):
    try:
        return imreadRange(path)
    except rangeedge.error as reason:
        return str(reason)


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


def test_exr_or_a_clear_error(tmp_path):
    available = True
    try:
        imwriteRange(tmp_path / "a.exr", depth32())
    except rangeedge.error as reason:
        available = "OpenCV cannot write" not in str(reason)
    if available:
        same(imreadRange(tmp_path / "a.exr").src, depth32())
    else:
        assert not list(tmp_path.iterdir())


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


def pcd_lines(data, fields="x y z", size="4 4 4", kind="F F F", count="1 1 1", width=3, height=2):
    return [
        *("# .PCD v.7 - Point Cloud Data file format", "VERSION .7", f"FIELDS {fields}", f"SIZE {size}"),
        *(f"TYPE {kind}", f"COUNT {count}", f"WIDTH {width}", f"HEIGHT {height}", "VIEWPOINT 0 0 0 1 0 0 0"),
        *(f"POINTS {width * height}", f"DATA {data}"),
    ]


def grid32():
    points = np.arange(18, dtype=np.float32).reshape(2, 3, 3)
    points[0, 2] = np.nan
    return points


def test_pcd_ascii(tmp_path):
    rows = ["0 1 2", "3 4 5", "nan nan nan", "9 10 11", "12 13 14", "15 16 17"]
    same(imreadRange(written(tmp_path, "a.pcd", *pcd_lines("ascii"), *rows)).src, grid32())


MIXED = {"fields": "rgb _ x normal z y", "size": "4 1 8 4 4 4", "kind": "U U F F F F", "count": "1 3 1 2 1 1"}
MIXED_TYPE = np.dtype([("rgb", "<u4"), ("_", "u1", 3), ("x", "<f8"), ("normal", "<f4", 2), ("z", "<f4"), ("y", "<f4")])


def mixed_records():
    records = np.zeros(6, MIXED_TYPE)
    records["rgb"], records["_"], records["normal"] = 77, 88, 99
    for i, axis in enumerate("xyz"):
        records[axis] = grid32().reshape(6, 3)[:, i]
    return records


def test_pcd_binary_with_other_fields(tmp_path):
    body = mixed_records().tobytes()
    same(imreadRange(written(tmp_path, "a.pcd", *pcd_lines("binary", **MIXED), body=body)).src, grid32())


def lzf_literally(data):
    """LZF without any repetition."""
    runs = [data[i : i + 32] for i in range(0, len(data), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def test_pcd_compressed_is_stored_field_after_field(tmp_path):
    records = mixed_records()
    plain = b"".join(records[name].tobytes() for name in MIXED_TYPE.names)
    packed = lzf_literally(plain)
    body = struct.pack("<II", len(packed), len(plain)) + packed
    path = written(tmp_path, "a.pcd", *pcd_lines("binary_compressed", **MIXED), body=body)
    same(imreadRange(path).src, grid32())
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(rangeedge.error, match="truncated"):
        imreadRange(path)


@pytest.mark.parametrize(
    ("packed", "plain"),
    [
        (b"\x02abc", b"abc"),
        (b"\x02abc\x20\x02", b"abcabc"),  # length 1 + 2, distance 2 + 1
        (b"\x00a\x40\x00", b"aaaaa"),  # length 2 + 2 over itself, distance 1
        (b"\x01ab\xe0\x03\x01", b"ab" * 7),  # length 7 + 3 + 2, distance 2
        (bytes([31, *range(32)]) * 10 + b"\x21\x3f", bytes(range(32)) * 10 + bytes(range(3))),  # distance 256 + 63 + 1
    ],
)
def test_lzf(packed, plain):
    assert lzf(packed, len(plain)) == plain
    assert lzf(packed, len(plain) + 1) is lzf(packed, len(plain) - 1) is None
    for end in range(len(packed)):
        assert lzf(packed[:end], len(plain)) is None


def test_lzf_refers_to_nothing_before_the_start():
    assert lzf(b"\x00a\x20\x00", 4) == b"aaaa"
    assert lzf(b"\x00a\x20\x01", 4) is None


def lzf(packed, size):
    out = np.full(size, 255, np.uint8)
    return out.tobytes() if _core.lzf_unpack(np.frombuffer(packed, np.uint8), out) else None


def ply_lines(encoding, *lines):
    return ["ply", f"format {encoding} 1.0", *lines, "end_header"]


XYZ = ("property float x", "property float y", "property float z")
GRID = ("obj_info num_cols 3", "obj_info num_rows 2", "element vertex 5", *XYZ)
GRID_LIST = ("element range_grid 6", "property list uchar int vertex_indices")


def test_ply_stanford_range_grid_ascii(tmp_path):
    vertices = ["0 1 2", "3 4 5", "9 10 11", "12 13 14", "15 16 17"]
    indices = ["1 0", "1 1", "0", "1 2", "1 3", "1 4"]
    lines = ply_lines("ascii", "obj_info is_mesh 0", *GRID, *GRID_LIST)
    same(imreadRange(written(tmp_path, "a.ply", *lines, *vertices, *indices)).src, grid32())


@pytest.mark.parametrize(("encoding", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
def test_ply_binary_of_other_layout(tmp_path, encoding, order):
    """An element to be skipped, doubles and colours, and the vertices in any order."""
    layout = np.dtype([("red", "u1"), ("z", order + "f8"), ("y", order + "f4"), ("x", order + "i2")])
    vertices = np.zeros(5, layout)
    for i, axis in enumerate("xyz"):
        vertices[axis] = np.delete(grid32().reshape(6, 3)[:, i], 2)[::-1]
    lines = ply_lines(
        encoding,
        *("comment made by hand", "obj_info num_cols 3", "obj_info num_rows 2"),
        *("element face 2", "property uchar flag", "property list uchar ushort vertex_indices"),
        *("element vertex 5", "property uchar red", "property double z", "property float y", "property short x"),
        *GRID_LIST,
    )
    faces = struct.pack(order + "BBHHHBB", 1, 3, 0, 1, 2, 0, 0)
    grid = b"".join(struct.pack(order + "Bi", 1, 4 - i) for i in range(2)) + b"\0"
    grid += b"".join(struct.pack(order + "Bi", 1, 2 - i) for i in range(3))
    same(imreadRange(written(tmp_path, "a.ply", *lines, body=faces + vertices.tobytes() + grid)).src, grid32())


@pytest.mark.parametrize(
    "size",
    [
        ("comment width 3", "comment height 2"),
        ("comment Width: 3", "comment Height: 2"),
        ("obj_info width 3", "obj_info height 2"),
        ("obj_info num_cols 3", "obj_info num_rows 2"),
    ],
)
def test_ply_with_its_size_in_a_comment(tmp_path, size):
    path = written(tmp_path, "a.ply", *ply_lines("binary_little_endian", *size, "element vertex 6", *XYZ))
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n") + grid32().tobytes())
    same(imreadRange(path).src, grid32())


def test_ply_with_the_camera_of_pcl(tmp_path):
    camera = ("element camera 1", "property float view_px", "property int viewportx", "property int viewporty")
    lines = ply_lines("binary_little_endian", "element vertex 6", *XYZ, *camera)
    body = grid32().tobytes() + struct.pack("<fii", 0, 3, 2)
    same(imreadRange(written(tmp_path, "a.ply", *lines, body=body)).src, grid32())


# Classic scanners

SUN = struct.pack(">8I", 0x59A66A95, 512, 512, 8, 512 * 512, 1, 0, 0)


def test_abw_by_hand():
    code = np.zeros((512, 512), np.uint8)
    code[255, 255], code[155, 355], code[355, 255] = 100, 200, 200
    first, second = abwPoints(code, 1), abwPoints(code, 2)
    # 100 / 0.773545 + 785.410786 and 100 / 0.791686 + 771.016866, on the axis
    assert_allclose(first[255, 255], [0, 0, 914.6859], rtol=1e-6)
    assert_allclose(second[255, 255], [0, 0, 897.3296], rtol=1e-6)
    # depth 1043.9610 at 100 columns to the right, 100 rows up: / 16.10981722, and / 1.4508 for the row
    assert_allclose(first[155, 355], [64.8027, -44.6669, 1043.9610], rtol=2e-6)
    assert_allclose(first[355, 255], [0, 44.6669, 1043.9610], rtol=2e-6)
    assert np.isnan(first).all(axis=2).sum() == 512 * 512 - 3
    assert np.isnan(first[code == 0]).all()
    assert first.dtype == np.float32


def test_abw_file(tmp_path):
    code = np.random.default_rng(0).integers(0, 256, (512, 512), dtype=np.uint8)
    for name, calibration in (("abw.test.19.range", 1), ("abw.test.1.range", 2), ("x.ras", 2), ("abw.test.190", 2)):
        path = written(tmp_path, name, body=SUN + code.tobytes())
        same(imreadRange(path).src, abwPoints(code, calibration))
    same(imreadRange(path, calibration=1).src, abwPoints(code, 1))
    coloured = SUN[:24] + struct.pack(">II", 1, 6) + b"\1" * 6 + code.tobytes()
    same(imreadRange(written(tmp_path, "map.ras", body=coloured)).src, abwPoints(code, 2))


def test_perceptron_by_hand():
    code = np.full((512, 512), 1000, np.uint16)
    points = perceptronPoints(code)
    assert points.dtype == np.float32
    # Straight ahead, between columns 255 and 256, the beam leaves the mirrors as if they were not there:
    # (1000 + 830.3) * 0.20236 = 370.3795
    centre = points[255:257, 255:257].reshape(4, 3)
    assert_allclose(centre[:, 2], 370.3795, atol=1e-3)
    assert_allclose(centre.mean(axis=0)[:2], 0, atol=1e-3)
    # Column 0: alpha = 51.65 * 255.5 / 512 = 25.774560, beta = 0.035869 degrees; dz = -3 (1 - cos alpha) = -0.298464,
    # dy = dz tan(45 + beta / 2) = -0.298651, dx = (5.5 + dy) tan alpha = 2.511582, ray = 370.401981.
    assert_allclose(points[255, 0], [-163.573957, 0.089836, 333.252872], rtol=2e-6, atol=1e-5)
    assert_allclose(points[255, 511], [163.573957, 0.089836, 333.252872], rtol=2e-6, atol=1e-5)
    # Row 0: beta = 36.73 * 255.5 / 512 = 18.329131 degrees upward.
    assert_allclose(points[0, 255], [-0.330900, -116.475098, 351.588431], rtol=1e-5)
    assert_allclose(perceptronPoints(np.zeros((1, 1), int))[0, 0], [-75.581497, -47.210334, 143.456863], rtol=1e-6)


def perceptron_header(rows=512, cols=512):
    return [f"rows : {rows}", f"columns : {cols}", *(f"key {i} : value {i}" for i in range(8))]


@pytest.mark.parametrize("gap", [b"", b"\n", b"\r\n"])
def test_perceptron_file(tmp_path, gap):
    random = np.random.default_rng(0)
    code, reflectance = random.integers(0, 4096, (512, 512)), random.integers(-(2**19), 2**19, (512, 512))
    if gap:
        code[0, 0], reflectance[0, 0] = 0x20A, 0x0A0A0  # words that begin with white space
    body = gap + (code + 4096 * reflectance).astype(">i4").tobytes()
    same(imreadRange(written(tmp_path, "perc.test.3", *perceptron_header(), body=body)).src, perceptronPoints(code))


def technical_arts(header, rows=2, cols=3, order=slice(None)):
    flag = np.array([[1, 1, 0], [1, 1, 1]])[:rows, :cols]
    images = [flag, *np.where(flag[..., None], grid32(), 0).transpose(2, 0, 1)]
    return [*header, *(" ".join(f"{v:g}" for v in row) for image in images for row in image)]


@pytest.mark.parametrize(
    "header",
    [
        ("rows 2", "columns 3", ""),
        ("2 rows", "3 cols", "pixel float"),
        ("", "2 3", ""),
        ("image", "ncols = 3", "nrows = 2"),
    ],
)
def test_technical_arts(tmp_path, header):
    image = imreadRange(written(tmp_path, "cube.dat", *technical_arts(header)))
    same(image.src, grid32())
    assert image.geometry == {"heightMap": True}


def test_scanners_refuse_what_is_no_code():
    for code in (np.zeros((2, 2), np.uint16), np.zeros((2, 2, 3), np.uint8), [[1]]):
        with pytest.raises(rangeedge.error, match="`code`"):
            abwPoints(code)
    for code in (np.full((2, 2), 4096), np.full((2, 2), -1), np.zeros((2, 2)), None):
        with pytest.raises(rangeedge.error, match="`code`"):
            perceptronPoints(code)
    for calibration in (0, 3, None, True, 1.0):
        with pytest.raises(rangeedge.error, match="`calibration`"):
            abwPoints(np.zeros((2, 2), np.uint8), calibration)


# Bad files


def samples(tmp_path):
    """One small file of every format, by name."""
    for suffix, src in ROUND_TRIPS:
        imwriteRange(tmp_path / f"{src.dtype}-{src.ndim}{suffix.lower()}", src)
    written(tmp_path, "ascii.pcd", *pcd_lines("ascii"), *["1 2 3"] * 6)
    packed = lzf_literally(bytes(72))
    body = struct.pack("<II", len(packed), 72) + packed
    written(tmp_path, "compressed.pcd", *pcd_lines("binary_compressed"), body=body)
    written(tmp_path, "ascii.ply", *ply_lines("ascii", *GRID, *GRID_LIST), *["1 2 3"] * 5, *["1 1"] * 5, "0 ")
    written(tmp_path, "cube.dat", *technical_arts(("rows 2", "columns 3", "")))
    return {path.name: path.read_bytes() for path in sorted(tmp_path.iterdir())}


def test_truncated_files(tmp_path):
    for name, data in samples(tmp_path).items():
        whole = imreadRange(tmp_path / name).src
        path = tmp_path / f"cut-{name}"
        for end in {*range(0, len(data) - 2, 1 + len(data) // 40), *range(len(data) - 6, len(data) - 2)}:
            path.write_bytes(data[:end])
            found = image_or_reason(path)
            if isinstance(found, str):
                assert repr(str(path)) in found
            else:  # only tags that do not belong to the pixels are missing
                assert name.endswith((".tif", ".tiff")), end
                assert_array_equal(found.src, whole)


@pytest.mark.parametrize("end", [0, 4, 31, 32, 1000, -1])
def test_truncated_scans(tmp_path, end):
    header = "".join(f"{line}\n" for line in perceptron_header()).encode()
    for data in (SUN + bytes(512 * 512), header + b"\n" + bytes(512 * 512 * 4)):
        path = written(tmp_path, "scan", body=data)
        assert imreadRange(path).src.shape == (512, 512, 3)
        path.write_bytes(data[:end] if end >= 0 else data + b"x")
        with pytest.raises(rangeedge.error, match="cannot read"):
            imreadRange(path)


SAMPLES: dict[str, bytes] = {}


@pytest.fixture(scope="module", autouse=True)
def _samples(tmp_path_factory):
    SAMPLES.update(samples(tmp_path_factory.mktemp("samples")))


PREFIXES = [
    *(b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0*", b"P5\n3 2\n65535\n", b"P2 ", b"\x76\x2f\x31\x01", b"Pf\n3 2\n-1\n"),
    *(b"Pf ", b"PF\n", b"\x93NUMPY\x01\x00", b"\x93NUMPY", b"PK\x03\x04", b"ply\n", SUN, b"\x59\xa6\x6a\x95", b""),
    b"\x93NUMPY\x01\x00\x4f\x00{'descr': '<f4', 'fortran_order': False, 'shape': (",
    "\n".join(pcd_lines("binary")).encode() + b"\n",
    "\n".join(pcd_lines("binary_compressed")).encode() + b"\n",
    *(b"VERSION .7\n", b"# x\nFIELDS x y z\n", b"rows : 512\ncols : 512\n", b"rows 2\ncols 3\n\n"),
    *("\n".join(ply_lines(e, *GRID, *GRID_LIST)).encode() + b"\n" for e in ("ascii", "binary_big_endian")),
    b"ply\nformat binary_little_endian 1.0\nobj_info num_cols 3\nobj_info num_rows 2\nelement vertex ",
]


def reads_or_raises(path, data):
    path.write_bytes(data)
    found = image_or_reason(path)
    if isinstance(found, str):
        assert str(path) in found
    else:
        assert found.src.size
        assert found.src.ndim in (2, 3)


@settings(max_examples=400, deadline=None)
@given(prefix=st.sampled_from(PREFIXES), rest=st.binary(max_size=300))
@example(prefix=PREFIXES[9], rest=b"\x00")
def test_any_bytes_read_or_raise(tmp_path_factory, prefix, rest):
    reads_or_raises(tmp_path_factory.getbasetemp() / "fuzz", prefix + rest)


@settings(max_examples=400, deadline=None)
@given(data=st.data())
def test_changed_bytes_read_or_raise(tmp_path_factory, data):
    name = data.draw(st.sampled_from(sorted(SAMPLES)))
    content = bytearray(SAMPLES[name])
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    reads_or_raises(tmp_path_factory.getbasetemp() / "fuzz", bytes(content))


@pytest.mark.parametrize(
    ("lines", "what"),
    [
        (pcd_lines("ascii", width=6, height=1), "unorganized"),
        (pcd_lines("binary", width=10**9, height=10**9), "pixels are more than"),
        (pcd_lines("binary", count=f"1 1 {10**12}"), "truncated"),
        (pcd_lines("ascii", fields="a b c"), "x, y and z|values"),
        (pcd_lines("ascii", size="4 4 3"), "FIELDS, SIZE and TYPE"),
        (pcd_lines("zipped"), "unknown DATA"),
        (pcd_lines("binary")[:-1], "before its DATA"),
        ([*pcd_lines("binary")[:-2], "POINTS 7", "DATA binary"], "disagree"),
        ([*ply_lines("ascii", "element vertex 2", *XYZ), "1 2 3", "4 5 6"], "unorganized"),
        (ply_lines("ascii", "element vertex 2"), "no properties"),
        (ply_lines("ascii", "element face 0", "property float x"), "no element vertex"),
        (ply_lines("octal", *GRID), "unknown format"),
        (ply_lines("ascii", "element vertex 5", "property string x"), "property string x"),
        (ply_lines("binary_big_endian", f"element vertex {10**15}", *XYZ), "truncated"),
        (
            ply_lines("ascii", *GRID, "element range_grid 6", GRID_LIST[1]) + ["1 2 3"] * 5 + ["1 5"] * 6,
            "vertex 5 of 5",
        ),
        (ply_lines("ascii", *GRID, "element range_grid 5", GRID_LIST[1]) + ["1 2 3"] * 5 + ["0"] * 5, "2 rows of 3"),
        (ply_lines("ascii", *GRID) + ["1 2 3"] * 5, "2 rows of 3"),
        (perceptron_header(4, 4), "no Perceptron"),
        (["a poem", "in three lines", "without numbers", "at all"], "no known text format"),
        (["2", "lines"], "none of PNG"),
        (["rows 2", "cols 3", "", "1 2 3"], "where 24 values"),
    ],
)
def test_text_headers_that_are_refused(tmp_path, lines, what):
    with pytest.raises(rangeedge.error, match=what):
        imreadRange(written(tmp_path, "a", *lines))


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


def test_calibration_belongs_to_abw(tmp_path):
    imwriteRange(tmp_path / "a.png", depth16())
    with pytest.raises(rangeedge.error, match="no ABW image"):
        imreadRange(tmp_path / "a.png", calibration=1)
    with pytest.raises(rangeedge.error, match="`calibration`"):
        imreadRange(tmp_path / "a.png", calibration=3)


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
