#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The texts that the command prints for the examples keep these rules. Called with the path of the command:

    python3 tests/text_rules.py build/dev/kempe

- the first line names the model and has a word of the outcome; where a result is not trustworthy, the reason follows at once,
- a number has at most six digits that count, and none is -0,
- in tables of coordinates, rounding is 0: no value is below 1e-12 of its size,
- of the commands TIDY, a line has at most 100 characters, and no word of the implementation; outside of tables it does not end with
  a number that has no unit, and at most three lines in a row differ only in digits,
- no text has more lines than text_lines.txt allows, the table of joint reactions and reasons for doubt apart.
"""
import math
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
LEAST, MOST_DIGITS = 1e-12, 6
LONGEST, MOST_ALIKE = 100, 3
IMPLEMENTATION = re.compile(r"\b(lanes|pivots|margins?|charts|counted operations|vanish identically|tracked)\b")
# Commands for all models, with their options; and for some models, with what these need.
WAYS = {"check": (), "assemble": (), "simulate": ("--t-end", "0.02"), "equilibrium": (), "modes": (), "linearize": ()}
TIDY = ("compare", "linearize", "modes", "response", "cycles", "contact", "comfort", "check", "assemble", "simulate", "equilibrium", "kinematics", "inverse")
WITH_STATES = ("assemble", "simulate", "equilibrium")  # states and sensors have no units
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
    ("cycles", "restrained_wheelset/hunting_wheelset", "--sweep", "V=100:101:2", "--outputs", "q(y)", "--most", "8"),
    ("contact", "conicity", "--sweep", "shift=-9 mm:9 mm:31", "--conicity", "1 mm:7 mm:7"),
    ("contact", "manchester", "--sweep", "shift=0:10 mm:21", "--law", "fastsim1"), ("contact", "manchester", "--sweep", "shift=0:10 mm:3", "--law", "fastsim1", "--all"),
    ("kinematics", "four_bar", "--sweep", "rocker=0:3"), ("kinematics", "slider_crank", "--sweep", "crank=0:360 deg"),
    ("inverse", "driven_slider_crank"), ("inverse", "stewart/driven", "--actuators", "slide1,slide2,slide3,slide4,slide5,slide6"), ("simulate", "four_bar", "--all"), ("equilibrium", "four_bar", "--global"), ("equilibrium", "stick_slip", "--stick"),
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


def untidy(lines, command):
    """Complaints of the lines of a command that is TIDY."""
    found = [f"{len(line)} characters: {line}" for line in lines if len(line) > LONGEST]
    found += [f"'{word}': {line}" for line in lines for word in IMPLEMENTATION.findall(line)]
    for paragraph in (block.split("\n") for block in re.split(r"\n\s*\n", "\n".join(lines))):
        if is_table(paragraph):
            continue
        whole = joined(paragraph)
        found += [f"a number without unit at its end: {line}" for line in whole[1:] if command not in WITH_STATES and re.search(r"[^\s,;:(=]\s+-?\d+\.\d+(e[-+]\d+)?$", line)]
        alike = [re.sub(r"\d", "", line) for line in whole]
        found += [f"lines differ only in digits: {whole[k]}" for k in range(MOST_ALIKE, len(whole)) if len(set(alike[k - MOST_ALIKE:k + 1])) == 1]
    return found


def faults(text, command):
    """Complaints of a text of a command."""
    lines = text.splitlines()
    found = untidy(lines, command) if command in TIDY else []
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


def allowed_lines():
    """The most lines of each call that text_lines.txt has."""
    rows = (ROOT / "tests/text_lines.txt").read_text().splitlines()[1:]
    return {call: int(number) for number, call in (row.split(" ", 1) for row in rows)}


def line_count(text):
    """The lines of a text without the table of joint reactions, and without the reasons why a result is not trustworthy."""
    paragraphs = re.split(r"\n\s*\n", text.rstrip("\n"))
    if ": not trustworthy" in paragraphs[0]:
        paragraphs[0] = paragraphs[0].split("\n")[0]
    kept = [paragraph for paragraph in paragraphs if not paragraph.startswith("joint reactions")]
    return sum(len(paragraph.split("\n")) for paragraph in kept) + len(kept) - 1


class TextRules(unittest.TestCase):
    def test_examples(self):
        allowed = allowed_lines()
        self.assertGreater(len(models()), 30)
        self.assertGreater(len(allowed), 250)
        with tempfile.TemporaryDirectory() as folder:
            for model in models():
                for command, options in WAYS.items():
                    done = subprocess.run([KEMPE, command, model, *options], capture_output=True, text=True, cwd=folder)
                    call = " ".join([command, model.stem, *options])
                    if done.stdout:
                        with self.subTest(call):
                            self.assertEqual(faults(done.stdout, command), [])
                            self.assertLessEqual(line_count(done.stdout), allowed.pop(call, math.inf))
        self.assertLess(sum(call.split()[0] in WAYS and len(call.split()) <= 4 for call in allowed), 30)  # limits of calls that are not made

    def test_further(self):
        allowed = allowed_lines()
        with tempfile.TemporaryDirectory() as folder:
            for command, model, *options in FURTHER:
                path = ROOT / "examples" / (model if "/" in model else f"{model}/{model}")
                done = subprocess.run([KEMPE, command, f"{path}.yaml", *options], capture_output=True, text=True, cwd=folder)
                call = " ".join([command, model, *options])
                with self.subTest(call):
                    self.assertEqual(faults(done.stdout, command) if done.stdout else done.stderr, [])
                    self.assertLessEqual(line_count(done.stdout), allowed.get(call, math.inf))

    def test_ends(self):
        """Runs that end early or fail, and loops that stay open: their reason is wrapped, too."""
        with tempfile.TemporaryDirectory() as folder:
            far = pathlib.Path(folder) / "far.yaml"
            far.write_text("kempe: 1\nname: rods that do not meet\nground: {points: {O: [0, 0, 0]" + "".join(f", D{k}: [{k + 3}, 0, 0]" for k in range(6)) +
                           "}}\nbodies:\n" + "".join(f"  rod_with_a_long_name_{k}: {{joint: {{name: j{k}, revolute: z, at: ground.O}}, mass: 1, points: {{P: [1, 0, 0]}}}}\n"
                                                       for k in range(6)) +
                           "loops:\n" + "".join(f"  far_away_{k}: {{ball: [rod_with_a_long_name_{k}.P, ground.D{k}]}}\n" for k in range(6)))
            for code, words in ((1, ("simulate", "four_bar", "--t-end", "400", "--output-step", "100", "--rtol", "1e-13", "--no-convergence-check")),
                                (1, ("simulate", "stewart", "--max-steps", "5")), (1, ("assemble", far)), (1, ("check", far)),
                                (1, ("kinematics", "four_bar", "--sweep", "rocker=0:9"))):
                path = words[1] if words[1] == far else f"{ROOT}/examples/{words[1]}/{words[1]}.yaml"
                done = subprocess.run([KEMPE, words[0], path, *words[2:]], capture_output=True, text=True, cwd=folder)
                with self.subTest(" ".join(map(str, words))):
                    self.assertEqual(done.returncode, code, done.stderr)
                    self.assertEqual([line for line in done.stdout.splitlines() if len(line) > LONGEST], [])
                    self.assertRegex(done.stdout.splitlines()[0], ": (failed|stopped|does not assemble)")

    def test_lines_are_counted(self):
        self.assertEqual(line_count("m: complete\n\na\nb\n\njoint reactions\n A\n\nend\n"), 6)
        self.assertEqual(line_count("m: not trustworthy\n  why\n\na\n"), 3)

    def test_faults_are_found(self):
        good = "m: complete, 0 to 1 s, 2 rows\n\nat t = 1 s\n       position\n  A         1.5  rad\n"
        self.assertEqual(faults(good, "modes"), [])
        for bad in (good.replace("complete", "ok"), good.replace("complete", "not trustworthy"), good.replace("1.5 ", "1.50000000001 "),
                    good.replace("1.5 ", "-0 "), good.replace("1.5 ", "3e-17 "), good + "\nm\n  the mode is near 3.25\n", good + "least pivots 1 m\n",
                    good + "\nm\n" + "".join(f"crossed at t = {k} s\n" for k in range(4)), good + 21 * "word " + "\n"):
            self.assertTrue(faults(bad, "modes"), bad)


class TextsOfResults(unittest.TestCase):
    """Texts of commands that need further words or files: also no line above 100 characters, and no words of the implementation."""

    LONGEST = 100
    INNER = re.compile(r"\b(lanes?|exchanges|pivots?|right-hand sides|factori[sz]ations|Newton \d)")
    MODELS = ("four_bar", "quarter_car", "slider_crank", "stewart")
    BRICK = ("--mass", "tests/models/brick_mass.mtx", "--nodes", "tests/models/brick_nodes.txt", "--units", "m kg s", "--interface", "root=x=0",
             "--interface", "tip=8-11", "--modes", "3")

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def faults(self, text):
        return (faults(text, "") + [f"{len(line)} characters: {line}" for line in text.splitlines() if len(line) > self.LONGEST]
                + [f"'{word.group()}' is of the implementation" for word in self.INNER.finditer(text)])

    def text(self, code, *words):
        """Returns what a command prints, which keeps the rules."""
        done = subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, cwd=self.folder)
        with self.subTest(" ".join(map(str, words[:2]))):
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertEqual(self.faults(done.stdout), [])
        return done.stdout

    def test_models(self):
        for name in self.MODELS:
            model = ROOT / f"examples/{name}/{name}.yaml"
            self.text(0, "sensitivity", model, "--t-end", "0.05")
            self.assertIn("written to the folder code\n", self.text(0, "generate", model, "--lang", "c", "-o", "code"))
            self.text(0, "generate", model, "--count")
            self.text(0, "show", model, "--stats")
            self.assertEqual(*(subprocess.run([KEMPE, "show", model, *words], capture_output=True, text=True, check=True).stdout for words in ((), ("--model",))))
            self.assertRegex(self.text(0, "fmu", model, "--no-binary", "-o", "unit.fmu"), r"^\S+: complete, unit\.fmu: FMI 3\.0, .*\d kB\n  \d+ states?, ")

    def test_states(self):
        """The unit of a parameter is above its derivatives, where the model has it."""
        for of in ("equilibrium", "modes"):
            self.assertRegex(self.text(0, "sensitivity", ROOT / "examples/quarter_car/quarter_car.yaml", "--of", of, "--parameters", "damper"), r"  per N[ *]s/m of damper")

    def test_searches(self):
        model = ROOT / "examples/four_bar/four_bar.yaml"
        subprocess.run([KEMPE, "simulate", model, "--t-end", "0.2", "-o", "data.csv"], cwd=self.folder, check=True, capture_output=True)
        self.assertRegex(self.text(0, "fit", model, "data.csv", "--columns", "q.rocker", "--parameter", "crank_mass:0.5:2"),
                         r"^four-bar: complete, fit of crank_mass to 21 measurements\n  residual \S+ rad of q\.rocker, ")
        search = ("optimize", model, "--minimize", "max(qd(rocker))", "--parameter", "base:0.85:0.95", "--t-end", "0.2")
        self.assertRegex(self.text(0, *search), r"^four-bar: complete, minimum of max\(qd\(rocker\)\) = \S+ rad/s at base = ")
        self.assertRegex(self.text(5, *search, "--limit", "max(q(rocker)) > 2"), r"^four-bar: not trustworthy, no values satisfy max\(q\(rocker\)\) > 2, nearest ")

    def test_instances(self):
        """The cause of failures is the same of a run, of a run into a folder and of the gathered folder."""
        study = ("ensemble", ROOT / "examples/four_bar/four_bar.yaml", "--sample", "crank=0.28:1.9", "--instances", "20", "--t-end", "0.1")
        told = [self.text(5, *words) for words in (study, (*study, "--out", "bars.kempe"), ("gather", "bars.kempe"))]
        first = [text.partition("\n\n")[0].splitlines()[:2] for text in told]
        self.assertRegex(first[0][0], r"^four-bar: not trustworthy, \d+ of 20 instances complete, \d+ failed$")
        self.assertRegex(first[0][1], r"^  \d+ failed: parameter 'across' is not a number: .* \(first: instance \d+")
        self.assertEqual(first[1:], first[:1] * 2)
        self.assertIn("kempe simulate --from bars.kempe --instance ", told[2])
        self.assertLessEqual(len(told[2].splitlines()), 7)  # the older text and its warning
        self.text(0, *study[:3], "crank=0.28:0.3", *study[4:])

    def test_files(self):
        self.assertIn("kempe check first.yaml\n", self.text(0, "new", "first"))
        done = subprocess.run([KEMPE, "reduce", "tests/models/brick.mtx", *self.BRICK, "-o", self.folder / "brick.npz"], capture_output=True, text=True, cwd=ROOT)
        self.assertEqual(self.faults(done.stdout.replace(str(self.folder), ".")), [])
        self.assertRegex(done.stdout, r"brick\.npz: complete, 9 modes from 0\.38824 to 4\.51536 Hz, mass 24 kg\n")

    def test_faults_are_found(self):
        good = "m: complete, 3 instances\n"
        self.assertEqual(self.faults(good), [])
        for bad in (good + "x" * 101, good + "lanes     16", good + "  0.12345678901 m"):
            self.assertTrue(self.faults(bad), bad)


if __name__ == "__main__":
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
