# SPDX-License-Identifier: BSD-3-Clause
"""Ride comfort."""

from __future__ import annotations

from ._native import lib
from .result import Result, TableOf


class Comfort(Result):
    """Weighted accelerations of a run (EN 12299, ISO 2631-1), and Sperling's ride index."""

    _noun = "comfort"
    _kept = ("mean_comfort",)
    signals: TableOf = TableOf(
        "A row for each acceleration: direction, name, weighting, rms, weighted, median, percentile_95 and largest "
        "(m/s^2), Wz, difference (relative, with every other sample)."
    )
    windows: TableOf = TableOf("t (s) at the end of each window of 5 s, and the weighted root mean squares.")

    @property
    def mean_comfort(self) -> tuple[float, ...]:
        """N_MV of each place that has all three directions."""
        count = lib.kempe_comfort_place_count(self._pointer)
        return tuple(float(lib.kempe_comfort_mean_comfort(self._pointer, k)) for k in range(count))
