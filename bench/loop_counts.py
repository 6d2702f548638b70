#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Operations of a right-hand side over the size of mechanisms with loops, by each algorithm: Fig. 5 of Fisette and Samin 1996, which
counts trees, for closed loops.

    bench/loop_counts.py BENCH [csv]

BENCH: build/release/bench/bench, whose study `algorithms` counts. Chains of N links (no loop), lifts of N scissor cells, N windows beside
each other, N four-bars in a row, each on the coupler of the one before, and trams of N cars with their bogies, wheels and rails. Counts are
+ - * / of the equations and of what is solved with their values. N* is where an algorithm begins to take fewer operations than another one,
for good. csv: every size, for bench/draw_counts.py."""
import csv
import math
import pathlib
import subprocess
import sys
import tempfile

import long_runs

ROOT = pathlib.Path(__file__).resolve().parents[1]
ALGORITHMS = ("ner", "composite", "products", "articulated")
SIZES = [*range(1, 21), *range(22, 41, 2), *range(45, 101, 5)]
SHOWN = (1, 2, 3, 5, 8, 12, 20, 30, 50, 100)
PAIRS = (("ner", "articulated"), ("composite", "articulated"), ("composite", "products"), ("products", "articulated"))


def windows(n):
    return subprocess.run([sys.argv[1], "model_text", "windows", str(n)], capture_output=True, text=True, check=True).stdout


def meet(a, b, r, s):
    """The common point of circles of radii r about a and s about b, to the left of the way from a to b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    d = math.hypot(dx, dy)
    along = (d * d + r * r - s * s) / (2 * d)
    up = math.sqrt(r * r - along * along)
    return a[0] + (along * dx - up * dy) / d, a[1] + (along * dy + up * dx) / d


def legs(n):
    """A unit stands with its crank and rocker on the coupler of the one before; all have the same shape at the start."""
    base, crank, coupler, rocker, angle = 1.2, 0.4, 1.1, 0.9, 1.0
    a = crank * math.cos(angle), crank * math.sin(angle)
    c = meet(a, (base, 0), coupler, rocker)
    to = math.atan2(c[1] - a[1], c[0] - a[0])
    turn = math.atan2(c[1], c[0] - base)
    text = f"kempe: 1\nname: legs\ngravity: [0, -9.81, 0]\nground: {{points: {{O: [0, 0, 0], R: [{base}, 0, 0]}}}}\nbodies:\n"
    start = []
    for i in range(n):
        on = f"b{i - 1}" if i else "ground"
        for name, at, length in (("a", f"{on}.O", crank), ("b", f"a{i}.T", coupler), ("c", f"{on}.R", rocker)):
            points = f"T: [{length}, 0, 0]" + (f", O: [0, 0, 0], R: [{base}, 0, 0]" if name == "b" else "")
            text += (f"  {name}{i}: {{joint: {{name: {name}{i}, revolute: z, at: {at}}}, mass: {length}, com: [{length / 2}, 0, 0], "
                     f"inertia: {{zz: {length**3 / 12:.17g}}}, points: {{{points}}}}}\n")
        start += [f"a{i}: {angle}", f"b{i}: {to - angle:.17g}", f"c{i}: {turn:.17g}"]
    text += "loops:\n" + "".join(f"  k{i}: {{ball: [b{i}.T, c{i}.T]}}\n" for i in range(n))
    return text + "start:\n  q: {" + ", ".join(start) + "}\n"


def trams(n):
    """Cars as the outer ones of examples/tram, each on a bogie in its middle, joined by articulations, on straight track."""
    folder = ROOT / "examples"
    text = (f"kempe: 1\nname: trams\ngravity: [0, 0, -9.81]\nprofiles:\n  cone: {{csv: {folder}/profiles/cone20.csv, y: y, z: z}}\n"
            f"  UIC60: {{csv: {folder}/profiles/uic60.csv, y: y, z: z}}\ntracks:\n"
            "  line: {at: ground.O, rail: UIC60, gauge: 1435 mm, inclination: 1/40, course: [{straight: 1000}]}\n"
            "ground: {points: {O: [0, 0, 0]}}\ninclude:\n")
    for i in range(n):
        text += f"  - {{file: {folder}/tram/motor_bogie.yaml, prefix: c{i}_, at: ground, offset: [{-7.6 * i:.17g}, 0, 0]}}\n"
    text += "bodies:\n"
    for i in range(n):
        text += (f"  c{i}_car: {{joint: {{universal: [z, y], coordinates: [c{i}_car_yaw, c{i}_car_pitch], at: c{i}_traverse}}, mass: 8500, com: [0, 0, 0.93], "
                 "inertia: {xx: 9000, yy: 45000, zz: 43000}, points: {front: [3.8, 0, 0], rear: [-3.8, 0, 0]}}\n")
    if n > 1:
        text += "loops:\n" + "".join(f"  k{i}: {{ball: [c{i}_car.rear, c{i + 1}_car.front]}}\n" for i in range(n - 1))
    text += "wheels:\n"
    for i in range(n):
        for wheel, side, radius in (("FL", "left", 320), ("FR", "right", 320), ("RL", "left", 187.5), ("RR", "right", 187.5)):
            text += f"  c{i}_{wheel}: {{on: line.{side}, at: c{i}_W{wheel}.hub, profile: cone, radius: {radius} mm, damping: 5 s/m}}\n"
    text += "forces:\n"
    for i in range(n):
        for axis, stiffness, damping in (("pitch", 500000, 50000), ("yaw", 120000, 25000)):
            text += f"  c{i}_{axis}: {{joint: c{i}_car_{axis}, spring: {{stiffness: {stiffness}, damping: {damping}}}}}\n"
    return text


FAMILIES = {"chain": (long_runs.chain, SIZES), "scissors": (long_runs.scissors, SIZES), "windows": (windows, SIZES),
            "legs": (legs, SIZES), "trams": (trams, range(1, 13))}


def count(bench, family):
    """Rows of the study, with the size first."""
    make, sizes = FAMILIES[family]
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for n in sizes:
            paths.append(pathlib.Path(folder) / f"{n}.yaml")
            paths[-1].write_text(make(n))
        done = subprocess.run([bench, "algorithms", *paths], stdout=subprocess.PIPE, text=True, check=True)
    return [{"family": family, "N": n, **row} for n, row in zip(sizes, csv.DictReader(done.stdout.splitlines()))]


def total(row, algorithm):
    """None: the algorithm is impossible."""
    return int(row[algorithm]) if row[algorithm] else None


def break_even(rows, before, after):
    """The size from which the second takes fewer operations than the first, for good; None: it never does."""
    found = None
    for row in reversed(rows):
        a, b = total(row, before), total(row, after)
        if a is None or b is None or b >= a:
            break
        found = int(row["N"])
    return found


def exponent(rows, algorithm):
    """Of the growth over the second half of the sizes."""
    first, last = rows[len(rows) // 2], rows[-1]
    a, b = total(first, algorithm), total(last, algorithm)
    return f"{math.log(b / a) / math.log(int(last['N']) / int(first['N'])):.2f}" if a and b else "-"


def put_family(family, rows):
    print(f"\n{family}\n{'N':>5} {'n':>5} {'m':>5} {'free':>4} " + "".join(f" | {a:>11}" for a in ALGORITHMS) + " | auto takes")
    for row in rows:
        if int(row["N"]) in SHOWN or row is rows[-1]:
            counts = [total(row, a) for a in ALGORITHMS]
            print(f"{row['N']:>5} {row['n']:>5} {row['m']:>5} {int(row['n']) - int(row['m']):>4} " +
                  "".join(f" | {'-' if c is None else c:>11}" for c in counts) + f" | {row['auto']}")
    print(f"{'exponent of growth':>22} " + "".join(f" | {exponent(rows, a):>11}" for a in ALGORITHMS))


def main():
    rows = {family: count(sys.argv[1], family) for family in FAMILIES}
    if sys.argv[2:] == ["csv"]:
        writer = csv.DictWriter(sys.stdout, rows["chain"][0].keys(), lineterminator="\n")
        writer.writeheader()
        for of_family in rows.values():
            writer.writerows(of_family)
        return
    print("operations + - * / of a right-hand side; n coordinates, m rows of closures")
    for family, of_family in rows.items():
        put_family(family, of_family)
    print("\nN*: from this size on the second takes fewer operations than the first\n" + " " * 26 + "".join(f" {f:>9}" for f in rows))
    for before, after in PAIRS:
        stars = [(break_even(r, before, after), r[-1]["N"]) for r in rows.values()]
        print(f"  {before + ', ' + after:24}" + "".join(f" {f'> {most}' if star is None else star:>9}" for star, most in stars))


if __name__ == "__main__":
    main()
