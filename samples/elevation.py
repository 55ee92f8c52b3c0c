"""
Breaklines and buildings of an elevation model
==============================================

    python samples/elevation.py [MODEL.tif [--pixel-size D]] [--out DIR]

Heights on a regular grid: larger values are nearer to the viewer (`heightMap`), creases of terrain are flatter than
those of things on a table (`creaseThreshold` 10 to 20), and roofs stand out as jumps. Lines go to `lines.geojson`, in
map coordinates where the model is a GeoTIFF. Without a model: hills, a cutting, a dam and houses, in pixels of 0.5 m
and with noise of 0.05 m.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", nargs="?", help="GeoTIFF, ESRI grid, ...; default: a made one")
    parser.add_argument("--pixel-size", type=float, help="where the file does not say")
    parser.add_argument("--crease-threshold", type=float, default=15.0, help="degrees (default: 15)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    if args.model is None:
        heights, geometry = landscape(), {"pixelSize": 0.5}
    else:
        given = {} if args.pixel_size is None else {"pixelSize": args.pixel_size}
        heights, geometry = rangeedge.imreadRange(args.model).withGeometry(**given)
    geometry = {**geometry, "heightMap": True}

    options = {"jumpThreshold": 0.5, "creaseThreshold": args.crease_threshold}
    edges, strength = rangeedge.detectEdgesWithStrength(heights, **options, **geometry)
    kinds = {"walls": rangeedge.EDGE_JUMP, "ridges": rangeedge.EDGE_CONVEX, "toes": rangeedge.EDGE_CONCAVE}
    for name, bit in kinds.items():
        print(f"{name}: {np.count_nonzero((edges > 0) & (strength.kind & bit > 0))} pixels")
    chains = rangeedge.linkEdges(heights, **options, **geometry)
    rangeedge.writeLines(args.out / "lines.geojson", chains)
    print(f"{len(chains)} lines")

    nothing = np.zeros_like(edges)
    picture = rangeedge.drawEdges(heights, edges, strength.kind, **geometry)
    panels = [("relief", rangeedge.drawEdges(heights, nothing, **geometry))]
    panels.append((f"creases from {args.crease_threshold:g} degrees", picture))
    cv2.imwrite(str(args.out / "elevation.png"), rangeedge.drawPanels(panels, 2, key=True))
    print(args.out / "elevation.png")
    print(args.out / "lines.geojson")


def landscape(size=480, pixel=0.5):
    """Heights in metres."""
    rng = np.random.default_rng(0)
    y, x = pixel * np.indices((size, size), np.float64)
    hills = cv2.GaussianBlur(rng.standard_normal((size, size)), (0, 0), 60)
    height = 6 * hills / hills.std()
    road = np.abs(y - 0.35 * x - 130)  # a cutting, 8 m wide, banks of 34 degrees
    height = np.where(road < 40, np.minimum(height, 2 + 0.67 * np.maximum(road - 4, 0)), height)
    dam = np.abs(x - 190)  # 6 m high, banks of 27 degrees
    height = np.maximum(height, 8 - 0.5 * np.maximum(dam - 3, 0))
    houses = [(30, 25, 16, 10, 6, 0), (70, 40, 12, 9, 5, 25), (120, 20, 20, 12, 7, -15)]
    for left, top, long, wide, eaves, turn in houses:
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        u, v = c * (x - left) + s * (y - top), c * (y - top) - s * (x - left)
        inside = (np.abs(u) < long / 2) & (np.abs(v) < wide / 2)
        ground = height[inside].mean()
        height = np.where(inside, ground + eaves + 0.8 * (wide / 2 - np.abs(v)), height)  # a gable roof of 39 degrees
    height += 0.05 * rng.standard_normal(height.shape)
    height[rng.random(height.shape) < 0.002] = np.nan
    return height.astype(np.float32)


if __name__ == "__main__":
    main()
