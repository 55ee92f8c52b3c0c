"""The samples that take frames from devices: cameras and ROS, played by stand-ins as strict as the originals."""

import importlib
import sys
from array import array
from pathlib import Path
from types import ModuleType, SimpleNamespace

import cv2
import numpy as np
import pytest

from rangeedge import detectEdges

SAMPLES = Path(__file__).resolve().parents[1] / "samples"
K = (180.0, 180.0, 49.5, 39.5)


def depths(count):
    """A box that moves before a wall, in millimetres."""
    stack = np.full((count, 80, 100), 1500, np.uint16)
    for index, depth in enumerate(stack):
        depth[20:60, 30 + index : 70] = 1000
    return stack


@pytest.fixture(autouse=True)
def from_samples(monkeypatch):
    monkeypatch.syspath_prepend(SAMPLES)
    yield
    for name in ("live", "ros2_node"):
        sys.modules.pop(name, None)


def sample(name):
    return importlib.import_module(name)


class TestLive:
    def camera(self, monkeypatch, stack, opened=True):
        """What `cv2.VideoCapture` is for OpenNI; every second map is not there yet."""
        log = []

        class VideoCapture:
            def __init__(self, device):
                assert device == cv2.CAP_OPENNI2
                self.left = [map for depth in stack for map in (None, depth)]

            def isOpened(self):
                return opened

            def grab(self):
                return bool(self.left)

            def retrieve(self, image=None, flag=0):
                assert flag == cv2.CAP_OPENNI_DEPTH_MAP
                depth = self.left.pop(0)
                return depth is not None, depth

            def release(self):
                log.append("released")

        monkeypatch.setattr(cv2, "VideoCapture", VideoCapture)
        return log

    def test_openni(self, monkeypatch, tmp_path, capsys):
        log = self.camera(monkeypatch, depths(3))
        sample("live").main(["--camera", "openni", "-K", "180,180,49.5,39.5", "--out", str(tmp_path)])
        lines = capsys.readouterr().out.splitlines()
        expected = [np.count_nonzero(detectEdges(depth, K=K)) for depth in depths(3)]
        assert [int(line.split("; ")[1].split()[0]) for line in lines[:3]] == expected
        assert min(expected) > 50
        assert log == ["released"]
        assert cv2.imread(str(tmp_path / "live.png")) is not None

    def test_a_window_until_a_key_is_pressed(self, monkeypatch, tmp_path, capsys):
        log = self.camera(monkeypatch, depths(9))
        keys, shown = [-1, -1, 27], []
        monkeypatch.setattr(cv2, "imshow", lambda title, picture: shown.append(picture))
        monkeypatch.setattr(cv2, "waitKey", lambda delay: keys.pop(0))
        argv = ["--camera", "openni", "-K", "180,180,49.5,39.5", "--show", "--out", str(tmp_path / "out")]
        sample("live").main(argv)
        assert len(shown) == 3
        assert log == ["released"]
        assert not (tmp_path / "out").exists()

    def test_a_camera_that_is_not_there(self, monkeypatch, tmp_path):
        self.camera(monkeypatch, [], opened=False)
        with pytest.raises(SystemExit, match="is it plugged in"):
            sample("live").main(["--camera", "openni", "-K", "180,180,49.5,39.5", "--out", str(tmp_path)])

    def test_openni_without_focal_lengths(self, capsys):
        with pytest.raises(SystemExit):
            sample("live").main(["--camera", "openni"])
        assert "needs -K" in capsys.readouterr().err

    def test_realsense_until_it_is_interrupted(self, monkeypatch, tmp_path, capsys):
        lens = SimpleNamespace(fx=K[0], fy=K[1], ppx=K[2], ppy=K[3])
        video = SimpleNamespace(get_intrinsics=lambda: lens)
        device = SimpleNamespace(first_depth_sensor=lambda: SimpleNamespace(get_depth_scale=lambda: 0.001))
        profile = SimpleNamespace(
            get_stream=lambda kind: SimpleNamespace(as_video_stream_profile=lambda: video) if kind == "depth" else None,
            get_device=lambda: device,
        )
        log, left = [], [None, *depths(2)]

        class Pipeline:
            def start(self):
                return profile

            def wait_for_frames(self):
                if not left:
                    raise KeyboardInterrupt
                depth = left.pop(0)
                frame = None if depth is None else SimpleNamespace(get_data=lambda: depth)
                return SimpleNamespace(get_depth_frame=lambda: frame)

            def stop(self):
                log.append("stopped")

        module = ModuleType("pyrealsense2")
        module.pipeline, module.stream = Pipeline, SimpleNamespace(depth="depth")
        monkeypatch.setitem(sys.modules, "pyrealsense2", module)
        sample("live").main(["--camera", "realsense", "--out", str(tmp_path)])
        expected = [np.count_nonzero(detectEdges(depth, K=K)) for depth in depths(2)]
        lines = capsys.readouterr().out.splitlines()
        assert [int(line.split("; ")[1].split()[0]) for line in lines[:2]] == expected
        assert log == ["stopped"]
        assert cv2.imread(str(tmp_path / "live.png")) is not None

    def test_realsense_without_its_package(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "pyrealsense2", None)
        with pytest.raises(SystemExit, match="pip install pyrealsense2"):
            sample("live").main(["--camera", "realsense"])


FIELDS = {"height": int, "width": int, "encoding": str, "is_bigendian": int, "step": int}


class Image:
    """A message as ROS generates it: known fields only, of their types alone."""

    def __init__(self, header, data, **fields):
        assert fields.keys() == FIELDS.keys()
        assert all(type(fields[name]) is kind for name, kind in FIELDS.items())
        assert isinstance(data, array)
        assert data.typecode == "B"
        self.header, self.data = header, data
        vars(self).update(fields)


def depth_message(depth, stamp):
    fields = {"height": 80, "width": 100, "encoding": "16UC1", "is_bigendian": 0, "step": 200}
    return Image(f"header {stamp}", array("B", depth.tobytes()), **fields)


def camera_message(size=(100, 80), model="plumb_bob", distortion=0.0):
    k = np.array([[K[0], 0, K[2]], [0, K[1], K[3]], [0, 0, 1]]).ravel()
    none = SimpleNamespace(x_offset=0, y_offset=0, width=0, height=0)
    known = {"k": k, "d": array("d", [distortion] * 5), "p": np.zeros(12), "roi": none, "binning_x": 0, "binning_y": 0}
    return SimpleNamespace(**known, width=size[0], height=size[1], distortion_model=model)


class Ros:
    """What the node uses of `rclpy`; `spin` plays a recording of topics and messages."""

    def __init__(self, monkeypatch, recording):
        self.published, self.warnings, self.log = [], [], []
        ros, subscriptions = self, {}

        class Node:
            def __init__(self, name):
                assert "init" in ros.log

            def create_publisher(self, kind, topic, depth):
                assert (kind, topic) == (Image, "edges")
                return SimpleNamespace(publish=ros.published.append)

            def create_subscription(self, kind, topic, callback, profile):
                assert profile == "sensor data"
                subscriptions[topic] = callback

            def get_logger(self):
                return SimpleNamespace(warning=ros.warnings.append)

            def destroy_node(self):
                ros.log.append("destroyed")

        def spin(node):
            for topic, message in recording:
                subscriptions[topic](message)
            raise KeyboardInterrupt

        def module(name, **content):
            found = ModuleType(name)
            vars(found).update(content)
            monkeypatch.setitem(sys.modules, name, found)

        module(
            "rclpy",
            init=lambda args: self.log.append("init"),
            spin=spin,
            try_shutdown=lambda: self.log.append("shut down"),
        )
        module("rclpy.executors", ExternalShutdownException=type("ExternalShutdownException", (Exception,), {}))
        module("rclpy.node", Node=Node)
        module("rclpy.qos", qos_profile_sensor_data="sensor data")
        module("sensor_msgs")
        module("sensor_msgs.msg", Image=Image, CameraInfo=SimpleNamespace)


class TestNode:
    def test_edges_are_published_under_the_header_of_their_image(self, monkeypatch):
        images = [("depth", depth_message(depth, stamp)) for stamp, depth in enumerate(depths(3))]
        ros = Ros(monkeypatch, [images[0], ("camera_info", camera_message()), *images])
        sample("ros2_node").main(["--ros-args", "-r", "depth:=/camera/depth/image_raw"])
        assert [message.header for message in ros.published] == ["header 0", "header 1", "header 2"]
        for message, depth in zip(ros.published, depths(3), strict=True):
            assert (message.height, message.width, message.step, message.encoding) == (80, 100, 100, "mono8")
            found = np.frombuffer(message.data, np.uint8).reshape(80, 100)
            assert np.array_equal(found, detectEdges(depth, K=K))
            assert np.count_nonzero(found) > 50
        assert ros.log == ["init", "destroyed", "shut down"]
        assert ros.warnings == []

    def test_what_it_cannot_use_is_told_and_does_not_end_it(self, monkeypatch):
        garbled = depth_message(depths(1)[0], 0)
        garbled.data = garbled.data[:-9]
        coloured = depth_message(depths(1)[0], 0)
        coloured.encoding = "rgb8"
        good = depth_message(depths(1)[0], 1)
        recording = [("camera_info", camera_message(model="equidistant", distortion=0.1)), ("depth", good)]
        recording += [("camera_info", camera_message()), ("depth", garbled), ("depth", coloured), ("depth", good)]
        recording += [("camera_info", camera_message((640, 480))), ("depth", good)]
        ros = Ros(monkeypatch, recording)
        sample("ros2_node").main(["--ros-args"])
        assert [message.header for message in ros.published] == ["header 1"]
        assert len(ros.warnings) == 4
        for said, why in zip(ros.warnings, ("equidistant", "truncated", "encoding is 'rgb8'", "640"), strict=True):
            assert why in said
