#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what a run of curving.yaml gave: lateral shift, wheel loads and Y/Q over the way.

    kempe simulate curving.yaml --no-convergence-check -o curving.csv && python3 draw_curving.py curving.csv > curving.svg
"""
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from panels import BLUE, BROWN, GREEN, PLUM, RED, TEAL, Panel, page, rows  # noqa: E402

WIDTH, HIGH, LEFT, GAP = 640, 130, 56, 34
COLOUR = {"FL": BLUE, "FR": RED, "RL": TEAL, "RR": BROWN, "front": GREEN, "rear": PLUM}
WAY = (5, 125)
BENDS = (20, 50)  # where the transition begins and ends


def shift(row, axle):
    """Of the axle's middle, outwards in a left curve, mm: of the right wheel on its rail."""
    return 1e3 * (row[f"contact.{axle}R.1.y"] - row[f"contact.{axle}R.1.s"] - 0.75)


def panel(top, title, ticks, curves):
    p = Panel(LEFT, top, WIDTH, HIGH, WAY, ticks)
    p.frame(title)
    for s in BENDS:
        p.mark(s)
    for k, (name, points) in enumerate(curves):
        p.curve([(s, v) for s, v in points if s <= WAY[1]], COLOUR[name], name, 14 + 16 * k)
    return p


def main(path):
    table = [row for row in rows(path) if row["t"] > 0.1]
    over = lambda value: [(row["q.x"], value(row)) for row in table]
    wheels = ("FL", "FR", "RL", "RR")
    panels = (("shift of the axles, outwards, mm", (-8, -4, 0, 4, 8), [(name, over(lambda r, a=name[0].upper(): shift(r, a))) for name in ("front", "rear")]),
              ("Q, wheel loads, kN", (30, 40, 50, 60, 70, 80), [(w, over(lambda r, w=w: r[f"force.{w}.z"] / 1e3)) for w in wheels]),
              ("Y/Q, Y to the left", (-0.4, -0.2, 0, 0.2, 0.4), [(w, over(lambda r, w=w: r[f"force.{w}.y"] / r[f"force.{w}.z"])) for w in wheels]))
    drawn = [panel(GAP + k * (HIGH + GAP), *given) for k, given in enumerate(panels)]
    drawn[-1].axis(range(20, WAY[1], 20), "x, m", 8)
    page(LEFT + WIDTH + 60, GAP + len(drawn) * (HIGH + GAP), drawn)


if __name__ == "__main__":
    main(sys.argv[1])
