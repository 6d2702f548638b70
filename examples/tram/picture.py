#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what a run of tram.yaml gave: the cars from above, wheel loads and Y/Q of each bogie over time.

    kempe simulate tram.yaml --once -o tram.csv && python3 picture.py tram.csv > tram.svg
"""
import csv
import math
import sys

WIDTH, HIGH, LEFT, GAP, COLUMN = 290, 120, 50, 34, 380
COLOUR = {"FL": "#0072b2", "FR": "#d55e00", "RL": "#56b4e9", "RR": "#e69f00"}
BOGIES = {"a": "first", "b": "second", "c": "third"}
SPEED, CAR, BROAD, PIVOT = 10, 7.6, 2.3, -0.765
BENDS = (10, 30)  # where the transition begins and ends
PLAN = 510
TIMES = (0, 3, 5.6, 8)  # of the cars from above


def rows(path):
    with open(path, newline="") as file:
        return [{key: float(x) for key, x in row.items()} for row in csv.DictReader(line for line in file if line[0] != "#")]


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
    way = "L".join("%.1f,%.1f" % place(*centre(row, 0)[:2]) for row in table)
    back = "%.1f,%.1f" % place(*centre(table[0], 2)[:2])
    out = [f'<path d="M{back}L{way}" fill="none" stroke="#999"/>']
    for t in TIMES:
        row = min(table, key=lambda r: abs(r["t"] - t))
        for k in range(3):
            out.append(f'<path d="M{outline(row, k, place)}Z" fill="#0072b2" fill-opacity="{0.75 if k != 1 else 0.45}"/>')
        x, y, yaw = centre(row, 1)
        x, y = place(x + 2.5 * math.sin(yaw), y - 2.5 * math.cos(yaw))
        out.append(f'<text x="{x:.1f}" y="{y + 4:.1f}">{t:g} s</text>')
    return out


def panel(left, top, title, ticks, end, curves):
    low, high = ticks[0], ticks[-1]
    x = lambda t: left + t / end * WIDTH
    y = lambda v: top + HIGH * (high - v) / (high - low)
    out = [f'<text x="{left}" y="{top - 8}" font-weight="bold">{title}</text>']
    for v in ticks:
        out.append(f'<path d="M{left},{y(v):.1f}h{WIDTH}" stroke="#999" stroke-width="0.5"/>'
                   f'<text x="{left - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:g}</text>')
    for k, (name, points) in enumerate(curves):
        way = "L".join(f"{x(t):.1f},{y(min(max(v, low), high)):.1f}" for t, v in points)
        out.append(f'<path d="M{way}" fill="none" stroke="{COLOUR[name]}" stroke-width="1.4"/>'
                   f'<text x="{left + WIDTH + 6}" y="{top + 14 + 16 * k}" fill="{COLOUR[name]}">{name}</text>')
    return out


def bends(left, top, end, k):
    """Where the front axle of bogie k comes into the transition, and into the curve."""
    return [f'<path d="M{left + (s + k * CAR) / SPEED / end * WIDTH:.1f},{top}v{HIGH}" stroke="#999" stroke-dasharray="3 3"/>' for s in BENDS]


def main(path):
    table = [row for row in rows(path)]
    end, later = table[-1]["t"], [row for row in table if row["t"] > 0.1]
    over = lambda value: [(row["t"], value(row)) for row in later]
    lines, top = plan(table), PLAN + 40
    for k, (p, name) in enumerate(BOGIES.items()):
        loads = [(w, over(lambda r, w=w: r[f"force.{p}_{w}.z"] / 1e3)) for w in COLOUR]
        ratios = [(w, over(lambda r, w=w: r[f"force.{p}_{w}.y"] / max(r[f"force.{p}_{w}.z"], 1))) for w in COLOUR]
        lines += panel(LEFT, top, f"Q of the {name} bogie, kN", (0, 20, 40, 60), end, loads) + bends(LEFT, top, end, k)
        lines += panel(LEFT + COLUMN, top, "Y/Q, Y to the left", (-0.5, 0, 0.5, 1), end, ratios) + bends(LEFT + COLUMN, top, end, k)
        top += HIGH + GAP
    for left in (LEFT, LEFT + COLUMN):
        for t in range(0, int(end) + 1):
            lines.append(f'<text x="{left + t / end * WIDTH:.1f}" y="{top - GAP + 16}" text-anchor="middle">{t}</text>')
        lines.append(f'<text x="{left + WIDTH + 8}" y="{top - GAP + 16}">t, s</text>')
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + 2 * COLUMN} {top}" font-family="sans-serif" font-size="12">'
          '<rect width="100%" height="100%" fill="#fff"/>')
    print("\n".join(lines) + "\n</svg>")


if __name__ == "__main__":
    main(sys.argv[1])
