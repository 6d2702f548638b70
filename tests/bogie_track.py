#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The bogie under half a car body on rails (examples/bogie_track) through the command: its loads against statics, its slow mode against
a closed form and for several choices of u, what a clearance of 6.5 mm and one of 2 mm make of it, and two roads.

    python3 tests/bogie_track.py build/dev/kempe
"""
import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
HERE = ROOT / "examples/bogie_track"
SPINS = ("spin_FL", "spin_FR", "spin_RL", "spin_RR")
STEADY = ("--rates", ",".join(f"{name}={rate}" for name, rate in zip(SPINS, (-31.25, -31.25, -53.3333, -53.3333))),
          "--free", ",".join(f"qd({name})" for name in SPINS))
MIDDLE = ("--set", "turn=0", "--set", "worn=0")


def run(*words):
    done = subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, timeout=250,
                          env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    if done.returncode:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")


def asked(*words):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "out.json"
        run(*words, "--json", path)
        return json.loads(path.read_text())


def rows(path):
    with open(path, newline="") as file:
        return [{key: float(x) for key, x in row.items()} for row in csv.DictReader(line for line in file if line[0] != "#")]


def simulated(t_end, *words):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "run.csv"
        run("simulate", HERE / "bogie_track.yaml", "--once", "--t-end", t_end, *words, "-o", path)
        return rows(path)


def slow(*words):
    """The slowest of the modes that swing."""
    found = [complex(*mode["eigenvalue"]) for mode in asked("modes", *words)["modes"]]
    return min((s for s in found if s.imag > 0), key=abs)


class Balance(unittest.TestCase):
    # (mass, x) of all that the wheels carry, x behind the driven axle, and what of the car body is on the cradle's ball
    PARTS = ((900, 0.25), (360, 0), (420, 1.35), (140, 1.7), (300, 0.765), (30, 0.9), (15, 0.44), (16, 0.5), (8, 1.25),
             (5000 * 3.85 / 5.5, 0.765))

    def test_loads(self):
        """Axle loads are what statics gives: 3.3 t on the driven wheels, 2.3 t on the small ones. Springs are as they stand."""
        total = 9.81 * sum(m for m, _ in self.PARTS)
        small = 9.81 * sum(m * x for m, x in self.PARTS) / 1.7
        found = asked("equilibrium", HERE / "on_rails.yaml", *STEADY)
        loads = {name: found["lambda"][f"{name}.1"] for name in ("FL", "FR", "RL", "RR")}
        self.assertLess(abs((loads["FL"] + loads["FR"]) / (total - small) - 1), 1e-3)
        self.assertLess(abs((loads["RL"] + loads["RR"]) / small - 1), 1e-3)
        self.assertLess(abs(loads["FL"] - loads["FR"]), 0.002 * total)
        self.assertLess(abs(found["q"]["y"]), 1e-5)

    def test_elastic(self):
        """Elastic wheels stand a few hundredths of a millimetre lower and as the rigid ones in all else."""
        rigid = asked("equilibrium", HERE / "on_rails.yaml", *STEADY)["q"]
        elastic = asked("equilibrium", HERE / "bogie_track.yaml", *STEADY, *MIDDLE)["q"]
        self.assertTrue(2e-5 < rigid["z"] - elastic["z"] < 5e-5)
        self.assertLess(max(abs(rigid[name] - elastic[name]) for name in ("y", "psi", "yaw", "stroke", "car_pitch")), 1e-5)

    def test_starts_on_its_rails(self):
        """All wheels stand on their rails at the start and stay there, whatever the clearance, the worn wheel and the turn."""
        for words in ((), ("sigma=2 mm",), ("worn=0",), ("turn=0.5e-3",)):
            with self.subTest(words=words):
                way = simulated(0.2, "--every", 0.001, *(each for word in words for each in ("--set", word)))
                for name, load in (("FL", 16400), ("FR", 16400), ("RL", 11500), ("RR", 11500)):
                    self.assertTrue(all(0.5 * load < row[f"force.{name}.z"] < 1.5 * load for row in way), name)


class SlowMode(unittest.TestCase):
    def test_closed_form(self):
        """Frequency, and what of growth goes with the direction, are those of a stiff frame that two axles steer."""
        found = {row["speed"]: slow(HERE / "on_rails.yaml", "--at", "start", "--set", f"speed={row['speed']}")
                 for row in rows(HERE / "reference.csv")}
        for row in rows(HERE / "reference.csv"):
            v = row["speed"]
            with self.subTest(speed=v):
                self.assertLess(abs(found[v].imag / row["im"] - 1), 0.03)
                self.assertLess(abs((found[v].real - found[-v].real) / 2 / row["re"] - 1), 0.2)
                self.assertEqual(found[v].real > 0, v > 0)

    def test_choices(self):
        """Eigenvalues do not depend on the choice of u, at the steady motion itself."""
        with tempfile.TemporaryDirectory() as folder:
            for name in ("bogie", "bogie_track", "profiles"):
                shutil.copytree(ROOT / "examples" / name, pathlib.Path(folder) / name)
            place = pathlib.Path(folder) / "bogie_track"
            steady = asked("equilibrium", place / "bogie_track.yaml", *STEADY, *MIDDLE)
            model = place / "bogie_track.yaml"
            text = model.read_text()
            start = f"start:\n  q: {json.dumps(steady['q'])}\n  qd: {json.dumps(steady['qd'])}\n"
            model.write_text(text[:text.index("start:")] + start + text[text.index("\nrun:"):])
            choices = ("psi,car_pitch,car_roll,yaw,roll,pitch,K2,K3", "y,car_roll,psi,stroke,z,pitch,roll,warp",
                       "x,y,car_pitch,car_roll,yaw,roll,K2,K3")
            found = [asked("modes", place / "bogie_track.yaml", "--at", "start", *MIDDLE, "--u", ",".join((choice, *SPINS)))
                     for choice in choices]
        self.assertEqual(len({tuple(sorted(each["u"])) for each in found}), 3)
        for other in found[1:]:
            for a, b in zip(found[0]["eigenvalues"], other["eigenvalues"]):
                self.assertLess(abs(complex(*a) - complex(*b)), 1e-6 * max(1, abs(complex(*a))))


class Clearance(unittest.TestCase):
    def test_leans(self):
        """2 mm: the bogie leans on the left rail and stays there."""
        late = [row for row in simulated(12, "--set", "sigma=2 mm") if row["t"] > 4]
        self.assertTrue(all(1.9e-3 < row["q.y"] < 2e-3 for row in late))
        self.assertLess(max(row["q.psi"] for row in late) - min(row["q.psi"] for row in late), 2e-5)

    def test_rebounds(self):
        """6.5 mm: it comes to the left rail every five seconds and swings back beyond the middle."""
        way = [(row["t"], row["q.y"]) for row in simulated(16)]
        hits = [t for t, y in way if y > 6.2e-3]
        firsts = [t for before, t in zip([-9.0, *hits], hits) if t - before > 2]
        self.assertEqual(len(firsts), 3)
        for a, b in zip(firsts, firsts[1:]):
            self.assertTrue(4.5 < b - a < 5.7)
            self.assertTrue(-2.3e-3 < min(y for t, y in way if a < t < b) < -1.3e-3)

    def test_from_rail_to_rail(self):
        """Wheels that are alike: from one rail to the other."""
        late = [row["q.y"] for row in simulated(26, "--set", "worn=0") if row["t"] > 16]
        self.assertTrue(6.1e-3 < max(late) < 6.5e-3 and -6.5e-3 < min(late) < -6.1e-3)

    def test_driven_wheels_in_front(self):
        """The other way round the same bogie calms down."""
        way = [row for row in simulated(40, "--set", "worn=0", "--set", "speed=-10")]
        self.assertLess(max(abs(row["q.y"]) for row in way if row["t"] > 30), 0.7 * max(abs(row["q.y"]) for row in way if row["t"] < 10))

    def test_roads(self):
        ways = [simulated(0.7, "--rtol", rtol, "--every", 0.05, *words)
                for rtol, words in ((1e-8, ()), (1e-8, ("--road", "dae", "--integrator", "ida")))]
        for name in ("q.psi", "q.y", "q.yaw", "q.car_roll"):  # to a hundred tolerances
            self.assertLess(max(abs(a[name] - b[name]) for a, b in zip(*ways)), 1e-6, name)


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
