"""
Edges by kind, beside cv2.Canny
===============================

    python samples/edges.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

To Canny a crease between two surfaces is no edge, and a jump that counts nearby is lost in the noise farther away.
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
    canny = cv2.Canny(grey_levels(src), 40, 80)
    print(f"{np.count_nonzero(edges)} edge pixels")

    pictures = [
        ("cv2.Canny of the depths (white: of no known kind)", rangeedge.drawEdges(src, canny, **geometry)),
        ("rangeedge.detectEdges", rangeedge.drawEdges(src, edges, strength.kind, **geometry)),
    ]
    cv2.imwrite(str(args.out / "edges.png"), rangeedge.drawPanels(pictures, 2, key=True))
    print(args.out / "edges.png")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


def grey_levels(src):
    """Depths as Canny can take them: 8 bits, gaps filled, smoothed."""
    depth = (src if src.ndim == 2 else src[..., 2]).astype(np.float32)
    gaps = ~np.isfinite(depth) | (depth == 0)
    low, high = (depth[~gaps].min(), depth[~gaps].max()) if not gaps.all() else (0, 1)
    grey = np.where(gaps, 0, 255 * (depth - low) / max(high - low, 1e-6)).astype(np.uint8)
    return cv2.GaussianBlur(cv2.inpaint(grey, gaps.astype(np.uint8), 3, cv2.INPAINT_TELEA), (5, 5), 0)


if __name__ == "__main__":
    main()
