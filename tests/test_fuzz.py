"""Some random calls of every function; `python tests/fuzz.py` makes as many as there is time for."""

import os

import fuzz
import pytest

CALLS = int(os.environ.get("RANGEEDGE_FUZZ", "20"))  # of each function


@pytest.mark.parametrize("name", fuzz.FUNCTIONS)
def test_any_call_is_answered_or_refused(name):
    fuzz.fuzz(name, CALLS, derandomize=True)
