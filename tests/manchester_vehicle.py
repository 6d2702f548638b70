#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The coach of examples/manchester_vehicle through the command: loads, modes and critical speeds against its own linear equations, the
wheel loads over a dip and over a recorded track against linear springs, and forces in a curve against the balance of the whole coach.

    python3 tests/manchester_vehicle.py build/dev/kempe
"""
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
import runs
from runs import ROOT, kempe, rows

HERE = ROOT / "examples/manchester_vehicle"
sys.path.insert(0, str(HERE))
import reference_manchester_vehicle as reference  # noqa: E402

CONES, REAL, FAULTS, CURVE, RECORDED = (HERE / f"manchester_vehicle{name}.yaml" for name in ("_cones", "", "_faults", "_curve", "_recorded"))
ROUGH = "--rtol", 1e-4                                      # with it nothing that is judged here changes by a tenth of its bound
WHEELS = [side + axle for axle in "1234" for side in "LR"]
HELD = ("y,yaw,roll,front_y,front_yaw,front_roll,front_lead_yaw,front_trail_y,front_trail_yaw,"
        "rear_y,rear_yaw,rear_roll,rear_lead_y,rear_lead_yaw,rear_trail_y,rear_trail_yaw")


def eigenvalues(model, *words, **values):
    found = kempe("modes", model, *words, *runs.settings(**values))
    return [complex(*s) for s in found["eigenvalues"] if abs(complex(*s)) > 1e-3]


def critical(model, sweep, **values):
    """The lowest critical speed, and the rate there."""
    found = kempe("modes", model, "--sweep", f"speed={sweep}", *runs.settings(**values))["locus"]["critical"]
    least = min(found, key=lambda c: c["value"])
    return least["value"], abs(least["eigenvalue"][1])


class Rest(unittest.TestCase):
    def test_loads(self):
        """At rest every wheel carries an eighth of the weight."""
        found = kempe("equilibrium", CONES, "--set", "speed=0")
        for wheel in WHEELS:
            load = found["lambda"][f"{wheel}.1" if f"{wheel}.1" in found["lambda"] else wheel]
            self.assertLess(abs(load * math.cos(math.atan(0.1)) / reference.wheel_load() - 1), 1e-9, wheel)
        self.assertAlmostEqual(reference.wheel_load(), 54546.05, 2)

    def test_vertical(self):
        """Without dampers, and without springs along the track, which connect pitch with motions along it, the vertical modes are those of
        masses on vertical springs. The weight of the bodies above their springs adds up to 0.25 % to pitch."""
        none = {f"{b}_{name}": 0 for b in ("front", "rear") for name in ("kx", "bending", "lead_kx", "trail_kx")}
        found = [abs(s) / (2 * math.pi) for s in eigenvalues(CONES, dampers=0, **none)]
        for name, frequency in reference.vertical().items():
            near = 2.5e-3 if "pitch" in name else 2e-6
            self.assertLess(min(abs(f / frequency - 1) for f in found), near, name)


class Cones(unittest.TestCase):
    """Within 5e-5, which is how the rows of Kalker's table are interpolated: here by a spline over the long ellipses, in Kempe over all."""

    def test_eigenvalues(self):
        found, known = eigenvalues(CONES), rows(HERE / "eigenvalues.csv")
        self.assertEqual(len(known), sum(s.imag >= 0 for s in found))
        for row in known:
            s = complex(row["re"], row["im"])
            self.assertLess(min(abs(s - other) for other in found), 5e-5 * abs(s), s)

    def test_critical_speeds(self):
        known = rows(HERE / "reference.csv")
        self.assertEqual(len(known), 14)
        for row in known if runs.FULL else known[1::4]:
            names = {"cone": row["cone"], "height": row["height"], "rod": row["rod"]}
            with self.subTest(names):
                about = row["speed"]
                speed, rate = critical(CONES, f"{about - 3}:{about + 3}:3", **names)
                self.assertLess(abs(speed / about - 1), 5e-5)
                self.assertLess(abs(rate / row["rate"] - 1), 5e-5)


class RealWheels(unittest.TestCase):
    def test_critical_speed(self):
        """Elastic wheels S1002 on UIC 60, and the linear equations with contacts of `kempe contact`: rigid, their patches unchanged."""
        with tempfile.TemporaryDirectory() as folder:
            table = pathlib.Path(folder) / "contacts.csv"
            kempe("contact", REAL, "--sweep", "front_lead_y=-0.1 mm:0.1 mm:3", "--hold", HELD, "-o", table)
            contact = reference.read_contact(table)
        speed, rate = reference.critical(reference.Coach(), contact)
        found, own = critical(REAL, "60:80:3")
        self.assertLess(abs(found / speed - 1), 6e-3)
        self.assertLess(abs(own / rate - 1), 1.5e-2)

    def test_axles_alike(self):
        """Without creep all axles have the same creep coefficients: their rotations decay by f11/V (1/J + ..)."""
        fast = sorted(s.real for s in eigenvalues(REAL, speed=60) if s.imag == 0)[:4]
        self.assertLess(max(fast) / min(fast) - 1, 1e-4)
        self.assertLess(fast[3], -1000)  # f11 by C11; with C22 it would be -870


class Faults(unittest.TestCase):
    def test_dip(self):
        """Smallest loads over a dip, against linear springs on wheels that follow the rails: within 0.5 % of the load, the springs of the
        contacts."""
        table = runs.simulated(FAULTS, "--output-step", 0.0005, "--t-end", 1.4, *ROUGH, offset=0, depth=3e-3)[1]
        known = reference.over_dip(3e-3)
        for axle, least in enumerate(known, 1):
            for side in "LR":
                found = min(row[f"guidance.{side}{axle}.Q"] for row in table) / reference.wheel_load()
                self.assertLess(abs(found - least), 7e-3, axle)

    def test_step(self):
        """After a step of the track the coach runs in the new middle."""
        last = runs.simulated(FAULTS, "--t-end", 8, "--output-step", 0.1, "--max-step", 0.02, *ROUGH)[1][-1]
        self.assertLess(abs(last["q.y"] - 5e-3), 2e-4)


class Recorded(unittest.TestCase):
    def test_file(self):
        """The recording is what its program writes."""
        made = subprocess.run([sys.executable, HERE / "record_track.py"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(made, (HERE / "recorded_track.csv").read_text())

    def test_ideal_track(self):
        """Small motions are those on the track without its irregularities, and the result says so."""
        text = RECORDED.read_text()
        for name, path in (("../profiles", HERE.parent / "profiles"), ("recorded_track.csv", HERE / "recorded_track.csv"), ("manchester_vehicle_coach.yaml", HERE / "manchester_vehicle_coach.yaml")):
            text = text.replace(name, str(path))
        smooth = text.replace(",\n         irregularities: {alignment: alignment, level: level, cross: cross, gauge: gauge}", "")
        self.assertNotEqual(smooth, text)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "smooth.yaml"
            path.write_text(smooth)
            found, ideal = kempe("modes", RECORDED), kempe("modes", path)
        one, other = (np.sort_complex([complex(*s) for s in x["eigenvalues"] if abs(complex(*s)) > 1e-3]) for x in (found, ideal))
        self.assertEqual(len(one), len(other))
        self.assertLess(abs(one / other - 1).max(), 1e-7)
        self.assertGreater(len(found["eigenvalues"]), 40)
        self.assertIn("the irregularities of tracks are left out", found["warnings"][0])
        self.assertFalse(any("irregularities of tracks" in warning for warning in ideal["warnings"]))

    def test_loads(self):
        """Wheel loads over a recorded track, mean of left and right: those of linear springs on its level, within 0.3 % of the load (rms; the
        loads themselves change by 2.5 %) and 1.3 % at most."""
        table = runs.simulated(RECORDED, *ROUGH)[1]
        known = reference.over_recorded(np.array([row["t"] for row in table]))
        for axle in range(4):
            found = np.array([row[f"guidance.L{axle + 1}.Q"] + row[f"guidance.R{axle + 1}.Q"] for row in table]) / 2 / reference.wheel_load()
            off = (found - known[:, axle])[20:]            # after the start
            self.assertGreater(found.std(), 0.024)
            self.assertLess(off.std(), 3e-3)
            self.assertLess(abs(off).max(), 0.013)


class Curve(unittest.TestCase):
    def test_balance(self):
        """Loads and lateral forces of all wheels together in the curve are those of the weight and of the masses that go round."""
        table = [row for row in runs.simulated(CURVE, "--max-step", 0.01, *ROUGH)[1] if row["t"] > 8.5]
        mass = 8 * reference.wheel_load() / 9.81
        lean = math.asin(0.1 / 1.50607)
        down = out = goes = stays = 0.0
        for row in table:
            v2 = row["qd.x"] ** 2 + row["qd.y"] ** 2
            down += sum(row[f"guidance.{wheel}.Q"] for wheel in WHEELS) / len(table)
            out += sum((1 if wheel[0] == "R" else -1) * row[f"guidance.{wheel}.Y"] for wheel in WHEELS) / len(table)
            goes += mass * (v2 / 500 * math.cos(lean) - 9.81 * math.sin(lean)) / len(table)
            stays += mass * (9.81 * math.cos(lean) + v2 / 500 * math.sin(lean)) / len(table)
        print("  down %.1f of %.1f N, out %.1f of %.1f N" % (down, stays, out, goes))
        self.assertLess(abs(down / stays - 1), 2e-4)
        self.assertLess(abs(out / goes - 1), 2e-3)  # found 1.0e-3


if __name__ == "__main__":
    runs.main()
