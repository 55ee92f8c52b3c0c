"""A frame that is read when it is needed, by whom it is needed: small, and so sent to other processes."""

from __future__ import annotations

import contextlib
import functools
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, TypeVar

from .._check import error
from ..io import RangeImage

_R = TypeVar("_R")


def places(geometry: Mapping[str, Any]) -> bool:
    """Whether a geometry says where pixels look."""
    return "K" in geometry or "pixelSize" in geometry


@dataclass(frozen=True)
class FrameSource:
    """Where a frame is, and how it is read.

    Attributes
    ----------
    name : str
        Of its results: a path of the frame in its recording, without suffix.
    path : str
        The file or folder that holds it.
    part : str
        Which frame of that, as a person would say it; empty where there is only one.
    """

    name: str
    path: str
    part: str
    load: Callable[[], RangeImage] = field(repr=False)
    geometry: Mapping[str, Any] = field(default_factory=dict, repr=False)
    obstacle: str = field(default="", repr=False)  # why the camera of the recording is not known, where it has one

    @property
    def title(self) -> str:
        """File and part."""
        return f"{self.path}: {self.part}" if self.part else self.path

    def read(self, **given: Any) -> RangeImage:
        """The range image, with the camera of its file, else of the recording, and a geometry that replaces it."""
        image = self.load()
        if self.obstacle and not places({**image.geometry, **given}):
            raise error(self.obstacle)
        return image._replace(geometry=dict(self.geometry)).withGeometry(**image.geometry).withGeometry(**given)


@dataclass(frozen=True)
class Unreadable:
    """Reads nothing, and says why."""

    reason: str

    def __call__(self) -> RangeImage:
        raise error(self.reason)


@contextlib.contextmanager
def failures_named(what: str, hint: Callable[[Exception], str] = lambda reason: "") -> Iterator[None]:
    """Whatever goes wrong in a recording is an error that names it: its readers raise many types on garbled files."""
    try:
        yield
    except Exception as reason:
        if isinstance(reason, error) and what in reason.err:
            raise
        text = reason.err if isinstance(reason, error) else str(reason)
        kind = "" if isinstance(reason, (error, ValueError)) else f"{type(reason).__name__}: "
        raise error(f"cannot read {what}: {kind}{text}{hint(reason)}") from reason


def extra(module: str, name: str, purpose: str) -> ModuleType:
    """A module of an extra; where it is missing the error says what to install."""
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError as reason:
        raise error(f"{purpose} needs {module.partition('.')[0]}: pip install 'rangeedge[{name}]'") from reason


def kept(files: int) -> Callable[[Callable[[str], _R]], Callable[[str], _R]]:
    """Keep what a function makes of the last few files, for as long as these stay as they are."""

    def keeping(function: Callable[[str], _R]) -> Callable[[str], _R]:
        @functools.lru_cache(maxsize=files)
        def of_state(path: str, *state: int) -> _R:
            return function(path)

        @functools.wraps(function)
        def call(path: str) -> _R:
            found = os.stat(path)
            return of_state(path, found.st_mtime_ns, found.st_size, found.st_ino)

        return call

    return keeping
