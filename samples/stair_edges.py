"""
How high and deep are the stairs?
=================================

    python samples/stair_edges.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

The edges of stairs from one depth frame: where a foot goes, how high and how deep each step is.

Without an image it renders stairs as a Kinect before them would see them, and prints how far rises and treads are from
the truth.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge import EDGE_CONVEX
from rangeedge.synthetic import box, kinectCamera, kinectNoise, plane, renderScene

RISE, TREAD, WIDTH, STEPS = 0.17, 0.28, 1.0, 5  # metres
TILT = np.radians(25)  # of the camera, looking down
LONGEST = 0.3  # of the longest edge: others are as long at least
PARALLEL = np.cos(np.radians(10))


def built_in_scene():
    """Stairs on a floor, the first step 1.1 m away from the camera and 1.2 m below it."""
    cos, sin = np.cos(TILT), np.sin(TILT)
    axes = np.column_stack([(1, 0, 0), (0, cos, sin), (0, -sin, cos)])  # right, down, ahead

    def at(right, up, ahead):
        return axes @ (right, 1.2 - up, 1.1 + ahead)

    scene = [plane(at(0, 0, 0), -axes[:, 1]), plane(at(0, 0, STEPS * TREAD), -axes[:, 2])]
    for k in range(STEPS):
        depth = (STEPS - k) * TREAD
        scene.append(box(at(0, RISE * (k + 0.5), k * TREAD + depth / 2), (WIDTH, RISE, depth), axes))
    scan = kinectNoise(renderScene(scene, kinectCamera()), seed=1)
    return scan.src, scan.geometry


def nosings(segments):
    """The long convex edges that run along the longest one, from the lowest on: nearest first."""
    convex = segments[segments["kind"] == EDGE_CONVEX]
    if not len(convex):
        return convex
    longest = convex[convex["length"].argmax()]
    alike = np.abs(convex["direction"] @ longest["direction"]) > PARALLEL
    found = convex[alike & (convex["length"] > LONGEST * longest["length"])]
    return found[np.argsort(found["ends"].mean(axis=1)[:, 2])]


def steps(edges, down):
    """Rise and tread from one edge to the next, the vertical being known."""
    right = edges["direction"][edges["length"].argmax()] if len(edges) else np.zeros(3)
    ahead = np.cross(right, down)
    places = edges["ends"].mean(axis=1)
    rises, treads = -np.diff(places @ down), np.abs(np.diff(places @ ahead))
    return rises, treads


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    rendered = args.image is None
    src, geometry = built_in_scene() if rendered else load(args)

    found = rangeedge.fitSegments(rangeedge.linkEdges(src, **geometry))
    edges = nosings(found.segments)
    down = np.array([0, np.cos(TILT), np.sin(TILT)]) if rendered else np.array([0.0, 1.0, 0.0])
    rises, treads = steps(edges, down)
    print(f"{len(edges)} edges of steps")
    for rise, tread in zip(rises, treads, strict=True):
        truth = f", error {1000 * (rise - RISE):+.1f} and {1000 * (tread - TREAD):+.1f} mm" if rendered else ""
        print(f"rise {rise:.3f}, tread {tread:.3f}{truth}")

    write(args.out, "stair_edges.png", rangeedge.drawSegments(src, edges, scale=2, lengths=True, **shown(geometry)))
    return rises, treads


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
