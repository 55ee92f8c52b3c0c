"""Settings in YAML, JSON or XML as nested dicts and lists, as far as files of cameras and parameters need them.

Of YAML it reads what calibration tools write: maps by indentation, lists in brackets or by dashes, plain and quoted
scalars, comments; a tag such as ``!!opencv-matrix`` is passed over. Anchors, block texts and the rest are refused, and
so is a key that is given twice; elements of XML of the same name are a list.
"""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from typing import Any

_DEPTH = 32  # levels of nesting
# What is no number, as cv2.FileStorage writes it and as JSON does.
_OF_JSON = {".Inf": "Infinity", "-.Inf": "-Infinity", ".Nan": "NaN", "-.Nan": "NaN"}
_STORED = re.compile(r"(?<=[\s\[:,])-?\.(?:Inf|Nan)\b")


def parse(text: str) -> Any:
    """Nested dicts and lists of strings, numbers, booleans and None."""
    start = text.lstrip("\ufeff \t\r\n")
    if start.startswith("<"):
        return _of_element(xml_root(start))
    if start.startswith(("{", "[")):
        try:
            return json.loads(_STORED.sub(lambda found: _OF_JSON[found[0]], start), object_pairs_hook=_map_of)
        except json.JSONDecodeError as reason:
            raise ValueError(f"its JSON is garbled: {reason}") from None
    return _Yaml(text).document()


def _map_of(entries: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in entries:
        if key in found:
            raise ValueError(f"its key {key[:60]!r} is given twice")
        found[key] = value
    return found


def xml_root(text: str) -> ElementTree.Element:
    """The outermost element. Entities, which could multiply without end, are refused."""
    if "<!ENTITY" in text or "<!DOCTYPE" in text:
        raise ValueError("it is XML with entities")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as reason:
        raise ValueError(f"its XML is garbled: {reason}") from None


def _of_element(element: ElementTree.Element, depth: int = 0) -> Any:
    if depth > _DEPTH:
        raise ValueError(f"it is nested more than {_DEPTH} levels")
    if len(element):
        found: dict[str, list[Any]] = {}
        for child in element:
            found.setdefault(child.tag, []).append(_of_element(child, depth + 1))
        if found.keys() == {"_"}:  # a list of lists of cv2.FileStorage
            return found["_"]
        return {tag: values[0] if len(values) == 1 else values for tag, values in found.items()}
    words = (element.text or "").split()
    return scalar(words[0]) if len(words) == 1 else [scalar(word) for word in words]


_WORDS = {"true": True, "false": False, "null": None, "~": None, "": None}


def scalar(word: str) -> Any:
    """A number, a word of YAML for true, false or nothing, else the text."""
    if len(word) > 1 and word[0] == word[-1] and word[0] in "'\"":
        return word[1:-1]
    try:
        return (
            int(word)
            if re.fullmatch(r"[-+]?\d{1,18}", word)
            else float(re.sub(r"^([-+]?)\.(nan|inf)$", r"\1\2", word.lower()))
        )
    except ValueError:
        return _WORDS.get(word.lower(), word)


class _Yaml:
    def __init__(self, text: str) -> None:
        self.lines: list[tuple[int, str]] = []
        for line in text.expandtabs().splitlines():
            content = _without_comment(line).rstrip()
            if content.strip() and not content.startswith(("%", "---", "...")):
                self.lines.append((len(content) - len(content.lstrip()), content.strip()))
        self.at = 0

    def document(self) -> Any:
        found = self._block(0)
        if self.at != len(self.lines):
            raise self._unreadable()
        return found

    def _unreadable(self) -> ValueError:
        return ValueError(f"its line {self.lines[self.at][1][:60]!r} is no YAML that is read here")

    def _block(self, depth: int) -> Any:
        """A map or a list, whose lines have one indentation."""
        if depth > _DEPTH:
            raise ValueError(f"it is nested more than {_DEPTH} levels")
        if self.at == len(self.lines):
            return None
        indentation, content = self.lines[self.at]
        if content == "-" or content.startswith("- "):
            return self._list(indentation, depth)
        return self._map(indentation, depth)

    def _map(self, indentation: int, depth: int) -> dict[str, Any]:
        entries: list[tuple[str, Any]] = []
        while self.at < len(self.lines) and self.lines[self.at][0] == indentation:
            entry = _key_and_rest(self.lines[self.at][1])
            if entry is None:
                raise self._unreadable()
            self.at += 1
            entries.append((entry[0], self._value(entry[1], indentation, depth)))
        return _map_of(entries)

    def _list(self, indentation: int, depth: int) -> list[Any]:
        found: list[Any] = []
        while self.at < len(self.lines) and self.lines[self.at][0] == indentation:
            content = self.lines[self.at][1]
            if content != "-" and not content.startswith("- "):
                break
            rest = content[1:].strip()
            if _key_and_rest(rest) or rest.startswith("- "):  # a map or a list of its own begins on this line
                self.lines[self.at] = (indentation + len(content) - len(rest), rest)
                found.append(self._block(depth + 1))
            else:
                self.at += 1
                found.append(self._value(rest, indentation, depth))
        return found

    def _value(self, text: str, indentation: int, depth: int) -> Any:
        """What stands behind a key or a dash: on its line, or below it."""
        text = re.sub(r"^!\S*\s*", "", text)
        if text.startswith(("[", "{")):
            lines, balance = [text], _brackets(text)
            while balance > 0:
                if self.at == len(self.lines):
                    raise ValueError("a bracket is not closed")
                lines.append(self.lines[self.at][1])
                balance += _brackets(lines[-1])
                self.at += 1
            return _Flow(" ".join(lines)).value()
        if text.startswith(("&", "*", "|", ">")):
            raise ValueError(f"its value {text[:60]!r} is no YAML that is read here")
        if text:
            return scalar(text)
        if self.at < len(self.lines):
            following, content = self.lines[self.at]
            if following > indentation or (following == indentation and content.startswith("- ")):
                return self._block(depth + 1)
        return None


def _without_comment(line: str) -> str:
    """The line up to a # that is not within quotes."""
    quote = ""
    for i, char in enumerate(line):
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"":
            quote = char
        elif char == "#" and (i == 0 or line[i - 1].isspace()):
            return line[:i]
    return line


def _key_and_rest(content: str) -> tuple[str, str] | None:
    """What is before and behind the colon of a line ``key: value``."""
    if content[:1] in ("'", '"'):
        end = content.find(content[0], 1)
        rest = content[end + 1 :].lstrip()
        return (content[1:end], rest[1:].lstrip()) if end > 0 and rest.startswith(":") else None
    end = content.find(": ")
    if end < 0:
        end = len(content) - 1 if content.endswith(":") else 0
    key = content[:end].rstrip()
    return None if not key or set(key) & set("[]{},#&*!|>%@`'\"") else (key, content[end + 1 :].lstrip())


def _brackets(text: str) -> int:
    return text.count("[") + text.count("{") - text.count("]") - text.count("}")


class _Flow:
    """A value in brackets or braces."""

    _TOKEN = re.compile(r"""([\[\]{},:]|"[^"]*"|'[^']*'|[^\s\[\]{},:"'][^\[\]{},:]*)""")

    def __init__(self, text: str) -> None:
        self.tokens = [token.strip() for token in self._TOKEN.findall(text)]
        self.at = 0

    def value(self) -> Any:
        found = self._value(0)
        if self.at != len(self.tokens):
            raise ValueError(f"{self.tokens[self.at][:60]!r} follows the end of a list")
        return found

    def _next(self) -> str:
        if self.at == len(self.tokens):
            raise ValueError("a list ends early")
        self.at += 1
        return self.tokens[self.at - 1]

    def _value(self, depth: int) -> Any:
        if depth > _DEPTH:
            raise ValueError(f"it is nested more than {_DEPTH} levels")
        token = self._next()
        if token == "[":
            return self._items(depth)
        if token == "{":
            return self._pairs(depth)
        if token in ("]", "}", ",", ":"):
            raise ValueError(f"{token!r} where a value is needed")
        return scalar(token)

    def _items(self, depth: int) -> list[Any]:
        found: list[Any] = []
        while self.tokens[self.at : self.at + 1] != ["]"]:
            found.append(self._value(depth + 1))
            if self.tokens[self.at : self.at + 1] == [","]:
                self.at += 1
            elif self.tokens[self.at : self.at + 1] != ["]"]:
                raise ValueError("a list lacks a comma")
        self.at += 1
        return found

    def _pairs(self, depth: int) -> dict[str, Any]:
        entries: list[tuple[str, Any]] = []
        while self.tokens[self.at : self.at + 1] != ["}"]:
            key = self._next().strip("'\"")
            if self._next() != ":":
                raise ValueError(f"the key {key[:60]!r} has no value")
            entries.append((key, self._value(depth + 1)))
            if self.tokens[self.at : self.at + 1] == [","]:
                self.at += 1
            elif self.tokens[self.at : self.at + 1] != ["}"]:
                raise ValueError("a map lacks a comma")
        self.at += 1
        return _map_of(entries)
