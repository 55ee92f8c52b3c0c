"""Some random calls of every function and reader, and whether every mutant has its place: what `fuzz.py` and
`mutants.py` need.
"""

import os

import fuzz
import mutants
import pytest
from fuzz_arguments import FILES, FUNCTIONS
from fuzz_files import READERS

import rangeedge

CALLS = int(os.environ.get("RANGEEDGE_FUZZ", "20"))  # of each function
UNDER_WRITERS = ("salienceDistanceTransform", "regionBoundaries", "regionAdjacency", "growRegions", "linkEdges")


@pytest.mark.parametrize("name", FUNCTIONS)
def test_any_call_is_answered_or_refused(name):
    fuzz.fuzz(name, CALLS)


@pytest.mark.parametrize("name", READERS)
def test_any_file_is_read_or_refused(name):
    fuzz.fuzz(name, CALLS)


@pytest.mark.parametrize("name", UNDER_WRITERS)
def test_calls_survive_what_is_written_meanwhile(name):
    fuzz.fuzz(name, CALLS // 4, writers=True)


def test_every_function_is_called():
    functions = [name for name in rangeedge.__all__ if not isinstance(getattr(rangeedge, name), (int, type))]
    assert {*functions} == {name for name in FUNCTIONS if hasattr(rangeedge, name)} - {
        "NoiseModel",
        "ScanLineParams",
    } | {*FILES}


def test_every_mutant_has_its_place():
    assert mutants.misplaced() == []
    assert len(set(mutants.MUTANTS)) == len(mutants.MUTANTS) >= 110


@pytest.mark.parametrize("mutant", mutants.MUTANTS, ids=lambda m: f"{m.file}-{m.right.strip()[:30]}")
def test_mutants_name_tests_that_are_there(mutant):
    assert mutant.right != mutant.wrong
    assert all((mutants.ROOT / "tests" / f"test_{name}.py").exists() for name in mutant.tests.split())
