"""What a range scanner would deliver of a rendering: its noise, its rounding, its shadows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import cv2
import numpy as np

from .. import _check
from ..io.calibration import (
    ABW_CALIBRATIONS,
    PERCEPTRON_MIRROR_TO_MIRROR,
    PERCEPTRON_STANDOFF,
    PERCEPTRON_STEP,
    abwPoints,
    perceptronPoints,
)
from .cameras import abwCamera
from .rendering import TOUCHING, Rendering, grouped
from .solids import Rays, Vector, cast, extended, vector

Seed = int | np.random.Generator

# Kinect v1: baseline in metres, disparity step in pixels.
_KINECT_BASELINE, _KINECT_STEP = 0.075, 1 / 8


class Scan(NamedTuple):
    """A noisy range image as a scanner delivers it: ``edgeStrength(scan.src, **scan.geometry)``.

    `raw` holds the scanner's own integers: range of ABW and Perceptron, disparity steps of the Kinect; None elsewhere.
    """

    src: np.ndarray
    geometry: dict[str, Any]
    raw: np.ndarray | None = None


def _checked(rendering: Any, seed: Any) -> np.random.Generator:
    if not isinstance(rendering, Rendering):
        raise _check.fail("rendering", "a Rendering", _check.described(rendering))
    if not isinstance(seed, np.random.Generator):
        seed = _check.integer("seed", seed, 0)
    return np.random.default_rng(seed)


def _rays(rendering: Rendering) -> Rays:
    return rendering.camera.rays(*rendering.camera.pixels())


def _points(rendering: Rendering, depth: np.ndarray) -> np.ndarray:
    origins, directions = _rays(rendering)
    points = origins + depth.reshape(-1, 1) * directions
    return points.reshape(*depth.shape, 3).astype(np.float32)


def _scan(rendering: Rendering, depth: np.ndarray) -> Scan:
    geometry = dict(rendering.camera.geometry)
    return Scan(depth.astype(np.float32) if geometry else _points(rendering, depth), geometry)


def _shadow(rendering: Rendering, light: np.ndarray) -> np.ndarray:
    """Pixels whose point the light does not reach."""
    seen = np.flatnonzero(np.isfinite(rendering.depth))
    points = rendering.points.reshape(-1, 3)[seen]
    directions = points - light
    reached, _ = cast(rendering.scene, (np.broadcast_to(light, points.shape), directions))
    shadow = np.zeros(rendering.depth.shape, np.bool_)
    shadow.ravel()[seen] = reached < 1 - TOUCHING
    return shadow


def _smooth_noise(rng: np.random.Generator, shape: tuple[int, int], radius: float) -> np.ndarray:
    """Standard normal noise correlated over `radius` pixels (1 sigma of the Gaussian window)."""
    margin = int(np.ceil(4 * radius))
    white = rng.standard_normal((shape[0] + 2 * margin, shape[1] + 2 * margin))
    window = cv2.getGaussianKernel(2 * margin + 1, radius)
    smooth = cv2.sepFilter2D(white, cv2.CV_64F, window, window)[margin:-margin, margin:-margin]
    return smooth / (window**2).sum()


@_check.public
def gaussianNoise(rendering: Rendering, sigma: float | Callable[[np.ndarray], np.ndarray], seed: Seed = 0) -> Scan:
    """White Gaussian noise along the lines of sight.

    gaussianNoise(rendering, sigma[, seed]) -> scan

    Parameters
    ----------
    sigma
        Standard deviation, or a function of depth that returns it, such as a `NoiseModel`.
    seed
        An integer >= 0, or a generator to draw from; the same seed gives the same scan.

    Raises
    ------
    error
        A negative sigma, or an argument of another type.
    """
    rng = _checked(rendering, seed)
    deviation = sigma(rendering.depth) if callable(sigma) else _check.number("sigma", sigma, 0)
    if (np.asarray(deviation) < 0).any():
        raise _check.fail("sigma", ">= 0 at every depth", _check.described(sigma))
    return _scan(rendering, rendering.depth + deviation * rng.standard_normal(rendering.depth.shape))


@_check.public
def triangulationNoise(
    rendering: Rendering, sigma: float = 0.05, seed: Seed = 0, *, light: Vector | None = None
) -> Scan:
    """A quiet laser triangulation scanner: little white noise, and no data where the laser casts a shadow.

    triangulationNoise(rendering[, sigma[, seed]], *[, light]) -> scan

    Parameters
    ----------
    sigma
        Standard deviation of the depth in the unit of the scene; 0.03 to 0.08 mm is usual for a table-top scanner.
    light
        Position of the laser; without it, beside the camera at a third of its working distance, to the right.

    See `gaussianNoise` for the rest.
    """
    rng = _checked(rendering, seed)
    sigma = _check.number("sigma", sigma, 0)
    light = (rendering.camera.distance / 3, 0.0, 0.0) if light is None else light
    depth = rendering.depth + sigma * rng.standard_normal(rendering.depth.shape)
    depth[_shadow(rendering, vector("light", light))] = np.nan
    return _scan(rendering, depth)


@_check.public
def abwNoise(rendering: Rendering, sigma: float = 0.6, seed: Seed = 0) -> Scan:
    """The ABW structured-light scanner of Hoover et al. (1996): eight bits of range, shadows of the projector.

    abwNoise(rendering[, sigma[, seed]]) -> scan

    The range r is an integer from 1 to 255, the depth r / 0.791686 + 771.016866: one step is 1.263, the width of two
    pixels. `src` is `abwPoints` of `raw`, the 8-bit image; 0 there, NaN in `src`, is no data.

    Parameters
    ----------
    rendering
        By `abwCamera`.
    sigma
        Standard deviation of the depth before it is rounded.

    See `gaussianNoise` for the rest.
    """
    rng = _checked(rendering, seed)
    sigma = _check.number("sigma", sigma, 0)
    if not np.array_equal(rendering.camera.geometry.get("K", 0), abwCamera().geometry["K"]):
        raise _check.fail("rendering", "a picture by abwCamera()", "one by another camera")
    offset, scale, _ = ABW_CALIBRATIONS[2]
    depth = rendering.depth + sigma * rng.standard_normal(rendering.depth.shape)
    steps = np.rint((depth - offset) * scale)
    lost = ~((steps >= 1) & (steps <= 255)) | _shadow(rendering, np.array([rendering.camera.distance / 3, 0.0, 0.0]))
    raw = np.where(lost, 0, steps).astype(np.uint8)
    return Scan(abwPoints(raw), {}, raw)


@_check.public
def perceptronNoise(rendering: Rendering, sigma: float = 0.8, seed: Seed = 0) -> Scan:
    """The Perceptron time-of-flight scanner of Hoover et al. (1996): twelve bits of range, noisy, mixed at jumps.

    perceptronNoise(rendering[, sigma[, seed]]) -> scan

    `src` is `perceptronPoints` of `raw`, the 12-bit range in steps of 0.20236: points on an irregular grid. Beside a
    jump the beam meets both surfaces, and the pixel gets a depth in between. No data is 0 in `raw`, NaN in `src`.

    Parameters
    ----------
    rendering
        By `perceptronCamera`.
    sigma
        Standard deviation along the beam.

    See `gaussianNoise` for the rest.
    """
    rng = _checked(rendering, seed)
    sigma = _check.number("sigma", sigma, 0)
    if rendering.camera.geometry:
        raise _check.fail("rendering", "a picture by perceptronCamera()", "one by another camera")
    depth = _mixed(rendering, 0.35)
    depth += sigma * rng.standard_normal(depth.shape)
    # The way from the laser to the last mirror counts as well; rays start on that mirror.
    x, y, z = _rays(rendering)[0].T.reshape(3, *depth.shape)
    inside = z - PERCEPTRON_MIRROR_TO_MIRROR + np.hypot(x, PERCEPTRON_MIRROR_TO_MIRROR - y)
    steps = np.rint((depth + inside) / PERCEPTRON_STEP - PERCEPTRON_STANDOFF)
    lost = ~((steps >= 1) & (steps <= 4095))
    raw = np.where(lost, 0, steps).astype(np.uint16)
    points = perceptronPoints(raw)
    points[lost] = np.nan
    return Scan(points, {}, raw)


def _mixed(rendering: Rendering, radius: float) -> np.ndarray:
    """Depths averaged over a beam of `radius` pixels; only beside jumps, where that makes a difference."""
    beside = np.flatnonzero(rendering.jump > 0)
    x, y = (c[beside] for c in rendering.camera.pixels())
    parts = [
        cast(rendering.scene, rendering.camera.rays(x + dx * radius, y + dy * radius))[0]
        for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
    ]
    depth = rendering.depth.copy()
    depth.ravel()[beside] = np.mean(parts, 0)
    return depth


@_check.public
def kinectNoise(
    rendering: Rendering, sigma: float = 0.0014, seed: Seed = 0, *, jitter: float = 0.8, holes: float = 0.005
) -> Scan:
    """A Kinect v1: noise in inverse depth, correlated between pixels; ragged edges, shadows, holes; whole millimetres.

    kinectNoise(rendering[, sigma[, seed]], *[, jitter[, holes]]) -> scan

    The disparity f b / z (b = 75 mm) is disturbed, rounded to 1/8 pixel and turned back into depth, so that noise and
    resolution grow with z^2 (Khoshelham and Oude Elberink, 2012: 1.4 mm and 2.9 mm at 1 m). `src` is uint16, 0 is no
    data.

    Parameters
    ----------
    rendering
        By `kinectCamera`, or another pinhole camera in metres.
    sigma
        Standard deviation of the inverse depth in 1/m before rounding.
    jitter
        Standard deviation in pixels by which the border between two faces wanders.
    holes
        Share of pixels lost at random, in small blobs.

    See `gaussianNoise` for the rest.
    """
    rng = _checked(rendering, seed)
    sigma = _check.number("sigma", sigma, 0)
    jitter = _check.number("jitter", jitter, 0, 10)
    holes = _check.number("holes", holes, 0, 1)
    geometry = rendering.camera.geometry
    if "K" not in geometry:
        raise _check.fail("rendering", "a picture by a pinhole camera", "one by another camera")
    depth = _jittered(rendering, rng, jitter)
    shape = depth.shape
    per_step = geometry["K"][0, 0] * _KINECT_BASELINE / _KINECT_STEP
    disparity = per_step * (1 / depth + sigma * _smooth_noise(rng, shape, 1.0))
    disparity[_shadow(rendering, np.array([_KINECT_BASELINE, 0.0, 0.0]))] = np.nan
    blobs = _smooth_noise(rng, shape, 1.5)
    disparity[blobs > np.quantile(blobs, 1 - holes)] = np.nan
    steps = np.rint(disparity)
    with np.errstate(divide="ignore"):
        millimetres = np.rint(1000 * per_step / steps)
    raw = np.where((steps > 0) & (millimetres <= 65535), steps, 0).astype(np.uint16)
    return Scan(np.where(raw > 0, millimetres, 0).astype(np.uint16), dict(geometry), raw)


def _jittered(rendering: Rendering, rng: np.random.Generator, jitter: float) -> np.ndarray:
    """Depths where each pixel sees the face of a pixel nearby, extended to its own line of sight."""
    height, width = shape = rendering.depth.shape
    offset = [np.rint(jitter * _smooth_noise(rng, shape, 1.0)).astype(int) for _ in range(2)]
    row, col = np.indices(shape)
    source = (np.clip(row + offset[0], 0, height - 1), np.clip(col + offset[1], 0, width - 1))
    faces, near = rendering.faces[source], rendering.depth[source]
    depth = np.where(faces == rendering.faces, rendering.depth, near)
    origins, directions = _rays(rendering)
    every = [face for solid in rendering.scene for face in solid.faces]
    for face, here in grouped(every, np.where(faces == rendering.faces, -1, faces).ravel()):
        depth.ravel()[here] = extended(face, (origins[here], directions[here]), near.ravel()[here])
    return depth
