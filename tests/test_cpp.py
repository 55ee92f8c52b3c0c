"""The C++ core: what its threads promise; installed by CMake, found by a program of another project, and run."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def run(*command):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("cmake"), reason="CMake is not installed")
def test_a_program_finds_edges_with_the_installed_core(tmp_path):
    core, prefix, program = tmp_path / "core", tmp_path / "prefix", tmp_path / "program"
    run(
        "cmake", "-S", ROOT / "rangeedge/core", "-B", core, "-DRANGEEDGE_PYTHON=OFF", f"-DCMAKE_INSTALL_PREFIX={prefix}"
    )
    run("cmake", "--build", core, "--parallel", 2)
    run("cmake", "--install", core)
    run("cmake", "-S", ROOT / "samples/cpp", "-B", program, f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", program)
    words = run(program / "find_edges").split()
    assert words[1:] == ["pixels", "on", "edges,", "noise", words[-1]]
    assert 60 <= int(words[0]) <= 160  # the step is 60 pixels long, and has a pixel on either side
    assert 0.008 < float(words[-1]) < 0.012


COMPILER = shutil.which(os.environ.get("CXX", "c++"))


@pytest.mark.skipif(not COMPILER or os.name == "nt", reason="there is no compiler that takes these options")
def test_threads_and_watches_do_what_they_promise(tmp_path):
    program = tmp_path / "threads"
    source = ROOT / "tests/cpp/threads.cpp"
    run(COMPILER, "-std=c++17", "-O0", "-pthread", "-I", ROOT / "rangeedge/core", source, "-o", program)
    assert run(program) == ""
