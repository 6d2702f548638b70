#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws runs of bogie_track.yaml, or how the slow mode of bogie_on_rails.yaml changes with the speed.

    kempe simulate bogie_track.yaml --no-convergence-check --t-end 30 --output-step 0.1 -o wide.csv
    kempe simulate bogie_track.yaml --no-convergence-check --t-end 30 --output-step 0.1 --set "sigma=2 mm" -o narrow.csv
    kempe simulate bogie_track.yaml --no-convergence-check --t-end 30 --output-step 0.1 --set worn=0 -o alike.csv
    python3 draw_bogie_track.py runs wide.csv narrow.csv alike.csv > yaw.svg

    python3 draw_bogie_track.py cases kempe > figure_11.svg

    kempe modes bogie_on_rails.yaml --at start --sweep speed=0.5:20:40 -o behind.csv
    kempe modes bogie_on_rails.yaml --at start --sweep speed=-0.5:-20:40 -o before.csv
    kempe modes bogie_on_rails.yaml --at start --sweep speed=0.5:20:40 --set motors=0 -o alone.csv
    python3 draw_bogie_track.py modes behind.csv before.csv alone.csv > modes.svg
"""
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from panels import BLUE, GREEN, RED, Panel, page, rows  # noqa: E402

WIDTH, HIGH, LEFT, GAP = 620, 150, 56, 34


def panel(top, title, ticks, span, curves, rails=()):
    """Curves (name, colour, points) over `span`; rails: dashed levels with colours. Its legend is beside the first ones."""
    p = Panel(LEFT, top, WIDTH, HIGH, span, ticks)
    p.frame(title)
    for v, colour in rails:
        p.level(v, colour)
    for k, (name, colour, points) in enumerate(curves):
        p.curve(points, colour, name, 12 + 42 * k)
    return p


def draw(panels, span, step, name):
    drawn = [panel(GAP + k * (HIGH + GAP), *given[:2], span, *given[2:]) for k, given in enumerate(panels)]
    drawn[-1].axis([span[0] + step * k for k in range(round((span[1] - span[0]) / step) + 1)], name, 22)
    page(LEFT + WIDTH + 130, GAP + len(drawn) * (HIGH + GAP), drawn)


def runs(wide, narrow, alike):
    tables = [(rows(wide), "6.5 mm", BLUE), (rows(alike), "6.5 mm,|wheels alike", GREEN), (rows(narrow), "2 mm", RED)]
    over = lambda value: [(name, colour, [(row["t"], value(row)) for row in table]) for table, name, colour in tables]
    draw([("yaw of the car body, mrad", (-1.5, -1, -0.5, 0, 0.5, 1, 1.5), over(lambda r: 1e3 * r["q.psi"])),
          ("driven axle to the left of the middle, mm; dashed: where a flange meets its rail", (-8, -4, 0, 4, 8),
           over(lambda r: 1e3 * r["q.y"]), [(-6.33, BLUE), (6.33, BLUE), (-1.94, RED), (1.94, RED)])],
         (0, 30), 5, "t, s")


BRAKED = {"worn": 0, "motors": 0, "speed": -10, "yaw_damper": "20 kN*m*s", "wheel_torque": "-600 N*m", "cross_level": "-1.5 mm", "turn": 0.5e-3}
CASES = (("A: coupling and a worn wheel", {}), ("B: coupling and a cross level of 10 mm", {"worn": 0, "cross_level": "10 mm"}),
         ("C: brakes, driven axle in front, yaw damper of 20 kN m s, cross level of 1.5 mm", BRAKED), ("D: none of them", {"worn": 0, "motors": 0}))


def simulated(kempe, values, folder):
    out = pathlib.Path(folder) / "run.csv"
    words = [word for name, value in values.items() for word in ("--set", f"{name}={value}")]
    subprocess.run([kempe, "simulate", pathlib.Path(__file__).with_name("bogie_track.yaml"), "--no-convergence-check", "--t-end", "60",
                    "--output-step", "0.1", "--rtol", "1e-8", *words, "-o", out], check=True, stdout=subprocess.DEVNULL)
    return [(row["t"], 1e3 * row["q.psi"]) for row in rows(out)]


def cases(kempe):
    """Yaw of the car body over time, as in the paper's Figure 11, for each set of assumptions."""
    with tempfile.TemporaryDirectory() as folder:
        draw([(f"{title}; yaw of the car body, mrad", (-1.5, -1, -0.5, 0, 0.5, 1, 1.5),
               [(name, colour, simulated(kempe, {"sigma": sigma, **values}, folder))
                for name, sigma, colour in (("6.5 mm", "6.5 mm", BLUE), ("2 mm", "2 mm", RED))]) for title, values in CASES], (0, 60), 10, "t, s")


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
    {"runs": runs, "cases": cases, "modes": modes}[sys.argv[1]](*sys.argv[2:])
