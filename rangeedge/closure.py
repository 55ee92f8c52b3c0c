"""Closing the gaps of an edge map, as far as surfaces demand it."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core
from ._args import deliver, image8, integer, number
from .geometry import range_frame
from .noise import kernel_noise
from .surfaces import surface_map


def closeContours(
    edges: np.ndarray,
    src: np.ndarray,
    *,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    tolerance: float = 3.0,
    share: float = 0.9,
    maxGap: int = 40,
    minArea: int = 50,
    dst: np.ndarray | None = None,
) -> np.ndarray:
    """Close gaps between edges where what they enclose is no single surface.

    closeContours(edges, src, *[, K[, pixelSize[, heightMap[, depthFactor[, mask[, noise[, tolerance[, share[, maxGap
    [, minArea[, dst]]]]]]]]]]]) -> dst

    The 4-connected components of what is no edge are hypotheses of regions. One is verified where a plane, or a
    quadratic that two planes do not beat, leaves at most ``1 - share`` of its pixels farther off than `tolerance`
    standard deviations. Inside every other one the edges are dilated by a pixel, and its parts are hypotheses again: so
    gaps are closed by as much as it takes, region by region, while good regions keep their edges as they are. In the
    end verified regions grow back over what dilation took, and where two of them meet there is a new edge.

    Parameters
    ----------
    edges : (H, W) CV_8U or bool
        Edge map, non-zero on edges.
    src, K, pixelSize, heightMap, depthFactor, mask
        Range image and its geometry, as for `edgeStrength`. Pixels without data bound regions as edges do.
    noise : NoiseModel, float or (H, W) array, optional
        Noise of the range image; estimated from it by default.
    tolerance : float
        How far a pixel may lie off its surface, in standard deviations.
    share : float
        Share of the pixels of a surface that must lie within `tolerance`, in (0, 1].
    maxGap : int
        Widest gap to close, in pixels: edges are dilated by at most half of it.
    minArea : int
        Components of fewer pixels are no hypotheses; no edge is drawn for them.
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

    >>> x = np.arange(60)
    >>> depth = np.tile(np.abs(x - 30) / 20.0, (60, 1))
    >>> edges = np.zeros((60, 60), np.uint8)
    >>> edges[:25, 30] = edges[35:, 30] = 255
    >>> closed = closeContours(edges, depth, noise=0.01)
    >>> [cv2.connectedComponents(255 - e, connectivity=4)[0] - 1 for e in (edges, closed)]
    [1, 2]
    """
    func = "closeContours"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    edges = image8(func, "edges", edges, frame.shape)
    tolerance = number(func, "tolerance", tolerance, 0, above=True)
    share = number(func, "share", share, 0, 1, above=True)
    maxGap = integer(func, "maxGap", maxGap, 0)
    minArea = integer(func, "minArea", minArea, 1)
    deviations = kernel_noise(func, noise, frame)
    options = _core.ClosureOptions(
        correlation=deviations.correlation,
        tolerance=tolerance,
        share=share,
        dilations=(maxGap + 1) // 2,
        min_area=minArea,
    )
    regions = np.empty(frame.shape, np.int32)
    _core.verified_regions(surface_map(frame, deviations, edges), options, regions)
    closed = ((edges != 0) | _meetings(regions)).view(np.uint8) * np.uint8(255)
    return deliver(func, "dst", closed, dst)


def _meetings(regions: np.ndarray) -> np.ndarray:
    """Pixels left of or above one of another region."""
    met = np.zeros(regions.shape, bool)
    for here, there, at in (
        (regions[:, :-1], regions[:, 1:], met[:, :-1]),
        (regions[:-1], regions[1:], met[:-1]),
    ):
        at |= (here != there) & (here > 0) & (there > 0)
    return met
