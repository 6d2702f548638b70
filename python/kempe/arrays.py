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


def matched(values: ArrayLike, count: int, name: str) -> Array:
    """`count` numbers as a contiguous array of float64."""
    array = np.ascontiguousarray(values, dtype=np.float64)
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
    except (ValueError, BufferError):  # not contiguous, read-only
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
    columns = [np.asarray(rows[name], dtype=float) for name in names]
    return np.stack(columns, axis=-1) if columns else np.empty((len(rows), 0))
