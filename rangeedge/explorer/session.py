"""What the explorer explores: an image, its geometry, the parameters, and the pictures of the results."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from .._check import described, error
from .._option import parsed
from ..chains import link_frame
from ..constants import SALIENCE_ADDITIVE
from ..detection import selected, thin_lines
from ..detector import createScanLineDetector
from ..distance import distanceTransform, salienceDistanceTransform
from ..draw import colorizeDistance, drawChains, drawEdges, drawRegions
from ..draw.relief import relief_of, subdued
from ..edges import EdgeStrength, measure_strength
from ..explain import Explanation, explain
from ..io import RangeImage, imreadRange
from ..noise import measured_frame
from ..options import DETECTION, GEOMETRY, Growing, Linking, ScanLineParams, Selection
from ..plausible import RangeEdgeWarning
from ..regions import seeded_regions
from ..selection import overallStrength, strengthImage

SLIDERS = {  # name: least, largest, step; first those of `Selection`
    "jumpThreshold": (0.0, 1.0, 0.005),
    "creaseThreshold": (0.0, 90.0, 1.0),
    "hysteresis": (0.1, 1.0, 0.05),
    "minLength": (1, 60, 1),
    "lineSignificance": (0.0, 60.0, 1.0),
    "minSignificance": (0.0, 30.0, 0.5),
    "epsFactor": (0.5, 20.0, 0.5),
    "mergeSignificance": (0.0, 10.0, 0.5),
    "maxGap": (0, 60, 1),
    "maxShift": (0.0, 20.0, 0.5),
}
SWITCHES = ("boundaryEdges", "dynamic", "shadowEdges")


class Session:
    """One user's image and parameters."""

    def __init__(self, image: RangeImage, title: str, options: Mapping[str, Any]) -> None:
        self.title = title
        self.options = dict(options)
        self.use(image)

    @classmethod
    def of_file(cls, path: str | os.PathLike[str], **options: Any) -> Session:
        """Of an image that is a file here."""
        own = {name: options.pop(name) for name in list(options) if name in (*SLIDERS, *SWITCHES)}
        return cls(imreadRange(path).withGeometry(**options), Path(path).name, own)

    @classmethod
    def of_scene(cls, **options: Any) -> Session:
        """Of the scene of `rangeedge demo`."""
        from ..app.demo import RenderedScene

        scene = RenderedScene()
        return cls(RangeImage(scene.src, scene.geometry), scene.title, options)

    def copy(self) -> Session:
        """The same for another user."""
        return Session(self.image, self.title, self.options)

    def use(self, image: RangeImage) -> None:
        """Take an image; on an error everything stays as it was."""
        params, selection = parsed({**image.geometry, **self.options}, ScanLineParams, Selection)
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", RangeEdgeWarning)
            frame = measured_frame(image.src, params)
        self.notes = [str(w.message) for w in told if issubclass(w.category, RangeEdgeWarning)]
        self.image, self.noise, self._frame = image, frame.noise, frame
        self.results = Results(frame, params, selection)
        self.bright = relief_of(frame.depth)
        self.relief = subdued(self.bright)

    def upload(self, name: str, content: bytes) -> None:
        """Take what a user has dropped."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"image{Path(name).suffix}"
            path.write_bytes(content)
            image = imreadRange(path)
            known = {n: v for n, v in self.image.geometry.items() if n in ("K", "depthFactor") and image.src.ndim == 2}
            self.use(image if image.geometry else image.withGeometry(**known) if _fits(image, self.image) else image)
        self.title = name

    def place(
        self, camera: str, pixel_size: str, *, height_map: bool, depth_factor: str = "", invalid: str = ""
    ) -> None:
        """Take a geometry as it is typed, in the words of the command line; on an error it stays as it was."""
        texts = {"K": camera, "pixelSize": "" if camera.strip() else pixel_size}
        texts |= {"depthFactor": depth_factor, "invalid": invalid}
        given = {name: _read(name, text) for name, text in texts.items() if text.strip()}
        self.use(RangeImage(self.image.src, given | ({"heightMap": True} if height_map else {})))

    def typed(self, name: str) -> str:
        """An option of the geometry as it would be typed."""
        value = self.geometry.get(name)
        if value is None:
            return ""
        numbers = np.asarray(value, np.float64).ravel()
        if name == "K" and numbers.size == 9:
            numbers = numbers[[0, 4, 2, 5]]
        return ", ".join(f"{number:g}" for number in numbers) or "none"  # invalid=()

    def change(self, name: str, value: Any) -> None:
        """Set a parameter."""
        if value is None or value == self._usual(name):
            self.options.pop(name, None)
        else:
            self.options[name] = value
        params, selection = parsed({**self.geometry, **self.options}, ScanLineParams, Selection)
        if params == self.results.params:
            self.results = self.results.selecting(selection)
        else:
            self.results = Results(self._frame.with_noise(self.noise), params, selection)

    @property
    def geometry(self) -> dict[str, Any]:
        """How the image was taken."""
        return {name: value for name, value in self.image.geometry.items() if name in GEOMETRY}

    def value(self, name: str) -> Any:
        """What a parameter is."""
        return self.options.get(name, self._usual(name))

    def _usual(self, name: str) -> Any:
        """What it is by default, None in numbers."""
        default = DETECTION[name].default
        if default is not None:
            return default
        return Selection().of(self.results.params).lineSignificance if name == "lineSignificance" else 0.0

    def picture(self, view: str, results: Results | None = None) -> np.ndarray:
        """One of `VIEWS`, as large as the image."""
        return VIEWS[view](self, results or self.results)

    def edge_count(self) -> int:
        """How many pixels are edges."""
        return int(np.count_nonzero(self.results.edges))

    def explanation(self, x: int, y: int) -> Explanation:
        """Why a pixel is an edge or none."""
        results = self.results
        return explain(results.frame, results.params, results.selection, x, y, 24)

    def python(self) -> str:
        """The parameters as a program."""
        given = {**self.geometry, **self.options}
        words = [f"    {name}={_written(value)},\n" for name, value in given.items()]
        read = f'src = rangeedge.imreadRange("{self.title}").src\n'
        return f"import rangeedge\n\n{read}edges = rangeedge.detectEdges(\n    src,\n{''.join(words)})\n"

    def settings(self) -> bytes:
        """The parameters as a file that `ScanLineDetector.load` takes."""
        detector = createScanLineDetector()
        for name, value in {**self.geometry, **self.options}.items():
            getattr(detector, f"set{name[0].upper()}{name[1:]}")(value)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "detector.yml"
            detector.save(path)
            return path.read_bytes()


class Results:
    """What follows from the parameters, each computed when it is looked at."""

    def __init__(self, frame: Any, params: ScanLineParams, selection: Selection) -> None:
        self.frame, self.params, self.selection = frame, params, selection

    def selecting(self, selection: Selection) -> Results:
        """With other options of selection, which leave the strengths as they are."""
        other = Results(self.frame, self.params, selection)
        if "strength" in vars(self):
            other.strength = self.strength
        return other

    @cached_property
    def strength(self) -> EdgeStrength:
        return measure_strength(self.frame, self.params)

    @cached_property
    def edges(self) -> np.ndarray:
        return thin_lines(self.frame, selected(self.frame, self.strength, self.selection.of(self.params)))

    @cached_property
    def distance(self) -> np.ndarray:
        return distanceTransform(self.edges)

    @cached_property
    def salience(self) -> np.ndarray:
        jump = self.strength.jump
        cut = float(np.median(jump[jump > 0])) if jump.any() else 1.0
        return overallStrength(jump, self.strength.crease, cut)

    @cached_property
    def regions(self) -> tuple[np.ndarray, np.ndarray]:
        return seeded_regions(self.frame, self.edges, Growing())


def _edges(session: Session, results: Results) -> np.ndarray:
    return drawEdges(session.relief, results.edges, results.strength.kind)


def _chains(session: Session, results: Results) -> np.ndarray:
    return drawChains(session.relief, link_frame(results.frame, results.params, results.selection, Linking()))


VIEWS: Mapping[str, Callable[[Session, Results], np.ndarray]] = {
    "depth": lambda session, _: session.bright,
    "edges": _edges,
    "kinds": lambda session, r: drawEdges(session.relief // 3, r.strength.kind, r.strength.kind),
    "crease": lambda _, r: cv2.cvtColor(strengthImage(r.strength.crease, 64), cv2.COLOR_GRAY2BGR),
    "thin map": lambda _, r: cv2.cvtColor(r.edges, cv2.COLOR_GRAY2BGR),
    "distance": lambda _, r: colorizeDistance(r.distance),
    "salience": lambda _, r: colorizeDistance(
        salienceDistanceTransform(r.salience, SALIENCE_ADDITIVE, lambda_=20), log=True
    ),
    "seeds": lambda session, r: drawRegions(r.regions[0], session.relief, 0.9),
    "regions": lambda session, r: drawRegions(r.regions[1], session.relief, 0.7),
    "chains": _chains,
}
SHARING = (  # views whose results follow from each other, in the order in which they are quick to draw
    ("edges", "thin map", "distance", "kinds", "crease", "depth", "salience"),
    ("seeds", "regions"),
    ("chains",),
)


def _read(name: str, text: str) -> Any:
    try:
        return GEOMETRY[name].read(text.strip())
    except ValueError as problem:
        raise error(f"`{name}` {getattr(problem, 'err', problem)}") from None


def _fits(image: RangeImage, other: RangeImage) -> bool:
    """Whether an image without a geometry may be by the camera of another."""
    return image.src.shape[:2] == other.src.shape[:2] and image.src.dtype == other.src.dtype


def _written(value: Any) -> str:
    """A value as a program has it, a camera without skew by its four numbers."""
    if isinstance(value, np.ndarray):
        if value.shape == (3, 3):
            plain = np.array([[value[0, 0], 0, value[0, 2]], [0, value[1, 1], value[1, 2]], [0, 0, 1]])
            value = value[[0, 1, 0, 1], [0, 1, 2, 2]] if np.array_equal(value, plain) else value
        return repr(value.tolist())
    return repr(value) if isinstance(value, (bool, int, float, str, tuple, list, type(None))) else described(value)
