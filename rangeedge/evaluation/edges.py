"""How good an edge map is: scores against true edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from .. import _check
from ..bands import by_bands, distinct
from ..cancellation import apart
from ..constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from ..distance import distanceTransformWithLabels
from .counts import Counts, ratio

# Classes of a typed truth map: what a pixel truly is.
TRUTH_NONE = 0
TRUTH_JUMP = 1
TRUTH_CONVEX = 2
TRUTH_CONCAVE = 3
TRUTH_NODATA = 4  # valid pixel beside one without a measurement: not judged
TRUTH_AMBIGUOUS = 5  # too weak to be called an edge or none: not judged
TRUTH_IGNORED = 255  # nobody knows: not judged

_NOT_JUDGED = (TRUTH_NODATA, TRUTH_AMBIGUOUS, TRUTH_IGNORED)
_CLASSES = (TRUTH_NONE, TRUTH_JUMP, TRUTH_CONVEX, TRUTH_CONCAVE, *_NOT_JUDGED)


@dataclass(frozen=True)
class TypeScores(Counts):
    """Counts over the true edge pixels of one type; every derived value is NaN where nothing was counted."""

    target: int = 0  # true pixels that are judged
    found: int = 0  # those with a detected pixel within the tolerance
    shiftSum: float = 0.0  # distances of the found ones to their detected pixels
    labelled: int = 0  # found ones whose kind was compared
    kindRight: int = 0  # those of the right kind
    measured: int = 0  # found ones whose strength was compared
    strengthSum: float = 0.0  # absolute strength errors of those

    @property
    def recall(self) -> float:
        """Share of the true pixels that was found."""
        return ratio(self.found, self.target)

    @property
    def shift(self) -> float:
        """Mean distance from a found pixel to the nearest detected one, in pixels."""
        return ratio(self.shiftSum, self.found)

    @property
    def kind(self) -> float:
        """Share of the found pixels that carries the right kind."""
        return ratio(self.kindRight, self.labelled)

    @property
    def strengthError(self) -> float:
        """Mean absolute error of the strength: degrees for creases, a length for jumps."""
        return ratio(self.strengthSum, self.measured)


@dataclass(frozen=True)
class EdgeScores(Counts):
    """Counts of `evaluateEdges` that add up over frames, and the values derived from them.

    ``sum(scores)`` over frames weighs every edge pixel alike. A value is NaN where nothing was counted for it.
    """

    frames: int = 0
    true: int = 0  # detected pixels near a true edge
    detected: int = 0  # detected pixels that are judged
    jump: TypeScores = TypeScores()
    convex: TypeScores = TypeScores()
    concave: TypeScores = TypeScores()

    @property
    def target(self) -> int:
        """True edge pixels that are judged."""
        return self.jump.target + self.crease.target

    @property
    def found(self) -> int:
        """True edge pixels with a detected pixel within the tolerance."""
        return self.jump.found + self.crease.found

    @property
    def crease(self) -> TypeScores:
        """Convex and concave creases together."""
        return self.convex + self.concave

    @property
    def precision(self) -> float:
        """Share of the detected pixels that is near a true edge."""
        return ratio(self.true, self.detected)

    @property
    def recall(self) -> float:
        """Share of the true edge pixels that was found."""
        return ratio(self.found, self.target)

    @property
    def f(self) -> float:
        """Harmonic mean of precision and recall."""
        p, r = self.precision, self.recall
        return 2 * p * r / (p + r) if p + r else 0.0

    @property
    def kind(self) -> float:
        """Share of the found crease pixels that is rightly called convex or concave."""
        return self.crease.kind

    @property
    def shift(self) -> float:
        """Mean distance from a found pixel to the nearest detected one, in pixels."""
        return (self.jump + self.crease).shift

    def __str__(self) -> str:
        values = {"precision": self.precision, "recall": self.recall, "F": self.f}
        values |= {f"{name} recall": getattr(self, name).recall for name in ("jump", "convex", "concave")}
        values |= {"kind": self.kind, "shift": self.shift}
        return ", ".join(f"{name} {value:.3f}" for name, value in values.items())


@_check.public
def evaluateEdges(
    edges: np.ndarray,
    truth: np.ndarray,
    *,
    tolerance: float = 3.0,
    ignore: np.ndarray | None = None,
    kind: np.ndarray | None = None,
    crease: np.ndarray | None = None,
    creaseTruth: np.ndarray | None = None,
    jump: np.ndarray | None = None,
    jumpTruth: np.ndarray | None = None,
) -> EdgeScores:
    """Compare an edge map with typed ground truth.

    evaluateEdges(edges, truth, *[, tolerance[, ignore[, kind[, crease, creaseTruth[, jump, jumpTruth]]]]]) -> scores

    Both maps are thinned to skeletons first. With t the tolerance and all distances Euclidean,

    - *precision* is the share of the detected pixels that lie within t of a true edge; a detected pixel within t of
      something not judged, and of no true edge, does not count;
    - *recall* is the share of the true pixels with a detected one within t; a true pixel within t of something not
      judged does not count;
    - *kind*, *shift* and *strengthError* compare each found true pixel with the detected pixel nearest to it.

    Parameters
    ----------
    edges : (H, W) 8-bit or bool array
        The detected edges, non-zero = edge.
    truth : (H, W) 8-bit array
        Class of every pixel: `TRUTH_NONE` 0, `TRUTH_JUMP` 1, `TRUTH_CONVEX` 2, `TRUTH_CONCAVE` 3; not judged are
        `TRUTH_NODATA` 4, `TRUTH_AMBIGUOUS` 5 and `TRUTH_IGNORED` 255. Edges may be thick. For a truth without types
        write one class, such as ``(boundary != 0).astype(np.uint8)``.
    tolerance : float
        The distance t, in pixels.
    ignore : (H, W) 8-bit or bool array, optional
        Further pixels that are not judged (non-zero), such as those without a measurement.
    kind : (H, W) 8-bit array, optional
        Kinds of the detected edges as `EDGE_*` bits, as `edgeStrength` returns them.
    crease, creaseTruth : (H, W) real arrays, optional
        Detected and true crease strengths in degrees, given together. Pixels where either is not finite are left out.
    jump, jumpTruth : (H, W) real arrays, optional
        Detected and true jump strengths as a length, in the same way.

    Returns
    -------
    EdgeScores
        Counts of this frame, and ``precision``, ``recall``, ``f``, ``kind``, ``shift``; per type
        (``.jump``, ``.convex``, ``.concave``, ``.crease``) ``recall``, ``kind``, ``shift`` and ``strengthError``.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type, shape or range, or one strength map without its truth.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.evaluation import TRUTH_CONVEX, evaluateEdges
    >>> truth = np.zeros((20, 20), np.uint8)
    >>> truth[:, 10] = TRUTH_CONVEX
    >>> edges = np.zeros((20, 20), np.uint8)
    >>> edges[:10, 11] = 255
    >>> scores = evaluateEdges(edges, truth, tolerance=2)
    >>> scores.precision, scores.recall, round(scores.convex.shift, 2)
    (1.0, 0.55, 1.04)
    >>> (scores + scores).frames
    2
    """
    truth = _truth_map(truth)
    shape = truth.shape
    edges = _check.image8("edges", edges, shape) != 0
    tolerance = _check.number("tolerance", tolerance, 0.0)
    not_judged = np.isin(truth, _NOT_JUDGED)
    if ignore is not None:
        not_judged |= _check.image8("ignore", ignore, shape) != 0
    labels = None if kind is None else _classes_of(_check.image8("kind", kind, shape))
    creases = _strengths("crease", crease, creaseTruth, shape)
    jumps = _strengths("jump", jump, jumpTruth, shape)

    is_edge = np.isin(truth, (TRUTH_JUMP, TRUTH_CONVEX, TRUTH_CONCAVE))
    judged = _distance(not_judged) > tolerance
    near_truth = _distance(is_edge) <= tolerance
    thin = _skeleton(edges)
    counted = thin & (judged | near_truth)
    target = _skeleton(is_edge) & judged
    distance, nearest = _nearest(thin)

    def of_type(edge_class: int, strengths: tuple[np.ndarray, np.ndarray] | None) -> TypeScores:
        pixels = np.flatnonzero(target & (truth == edge_class))
        found = pixels[distance.flat[pixels] <= tolerance]
        partner = nearest.flat[found]
        error = np.empty(0) if strengths is None else strengths[0].flat[partner] - strengths[1].flat[found]
        error = np.abs(error[np.isfinite(error)])
        return TypeScores(
            target=pixels.size,
            found=found.size,
            shiftSum=float(distance.flat[found].sum()),
            labelled=0 if labels is None else found.size,
            kindRight=0 if labels is None else int((labels[edge_class].flat[partner]).sum()),
            measured=error.size,
            strengthSum=float(error.sum()),
        )

    return EdgeScores(
        frames=1,
        true=int((counted & near_truth).sum()),
        detected=int(counted.sum()),
        jump=of_type(TRUTH_JUMP, jumps),
        convex=of_type(TRUTH_CONVEX, creases),
        concave=of_type(TRUTH_CONCAVE, creases),
    )


@_check.public
def prattFOM(edges: np.ndarray, truth: np.ndarray, alpha: float = 1 / 9) -> float:
    """Pratt's figure of merit of an edge map, 1 for a perfect one.

    prattFOM(edges, truth[, alpha]) -> retval

    With N the larger of the two numbers of edge pixels and d(p) the distance from p to the nearest true edge pixel,

        FOM = 1/N sum over detected p of 1 / (1 + alpha d(p)^2)

    It is not symmetric and sees missed edges by their number only: read it beside the recall. Two empty maps agree
    (1); one empty map scores 0.

    Parameters
    ----------
    edges, truth : (H, W) 8-bit or bool arrays
        Detected and true edges, non-zero = edge: for a typed truth map, pass ``(truth > 0) & (truth < 4)``.
    alpha : float
        Penalty of displacement, > 0, in 1/px^2.

    Returns
    -------
    float
        From 0 to 1.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type, shape or range.

    Notes
    -----
    W. K. Pratt, Digital Image Processing, Wiley 1978.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.evaluation import prattFOM
    >>> truth = np.zeros((8, 8), np.uint8)
    >>> truth[:, 3] = 255
    >>> prattFOM(truth, truth), round(prattFOM(np.roll(truth, 1, axis=1), truth), 6)
    (1.0, 0.9)
    """
    truth = _check.image8("truth", truth) != 0
    edges = _check.image8("edges", edges, truth.shape) != 0
    alpha = _check.number("alpha", alpha, 0.0, above=True)
    if not edges.any() or not truth.any():
        return float(edges.any() == truth.any())
    merit = 1 / (1 + alpha * _distance(truth)[edges] ** 2)
    return float(merit.sum() / max(edges.sum(), truth.sum()))


@_check.public
def baddeleyDelta(edges: np.ndarray, truth: np.ndarray, k: float = 2.0, cutoff: float | None = None) -> float:
    """Baddeley's distance between two edge maps, 0 for equal ones.

    baddeleyDelta(edges, truth[, k[, cutoff]]) -> retval

    With d_A, d_B the distances of a pixel to either map, cut off at c, and N the number of pixels,

        Delta = (1/N sum over all p of |min(d_A(p), c) - min(d_B(p), c)|^k)^(1/k)

    It is symmetric, and false, missed and displaced edges all raise it. An empty map is everywhere c away.

    Parameters
    ----------
    edges, truth : (H, W) 8-bit or bool arrays
        The two maps, non-zero = edge: for a typed truth map, pass ``(truth > 0) & (truth < 4)``.
    k : float
        Exponent, >= 1.
    cutoff : float, optional
        The distance c in pixels, > 0; a tenth of the image diagonal by default.

    Returns
    -------
    float
        From 0 to `cutoff`, in pixels.

    Raises
    ------
    rangeedge.error
        On an argument of the wrong type, shape or range.

    Notes
    -----
    A. J. Baddeley, An error metric for binary images, in Robust Computer Vision, 1992.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge.evaluation import baddeleyDelta
    >>> truth = np.zeros((8, 8), np.uint8)
    >>> truth[:, 3] = 255
    >>> baddeleyDelta(truth, truth), baddeleyDelta(np.roll(truth, 1, axis=1), truth, cutoff=4)
    (0.0, 1.0)
    """
    truth = _check.image8("truth", truth) != 0
    edges = _check.image8("edges", edges, truth.shape) != 0
    k = _check.number("k", k, 1.0)
    cutoff = float(np.hypot(*truth.shape)) / 10 if cutoff is None else cutoff
    cutoff = _check.number("cutoff", cutoff, 0.0, above=True)
    difference = np.minimum(_distance(edges), cutoff) - np.minimum(_distance(truth), cutoff)
    return float((np.abs(difference) ** k).mean() ** (1 / k))


def _truth_map(truth: Any) -> np.ndarray:
    truth = _check.image8("truth", truth)
    unknown = np.setdiff1d(distinct(truth), _CLASSES)
    if unknown.size:
        got = f"class {unknown[0]}"
        raise _check.fail("truth", f"of the classes {_CLASSES}", got, cv2.Error.StsOutOfRange)
    return truth


def _classes_of(kind: np.ndarray) -> dict[int, np.ndarray]:
    """Per class of truth, where `kind` says the same."""
    convex = kind & EDGE_CONVEX != 0
    return {
        TRUTH_JUMP: kind & EDGE_JUMP != 0,
        TRUTH_CONVEX: convex,
        TRUTH_CONCAVE: (kind & EDGE_CONCAVE != 0) & ~convex,
    }


def _strengths(name: str, strength: Any, truth: Any, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray] | None:
    """Detected and true strengths, or None where neither is given."""
    if strength is None and truth is None:
        return None
    for key, value in ((name, strength), (f"{name}Truth", truth)):
        if value is None:
            other = f"{name}Truth" if key == name else name
            raise _check.fail(key, f"given where `{other}` is", None)
    return _check.image32f(name, strength, shape), _check.image32f(f"{name}Truth", truth, shape)


def _skeleton(edges: np.ndarray) -> np.ndarray:
    # Not by our own thinning: a score must not depend on what it scores.
    from skimage.morphology import skeletonize

    return apart(edges.size, skeletonize, edges)


def _nearest(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance to the nearest edge pixel in float64, inf without any, and that pixel's linear index, -1."""
    height, width = edges.shape
    if not edges.any():
        return np.full(edges.shape, np.inf), np.full(edges.shape, -1)
    # Transposed, so that of several nearest pixels the leftmost wins, as in SciPy's transform.
    labels = distanceTransformWithLabels(edges.T)[1].T
    rows, x = np.arange(height)[:, None], np.arange(width)

    def distance(y: np.ndarray, labels: np.ndarray) -> np.ndarray:
        col, row = np.divmod(labels, height)
        return np.sqrt(((y - row) ** 2 + (x - col) ** 2).astype(np.float64))

    return by_bands(distance, rows, labels), by_bands(lambda own: own % height * width + own // height, labels)


def _distance(edges: np.ndarray) -> np.ndarray:
    return _nearest(edges)[0]
