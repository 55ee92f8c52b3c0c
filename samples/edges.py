"""Edges of a range image by kind, beside what cv2.Canny finds in the same depths.

    python samples/edges.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

Canny sees steps of a grey-level picture: creases between surfaces are none, and a slanted surface is full of them.
"""

import cv2
import numpy as np
from common import beside, load, parser, relief, write

import rangeedge


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    strength = rangeedge.edgeStrength(src, **geometry)
    edges = rangeedge.detectEdges(src, **geometry)
    print(f"{np.count_nonzero(edges)} edge pixels")

    view = relief(src, geometry)
    depth = src if src.ndim == 2 else src[..., 2]
    grey = cv2.normalize(np.nan_to_num(depth.astype(np.float32)), None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    canny = cv2.Canny(cv2.GaussianBlur(grey, (5, 5), 0), 10, 30)
    write(
        args.out,
        "edges.png",
        beside(
            ("cv2.Canny of the depths", rangeedge.drawEdges(view, canny)),
            ("rangeedge.detectEdges: jumps red, convex yellow, concave blue", rangeedge.drawEdges(view, edges, strength.kind)),
        ),
    )


if __name__ == "__main__":
    main()
