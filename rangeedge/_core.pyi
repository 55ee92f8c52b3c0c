"""The compiled kernels. Arrays are C-contiguous; outputs are written in place."""

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_Real = TypeVar("_Real", np.float32, np.float64)
_Salience = TypeVar("_Salience", np.uint8, np.float32)

class Parameters:
    def __init__(
        self,
        *,
        eps: float,
        eps_factor: float,
        directions: int,
        interpolate: bool,
        endpoint: bool,
        normals: bool,
        max_shift: float,
        max_gap: int,
        merge_significance: float,
        min_significance: float,
        threads: int,
    ) -> None: ...

class RegionParameters:
    def __init__(self, *, tolerance: float, smooth_angle: float, min_area: int, new_seeds: bool) -> None: ...

def split_scan_line(y: NDArray[_Real], x: NDArray[_Real] | None, eps: float) -> NDArray[np.int32]: ...
def invert_depth(
    depth: NDArray[Any], factor: float, mask: NDArray[np.uint8] | None, inverse: NDArray[_Real]
) -> None: ...
def noise_statistics(
    ordinate: NDArray[_Real], threads: int
) -> tuple[float, float, float, float, NDArray[np.float64], NDArray[np.float64]]: ...
def edge_candidates(
    src: NDArray[_Real],
    projective: bool,
    to_plane: Sequence[float],
    axis: Sequence[float],
    noise: Sequence[float],
    noise_map: NDArray[np.float32] | None,
    parameters: Parameters,
) -> dict[str, NDArray[Any]]: ...
def edge_strength(
    src: NDArray[_Real],
    projective: bool,
    to_plane: Sequence[float],
    axis: Sequence[float],
    noise: Sequence[float],
    noise_map: NDArray[np.float32] | None,
    parameters: Parameters,
    jump: NDArray[np.float32],
    crease: NDArray[np.float32],
    kind: NDArray[np.uint8],
    significance: NDArray[np.float32],
) -> None: ...
def long_components(edges: NDArray[np.uint8], min_length: int, kept: NDArray[np.uint8]) -> None: ...
def distance_transform(
    edges: NDArray[np.uint8], distance: NDArray[np.float32], labels: NDArray[np.int32] | None, threads: int
) -> None: ...
def salience_multiplicative(
    salience: NDArray[_Salience], distance: NDArray[np.float32], labels: NDArray[np.int32] | None, threads: int
) -> None: ...
def salience_additive(
    salience: NDArray[_Salience],
    lambda_: float,
    distance: NDArray[np.float32],
    labels: NDArray[np.int32] | None,
    threads: int,
) -> None: ...
def extract_seeds(
    distance: NDArray[np.float32],
    mask: NDArray[np.uint8] | None,
    min_distance: float,
    separation: float,
    threads: int,
    markers: NDArray[np.int32],
) -> int: ...
def grow_regions(
    x: NDArray[np.float32] | None,
    y: NDArray[np.float32] | None,
    ordinate: NDArray[np.float32],
    offset: float,
    rounding: float,
    projective: bool,
    to_plane: Sequence[float],
    noise: Sequence[float],
    noise_map: NDArray[np.float32] | None,
    edges: NDArray[np.uint8] | None,
    markers: NDArray[np.int32],
    parameters: RegionParameters,
    threads: int,
    labels: NDArray[np.int32],
) -> int: ...
def verified_regions(
    x: NDArray[np.float32] | None,
    y: NDArray[np.float32] | None,
    ordinate: NDArray[np.float32],
    offset: float,
    rounding: float,
    projective: bool,
    to_plane: Sequence[float],
    noise: Sequence[float],
    noise_map: NDArray[np.float32] | None,
    edges: NDArray[np.uint8] | None,
    correlation: float,
    tolerance: float,
    share: float,
    dilations: int,
    min_area: int,
    threads: int,
    regions: NDArray[np.int32],
) -> None: ...
def label_statistics(
    labels: NDArray[np.int32], threads: int, boxes: NDArray[np.int32], centroids: NDArray[np.float64]
) -> None: ...
def region_moments(
    labels: NDArray[np.int32],
    points: NDArray[np.float64],
    ordinate: NDArray[np.float64],
    threads: int,
    origins: NDArray[np.float64],
    scales: NDArray[np.float64],
    moments: NDArray[np.float64],
    curved: NDArray[np.uint8],
) -> None: ...
def quadric_misfits(
    labels: NDArray[np.int32],
    points: NDArray[np.float64],
    threads: int,
    origins: NDArray[np.float64],
    scales: NDArray[np.float64],
    quadrics: NDArray[np.float64],
    floors: NDArray[np.float64],
    misfits: NDArray[np.float64],
) -> None: ...
