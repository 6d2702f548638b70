# SPDX-License-Identifier: BSD-3-Clause
"""Structs of the library from keyword arguments, by reflection: a member of the struct is a keyword of its name.

A text may be given as a string, a number, a path, a list (words separated by commas) or a mapping ("name=value,..", where a
tuple of numbers is a range "from:to:count")."""

from __future__ import annotations

import functools
import keyword
import os
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from ._native import ffi
from .lazy import np

Member = tuple[str, Any]  # name, type


def text_of(value: Any) -> str:
    """A value as the text that a model file or an option has."""
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, Mapping):
        return ",".join(f"{name}={_range_of(each)}" for name, each in value.items())
    if isinstance(value, Iterable):
        return ",".join(text_of(each) for each in value)
    raise TypeError(f"a text, number, list or mapping is needed, not {type(value).__name__}")


def _range_of(value: Any) -> str:
    return ":".join(text_of(each) for each in value) if isinstance(value, (tuple, list)) else text_of(value)


def characters(text: str, keep: list[Any]) -> Any:
    keep.append(ffi.new("char[]", text.encode()))
    return keep[-1]


def words(texts: Iterable[str], keep: list[Any]) -> Any:
    """An array of C strings."""
    keep.append(ffi.new("const char *[]", [characters(text, keep) for text in texts]))
    return keep[-1]


class _Plan:
    """Description of a struct: members by keyword, with their types and the members that count them."""

    def __init__(self, struct: Any) -> None:
        members = {name: member.type for name, member in struct.fields}
        self.size = ffi.sizeof(struct) if "size" in members else 0
        self.nested = {name: kind for name, kind in members.items() if _nested(kind) is not None}
        self.members = {
            keyword_of(name): (name, kind, f"{name[:-1]}_count" if f"{name[:-1]}_count" in members else "")
            for name, kind in members.items()
            if name != "size" and name not in self.nested and not _is_count(name, members)
        }


@functools.cache
def _plan(struct: Any) -> _Plan:
    return _Plan(struct.item if struct.kind == "pointer" else struct)


@functools.cache
def names_of(struct: Any) -> tuple[str, ...]:
    """The keywords of a struct, and of structs that it points to."""
    plan = _plan(struct)
    inner = [name for kind in plan.nested.values() for name in names_of(kind)]
    return (*plan.members, *inner)


def keyword_of(member: str) -> str:
    """The keyword of a member; Python's own words have _ at the end, as `global_`."""
    return f"{member}_" if keyword.iskeyword(member) else member


def _nested(kind: Any) -> Any:
    return kind.item if kind.kind == "pointer" and kind.item.kind == "struct" else None


def _is_count(name: str, members: Mapping[str, Any]) -> bool:
    return name.endswith("_count") and name[: -len("_count")] + "s" in members


def refuse_unknown(function: str, known: Collection[str], given: Iterable[str]) -> None:
    """TypeError for keywords that do not exist, with names near to them."""
    for name in given:
        if name not in known:
            import difflib

            known = list(known)
            near = difflib.get_close_matches(name, known, 3) or known
            raise TypeError(
                f"{function} has no keyword '{name}'; {'near' if near is not known else 'there'} are {', '.join(near)}"
            )


def fill(struct: Any, values: Mapping[str, Any], keep: list[Any]) -> Any:
    """Sets the members of a struct that are among the values."""
    plan = _plan(ffi.typeof(struct))
    if plan.size:
        struct.size = plan.size
    for name, kind in plan.nested.items():
        keep.append(fill(ffi.new(f"{kind.item.cname} *"), values, keep))
        setattr(struct, name, keep[-1])
    for key, value in values.items():
        if value is not None and key in plan.members:
            name, kind, count = plan.members[key]
            _set(struct, name, kind, value, keep)
            if count:
                setattr(struct, count, 1 if isinstance(value, str) else len(value))
    return struct


def _set(struct: Any, name: str, kind: Any, value: Any, keep: list[Any]) -> None:
    if kind.kind == "pointer" and kind.item.kind == "pointer":
        value = [value] if isinstance(value, str) else value
        setattr(struct, name, words(map(text_of, value), keep))
    elif kind.kind == "array":
        place = getattr(struct, name)
        if len(value) != kind.length:
            raise ValueError(f"{name} has {kind.length} values, not {len(value)}")
        for k, each in enumerate(value):
            place[k] = converted(kind.item, each, keep)
    else:
        setattr(struct, name, converted(kind, value, keep))


def converted(kind: Any, value: Any, keep: list[Any]) -> Any:
    """A value as a C value of a type: a number, a text, or a number of a model, which may be an expression."""
    if kind.kind == "pointer":
        return characters(text_of(value), keep)
    if kind.kind == "struct":
        return (0.0, characters(value, keep)) if isinstance(value, str) else (float(value), ffi.NULL)
    return float(value) if kind.cname in ("double", "float") else int(value)


def options(function: str, struct: str, values: Mapping[str, Any]) -> tuple[Any, list[Any]]:
    """A struct of options of the library, and what must live as long as it."""
    kind = ffi.typeof(struct)
    refuse_unknown(function, names_of(kind), values)
    keep: list[Any] = []
    return fill(ffi.new(f"{struct} *"), values, keep), keep


def members_of(struct: Any) -> dict[str, Any]:
    """A struct of results as a dict; arrays become tuples."""
    found = {name: getattr(struct, name) for name, _ in ffi.typeof(struct).fields}
    return {name: tuple(value) if isinstance(value, ffi.CData) else value for name, value in found.items()}
