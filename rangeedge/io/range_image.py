"""What a file holds: a range image, and what it says about it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class _SourceAndGeometry(NamedTuple):
    src: np.ndarray
    geometry: dict[str, Any]


class RangeImage(_SourceAndGeometry):
    """A range image as the detector takes it: ``edgeStrength(image.src, **image.geometry)``.

    Attributes
    ----------
    src : (H, W) integers or floats, or (H, W, 3) or (H, W, 4) float points
    geometry : dict
        Those of `K`, `distCoeffs`, `pixelSize`, `heightMap` and `depthFactor` that the file knows.
    viewpoint : tuple of 7 floats or None
        Where the points were taken from, in their own frame: translation (x, y, z) and unit quaternion (w, x, y, z) of
        the sensor, as PCD files have it. None where the file does not say.
    georeference : (2, 3) float64 array or None
        Map coordinates of pixel centres: ``x, y = georeference @ (column, row, 1)``, from a GeoTIFF.
    epsg : int or None
        The code of the reference system of these, where the file names one.

    It unpacks as a pair: ``src, geometry = imreadRange(path)``.
    """

    viewpoint: tuple[float, ...] | None
    georeference: np.ndarray | None
    epsg: int | None

    def __new__(
        cls,
        src: np.ndarray,
        geometry: dict[str, Any] | None = None,
        *,
        viewpoint: tuple[float, ...] | None = None,
        georeference: np.ndarray | None = None,
        epsg: int | None = None,
    ) -> RangeImage:
        image = super().__new__(cls, src, {} if geometry is None else geometry)
        image.viewpoint = viewpoint
        image.georeference = georeference
        image.epsg = epsg
        return image

    def withGeometry(self, **given: Any) -> RangeImage:
        """The same image with a geometry that replaces what the file knows.

        withGeometry(*[, K[, pixelSize[, heightMap[, depthFactor]]]]) -> image

        A camera or a grid replaces all but the factor of the depths.
        """
        known = self.geometry
        if "K" in given or "pixelSize" in given:
            known = {name: value for name, value in known.items() if name == "depthFactor"}
        return self._replace(geometry={**known, **given})

    def _replace(self, **changes: Any) -> RangeImage:  # type: ignore[override]
        kept = {"src": self.src, "geometry": self.geometry, **vars(self)}
        return RangeImage(**{**kept, **changes})

    def __repr__(self) -> str:
        values = np.asarray(self.src)[np.isfinite(self.src)]
        values = values[values != 0] if values.dtype.kind in "ui" else values
        extent = f", {values.size} values from {values.min():.6g} to {values.max():.6g}" if values.size else ", no data"
        known = "".join(f", {name}" for name in self.geometry)
        return f"RangeImage({self.src.dtype} of shape {self.src.shape}{extent}{known})"

    def _repr_png_(self) -> bytes:
        from ..draw.shown import of_image

        return of_image(self.src, self.geometry)
