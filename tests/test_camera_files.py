"""Cameras in every form that tools write, and what is none."""

from __future__ import annotations

import io
import json

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

import rangeedge
from rangeedge.io.camera import matrix_of, read_camera

FX, FY, CX, CY = 615.5, 614.25, 319.5, 241.0
K = np.array([[FX, 0, CX], [0, FY, CY], [0, 0, 1]])
P = np.hstack([K, [[-30.0], [0], [0]]])
DISTORTION = [0.1, -0.2, 0.001, -0.002, 0.05]
ROWS, COLUMNS = K.ravel().tolist(), K.T.ravel().tolist()


def storage(suffix):
    """As cv2.FileStorage writes it."""
    writer = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    writer.write("image_width", 640)
    writer.write("image_height", 480)
    writer.write("camera_matrix", K)
    writer.write("distortion_coefficients", np.array([DISTORTION]))
    return writer.releaseAndGetString()


def npz(**arrays):
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


ROS_YAML = f"""image_width: 640
image_height: 480
camera_name: head # left
camera_matrix:
  rows: 3
  cols: 3
  data: {ROWS}
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: {DISTORTION}
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [600.0, 0.0, 300.0, 0.0, 0.0, 600.0, 200.0, 0.0, 0.0, 0.0, 1.0, 0.0]
"""
ROS1_ECHO = f"""header:
  seq: 12
  stamp:
    secs: 1500000000
    nsecs: 5
  frame_id: "camera_depth_optical_frame"
height: 480
width: 640
distortion_model: "plumb_bob"
D: {DISTORTION}
K: {ROWS}
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: {P.ravel().tolist()}
binning_x: 0
roi:
  x_offset: 0
  do_rectify: False
---
"""
ROS2_ECHO = "height: 480\nwidth: 640\ndistortion_model: plumb_bob\nd:\n" + "".join(
    [*(f"- {v}\n" for v in DISTORTION), "k:\n", *(f"- {v}\n" for v in ROWS), "r:\n", "- 1.0\n"]
)
BROKEN_LINES = f"K: [{FX}, 0.0, {CX},\n    0.0, {FY}, {CY},   # second row\n    0.0, 0.0, 1.0]\n"
REALSENSE = {
    **{"width": 640, "height": 480, "ppx": CX, "ppy": CY, "fx": FX, "fy": FY},
    **{"model": "distortion.brown_conrady", "coeffs": DISTORTION},
}
PLAIN = {**REALSENSE, "model": "distortion.inverse_brown_conrady", "coeffs": [0.0] * 5}
OPEN3D = {"width": 640, "height": 480, "intrinsic_matrix": COLUMNS}
WHOLE, BARE, SIZED = (K, DISTORTION, (640, 480)), (K, None, None), (K, None, (640, 480))

FILES = [
    ("cv2 YAML", storage(".yml"), WHOLE),
    ("cv2 JSON", storage(".json"), WHOLE),
    ("cv2 XML", storage(".xml"), WHOLE),
    ("ROS camera_info YAML", ROS_YAML, WHOLE),
    ("ROS camera_info YAML, CR LF", ROS_YAML.replace("\n", "\r\n"), WHOLE),
    ("ROS 1 topic, echoed", ROS1_ECHO, WHOLE),
    ("ROS 2 topic, echoed", ROS2_ECHO, WHOLE),
    ("ROS camera_info JSON", json.dumps({"width": 640, "height": 480, "k": ROWS, "d": DISTORTION}), WHOLE),
    ("a list over several lines", BROKEN_LINES, BARE),
    ("Open3D intrinsic", json.dumps(OPEN3D), SIZED),
    ("Open3D parameters", json.dumps({"extrinsic": list(range(16)), "intrinsic": OPEN3D}), SIZED),
    ("librealsense", json.dumps(REALSENSE), WHOLE),
    ("librealsense, no distortion", json.dumps(PLAIN), SIZED),
    ("depth and colour", json.dumps({"color": {**PLAIN, "fx": 9.0}, "depth": PLAIN}), SIZED),
    ("NeRF transforms", json.dumps({"fl_x": FX, "fl_y": FY, "cx": CX, "cy": CY, "w": 640.0, "h": 480.0}), SIZED),
    ("Kalibr", f"cam0:\n  intrinsics: [{FX}, {FY}, {CX}, {CY}]\n  resolution: [640, 480]\n", SIZED),
    ("fx fy cx cy as YAML", f"fx: {FX}\nfy: {FY}\ncx: {CX}\ncy: {CY}\n", BARE),
    ("four numbers", f"{FX} {FY} {CX} {CY}\n", BARE),
    ("four numbers, commas", f"{FX}, {FY}, {CX}, {CY}", BARE),
    ("nine numbers", f"# depth\n{FX} 0 {CX}\n0 {FY} {CY}\n0 0 1\n", BARE),
    ("nine numbers by columns", " ".join(map(str, COLUMNS)), BARE),
    ("brackets of NumPy", str(K), BARE),
    ("projection 3x4", "\n".join(" ".join(map(str, row)) for row in P), BARE),
    ("ScanNet 4x4", "\n".join(" ".join(map(str, row)) for row in np.vstack([P, [0, 0, 0, 1]])), BARE),
    ("NPY 3x3", npy(K), BARE),
    ("NPY float32 by 9", npy(K.astype(np.float32).ravel()), BARE),
    ("NPZ of the tutorials", npz(mtx=K, dist=np.array([DISTORTION])), (K, DISTORTION, None)),
    ("nested JSON lists", json.dumps({"K": K.tolist()}), BARE),
    ("with a byte order mark", "\ufeff" + ROS_YAML, WHOLE),
]


@pytest.mark.parametrize(("content", "expected"), [f[1:] for f in FILES], ids=[f[0] for f in FILES])
def test_camera_files(tmp_path, content, expected):
    path = tmp_path / "camera"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    camera = read_camera(path)
    assert_array_equal(camera.K, expected[0])
    assert camera.K.dtype == np.float64
    assert (camera.distCoeffs is None) == (expected[1] is None)
    if expected[1]:
        assert_array_equal(camera.distCoeffs, expected[1])
    assert camera.size == expected[2]


REFUSED = [
    ("", "names no camera matrix"),
    ("1 2 3 4 5", "names no camera|no YAML"),
    ("fx: 500\nfy: 500\n", "names no camera matrix"),
    ("0 0 0 0", "no camera matrix"),
    ("nan 500 320 240", "no camera matrix"),
    (f"{FX} 0 {CX} 1 {FY} {CY} 0 0 1", "no camera matrix"),
    (json.dumps({"left": PLAIN, "right": PLAIN}), r"2 cameras \(left, right\)"),
    (json.dumps({**REALSENSE, "model": "distortion.inverse_brown_conrady"}), "undistort"),
    (f"K: {ROWS}\nD: [0.1, 0.0, 0.0, 0.0]\ndistortion_model: equidistant\n", "fisheye"),
    (f"K: {ROWS}\nD: [0.1, 0.2, 0.3]\n", "3 coefficients"),
    (f"K: {ROWS}\nD: [.nan, 0, 0, 0]\n", "not finite"),
    ("K: [1, 2", "not closed"),
    ("K: [1, 2]]", "follows the end"),
    ("K: &a [1]", "no YAML|names no"),
    ("a poem\nof two lines", "no YAML"),
    ("{", "JSON is garbled"),
    ("<a>", "XML is garbled"),
    ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "entities"),
    ("[" * 10**5, "cannot read"),
    ("a: " + "[" * 10**5 + "]" * 10**5, "nested"),
    ("".join(" " * i + "a:\n" for i in range(100)), "nested"),
    ("a" + " " * 10**6 + "b", "no YAML"),
    ("K: [\n" + "1,\n" * 300_000, "not closed"),
    ("#" * 2**20, "names no camera"),
    ("#" * (2**20 + 1), "more than a camera file"),
    (npy(np.eye(5)), "shape"),
    (npz(K=np.zeros(10**5)), "more than the"),
]


@pytest.mark.parametrize(("content", "what"), REFUSED, ids=range(len(REFUSED)))
def test_files_that_hold_no_camera(tmp_path, content, what):
    path = tmp_path / "camera"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(rangeedge.error, match=what) as caught:
        read_camera(path)
    assert caught.value.func == "read_camera"


@pytest.mark.parametrize(
    "values", [(FX, FY, CX, CY), ROWS, COLUMNS, K, K.tolist(), P, P.ravel(), [ROWS], np.array(COLUMNS)[:, None]]
)
def test_matrix_of_arrays(values):
    assert_array_equal(matrix_of(values), K)


def test_matrix_of_others():
    for values in (3, [], [1, 2, 3], np.eye(2), np.zeros((3, 3)), [[1, 2], [3]], np.full((3, 4), np.inf)):
        with pytest.raises(ValueError, match=r"camera|sequence|inhomogeneous"):
            matrix_of(values)


@settings(max_examples=300, deadline=None)
@given(st.sampled_from([f[1] for f in FILES]), st.data())
def test_changed_camera_files_are_read_or_refused(tmp_path_factory, content, data):
    content = bytearray(content if isinstance(content, bytes) else content.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "camera"
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        camera = read_camera(path)
    except rangeedge.error:
        return
    assert camera.K.shape == (3, 3)
    assert camera.K[0, 0] > 0


def test_a_camera_of_images_of_another_size(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text(f"image_width: 64\nimage_height: 48\nK: {ROWS}\n")
    depth = np.full((48, 64), 2.0, np.float32)
    assert not rangeedge.detectEdges(depth, K=path).any()
    half = depth[::2, ::2]
    with pytest.raises(rangeedge.error, match=r"detectEdges: `src` has 32 x 24 .* 64 x 48: .* x = 0.5 and y = 0.5"):
        rangeedge.detectEdges(half, K=path)
    assert not rangeedge.detectEdges(half, K=path, imageSize=(32, 24)).any()
    assert not rangeedge.detectEdges(half, K=rangeedge.ScanLineParams(K=path).K).any()
    with pytest.raises(rangeedge.error, match="`imageSize` must be None where K is not given"):
        rangeedge.detectEdges(depth, imageSize=(64, 48))
    for wrong in (64, (64,), (64, 0), (64.5, 48)):
        with pytest.raises(rangeedge.error, match="`imageSize` must be"):
            rangeedge.detectEdges(depth, K=path, imageSize=wrong)
    assert rangeedge.project(np.array([0.0, 0, 1]), K=path).shape == (3,)
    detector = rangeedge.createScanLineDetector()
    detector.setK(path)
    detector.setMaxGap(3)
    assert detector.getImageSize() == (64, 48)
    with pytest.raises(rangeedge.error, match="64 x 48"):
        detector.detect(half)
    detector.save(tmp_path / "detector.yml")
    other = rangeedge.createScanLineDetector()
    other.load(tmp_path / "detector.yml")
    assert other.getImageSize() == (64, 48)


def test_an_image_is_written_with_the_lens_of_its_camera(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text(f"image_width: 64\nimage_height: 48\nK: {ROWS}\nD: [0.1, 0.01, 0, 0]\n")
    depth = np.full((48, 64), 2.0, np.float32)
    rangeedge.imwriteRange(tmp_path / "depth.npz", depth, K=path)
    _, geometry = rangeedge.imreadRange(tmp_path / "depth.npz")
    assert geometry["K"].tolist() == np.reshape(ROWS, (3, 3)).tolist()
    assert geometry["distCoeffs"].tolist() == [0.1, 0.01, 0, 0]
    with pytest.raises(rangeedge.error, match="64 x 48"):
        rangeedge.imwriteRange(tmp_path / "half.npz", depth[::2], K=path)
    assert not (tmp_path / "half.npz").exists()
