# SPDX-License-Identifier: BSD-3-Clause
"""The C compiler as tests use it for code that Kempe writes."""
import pathlib

CC_ONCE = pathlib.Path(__file__).resolve().parent / "cc_once"


def quick_compiler(folder):
    """The path of a C compiler without optimisation, which takes four fifths of its time. Sources that are compiled with it several
    times, such as those that all units have, are compiled once; their objects are in `folder`."""
    script = pathlib.Path(folder) / "quick_cc"
    if not script.exists():
        script.write_text(f'#!/bin/sh\nexec {CC_ONCE} {folder} cc "$@" -O0\n')
        script.chmod(0o755)
    return script
