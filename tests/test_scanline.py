"""Splitting of one scan line (paper, 4.1)."""

import cv2
import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge import splitScanLine

NAN = np.nan


def line(text):
    """Values of a line; a bar stands between segments, a dot for an invalid sample."""
    return np.array([NAN if word == "." else float(word) for word in text.replace("|", " ").split()])


def barred(z, segments):
    """The line as text again, with bars where it was split, invalid samples as dots."""
    words = ["." if np.isnan(value) else f"{value:g}" for value in z]
    first, last = {int(s[0]) for s in segments}, {int(s[1]) for s in segments}
    out = []
    for k, word in enumerate(words):
        if k in first and out and out[-1] != ".":
            out.append("|")
        out.append(word)
    assert len(first) == len(last) == len(segments)
    return " ".join(out)


# Worked out by hand. In each line: the whole run is approximated by the quadratic through its two ends and its
# midpoint (of two, the one closer to the straight line between the ends, or that line), and cut beside its worst sample
# (of two, the one closer to the middle, or both), which joins its closer neighbour (of two, the one farther from the
# middle).
@pytest.mark.parametrize(
    ("eps", "expected"),
    [
        # One to three samples fit exactly, whatever they are.
        (0.0, "5"),
        (0.0, "5 -7"),
        (0.0, "0 100 -3"),
        # Lines and quadratics over an odd number of samples fit exactly.
        (0.0, "3 3 3 3 3 3 3"),
        (0.0, "0 1 2 3 4 5 6"),
        (0.0, "9 4 1 0 1 4 9"),
        # The middle samples are 1/3 below and above the line between the ends: that is the curve, and both are worst.
        # Each joins its equal.
        (0.3, "0 0 | 1 1"),
        (0.4, "0 0 1 1"),
        # Through samples 0, 1 and 3 runs x (x - 1) / 6, which leaves 5/3 at sample 2; that joins the 1 on its right.
        (1.6, "0 0 | 2 1"),
        (1.7, "0 0 2 1"),
        (1e-9, "0 0 0 0 | 9 9 9 9"),
        # A step where the midpoint is the first of the higher ones: the residuals are equal on either side.
        (0.5, "0 0 0 | 8 8 8"),
        # The 3 is closer to the line than the first 4. That is the worst sample, off by 3/7; it joins the 4 behind it.
        (0.1, "0 1 2 3 | 4 4 4 4"),
        (0.1, "4 4 4 4 | 3 2 1 0"),
        # With one more, samples 2 and 6 are both off by 1/2 and equally far from the middle: both cuts are made, though
        # the roof has one edge. The basic scheme splits too often (paper, 4.1).
        (0.1, "0 1 2 | 3 4 4 | 4 4 4"),
        (0.1, "4 4 4 | 4 4 3 | 2 1 0"),
        # A spike in the middle is the midpoint: 9 - t^2 is off by 8 on either side of it.
        (0.1, "0 0 0 | 9 | 0 0 0"),
        # A spike at the ends.
        (0.1, "9 | 0 0 0 0 0 0"),
        (0.1, "0 0 0 0 0 0 | 9"),
        # Invalid samples separate runs, whose samples do not see each other.
        (0.1, "0 0 0 . 9 9 9"),
        (0.1, ". . 1 2 3 4 . 7 ."),
        (0.1, "0 0 0 0 | 5 5 5 5 . 5 5 5 5 | 0 0 0 0"),
    ],
)
def test_lines_split_by_hand(eps, expected):
    z = line(expected)
    assert barred(z, splitScanLine(z, eps)) == expected


def worst_of_four(a, b, c, d):
    """Residual of sample 2 of four, where the quadratic runs through samples 0, 1 and 3."""
    at_2 = -a / 3 + b + d / 3
    return abs(c - at_2)


@pytest.mark.parametrize("z", [(0, 0, 2, 1), (3, 3, 5, 1), (0, 2, 5, 1)])
def test_the_tolerance_is_the_largest_residual_that_may_stay(z):
    residual = worst_of_four(*z)
    z = np.array(z, float)
    assert len(splitScanLine(z, residual * (1 + 1e-9))) == 1
    assert len(splitScanLine(z, residual * (1 - 1e-9))) == 2


def test_a_residual_equal_to_the_tolerance_stays():
    z = np.array([0.0, 0.0, 0.0, 1.0, 0.0])  # the curve is 0
    assert splitScanLine(z, 1.0).tolist() == [[0, 4]]
    assert len(splitScanLine(z, np.nextafter(1.0, 0))) > 1


@pytest.mark.parametrize(
    "expected",
    [
        # Through samples 0, 2 and 4 runs t (3/2 + 3/4 t): -0.75 at sample 1, 2.25 at sample 3.
        "0 -0.75 0 | 5 6",
        "0 -0.75 0 0.5 | 6",
        "0 -0.75 0 2.25 6",
    ],
)
def test_the_extreme_sample_joins_the_closer_neighbour(expected):
    z = line(expected)
    assert barred(z, splitScanLine(z, 1.0)) == expected


@pytest.mark.parametrize("expected", ["0 0 0 | 1 0", "0 1 | 0 0 0"])
def test_of_two_equally_close_neighbours_the_one_farther_from_the_middle_is_joined(expected):
    # Through both ends and the middle runs f = 0; the 1 is the worst sample and has 0 on either side.
    z = line(expected)
    assert barred(z, splitScanLine(z, 0.5)) == expected


def test_of_two_equal_residuals_that_closer_to_the_middle_is_worst_or_both_are():
    for expected in (
        "0 1 | 0 | 1 0",  # samples 1 and 3 are off by 1
        "0 0 0 1 | 0 0 0 | 1 0",  # samples 3 and 7 are; of "0 0 0 1", x (x - 1) / 6 is close enough
        "0 1 | 0 0 0 | 1 0 0 0",
    ):
        z = line(expected)
        assert barred(z, splitScanLine(z, 0.5)) == expected


@pytest.mark.parametrize("z", ["0 0 1 2 0 0", "0 0 2 1 0 0"])
def test_the_midpoint_of_an_even_run_is_the_one_closer_to_the_line_between_the_ends(z):
    # x (5 - x) / 6 through the 1: off by 1 at the 2, by 2/3 at samples 1 and 4.
    assert len(splitScanLine(line(z), 1.01)) == 1
    assert len(splitScanLine(line(z), 0.99)) > 1


# Spacing.


def test_spacing_does_not_matter_where_it_is_even():
    z = np.array([0, 0.1, 0.5, 0.3, 2, 2.2, 2.1, 5, 5, 5.5])
    expected = splitScanLine(z, 0.2).tolist()
    assert splitScanLine(z, 0.2, 0.25).tolist() == expected
    assert splitScanLine(z, 0.2, 7.0).tolist() == expected
    assert splitScanLine(z, 0.2, np.arange(10.0)).tolist() == expected


def test_abscissae_make_a_parabola_of_uneven_samples():
    x = np.array([0.0, 0.1, 0.5, 0.6, 2.0, 2.5, 4.0])
    z = 3 * x * x - x + 2
    assert splitScanLine(z, 1e-12, x).tolist() == [[0, 6]]
    assert len(splitScanLine(z, 1e-2)) > 1


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        ([0, 1, 2, 1, 2, 3], [[0, 2], [3, 5]]),  # folds back
        ([0, 1, 1, 2, 3, 4], [[0, 1], [2, 5]]),  # stands still
        ([3, 2, 1, 0, -1, -2], [[k, k] for k in range(6)]),  # runs backward
        ([0, 1, NAN, 2, 3, 4], [[0, 1], [3, 5]]),
    ],
)
def test_a_run_ends_where_the_abscissae_do_not_increase(x, expected):
    assert splitScanLine(np.zeros(6), 0.1, np.array(x, float)).tolist() == expected


# Properties.

values = st.lists(
    st.one_of(st.integers(-4, 4).map(float), st.floats(-10, 10, width=32), st.sampled_from([NAN, 1e30, -1e30, 1e-42])),
    min_size=1,
    max_size=60,
)


@settings(max_examples=150, deadline=None)
@given(values, st.sampled_from([0.0, 1e-3, 0.3, 2.0, 1e29]), st.sampled_from([np.float32, np.float64]))
def test_splits_are_those_of_the_oracle(z, eps, dtype):
    z = np.array(z, dtype)
    with np.errstate(all="ignore"):
        expected = oracle.split(z, np.arange(len(z)).astype(dtype), dtype(eps))
    assert splitScanLine(z, eps).tolist() == [list(s) for s in expected]


@settings(max_examples=60, deadline=None)
@given(values, st.integers(0, 2**32 - 1))
def test_splits_over_abscissae_are_those_of_the_oracle(z, seed):
    z = np.array(z)
    x = np.cumsum(np.random.default_rng(seed).normal(0.7, 0.6, len(z)))
    with np.errstate(all="ignore"):
        expected = oracle.split(z, x, 0.3)
    assert splitScanLine(z, 0.3, x).tolist() == [list(s) for s in expected]


@settings(max_examples=60, deadline=None)
@given(values, st.sampled_from([0.0, 0.3, 2.0]))
def test_segments_cover_every_valid_sample_once_and_in_order(z, eps):
    z = np.array(z)
    segments = splitScanLine(z, eps)
    covered = [k for first, last in segments for k in range(first, last + 1)]
    assert covered == np.flatnonzero(np.isfinite(z)).tolist()
    assert segments.dtype == np.int32
    assert segments.shape == (len(segments), 2)


def test_no_sample_is_farther_than_the_tolerance_from_its_curve():
    rng = np.random.default_rng(3)
    z = np.cumsum(rng.normal(0, 1, 500))
    for first, last in splitScanLine(z, 0.7):
        m = oracle.midpoint(z, np.arange(500.0), first, last) if last > first else first
        knots = np.unique([first, m, last])
        curve = np.polyfit(knots - m, z[knots], len(knots) - 1)
        k = np.arange(first, last + 1)
        assert np.abs(np.polyval(curve, k - m) - z[k]).max() <= 0.7 + 1e-9


def test_scaling_values_and_tolerance_alike_changes_nothing():
    z = np.cumsum(np.random.default_rng(4).normal(0, 1, 300))
    assert np.array_equal(splitScanLine(z, 0.5), splitScanLine(z * 1024, 512.0))
    assert np.array_equal(splitScanLine(z, 0.5), splitScanLine(-z, 0.5))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_reversed_line_is_cut_at_the_same_places(dtype):
    rng = np.random.default_rng(8)
    for n in (4, 7, 30, 33, 400):
        for z in (np.cumsum(rng.normal(0, 1, n)), np.repeat(rng.normal(0, 1, n), rng.integers(1, 6, n))):
            z = z.astype(dtype)
            backward = len(z) - 1 - splitScanLine(z[::-1].copy(), 0.7)[::-1, ::-1]
            assert np.array_equal(splitScanLine(z, 0.7), backward)


def test_a_sawtooth_of_a_million_samples_is_split_without_recursion():
    z = np.zeros(1_000_000, np.float32)
    z[::2] = 1
    segments = splitScanLine(z[:4000], 0.1)
    assert segments[0, 0] == 0
    assert segments[-1, 1] == 3999
    assert np.array_equal(splitScanLine(np.ones(1_000_000), 0.1), [[0, 999_999]])


# Arguments.


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.int32, np.int64, np.float16, ">f4", ">f8", ">i2"])
def test_every_real_type_is_taken(dtype):
    z = np.array([0, 0, 0, 0, 9, 9, 9, 9]).astype(dtype)
    assert splitScanLine(z, 0.5).tolist() == [[0, 3], [4, 7]]


def test_views_and_read_only_lines_are_taken_and_left_alone():
    rows = np.array([[0.0, 7], [0, 7], [0, 7], [0, 7], [9, 7], [9, 7], [9, 7], [9, 7]])
    z = rows[:, 0]
    z.flags.writeable = False
    before = rows.copy()
    x = np.arange(8.0)
    x[0] = NAN
    assert splitScanLine(z, 0.5).tolist() == [[0, 3], [4, 7]]
    assert splitScanLine(z, 0.5, x).tolist() == [[1, 3], [4, 7]]
    assert splitScanLine(z[::-1], 0.5).tolist() == [[0, 3], [4, 7]]
    assert np.array_equal(rows, before)


def test_infinite_values_are_invalid():
    assert splitScanLine(np.array([1.0, np.inf, 2, -np.inf, NAN]), 0.1).tolist() == [[0, 0], [2, 2]]
    assert splitScanLine(np.full(4, NAN), 0.1).shape == (0, 2)


@pytest.mark.parametrize(
    ("args", "name"),
    [
        (([1.0, 2.0], 0.1), "z"),
        ((np.zeros((2, 3)), 0.1), "z"),
        ((np.zeros(0), 0.1), "z"),
        ((np.zeros(3, complex), 0.1), "z"),
        ((np.array(["a"]), 0.1), "z"),
        ((np.zeros(3), -1), "eps"),
        ((np.zeros(3), NAN), "eps"),
        ((np.zeros(3), np.inf), "eps"),
        ((np.zeros(3), "1"), "eps"),
        ((np.zeros(3), None), "eps"),
        ((np.zeros(3), True), "eps"),
        ((np.zeros(3), 0.1, 0), "pixelSize"),
        ((np.zeros(3), 0.1, -2.0), "pixelSize"),
        ((np.zeros(3), 0.1, NAN), "pixelSize"),
        ((np.zeros(3), 0.1, np.zeros(4)), "pixelSize"),
        ((np.zeros(3), 0.1, np.zeros((3, 1))), "pixelSize"),
        ((np.zeros(3), 0.1, "abc"), "pixelSize"),
    ],
)
def test_bad_arguments_are_named(args, name):
    with pytest.raises(rangeedge.error, match=f"splitScanLine: `{name}` must be") as raised:
        splitScanLine(*args)
    assert isinstance(raised.value, cv2.error)
    assert raised.value.func == "splitScanLine"
