"""Thinning: lines one pixel wide, as long as their bands, connected as before."""

import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rangeedge
from rangeedge.constants import THIN_ITERATIVE, THIN_LEE, THIN_MEDIAL, THIN_SKELETON
from rangeedge.thinning import thinEdges

METHODS = {"skeleton": THIN_SKELETON, "lee": THIN_LEE, "iterative": THIN_ITERATIVE, "medial": THIN_MEDIAL}
every_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS.keys())

MIRRORS = {
    "rows reversed": lambda image: image[::-1],
    "columns reversed": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
    "transposed": lambda image: image.T,
    "transposed the other way": lambda image: image[::-1, ::-1].T,
}  # each its own inverse


def drawn(text):
    """A map from rows of text: '.' is no edge."""
    rows = text.split()
    return np.array([[letter != "." for letter in row] for row in rows]).astype(np.uint8) * 255


def picture(edges):
    return "\n".join("".join("#" if value else "." for value in row) for row in edges)


def topology(edges):
    """How many 8-connected components the edges have, and how many 4-connected ones the rest, outside included."""
    edges = np.pad(edges != 0, 1).astype(np.uint8)
    return cv2.connectedComponents(edges, connectivity=8)[0], cv2.connectedComponents(1 - edges, connectivity=4)[0]


def has_block(edges, size):
    square = np.ones((size, size), np.uint8)
    return cv2.erode(edges, square, borderType=cv2.BORDER_CONSTANT, borderValue=0).any()


def neighbours(edges):
    """How many 8-neighbours every edge pixel has; 0 elsewhere."""
    edges = (edges != 0).astype(np.uint8)
    return (cv2.boxFilter(edges, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) - 1) * edges


def share_within_a_pixel(edges, other):
    """Share of the pixels of both that lie on or beside a pixel of the other."""
    near = np.ones((3, 3), np.uint8)
    found = np.count_nonzero(edges & cv2.dilate(other, near)) + np.count_nonzero(other & cv2.dilate(edges, near))
    return found / (np.count_nonzero(edges) + np.count_nonzero(other))


def random_map(rng, kind):
    """Noise, or blobs and bands out of noise."""
    edges = (rng.random(rng.integers(1, 36, 2)) < rng.random()).astype(np.uint8) * 255
    if kind == "noise":
        return edges
    operation = {"opened": cv2.MORPH_OPEN, "closed": cv2.MORPH_CLOSE}[kind]
    return cv2.morphologyEx(edges, operation, np.ones((3, 3), np.uint8))


def band(width, degrees, *, size=101, half_length=np.inf, offset=(0.0, 0.0)):
    """A straight band through about the centre; and every pixel's place along and across it."""
    y, x = np.indices((size, size)) - (size - 1) / 2
    x, y = x - offset[0], y - offset[1]
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    along, across = x * cos + y * sin, y * cos - x * sin
    edges = (np.abs(across) <= width / 2) & (np.abs(along) <= half_length)
    return edges.astype(np.uint8) * 255, along, across


def scene(thickness=3):
    edges = np.zeros((80, 100), np.uint8)
    cv2.rectangle(edges, (20, 15), (70, 60), 255, thickness)
    cv2.line(edges, (20, 40), (70, 30), 255, thickness)
    cv2.circle(edges, (80, 62), 12, 255, thickness)
    cv2.line(edges, (4, 4), (4, 30), 255, thickness)
    return edges


# By hand.


def assert_thin(edges, expected, **options):
    assert picture(thinEdges(drawn(edges), **options)) == picture(drawn(expected))


def test_middle_of_a_bar():
    assert_thin(
        """
        ............
        .##########.
        .##########.
        .##########.
        ............
        """,
        """
        ............
        ............
        .##########.
        ............
        ............
        """,
    )


@pytest.mark.parametrize("wide", range(1, 6))
def test_short_bars_are_lines_as_long_as_their_longer_side(wide):
    for tall in range(wide + 1, 16):
        bar = np.pad(np.full((tall, wide), 255, np.uint8), 2)
        for thin in (thinEdges(bar), thinEdges(np.ascontiguousarray(bar.T)).T):
            assert np.count_nonzero(thin) == np.count_nonzero(thin.any(axis=1)) == tall


def test_of_two_middle_rows_the_upper_one():
    assert_thin(
        """
        ..............
        ..##########..
        ..##########..
        ..##########..
        ..##########..
        ..............
        """,
        """
        ..............
        ..............
        ..##########..
        ..............
        ..............
        ..............
        """,
    )


def test_diagonal_staircase_keeps_every_row():
    assert_thin(
        """
        ##.......
        .##......
        ..##.....
        ...##....
        ....##...
        .....##..
        ......##.
        """,
        """
        #........
        .##......
        ...#.....
        ....#....
        .....#...
        ......#..
        .......#.
        """,
    )


def test_only_the_pixel_inside_a_corner_can_be_spared():
    assert_thin(
        """
        #######
        ......#
        ......#
        ......#
        """,
        """
        ######.
        ......#
        ......#
        ......#
        """,
    )


@pytest.mark.parametrize(
    "lines",
    [
        """
        #.....#
        .#...#.
        ..#.#..
        ...#...
        ..#.#..
        .#...#.
        #.....#
        """,
        """
        ..###..
        .#...#.
        #.....#
        .#...#.
        ..###..
        """,
        """
        ##.....
        ..#..#.
        ......#
        .#.....
        #...#..
        """,
    ],
    ids=["crossing", "ring", "short lines"],
)
@every_method
def test_thin_lines_stay(lines, method):
    assert_thin(lines, lines, method=method, spurLength=3)


def test_spurs_go_and_leave_the_line_straight():
    comb = """
        .................#....
        ...#......#......#....
        ...#......#......#....
        ...#......#......#....
        ######################
        ......................
        """
    straight = "\n".join(["." * 22] * 4 + ["#" * 22, "." * 22])
    assert_thin(comb, straight, spurLength=5)
    fewer = thinEdges(drawn(comb), spurLength=3)
    assert fewer[:4].any(axis=0).nonzero()[0].tolist() == [17]
    assert fewer[4, :16].all()
    assert thinEdges(drawn(comb), spurLength=0)[:4].any(axis=0).nonzero()[0].tolist() == [3, 10, 17]


def test_what_stands_out_of_a_band_is_measured_from_its_rim():
    bar = """
        ........#.........
        ........#.........
        ........#.........
        ##################
        ##################
        ##################
        ##################
        ##################
        """
    without = thinEdges(drawn(bar), spurLength=4)
    assert picture(without) == picture(drawn("\n".join(["." * 18] * 5 + ["#" * 18] + ["." * 18] * 2)))
    assert thinEdges(drawn(bar), spurLength=2)[:3, 8].all()


def test_shortest_branches_of_a_star_go():
    assert_thin(
        """
        ...#....
        ...#....
        ########
        ...#....
        """,
        """
        ........
        ........
        ########
        ........
        """,
    )


# Properties.


@every_method
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["noise", "opened", "closed"]), spur=st.integers(0, 9))
def test_properties_of_any_map(method, seed, kind, spur):
    edges = random_map(np.random.default_rng(seed), kind)
    thin = thinEdges(edges, method, spurLength=spur)
    assert set(np.unique(thin)) <= {0, 255}
    assert not (thin & ~edges).any()
    assert topology(thin) == topology(edges)
    assert np.array_equal(thinEdges(thin, method, spurLength=spur), thin)
    assert not can_be_spared(thin).any()


def can_be_spared(edges):
    """Pixels whose removal alone would keep the topology and which are no ends of lines."""
    spared = np.zeros(edges.shape, bool)
    for y, x in np.argwhere(neighbours(edges) > 1):
        around = np.pad(edges != 0, 1)[y : y + 3, x : x + 3]
        without = around.copy()
        without[1, 1] = False
        spared[y, x] = topology(without) == topology(around)
    return spared


@every_method
def test_no_blocks(method):
    """No square of nine, ever; of four only where lines meet."""
    rng = np.random.default_rng(4)
    for _ in range(300):
        edges = random_map(rng, "opened")
        thin = thinEdges(edges, method)
        assert not has_block(thin, 3)
        if has_block(thin, 2):
            corners = cv2.erode(thin, np.ones((2, 2), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0)
            for y, x in np.argwhere(corners):  # the lower right one of the four
                assert (neighbours(thin)[y - 1 : y + 1, x - 1 : x + 1] > 3).all()


@every_method
@pytest.mark.parametrize("width", [1.5, 2, 3, 4, 5, 8])
def test_bands_at_every_angle_are_lines_of_their_length(method, width):
    rng = np.random.default_rng(5)
    for degrees in np.arange(0, 180, 7.5):
        edges, along, across = band(width, degrees, half_length=35, offset=rng.uniform(-1, 1, 2))
        thin = thinEdges(edges, method) > 0
        assert topology(thin) == (2, 2)
        assert np.count_nonzero(neighbours(thin) == 1) == 2
        assert not (neighbours(thin) > 2).any()
        assert np.ptp(along[thin]) > np.ptp(along[edges > 0]) - 2.5
        inner = thin & (np.abs(along) < 35 - width)
        assert np.abs(across[inner]).max() <= (1.2 if method == THIN_MEDIAL else max(1.2, width / 2))
        if method == THIN_MEDIAL:
            assert np.abs(np.mean(across[inner])) < 0.75


@pytest.mark.parametrize("width", [8, 13, 20])
def test_the_ends_of_a_broad_band_are_reached_in_its_middle(width):
    """Not at its corners."""
    rng = np.random.default_rng(5)
    for degrees in np.arange(0, 180, 7.5):
        edges, along, across = band(width, degrees, half_length=40, offset=rng.uniform(-1, 1, 2))
        thin = thinEdges(edges) > 0
        assert np.abs(across[thin]).max() < 3
        assert along[thin].min() < -37
        assert along[thin].max() > 37


@every_method
@pytest.mark.parametrize("width", [2, 3, 6])
def test_bands_that_leave_the_image_are_lines_up_to_its_border(method, width):
    rng = np.random.default_rng(6)
    for degrees in np.arange(0, 180, 7.5):
        edges, _, _ = band(width, degrees, offset=rng.uniform(-1, 1, 2))
        thin = thinEdges(edges, method)
        assert np.count_nonzero(np.pad(np.zeros((99, 99), np.uint8), 1, constant_values=1) & thin) >= 2


def test_clean_diagonal_band_keeps_its_rows():
    """Zhang's skeleton of these loses between a half and all of the rows."""
    y, x = np.indices((120, 120))
    for shift in (0, 1, 2):
        for wide in (2, 3, 4):
            edges = ((x - y >= shift) & (x - y < shift + wide)).astype(np.uint8)
            for method in METHODS.values():
                rows = (thinEdges(edges, method) > 0).any(axis=1)
                assert rows.sum() >= (edges > 0).any(axis=1).sum() - 1


@pytest.mark.parametrize("mirror", MIRRORS.values(), ids=MIRRORS.keys())
def test_mirrored_maps_give_mirrored_lines(mirror):
    rng = np.random.default_rng(7)
    for thickness in (1, 2, 3, 4, 5, 6):
        edges = scene(thickness)
        assert share_within_a_pixel(thinEdges(edges), mirror(thinEdges(mirror(edges)))) > 0.995
    ragged = cv2.GaussianBlur(rng.normal(size=(400, 500)), (0, 0), 4)
    edges = (np.abs(ragged) < 0.01).astype(np.uint8) * 255
    assert share_within_a_pixel(thinEdges(edges), mirror(thinEdges(mirror(edges)))) > 0.995
    dots = thinEdges(np.maximum(edges, (rng.random(edges.shape) < 0.01).astype(np.uint8) * 255))
    assert np.count_nonzero(dots) > 5000


def test_bands_with_one_middle_are_mirrored_exactly():
    edges = np.zeros((60, 70), np.uint8)
    edges[20:25, 10:60] = 255
    edges[10:55, 30:33] = 255
    for mirror in MIRRORS.values():
        assert np.array_equal(mirror(thinEdges(mirror(edges))), thinEdges(edges))


@every_method
def test_closed_outlines_stay_closed(method):
    edges = scene(5)
    edges[10, 45] = edges[11, 45] = 255  # a spur on the frame
    thin = thinEdges(edges, method)
    # Ring and frame touch, and there is the bar; the outside, both halves of the frame, the inside of the ring.
    assert topology(thin) == topology(edges) == (3, 5)
    assert np.count_nonzero(neighbours(thin) == 1) == 2  # of the bar


@every_method
@pytest.mark.parametrize("thickness", [1, 2, 3, 5])
def test_lines_of_a_scene(method, thickness):
    thin = thinEdges(scene(thickness), method)
    assert topology(thin) == topology(scene(thickness))
    assert not has_block(thin, 2)
    # Frame, chord, ring and bar keep their length, but for corners that are cut.
    assert 300 < np.count_nonzero(thin) <= np.count_nonzero(scene(1))
    assert share_within_a_pixel(thin, scene(1)) > 0.97


@pytest.mark.parametrize(("method", "name"), [(THIN_SKELETON, "zhang"), (THIN_LEE, "lee")], ids=["skeleton", "lee"])
def test_lines_run_where_those_of_scikit_image_do(method, name):
    from skimage.morphology import skeletonize

    edges = scene(5)
    theirs = skeletonize(edges > 0, method=name)
    ours = thinEdges(edges, method, spurLength=0) > 0
    assert np.count_nonzero(theirs & ~ours) <= 0.02 * np.count_nonzero(theirs)


def test_time_is_proportional_to_the_number_of_pixels():
    """A full map has as many layers as half its side: a pass over the image for every layer would take 16 times."""

    def seconds(side):
        full = np.full((side, side), 255, np.uint8)
        return min(timed(lambda: thinEdges(full)) for _ in range(5))

    assert seconds(1200) < 60 * seconds(300)  # 16 times the pixels; caches and a busy machine


def timed(call):
    start = time.process_time()
    call()
    return time.process_time() - start


def test_the_default_needs_no_scikit_image():
    code = (
        "import sys, numpy as np, rangeedge; rangeedge.thinEdges(np.ones((9, 9), np.uint8));"
        "print('skimage' in sys.modules)"
    )
    root = str(Path(rangeedge.__file__).parents[1])
    run = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {root!r}); {code}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert run.stdout.strip() == "False"


@every_method
def test_degenerate_maps(method):
    assert not thinEdges(np.zeros((5, 7), np.uint8), method).any()
    dot = np.zeros((5, 7), np.uint8)
    dot[2, 3] = 255
    assert np.array_equal(thinEdges(dot, method), dot)
    assert thinEdges(np.ones((1, 1), np.uint8), method) == [[255]]
    full = thinEdges(np.full((9, 15), 255, np.uint8), method)
    assert topology(full) == (2, 2)
    assert np.count_nonzero(full) <= 15
    for line in (np.full((1, 9), 255, np.uint8), np.full((9, 1), 255, np.uint8)):
        assert np.array_equal(thinEdges(line, method), line)


# The call.


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


def test_defaults():
    edges = random_map(np.random.default_rng(8), "closed")
    assert np.array_equal(thinEdges(edges), thinEdges(edges, THIN_MEDIAL, spurLength=5))
    assert len({thinEdges(scene(6), method).tobytes() for method in METHODS.values()}) == len(METHODS)


def test_dst():
    edges = scene()
    expected = thinEdges(edges)
    dst = np.empty_like(edges)
    assert thinEdges(edges, dst=dst) is dst
    assert np.array_equal(dst, expected)
    assert thinEdges(edges, THIN_MEDIAL, edges) is edges
    assert np.array_equal(edges, expected)


@pytest.mark.parametrize(
    "edges",
    [None, [[1]], np.zeros((3, 3)), np.zeros((3, 3), np.int32), np.zeros(3, np.uint8), np.zeros((0, 3), np.uint8),
     np.zeros((3, 3, 3), np.uint8)],
)  # fmt: skip
def test_bad_edges(edges):
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`edges`"):
        thinEdges(edges)


@pytest.mark.parametrize("method", [-1, 4, 1.0, True, "lee", None])
def test_bad_method(method):
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`method`"):
        thinEdges(scene(), method)


@pytest.mark.parametrize("length", [-1, 2.0, True, None, 2**31])
def test_bad_spur_length(length):
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`spurLength`"):
        thinEdges(scene(), spurLength=length)


def test_bad_dst():
    dst = np.empty_like(scene())
    dst.flags.writeable = False
    with pytest.raises(rangeedge.error, match=r"thinEdges.*`dst`"):
        thinEdges(scene(), dst=dst)


def test_a_bar_of_more_layers_than_a_byte_counts():
    bar = np.zeros((560, 1300), np.uint8)
    bar[10:551, 10:1290] = 255
    middle = thinEdges(bar)[:, 300:1000]
    assert (middle[280] == 255).all()
    assert np.count_nonzero(middle) == middle.shape[1]
