"""Salience distance transform: the strength of an edge says how far it matters, and no threshold is needed.

    python samples/salience_map.py [IMAGE [-K fx,fy,cx,cy]] [--out DIR]

All candidates take part here, faint ones and noise too. To the plain distance transform they count as much as the
border of a box; weighted by salience they hardly show.
"""

import numpy as np
from common import load, parser, sheet, write

import rangeedge


def main(argv=None):
    args = parser(__doc__).parse_args(argv)
    src, geometry = load(args)

    # With minSignificance=3 noise gets through: the worst case for a distance map.
    strength = rangeedge.edgeStrength(src, minSignificance=3, **geometry)
    jumps = strength.jump[strength.jump > 0]
    jumpCut = np.percentile(jumps, 25) if jumps.size else 1.0
    salience = rangeedge.overallStrength(strength.jump, strength.crease, jumpCut)
    print(f"{np.count_nonzero(salience)} candidates")

    plain = rangeedge.distanceTransform(salience)
    weighted = rangeedge.salienceDistanceTransform(salience)
    additive = rangeedge.salienceDistanceTransform(salience, rangeedge.SALIENCE_ADDITIVE, lambda_=20)
    write(
        args.out,
        "salience_map.png",
        sheet(
            ("salience of all candidates", salience),
            ("distance", rangeedge.colorizeDistance(plain, log=True)),
            ("salience distance, multiplicative", rangeedge.colorizeDistance(weighted, log=True)),
            ("salience distance, additive", rangeedge.colorizeDistance(additive, log=True)),
        ),
    )


if __name__ == "__main__":
    main()
