"""How good a segmentation is: scores against true regions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import cv2
import numpy as np

from .. import _check
from ..bands import by_bands, counts, numbered
from .counts import Counts, ratio


@dataclass(frozen=True)
class HooverScores(Counts):
    """Numbers of regions by `hooverScores`; they add up over frames, and are reported per frame."""

    frames: int = 0
    truth: int = 0  # true regions
    found: int = 0  # regions of the segmentation
    correct: int = 0  # true regions met by one region
    over: int = 0  # true regions split into several
    under: int = 0  # regions of the segmentation that cover several true ones
    missed: int = 0  # true regions in none of these
    noise: int = 0  # regions of the segmentation in none of these

    @property
    def perFrame(self) -> dict[str, float]:
        """Mean number of every sort per frame, as Hoover's tables print it."""
        return {f.name: ratio(getattr(self, f.name), self.frames) for f in fields(self) if f.name != "frames"}

    @property
    def correctRate(self) -> float:
        """Share of the true regions that is correct."""
        return ratio(self.correct, self.truth)

    def __str__(self) -> str:
        return ", ".join(f"{name} {value:.2f}" for name, value in self.perFrame.items())


@_check.public
def hooverScores(
    labels: np.ndarray, truth: np.ndarray, *, T: float = 0.8, ignore: np.ndarray | None = None
) -> HooverScores:
    """Score a segmentation against true regions after Hoover et al.

    hooverScores(labels, truth, *[, T[, ignore]]) -> scores

    With |m & n| the overlap of region m of the segmentation and true region n,

    - *correct*: m and n share at least T of either;
    - *over*-segmented: true region n of which two or more m, each with at least T of itself in n, cover at least T;
    - *under*-segmented: region m of which two or more n, each with at least T of itself in m, cover at least T;
    - *missed*: true regions, and *noise*: regions of the segmentation, in none of these.

    A region in several of them belongs to the one with the largest mean of its two shares, on a tie to the first.

    Parameters
    ----------
    labels, truth : (H, W) integer arrays
        Region of every pixel, in any numbering; 0 and negative numbers are no region.
    T : float
        The share that counts as covering, above 0.5 and up to 1.
    ignore : (H, W) 8-bit or bool array, optional
        Pixels to leave out (non-zero), such as those without a measurement or without truth.

    Returns
    -------
    HooverScores
        Numbers of regions: ``truth``, ``found``, ``correct``, ``over``, ``under``, ``missed``, ``noise``.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type, shape or range.

    Notes
    -----
    A. Hoover et al., An experimental comparison of range image segmentation algorithms, PAMI 18(7), 1996.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.evaluation import hooverScores
    >>> truth = np.repeat([1, 1, 1, 1, 2, 2, 2, 2], 8).reshape(8, 8)
    >>> labels = np.repeat([1, 1, 5, 5, 7, 7, 7, 7], 8).reshape(8, 8)
    >>> print(hooverScores(labels, truth))
    truth 2.00, found 3.00, correct 1.00, over 1.00, under 0.00, missed 0.00, noise 0.00
    """
    truth = _label_image("truth", truth)
    labels = _label_image("labels", labels, truth.shape)
    T = _check.number("T", T, 0.5, 1.0, above=True)
    if ignore is not None:
        keep = _check.image8("ignore", ignore, truth.shape) == 0
        labels, truth = labels[keep], truth[keep]

    m, n, overlap, found_size, true_size = _overlaps(labels, truth)
    true_share, found_share = overlap / true_size[n], overlap / found_size[m]
    found_map = _Mapping(len(found_size))
    true_map = _Mapping(len(true_size))

    for pair in np.flatnonzero((true_share >= T) & (found_share >= T)):
        measure = (true_share[pair] + found_share[pair]) / 2
        found_map.assign(m[pair], "correct", measure)
        true_map.assign(n[pair], "correct", measure)
    for whole, pairs in _parts(n, found_share >= T):
        parts, covered = m[pairs], overlap[pairs].sum()
        if covered / true_size[whole] >= T:
            measure = (covered / true_size[whole] + covered / found_size[parts].sum()) / 2
            if true_map.accepts(whole, measure):
                true_map.assign(whole, "over", measure)
                found_map.assign(parts, "over", measure)
    for whole, pairs in _parts(m, true_share >= T):
        parts, covered = n[pairs], overlap[pairs].sum()
        if covered / found_size[whole] >= T:
            measure = (covered / true_size[parts].sum() + covered / found_size[whole]) / 2
            if found_map.accepts(whole, measure):
                found_map.assign(whole, "under", measure)
                true_map.assign(parts, "under", measure)

    return HooverScores(
        frames=1,
        truth=len(true_size),
        found=len(found_size),
        correct=true_map.count("correct"),
        over=true_map.count("over"),
        under=found_map.count("under"),
        missed=true_map.count(""),
        noise=found_map.count(""),
    )


class _Mapping:
    """What each region of one image takes part in, and how well."""

    def __init__(self, regions: int) -> None:
        self._role = np.full(regions, "", "<U7")
        self._measure = np.full(regions, -np.inf)

    def accepts(self, region: int, measure: float) -> bool:
        return bool(measure > self._measure[region])

    def assign(self, regions: Any, role: str, measure: float) -> None:
        self._role[regions] = role
        self._measure[regions] = measure

    def count(self, role: str) -> int:
        return int((self._role == role).sum())


def _overlaps(labels: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, ...]:
    """The pairs of a region found and a true one that share pixels, how many, and the sizes of either side."""
    found_ids, found, found_size = _numbered(labels)
    true_ids, true, true_size = _numbered(truth)
    pairs, pair = numbered(by_bands(lambda m, n: m * len(true_ids) + n, found, true))
    overlap = counts(pair, len(pairs))
    m, n = np.divmod(pairs, max(len(true_ids), 1))
    background = [int((ids[:1] == 0).any()) for ids in (found_ids, true_ids)]
    both = (m >= background[0]) & (n >= background[1])
    return (
        m[both] - background[0],
        n[both] - background[1],
        overlap[both],
        found_size[background[0] :],
        true_size[background[1] :],
    )


def _numbered(labels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The labels that there are, ascending, where in that list each pixel is, and how many pixels each has."""
    ids, number = numbered(np.maximum(labels.ravel(), 0))
    return ids, number, counts(number, len(ids))


def _parts(wholes: np.ndarray, inside: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Of the pairs that are inside: every whole that has several, ascending, and these pairs."""
    pairs = np.flatnonzero(inside)
    pairs = pairs[np.argsort(wholes[pairs], kind="stable")]
    ids, start, count = np.unique(wholes[pairs], return_index=True, return_counts=True)
    for k in np.flatnonzero(count > 1):
        yield int(ids[k]), pairs[start[k] : start[k] + count[k]]


def _label_image(name: str, value: Any, shape: tuple[int, int] | None = None) -> np.ndarray:
    expected = "an integer array of shape (H, W)" if shape is None else f"an integer array of shape {shape}"
    value = _check.array(name, value, expected)
    if value.dtype.kind not in "iu":
        raise _check.fail(name, expected, _check.described(value), cv2.Error.StsUnsupportedFormat)
    if shape is not None and value.shape != shape:
        raise _check.fail(name, expected, _check.described(value), cv2.Error.StsUnmatchedSizes)
    return value.astype(np.int64)
