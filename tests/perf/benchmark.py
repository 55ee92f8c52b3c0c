"""All that is said about speed, measured: `python tests/perf/benchmark.py [--sections frames,growth,worst]`.

- frames: every stage on full frames, with one thread and two, beside what OpenCV has for the same ends. All calls on a
  frame take turns in one process, so that a busy machine slows them alike; compare ratios.
- growth: nanoseconds and bytes per pixel, from small images to large ones.
- worst: the worst images of every function beside a typical one (worst.py has more to choose from).

Frames are generated, and real ones come on top where the data are installed: `RANGEEDGE_SHARED` may name their folder.
All together takes less than five minutes on two quiet cores.
"""

from __future__ import annotations

import argparse
import platform

import cv2
import numpy as np
from frames import Frame, frames
from growth import growth
from stages import CANNY, CHAIN, COPY, PRECISE, READING, Times, candidates, others, stages
from worst import size_of, worst

import rangeedge

# What a reader of the table asks first.
UNITS = (PRECISE, CANNY, COPY)


def show(name: str, frame: Frame, repeat: int) -> None:
    """The table of a frame."""
    one, two = 1, 2  # threads
    times = Times({**stages(frame), **others(frame)}, (one, two), repeat)
    print(f"\n{name}: {frame.src.dtype}, {frame.src.shape[1]} x {frame.src.shape[0]}, {repeat} turns")
    print(
        f"{'milliseconds, least and median':32}{'one thread':>17}{'two threads':>17}{'gain':>6}"
        f"{'x PRECISE':>11}{'x Canny':>9}{'x copy':>8}{'x reading':>11}{'ns/pixel':>10}"
    )
    for call in times.names:
        least = {n: times.least(call, n) for n in (one, two)}
        columns = "".join(f"{least[n]:9.2f}{times.median(call, n):8.2f}" for n in (one, two))
        precise, canny, copy = (times.median(call, two) / times.median(unit, two) for unit in UNITS)
        reading, per_pixel = least[one] / times.least(READING, one), 1e6 * least[one] / frame.pixels
        print(
            f"{call:32}{columns}{least[one] / least[two]:6.2f}"
            f"{precise:11.2f}{canny:9.1f}{copy:8.1f}{reading:11.1f}{per_pixel:10.2f}"
        )
    found = candidates(frame)
    each = 1e6 * times.least("edgeStrength, noise given", one) / max(found, 1)
    floor = 4 * times.least(READING, one) / times.least(CHAIN, one)
    print(
        f"{found} candidates, {found / frame.pixels:.1%} of the pixels: {each:.0f} ns of edgeStrength each, noise given"
    )
    print(f"Reading the image once in each of four directions is {floor:.1%} of {CHAIN}.")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sections", default="frames,growth,worst")
    parser.add_argument("--frames", default="", help="parts of names, separated by commas; all without")
    parser.add_argument("--repeat", type=int, default=12, help="turns at 640x480; fewer where a frame is larger")
    parser.add_argument("--worst-size", default="640x480")
    parser.add_argument("--stages", default="", help="of the worst images: parts of names, as of frames")
    args = parser.parse_args()
    versions = f"rangeedge {rangeedge.__version__}, OpenCV {cv2.__version__}, NumPy {np.__version__}"
    print(f"{versions}, Python {platform.python_version()}, {platform.machine()}, {cv2.getNumberOfCPUs()} cores")
    sections = args.sections.split(",")
    if "frames" in sections:
        for name, make in frames().items():
            if any(part in name for part in args.frames.split(",")):
                frame = make()
                show(name, frame, int(np.clip(args.repeat * 640 * 480 * 2 // frame.pixels, 2, args.repeat)))
    if "growth" in sections:
        growth()
    if "worst" in sections:
        worst([size_of(args.worst_size)], args.stages.split(","))


if __name__ == "__main__":
    main()
