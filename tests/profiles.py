#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The cross-sections in examples/profiles: what their definitions make, near points that others published, functions of y."""
import csv
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "examples/profiles"

# Points of the profiles of the Manchester contact benchmark as CONTACT (open source) has them, MBench_S1002_v3.prw and
# MBench_UIC60_v3.prr, mm: y inwards and z downwards of the wheel; y and z downwards of the rail, inclined by 1:40.
S1002 = [(68.450512, 17.337705), (61.865188, 25.842215), (55.279865, 27.996736), (48.694541, 26.233365),
         (42.398898, 20.619357), (41.20625, 18.780046), (40.409365, 17.23821), (38.335925, 11.757921),
         (34.943381, 6.815738), (30.64214, 4.1708523), (25.580201, 2.6414043), (19.864809, 1.5764272),
         (13.564708, 0.82377017), (6.7389058, 0.3063741), (-0.52447632, -0.017188102), (-8.053294, -0.18390044),
         (-15.540845, -0.26044927), (-22.59602, -0.36046062), (-28.962879, -0.59026145), (-34.898296, -0.96222941),
         (-40.825087, -1.3573488), (-46.751878, -1.7524683), (-52.67867, -2.1475877), (-58.605461, -2.5427071)]
UIC60 = [(-43.08906, 14.566214), (-42.346773, 11.134261), (-41.233973, 8.8160218), (-39.704747, 6.7818725),
         (-37.696371, 5.0034021), (-35.148935, 3.58194), (-32.010725, 2.6421255), (-28.253335, 1.8275158),
         (-23.853633, 1.1102623), (-18.800542, 0.59313022), (-13.102013, 0.28650154), (-6.7933312, 0.077060361),
         (-0.60326698, 0.00061851353), (4.9687627, 0.058655187), (9.9040297, 0.38200589), (14.196592, 0.91432026),
         (17.855887, 1.5561759), (20.911912, 2.4319744), (23.411547, 3.8197104), (25.401535, 5.5611066),
         (26.938697, 7.5726169)]


def read(name):
    """In mm."""
    with open(FOLDER / name, newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [(1e3 * float(row["y"]), 1e3 * float(row["z"])) for row in rows]


def distance(points, p):
    """Of p from the line through the points."""
    best = math.inf
    for a, b in zip(points, points[1:]):
        along = (b[0] - a[0], b[1] - a[1])
        part = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2)
        part = min(1, max(0, part))
        best = min(best, math.hypot(a[0] + part * along[0] - p[0], a[1] + part * along[1] - p[1]))
    return best


def upright(p):
    """A point of the inclined rail in the upright one, whose origin is where it fits best."""
    angle = math.atan(1 / 40)
    c, s, y, z = math.cos(angle), math.sin(angle), p[0] + 7.4917, -p[1] + 0.0937
    return c * y + s * z, c * z - s * y


class Profiles(unittest.TestCase):
    def test_they_are_what_the_definitions_make(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, FOLDER / "make_profiles.py", folder], check=True)
            made = {path.name: path.read_bytes() for path in pathlib.Path(folder).iterdir()}
        files = [path for path in FOLDER.iterdir() if path.suffix in (".csv", ".whl")]
        self.assertEqual(made, {path.name: path.read_bytes() for path in files})

    def test_they_are_functions_that_are_fine_where_they_bend(self):
        for path in FOLDER.glob("*.csv"):
            points = read(path.name)
            slopes = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(points, points[1:])]
            turns = [abs(math.atan(b) - math.atan(a)) for a, b in zip(slopes, slopes[1:])]
            self.assertGreater(min(b[0] - a[0] for a, b in zip(points, points[1:])), 0, path.name)
            self.assertLess(max(turns), math.radians(3), path.name)
            self.assertLess(max(map(abs, slopes)), math.tan(math.radians(87)), path.name)

    def test_published_points_lie_on_them(self):
        wheel, rail, standard = read("s1002.csv"), read("uic60_manchester.csv"), read("uic60.csv")
        self.assertLess(max(distance(wheel, (-y, -z)) for y, z in S1002), 0.003)
        self.assertLess(max(distance(rail, upright(p)) for p in UIC60 if abs(upright(p)[0]) < rail[-1][0]), 0.003)
        self.assertLess(max(distance(standard, upright(p)) for p in UIC60 if abs(upright(p)[0]) < 35.9), 0.05)

    def test_they_begin_where_they_should(self):
        for path in FOLDER.glob("*.csv"):
            self.assertLess(distance(read(path.name), (0, 0)), 2e-4, path.name)


if __name__ == "__main__":
    unittest.main()
