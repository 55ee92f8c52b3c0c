"""Edges of images that look all around: of overlapping sectors, in each of which rays have an axis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .bands import by_bands, chosen
from .viewpoint import mean_ray, unit_rays

if TYPE_CHECKING:
    from .frame import Frame

_WIDEST = np.deg2rad(150)  # image that needs no sectors
_MOST = np.deg2rad(720)  # beyond which rays are in no order at all
_SECTOR = np.deg2rad(90)
_MARGIN = np.deg2rad(30)  # that a sector overlaps its neighbours, so that surfaces go on beyond its end
_CLOSED = np.deg2rad(300)  # from which on first and last line may be neighbours
_SAMPLED = 64  # pixels of a line, about so many of which tell how far it is from the next
_NEIGHBOURS = 2.5  # steps between lines, up to which they are


class Turn(NamedTuple):
    """How far an image looks around: by `extent` across its lines along `axis`; `closed` where these come together."""

    axis: int
    extent: float
    closed: bool


class Sector(NamedTuple):
    """A part of a frame: its lines `first` to `end` are those of the whole from `start` on."""

    frame: Frame
    axis: int
    first: int
    end: int
    start: int

    def own(self, values: np.ndarray) -> np.ndarray:
        """What belongs to this sector alone, of values of its pixels."""
        return values[:, self.first : self.end] if self.axis else values[self.first : self.end]

    def put(self, whole: np.ndarray, values: np.ndarray) -> None:
        """Write that into values of all pixels."""
        stop = self.start + self.end - self.first
        part = whole[:, self.start : stop] if self.axis else whole[self.start : stop]
        part[...] = self.own(values)

    def points(self, points: np.ndarray) -> np.ndarray:
        """Edge points between its lines, in the pixels of the whole."""
        name = "x" if self.axis else "y"
        own = points[(points[name] >= self.first - 0.5) & (points[name] < self.end - 0.5)]
        own[name] += self.start - self.first
        return own

    def take(self, values: np.ndarray) -> np.ndarray:
        """Values of all pixels at those of this sector."""
        return np.take(values, self.lines(values.shape[self.axis]), self.axis)

    def spread(self, whole: np.ndarray, values: np.ndarray) -> None:
        """Write values of its pixels into those of all pixels, also where other sectors see them."""
        lines = self.lines(whole.shape[self.axis])
        whole[(slice(None), lines) if self.axis else lines] = values

    def lines(self, count: int) -> np.ndarray:
        """Which of the `count` lines of the whole its own are."""
        return (np.arange(self.frame.shape[self.axis]) + self.start - self.first) % count


def turn_of(samples: np.ndarray) -> Turn | None:
    """How far points look around, where their rays are too far apart for one axis."""
    rays = by_bands(lambda own: unit_rays(own.astype(np.float64)), samples)
    steps = [_steps(rays, axis) for axis in (0, 1)]
    axis = int(steps[1].sum() > steps[0].sum())
    extent = float(steps[axis].sum())
    return Turn(axis, extent, _is_closed(rays, axis, steps[axis])) if _WIDEST < extent <= _MOST else None


def sectors_of(frame: Frame) -> list[Sector]:
    """The sectors of an image whose rays are too far apart for one axis; none where they are not."""
    return list(_divided(frame, frame.turn)) if frame.turn else []


def around(frame: Frame, function: Callable[..., np.ndarray], *maps: np.ndarray) -> np.ndarray:
    """What a function makes of maps of the frame, which takes by `wrap` whether their rows wrap."""
    if frame.seam == 0:
        turned = [np.ascontiguousarray(values.T) for values in maps]
        return np.ascontiguousarray(function(*turned, wrap=True).T)
    return function(*maps, wrap=frame.seam is not None)


def _steps(rays: np.ndarray, axis: int) -> np.ndarray:
    """Angles between neighbouring lines across an axis, typical of their pixels; of all lines where one has no data."""
    lines = np.moveaxis(rays, axis, 0)
    lines = lines[:, :: max(1, lines.shape[1] // _SAMPLED)]
    angles = np.sort(2 * np.arcsin(np.minimum(1, np.linalg.norm(np.diff(lines, axis=0), axis=2) / 2)), axis=1)
    seen = np.isfinite(angles).sum(axis=1)  # NaN come last
    middle = angles[np.arange(len(angles)), np.maximum(seen - 1, 0) // 2]
    return np.where(seen > 0, middle, np.median(middle[seen > 0]) if seen.any() else 0.0)


def _middles(rays: np.ndarray, axis: int) -> np.ndarray:
    seen = np.isfinite(rays[..., 0])
    sums = np.where(seen[..., None], rays, 0).sum(axis=1 - axis)
    counts = seen.sum(axis=1 - axis)
    with np.errstate(invalid="ignore", divide="ignore"):
        sums[counts == 0] = np.nan
        return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def _angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))


def _is_closed(rays: np.ndarray, axis: int, steps: np.ndarray) -> bool:
    """Whether first and last line are neighbours."""
    middles = _middles(rays, axis)
    seen = middles[np.isfinite(middles[:, 0])]
    return bool(steps.sum() > _CLOSED and _angles(seen[-1:], seen[:1])[0] <= _NEIGHBOURS * np.median(steps))


def _divided(frame: Frame, turn: Turn) -> Iterator[Sector]:
    axis, extent, closed = turn
    count = frame.shape[axis]
    parts = min(int(np.ceil(extent / _SECTOR)), count)
    margin = int(count * _MARGIN / extent)
    bounds = np.linspace(0, count, parts + 1).astype(int)
    for start, stop in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        lines = np.arange(start - margin, stop + margin)
        lines = lines % count if closed else lines[(lines >= 0) & (lines < count)]
        samples = np.take(frame.samples, lines, axis)
        noise = np.take(frame.noise, lines, axis) if isinstance(frame.noise, np.ndarray) else frame.noise
        seen = [own.astype(np.float64) for own in chosen(samples, np.isfinite(samples[..., 0])) if len(own)]
        part = replace(frame, samples=samples, noise=noise, axis=mean_ray(seen) if seen else frame.axis)
        first = margin if closed else start - int(lines[0])
        yield Sector(part, axis, first, first + stop - start, start)
