"""Recordings as frames: what each kind holds, under which names, and with which camera."""

import json
import struct
import tracemalloc
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from rangeedge import error, imwriteRange
from rangeedge.batch import framesOf, runBatch
from rangeedge.recording.messages import camera_of, depth_of_compressed, depth_of_image, points_of_cloud

K = np.array([[50, 0, 19.5], [0, 50, 14.5], [0, 0, 1.0]])
D = np.array([0.1, -0.05, 0.001, -0.002, 0.01])


def depths(count=4):
    """A box that moves before a wall, in millimetres, with a hole."""
    stack = np.full((count, 30, 40), 1500, np.uint16)
    for index, depth in enumerate(stack):
        depth[8:20, 10 + index : 28] = 1000
        depth[2, 3] = 0
    return stack


def points(stack):
    y, x = np.indices(stack.shape[1:])
    z = np.where(stack > 0, stack / 1000, np.nan).astype(np.float32)
    return np.stack([(x - 19.5) / 50 * z, (y - 14.5) / 50 * z, z], axis=-1).astype(np.float32)


def names(frames):
    return [frame.name for frame in frames]


def assert_frames(frames, expected):
    assert len(frames) == len(expected)
    for frame, src in zip(frames, expected, strict=True):
        found = frame.read().src
        assert found.dtype == src.dtype
        assert np.array_equal(found, src, equal_nan=src.dtype.kind == "f")


class TestStacks:
    def test_npy_of_depths_and_of_points(self, tmp_path):
        np.save(tmp_path / "a.npy", depths())
        np.save(tmp_path / "b.npy", points(depths()))
        assert_frames(framesOf(tmp_path / "a.npy"), depths())
        assert_frames(framesOf(tmp_path / "b.npy"), points(depths()))
        assert names(framesOf(tmp_path / "a.npy"))[:2] == ["a/0000", "a/0001"]

    def test_one_image_is_no_stack(self, tmp_path):
        np.save(tmp_path / "a.npy", depths()[0])
        np.save(tmp_path / "b.npy", points(depths())[0])
        assert names(framesOf([tmp_path / "a.npy", tmp_path / "b.npy"])) == ["a", "b"]

    def test_npz_with_its_camera(self, tmp_path):
        np.savez_compressed(tmp_path / "a.npz", depth=depths(), K=K, depthFactor=500)
        frames = framesOf(tmp_path / "a.npz")
        assert_frames(frames, depths())
        assert frames[0].read().geometry["depthFactor"] == 500
        assert np.array_equal(frames[0].read().geometry["K"], K)

    @pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
    def test_npz_in_any_order(self, tmp_path, save):
        save(tmp_path / "a.npz", depth=depths())
        save(tmp_path / "f.npz", depth=np.asfortranarray(depths()))
        for name in ("a", "f"):
            frames = framesOf(tmp_path / f"{name}.npz")
            for index in (2, 0, 3, 3, 1):
                assert_frames(frames[index : index + 1], depths()[index : index + 1])

    def test_npz_takes_the_memory_of_one_frame(self, tmp_path):
        stack = np.random.default_rng(0).integers(500, 540, (70, 480, 640)).astype(np.uint16)
        np.savez(tmp_path / "a.npz", depth=stack)
        tracemalloc.start()
        try:
            frames = framesOf(tmp_path / "a.npz")
            assert all(np.array_equal(frame.read().src, src) for frame, src in zip(frames, stack, strict=True))
            assert tracemalloc.get_traced_memory()[1] < 2**25 < stack.nbytes
        finally:
            tracemalloc.stop()

    def test_a_garbled_npz_is_noticed_before_its_first_frame_is_taken(self, tmp_path):
        np.savez(tmp_path / "a.npz", depth=depths())
        data = bytearray((tmp_path / "a.npz").read_bytes())
        data[len(data) // 2] ^= 1
        (tmp_path / "a.npz").write_bytes(data)
        (frame,) = framesOf(tmp_path / "a.npz")
        with pytest.raises(error, match=r"cannot read .*a\.npz': .*CRC"):
            frame.read()

    def test_tiff_of_many_pages(self, tmp_path):
        assert cv2.imwritemulti(str(tmp_path / "a.tif"), list(depths()))
        assert_frames(framesOf(tmp_path / "a.tif"), depths())

    def test_zarr_with_its_camera(self, tmp_path):
        zarr = pytest.importorskip("zarr")
        array = zarr.create_array(str(tmp_path / "a.zarr"), data=depths(), chunks=(1, 30, 40))
        array.attrs["K"] = K.tolist()
        group = zarr.open_group(str(tmp_path / "b.zarr"), mode="w")
        group.create_array("depth", data=depths(), chunks=(2, 30, 40))
        group.attrs["pixelSize"] = 0.5
        assert_frames(framesOf(tmp_path / "a.zarr"), depths())
        assert framesOf(tmp_path / "a.zarr")[1].read().geometry == {"K": K.tolist()}
        assert framesOf(tmp_path / "b.zarr")[1].read().geometry == {"pixelSize": 0.5}

    @pytest.mark.parametrize("version", [2, 3])
    def test_chunks_of_a_zarr_that_are_truncated(self, tmp_path, version):
        zarr = pytest.importorskip("zarr")
        zarr.create_array(str(tmp_path / "a.zarr"), data=depths(), chunks=(1, 30, 40), zarr_format=version)
        chunk = tmp_path / "a.zarr" / ("2.0.0" if version == 2 else "c/2/0/0")
        chunk.write_bytes(chunk.read_bytes()[:-5])
        frames = framesOf(tmp_path / "a.zarr")
        assert_frames([*frames[:2], frames[3]], depths()[[0, 1, 3]])
        with pytest.raises(error, match=r"cannot read .*a\.zarr', frame 2"):
            frames[2].read()

    @pytest.mark.parametrize("name", ["zarr.json", ".zarray"])
    def test_a_zarr_that_is_garbled(self, tmp_path, name):
        pytest.importorskip("zarr")
        (tmp_path / "a.zarr").mkdir()
        (tmp_path / "a.zarr" / name).write_text("{")
        (frame,) = framesOf(tmp_path / "a.zarr")
        with pytest.raises(error, match=r"cannot read .*a\.zarr'"):
            frame.read()

    def test_a_stack_that_is_written_again_is_read_again(self, tmp_path):
        np.save(tmp_path / "a.npy", depths())
        assert_frames(framesOf(tmp_path / "a.npy"), depths())
        np.save(tmp_path / "new.npy", depths(2) + 1)
        (tmp_path / "new.npy").replace(tmp_path / "a.npy")
        assert_frames(framesOf(tmp_path / "a.npy"), depths(2) + 1)

    def test_what_is_garbled_is_a_frame_that_fails(self, tmp_path):
        np.save(tmp_path / "a.npy", depths())
        data = (tmp_path / "a.npy").read_bytes()
        (tmp_path / "a.npy").write_bytes(data[:-100])
        np.save(tmp_path / "b.npy", depths().astype(np.uint8))
        short, coarse = framesOf(tmp_path / "a.npy"), framesOf(tmp_path / "b.npy")
        assert names(short) == ["a"]
        with pytest.raises(error, match=r"cannot read .*a\.npy"):
            short[0].read()
        with pytest.raises(error, match=r"b\.npy', frame 2: it holds an uint8 array"):
            coarse[2].read()


class TestFolders:
    def test_in_the_order_of_numbers_with_the_camera_beside(self, tmp_path):
        for index in (10, 9, 1):
            imwriteRange(tmp_path / f"f{index}.png", depths()[0])
        (tmp_path / "notes.md").write_text("no image")
        (tmp_path / "intrinsics.json").write_text(json.dumps({"fx": 50, "fy": 50, "ppx": 19.5, "ppy": 14.5}))
        frames = framesOf(tmp_path)
        assert names(frames) == ["f1", "f9", "f10"]
        assert np.array_equal(frames[0].read().geometry["K"], K)
        given = frames[0].read(K=(60, 60, 20, 15)).geometry
        assert given == {"K": (60, 60, 20, 15)}

    def test_a_camera_that_cannot_be_read_fails_frames_that_have_none(self, tmp_path):
        imwriteRange(tmp_path / "a.png", depths()[0])
        imwriteRange(tmp_path / "b.npz", depths()[0], K=K)
        (tmp_path / "camera.yaml").write_text("nothing: here\n")
        without, own = framesOf(tmp_path)
        with pytest.raises(error, match=r"camera of its folder cannot be used: .*camera\.yaml.*; or give -K"):
            without.read()
        assert without.read(K=(60, 60, 20, 15)).geometry == {"K": (60, 60, 20, 15)}
        assert np.array_equal(own.read().geometry["K"], K)

    def test_the_camera_of_a_file_goes_before_that_of_its_folder(self, tmp_path):
        imwriteRange(tmp_path / "b.npz", depths()[0], K=K)
        (tmp_path / "camera.json").write_text(json.dumps({"fx": 9, "fy": 9, "ppx": 1, "ppy": 1, "coeffs": [0.1] * 5}))
        (frame,) = framesOf(tmp_path)
        geometry = frame.read().geometry
        assert geometry.keys() == {"K"}
        assert np.array_equal(geometry["K"], K)

    def test_folders_in_a_folder(self, tmp_path):
        (tmp_path / "in").mkdir()
        with pytest.raises(error, match=r"no range images; of the folders in it, give .*\*\*"):
            framesOf(tmp_path)

    def test_patterns(self, tmp_path):
        for name in ("a1.png", "a2.png", "b1.png"):
            imwriteRange(tmp_path / name, depths()[0])
        assert names(framesOf(tmp_path / "a*.png")) == ["a1", "a2"]

    def test_tum(self, tmp_path):
        folder = tmp_path / "rgbd_dataset_freiburg1_box"
        (folder / "depth").mkdir(parents=True)
        lines = ["# depth maps", "# timestamp filename"]
        for index, depth in enumerate(depths()):
            imwriteRange(folder / "depth" / f"{index}.5.png", depth)
            lines.append(f"{index}.5 depth/{index}.5.png")
        (folder / "depth.txt").write_text("\n".join([*lines, "9.5 depth/9.5.png", ""]))
        frames = framesOf(folder)
        assert names(frames)[0] == "rgbd_dataset_freiburg1_box/0.5"
        assert_frames(frames[:4], depths())
        assert frames[0].read().geometry == {"depthFactor": 5000, "K": (525, 525, 319.5, 239.5)}
        with pytest.raises(error, match=r"9\.5\.png"):
            frames[4].read()
        (folder / "depth.txt").write_text("\ufeff" + "\r\n".join([*lines, lines[-1], "12.0 depth/1.5.png"]), "utf-8")
        assert_frames(framesOf(folder), depths())
        for nothing in ("", "# depth maps\n"):
            (folder / "depth.txt").write_text(nothing)
            with pytest.raises(error, match="names no images"):
                framesOf(folder)[0].read()
        (folder / "depth.txt").write_bytes(b"\0" * 50)
        with pytest.raises(error, match="no time and file"):
            framesOf(folder)[0].read()
        (folder / "depth.txt").write_text("1 2 3\n")
        with pytest.raises(error, match="line 1 is '1 2 3'"):
            framesOf(folder)[0].read()

    def test_names_that_lead_out_are_refused(self, tmp_path):
        folder = tmp_path / "seq"
        folder.mkdir()
        (folder / "depth.txt").write_text("1 ..\n")
        with pytest.raises(error, match="has no name"):
            framesOf(folder)


def written_bag(path, kind, messages):
    """A bag of messages (topic, time, message of `kind`), made by functions of a typestore."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_HUMBLE)
    if kind == "ros1":
        writer, serialize = Writer1(path), store.serialize_ros1
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer, serialize = Writer(path, version=9, storage_plugin=plugin), store.serialize_cdr
    with writer:
        connections = {}
        for topic, time, make in messages:
            message = make(store.types, kind == "ros1")
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
            writer.write(connections[topic], time, serialize(message, message.__msgtype__))
    return path


def header(types, first, second=1):
    stamp = types["builtin_interfaces/msg/Time"](sec=second, nanosec=2)
    return types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera", **({"seq": 0} if first else {}))


def image_message(depth, second=1):
    encoding = {"uint16": "16UC1", "float32": "32FC1", "uint8": "mono8"}[depth.dtype.name]
    return lambda types, first: types["sensor_msgs/msg/Image"](
        header=header(types, first, second),
        height=depth.shape[0],
        width=depth.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=depth.strides[0],
        data=np.ascontiguousarray(depth).view(np.uint8).ravel(),
    )


def compressed_message(depth, form="16UC1; compressedDepth png"):
    data = b"\0" * 12 + cv2.imencode(".png", depth)[1].tobytes()
    return lambda types, first: types["sensor_msgs/msg/CompressedImage"](
        header=header(types, first), format=form, data=np.frombuffer(data, np.uint8)
    )


def cloud_message(cloud):
    """Coordinates in records of 20 bytes, behind a field of another kind."""
    rows, cols = cloud.shape[:2]
    records = np.zeros((rows, cols, 5), np.float32)
    records[..., 1:4] = cloud

    def make(types, first):
        field = types["sensor_msgs/msg/PointField"]
        fields = [field(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(["i", "x", "y", "z"])]
        return types["sensor_msgs/msg/PointCloud2"](
            header=header(types, first),
            height=rows,
            width=cols,
            fields=fields,
            is_bigendian=False,
            point_step=20,
            row_step=20 * cols,
            data=records.view(np.uint8).ravel(),
            is_dense=False,
        )

    return make


def camera_message(distortion=D, factor=1, second=1, model="plumb_bob"):
    scaled = K * [[factor], [factor], [1]]
    values = {"D": distortion, "K": scaled.ravel(), "R": np.eye(3).ravel(), "P": np.zeros(12)}

    def make(types, first):
        own = values if first else {name.lower(): value for name, value in values.items()}
        region = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        return types["sensor_msgs/msg/CameraInfo"](
            header=header(types, first, second),
            height=30,
            width=40,
            distortion_model=model,
            binning_x=0,
            binning_y=0,
            roi=region,
            **own,
        )

    return make


BAG_KINDS = {"ros1": "walk.bag", "ros2": "walk", "mcap": "walk"}


@pytest.mark.parametrize("kind", BAG_KINDS)
class TestBags:
    @pytest.fixture(autouse=True)
    def rosbags(self):
        pytest.importorskip("rosbags")

    def bag(self, kind, tmp_path, *messages):
        return written_bag(tmp_path / BAG_KINDS[kind], kind, messages)

    def depth_bag(self, kind, tmp_path):
        images = [("/cam/depth/image_raw", 1000 + i, image_message(depth)) for i, depth in enumerate(depths())]
        other = ("/cam/rgb/image_raw", 1001, image_message(np.zeros((30, 40), np.uint8)))
        return self.bag(kind, tmp_path, ("/cam/depth/camera_info", 1000, camera_message()), *images, other)

    def test_depth_images_with_their_camera(self, kind, tmp_path):
        frames = framesOf(self.depth_bag(kind, tmp_path))
        assert names(frames)[:2] == ["walk/cam/depth/image_raw/1000", "walk/cam/depth/image_raw/1001"]
        assert_frames(frames, depths())
        geometry = frames[0].read().geometry
        assert np.array_equal(geometry["K"], K)
        assert np.array_equal(geometry["distCoeffs"], D)

    def test_a_camera_that_changes(self, kind, tmp_path):
        """By stamps where these agree, however late a camera is recorded; else the last one before the image."""
        images = [("/d/image", 100 * i, image_message(depth, i)) for i, depth in enumerate(depths(), 1)]
        cameras = [(90, 1, 1), (205, 2, 2), (305, 7, 3)]
        infos = [("/d/camera_info", time, camera_message(0 * D, factor, stamp)) for time, stamp, factor in cameras]
        frames = framesOf(self.bag(kind, tmp_path, *sorted([*images, *infos], key=lambda message: message[1])))
        factors = [frame.read().geometry["K"][0, 0] / K[0, 0] for frame in frames]
        assert factors == [1, 2, 2, 3]
        assert all("distCoeffs" not in frame.geometry for frame in frames)

    def test_a_camera_that_cannot_be_used(self, kind, tmp_path):
        bag = self.bag(
            kind,
            tmp_path,
            ("/d/camera_info", 1, camera_message(model="equidistant")),
            *[("/d/image", 2 + i, image_message(depth)) for i, depth in enumerate(depths())],
        )
        frames = framesOf(bag)
        assert len(frames) == 4
        with pytest.raises(error, match=r"the camera in '/d/camera_info' cannot be used: .* or give -K"):
            frames[0].read()
        assert {item.state for item in runBatch(bag, tmp_path / "out", form="png", K=K)} == {"written"}

    def test_images_of_another_size_than_their_camera_says(self, kind, tmp_path):
        bag = self.bag(
            kind, tmp_path, ("/d/camera_info", 1, camera_message()), ("/d/i", 2, image_message(depths()[0][:20]))
        )
        (item,) = runBatch(bag, tmp_path / "out", form="png")
        assert item.state == "failed"
        assert "40 x 30" in item.message

    def test_results_equal_those_of_the_images(self, kind, tmp_path):
        bag = self.bag(
            kind,
            tmp_path,
            ("/depth/camera_info", 5, camera_message(np.zeros(5))),
            *[("/depth/image", 10 + i, image_message(depth)) for i, depth in enumerate(depths())],
        )
        np.savez(tmp_path / "walk.npz", src=depths(), K=K)
        for source, out in ((bag, "bag"), (tmp_path / "walk.npz", "images")):
            assert {item.state for item in runBatch(source, tmp_path / out, form="npz")} == {"written"}
        ones, others = (sorted((tmp_path / out).rglob("*.npz")) for out in ("bag", "images"))
        assert len(ones) == len(others) == 4
        for one, other in zip(ones, others, strict=True):
            assert one.read_bytes() == other.read_bytes()

    def test_compressed_depth_and_clouds(self, kind, tmp_path):
        messages = [("/a/image/compressedDepth", 1 + i, compressed_message(depth)) for i, depth in enumerate(depths())]
        messages += [("/b/points", 1 + i, cloud_message(cloud)) for i, cloud in enumerate(points(depths()))]
        bag = self.bag(kind, tmp_path, *messages)
        assert len(framesOf(bag)) == 8
        assert_frames(framesOf(bag, topics=["/a/image/compressedDepth"]), depths())
        assert_frames(framesOf(bag, topics=["/b/points"]), points(depths()))
        with pytest.raises(
            error, match=r"no topic /c; topics of images and clouds: /a/image/compressedDepth, /b/points"
        ):
            framesOf(bag, topics=["/c"])

    def test_of_one_camera_only_one_form_is_taken(self, kind, tmp_path):
        raw = [("/a/image", 1 + i, image_message(depth)) for i, depth in enumerate(depths())]
        packed = [("/a/image/compressedDepth", 1 + i, compressed_message(depth)) for i, depth in enumerate(depths())]
        frames = framesOf(self.bag(kind, tmp_path, *raw, *packed))
        assert {frame.part.split()[0] for frame in frames} == {"/a/image"}
        assert len(frames) == 4

    def test_infrared_pictures_are_taken_only_where_they_are_named(self, kind, tmp_path):
        def infrared(types, first):
            message = image_message(depths()[0])(types, first)
            message.encoding = "mono16"
            return message

        bag = self.bag(kind, tmp_path, ("/depth/image", 1, image_message(depths()[0])), ("/ir/image", 1, infrared))
        assert [frame.part for frame in framesOf(bag)] == ["/depth/image at 1"]
        assert_frames(framesOf(bag, topics=["/ir/image"]), depths(1))

    def test_frames_of_one_time_are_two(self, kind, tmp_path):
        frames = framesOf(self.bag(kind, tmp_path, *[("/a", 7, image_message(depth)) for depth in depths(2)]))
        assert names(frames) == ["walk/a/7", "walk/a/7_1"]
        assert sorted(int(np.argmax(frame.read().src[10] == 1000)) for frame in frames) == [10, 11]

    def test_garbled_messages_among_good_ones_fail(self, kind, tmp_path):
        good = [("/a", 1 + i, image_message(depth)) for i, depth in enumerate(depths())]

        def short(types, first):
            message = image_message(depths()[0])(types, first)
            message.data = message.data[:-7]
            return message

        bag = self.bag(kind, tmp_path, ("/a", 0, short), *good)
        items = list(runBatch(bag, tmp_path / "out", form="png", K=K))
        assert [item.state for item in items] == ["failed", *["written"] * 4]
        assert "it is truncated" in items[0].message

    def test_a_truncated_bag_fails_and_says_so(self, kind, tmp_path):
        bag = self.depth_bag(kind, tmp_path)
        file = bag if kind == "ros1" else next(path for path in bag.iterdir() if path.suffix in (".mcap", ".db3"))
        data = file.read_bytes()
        file.write_bytes(data[: len(data) // 2])
        np.save(tmp_path / "good.npy", depths())
        items = list(runBatch([bag, tmp_path / "good.npy"], tmp_path / "out", form="png", K=K))
        assert [item.state for item in items][-4:] == ["written"] * 4
        failed = [item for item in items if item.state == "failed"]
        assert failed
        assert all("cannot read" in item.message and "walk" in item.message for item in failed)

    def test_a_bag_without_depths_is_a_frame_that_says_so(self, kind, tmp_path):
        bag = self.bag(kind, tmp_path, ("/rgb", 1, image_message(np.zeros((30, 40), np.uint8))))
        (item,) = runBatch(bag, tmp_path / "out")
        assert "no depth images or organized clouds; topics of images and clouds: /rgb" in item.message


def rvl(depth):
    """The codec after its paper: numbers in digits of three bits, four in half a word."""
    digits = []

    def put(number):
        while True:
            digit, number = number & 7, number >> 3
            digits.append(digit | (8 if number else 0))
            if not number:
                return

    flat, at, previous = depth.ravel().tolist(), 0, 0
    while at < len(flat):
        zeros = next((i for i, value in enumerate(flat[at:]) if value), len(flat) - at)
        at += zeros
        run = next((i for i, value in enumerate(flat[at:]) if not value), len(flat) - at)
        put(zeros)
        put(run)
        for value in flat[at : at + run]:
            step = value - previous
            put(2 * step if step >= 0 else -2 * step - 1)
            previous = value
        at += run
    digits += [0] * (-len(digits) % 8)
    words = [int("".join(f"{digit:x}" for digit in digits[i : i + 8]), 16) for i in range(0, len(digits), 8)]
    return struct.pack(f"<2i{len(words)}I", depth.shape[1], depth.shape[0], *words)


class TestMessages:
    def compressed(self, form, data, a=0.0, b=0.0):
        return SimpleNamespace(format=form, data=struct.pack("<iff", 0, a, b) + data)

    def test_rvl(self):
        depth = np.random.default_rng(0).integers(0, 3, (30, 40)).astype(np.uint16) * 20000
        depth[3:7] = np.arange(160).reshape(4, 40) + 1
        message = self.compressed("16UC1; compressedDepth rvl", rvl(depth))
        assert np.array_equal(depth_of_compressed(message), depth)
        for end in (10, 40, len(message.data) - 8):
            with pytest.raises(ValueError, match="truncated"):
                depth_of_compressed(SimpleNamespace(format=message.format, data=message.data[:end]))

    def test_floats_are_stored_as_inverse_depth(self):
        stored = np.array([[0, 100, 1000], [2000, 30000, 65535]], np.uint16)
        png = cv2.imencode(".png", stored)[1].tobytes()
        depth = depth_of_compressed(self.compressed("32FC1; compressedDepth", png, a=5000.0, b=-50.0))
        assert depth.dtype == np.float32
        assert np.isnan(depth[0, 0])
        assert np.allclose(depth.ravel()[1:], 5000 / (stored.ravel()[1:] + 50.0), rtol=1e-6)

    @pytest.mark.parametrize("form", ["jpeg", "8UC1; compressedDepth", "16UC1; jpeg compressed"])
    def test_other_formats_are_refused(self, form):
        with pytest.raises(ValueError, match="no compressedDepth"):
            depth_of_compressed(self.compressed(form, b"12345678"))

    def test_a_garbled_picture(self):
        with pytest.raises(ValueError, match="garbled"):
            depth_of_compressed(self.compressed("16UC1; compressedDepth", b"no picture at all"))

    def test_rows_with_padding_and_in_the_other_byte_order(self):
        depth = np.arange(12, dtype=np.uint16).reshape(3, 4)
        rows = np.zeros((3, 12), np.uint8)
        rows[:, :8] = depth.astype(">u2").view(np.uint8)
        message = SimpleNamespace(height=3, width=4, encoding="16UC1", is_bigendian=1, step=12, data=rows.ravel()[:-4])
        assert np.array_equal(depth_of_image(message), depth)
        for wrong in ({"step": 7}, {"height": 4}, {"encoding": "rgb8"}, {"width": 0}):
            with pytest.raises(ValueError, match=r"bytes|truncated|encoding|no image"):
                depth_of_image(SimpleNamespace(**{**vars(message), **wrong}))

    def test_a_cloud_without_rows_is_refused(self):
        with pytest.raises(ValueError, match="unorganized"):
            points_of_cloud(SimpleNamespace(height=1, width=100))

    def test_rectified_images_have_no_distortion(self):
        P = np.hstack([2 * K, np.zeros((3, 1))])
        message = SimpleNamespace(K=K.ravel(), D=D, P=P.ravel(), distortion_model="plumb_bob")
        assert np.array_equal(camera_of(message, rectified=True)["K"], 2 * K)
        assert "distCoeffs" not in camera_of(message, rectified=True)
        assert np.array_equal(camera_of(message)["distCoeffs"], D)
        assert camera_of(SimpleNamespace(k=np.zeros(9), d=[], p=P, distortion_model="")) == {}
        with pytest.raises(ValueError, match="rectify"):
            camera_of(SimpleNamespace(**{**vars(message), "distortion_model": "equidistant"}))

    def test_images_that_are_cut_and_binned(self):
        region = SimpleNamespace(x_offset=0, y_offset=0, width=0, height=0)
        known = {"K": K.ravel(), "D": [], "width": 40, "height": 30, "roi": region, "binning_x": 0, "binning_y": 0}
        assert camera_of(SimpleNamespace(**known))["imageSize"] == (40, 30)
        cut = SimpleNamespace(x_offset=8, y_offset=4, width=20, height=18)
        found = camera_of(SimpleNamespace(**{**known, "roi": cut, "binning_x": 2, "binning_y": 3}))
        assert found["imageSize"] == (10, 6)
        assert np.allclose(found["K"], [[25, 0, 5.75], [0, 50 / 3, 3.5], [0, 0, 1]])


class TestLies:
    """Sizes that a few bytes tell of, and for which nothing may be allocated."""

    def test_frames_beyond_any_image(self, tmp_path):
        zarr = pytest.importorskip("zarr")
        zarr.create_array(str(tmp_path / "a.zarr"), shape=(2, 300000, 300000), chunks=(1, 1000, 1000), dtype="u2")
        (frame,) = framesOf(tmp_path / "a.zarr")
        with pytest.raises(error, match=r"cannot read '.*a\.zarr': 300000 x 300000 pixels are more than"):
            frame.read()

    def test_chunks_beyond_memory(self, tmp_path):
        zarr = pytest.importorskip("zarr")
        zarr.create_array(str(tmp_path / "a.zarr"), shape=(2, 30, 40), chunks=(1, 200000, 200000), dtype="u2")
        (frame,) = framesOf(tmp_path / "a.zarr")
        with pytest.raises(error, match="its chunks have 80000000000 bytes each"):
            frame.read()

    @pytest.mark.parametrize("shape", [(2**21, 2, 2), (1, 2**15, 2**15)])
    def test_stacks_that_are_holes(self, tmp_path, shape):
        with open(tmp_path / "a.npy", "wb") as file:
            header = {"descr": "<u2", "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(file, header)
            file.truncate(file.tell() + 2 * int(np.prod(shape)))
        (frame,) = framesOf(tmp_path / "a.npy")
        with pytest.raises(error, match=r"2097152 frames, more than|32768 x 32768 pixels are more than"):
            frame.read()
