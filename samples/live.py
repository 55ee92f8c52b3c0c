"""
A stream of frames, as they come
================================

    python samples/live.py [RECORDING [-K fx,fy,cx,cy]] [--out DIR]
    python samples/live.py --camera openni -K 570,570,319.5,239.5 --show

Edges and regions of a stream of frames, as they come: a camera, a recording, or a built-in one.

RECORDING is anything that `rangeedge batch` takes: a folder of images, a stack, a TUM RGB-D sequence, a ROS bag. A
window (--show, ends with a key) needs opencv-python in the place of opencv-python-headless; without, the last picture
is written when the stream ends, of a camera by Ctrl-C. The detector is an object that keeps its parameters from frame
to frame.
"""

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.batch import framesOf
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


def frames(args):
    """Range images with what is known of their geometry."""
    given = {} if args.K is None else {"K": np.array(args.K.split(","), dtype=np.float64)}
    if args.camera == "openni":
        yield from openni(given)
    elif args.camera == "realsense":
        yield from realsense()
    elif args.image is not None:
        for frame in framesOf(args.image):
            yield frame.read(**given)
    else:
        scan = renderScene(demoScene(), kinectCamera())
        for seed in range(4):
            seen = kinectNoise(scan, seed=seed)
            yield rangeedge.RangeImage(seen.src, seen.geometry)


def openni(geometry):
    """Depth maps in millimetres of a camera that OpenCV reaches by OpenNI 2."""
    camera = cv2.VideoCapture(cv2.CAP_OPENNI2)
    if not camera.isOpened():
        raise SystemExit("no camera: is it plugged in, and was this OpenCV built with OpenNI 2?")
    try:
        while camera.grab():
            found, depth = camera.retrieve(flag=cv2.CAP_OPENNI_DEPTH_MAP)
            if found:
                yield rangeedge.RangeImage(depth, geometry)
    finally:
        camera.release()


def realsense():
    """Depth maps of a RealSense camera with its own calibration."""
    try:
        import pyrealsense2 as rs
    except ImportError:
        raise SystemExit("--camera realsense needs: pip install pyrealsense2") from None

    pipeline = rs.pipeline()
    profile = pipeline.start()
    lens = profile.get_stream(rs.stream.depth).as_video_stream_profile().get_intrinsics()
    factor = 1 / profile.get_device().first_depth_sensor().get_depth_scale()
    try:
        while True:
            seen = pipeline.wait_for_frames().get_depth_frame()
            if seen:  # none came with the frames of other sensors
                depth = np.asanyarray(seen.get_data()).copy()
                yield rangeedge.RangeImage(depth, {"K": (lens.fx, lens.fy, lens.ppx, lens.ppy), "depthFactor": factor})
    finally:
        pipeline.stop()


def picture(image, edges, labels, text):
    """Edges on the surfaces, and the regions, side by side."""
    view = {name: image.geometry[name] for name in ("K", "heightMap") if name in image.geometry}
    return sheet((text, rangeedge.drawEdges(image.src, edges, **view)), ("regions", rangeedge.drawRegions(labels)))


def main(argv=None):
    arguments = parser(__doc__)
    arguments.add_argument("--camera", choices=["openni", "realsense"], help="take frames from a camera")
    arguments.add_argument("--show", action="store_true", help="in a window, until a key is pressed")
    args = arguments.parse_args(argv)
    if args.camera == "openni" and args.K is None:
        arguments.error("--camera openni needs -K: OpenCV does not tell the focal lengths")

    stream, shown = frames(args), None
    try:
        for shown in edges_and_regions(stream):
            if args.show:
                cv2.imshow("rangeedge", shown)
                if cv2.waitKey(1) >= 0:
                    break
    except KeyboardInterrupt:  # as a stream of a camera ends
        pass
    finally:
        stream.close()
    if shown is not None and not args.show:
        write(args.out, "live.png", shown)


def edges_and_regions(stream):
    """A picture of every frame."""
    params, detector = None, None
    for index, image in enumerate(stream):
        if (seen := rangeedge.ScanLineParams(**image.geometry)) != params:
            params = seen
            detector = rangeedge.createScanLineDetector(params)
        start = time.perf_counter()
        edges = detector.detectEdges(image.src)
        between = time.perf_counter()
        labels = rangeedge.segmentRegions(image.src, **image.geometry)
        end = time.perf_counter()
        text = f"frame {index}: edges {1000 * (between - start):.0f} ms, regions {1000 * (end - between):.0f} ms"
        print(f"{text}; {np.count_nonzero(edges)} edge pixels, {labels.max()} regions", flush=True)
        yield picture(image, edges, labels, text)


def parser(doc):
    """Arguments of a sample: an image with its geometry, and where to write."""
    arguments = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("image", nargs="?", help="range image; default: a built-in scene")
    geometry = arguments.add_mutually_exclusive_group()
    geometry.add_argument("-K", metavar="fx,fy,cx,cy", help="pinhole camera")
    geometry.add_argument("--pixel-size", type=float, metavar="D", help="spacing of a regular grid")
    arguments.add_argument("--height-map", action="store_true", help="larger values are nearer")
    arguments.add_argument("--out", type=Path, default=Path("out"), help="folder for the pictures (default: out)")
    return arguments


def sheet(*panels, columns=2):
    """Pictures beside each other, each under its title."""
    return rangeedge.drawPanels(panels, columns)


def write(folder, name, picture):
    """Write a picture and say so."""
    folder.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(folder / name), picture):
        raise OSError(f"cannot write {folder / name}")
    print(folder / name)


if __name__ == "__main__":
    main()
