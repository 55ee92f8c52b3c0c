"""
Distances without a threshold: salience
=======================================

    python samples/salience_map.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

The paper's Figure 12b: all candidates take part, noise too, each by its strength. What that is worth is counted as
seeds, which should be one or two a surface. Of all candidates the plain distance makes four times as many as that of
the selected edges; weighted by salience in the additive form hardly more than these, but in the multiplicative form
nearly as many as unweighted: faint candidates still cut it up.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", help="range image; default: a rendered one")
    parser.add_argument("-K", type=lambda text: [float(f) for f in text.split(",")], help="fx,fy,cx,cy of a camera")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for what is written (default: out)")
    args = parser.parse_args(argv)
    src, geometry = load(args.image, args.K)
    args.out.mkdir(parents=True, exist_ok=True)

    strength = rangeedge.edgeStrength(src, minSignificance=0, **geometry)  # every candidate
    jumps = strength.jump[strength.jump > 0]
    salience = rangeedge.overallStrength(strength.jump, strength.crease, np.median(jumps) if jumps.size else 1.0)
    print(f"{np.count_nonzero(salience)} candidates")

    maps = {
        "distance to selected edges": rangeedge.distanceTransform(rangeedge.detectEdges(src, **geometry)),
        "distance to all candidates": rangeedge.distanceTransform(salience),
        "salience distance, additive": rangeedge.salienceDistanceTransform(
            salience, rangeedge.SALIENCE_ADDITIVE, lambda_=20
        ),
        "salience distance, multiplicative": rangeedge.salienceDistanceTransform(salience / np.float32(255)),
    }
    panels = []
    for title, distance in maps.items():
        count, _ = rangeedge.extractSeeds(distance, minDistance=4)
        print(f"{title}: {count - 1} seeds")
        panels.append((f"{title}: {count - 1} seeds", rangeedge.colorizeDistance(distance, log=True)))
    panels.insert(2, ("salience of all candidates", salience))
    cv2.imwrite(str(args.out / "salience_map.png"), rangeedge.drawPanels(panels, 3))
    print(args.out / "salience_map.png")


def load(name, K):
    """The image of that name, or boxes, a roof and curved solids on a table, as a Kinect would see them."""
    if name is None:
        scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
        return scan.src, scan.geometry
    return rangeedge.imreadRange(name).withGeometry(**({} if K is None else {"K": K}))


if __name__ == "__main__":
    main()
