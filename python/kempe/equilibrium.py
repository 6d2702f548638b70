# SPDX-License-Identifier: BSD-3-Clause
"""Static and steady-state equilibria."""

from __future__ import annotations

from ._native import lib
from .context import string
from .result import Reported, TableOf


class Equilibrium(Reported):
    """Equilibria and their stability; the first is the one found from the start, if there is one."""

    _noun = "equilibrium"
    _kept_each = ("stability", "is_stable", "loads_not_unique")
    equilibria: TableOf = TableOf(
        "A row each: stability, residual, potential (J), hits, unknowns, q.NAME, qd.NAME, lambda.CLOSURE.k, outputs of the model."
    )
    history: TableOf = TableOf("The searches: equilibrium, iteration, residual, step.")
    reactions: TableOf = TableOf(
        "equilibrium, and what each joint, loop and drive carries there: force (N) and moment (N m), with components on the"
        " second body in ground axes. unique: 0 where redundant constraints share it."
    )

    def __len__(self) -> int:
        return int(lib.kempe_equilibrium_count(self._pointer))

    def stability(self, k: int = 0) -> str:
        """ "stable", "neutral", "unstable", "not held" by friction, or "undecided"."""
        return string(lib.kempe_equilibrium_stability(self._pointer, k))

    def is_stable(self, k: int = 0) -> bool | None:
        """No small motion about it grows; None: undecided."""
        judged = int(lib.kempe_equilibrium_is_stable(self._pointer, k))
        return None if judged < 0 else bool(judged)

    def loads_not_unique(self, k: int = 0) -> str:
        """Loads of joints and loops that redundant constraints share, as "A: x, y, mz"; "": none."""
        return string(lib.kempe_equilibrium_loads_not_unique(self._pointer, k))
