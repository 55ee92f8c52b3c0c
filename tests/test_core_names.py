"""The sources of the core: names that the linker can tell apart, and lines of a length that can be read."""

import re
from pathlib import Path

CORE = Path(__file__).resolve().parents[1] / "rangeedge" / "core"
SOURCES = sorted(CORE.rglob("*.[ch]pp"))
LONGEST = 120


def test_every_type_is_defined_once():
    """Two types of one name in one namespace share the code of their templates, and with it their size."""
    places = {}
    for path in SOURCES:
        text = re.sub(r"^namespace \{$.*?^\}  // namespace$", "", path.read_text(), flags=re.MULTILINE | re.DOTALL)
        for name in re.findall(r"^(?:struct|class) (\w+)[^;{]*\{", text, flags=re.MULTILINE):
            places.setdefault(name, set()).add(path.name)
    assert "Candidate" in places
    assert {name: files for name, files in places.items() if len(files) > 1} == {}


def test_lines_are_short():
    long = [
        f"{path.relative_to(CORE)}:{number}"
        for path in SOURCES
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if len(line) > LONGEST
    ]
    assert long == []
