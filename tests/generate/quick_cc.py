# SPDX-License-Identifier: BSD-3-Clause
"""C compilers as tests use them for code that Kempe writes."""
import os
import pathlib
import shutil

CC_ONCE = pathlib.Path(__file__).resolve().parent / "cc_once"


def quick_compiler(folder):
    """The path of a C compiler without optimisation, which takes four fifths of its time. Sources that are compiled with it several
    times, such as those that all units have, are compiled once; their objects are in `folder`."""
    script = pathlib.Path(folder) / "quick_cc"
    if not script.exists():
        script.write_text(f'#!/bin/sh\nexec {CC_ONCE} {folder} cc "$@" -O0\n')
        script.chmod(0o755)
    return script


def quick_path(folder):
    """A PATH whose compilers for Linux and Windows are as quick_compiler's."""
    tools = pathlib.Path(folder) / "quick_compilers"
    tools.mkdir(exist_ok=True)
    for name in ("cc", "x86_64-linux-gnu-gcc", "x86_64-w64-mingw32-gcc"):
        script, compiler = tools / name, shutil.which(name)
        if compiler and not script.exists():
            script.write_text(f'#!/bin/sh\nexec {CC_ONCE} {folder} {compiler} "$@" -O0\n')
            script.chmod(0o755)
    return f"{tools}{os.pathsep}{os.environ['PATH']}"
