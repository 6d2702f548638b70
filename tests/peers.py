#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What bench/peers/tree.py writes for other programs is the model that Kempe read: read again by Kempe it is the same tree, and
MuJoCo's XML has its bodies and joints. Called with the path of the command:

    python3 tests/peers.py build/dev/kempe
"""
import os
import pathlib
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "bench/peers"))
import tree  # noqa: E402

KEMPE = "kempe"  # set by main
MODELS = ("andrews/andrews", "stewart/stewart", "suspension/suspension", "bricard/bricard")


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
                self.assertEqual([b.get("name") for b in bodies if b.get("name") == "b0"], ["b0"])
                self.assertEqual(len(bodies), len(given.bodies))
                self.assertEqual(len(joints), given.n)
                for b in bodies:
                    own = given.bodies[int(b.get("name")[1:])]
                    self.assertEqual(float(b.find("inertial").get("mass")), own["mass"])
                    self.assertEqual([j.get("type") for j in b.findall("joint")],
                                     ["hinge" if kind == "R" else "slide" for kind, _ in own["motions"]])
                    parent = next((p.get("name") for p in bodies if b in p.findall("body")), None)
                    self.assertEqual(parent, f"b{own['parent']}" if own["parent"] >= 0 else None)


class Loops(unittest.TestCase):
    def test_andrews(self):
        """Closures, spring and motor by their bodies' numbers."""
        given = tree.Tree(tree.show(KEMPE, ROOT / "examples/andrews/andrews.yaml"))
        names = [b["name"] for b in given.bodies]
        ends = [(names[a], names[b]) for a, _, b, _ in given.closures]
        self.assertEqual(ends, [("K2", "K3"), ("K2", "K4"), ("K2", "K6")])
        (a, _, b, at, stiffness, _, free), = given.springs
        self.assertEqual((names[a], b, at, stiffness, free), ("K3", -1, [0.014, 0.072, 0], 4530, 0.07785))
        self.assertEqual(given.efforts, [(given.coordinates.index("beta"), 0.033)])


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
