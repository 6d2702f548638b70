#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The forces that pages draw as arrows: at the times of the table they are the forces of its outputs, and by their places and directions
they move the bodies as Newton's and Euler's laws say. Called with the path of the command:

    python3 tests/page_arrows.py build/dev/kempe [unittest arguments]
"""
import base64
import csv
import json
import math
import struct
import sys
import unittest

import report_pages
from report_pages import ROOT, Folder, data_of, kempe

GRAVITY, MASS, INERTIA = (1.5, -9.81), 2.0, 0.012

# A body that moves freely in the plane touches what each case says. The second part has the section `start`.
PLANE = f"""kempe: 1
gravity: [{GRAVITY[0]}, {GRAVITY[1]}, 0]
ground: {{points: {{O: [0, 0, 0], C: [0, -0.5, 0]}}}}
tables: {{hill: {{x: [-1, -0.5, 0, 0.5, 1], y: [0, 0.02, 0, -0.05, -0.2], method: spline}}}}
outlines:
  step: {{polygon: [[-2, -0.3], [0.2, -0.3], [0.2, 0], [-2, 0]], round: 5 mm}}
  petals: {{closed: yes, copies: 5, path: [[0.4, 0], {{arc: [0.1236068, 0.3804226], through: [0.2, 0.14530851]}}]}}
  block: {{rectangle: [0.2, 0.1]}}
bodies:
  b:
    joint: {{motions: [T1, T2, R3], coordinates: [x, y, a], at: ground.O}}
    mass: {MASS}
    inertia: {{zz: {INERTIA}}}
    points: {{C: [0, 0, 0]}}
"""

#   name: contact, start, whether its friction turns the body
CASES = {
    "plane": ("cylinder: b.C, radius: 0.1, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.1", "q: {y: 0.1}, qd: {x: 1, a: 4}"),
    "plane against its axis": ("cylinder: b.C, radius: 0.1, on: {plane: ground.O, normal: -x}, restitution: 0.2, friction: 0.3", "q: {x: -0.1}, qd: {y: 1}"),
    "cylinder": ("cylinder: b.C, radius: 0.1, on: {cylinder: ground.C, radius: 0.4}, restitution: 0, friction: 0.2", "qd: {x: -0.5, a: -3}"),
    "hollow": ("cylinder: b.C, radius: 0.1, on: {cylinder: ground.O, radius: 0.4, inside: yes}, restitution: 0, friction: 0.2", "q: {y: -0.3}, qd: {x: 1}"),
    "profile": ("cylinder: b.C, radius: 0.02, on: {profile: hill, at: ground.O}, restitution: 0, friction: 0.3", "q: {y: 0.03}, qd: {x: -0.2}"),
    "step": ("cylinder: b.C, radius: 0.1, on: {outline: step, at: ground.O}, restitution: 0, friction: 0.4", "q: {y: 0.1, x: -0.1}, qd: {x: 0.4}"),
    "corner": ("cylinder: b.C, radius: 0.1, on: {outline: step, at: ground.O}, restitution: 0, friction: 0.4", "q: {y: 0.1, x: 0.1}, qd: {x: 0.9, a: -5}"),
    "petals": ("cylinder: b.C, radius: 0.03, on: {outline: petals, at: ground.C}, restitution: 0.1, friction: 0.4", "q: {x: -0.1}"),
    "block": ("outline: block, at: b.C, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.3", "q: {y: 0.1, a: 0.2}"),
    "law": ("cylinder: b.C, radius: 0.1, on: {plane: ground.O, normal: y}, law: hunt_crossley, stiffness: 1e6, damping: 1, friction: {coefficient: 0.3, speed: 1 mm/s}", "q: {y: 0.12}, qd: {a: 20}"),
    # stiff: the way along an outline is that of surfaces that just touch
    "law on petals": ("cylinder: b.C, radius: 0.03, on: {outline: petals, at: ground.C}, law: hunt_crossley, stiffness: 1e8, damping: 20, friction: {coefficient: 0.3, speed: 5 mm/s}", "q: {x: -0.1, y: -0.2418}, qd: {a: 20}"),
}


def unpacked(text, kind):
    """The numbers of a string in base64: "h" of two bytes, "f" of four."""
    read = base64.b64decode(text)
    return struct.unpack(f"<{len(read) // struct.calcsize(kind)}{kind}", read)


def arrows(file):
    """The times of the arrows of a page, or of the data of a picture, and for each arrow its row with the forces and the places that move."""
    told = (json.loads(file.read_text()) if file.suffix == ".json" else data_of(file))["picture"]["arrows"]
    x, parts, places = unpacked(told["x"], "f"), unpacked(told["parts"], "h"), unpacked(told["places"], "h")
    rows, moving = told["rows"], 0
    width = sum("at" not in row for row in rows)
    for k, row in enumerate(rows):
        row["force"] = [[told["most"] / 32767 * parts[3 * (len(rows) * i + k) + j] for j in range(3)] for i in range(len(x))]
        if "at" not in row:
            row["place"] = [[told["farthest"] / 32767 * places[3 * (width * i + moving) + j] for j in range(3)] for i in range(len(x))]
            moving += 1
    return told, x, rows


class Arrows(Folder):
    def make(self, text, step, *options, file="page.html"):
        """The arrows of a model and the rows of its table at their times: pairs of an instant and a row."""
        model, picture, table = (self.folder / name for name in ("model.yaml", file, "table.csv"))
        model.write_text(text)
        made = kempe("simulate", model, "--animation" if file.endswith(".json") else "--report", picture, "-o", table, "--output-step", step, *options)
        self.assertEqual(made.returncode, 0, made.stderr)
        told, x, rows = arrows(picture)
        with table.open() as file:
            lines = [{key: float(value) for key, value in line.items() if value} for line in csv.DictReader(file)]
        common = [(k, line) for k, t in enumerate(x) for line in lines if abs(line["t"] - t) < 1e-7 * max(1, abs(x[-1]))]
        self.assertGreater(len(common), 20)
        self.most = told["most"]
        return rows, common

    def test_plane_motion(self):
        """m a = m g + F and I alpha = r x F, with r from the centre of mass to the place of the contact."""
        for name, file in [*((name, "page.html") for name in CASES), ("plane", "motion.json"), ("law", "motion.json")]:
            with self.subTest(name, file=file):
                contact, start = CASES[name]
                text = PLANE + f"contacts: {{k: {{{contact}}}}}\nstart: {{{start}}}\nrun: {{t_end: 0.4, rtol: 1e-9, outputs: [q, qd, qdd]}}\n"
                rows, common = self.make(text, "2 ms", file=file)
                rows = [row for row in rows if row["kind"] == "contacts"]
                self.assertTrue(rows and all((row["name"], row["body"]) == ("k", 1) for row in rows))
                pressed, slope, far = 0, 0, 1e-3 * self.most
                for k, line in common:
                    force = [sum(row["force"][k][i] for row in rows) for i in range(3)]
                    moment = sum(row["place"][k][0] * row["force"][k][1] - row["place"][k][1] * row["force"][k][0] for row in rows)
                    for i, axis in enumerate("xy"):
                        self.assertAlmostEqual(force[i], MASS * (line[f"qdd.{axis}"] - GRAVITY[i]), delta=far, msg=f"{axis} at {line['t']}")
                    self.assertAlmostEqual(moment, INERTIA * line["qdd.a"], delta=0.2 * far, msg=f"moment at {line['t']}")
                    pressed += math.hypot(*force) > 1
                    slope += abs(moment) > 0.4 * far
                self.assertGreater(pressed, len(common) // 4)
                self.assertGreater(slope, 0)


    def balance(self, rows, common, mass, gravity, columns):
        """m a = m g + F of one body, by all arrows on it; the columns of its accelerations along x, y, z, or None."""
        for k, line in common:
            for i, column in enumerate(columns):
                if column:
                    force = sum(row["force"][k][i] for row in rows)
                    self.assertAlmostEqual(force, mass * (line[column] - gravity[i]), delta=1e-3 * self.most, msg=f"{column} at {line['t']}")

    def test_sphere_in_space(self):
        """A ball that does not turn slides on a slope, with friction in two directions; on a globe, rigid and with a law."""
        for name, surface in {"plane": "plane: ground.O, normal: z", "globe": "sphere: ground.G, radius: 0.9"}.items():
            for law in ("restitution: 0, friction: 0.2", "law: hunt_crossley, stiffness: 1e7, damping: 2, friction: {coefficient: 0.2, speed: 1 mm/s}"):
                with self.subTest(name, law=law):
                    text = f"""kempe: 1
gravity: [1, 2, -9]
ground: {{points: {{O: [0, 0, 0], G: [0, 0, -0.9]}}}}
bodies: {{b: {{joint: {{motions: [T1, T2, T3], coordinates: [x, y, z], at: ground.O}}, mass: 3, points: {{C: [0, 0, 0]}}}}}}
contacts: {{k: {{sphere: b.C, radius: 0.1, on: {{{surface}}}, {law}}}}}
start: {{q: {{z: 0.1}}, qd: {{x: 0.4, y: -0.3}}}}
run: {{t_end: 0.2, rtol: 1e-9, outputs: [q, qd, qdd, force(k)]}}
"""
                    rows, common = self.make(text, "2 ms")
                    rows = [row for row in rows if row["kind"] == "contacts"]
                    self.assertEqual(len(rows), 1)
                    self.balance(rows, common, 3, (1, 2, -9), ("qdd.x", "qdd.y", "qdd.z"))
                    self.assertGreater(max(abs(row["force"][k][0]) for row in rows for k, _ in common), 0.05 * self.most)
                    if name == "plane":
                        normal = next(key for key in common[0][1] if key.startswith("force.k"))
                        for k, line in common:
                            self.assertAlmostEqual(rows[0]["force"][k][2], line[normal], delta=1e-4 * self.most)
                            if line[normal] > 0:
                                self.assertAlmostEqual(rows[0]["place"][k][2], -0.1, delta=1e-3)

    def test_equilibrium(self):
        """A block that friction and a contact hold on a slope: both together carry its weight."""
        model, page = self.folder / "rest.yaml", self.folder / "rest.html"
        model.write_text("""kempe: 1
gravity: [1, -9.81, 0]
ground: {points: {O: [0, 0, 0]}}
bodies: {b: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground.O}, mass: 2, points: {C: [0, 0, 0]}}}
contacts: {k: {sphere: b.C, radius: 0.1, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.3}}
start: {q: {y: 0.1}}
run: {t_end: 0.1}
""")
        made = kempe("equilibrium", model, "--stick", "--report", page)
        self.assertEqual(made.returncode, 0, made.stderr)
        (contact,) = arrows(page)[2]
        for given, wanted in ((contact["force"][0], (-2, 19.62, 0)), (contact["place"][0], (0, -0.1, 0))):
            self.assertLess(math.dist(given, wanted), 1e-3)

    def test_tyre(self):
        """Of the car on a bump: components of force(T) along the axes of the contact, on the slope of the road; the carrier and the wheel
        have no other force along z than the spring and gravity."""
        text = (ROOT / "examples/quarter_car_on_tyre/quarter_car_on_tyre.yaml").read_text()
        (self.folder / "passenger_car_tyre.tir").write_text((ROOT / "examples/quarter_car_on_tyre/passenger_car_tyre.tir").read_text())
        rows, common = self.make(text.replace("outputs: [q, qd, ", "outputs: [q, qd, qdd, position(wheel.C), "), "10 ms")
        rows = {row["label"]: row for row in rows if row["kind"] == "tyres"}
        self.assertEqual(set(rows), {"Fx", "Fz"})
        inclined = 0
        for k, line in common:
            x = line["position.wheel.C.x"] - 2
            slope = 0.015 * 2 * math.pi / 1.2 * math.sin(2 * math.pi * x / 1.2) if 0 < x < 1.2 else 0
            along = [1 / math.hypot(1, slope), 0, slope / math.hypot(1, slope)]
            axes = {"Fx": along, "Fz": [-along[2], 0, along[0]]}
            for label, axis in axes.items():
                for i in range(3):
                    self.assertAlmostEqual(rows[label]["force"][k][i], axis[i] * line[f"force.T.{label[1]}"], delta=1e-4 * self.most)
            if line["force.T.z"] > 0:
                height = line["position.wheel.C.z"] - 0.015 * (1 - math.cos(2 * math.pi * x / 1.2)) * (0 < x < 1.2)
                for i, away in enumerate((height * along[2] * along[0], 0, -height * along[0] ** 2)):
                    self.assertAlmostEqual(rows["Fz"]["place"][k][i], away, delta=1e-4)
            inclined += abs(slope) > 0.02
        self.assertGreater(inclined, 5)

    def test_rope(self):
        """The tension of a rope at both ends, along its spans: a block hangs on a rope over a fixed sheave from a drum, which winds it up."""
        text = """kempe: 1
gravity: [0, -9.81, 0]
ground: {points: {O: [0, 0, 0], S: [2, 3, 0]}}
bodies:
  drum: {joint: {name: d, revolute: z, at: ground.O}, mass: 5, inertia: {zz: 0.2}, points: {C: [0, 0, 0]}}
  block: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground.O}, mass: 4, points: {P: [0, 0, 0]}}
ropes: {rope: {along: [{drum: drum.C, radius: 0.2, turn: left}, {round: ground.S, radius: 0.3, turn: right}, block.P], slack: no}}
forces: {motor: {joint: d, torque: 14}}
start: {q: {x: 2.6, y: 1}}
run: {t_end: 1, rtol: 1e-9, outputs: [q, qd, qdd, tension(rope)]}
"""
        rows, common = self.make(text, "10 ms")
        ends = [row for row in rows if row["kind"] == "ropes"]
        self.assertEqual(sorted(row["body"] for row in ends), [1, 2])
        drum, block = sorted(ends, key=lambda row: row["body"])
        self.balance([block], common, 4, (0, -9.81, 0), ("qdd.x", "qdd.y", None))
        for k, line in common:
            (x, y, _), (fx, fy, _) = drum["place"][k], drum["force"][k]
            self.assertAlmostEqual(math.hypot(fx, fy), abs(line["tension.rope"]), delta=1e-4 * self.most)
            self.assertAlmostEqual(math.hypot(x, y), 0.2, delta=1e-4)
            self.assertAlmostEqual(14 + x * fy - y * fx, 0.2 * line["qdd.d"], delta=2e-4 * self.most)

    def test_teeth(self):
        """The force of teeth at the pitch point is the reaction of the mesh; it turns the second wheel."""
        text = (ROOT / "examples/crane/crane.yaml").read_text()
        rows, common = self.make(text.replace("outputs: [", "outputs: [reaction(drive), ", 1), "20 ms", "--t-end", "1")
        (teeth,) = [row for row in rows if row["kind"] == "gears"]
        for k, line in common:
            for i, axis in enumerate("xyz"):
                self.assertAlmostEqual(teeth["force"][k][i], line[f"reaction.drive.{axis}"], delta=1e-4 * self.most)

    def test_follower(self):
        """An ideal follower: the force of its cam lifts it, and acts at the rim of its roller."""
        text = """kempe: 1
gravity: [0, -9.81, 0]
ground: {points: {O: [0, 0, 0]}}
outlines: {disc: {law: [{to: 90 deg, rise: 10 mm, by: cycloidal}, {to: 180 deg}, {to: 270 deg, rise: -10 mm, by: polynomial_345}, {to: 360 deg}], base: 32 mm, follower: {roller: 8 mm}}}
bodies:
  shaft: {joint: {name: s, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1e-3}, points: {C: [0, 0, 0]}}
  rod: {joint: {name: lift, prismatic: y, at: ground.O}, mass: 0.5, points: {P: [0, 0, 0]}}
loops: {cam: {follower: rod.P, roller: 8 mm, on: {outline: disc, at: shaft.C}}}
drives: {turn: {joint: s, angle: "20*t/(1 s) + 60 deg"}}
start: {q: {lift: 40 mm}}
run: {t_end: 0.3, rtol: 1e-9, outputs: [q, qdd, force(cam)]}
"""
        rows, common = self.make(text, "2 ms")
        (cam,) = [row for row in rows if row["name"] == "cam"]
        self.assertEqual(cam["kind"], "contacts")
        sign = 1 if cam["body"] == 2 else -1
        for k, line in common:
            fx, fy, _ = cam["force"][k]
            self.assertAlmostEqual(sign * fy, 0.5 * (line["qdd.lift"] + 9.81), delta=1e-3 * self.most)
            self.assertAlmostEqual(math.hypot(fx, fy), abs(line["force.cam"]), delta=1e-4 * self.most)
            if line["force.cam"] > 0.05 * self.most:
                self.assertAlmostEqual(math.dist(cam["place"][k], (-8e-3 * fx / math.hypot(fx, fy), -8e-3 * fy / math.hypot(fx, fy), 0)), 0, delta=1e-5)


def main():
    report_pages.KEMPE = sys.argv[1]
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])


if __name__ == "__main__":
    sys.exit(main())
