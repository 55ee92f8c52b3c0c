"""Lines as drawings: DXF in space, SVG over a picture."""

from __future__ import annotations

import base64
import io
import json
import os
import tempfile
from typing import Any
from xml.sax.saxutils import quoteattr

import cv2
import numpy as np

from .._check import error, fail
from ..cancellation import apart
from .polylines import REGION, Line, grouped, no_pixels
from .settings import xml_root

_APP = "RANGEEDGE"  # whose extended data DXF entities carry
_DXF_COLOURS = {"jump": 30, "convex": 2, "concave": 140, REGION: 7}  # of AutoCAD
_COLOURS = {"jump": "#d55e00", "convex": "#f0e442", "concave": "#56b4e9", REGION: "#ffffff"}  # as in pictures
_EXTENDED = 250  # characters that a string of extended data holds
_SVG = "{http://www.w3.org/2000/svg}"


def _ezdxf() -> Any:
    try:
        import ezdxf
    except ImportError:
        raise error("DXF files need the package ezdxf: pip install 'rangeedge[dxf]'") from None
    return ezdxf


def write_dxf(lines: list[Line]) -> bytes:
    document = _ezdxf().new("R2010", setup=False)
    document.appids.add(_APP)
    for kind in dict.fromkeys(line.kind for line in lines):
        document.layers.add(kind.upper(), color=_DXF_COLOURS.get(kind, 7))
    space = document.modelspace()
    for line in lines:
        entity = space.add_polyline3d(line.points.tolist(), close=line.closed, dxfattribs={"layer": line.kind.upper()})
        text = json.dumps(line.properties)
        parts = [text[i : i + _EXTENDED] for i in range(0, len(text), _EXTENDED)]
        entity.set_xdata(_APP, [(1000, part) for part in parts])
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode()


def read_dxf(data: bytes) -> list[Line]:
    ezdxf = _ezdxf()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "lines.dxf")
        with open(path, "wb") as file:
            file.write(data)
        try:
            document = ezdxf.readfile(path)
        except (OSError, ezdxf.DXFError) as reason:
            raise ValueError(str(reason)) from reason
    lines = []
    for entity in document.modelspace().query("POLYLINE"):
        points = np.array([list(vertex.dxf.location) for vertex in entity.vertices], np.float64).reshape(-1, 3)
        text = (
            "".join(tag.value for tag in entity.get_xdata(_APP) if tag.code == 1000) if entity.has_xdata(_APP) else ""
        )
        known = json.loads(text) if text else {}
        lines.append(Line(entity.dxf.layer.lower(), bool(entity.is_closed), no_pixels(points), points, known))
    return lines


def write_svg(lines: list[Line], picture: np.ndarray | None = None) -> bytes:
    if any(len(line.pixels) and not np.isfinite(line.pixels).any() for line in lines):
        raise fail("lines", "lines with pixels for .svg", "some of which only points in space are known")
    if picture is None:
        places = np.concatenate([np.zeros((1, 2)), *(line.pixels for line in lines)])
        width, height = (int(size) for size in np.ceil(np.nanmax(places, axis=0) + 1))
    else:
        height, width = picture.shape[:2]
    size = f'width="{width}" height="{height}"'
    # Pixel (0, 0) has its centre there, and its corner at (-0.5, -0.5).
    text = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="-0.5 -0.5 {width} {height}">']
    if picture is not None:
        png = base64.b64encode(apart(picture.size, cv2.imencode, ".png", picture)[1].tobytes()).decode()
        text.append(f'<image x="-0.5" y="-0.5" {size} href="data:image/png;base64,{png}"/>')
    text.append('<g fill="none" stroke-linejoin="round" stroke-linecap="round">')
    for group in grouped(lines):
        path = " ".join(_path(line) for line in group)
        colour = _COLOURS.get(group[0].kind.partition(" ")[0], "#ffffff")
        fill = f' fill="{colour}" fill-opacity="0.15" fill-rule="evenodd"' if group[0].kind == REGION else ""
        known = quoteattr(json.dumps([line.properties for line in group]))
        text.append(
            f'<path class={quoteattr(group[0].kind)} stroke="{colour}"{fill} data-properties={known} d="{path}"/>'
        )
    return "\n".join([*text, "</g>", "</svg>", ""]).encode()


def _path(line: Line) -> str:
    places = [f"{x!r},{y!r}" for x, y in line.pixels.tolist()]
    return f"M {' L '.join(places)}{' Z' if line.closed else ''}"


def read_svg(data: bytes) -> list[Line]:
    lines = []
    for path in xml_root(data.decode()).iter(f"{_SVG}path"):
        known = json.loads(path.get("data-properties", "[]"))
        for i, part in enumerate(path.get("d", "").split("M ")[1:]):
            closed = part.rstrip().endswith("Z")
            places = part.replace("Z", "").replace("L", " ").split()
            pixels = np.array([place.split(",") for place in places], np.float64).reshape(-1, 2)
            own = known[i] if i < len(known) else {}
            lines.append(Line(path.get("class", ""), closed, pixels, np.full((len(pixels), 3), np.nan), own))
    return lines
