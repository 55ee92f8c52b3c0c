"""From edge strengths to an edge map: grey-level pictures of strength, thresholds and what refines them."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, overload

import cv2
import numpy as np

from . import _check, _core
from ._check import public
from ._option import takes
from .constants import EDGE_BOUNDARY
from .dynamic import outstanding
from .edges import EdgeStrength
from .frame import threads_worth
from .options import SELECTION, Selection
from .pixels import components, pixels_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import RefinementOptions


@public
def strengthImage(strength: np.ndarray, cut: float, dst: np.ndarray | None = None) -> np.ndarray:
    """Map edge strengths to grey levels, saturating at a cut value.

    strengthImage(strength, cut[, dst]) -> dst

    dst = min(255, ceil(255 * strength / cut)): 0 only where there is no edge, 255 from `cut` on.

    Parameters
    ----------
    strength : ndarray of shape (H, W), CV_32F or any real type
        Edge strength, finite and >= 0; 0 where there is no edge. Jump in units of length or crease in degrees.
    cut : float
        Strength that maps to 255, > 0. The paper uses 64 degrees for crease edges.
    dst : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit.

    Returns
    -------
    dst : ndarray of shape (H, W), CV_8U

    Raises
    ------
    rangeedge.error
        If `strength` is not a real (H, W) image or holds a negative or non-finite value, or if `cut` is not
        a finite number > 0.

    Notes
    -----
    Paper, 6. Level 80 of a crease image is 20 degrees, level 120 is 30 degrees.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import strengthImage
    >>> strengthImage(np.float32([[0, 0.1, 20, 30, 64, 90]]), 64)
    array([[  0,   1,  80, 120, 255, 255]], dtype=uint8)
    """
    strength = _check.strength32f("strength", strength)
    cut = _check.number("cut", cut, 0, above=True)
    return _check.deliver("dst", _grey_levels(strength, cut), dst)


@public
def overallStrength(
    jump: np.ndarray, crease: np.ndarray, jumpCut: float, creaseCut: float = 64.0, dst: np.ndarray | None = None
) -> np.ndarray:
    """Merge jump and crease strengths into one grey-level image.

    overallStrength(jump, crease, jumpCut[, creaseCut[, dst]]) -> dst

    dst = max(strengthImage(jump, jumpCut), strengthImage(crease, creaseCut)), so both kinds of edge share
    one scale: what `salienceDistanceTransform` takes as salience.

    Parameters
    ----------
    jump, crease : ndarray of shape (H, W), CV_32F or any real type
        Edge strengths, finite and >= 0; 0 where there is no edge.
    jumpCut, creaseCut : float
        Strengths that map to 255, > 0: a length, and an angle in degrees.
    dst : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit.

    Returns
    -------
    dst : ndarray of shape (H, W), CV_8U

    Raises
    ------
    rangeedge.error
        If an image is not a real (H, W) image of finite values >= 0, if their shapes differ, or if a cut is
        not a finite number > 0.

    Notes
    -----
    Paper, 6.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import overallStrength
    >>> overallStrength(np.float32([[0, 0.5, 2]]), np.float32([[0, 64, 32]]), jumpCut=1)
    array([[  0, 255, 255]], dtype=uint8)
    """
    jump = _check.strength32f("jump", jump)
    crease = _check.strength32f("crease", crease, jump.shape)
    jumpCut = _check.number("jumpCut", jumpCut, 0, above=True)
    creaseCut = _check.number("creaseCut", creaseCut, 0, above=True)
    merged = cv2.max(_grey_levels(jump, jumpCut), _grey_levels(crease, creaseCut))
    return _check.deliver("dst", merged, dst)


@overload
def selectEdges(
    strength: EdgeStrength,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    *,
    wrap: bool = False,
    dst: np.ndarray | None = None,
    **options: Unpack[RefinementOptions],
) -> np.ndarray: ...


@overload
def selectEdges(
    jump: np.ndarray,
    crease: np.ndarray,
    jumpThreshold: float,
    creaseThreshold: float = 30.0,
    *,
    wrap: bool = False,
    dst: np.ndarray | None = None,
    **options: Unpack[RefinementOptions],
) -> np.ndarray: ...


@public
def selectEdges(*args: Any, **options: Any) -> np.ndarray:
    """Select edge pixels by strength, by connection to strong ones, by length and by chain statistics.

    selectEdges(strength[, jumpThreshold[, creaseThreshold]], *[, wrap[, dst[, hysteresis[, ...]]]]) -> dst
    selectEdges(jump, crease, jumpThreshold[, creaseThreshold], *[, wrap[, dst[, hysteresis[, ...]]]]) -> dst

    With what `edgeStrength` returns, this is the selection of `detectEdges` with its defaults, so that
    ``thinEdges(selectEdges(strength, ...))`` is the same map: jumps count on their nearer side, and creases where
    three of their neighbours are creases as well, lest lines fray; of a scan all around with ``wrap=True`` for both.
    With maps of jump and crease every pixel counts.

    The steps run in this order, each on what the one before has left:

    1. *Thresholds*: a pixel is an edge where jump >= jumpThreshold or crease >= creaseThreshold, and that
       strength is positive.
    2. *Hysteresis*, for `hysteresis` < 1: pixels above `hysteresis` times a threshold are added where their
       8-connected component holds a pixel above the full one.
    3. *Length*, for `minLength` > 1: 8-connected components shorter than that are removed.
    4. *Dynamic threshold*, if `dynamic`: chains that do not stand out of the population of all candidate
       chains are removed, as below.

    Parameters
    ----------
    strength : EdgeStrength
        As from `edgeStrength`.
    jump : ndarray of shape (H, W), CV_32F or any real type
        Jump strength, a length; finite and >= 0, 0 where there is no edge.
    crease : ndarray of shape (H, W), CV_32F or any real type
        Crease strength in degrees; finite and >= 0, 0 where there is no edge.
    jumpThreshold : float
        Least jump, in the unit of `jump`. With 0 every jump counts, as with None (for `strength`, the default);
        ``numpy.inf`` switches jump edges off.
    creaseThreshold : float
        Least crease in degrees; 0 and ``numpy.inf`` as above.
    hysteresis : float
        Low thresholds as a fraction of the high ones, in (0, 1]; 1 is no hysteresis.
    minLength : int
        Least length of an 8-connected component in pixels, >= 1; by default 5 for `strength`, else 1. The length is
        the longer side of the bounding box: the number of pixels of a straight line, however thick.
    lineSignificance : float or None
        Least significance of a line of `strength`, as in `detectEdges`; None is 20, whatever made the strengths.
    dynamic : bool
        Whether to apply the dynamic threshold. It needs a map whose candidates are mostly noise, so pass
        strengths found with ``minSignificance=0`` and low thresholds.
    wrap : bool
        Whether the first column follows the last, as in a scan all around.
    dst : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit.

    Returns
    -------
    dst : ndarray of shape (H, W), CV_8U
        255 on edges, 0 elsewhere.

    Raises
    ------
    rangeedge.error
        If an image is not a real (H, W) image of finite values >= 0, if their shapes differ, or if a
        parameter is out of its range.

    Notes
    -----
    Thresholds as in the paper, 6: 20 degrees for quiet scanners, 30 for noisy ones.

    The dynamic threshold is that of Venkatesh and Rosin (1995), for either type of edge by itself: the
    candidates (positive strength) are thinned and cut at junctions into chains of length L and mean
    strength m. With the centre M and the deviation D of the population, a chain is kept where

        m >= (M(m) + 6 D(m)) - 3 D(m) L / (M(L) + 6 D(L)),

    so the longer a chain, the fainter it may be. M and D are the median and the median absolute deviation,
    scaled to the mean absolute deviation of a normal population, in place of the means of the original:
    true edges then do not raise the threshold as long as most chains are noise. Every pixel goes with the
    nearest chain. With fewer than ten chains there is no population and nothing is removed.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import detectEdges, edgeStrength, selectEdges, thinEdges
    >>> jump, crease = np.zeros((2, 1, 6), np.float32)
    >>> jump[0] = 2, 4, 2, 0, 2, 0
    >>> selectEdges(jump, crease, 3)
    array([[  0, 255,   0,   0,   0,   0]], dtype=uint8)
    >>> selectEdges(jump, crease, 3, hysteresis=0.5)
    array([[255, 255, 255,   0,   0,   0]], dtype=uint8)
    >>> depth = np.full((48, 64), 2.0)
    >>> depth[12:36, 16:48] = 1.5
    >>> strength = edgeStrength(depth, noise=0.001)
    >>> bool((thinEdges(selectEdges(strength, 0.1)) == detectEdges(depth, 0.1, noise=0.001)).all())
    True
    """
    given = args[0] if args else options.get("strength")
    if (
        not isinstance(given, EdgeStrength)
        and len(args) + len({"jump", "crease", "jumpThreshold"} & options.keys()) < 3
    ):
        raise _check.fail("strength", "of edgeStrength, or jump, crease and jumpThreshold", _check.described(given))
    return _of_strength(*args, **options) if isinstance(given, EdgeStrength) else _of_maps(*args, **options)


@takes(SELECTION)
def _of_strength(
    strength: EdgeStrength,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    *,
    wrap: bool = False,
    dst: np.ndarray | None = None,
    **options: Any,
) -> np.ndarray:
    selection = Selection(jumpThreshold=jumpThreshold, creaseThreshold=creaseThreshold, **options)
    jump = _check.strength32f("strength.jump", strength.jump)
    crease = _check.strength32f("strength.crease", strength.crease, jump.shape)
    kind = _check.image8("strength.kind", strength.kind, jump.shape)
    checked = EdgeStrength(jump, crease, kind, strength.significance)
    edges = select_strength(checked, selection, _check.boolean("wrap", wrap))
    return _check.deliver("dst", edges, dst)


@takes(SELECTION)
def _of_maps(
    jump: np.ndarray,
    crease: np.ndarray,
    jumpThreshold: float,
    creaseThreshold: float = 30.0,
    *,
    wrap: bool = False,
    dst: np.ndarray | None = None,
    **options: Any,
) -> np.ndarray:
    jump = _check.strength32f("jump", jump)
    crease = _check.strength32f("crease", crease, jump.shape)
    jumpThreshold = _check.threshold("jumpThreshold", jumpThreshold)
    selection = Selection(jumpThreshold=jumpThreshold, creaseThreshold=creaseThreshold, **{"minLength": 1, **options})
    edges = select_maps(jump, crease, None, None, selection, wrap=_check.boolean("wrap", wrap))
    return _check.deliver("dst", edges, dst)


selectEdges.__signature__ = inspect.signature(_of_strength)  # type: ignore[attr-defined]


def select_strength(strength: EdgeStrength, selection: Selection, wrap: bool = False) -> np.ndarray:
    """The edge map before thinning: jumps on their nearer side, creases that do not stand alone, borders if wanted."""
    edges = select_maps(*strength, selection, wrap=wrap)
    if selection.boundaryEdges:
        edges[(strength.kind & EDGE_BOUNDARY) > 0] = 255
    return edges


def select_maps(
    jump: np.ndarray,
    crease: np.ndarray,
    kind: np.ndarray | None,
    significance: np.ndarray | None,
    selection: Selection,
    *,
    wrap: bool = False,
) -> np.ndarray:
    """The edge map, 0 and 255, of checked strengths; without `kind` every jump and every crease counts by itself."""
    thresholds, hysteresis = (selection.jumpThreshold or 0.0, selection.creaseThreshold), selection.hysteresis
    low = (hysteresis * thresholds[0], hysteresis * thresholds[1])

    def reaching(jump_least: float, crease_least: float) -> np.ndarray:
        edges = np.empty(jump.shape, bool)
        least, threads = (jump_least, crease_least, low[1]), threads_worth(jump.size)
        _core.select_pixels(jump, crease, kind, least, wrap, threads, edges.view(np.uint8))
        return edges

    edges = reaching(*thresholds)
    if hysteresis < 1:
        edges = _connected_to(edges, reaching(*low), wrap)
    least = selection.of().lineSignificance
    if selection.minLength > 1 or (significance is not None and least > 0):
        edges = _lines(edges, selection.minLength, significance, least, wrap)
    if selection.dynamic:
        of_jumps, of_creases = reaching(0.0, np.inf), reaching(np.inf, 0.0)
        edges &= outstanding(jump * of_jumps, wrap) | outstanding(crease * of_creases, wrap)
    return edges.view(np.uint8) * np.uint8(255)


def _grey_levels(strength: np.ndarray, cut: float) -> np.ndarray:
    """Paper, 6, at the edge pixels only; in double precision, so that a strength of exactly one level stays there."""
    levels = np.zeros(strength.shape, np.uint8)
    edge = strength > 0
    levels[edge] = np.minimum(np.ceil(255 * strength[edge].astype(np.float64) / cut), 255)
    return levels


def _connected_to(strong: np.ndarray, candidates: np.ndarray, wrap: bool) -> np.ndarray:
    """The 8-connected components of `candidates` that hold a pixel of `strong`, a subset of them."""
    count, labels = components(candidates, wrap)
    keep = np.zeros(count, bool)
    keep[labels[strong]] = True
    return pixels_of(candidates, labels, keep)


def _lines(
    edges: np.ndarray, minLength: int, significance: np.ndarray | None, lineSignificance: float, wrap: bool
) -> np.ndarray:
    """The lines that are significant, but for short pieces."""
    kept = np.empty(edges.shape, np.uint8)
    _core.keep_lines(edges.view(np.uint8), wrap, minLength, significance, lineSignificance, kept)
    return kept.view(bool)
