#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what a run of tram.yaml gave: the cars from above, wheel loads and Y/Q of each bogie over time.

    kempe simulate tram.yaml --no-convergence-check -o tram.csv && python3 draw_tram.py tram.csv > tram.svg
"""
import math
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from panels import BLUE, BROWN, RED, TEAL, Panel, page, rows  # noqa: E402

WIDTH, HIGH, LEFT, GAP, COLUMN = 290, 120, 50, 34, 380
COLOUR = {"FL": BLUE, "FR": RED, "RL": TEAL, "RR": BROWN}
BOGIES = {"a": "first", "b": "second", "c": "third"}
SPEED, CAR, BROAD, PIVOT = 10, 7.6, 2.3, -0.765
BENDS = (10, 30)  # where the transition begins and ends
PLAN = 400
TIMES = (0, 3, 5.6)  # of the cars from above


def centre(row, k):
    """Of a car: x, y of its pivot, yaw; the bogie's roll, pitch and tilt are left aside."""
    p, yaw = "abc"[k], row[f"q.{'abc'[k]}_yaw"]
    return (row[f"q.{p}_x"] - k * CAR + PIVOT * math.cos(yaw), row[f"q.{p}_y"] + PIVOT * math.sin(yaw), yaw + row[f"q.{p}_car_yaw"])


def outline(row, k, place):
    x, y, yaw = centre(row, k)
    c, s = math.cos(yaw), math.sin(yaw)
    a, b = CAR / 2 - 0.15, BROAD / 2
    return "L".join("%.1f,%.1f" % place(x + c * u - s * v, y + s * u + c * v) for u, v in ((a, b), (a, -b), (-a, -b), (-a, b)))


def plan(table):
    """From above: the way of the first car, and the cars at some times."""
    scale = 9.6
    place = lambda x, y: (LEFT + (x + 19.5) * scale, PLAN - (y + 3) * scale)
    way = "L".join("%.1f,%.1f" % place(*centre(row, 0)[:2]) for row in table if row["t"] < 7)
    back = "%.1f,%.1f" % place(*centre(table[0], 2)[:2])
    out = [f'<path d="M{back}L{way}" fill="none" stroke="#999"/>']
    for t in TIMES:
        row = min(table, key=lambda r: abs(r["t"] - t))
        for k in range(3):
            out.append(f'<path d="M{outline(row, k, place)}Z" fill="{BLUE}" fill-opacity="{0.75 if k != 1 else 0.45}"/>')
        x, y, yaw = centre(row, 1)
        x, y = place(x + 2.5 * math.sin(yaw), y - 2.5 * math.cos(yaw))
        out.append(f'<text x="{x:.1f}" y="{y + 4:.1f}">{t:g} s</text>')
    return out


def panel(k, left, top, title, ticks, end, curves):
    """Of bogie k; dashed: where its front axle comes into the transition, and into the curve."""
    p = Panel(left, top, WIDTH, HIGH, (0, end), ticks)
    p.frame(title)
    for row, (name, points) in enumerate(curves):
        p.curve(points, COLOUR[name], name, 14 + 16 * row, 1.4, 6)
    for s in BENDS:
        p.mark((s + k * CAR) / SPEED)
    return p


def main(path):
    table = [row for row in rows(path)]
    end, later = table[-1]["t"], [row for row in table if row["t"] > 0.1]
    over = lambda value: [(row["t"], value(row)) for row in later]
    panels, top = [], PLAN + 40
    for k, (p, name) in enumerate(BOGIES.items()):
        loads = [(w, over(lambda r, w=w: r[f"force.{p}_{w}.z"] / 1e3)) for w in COLOUR]
        ratios = [(w, over(lambda r, w=w: r[f"force.{p}_{w}.y"] / max(r[f"force.{p}_{w}.z"], 1))) for w in COLOUR]
        panels += (panel(k, LEFT, top, f"Q of the {name} bogie, kN", (0, 20, 40, 60), end, loads),
                   panel(k, LEFT + COLUMN, top, "Y/Q, Y to the left", (-0.5, 0, 0.5, 1), end, ratios))
        top += HIGH + GAP
    for p in panels[-2:]:
        p.axis(range(0, int(end) + 1), "t, s", 8)
    page(LEFT + 2 * COLUMN, top, panels, plan(table))


if __name__ == "__main__":
    main(sys.argv[1])
