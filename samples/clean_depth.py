"""
A clean depth frame
===================

    python samples/clean_depth.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

Clean a depth frame: flying pixels out, holes filled, noise smoothed within surfaces.

Without an image it renders a scene as a Kinect would see it, and prints how far depths are from the truth, before and
after, on surfaces and beside edges, and where holes were filled; the same for what OpenCV has.
"""

import argparse
from functools import cache
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge import CLEAN_FILLED, CLEAN_REMOVED, CLEAN_SMOOTHED
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene

COLOURS = {0: (0, 0, 0), CLEAN_SMOOTHED: (90, 90, 90), CLEAN_REMOVED: (0, 94, 213), CLEAN_FILLED: (66, 228, 240)}
BESIDE = 3  # pixels from an edge


def changes(changed):
    """What was done to each pixel: smoothed grey, filled yellow, removed vermilion."""
    picture = np.zeros((*changed.shape, 3), np.uint8)
    for bit, colour in COLOURS.items():
        picture[changed & bit > 0] = colour
    return picture


def others(depth):
    """The same by filters that do not know surfaces, and by inpainting."""
    metres = depth.astype(np.float32)
    missing = (depth == 0).astype(np.uint8)
    smooth = cv2.bilateralFilter(metres, 9, 20, 4) * (depth > 0)
    return {
        "bilateralFilter": smooth,
        "medianBlur": cv2.medianBlur(depth, 5) * (depth > 0),
        "inpaint": cv2.inpaint(depth, missing, 5, cv2.INPAINT_TELEA),
    }


def errors(depth, before, truth, from_edges):
    """Median errors in millimetres: on surfaces, beside edges, in holes; and the share of holes that are filled."""
    off, known = np.abs(depth - 1000 * truth), before > 0
    hole = ~known & (depth > 0)
    parts = [off[known & (depth > 0) & (from_edges > BESIDE)], off[known & (depth > 0) & (from_edges <= BESIDE)]]
    return [*(np.median(part) for part in parts), np.median(off[hole]) if hole.any() else np.nan, hole.sum()]


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = built_in_scene() if args.image is None else load(args)

    cleaned, changed = rangeedge.cleanDepth(src, **geometry)
    for bit, what in ((CLEAN_SMOOTHED, "smoothed"), (CLEAN_REMOVED, "flying, removed"), (CLEAN_FILLED, "filled")):
        print(f"{np.count_nonzero(changed & bit)} pixels {what}")
    found = {}
    if args.image is None:
        rendering = renderScene(demoScene(), kinectCamera())
        from_edges = cv2.distanceTransform((rendering.kind == 0).astype(np.uint8), cv2.DIST_L2, 5)
        print("median error, mm       surfaces  beside edges     holes  pixels filled")
        for name, depth in {"as measured": src, "cleanDepth": cleaned, **others(src)}.items():
            found[name] = errors(depth.astype(np.float64), src, rendering.depth, from_edges)
            print(f"{name:20s}" + "".join(f"{value:11.2f}" for value in found[name][:3]) + f"{found[name][3]:15d}")

    picture = sheet(
        ("as measured", relief(src, geometry)),
        ("cleaned", relief(cleaned, geometry)),
        ("smoothed (grey), filled (yellow), removed (vermilion)", changes(changed)),
        columns=3,
    )
    write(args.out, "clean_depth.png", picture)
    return found


def parser(doc):
    """Arguments of a sample: an image with its geometry, and where to write."""
    arguments = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("image", nargs="?", help="range image; default: a built-in scene")
    geometry = arguments.add_mutually_exclusive_group()
    geometry.add_argument("-K", metavar="fx,fy,cx,cy", help="pinhole camera")
    geometry.add_argument("--pixel-size", type=float, metavar="D", help="spacing of a regular grid")
    arguments.add_argument("--height-map", action="store_true", help="larger values are nearer")
    arguments.add_argument("--out", type=Path, default=Path("out"), help="folder for the pictures (default: out)")
    return arguments


def load(args):
    """The range image, and its geometry as keywords of the functions that take it."""
    if args.image is None:
        return built_in_scene()
    given = {}
    if args.K is not None:
        fx, fy, cx, cy = map(float, args.K.split(","))
        given["K"] = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    if args.pixel_size is not None:
        given["pixelSize"] = args.pixel_size
    if args.height_map:
        given["heightMap"] = True
    return rangeedge.imreadRange(args.image).withGeometry(**given)


@cache
def built_in_scene():
    """Boxes, a roof and curved solids on a table, as a Kinect would see them."""
    scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
    return scan.src, scan.geometry


def relief(src, geometry):
    """The range image as a shaded picture to draw on."""
    return rangeedge.drawEdges(src, np.zeros(src.shape[:2], np.uint8), **geometry)


def sheet(*panels, columns=2):
    """Pictures beside each other, each under its title."""
    return rangeedge.drawPanels(panels, columns)


def write(folder, name, picture):
    """Write a picture and say so."""
    folder.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(folder / name), picture):
        raise OSError(f"cannot write {folder / name}")
    print(folder / name)


if __name__ == "__main__":
    main()
