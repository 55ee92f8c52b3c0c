"""Blocks of an image with what overlaps them, and labels that are joined across their seams."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ..io.tiff import Window


@dataclass(frozen=True)
class Grid:
    """An image divided into blocks of `size` pixels; the last ones may be smaller."""

    shape: tuple[int, int]
    size: int

    @property
    def counts(self) -> tuple[int, int]:
        """Rows and columns of blocks."""
        return -(-self.shape[0] // self.size), -(-self.shape[1] // self.size)

    def __len__(self) -> int:
        return self.counts[0] * self.counts[1]

    def place(self, index: int) -> tuple[int, int]:
        """Row and column of a block."""
        return divmod(index, self.counts[1])

    def window(self, index: int, overlap: int = 0) -> Window:
        """The pixels of a block, and as many around it as there are."""
        row, col = self.place(index)
        rows, cols = self.shape
        top, left = row * self.size, col * self.size
        return (
            max(0, top - overlap),
            max(0, left - overlap),
            min(rows, min(rows, top + self.size) + overlap),
            min(cols, min(cols, left + self.size) + overlap),
        )

    def beyond(self, index: int, width: int) -> Iterator[tuple[int, Window]]:
        """The strips of the blocks to the right and below that lie at the seams, with the blocks that they are of."""
        row, col = self.place(index)
        top, left, bottom, right = self.window(index)
        if col + 1 < self.counts[1]:
            yield index + 1, (top, right, bottom, min(right + width, self.shape[1]))
        if row + 1 < self.counts[0]:
            yield index + self.counts[1], (bottom, left, min(bottom + width, self.shape[0]), right)


def inside(values: np.ndarray, window: Window, around: Window) -> np.ndarray:
    """The values of a window, of those of a larger one."""
    top, left, bottom, right = window
    above, before = around[:2]
    return values[top - above : bottom - above, left - before : right - before]


def clearance(window: Window, around: Window, shape: tuple[int, int]) -> np.ndarray:
    """How far the nearest pixel is that a larger window has not seen, for every pixel of a window; inf where all are.

    As a column and a row, of which the smaller value holds.
    """
    top, left, bottom, right = window
    above, before, below, behind = around
    y, x = np.arange(top, bottom), np.arange(left, right)
    rows = np.minimum(y - above + 1 if above > 0 else np.inf, below - y if below < shape[0] else np.inf)
    cols = np.minimum(x - before + 1 if before > 0 else np.inf, behind - x if behind < shape[1] else np.inf)
    return np.minimum(np.broadcast_to(rows, len(y))[:, None], np.broadcast_to(cols, len(x)))


def matches(ones: np.ndarray, others: np.ndarray, share: float = 0.5) -> list[tuple[int, int]]:
    """Labels that mean the same, of one strip labelled twice: they share half of the smaller of both areas."""
    both = (ones > 0) & (others > 0)
    pairs, counts = np.unique(np.stack([ones[both], others[both]]), axis=1, return_counts=True)
    area, other_area = np.bincount(ones.ravel()), np.bincount(others.ravel())
    least = np.minimum(area[pairs[0]], other_area[pairs[1]])
    one, other = pairs[:, counts >= share * least]
    return list(zip(one.tolist(), other.tolist(), strict=True))


def joined(total: int, pairs: Iterable[tuple[int, int]]) -> np.ndarray:
    """New labels 1, 2, ... of the labels 1 to `total`, the same for those that pairs connect; 0 stays."""
    parent = list(range(total + 1))

    def root(label: int) -> int:
        while parent[label] != label:
            parent[label] = parent[parent[label]]
            label = parent[label]
        return label

    for one, other in pairs:
        a, b = sorted((root(one), root(other)))
        parent[b] = a
    roots = np.array([root(label) for label in range(total + 1)])
    return np.unique(roots, return_inverse=True)[1].astype(np.int32)
