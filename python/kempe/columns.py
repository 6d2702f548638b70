# SPDX-License-Identifier: BSD-3-Clause
"""Data in memory where the library reads a table: columns by name become the text of that table, with all digits."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeGuard

from .arrays import Array, unmasked
from .errors import ArgumentError
from .lazy import np
from .table import column_name

if TYPE_CHECKING:
    from .context import Context


class Frame(Protocol):
    """Columns by name, such as a pandas.DataFrame."""

    @property
    def columns(self) -> Any: ...

    def __getitem__(self, name: Any) -> Any: ...


class Motion(Protocol):
    """A trajectory."""

    @property
    def rows(self) -> Any: ...

    @property
    def qdd(self) -> Any: ...


# Options that are tables, by their struct; a list of tables is given as texts.
TABLES: dict[str, tuple[str, ...]] = {
    "kempe_run_options": ("reference",),
    "kempe_comfort_options": ("reference",),
    "kempe_compare_options": ("reference",),
    "kempe_limit_cycles_options": ("reference",),
    "kempe_sensitivity_options": ("reference",),
    "kempe_flow_options": ("reference",),
    "kempe_fit_options": ("data", "files", "start", "reference"),
    "kempe_inverse_options": ("motion",),
    "kempe_optimum_options": ("start", "reference"),
}
_WITH_WORDS = ("start",)  # tables whose columns may be words
_METHODS = ("hold", "linear", "cubic")
_SAMPLES = '{"t": times, "value": values or a function of t, "method": "linear"}'
_FORMS = 'a path, a mapping of names to columns, as {"t": .., "q(arm)": ..}, a data frame or a table'


def is_path(data: Any) -> TypeGuard[str | os.PathLike[str]]:
    return isinstance(data, (str, bytes, os.PathLike))


def _states_of(run: Any) -> set[str]:
    """Names of the states among the names of a trajectory; of one that was pickled as far as its rows have them."""
    try:
        known = run.outputs("q,qd,qdd,state").names
    except (AttributeError, TypeError):
        known = run.rows.names
    return {name for name in run.names if f"state.{name}" in known}


def given_columns(what: str, data: Any, index: bool = True) -> dict[str, Any]:
    """The columns of a mapping, a data frame, a structured array, a table or a trajectory. `index`: the index t of a frame is a
    column."""
    if hasattr(data, "qdd") and hasattr(data, "rows"):  # a trajectory
        rows: dict[str, Any] = {"t": data.t}
        states = _states_of(data)
        for k, name in enumerate(data.names):  # the value of a state is a rate
            kinds = {"state": "qd"} if name in states else {"q": "q", "qd": "qd", "qdd": "qdd"}
            rows.update((f"{word}.{name}", getattr(data, kind)[:, k]) for word, kind in kinds.items())
        return rows
    if isinstance(data, Mapping):
        return dict(data)
    names = getattr(getattr(data, "dtype", None), "names", None)
    if names is None and hasattr(data, "__getitem__") and not callable(getattr(data, "columns", None)):
        names = getattr(data, "columns", None)
    if names is None:
        said = f"an array of the shape {np.shape(data)} without names" if hasattr(data, "shape") else type(data).__name__
        if callable(data):
            said = "a function; a column of a mapping may be a function of its column t"
        raise TypeError(f"{what}: {_FORMS} is needed, not {said}")
    found = {name: data[name] for name in names}
    times = getattr(data, "index", None)
    if index and "t" not in found and getattr(times, "name", None) == "t":
        found = {"t": times, **found}
    return found


def _split(name: Any, what: str) -> tuple[str, str]:
    """A name without its unit, and " [deg]"."""
    if not isinstance(name, str):
        raise TypeError(f"{what}: names of columns are texts, not {name!r}")
    bare, bracket, unit = name.partition("[")
    bare = column_name(bare.strip())
    if not bare or any(sign in bare + unit for sign in ',#"\n\r\0'):
        raise ValueError(f"{what}: {name!r} cannot be the name of a column")
    return bare, f" {bracket}{unit}".rstrip()


def _sampled(what: str, name: str, function: Callable[[float], Any], t: Any) -> Any:
    if t is None or callable(t):
        raise ArgumentError(f"{what}: '{name}' is a function of t; the times at which it is taken are needed as the column t")
    return [function(float(time)) for time in np.asarray(unmasked(t), dtype=float)]


def _array(what: str, name: str, values: Any, words: bool) -> Any:
    """A column of numbers, or columns of vectors."""
    array = values = unmasked(values)
    if array.dtype.kind in "US" or (array.dtype.kind == "O" and any(isinstance(each, str) for each in array.flat)):
        if words:
            return array.astype(str)
        raise TypeError(f"{what}: the column '{name}' has texts, and numbers are needed")
    if array.dtype.kind in "Mmc":
        raise TypeError(f"{what}: the column '{name}' has values of {array.dtype}; numbers are needed, times in s")
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{what}: the column '{name}' has values that are not numbers") from None
    if array.ndim not in (1, 2) or (array.ndim == 2 and array.shape[1] > 3):
        raise ValueError(f"{what}: the column '{name}' has the shape {array.shape}; one value for each time is needed, or x, y, z")
    if np.isinf(array).any():
        raise ValueError(f"{what}: the column '{name}' has an infinite value in row {int(np.argwhere(np.isinf(array))[0][0])}")
    return array


def columns_of(what: str, data: Any, words: bool = False, index: bool = True) -> dict[str, Array]:
    """Columns of one length, named as in tables of results; vectors are a column for each component."""
    given = given_columns(what, data, index)
    t = next((values for name, values in given.items() if name == "t" or str(name).startswith("t [")), None)
    columns: dict[str, Any] = {}
    for name, values in given.items():
        bare, unit = _split(name, what)
        array = _array(what, str(name), _sampled(what, str(name), values, t) if callable(values) else values, words)
        parts = {bare + unit: array} if array.ndim == 1 else {f"{bare}.{axis}{unit}": array[:, k] for k, axis in zip(range(array.shape[1]), "xyz")}
        for part, column in parts.items():
            if part in columns:
                raise ValueError(f"{what}: the column '{part}' is given twice")
            columns[part] = column
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"'{name}' {length}" for name, length in lengths.items())
        raise ValueError(f"{what}: columns of one length are needed; there are {said}")
    if not columns or not next(iter(lengths.values())):
        raise ValueError(f"{what}: there are no {'rows' if columns else 'columns'}")
    return columns


def text_of_table(what: str, data: Any, words: bool = False) -> str:
    """The text of a table. Unknown numbers, NaN, are empty cells."""
    columns = columns_of(what, data, words)
    t = columns.get("t")
    if t is not None:
        _check_times(what, t)
    cells = [[_cell(value) for value in column.tolist()] for column in columns.values()]
    return "\n".join([",".join(columns), *map(",".join, zip(*cells))]) + "\n"


def _cell(value: Any) -> str:
    return value if isinstance(value, str) else "" if value != value else repr(value)


def _check_times(what: str, t: Array) -> None:
    unknown = np.flatnonzero(np.isnan(t))
    if unknown.size:
        raise ValueError(f"{what}: the time of row {unknown[0]} is nan")
    back = np.flatnonzero(np.diff(t) <= 0)
    if back.size:
        k = int(back[0]) + 1
        raise ValueError(f"{what}: the times must increase; row {k} has {t[k]:.9g} s after {t[k - 1]:.9g} s")


# -- where tables are given ------------------------------------------------------------------------------


def with_tables(struct: str, values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Values of options in which tables in memory are replaced by names, and their texts by these names."""
    made = dict(values)
    texts: dict[str, str] = {}
    for key in TABLES.get(struct, ()):
        value = made.get(key)
        if value is None or is_path(value):
            continue
        if key == "files":
            made[key] = [_named(f"files[{k}]", each, False, texts) for k, each in enumerate(_list(key, value))]
        else:
            made[key] = _named(key, value, key in _WITH_WORDS, texts)
    return made, texts


def _list(key: str, value: Any) -> Sequence[Any]:
    if not isinstance(value, (list, tuple)):
        raise TypeError(f"{key}: a list of tables is needed, not {type(value).__name__}")
    return value


def _named(what: str, data: Any, words: bool, texts: dict[str, str]) -> Any:
    if is_path(data):
        return data
    texts[what] = text_of_table(what, data, words)
    return what


class TextsFor:
    """Gives texts to a context in place of files, for the time of a call."""

    def __init__(self, context: Context, texts: Mapping[str, str]) -> None:
        self.context, self.texts = context, texts

    def __enter__(self) -> None:
        self.context.lock.acquire()
        for name, text in self.texts.items():
            self.context.set_text(name, text)

    def __exit__(self, *failure: object) -> None:
        for name in self.texts:
            self.context.set_text(name, None)
        self.context.lock.release()


# -- samples of inputs -------------------------------------------------------------------------------------


def is_samples(name: str, value: Any) -> bool:
    """True of samples, False of a number or text."""
    if is_path(value) or np.ndim(value) == 0 and not isinstance(value, Mapping) and not callable(value):
        return False
    if isinstance(value, Mapping) or hasattr(value, "columns"):
        return True
    kind = "a function" if callable(value) else f"{len(value)} values"
    raise TypeError(f"{name}: {_SAMPLES} is needed for an input that varies, and a number or text otherwise, not {kind}")


def samples_of(name: str, value: Any) -> dict[str, Any]:
    """Samples of an input: {"t": .., "value": .., "method": "linear"}, whose values may be a function of t."""
    given = dict(value) if isinstance(value, Mapping) else given_columns(name, value)
    method = given.pop("method", None)
    if set(given) != {"t", "value"}:
        there = ", ".join(map(str, given)) or "none"
        raise ArgumentError(f"{name}: samples are {_SAMPLES}; there are the columns {there}")
    if method not in _METHODS:
        said = "is missing" if method is None else f"is {method!r}"
        raise ArgumentError(f"{name}: the method between samples {said}; it is one of {', '.join(_METHODS)}")
    columns = columns_of(name, given)
    for part in columns.values():
        if np.isnan(part).any():
            raise ValueError(f"{name}: the sample of row {int(np.flatnonzero(np.isnan(part))[0])} is nan")
    if set(columns) != {"t", "value"}:
        raise ValueError(f"{name}: the values of an input are numbers, one for each time")
    _check_times(name, columns["t"])
    return {**columns, "method": method}
