#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv, wheelset.csv and approximations.csv: figures of CONTACT's own outputs for the benchmark, in the signs
used here.

    python3 reference_manchester.py CONTACT > reference.csv
    python3 reference_manchester.py CONTACT wheelset > wheelset.csv
    python3 reference_manchester.py CONTACT approximations > approximations.csv

CONTACT: the folder `examples` of https://github.com/eve70a/CONTACT with mbench_a22_left.ref_out and
mbench_a22_right.ref_out, mbench_a22_left.inp, whose roll and rates have all digits, and mbench_a22_kpec.ref_out.
"""
import pathlib
import re
import sys

FIGURES = ("y", "angle", "normal", "slip.x", "slip.y", "spin", "force.x", "force.y", "pressure", "area", "approach")
ELEMENT = 0.2 * 0.2  # mm^2, of the grid: an area is a number of elements


def after(text, *names):
    """Numbers of the line below the one that has these names."""
    line = re.search(r"^ *" + r" +".join(map(re.escape, names)) + r".*\n(.*)$", text, re.M).group(1)
    return [float(x.rstrip(".")) for x in line.split()]


def contact(case):
    x, y, _, angle = after(case, "XCP(TR)", "YCP(TR)")[:4]
    creep = after(case, "CHI", "DQ")[3:6]
    normal, fx, fs = after(case, "FN", "FX", "FS")[:3]
    approach, pressure = after(case, "FN/G", "FX/FSTAT/FN")[3:5]
    patch = 1e6 * pressure, 1e-6 * after(case, "NPOT", "NCON")[1] * ELEMENT, 1e-3 * approach
    return abs(y) / 1000, abs(angle), normal, -creep[0], creep[1], 1000 * creep[2], -fx, fs, *patch


def contacts(path, wheel):
    for case in re.split(r"^ Case ", path.read_text(), flags=re.M)[1:]:
        yield [f"{abs(after(case, 'S_WS', 'Y_WS')[1]) / 1000:g}", wheel, *(f"{x:.8g}" for x in contact(case))]


def approximations(path):
    """Pressure, area and approach on the right by the approximations that CONTACT has."""
    for case in re.split(r"^ Case ", path.read_text(), flags=re.M)[1:]:
        method = re.search(r"APPROXIMATE (\w+) SOLUTION", case)
        if method:
            shift = f"{abs(after(case, 'S_WS', 'Y_WS')[1]) / 1000:g}"
            yield [shift, method.group(1).lower(), *(f"{x:.8g}" for x in contact(case)[-3:])]


def wheelsets(path):
    for place, rates in re.findall(r"^(.*) S, Y, FZ, ROLL.*\n(.*) VS,VY,VZ", path.read_text(), re.M):
        yield [f"{float(place.split()[1]) / 1000:g}", f"{float(place.split()[3]):.8g}", f"{-float(rates.split()[5]):.8g}"]


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1])
    print("# Manchester contact benchmark, case A-2.2, as CONTACT has it: figures of its example, by reference_manchester.py.")
    if sys.argv[2:] == ["wheelset"]:
        print("shift,roll,rate")
        table = wheelsets(folder / "mbench_a22_left.inp")
    elif sys.argv[2:] == ["approximations"]:
        print("# The right wheel; areas are counted in elements of 0.2 mm by 0.2 mm.")
        print("shift,method,pressure,area,approach")
        table = approximations(folder / "mbench_a22_kpec.ref_out")
    else:
        print("# Areas are counted in elements of 0.2 mm by 0.2 mm.")
        print(f"shift,wheel,{','.join(FIGURES)}")
        table = sorted((row for side in ("left", "right") for row in contacts(folder / f"mbench_a22_{side}.ref_out", side[0].upper())),
                       key=lambda row: (float(row[0]), row[1]))
    for row in table:
        print(",".join(row))
