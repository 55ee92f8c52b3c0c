"""From edges to seeds to regions: the same seeds in rangeedge.growRegions and in two watersheds.

    python samples/segmentation.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

A watershed floods the picture from the seeds as far as edges let it: every seed becomes a region, and a gap in an edge
is a leak. growRegions fits a surface to every seed and gives each pixel to the one it lies on, and merges the parts of
one surface.
"""

import cv2
import numpy as np
from common import gaps, load, parser, relief, sheet, write
from skimage.segmentation import watershed

import rangeedge


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    edges, strength = rangeedge.detectEdgesWithStrength(src, **geometry)
    missing = gaps(src, geometry)
    distance = rangeedge.distanceTransform(edges | missing)
    count, markers = rangeedge.extractSeeds(distance, minDistance=4)

    grown = rangeedge.growRegions(src, markers, edges=edges, **geometry)

    # cv2.watershed floods over differences of colour: a picture that is flat but for its edges.
    by_opencv = cv2.watershed(cv2.cvtColor(edges | missing, cv2.COLOR_GRAY2BGR), markers.copy())
    by_opencv[missing > 0] = 0

    by_skimage = watershed(-distance, markers, mask=missing == 0).astype(np.int32)

    view = relief(src, geometry)
    panels = [(f"{count - 1} seeds", markers), ("rangeedge.growRegions", grown)]
    panels += [("cv2.watershed", by_opencv), ("skimage.segmentation.watershed", by_skimage)]
    pictures = [
        (title, rangeedge.drawEdges(rangeedge.drawRegions(labels, view, 0.7), edges, strength.kind))
        for title, labels in panels
    ]
    write(args.out, "segmentation.png", sheet(*pictures))
    for title, labels in panels:
        print(f"{title}: {len(np.unique(labels[labels > 0]))} labels")


if __name__ == "__main__":
    main()
