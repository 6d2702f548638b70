# SPDX-License-Identifier: BSD-3-Clause
"""Many instances of one mechanism with different parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._native import lib
from .arrays import Array, view
from .context import Fixed, Owned, string
from .lazy import np
from .options import options as struct_of
from .result import Reported, TableOf

if TYPE_CHECKING:
    from typing import Unpack

    from ._options import RunOptions


class Values(Fixed):
    """Values of parameters and starts: a row for each instance."""

    _noun = "values"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns: parameters, q.NAME, qd.NAME."""
        count = lib.kempe_values_column_count(self._pointer)
        return tuple(string(lib.kempe_values_name(self._pointer, k)) for k in range(count))

    def __len__(self) -> int:
        return int(lib.kempe_values_count(self._pointer))

    def __getitem__(self, k: int) -> Array:
        """One row, in SI."""
        if not -len(self) <= k < len(self):
            raise IndexError(f"there are {len(self)} rows")
        return view(lib.kempe_values_row(self._pointer, k % len(self)), (len(self.names),), self._pointer)


class Batch(Reported):
    """Results of all instances."""

    _noun = "batch"
    _kept = ("status", "reason", "q", "qd")
    instances: TableOf = TableOf(
        "A row for each instance: values, status, t, q.NAME, qd.NAME, work, accuracy, verdict, reason."
    )

    def __len__(self) -> int:
        return int(lib.kempe_batch_count(self._pointer))

    @property
    def status(self) -> list[str]:
        """Status of each instance: "ok", "stopped", "failed"."""
        return [string(lib.kempe_batch_status(self._pointer, k)) for k in range(len(self))]

    @property
    def reason(self) -> list[str]:
        """Reason of each instance, "" when ok."""
        return [string(lib.kempe_batch_reason(self._pointer, k)) for k in range(len(self))]

    @property
    def q(self) -> Array:
        """Final coordinates (instances x n); NaN where there is no state."""
        return self._states(lib.kempe_batch_q)

    @property
    def qd(self) -> Array:
        """Final rates (instances x n)."""
        return self._states(lib.kempe_batch_qd)

    def _states(self, get: object) -> Array:
        n = len(self._context.coordinates)
        return np.array([view(get(self._pointer, k), (n,), None) for k in range(len(self))]).reshape(len(self), n)  # type: ignore[operator]


class Ensemble(Owned):
    """The equations of a model with the columns of a table of values kept symbolic."""

    _noun = "ensemble"

    def run(self, lanes: int = 0, **options: Unpack[RunOptions]) -> Batch:
        """Runs every instance to t_end. `lanes`: instances at a time, 0 the best for this machine, -1 a separate run for each.

        >>> import numpy
        >>> ensemble = kempe.Model("four_bar.yaml").ensemble({"crank": numpy.linspace(0.28, 0.32, 9)})
        >>> batch = ensemble.run(t_end=0.5)
        >>> len(batch), batch.q.shape, set(batch.status)
        (9, (9, 3), {'ok'})
        """
        values: dict[str, Any] = dict(options)
        progress = values.pop("progress", None)
        given, keep = struct_of("run", "kempe_run_options", values)
        with self._context.reporting(progress):
            made = self._context.make(
                Batch, lib.guarded_kempe_ensemble_run, self._pointer, given, lanes, owners=(self._pointer,)
            )
        del keep
        return made
