"""Connected pixels of a map, whose first column may follow its last."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from .cancellation import apart


def components(mask: np.ndarray, wrap: bool) -> tuple[int, np.ndarray]:
    """The 8-connected components of a bool map: a number above all labels, and labels, 0 outside."""
    count, labels = apart(mask.size, cv2.connectedComponents, mask.view(np.uint8))
    if not wrap:
        return count, labels
    around = beside(labels, wrap)
    last = np.tile(labels[:, -1], 3)
    first = np.concatenate([around[dy : dy + len(labels), -1] for dy in range(3)])
    touching = (last > 0) & (first > 0)
    return count, joined(count, last[touching], first[touching])[labels]


def joined(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The least label of what such pairs of labels join, for every label."""
    least = np.arange(count, dtype=np.int32)
    while (least[first] != least[second]).any():
        both = np.minimum(least[first], least[second])
        np.minimum.at(least, least[first], both)
        np.minimum.at(least, least[second], both)
        least = least[least]
    return least


def beside(values: np.ndarray, wrap: bool) -> np.ndarray:
    """A map with a margin of one pixel, all 0, or beside its first column the last and the other way round."""
    padded = np.pad(values, 1)
    if wrap:
        padded[:, 0], padded[:, -1] = padded[:, -2], padded[:, 1]
    return padded


def all_around(values: np.ndarray, function: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """What a function of small neighbourhoods makes of a map that wraps: of one that goes on beyond either side."""
    width = values.shape[1]
    margin = max(values.shape)
    wide = values[:, np.arange(-margin, width + margin) % width]
    return np.ascontiguousarray(function(np.ascontiguousarray(wide))[:, margin : margin + width])


def pixels_of(edges: np.ndarray, labels: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """The pixels of `edges` whose label is one to keep; only edge pixels are looked up."""
    kept = np.zeros_like(edges)
    kept[edges] = keep[labels[edges]]
    return kept
