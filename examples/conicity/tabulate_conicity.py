#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Cases E1 to E9 of EN 15302 beside its reference values: tabulate_conicity.py KEMPE [POINTS ..]

KEMPE: the command. POINTS: places of the wheelset from -9 to 9 mm (181, 0.1 mm apart, without it); a table for each.
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
# Left and right wheel, left radius in mm; the right one is 460 mm.
CASES = {"E1": ("a", "a", 460), "E2": ("b", "b", 460), "E3": ("h", "h", 460), "E4": ("i", "i", 460), "E5": ("a", "a", 459),
         "E6": ("b", "b", 459), "E7": ("h", "h", 459), "E8": ("i", "i", 459), "E9": ("b", "a", 460)}


def conicities(kempe, points, left, right, radius):
    """Conicity by amplitude in tenths of a millimetre."""
    lines = (HERE / "conicity.yaml").read_text().replace("csv: ", f"csv: {HERE}/").splitlines(keepends=True)
    change = {"  left: {csv": ("wheel_a", f"wheel_{left}"), "  right: {csv": ("wheel_a", f"wheel_{right}")}
    text = "".join(next((line.replace(*words) for begin, words in change.items() if line.startswith(begin)), line) for line in lines)
    with tempfile.TemporaryDirectory() as folder:
        model = pathlib.Path(folder, "case.yaml")
        model.write_text(text)
        said = subprocess.run([kempe, "contact", model, "--sweep", f"shift=-9 mm:9 mm:{points}", "--conicity", "1 mm:7 mm:61",
                               "--set", f"left_radius={radius} mm", "--json", "-"], check=True, capture_output=True, text=True).stdout
    return {round(row["amplitude"] * 1e4): row["conicity"] for row in json.loads(said)["conicity"]["rows"]}


def tabulate(kempe, points, reference):
    amplitudes = range(10, 71, 10)
    print(f"\n{points} places:\n\n| case | {' | '.join(f'{a / 10:g} mm' for a in amplitudes)} | deviation | of tolerance | out | of limits |")
    print(f"|---|{'--:|' * (len(amplitudes) + 4)}")
    for case, (left, right, radius) in CASES.items():
        found = conicities(kempe, points, left, right, radius)
        worst, part, out, beyond = 0, 0, [], 0
        for a, row in reference.items():
            wanted, low, high = (float(row[case + end]) for end in ("", ".low", ".high"))
            off, tolerance = abs(found[a] - wanted), min(0.05, 0.5 * wanted) or 0.01
            worst, part = max(worst, off), max(part, off / tolerance)
            out += [f"{a / 10:g}"] if off > tolerance + 0.0005 else []
            beyond += not low - 0.0005 <= found[a] <= high + 0.0005
        cells = [f"{found[a]:.3f} ({reference[a][case]})" for a in amplitudes]
        print(f"| {case} | {' | '.join(cells)} | {worst:.4f} | {part:.2f} | {', '.join(out) or '-'} | {beyond or '-'} |")


def main():
    with open(HERE / "published.csv", newline="") as file:
        reference = {round(float(row["amplitude"]) * 10): row for row in csv.DictReader(line for line in file if line[0] != "#")}
    print("Equivalent conicity from 1 to 7 mm (reference in brackets). Over all amplitudes, 0.1 mm apart: the largest deviation, also as\n"
          "a part of the tolerance; the amplitudes out of the tolerance; the number out of the limits that include errors of the grid.")
    for points in sys.argv[2:] or [181]:
        tabulate(sys.argv[1], int(points), reference)


if __name__ == "__main__":
    main()
