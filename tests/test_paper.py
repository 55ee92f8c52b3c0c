"""The table of the paper's equations names files and functions that exist."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "rangeedge"
TABLE = PACKAGE / "core" / "PAPER.md"
NAMED = re.compile(r"`([\w/]+\.(?:py|cpp|hpp))`: ((?:`\w+`(?:, )?)+)")


def rows():
    """Place in the paper, its statement, where it is, what differs."""
    lines = [line for line in TABLE.read_text().splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines[1:]]


def named():
    """File and name, wherever the table gives them."""
    for row in rows():
        for file, names in NAMED.findall(" ".join(row)):
            for name in re.findall(r"`(\w+)`", names):
                yield file, name


def defined(file):
    """The names that a file defines."""
    text = (PACKAGE / file).read_text()
    if file.endswith(".py"):
        nodes = list(ast.walk(ast.parse(text)))
        names = {node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
        return names | {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    text = re.sub(r"//.*", "", text)
    types = re.findall(r"\b(?:struct|class) (\w+) (?:final )?[:{]", text)
    # A result, a name, parameters and a body: no call.
    functions = re.findall(
        r"^[\w:<>&*,\s]*?[\w>&*] (?:\w+(?:<[\w, ]+>)?::)?(\w+)\([^;{}]*\)[^;{}()]*\{", text, re.MULTILINE
    )
    return {*types, *functions}


@pytest.mark.parametrize(("file", "name"), sorted(set(named())))
def test_names_exist(file, name):
    assert name in defined(file)


def test_every_row_names_code():
    assert len(rows()) >= 30
    for row in rows():
        assert len(row) == 4
        assert NAMED.search(row[2]), row
        assert all(row)


def test_every_file_in_backticks_exists():
    for file in re.findall(r"`([\w/]+\.(?:py|cpp|hpp))`", TABLE.read_text()):
        assert (PACKAGE / file).exists() or (PACKAGE / "core" / file).exists(), file
