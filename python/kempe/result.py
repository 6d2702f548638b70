# SPDX-License-Identifier: BSD-3-Clause
"""Results of studies: text, JSON, tables, pictures and pages. A study's class names its tables."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any, ClassVar

from ._native import lib
from .columns import TABLES, TextsFor, with_tables
from .context import Fixed, Owned, T, outcome, string, text_written
from .display import details, picture
from .errors import Error, summary_in_python
from .kept import read_again, values_of
from .options import options, path_of, utf8
from .table import Table, check_picture

_nothing: AbstractContextManager[None] = nullcontext()


class PartOf:
    """An attribute of a result that the library has by its name."""

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type[Result], name: str) -> None:
        self.name = name


class TableOf(PartOf):
    """An attribute of a result: one of its tables, made when it is first used."""

    def __get__(self, result: Result | None, owner: type[Result]) -> Table:
        return self if result is None else result.table(self.name)  # type: ignore[return-value]


class Result(Fixed):
    """Result of a study. str() is its summary, as the command prints it, in the words of Python. Pickled, it is its numbers, tables and texts."""

    _kept: ClassVar[tuple[str, ...]] = ()  # further attributes that a pickled result has
    _kept_each: ClassVar[tuple[str, ...]] = ()  # methods whose argument is an index

    @classmethod
    def tables_and_matrices(cls) -> list[str]:
        """Names of the tables, and of the matrices of a state space."""
        from inspect import getattr_static

        return [name for name in dir(cls) if isinstance(getattr_static(cls, name), PartOf)]

    def __reduce__(self) -> Any:
        return read_again, (type(self), values_of(self))

    def _made(self) -> None:
        self._tables: dict[str, Table] = {}

    def _call(self, name: str) -> Any:
        return getattr(lib, f"kempe_{self._noun}_{name}")

    def table(self, name: str) -> Table:
        """A table by its name.

        Raises ArgumentError if the result has no such table."""
        if name not in self._tables:
            self._tables[name] = self._context.make(Table, self._call("table"), self._pointer, utf8(name), long=False)
        return self._tables[name]

    def text(self, full: bool = False) -> str:
        """The summary; `full`: with all details."""
        return summary_in_python(
            self._context.text(self._call("print"), self._pointer, lib.KEMPE_FULL_TEXT if full else lib.KEMPE_TEXT)
        )

    def to_dict(self) -> dict[str, Any]:
        """The result as the command's JSON has it, in SI."""
        made: dict[str, Any] = json.loads(self._context.text(self._call("print"), self._pointer, lib.KEMPE_JSON))
        return made

    @property
    def trusted(self) -> bool:
        """True if the result is complete and no check of it failed.

        >>> kempe.Model("four_bar.yaml").simulate(t_end=1).trusted
        True
        """
        return str(self.to_dict()["status"]).startswith("complete")

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<{type(self).__name__}>"

    def _repr_html_(self) -> str:
        shown = self._shown()
        return shown + details("summary", str(self), opened=not shown)

    def _shown(self) -> str:
        """Display of a notebook above the summary, which is open where there is nothing else."""
        return ""


class Judged(Result):
    """A result that may end early: `status` is a word, `reason` a sentence."""

    _kept: ClassVar[tuple[str, ...]] = ("status", "reason")

    @property
    def status(self) -> str:
        """ "complete", "complete, not checked", "not trustworthy", "stopped" or "failed"."""
        return outcome(self._call("outcome")(self._pointer))

    @property
    def reason(self) -> str:
        """Why the computation ended early, or as the model requests; "" otherwise."""
        return string(self._call("reason")(self._pointer))

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.status}{': ' if self.reason else ''}{self.reason}>"


class Page:
    """A self-contained HTML page, which a notebook shows in a frame. str() is its text."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __str__(self) -> str:
        return self._text

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self._text)}" style="width: 100%; height: 640px; border: 0"></iframe>'


class Reported(Result):
    """A result with a page: a self-contained HTML file, which moves the mechanism."""

    def write_report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page as one file of HTML.

        Raises FileError if the file cannot be written. Raises ArgumentError if the run was read from it."""
        status, message = self._context.guarded(
            getattr(lib, f"guarded_kempe_{self._noun}_write_report"), self._pointer, path_of(path)
        )
        self._context.refuse(status, message)

    def report(self) -> Page:
        """The page; a notebook shows it.

        Raises FileError if the folder of temporary files cannot be written to."""
        return Page(text_written(self.write_report, "report.html"))


class Drawn(Result):
    """A result with a picture."""

    def write_picture(self, path: str | os.PathLike[str]) -> None:
        """Writes the picture as .svg or .png.

        Raises ArgumentError if the ending is neither .svg nor .png. Raises FailedError if there is nothing to draw or .png needs a
        library that is not installed. Raises FileError if the file cannot be written."""
        check_picture(path)
        self._context.check(self._call("write_picture"), self._pointer, path_of(path))

    def svg(self) -> str:
        """The picture as text.

        Raises FailedError if there is nothing to draw."""
        return text_written(self.write_picture, "result.svg")

    def _picture(self) -> str:
        try:
            return picture(self.svg())
        except (Error, KeyError):  # nothing varies
            return ""

    def _shown(self) -> str:
        return self._picture()


def study(kind: type[T], source: Owned, values: Mapping[str, Any], *arguments: Any) -> T:
    """The result of a study of a model or system, whose options are keywords; `arguments` follow them in C."""
    context, progress = source._context, values.get("progress")
    struct = kind._options or f"kempe_{kind._noun}_options"
    values, texts = with_tables(struct, values) if struct in TABLES else (values, {})
    given, keep = options(struct, values, "progress")
    function = getattr(lib, kind._maker or f"guarded_kempe_{kind._noun}_new")
    with _nothing if progress is None else context.reporting(progress), TextsFor(context, texts) if texts else _nothing:
        made = context.make(kind, function, source._pointer, given, *arguments, owners=source._owners())
    del keep
    return made
