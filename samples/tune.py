"""
What the parameters trade
=========================

    python samples/tune.py [IMAGE [-K fx,fy,cx,cy] [--truth EDGES]] [--seed 2] [--out DIR]

How epsFactor, minSignificance, creaseThreshold and lineSignificance act, as each runs from small to large and the
others keep their defaults, and a part of one scan line with its segments at three tolerances. Of a rendered scene, or
with --truth, an image that is not 0 on the true edges: precision and recall. Of an image of your own, of which nobody
knows the truth: edge pixels by kind; a good value is on a plateau, before true edges go. Dotted lines are the defaults.
Needs matplotlib.
"""

import argparse
from inspect import signature
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

import rangeedge
from rangeedge.evaluation import evaluateEdges
from rangeedge.synthetic import kinectCamera, kinectNoise, polyhedraScene, renderScene

SWEEPS = {
    "epsFactor": (1.5, 2.5, 3.5, 5, 8, 14, 25),
    "minSignificance": (0, 3, 5, 7, 10, 15, 25),
    "creaseThreshold": (8, 15, 20, 30, 40, 60, 90),
    "lineSignificance": (0, 10, 20, 30, 40, 60, 100),
}
KINDS = {"jump": rangeedge.EDGE_JUMP, "convex": rangeedge.EDGE_CONVEX, "concave": rangeedge.EDGE_CONCAVE}
STYLES = {
    "precision": ("o-", "#0072B2"), "recall": ("s--", "#D55E00"),
    "jump": ("o-", "#D55E00"), "convex": ("s--", "#E69F00"), "concave": ("^:", "#0072B2"),
}  # fmt: skip
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="range image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of a camera")
    parser.add_argument("--truth", metavar="EDGES", help="8-bit image of the same size, not 0 on the true edges")
    parser.add_argument("--seed", type=int, default=2, help="of the rendered scene and its noise (default: 2)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the picture (default: out)")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    src, geometry, truth = rendered(args.seed) if args.image is None else own(args.image, args.K, args.truth)
    geometry["noise"] = rangeedge.estimateNoise(src, **geometry)

    curves = {}
    for name, values in SWEEPS.items():
        print(name)
        for value in values:
            edges, strength = rangeedge.detectEdgesWithStrength(src, **geometry, **{name: value})
            figures = scores(edges, truth, src) if truth is not None else counts(edges, strength.kind)
            curves.setdefault(name, []).append(figures)
            print(f"  {value:6g}  " + "  ".join(f"{figure} {number:.6g}" for figure, number in figures.items()))

    picture = Figure(figsize=(13, 9), layout="constrained")
    parts = picture.subfigures(2, 1, height_ratios=(1.3, 1))
    most = max(number for curve in curves.values() for figures in curve for number in figures.values())
    for axes, name in zip(parts[0].subplots(1, 4, sharey=True), SWEEPS, strict=True):
        axes.set_ylim(0, 1.05 * most)
        draw_curves(axes, name, curves[name], "" if truth is not None else "edge pixels")
    place = beside_a_crease(src, geometry)
    for axes, factor in zip(parts[1].subplots(1, 3), (1, 3.5, 14), strict=True):
        draw_line(axes, src, place, factor, geometry)
    picture.savefig(args.out / "tune.png", dpi=90)
    print(args.out / "tune.png")


def rendered(seed):
    """Polyhedra as a noisy Kinect sees them: image, geometry, true edges."""
    camera = kinectCamera()
    rendering = renderScene(polyhedraScene(seed, camera), camera)
    scan = kinectNoise(rendering, 0.004, seed)
    return scan.src, dict(scan.geometry), rendering.edges(jumpThreshold=0.01, creaseThreshold=30)


def own(name, K, truth):
    """An image that is a file, its geometry, and its true edges where there is a file of them."""
    image = rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))
    known = None if truth is None else cv2.imread(truth, cv2.IMREAD_GRAYSCALE) > 0
    return image.src, dict(image.geometry), None if known is None else known * np.uint8(rangeedge.EDGE_JUMP)


def scores(edges, truth, src):
    """Precision and recall, within three pixels."""
    no_data = ~np.isfinite(src) | (src == 0)
    found = evaluateEdges(edges, truth, tolerance=3, ignore=no_data if src.ndim == 2 else None)
    return {"precision": round(found.precision, 3), "recall": round(found.recall, 3)}


def counts(edges, kind):
    """Edge pixels of each kind; a jump hides a crease."""
    jump = kind & rangeedge.EDGE_JUMP > 0
    of = {name: (kind & bit > 0) & (jump if name == "jump" else ~jump) for name, bit in KINDS.items()}
    return {name: np.count_nonzero((edges > 0) & there) for name, there in of.items()}


def beside_a_crease(src, geometry):
    """A pixel in the middle of the crease that most rows cross, or of the image where there is none."""
    creases = rangeedge.EDGE_CONVEX | rangeedge.EDGE_CONCAVE
    lines = [chain.points for chain in rangeedge.linkEdges(src, **geometry) if chain.kind & creases]
    if not lines:
        return src.shape[1] // 2, src.shape[0] // 2
    points = max(lines, key=lambda points: np.ptp(points["y"]))
    middle = points[len(points) // 2]
    return int(middle["x"]), int(middle["y"])


def draw_curves(axes, name, curve, what):
    """What was counted, by the values as they are swept."""
    places = np.arange(len(curve))
    for figure in curve[0]:
        style, colour = STYLES[figure]
        axes.plot(places, [figures[figure] for figures in curve], style, color=colour, label=figure)
    default = signature(rangeedge.detectEdges).parameters[name].default or 20  # which None is for lineSignificance
    axes.axvline(np.interp(default, SWEEPS[name], places), color="0.4", linestyle=":")
    axes.set(title=name, xticks=places, xticklabels=[f"{value:g}" for value in SWEEPS[name]])
    axes.grid(color="0.9")
    axes.legend(loc="best", title=what)


def draw_line(axes, src, place, factor, geometry):
    """The row around a pixel: samples, segments, candidates."""
    options = {"epsFactor": factor, "mergeSignificance": 0, "directions": rangeedge.DIR_ROWS}
    (row,) = rangeedge.explainPixel(src, *place, reach=70, **options, **geometry).lines
    axes.plot(row.samples["x"], row.samples["depth"], ".", color="0.6", markersize=4)
    for i, segment in enumerate(row.segments):
        part = row.samples[max(0, int(segment["first"])) : int(segment["last"]) + 1]
        axes.plot(part["x"], part["fittedDepth"], color=(BLUE, GREEN)[i % 2], linewidth=2)
    kept = [cut for cut in row.cuts if not cut.test]
    for cut in kept:
        axes.axvline(cut.x, color=VERMILION, linewidth=1)
    axes.set(title=f"epsFactor {factor:g}: segments {len(row.segments)}, candidates {len(kept)}")
    axes.set(xlabel=f"pixel of row {place[1]}", ylabel="height" if geometry.get("heightMap") else "depth")
    if not geometry.get("heightMap"):
        axes.invert_yaxis()


if __name__ == "__main__":
    main()
