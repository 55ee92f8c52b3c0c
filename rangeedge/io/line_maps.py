"""Lines for maps: GeoJSON (RFC 7946), with the reference system as its first version of 2008 names one."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from .._check import error
from .polylines import Line, grouped, is_hole, no_pixels


def write_geojson(lines: list[Line], transform: np.ndarray | None = None, epsg: int | None = None) -> bytes:
    features = []
    for group in grouped(lines):
        rings = [_coordinates(line, transform) for line in group]
        polygon = "hole" in group[0].properties
        geometry = {"type": "Polygon" if polygon else "LineString", "coordinates": rings if polygon else rings[0]}
        known = {"kind": group[0].kind, "closed": group[0].closed, **group[0].properties}
        if polygon:
            known["areas"] = [line.properties.get("area") for line in group]
        known = {name: None if isinstance(v, float) and not np.isfinite(v) else v for name, v in known.items()}
        features.append({"type": "Feature", "geometry": geometry, "properties": known})
    collection: dict[str, Any] = {"type": "FeatureCollection"}
    if epsg is not None:
        collection["crs"] = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{epsg}"}}
    whole = json.dumps({**collection, "features": []})
    each = ", ".join(json.dumps(feature, allow_nan=False) for feature in features)  # a call can be given up in between
    return f"{whole.removesuffix(']}')}{each}]}}".encode()


def _coordinates(line: Line, transform: np.ndarray | None) -> list[list[float]]:
    points = line.points
    if transform is not None:
        places = line.pixels @ transform[:, :2].T + transform[:, 2]
        points = np.column_stack([places, points[:, 2]])
    if line.closed:
        points = np.concatenate([points, points[:1]])
    known = np.isfinite(points)
    if not known[:, :2].all():
        raise error("lines without points in space make no map: give `src` to regionBoundaries, or a `transform`")
    return [point if seen else point[:2] for point, seen in zip(points.tolist(), known[:, 2].tolist(), strict=True)]


def read_geojson(data: bytes) -> list[Line]:
    lines = []
    for feature in json.loads(data)["features"]:
        geometry, known = feature["geometry"], dict(feature["properties"])
        kind, closed = known.pop("kind"), known.pop("closed")
        known = {name: np.nan if value is None else value for name, value in known.items()}
        polygon = geometry["type"] == "Polygon"
        areas = known.pop("areas", None)
        for i, ring in enumerate(geometry["coordinates"] if polygon else [geometry["coordinates"]]):
            points = np.array([[*point, np.nan][:3] for point in ring], np.float64).reshape(-1, 3)
            points = points[:-1] if closed else points
            own = dict(known)
            if polygon:
                own["hole"], own["area"] = i > 0 or is_hole(known), areas[i] if areas else np.nan
            lines.append(Line(kind, closed, no_pixels(points), points, own))
    return lines
