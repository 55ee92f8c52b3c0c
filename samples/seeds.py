"""
Seeds in the middle of surfaces
===============================

    python samples/seeds.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

Compact markers far from every edge and from where data end. `seeds.tiff` holds them as 32-bit labels, which
cv2.watershed takes as they are.
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
    distance = rangeedge.distanceTransform(edges | gaps(src))
    count, markers, stats, centroids = rangeedge.extractSeedsWithStats(distance, minDistance=4)
    print(f"{count - 1} seeds, of {stats[1:, cv2.CC_STAT_AREA].min(initial=edges.size)} pixels or more")

    nothing = np.zeros_like(edges)
    relief = rangeedge.drawEdges(src, nothing, **geometry)
    picture = rangeedge.drawEdges(rangeedge.drawRegions(markers, relief, alpha=0.9), edges)
    for x, y in np.rint(centroids[1:]).astype(int):
        cv2.drawMarker(picture, (int(x), int(y)), (255, 255, 255), cv2.MARKER_CROSS, 7)
    panels = [("distance to edges and gaps", rangeedge.colorizeDistance(distance)), (f"{count - 1} seeds", picture)]
    cv2.imwrite(str(args.out / "seeds.png"), rangeedge.drawPanels(panels, 2))
    cv2.imwrite(str(args.out / "seeds.tiff"), markers)
    print(args.out / "seeds.png")
    print(args.out / "seeds.tiff")


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
