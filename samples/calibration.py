"""
What a significance of k means
==============================

    python samples/calibration.py [--seed 0] [--out DIR]

How many steps of noise alone exceed k deviations, against the normal law: noise of several kinds without any edge.
`estimateNoise` measures how much the slopes of straight lines fitted to n
pixels on either side of a place are off, and their values at the common border; the table has the share of places where
these differ by more than k deviations of the estimate, divided by what a normal deviate has. 1 is right.
Needs matplotlib and SciPy.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure
from scipy.stats import norm

import rangeedge

SHAPE, SIGMA, DEPTH = (480, 640), 0.003, 2.0
LEVELS, THRESHOLDS = (4, 8, 16, 32), (1, 2, 3, 4, 5)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0, help="of the noise (default: 0)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the picture (default: out)")
    args = parser.parse_args(argv)

    normal = np.array([2 * norm.sf(k) for k in THRESHOLDS])
    curves = {}
    print(f"Steps beyond k deviations, over the share of a normal deviate, for k = {', '.join(map(str, THRESHOLDS))}")
    for kind, noise in noises(np.random.default_rng(args.seed)).items():
        estimate = rangeedge.estimateNoise(DEPTH + SIGMA * noise)
        for n in LEVELS:
            for what, sizes in significances(SIGMA * noise, n, estimate).items():
                share = np.array([np.mean(sizes > k) for k in THRESHOLDS])
                curves[kind, n, what] = share
                print(f"  {kind:13} n = {n:2}  {what}  " + " ".join(f"{ratio:7.2f}" for ratio in share / normal))

    args.out.mkdir(parents=True, exist_ok=True)
    figure(curves, normal).savefig(args.out / "calibration.png", dpi=100)
    print(args.out / "calibration.png")


def noises(rng):
    """Noise by its kind, of about unit deviation; the smooth ones with some white noise, as sensors have it."""
    kinds = {"white": rng.standard_normal(SHAPE)}
    for radius in (1, 2, 4, 8):
        waves = cv2.GaussianBlur(rng.standard_normal(SHAPE), (0, 0), radius)
        kinds[f"blurred by {radius}"] = waves / waves.std() + 0.25 * rng.standard_normal(SHAPE)
    slope = 0.37 * np.arange(SHAPE[1])
    kinds["quantised"] = np.rint(0.7 * rng.standard_normal(SHAPE) + slope)
    return kinds


def significances(noise, n, estimate):
    """|step| / deviation along rows between fits to n pixels, in slope and in value."""
    k = np.arange(n) - (n - 1) / 2
    slope, mean = k / (k @ k), np.full(n, 1 / n)
    # Differences of two steps vanish on every curve of second degree.
    differences = {
        "slope": np.concatenate([slope, -2 * slope, slope]),
        "value": np.concatenate([mean + n / 2 * slope, -2 * mean, mean - n / 2 * slope]),
    }
    rows = np.reshape(estimate.fits[4:], (2, -1))[0]
    level = LEVELS.index(n)
    factors = {"slope": rows[level], "value": rows[5 + level]}
    windows = np.lib.stride_tricks.sliding_window_view(noise, 3 * n, axis=1)[:, :: max(1, n // 4)]
    return {
        what: np.abs(windows @ weights) / (estimate.a * np.linalg.norm(weights) * factors[what])
        for what, weights in differences.items()
    }


def figure(curves, normal):
    """One plot for each kind of noise: the share beyond k, by the number of pixels."""
    kinds = list(dict.fromkeys(kind for kind, _, _ in curves))
    picture = Figure(figsize=(13, 7), layout="constrained")
    for axes, kind in zip(picture.subplots(2, 3).flat, kinds, strict=True):
        axes.fill_between(THRESHOLDS, normal / 2, normal * 2, color="0.9", label="normal, within a factor of 2")
        for (own, n, what), share in curves.items():
            if own == kind:
                share = np.where(np.array(share) > 0, share, np.nan)  # a line ends where nothing was beyond
                axes.plot(THRESHOLDS, share, "-" if what == "slope" else "--", label=f"{what}, n = {n}")
        axes.set(title=kind, xlabel="k", ylabel="share beyond k", yscale="log", ylim=(1e-7, 1))
    axes.legend(fontsize="x-small", loc="lower left")
    return picture


if __name__ == "__main__":
    main()
