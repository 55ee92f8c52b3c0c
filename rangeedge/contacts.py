"""Where regions touch, and how their surfaces lie there: all contacts at once, and sums over those of each border."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import _core
from .frame import Frame

_TILE = 16  # pixels in which a border is taken for straight
_DEVIATIONS = 3.0  # of the noise, within which two surfaces meet
_BLOCK = 1 << 14  # contacts that are compared in one go


@dataclass(frozen=True)
class Borders:
    """The contacts of each pair of regions at which their surfaces meet, and those at which they do not.

    Contacts lie border by border: those of border k from `start[k]` to `start[k + 1]`. Borders are in the order of the
    labels `first` < `second`, that of a jump before that at which the surfaces `meet`.
    """

    first: np.ndarray
    second: np.ndarray
    meet: np.ndarray
    start: np.ndarray
    # Of every contact: its border; its two pixels; by how much the depths of the surfaces differ in its middle; by how
    # much that changes across it; how far apart lines of sight a pixel apart are; the normals of both surfaces.
    border: np.ndarray
    pixels: np.ndarray
    apart: np.ndarray
    change: np.ndarray
    size: np.ndarray
    normals: np.ndarray

    def __len__(self) -> int:
        return len(self.first)

    @property
    def counts(self) -> np.ndarray:
        return np.diff(self.start)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Over the contacts of every border, along the first axis."""
        columns = values.reshape(len(values), -1).T
        sums = np.stack([np.bincount(self.border, column, len(self)) for column in columns], axis=-1)
        return (sums / self.counts[:, None]).reshape(-1, *values.shape[1:])

    def medians(self, values: np.ndarray) -> np.ndarray:
        """The same, NaN where one is NaN."""
        ordered = values[np.lexsort((values, self.border))]
        first, end = self.start[:-1], self.start[1:]
        middle = (ordered[(first + end - 1) // 2] + ordered[(first + end) // 2]) / 2
        return np.where(np.isnan(ordered[end - 1]), np.nan, middle)


def borders_of(frame: Frame, labels: np.ndarray, surfaces: np.ndarray, gap: int, least: int) -> Borders:
    """The borders with at least so many contacts, of labels > 0."""
    pixels = _contacts(labels, gap, frame.seam)
    flat = labels.ravel()
    pair = flat[pixels[0]].astype(np.int64) * len(surfaces) + flat[pixels[1]]
    order = np.argsort(pair, kind="stable")
    order = order[_is_long(pair[order], least)]
    pixels, pair = pixels[:, order], pair[order]
    points = frame.points.reshape(-1, 3)
    apart, change, size = np.empty((3, len(order)))
    meets, normals = np.empty(len(order), bool), np.empty((len(order), 2, 3))
    for first in range(0, len(order), _BLOCK):
        _core.checkpoint()
        here = np.s_[first : first + _BLOCK]
        both = pixels[:, here]
        meets[here], apart[here], change[here], size[here], normals[here] = _compared(
            frame, points, surfaces, flat, both[0], both[1]
        )
    pair = 2 * pair + meets
    order = np.argsort(pair, kind="stable")
    order = order[_is_long(pair[order], least)]
    start = _starts(pair[order])
    names, meet = np.divmod(pair[order[start[:-1]]], 2)
    first, second = np.divmod(names, len(surfaces))
    border = np.repeat(np.arange(len(start) - 1), np.diff(start))
    of_contacts = (values[order] for values in (apart, change, size, normals))
    return Borders(first, second, meet > 0, start, border, pixels[:, order], *of_contacts)


def _starts(values: np.ndarray) -> np.ndarray:
    """Where runs of equal values begin, and the end of the last one."""
    return np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]])[: None if len(values) else 1]


def _is_long(values: np.ndarray, least: int) -> np.ndarray:
    """Whether the run of equal values in which one stands has so many of them."""
    lengths = np.diff(_starts(values))
    return np.repeat(lengths >= least, lengths)


def _contacts(labels: np.ndarray, gap: int, seam: int | None) -> np.ndarray:
    """(2, N): indices of the pixels of every contact, that with the lower label first."""
    pairs = []
    for axis in (1, 0):
        named = labels if axis else labels.T
        count, width = named.shape
        wide = np.concatenate([named, named[:, : gap + 1]], axis=1) if seam == axis else named
        for distance in range(1, min(gap + 1, wide.shape[1] - 1) + 1):
            a = wide[:, :-distance][:, :width]
            b = wide[:, distance : distance + a.shape[1]]
            touching = (a > 0) & (b > 0) & (a != b)
            for k in range(1, distance):
                touching &= wide[:, k : k + a.shape[1]] == 0
            line, place = np.nonzero(touching)
            both = np.stack([place, (place + distance) % width])
            pairs.append(line * width + both if axis else both * count + line)
    found = np.concatenate(pairs, axis=1) if pairs else np.zeros((2, 0), int)
    flat = labels.ravel()
    return np.where(flat[found[0]] > flat[found[1]], found[::-1], found)


def _compared(
    frame: Frame, points: np.ndarray, surfaces: np.ndarray, labels: np.ndarray, i: np.ndarray, j: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Whether surfaces meet at contacts i, j, and what else `Borders` has of them."""
    here = [_planes(surfaces, labels[pixels], points[pixels]) for pixels in (i, j)]
    # From a pixel before the first one of a contact to one after the second.
    places = _sights(frame, points[i]), _sights(frame, points[j])
    step = (places[1] - places[0]) / np.maximum(_distance(frame, i, j), 1)[:, None]
    shares = [places[0] - step, (places[0] + places[1]) / 2, places[1] + step]
    before, middle, after = (_depth(frame, *here[0], place) - _depth(frame, *here[1], place) for place in shares)
    sigma = _DEVIATIONS * np.hypot(*(_sigma(frame, points, pixels) for pixels in (i, j)))
    meets = (before * after <= 0) | (np.abs(middle) <= sigma)
    normals = np.stack([normal for _, normal in here], axis=1)
    return meets, np.abs(middle), after - before, np.linalg.norm(step, axis=1), normals


def lengths(frame: Frame, borders: Borders, directions: np.ndarray) -> np.ndarray:
    """How long borders are in space: along these directions, or across the line of sight where they are NaN.

    In every tile as many pixels as the diagonal of its contacts along rows and columns, each as long as what a pixel
    sees of a line of that direction.
    """
    i, j = borders.pixels
    rows, cols = np.unravel_index(i, frame.shape)
    tiles = rows // _TILE * frame.shape[1] + cols // _TILE
    key = borders.border.astype(np.int64) * (frame.shape[0] * frame.shape[1]) + tiles
    _, first, tile, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    border = borders.border[first]
    along_rows = np.bincount(tile, np.unravel_index(j, frame.shape)[0] == rows)
    pixels = np.hypot(along_rows, count - along_rows)
    points = frame.points.reshape(-1, 3)
    sums = [np.bincount(tile, (points[i, axis] + points[j, axis]) / 2) for axis in range(3)]
    middle, size = np.stack(sums, axis=1) / count[:, None], np.bincount(tile, borders.size) / count
    scale = np.abs(_along(frame, middle)) if frame.projective else np.ones(len(middle))
    ahead = 1e-4 * scale[:, None] * directions[border]
    seen = np.linalg.norm(_sights(frame, middle + ahead) - _sights(frame, middle), axis=1)
    by_direction = np.linalg.norm(ahead, axis=1) / np.maximum(seen, 1e-300)
    scale = np.where(np.isnan(directions[border, 0]), scale, by_direction)
    return np.bincount(border, pixels * size * scale, len(borders))


def _planes(surfaces: np.ndarray, labels: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A point and the normal of the surface of each of these labels for each of these points on it."""
    on, normal = surfaces["centroid"][labels], surfaces["normal"][labels]
    curved = surfaces["curved"][labels]
    if curved.any():
        a, b, c, d, e, f, g, h, k, _ = surfaces["quadric"][labels[curved]].T
        x, y, z = points[curved].T
        parts = (2 * a * x + d * y + e * z + g, d * x + 2 * b * y + f * z + h, e * x + f * y + 2 * c * z + k)
        gradient = np.stack(parts, axis=1)
        on[curved] = points[curved]
        normal[curved] = gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-300)
    return on, normal


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
