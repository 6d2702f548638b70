# SPDX-License-Identifier: BSD-3-Clause
"""Results of simulations."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from ._native import lib
from .arrays import Array, numbers, view, writable
from .display import trajectory_html
from .errors import ArgumentError, Error
from .lazy import np
from .options import path_of, text_of, utf8
from .result import Judged, Reported, TableOf
from .stepper import State
from .table import Table, column_name

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


class Trajectory(Judged, Reported):
    """Rows of a run. Arrays are read-only views of its memory, and keep it alive.

    `run["position(coupler.C).x"]` is any output of the model language over time, whether or not the model requests it; an output
    with several components has a column for each."""

    _noun = "trajectory"
    _options = "kempe_run_options"
    _maker = "guarded_kempe_simulate"
    _kept = ("q", "qd", "qdd", "lam", "names", "closure_rows")
    rows: TableOf = TableOf("t and the outputs that the model requests.")
    log: TableOf = TableOf("Events between steps: t, kind, text, before, after.")
    reactions: TableOf = TableOf(
        "What each joint, loop and drive carries: the largest force (N) and moment (N m) of the rows, their times, and the"
        " components then, on the second body in ground axes. unique: 0 where redundant constraints share it. With"
        " reaction_peaks=\"motion\" they are the largest of the whole motion."
    )
    bearings: TableOf = TableOf(
        "What the bearings of the model carry: the largest radial and axial forces (N) of the motion, their times, and the"
        " equivalent loads; two rows for each pair."
    )

    def __len__(self) -> int:
        return int(lib.kempe_trajectory_row_count(self._pointer))

    def write_report(self, path: str | os.PathLike[str], against: Table | None = None) -> None:
        """Writes the page as one file of HTML. `against`: a table of an earlier run, `run.rows` or `Table.read`, whose
        dotted curves are behind the curves of this one.

        Warns where only a part of the times is in both runs. Raises FileError if the file cannot be written. Raises ArgumentError if the run
        was read from it. Raises InputError if `against` has no column t, no column of an output of this run, or no time of this run. Raises
        TypeError if it is not a table."""
        if against is None:
            return super().write_report(path)
        if not isinstance(against, Table):
            raise TypeError(f"against: a Table is needed, not {type(against).__name__}")
        status, message = self._context.guarded(
            lib.guarded_kempe_trajectory_write_report_against, self._pointer, against._pointer, path_of(path)
        )
        return self._context.refuse(status, message)

    def write_animation(self, path: str | os.PathLike[str]) -> None:
        """Writes the moving mechanism: `.glb`, a binary file of glTF 2.0 for Blender and other programs, m, y up; `.json`, the data of the picture.

        Raises ArgumentError if the path ends otherwise, if it ends with `.glb` and the model has flexible bodies, or if the run was read from
        the file. Raises FailedError if the run has no rows. Raises FileError if the file cannot be written."""
        self._context.check(lib.kempe_trajectory_write_animation, self._pointer, path_of(path))

    @property
    def t(self) -> NDArray[np.float64]:
        """Times of the rows, s."""
        return self.rows["t"]

    @property
    def q(self) -> Array:
        """Coordinates (rows x n; rad or m)."""
        return self._rows("q", len(self._context.coordinates))

    @property
    def qd(self) -> Array:
        """Rates (rows x n; rad/s or m/s)."""
        return self._rows("qd", len(self._context.coordinates))

    @property
    def qdd(self) -> Array:
        """Accelerations (rows x n; rad/s^2 or m/s^2)."""
        return self._rows("qdd", len(self._context.coordinates))

    @property
    def lam(self) -> Array:
        """Lagrange multipliers (rows x m)."""
        return self._rows("lambda", len(self._context.rows))

    def _rows(self, name: str, width: int) -> Array:
        return view(self._call(name)(self._pointer, 0), (len(self), width), self._pointer)

    def at(self, t: ArrayLike) -> State:
        """The state at any time (s) of a run with `keep_dense=True`, as a row that the run had there; of several times,
        arrays with a row for each.

        Raises ArgumentError if the run has no dense output or does not contain the time. Raises FailedError if the run could not have
        written that row. Raises TypeError if t is not a number."""
        times = numbers(t, "t").reshape(np.shape(t))
        n, m = len(self._context.coordinates), len(self._context.rows)
        parts = [np.empty((times.size, width)) for width in (n, n, n, m)]
        for k, time in enumerate(times.flat):
            into = (writable(part[k], (part.shape[1],), "state") for part in parts)
            self._context.check(lib.kempe_trajectory_at_time, self._pointer, time, *into)
        q, qd, qdd, lam = (part.reshape(times.shape + part.shape[1:]) for part in parts)
        shown: Any = times[()]  # a number, or the array
        return State(shown, q, qd, qdd, lam)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates, the columns of q, qd and qdd."""
        return self._context.coordinates

    @property
    def closure_rows(self) -> tuple[str, ...]:
        """Names of the closure rows, the columns of lam."""
        return self._context.rows

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns of `rows`."""
        return self.rows.units

    def outputs(self, names: Any) -> Table:
        """A table of t and of outputs: "q(A),force(spring)" or a list of such words.

        Raises ArgumentError if a word is missing or wrong. Raises TypeError if the words have another type.

        >>> run = kempe.Model("four_bar.yaml").simulate(t_end=1)
        >>> run.outputs("velocity(coupler.C)").names
        ('t', 'velocity.coupler.C.x', 'velocity.coupler.C.y', 'velocity.coupler.C.z')
        """
        words = utf8(text_of(names))
        if not words.strip():
            raise ArgumentError("no output is named: give words as 'q(A), force(spring)'")
        return self._context.make(Table, lib.kempe_trajectory_outputs, self._pointer, words, long=False)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """An output over time.

        Raises ArgumentError if there is no such output. Raises TypeError if the name is not a text."""
        if name in self.rows.units or column_name(name) in self.rows.units:
            return self.rows[name]
        table = self.outputs(name)
        if len(table) == 2:
            return table[table.names[1]]
        return np.stack([table[each] for each in table.names[1:]], axis=1)

    def __contains__(self, name: object) -> bool:
        """True for the name of an output of the model.

        >>> run = kempe.Model("four_bar.yaml").simulate(t_end=1)
        >>> "position(coupler.C)" in run, "position(coupler.Z)" in run
        (True, False)
        """
        try:
            return isinstance(name, str) and len(self[name]) >= 0
        except (KeyError, Error):
            return False

    @property
    def verdict(self) -> dict[str, Any]:
        """Residuals, energy balance, convergence and work of the run.

        >>> run = kempe.Model("four_bar.yaml").simulate(t_end=1)
        >>> run.verdict["energy"]["drift_rel"] < 1e-8
        True
        """
        found = self.to_dict()
        return {
            name: found[name]
            for name in ("status", "reason", "residual", "energy", "error", "convergence", "work")
            if name in found
        }

    def to_pandas(self) -> Any:
        """The table `rows` as a pandas.DataFrame over t.

        Raises ImportError if pandas is not installed.

        >>> kempe.Model("four_bar.yaml").simulate(t_end=1).to_pandas().index.name  # with pandas
        't'
        """
        return self.rows.to_pandas("t")

    def to_xarray(self) -> Any:
        """The table `rows` as an xarray.Dataset over t.

        Raises ImportError if xarray is not installed."""
        return self.rows.to_xarray("t")

    def _shown(self) -> str:
        return trajectory_html(self) + self.rows._curves()

    def __repr__(self) -> str:
        end = self.t[-1] if len(self) else 0.0
        return f"<Trajectory: {self.status}, {len(self)} rows to t = {end:g} s>"
