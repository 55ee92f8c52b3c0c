"""Chains and segments in files and in pictures."""

import csv
import json

import cv2
import numpy as np
import pytest

import rangeedge
from rangeedge import (
    EDGE_CONVEX,
    EDGE_JUMP,
    Line,
    drawChains,
    drawSegments,
    fitSegments,
    imreadRange,
    linkEdges,
    readLines,
    regionBoundaries,
    segmentRegions,
    toLines,
    writeLines,
)
from rangeedge.app.cli import main
from rangeedge.segments import SEGMENT
from rangeedge.synthetic import box, pinholeCamera, plane, renderScene, sphere

K = np.array([[150.0, 0, 79.5], [0, 150, 59.5], [0, 0, 1]])


@pytest.fixture(scope="module")
def depth():
    axes = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    scene = [plane((0, 0, 1.5), (0, -0.2, -1)), box((-0.12, 0, 1.0), (0.3, 0.25, 0.2), axes), sphere((0.3, 0, 1), 0.1)]
    return renderScene(scene, pinholeCamera(K, (160, 120))).depth


@pytest.fixture(scope="module")
def chains(depth):
    chains = linkEdges(depth, K=K, noise=0.0005)
    assert any(chain.closed for chain in chains)
    return chains


@pytest.fixture(scope="module")
def fitted(chains):
    return fitSegments(chains)


def test_csv_holds_every_point(chains, tmp_path):
    writeLines(tmp_path / "chains.csv", chains)
    rows = list(csv.DictReader((tmp_path / "chains.csv").read_text().splitlines()))
    assert len(rows) == len(chains.points)
    read = np.array([[float(row[name]) for name in ("x", "y", "z", "u", "v")] for row in rows])
    assert np.array_equal(read[:, :3], chains.points["point"])
    assert np.array_equal(read[:, 3], chains.points["x"])
    assert [row["kind"] for row in rows].count("jump") == sum(len(c) for c in chains if c.kind == EDGE_JUMP)


def test_csv_of_segments_has_a_row_an_end(fitted, tmp_path):
    writeLines(tmp_path / "segments.csv", fitted)
    rows = list(csv.DictReader((tmp_path / "segments.csv").read_text().splitlines()))
    assert len(rows) == 2 * len(fitted.segments)
    assert float(rows[1]["z"]) == fitted.segments["ends"][0, 1, 2]
    assert json.loads(rows[0]["vertices"]) == fitted.segments["vertices"][0].tolist()


def test_ply_holds_vertices_and_edges(chains, tmp_path):
    writeLines(tmp_path / "chains.ply", chains)
    head, _, body = (tmp_path / "chains.ply").read_bytes().partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    closed = sum(chain.closed for chain in chains)
    assert counts == [len(chains.points), len(chains.points) - len(chains) + closed]
    vertices = np.frombuffer(body, "<f8", 5 * counts[0]).reshape(-1, 5)
    assert np.array_equal(vertices[:, :3], chains.points["point"])
    assert np.array_equal(vertices[:, 3], chains.points["x"])
    edges = np.frombuffer(body, [("v", "<2i4"), ("kind", "u1"), ("angle", "<f4")], offset=40 * counts[0])
    assert len(edges) == counts[1]
    assert np.linalg.norm(np.diff(vertices[edges["v"], :3], axis=1), axis=2).sum() == pytest.approx(
        chains.chains["length"].sum()
    )
    assert set(edges["kind"]) == {EDGE_JUMP, EDGE_CONVEX}
    assert edges["angle"][edges["kind"] == EDGE_CONVEX] == pytest.approx(90, abs=1)


def test_obj_closes_closed_chains(chains, tmp_path):
    writeLines(tmp_path / "chains.obj", list(chains))
    text = (tmp_path / "chains.obj").read_text().splitlines()
    points = np.array([line.split()[1:] for line in text if line.startswith("v ")], float)
    assert np.array_equal(points, chains.points["point"])
    polylines = [[int(i) for i in line.split()[1:]] for line in text if line.startswith("l ")]
    assert [line[0] == line[-1] for line in polylines] == [chain.closed for chain in chains]
    assert sorted({i for line in polylines for i in line}) == list(range(1, len(points) + 1))


def test_geojson_holds_the_same_and_maps_pixels(chains, fitted, tmp_path):
    path = tmp_path / "lines.geojson"
    writeLines(path, chains)
    features = json.loads(path.read_text())["features"]
    assert len(features) == len(chains)
    assert features[0]["geometry"]["coordinates"][0] == chains[0].points["point"][0].tolist()
    assert features[0]["properties"]["length"] == chains[0].length
    writeLines(path, fitted.segments, transform=(1000, 2, 0, 5000, 0, -2))
    (x, y, z), _ = json.loads(path.read_text())["features"][0]["geometry"]["coordinates"]
    u, v = fitted.segments["pixels"][0, 0]
    assert (x, y) == pytest.approx((1000 + 2 * (u + 0.5), 5000 - 2 * (v + 0.5)))
    assert z == fitted.segments["ends"][0, 0, 2]
    kinds = [f["properties"]["dihedral"] is None for f in json.loads(path.read_text())["features"]]
    assert kinds == (fitted.segments["kind"] == EDGE_JUMP).tolist()


SUFFIXES = ["csv", "ply", "obj", "geojson", "dxf", "svg"]
HELD = {  # pixels, points, properties
    "csv": (True, True, True),
    "ply": (True, True, False),
    "obj": (False, True, False),
    "geojson": (False, True, True),
    "dxf": (False, True, True),
    "svg": (True, False, True),
}


@pytest.fixture(scope="module")
def outlines(depth):
    labels = segmentRegions(depth, K=K, noise=0.0005)
    labels[60:70, 10:20] = 0  # a hole, and a region in another one
    labels[20:50, 100:130] = 0
    labels[30:40, 110:120] = 90
    found = regionBoundaries(labels, depth, K=K)
    assert found.rings["hole"].sum() >= 2
    return found


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("what", ["chains", "fitted", "outlines"])
def test_what_was_written_is_read(suffix, what, request, tmp_path):
    if suffix == "dxf":
        pytest.importorskip("ezdxf")
    lines = request.getfixturevalue(what)
    path = tmp_path / f"lines.{suffix}"
    writeLines(path, lines)
    expected, read = toLines(lines), readLines(path)
    assert len(read) == len(expected) > 3
    pixels, points, properties = HELD[suffix]
    for line, known in zip(read, expected, strict=True):
        assert (line.kind, line.closed) == (known.kind, known.closed)
        assert line.pixels.shape == known.pixels.shape
        assert line.points.shape == known.points.shape
        assert np.array_equal(line.pixels, known.pixels) if pixels else np.isnan(line.pixels).all()
        assert np.array_equal(line.points, known.points) if points else np.isnan(line.points).all()
        if properties:
            assert set(line.properties) == set(known.properties)
            for name, value in known.properties.items():
                assert line.properties[name] == value or (np.isnan(value) and np.isnan(line.properties[name]))
    if suffix == "ply":
        assert [line.properties.get("angle", np.nan) for line in read] == pytest.approx(
            [line.angle for line in expected], rel=1e-6, nan_ok=True
        )
    writeLines(tmp_path / f"again.{suffix}", read)
    if suffix != "dxf":  # which holds the time
        assert (tmp_path / f"again.{suffix}").read_bytes() == path.read_bytes()
    again = readLines(tmp_path / f"again.{suffix}")
    assert all(np.array_equal(a.points, b.points, equal_nan=True) for a, b in zip(read, again, strict=True))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_nothing_to_write_is_a_valid_file(suffix, tmp_path):
    if suffix == "dxf":
        pytest.importorskip("ezdxf")
    writeLines(tmp_path / f"none.{suffix}", [])
    assert readLines(tmp_path / f"none.{suffix}") == []


def test_a_line_without_points_has_no_edges_in_ply(tmp_path):
    lines = [Line("jump", closed, np.zeros((0, 2)), np.zeros((0, 3)), {}) for closed in (False, True)]
    writeLines(tmp_path / "none.ply", lines)
    assert readLines(tmp_path / "none.ply") == []


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_files_of_something_else_are_refused(suffix, tmp_path):
    if suffix == "dxf":
        pytest.importorskip("ezdxf")
    path = tmp_path / f"other.{suffix}"
    path.write_bytes(b"l 1 2 3\n{" if suffix != "svg" else b"<svg>")
    with pytest.raises(rangeedge.error, match="it holds no lines"):
        readLines(path)


def test_outlines_are_polygons_on_a_map(outlines, tmp_path):
    path = tmp_path / "regions.geojson"
    writeLines(path, outlines, [[2, 0, 1000], [0, -2, 5000]], epsg=32633)
    collection = json.loads(path.read_text())
    assert collection["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::32633"
    assert len(collection["features"]) == len(outlines)
    for feature, region in zip(collection["features"], outlines, strict=True):
        assert feature["geometry"]["type"] == "Polygon"
        rings = feature["geometry"]["coordinates"]
        assert len(rings) == 1 + len(region.holes)
        assert rings[0][0] == rings[0][-1]
        assert feature["properties"]["label"] == region.label
        assert rings[0][0][:2] == pytest.approx((1000 + 2 * region.outline["x"][0], 5000 - 2 * region.outline["y"][0]))


def test_a_drawing_has_its_picture_below(depth, chains, tmp_path):
    path = tmp_path / "lines.svg"
    picture = drawChains(depth, [], K=K)
    writeLines(path, chains, picture=picture)
    text = path.read_text()
    assert 'width="160" height="120" viewBox="-0.5 -0.5 160 120"' in text
    assert "data:image/png;base64," in text
    assert len(readLines(path)) == len(chains)


def test_lines_are_plain_objects(chains, fitted, outlines):
    for lines in (chains, list(chains), fitted, fitted.segments, outlines, toLines(chains)):
        plain = toLines(lines)
        assert all(isinstance(line, Line) for line in plain)
        json.dumps([[line.kind, line.closed, line.points.tolist(), line.properties] for line in plain])
    assert len(toLines(outlines)) == len(outlines.rings)


@pytest.mark.parametrize("lines", [memoryview(np.zeros((2, 3))), np.zeros((2, 3)), "chains", [1], 5, None])
def test_what_holds_no_lines_is_refused(lines):
    with pytest.raises(rangeedge.error, match="`lines` must be EdgeChains, Segments, arcs"):
        toLines(lines)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_drawings_with_entities_are_refused(tmp_path, encoding):
    """Nine of them, each ten of the one before, would be a billion."""
    entities = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10 if i else "x"}">' for i in range(9))
    path = tmp_path / "a.svg"
    path.write_bytes(
        f'<?xml version="1.0" encoding="{encoding}"?><!DOCTYPE svg [{entities}]><svg>&e8;</svg>'.encode(encoding)
    )
    with pytest.raises(rangeedge.error, match="entities" if encoding == "utf-8" else "garbled|decode|text"):
        readLines(path)


@pytest.mark.parametrize("command", ["lines", "segment"])
@pytest.mark.parametrize("suffix", ["geojson", "svg", "obj"])
def test_the_command_writes_one_file_by_its_suffix(command, suffix, depth, tmp_path):
    image = tmp_path / "depth.npy"
    np.save(image, depth)
    out = tmp_path / f"found.{suffix}"
    assert main([command, str(image), "-K", "150,150,79.5,59.5", "--noise", "0.0005", "--out", str(out)]) == 0
    assert len(readLines(out)) > 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["depth.npy", f"found.{suffix}"]


def test_lines_of_an_elevation_model_lie_on_its_map(tmp_path):
    rows = np.abs(np.arange(50.0) - 25.2) * np.ones((40, 1))
    head = "ncols 50\nnrows 40\nxllcorner 1000\nyllcorner 2000\ncellsize 2\n"
    (tmp_path / "dem.asc").write_text(head + "\n".join(" ".join(f"{2 * v:.3f}" for v in row) for row in rows))
    assert imreadRange(tmp_path / "dem.asc").georeference is not None
    assert main(["lines", str(tmp_path / "dem.asc"), "--out", str(tmp_path / "valley.geojson")]) == 0
    (valley,) = readLines(tmp_path / "valley.geojson")
    assert valley.points[:, 0] == pytest.approx(1000 + 2 * 25.7, abs=0.05)
    assert 2000 <= valley.points[:, 1].min() < valley.points[:, 1].max() <= 2080


def test_pictures_show_chains_where_they_are(depth, chains):
    bare = drawChains(depth, [], K=K, scale=4)
    picture = drawChains(depth, chains, K=K, scale=4)
    assert picture.shape == (480, 640, 3)
    changed = (picture != bare).any(axis=2)
    at = np.rint(4 * np.column_stack([chains.points["y"], chains.points["x"]]) + 1.5).astype(int)
    assert changed[at[:, 0], at[:, 1]].all()
    assert changed.mean() < 0.1


def test_pictures_show_segments_vertices_and_lengths(depth, fitted):
    plain = drawSegments(depth, fitted.segments, K=K, scale=3)
    dotted = drawSegments(depth, fitted.segments, fitted.vertices, K=K, scale=3)
    for vertex in fitted.vertices:
        place = round(3 * vertex["y"] + 1), round(3 * vertex["x"] + 1)
        assert dotted[place].tolist() == [255, 255, 255]
    labelled = drawSegments(depth, fitted.segments, fitted.vertices, K=K, scale=3, lengths=True)
    assert (labelled != dotted).sum() > (dotted != plain).sum()
    dst = np.zeros((120, 160, 3), np.uint8)
    assert drawSegments(depth, fitted.segments, dst=dst, K=K) is dst


def test_lengths_are_written_where_no_other_is(monkeypatch):
    rng = np.random.default_rng(0)
    segments = np.zeros(60, SEGMENT)
    segments["pixels"] = rng.uniform(0, 200, (60, 1, 2)) + rng.uniform(-60, 60, (60, 2, 2))
    segments["length"] = np.linalg.norm(segments["pixels"][:, 1] - segments["pixels"][:, 0], axis=1)
    written = []
    put = cv2.putText
    monkeypatch.setattr(
        cv2, "putText", lambda canvas, text, at, *rest: written.append((text, at)) or put(canvas, text, at, *rest)
    )
    drawSegments(np.ones((200, 220)), segments, scale=3, lengths=True)
    assert 5 < len(set(written)) < 60
    drawn = np.zeros((600, 660), np.uint8)
    for text, (x, y) in dict.fromkeys(written):
        (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.48, 1)
        assert 0 <= x <= 660 - width
        assert height <= y <= 600
        assert not drawn[y - height : y, x : x + width].any()
        drawn[y - height : y, x : x + width] = 1
    longest = f"{segments['length'].max():.3g}"
    assert longest in [text for text, _ in written[:2]]


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: writeLines("a.xyz", []), "writeLines: cannot write 'a.xyz': the suffix must be one of .csv"),
        (lambda: readLines("a.xyz"), "readLines: cannot read 'a.xyz': the suffix must be one of .csv"),
        (lambda: readLines("/nowhere/at/all.obj"), "readLines: cannot read '/nowhere/at/all.obj': No such file"),
        (lambda: toLines(3), "toLines: `lines` must be EdgeChains"),
        (lambda: writeLines("a.geojson", [], epsg=0), "`epsg` must be the code of a reference system"),
        (lambda: writeLines("a.obj", [], epsg=4326), "`epsg` must be None for .obj"),
        (lambda: writeLines("a.svg", [], picture=np.ones((3, 4))), "`picture` must be a CV_8UC3 picture"),
        (lambda: writeLines(3, []), "writeLines: `filename` must be"),
        (lambda: writeLines("a.obj", [1]), "writeLines: `lines` must be EdgeChains"),
        (lambda: writeLines("a.obj", [], transform=(1, 2)), "`transform` must be None for .obj"),
        (lambda: writeLines("a.geojson", [], transform=(1, 2)), "`transform` must be a (2, 3) array, or six finite"),
        (lambda: writeLines("/nowhere/at/all.obj", []), "cannot write '/nowhere/at/all.obj': No such file"),
        (lambda: drawChains(np.ones((4, 5)), 3), "drawChains: `chains` must be EdgeChains"),
        (lambda: drawChains(np.ones((4, 5)), [], scale=0), "drawChains: `scale` must be"),
        (lambda: drawSegments(np.ones((4, 5)), np.ones(3)), "drawSegments: `segments` must be a structured array"),
    ],
)
def test_bad_arguments_are_named(call, text):
    with pytest.raises(rangeedge.error) as problem:
        call()
    assert text in str(problem.value)


@pytest.mark.parametrize("suffix", [".csv", ".ply", ".obj", ".geojson", ".svg"])
@pytest.mark.parametrize("closed", [False, True])
def test_lines_without_points_leave_the_others_alone(tmp_path, suffix, closed):
    pixels = np.array([[0.0, 0], [1, 1], [2, 0]])
    full = Line("convex", closed, pixels, np.column_stack([pixels, np.ones(3)]), {})
    none = Line("concave", closed, np.zeros((0, 2)), np.zeros((0, 3)), {})
    rangeedge.writeLines(tmp_path / f"a{suffix}", [none, full, none])
    found = [line for line in rangeedge.readLines(tmp_path / f"a{suffix}") if len(line.pixels)]
    assert [(line.kind, line.closed, len(line.pixels)) for line in found] == [("convex", closed, 3)]
    assert len(rangeedge.readLines(tmp_path / f"a{suffix}")) == (1 if suffix in (".csv", ".ply") else 3)
