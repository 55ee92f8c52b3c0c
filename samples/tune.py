"""
What the parameters trade
=========================

    python samples/tune.py [--seed 2] [--out DIR]

Precision and recall, as each of epsFactor, minSignificance, creaseThreshold and lineSignificance runs from small to
large and the others keep their defaults, on a noisy rendered scene whose truth is known; and a part of one scan line
with its segments at three tolerances. Dotted lines are the defaults. Needs matplotlib.
"""

import argparse
from inspect import signature
from pathlib import Path

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
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=2, help="of the scene and the noise (default: 2)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the picture (default: out)")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    camera = kinectCamera()
    rendering = renderScene(polyhedraScene(args.seed, camera), camera)
    scan = kinectNoise(rendering, 0.004, args.seed)
    geometry = {**scan.geometry, "noise": rangeedge.estimateNoise(scan.src, **scan.geometry)}
    truth = rendering.edges(jumpThreshold=0.01, creaseThreshold=30)

    curves = {}
    for name, values in SWEEPS.items():
        print(name)
        for value in values:
            edges = rangeedge.detectEdges(scan.src, **geometry, **{name: value})
            scores = evaluateEdges(edges, truth, tolerance=3, ignore=scan.src == 0)
            curves.setdefault(name, []).append((scores.recall, scores.precision))
            print(f"  {value:6g}  precision {scores.precision:.3f}  recall {scores.recall:.3f}  F {scores.f:.3f}")

    picture = Figure(figsize=(13, 9), layout="constrained")
    parts = picture.subfigures(2, 1, height_ratios=(1.3, 1))
    for axes, name in zip(parts[0].subplots(1, 4, sharey=True), SWEEPS, strict=True):
        draw_curve(axes, name, np.array(curves[name]))
    y, x = np.argwhere((rendering.crease > 60) & (rendering.jump == 0))[0]  # the corner of an object
    for axes, factor in zip(parts[1].subplots(1, 3), (1, 3.5, 14), strict=True):
        draw_line(axes, scan.src, (int(x), int(y) + 12), factor, geometry)
    picture.savefig(args.out / "tune.png", dpi=90)
    print(args.out / "tune.png")


def draw_curve(axes, name, curve):
    """Precision and recall, by the values as they are swept."""
    places = np.arange(len(curve))
    axes.plot(places, curve[:, 1], "o-", color=BLUE, label="precision")
    axes.plot(places, curve[:, 0], "s--", color=VERMILION, label="recall")
    default = signature(rangeedge.detectEdges).parameters[name].default or 20  # which None is for lineSignificance
    axes.axvline(np.interp(default, SWEEPS[name], places), color="0.4", linestyle=":")
    axes.set(title=name, xticks=places, xticklabels=[f"{value:g}" for value in SWEEPS[name]], ylim=(0, 1.03))
    axes.grid(color="0.9")
    axes.legend(loc="lower left")


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
    axes.set(title=f"epsFactor {factor:g}: {len(row.segments)} segments, {len(kept)} candidates")
    axes.set(xlabel=f"pixel of row {place[1]}", ylabel="depth [m]")
    axes.invert_yaxis()


if __name__ == "__main__":
    main()
