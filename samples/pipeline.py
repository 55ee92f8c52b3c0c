"""
Where could a gripper hold something?
=====================================

    python samples/pipeline.py [IMAGE -K fx,fy,cx,cy] [--out DIR]

From a frame of a depth camera to places for a suction cup. `candidates` is the step to drop in between camera and
robot: it takes a frame as the driver delivers it, and returns places where a suction cup fits on one surface, each
with the normal there. Surfaces that leave the picture, such as the table, are no objects.
"""

import argparse
import csv
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


class Candidate(NamedTuple):
    """A place to grip in the frame of the camera, in metres."""

    center: np.ndarray
    normal: np.ndarray  # toward the camera
    free: float  # radius of the disc around it that stays on the surface
    unevenness: float  # root mean square distance of the surface from a plane under the cup


def candidates(depth, K, depthFactor=1000.0, cup=0.015, unevenness=0.003):
    """Places for a suction cup of radius `cup` where the surface is even; the nearest first."""
    labels = rangeedge.segmentRegions(depth, K=K, depthFactor=depthFactor)
    labels = cv2.medianBlur(labels.astype(np.uint16), 5)  # pixels without data here and there do no harm
    inside = (cv2.dilate(labels, np.ones((3, 3))) == labels) & (cv2.erode(labels, np.ones((3, 3))) == labels)
    distance = rangeedge.distanceTransform(~inside)
    points = rangeedge.backproject(depth, K=K, depthFactor=depthFactor)
    outermost = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    found = []
    for label in np.setdiff1d(labels, [0, *outermost]):
        x, y = cv2.minMaxLoc(np.where(labels == label, distance, 0))[3]
        pixel = points[y, x, 2] / K[0, 0]  # its width on a surface that faces the camera, NaN without data
        if distance[y, x] * pixel >= cup and cup >= 3 * pixel:
            center, normal, spread = place_at(points, x, y, cup / pixel)
            found.append(Candidate(center, normal, distance[y, x] * pixel, spread))
    return sorted((c for c in found if c.unevenness <= unevenness), key=lambda c: c.center[2])


def place_at(points, x, y, radius):
    """Center, normal and unevenness of the plane through the points within `radius` of a pixel."""
    rows, cols = np.indices(points.shape[:2])
    near = points[np.hypot(cols - x, rows - y) <= radius]
    near = near[np.isfinite(near[:, 2])]
    center = near.mean(axis=0)
    _, spread, axes = np.linalg.svd(near - center, full_matrices=False)
    normal = axes[2] * -np.sign(axes[2] @ center)
    return center, normal, spread[2] / np.sqrt(len(near))


def draw(picture, found, K, cup):
    """Cups as they would sit on the surfaces, with their normals, numbered from the nearest."""
    for rank, place in enumerate(found, 1):
        side = np.cross(place.normal, (0, 1, 0))
        side /= np.linalg.norm(side)
        turn = np.linspace(0, 2 * np.pi, 40)[:, np.newaxis]
        rim = place.center + cup * (np.cos(turn) * side + np.sin(turn) * np.cross(place.normal, side))
        foot, tip = pixels([place.center, place.center + 0.06 * place.normal], K)
        cv2.polylines(picture, [pixels(rim, K)], True, (255, 255, 255), 2, cv2.LINE_AA)
        cv2.arrowedLine(picture, foot, tip, (66, 228, 240), 2, cv2.LINE_AA, tipLength=0.25)
        number(picture, str(rank), tip, tip - foot)
    return picture


def number(picture, text, place, direction):
    """A number beyond a place, seen in a direction, on whatever is there."""
    font, size = cv2.FONT_HERSHEY_SIMPLEX, 0.5
    width, height = cv2.getTextSize(text, font, size, 1)[0]
    away = direction / np.linalg.norm(direction) if direction.any() else np.array([0, -1])
    corner = place + 14 * away + (-width / 2, height / 2)
    for colour, thickness in (((0, 0, 0), 4), ((255, 255, 255), 1)):
        cv2.putText(picture, text, np.rint(corner).astype(int), font, size, colour, thickness, cv2.LINE_AA)


def pixels(points, K):
    projected = np.asarray(points) @ K.T
    return np.rint(projected[:, :2] / projected[:, 2:]).astype(np.int32)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="depth image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of the camera")
    parser.add_argument("--cup", type=float, default=0.015, help="radius of the suction cup, metres (default: 0.015)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    depth, geometry = load(args.image, args.K)
    if "K" not in geometry:
        parser.error("a depth image of a pinhole camera is needed: give -K fx,fy,cx,cy")
    args.out.mkdir(parents=True, exist_ok=True)

    K = rangeedge.ScanLineParams(K=geometry["K"]).K
    found = candidates(depth, K, geometry.get("depthFactor", 1000.0), args.cup)
    print(f"{len(found)} candidates")

    relief = rangeedge.drawEdges(depth, np.zeros(depth.shape, np.uint8), **geometry)
    cv2.imwrite(str(args.out / "candidates.png"), draw(relief, found, K, args.cup))
    print(args.out / "candidates.png")
    with open(args.out / "candidates.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["x", "y", "z", "normal_x", "normal_y", "normal_z", "free", "unevenness"])
        rows.writerows([f"{v:.4f}" for v in (*c.center, *c.normal, c.free, c.unevenness)] for c in found)
    print(args.out / "candidates.csv")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


if __name__ == "__main__":
    main()
