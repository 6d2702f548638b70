# SPDX-License-Identifier: BSD-3-Clause
"""A run that is advanced by the caller, who sets inputs and states."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from ._native import ffi, lib
from .arrays import Array, all_finite, finite, matched, of_class, optional, real, vector, view
from .context import Owned, outcome, string
from .errors import ArgumentError, error_of
from .options import members_of, words

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class State(NamedTuple):
    """A row of a run: t (s), q, qd, qdd (n each), lam (m)."""

    t: float
    q: Array
    qd: Array
    qdd: Array
    lam: Array


class SavedState(Owned):
    """A stepper's state to return to."""

    _noun = "stepper_state"
    _t: float = 0.0

    def __repr__(self) -> str:
        return f"<SavedState at t = {self._t:g} s>"


class Stepper(Owned):
    """Advances a run: `advance(t)`, or step by step as an iterator of states.

    `q`, `qd`, `qdd`, `lam` are copies of the current row."""

    _noun = "stepper"
    _options = "kempe_run_options"

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_"):
            raise AttributeError(f"a stepper has no attribute '{name}' to be set: see set_input, set_state and set_parameters")
        object.__setattr__(self, name, value)

    def _call(self, function: Any, *arguments: Any, long: bool = False) -> None:
        context = self._context
        status, message = (context.guarded if long else context.run)(function, self._pointer, *arguments)
        if status:
            raise error_of(status, message or self.reason, None)

    def step(self) -> None:
        """Advances to the end of the integrator's next step.

        Raises ArgumentError at t_end. Raises StoppedError if an event ends the motion. Raises FailedError if the motion cannot
        continue. The state is then unchanged."""
        self._call(lib.guarded_kempe_stepper_step, long=True)

    def advance(self, t: float) -> None:
        """Advances to t (s).

        Raises ArgumentError if t is before the current time or after t_end. Raises TypeError if it is not a number. Raises StoppedError
        if an event ends the motion. Raises FailedError if the motion cannot continue, or, unless max_steps is given, if the rest would
        take 1e8 steps at the present pace.

        >>> stepper = kempe.Model("four_bar.yaml").system().stepper(t_end=1)
        >>> stepper.advance(0.25)
        >>> stepper.t, stepper.q.shape
        (0.25, (3,))
        """
        self._call(lib.guarded_kempe_stepper_advance, real(t, "t"), long=True)

    def __iter__(self) -> Iterator[State]:
        """The states after each further step, up to t_end.

        Raises the exceptions of `step`, without the ArgumentError at t_end."""
        while True:
            try:
                self.step()
            except ArgumentError:  # at t_end
                return
            yield self.state

    @property
    def state(self) -> State:
        """A copy of the current row."""
        return State(self.t, self.q, self.qd, self.qdd, self.lam)

    @property
    def t(self) -> float:
        """Current time, s."""
        return float(lib.kempe_stepper_time(self._pointer))

    @property
    def q(self) -> Array:
        """Coordinates (n; rad or m)."""
        return self._row(lib.kempe_stepper_q, len(self._context.coordinates))

    @property
    def qd(self) -> Array:
        """Rates (n)."""
        return self._row(lib.kempe_stepper_qd, len(self._context.coordinates))

    @property
    def qdd(self) -> Array:
        """Accelerations (n)."""
        return self._row(lib.kempe_stepper_qdd, len(self._context.coordinates))

    @property
    def lam(self) -> Array:
        """Multipliers (m)."""
        return self._row(lib.kempe_stepper_lambda, len(self._context.rows))

    def _row(self, get: Any, count: int) -> Array:
        return view(get(self._pointer), (count,), None).copy()

    # -- inputs and states ---------------------------------------------------------------------------------

    def keep_inputs(self, keep: bool = True) -> None:
        """Other inputs of the force function than t, q and qd are constant from now on."""
        lib.kempe_stepper_keep_inputs(self._pointer, int(keep))

    def set_input(self, name: str, value: float, rate: float = 0.0, acceleration: float = 0.0) -> None:
        """Sets an input of the model, in SI, from now on: value + rate s + acceleration s^2 / 2, s being the time since now.

        Raises ArgumentError if the model has no such input, the value is not finite, or a closure would jump. Raises TypeError if a
        value is not a number.
        """
        number = self._context.input(name)
        value = real(value, f"input '{name}'")
        rate, acceleration = real(rate, f"the rate of input '{name}'"), real(acceleration, f"the acceleration of input '{name}'")
        if rate or acceleration:
            self._call(lib.kempe_stepper_set_input_rates, number, value, rate, acceleration)
        else:
            self._call(lib.kempe_stepper_set_input, number, value)

    def input(self, name: str) -> float:
        """Value of an input at the current time, in SI.

        Raises ArgumentError if the model has no such input.
        """
        return float(lib.kempe_stepper_input(self._pointer, self._context.input(name)))

    def set_stop(self, t: float) -> None:
        """No step goes beyond t (s) until the stepper is there.

        Raises ArgumentError if t is not after the current time. Raises TypeError if it is not a number.
        """
        self._call(lib.kempe_stepper_set_stop, real(t, "t"))

    def set_state(self, q: ArrayLike, qd: ArrayLike | None = None) -> float:
        """Continues from the closed state near q and qd. Returns the largest change that closing made (rad, or relative).

        Raises FailedError if the loops cannot be closed from there; the stepper is then unchanged. Raises ArgumentError if a value is
        not finite. Raises ValueError if an array has another length. Raises TypeError if its entries are not numbers.
        """
        n, moved, names = len(self._context.coordinates), ffi.new("double *"), self._context.coordinates
        for name, values in (("q", q), ("qd", qd)):
            if values is not None:
                all_finite(matched(values, n, name), name, names)
        self._call(lib.guarded_kempe_stepper_set_state, vector(q, n, "q"), optional(qd, n, "qd"), moved, long=True)
        return float(moved[0])

    def set_parameters(self, **values: float) -> float:
        """Gives parameters other values in SI from now on. Returns the largest change that closing made.

        Raises ArgumentError if the model has no such parameter, the parameter shapes the equations, or a value is not finite. Raises
        InputError or FailedError if the model cannot have these values here. Raises TypeError if a value is not a number.
        """
        keep: list[Any] = []
        moved = ffi.new("double *")
        for name, value in values.items():
            if isinstance(value, str):
                raise TypeError(f"{name}: a number in SI is needed, not {value!r}")
        numbers = ffi.new("double[]", [finite(value, f"parameter '{name}'") for name, value in values.items()])
        self._call(
            lib.guarded_kempe_stepper_set_parameters, len(values), words(values, keep), numbers, moved, long=True
        )
        return float(moved[0])

    def reset(self) -> None:
        """Returns to t = 0 and the model's start.

        Raises FailedError if the run cannot start again."""
        self._call(lib.kempe_stepper_reset)

    def save(self) -> SavedState:
        """The current state; the integrator restarts here.

        Raises FailedError if the integrator cannot restart here."""
        made = self._context.make(
            SavedState, lib.kempe_stepper_save, self._pointer, owners=(self._pointer,), long=False
        )
        made._t = self.t
        return made

    def restore(self, state: SavedState) -> None:
        """Returns to a saved state, of this or of another stepper of the same system and options.

        Raises ArgumentError if the state is of another system or of other options. Raises TypeError if it is not a saved state.

        >>> stepper = kempe.Model("four_bar.yaml").system().stepper(t_end=1)
        >>> state = stepper.save()
        >>> stepper.advance(0.5)
        >>> stepper.restore(state)
        >>> stepper.t
        0.0
        """
        saved = of_class(state, SavedState, "state", "save()")
        self._call(lib.kempe_stepper_restore, saved._pointer)

    def copy(self) -> Stepper:
        """Another stepper at the same state.

        Raises FailedError if the integrator cannot restart here."""
        return self._context.make(Stepper, lib.kempe_stepper_copy, self._pointer, owners=(self._pointer,), long=False)

    __copy__ = copy

    @property
    def work(self) -> dict[str, int]:
        """Work so far: steps, rejected, refused, rhs, newton, factorizations, exchanges, centrings."""
        return members_of(lib.kempe_stepper_work(self._pointer))

    @property
    def status(self) -> str:
        """ "complete, not checked" so far; "not trustworthy" by a warning since the start; "stopped" or "failed"."""
        return outcome(lib.kempe_stepper_outcome(self._pointer))

    @property
    def reason(self) -> str:
        """Reason of the last failure or stop; "" if there is none."""
        return string(lib.kempe_stepper_reason(self._pointer))

    def __repr__(self) -> str:
        return f"<Stepper at t = {self.t:g} s>"
