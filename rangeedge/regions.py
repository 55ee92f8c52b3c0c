"""Regions: surfaces grown from seeds under the noise model, competing for pixels, merged where one explains both."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _core
from ._args import boolean, fail, image8, integer, labels32s, number
from .distance import distanceTransform
from .edges import detectEdges
from .geometry import RangeFrame, range_frame
from .noise import NoiseModel, noise_of
from .seeds import extractSeeds

def growRegions(
    src: np.ndarray,
    markers: np.ndarray,
    *,
    edges: np.ndarray | None = None,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    tolerance: float = 3.0,
    smoothAngle: float = 8.0,
    minArea: int = 100,
    newSeeds: bool = False,
) -> np.ndarray:
    func = "growRegions"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    markers = labels32s(func, "markers", markers, frame.shape)
    edges = None if edges is None else image8(func, "edges", edges, frame.shape)
    return _grown(func, frame, markers, edges, noise, tolerance, smoothAngle, minArea, newSeeds)


def segmentRegions(
    src: np.ndarray,
    *,
    K: Any = None,
    pixelSize: Any = None,
    heightMap: bool = False,
    depthFactor: float = 1000.0,
    mask: np.ndarray | None = None,
    noise: Any = None,
    edges: np.ndarray | None = None,
    minDistance: float = 3.0,
    separation: float = 0.65,
    tolerance: float = 3.0,
    smoothAngle: float = 8.0,
    minArea: int = 100,
) -> np.ndarray:
    func = "segmentRegions"
    frame = range_frame(func, src, K, pixelSize, heightMap, depthFactor, mask)
    if edges is None:
        geometry = dict(K=K, pixelSize=pixelSize, heightMap=heightMap, depthFactor=depthFactor, noise=noise)
        edges = detectEdges(src, mask=mask, **geometry)
    edges = image8(func, "edges", edges, frame.shape)
    distance = distanceTransform((edges != 0) | (frame.valid == 0))
    _, markers = extractSeeds(distance, minDistance=minDistance, separation=separation)
    return _grown(func, frame, markers, edges, noise, tolerance, smoothAngle, minArea, True)


def _grown(func, frame, markers, edges, noise, tolerance, smoothAngle, minArea, newSeeds) -> np.ndarray:
    parameters = _core.RegionParameters(
        tolerance=number(func, "tolerance", tolerance, 0, above=True),
        smooth_angle=number(func, "smoothAngle", smoothAngle, 0, 45),
        min_area=integer(func, "minArea", minArea, 1),
        new_seeds=boolean(func, "newSeeds", newSeeds),
    )
    noise = noise_of(frame) if noise is None else noise
    labels = np.zeros(frame.shape, np.int32)
    if frame.valid.any():
        _core.grow_regions(**range_map(frame, noise, edges), markers=markers, parameters=parameters, labels=labels)
    return labels


def range_map(frame: RangeFrame, noise: Any, edges: np.ndarray | None) -> dict[str, Any]:
    """What the kernels on surfaces take: places on the image plane, ordinates, their noise, and edges."""
    x, y, to_plane = _places(frame)
    if not isinstance(noise, NoiseModel):
        noise = NoiseModel(c=noise) if frame.projective else NoiseModel(a=noise)
    offset = float(np.nanmean(frame.ordinate[::4, ::4]))
    return dict(
        x=x,
        y=y,
        ordinate=(frame.ordinate - offset).astype(np.float32),
        offset=offset,
        projective=frame.projective,
        to_plane=to_plane,
        noise=(noise.a, noise.b, noise.c),
        noise_map=None,
        edges=edges,
    )


def _places(frame):
    if frame.samples.ndim == 2:
        return None, None, frame.to_plane
    axis = np.asarray(frame.axis)
    side = np.cross([0, 1, 0] if abs(axis[1]) < 0.9 else [1, 0, 0], axis)
    side /= np.linalg.norm(side)
    points = frame.samples.astype(np.float64)
    x, y = points @ side, points @ np.cross(axis, side)
    if frame.projective:
        along = points @ axis
        x, y = x / along, y / along
    spacing = max(np.nanmedian(np.abs(np.diff(x, axis=1))), np.nanmedian(np.abs(np.diff(y, axis=0))), 1e-12)
    return (x / spacing).astype(np.float32), (y / spacing).astype(np.float32), (spacing, 0.0, 0.0, 0.0, spacing, 0.0)
