"""What an option is, and what follows from its declaration: checks, keywords, signatures, documentation."""

from __future__ import annotations

import functools
import inspect
import textwrap
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, TypeVar

import numpy as np

from . import _check

Check = Callable[[str, Any], Any]  # of a name and a value; returns the value in its own type
_Function = TypeVar("_Function", bound=Callable[..., Any])
_Kind = TypeVar("_Kind", bound="Options")


@dataclass(frozen=True)
class Option:
    """All that is known about an option."""

    default: Any
    check: Check
    form: str  # its type, as numpydoc has it
    text: str
    group: str = ""
    unit: str = ""
    kept: str = ""  # annotation of the value once checked, where that is not the annotation of the field
    read: Callable[[str], Any] = float  # of the command line; bool is a switch
    metavar: str = "X"
    flagged: str = ""  # what the help of the command line says instead of `text` and the default
    choices: Mapping[str, int] = field(default_factory=dict)  # words of the command line
    constants: Mapping[str, int] = field(default_factory=dict)  # of which the value is one
    kernel: str = ""  # its name in the parameters of the kernel on scan lines; by default its own in snake case
    name: str = ""
    annotation: str = ""

    @functools.cached_property
    def documented(self) -> str:
        """The entry of the option in a numpydoc section."""
        text = textwrap.fill(self.text, 112, break_on_hyphens=False)
        return f"{self.name} : {self.form}{f', {self.unit}' if self.unit else ''}\n{textwrap.indent(text, '    ')}"


def option(default: Any, check: Check, form: str, text: str, **more: Any) -> Any:
    """A field of a class of options."""
    return field(default=default, metadata={"option": Option(default, check, form, text, **more)})


class Options:
    """Base of the classes of options."""

    options: ClassVar[dict[str, Option]]

    def __post_init__(self) -> None:
        try:
            for name, own in self.options.items():
                object.__setattr__(self, name, own.check(name, getattr(self, name)))
        except _check.error as problem:
            problem.name(type(self).__name__)
            raise

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in self.options)

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash

    def changed(self) -> str:
        """The options that are not at their default, as keywords."""
        own = {name: getattr(self, name) for name in self.options}
        changed = [name for name, value in own.items() if not np.array_equal(value, self.options[name].default)]
        return ", ".join(f"{name}={_check.described(own[name])}" for name in changed)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.changed()})"


def declared(kind: type[_Kind]) -> type[_Kind]:
    """Collect the options of a class, and document them where its docstring says {options}."""
    kind.options = {}
    for f in fields(kind):  # type: ignore[arg-type]
        own = f.metadata["option"]
        kind.options[f.name] = Option(**{**vars(own), "name": f.name, "annotation": f.type})
    kind.__doc__ = _with_options(kind.__doc__, kind.options.values())
    return kind


def _with_options(doc: str | None, options: Collection[Option]) -> str | None:
    """A docstring with the entries of the options where it says {options}."""
    if doc is None:
        return None
    return doc.replace("    {options}", textwrap.indent("\n".join(own.documented for own in options), "    "))


def takes(options: Mapping[str, Option], **shown_default: Any) -> Callable[[_Function], _Function]:
    """Let a public function take options as `**options`: refuse others, show and document these.

    The signature shows their defaults, or `default` where that is given.
    """

    def taking(function: _Function) -> _Function:
        signature = inspect.signature(function)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        others = [option for name, option in options.items() if name not in signature.parameters]
        keyword = inspect.Parameter.KEYWORD_ONLY
        shown = [
            inspect.Parameter(o.name, keyword, default=shown_default.get("default", o.default), annotation=o.annotation)
            for o in others
        ]
        allowed = [p.name for p in (*own, *shown)]

        @_check.public
        @functools.wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            for name in kwargs:
                if name not in allowed:
                    raise _unknown(name, allowed)
            return function(*args, **kwargs)

        call.__signature__ = signature.replace(parameters=own + shown)  # type: ignore[attr-defined]
        call.__doc__ = _with_options(call.__doc__, options.values())
        return call  # type: ignore[return-value]

    return taking


def _unknown(name: str, allowed: Collection[str]) -> _check.error:
    from difflib import get_close_matches

    close = get_close_matches(name, allowed, 1)
    return _check.error(f"unknown argument `{name}`{f'; did you mean `{close[0]}`?' if close else ''}")


def parsed(options: Mapping[str, Any], *kinds: type[Options]) -> tuple[Any, ...]:
    """The options as one object of each class."""
    return tuple(kind(**{name: value for name, value in options.items() if name in kind.options}) for kind in kinds)
