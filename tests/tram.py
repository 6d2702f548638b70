#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The tram from straight track into its curve, through the command: wheel loads by statics, momentum and forces by own kinematics.

    python3 tests/tram.py build/dev/kempe
"""
import csv
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
G, R, LEAD, BEFORE, CAR, MASS = 9.81, 30, 20, 10, 7.6, 31900
CANT = math.asin(0.150 / 1.507)  # over the distance of the rails' middles
CARS = {"a": 8500, "b": 5500, "c": 8500}
TRAVERSE, MOTOR = (MASS - 22500 - 3 * 2189) / 3 - 640, 320
WHEELS = [f"{p}_{w}" for p in "abc" for w in ("FL", "FR", "RL", "RR")]


def turn(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    m = [[float(r == k) for k in range(3)] for r in range(3)]
    m[i][i], m[i][j], m[j][i], m[j][j] = c, -s, s, c
    return m


def times(a, b):
    return [[sum(a[r][k] * b[k][c] for k in range(3)) for c in range(3)] for r in range(3)]


class Frame:
    """A place and axes; `then` goes on from a point of it, by rotations about axes 0, 1, 2."""

    def __init__(self, at=(0, 0, 0), axes=turn(0, 0)):
        self.at, self.axes = at, axes

    def point(self, x, y, z):
        return tuple(self.at[r] + sum(self.axes[r][k] * v for k, v in enumerate((x, y, z))) for r in range(3))

    def then(self, point, *turns):
        axes = self.axes
        for axis, angle in turns:
            axes = times(axes, turn(axis, angle))
        return Frame(self.point(*point), axes)


def places(row, k):
    """Of bogie k: (mass, centre) of all that moves with it, and the hubs of its wheels."""
    p = "abc"[k]
    q = lambda name: row[f"q.{p}_{name}"]
    front = Frame().then((q("x") - k * CAR, q("y"), 0.32 + q("z")), (2, q("yaw")), (0, q("roll")), (1, q("pitch")))
    rear = front.then((-0.9, 0, -0.05), (0, q("warp")), (1, q("rear_pitch")), (2, q("rear_yaw")))
    cradle = front.then((-0.765, 0, q("stroke")), (1, q("tilt")))
    traverse = cradle.then((0, 0, 0.10 + q("lift")), (0, q("lean")))
    car = traverse.then((0, 0, 0), (2, q("car_yaw")), (1, q("car_pitch")))
    hubs = {f"{p}_FL": front.point(0, 0.75, 0), f"{p}_FR": front.point(0, -0.75, 0),
            f"{p}_RL": rear.point(-0.8, 0.75, -0.0825), f"{p}_RR": rear.point(-0.8, -0.75, -0.0825)}
    masses = [(900, front.point(-0.25, 0, 0)), (420, rear.point(-0.45, 0, -0.03)), (300, cradle.point(0, 0, 0.05)),
              (30, front.point(-0.9, 0, -0.17)), (15, front.point(-0.44, 0, -0.15)), (16, front.point(-0.5, 0, -0.10)),
              (8, rear.point(-0.35, 0.35, 0.05)), (2 * MOTOR, front.point(-0.25, 0, 0.05)),
              (TRAVERSE, traverse.point(0, 0, 0.05)), (CARS[p], car.point(0, 0, 0.93))]
    return masses + [(180 if name[2] == "F" else 70, at) for name, at in hubs.items()], hubs


def centre(row):
    """Of all masses."""
    masses = [one for k in range(3) for one in places(row, k)[0]]
    assert abs(sum(m for m, _ in masses) - MASS) < 1e-6
    return [sum(m * at[i] for m, at in masses) / MASS for i in range(3)]


def middle_of_curve():
    """The transition's heading is s^2/(2 R LEAD): its end by Simpson's rule, and from there R to the left."""
    n, x, y = 400, 0, 0
    for i in range(n + 1):
        weight = (1 if i in (0, n) else 4 if i % 2 else 2) * LEAD / n / 3
        heading = (i / n * LEAD)**2 / (2 * R * LEAD)
        x, y = x + weight * math.cos(heading), y + weight * math.sin(heading)
    end = LEAD / (2 * R)
    return BEFORE + x - R * math.sin(end), y + R * math.cos(end)


def force(row):
    """Of all wheels, ground axes; each in the track's axes at its hub, all of which are in the curve."""
    x0, y0 = middle_of_curve()
    total = [0, 0, 0]
    for k in range(3):
        for wheel, (x, y, _) in places(row, k)[1].items():
            along, left, up = (row[f"force.{wheel}.{c}"] for c in "xyz")
            away = math.hypot(x - x0, y - y0)
            inward = ((x0 - x) / away, (y0 - y) / away)
            across = left * math.cos(CANT) + up * math.sin(CANT)
            total[0] += along * inward[1] + across * inward[0]
            total[1] += -along * inward[0] + across * inward[1]
            total[2] += up * math.cos(CANT) - left * math.sin(CANT)
    return total


def mean(rows, of):
    return sum(of(row) for row in rows) / len(rows)


class Ride(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "tram.csv"
            done = subprocess.run([KEMPE, "simulate", ROOT / "examples/tram/tram.yaml", "--once", "-o", path],
                                  capture_output=True, text=True, timeout=250)
            assert done.returncode == 0, done.stdout + done.stderr
            with open(path, newline="") as file:
                cls.rows = [{key: float(x) for key, x in row.items()} for row in csv.DictReader(line for line in file if line[0] != "#")]

    def test_straight(self):
        """Before the transition each wheel carries what statics say."""
        with open(ROOT / "examples/tram/reference.csv", newline="") as file:
            wanted = {row["wheel"]: float(row["load"]) for row in csv.DictReader(file)}
        rows = [row for row in self.rows if 0.6 <= row["t"] < 1]
        self.assertEqual(list(wanted), WHEELS)
        self.assertAlmostEqual(sum(wanted.values()), MASS * G, 3)
        for wheel, load in wanted.items():
            with self.subTest(wheel):
                found = mean(rows, lambda r: r[f"force.{wheel}.z"])
                self.assertLess(abs(found / load - 1), 2e-3, (found, load))

    def test_momentum(self):
        """In the curve forces of the wheels are the weight and what turns the momentum, its mean over a second."""
        rows, dt = self.rows, self.rows[1]["t"] - self.rows[0]["t"]
        for begin in (5, 6, 7):
            first = round(begin / dt)
            last = min(first + round(1 / dt), len(rows) - 2)
            speed = [[(b - a) / (2 * dt) for a, b in zip(centre(rows[k - 1]), centre(rows[k + 1]))] for k in (first, last)]
            span = (last - first) * dt
            forces = [force(row) for row in rows[first:last + 1]]
            found = [(sum(f[i] for f in forces) - (forces[0][i] + forces[-1][i]) / 2) * dt / span for i in range(3)]
            wanted = [MASS * ((speed[1][i] - speed[0][i]) / span + (G if i == 2 else 0)) for i in range(3)]
            with self.subTest(begin):
                print("  %g s: %s N, by momentum %s N" % (begin, " ".join("%.0f" % f for f in found), " ".join("%.0f" % f for f in wanted)))
                self.assertGreater(math.hypot(*wanted[:2]), 1e5)
                for a, b in zip(found, wanted):
                    self.assertLess(abs(a - b), 100)

    def test_guided(self):
        """Flanges of the leading outer wheels guide, none near to climbing (Nadal: 1.34), and no wheel lifts off."""
        settled = [row for row in self.rows if row["t"] > 7]
        ratio = lambda row, wheel: row[f"force.{wheel}.y"] / row[f"force.{wheel}.z"]
        for p in "abc":
            self.assertTrue(0.3 < mean(settled, lambda r: ratio(r, p + "_FR")) < 0.6)
            self.assertLess(abs(mean(settled, lambda r: ratio(r, p + "_FL")) + 0.35), 0.05)
        self.assertGreater(min(row[f"force.{w}.z"] for row in settled for w in WHEELS), 10e3)


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
