# SPDX-License-Identifier: BSD-3-Clause
"""Optimal motions of mechanisms with loops: forces of actuators for a least cost, with exact derivatives, by steps or by collocation."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from .arrays import Array, matched, numbers, real, whole
from .collocation import Motion, PlannedForces, collocate
from .errors import ArgumentError, FailedError, KempeWarning
from .lazy import np
from .motion_problem import MotionProblem, Plan, force_limits, not_negative, weights_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .workspace import Workspace

__all__ = ["Motion", "Plan", "PlannedForces", "collocate", "ilqr"]

_SHORTEST, _LEAST_GAIN = 10, 1e-4  # halvings of a step of the iteration; part of the expected gain that must come true
_FIRST, _LARGEST, _FACTOR = 1e-6, 1e10, 10.0  # of the regularisation, over the mean of the diagonal of the Hessian of forces


def _bounded(H: Array, g: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The minimum of g x + x H x / 2 between bounds by a projected Newton method, and which components are free."""
    x = np.clip(-np.linalg.solve(H, g), low, high)
    free = np.ones(len(g), dtype=bool)
    for _ in range(4 * len(g) + 4):
        slope = g + H @ x
        free = ~(((x <= low) & (slope > 0)) | ((x >= high) & (slope < 0)))
        if not free.any():
            break
        move = x.copy()
        move[free] = -np.linalg.solve(H[np.ix_(free, free)], g[free] + H[np.ix_(free, ~free)] @ x[~free])
        move = np.clip(move, low, high)
        if np.allclose(move, x, rtol=1e-12, atol=1e-14):
            break
        x = move
    return x, free


class _Steps(MotionProblem):
    """The steps of the horizon."""

    def __init__(self, workspace: Workspace, q: Any, qd: Any, h: float, actuators: Any, substeps: int) -> None:
        super().__init__(workspace, q, qd, actuators)
        h, substeps = real(h, "h"), whole(substeps, "substeps")
        if not h > 0 or substeps < 1:
            raise ArgumentError(f"a positive length of a step and at least one substep are required, not {h} s and {substeps}")
        self.h, self.substeps = h, substeps

    def step(self, k: int, q: Array, qd: Array, force: Array, derivatives: bool, fine: int = 1) -> Any:
        Q, count = np.zeros(self.n), self.substeps * fine
        Q[self.act] = force
        return self.workspace.step(k * self.h, q, qd, self.h / count, Q=Q, steps=count, derivatives=derivatives)


def ilqr(
    workspace: Workspace,
    q: ArrayLike,
    qd: ArrayLike,
    h: float,
    forces: ArrayLike,
    actuators: str | Iterable[str],
    target: ArrayLike,
    final: ArrayLike = 1.0,
    running: ArrayLike = 0.0,
    effort: ArrayLike = 1e-3,
    limits: ArrayLike | None = None,
    substeps: int = 1,
    iterations: int = 100,
    tolerance: float = 1e-5,
) -> Plan:
    """Forces that move the mechanism from q, qd to a target: the least of

        (x_N - target)' final (x_N - target) / 2 + h sum over k of ((x_k - target)' running (x_k - target) + f_k' effort f_k) / 2

    for x = (u, ud), the independent coordinates and their rates, by the iterative linear-quadratic regulator with box limits
    (Tassa, Mansard and Todorov, ICRA 2014). `forces` (N, a) is the first guess, which decides the local minimum: zero forces
    often have no derivative towards a swing. `actuators` names the a coordinates on which the forces act; `limits` has the largest
    size of each. Weights are numbers, diagonals or matrices. Each step of h (s) is taken in `substeps` Runge-Kutta steps with
    closed loops, so that the assembly mode is kept. Iterations end when one gains, or expects, less than `tolerance` of the cost.

    A plan that has not converged, or whose steps are too long for 1e-3 of the motion, is a KempeWarning.

    Raises ArgumentError if an argument names what the mechanism does not have, has another shape or is outside its range. Raises
    FailedError if the mechanism cannot follow the first guess of the forces. Raises TypeError if an argument has another type.

    >>> from kempe.optimal import ilqr
    >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
    >>> q, qd = workspace.close(0.0, [0.3, 0, 0], hold=["crank"])
    >>> goal = q[workspace._context.coordinates.index(workspace.independent[0])] + 0.1
    >>> plan = ilqr(workspace, q, qd, 0.01, [[0.0]] * 20, "crank", [goal, 0], final=[1e4, 1e2], effort=1e-4)
    >>> plan.converged, plan.forces.shape
    (True, (20, 1))
    """
    problem = _Steps(workspace, q, qd, h, actuators, substeps)
    guess: Array = numbers(forces, "forces").reshape(tuple(np.shape(forces))).copy()
    iterations, tolerance = whole(iterations, "iterations"), real(tolerance, "tolerance")
    a, size = len(problem.act), 2 * len(problem.u)
    if guess.ndim != 2 or guess.shape[1] != a or len(guess) == 0:
        raise ArgumentError(f"forces has a row of {a} numbers for each step, not the shape {guess.shape}")
    goal = matched(target, size, "target (the independent coordinates, then their rates)")
    cost_N, cost_x, cost_f = weights_of(final, size, "final"), weights_of(running, size, "running") * h, weights_of(effort, a, "effort") * h
    if not (np.isfinite(guess).all() and np.isfinite(goal).all()):
        raise ArgumentError("forces or target have values that are not finite")
    for name, cost in (("final", cost_N), ("running", cost_x)):
        not_negative(cost, name)
    if iterations < 1 or not tolerance > 0:
        raise ArgumentError(f"at least one iteration and a positive tolerance are required, not {iterations} and {tolerance}")
    most = force_limits(limits, a)
    if np.linalg.eigvalsh(cost_f).min() <= 0:
        raise ArgumentError("effort must be positive: forces without a cost have no least one")
    guess = np.clip(guess, -most, most)
    N = len(guess)

    def roll(applied: Any, fine: int = 1) -> tuple[Any, Array, float] | None:
        """States, forces and the cost; None where a step fails."""
        states: list[Any] = [problem.start]
        total: Any = 0.0
        used = np.empty((N, a))
        for k in range(N):
            x = problem.x(*states[-1])
            used[k] = applied(k, x)
            e = x - goal
            total += 0.5 * (e @ cost_x @ e + used[k] @ cost_f @ used[k])
            try:
                after = problem.step(k, states[-1][0], states[-1][1], used[k], False, fine)
            except FailedError:
                return None
            states.append((after.q, after.qd))
        e = problem.x(*states[-1]) - goal
        total += 0.5 * e @ cost_N @ e
        return (states, used, total) if np.isfinite(total) else None

    found = roll(lambda k, x: guess[k])
    if found is None:
        raise FailedError("the mechanism cannot follow the first guess of the forces: begin with smaller ones, or with shorter steps")
    costs, damping, gains, reason, converged = [found[2]], 0.0, np.zeros((N, a, size)), "", False
    for _ in range(iterations):
        states, used, total = found
        slopes = [problem.step(k, states[k][0], states[k][1], used[k], True) for k in range(N)]
        moved = False
        while not moved and not converged:
            # Backwards: the quadratic model of the cost-to-go, and the change of the forces.
            V_x, V_xx, change, gain = cost_N @ (problem.x(*states[N]) - goal), cost_N, np.zeros((N, a)), np.zeros((N, a, size))
            expected, solvable = 0.0, True
            for k in reversed(range(N)):
                A, B = slopes[k].x_x, slopes[k].x_Q[:, problem.act]
                Q_x = cost_x @ (problem.x(*states[k]) - goal) + A.T @ V_x
                Q_f = cost_f @ used[k] + B.T @ V_x
                Q_ff = cost_f + B.T @ V_xx @ B
                Q_fx = B.T @ V_xx @ A
                firm = Q_ff + damping * np.trace(Q_ff) / a * np.eye(a)
                if np.linalg.eigvalsh(firm).min() <= 0:
                    solvable = False
                    break
                change[k], free = _bounded(firm, Q_f, -most - used[k], most - used[k])
                if free.any():
                    gain[k][free] = -np.linalg.solve(firm[np.ix_(free, free)], Q_fx[free])
                expected -= change[k] @ Q_f + 0.5 * change[k] @ Q_ff @ change[k]
                V_x = Q_x + gain[k].T @ Q_ff @ change[k] + gain[k].T @ Q_f + Q_fx.T @ change[k]
                V_xx = cost_x + A.T @ V_xx @ A + gain[k].T @ Q_ff @ gain[k] + gain[k].T @ Q_fx + Q_fx.T @ gain[k]
                V_xx = 0.5 * (V_xx + V_xx.T)
            if solvable and expected <= tolerance * max(abs(total), 1e-300):
                gains, converged, reason = gain, True, f"an iteration gains less than {tolerance:g} of the cost"
                break
            for halving in range(_SHORTEST if solvable else 0):
                part = 0.5**halving
                tried = roll(
                    lambda k, x, part=part: np.clip(used[k] + part * change[k] + gain[k] @ (x - problem.x(*states[k])), -most, most)
                )
                if tried is not None and total - tried[2] > _LEAST_GAIN * part * (2 - part) * expected:
                    found, gains, moved = tried, gain, True
                    break
            damping = damping / _FACTOR if moved and damping > _FIRST else 0.0 if moved else max(_FACTOR * damping, _FIRST)
            if damping > _LARGEST:
                break
        if converged:
            break
        if not moved:
            reason = "no change of the forces lowers the cost"
            break
        costs.append(found[2])
        if total - found[2] <= tolerance * abs(found[2]):
            converged, reason = True, f"an iteration gains less than {tolerance:g} of the cost"
            break
    else:
        reason = f"{iterations} iterations have not converged"
    states, used, total = found
    fine = roll(lambda k, x: used[k], fine=2)
    error = max(abs(a[0] - b[0]).max() for a, b in zip(states, fine[0])) if fine else np.inf
    moves = max(abs(state[0] - problem.start[0]).max() for state in states)
    if not converged:
        warnings.warn(f"the plan is not optimal: {reason}", KempeWarning, stacklevel=2)
    if error > 1e-3 * max(moves, 1e-300):
        warnings.warn(f"the steps are too long: with half of them a coordinate changes by {error:.2g}; use more substeps", KempeWarning, stacklevel=2)
    times: Any = h * np.arange(N + 1)
    q_all, qd_all = (np.array([state[i] for state in states]) for i in range(2))
    return Plan(times, q_all, qd_all, used, gains, total, tuple(costs), converged, reason, float(error))
