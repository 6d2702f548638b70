# SPDX-License-Identifier: BSD-3-Clause
"""Progress of long computations: to a function, to bars of tqdm, or to a line on stderr where there is no tqdm."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias


class Progress(NamedTuple):
    """The progress of a computation: `done` of `total`. `unit` is "s" for the simulated time of a run, otherwise what is
    counted: "rows", "runs", "instances", "frequencies", "values", "starts". `elapsed` and `left` are seconds on the wall;
    `left` is an estimate, None while there is none.

    >>> print(Progress(2.5, 10.0, "s", 1.0, 3.0))
    2.5 of 10 s (25 %), 3 s left
    """

    done: float
    total: float
    unit: str
    elapsed: float
    left: float | None

    @property
    def part(self) -> float:
        """done / total, 0 to 1."""
        return self.done / self.total if self.total else 1.0

    def __str__(self) -> str:
        left = "" if self.left is None else f", {self.left:.3g} s left"
        return f"{self.done:.6g} of {self.total:.6g} {self.unit} ({100 * self.part:.0f} %){left}"


# True: a bar. A function: it is called about ten times a second; its exception ends the computation and is raised.
ProgressTo: TypeAlias = "bool | Callable[[Progress], object]"


class Bars:
    """A bar of tqdm for each unit: a study of many runs has one for the runs, and one for the time of the current run."""

    def __init__(self, tqdm: Any) -> None:
        self.tqdm = tqdm
        self.bars: dict[str, Any] = {}

    def __call__(self, progress: Progress) -> None:
        bar = self.bars.get(progress.unit)
        if bar is None or bar.total != progress.total or progress.done < bar.n:
            if bar is not None:  # a run that is repeated
                bar.close()
            bar = self.bars[progress.unit] = self.tqdm(total=progress.total, unit=progress.unit, bar_format=_BAR)
        bar.update(progress.done - bar.n)

    def close(self) -> None:
        for bar in self.bars.values():
            bar.close()


_BAR = "{percentage:3.0f}% |{bar}| {n:.4g} of {total:.4g} {unit} [{elapsed}, {remaining} left]"


class Line:
    """A line on stderr that is written over."""

    def __init__(self) -> None:
        self.width: int = 0

    def __call__(self, progress: Progress) -> None:
        line = str(progress)
        print(f"\r{line:<{self.width}}", end="", file=sys.stderr, flush=True)
        self.width = len(line)

    def close(self) -> None:
        if self.width:
            print(file=sys.stderr)


def shown() -> Bars | Line:
    """Display of progress=True."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return Line()
    return Bars(tqdm)
