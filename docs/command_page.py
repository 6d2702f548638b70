#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/commands.md from the help of the command, so that page and program cannot differ:

    python3 docs/command_page.py build/release/kempe            writes the page
    python3 docs/command_page.py build/release/kempe --check    fails when the page is another one
"""
import pathlib
import re
import subprocess
import sys

import generated

PAGE = pathlib.Path(__file__).with_name("commands.md")
HEAD = """# Commands

This page is generated from the help of the command (`python3 docs/command_page.py build/release/kempe`). A time or a number
with a dimension accepts a unit: `--t-end "20 ms"`. Every command accepts `--json PATH|-`, an object with all digits.

Errors and warnings are written to stderr. On a terminal they are coloured, unless the environment variable `NO_COLOR`
is set, and a progress line shows the rate and the time left. `--quiet` removes that line and the log. If
stdout is the same terminal, a sentence of the result is not repeated on stderr.

Derived equations are kept in `~/.cache/kempe`, or in `$XDG_CACHE_HOME/kempe`, and used again while the model, its
settings, the build and the processor are the same. Results are equal to the bit. The environment variable `KEMPE_CACHE`
names another folder; `KEMPE_CACHE=off` and `--no-cache` use none ([cache](decisions/cache.md)). The folder may be
removed at any time.
"""


def help_of(kempe, *words):
    return subprocess.run([kempe, *words, "--help"], capture_output=True, text=True, check=True).stdout


def commands(kempe):
    listed = re.search(r"^commands:\n(.*?)\n\n", help_of(kempe), re.M | re.S).group(1)
    return [line.split()[0] for line in listed.split("\n")]


def page(kempe):
    sections = [HEAD]
    for command in commands(kempe):
        text = help_of(kempe, command).rstrip("\n")
        title, rest = text.split("\n", 1)
        summary = title.split(": ", 1)[1]
        body = "\n".join(f"    {line}".rstrip() for line in rest.strip("\n").split("\n"))
        sections.append(f"## kempe {command}\n\n{summary[0].upper()}{summary[1:]}.\n\n{body}\n")
    codes = "exit codes: " + " ".join(help_of(kempe).split("\nexit codes: ")[1].split())
    sections.append(f"## Exit codes\n\n{codes[0].upper()}{codes[1:]}.\n")
    return "\n".join(sections)


def main(arguments):
    return generated.settle({PAGE: page(arguments[0])}, "python3 docs/command_page.py build/release/kempe", arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
