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
import contextlib
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
SLOWEST = 600  # seconds of one step; a mutant with which tests take longer is caught
MOST_MEMORY = 2**33  # bytes of a process; mutants may ask for any number
COMPILER, NO_END, CRASH = "the compiler", f"no end within {SLOWEST} s", "a crash"


class Copy:
    """A copy of the program in which the core is built."""

    def __init__(self, folder: Path) -> None:
        self.root, self.build = folder / "tree", folder / "build"
        self.stale = True  # whether the core is not built as it is written
        self.left_out: set[str] = set()  # tests
        for name in ("rangeedge", "tests", "samples"):
            ignored = shutil.ignore_patterns("__pycache__", "*.so", "*.pyd")
            shutil.copytree(ROOT / name, self.root / name, ignore=ignored)
        for name in ("pyproject.toml", "README.md"):
            shutil.copy2(ROOT / name, self.root)
        nanobind = self.run(sys.executable, "-m", "nanobind", "--cmake_dir").stdout.strip()
        self.run("cmake", "-S", self.root / "rangeedge/core", "-B", self.build, "-DCMAKE_BUILD_TYPE=Release",
                 f"-Dnanobind_DIR={nanobind}", f"-DPython_EXECUTABLE={sys.executable}", check=True)  # fmt: skip

    def run(self, *command: object, check: bool = False) -> subprocess.CompletedProcess[str]:
        words, environment = list(map(str, command)), {**os.environ, "PYTHONPATH": str(self.root)}
        return subprocess.run(
            words, capture_output=True, text=True, check=check, timeout=SLOWEST, cwd=self.root, env=environment
        )

    def compile(self) -> bool:
        if not self.stale:
            return True
        if self.run("cmake", "--build", self.build, "--parallel", 2).returncode != 0:
            return False
        for module in self.build.glob("_core*.*"):
            if module.suffix in (".so", ".pyd", ".pyi"):
                shutil.copy2(module, self.root / "rangeedge")
        self.stale = False
        return True

    def failed(self, *tests: str, options: Sequence[str] = ("-x",)) -> list[str]:
        """What fails of these tests."""
        if not self.compile():
            return [COMPILER]
        options = [*options, "-q", "-p", "no:cacheprovider", f"--basetemp={self.root.parent / 'results'}"]
        left_out = [f"--deselect={test}" for test in self.left_out]
        try:
            run = self.run(sys.executable, "-m", "pytest", *options, *left_out, *tests)
        except subprocess.TimeoutExpired:
            return [NO_END]
        if run.returncode == 0:
            return []
        return re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", run.stdout, re.MULTILINE) or [CRASH]

    def noticed(self, mutant: Mutant) -> str:
        """What notices the mutant; nothing where it survives."""
        path = self.root / "rangeedge" / mutant.file
        right = path.read_text()
        try:
            path.write_text(right.replace(mutant.right, mutant.wrong))
            self.stale |= mutant.file.startswith("core/")
            return next(iter(self.failed(*(f"tests/test_{name}.py" for name in mutant.tests.split()))), "")
        finally:
            path.write_text(right)
            self.stale |= mutant.file.startswith("core/")

    def found(self, mutants: Sequence[Mutant]) -> dict[Mutant, str]:
        """What notices each, other than tests that fail without any mutant; nothing where it survives."""
        found: dict[Mutant, str] = {}
        left = mutants
        while left:
            for mutant in left:
                found[mutant] = self.noticed(mutant)
                what = found[mutant] or "SURVIVED"
                print(f"{what}: {mutant.file}: {mutant.right!r} -> {mutant.wrong!r}", flush=True)
            failing = {found[mutant] for mutant in left} - {COMPILER, NO_END, CRASH, ""}
            unsound = failing.intersection(self.failed(*sorted(failing), options=())) if failing else set()
            for test in sorted(unsound):
                print(f"left out, as it fails without any mutant: {test}", flush=True)
            self.left_out |= unsound
            left = [mutant for mutant in left if found[mutant] in unsound]
        return found


def bound_memory() -> None:
    """Of this process and of those that it starts."""
    with contextlib.suppress(ImportError):  # on Windows
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


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
    bound_memory()
    with tempfile.TemporaryDirectory() as folder:
        found = Copy(Path(folder)).found(chosen)
    caught = Counter(mutant.stage for mutant in chosen if found[mutant])
    for stage, count in Counter(mutant.stage for mutant in chosen).items():
        print(f"{stage}: {caught[stage]} of {count}")
    print(f"{caught.total()} of {len(chosen)} caught")
    return int(bool(lost) or caught.total() < LEAST_CAUGHT * len(chosen))


if __name__ == "__main__":
    sys.exit(main())
