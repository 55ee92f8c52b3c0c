"""Parameters in files of `cv2.FileStorage`: XML, YAML and JSON."""

from __future__ import annotations

import math
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
from .io.settings import parse
from .io.source import file_name, opened
from .noise_model import NoiseModel
from .options import DETECTION

_SUFFIXES = (".xml", ".yml", ".yaml", ".json")  # by which cv2.FileStorage knows the format
# The first and the last key of a file that `save` has written: YAML that has lost its end is YAML again.
_OPENING, _CLOSING = "savedBy", "complete"
_FILE_BYTES = 2**28
_DEPTH = 32  # levels of nesting
_KINDS = {"u": "u1", "c": "i1", "w": "u2", "s": "i2", "i": "i4", "f": "f4", "d": "f8", "h": "f2"}  # by OpenCV's letters


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
    """The name of a file, and the values under the node of that name in it.

    By our own reader: that of OpenCV does not survive every file that is garbled.
    """
    name = file_name(filename, "filename")
    with opened(name) as (stream, size):
        if size > _FILE_BYTES:
            raise ValueError(f"it has {size} bytes, more than parameters")
        tree = parse(stream.read(size).decode())
        found = tree.get(node) if isinstance(tree, dict) else None
        if not isinstance(found, dict):
            raise ValueError(f"it holds no `{node}`")
        if _OPENING in tree and tree.get(_CLOSING) != 1:
            raise ValueError("it is not complete")
    try:
        return name, _typed({key: _tree_value(key, value) for key, value in found.items()})
    except error as problem:
        raise error(f"{name!r}: {problem.err}", problem.code) from None


def _tree_value(name: str, value: Any) -> Any:
    """What `_write_node` has written, from nested dicts and lists."""
    if isinstance(value, dict):
        if "dt" in value:
            return _matrix(name, value)
        return {key: _tree_value(key, item) for key, item in value.items()}
    return tuple(_tree_value(name, item) for item in value) if isinstance(value, list) else value


def _matrix(name: str, stored: Mapping[str, Any]) -> np.ndarray:
    """An array of `cv2.FileStorage`: its size, the type of its elements, which may have channels, and these."""
    try:
        sizes = np.array(stored["sizes"] if "sizes" in stored else [stored["rows"], stored["cols"]]).ravel().tolist()
        channels, kind = re.fullmatch(r"(\d{0,3})([a-z])", str(stored["dt"])).groups()  # type: ignore[union-attr]
        values = np.array(stored["data"], _KINDS[kind]).ravel()
        shape = (*sizes, int(channels)) if channels not in ("", "1") else tuple(sizes)
        if math.prod(shape) != len(values) or min(shape, default=0) < 0:
            raise ValueError(f"it has {len(values)} elements")
        return values.reshape(shape)
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as reason:
        raise error(f"`{name}` is a damaged matrix: {reason}", cv2.Error.StsParseError) from reason


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
    return _typed({name: _node_value(node.getNode(name)) for name in node.keys()})  # noqa: SIM118


def _typed(values: dict[str, Any]) -> dict[str, Any]:
    """Values as options have them."""
    for name, option in DETECTION.items():  # a file storage knows no bool
        if isinstance(option.default, bool) and isinstance(values.get(name), int) and values[name] in (0, 1):
            values[name] = bool(values[name])
    if isinstance(values.get("noise"), dict):
        try:
            values["noise"] = NoiseModel(**values["noise"])
        except TypeError:
            raise fail("noise", "a number, an array, or what a NoiseModel holds", values["noise"]) from None
    return values


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
