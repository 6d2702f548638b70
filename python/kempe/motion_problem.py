# SPDX-License-Identifier: BSD-3-Clause
"""The common part of optimal motions: actuators, weights, limits of forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from .arrays import Array, numbers, of_class
from .errors import ArgumentError
from .lazy import np
from .options import text_of, unknown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from .workspace import Workspace


class Plan(NamedTuple):
    """An optimal motion: N + 1 states at the times t and N forces, each constant for a step. `gains` (N, a, 2 p) belong to
    the feedback law force = forces[k] + gains[k] (x - x[k]) of the independent coordinates and their rates x = (u, ud). `error` is the
    largest change of a coordinate when the steps are halved."""

    t: Array  # N + 1, s
    q: Array  # N + 1, n
    qd: Array
    forces: Array  # N, a: N or N m
    gains: Array
    cost: float
    costs: tuple[float, ...]  # after each iteration
    converged: bool
    reason: str  # why it ended
    error: float


def weights_of(value: ArrayLike, size: int, name: str) -> Array:
    """A symmetric matrix from a number, a diagonal or a matrix."""
    array: Array = numbers(value, name).reshape(tuple(np.shape(value)))
    if not np.isfinite(array).all():
        raise ArgumentError(f"{name} has values that are not finite")
    if array.ndim == 2 and array.shape == (size, size):
        return 0.5 * (array + array.T)
    if array.ndim == 0 or array.shape == (size,):
        return np.diag(np.broadcast_to(array, size))
    raise ArgumentError(f"{name} is a number, {size} numbers or a {size} x {size} matrix, not of the shape {array.shape}")


def not_negative(weights: Array, name: str) -> Array:
    if np.linalg.eigvalsh(weights).min(initial=0) < -1e-12 * abs(weights).max(initial=0):
        raise ArgumentError(f"{name} must not be negative: the cost would have no least value")
    return weights


def force_limits(limits: ArrayLike | None, a: int) -> Array:
    """The largest sizes of forces."""
    if limits is not None and np.shape(limits) not in ((), (a,)):
        raise ArgumentError(f"limits is a number or {a} numbers, not of the shape {np.shape(limits)}")
    most = np.full(a, np.inf) if limits is None else np.broadcast_to(np.asarray(limits, dtype=np.float64), a)
    if not (most > 0).all():
        raise ArgumentError("limits are positive: the largest size of each force")
    return most


class MotionProblem:
    """A mechanism at the start, and the actuators on it."""

    def __init__(self, workspace: Workspace, q: Any, qd: Any, actuators: Any) -> None:
        from .workspace import Workspace

        of_class(workspace, Workspace, "workspace", "model.system().workspace()")
        names = text_of(actuators).replace(" ", "").split(",") if actuators else []
        coordinates = workspace._context.coordinates
        for name in names:
            if name not in coordinates:
                raise ArgumentError(unknown("coordinate", name, coordinates))
        if not names or len(set(names)) < len(names):
            raise ArgumentError("actuators names the coordinates on which forces act, each of them once")
        self.workspace, self.n, self.names = workspace, workspace.n, names
        self.act = [coordinates.index(name) for name in names]
        self.u = [coordinates.index(name) for name in workspace.independent]
        self.start = workspace.close(0.0, q, qd)

    def x(self, q: Array, qd: Array) -> Array:
        return np.concatenate((q[self.u], qd[self.u]))
