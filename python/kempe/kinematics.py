# SPDX-License-Identifier: BSD-3-Clause
"""Position analysis over a range."""

from __future__ import annotations

from .result import Drawn, Judged, Reported, TableOf


class Kinematics(Judged, Reported, Drawn):
    """Positions, velocities and accelerations over a range of coordinates or time."""

    _noun = "kinematics"
    rows: TableOf = TableOf("s (0 to 1), t, q.NAME, qd.NAME, qdd.NAME, outputs of the model.")
    dead_centres: TableOf = TableOf(
        "Limits of the driven coordinates: s, coordinate, value, extreme, determined, margin, instead, q.NAME."
    )
    change_points: TableOf = TableOf("Change points that were crossed: s, value, margin, q.NAME.")

    def _shown(self) -> str:
        return self._picture() or self.rows._curves()
