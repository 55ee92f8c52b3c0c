"""A pinhole camera from a file or an array, in any of the forms that tools write.

Files: YAML, JSON or XML of cv2.FileStorage, ROS' camera_info (YAML and JSON), Open3D's PinholeCameraIntrinsic and
PinholeCameraParameters, librealsense's intrinsics, NeRF's transforms; NPY, NPZ, and text of 4, 9, 12 or 16 numbers.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from .._check import public, reals
from .arrays import arrays_of_npz, read_npy
from .settings import parse
from .source import file_name, opened
from .text import number

_FILE_BYTES = 2**20  # no camera takes more
_ARRAY_BYTES = 2**16


class Camera(NamedTuple):
    """A pinhole camera: `K` 3x3 float64, distortion as `cv2.undistort` takes it, and (width, height) of its images."""

    K: np.ndarray
    distCoeffs: np.ndarray | None = None
    size: tuple[int, int] | None = None


@public
def read_camera(path: str | os.PathLike[str]) -> Camera:
    """The camera that a file describes."""
    name = file_name(path)
    with opened(name) as (stream, size):
        if size > _FILE_BYTES:
            raise ValueError(f"it has {size} bytes, more than a camera file")
        data = stream.read(size)
        if data.startswith(b"\x93NUMPY"):
            return Camera(matrix_of(read_npy(data)))
        if data.startswith(b"PK\x03\x04"):
            return _from_mapping(arrays_of_npz(data, _ARRAY_BYTES))
        text = data.decode("utf-8-sig", "replace")
        numbers = _plain_numbers(text)
        if numbers is not None:
            return Camera(matrix_of(numbers))
        return _from_mapping(parse(text))


def matrix_of(values: Any) -> np.ndarray:
    """The camera matrix in (fx, fy, cx, cy), 9 numbers by rows or columns, 3x3, a projection 3x4, or 4x4."""
    array = reals(values)
    if 1 in array.shape:
        array = array.ravel()
    if array.shape == (4,):
        fx, fy, cx, cy = array.tolist()
        array = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    elif array.ndim == 1 and array.size in (9, 12, 16):
        array = array.reshape({9: (3, 3), 12: (3, 4), 16: (4, 4)}[array.size])
    if array.shape not in ((3, 3), (3, 4), (4, 4)):
        raise ValueError(
            f"a camera is (fx, fy, cx, cy), 9 numbers, 3x3, 3x4 or 4x4, not an array of shape {array.shape}"
        )
    K = array[:3, :3]
    if (K[:2, 2] == 0).all() and K[2, 2] == 1 and K[2, :2].any():
        K = K.T  # by columns
    upper = K[0, 0] > 0 and K[1, 1] > 0 and K[1, 0] == 0 and (K[2] == (0, 0, 1)).all()
    if not (upper and np.isfinite(K).all()):
        raise ValueError(f"{K.tolist()} is no camera matrix [[fx, s, cx], [0, fy, cy], [0, 0, 1]] with fx, fy > 0")
    return np.ascontiguousarray(K)


def _plain_numbers(text: str) -> np.ndarray | None:
    """The numbers that a text consists of, comments left out; None where there is anything else."""
    words = [word for line in text.splitlines() for word in line.split("#")[0].translate(_PUNCTUATION).split()]
    try:
        values = np.array([number(word.encode()) for word in words])
    except ValueError:
        return None
    return values if len(values) in (4, 9, 12, 16) else None


_PUNCTUATION = str.maketrans(",;[]()", "      ")


# Names as they are written, in lower case and without what joins their words.
_MATRIX = ("k", "cameramatrix", "intrinsicmatrix", "intrinsics", "intrinsic", "mtx", "m1", "p", "projectionmatrix")
_DISTORTION = ("d", "distortioncoefficients", "distortioncoeffs", "distcoeffs", "distortion", "coeffs", "dist", "d1")
_FOCAL = (("fx", "fy"), ("flx", "fly"))
_CENTRE = (("cx", "cy"), ("ppx", "ppy"))
_SIZE = (("width", "height"), ("imagewidth", "imageheight"), ("w", "h"))
_PINHOLE_MODELS = ("plumbbob", "rationalpolynomial", "none", "brownconrady", "pinhole", "opencv", "radtan", "0", "4")
_FISHEYE = ("fisheye", "equidistant", "kannalabrandt4", "ftheta", "opencvfisheye", "omni", "mei")


def _from_mapping(tree: Any) -> Camera:
    cameras = list(_cameras(tree, ""))
    if not cameras:
        raise ValueError("it names no camera matrix (K, camera_matrix, intrinsic_matrix) and no fx, fy, cx, cy")
    chosen = [name for name, _ in cameras if "depth" in name.lower()] if len(cameras) > 1 else [cameras[0][0]]
    if len(chosen) != 1:
        raise ValueError(
            f"it describes {len(cameras)} cameras ({', '.join(name for name, _ in cameras)}); store the one that is "
            "meant in a file of its own"
        )
    return dict(cameras)[chosen[0]]


def _cameras(tree: Any, name: str) -> Iterator[tuple[str, Camera]]:
    """Every camera in nested maps, with the keys that lead there."""
    if isinstance(tree, list):
        tree = {str(i): item for i, item in enumerate(tree)}
    if not isinstance(tree, Mapping):
        return
    items = {_plain(str(key)): value for key, value in tree.items()}
    matrix = _matrix(items)
    if matrix is not None:
        yield name or "camera", Camera(matrix, _distortion(items), _image_size(items))
        return
    for key, value in tree.items():
        yield from _cameras(value, f"{name}.{key}" if name else str(key))


def _plain(name: str) -> str:
    return name.lower().replace("_", "").replace("-", "").replace(" ", "")


def _matrix(items: Mapping[str, Any]) -> np.ndarray | None:
    for key in _MATRIX:
        values = _numbers(items.get(key))
        if values is not None and values.size in ((4, 9, 12, 16) if key.startswith("intrinsic") else (9, 12, 16)):
            return matrix_of(values)
    for fx, fy in _FOCAL:
        for cx, cy in _CENTRE:
            if all(isinstance(items.get(key), (int, float, np.ndarray)) for key in (fx, fy, cx, cy)):
                return matrix_of([float(items[key]) for key in (fx, fy, cx, cy)])
    return None


def _distortion(items: Mapping[str, Any]) -> np.ndarray | None:
    """Coefficients in the order of cv2; None where all are zero or none are given."""
    model = str(items.get("distortionmodel", items.get("model", "none"))).lower().rpartition(".")[2]
    values = next((found for key in _DISTORTION if (found := _numbers(items.get(key))) is not None), None)
    if values is None:
        named = [items.get(key, 0.0) for key in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
        values = np.array([value if isinstance(value, (int, float)) else 0.0 for value in named])
    values = values.ravel()
    model = _plain(model)
    if model in _FISHEYE:
        raise ValueError(f"its lens is a fisheye ({model}), no pinhole; undistort the image first")
    if not values.any():
        return None
    if model not in _PINHOLE_MODELS:
        raise ValueError(f"its lens has the distortion model {model!r}; undistort the image first")
    if not np.isfinite(values).all():
        raise ValueError(f"its distortion {values.tolist()} is not finite")
    if len(values) not in (4, 5, 8, 12, 14):
        raise ValueError(f"it has {len(values)} coefficients of distortion, not 4, 5, 8, 12 or 14 as cv2")
    return values


def _image_size(items: Mapping[str, Any]) -> tuple[int, int] | None:
    resolution = items.get("resolution")
    sizes = [[items.get(name) for name in names] for names in _SIZE]
    for found in [*sizes, resolution] if isinstance(resolution, list) and len(resolution) == 2 else sizes:
        if all(isinstance(value, (int, float)) and 0 < value < 2**31 for value in found):
            return int(found[0]), int(found[1])  # type: ignore[arg-type]
    return None


def _numbers(value: Any) -> np.ndarray | None:
    """An array of what is one: nested lists, or the data of a matrix of ROS, cv2 or JSON."""
    if isinstance(value, Mapping):
        value = value.get("data")
    if not isinstance(value, (list, tuple, np.ndarray)):
        return None
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None
