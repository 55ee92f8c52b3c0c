"""Chains and segments in files and in pictures."""

import csv
import json

import numpy as np
import pytest

import rangeedge
from rangeedge import EDGE_CONVEX, EDGE_JUMP, drawChains, drawSegments, fitSegments, linkEdges, writeLines
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
    vertices = np.frombuffer(body, "<f8", 3 * counts[0]).reshape(-1, 3)
    assert np.array_equal(vertices, chains.points["point"])
    edges = np.frombuffer(body, [("v", "<2i4"), ("kind", "u1"), ("angle", "<f4")], offset=24 * counts[0])
    assert len(edges) == counts[1]
    assert np.linalg.norm(np.diff(vertices[edges["v"]], axis=1), axis=2).sum() == pytest.approx(
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


@pytest.mark.parametrize("suffix", ["csv", "ply", "obj", "geojson"])
def test_nothing_to_write_is_a_valid_file(suffix, tmp_path):
    writeLines(tmp_path / f"none.{suffix}", [])
    assert (tmp_path / f"none.{suffix}").exists()


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


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: writeLines("a.dxf", []), "writeLines: cannot write 'a.dxf': the suffix must be one of .csv"),
        (lambda: writeLines(3, []), "writeLines: `filename` must be"),
        (lambda: writeLines("a.obj", [1]), "writeLines: `lines` must be EdgeChains"),
        (lambda: writeLines("a.obj", [], transform=(1, 2)), "`transform` must be None for .obj"),
        (lambda: writeLines("a.geojson", [], transform=(1, 2)), "`transform` must be six finite numbers"),
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
