"""What the command line says of an image: unit, depths, spacing, noise, thresholds, and what hardly fits."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..frame import Frame
from ..options import DETECTION, ScanLineParams, Selection
from ..plausible import RangeEdgeWarning


def understood(frame: Frame, params: ScanLineParams, selection: Selection, src: np.ndarray) -> dict[str, Any]:
    """In numbers, lengths in the unit of the image."""
    depths = frame.depth[frame.valid.view(bool)].astype(np.float64)
    if frame.heightMap:
        depths = -depths
    middle = float(np.median(depths)) if len(depths) else None
    return {
        "geometry": _geometry(frame, params),
        "unit": _unit(frame, params),
        "depthRange": [float(depths.min()), float(depths.max())] if len(depths) else None,
        "medianDepth": middle,
        "pixelSpacing": _spacing(frame),
        "noiseAtMedian": _noise(frame, middle),
        "jumpThreshold": selection.jumpThreshold or "beyond the noise",
        "creaseThreshold": selection.creaseThreshold,
        "eps": params.eps or f"{params.epsFactor:g} times the noise",
    }


def sentence(known: dict[str, Any]) -> str:
    """The same in words."""
    if known["depthRange"] is None:
        return f"{known['geometry']}, no data"
    low, high = known["depthRange"]
    jump = known["jumpThreshold"]
    what = "heights" if known["geometry"].startswith("heights") else "depths"
    return (
        f"{known['geometry']}, unit: {known['unit']}; {what} {low:.4g} to {high:.4g},"
        f" pixels {known['pixelSpacing']:.3g} apart,"
        f" noise {known['noiseAtMedian']:.2g} at the median {known['medianDepth']:.4g}; jumps"
        f" {jump if isinstance(jump, str) else f'from {jump:g}'}, creases from {known['creaseThreshold']:g} degrees"
    )


def _unit(frame: Frame, params: ScanLineParams) -> str:
    """Of lengths, as far as it is known."""
    if frame.unit == "m":
        return "m (stored in mm)"
    return f"{params.depthFactor:g} of the stored units" if frame.step else "that of the stored values"


def _geometry(frame: Frame, params: ScanLineParams) -> str:
    if params.K is not None:
        return "pinhole camera"
    if frame.samples.ndim == 2:
        kind = "heights on a grid" if frame.heightMap else "depths on a grid"
        return kind if frame.spaced else f"{kind} of unknown spacing, taken as 1"
    if frame.ranges:
        return "points of a scanner that turns"
    if frame.projective:
        return "points seen from one place"
    return f"points seen in parallel, the {'larger' if frame.heightMap else 'smaller'} z the nearer"


def _spacing(frame: Frame) -> float:
    """Median distance between neighbours in space, across the view where depths differ."""
    if frame.samples.ndim == 2 and not frame.projective:
        return frame.to_plane[0]
    points = frame.points
    steps = np.linalg.norm(np.diff(points[::8], axis=1), axis=2)
    steps = steps[np.isfinite(steps)]
    return float(np.median(steps)) if len(steps) else 0.0


def _noise(frame: Frame, depth: float | None) -> float | None:
    if isinstance(frame.noise, np.ndarray):
        return float(np.median(frame.noise[frame.valid.view(bool)])) if frame.valid.any() else None
    return None if depth is None else float(frame.noise(abs(depth)))


def in_flags(text: str, flag: Callable[[str], str]) -> str:
    """The text with minLength, `noise`, eps=0.1 in the words of the command line; noise alone is a word of English."""
    unmistakable = "|".join(name for name in DETECTION if not name.islower())
    every = "|".join(DETECTION)
    names = rf"\b({unmistakable})\b|\b({every})(?==)|(?<=`)({every})(?=`)"
    text = re.sub(names, lambda name: flag(name[0]), text)
    return re.sub(r"(--[a-z-]+)=(True|False)", lambda word: word[1] if word[2] == "True" else f"no {word[1]}", text)


def warning_in_flags(text: str, flag: Callable[[str], str]) -> str:
    """The text of a warning in the words of the command line."""
    return in_flags(text.replace("invalid=()", "invalid=none"), flag)


@contextmanager
def told_warnings(flag: Callable[[str], str]) -> Iterator[None]:
    """Warnings of the package as lines of the command line, in whose words `flag` names the options."""
    with warnings.catch_warnings():
        other = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *where: Any) -> None:
            if not issubclass(category, RangeEdgeWarning):
                return other(message, category, *where)
            print(f"rangeedge: warning: {warning_in_flags(str(message), flag)}", file=sys.stderr)

        warnings.showwarning = tell  # type: ignore[assignment]
        yield
