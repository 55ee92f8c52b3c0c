"""Large arrays a part at a time: steps of NumPy that are short enough for calls to be given up between them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from . import _core

_SIZE = 1 << 20  # values of a part, which take some milliseconds
_SPARSE = 4  # places in a table for one value, beyond which there is none


def bands(values: np.ndarray) -> Iterator[slice]:
    """Rows of an array, some at a time."""
    count = max(1, _SIZE * len(values) // max(values.size, 1))
    return (slice(first, min(first + count, len(values))) for first in range(0, len(values), count))


def by_bands(function: Callable[..., np.ndarray], *maps: np.ndarray | None, halo: int = 0) -> np.ndarray:
    """What a function makes of every row of maps alone, or of it and `halo` rows around it; None is passed on."""
    largest = max((values for values in maps if values is not None), key=np.size)
    height = len(largest)
    whole: np.ndarray | None = None
    for rows in bands(largest):
        start, stop = max(0, rows.start - halo), min(height, rows.stop + halo)
        own = function(*(values if values is None else values[start:stop] for values in maps))
        own = own[rows.start - start : rows.stop - start]
        if whole is None:
            whole = np.empty((height, *own.shape[1:]), own.dtype)
        whole[rows] = own
    return function(*maps) if whole is None else whole


def chosen(values: np.ndarray, where: np.ndarray) -> Iterator[np.ndarray]:
    """The values of the pixels that a bool map says, some rows at a time."""
    return (values[rows][where[rows]] for rows in bands(values))


def distinct(values: np.ndarray) -> np.ndarray:
    """The different integers of an array, ascending."""
    if not values.size:
        return np.zeros(0, values.dtype)
    low, high = int(values.min()), int(values.max())
    if high - low > _SPARSE * values.size:
        return np.unique(np.concatenate([np.unique(values[rows]) for rows in bands(values)]))
    found = np.zeros(high - low + 1, bool)
    for rows in bands(values):
        found[values[rows] - low] = True
    return (np.flatnonzero(found) + low).astype(values.dtype)


def numbered(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The different integers of an array, ascending, and which of these each is."""
    names = distinct(values)
    low, span = (int(names[0]), int(names[-1]) - int(names[0]) + 1) if len(names) else (0, 0)
    if span > _SPARSE * values.size:
        return names, by_bands(lambda own: np.searchsorted(names, own), values)
    rank = np.zeros(span, np.intp)
    rank[names - low] = np.arange(len(names))
    return names, by_bands(lambda own: rank[own - low], values)


def counts(numbers: np.ndarray, end: int) -> np.ndarray:
    """How often each of the numbers from 0 to `end` - 1 occurs."""
    total = np.zeros(end, np.intp)
    for rows in bands(numbers):
        own = np.bincount(numbers[rows].ravel())
        total[: len(own)] += own
    return total


def quantiles(values: np.ndarray, *shares: float) -> list[float]:
    """What so large a share of all floats that are no NaN is below, as from `np.nanquantile`; NaN where there is none.

    Shares ascend.
    """
    flat = np.ascontiguousarray(values).ravel()
    found = np.empty((len(shares), 2), values.dtype)
    count = _core.ranked(flat, np.array(shares), found)
    if not count:
        return [np.nan] * len(shares)
    places = np.array(shares) * (count - 1)
    return [np.quantile(pair.astype(float), place) for pair, place in zip(found, places % 1, strict=True)]
