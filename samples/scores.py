"""
Scores against the truth
========================

    python samples/scores.py [--seed 1] [--out DIR]

How good edges and regions of a rendered scene are, beside the edges of cv2.Canny.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.evaluation import baddeleyDelta, evaluateEdges, hooverScores, prattFOM
from rangeedge.synthetic import curvedScene, kinectCamera, kinectNoise, renderScene


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the scene and the noise (default: 1)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    camera = kinectCamera()
    rendering = renderScene(curvedScene(args.seed, camera), camera)
    scan = kinectNoise(rendering, seed=args.seed)
    truth = rendering.edges(jumpThreshold=0.008, creaseThreshold=30)  # metres, degrees
    nothing = scan.src == 0

    grey = cv2.normalize(scan.src, None, 0, 255, cv2.NORM_MINMAX, cv2.CV_8U)
    grey = cv2.GaussianBlur(cv2.inpaint(grey, nothing.astype(np.uint8), 3, cv2.INPAINT_TELEA), (5, 5), 0)
    edges = {
        "rangeedge": rangeedge.detectEdges(scan.src, 0.008, **scan.geometry),
        "cv2.Canny": cv2.Canny(grey, 40, 80),
    }
    drawn = rangeedge.drawEdges(scan.src, np.isin(truth, (1, 2, 3)).astype(np.uint8), rendering.kind, **scan.geometry)
    panels = [("truth", drawn)]
    for name, found in edges.items():
        scores = evaluateEdges(found, truth, tolerance=3, ignore=nothing)
        true = rangeedge.thinEdges(np.isin(truth, (1, 2, 3)))
        merit, error = prattFOM(found, true), baddeleyDelta(found, true)
        print(f"{name}: F {scores.f:.3f}, Pratt's figure of merit {merit:.3f}, Baddeley's error {error:.2f}")
        panels.append((f"{name}, F {scores.f:.3f}", rangeedge.drawEdges(scan.src, found, **scan.geometry)))
    labels = rangeedge.segmentRegions(scan.src, **scan.geometry)
    print(f"regions after Hoover: {hooverScores(labels, rendering.labels, ignore=nothing)}")
    cv2.imwrite(str(args.out / "scores.png"), rangeedge.drawPanels(panels, 3, key=True))
    print(args.out / "scores.png")


if __name__ == "__main__":
    main()
