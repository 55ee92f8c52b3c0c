"""Regions in colours of their own, after Tol: for the usual forms of colour blindness."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING

import cv2
import numpy as np

from .. import _check
from .._option import takes
from ..bands import bands, by_bands, chosen, numbered
from ..options import GEOMETRY
from .relief import backdrop, nearest

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .._typed import GeometryOptions

_SIZE, _INK, _HALO = 0.45, (255, 255, 255), (0, 0, 0)  # of numbers
REGION_COLOURS = np.array(  # Tol's muted scheme
    [
        (238, 204, 136), (119, 102, 204), (119, 204, 221), (51, 119, 17), (136, 34, 51),
        (153, 68, 170), (153, 170, 68), (51, 153, 153), (85, 34, 136),
    ],
    np.uint8,
)  # fmt: skip


@takes(GEOMETRY)
def drawRegions(
    labels: np.ndarray,
    src: np.ndarray | None = None,
    alpha: float = 0.6,
    dst: np.ndarray | None = None,
    **geometry: Unpack[GeometryOptions],
) -> np.ndarray:
    """Draw every region in a colour of its own among its neighbours.

    drawRegions(labels[, src[, alpha[, dst]]], *[, K[, ...]]) -> dst

    Nine colours are shared out so that regions next to each other, or across a gap without label, differ.

    Parameters
    ----------
    labels : ndarray of shape (H, W), CV_32S
        Region of every pixel; 0 and negative values are none.
    src : ndarray, optional
        Range image, points, or CV_8UC3 picture to draw on; black without it.
    alpha : float
        Opacity of the regions over `src`, in [0, 1]. Without `src` they are opaque.
    dst : ndarray of shape (H, W, 3), CV_8U, optional
        Receives the result where shape and type fit.
    {options}

    Returns
    -------
    dst : ndarray of shape (H, W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If an image has a wrong type or shape, shapes differ, or `alpha` is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawRegions
    >>> drawRegions(np.int32([[0, 1, 2, 1]]))[0]
    array([[  0,   0,   0],
           [238, 204, 136],
           [119, 102, 204],
           [238, 204, 136]], dtype=uint8)
    """
    labels = _check.labels32s("labels", labels, listed=True)
    alpha = _check.number("alpha", alpha, 0, 1)
    if src is None:
        canvas, alpha = np.zeros((*labels.shape, 3), np.uint8), 1.0
    else:
        canvas = backdrop(src, geometry, labels.shape)
    inside = labels > 0
    if inside.any():
        choice = _region_colours(labels, inside)
        for rows in bands(canvas):
            own, here = canvas[rows], inside[rows]
            colours = REGION_COLOURS[choice[labels[rows][here]]]
            own[here] = np.rint(alpha * colours + (1 - alpha) * own[here])
    return _check.deliver("dst", canvas, dst)


def write_numbers(picture: np.ndarray, labels: np.ndarray) -> int:
    """Write the label of every region where it is widest, if there is room; the result is for how many there is."""
    count = 0
    scale = picture.shape[1] / labels.shape[1]
    for label, (row, col), room in _middles(labels):
        text = str(label)
        (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, _SIZE, 1)
        if 2 * room * scale < max(width, height):
            continue
        count += 1
        place = (int((col + 0.5) * scale - width / 2), int((row + 0.5) * scale + height / 2))
        for colour, thickness in ((_HALO, 3), (_INK, 1)):
            cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, _SIZE, colour, thickness, cv2.LINE_AA)
    return count


def _middles(labels: np.ndarray) -> Iterator[tuple[int, tuple[int, int], float]]:
    """Of every region with an inside the label, the pixel farthest from its border, and how far that is."""
    framed = np.pad(labels, 1)
    inside = labels > 0
    for row, col in ((0, 1), (2, 1), (1, 0), (1, 2)):
        inside &= framed[row : row + labels.shape[0], col : col + labels.shape[1]] == labels
    room = cv2.distanceTransform(np.pad(inside.view(np.uint8), 1), cv2.DIST_L2, cv2.DIST_MASK_5)[1:-1, 1:-1] + 1
    peaks = np.flatnonzero((room == cv2.dilate(room, np.ones((3, 3), np.uint8))) & (labels > 0))
    peaks = peaks[np.argsort(-room.flat[peaks], kind="stable")]
    names, first = np.unique(labels.flat[peaks], return_index=True)
    for label, place in zip(names.tolist(), peaks[first].tolist(), strict=True):
        yield label, divmod(place, labels.shape[1]), float(room.flat[place])


def _region_colours(labels: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The number of the colour of every label > 0."""
    inner = np.concatenate(list(chosen(labels, inside)))
    names, region = numbered(inner)
    neighbours = _neighbours(by_bands(lambda number: region[number], nearest(inside)))
    choice = np.zeros(names[-1] + 1, np.intp)
    choice[names] = shared_out(names, neighbours)
    return choice


def _neighbours(region: np.ndarray) -> dict[int, set[int]]:
    """Which regions touch, 8-connected, in a map that regions fill."""
    neighbours = defaultdict(set)
    count = int(region.max()) + 1
    for rows in bands(region):
        own = region[rows.start : rows.stop + 1]  # and the first row below
        for a, b in (
            (own[:, 1:], own[:, :-1]),
            (own[1:], own[:-1]),
            (own[1:, 1:], own[:-1, :-1]),
            (own[1:, :-1], own[:-1, 1:]),
        ):
            differ = a != b
            pairs = np.unique(a[differ] * count + b[differ])
            for i, j in zip(*(part.tolist() for part in np.divmod(pairs, count)), strict=True):
                neighbours[i].add(j)
                neighbours[j].add(i)
    return neighbours


def shared_out(names: np.ndarray, neighbours: dict[int, set[int]]) -> np.ndarray:
    """Colour number of each region: its own by label, or else the next that no coloured neighbour has."""
    choice = np.empty(len(names), np.intp)
    for i, name in enumerate(names.tolist()):
        taken = {choice[j] for j in neighbours[i] if j < i}
        own = [(name - 1 + k) % len(REGION_COLOURS) for k in range(len(REGION_COLOURS))]
        choice[i] = next((c for c in own if c not in taken), own[0])
    return choice
