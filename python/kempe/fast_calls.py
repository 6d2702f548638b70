# SPDX-License-Identifier: BSD-3-Clause
"""The module kempe._calls: evaluation at one state with little overhead. It is in the file of kempe._native."""

from __future__ import annotations

import importlib.util
import sys
from importlib.machinery import ExtensionFileLoader
from typing import Any

from . import _native


def _load() -> Any:
    name = "kempe._calls"
    if name not in sys.modules:
        spec = importlib.util.spec_from_loader(name, ExtensionFileLoader(name, str(_native.__file__)))
        assert spec is not None and spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


calls: Any = _load()
