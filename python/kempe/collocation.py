# SPDX-License-Identifier: BSD-3-Clause
"""Optimal motions by direct collocation in the independent coordinates, solved by IPOPT."""

from __future__ import annotations

import warnings
from bisect import bisect
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from .arrays import Array, matched, numbers, real, whole
from .errors import ArgumentError, FailedError, KempeWarning, StoppedError
from .followed_loops import FollowedLoops
from .ipopt import load, solve
from .lazy import np
from .motion_problem import MotionProblem, Plan, force_limits, not_negative, weights_of
from .options import unknown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from .workspace import Workspace

_APART = 1e-3  # of the squared determinant of the loops at the start: its least value in a motion
_GROWTH = 8  # the most parts into which an interval is divided
_REPEATED = 1e-7  # of the length of an equation at the end: what it must add to those before it
_REPEATED_ROOM = 1e-6  # of a value at the end that others imply, or of one
_WARM = {"mu_init": 1e-6, "bound_push": 1e-8, "bound_frac": 1e-8, "slack_bound_push": 1e-8, "slack_bound_frac": 1e-8}  # options of IPOPT
_NEAR = 1e-2  # the largest violation of a limit by a motion from which IPOPT begins as from its own
_SCHEMES = {"hermite-simpson": (0.0, 0.5, 1.0), "radau": (0.0, 0.4 - 0.06**0.5, 0.4 + 0.06**0.5, 1.0)}  # points of an interval


def _polynomials(scheme: str, x: Any) -> tuple[Array, Array]:
    """Values at x, 0 .. 1, of the polynomials through the values at the points of an interval, and their integrals from 0 on.
    Radau's polynomials leave out the first point."""
    points, left = np.array(_SCHEMES[scheme]), int(scheme == "radau")
    power, x = np.arange(len(points) - left), np.atleast_1d(np.asarray(x, dtype=np.float64))[:, None]
    made = np.zeros((2, len(x), len(points)))
    made[:, :, left:] = np.array([x**power, x ** (power + 1) / (power + 1)]) @ np.linalg.inv(points[left:, None] ** power)
    return made[0], made[1]


def _places(scheme: str, mesh: Array) -> Array:
    """All points of a mesh: the points of the scheme in each interval."""
    return np.append((mesh[:-1, None] + np.diff(mesh)[:, None] * np.array(_SCHEMES[scheme])[:-1]).ravel(), mesh[-1])


class PlannedForces:
    """Generalized forces of a motion at a time: the `force` of Model.system, for a run that repeats it."""

    def __init__(self, t: Array, forces: Array, scheme: str, columns: list[int], n: int) -> None:
        points, left = np.array(_SCHEMES[scheme]), int(scheme == "radau")
        size = len(points) - 1
        self.ends: list[float] = t[::size].tolist()
        self.columns, self.n = columns, n
        rows = size * np.arange(len(self.ends) - 1)[:, None] + np.arange(left, size + 1)
        power = np.arange(size + 1 - left)
        self.parts: Array = np.linalg.inv(points[left:, None] ** power) @ forces[rows]  # of polynomials, by ascending powers

    def __call__(self, t: float, q: Array, qd: Array) -> Array:
        k = min(max(bisect(self.ends, t) - 1, 0), len(self.ends) - 2)
        x = min(max((t - self.ends[k]) / (self.ends[k + 1] - self.ends[k]), 0.0), 1.0)
        made, value = np.zeros(self.n), np.zeros(len(self.columns))
        for part in self.parts[k, ::-1]:
            value = value * x + part
        made[self.columns] = value
        return made


class Motion(NamedTuple):
    """An optimal motion by collocation: states and forces of actuators at all points t, 2 or 3 for each interval of the mesh after
    the first point. `error` is the largest integral over an interval of what is missing in the equations between its points, relative to
    the largest size of a coordinate or rate where this exceeds 1; `replay` the largest difference of a coordinate from a run
    with these forces. `history` has the number of intervals, the iterations of IPOPT and the error of each mesh."""

    t: Array  # M, s
    q: Array  # M, n
    qd: Array
    forces: Array  # M, a: N or N m
    cost: float
    converged: bool
    reason: str  # why it ended
    error: float
    replay: float  # rad or m
    history: tuple[tuple[int, int, float], ...]
    scheme: str
    actuators: tuple[str, ...]
    force: PlannedForces

    def at(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """q, qd and forces at times, interpolated between the points."""
        points, times = np.array(_SCHEMES[self.scheme]), np.clip(np.atleast_1d(np.asarray(t, dtype=np.float64)), 0.0, self.t[-1])
        size = len(points) - 1
        ends = self.t[::size]
        k = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, len(ends) - 2)
        part = ((times - ends[k]) / (ends[k + 1] - ends[k]))[:, None] ** np.arange(size + 1)
        weights, rows = part @ np.linalg.inv(points[:, None] ** np.arange(size + 1)), (size * k)[:, None] + np.arange(size + 1)
        q, qd = (np.einsum("kj,kji->ki", weights, each[rows]) for each in (self.q, self.qd))
        return q, qd, np.array([self.force(float(each), q, qd) for each in times])[:, self.force.columns]


def _range(value: Any, size: int, name: str) -> tuple[Array, Array]:
    """Low and high values from a number or numbers, which are both, or from a pair with None on an open side."""
    pair = value if isinstance(value, tuple) else (value, value)
    if len(pair) != 2:
        raise ArgumentError(f"{name} has two limits at most, (low, high), not {value!r}")
    sides = []
    for side, otherwise in zip(pair, (-np.inf, np.inf)):
        array = np.asarray(otherwise) if side is None else numbers(side, name)
        if array.shape not in ((), (1,), (size,)) or np.isnan(array).any():
            count = "a number" if size == 1 else f"{size} numbers, one for all"
            raise ArgumentError(f"{name} is {count}, or a pair (low, high), None on an open side, not {value!r}")
        sides.append(np.broadcast_to(array, (size,)))
    if (sides[0] > sides[1]).any():
        raise ArgumentError(f"{name} has a low limit above the high one: {value!r}")
    return sides[0], sides[1]


class _Limits:
    """Limits on outputs: their columns, low and high."""

    def __init__(self, columns: Any, low: Any, high: Any) -> None:
        self.columns: NDArray[np.intp] = np.asarray(columns, dtype=np.intp)
        self.low, self.high = (np.asarray(each, dtype=np.float64) for each in (low, high))

    def some(self, chosen: NDArray[np.bool_]) -> _Limits:
        return _Limits(self.columns[chosen], self.low[chosen], self.high[chosen])

    def without_repetition(self, by: Array) -> _Limits:
        """Values that follow from those before them, as the rates of all coordinates of a loop do, get a narrow range: IPOPT wants
        independent equations. `by`: derivatives of all outputs."""
        low, high, basis = self.low.copy(), self.high.copy(), np.zeros((0, by.shape[1]))
        for k in np.flatnonzero(low == high):
            row = by[self.columns[k]] / max(np.linalg.norm(by[self.columns[k]]), 1e-300)
            left = row - basis.T @ (basis @ row)
            if np.linalg.norm(left) > _REPEATED:
                basis = np.vstack((basis, left / np.linalg.norm(left)))
            elif row.any():
                room = _REPEATED_ROOM * max(1.0, abs(low[k]))
                low[k], high[k] = low[k] - room, high[k] + room
        return _Limits(self.columns, low, high)


class _Cost(NamedTuple):
    """Weights of the time, the states, the forces over their scale, and the state at the end, from a target."""

    time: float
    running: Array
    effort: Array
    final: Array
    target: Array


class _Equations:
    """Independent accelerations and outputs y of a mechanism: values of coordinates and rates, outputs of the model language, and
    where there are loops the distance from singular positions."""

    def __init__(self, problem: MotionProblem, t: Array, most: Array, words: Iterable[str]) -> None:
        self.workspace, self.n, self.u, self.act = problem.workspace, problem.n, problem.u, problem.act
        self.p, self.a, self.loops = len(problem.u), len(problem.act), FollowedLoops(problem.workspace, problem.start[0], t)
        self.most, self.scale = most, np.where(np.isfinite(most), most, 1.0)
        self.labels: list[str] = []
        self.columns: dict[str, list[int]] = {}  # by words
        coordinates, others = self.workspace._context.coordinates, []
        chosen: list[tuple[str, int]] = []
        for word in words:
            kind, _, name = word.replace(" ", "").rstrip(")").partition("(")
            if kind not in ("q", "qd"):
                others.append(word)
                continue
            if name and name not in coordinates:
                raise ArgumentError(unknown("coordinate", name, coordinates))
            new = [(kind, coordinates.index(each)) for each in ([name] if name else coordinates)]
            self.columns[word] = list(range(len(chosen), len(chosen) + len(new)))
            chosen += new
        self.labels += [f"{kind}.{coordinates[i]}" for kind, i in chosen]
        self.values = len(chosen)  # columns of coordinates and rates
        self.of_q, self.of_qd = ([k for k, each in enumerate(chosen) if each[0] == kind] for kind in ("q", "qd"))
        self.q, self.qd = ([i for each, i in chosen if each == kind] for kind in ("q", "qd"))
        for word in others:
            names = self.workspace._system.outputs(word).names
            self.columns[word] = list(range(len(self.labels), len(self.labels) + len(names)))
            self.labels += names
        self.outputs, self.count = ", ".join(others), len(self.labels)
        self.pushes = np.zeros((2 * self.p + self.a, self.n))  # directions of the forces over their scale, after u and ud
        self.pushes[range(2 * self.p, 2 * self.p + self.a), self.act] = self.scale
        self.forced = not all(word.strip().startswith(("position", "velocity")) for word in others)  # outputs depend on accelerations
        self.labels += ["distance from singular positions"] if self.loops.v else []

    def limits(self, given: dict[str, Any], name: str) -> _Limits:
        parts = [(self.columns[word], *_range(value, len(self.columns[word]), f"{name}[{word!r}]")) for word, value in given.items()]
        return _Limits(*(np.concatenate([[], *(part[i] for part in parts)]) for i in range(3)))

    def derived(self, t: Array, q: Array, qd: Array, forces: Array, apart: bool = True) -> tuple[Array, Array, Array, Array]:
        """Accelerations and outputs at states, and their derivatives by u, ud and the forces over their scale. `apart`: with the
        distance from singular positions."""
        Q, p = np.zeros((len(q), self.n)), self.p
        Q[:, self.act] = forces
        found = self.workspace.closed_derivatives(t, q, qd, Q, outputs=self.outputs)
        udd_z = np.concatenate((found.udd_u, found.udd_ud, found.udd_Q[:, :, self.act] * self.scale), axis=2)
        y, y_z = np.zeros((len(q), len(self.labels))), np.zeros((len(q), len(self.labels), udd_z.shape[2]))
        y[:, self.of_q], y[:, self.of_qd] = q[:, self.q], qd[:, self.qd]
        y_z[:, self.of_q, :p], y_z[:, self.of_qd, :p] = found.q_u[:, self.q], found.qd_u[:, self.qd]
        y_z[:, self.of_qd, p : 2 * p] = found.q_u[:, self.qd]
        if self.outputs:
            others = slice(self.values, self.count)
            y[:, others], y_z[:, others, :p], y_z[:, others, p : 2 * p] = found.y, found.y_u, found.y_ud
            if self.forced:
                y_Q = self.workspace.forward_derivatives(t, q, qd, Q, outputs=self.outputs).y_Q
                y_z[:, others, 2 * p :] = y_Q[:, :, self.act] * self.scale
        if self.loops.v and apart:
            y[:, -1], y_z[:, -1, :p] = self.loops.apart(t, q)
        return found.qdd[:, self.u], udd_z, y, y_z


class _Transcription:
    """A nonlinear program for IPOPT. Its unknowns are u, ud and the forces over their scale at each point of the mesh, then the
    end time; its constraints the collocation of each interval, limits at the points and at the end, and for Radau's scheme the
    first force, which continues the polynomial of the interval."""

    def __init__(
        self,
        equations: _Equations,
        cost: _Cost,
        limits: tuple[_Limits, _Limits, _Limits],
        scheme: str,
        mesh: Array,
        begin: tuple[Array, Array, Array],
        t: tuple[float, float, float],
    ) -> None:
        self.equations, self.weights, self.scheme, self.mesh = equations, cost, scheme, mesh
        self.first, self.path, self.end = limits
        self.x, self.w, N, s = 2 * equations.p, 2 * equations.p + equations.a, len(mesh) - 1, len(_SCHEMES[scheme]) - 1
        self.A, self.M, self.part = _polynomials(scheme, _SCHEMES[scheme][1:])[1], N * s + 1, np.diff(mesh)
        self.index, self.fraction = s * np.arange(N)[:, None] + np.arange(s + 1), _places(scheme, mesh)
        self.quadrature = np.zeros(self.M)
        np.add.at(self.quadrature, self.index, self.part[:, None] * self.A[-1])
        self.extrapolated = np.eye(1, s + 1)[0] - _polynomials(scheme, 0.0)[0][0] if scheme == "radau" else np.empty(0)
        self.q, qd, forces = begin  # q: closed, near the present unknowns
        self.z = np.append(np.hstack((self.q[:, equations.u], qd[:, equations.u], forces / equations.scale)).ravel(), t[1])
        most = np.tile(np.append(np.full(self.x, np.inf), equations.most / equations.scale), (self.M, 1))
        sides = -most, most
        for side in sides:
            side[0, : self.x] = self.z[: self.x]
        self.low, self.high = (np.append(side, time) for side, time in zip(sides, (t[0], t[2])))
        none, extra = np.zeros(N * s * self.x), np.zeros(equations.a if len(self.extrapolated) else 0)
        self.least, self.most = (
            np.concatenate((none, getattr(self.first, side), np.tile(getattr(self.path, side), self.M - 1), getattr(self.end, side), extra))
            for side in ("low", "high")
        )
        self._structure(N, s)
        self.at = np.full(len(self.z), np.nan)  # the unknowns of the values below

    def _structure(self, N: int, s: int) -> None:
        """Places of the entries of the Jacobian and of the Hessian."""
        x, w, p = self.x, self.w, self.equations.p
        rate, edge = np.zeros((x, w), dtype=bool), np.zeros((s, s + 1))
        rate[:p, p:x], rate[p:] = np.eye(p), True
        edge[:, 0], edge[:, 1:] = -1.0, np.eye(s)
        self.fixed = np.einsum("ij,rc->irjc", edge, np.eye(x, w))  # of an interval: point, state; point, unknown
        self.mask = (self.fixed != 0) | np.einsum("ij,rc->irjc", self.A != 0, rate)
        i, r, j, c = np.nonzero(self.mask)
        row, points = N * s * x, [(self.first, 0), *((self.path, k) for k in range(1, self.M)), (self.end, self.M - 1)]
        rows, columns = [(np.arange(N)[:, None] * s * x + i * x + r).ravel(), np.arange(row)], [(self.index[:, j] * w + c).ravel(), np.full(row, self.M * w)]
        for limits, point in points:
            count = len(limits.columns)
            rows.append(np.repeat(np.arange(row, row + count), w))
            columns.append(np.tile(point * w + np.arange(w), count))
            row += count
        for k in range(len(self.least) - row):
            rows.append(np.full(s + 1, row + k))
            columns.append(np.arange(s + 1) * w + x + k)
        self.jacobian_places = np.concatenate(rows), np.concatenate(columns)
        self.lower, first, last = np.tril_indices(w), w * np.arange(self.M)[:, None], np.arange(self.M * w + 1)
        self.hessian_places = np.append(first + self.lower[0], np.full_like(last, self.M * w)), np.append(first + self.lower[1], last)

    def _evaluate(self, z: Array) -> None:
        """Accelerations, outputs and the cost at all points, with their derivatives."""
        if np.array_equal(z, self.at):
            return
        self.at[:] = np.nan
        e, Z, t = self.equations, z[:-1].reshape(self.M, self.w), z[-1] * self.fraction
        q = e.loops.positions(t, self.q, Z[:, : e.p])
        qd = e.loops.rates(t, q, Z[:, e.p : self.x])
        udd, self.udd_z, self.y, self.y_z = e.derived(t, q, qd, Z[:, self.x :] * e.scale)
        self.q, self.qd, self.F = q, qd, np.hstack((Z[:, e.p : self.x], udd))
        self.at[:], self.last = z, z.copy()
        self.Z, self.T = self.at[:-1].reshape(self.M, self.w), float(z[-1])
        off, forces = self.Z[:, : self.x] - self.weights.target, self.Z[:, self.x :]
        self.cost_z, self.miss = np.hstack((off @ self.weights.running, forces @ self.weights.effort)), off[-1]
        self.cost = 0.5 * np.einsum("ki,ki->k", np.hstack((off, forces)), self.cost_z)

    def settle(self, z: Array) -> None:
        """Evaluates the end of IPOPT's search; where this is impossible, the last values remain."""
        try:
            self._evaluate(z)
        except FailedError:
            self.at[:] = self.last

    def violation(self) -> float:
        """The largest violation of a limit by the first guess."""
        values = self.constraints(self.z)
        return float(np.maximum(self.least - values, values - self.most).max(initial=0))

    def value(self, z: Array) -> float:
        self._evaluate(z)
        return float(self.T * self.quadrature @ self.cost + self.weights.time * self.T + 0.5 * self.miss @ self.weights.final @ self.miss)

    def gradient(self, z: Array) -> Array:
        self._evaluate(z)
        made = self.T * self.quadrature[:, None] * self.cost_z
        made[-1, : self.x] += self.weights.final @ self.miss
        return np.append(made, self.quadrature @ self.cost + self.weights.time)

    def _change(self) -> Array:
        """The change of the state from the beginning of each interval to its points, over the end time."""
        change: Array = self.part[:, None, None] * (self.A @ self.F[self.index])
        return change

    def _limited(self, y: Array) -> tuple[Array, Array, Array]:
        return y[0, self.first.columns], y[1:, self.path.columns], y[-1, self.end.columns]

    def constraints(self, z: Array) -> Array:
        self._evaluate(z)
        state, first = self.Z[self.index, : self.x], len(self.extrapolated)
        missing = state[:, 1:] - state[:, :1] - self.T * self._change()
        force = self.extrapolated @ self.Z[:first, self.x :] if first else np.empty(0)
        return np.concatenate([np.ravel(each) for each in (missing, *self._limited(self.y), force)])

    def jacobian(self, z: Array) -> Array:
        self._evaluate(z)
        p, F_z = self.equations.p, np.zeros((self.M, self.x, self.w))
        F_z[:, :p, p : self.x], F_z[:, p:] = np.eye(p), self.udd_z
        blocks = self.fixed - self.T * np.einsum("k,ij,kjrc->kirjc", self.part, self.A, F_z[self.index])
        entries = blocks[:, self.mask], -self._change(), *self._limited(self.y_z), np.tile(self.extrapolated, self.equations.a)
        return np.concatenate([np.ravel(each) for each in entries])

    def hessian(self, z: Array, factor: float, multipliers: Array) -> Array:
        self._evaluate(z)
        x, p, count = self.x, self.equations.p, self.index[:, 1:].size * self.x
        rates = np.zeros((self.M, x))  # weights of the rates at the points, over the end time
        of_state = np.einsum("ij,kir->kjr", self.A, multipliers[:count].reshape(len(self.part), -1, x))
        np.add.at(rates, self.index, -self.part[:, None, None] * of_state)
        first = count + len(self.first.columns)
        last = first + (self.M - 1) * len(self.path.columns)
        of_y = np.zeros_like(self.y)
        of_y[0, self.first.columns] = multipliers[count:first]
        of_y[1:, self.path.columns] = multipliers[first:last].reshape(self.M - 1, -1)
        of_y[-1, self.end.columns] += multipliers[last : last + len(self.end.columns)]
        H, share = self._curvature(self.T * rates[:, p:], of_y), factor * self.T * self.quadrature[:, None, None]
        H[:, :x, :x] += share * self.weights.running
        H[:, x:, x:] += share * self.weights.effort
        H[-1, :x, :x] += factor * self.weights.final
        cross = factor * self.quadrature[:, None] * self.cost_z + np.einsum("kr,krc->kc", rates[:, p:], self.udd_z)
        cross[:, p:x] += rates[:, :p]
        return np.concatenate((H[:, self.lower[0], self.lower[1]].ravel(), cross.ravel(), [0.0]))

    def _curvature(self, of_udd: Array, of_y: Array) -> Array:
        """Second derivatives of weighted accelerations and outputs at the points, by u, ud and the forces over their scale."""
        e, x, w = self.equations, self.x, self.w
        qdd, by_q, by_qd = np.zeros((3, self.M, e.n))
        qdd[:, e.u] = of_udd
        np.add.at(by_q.T, np.asarray(e.q, dtype=np.intp), of_y[:, e.of_q].T)
        np.add.at(by_qd.T, np.asarray(e.qd, dtype=np.intp), of_y[:, e.of_qd].T)
        Q, direction = np.zeros((self.M, e.n)), np.eye(w)
        Q[:, e.act] = self.Z[:, x:] * e.scale
        H = np.zeros((self.M, w, w))
        if e.loops.v and of_y[:, e.count].any():
            H[:, : e.p, : e.p] = of_y[:, e.count, None, None] * e.loops.apart_curvature(self.T * self.fraction, self.q)
        found = e.workspace.forward_hessian(
            self.T * self.fraction, self.q, self.qd, Q, qdd=qdd, y=of_y[:, e.values : e.count] if e.outputs else None,
            by_q=by_q, by_qd=by_qd, du=direction[:, : e.p], dud=direction[:, e.p : x], dQ=e.pushes, outputs=e.outputs,
        )  # fmt: skip
        return H + found

    def errors(self) -> Array:
        """Of each interval: the integral of what is missing in the equations between its points; infinite near singular positions."""
        e, x = self.equations, self.x
        where, weights = (0.5 * each for each in np.polynomial.legendre.leggauss(5))
        where = where + 0.5
        values, integrals = _polynomials(self.scheme, where)
        inside, F = self.Z[self.index], self.F[self.index]
        state = inside[:, :1, :x] + self.T * self.part[:, None, None] * (integrals @ F)
        near = self.index[:, abs(where[:, None] - np.array(_SCHEMES[self.scheme])).argmin(axis=1)].ravel()
        t, ud = self.T * (self.mesh[:-1, None] + self.part[:, None] * where).ravel(), state[:, :, e.p :].reshape(-1, e.p)
        try:
            q = e.loops.positions(t, self.q[near], state[:, :, : e.p].reshape(-1, e.p), self.T * self.fraction[near])
            udd = e.derived(t, q, e.loops.rates(t, q, ud), (values @ inside[:, :, x:] * e.scale).reshape(-1, e.a), False)[0]
        except FailedError:
            return np.full(len(self.part), np.inf)
        missing = abs(values @ F - np.hstack((ud, udd)).reshape(state.shape)) / np.maximum(1.0, abs(self.Z[:, :x]).max(axis=0))
        made: Array = (self.T * self.part[:, None] * np.einsum("j,kjr->kr", weights, missing)).max(axis=1)
        return made


def _replay(workspace: Workspace, motion: Motion) -> float:
    """The largest difference of a coordinate of the motion from a run with its forces."""
    system = workspace._system
    _, (_, dynamics, own) = system._recipe
    planned = motion.force
    force = planned if own is None else lambda t, q, qd: planned(t, q, qd) + own(t, q, qd)
    try:
        run = system._of_model().system(dynamics, force).stepper(t_end=float(motion.t[-1]), rtol=1e-9, atol=1e-11)
        for name, (t, value, rate, acceleration) in workspace._inputs.items():
            run.set_input(name, value - rate * t + 0.5 * acceleration * t**2, rate - acceleration * t, acceleration)
        run.set_state(motion.q[0], motion.qd[0])
        error, size = 0.0, len(_SCHEMES[motion.scheme]) - 1
        for k, (t, q) in enumerate(zip(motion.t.tolist(), motion.q)):
            if k % size == 0:  # forces have a kink at the ends of intervals
                run.set_stop(motion.t[min(k + size, len(motion.t) - 1)].item())
            run.advance(t)
            error = max(error, float(abs(run.q - q).max()))
        return error
    except (FailedError, StoppedError):
        return float("inf")


def _begin(problem: MotionProblem, guess: Any, t: Array) -> tuple[Array, Array, Array]:
    """Coordinates, rates and forces of a first guess at times; the loops need not be closed."""
    if isinstance(guess, Motion):
        return guess.at(t / t[-1] * guess.t[-1])
    if isinstance(guess, Plan):
        x, table = t / t[-1] * guess.t[-1], (guess.q, guess.qd, np.vstack((guess.forces, guess.forces[-1:])))
        q, qd, forces = (np.stack([np.interp(x, guess.t, column) for column in each.T], axis=1) for each in table)
        return q, qd, forces
    change = guess - problem.start[0]
    return problem.start[0] + (t / t[-1])[:, None] * change, np.tile(change / t[-1], (len(t), 1)), np.zeros((len(t), len(problem.act)))


def collocate(
    workspace: Workspace,
    q: ArrayLike,
    qd: ArrayLike,
    t_end: float | tuple[float, float],
    actuators: str | Iterable[str],
    end: dict[str, Any] | None = None,
    path: dict[str, Any] | None = None,
    limits: ArrayLike | None = None,
    effort: ArrayLike = 1e-3,
    time: float = 0.0,
    target: ArrayLike | None = None,
    final: ArrayLike = 0.0,
    running: ArrayLike = 0.0,
    guess: ArrayLike | Plan | Motion | None = None,
    intervals: int = 20,
    scheme: str = "hermite-simpson",
    accuracy: float = 1e-4,
    refinements: int = 5,
    iterations: int = 500,
    tolerance: float = 1e-6,
) -> Motion:
    """Forces that move the mechanism from q, qd within limits at least cost, by direct collocation: the least of

        time T + the integral of ((x - target)' running (x - target) + f' effort f) / 2 + (x_T - target)' final (x_T - target) / 2

    for x = (u, ud), the independent coordinates and their rates, and forces f on the coordinates that `actuators` names. `t_end` is the
    end time T (s), or a pair within which it is free. `path` and `end` have limits on outputs, all the time and at the end: words of the
    model language, each with a value or a pair (low, high), None on an open side: end={"q(crank)": 1.5, "qd": 0}. `limits` has the largest size
    of each force. The first guess is a motion at rest; with `guess` a straight line to other coordinates (n), or an earlier
    plan or motion, whose mesh counts. `scheme`: "hermite-simpson", or "radau" for stiff mechanisms.

    IPOPT solves for all states and forces at once (pip install casadi, whose wheel has it), by exact first and second derivatives; at most `iterations` for a mesh. Intervals of the mesh are divided, at most `refinements` times, until the equations hold
    between the points, and a run with the forces repeats the motion, to `accuracy`. Loops are followed from the start
    in their assembly mode, and singular positions, where it could change, are kept away.

    A motion that has not converged, or is less accurate, is a KempeWarning.

    Raises ArgumentError if an argument names what the mechanism does not have, has another shape or is outside its range, or the start
    is beyond the limits. Raises FailedError if the mechanism cannot follow the first guess or IPOPT refuses the program. Raises
    TypeError if limits are not a mapping. Raises ImportError if IPOPT is not installed.

    >>> from kempe.optimal import collocate
    >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
    >>> q, qd = workspace.close(0.0, [0.3, 0, 0], hold=["crank"])
    >>> end = {"q(crank)": 1.0, "qd(crank)": 0.0}
    >>> motion = collocate(workspace, q, qd, (0.1, 2.0), "crank", end, limits=5.0, time=1.0)  # with IPOPT
    >>> motion.converged, motion.replay < 1e-4  # with IPOPT
    (True, True)
    """
    problem = MotionProblem(workspace, q, qd, actuators)
    if not problem.u:
        raise ArgumentError("the mechanism has no independent coordinates: drives move it, or its start cannot be assembled")
    for label, words in (("path", path), ("end", end)):
        if words is not None and not isinstance(words, Mapping):
            raise TypeError(f'{label} is a mapping of outputs to limits, as {{"q(crank)": 1.5}}, not {type(words).__name__}')
    path, end, a, size = dict(path or {}), dict(end or {}), len(problem.act), 2 * len(problem.u)
    intervals, refinements, iterations = whole(intervals, "intervals"), whole(refinements, "refinements"), whole(iterations, "iterations")
    accuracy, tolerance, time = real(accuracy, "accuracy"), real(tolerance, "tolerance"), real(time, "time")
    if scheme not in _SCHEMES:
        raise ArgumentError(unknown("scheme", scheme, list(_SCHEMES)))
    low, high = (float(each[0]) for each in _range(t_end, 1, "t_end"))
    if not (low > 0 and np.isfinite(high)):
        raise ArgumentError(f"t_end is a positive time, or a pair of these, not {t_end!r}")
    if intervals < 1 or refinements < 0 or iterations < 1 or not (accuracy > 0 and tolerance > 0):
        raise ArgumentError("intervals, iterations, accuracy and tolerance must be positive, and refinements not negative")
    goal = np.zeros(size) if target is None else matched(target, size, "target (the independent coordinates, then their rates)")
    if not (np.isfinite(goal).all() and time >= 0 and np.isfinite(time)):
        raise ArgumentError("target and time must be finite, and time not negative")
    if isinstance(guess, (Plan, Motion)):
        if guess.q.shape[1] != problem.n or guess.forces.shape[1] != a:
            raise ArgumentError("guess is a plan or motion of another mechanism, or of other actuators")
    else:
        guess = problem.start[0] if guess is None else matched(guess, problem.n, "guess (the coordinates)")
        if not np.isfinite(guess).all():
            raise ArgumentError("guess has values that are not finite")
    load()  # before any work
    workspace.step(0.0, *problem.start, 1e-6, derivatives=False)  # refuses models with samples, events, delays or contacts
    times, begin = np.linspace(0.0, high, 7), [np.tile(each, (7, 1)) for each in problem.start]
    equations = _Equations(problem, times, force_limits(limits, a), dict.fromkeys([*path, *end]))
    weights = [not_negative(weights_of(*each), each[2]) for each in ((running, size, "running"), (effort, a, "effort"), (final, size, "final"))]
    cost = _Cost(float(time), weights[0], weights[1] * np.outer(equations.scale, equations.scale), weights[2], goal)
    C = workspace.evaluate_states(times, begin[0], begin[1]).C
    if low < high and (equations.loops.moving or abs(C - C[0]).max() > 1e-9 * max(1.0, abs(C).max())):
        raise ArgumentError("the equations depend on time: the end time must be one number")
    along, last = equations.limits(path, "path"), equations.limits(end, "end")
    _, _, y, y_z = equations.derived(times[:1], begin[0][:1], begin[1][:1], np.zeros((1, a)))
    last = last.without_repetition(y_z[0])
    forced = abs(y_z[0, along.columns, size:]).max(axis=1, initial=0) > 0
    fixed = along.some(~forced)
    for column, least, most in zip(fixed.columns, fixed.low, fixed.high):
        if not least - 1e-9 <= y[0, column] <= most + 1e-9:
            raise ArgumentError(f"the start has {equations.labels[column]} = {y[0, column]:.6g}, beyond its limits {least:g} .. {most:g}")
    first = along.some(forced)
    if equations.loops.v:
        along = _Limits(np.append(along.columns, equations.count), np.append(along.low, _APART), np.append(along.high, np.inf))

    mesh, T = np.linspace(0.0, 1.0, intervals + 1), (low * high) ** 0.5
    if isinstance(guess, (Plan, Motion)):
        T = float(np.clip(guess.t[-1], low, high))
        mesh = guess.t[:: len(_SCHEMES[guess.scheme]) - 1] / guess.t[-1] if isinstance(guess, Motion) else mesh
    history: list[tuple[int, int, float]] = []
    allowed = accuracy
    while True:
        t = T * _places(scheme, mesh)
        begun = _begin(problem, guess, t)
        try:
            closed = equations.loops.path(t, problem.start[0], begun[0][:, problem.u])
        except FailedError as error:
            raise FailedError(f"the mechanism cannot follow the first guess: {error}") from error
        for row, start in zip((closed, begun[1]), problem.start):
            row[0] = start
        program = _Transcription(equations, cost, (first, along, last), scheme, mesh, (closed, *begun[1:]), (low, T, high))
        warm = _WARM if history or isinstance(guess, Motion) and program.violation() < _NEAR else {}
        found = solve(program, program.z, {"tol": tolerance, "max_iter": iterations, **warm})
        program.settle(found.z)
        errors, T = program.errors(), program.T
        history.append((len(mesh) - 1, found.iterations, float(errors.max())))
        t, forces = T * program.fraction, program.Z[:, size:] * equations.scale
        values = program.value(program.last), found.converged, found.reason, float(errors.max()), np.inf, tuple(history), scheme, tuple(problem.names)
        motion = Motion(t, program.q, program.qd, forces, *values, PlannedForces(t, forces, scheme, problem.act, problem.n))
        last_mesh = not found.converged or len(history) > refinements
        if last_mesh or motion.error <= accuracy:
            motion = motion._replace(replay=_replay(workspace, motion))
        worst = max(motion.error, motion.replay)
        if last_mesh or worst <= accuracy:
            break
        allowed = min(allowed, 0.3 * motion.error) if motion.error <= accuracy else allowed
        pieces = np.clip(np.ceil((2 * errors / allowed) ** (1 / 3)), 1, _GROWTH).astype(int)
        parts = [np.linspace(left, right, count, endpoint=False) for left, right, count in zip(mesh, mesh[1:], pieces)]
        mesh, guess = np.append(np.concatenate(parts), 1.0), motion
    if not motion.converged:
        warnings.warn(f"the motion is not optimal: {motion.reason}", KempeWarning, stacklevel=2)
    elif worst > accuracy:
        amount = f"the equations miss {motion.error:.2g} between its points, and a run differs by {motion.replay:.2g}"
        warnings.warn(f"the motion is less accurate than {accuracy:g} after {refinements} refinements: {amount}", KempeWarning, stacklevel=2)
    return motion
