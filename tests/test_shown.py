"""Results show themselves in a notebook."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


@pytest.fixture(scope="module")
def scan():
    return kinectNoise(renderScene(demoScene(), kinectCamera()))


def shown(result):
    return cv2.imdecode(np.frombuffer(result._repr_png_(), np.uint8), cv2.IMREAD_COLOR)


def test_every_result_is_a_picture_of_its_image(scan):
    image = rangeedge.RangeImage(scan.src, scan.geometry)
    strength = rangeedge.edgeStrength(scan.src, **scan.geometry)
    chains = rangeedge.linkEdges(scan.src, **scan.geometry)
    assert shown(image).shape == (480, 640, 3)
    assert shown(strength).shape[1] > 3 * 640
    # The kinds are those of `drawEdges`, which a legend explains.
    kinds = {tuple(colour) for colour in shown(strength)[28:508, 1288:].reshape(-1, 3)}
    assert {(0, 94, 213), (66, 228, 240), (233, 180, 86)} <= kinds
    for lines in (chains, rangeedge.fitSegments(chains)):
        height, width = shown(lines).shape[:2]
        assert 380 < height < 500
        assert 600 < width < 660
        assert shown(lines).any()


def test_nothing_is_a_picture_too():
    flat = np.zeros((40, 50), np.float32)
    strength = rangeedge.edgeStrength(flat, noise=1.0)
    chains = rangeedge.linkEdges(flat, pixelSize=1, noise=1.0)
    assert shown(strength).ndim == shown(chains).ndim == shown(rangeedge.fitSegments(chains)).ndim == 3
