# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of float64: views of the library's memory, which keep its owner alive, and arguments."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from ._native import ffi
from .errors import ArgumentError
from .lazy import np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = "NDArray[np.float64]"
Order = Literal["C", "F"]
DOUBLES = ffi.typeof("double[]")
INTS = ffi.typeof("int[]")
_from_buffer = ffi.from_buffer


class _Owner:
    """The owner of memory of the library. It lives as long as a pointer that would free it by this."""

    __slots__ = ("owner",)

    def __init__(self, owner: Any) -> None:
        self.owner = owner

    def __call__(self, pointer: Any) -> None:
        """The owner frees it."""


def view(pointer: Any, shape: tuple[int, ...], owner: Any, order: Order = "C") -> Array:
    """A read-only array of the library's memory, without a copy."""
    size = math.prod(shape)
    if pointer == ffi.NULL or size == 0:
        empty = np.full(shape, np.nan)
        empty.flags.writeable = False
        return empty
    memory = ffi.buffer(ffi.gc(pointer, _Owner(owner)), 8 * size)
    return np.frombuffer(memoryview(memory).toreadonly()).reshape(shape, order=order)


def unmasked(values: Any) -> Any:
    """Values as an array; the masked ones of a masked array are unknown, NaN."""
    if not isinstance(values, np.ma.MaskedArray):
        return np.asarray(values)
    return np.ma.filled(values.astype(np.float64), np.nan) if np.ma.is_masked(values) else values.data


def numbers(values: Any, name: str) -> Array:
    """Numbers as a contiguous array of float64; an error has the name of the argument."""
    if isinstance(values, Mapping):
        raise TypeError(f"{name} is an array of numbers, not a mapping of names")
    try:
        given = unmasked(values)
        if given.dtype.kind in "US" or given.dtype.kind == "O" and any(each is None for each in given.flat):
            raise TypeError
        if given.dtype.kind != "c":
            return np.ascontiguousarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        shown = repr(values)
        raise TypeError(f"{name} is an array of numbers, not {shown if len(shown) < 60 else type(values).__name__}") from None
    raise TypeError(f"{name} has complex numbers, and real ones are needed")


def real(value: Any, name: str) -> float:
    """A number of a call; an error has the name of the argument."""
    if not isinstance(value, str):
        try:
            return float(value)
        except (TypeError, ValueError):
            pass
    raise TypeError(f"{name} is a number in SI, not {value!r}")


def finite(value: Any, name: str) -> float:
    """As real; NaN and infinity are refused."""
    number = real(value, name)
    if not math.isfinite(number):
        raise ArgumentError(f"{name} is {number}: give a finite number")
    return number


def all_finite(array: Array, name: str, names: tuple[str, ...]) -> Array:
    """An array whose entries have names; NaN and infinity are refused by these."""
    if not np.isfinite(array).all():
        k = int(np.flatnonzero(~np.isfinite(array))[0])
        raise ArgumentError(f"{name} of '{names[k]}' is {array[k]:g}: give a finite number")
    return array


def whole(value: Any, name: str) -> int:
    """A whole number of a call."""
    if isinstance(value, str) or real(value, name) % 1 != 0:
        raise TypeError(f"{name} is a whole number, not {value!r}")
    return int(value)


def of_class(value: Any, kind: type[Any], name: str, how: str) -> Any:
    """An object of Kempe as an argument. `how`: what makes such an object."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} is a {kind.__name__}, from {how}, not {type(value).__name__}")
    return value


def matched(values: ArrayLike, count: int, name: str) -> Array:
    """`count` numbers as a contiguous array of float64."""
    array = numbers(values, name)
    if array.shape != (count,):
        raise ValueError(f"{name} has {count} values, not the shape {np.shape(values)}")
    return array


def converted(values: ArrayLike | None, count: int, name: str) -> Array | None:
    """As matched; None stays."""
    return None if values is None else matched(values, count, name)


def vector(values: ArrayLike, count: int, name: str) -> Any:
    """`count` numbers as an argument; anything but a contiguous array of float64 is converted."""
    return _from_buffer(DOUBLES, matched(values, count, name))


def optional(values: ArrayLike | None, count: int, name: str) -> Any:
    """As vector; None is NULL."""
    return ffi.NULL if values is None else vector(values, count, name)


def writable(array: Array, shape: tuple[int, ...], name: str, order: Order = "C") -> Any:
    """An array of the caller as memory to be written."""
    try:
        if array.dtype == np.float64 and array.shape == shape:
            return _from_buffer(DOUBLES, array if order == "C" else array.T, True)
    except (AttributeError, ValueError, BufferError):  # no array, not contiguous, read-only
        pass
    raise ValueError(f"{name} must be a writable array of float64 of the shape {shape}, contiguous in order {order}")


def by_name(rows: Any, names: tuple[str, ...]) -> Any:
    """Rows of values in the order of `names`, where their columns have names: a data frame or one row of it, a mapping, a
    structured array. Other arrays are left as they are."""
    if isinstance(rows, Mapping):
        have: Any = tuple(rows)
    else:
        have = getattr(getattr(rows, "dtype", None), "names", None) or getattr(rows, "columns", None)
        if have is None and getattr(rows, "ndim", 0) == 1:
            have = getattr(rows, "index", None)
    if have is None or callable(have) or not all(isinstance(name, str) for name in have):
        return rows
    missing = [name for name in names if name not in have]
    if missing:
        raise ArgumentError(f"there is no column '{missing[0]}'; there are {', '.join(have)}")
    columns = [np.asarray(unmasked(rows[name]), dtype=float) for name in names]
    return np.stack(columns, axis=-1) if columns else np.empty((len(rows), 0))
