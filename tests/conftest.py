"""Markers, and the real range images that lie beside the repository where they are installed."""

import importlib.util
import sys
from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: takes more than a few seconds; leave out with -m 'not slow'")


@pytest.fixture(scope="session")
def load():
    """The module that loads the real range images."""
    path = SHARED / "data" / "load.py"
    if not path.exists():
        pytest.skip(f"no range images at {path.parent}")
    return _module("load", path)


@pytest.fixture(scope="session")
def score(load):
    """The module that scores edges against the truth of the real range images."""
    path = SHARED / "eval" / "score.py"
    if not path.exists():
        pytest.skip(f"no evaluation at {path}")
    return _module("score", path)


def _module(name, path):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    written, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = written
    return module
