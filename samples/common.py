"""What the samples share: their arguments, the built-in scene, and pictures side by side."""

import argparse
from functools import cache
from pathlib import Path

import cv2
import numpy as np

import rangeedge
from rangeedge.synthetic import demoScene, kinectCamera, kinectNoise, renderScene


def parser(doc):
    """Arguments of a sample: an image with its geometry, and where to write."""
    arguments = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("image", nargs="?", help="range image; default: a built-in scene")
    geometry = arguments.add_mutually_exclusive_group()
    geometry.add_argument("-K", metavar="fx,fy,cx,cy", help="pinhole camera")
    geometry.add_argument("--pixel-size", type=float, metavar="D", help="spacing of a regular grid")
    arguments.add_argument("--height-map", action="store_true", help="larger values are nearer")
    arguments.add_argument("--out", type=Path, default=Path("out"), help="folder for the pictures (default: out)")
    return arguments


def load(args):
    """The range image, and its geometry as keywords of the functions that take it."""
    if args.image is None:
        return built_in_scene()
    given = {}
    if args.K is not None:
        fx, fy, cx, cy = map(float, args.K.split(","))
        given["K"] = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    if args.pixel_size is not None:
        given["pixelSize"] = args.pixel_size
    if args.height_map:
        given["heightMap"] = True
    return rangeedge.imreadRange(args.image).withGeometry(**given)


@cache
def built_in_scene():
    """Boxes, a roof and curved solids on a table, as a Kinect would see them."""
    scan = kinectNoise(renderScene(demoScene(), kinectCamera()))
    return scan.src, scan.geometry


def gaps(src, geometry):
    """8-bit map of where there is no data, apart from single pixels: surfaces end there as they do at edges."""
    depth = src if src.ndim == 2 else src[..., 2]
    missing = ~np.isfinite(depth)
    if depth.dtype.kind == "u" or "K" in geometry:
        missing |= depth == 0
    return cv2.morphologyEx(255 * missing.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))


def relief(src, geometry):
    """The range image as a shaded picture to draw on."""
    nothing = np.zeros(src.shape[:2], np.uint8)
    view = {name: geometry[name] for name in ("K", "heightMap") if name in geometry}
    return rangeedge.drawEdges(src, nothing, **view)


def sheet(*panels, columns=2):
    """Pictures of one size in a grid, each under its title."""
    cells = []
    for title, picture in panels:
        if picture.ndim == 2:
            picture = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
        bar = np.full((30, picture.shape[1], 3), 32, np.uint8)
        cv2.putText(bar, title, (6, 21), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (235, 235, 235), 1, cv2.LINE_AA)
        cells.append(cv2.copyMakeBorder(np.vstack([bar, picture]), 0, 4, 0, 4, cv2.BORDER_CONSTANT, value=(32, 32, 32)))
    cells += [np.full_like(cells[0], 32)] * (-len(cells) % columns)
    return np.vstack([np.hstack(cells[i : i + columns]) for i in range(0, len(cells), columns)])


def write(folder, name, picture):
    """Write a picture and say so."""
    folder.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(folder / name), picture):
        raise OSError(f"cannot write {folder / name}")
    print(folder / name)
