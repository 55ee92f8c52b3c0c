"""Two planes that meet in a crease: its true angle, and what sections through it see (paper, 2 and 4.2)."""

from __future__ import annotations

import itertools
from typing import Any

import cv2
import numpy as np

from .. import _check

# Unit directions (x, y) in the image of rows, columns and the two diagonals.
SECTIONS = np.array([(1, 0), (0, 1), (0.5**0.5, -(0.5**0.5)), (0.5**0.5, 0.5**0.5)])


@_check.public
def geodesicDome(frequency: int, maxSlant: float = 180.0) -> np.ndarray:
    """Near-uniform directions: the cells of a geodesic dome over the icosahedron.

    geodesicDome(frequency[, maxSlant]) -> directions

    Every edge of the icosahedron is divided into f equal parts, which makes f^2 triangles of each of its 20 faces;
    their centres are projected onto the unit sphere (paper, 5).

    Parameters
    ----------
    frequency : int
        The number f of parts, 1 to 256.
    maxSlant : float
        Only directions at less than this angle to the z axis, in degrees.

    Returns
    -------
    (n, 3) float64 array
        Unit vectors, 20 f^2 of them without `maxSlant`.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type or range.

    Examples
    --------
    >>> from rangeedge.optimality import geodesicDome
    >>> geodesicDome(4).shape, geodesicDome(4, maxSlant=70).shape
    ((320, 3), (102, 3))
    """
    frequency = _check.integer("frequency", frequency, 1, 256)
    maxSlant = _check.number("maxSlant", maxSlant, 0.0, 180.0, above=True)
    i, j = np.indices((frequency, frequency)).reshape(2, -1)
    upward = np.stack([i, j], 1)[i + j < frequency] + 1 / 3
    downward = np.stack([i, j], 1)[i + j < frequency - 1] + 2 / 3
    weights = np.concatenate([upward, downward]) / frequency
    weights = np.column_stack([1 - weights.sum(1), weights])
    centres = (weights @ _icosahedron_faces()).reshape(-1, 3)
    directions = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    if maxSlant == 180:
        return directions
    return directions[directions[:, 2] > np.cos(np.radians(maxSlant))]


@_check.public
def creaseAngle(normals1: np.ndarray, normals2: np.ndarray) -> np.ndarray:
    """The true strength of a crease edge: the angle between the normals of its two planes.

    creaseAngle(normals1, normals2) -> angles

    Paper, 2, formula 1, in degrees; accurate for the smallest and the largest angles too.

    Parameters
    ----------
    normals1, normals2 : (..., 3) real arrays
        Normals (a, b, c) of the planes a x + b y + c z = 0, of any length, towards the viewer (c > 0).
        Their shapes broadcast.

    Returns
    -------
    (...) float64 array
        From 0 to 180.

    Raises
    ------
    rangeedge.error
        On normals of the wrong type or shape, or that do not face the viewer.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.optimality import creaseAngle
    >>> float(creaseAngle(np.array([1.0, 0, 1]), np.array([-1.0, 0, 1])).round(9))
    90.0
    """
    return angle_between(*normal_pair(normals1, normals2))


@_check.public
def directionalAngles(normals1: np.ndarray, normals2: np.ndarray) -> np.ndarray:
    """Strengths of a crease edge as the four directional sections see it.

    directionalAngles(normals1, normals2) -> angles

    The section along the unit image direction d shows the plane (a, b, c) as a line of slope -(a dx + b dy) / c;
    its strength is the angle between the two lines (paper, 4.2), in degrees.

    Parameters
    ----------
    normals1, normals2 : (..., 3) real arrays
        As for `creaseAngle`.

    Returns
    -------
    (..., 4) float64 array
        Angles of rows, columns, the 45 and the 135 degree diagonal, from 0 to 180.

    Raises
    ------
    rangeedge.error
        On normals of the wrong type or shape, or that do not face the viewer.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.optimality import directionalAngles
    >>> directionalAngles(np.array([1.0, 0, 1]), np.array([-1.0, 0, 1])).round(2)
    array([90.  ,  0.  , 70.53, 70.53])
    """
    normals1, normals2 = normal_pair(normals1, normals2)
    return section_angles(slopes_along(normals1), slopes_along(normals2))


def _icosahedron_faces() -> np.ndarray:
    """The 20 faces of the icosahedron, as (20, 3, 3) corners."""
    golden = (1 + 5**0.5) / 2
    rectangle = [(0.0, s, t * golden) for s in (1, -1) for t in (1, -1)]
    corners = np.array([np.roll(corner, turn) for turn in range(3) for corner in rectangle])
    adjacent = np.isclose(np.linalg.norm(corners[:, None] - corners, axis=2), 2)
    triples = itertools.combinations(range(len(corners)), 3)
    return corners[[t for t in triples if all(adjacent[a, b] for a, b in itertools.combinations(t, 2))]]


def normal_pair(normals1: Any, normals2: Any) -> tuple[np.ndarray, np.ndarray]:
    """Both arrays of normals, checked, as unit vectors."""
    pair = []
    for name, value in (("normals1", normals1), ("normals2", normals2)):
        expected = "a real array of shape (..., 3)"
        value = _check.array(name, value, expected, range(1, 33)).astype(np.float64)
        if value.shape[-1] != 3:
            raise _check.fail(name, expected, _check.described(value), cv2.Error.StsBadSize)
        if not (np.isfinite(value).all() and (value[..., 2] > 0).all()):
            expected = "finite normals towards the viewer (c > 0)"
            raise _check.fail(name, expected, "others", cv2.Error.StsOutOfRange)
        pair.append(value / np.linalg.norm(value, axis=-1, keepdims=True))
    try:
        np.broadcast_shapes(pair[0].shape, pair[1].shape)
    except ValueError:
        expected = f"an array that broadcasts with {pair[0].shape}"
        raise _check.fail("normals2", expected, pair[1].shape, cv2.Error.StsUnmatchedSizes) from None
    return pair[0], pair[1]


def angle_between(unit1: np.ndarray, unit2: np.ndarray) -> np.ndarray:
    """Angle of unit vectors in degrees; the arc cosine would lose half the digits of small angles."""
    apart = sum((unit1[..., k] - unit2[..., k]) ** 2 for k in range(3))
    along = sum((unit1[..., k] + unit2[..., k]) ** 2 for k in range(3))
    return np.degrees(2 * np.arctan2(np.sqrt(apart), np.sqrt(along)))


def slopes_along(normals: np.ndarray) -> np.ndarray:
    """Slope dz/ds of a plane along each of the four sections, as (..., 4)."""
    return -(normals[..., :2] @ SECTIONS.T) / normals[..., 2:]


def section_angles(slopes1: np.ndarray, slopes2: np.ndarray) -> np.ndarray:
    inclination1, inclination2 = (np.moveaxis(np.arctan(slopes), -1, 0) for slopes in (slopes1, slopes2))
    # Sections lie outermost in memory: the maximum over them is then as fast as over whole images.
    missing = max(inclination1.ndim, inclination2.ndim)
    inclination1, inclination2 = (
        a.reshape(a.shape[:1] + (1,) * (missing - a.ndim) + a.shape[1:]) for a in (inclination1, inclination2)
    )
    return np.moveaxis(np.degrees(np.abs(inclination1 - inclination2)), 0, -1)
