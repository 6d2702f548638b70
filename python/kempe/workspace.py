# SPDX-License-Identifier: BSD-3-Clause
"""The equations of motion at one state: M(q) qdd + C(q, qd, t) = Q + J' lambda, h(q, t) = 0."""

from __future__ import annotations

import contextlib
import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from math import prod
from threading import get_ident
from typing import TYPE_CHECKING, Any, NamedTuple

from ._native import ffi, lib
from .arrays import (
    DOUBLES,
    INTS,
    Array,
    Order,
    all_finite,
    converted,
    finite,
    matched,
    numbers,
    real,
    view,
    whole,
    writable,
)
from .context import Owned, interruptible, level_of_caller, string
from .errors import ArgumentError, Interrupted, KempeWarning, error_of, in_python
from .fast_calls import calls
from .lazy import np
from .options import text_of, unknown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .system import System

_evaluate = calls.kempe_workspace_evaluate
_forward = calls.kempe_workspace_forward_dynamics
_inverse = calls.kempe_workspace_inverse_dynamics
_derivatives = calls.kempe_workspace_forward_derivatives
_CONVERT = calls.CONVERT
_BUSY = calls.BUSY
_from_buffer = ffi.from_buffer


class Accelerations(NamedTuple):
    """qdd: accelerations (n; rad/s^2 or m/s^2); lam: multipliers (m; N or N m), with the force of friction that slips in its
    rows, as in rows of runs. Or rows of them."""

    qdd: Array
    lam: Array


class Equations(NamedTuple):
    """M (n x n), C (n), h (m), J (m x n), jdqd (m) at a state, or at each of N states, which are then the first dimension."""

    M: Array  # n x n
    C: Array  # n
    h: Array  # m
    J: Array  # m x n
    jdqd: Array  # m


class Derivatives(NamedTuple):
    """Accelerations and multipliers at a state, and their derivatives: qdd_q is n x n with d qdd_i / d q_j in row i. Friction
    that slips is zero in lam here: its force is an output."""

    qdd: Array
    lam: Array
    qdd_q: Array  # n x n
    qdd_qd: Array
    qdd_Q: Array
    lam_q: Array  # m x n
    lam_qd: Array
    lam_Q: Array
    qdd_p: Array  # n x k: by k named inputs and parameters
    lam_p: Array  # m x k
    y: Array  # l outputs, whose accelerations and multipliers follow from the state
    y_q: Array  # l x n
    y_qd: Array
    y_Q: Array
    y_p: Array  # l x k


class ClosedDerivatives(NamedTuple):
    """Accelerations and multipliers at a state, and derivatives along motions that keep the loops closed: of the p
    accelerations of the independent coordinates by these, their rates, generalized forces, and k named inputs and
    parameters. All coordinates change by q_u du + q_p dp, and their rates by q_u dud + qd_u du + qd_p dp."""

    qdd: Array
    lam: Array
    udd_u: Array  # p x p
    udd_ud: Array
    udd_Q: Array  # p x n
    q_u: Array  # n x p
    qd_u: Array
    udd_p: Array  # p x k
    q_p: Array  # n x k
    qd_p: Array
    y: Array  # l outputs
    y_u: Array  # l x p
    y_ud: Array
    y_p: Array  # l x k


class ClosedEquations(NamedTuple):
    """M udd + C = X' Q of closed motions, and qdd = X udd + drift."""

    M: Array  # p x p
    C: Array  # p
    X: Array  # n x p
    drift: Array  # n


class Step(NamedTuple):
    """Closed q and qd (n each) after steps. Derivatives of the independent coordinates and their rates, x = (u, ud): by x before,
    by constant generalized forces, and by k names."""

    q: Array
    qd: Array
    x_x: Array  # 2 p x 2 p
    x_Q: Array  # 2 p x n
    x_p: Array  # 2 p x k


class Determinants(NamedTuple):
    """The logarithm of |det Jv| at N states, and its derivatives by the p independent coordinates. It becomes
    large and negative near singular positions."""

    logarithm: Array  # N
    by_u: Array  # N x p
    by_uu: Array  # N x p x p; 0 x p x p where it was not requested


class ForwardValues(NamedTuple):
    """Accelerations (n), multipliers (m) and outputs (l) at a state, or their change."""

    qdd: Array
    lam: Array
    y: Array


class StateGradient(NamedTuple):
    """The gradient of a weighted sum by all coordinates, their rates, generalized forces (n each), and names (k)."""

    q: Array
    qd: Array
    Q: Array
    p: Array


class ClosedGradient(NamedTuple):
    """The gradient of a weighted sum along motions that keep the loops closed: by the independent coordinates, their rates (p
    each), generalized forces (n) and names (k)."""

    u: Array
    ud: Array
    Q: Array
    p: Array


class InverseDerivatives(NamedTuple):
    """Generalized forces of inverse dynamics at a state, and their derivatives: Q_qdd is M; Q_p by k named inputs and
    parameters."""

    Q: Array
    Q_q: Array  # n x n
    Q_qd: Array
    Q_qdd: Array
    Q_p: Array  # n x k


_Shape = tuple[int, ...]
_Places = tuple[int, tuple[str, ...], list[tuple[int, int, _Shape]]]


def _placed(begin: int, shapes: dict[str, _Shape]) -> _Places:
    """Matrices one after another: the end of all, their names, and begin, end and shape of each."""
    places = []
    for shape in shapes.values():
        places.append((begin, begin + prod(shape), shape))
        begin += prod(shape)
    return begin, tuple(shapes), places


def _pointers(arrays: Iterable[Array | None]) -> list[Any]:
    """Addresses of arrays; NULL for None."""
    return [ffi.NULL if each is None else _from_buffer(DOUBLES, each, bool(each.flags.writeable)) for each in arrays]


def _values(made: Accelerations | ForwardValues) -> Any:
    return ffi.new("kempe_forward_values *", _pointers(made))


_ANOTHER = "another thread uses this workspace: each thread needs a workspace of its own"


class Workspace(Owned):
    """Evaluates the equations at given states, without waiting for another workspace. Each thread needs a separate one: every call raises
    ArgumentError while another thread is inside.

    `M`, `C`, `h`, `J`, `jdqd` are copies, for the thread that evaluated last; `views` has the same as read-only views,
    which the next call overwrites."""

    _noun = "workspace"
    _again: Callable[[], Workspace]  # makes another one of the same system
    _system: System

    def _made(self) -> None:
        self._inputs: dict[str, tuple[float, ...]] = {}
        self._keeps: bool = False  # modes of friction and contacts
        self._rated: bool = False  # rates were asked for
        self._others: list[Workspace] = []  # of further threads
        self._places: tuple[_Places, ...] = ()  # of derivatives, once they are prepared,
        self._by: tuple[str, ...] | None = None  # and the inputs and parameters by which they are taken, too,
        self._outputs: str = ""  # and outputs
        self._bends: bool = False  # second derivatives are prepared,
        self._curved: bool = False  # and Hessians,
        self._looped: bool = False  # and the determinant of the loops
        self._actuators: tuple[Any, ...] | None = None  # names and weights
        self._checked: Any = None  # an earlier result that may be overwritten
        self.n: int = len(self._context.coordinates)
        self.m: int = len(self._context.rows)
        w, n, m = self._pointer, self.n, self.m
        self._address = int(ffi.cast("uintptr_t", w))
        self._lam = np.empty(m)
        self._thread = 0  # that has evaluated last
        self.views: Equations = Equations(
            view(lib.kempe_workspace_mass(w), (n, n), w, "F"),
            view(lib.kempe_workspace_bias(w), (n,), w),
            view(lib.kempe_workspace_h(w), (m,), w),
            view(lib.kempe_workspace_jacobian(w), (m, n), w, "F"),
            view(lib.kempe_workspace_jdqd(w), (m,), w),
        )

    def __repr__(self) -> str:
        return f"<Workspace: {self.n} coordinates, {self.m} closure rows>"

    @property
    def message(self) -> str:
        """After a call that succeeded: a table that the state leaves, where values are not to be trusted; "": none."""
        return string(lib.kempe_workspace_message(self._pointer))

    def _fail(self, status: int) -> None:
        if status == _BUSY:
            raise ArgumentError(_ANOTHER)
        self._context.run(int)  # raises what a callback has raised
        message = in_python(string(lib.kempe_workspace_message(self._pointer)))
        raise error_of(status, re.sub(r"\blambda_(?=[qQp])", "lam_", message))

    def _settle(self, status: int, function: Any, t: float, *arrays: Array | None) -> None:
        """After a call that was refused: the same with arrays that are converted; else raises its error."""
        if status == _CONVERT:
            status = function(self._address, self.n, self.m, t, *arrays)
        if status:
            self._fail(status)

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        """No other thread may call the workspace inside."""
        if not calls.enter(self._address):
            raise ArgumentError(_ANOTHER)
        try:
            yield
        finally:
            calls.leave(self._address)

    def _mine(self, name: str, order: Order = "C") -> Array:
        """A copy of a view; an error where another thread has evaluated since this one."""
        array: Array = getattr(self.views, name).copy(order=order)
        if self._thread not in (0, get_ident()):
            raise ArgumentError(_ANOTHER)
        self._known()
        return array

    def _known(self) -> None:
        """An error before the first evaluation, where all of M is zero."""
        if self._thread == 0 and self.n and not self.views.M.any():
            raise ArgumentError("the workspace has no values yet: call evaluate(t, q, qd) first")

    def evaluate(self, t: float, q: ArrayLike, qd: ArrayLike | None = None, views: bool = False) -> Equations:
        """Evaluates everything at t (s), q and qd (n each; None: at rest). q need not close the loops. Returns copies; with
        `views` what `views` has, which costs less, and which the next call overwrites.

        Raises FailedError if a value is not finite. Raises ValueError if an array has another shape. Raises TypeError if its entries
        are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> equations = workspace.evaluate(0.0, [0, 0, 0])
        >>> equations.M.shape, equations.C.shape, equations.J.shape
        ((3, 3), (3,), (2, 3))
        """
        n = self.n
        self._thread = get_ident()
        status = _evaluate(self._address, n, self.m, t, q, qd)
        if status:
            self._settle(status, _evaluate, t, converted(q, n, "q"), converted(qd, n, "qd"))
        return self.views if views else Equations(self.M, self.C, self.h, self.J, self.jdqd)

    @property
    def M(self) -> Array:
        """Mass matrix (n x n)."""
        return self._mine("M", "F")

    @property
    def C(self) -> Array:
        """Bias (n; N m or N): Coriolis, centrifugal, gravity and applied forces, on the side of M qdd."""
        return self._mine("C")

    @property
    def h(self) -> Array:
        """Closure error (m)."""
        return self._mine("h")

    @property
    def J(self) -> Array:
        """Jacobian dh/dq (m x n)."""
        return self._mine("J", "F")

    @property
    def jdqd(self) -> Array:
        """Acceleration of h at qdd = 0 (m)."""
        return self._mine("jdqd")

    @property
    def closure_rows(self) -> Array:
        """Numbers of the rows of h and J that belong to closures and drives; the others are of friction and contacts, and are
        zero while these slip or are open."""
        rows = lib.kempe_workspace_closure_rows(self._pointer)
        return np.array([rows[k] for k in range(lib.kempe_workspace_closure_row_count(self._pointer))], dtype=int)

    @property
    def kinetic(self) -> float:
        """Kinetic energy, J."""
        found = float(lib.kempe_workspace_kinetic(self._pointer))
        self._known()
        return found

    @property
    def potential(self) -> float:
        """Potential energy of gravity and springs, J."""
        found = float(lib.kempe_workspace_potential(self._pointer))
        self._known()
        return found

    def set_input(self, name: str, value: float, t: float = 0.0, rate: float = 0.0, acceleration: float = 0.0) -> None:
        """Sets an input of the model to value + rate s + acceleration s^2 / 2, where s is the time since t.

        Raises ArgumentError if the model has no such input or a value is not finite. Raises TypeError if a value is not a number.
        """
        number = self._context.input(name)
        named = (t, "t"), (value, f"input '{name}'"), (rate, f"the rate of input '{name}'"), (acceleration, f"the acceleration of input '{name}'")
        given = finite(*named[0]), finite(*named[1]), finite(*named[2]), finite(*named[3])
        with self._alone():
            status = lib.kempe_workspace_set_input(self._pointer, number, *given)
        if status:
            self._fail(status)
        self._inputs[name] = given
        for other in self._others:
            other.set_input(name, value, t, rate, acceleration)

    @property
    def modes(self) -> dict[str, str]:
        """Modes of friction that may stick and of rigid contacts at the last state, of a workspace made with friction="stick".
        Friction "slips" or "sticks"; it "shares" where others share its load, and is "undetermined" where the loops keep its
        place. A contact is "closed" or "open", or "shares"; its friction is "open" with it. {}: there is none, or no state yet.

        >>> text = "kempe: 1\\nbodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\\n"
        >>> text += "forces: {rub: {joint: x, friction: {force: 5}}}\\n"
        >>> workspace = kempe.Model.from_text(text).system().workspace(friction="stick")
        >>> found = workspace.forward_dynamics(0.0, [0.0], [0.0])
        >>> workspace.modes
        {'rub': 'sticks'}
        """
        with self._alone():
            words = [
                (lib.kempe_workspace_mode_name(self._pointer, k), lib.kempe_workspace_mode(self._pointer, k))
                for k in range(lib.kempe_workspace_mode_count(self._pointer))
            ]
        return {string(name): string(mode) for name, mode in words if mode}

    def keep_modes(self, keep: bool = True) -> None:
        """Keeps the modes of the last state at all further states, or decides on them again at each (False). Modes that are
        kept are not checked: a contact may pull, and surfaces may overlap. The equations of one phase of contact are then a
        smooth function of the state, also for threads.

        Raises ArgumentError if no state has been evaluated.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace(friction="stick")
        >>> found = workspace.forward_dynamics(0.0, [0, 0, 0], [20, -22.5, 7.5])
        >>> workspace.keep_modes()
        """
        with self._alone():
            status = lib.kempe_workspace_keep_modes(self._pointer, self._pointer if keep else ffi.NULL)
        if status:
            self._fail(status)
        self._keeps = bool(keep)
        for other in self._others:
            other._take_modes(self)

    def _take_modes(self, of: Workspace) -> None:
        if lib.kempe_workspace_keep_modes(self._pointer, of._pointer if of._keeps else ffi.NULL):
            self._fail(lib.KEMPE_E_ARGUMENT)

    def _team(self, count: int) -> list[Workspace]:
        """Returns this number of workspaces with the same inputs, this one the first. Decisions on modes belong to one thread."""
        if not self._keeps and lib.kempe_workspace_mode_count(self._pointer):
            return [self]
        while len(self._others) < count - 1:
            other = self._again()
            for name, (t, value, *more) in self._inputs.items():
                other.set_input(name, value, t, *more)
            other._take_modes(self)
            self._others.append(other)
        return [self, *self._others[: count - 1]]

    def forward_dynamics(
        self, t: float, q: ArrayLike, qd: ArrayLike, Q: ArrayLike | None = None, out: Accelerations | None = None
    ) -> Accelerations:
        """Accelerations and multipliers under the model's forces and the generalized forces Q (n; None: none).

        Raises FailedError if the equations are singular or a value is not finite. Raises ArgumentError if `out` is not a pair of
        arrays. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> qdd, lam = workspace.forward_dynamics(0.0, [0, 0, 0], [20, -22.5, 7.5])
        >>> qdd.shape, lam.shape
        ((3,), (2,))
        """
        n, m = self.n, self.m
        made = Accelerations(np.empty(n), np.empty(m)) if out is None else out
        try:
            qdd, lam = made
        except (TypeError, ValueError):
            raise ArgumentError("out is a pair of arrays, of n accelerations and m multipliers, or an earlier result") from None
        status = _forward(self._address, n, m, t, q, qd, Q, qdd, lam)
        if status:
            writable(qdd, (n,), "qdd")
            writable(lam, (m,), "lam")
            given = converted(q, n, "q"), converted(qd, n, "qd"), converted(Q, n, "Q")
            self._settle(status, _forward, t, *given, qdd, lam)
        return made

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the independent coordinates u, which Kempe chose at the start of the model.

        >>> kempe.Model("four_bar.yaml").system().workspace().independent
        ('coupler',)
        """
        count, u = lib.kempe_workspace_independent_count(self._pointer), lib.kempe_workspace_independent(self._pointer)
        return tuple(self._context.coordinates[u[k]] for k in range(count))

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs y of the last derivatives, as of columns in a result file; (): none.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> found = workspace.forward_derivatives(0.0, [0, 0, 0], [20, -22.5, 7.5], outputs="velocity(coupler.C).x")
        >>> workspace.output_names
        ('velocity.coupler.C.x',)
        """
        count = lib.kempe_workspace_output_count(self._pointer)
        return tuple(string(lib.kempe_workspace_output_name(self._pointer, k)) for k in range(count))

    def forward_derivatives(
        self,
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        threads: int = 1,
        out: Derivatives | None = None,
        by: str | Iterable[str] = (),
        outputs: str | Iterable[str] = "",
    ) -> Derivatives:
        """Accelerations and multipliers, and their exact derivatives by q, qd and Q (n each), which need not close the loops.
        `by` names inputs and parameters of the model by which derivatives are taken, too; `outputs` are words of the model
        language, as for System.outputs: values y that follow from the state with its accelerations and multipliers. Rows of q,
        qd and Q are N states, and all results have N as their first dimension; t and `threads` are as in evaluate_states.
        `out`: an earlier result, which is overwritten: a loop over single states takes half of the time with it. The first
        call with other names or outputs derives the equations of the derivatives.

        Raises ArgumentError if a name does not exist or the model has no such derivatives. Raises FailedError if the equations are
        singular or a value is not finite. Raises ValueError if an array has another shape. Raises TypeError if its entries are not
        numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> found = workspace.forward_derivatives(0.0, [0, 0, 0], [20, -22.5, 7.5])
        >>> found.qdd_q.shape, found.lam_q.shape
        ((3, 3), (2, 3))
        >>> workspace.forward_derivatives(0.0, [0, 0, 0], [20, -22.5, 7.5], by=["crank_mass", "base"]).qdd_p.shape
        (3, 2)
        >>> workspace.forward_derivatives(0.0, [0, 0, 0], [20, -22.5, 7.5], outputs="acceleration(coupler.C)").y_q.shape
        (3, 3)
        """
        made: Derivatives = self._derive(Derivatives, t, q, qd, Q, threads, out, by, outputs)
        return made

    def closed_derivatives(
        self,
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        threads: int = 1,
        out: ClosedDerivatives | None = None,
        by: str | Iterable[str] = (),
        outputs: str | Iterable[str] = "",
    ) -> ClosedDerivatives:
        """Accelerations and multipliers at a closed state, and exact derivatives along motions that keep the loops closed, in
        the independent coordinates (`independent`). Arguments are as in forward_derivatives.

        Raises ArgumentError if a name does not exist or the model has no such derivatives. Raises FailedError if the loops are open or
        the equations are singular. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> q, qd = workspace.close(0.0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
        >>> found = workspace.closed_derivatives(0.0, q, qd)
        >>> found.udd_u.shape, found.udd_Q.shape, found.q_u.shape
        ((1, 1), (1, 3), (3, 1))
        """
        made: ClosedDerivatives = self._derive(ClosedDerivatives, t, q, qd, Q, threads, out, by, outputs)
        return made

    def inverse_derivatives(
        self, t: float, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, by: str | Iterable[str] = ()
    ) -> InverseDerivatives:
        """Generalized forces Q = M qdd + C (n), with the loops open, and their exact derivatives by q, qd and qdd. `by` is as
        in forward_derivatives.

        Raises ArgumentError if a name does not exist, the model has no such derivatives, or a value is not finite. Raises ValueError if
        an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> found = workspace.inverse_derivatives(0.0, [0, 0, 0], [1, 0, 0], [0, 0, 0], by="crank_mass")
        >>> found.Q_q.shape, found.Q_p.shape
        ((3, 3), (3, 1))
        """
        self._prepare(by, self._outputs)
        n, t = self.n, real(t, "t")
        state = [matched(each, n, name) for each, name in ((q, "q"), (qd, "qd"), (qdd, "qdd"))]
        Q, Q_p = np.empty(n), np.empty((len(self._by or ()), n)).T
        matrices = [np.empty((n, n), order="F") for _ in range(3)]
        places = [_from_buffer(DOUBLES, each.T, True) for each in (*matrices, Q_p)]
        with self._alone():
            status = lib.kempe_workspace_inverse_derivatives(
                self._pointer,
                t,
                *(_from_buffer(DOUBLES, each) for each in state),
                _from_buffer(DOUBLES, Q, True),
                ffi.new("kempe_inverse_derivatives *", places),
            )
        if status:
            self._fail(status)
        return InverseDerivatives._make([Q, *matrices, Q_p])

    def forward_jvp(
        self,
        t: float,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        *,
        dq: ArrayLike | None = None,
        dqd: ArrayLike | None = None,
        dQ: ArrayLike | None = None,
        dp: ArrayLike | None = None,
        du: ArrayLike | None = None,
        dud: ArrayLike | None = None,
        by: str | Iterable[str] = (),
        outputs: str | Iterable[str] = "",
    ) -> tuple[ForwardValues, ForwardValues]:
        """Accelerations, multipliers and outputs, and their derivative along a direction (Jacobian-vector product), without the
        matrices. The direction has changes of q, qd, Q (n each) and of the k names of `by` (dp). Changes of the independent
        coordinates and their rates (du, dud) in place of q and qd are along closed motions. Members left out do not change.

        Raises ArgumentError if a name does not exist, the model has no such derivatives, or no direction is given. Raises FailedError
        if the equations are singular. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> values, change = workspace.forward_jvp(0.0, [0, 0, 0], [20, -22.5, 7.5], dq=[1, 0, 0])
        >>> change.qdd.shape, change.lam.shape
        ((3,), (2,))
        """
        self._prepare(by, outputs)
        n, p, k = self.n, len(self.independent), len(self._by or ())
        directions = ((dq, n, "dq"), (dqd, n, "dqd"), (dQ, n, "dQ"), (dp, k, "dp"), (du, p, "du"), (dud, p, "dud"))
        direction = [converted(*each) for each in directions]
        if all(each is None for each in direction):
            raise ArgumentError("no direction is given: it has changes dq, dqd, dQ, dp, du or dud")
        values, change = self._forward_values(), self._forward_values()
        self._product(lib.kempe_workspace_forward_jvp, "direction", direction, t, q, qd, Q, values, change)
        return values, change

    def forward_vjp(
        self,
        t: float,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        *,
        qdd: ArrayLike | None = None,
        lam: ArrayLike | None = None,
        y: ArrayLike | None = None,
        closed: bool = False,
        by: str | Iterable[str] = (),
        outputs: str | Iterable[str] = "",
    ) -> tuple[ForwardValues, StateGradient | ClosedGradient]:
        """Accelerations, multipliers and outputs, and the gradient of a weighted sum of them (vector-Jacobian product) for weights
        qdd (n), lam (m) and y (l): the time does not depend on the number of coordinates and names. `closed`: along motions
        that keep the loops closed, by the independent coordinates.

        Raises ArgumentError if a name does not exist, the model has no such derivatives, or no weight is given. Raises FailedError if
        the equations are singular. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> values, gradient = workspace.forward_vjp(0.0, [0, 0, 0], [20, -22.5, 7.5], qdd=[1, 0, 0], by="crank_mass")
        >>> gradient.q.shape, gradient.p.shape
        ((3,), (1,))
        """
        self._prepare(by, outputs)
        n, p, k = self.n, len(self.independent), len(self._by or ())
        weights = [
            converted(*each)
            for each in ((qdd, n, "qdd"), (lam, self.m, "lam"), (y, lib.kempe_workspace_output_count(self._pointer), "y"))
        ]
        if all(each is None for each in weights):
            raise ArgumentError("no weight is given: the gradient is of a sum with weights qdd, lam or y")
        first = p if closed else n
        gradient = [np.zeros(size) for size in (first, first, n, k)]
        places = [None, None, *gradient[2:], *gradient[:2]] if closed else [*gradient, None, None]
        values = self._forward_values()
        self._product(lib.kempe_workspace_forward_vjp, "weight", weights, t, q, qd, Q, values, places)
        return values, (ClosedGradient if closed else StateGradient)(*gradient)

    def forward_second(
        self,
        t: float,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        *,
        first: tuple[ArrayLike | None, ...],
        second: tuple[ArrayLike | None, ...],
    ) -> Accelerations:
        """The second derivative of accelerations and multipliers along two directions, each a tuple (dq, dqd, dQ) whose last
        members may be left out.

        Raises ArgumentError if the model has no such derivatives or a direction is not a tuple. Raises FailedError if the equations are
        singular. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> bent = workspace.forward_second(0.0, [0, 0, 0], [20, -22.5, 7.5], first=([1, 0, 0],), second=([0, 1, 0],))
        >>> bent.qdd.shape
        (3,)
        """
        if self._by is None:
            self._prepare(())
        if not self._bends:
            with self._alone(), self._context.lock:
                status = lib.kempe_workspace_add_second_derivatives(self._pointer)
            if status:
                self._fail(status)
            self._bends = True
        n, directions = self.n, []
        for label, given in (("first", first), ("second", second)):
            if not isinstance(given, tuple) or not 1 <= len(given) <= 3:
                raise ArgumentError(f"{label} is a tuple (dq, dqd, dQ), whose last members may be left out")
            directions.append([converted(each, n, f"{label}[{i}]") for i, each in enumerate(given)])
        made = Accelerations(np.empty(n), np.empty(self.m))
        state = self._state(t, q, qd, Q)
        with self._alone():
            status = lib.kempe_workspace_forward_second(
                self._pointer, *state, *(ffi.new("kempe_state_direction *", _pointers(each)) for each in directions), _values(made)
            )
        if status:
            self._fail(status)
        return made

    def forward_hessian(
        self,
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        *,
        qdd: ArrayLike | None = None,
        lam: ArrayLike | None = None,
        y: ArrayLike | None = None,
        by_q: ArrayLike | None = None,
        by_qd: ArrayLike | None = None,
        dq: ArrayLike | None = None,
        dqd: ArrayLike | None = None,
        dQ: ArrayLike | None = None,
        du: ArrayLike | None = None,
        dud: ArrayLike | None = None,
        outputs: str | Iterable[str] = "",
        threads: int = 1,
    ) -> Array:
        """The Hessian of a sum of accelerations, multipliers, outputs, coordinates and their rates, with the weights qdd (n), lam (m),
        y (l), by_q and by_qd (n each): its exact second derivatives along each pair of d directions (d x d). Each direction is a
        row of dq, dqd and dQ; along motions that keep the loops closed a row of du, dud and dQ. Members left out do not change. Rows of q, qd, Q and of the weights are N
        states, and the result has N as its first dimension; t and `threads` are as in evaluate_states. A user-defined force
        is differentiated by differences.

        Raises ArgumentError if a name does not exist, the model has no such derivatives, or directions or weights have another shape.
        Raises FailedError if the equations are singular or the loops are open. Raises ValueError if an array has another shape. Raises
        TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> q, qd = workspace.close(0.0, [0.3, 0, 0], [1, 0, 0], hold="crank")
        >>> workspace.forward_hessian(0.0, q, qd, qdd=[1, 0, 0], du=[[1], [0]], dud=[[0], [1]]).shape
        (2, 2)
        """
        words = text_of(outputs) if outputs else ""
        self._prepare_hessians(words)
        n, p = self.n, len(self.independent)
        parts = {"q": (dq, n), "qd": (dqd, n), "Q": (dQ, n), "u": (du, p), "ud": (dud, p)}
        rows = {name: np.ascontiguousarray(each, dtype=np.float64) for name, (each, _) in parts.items() if each is not None}
        counts = {len(each) for each in rows.values() if each.ndim == 2}
        for name, each in rows.items():
            if each.ndim != 2 or each.shape[1] != parts[name][1] or len(counts) != 1:
                raise ArgumentError(f"d{name} has a row of {parts[name][1]} numbers for each direction, not the shape {each.shape}")
        count = counts.pop() if counts else 0
        directions = ffi.new("kempe_state_direction[]", count)
        for name, each in rows.items():
            begin = _from_buffer(DOUBLES, each)
            for k in range(count):
                setattr(directions[k], name, begin + k * each.shape[1])
        widths = {"qdd": n, "lam": self.m, "y": lib.kempe_workspace_output_count(self._pointer), "by_q": n, "by_qd": n}
        given = {"qdd": qdd, "lam": lam, "y": y, "by_q": by_q, "by_qd": by_qd}
        if np.ndim(q) != 2:
            made = np.empty((count, count))
            weights = [converted(given[name], width, name) for name, width in widths.items()]
            state = self._state(float(np.asarray(t)), q, qd, Q)
            with self._alone():
                status = lib.kempe_workspace_forward_hessian(
                    self._pointer, *state, ffi.new("kempe_forward_values *", _pointers(weights)), count, directions, _from_buffer(DOUBLES, made, True)
                )
            if status:
                self._fail(status)
            return made
        states = _States(self, t, q, qd=qd, Q=Q)
        for name, member in zip(widths, ("by_qdd", "by_lambda", "by_y", "by_q", "by_qd")):
            if given[name] is not None:
                states.rows[member] = weight = np.ascontiguousarray(given[name], dtype=np.float64)
                if weight.shape != (states.count, widths[name]):
                    raise ArgumentError(f"{name} has rows of {widths[name]} weights for each state, not the shape {weight.shape}")
        states.more = {"direction_count": count, "directions": directions}
        made = np.empty((states.count, count, count))
        states.run(lib.python_hessian_states, threads, lambda each: each._prepare_hessians(words), hessians=made)
        return made

    def _prepare_hessians(self, outputs: str) -> None:
        if self._by is None or outputs != self._outputs:
            self._prepare(self._by or (), outputs)
        if not self._curved:
            with self._alone(), self._context.lock:
                status = lib.kempe_workspace_add_hessians(self._pointer)
            if status:
                self._fail(status)
            self._curved = True

    def determinants(self, t: ArrayLike, q: ArrayLike, curvature: bool = True, threads: int = 1) -> Determinants:
        """The logarithm of |det Jv| at N states with closed loops (rows of q), and its exact derivatives by the p independent
        coordinates along closed motions. Jv has the columns of J of the dependent coordinates. The determinant is zero in
        singular positions, at which assembly modes meet. t and `threads` are as in evaluate_states.

        Raises FailedError if a position is singular. Raises ArgumentError if the independent coordinates are not known or a time is not
        finite. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers. Raises Interrupted if
        Ctrl-C ends it.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> q, _ = workspace.close(0.0, [0.3, 0, 0], hold="crank")
        >>> workspace.determinants(0.0, [q, q]).by_uu.shape
        (2, 1, 1)
        """
        states, p = _States(self, t, q), len(self.independent)
        made = Determinants(np.empty(states.count), np.empty((states.count, p)), np.empty((states.count * curvature, p, p)))
        results = {"logarithm": made.logarithm, "by_u": made.by_u, **({"by_uu": made.by_uu} if curvature else {})}
        states.run(lib.python_determinant_states, threads, Workspace._prepare_determinant, **results)
        return made

    def _prepare_determinant(self) -> None:
        if not self._looped:
            with self._alone(), self._context.lock:
                status = lib.kempe_workspace_add_determinant(self._pointer)
            if status:
                self._fail(status)
            self._looped = True

    def step(
        self,
        t: float,
        q: ArrayLike,
        qd: ArrayLike,
        h: float,
        Q: ArrayLike | None = None,
        steps: int = 1,
        by: str | Iterable[str] = (),
        derivatives: bool = True,
    ) -> Step:
        """The state after steps of h (s), by the Runge-Kutta method of order four with closed loops, and the exact derivatives of
        this map: for optimal control. Loops that are open by at most 0.01
        (relative) are closed first; Q and the inputs are constant meanwhile. The error of a step is
        proportional to h^5: compare with a smaller h.

        Raises FailedError if the loops cannot be closed or the independent coordinates do not describe the motion. Raises ArgumentError
        if a name does not exist, h is zero or there is no step. Raises Interrupted if Ctrl-C ends it. Raises ValueError if an array has
        another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> q, qd = workspace.close(0.0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
        >>> after = workspace.step(0.0, q, qd, 1e-3, steps=10, by="crank_mass")
        >>> after.x_x.shape, after.x_Q.shape, after.x_p.shape
        ((2, 2), (2, 3), (2, 1))
        """
        self._prepare(by, self._outputs)
        n, x = self.n, 2 * len(self.independent)
        t, h, steps = real(t, "t"), real(h, "h"), whole(steps, "steps")
        ends = [matched(q, n, "q").copy(), matched(qd, n, "qd").copy()]
        made = [np.empty((x, columns), order="F") for columns in (x, n, len(self._by or ()))] if derivatives else [np.empty((0, 0))] * 3
        force = converted(Q, n, "Q")
        context = self._context.pointer if interruptible() else ffi.NULL
        try:
            with self._alone():
                status = lib.guarded_kempe_workspace_step(
                    context,
                    self._pointer,
                    t,
                    h,
                    steps,
                    *_pointers([*ends, force]),
                    ffi.new("kempe_step_derivatives *", _pointers(each.T for each in made)) if derivatives else ffi.NULL,
                )
        except KeyboardInterrupt as interrupt:
            raise Interrupted from interrupt
        if status:
            self._fail(status)
        return Step(*ends, *made)

    def _forward_values(self) -> ForwardValues:
        return ForwardValues(np.empty(self.n), np.empty(self.m), np.empty(lib.kempe_workspace_output_count(self._pointer)))

    def _state(self, t: float, q: Any, qd: Any, Q: Any) -> tuple[Any, ...]:
        arrays = [matched(q, self.n, "q"), matched(qd, self.n, "qd"), converted(Q, self.n, "Q")]
        return real(t, "t"), *_pointers(arrays)

    def _product(self, function: Any, kind: str, given: Any, t: Any, q: Any, qd: Any, Q: Any, values: Any, made: Any) -> None:
        """A call with a direction or weights, which puts values, and their change or a gradient into arrays."""
        state = self._state(t, q, qd, Q)
        if kind == "direction":
            taken, result = ffi.new("kempe_state_direction *", _pointers(given)), _values(made)
        else:
            taken = ffi.new("kempe_forward_values *", _pointers(given))
            result = ffi.new("kempe_state_gradient *", _pointers(made))
        with self._alone():
            status = function(self._pointer, *state, taken, _values(values), result)
        if status:
            self._fail(status)

    def _derive(self, kind: Any, t: Any, q: Any, qd: Any, Q: Any, threads: int, out: Any, by: Any, outputs: Any) -> Any:
        """Accelerations and multipliers, and matrices of derivatives in the order of their names, at a state or at many."""
        if by != self._by or outputs != self._outputs:
            self._prepare(by, outputs)
        if np.ndim(q) == 2:
            return self._derive_rows(kind, t, q, qd, Q, threads, out)
        n, m, closed = self.n, self.m, kind is ClosedDerivatives
        size, _, places = self._places[closed]
        if out is not None and out is not self._checked:
            shapes = [(n,), (m,), *(shape for _, _, shape in places)]
            if type(out) is not kind or [each.shape for each in out] != shapes:
                raise ArgumentError(
                    f"out must be an earlier result ({kind.__name__}) of this workspace at one state, with the same names and outputs"
                )
            self._checked = out
        made = np.empty(size) if out is None else self._base_of(kind, out, size)
        answers = (None, made) if closed else (made, None)
        status = _derivatives(self._address, n, m, t, q, qd, Q, *answers)
        if status:
            given = converted(q, n, "q"), converted(qd, n, "qd"), converted(Q, n, "Q")
            self._settle(status, _derivatives, t, *given, *answers)
        if out is not None:
            return out
        matrices = [made[begin:end].reshape(shape, order="F") for begin, end, shape in places]
        return kind(made[:n], made[n : n + m], *matrices)

    @staticmethod
    def _base_of(kind: Any, out: Any, size: int) -> Array:
        """The memory of an earlier result at one state, in which its arrays are one after another."""
        base = out[0].base if type(out) is kind else None
        if base is None or base.shape != (size,):
            raise ArgumentError(f"out must be an earlier result ({kind.__name__}) of this workspace at one state")
        made: Array = base
        return made

    def _derive_rows(self, kind: Any, t: Any, q: Any, qd: Any, Q: Any, threads: int, out: Any) -> Any:
        states = _States(self, t, q, qd=qd, Q=Q)
        count, named, outputs = states.count, self._by or (), self._outputs
        _, names, places = self._places[kind is ClosedDerivatives]
        shapes = [(self.n,), (self.m,), *(shape for _, _, shape in places)]
        if out is None:
            made = [np.empty((count, *reversed(shape))) for shape in shapes]
        elif type(out) is kind and [each.shape for each in out] == [(count, *shape) for shape in shapes]:
            made = [each.transpose(0, 2, 1) if each.ndim == 3 else each for each in out]
        else:
            raise ArgumentError(f"out must be an earlier result ({kind.__name__}) of this workspace at {count} states")
        answer = dict(zip(("accelerations", "multipliers", *names), made))
        states.run(lib.python_derivative_states, threads, lambda each: each._prepare(named, outputs), **answer)
        return kind(*(each.transpose(0, 2, 1) if each.ndim == 3 else each for each in made)) if out is None else out

    def _prepare(self, by: str | Iterable[str], outputs: str | Iterable[str] = "") -> None:
        """Prepares the workspace for derivatives, also by named inputs and parameters, and of outputs: one thread at a time,
        because they are derived once for a system."""
        names, words = tuple(text_of(by).replace(" ", "").split(",")) if by else (), text_of(outputs) if outputs else ""
        if names == self._by and words == self._outputs:
            return
        keep = [ffi.new("char[]", name.encode()) for name in names]
        with self._alone(), self._context.lock:
            status = lib.kempe_workspace_add_derivatives(
                self._pointer, len(names), ffi.new("char *[]", keep), words.encode() if words else ffi.NULL
            )
        if status:
            self._by, self._outputs = None, ""
            self._fail(status)
        self._by, self._outputs, self._checked, self._curved = names, words, None, False
        outs = lib.kempe_workspace_output_count(self._pointer)
        n, m, p, k = self.n, self.m, lib.kempe_workspace_independent_count(self._pointer), len(names)
        all_of: dict[str, _Shape] = {f"{of}_{by}": (rows, n) for of, rows in (("qdd", n), ("lambda", m)) for by in ("q", "qd", "Q")}
        all_of |= {"qdd_p": (n, k), "lambda_p": (m, k)}
        all_of |= {"y": (outs,), "y_q": (outs, n), "y_qd": (outs, n), "y_Q": (outs, n), "y_p": (outs, k)}
        closed: dict[str, _Shape] = {"udd_u": (p, p), "udd_ud": (p, p), "udd_Q": (p, n), "q_u": (n, p), "qd_u": (n, p)}
        closed |= {"udd_p": (p, k), "q_p": (n, k), "qd_p": (n, k)}
        closed |= {"y": (outs,), "y_u": (outs, p), "y_ud": (outs, p), "y_up": (outs, k)}
        self._places = _placed(n + m, all_of), _placed(n + m, closed)

    def rates(self, t: float, state: ArrayLike) -> Array:
        """Rates (qd, qdd) of a state (q, qd): a right side for scipy.integrate.solve_ivp. Closures are kept only by
        accelerations, so that they drift. States with samples or events keep their values, and a warning names them.

        Raises FailedError if the equations are singular. Raises ValueError if an array has another shape. Raises TypeError if its
        entries are not numbers.

        >>> from scipy.integrate import solve_ivp  # with SciPy
        >>> system = kempe.Model("four_bar.yaml").system()
        >>> start, workspace = system.assemble(), system.workspace()
        >>> y0 = [*start.q, *start.qd]
        >>> solve_ivp(workspace.rates, (0, 0.1), y0, rtol=1e-8, atol=1e-10).success  # with SciPy
        True
        """
        n = self.n
        y = matched(state, 2 * n, "state")
        if not self._rated:
            self._rated = True
            self._tell_of_held_states()
        made = np.empty(2 * n)
        made[:n] = y[n:]
        self.forward_dynamics(t, y[:n], y[n:], out=Accelerations(made[n:], self._lam))
        return made

    def _tell_of_held_states(self) -> None:
        states = self._system._of_model().parsed().get("states", {})
        held = [name for name, words in states.items() if "next" in words]
        if held:
            words = f"rates: {', '.join(repr(name) for name in held[:3])} change at samples or events only, and have the rate zero here: use a stepper"
            warnings.warn(words, KempeWarning, level_of_caller())

    def inverse_dynamics(
        self,
        t: float,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        out: Array | None = None,
        actuators: str | Iterable[str] | None = None,
        weights: ArrayLike | None = None,
    ) -> Array:
        """Generalized forces Q = M qdd + C (n; N m or N), with the loops open.

        With `actuators`, coordinates on which they act: the forces of these, in their order, which give the accelerations
        through the closed loops (computed torque). Of several solutions it has the least sum of weight times force squared, forces in N times the characteristic length;
        weights are 1 by default. Dependent accelerations follow from the independent ones, and are not read.

        Raises FailedError if the loops are open or the actuators cannot produce the accelerations. Raises ArgumentError if there is no
        such coordinate, a weight is not positive, or weights are given without actuators. Raises it without actuators, too, where a
        force depends on multipliers, such as friction by a load. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> workspace.inverse_dynamics(0.0, [0, 0, 0], [0, 0, 0], [0, 0, 0]).shape
        (3,)
        >>> q, qd = workspace.close(0.0, [0.3, 0, 0], [1, 0, 0], hold="crank")
        >>> workspace.inverse_dynamics(0.0, q, qd, [0, 0, 0], actuators="crank, rocker").shape
        (2,)
        """
        n = self.n
        if actuators is not None:
            return self._actuator_forces(t, (q, qd, qdd), out, actuators, weights)
        if weights is not None:
            raise ArgumentError("weights need actuators: name the coordinates on which they act")
        made = np.empty(n) if out is None else out
        status = _inverse(self._address, n, self.m, t, q, qd, qdd, made)
        if status:
            writable(made, (n,), "out")
            given = converted(q, n, "q"), converted(qd, n, "qd"), converted(qdd, n, "qdd")
            self._settle(status, _inverse, t, *given, made)
        return made

    def _actuator_forces(self, t: float, state: tuple[Any, ...], out: Any, actuators: Any, weights: Any) -> Array:
        t, names = real(t, "t"), tuple(name for name in text_of(actuators).replace(" ", "").split(",") if name)
        if not names:
            raise ArgumentError("actuators is empty: name the coordinates on which forces act")
        shares = None if weights is None else tuple(matched(weights, len(names), "weights"))
        arrays = [matched(each, self.n, name) for each, name in zip(state, ("q", "qd", "qdd"))]
        made = np.empty(len(names)) if out is None else out
        place = writable(made, (len(names),), "out")
        with self._alone():
            status = 0
            if self._actuators != (names, shares):
                keep = [ffi.new("char[]", name.encode()) for name in names]
                status = lib.kempe_workspace_add_actuators(
                    self._pointer, len(names), ffi.new("char *[]", keep), ffi.new("double[]", shares) if shares else ffi.NULL
                )
                self._actuators = (names, shares) if status == 0 else None
            if status == 0:
                status = lib.kempe_workspace_actuator_forces(self._pointer, t, *_pointers(arrays), place, ffi.NULL)
        if status:
            self._fail(status)
        return made

    def closed_equations(self, t: float, q: ArrayLike, qd: ArrayLike) -> ClosedEquations:
        """The equations of closed motions in the independent coordinates (`independent`): M udd + C = X' Q for generalized forces
        Q, and the accelerations of all coordinates X udd + drift.

        Raises FailedError if the loops are open or the independent coordinates do not describe the motion. Raises ValueError if an
        array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> q, qd = workspace.close(0.0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
        >>> found = workspace.closed_equations(0.0, q, qd)
        >>> found.M.shape, found.X.shape
        ((1, 1), (3, 1))
        """
        n, p, t = self.n, len(self.independent), real(t, "t")
        arrays = [matched(q, n, "q"), matched(qd, n, "qd")]
        made = ClosedEquations(np.empty((p, p), order="F"), np.empty(p), np.empty((n, p), order="F"), np.empty(n))
        with self._alone():
            status = lib.kempe_workspace_closed_equations(
                self._pointer, t, *_pointers(arrays), ffi.new("kempe_closed_equations *", _pointers(each.T for each in made))
            )
        if status:
            self._fail(status)
        return made

    def close(
        self, t: float, q: ArrayLike, qd: ArrayLike | None = None, hold: str | Iterable[str] = ()
    ) -> tuple[Array, Array]:
        """Closed q and qd near the given ones. Coordinates in `hold` keep their values.

        Raises ArgumentError if there is no such coordinate or a value is not finite. Raises FailedError if the loops cannot be closed
        from there. Raises ValueError if an array has another shape. Raises TypeError if its entries are not numbers.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> q, qd = workspace.close(0.0, [0.2, 0, 0], hold=["crank"])
        >>> bool(q[0] == 0.2), bool(abs(workspace.evaluate(0.0, q).h).max() < 1e-12)
        (True, True)
        """
        coordinates = self._context.coordinates
        held = text_of(hold).replace(" ", "").split(",") if hold else []
        for name in held:
            if name not in coordinates:
                raise ArgumentError(unknown("coordinate", name, coordinates))
        t = finite(t, "t")
        closed = matched(q, self.n, "q").copy()
        rates = np.zeros(self.n) if qd is None else matched(qd, self.n, "qd").copy()
        keep = ffi.new(INTS, [int(name in held) for name in coordinates])
        places = writable(closed, (self.n,), "q"), writable(rates, (self.n,), "qd")
        with self._alone():
            status = lib.kempe_workspace_close(self._pointer, t, *places, keep)
        if status or self.m == 0:  # what is not finite does not close
            for name, given in (("q", q), ("qd", qd)):
                if given is not None:
                    all_finite(matched(given, self.n, name), name, coordinates)
        if status:
            self._fail(status)
        return closed, rates

    # -- many states ---------------------------------------------------------------------------------

    def evaluate_states(
        self,
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        out: Equations | None = None,
        threads: int = 1,
    ) -> Equations:
        """The equations at N states, rows of q and qd (N x n); t is a number, or N of them. `out`: an earlier result.
        `threads` share the states, 0: one for each processor; results are the same. From 500 states of a thread on, eight are
        evaluated at once in vector registers, unless the model has conditions or forces of its user.

        Raises FailedError if a state fails; the message has the number of the first one. Raises ArgumentError if a time is not finite.
        Raises Interrupted if Ctrl-C ends it. Raises ValueError if an array has another shape. Raises TypeError if its entries are not
        numbers.

        >>> model = kempe.Model("four_bar.yaml")
        >>> run = model.simulate(t_end=1)
        >>> many = model.system().workspace().evaluate_states(run.t, run.q, run.qd)
        >>> many.M.shape, many.J.shape
        ((101, 3, 3), (101, 2, 3))
        """
        states = _States(self, t, q, qd=qd)
        count, n, m = states.count, self.n, self.m
        if out is None:
            J = np.empty((count, n, m)).transpose(0, 2, 1)
            out = Equations(
                np.empty((count, n, n)), np.empty((count, n)), np.empty((count, m)), J, np.empty((count, m))
            )
        states.run(
            lib.python_evaluate_states,
            threads,
            mass=out.M,
            bias=out.C,
            h=out.h,
            jacobian=out.J.transpose(0, 2, 1),
            jdqd=out.jdqd,
        )
        return out

    def forward_states(
        self,
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike,
        Q: ArrayLike | None = None,
        out: Accelerations | None = None,
        threads: int = 1,
    ) -> Accelerations:
        """Accelerations (N x n) and multipliers (N x m) at N states. `threads`: as in evaluate_states.

        Raises the exceptions of `evaluate_states`.

        >>> model = kempe.Model("four_bar.yaml")
        >>> run = model.simulate(t_end=1)
        >>> found = model.system().workspace().forward_states(run.t, run.q, run.qd)
        >>> found.qdd.shape, bool(abs(found.qdd - run.qdd).max() < 1e-6)
        ((101, 3), True)
        """
        states = _States(self, t, q, qd=qd, Q=Q)
        if out is None:
            out = Accelerations(np.empty((states.count, self.n)), np.empty((states.count, self.m)))
        states.run(lib.python_forward_states, threads, accelerations=out.qdd, multipliers=out.lam)
        return out

    def inverse_states(
        self, t: ArrayLike, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Generalized forces M qdd + C (N x n) at N states. `threads`: as in evaluate_states.

        Raises the exceptions of `evaluate_states`. Raises ArgumentError if an acceleration is not finite.

        >>> model = kempe.Model("four_bar.yaml")
        >>> run = model.simulate(t_end=1)
        >>> model.system().workspace().inverse_states(run.t, run.q, run.qd, run.qdd).shape
        (101, 3)
        """
        states = _States(self, t, q, qd=qd, qdd=qdd)
        bad = np.argwhere(~np.isfinite(states.rows["qdd"]))
        if len(bad):
            raise ArgumentError(f"state {bad[0, 0]}: qdd of '{self._context.coordinates[bad[0, 1]]}' is not finite")
        out = np.empty((states.count, self.n)) if out is None else out
        states.run(lib.python_inverse_states, threads, forces=out)
        return out


class _States:
    """Rows of states as the helpers in C read them."""

    def __init__(self, workspace: Workspace, t: ArrayLike, q: ArrayLike, **rows: ArrayLike | None) -> None:
        self.workspace = workspace
        first = numbers(q, "q")
        self.count = len(first) if first.ndim == 2 else 0
        self.t = numbers(t, "t")
        if self.t.shape not in ((), (1,), (self.count,)):
            raise ValueError(f"t is a number or {self.count} of them, not of the shape {self.t.shape}")
        if not np.isfinite(self.t).all():
            raise ArgumentError(f"state {int(np.flatnonzero(~np.isfinite(self.t))[0])}: t is not finite")
        self.rows: dict[str, Array] = {}
        self.more: dict[str, Any] = {}  # further members, of all states
        for name, values in {"q": first, **rows}.items():
            if values is not None:
                self.rows[name] = array = numbers(values, name)
                if array.ndim != 2 or array.shape != (self.count, workspace.n):
                    raise ValueError(
                        f"{name} has rows of {workspace.n} values for each state, not the shape {array.shape}"
                    )

    def run(
        self, function: Any, threads: int, prepare: Callable[[Workspace], None] | None = None, **results: Array
    ) -> None:
        n, m, count = self.workspace.n, self.workspace.m, self.count
        shapes = {"mass": (n, n), "jacobian": (n, m), "bias": (n,), "accelerations": (n,), "forces": (n,)}
        if "y" in results:
            shapes["y"] = (lib.kempe_workspace_output_count(self.workspace._pointer),)
        if "logarithm" in results:
            shapes |= {"logarithm": (), "by_u": results["by_u"].shape[1:]}
        for name, array in results.items():
            writable(array, (count, *shapes.get(name, array.shape[1:] if array.ndim == 3 else (m,))), name)
        self.rows.update(results)
        threads = whole(threads, "threads")
        if threads < 0:
            raise ArgumentError(f"threads is a number of threads, or 0 for all processors, not {threads}")
        team = self.workspace._team(max(1, min(threads or processors(), count)))
        if prepare:
            for each in team:
                prepare(each)
        ends = [count * k // len(team) for k in range(len(team) + 1)]
        context = self.workspace._context
        try:
            if len(team) == 1:
                failures = [self._part(function, self.workspace, 0, count, context.pointer if interruptible() else ffi.NULL)]
            else:
                failures = self._in_threads(function, team, ends)
        except KeyboardInterrupt as interrupt:
            raise Interrupted from interrupt
        for status, message in failures:
            if status:
                self.workspace._context.run(int)  # raises what a callback has raised
                raise error_of(status, message)

    def _in_threads(self, function: Any, team: list[Workspace], ends: list[int]) -> list[tuple[int, str]]:
        from concurrent.futures import ThreadPoolExecutor

        context = self.workspace._context.pointer
        try:
            with ThreadPoolExecutor(len(team)) as pool:
                try:
                    return list(pool.map(lambda *part: self._part(function, part[0], part[1], part[2], ffi.NULL), team, ends, ends[1:]))
                except KeyboardInterrupt:
                    lib.kempe_context_interrupt(context)  # for which the pool waits
                    raise
        except KeyboardInterrupt:
            lib.kempe_context_clear_interrupt(context)  # which no thread may have seen
            raise

    def _part(self, function: Any, workspace: Workspace, begin: int, end: int, guarded: Any) -> tuple[int, str]:
        """Computes states begin .. end - 1 in one thread. `guarded`: the context that SIGINT interrupts, or NULL."""
        step = int(self.t.shape == (self.count,))
        keep = {name: _from_buffer(DOUBLES, array[begin:end]) for name, array in self.rows.items()}
        keep["t"] = _from_buffer(DOUBLES, self.t[begin:end] if step else self.t)
        sizes = {"count": end - begin, "n": workspace.n, "m": workspace.m, "t_step": step, "guarded": guarded, "failed": -1}
        struct = ffi.new("python_states *", {**sizes, **keep, **self.more})
        with workspace._alone():
            status: int = function(workspace._pointer, struct)
        return status, f"state {begin + struct.failed}: {string(lib.kempe_workspace_message(workspace._pointer))}"


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
