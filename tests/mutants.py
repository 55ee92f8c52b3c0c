"""Small wrong edits of the program, each of which some test must notice: those of `mutants_table.py`.

    python tests/mutants.py                  # all of them, some minutes each where the core is built anew
    python tests/mutants.py --only seeds io  # those whose stage or file has `seeds` or `io` in its name
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
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from mutants_table import MUTANTS, Mutant

ROOT = Path(__file__).resolve().parents[1]
LEAST_CAUGHT = 0.95
SLOWEST = 400  # seconds of one step; a mutant with which tests take longer is caught
COMPILER, NO_END, CRASH = "the compiler", f"no end within {SLOWEST} s", "a crash"


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
    parser.add_argument("--only", default=[""], nargs="+", metavar="PART", help="of the name of stage or file")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    lost = misplaced()
    for mutant in lost:
        print(f"no place: {mutant.file}: {mutant.right!r}")
    chosen = [m for m in MUTANTS if any(part in f"{m.stage} {m.file}" for part in options.only) and m not in lost]
    print(f"{len(chosen)} mutants")
    if options.list or not chosen:
        return int(bool(lost))
    with tempfile.TemporaryDirectory() as folder:
        copy, caught, sound = Copy(Path(folder)), Counter[str](), {COMPILER, NO_END, CRASH, ""}
        for mutant in chosen:
            found = copy.noticed(mutant)
            while found not in sound and copy.failed(found):
                print(f"left out, as it fails without any mutant: {found}", flush=True)
                copy.left_out.append(f"--deselect={found}")
                found = copy.noticed(mutant)
            sound.add(found)
            caught[mutant.stage] += bool(found)
            print(f"{found or 'SURVIVED'}: {mutant.file}: {mutant.right!r} -> {mutant.wrong!r}", flush=True)
    for stage, count in Counter(m.stage for m in chosen).items():
        print(f"{stage}: {caught[stage]} of {count}")
    print(f"{caught.total()} of {len(chosen)} caught")
    return int(bool(lost) or caught.total() < LEAST_CAUGHT * len(chosen))


if __name__ == "__main__":
    sys.exit(main())
