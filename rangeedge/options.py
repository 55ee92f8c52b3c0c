"""Every option, once: its default, its check, what it means, and how the command line spells it.

A class of options is a frozen dataclass, whose fields are made by `option`; it checks its values when it is made, and
keeps each in its own type. From it come the keywords of the functions (`takes`), their signatures and documentation,
the accessors of the detector and the types of all of them (`_typed.py`, which ``python tests/typed.py`` writes), the
flags of the command line, and what a detector saves: every field of `ScanLineParams` and of `Selection`.
"""

from __future__ import annotations

import difflib
import functools
import inspect
import textwrap
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from . import _check, _parse
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

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Check = Callable[[str, Any], Any]  # of a name and a value; returns the value in its own type
_Function = TypeVar("_Function", bound=Callable[..., Any])
_Kind = TypeVar("_Kind", bound="Options")


@dataclass(frozen=True)
class Option:
    """All that is known about an option."""

    default: Any
    check: Check
    form: str  # its type, as numpydoc has it
    text: str
    group: str = ""
    unit: str = ""
    kept: str = ""  # annotation of the value once checked, where that is not the annotation of the field
    read: Callable[[str], Any] = float  # of the command line; bool is a switch
    metavar: str = "X"
    flagged: str = ""  # what the help of the command line says instead of `text` and the default
    choices: Mapping[str, int] = field(default_factory=dict)  # words of the command line
    constants: Mapping[str, int] = field(default_factory=dict)  # of which the value is one
    kernel: str = ""  # its name in the parameters of the kernel on scan lines; by default its own in snake case
    name: str = ""
    annotation: str = ""

    def documented(self) -> str:
        """The entry of the option in a numpydoc section."""
        text = textwrap.fill(self.text, 112, break_on_hyphens=False)
        return f"{self.name} : {self.form}{f', {self.unit}' if self.unit else ''}\n{textwrap.indent(text, '    ')}"


def option(default: Any, check: Check, form: str, text: str, **more: Any) -> Any:
    """A field of a class of options."""
    return field(default=default, metadata={"option": Option(default, check, form, text, **more)})


def _real(low: float = -np.inf, high: float = np.inf, *, above: bool = False) -> Check:
    return lambda name, value: _check.number(name, value, low, high, above=above)


def _whole(low: int, high: int = 2**31 - 1) -> Check:
    return lambda name, value: _check.integer(name, value, low, high)


def _or_none(check: Check) -> Check:
    return lambda name, value: None if value is None else check(name, value)


def _one_of(constants: Mapping[str, int]) -> Check:
    return lambda name, value: _check.flag(name, value, constants)


def _camera(name: str, value: Any) -> np.ndarray:
    return _read_only(_check.camera_matrix(name, value))


def _noise(name: str, value: Any) -> NoiseModel | float | np.ndarray:
    """A model, a number, or a copy of a map; whether it fits the image shows when that is there."""
    if isinstance(value, NoiseModel):
        return value
    if not isinstance(value, np.ndarray):
        return _check.number(name, value, 0, above=True)
    expected = "a number, a NoiseModel, or a real array of shape (H, W)"
    value = _check.array(name, value, expected)
    if value.dtype.kind == "b":
        raise _check.fail(name, expected, _check.described(value))
    return _read_only(value.astype(np.float32))


def _read_only(values: np.ndarray) -> np.ndarray:
    values.setflags(write=False)
    return values


def _below_one(name: str, value: Any) -> float:
    value = _check.number(name, value, 0, 1, above=True)
    if value == 1:
        raise _check.fail(name, "below 1", _check.described(value))
    return value


class Options:
    """Base of the classes of options."""

    options: ClassVar[dict[str, Option]]

    def __post_init__(self) -> None:
        try:
            for name, own in self.options.items():
                object.__setattr__(self, name, own.check(name, getattr(self, name)))
        except _check.error as problem:
            problem.name(type(self).__name__)
            raise

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in self.options)

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash

    def changed(self) -> str:
        """The options that are not at their default, as keywords."""
        own = {name: getattr(self, name) for name in self.options}
        changed = [name for name, value in own.items() if not np.array_equal(value, self.options[name].default)]
        return ", ".join(f"{name}={_check.described(own[name])}" for name in changed)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.changed()})"


def declared(kind: type[_Kind]) -> type[_Kind]:
    """Collect the options of a class, and document them where its docstring says {options}."""
    kind.options = {}
    for f in fields(kind):  # type: ignore[arg-type]
        own = f.metadata["option"]
        kind.options[f.name] = Option(**{**vars(own), "name": f.name, "annotation": f.type})
    kind.__doc__ = _with_options(kind.__doc__, kind.options.values())
    return kind


def _with_options(doc: str | None, options: Collection[Option]) -> str | None:
    """A docstring with the entries of the options where it says {options}."""
    if doc is None:
        return None
    return doc.replace("    {options}", textwrap.indent("\n".join(own.documented() for own in options), "    "))


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
    4.0
    >>> ScanLineParams.paper().fit == FIT_INTERP
    True
    >>> ScanLineParams(maxGap=4, noise=0.002)
    ScanLineParams(noise=0.002, maxGap=4)
    """

    eps: float | None = option(
        None,
        _or_none(_real(0, above=True)),
        "float or None",
        "Splitting tolerance as a length, at the pixel's depth with a camera (paper, 4.1). None: `epsFactor` times the"
        " noise.",
        group="scan lines",
    )
    epsFactor: float = option(
        3.5,
        _real(0, above=True),
        "float",
        "Splitting tolerance in standard deviations of the noise.",
        group="scan lines",
    )
    K: ArrayLike | None = option(
        None,
        _or_none(_camera),
        "array_like of shape (3, 3) or None",
        "Camera matrix; the values of `src` are then depths along the optical axis.",
        group="geometry",
        kept="np.ndarray | None",
        read=_parse.camera,
        metavar="FX,FY,CX,CY",
        flagged="pinhole camera, in pixels; values are depths",
    )
    pixelSize: float | Sequence[float] | None = option(
        None,
        _or_none(_check.pixel_size),
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
        read=bool,
    )
    depthFactor: float = option(
        1000.0,
        _real(0, above=True),
        "float",
        "Divides integer values: 1000 makes metres of millimetres. Integer 0 is invalid.",
        group="geometry",
    )
    noise: NoiseModel | float | np.ndarray | None = option(
        None,
        _or_none(_noise),
        "NoiseModel or float or ndarray of shape (H, W) or None",
        "Standard deviation of the values as lengths; None estimates it from the image (`estimateNoise`).",
        group="noise",
        read=_parse.noise,
        metavar="NOISE",
        flagged="deviation of the values: a length, or A,B,C[,CORRELATION] for a + b z + c z^2, or kinect1, kinect2"
        " (default: estimated)",
    )
    directions: int = option(
        DIR_ALL,
        _whole(1, DIR_ALL),
        "int",
        "Scan lines to use: DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135 combined by `|`, or DIR_ALL.",
        group="scan lines",
        read=_parse.directions,
        metavar="LIST",
        flagged=f"scan lines, joined by commas: {', '.join(_parse.DIRECTIONS)} (default: all)",
    )
    fit: int = option(
        FIT_LSQ,
        _one_of(FITS),
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
        _one_of(MEASURES),
        "int",
        "MEASURE_MIDPOINT, strengths where the edge is; or MEASURE_ENDPOINT, extrapolated from either end point.",
        group="scan lines",
        choices={"midpoint": MEASURE_MIDPOINT, "endpoint": MEASURE_ENDPOINT},
        constants=MEASURES,
        kernel="endpoint",
    )
    crease: int = option(
        CREASE_NORMAL,
        _one_of(CREASES),
        "int",
        "CREASE_NORMAL, the angle between the surface normals, which the tangents of several scan lines give; or"
        " CREASE_MAX, the largest directional angle (paper, 4.2).",
        group="scan lines",
        choices={"max": CREASE_MAX, "normal": CREASE_NORMAL},
        constants=CREASES,
        kernel="normals",
    )
    maxShift: float = option(
        4.0,
        _real(0),
        "float",
        "How far the adapted edge position may lie from the cut (paper, 4.2, Fig. 5); 0 keeps the cut.",
        unit="pixels",
        group="scan lines",
    )
    maxGap: int = option(
        8,
        _whole(0),
        "int",
        "Widest gap of invalid pixels on a scan line whose two sides are compared: occlusion shadows.",
        unit="pixels",
        group="scan lines",
        read=int,
        metavar="N",
    )
    mergeSignificance: float = option(
        3.0,
        _real(0),
        "float",
        "Cuts are taken back where that raises the sum of squared residuals by less than its square, in variances of"
        " the noise; a segment across an edge, or its rounding, is given to the surfaces beside it likewise. 0 keeps"
        " all.",
        group="scan lines",
    )
    minSignificance: float = option(
        6.0,
        _real(0),
        "float",
        "Candidates are dropped whose significance, joined with that of their neighbours, is below this; 0 keeps all.",
        group="scan lines",
    )

    @classmethod
    def paper(cls, **options: Any) -> ScanLineParams:
        """The paper's basic setting: interpolating fits, cuts as they fall, nothing merged, every candidate kept."""
        basic = {"fit": FIT_INTERP, "crease": CREASE_MAX, "maxShift": 0.0, "maxGap": 0}
        return cls(**{**basic, "mergeSignificance": 0.0, "minSignificance": 0.0, **options})


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Selection(Options):
    """Which strengths make an edge."""

    jumpThreshold: float | None = option(
        None,
        _or_none(_check.threshold),
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
        _real(0, 1, above=True),
        "float",
        "Low thresholds as a fraction of the high ones, in (0, 1]; 1 is no hysteresis. Pixels that reach them count"
        " where they are connected to one that reaches the high ones.",
    )
    minLength: int = option(
        5,
        _whole(1),
        "int",
        "Least length of a connected line, >= 1: the longer side of its bounding box.",
        unit="pixels",
        read=int,
        metavar="N",
    )
    lineSignificance: float = option(
        12.0,
        _real(0),
        "float",
        "Significance that a connected line must reach somewhere, as `minSignificance` is what each of its pixels must"
        " have; 0 keeps all lines.",
    )
    dynamic: bool = option(
        False,
        _check.boolean,
        "bool",
        "Whether to remove lines that do not stand out of the noise, by the statistics of all of them (Venkatesh and"
        " Rosin).",
        read=bool,
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Seeding(Options):
    """How seeds are found."""

    minDistance: float = option(
        3.0,
        _real(0, above=True),
        "float",
        "Least distance of a seed's peak from an edge, > 0.",
        unit="pixels",
        group="seeds",
    )
    separation: float = option(
        0.65,
        _below_one,
        "float",
        "Share of the lower of two peaks to which the way between them must drop for both to count, in (0, 1).",
        group="seeds",
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Growing(Seeding):
    """How seeds are found and regions grow from them."""

    tolerance: float = option(
        3.0,
        _real(0, above=True),
        "float",
        "How far a pixel may lie off its surface, > 0.",
        unit="standard deviations",
        group="regions",
    )
    smoothAngle: float = option(
        8.0,
        _real(0, 30),
        "float",
        "Angle below which surfaces that meet without an edge go on into each other, from 0 to 30.",
        unit="degrees",
        group="regions",
    )
    minArea: int = option(
        100,
        _whole(1),
        "int",
        "Least area of a region.",
        unit="pixels",
        group="regions",
        read=int,
        metavar="N",
    )


@declared
@dataclass(frozen=True, eq=False, repr=False)
class Closing(Options):
    """How far gaps between edges are closed."""

    tolerance: float = option(
        3.0,
        _real(0, above=True),
        "float",
        "How far a pixel may lie off its surface.",
        unit="standard deviations",
    )
    share: float = option(
        0.9,
        _real(0, 1, above=True),
        "float",
        "Share of the pixels of a surface that must lie within `tolerance`, in (0, 1].",
    )
    maxGap: int = option(
        40,
        _whole(0),
        "int",
        "Widest gap to close: edges are dilated by at most half of it.",
        unit="pixels",
    )
    minArea: int = option(
        50,
        _whole(1),
        "int",
        "Components of fewer pixels are no hypotheses; no edge is drawn for them.",
        unit="pixels",
    )


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
CLOSING = {**MEASURED, **Closing.options}


def takes(options: Mapping[str, Option], **shown_default: Any) -> Callable[[_Function], _Function]:
    """Let a public function take options as `**options`: refuse others, show and document these.

    The signature shows their defaults, or `default` where that is given.
    """

    def taking(function: _Function) -> _Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        others = [option for name, option in options.items() if name not in signature.parameters]
        keyword = inspect.Parameter.KEYWORD_ONLY
        shown = [
            inspect.Parameter(o.name, keyword, default=shown_default.get("default", o.default), annotation=o.annotation)
            for o in others
        ]
        allowed = [p.name for p in (*own, *shown)]

        @_check.public
        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            for name in kwargs:
                if name not in allowed:
                    close = difflib.get_close_matches(name, allowed, 1)
                    raise _check.error(f"unknown argument `{name}`{f'; did you mean `{close[0]}`?' if close else ''}")
            return function(*args, **kwargs)

        call.__signature__ = signature.replace(parameters=own + shown)  # type: ignore[attr-defined]
        call.__doc__ = _with_options(call.__doc__, options.values())
        return call  # type: ignore[return-value]

    return taking


def parsed(options: Mapping[str, Any], *kinds: type[Options]) -> tuple[Any, ...]:
    """The options as one object of each class."""
    return tuple(kind(**{name: value for name, value in options.items() if name in kind.options}) for kind in kinds)
