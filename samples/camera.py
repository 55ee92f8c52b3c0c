"""
Frames of a depth camera, one after the other
=============================================

    python samples/camera.py [FRAME.png ... -K fx,fy,cx,cy] [--out DIR]

What a driver delivers goes in as it is: 16-bit millimetres with 0 where nothing is seen (`depthFactor` 1000), the
camera as four numbers, the nine of a ROS CameraInfo, or the name of a calibration file, with `distCoeffs` beside it. A
detector keeps all that, and the noise, which is estimated once. Without frames: eight of a box that turns.
"""

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import box, kinectCamera, kinectNoise, plane, renderScene


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frames", nargs="*", help="depth images; default: rendered ones")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of the camera")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    if args.frames and args.K is None:
        parser.error("give the camera of the frames: -K fx,fy,cx,cy")
    args.out.mkdir(parents=True, exist_ok=True)
    frames = [rangeedge.imreadRange(name).src for name in args.frames] or turning_box()

    detector = rangeedge.createScanLineDetector()
    detector.setK(args.K or [525, 525, 319.5, 239.5])
    detector.setNoise(rangeedge.estimateNoise(frames[0], K=detector.getK()))
    detector.save(args.out / "detector.yml")  # for `detector.load`
    print(detector)

    panels = []
    for i, depth in enumerate(frames):
        start = time.perf_counter()
        edges, strength = detector.detectEdgesWithStrength(depth)
        took = 1000 * (time.perf_counter() - start)
        print(f"frame {i}: {np.count_nonzero(edges)} edge pixels in {took:.1f} ms")
        picture = rangeedge.drawEdges(depth, edges, strength.kind, K=detector.getK())
        panels.append((f"frame {i}", picture))
    shown = panels[:: max(1, len(panels) // 4)][:4]
    cv2.imwrite(str(args.out / "camera.png"), rangeedge.drawPanels(shown, 2, key=True))
    print(args.out / "camera.png")
    print(args.out / "detector.yml")


def turning_box():
    """Depth frames as a Kinect takes them."""
    frames = []
    for i, angle in enumerate(np.linspace(0.1, 1.3, 8)):
        c, s = np.cos(angle), np.sin(angle)
        tilt = np.linalg.qr([[1, 0.3, 0], [-0.3, 1, 0.4], [0, -0.4, 1]])[0]
        turned = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ tilt
        scene = [plane((0, 0, 1.6), (0.1, -0.2, -1)), box((0, 0, 1.1), (0.3, 0.22, 0.4), turned)]
        frames.append(kinectNoise(renderScene(scene, kinectCamera()), seed=i).src)
    return frames


if __name__ == "__main__":
    main()
