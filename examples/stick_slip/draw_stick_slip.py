#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The picture of the feed drive: screw, table and friction over time.

    python3 examples/stick_slip/draw_stick_slip.py KEMPE > examples/stick_slip/stick_slip.svg
"""
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from panels import BLUE, RED, Panel, page, rows  # noqa: E402

with tempfile.TemporaryDirectory() as folder:
    table = pathlib.Path(folder) / "run.csv"
    subprocess.run([sys.argv[1], "simulate", str(HERE / "stick_slip.yaml"), "--output-step", "0.004", "--output", str(table), "--quiet",
                    "--no-convergence-check"], check=True, stdout=subprocess.DEVNULL)
    run = rows(table)
t = [row["t"] for row in run]
place = Panel(60, 30, 480, 130, (0, 2), (0, 4, 8, 12, 16))
place.frame("advance, mm")
place.curve([(s, row["q.screw"]) for s, row in zip(t, run)], BLUE, "screw", 20)
place.curve([(s, 1000 * row["q.x"]) for s, row in zip(t, run)], RED, "table", 50)
force = Panel(60, 210, 480, 110, (0, 2), (-30, -15, 0))
force.frame("friction of the guide, N")
force.curve([(s, row["force.guide"]) for s, row in zip(t, run)], RED, "sticks: up to 30 N|slips: 15 N", 30)
force.axis((0, 0.5, 1, 1.5, 2), "s", 8)
page(660, 350, (place, force))
