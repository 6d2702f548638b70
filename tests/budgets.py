#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/decisions/budgets.md against the sources: every bound of the page exists in its file, and every bound of the
integrators is on the page.

    python3 tests/budgets.py
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROW = re.compile(r"^\| ([\w/.]+) \| ([A-Z_]+) \| (.+) \|$")
BOUND = re.compile(r"\b((?:MOST|MAX)(?:_[A-Z]+)*) = ")


def main():
    wrong, rows = [], {}
    for line in (ROOT / "docs/decisions/budgets.md").read_text().splitlines():
        found = ROW.match(line)
        if not found:
            continue
        name, bound, _ = found.groups()
        rows.setdefault(name, set()).add(bound)
        path = ROOT / name
        if not path.is_file():
            wrong.append(f"docs/decisions/budgets.md: there is no file {name}")
        elif not re.search(rf"\b{bound}\b(?: = | \d)", path.read_text()):
            wrong.append(f"docs/decisions/budgets.md: {name} has no bound {bound}")
    for path in sorted((ROOT / "integrators").rglob("*.[ch]")):
        name = str(path.relative_to(ROOT))
        for bound in sorted(set(BOUND.findall(path.read_text())) - rows.get(name, set())):
            wrong.append(f"{name}: the bound {bound} is not in docs/decisions/budgets.md: say there what happens at it")
    print("\n".join(wrong) if wrong else f"{sum(map(len, rows.values()))} bounds, each with what happens at it")
    return 1 if wrong or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
