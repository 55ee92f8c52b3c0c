"""Edge strengths, kinds and positions from scan line approximation (paper, 4)."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _core
from ._check import array, described, fail, integer, number, public
from ._option import Option, parsed, takes
from .constants import EDGE_BOUNDARY, EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, EDGE_OCCLUDED, EDGE_OCCLUDING
from .frame import Frame
from .noise import measured_frame
from .options import SCAN_LINES, ScanLineParams
from .sectors import sectors_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import ScanLineOptions

KINDS = {
    "jump": EDGE_JUMP,
    "occluding": EDGE_OCCLUDING,
    "occluded": EDGE_OCCLUDED,
    "convex": EDGE_CONVEX,
    "concave": EDGE_CONCAVE,
    "boundary": EDGE_BOUNDARY,
}
_IN_WORDS = {"occluding": "nearer side", "occluded": "farther side", "boundary": "beside no data"}  # others as they are
_POINT = [("x", "f4"), ("y", "f4"), ("jump", "f4"), ("crease", "f4")]
_POINT += [("kind", "u1"), ("significance", "f4"), ("direction", "u1")]


class EdgeStrength(NamedTuple):
    """What `edgeStrength` returns, one value a pixel; 0 where there is no edge candidate."""

    jump: np.ndarray  # CV_32F, length
    crease: np.ndarray  # CV_32F, degrees
    kind: np.ndarray  # CV_8U, EDGE_* bits
    significance: np.ndarray  # CV_32F, standard deviations

    def __repr__(self) -> str:
        height, width = self.jump.shape
        parts = [f"{width} x {height} pixels"]
        for name, unit in (("jump", ""), ("crease", " degrees"), ("significance", "")):
            values = getattr(self, name)
            values = values[values > 0]
            extent = f" from {values.min():.4g} to {values.max():.4g}{unit}" if values.size else ""
            parts.append(f"{name} at {values.size}{extent}")
        return f"EdgeStrength({'; '.join(parts)})"

    def _repr_png_(self) -> bytes:
        from .draw.shown import of_strength

        return of_strength(self)


@public
def kindNames(kind: int) -> str:
    """Name the bits of a kind of edge.

    kindNames(kind) -> retval

    Parameters
    ----------
    kind : int
        Bits EDGE_*, as one pixel of `EdgeStrength.kind` or one point of `edgePoints` has them.

    Returns
    -------
    retval : str
        Of the words jump, occluding, occluded, convex, concave, boundary those whose bits are set; "none" of 0.

    Raises
    ------
    rangeedge.error
        If `kind` is no integer from 0 to 63.

    Examples
    --------
    >>> from rangeedge import EDGE_CONVEX, EDGE_JUMP, EDGE_OCCLUDING, kindNames
    >>> kindNames(EDGE_JUMP | EDGE_OCCLUDING | EDGE_CONVEX)
    'jump occluding convex'
    """
    kind = integer("kind", kind, 0, sum(KINDS.values()))
    return " ".join(name for name, bit in KINDS.items() if kind & bit) or "none"


def kind_in_words(kind: int) -> str:
    """A kind of edge as sentences and pictures have it."""
    return ", ".join(_IN_WORDS.get(name, name) for name, bit in KINDS.items() if kind & bit) or "no edge"


@public
def splitScanLine(z: np.ndarray, eps: float, pixelSize: float | np.ndarray = 1.0) -> np.ndarray:
    """Split one scan line into quadratic segments.

    splitScanLine(z, eps[, pixelSize]) -> segments

    The quadratic through both end points and the midpoint of a run approximates it; where the largest residual
    |z - f(x)| exceeds `eps` the run is cut, and both parts are treated the same way. The cut falls between two
    samples: the extreme one joins the neighbour whose value is closer, the left one of two equals. The midpoint of
    a run with an even number of samples is the left one of the two.

    Parameters
    ----------
    z : ndarray of shape (N,), real
        Values along the line. Non-finite values are invalid and separate runs.
    eps : float
        Largest residual that a segment may keep, in the unit of `z`, >= 0.
    pixelSize : float or ndarray of shape (N,)
        Spacing of the samples, or their abscissae; a run ends where these do not increase.

    Returns
    -------
    segments : ndarray of shape (S, 2), CV_32S
        First and last index of every segment, in order. Segments of up to three samples fit exactly.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Notes
    -----
    Paper, 4.1 and Fig. 3, after Duda and Hart.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import splitScanLine
    >>> splitScanLine(np.array([0, 1, 2, 3, 4, 4, 4, 4.0]), 0.1).tolist()
    [[0, 3], [4, 7]]
    """
    z = array("z", z, "a real array of shape (N,)", ndim=(1,))
    eps = number("eps", eps, 0)
    y = _line(z, np.float64 if z.dtype.itemsize > 4 or z.dtype.kind != "f" else np.float32)
    if not isinstance(pixelSize, np.ndarray):
        x = None
        number("pixelSize", pixelSize, 0, above=True)
    else:
        pixelSize = array("pixelSize", pixelSize, "a length or an array like `z`", ndim=(1,))
        if pixelSize.shape != z.shape:
            raise fail("pixelSize", f"a length or an array of shape {z.shape}", described(pixelSize))
        x = _line(pixelSize, y.dtype)
        y[np.isnan(x)] = np.nan
    return _core.split_scan_line(y, x, eps)


def _line(values: np.ndarray, dtype: Any) -> np.ndarray:
    line = values.astype(dtype)
    line[~np.isfinite(line)] = np.nan
    return line


@takes(SCAN_LINES)
def edgeStrength(
    src: np.ndarray,
    eps: float | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[ScanLineOptions],
) -> EdgeStrength:
    """Measure how strong an edge every pixel of a range image is, and of which kind.

    edgeStrength(src[, eps], *[, mask[, K[, ...]]]) -> jump, crease, kind, significance

    Rows, columns and both diagonals are approximated by curves (paper, 4.1). At a cut between two of them, f1 and f2,

        jump = |z1(x) - z2(x)|,  crease = the angle between the normals of f1 and f2 at x,

    x being the position of the edge; it is their intersection where the pixels allow that, and then jump = 0
    (paper, 4.2). Both pixels beside the cut receive the strengths, and of several candidates the largest. Surfaces
    either meet at a pixel or do not: a jump pixel has no crease, and of candidates for both the most significant
    decides.
    A step that is smeared over up to `maxSmear` pixels is one jump of its full height between the pixels beside them
    (`flyingPixels`). No jump exceeds the depths of the pixels around it.

    Parameters
    ----------
    src : ndarray
        (H, W) depth, or points (H, W, 3) or (H, W, 4), of a camera (x right, y down, z away) or of any scanner in any
        axes: where their rays meet in the origin or in `origin`, lines of sight start there, and where their rows lie
        on cones (a scanner that turns) depths are distances from there. Points that tell no viewpoint are refused.
        Masked arrays, records with fields x, y and z, `cv2.UMat` and what has ``__array__`` or DLPack are taken too.
        Integers are divided by `depthFactor` and invalid where <= 0. With `K`, depths that are not positive and
        finite are invalid; without it, only non-finite values are. Heights (`heightMap`) may be negative: of signed
        integers only the least of the type is invalid.
        A point is invalid if a coordinate is not finite, if all are 0, or if it lies behind the viewpoint.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    {options}

    Returns
    -------
    jump : ndarray of shape (H, W), CV_32F
        Depth step in the unit of the image, 0 where there is no candidate.
    crease : ndarray of shape (H, W), CV_32F
        Angle in degrees, 0 where there is no candidate.
    kind : ndarray of shape (H, W), CV_8U
        EDGE_JUMP where the step exceeds the noise, with EDGE_OCCLUDING on its nearer side and EDGE_OCCLUDED on its
        farther one; elsewhere EDGE_CONVEX or EDGE_CONCAVE of the largest crease, convex of equal ones; EDGE_BOUNDARY
        beside invalid pixels, whether there is an edge or not.
    significance : ndarray of shape (H, W), CV_32F
        Strength over its standard deviation, joined with that of neighbouring candidates of the same kind.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    edgePoints : The candidates themselves, with subpixel positions.
    detectEdges : A thin edge map in one call.

    Notes
    -----
    Paper, 4.1 and 4.2. The result does not depend on the number of threads.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import EDGE_OCCLUDED, EDGE_OCCLUDING, edgeStrength
    >>> z = np.where(np.arange(40) < 20, 1.0, 1.25) * np.ones((30, 1))
    >>> s = edgeStrength(z, noise=0.001)
    >>> float(s.jump[15, 19]), float(s.jump[15, 20]), float(s.jump[15, 21])
    (0.25, 0.25, 0.0)
    >>> bool(s.kind[15, 19] & EDGE_OCCLUDING), bool(s.kind[15, 20] & EDGE_OCCLUDED)
    (True, True)
    """
    (params,) = parsed({"eps": eps, **options}, ScanLineParams)
    return measure_strength(measured_frame(src, params, mask), params)


@takes(SCAN_LINES)
def edgePoints(
    src: np.ndarray,
    eps: float | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[ScanLineOptions],
) -> np.ndarray:
    """Find the edge candidates of every scan line, with subpixel positions.

    edgePoints(src[, eps], *[, mask[, K[, ...]]]) -> points

    Parameters
    ----------
    src, mask
        As in `edgeStrength`.
    {options}

    Returns
    -------
    points : structured ndarray of shape (N,)
        x, y (pixels, subpixel), jump (length), crease (degrees), kind (EDGE_* bits), significance, direction
        (a DIR_* bit). An edge that several scan lines cross gives several points. In `kind`, which never holds
        EDGE_BOUNDARY here, EDGE_OCCLUDING says that
        the surface before the point along its scan line (left of it, or above on a column) is the nearer one,
        EDGE_OCCLUDED that it is the farther one.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Notes
    -----
    Paper, 4.2 and Fig. 5. The order is by direction, then by line, then along the line.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import edgePoints
    >>> roof = np.abs(np.arange(41) - 20.3) * np.ones((5, 1))
    >>> points = edgePoints(roof, noise=0.001, directions=1)
    >>> len(points), np.unique(points["x"].round(3))
    (5, array([20.3], dtype=float32))
    """
    (params,) = parsed({"eps": eps, **options}, ScanLineParams)
    return measure_points(measured_frame(src, params, mask), params)


def measure_strength(frame: Frame, params: ScanLineParams) -> EdgeStrength:
    """Edge strengths of a checked range image."""
    parts = sectors_of(frame)
    strength = _maps(np.zeros if parts else np.empty, frame.shape)
    for part in parts:
        for whole, own in zip(strength, measure_strength(part.frame, params), strict=True):
            part.put(whole, own)
    if not parts:
        _core.edge_strength(frame.kernel, kernel_options(frame, params), frame.threads, *strength)
    return strength


def measure_points(frame: Frame, params: ScanLineParams) -> np.ndarray:
    """Edge points of a checked range image."""
    parts = sectors_of(frame)
    if parts:
        return _joined([part.points(measure_points(part.frame, params)) for part in parts])
    return _points(_core.edge_candidates(frame.kernel, kernel_options(frame, params), frame.threads))


def measure_both(frame: Frame, params: ScanLineParams) -> tuple[EdgeStrength, np.ndarray]:
    """Edge strengths and edge points of a checked range image, of one approximation of its scan lines."""
    parts = sectors_of(frame)
    strength = _maps(np.zeros if parts else np.empty, frame.shape)
    if parts:
        points = []
        for part in parts:
            own, found = measure_both(part.frame, params)
            points.append(part.points(found))
            for whole, values in zip(strength, own, strict=True):
                part.put(whole, values)
        return strength, _joined(points)
    found = _core.edge_strength_and_candidates(frame.kernel, kernel_options(frame, params), frame.threads, *strength)
    return strength, _points(found)


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """Edge points of sectors, by direction."""
    points = np.concatenate(parts)
    return points[np.argsort(points["direction"], kind="stable")]


def _points(candidates: dict[str, np.ndarray]) -> np.ndarray:
    points = np.empty(len(candidates["x"]), dtype=_POINT)
    for name in points.dtype.names:
        points[name] = candidates[name]
    return points


def no_strength(shape: tuple[int, int]) -> EdgeStrength:
    """All zero."""
    return _maps(np.zeros, shape)


def _maps(allocate: Callable[..., np.ndarray], shape: tuple[int, int]) -> EdgeStrength:
    """Three maps of floats and one of bytes share an allocation: new memory takes the system a while."""
    size = shape[0] * shape[1]
    maps = allocate(13 * size, np.uint8)
    floats = maps[: 12 * size].view(np.float32).reshape(3, *shape)
    return EdgeStrength(floats[0], floats[1], maps[12 * size :].reshape(shape), floats[2])


def kernel_options(frame: Frame, params: ScanLineParams) -> _core.ScanLineOptions:
    """The options of scan lines under their names in the kernel, a choice of two as a bool, 0 for None."""
    chosen = {kernel: read(getattr(params, name) or 0) for name, kernel, read in _KERNEL}
    return _core.ScanLineOptions(**chosen, spaced=frame.spaced)


def _in_kernel(option: Option) -> tuple[str, str, Callable[[Any], Any]]:
    """Name of an option, its name in the kernel, and what makes its value there."""
    snake = re.sub(r"([A-Z])", lambda m: "_" + m[1].lower(), option.name)
    return option.name, option.kernel or snake, bool if option.choices else type(option.default or 0.0)


_KERNEL = [_in_kernel(option) for option in SCAN_LINES.values() if option.group == "scan lines"]
