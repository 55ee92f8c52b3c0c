"""
Lines one pixel wide, four ways
===============================

    python samples/thinning.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

Every method of `thinEdges`, where their results differ most: by a pixel here and there, and in how many they leave.
Spurs are removed from all.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene

METHODS = ("THIN_MEDIAL", "THIN_SKELETON", "THIN_LEE", "THIN_ITERATIVE")


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="range image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of a camera")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    src, geometry = load(args.image, args.K)
    args.out.mkdir(parents=True, exist_ok=True)

    edges = rangeedge.selectEdges(rangeedge.edgeStrength(src, **geometry))
    thin = {name: rangeedge.thinEdges(edges, getattr(rangeedge, name)) for name in METHODS}
    for name, lines in {"before thinning": edges, **thin}.items():
        print(f"{name}: {np.count_nonzero(lines)} pixels")

    window = where_they_differ(list(thin.values()))
    panels = [(f"before: {np.count_nonzero(edges[window])} pixels", enlarged(edges, edges, window))]
    panels += [
        (f"{name}: {np.count_nonzero(lines[window])}", enlarged(edges, lines, window)) for name, lines in thin.items()
    ]
    cv2.imwrite(str(args.out / "thinning.png"), rangeedge.drawPanels(panels, 3))
    print(args.out / "thinning.png")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


def where_they_differ(maps, width=72, height=60):
    """The window in which most pixels are on in some maps and off in others."""
    differ = (np.max(maps, axis=0) != np.min(maps, axis=0)).astype(np.float32)
    height, width = min(height, differ.shape[0]), min(width, differ.shape[1])
    count = cv2.boxFilter(differ, -1, (width, height), anchor=(0, 0), normalize=False, borderType=cv2.BORDER_CONSTANT)
    count = count[: differ.shape[0] - height + 1, : differ.shape[1] - width + 1]
    y, x = np.unravel_index(count.argmax(), count.shape)
    return slice(y, y + height), slice(x, x + width)


def enlarged(before, thin, window, factor=6):
    """Thin edges white, what thinning took away grey."""
    picture = np.where(thin > 0, 255, before // 4).astype(np.uint8)[window]
    return cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_NEAREST)


if __name__ == "__main__":
    main()
