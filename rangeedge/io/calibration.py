"""From the raw codes of the classic range scanners to points.

Both functions return points in the camera frame as `cv2.depthTo3d` has it: x to the right, y down, z away from the
scanner. The formulas are those of ``range-to-coords.c``, which came with the images of Hoover et al., *An Experimental
Comparison of Range Image Segmentation Algorithms*, PAMI 18(7), 1996; its axes are turned to ours.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from .. import _check

SCANNER_SIZE = (512, 512)  # rows and columns of an ABW and of a Perceptron image


class AbwCalibration(NamedTuple):
    """Depth is ``r / scale + offset``; a column is seen ``depth / focal`` beside its neighbour."""

    offset: float
    scale: float
    focal: float


ABW_CALIBRATIONS = {
    1: AbwCalibration(785.410786, 0.773545, 1610.981722),
    2: AbwCalibration(771.016866, 0.791686, 1586.072821),
}
ABW_ASPECT = 1.4508  # width of a pixel over its height
ABW_CENTRE = 255  # row and column of the optical axis

# The laser of the Perceptron runs over a rotating mirror (columns) and a nodding one (rows).
PERCEPTRON_FIELD = (np.deg2rad(51.65), np.deg2rad(36.73))  # horizontal, vertical
PERCEPTRON_STEP = 0.20236  # length of one range code
PERCEPTRON_STANDOFF = 830.3  # in steps
PERCEPTRON_LASER_TO_MIRROR = 3.0  # axis of the rotating mirror to the parallel laser beam
PERCEPTRON_MIRROR_TO_MIRROR = 5.5  # axis of the nodding mirror to the beam on the rotating one
PERCEPTRON_MIRROR_SLOPE = np.deg2rad(45.0)  # of both mirrors at rest


@_check.public
def abwPoints(code: np.ndarray, calibration: int = 2) -> np.ndarray:
    """Points of an image of the ABW structured light scanner.

    abwPoints(code[, calibration]) -> points

    With the depth ``D = code / scale + offset`` of a pixel::

        x = (col - 255) D / focal      y = (row - 255) D / (1.4508 focal)      z = D

    that is, a pinhole camera. The published converter has y upward and ``(255 - code) / scale`` for z.

    Parameters
    ----------
    code : (H, W) uint8
        Raw image, larger is farther; 0 is shadow. Pixel (0, 0) is the scanner's first one.
    calibration : {1, 2}
        1 for the test images 0, 19, 21, 25, 27, 28 and 29 of the comparison, 2 for all others.

    Returns
    -------
    points : (H, W, 3) float32
        NaN where `code` is 0. Lengths in the scanner's unit, which the sources do not name (about 1 mm).

    Raises
    ------
    rangeedge.error
        `code` is no 8-bit image, or `calibration` is neither 1 nor 2.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.io.calibration import abwPoints
    >>> abwPoints(np.full((512, 512), 255, np.uint8))[255, 255]
    array([   0.    ,    0.    , 1093.1143], dtype=float32)
    """
    code = _check.image8("code", code)
    calibration = _check.integer("calibration", calibration, 1, 2)
    offset, scale, focal = ABW_CALIBRATIONS[calibration]

    row, col = np.indices(code.shape, sparse=True)
    depth = np.where(code > 0, code / scale + offset, np.nan)
    x = (col - ABW_CENTRE) * depth / focal
    y = (row - ABW_CENTRE) * depth / (ABW_ASPECT * focal)
    return np.stack([x, y, depth], axis=-1).astype(np.float32)


@_check.public
def perceptronPoints(code: np.ndarray) -> np.ndarray:
    """Points of an image of the Perceptron laser range finder.

    perceptronPoints(code) -> points

    The beam leaves the nodding mirror at ``(dx, dy, dz)`` under the angles alpha (from the column) and beta (from the
    row), and what the travel to there leaves of ``code + standoff`` is the length along the ray. Both angles run
    linearly over the 512 columns and rows. The published converter has x to the left and y upward.

    Parameters
    ----------
    code : (H, W) integers from 0 to 4095
        Range, without the reflectance that files hold in the bits above. Pixel (0, 0) is the scanner's first one.

    Returns
    -------
    points : (H, W, 3) float32
        Every code is a measurement: the converter knows no invalid one. Lengths in the scanner's unit, which the
        sources do not name.

    Raises
    ------
    rangeedge.error
        `code` is no integer image, or has values outside 0..4095.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.io.calibration import perceptronPoints
    >>> points = perceptronPoints(np.full((512, 512), 1000, np.uint16))
    >>> bool(points[0, 0, 0] < 0 < points[0, 511, 0] and points[0, 0, 1] < 0 < points[511, 0, 1])
    True
    """
    expected = "an integer array of shape (H, W) with values from 0 to 4095"
    code = _check.array("code", code, expected)
    if code.dtype.kind not in "ui":
        raise _check.fail("code", expected, _check.described(code), cv2.Error.StsUnsupportedFormat)
    low, high = code.min(), code.max()
    if low < 0 or high > 4095:
        raise _check.fail("code", expected, f"{low} to {high}", cv2.Error.StsOutOfRange)

    rows, cols = SCANNER_SIZE
    row, col = np.indices(code.shape, sparse=True)
    alpha = PERCEPTRON_FIELD[0] * ((cols - 1) / 2 - col) / cols
    beta = PERCEPTRON_FIELD[1] * ((rows - 1) / 2 - row) / rows

    dz = -PERCEPTRON_LASER_TO_MIRROR * (1 - np.cos(alpha)) / np.tan(PERCEPTRON_MIRROR_SLOPE)
    dy = dz * np.tan(PERCEPTRON_MIRROR_SLOPE + beta / 2)
    dx = (PERCEPTRON_MIRROR_TO_MIRROR + dy) * np.tan(alpha)

    to_first_mirror = dz - PERCEPTRON_MIRROR_TO_MIRROR
    to_second_mirror = np.hypot(dx, PERCEPTRON_MIRROR_TO_MIRROR + dy)
    ray = (code + PERCEPTRON_STANDOFF) * PERCEPTRON_STEP - (to_first_mirror + to_second_mirror)

    left = dx + ray * np.sin(alpha)
    up = dy + ray * np.cos(alpha) * np.sin(beta)
    away = dz + ray * np.cos(alpha) * np.cos(beta)
    return np.stack(np.broadcast_arrays(-left, -up, away), axis=-1).astype(np.float32)
