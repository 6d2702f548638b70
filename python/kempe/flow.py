# SPDX-License-Identifier: BSD-3-Clause
"""The motion over an interval as a function of start values and parameters, with its exact derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from ._native import ffi, lib
from .arrays import Array, numbers, vector
from .context import Owned, string
from .lazy import np
from .options import unknown
from .result import study

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .model import Model


class FlowValues(NamedTuple):
    """Values (t x k) and their derivatives by the variables (t x k x v); without the first axis for a single time."""

    values: Array
    jacobian: Array


class Flow(Owned):
    """The motion from 0 to given times, as a function of `variables`: start values and parameters.

    `names` are of the values; `start` has the values of the variables in the model."""

    _noun = "flow"
    _times: tuple[int, ...]  # one time has no axis

    def __repr__(self) -> str:
        return f"<Flow: {len(self.names)} values by {', '.join(self.variables)}>"

    def _made(self) -> None:
        flow = self._pointer
        count, variables = lib.kempe_flow_count(flow), lib.kempe_flow_variable_count(flow)
        self.names: tuple[str, ...] = tuple(string(lib.kempe_flow_name(flow, k)) for k in range(count))
        self.variables: tuple[str, ...] = tuple(string(lib.kempe_flow_variable(flow, k)) for k in range(variables))
        self.start: Array = np.array([lib.kempe_flow_variable_value(flow, k) for k in range(variables)])

    def __call__(self, variables: ArrayLike | Mapping[str, float] | None = None) -> FlowValues:
        """Runs with these values of the variables, in their order or by name; values that a mapping does not name, and None, are as in the
        model.

        Raises FailedError if the model cannot have these values, or the motion does not reach the last time or has no derivative at an
        event. Raises KeyError if there is no such variable. Raises ValueError if there is another number of values or one is not a
        number.

        >>> flow = kempe.Model("four_bar.yaml").flow(0.1, variables="crank", outputs="q(rocker)")
        >>> x = flow()
        >>> x.values.shape, x.jacobian.shape
        ((1,), (1, 1))
        """
        given = self.start.copy()
        if isinstance(variables, Mapping):
            for name, value in variables.items():
                if name not in self.variables:
                    raise KeyError(unknown("variable", name, self.variables))
                given[self.variables.index(name)] = value
        elif variables is not None:
            given = numbers(variables, "variables")
        values = np.empty((*self._times, len(self.names)))
        jacobian = np.empty((*values.shape, len(self.variables)))
        status, message = self._context.guarded(
            lib.guarded_kempe_flow_at,
            self._pointer,
            vector(given, len(self.variables), "variables"),
            ffi.from_buffer("double[]", values),
            ffi.from_buffer("double[]", jacobian),
        )
        self._context.refuse(status, message)
        return FlowValues(values, jacobian)


def flow_of(model: Model, t: float | Iterable[float], given: Mapping[str, Any]) -> Flow:
    """A flow whose options are keywords."""
    times = np.array(t, dtype=float)
    if times.ndim > 1:
        raise ValueError(f"t is a time or a list of times, not an array of shape {times.shape}")
    made = study(Flow, model, given, times.size, vector(np.atleast_1d(times), times.size, "t"))
    made._times = times.shape
    return made
