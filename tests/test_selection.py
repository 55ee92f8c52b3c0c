"""Selection of edges: grey levels, thresholds, hysteresis, length and the dynamic threshold."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge import EDGE_CONVEX, EdgeStrength
from rangeedge.selection import overallStrength, selectEdges, strengthImage

INF = np.inf


def image(*rows):
    return np.array(rows, np.float32)


def zeros(like):
    return np.zeros(like.shape, np.float32)


def random_strength(rng, shape=(24, 31), share=0.3, top=10.0):
    return (rng.random(shape) * top * (rng.random(shape) < share)).astype(np.float32)


# Oracles, written for reading.


def components(edges):
    """8-connected components as lists of (row, col), by flood fill."""
    left = set(zip(*map(np.ndarray.tolist, np.nonzero(edges)), strict=True))
    found = []
    while left:
        stack, component = [left.pop()], []
        while stack:
            row, col = stack.pop()
            component.append((row, col))
            around = {(row + i, col + j) for i in (-1, 0, 1) for j in (-1, 0, 1)} & left
            left -= around
            stack += around
        found.append(component)
    return found


def selected(jump, crease, jump_threshold, crease_threshold, hysteresis, min_length):
    def reach(share):
        a = (jump > 0) & (jump >= np.float32(share * jump_threshold))
        b = (crease > 0) & (crease >= np.float32(share * crease_threshold))
        return a | b

    strong, edges = reach(1.0), np.zeros(jump.shape, np.uint8)
    for component in components(reach(hysteresis)):
        rows, cols = zip(*component, strict=True)
        length = max(max(rows) - min(rows), max(cols) - min(cols)) + 1
        if strong[rows, cols].any() and length >= min_length:
            edges[rows, cols] = 255
    return edges


class TestStrengthImage:
    @pytest.mark.parametrize(
        ("strength", "level"),
        [
            (0, 0),
            (1e-30, 1),
            (64 / 255, 2),
            (0.25, 1),
            (20, 80),
            (30, 120),
            (63.9, 255),
            (64, 255),
            (90, 255),
            (1e30, 255),
        ],
    )
    def test_levels_of_the_paper(self, strength, level):
        # 64/255 as float32 lies above one level, so its ceiling is 2.
        assert strengthImage(image([strength]), 64) == [[level]]

    def test_exact_levels_are_not_rounded_up(self):
        levels = np.arange(256)
        assert np.array_equal(strengthImage(levels[np.newaxis].astype(np.float32), 255)[0], levels)

    def test_type_shape_and_input_kept(self):
        strength = random_strength(np.random.default_rng(0))
        before = strength.copy()
        levels = strengthImage(strength, 5)
        assert levels.dtype == np.uint8
        assert levels.shape == strength.shape
        assert np.array_equal(strength, before)

    def test_real_types_and_views_agree(self):
        strength = np.arange(24).reshape(4, 6)
        expected = strengthImage(strength.astype(np.float32), 20)
        for dtype in (np.float64, np.uint8, np.int32, np.uint16):
            assert np.array_equal(strengthImage(strength.astype(dtype), 20), expected)
        assert np.array_equal(strengthImage(np.asfortranarray(strength.astype(np.float32)), 20), expected)
        assert np.array_equal(strengthImage(strength.astype(np.float32)[:, ::-2], 20), expected[:, ::-2])

    def test_dst(self):
        dst = np.empty((1, 2), np.uint8)
        assert strengthImage(image([32, 64]), 64, dst) is dst
        assert dst.tolist() == [[128, 255]]

    @pytest.mark.parametrize("cut", [0, -1, np.nan, np.inf, "64", None, True])
    def test_bad_cut(self, cut):
        with pytest.raises(rangeedge.error, match=r"strengthImage.*`cut`"):
            strengthImage(image([1]), cut)

    @pytest.mark.parametrize(
        "strength",
        [image([-1]), image([np.nan]), image([np.inf]), np.zeros((0, 3), np.float32), np.zeros(3, np.float32), [[1.0]],
         np.zeros((2, 2), complex)],
    )  # fmt: skip
    def test_bad_strength(self, strength):
        with pytest.raises(rangeedge.error, match=r"strengthImage.*`strength`"):
            strengthImage(strength, 64)


class TestOverallStrength:
    def test_is_the_maximum_of_both(self):
        rng = np.random.default_rng(1)
        jump, crease = random_strength(rng), random_strength(rng, top=90)
        expected = np.maximum(strengthImage(jump, 4), strengthImage(crease, 64))
        assert np.array_equal(overallStrength(jump, crease, 4), expected)
        dst = np.empty_like(expected)
        assert overallStrength(jump, crease, 4, 64, dst) is dst
        assert np.array_equal(dst, expected)

    def test_crease_cut(self):
        assert overallStrength(image([0]), image([30]), 1, creaseCut=30) == [[255]]

    @pytest.mark.parametrize(
        ("arguments", "name"),
        [
            ((image([1]), image([1, 2]), 1), "crease"),
            ((image([-1]), image([1]), 1), "jump"),
            ((image([1]), image([1]), 0), "jumpCut"),
            ((image([1]), image([1]), 1, -3), "creaseCut"),
        ],
    )
    def test_errors(self, arguments, name):
        with pytest.raises(rangeedge.error, match=f"overallStrength.*`{name}`"):
            overallStrength(*arguments)


class TestThresholds:
    def test_either_strength_is_enough(self):
        jump, crease = image([2, 0, 2, 1]), image([0, 30, 30, 29])
        assert selectEdges(jump, crease, 2).tolist() == [[255, 255, 255, 0]]

    def test_the_threshold_itself_counts_in_single_precision(self):
        assert selectEdges(image([0.1]), image([0]), 0.1) == [[255]]

    def test_zero_means_any_positive_strength(self):
        strength = image([0, 1e-30, 5])
        assert selectEdges(strength, zeros(strength), 0).tolist() == [[0, 255, 255]]
        assert selectEdges(zeros(strength), strength, INF, 0).tolist() == [[0, 255, 255]]
        assert selectEdges(strength, strength, 1e-60).tolist() == [[0, 255, 255]]

    @pytest.mark.parametrize("off", [INF, np.float32(INF), 1e300])
    def test_infinity_switches_off(self, off):
        strength = image([0, 3e38])
        assert not selectEdges(strength, zeros(strength), off, hysteresis=0.5).any()
        assert not selectEdges(zeros(strength), strength, 0, off, hysteresis=0.5).any()

    def test_inputs_kept_and_dst_filled(self):
        rng = np.random.default_rng(2)
        jump, crease = random_strength(rng), random_strength(rng, top=90)
        before = jump.copy(), crease.copy()
        dst = np.full(jump.shape, 7, np.uint8)
        options = {"hysteresis": 0.5, "minLength": 3, "dynamic": True}
        assert selectEdges(jump, crease, 8, 60, dst=dst, **options) is dst
        assert np.array_equal(dst, selectEdges(jump, crease, 8, 60, **options))
        assert set(np.unique(dst)) <= {0, 255}
        assert np.array_equal(jump, before[0])
        assert np.array_equal(crease, before[1])

    @pytest.mark.parametrize(
        ("change", "name"),
        [
            ({"jump": image([-1, 0])}, "jump"),
            ({"jump": image([np.nan, 0])}, "jump"),
            ({"crease": image([0])}, "crease"),
            ({"crease": image([INF, 0])}, "crease"),
            ({"jumpThreshold": -1}, "jumpThreshold"),
            ({"jumpThreshold": np.nan}, "jumpThreshold"),
            ({"jumpThreshold": None}, "jumpThreshold"),
            ({"creaseThreshold": -INF}, "creaseThreshold"),
            ({"creaseThreshold": "30"}, "creaseThreshold"),
            ({"hysteresis": 0}, "hysteresis"),
            ({"hysteresis": 1.1}, "hysteresis"),
            ({"minLength": 0}, "minLength"),
            ({"minLength": 2.0}, "minLength"),
            ({"dynamic": 1}, "dynamic"),
            ({"dst": [[0, 0]]}, "dst"),
        ],
    )
    def test_errors(self, change, name):
        arguments = {"jump": image([1, 0]), "crease": image([0, 1]), "jumpThreshold": 1.0} | change
        with pytest.raises(rangeedge.error, match=f"selectEdges.*`{name}`"):
            selectEdges(**arguments)


class TestHysteresisAndLength:
    def test_weak_pixels_need_a_strong_one_in_their_component(self):
        jump = image([5, 3, 0, 0, 3], [0, 0, 3, 0, 0], [0, 0, 0, 0, 3], [2, 0, 0, 0, 0])
        expected = [[255, 255, 0, 0, 0], [0, 0, 255, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]]
        assert selectEdges(jump, zeros(jump), 5, hysteresis=0.6).tolist() == expected

    def test_a_crease_may_carry_on_a_jump(self):
        assert selectEdges(image([5, 0, 0]), image([0, 20, 0]), 5, 30, hysteresis=0.6).tolist() == [[255, 255, 0]]

    def test_length_is_the_extent_and_not_the_pixel_count(self):
        jump = np.zeros((9, 9), np.float32)
        jump[0:2, 0:2] = 1  # four pixels, two long
        jump[4, 0:4] = 1  # four pixels, four long
        jump[[5, 6, 7, 8], [8, 7, 6, 5]] = 1  # a diagonal, four long
        edges = selectEdges(jump, zeros(jump), 1, minLength=4)
        assert not edges[0:2, 0:2].any()
        assert np.array_equal(edges[4:] > 0, jump[4:] > 0)
        assert not selectEdges(jump, zeros(jump), 1, minLength=5).any()

    def test_length_is_measured_after_hysteresis(self):
        jump = image([5, 3, 3, 0])
        assert selectEdges(jump, zeros(jump), 5, minLength=3).sum() == 0
        assert selectEdges(jump, zeros(jump), 5, minLength=3, hysteresis=0.5).tolist() == [[255, 255, 255, 0]]

    @settings(max_examples=60, deadline=None)
    @given(st.integers(0, 2**32 - 1), st.sampled_from([0.2, 0.5, 1.0]), st.integers(1, 6), st.floats(0, 8))
    def test_oracle(self, seed, hysteresis, min_length, threshold):
        rng = np.random.default_rng(seed)
        shape = tuple(rng.integers(1, 20, 2))
        jump, crease = random_strength(rng, shape), random_strength(rng, shape, top=90)
        edges = selectEdges(jump, crease, threshold, 60, hysteresis=hysteresis, minLength=min_length)
        assert np.array_equal(edges, selected(jump, crease, threshold, 60, hysteresis, min_length))

    def test_symmetries(self):
        rng = np.random.default_rng(3)
        jump, crease = random_strength(rng), random_strength(rng, top=90)

        def select(a, b, unit=1):
            return selectEdges(a, b, 7 * unit, 60, hysteresis=0.5, minLength=4)

        edges = select(jump, crease)
        assert 0 < np.count_nonzero(edges) < edges.size
        assert np.array_equal(select(jump[::-1], crease[::-1]), edges[::-1])
        assert np.array_equal(select(jump.T, crease.T), edges.T)
        assert np.array_equal(select(1024 * jump, crease, 1024), edges)


class TestDynamicThreshold:
    @staticmethod
    def noisy_scene():
        """Faint short chains everywhere, one long chain just as faint, one strong and short, one strong and long."""
        rng = np.random.default_rng(4)
        strength = np.zeros((120, 160), np.float32)
        for row in range(30, 118, 4):
            for col in range(2, 156, 8):
                strength[row, col : col + rng.integers(1, 5)] = rng.uniform(0.5, 1.5)
        strength[4, 5:150] = 1.2
        strength[10, 10:14] = 12
        strength[16, 20:120] = 12
        return strength

    def test_keeps_the_long_and_the_strong(self):
        strength = self.noisy_scene()
        for edges in (
            selectEdges(strength, zeros(strength), 0, dynamic=True),
            selectEdges(zeros(strength), strength, INF, 0, dynamic=True),
        ):
            expected = strength > 0
            expected[20:] = False
            assert np.array_equal(edges > 0, expected)

    def test_follows_the_formula(self):
        # Rows of 2, 3 and 4 pixels with strengths 1, 2 and 3; then probes on either side of the line.
        def scene(length, value):
            strength = np.zeros((80, 60), np.float32)
            for i in range(36):
                strength[2 * i, 1 : 3 + i % 3] = 1 + (i // 3) % 3
            strength[76, 1 : 1 + length] = value
            return strength

        deviation = 1.4826 * np.sqrt(2 / np.pi)  # median absolute deviations are 1 for both populations
        line = 2 + 6 * deviation - 3 * deviation * 20 / (3 + 6 * deviation)
        for value, kept in ((line - 0.01, False), (line + 0.01, True)):
            strength = scene(20, value)
            edges = selectEdges(strength, zeros(strength), 0, dynamic=True)
            assert edges[76].any() == kept
            assert not edges[:76].any()

    def test_chains_end_at_junctions(self):
        # A strong line that a faint one runs into: the faint branch goes, the strong one stays.
        strength = self.noisy_scene()
        strength[:28] = 0
        strength[14, 20:140] = 12
        strength[15:20, 80] = 0.6
        edges = selectEdges(strength, zeros(strength), 0, dynamic=True)
        assert edges[14, 20:140].all()
        assert not edges[17:20, 80].any()

    def test_thick_edges_are_kept_whole(self):
        strength = self.noisy_scene()
        strength[17:19, 20:120] = 12
        edges = selectEdges(strength, zeros(strength), 0, dynamic=True)
        assert edges[16:19, 20:120].all()

    def test_only_removes(self):
        strength = self.noisy_scene()
        options = {"hysteresis": 0.8, "minLength": 3}
        plain = selectEdges(strength, zeros(strength), 1.3, **options)
        dynamic = selectEdges(strength, zeros(strength), 1.3, dynamic=True, **options)
        assert not (dynamic & ~plain).any()
        assert np.count_nonzero(dynamic) < np.count_nonzero(plain)

    def test_a_scene_of_few_chains_has_no_population(self):
        strength = np.zeros((30, 30), np.float32)
        strength[3:28:6, 2:28] = 1
        assert np.array_equal(selectEdges(strength, zeros(strength), 0, dynamic=True) > 0, strength > 0)

    def test_no_candidates(self):
        assert not selectEdges(image([0, 0]), image([0, 0]), 0, dynamic=True).any()

    @pytest.mark.parametrize("flip", [np.flipud, np.fliplr, np.transpose])
    def test_symmetries(self, flip):
        strength = self.noisy_scene()
        edges = selectEdges(strength, zeros(strength), 0, dynamic=True)
        flipped = np.ascontiguousarray(flip(strength))
        assert np.array_equal(selectEdges(flipped, zeros(flipped), 0, dynamic=True), flip(edges))


def test_errors_are_opencv_errors():
    with pytest.raises(cv2.error):
        selectEdges(image([1]), image([1]), -1)


@pytest.mark.parametrize(("chains", "kept"), [(8, True), (10, False), (12, False)])
def test_few_chains_have_no_statistics_to_speak_of(chains, kept):
    strength = np.zeros((4 * chains, 40))
    strength[1::4, 5:25] = (1 + np.arange(chains) % 2)[:, None]  # none of them stands out
    edges = selectEdges(strength, zeros(strength), 0, dynamic=True)
    assert (edges[strength > 0] > 0).all() == kept
    assert edges.any() == kept


@pytest.mark.parametrize("density", [0.1, 0.25, 0.4])
def test_a_crease_counts_where_three_of_its_neighbours_are_creases(density):
    crease = 40 * (np.random.default_rng(1).random((40, 50)) < density).astype(np.float32)
    flat, ones = np.zeros_like(crease), np.full_like(crease, 9)
    kind = np.where(crease > 0, EDGE_CONVEX, 0).astype(np.uint8)
    found = selectEdges(EdgeStrength(flat, crease, kind, ones), None, 30, minLength=1, lineSignificance=0)
    around = cv2.filter2D((crease > 0).astype(np.float32), -1, np.ones((3, 3)), borderType=cv2.BORDER_CONSTANT) - 1
    assert np.array_equal(found > 0, (crease > 0) & (around >= 3))
