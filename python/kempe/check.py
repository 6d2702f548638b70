# SPDX-License-Identifier: BSD-3-Clause
"""Diagnosis of a mechanism, its assembled state, its assembly modes."""

from __future__ import annotations

from ._native import lib
from .arrays import Array, view
from .display import check_html
from .result import Reported, Result, TableOf


class Check(Result):
    """Mobility, redundant rows with their closures, independent coordinates, limits of motion."""

    _noun = "check"
    mobility: TableOf = TableOf(
        "One row: bodies, coordinates, closures, rows, rank, dof, driven, generic_dof, cond_Jv, max_B, margin."
    )
    coordinates: TableOf = TableOf(
        "A row for each coordinate: role, instead_of, max_B, low, high, turns, dead centres (rad or m)."
    )
    closures: TableOf = TableOf("A row for each closure: kind, rows, redundant, may_lose, gap (m), turn (rad).")

    @property
    def dof(self) -> int:
        """Degrees of freedom at the assembled state."""
        return int(self.mobility["dof"][0])

    @property
    def redundant(self) -> dict[str, int]:
        """Closures with redundant rows, and how many.

        >>> kempe.Model("four_bar.yaml").system().check().redundant
        {}
        """
        rows = zip(self.closures["closure"], self.closures["redundant"])
        return {str(closure): int(count) for closure, count in rows if count > 0}

    @property
    def independent(self) -> list[str]:
        """Names of the independent coordinates.

        >>> kempe.Model("four_bar.yaml").system().check().independent
        ['coupler']
        """
        rows = zip(self.coordinates["coordinate"], self.coordinates["role"])
        return [str(coordinate) for coordinate, role in rows if role == "independent"]

    def _shown(self) -> str:
        return check_html(self)

    def __repr__(self) -> str:
        return f"<Check: {self.dof} degrees of freedom, {sum(self.redundant.values())} redundant rows>"


class Assembly(Reported):
    """The state in which the loops are closed, from the model's guess."""

    _noun = "assembly"
    _kept = ("q", "qd")

    @property
    def q(self) -> Array:
        """Coordinates (n; rad or m)."""
        return view(lib.kempe_assembly_q(self._pointer), (len(self._context.coordinates),), self._pointer)

    @property
    def qd(self) -> Array:
        """Rates (n; rad/s or m/s)."""
        return view(lib.kempe_assembly_qd(self._pointer), (len(self._context.coordinates),), self._pointer)


class Branches(Result):
    """Configurations in which the loops close with the held coordinates fixed; the first is the model's."""

    _noun = "branches"
    _kept_each = ("__getitem__",)

    def __len__(self) -> int:
        return int(lib.kempe_branches_count(self._pointer))

    def __getitem__(self, k: int) -> Array:
        """Coordinates of one configuration (n; rad or m).

        Raises IndexError if there is no such configuration."""
        if not -len(self) <= k < len(self):
            raise IndexError(f"there are {len(self)} assembly modes")
        return view(
            lib.kempe_branches_q(self._pointer, k % len(self)), (len(self._context.coordinates),), self._pointer
        )
