"""How good edges and regions are: scores against the truth of a rendered scene, beside those of cv2.Canny.

python samples/scores.py
"""

import argparse

import cv2
import numpy as np
from edges import grey_levels

import rangeedge
from rangeedge.evaluation import baddeleyDelta, evaluateEdges, hooverScores, prattFOM
from rangeedge.synthetic import curvedScene, kinectCamera, kinectNoise, renderScene


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the scene and the noise (default: 1)")
    args = parser.parse_args(argv)
    camera = kinectCamera()
    rendering = renderScene(curvedScene(args.seed, camera), camera)
    scan = kinectNoise(rendering, seed=args.seed)
    truth = rendering.edges(jumpThreshold=0.008, creaseThreshold=30)  # metres, degrees
    nothing = scan.src == 0

    edges = {
        "rangeedge": rangeedge.detectEdges(scan.src, 0.008, **scan.geometry),
        "cv2.Canny": cv2.Canny(grey_levels(scan.src), 40, 80),
    }
    for name, found in edges.items():
        scores = evaluateEdges(found, truth, tolerance=3, ignore=nothing)
        true = rangeedge.thinEdges(np.isin(truth, (1, 2, 3)))
        merit, error = prattFOM(found, true), baddeleyDelta(found, true)
        print(f"{name}: F {scores.f:.3f}, Pratt's figure of merit {merit:.3f}, Baddeley's error {error:.2f}")
    labels = rangeedge.segmentRegions(scan.src, **scan.geometry)
    print(f"regions after Hoover: {hooverScores(labels, rendering.labels, ignore=nothing)}")


if __name__ == "__main__":
    main()
