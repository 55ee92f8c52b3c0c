"""Pictures of range images, edges, regions and distances: BGR, as ``cv2.imwrite`` and ``cv2.imshow`` expect them.

All colours tell apart for the usual forms of colour blindness: edges after Okabe and Ito, regions after Tol.
"""

from __future__ import annotations

from collections import defaultdict

import cv2
import numpy as np

from . import _check
from .constants import EDGE_BOUNDARY, EDGE_CONCAVE, EDGE_CONVEX, EDGE_JUMP, EDGE_OCCLUDED
from .frame import read_frame
from .options import ScanLineParams
from .selection import strengthImage

_PLAIN = (255, 255, 255)  # an edge of no known kind
KINDS = (  # later entries hide earlier ones
    (EDGE_BOUNDARY, (150, 150, 150), "beside no data"),
    (EDGE_CONCAVE, (233, 180, 86), "concave"),
    (EDGE_CONVEX, (66, 228, 240), "convex"),
    (EDGE_JUMP, (0, 94, 213), "jump, near side"),
    (EDGE_OCCLUDED, (167, 121, 204), "jump, far side"),
)
_EDGE_COLOURS = np.array([(0, 0, 0), _PLAIN, *(colour for _, colour, _ in KINDS)], np.uint8)
_REGIONS = np.array(  # Tol's muted scheme
    [
        (238, 204, 136), (119, 102, 204), (119, 204, 221), (51, 119, 17), (136, 34, 51),
        (153, 68, 170), (153, 170, 68), (51, 153, 153), (85, 34, 136),
    ],
    np.uint8,
)  # fmt: skip
_UNREACHED = (128, 128, 128)  # infinitely far from every edge
_BACKGROUND = (32, 32, 32)
_INK = (235, 235, 235)
_FONT, _FONT_SCALE, _BAR = cv2.FONT_HERSHEY_SIMPLEX, 0.55, 28
_PANEL_MIN, _PANEL_MAX = 320, 640  # longer side of a panel in pixels


@_check.public
def drawEdges(
    src: np.ndarray,
    edges: np.ndarray,
    kind: np.ndarray | None = None,
    dst: np.ndarray | None = None,
    *,
    K: np.ndarray | None = None,
    heightMap: bool = False,
) -> np.ndarray:
    """Draw edges over the shaded relief of a range image, or over a picture.

    drawEdges(src, edges[, kind[, dst]], *[, K[, heightMap]]) -> dst

    With `kind`: jump vermilion on the near side and purple on the far side, convex yellow, concave blue, beside no data
    grey, anything else white; a jump hides a crease. Without it every edge is white. Pixels without data are hatched.

    Parameters
    ----------
    src : ndarray
        A range image (H, W), points (H, W, 3) or (H, W, 4) of floats, or a CV_8UC3 picture to draw on.
    edges : ndarray of shape (H, W), CV_8U or bool
        Edge map, non-zero on edges.
    kind : ndarray of shape (H, W), CV_8U, optional
        Bits `EDGE_JUMP`, `EDGE_CONVEX`, ... of every pixel, as :func:`edgeStrength` returns them.
    dst : ndarray of shape (H, W, 3), CV_8U, optional
        Receives the result where shape and type fit; it may be `src` itself.
    K, heightMap
        Geometry of a range image, as for :func:`edgeStrength`: a camera matrix makes 0 and negative values no data,
        `heightMap` makes larger values nearer.

    Returns
    -------
    dst : ndarray of shape (H, W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If an image has a wrong type or shape, or shapes differ.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawEdges
    >>> depth, edges = np.ones((4, 6), np.float32), np.zeros((4, 6), np.uint8)
    >>> edges[:, 2] = 255
    >>> drawEdges(depth, edges)[0, 2]
    array([255, 255, 255], dtype=uint8)
    """
    canvas = backdrop(src, K, heightMap)
    edges = _check.image8("edges", edges, canvas.shape[:2])
    kind = None if kind is None else _check.image8("kind", kind, edges.shape)
    _paint(canvas, _colour_index(edges != 0, kind))
    return _check.deliver("dst", canvas, dst)


@_check.public
def drawRegions(
    labels: np.ndarray,
    src: np.ndarray | None = None,
    alpha: float = 0.6,
    dst: np.ndarray | None = None,
    *,
    K: np.ndarray | None = None,
    heightMap: bool = False,
) -> np.ndarray:
    """Draw every region in a colour of its own among its neighbours.

    drawRegions(labels[, src[, alpha[, dst]]], *[, K[, heightMap]]) -> dst

    Nine colours are shared out so that regions next to each other, or across a gap without label, differ.

    Parameters
    ----------
    labels : ndarray of shape (H, W), CV_32S
        Region of every pixel; 0 and negative values are none.
    src : ndarray, optional
        Range image, points, or CV_8UC3 picture to draw on; black without it.
    alpha : float
        Opacity of the regions over `src`, in [0, 1]. Without `src` they are opaque.
    dst : ndarray of shape (H, W, 3), CV_8U, optional
        Receives the result where shape and type fit.
    K, heightMap
        As for :func:`drawEdges`.

    Returns
    -------
    dst : ndarray of shape (H, W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If an image has a wrong type or shape, shapes differ, or `alpha` is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawRegions
    >>> drawRegions(np.int32([[0, 1, 2, 1]]))[0]
    array([[  0,   0,   0],
           [238, 204, 136],
           [119, 102, 204],
           [238, 204, 136]], dtype=uint8)
    """
    labels = _check.labels32s("labels", labels, listed=True)
    alpha = _check.number("alpha", alpha, 0, 1)
    if src is None:
        canvas, alpha = np.zeros((*labels.shape, 3), np.uint8), 1.0
    else:
        canvas = backdrop(src, K, heightMap, labels.shape)
    inside = labels > 0
    if inside.any():
        colours = _region_colours(labels, inside)
        canvas[inside] = np.rint(alpha * colours + (1 - alpha) * canvas[inside])
    return _check.deliver("dst", canvas, dst)


@_check.public
def colorizeDistance(
    distance: np.ndarray, dst: np.ndarray | None = None, *, maxDistance: float | None = None, log: bool = False
) -> np.ndarray:
    """Colour a distance map from black at the edges to pale yellow far from them.

    colorizeDistance(distance[, dst], *[, maxDistance[, log]]) -> dst

    The colour map is ``cv2.COLORMAP_INFERNO`` over distance / maxDistance, or over
    log(1 + distance) / log(1 + maxDistance), which brings out the neighbourhood of edges. Infinite distances,
    as in a map without edges, are grey.

    Parameters
    ----------
    distance : ndarray of shape (H, W), CV_32F or any real type
        Distances >= 0; infinity is allowed.
    dst : ndarray of shape (H, W, 3), CV_8U, optional
        Receives the result where shape and type fit.
    maxDistance : float, optional
        Distance from which on the last colour holds, > 0; by default the largest finite one of `distance`.
    log : bool
        Whether the scale is logarithmic, as Rosin and West show theirs.

    Returns
    -------
    dst : ndarray of shape (H, W, 3), CV_8U

    Raises
    ------
    rangeedge.error
        If `distance` is not a real (H, W) image or holds NaN or a negative value, or if `maxDistance` is not a
        finite number > 0.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import colorizeDistance
    >>> colorizeDistance(np.float32([[0, 1, np.inf]]))[0]
    array([[  4,   0,   0],
           [164, 255, 252],
           [128, 128, 128]], dtype=uint8)
    """
    distance = _distance(distance)
    if maxDistance is not None:
        maxDistance = _check.number("maxDistance", maxDistance, 0, above=True)
    log = _check.boolean("log", log)
    return _check.deliver("dst", _distance_colours(distance, maxDistance, log), dst)


@_check.public
def drawOverview(
    src: np.ndarray,
    strength: tuple[np.ndarray, ...],
    edges: np.ndarray,
    distance: np.ndarray | None = None,
    *,
    title: str | None = None,
    jumpCut: float | None = None,
    creaseCut: float = 64.0,
    K: np.ndarray | None = None,
    heightMap: bool = False,
) -> np.ndarray:
    """Show a range image and what was found in it in one labelled picture.

    drawOverview(src, strength, edges[, distance], *[, title[, jumpCut[, creaseCut[, K[, heightMap]]]]]) -> retval

    The panels: shaded relief, strength of jump and of crease, the kinds of all candidates, the selected edges over
    the relief, and the distance map; below them the key to the colours.

    Parameters
    ----------
    src : ndarray
        Range image (H, W), or points (H, W, 3) or (H, W, 4) of floats.
    strength : EdgeStrength
        What :func:`edgeStrength` returns: jump, crease, kind and significance, each (H, W).
    edges : ndarray of shape (H, W), CV_8U or bool
        Selected edges, non-zero on edges.
    distance : ndarray of shape (H, W), CV_32F, optional
        Distance map; without it that panel is left out.
    title : str, optional
        A line above the panels.
    jumpCut, creaseCut : float
        Strengths shown white, > 0; by default the median jump, and 64 degrees.
    K, heightMap
        As for :func:`drawEdges`.

    Returns
    -------
    retval : ndarray of shape (h, w, 3), CV_8U
        Large enough to read at its own size, whatever the size of `src`.

    Raises
    ------
    rangeedge.error
        If an image has a wrong type or shape, or shapes differ.

    Examples
    --------
    >>> import numpy as np
    >>> from rangeedge import drawOverview
    >>> depth, none = np.ones((48, 64), np.float32), np.zeros((48, 64), np.float32)
    >>> kind = np.zeros((48, 64), np.uint8)
    >>> drawOverview(depth, (none, none, kind, none), kind).dtype
    dtype('uint8')
    """
    depth = read_frame(src, ScanLineParams(K=K, heightMap=heightMap)).depth
    jump, crease, kind = _strength(strength, depth.shape)
    edges = _check.image8("edges", edges, depth.shape) != 0
    if distance is not None:
        distance = _distance(distance, depth.shape)
    if title is not None and not isinstance(title, str):
        raise _check.fail("title", "a string or None", type(title).__name__)
    if jumpCut is None:
        jumpCut = float(np.median(jump[jump > 0])) if jump.any() else 1.0
    jumpCut = _check.number("jumpCut", jumpCut, 0, above=True)
    creaseCut = _check.number("creaseCut", creaseCut, 0, above=True)

    size = _panel_size(depth.shape)
    relief = _resized(_relief(depth), size)
    black = np.zeros_like(relief)
    panels = [
        (_depth_caption(depth, heightMap), relief),
        (f"Jump strength, white from {jumpCut:.3g}", _grey(jump, jumpCut, size)),
        (f"Crease strength, white from {creaseCut:.3g} deg", _grey(crease, creaseCut, size)),
        ("Kinds of all candidates", _paint(black, _thick(_colour_index(kind != 0, kind), size))),
        ("Selected edges", _paint(_subdued(relief), _thick(_colour_index(edges, kind), size))),
    ]
    if distance is not None:
        caption, picture = _distance_panel(distance, np.isfinite(depth))
        panels.append((caption, _resized(picture, size)))
    return _sheet(panels, title)


def region_overview(
    surface: np.ndarray,
    seeds: np.ndarray,
    edges: np.ndarray,
    kind: np.ndarray,
    labels: np.ndarray,
    *,
    title: str,
    heightMap: bool = False,
) -> np.ndarray:
    """Range image, edges, seeds and regions in one labelled picture, after the manner of `drawOverview`."""
    depth = read_frame(surface, ScanLineParams(heightMap=heightMap)).depth
    size = _panel_size(depth.shape)
    relief = _resized(_relief(depth), size)
    seeds, regions = (_resized(drawRegions(part, _subdued(_relief(depth)), 0.8), size) for part in (seeds, labels))
    thin = _thick(_colour_index(edges != 0, kind), size)
    panels = [
        (_depth_caption(depth, heightMap), relief),
        ("Edges", _paint(_subdued(relief), thin)),
        ("Seeds", seeds),
        (f"{len(np.unique(labels[labels > 0]))} regions", regions),
    ]
    return _sheet(panels, title)


def backdrop(
    src: np.ndarray, K: np.ndarray | None, heightMap: bool, shape: tuple[int, int] | None = None
) -> np.ndarray:
    """A new picture to draw on: the one given, or the subdued relief of a range image."""
    if isinstance(src, np.ndarray) and src.dtype == np.uint8 and src.ndim == 3 and src.shape[2] == 3 and src.size:
        picture = src.copy()
    else:
        picture = _subdued(_relief(read_frame(src, ScanLineParams(K=K, heightMap=heightMap)).depth))
    if shape is not None and picture.shape[:2] != shape:
        raise _check.fail("src", f"of shape {shape}", _check.described(src), cv2.Error.StsUnmatchedSizes)
    return picture


def _distance(distance: np.ndarray, shape: tuple[int, int] | None = None) -> np.ndarray:
    distance = _check.image32f("distance", distance, shape)
    if not distance.min() >= 0:  # NaN fails the comparison too
        raise _check.fail("distance", ">= 0 everywhere", f"a least value of {distance.min():g}")
    return distance


def _strength(strength: tuple[np.ndarray, ...], shape: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """Jump, crease and kind out of an EdgeStrength."""
    if not isinstance(strength, tuple) or len(strength) != 4:
        raise _check.fail("strength", "an EdgeStrength (jump, crease, kind, significance)", type(strength).__name__)
    jump, crease, kind, _ = strength
    return (
        _check.strength32f("strength.jump", jump, shape),
        _check.strength32f("strength.crease", crease, shape),
        _check.image8("strength.kind", kind, shape),
    )


def _relief(depth: np.ndarray) -> np.ndarray:
    """Depth as colour, near bright and far dark, under light from the upper left; hatched without data."""
    valid = np.isfinite(depth)
    if not valid.any():
        return _hatch(depth.shape)
    low, high = np.percentile(depth[valid], (1, 99))
    depth = _filled(depth, valid)
    level = np.clip((high - depth) / (high - low), 0, 1) if high > low else np.full(depth.shape, 0.5)
    colour = cv2.applyColorMap(np.rint(255 * level).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
    picture = np.rint(colour * _shade(depth, valid)[..., np.newaxis]).astype(np.uint8)
    return np.where(valid[..., np.newaxis], picture, _hatch(depth.shape))


def _shade(depth: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Light that a surface of this depth reflects, in [0.25, 1]; steepness relative to the image's own slopes."""
    smooth = cv2.GaussianBlur(depth.astype(np.float32), (0, 0), 1.5)
    dx, dy = cv2.Scharr(smooth, cv2.CV_32F, 1, 0), cv2.Scharr(smooth, cv2.CV_32F, 0, 1)
    slope = np.hypot(dx, dy)
    typical = 2 * np.percentile(slope[valid], 75) or 1.0
    cosine = (0.52 * typical - 0.6 * dx - 0.6 * dy) / np.hypot(slope, typical)
    return np.clip(0.3 + 0.75 * cosine, 0.25, 1)


def _filled(depth: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Depth with every gap filled from the nearest valid pixel."""
    return depth[valid][_nearest(valid)]


def _nearest(inside: np.ndarray) -> np.ndarray:
    """For every pixel, which of the pixels inside, counted row by row, is nearest."""
    _, labels = cv2.distanceTransformWithLabels(
        (~inside).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    rank = np.zeros(labels.max() + 1, np.intp)
    rank[labels[inside]] = np.arange(np.count_nonzero(inside))
    return rank[labels]


def _hatch(shape: tuple[int, int]) -> np.ndarray:
    row, col = np.ogrid[: shape[0], : shape[1]]
    return np.where(((row + col) % 8 < 2)[..., np.newaxis], np.uint8(72), np.uint8(36)).repeat(3, axis=2)


def _subdued(picture: np.ndarray) -> np.ndarray:
    """Darker and nearly grey, so that what is drawn on it stands out."""
    grey = cv2.cvtColor(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return cv2.addWeighted(picture, 0.15, grey, 0.5, 0)


def _colour_index(edges: np.ndarray, kind: np.ndarray | None) -> np.ndarray:
    """Index into the colours of edges; 0 is no edge, and the larger one hides the smaller."""
    index = edges.astype(np.uint8)
    if kind is not None:
        for i, (bit, _, _) in enumerate(KINDS, start=2):
            index[edges & (kind & bit != 0)] = i
    return index


def _paint(canvas: np.ndarray, index: np.ndarray) -> np.ndarray:
    canvas[index > 0] = _EDGE_COLOURS[index[index > 0]]
    return canvas


def _region_colours(labels: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Colour of every pixel inside a region."""
    names, region = np.unique(labels[inside], return_inverse=True)
    region = region.reshape(-1)
    choice = _shared_out(names, _neighbours(region[_nearest(inside)]))
    return _REGIONS[choice[region]]


def _neighbours(region: np.ndarray) -> dict[int, set[int]]:
    """Which regions touch, 8-connected, in a map that regions fill."""
    neighbours = defaultdict(set)
    for a, b in (
        (region[:, 1:], region[:, :-1]),
        (region[1:], region[:-1]),
        (region[1:, 1:], region[:-1, :-1]),
        (region[1:, :-1], region[:-1, 1:]),
    ):
        differ = a != b
        pairs = np.unique(a[differ] * (region.max() + 1) + b[differ])
        for i, j in zip(*(part.tolist() for part in np.divmod(pairs, region.max() + 1)), strict=True):
            neighbours[i].add(j)
            neighbours[j].add(i)
    return neighbours


def _shared_out(names: np.ndarray, neighbours: dict[int, set[int]]) -> np.ndarray:
    """Colour number of each region: its own by label, or else the next that no coloured neighbour has."""
    choice = np.empty(len(names), np.intp)
    for i, name in enumerate(names.tolist()):
        taken = {choice[j] for j in neighbours[i] if j < i}
        own = [(name - 1 + k) % len(_REGIONS) for k in range(len(_REGIONS))]
        choice[i] = next((c for c in own if c not in taken), own[0])
    return choice


def _distance_colours(distance: np.ndarray, maxDistance: float | None, log: bool) -> np.ndarray:
    finite = np.isfinite(distance)
    if maxDistance is None:
        maxDistance = float(distance[finite].max(initial=0)) or 1.0
    scaled = np.where(finite, np.minimum(distance, maxDistance), 0) / maxDistance
    if log:
        scaled = np.log1p(scaled * maxDistance) / np.log1p(maxDistance)
    colours = cv2.applyColorMap(np.rint(255 * scaled).astype(np.uint8), cv2.COLORMAP_INFERNO)
    colours[~finite] = _UNREACHED
    return colours


def _grey(strength: np.ndarray, cut: float, size: tuple[int, int]) -> np.ndarray:
    return cv2.cvtColor(_thick(strengthImage(strength, cut), size), cv2.COLOR_GRAY2BGR)


def _panel_size(shape: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a panel: whole multiples of a small image, a large one reduced, a panorama less so."""
    longer = max(shape)
    limit = _PANEL_MAX * np.clip(shape[1] / shape[0] / 2, 1, 3)
    scale = min(limit / longer, -(-_PANEL_MIN // longer))
    return max(round(shape[1] * scale), 1), max(round(shape[0] * scale), 1)


def _resized(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    smaller = size[0] < picture.shape[1]
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA if smaller else cv2.INTER_NEAREST)


def _thick(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Resized so that lines one pixel wide survive: the largest value that falls on a pixel."""
    step = -(-image.shape[1] // size[0])
    return cv2.resize(cv2.dilate(image, np.ones((step, step), np.uint8)), size, interpolation=cv2.INTER_NEAREST)


def _depth_caption(depth: np.ndarray, heightMap: bool) -> str:
    name, sign = ("Height", -1) if heightMap else ("Depth", 1)
    values = sign * depth[np.isfinite(depth)]
    if not values.size:
        return f"{name}: no data"
    return f"{name} {values.min():.4g} to {values.max():.4g}, {100 * values.size / depth.size:.0f} % valid"


def _distance_panel(distance: np.ndarray, valid: np.ndarray) -> tuple[str, np.ndarray]:
    """Distances on surfaces, with a scale of their own; hatched without data."""
    finite = distance[valid & np.isfinite(distance)]
    longest = float(finite.max(initial=0))
    colours = _distance_colours(distance, longest or None, False)
    caption = f"Distance to the edges, up to {longest:.3g}" if finite.size else "Distance: no edges"
    return caption, np.where(valid[..., np.newaxis], colours, _hatch(valid.shape))


def _sheet(panels: list[tuple[str, np.ndarray]], title: str | None) -> np.ndarray:
    """Captioned panels in a grid near 16:9, a title above and the key to the colours below."""
    height, width = panels[0][1].shape[:2]
    width = max(width, *(_text_width(caption) for caption, _ in panels))
    cells = [_cell(caption, picture, width) for caption, picture in panels]
    height, width = cells[0].shape[:2]
    columns = min(
        (1, 2, 4) if len(cells) == 4 else (1, 2, 3, 6),
        key=lambda n: abs(np.log(n * width / (-(-len(cells) // n) * height) * 9 / 16)),
    )
    cells += [np.full_like(cells[0], _BACKGROUND)] * (-len(cells) % columns)
    rows = [np.hstack(cells[i : i + columns]) for i in range(0, len(cells), columns)]
    top = [] if title is None else [_bar(title, rows[0].shape[1])]
    return np.vstack([*top, *rows, _key(rows[0].shape[1])])


def _cell(caption: str, picture: np.ndarray, width: int) -> np.ndarray:
    """A picture under its caption, with a margin to the right and below."""
    cell = np.full((_BAR + picture.shape[0] + 4, width + 4, 3), _BACKGROUND, np.uint8)
    cell[:_BAR] = _bar(caption, width + 4)
    cell[_BAR : _BAR + picture.shape[0], : picture.shape[1]] = picture
    return cell


def _bar(text: str, width: int) -> np.ndarray:
    bar = np.full((_BAR, width, 3), _BACKGROUND, np.uint8)
    text = text.encode("utf-8", "replace").decode()  # names of files may hold what OpenCV 5 does not survive
    return cv2.putText(bar, text, (6, _BAR - 9), _FONT, _FONT_SCALE, _INK, 1, cv2.LINE_AA)


def _text_width(text: str) -> int:
    return cv2.getTextSize(text, _FONT, _FONT_SCALE, 1)[0][0] + 12


def _key(width: int) -> np.ndarray:
    """The colours of edges with their meaning, on as many lines as they need."""
    lines, x = [_bar("", width)], 6
    for colour, text in [*((colour, text) for _, colour, text in reversed(KINDS)), (_PLAIN, "other")]:
        needed = _text_width(text) + 24
        if x > 6 and x + needed > width:
            lines.append(_bar("", width))
            x = 6
        cv2.rectangle(lines[-1], (x, 7), (x + 14, 21), colour, cv2.FILLED)
        cv2.putText(lines[-1], text, (x + 22, _BAR - 9), _FONT, _FONT_SCALE, _INK, 1, cv2.LINE_AA)
        x += needed
    return np.vstack(lines)
