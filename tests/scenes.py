"""Range images of surfaces in front of each other, for several files of tests."""

import numpy as np

K = np.array([[30.0, 0.3, 9.2], [0, 28, 7.7], [0, 0, 1]])
NAMES = ("jump", "crease", "kind", "significance")  # of the maps of an EdgeStrength


def surfaces(rng, shape, noise=0.003):
    """Slanted and curved surfaces in front of each other, 0.5 to 2 away."""
    v, u = np.indices(shape).astype(float)
    v, u = v - shape[0] / 2, u - shape[1] / 2
    z = 1.5 + 0.01 * (u * rng.normal() + v * rng.normal())
    for _ in range(3):
        a, b, c = 0.03 * rng.normal(size=3)
        z = np.minimum(z, 1.4 + 0.2 * rng.normal() + a * u + b * v + 0.05 * abs(c) * u**2)
    return np.maximum(z, 0.5) + noise * rng.normal(size=shape)


def seen(z):
    """The points that a pinhole camera sees at these depths."""
    v, u = np.indices(z.shape)
    return (np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(K).T * z[..., None]).astype(z.dtype)
