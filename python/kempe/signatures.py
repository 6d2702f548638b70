# SPDX-License-Identifier: BSD-3-Clause
"""Options of studies where help() and completion look for them: in signatures, and at the end of docstrings."""

from __future__ import annotations

import inspect
import re
from types import FunctionType
from typing import Any

from ._help import BASES, OPTIONS, RAISES

_UNPACKED = re.compile(r"Unpack\[(\w+)\]")


class _Listed(inspect.Signature):
    """The signature of a function with its options in place of **options, made when it is looked at."""

    def __init__(self, function: Any, options: dict[str, tuple[str, str]]) -> None:
        super().__init__(return_annotation=function.__annotations__["return"])
        self._function, self._options = function, options
        self._known: Any = None

    @property
    def parameters(self) -> Any:
        if self._known is None:
            plain = FunctionType(self._function.__code__, {}, "", self._function.__defaults__)
            plain.__kwdefaults__ = self._function.__kwdefaults__
            plain.__annotations__ = self._function.__annotations__
            *given, _ = inspect.signature(plain).parameters.values()
            only = inspect.Parameter.KEYWORD_ONLY
            added = [inspect.Parameter(name, only, default=None, annotation=f"{kind} | None") for name, (kind, _) in self._options.items()]
            self._known = inspect.Signature([*given, *added]).parameters
        return self._known

    def replace(self, **changes: Any) -> Any:
        return inspect.Signature(tuple(self.parameters.values()), return_annotation=self.return_annotation).replace(**changes)

    __replace__: Any = replace

    def __reduce__(self) -> Any:
        return inspect.Signature, (tuple(self.parameters.values()),), {"_return_annotation": self.return_annotation}


def list_options(*owners: Any) -> None:
    """Writes the options of functions, and of all methods of classes, that have them."""
    for each in owners:
        for member in vars(each).values() if isinstance(each, type) else [each]:
            found = _UNPACKED.search(str(getattr(member, "__annotations__", {}).get("options", "")))
            if found:
                _list(member, found[1])


def _list(function: Any, name: str) -> None:
    code = function.__code__
    own = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    options = {key: row for each in (name, *BASES[name]) for key, row in OPTIONS[each].items() if key not in own}
    function.__signature__ = _Listed(function, options)
    doc = (function.__doc__ or "").rstrip()
    end = "\n" + (function.__doc__ or "").rpartition("\n")[2] if "\n" in doc else "\n        "
    entries = "\n".join([text for _, text in options.values()])
    listed = _indented(f"\n\nOptions (None: not given):\n{entries}", end)
    function.__doc__ = doc + listed + f"\n\n{RAISES[name]}".replace("\n", end)


def _indented(text: str, end: str) -> str:
    """A list under a title; `end`: a line end and the margin of the docstring."""
    lines = text.split("\n")
    title = next(k for k, line in enumerate(lines) if line.endswith(":"))
    return end.join([*lines[: title + 1], *(f"    {line}" if line else "" for line in lines[title + 1 :])])
