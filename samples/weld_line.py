"""
Where does the weld end?
========================

python samples/weld_line.py [IMAGE --pixel-size D --height-map] [--out DIR]

Its toes, where the bead meets the plate, from the height map of a profile sensor, and how wide it is. Without an image
it makes a plate with a bead that wanders, and prints how far its toes and its width are from the truth. Writes the
lines, pixels and millimetres, as a table for a robot.
"""

import numpy as np
from common import load, parser, write

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

    picture = rangeedge.drawChains(src, lines, **geometry)
    write(args.out, "weld_line.png", picture)
    rangeedge.writeLines(args.out / "weld_line.csv", lines)
    print(args.out / "weld_line.csv")
    return off


if __name__ == "__main__":
    main()
