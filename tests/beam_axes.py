#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Beams along any direction of their body: a mechanism with a beam along x, and the same one in other axes of that body, say the same.

    python3 tests/beam_axes.py build/dev/kempe
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import runs

try:
    import numpy as np
except ModuleNotFoundError:
    print("NumPy is missing")
    sys.exit(77)

# A beam carries a disc on an oblique hinge. A: the axes of the beam in those of the body, whose joint and points turn with them.
CHAIN = """kempe: 1
gravity: [0, -9.81, 0]
parameters: {L: 0.8}
bodies:
  rod:
    joint: {name: A, revolute: <A z>, at: ground, frame: <A'>}
    flexible:
      beam: {length: L, <KEY>young: 70 GPa, shear: 26 GPa, density: 2700, section: {rectangle: [12 mm, 8 mm]}, taper: {rectangle: [9 mm, 6 mm]}}
      shapes: {y: 2, z: 1, torsion: 1}
      <FRAME>
    points:
      tip: {station: L, offset: <A [0.01, 0.02, 0]>, axes: <A>}
      mid: {station: 3/8*L, offset: <A [0, 0.006, 0.004]>, axes: <A>}
  disc: {joint: {name: B, revolute: [0, 1, 1], at: rod.tip}, mass: 0.1, com: [0.1, 0, 0.02], inertia: {xx: 1e-4, yy: 2e-4, zz: 2e-4}}
forces: {push: {at: rod.mid, force: [0, 1, 0.5]}}
start: {q: {B: 0.3}}
run: {t_end: 0.1, rtol: 1e-9, outputs: [q, qd, position(rod.mid), velocity(rod.tip), axes(rod.tip), deflection(rod.tip), section(rod.mid), stress(rod.mid),
  section_by_shapes(rod.mid), reaction(B), moment(A), momentum(rod), angular_momentum(rod), energy]}
"""
# In flight: the mean axes are those of the body.
FLIGHT = """kempe: 1
bodies:
  rod:
    joint: {name: F, motions: [T1, T2, T3, R1, R2, R3], at: ground.O}
    flexible: {beam: {length: 1, <KEY>rhoA: 1, rhoI: [2e-3, 1e-3], EIy: 8, EIz: 12, GJ: 3}, shapes: {y: 2, z: 1, torsion: 1}, frame: mean}
    points: {tip: {station: 1, axes: <A>}, start: {station: 0, axes: <A>}}
ground: {points: {O: {at: [0, 0, 0], axes: <A'>}}}
run: {t_end: 0.3, rtol: 1e-9, outputs: [position(rod.tip), axes(rod.tip), angular_momentum(rod), energy]}
"""
# A slider-crank whose rod is under load: buckling, equilibrium, modes.
LOOP = """kempe: 1
gravity: [0, -9.81, 0]
bodies:
  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.2, inertia: {zz: 0.001}, points: {P: [0.1, 0, 0]}}
  rod:
    joint: {name: B, revolute: <A z>, at: crank.P, frame: <A'>}
    flexible: {beam: {length: 0.4, <KEY>rhoA: 0.3, EIz: 8}, shapes: {y: 3}, frame: chord, damping: {ratio: 0.01}}
    points: {E: {station: 0.4, axes: <A>}, M: {station: 0.2, axes: <A>}}
  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 0.4, points: {C: [0, 0, 0]}}
loops: {L: {ball: [slider.C, rod.E]}}
forces: {f: {at: slider.C, force: [-40, 0, 0]}, s: {joint: A, spring: {stiffness: 60, rest: 0.5}}}
start: {q: {A: 0.5, B: -0.7, X: 0.45}}
run: {t_end: 0.1, rtol: 1e-9, outputs: [q, lambda, section(rod.M)]}
"""
UNIT = np.eye(3)
DIRECTIONS = ("y", "z", "-x", "-y", "-z")
OBLIQUE = ("along: [1, 2, 2], ", "axes: {x: [-1, 0.5, 0.2], z: [0, 1, 3]}, ", "axes: {y: [0.6, 0, -0.8]}, ")


def unit(v):
    return np.array(v) / np.linalg.norm(v)


def axes_of(key):
    """The axes of the beam as columns, from what the page says of them."""
    signed = {sign + letter: (1 - 2 * len(sign)) * UNIT[k] for sign in ("", "-") for k, letter in enumerate("xyz")}
    if key.startswith("axes: {x"):
        x, z = unit([-1, 0.5, 0.2]), np.array([0, 1, 3.0])
        z = unit(z - x * (x @ z))
        return np.stack([x, np.cross(z, x), z], 1)
    if key.startswith("axes: {y"):
        k, to = 1, np.array([0.6, 0, -0.8])
    else:
        k, to = 0, unit(eval(key[7:-2])) if "[" in key else signed[key[7:-2]]
    if to @ UNIT[k] < -0.9:
        return np.diag([-1.0, 1.0, -1.0])
    across = np.cross(UNIT[k], to)
    turn = np.cross(UNIT, across)  # of across x v
    return UNIT + turn + turn @ turn / (1 + to[k])


def words(v):
    return "[" + ", ".join(repr(float(x) + 0.0) for x in v) + "]"


def but_for_axes(text):
    """A text of check without its sentences on the axes of beams and on masses in them, and without ends of lines."""
    text = re.sub(r"its beam has the axes .*? of the body ", "", " ".join(text.split()))
    return re.sub(r"without deformation it has .*? kg m\^2", "", text)


def written(text, key, frame=""):
    a = axes_of(key) if key else UNIT
    pair = lambda m: f"{{x: {words(m[:, 0])}, y: {words(m[:, 1])}}}"
    text = text.replace("<KEY>", key).replace("<FRAME>", frame).replace("<A z>", words(a[:, 2])).replace("<A'>", pair(a.T)).replace("<A>", pair(a))
    return re.sub(r"<A (\[.*?\])>", lambda found: words(a @ np.array(eval(found[1]))), text)


class Same(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def put(self, text):
        path = self.folder / "model.yaml"
        path.write_text(text)
        return path

    def rows(self, text, key="", frame="", **values):
        said, rows = runs.simulated(self.put(written(text, key, frame)), status=None, **values)
        names = list(rows[0])
        table = np.array([[row[name] for name in names] for row in rows])
        at = [k for k, name in enumerate(names) if name.startswith("deflection")]
        if key and at:
            table[:, at] = table[:, at] @ axes_of(key)
        return names, table, said

    def agree(self, got, want, names, least=1e-12):
        """Each column within `least` of its largest value, and a vector of its own; of displacements of 1 m."""
        groups = [name.rpartition(".")[0] if "." in name and not name.startswith("q") else name for name in names]
        for group in set(groups):
            at = [k for k, name in enumerate(groups) if name == group]
            size = 1.0 if group.startswith("deflection") else np.max(np.abs(want[:, at]))
            loads = 10 if group.startswith(("section", "lambda", "reaction", "moment", "stress")) else 1
            self.assertLess(np.max(np.abs(got[:, at] - want[:, at])), loads * least * size + 1e-15, group)

    def said(self, *given):
        """The text that a command prints of the model."""
        return subprocess.run([runs.command, *given, str(self.folder / "model.yaml")], capture_output=True, text=True, timeout=250).stdout

    def test_motion_of_a_chain(self):
        for frame in ("frame: clamped", "frame: chord\n      stiffening: first\n      damping: {ratio: 0.01}"):
            names, want, _ = self.rows(CHAIN, frame=frame)
            for key in (*(f"along: {word}, " for word in DIRECTIONS), *OBLIQUE):
                with self.subTest(key=key, frame=frame):
                    self.agree(self.rows(CHAIN, key, frame)[1], want, names)

    def test_bodies_at_the_origin(self):
        """Joints at the origin, and at a point of the section there without a station, have the axes of the body."""
        more = """  first: {joint: {name: C, revolute: z, at: rod, frame: <A>}, mass: 0.1, com: [0.03, 0, 0], inertia: {zz: 2e-4}, points: {E: [0.1, 0, 0]}}
  second: {joint: {name: D, revolute: y, at: rod.P, frame: <A>}, mass: 0.1, com: [0, 0, 0.05], inertia: {xx: 1e-4, yy: 1e-4, zz: 2e-4}}
forces:"""
        text = CHAIN.replace("forces:", more).replace("      mid:", "      P: <A [0, 0.05, 0.02]>\n      mid:").replace("[q, ", "[q, position(first.E), ")
        names, want, _ = self.rows(text, frame="frame: clamped")
        for key in ("along: y, ", "along: -x, ", *OBLIQUE):
            with self.subTest(key=key):
                self.agree(self.rows(text, key, "frame: clamped")[1], want, names)

    def test_motion_in_flight(self):
        start = "start: {qd: {F.1: 0.3, F.4: 2, F.5: 1, F.6: -1.5, rod.y1: 0.1, rod.phi1: 0.5}}\n"
        for key in ("along: y, ", OBLIQUE[1]):
            names, want, _ = self.rows(FLIGHT.replace("run:", start + "run:"))
            a = axes_of(key)  # the axes of the free joint are those of the body: so are its rates
            v, turn = a @ [0.3, 0, 0], a @ [2, 1, -1.5]
            rates = ", ".join(f"F.{k + 1}: {x!r}" for k, x in enumerate(map(float, [*v, *turn])))
            _, got, _ = self.rows(FLIGHT.replace("run:", f"start: {{qd: {{{rates}, rod.y1: 0.1, rod.phi1: 0.5}}}}\nrun:"), key)
            self.agree(got, want, names, 1e-8)  # another chart of the rotation: steps differ

    def test_loops_and_their_studies(self):
        names, want, _ = self.rows(LOOP)
        text = self.said("check")
        self.assertIn("buckles", text + self.said("check", "--all"))
        modes, rest = (runs.kempe(study, self.folder / "model.yaml", status=None) for study in ("modes", "equilibrium"))
        for key in ("along: y, ", "along: -x, ", "along: [1, 1, 0], "):
            with self.subTest(key=key):
                self.agree(self.rows(LOOP, key)[1], want, names)
                self.assertEqual(but_for_axes(self.said("check")), but_for_axes(text))
                again, still = (runs.kempe(study, self.folder / "model.yaml", status=None) for study in ("modes", "equilibrium"))
                for found, wanted in ((again, modes), (still, rest)):
                    np.testing.assert_allclose(numbers(found), numbers(wanted), rtol=1e-9, atol=1e-9)

    def test_mass_in_the_axes_of_the_body(self):
        """In check, and of the rigid body that a comparison has in its place."""
        said = {}
        for key in ("", "along: y, "):
            self.put(written(CHAIN, key, "frame: clamped"))
            said[key] = re.search(r"centre \[(.*?)\] m, inertia xx (\S+) yy (\S+) zz (\S+)", " ".join(self.said("check").split())).groups()
        (x, xx, yy, zz), turned = said[""], said["along: y, "]
        self.assertEqual(turned, (", ".join(["0", x.split(", ")[0], "0"]), yy, xx, zz))

    def test_segments_and_other_models(self):
        """The same pieces, whose points and springs turn with the beam."""
        for bodies in ("segments: 5", "segments: 4\n      rotary: no"):
            text = CHAIN.replace("deflection(rod.tip), section(rod.mid), stress(rod.mid),", "").replace("section_by_shapes(rod.mid),", "")
            text = text.replace(", momentum(rod), angular_momentum(rod)", "")
            text = text.replace("torsion: 1", "torsion: 0") if "no" in bodies else text
            names, want, _ = self.rows(text, frame=bodies)
            for key in ("along: y, ", "along: -z, ", *OBLIQUE):
                with self.subTest(key=key, bodies=bodies):
                    self.agree(self.rows(text, key, bodies)[1], want, names, 1e-10)
        tables = [runs.kempe("compare", self.put(written(LOOP, key).replace("ratio: 0.01", "rayleigh: [0, 1e-4]").replace(", section(rod.M)", ", position(rod.M)")), "--bodies", "rigid,none,segments:4", "--rtol", "1e-6", status=None) for key in ("", "along: y, ")]
        for a, b in zip(*(found["bodies"]["rows"] for found in tables)):
            self.assertEqual(a["bodies"], b["bodies"])
            np.testing.assert_allclose(*([x["error"] for x in row.get("outputs", [])] for row in (a, b)), rtol=1e-6, atol=1e-9)

    def test_parameters(self):
        """Stations and places follow the length: values of a run, and derivatives."""
        names, want, _ = self.rows(CHAIN, frame="frame: clamped", L=0.7)
        slopes = runs.kempe("sensitivity", self.put(written(CHAIN, "", "frame: clamped\n      raw: yes")), "--parameters", "L", "--outputs", "q", status=None)
        for key in ("along: z, ", OBLIQUE[0]):
            self.agree(self.rows(CHAIN, key, "frame: clamped", L=0.7)[1], want, names)
            found = runs.kempe("sensitivity", self.put(written(CHAIN, key, "frame: clamped\n      raw: yes")), "--parameters", "L", "--outputs", "q", status=None)
            np.testing.assert_allclose(numbers(found), numbers(slopes), rtol=1e-6, atol=1e-7)

    def test_pictures(self):
        """Frames of the page have the same numbers, with the deformation that a factor multiplies."""
        pages = []
        for key in ("", "along: y, "):
            page = self.folder / "page.html"
            subprocess.run([runs.command, "simulate", str(self.put(written(CHAIN.replace("deflection(rod.tip), ", ""), key, "frame: clamped"))),
                            "--no-convergence-check", "--report", str(page)], capture_output=True, check=False)
            line = next(line for line in page.read_text().splitlines() if line.startswith('{"answer"'))
            pages.append(json.loads(line)["picture"])
            del pages[-1]["frames"]["rotation"]  # of bodies: their axes are others
        self.assertGreater(pages[0]["flexible"]["factor"], 1)
        self.assertEqual([], [key for key in pages[0] if pages[0][key] != pages[1][key]])

    def test_operations(self):
        """Along an axis of the body the equations have the same operations."""
        made = []
        for key in ("", "along: y, "):
            self.put(written(CHAIN, key, "frame: chord"))
            made.append(self.said("show", "--stats").partition("simplification")[0])
        self.assertIn("all in one program", made[0])
        self.assertEqual(*made)

    def test_along_x_is_what_it_was(self):
        """Each byte of the rows."""
        _, want, _ = self.rows(CHAIN, frame="frame: chord")
        for key in ("along: x, ", "axes: {x: x}, ", "axes: {y: y, z: z}, "):
            got = runs.simulated(self.put(CHAIN.replace("<KEY>", key).replace("<FRAME>", "frame: chord").replace("<A z>", "z").replace(
                ", frame: <A'>", "").replace(", axes: <A>", "").replace("<A ", "").replace("]>", "]")), status=None)[1]
            self.assertTrue(np.array_equal(np.array([list(row.values()) for row in got]), want), key)


def numbers(found):
    """All numbers of a document in JSON but those of its cost: seconds and counts."""
    if isinstance(found, dict):
        skipped = ("work", "verdict")
        return [x for key, value in found.items() if key not in skipped and not key.endswith("_s") for x in numbers(value)]
    if isinstance(found, list):
        return [x for value in found for x in numbers(value)]
    return [float(found)] if isinstance(found, (int, float)) and not isinstance(found, bool) else []


if __name__ == "__main__":
    runs.main()
