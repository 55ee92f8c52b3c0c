"""Markers, and the real range images that lie beside the repository where they are installed."""

import importlib.util
import sys
from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_addoption(parser):
    parser.addoption("--slow", action="store_true", help="run the slow tests as well")


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: runs only with --slow, or where -m names it")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--slow") or "slow" in config.getoption("-m"):
        return
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.skip(reason="slow: give --slow"))


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
