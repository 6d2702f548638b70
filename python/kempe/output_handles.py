# SPDX-License-Identifier: BSD-3-Clause
"""Outputs at any state, and their Jacobians."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ._native import lib
from .arrays import Array, all_finite, finite, matched, numbers, of_class, optional, vector, whole, writable
from .context import NULL, Owned, string
from .errors import ArgumentError
from .lazy import np
from .options import text_of, utf8
from .stepper import Stepper
from .trajectory import Trajectory

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Outputs(Owned):
    """Values of outputs (k of them) at a state. It is for one thread at a time."""

    _noun = "outputs"

    def _made(self) -> None:
        count = range(lib.kempe_outputs_count(self._pointer))
        self.names: tuple[str, ...] = tuple(string(lib.kempe_outputs_name(self._pointer, k)) for k in count)
        self.units: dict[str, str] = {
            name: string(lib.kempe_outputs_unit(self._pointer, k)) for k, name in enumerate(self.names)
        }
        self._of_qdd, self._of_lam = (self._first(kinds) for kinds in (("acceleration", "qdd"), ("reaction", "lambda")))
        self._n, self._m = len(self._context.coordinates), len(self._context.rows)

    def _first(self, kinds: tuple[str, ...]) -> str:
        """The first output of some kinds; "": none."""
        return next((name for name in self.names if name.split(".")[0] in kinds), "")

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        return f"<Outputs: {', '.join(self.names)}>"

    def _values(self, function: Any, *arguments: Any) -> Array:
        values = np.empty(len(self))
        self._context.check(function, self._pointer, *arguments, writable(values, values.shape, "values"))
        return values

    def at(
        self,
        t: float,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        lam: ArrayLike | None = None,
    ) -> Array:
        """Values (k) at t (s), q, qd, qdd (n each) and lam (m). None is zero; accelerations need qdd, reactions lam.

        Raises ArgumentError if an array that is needed is missing or a number is not finite. Raises ValueError if an array has another
        length. Raises TypeError if its entries are not numbers.

        >>> outputs = kempe.Model("four_bar.yaml").system().outputs("position(crank.B).y")
        >>> outputs.at(0.0, [0, 0, 0]).tolist()
        [0.3]
        """
        for needed, label, given in ((self._of_qdd, "qdd", qdd), (self._of_lam, "lam", lam)):
            if needed and given is None:
                raise ArgumentError(f"'{needed}' depends on {label}, which is not given: forward_dynamics of a workspace has it")
        n, names = self._n, self._context.coordinates
        found = self._values(
            lib.kempe_outputs_at_state,
            finite(t, "t"),
            vector(q, n, "q"),
            optional(qd, n, "qd"),
            optional(qdd, n, "qdd"),
            optional(lam, self._m, "lam"),
        )
        if not math.isfinite(found.dot(found)):
            for name, values, count, of in (("q", q, n, names), ("qd", qd, n, names), ("qdd", qdd, n, names), ("lam", lam, self._m, self._context.rows)):
                if values is not None:
                    all_finite(matched(values, count, name), name, of)
        return found

    def at_stepper(self, stepper: Stepper) -> Array:
        """Values (k) at the current row of a stepper, with its inputs.

        Raises TypeError if it is not a stepper. Raises ArgumentError if it belongs to another system or has other parameters."""
        return self._values(lib.kempe_outputs_at_stepper, of_class(stepper, Stepper, "stepper", "System.stepper()")._pointer)

    def at_row(self, trajectory: Trajectory, row: int) -> Array:
        """Values (k) at a row of a trajectory.

        Raises TypeError if it is not a trajectory or the row is not a whole number. Raises ArgumentError if there is no such row or the
        trajectory belongs to another system."""
        run = of_class(trajectory, Trajectory, "trajectory", "simulate()")
        return self._values(lib.kempe_outputs_at_row, run._pointer, whole(row, "row"))

    def at_time(self, trajectory: Trajectory, t: ArrayLike) -> Array:
        """Values (k) at any time (s), or at several, of a run with `keep_dense=True`.

        Raises ArgumentError if the run has no dense output, does not contain the time, or belongs to another system. Raises TypeError
        if an argument has another type. Raises FailedError if the run could not have written that row."""
        times = numbers(t, "t").reshape(np.shape(t))
        run = of_class(trajectory, Trajectory, "trajectory", "simulate(keep_dense=True)")
        values = [self._values(lib.kempe_outputs_at_time, run._pointer, time) for time in times.flat]
        return np.array(values).reshape((*times.shape, len(self)))

    def _slopes(self, function: Any, width: int, t: float, q: ArrayLike, qd: ArrayLike | None) -> tuple[Array, Array]:
        slopes, drift = np.empty((len(self), width), order="F"), np.empty(len(self))
        self._context.check(
            function,
            self._pointer,
            finite(t, "t"),
            vector(q, self._n, "q"),
            optional(qd, self._n, "qd"),
            writable(slopes, slopes.shape, "J", "F"),
            writable(drift, drift.shape, "jdqd"),
        )
        if math.isnan(slopes.sum()):
            for name, values in (("q", q), ("qd", qd)):
                if values is not None:
                    all_finite(matched(values, self._n, name), name, self._context.coordinates)
            row = int(np.isnan(slopes).any(axis=1).argmax())
            raise ArgumentError(f"'{self.names[row]}' has no Jacobian: it depends on accelerations or multipliers")
        return slopes, drift

    def jacobian(self, t: float, q: ArrayLike, qd: ArrayLike | None = None) -> tuple[Array, Array]:
        """J (k x n) and jdqd (k) with the loops open: accelerations of positions are J qdd + jdqd.

        Raises ArgumentError if a number is not finite or an output depends on accelerations or multipliers. Raises ValueError if an
        array has another length. Raises TypeError if its entries are not numbers.

        >>> outputs = kempe.Model("four_bar.yaml").system().outputs("position(crank.B)")
        >>> J, jdqd = outputs.jacobian(0.0, [0, 0, 0])
        >>> J.shape, jdqd.shape
        ((3, 3), (3,))
        """
        return self._slopes(lib.kempe_outputs_jacobian, self._n, t, q, qd)

    def closed_jacobian(self, t: float, q: ArrayLike, qd: ArrayLike | None = None) -> tuple[Array, Array]:
        """J X (k x p) by the independent coordinates, and the accelerations of the outputs (k) at udd = 0.

        Raises FailedError if the loops are open or the mechanism is at a singular position. Raises ArgumentError if a number is not
        finite or an output depends on accelerations or multipliers. Raises ValueError if an array has another length. Raises TypeError
        if its entries are not numbers."""
        return self._slopes(lib.kempe_outputs_closed_jacobian, len(self.independent), t, q, qd)

    def choose(self, independent: Any = None) -> None:
        """Chooses the independent coordinates of closed-chain Jacobians; None: the coordinates at the model's start.

        Raises ArgumentError if there is no such coordinate. Raises FailedError if the coordinates do not describe the motion.
        """
        names = NULL if independent is None else utf8(text_of(independent))
        self._context.check(lib.kempe_outputs_choose, self._pointer, names)

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the p independent coordinates."""
        numbers = lib.kempe_outputs_independent(self._pointer)
        count = lib.kempe_outputs_independent_count(self._pointer)
        return tuple(self._context.coordinates[numbers[k]] for k in range(count))
