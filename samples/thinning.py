"""Edge maps one pixel wide, by the three methods of rangeedge.thinEdges.

python samples/thinning.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]
"""

import cv2
import numpy as np
from common import load, parser, sheet, write

import rangeedge

METHODS = {
    "THIN_SKELETON": rangeedge.THIN_SKELETON,
    "THIN_LEE": rangeedge.THIN_LEE,
    "THIN_ITERATIVE": rangeedge.THIN_ITERATIVE,
}


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    strength = rangeedge.edgeStrength(src, **geometry)
    edges = rangeedge.selectEdges(strength)
    print(f"{np.count_nonzero(edges)} edge pixels before thinning")

    panels = [("before thinning", edges)]
    for name, method in METHODS.items():
        thin = rangeedge.thinEdges(edges, method)
        panels.append((name, thin))
        print(f"{np.count_nonzero(thin)} after {name}")
    window = busiest_window(edges)
    write(args.out, "thinning.png", sheet(*((title, enlarged(edges, picture, window)) for title, picture in panels)))


def busiest_window(edges, width=120, height=100):
    """Where most edges are."""
    height, width = min(height, edges.shape[0]), min(width, edges.shape[1])
    density = cv2.boxFilter(edges, cv2.CV_32F, (width, height), anchor=(0, 0), borderType=cv2.BORDER_CONSTANT)
    density = density[: edges.shape[0] - height + 1, : edges.shape[1] - width + 1]
    y, x = np.unravel_index(density.argmax(), density.shape)
    return slice(y, y + height), slice(x, x + width)


def enlarged(before, thin, window, factor=4):
    """Thin edges white, what thinning took away grey."""
    picture = np.where(thin > 0, 255, before // 4).astype(np.uint8)[window]
    return cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_NEAREST)


if __name__ == "__main__":
    main()
