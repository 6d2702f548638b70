# SPDX-License-Identifier: BSD-3-Clause
"""Many instances of one mechanism that are advanced by the caller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ._native import ffi, lib
from .arrays import DOUBLES, Array, all_finite, matched, numbers, optional, view, writable
from .context import Owned, outcome, string
from .errors import ArgumentError, error_of
from .lazy import np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class EnsembleStepper(Owned):
    """Many instances of one mechanism, each of which begins at a start and is advanced in steps with inputs that are constant meanwhile.
    Lanes of a vector register make the steps, and steppers where lanes cannot.

    `count` instances; `names` of the outputs; `no_lanes`: why lanes cannot run the model, "" if they can."""

    _noun = "ensemble_stepper"
    _options = "kempe_run_options"
    count: int
    names: tuple[str, ...]
    no_lanes: str

    def _made(self) -> None:
        self.count = int(lib.kempe_ensemble_stepper_count(self._pointer))
        self.names = tuple(
            string(lib.kempe_ensemble_stepper_value_name(self._pointer, k))
            for k in range(lib.kempe_ensemble_stepper_value_count(self._pointer))
        )
        self.no_lanes = string(lib.kempe_ensemble_stepper_no_lanes(self._pointer))

    def begin(self, k: int, q: ArrayLike | None = None, qd: ArrayLike | None = None) -> None:
        """Begins instance k at t = 0: at the closed state near q and qd, or at the model's start.

        Raises FailedError if the loops cannot be closed from there; the instance is then unchanged. Raises StoppedError if an event ends
        the motion there. Raises ArgumentError if there is no such instance or a value is not finite. Raises ValueError if an array has
        another length. Raises TypeError if its entries are not numbers."""
        n, coordinates = len(self._context.coordinates), self._context.coordinates
        for name, values in (("q", q), ("qd", qd)):
            if values is not None:
                all_finite(matched(values, n, name), name, coordinates)
        self._context.check(
            lib.kempe_ensemble_stepper_begin, self._pointer, k, optional(q, n, "q"), optional(qd, n, "qd")
        )

    def advance(self, t: ArrayLike, inputs: Sequence[str] = (), values: ArrayLike | None = None, out: Array | None = None) -> Array:
        """Advances each instance to a time (s), one for all or one for each; NaN: it stays. `inputs` of the model have the `values`
        (count x inputs, SI) from its present time on. Returns the outputs (count x names) of the instances that advance, in `out` if
        that is given; NaN elsewhere. A motion that ends or fails is none of the others: see `outcome`.

        Raises ArgumentError if a time is before the present one or after t_end, an instance has not begun, there is no such input, or
        an input is not finite. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> carts = kempe.Model("cart_pole.yaml").ensemble_stepper(8, "q", t_end=2)
        >>> for k in range(8):
        ...     carts.begin(k, [0, 0.01 * k])
        >>> carts.advance(0.02, ["u"], [[1.5]] * 8).shape
        (8, 2)
        """
        times = np.ascontiguousarray(np.broadcast_to(numbers(t, "t"), (self.count,)))
        numbered = [self._context.input(name) for name in inputs]
        shape = (self.count, len(numbered))
        given = np.ascontiguousarray(np.zeros(shape) if values is None and not numbered else numbers(values, "values"))
        if given.shape != shape:
            raise ValueError(f"values have the shape {shape}, not {given.shape}")
        if out is None:
            out = np.full((self.count, len(self.names)), np.nan)
        memory = writable(out, (self.count, len(self.names)), "out")
        status, message = self._context.guarded(
            lib.guarded_kempe_ensemble_stepper_advance,
            self._pointer,
            ffi.from_buffer(DOUBLES, times),
            len(numbered),
            ffi.new("int[]", numbered),
            ffi.from_buffer(DOUBLES, given),
            memory,
        )
        if status:
            raise error_of(status, message)
        return out

    def _index(self, k: int) -> int:
        if not 0 <= k < self.count:
            raise ArgumentError(f"instance {k} does not exist: the stepper has {self.count}")
        return k

    def _rows(self, get: Any) -> Array:
        n = len(self._context.coordinates)
        rows = [get(self._pointer, k) for k in range(self.count)]
        return np.array([np.full(n, np.nan) if row == ffi.NULL else view(row, (n,), None) for row in rows])

    @property
    def t(self) -> Array:
        """Times of the instances, s; NaN of one that has not begun."""
        return np.array([lib.kempe_ensemble_stepper_time(self._pointer, k) for k in range(self.count)])

    @property
    def q(self) -> Array:
        """Coordinates (count x n; rad or m)."""
        return self._rows(lib.kempe_ensemble_stepper_q)

    @property
    def qd(self) -> Array:
        """Rates (count x n)."""
        return self._rows(lib.kempe_ensemble_stepper_qd)

    @property
    def ended(self) -> int:
        """The number of instances whose last step did not reach its end."""
        return int(lib.kempe_ensemble_stepper_ended_count(self._pointer))

    def outcome(self, k: int) -> str:
        """The outcome of the last step of instance k: "complete, not checked" at its end, else "stopped" or "failed".

        Raises ArgumentError if there is no such instance."""
        return outcome(lib.kempe_ensemble_stepper_outcome(self._pointer, self._index(k)))

    def reason(self, k: int) -> str:
        """Why it ended before its end, "" if it did not.

        Raises ArgumentError if there is no such instance."""
        return string(lib.kempe_ensemble_stepper_reason(self._pointer, self._index(k)))

    def single(self, k: int) -> str:
        """Why a stepper made the last step of instance k, "" if lanes did.

        Raises ArgumentError if there is no such instance."""
        return string(lib.kempe_ensemble_stepper_single(self._pointer, self._index(k)))

    def __repr__(self) -> str:
        way = f"by steppers ({self.no_lanes})" if self.no_lanes else "in lanes"
        return f"<EnsembleStepper: {self.count} instances {way}, outputs {', '.join(self.names)}>"
