"""Edges as geometry: ordered chains of points in the image and in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from . import _core
from ._option import parsed, takes
from .constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from .detection import selected, thin_lines
from .edges import EdgeStrength, kernel_options, kindNames, no_strength
from .frame import Frame
from .noise import measured_frame
from .options import LINKING, Linking, ScanLineParams, Selection
from .panorama import joined_chains
from .sectors import sectors_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import LinkingOptions

POINT = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("point", "3f8"),
        ("behind", "3f8"),
        ("normals", "(2,3)f8"),
        ("jump", "f8"),
        ("crease", "f8"),
        ("significance", "f8"),
        ("measured", "3f8"),
        ("deviation", "f8"),
    ]
)
CHAIN = np.dtype(
    [
        ("first", "i4"),
        ("count", "i4"),
        ("kind", "u1"),
        ("closed", "?"),
        ("straight", "?"),
        ("jump", "f8"),
        ("crease", "f8"),
        ("significance", "f8"),
        ("pixels", "f8"),
        ("length", "f8"),
    ]
)


class EdgeChain:
    """One chain of edge points, in the order in which they follow each other.

    Attributes
    ----------
    points : structured ndarray of shape (N,)
        x, y (pixels, subpixel); point, its coordinates in space, of a jump on the nearer surface, and behind, those on
        the surface behind (NaN of a crease); normals (2, 3), unit vectors toward the viewer of the surface on the left
        and of that on the right of the chain, of a jump the nearer one and that behind, NaN where unknown; jump (length
        along the viewing axis, 0 of a crease); crease (degrees, 0 of a jump); significance; measured, where the
        point would be by the scan lines that cross the edge there alone, without the averaging along the chain; and
        deviation, in pixels across a straight jump, how far the lines are from the middle one that leave the same
        pixels on its two sides, as a standard deviation, NaN where noise tells more than that, and of others.
    kind : int
        EDGE_JUMP, EDGE_CONVEX or EDGE_CONCAVE; EDGE_BOUNDARY beside pixels without data, with `boundaryEdges`. Along a
        jump the nearer surface is on the left, seen in the image, and along a boundary the data.
    closed, straight : bool
        Whether the last point is followed by the first one; whether the points lie on a straight line of the image.
    jump, crease, significance : float
        Means over the points, and their largest significance.
    pixels, length : float
        How long the chain is, in the image and in space.
    """

    __slots__ = ("_chain", "points")

    def __init__(self, chain: np.void, points: np.ndarray) -> None:
        self._chain = chain
        self.points = points

    kind = property(lambda self: int(self._chain["kind"]))
    closed = property(lambda self: bool(self._chain["closed"]))
    straight = property(lambda self: bool(self._chain["straight"]))
    jump = property(lambda self: float(self._chain["jump"]))
    crease = property(lambda self: float(self._chain["crease"]))
    significance = property(lambda self: float(self._chain["significance"]))
    pixels = property(lambda self: float(self._chain["pixels"]))
    length = property(lambda self: float(self._chain["length"]))

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        how = " closed" if self.closed else " straight" if self.straight else ""
        size = f", {self.crease:.4g} degrees" if self.kind & (EDGE_CONVEX | EDGE_CONCAVE) else ""
        size = f", jump {self.jump:.4g}" if self.kind & EDGE_JUMP else size
        return (
            f"<{kindNames(self.kind)}{how} chain: {len(self)} points, {self.pixels:.4g} pixels,"
            f" length {self.length:.4g}{size}>"
        )


class EdgeChains(Sequence["EdgeChain"]):
    """The chains of an image; a sequence of `EdgeChain`.

    Attributes
    ----------
    points : structured ndarray
        The points of all chains, one after the other, as `EdgeChain.points` has them.
    chains : structured ndarray
        One a chain: first and count of its points, and what the attributes of `EdgeChain` say.
    """

    __slots__ = ("chains", "points")

    def __init__(self, points: np.ndarray, chains: np.ndarray) -> None:
        self.points, self.chains = points, chains

    def __len__(self) -> int:
        return len(self.chains)

    @overload
    def __getitem__(self, index: int) -> EdgeChain: ...
    @overload
    def __getitem__(self, index: slice) -> list[EdgeChain]: ...
    def __getitem__(self, index: int | slice) -> EdgeChain | list[EdgeChain]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        chain = self.chains[index]
        return EdgeChain(chain, self.points[chain["first"] : chain["first"] + chain["count"]])

    def __iter__(self) -> Iterator[EdgeChain]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        kinds = [kindNames(int(kind)) for kind in self.chains["kind"]]
        count = ", ".join(f"{kinds.count(name)} {name}" for name in sorted(set(kinds)))
        return f"<{len(self)} edge chains of {len(self.points)} points{f': {count}' if count else ''}>"

    def _repr_png_(self) -> bytes:
        from .draw.shown import of_chains

        return of_chains(self)


@takes(LINKING)
def linkEdges(
    src: np.ndarray,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    eps: float | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[LinkingOptions],
) -> EdgeChains:
    """Find the edges of a range image as chains of points, in the image and in space.

    linkEdges(src[, jumpThreshold[, creaseThreshold[, eps]]], *[, mask[, K[, ...]]]) -> chains

    The candidates of `edgePoints` are joined along the lines of `detectEdges`. A chain is an edge of one kind, which
    ends at junctions and corners; where an edge runs on through a junction or beyond a hole in its line, so does the
    chain. Its points are those of several scan lines averaged: on a straight line of the image where they agree with
    one, else on parabolas over a few pixels. Depths and normals of both surfaces are averaged likewise, so that the
    crease of a chain is the angle between two normals of which many scan lines tell.

    Parameters
    ----------
    src, mask
        As in `detectEdges`.
    {options}

    Returns
    -------
    chains : EdgeChains
        A sequence of `EdgeChain`, on top of one array of points and one of chains. Lines of fewer than `minLength`
        pixels are left out. Lines beside pixels without data, which `boundaryEdges` adds, lie half way to these, and
        nothing is known of what is behind.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    detectEdges : The same edges as a map.
    edgePoints : The candidates as they come.

    Notes
    -----
    The position of a jump along a scan line is known to half a pixel, that of a crease to the accuracy of two fits
    (paper, 4.2). The result does not depend on the number of threads.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import linkEdges
    >>> x = np.arange(64) + 0.3 * np.arange(48)[:, None]
    >>> roof = np.abs(x - 40.3)
    >>> chains = linkEdges(roof, pixelSize=1, noise=0.001)
    >>> chains
    <1 edge chains of 48 points: 1 convex>
    >>> bool(np.abs(chains[0].points["x"] + 0.3 * chains[0].points["y"] - 40.3).max() < 0.02)
    True
    """
    given = {"jumpThreshold": jumpThreshold, "creaseThreshold": creaseThreshold, "eps": eps, **options}
    params, selection, linking = parsed(given, ScanLineParams, Selection, Linking)
    return link_frame(measured_frame(src, params, mask), params, selection, linking)


def link_frame(frame: Frame, params: ScanLineParams, selection: Selection, linking: Linking) -> EdgeChains:
    """The chains of a checked range image."""
    strength, parts, kept = no_strength(frame.shape), sectors_of(frame), []
    for part in parts:
        own = no_strength(part.frame.shape)
        kept.append(_candidates(part.frame, params, own))
        for whole, values in zip(strength, own, strict=True):
            part.put(whole, values)
    if not parts:
        kept.append(_candidates(frame, params, strength))
    thin = thin_lines(frame, selected(frame, strength, selection.of(params)))
    options = _core.LinkOptions(
        bridge=linking.bridge,
        corner_angle=linking.cornerAngle,
        min_length=selection.minLength,
        outlines=selection.boundaryEdges,
    )
    if not parts:
        return EdgeChains(*_linked(frame, kept[0], thin, strength.kind, options))
    found = []
    for part, candidates in zip(parts, kept, strict=True):
        found.append(_linked(part.frame, candidates, part.take(thin), part.take(strength.kind), options))
    points, headers = joined_chains(frame, parts, found, selection.minLength)
    around = np.where(np.arange(2) == 1 - frame.seam, frame.shape[frame.seam], 0) if frame.seam is not None else None
    return EdgeChains(points, _chains(headers, points, around))


def _candidates(frame: Frame, params: ScanLineParams, strength: EdgeStrength) -> _core.Candidates:
    return _core.keep_candidates(frame.kernel, kernel_options(frame, params), frame.threads, *strength)


def _linked(
    frame: Frame, candidates: _core.Candidates, thin: np.ndarray, kinds: np.ndarray, options: _core.LinkOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Points and chains along the lines of a map."""
    rows, headers = _core.link_edges(frame.kernel, candidates, thin, kinds, options, frame.threads)
    points = _points(frame, rows, np.repeat(headers[:, 2], headers[:, 1]))
    return points, _chains(headers, points)


def _points(frame: Frame, rows: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """The points of the kernel in space."""
    jumps, meets = kinds == EDGE_JUMP, (kinds & (EDGE_CONVEX | EDGE_CONCAVE)) != 0
    points = np.zeros(len(rows), POINT)
    points["x"], points["y"] = rows[:, 0], rows[:, 1]
    plane, ordinates, gradients = rows[:, 2:4], rows[:, 4:6], rows[:, 6:10].reshape(-1, 2, 2)
    axes = frame.axes
    points["point"] = _in_space(frame, plane, ordinates[:, 0])
    points["behind"] = _in_space(frame, plane, ordinates[:, 1])
    points["measured"] = _in_space(frame, rows[:, 11:13], rows[:, 13])
    through = points["behind"] - points["point"]
    points["jump"] = np.where(jumps, _norms(through) if frame.ranges else np.abs(through @ axes[2]), 0)
    points["behind"][~jumps] = np.nan
    normals = _normals(frame, plane, ordinates, gradients).reshape(-1, 3) @ axes
    points["normals"] = normals.reshape(-1, 2, 3)
    first, second = (points["normals"][meets, side] for side in (0, 1))
    points["crease"][meets] = np.degrees(2 * np.arctan2(_norms(first - second), _norms(first + second)))
    points["significance"], points["deviation"] = rows[:, 10], rows[:, 14]
    return points


def _in_space(frame: Frame, plane: np.ndarray, ordinate: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = 1 / ordinate if frame.projective else -ordinate
    return np.column_stack([plane * depth[:, None] if frame.projective else plane, depth]) @ frame.axes + frame.origin


def _normals(frame: Frame, plane: np.ndarray, ordinates: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Unit normals toward the viewer, in the axes of the image plane and of the view.

    The plane of ordinate q = gx X + gy Y + g0 over the plane of the image is gx x + gy y + g0 z = 1 where lines of
    sight meet, and z = -q where they are parallel.
    """
    normals = np.empty((*ordinates.shape, 3))
    normals[..., :2] = gradients
    along = gradients[..., 0] * plane[:, :1] + gradients[..., 1] * plane[:, 1:]
    normals[..., 2] = ordinates - along if frame.projective else 1
    normals /= -_norms(normals)[..., None]
    return normals


def _norms(vectors: np.ndarray) -> np.ndarray:
    """Lengths along the last axis."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _chains(headers: np.ndarray, points: np.ndarray, around: np.ndarray | None = None) -> np.ndarray:
    """Of rows (first, count, kind, closed, straight). `around` are the lengths of axes that wrap, 0 for others."""
    chains = np.zeros(len(headers), CHAIN)
    for column, name in enumerate(("first", "count", "kind", "closed", "straight")):
        chains[name] = headers[:, column]
    if not len(chains):
        return chains
    first = chains["first"]
    for name in ("jump", "crease"):
        chains[name] = np.add.reduceat(points[name], first) / chains["count"]
    chains["significance"] = np.maximum.reduceat(points["significance"], first)
    chains["pixels"] = _lengths(np.column_stack([points["x"], points["y"]]), chains, around)
    chains["length"] = _lengths(points["point"], chains)
    return chains


def _lengths(places: np.ndarray, chains: np.ndarray, around: np.ndarray | None = None) -> np.ndarray:
    """Of the way through the points of every chain."""
    first, last = chains["first"], chains["first"] + chains["count"] - 1
    following = np.arange(1, len(places) + 1)
    following[last] = np.where(chains["closed"], first, last)
    step = np.abs(places[following] - places)
    if around is not None:
        step = np.where(around > 0, np.minimum(step, np.abs(around - step)), step)
    return np.add.reduceat(_norms(step), first)
