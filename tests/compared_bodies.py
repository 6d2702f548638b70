#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""`kempe compare --bodies`: its rows are the runs of models that are written by hand with those bodies, and what bodies cannot have is refused.

    python3 tests/compared_bodies.py build/dev/kempe
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import runs

# A slider-crank in a plane; the rod of 0.4 m, E I 8 N m^2 and 0.3 kg/m.
MODEL = """kempe: 1
gravity: [0, -9.81, 0]
bodies:
  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.2, inertia: {zz: 0.001}, points: {P: [0.1, 0, 0]}}
  rod: {joint: {name: B, revolute: z, at: crank.P}, ROD}
  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 0.4, points: {C: [0, 0, 0]}}
loops: {L: {ball: [slider.C, rod.E]}}
drives: {d: {joint: A, angle: 30*t + 0.5}}
start: {q: {B: -0.7, X: 0.45}}
run: {t_end: 0.2, outputs: [OUTPUTS]}
"""
SHAPES = "flexible: {beam: {length: 0.4, rhoA: 0.3, EIz: 8}, shapes: {y: 3}MORE}, points: {E: {station: 0.4}, M: {station: 0.2, offset: [0, 0.01, 0]}}"
RIGID = "mass: 0.12, com: [0.2, 0, 0], inertia: {zz: 1.6e-3}, points: {E: [0.4, 0, 0], M: [0.2, 0.01, 0]}"
COMMON = "position(rod.M), q(X), lambda"
DAMPED = ", damping: {rayleigh: [0, 2e-4]}"
BY_HAND = {"rigid": RIGID, "none": SHAPES.replace("MORE", ", stiffening: none" + DAMPED), "first": SHAPES.replace("MORE", ", stiffening: first" + DAMPED),
           "full": SHAPES.replace("MORE", ", stiffening: full" + DAMPED), "segments:4": SHAPES.replace("MORE", ", segments: 4, damping: {time: 2e-4}")}


def model(rod, outputs=COMMON):
    return MODEL.replace("ROD", rod).replace("OUTPUTS", outputs)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def put(self, text):
        path = self.folder / "model.yaml"
        path.write_text(text)
        return path

    def compared(self, text, bodies, status=0):
        """The rows, by their word."""
        found = runs.kempe("compare", self.put(text), "--bodies", bodies, "--rtol", "1e-5", status=status)
        return {row["bodies"]: row for row in found["bodies"]["rows"]}, found


class Rows(Folder):
    def check(self, text, bodies, reference):
        rows, found = self.compared(text, bodies)
        self.assertEqual((list(rows), found["bodies"]["reference"]), (bodies.split(","), reference))
        tables = {}
        for word in rows:
            path = self.put(model(BY_HAND[word]))
            tables[word] = runs.simulated(path, "--rtol", "1e-8", "--output-step", "0.0005")[1]
        for word in rows:
            own = [(tables[word], tables[reference])]
            if word == reference:
                self.assertEqual(rows[word]["outputs"], [])
                continue
            self.assertEqual(len(rows[word]["outputs"]), 3 + 1 + 3)
            for k, output in enumerate(rows[word]["outputs"], 1):
                a, b = ([list(row.values())[k] for row in table] for table in own[0])
                most = max(abs(x - y) for x, y in zip(a, b, strict=True))
                self.assertAlmostEqual(output["error"], most, delta=1e-3 * most + 1e-6 * output["range"], msg=f"{word} {output}")
                self.assertGreater(output["range"], 0)
            self.assertGreater(max(output["error"] for output in rows[word]["outputs"] if output["unit"] == "m"), 1e-9)
        return rows

    def test_by_hand(self):
        """Outputs that only some of the models have are left out."""
        text = model(SHAPES.replace("MORE", DAMPED + ", frame: clamped"), "q, qd, position(rod.M), q(X), deflection(rod.M), lambda, section_by_shapes(rod.M)")
        rows = self.check(text, "rigid,none,first,segments:4,full", "full")
        self.assertEqual([row["coordinates"] for row in rows.values()], [3, 6, 6, 6, 6])
        names = [output["name"] for output in rows["rigid"]["outputs"]]
        self.assertEqual(names[:4], ["position.rod.M.x", "position.rod.M.y", "position.rod.M.z", "q.X"])
        errors = {word: max(o["error"] for o in row["outputs"] if o["unit"] == "m") for word, row in rows.items() if row["outputs"]}
        self.assertLess(errors["first"], errors["none"])
        self.assertLess(errors["none"], errors["rigid"])

    def test_from_segments(self):
        """A model in segments has the same rows; six of them take a tenth of the time of sixteen."""
        text = model(SHAPES.replace("MORE", ", segments: 6, damping: {time: 2e-4}"), "q, " + COMMON)
        self.check(text, "segments:4,rigid,first", "first")

    def test_text(self):
        path = self.put(model(SHAPES.replace("MORE", "")))
        said = subprocess.run([runs.command, "compare", path, "--bodies", "rigid,full", "--rtol", "1e-5", "-q", "--csv", self.folder / "rows.csv"],
                              capture_output=True, text=True, check=True).stdout
        self.assertIn("Models of the flexible bodies at rtol 1e-08, compared with the last one, 'full'", said)
        self.assertRegex(said, r"\nrigid .* 3 .* m, position\.rod\.M\.")
        self.assertRegex(said, r"\nfull .* the reference\n")

    def test_untrusted(self):
        """A row without terms of second order is told by itself; the reference is of the whole."""
        fast = """kempe: 1
bodies: {arm: {joint: {name: A, revolute: z, at: ground}, flexible: {beam: {length: 0.4, rhoA: 0.3, EIz: 8}, shapes: {y: 2}}, points: {E: {station: 0.4}}}}
drives: {d: {joint: A, angle: 130*t}}
run: {t_end: 0.05, outputs: [position(arm.E)]}
"""
        rows, _ = self.compared(fast, "none,full")
        self.assertEqual(rows["none"]["status"], "not trustworthy")
        self.assertIn("faster than its first frequency", rows["none"]["reason"])
        _, found = self.compared(fast, "full,none", status=5)
        self.assertEqual(found["status"], "not trustworthy")


class Files(Folder):
    def blade(self):
        """A file of one mode: a mass of 1 kg that moves along y."""
        try:
            import numpy as np
        except ModuleNotFoundError:
            self.skipTest("NumPy is missing")
        way = np.zeros((2, 3, 1))
        way[1, 1] = 1
        arrays = {"format": "kempe-flexible-1", "units": "m kg s", "K": np.array([[900.0]]), "m": 1.0, "b0": np.array([0.2, 0, 0]),
                  "P0": np.diag([0.06, 0, 0]), "S": np.array([[0], [0.5], [0]]), "Z0": np.array([[[0, 0, 0], [0.12, 0, 0], [0, 0, 0]]]),
                  "T": np.diag([0, 0.4, 0])[None, None], "interface_names": np.array(["A", "B"]), "interface_place": np.array([[0, 0, 0], [0.4, 0, 0]]),
                  "interface_displacement": way, "interface_rotation": 0 * way}
        np.savez(self.folder / "blade.npz", **arrays)

    def test_rigid(self):
        self.blade()
        text = """kempe: 1
gravity: [0, -9.81, 0]
bodies:
  arm: {joint: {name: A, revolute: z, at: ground}, BODY}
  tip: {joint: {name: T, weld: yes, at: arm.B}, mass: 0.5}
run: {t_end: 0.2, rtol: 1e-8, output_step: 0.01, outputs: [position(arm.B)]}
"""
        file = text.replace("BODY", "flexible: {file: blade.npz}, points: {B: {interface: B}}")
        rows, _ = self.compared(file, "rigid,none")
        self.assertEqual([row["coordinates"] for row in rows.values()], [1, 2])
        own = runs.simulated(self.put(text.replace("BODY", "mass: 1, com: [0.2, 0, 0], inertia: {zz: 0.02}, points: {B: [0.4, 0, 0]}")), "--output-step", "0.0005")[1]
        other = runs.simulated(self.put(file), "--output-step", "0.0005")[1]
        most = max(abs(a["position.arm.B.y"] - b["position.arm.B.y"]) for a, b in zip(own, other, strict=True))
        found = next(o["error"] for o in rows["rigid"]["outputs"] if o["name"] == "position.arm.B.y")
        self.assertAlmostEqual(found, most, delta=2e-3 * most)
        self.assertEqual((rows["rigid"]["status"], rows["rigid"]["reason"]), ("complete, not checked", ""))
        for word, sentence in (("full", "stiffening of body 'arm': a file has terms of second order up to 'first'"),
                               ("segments:4", "'segments' is a key of beams, and its modes are in a file")):
            self.refused(file, f"none,{word}", 2, sentence, f"so the model cannot be compared with the bodies '{word}'")

    def refused(self, text, bodies, code, *sentences):
        done = subprocess.run([runs.command, "compare", self.put(text), "--bodies", bodies, "--rtol", "1e-5"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (code, ""), done.stderr)
        for sentence in sentences:
            self.assertIn(sentence, done.stderr)

    def test_mistakes(self):
        whole = model(SHAPES.replace("MORE", ""))
        for text, bodies, code, sentence in (
                (whole, "rigid,soft", 3, "bodies 'soft': rigid, none, first, full or segments:N is expected"),
                (whole, "rigid,segments:", 3, "bodies 'segments:': rigid, none"),
                (whole, "rigid", 3, "bodies 'rigid': name at least two, the finest one last"),
                (whole, "rigid, full,rigid", 3, "bodies 'rigid' are given twice"),
                (whole, "segments:1,full", 2, "segments of body 'rod' are 1: a whole number from 2 to 500"),
                (whole.replace(COMMON, "q, deflection(rod.M)"), "rigid,full", 3, "has no outputs that every model of its bodies has"),
                (whole.replace(COMMON, "q(rod.y1), q(X)"), "none,rigid", 2, "so the model cannot be compared with the bodies 'rigid'"),
                (whole.replace("shapes: {y: 3}", "shapes: {y: 3}, damping: {ratio: 0.01}"), "segments:4,full", 2,
                 "the damping of body 'rod', which is in segments, is {time: T}"),
                (whole.replace("shapes: {y: 3}", "shapes: {y: 3}, damping: {rayleigh: [1, 0]}"), "segments:4,full", 2, "is {time: T}, in seconds"),
                (model(RIGID), "rigid,full", 3, "has no flexible bodies")):
            with self.subTest(sentence):
                self.refused(text, bodies, code, sentence)


def main():
    runs.main()


if __name__ == "__main__":
    main()
