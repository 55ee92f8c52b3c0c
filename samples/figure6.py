"""Figure 6 of the paper: how near the strength of a crease comes to the true angle, in theory and as measured.

    python samples/figure6.py [--frequency 16] [--pairs 100] [--out DIR]

CREASE_MAX is the largest directional angle, which the paper takes, CREASE_NORMAL the angle between the normals that the
tangents of several scan lines give. Needs matplotlib.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import rangeedge
from rangeedge import optimality

CREASES = {"CREASE_MAX": rangeedge.CREASE_MAX, "CREASE_NORMAL": rangeedge.CREASE_NORMAL}


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frequency", type=int, default=16, help="of the geodesic dome, 2 to 64 (default: 16)")
    parser.add_argument("--pairs", type=int, default=100, help="plane pairs to measure the detector on (default: 100)")
    parser.add_argument("--sigma", type=float, nargs="*", default=[0.0, 0.2], help="noise in pixel pitches")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the picture (default: out)")
    args = parser.parse_args(argv)
    try:
        theory = {name: optimality.analyseOptimality(args.frequency, crease) for name, crease in CREASES.items()}
        measured = measurements(args.frequency, args.pairs, args.sigma)
    except rangeedge.error as bad:
        parser.error(bad.err)

    print("Estimation error E = crease strength - true angle, in degrees")
    for name, analysis in theory.items():
        print(f"  {name:13}  theory, all {analysis.statistics.count} pairs: {analysis.statistics}")
    for title, errors in measured.items():
        statistics = optimality.errorStatistics(errors)
        print(f"  {title}, {statistics.count} of {errors.size} pairs: {statistics}")

    args.out.mkdir(parents=True, exist_ok=True)
    figure(theory["CREASE_MAX"], measured).savefig(args.out / "figure6.png", dpi=100)
    print(args.out / "figure6.png")


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


def figure(analysis, measured):
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
