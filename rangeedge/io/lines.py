"""Chains, segments and outlines to files and back: tables, polylines in space, maps, drawings."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import PurePath
from typing import Any, NamedTuple

import cv2
import numpy as np

from .._check import array, described, error, fail, public, reals
from .atomic import write_atomically
from .polylines import Line, toLines
from .source import file_name, opened


class _Format(NamedTuple):
    """A module, imported when first asked for, that writes and reads a format."""

    module: str
    takes: tuple[str, ...] = ()  # keywords of what writes it

    def function(self, purpose: str, suffix: str) -> Callable[..., Any]:
        return getattr(import_module(f".{self.module}", __package__), f"{purpose}_{suffix[1:]}")


_FORMATS = {
    ".csv": _Format("line_tables"),
    ".ply": _Format("line_tables"),
    ".obj": _Format("line_tables"),
    ".geojson": _Format("line_maps", ("transform", "epsg")),
    ".dxf": _Format("line_drawings"),
    ".svg": _Format("line_drawings", ("picture",)),
}


@public
def writeLines(
    filename: str | os.PathLike[str],
    lines: Any,
    transform: Sequence[float] | np.ndarray | None = None,
    *,
    epsg: int | None = None,
    picture: np.ndarray | None = None,
) -> None:
    """Write chains, segments, arcs or outlines to a file.

    writeLines(filename, lines[, transform], *[, epsg[, picture]]) -> None

    The suffix decides on the format:

    - ``.csv``: a table of points, with what is known of their line;
    - ``.ply``: vertices x, y, z, u, v and edges vertex1, vertex2 with kind and angle (crease of a chain, dihedral angle
      of a segment);
    - ``.obj``: a polyline each;
    - ``.geojson``: a LineString each, of an outline a Polygon with its holes, in the order x, y, z, with properties;
    - ``.dxf``: a polyline in space each, on layers by kind (needs the extra ``dxf``);
    - ``.svg``: a path each, an outline and its holes together, in pixels, over a picture where one is given; not for
      arcs, of which no pixels are known.

    Either the whole file is written or nothing.

    Parameters
    ----------
    filename : str or path
    lines : EdgeChains, sequence of EdgeChain, Segments, array of segments or arcs, RegionBoundaries, sequence of Line
        From `linkEdges`, `fitSegments`, `fitArcs`, `regionBoundaries`, `toLines` or `readLines`.
    transform : (2, 3) array or six floats, optional
        Only for GeoJSON: map coordinates x, y = transform @ (u, v, 1) of pixels, as `RangeImage.georeference`; or x0,
        dx, rx, y0, ry, dy as GDAL has them, with which pixel (u, v) lies at x0 + (u + 0.5) dx + (v + 0.5) rx and
        y0 + (u + 0.5) ry + (v + 0.5) dy. None writes the coordinates of the points.
    epsg : int, optional
        Only for GeoJSON: the code of the reference system of its coordinates, if they are not longitude and latitude.
    picture : ndarray of shape (H, W, 3), CV_8U, optional
        Only for SVG: what lies below the lines.

    Raises
    ------
    rangeedge.error
        On a bad argument, an unknown suffix, or if the file cannot be written.

    See Also
    --------
    readLines : What was written.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from rangeedge import linkEdges, writeLines
    >>> roof = np.abs(np.arange(64) + 0.3 * np.arange(48)[:, None] - 40.3)
    >>> path = os.path.join(tempfile.mkdtemp(), "ridge.obj")
    >>> writeLines(path, linkEdges(roof, pixelSize=1, noise=0.001))
    >>> with open(path) as file:
    ...     print(file.readline().strip())
    o convex_0
    """
    name = file_name(filename, "filename")
    suffix = _suffix(name, "write")
    options = {"transform": transform, "epsg": epsg, "picture": picture}
    for option, value in options.items():
        if value is not None and option not in _FORMATS[suffix].takes:
            raise fail(option, f"None for {suffix}", described(value))
    data = encoded_lines(suffix, lines, **options)
    try:
        write_atomically(name, data)
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error(f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason


@public
def readLines(filename: str | os.PathLike[str]) -> list[Line]:
    """Read the lines that `writeLines` has written.

    readLines(filename) -> lines

    Formats hold different things: all have kinds and, but for SVG, points; CSV, PLY and SVG pixels; CSV and GeoJSON all
    properties, SVG and DXF too, PLY the angle alone. GeoJSON with a transform has map coordinates for x and y. In a
    PLY file lines of a single point are lost, in PLY and CSV those without points.

    Parameters
    ----------
    filename : str or path
        Its suffix decides on the format: ``.csv``, ``.ply``, ``.obj``, ``.geojson``, ``.dxf`` or ``.svg``.

    Returns
    -------
    lines : list of Line
        In the order of the file. An outline is followed by its holes.

    Raises
    ------
    rangeedge.error
        On a bad argument, an unknown suffix, or if the file cannot be read or holds something else.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from rangeedge import linkEdges, readLines, writeLines
    >>> roof = np.abs(np.arange(64) + 0.3 * np.arange(48)[:, None] - 40.3)
    >>> path = os.path.join(tempfile.mkdtemp(), "ridge.csv")
    >>> writeLines(path, linkEdges(roof, pixelSize=1, noise=0.001))
    >>> [(line.kind, line.closed, round(line.properties["crease"])) for line in readLines(path)]
    [('convex', False, 92)]
    """
    name = file_name(filename, "filename")
    suffix = _suffix(name, "read")
    with opened(name) as (stream, size):
        data = stream.read(size)
        try:
            return toLines(_FORMATS[suffix].function("read", suffix)(data))
        except Exception as reason:  # readers of text raise what comes of the words they meet
            if isinstance(reason, error) and isinstance(reason.__context__, ImportError):
                raise
            raise ValueError(f"it holds no lines ({getattr(reason, 'err', reason)})") from reason


def encoded_lines(suffix: str, lines: Any, **options: Any) -> bytes:
    """Chains, segments or outlines as the content of a file."""
    if options.get("transform") is not None:
        options["transform"] = _transform(options["transform"])
    if options.get("epsg") is not None and (type(options["epsg"]) is not int or not 0 < options["epsg"] < 1 << 20):
        raise fail("epsg", "the code of a reference system", described(options["epsg"]))
    if options.get("picture") is not None:
        picture = array("picture", options["picture"], "a CV_8UC3 picture", ndim=(3,))
        if picture.dtype != np.uint8 or picture.shape[2] != 3:
            raise fail("picture", "a CV_8UC3 picture", described(picture))
    own = _FORMATS[suffix]
    lines = toLines(lines)
    try:
        return own.function("write", suffix)(lines, **{name: options.get(name) for name in own.takes})
    except (ArithmeticError, ValueError) as reason:  # of values that are infinite or not in every format
        if isinstance(reason, error):
            raise
        raise fail("lines", f"what {suffix} can hold", f"lines of which it cannot ({reason})") from reason


def is_line_file(path: str | os.PathLike[str]) -> bool:
    """Whether a name is that of a file of lines, by its suffix."""
    return PurePath(path).suffix.lower() in _FORMATS


def _suffix(name: str, purpose: str) -> str:
    suffix = PurePath(name).suffix.lower()
    if suffix not in _FORMATS:
        raise error(f"cannot {purpose} {name!r}: the suffix must be one of {', '.join(_FORMATS)}")
    return suffix


def _transform(transform: Any) -> np.ndarray:
    """Map coordinates of pixel centres as an affine map of (column, row, 1)."""
    expected = "a (2, 3) array, or six finite numbers"
    try:
        numbers = reals(transform)
    except (TypeError, ValueError, OverflowError):
        raise fail("transform", expected, described(transform)) from None
    if numbers.shape not in ((2, 3), (6,)) or not np.isfinite(numbers).all():
        raise fail("transform", expected, described(transform))
    if numbers.shape == (2, 3):
        return numbers
    x0, dx, rx, y0, ry, dy = numbers
    return np.array([[dx, rx, x0 + (dx + rx) / 2], [ry, dy, y0 + (ry + dy) / 2]])
