"""The detector as one call, and as an object for streams of frames."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from ._args import (
    array,
    boolean,
    camera_matrix,
    deliver,
    described,
    error,
    errors_of,
    fail,
    number,
    pixel_size,
)
from ._constants import EDGE_BOUNDARY, EDGE_OCCLUDING
from ._files import write_atomically
from .edges import (
    EdgeStrength,
    ScanLineParams,
    frame_of,
    params_of,
    points_of,
    strength_of,
    takes_scan_line_params,
)
from .geometry import RangeFrame
from .noise import NoiseModel
from .selection import Selection, at_least, selected
from .thinning import thinEdges

_SUFFIXES = (".xml", ".yml", ".yaml", ".json")  # by which cv2.FileStorage knows the format
_OPENING, _CLOSING = "savedBy", "complete"  # the first and the last key of a file that `save` has written


_DEFAULT = Selection()


class FoundEdges(NamedTuple):
    """What `detectEdges` computes on the way."""

    strength: EdgeStrength
    selected: np.ndarray
    thin: np.ndarray


@takes_scan_line_params
def detectEdges(
    src: np.ndarray,
    jumpThreshold: float | None = None,
    creaseThreshold: float = _DEFAULT.creaseThreshold,
    eps: float | None = None,
    edges: np.ndarray | None = None,
    *,
    mask: np.ndarray | None = None,
    hysteresis: float = _DEFAULT.hysteresis,
    minLength: int = _DEFAULT.minLength,
    dynamic: bool = False,
    boundaryEdges: bool = False,
    **options: Any,
) -> np.ndarray:
    """Find the edges of a range image as a map of lines one pixel wide.

    detectEdges(src[, jumpThreshold[, creaseThreshold[, eps[, edges]]]], *[, mask[, hysteresis[, ...]]]) -> edges

    What `cv2.Canny` is to intensities, for depths: `edgeStrength`, then `selectEdges`, then `thinEdges`. A pixel is an
    edge where

        jump >= jumpThreshold on the nearer side of the jump,  or  crease >= creaseThreshold,

    so the line along a jump lies on the surface that occludes the other. A crease pixel counts only where three of its
    neighbours are creases as well, lest lines fray; in an image of fewer than three rows or columns every one does.

    Parameters
    ----------
    src : ndarray
        (H, W) depth, or points (H, W, 3) or (H, W, 4), as in `edgeStrength`.
    jumpThreshold : float, optional
        Least depth step, in the unit of the image (that of the points; metres for integers and `depthFactor` 1000).
        None and 0: every step that exceeds the noise. ``numpy.inf`` switches jump edges off.
    creaseThreshold : float
        Least angle between the surfaces in degrees; the paper has 20 for quiet scanners and 30 for noisy ones.
        ``numpy.inf`` switches crease edges off.
    eps : float, optional
        Splitting tolerance as a length; None derives it from the noise.
    edges : ndarray of shape (H, W), CV_8U, optional
        Receives the result where shape and type fit.
    mask : ndarray of shape (H, W), 8-bit or bool, optional
        Non-zero where pixels are used.
    hysteresis : float
        Low thresholds as a fraction of the high ones, in (0, 1]; 1 is no hysteresis. See `selectEdges`.
    minLength : int
        Least length of a connected line in pixels, >= 1.
    dynamic : bool
        Whether to remove lines that do not stand out of the noise, by the statistics of all of them.
    boundaryEdges : bool
        Whether every border with pixels without data is an edge. Outlines beside shadow are edges without it, where
        another surface is seen beyond; see `shadowEdges` of `ScanLineParams`.
    K, pixelSize, heightMap, depthFactor, noise, directions, fit, measure, crease, maxShift, maxGap, ...
        As in `ScanLineParams`, which holds the defaults.

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
    edgeStrength : How strong every edge pixel is, and of which kind.
    createScanLineDetector : The same as an object that keeps its parameters from frame to frame.

    Notes
    -----
    Jiang and Bunke, sections 4 and 6.

    Examples
    --------
    >>> import cv2, numpy as np
    >>> depth = np.full((48, 64), 2.0)
    >>> depth[12:36, 16:48] = 1.5
    >>> edges = detectEdges(depth, jumpThreshold=0.1, noise=0.001)
    >>> cv2.boundingRect(edges)  # the rim of the nearer surface
    (16, 12, 32, 24)
    """
    func = "detectEdges"
    params = params_of(func, eps, options)
    selection = Selection(jumpThreshold, creaseThreshold, hysteresis, minLength, dynamic, boundaryEdges).checked(func)
    found = found_edges(func, frame_of(func, src, params, mask), params, selection)
    return deliver(func, "edges", found.thin, edges)


def found_edges(func: str, frame: RangeFrame, params: ScanLineParams, selection: Selection) -> FoundEdges:
    """The edges of a checked range image, by checked parameters."""
    strength = strength_of(func, frame, params)
    selected = selected_of(strength, selection)
    return FoundEdges(strength, selected, thinEdges(selected))


def selected_of(strength: EdgeStrength, selection: Selection) -> np.ndarray:
    """The edge map before thinning: jumps on their nearer side, creases that do not stand alone, borders on request."""
    jump = cv2.copyTo(strength.jump, strength.kind & np.uint8(EDGE_OCCLUDING))
    crease = _unfrayed(strength.crease, selection.hysteresis * selection.creaseThreshold)
    edges = selected(jump, crease, selection)
    if selection.boundaryEdges:
        edges[strength.kind & EDGE_BOUNDARY > 0] = 255
    return edges


def _unfrayed(crease: np.ndarray, least: float) -> np.ndarray:
    """Creases without stray pixels: of the nine around one that stays, four reach `least`.

    In an image of one or two rows or columns lines cannot have so many neighbours: all its creases stay.
    """
    if min(crease.shape) < 3:
        return crease
    strong = at_least(crease, least).view(np.uint8)
    around = cv2.boxFilter(strong, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return cv2.copyTo(crease, (around >= 4).view(np.uint8))


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
        If `params` is no ScanLineParams, or its `K`, `pixelSize` or `noise` is none.

    Examples
    --------
    >>> detector = createScanLineDetector(ScanLineParams(noise=0.001))
    >>> detector.setDirections(1)
    >>> strength = detector.detect(np.where(np.arange(40) < 20, 1.0, 1.25) * np.ones((30, 1)))
    >>> float(strength.jump.max())
    0.25
    """
    if params is None:
        params = ScanLineParams()
    if not isinstance(params, ScanLineParams):
        raise fail("createScanLineDetector", "params", "a ScanLineParams or None", described(params))
    detector = ScanLineDetector()
    detector._params = _owned("createScanLineDetector", params)
    return detector


def _with_accessors(cls: type) -> type:
    """Give the class `setX` and `getX` for every field of ScanLineParams, documented as there."""
    texts = dict(re.findall(r"^(\w+) : .*\n((?:    .*\n)+)", inspect.getdoc(ScanLineParams) or "", re.MULTILINE))
    for field in fields(ScanLineParams):
        name, upper = field.name, field.name[0].upper() + field.name[1:]
        text = inspect.cleandoc(texts.get(name, ""))
        for method, doc in (
            (_getter(name), f"get{upper}() -> retval\n\n{text}"),
            (_setter(name, f"{cls.__name__}.set{upper}"), f"set{upper}({name}) -> None\n\n{text}"),
        ):
            method.__name__ = doc.split("(")[0]
            method.__qualname__ = f"{cls.__qualname__}.{method.__name__}"
            method.__doc__ = doc
            setattr(cls, method.__name__, method)
    return cls


def _getter(name: str) -> Callable[[ScanLineDetector], Any]:
    def get(self: ScanLineDetector) -> Any:
        return getattr(self._params, name)

    return get


def _setter(name: str, func: str) -> Callable[[ScanLineDetector, Any], None]:
    def set_(self: ScanLineDetector, value: Any, /) -> None:
        with errors_of(func):
            self._params = _owned(func, replace(self._params, **{name: value}))

    return set_


@_with_accessors
class ScanLineDetector:
    """The edge detector as an object in the manner of `cv2.Algorithm`: parameters once, then frame after frame.

    Made by `createScanLineDetector`. Every field of `ScanLineParams` has a `setX` and a `getX`. `noise=None` estimates
    the noise of every frame; where that does not change, ``detector.setNoise(estimateNoise(frame))`` saves the time.
    Arrays are copied in, and those handed out are read-only. One detector may work in several threads at a time.

    Examples
    --------
    >>> import os, tempfile
    >>> detector = createScanLineDetector()
    >>> detector.setK([[525, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])
    >>> path = os.path.join(tempfile.mkdtemp(), "detector.yml")
    >>> detector.save(path)
    >>> other = createScanLineDetector()
    >>> other.load(path)
    >>> other.getK()[0].tolist()
    [525.0, 0.0, 319.5]
    """

    def __init__(self) -> None:
        self._params = ScanLineParams()

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Callable[..., Any]:
            """`setX` and `getX` of every field of ScanLineParams."""

    def __repr__(self) -> str:
        defaults = vars(ScanLineParams())
        own = ((name, value) for name, value in vars(self._params).items() if not np.array_equal(value, defaults[name]))
        return f"ScanLineDetector({', '.join(f'{name}={described(value)}' for name, value in own)})"

    def detect(self, src: np.ndarray, mask: np.ndarray | None = None) -> EdgeStrength:
        """Measure how strong an edge every pixel is, and of which kind, as `edgeStrength` does.

        detect(src[, mask]) -> jump, crease, kind, significance
        """
        params, func = self._params, "ScanLineDetector.detect"
        return strength_of(func, frame_of(func, src, params, mask), params)

    def detectPoints(self, src: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
        """Find the edge candidates with subpixel positions, as `edgePoints` does.

        detectPoints(src[, mask]) -> points
        """
        params, func = self._params, "ScanLineDetector.detectPoints"
        return points_of(func, frame_of(func, src, params, mask), params)

    def detectEdges(
        self,
        src: np.ndarray,
        jumpThreshold: float | None = None,
        creaseThreshold: float = _DEFAULT.creaseThreshold,
        edges: np.ndarray | None = None,
        *,
        mask: np.ndarray | None = None,
        hysteresis: float = _DEFAULT.hysteresis,
        minLength: int = _DEFAULT.minLength,
        dynamic: bool = False,
        boundaryEdges: bool = False,
    ) -> np.ndarray:
        """Find the edges as a map of lines one pixel wide, as the function `detectEdges` does.

        detectEdges(src[, jumpThreshold[, creaseThreshold[, edges]]], *[, mask[, hysteresis[, ...]]]) -> edges
        """
        params, func = self._params, "ScanLineDetector.detectEdges"
        selection = Selection(jumpThreshold, creaseThreshold, hysteresis, minLength, dynamic, boundaryEdges).checked(
            func
        )
        found = found_edges(func, frame_of(func, src, params, mask), params, selection)
        return deliver(func, "edges", found.thin, edges)

    def clear(self) -> None:
        """Give every parameter its default again.

        clear() -> None
        """
        self._params = ScanLineParams()

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

    def write(self, fs: cv2.FileStorage, name: str = "") -> None:
        """Write the parameters into an open file storage, as a node of that name where one is given.

        write(fs[, name]) -> None

        A parameter that is None is left out.
        """
        func = "ScanLineDetector.write"
        if not isinstance(fs, cv2.FileStorage) or not fs.isOpened():
            raise fail(func, "fs", "a cv2.FileStorage opened for writing", described(fs))
        try:
            if name:
                fs.startWriteStruct(name, cv2.FileNode_MAP)
            for key, value in vars(self._params).items():
                _write_node(fs, key, value)
            if name:
                fs.endWriteStruct()
        except cv2.error as problem:
            raise error(func, f"cannot write into `fs`: {problem.err}") from problem

    def read(self, node: cv2.FileNode) -> None:
        """Take over the parameters from a node of a file storage; those that it lacks get their defaults.

        read(node) -> None
        """
        func = "ScanLineDetector.read"
        if not isinstance(node, cv2.FileNode) or not node.isMap():
            raise fail(func, "node", "a cv2.FileNode that maps parameters to values", described(node))
        with errors_of(func):
            self._params = _owned(func, _params_in(func, node))

    def save(self, filename: str | os.PathLike[str]) -> None:
        """Save the parameters to a file, for `load`.

        save(filename) -> None

        The suffix decides on the format: ``.xml``, ``.yml``, ``.yaml`` or ``.json``. Either the whole file is written
        or nothing.
        """
        func = "ScanLineDetector.save"
        name = _file_name(func, filename)
        suffix = Path(name).suffix.lower()
        if suffix not in _SUFFIXES:
            raise fail(func, "filename", f"a file name with one of the suffixes {' '.join(_SUFFIXES)}", repr(name))
        fs = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
        fs.write(_OPENING, "rangeedge")
        self.write(fs, self.getDefaultName())
        fs.write(_CLOSING, 1)
        try:
            write_atomically(name, fs.releaseAndGetString().encode())
        except (OSError, ValueError) as reason:
            what = getattr(reason, "strerror", None) or reason
            raise error(func, f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason

    def load(self, filename: str | os.PathLike[str]) -> None:
        """Take over the parameters from a file that `save` has written, or a person: XML, YAML or JSON.

        load(filename) -> None

        On any error the parameters stay as they were. A file of `save` that has lost its end is one.
        """
        func = "ScanLineDetector.load"
        name = _file_name(func, filename)
        try:
            text = Path(name).read_text("utf-8")
        except (OSError, ValueError) as reason:
            what = getattr(reason, "strerror", None) or reason
            raise error(func, f"cannot read {name!r}: {what}", cv2.Error.StsObjectNotFound) from reason
        fs = cv2.FileStorage()
        try:
            fs.open(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
            node = fs.getNode(self.getDefaultName())
            whole = fs.getNode(_OPENING).empty() or fs.getNode(_CLOSING).real() == 1
        except cv2.error as problem:
            raise error(func, f"cannot read {name!r}: {problem.err}", cv2.Error.StsParseError) from problem
        if not node.isMap():
            raise error(func, f"{name!r} holds no `{self.getDefaultName()}`", cv2.Error.StsParseError)
        if not whole:
            raise error(func, f"{name!r} is not complete", cv2.Error.StsParseError)
        try:
            self.read(node)
        except error as problem:
            raise error(func, f"{name!r}: {problem.err}", problem.code) from None


_PLAIN = {"bool": bool, "int": int, "float": float, "float | None": float}  # fields of ScanLineParams, as annotated


def _owned(func: str, params: ScanLineParams) -> ScanLineParams:
    """Parameters with every value checked and of its own type, which nobody else can change."""
    boolean(func, "heightMap", params.heightMap)
    number(func, "depthFactor", params.depthFactor, 0, above=True)
    K, pixelSize, noise = params.K, params.pixelSize, params.noise
    if isinstance(noise, np.ndarray):
        noise = _frozen(array(func, "noise", noise, "a real array of shape (H, W)").astype(np.float32))
    elif noise is not None and not isinstance(noise, NoiseModel):
        noise = number(func, "noise", noise, 0, above=True)
    plain = {f.name: _PLAIN[f.type] for f in fields(params) if f.type in _PLAIN}
    given = {name: value for name, value in vars(params).items() if value is not None}
    return replace(
        params,
        **{name: plain[name](value) for name, value in given.items() if name in plain},
        K=None if K is None else _frozen(camera_matrix(func, "K", K)),
        pixelSize=None if pixelSize is None else pixel_size(func, "pixelSize", pixelSize),
        noise=noise,
    )


def _frozen(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


def _file_name(func: str, filename: Any) -> str:
    if not isinstance(filename, (str, os.PathLike)):
        raise fail(func, "filename", "a file name", type(filename).__name__)
    return os.fsdecode(filename)


def _write_node(fs: cv2.FileStorage, name: str, value: Any) -> None:
    if value is None:
        return
    if isinstance(value, NoiseModel):
        fs.startWriteStruct(name, cv2.FileNode_MAP)
        for key, coefficient in asdict(value).items():
            fs.write(key, float(coefficient))
        fs.endWriteStruct()
    elif isinstance(value, tuple):
        fs.startWriteStruct(name, cv2.FileNode_SEQ)
        for element in value:
            fs.write("", element)
        fs.endWriteStruct()
    elif isinstance(value, np.ndarray):
        fs.write(name, value)
    elif isinstance(value, (bool, int)):
        fs.write(name, int(value))
    else:
        fs.write(name, float(value))


def _params_in(func: str, node: cv2.FileNode) -> ScanLineParams:
    options = {name: _node_value(func, node.getNode(name)) for name in node.keys()}  # noqa: SIM118
    for field in fields(ScanLineParams):
        value = options.get(field.name)
        if isinstance(field.default, bool) and isinstance(value, int) and value in (0, 1):
            options[field.name] = bool(value)  # a file storage knows no bool
    if isinstance(options.get("noise"), dict):
        try:
            options["noise"] = NoiseModel(**options["noise"])
        except TypeError:
            raise fail(func, "noise", "a number, an array, or a, b, c, correlation", options["noise"]) from None
    return params_of(func, options.pop("eps", None), options)


def _node_value(func: str, node: cv2.FileNode) -> Any:
    """What `_write_node` has written, in the types of Python."""
    if node.isInt():
        return int(node.real())
    if node.isReal():
        return node.real()
    if node.isSeq():
        return tuple(_node_value(func, node.at(i)) for i in range(node.size()))
    if not node.isMap():
        return node.string() if node.isString() else None
    keys = node.keys()
    if "dt" in keys:
        try:
            return node.mat()
        except cv2.error as problem:
            raise error(func, f"`{node.name()}` is a damaged matrix: {problem.err}", problem.code) from problem
    return {key: _node_value(func, node.getNode(key)) for key in keys}
