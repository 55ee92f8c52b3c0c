"""
A node of ROS 2
===============

It publishes the edges of a depth image; and the same on a recorded bag, without ROS.

On a ROS machine, where `pip install rangeedge` has found the Python of ROS:

    python3 samples/ros2_node.py --ros-args -r depth:=/camera/depth/image_rect_raw \\
        -r camera_info:=/camera/depth/camera_info

It subscribes to `depth` (sensor_msgs/Image: 16UC1 in millimetres, 32FC1 in metres) and `camera_info`, and publishes
`edges` (sensor_msgs/Image, mono8: 255 on edges) under the header of each depth image. Elsewhere, with the extra [bags]:

    python samples/ros2_node.py --bag BAG [--topic TOPIC] [--out DIR]

reads ROS 1, ROS 2 or MCAP, and writes a bag with the edges, DIR/edges. Without --bag it records the built-in scene
first.
"""

import argparse
from array import array
from pathlib import Path

import numpy as np

import rangeedge
from rangeedge.recording.messages import camera_of, range_image_of
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


class EdgeDetector:
    """What the node does, without ROS: messages in, fields of a message out."""

    def __init__(self):
        self.detector = self.params = None

    def see_camera(self, message):
        """Take over the camera of a CameraInfo, if it says one that is new."""
        params = rangeedge.ScanLineParams(**camera_of(message))
        if params.K is not None and (self.detector is None or params != self.params):
            self.params, self.detector = params, rangeedge.createScanLineDetector(params)

    def edges_of(self, message):
        """The fields of the Image of edges of a depth image; None while its camera is not known."""
        if self.detector is None:
            return None
        edges = self.detector.detectEdges(range_image_of(message).src)
        rows, cols = edges.shape
        fields = {"height": rows, "width": cols, "encoding": "mono8", "is_bigendian": 0, "step": cols}
        return {"header": message.header, **fields, "data": edges.ravel()}


def spin(argv):
    """Run as a node until it is interrupted."""
    import rclpy
    from rclpy.executors import ExternalShutdownException
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import CameraInfo, Image

    rclpy.init(args=argv)
    node, detector = Node("rangeedge"), EdgeDetector()
    publisher = node.create_publisher(Image, "edges", 1)

    def see(message):
        try:
            detector.see_camera(message)
        except ValueError as problem:
            node.get_logger().warning(f"camera_info: {problem}")

    def publish(message):
        try:
            fields = detector.edges_of(message)
        except ValueError as problem:  # garbled, or no depth: the next one may be better
            node.get_logger().warning(f"depth: {problem}")
            return
        if fields is not None:
            publisher.publish(Image(**{**fields, "data": array("B", fields["data"].tobytes())}))

    node.create_subscription(CameraInfo, "camera_info", see, qos_profile_sensor_data)
    node.create_subscription(Image, "depth", publish, qos_profile_sensor_data)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def replay(bag, topic, out):
    """The same on the messages of a bag, into another one; how many images that are."""
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store, detector, count = get_typestore(Stores.ROS2_HUMBLE), EdgeDetector(), 0
    image = store.types["sensor_msgs/msg/Image"]
    with AnyReader([bag], default_typestore=store) as reader, Writer(out, version=9) as writer:
        edges = writer.add_connection("edges", image.__msgtype__, typestore=store)
        info = topic.rpartition("/")[0] + "/camera_info"
        chosen = [connection for connection in reader.connections if connection.topic in (topic, info)]
        for connection, time, data in reader.messages(chosen):
            message = reader.deserialize(data, connection.msgtype)
            if connection.topic == info:
                detector.see_camera(message)
            elif (fields := detector.edges_of(message)) is not None:
                stamp = store.types["builtin_interfaces/msg/Time"](
                    message.header.stamp.sec, message.header.stamp.nanosec
                )
                fields["header"] = store.types["std_msgs/msg/Header"](stamp, message.header.frame_id)
                writer.write(edges, time, store.serialize_cdr(image(**fields), image.__msgtype__))
                count += 1
    return count


def record(path, topic, frames=3):
    """A bag of the built-in scene, as a camera node would publish it."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    src, geometry = kinectNoise(renderScene(demoScene(), kinectCamera()))[:2]
    rows, cols = src.shape
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = {name.rpartition("/")[2]: kind for name, kind in store.types.items()}
    camera = {"d": np.zeros(5), "k": np.ravel(geometry["K"]), "r": np.eye(3).ravel(), "p": np.zeros(12)}
    with Writer(path, version=9) as writer:
        image, info = types["Image"].__msgtype__, types["CameraInfo"].__msgtype__
        images = writer.add_connection(topic, image, typestore=store)
        infos = writer.add_connection(topic.rpartition("/")[0] + "/camera_info", info, typestore=store)
        for index in range(frames):
            header = types["Header"](types["Time"](index, 0), "camera")
            region = types["RegionOfInterest"](0, 0, 0, 0, False)
            known = types["CameraInfo"](header, rows, cols, "plumb_bob", **camera, binning_x=0, binning_y=0, roi=region)
            seen = types["Image"](header, rows, cols, "16UC1", 0, 2 * cols, src.view(np.uint8).ravel())
            writer.write(infos, index * 10**9, store.serialize_cdr(known, info))
            writer.write(images, index * 10**9, store.serialize_cdr(seen, image))


def main(argv=None):
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--bag", type=Path, help="a recorded bag; default: one of the built-in scene")
    arguments.add_argument("--topic", default="/camera/depth/image_raw", help="of depth images (default: %(default)s)")
    arguments.add_argument("--out", type=Path, default=Path("out"), help="folder for the bags (default: out)")
    args, ros = arguments.parse_known_args(argv)
    if ros:
        return spin(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    if args.bag is None:
        args.bag = unused(args.out / "recorded")
        record(args.bag, args.topic)
    out = unused(args.out / "edges")
    print(f"{out}: edges of {replay(args.bag, args.topic, out)} images of {args.bag}")


def unused(path):
    """A name that is not taken yet: bags are not written over."""
    names = (path.with_name(f"{path.name}_{number}") for number in range(1, 10**6))
    return path if not path.exists() else next(name for name in names if not name.exists())


if __name__ == "__main__":
    main()
