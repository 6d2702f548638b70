# SPDX-License-Identifier: BSD-3-Clause
"""Results without the library behind them: what a pickled result is when it is read. It has the numbers, tables and texts
of the result; what the library would have to compute, as further outputs or a page, needs the result itself."""

from __future__ import annotations

import contextlib
from typing import Any, NoReturn

from .errors import Error

Values = dict[str, Any]


def kept_names(kind: type) -> dict[str, None]:
    """Names of the attributes that a class of results and its bases read from the library."""
    return dict.fromkeys(name for base in reversed(kind.__mro__) for name in getattr(base, "_kept", ()))


def values_of(result: Any) -> Values:
    """All that is kept of a result."""
    values: Values = {name: getattr(result, name) for name in kept_names(type(result))}
    values.update(
        (name, [getattr(result, name)(k) for k in range(len(result))])
        for name in getattr(type(result), "_kept_each", ())
    )
    for name in type(result).tables_and_matrices():
        values[name] = getattr(result, name)
    values["text"] = {full: result.text(full) for full in (False, True)}
    values["dict"] = result.to_dict()
    if hasattr(result, "__len__"):
        values["len"] = len(result)
    if hasattr(result, "svg"):
        with contextlib.suppress(Error):  # nothing varies
            values["svg"] = result.svg()
    return values


class Kept:
    """Reads from values what a class of results reads from the library."""

    _values: Values

    def text(self, full: bool = False) -> str:
        made: str = self._values["text"][full]
        return made

    def to_dict(self) -> Values:
        made: Values = self._values["dict"]
        return made

    def svg(self) -> str:
        made: str = self._values["svg"]
        return made

    def table(self, name: str) -> Any:
        return self._values[name]

    matrix = table

    def __reduce__(self) -> Any:
        return read_again, (type(self).__mro__[2], self._values)

    def _absent(self) -> NoReturn:
        name = type(self).__name__
        raise TypeError(
            f"a {name} that was pickled has only its numbers, tables and texts: this needs the {name} itself"
        )

    _context = _pointer = property(_absent)


def read_again(kind: type, values: Values) -> Any:
    """A result of pickled values. It is an instance of its class."""
    made: Any = object.__new__(_class_of(kind))
    made._values = values
    return made


_classes: dict[type, type] = {}


def _class_of(kind: type) -> type:
    if kind not in _classes:
        members: Values = {name: _value(name) for name in [*kept_names(kind), *kind.tables_and_matrices()]}  # type: ignore[attr-defined]
        members.update((name, _each(name)) for name in getattr(kind, "_kept_each", ()))
        if hasattr(kind, "__len__"):
            members["__len__"] = lambda self: self._values["len"]
        members.update(__module__=kind.__module__, __doc__=kind.__doc__, __qualname__=kind.__qualname__)
        _classes[kind] = type(kind.__name__, (Kept, kind), members)
    return _classes[kind]


def _value(name: str) -> property:
    return property(lambda self: self._values[name])


def _each(name: str) -> Any:
    def of(self: Any, k: int = 0) -> Any:
        if not -len(self) <= k < len(self):
            raise IndexError(k)
        return self._values[name][k]

    return of
