"""Some random calls of every function, and whether every mutant has its place: what `fuzz.py` and `mutants.py` need."""

import os

import fuzz
import mutants
import pytest

CALLS = int(os.environ.get("RANGEEDGE_FUZZ", "20"))  # of each function


@pytest.mark.parametrize("name", fuzz.FUNCTIONS)
def test_any_call_is_answered_or_refused(name):
    fuzz.fuzz(name, CALLS)


def test_every_mutant_has_its_place():
    assert mutants.misplaced() == []
    assert len(set(mutants.MUTANTS)) == len(mutants.MUTANTS) >= 110


@pytest.mark.parametrize("mutant", mutants.MUTANTS, ids=lambda m: f"{m.file}-{m.right.strip()[:30]}")
def test_mutants_name_tests_that_are_there(mutant):
    assert mutant.right != mutant.wrong
    assert all((mutants.ROOT / "tests" / f"test_{name}.py").exists() for name in mutant.tests.split())
