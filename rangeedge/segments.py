"""Straight segments in space, and the vertices in which they meet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ._check import described, fail, integer, number, public
from .chains import EdgeChain, EdgeChains
from .constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from .viewpoint import unit_rays

SEGMENT = np.dtype(
    [
        ("ends", "(2,3)f8"),
        ("pixels", "(2,2)f8"),
        ("direction", "3f8"),
        ("length", "f8"),
        ("kind", "u1"),
        ("jump", "f8"),
        ("dihedral", "f8"),
        ("rms", "f8"),
        ("endDeviation", "f8"),
        ("directionDeviation", "f8"),
        ("lengthDeviation", "f8"),
        ("count", "i4"),
        ("chain", "i4"),
        ("vertices", "2i4"),
    ]
)
VERTEX = np.dtype([("point", "3f8"), ("x", "f8"), ("y", "f8"), ("rms", "f8"), ("count", "i4")])
_FINEST = 1e-6  # share of its length to which a segment is known at best
_FARTHEST = 4.0  # medians that an offset may be to count
_COMMON_OF_JUMPS, _COMMON_OF_CREASES = 0.7, 0.5  # share of their scatter that neighbours have in common
_MOST_ALIKE = 0.95  # of neighbouring offsets
_LEAST_INDEPENDENT = 3.0
_DEVIATIONS = 4.0  # that a line may pass a vertex by


class Segments(NamedTuple):
    """What `fitSegments` returns: structured arrays of segments and of vertices."""

    segments: np.ndarray
    vertices: np.ndarray

    def __repr__(self) -> str:
        return f"<{len(self.segments)} segments, {len(self.vertices)} vertices>"

    def _repr_png_(self) -> bytes:
        from .draw.shown import of_segments

        return of_segments(self)


@public
def fitSegments(
    chains: EdgeChains | Sequence[EdgeChain], tolerance: float | None = None, *, reach: float = 10.0, minPoints: int = 8
) -> Segments:
    """Fit straight segments in space to chains of edge points, and find the vertices in which they meet.

    fitSegments(chains[, tolerance], *[, reach[, minPoints]]) -> segments, vertices

    A straight line has the least sum of squared distances from the points of a chain. Chains that are no straight line
    are divided where they lie farthest off the line through their ends, until none of them lies off by more than
    `tolerance`. Ends of segments that lie close together in the image and in space are a vertex: the point with the
    least sum of squared distances from their lines, in deviations of these; lines that pass it by are left out.
    Segments end in their vertices.

    Parameters
    ----------
    chains : EdgeChains or sequence of EdgeChain
        From `linkEdges`.
    tolerance : float or None
        A length. None takes chains as they are: those that are straight in the image become segments, others do not.
    reach : float
        Pixels between ends of segments that may meet.
    minPoints : int
        Least number of points of a segment, >= 2.

    Returns
    -------
    segments : structured ndarray
        ends (2, 3), in the unit of the chains, and pixels (2, 2), the same in the image; direction, a unit vector from
        the first to the second end; length; kind, that of the chain; jump; dihedral, the angle in
        degrees between two faces that meet, through the solid: below 180 of a convex, above of a concave edge, NaN of a
        jump; rms, of the distances of points from the line before they were averaged; endDeviation, the standard
        deviation of an end across the line, and directionDeviation, that of the direction in degrees, both of the
        averaged line; lengthDeviation, that of the length between two vertices, NaN where an end is none, as where the
        edge ends is not measured then; count of its points; chain, its number; vertices, the numbers of those at its
        ends, -1 for none.
    vertices : structured ndarray
        point (3), x and y in pixels, rms of the distances of the lines from it, and their count, at least 2.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Notes
    -----
    Deviations count neighbouring points as less than independent, by the correlation of their offsets. Of a jump that
    pixels on both sides bound they are those of the lines that leave the same pixels there, and of its noisy depth.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import fitSegments, linkEdges
    >>> x = np.arange(64) + 0.3 * np.arange(48)[:, None]
    >>> segments, vertices = fitSegments(linkEdges(np.abs(x - 40.3), pixelSize=1, noise=0.001))
    >>> len(segments), float(segments["dihedral"][0].round(1)), segments["direction"][0].round(2).tolist()
    (1, 87.5, [-0.29, 0.96, 0.0])
    """
    if not isinstance(chains, Sequence) or not all(isinstance(chain, EdgeChain) for chain in chains):
        raise fail("chains", "EdgeChains, or a sequence of EdgeChain", described(chains))
    if tolerance is not None:
        tolerance = number("tolerance", tolerance, 0, above=True)
    reach = number("reach", reach, 0)
    minPoints = integer("minPoints", minPoints, 2)
    segments = np.array(
        [
            _segment(chain, part, i)
            for i, chain in enumerate(chains)
            for part in _parts(chain, tolerance)
            if len(part) >= minPoints
        ],
        SEGMENT,
    )
    segments["vertices"] = -1
    return Segments(segments, _meet(segments, reach))


# ---- Segments ----


def _parts(chain: EdgeChain, tolerance: float | None) -> list[np.ndarray]:
    points = chain.points[np.isfinite(chain.points["point"]).all(axis=1)]
    if tolerance is None:
        return [points] if chain.straight else []
    if chain.closed and len(points) > 2:  # from the farthest point on, which is as good as any
        far = int(np.linalg.norm(points["point"] - points["point"].mean(axis=0), axis=1).argmax())
        points = np.concatenate([points[far:], points[: far + 1]])
    parts, waiting = [], [points]
    while waiting:
        part = waiting.pop()
        off = _offsets(part["point"], part["point"][0], part["point"][-1]) if len(part) > 2 else np.zeros(1)
        farthest = int(off.argmax())
        if off[farthest] <= tolerance:
            parts.append(part)
        else:
            waiting += [part[farthest:], part[: farthest + 1]]
    return parts


def _offsets(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    way = b - a
    length = np.linalg.norm(way)
    if not length > 0:
        return np.linalg.norm(points - a, axis=1)
    return np.linalg.norm(np.cross(points - a, way / length), axis=1)


def _segment(chain: EdgeChain, points: np.ndarray, number: int) -> tuple:
    place = points["point"]
    centre = place.mean(axis=0)
    direction = np.linalg.svd(place - centre, full_matrices=False)[2][0]
    if direction @ (place[-1] - place[0]) < 0:
        direction = -direction
    along = (place - centre) @ direction
    ends = centre + np.outer([along.min(), along.max()], direction)
    length = float(np.ptp(along))
    pixels = [[points["x"][k], points["y"][k]] for k in (along.argmin(), along.argmax())]

    measured = points["measured"] - centre
    across = measured - np.outer(measured @ direction, direction)
    across = across[np.isfinite(across).all(axis=1)]
    rms, independent = scatter(across)
    noise, share = rms, common_share(chain.kind)
    aside = 0.0
    normal = unit_rays(points["normals"][:, 0].mean(axis=0))  # of the nearer surface
    if np.isfinite(normal).all() and (points["deviation"] > 0).all():  # where it runs pixels tell, of its depth noise
        (noise, independent), share = scatter(across @ normal[:, None]), _COMMON_OF_CREASES
        aside = _length_aside(points, normal, pixels, direction, length) * _rms(points["deviation"][[0, -1]])
    centre_deviation = noise / np.sqrt(independent)
    common = np.hypot(np.hypot(share * noise, _FINEST * length), aside)
    slope_deviation = np.hypot(np.sqrt(12) * centre_deviation, common) / length if length > 0 else np.pi
    solid = {EDGE_CONVEX: 180 - chain.crease, EDGE_CONCAVE: 180 + chain.crease}.get(chain.kind, np.nan)
    return (
        ends,
        pixels,
        direction,
        length,
        chain.kind,
        chain.jump,
        solid,
        rms,
        float(np.hypot(2 * centre_deviation, common)),  # at an end, the deviations of centre and slope together
        float(np.degrees(slope_deviation)),
        np.nan,
        len(points),
        number,
        (-1, -1),
    )


def _length_aside(
    points: np.ndarray, normal: np.ndarray, pixels: list[list[float]], direction: np.ndarray, length: float
) -> float:
    """How far a point of a jump moves on the nearer surface when it moves a pixel aside in the image."""
    middle = points[len(points) // 2]
    sight = unit_rays(middle["behind"] - middle["point"])
    way = np.subtract(pixels[1], pixels[0])
    aside = unit_rays(np.cross(direction, sight))
    per_pixel = length * float(np.linalg.norm(np.cross(direction, sight))) / max(float(np.hypot(*way)), 1e-12)
    return per_pixel * float(np.hypot(1, normal @ aside / min(normal @ sight, -1e-3)))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def common_share(kind: int) -> float:
    """The share of their scatter that all points of a chain have in common."""
    return _COMMON_OF_JUMPS if kind == EDGE_JUMP else _COMMON_OF_CREASES


def scatter(across: np.ndarray) -> tuple[float, float]:
    """Root mean square of offsets without those that lie far off, and as how many independent ones they count."""
    if len(across) < 3:
        return 0.0, 1.0
    distance = np.linalg.norm(across, axis=1)
    across = across[distance <= _FARTHEST * np.median(distance) + 1e-300]
    across = across - across.mean(axis=0)
    n, squares = len(across), float((across**2).sum())
    rms = float(np.sqrt(squares / n))
    if not squares > 0:
        return rms, float(n)
    # A line that was fitted takes away likeness (Kendall, Biometrika 41, 1954) and scatter.
    likeness = float((across[1:] * across[:-1]).sum()) / squares
    likeness = float(np.clip(likeness + (1 + 3 * likeness) / n + 2 / n, 0, _MOST_ALIKE))
    independent = max(n * (1 - likeness) / (1 + likeness), _LEAST_INDEPENDENT)
    return rms, independent - 2


# ---- Vertices ----


def _meet(segments: np.ndarray, reach: float) -> np.ndarray:
    """The vertices; the segments get them as their ends."""
    vertices = []
    variances = np.full((len(segments), 2), np.nan)  # of the ends, along the segments
    for group in _groups(segments, reach):
        found = _vertex(segments, group, reach)
        if found is None:
            continue
        vertex, group = found
        for segment, side in group:
            variances[segment, side] = _variance_along(segments, segment, [other for other, _ in group])
        for segment, side in group:
            segments["vertices"][segment, side] = len(vertices)
            segments["ends"][segment, side] = _foot(segments[segment], vertex[0])
            segments["pixels"][segment, side] = vertex[1:3]
        vertices.append(vertex)
    ends = segments["ends"]
    segments["length"] = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    segments["lengthDeviation"] = np.sqrt(variances.sum(axis=1))
    return np.array(vertices, VERTEX)


def _variance_along(segments: np.ndarray, segment: int, group: list[int]) -> float:
    """Variance of the vertex of a group of lines along one of them, on which the others tell where it is."""
    direction = segments["direction"][segment]
    lines = segments[[other for other in group if other != segment]]
    sines = 1 - (lines["direction"] @ direction) ** 2
    return float(1 / (sines / lines["endDeviation"] ** 2).sum())


def _groups(segments: np.ndarray, reach: float) -> list[list[tuple[int, int]]]:
    """Ends (segment, side) that may meet, by single linkage; of every segment one end."""
    ends = [(segment, side) for segment in range(len(segments)) for side in (0, 1)]
    if not ends:
        return []
    pixels, places = segments["pixels"].reshape(-1, 2), segments["ends"].reshape(-1, 3)
    per_pixel = np.repeat(_per_pixel(segments), 2)
    group = np.arange(len(ends))
    order = np.argsort(pixels[:, 0], kind="stable")
    columns = pixels[order, 0]
    for i, first in enumerate(order):
        for second in order[i + 1 : np.searchsorted(columns, columns[i] + reach, "right")]:
            close = np.hypot(*(pixels[first] - pixels[second])) <= reach
            width = 2 * reach * max(per_pixel[first], per_pixel[second])
            if close and np.linalg.norm(places[first] - places[second]) <= width:
                own, other = (np.flatnonzero(group == group[end]) for end in (first, second))
                if not np.isin(own // 2, other // 2).any():
                    group[other] = group[first]
    members = [np.flatnonzero(group == g) for g in np.unique(group)]
    return [[ends[k] for k in which] for which in members if len(which) > 1]


def _vertex(
    segments: np.ndarray, group: list[tuple[int, int]], reach: float
) -> tuple[tuple, list[tuple[int, int]]] | None:
    """The point nearest to the lines of a group, without those that pass it by; None where fewer than two are left."""
    while len({segment for segment, _ in group}) > 1:
        lines = segments[[segment for segment, _ in group]]
        deviations = lines["endDeviation"]
        point = _nearest(lines["ends"][:, 0], lines["direction"], deviations)
        if point is None:
            return None
        off = np.linalg.norm(np.cross(point - lines["ends"][:, 0], lines["direction"]), axis=1)
        best = np.sqrt(1 / (1 / deviations**2).sum())
        excess = off / (_DEVIATIONS * np.hypot(deviations, best) + 2 * lines["rms"])
        worst = int(excess.argmax())
        if excess[worst] <= 1:
            place = _nearest(lines["pixels"][:, 0], _image_directions(lines), deviations)
            ends = np.array([segments["pixels"][end] for end in group])
            if place is None or (np.linalg.norm(ends - place, axis=1) > 2 * reach).any():
                return None  # lines that are nearly one meet anywhere
            ends = np.array([segments["ends"][end] for end in group])
            if (np.linalg.norm(ends - point, axis=1) > 2 * reach * _per_pixel(lines).max()).any():
                return None  # and what is straight in space is so in the image of a camera only
            x, y = place
            return (point, x, y, float(np.sqrt(np.mean(off**2))), len(group)), group
        group = group[:worst] + group[worst + 1 :]
    return None


def _per_pixel(lines: np.ndarray) -> np.ndarray:
    """The length that a pixel covers."""
    spans = np.linalg.norm(lines["pixels"][:, 1] - lines["pixels"][:, 0], axis=1)
    return lines["length"] / np.maximum(spans, 1)


def _image_directions(lines: np.ndarray) -> np.ndarray:
    way = lines["pixels"][:, 1] - lines["pixels"][:, 0]
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)


def _nearest(origins: np.ndarray, directions: np.ndarray, deviations: np.ndarray) -> np.ndarray | None:
    """The point with the least sum of squared distances from lines, in their deviations; None of parallel lines."""
    dimensions = origins.shape[1]
    across = np.eye(dimensions) - directions[:, :, None] * directions[:, None, :]
    weighted = across / (deviations / deviations.min())[:, None, None] ** 2
    normal = weighted.sum(axis=0)
    if np.linalg.cond(normal) > 1e8:
        return None
    return np.linalg.solve(normal, np.einsum("nij,nj->i", weighted, origins))


def _foot(segment: np.void, point: np.ndarray) -> np.ndarray:
    """The place on the line of a segment that is nearest to a point."""
    origin, direction = segment["ends"][0], segment["direction"]
    return origin + (point - origin) @ direction * direction
