#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Cooperrider's bogie: critical speed, motion and limit cycles against the digits of examples/cooperrider, made by SciPy.

    PYTHONPATH=build/dev/python python3 tests/cooperrider.py build/dev/kempe
"""
import pathlib
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
import runs
from runs import ROOT

sys.path.insert(0, str(ROOT / "examples/cooperrider"))
MODEL = ROOT / "examples/cooperrider/cooperrider.yaml"
CRITICAL, OMEGA = 68.644031211672, 25.121637019927  # m/s, rad/s
EIGENVALUES = (-382.184659, -382.095946, -266.451768, -266.321586, -14.943968, -9.028819, -5.860404, -3.256412, -0.962951)


class Bogie(unittest.TestCase):
    def test_eigenvalues(self):
        found = runs.kempe("modes", MODEL, "--set", "start=0")["eigenvalues"]
        for known in EIGENVALUES:
            self.assertLess(min(abs(real - known) for real, _ in found), 1e-6)

    def test_critical_speed(self):
        critical = runs.kempe("modes", MODEL, "--set", "start=0", "--sweep", "V=60:75:16")["locus"]["critical"]
        self.assertEqual(len(critical), 1)
        self.assertLess(abs(critical[0]["value"] / CRITICAL - 1), 1e-11)
        self.assertLess(abs(critical[0]["eigenvalue"][1] / OMEGA - 1), 1e-11)

    def test_motion(self):
        rows = runs.simulated(MODEL, "--rtol", 1e-12, "--atol", 1e-14)[1]
        known = runs.rows(MODEL.parent / "reference.csv")
        self.assertEqual(len(rows), len(known))
        for row, reference in zip(rows, known):
            for name, value in reference.items():
                self.assertLess(abs(row[name] - value), 1e-10 if name.startswith("qd") else 1e-11, (row["t"], name))

    def amplitude(self, speed, start):
        """Of the front wheelset after a minute."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "run.npz"        # read in no time, unlike 60000 rows of text
            runs.kempe("simulate", MODEL, "--no-convergence-check", "--t-end", 60, "--output-step", 1e-3, "-o", path,
                       *runs.settings(V=speed, start=start))
            with np.load(path) as table:
                return abs(table["values"][-500:, list(table["names"]).index("q.y1")]).max()

    def test_stable_motions(self):
        """Below the lowest speed of a limit cycle a large displacement decays, above the critical speed a small one grows to it."""
        self.assertLess(self.amplitude(66.5, 20e-3), 1e-4)
        self.assertLess(abs(self.amplitude(70.000568, 2e-3) - 10.194e-3), 1e-6)

    def test_limit_cycles(self):
        try:
            import kempe  # noqa: F401  no package belongs to builds with sanitizers
            from cycles_cooperrider import compare
        except ImportError as missing:
            self.skipTest(str(missing))
        own, known = compare()
        self.assertEqual(len(own), len(known))
        for row, reference in zip(own, known):
            for k, allowed in enumerate((2e-6, 2e-6, 2e-7, 2e-4, 2e-4)):  # of the digits of the table, and of the fold's amplitude
                self.assertLessEqual(abs(row[k] - reference[k]), allowed, reference)


if __name__ == "__main__":
    runs.main()
