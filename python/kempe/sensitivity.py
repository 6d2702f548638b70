# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of results by parameters."""

from __future__ import annotations

from ._native import lib
from .context import string
from .options import members_of
from .result import Result, TableOf


class Sensitivity(Result):
    """Exact derivatives of a trajectory or of a state by parameters of the model."""

    _noun = "sensitivity"
    _kept = ("method", "work")
    rows: TableOf = TableOf(
        "t or row; each quantity, q.rocker, and its derivatives by the parameters, q.rocker/PARAMETER."
    )
    parameters: TableOf = TableOf("parameter, value (SI).")

    @property
    def method(self) -> str:
        """ "forward" or "adjoint"; "" where there is no choice."""
        return string(lib.kempe_sensitivity_method(self._pointer))

    @property
    def work(self) -> dict[str, int]:
        """Work of the integrator: steps, rejected, refused, rhs, exchanges."""
        return members_of(lib.kempe_sensitivity_work(self._pointer))
