# SPDX-License-Identifier: BSD-3-Clause
"""Options of studies where help() and completion look for them: in signatures, and at the end of docstrings. Both are made of the
classes of options when the package is imported, and agree with the headers of the library."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Callable
from typing import Any

from . import _options

_ENTRY = re.compile(r"\n(?=\w+:)")
_UNPACKED = re.compile(r"Unpack\[(\w+)\]")


def list_options(*owners: Any) -> None:
    """Writes the options of functions, and of all methods of classes, that have them."""
    for each in owners:
        for member in vars(each).values() if isinstance(each, type) else [each]:
            found = _UNPACKED.search(str(getattr(member, "__annotations__", {}).get("options", "")))
            if found:
                _list(member, getattr(_options, found[1]))


def _list(function: Callable[..., Any], kind: Any) -> None:
    plain = inspect.signature(function)
    given = [each for each in plain.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
    names = {each.name for each in given}
    types = {name: getattr(text, "__forward_arg__", text) for name, text in kind.__annotations__.items()}
    words = {name: text for name, text in _words(kind).items() if name not in names}
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=f"{types[name]} | None")
        for name in words
    ]
    function.__signature__ = plain.replace(parameters=[*given, *added])  # type: ignore[attr-defined]
    function.__doc__ = "\n\n".join(
        [
            inspect.cleandoc(function.__doc__ or ""),
            "\n".join(["Options (None: not given):", *(_indented(f"{name}: {text}") for name, text in words.items())]),
            "\n".join(["Raises:", *map(_indented, _options.RAISES[kind.__name__])]),
        ]
    )


def _words(kind: Any) -> dict[str, str]:
    """The text of each option. Own ones come first, then the options of runs, and progress."""
    found: dict[str, str] = {}
    for each in [kind, *(getattr(_options, name) for name in _options.BASES[kind.__name__])]:
        _, _, entries = inspect.cleandoc(each.__doc__ or "").partition("\n\n")
        for entry in _ENTRY.split(entries):
            name, _, text = entry.partition(":")
            found.setdefault(name, " ".join(text.split()))
    return found


def _indented(text: str) -> str:
    return textwrap.fill(text, 120, initial_indent="    ", subsequent_indent="        ")
