"""
How large is the box?
=====================

    python samples/box_dimensions.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

Its edges and corners from one depth frame, and how long it is along its three directions. Without an image it renders
a box as a Kinect would see it, and prints how far the result is from the truth.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import box, kinectCamera, kinectNoise, plane, renderScene

SIZE = (0.20, 0.25, 0.30)  # of the rendered box, in metres
PARALLEL = np.cos(np.radians(10))  # segments that meet at less run along one direction of the box


def built_in_scene():
    """A box in front of a wall, as a Kinect would see it."""
    axes = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    scene = [plane((0, 0, 1.3), (0.05, -0.3, -1)), box((0, 0, 1.0), SIZE[::-1], axes)]
    scan = kinectNoise(renderScene(scene, kinectCamera()), seed=3)
    return scan.src, scan.geometry


def edge_lengths(pieces):
    """Lengths of parallel edges. Parallel edges of a box share no corner: segments that do are pieces of one edge."""
    edges = []  # corners and length
    for piece in pieces:
        corners, length = set(piece["vertices"].tolist()), piece["length"]
        for edge in [edge for edge in edges if edge[0] & corners]:
            edges.remove(edge)
            corners, length = corners | edge[0], length + edge[1]
        edges.append((corners, length))
    return np.array([length for _, length in edges])


def dimensions(segments):
    """Median length, its deviation and the number of edges along each direction, of edges between two corners."""
    whole = segments[(segments["vertices"] >= 0).all(axis=1)]
    left = np.ones(len(whole), bool)
    found = []
    while left.any():
        first = whole[left][whole[left]["endDeviation"].argmin()]
        alike = left & (np.abs(whole["direction"] @ first["direction"]) > PARALLEL)
        lengths = edge_lengths(whole[alike])
        deviation = lengths.std(ddof=1) / np.sqrt(len(lengths)) if len(lengths) > 1 else np.nan
        found.append((np.median(lengths), deviation, len(lengths)))
        left &= ~alike
    return sorted(found)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="depth image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of the camera")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    rendered = args.image is None
    camera = {} if args.K is None else {"K": args.K}
    src, geometry = built_in_scene() if rendered else rangeedge.imreadRange(args.image).withGeometry(**camera)

    found = rangeedge.fitSegments(rangeedge.linkEdges(src, **geometry))
    sizes = dimensions(found.segments)
    print(f"{len(found.segments)} edges, {len(found.vertices)} corners")
    for i, (length, deviation, count) in enumerate(sizes):
        truth = f", truth {SIZE[i]:.4f}, error {1000 * (length - SIZE[i]):+.2f} mm" if rendered else ""
        spread = f" +- {deviation:.4f} from {count} edges" if count > 1 else " from 1 edge"
        print(f"{length:.4f}{spread}{truth}")
    convex = found.segments["dihedral"][found.segments["kind"] == rangeedge.EDGE_CONVEX]
    print("angles between faces:", " ".join(f"{angle:.2f}" for angle in convex), "degrees")

    picture = rangeedge.drawSegments(src, *found, scale=2, lengths=True, **geometry)
    cv2.imwrite(str(args.out / "box_dimensions.png"), picture)
    print(args.out / "box_dimensions.png")
    return sizes


if __name__ == "__main__":
    main()
