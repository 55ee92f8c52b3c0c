"""Surfaces: what kernels take to fit them, and planes and quadrics through the points of regions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from . import _core
from ._check import error
from .frame import Frame
from .sectors import sectors_of

SURFACE = np.dtype([("curved", np.bool_), ("centroid", "3f8"), ("normal", "3f8"), ("quadric", "10f8"), ("rms", "f8")])
_CURVED_GAIN = 0.8  # a quadratic must lower the rms of a plane to this share
_QUADRIC_POINTS = 40  # fewer tell no curvature


def surface_map(frame: Frame, edges: np.ndarray | None) -> _core.RangeMap:
    """What the kernels on surfaces take: places on the image plane, ordinates and their noise, edges."""
    x, y, to_plane = _places(frame)
    ordinate = _along_axis(frame)
    seen = ordinate[np.isfinite(ordinate)]
    offset = float(seen[:: max(1, len(seen) // 4096)].mean(dtype=np.float64)) if len(seen) else 0.0
    ordinate = (ordinate - ordinate.dtype.type(offset)).astype(np.float32, copy=False)
    return _core.RangeMap(frame.kernel, x, y, ordinate, offset, to_plane, edges)


def _along_axis(frame: Frame) -> np.ndarray:
    """Ordinates of which planes are affine functions of the image plane."""
    if not frame.ranges:
        return frame.ordinate
    if sectors_of(frame):
        raise error(
            "`src` must hold points of a sector below 150 degrees, whose surfaces can be seen on one image plane;"
            " take the columns of one sector after the other"
        )
    return replace(frame, ranges=False).ordinate


def _places(frame: Frame) -> tuple[np.ndarray | None, np.ndarray | None, tuple[float, ...]]:
    """Where pixels lie on the image plane, in units of about a pixel, and how that becomes coordinates.

    None for a regular grid: columns and rows.
    """
    if frame.samples.ndim == 2:
        return None, None, frame.to_plane
    axis = np.asarray(frame.axis)
    across = np.cross((0, 1, 0) if abs(axis[1]) < 0.9 else (1, 0, 0), axis)
    across /= np.linalg.norm(across)
    points = frame.samples.astype(np.float64)
    x, y = points @ across, points @ np.cross(axis, across)
    if frame.projective:
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = x / (points @ axis), y / (points @ axis)
    steps = np.concatenate([np.hypot(np.diff(x, axis=k), np.diff(y, axis=k)).ravel() for k in (0, 1)])
    steps = steps[steps > 0]  # and so not NaN
    spacing = float(np.median(steps)) if len(steps) else 1.0
    to_plane = (spacing, 0.0, 0.0, 0.0, spacing, 0.0)
    return (x / spacing).astype(np.float32), (y / spacing).astype(np.float32), to_plane


def surfaces_of(frame: Frame, labels: np.ndarray, count: int) -> np.ndarray:
    """The plane, or the quadric where a plane fails, of every label 1 .. count - 1."""
    surfaces = np.zeros(count, SURFACE)
    points = frame.points.reshape(-1, 3)
    toward, ordinates = frame.toward_viewer, _along_axis(frame).ravel()
    order = np.argsort(labels, axis=None, kind="stable")
    starts = np.searchsorted(labels.ravel()[order], np.arange(count + 1))
    for label in range(1, count):
        inside = order[starts[label] : starts[label + 1]]
        _describe(surfaces[label], points[inside], ordinates[inside], inside, labels.shape[1], toward)
    return surfaces


def _describe(
    surface: np.void,
    points: np.ndarray,
    ordinate: np.ndarray,
    pixels: np.ndarray,
    width: int,
    toward: Callable[[np.ndarray], np.ndarray],
) -> None:
    centroid = points.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov((points - centroid).T, bias=True) if len(points) > 1 else np.eye(3))
    normal, rms = vectors[:, 0], np.sqrt(max(values[0], 0.0))
    quadric = np.concatenate([np.zeros(6), normal, [-normal @ centroid]])
    curved = len(points) >= _QUADRIC_POINTS and _is_curved(ordinate, pixels, width)
    if curved:
        quadric, rms = _taubin(points, centroid)
        normal = _gradient(quadric, centroid[None])[0]
        normal /= np.linalg.norm(normal) or 1.0
    if normal @ toward(centroid) < 0:
        normal, quadric = -normal, -quadric
    surface["curved"], surface["centroid"], surface["normal"] = curved, centroid, normal
    surface["quadric"], surface["rms"] = quadric, rms


def _is_curved(ordinate: np.ndarray, pixels: np.ndarray, width: int) -> bool:
    """Whether a quadratic over the image describes the ordinates much better than a plane."""
    x, y = (pixels % width).astype(np.float64), (pixels // width).astype(np.float64)
    x, y = (x - x.mean()) / max(np.ptp(x), 1), (y - y.mean()) / max(np.ptp(y), 1)
    values = ordinate.astype(np.float64) - ordinate.mean(dtype=np.float64)
    columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    rms = [_misfit(columns[:, :terms], values) for terms in (3, 6)]
    return rms[0] > 1e-6 * np.ptp(values) and rms[1] < _CURVED_GAIN * rms[0]


def _misfit(columns: np.ndarray, values: np.ndarray) -> float:
    solution = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.sqrt(np.mean((values - columns @ solution) ** 2)))


def _monomials(p: np.ndarray) -> np.ndarray:
    x, y, z = p.T
    return np.stack([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z], axis=1)


def _gradient(quadric: np.ndarray, p: np.ndarray) -> np.ndarray:
    a, b, c, d, e, f, g, h, i, _ = quadric
    return p @ np.array([[2 * a, d, e], [d, 2 * b, f], [e, f, 2 * c]]) + np.array([g, h, i])


def _taubin(points: np.ndarray, centroid: np.ndarray) -> tuple[np.ndarray, float]:
    """The quadric with the least sum of F^2 over that of |grad F|^2, and the rms of F / |grad F|."""
    scale = float(np.sqrt(np.mean((points - centroid) ** 2))) or 1.0
    p = (points - centroid) / scale
    columns = _monomials(p)
    mean = columns.mean(axis=0)
    scatter = (columns - mean).T @ (columns - mean)
    x, y, z = p.T
    o, one = np.zeros_like(x), np.ones_like(x)
    gradients = (
        np.stack([2 * x, o, o, y, z, o, one, o, o], axis=1),
        np.stack([o, 2 * y, o, x, o, z, o, one, o], axis=1),
        np.stack([o, o, 2 * z, o, x, y, o, o, one], axis=1),
    )
    slope = sum(g.T @ g for g in gradients)
    root = np.linalg.inv(np.linalg.cholesky(slope + 1e-12 * np.trace(slope) * np.eye(9)))
    vector = root.T @ np.linalg.eigh(root @ scatter @ root.T)[1][:, 0]
    quadric = np.append(vector, -vector @ mean)
    length = np.linalg.norm(_gradient(quadric, p), axis=1)
    typical = float(np.sqrt(np.mean(length**2))) or 1.0
    value = columns @ quadric[:9] + quadric[9]
    rms = scale * float(np.sqrt(np.mean((value / np.maximum(length, 0.01 * typical)) ** 2)))
    return _uncentred(quadric * (scale / typical), centroid, scale), rms


def _uncentred(quadric: np.ndarray, centroid: np.ndarray, scale: float) -> np.ndarray:
    """The same quadric in p, given in (p - centroid) / scale."""
    a, b, c, d, e, f = quadric[:6] / scale**2
    second = np.array([[a, d / 2, e / 2], [d / 2, b, f / 2], [e / 2, f / 2, c]])
    first = quadric[6:9] / scale
    constant = quadric[9] - first @ centroid + centroid @ second @ centroid
    return np.concatenate([[a, b, c, d, e, f], first - 2 * second @ centroid, [constant]])
