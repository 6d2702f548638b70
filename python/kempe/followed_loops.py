# SPDX-License-Identifier: BSD-3-Clause
"""Dependent coordinates of many states at once, within an assembly mode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .arrays import Array
from .errors import FailedError
from .lazy import np

if TYPE_CHECKING:
    from .workspace import Workspace

_PIECES = (1, 4, 16, 64)  # parts of a change of the independent coordinates, until the loops follow it
_CURVED = 0.2  # of a predicted change of coordinates: the largest first correction of a part
_CLOSED, _CORRECTIONS = 1e-11, 8  # the largest last correction of a coordinate, and the number of corrections


class FollowedLoops:
    """The loops of many states, followed from closed ones in their assembly mode. It is the mode of the coordinates q."""

    def __init__(self, workspace: Workspace, q: Array, t: Array) -> None:
        self.workspace, self.rows = workspace, workspace.closure_rows
        self.u = [workspace._context.coordinates.index(name) for name in workspace.independent]
        self.v = [i for i in range(workspace.n) if i not in self.u]
        h, J = self._closures(t, np.tile(q, (len(t), 1)))
        self.moving = bool(abs(h - h[0]).max(initial=0) > 1e-12)  # closures depend on time
        self.sign = self._signs(J[:1])[0]
        self.first = self.workspace.determinants(t[:1], q[None], curvature=False).logarithm[0]

    def _closures(self, t: Array, q: Array) -> tuple[Array, Array]:
        found = self.workspace.evaluate_states(t, q)
        return found.h[:, self.rows], found.J[:, self.rows]

    def _signs(self, J: Array) -> Array:
        """Signs of the determinant of the dependent columns. Modes meet at its zeros. With redundant rows the sign is unknown."""
        J_v = J[:, :, self.v]
        signs: Array = np.linalg.slogdet(J_v)[0] if J_v.shape[1] == J_v.shape[2] else np.ones(len(J))
        return signs

    def _dependent(self, J: Array, right: Array) -> Array:
        """The changes of the dependent coordinates that have the given effect on the closures; redundant rows agree."""
        J_v: Any = J[:, :, self.v]
        if J_v.shape[1] != J_v.shape[2]:
            right = np.einsum("krv,kr->kv", J_v, right)
            J_v = J_v.transpose(0, 2, 1) @ J_v
        try:
            made: Any = np.linalg.solve(J_v, right[:, :, None])[:, :, 0]
            return np.asarray(made, dtype=np.float64)
        except np.linalg.LinAlgError as error:
            raise FailedError("the independent coordinates do not describe the motion") from error

    def positions(self, t: Array, q: Array, u: Array, since: Array | None = None) -> Array:
        """Closed coordinates with the independent ones u, from the closed ones q of the times `since` (None: t)."""
        made, left = np.array(q), np.arange(len(q))
        for pieces in _PIECES:
            late, begin = (t if since is None else since)[left], q[left]
            good, now, part = np.ones(len(left), dtype=bool), begin.copy(), (u[left] - begin[:, self.u]) / pieces
            for i in range(pieces):
                times = late + (i + 1) / pieces * (t[left] - late)
                h, J = self._closures(times, now)
                step = self._dependent(J, -h - np.einsum("kri,ki->kr", J[:, :, self.u], part))
                now[:, self.u] = begin[:, self.u] + (i + 1) * part
                now[:, self.v] += step
                first = None
                for _ in range(_CORRECTIONS):
                    h, J = self._closures(times, now)
                    correction = self._dependent(J, -h)
                    now[:, self.v] += correction
                    size = abs(correction).max(axis=1, initial=0)
                    first = size if first is None else first
                    if size.max() < _CLOSED:
                        break
                change = abs(np.hstack((step, part))).max(axis=1)
                good &= (size < _CLOSED) & (first <= _CURVED * change + 1e-5) & (self._signs(J) == self.sign)
                now[~good] = begin[~good]
            made[left[good]] = now[good]
            left = left[~good]
            if not len(left):
                return made
        raise FailedError("the loops cannot be closed in the assembly mode of the start")

    def path(self, t: Array, q: Array, u: Array) -> Array:
        """Closed coordinates of a motion through u from the closed coordinates q, each from those before."""
        made = [self.positions(t[:1], q[None], u[:1])]
        for k in range(1, len(u)):
            made.append(self.positions(t[k : k + 1], made[-1], u[k : k + 1], t[k - 1 : k]))
        return np.concatenate(made)

    def rates(self, t: Array, q: Array, ud: Array) -> Array:
        """Rates of all coordinates from the independent ones."""
        J, made = self._closures(t, q)[1], np.empty_like(q)
        made[:, self.u] = ud
        effect = -np.einsum("kri,ki->kr", J[:, :, self.u], ud)
        if self.moving:
            own = np.array([self.workspace.close(*each)[1] for each in zip(t, q, np.zeros_like(q))])
            effect += np.einsum("kri,ki->kr", J, own)
        made[:, self.v] = self._dependent(J, effect)
        return made

    def apart(self, t: Array, q: Array) -> tuple[Array, Array]:
        """The squared determinant, over its value at the first coordinates, and its derivative by u. It is zero in singular positions."""
        found = self.workspace.determinants(t, q, curvature=False)
        square = np.exp(2 * (found.logarithm - self.first))
        return square, 2 * square[:, None] * found.by_u

    def apart_curvature(self, t: Array, q: Array) -> Array:
        """Its second derivatives by u."""
        found = self.workspace.determinants(t, q)
        square = np.exp(2 * (found.logarithm - self.first))
        bent: Array = 2 * square[:, None, None] * (found.by_uu + 2 * found.by_u[:, :, None] * found.by_u[:, None, :])
        return bent
