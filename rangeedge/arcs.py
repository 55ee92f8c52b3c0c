"""Circles and their arcs in space, as the rims of cups and holes are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._check import described, fail, integer, number, public
from .chains import EdgeChain, EdgeChains
from .segments import common_share, scatter

ARC = np.dtype(
    [
        ("center", "3f8"),
        ("normal", "3f8"),
        ("radius", "f8"),
        ("ends", "(2,3)f8"),
        ("angle", "f8"),
        ("kind", "u1"),
        ("jump", "f8"),
        ("crease", "f8"),
        ("rms", "f8"),
        ("centerDeviation", "f8"),
        ("normalDeviation", "f8"),
        ("radiusDeviation", "f8"),
        ("count", "i4"),
        ("chain", "i4"),
    ]
)
_ROUNDS = 20  # of Gauss-Newton
_FARTHEST = 4.0  # medians that an offset may be to count
_MOST_EXCESS = 1.5  # times the scatter of points about their chain that they may lie about the circle
_FINEST, _COARSEST = 1e-3, 1 / 30  # shares of the radius by which averaged points may lie off in any case, and at most
_STEP = 2.0  # degrees between the points of a polyline


@public
def fitArcs(
    chains: EdgeChains | Sequence[EdgeChain],
    tolerance: float | None = None,
    *,
    minAngle: float = 60.0,
    minPoints: int = 16,
) -> np.ndarray:
    """Fit circles and their arcs in space to chains of edge points.

    fitArcs(chains[, tolerance], *[, minAngle[, minPoints]]) -> arcs

    The plane of a circle has the least sum of squared distances from the points of a chain; in this plane the circle
    itself has, of ``|p - center| - radius``. Points that lie far off are left out. A chain that is straight in the
    image is no arc, nor is one whose points the circle leaves farther than their noise does.

    Parameters
    ----------
    chains : EdgeChains or sequence of EdgeChain
        From `linkEdges`.
    tolerance : float or None
        A length: the root mean square that the averaged points may lie off the circle. None takes one and a half times
        that of the points before, but at least a thousandth and at most a thirtieth of the radius.
    minAngle : float
        Degrees that an arc covers at least, from 1 to 360. Short arcs hardly tell their radius.
    minPoints : int
        Least number of points of an arc, >= 5.

    Returns
    -------
    arcs : structured ndarray
        center (3) and radius, in the unit of the chains; normal (3), the unit vector about which the arc runs
        counterclockwise; ends (2, 3), the points of the circle next to those of the chain, and angle, the degrees from
        the first to the second, 360 of a closed chain; kind, jump and crease, those of the chain; rms, of the distances
        of points from the circle before they were averaged; the standard deviations centerDeviation, a length,
        normalDeviation in degrees, and radiusDeviation; count of points; chain, its number.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    fitSegments : The same for straight lines.
    drawArcs, writeLines

    Notes
    -----
    A rim that is a jump on one side and a crease on the other has an arc for either, of one circle. The outline of a
    sphere or a cone is a circle, too: where lines of sight touch it.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import fitArcs, linkEdges
    >>> y, x = np.mgrid[:80, :80]
    >>> hole = np.where(np.hypot(x - 40.2, y - 38.7) < 25, 5.0, 1.0)
    >>> (arc,) = fitArcs(linkEdges(hole, pixelSize=1, noise=0.001))
    >>> bool(abs(arc["radius"] - 25) < 0.1), float(arc["angle"])
    (True, 360.0)
    """
    if not isinstance(chains, Sequence) or not all(isinstance(chain, EdgeChain) for chain in chains):
        raise fail("chains", "EdgeChains, or a sequence of EdgeChain", described(chains))
    if tolerance is not None:
        tolerance = number("tolerance", tolerance, 0, above=True)
    minAngle = number("minAngle", minAngle, 1, 360)
    minPoints = integer("minPoints", minPoints, 5)
    found = []
    for i, chain in enumerate(chains):
        if not chain.straight and len(chain) >= minPoints:
            arc = _arc(chain, i, tolerance, minPoints)
            if arc is not None and arc["angle"] >= minAngle:
                found.append(arc)
    return np.array(found, ARC)


def arc_points(arc: np.void) -> np.ndarray:
    """Points along an arc, (N, 3); around a whole circle the first is not repeated. None of one that is not finite."""
    numbers = (arc["center"], arc["ends"], arc["normal"], arc["angle"])
    if not all(np.isfinite(number).all() for number in numbers):
        return np.zeros((0, 3))
    start = arc["ends"][0] - arc["center"]
    other = np.cross(arc["normal"], start)
    degrees = float(np.clip(arc["angle"], 0, 360))
    angles = np.radians(np.linspace(0, degrees, int(np.ceil(degrees / _STEP)) + 1))
    angles = angles[: -1 if degrees == 360 else None]
    return arc["center"] + np.outer(np.cos(angles), start) + np.outer(np.sin(angles), other)


def _arc(chain: EdgeChain, number: int, tolerance: float | None, least: int) -> np.ndarray | None:
    points = chain.points[np.isfinite(chain.points["point"]).all(axis=1)]
    used = points
    for _ in range(3):  # a circle, and without what lies far off it
        if len(used) < least:
            return None
        axes, origin, flat = _plane(used["point"])
        circle = _circle(flat[:, :2])
        if circle is None:
            return None
        off = _offsets(_in_plane(points["point"], origin, axes), circle)
        distance = np.linalg.norm(off, axis=1)
        near = distance <= max(_FARTHEST * float(np.median(distance)), 1e-12 * circle[2])
        if np.count_nonzero(near) == len(used):
            break
        used = points[near]
    u, v, radius = circle
    rms = float(np.sqrt((_offsets(flat, circle) ** 2).sum(axis=1).mean()))
    known = used[np.isfinite(used["measured"]).all(axis=1)]
    measured = known["measured"]
    noise = _offsets(_in_plane(measured, origin, axes), circle)
    likely = _MOST_EXCESS * scatter(measured - known["point"])[0]
    if not rms <= (np.clip(likely, _FINEST * radius, _COARSEST * radius) if tolerance is None else tolerance):
        return None

    center = origin + u * axes[0] + v * axes[1]
    angles = np.unwrap(np.arctan2(flat[:, 1] - v, flat[:, 0] - u))
    sweep = angles[-1] - angles[0]
    normal = axes[2] if sweep > 0 else -axes[2]
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    ends = center + radius * directions[[0, -1]] @ axes[:2]
    deviations = _deviations(noise, directions, radius, common_share(chain.kind))
    angle = 360.0 if chain.closed else min(float(np.degrees(abs(sweep))), 360.0)
    return np.array(
        (
            center,
            normal,
            radius,
            ends,
            angle,
            chain.kind,
            chain.jump,
            chain.crease,
            float(np.sqrt((noise**2).sum(axis=1).mean())) if len(noise) else 0.0,
            *deviations,
            len(used),
            number,
        ),
        ARC,
    )


def _plane(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes of the best plane, the last one normal to it, a point of it, and the points by them."""
    origin = points.mean(axis=0)
    axes = np.linalg.svd(points - origin, full_matrices=False)[2]
    axes[2] = np.cross(axes[0], axes[1])
    return axes, origin, _in_plane(points, origin, axes)


def _in_plane(points: np.ndarray, origin: np.ndarray, axes: np.ndarray) -> np.ndarray:
    return (points - origin) @ axes.T


def _circle(places: np.ndarray) -> tuple[float, float, float] | None:
    """Centre and radius with the least sum of squared distances; None of places on a line."""
    size = float(np.sqrt((places**2).sum(axis=1).mean()))
    if not size > 0:
        return None
    scaled = places / size
    # From the circle u^2 + v^2 = a u + b v + c on, of which the errors are the squares.
    (a, b, c), *_ = np.linalg.lstsq(
        np.column_stack([scaled, np.ones(len(scaled))]), (scaled**2).sum(axis=1), rcond=None
    )
    circle = np.array([a / 2, b / 2, np.sqrt(max(c + (a * a + b * b) / 4, 1e-12))])
    for _ in range(_ROUNDS):
        way = scaled - circle[:2]
        length = np.maximum(np.linalg.norm(way, axis=1), 1e-12)
        step, *_ = np.linalg.lstsq(np.column_stack([-way / length[:, None], -np.ones(len(way))]), circle[2] - length)
        circle = circle + step
        if np.abs(step).max() < 1e-12:
            break
    if not (np.isfinite(circle).all() and 0 < circle[2] < 1e3):
        return None
    u, v, radius = (circle * size).tolist()
    return u, v, radius


def _offsets(flat: np.ndarray, circle: tuple[float, float, float]) -> np.ndarray:
    """Of points by the axes of the plane, from the circle: along its radius and its normal."""
    u, v, radius = circle
    return np.column_stack([np.hypot(flat[:, 0] - u, flat[:, 1] - v) - radius, flat[:, 2]])


def _deviations(noise: np.ndarray, directions: np.ndarray, radius: float, common: float) -> tuple[float, float, float]:
    """Standard deviations of centre, normal and radius, by offsets of single points and what these have in common."""
    if len(noise) < 3:
        return 0.0, 0.0, 0.0
    design = np.column_stack([directions, np.ones(len(directions))])
    inverse = np.linalg.inv(design.T @ design)
    (radial, independent), (normal, independent_normal) = (scatter(noise[:, [k]]) for k in (0, 1))
    flat = inverse * (radial**2 * len(design) * (1 / independent + common**2))
    tilted = inverse * (normal**2 * len(design) * (1 / independent_normal + common**2))
    center = float(np.sqrt(flat[0, 0] + flat[1, 1] + tilted[2, 2]))
    tilt = float(np.degrees(np.sqrt((tilted[0, 0] + tilted[1, 1]) / 2) / radius))
    return center, tilt, float(np.sqrt(flat[2, 2]))
