#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the table of docs/elements.md, and a section for each element, from the files of the folder elements.

    python3 docs/elements_page.py            writes them
    python3 docs/elements_page.py --check    fails when they differ
"""
import pathlib
import re
import sys

import generated

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/elements.md"
MARK = re.compile(r"<!-- elements -->\n.*?<!-- /table -->", re.S)
EQUATIONS = re.compile(r"<!-- equations -->\n.*?<!-- /equations -->", re.S)


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


def section(path):
    """Head and parameters of an element."""
    text = path.read_text()
    name = re.search(r"^name: (.*)$", text, re.M).group(1)
    head = re.match(r"kempe: 1\n((?:#.*\n)+)", text).group(1)
    block = re.search(r"^parameters:\n((?:  .*\n)+)", text, re.M)
    lines = [line[1:].strip() and line[2:] for line in head.splitlines()] + ["", *(block.group(0).splitlines() if block else [])]
    return "\n".join([f"### {name[0].upper()}{name[1:]}", "", *(f"    {line}".rstrip() for line in lines)]).rstrip() + "\n"


def page():
    files = sorted((ROOT / "elements").glob("*.yaml"))
    rows = [row(path) for path in files]
    table = "\n".join(["| file | element | ports | parameters | sensors |", "|---|---|---|---|---|", *rows])
    sections = "\n".join(section(path) for path in files)
    text = MARK.sub(lambda _: f"<!-- elements -->\n{table}\n<!-- /table -->", PAGE.read_text())
    return EQUATIONS.sub(lambda _: f"<!-- equations -->\n{sections}\n<!-- /equations -->", text)


def main(arguments):
    return generated.settle({PAGE: page()}, "python3 docs/elements_page.py", arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
