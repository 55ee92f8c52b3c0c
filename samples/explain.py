"""
Why is there an edge, or none?
==============================

    python samples/explain.py [IMAGE [-K fx,fy,cx,cy]] [--at x,y] [--out DIR]

`explainPixel` says which test a pixel failed, by how much, and which option changes the answer: it has tried. The
picture shows the scan lines through the pixel after Figure 3 of the paper.
"""

import argparse
from pathlib import Path

import cv2

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="range image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of a camera")
    parser.add_argument("--at", type=lambda text: [int(n) for n in text.split(",")], help="the pixel (default: middle)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    src, geometry = load(args.image, args.K)
    args.out.mkdir(parents=True, exist_ok=True)
    at = args.at or ((296, 214) if args.image is None else (src.shape[1] // 2, src.shape[0] // 2))

    why = rangeedge.explainPixel(src, *at, **geometry)
    print(why)
    if why.change:
        edges = rangeedge.detectEdges(src, **geometry, **why.change)
        print(f"tried: {'an edge' if edges[at[1], at[0]] else 'no edge'} with {why.change}")
    cv2.imwrite(str(args.out / "explain.png"), rangeedge.drawExplanation(why))
    print(args.out / "explain.png")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


if __name__ == "__main__":
    main()
