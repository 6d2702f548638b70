# SPDX-License-Identifier: BSD-3-Clause
"""Many instances of one mechanism with different parameters."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from ._native import ffi, lib
from .arrays import Array, by_name, numbers, view
from .context import Context, Fixed, outcome, string
from .errors import ArgumentError, FailedError, InputError
from .executors import once, run_shards
from .lazy import np
from .options import options as struct_of
from .options import path_of, utf8
from .result import Reported, Result, TableOf
from .table import Table

if TYPE_CHECKING:
    from typing import Unpack

    from numpy.typing import ArrayLike

    from ._options import RunOptions
    from .executors import Executor
    from .model import Model

Recipe = tuple[Callable[..., Any], tuple[Any, ...]]  # for pickles: what makes an equal object


def rows_of(columns: Mapping[str, Any]) -> Array:
    """Columns of one length, or single values for all rows, as rows."""
    arrays = {name: np.atleast_1d(numbers(values, f"the column '{name}'")) for name, values in columns.items()}
    lengths = {array.size for array in arrays.values() if array.size != 1}
    wrong = [name for name, array in arrays.items() if array.ndim > 1]
    if not arrays or wrong or len(lengths) > 1:
        said = (
            f"'{wrong[0]}' has the shape {arrays[wrong[0]].shape}"
            if wrong
            else f"there are {sorted(lengths) or 'none'}"
        )
        raise ValueError(f"columns of one length are needed; {said}")
    return np.stack(np.broadcast_arrays(*arrays.values()), axis=1)


class Values(Fixed):
    """Values of parameters and starts: a row for each instance."""

    _noun = "values"
    _recipe: Recipe  # of the model
    _call: tuple[str, tuple[Any, ...], dict[str, Any]]  # the model's method, and its arguments

    def __reduce__(self) -> Any:
        return _values_again, (self._recipe, self._call)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns: parameters, q.NAME, qd.NAME."""
        count = lib.kempe_values_column_count(self._pointer)
        return tuple(string(lib.kempe_values_name(self._pointer, k)) for k in range(count))

    def __len__(self) -> int:
        return int(lib.kempe_values_count(self._pointer))

    def __repr__(self) -> str:
        return f"<Values: {len(self)} rows of {', '.join(self.names)}>"

    def __getitem__(self, k: int) -> Array:
        """One row, in SI.

        Raises IndexError if there is no such row."""
        if not -len(self) <= k < len(self):
            raise IndexError(f"there are {len(self)} rows")
        return np.array(view(lib.kempe_values_row(self._pointer, k % len(self)), (len(self.names),), None))


def _values_again(recipe: Recipe, call: tuple[str, tuple[Any, ...], dict[str, Any]]) -> Values:
    name, arguments, options = call
    made: Values = getattr(recipe[0](*recipe[1]), name)(*arguments, **options)
    return made


class Statistics(Result):
    """Statistics of the quantities of instances, with intervals of confidence."""

    _noun = "statistics"
    moments: TableOf = TableOf("A row for each quantity: mean and standard deviation with their intervals.")
    quantiles: TableOf = TableOf("A row for each quantity and part, with intervals by order statistics.")
    contributions: TableOf = TableOf(
        "A row for each quantity and input: regression, and Sobol's indices of the design saltelli."
    )
    extremes: TableOf = TableOf("Two rows for each quantity: least and largest value, their instances and settings.")
    within: TableOf = TableOf("The instances within the limits, with an interval.")


class EnsembleResult(Reported):
    """Results of all instances."""

    _noun = "ensemble_result"
    _kept = ("status", "reason", "q", "qd", "quantities", "limits")
    instances: TableOf = TableOf(
        "A row for each instance: values, status, t, q.NAME, qd.NAME, work, accuracy, verdict, reason."
    )

    def __len__(self) -> int:
        return int(lib.kempe_ensemble_result_count(self._pointer))

    def __repr__(self) -> str:
        found = self.status
        counts = ", ".join(f"{found.count(word)} {word}" for word in dict.fromkeys(found))
        return f"<EnsembleResult: {len(found)} instances{': ' if counts else ''}{counts}>"

    @property
    def status(self) -> list[str]:
        """Status of each instance: "complete", "not trustworthy", "stopped" or "failed"."""
        return [outcome(lib.kempe_ensemble_result_outcome(self._pointer, k)) for k in range(len(self))]

    @property
    def reason(self) -> list[str]:
        """Reason of each instance, "" when ok."""
        return [string(lib.kempe_ensemble_result_reason(self._pointer, k)) for k in range(len(self))]

    @property
    def q(self) -> Array:
        """Final coordinates (instances x n); NaN where there is no state."""
        return self._states(lib.kempe_ensemble_result_q)

    @property
    def qd(self) -> Array:
        """Final rates (instances x n)."""
        return self._states(lib.kempe_ensemble_result_qd)

    @property
    def quantities(self) -> dict[str, Array]:
        """Values of each quantity by its name, in SI; NaN where an instance did not reach its end."""
        count = range(lib.kempe_ensemble_result_quantity_count(self._pointer))
        names = [string(lib.kempe_ensemble_result_quantity_name(self._pointer, value)) for value in count]
        rows = range(len(self))
        return {
            name: np.array([lib.kempe_ensemble_result_quantity(self._pointer, k, value) for k in rows], dtype=float)
            for value, name in zip(count, names)
        }

    @property
    def limits(self) -> list[str]:
        """Of each instance "pass" or "fail" by the limits, "" where it is not known."""
        return [string(lib.kempe_ensemble_result_limits(self._pointer, k)) for k in range(len(self))]

    def to_xarray(self) -> Any:
        """An xarray.Dataset over `instance`, 1 the first one: the columns of `instances` with their units, varied values as further
        coordinates of an instance, and q and qd over (instance, coordinate).

        Raises ImportError if xarray is not installed.

        >>> batch = kempe.Model("four_bar.yaml").ensemble({"crank": [0.29, 0.3, 0.31]}).run(t_end=1)
        >>> data = batch.to_xarray()  # with xarray
        >>> data["q"].dims, bool(data["q"].sel(instance=2, coordinate="rocker") == batch.q[1, 2])  # with xarray
        (('instance', 'coordinate'), True)
        """
        import xarray

        table = self.instances
        varied = table.names[: table.names.index("status")]
        ends = tuple(name[2:] for name in table.names[len(varied) :] if name.startswith("q."))
        columns = {name: ("instance", table[name], {"units": table.units[name]}) for name in table}
        places = {"instance": np.arange(1, len(self) + 1), **{name: columns[name] for name in varied}, "coordinate": list(ends)}
        both = ("instance", "coordinate")
        ended = {f"{kind}.{name}" for kind in ("q", "qd") for name in ends} - set(varied)
        rest = {name: column for name, column in columns.items() if name not in ended and name not in varied}
        return xarray.Dataset({"q": (both, self.q), "qd": (both, self.qd), **rest}, places)

    def statistics(self, confidence: float = 0.95) -> Statistics:
        """Moments, quantiles, yield and contributions of the inputs, with intervals of a confidence.

        Raises ArgumentError if the confidence is not between 0 and 1. Raises TypeError if it is not a number.

        >>> batch = kempe.Model("four_bar.yaml").ensemble({"crank": [0.29, 0.3, 0.31]}, quantities="max(q(rocker))").run(t_end=1)
        >>> batch.statistics().moments["count"]
        array([3., 3.])
        """
        made = self._context.make(Statistics, lib.guarded_kempe_statistics_new, self.instances._pointer, confidence)
        return made

    def _states(self, get: object) -> Array:
        n = len(self._context.coordinates)
        return np.array([view(get(self._pointer, k), (n,), None) for k in range(len(self))]).reshape(len(self), n)  # type: ignore[operator]


class Folder(Result):
    """A folder of results, part by part. str() is its state."""

    _noun = "folder"
    _kept = ("parts", "whole", "model_file", "run_options")

    @staticmethod
    def open(path: str | os.PathLike[str]) -> Folder:
        """A folder that has results: of `Ensemble.run_folder`, or of the command's `--out`.

        Raises InputError if the folder does not exist, has no results, or is damaged."""
        context = Context()
        return context.make(Folder, lib.kempe_folder_open, context.pointer, path_of(path), long=False)

    def __len__(self) -> int:
        return int(lib.kempe_folder_instance_count(self._pointer))

    @property
    def parts(self) -> int:
        """Number of parts."""
        return int(lib.kempe_folder_part_count(self._pointer))

    @property
    def whole(self) -> int:
        """Number of parts that were there when the folder was opened, or when its run ended."""
        return int(lib.kempe_folder_whole_count(self._pointer))

    @property
    def model_file(self) -> str:
        """The file of the model, as the run had it."""
        return string(lib.kempe_folder_model_file(self._pointer))

    @property
    def run_options(self) -> dict[str, Any]:
        """Options of the run, for `simulate` of one of its instances (`Model.instance`)."""
        run = ffi.new("kempe_run_options *")
        lib.kempe_folder_run_options(self._pointer, run)
        members = {name: getattr(run, name) for name, _ in ffi.typeof("kempe_run_options").fields if name != "size"}
        return {name: string(value) if isinstance(value, ffi.CData) else value for name, value in members.items() if value}

    def check(self) -> None:
        """Reads all parts.

        Raises FailedError if parts are missing or damaged."""
        self._context.refuse(*self._context.guarded(lib.guarded_kempe_folder_check, self._pointer))

    def part(self, k: int) -> Table:
        """The rows of part k, from 0 on.

        Raises InputError if the part is damaged. Raises FileError if it is missing. Raises ArgumentError if there is no part k."""
        return self._context.make(Table, lib.kempe_folder_part, self._pointer, k, long=False)

    def write(self, path: str | os.PathLike[str], units: bool = False) -> None:
        """Checks all parts and writes one table, whole or not at all, in the format of the path's ending. `units`: columns of
        .csv are named with theirs.

        Raises FailedError if parts are missing or damaged. Raises ArgumentError if the ending is of no known format. Raises FileError
        if the file cannot be written."""
        self._context.refuse(
            *self._context.guarded(lib.guarded_kempe_folder_write, self._pointer, path_of(path), units)
        )

    def write_report(self, path: str | os.PathLike[str], model: Model | None = None) -> None:
        """Checks all parts and writes the page that `EnsembleResult.write_report` writes of a run in one piece. `model`: the model of the
        run; by default it is read from `model_file`.

        Raises InputError if it is another model. Raises FailedError if parts are missing or damaged. Raises FileError if a file cannot
        be read or written."""
        from .model import Model

        of_run = model or Model(self.model_file)
        self._context.refuse(
            *self._context.guarded(
                lib.guarded_kempe_folder_write_report, self._pointer, of_run._pointer, path_of(path)
            )
        )

    def write_history(self, path: str | os.PathLike[str], units: bool = False) -> None:
        """The same for the histories of chosen instances.

        Raises ArgumentError if the folder has no histories, and the exceptions of `write`."""
        self._context.refuse(
            *self._context.guarded(lib.guarded_kempe_folder_write_history, self._pointer, path_of(path), units)
        )

    def __repr__(self) -> str:
        return f"<Folder: {self.whole} of {self.parts} parts>"


class Ensemble(Fixed):
    """The equations of a model with the columns of a table of values kept symbolic.

    Pickled, it is its model, values and options. A process that reads it derives the equations once, however often it does."""

    _noun = "ensemble"
    _values: Values
    _chosen: dict[str, Any]  # options of its making
    _key: str  # of the processes that read it
    _hash: bytes  # of the model

    def __reduce__(self) -> Any:
        return _ensemble_again, (self._key, self._hash, self._values._recipe, self._values._call, self._chosen)

    def __repr__(self) -> str:
        return f"<Ensemble: {len(self._values)} instances, {', '.join(self._values.names)}>"

    def run(self, lanes: int = 0, **options: Unpack[RunOptions]) -> EnsembleResult:
        """Runs every instance to t_end. `lanes`: instances at a time, 0 the best for this machine, -1 a separate run for each.

        >>> import numpy
        >>> ensemble = kempe.Model("four_bar.yaml").ensemble({"crank": numpy.linspace(0.28, 0.32, 9)})
        >>> batch = ensemble.run(t_end=0.5)
        >>> len(batch), batch.q.shape, set(batch.status)
        (9, (9, 3), {'complete'})
        """
        if not len(self._values):
            raise ArgumentError(f"there is no instance to run: the columns {', '.join(self._values.names)} are empty")
        given, keep = struct_of("kempe_run_options", options, "progress", "lanes")
        with self._context.reporting(options.get("progress")):
            made = self._context.make(
                EnsembleResult, lib.guarded_kempe_ensemble_run, self._pointer, given, lanes, owners=(self._pointer,)
            )
        del keep
        return made

    def run_range(self, first: int, count: int, lanes: int = 0, **options: Unpack[RunOptions]) -> EnsembleResult:
        """Runs `count` instances from number `first` (from 0) on: their results are the same as in a run of all."""
        given, keep = struct_of("kempe_run_options", options, "progress", "lanes")
        with self._context.reporting(options.get("progress")):
            made = self._context.make(
                EnsembleResult,
                lib.guarded_kempe_ensemble_run_range,
                self._pointer,
                given,
                lanes,
                first,
                count,
                owners=(self._pointer,),
            )
        del keep
        return made

    def run_rows(self, rows: ArrayLike, lanes: int = 0, **options: Unpack[RunOptions]) -> EnsembleResult:
        """Runs instances with other values, without another derivation: rows of the columns of the table, in SI. Columns that
        have names, as in pandas, are taken by their names.

        Raises ValueError if rows do not have a value for each column.

        >>> ensemble = kempe.Model("four_bar.yaml").ensemble({"crank": [], "base": []})
        >>> ensemble.run_rows([[0.29, 0.9], [0.31, 0.9]], t_end=0.5).status
        ['complete', 'complete']
        """
        given, keep = struct_of("kempe_run_options", options, "progress", "lanes")
        names = self._values.names
        table = numbers(by_name(rows, names), "rows")
        if table.ndim != 2 or table.shape[1] != len(names):
            raise ValueError(
                f"rows of {len(names)} values are needed ({', '.join(names)}); the array's shape is {table.shape}"
            )
        with self._context.reporting(options.get("progress")):
            made = self._context.make(
                EnsembleResult,
                lib.guarded_kempe_ensemble_run_rows,
                self._pointer,
                given,
                lanes,
                len(table),
                ffi.from_buffer("double[]", table),
                owners=(self._pointer,),
            )
        del keep
        return made

    def history(self, instances: str, **options: Unpack[RunOptions]) -> Table:
        """Time histories of chosen instances, "3,10:12", 1 the first one: a column `instance`, then the columns of `Trajectory.rows`.
        Each is a separate run.

        >>> ensemble = kempe.Model("four_bar.yaml").ensemble({"crank": [0.29, 0.30, 0.31]})
        >>> table = ensemble.history("1,3", t_end=0.5, output_step=0.1)
        >>> len(table["t"]), table.names[:3]
        (12, ('instance', 't', 'q.crank'))
        """
        given, keep = struct_of("kempe_run_options", options, "progress")
        with self._context.reporting(options.get("progress")):
            made = self._context.make(
                Table, lib.guarded_kempe_ensemble_history, self._pointer, given, utf8(instances)
            )
        del keep
        return made

    def run_folder(  # type: ignore[misc]
        self,
        path: str | os.PathLike[str],
        lanes: int = 0,
        chunk: int | None = None,
        resume: bool = False,
        shard: str | None = None,
        executor: Executor | None = None,
        shards: int = 0,
        history: str | None = None,
        **options: Unpack[RunOptions],
    ) -> Folder:
        """Runs the instances into a folder, part by part, with the memory of one part. `resume`: runs the missing ones.
        `shard`: "I/N", every N-th part from the I-th on, or "auto". Processes with one of both share a folder.
        `history`: instances whose histories are written too, "3,10:12", 1 the first one.

        With an `executor`, such as from concurrent.futures, its processes run `shards` such shares (0: 64), with one thread each
        unless `threads` is given. The call waits for all of them; the error of a lost process names the missing parts.

        Raises InputError if the model of a process is another one. Raises TypeError if both an executor and a shard are given.

        >>> import tempfile
        >>> ensemble = kempe.Model("four_bar.yaml").ensemble({"crank": [0.29, 0.30, 0.31]})
        >>> with tempfile.TemporaryDirectory() as place:
        ...     folder = ensemble.run_folder(place + "/bars.kempe", chunk=2, t_end=0.5)
        ...     len(folder), folder.parts, folder.whole
        (3, 2, 2)
        """
        if not len(self._values):
            raise ArgumentError(f"there is no instance to run: the columns {', '.join(self._values.names)} are empty")
        if executor is not None:
            if shard is not None:
                raise TypeError("shard and executor exclude each other: an executor runs all shares")
            return run_shards(self, path, lanes, chunk, resume, executor, shards, {**options, "history": history})
        given, keep = struct_of("kempe_run_options", options, "progress", "lanes")
        where, more = struct_of(
            "kempe_folder_options", {"chunk": chunk, "resume": resume, "shard": shard, "history": history}
        )
        with self._context.reporting(options.get("progress")):
            made = self._context.make(
                Folder,
                lib.guarded_kempe_ensemble_run_folder,
                self._pointer,
                given,
                lanes,
                path_of(path),
                where,
                owners=(self._pointer,),
            )
        del keep, more
        return made


def _ensemble_again(
    key: str,
    model_hash: bytes,
    recipe: Recipe,
    call: tuple[str, tuple[Any, ...], dict[str, Any]],
    options: dict[str, Any],
) -> Ensemble:
    def make() -> Ensemble:
        name, arguments, keywords = call
        model = recipe[0](*recipe[1])
        made: Ensemble = model.ensemble(getattr(model, name)(*arguments, **keywords), **options)
        if made._hash != model_hash:
            label = recipe[1][0] if recipe[1] and isinstance(recipe[1][0], str) else model.name
            raise InputError(f"{label}: the model has changed since it was pickled; pickle it again")
        made._key = key
        return made

    ensemble: Ensemble = once(key, make)
    return ensemble


class Function:
    """Quantities of a mechanism as a function of its parameters and starts: f(X) with rows of inputs gives rows of values.

    Without quantities the values are the final coordinates and rates. A row whose instance does not reach its end is NaN, and
    `reasons` says why. Pickled, it is its model and options; a process that reads it derives the equations once.

    Raises TypeError if there is no such option. Raises ArgumentError if an option or lanes have a value that does not exist."""

    def __init__(self, ensemble: Ensemble, lanes: int, options: Mapping[str, Any]) -> None:
        self._ensemble, self._lanes, self._options = ensemble, lanes, dict(options)
        self._last = threading.local()
        self.inputs: tuple[str, ...] = ensemble._values.names
        struct_of("kempe_run_options", self._options, "progress", "lanes")  # unknown names are refused here
        self.values: tuple[str, ...] = self._names(ensemble.run_rows(np.empty((0, len(self.inputs))), lanes, **options))

    def __call__(self, X: ArrayLike) -> Array:
        """Values (rows x values) of rows of inputs (rows x inputs), in SI; of one row (inputs) its values (values).
        Columns that have names, as in pandas, are taken by their names.

        Raises ValueError if rows do not have a value for each input. Raises ArgumentError if a column or a name of an option does not
        exist. Raises TypeError if entries of X are not numbers. A row that fails raises nothing.

        >>> f = kempe.Model("four_bar.yaml").function(["crank", "base"], quantities="max(q(rocker))", t_end=1)
        >>> f.values, f([[0.3, 0.9], [0.31, 0.9], [3.0, 0.9]]).shape
        (('max(q(rocker))', 'max(q(rocker)).time'), (3, 2))
        >>> f.reasons[0], f.reasons[2] != ""
        ('', True)
        """
        given = numbers(by_name(X, self.inputs), "X")
        one = given.ndim == 1 and given.size == len(self.inputs)
        batch = self.batch(given[np.newaxis] if one else given)
        table = self._table(batch)
        return table[0] if one else table

    def batch(self, X: ArrayLike) -> EnsembleResult:
        """The results of the rows, with their states, work and verdicts.

        Raises the exceptions of a call of the function."""
        try:
            batch = self._ensemble.run_rows(X, self._lanes, **self._options)
        except FailedError as error:
            if error.partial is None:
                raise
            batch = error.partial  # no row reached its end: all reasons are here
        self._last.reasons = batch.reason
        return batch

    @property
    def reasons(self) -> list[str]:
        """Of the last call in this thread: why each row did not reach its end, "" where it did."""
        return list(getattr(self._last, "reasons", ()))

    def _names(self, batch: EnsembleResult) -> tuple[str, ...]:
        names = tuple(batch.quantities)
        ends = self._ensemble._context.coordinates
        return names or (*(f"q.{name}" for name in ends), *(f"qd.{name}" for name in ends))

    def _table(self, batch: EnsembleResult) -> Array:
        found = batch.quantities
        table = np.stack(list(found.values()), axis=1) if found else np.hstack([batch.q, batch.qd])
        table[[status in ("stopped", "failed") for status in batch.status]] = np.nan
        return table

    def __reduce__(self) -> Any:
        return Function, (self._ensemble, self._lanes, self._options)

    def __repr__(self) -> str:
        return f"<Function: {len(self.values)} values of {', '.join(self.inputs)}>"
