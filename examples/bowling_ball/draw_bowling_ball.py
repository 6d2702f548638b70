#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The picture of the bowling ball: its path from above, and the friction of the lane along it.

    python3 examples/bowling_ball/draw_bowling_ball.py KEMPE > examples/bowling_ball/bowling_ball.svg
"""
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent))
from panels import BLUE, RED, Panel, page, rows  # noqa: E402

END, LANE = 18, (0, 6, 12, 18)

with tempfile.TemporaryDirectory() as folder:
    table = pathlib.Path(folder) / "run.csv"
    subprocess.run([sys.argv[1], "simulate", str(HERE / "bowling_ball.yaml"), "--output-step", "0.01", "--output", str(table), "--quiet",
                    "--no-convergence-check"], check=True, stdout=subprocess.DEVNULL)
    run = [row for row in rows(table) if row["q.b.1"] <= END]
rolls = next(row["q.b.1"] for row in run if abs(row["force.lane_friction1"]) < 1e-6)
path = Panel(60, 30, 480, 150, (0, END), (-20, 0, 20, 40, 60))
path.frame("path from above: place across the lane, cm")
path.curve([(row["q.b.1"], 100 * row["q.b.2"]) for row in run], RED, "parabola, then|straight line", 30)
force = Panel(60, 230, 480, 110, (0, END), (-8, -4, 0, 4, 8))
force.frame("friction, N")
force.curve([(row["q.b.1"], row["force.lane_friction1"]) for row in run], BLUE, "along the lane", 106)
force.curve([(row["q.b.1"], row["force.lane_friction2"]) for row in run], RED, "across", 20)
for panel in (path, force):
    panel.mark(rolls)
force.axis(LANE, "m along the lane", 8)
page(680, 370, (path, force))
