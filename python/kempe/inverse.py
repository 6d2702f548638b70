# SPDX-License-Identifier: BSD-3-Clause
"""Inverse dynamics with the loops closed."""

from __future__ import annotations

from ._native import lib
from .context import string
from .result import Judged, Reported, TableOf


class Inverse(Judged, Reported):
    """Actuator forces and torques of a prescribed motion."""

    _noun = "inverse"
    _kept = ("dof", "rank", "residual", "loads_not_unique")
    rows: TableOf = TableOf(
        "t, tau.NAME (N m or N), power.NAME (W), q.NAME, qd.NAME, qdd.NAME, lambda.CLOSURE.k, reactions."
    )
    reactions: TableOf = TableOf(
        "What each joint and loop carries: the largest force (N) and moment (N m) of the rows, their times, and the"
        " components then, on the second body in ground axes. unique: 0 where redundant constraints share it."
    )

    @property
    def dof(self) -> int:
        """Degrees of freedom to be actuated, at the worst row."""
        return int(lib.kempe_inverse_dof(self._pointer))

    @property
    def rank(self) -> int:
        """Rank of the actuators on them, at the worst row."""
        return int(lib.kempe_inverse_rank(self._pointer))

    @property
    def residual(self) -> float:
        """Largest |M qdd + C - J' lambda - S tau|, relative to the size of its terms."""
        return float(lib.kempe_inverse_residual(self._pointer))

    @property
    def loads_not_unique(self) -> str:
        """Loads of joints and loops that redundant constraints share, as "A: x, y, mz"; "": none."""
        return string(lib.kempe_inverse_loads_not_unique(self._pointer))
