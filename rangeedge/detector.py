"""The detector as one call, and as an object for streams of frames."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from . import _storage
from ._check import deliver, described, error, fail, public
from ._option import parsed, takes
from ._typed import Accessors
from .detection import run_detector
from .edges import EdgeStrength, measure_points, measure_strength
from .noise import measured_frame
from .options import DETECTION, SELECTION, ScanLineParams, Selection

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._typed import DetectionOptions, RefinementOptions

_OWN: Any = ...  # of an argument left out: the detector's own value


@takes(DETECTION)
def detectEdges(
    src: np.ndarray,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    eps: float | None = None,
    edges: np.ndarray | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[DetectionOptions],
) -> np.ndarray:
    """Find the edges of a range image as a map of lines one pixel wide.

    detectEdges(src[, jumpThreshold[, creaseThreshold[, eps[, edges]]]], *[, mask[, K[, ...]]]) -> edges

    What `cv2.Canny` is to intensities, for depths: `edgeStrength`, then `selectEdges`, then `thinEdges`. A pixel is an
    edge where

        jump >= jumpThreshold on the nearer side of the jump,  or  crease >= creaseThreshold,

    so the line along a jump lies on the surface that occludes the other. A crease pixel counts only where three of its
    neighbours are creases as well, lest lines fray; in an image of fewer than three rows or columns every one does.

    Parameters
    ----------
    src : ndarray
        (H, W) depth, or points (H, W, 3) or (H, W, 4), as in `edgeStrength`.
    edges : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    {options}

    Returns
    -------
    edges : ndarray of shape (H, W), CV_8U
        255 on edges, 0 elsewhere.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    See Also
    --------
    detectEdgesWithStrength : The same, and how strong every edge pixel is, and of which kind.
    createScanLineDetector : The same as an object that keeps its parameters from frame to frame.

    Notes
    -----
    Paper, 4 and 6.

    Examples
    --------
    >>> import cv2
    >>> import numpy as np
    >>> from rangeedge import detectEdges
    >>> depth = np.full((48, 64), 2.0)
    >>> depth[12:36, 16:48] = 1.5
    >>> edges = detectEdges(depth, jumpThreshold=0.1, noise=0.001)
    >>> cv2.boundingRect(edges)  # the rim of the nearer surface
    (16, 12, 32, 24)
    """
    given = {"jumpThreshold": jumpThreshold, "creaseThreshold": creaseThreshold, "eps": eps, **options}
    params, selection = parsed(given, ScanLineParams, Selection)
    return deliver("edges", run_detector(measured_frame(src, params, mask), params, selection)[0], edges)


@takes(DETECTION)
def detectEdgesWithStrength(
    src: np.ndarray,
    jumpThreshold: float | None = None,
    creaseThreshold: float = 30.0,
    eps: float | None = None,
    *,
    mask: np.ndarray | None = None,
    **options: Unpack[DetectionOptions],
) -> tuple[np.ndarray, EdgeStrength]:
    """Find the edges of a range image, and how strong every one is, and of which kind.

    detectEdgesWithStrength(src[, jumpThreshold[, creaseThreshold[, eps]]], *[, mask[, K[, ...]]]) -> edges, strength

    The scan lines are approximated once: `edges` is what `detectEdges` returns, `strength` what `edgeStrength` does.

    Parameters
    ----------
    src, mask
        As in `detectEdges`.
    {options}

    Returns
    -------
    edges : ndarray of shape (H, W), CV_8U
        255 on edges, 0 elsewhere.
    strength : EdgeStrength
        jump, crease, kind and significance of every candidate, whether it is among the edges or not.

    Raises
    ------
    rangeedge.error
        On a bad argument.

    Notes
    -----
    Paper, 4 and 6.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import detectEdgesWithStrength, kindNames
    >>> depth = np.full((48, 64), 2.0)
    >>> depth[12:36, 16:48] = 1.5
    >>> edges, strength = detectEdgesWithStrength(depth, noise=0.001)
    >>> float(strength.jump[edges > 0].min()), kindNames(strength.kind[20, 16])
    (0.5, 'jump occluding')
    """
    given = {"jumpThreshold": jumpThreshold, "creaseThreshold": creaseThreshold, "eps": eps, **options}
    params, selection = parsed(given, ScanLineParams, Selection)
    return run_detector(measured_frame(src, params, mask), params, selection)


@public
def createScanLineDetector(params: ScanLineParams | None = None) -> ScanLineDetector:
    """Create a detector that keeps its parameters, for streams of frames.

    createScanLineDetector([params]) -> retval

    Parameters
    ----------
    params : ScanLineParams, optional
        None takes every default.

    Returns
    -------
    retval : ScanLineDetector

    Raises
    ------
    rangeedge.error
        If `params` is no ScanLineParams.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import DIR_ROWS, ScanLineParams, createScanLineDetector
    >>> detector = createScanLineDetector(ScanLineParams(noise=0.001))
    >>> detector.setDirections(DIR_ROWS)
    >>> strength = detector.detect(np.where(np.arange(40) < 20, 1.0, 1.25) * np.ones((30, 1)))
    >>> float(strength.jump.max())
    0.25
    """
    if params is None:
        params = ScanLineParams()
    if not isinstance(params, ScanLineParams):
        raise fail("params", "a ScanLineParams or None", described(params))
    detector = ScanLineDetector()
    detector._params = params
    return detector


class ScanLineDetector(Accessors):
    """The edge detector as an object in the manner of `cv2.Algorithm`: parameters once, then frame after frame.

    Made by `createScanLineDetector`. Every option of `detectEdges` has a `setX` and a `getX`.
    `noise=None` estimates the noise of every frame; where that does not change,
    ``detector.setNoise(estimateNoise(frame))`` saves the time. Arrays are copied in, and those handed out are
    read-only. One detector may work in several threads at a time.

    Examples
    --------
    >>> import os, tempfile
    >>> from rangeedge import createScanLineDetector
    >>> detector = createScanLineDetector()
    >>> detector.setK([[525, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])
    >>> detector.setCreaseThreshold(20)
    >>> path = os.path.join(tempfile.mkdtemp(), "detector.yml")
    >>> detector.save(path)
    >>> other = createScanLineDetector()
    >>> other.load(path)
    >>> other.getK()[0].tolist(), other.getCreaseThreshold()
    ([525.0, 0.0, 319.5], 20.0)
    """

    __slots__ = ("_params", "_selection")

    def __init__(self) -> None:
        self.clear()

    if not TYPE_CHECKING:

        def __setattr__(self, name: str, value: Any) -> None:
            if name not in ScanLineDetector.__slots__:
                way_out = f"call {_setter(name)}({name})" if name in DETECTION else "its parameters have setters"
                raise AttributeError(f"ScanLineDetector has no attribute {name!r} to set; {way_out}")
            super().__setattr__(name, value)

    def _set(self, name: str, value: Any) -> None:
        try:
            if name in SELECTION:
                self._selection = replace(self._selection, **{name: value})
            else:
                self._params = replace(self._params, **{name: value})
        except error as problem:
            problem.name(f"ScanLineDetector.{_setter(name)}")
            raise

    def __repr__(self) -> str:
        return f"ScanLineDetector({', '.join(filter(None, (self._params.changed(), self._selection.changed())))})"

    @public
    def detect(self, src: np.ndarray, mask: np.ndarray | None = None) -> EdgeStrength:
        """Measure how strong an edge every pixel is, and of which kind, as `edgeStrength` does.

        detect(src[, mask]) -> jump, crease, kind, significance
        """
        params = self._params
        return measure_strength(measured_frame(src, params, mask), params)

    @public
    def detectPoints(self, src: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
        """Find the edge candidates with subpixel positions, as `edgePoints` does.

        detectPoints(src[, mask]) -> points
        """
        params = self._params
        return measure_points(measured_frame(src, params, mask), params)

    @takes(SELECTION, default=_OWN)
    def detectEdges(
        self,
        src: np.ndarray,
        jumpThreshold: float | None = _OWN,
        creaseThreshold: float = _OWN,
        edges: np.ndarray | None = None,
        *,
        mask: np.ndarray | None = None,
        **options: Unpack[RefinementOptions],
    ) -> np.ndarray:
        """Find the edges as a map of lines one pixel wide, as the function `detectEdges` does.

        detectEdges(src[, jumpThreshold[, creaseThreshold[, edges]]], *[, mask[, hysteresis[, ...]]]) -> edges

        Thresholds and what else selects edges are those of the detector, where none are given for this frame.
        """
        found, _ = self._run(src, mask, jumpThreshold, creaseThreshold, options)
        return deliver("edges", found, edges)

    @takes(SELECTION, default=_OWN)
    def detectEdgesWithStrength(
        self,
        src: np.ndarray,
        jumpThreshold: float | None = _OWN,
        creaseThreshold: float = _OWN,
        *,
        mask: np.ndarray | None = None,
        **options: Unpack[RefinementOptions],
    ) -> tuple[np.ndarray, EdgeStrength]:
        """Find the edges, and how strong each is and of which kind, as the function `detectEdgesWithStrength` does.

        detectEdgesWithStrength(src[, jumpThreshold[, creaseThreshold]], *[, mask[, ...]]) -> edges, strength
        """
        return self._run(src, mask, jumpThreshold, creaseThreshold, options)

    def _run(
        self, src: np.ndarray, mask: np.ndarray | None, jump: Any, crease: Any, options: Mapping[str, Any]
    ) -> tuple[np.ndarray, EdgeStrength]:
        thresholds = {"jumpThreshold": jump, "creaseThreshold": crease}
        given = {name: value for name, value in thresholds.items() if value is not _OWN}
        params, selection = self._params, replace(self._selection, **given, **options)
        return run_detector(measured_frame(src, params, mask), params, selection)

    def clear(self) -> None:
        """Give every parameter its default again.

        clear() -> None
        """
        self._params, self._selection = ScanLineParams(), Selection()

    def empty(self) -> bool:
        """Whether there is nothing to detect with: never.

        empty() -> retval
        """
        return False

    def getDefaultName(self) -> str:
        """The name of the node that `save` writes and `load` looks for.

        getDefaultName() -> retval
        """
        return "ScanLineDetector"

    @public
    def write(self, fs: cv2.FileStorage, name: str = "") -> None:
        """Write the parameters into an open file storage, as a node of that name where one is given.

        write(fs[, name]) -> None

        A parameter that is None is left out.
        """
        if not isinstance(fs, cv2.FileStorage) or not fs.isOpened():
            raise fail("fs", "a cv2.FileStorage opened for writing", described(fs))
        try:
            _storage.write(fs, name, {**vars(self._params), **vars(self._selection)})
        except cv2.error as problem:
            raise error(f"cannot write into `fs`: {problem.err}") from problem

    @public
    def read(self, node: cv2.FileNode) -> None:
        """Take over the parameters from a node of a file storage; those that it lacks get their defaults.

        read(node) -> None
        """
        if not isinstance(node, cv2.FileNode) or not node.isMap():
            raise fail("node", "a cv2.FileNode that maps parameters to values", described(node))
        self._params, self._selection = _parameters(**_storage.read(node))

    @public
    def save(self, filename: str | os.PathLike[str]) -> None:
        """Save the parameters to a file, for `load`.

        save(filename) -> None

        The suffix decides on the format: ``.xml``, ``.yml``, ``.yaml`` or ``.json``. Either the whole file is written
        or nothing.
        """
        _storage.save(filename, self.getDefaultName(), {**vars(self._params), **vars(self._selection)})

    @public
    def load(self, filename: str | os.PathLike[str]) -> None:
        """Take over the parameters from a file that `save` has written, or a person: XML, YAML or JSON.

        load(filename) -> None

        On any error the parameters stay as they were. A file of `save` that has lost its end is one.
        """
        name, values = _storage.load(filename, self.getDefaultName())
        try:
            self._params, self._selection = _parameters(**values)
        except error as problem:
            raise error(f"{name!r}: {problem.err}", problem.code) from None


@takes(DETECTION)
def _parameters(**options: Any) -> tuple[ScanLineParams, Selection]:
    """The parameters of these names; others are refused."""
    params, selection = parsed(options, ScanLineParams, Selection)
    return params, selection


def _setter(name: str) -> str:
    return f"set{name[0].upper()}{name[1:]}"
