# SPDX-License-Identifier: BSD-3-Clause
"""Operation counts, equations in other languages, functional mock-up units."""

from __future__ import annotations

import os

from ._native import lib
from .context import string
from .options import path_of
from .result import Result


class Count(Result):
    """Operation counts of sets of equations."""

    _noun = "count"
    _options = "kempe_generate_options"


class Code(Result):
    """Equations in another language: a function for each set."""

    _noun = "code"
    _options = "kempe_generate_options"
    _kept = ("files",)

    @property
    def files(self) -> dict[str, str]:
        """Texts of the files by their names."""
        count = lib.kempe_code_file_count(self._pointer)
        return {
            string(lib.kempe_code_file_name(self._pointer, k)): string(lib.kempe_code_file_text(self._pointer, k))
            for k in range(count)
        }

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Writes all files into a folder, which is made if it does not exist.

        Raises FileError if the folder cannot be made or a file cannot be written."""
        self._context.check(lib.kempe_code_write, self._pointer, path_of(folder))


class FmuExport(Result):
    """A functional mock-up unit: its files, in memory."""

    _noun = "fmu_export"
    _options = "kempe_fmu_options"
    _kept = ("files",)

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files inside."""
        count = lib.kempe_fmu_export_file_count(self._pointer)
        return tuple(string(lib.kempe_fmu_export_file_name(self._pointer, k)) for k in range(count))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the unit, whole or not at all.

        Raises FileError if the file cannot be written."""
        self._context.check(lib.kempe_fmu_export_write, self._pointer, path_of(path))
