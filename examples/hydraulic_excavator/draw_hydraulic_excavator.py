# SPDX-License-Identifier: BSD-3-Clause
"""Draws angles, commands and pressures of the excavator over time, from a table of Kempe's:

    kempe simulate examples/hydraulic_excavator/hydraulic_excavator.yaml -o run.csv
    python3 examples/hydraulic_excavator/draw_hydraulic_excavator.py run.csv > examples/hydraulic_excavator/pressures.svg
"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import panels

COLOURS = {"boom": panels.BLUE, "stick": panels.RED, "bucket": panels.GREEN}


def wanted(t, start, end):
    s = min(1, max(0, (t - 0.1) / 0.8))
    return start + (end - start) * s * s * (3 - 2 * s)


def main():
    rows = panels.rows(sys.argv[1])
    times, span = [row["t"] for row in rows], (0, 1.2)
    angle = panels.Panel(60, 30, 420, 150, span, [-100, -50, 0, 50])
    command = panels.Panel(60, 220, 420, 100, span, [-1, 0, 1])
    pressure = panels.Panel(60, 360, 420, 170, span, [0, 5, 10, 15, 20])
    angle.frame("angles, deg; dashed: wanted")
    command.frame("commands of the controller")
    pressure.frame("pressures, MPa; thin: side of the rod")
    for k, (name, (start, end)) in enumerate({"boom": (25, 35), "stick": (-95, -75), "bucket": (-60, -90)}.items()):
        colour, down = COLOURS[name], 20 + 20 * k
        angle.curve([(t, math.degrees(row[f"q.{name}"])) for t, row in zip(times, rows)], colour, name, down)
        points = " L".join(f"{angle.x(t):.1f},{angle.y(wanted(t, start, end)):.1f}" for t in times[::4])
        angle.lines.append(f'<path d="M{points}" fill="none" stroke="{colour}" stroke-dasharray="4 3"/>')
        held = [(t, row[f"state.{name}_command"]) for t, row in zip(times, rows)]
        command.curve([point for a, b in zip(held, held[1:]) for point in (a, (a[0], b[1]))], colour, name, down)
        pressure.curve([(t, row[f"state.{name}_a"] / 1e6) for t, row in zip(times, rows)], colour, name, down)
        pressure.curve([(t, row[f"state.{name}_b"] / 1e6) for t, row in zip(times, rows)], colour, "", down, thick=0.7)
    pressure.axis([0, 0.3, 0.6, 0.9, 1.2], "t, s", 24)
    panels.page(560, 560, [angle, command, pressure])


main()
