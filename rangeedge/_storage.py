"""Parameters in files of `cv2.FileStorage`: XML, YAML and JSON."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ._check import described, error, fail
from .io.atomic import write_atomically
from .io.source import file_name, opened
from .noise_model import NoiseModel
from .options import DETECTION

_SUFFIXES = (".xml", ".yml", ".yaml", ".json")  # by which cv2.FileStorage knows the format
# The first and the last key of a file that `save` has written: YAML that has lost its end is YAML again.
_OPENING, _CLOSING = "savedBy", "complete"
_DEPTH = 64  # levels of nesting


def save(filename: str | os.PathLike[str], node: str, values: Mapping[str, Any]) -> None:
    """Write values into a file, as the node of that name; all of it or nothing."""
    name = file_name(filename, "filename")
    suffix = Path(name).suffix.lower()
    if suffix not in _SUFFIXES:
        raise fail("filename", f"a file name with one of the suffixes {' '.join(_SUFFIXES)}", repr(name))
    fs = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    fs.write(_OPENING, "rangeedge")
    write(fs, node, values)
    fs.write(_CLOSING, 1)
    try:
        write_atomically(name, fs.releaseAndGetString().encode())
    except (OSError, ValueError) as reason:
        what = getattr(reason, "strerror", None) or reason
        raise error(f"cannot write {name!r}: {what}", cv2.Error.StsError) from reason


def load(filename: str | os.PathLike[str], node: str) -> tuple[str, dict[str, Any]]:
    """The name of a file, and the values under the node of that name in it."""
    name = file_name(filename, "filename")
    with opened(name) as (stream, size):
        text = stream.read(size).decode()
        _expect_shallow(text)
    # OpenCV 4.8 does not survive all files that have lost their end.
    if node not in text:
        raise error(f"{name!r} holds no `{node}`", cv2.Error.StsParseError)
    if _OPENING in text and _CLOSING not in text:
        raise error(f"{name!r} is not complete", cv2.Error.StsParseError)
    fs = cv2.FileStorage()
    try:
        fs.open(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        found = fs.getNode(node)
        whole = fs.getNode(_OPENING).empty() or fs.getNode(_CLOSING).real() == 1
    except cv2.error as problem:
        raise error(f"cannot read {name!r}: {problem.err}", cv2.Error.StsParseError) from problem
    if not found.isMap():
        raise error(f"{name!r} holds no `{node}`", cv2.Error.StsParseError)
    if not whole:
        raise error(f"{name!r} is not complete", cv2.Error.StsParseError)
    try:
        return name, read(found)
    except error as problem:
        raise error(f"{name!r}: {problem.err}", problem.code) from None


def write(fs: cv2.FileStorage, node: str, values: Mapping[str, Any]) -> None:
    """Write values into a storage, under a node where that has a name."""
    if not isinstance(node, str) or (node and not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_ -]*", node)):
        raise fail("name", "letters, digits, '_', '-' and ' ', a letter first", described(node))
    if node:
        fs.startWriteStruct(node, cv2.FileNode_MAP)
    for name, value in values.items():
        _write_node(fs, name, value)
    if node:
        fs.endWriteStruct()


def read(node: cv2.FileNode) -> dict[str, Any]:
    """The values under a node, in the types of Python."""
    values = {name: _node_value(node.getNode(name)) for name in node.keys()}  # noqa: SIM118
    for name, option in DETECTION.items():  # a file storage knows no bool
        if isinstance(option.default, bool) and isinstance(values.get(name), int) and values[name] in (0, 1):
            values[name] = bool(values[name])
    if isinstance(values.get("noise"), dict):
        try:
            values["noise"] = NoiseModel(**values["noise"])
        except TypeError:
            raise fail("noise", "a number, an array, or what a NoiseModel holds", values["noise"]) from None
    return values


_BRACKETS = re.compile(r"([\[{]|<[A-Za-z_])|([\]}]|</|/>)")
_INDENTATION = re.compile(r"\s*((?:-\s+)*)")


def _expect_shallow(text: str) -> None:
    """Refuses nesting that OpenCV, which follows it by recursion, does not survive."""
    depth = 0
    for bracket in _BRACKETS.finditer(text):
        depth = depth + 1 if bracket[1] else max(0, depth - 1)
        _expect_level(depth)
    outer: list[int] = []  # columns at which the blocks begin that a line of YAML is in
    for line in text.splitlines():
        start = _INDENTATION.match(line)
        if start is None or start.end() == len(line):
            continue
        while outer and outer[-1] >= start.start(1):
            outer.pop()
        dashes = start[1].count("-")
        outer += [start.start(1)] * (dashes + 1)
        _expect_level(len(outer))


def _expect_level(depth: int) -> None:
    if depth > _DEPTH:
        raise ValueError(f"it is nested more than {_DEPTH} levels")


def _write_node(fs: cv2.FileStorage, name: str, value: Any) -> None:
    if value is None:
        return
    if isinstance(value, NoiseModel):
        write(fs, name, asdict(value))
    elif isinstance(value, tuple):
        fs.startWriteStruct(name, cv2.FileNode_SEQ)
        for element in value:
            _write_node(fs, "", element)
        fs.endWriteStruct()
    elif isinstance(value, np.ndarray):
        fs.write(name, value)
    elif isinstance(value, (bool, int)):
        fs.write(name, int(value))
    else:
        fs.write(name, float(value))


def _node_value(node: cv2.FileNode, depth: int = 0) -> Any:
    """What `_write_node` has written, in the types of Python."""
    if depth > _DEPTH:
        raise error(f"it is nested more than {_DEPTH} levels", cv2.Error.StsParseError)
    if node.isInt():
        return int(node.real())
    if node.isReal():
        return node.real()
    if node.isSeq():
        return tuple(_node_value(node.at(i), depth + 1) for i in range(node.size()))
    if not node.isMap():
        return node.string() if node.isString() else None
    keys = node.keys()
    if "dt" in keys:
        try:
            return node.mat()
        except cv2.error as problem:
            raise error(f"`{node.name()}` is a damaged matrix: {problem.err}", problem.code) from problem
    return {key: _node_value(node.getNode(key), depth + 1) for key in keys}
