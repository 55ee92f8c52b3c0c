"""Which surfaces touch which, where, and how."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ._check import integer, labels32s
from ._option import parsed, takes
from .constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from .frame import Frame
from .noise import measured_frame
from .options import MEASURED, ScanLineParams
from .projection import to_pixels
from .surfaces import surfaces_of, without_rims

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import GeometryOptions

PAIR = np.dtype(
    [
        ("first", "i4"),
        ("second", "i4"),
        ("contacts", "i4"),
        ("length", "f8"),
        ("kind", "u1"),
        ("jump", "f8"),
        ("dihedral", "f8"),
        ("point", "3f8"),
        ("direction", "3f8"),
    ]
)
CORNER = np.dtype([("labels", "3i4"), ("point", "3f8"), ("x", "f8"), ("y", "f8"), ("convex", "i4")])
_TILE = 16  # pixels in which a border is taken for straight
_REACH = 4  # pixels, beside the gap, from a corner to the contacts of each two of its planes
_DEVIATIONS = 3.0  # of the noise, within which two surfaces meet
_PARALLEL = 0.02  # sine of the angle below which planes have no line in common that is worth the name


@takes(MEASURED)
def regionAdjacency(
    src: np.ndarray,
    labels: np.ndarray,
    gap: int = 2,
    minContacts: int = 3,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[GeometryOptions],
) -> np.ndarray:
    """Find the pairs of neighbouring regions, and whether and how their surfaces meet.

    regionAdjacency(src, labels[, gap[, minContacts]], *[, mask[, K[, ...]]]) -> pairs

    Two pixels of a row or column that belong to different regions, with at most `gap` pixels of none between them, are
    a contact. There the surfaces meet, or one of them is nearer, by their planes: those fitted to the regions, or those
    that touch a curved surface at the pixel. Pixels within three of the border of a region count for its surface only
    if three quarters of it are such: sensors round edges off. Surfaces meet where the nearer one changes between the
    pixels, or one beyond, or the depths differ by less than three standard deviations of the noise. A box on a table
    does both: such a pair is there twice, once with the contacts at which the surfaces meet, once with those of the
    jump.

    Parameters
    ----------
    src, mask
        As in `edgeStrength`.
    labels : ndarray of shape (H, W), CV_32S
        Regions 1, 2, ..., as `segmentRegions` returns them; 0 and negative values are none.
    gap : int
        Most pixels without region between two that touch.
    minContacts : int
        Pairs with fewer of one kind are left out, >= 1.
    {options}

    Returns
    -------
    pairs : structured ndarray
        first < second, the labels; contacts, their number; length, of their common border in space, across the line of
        sight where that is no straight line; kind, EDGE_JUMP, EDGE_CONVEX or EDGE_CONCAVE; jump, the
        median difference of depths along lines of sight, 0 where they meet; dihedral, the angle in degrees between the
        surfaces through the solid, below 180 of a convex, above of a concave edge, NaN of a jump; of two planes that
        meet the line in which they do so: the point of it nearest to the contacts, and its direction, a unit vector;
        NaN otherwise.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    regionCorners : Where three planes meet.
    linkEdges : The edges themselves.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import regionAdjacency
    >>> x = np.arange(40) * np.ones((30, 1))
    >>> pairs = regionAdjacency(np.abs(x - 19.5), np.where(x < 19.5, 1, 2).astype(np.int32), noise=0.001)
    >>> [int(pairs[name][0]) for name in ("first", "second", "contacts", "kind")], float(pairs["dihedral"][0].round(3))
    ([1, 2, 30, 2], 90.0)
    """
    (params,) = parsed(options, ScanLineParams)
    frame = measured_frame(src, params, mask)
    gap, minContacts = integer("gap", gap, 0, 64), integer("minContacts", minContacts, 1)
    found, _ = _neighbours(frame, labels32s("labels", labels, frame.shape, listed=True), gap, minContacts)
    return np.array([pair for pair, _ in found], PAIR)


@takes(MEASURED)
def regionCorners(
    src: np.ndarray,
    labels: np.ndarray,
    gap: int = 2,
    minContacts: int = 3,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[GeometryOptions],
) -> np.ndarray:
    """Find the corners in which three planes meet: those of boxes and of rooms.

    regionCorners(src, labels[, gap[, minContacts]], *[, mask[, K[, ...]]]) -> corners

    Of three plane regions, each two of which meet (`regionAdjacency`), the point that lies on all three planes is a
    corner where each two of them have a contact within a few pixels of it.

    Parameters
    ----------
    src, labels, gap, minContacts, mask
        As in `regionAdjacency`.
    {options}

    Returns
    -------
    corners : structured ndarray
        labels (3), in rising order; point, in the unit of the image; x and y, its pixel, of an image of points that of
        the nearest contact; convex, how many of its three edges are: 3 at the corner of a box, 0 in that of a room.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    fitSegments : The vertices in which edges meet, without regions.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import regionCorners
    >>> y, x = np.mgrid[:30, :40].astype(float)
    >>> planes = np.stack([x - 20, y - 12, 0.5 * (32 - x - y)])
    >>> corners = regionCorners(-planes.max(axis=0), planes.argmax(axis=0).astype(np.int32) + 1, noise=0.001)
    >>> corners["labels"].tolist(), corners["point"].round(3).tolist(), corners["convex"].tolist()
    ([[1, 2, 3]], [[20.0, 12.0, 0.0]], [0])
    """
    (params,) = parsed(options, ScanLineParams)
    frame = measured_frame(src, params, mask)
    gap, minContacts = integer("gap", gap, 0, 64), integer("minContacts", minContacts, 1)
    found, surfaces = _neighbours(frame, labels32s("labels", labels, frame.shape, listed=True), gap, minContacts)
    lines = {pair[:2]: (pair[4], pixels) for pair, pixels in found if np.isfinite(pair[-1]).all()}
    beside: dict[int, set[int]] = {}
    for first, second in lines:
        beside.setdefault(first, set()).add(second)
    points = frame.points.reshape(-1, 3)
    corners = []
    for first, second in sorted(lines):
        for third in sorted(beside[first] & beside.get(second, set())):
            edges = [lines[pair] for pair in ((first, second), (first, third), (second, third))]
            corner = _corner(frame, points, surfaces[[first, second, third]], [pixels for _, pixels in edges], gap)
            if corner is not None:
                convex = sum(kind == EDGE_CONVEX for kind, _ in edges)
                corners.append(((first, second, third), *corner, convex))
    return np.array(corners, CORNER)


def _corner(
    frame: Frame, points: np.ndarray, planes: np.ndarray, contacts: list[np.ndarray], gap: int
) -> tuple[np.ndarray, float, float] | None:
    """The point on three planes and its pixel, where contacts of each two of them are near it."""
    normals = planes["normal"]
    if abs(np.linalg.det(normals)) < _PARALLEL:
        return None
    point = np.linalg.solve(normals, (normals * planes["centroid"]).sum(axis=1))
    nearest = [pixels[np.linalg.norm(points[pixels] - point, axis=1).argmin()] for pixels in contacts]
    places = np.stack(np.unravel_index(nearest, frame.shape)[::-1], axis=1).astype(np.float64)
    if frame.samples.ndim == 2:
        x, y, _ = to_pixels(point, frame).tolist()
        off = np.linalg.norm(places - (x, y), axis=1)
    else:
        lengths = np.linalg.norm(points[nearest] - point, axis=1)
        x, y = places[lengths.argmin()].tolist()
        off = np.linalg.norm(places - (x, y), axis=1)
        size = np.linalg.norm(points[nearest[0]] - points[nearest], axis=1).max()
        if lengths.max() > max(size, 1e-300) * _REACH:
            return None
    return (point, x, y) if (off <= gap + _REACH).all() else None


def _neighbours(
    frame: Frame, labels: np.ndarray, gap: int, minContacts: int
) -> tuple[list[tuple[tuple, np.ndarray]], np.ndarray]:
    """The pairs of `regionAdjacency`, each with the pixels of its contacts; and the surfaces of all regions."""
    labels = np.where(frame.valid > 0, np.maximum(labels, 0), 0)
    i, j = _contacts(labels, gap, frame.seam)
    if not len(i):
        return [], np.zeros(0)
    surfaces = surfaces_of(frame, without_rims(labels), int(labels.max()) + 1)
    flat = labels.ravel()
    code = flat[i].astype(np.int64) * len(surfaces) + flat[j]
    order = np.argsort(code, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(code[order])) + 1)
    points = frame.points.reshape(-1, 3)
    found = [pair for g in groups for pair in _pairs(frame, points, surfaces, flat, i[g], j[g], minContacts)]
    return found, surfaces


def _contacts(labels: np.ndarray, gap: int, seam: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the pixels of every contact, that with the lower label first."""
    index = np.arange(labels.size).reshape(labels.shape)
    pairs = []
    for numbers, named, wrap in ((index, labels, seam == 1), (index.T, labels.T, seam == 0)):
        width = named.shape[1]
        if wrap:
            numbers, named = (np.concatenate([a, a[:, : gap + 1]], axis=1) for a in (numbers, named))
        for distance in range(1, min(gap + 1, named.shape[1] - 1) + 1):
            a = named[:, :-distance][:, :width]
            b = named[:, distance : distance + a.shape[1]]
            touching = (a > 0) & (b > 0) & (a != b)
            for k in range(1, distance):
                touching &= named[:, k : k + a.shape[1]] == 0
            pairs.append(
                np.stack([numbers[:, : a.shape[1]][touching], numbers[:, distance : distance + a.shape[1]][touching]])
            )
    i, j = np.concatenate(pairs, axis=1) if pairs else np.zeros((2, 0), int)
    flat = labels.ravel()
    swap = flat[i] > flat[j]
    return np.where(swap, j, i), np.where(swap, i, j)


def _pairs(
    frame: Frame,
    points: np.ndarray,
    surfaces: np.ndarray,
    labels: np.ndarray,
    i: np.ndarray,
    j: np.ndarray,
    least: int,
) -> Iterator[tuple[tuple, np.ndarray]]:
    first, second = int(labels[i[0]]), int(labels[j[0]])
    here = [_planes(surfaces[label], points[pixels]) for label, pixels in ((first, i), (second, j))]
    # From a pixel before the first one of a contact to one after the second.
    places = _sights(frame, points[i]), _sights(frame, points[j])
    step = (places[1] - places[0]) / np.maximum(_distance(frame, i, j), 1)[:, None]
    shares = [places[0] - step, (places[0] + places[1]) / 2, places[1] + step]
    before, middle, after = (_depth(frame, *here[0], place) - _depth(frame, *here[1], place) for place in shares)
    sigma = _DEVIATIONS * np.hypot(*(_sigma(frame, points, pixels) for pixels in (i, j)))
    meets = (before * after <= 0) | (np.abs(middle) <= sigma)
    nowhere = (np.nan,) * 3
    if np.count_nonzero(~meets) >= least:
        jump = float(np.median(np.abs(middle)[~meets]))
        length = _length(frame, points, i[~meets], j[~meets], step[~meets], None)
        count = np.count_nonzero(~meets)
        pixels = np.concatenate([i[~meets], j[~meets]])
        yield (first, second, count, length, EDGE_JUMP, jump, np.nan, nowhere, nowhere), pixels
    if np.count_nonzero(meets) < least:
        return
    normals = [normal[meets].mean(axis=0) for _, normal in here]
    normals = [normal / np.linalg.norm(normal) for normal in normals]
    apart = normals[0] - normals[1]
    angle = np.degrees(2 * np.arctan2(np.linalg.norm(apart), np.linalg.norm(normals[0] + normals[1])))
    convex = np.mean((after - before)[meets]) < 0  # of a ridge either surface, continued, hides the other
    pixels = np.concatenate([i[meets], j[meets]])
    line = _intersection(surfaces[first], surfaces[second], points[pixels].mean(axis=0))
    kind = EDGE_CONVEX if convex else EDGE_CONCAVE
    length = _length(frame, points, i[meets], j[meets], step[meets], None if line is None else line[1])
    solid = 180 - angle if convex else 180 + angle
    yield (first, second, np.count_nonzero(meets), length, kind, 0.0, solid, *(line or (nowhere, nowhere))), pixels


def _length(
    frame: Frame, points: np.ndarray, i: np.ndarray, j: np.ndarray, step: np.ndarray, direction: np.ndarray | None
) -> float:
    """How long a border is by its contacts i, j, between whose lines of sight lies a `step` a pixel.

    In every tile as many pixels as the diagonal of its contacts along rows and columns, each as long as what a pixel
    sees of a line of that direction, or across the line of sight.
    """
    rows, cols = np.unravel_index(i, frame.shape)
    _, tile, count = np.unique(rows // _TILE * frame.shape[1] + cols // _TILE, return_inverse=True, return_counts=True)
    beside = np.unravel_index(j, frame.shape)[0] == rows
    along_rows = np.bincount(tile, beside)
    pixels = np.hypot(along_rows, count - along_rows)
    middle = np.stack([np.bincount(tile, axis) / count for axis in ((points[i] + points[j]) / 2).T], axis=1)
    size = np.bincount(tile, np.linalg.norm(step, axis=1)) / count
    scale = np.abs(_along(frame, middle)) if frame.projective else np.ones(len(middle))
    if direction is not None:
        ahead = 1e-4 * scale[:, None] * direction
        seen = np.linalg.norm(_sights(frame, middle + ahead) - _sights(frame, middle), axis=1)
        scale = np.linalg.norm(ahead, axis=1) / np.maximum(seen, 1e-300)
    return float((pixels * size * scale).sum())


def _planes(surface: np.void, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point and the normal of the surface for each of these points on it."""
    if not surface["curved"]:
        return np.broadcast_to(surface["centroid"], points.shape), np.broadcast_to(surface["normal"], points.shape)
    a, b, c, d, e, f, g, h, k, _ = surface["quadric"]
    gradient = points @ np.array([[2 * a, d, e], [d, 2 * b, f], [e, f, 2 * c]]) + np.array([g, h, k])
    return points, gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-300)


def _sights(frame: Frame, points: np.ndarray) -> np.ndarray:
    """Where lines of sight to points pass the plane of the image, or the unit sphere, in the axes of the points."""
    along = _along(frame, points)[:, None]
    return (points - frame.origin) / along if frame.projective else points - along * frame.axes[2]


def _along(frame: Frame, points: np.ndarray) -> np.ndarray:
    """The depths of points."""
    from_viewpoint = points - frame.origin
    return np.linalg.norm(from_viewpoint, axis=1) if frame.ranges else from_viewpoint @ frame.axes[2]


def _depth(frame: Frame, on: np.ndarray, normal: np.ndarray, sights: np.ndarray) -> np.ndarray:
    """Of planes along lines of sight."""
    ways = sights if frame.projective else np.broadcast_to(frame.axes[2], sights.shape)
    origins = np.asarray(frame.origin) if frame.projective else sights
    with np.errstate(divide="ignore", invalid="ignore"):
        return ((on - origins) * normal).sum(axis=1) / (ways * normal).sum(axis=1)


def _distance(frame: Frame, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Of pixels in the same row or column, around the seam where that is shorter."""
    steps = np.abs(np.stack(np.unravel_index(i, frame.shape)) - np.stack(np.unravel_index(j, frame.shape)))
    if frame.seam is not None:
        steps[frame.seam] = np.minimum(steps[frame.seam], frame.shape[frame.seam] - steps[frame.seam])
    return steps.sum(axis=0)


def _sigma(frame: Frame, points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    if isinstance(frame.noise, np.ndarray):
        return frame.noise.ravel()[pixels]
    return frame.noise(np.abs(_along(frame, points[pixels])))


def _intersection(first: np.void, second: np.void, near: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The line in which two planes meet: its point nearest to `near`, and its direction."""
    if first["curved"] or second["curved"]:
        return None
    direction = np.cross(first["normal"], second["normal"])
    sine = np.linalg.norm(direction)
    if sine < _PARALLEL:
        return None
    direction /= sine
    normals = np.stack([first["normal"], second["normal"], direction])
    offsets = [first["normal"] @ first["centroid"], second["normal"] @ second["centroid"], direction @ near]
    return np.linalg.solve(normals, offsets), direction
