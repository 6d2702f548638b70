# SPDX-License-Identifier: BSD-3-Clause
"""Flexible bodies from meshes of finite elements."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from ._native import lib
from .context import Context
from .options import options as struct_of
from .options import path_of
from .result import Result

if TYPE_CHECKING:
    from typing import Unpack

    from ._options import ReduceOptions


class Reduction(Result):
    """A mesh reduced to the modes of a flexible body."""

    _noun = "reduction"
    _options = "kempe_reduce_options"
    _kept = ("frequencies",)

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Angular frequencies of the modes in the frame of the body, rad/s."""
        count = lib.kempe_reduction_mode_count(self._pointer)
        return tuple(lib.kempe_reduction_frequency(self._pointer, k) for k in range(count))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the file of the body, .npz, that a model names under `flexible`.

        Raises FileError if the file cannot be written."""
        self._context.check(lib.kempe_reduction_write, self._pointer, path_of(path))


def reduce(mesh: str | os.PathLike[str], **options: Unpack[ReduceOptions]) -> Reduction:
    """Reduces the matrices of a mesh by the method of Craig and Bampton; `interfaces` maps names to nodes: "1,2,5-9", "x=0".

    >>> body = reduce("brick.mtx", mass="brick_mass.mtx", nodes="brick_nodes.txt", units="m kg s",
    ...               interfaces={"root": "x=0", "tip": "x=2"}, modes=2)
    >>> len(body.frequencies), round(body.frequencies[0], 4)
    (8, 2.4394)
    >>> body.write("brick.npz")
    """
    context = Context()
    given, keep = struct_of("kempe_reduce_options", options)
    made = context.make(Reduction, lib.guarded_kempe_reduction_new, context.pointer, path_of(mesh), given)
    del keep
    return made
