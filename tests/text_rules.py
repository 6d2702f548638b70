#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The texts that the command prints for the examples keep these rules. Called with the path of the command:

    python3 tests/text_rules.py build/dev/kempe

- the first line names the model and has a word of the outcome; where a result is not trustworthy, the reason follows at once,
- a number has at most nine digits that count, and none is -0,
- in tables of coordinates, rounding is 0: no value is below 1e-12 of its size,
- of the commands TIDY, a line has at most 100 characters, and no word of the implementation; outside of tables it does not end with
  a number that has no unit, and at most three lines in a row differ only in digits.
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
LONGEST, MOST_ALIKE = 100, 3
IMPLEMENTATION = re.compile(r"\b(lanes|pivots|margins?|charts|counted operations|vanish identically|tracked)\b")
# Commands for all models, with their options; and for some models, with what these need.
WAYS = {"check": (), "assemble": (), "simulate": ("--t-end", "0.02"), "equilibrium": (), "modes": (), "linearize": ()}
TIDY = ("compare", "linearize", "modes", "response", "cycles", "contact", "comfort")
SHAKEN = ("--inputs", "force(chassis.R.z)", "--outputs", "position(chassis.R).z,q(z)")
FURTHER = [
    ("compare", "four_bar", "--t-end", "0.2", "--rtol", "1e-4,1e-6"), ("compare", "four_bar", "--t-end", "0.2", "--rtol", "1e-4,1e-6", "--all"),
    ("compare", "governor", "--t-end", "0.2", "--rtol", "1e-4,1e-6"), ("compare", "driven_slider_crank", "--rtol", "1e-3,1e-5"),
    ("compare", "flexible_pendulum", "--t-end", "0.1", "--rtol", "1e-5", "--bodies", "rigid,none"),
    ("linearize", "four_bar", "--at", "start", "--all"), ("linearize", "suspension", *SHAKEN), ("linearize", "suspension", *SHAKEN, "--all"),
    ("modes", "quarter_car", "--sweep", "damper=0:6000:7"), ("modes", "suspension", "--all"), ("modes", "flexible_blade", "--at", "start", "--all"),
    ("modes", "governor", "--rates", "shaft=4:12:3"), ("modes", "wheelset", "--sweep", "v=5:30:4"),
    ("response", "suspension", *SHAKEN, "--frequencies", "0.2:30:20"), ("response", "four_bar", "--inputs", "effort(crank)", "--outputs", "q", "--angle-unit", "deg"),
    ("response", "ride", "--inputs", "drive(road)", "--outputs", "q(body),travel"),
    ("cycles", "restrained_wheelset/hunting_wheelset", "--sweep", "V=100:101:2", "--outputs", "q(y)"),
    ("contact", "conicity", "--sweep", "shift=-9 mm:9 mm:31", "--conicity", "1 mm:7 mm:7"),
    ("contact", "manchester", "--sweep", "shift=0:10 mm:21", "--law", "fastsim1"), ("contact", "manchester", "--sweep", "shift=0:10 mm:3", "--law", "fastsim1", "--all"),
    ("comfort", "ride/shaken_seat"), ("comfort", "ride", "--vertical", "acceleration(body.L).z", "--t-end", "5"),
]


def models():
    """The model of each folder that has its name; one for all vehicles on rails, whose equilibria take long."""
    found = [path for path in sorted(ROOT.glob("examples/*/*.yaml")) if path.stem == path.parent.name]
    return [path for path in found if path.stem == "curving" or "\nwheels:" not in path.read_text() + "\n"]


def is_table(paragraph):
    """One of its first lines is a row of heads, or the equation of matrices."""
    return any(re.search(r"\S {2,}[^\s\d]", line) and not re.search(r"\d\.\d", line) or re.match(r"(dx/dt|x\(k\+1\)|y|M d2u/dt2 .*) = |(all coordinates|eigenvalues z)", line) or len(NUMBER.findall(line)) > 4 or ", columns " in line for line in paragraph[:3])


def joined(paragraph):
    """Its lines, with those that were broken at the longest length as one."""
    whole = []
    for line in paragraph:
        if whole and len(whole[-1]) > 0.8 * LONGEST and re.match(r" {4}\S", line):
            whole[-1] += " " + line.strip()
        else:
            whole.append(line)
    return whole


def untidy(lines):
    """Complaints of the lines of a command that is TIDY."""
    found = [f"{len(line)} characters: {line}" for line in lines if len(line) > LONGEST]
    found += [f"'{word}': {line}" for line in lines for word in IMPLEMENTATION.findall(line)]
    for paragraph in (block.split("\n") for block in re.split(r"\n\s*\n", "\n".join(lines))):
        if is_table(paragraph):
            continue
        whole = joined(paragraph)
        found += [f"a number without unit at its end: {line}" for line in whole[1:] if re.search(r"[^\s,;:(=]\s+-?\d+\.\d+(e[-+]\d+)?$", line)]
        alike = [re.sub(r"\d", "", line) for line in whole]
        found += [f"lines differ only in digits: {whole[k]}" for k in range(MOST_ALIKE, len(whole)) if len(set(alike[k - MOST_ALIKE:k + 1])) == 1]
    return found


def faults(text, command):
    """Complaints of a text of a command."""
    lines = text.splitlines()
    found = untidy(lines) if command in TIDY else []
    found += [] if OUTCOME.match(lines[0]) else [f"no outcome in '{lines[0]}'"]
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
                            self.assertEqual(faults(done.stdout, command), [])

    def test_further(self):
        with tempfile.TemporaryDirectory() as folder:
            for command, model, *options in FURTHER:
                path = ROOT / "examples" / (model if "/" in model else f"{model}/{model}")
                done = subprocess.run([KEMPE, command, f"{path}.yaml", *options], capture_output=True, text=True, cwd=folder)
                with self.subTest(" ".join([command, model, *options])):
                    self.assertEqual(faults(done.stdout, command) if done.stdout else done.stderr, [])

    def test_faults_are_found(self):
        good = "m: complete, 0 to 1 s, 2 rows\n\nat t = 1 s\n       position\n  A         1.5  rad\n"
        self.assertEqual(faults(good, "modes"), [])
        for bad in (good.replace("complete", "ok"), good.replace("complete", "not trustworthy"), good.replace("1.5 ", "1.50000000001 "),
                    good.replace("1.5 ", "-0 "), good.replace("1.5 ", "3e-17 "), good + "\nm\n  the mode is near 3.25\n", good + "least pivots 1 m\n",
                    good + "\nm\n" + "".join(f"crossed at t = {k} s\n" for k in range(4)), good + 21 * "word " + "\n"):
            self.assertTrue(faults(bad, "modes"), bad)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
