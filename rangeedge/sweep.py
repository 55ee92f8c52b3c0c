"""Range images of scanners that turn, as points."""

from __future__ import annotations

import numpy as np

from ._check import array, described, fail, number, public, reals
from .forms import range_array


@public
def sweepToPoints(
    src: np.ndarray, elevation: np.ndarray, azimuth: np.ndarray | None = None, depthFactor: float = 1000.0
) -> np.ndarray:
    """Turn the range image of a scanner that turns into points, which the detector takes.

    sweepToPoints(src, elevation[, azimuth[, depthFactor]]) -> points

    The point of range r at the elevation phi of its row and the azimuth t of its column is

        r (cos(phi) cos(t), cos(phi) sin(t), sin(phi)),

    x forward, y to the left and z up.

    Parameters
    ----------
    src : ndarray of shape (H, W)
        Distances from the sensor; integers are divided by `depthFactor`. 0, negative and non-finite ones are invalid.
    elevation : ndarray of shape (H,) or (H, W), degrees
        Of every row, or of every pixel.
    azimuth : ndarray of shape (W,) or (H, W), degrees, optional
        Of every column, or of every pixel, counter-clockwise seen from above. None: once around from 180 down to -180.
    depthFactor : float
        Divides integers: 1000 makes metres of millimetres.

    Returns
    -------
    points : ndarray of shape (H, W, 3), CV_64F
        NaN where invalid.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import sweepToPoints
    >>> points = sweepToPoints(np.full((2, 4), 2.0), elevation=[0, 90], azimuth=[0, 90, 180, 270])
    >>> (points[0, 1].round(6) + 0.0).tolist(), (points[1, 0].round(6) + 0.0).tolist()
    ([0.0, 2.0, 0.0], [0.0, 0.0, 2.0])
    """
    values, seen = range_array(src)
    values = array("src", values, "distances of shape (H, W)")
    factor = number("depthFactor", depthFactor, 0, above=True)
    height, width = values.shape
    if azimuth is None:
        azimuth = np.linspace(180, -180, width, endpoint=False)
    up = _angles("elevation", elevation, (height, 1), values.shape)
    around = _angles("azimuth", azimuth, (1, width), values.shape)
    ranges = values / factor if values.dtype.kind in "iu" else values.astype(np.float64)
    with np.errstate(invalid="ignore"):
        valid = np.isfinite(ranges) & (ranges > 0)
    ranges = np.where(valid if seen is None else valid & seen, ranges, np.nan)
    rays = np.broadcast_arrays(np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up))
    return np.stack(rays, axis=-1) * ranges[..., None]


def _angles(name: str, value: object, line: tuple[int, int], shape: tuple[int, int]) -> np.ndarray:
    """Radians, one a row or column or one a pixel."""
    expected = f"{max(line)} finite angles in degrees, or an array of shape {shape}"
    try:
        angles = reals(value)
    except (TypeError, ValueError, OverflowError):
        raise fail(name, expected, described(value)) from None
    if angles.shape == (max(line),):
        angles = angles.reshape(line)
    if angles.shape not in (line, shape) or not np.isfinite(angles).all():
        raise fail(name, expected, described(angles))
    return np.deg2rad(angles)
