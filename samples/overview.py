"""
At a glance
===========

    python samples/overview.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

A depth frame, its edges by kind, the distance to them, and the surfaces between: the picture of the README.
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

    edges, strength = rangeedge.detectEdgesWithStrength(src, **geometry)
    labels = rangeedge.segmentRegions(src, **geometry)
    distance = rangeedge.distanceTransform(edges)
    height, width = edges.shape
    panels = [
        (f"depth, {width} x {height}", rangeedge.drawEdges(src, np.zeros_like(edges), **geometry)),
        (f"{np.count_nonzero(edges)} edge pixels", rangeedge.drawEdges(src, edges, strength.kind, **geometry)),
        (f"distance to the edges, up to {distance.max():.0f} pixels", rangeedge.colorizeDistance(distance)),
        (f"{labels.max()} surfaces", rangeedge.drawRegions(labels, src, **geometry)),
    ]
    quality = [cv2.IMWRITE_JPEG_QUALITY, 90, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    cv2.imwrite(str(args.out / "overview.jpg"), rangeedge.drawPanels(panels, 2, key=True), quality)
    print(args.out / "overview.jpg")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


if __name__ == "__main__":
    main()
