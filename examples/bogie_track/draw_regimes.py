#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the maps of map_bogie_track.py.

    python3 draw_regimes.py ../../bench/results/bogie_regimes.csv > regimes.svg
"""
import sys

sys.dont_write_bytecode = True
from map_bogie_track import MAPS, PAIR, leans, rebounds, table  # noqa: E402

WIDE, HIGH, LEFT, TOP, RIGHT, DOWN, COLUMNS = 330, 190, 52, 40, 24, 50, 2
COLOURS = {"leans left": "#0072b2", "leans right": "#56b4e9", "both rails": "#d55e00", "left rail": "#e69f00", "right rail": "#f0e442",
           "no rail": "#e4e4e4", "failed": "#000"}
SAID = {"leans left": "leans on the left rail", "leans right": "leans on the right rail", "both rails": "rebounds from both rails",
        "left rail": "rebounds from the left rail", "right rail": "rebounds from the right rail", "no rail": "comes to no rail"}


def spot(k):
    return LEFT + k % COLUMNS * (LEFT + WIDE + RIGHT), TOP + k // COLUMNS * (TOP + HIGH + DOWN)


def cells(values, size):
    """Place and width of a cell for each value on an axis: borders lie midway between values."""
    middle = [(a + b) / 2 for a, b in zip(values, values[1:])]
    border = [2 * values[0] - middle[0], *middle, 2 * values[-1] - middle[-1]]
    at = lambda v: size * (v - border[0]) / (border[-1] - border[0])
    return {v: (at(a), at(b) - at(a)) for v, a, b in zip(values, border, border[1:])}


def ticks(left, top, across, up, name, rise):
    for v, (x, wide) in list(across.items())[::2 if len(across) == 11 else 1]:
        yield f'<text x="{left + x + wide / 2:.1f}" y="{top + HIGH + 15}" text-anchor="middle">{v:g}</text>'
    yield f'<text x="{left + WIDE / 2}" y="{top + HIGH + 32}" text-anchor="middle">{name}</text>'
    for v, (y, high) in list(up.items())[::2 if len(up) == 11 else 1]:
        yield f'<text x="{left - 5}" y="{top + HIGH - y - high / 2 + 4:.1f}" text-anchor="end">{v:g}</text>'
    yield f'<text x="{left - 38}" y="{top + HIGH / 2}" text-anchor="middle" transform="rotate(-90 {left - 38} {top + HIGH / 2})">{rise}</text>'


def over_clearance(k, name, rows):
    title, axis, *_ = MAPS[name]
    left, top = spot(k)
    across, up = cells(sorted({float(r["x"]) for r in rows}), WIDE), cells(sorted({float(r["clearance"]) for r in rows}), HIGH)
    yield f'<text x="{left}" y="{top - 8}" font-weight="bold">{title}</text>'
    for row in rows:
        (x, wide), (y, high) = across[float(row["x"])], up[float(row["clearance"])]
        yield (f'<rect x="{left + x:.1f}" y="{top + HIGH - y - high:.1f}" width="{wide:.1f}" height="{high:.1f}" fill="{COLOURS[row["regime"]]}" '
               'stroke="#fff"/>')
    yield from ticks(left, top, across, up, axis, "clearance, mm")


def over_pair(k, name, rows):
    """Each cell has the regime at 2 mm in its lower half and the one at 6.5 mm in its upper half; framed: as in the paper."""
    title, axis, *_ = MAPS[name]
    left, top = spot(k)
    across, up = cells(sorted({float(r["x"]) for r in rows}), WIDE), cells(sorted({float(r["y"]) for r in rows}), HIGH)
    yield f'<text x="{left}" y="{top - 8}" font-weight="bold">{title}: 2 mm below, 6.5 mm above in each cell</text>'
    found = {(float(r["x"]), float(r["y"]), float(r["clearance"])): r["regime"] for r in rows}
    frames = []
    for v, (x, wide) in across.items():
        for w, (y, high) in up.items():
            small, big = (found[v, w, c] for c in PAIR)
            for part, regime in enumerate((small, big)):
                yield (f'<rect x="{left + x:.1f}" y="{top + HIGH - y - high * (1 + part) / 2:.1f}" width="{wide:.1f}" height="{high / 2:.1f}" '
                       f'fill="{COLOURS[regime]}"/>')
            frames.append(f'<rect x="{left + x:.1f}" y="{top + HIGH - y - high:.1f}" width="{wide:.1f}" height="{high:.1f}" fill="none" stroke="#fff" '
                          'stroke-width="1.5"/>')
            if leans(small) and rebounds(big):
                frames.append(f'<rect x="{left + x + 2:.1f}" y="{top + HIGH - y - high + 2:.1f}" width="{wide - 4:.1f}" height="{high - 4:.1f}" '
                              'fill="none" stroke="#000" stroke-width="1.5"/>')
    yield from frames
    yield from ticks(left, top, across, up, axis, "motors, kN m s")


def legend(top):
    for k, (regime, words) in enumerate(SAID.items()):
        x, y = LEFT + k % 4 * 190, top + k // 4 * 22
        yield f'<rect x="{x}" y="{y - 11}" width="14" height="14" fill="{COLOURS[regime]}"/><text x="{x + 20}" y="{y + 1}">{words}</text>'


def main(path):
    rows = list(table(path).values())
    lines = []
    for k, name in enumerate(MAPS):
        own = [row for row in rows if row["map"] == name]
        lines += (over_pair if own[0]["y"] else over_clearance)(k, name, own)
    bottom = spot(len(MAPS) - 1)[1] + HIGH + DOWN
    lines += legend(bottom + 10)
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {COLUMNS * (LEFT + WIDE + RIGHT)} {bottom + 44}" font-family="sans-serif" '
          'font-size="12"><rect width="100%" height="100%" fill="#fff"/>')
    print("\n".join(lines) + "\n</svg>")


if __name__ == "__main__":
    main(sys.argv[1])
