"""Edge strengths, kinds and positions from scan line approximation (P§4)."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._args import array, boolean, described, error, errors_of, fail, flag, integer, number
from ._constants import (
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_ALL,
    FIT_INTERP,
    FIT_LSQ,
    MEASURE_ENDPOINT,
    MEASURE_MIDPOINT,
)
from .geometry import RangeFrame, range_frame
from .noise import kernel_noise


@dataclass(frozen=True)
class ScanLineParams:
    """Every parameter of the detector, with its default.

    ScanLineParams([eps[, epsFactor[, K[, ...]]]])

    The functions that detect edges take each of these by keyword.

    Parameters
    ----------
    eps : float or None
        Splitting tolerance as a length, at the pixel's depth with a camera (P§4.1). None: `epsFactor` times the noise.
    epsFactor : float
        Splitting tolerance in standard deviations of the noise.
    K : array_like of shape (3, 3) or None
        Camera matrix; the values of `src` are then depths along the optical axis.
    pixelSize : float or (float, float) or None
        Spacing (dx, dy) of a regular grid in the unit of its values; None is 1.
    heightMap : bool
        Whether larger values are nearer to the viewer.
    depthFactor : float
        Divides integer values: 1000 makes metres of millimetres. Integer 0 is invalid.
    noise : NoiseModel or float or ndarray of shape (H, W) or None
        Standard deviation of the values as lengths; None estimates it from the image (`estimateNoise`).
    directions : int
        Scan lines to use: DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135 combined by `|`, or DIR_ALL.
    fit : int
        FIT_LSQ, least squares over a segment, a line unless a quadratic is significant; or FIT_INTERP, the quadratic
        through end points and midpoint. With FIT_INTERP cuts stay as they fall.
    measure : int
        MEASURE_MIDPOINT, strengths where the edge is; or MEASURE_ENDPOINT, extrapolated from either end point.
    crease : int
        CREASE_NORMAL, the angle between the surface normals, which the tangents of several scan lines give; or
        CREASE_MAX, the largest directional angle (P§4.2).
    maxShift : float
        How far, in pixels, the adapted edge position may lie from the cut (P§4.2, Fig. 5); 0 keeps the cut.
    maxGap : int
        Widest gap of invalid pixels on a scan line whose two sides are compared: occlusion shadows.
    maxSmear : int
        Most pixels of a scan line over which a step may be smeared, as interpolation and the footprint of a pixel do,
        to be one jump between the surfaces on either side. They are a surface of their own unless that is steep, or if
        more than two almost parallel to the viewing direction. 0 takes every pixel for a surface.
    shadowEdges : bool
        Whether a surface that ends at a gap wider than `maxGap`, in front of another one beyond it, has a jump at its
        end: the outline of an object beside its shadow. A surface with a hole in it has none.
    mergeSignificance : float
        Cuts are taken back where that raises the sum of squared residuals by less than its square, in variances of the
        noise; a segment across an edge, or its rounding, is given to the surfaces beside it likewise. 0 keeps all.
    minSignificance : float
        Candidates are dropped whose significance, joined with that of their neighbours, is below this; 0 keeps all.

    Raises
    ------
    rangeedge.error
        If a value is out of range. `K`, `pixelSize` and `noise` are checked together with the image.

    Examples
    --------
    >>> ScanLineParams().maxShift
    4.0
    >>> ScanLineParams.paper().fit == FIT_INTERP
    True
    """

    eps: float | None = None
    epsFactor: float = 3.5
    K: Any = None
    pixelSize: Any = None
    heightMap: bool = False
    depthFactor: float = 1000.0
    noise: Any = None
    directions: int = DIR_ALL
    fit: int = FIT_LSQ
    measure: int = MEASURE_MIDPOINT
    crease: int = CREASE_NORMAL
    maxShift: float = 4.0
    maxGap: int = 8
    maxSmear: int = 5
    shadowEdges: bool = True
    mergeSignificance: float = 5.0
    minSignificance: float = 12.0

    def __post_init__(self) -> None:
        func = "ScanLineParams"
        if self.eps is not None:
            number(func, "eps", self.eps, 0, above=True)
        number(func, "epsFactor", self.epsFactor, 0, above=True)
        number(func, "depthFactor", self.depthFactor, 0, above=True)
        for name in ("heightMap", "shadowEdges"):
            boolean(func, name, getattr(self, name))
        integer(func, "directions", self.directions, 1, DIR_ALL)
        flag(func, "fit", self.fit, {"FIT_LSQ": FIT_LSQ, "FIT_INTERP": FIT_INTERP})
        measures = {"MEASURE_MIDPOINT": MEASURE_MIDPOINT, "MEASURE_ENDPOINT": MEASURE_ENDPOINT}
        flag(func, "measure", self.measure, measures)
        flag(func, "crease", self.crease, {"CREASE_MAX": CREASE_MAX, "CREASE_NORMAL": CREASE_NORMAL})
        for name in ("maxShift", "mergeSignificance", "minSignificance"):
            number(func, name, getattr(self, name), 0)
        integer(func, "maxGap", self.maxGap, 0)
        integer(func, "maxSmear", self.maxSmear, 0)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ScanLineParams):
            return NotImplemented
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    __hash__ = None  # arrays have no hash

    @classmethod
    def paper(cls, **options: Any) -> ScanLineParams:
        """The paper's basic setting: interpolating fits, cuts as they fall, nothing merged, every candidate kept."""
        basic = {
            "fit": FIT_INTERP,
            "crease": CREASE_MAX,
            "maxShift": 0.0,
            "maxGap": 0,
            "maxSmear": 0,
            "shadowEdges": False,
        }
        return cls(**{**basic, "mergeSignificance": 0.0, "minSignificance": 0.0, **options})


class EdgeStrength(NamedTuple):
    """What `edgeStrength` returns, one value a pixel; 0 where there is no edge candidate."""

    jump: np.ndarray  # CV_32F, length
    crease: np.ndarray  # CV_32F, degrees
    kind: np.ndarray  # CV_8U, EDGE_* bits
    significance: np.ndarray  # CV_32F, standard deviations


def params_of(func: str, eps: float | None, options: dict[str, Any]) -> ScanLineParams:
    """The keywords of `func` as parameters; an error names `func`."""
    names = [f.name for f in fields(ScanLineParams)]
    for name in options:
        if name not in names:
            close = difflib.get_close_matches(name, names, 1)
            hint = f"; did you mean `{close[0]}`?" if close else ""
            raise error(func, f"unknown argument `{name}`{hint}")
    with errors_of(func):
        return ScanLineParams(eps=eps, **options)


def takes_scan_line_params(function: Callable[..., Any]) -> Callable[..., Any]:
    """Show the fields of ScanLineParams in the signature of a function that takes them as `**options`."""
    signature = inspect.signature(function)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    shown = [
        inspect.Parameter(f.name, inspect.Parameter.KEYWORD_ONLY, default=f.default)
        for f in fields(ScanLineParams)
        if f.name not in signature.parameters
    ]

    @functools.wraps(function)
    def with_options(*args: Any, **kwargs: Any) -> Any:
        return function(*args, **kwargs)

    with_options.__signature__ = signature.replace(parameters=own + shown)  # type: ignore[attr-defined]
    return with_options


def splitScanLine(z: np.ndarray, eps: float, pixelSize: float | np.ndarray = 1.0) -> np.ndarray:
    """Split one scan line into quadratic segments.

    splitScanLine(z, eps[, pixelSize]) -> segments

    The quadratic through both end points and the midpoint of a run approximates it; where the largest residual
    |z - f(x)| exceeds `eps` the run is cut, and both parts are treated the same way. The cut falls between two
    samples: the extreme one joins the neighbour whose value is closer. No side is preferred, so that a reversed line is
    cut at the same places: of two samples in the middle, the one closer to the straight line between the ends is the
    midpoint, and where they are equally far on either side of it that line is the curve; of equally extreme samples the
    one closer to the middle counts, or both; of equally close neighbours the one farther from the middle is joined.

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
    Jiang and Bunke, section 4.1 and Fig. 3, after Duda and Hart.

    Examples
    --------
    >>> import numpy as np
    >>> splitScanLine(np.array([0, 1, 2, 3, 4, 4, 4, 4.0]), 0.1).tolist()
    [[0, 3], [4, 7]]
    """
    func = "splitScanLine"
    z = array(func, "z", z, "a real array of shape (N,)", ndim=(1,))
    eps = number(func, "eps", eps, 0)
    y = _line(z, np.float64 if z.dtype.itemsize > 4 or z.dtype.kind != "f" else np.float32)
    if np.ndim(pixelSize) == 0:
        x = None
        number(func, "pixelSize", pixelSize, 0, above=True)
    else:
        pixelSize = array(func, "pixelSize", pixelSize, "a length or an array like `z`", ndim=(1,))
        if pixelSize.shape != z.shape:
            raise fail(func, "pixelSize", f"a length or an array of shape {z.shape}", described(pixelSize))
        x = _line(pixelSize, y.dtype)
        y[np.isnan(x)] = np.nan
    return _core.split_scan_line(y, x, eps)


def _line(values: np.ndarray, dtype: Any) -> np.ndarray:
    line = values.astype(dtype)
    line[~np.isfinite(line)] = np.nan
    return line


@takes_scan_line_params
def edgeStrength(
    src: np.ndarray, eps: float | None = None, *, mask: np.ndarray | None = None, **options: Any
) -> EdgeStrength:
    """Measure how strong an edge every pixel of a range image is, and of which kind.

    edgeStrength(src[, eps], *[, mask[, K[, ...]]]) -> jump, crease, kind, significance

    Rows, columns and both diagonals are approximated by curves (P§4.1). At a cut between two of them, f1 and f2,

        jump = |z1(x) - z2(x)|,  crease = the angle between the normals of f1 and f2 at x,

    x being the position of the edge; it is their intersection where the pixels allow that, and then jump = 0
    (P§4.2). Both pixels beside the cut receive the strengths, and of several candidates the largest. Surfaces either
    meet at a pixel or do not: a jump pixel has no crease, and of candidates for both the most significant decides.
    A step that is smeared over up to `maxSmear` pixels is one jump of its full height between the pixels beside them
    (`flyingPixels`). No jump exceeds the depths of the pixels around it.

    Parameters
    ----------
    src : ndarray
        (H, W) depth, or points (H, W, 3) or (H, W, 4) in the camera frame (x right, y down, z away).
        Integers are divided by `depthFactor` and invalid where <= 0. With `K`, depths that are not positive and
        finite are invalid; without it, only non-finite values are. Heights (`heightMap`) may not be signed integers.
        A point is invalid if a coordinate is not finite, if all are 0, or if it lies behind the viewpoint.
    eps : float, optional
        Splitting tolerance as a length; None derives it from the noise.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    K, pixelSize, heightMap, depthFactor, noise, directions, fit, measure, crease, maxShift, maxGap, ...
        As in `ScanLineParams`, which holds the defaults.

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
    Jiang and Bunke, sections 4.1 and 4.2. The result does not depend on the number of threads.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import EDGE_OCCLUDED, EDGE_OCCLUDING
    >>> z = np.where(np.arange(40) < 20, 1.0, 1.25) * np.ones((30, 1))
    >>> s = edgeStrength(z, noise=0.001)
    >>> float(s.jump[15, 19]), float(s.jump[15, 20]), float(s.jump[15, 21])
    (0.25, 0.25, 0.0)
    >>> bool(s.kind[15, 19] & EDGE_OCCLUDING), bool(s.kind[15, 20] & EDGE_OCCLUDED)
    (True, True)
    """
    params = params_of("edgeStrength", eps, options)
    return strength_of("edgeStrength", frame_of("edgeStrength", src, params, mask), params)


@takes_scan_line_params
def edgePoints(
    src: np.ndarray, eps: float | None = None, *, mask: np.ndarray | None = None, **options: Any
) -> np.ndarray:
    """Find the edge candidates of every scan line, with subpixel positions.

    edgePoints(src[, eps], *[, mask[, K[, ...]]]) -> points

    Parameters
    ----------
    src, eps, mask, K, ...
        As in `edgeStrength`.

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
    Jiang and Bunke, section 4.2 and Fig. 5. The order is by direction, then by line, then along the line.

    Examples
    --------
    >>> import numpy as np
    >>> roof = np.abs(np.arange(41) - 20.3) * np.ones((5, 1))
    >>> points = edgePoints(roof, noise=0.001, directions=1)
    >>> len(points), np.unique(points["x"].round(3))
    (5, array([20.3], dtype=float32))
    """
    params = params_of("edgePoints", eps, options)
    return points_of("edgePoints", frame_of("edgePoints", src, params, mask), params)


def frame_of(func: str, src: np.ndarray, params: ScanLineParams, mask: np.ndarray | None) -> RangeFrame:
    """The range image in the form that kernels take."""
    return range_frame(func, src, params.K, params.pixelSize, params.heightMap, params.depthFactor, mask)


def strength_of(func: str, frame: RangeFrame, params: ScanLineParams) -> EdgeStrength:
    """Edge strengths of a checked range image."""
    strength = _no_strength(frame.shape)
    kernel = frame.kernel(kernel_noise(func, params.noise, frame))
    _core.edge_strength(kernel, kernel_options(params, frame), frame.threads, *strength)
    return strength


def _no_strength(shape: tuple[int, int]) -> EdgeStrength:
    """All zero. The maps share one allocation: the system takes a while to hand out new memory."""
    size = shape[0] * shape[1]
    maps = np.zeros(13 * size, np.uint8)
    floats = maps[: 12 * size].view(np.float32).reshape(3, *shape)
    return EdgeStrength(floats[0], floats[1], maps[12 * size :].reshape(shape), floats[2])


_POINT = [("x", "f4"), ("y", "f4"), ("jump", "f4"), ("crease", "f4")]
_POINT += [("kind", "u1"), ("significance", "f4"), ("direction", "u1")]


def points_of(func: str, frame: RangeFrame, params: ScanLineParams) -> np.ndarray:
    """Edge points of a checked range image."""
    kernel = frame.kernel(kernel_noise(func, params.noise, frame))
    candidates = _core.edge_candidates(kernel, kernel_options(params, frame), frame.threads)
    points = np.empty(len(candidates["x"]), dtype=_POINT)
    for name in points.dtype.names:
        points[name] = candidates[name]
    return points


def kernel_options(params: ScanLineParams, frame: RangeFrame) -> _core.ScanLineOptions:
    """Checked parameters in the form that kernels take."""
    return _core.ScanLineOptions(
        eps=params.eps or 0.0,
        eps_factor=params.epsFactor,
        directions=params.directions,
        interpolate=params.fit == FIT_INTERP,
        endpoint=params.measure == MEASURE_ENDPOINT,
        normals=params.crease == CREASE_NORMAL,
        max_shift=params.maxShift,
        max_gap=params.maxGap,
        max_smear=params.maxSmear,
        shadows=params.shadowEdges,
        spaced=frame.spaced,
        merge_significance=params.mergeSignificance,
        min_significance=params.minSignificance,
    )
