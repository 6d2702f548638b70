# SPDX-License-Identifier: BSD-3-Clause
"""Exceptions: a class for each status of the library, with its sentences."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import partial
from typing import Any, NamedTuple

from ._native import lib

_PLACE = re.compile(r"(?P<file>.+?):(?P<line>\d+):(?P<column>\d+): (?P<sentence>.*)")


class Problem(NamedTuple):
    """One mistake in a model or table. `line` and `column` count from 1; 0 where there is no text, as in a builder."""

    file: str
    line: int
    column: int
    sentence: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}: {self.sentence}" if self.line else self.sentence


class Error(Exception):
    """Base class of the library's errors. `partial` is the result up to the failure, None where there is none."""

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.message = message
        self.partial = partial

    def __str__(self) -> str:
        return self.message


class InputError(Error, ValueError):
    """A model, table or reference is wrong. `problems` has every mistake with its place."""

    @property
    def problems(self) -> list[Problem]:
        """Each mistake with file, line, column and sentence.

        >>> try:
        ...     kempe.Model.from_text("kempe: 1\\nbodies: {a: {mas: 1}}", label="a.yaml")
        ... except kempe.InputError as error:
        ...     print(error.problems[1].line, error.problems[1].sentence)
        2 unknown key 'mas' in body 'a'; did you mean 'mass'?
        """
        return [_problem(line) for line in self.message.splitlines()]


class ArgumentError(Error, ValueError):
    """A name or value of an option does not exist."""


class FailedError(Error, RuntimeError):
    """The computation is impossible as requested."""


class StoppedError(Error, RuntimeError):
    """The computation was ended early, by an interrupt or an event, without a result."""


class FileError(Error, OSError):
    """A file cannot be read or written."""


class OutOfMemoryError(Error, MemoryError):
    """The system has no more memory."""


class BugError(Error):
    """A defect of Kempe: please report it."""


class Interrupted(KeyboardInterrupt):
    """KeyboardInterrupt during a computation. `partial` is the result up to there, None where there is none."""

    def __init__(self, partial: Any = None) -> None:
        super().__init__()
        self.partial = partial


class KempeWarning(UserWarning):
    """A warning of the library, for example of a run that has not converged."""


CLASSES: dict[int, type[Error]] = {
    lib.KEMPE_STOPPED: StoppedError,
    lib.KEMPE_E_MEMORY: OutOfMemoryError,
    lib.KEMPE_E_INPUT: InputError,
    lib.KEMPE_E_FAILED: FailedError,
    lib.KEMPE_E_IO: FileError,
    lib.KEMPE_E_ARGUMENT: ArgumentError,
    lib.KEMPE_E_BUG: BugError,
}


def in_python(message: str, tables: Collection[str] = ()) -> str:
    """A sentence of the library, which also serves the command, with keywords in place of the command's options. `tables`: names
    of tables in memory, whose lines are rows."""
    for name in tables:
        message = re.sub(rf"^{re.escape(name)}:(\d+):\d+: ", partial(_row, name), message, flags=re.M)
    message = message.replace(" is NULL or missing", " is missing").replace("or --set)", "or its parameters)")
    message = message.replace("'kempe show --model' lists all coordinates", "`coordinates` of the model lists all")
    message = message.replace("the force function that was set for the system failed at", "force gives no finite numbers at")
    message = re.sub(r"column '([^']*)' is missing(?=; did you|: columns are)", r"column '\1' is missing in the model", message)
    message = re.sub(r"--leave-out (\S+) allows that", r'leave_out="\1" allows that', message)
    for written, call in _WRITTEN:
        message = message.replace(written, call)
    message = re.sub(r"--(loads|method|formulation) (least-norm|values|slopes|reduced|projected|dae)\b", r'\1="\2"', message)
    message = re.sub(r"--(?:input|set) (?=[^\W\d])", "", message)
    return re.sub(r"(?<![\w-])--([a-z][a-z-]*)", lambda found: found[1].replace("-", "_"), message)


_QUOTE = "'"

# Options as the command has them in sentences, and the arguments of Python for them.
_WRITTEN = [
    ("a value is written NAME=A, a range NAME=A:B or NAME=A:B:N", 'a value is {"NAME": A}, a range {"NAME": (A, B)} or {"NAME": (A, B, N)}'),
    (", with commas between several; not", "; not"),
    ("NAME:LOW:HIGH; one may be left out, NAME:LOW: or NAME::HIGH", '{"NAME": (LOW, HIGH)}; one may be None'),
    ("needs two bounds, NAME:LOW:HIGH", 'needs two bounds, {"NAME": (LOW, HIGH)}'),
    ("give 'NAME=A:B'", 'give sweep={"NAME": (A, B)}'),
    ("as in --sweep NAME=A:B:N", 'as in sweep={"NAME": (A, B, N)}'),
    ("by --mass M.mtx, and the places of the nodes by --nodes FILE", 'by mass="M.mtx", and the places of the nodes by nodes="FILE"'),
    ("; --set gives another start", "; Model(.., NAME=..) gives another start"),
]

# Options and files that summaries of the command name, and the calls of Python for them.
_CALLS: list[tuple[str, Any]] = [
    (r"kempe simulate --from FOLDER\s+--instance K", "Model.instance(FOLDER, K)"),
    (r"(?:kempe simulate )?--from ('[^']*'|\S+)\s+--instance (\d+)", lambda m: f"Model.instance({m[1].strip(_QUOTE)!r}, {int(m[2]) - 1})"),
    (r"kempe gather (?:'[^']*'|\S+) -o FILE.csv", "write('FILE.csv')"),
    (r"the run's command with --resume", "run_folder(resume=True)"),
    (r"--all\b", "text(full=True)"),
    (r"--json\b", "to_dict()"),
    (r"-o\s+FILE\.\w+|--csv\s+FILE", "tables_and_matrices()"),
    (r"--svg\s+FILE", "write_picture(FILE)"),
    (r"--report\s+FILE", "write_report(FILE)"),
    (r"--set (\w+=\S+)", r"\1"),
    (r"--(formulation|form|integrator|linear|loads)(\s+)([a-z][\w-]*)", r'\1="\3"'),
    (r"--rtol\s+([0-9.e-]*[0-9])", r"rtol=\1"),
    (r'\b((?:formulation|form|integrator|rtol)=[^\s,:;]+)\s(?=(?:form|integrator|rtol|linear)=)', r"\1, "),
]


def summary_in_python(text: str) -> str:
    """A summary, which the command prints, with keywords and calls in place of its options."""
    if "--" not in text and "-o FILE" not in text and "kempe gather" not in text:
        return text
    for pattern, call in _CALLS:
        text = re.sub(pattern, call, text)
    return in_python(text)


def _row(name: str, line: re.Match[str]) -> str:
    return f"{name}, row {int(line[1]) - 2}: " if int(line[1]) > 1 else f"{name}: "


def error_of(status: int, message: str, partial: Any = None) -> Error:
    """The exception of a status."""
    return CLASSES[status](message or f"status {status}", partial)


def _problem(line: str) -> Problem:
    found = _PLACE.fullmatch(line)
    if not found:
        return Problem("", 0, 0, line)
    return Problem(found["file"], int(found["line"]), int(found["column"]), found["sentence"])
