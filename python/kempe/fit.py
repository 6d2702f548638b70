# SPDX-License-Identifier: BSD-3-Clause
"""Parameters from measured motions, and parameters for which a quantity is least."""

from __future__ import annotations

from .arrays import Array
from .context import string
from .lazy import np
from .result import Reported, TableOf


def _numbers(values: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in values.items())


class _Found(Reported):
    """Parameters that a search has found."""

    def _numbers(self, what: str) -> dict[str, float]:
        """A number of each parameter, by its name."""
        name, number = self._call("name"), self._call(what)
        return {string(name(self._pointer, k)): number(self._pointer, k) for k in range(self._call("count")(self._pointer))}


class Fit(_Found):
    """Parameters of a model found from measured motions, with their standard errors."""

    _noun = "fit"
    _kept = ("values", "errors", "intervals", "covariance", "rank")
    parameters: TableOf = TableOf("parameter, value, error, low, high, start, lower, upper, state, unit.")
    correlation: TableOf = TableOf("parameter, and a column for each parameter.")
    columns: TableOf = TableOf("column, count, rms, deviation (SI), unit.")
    rows: TableOf = TableOf("t; for each column of the data the fitted motion, COLUMN.measured, COLUMN.residual. Several files: file, t, ..")
    first: TableOf = TableOf("The rows of the first data file.")

    @property
    def values(self) -> dict[str, float]:
        """The estimates, SI, by name: `Model(path, **fit.values)` is the model with them."""
        return self._numbers("value")

    @property
    def errors(self) -> dict[str, float]:
        """Their standard errors; NaN: at a bound, or not determined by the data."""
        return self._numbers("error")

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """The ends of their intervals of confidence."""
        high = self._numbers("high")
        return {name: (low, high[name]) for name, low in self._numbers("low").items()}

    @property
    def covariance(self) -> Array:
        """Their covariances (parameters x parameters, SI) in the order of `values`; NaN: at a bound, or not determined by the data.

        >>> kempe.Model("four_bar.yaml", crank_mass=2).simulate(t_end=1).rows.write("measured.csv")
        >>> bounds = {"crank_mass": (0.1, 5), "base": (0.85, 0.95)}
        >>> fit = kempe.Model("four_bar.yaml").fit(data="measured.csv", columns="q.rocker", parameters=bounds)
        >>> bool(fit.covariance[0, 0] == fit.errors["crank_mass"] ** 2), fit.covariance.shape
        (True, (2, 2))
        """
        errors = np.array(list(self.errors.values()))
        correlations = np.array([self.correlation[name] for name in self.values]).reshape(len(errors), len(errors))
        made: Array = errors[:, np.newaxis] * errors * correlations
        return made

    def __repr__(self) -> str:
        return f"<Fit: {_numbers(self.values)}>"

    @property
    def rank(self) -> int:
        """The number of combinations of parameters that the data determines."""
        return int(self._call("rank")(self._pointer))


class Optimum(_Found):
    """Parameters of a model for which a quantity of its runs is least or largest, under limits."""

    _noun = "optimum"
    _kept = ("values", "quantity", "kept", "method")
    parameters: TableOf = TableOf("parameter, value, start, lower, upper, state, unit.")
    limits: TableOf = TableOf("limit, value, bound, state, unit.")
    starts: TableOf = TableOf("search, quantity, broken, evaluations, refused, outcome, the parameters.")
    history: TableOf = TableOf("evaluation, search, quantity, broken, best.")

    @property
    def values(self) -> dict[str, float]:
        """The parameters, SI, by name: `Model(path, **optimum.values)` is the model with them."""
        return self._numbers("value")

    def __repr__(self) -> str:
        return f"<Optimum: {self.quantity:.6g} at {_numbers(self.values)}{'' if self.kept else ', limits not kept'}>"

    @property
    def quantity(self) -> float:
        """The quantity there."""
        return float(self._call("quantity")(self._pointer))

    @property
    def kept(self) -> bool:
        """True if all limits are kept."""
        return bool(self._call("is_kept")(self._pointer))

    @property
    def method(self) -> str:
        """ "slopes" or "values"."""
        return string(self._call("method")(self._pointer))
