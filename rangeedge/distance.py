"""Distance and salience distance transforms of edge maps, exact."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from . import _core
from ._check import array, boolean, deliver, described, fail, flag, image8, number, pixel_size, public
from .constants import SALIENCE_ADDITIVE, SALIENCE_MULTIPLICATIVE

_METHODS = {"SALIENCE_MULTIPLICATIVE": SALIENCE_MULTIPLICATIVE, "SALIENCE_ADDITIVE": SALIENCE_ADDITIVE}
_WORTH_THREADS = 1 << 15  # pixels; fewer take less time than starting a thread
_LARGEST_ASPECT = 100.0  # of a pixel's sides


@public
def distanceTransform(
    edges: np.ndarray,
    dst: np.ndarray | None = None,
    *,
    pixelSize: Any = 1.0,
    wrap: bool = False,
    barrier: np.ndarray | None = None,
) -> np.ndarray:
    """Euclidean distance of every pixel to the nearest edge pixel, exact.

    distanceTransform(edges[, dst], *[, pixelSize[, wrap[, barrier]]]) -> dst

    D(p) = min |p - q| over the pixels q with ``edges[q] != 0``. Unlike `cv2.distanceTransform`, which measures to the
    nearest zero pixel and so takes the inverted map, edges are what is not zero here, and every distance is the
    correctly rounded square root of an integer; where pixels are not square it is right to a part in 10^7.

    With a `barrier`, D(p) is the length of the shortest way from p to an edge around it, a polygon over middles of
    pixels. Where the nearest edge is in sight this is exact too. Where it is not, no result is too small; it may be too
    large, for square pixels by less than 8.3 % (in practice by less than 1 % nearly everywhere), since of all polygons
    only those are tried that a search over the eight neighbours comes upon.

    Parameters
    ----------
    edges : (H, W) CV_8U or bool
        Edge map; non-zero is an edge.
    dst : (H, W) CV_32F, optional
        Output array.
    pixelSize : float or (dx, dy)
        Width and height of a pixel as lengths; one may be 100 times the other.
    wrap : bool
        Whether the first column follows the last, as in a scan all around.
    barrier : (H, W) CV_8U or bool, optional
        Non-zero where no way leads through, nor between two such pixels that touch at a corner. Edges there do not
        count.

    Returns
    -------
    dst : (H, W) CV_32F
        Distances in pixels, or in the unit of `pixelSize`; 0 on edges, +inf on the barrier and where there is no edge
        or no way to one.

    Raises
    ------
    error
        If `edges` is not a non-empty 8-bit or bool image, `barrier` not one of its shape, or an option is of the wrong
        kind or out of range.

    References
    ----------
    P. Felzenszwalb and D. Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8, 2012.
    A. Nash, K. Daniel, S. Koenig and A. Felner, Theta*: any-angle path planning on grids, AAAI 2007.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import distanceTransform
    >>> edges = np.array([[255, 0, 0, 0]], np.uint8)
    >>> distanceTransform(edges)
    array([[0., 1., 2., 3.]], dtype=float32)
    >>> distanceTransform(edges, pixelSize=0.5, wrap=True)
    array([[0. , 0.5, 1. , 0.5]], dtype=float32)
    >>> distanceTransform(edges, barrier=np.array([[0, 0, 1, 0]], np.uint8))
    array([[ 0.,  1., inf, inf]], dtype=float32)
    """
    distance, _ = _distance_transform(edges, pixelSize, wrap, barrier, with_labels=False)
    return deliver("dst", distance, dst)


@public
def distanceTransformWithLabels(
    edges: np.ndarray, *, pixelSize: Any = 1.0, wrap: bool = False, barrier: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Euclidean distance to the nearest edge pixel, and which pixel that is.

    distanceTransformWithLabels(edges, *[, pixelSize[, wrap[, barrier]]]) -> dst, labels

    The labels are the feature transform: ``labels[p] = row * W + col`` of the edge pixel nearest to p, of the lowest
    index where several are equally near. ``np.unravel_index(labels, labels.shape)`` gives rows and columns.

    Parameters
    ----------
    edges, pixelSize, wrap, barrier
        As in `distanceTransform`.

    Returns
    -------
    dst : (H, W) CV_32F
        Distances as from `distanceTransform`.
    labels : (H, W) CV_32S
        Indices of the nearest edge pixels; -1 where the distance is +inf. Around barriers, those at the end of the way.

    Raises
    ------
    error
        As in `distanceTransform`.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import distanceTransformWithLabels
    >>> edges = np.array([[255, 0, 0, 0, 255]], np.uint8)
    >>> distanceTransformWithLabels(edges)[1]
    array([[0, 0, 0, 4, 4]], dtype=int32)
    """
    return _distance_transform(edges, pixelSize, wrap, barrier, with_labels=True)


@public
def salienceDistanceTransform(
    salience: np.ndarray,
    method: int = SALIENCE_MULTIPLICATIVE,
    dst: np.ndarray | None = None,
    *,
    lambda_: float = 10.0,
    pixelSize: Any = 1.0,
    wrap: bool = False,
) -> np.ndarray:
    """Distance to edges in which weak edges count for less, exact.

    salienceDistanceTransform(salience[, method[, dst]], *[, lambda_[, pixelSize[, wrap]]]) -> dst

    With the salience s(q) in (0, 1] of every edge pixel q,

    - ``SALIENCE_MULTIPLICATIVE``: D(p) = min |p - q| / s(q). Zero on every edge; around a weak one D rises fast and its
      influence soon ends.
    - ``SALIENCE_ADDITIVE``: D(p) = sqrt(min |p - q|^2 + f(q)), f = lambda^2 (1 / s^2 - 1). Not zero on weak edges; near
      a strong one they vanish from the map altogether.

    Where all edges have s = 1 both are `distanceTransform`, bit for bit; at lambda pixels from a single edge both forms
    agree. No threshold is needed: the strength of an edge says how far it matters.

    The idea is that of Rosin and West; the formulas are our reading of it. They propagate a 3-4 chamfer distance, of
    which no exact definition was at hand, and such propagation errs on a good part of the pixels: the regions won by an
    edge need not be connected. Here D is the true minimum, rounded once from double precision. For the same reason
    there is no `barrier` here.

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
        Weight of salience in the additive form, a length as distances are. f is rounded to multiples of 2^-20 squared
        pixel widths.
    pixelSize, wrap
        As in `distanceTransform`.

    Returns
    -------
    dst : (H, W) CV_32F
        Weighted distances in pixels, or in the unit of `pixelSize`; +inf everywhere if no pixel is salient.

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
    distance, _ = _salience_transform(salience, method, lambda_, pixelSize, wrap, with_labels=False)
    return deliver("dst", distance, dst)


@public
def salienceDistanceTransformWithLabels(
    salience: np.ndarray,
    method: int = SALIENCE_MULTIPLICATIVE,
    *,
    lambda_: float = 10.0,
    pixelSize: Any = 1.0,
    wrap: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Salience distance transform, and which edge pixel each distance is measured to.

    salienceDistanceTransformWithLabels(salience[, method], *[, lambda_[, pixelSize[, wrap]]]) -> dst, labels

    ``labels[p] = row * W + col`` of the edge pixel q that attains the minimum, of the lowest index where several do.
    Ties are decided exactly where pixels are square, not by rounded distances.

    Parameters
    ----------
    salience, method, lambda_, pixelSize, wrap
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
    return _salience_transform(salience, method, lambda_, pixelSize, wrap, with_labels=True)


def _distance_transform(
    edges: np.ndarray, pixelSize: Any, wrap: bool, barrier: np.ndarray | None, *, with_labels: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Distances and labels; these are empty where nobody wants them."""
    edges = image8("edges", _indexable("edges", edges))
    barrier = None if barrier is None else image8("barrier", barrier, edges.shape)
    pixels = _pixels(pixelSize, wrap)
    distance, labels = _outputs(edges.shape, with_labels)
    wanted = labels if with_labels else None
    _core.distance_transform(edges, barrier, pixels, distance, wanted, _threads(edges))
    return distance, labels


def _salience_transform(
    salience: np.ndarray, method: int, lambda_: float, pixelSize: Any, wrap: bool, *, with_labels: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Distances and labels; these are empty where nobody wants them."""
    salience = _salience(salience)
    method = flag("method", method, _METHODS)
    lambda_ = number("lambda_", lambda_, 0.0, 1e6)
    pixels = _pixels(pixelSize, wrap)
    distance, labels = _outputs(salience.shape, with_labels)
    wanted = labels if with_labels else None
    if method == SALIENCE_MULTIPLICATIVE:
        _core.salience_multiplicative(salience, pixels, distance, wanted, _threads(salience))
    else:
        _core.salience_additive(salience, lambda_, pixels, distance, wanted, _threads(salience))
    return distance, labels


def _salience(value: np.ndarray) -> np.ndarray:
    """A copy of a salience map as C-contiguous uint8 or float32, its values checked.

    A copy, since another thread may be writing to the map, and the kernels rely on what was checked.
    """
    expected = "a uint8, bool or float32 array of shape (H, W)"
    value = array("salience", _indexable("salience", value), expected)
    if value.dtype not in (np.bool_, np.uint8, np.float32):
        raise fail("salience", expected, described(value), cv2.Error.StsUnsupportedFormat)
    copy = np.array(value, order="C")
    if copy.dtype == np.bool_:
        return copy.view(np.uint8) * np.uint8(255)
    if copy.dtype == np.float32:
        low, high = copy.min(), copy.max()
        if not (low >= 0 and high <= 1):
            got = f"{low:g} to {high:g}"
            raise fail("salience", "in [0, 1] where it is float32", got, cv2.Error.StsOutOfRange)
    return copy


def _indexable(name: str, value: Any) -> Any:
    """`value`, unless it is an image whose rows or columns floats cannot number."""
    if isinstance(value, np.ndarray) and max(value.shape, default=0) > 2**24:
        expected = "an image with sides of at most 2^24"
        raise fail(name, expected, described(value), cv2.Error.StsOutOfRange)
    return value


def _pixels(pixelSize: Any, wrap: bool) -> _core.Pixels:
    width, height = pixel_size("pixelSize", pixelSize)
    if not 1e-30 <= min(width, height) <= max(width, height) <= 1e30:
        raise fail("pixelSize", "lengths from 1e-30 to 1e30", (width, height), cv2.Error.StsOutOfRange)
    if max(width, height) > _LARGEST_ASPECT * min(width, height):
        expected = f"two lengths of which one is at most {_LARGEST_ASPECT:g} times the other"
        raise fail("pixelSize", expected, (width, height), cv2.Error.StsOutOfRange)
    return _core.Pixels(width=width, height=height, wrap=boolean("wrap", wrap))


def _outputs(shape: tuple[int, ...], with_labels: bool) -> tuple[np.ndarray, np.ndarray]:
    return np.empty(shape, np.float32), np.empty(shape if with_labels else 0, np.int32)


def _threads(image: np.ndarray) -> int:
    return cv2.getNumThreads() if image.size >= _WORTH_THREADS else 1
