"""Surfaces: what kernels take to fit them, and planes and quadrics through the points of regions."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np

from . import _core
from .bands import bands, by_bands, counts, quantiles
from .frame import Frame

SURFACE = np.dtype([("curved", np.bool_), ("centroid", "3f8"), ("normal", "3f8"), ("quadric", "10f8"), ("rms", "f8")])
_CURVED_GAIN = 0.8  # a quadratic must lower the rms of a plane to this share
_LEAST_RELIEF = 1e-6  # of the rms of a plane, in inverse distances
_LEAST_CURVED = 40  # pixels; fewer tell no curvature
_RIM = 3  # pixels beside the border of a region over which sensors round edges off
_LEAST_INNER = 0.25  # of the pixels of a region, without its rim, to do without that
_LEAST_GRADIENT = 0.01  # of a quadric, of its typical one, where a distance is F / |grad F|
# Exponents of x, y, z: those of the moments that the core adds up, and those of a quadric's terms.
_EXPONENTS = [(i, j, n - i - j) for n in range(5) for i in range(n, -1, -1) for j in range(n - i, -1, -1)]
_TERMS = [(2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_PLACE = {e: n for n, e in enumerate(_EXPONENTS)}


def surface_map(frame: Frame, edges: np.ndarray | None) -> _core.RangeMap:
    """What the kernels on surfaces take: places on the image plane, ordinates and their noise, edges."""
    x, y, to_plane = places(frame)
    relative, offset, rounding = relative_ordinate(frame)
    return _core.RangeMap(frame.kernel, x, y, relative, offset, rounding, to_plane, edges)


def relative_ordinate(frame: Frame) -> tuple[np.ndarray, float, float]:
    """Ordinates of which planes are affine functions, less an offset, in single precision; the offset, its rounding."""
    ordinate = _along_axis(frame)
    offset = _middle(ordinate)
    with np.errstate(invalid="ignore", over="ignore"):  # signalling NaN; beyond single precision
        relative = by_bands(lambda own: (own - own.dtype.type(offset)).astype(np.float32, copy=False), ordinate)
    return relative, offset, float(np.spacing(np.abs(ordinate.dtype.type(offset))))


def _middle(ordinate: np.ndarray) -> float:
    """The mean of some 4096 ordinates, 0 where there is none."""
    step = max(1, np.count_nonzero(np.isfinite(ordinate)) // 4096)
    count, some = 0, []
    for rows in bands(ordinate):
        seen = ordinate[rows][np.isfinite(ordinate[rows])]
        some.append(seen[-count % step :: step])
        count += len(seen)
    return float(np.concatenate(some).mean(dtype=np.float64)) if count else 0.0


def _along_axis(frame: Frame) -> np.ndarray:
    """Ordinates of which planes are affine functions of the image plane."""
    if not frame.ranges:
        return frame.ordinate
    return replace(frame, ranges=False).ordinate


def places(frame: Frame) -> tuple[np.ndarray | None, np.ndarray | None, tuple[float, ...]]:
    """Where pixels lie on the image plane, in units of about a pixel, and how that becomes coordinates.

    None for a regular grid: columns and rows.
    """
    if frame.samples.ndim == 2:
        return None, None, frame.to_plane
    right, down, axis = _plane_axes(frame)

    def place(points: np.ndarray) -> np.ndarray:
        points = points.astype(np.float64)
        x, y = points @ right, points @ down
        if frame.projective:
            with np.errstate(divide="ignore", invalid="ignore"):
                x, y = x / (points @ axis), y / (points @ axis)
        return np.stack([x, y], axis=1)

    xy = by_bands(place, frame.samples)
    spacing = _spacing(xy)
    x, y = (by_bands(lambda own, k=k: (own[:, k] / spacing).astype(np.float32), xy) for k in (0, 1))
    return x, y, (spacing, 0.0, 0.0, 0.0, spacing, 0.0)


def _spacing(xy: np.ndarray) -> float:
    """The median step between neighbours in rows and columns of (H, 2, W) places, 1 where there is none."""
    height, _, width = xy.shape
    steps = np.empty((2, height, width))  # no number where there is none or it is 0
    for rows in bands(steps[0]):
        steps[:, rows] = np.nan
        for axis, own in ((0, xy[rows.start : rows.stop + 1]), (2, xy[rows])):
            step = np.hypot(*np.moveaxis(np.diff(own, axis=axis), 1, 0))
            into = steps[axis // 2, rows.start : rows.start + step.shape[0], : step.shape[1]]
            into[...] = np.where(step > 0, step, np.nan)
    (spacing,) = quantiles(steps, 0.5)
    return 1.0 if np.isnan(spacing) else spacing


def _plane_axes(frame: Frame) -> np.ndarray:
    """Two directions on the plane of an image of points, and that of view, as rows."""
    axis = np.asarray(frame.axis)
    right = np.cross((0, 1, 0) if abs(axis[1]) < 0.9 else (1, 0, 0), axis)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(axis, right), axis])


def in_space(frame: Frame, x: np.ndarray, y: np.ndarray, to_plane: tuple[float, ...], z: np.ndarray) -> np.ndarray:
    """(..., 3) points seen at places (x, y) of `places` with ordinates z; NaN where z is that of no point."""
    a, b, c, d, e, f = to_plane
    u, v = a * x + b * y + c, d * x + e * y + f
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(z > 0, 1 / z, np.nan) if frame.projective else -z
    if frame.projective:
        u, v = u * along, v * along
    if frame.samples.ndim == 2:
        return np.stack([u, v, -along if frame.heightMap else along], axis=-1)
    return np.stack([u, v, along], axis=-1) @ _plane_axes(frame) + np.asarray(frame.origin)


def surfaces_of(frame: Frame, labels: np.ndarray, count: int) -> np.ndarray:
    """The plane, or the quadric where a plane fails, of every label 1 .. count - 1."""
    surfaces = np.zeros(count, SURFACE)
    points = frame.points
    origins, scales = np.zeros((count, 3)), np.ones(count)
    moments, curved = np.zeros((count, len(_EXPONENTS))), np.zeros(count, np.uint8)
    ordinate = by_bands(lambda own: own.astype(np.float64), frame.ordinate)
    _core.region_moments(labels, points, ordinate, frame.threads, origins, scales, moments, curved)
    # Planes and quadrics in (p - origin) / scale, as coefficients of _TERMS and 1, with a gradient of about 1.
    mean, normal, rms = _planes(moments)
    quadrics = np.concatenate([np.zeros((count, 6)), normal, -(normal * mean).sum(axis=1, keepdims=True)], axis=1)
    if frame.ranges:
        curved = _curved(frame, labels, count)
    curved = curved.view(bool)
    quadrics[curved] = _taubin(moments[curved])
    misfits = np.zeros(count)
    floors = np.where(curved, _LEAST_GRADIENT, 0.0)
    _core.quadric_misfits(labels, points, frame.threads, origins, scales, quadrics, floors, misfits)
    normal = np.where(curved[:, None], _gradients(quadrics, mean), normal)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
        centroid = origins + scales[:, None] * mean
        sign = np.where((normal * frame.toward_viewer(centroid)).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        for name, values in (
            ("curved", curved),
            ("centroid", centroid),
            ("normal", sign * normal),
            ("quadric", sign * _in_lengths(quadrics, origins, scales)),
            ("rms", scales * np.where(curved, misfits, rms)),
        ):
            surfaces[name][1:] = values[1:]
    return surfaces


def without_rims(labels: np.ndarray) -> np.ndarray:
    """Labels >= 0 without those of pixels at the rim of their region, of regions that keep enough of their pixels.

    An edge is rounded off by what a sensor averages over. Planes fitted to that, too, meet at flatter angles.
    """
    window = np.ones((2 * _RIM + 1,) * 2, np.uint8)

    def inside(labels: np.ndarray) -> np.ndarray:
        names = np.where(labels > 0, labels, -1).astype(np.float64)  # of any number, which singles do not tell apart
        return np.where(cv2.erode(names, window) == cv2.dilate(names, window), labels, 0)

    inner = by_bands(inside, labels, halo=_RIM)
    count = int(labels.max()) + 1
    before, after = counts(labels, count), counts(inner, count)
    whole = after < np.maximum(_LEAST_CURVED, _LEAST_INNER * before)
    return by_bands(lambda all_of, own: np.where(whole[all_of], all_of, own).astype(labels.dtype), labels, inner)


def _planes(moments: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean points, normals of the planes through them, and root mean square distances from these."""
    mean = moments[:, [_PLACE[e] for e in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]]
    second = [[_PLACE[tuple(a + b)] for b in np.eye(3, dtype=int)] for a in np.eye(3, dtype=int)]

    def thinnest(moments: np.ndarray, mean: np.ndarray) -> np.ndarray:
        values, vectors = np.linalg.eigh(moments[:, second] - mean[:, :, None] * mean[:, None, :])
        return np.column_stack([vectors[:, :, 0], values[:, 0]])

    least = by_bands(thinnest, moments, mean)
    return mean, least[:, :3], np.sqrt(np.maximum(least[:, 3], 0.0))


def _curved(frame: Frame, labels: np.ndarray, count: int) -> np.ndarray:
    """Whether quadratics of the lines of sight describe the inverse distances of regions better than planes do.

    A plane n . P = d has the inverse distance n . e / d along the ray e. Pixels at borders may belong to either side:
    they are left out.
    """
    inside = labels > 0
    inside[1:] &= labels[1:] == labels[:-1]
    inside[:-1] &= labels[1:] == labels[:-1]
    inside[:, 1:] &= labels[:, 1:] == labels[:, :-1]
    inside[:, :-1] &= labels[:, 1:] == labels[:, :-1]
    order = np.argsort(labels[inside], kind="stable")
    points = frame.samples[inside][order].astype(np.float64)
    firsts = np.searchsorted(labels[inside][order], np.arange(1, count + 1))
    curved = np.zeros(count, bool)
    for label, (first, end) in enumerate(pairwise(firsts.tolist()), 1):
        if end - first < _LEAST_CURVED:
            continue
        inverse = 1 / np.linalg.norm(points[first:end], axis=1)
        rays = points[first:end] * inverse[:, None]
        products = [rays[:, i] * rays[:, j] for i in range(3) for j in range(i, 3)]
        of_plane = _left_over(rays, inverse)
        if of_plane > _LEAST_RELIEF * np.linalg.norm(inverse):
            curved[label] = _left_over(np.column_stack([rays, *products]), inverse) < _CURVED_GAIN * of_plane
    return curved


def _left_over(terms: np.ndarray, values: np.ndarray) -> float:
    """The norm of what a fit of terms leaves of values."""
    return float(np.linalg.norm(values - terms @ np.linalg.lstsq(terms, values, rcond=1e-10)[0]))


def _taubin(moments: np.ndarray) -> np.ndarray:
    """The quadrics F with the least mean of F^2 over that of |grad F|^2, which is 1."""
    mean = moments[:, [_PLACE[e] for e in _TERMS]]
    scatter = moments[:, [[_PLACE[_sum(a, b)] for b in _TERMS] for a in _TERMS]] - mean[:, :, None] * mean[:, None, :]
    slope = np.zeros_like(scatter)
    for a, b, axis in np.ndindex(len(_TERMS), len(_TERMS), 3):
        factor = _TERMS[a][axis] * _TERMS[b][axis]
        if factor:
            both = _sum(_TERMS[a], _TERMS[b])
            slope[:, a, b] += factor * moments[:, _PLACE[tuple(n - 2 * (k == axis) for k, n in enumerate(both))]]
    ridge = 1e-12 * np.trace(slope, axis1=1, axis2=2)[:, None, None] * np.eye(len(_TERMS))
    root = np.linalg.inv(np.linalg.cholesky(slope + ridge))
    least = np.linalg.eigh(root @ scatter @ root.swapaxes(1, 2))[1][:, :, :1]
    vector = (root.swapaxes(1, 2) @ least)[:, :, 0]
    vector /= np.sqrt(np.einsum("na,nab,nb->n", vector, slope, vector))[:, None]
    return np.concatenate([vector, -(vector * mean).sum(axis=1, keepdims=True)], axis=1)


def _sum(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(i + j for i, j in zip(a, b, strict=True))


def _gradients(quadrics: np.ndarray, p: np.ndarray) -> np.ndarray:
    a, b, c, d, e, f = quadrics.T[:6]
    x, y, z = p.T
    curvature = np.stack([2 * a * x + d * y + e * z, d * x + 2 * b * y + f * z, e * x + f * y + 2 * c * z], axis=1)
    return curvature + quadrics[:, 6:9]


def _in_lengths(quadrics: np.ndarray, origins: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """scale F((p - origin) / scale) in powers of p."""
    a, b, c, d, e, f = quadrics.T[:6] / scales
    second = np.stack([a, d / 2, e / 2, d / 2, b, f / 2, e / 2, f / 2, c], axis=1).reshape(-1, 3, 3)
    bent = np.einsum("nij,nj->ni", second, origins)
    first = quadrics[:, 6:9] - 2 * bent
    constant = scales * quadrics[:, 9] - ((quadrics[:, 6:9] - bent) * origins).sum(axis=1)
    return np.concatenate([np.stack([a, b, c, d, e, f], axis=1), first, constant[:, None]], axis=1)
