#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Limit cycles: van der Pol's oscillator beside SciPy and published digits, a normal form beside its closed form, and
Cooperrider's bogie beside the table that SciPy made.

    python3 tests/limit_cycles_published.py build/dev/kempe
"""
import cmath
import csv
import math
import sys
import unittest

sys.dont_write_bytecode = True
import runs
from runs import ROOT

MODELS = ROOT / "tests/models"
BOGIE = ROOT / "examples/cooperrider"


def cycles(model, sweep, *words, status=0, **values):
    return runs.kempe("cycles", model, "--sweep", sweep, *words, *runs.settings(**values), status=status)


def at(found, value, near=1e-12):
    """All cycles at a value of the parameter."""
    return [c for branch in found["branches"] for c in branch["cycles"] if abs(c["value"] - value) <= near]


def special(found, word):
    return [c for branch in found["branches"] for c in branch["cycles"] if c["point"] == word]


def largest(cycle):
    return max(abs(complex(*m)) for m in cycle["multipliers"])


def van_der_pol(mu):
    """Period, amplitude and multiplier of y'' - mu (1 - y^2) y' + y = 0: half a turn between two maxima of |y| by SciPy; the
    multiplier is the exponential of the integral of the divergence mu (1 - y^2) (Liouville)."""
    from scipy.integrate import solve_ivp

    def rates(_, z):
        return [z[1], mu * (1 - z[0] ** 2) * z[1] - z[0], mu * (1 - z[0] ** 2)]

    def turns(_, z):
        return z[1]

    turns.terminal = True
    start = [2.0, 0.0, 0.0]
    for _ in range(40):
        half = solve_ivp(rates, (1e-3, 60), solve_ivp(rates, (0, 1e-3), start, rtol=1e-13, atol=1e-13, method="DOP853").y[:, -1],
                         events=turns, rtol=1e-13, atol=1e-13, method="DOP853")
        time, end = half.t_events[0][0], half.y_events[0][0]
        if abs(abs(end[0]) - start[0]) < 1e-13:
            break
        start = [abs(end[0]), 0.0, 0.0]
    return 2 * time, abs(end[0]), math.exp(2 * end[2])


class VanDerPol(unittest.TestCase):
    """x = sqrt(a) y makes the model's oscillator that of van der Pol with mu = a."""

    @classmethod
    def setUpClass(cls):
        cls.found = cycles(MODELS / "van_der_pol.yaml", "a=-1:3:9")

    def test_hopf_point(self):
        (hopf,) = self.found["hopf"]
        self.assertLess(abs(hopf["value"]), 1e-13)
        self.assertLess(abs(hopf["frequency"] * 2 * math.pi - 1), 1e-13)
        self.assertEqual(hopf["grows"], "above")

    def test_published_digits(self):
        """At mu = 1: P. Amore, Computing the solutions of the van der Pol equation to arbitrary precision, arXiv:2111.12198."""
        (cycle,) = at(self.found, 1)
        self.assertLess(abs(cycle["period"] - 6.66328685932313), 1e-8)
        self.assertLess(abs(cycle["outputs"]["q.x"]["amplitude"] - 2.00861986087484), 1e-8)
        self.assertEqual(cycle["stability"], "stable")

    def test_scipy(self):
        try:
            import scipy  # noqa: F401
        except ImportError as missing:
            self.skipTest(str(missing))
        for mu in (0.5, 1, 1.5, 2):
            (cycle,) = at(self.found, mu)
            period, amplitude, multiplier = van_der_pol(mu)
            self.assertLess(abs(cycle["period"] - period), 1e-8)
            self.assertLess(abs(cycle["outputs"]["q.x"]["amplitude"] - math.sqrt(mu) * amplitude), 1e-8)
            self.assertLess(abs(cycle["multipliers"][0][0] - multiplier), 1e-8)
            self.assertLess(cycle["along"], 1e-8)

    def test_small_cycles(self):
        """T = 2 pi (1 + mu^2/16 - 5 mu^4/3072 + ..): Andersen and Geer, SIAM J. Applied Mathematics 42 (1982) 678."""
        count = 0
        for cycle in self.found["branches"][0]["cycles"][1:]:
            mu = cycle["value"]
            if mu < 0.1:
                count += 1
                self.assertLess(abs(cycle["period"] / (2 * math.pi) - (1 + mu**2 / 16 - 5 * mu**4 / 3072)), 1e-9 + mu**6)
        self.assertGreater(count, 5)


class NormalForm(unittest.TestCase):
    """r' = r (mu + r^2 - r^4): cycles at r^2 = (1 -+ sqrt(1 + 4 mu))/2 with the multiplier exp(T (mu + 3 r^2 - 5 r^4))."""

    @classmethod
    def setUpClass(cls):
        cls.found = cycles(MODELS / "bautin.yaml", "mu=-0.5:0.5:11", "--outputs", "state(x),state(y)")

    def test_cycles(self):
        count = 0
        for cycle in self.found["branches"][0]["cycles"][1:]:
            mu, r = cycle["value"], cycle["outputs"]["state.x"]["amplitude"]
            square = min(((1 + sign * cmath.sqrt(1 + 4 * mu).real) / 2 for sign in (-1, 1)), key=lambda x: abs(x - r * r))
            if abs(mu + 0.25) > 1e-6:
                self.assertLess(abs(r * r - square), 1e-8, mu)
            self.assertLess(abs(cycle["outputs"]["state.y"]["amplitude"] - r), 1e-8)
            self.assertLess(abs(cycle["period"] - 2 * math.pi / 3), 1e-8)
            radial = math.exp(cycle["period"] * (mu + 3 * r**2 - 5 * r**4))
            self.assertLess(min(abs(complex(*m) - radial) for m in cycle["multipliers"]), 1e-7, mu)
            if abs(radial - 1) > 1e-4:
                self.assertEqual(cycle["stability"], "unstable" if radial > 1 else "stable")
                count += 1
        self.assertGreater(count, 30)

    def test_fold(self):
        (fold,) = special(self.found, "fold")
        self.assertLess(abs(fold["value"] + 0.25), 1e-10)
        self.assertLess(abs(fold["outputs"]["state.x"]["amplitude"] - math.sqrt(0.5)), 1e-7)

    def test_requested_values(self):
        self.assertEqual(len(at(self.found, -0.2)), 2)
        self.assertEqual([c["stability"] for c in at(self.found, -0.2)], ["unstable", "stable"])
        self.assertEqual(len(at(self.found, 0.3)), 1)


class Bogie(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(BOGIE / "cycles.csv", newline="") as file:
            table = [[float(x) for x in row] for row in csv.reader(file) if row and row[0][0] in "123456789"]
        cls.table = [row for row in table if row[1] > 66.7]
        cls.chosen = cls.table[9]  # its branch ends near the Hopf point
        cls.found = cls.through(cls.chosen[1])

    @staticmethod
    def through(speed):
        """The branch with a cycle at a speed, and with the Hopf point."""
        pieces = math.ceil(2.7 / (speed - 66))
        return cycles(BOGIE / "cooperrider.yaml", f"V=66:{66 + pieces * (speed - 66)!r}:{pieces + 1}", "--outputs", "q(y1),q(y2),q(y3)",
                      start=0)

    def test_hopf_point(self):
        (hopf,) = self.found["hopf"]
        self.assertLess(abs(hopf["value"] / 68.644031211672 - 1), 1e-11)

    def test_fold(self):
        (fold,) = special(self.found, "fold")
        self.assertLess(abs(fold["value"] - 66.655375), 1e-6)
        self.assertLess(abs(fold["outputs"]["q.y1"]["amplitude"] - 9.354477e-3), 2e-9)
        self.assertLess(abs(fold["period"] - 0.2631603), 1e-7)

    def test_stability(self):
        """Unstable from the Hopf point to the fold, also where the front flange touches alone; stable from there upwards."""
        cycles_of = self.found["branches"][0]["cycles"]
        (fold,) = special(self.found, "fold")
        middle = cycles_of.index(fold)
        self.assertEqual({c["stability"] for c in cycles_of[1:middle]}, {"unstable"})
        self.assertEqual({c["stability"] for c in cycles_of[middle + 1:]}, {"stable"})
        between = [c for c in cycles_of[1:middle] if c["outputs"]["q.y1"]["amplitude"] > 9.11e-3]
        self.assertGreater(len(between), 2)
        self.assertGreater(min(largest(c) for c in between[:-3]), 1.2)

    def test_simulations(self):
        """The parameter in steps: no cycle upwards below the critical speed from 5 mm, and the stable one downwards to the fold."""
        found = cycles(BOGIE / "cooperrider.yaml", "V=66.5:70:8", "--outputs", "q(y1),q(y2),q(y3)", "--settle", "40 s")
        up, down = ({c["value"]: c for c in branch["cycles"]} for branch in found["branches"])
        self.assertEqual((up[67]["point"], up[68]["point"], down[66.5]["point"]), ("rest", "rest", "rest"))
        for branch, speed, y1 in ((up, 70, 10.1939), (down, 70, 10.1939), (down, 67, 9.4855)):
            self.assertEqual((branch[speed]["point"], branch[speed]["stability"]), (None, "stable"))
            self.assertLess(abs(1e3 * branch[speed]["outputs"]["q.y1"]["amplitude"] - y1), 1e-3)
        self.assertLess(abs(down[70]["period"] - 0.2510051), 1e-6)

    def test_table(self):
        """Rows of the table of SciPy at their speeds, to their digits: the speeds have six decimals, the lengths four in mm."""
        for y1, speed, period, y2, y3 in self.table if runs.FULL else [self.chosen]:
            found = self.found if speed == self.chosen[1] else self.through(speed)
            cycle = min(at(found, speed, 1e-9), key=lambda c: abs(c["outputs"]["q.y1"]["amplitude"] - 1e-3 * y1))
            steep = 1e-6 * 40  # mm by half a unit of the speed, where the branch is steepest
            self.assertLess(abs(cycle["period"] - period), 1e-7)
            for name, value in (("q.y1", y1), ("q.y2", y2), ("q.y3", y3)):
                self.assertLess(abs(1e3 * cycle["outputs"][name]["amplitude"] - value), 1e-4 + steep, (speed, name))


class WheelsetOnRails(unittest.TestCase):
    """A load holds its speed. The equations of hunting_rails.py are its own, also between rows of Kalker's table. Critical
    speeds differ by 4e-5, and cycles are compared at one distance from them."""

    SPRINGS = ROOT / "examples/restrained_wheelset"

    @classmethod
    def setUpClass(cls):
        """One branch has the Hopf point and both speeds: its first value lies as far below the lower one as the upper one above it."""
        with open(cls.SPRINGS / "hunting.csv", newline="") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        cls.critical, cls.wanted = float(rows[0]["speed"]), [{k: float(x) for k, x in row.items()} for row in rows[1:]]
        cls.linear = runs.kempe("modes", cls.SPRINGS / "hunting_wheelset.yaml", "--sweep", "V=95:105:3")["locus"]["critical"][0]["value"]
        low, high = cls.speeds = [cls.linear + row["speed"] - cls.critical for row in cls.wanted]
        cls.found = cycles(cls.SPRINGS / "hunting_wheelset.yaml", f"V={2 * low - high!r}:{high!r}:3", "--outputs", "q(y)")

    def test_hopf_point(self):
        """That of modes at a constant load; the critical speed of linear creep is 3 m/s above it."""
        (hopf,) = self.found["hopf"]
        self.assertLess(abs(hopf["value"] / self.linear - 1), 1e-9)
        self.assertLess(abs(hopf["value"] / self.critical - 1), 5e-5)

    def test_cycles(self):
        for row, speed in zip(self.wanted, self.speeds):
            (cycle,) = at(self.found, speed, 1e-9)
            with self.subTest(speed=row["speed"]):
                self.assertEqual(cycle["stability"], "stable")
                self.assertLess(abs(cycle["outputs"]["q.y"]["amplitude"] / row["amplitude"] - 1), 0.015)
                self.assertLess(abs(cycle["period"] / row["period"] - 1), 1e-4)
                self.assertLess(abs(cycle["loads"]["x"] / row["load"] - 1), 0.04)

    def test_load_without_motion(self):
        """The load at the Hopf point is that of the equilibrium."""
        hopf = self.found["branches"][0]["cycles"][0]
        still = runs.kempe("equilibrium", self.SPRINGS / "hunting_wheelset.yaml", *runs.settings(V=hopf["value"]))
        self.assertLess(abs(hopf["loads"]["x"] / still["loads"]["x"] - 1), 1e-6)

    def test_simulation(self):
        """At a held speed, from 3.3 mm aside."""
        speed = self.speeds[-1]
        found = cycles(self.SPRINGS / "hunting_wheelset.yaml", f"V={speed!r}:{speed + 0.1!r}:2", "--outputs", "q(y)", "--settle", "60 s",
                       "--set", "aside=3.3 mm")
        (cycle,) = at(self.found, speed, 1e-9)
        settled = at(found, speed)[0]
        self.assertLess(abs(settled["outputs"]["q.y"]["amplitude"] / cycle["outputs"]["q.y"]["amplitude"] - 1), 5e-3)
        self.assertLess(abs(settled["period"] / cycle["period"] - 1), 1e-3)
        self.assertLess(abs(settled["loads"]["x"] / cycle["loads"]["x"] - 1), 2e-2)


if __name__ == "__main__":
    runs.main()
