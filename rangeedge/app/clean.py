"""What `rangeedge clean` writes: a range image without flying pixels and holes, and with less noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..cleaning import cleanDepth
from ..constants import CLEAN_FILLED, CLEAN_REMOVED, CLEAN_SMOOTHED
from ..io import RangeImage, imwriteRange

_BITS = {"smoothed": CLEAN_SMOOTHED, "flying and removed": CLEAN_REMOVED, "filled": CLEAN_FILLED}


def clean_file(image: RangeImage, out: Path) -> str:
    """Clean an image, write it, with its geometry where the format has room for it, and say what was changed."""
    cleaned, changed = cleanDepth(image.src, **image.geometry)
    known = ("K", "distCoeffs", "pixelSize", "heightMap", "depthFactor") if out.suffix.lower() == ".npz" else ()
    imwriteRange(out, cleaned, **{name: image.geometry[name] for name in known if name in image.geometry})
    return ", ".join(f"{np.count_nonzero(changed & bit)} pixels {word}" for word, bit in _BITS.items())
