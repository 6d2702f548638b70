# SPDX-License-Identifier: BSD-3-Clause
"""Versions, libraries and licences of this installation."""

from __future__ import annotations

import sys
from typing import Any

from ._native import lib
from .context import string
from .lazy import np


def about() -> dict[str, Any]:
    """Versions, the back end that runs here, solvers. `libraries`: files of the library and of what was bundled with it.
    `license`: the license of the package with the libraries of this build; `licenses`: texts by file name."""
    import importlib.metadata
    import pathlib

    package = pathlib.Path(__file__).parent
    bundled = package.parent / "kempe.libs"
    files = [*package.glob("_native*"), *(bundled.glob("*") if bundled.is_dir() else ())]
    try:
        record = importlib.metadata.files("kempe") or []
    except importlib.metadata.PackageNotFoundError:  # in a build folder
        record = []
    solvers = string(lib.python_linear_solvers()).split()
    searches = string(lib.python_searches()).split()
    licenses = {
        "BSD-3-Clause": True,  # Kempe, SUNDIALS, LAPACK
        "BSD-2-Clause": True,  # headers of the FMI
        "LGPL-2.1-or-later": True,  # KLU, and parts of NLopt
        "GPL-2.0-or-later": "umfpack" in solvers,
        "MIT": "nlopt" in searches,
        "Minpack": "cminpack" in searches,
    }
    return {
        "kempe": string(lib.kempe_version()),
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "cffi": importlib.metadata.version("cffi"),
        "sundials": string(lib.python_sundials()),
        "klu": string(lib.python_klu()),
        "backend": string(lib.python_backend()),
        "integrators": string(lib.python_integrators()).split(),
        "linear_solvers": solvers,
        "searches": searches,
        "license": " AND ".join(name for name, holds in licenses.items() if holds),
        "libraries": sorted(file.name for file in files if ".so" in file.name or file.suffix == ".pyd"),
        "licenses": {file.name: file.read_text() for file in record if "licenses" in file.parts},
    }
