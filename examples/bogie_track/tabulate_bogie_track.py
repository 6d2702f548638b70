#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The table of README.md: how far the driven axle goes from the middle in the second half of 60 s, and how often it meets a rail.

    python3 tabulate_bogie_track.py kempe

A rail is met where the axle comes within 0.15 mm of the place at which a flange is on it, having been 1 mm away from there before.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
EXAMPLES = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(EXAMPLES))
from panels import rows  # noqa: E402

FLANGE = {"cone20": -0.17, "cone40": 0.47, "s1002": 0.0}  # from the clearance to the place, mm
STIFF, CONE = ("damping: damping", "damping: damping, stiffness: {}"), ("../profiles/cone20.csv", "../profiles/{}.csv")
CASES = (  # what it is, values, and what to change in the model's text
    ("as it is", {}),
    ("friction 0.1", {"friction": 0.1}),
    ("friction 0.5", {"friction": 0.5}),
    ("contacts undamped", {"damping": 0}),
    ("damping of contacts 2 s/m", {"damping": 2}),
    ("softer contacts, `stiffness: 2e10`", {}, STIFF, "2e10"),
    ("harder contacts, `stiffness: 3e11`", {}, STIFF, "3e11"),
    ("law `shen`", {}, ("friction: friction", "friction: friction, creep: {}"), "shen"),
    ("start turned by 0.1 mrad", {"turn": -1e-4}),
    ("by -0.1 mrad", {"turn": 1e-4}),
    ("by 2 mrad", {"turn": -2e-3}),
    ("cone 1:40, worn 0.125 mm", {"worn": "0.125 mm"}, CONE, "cone40"),
    ("5 m/s", {"speed": 5}),
    ("20 m/s", {"speed": 20}),
    ("worn 0.4 mm", {"worn": "0.4 mm"}),
    ("worn 0.15 mm: 1.5 mm, within either clearance", {"worn": "0.15 mm"}),
    ("wheels alike", {"worn": 0}),
    ("motors 1500 N m s", {"motors": 1500}),
    ("motors 500 N m s: swinging dies away", {"motors": 500}),
    ("without motors", {"motors": 0}),
    ("without motors, wheels alike: neither of both additions", {"motors": 0, "worn": 0}),
    ("yaw damper of 50 kN m s", {"yaw_damper": 50e3}),
    ("wheels S1002 (`../profiles/s1002.csv`, `tread=0.06 mm`)", {"tread": "0.06 mm"}, CONE, "s1002"),
)


def way(kempe, values, change, value):
    """Times and places, mm, of 60 s."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("bogie", "bogie_track", "profiles"):
            shutil.copytree(EXAMPLES / name, pathlib.Path(folder) / name)
        here = pathlib.Path(folder) / "bogie_track"
        for model in (here / "bogie_track.yaml", here / "half_tram.yaml"):
            if change:
                model.write_text(model.read_text().replace(change[0], change[1].format(value)))
        words = [word for name, given in values.items() for word in ("--set", f"{name}={given}")]
        subprocess.run([kempe, "simulate", here / "bogie_track.yaml", "--no-convergence-check", "--t-end", "60", *words, "-o", here / "run.csv"],
                       check=True, stdout=subprocess.DEVNULL)
        return [(row["t"], 1e3 * row["q.y"]) for row in rows(here / "run.csv")]


def met(places, flange):
    count, away = 0, True
    for y in places:
        if away and abs(y) > flange - 0.15:
            count, away = count + 1, False
        away = away or abs(y) < flange - 1
    return count


def main(kempe):
    print("| | 2 mm | 6.5 mm | rails met in 60 s |\n|---|---|---|---|")
    for name, values, *rest in CASES:
        change, value = rest or (None, "cone20")
        profile = value if value in FLANGE else "cone20"
        said = []
        for sigma in (2, 6.5):
            run = way(kempe, {"sigma": f"{sigma} mm", **values}, change, value)
            late = [y for t, y in run if t >= 30]
            said.append(f"{min(late):.2f} .. {max(late):.2f}")
        print("|", " | ".join((name, *said, str(met([y for _, y in run], sigma + FLANGE[profile])))), "|", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
