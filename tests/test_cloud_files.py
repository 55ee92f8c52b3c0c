"""Organized clouds in PCD and PLY, by hand-made files."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from test_io import same, written

import rangeedge
from rangeedge import imreadRange


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
    ],
)
def test_text_headers_that_are_refused(tmp_path, lines, what):
    with pytest.raises(rangeedge.error, match=what):
        imreadRange(written(tmp_path, "a", *lines))
