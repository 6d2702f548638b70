# SPDX-License-Identifier: BSD-3-Clause
"""Starts of runs as arrays or mappings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from .arrays import Array, numbers, real, unmasked
from .errors import ArgumentError
from .lazy import np
from .options import unknown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Start: TypeAlias = "Union[ArrayLike, Mapping[str, float]]"


def start_row(what: str, given: Start | None, names: tuple[str, ...], states: tuple[str, ...]) -> Array | None:
    """A value for each name, NaN where none is given. `states`: names whose values are rates. A series of pandas is taken by
    its names."""
    if given is None:
        return None
    if not isinstance(given, Mapping):
        index = getattr(given, "index", None)
        if index is not None and not callable(index) and all(isinstance(name, str) for name in index):
            given = dict(zip(index, unmasked(given)))
    if isinstance(given, Mapping):
        return _named(what, given, names, states)
    if isinstance(given, str):
        raise TypeError(f"{what} is an array or a mapping of names to numbers, not a text: {given!r}")
    row = numbers(given, what).copy() if np.ndim(given) else np.array(real(given, what))
    if row.shape != (len(names),):
        raise ValueError(
            f"{what} has {len(names)} values, in the order {', '.join(names)}, not the shape {row.shape}; a mapping of names "
            "to numbers may have some of them"
        )
    for k, (name, value) in enumerate(zip(names, row)):
        _finite(what, name, value)
        if name in states:
            row[k] = np.nan  # a row of a run has the integral of the state here, with which nothing starts
    return row


def _named(what: str, given: Mapping[str, Any], names: tuple[str, ...], states: tuple[str, ...]) -> Array:
    row = np.full(len(names), np.nan)
    for name, value in given.items():
        if name not in names:
            raise ArgumentError(f"{what}: {unknown('coordinate', name, names)}")
        if name in states:
            raise ArgumentError(f"{what}: '{name}' is a state, whose value at the start is in qd")
        if isinstance(value, str) or np.ndim(value) != 0:
            raise TypeError(f"{what} of '{name}' is a number in rad, m, rad/s or m/s, not {value!r}")
        row[names.index(name)] = _finite(what, name, float(value))
    return row


def _finite(what: str, name: str, value: float) -> float:
    if not np.isfinite(value):
        raise ValueError(f"{what} of '{name}' is {value}: a finite number is needed")
    return value
