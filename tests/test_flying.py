"""Flying pixels."""

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import DIR_COLS, DIR_ROWS, flyingPixels
from rangeedge.synthetic import pinholeCamera, plane, renderScene, sphere

NAN = np.nan
K = np.array([[250.0, 0, 59.5], [0, 250, 39.5], [0, 0, 1]])
V, U = np.indices((80, 120)).astype(float)


def smeared(distance, pixels, near=0.6, far=0.75):
    """Depth of a step smeared over so many pixels, and the share of the farther surface in each."""
    share = np.clip(distance / pixels + 0.5, 0, 1)
    z = near * (1 - share) + far * share
    return z + np.random.default_rng(0).normal(0, 0.0005, z.shape), share


DISTANCES = {"vertical": U - 59.2, "horizontal": 39.4 - V, "diagonal": (U - V - 20) / 2**0.5}


@pytest.mark.parametrize("pixels", [2, 3, 4])
@pytest.mark.parametrize("across", DISTANCES)
def test_the_pixels_between_the_sides_are_found_and_no_others(across, pixels):
    z, share = smeared(DISTANCES[across], pixels)
    flying = flyingPixels(z, K=K)
    assert flying.dtype == np.uint8
    assert set(np.unique(flying)) == {0, 255}
    inner = np.s_[10:70, 10:110]
    mixed = (share > 0.2) & (share < 0.8)
    assert (flying[inner][mixed[inner]] > 0).mean() > 0.97
    assert not flying[(share <= 0.1) | (share >= 0.9)].any()


def test_a_sharp_step_and_surfaces_have_none():
    z = np.where(U < 60, 0.6, 0.75 + 0.001 * V) + np.random.default_rng(0).normal(0, 0.0005, U.shape)
    z[:, 20:40] += 0.002 * abs(U - 30)[:, 20:40]
    assert not flyingPixels(z, K=K).any()
    assert not flyingPixels(z, pixelSize=0.003).any()


def test_a_slanted_face_of_a_few_pixels_is_a_surface_where_it_is_wide_enough_in_space():
    ramp = np.clip((U - 58.5) / 5, 0, 1)
    assert not flyingPixels(1 + 0.02 * ramp, K=K, noise=0.0001).any()  # 5 px of 4 mm: 45 degrees
    assert flyingPixels(1 + 0.2 * ramp, K=K, noise=0.0001)[:, 60:62].all()
    for unknown in ({}, {"pixelSize": 1}):  # no scale, no angle
        assert flyingPixels(1 + 0.02 * ramp, noise=0.0001, **unknown)[:, 60:62].all()
    assert not flyingPixels(1 + 0.02 * ramp, noise=0.0001, pixelSize=0.004).any()


def test_the_limb_of_a_round_surface_is_none():
    camera = pinholeCamera(K, (120, 80))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        scene = [sphere((*rng.uniform(-0.04, 0.04, 2), 0.8), 0.09), plane((0, 0, 0.84), (0.3, 0.5, -1))]
        assert not flyingPixels(renderScene(scene, camera).depth + rng.normal(0, 0.0002, U.shape), K=K).any()
    # A step between flat surfaces keeps its mixed pixels, also where a row of them begins.
    z = np.where(U < 60, 0.6, 0.75) + np.random.default_rng(0).normal(0, 0.0003, U.shape)
    z[5:, 60] = 0.66
    assert (flyingPixels(z, K=K)[6:-5, 60] > 0).all()


def test_thin_objects_are_none():
    z = np.where((U >= 60) & (U < 62), 0.6, 0.75)
    assert not flyingPixels(z, K=K, noise=0.0005).any()


def test_pixels_beside_shadow_are_found():
    z, _ = smeared(U - 59, 2)
    z[:, 60:72] = NAN
    flying = flyingPixels(z, K=K)
    assert flying[15:65, 59].all()  # diagonals leave the image sooner than rows
    assert not flying[:, :59].any()
    assert not flying[:, 60:].any()


def test_a_resized_image_loses_its_mixed_pixels():
    z = np.full((40, 60), 0.75, np.float32)
    z[10:30, 20:40] = 0.6
    z = cv2.resize(z, None, fx=2.5, fy=2.5)
    mixed = (z > 0.63) & (z < 0.72)
    flying = flyingPixels(z, K=K, noise=0.0005) > 0
    assert flying[mixed].mean() > 0.9
    assert not flying[(z == z.min()) | (z == z.max())].any()


@pytest.mark.parametrize("maxSmear", [0, 1])
def test_ramps_of_more_pixels_than_allowed_are_surfaces(maxSmear):
    z, _ = smeared(U - 59.5, 3)
    assert not flyingPixels(z, K=K, maxSmear=maxSmear).any()


def test_mirrored_and_transposed_images_have_the_same():
    z, _ = smeared((2 * U + V - 150) / 5**0.5, 3)
    flying = flyingPixels(z, noise=0.0005)
    assert flying.any()
    for moved in (lambda a: a[:, ::-1], lambda a: a[::-1], lambda a: a.T):
        assert np.array_equal(flyingPixels(moved(z).copy(), noise=0.0005), moved(flying))


def test_kinds_of_input_agree():
    z, _ = smeared(U - 59.2, 3)
    flying = flyingPixels(z, K=K, noise=0.0005)
    points = np.stack([(U - 59.5) * z / 250, (V - 39.5) * z / 250, z], -1)
    assert np.array_equal(flyingPixels(points, noise=0.0005), flying)
    assert np.array_equal(flyingPixels(z, K=K, noise=0.0005, directions=DIR_ROWS) > 0, flying > 0)
    assert not flyingPixels(z, K=K, noise=0.0005, directions=DIR_COLS).any()
    mask = np.ones(z.shape, np.uint8)
    mask[:, 50:70] = 0
    assert not flyingPixels(z, K=K, noise=0.0005, mask=mask).any()


def test_the_result_goes_where_it_is_asked_for():
    z, _ = smeared(U - 59.2, 3)
    before, dst = z.copy(), np.full(z.shape, 7, np.uint8)
    assert flyingPixels(z, None, dst, K=K) is dst
    assert np.array_equal(dst, flyingPixels(z, K=K))
    assert np.array_equal(z, before)


@pytest.mark.parametrize(
    ("args", "options", "name"),
    [
        (([1.0],), {}, "src"),
        ((np.ones((3, 4)),), {"maxSmear": -1}, "maxSmear"),
        ((np.ones((3, 4)),), {"shadowEdges": 2}, "shadowEdges"),
        ((np.ones((3, 4)),), {"K": np.eye(2)}, "K"),
        ((np.ones((3, 4)), -1.0), {}, "eps"),
        ((np.ones((3, 4)),), {"mask": np.ones((2, 2), np.uint8)}, "mask"),
        ((np.ones((3, 4)),), {"maxSmaer": 1}, "maxSmaer"),
    ],
)
def test_bad_arguments_are_named(args, options, name):
    with pytest.raises(rangeedge.error, match=f"flyingPixels: .*`{name}`") as raised:
        flyingPixels(*args, **options)
    assert raised.value.func == "flyingPixels"
