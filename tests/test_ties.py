"""Small images full of exact ties: kernels and the oracle agree on them as soon as the ties are broken.

Which of two choices is taken that are equally good is a rule (of cuts the leftmost, of joints that of fewer samples,
of extreme samples the first: `core/scanline/split.hpp`, `merge.cpp`, `segment_list.hpp`, `oracle/approximation.py`).
But what is compared are sums that are rounded, in another order by the kernels than by the oracle: where exact
arithmetic gives a tie that the rule does not foresee, they may choose differently. A fiftieth of the noise decides it.
"""

import numpy as np
import oracle
import pytest
from scenes import K
from test_oracle import NOISE, SETTINGS, same_as_oracle

from rangeedge import ScanLineParams

V, U = np.mgrid[:10, :16].astype(float)
HOLES = np.where((U == 5) | (U == 6) | ((U + 3 * V) % 11 == 0), np.nan, 0)
TIES = {
    "checkerboard": 2 + (U + V) % 2 * 0.5,
    "coarse checkerboard": 1 + (U // 2 + V // 2) % 2 * 0.25,
    "diagonal roof": 1 + np.abs(U - V) * 0.125,
    "diagonal roof, not in binary": 1 + np.abs(U - V) * 0.1,
    "plane": 2 + 0.125 * U - 0.1 * V,
    "step of a plane": 2 + 0.1 * U + 0.5 * (U > 8),
    "roof": 3 - np.abs(U - 8) * 0.25,
    "quantised waves": np.round(2 + 0.3 * np.sin(U / 3) + 0.2 * np.cos(V / 2), 1),
    "stairs": np.floor(U / 3) * 0.25 + 1,
    "three levels": 1 + (U * V + U) % 3 * 0.25,
    "comb": 1 + U % 3 * 0.125,
    "residues": 1 + (U * U + V * V) % 5 * 0.2,
    "corner": 2 + np.maximum(0, U - 8) * 0.25 + np.maximum(0, V - 5) * 0.125,
    "holes": 2 + 0.5 * (U > 8) + HOLES,
}
DECIDED = [setting for setting in SETTINGS if setting.get("minSignificance", 7.0) > 0]  # no angles of millidegrees


@pytest.mark.parametrize("camera", [False, True])
@pytest.mark.parametrize("name", TIES)
def test_where_ties_are_broken_the_oracle_has_the_same(name, camera):
    which = list(TIES).index(name)
    rng = np.random.default_rng(which)
    z = TIES[name] * (1 + 3e-5 * rng.standard_normal(TIES[name].shape))
    common = {
        "params": ScanLineParams(**DECIDED[(which + 7 * camera) % len(DECIDED)]),
        "noise": NOISE[which % len(NOISE)],
    }
    if camera:
        same_as_oracle(z, oracle.Image(z, K=K, projective=True, **common), K=K)
    else:
        same_as_oracle(z, oracle.Image(z, spacing=(0.02, 0.03), **common), pixelSize=(0.02, 0.03))
