"""Digests of all that the package computes, to see that a change left every bit as it was.

    python tests/digest.py > before.txt
    python tests/digest.py | diff before.txt -

Images of every geometry, in single and double precision, pass through every stage under four settings. A line names
the image, the setting and the output, and gives the first half of a SHA-256; the last line is that of all together.
Digests are equal for every number of threads and every width of vector, and differ between versions of NumPy, OpenCV
and scikit-image.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import cv2
import numpy as np

import rangeedge as re
from rangeedge import synthetic

SHAPE = (90, 124)
K = np.array([[130.0, 0.0, 61.5], [0.0, 128.0, 44.0], [0.0, 0.0, 1.0]])
SKEWED = K + np.array([[0.0, 3.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def depths(seed: int, noise: float = 0.002) -> np.ndarray:
    """Slanted planes, a sphere and a cylinder in front of each other, about 1.5 away."""
    rng = np.random.default_rng(seed)
    v, u = np.indices(SHAPE, dtype=float)
    v, u = v - SHAPE[0] / 2, u - SHAPE[1] / 2
    z = 1.8 + 0.001 * u - 0.002 * v
    z = np.minimum(z, 1.5 + 0.004 * np.abs(u + 20) + 0.0003 * v)
    z = np.where((np.abs(u - 30) < 22) & (np.abs(v) < 30), np.minimum(z, 1.35 - 0.003 * u + 0.005 * v), z)
    inside = 20.0**2 - (u + 38) ** 2 - (v - 16) ** 2
    z = np.where(inside > 0, np.minimum(z, 1.4 - 0.006 * np.sqrt(np.maximum(inside, 0))), z)
    inside = 14.0**2 - (v + 26) ** 2
    z = np.where((inside > 0) & (u < 10), np.minimum(z, 1.45 - 0.008 * np.sqrt(np.maximum(inside, 0))), z)
    return z + noise * rng.standard_normal(SHAPE)


def with_holes(image: np.ndarray, seed: int, value: float = np.nan) -> np.ndarray:
    """A copy without data in a band, in a block, and in single pixels."""
    image = image.copy()
    image[:, 70:73] = value
    image[50:60, 20:31] = value
    image[np.random.default_rng(seed).random(image.shape[:2]) < 0.01] = value
    return image


def seen(z: np.ndarray, camera: np.ndarray = K) -> np.ndarray:
    """The points at these depths."""
    v, u = np.indices(z.shape)
    return np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(camera).T * z[..., None]


def on_grid(z: np.ndarray, dx: float, dy: float) -> np.ndarray:
    """The points at these depths on parallel lines of sight."""
    v, u = np.indices(z.shape)
    return np.stack([dx * u, dy * v, z], -1)


def turned(points: np.ndarray, degrees: float) -> np.ndarray:
    """The points about the x axis."""
    rotation, _ = cv2.Rodrigues(np.radians([degrees, 0.0, 0.0]))
    return points @ rotation.T


def of_both_precisions(name: str, src: np.ndarray, geometry: dict[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    for dtype in (np.float32, np.float64):
        yield f"{name}-{np.dtype(dtype).name}", src.astype(dtype), geometry


def images() -> Iterator[tuple[str, np.ndarray, dict[str, Any]]]:
    """Name, range image, geometry with mask and noise."""
    mask = np.ones(SHAPE, np.uint8)
    mask[:12, 40:90] = mask[70:, 100:] = 0
    model = re.NoiseModel(a=0.0005, b=0.0002, c=0.0005, correlation=1.5)
    grid = dict(pixelSize=(0.011, 0.012))
    millimetres = np.round(1000 * with_holes(depths(1), 1, 0)).astype(np.uint16)
    yield "depth-uint16", millimetres, dict(K=K)
    yield "depth-uint16-skewed-mask", millimetres, dict(K=SKEWED, mask=mask, noise=model)
    yield "depth-int32", millimetres.astype(np.int32), dict(K=K, depthFactor=500.0)
    yield from of_both_precisions("depth-exact", depths(0, noise=0.0), dict(K=K))
    yield from of_both_precisions("depth-holes", with_holes(depths(2), 2), dict(K=K))
    yield from of_both_precisions("depth-skewed-model", depths(3), dict(K=SKEWED, noise=model))
    yield from of_both_precisions("depth-mask-number", with_holes(depths(4), 4), dict(K=K, mask=mask, noise=0.002))
    sigmas = np.random.default_rng(5).uniform(0.0015, 0.003, SHAPE)
    yield from of_both_precisions("depth-noise-map", depths(5), dict(K=K, noise=sigmas))
    yield from of_both_precisions("grid", depths(6), grid)
    yield from of_both_precisions("grid-holes-mask", with_holes(depths(7), 7), dict(grid, mask=mask, noise=model))
    yield from of_both_precisions("grid-exact-noise-map", depths(0, noise=0.0), dict(grid, noise=sigmas))
    yield from of_both_precisions("height", -with_holes(depths(8), 8), dict(grid, heightMap=True))
    codes = np.round(255 - 300 * (depths(9) - 1.2)).clip(1, 255).astype(np.uint8)
    yield "height-uint8", codes, dict(heightMap=True, pixelSize=3.0, depthFactor=1.0)
    yield from of_both_precisions("points", seen(with_holes(depths(10), 10)), {})
    yield from of_both_precisions("points-behind", turned(seen(with_holes(depths(11), 11)), 85.0), dict(noise=model))
    yield from of_both_precisions("points-parallel", on_grid(with_holes(depths(12), 12), 0.011, 0.012), dict(mask=mask))
    yield from of_both_precisions(
        "points-height", on_grid(-depths(13), 0.011, 0.012), dict(heightMap=True, noise=sigmas)
    )
    wall = np.random.default_rng(14).normal(1.0, 0.003, SHAPE)
    yield "noise-alone", wall, dict(K=K)
    yield "no-data", np.full(SHAPE, np.nan, np.float32), dict(K=K)
    camera = synthetic.pinholeCamera(np.array([[290.0, 0, 159.5], [0, 290, 119.5], [0, 0, 1]]), (320, 240))
    scene = synthetic.renderScene(synthetic.demoScene(), camera)
    scan = synthetic.kinectNoise(scene)
    yield "kinect", scan.src, scan.geometry
    scan = synthetic.gaussianNoise(scene, re.NoiseModel.kinect2(), seed=3)
    yield "time-of-flight", scan.src, scan.geometry
    scan = synthetic.triangulationNoise(
        synthetic.renderScene(synthetic.twoCylinders(), synthetic.orthographicCamera((0.002, 0.0025), (150, 120))), 5e-4
    )
    yield "triangulation", scan.src, scan.geometry


def settings(deviation: float) -> dict[str, dict[str, Any]]:
    """Options of the detector, for an image of that typical noise."""
    paper = re.ScanLineParams.paper(epsFactor=4.0)
    defaults = re.ScanLineParams()
    return {
        "defaults": {},
        "paper": {
            f.name: getattr(paper, f.name)
            for f in fields(paper)
            if not np.array_equal(getattr(paper, f.name), getattr(defaults, f.name))
        },
        "endpoint": dict(measure=re.MEASURE_ENDPOINT, crease=re.CREASE_MAX),
        "other": dict(
            eps=5 * deviation,
            directions=re.DIR_ROWS | re.DIR_DIAG135,
            maxShift=1.5,
            maxGap=3,
            mergeSignificance=3.0,
            minSignificance=5.0,
        ),
    }


def without(options: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name not in names}


def outputs(src: np.ndarray, geometry: dict[str, Any], options: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Every stage's result."""
    strength = re.edgeStrength(src, **geometry, **options)
    for name in ("jump", "crease", "kind", "significance"):
        yield name, getattr(strength, name)
    yield "points", re.edgePoints(src, **geometry, **options)
    edges = re.detectEdges(src, 0.02, **geometry, **options)
    yield "edges", edges
    yield "long", re.detectEdges(src, 0.02, 20.0, hysteresis=0.5, minLength=10, **geometry, **options)
    yield "dynamic", re.detectEdges(src, 0.02, 25.0, dynamic=True, **geometry, **options)
    yield "thin", re.thinEdges((strength.jump > 0.02) | (strength.crease > 25), re.THIN_ITERATIVE)
    yield "distance", re.distanceTransform(edges)
    salience = np.maximum(re.strengthImage(strength.jump, 0.1), re.strengthImage(strength.crease, 64.0))
    for name, method in (("multiplicative", re.SALIENCE_MULTIPLICATIVE), ("additive", re.SALIENCE_ADDITIVE)):
        distance, labels = re.salienceDistanceTransformWithLabels(salience, method)
        yield name, distance
        yield f"{name}-labels", labels
    _, seeds = re.extractSeeds(re.distanceTransform(edges))
    yield "seeds", seeds
    yield "grown", re.growRegions(src, seeds, edges=edges, **geometry)
    yield "regions", re.segmentRegions(src, edges=edges, **geometry)
    yield "closed", re.closeContours(edges, src, **geometry)


def digest(value: Any) -> str:
    array = np.ascontiguousarray(value)
    described = f"{array.dtype.descr} {array.shape}".encode()
    return hashlib.sha256(described + array.tobytes()).hexdigest()


def main() -> None:
    together = hashlib.sha256()

    def show(image: str, setting: str, output: str, value: Any) -> None:
        line = f"{image:32} {setting:8} {output:21} {digest(value)[:32]}"
        together.update(line.encode())
        print(line)

    for image, src, geometry in images():
        noise = re.estimateNoise(src, **without(geometry, "noise"))
        values = [noise.a, noise.b, noise.c, noise.correlation]
        show(image, "-", "noise", values)
        line = np.asarray(src[len(src) // 2] if src.ndim == 2 else src[len(src) // 2, :, 2])
        show(image, "-", "segments", re.splitScanLine(line, 0.01))
        show(image, "-", "segments-uneven", re.splitScanLine(line, 0.01, np.arange(len(line)) ** 1.1))
        for setting, options in settings(float(noise(1.5))).items():
            for output, value in outputs(src, geometry, options):
                show(image, setting, output, value)
    print(together.hexdigest())


if __name__ == "__main__":
    main()
