#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The coach with a flexible car body of examples/flexible_car through the command: its response against linear equations of a free beam,
its run on rails against spectra by these, formulations and rigid wheels, and the tram with flexible cars at rest and in its curve.

    python3 tests/flexible_car.py build/dev/kempe
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
import runs
from runs import ROOT, kempe, rows

HERE = ROOT / "examples/flexible_car"
sys.path.insert(0, str(HERE))
import reference_flexible_car as reference  # noqa: E402

COACH, SHAKEN, RAILS, TRAM = (HERE / f"flexible_car{name}.yaml" for name in ("_coach", "_shaken", "", "_tram"))
CONES = ROOT / "examples/manchester_vehicle/manchester_vehicle_cones.yaml"
RIGID = {"vertical": 0, "lateral": 0, "twist": 0}
MIDDLE = "acceleration.car.middle.z"
LONGER = "--max-step", 0.005, "--rtol", 1e-4  # steps that change what is judged here by a hundredth of the bounds at most


class Beam(unittest.TestCase):
    def test_frequencies(self):
        """Of the free car body, in its mean axes."""
        found = kempe("check", COACH)["flexible_bodies"][0]["free"]
        rates = reference.Beam().rates
        for rate, known in zip(found, sorted(rates[rates > 0])):
            self.assertLess(abs(rate / known - 1), 1e-9)

    def test_convergence(self):
        """Of the reference, to the beam without inertia of its sections, which lowers the frequency of slender beams a little."""
        formula = 4.730040744862704**2 / reference.LENGTH**2 * np.sqrt(reference.EI * reference.LENGTH / reference.MASS) / (2 * np.pi)
        rates = reference.Beam((0, 8, 0)).rates / (2 * np.pi)
        self.assertTrue(0.96 < min(rates[rates > 0]) / formula < 0.98)


class Shaken(unittest.TestCase):
    def test_response(self):
        inputs, outputs = ",".join(f"drive({d}{k})" for d in "zy" for k in (1, 2, 3, 4)), [
            "acceleration(car.middle).z", "acceleration(car.above_front).z", "acceleration(car.middle).y", "acceleration(car.end).y"]
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "response.csv"
            kempe("response", SHAKEN, "--inputs", inputs, "--outputs", ",".join(outputs), "--frequencies", "0.5:40:60", "-o", path)
            self.assertLess(reference.compare(path), 1e-8)

    def test_table(self):
        """reference.csv is what its program writes."""
        made = subprocess.run([sys.executable, HERE / "reference_flexible_car.py"], capture_output=True, text=True, check=True).stdout
        found, known = ([[float(x) for x in line.split(",")] for line in text.splitlines()[2:]]
                        for text in (made, (HERE / "reference.csv").read_text()))
        self.assertLess(np.max(abs(np.array(found) - known) / (abs(np.array(known)) + 1e-3)), 1e-9)


def weighted_on_track(flexible, begin, end, speed=55.6):
    """Of the linear equations on the waves of the track: bands of the spectrum with phases by SplitMix64 (Steele, Lea and Flood 2014)."""
    low, high, start, length, seed, level = np.pi / 35, np.pi, 10, 1190, 1, 1
    count = int(np.ceil((high - low) / min(low / 4, 2 * np.pi / length)))
    band = (high - low) / count
    rates = low + (np.arange(count) + 0.5) * band
    z = np.uint64(4 * seed + level) + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9e3779b97f4a7c15)
    for shift, factor in ((30, 0xbf58476d1ce4e5b9), (27, 0x94d049bb133111eb)):
        z = (z ^ (z >> np.uint64(shift))) * np.uint64(factor)
    phases = 2 * np.pi * ((z ^ (z >> np.uint64(31))) >> np.uint64(11)) / 2.0**53 - rates * start
    frequencies = rates * speed / (2 * np.pi)
    sizes = np.sqrt(2 * reference.level(frequencies, speed) * band * speed / (2 * np.pi))
    waves = sizes * reference.wave(MIDDLE, frequencies, speed, flexible) * reference.weighting(frequencies) * np.exp(1j * phases)
    times = np.arange(begin, end, 0.005)
    return np.sqrt(np.mean((np.exp(1j * speed * np.outer(times, rates)) @ waves).real ** 2))


class Rails(unittest.TestCase):
    def judged(self, begin, end, **values):
        found = kempe("comfort", RAILS, "--from", begin, "--t-end", end, "--no-convergence-check", "--vertical", "acceleration(car.middle).z",
                      "--rate", 400, *LONGER, *runs.settings(**values))
        return found["signals"][0]["weighted"]

    def test_comfort(self):
        """Beside the linear equations on the same waves: within 5 %; on all of the spectrum, whatever its phases, that takes 20 s."""
        for flexible, values in ((True, {}), (False, RIGID)):
            with self.subTest(flexible):
                self.assertLess(abs(self.judged(5, 10, **values) / weighted_on_track(flexible, 5, 10) - 1), 0.05)
                if runs.FULL:
                    self.assertLess(abs(self.judged(5, 20, **values) / reference.weighted(MIDDLE, 55.6, flexible) - 1), 0.05)

    def test_formulations(self):
        """All of them have one motion of the coach with its deformations."""
        ends = [runs.simulated(RAILS, "--t-end", 0.2, "--rtol", 1e-8, "--formulation", word)[1][-1] for word in ("reduced", "projected", "dae")]
        for name in ends[0]:
            if name.startswith("q."):
                for other in ends[1:]:
                    self.assertLess(abs(other[name] - ends[0][name]), 1e-6 * max(1, abs(ends[0][name])), name)

    def test_start(self):
        """The start is in balance: the wheels of an axle carry an eighth of the weight each."""
        first = runs.simulated(RAILS, "--t-end", 0.01)[1][0]
        load = (first["guidance.L1.Q"] + first["guidance.R1.Q"]) / 2  # the cross level of the track begins here
        self.assertLess(abs(load / 54546.05 - 1), 2e-3)

    def test_rigid_wheels(self):
        """A flexible car body on cones with rigid contacts: steady motion, modes, and no talk of buckling by creep."""
        text = (CONES.read_text().replace("manchester_vehicle_coach.yaml, set: {viscous: dampers}", str(COACH)).replace("../profiles", str(ROOT / "examples/profiles"))
                .replace("  dampers: 1                                              # 0: the suspension without them\n", ""))
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "cones.yaml"
            path.write_text(text)
            steady = kempe("modes", path)
            self.assertTrue(any(abs(abs(complex(*s)) / (2 * np.pi) - 8.70) < 0.02 for s in steady["eigenvalues"]))
            said = " ".join(subprocess.run([runs.command, "check", path], capture_output=True, text=True, check=True).stdout.split())
            self.assertIn("its buckling is not examined, because wheels creep on their rails", said)
            self.assertNotIn("buckles", said)
            run = subprocess.run([runs.command, "simulate", path, "--t-end", "0.1"], capture_output=True, text=True, check=True)
            self.assertNotIn("buckles", run.stderr)


class Tram(unittest.TestCase):
    def test_loads(self):
        """On straight track the wheels carry what statics say of the tram with rigid cars, whatever the cars' deformation."""
        known = {row.split(",")[0]: float(row.split(",")[1]) for row in (ROOT / "examples/tram/reference.csv").read_text().splitlines()[1:]}
        first = runs.simulated(TRAM, "--t-end", 1, "--output-step", 0.5, *LONGER, V=10, before=100, rough=0)[1][-1]
        self.assertLess(abs(first["guidance.a_FL.Q"] / known["a_FL"] - 1), 2e-3)
        self.assertLess(abs(first["guidance.a_FR.Q"] / known["a_FR"] - 1), 2e-3)

    def test_curve(self):
        """Into the curve of 30 m: stiff cars guide the first bogie as the rigid ones of the tram do, and flexible ones within 2 %."""
        words = ("--t-end", 4, "--output-step", 0.05)
        rigid = runs.simulated(ROOT / "examples/tram/tram.yaml", *words)[1]
        for stiffness, near in ((1e12, 1e-3), (5e8, 2e-2)):
            found = runs.simulated(TRAM, *words, "--max-step", 0.01, "--rtol", 1e-4, before=10, rough=0, V=10, EI=stiffness)[1]
            for row, other in zip(found[-10:], rigid[-10:]):
                self.assertLess(abs(row["q.a_yaw"] - other["q.a_yaw"]), near * abs(other["q.a_yaw"]))


if __name__ == "__main__":
    runs.main()
