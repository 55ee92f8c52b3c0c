"""Regions and chains of an image that looks all around: those of its sectors, joined where these meet."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from .frame import Frame
from .pixels import joined
from .sectors import Sector

_ENDS = 4.0  # pixels between the ends of chains that go on in the next sector
_MAJORITY = 0.5  # of the pixels of either region where its sectors overlap, that two must share to be one


def joined_labels(frame: Frame, parts: list[Sector], grown: list[np.ndarray], min_area: int) -> np.ndarray:
    """The regions of all pixels, numbered in raster order, from those of the sectors."""
    seen, count = [], 1
    for part, labels in zip(parts, grown, strict=True):
        whole = np.full(frame.shape, -1, np.int32)  # outside the sector
        part.spread(whole, np.where(labels > 0, labels + (count - 1), 0))
        seen.append(whole)
        count += int(labels.max())
    pairs = [_same(a, b, count) for a, b in combinations(seen, 2)]
    first, second = np.concatenate(pairs, axis=1)
    least = joined(count, first, second)
    regions = np.zeros(frame.shape, np.int32)
    for part, labels in zip(parts, seen, strict=True):
        part.put(regions, part.take(least[np.maximum(labels, 0)]))
    return _connected(frame, regions, min_area)


def _same(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    """Pairs of labels (2, N) of two sectors that most of the pixels of either have where both sectors see them."""
    both = (a >= 0) & (b >= 0)
    a, b = a[both].astype(np.int64), b[both].astype(np.int64)
    area_a, area_b = np.bincount(a, minlength=count), np.bincount(b, minlength=count)
    codes, shared = np.unique(a * count + b, return_counts=True)
    first, second = codes // count, codes % count
    most = (shared > _MAJORITY * area_a[first]) & (shared > _MAJORITY * area_b[second]) & (first > 0) & (second > 0)
    return np.stack([first[most], second[most]])


def _connected(frame: Frame, regions: np.ndarray, min_area: int) -> np.ndarray:
    """The 4-connected parts of regions that are large enough."""
    from skimage.measure import label

    parts = label(regions, background=0, connectivity=1)
    if frame.seam is not None:
        last, first = np.take(parts, -1, frame.seam), np.take(parts, 0, frame.seam)
        same = (np.take(regions, -1, frame.seam) == np.take(regions, 0, frame.seam)) & (last > 0)
        parts = joined(int(parts.max()) + 1, last[same], first[same])[parts]
    keep = np.bincount(parts.ravel()) >= min_area
    keep[0] = False
    numbers = np.zeros(len(keep), np.int32)
    numbers[keep] = np.arange(1, np.count_nonzero(keep) + 1)  # the least number of a part is that of its first pixel
    return numbers[parts]


class _Piece(NamedTuple):
    """A chain, or what of it lies in its sector; at ends that are cut it goes on in the next one."""

    points: np.ndarray
    chain: np.void
    cut: tuple[bool, bool]


def joined_chains(
    frame: Frame, parts: list[Sector], found: list[tuple[np.ndarray, np.ndarray]], min_length: int
) -> tuple[np.ndarray, np.ndarray]:
    """Points, and rows (first, count, kind, closed, straight) of chains of `min_length` pixels, of those of sectors."""
    pieces = [
        piece
        for part, (points, chains) in zip(parts, found, strict=True)
        for chain in chains
        for piece in _pieces(part, points[chain["first"] : chain["first"] + chain["count"]], chain)
    ]
    others = _continuations(frame, pieces)
    done, whole = np.zeros(len(pieces), bool), []
    for start in range(len(pieces)):
        if done[start]:
            continue
        way, closed = _way(start, others)
        done[[number for number, _ in way]] = True
        points = np.concatenate([_reversed(pieces[i].points) if turned else pieces[i].points for i, turned in way])
        chain = pieces[start].chain
        if len(points) >= max(min_length, 2):
            alone = len(way) == 1 and not any(pieces[start].cut)
            whole.append((points, chain["kind"], closed or (alone and chain["closed"]), alone and chain["straight"]))
    counts = [len(points) for points, *_ in whole]
    firsts = np.cumsum([0, *counts[:-1]]) if whole else []
    rows = [
        (f, n, kind, closed, straight) for f, n, (_, kind, closed, straight) in zip(firsts, counts, whole, strict=True)
    ]
    points = np.concatenate([points for points, *_ in whole]) if whole else found[0][0][:0]
    return points, np.array(rows, np.int32).reshape(-1, 5)


def _pieces(part: Sector, points: np.ndarray, chain: np.void) -> list[_Piece]:
    """The parts of a chain in a sector, in the pixels of the whole."""
    name = "x" if part.axis else "y"
    inside = (points[name] >= part.first - 0.5) & (points[name] < part.end - 0.5)
    if not inside.any():
        return []
    closed = bool(chain["closed"])
    if closed and not inside.all():  # begins where it comes in
        points, inside = (np.roll(a, -int(np.argmin(inside))) for a in (points, inside))
    ends = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8))).reshape(-1, 2)
    points = points.copy()
    points[name] += part.start - part.first
    whole = closed and inside.all()
    return [
        _Piece(points[a:b], chain, (not whole and (a > 0 or closed), not whole and (b < len(points) or closed)))
        for a, b in ends.tolist()
    ]


def _continuations(frame: Frame, pieces: list[_Piece]) -> dict[tuple[int, int], tuple[int, int]]:
    """For ends (piece, 0 or 1) the ends at which they go on, the nearest first."""
    ends = [(i, side) for i, piece in enumerate(pieces) for side in (0, 1) if piece.cut[side]]
    if not ends:
        return {}
    last = [pieces[i].points[-side] for i, side in ends]
    places = np.array([(end["x"], end["y"]) for end in last])
    apart = np.abs(places[:, None] - places)
    if frame.seam is not None:
        width, along = frame.shape[frame.seam], 1 - frame.seam
        apart[..., along] = np.minimum(apart[..., along], np.abs(width - apart[..., along]))
    distance = np.linalg.norm(apart, axis=2)
    kinds = np.array([pieces[i].chain["kind"] for i, _ in ends])
    a, b = np.nonzero(np.triu((distance <= _ENDS) & (kinds[:, None] == kinds), 1))
    others: dict[tuple[int, int], tuple[int, int]] = {}
    for k in np.argsort(distance[a, b], kind="stable"):
        first, second = ends[a[k]], ends[b[k]]
        if first not in others and second not in others:
            others[first], others[second] = second, first
    return others


def _way(start: int, others: dict[tuple[int, int], tuple[int, int]]) -> tuple[list[tuple[int, bool]], bool]:
    """The pieces that go on into each other, each with whether it is walked backwards, and whether they close."""
    way, at = [(start, False)], others.get((start, 1))
    while at is not None and at[0] != start:
        way.append((at[0], at[1] == 1))
        at = others.get((at[0], 1 - at[1]))
    if at is not None:
        return way, True
    at = others.get((start, 0))
    while at is not None:
        way.insert(0, (at[0], at[1] == 0))
        at = others.get((at[0], 1 - at[1]))
    return way, False


def _reversed(points: np.ndarray) -> np.ndarray:
    """A chain the other way round: its left side is now the right one."""
    turned = points[::-1].copy()
    turned["normals"] = turned["normals"][:, ::-1]
    return turned
