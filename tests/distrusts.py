#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every reason of the sources for which a result is not trustworthy (kmp_doubt), provoked by a model. Text, object, page, exit code and Python say the same.

    python3 tests/distrusts.py build/dev/kempe

A reason that no row provokes is in UNPROVOKED, with the test that provokes it and its words there, or with what is missing.
"""
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
KEMPE = "kempe"  # set by main
BAR, STICK = (f"examples/{name}/{name}.yaml" for name in ("four_bar", "stick_slip"))
BEAM = ("kempe: 1\ngravity: [0, {g}, 0]\nbodies:\n  rod:\n    joint: {joint}\n    flexible: {{beam: {{length: 2, rhoA: 3, EIz: {EI}}}, shapes: {{y: 2}}, {more}}}\n"
        "    points: {{tip: {{station: 2}}}}\n{rest}run: {{t_end: 0.5}}\n")
MODELS = {
    "law.yaml": "kempe: 1\ntables: {law: {x: [0, 1, 2, 3], y: [0, 1, 4, 4.1]}}\nparameters: {m: 2}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: m}}\n"
                "forces: {f: {joint: x, force: 'law(t)'}}\nrun: {t_end: 6, outputs: [q, qd]}\n",
    "flat.yaml": """kempe: 1
gravity: [0, 0, -9.81]
ground: {points: {O: [0, 0, 0]}}
bodies:
  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.1, 0, 0]}}
  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.01}, points: {C: [0.3, 0, 0]}}
  slider: {mass: 5, inertia: {zz: 0.1}, points: {C: [0, 0, 0]}}
joints: {C: {revolute: [rod.C, slider.C], cut: no}, S: {prismatic: [ground.O, slider.C], axis: x, cut: yes}}
forces: {rub: {sliding: position(slider.C).x, friction: {mu: 0.3, reaction: S, speed: 1 mm/s}}}
start: {q: {A: 60 deg, B: -80 deg}, hold: [A]}
run: {t_end: 0.05, outputs: [q]}
""",
    "soft.yaml": BEAM.format(g=-9.81, joint="{weld: yes, at: ground}", EI=30, more="stiffening: first", rest=""),
    "fast.yaml": BEAM.format(g=0, joint="{name: A, revolute: z, at: ground}", EI=100, more="stiffening: none", rest="start: {qd: {A: 60}}\n"),
    "swing.yaml": "kempe: 1\ngravity: [0, -9.81, 0]\nbodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}}\nrun: {t_end: 1}\n",
    "moved.yaml": "kempe: 1\ngravity: [0, -9.81, 0]\nbodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}}\n"
                  "loops: {turn: {constraint: 'q(A) - t'}}\nrun: {t_end: 1}\n",
    "shake.yaml": "kempe: 1\nbodies: {car: {joint: {name: z, prismatic: z, at: ground}, mass: 1, points: {P: [0, 0, 0]}}}\n"
                  "drives: {d: {joint: z, displacement: '1e-3*sin(2*pi*190*t)'}}\nrun: {t_end: 8}\n",
}
MOTION = "t,q.A\n" + "".join(f"{k / 8:.17g},{math.sin(9 * k / 8):.17g}\n" for k in range(9))
WAVES = "t,q.rocker\n" + "".join(f"{k / 50},{0.3 * math.sin(25 * k / 50):.17g}\n" for k in range(51))
FILES = {"motion.csv": MOTION, "waves.csv": WAVES, "bars.csv": "crank\n0.3\n50\n"}
# The words of the reason in the sources, and the command that provokes it; a second command before it.
PROVOKED = [
    ("do not trust this run: the energy error is", f"simulate {BAR} --rtol 1e-3 --t-end 60"),
    ("do not trust this run beyond t =", f"simulate {BAR} --rtol 1e-3 --t-end 60"),
    ("this state is not an equilibrium, because friction cannot hold it", f"equilibrium {STICK} --stick"),
    ("KMP_TABLE_LEFT", "simulate law.yaml"),
    ("instances use table", "ensemble law.yaml --sample m=1:2 --instances 3"),
    ("no values within the bounds satisfy all limits", f"optimize {BAR} --minimize 'max(qd(rocker))' --parameter base:0.85:0.95 --limit 'max(q(rocker)) > 2' --t-end 1"),
    ("the best search has not converged after", f"optimize {BAR} --minimize 'max(qd(rocker))' --parameter base:0.85:0.95,crank:0.2:0.31 --t-end 1 --most 2"),
    ("the fitted motion does not follow the data", f"fit {BAR} waves.csv --parameter crank_mass:0.5:2"),
    ("the search has not converged after", f"fit {BAR} waves.csv --parameter crank_mass:0.5:2,coupler_mass:0.5:2 --most 1"),
    ("instances that did not reach their end", "gather bars.kempe", f"ensemble {BAR} --values bars.csv --t-end 0.1 --out bars.kempe"),
    ("do not trust these actuator forces", "inverse swing.yaml --motion motion.csv --actuators A"),
    ("depends on time: it prescribes the motion and carries its loads", "inverse moved.yaml --actuators A"),
    ("comfort: with every other sample", "comfort shake.yaml --vertical 'acceleration(car.P).z' --rate 400"),
    ("deflects by %.3g m at t =", "simulate soft.yaml"),
    ("faster than its first frequency", "simulate fast.yaml"),
    ("lacks the load of '%s' across the plane", "simulate flat.yaml"),
]
SAID = {"KMP_TABLE_LEFT": "it goes straight on there", "instances that did not reach their end": "1 failed"}  # in texts
TESTED, MISSING = "tested", "no model: "
UNPROVOKED = {
    "do not trust the response at": (TESTED, "tests/api/test_response.c", "do not trust the response at"),
    "the deviations of the columns still change": MISSING + "a search of weights that does not settle",
    "not refined after it: evaluate a shorter time": MISSING + "a run of a vehicle beyond the memory for its samples",
    "is not resolved by %d places": MISSING + "a profile of wheels that jumps between two rows",
    "terms of second order": (TESTED, "tests/flexible_formats.py", "terms of second order"),
    "of its first frequency: %s, so that rates": (TESTED, "tests/flexible_formats.py", "so that rates up to 0.1 are right"),
    "straight because no load deflects it": (TESTED, "tests/unit/test_buckling.c", "stays straight"),
    "do not trust this run: the loops open by": (TESTED, "tests/unit/test_convergence.c", "loops open"),
    "omitted as redundant, is open by": MISSING + "redundant equations that open during a run beyond the tolerance of closures",
    "the accuracy of this run could not be checked": MISSING + "a second run that ends before the first one",
    "deformations are in balance with their loads, but not in a stable one": (TESTED, "tests/unit/test_static_start.c", "not in a stable one"),
    "start: the deformations are in balance": (TESTED, "tests/unit/test_static_start.c", "buckles under less"),
    "shapes with terms of second order are": (TESTED, "tests/unit/test_static_start.c", "of its length"),
    "equilibria are known only from": MISSING + "a path of equilibria that turns back",
    "no limit cycle is found near the Hopf point": MISSING + "a Hopf point without cycles",
    "depends on a load that redundant constraints share": (TESTED, "tests/unit/test_joint_loads.c", "redundant constraints share"),
    "were not searched to the end for short pulses": MISSING + "functions of time with pulses too short to be searched for",
    "change in more intervals of about": MISSING + "functions of time that change in very many intervals",
}
PASSED_ON = 3  # calls that pass on a sentence that is made elsewhere


def doubts():
    """The sentences of kmp_doubt in the sources, each with its parts joined."""
    for path in sorted(path for folder in ("src", "constraints", "integrators") for path in (ROOT / folder).rglob("*.c")):
        text = path.read_text()
        for call in re.finditer(r"\bkmp_doubt\(\s*[^,;]+,\s*((?:\w+,|(?:\"(?:[^\"\\]|\\.)*\"\s*)+))", text):
            yield call[1].rstrip(",") if call[1][0] != '"' else "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', call[1]))


class Distrusts(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "examples").symlink_to(ROOT / "examples")
        for name, text in {**MODELS, **FILES}.items():
            (self.folder / name).write_text(text)

    def run_kempe(self, words):
        return subprocess.run(f"{KEMPE} {words}", shell=True, capture_output=True, text=True, cwd=self.folder, timeout=100)

    def test_every_reason(self):
        """Each sentence of the sources is in a row."""
        said = list(doubts())
        self.assertGreater(len(said), 30)
        rows = [row[0] for row in PROVOKED] + list(UNPROVOKED)
        self.assertEqual([s for s in said if not s.startswith("%") and not any(row in s for row in rows)], [])
        self.assertEqual([row for row in rows if not any(row in s for s in said)], [])
        self.assertEqual(sum(s.startswith("%") for s in said), PASSED_ON)
        self.assertEqual([row for row in UNPROVOKED.values() if row[0] == TESTED and row[2] not in (ROOT / row[1]).read_text()], [])

    def test_all_agree(self):
        for words, command, *before in PROVOKED:
            with self.subTest(words):
                for other in before:
                    self.run_kempe(other)
                part = SAID.get(words) or max(re.split(r"%\.?\d*\w|'%s'", words), key=len).strip()
                done = self.run_kempe(command)
                self.assertEqual(done.returncode, 5, done.stdout[:300] + done.stderr)
                lines = done.stdout.split("\n")
                self.assertRegex(lines[0], r": not trustworthy\b")
                told = " ".join(" ".join(lines[1:12]).split())
                self.assertIn(part, told)
                found = self.run_kempe(f"{command} --json -")
                self.assertEqual(found.returncode, 5)
                found = json.loads(found.stdout)
                self.assertEqual(found["status"], "not trustworthy")
                self.assertTrue("warnings" not in found or any(words in SAID or part in warning for warning in found["warnings"]), found.get("warnings"))
                if "--report" in self.run_kempe(f"help {command.split()[0]}").stdout:
                    self.assertEqual(self.run_kempe(f"{command} --report page.html -q").returncode, 5)
                    self.assertIn('"not trustworthy"', (self.folder / "page.html").read_text())

    def test_python(self):
        """The result of a run has the word, and is not trusted."""
        program = "import kempe, warnings; warnings.simplefilter('ignore')\nfor name in ('law', 'soft', 'fast', 'flat'):\n" \
                  "    run = kempe.Model(name + '.yaml').simulate(); print(name, run.trusted, run.status)\n"
        done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, cwd=self.folder, env={**os.environ, "PYTHONPATH": str(pathlib.Path(KEMPE).parent / "python")})
        self.assertEqual(done.stdout.splitlines(), [f"{name} False not trustworthy" for name in ("law", "soft", "fast", "flat")], done.stderr)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
