#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the table of docs/elements.md from the files of the folder elements.

    python3 docs/elements_page.py            writes the table
    python3 docs/elements_page.py --check    fails when it differs
"""
import pathlib
import re
import sys

import generated

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/elements.md"
MARK = re.compile(r"<!-- elements -->\n.*?<!-- /table -->", re.S)


def keys(text, section):
    """Names of the entries of a section that is written one a line."""
    block = re.search(rf"^{section}:\n((?:  .*\n)+)", text, re.M)
    return re.findall(r"^  (\w+):", block.group(1), re.M) if block else []


def row(path):
    text = path.read_text()
    name = re.search(r"^name: (.*)$", text, re.M).group(1)
    ports = re.search(r"^ports: \{(.*)\}$", text, re.M).group(1)
    code = lambda words: ", ".join(f"`{word}`" for word in words)
    return f"| `{path.name}` | {name} | `{ports}` | {code(keys(text, 'parameters'))} | {code(keys(text, 'sensors'))} |"


def page():
    rows = [row(path) for path in sorted((ROOT / "elements").glob("*.yaml"))]
    table = "\n".join(["| file | element | ports | parameters | sensors |", "|---|---|---|---|---|", *rows])
    return MARK.sub(lambda _: f"<!-- elements -->\n{table}\n<!-- /table -->", PAGE.read_text())


def main(arguments):
    return generated.settle({PAGE: page()}, "python3 docs/elements_page.py", arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
