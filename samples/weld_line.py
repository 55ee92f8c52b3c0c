"""
Where is the weld?
==================

    python samples/weld_line.py [IMAGE --pixel-size D --height-map] [--out DIR]

The toes of a weld: where its bead meets the plate, from the height map of a profile sensor, and how wide it is.

Without an image it makes a plate with a bead that wanders, and prints how far its toes and its width are from the
truth. Writes the lines, pixels and millimetres, as a table for a robot.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge import EDGE_CONCAVE

PITCH = (0.1, 0.1)  # of the sensor's points, in millimetres, across and along the weld
SIZE = (400, 700)  # columns, rows
WIDTH, HEIGHT = 12.0, 3.5  # of the bead
NOISE = 0.02
LONGEST = 0.5  # of the rows: a toe runs along as many at least


def middle(y):
    """Where the bead is, in millimetres."""
    return 20 + 2 * np.sin(2 * np.pi * y / 60)


def built_in_scene():
    """A parabolic bead on a plate that is not level."""
    x, y = np.meshgrid(PITCH[0] * np.arange(SIZE[0]), PITCH[1] * np.arange(SIZE[1]))
    bead = HEIGHT * (1 - ((x - middle(y)) / (WIDTH / 2)) ** 2)
    height = np.maximum(bead, 0) + 0.02 * x + 0.01 * y
    return height + np.random.default_rng(0).normal(0, NOISE, height.shape), {"pixelSize": PITCH, "heightMap": True}


def toes(src, geometry):
    """The long concave chains, from left to right."""
    chains = rangeedge.linkEdges(src, creaseThreshold=20, cornerAngle=180, **geometry)
    rows = LONGEST * src.shape[0]
    long = [chain for chain in chains if chain.kind == EDGE_CONCAVE and np.ptp(chain.points["y"]) >= rows]
    return sorted(long, key=lambda chain: chain.points["x"].mean())


def width(left, right):
    """Of the bead at every point of its left toe, along the rows."""
    order = np.argsort(right["y"])
    across = np.interp(left["y"], right["y"][order], right["point"][order, 0], np.nan, np.nan)
    return across - left["point"][:, 0]


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    rendered = args.image is None
    src, geometry = built_in_scene() if rendered else load(args)

    lines = toes(src, geometry)
    print(f"{len(lines)} toes")
    off = []
    for side, line in zip((-1, 1), lines, strict=False):
        points = line.points["point"]
        truth = ""
        if rendered:
            off.append(points[:, 0] - middle(points[:, 1]) - side * WIDTH / 2)
            truth = f", {1000 * np.sqrt(np.mean(off[-1] ** 2)):.0f} micrometres rms from the truth"
        print(f"a toe of {line.length:.2f} mm under {line.crease:.1f} degrees{truth}")
    if len(lines) == 2:
        measured = width(lines[0].points, lines[1].points)
        truth = f", truth {WIDTH:.2f}" if rendered else ""
        print(f"width {np.nanmean(measured):.2f} +- {np.nanstd(measured):.2f} mm{truth}")

    picture = rangeedge.drawChains(src, lines, **shown(geometry))
    write(args.out, "weld_line.png", picture)
    rangeedge.writeLines(args.out / "weld_line.csv", lines)
    print(args.out / "weld_line.csv")
    return off


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


def shown(geometry):
    """What pictures take of a geometry."""
    return {name: geometry[name] for name in ("K", "heightMap") if name in geometry}


def write(folder, name, picture):
    """Write a picture and say so."""
    folder.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(folder / name), picture):
        raise OSError(f"cannot write {folder / name}")
    print(folder / name)


if __name__ == "__main__":
    main()
