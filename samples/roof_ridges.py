"""
Ridges and eaves on a map
=========================

python samples/roof_ridges.py [IMAGE] [--out DIR]

Roofs of a surface model as lines in GeoJSON. An IMAGE with a georeference (GeoTIFF, ASCII grid) gives lines in its
coordinates. Without one the sample makes three houses with gable roofs, and prints how far ridges and eaves are from
the truth.
"""

import numpy as np
from common import load, parser, write

import rangeedge
from rangeedge import EDGE_CONVEX, EDGE_JUMP, RangeImage

PIXEL = 0.25  # metres
SIZE = (320, 260)
CORNER, EPSG = (358000.0, 5812000.0), 32633  # of the map, upper left; UTM zone 33
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
    geometry = {"pixelSize": (PIXEL, PIXEL), "heightMap": True}
    return RangeImage(height, geometry, georeference=georeference, epsg=EPSG)


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
    kinds = {EDGE_CONVEX: "ridges", EDGE_JUMP: "eaves"}
    off = off_the_truth(segments) if rendered else {}
    for kind, name in kinds.items():
        own = segments[segments["kind"] == kind]
        truth = f", {100 * np.sqrt(np.mean(np.square(off[kind]))):.1f} cm rms from the truth" if off.get(kind) else ""
        print(f"{len(own)} {name}, {own['length'].sum():.1f} m{truth}")

    write(args.out, "roof_ridges.png", rangeedge.drawSegments(src, segments, scale=2, lengths=True, **geometry))
    rangeedge.writeLines(args.out / "roof_ridges.geojson", segments, image.georeference, epsg=image.epsg)
    print(args.out / "roof_ridges.geojson")
    return off


if __name__ == "__main__":
    main()
