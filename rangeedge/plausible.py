"""Whether a range image can be what the options say: units, geometry and thresholds that plainly do not fit it."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ._check import error
from .options import ScanLineParams, Selection

if TYPE_CHECKING:
    from .frame import Frame

_PACKAGE = str(Path(__file__).parent)
_FORMATS = {  # of depth cameras
    *((160, 120), (176, 144), (224, 172), (240, 180), (256, 192), (320, 240), (320, 288), (424, 240), (480, 270)),
    *((480, 360), (512, 424), (512, 512), (640, 360), (640, 400), (640, 480), (640, 576), (848, 480), (960, 540)),
    *((1024, 768), (1024, 1024), (1280, 720), (1280, 800), (1280, 960), (1280, 1024), (1920, 1080), (1944, 1200)),
}
_TURNS = {(width, height) for width in (512, 1024, 2048) for height in (16, 32, 64, 128)}  # of scanners that turn
_SEVERAL = 16  # pixels of one value, that may stand for no data
_HOLES = 0.01  # share of the pixels, that a camera does not see
_FARTHER = 5.0  # times all others, that a value stands for no data
_WIDEST = 0.02  # focal length in sides of the image
_FARTHEST_CENTRE = 3.0  # of the optical axis from the middle, in sides of the image
_FLAT = 0.1  # of the sides of an image, in units of its values: depths of a camera whose pixels count as 1 apart
_LEAST_IMAGE = 64 * 64  # pixels of what a camera may have taken
_FAR_FROM_ZERO = 0.1  # of the median, above which all other depths lie then
_MOST_DROPPED = 0.1  # share of the points
_FEW_POINTS = 64  # that may be dropped without a word
_HALF_TURN = 180.0  # degrees
_FARTHEST = 1000.0  # metres, that integers are depths in millimetres or the like


class RangeEdgeWarning(UserWarning):
    """What plainly does not fit the range image: a unit, a threshold, a geometry that is missing."""


_collected: ContextVar[list[str] | None] = ContextVar("collected", default=None)


@contextmanager
def collected() -> Iterator[list[str]]:
    """What this thread is warned of, in the place of warnings."""
    texts: list[str] = []
    token = _collected.set(texts)
    try:
        yield texts
    finally:
        _collected.reset(token)


def warn(text: str) -> None:
    """Warn whoever called the package."""
    texts = _collected.get()
    if texts is not None:
        texts.append(text)
        return
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, RangeEdgeWarning, stacklevel=level)


def question_geometry(src: np.ndarray, frame: Frame, params: ScanLineParams) -> None:
    """Ask what the zeros of a plain image of floats are, and warn of a geometry that is missing or out of place."""
    plain = src.ndim == 2 and params.K is None and params.pixelSize is None and not params.heightMap
    if plain and params.invalid is None:
        _refuse_zeros(src)
    if params.invalid is None and src.ndim == 2:
        _warn_of_outlier(src, frame)
    _warn_of_form(src, frame, plain)
    if params.K is not None and src.size >= _LEAST_IMAGE:
        _warn_of_camera(params.K, src.shape)
    if src.dtype.kind in "iu" and params.K is not None:
        _warn_of_factor(frame.ordinate[::8, ::8], params.depthFactor)


def _refuse_zeros(src: np.ndarray) -> None:
    """Ask what the zeros of a plain image of float depths are."""
    if src.dtype.kind != "f" or src.size < _LEAST_IMAGE:
        return
    zeros = np.count_nonzero(src == 0)
    if zeros < _SEVERAL or np.nanmin(src) < 0:
        return
    depths = src[src > 0]
    if len(depths) and depths.min() > _FAR_FROM_ZERO * np.median(depths[np.isfinite(depths)]):
        raise error(
            f"`src` is 0 at {zeros} of {src.size} pixels: say invalid=0 if these have no data, invalid=() if 0 is a"
            " value, or give the camera by K, which needs no depths of 0"
        )


def _warn_of_outlier(src: np.ndarray, frame: Frame) -> None:
    """Warn of a value that several pixels have, and that is far from all others: it hardly is a depth."""
    coarse = src[::4, ::4][frame.valid[::4, ::4] > 0]
    if src.size < _LEAST_IMAGE or not len(coarse):
        return
    for bound in (np.fmin, np.fmax):  # of ordinates, which are NaN where invalid, and grow or fall with the values
        value = src.flat[np.argmax(frame.ordinate == bound.reduce(frame.ordinate, axis=None))]
        others = coarse[coarse != value].astype(np.float64)
        if not len(others):
            continue
        largest = np.abs(others).max()
        below = value < 0 <= others.min() and -float(value) > largest
        if not (largest > 0 and (below or abs(float(value)) / _FARTHER > largest)):
            continue
        count = np.count_nonzero(src == value)
        if count >= _SEVERAL:
            warn(
                f"{count} of {src.size} pixels of `src` are exactly {value:g}, far from the others (about"
                f" {others.min():g} to {others.max():g}), as if that stood for no data: say invalid={value:g} if it"
                " does, invalid=() if it was measured"
            )


def _warn_of_camera(K: np.ndarray, shape: tuple[int, ...]) -> None:
    """Warn of a camera that is hardly given in pixels of the image."""
    size = np.array([shape[1], shape[0]])
    if (np.diag(K)[:2] < _WIDEST * size).any() or (np.abs(K[:2, 2] - size / 2) > _FARTHEST_CENTRE * size).any():
        warn(
            f"K has the focal lengths {K[0, 0]:g}, {K[1, 1]:g} and the centre {K[0, 2]:g}, {K[1, 2]:g}: hardly in"
            f" pixels of an image of {shape[1]} x {shape[0]}"
        )
    elif (np.diag(K)[:2] < size).all() and (K[:2, 2] > size).any():
        warn(
            f"K has its centre {K[0, 2]:g}, {K[1, 2]:g} outside the image of {shape[1]} x {shape[0]}, where its focal"
            f" lengths {K[0, 0]:g}, {K[1, 1]:g} lie: its order is fx, fy, cx, cy"
        )


def _warn_of_form(src: np.ndarray, frame: Frame, plain: bool) -> None:
    if src.dtype.kind in "iu" and src.dtype.itemsize == 1:
        warn("`src` has 8 bits, too coarse for edges: pass the depths as the sensor gave them, in 16 bits or floats")
    size = (src.shape[1], src.shape[0])
    turns = size in _TURNS
    if not plain or not (turns or size in _FORMATS or size[::-1] in _FORMATS):
        return
    holes = np.count_nonzero(frame.valid) < (1 - _HOLES) * src.size
    if src.dtype == np.uint16 or (src.dtype.kind == "f" and holes and 0 < _positive_extent(frame) < _FLAT * min(size)):
        what = "range image of a scanner that turns" if turns else "image of a depth camera"
        way_out = "make points of it by sweepToPoints" if turns else "give K"
        warn(
            f"`src` looks like the {what} ({size[0]} x {size[1]}, {src.dtype}), but its geometry is not given: angles"
            f" and noise are those of a grid with a spacing of 1; {way_out}, or give pixelSize where it is a grid"
        )


def _positive_extent(frame: Frame) -> float:
    """The range of depths, 0 where some are not positive."""
    ordinates = frame.ordinate[::8, ::8]
    return _extent(ordinates, False) if np.nanmax(np.append(ordinates, -np.inf)) < 0 else 0.0


def _warn_of_factor(ordinates: np.ndarray, factor: float) -> None:
    if np.nanmedian(np.append(ordinates, 1.0)) < 1 / _FARTHEST:
        warn(
            f"with depthFactor={factor:g} half of the scene lies beyond {_FARTHEST:g}: 1000 makes metres of millimetres"
        )


def warn_of_dropped(given: int, kept: int) -> None:
    """Warn where points of an image lie behind its viewpoint."""
    if given - kept > max(_MOST_DROPPED * given, _FEW_POINTS):
        warn("more than a tenth of the points lie behind the viewpoint and are left out; say where it is by origin")


def warn_of_selection(frame: Frame, selection: Selection) -> None:
    """Warn of thresholds that nothing can reach."""
    warn_of_thresholds(frame, jumpThreshold=selection.jumpThreshold)
    creaseThreshold = selection.creaseThreshold
    if _HALF_TURN < creaseThreshold <= 2 * _HALF_TURN:
        warn(f"creaseThreshold={creaseThreshold:g} switches creases off: no angle exceeds 180 degrees")


def warn_of_thresholds(frame: Frame, **lengths: object) -> None:
    """Warn of lengths beyond the whole range of depths, which nothing can exceed."""
    given = {name: value for name, value in lengths.items() if isinstance(value, float) and value < np.inf}
    for name, value in given.items():
        # A part of the pixels is enough where it shows more.
        if all(value > _extent(frame.ordinate[::step, ::step], frame.projective) > 0 for step in (8, 1)):
            warn(
                f"{name}={value:g} exceeds the range of depths in the whole image; its unit is that of the values,"
                " metres for integers with depthFactor=1000"
            )


def _extent(ordinates: np.ndarray, projective: bool) -> float:
    low, high = (
        bound(ordinates, where=np.isfinite(ordinates), initial=start)
        for bound, start in ((np.min, np.inf), (np.max, -np.inf))
    )
    if not low < high:
        return 0.0
    return float(1 / low - 1 / high if projective else high - low)
