"""Small wrong edits of the program, each of which some test must notice.

    python tests/mutants.py                  # all of them, some minutes each where the core is built anew
    python tests/mutants.py --only seeds io  # those whose file has `seeds` or `io` in its name
    python tests/mutants.py --list           # whether each still has its place in the program

The edits are made in a copy, in which the core is built by CMake, one file a mutant; CMAKE_GENERATOR=Ninja and
CMAKE_CXX_COMPILER_LAUNCHER=ccache in the environment make that quick. The exit code is 1 where fewer than 95 % are
caught, or one has no place in the program.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LEAST_CAUGHT = 0.95
SLOWEST = 900  # seconds of one step; a mutant with which tests take longer is caught
COMPILER, NO_END, CRASH = "the compiler", f"no end within {SLOWEST} s", "a crash"


class Mutant(NamedTuple):
    file: str  # in rangeedge/
    right: str  # occurs once
    wrong: str
    tests: str  # files of tests/, without test_ and .py


def of(file: str, tests: str, *edits: tuple[str, str]) -> list[Mutant]:
    return [Mutant(file, right, wrong, tests) for right, wrong in edits]


MUTANTS = [
    # Scan lines
    *of("core/scanline/split.cpp", "scanline oracle",
        ("left < right || (left == right &&", "left > right || (left == right &&"),
        ("2 * k < s.first + s.last", "2 * k > s.first + s.last"),
        ("return joins_left ? k : k - 1;", "return k;"),
        ("a = (slope_right - slope_left) * inverse;", "a = (slope_right + slope_left) * inverse;"),
        ("if (r > largest)\n", "if (r >= largest)\n"),
        ("constexpr int exact = 3;", "constexpr int exact = 4;")),
    *of("core/scanline/merge.cpp", "oracle edges significance",
        ("constexpr double bridge_factor = 2;", "constexpr double bridge_factor = 1;"),
        ("cost(i) < cost(previous(i)), after", "cost(i) <= cost(previous(i)), after")),
    # Edges
    *of("core/edges/detect.cpp", "edges jumps oracle significance",
        ("constexpr double jump_tolerances = 2;", "constexpr double jump_tolerances = 3;"),
        ("constexpr double lone_jump = 8;", "constexpr double lone_jump = 12;"),
        ("constexpr int least_outlined = 3;", "constexpr int least_outlined = 2;"),
        ("if (gap > 0 && shorter < 2) return {};", ""),
        ("(f1.ordinate > f2.ordinate ? occluding_bit", "(f1.ordinate < f2.ordinate ? occluding_bit"),
        ("if (crease > 0) c.kind |= is_convex(f1, f2) ?", "if (crease > 0) c.kind |= !is_convex(f1, f2) ?")),
    *of("core/edges/combine.cpp", "edges oracle",
        ("jump[p] = std::max(jump[p], c.jump);", "jump[p] = c.jump;"),
        ("== (p == c.before);", "== (p == c.after);"),
        ("c->crease == crease[p] && (c->kind & convex_bit)", "c->crease == crease[p] && (c->kind & concave_bit)")),
    *of("core/edges/neighbours.cpp", "oracle significance edges",
        ("constexpr float largest_share = 8;", "constexpr float largest_share = 4;"),
        ("lone_share = 1 / 3.0f;", "lone_share = 1 / 2.0f;")),
    *of("core/edges/align.cpp", "oracle edges",
        ("if (std::abs(total) > max_shift || ", "if (")),
    *of("core/edges/smear.cpp", "flying jumps edges",
        ("constexpr double overshoot = 0.2;", "constexpr double overshoot = 0.0;"),
        ("if (share < 0.5)", "if (share < 0.9)")),
    *of("core/edges/ring.hpp", "thinning",
        ("simple && neighbours > 1;", "simple && neighbours > 0;")),
    *of("core/edges/thin.cpp", "thinning",
        ("protrusion(spur) >= spur_length) return;", "protrusion(spur) > spur_length) return;"),
        ("for (const int from : {south, north, east, west}) {", "for (const int from : {south, north, east}) {"),
        ("layers_ = std::min(layers_ + 1, 255);", "layers_ = std::min(layers_ + 1, 2);")),
    *of("core/edges/select.hpp", "selection significance",
        ("constexpr double usual_length = 10;", "constexpr double usual_length = 20;")),
    *of("core/edges/select.cpp", "selection significance",
        ("bottom_ - top_ + 1); }", "bottom_ - top_); }")),
    *of("core/image/pixels.cpp", "edges geometry",
        ("(invalid[i] ^ 1);", "1;"),
        ("if (!mask[i]) inverse[i]", "if (mask[i]) inverse[i]")),
    *of("core/image/components.hpp", "selection regions",
        ("connectivity == 8, wrap", "connectivity == 4, wrap")),
    # Noise
    *of("core/noise/single.cpp", "noise",
        ("constexpr int constant_run = 8;", "constexpr int constant_run = 800;"),
        ("constexpr double quantised_share = 0.3;", "constexpr double quantised_share = 0.9;")),
    *of("core/noise/estimate.cpp", "noise",
        ("constexpr double finest = 3e-5;", "constexpr double finest = 3e-4;")),
    *of("core/noise/steps.cpp", "noise",
        ("(f1.slope - 2 * f2.slope + f3.slope)", "(f1.slope - f2.slope)")),
    # Distances
    *of("core/distance/euclidean.cpp", "distance",
        ("rise < 0.0 || (rise == 0.0 && label < old.label)", "rise < 0.0"),
        ("rest == 0.0 && label < old.label ? x : x + 1", "x + 1"),
        ("const int beyond = grid.wrap ? grid.cols / 2 : 0;", "const int beyond = 0;"),
        ("(1.0 / (s * s) - 1.0)", "(1.0 / (s * s))")),
    *of("core/distance/salience.cpp", "distance",
        ("if (second[p] <= close) number", "if (second[p] < 0) number"),
        ("(left_rest > right_rest) - (left_rest < right_rest);", "0;")),
    *of("core/distance/geodesic.cpp", "distance",
        ("if (dy && dx && !terrain_.is_free(row + dy, col) && !terrain_.is_free(row, col + dx)) continue;", ""),
        ("labels_[at(q)] = labels_[at(p)];", "")),
    # Seeds and regions
    *of("core/regions/seeds.cpp", "seeds hostile",
        ("share[i] = separation * landscape", "share[i] = landscape"),
        ("if (landscape[summits[summit]] < min_distance) return;", ""),
        ("if (value_of(pass.level) < std::min(share[a], share[b])) return;", "return;"),
        ("if (levels[row][col] > 0) uphill", "if (uphill[col] != no_pixel) uphill"),
        ("else if (level >= seeds[high].least)", "else"),
        ("std::max(share[summit], std::numeric_limits<float>::denorm_min())", "share[summit]")),
    *of("core/regions/surface_image.cpp", "regions hostile",
        ("b = (m[0] * fy - m[1] * fx) / det;", "b = (m[0] * fy + m[1] * fx) / det;"),
        ("constexpr double flat = 1.25;", "constexpr double flat = 5;")),
    *of("core/regions/closure.cpp", "closure",
        ("if (std::max(bottom - top, right - left) >= parameters_.max_gap) continue;", "")),
    *of("core/regions/regions.cpp", "regions",
        ("if (parts.area(i) < min_area)", "if (parts.area(i) <= min_area)")),
    *of("core/regions/description.cpp", "regions",
        ("x += n * (run.begin + run.end - 1LL) / 2;", "x += n * (run.begin + run.end) / 2;"),
        ("right = std::max(right, run.end);", "right = std::max(right, run.end - 1);")),
    # Chains
    *of("core/chains/trace.cpp", "chains",
        ("constexpr int least_loop = 8;", "constexpr int least_loop = 80;"),
        ("count(neighbours(p)) > 2 ? junction", "count(neighbours(p)) > 3 ? junction")),
    *of("core/chains/join.cpp", "chains",
        ("if (gap > options_.max_gap) return;", ""),
        ("if (p.type != q.type) return;", "")),
    # Files
    *of("io/source.py", "broken_files io",
        ("if rows * cols > PIXEL_LIMIT:", "if False:"),
        ("if unpacked > max(UNPACKED_FREELY, UNPACKED_RATIO * packed):", "if unpacked > UNPACKED_RATIO * packed:"),
        ("    if found != needed:", "    if found < needed:")),
    *of("io/atomic.py", "io detector",
        ("    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):", "    if False:")),
    # Threads and giving up
    *of("core/base/parallel.hpp", "cancellation",
        ("            Watch::checkpoint();\n            job(thread);", "            job(thread);"),
        ("                    Watch::join(part);\n", "")),
    *of("core/base/watch.hpp", "cancellation",
        ("            stopped_.store(true, std::memory_order_relaxed);\n", ""),
        ("    ~Watch() { own() = outer_; }", "    ~Watch() { own() = Part(); }")),
    *of("core/python/unlock.cpp", "cancellation",
        ("    if (!python_ends || ", "    if (true || "),
        ("all.erase(std::next(last).base());", "all.clear();")),
    # Python
    *of("_check.py", "hostile detector",
        ("    except OverflowError:\n        return np.inf if value > 0 else -np.inf",
         "    except OverflowError:\n        return 1.0"),
        ("    if not dst.flags.writeable:", "    if False:"),
        ("    if dst.shape != result.shape or dst.dtype != result.dtype:", "    if dst.shape != result.shape:"),
        ("    if listed and value.max() > most:", "    if False:"),
        ('            with np.errstate(all="ignore"):', "            with np.errstate():")),
    *of("_storage.py", "hostile",
        ('(node and not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_ -]*", node))', "False")),
    *of("evaluation/regions.py", "evaluation",
        ("if covered / true_size[whole] >= T:", "if covered / true_size[whole] >= 0:"),
        ("np.flatnonzero(count > 1)", "np.flatnonzero(count > 2)")),
    *of("recording/listing.py", "batch recordings",
        ("return stem if stem.strip(\".\") else name", "return stem")),
    *of("sectors.py", "hostile scanners",
        ("min(int(np.ceil(extent / _SECTOR)), count)", "1")),
    *of("dynamic.py", "selection",
        ("_CHAIN_POPULATION = 10 ", "_CHAIN_POPULATION = 12 ")),
]  # fmt: skip


class Copy:
    """A copy of the program in which the core is built."""

    def __init__(self, folder: Path) -> None:
        self.root, self.build = folder / "tree", folder / "build"
        self.left_out: list[str] = []  # tests, as options of pytest
        for name in ("rangeedge", "tests", "samples"):
            ignored = shutil.ignore_patterns("__pycache__", "*.so", "*.pyd")
            shutil.copytree(ROOT / name, self.root / name, ignore=ignored)
        for name in ("pyproject.toml", "README.md"):
            shutil.copy2(ROOT / name, self.root)
        nanobind = self.run(sys.executable, "-m", "nanobind", "--cmake_dir").stdout.strip()
        self.run("cmake", "-S", self.root / "rangeedge/core", "-B", self.build, "-DCMAKE_BUILD_TYPE=Release",
                 f"-Dnanobind_DIR={nanobind}", f"-DPython_EXECUTABLE={sys.executable}", check=True)  # fmt: skip
        self.compile()

    def run(self, *command: object, check: bool = False) -> subprocess.CompletedProcess[str]:
        words, environment = list(map(str, command)), {**os.environ, "PYTHONPATH": str(self.root)}
        return subprocess.run(
            words, capture_output=True, text=True, check=check, timeout=SLOWEST, cwd=self.root, env=environment
        )

    def compile(self) -> bool:
        if self.run("cmake", "--build", self.build, "--parallel", 2).returncode != 0:
            return False
        for module in self.build.glob("_core*.*"):
            if module.suffix in (".so", ".pyd", ".pyi"):
                shutil.copy2(module, self.root / "rangeedge")
        return True

    def failed(self, *tests: str, left_out: Sequence[str] = ()) -> str:
        """The first of these tests that fails; nothing where all pass."""
        options = ["-x", "-q", "-p", "no:cacheprovider", f"--basetemp={self.root.parent / 'results'}"]
        try:
            run = self.run(sys.executable, "-m", "pytest", *options, *left_out, *tests)
        except subprocess.TimeoutExpired:
            return NO_END
        if run.returncode == 0:
            return ""
        named = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", run.stdout, re.MULTILINE)
        return named[1] if named else CRASH

    def noticed(self, mutant: Mutant) -> str:
        """What notices the mutant; nothing where it survives."""
        path = self.root / "rangeedge" / mutant.file
        right = path.read_text()
        core = mutant.file.startswith("core/")
        try:
            path.write_text(right.replace(mutant.right, mutant.wrong))
            if core and not self.compile():
                return COMPILER
            files = [f"tests/test_{name}.py" for name in mutant.tests.split()]
            return self.failed(*files, left_out=self.left_out)
        finally:
            path.write_text(right)
            if core:
                self.compile()


def misplaced() -> list[Mutant]:
    """Those whose text does not occur just once."""
    return [m for m in MUTANTS if (ROOT / "rangeedge" / m.file).read_text().count(m.right) != 1]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=[""], nargs="+", metavar="PART", help="of the file's name")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    lost = misplaced()
    for mutant in lost:
        print(f"no place: {mutant.file}: {mutant.right!r}")
    chosen = [m for m in MUTANTS if any(part in m.file for part in options.only) and m not in lost]
    print(f"{len(chosen)} mutants")
    if options.list or not chosen:
        return int(bool(lost))
    with tempfile.TemporaryDirectory() as folder:
        copy, caught, sound = Copy(Path(folder)), 0, {COMPILER, NO_END, CRASH, ""}
        for mutant in chosen:
            found = copy.noticed(mutant)
            while found not in sound and copy.failed(found):
                print(f"left out, as it fails without any mutant: {found}", flush=True)
                copy.left_out.append(f"--deselect={found}")
                found = copy.noticed(mutant)
            sound.add(found)
            caught += bool(found)
            print(f"{found or 'SURVIVED'}: {mutant.file}: {mutant.right!r} -> {mutant.wrong!r}", flush=True)
    print(f"{caught} of {len(chosen)} caught")
    return int(bool(lost) or caught < LEAST_CAUGHT * len(chosen))


if __name__ == "__main__":
    sys.exit(main())
