#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The model that bench/peers/tree.py writes for other programs is the one that Kempe read: read again by Kempe it is the same tree, and
MuJoCo's XML has its bodies and joints. Equations of plane mechanisms (planar.py) and robots (urdf.py) are what they should be.
Called with the path of the command:

    python3 tests/peers.py build/dev/kempe
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "bench/peers"))
import planar  # noqa: E402
import spheres  # noqa: E402
import tree  # noqa: E402
import urdf  # noqa: E402

KEMPE = "kempe"  # set by main
MODELS = ("andrews/andrews", "stewart/stewart", "suspension/suspension", "bricard/bricard")


class Blades(unittest.TestCase):
    def test_four_bar(self):
        """The model for Kempe has the motion that the program of the reference found from the nodes."""
        try:
            import blade_peers
        except (ModuleNotFoundError, SystemExit):
            self.skipTest("NumPy is missing")
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            blade_peers.write(place)
            subprocess.run([KEMPE, "simulate", place / "blade_four_bar_10.yaml", "-q", "--rtol", "1e-9", "-o", place / "rows.csv"], check=True,
                           stdout=subprocess.DEVNULL)
            own, digits = ([[float(x) for x in line.split(",")] for line in path.read_text().splitlines() if line[0].isdigit()]
                           for path in (place / "rows.csv", ROOT / "bench/peers/blade_four_bar.csv"))
            self.assertEqual(len(own), len(digits))
            for a, b in zip(own, digits):
                for x, y in zip(a, b):
                    self.assertAlmostEqual(x, y, delta=1e-9)


class Trees(unittest.TestCase):
    def test_again(self):
        for name in MODELS:
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                first = tree.Tree(tree.show(KEMPE, ROOT / f"examples/{name}.yaml"), loops=False)
                path = pathlib.Path(folder, "tree.yaml")
                path.write_text(first.yaml())
                second = tree.Tree(tree.show(KEMPE, path), loops=False)
                words = [[x for line in t.text().splitlines() if not line.startswith("start") for x in line.split()] for t in (first, second)]
                self.assertEqual(len(words[0]), len(words[1]))
                for a, b in zip(*words):                  # a direction is brought to length one once more
                    self.assertTrue(a == b or abs(float(a) - float(b)) <= 1e-15, f"{a}, then {b}")
                self.assertGreater(first.n, 0)

    def test_xml(self):
        for name in MODELS:
            with self.subTest(name):
                given = tree.Tree(tree.show(KEMPE, ROOT / f"examples/{name}.yaml"), loops=False)
                written = xml.fromstring(given.mjcf())
                bodies, joints = list(written.iter("body")), list(written.iter("joint"))
                self.assertEqual([b.get("name") for b in bodies], [f"b{k}" for k in range(len(given.bodies))]) # depth first: MuJoCo's order
                self.assertEqual(len(joints), given.n)
                for b in bodies:
                    own = given.bodies[int(b.get("name")[1:])]
                    self.assertEqual(float(b.find("inertial").get("mass")), own["mass"])
                    self.assertEqual([j.get("type") for j in b.findall("joint")],
                                     ["hinge" if kind == "R" else "slide" for kind, _ in own["motions"]])
                    parent = next((p.get("name") for p in bodies if b in p.findall("body")), None)
                    self.assertEqual(parent, f"b{own['parent']}" if own["parent"] >= 0 else None)


class Loops(unittest.TestCase):
    def test_suspension(self):
        """Rods, springs in joints, and the torque between two coordinates, read from its expression."""
        given = tree.Tree(tree.show(KEMPE, ROOT / "examples/suspension/suspension.yaml"))
        place = given.coordinates.index
        self.assertEqual((len(given.rods), len(given.closures), len(given.springs)), (4, 2, 16))
        self.assertEqual(given.coupled, [(place("left_bar"), place("right_bar"), 900, 4)])
        self.assertEqual(given.held, [(place("rack"), 60000, 800, 0)])
        self.assertFalse(given.is_plane())

    def test_andrews(self):
        """Closures, spring and motor by their bodies' numbers."""
        given = tree.Tree(tree.show(KEMPE, ROOT / "examples/andrews/andrews.yaml"))
        names = [b["name"] for b in given.bodies]
        ends = [(names[a], names[b]) for a, _, b, _ in given.closures]
        self.assertEqual(ends, [("K2", "K3"), ("K2", "K4"), ("K2", "K6")])
        (a, _, b, at, stiffness, _, free), = given.springs
        self.assertEqual((names[a], b, at, stiffness, free), ("K3", -1, [0.014, 0.072, 0], 4530, 0.07785))
        self.assertEqual(given.efforts, [(given.coordinates.index("beta"), 0.033)])


def started(name):
    """A plane mechanism at its closed start, its first coordinate independent."""
    path = ROOT / name
    given = tree.Tree(tree.show(KEMPE, path))
    given.start(json.loads(subprocess.run([KEMPE, "assemble", path, "--json", "-"], capture_output=True, text=True, check=True).stdout))
    given.independent = [0]
    return given


class Plane(unittest.TestCase):
    """Equations that peers integrate: the published multipliers, two ways to the accelerations, derivatives by differences."""

    def value(self, mechanism, x, state):
        return mechanism.graph.values(state)[x] if isinstance(x, planar.Node) else x

    def test_published_multipliers(self):
        found = planar.Planar(started("examples/andrews/andrews.yaml")).accelerations()[7:]
        lines = (ROOT / "examples/andrews/reference.csv").read_text().splitlines()
        names, row = (next(x for x in lines if x.startswith(begin)).split(",") for begin in ("t,", "0,"))
        published = [float(x) for name, x in zip(names, row) if name.startswith("lambda")]
        for a, b in zip(found, [-x for x in published]):  # their gap is the other way round
            self.assertAlmostEqual(a, b, delta=1e-11)

    def test_reduced(self):
        """The reduced ODE beside the whole system; rates of dependent angles do not enter it."""
        for name in ("bench/peers/four_bar_10.yaml", "examples/n_four_bar/n_four_bar.yaml"):
            given = started(name)
            mechanism = planar.Planar(given)
            variables, rates = mechanism.reduced([0])
            state = {f"v{k}": 1e9 for k in range(given.n)}
            state |= {x.of[0]: (given.q if x.of[0][0] == "q" else given.qd)[int(x.of[0][1:])] for x in variables}
            whole = mechanism.accelerations()
            self.assertAlmostEqual(self.value(mechanism, rates[-1], state), whole[0], delta=1e-12 * (1 + abs(whole[0])))
            for x, rate in zip(rates, given.qd):
                self.assertAlmostEqual(self.value(mechanism, x, state), rate, delta=1e-12)

    def test_redundant(self):
        """The reduced ODE of the parallel robot, with springs in joints and a redundant row, beside Kempe's accelerations."""
        given = started("examples/parallel_robot/parallel_robot.yaml")
        given.independent = [given.coordinates.index(x) for x in ("a1", "b1")]
        mechanism = planar.Planar(given)
        variables, rates = mechanism.reduced(given.independent)
        state = {f"v{k}": 1e9 for k in range(given.n)}
        state |= {x.of[0]: (given.q if x.of[0][0] == "q" else given.qd)[int(x.of[0][1:])] for x in variables}
        qdd = json.loads(subprocess.run([KEMPE, "simulate", ROOT / "examples/parallel_robot/parallel_robot.yaml", "--t-end", "1e-9",
                                         "--no-convergence-check", "--json", "-"], capture_output=True, text=True, check=True).stdout)["qdd"]
        for x, name in zip(rates[given.n:], ("a1", "b1")):
            self.assertAlmostEqual(self.value(mechanism, x, state), qdd[name], delta=1e-6 * abs(qdd[name]))

    def test_derivatives(self):
        given = started("examples/andrews/andrews.yaml")
        mechanism = planar.Planar(given)
        variables, rates = mechanism.descriptor()
        start = dict(zip((x.of[0] for x in variables), [q + 0.1 for q in given.q] + [v + 1 for v in given.qd] + [0.3] * 13))
        wanted = [(mechanism.graph.derivative(f, v), f, v) for v in (variables[1], variables[2], variables[9]) for f in rates[14:]]
        here = mechanism.graph.values(start)
        number = lambda values, x: values[x] if isinstance(x, planar.Node) else x
        for v in (variables[1], variables[2], variables[9]):
            low, high = (mechanism.graph.values({**start, v.of[0]: start[v.of[0]] + h}) for h in (-1e-5, 1e-5))
            for slope, f, by in wanted:
                if by is v:
                    two_sided = (number(high, f) - number(low, f)) / 2e-5
                    self.assertAlmostEqual(number(here, slope), two_sided, delta=1e-6 * (1 + abs(two_sided)))


ROBOT = """<robot name="r"><link name="base"><inertial><mass value="2"/><origin xyz="0 0 1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="box"><inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="arm"><inertial><mass value="1"/><origin xyz="1 0 0"/><inertia ixx="1" iyy="2" izz="3" ixy="0.5" ixz="0" iyz="0"/></inertial></link>
<joint name="f" type="fixed"><parent link="base"/><child link="box"/><origin xyz="0 0 -1"/></joint>
<joint name="j" type="revolute"><parent link="box"/><child link="arm"/><origin xyz="0 0 3" rpy="0 0 1.5707963267948966"/><axis xyz="1 0 0"/></joint>
</robot>"""


class Robots(unittest.TestCase):
    def test_urdf(self):
        """Links that are fixed are one body; axes are the ground's."""
        with tempfile.TemporaryDirectory() as folder:
            source, path = pathlib.Path(folder, "r.urdf"), pathlib.Path(folder, "r.yaml")
            source.write_text(ROBOT)
            path.write_text(urdf.model(source, "r"))
            given = tree.Tree(tree.show(KEMPE, path), loops=False)
        base, arm = given.bodies
        self.assertTrue(given.is_free(0))
        self.assertEqual((base["mass"], base["com"], base["inertia"]["xx"], base["inertia"]["zz"]), (4, [0, 0, 0], 6, 2))
        near = lambda a, b: self.assertTrue(all(abs(x - y) < 1e-12 for x, y in zip(a, b)), f"{a} {b}")
        near(arm["at"], [0, 0, 2])                        # above the box, which is below the base
        near(arm["com"], [0, 1, 0])
        near([arm["inertia"][k] for k in tree.KEYS], [2, 1, 3, -0.5, 0, 0])
        near(arm["motions"][0][1], [0, 1, 0])


class Growth(unittest.TestCase):
    def test_spheres(self):
        """The laws of free fall and impact are those of Kempe's contacts."""
        with tempfile.TemporaryDirectory() as folder:
            path, table = pathlib.Path(folder, "spheres.yaml"), pathlib.Path(folder, "spheres.csv")
            path.write_text(spheres.model(7))
            subprocess.run([KEMPE, "simulate", path, "-q", "--no-convergence-check", "--output-step", str(spheres.END), "-o", table], check=True,
                           stdout=subprocess.DEVNULL)
            names, *_, last = [line.split(",") for line in table.read_text().splitlines() if not line.startswith("#")]
        found = dict(zip(names, map(float, last)))
        for i, x in enumerate(spheres.exact(7)):
            self.assertAlmostEqual(found[f"q.j{i // 2}.{i % 2 + 1}"], x, delta=1e-12)

    def test_depth(self):
        """Each body is followed by all that it carries, however deep."""
        bodies = [{"name": f"b{k}", "parent": f"b{k - 2}" if k > 1 else "ground"} for k in range(6000)]
        found = [b["name"] for b in tree.depth_first(bodies)]
        self.assertEqual(found, [f"b{k}" for first in (0, 1) for k in range(first, 6000, 2)])


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
