"""Closing the gaps of an edge map, as far as surfaces demand it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._check import deliver, image8
from ._option import parsed, takes
from .frame import Frame
from .noise import measured_frame
from .options import CLOSING, Closing, ScanLineParams
from .sectors import sectors_of
from .surfaces import surface_map

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import ClosingOptions


@takes(CLOSING)
def closeContours(
    edges: np.ndarray,
    src: np.ndarray,
    *,
    mask: np.ndarray | None = None,
    dst: np.ndarray | None = None,
    **options: Unpack[ClosingOptions],
) -> np.ndarray:
    """Close gaps between edges where what they enclose is no single surface.

    closeContours(edges, src, *[, mask[, dst[, K[, ...]]]]) -> dst

    The 4-connected components of what is no edge are hypotheses of regions. One is verified where a plane, or a
    quadratic that two planes do not beat, leaves at most ``1 - share`` of its pixels farther off than `tolerance`
    standard deviations. Inside every other one the edges are dilated by a pixel, and its parts are hypotheses again: so
    gaps are closed by as much as it takes, region by region, while good regions keep their edges as they are. In the
    end verified regions grow back over what dilation took, and where two of them meet there is a new edge.

    Parameters
    ----------
    edges : (H, W) CV_8U or bool
        Edge map, non-zero on edges.
    src : ndarray
        Range image, as for `edgeStrength`. Pixels without data bound regions as edges do.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    {options}
    dst : (H, W) CV_8U, optional
        Receives the result where shape and type fit.

    Returns
    -------
    dst : (H, W) CV_8U
        255 on the given edges and the new ones, 0 elsewhere.

    Raises
    ------
    rangeedge.error
        If an argument has a wrong type, shape or range.

    References
    ----------
    X. Jiang, An adaptive contour closure algorithm and its experimental evaluation, PAMI 22(11), 2000. It verifies
    planes only; the quadratics, and the test against two planes, are ours.

    Examples
    --------
    Two planes, and an edge between them with a gap:

    >>> import cv2
    >>> import numpy as np
    >>> from rangeedge import closeContours
    >>> x = np.arange(60)
    >>> depth = np.tile(np.abs(x - 30) / 20.0, (60, 1))
    >>> edges = np.zeros((60, 60), np.uint8)
    >>> edges[:25, 30] = edges[35:, 30] = 255
    >>> closed = closeContours(edges, depth, noise=0.01)
    >>> [cv2.connectedComponents(255 - e, connectivity=4)[0] - 1 for e in (edges, closed)]
    [1, 2]
    """
    params, closing = parsed(options, ScanLineParams, Closing)
    frame = measured_frame(src, params, mask)
    edges = image8("edges", edges, frame.shape)
    return deliver("dst", _closed(frame, edges, closing), dst)


def _closed(frame: Frame, edges: np.ndarray, closing: Closing) -> np.ndarray:
    parts = sectors_of(frame)
    if parts:
        whole = np.empty(frame.shape, np.uint8)
        for part in parts:
            part.put(whole, _closed(part.frame, part.take(edges), closing))
        return whole
    kernel_options = _core.ClosureOptions(
        correlation=frame.correlation,
        tolerance=closing.tolerance,
        share=closing.share,
        dilations=(closing.maxGap + 1) // 2,
        min_area=closing.minArea,
    )
    regions = np.empty(frame.shape, np.int32)
    _core.verified_regions(surface_map(frame, edges), kernel_options, frame.threads, regions)
    return ((edges != 0) | _meetings(regions)).view(np.uint8) * np.uint8(255)


def _meetings(regions: np.ndarray) -> np.ndarray:
    """Pixels left of or above one of another region."""
    met = np.zeros(regions.shape, bool)
    for here, there, at in (
        (regions[:, :-1], regions[:, 1:], met[:, :-1]),
        (regions[:-1], regions[1:], met[:-1]),
    ):
        at |= (here != there) & (here > 0) & (there > 0)
    return met
