# SPDX-License-Identifier: BSD-3-Clause
"""IPOPT's interface for C: nonlinear programs with sparse derivatives. CasADi's wheel has the library, and so have distributions."""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import importlib.util
import pathlib
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from .arrays import Array
from .errors import FailedError
from .lazy import np

_INDEX, _NUMBER, _BOOL = ctypes.c_int, ctypes.c_double, ctypes.c_int
_NUMBERS, _INDICES, _USER = ctypes.POINTER(_NUMBER), ctypes.POINTER(_INDEX), ctypes.c_void_p
_AT = (_INDEX, _NUMBERS, _BOOL)  # the beginning of each function: the number of unknowns, these, and whether they are new
_STRUCTURE = (_INDICES, _INDICES, _NUMBERS, _USER)
_VALUE = ctypes.CFUNCTYPE(_BOOL, *_AT, _NUMBERS, _USER)
_CONSTRAINTS = ctypes.CFUNCTYPE(_BOOL, *_AT, _INDEX, _NUMBERS, _USER)
_JACOBIAN = ctypes.CFUNCTYPE(_BOOL, *_AT, _INDEX, _INDEX, *_STRUCTURE)
_HESSIAN = ctypes.CFUNCTYPE(_BOOL, *_AT, _NUMBER, _INDEX, _NUMBERS, _BOOL, _INDEX, *_STRUCTURE)
_ITERATION = ctypes.CFUNCTYPE(_BOOL, _INDEX, _INDEX, *[_NUMBER] * 8, _INDEX, _USER)

_REASONS = {
    0: "IPOPT found a point that is optimal within the tolerance",
    1: "IPOPT found a point that is optimal within a hundred times the tolerance, and no better one",
    2: "IPOPT found no motion within the limits: it ended where their violation is least",
    3: "IPOPT's steps became too small",
    4: "the unknowns grow without bound",
    -1: "the iterations have been used up",
    -2: "IPOPT found no step that keeps the limits better",
    -13: "IPOPT came to positions at which the mechanism cannot be evaluated, such as the edge of its reach",
}


class Program(Protocol):
    """A program: the least of value(z) for low <= z <= high and least <= constraints(z) <= most. Matrices are given by the rows
    and columns of their entries; of the Hessian the lower triangle. A FailedError makes IPOPT shorten its step."""

    low: Array
    high: Array
    least: Array
    most: Array
    jacobian_places: tuple[Array, Array]
    hessian_places: tuple[Array, Array]

    def value(self, z: Array) -> float: ...
    def gradient(self, z: Array) -> Array: ...
    def constraints(self, z: Array) -> Array: ...
    def jacobian(self, z: Array) -> Array: ...
    def hessian(self, z: Array, factor: float, multipliers: Array) -> Array: ...


class Solution(NamedTuple):
    z: Array
    value: float
    converged: bool
    reason: str
    iterations: int


@functools.cache
def load() -> Any:
    """The library IPOPT: of CasADi's wheel, or of the system."""
    found = importlib.util.find_spec("casadi")
    folders = [pathlib.Path(each) for each in (found.submodule_search_locations or ()) if each] if found else []
    names = [str(path) for folder in folders for end in ("so*", "*.dylib", "*.dll") for path in sorted(folder.glob(f"libipopt.{end}"))]
    for name in [*names, ctypes.util.find_library("ipopt")]:
        try:
            made = ctypes.CDLL(name) if name else None
        except OSError:
            continue
        if made is not None:
            made.CreateIpoptProblem.restype = made.FreeIpoptProblem.restype = ctypes.c_void_p
            made.FreeIpoptProblem.argtypes = [ctypes.c_void_p]
            for kind, value in (("Str", ctypes.c_char_p), ("Num", _NUMBER), ("Int", _INDEX)):
                add = getattr(made, f"AddIpopt{kind}Option")
                add.argtypes, add.restype = [ctypes.c_void_p, ctypes.c_char_p, value], ctypes.c_bool
            return made
    raise ImportError("collocation needs the library IPOPT, which CasADi has: pip install casadi (or Debian's package coinor-libipopt1v5)")


def _filled(pointer: Any, values: Array) -> None:
    np.ctypeslib.as_array(pointer, (len(values),))[:] = values


def solve(program: Program, z: Array, options: dict[str, str | float | int]) -> Solution:
    """IPOPT's solution from the point z."""
    ipopt, raised, done = load(), [], [0]
    n, m = len(z), len(program.least)

    def guarded(call: Callable[..., None]) -> Callable[..., int]:
        def run(*arguments: Any) -> int:
            try:
                call(*arguments)
                return 1
            except FailedError:
                return 0
            except BaseException as error:  # it must not pass through C
                raised.append(error)
                return 0

        return run

    def at(pointer: Any) -> Array:
        return np.ctypeslib.as_array(pointer, (n,))

    def value(_n: int, x: Any, _new: int, place: Any, _user: Any) -> None:
        place[0] = program.value(at(x))

    def matrix(places: tuple[Array, Array], pointers: tuple[Any, ...], make: Callable[[], Array]) -> None:
        rows, columns, values, _user = pointers
        if values:
            _filled(values, make())
        else:
            _filled(rows, places[0])
            _filled(columns, places[1])

    def jacobian(_n: int, x: Any, _new: int, _m: int, _count: int, *places: Any) -> None:
        matrix(program.jacobian_places, places, lambda: program.jacobian(at(x)))

    def hessian(_n: int, x: Any, _new: int, factor: float, _m: int, weights: Any, _also: int, _count: int, *places: Any) -> None:
        matrix(program.hessian_places, places, lambda: program.hessian(at(x), factor, np.ctypeslib.as_array(weights, (m,))))

    def iteration(_mode: int, count: int, *_values: Any) -> int:
        done[0] = count
        return int(not raised)

    calls = (
        _VALUE(guarded(value)),
        _CONSTRAINTS(guarded(lambda _n, x, _new, _m, place, _user: _filled(place, program.constraints(at(x))))),
        _VALUE(guarded(lambda _n, x, _new, place, _user: _filled(place, program.gradient(at(x))))),
        _JACOBIAN(guarded(jacobian)),
        _HESSIAN(guarded(hessian)),
    )
    after = _ITERATION(iteration)
    doubles = [np.ascontiguousarray(each, dtype=np.float64) for each in (program.low, program.high, program.least, program.most)]
    places = [each.ctypes.data_as(_NUMBERS) for each in doubles]
    counts = len(program.jacobian_places[0]), len(program.hessian_places[0])
    pointer = ctypes.c_void_p(ipopt.CreateIpoptProblem(n, *places[:2], m, *places[2:], *counts, 0, *calls))
    if not pointer:
        raise FailedError("IPOPT refuses the program")
    try:
        for name, option in {"print_level": 0, "sb": "yes", **options}.items():
            kind, given = ("Str", option.encode()) if isinstance(option, str) else ("Int" if isinstance(option, int) else "Num", option)
            if not getattr(ipopt, f"AddIpopt{kind}Option")(pointer, name.encode(), given):
                raise FailedError(f"IPOPT refuses the option {name}")
        ipopt.SetIntermediateCallback(pointer, after)
        end, least = np.array(z, dtype=np.float64), np.zeros(1)
        status = ipopt.IpoptSolve(pointer, end.ctypes.data_as(_NUMBERS), None, least.ctypes.data_as(_NUMBERS), None, None, None, None)
    finally:
        ipopt.FreeIpoptProblem(pointer)
    if raised:
        raise raised[0]
    return Solution(end, float(least[0]), status == 0, _REASONS.get(status, f"IPOPT ends with the status {status}"), done[0])
