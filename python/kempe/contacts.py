# SPDX-License-Identifier: BSD-3-Clause
"""Wheels on their rails over a range."""

from __future__ import annotations

from typing import Any

from ._native import ffi, lib
from .options import members_of
from .result import Drawn, Judged, TableOf


class Contacts(Judged, Drawn):
    """Contact points, normal forces, creepages and creep forces of each wheel."""

    _noun = "contacts"
    _options = "kempe_contact_options"
    rows: TableOf = TableOf("A row for each value, wheel and zone: the numbers of its patch.")
    outline: TableOf = TableOf("A row for each strip of a patch: its lobe, lateral place, ends and largest pressure; empty without `pressure`.")
    states: TableOf = TableOf("A row for each value: q and qd.")

    conicity: TableOf = TableOf("A row for each amplitude: the equivalent conicity, its error, the wavelength and the ends of the motion.")
    radii: TableOf = TableOf("A row for each value: lateral place, difference of the rolling radii, both empty without conicity.")

    @property
    def nonlinearity(self) -> float:
        """Nonlinearity parameter of the equivalent conicity, 1/m."""
        return float(lib.kempe_contacts_nonlinearity(self._pointer))

    def zone_count(self, wheel: int) -> int:
        """Zones of a wheel."""
        return int(lib.kempe_contacts_zone_count(self._pointer, wheel))

    def patch(self, k: int, wheel: int, zone: int) -> dict[str, Any]:
        """The contact patch of a zone at the k-th value, in SI.

        Raises IndexError if there is no such value, wheel or zone."""
        found = lib.kempe_contacts_patch(self._pointer, k, wheel, zone)
        if found == ffi.NULL:
            raise IndexError(f"there is no patch ({k}, {wheel}, {zone})")
        return members_of(found[0])
