# SPDX-License-Identifier: BSD-3-Clause
"""Parameters from measured motions, and parameters for which a quantity is least."""

from __future__ import annotations

from ._native import lib
from .context import string
from .result import Reported, TableOf


class Fit(Reported):
    """Parameters of a model found from measured motions, with their standard errors."""

    _noun = "fit"
    _kept = ("values", "errors", "intervals", "rank")
    parameters: TableOf = TableOf("parameter, value, error, low, high, start, lower, upper (SI), state.")
    correlation: TableOf = TableOf("parameter, and a column for each parameter.")
    columns: TableOf = TableOf("column, count, rms, deviation (SI), unit.")
    rows: TableOf = TableOf("t; for each column of the data the fitted motion, COLUMN.measured, COLUMN.residual.")

    def _names(self) -> list[str]:
        return [string(lib.kempe_fit_name(self._pointer, k)) for k in range(lib.kempe_fit_count(self._pointer))]

    @property
    def values(self) -> dict[str, float]:
        """The estimates, SI, by name: `Model(path, **fit.values)` is the model with them."""
        return {name: lib.kempe_fit_value(self._pointer, k) for k, name in enumerate(self._names())}

    @property
    def errors(self) -> dict[str, float]:
        """Their standard errors; NaN: at a bound, or not determined by the data."""
        return {name: lib.kempe_fit_error(self._pointer, k) for k, name in enumerate(self._names())}

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """The ends of their intervals of confidence."""
        return {
            name: (lib.kempe_fit_low(self._pointer, k), lib.kempe_fit_high(self._pointer, k))
            for k, name in enumerate(self._names())
        }

    @property
    def rank(self) -> int:
        """The number of combinations of parameters that the data determines."""
        return int(lib.kempe_fit_rank(self._pointer))


class Optimum(Reported):
    """Parameters of a model for which a quantity of its runs is least or largest, under limits."""

    _noun = "optimum"
    _kept = ("values", "quantity", "kept", "method")
    parameters: TableOf = TableOf("parameter, value, start, lower, upper (SI), state.")
    limits: TableOf = TableOf("limit, value, bound, state.")
    starts: TableOf = TableOf("search, quantity, broken, evaluations, refused, outcome, the parameters.")
    history: TableOf = TableOf("evaluation, search, quantity, broken, best.")

    @property
    def values(self) -> dict[str, float]:
        """The parameters, SI, by name: `Model(path, **optimum.values)` is the model with them."""
        count = lib.kempe_optimum_count(self._pointer)
        return {
            string(lib.kempe_optimum_name(self._pointer, k)): lib.kempe_optimum_value(self._pointer, k)
            for k in range(count)
        }

    @property
    def quantity(self) -> float:
        """The quantity there."""
        return float(lib.kempe_optimum_quantity(self._pointer))

    @property
    def kept(self) -> bool:
        """True if all limits are kept."""
        return bool(lib.kempe_optimum_is_kept(self._pointer))

    @property
    def method(self) -> str:
        """ "slopes" or "values"."""
        return string(lib.kempe_optimum_method(self._pointer))
