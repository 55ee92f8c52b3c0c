"""Closing the gaps of an edge map, as far as surfaces demand it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import _core
from ._check import deliver, image8
from ._option import parsed, takes
from .frame import Frame
from .noise import measured_frame
from .options import CLOSING, Closing, Growing, ScanLineParams
from .regions import seeded_regions
from .sectors import sectors_of
from .surfaces import surface_map

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import ClosingOptions

_SMOOTH_ANGLE = 5.0  # degrees below which surfaces that meet without an edge go on into each other


@takes(CLOSING)
def closeContours(
    edges: np.ndarray,
    src: np.ndarray,
    *,
    mask: np.ndarray | None = None,
    dst: np.ndarray | None = None,
    **options: Unpack[ClosingOptions],
) -> np.ndarray:
    """Close gaps between edges along the lines where surfaces meet or part.

    closeContours(edges, src, *[, mask[, dst[, K[, ...]]]]) -> dst

    Regions grow between the edges as in `segmentRegions`, under a smaller `smoothAngle`. Where edges have gaps, regions
    of two surfaces are open to each other, and there a line is drawn: along their intersection where one surface passes
    through the other, else where the pixels of one end and those of the other begin, whichever way the edges on both
    sides of the gap point. A region counts if at least `share` of its pixels lie within `tolerance` standard deviations
    of its plane or quadratic: those of the noise, or of most regions where these tell of more. No line is drawn between
    regions of one surface, and none that is longer than `maxGap`. In the end the 4-connected components of what is no
    edge are the surfaces.

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

    Notes
    -----
    The paper names closing (section 7) without describing it. That regions are hypotheses which surfaces verify is the
    idea of X. Jiang, An adaptive contour closure algorithm and its experimental evaluation, PAMI 22(11), 2000, which
    dilates edges until it is so; the lines between surfaces are ours.

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
    regions = seeded_regions(frame, edges, Growing(minArea=closing.minArea, smoothAngle=_SMOOTH_ANGLE))[1]
    kernel_options = _core.ClosureOptions(
        correlation=frame.correlation,
        tolerance=closing.tolerance,
        share=closing.share,
        max_gap=closing.maxGap,
        min_area=closing.minArea,
    )
    lines = np.empty(frame.shape, np.uint8)
    _core.close_contours(surface_map(frame, edges), regions, kernel_options, frame.threads, lines)
    return ((edges != 0) | (lines != 0)).view(np.uint8) * np.uint8(255)
