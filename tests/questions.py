#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Questions that a reader has on a result, with the answer that stands in the first five lines of what the command prints.

    python3 tests/questions.py build/dev/kempe

For each result: what is the answer, may it be trusted, and what is to be done next. Its outcome is also the exit code's.
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
KEMPE = "kempe"  # set by main
LINES = 5
BAR = "examples/four_bar/four_bar.yaml"
CODES = {"complete": 0, "not trustworthy": 5, "stopped": 1, "failed": 1, "can be simulated": 0, "all motion is prescribed": 0, "cannot move": 0,
         "no run is possible": 1, "does not assemble": 1}

# The question, the command, a pattern of the answer.
QUESTIONS = [
    ("How many degrees of freedom has the linkage?", f"check {BAR}", r"\b1 degree of freedom\b"),
    ("How many constraint equations has it, and are they independent?", f"check {BAR}", r"2 equations in 1 closure \(C\), all independent"),
    ("Are the reactions of Bricard's linkage unique?", "check examples/bricard/bricard.yaml", r"some reactions are not unique"),
    ("What drives Peaucellier's cell?", "check examples/peaucellier/peaucellier.yaml", r"driven by 'motor'"),
    ("Can this loop be closed?", "assemble linkage.yaml --set 'coupler=50 mm'", r"failed, loops remain open: 'C' by 0\.\d+ m"),
    ("How many ways are there to assemble the four-bar?", f"assemble {BAR} --branches", r"2 assembly modes"),
    ("Did the run reach its end?", f"simulate {BAR} --t-end 1", r"complete, 0 to 1 s"),
    ("How large is its error?", f"simulate {BAR} --t-end 1", r"estimated error \d\S* rad"),
    ("May a run with a loose tolerance be trusted?", f"simulate {BAR} --t-end 60 --rtol 1e-3", r"not trustworthy"),
    ("Why not, and what helps?", f"simulate {BAR} --t-end 60 --rtol 1e-3", r"energy .*smaller rtol"),
    ("Where does the motion end that cannot continue?", f"kinematics {BAR} --sweep rocker=0:3", r"dead centre.*'rocker'.* 0\.7068\d* rad"),
    ("What can be swept instead?", f"kinematics {BAR} --sweep rocker=0:3", r"crank"),
    ("Is there an equilibrium, and is it stable?", f"equilibrium {BAR}", r"1 equilibrium found, stable"),
    ("Which torque must the motor have?", "inverse examples/driven_slider_crank/driven_slider_crank.yaml", r"crank +N m +17\.0695"),
    ("Is it unique?", "inverse examples/driven_slider_crank/driven_slider_crank.yaml", r"uniquely determined"),
    ("What is the derivative of the crank's angle with respect to the crank?", f"sensitivity {BAR} --parameters crank --t-end 1", r"q\.crank +rad +\S+ +-1\.17"),
    ("Which base makes the rocker's rate smallest?", f"optimize {BAR} --minimize 'max(qd(rocker))' --parameter base:0.85:0.95 --t-end 1",
     r"minimum of max\(qd\(rocker\)\) = \S+ rad/s at base = 0\.918"),
    ("Can the rocker's angle exceed 2 rad?", f"optimize {BAR} --minimize 'max(qd(rocker))' --parameter base:0.85:0.95 --limit 'max(q(rocker)) > 2' --t-end 1",
     r"not trustworthy, no values satisfy max\(q\(rocker\)\) > 2, nearest 0\.7287\d* rad"),
    ("How many instances of a sample can be computed?", f"ensemble {BAR} --sample crank=0.28:0.45,rocker=0.1:0.8 --instances 40 --t-end 0.2", r"\d+ of 40 instances (are )?complete"),
    ("Why do the others fail?", f"ensemble {BAR} --sample crank=0.28:0.45,rocker=0.1:0.8 --instances 40 --t-end 0.2", r"failed: parameter 'across' is not a number.*first: instance"),
    ("Which frequency has the body of the car?", "modes examples/quarter_car/quarter_car.yaml", r"1\.12125"),
    ("Is it stable?", "modes examples/quarter_car/quarter_car.yaml", r"[Ss]table|decays"),
    ("Which method is the fastest one for a given error?", f"compare {BAR} --t-end 1 --rtol 1e-4,1e-6,1e-8", r"use (--formulation \w+ --integrator \w+|\w+ \w+ \w+)"),
    ("Where is the file, and what is inside?", f"fmu {BAR} --no-binary -o four_bar.fmu", r"four_bar\.fmu: FMI 3\.0.*\n.*2 states"),
]


class Questions(unittest.TestCase):
    def test_answers(self):
        printed = {}
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "examples").symlink_to(ROOT / "examples")
            subprocess.run([KEMPE, "new", "linkage"], cwd=folder, check=True, capture_output=True)
            for question, command, answer in QUESTIONS:
                if command not in printed:
                    printed[command] = subprocess.run(f"{KEMPE} {command}", shell=True, capture_output=True, text=True, cwd=folder)
                done = printed[command]
                with self.subTest(question):
                    first = done.stdout.split("\n")
                    self.assertRegex("\n".join(first[:LINES]), answer)
                    outcome = next((word for word in sorted(CODES, key=len, reverse=True) if f": {word}" in first[0]), None)
                    self.assertEqual(done.returncode, CODES.get(outcome), first[0])
        self.assertGreaterEqual(len(QUESTIONS), 20)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
