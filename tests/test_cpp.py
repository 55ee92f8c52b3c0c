"""The C++ core on its own: installed by CMake, found by a program of another project, and run."""

import re
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


def test_every_type_of_the_core_has_a_name_of_its_own():
    """Two types of one name in one namespace share their templates' code, and with it their size."""
    places = {}
    for path in sorted((ROOT / "rangeedge/core").rglob("*.?pp")):
        text = re.sub(r"^namespace \{$.*?^\}  // namespace$", "", path.read_text(), flags=re.MULTILINE | re.DOTALL)
        for name in re.findall(r"^(?:struct|class) (\w+)[ :{]", text, flags=re.MULTILINE):
            if f"struct {name};" not in text and f"class {name};" not in text:
                places.setdefault(name, set()).add(path.name)
    assert {name: files for name, files in places.items() if len(files) > 1} == {}
