"""Arguments and surroundings that nobody means: all that comes of them is `rangeedge.error`."""

import contextlib
import os
import subprocess
import sys
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import _check, _core, optimality, synthetic
from rangeedge.batch import detectBatch
from rangeedge.frame import read_frame
from rangeedge.options import ScanLineParams

ROOT = Path(rangeedge.__file__).parents[1]
HUGE = 10**400  # beyond double precision
HUGER = 10**5000  # beyond what Python prints
DEPTH = np.where(np.arange(60) < 30, 1.0, 2.0) * np.ones((40, 1))


class Unspeakable:
    def __repr__(self):
        raise KeyError("no")


class NoPath(os.PathLike):
    def __fspath__(self):
        return 5


@pytest.mark.parametrize(
    "value", [HUGE, -HUGE, HUGER, Unspeakable(), float("nan"), 1j, "1", True], ids=lambda value: type(value).__name__
)
@pytest.mark.parametrize(
    "name", ["eps", "noise", "depthFactor", "pixelSize", "K", "maxShift", "directions", "minLength"]
)
def test_options_that_are_no_numbers(name, value):
    with pytest.raises(rangeedge.error, match=f"`{name}` must be"):
        rangeedge.detectEdges(DEPTH, **{name: value})


@pytest.mark.parametrize(
    "call",
    [
        lambda: rangeedge.edgeStrength(DEPTH, K=(HUGE, 1, 1, 1)),
        lambda: rangeedge.edgeStrength(DEPTH, K=(1, 1, 1, 1), distCoeffs=[HUGE] * 4),
        lambda: rangeedge.edgeStrength(DEPTH, origin=(HUGE, 0, 0)),
        lambda: rangeedge.strengthImage(DEPTH, HUGE),
        lambda: rangeedge.selectEdges(DEPTH, DEPTH, HUGE, 1.0),
        lambda: rangeedge.selectEdges(None),
        lambda: rangeedge.selectEdges(strength=DEPTH, jumpThreshold=1.0),
        lambda: rangeedge.NoiseModel(HUGE, 0, 0),
        lambda: synthetic.orthographicCamera((1, 1), (9, 9), DEPTH),
        lambda: rangeedge.splitScanLine(DEPTH[0], 1, [[1], [2, 3]]),
        lambda: rangeedge.splitScanLine(DEPTH[0], 1, Unspeakable()),
        lambda: rangeedge.imreadRange(NoPath()),
        lambda: rangeedge.imreadRange(b"x.png"),
        lambda: rangeedge.imreadRange("\ud800.png"),
        lambda: rangeedge.imreadRange("\0.png"),
        lambda: rangeedge.imwriteRange("\ud800.tiff", DEPTH),
        lambda: rangeedge.writeLines("\ud800.csv", rangeedge.linkEdges(DEPTH)),
        lambda: rangeedge.writeLines(b"x.csv", rangeedge.linkEdges(DEPTH)),
        lambda: list(detectBatch([NoPath()], "out")),
        lambda: list(detectBatch(["x"], NoPath())),
    ],
)
def test_odd_values(call):
    with pytest.raises(rangeedge.error):
        call()


def test_errors_whose_squares_are_beyond_double_precision():
    statistics = optimality.errorStatistics(np.full(3, 1e300))
    assert (statistics.mean, statistics.largest, statistics.over) == (1e300, 1e300, 1.0)


COMPLEX = np.array([1 + 2j] * 6)


@pytest.mark.parametrize("values", [COMPLEX, COMPLEX.real.astype("m8[s]"), COMPLEX.real.astype(str), np.ma.ones(6)])
def test_numbers_that_are_not_real(values):
    for call in (
        lambda: rangeedge.edgeStrength(DEPTH, K=values[:4]),
        lambda: rangeedge.edgeStrength(DEPTH, K=(1, 1, 1, 1), distCoeffs=values[:4]),
        lambda: rangeedge.writeLines("x.geojson", rangeedge.linkEdges(DEPTH), values),
        lambda: rangeedge.sweepToPoints(DEPTH[:6, :6], values, np.arange(6.0)),
        lambda: synthetic.sphere(values[:3], 1),
    ):
        with pytest.raises(rangeedge.error, match="must be"):
            call()


def test_planes_that_are_parallel_have_no_edge():
    flat = np.array([[0.0, 0, 1]])
    assert np.isnan(optimality.measureDetector(flat, flat, 90.0, size=20, seed=7)).all()


def test_infinite_values_that_are_invalid_may_be_beyond_double_precision():
    same = rangeedge.detectEdges(DEPTH, invalid=(HUGE, (-HUGE, -1)))
    assert np.array_equal(same, rangeedge.detectEdges(DEPTH))


@pytest.mark.parametrize("text", ["caf\udce9.png", "\ud800\0\n\U0001f600", "\0", ""])
def test_titles_of_any_characters(text):
    strength, thin = rangeedge.edgeStrength(DEPTH), rangeedge.detectEdges(DEPTH)
    plain = rangeedge.drawOverview(DEPTH, strength, thin, title="x")
    assert rangeedge.drawOverview(DEPTH, strength, thin, title=text).shape == plain.shape


@pytest.mark.parametrize("name", ["a\udcff", "a\0b", "<a>", "1", "a:b", "a\nb", 5])
def test_nodes_of_names_that_no_storage_can_hold(name):
    fs = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    with pytest.raises(rangeedge.error, match="`name` must be letters"):
        rangeedge.createScanLineDetector().write(fs, name)


@pytest.mark.parametrize("separation", [1e-60, 1e-45, 1e-38, 0.5, 0.99])
@pytest.mark.parametrize("least", [1e-60, 1e-45, 1.0, 1e38, 1e300])
def test_seeds_of_parameters_that_vanish_in_single_precision(separation, least):
    far = rangeedge.distanceTransform(np.zeros((40, 60), np.uint8))
    count, markers = rangeedge.extractSeeds(far, separation=separation, minDistance=least)
    assert count == 2  # with the background
    assert (markers == 1).all()


@pytest.mark.parametrize("method", [rangeedge.SALIENCE_MULTIPLICATIVE, rangeedge.SALIENCE_ADDITIVE])
def test_saliences_that_change_meanwhile(method):
    """Whatever comes of it, it comes."""
    rng = np.random.default_rng(0)
    salience = rng.random((200, 300)).astype(np.float32)
    stop = threading.Event()

    def write():
        while not stop.is_set():
            salience[rng.integers(0, 200, 500), rng.integers(0, 300, 500)] = [np.nan, 0.5, 0][int(rng.integers(3))]

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(60):
            try:
                rangeedge.salienceDistanceTransform(salience, method)
            except rangeedge.error:
                salience[:] = 0.5
    finally:
        stop.set()
        writer.join()


V, U = np.mgrid[:200, :300]
BLOCKS = 1 + U // 30 + 10 * (V // 20)
CHANGING = {
    "labels": (BLOCKS.astype(np.int32), lambda labels: rangeedge.regionBoundaries(labels)),
    "distance": (np.hypot(U % 30 - 15, V % 20 - 10).astype(np.float32), lambda d: rangeedge.extractSeedsWithStats(d)),
    "mask": (np.ones(U.shape, np.uint8), lambda mask: rangeedge.extractSeeds(np.hypot(U % 30, V % 20), mask=mask)),
}


@pytest.mark.parametrize("name", CHANGING)
def test_images_that_change_meanwhile(name):
    """What a kernel reads twice, and uses as an index, is a copy."""
    original, call = CHANGING[name]
    image, rng, stop = original.copy(), np.random.default_rng(0), threading.Event()

    def write():
        extreme = np.iinfo(image.dtype).max if image.dtype == np.int32 else 1e9 if image.dtype == np.float32 else 0
        while not stop.is_set():
            where = rng.integers(0, image.size, 2000)
            image.flat[where] = extreme if rng.random() < 0.5 else 0
            image.flat[where] = original.flat[where]

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(40):
            with contextlib.suppress(rangeedge.error):
                call(image)
    finally:
        stop.set()
        writer.join()


def unaligned(values):
    raw = np.empty(values.nbytes + 1, np.uint8)[1:]
    raw[:] = np.ascontiguousarray(values).view(np.uint8).ravel()
    result = raw.view(values.dtype).reshape(values.shape)
    assert not result.flags.aligned
    return result


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint16])
def test_unaligned_arrays_give_what_aligned_ones_do(dtype):
    z = (DEPTH * 1000).astype(dtype)
    for function in (rangeedge.detectEdges, rangeedge.segmentRegions, rangeedge.estimateNoise):
        assert np.array_equal(function(z), function(unaligned(z)))
    x = np.linspace(0, 1, z.size, dtype=np.float32).reshape(z.shape)
    assert np.array_equal(rangeedge.salienceDistanceTransform(x), rangeedge.salienceDistanceTransform(unaligned(x)))
    labels = rangeedge.segmentRegions(z)
    assert np.array_equal(rangeedge.growRegions(z, labels), rangeedge.growRegions(unaligned(z), unaligned(labels)))


@pytest.mark.parametrize("offset", [1e4, 5e5, 5e6])
@pytest.mark.parametrize("points", [False, True])
def test_steps_of_a_centimetre_on_heights_far_above_zero(offset, points):
    v, u = np.mgrid[:120, :160]
    relief = np.where(u < 80, 0, 0.01) + np.random.default_rng(0).normal(0, 0.0005, u.shape)
    source = np.dstack([u * 0.1, v * 0.1, relief + offset]) if points else relief + offset
    for options in ({"noise": 0.0005}, {}):
        labels = rangeedge.segmentRegions(source, heightMap=True, **options)
        assert labels.max() == 2
        assert np.count_nonzero(rangeedge.detectEdges(source, heightMap=True, **options)[10:110, 78:82]) >= 100


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device")
@pytest.mark.parametrize("command", ["detect", "segment", "lines", "batch"])
def test_commands_whose_output_has_no_room(command, tmp_path):
    cv2.imwrite(str(tmp_path / "x.png"), (DEPTH * 1000).astype(np.uint16))
    with open("/dev/full", "w") as full:
        run = subprocess.run(
            [sys.executable, "-m", "rangeedge", command, "x.png", "-K", "50,50,30,20", "--out", "out"],
            stdout=full, stderr=subprocess.PIPE, cwd=tmp_path, text=True, check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
    assert run.returncode == 1
    assert run.stderr.startswith("rangeedge: error: cannot write")
    assert len(run.stderr.splitlines()) == 1
    assert (tmp_path / "out").exists()


@pytest.mark.parametrize("shape", [(1, 2), (3, 5), (24, 33), (64, 80)])
@pytest.mark.parametrize("decades", [0, 300])
def test_points_in_no_order_at_all(shape, decades):
    rng = np.random.default_rng(shape[0])
    points = rng.normal(size=(*shape, 3)) * 10.0 ** rng.integers(-decades, decades + 1, (*shape, 3))
    for function in (rangeedge.detectEdges, rangeedge.segmentRegions):
        with contextlib.suppress(rangeedge.error):
            assert function(points).shape == shape


@pytest.mark.skipif(not hasattr(os, "O_TMPFILE"), reason="there are no files without a name")
@pytest.mark.parametrize("existing", [False, True])
def test_a_program_killed_while_it_writes_leaves_nothing(existing, tmp_path, monkeypatch):
    """Whatever is written up to then has no name yet."""
    from rangeedge.app import results
    from rangeedge.io import atomic

    seen = []

    def look(folder, data):
        file = atomic.nameless(folder, data)
        seen.append(sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")))
        return file

    if existing:
        results.write_folder(tmp_path / "out", {"old.txt": b"old"})
    before = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*"))
    monkeypatch.setattr(results, "nameless", look)
    results.write_folder(tmp_path / "out", {"a.txt": b"a" * 10**6, "report.json": b"{}"})
    assert seen == [before, before]
    assert (tmp_path / "out/a.txt").read_bytes() == b"a" * 10**6
    assert not [path for path in tmp_path.rglob("*") if path.suffix == ".tmp"]


def test_labels_that_no_table_has_room_for():
    labels = np.where(DEPTH > 1.5, 2**30, 1).astype(np.int32)
    for call in (lambda: rangeedge.regionAdjacency(DEPTH, labels), lambda: rangeedge.drawRegions(labels)):
        with pytest.raises(rangeedge.error, match="labels of up to 65535"):
            call()


@pytest.mark.parametrize("dtype", [np.float64, np.int32, np.uint8])
def test_a_destination_of_another_type_is_left_alone(dtype):
    dst = np.full(DEPTH.shape, 7, dtype)
    found = rangeedge.distanceTransform(DEPTH > 1.5, dst=dst)
    assert found is not dst
    assert found.dtype == np.float32
    assert (dst == 7).all()


@pytest.mark.parametrize(("check", "dtype"), [(_check.labels32s, np.int32), (_check.image32f, np.float32)])
def test_kernels_get_aligned_arrays(check, dtype):
    values = np.arange(12, dtype=dtype).reshape(3, 4)
    assert not unaligned(values).flags.aligned
    given = check("values", unaligned(values))
    assert given.flags.aligned
    assert np.array_equal(given, values)


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.float16, np.float32, np.float64])
@pytest.mark.parametrize("options", [{}, {"heightMap": True}, {"K": (100, 100, 30, 20)}])
def test_kernels_get_aligned_frames(monkeypatch, options, dtype):
    given = []
    invert = _core.invert_depth
    monkeypatch.setattr(_core, "invert_depth", lambda depth, *rest: (given.append(depth), invert(depth, *rest)))
    frame = read_frame(unaligned(DEPTH.astype(dtype)), ScanLineParams(**options))
    assert len(given) == ("K" in options)
    assert all(image.flags.aligned for image in [frame.samples, *given])


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_a_map_of_noise_may_lie_in_memory_as_it_likes(dtype):
    noise = (0.01 + 0.001 * np.arange(DEPTH.size).reshape(DEPTH.shape)).astype(dtype)
    expected = rangeedge.edgeStrength(DEPTH, noise=noise)
    for other in (np.asfortranarray(noise), np.repeat(noise, 2, axis=1)[:, ::2], unaligned(noise)):
        for one, same in zip(rangeedge.edgeStrength(DEPTH, noise=other), expected, strict=True):
            assert np.array_equal(one, same)


def test_images_of_more_pixels_than_kernels_count(monkeypatch):
    huge = np.broadcast_to(np.float32(1), (2**15, 2**14))
    for call in (rangeedge.detectEdges, rangeedge.estimateNoise, rangeedge.extractSeeds):
        with pytest.raises(rangeedge.error, match=r"fewer than 2\^29 pixels"):
            call(huge)
    with_margin = (DEPTH.shape[0] + 2) * (DEPTH.shape[1] + 2)
    monkeypatch.setattr(_check, "PIXEL_LIMIT", with_margin + 1)
    rangeedge.detectEdges(DEPTH)
    monkeypatch.setattr(_check, "PIXEL_LIMIT", with_margin)
    with pytest.raises(rangeedge.error, match="runBlocks"):
        rangeedge.detectEdges(DEPTH)


@pytest.mark.parametrize("text", ["x\udcff", "\0", "\ud800" * 50, "caf\xe9"])
def test_titles_of_any_text(text):
    black = np.zeros((20, 30), np.uint8)
    assert rangeedge.drawPanels([(text, black), ("b", black)]).dtype == np.uint8


def test_no_more_columns_than_panels():
    panels = [("a", np.zeros((20, 30), np.uint8))] * 3
    assert np.array_equal(rangeedge.drawPanels(panels, 2**31 - 1), rangeedge.drawPanels(panels, 3))


@pytest.mark.parametrize("value", [np.ones((2, 2)), 1, "yes", None])
def test_pictures_take_true_or_false(value):
    segments = rangeedge.fitSegments(rangeedge.linkEdges(DEPTH))
    with pytest.raises(rangeedge.error, match="`key` must be True or False"):
        rangeedge.drawPanels([("a", np.zeros((20, 30), np.uint8))], key=value)
    with pytest.raises(rangeedge.error, match="`lengths` must be True or False"):
        rangeedge.drawSegments(DEPTH, *segments, lengths=value)
