# SPDX-License-Identifier: BSD-3-Clause
"""NumPy, loaded when something of it is first used: it takes two thirds of the time of importing Kempe."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import TYPE_CHECKING, Any

__all__ = ["np"]


class _Module(ModuleType):
    """A module that is imported with its first attribute. Attributes are kept, so that later ones cost nothing more."""

    def __getattr__(self, name: str) -> Any:
        value = getattr(importlib.import_module(self.__name__), name)
        setattr(self, name, value)
        return value


if TYPE_CHECKING:
    import numpy as np
else:
    np = _Module("numpy")
