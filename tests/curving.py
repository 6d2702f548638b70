#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Wheels on tracks that bend, lean and are not even, through the command, against closed forms and the balance of forces.

    python3 tests/curving.py build/dev/kempe
"""
import math
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import runs
from curve import Frame, Track, cross
from runs import ROOT

G, R0, B, RAIL = 9.81, 0.46, 0.75, 0.08  # of tests/models/curve.yaml and examples/rolling_wheel
WAVE = """kempe: 1
gravity: [0, 0, -9.81]
parameters: {A: 1e-6, V: 20, speed: 20, mass: 5000}
tables:
  wave: {x: [%s], y: [%s]}
profiles:
  tread: {y: [-30 mm, -10 mm, 10 mm, 30 mm], z: [-0.3 mm, -0.1 mm, 0.1 mm, 0.3 mm]}
  head: {csv: examples/profiles/circular.csv, y: y, z: z}
tracks: {line: {at: ground.O, rail: head, gauge: 1435 mm, gauge_depth: 1 mm, irregularities: {level: wave}}}
ground: {points: {O: [0, 0, 0]}}
bodies:
  cart: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground.O}, mass: mass}
  wheel: {joint: {name: spin, revolute: y, at: cart}, mass: 0, inertia: {yy: 1}, points: {C: [0, 0.73, 0]}}
wheels:
  L: {on: line.left, at: wheel.C, profile: tread, radius: 0.5, contact: elastic, creep: none, stiffness: 1e11, damping: 200}
start: {q: {z: 0.5}, qd: {x: V}}
run: {t_end: 1, output_step: 0.0005, rtol: 1e-12, atol: 1e-14, integrator: radau9, outputs: [q, force(L)]}
"""


def simulate(text, *words, **values):
    """The rows of a run; names of files in the text are from the root of the sources."""
    with tempfile.TemporaryDirectory() as folder:
        model = pathlib.Path(folder) / "model.yaml"
        model.write_text(text.replace("csv: ", f"csv: {ROOT}/"))
        return runs.simulated(model, *words, **values)[1]


def model(name):
    return (ROOT / name).read_text().replace("../../examples", "examples").replace("../profiles", "examples/profiles")


def changed(text, old, new):
    if old not in text:
        raise AssertionError(f"no '{old}' in the model")
    return text.replace(old, new)


def middle(values):
    return (max(values) + min(values)) / 2


def klingel(cone):
    return 2 * math.pi * math.sqrt(R0 * B / cone)


class Curve(unittest.TestCase):
    def test_outwards(self):
        """Without slip the radii go as the ways: points of contact s beside the middle of the treads, s = r0 b/(cone R). The
        axle rolls by cone s/b, which brings the lowest points of the treads and those of the rails inwards by its r0 and rail
        radius times that, so that the axle is only (1 - cone (r0 + rail)/b) s outwards. The terms left out are of second order."""
        for cone in (0.1, 0.05, 0.025, 0.0125):
            found = simulate(model("tests/models/curve.yaml"), "--t-end", 1.5 * klingel(cone) / 0.2, "--output-step", klingel(cone) / 100, cone=cone)
            out = -middle([row["q.y"] for row in found])
            self.assertLess(abs(out / (0.005 * (1 - cone * (R0 + RAIL) / B)) - 1), 0.2 * cone**2, cone)
            self.assertTrue(1 - cone < out / 0.005 < 1 - 0.7 * cone, (cone, out))

    def balance(self, form, formulation, speed, cant):
        """A wheelset with a load 1.5 m above it, steadily round a curve of 1380 m: what its wheels carry against the weight
        and the centrifugal force, in the track's axes, and the moments about the axle."""
        cone, mass, load, high = 0.05, 1000, 5000, 1.5
        radius = R0 * B / (cone * 0.005)
        text = changed(model("tests/models/curve.yaml"), "contact: rigid", "contact: elastic, damping: 50" if form == "elastic" else "contact: rigid")
        text = text if form == "rigid" else changed(text, "lambda(L), lambda(R), ", "")
        row = simulate(text, "--formulation", formulation, "--integrator", "ida" if formulation == "dae" else "radau9",
                       "--t-end", 5 * 20 / speed, cone=cone, V=speed, cant=cant, load=load, high=high, calm=3e6)[-1]
        lean = math.asin(cant / (2 * B + 2 * RAIL * math.sin(math.atan(cone))))
        pull = (row["qd.round"] * radius)**2 / radius
        up, out = G * math.cos(lean) + pull * math.sin(lean), pull * math.cos(lean) - G * math.sin(lean)
        roll = row["q.roll"] + lean
        left, right = row["force.L.z"], row["force.R.z"]
        across = row["force.L.y"] + row["force.R.y"]
        moment = (row["force.L.mx"] + row["force.R.mx"] + B * math.cos(roll) * (left - right)
                  - B * math.sin(roll) * (row["force.L.y"] - row["force.R.y"]))
        wanted = -load * high * (math.sin(roll) * up + math.cos(roll) * out) - 100 * row["qd.spin"] * row["qd.round"] * math.cos(lean)
        weight = (mass + load) * G
        for found, right_one in ((left + right, (mass + load) * up), (across, (mass + load) * out), (moment / B, wanted / B)):
            self.assertLess(abs(found - right_one), 1e-5 * weight, (form, formulation, speed, cant))
        return left, right, weight

    def test_loads(self):
        for form, formulation, speed, cant in (("rigid", "reduced", 20, 0), ("rigid", "reduced", 20, 0.1), ("rigid", "dae", 20, 0),
                                        ("elastic", "reduced", 20, 0), ("elastic", "dae", 20, 0.05)):
            with self.subTest(form=form, formulation=formulation, speed=speed, cant=cant):
                self.balance(form, formulation, speed, cant)

    def test_cant_balances(self):
        """At v^2/R = g tan of the cant both wheels carry the same but for the axle's shift of some 5 mm and the moment that turns
        the wheels' spin round."""
        lean = math.asin(0.05 / (2 * B + 2 * RAIL * math.sin(math.atan(0.05))))
        speed = math.sqrt(G * math.tan(lean) * 1380)
        for form in ("rigid", "elastic"):
            left, right, weight = self.balance(form, "reduced", speed, 0.05)
            self.assertLess(abs(left - right), 0.01 * weight)
        left, right, weight = self.balance("rigid", "reduced", 5, 0.05)
        self.assertGreater(left - right, 0.05 * weight)

    def test_past_a_right_angle(self):
        """In the ground's coordinates, through a transition, until the axle has turned by more than 90 degrees."""
        text = changed(model("examples/rolling_wheel/rolling_wheel.yaml"), "gauge_depth:",
                       "course: [{transition: 60}, {left: 800, radius: 345}], gauge_depth:")
        found = simulate(text, "--t-end", 375, "--output-step", 0.1, cone=0.1, V=2)
        self.assertGreater(found[-1]["q.yaw"], math.pi / 2 + 0.3)
        turn = 60 / (2 * 345)
        x = 60 * (1 - turn**2 / 10 + turn**4 / 216) - 345 * math.sin(turn)
        y = 60 * (turn / 3 - turn**3 / 42 + turn**5 / 1320) + 345 * math.cos(turn)
        out = [math.hypot(row["q.x"] - x, row["q.y"] - y) - 345 for row in found[-100:]]
        self.assertLess(abs(middle(out) / (0.01 * (1 - 0.1 * (R0 + RAIL) / B)) - 1), 0.01)


class Wagon(unittest.TestCase):
    TRACK, WHEELS, HALF = Track(20, 30, 300, 0.06), ("FL", "FR", "RL", "RR"), 2.5

    @classmethod
    def setUpClass(cls):
        cls.table = simulate(model("examples/curving/curving.yaml"), "--rtol", 1e-9)  # at 1e-8 a row within a long step may be off by 0.5 kN

    def frames(self, row):
        """Of the wagon and its axles, by own kinematics."""
        q = lambda *names: [row["q." + name] for name in names]
        x, y, z, yaw, pitch, roll = q("x", "y", "z", "yaw", "pitch", "roll")
        wagon = Frame().then((x, y, z), (2, yaw), (1, pitch), (0, roll))
        for p, along in (("f", self.HALF), ("r", -self.HALF)):
            x, y, z, yaw, roll = q(*(p + name for name in ("x", "y", "z", "yaw", "roll")))
            yield wagon.then((along + x, y, z), (2, yaw), (0, roll))
        yield wagon

    def balance(self, row):
        """Forces of wheels and of the masses' accelerations in the curve, in the track's axes under the wagon's middle: forces to the left and up, and the
        moment about the middle line there; each wheel's force is in the track's axes at its hub. Masses go round at one rate, and with
        them the spins of the axles, which lie on the radius."""
        front, rear, wagon = self.frames(row)
        here = self.TRACK.under(wagon.at)
        force, moment = (0, 0, 0), (0, 0, 0)
        for wheel in self.WHEELS:
            hub = (front if wheel[0] == "F" else rear).point(0, B if wheel[1] == "L" else -B, 0)
            axes, get = self.TRACK.under(hub), lambda *names: [row[f"force.{wheel}.{name}"] for name in names]
            one = here.seen(axes.vector(*get("x", "y", "z")))
            own = here.seen(axes.vector(*get("mx", "my", "mz")))
            arm = here.seen([a - b for a, b in zip(hub, here.at)])
            force, moment = [a + b for a, b in zip(force, one)], [a + b + c for a, b, c in zip(moment, own, cross(arm, one))]
        round_ = math.hypot(row["qd.x"], row["qd.y"]) / (300 - self.TRACK.inward(wagon.at))
        lean, taken = self.TRACK.lean, [0, 0, -100 * (row["qd.fspin"] + row["qd.rspin"]) * round_ * math.cos(self.TRACK.lean)]
        for mass, at in ((20000, wagon.point(0, 0, 1.5)), (1200, front.at), (1200, rear.at)):
            pull = round_**2 * (300 - self.TRACK.inward(at))
            left, up = mass * (pull * math.cos(lean) - G * math.sin(lean)), mass * (G * math.cos(lean) + pull * math.sin(lean))
            arm = here.seen([a - b for a, b in zip(at, here.at)])
            taken = [taken[0] + left, taken[1] + up, taken[2] + arm[1] * up - arm[2] * left]
        return (force[1], force[2], moment[0]), taken

    def test_steady(self):
        """examples/curving in its last second, on the average of what still sways: loads, lateral forces and their moment."""
        pairs = [self.balance(row) for row in self.table if row["t"] >= 7]
        found, wanted = ([sum(pair[side][i] for pair in pairs) / len(pairs) for i in range(3)] for side in (0, 1))
        print("  by wheels %s, by masses %s" % (found, wanted))
        for one, other, near in zip(found, wanted, (2e-4, 2e-5, 3e-4)):  # found 5e-5, 5e-7, 1.2e-4, which change as it sways
            self.assertLess(abs(one / other - 1), near)

    def test_goes_over(self):
        """No contact goes out at once where another one takes over: 1.2 kN at most, once the start has died away."""
        for wheel in self.WHEELS:
            loads = [(row["q.x"], row[f"force.{wheel}.z"]) for row in self.table if row["q.x"] > 8]
            changes = [abs(after[1] - before[1]) for before, after in zip(loads, loads[1:]) if not self.at_a_corner(before[0])]
            self.assertGreater(len(changes), 300)
            self.assertLess(max(changes), 1500, wheel)

    def test_leads(self):
        """The front axle stands outwards, 6 mm."""
        self.assertGreater(self.table[-1]["contact.FR.1.y"] - self.table[-1]["contact.FR.1.s"] - B, 0.006)

    @staticmethod
    def at_a_corner(x):
        """True if an axle passes an end of the transition: a step goes over a corner of the cant, and its rows are not the motion's."""
        return any(abs(x + axle - corner) < 1.2 for axle in (2.5, -2.5) for corner in (20, 50))


class Uneven(unittest.TestCase):
    def test_level(self):
        """Of small waves the contact of an elastic wheel is a spring 1.5 N/d and a damper c N: the force that varies is
        A m W^2 (k + i W c)/(k - m W^2 + i W c)."""
        points = [k / 40 for k in range(0, 40 * 22)]
        text = WAVE % (", ".join(map(str, points)), ", ".join(f"{math.sin(2 * math.pi * x) * min(x / 4, 1)}*A" for x in points))
        for speed in (20, 60, 100):
            found = simulate(text, "--t-end", 16 / speed, "--output-step", 0.01 / speed, V=speed)
            forces = [row["force.L.z"] for row in found if 8 <= row["q.x"] <= 15]
            load, cosine = 5000 * G, math.cos(math.atan(0.01))
            spring = 1.5 * (load / cosine)**(1 / 3) * 1e11**(2 / 3) * cosine**2
            damper, w = 200 * load * cosine, 2 * math.pi * speed
            wanted = abs(1e-6 * 5000 * w**2 * (spring + 1j * w * damper) / (spring - 5000 * w**2 + 1j * w * damper))
            with self.subTest(V=speed):
                self.assertLess(abs((max(forces) - min(forces)) / 2 / wanted - 1), 3e-3, (max(forces), min(forces), wanted))

    def test_gauge(self):
        """A gauge wider by w: points of contact w/2 farther out, on rails and treads, and the axle cone w/2 lower."""
        parts = [min(max(x - 10, 0) / 10, 1) for x in range(41)]
        ways, widths = ", ".join(map(str, range(41))), ", ".join(str(0.004 * u**2 * (3 - 2 * u)) for u in parts)
        text = changed(model("examples/rolling_wheel/rolling_wheel.yaml"), "profiles:\n",
                       "tables: {wide: {x: [%s], y: [%s]}}" % (ways, widths) + "\nprofiles:\n")
        text = changed(text, "gauge_depth:", "irregularities: {gauge: wide}, gauge_depth:")
        text = changed(changed(text, "lambda(R)]", "lambda(R), contact(L), contact(R)]"), "y: 3 mm, ", "")
        found = simulate(text, "--t-end", 17)
        first, last = found[0], found[-1]
        self.assertGreater(last["q.x"], 30)
        for side in "LR":
            for column in ("s", "y"):
                name = f"contact.{side}.1.{column}"
                self.assertLess(abs(last[name] - first[name] - 0.002), 1e-8, name)
        self.assertLess(abs(last["q.z"] - first["q.z"] + 0.025 * 0.002), 1e-9)


if __name__ == "__main__":
    runs.main()
