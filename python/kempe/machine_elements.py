# SPDX-License-Identifier: BSD-3-Clause
"""The library of machine elements."""

from __future__ import annotations

from ._native import lib
from .context import Context, string
from .options import utf8


def elements() -> tuple[str, ...]:
    """Names of the machine elements that models may include, such as "kempe:gas_spring.yaml"."""
    return tuple(string(lib.kempe_element_name(k)) for k in range(lib.kempe_element_count()))


def element_text(name: str) -> str:
    """The text of an element: its equations, ports and parameters. Raises FileError if the library has none of this name."""
    context = Context()
    return context.text(lib.kempe_element_text, context.pointer, utf8(name))
