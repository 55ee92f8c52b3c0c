"""Scores of edges and regions: hand-checked tables, an independent scorer, properties, errors."""

import dataclasses
import importlib.util
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.ndimage import binary_dilation, distance_transform_edt

import rangeedge
from rangeedge.constants import EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP
from rangeedge.evaluation import (
    TRUTH_AMBIGUOUS,
    TRUTH_CONCAVE,
    TRUTH_CONVEX,
    TRUTH_IGNORED,
    TRUTH_JUMP,
    TRUTH_NODATA,
    EdgeScores,
    HooverScores,
    TypeScores,
    baddeleyDelta,
    evaluateEdges,
    hooverScores,
    prattFOM,
)

SHARED = Path(__file__).parents[1].parent / "shared"


def load(path):
    if not path.exists():
        pytest.skip(f"{path} is not there")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def score():
    """The independent scorer."""
    return load(SHARED / "eval" / "score.py")


@pytest.fixture(scope="module")
def frames():
    """Real frames with typed truth."""
    data = load(SHARED / "data" / "load.py")
    names = sorted(path.name for path in (SHARED / "data" / "mosd_faces").glob("*_edges.png"))
    return [data.mosd_faces(name.removesuffix("_edges.png")) for name in names[:2]]


def column(*cols, shape=(20, 30), value=1):
    image = np.zeros(shape, np.uint8)
    for col in cols:
        image[:, col] = value
    return image


def random_edges(rng, shape=(60, 80)):
    """Typed truth of random polygons and thick edges near it, some missing, some false."""
    truth = np.zeros(shape, np.uint8)
    for _ in range(6):
        a, b = (tuple(int(v) for v in rng.integers(0, shape[::-1])) for _ in range(2))
        cv2.line(truth, a, b, int(rng.choice([1, 1, 2, 2, 3, 3, 4, 5, 255])), int(rng.integers(1, 3)))
    edges = np.roll(np.isin(truth, (1, 2, 3)), rng.integers(-3, 4, 2), (0, 1))
    edges &= rng.random(shape) < 0.9
    edges |= binary_dilation(rng.random(shape) < 0.01)
    kind = rng.choice([0, EDGE_JUMP, EDGE_CONVEX, EDGE_CONCAVE, EDGE_JUMP | EDGE_CONVEX], shape).astype(np.uint8)
    return edges, truth, kind, rng.random(shape) < 0.02


def assert_same_counts(ours, theirs):
    assert (ours.true, ours.detected, ours.found, ours.target) == tuple(
        theirs[name] for name in ("true", "detected", "found", "target")
    )
    for name in ("jump", "convex", "concave"):
        of_type = getattr(ours, name)
        assert (of_type.found, of_type.target) == (theirs[f"found_{name}"], theirs[f"target_{name}"])
    assert ours.crease.kindRight == theirs.get("kind_right", 0)
    assert ours.crease.labelled == theirs.get("kind_all", 0)
    assert ours.jump.shiftSum + ours.crease.shiftSum == pytest.approx(theirs.get("shift", 0.0))


def class_of(kind):
    """The independent scorer's classes from the kind bits."""
    return np.where(kind & EDGE_CONVEX, 2, np.where(kind & EDGE_CONCAVE, 3, 0))


# Edges


@pytest.mark.parametrize("seed", range(30))
def test_edge_counts_equal_the_independent_scorer(score, seed):
    rng = np.random.default_rng(seed)
    edges, truth, kind, ignore = random_edges(rng)
    tolerance = [0.0, 1.0, 1.5, 5**0.5, 3.0, 4.2][seed % 6]
    ours = evaluateEdges(edges, truth, tolerance=tolerance, ignore=ignore, kind=kind)
    assert ours.detected > 0
    assert_same_counts(ours, score.edge_counts(edges, truth, ~ignore, tolerance, class_of(kind)))


def test_edge_counts_equal_the_independent_scorer_on_real_frames(score, frames):
    rng = np.random.default_rng(1)
    ours, theirs = [], []
    for frame in frames:
        valid = np.isfinite(frame["z"])
        blurred = cv2.GaussianBlur(np.where(valid, frame["z"], 0), None, 1.5)
        edges = cv2.dilate((np.abs(cv2.Laplacian(blurred, cv2.CV_32F)) > 0.002).astype(np.uint8), None)
        kind = rng.choice([EDGE_JUMP, EDGE_CONVEX, EDGE_CONCAVE], edges.shape).astype(np.uint8)
        ours.append(evaluateEdges(edges, frame["edges"], ignore=~valid, kind=kind))
        theirs.append(score.edge_counts(edges > 0, frame["edges"], valid, 3.0, class_of(kind)))
        assert_same_counts(ours[-1], theirs[-1])
    total, summary = sum(ours), score.edge_summary(theirs)
    assert total.frames == summary["frames"] == 2
    for name in ("precision", "recall", "f", "kind", "shift"):
        assert getattr(total, name) == pytest.approx(summary[name])
    for name in ("jump", "convex", "concave"):
        assert getattr(total, name).recall == pytest.approx(summary[name])


def test_perfect_map_scores_one():
    truth = column(5) + column(15, value=TRUTH_CONVEX) + column(25, value=TRUTH_CONCAVE)
    kind = np.choose(truth, [0, EDGE_JUMP, EDGE_CONVEX, EDGE_CONCAVE]).astype(np.uint8)
    scores = evaluateEdges(truth, truth, kind=kind)
    assert (scores.precision, scores.recall, scores.f, scores.kind, scores.shift) == (1, 1, 1, 1, 0)
    assert (scores.jump.kind, scores.convex.kind, scores.concave.kind) == (1, 1, 1)
    assert scores.target == scores.found == scores.true == scores.detected == 60


@pytest.mark.parametrize(("shift", "hit"), [(0, 1.0), (3, 1.0), (4, 0.0)])
def test_tolerance_is_inclusive(shift, hit):
    scores = evaluateEdges(column(10 + shift), column(10), tolerance=3)
    assert (scores.precision, scores.recall) == (hit, hit)
    assert scores.shift == (shift if hit else pytest.approx(math.nan, nan_ok=True))


def test_kind_follows_the_nearest_detected_pixel():
    truth = column(5, value=TRUTH_CONVEX) + column(20, value=TRUTH_CONCAVE)
    kind = column(6, 20, value=EDGE_CONVEX)
    scores = evaluateEdges(column(6, 20), truth, kind=kind)
    assert (scores.convex.kind, scores.concave.kind, scores.kind) == (1.0, 0.0, 0.5)


@pytest.mark.parametrize("ignored", [TRUTH_NODATA, TRUTH_AMBIGUOUS, TRUTH_IGNORED])
def test_what_is_near_ignored_pixels_does_not_count(ignored):
    truth = column(5)
    truth[:, 20:] = ignored
    lone = evaluateEdges(column(5, 25), truth)
    assert (lone.true, lone.detected, lone.target) == (20, 20, 20)
    truth[:, 7] = ignored
    near_both = evaluateEdges(column(5), truth)
    assert (near_both.true, near_both.detected, near_both.target) == (20, 20, 0)


def test_ignore_mask_equals_the_ignored_class():
    truth = column(5)
    mask = column(20, 21, 22)
    assert evaluateEdges(column(5, 21), truth, ignore=mask) == evaluateEdges(
        column(5, 21), np.where(mask, TRUTH_IGNORED, truth).astype(np.uint8)
    )


def test_thick_edges_are_thinned():
    scores = evaluateEdges(column(9, 10, 11), column(10), tolerance=1)
    assert scores.precision == 1
    assert scores.detected <= 20


def test_empty_maps():
    none = np.zeros((20, 30), np.uint8)
    nothing_found = evaluateEdges(none, column(5))
    assert (nothing_found.recall, nothing_found.detected, nothing_found.target) == (0, 0, 20)
    assert math.isnan(nothing_found.precision)
    assert math.isnan(nothing_found.f)
    nothing_there = evaluateEdges(column(5), none)
    assert (nothing_there.precision, nothing_there.target) == (0, 0)
    assert math.isnan(nothing_there.recall)
    neither = evaluateEdges(none, none, kind=none)
    assert neither == EdgeScores(frames=1)
    all_ignored = evaluateEdges(column(5), column(5), ignore=none == 0)
    assert (all_ignored.target, all_ignored.true) == (0, 20)  # near truth counts as true, as in the independent scorer


def test_strength_errors_per_type():
    truth = column(5, value=TRUTH_JUMP) + column(15, value=TRUTH_CONVEX) + column(25, value=TRUTH_CONCAVE)
    edges = column(6, 15, 25)
    crease = (column(15, value=40) + column(25, value=30)).astype(np.float32)
    crease[:10, 15] = np.nan
    jump = column(6).astype(np.float32) * 0.5
    scores = evaluateEdges(
        edges,
        truth,
        crease=crease,
        creaseTruth=np.full(truth.shape, 36.0),
        jump=jump,
        jumpTruth=column(5).astype(np.float64),
    )
    assert (scores.convex.strengthError, scores.convex.measured) == (4.0, 10)
    assert (scores.concave.strengthError, scores.jump.strengthError) == (6.0, 0.5)
    assert scores.crease.strengthError == pytest.approx((4 * 10 + 6 * 20) / 30)


@pytest.mark.parametrize("flip", [np.flipud, np.fliplr])
def test_distance_measures_do_not_depend_on_the_side(flip):
    rng = np.random.default_rng(5)
    edges, truth, _, _ = random_edges(rng)
    truth = np.isin(truth, (1, 2, 3))
    assert prattFOM(flip(edges), flip(truth)) == pytest.approx(prattFOM(edges, truth))
    assert baddeleyDelta(flip(edges), flip(truth)) == pytest.approx(baddeleyDelta(edges, truth))


def test_scores_add_up():
    part = evaluateEdges(column(5), column(6))
    total = sum([part, part, part])
    assert total == part + part + part
    assert (total.frames, total.detected, total.jump.target) == (3, 60, 60)
    assert total.shift == part.shift == 1
    assert "precision 1.000" in str(total)
    with pytest.raises(TypeError):
        part + HooverScores()
    with pytest.raises(TypeError):
        part + 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        part.frames = 7
    assert TypeScores(target=4, found=3) + TypeScores(target=1) == TypeScores(target=5, found=3)


def test_inputs_stay_and_need_not_be_contiguous():
    rng = np.random.default_rng(3)
    edges, truth, kind, ignore = random_edges(rng)
    copies = [a.copy() for a in (edges, truth, kind, ignore)]
    plain = evaluateEdges(edges, truth, kind=kind, ignore=ignore)
    for before, after in zip(copies, (edges, truth, kind, ignore), strict=True):
        np.testing.assert_array_equal(before, after)
    strided = [np.repeat(a, 2, axis=1)[:, ::2] for a in copies]
    assert plain == evaluateEdges(strided[0], strided[1], kind=strided[2], ignore=strided[3])
    assert plain == evaluateEdges(edges * np.uint8(7), truth, kind=kind, ignore=ignore * np.uint8(9))


# Pratt and Baddeley


def test_pratt_by_hand():
    truth = column(5)
    assert prattFOM(truth, truth) == 1
    assert prattFOM(column(8), truth) == pytest.approx(1 / (1 + 9 / 9))
    assert prattFOM(column(8), truth, alpha=1) == pytest.approx(1 / 10)
    assert prattFOM(column(5, 8), truth) == pytest.approx((1 + 0.5) / 2)
    assert prattFOM(truth, column(5, 8)) == pytest.approx(0.5)
    none = np.zeros_like(truth)
    assert (prattFOM(none, none), prattFOM(none, truth), prattFOM(truth, none)) == (1, 0, 0)


def test_baddeley_by_hand():
    none = np.zeros((3, 4), bool)
    corner = none.copy()
    corner[0, 0] = True
    y, x = np.ogrid[:3, :4]
    d = np.minimum(np.hypot(y, x), 2)
    assert baddeleyDelta(corner, none, cutoff=2) == pytest.approx(np.sqrt(((2 - d) ** 2).mean()))
    assert baddeleyDelta(corner, none, k=1, cutoff=2) == pytest.approx((2 - d).mean())
    assert baddeleyDelta(corner, none) == pytest.approx(0.5 / np.sqrt(12))  # a tenth of the diagonal: 5 / 10
    assert baddeleyDelta(none, none) == baddeleyDelta(corner, corner) == 0


@pytest.mark.parametrize("seed", range(5))
def test_pratt_and_baddeley_equal_their_definitions(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.random((2, 40, 50)) < 0.02
    to_a, to_b = distance_transform_edt(~a), distance_transform_edt(~b)
    assert prattFOM(a, b) == pytest.approx((1 / (1 + to_b[a] ** 2 / 9)).sum() / max(a.sum(), b.sum()))
    expected = (np.abs(np.minimum(to_a, 5) - np.minimum(to_b, 5)) ** 3).mean() ** (1 / 3)
    assert baddeleyDelta(a, b, k=3, cutoff=5) == pytest.approx(expected)
    assert baddeleyDelta(a, b) == baddeleyDelta(b, a)


# Regions


def random_regions(rng, shape=(40, 50)):
    """True regions, and what a segmentation does to them: splits, merges, loses, invents."""
    cells = np.add.outer(np.searchsorted(np.sort(rng.integers(0, 40, 4)), np.arange(40)) * 7, np.zeros(50, int))
    truth = cells + np.searchsorted(np.sort(rng.integers(0, 50, 4)), np.arange(50)) - 3
    labels = truth * 3
    for _ in range(rng.integers(1, 6)):
        one, other = rng.choice(np.unique(labels), 2)
        match rng.integers(4):
            case 0:
                labels[labels == one] = other
            case 1:
                labels[(labels == one) & (np.arange(50) % 50 > rng.integers(50))] = labels.max() + 11
            case 2:
                labels[labels == one] = -rng.integers(2)
            case 3:
                labels[rng.random(shape) < 0.15] = rng.integers(0, 4)
    return labels, truth


@pytest.mark.parametrize("seed", range(60))
def test_region_counts_equal_the_independent_scorer(score, seed):
    rng = np.random.default_rng(seed)
    labels, truth = random_regions(rng)
    ignore = rng.random(truth.shape) < 0.1 if seed % 2 else None
    T = [0.51, 0.6, 0.7, 0.8, 0.95, 1.0][seed % 6]
    ours = dataclasses.asdict(hooverScores(labels, truth, T=T, ignore=ignore))
    assert ours.pop("frames") == 1
    assert ours == score.hoover(labels, truth, T, ignore)


def test_random_regions_meet_every_case():
    total = sum(hooverScores(*random_regions(np.random.default_rng(seed)), T=0.7) for seed in range(60))
    assert min(dataclasses.astuple(total)) > 0


def test_region_counts_equal_the_independent_scorer_on_real_frames(score, frames):
    for frame in frames:
        ignore = ~np.isfinite(frame["z"]) | (frame["label"] == 0)
        edges = np.isin(frame["edges"], (1, 2, 3)) | ignore
        edges |= np.random.default_rng(0).random(edges.shape) < 0.1
        labels = cv2.connectedComponents((~edges).astype(np.uint8), connectivity=4)[1]
        ours = dataclasses.asdict(hooverScores(labels, frame["label"], ignore=ignore))
        ours.pop("frames")
        assert ours == score.hoover(labels, frame["label"], ignore=ignore)
        assert ours["correct"] > 0


TRUE = np.repeat([[1, 1, 1, 1, 1, 2, 2, 2, 2, 2]], 4, axis=0)


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        ([1, 1, 1, 1, 1, 2, 2, 2, 2, 2], dict(correct=2)),
        ([9, 9, 9, 9, 9, -4, -4, -4, -4, -4], dict(correct=1, missed=1, found=1)),
        ([1, 1, 1, 1, 0, 0, 2, 2, 2, 2], dict(correct=2)),  # exactly T of the true region
        ([1, 1, 1, 0, 0, 0, 2, 2, 2, 2], dict(correct=1, missed=1, noise=1)),
        ([1, 1, 3, 3, 3, 2, 2, 2, 2, 2], dict(correct=1, over=1, found=3)),
        ([1, 1, 1, 1, 1, 1, 1, 1, 1, 1], dict(under=1, found=1)),
        ([0, 0, 0, 0, 0, 0, 0, 0, 0, 0], dict(missed=2, found=0)),
        ([0, 0, 0, 5, 5, 5, 5, 0, 0, 0], dict(missed=2, noise=1, found=1)),
    ],
)
def test_regions_by_hand(labels, expected):
    scores = hooverScores(np.repeat([labels], 4, axis=0), TRUE)
    full = dict(frames=1, truth=2, found=2, correct=0, over=0, under=0, missed=0, noise=0) | expected
    assert dataclasses.asdict(scores) == full


def test_of_two_roles_with_one_measure_a_region_has_the_first():
    # Correct with the mean of 27 / 48 and 1, over-segmented with that of 30 / 48 and 30 / 32.
    truth = np.repeat([1, 0], [48, 2])[None]
    labels = np.repeat([1, 0, 2], [27, 18, 5])[None]
    scores = hooverScores(labels, truth, T=0.55)
    assert (scores.correct, scores.over, scores.noise) == (1, 0, 1)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.int32, np.int64, np.uint16])
def test_numbering_and_type_of_labels_do_not_matter(dtype):
    labels, truth = random_regions(np.random.default_rng(4))
    plain = hooverScores(labels, truth)
    renumbered = np.unique(np.maximum(truth, 0), return_inverse=True)[1].reshape(truth.shape) * 5
    found = np.unique(np.maximum(labels, 0), return_inverse=True)[1].reshape(truth.shape) * 2
    assert plain == hooverScores(found.astype(dtype), renumbered.astype(dtype))
    assert plain == hooverScores(labels.T, truth.T)


def test_all_ignored_leaves_nothing():
    assert hooverScores(TRUE, TRUE, ignore=np.ones(TRUE.shape, bool)) == HooverScores(frames=1)


def test_region_scores_add_up_and_divide_by_frames():
    one, two = hooverScores(TRUE, TRUE), hooverScores(np.ones_like(TRUE), TRUE)
    total = sum([one, two])
    assert total.frames == 2
    assert total.perFrame == dict(truth=2, found=1.5, correct=1, over=0, under=0.5, missed=0, noise=0)
    assert total.correctRate == 0.5
    assert str(total).startswith("truth 2.00, found 1.50, correct 1.00")
    assert math.isnan(HooverScores().correctRate)


# Bad arguments

IMAGE = np.zeros((4, 5), np.uint8)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: evaluateEdges(IMAGE[:3], IMAGE), "edges"),
        (lambda: evaluateEdges(IMAGE.astype(int), IMAGE), "edges"),
        (lambda: evaluateEdges(IMAGE, IMAGE.astype(np.int32)), "truth"),
        (lambda: evaluateEdges(IMAGE, IMAGE + np.uint8(6)), "truth"),
        (lambda: evaluateEdges(IMAGE, IMAGE[None]), "truth"),
        (lambda: evaluateEdges(IMAGE, IMAGE[:0]), "truth"),
        (lambda: evaluateEdges(IMAGE, IMAGE, tolerance=-1), "tolerance"),
        (lambda: evaluateEdges(IMAGE, IMAGE, tolerance=np.nan), "tolerance"),
        (lambda: evaluateEdges(IMAGE, IMAGE, ignore=IMAGE.T), "ignore"),
        (lambda: evaluateEdges(IMAGE, IMAGE, kind=IMAGE.astype(float)), "kind"),
        (lambda: evaluateEdges(IMAGE, IMAGE, crease=IMAGE), "creaseTruth"),
        (lambda: evaluateEdges(IMAGE, IMAGE, jumpTruth=IMAGE), "jump"),
        (lambda: evaluateEdges(IMAGE, IMAGE, jump=IMAGE, jumpTruth=IMAGE.T), "jumpTruth"),
        (lambda: prattFOM(None, IMAGE), "edges"),
        (lambda: prattFOM(IMAGE, IMAGE, alpha=0), "alpha"),
        (lambda: baddeleyDelta(IMAGE, [[0]]), "truth"),
        (lambda: baddeleyDelta(IMAGE, IMAGE, k=0.5), "k"),
        (lambda: baddeleyDelta(IMAGE, IMAGE, cutoff=0), "cutoff"),
        (lambda: hooverScores(TRUE[:2], TRUE), "labels"),
        (lambda: hooverScores(TRUE.astype(float), TRUE), "labels"),
        (lambda: hooverScores(TRUE, TRUE > 1), "truth"),
        (lambda: hooverScores(TRUE, TRUE, T=0.5), "T"),
        (lambda: hooverScores(TRUE, TRUE, T=1.1), "T"),
        (lambda: hooverScores(TRUE, TRUE, ignore=IMAGE), "ignore"),
    ],
)
def test_bad_arguments_are_named(call, argument):
    with pytest.raises(rangeedge.error, match=f"`{argument}`"):
        call()


def hoover_by_definition(labels, truth, T):
    """Counts of correct, over, under, missed and noise from the table of all pairs, as Hoover et al. define them."""
    table = np.array([[np.sum((labels == m) & (truth == n)) for n in range(1, truth.max() + 1)]
                      for m in range(1, labels.max() + 1)])  # fmt: skip
    found = np.array([np.sum(labels == m) for m in range(1, labels.max() + 1)])
    true = np.array([np.sum(truth == n) for n in range(1, truth.max() + 1)])
    of_found, of_true = {m: ("", -1.0) for m in range(len(found))}, {n: ("", -1.0) for n in range(len(true))}
    for m, n in np.ndindex(table.shape):
        if table[m, n] >= T * true[n] and table[m, n] >= T * found[m]:
            of_found[m] = of_true[n] = "correct", (table[m, n] / true[n] + table[m, n] / found[m]) / 2
    for n in range(len(true)):
        parts = [m for m in range(len(found)) if table[m, n] >= T * found[m]]
        covered = table[parts, n].sum()
        measure = (covered / true[n] + covered / found[parts].sum()) / 2 if parts else 0
        if len(parts) > 1 and covered >= T * true[n] and measure > of_true[n][1]:
            of_true[n] = "over", measure
            of_found |= {m: ("over", measure) for m in parts}
    for m in range(len(found)):
        parts = [n for n in range(len(true)) if table[m, n] >= T * true[n]]
        covered = table[m, parts].sum()
        measure = (covered / true[parts].sum() + covered / found[m]) / 2 if parts else 0
        if len(parts) > 1 and covered >= T * found[m] and measure > of_found[m][1]:
            of_found[m] = "under", measure
            of_true |= {n: ("under", measure) for n in parts}
    roles_found, roles_true = [role for role, _ in of_found.values()], [role for role, _ in of_true.values()]
    return [roles_true.count("correct"), roles_true.count("over"), roles_found.count("under"),
            roles_true.count(""), roles_found.count("")]  # fmt: skip


@pytest.mark.parametrize("seed", range(40))
def test_hoover_scores_are_those_of_the_definition(seed):
    rng = np.random.default_rng(seed)
    v, u = np.indices((24, 30))

    def blocks():
        sizes = rng.choice([3, 4, 6, 8, 12, 24], 2)
        image = u // sizes[0] + 10 * (v // sizes[1]) + 1
        image[rng.random(image.shape) < 0.05] = 0
        return np.unique(image, return_inverse=True)[1].reshape(image.shape).astype(np.int32)

    labels, truth = blocks(), blocks()
    for T in (0.51, 0.75, 0.9):
        scores = hooverScores(labels, truth, T=T)
        counts = [scores.correct, scores.over, scores.under, scores.missed, scores.noise]
        assert counts == hoover_by_definition(labels, truth, T)


def test_two_parts_of_half_a_region_are_no_oversegmentation():
    truth, labels = np.ones((10, 20), np.int32), np.zeros((10, 20), np.int32)
    labels[:, :5], labels[:, 5:10] = 1, 2
    scores = hooverScores(labels, truth)
    assert (scores.over, scores.missed, scores.noise) == (0, 1, 2)
    labels[:, 10:18] = 3
    assert hooverScores(labels, truth).over == 1
