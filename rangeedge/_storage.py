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
from .io.atomic import write_atomically, writing
from .io.settings import parse
from .io.source import file_name, opened
from .noise_model import NoiseModel
from .options import DETECTION

_SUFFIXES = (".xml", ".yml", ".yaml", ".json")  # by which cv2.FileStorage knows the format
_TYPES = dict(zip("ucwsifd", ("u1", "i1", "u2", "i2", "i4", "f4", "f8"), strict=True))  # of cv2's matrices
# The first and the last key of a file that `save` has written: YAML that has lost its end is YAML again.
_OPENING, _CLOSING = "savedBy", "complete"


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
    with writing(name):
        write_atomically(name, fs.releaseAndGetString().encode())


def load(filename: str | os.PathLike[str], node: str) -> tuple[str, dict[str, Any]]:
    """The name of a file, and the values under the node of that name in it."""
    name = file_name(filename, "filename")
    with opened(name) as (stream, size):
        tree = parse(stream.read(size).decode("utf-8-sig"))
    if not isinstance(tree, Mapping) or not isinstance(tree.get(node), Mapping):
        raise error(f"{name!r} holds no `{node}`", cv2.Error.StsParseError)
    if _OPENING in tree and tree.get(_CLOSING) != 1:
        raise error(f"{name!r} is not complete", cv2.Error.StsParseError)
    try:
        return name, _checked({key: _tree_value(key, value) for key, value in tree[node].items()})
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
    return _checked({name: _node_value(node.getNode(name)) for name in node.keys()})  # noqa: SIM118


def _checked(values: dict[str, Any]) -> dict[str, Any]:
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


def _tree_value(name: str, value: Any) -> Any:
    """What `_write_node` has written, of nested dicts and lists."""
    if isinstance(value, list):
        return tuple(_tree_value(name, element) for element in value)
    if not isinstance(value, Mapping):
        return value
    return _matrix(name, value) if "dt" in value else {key: _tree_value(key, own) for key, own in value.items()}


def _matrix(name: str, parts: Mapping[str, Any]) -> np.ndarray:
    """A matrix of one channel as cv2 writes it: rows and cols, or sizes, with type and data."""
    try:
        shape = np.ravel(parts["sizes"] if "sizes" in parts else (parts["rows"], parts["cols"])).tolist()
        values = np.array(parts["data"], np.float64).ravel()
        if min(shape, default=0) < 1:
            raise ValueError(f"its size is {shape}")
        return values.reshape(shape).astype(_TYPES[parts["dt"]])
    except (KeyError, TypeError, ValueError, OverflowError) as reason:
        raise error(f"`{name}` is a damaged matrix: {reason}", cv2.Error.StsParseError) from reason


def _node_value(node: cv2.FileNode) -> Any:
    """The same of nodes of a file storage."""
    if node.isInt():
        return int(node.real())
    if node.isReal():
        return node.real()
    if node.isSeq():
        return tuple(_node_value(node.at(i)) for i in range(node.size()))
    if not node.isMap():
        return node.string() if node.isString() else None
    keys = node.keys()
    if "dt" not in keys:
        return {key: _node_value(node.getNode(key)) for key in keys}
    try:
        if not {"data"} < set(keys) or not ({"rows", "cols"} <= set(keys) or "sizes" in keys):
            raise error("it lacks its size or data")
        return node.mat()
    except cv2.error as problem:
        raise error(f"`{node.name()}` is a damaged matrix: {problem.err}", problem.code) from problem
