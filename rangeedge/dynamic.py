"""The dynamic threshold: which chains of candidates stand out of the population of all of them."""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np

from .cancellation import apart
from .distance import distanceTransformWithLabels
from .pixels import all_around, beside, components, pixels_of

_CHAIN_ALPHA = 6.0  # Venkatesh and Rosin: how many deviations above the population an edge must stand
_CHAIN_POPULATION = 10  # fewer chains than this have no statistics to speak of
_MAD_TO_MEAN_DEVIATION = 1.4826 * np.sqrt(2 / np.pi)  # of a normal population


def outstanding(strength: np.ndarray, wrap: bool) -> np.ndarray:
    """Where the nearest chain of candidates passes the threshold of Venkatesh and Rosin."""
    candidates = strength > 0
    if not candidates.any():
        return candidates
    chains = _chains(candidates, wrap)
    count, labels = components(chains, wrap)
    _, nearest = distanceTransformWithLabels(chains, wrap=wrap)
    _, owner = np.unique(labels[chains], return_inverse=True)
    length = np.bincount(owner)
    mean = np.bincount(owner, weights=strength[chains]) / length
    keep = np.zeros(count, bool)
    keep[labels[chains]] = _stands_out(length, mean)[owner]
    kept = np.zeros_like(candidates)
    kept[candidates] = keep[labels.ravel()[nearest[candidates]]]
    return kept


def _chains(edges: np.ndarray, wrap: bool) -> np.ndarray:
    """The skeleton of a map, cut at its junctions; what is nothing but junction stays whole."""
    from skimage.morphology import skeletonize

    thin = partial(apart, edges.size, skeletonize)
    skeleton = all_around(edges, thin) if wrap else thin(edges)
    junctions = beside((_branches(skeleton, wrap) > 2).view(np.uint8), wrap)
    # A branch of a junction touches its neighbours diagonally: one pixel more has to go.
    cut = skeleton & ~cv2.dilate(junctions, np.ones((3, 3), np.uint8))[1:-1, 1:-1].view(bool)
    count, labels = components(skeleton, wrap)
    survives = np.zeros(count, bool)
    survives[labels[cut]] = True
    return cut | pixels_of(skeleton, labels, ~survives)


def _branches(skeleton: np.ndarray, wrap: bool) -> np.ndarray:
    """How many branches leave every skeleton pixel: changes from off to on around it."""
    ring = [(-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1)]
    row, col = np.nonzero(skeleton)
    padded = beside(skeleton, wrap)
    around = np.stack([padded[row + 1 + dy, col + 1 + dx] for dy, dx in ring])
    branches = np.zeros(skeleton.shape, np.uint8)
    branches[row, col] = (around & ~np.roll(around, 1, axis=0)).sum(axis=0)
    return branches


def _stands_out(length: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Which chains lie above the line of Venkatesh and Rosin through (0, high) and (long, high - drop)."""
    if len(length) < _CHAIN_POPULATION:
        return np.ones(len(length), bool)
    centre, deviation = _population(mean)
    centre_length, deviation_length = _population(length)
    high = centre + _CHAIN_ALPHA * deviation
    drop = 0.5 * _CHAIN_ALPHA * deviation
    long = centre_length + _CHAIN_ALPHA * deviation_length
    return mean >= high - drop * length / long


def _population(values: np.ndarray) -> tuple[float, float]:
    """Robust centre and mean absolute deviation."""
    centre = np.median(values)
    return centre, _MAD_TO_MEAN_DEVIATION * np.median(np.abs(values - centre))
