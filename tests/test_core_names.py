"""Types of the core that headers define have names of their own: to the linker, two of one name are the same."""

import collections
import pathlib
import re

CORE = pathlib.Path(__file__).parent.parent / "rangeedge" / "core"


def test_every_type_is_defined_once():
    places = collections.defaultdict(list)
    for header in sorted(CORE.rglob("*.hpp")):
        for name in re.findall(r"^(?:struct|class) (\w+)[^;{]*\{", header.read_text(), re.MULTILINE):
            places[name].append(header.name)
    assert "Candidate" in places
    assert {name: files for name, files in places.items() if len(files) > 1} == {}
