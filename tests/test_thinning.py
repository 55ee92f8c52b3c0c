"""Thinning: scikit-image's result, connected as before, one pixel wide."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge.constants import THIN_ITERATIVE, THIN_LEE, THIN_SKELETON
from rangeedge.thinning import thinEdges

METHODS = {"skeleton": THIN_SKELETON, "lee": THIN_LEE, "iterative": THIN_ITERATIVE}
every_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS.keys())


def whole_image(edges, method):
    """The oracle: scikit-image on everything, with a margin no crop could have."""
    from skimage.morphology import skeletonize, thin

    padded = np.pad(edges != 0, 3)
    if method == THIN_ITERATIVE:
        skeleton = thin(padded)
    else:
        skeleton = skeletonize(padded, method={THIN_SKELETON: "zhang", THIN_LEE: "lee"}[method])
    return (skeleton[3:-3, 3:-3] != 0).astype(np.uint8) * 255


def component_count(edges, connectivity=8):
    """Background included."""
    return cv2.connectedComponents((edges != 0).astype(np.uint8), connectivity=connectivity)[0]


def scene(thickness=3):
    edges = np.zeros((80, 100), np.uint8)
    cv2.rectangle(edges, (20, 15), (70, 60), 255, thickness)
    cv2.line(edges, (20, 40), (70, 30), 255, thickness)
    cv2.circle(edges, (80, 62), 12, 255, thickness)
    cv2.line(edges, (4, 4), (4, 30), 255, thickness)
    return edges


@every_method
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_is_the_skeleton_of_the_whole_image(method, seed):
    rng = np.random.default_rng(seed)
    edges = (rng.random(rng.integers(1, 16, 2)) < rng.random()).astype(np.uint8)
    edges = np.pad(edges, rng.integers(0, 4, (2, 2)))
    thin = thinEdges(edges, method)
    assert np.array_equal(thin, whole_image(edges, method))
    assert component_count(thin) == component_count(edges)
    assert not (thin & ~(edges * np.uint8(255))).any()
    assert np.array_equal(thinEdges(thin, method), thin)


@every_method
@pytest.mark.parametrize("thickness", [1, 2, 3, 5])
def test_lines_become_one_pixel_wide(method, thickness):
    edges = scene(thickness)
    thin = thinEdges(edges, method)
    assert component_count(thin) == component_count(edges)
    # Four pixels in a square are the mark of a line two pixels wide; only a meeting of lines may show one.
    square = cv2.erode(thin, np.ones((2, 2), np.uint8))
    assert np.count_nonzero(square) <= 1
    # Frame, chord, ring and bar keep their length, but for corners that are cut and ends that recede.
    assert 280 < np.count_nonzero(thin) <= np.count_nonzero(scene(1))


@every_method
def test_holes_stay_open(method):
    edges = scene(5)
    thin = thinEdges(edges, method)
    # The edges themselves, the outside, both halves of the frame, the ring.
    assert component_count(255 - edges, 4) == component_count(255 - thin, 4) == 5


@every_method
def test_degenerate_maps(method):
    assert not thinEdges(np.zeros((5, 7), np.uint8), method).any()
    dot = np.zeros((5, 7), np.uint8)
    dot[2, 3] = 255
    assert np.array_equal(thinEdges(dot, method), dot)
    assert thinEdges(np.ones((1, 1), np.uint8), method) == [[255]]
    full = thinEdges(np.full((9, 15), 255, np.uint8), method)
    assert component_count(full) == 2
    assert np.count_nonzero(full) <= 15
    for line in (np.full((1, 9), 255, np.uint8), np.full((9, 1), 255, np.uint8)):
        assert np.array_equal(thinEdges(line, method), line)


@every_method
def test_inputs(method):
    edges = scene()
    before = edges.copy()
    thin = thinEdges(edges, method)
    assert np.array_equal(edges, before)
    assert thin.dtype == np.uint8
    assert set(np.unique(thin)) == {0, 255}
    for same in (
        edges != 0,
        (edges != 0).astype(np.uint8),
        np.asfortranarray(edges),
        np.repeat(edges, 2, axis=1)[:, ::2],
    ):
        assert np.array_equal(thinEdges(same, method), thin)


@every_method
def test_shift(method):
    edges = scene()
    shifted = np.pad(edges, ((7, 0), (0, 5)))
    assert np.array_equal(thinEdges(shifted, method)[7:, :-5], thinEdges(edges, method))


def test_default_is_the_skeleton():
    assert np.array_equal(thinEdges(scene()), thinEdges(scene(), THIN_SKELETON))
    assert not np.array_equal(thinEdges(scene()), thinEdges(scene(), THIN_ITERATIVE))


def test_dst():
    edges = scene()
    expected = thinEdges(edges)
    dst = np.empty_like(edges)
    assert thinEdges(edges, dst=dst) is dst
    assert np.array_equal(dst, expected)
    assert thinEdges(edges, THIN_SKELETON, edges) is edges
    assert np.array_equal(edges, expected)


@pytest.mark.parametrize(
    "edges",
    [None, [[1]], np.zeros((3, 3)), np.zeros((3, 3), np.int32), np.zeros(3, np.uint8), np.zeros((0, 3), np.uint8),
     np.zeros((3, 3, 3), np.uint8)],
)  # fmt: skip
def test_bad_edges(edges):
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`edges`"):
        thinEdges(edges)


@pytest.mark.parametrize("method", [-1, 3, 1.0, True, "lee", None])
def test_bad_method(method):
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`method`"):
        thinEdges(scene(), method)


def test_bad_dst():
    dst = np.empty_like(scene())
    dst.flags.writeable = False
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`dst`"):
        thinEdges(scene(), dst=dst)
