"""
How far from the nearest edge, and which way
============================================

    python samples/distance_map.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

The distance transform of the paper's Figure 12a, exact, and with the label of the nearest edge the direction to it.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="range image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of a camera")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    src, geometry = load(args.image, args.K)
    args.out.mkdir(parents=True, exist_ok=True)

    edges = rangeedge.detectEdges(src, **geometry)
    distance, nearest = rangeedge.distanceTransformWithLabels(edges)
    print(f"up to {distance.max():.1f} pixels from an edge")

    panels = [
        ("distance to the nearest edge, a line every 10 pixels", contoured(distance)),
        ("direction to it: hue as on a colour wheel, red to the right", directions(nearest)),
    ]
    cv2.imwrite(str(args.out / "distance_map.png"), rangeedge.drawPanels(panels, 2))
    print(args.out / "distance_map.png")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


def contoured(distance):
    picture = rangeedge.colorizeDistance(distance)
    step = np.floor(distance / 10)
    line = np.zeros(distance.shape, bool)
    line[:, 1:] |= step[:, 1:] != step[:, :-1]
    line[1:] |= step[1:] != step[:-1]
    picture[line] = 200
    return picture


def directions(nearest):
    """Hue by the direction to the nearest edge, as optical flow is shown."""
    y, x = np.indices(nearest.shape, np.float32)
    to_y, to_x = np.unravel_index(np.maximum(nearest, 0), nearest.shape)
    angle = cv2.phase(to_x - x, to_y - y, angleInDegrees=True) / 2
    half, full = (np.full(nearest.shape, level, np.uint8) for level in (130, 230))
    picture = cv2.cvtColor(cv2.merge([angle.astype(np.uint8), half, full]), cv2.COLOR_HSV2BGR)
    picture[nearest == np.arange(nearest.size).reshape(nearest.shape)] = 0
    return picture


if __name__ == "__main__":
    main()
