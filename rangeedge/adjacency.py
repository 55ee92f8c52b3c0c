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
from .surfaces import surfaces_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import GeometryOptions

PAIR = np.dtype(
    [
        ("first", "i4"),
        ("second", "i4"),
        ("contacts", "i4"),
        ("kind", "u1"),
        ("jump", "f8"),
        ("dihedral", "f8"),
        ("point", "3f8"),
        ("direction", "3f8"),
    ]
)
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
    that touch a curved surface at the pixel. They meet where the nearer one changes between the pixels, or one beyond,
    or the depths differ by less than three standard deviations of the noise. A box on a table does both: such a pair
    is there twice, once with the contacts at which the surfaces meet, once with those of the jump.

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
        first < second, the labels; contacts, their number; kind, EDGE_JUMP, EDGE_CONVEX or EDGE_CONCAVE; jump, the
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
    labels = np.where(frame.valid > 0, np.maximum(labels32s("labels", labels, frame.shape), 0), 0)
    gap = integer("gap", gap, 0, 64)
    minContacts = integer("minContacts", minContacts, 1)
    i, j = _contacts(labels, gap, frame.seam)
    if not len(i):
        return np.zeros(0, PAIR)
    surfaces = surfaces_of(frame, labels, int(labels.max()) + 1)
    flat = labels.ravel()
    code = flat[i].astype(np.int64) * len(surfaces) + flat[j]
    order = np.argsort(code, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(code[order])) + 1)
    points = frame.points.reshape(-1, 3)
    found = [pair for g in groups for pair in _pairs(frame, points, surfaces, flat, i[g], j[g], minContacts)]
    return np.array(found, PAIR)


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
) -> Iterator[tuple]:
    first, second = int(labels[i[0]]), int(labels[j[0]])
    here = [_planes(surfaces[label], points[pixels]) for label, pixels in ((first, i), (second, j))]
    # From a pixel before the first one of a contact to one after the second.
    places = _sights(frame, points, i), _sights(frame, points, j)
    step = (places[1] - places[0]) / np.maximum(_distance(frame, i, j), 1)[:, None]
    shares = [places[0] - step, (places[0] + places[1]) / 2, places[1] + step]
    before, middle, after = (_depth(frame, *here[0], place) - _depth(frame, *here[1], place) for place in shares)
    sigma = _DEVIATIONS * np.hypot(*(_sigma(frame, points, pixels) for pixels in (i, j)))
    meets = (before * after <= 0) | (np.abs(middle) <= sigma)
    nowhere = (np.nan,) * 3
    if np.count_nonzero(~meets) >= least:
        jump = float(np.median(np.abs(middle)[~meets]))
        yield first, second, np.count_nonzero(~meets), EDGE_JUMP, jump, np.nan, nowhere, nowhere
    if np.count_nonzero(meets) < least:
        return
    normals = [normal[meets].mean(axis=0) for _, normal in here]
    normals = [normal / np.linalg.norm(normal) for normal in normals]
    apart = normals[0] - normals[1]
    angle = np.degrees(2 * np.arctan2(np.linalg.norm(apart), np.linalg.norm(normals[0] + normals[1])))
    convex = np.mean((after - before)[meets]) < 0  # of a ridge either surface, continued, hides the other
    near = points[np.concatenate([i[meets], j[meets]])].mean(axis=0)
    line = _intersection(surfaces[first], surfaces[second], near) or (nowhere, nowhere)
    kind = EDGE_CONVEX if convex else EDGE_CONCAVE
    yield first, second, np.count_nonzero(meets), kind, 0.0, 180 - angle if convex else 180 + angle, *line


def _planes(surface: np.void, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point and the normal of the surface for each of these points on it."""
    if not surface["curved"]:
        return np.broadcast_to(surface["centroid"], points.shape), np.broadcast_to(surface["normal"], points.shape)
    a, b, c, d, e, f, g, h, k, _ = surface["quadric"]
    gradient = points @ np.array([[2 * a, d, e], [d, 2 * b, f], [e, f, 2 * c]]) + np.array([g, h, k])
    return points, gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-300)


def _sights(frame: Frame, points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Where lines of sight pass the plane of the image, or the unit sphere, in the axes of the points."""
    along = _along(frame, points[pixels])[:, None]
    return (points[pixels] - frame.origin) / along if frame.projective else points[pixels] - along * frame.axes[2]


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
