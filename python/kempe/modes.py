# SPDX-License-Identifier: BSD-3-Clause
"""Eigenvalues and mode shapes; limit cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._native import lib
from .display import modes_html
from .lazy import np
from .result import Drawn, Reported, TableOf

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Modes(Reported, Drawn):
    """Modes about a state, and their change with a parameter."""

    _noun = "modes"
    _kept = ("zero_count", "is_unstable")
    modes: TableOf = TableOf(
        "A row for each eigenvalue: re, im (1/s), frequency (Hz), damping, decay (s), re.NAME, im.NAME; "
        "with sampled states z.re and z.im, too."
    )
    rows: TableOf = TableOf("Of a sweep: NAME, re.1, im.1, ..; otherwise the modes.")
    critical: TableOf = TableOf("Values of a sweep at which a mode becomes unstable or stable.")
    state: TableOf = TableOf("One row: q.NAME and qd.NAME.")

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues, 1/s, in the order of the table "modes".

        >>> modes = kempe.Model("quarter_car.yaml").system().modes()
        >>> modes.eigenvalues.dtype, bool((modes.eigenvalues.real < 0).all())
        (dtype('complex128'), True)
        """
        made: NDArray[Any] = self.modes["re"] + 1j * self.modes["im"]
        return made

    @property
    def z(self) -> NDArray[np.complex128]:
        """With sampled states: eigenvalues from one sample to the next; `eigenvalues` are ln(z)/T. Otherwise empty."""
        if "z.re" not in list(self.modes):
            return np.zeros(0, complex)
        made: NDArray[Any] = self.modes["z.re"] + 1j * self.modes["z.im"]
        return made

    @property
    def zero_count(self) -> int:
        """The number of eigenvalues that are exactly zero."""
        return int(lib.kempe_modes_zero_count(self._pointer))

    @property
    def is_unstable(self) -> bool:
        """A mode grows by more than rounding explains."""
        return bool(lib.kempe_modes_is_unstable(self._pointer))

    def _shown(self) -> str:
        return modes_html(self) + self._picture()


class LimitCycles(Reported, Drawn):
    """Limit cycles over a parameter: branches, folds, Hopf points, stability."""

    _noun = "limit_cycles"
    _kept = ("branch_count",)
    rows: TableOf = TableOf(
        "A row for each cycle: branch, the parameter, period (s), point, stability, multiplier, along, residual, "
        "OUTPUT.amplitude, OUTPUT.max and OUTPUT.min."
    )
    multipliers: TableOf = TableOf("A row for each multiplier of each cycle: cycle, re, im.")
    states: TableOf = TableOf("A state of each cycle: the parameter, period (s), q.NAME, qd.NAME, state.NAME.")
    equilibria: TableOf = TableOf("At each value of the sweep: the parameter, growth (1/s).")
    critical: TableOf = TableOf("Hopf points: the parameter, frequency (Hz), branch.")

    @property
    def branch_count(self) -> int:
        """The number of branches."""
        return int(lib.kempe_limit_cycles_branch_count(self._pointer))

    def count(self, branch: int = 0) -> int:
        """The number of cycles on a branch."""
        return int(lib.kempe_limit_cycles_count(self._pointer, branch))
