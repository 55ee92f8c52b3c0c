"""
How large is the box?
=====================

    python samples/box_dimensions.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

The length, width and height of the largest box in one depth frame. A box is two or three flat regions that meet each
other at convex edges and about right angles, and that the image does not cut off. Each of its dimensions is measured
along strips of its faces, from border to border, or from the plane of the face at one end; the deviation tells how
much the strips differ. Without an image it renders a box as a Kinect would see it, and says how far off the result is.
"""

import argparse
from itertools import combinations, product
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import box, kinectCamera, kinectNoise, plane, renderScene

SIZE = (0.20, 0.25, 0.30)  # of the rendered box, in metres
RIGHT = 12.0  # degrees that angles between faces may be off a right one
COPLANAR = 6.0, 4.0  # degrees, and deviations of the faces, that two parts of one face may be off each other
BULGE = 0.02  # of its size, that a face may be off a plane
STRIP = 1.5  # pixels, the width of a strip
ALIKE = 0.04  # of the length of a strip, by which those differ from the longest that something hides or holes cut
INK = (255, 255, 255)


class Dimension(NamedTuple):
    """One of the three."""

    length: float
    deviation: float
    strips: int
    ends: tuple[float, float]  # along the axis


def built_in_scene():
    """A box in front of a wall, as a Kinect would see it."""
    axes = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    scene = [plane((0, 0, 1.3), (0.05, -0.3, -1)), box((0, 0, 1.0), SIZE[::-1], axes)]
    scan = kinectNoise(renderScene(scene, kinectCamera()), seed=3)
    return scan.src, scan.geometry


class Face:
    """A flat region, or several in one plane."""

    def __init__(self, points, inside):
        self.inside, self.points = inside, points[inside]
        self.centre = self.points.mean(axis=0)
        self.normal = np.linalg.svd(self.points - self.centre, full_matrices=False)[2][2]
        self.normal *= -np.sign(self.normal @ self.centre)  # toward the viewer, who is at (0, 0, 0)
        self.rms = np.sqrt(np.mean(((self.points - self.centre) @ self.normal) ** 2))
        steps = np.linalg.norm(points[:, 1:] - points[:, :-1], axis=2)[inside[:, 1:] & inside[:, :-1]]
        self.spacing = np.median(steps) if len(steps) else np.inf  # of pixels
        self.area = len(self.points) * self.spacing**2
        frame = [inside[0], inside[-1], inside[:, 0], inside[:, -1]]
        self.cut_off = any(np.count_nonzero(border) > 2 for border in frame)

    @property
    def nearly_flat(self):
        """As cardboard is that bulges."""
        return self.rms < BULGE * np.sqrt(self.area)

    def in_plane_of(self, other):
        angle = np.degrees(np.arccos(min(self.normal @ other.normal, 1)))
        off = abs((self.centre - other.centre) @ other.normal)
        return angle < COPLANAR[0] and off < COPLANAR[1] * max(self.rms, other.rms)


def faces_of(src, geometry):
    """Flat regions by their labels, and pairs of labels that meet at convex right angles."""
    count, labels, _, _, surfaces = rangeedge.segmentRegionsWithStats(src, **geometry)
    points = rangeedge.backproject(src, **geometry)
    points = np.where(np.isfinite(points), points, 0)
    faces = {label: Face(points, labels == label) for label in range(1, count)}
    faces = {label: face for label, face in faces.items() if face.nearly_flat or not surfaces["curved"][label]}
    pairs = rangeedge.regionAdjacency(src, labels, **geometry)
    convex = pairs[(pairs["kind"] == rangeedge.EDGE_CONVEX) & (np.abs(pairs["dihedral"] - 90) < RIGHT)]
    meeting = {pair for pair in convex[["first", "second"]].tolist() if set(pair) <= faces.keys()}
    meeting |= {(b, a) for a, b in meeting}
    for a, b in combinations(faces, 2):  # parts of one face
        if faces[a].in_plane_of(faces[b]) and any({(a, c), (b, c)} <= meeting for c in faces):
            faces[a] = faces[b] = Face(points, faces[a].inside | faces[b].inside)
    return faces, meeting


def largest_box(faces, meeting):
    """The faces of the box of the largest visible area; [] where there is none."""
    found = []
    for a, b in meeting:
        found.append([a, b])
        found += [[a, b, c] for c in faces if {(a, c), (b, c)} <= meeting]
    whole = [group for group in found if not any(faces[label].cut_off for label in group)]
    return max(whole, key=lambda group: sum(faces[label].area for label in group), default=[])


def axes_of(faces):
    """Three directions at right angles, nearest to the normals of the faces, which come first; large ones count more.

    Of two faces the edge in which they meet is the third direction, and as good as the better one.
    """
    normals, weights = [face.normal for face in faces], [face.area for face in faces]
    if len(normals) == 2:
        normals.append(np.cross(*normals))
        weights.append(max(weights))
    u, _, v = np.linalg.svd(np.array(normals) * np.array(weights)[:, None])
    return u @ v


def measured(axes, faces, k):
    """The dimension along axis k."""
    plane = np.median(faces[k].points @ axes[k]) if k < len(faces) else None  # of the face at this end
    lengths, ends = [], []
    for i, face in enumerate(faces):
        if i == k:
            continue
        along, across = face.points @ axes[k], face.points @ axes[3 - i - k]
        strip = np.floor(across / (STRIP * face.spacing)).astype(int)
        for part in (along[strip == number] for number in np.unique(strip)):
            low = part.min() - face.spacing / 2
            high = part.max() + face.spacing / 2 if plane is None else plane
            lengths.append(high - low)
            ends.append((low, high))
    lengths, ends = np.array(lengths), np.array(ends)
    longest = np.quantile(lengths, 0.9)
    whole = np.abs(lengths - longest) < ALIKE * longest
    length = np.median(lengths[whole])
    deviation = 1.48 * np.median(np.abs(lengths[whole] - length))
    return Dimension(length, deviation, int(np.count_nonzero(whole)), tuple(np.median(ends[whole], axis=0)))


def drawing(src, geometry, faces, axes, dimensions):
    """The faces, and the box as it was measured, with its dimensions."""
    labels = np.zeros(src.shape[:2], np.int32)
    for number, face in enumerate(faces, 1):
        labels[face.inside] = number
    picture = cv2.resize(rangeedge.drawRegions(labels, src, 0.5, **geometry), None, fx=2, fy=2)
    # Corners are numbered in binary: of the low or the high end of each dimension.
    corners = np.array(list(product(*(dimension.ends for dimension in dimensions))))
    places = 2 * rangeedge.project(corners @ axes, **geometry)[:, :2] + 0.5
    for first, last in combinations(range(8), 2):
        if bin(first ^ last).count("1") != 1:
            continue
        ends = [tuple(int(c) for c in places[i]) for i in (first, last)]
        cv2.line(picture, *ends, INK, 1, cv2.LINE_AA)
    # At the edges that meet in the corner nearest to the viewer: high ends, where planes of faces are.
    for k, dimension in enumerate(dimensions):
        x, y = (places[7] + places[7 - (4 >> k)]) / 2
        text, place = f"{dimension.length:.3f} +- {dimension.deviation:.3f}", (int(x) + 4, int(y) - 4)
        for colour, width in (((0, 0, 0), 3), (INK, 1)):
            cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, width, cv2.LINE_AA)
    return picture


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

    all_faces, meeting = faces_of(src, geometry)
    group = largest_box(all_faces, meeting)
    if not group:
        print("no box: no two flat regions inside of the image meet at a convex right angle")
        return []
    faces = [all_faces[label] for label in group]
    axes = axes_of(faces)
    dimensions = [measured(axes, faces, k) for k in range(3)]
    angles = [np.degrees(np.arccos(a.normal @ b.normal)) for a, b in combinations(faces, 2)]
    print(f"a box of which {len(faces)} faces are seen, at angles of {', '.join(f'{a:.1f}' for a in angles)} degrees")
    for i, size in enumerate(sorted(dimensions)):
        truth = f", truth {SIZE[i]:.4f}, error {1000 * (size.length - SIZE[i]):+.2f} mm" if rendered else ""
        print(f"{size.length:.4f} +- {size.deviation:.4f}, the scatter of {size.strips} strips{truth}")

    cv2.imwrite(str(args.out / "box_dimensions.png"), drawing(src, geometry, faces, axes, dimensions))
    print(args.out / "box_dimensions.png")
    return sorted(dimensions)


if __name__ == "__main__":
    main()
