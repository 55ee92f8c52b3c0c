"""Lines of any origin as what files of lines hold: places in the image, points in space, and what is known of each."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._check import boolean, described, fail, public
from ..arcs import ARC, arc_points
from ..boundaries import RegionBoundaries
from ..chains import EdgeChain
from ..edges import kindNames
from ..segments import SEGMENT, Segments

REGION = "region"  # the kind of an outline
_ANGLES = ("crease", "dihedral", "angle")


class Line(NamedTuple):
    """A polyline, as files of lines hold it; `readLines` and `toLines` return lists of them.

    Attributes
    ----------
    kind : str
        jump, convex or concave; region of an outline.
    closed : bool
        Whether the first point, which is not repeated, follows the last one.
    pixels : (N, 2) float64 array
        Column and row of every point; NaN where a file does not hold them.
    points : (N, 3) float64 array
        The same in space.
    properties : dict
        Numbers, booleans, and lists of them: of a chain jump, crease, significance and length; of a segment jump,
        dihedral, length, rms, endDeviation, directionDeviation, lengthDeviation and vertices; of an arc center, normal,
        radius, angle and more that `fitArcs` tells, while its pixels are not known; of a ring label, region, hole and
        area.
    """

    kind: str
    closed: bool
    pixels: np.ndarray
    points: np.ndarray
    properties: dict[str, Any]

    @property
    def angle(self) -> float:
        """The crease or the dihedral angle in degrees, NaN of what has none."""
        return float(next((self.properties[name] for name in _ANGLES if name in self.properties), np.nan))


@public
def toLines(lines: Any) -> list[Line]:
    """Turn chains, segments, arcs or outlines into plain polylines.

    toLines(lines) -> polylines

    Parameters
    ----------
    lines : EdgeChains, sequence of EdgeChain, Segments, array of segments or arcs, RegionBoundaries, sequence of Line
        From `linkEdges`, `fitSegments`, `fitArcs`, `regionBoundaries` or `readLines`.

    Returns
    -------
    polylines : list of Line
        Points of chains that are not finite are left out. An outline is a closed line for its outside and for each of
        its holes.

    Raises
    ------
    rangeedge.error
        If `lines` is nothing of that, or a Line does not hold what it should.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import linkEdges, toLines
    >>> roof = np.abs(np.arange(64) + 0.3 * np.arange(48)[:, None] - 40.3)
    >>> (ridge,) = toLines(linkEdges(roof, pixelSize=1, noise=0.001))
    >>> ridge.kind, ridge.points.shape[1], sorted(ridge.properties)
    ('convex', 3, ['crease', 'jump', 'length', 'significance'])
    """
    if isinstance(lines, Segments):
        lines = lines.segments
    if isinstance(lines, RegionBoundaries):
        return list(_of_rings(lines))
    if isinstance(lines, np.ndarray) and lines.dtype == SEGMENT:
        return list(_of_segments(lines))
    if isinstance(lines, np.ndarray) and lines.dtype == ARC:
        return list(_of_arcs(lines))
    listed = isinstance(lines, Sequence) and not isinstance(lines, memoryview)
    if listed and all(isinstance(line, EdgeChain) for line in lines):
        return list(_of_chains(lines))
    if listed and all(isinstance(line, Line) for line in lines):
        return [_checked(line) for line in lines]
    raise fail(
        "lines", "EdgeChains, Segments, arcs, RegionBoundaries, or a sequence of EdgeChain or Line", described(lines)
    )


_KIND = re.compile(r"[\w.-]+( [\w.-]+)*")  # words, so that every format can hold it


def _checked(line: Line) -> Line:
    """The same line; what it holds is what its formats can hold."""
    if not isinstance(line.kind, str) or not _KIND.fullmatch(line.kind):
        raise fail("lines", "lines of a kind in words", described(line.kind))
    boolean("closed", line.closed)
    for name, places, width in (("pixels", line.pixels, 2), ("points", line.points, 3)):
        shape = (len(line.points) if isinstance(line.points, np.ndarray) else "N", width)
        if not isinstance(places, np.ndarray) or places.dtype.kind != "f" or places.shape != shape:
            raise fail("lines", f"lines with {name} as a float array of shape {shape}", described(places))
    known = line.properties
    try:
        plain = isinstance(known, Mapping) and all(isinstance(name, str) for name in known)
        json.dumps(known)
    except (TypeError, ValueError, RecursionError):
        plain = False
    if not (plain and all(isinstance(known.get(name, 0.0), (int, float)) for name in _ANGLES)):
        raise fail("lines", "lines whose properties are numbers, booleans and lists of them", described(known))
    return line


def _of_chains(chains: Sequence[EdgeChain]) -> Iterator[Line]:
    for chain in chains:
        points = chain.points[np.isfinite(chain.points["point"]).all(axis=1)]
        known = {name: getattr(chain, name) for name in ("jump", "crease", "significance", "length")}
        pixels = np.column_stack([points["x"], points["y"]])
        yield Line(kindNames(chain.kind), chain.closed, pixels, points["point"].copy(), known)


def _of_segments(segments: np.ndarray) -> Iterator[Line]:
    for segment in segments:
        names = ("jump", "dihedral", "length", "rms", "endDeviation", "directionDeviation", "lengthDeviation")
        known: dict[str, Any] = {name: float(segment[name]) for name in names}
        known["vertices"] = segment["vertices"].tolist()
        yield Line(kindNames(int(segment["kind"])), False, segment["pixels"].copy(), segment["ends"].copy(), known)


def _of_arcs(arcs: np.ndarray) -> Iterator[Line]:
    for arc in arcs:
        names = ("radius", "angle", "jump", "crease", "rms", "centerDeviation", "normalDeviation", "radiusDeviation")
        known: dict[str, Any] = {name: float(arc[name]) for name in names}
        known.update(center=arc["center"].tolist(), normal=arc["normal"].tolist())
        points = arc_points(arc)
        if len(points):
            yield Line(kindNames(int(arc["kind"])), bool(arc["angle"] >= 360), no_pixels(points), points, known)


def _of_rings(boundaries: RegionBoundaries) -> Iterator[Line]:
    for ring in boundaries.rings:
        points = boundaries.points[ring["first"] : ring["first"] + ring["count"]]
        known = {name: ring[name].item() for name in ("label", "region", "hole", "area")}
        yield Line(REGION, True, np.column_stack([points["x"], points["y"]]), points["point"].copy(), known)


def grouped(lines: Sequence[Line]) -> Iterator[list[Line]]:
    """Lines that make up one figure: an outline and its holes; any other by itself."""
    group: list[Line] = []
    for line in lines:
        if group and is_hole(line.properties) and line.properties.get("region") == group[0].properties.get("region"):
            group.append(line)
            continue
        if group:
            yield group
        group = [line]
    if group:
        yield group


def is_hole(properties: Mapping[str, Any]) -> bool:
    return properties.get("hole") is True


def no_pixels(points: np.ndarray) -> np.ndarray:
    return np.full((len(points), 2), np.nan)
