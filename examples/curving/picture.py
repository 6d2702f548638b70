#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what a run of curving.yaml gave: lateral shift, wheel loads and Y/Q over the way.

    kempe simulate curving.yaml --once -o curving.csv && python3 picture.py curving.csv > curving.svg
"""
import csv
import sys

WIDTH, HIGH, LEFT, GAP = 640, 130, 56, 34
COLOUR = {"FL": "#0072b2", "FR": "#d55e00", "RL": "#56b4e9", "RR": "#e69f00", "front": "#009e73", "rear": "#cc79a7"}
WAY = (5, 125)
BENDS = (20, 50)  # where the transition begins and ends


def rows(path):
    with open(path, newline="") as file:
        return [{key: float(x) for key, x in row.items()} for row in csv.DictReader(line for line in file if line[0] != "#")]


def shift(row, axle):
    """Of the axle's middle, outwards in a left curve, mm: of the right wheel on its rail."""
    return 1e3 * (row[f"contact.{axle}R.1.y"] - row[f"contact.{axle}R.1.s"] - 0.75)


def panel(top, title, ticks, curves):
    low, high = ticks[0], ticks[-1]
    x = lambda s: LEFT + (s - WAY[0]) / (WAY[1] - WAY[0]) * WIDTH
    y = lambda v: top + HIGH * (high - v) / (high - low)
    out = [f'<text x="{LEFT}" y="{top - 8}" font-weight="bold">{title}</text>']
    for v in ticks:
        out.append(f'<path d="M{LEFT},{y(v):.1f}h{WIDTH}" stroke="#999" stroke-width="0.5"/><text x="{LEFT - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:g}</text>')
    for s in BENDS:
        out.append(f'<path d="M{x(s):.1f},{top}v{HIGH}" stroke="#999" stroke-dasharray="3 3"/>')
    for k, (name, points) in enumerate(curves):
        way = "L".join(f"{x(s):.1f},{y(min(max(v, low), high)):.1f}" for s, v in points if s <= WAY[1])
        out.append(f'<path d="M{way}" fill="none" stroke="{COLOUR[name]}" stroke-width="1.6"/>'
                   f'<text x="{LEFT + WIDTH + 8}" y="{top + 14 + 16 * k}" fill="{COLOUR[name]}">{name}</text>')
    return out


def main(path):
    table = [row for row in rows(path) if row["t"] > 0.1]
    over = lambda value: [(row["q.x"], value(row)) for row in table]
    wheels = ("FL", "FR", "RL", "RR")
    panels = (("shift of the axles, outwards, mm", (-8, -4, 0, 4, 8), [(name, over(lambda r, a=name[0].upper(): shift(r, a))) for name in ("front", "rear")]),
              ("Q, wheel loads, kN", (30, 40, 50, 60, 70, 80), [(w, over(lambda r, w=w: r[f"force.{w}.z"] / 1e3)) for w in wheels]),
              ("Y/Q, Y to the left", (-0.4, -0.2, 0, 0.2, 0.4), [(w, over(lambda r, w=w: r[f"force.{w}.y"] / r[f"force.{w}.z"])) for w in wheels]))
    lines, top = [], GAP
    for title, ticks, curves in panels:
        lines += panel(top, title, ticks, curves)
        top += HIGH + GAP
    for s in range(20, WAY[1], 20):
        lines.append(f'<text x="{LEFT + (s - WAY[0]) / (WAY[1] - WAY[0]) * WIDTH:.1f}" y="{top - GAP + 16}" text-anchor="middle">{s}</text>')
    lines.append(f'<text x="{LEFT + WIDTH + 8}" y="{top - GAP + 16}">x, m</text>')
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + WIDTH + 60} {top}" font-family="sans-serif" font-size="12">'
          '<rect width="100%" height="100%" fill="#fff"/>')
    print("\n".join(lines) + "\n</svg>")


if __name__ == "__main__":
    main(sys.argv[1])
