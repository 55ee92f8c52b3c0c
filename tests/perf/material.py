"""Calls of every public function on large images: on an ordinary one, in all its forms, and on what costs it most."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import worst
from frames import lidar, room, terrain

import rangeedge as rr
from rangeedge import evaluation, synthetic

Call = Callable[[], Any]
GROUPS = ("depth", "forms", "maps", "lines", "regions", "pictures", "scores", "scenes", "read", "write", "worst")


def calls(group: str, side: int) -> dict[str, Callable[[], Call]]:
    """What prepares each call of a group on images of side x side pixels."""
    if group == "worst":
        images = worst.Images(side, side)
        return {f"{name}, {of}": make for name, cases in worst.functions().items() for of, make in cases(images)}
    return getattr(Ordinary(side), group)()


class Ordinary:
    """Functions on a room, heights and points; what one needs of another is computed when it is prepared."""

    def __init__(self, side: int) -> None:
        self.side = side

    @cached_property
    def frame(self) -> tuple[np.ndarray, dict[str, Any]]:
        src, geometry, _ = room(self.side, self.side)
        return src, geometry

    @cached_property
    def metres(self) -> np.ndarray:
        return (self.frame[0] / 1000).astype(np.float32)

    @cached_property
    def points(self) -> np.ndarray:
        return rr.backproject(self.frame[0], **self.frame[1]).astype(np.float32)

    @cached_property
    def noise(self) -> rr.NoiseModel:
        return rr.estimateNoise(self.frame[0], **self.frame[1])

    @cached_property
    def found(self) -> tuple[np.ndarray, rr.EdgeStrength]:
        return rr.detectEdgesWithStrength(self.frame[0], noise=self.noise, **self.frame[1])

    @property
    def edges(self) -> np.ndarray:
        return self.found[0]

    @cached_property
    def candidates(self) -> np.ndarray:
        return rr.selectEdges(self.found[1])

    @cached_property
    def distance(self) -> np.ndarray:
        return rr.distanceTransform(self.edges)

    @cached_property
    def salience(self) -> np.ndarray:
        jump, crease = (cv2.copyTo(image, self.edges) for image in (self.found[1].jump, self.found[1].crease))
        return rr.overallStrength(jump, crease, 0.1)

    @cached_property
    def seeds(self) -> np.ndarray:
        return rr.extractSeeds(self.distance)[1]

    @cached_property
    def labels(self) -> np.ndarray:
        return self.of_frame(rr.segmentRegions, edges=self.edges)()

    @cached_property
    def chains(self) -> rr.EdgeChains:
        return self.of_frame(rr.linkEdges)()

    @cached_property
    def segments(self) -> rr.Segments:
        return rr.fitSegments(self.chains)

    def of_frame(self, function: Callable[..., Any], *more: Any, told: bool = True, **options: Any) -> Call:
        noise = {"noise": self.noise} if told else {}
        return partial(function, self.frame[0], *more, **self.frame[1], **noise, **options)

    def depth(self) -> dict[str, Callable[[], Call]]:
        def plain(function: Callable[..., Any], **options: Any) -> Callable[[], Call]:
            return lambda: self.of_frame(function, **options)

        line = np.sin(np.arange(self.side**2) / 100)
        middle = self.side // 2
        return {
            "backproject": plain(rr.backproject, told=False),
            "project": lambda: partial(rr.project, self.points.astype(float), **self.frame[1]),
            "estimateNoise": plain(rr.estimateNoise, told=False),
            "splitScanLine": lambda: partial(rr.splitScanLine, line, 0.01),
            "edgeStrength": plain(rr.edgeStrength),
            "edgePoints": plain(rr.edgePoints),
            "flyingPixels": plain(rr.flyingPixels),
            "detectEdges": plain(rr.detectEdges),
            "detectEdges, noise estimated": plain(rr.detectEdges, told=False),
            "detectEdgesWithStrength": plain(rr.detectEdgesWithStrength),
            "ScanLineDetector.detect": lambda: partial(
                rr.createScanLineDetector(rr.ScanLineParams(**self.frame[1])).detect, self.frame[0]
            ),
            "explainPixel": lambda: self.of_frame(rr.explainPixel, middle, middle),
            "cleanDepth": plain(rr.cleanDepth),
        }

    def forms(self) -> dict[str, Callable[[], Call]]:
        """One function on every form of a range image."""
        side = self.side
        mask = np.ones((side, side), np.uint8)
        heights = {"heightMap": True, "pixelSize": 0.5}

        def detecting(src: Callable[[], np.ndarray], **options: Any) -> Callable[[], Call]:
            return lambda: partial(rr.segmentRegionsWithStats, src(), **options)

        def masked() -> np.ndarray:
            return np.ma.masked_less(self.metres, 1.5)

        def around() -> np.ndarray:
            return lidar(side // 4, 4 * side).src

        sweep = np.linspace(0.4, -0.4, side)
        return {
            "points": detecting(lambda: self.points),
            "points, double": detecting(lambda: self.points.astype(float)),
            "points, origin": detecting(lambda: self.points + np.float32(1), origin=(1.0, 1.0, 1.0)),
            "points, turned": detecting(lambda: np.ascontiguousarray(self.points[..., ::-1])),
            "points all around": detecting(around),
            "points of four columns": detecting(lambda: np.dstack([self.points, self.metres])),
            "depth, lens": detecting(lambda: self.metres, distCoeffs=(0.1, 0, 0, 0), **self.frame[1]),
            "depth, double, masked": detecting(lambda: self.metres.astype(float), mask=mask, **self.frame[1]),
            "depth, int32": detecting(lambda: self.frame[0].astype(np.int32), **self.frame[1]),
            "depth, invalid": detecting(lambda: self.metres, invalid=(0, (3.9, 4.0)), **self.frame[1]),
            "depth, masked array": detecting(masked, **self.frame[1]),
            "depth, no geometry": detecting(lambda: self.metres),
            "heights": detecting(lambda: terrain(side).src, **heights),
            "heights, double": detecting(lambda: terrain(side).src.astype(float), **heights),
            "heights, int16": detecting(lambda: terrain(side).src.astype(np.int16), **heights, depthFactor=1),
            "map of noise": detecting(lambda: self.metres, noise=np.full((side, side), 0.01), **self.frame[1]),
            "sweepToPoints": lambda: partial(rr.sweepToPoints, self.metres, sweep),
        }

    def maps(self) -> dict[str, Callable[[], Call]]:
        thin = {"skeleton": rr.THIN_SKELETON, "Lee": rr.THIN_LEE, "iterative": rr.THIN_ITERATIVE}
        thin["medial"] = rr.THIN_MEDIAL
        strength = lambda: self.found[1]  # noqa: E731
        return {
            "kindNames": lambda: partial(rr.kindNames, int(strength().kind.max())),
            "strengthImage": lambda: partial(rr.strengthImage, strength().jump, 0.1),
            "overallStrength": lambda: partial(rr.overallStrength, strength().jump, strength().crease, 0.1),
            "selectEdges": lambda: partial(rr.selectEdges, strength()),
            "selectEdges, dynamic": lambda: partial(
                rr.selectEdges, strength().jump, strength().crease, 0.05, dynamic=True
            ),
            "selectEdges, long ones": lambda: partial(rr.selectEdges, strength(), minLength=10),
            **{
                f"thinEdges, {name}": lambda method=method: partial(rr.thinEdges, self.candidates, method)
                for name, method in thin.items()
            },
            "distanceTransform": lambda: partial(rr.distanceTransform, self.edges),
            "distanceTransform, bool": lambda: partial(rr.distanceTransform, self.edges > 0),
            "distanceTransformWithLabels": lambda: partial(rr.distanceTransformWithLabels, self.edges),
            "distanceTransform, barrier": lambda: partial(
                rr.distanceTransform, self.edges, barrier=(self.distance == 9).view(np.uint8)
            ),
            "salienceDistanceTransform": lambda: partial(rr.salienceDistanceTransform, self.salience),
            "salienceDistanceTransform, additive": lambda: partial(
                rr.salienceDistanceTransformWithLabels, self.salience, rr.SALIENCE_ADDITIVE
            ),
            "extractSeeds": lambda: partial(rr.extractSeeds, self.distance),
            "extractSeedsWithStats": lambda: partial(rr.extractSeedsWithStats, self.distance),
            "closeContours": lambda: partial(
                rr.closeContours, self.edges, self.frame[0], noise=self.noise, **self.frame[1]
            ),
        }

    def lines(self) -> dict[str, Callable[[], Call]]:
        return {
            "linkEdges": lambda: self.of_frame(rr.linkEdges),
            "fitSegments": lambda: partial(rr.fitSegments, self.chains),
            "fitArcs": lambda: partial(rr.fitArcs, self.chains),
            "toLines": lambda: partial(rr.toLines, self.chains),
            **{
                f"writeLines {suffix}": lambda suffix=suffix: partial(
                    rr.writeLines, os.path.join(tempfile.mkdtemp(), f"lines{suffix}"), self.chains
                )
                for suffix in (".csv", ".ply", ".obj", ".dxf", ".svg", ".geojson")
            },
            **{
                f"readLines {suffix}": lambda suffix=suffix: partial(rr.readLines, self._lines_file(suffix))
                for suffix in (".csv", ".ply", ".dxf", ".svg", ".geojson")
            },
        }

    def _lines_file(self, suffix: str) -> str:
        name = os.path.join(tempfile.mkdtemp(), f"lines{suffix}")
        rr.writeLines(name, self.chains)
        return name

    def regions(self) -> dict[str, Callable[[], Call]]:
        return {
            "growRegions": lambda: self.of_frame(rr.growRegions, self.seeds, edges=self.edges),
            "growRegionsWithStats": lambda: self.of_frame(rr.growRegionsWithStats, self.seeds, edges=self.edges),
            "segmentRegions": lambda: self.of_frame(rr.segmentRegions),
            "segmentRegionsWithStats": lambda: self.of_frame(rr.segmentRegionsWithStats),
            "regionBoundaries": lambda: partial(rr.regionBoundaries, self.labels),
            "regionBoundaries in space": lambda: partial(
                rr.regionBoundaries, self.labels, self.frame[0], **self.frame[1]
            ),
            "regionBoundaries of points": lambda: partial(rr.regionBoundaries, self.labels, self.points),
            "regionAdjacency": lambda: self.of_frame(rr.regionAdjacency, self.labels),
            "regionCorners": lambda: self.of_frame(rr.regionCorners, self.labels, told=False),
            "regionAdjacency of points": lambda: partial(rr.regionAdjacency, self.points, self.labels),
            "cleanDepth of points": lambda: partial(rr.cleanDepth, self.points),
        }

    def pictures(self) -> dict[str, Callable[[], Call]]:
        def drawn(function: Callable[..., Any], *more: Any, **options: Any) -> Call:
            return partial(function, self.frame[0], *more, **self.frame[1], **options)

        def bounds() -> rr.RegionBoundaries:
            return rr.regionBoundaries(self.labels)

        middle = self.side // 2
        return {
            "drawEdges": lambda: drawn(rr.drawEdges, self.edges, self.found[1].kind),
            "drawChains": lambda: drawn(rr.drawChains, self.chains),
            "drawSegments": lambda: drawn(rr.drawSegments, self.segments.segments, self.segments.vertices),
            "drawArcs": lambda: drawn(rr.drawArcs, rr.fitArcs(self.chains)),
            "drawRegions": lambda: partial(rr.drawRegions, self.labels, self.frame[0], **self.frame[1]),
            "drawBoundaries": lambda: drawn(rr.drawBoundaries, bounds()),
            "colorizeDistance": lambda: partial(rr.colorizeDistance, self.distance),
            "drawOverview": lambda: drawn(rr.drawOverview, self.found[1], self.edges, self.distance),
            "drawPanels": lambda: partial(rr.drawPanels, [("a", np.dstack([self.edges] * 3))] * 2),
            "drawExplanation": lambda: partial(rr.drawExplanation, self.of_frame(rr.explainPixel, middle, middle)()),
        }

    def scores(self) -> dict[str, Callable[[], Call]]:
        def edges(**more: Any) -> Call:
            truth = np.where(np.roll(self.edges, 1, 0) > 0, np.uint8(evaluation.TRUTH_JUMP), np.uint8(0))
            return partial(evaluation.evaluateEdges, self.edges, truth, **more)

        other = lambda: np.roll(self.edges, 1, 0)  # noqa: E731
        return {
            "evaluateEdges": edges,
            "evaluateEdges, kinds": lambda: edges(kind=self.found[1].kind),
            "prattFOM": lambda: partial(evaluation.prattFOM, self.edges, other()),
            "baddeleyDelta": lambda: partial(evaluation.baddeleyDelta, self.edges, other()),
            "hooverScores": lambda: partial(evaluation.hooverScores, self.labels, np.roll(self.labels, 1, 0)),
        }

    def scenes(self) -> dict[str, Callable[[], Call]]:
        side = self.side
        camera = synthetic.pinholeCamera(np.array([[side, 0, side / 2], [0, side, side / 2], [0, 0, 1]]), (side, side))
        seen = lambda: synthetic.renderScene(synthetic.demoScene(), camera)  # noqa: E731
        return {
            "renderScene": lambda: seen,
            "gaussianNoise": lambda: partial(synthetic.gaussianNoise, seen(), 0.01),
            "kinectNoise": lambda: partial(synthetic.kinectNoise, seen()),
            "triangulationNoise": lambda: partial(synthetic.triangulationNoise, seen(), 0.01),
        }

    def read(self) -> dict[str, Callable[[], Call]]:
        return {
            f"imreadRange {name}": lambda name=name: partial(rr.imreadRange, self._range_file(name))
            for name in (
                *("depth.png", "depth.tif", "heights.tif", "heights.exr", "depth.pgm", "text.pgm", "heights.pfm"),
                *("depth.npy", "depth.npz", "points.pcd", "text.pcd", "points.ply", "text.ply"),
                *("heights.asc", "packed.tif", "predicted.tif"),
            )
        }

    def _range_file(self, name: str) -> str:
        path = Path(tempfile.mkdtemp(), name)
        kind, suffix = name.split(".")
        text = "\n".join
        if kind in ("depth", "heights", "points"):
            rr_write = partial(rr.imwriteRange, str(path))
            if suffix == "asc":
                rows = (" ".join(f"{value:.3f}" for value in row) for row in self.metres.tolist())
                head = f"ncols {self.side}\nnrows {self.side}\nxllcorner 0\nyllcorner 0\ncellsize 1\n"
                path.write_text(head + text(rows))
            else:
                rr_write({"depth": self.frame[0], "heights": self.metres, "points": self.points}[kind])
        elif kind == "text" and suffix == "pgm":
            rows = (" ".join(map(str, row)) for row in self.frame[0].tolist())
            path.write_text(f"P2\n{self.side} {self.side}\n65535\n{text(rows)}")
        elif kind == "text":
            xyz = (f"{x:.3f} {y:.3f} {z:.3f}" for x, y, z in self.points.reshape(-1, 3).tolist())
            count = self.side**2
            heads = {
                "pcd": "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
                f"WIDTH {self.side}\nHEIGHT {self.side}\nPOINTS {count}\nDATA ascii\n",
                "ply": f"ply\nformat ascii 1.0\nobj_info num_cols {self.side}\nobj_info num_rows {self.side}\n"
                f"element vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
            }
            with path.open("w") as file:
                file.write(heads[suffix])
                file.writelines(line + "\n" for line in xyz)
        elif suffix == "tif":
            import tifffile

            tifffile.imwrite(path, self.frame[0], compression={"packed": "lzw", "predicted": "zlib"}[kind])
        else:
            raise ValueError(f"no {name} here")
        return str(path)

    def write(self) -> dict[str, Callable[[], Call]]:
        def written(suffix: str, src: np.ndarray) -> Call:
            return partial(rr.imwriteRange, os.path.join(tempfile.mkdtemp(), f"image{suffix}"), src)

        return {
            **{f"imwriteRange {s}": lambda s=s: written(s, self.frame[0]) for s in (".png", ".pgm", ".tif", ".npy")},
            **{f"imwriteRange {s}": lambda s=s: written(s, self.metres) for s in (".exr", ".pfm", ".npz")},
            **{f"imwriteRange {s}": lambda s=s: written(s, self.points) for s in (".pcd", ".ply")},
        }
