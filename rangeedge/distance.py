"""Distance and salience distance transforms of edge maps, exact."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from . import _core
from ._check import array, deliver, described, fail, flag, image8, image32f, number, public
from .constants import SALIENCE_ADDITIVE, SALIENCE_MULTIPLICATIVE

_METHODS = {"SALIENCE_MULTIPLICATIVE": SALIENCE_MULTIPLICATIVE, "SALIENCE_ADDITIVE": SALIENCE_ADDITIVE}
_WORTH_THREADS = 1 << 15  # pixels; fewer take less time than starting a thread


@public
def distanceTransform(edges: np.ndarray, dst: np.ndarray | None = None) -> np.ndarray:
    """Exact Euclidean distance of every pixel to the nearest edge pixel.

    distanceTransform(edges[, dst]) -> dst

    D(p) = min |p - q| over the pixels q with ``edges[q] != 0``. Unlike `cv2.distanceTransform`, which measures to the
    nearest zero pixel and so takes the inverted map, edges are what is not zero here, and every distance is the
    correctly rounded square root of an integer.

    Parameters
    ----------
    edges : (H, W) CV_8U or bool
        Edge map; non-zero is an edge.
    dst : (H, W) CV_32F, optional
        Output array.

    Returns
    -------
    dst : (H, W) CV_32F
        Distances in pixels, 0 on edges; +inf everywhere if there is no edge at all.

    Raises
    ------
    error
        If `edges` is not a non-empty 8-bit or bool image.

    References
    ----------
    P. Felzenszwalb and D. Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8, 2012.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import distanceTransform
    >>> edges = np.array([[255, 0, 0, 0]], np.uint8)
    >>> distanceTransform(edges)
    array([[0., 1., 2., 3.]], dtype=float32)
    """
    edges = _binary(edges)
    distance = np.empty(edges.shape, np.float32)
    _core.distance_transform(edges, distance, None, _threads(edges))
    return deliver("dst", distance, dst)


@public
def distanceTransformWithLabels(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact Euclidean distance to the nearest edge pixel, and which pixel that is.

    distanceTransformWithLabels(edges) -> dst, labels

    The labels are the feature transform: ``labels[p] = row * W + col`` of the edge pixel nearest to p, of the lowest
    index where several are equally near. ``np.unravel_index(labels, labels.shape)`` gives rows and columns.

    Parameters
    ----------
    edges : (H, W) CV_8U or bool
        Edge map; non-zero is an edge.

    Returns
    -------
    dst : (H, W) CV_32F
        Distances as from `distanceTransform`.
    labels : (H, W) CV_32S
        Indices of the nearest edge pixels; -1 everywhere if there is no edge at all.

    Raises
    ------
    error
        If `edges` is not a non-empty 8-bit or bool image.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import distanceTransformWithLabels
    >>> edges = np.array([[255, 0, 0, 0, 255]], np.uint8)
    >>> distanceTransformWithLabels(edges)[1]
    array([[0, 0, 0, 4, 4]], dtype=int32)
    """
    edges = _binary(edges)
    distance, labels = np.empty(edges.shape, np.float32), np.empty(edges.shape, np.int32)
    _core.distance_transform(edges, distance, labels, _threads(edges))
    return distance, labels


@public
def salienceDistanceTransform(
    salience: np.ndarray,
    method: int = SALIENCE_MULTIPLICATIVE,
    dst: np.ndarray | None = None,
    *,
    lambda_: float = 10.0,
) -> np.ndarray:
    """Distance to edges in which weak edges count for less, exact.

    salienceDistanceTransform(salience[, method[, dst]], *[, lambda_]) -> dst

    With the salience s(q) in (0, 1] of every edge pixel q,

    - ``SALIENCE_MULTIPLICATIVE``: D(p) = min |p - q| / s(q). Zero on every edge; around a weak one D rises fast and its
      influence soon ends.
    - ``SALIENCE_ADDITIVE``: D(p) = sqrt(min |p - q|^2 + f(q)), f = lambda^2 (1 / s^2 - 1). Not zero on weak edges; near
      a strong one they vanish from the map altogether.

    Where all edges have s = 1 both are `distanceTransform`, bit for bit; at lambda pixels from a single edge both forms
    agree. No threshold is needed: the strength of an edge says how far it matters.

    The idea is that of Rosin and West; the formulas are our reading of it. They propagate a 3-4 chamfer distance, of
    which no exact definition was at hand, and such propagation errs on a good part of the pixels: the regions won by an
    edge need not be connected. Here D is the true minimum, rounded once from double precision.

    Parameters
    ----------
    salience : (H, W) CV_8U, bool or CV_32F
        Salience of every pixel, zero where there is no edge: s = value / 255 for 8 bits, as `overallStrength` returns
        it; s = value for floats, which must lie in [0, 1] (less than 2^-30 counts as zero); bool is 0 or 1.
    method : int
        ``SALIENCE_MULTIPLICATIVE`` (default) or ``SALIENCE_ADDITIVE``.
    dst : (H, W) CV_32F, optional
        Output array.
    lambda_ : float
        Weight of salience in the additive form, in pixels. f is rounded to multiples of 2^-20 square pixels.

    Returns
    -------
    dst : (H, W) CV_32F
        Weighted distances in pixels; +inf everywhere if no pixel is salient.

    Raises
    ------
    error
        If `salience` is not a non-empty 8-bit, bool or float32 image, a float value is NaN, negative or above 1, or a
        parameter is out of range.

    References
    ----------
    P. Rosin and G. West, Salience distance transforms, Graphical Models and Image Processing 57(6), 1995.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import salienceDistanceTransform
    >>> salience = np.array([[51, 0, 0, 0, 0, 0, 0, 255]], np.uint8)
    >>> salienceDistanceTransform(salience)
    array([[0., 5., 5., 4., 3., 2., 1., 0.]], dtype=float32)
    """
    distance, _ = _salience_transform(salience, method, lambda_, with_labels=False)
    return deliver("dst", distance, dst)


@public
def salienceDistanceTransformWithLabels(
    salience: np.ndarray, method: int = SALIENCE_MULTIPLICATIVE, *, lambda_: float = 10.0
) -> tuple[np.ndarray, np.ndarray]:
    """Salience distance transform, and which edge pixel each distance is measured to.

    salienceDistanceTransformWithLabels(salience[, method], *[, lambda_]) -> dst, labels

    ``labels[p] = row * W + col`` of the edge pixel q that attains the minimum, of the lowest index where several do.
    Ties are decided exactly, not by rounded distances.

    Parameters
    ----------
    salience, method, lambda_
        As in `salienceDistanceTransform`.

    Returns
    -------
    dst : (H, W) CV_32F
        Distances as from `salienceDistanceTransform`.
    labels : (H, W) CV_32S
        Indices of the edge pixels; -1 everywhere if no pixel is salient.

    Raises
    ------
    error
        As in `salienceDistanceTransform`.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import salienceDistanceTransformWithLabels
    >>> salience = np.array([[51, 0, 0, 0, 0, 0, 0, 255]], np.uint8)
    >>> salienceDistanceTransformWithLabels(salience)[1]
    array([[0, 0, 7, 7, 7, 7, 7, 7]], dtype=int32)
    """
    return _salience_transform(salience, method, lambda_, with_labels=True)


def _salience_transform(
    salience: np.ndarray, method: int, lambda_: float, *, with_labels: bool
) -> tuple[np.ndarray, np.ndarray | None]:
    salience = _salience(salience)
    method = flag("method", method, _METHODS)
    lambda_ = number("lambda_", lambda_, 0.0, 1e6)
    distance = np.empty(salience.shape, np.float32)
    labels = np.empty(salience.shape, np.int32) if with_labels else None
    if method == SALIENCE_MULTIPLICATIVE:
        _core.salience_multiplicative(salience, distance, labels, _threads(salience))
    else:
        _core.salience_additive(salience, lambda_, distance, labels, _threads(salience))
    return distance, labels


def _binary(edges: np.ndarray) -> np.ndarray:
    return image8("edges", _indexable("edges", edges))


def _salience(value: np.ndarray) -> np.ndarray:
    """A salience map as C-contiguous uint8 or float32, its values checked."""
    expected = "a uint8, bool or float32 array of shape (H, W)"
    value = array("salience", _indexable("salience", value), expected)
    if value.dtype == np.bool_:
        return np.where(value, np.uint8(255), np.uint8(0))
    if value.dtype == np.uint8:
        return image8("salience", value)
    if value.dtype != np.float32:
        raise fail("salience", expected, described(value), cv2.Error.StsUnsupportedFormat)
    low, high = value.min(), value.max()
    if not (low >= 0 and high <= 1):
        raise fail("salience", "in [0, 1] where it is float32", f"{low:g} to {high:g}", cv2.Error.StsOutOfRange)
    return image32f("salience", value)


def _indexable(name: str, value: Any) -> Any:
    """`value`, unless it is an image whose pixels CV_32S labels cannot number or whose columns floats cannot."""
    if isinstance(value, np.ndarray) and (value.size >= 2**31 or max(value.shape, default=0) > 2**24):
        expected = "of fewer than 2^31 pixels and sides of at most 2^24"
        raise fail(name, expected, described(value), cv2.Error.StsOutOfRange)
    return value


def _threads(image: np.ndarray) -> int:
    return cv2.getNumThreads() if image.size >= _WORTH_THREADS else 1
