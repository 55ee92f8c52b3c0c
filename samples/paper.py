"""
The paper, remade
=================

    python samples/paper.py [--frequency 16] [--pairs 100] [--sigma 0 0.2] [--out DIR]

Figures 6 to 12 of the paper with rendered scenes before the models of its three scanners, and its numbers beside those
found here: how near the strength of a crease comes to the true angle (6), everything about one scene (7), results on
others (8, 9), what adapting the position does (10), a scanner with much noise (11), distances (12). The detector is set
as in the paper, with least squares and adaptation where the paper has them; the last lines are the defaults of this
package. Needs matplotlib.
"""

import argparse
import time
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

import rangeedge
from rangeedge import optimality
from rangeedge.evaluation import evaluateEdges
from rangeedge.synthetic import (
    abwCamera,
    abwNoise,
    curvedScene,
    orthographicCamera,
    perceptronCamera,
    perceptronNoise,
    polyhedraScene,
    renderScene,
    triangulationNoise,
)

CREASES = {"CREASE_MAX": rangeedge.CREASE_MAX, "CREASE_NORMAL": rangeedge.CREASE_NORMAL}
JUMP_CUT, CREASE_CUT = 0.25, 64.0  # inches of the first scanner; degrees
BASIC = {
    "fit": rangeedge.FIT_LSQ, "crease": rangeedge.CREASE_MAX, "maxShift": 4, "maxGap": 0, "maxSmear": 0,
    "shadowEdges": False, "mergeSignificance": 0, "minSignificance": 0,
}  # fmt: skip


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frequency", type=int, default=16, help="of the geodesic dome, 2 to 64 (default: 16)")
    parser.add_argument("--pairs", type=int, default=100, help="plane pairs to measure the detector on (default: 100)")
    parser.add_argument("--sigma", type=float, nargs="*", default=[0.0, 0.2], help="noise in pixel pitches, Figure 6")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the pictures (default: out)")
    args = parser.parse_args(argv)
    try:
        theory = {name: optimality.analyseOptimality(args.frequency, crease) for name, crease in CREASES.items()}
        measured = measurements(args.frequency, args.pairs, args.sigma)
    except rangeedge.error as bad:
        parser.error(bad.err)
    args.out.mkdir(parents=True, exist_ok=True)

    print("Figure 6, error of the crease strength in degrees; the paper: mean 6.4, deviation 7.7")
    for name, analysis in theory.items():
        print(f"  {name:13}  theory, all {analysis.statistics.count} pairs: {analysis.statistics}")
    for title, errors in measured.items():
        statistics = optimality.errorStatistics(errors)
        print(f"  {title}, {statistics.count} of {errors.size} pairs: {statistics}")
    figure6(theory["CREASE_MAX"], measured).savefig(args.out / "figure6.png", dpi=100)
    print(args.out / "figure6.png")
    for name, make in {"figure7": figure7, "figure8": figure8, "figure10": figure10, "figure11": figure11}.items():
        cv2.imwrite(str(args.out / f"{name}.png"), make())
        print(args.out / f"{name}.png")


def technical_arts(seed, curved=False):
    """A scene before the model of the laser scanner of Michigan: 0.03 inch pixels, quiet, with shadows."""
    camera = orthographicCamera((0.03, 0.03), (240, 240))
    rendering = renderScene((curvedScene if curved else polyhedraScene)(seed, camera), camera)
    return rendering, triangulationNoise(rendering, 0.003, seed)


def levels(strength):
    """The overall strength image of the paper (6)."""
    return rangeedge.overallStrength(strength.jump, strength.crease, JUMP_CUT, CREASE_CUT)


def score(edges, rendering, scan):
    """F against the truth, within 3 pixels."""
    nothing = ~np.isfinite(scan.src if scan.src.ndim == 2 else scan.src[..., 2])
    truth = rendering.edges(jumpThreshold=JUMP_CUT / 10 if scan.src.ndim == 2 else 8.0, creaseThreshold=20)
    return evaluateEdges(edges, truth, tolerance=3, ignore=nothing).f


def figure7():
    """One scene of the first scanner: strengths, directions, binary and thinned maps, three eps, kinds."""
    rendering, scan = technical_arts(2)
    start = time.perf_counter()
    strength = rangeedge.edgeStrength(scan.src, 0.02, **scan.geometry, **BASIC)
    took = time.perf_counter() - start
    binary = np.where(levels(strength) >= 80, np.uint8(255), np.uint8(0))  # 80 of 255: 20 degrees
    panels = [
        ("(a) range image", rangeedge.drawEdges(scan.src, np.zeros_like(binary), **scan.geometry)),
        ("(b) overall strength", levels(strength)),
        ("(c) jump", rangeedge.strengthImage(strength.jump, JUMP_CUT)),
        ("(d) crease", rangeedge.strengthImage(strength.crease, CREASE_CUT)),
    ]
    for letter, name in zip("efgh", ("ROWS", "COLS", "DIAG45", "DIAG135"), strict=True):
        one = rangeedge.edgeStrength(
            scan.src, 0.02, directions=getattr(rangeedge, f"DIR_{name}"), **scan.geometry, **BASIC
        )
        panels.append((f"({letter}) crease, {name.lower()}", rangeedge.strengthImage(one.crease, CREASE_CUT)))
    thin = rangeedge.thinEdges(binary)
    panels += [("(i) from 80 on", binary), ("(j) thinned, eps 0.02", thin)]
    print("Figure 7, F of the thinned maps; the paper: no essential difference")
    print(f"  eps 0.02   F {score(thin, rendering, scan):.3f}, in {1000 * took:.0f} ms; the paper 1500 ms")
    for letter, eps in (("k", 0.015), ("l", 0.025)):
        other = rangeedge.edgeStrength(scan.src, eps, **scan.geometry, **BASIC)
        lines = rangeedge.thinEdges(np.where(levels(other) >= 80, np.uint8(255), np.uint8(0)))
        print(f"  eps {eps:<5}  F {score(lines, rendering, scan):.3f}")
        panels.append((f"({letter}) thinned, eps {eps}", lines))
    for letter, bit, name in (("m", rangeedge.EDGE_CONVEX, "convex"), ("n", rangeedge.EDGE_CONCAVE, "concave")):
        panels.append((f"({letter}) {name}", np.where(strength.kind & bit > 0, thin, np.uint8(0))))
    distance = rangeedge.distanceTransform(binary)
    salience = rangeedge.salienceDistanceTransform(levels(strength) / np.float32(255))
    panels.append(("12 (a) distance", rangeedge.colorizeDistance(distance)))
    panels.append(("12 (b) salience distance", rangeedge.colorizeDistance(salience, log=True)))
    return rangeedge.drawPanels(panels, 4)


def figure8():
    """Other scenes of that scanner: overall strength and thinned map."""
    panels = []
    print("Figures 8 and 9, F of the thinned maps, eps 0.02, from 80 on; the paper shows pictures")
    for seed, curved in ((3, False), (4, False), (5, True), (6, True)):
        rendering, scan = technical_arts(seed, curved)
        strength = rangeedge.edgeStrength(scan.src, 0.02, **scan.geometry, **BASIC)
        thin = rangeedge.thinEdges(np.where(levels(strength) >= 80, np.uint8(255), np.uint8(0)))
        own = rangeedge.detectEdges(scan.src, creaseThreshold=20, **scan.geometry)
        name = f"{'curved' if curved else 'polyhedra'} {seed}"
        print(f"  {name}: {score(thin, rendering, scan):.3f}; the defaults {score(own, rendering, scan):.3f}")
        panels += [(f"{name}, strength", levels(strength)), ("thinned", thin)]
    return rangeedge.drawPanels(panels, 4)


def figure10():
    """The structured-light scanner: edges as splitting has them, and adapted to where the curves intersect."""
    camera = abwCamera()
    rendering = renderScene(polyhedraScene(1, camera), camera)
    scan = abwNoise(rendering, seed=1)
    truth = rendering.edges(jumpThreshold=8.0, creaseThreshold=30)
    nothing = ~np.isfinite(scan.src[..., 2])
    panels = []
    print("Figure 10, distance of the edges from the truth in pixels; the paper: adaptation is useful")
    for title, shift in (("as splitting has them", 0), ("adapted", 4)):
        strength = rangeedge.edgeStrength(scan.src, 3.0, **{**BASIC, "maxShift": shift})
        thin = rangeedge.thinEdges(rangeedge.selectEdges(strength.jump, strength.crease, 8.0, 30))
        scores = evaluateEdges(thin, truth, tolerance=3, ignore=nothing)
        print(f"  {title}: {scores.shift:.2f}, F {scores.f:.3f}")
        panels.append((f"{title}: {scores.shift:.2f} pixels off", rangeedge.drawEdges(scan.src, thin, strength.kind)))
    own, strength = rangeedge.detectEdgesWithStrength(scan.src)
    scores = evaluateEdges(own, truth, tolerance=3, ignore=nothing)
    print(f"  the defaults: {scores.shift:.2f}, F {scores.f:.3f}")
    panels.append((f"defaults: {scores.shift:.2f} pixels off", rangeedge.drawEdges(scan.src, own, strength.kind)))
    return rangeedge.drawPanels(panels, 3, key=True)


def figure11():
    """The time-of-flight scanner: much noise, for which the paper asks for better thresholds."""
    camera = perceptronCamera()
    rendering = renderScene(polyhedraScene(1, camera), camera)
    scan = perceptronNoise(rendering, seed=1)
    strength = rangeedge.edgeStrength(scan.src, 4.0, **BASIC)
    thin = rangeedge.thinEdges(rangeedge.selectEdges(strength.jump, strength.crease, 8.0, 30))
    own, kinds = rangeedge.detectEdgesWithStrength(scan.src)
    print("Figure 11, F; the paper: many spurious edge points were reported")
    print(f"  from 120 on {score(thin, rendering, scan):.3f}, the defaults {score(own, rendering, scan):.3f}")
    overall = rangeedge.overallStrength(strength.jump, strength.crease, 20.0)
    panels = [
        ("overall strength", cv2.cvtColor(overall, cv2.COLOR_GRAY2BGR)),
        ("from 120 on: 30 degrees", rangeedge.drawEdges(scan.src, thin, strength.kind)),
        ("defaults", rangeedge.drawEdges(scan.src, own, kinds.kind)),
    ]
    return rangeedge.drawPanels(panels, 3, key=True)


def measurements(frequency, count, sigmas):
    """Errors on a random sample of the pairs of the simulation, first in theory, then by the detector."""
    normals = optimality.geodesicDome(frequency, optimality.MAX_SLANT)
    rng = np.random.default_rng(0)
    pairs = normals[np.array([rng.choice(len(normals), 2, replace=False) for _ in range(max(count, 1))]).T]
    errors = {f"{name:13}  theory": optimality.estimationError(*pairs, crease) for name, crease in CREASES.items()}
    for sigma in sigmas:
        for name, crease in CREASES.items():
            errors[f"{name:13}  detector, sigma {sigma:g}"] = optimality.measureDetector(*pairs, sigma, crease)
    return errors


def figure6(analysis, measured):
    """The five plots of Figure 6, and the measured errors."""
    picture = Figure(figsize=(14, 8), layout="constrained")
    (histogram, mean, deviation), (section_mean, section_deviation, sample) = picture.subplots(2, 3)

    histogram.stairs(100 * analysis.histogram / analysis.statistics.count, analysis.errorEdges, fill=True)
    histogram.set(title="(a) histogram of E", xlabel="E [°]", ylabel="pairs [%]")
    for axes, values, title in (
        (mean, analysis.slantMean, "(b) mean of |E|"),
        (deviation, analysis.slantDeviation, "(c) deviation of |E|"),
    ):
        mesh = axes.pcolormesh(analysis.slantEdges, analysis.slantEdges, values, vmin=0)
        picture.colorbar(mesh, ax=axes, label="[°]")
        axes.set(title=title, xlabel="slant α₁ [°]", ylabel="slant α₂ [°]", aspect="equal")
    for axes, values, title in (
        (section_mean, analysis.sectionMean, "(d) mean of |E|"),
        (section_deviation, analysis.sectionDeviation, "(e) deviation of |E|"),
    ):
        axes.stairs(values, analysis.slantEdges, baseline=None)
        axes.set(title=title, xlabel="angle A of the optimal section [°]", ylabel="[°]", ylim=(0, None))
    for title, errors in measured.items():
        absolute = np.sort(np.abs(errors[np.isfinite(errors)]))
        share = 100 * np.arange(1, absolute.size + 1) / errors.size
        sample.plot(absolute, share, label=title, linestyle="--" if "theory" in title else "-")
    sample.set(title="|E| of a sample", xlabel="|E| [°]", ylabel="pairs up to |E| [%]", xlim=(0, 30), ylim=(0, 100))
    sample.legend(loc="lower right", fontsize="x-small")
    return picture


if __name__ == "__main__":
    main()
