#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The texts that the command prints for the examples keep these rules. Called with the path of the command:

    python3 tests/text_rules.py build/dev/kempe

- the first line names the model and has a word of the outcome; where a result is not trustworthy, the reason follows at once,
- a number has at most nine digits that count, and none is -0,
- in tables of coordinates, rounding is 0: no value is below 1e-12 of its size.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
KEMPE = "kempe"  # set by main
OUTCOME = re.compile(r"^.+: (complete|complete, not checked|not trustworthy|stopped|failed|can be simulated|cannot move|all motion is prescribed|no run is possible|does not assemble)\b")
NUMBER = re.compile(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]\d+)?(?![\w.])")
LEAST, MOST_DIGITS = 1e-12, 9
WAYS = {"check": (), "assemble": (), "simulate": ("--t-end", "0.02"), "equilibrium": (), "modes": (), "linearize": ()}


def models():
    """The model of each folder that has its name; one for all vehicles on rails, whose equilibria take long."""
    found = [path for path in sorted(ROOT.glob("examples/*/*.yaml")) if path.stem == path.parent.name]
    return [path for path in found if path.stem == "curving" or "\nwheels:" not in path.read_text() + "\n"]


def faults(text):
    """Complaints of a text."""
    lines = text.splitlines()
    found = [] if OUTCOME.match(lines[0]) else [f"no outcome in '{lines[0]}'"]
    if ": not trustworthy" in lines[0] and not (len(lines) > 1 and lines[1].startswith("  ")):
        found.append("no reason after the first line")
    table = False
    for line in lines:
        table = bool(line.strip()) and (table or bool(re.match(r"^ {2,}\s+(start value|position)\b", line)))
        for number in NUMBER.findall(line):
            digits = re.sub(r"e.*|[-.]", "", number).lstrip("0")
            if len(digits) > MOST_DIGITS:
                found.append(f"{len(digits)} digits: {line}")
            if re.fullmatch(r"-0\.?0*", number):
                found.append(f"-0: {line}")
            if table and 0 < abs(float(number)) < LEAST and not line.startswith("at t"):
                found.append(f"rounding: {line}")
    return found


class TextRules(unittest.TestCase):
    def test_examples(self):
        self.assertGreater(len(models()), 30)
        with tempfile.TemporaryDirectory() as folder:
            for model in models():
                for command, options in WAYS.items():
                    done = subprocess.run([KEMPE, command, model, *options], capture_output=True, text=True, cwd=folder)
                    if done.stdout:
                        with self.subTest(f"{command} {model.stem}"):
                            self.assertEqual(faults(done.stdout), [])

    def test_faults_are_found(self):
        good = "m: complete, 0 to 1 s, 2 rows\n\nat t = 1 s\n       position\n  A         1.5  rad\n"
        self.assertEqual(faults(good), [])
        for bad in (good.replace("complete", "ok"), good.replace("complete", "not trustworthy"), good.replace("1.5 ", "1.50000000001 "),
                    good.replace("1.5 ", "-0 "), good.replace("1.5 ", "3e-17 ")):
            self.assertTrue(faults(bad), bad)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
