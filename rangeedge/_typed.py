"""The options as editors and type checkers know them, by ``python tests/typed.py`` from `options.py`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .noise_model import NoiseModel
    from .options import ScanLineParams, Selection


class GeometryOptions(TypedDict, total=False):
    K: ArrayLike | str | os.PathLike[str] | None
    distCoeffs: ArrayLike | None
    imageSize: Sequence[int] | None
    pixelSize: float | Sequence[float] | None
    heightMap: bool
    depthFactor: float
    invalid: float | Sequence[float | Sequence[float]] | None
    origin: Sequence[float] | None


class ScanLineOptions(TypedDict, total=False):
    epsFactor: float
    K: ArrayLike | str | os.PathLike[str] | None
    distCoeffs: ArrayLike | None
    imageSize: Sequence[int] | None
    pixelSize: float | Sequence[float] | None
    heightMap: bool
    depthFactor: float
    invalid: float | Sequence[float | Sequence[float]] | None
    origin: Sequence[float] | None
    noise: NoiseModel | float | np.ndarray | None
    directions: int
    fit: int
    measure: int
    crease: int
    maxShift: float
    maxGap: int
    maxSmear: int
    shadowEdges: bool
    mergeSignificance: float
    minSignificance: float


class RefinementOptions(TypedDict, total=False):
    hysteresis: float
    minLength: int
    lineSignificance: float | None
    dynamic: bool
    boundaryEdges: bool


class SeedingOptions(TypedDict, total=False):
    minDistance: float
    separation: float


class GrowingOptions(TypedDict, total=False):
    K: ArrayLike | str | os.PathLike[str] | None
    distCoeffs: ArrayLike | None
    imageSize: Sequence[int] | None
    pixelSize: float | Sequence[float] | None
    heightMap: bool
    depthFactor: float
    invalid: float | Sequence[float | Sequence[float]] | None
    origin: Sequence[float] | None
    noise: NoiseModel | float | np.ndarray | None
    tolerance: float
    smoothAngle: float
    minArea: int


class SegmentingOptions(TypedDict, total=False):
    K: ArrayLike | str | os.PathLike[str] | None
    distCoeffs: ArrayLike | None
    imageSize: Sequence[int] | None
    pixelSize: float | Sequence[float] | None
    heightMap: bool
    depthFactor: float
    invalid: float | Sequence[float | Sequence[float]] | None
    origin: Sequence[float] | None
    noise: NoiseModel | float | np.ndarray | None
    minDistance: float
    separation: float
    tolerance: float
    smoothAngle: float
    minArea: int


class ClosingOptions(TypedDict, total=False):
    K: ArrayLike | str | os.PathLike[str] | None
    distCoeffs: ArrayLike | None
    imageSize: Sequence[int] | None
    pixelSize: float | Sequence[float] | None
    heightMap: bool
    depthFactor: float
    invalid: float | Sequence[float | Sequence[float]] | None
    origin: Sequence[float] | None
    noise: NoiseModel | float | np.ndarray | None
    tolerance: float
    share: float
    maxGap: int
    minArea: int


class CleaningOptions(TypedDict, total=False):
    K: ArrayLike | str | os.PathLike[str] | None
    distCoeffs: ArrayLike | None
    imageSize: Sequence[int] | None
    pixelSize: float | Sequence[float] | None
    heightMap: bool
    depthFactor: float
    invalid: float | Sequence[float | Sequence[float]] | None
    origin: Sequence[float] | None
    noise: NoiseModel | float | np.ndarray | None
    maxHole: int
    radius: float
    removeFlying: bool


class JoiningOptions(TypedDict, total=False):
    bridge: float
    cornerAngle: float


class DetectionOptions(ScanLineOptions, RefinementOptions, total=False):
    pass


class LinkingOptions(DetectionOptions, JoiningOptions, total=False):
    pass


class Accessors:
    """`setX` and `getX` of every option of `detectEdges`."""

    __slots__ = ()
    _params: ScanLineParams
    _selection: Selection

    def _set(self, name: str, value: Any) -> None:
        raise NotImplementedError

    def getEps(self) -> float | None:
        """getEps() -> retval

        Splitting tolerance as a length, at the pixel's depth with a camera (paper, 4.1). None: `epsFactor` times the
        noise.
        """
        return self._params.eps

    def setEps(self, eps: float | None, /) -> None:
        """setEps(eps) -> None

        Splitting tolerance as a length, at the pixel's depth with a camera (paper, 4.1). None: `epsFactor` times the
        noise.
        """
        self._set("eps", eps)

    def getEpsFactor(self) -> float:
        """getEpsFactor() -> retval

        Splitting tolerance in standard deviations of the noise.
        """
        return self._params.epsFactor

    def setEpsFactor(self, epsFactor: float, /) -> None:
        """setEpsFactor(epsFactor) -> None

        Splitting tolerance in standard deviations of the noise.
        """
        self._set("epsFactor", epsFactor)

    def getK(self) -> np.ndarray | None:
        """getK() -> retval

        Camera; the values of `src` are then depths along the optical axis. (fx, fy, cx, cy), 3x3, 3x4, 9 numbers by
        rows, or the name of a file of one (YAML, JSON or XML of cv2, ROS, Open3D or librealsense, text, NPY, NPZ),
        whose distortion replaces `distCoeffs`, and whose image size `src` must have.
        """
        return self._params.K  # type: ignore[return-value]

    def setK(self, K: ArrayLike | str | os.PathLike[str] | None, /) -> None:
        """setK(K) -> None

        Camera; the values of `src` are then depths along the optical axis. (fx, fy, cx, cy), 3x3, 3x4, 9 numbers by
        rows, or the name of a file of one (YAML, JSON or XML of cv2, ROS, Open3D or librealsense, text, NPY, NPZ),
        whose distortion replaces `distCoeffs`, and whose image size `src` must have.
        """
        self._set("K", K)

    def getDistCoeffs(self) -> np.ndarray | None:
        """getDistCoeffs() -> retval

        Distortion of the lens with `K`, as cv2 has it: (k1, k2, p1, p2[, k3[, k4, k5, k6[, ...]]]).
        """
        return self._params.distCoeffs  # type: ignore[return-value]

    def setDistCoeffs(self, distCoeffs: ArrayLike | None, /) -> None:
        """setDistCoeffs(distCoeffs) -> None

        Distortion of the lens with `K`, as cv2 has it: (k1, k2, p1, p2[, k3[, k4, k5, k6[, ...]]]).
        """
        self._set("distCoeffs", distCoeffs)

    def getImageSize(self) -> tuple[int, int] | None:
        """getImageSize() -> retval

        Width and height of the images that `K` holds for: others, resized or cropped, are refused. None: that of the
        camera's file, where it tells one.
        """
        return self._params.imageSize  # type: ignore[return-value]

    def setImageSize(self, imageSize: Sequence[int] | None, /) -> None:
        """setImageSize(imageSize) -> None

        Width and height of the images that `K` holds for: others, resized or cropped, are refused. None: that of the
        camera's file, where it tells one.
        """
        self._set("imageSize", imageSize)

    def getPixelSize(self) -> tuple[float, float] | None:
        """getPixelSize() -> retval

        Spacing (dx, dy) of a regular grid in the unit of its values; None is 1.
        """
        return self._params.pixelSize  # type: ignore[return-value]

    def setPixelSize(self, pixelSize: float | Sequence[float] | None, /) -> None:
        """setPixelSize(pixelSize) -> None

        Spacing (dx, dy) of a regular grid in the unit of its values; None is 1.
        """
        self._set("pixelSize", pixelSize)

    def getHeightMap(self) -> bool:
        """getHeightMap() -> retval

        Whether larger values are nearer to the viewer.
        """
        return self._params.heightMap

    def setHeightMap(self, heightMap: bool, /) -> None:
        """setHeightMap(heightMap) -> None

        Whether larger values are nearer to the viewer.
        """
        self._set("heightMap", heightMap)

    def getDepthFactor(self) -> float:
        """getDepthFactor() -> retval

        Divides integer values: 1000 makes metres of millimetres. Integer 0 is invalid.
        """
        return self._params.depthFactor

    def setDepthFactor(self, depthFactor: float, /) -> None:
        """setDepthFactor(depthFactor) -> None

        Divides integer values: 1000 makes metres of millimetres. Integer 0 is invalid.
        """
        self._set("depthFactor", depthFactor)

    def getInvalid(self) -> tuple[tuple[float, float], ...] | None:
        """getInvalid() -> retval

        What `src` holds where there is no data, as stored there: a value; several, (0, 65535); and ranges, which are
        pairs among them with both ends included: [(8, inf)] leaves out 8 and more, [-9999, (8, inf)] both. () says that
        every finite value is one. A point is left out whose coordinates all have the value, or whose third coordinate
        lies in the range.
        """
        return self._params.invalid  # type: ignore[return-value]

    def setInvalid(self, invalid: float | Sequence[float | Sequence[float]] | None, /) -> None:
        """setInvalid(invalid) -> None

        What `src` holds where there is no data, as stored there: a value; several, (0, 65535); and ranges, which are
        pairs among them with both ends included: [(8, inf)] leaves out 8 and more, [-9999, (8, inf)] both. () says that
        every finite value is one. A point is left out whose coordinates all have the value, or whose third coordinate
        lies in the range.
        """
        self._set("invalid", invalid)

    def getOrigin(self) -> tuple[float, float, float] | None:
        """getOrigin() -> retval

        Where points were seen from, in their own frame. None: (0, 0, 0) where their rays meet there, else the place
        that the rows and columns tell.
        """
        return self._params.origin  # type: ignore[return-value]

    def setOrigin(self, origin: Sequence[float] | None, /) -> None:
        """setOrigin(origin) -> None

        Where points were seen from, in their own frame. None: (0, 0, 0) where their rays meet there, else the place
        that the rows and columns tell.
        """
        self._set("origin", origin)

    def getNoise(self) -> NoiseModel | float | np.ndarray | None:
        """getNoise() -> retval

        Standard deviation of the values as lengths; None estimates it from the image (`estimateNoise`).
        """
        return self._params.noise

    def setNoise(self, noise: NoiseModel | float | np.ndarray | None, /) -> None:
        """setNoise(noise) -> None

        Standard deviation of the values as lengths; None estimates it from the image (`estimateNoise`).
        """
        self._set("noise", noise)

    def getDirections(self) -> int:
        """getDirections() -> retval

        Scan lines to use: DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135 combined by `|`, or DIR_ALL.
        """
        return self._params.directions

    def setDirections(self, directions: int, /) -> None:
        """setDirections(directions) -> None

        Scan lines to use: DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135 combined by `|`, or DIR_ALL.
        """
        self._set("directions", directions)

    def getFit(self) -> int:
        """getFit() -> retval

        FIT_LSQ, least squares over a segment, a line unless a quadratic is significant; or FIT_INTERP, the quadratic
        through end points and midpoint. With FIT_INTERP cuts stay as they fall.
        """
        return self._params.fit

    def setFit(self, fit: int, /) -> None:
        """setFit(fit) -> None

        FIT_LSQ, least squares over a segment, a line unless a quadratic is significant; or FIT_INTERP, the quadratic
        through end points and midpoint. With FIT_INTERP cuts stay as they fall.
        """
        self._set("fit", fit)

    def getMeasure(self) -> int:
        """getMeasure() -> retval

        MEASURE_MIDPOINT, strengths where the edge is; or MEASURE_ENDPOINT, extrapolated from either end point.
        """
        return self._params.measure

    def setMeasure(self, measure: int, /) -> None:
        """setMeasure(measure) -> None

        MEASURE_MIDPOINT, strengths where the edge is; or MEASURE_ENDPOINT, extrapolated from either end point.
        """
        self._set("measure", measure)

    def getCrease(self) -> int:
        """getCrease() -> retval

        CREASE_NORMAL, the angle between the surface normals, which the tangents of several scan lines give; or
        CREASE_MAX, the largest directional angle (paper, 4.2).
        """
        return self._params.crease

    def setCrease(self, crease: int, /) -> None:
        """setCrease(crease) -> None

        CREASE_NORMAL, the angle between the surface normals, which the tangents of several scan lines give; or
        CREASE_MAX, the largest directional angle (paper, 4.2).
        """
        self._set("crease", crease)

    def getMaxShift(self) -> float:
        """getMaxShift() -> retval

        How far the adapted edge position may lie from the cut (paper, 4.2, Fig. 5); 0 keeps the cut.
        """
        return self._params.maxShift

    def setMaxShift(self, maxShift: float, /) -> None:
        """setMaxShift(maxShift) -> None

        How far the adapted edge position may lie from the cut (paper, 4.2, Fig. 5); 0 keeps the cut.
        """
        self._set("maxShift", maxShift)

    def getMaxGap(self) -> int:
        """getMaxGap() -> retval

        Widest gap of invalid pixels on a scan line whose two sides are compared: occlusion shadows.
        """
        return self._params.maxGap

    def setMaxGap(self, maxGap: int, /) -> None:
        """setMaxGap(maxGap) -> None

        Widest gap of invalid pixels on a scan line whose two sides are compared: occlusion shadows.
        """
        self._set("maxGap", maxGap)

    def getMaxSmear(self) -> int:
        """getMaxSmear() -> retval

        Most pixels of a scan line over which a step may be smeared, as interpolation and the footprint of a pixel do,
        to be one jump between the surfaces on either side. They are a surface of their own unless that is steep, or if
        more than two almost parallel to the viewing direction. 0 takes every pixel for a surface.
        """
        return self._params.maxSmear

    def setMaxSmear(self, maxSmear: int, /) -> None:
        """setMaxSmear(maxSmear) -> None

        Most pixels of a scan line over which a step may be smeared, as interpolation and the footprint of a pixel do,
        to be one jump between the surfaces on either side. They are a surface of their own unless that is steep, or if
        more than two almost parallel to the viewing direction. 0 takes every pixel for a surface.
        """
        self._set("maxSmear", maxSmear)

    def getShadowEdges(self) -> bool:
        """getShadowEdges() -> retval

        Whether a surface that ends at a gap wider than `maxGap`, in front of another one beyond it, has a jump at its
        end: the outline of an object beside its shadow. A surface with a hole in it has none.
        """
        return self._params.shadowEdges

    def setShadowEdges(self, shadowEdges: bool, /) -> None:
        """setShadowEdges(shadowEdges) -> None

        Whether a surface that ends at a gap wider than `maxGap`, in front of another one beyond it, has a jump at its
        end: the outline of an object beside its shadow. A surface with a hole in it has none.
        """
        self._set("shadowEdges", shadowEdges)

    def getMergeSignificance(self) -> float:
        """getMergeSignificance() -> retval

        Cuts are taken back where that raises the sum of squared residuals by less than its square, in variances of the
        noise; a segment across an edge, or its rounding, is given to the surfaces beside it likewise. 0 keeps all.
        """
        return self._params.mergeSignificance

    def setMergeSignificance(self, mergeSignificance: float, /) -> None:
        """setMergeSignificance(mergeSignificance) -> None

        Cuts are taken back where that raises the sum of squared residuals by less than its square, in variances of the
        noise; a segment across an edge, or its rounding, is given to the surfaces beside it likewise. 0 keeps all.
        """
        self._set("mergeSignificance", mergeSignificance)

    def getMinSignificance(self) -> float:
        """getMinSignificance() -> retval

        Candidates are dropped whose significance, joined with that of their neighbours, is below this; 0 keeps all.
        """
        return self._params.minSignificance

    def setMinSignificance(self, minSignificance: float, /) -> None:
        """setMinSignificance(minSignificance) -> None

        Candidates are dropped whose significance, joined with that of their neighbours, is below this; 0 keeps all.
        """
        self._set("minSignificance", minSignificance)

    def getJumpThreshold(self) -> float | None:
        """getJumpThreshold() -> retval

        Least depth step, in the unit of the image (that of the points; metres for integers and `depthFactor` 1000).
        None and 0: every step that exceeds the noise. ``numpy.inf`` switches jump edges off.
        """
        return self._selection.jumpThreshold

    def setJumpThreshold(self, jumpThreshold: float | None, /) -> None:
        """setJumpThreshold(jumpThreshold) -> None

        Least depth step, in the unit of the image (that of the points; metres for integers and `depthFactor` 1000).
        None and 0: every step that exceeds the noise. ``numpy.inf`` switches jump edges off.
        """
        self._set("jumpThreshold", jumpThreshold)

    def getCreaseThreshold(self) -> float:
        """getCreaseThreshold() -> retval

        Least angle between the surfaces; the paper has 20 for quiet scanners and 30 for noisy ones. ``numpy.inf``
        switches crease edges off.
        """
        return self._selection.creaseThreshold

    def setCreaseThreshold(self, creaseThreshold: float, /) -> None:
        """setCreaseThreshold(creaseThreshold) -> None

        Least angle between the surfaces; the paper has 20 for quiet scanners and 30 for noisy ones. ``numpy.inf``
        switches crease edges off.
        """
        self._set("creaseThreshold", creaseThreshold)

    def getHysteresis(self) -> float:
        """getHysteresis() -> retval

        Low thresholds as a fraction of the high ones, in (0, 1]; 1 is no hysteresis. Pixels that reach them count where
        they are connected to one that reaches the high ones.
        """
        return self._selection.hysteresis

    def setHysteresis(self, hysteresis: float, /) -> None:
        """setHysteresis(hysteresis) -> None

        Low thresholds as a fraction of the high ones, in (0, 1]; 1 is no hysteresis. Pixels that reach them count where
        they are connected to one that reaches the high ones.
        """
        self._set("hysteresis", hysteresis)

    def getMinLength(self) -> int:
        """getMinLength() -> retval

        Least length of a connected line, >= 1: the longer side of its bounding box.
        """
        return self._selection.minLength

    def setMinLength(self, minLength: int, /) -> None:
        """setMinLength(minLength) -> None

        Least length of a connected line, >= 1: the longer side of its bounding box.
        """
        self._set("minLength", minLength)

    def getLineSignificance(self) -> float | None:
        """getLineSignificance() -> retval

        Least significance of a line, >= 0: the root mean square of its pixels' significance, times the root of its
        length in units of 10 pixels. It may have gaps of two pixels. 0 keeps all lines. None: 20, or 0 where every
        candidate is kept (`minSignificance` = 0).
        """
        return self._selection.lineSignificance

    def setLineSignificance(self, lineSignificance: float | None, /) -> None:
        """setLineSignificance(lineSignificance) -> None

        Least significance of a line, >= 0: the root mean square of its pixels' significance, times the root of its
        length in units of 10 pixels. It may have gaps of two pixels. 0 keeps all lines. None: 20, or 0 where every
        candidate is kept (`minSignificance` = 0).
        """
        self._set("lineSignificance", lineSignificance)

    def getDynamic(self) -> bool:
        """getDynamic() -> retval

        Whether to remove lines that do not stand out of the noise, by the statistics of all of them (Venkatesh and
        Rosin).
        """
        return self._selection.dynamic

    def setDynamic(self, dynamic: bool, /) -> None:
        """setDynamic(dynamic) -> None

        Whether to remove lines that do not stand out of the noise, by the statistics of all of them (Venkatesh and
        Rosin).
        """
        self._set("dynamic", dynamic)

    def getBoundaryEdges(self) -> bool:
        """getBoundaryEdges() -> retval

        Whether every border with pixels without data is an edge. Outlines beside shadow are edges without it, where
        another surface is seen beyond; see `shadowEdges`.
        """
        return self._selection.boundaryEdges

    def setBoundaryEdges(self, boundaryEdges: bool, /) -> None:
        """setBoundaryEdges(boundaryEdges) -> None

        Whether every border with pixels without data is an edge. Outlines beside shadow are edges without it, where
        another surface is seen beyond; see `shadowEdges`.
        """
        self._set("boundaryEdges", boundaryEdges)
