# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of formulations, integrators and tolerances."""

from __future__ import annotations

from .display import comparison_html
from .result import Reported, TableOf


class Comparison(Reported):
    """Errors, residuals, work and times of many runs against a reference."""

    _noun = "comparison"
    _options = "kempe_compare_options"
    runs: TableOf = TableOf("A row for each run: method, rtol, status, errors, residuals, energy, work, times, memory.")
    levels: TableOf = TableOf("The methods at equal error: rtol, cpu_s, ratio to the fastest, steps, evaluations.")

    def _shown(self) -> str:
        return comparison_html(self)
