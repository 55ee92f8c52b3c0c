"""Outlines of regions as polygons with holes, in the image and in space."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, overload

import numpy as np

from . import _core
from ._check import boolean, labels32s, number
from ._option import parsed, takes
from .frame import Frame, read_frame
from .options import GEOMETRY, ScanLineParams
from .sectors import sectors_of
from .surfaces import in_space, places, relative_ordinate

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import GeometryOptions

OUTLINE_POINT = np.dtype([("x", "f8"), ("y", "f8"), ("point", "3f8")])
RING = np.dtype([("first", "i4"), ("count", "i4"), ("label", "i4"), ("region", "i4"), ("hole", "?"), ("area", "f8")])
ARC = np.dtype([("first", "i4"), ("count", "i4"), ("right", "i4"), ("left", "i4")])
_REACH = 2.0  # pixels from the line in which two planes meet, within which their common border lies on it
_STIFFNESS = 1e-3  # of a corner in its place, beside that of the lines that pull at it
_STRAIGHT = 1e-6  # pixels


class RegionBoundary(NamedTuple):
    """One connected region.

    Attributes
    ----------
    label : int
    outline : structured ndarray of shape (N,)
        Its vertices, the first of which is not repeated: x, y in pixels, clockwise in the image; point, on the surface
        of the region.
    holes : list of structured ndarray
        The same of what it surrounds, counter-clockwise.
    area : float
        Pixels inside.
    """

    label: int
    outline: np.ndarray
    holes: list[np.ndarray]
    area: float

    def __repr__(self) -> str:
        holes = f", {len(self.holes)} holes" if self.holes else ""
        return f"<outline of region {self.label}: {len(self.outline)} vertices{holes}, {self.area:.6g} pixels>"


class RegionBoundaries(Sequence["RegionBoundary"]):
    """The outlines of an image; a sequence of `RegionBoundary`.

    Attributes
    ----------
    points : structured ndarray
        The vertices of all rings, one ring after the other, as `RegionBoundary.outline` has them.
    rings : structured ndarray
        One a ring: first and count of its points; label; region, which counts outlines; whether it is a hole; area in
        pixels, of holes negative. The outside of a region comes before its holes.
    vertices : (V, 2) float64 array
        What rings are made of: x and y of the vertices of every arc, one after the other. An arc is a border that two
        regions share, from one corner at which more than two meet to the next.
    arcs : structured ndarray
        One an arc: first and count of its vertices, both ends included; right and left, the labels beside it as one
        looks along it in the image, 0 for none.
    """

    def __init__(self, points: np.ndarray, rings: np.ndarray, vertices: np.ndarray, arcs: np.ndarray) -> None:
        self.points, self.rings, self.vertices, self.arcs = points, rings, vertices, arcs
        self._outer = np.flatnonzero(~rings["hole"])

    def __len__(self) -> int:
        return len(self._outer)

    @overload
    def __getitem__(self, index: int) -> RegionBoundary: ...
    @overload
    def __getitem__(self, index: slice) -> list[RegionBoundary]: ...
    def __getitem__(self, index: int | slice) -> RegionBoundary | list[RegionBoundary]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        first = self._outer[index]
        end = np.append(self._outer, len(self.rings))[index % len(self) + 1]
        outline, *holes = (self.points[ring["first"] : ring["first"] + ring["count"]] for ring in self.rings[first:end])
        return RegionBoundary(
            int(self.rings["label"][first]), outline, holes, float(self.rings["area"][first:end].sum())
        )

    def __iter__(self) -> Iterator[RegionBoundary]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"<{len(self)} outlines, {len(self.arcs)} arcs, {len(self.vertices)} vertices>"


@takes(GEOMETRY)
def regionBoundaries(
    labels: np.ndarray,
    src: np.ndarray | None = None,
    tolerance: float = 1.0,
    *,
    units: bool = False,
    mask: np.ndarray | None = None,
    **options: Unpack[GeometryOptions],
) -> RegionBoundaries:
    """Find the outlines of regions: polygons with holes, in the image and in space.

    regionBoundaries(labels[, src[, tolerance]], *[, units[, mask[, K[, ...]]]]) -> boundaries

    Outlines run along the borders of pixels; the centre of the first pixel is (0, 0), its corner (-0.5, -0.5). The
    border that two regions share is traced and simplified once, so that their polygons have the same vertices there:
    they leave no gap and do not overlap. With `tolerance` 0 areas are exactly the numbers of pixels.

    1. *Arcs* from one corner at which three or four regions meet to the next are simplified so that no border of a
       pixel lies farther off than the tolerance (Douglas and Peucker); such corners stay.
    2. *Planes that meet* do so in a straight line of the image, and three of them in a point. With `src`, and a
       tolerance above 0, vertices within two pixels of such a line are moved onto it, and corners into its points.
    3. *In space* every vertex lies on the surface of the region: the plane, or the quadratic where a plane fails,
       through its pixels, over the image, of heights on a grid or inverse depths of a camera. In an image that looks
       all around it is the mean of the points that the pixels of the region around it see, and 2. does not apply.

    Parameters
    ----------
    labels : ndarray of shape (H, W), CV_32S
        Regions 1, 2, ..., as `segmentRegions` returns them; 0 and negative values are none. Pixels of a label that do
        not touch by their sides have an outline each.
    src : ndarray, optional
        The range image, as in `edgeStrength`. Without it there are no points in space, but NaN.
    tolerance : float
        In pixels, >= 0.
    units : bool
        Whether `tolerance` is a length in the unit of the image instead: at the depth of each arc.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used for surfaces.
    {options}

    Returns
    -------
    boundaries : RegionBoundaries
        A sequence of outlines, in raster order of the regions' first pixels; packed arrays underneath.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    regionAdjacency : How regions meet.

    Notes
    -----
    Polygons do not cross themselves or each other: where simplified arcs would, more of their vertices stay, and
    vertices that would cross an arc on the way to a line of step 2 stay where they are.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import regionBoundaries
    >>> labels = np.zeros((20, 30), np.int32)
    >>> labels[2:12, 3:23] = 1
    >>> labels[4:8, 5:11] = 2
    >>> outer, inner = regionBoundaries(labels)
    >>> outer.area, inner.area, [tuple(p) for p in inner.outline[["x", "y"]].tolist()]
    (176.0, 24.0, [(4.5, 3.5), (10.5, 3.5), (10.5, 7.5), (4.5, 7.5)])
    """
    (params,) = parsed(options, ScanLineParams)
    tolerance, units = number("tolerance", tolerance, 0), boolean("units", units)
    labels = labels32s("labels", labels, None)
    frame = None
    if src is not None:
        frame = read_frame(src, params, mask)
        labels = labels32s("labels", labels, frame.shape, listed=True)
    return boundaries_of(labels, frame, tolerance, units)


def boundaries_of(labels: np.ndarray, frame: Frame | None, tolerance: float, units: bool = False) -> RegionBoundaries:
    """The outlines of checked labels."""
    corners, arcs, steps, rings, names = _core.trace_outlines(labels)
    vertices = corners - 0.5
    counts, beside = np.ascontiguousarray(arcs[:, 1]), names[arcs[:, 2:]]
    surfaces = None if frame is None else _surfaces(frame, labels)
    tolerances = np.full(len(arcs), tolerance)
    if units and surfaces is not None and len(arcs):
        tolerances /= surfaces.spacing(vertices[arcs[:, 0]], beside)
    if tolerance > 0:
        vertices, counts = _simplified(vertices, counts, tolerances)
        if isinstance(surfaces, _Surfaces) and surfaces.flat_image:
            moved = _untangled(_on_lines(vertices, counts, beside, surfaces), vertices, counts)
            vertices, counts = _simplified(moved, counts, np.full(len(counts), _STRAIGHT))
    named = np.zeros(len(arcs), ARC)
    named["count"], named["first"] = counts, np.cumsum(counts) - counts
    named["right"], named["left"] = beside.T
    index, ring_counts = _along(named, steps, rings)
    found = np.zeros(len(rings), RING)
    found["count"], found["first"] = ring_counts, np.cumsum(ring_counts) - ring_counts
    found["label"], found["region"] = names[rings[:, 2]], rings[:, 2] - 1
    found["hole"] = np.diff(rings[:, 2], prepend=0) == 0
    points = np.zeros(len(index), OUTLINE_POINT)
    points["x"], points["y"] = vertices[index].T
    found["area"] = _areas(points, found)
    owner = np.repeat(found["label"], ring_counts)
    points["point"] = np.nan if surfaces is None else surfaces.points(vertices[index], owner)
    return RegionBoundaries(points, found, vertices, named)


def _simplified(vertices: np.ndarray, counts: np.ndarray, tolerances: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    kept = np.zeros(len(vertices), np.uint8)
    _core.simplify_lines(np.ascontiguousarray(vertices), counts, tolerances, kept)
    ends = np.cumsum(counts)
    sums = np.concatenate([[0], np.cumsum(kept)])
    return vertices[kept > 0], (sums[ends] - sums[ends - counts]).astype(np.int32)


def _along(arcs: np.ndarray, steps: np.ndarray, rings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the vertices of rings, one ring after the other, and how many each has."""
    number = np.where(steps >= 0, steps, -steps - 1)
    counts = arcs["count"][number] - 1  # the last vertex is the first one of what follows
    ends = np.cumsum(counts)
    place = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
    first, last = arcs["first"][number], arcs["first"][number] + counts
    forward = np.repeat(steps >= 0, counts)
    index = np.where(forward, np.repeat(first, counts) + place, np.repeat(last, counts) - place)
    total = np.concatenate([[0], ends])
    return index, (total[rings[:, 0] + rings[:, 1]] - total[rings[:, 0]]).astype(np.int32)


def _areas(points: np.ndarray, rings: np.ndarray) -> np.ndarray:
    """By Gauss, positive where a ring goes round clockwise in the image."""
    following = np.arange(1, len(points) + 1)
    following[rings["first"] + rings["count"] - 1] = rings["first"]
    x, y = points["x"], points["y"]
    crosses = x * y[following] - x[following] * y
    return np.add.reduceat(crosses, rings["first"]) / 2 if len(rings) else np.zeros(0)


def _on_lines(vertices: np.ndarray, counts: np.ndarray, beside: np.ndarray, surfaces: _Surfaces) -> np.ndarray:
    """Vertices near the line in which the planes beside their arc meet moved onto it; corners where lines cross."""
    normal, offset, known = surfaces.lines(beside)
    arc = np.repeat(np.arange(len(counts)), counts)
    n = normal[arc]
    off = (n * vertices).sum(axis=1) - offset[arc]
    near = known[arc] & (np.abs(off) <= _REACH)
    end = np.zeros(len(vertices), bool)
    ends = np.cumsum(counts)
    end[ends - counts] = end[ends - 1] = True
    moved = np.where((near & ~end)[:, None], vertices - off[:, None] * n, vertices)
    places, corner = _distinct(vertices[end])
    pull, toward = np.tile(_STIFFNESS * np.eye(2), (len(places), 1, 1)), _STIFFNESS * places
    own, n, c = near[end], n[end], offset[arc][end]
    np.add.at(pull, corner[own], n[own, :, None] * n[own, None, :])
    np.add.at(toward, corner[own], (n * c[:, None])[own])
    settled = np.linalg.solve(pull, toward[..., None])[..., 0] if len(places) else places
    far = np.linalg.norm(settled - places, axis=1) > 2 * _REACH
    settled[far] = places[far]
    moved[end] = settled[corner]
    return moved


def _distinct(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different ones of (N, 2) vertices, and which of these each is."""
    different, number = np.unique(vertices[:, 0] + 1j * vertices[:, 1], return_inverse=True)
    return np.stack([different.real, different.imag], axis=1), number.ravel()


def _untangled(moved: np.ndarray, vertices: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Moved vertices, of which those of arcs that cross are where they were, as far as it takes."""
    place = None
    while True:
        crossing = np.zeros(len(moved), np.uint8)
        _core.find_crossings(np.ascontiguousarray(moved), counts, crossing)
        if not crossing.any():
            return moved
        if place is None:
            _, place = _distinct(vertices)  # arcs that meet move together
        start = np.flatnonzero(crossing)
        back = np.zeros(len(moved), bool)
        back[place[start]] = back[place[start + 1]] = True
        back = back[place] & (moved != vertices).any(axis=1)
        if not back.any():
            return moved
        moved = np.where(back[:, None], vertices, moved)


def _surfaces(frame: Frame, labels: np.ndarray) -> _Surfaces | _SurfacesAround:
    return _SurfacesAround(frame, labels) if sectors_of(frame) else _Surfaces(frame, labels)


class _Surfaces:
    """Ordinates over the image as planes, or quadratics, of every label."""

    def __init__(self, frame: Frame, labels: np.ndarray) -> None:
        self.frame = frame
        relative, self.offset, _ = relative_ordinate(frame)
        self.x, self.y, self.to_plane = places(frame)
        self.flat_image = self.x is None  # whether straight lines of space are straight in the image
        self.table = np.zeros((max(int(labels.max()), 0) + 1, 10))
        _core.fit_surfaces(relative, self.x, self.y, labels, self.table)

    def points(self, vertices: np.ndarray, labels: np.ndarray) -> np.ndarray:
        x, y = self._places(vertices)
        return in_space(self.frame, x, y, self.to_plane, self._ordinates(x, y, labels))

    def _ordinates(self, x: np.ndarray, y: np.ndarray, labels: np.ndarray) -> np.ndarray:
        x0, y0, a, b, c, d, e, f = self.table[labels].T[:8]
        u, v = x - x0, y - y0
        return self.offset + a + u * (b + u * d + v * e) + v * (c + v * f)

    def _places(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where corners of pixels lie on the image plane: in the middle of the pixels around them that have data."""
        if self.x is None:
            return vertices[:, 0], vertices[:, 1]
        height, width = self.frame.shape
        sums = np.zeros((3, len(vertices)))
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            u, v = np.floor(vertices[:, 0]).astype(int) + dx, np.floor(vertices[:, 1]).astype(int) + dy
            u, v = np.clip(u, 0, width - 1), np.clip(v, 0, height - 1)
            x, y = self.x[v, u], self.y[v, u]
            seen = np.isfinite(x)
            sums += np.stack([np.where(seen, x, 0), np.where(seen, y, 0), seen])
        with np.errstate(invalid="ignore"):
            return sums[0] / sums[2], sums[1] / sums[2]

    def spacing(self, vertices: np.ndarray, beside: np.ndarray) -> np.ndarray:
        """How long a pixel is at a vertex of each arc, on the nearer of the surfaces beside it."""
        a, b, _, d, e, _ = self.to_plane
        pixel = np.sqrt(abs(a * e - b * d))
        if not self.frame.projective:
            return np.full(len(vertices), pixel)
        x, y = self._places(vertices)
        nearest = np.max([np.where(side > 0, self._ordinates(x, y, side), 0) for side in beside.T], axis=0)
        return pixel / np.where(nearest > 0, nearest, np.inf)

    def lines(self, beside: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For every pair of labels n and c of the line n (x, y) = c in which their planes meet; which pairs have one.

        A line is known well enough where the planes' slopes differ by more than noise lets them meet somewhere else.
        """
        x0, y0, a, b, c = self.table[beside].transpose(2, 0, 1)[:5]
        rms, curved = self.table[beside].transpose(2, 0, 1)[8:]
        normal = np.stack([b[:, 0] - b[:, 1], c[:, 0] - c[:, 1]], axis=1)
        at_origin = a - b * x0 - c * y0
        slope = np.linalg.norm(normal, axis=1)
        known = (beside > 0).all(axis=1) & (curved == 0).all(axis=1) & (slope > 0)
        known &= np.linalg.norm(rms, axis=1) < _REACH * slope
        slope = np.where(known, slope, 1)
        return normal / slope[:, None], (at_origin[:, 1] - at_origin[:, 0]) / slope, known


class _SurfacesAround:
    """The same of an image that looks all around: of every sector."""

    def __init__(self, frame: Frame, labels: np.ndarray) -> None:
        self.parts = [(part, _Surfaces(part.frame, part.take(labels))) for part in sectors_of(frame)]

    def points(self, vertices: np.ndarray, labels: np.ndarray) -> np.ndarray:
        return self._of_sectors(vertices, lambda own, at, which: own.points(at, labels[which]), (3,))

    def spacing(self, vertices: np.ndarray, beside: np.ndarray) -> np.ndarray:
        return self._of_sectors(vertices, lambda own, at, which: own.spacing(at, beside[which]), ())

    def _of_sectors(self, vertices: np.ndarray, function: Callable[..., np.ndarray], shape: tuple) -> np.ndarray:
        """What a function makes of the surfaces, places and numbers of the vertices of each sector."""
        result = np.empty((len(vertices), *shape))
        for part, surfaces in self.parts:
            axis = 1 - part.axis  # of x and y
            start, stop = part.start - 0.5, part.start + part.end - part.first - 0.5
            which = np.flatnonzero((vertices[:, axis] >= start) & (vertices[:, axis] <= stop))
            at = vertices[which].copy()
            at[:, axis] += part.first - part.start
            result[which] = function(surfaces, at, which)
        return result
