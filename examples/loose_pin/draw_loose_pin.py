#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the path of the journal's centre in its bearing from a run of loose_pin.yaml.

    kempe simulate loose_pin.yaml --no-convergence-check --output-step 5e-6 -o loose_pin.csv
    python3 draw_loose_pin.py loose_pin.csv > journal_path.svg
"""
import math
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from panels import BLUE, RED, rows  # noqa: E402

CLEARANCE, SIZE, ROOM = 0.5e-3, 480, 30
FREE, TOUCHING = BLUE, RED


def lines(points, place):
    """Pieces of the path, each with True where the journal touches; a piece begins at the last point of the one before."""
    pieces = []
    for point in points:
        touching = math.hypot(*point) >= CLEARANCE
        if pieces and pieces[-1][0] == touching:
            pieces[-1][1].append(place(point))
        else:
            pieces.append((touching, pieces[-1][1][-1:] + [place(point)] if pieces else [place(point)]))
    return pieces


def main():
    points = [(row["force.pin.x"], row["force.pin.y"]) for row in rows(sys.argv[1])]
    scale, middle = (SIZE / 2 - ROOM) / max(math.hypot(*p) for p in points), SIZE / 2
    place = lambda p: f"{middle + scale * p[0]:.1f},{middle - scale * p[1]:.1f}"
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE} {SIZE}" width="{SIZE}" height="{SIZE}" font-family="sans-serif" font-size="13">'
          f'<title>Path of the journal\'s centre in its bearing</title><rect width="{SIZE}" height="{SIZE}" fill="#fff"/>')
    print(f'<path d="M{ROOM},{middle}H{SIZE - ROOM}M{middle},{ROOM}V{SIZE - ROOM}" stroke="#bbb"/>'
          f'<circle cx="{middle}" cy="{middle}" r="{scale * CLEARANCE:.1f}" fill="none" stroke="#222" stroke-width="1.4"/>')
    for touching in (False, True):
        way = "".join("M" + "L".join(piece) for kind, piece in lines(points, place) if kind == touching)
        print(f'<path d="{way}" fill="none" stroke="{TOUCHING if touching else FREE}" stroke-width="{1.3 if touching else 0.9}"/>')
    print(f'<text x="{SIZE - ROOM + 6}" y="{middle + 4}">x</text><text x="{middle - 4}" y="{ROOM - 8}">y</text>'
          f'<text x="8" y="{SIZE - 10}">circle: {1e3 * CLEARANCE:g} mm</text></svg>')


if __name__ == "__main__":
    main()
