"""
From edges to regions, beside two watersheds
============================================

    python samples/segmentation.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

A watershed floods the picture from the seeds as far as edges let it: every seed becomes a region, and a gap in an edge
is a leak. `growRegions` fits a surface to every seed, gives each pixel to the one it lies on, and merges the parts of
one surface.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from skimage.segmentation import watershed

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
    barrier = edges | gaps(src)
    distance = rangeedge.distanceTransform(barrier)
    count, markers = rangeedge.extractSeeds(distance, minDistance=4)

    grown = rangeedge.growRegions(src, markers, edges=edges, **geometry)
    # cv2.watershed floods over differences of colour: a picture that is flat but for its edges.
    by_opencv = cv2.watershed(cv2.cvtColor(barrier, cv2.COLOR_GRAY2BGR), markers.copy())
    by_skimage = watershed(-distance, markers).astype(np.int32)

    found = {f"{count - 1} seeds": markers, "rangeedge.growRegions": grown}
    found |= {"cv2.watershed": by_opencv, "skimage.segmentation.watershed": by_skimage}
    panels = []
    for title, labels in found.items():
        number = len(np.unique(labels[labels > 0]))
        print(f"{title}: {number} labels")
        regions = rangeedge.drawRegions(labels, src, 0.7, **geometry)
        panels.append((f"{title}, {number} labels", rangeedge.drawEdges(regions, edges, strength.kind)))
    cv2.imwrite(str(args.out / "segmentation.png"), rangeedge.drawPanels(panels, 2))
    print(args.out / "segmentation.png")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


def gaps(src):
    """Where there is no data, apart from single pixels: surfaces end there as they do at edges."""
    missing = ~np.isfinite(src if src.ndim == 2 else src[..., 2])
    missing |= (src == 0) if src.dtype.kind == "u" else False
    return cv2.morphologyEx(255 * missing.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))


if __name__ == "__main__":
    main()
