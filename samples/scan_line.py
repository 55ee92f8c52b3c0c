"""
One scan line, as the paper shows it
====================================

    python samples/scan_line.py [--noise 0.0] [--out DIR]

Figures 3 to 5 and Table 2 of the paper on the row of an image of two cylinders that meet at 36.3 degrees: how splitting
proceeds, the strengths of its cuts, and how the position of an edge in noise is adapted. The paper's line has six
candidates, of 1.6 to 4.0 degrees but for the edge with 36.3; this one has fewer. Needs matplotlib.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import rangeedge
from rangeedge.synthetic import orthographicCamera, renderScene, twoCylinders

PIXEL, EPS = 0.03, 0.02  # inches: about those of the scanner with which the paper's line was taken
SEGMENTS = ("#0072B2", "#009E73")
CUT, SAMPLES = "#D55E00", "0.35"
PAPER = {"jump": (0.006, 0.005, 0.018, 0.008, 0.001, 0.005), "crease": (4.0, 1.6, 36.3, 4.0, 4.0, 2.8)}


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--noise", type=float, default=0.0, help="standard deviation, inches (default: 0)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the picture (default: out)")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)

    height = two_cylinders(args.noise)
    cuts = candidates(height)
    print("Table 2     candidate  " + "".join(f"{i:>8}" for i in range(1, 1 + max(len(cuts), 6))))
    for name in ("jump", "crease"):
        print(f"  {name:6}    here       " + "".join(f"{getattr(cut, name):8.3f}" for cut in cuts))
        print("            the paper  " + "".join(f"{value:8.3f}" for value in PAPER[name]))

    picture = Figure(figsize=(12, 11), layout="constrained")
    (first, second), (third, table), (cut, moved) = picture.subplots(3, 2)
    for axes, level in ((first, 1), (second, 2)):
        draw_segments(axes, height, split(height, level), f"Figure 3: after {level} of the divisions")
    draw_segments(third, height, rangeedge.splitScanLine(height, EPS, PIXEL), f"Figure 3: within eps = {EPS}")
    draw_strengths(table, cuts)
    draw_adaptation(cut, moved)
    picture.savefig(args.out / "scan_line.png", dpi=90)
    print(args.out / "scan_line.png")


def two_cylinders(noise):
    """Heights along the middle row."""
    camera = orthographicCamera((PIXEL, PIXEL), (110, 3))
    depth = renderScene(twoCylinders(36.3, 0.8, camera.distance), camera).depth[1, 24:88]
    depth = depth + noise * np.random.default_rng(0).standard_normal(depth.shape)
    return np.nanmax(depth) - depth


def quadratic(height, first, last):
    """Through both end points and the midpoint, as splitting has it (paper, 4.1)."""
    at = np.unique([first, (first + last) // 2, last])
    return np.polynomial.Polynomial.fit(at, height[at], len(at) - 1)


def split(height, levels):
    """Segments after some levels of the recursion; `splitScanLine` has the last one."""
    segments = [(0, len(height) - 1)]
    for _ in range(levels):
        segments = [part for first, last in segments for part in divided(height, first, last)]
    return segments


def divided(height, first, last):
    k = np.arange(first, last + 1)
    off = np.abs(height[k] - quadratic(height, first, last)(k))
    worst = first + int(off.argmax())
    if off.max() <= EPS:
        return [(first, last)]
    nearer = abs(height[worst] - height[worst - 1]) <= abs(height[min(worst + 1, last)] - height[worst])
    end = worst if nearer else worst - 1
    return [(first, end), (end + 1, last)]


def candidates(height):
    """The cuts of the line with their strengths by the second measure of the paper (4.2)."""
    basic = rangeedge.ScanLineParams.paper(measure=rangeedge.MEASURE_ENDPOINT, directions=rangeedge.DIR_ROWS)
    options = {"fit": basic.fit, "crease": basic.crease, "mergeSignificance": 0, "minSignificance": 0, "maxShift": 0}
    image, middle = height[np.newaxis], len(height) // 2
    grid = {"pixelSize": PIXEL, "heightMap": True, "noise": 1e-5, "eps": EPS, "directions": basic.directions}
    why = rangeedge.explainPixel(image, middle, 0, reach=middle, measure=basic.measure, **grid, **options)
    return why.lines[0].cuts


def draw_segments(axes, height, segments, title):
    axes.plot(height, ".", color=SAMPLES, markersize=4, label="samples")
    for i, (first, last) in enumerate(segments):
        k = np.arange(first, last + 1)
        axes.plot(k, quadratic(height, first, last)(k), color=SEGMENTS[i % 2], linewidth=2)
    for _, last in list(segments)[:-1]:
        axes.axvline(last + 0.5, color=CUT, linewidth=1, linestyle="--")
    axes.set(title=f"{title}: {len(segments)} segments", xlabel="pixel", ylabel="height [inch]")


def draw_strengths(axes, cuts):
    """Table 2 as bars."""
    axes.bar([cut.x for cut in cuts], [cut.crease for cut in cuts], width=1.5, color=CUT)
    for cut in cuts:
        axes.annotate(f"{cut.crease:.1f}°", (cut.x, cut.crease), ha="center", va="bottom")
    axes.axhline(20, color="0.5", linestyle=":")
    axes.text(1, 20.5, "the paper's threshold, 20 degrees", fontsize="small")
    axes.set(
        title="Table 2: crease strength of every cut", xlabel="pixel", ylabel="degrees", xlim=(0, 64), ylim=(0, 42)
    )


def draw_adaptation(cut_axes, moved_axes):
    """Figure 5: in noise the cut of splitting is not where the surfaces meet; their intersection is."""
    k = np.arange(60)
    roof = 0.02 * np.abs(k - 30.3) + 0.02 * np.random.default_rng(4).standard_normal(60)
    for axes, shift in ((cut_axes, 0.0), (moved_axes, 4.0)):
        options = {"noise": 0.02, "directions": rangeedge.DIR_ROWS, "minSignificance": 0, "maxShift": shift}
        points = rangeedge.edgePoints(roof[np.newaxis], 0.045, pixelSize=0.05, **options)
        place = points["x"][points["crease"].argmax()]
        axes.plot(k, roof, ".", color=SAMPLES, markersize=5)
        axes.plot(k, 0.02 * np.abs(k - 30.3), color="0.6", linewidth=1, label="truth")
        axes.axvline(place, color=CUT, label=f"found at {place:.2f}, true 30.30")
        axes.set(title=f"Figure 5: {'moved to the intersection' if shift else 'as splitting has it'}", xlabel="pixel")
        axes.legend(loc="upper center")


if __name__ == "__main__":
    main()
