#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A table of contacts beside the reference of the benchmark, as Markdown: tabulate_manchester.py TABLE.csv

TABLE.csv is what `kempe contact manchester.yaml --sweep "shift=0:10 mm:21" --law fastsim1 -o TABLE.csv` writes. With `--law
half-space` there is the table of pressures instead.
"""
import csv
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
REMARKS = {("L", 0): "two lobes", ("R", 0): "two lobes", ("R", 1): "two lobes", ("R", 10): "two places",  # half millimetres
           ("L", 1): "egg"}


def rows(path):
    with open(path, newline="") as file:
        yield from csv.DictReader(line for line in file if not line.startswith("#"))


def key(row):
    return row["wheel"], round(float(row["shift"]) * 2000)


def number(row, *names):
    values = [float(row[name]) for name in names]
    return values[0] if len(values) == 1 else values


def off(value, wanted):
    """Sizes, in parts of the wanted one, and how far the vectors are apart."""
    size = math.hypot(*wanted)
    return math.hypot(*value) / size - 1, math.dist(value, wanted) / size


def pressures(table, reference):
    """Pressures beside those of the reference, their errors, and creep forces of the same grid."""
    print("| wheel, shift mm | pressure, MPa | area, mm2 | approach, um | creep force, half-space: size, vector | |")
    print("|---|---|---|---|---|---|")
    for name in sorted(table):
        row, wanted, cells = table[name], reference[name], []
        for column, unit in (("pressure", 1e6), ("area", 1e-6), ("approach", 1e-6)):
            value, given = number(row, column), number(wanted, column)
            cells.append(f"{value / unit:.4g} ({value / given - 1:+.1%})")
        size, vector = off(number(row, "by_law.x", "by_law.y"), number(wanted, "force.x", "force.y"))
        print(f"| {name[0]} {name[1] / 2:g} | {' | '.join(cells)} | {size:+.1%}, {vector:.1%} | {REMARKS.get(name, '')} |")


def main():
    reference = {key(row): row for row in rows(HERE / "reference.csv")}
    table = {}
    for row in rows(sys.argv[1]):
        if row["touches"] == "1" and (key(row) not in table or number(table[key(row)], "normal") < number(row, "normal")):
            table[key(row)] = row
    if any("pressure" in row for row in table.values()):
        pressures(table, reference)
        return
    print("| wheel, shift mm | y off, mm | angle | N | creep force, shen: size, vector | fastsim1: size, vector | |")
    print("|---|---|---|---|---|---|---|")
    for name in sorted(table):
        row, wanted = table[name], reference[name]
        force = [number(wanted, "force.x"), number(wanted, "force.y")]
        own, law = off(number(row, "force.x", "force.y"), force), off(number(row, "by_law.x", "by_law.y"), force)
        print(f"| {name[0]} {name[1] / 2:g} | {1e3 * (number(row, 'y') - number(wanted, 'y')):+.3f} "
              f"| {number(row, 'angle') / number(wanted, 'angle') - 1:+.1%} "
              f"| {number(row, 'normal') / number(wanted, 'normal') - 1:+.1%} "
              f"| {own[0]:+.1%}, {own[1]:.1%} | {law[0]:+.1%}, {law[1]:.1%} | {REMARKS.get(name, '')} |")


if __name__ == "__main__":
    main()
