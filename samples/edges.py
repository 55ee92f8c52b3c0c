"""Edges of a range image by kind, beside what cv2.Canny finds in the same depths.

    python samples/edges.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

To Canny a crease between two surfaces is no edge, and a jump that counts nearby is lost in the noise farther away.
"""

import cv2
import numpy as np
from common import load, parser, relief, sheet, write

import rangeedge


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    edges, strength = rangeedge.detectEdgesWithStrength(src, **geometry)
    print(f"{np.count_nonzero(edges)} edge pixels")

    view = relief(src, geometry)
    canny = cv2.Canny(grey_levels(src), 40, 80)
    write(
        args.out,
        "edges.png",
        sheet(
            ("cv2.Canny of the depths", rangeedge.drawEdges(view, canny)),
            ("rangeedge: jump red, convex yellow, concave blue", rangeedge.drawEdges(view, edges, strength.kind)),
        ),
    )


def grey_levels(src):
    """Depths as Canny can take them: 8 bits, gaps filled, smoothed."""
    depth = (src if src.ndim == 2 else src[..., 2]).astype(np.float32)
    gaps = ~np.isfinite(depth) | (depth == 0)
    low, high = (depth[~gaps].min(), depth[~gaps].max()) if not gaps.all() else (0, 1)
    grey = np.where(gaps, 0, 255 * (depth - low) / max(high - low, 1e-6)).astype(np.uint8)
    return cv2.GaussianBlur(cv2.inpaint(grey, gaps.astype(np.uint8), 3, cv2.INPAINT_TELEA), (5, 5), 0)


if __name__ == "__main__":
    main()
