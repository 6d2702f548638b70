#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws critical speeds of the coach, hunting, wheel loads over a dip and Y/Q in a curve, all from runs of Kempe.

    python3 draw_manchester_vehicle.py ../../build/release/kempe > manchester_vehicle.svg
"""
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent))
from panels import BLUE, GREEN, PLUM, RED, Panel, page, rows  # noqa: E402

WIDTH, HIGH, LEFT, GAP = 620, 120, 56, 62
GREY = "#666"


def run(kempe, model, *words):
    with tempfile.TemporaryDirectory() as folder:
        table = f"{folder}/rows.csv"
        subprocess.run([kempe, "simulate", HERE / model, "--no-convergence-check", "-o", table, *words], check=True, capture_output=True)
        return rows(table)


def critical(kempe, model, *words):
    """The lowest critical speed of a sweep."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "modes.json"
        subprocess.run([kempe, "modes", HERE / model, "--sweep", "speed=60:95:8", *words, "--json", path], check=True, capture_output=True)
        return min(c["value"] for c in json.loads(path.read_text())["locus"]["critical"])


def aside(row):
    """Displacement of the first axle to the left, mm."""
    return 1e3 * (row["q.y"] + row["q.front_y"] + row["q.front_lead_y"] + 10.78 * row["q.yaw"] + 1.28 * row["q.front_yaw"])


def dot(panel, s, v, colour, name, to=9):
    x, y = panel.x(s), panel.y(v)
    panel.lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>'
                       f'<text x="{x + to:.1f}" y="{y + 4:.1f}" fill="{colour}">{name}</text>')


def main(kempe):
    top = lambda k: GAP - 30 + k * (HIGH + GAP)
    speeds = Panel(LEFT, top(0), WIDTH, HIGH, (0, 0.45), (60, 70, 80, 90))
    speeds.frame("critical speed over the slope of conical wheels, m/s")
    slopes = [k / 20 for k in range(1, 9)]
    speeds.curve([(row["cone"], row["speed"]) for row in rows(HERE / "reference.csv")[:8]], GREY, "reference", 60)
    for slope in slopes:
        dot(speeds, slope, critical(kempe, "manchester_vehicle_cones.yaml", "--set", f"cone={slope}"), BLUE, "")
    speeds.lines.append(f'<text x="{LEFT + WIDTH + 8}" y="{top(0) + 44}" fill="{BLUE}">kempe modes</text>')
    dot(speeds, 0.2388, critical(kempe, "manchester_vehicle.yaml"), RED, "S1002 on UIC 60", 9)
    speeds.axis(slopes[1::2], "slope", 8)

    hunting = Panel(LEFT, top(1), WIDTH, HIGH, (0, 8), (-6, -3, 0, 3, 6))
    hunting.frame("first axle to the left, from 3 mm, S1002 on UIC 60, mm")
    for k, (speed, colour) in enumerate(((80, PLUM), (72, RED), (66, BLUE))):
        table = run(kempe, "manchester_vehicle.yaml", "--set", f"speed={speed}", "--set", "aside=0.003", "--t-end", "8", "--output-step", "0.01")
        hunting.curve([(row["t"], aside(row)) for row in table], colour, f"{speed} m/s", 14 + 16 * k, 1.2)
    hunting.axis(range(0, 9, 2), "t, s", 14)

    dip = Panel(LEFT, top(2), WIDTH, HIGH, (0.55, 1.35), (40, 50, 60, 70, 80))
    dip.frame("wheel loads over a dip of 3 mm at 45 m/s, kN")
    table = run(kempe, "manchester_vehicle_faults.yaml", "--set", "offset=0", "--set", "depth=0.003", "--t-end", "1.35", "--output-step", "0.001")
    for k, colour in enumerate((BLUE, RED, GREEN, PLUM)):
        dip.curve([(row["t"], row[f"guidance.L{k + 1}.Q"] / 1e3) for row in table if row["t"] >= 0.55], colour, f"axle {k + 1}", 14 + 16 * k, 1.2)
    dip.axis((0.6, 0.8, 1.0, 1.2), "t, s", 8)

    curve = Panel(LEFT, top(3), WIDTH, HIGH, (0, 10), (-0.1, 0, 0.1, 0.2, 0.3, 0.4))
    curve.frame("Y/Q in a left curve of 500 m at 25 m/s, Y outwards")
    table = run(kempe, "manchester_vehicle_curve.yaml")
    for k, (wheel, colour) in enumerate((("L1", BLUE), ("R1", RED), ("L2", GREEN), ("R2", PLUM))):
        curve.curve([(row["t"], row[f"guidance.{wheel}.YQ"]) for row in table if row["t"] > 0.1], colour, wheel, 14 + 16 * k, 1.2)
    curve.axis(range(0, 11, 2), "t, s", 14)
    page(LEFT + WIDTH + 90, top(3) + HIGH + 30, [speeds, hunting, dip, curve])


if __name__ == "__main__":
    main(sys.argv[1])
