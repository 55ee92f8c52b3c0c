"""Scans and clouds of rooms, for several files of tests."""

import cv2
import numpy as np

WALLS = ((0, 5.0), (0, -4.0), (1, 3.5), (1, -4.5), (2, -1.2), (2, 1.8))  # axis, place
COLUMNS = 512


def sweep(rows, elevation, azimuth, tilt=0.0):
    """Unit rays, ranges and faces of a room around a scanner that turns."""
    up = np.radians(np.linspace(elevation, -elevation, rows))[:, None]
    around = np.radians(np.linspace(*azimuth, COLUMNS, endpoint=azimuth[0] - azimuth[1] < 359))[None]
    rays = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up) + 0 * around], -1)
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    seen = rays @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    ranges, faces = np.full(rays.shape[:2], np.inf), np.zeros(rays.shape[:2], int)
    for face, (axis, place) in enumerate(WALLS):
        with np.errstate(divide="ignore"):
            there = place / seen[..., axis]
        nearer = (there > 0) & (there < ranges)
        ranges[nearer], faces[nearer] = there[nearer], face
    return rays, ranges, faces


def borders(faces):
    """Pixels beside another face, first and last column being neighbours."""
    found = (faces != np.roll(faces, 1, 1)) | (faces != np.roll(faces, -1, 1))
    found[1:] |= faces[1:] != faces[:-1]
    found[:-1] |= faces[1:] != faces[:-1]
    return found


def near(pixels, others, reach=2):
    """Share of pixels within `reach` of others, around the seam as well."""
    far = cv2.distanceTransform((~np.tile(others, 3)).astype(np.uint8), cv2.DIST_L2, 5)
    return (far[:, pixels.shape[1] : 2 * pixels.shape[1]][pixels] <= reach).mean()


def camera_axes(points):
    return np.stack([-points[..., 1], -points[..., 2], points[..., 0]], -1)


K = np.array([[140.0, 0, 79.5], [0, 140, 59.5], [0, 0, 1]])
SHAPE = (120, 160)


def rays_of(shape=SHAPE):
    v, u = np.indices(shape)
    return np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(shape)], -1)


def depth_of(rays, noise=0.001):
    """A wall, a floor and a card before them."""
    x, y = rays[..., 0], rays[..., 1]
    with np.errstate(divide="ignore"):
        z = np.minimum(3.0, np.where(y > 0, 0.8 / y, np.inf))
    z = np.where((abs(x) < 0.25) & (y > -0.2) & (y < 0.15), 2.0 + 0.4 * x, z)
    return z + noise * np.random.default_rng(2).standard_normal(z.shape)


def turned(degrees):
    return cv2.Rodrigues(np.radians(np.array(degrees, float)))[0]
