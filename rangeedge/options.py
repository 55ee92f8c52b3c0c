"""The options of the detector, each once: its default, its check, what it means, how the command line spells it.

A class of options is a frozen dataclass, whose fields are made by `option`; it checks its values when it is made, and
keeps each in its own type. From it come the keywords of the functions (`takes`), their signatures and documentation,
the accessors of the detector and the types of all of them (`_typed.py`, which ``python tests/typed.py`` writes), the
flags of the command line, and what a detector saves: every field of `ScanLineParams` and of `Selection`. The options
of the stages after it are in `stage_options`; at the end are the families that functions take.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _check, _parse
from ._option import Option, Options, declared, option
from ._option_checks import camera, distortion, noise_value, one_of, or_none, real, whole
from .constants import (
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_ALL,
    FIT_INTERP,
    FIT_LSQ,
    MEASURE_ENDPOINT,
    MEASURE_MIDPOINT,
)
from .noise_model import NoiseModel
from .stage_options import Cleaning, Closing, Growing, Linking, Seeding

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


_LINE_SIGNIFICANCE = 20.0  # of lines of candidates that are significant
FITS = {"FIT_LSQ": FIT_LSQ, "FIT_INTERP": FIT_INTERP}
MEASURES = {"MEASURE_MIDPOINT": MEASURE_MIDPOINT, "MEASURE_ENDPOINT": MEASURE_ENDPOINT}
CREASES = {"CREASE_MAX": CREASE_MAX, "CREASE_NORMAL": CREASE_NORMAL}


@declared
@dataclass(frozen=True, eq=False, repr=False)
class ScanLineParams(Options):
    """Every parameter of the detector, with its default.

    ScanLineParams([eps[, epsFactor[, K[, ...]]]])

    The functions that detect edges take each of these by keyword.

    Parameters
    ----------
    {options}

    Raises
    ------
    rangeedge.error
        If a value is out of range. Whether it fits the image shows when that is there.

    Examples
    --------
    >>> from rangeedge import FIT_INTERP, ScanLineParams
    >>> ScanLineParams().maxShift
    12.0
    >>> ScanLineParams.paper().fit == FIT_INTERP
    True
    >>> ScanLineParams(maxGap=4, noise=0.002)
    ScanLineParams(noise=0.002, maxGap=4)
    """

    @_check.named("ScanLineParams")
    def __post_init__(self) -> None:
        if isinstance(self.K, (str, os.PathLike)):
            camera = _check.camera_file("K", self.K)
            object.__setattr__(self, "K", camera.K)
            object.__setattr__(self, "distCoeffs", camera.distCoeffs)
            object.__setattr__(self, "imageSize", self.imageSize or camera.size)
        super().__post_init__()

    eps: float | None = option(
        None,
        or_none(real(0, above=True)),
        "float or None",
        "Splitting tolerance as a length, at the pixel's depth with a camera (paper, 4.1). None: `epsFactor` times the"
        " noise.",
        group="scan lines",
    )
    epsFactor: float = option(
        3.5,
        real(0, above=True),
        "float",
        "Splitting tolerance in standard deviations of the noise.",
        group="scan lines",
    )
    K: ArrayLike | str | os.PathLike[str] | None = option(
        None,
        or_none(camera),
        "array_like or path or None",
        "Camera; the values of `src` are then depths along the optical axis. (fx, fy, cx, cy), 3x3, 3x4, 9 numbers by"
        " rows, or the name of a file of one (YAML, JSON or XML of cv2, ROS, Open3D or librealsense, text, NPY, NPZ),"
        " whose distortion replaces `distCoeffs`, and whose image size `src` must have.",
        group="geometry",
        kept="np.ndarray | None",
        read=_parse.camera,
        metavar="FX,FY,CX,CY|FILE",
        flagged="pinhole camera, in pixels, or a file of one (YAML, JSON, ...); values are depths",
    )
    distCoeffs: ArrayLike | None = option(
        None,
        or_none(distortion),
        "array_like of 4, 5, 8, 12 or 14 numbers or None",
        "Distortion of the lens with `K`, as cv2 has it: (k1, k2, p1, p2[, k3[, k4, k5, k6[, ...]]]).",
        group="geometry",
        kept="np.ndarray | None",
        read=_parse.distortion,
        metavar="K1,K2,P1,P2[,...]",
        flagged="distortion of the lens, with -K, as cv2 has it (default: none, or that of the camera's file)",
    )
    imageSize: Sequence[int] | None = option(
        None,
        or_none(_check.image_size),
        "(int, int) or None",
        "Width and height of the images that `K` holds for: others, resized or cropped, are refused. None: that of the"
        " camera's file, where it tells one.",
        group="geometry",
        kept="tuple[int, int] | None",
        read=_parse.image_size,
        metavar="W,H",
        flagged="size of the images that -K holds for, others are refused (default: that of the camera's file)",
    )
    pixelSize: float | Sequence[float] | None = option(
        None,
        or_none(_check.pixel_size),
        "float or (float, float) or None",
        "Spacing (dx, dy) of a regular grid in the unit of its values; None is 1.",
        group="geometry",
        kept="tuple[float, float] | None",
        read=_parse.pixel_size,
        metavar="DX[,DY]",
        flagged="spacing of a regular grid, in the unit of its values (default: 1)",
    )
    heightMap: bool = option(
        False,
        _check.boolean,
        "bool",
        "Whether larger values are nearer to the viewer.",
        group="geometry",
        flagged="the values are heights: larger ones are nearer to the viewer",
    )
    depthFactor: float = option(
        1000.0,
        real(0, above=True),
        "float",
        "Divides integer values: 1000 makes metres of millimetres. Integer 0 is invalid.",
        group="geometry",
    )
    invalid: float | Sequence[float | Sequence[float]] | None = option(
        None,
        or_none(_check.invalid_values),
        "float or sequence of floats and pairs or None",
        "What `src` holds where there is no data, as stored there: a value; several, (0, 65535); and ranges, which are"
        " pairs among them with both ends included: [(8, inf)] leaves out 8 and more, [-9999, (8, inf)] both."
        " () says that every finite value is one. A point is left out whose coordinates all have the value, or whose"
        " third coordinate lies in the range.",
        group="geometry",
        kept="tuple[tuple[float, float], ...] | None",
        read=_parse.invalid_values,
        metavar="V|LOW:HIGH[,...]",
        flagged="values as stored, and ranges of them, that are no data: --invalid=-9999 or 0,8000:inf, or none",
    )
    origin: Sequence[float] | None = option(
        None,
        or_none(_check.point),
        "(float, float, float) or None",
        "Where points were seen from, in their own frame. None: (0, 0, 0) where their rays meet there, else the place"
        " that the rows and columns tell.",
        group="geometry",
        kept="tuple[float, float, float] | None",
        read=_parse.point,
        metavar="X,Y,Z",
        flagged="where points were seen from, in their own frame (default: that of the file, else found)",
    )
    noise: NoiseModel | float | np.ndarray | None = option(
        None,
        or_none(noise_value),
        "NoiseModel or float or ndarray of shape (H, W) or None",
        "Standard deviation of the values as lengths; None estimates it from the image (`estimateNoise`).",
        group="noise",
        read=_parse.noise,
        metavar="NOISE",
        flagged="deviation of the values: a length, or A,B,C[,CORRELATION[,LENGTH]] for a + b z + c z^2, or"
        f" {', '.join(_parse.SENSORS)} (default: estimated)",
    )
    directions: int = option(
        DIR_ALL,
        whole(1, DIR_ALL),
        "int",
        "Scan lines to use: DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135 combined by `|`, or DIR_ALL.",
        group="scan lines",
        read=_parse.directions,
        metavar="LIST",
        flagged=f"scan lines, joined by commas: {', '.join(_parse.DIRECTIONS)} (default: all)",
    )
    fit: int = option(
        FIT_LSQ,
        one_of(FITS),
        "int",
        "FIT_LSQ, least squares over a segment, a line unless a quadratic is significant; or FIT_INTERP, the quadratic"
        " through end points and midpoint. With FIT_INTERP cuts stay as they fall.",
        group="scan lines",
        choices={"lsq": FIT_LSQ, "interp": FIT_INTERP},
        constants=FITS,
        kernel="interpolate",
    )
    measure: int = option(
        MEASURE_MIDPOINT,
        one_of(MEASURES),
        "int",
        "MEASURE_MIDPOINT, strengths where the edge is; or MEASURE_ENDPOINT, extrapolated from either end point.",
        group="scan lines",
        choices={"midpoint": MEASURE_MIDPOINT, "endpoint": MEASURE_ENDPOINT},
        constants=MEASURES,
        kernel="endpoint",
    )
    crease: int = option(
        CREASE_NORMAL,
        one_of(CREASES),
        "int",
        "CREASE_NORMAL, the angle between the surface normals, which the tangents of several scan lines give; or"
        " CREASE_MAX, the largest directional angle (paper, 4.2).",
        group="scan lines",
        choices={"max": CREASE_MAX, "normal": CREASE_NORMAL},
        constants=CREASES,
        kernel="normals",
    )
    maxShift: float = option(
        12.0,
        real(0),
        "float",
        "How far the adapted edge position may lie from the cut (paper, 4.2, Fig. 5); 0 keeps the cut.",
        unit="pixels",
        group="scan lines",
    )
    maxGap: int = option(
        8,
        whole(0),
        "int",
        "Widest gap of invalid pixels on a scan line whose two sides are compared: occlusion shadows.",
        unit="pixels",
        group="scan lines",
    )
    maxSmear: int = option(
        5,
        whole(0),
        "int",
        "Most pixels of a scan line over which a step may be smeared, as interpolation and the footprint of a pixel do,"
        " to be one jump between the surfaces on either side. They are a surface of their own unless that is steep, or"
        " if more than two almost parallel to the viewing direction. 0 takes every pixel for a surface.",
        unit="pixels",
        group="scan lines",
    )
    shadowEdges: bool = option(
        True,
        _check.boolean,
        "bool",
        "Whether a surface that ends at a gap wider than `maxGap`, in front of another one beyond it, has a jump at its"
        " end: the outline of an object beside its shadow. A surface with a hole in it has none.",
        group="scan lines",
        kernel="shadows",
        flagged="a surface that ends at a gap wider than --max-gap, in front of another one beyond it, has a jump at"
        " its end: the outline of an object beside its shadow (default: yes)",
    )
    mergeSignificance: float = option(
        3.5,
        real(0),
        "float",
        "Cuts are taken back where that raises the sum of squared residuals by less than its square, in variances of"
        " the noise; a segment across an edge, or its rounding, is given to the surfaces beside it likewise. 0 keeps"
        " all.",
        group="scan lines",
    )
    minSignificance: float = option(
        7.0,
        real(0),
        "float",
        "Candidates are dropped whose significance, joined with that of their neighbours, is below this; 0 keeps all.",
        group="scan lines",
    )

    @classmethod
    def paper(cls, **options: Any) -> ScanLineParams:
        """The paper's basic setting: interpolating fits, cuts as they fall, nothing merged, every candidate kept.

        With it `lineSignificance=None` keeps all lines.
        """
        basic = {"fit": FIT_INTERP, "crease": CREASE_MAX, "maxShift": 0.0, "maxGap": 0, "maxSmear": 0}
        kept = {"shadowEdges": False, "mergeSignificance": 0.0, "minSignificance": 0.0}
        return cls(**{**basic, **kept, **options})


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Selection(Options):
    """Which strengths make an edge."""

    jumpThreshold: float | None = option(
        None,
        or_none(_check.threshold),
        "float or None",
        "Least depth step, in the unit of the image (that of the points; metres for integers and `depthFactor` 1000)."
        " None and 0: every step that exceeds the noise. ``numpy.inf`` switches jump edges off.",
        flagged="least jump, a length (default: any beyond the noise)",
    )
    creaseThreshold: float = option(
        30.0,
        _check.threshold,
        "float",
        "Least angle between the surfaces; the paper has 20 for quiet scanners and 30 for noisy ones. ``numpy.inf``"
        " switches crease edges off.",
        unit="degrees",
    )
    hysteresis: float = option(
        1.0,
        real(0, 1, above=True),
        "float",
        "Low thresholds as a fraction of the high ones, in (0, 1]; 1 is no hysteresis. Pixels that reach them count"
        " where they are connected to one that reaches the high ones.",
    )
    minLength: int = option(
        5,
        whole(1),
        "int",
        "Least length of a connected line, >= 1: the longer side of its bounding box.",
        unit="pixels",
    )
    lineSignificance: float | None = option(
        None,
        or_none(real(0)),
        "float or None",
        "Least significance of a line, >= 0: the root mean square of its pixels' significance, times the root of its"
        " length in units of 10 pixels. It may have gaps of two pixels. 0 keeps all lines. None: 20, or 0 where every"
        " candidate is kept (`minSignificance` = 0).",
        flagged="least significance of a line: the root mean square of its pixels', times the root of its length in"
        " units of 10 pixels; 0 keeps all (default: 20, or 0 with --min-significance 0)",
    )
    dynamic: bool = option(
        False,
        _check.boolean,
        "bool",
        "Whether to remove lines that do not stand out of the noise, by the statistics of all of them (Venkatesh and"
        " Rosin).",
        flagged="remove lines that do not stand out of the statistics of all; it needs these: --min-significance 0",
    )
    boundaryEdges: bool = option(
        False,
        _check.boolean,
        "bool",
        "Whether every border with pixels without data is an edge. Outlines beside shadow are edges without it, where"
        " another surface is seen beyond; see `shadowEdges`.",
        flagged="every border with pixels without data is an edge; see also --shadow-edges",
    )

    def of(self, params: ScanLineParams | None = None) -> Selection:
        """The same with a number for `lineSignificance`, for strengths measured with these parameters, if known."""
        if self.lineSignificance is not None:
            return self
        significant = params is None or params.minSignificance > 0
        return replace(self, lineSignificance=_LINE_SIGNIFICANCE if significant else 0.0)


def _of(kind: type[Options], *groups: str) -> dict[str, Option]:
    return {name: own for name, own in kind.options.items() if own.group in groups}


# What functions take as keywords.
GEOMETRY = _of(ScanLineParams, "geometry")
MEASURED = _of(ScanLineParams, "geometry", "noise")
SCAN_LINES = ScanLineParams.options
SELECTION = Selection.options
DETECTION = {**SCAN_LINES, **SELECTION}
SEEDING = Seeding.options
GROWING = {**MEASURED, **_of(Growing, "regions")}
SEGMENTING = {**MEASURED, **Growing.options}
LINKING = {**DETECTION, **Linking.options}
CLEANING = {**MEASURED, **Cleaning.options}
CLOSING = {**MEASURED, **Closing.options}
