"""Seeds for region growing: compact markers in the middle of surfaces.

    python samples/seeds.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

`seeds.tiff` holds them as 32-bit labels, which cv2.watershed takes as they are.
"""

import cv2
import numpy as np
from common import gaps, load, parser, relief, sheet, write

import rangeedge


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    edges = rangeedge.detectEdges(src, **geometry)
    distance = rangeedge.distanceTransform(edges | gaps(src, geometry))
    count, markers, stats, centroids = rangeedge.extractSeedsWithStats(distance, minDistance=4)
    print(f"{count - 1} seeds, of {stats[1:, cv2.CC_STAT_AREA].min(initial=edges.size)} pixels or more")

    picture = rangeedge.drawEdges(rangeedge.drawRegions(markers, relief(src, geometry), alpha=0.9), edges)
    for x, y in np.rint(centroids[1:]).astype(int):
        cv2.drawMarker(picture, (int(x), int(y)), (255, 255, 255), cv2.MARKER_CROSS, 7)
    write(
        args.out,
        "seeds.png",
        sheet(("distance to edges and gaps", rangeedge.colorizeDistance(distance)), (f"{count - 1} seeds", picture)),
    )
    write(args.out, "seeds.tiff", markers)


if __name__ == "__main__":
    main()
