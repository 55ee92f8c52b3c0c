"""Surfaces: what kernels take to fit them, and planes and quadrics through the points of regions."""

from __future__ import annotations

from typing import Any

import numpy as np

from .geometry import RangeFrame

SURFACE = np.dtype([("curved", np.bool_), ("centroid", "3f8"), ("normal", "3f8"), ("quadric", "10f8"), ("rms", "f8")])
_CURVED_GAIN = 0.8  # a quadratic must lower the rms of a plane to this share
_QUADRIC_POINTS = 40  # fewer tell no curvature


def surface_map(frame: RangeFrame, coefficients: tuple[float, ...], noise_map: np.ndarray | None) -> dict[str, Any]:
    """What the kernels on surfaces take: places on the image plane, ordinates and their noise; no edges."""
    x, y, to_plane = _places(frame)
    seen = frame.ordinate[frame.valid.view(bool)]
    offset = float(seen[:: max(1, len(seen) // 4096)].mean(dtype=np.float64)) if len(seen) else 0.0
    return dict(
        x=x,
        y=y,
        ordinate=(frame.ordinate - frame.ordinate.dtype.type(offset)).astype(np.float32, copy=False),
        offset=offset,
        rounding=float(np.spacing(np.abs(frame.ordinate.dtype.type(offset)))),
        projective=frame.projective,
        to_plane=to_plane,
        noise=coefficients[:3],
        noise_map=noise_map,
        edges=None,
        threads=frame.threads,
    )


def _places(frame: RangeFrame) -> tuple[np.ndarray | None, np.ndarray | None, tuple[float, ...]]:
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


def surfaces_of(frame: RangeFrame, labels: np.ndarray, count: int, heightMap: bool) -> np.ndarray:
    """The plane, or the quadric where a plane fails, of every label 1 .. count - 1."""
    surfaces = np.zeros(count, SURFACE)
    points = _points(frame, heightMap).reshape(-1, 3)
    toward = _toward_viewer(frame, heightMap)
    order = np.argsort(labels, axis=None, kind="stable")
    starts = np.searchsorted(labels.ravel()[order], np.arange(count + 1))
    for label in range(1, count):
        inside = order[starts[label] : starts[label + 1]]
        _describe(surfaces[label], points[inside], frame.ordinate.ravel()[inside], inside, labels.shape[1], toward)
    return surfaces


def _points(frame: RangeFrame, heightMap: bool) -> np.ndarray:
    if frame.samples.ndim == 3:
        return frame.samples.astype(np.float64)
    v, u = np.indices(frame.shape)
    a, b, c, d, e, f = frame.to_plane
    x, y = a * u + b * v + c, d * u + e * v + f
    if not frame.projective:
        return np.stack([x, y, frame.ordinate if heightMap else -frame.ordinate], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = 1 / frame.ordinate.astype(np.float64)
    return np.stack([x * z, y * z, z], axis=-1)


def _toward_viewer(frame: RangeFrame, heightMap: bool) -> np.ndarray | None:
    """The direction toward the viewer; None where it is that of the origin."""
    if frame.projective:
        return None
    if frame.samples.ndim == 3:
        return -np.asarray(frame.axis)
    return np.array([0.0, 0.0, 1.0 if heightMap else -1.0])


def _describe(
    surface: np.void,
    points: np.ndarray,
    ordinate: np.ndarray,
    pixels: np.ndarray,
    width: int,
    toward: np.ndarray | None,
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
    if normal @ (-centroid if toward is None else toward) < 0:
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
