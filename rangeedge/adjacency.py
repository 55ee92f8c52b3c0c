"""Which surfaces touch which, where, and how."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ._check import integer, labels32s
from ._option import parsed, takes
from .bands import by_bands
from .constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from .contacts import Borders, borders_of, lengths
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
_BLOCK = 1 << 16  # pixels that are compared in one go
_REACH = 4  # pixels, beside the gap, from a corner to the contacts of each two of its planes
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
    pairs, _, _ = _neighbours(frame, labels32s("labels", labels, frame.shape, listed=True), gap, minContacts)
    return pairs


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
    labels = labels32s("labels", labels, frame.shape, listed=True)
    pairs, borders, surfaces = _neighbours(frame, labels, gap, minContacts)
    edges = _triangles(pairs)
    names = np.stack([pairs["first"][edges[:, 0]], pairs["second"][edges[:, 0]], pairs["second"][edges[:, 1]]], axis=1)
    normals, centroids = surfaces["normal"][names], surfaces["centroid"][names]
    met = np.abs(np.linalg.det(normals)) >= _PARALLEL
    edges, names, normals, centroids = edges[met], names[met], normals[met], centroids[met]
    corners = np.zeros(len(edges), CORNER)
    corners["labels"] = names
    corners["point"] = np.linalg.solve(normals, (normals * centroids).sum(axis=2)[..., None])[..., 0]
    corners["convex"] = (pairs["kind"][edges] == EDGE_CONVEX).sum(axis=1)
    return corners[_seen(frame, corners, _nearest(frame, borders, edges, corners["point"]), gap)]


def _triangles(pairs: np.ndarray) -> np.ndarray:
    """(N, 3): of labels a < b < c each two of which meet in a line, the pairs (a, b), (a, c) and (b, c)."""
    lines = np.flatnonzero(np.isfinite(pairs["direction"]).all(axis=1))
    names = pairs[["first", "second"]][lines].tolist()
    number = dict(zip(names, lines.tolist(), strict=True))
    beside: dict[int, set[int]] = {}
    for first, second in names:
        beside.setdefault(first, set()).add(second)
    found = [
        (number[first, second], number[first, third], number[second, third])
        for first, second in names
        for third in sorted(beside[first] & beside.get(second, set()))
    ]
    return np.array(found, int).reshape(-1, 3)


def _nearest(frame: Frame, borders: Borders, edges: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(N, 3): the pixel of each of three borders that is nearest to the point."""
    # The pixels of every border one after the other: the first ones of its contacts, then the second ones.
    counts = borders.counts
    place = borders.start[borders.border] + np.arange(len(borders.border))
    pixels = np.empty(2 * len(place), int)
    pixels[place], pixels[place + counts[borders.border]] = borders.pixels
    points = frame.points.reshape(-1, 3)
    wanted, target = edges.ravel(), point.repeat(3, axis=0)
    sizes = 2 * counts[wanted]
    nearest = np.empty(len(wanted), int)
    ends = np.cumsum(sizes)
    for first, end in pairwise(np.unique(np.r_[0, np.searchsorted(ends, range(0, sizes.sum(), _BLOCK)), len(wanted)])):
        size = sizes[first:end]
        start = np.cumsum(size) - size
        run = np.repeat(np.arange(end - first), size)
        seen = pixels[(2 * borders.start[wanted[first:end]] - start)[run] + np.arange(len(run))]
        away = np.linalg.norm(points[seen] - target[first:end][run], axis=1)
        least = np.flatnonzero(away == np.minimum.reduceat(away, start)[run])
        _, of_each = np.unique(run[least], return_index=True)
        nearest[first:end] = seen[least[of_each]]
    return nearest.reshape(-1, 3)


def _seen(frame: Frame, corners: np.ndarray, nearest: np.ndarray, gap: int) -> np.ndarray:
    """Whether these pixels are near corners, whose x and y are set."""
    places = np.stack(np.unravel_index(nearest, frame.shape)[::-1], axis=-1).astype(np.float64)
    if frame.samples.ndim == 2:
        pixel, near = to_pixels(corners["point"], frame)[:, :2], True
    else:
        seen = frame.points.reshape(-1, 3)[nearest]
        away = np.linalg.norm(seen - corners["point"][:, None], axis=2)
        pixel = np.take_along_axis(places, away.argmin(axis=1)[:, None, None], axis=1)[:, 0]
        size = np.linalg.norm(seen[:, :1] - seen, axis=2).max(axis=1, initial=1e-300)
        near = away.max(axis=1) <= size * _REACH
    corners["x"], corners["y"] = pixel.T
    return near & (np.linalg.norm(places - pixel[:, None], axis=2) <= gap + _REACH).all(axis=1)


def _neighbours(frame: Frame, labels: np.ndarray, gap: int, minContacts: int) -> tuple[np.ndarray, Borders, np.ndarray]:
    """The pairs of `regionAdjacency`, the borders of which they are, and the surfaces of all regions."""
    labels = by_bands(lambda own, valid: np.where(valid > 0, np.maximum(own, 0), 0), labels, frame.valid)
    surfaces = surfaces_of(frame, without_rims(labels), int(labels.max()) + 1)
    borders = borders_of(frame, labels, surfaces, gap, minContacts)
    pairs = np.zeros(len(borders), PAIR)
    pairs["first"], pairs["second"], pairs["contacts"] = borders.first, borders.second, borders.counts
    pairs["kind"], pairs["dihedral"], pairs["point"], pairs["direction"] = EDGE_JUMP, np.nan, np.nan, np.nan
    if len(pairs):
        _describe(frame, pairs, borders, surfaces)
    return pairs, borders, surfaces


def _describe(frame: Frame, pairs: np.ndarray, borders: Borders, surfaces: np.ndarray) -> None:
    """What there is to say of pairs beyond their labels and contacts."""
    meet = borders.meet
    points = frame.points.reshape(-1, 3)
    pairs["jump"] = np.where(meet, 0.0, borders.medians(borders.apart))
    normals = borders.means(borders.normals)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    halves = (np.linalg.norm(normals[:, 0] + sign * normals[:, 1], axis=1) for sign in (-1, 1))
    angle = np.degrees(2 * np.arctan2(*halves))
    convex = borders.means(borders.change) < 0  # of a ridge either surface, continued, hides the other
    pairs["kind"][meet] = np.where(convex, EDGE_CONVEX, EDGE_CONCAVE)[meet]
    pairs["dihedral"][meet] = np.where(convex, 180 - angle, 180 + angle)[meet]
    near = (borders.means(points[borders.pixels[0]]) + borders.means(points[borders.pixels[1]])) / 2
    first, second = (by_bands(lambda own: surfaces[own], each) for each in (borders.first, borders.second))
    point, direction = _intersections(first, second, near)
    crossing = meet & ~np.isnan(direction[:, 0])
    pairs["point"][crossing], pairs["direction"][crossing] = point[crossing], direction[crossing]
    pairs["length"] = lengths(frame, borders, pairs["direction"])


def _intersections(first: np.ndarray, second: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The lines in which planes meet: their points nearest to `near`, and their directions; NaN where there is none."""
    direction = np.cross(first["normal"], second["normal"])
    sine = np.linalg.norm(direction, axis=1)
    point = np.full_like(direction, np.nan)
    meets = ~first["curved"] & ~second["curved"] & (sine >= _PARALLEL)
    direction = np.where(meets[:, None], direction / np.where(meets, sine, 1.0)[:, None], np.nan)
    normals = np.stack([first["normal"], second["normal"], direction], axis=1)
    on = np.stack([first["centroid"], second["centroid"], near], axis=1)
    point[meets] = by_bands(
        lambda own, places: np.linalg.solve(own, (own * places).sum(axis=2)[..., None])[..., 0],
        normals[meets],
        on[meets],
    )
    return point, direction
