#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws runs of bogie_track.yaml, or how the slow mode of on_rails.yaml changes with the speed.

    kempe simulate bogie_track.yaml --once --t-end 30 --every 0.1 -o wide.csv
    kempe simulate bogie_track.yaml --once --t-end 30 --every 0.1 --set "sigma=2 mm" -o narrow.csv
    kempe simulate bogie_track.yaml --once --t-end 30 --every 0.1 --set worn=0 -o alike.csv
    python3 picture.py runs wide.csv narrow.csv alike.csv > yaw.svg

    kempe modes on_rails.yaml --at start --vary speed=0.5:20:40 -o behind.csv
    kempe modes on_rails.yaml --at start --vary speed=-0.5:-20:40 -o before.csv
    kempe modes on_rails.yaml --at start --vary speed=0.5:20:40 --set motors=0 -o alone.csv
    python3 picture.py modes behind.csv before.csv alone.csv > modes.svg
"""
import csv
import sys

WIDTH, HIGH, LEFT, GAP = 620, 150, 56, 34
BLUE, RED, GREEN = "#0072b2", "#d55e00", "#009e73"


def rows(path):
    with open(path, newline="") as file:
        return [{key: float(x) for key, x in row.items() if x} for row in csv.DictReader(line for line in file if line[0] != "#")]


def panel(top, title, ticks, span, curves, rails=()):
    """Curves (name, colour, points) over `span`; rails: dashed levels with colours. Its legend is beside the first ones."""
    low, high = ticks[0], ticks[-1]
    x = lambda s: LEFT + (s - span[0]) / (span[1] - span[0]) * WIDTH
    y = lambda v: top + HIGH * (high - min(max(v, low), high)) / (high - low)
    out = [f'<text x="{LEFT}" y="{top - 8}" font-weight="bold">{title}</text>']
    for v in ticks:
        out.append(f'<path d="M{LEFT},{y(v):.1f}h{WIDTH}" stroke="#999" stroke-width="0.5"/>'
                   f'<text x="{LEFT - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:g}</text>')
    for v, colour in rails:
        out.append(f'<path d="M{LEFT},{y(v):.1f}h{WIDTH}" stroke="{colour}" stroke-dasharray="4 3"/>')
    for k, (name, colour, points) in enumerate(curves):
        way = "L".join(f"{x(s):.1f},{y(v):.1f}" for s, v in points)
        out.append(f'<path d="M{way}" fill="none" stroke="{colour}" stroke-width="1.6"/>')
        for line, words in enumerate(name.split("|")):
            out.append(f'<text x="{LEFT + WIDTH + 8}" y="{top + 12 + 42 * k + 14 * line}" fill="{colour}">{words}</text>')
    return out


def axis(top, span, step, name):
    count = round((span[1] - span[0]) / step)
    out = [f'<text x="{LEFT + WIDTH * k / count:.1f}" y="{top + 16}" text-anchor="middle">{span[0] + step * k:g}</text>' for k in range(count + 1)]
    return out + [f'<text x="{LEFT + WIDTH + 22}" y="{top + 16}">{name}</text>']


def draw(panels, span, step, name):
    lines, top = [], GAP
    for given in panels:
        lines += panel(top, *given[:2], span, *given[2:])
        top += HIGH + GAP
    lines += axis(top - GAP, span, step, name)
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + WIDTH + 130} {top}" font-family="sans-serif" font-size="12">'
          '<rect width="100%" height="100%" fill="#fff"/>')
    print("\n".join(lines) + "\n</svg>")


def runs(wide, narrow, alike):
    tables = [(rows(wide), "6.5 mm", BLUE), (rows(alike), "6.5 mm,|wheels alike", GREEN), (rows(narrow), "2 mm", RED)]
    over = lambda value: [(name, colour, [(row["t"], value(row)) for row in table]) for table, name, colour in tables]
    draw([("yaw of the car body, mrad", (-1.5, -1, -0.5, 0, 0.5, 1, 1.5), over(lambda r: 1e3 * r["q.psi"])),
          ("driven axle to the left of the middle, mm; dashed: where a flange meets its rail", (-8, -4, 0, 4, 8),
           over(lambda r: 1e3 * r["q.y"]), [(-6.5, BLUE), (6.5, BLUE), (-2, RED), (2, RED)])],
         (0, 30), 5, "t, s")


def slow(path):
    """Speed and eigenvalue of the slowest mode that is not still."""
    for row in rows(path):
        found = [complex(row[f"re.{k}"], row[f"im.{k}"]) for k in range(1, 99) if f"re.{k}" in row]
        yield abs(row["speed"]), min((s for s in found if abs(s) > 1e-9 and s.imag >= 0), key=abs)


def modes(behind, before, alone):
    tables = [("driven wheels|behind", RED, list(slow(behind))), ("driven wheels|in front", BLUE, list(slow(before))),
              ("without|motors", GREEN, list(slow(alone)))]
    part = lambda value: [(name, colour, [(v, value(s)) for v, s in table]) for name, colour, table in tables]
    draw([("grows with, 1/s", (-0.2, -0.1, 0, 0.1, 0.2), part(lambda s: s.real)), ("frequency, Hz", (0, 0.2, 0.4, 0.6), part(lambda s: s.imag / 6.283185307))],
         (0, 20), 5, "speed, m/s")


if __name__ == "__main__":
    {"runs": runs, "modes": modes}[sys.argv[1]](*sys.argv[2:])
