"""One image in blocks: what is exact, what is close, and how it goes on."""

import json

import numpy as np
import pytest

from rangeedge import (
    detectEdges,
    detectEdgesWithStrength,
    distanceTransform,
    error,
    imreadRange,
    imwriteRange,
    overallStrength,
    salienceDistanceTransform,
    segmentRegions,
)
from rangeedge.app.cli import main
from rangeedge.batch import runBlocks
from rangeedge.io.tiff import images_of_tiff, read_page, read_window
from rangeedge.recording.blocks import Grid, clearance, inside, joined, matches
from rangeedge.recording.large import open_large

OPTIONS = {"heightMap": True, "pixelSize": 0.5, "noise": 0.02}


def terrain(rows=260, cols=330):
    """Slopes with houses on them, in metres, without data in a corner."""
    y, x = np.indices((rows, cols), dtype=np.float32)
    heights = 0.05 * y + 3 * np.sin(x / 60) + np.random.default_rng(0).normal(0, 0.02, (rows, cols))
    for top, left, height in ((20, 30, 4), (90, 100, 6), (110, 220, 5), (190, 40, 3), (200, 250, 7)):
        heights[top : top + 40, left : left + 50] += height
    heights[:15, :20] = np.nan
    return heights.astype(np.float32)


class TestGrid:
    def test_every_pixel_is_in_one_block(self):
        grid = Grid((23, 31), 8)
        seen = np.zeros(grid.shape, int)
        for index in range(len(grid)):
            top, left, bottom, right = grid.window(index)
            seen[top:bottom, left:right] += 1
            above, before, below, behind = grid.window(index, 5)
            assert (above, before) == (max(0, top - 5), max(0, left - 5))
            assert (below, behind) == (min(23, bottom + 5), min(31, right + 5))
        assert (seen == 1).all()
        assert grid.counts == (3, 4)

    def test_strips_beyond_a_block_are_of_the_blocks_beside_and_below(self):
        grid = Grid((23, 31), 8)
        for index in range(len(grid)):
            for other, strip in grid.beyond(index, 3):
                top, left, bottom, right = grid.window(other)
                assert top <= strip[0] < strip[2] <= bottom
                assert left <= strip[1] < strip[3] <= right

    def test_clearance_is_the_distance_to_the_nearest_unseen_pixel(self):
        grid = Grid((23, 31), 8)
        for index in range(len(grid)):
            window, around = grid.window(index), grid.window(index, 3)
            unseen = np.ones(grid.shape, bool)
            unseen[around[0] : around[2], around[1] : around[3]] = False
            found = np.broadcast_to(clearance(window, around, grid.shape), inside(unseen, window, (0, 0)).shape)
            assert np.array_equal(found, inside(distanceTransform(unseen), window, (0, 0)))

    def test_strips_beyond_the_seams(self):
        assert list(Grid((20, 20), 8).beyond(0, 5)) == [(1, (0, 8, 8, 13)), (3, (8, 0, 13, 8))]
        assert list(Grid((20, 20), 8).beyond(1, 5)) == [(2, (0, 16, 8, 20)), (4, (8, 8, 13, 16))]
        assert list(Grid((20, 20), 8).beyond(8, 5)) == []


class TestLabels:
    def test_matches(self):
        ones = np.array([[1, 1, 2, 2, 0, 3]])
        others = np.array([[5, 5, 5, 6, 6, 0]])
        assert matches(ones, others) == [(1, 5), (2, 5), (2, 6)]
        assert matches(ones, np.zeros_like(ones)) == []

    def test_joined(self):
        assert joined(5, [(1, 4), (4, 5)]).tolist() == [0, 1, 2, 3, 1, 1]
        assert joined(3, []).tolist() == [0, 1, 2, 3]
        assert joined(0, []).tolist() == [0]


@pytest.fixture(params=["npy", "tiff", "tiles"])
def path(request, tmp_path):
    heights = terrain()
    if request.param == "npy":
        np.save(tmp_path / "a.npy", heights)
        return tmp_path / "a.npy"
    tifffile = pytest.importorskip("tifffile")
    more = (
        {"tile": (64, 48), "compression": "zlib", "predictor": True}
        if request.param == "tiles"
        else {"rowsperstrip": 7}
    )
    tifffile.imwrite(tmp_path / "a.tif", heights, **more)
    return tmp_path / "a.tif"


class TestWindows:
    @pytest.mark.parametrize("window", [(0, 0, 260, 330), (3, 5, 4, 6), (60, 40, 130, 100), (250, 300, 260, 330)])
    def test_are_parts_of_the_whole(self, path, window):
        top, left, bottom, right = window
        image = open_large(str(path))
        assert image.shape == (260, 330)
        assert image.dtype == np.float32
        if path.suffix == ".tif":
            (page,) = images_of_tiff(path.read_bytes(), 9)
            assert np.array_equal(read_page(page).src, terrain(), equal_nan=True)
            assert np.array_equal(read_window(page, window).src, terrain()[top:bottom, left:right], equal_nan=True)

    def test_elevations_know_their_pixels(self, tmp_path):
        tifffile = pytest.importorskip("tifffile")
        heights = terrain()
        heights[40, 50] = -9999
        tags = [(33550, 12, 3, (0.5, 0.5, 0.0)), (33922, 12, 6, (0, 0, 0, 1000.0, 2000.0, 0)), (42113, 2, 6, "-9999")]
        tifffile.imwrite(tmp_path / "a.tif", heights, extratags=[(*tag, True) for tag in tags])
        image = open_large(str(tmp_path / "a.tif"))
        assert image.geometry == {"pixelSize": (0.5, 0.5), "heightMap": True}
        assert image.georeference[:, 2].tolist() == [1000.25, 1999.75]
        (page,) = images_of_tiff((tmp_path / "a.tif").read_bytes(), 9)
        assert np.isnan(read_window(page, (40, 50, 41, 51)).src).all()


@pytest.fixture
def zarr():
    return pytest.importorskip("zarr")


class TestRuns:
    def test_edges_and_distances(self, zarr, path, tmp_path):
        out = tmp_path / "out.zarr"
        items = list(runBlocks(path, out, blockSize=128, overlap=48, **OPTIONS))
        assert [item.state for item in items] == ["written"] * 18
        found = {name: array[:] for name, array in zarr.open_group(str(out), mode="r").arrays()}
        edges, strength = detectEdgesWithStrength(terrain(), **OPTIONS)
        assert np.count_nonzero(edges) > 500
        assert np.count_nonzero(found["edges"] != edges) < 0.02 * np.count_nonzero(edges)
        near = distanceTransform(edges) <= 1.5
        assert near[found["edges"] > 0].all()
        assert (found["jump"] != strength.jump).mean() < 0.01
        assert np.array_equal(found["distance"], distanceTransform(found["edges"]))

    def test_geotiffs_in_and_out(self, zarr, tmp_path):
        tifffile = pytest.importorskip("tifffile")
        tags = [(33550, 12, 3, (0.5, 0.5, 0.0)), (33922, 12, 6, (0, 0, 0, 1000.0, 2000.0, 0))]
        tags += [(34735, 3, 8, (1, 1, 0, 1, 1024, 0, 1, 1)), (34737, 2, 0, "plane|")]
        tifffile.imwrite(tmp_path / "a.tif", terrain(), extratags=[(*tag, True) for tag in tags])
        out = tmp_path / "out"
        argv = ["batch", str(tmp_path / "a.tif"), "--blocks", "128", "--overlap", "48", "--noise", "0.02"]
        assert main([*argv, "--out", str(out)]) == 0
        written = {"edges.tif", "jump.tif", "crease.tif", "kind.tif", "significance.tif", "distance.tif"}
        assert {file.name for file in out.iterdir() if file.suffix == ".tif"} == written
        store = zarr.open_group(str(out / "blocks.zarr"), mode="r")
        for name in written:
            assert np.array_equal(tifffile.imread(out / name), store[name.removesuffix(".tif")][:])
        image, source = imreadRange(out / "distance.tif"), imreadRange(tmp_path / "a.tif")
        assert np.array_equal(image.georeference, source.georeference)
        assert image.geometry == source.geometry
        assert store.attrs["georeference"] == source.georeference.tolist()
        with tifffile.TiffFile(out / "edges.tif") as file:
            assert file.pages[0].tags[34737].value == "plane|"

    def test_regions_are_joined(self, zarr, tmp_path):
        np.save(tmp_path / "a.npy", terrain())
        out = tmp_path / "out.zarr"
        list(runBlocks(tmp_path / "a.npy", out, "segment", blockSize=128, overlap=64, **OPTIONS))
        found = zarr.open_group(str(out), mode="r")["labels"][:]
        labels = segmentRegions(terrain(), **OPTIONS)
        assert found.max() == labels.max()
        both = (found > 0) & (labels > 0)
        pairs, counts = np.unique(np.stack([found[both], labels[both]]), axis=1, return_counts=True)
        same = sum(counts[pairs[1] == label].max() for label in range(1, labels.max() + 1))
        assert same > 0.98 * np.count_nonzero(labels)

    def test_far_from_every_edge_distances_are_exact_too(self, zarr, tmp_path):
        heights = np.zeros((200, 400), np.float32)
        heights[:, 390:] = 5
        np.save(tmp_path / "a.npy", heights)
        list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", blockSize=64, overlap=16, **OPTIONS))
        found = zarr.open_group(str(tmp_path / "out.zarr"), mode="r")
        assert np.array_equal(found["distance"][:], distanceTransform(found["edges"][:]))
        assert found["distance"][0, 0] == 390

    def test_a_camera_is_seen_from_each_block(self, zarr, tmp_path):
        K = np.array([[200.0, 0, 159.5], [0, 200, 99.5], [0, 0, 1]])
        y, x = np.indices((200, 320))
        depth = np.float32(1.0) / (0.5 + 0.002 * x + 0.001 * np.abs(y - 100))
        depth = (depth + np.random.default_rng(0).normal(0, 2e-4, depth.shape)).astype(np.float32)
        np.save(tmp_path / "a.npy", depth)
        options = {"K": K, "noise": 2e-4, "creaseThreshold": 15.0}
        list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", blockSize=160, overlap=80, **options))
        found = zarr.open_group(str(tmp_path / "out.zarr"), mode="r")
        edges, strength = detectEdgesWithStrength(depth, **options)
        assert np.count_nonzero(edges) > 200
        assert (distanceTransform(edges)[found["edges"][:] > 0] <= 1.5).mean() > 0.98
        both = (found["crease"][:] > 15) & (strength.crease > 15)
        assert np.count_nonzero(both) > 200
        difference = np.abs(found["crease"][:] - strength.crease)
        assert np.percentile(difference[:, :160][both[:, :160]], 90) < 0.1
        assert np.percentile(difference[:, 160:][both[:, 160:]], 90) < 0.1

    def test_processes_and_resuming_change_nothing(self, zarr, tmp_path):
        np.save(tmp_path / "a.npy", terrain())
        argv = [str(tmp_path / "a.npy"), "--height-map", "--pixel-size", "0.5", "--noise", "0.02"]
        argv = ["batch", *argv, "--blocks", "128", "--overlap", "48", "--out"]
        assert main([*argv, str(tmp_path / "one.zarr")]) == 0
        assert main([*argv, str(tmp_path / "two.zarr"), "--jobs", "2"]) == 0
        chunk = tmp_path / "two.zarr" / "edges" / "c" / "1" / "1"
        chunk.write_bytes(b"half")
        assert main([*argv, str(tmp_path / "two.zarr"), "--resume"]) == 0
        ones, others = (
            {
                file.relative_to(tmp_path / name): file.read_bytes()
                for file in (tmp_path / name).rglob("*")
                if file.is_file()
            }
            for name in ("one.zarr", "two.zarr")
        )
        assert ones == others

    def test_distances_by_salience_are_those_of_the_whole(self, zarr, tmp_path):
        np.save(tmp_path / "a.npy", terrain())
        out = tmp_path / "out.zarr"
        argv = ["batch", str(tmp_path / "a.npy"), "--height-map", "--pixel-size", "0.5", "--noise", "0.02"]
        argv += ["--blocks", "64", "--overlap", "8", "--out", str(out)]
        assert main(argv) == 0
        assert main([*argv, "--jump-cut", "5"]) == 0
        found = {name: array[:] for name, array in zarr.open_group(str(out), mode="r").arrays()}
        salience = overallStrength(found["jump"], found["crease"], 5.0)
        assert np.count_nonzero((salience > 0) & (salience < 100)) > 0
        assert np.array_equal(found["salience"], salienceDistanceTransform(salience))
        lines = [json.loads(line) for line in (tmp_path / "out.zarr.salience.manifest.jsonl").read_text().splitlines()]
        assert [line["counts"] for line in lines] == [{"unsurePixels": 0}] * 30

    def test_distances_by_salience_beyond_reach_are_never_too_small(self, zarr, tmp_path, monkeypatch):
        monkeypatch.setattr("rangeedge.app.blocks._Saliences.reach", 20)
        np.save(tmp_path / "a.npy", terrain())
        out = tmp_path / "out.zarr"
        list(runBlocks(tmp_path / "a.npy", out, blockSize=64, overlap=8, jumpCut=5.0, **OPTIONS))
        found = {name: array[:] for name, array in zarr.open_group(str(out), mode="r").arrays()}
        whole = salienceDistanceTransform(overallStrength(found["jump"], found["crease"], 5.0))
        lines = [json.loads(line) for line in (tmp_path / "out.zarr.salience.manifest.jsonl").read_text().splitlines()]
        unsure = sum(line["counts"]["unsurePixels"] for line in lines)
        assert 0 < np.count_nonzero(found["salience"] != whole) <= unsure
        assert (found["salience"] >= whole).all()

    @pytest.mark.parametrize("jobs", [1, 2])
    def test_masks_and_maps_of_noise(self, zarr, tmp_path, jobs):
        np.save(tmp_path / "a.npy", terrain())
        mask = np.ones((260, 330), np.uint8)
        mask[90:130, :200] = 0
        noise = np.full((260, 330), 0.02)
        noise[:, 200:] = 3.0  # where it hides the houses
        np.save(tmp_path / "noise.npy", noise)
        options = {**OPTIONS, "mask": mask, "noise": np.load(tmp_path / "noise.npy", mmap_mode="r")}
        out = tmp_path / "out.zarr"
        size = {"blockSize": 128, "overlap": 330}  # every block sees all of it, and so nothing may differ
        items = list(runBlocks(tmp_path / "a.npy", out, jobs=jobs, **size, **options))
        assert {item.state for item in items} == {"written"}
        found = zarr.open_group(str(out), mode="r")["edges"][:]
        edges = detectEdges(terrain(), **{**options, "noise": noise})
        assert np.count_nonzero(edges[:, :190]) > 200
        assert np.count_nonzero(edges[:, 210:]) < 0.1 * np.count_nonzero(detectEdges(terrain(), **OPTIONS)[:, 210:])
        assert np.array_equal(found, edges)
        again = list(runBlocks(tmp_path / "a.npy", out, **size, **options))
        assert {item.state for item in again} == {"skipped"}
        mask[0, 0] = 0
        assert {item.state for item in runBlocks(tmp_path / "a.npy", out, **size, **options)} == {"written"}

    def test_only_blocks_are_done_again_whose_mask_has_changed(self, zarr, tmp_path):
        np.save(tmp_path / "a.npy", terrain())
        mask = np.ones((260, 330), bool)
        size = {"blockSize": 128, "overlap": 48}
        list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", mask=mask, **size, **OPTIONS))
        mask[:40, :40] = False
        items = list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", mask=mask, **size, **OPTIONS))
        assert [item.state for item in items[:9]] == ["written", *["skipped"] * 8]
        assert not zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["edges"][:38, :38].any()

    def test_the_noise_is_that_of_pixels_that_are_used(self, zarr, tmp_path):
        heights = terrain()
        mask = np.zeros((260, 330), np.uint8)
        mask[:, :200] = 1
        heights[:, 200:] += np.random.default_rng(1).normal(0, 3, (260, 130)).astype(np.float32)
        np.save(tmp_path / "a.npy", heights)
        options = {"heightMap": True, "pixelSize": 0.5, "mask": mask}
        list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", blockSize=128, overlap=48, **options))
        found = zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["edges"][:]
        edges = detectEdges(heights, **options)
        assert np.count_nonzero(edges) > 200
        assert np.count_nonzero(found != edges) < 0.05 * np.count_nonzero(edges)

    def test_noise_is_estimated_once(self, zarr, tmp_path):
        np.save(tmp_path / "a.npy", terrain())
        options = {"heightMap": True, "pixelSize": 0.5}
        list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", blockSize=128, overlap=48, **options))
        found = zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["edges"][:]
        edges = detectEdges(terrain(), **options)
        assert np.count_nonzero(found != edges) < 0.05 * np.count_nonzero(edges)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"task": "lines"}, "`task` must be 'detect' or 'segment'"),
        ({"blockSize": 8}, "`blockSize`"),
        ({"overlap": -1}, "`overlap`"),
        ({"noise": np.ones((3, 4))}, r"`noise` must be an array of shape \(260, 330\)"),
        ({"mask": np.ones((330, 260), np.uint8)}, r"`mask` must be an array of shape \(260, 330\)"),
        ({"jumpCut": 0}, "`jumpCut`"),
        ({"jumpCut": 1.0, "task": "segment"}, "`jumpCut` must be None for 'segment'"),
        ({"minArea": 9}, "`minArea` is no option of 'detect'"),
    ],
)
def test_bad_arguments(tmp_path, more, message):
    np.save(tmp_path / "a.npy", terrain())
    with pytest.raises(error, match=f"runBlocks: {message}"):
        runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", **more)


def test_what_is_no_large_image(zarr, tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((3, 40, 50)))
    imwriteRange(tmp_path / "b.png", np.ones((40, 50), np.uint16))
    np.save(tmp_path / "d.npy", np.zeros((40, 50), bool))
    np.save(tmp_path / "e.npy", np.zeros((0, 50)))
    zarr.create_array(str(tmp_path / "f.zarr"), data=np.zeros((40, 50), np.uint8))
    for name, message in (
        ("a.npy", r"are of shape \(H, W\)"),
        ("b.png", "TIFF, NPY and Zarr"),
        ("c.tif", "No such file"),
        ("d.npy", "an array of bool"),
        ("e.npy", "not empty"),
        ("f.zarr", "8 bits are too coarse"),
    ):
        with pytest.raises(error, match=f"runBlocks: cannot read .*{name}.*{message}"):
            runBlocks(tmp_path / name, tmp_path / "out.zarr")


def test_no_more_blocks_than_can_be_listed(zarr, tmp_path, monkeypatch):
    np.save(tmp_path / "a.npy", np.zeros((640, 1280)))
    monkeypatch.setattr("rangeedge.app.blocks._MOST_BLOCKS", 199)
    with pytest.raises(error, match="`blockSize` must be such that 1280 x 640 pixels are at most 199 blocks, got 64"):
        runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", blockSize=64)
    runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", blockSize=72)


def test_a_camera_of_a_size_is_that_of_the_whole_image(zarr, tmp_path):
    """Given by hand or by a file; blocks, and patches of which noise is estimated, are of other sizes."""
    depth = np.where(np.arange(320) < 150, 1.0, 1.5) + np.random.default_rng(0).normal(0, 0.001, (200, 320))
    np.save(tmp_path / "a.npy", depth)
    (tmp_path / "camera.json").write_text('{"fx": 300, "fy": 300, "cx": 160, "cy": 100, "width": 320, "height": 200}')
    for more in ({"K": (300, 300, 160, 100), "imageSize": (320, 200)}, {"K": str(tmp_path / "camera.json")}):
        options = {"blockSize": 128, "overlap": 64, "force": True, **more}
        items = list(runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", **options))
        assert {item.state for item in items} == {"written"}
        found = zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["edges"][:]
        np.testing.assert_array_equal(np.flatnonzero(found[100]), [149])
    with pytest.raises(error, match="runBlocks: `src` has 320 x 200 pixels, but K holds for 640 x 400"):
        runBlocks(tmp_path / "a.npy", tmp_path / "out.zarr", K=(300, 300, 160, 100), imageSize=(640, 400))


@pytest.mark.parametrize("change", [{"index": 99}, {"counts": {"regions": "many"}}, {"counts": None}])
def test_lines_that_were_edited_are_done_again(zarr, tmp_path, change):
    np.save(tmp_path / "a.npy", terrain())
    run = (tmp_path / "a.npy", tmp_path / "out.zarr", "segment")
    options = {"blockSize": 128, "overlap": 64, **OPTIONS}
    list(runBlocks(*run, **options))
    labels = zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["labels"][:]
    manifest = tmp_path / "out.zarr.parts.manifest.jsonl"
    lines = [json.loads(line) for line in manifest.read_text().splitlines()]
    lines[0] |= change
    manifest.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert [item.state for item in runBlocks(*run, **options)][:2] == ["written", "skipped"]
    assert np.array_equal(zarr.open_group(str(tmp_path / "out.zarr"), mode="r")["labels"][:], labels)
