# SPDX-License-Identifier: BSD-3-Clause
"""Structs of the library from keyword arguments, by reflection: a member of the struct is a keyword of its name.

A text may be given as a string, a number, a path, a list (words separated by commas) or a mapping ("name=value,..", where a
tuple of numbers is a range "from:to:count", and None an open side)."""

from __future__ import annotations

import functools
import json
import keyword
import math
import os
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

from ._native import ffi
from .errors import ArgumentError
from .lazy import np

Convert = Callable[[Any, list[Any]], Any]  # a value as C has it; the list keeps its memory
Write = Callable[[Any, Any, list[Any]], None]  # sets a member of a struct

# -- texts and numbers ------------------------------------------------------------------------------------


def utf8(text: str) -> bytes:
    """A text as C has it, which ends at its first NUL."""
    if not isinstance(text, str):
        raise TypeError(f"a text is needed, not {type(text).__name__}")
    return _whole_text(text.encode())


def path_of(path: str | os.PathLike[str]) -> bytes:
    """A path as C has it."""
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise TypeError(f"a path is needed, not {type(path).__name__}")
    return _whole_text(os.fsencode(path))


def _whole_text(text: bytes) -> bytes:
    if b"\0" in text:
        raise ValueError(f"a text or path cannot contain the character NUL: {text!r}")
    return text


def text_of(value: Any) -> str:
    """A value as the text that a model file or an option has."""
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, (bool, int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)) or np.ndim(value) == 0 and isinstance(value, np.ndarray):
        return repr(float(value))
    if isinstance(value, Mapping):
        return ",".join(f"{name}={_range_of(each)}" for name, each in value.items())
    if isinstance(value, Iterable):
        return ",".join(text_of(each) for each in value)
    raise TypeError(f"a text, number, list or mapping is needed, not {type(value).__name__}")


def _range_of(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        raise TypeError(f"a range is (from, to, count), not an array of {value.size} values")
    return ":".join("" if each is None else text_of(each) for each in value) if isinstance(value, (tuple, list)) else text_of(value)


def entry_of(value: Any) -> str:
    """A value as the text of an entry of the model language."""
    if isinstance(value, str):
        return value
    try:
        return json.dumps(value, indent=1, default=_plain, allow_nan=False)
    except ValueError as error:
        raise _not_finite(value, ()) or error from None


def _not_finite(value: Any, place: tuple[str, ...]) -> ValueError | None:
    """The error about the first number of an entry that is not finite, with its keys."""
    if isinstance(value, float) and not math.isfinite(value):
        return ValueError(f"{'.'.join(place) or 'the entry'} is {value}: a finite number is needed")
    members = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, (list, tuple)) else ()
    if isinstance(value, (np.ndarray, np.generic)):
        return _not_finite(value.tolist(), place)
    return next(filter(None, (_not_finite(each, (*place, str(key))) for key, each in members)), None)


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays for JSON."""
    return value.tolist() if hasattr(value, "tolist") else text_of(value)


def characters(text: str, keep: list[Any]) -> Any:
    keep.append(ffi.new("char[]", utf8(text)))
    return keep[-1]


def words(texts: Iterable[str], keep: list[Any]) -> Any:
    """An array of C strings."""
    keep.append(ffi.new("const char *[]", [characters(text, keep) for text in texts]))
    return keep[-1]


def number(value: Any, keep: list[Any]) -> Any:
    """A number of a model, which may be an expression."""
    return (0.0, characters(value, keep)) if isinstance(value, str) else (float(value), ffi.NULL)


def _text(value: Any, keep: list[Any]) -> Any:
    return characters(text_of(value), keep)


def _real(value: Any, keep: list[Any]) -> float:
    try:
        return float(value)
    except TypeError:
        raise TypeError(f"a number is needed, not {value!r}") from None
    except ValueError:
        raise ValueError(f"a number in SI is needed, not {value!r}") from None


def _whole(value: Any, keep: list[Any]) -> int:
    whole = int(value)
    if whole != value:
        raise ValueError(f"a whole number is needed, not {value!r}")
    return whole


# Members for which the library takes 0 as "not given", as it takes None here: a zero that is written is a mistake, as
# in the command. Whole numbers that are not here are words of yes and no.
_COUNTS = frozenset({"points", "seed", "most", "starts", "chunk", "count", "pool", "threads", "max_steps", "fmi"})
_FROM_ZERO = frozenset({"from"})  # here 0 is a value, and the default


def _positive(name: str, kind: Any) -> bool:
    return name in _COUNTS or (kind.cname == "double" and name not in _FROM_ZERO)


def _nonzero(key: str, convert: Convert) -> Convert:
    def converted(value: Any, keep: list[Any]) -> Any:
        number = convert(value, keep)
        if number == 0:
            raise ArgumentError(f"{key} needs a positive number, not {value!r}; None: it is not given")
        return number

    return converted


# -- structs ----------------------------------------------------------------------------------------------


class _Plan:
    """Description of a struct: what sets its members, by keyword, and the structs that it points to."""

    def __init__(self, struct: Any) -> None:
        members = {name: member.type for name, member in struct.fields}
        self.pointer = ffi.typeof(f"{struct.cname} *")
        self.size = ffi.sizeof(struct) if "size" in members else 0
        self.nested = {
            name: _plan(kind.item)
            for name, kind in members.items()
            if kind.kind == "pointer" and kind.item.kind == "struct"
        }
        counts = {f"{name[:-1]}_count" for name in members if name.endswith("s")}
        options = struct.cname.endswith("_options")
        self.members: dict[str, Write] = {
            keyword_of(name): _write(name, kind, members, options and _positive(name, kind))
            for name, kind in members.items()
            if name != "size" and name not in self.nested and name not in counts
        }
        inner = [name for plan in self.nested.values() for name in plan.names]
        self.names: tuple[str, ...] = (*self.members, *inner)  # all keywords


@functools.cache
def _plan(struct: Any) -> _Plan:
    return _Plan(ffi.typeof(struct) if isinstance(struct, str) else struct)


def keyword_of(member: str) -> str:
    """The keyword of a member; Python's own words have _ at the end, as `global_`."""
    return f"{member}_" if keyword.iskeyword(member) else member


def _converter(kind: Any) -> Convert:
    if kind.kind == "pointer":
        return _text
    if kind.kind == "struct":
        return number
    return _real if kind.cname in ("double", "float") else _whole


def _write(name: str, kind: Any, members: Collection[str], positive: bool) -> Write:
    """The statement that sets a member to a value; the number of texts is another member."""
    if kind.kind == "array":
        return _write_array(name, kind)
    if kind.kind == "pointer" and kind.item.kind == "pointer":
        return _write_texts(name, f"{name[:-1]}_count", members)
    convert = _nonzero(keyword_of(name), _converter(kind)) if positive else _converter(kind)
    return lambda struct, value, keep: setattr(struct, name, convert(value, keep))


def _write_array(name: str, kind: Any) -> Write:
    convert = _converter(kind.item)

    def write(struct: Any, value: Any, keep: list[Any]) -> None:
        place = getattr(struct, name)
        if isinstance(value, str) or not hasattr(value, "__len__"):
            raise TypeError(f"{kind.length} values are needed, not {value!r}")
        if len(value) != kind.length:
            raise ValueError(f"{kind.length} values are needed, not {len(value)}")
        for k, each in enumerate(value):
            place[k] = convert(each, keep)

    return write


def _write_texts(name: str, count: str, members: Collection[str]) -> Write:
    def write(struct: Any, value: Any, keep: list[Any]) -> None:
        texts = [value] if isinstance(value, str) else [text_of(each) for each in value]
        setattr(struct, name, words(texts, keep))
        if count in members:
            setattr(struct, count, len(texts))

    return write


def _fill(struct: Any, plan: _Plan, values: Mapping[str, Any], keep: list[Any]) -> None:
    if plan.size:
        struct.size = plan.size
    for name, inner in plan.nested.items():
        made = ffi.new(inner.pointer)
        keep.append(made)
        _fill(made, inner, values, keep)  # this keeps texts, too
        setattr(struct, name, made)
    for key, value in values.items():
        write = plan.members.get(key)
        if write is not None and value is not None:
            try:
                write(struct, value, keep)
            except ArgumentError:
                raise
            except (TypeError, ValueError, OverflowError) as wrong:
                raise (TypeError if isinstance(wrong, TypeError) else ValueError)(f"{key}: {wrong}") from None


def options(struct: str, values: Mapping[str, Any], *others: str, start: Any = None) -> tuple[Any, list[Any]]:
    """A struct of the library with the values of keywords, and what must live as long as it. `others`: keywords that are not
    of the struct; `start`: values of the struct to begin with."""
    plan = _plan(struct)
    for name in values:
        if name not in plan.names and name not in others:
            if name in ("q", "qd"):
                raise TypeError(
                    f"{name} is not a keyword here: start_at({name}=..) of a model or system gives another start for all studies; "
                    f"instances of an ensemble have theirs in columns {name}.NAME of its values"
                )
            raise TypeError(unknown("keyword", name, (*plan.names, *others)))
    keep: list[Any] = []
    made = ffi.new(plan.pointer) if start is None else ffi.new(plan.pointer, start)
    _fill(made, plan, values, keep)
    return made, keep


def unknown(what: str, name: object, known: Collection[str]) -> str:
    """The sentence about a name that does not exist, with names near to it."""
    import difflib

    near = difflib.get_close_matches(str(name), list(known), 3)
    there = f"near are {', '.join(near)}" if near else f"there are {', '.join(known) or 'none'}"
    return f"there is no {what} '{name}'; {there}"


def members_of(struct: Any) -> dict[str, Any]:
    """A struct of results as a dict; arrays become tuples."""
    found = {name: getattr(struct, name) for name, _ in ffi.typeof(struct).fields}
    return {name: tuple(value) if isinstance(value, ffi.CData) else value for name, value in found.items()}
