"""Every program and every command in the documentation runs as it stands, in the order of its page."""

import inspect
import json
import re
import shlex
from pathlib import Path

import pytest

import rangeedge
from rangeedge.app.cli import main

DOCS = Path(__file__).resolve().parents[1] / "rangeedge" / "docs"
PAGES = sorted(path.name for path in DOCS.glob("*.md"))


def blocks(name, language):
    text = (DOCS / name).read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", PAGES)
def test_programs_of_a_page_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for command in "".join(blocks(name, "sh")).splitlines():
        assert main(shlex.split(command)[1:]) == 0
    names = {}
    for program in blocks(name, "python"):
        exec(program, names)


def test_there_are_programs():
    assert sum(len(blocks(name, "python")) for name in PAGES) >= 3


def test_tutorial_runs(tmp_path, monkeypatch):
    """Its cells; what they show is for the documentation to see."""
    pytest.importorskip("IPython")
    monkeypatch.chdir(tmp_path)
    cells = json.loads((DOCS / "tutorial.ipynb").read_text("utf-8"))["cells"]
    names = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            exec("".join(cell["source"]), names)
    assert names["why"].change


def test_api_names_everything():
    text = (DOCS / "api.md").read_text("utf-8")
    listed = re.findall(r"\.\. auto\w+:: rangeedge\.(\w+)", text)
    constants = {name for name in rangeedge.__all__ if name.isupper()}
    assert len(listed) == len(set(listed))
    assert set(listed) == set(rangeedge.__all__) - constants - {"error", "RangeEdgeWarning", "Cancellation"}


def test_options_in_tables_exist():
    """What the tables name in code is an option, a function or a value."""
    known = {*rangeedge.__all__, *rangeedge.ScanLineParams.options}
    from rangeedge.options import DETECTION

    known |= set(DETECTION)
    for name in re.findall(r"`(\w+)(?:=[^`]*)?`", (DOCS / "parameters.md").read_text("utf-8")):
        assert name in known or name.isdigit(), name


@pytest.mark.parametrize("name", [name for name in rangeedge.__all__ if name[0].islower() and name != "error"])
def test_no_parameter_is_described_twice(name):
    text = inspect.getdoc(getattr(rangeedge, name)) or ""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-{3,}$|\Z)", text, re.MULTILINE | re.DOTALL)
    described = re.findall(r"^(\w+)(?:, \w+)* : ", section[1], re.MULTILINE) if section else []
    assert len(described) == len(set(described))
