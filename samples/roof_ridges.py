"""
Roofs of a surface model, to a map
==================================

    python samples/roof_ridges.py [IMAGE] [--out DIR]

Ridges, eaves and verges (the eaves along gables) of houses, from a surface model to a map in GeoJSON.

An IMAGE with a georeference (GeoTIFF, ASCII grid) gives lines in its coordinates. Without one the sample makes three
houses with gable roofs, of six such lines and a ridge each, and prints how far these are from the truth.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge import EDGE_CONVEX, EDGE_JUMP, RangeImage

PIXEL = 0.25  # metres
SIZE = (320, 260)
CORNER = (358000.0, 5812000.0)  # of the map, upper left
NOISE = 0.03
HOUSES = (  # middle, direction of the ridge in degrees, half length, half width, height of eaves and of ridge: metres
    ((22, 20), 20, 9, 6, 5, 9),
    ((56, 22), -35, 10, 5, 4, 8),
    ((38, 48), 80, 8, 7, 6, 10),
)


def built_in_scene():
    """Houses on a slope, as a laser scanner in the air would see them."""
    x, y = np.meshgrid(PIXEL * np.arange(SIZE[0]), PIXEL * np.arange(SIZE[1]))
    height = 0.03 * x + 0.02 * y
    for (cx, cy), turn, length, width, eaves, ridge in HOUSES:
        u, v = along(x - cx, y - cy, turn)
        roof = ridge - (ridge - eaves) * np.abs(v) / width
        height = np.where((np.abs(u) <= length) & (np.abs(v) <= width), 3 + roof, height)
    height += np.random.default_rng(0).normal(0, NOISE, height.shape)
    georeference = np.array([[PIXEL, 0, CORNER[0] + PIXEL / 2], [0, -PIXEL, CORNER[1] - PIXEL / 2]])
    return RangeImage(height, {"pixelSize": (PIXEL, PIXEL), "heightMap": True}, georeference=georeference)


def along(x, y, turn):
    """Coordinates along and across the ridge of a house."""
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    return cos * x + sin * y, cos * y - sin * x


def off_the_truth(segments):
    """Distances of the ends of segments, on the ground, from the nearest true line of their kind."""
    found = {EDGE_CONVEX: [], EDGE_JUMP: []}
    for segment in segments:
        distances = []
        for (cx, cy), turn, length, width, _, _ in HOUSES:
            u, v = np.abs(along(*(segment["ends"][:, :2] - (cx, cy)).T, turn))
            beyond, beside = np.maximum(u - length, 0), np.maximum(v - width, 0)
            eaves = np.minimum(np.hypot(beyond, v - width), np.hypot(u - length, beside))
            distances.append(np.hypot(beyond, v) if segment["kind"] == EDGE_CONVEX else eaves)
        found[int(segment["kind"])].append(np.min(distances, axis=0).max())
    return found


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    rendered = args.image is None
    image = built_in_scene() if rendered else rangeedge.imreadRange(args.image)
    src, geometry = image if rendered else load(args)

    found = rangeedge.fitSegments(rangeedge.linkEdges(src, creaseThreshold=25, **geometry))
    segments = found.segments[np.isin(found.segments["kind"], (EDGE_CONVEX, EDGE_JUMP))]
    kinds = {EDGE_CONVEX: "ridges", EDGE_JUMP: "eaves and verges"}
    off = off_the_truth(segments) if rendered else {}
    for kind, name in kinds.items():
        own = segments[segments["kind"] == kind]
        truth = f", {100 * np.sqrt(np.mean(np.square(off[kind]))):.1f} cm rms from the truth" if off.get(kind) else ""
        print(f"{len(own)} {name}, {own['length'].sum():.1f} m{truth}")

    write(args.out, "roof_ridges.png", rangeedge.drawSegments(src, segments, scale=2, lengths=True, **shown(geometry)))
    rangeedge.writeLines(args.out / "roof_ridges.geojson", segments, image.georeference)
    print(args.out / "roof_ridges.geojson")
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
