"""Symmetries of edge strengths: no rule prefers a side."""

import cv2
import numpy as np
import pytest
from scenes import NAMES, K, seen, surfaces

from rangeedge import (
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_ALL,
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    FIT_INTERP,
    edgePoints,
    edgeStrength,
)

NAN = np.nan


def boxes():
    """A box on a slanted plane, 33 x 33: every run has an odd number of samples."""
    v, u = np.indices((33, 33)).astype(float)
    z = 2.0 + 0.004 * u + 0.002 * v
    z[8:25, 8:25] = 1.5
    return z


MOVES = {
    "left to right": (lambda a: a[:, ::-1], {DIR_DIAG45: DIR_DIAG135, DIR_DIAG135: DIR_DIAG45}),
    "upside down": (lambda a: a[::-1], {DIR_DIAG45: DIR_DIAG135, DIR_DIAG135: DIR_DIAG45}),
    "transposed": (lambda a: a.T, {DIR_ROWS: DIR_COLS, DIR_COLS: DIR_ROWS}),
    "turned": (lambda a: a[::-1, ::-1], {}),
}


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("direction", [DIR_ROWS, DIR_COLS, DIR_DIAG45, DIR_DIAG135, DIR_ALL])
def test_strengths_move_with_the_image(move, direction):
    moved, directions = MOVES[move]
    z = boxes()
    options = dict(noise=0.001, crease=CREASE_MAX)
    before = edgeStrength(z, directions=direction, **options)
    after = edgeStrength(moved(z), directions=directions.get(direction, direction), **options)
    assert before.jump.any()
    for name, a, b in zip(NAMES, before, after, strict=True):
        np.testing.assert_allclose(moved(a), b, rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("direction", [DIR_ROWS, DIR_COLS])
def test_transposing_changes_no_bit(direction):
    # A transposed image has the same lines, read the same way, so that every tie falls alike.
    z = surfaces(np.random.default_rng(2), (40, 30))
    other = DIR_COLS if direction == DIR_ROWS else DIR_ROWS
    # Without a shift neighbours are not asked, whose sums round as their order has it.
    options = dict(noise=0.003, crease=CREASE_MAX, minSignificance=0.0, maxShift=0.0)
    before = edgeStrength(z, directions=direction, **options)
    after = edgeStrength(z.T, directions=other, **options)
    assert all(map_.any() for map_ in before)
    assert all(np.array_equal(a.T, b) for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("step", [0, 2**-8], ids=["noisy", "coarse"])
@pytest.mark.parametrize("crease", [CREASE_NORMAL, CREASE_MAX])
def test_candidates_of_a_moved_image_are_the_same_with_all_their_strengths(move, step, crease):
    moved, _ = MOVES[move]
    for seed in range(5):
        z = surfaces(np.random.default_rng(seed), (64, 80))
        z = np.round(z / step) * step if step else z
        before, after = (edgeStrength(a, noise=0.003, crease=crease) for a in (z, moved(z)))
        assert np.count_nonzero(before.significance) > 200
        assert np.array_equal(moved(before.significance) > 0, after.significance > 0)
        assert np.array_equal(moved(before.kind), after.kind)
        np.testing.assert_allclose(moved(before.jump), after.jump, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(moved(before.significance), after.significance, rtol=1e-4)


@pytest.mark.parametrize("shift", [(1, 0), (0, 3), (5, 7)])
@pytest.mark.parametrize("geometry", ["grid", "pinhole"])
def test_strengths_shift_with_the_image(shift, geometry):
    # A frame of no data keeps every run as it is.
    z = np.pad(surfaces(np.random.default_rng(4), (30, 34)), 12, constant_values=NAN)
    moved = np.roll(z, shift, (0, 1))
    if geometry == "grid":
        kwargs, moved_kwargs, rtol = dict(pixelSize=0.02), dict(pixelSize=0.02), 1e-5
    else:
        moved_K = K + np.array([[0, 0, shift[1]], [0, 0, shift[0]], [0, 0, 0]])
        kwargs, moved_kwargs, rtol = dict(K=K), dict(K=moved_K), 1e-4
    before, after = edgeStrength(z, noise=0.003, **kwargs), edgeStrength(moved, noise=0.003, **moved_kwargs)
    assert before.jump.any()
    if geometry == "grid":
        assert np.array_equal(np.roll(before.jump, shift, (0, 1)), after.jump)
    for name, a, b in zip(NAMES, before, after, strict=True):
        np.testing.assert_allclose(np.roll(a, shift, (0, 1)), b, rtol=rtol, atol=0, err_msg=name)


@pytest.mark.parametrize("scale", [4.0, 1000.0])
@pytest.mark.parametrize("geometry", ["grid", "pinhole", "points"])
def test_strengths_do_not_depend_on_the_unit_of_length(scale, geometry):
    z = surfaces(np.random.default_rng(6), (30, 34))
    if geometry == "points":
        z = seen(z)
    kwargs = dict(K=K) if geometry == "pinhole" else {}
    grid = geometry == "grid"
    before = edgeStrength(z, noise=0.003, **kwargs, **(dict(pixelSize=0.02) if grid else {}))
    after = edgeStrength(z * scale, noise=0.003 * scale, **kwargs, **(dict(pixelSize=0.02 * scale) if grid else {}))
    assert before.jump.any()
    np.testing.assert_allclose(before.jump * scale, after.jump, rtol=1e-5)
    np.testing.assert_allclose(before.crease, after.crease, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(before.significance, after.significance, rtol=1e-4)
    assert np.array_equal(before.kind, after.kind)


# Threads.


@pytest.mark.parametrize("options", [dict(), dict(crease=CREASE_NORMAL), dict(fit=FIT_INTERP, minSignificance=0.0)])
def test_threads_change_no_bit(options):
    z = surfaces(np.random.default_rng(7), (150, 140)).astype(np.float32)
    assert z.size >= 1 << 14
    threads, results = cv2.getNumThreads(), []
    try:
        for n in (1, 2, 3):
            cv2.setNumThreads(n)
            results.append((*edgeStrength(z, noise=0.003, **options), edgePoints(z, noise=0.003, **options)))
    finally:
        cv2.setNumThreads(threads)
    assert results[0][0].any()
    for other in results[1:]:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(results[0], other, strict=True))
