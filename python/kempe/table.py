# SPDX-License-Identifier: BSD-3-Clause
"""Results as tables: columns with names and units."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ._native import ffi, lib
from .arrays import view
from .context import NULL, Context, Fixed, string, text_written
from .display import picture, table_html
from .errors import ArgumentError
from .lazy import np
from .options import path_of, text_of, unknown, utf8

if TYPE_CHECKING:
    from numpy.typing import NDArray

_OUTPUT = re.compile(r"(\w+)\(([^()]*)\)((?:\.\w+)*)")


def column_name(output: str) -> str:
    """The name of an output, "position(coupler.C).x", as a column has it, "position.coupler.C.x"."""
    if not isinstance(output, str):
        raise TypeError(f"a name is needed, not {type(output).__name__}")
    found = _OUTPUT.fullmatch(output.strip())
    return f"{found[1]}.{found[2].replace(',', '.').replace(' ', '')}{found[3]}" if found else output


def check_picture(path: str | os.PathLike[str]) -> None:
    """Refuses a picture whose name has the ending of another format."""
    if os.path.splitext(os.fsdecode(path))[1].lower() not in (".svg", ".png"):
        raise ArgumentError(f"{os.fsdecode(path)}: a picture is written as .svg or .png")


class Columns(Mapping[str, "NDArray[Any]"]):
    """Columns by name, in SI, with their units."""

    name: str
    row_count: int
    names: tuple[str, ...]
    units: dict[str, str]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(self.names))

    def __len__(self) -> int:
        return len(self.units)

    def __repr__(self) -> str:
        return f"<Table {self.name}: {self.row_count} rows of {len(self)} columns>"

    def row(self, k: int) -> dict[str, Any]:
        """One row as a dict.

        Raises IndexError if there is no row k."""
        return {name: self[name][k] for name in self}

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """The columns by name (rows each)."""
        return dict(self.items())

    def to_pandas(self, index: str | None = None) -> Any:
        """A pandas.DataFrame; `attrs["units"]` has the units.

        Raises ImportError if pandas is not installed. Raises KeyError if there is no column `index`."""
        import pandas

        frame = pandas.DataFrame({name: self[name] for name in self})
        frame.attrs.update(units=dict(self.units), name=self.name)
        return frame.set_index(index) if index else frame

    def to_xarray(self, index: str | None = None) -> Any:
        """An xarray.Dataset over the first column, or over `index`; each variable has its unit. Histories of instances, and rows of
        several files, are over both of their first columns: (instance, t) and (file, t). Missing rows are NaN.

        Raises ImportError if xarray is not installed. Raises KeyError if there is no column `index`.

        >>> ensemble = kempe.Model("four_bar.yaml").ensemble({"crank": [0.29, 0.30]})
        >>> data = ensemble.history("1,2", t_end=0.5, output_step=0.1).to_xarray()  # with xarray
        >>> data["q.crank"].dims, data["q.crank"].shape  # with xarray
        (('instance', 't'), (2, 6))
        """
        import xarray

        if index is None and self.names[:2] in (("instance", "t"), ("file", "t")):
            return self._of_two(xarray)
        index = index or self.names[0]
        columns = {name: ((index,), self[name], {"units": self.units[name]}) for name in self}
        return xarray.Dataset(
            {name: column for name, column in columns.items() if name != index}, {index: columns[index]}
        )

    def _of_two(self, xarray: Any) -> Any:
        """A dataset over the first two columns."""
        dims = self.names[:2]
        firsts, row = np.unique(self[dims[0]], return_inverse=True)
        times, column = np.unique(self[dims[1]], return_inverse=True)
        whole = firsts.dtype.kind == "f" and bool((firsts == np.floor(firsts)).all())
        places = {dims[0]: firsts.astype(int) if whole else firsts, dims[1]: ("t", times, {"units": self.units["t"]})}
        variables = {}
        for name in self:
            if name not in dims:
                values = self[name]
                grid = np.full((len(firsts), len(times)), "" if values.dtype.kind == "U" else np.nan, dtype=values.dtype)
                grid[row, column] = values
                variables[name] = (dims, grid, {"units": self.units[name]})
        return xarray.Dataset(variables, places)

    def _curves(self) -> str:
        return ""

    def _repr_html_(self) -> str:
        return table_html(self)

    def __reduce__(self) -> Any:
        return (FrozenTable, (self.name, dict(self.units), {name: np.array(self[name]) for name in self}))


class Table(Columns, Fixed):
    """Columns by name, in SI: arrays of float64, read-only views without a copy, or arrays of words.

    Names are names of columns, "position.coupler.C.x", or of outputs, "position(coupler.C).x"."""

    _noun = "table"

    def _made(self) -> None:
        count = range(lib.kempe_table_column_count(self._pointer))
        self.name: str = string(lib.kempe_table_name(self._pointer))
        self.row_count: int = lib.kempe_table_row_count(self._pointer)
        self.names: tuple[str, ...] = tuple(string(lib.kempe_table_column_name(self._pointer, k)) for k in count)
        self.units: dict[str, str] = {
            name: string(lib.kempe_table_unit(self._pointer, k)) for k, name in enumerate(self.names)
        }
        self._columns: dict[str, NDArray[Any]] = {}

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column, by its name or its output, a sensor or a state also by its own name.

        Raises KeyError if there is no such column. Raises TypeError if the name is not a text."""
        kept = self._columns.get(name)
        if kept is None:
            kept = self._columns[name] = self._read(name)
        return kept

    def _read(self, name: str) -> NDArray[Any]:
        column = -1
        for word in (name, column_name(name), f"sensor.{name}", f"state.{name}"):
            column = lib.kempe_table_find(self._pointer, utf8(word)) if column < 0 else column
        if column < 0:
            raise KeyError(unknown("column", name, self.names))
        values = lib.kempe_table_values(self._pointer, column)
        if values != NULL:
            return view(values, (self.row_count,), self._pointer)
        return np.array(
            [string(lib.kempe_table_word(self._pointer, row, column)) for row in range(self.row_count)], dtype=str
        )

    def __str__(self) -> str:
        return self._context.text(lib.kempe_table_print, self._pointer, lib.KEMPE_TEXT)

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Table:
        """A CSV file of numbers under a header of names. A unit follows its name, `q.crank [deg]`; without one a column is in SI. Empty
        fields are NaN.

        Raises InputError if the file cannot be read, or has errors, which are named by line and column."""
        context = Context()
        return context.make(Table, lib.kempe_table_read, context.pointer, path_of(path), long=False)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a file in the format of its ending: .csv, .json, .parquet, .npz, .mat.

        Raises FileError if the file cannot be written. Raises ArgumentError if its ending is of no known format."""
        self._context.check(lib.kempe_table_write, self._pointer, path_of(path))

    def write_picture(
        self, path: str | os.PathLike[str], x: str | None = None, y: Any = None, against: Table | None = None
    ) -> None:
        """Draws columns `y` over `x` as .svg or .png, a plot for each unit. None: all, over the first. `against`: another table, whose
        columns of these names are dashed curves behind.

        Raises ArgumentError if the ending is neither .svg nor .png or there is no such column. Raises FailedError if there are no rows
        or .png needs a library that is not installed. Raises FileError if the file cannot be written. Raises InputError if `against` has
        no such column, or one in a unit of another dimension. Raises TypeError if it is not a table."""
        check_picture(path)
        names = [NULL if each is None else ffi.new("char[]", utf8(text_of(each))) for each in (x, y)]
        if against is None:
            return self._context.check(lib.kempe_table_write_picture, self._pointer, *names, path_of(path))
        if not isinstance(against, Table):
            raise TypeError(f"against: a Table is needed, not {type(against).__name__}")
        return self._context.check(
            lib.kempe_table_write_picture_against, self._pointer, against._pointer, *names, path_of(path)
        )

    def svg(self, x: str | None = None, y: Any = None) -> str:
        """The picture as text.

        Raises ArgumentError if there is no such column. Raises FailedError if there are no rows."""
        return text_written(lambda path: self.write_picture(path, x, y), "table.svg")

    def _curves(self, most: int = 8) -> str:
        """The coordinates over the first column, as a notebook shows them; "" if there are none."""
        chosen = [name for name in self.names[1:] if name.startswith("q.")][:most]
        return picture(self.svg(self.names[0], chosen)) if chosen and self.row_count > 1 else ""


class FrozenTable(Columns):
    """A table that was pickled: only its columns."""

    def __init__(self, name: str, units: dict[str, str], columns: dict[str, NDArray[Any]]) -> None:
        self.name: str = name
        self.units: dict[str, str] = units
        self._columns = columns
        self.names: tuple[str, ...] = tuple(columns)
        self.row_count: int = len(next(iter(columns.values()), ()))

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column, by its name or its output, a sensor or a state also by its own name.

        Raises KeyError if there is no such column. Raises TypeError if the name is not a text."""
        found = name if name in self._columns else column_name(name)
        if found not in self._columns:
            raise KeyError(unknown("column", name, self.names))
        return self._columns[found]

    def __copy__(self) -> FrozenTable:
        return self

    def __deepcopy__(self, memo: object) -> FrozenTable:
        return self
