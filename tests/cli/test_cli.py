#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The command line contract: exit codes, messages, JSON keys, files. Called with the path of the command:

    python3 tests/cli/test_cli.py build/dev/kempe [unittest arguments]
"""
import ast
import bisect
import csv
import functools
import itertools
import json
import math
import os
import pathlib
import pty
import random
import re
import resource
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree
import zipfile
from xml.etree import ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
ANDREWS = ROOT / "examples/andrews/andrews.yaml"
FOUR_BAR = ROOT / "examples/four_bar/four_bar.yaml"
SIX_BAR = ROOT / "examples/stephenson/stephenson.yaml"
SLIDER_CRANK = ROOT / "examples/slider_crank/slider_crank.yaml"
REFERENCE = ROOT / "examples/andrews/reference.csv"
COMMANDS = re.findall(r"^    \{CLI_\w+, \"(\w+)\"", (ROOT / "src/cli/commands.c").read_text(), re.M)
ANGLES = "beta theta gamma Phi delta Omega epsilon".split()
KEMPE = "kempe"  # set by main
# Tests of motions that are long under sanitizers: all, none or only they are run. Unit tests call the same functions there.
LONG_MOTIONS = os.environ.get("KEMPE_LONG_MOTIONS", "all")


def long_motion(test):
    test.is_long = True
    return unittest.skipIf(LONG_MOTIONS == "none", "long under sanitizers")(test)


def kempe(*words, cwd=None):
    return subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, cwd=cwd, timeout=300)


@functools.cache
def shown(example):
    """The command's words on how it understands an example, which all tests share."""
    return kempe("show", "--model", example)


def strict(text):
    """JSON as the standard has it: no NaN, no Infinity, no repeated keys."""

    def refuse(constant):
        raise ValueError(f"{constant} is no JSON")

    def once(pairs):
        keys = [key for key, _ in pairs]
        if len(keys) != len(set(keys)):
            raise ValueError(f"repeated keys in {keys}")
        return dict(pairs)

    return json.loads(text, parse_constant=refuse, object_pairs_hook=once)


TIMED = "cpu_s build_s first_s wall_s memory_bytes equal_error same_integrator best_of_formulation advice".split()


def without_times(value):
    """The object without what differs from run to run: times, and what is chosen by them."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if k not in TIMED}
    return [without_times(v) for v in value] if isinstance(value, list) else value


class Case(unittest.TestCase):
    def setUp(self):
        if LONG_MOTIONS == "only" and not hasattr(getattr(self, self._testMethodName), "is_long"):
            self.skipTest("not a long motion")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def expect(self, code, *words):
        done = kempe(*words, cwd=self.folder)
        self.assertEqual(done.returncode, code, f"kempe {' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
        if code not in (0, 1, 5):
            self.assertEqual(done.stdout, "", "a complaint belongs on stderr")
        if code != 0:
            self.assertNotEqual(done.stderr, "", "a failure needs a sentence")
        return done

    def object(self, code, *words):
        """The object that --json - puts on stdout."""
        done = kempe(*words, "--json", "-", cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stderr)
        return strict(done.stdout)

    def assertKeys(self, value, keys):
        self.assertEqual([key for key in keys.split() if key not in value], [], "keys that the contract promises")

    def model(self, text):
        path = self.folder / "model.yaml"
        path.write_text(text)
        return path


class Terminal(Case):
    """Progress, notes and colour are for terminals; a pipe sees warnings and errors alone."""

    def on_terminal(self, *words, until=None, seconds=300, **environment):
        """Text of stderr when that is a terminal. An interrupt ends the run at the text `until`, or after some seconds."""
        parent, child = pty.openpty()
        variables = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
        end, text = time.monotonic() + seconds, ""
        with subprocess.Popen([KEMPE, *map(str, words)], stdout=subprocess.DEVNULL, stderr=child,
                              env={**variables, "TERM": "xterm", **environment}) as process:
            os.close(child)
            try:
                while part := os.read(parent, 4096) if select.select([parent], [], [], 0.1)[0] else b"-":
                    text += part.decode() if part != b"-" else ""
                    if (until and until in text) or time.monotonic() > end:
                        process.send_signal(signal.SIGINT)
                        until, end = None, math.inf
            except OSError:  # the other end is closed
                pass
            process.wait(timeout=300)
        os.close(parent)
        return text

    @long_motion
    def test_progress_is_one_line(self):
        words = ["simulate", ROOT / "examples/tram/tram.yaml", "--rtol", "1e-11", "--no-convergence-check"]
        text = self.on_terminal(*words, until=" left")
        self.assertRegex(text, r"\r\x1b\[Kt = [0-9.e-]+ of 8 s \([0-9]+ %\), [0-9.e+-]+ s per second, [0-9.e+]+ s left")
        self.assertNotIn("\n", text[:text.index(" left")])
        self.assertIn("\r\x1b[K", text[text.index(" left"):])
        self.assertNotIn("left", self.on_terminal(*words, "--quiet", seconds=2.5))

    def test_colour(self):
        self.assertIn("\x1b[31mkempe: \x1b[0m", self.on_terminal("simulate", "nothing.yaml"))
        for plain in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
            self.assertNotIn("\x1b", self.on_terminal("simulate", "nothing.yaml", **plain))
        self.assertNotIn("\x1b", kempe("simulate", "nothing.yaml").stderr)

    def test_another_relative_tolerance_keeps_the_ratio_of_the_absolute_one(self):
        text = ("kempe: 1\nbodies: {m: {joint: {name: x, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                "run: {t_end: 0.1, atol: 1e-11%s}\n")
        for own, options, atol in (("", [], 1e-11), ("", ["--rtol", 1e-4], 1e-7), (", rtol: 1e-6", ["--rtol", 1e-4], 1e-9),
                                   (", rtol: 1e-6", ["--rtol", 1e-4, "--atol", 1e-3], 1e-3)):
            model = self.model(text % own)
            self.assertAlmostEqual(self.object(0, "simulate", model, *options)["atol"] / atol, 1, places=12)
            many = self.object(0, "ensemble", model, "--sample", "q.x=0:1", "--instances", 2, *options)
            self.assertAlmostEqual(many["atol"] / atol, 1, places=12)

    def test_units_of_options(self):
        run = ["simulate", FOUR_BAR, "--json", "-"]
        plain = kempe(*run, "--t-end", "0.1", "--atol", "0.25").stdout
        united = kempe(*run, "--t-end", "100 ms", "--atol", "0.25 rad").stdout
        self.assertEqual(without_times(strict(plain)), without_times(strict(united)))
        self.assertEqual(kempe("check", FOUR_BAR, "--closure-tolerance", "0.1 mm").returncode, 0)
        refused = kempe("check", FOUR_BAR, "--closure-tolerance", "1 s")
        self.assertEqual(refused.returncode, 3)
        self.assertIn("needs a length in m, 0 or more", refused.stderr)


@unittest.skipIf("KEMPE_SANITIZED" in os.environ, "test_rounding has these functions under sanitizers")
class Rounded(Case):
    """Rounded drawings by every command, beside the exact ones: rows that stay open (Sarrus, to 4 digits: no exact mechanism is
    found near), and numbers that are moved (Bennett, to 6 digits)."""

    COMMANDS = (("simulate", "--no-convergence-check", "--t-end", 0.2), ("simulate", "--no-convergence-check", "--t-end", 0.2, "--formulation", "dae"),
                ("simulate", "--no-convergence-check", "--t-end", 0.2, "--formulation", "dae", "--integrator", "ida"),
                ("simulate", "--no-convergence-check", "--t-end", 0.2, "--formulation", "projected"), ("kinematics", "--sweep", "{u}=0:0.2:5"),
                ("inverse", "--actuators", "{u}"))

    FULL = "KEMPE_FULL" in os.environ  # ./check full; each Sarrus linkage takes most of a second to see that it stays open

    def rows(self, name, u, words):
        path = ROOT / f"tests/models/{name}.yaml"
        self.expect(0, words[0], path, *(str(word).format(u=u) for word in words[1:]), "-o", "rows.csv")
        with open(self.folder / "rows.csv", newline="") as table:
            lines = list(csv.reader(table))
        kept = [k for k, column in enumerate(lines[0]) if column.partition(".")[0] in ("q", "qd", "tau")]
        return [[float(line[k]) for k in kept] for line in lines[1:]]

    def test_tables(self):
        for kind, u, rounding in (("bennett", "b1", 1e-6), ("sarrus", "thigh2", 1e-4)):
            for words in self.COMMANDS if self.FULL or kind == "bennett" else self.COMMANDS[1::2]:
                rounded, exact = (self.rows(f"{name}_{kind}", u, words) for name in ("rounded", "exact"))
                self.assertEqual(len(rounded), len(exact))
                self.assertGreater(len(exact[0]), 3)
                off = max(abs(a - b) for one, two in zip(rounded, exact) for a, b in zip(one, two))
                self.assertLess(off, 20 * rounding, (kind, words))

    def test_the_rest(self):
        for kind, mended in (("bennett", True), ("sarrus", False)):
            path = ROOT / f"tests/models/rounded_{kind}.yaml"
            for word in ("check", "assemble", "linearize", "equilibrium", "modes") if self.FULL or mended else ("check", "linearize"):
                done = self.expect(0, word, path, "--json", "-")
                self.assertEqual(strict(done.stdout)["rounding"]["corrected"], mended)
                self.assertIn("accepted as rounding", done.stderr)

    def test_parameters_that_vary(self):
        """An ensemble and derivatives by parameters start from the state from which a run does."""
        path = self.model((ROOT / "tests/models/rounded_bennett.yaml").read_text().replace(
            "ground:", "parameters: {x: 0.245585, m: 1}\nground:").replace("P1: [0.245585,", "P1: [x,").replace("mass: 1,", "mass: m,", 1))
        (self.folder / "values.csv").write_text("x,m\n0.245585,1\n")
        self.expect(0, "ensemble", path, "--values", "values.csv", "--rtol", 1e-9, "-o", "ends.csv")
        self.expect(0, "simulate", path, "--no-convergence-check", "-o", "run.csv")
        with open(self.folder / "ends.csv", newline="") as ends, open(self.folder / "run.csv", newline="") as run:
            end = list(csv.DictReader(ends))[0]
            last = list(csv.DictReader(run))[-1]
        for name in ("q.b1", "q.b2", "q.b3"):
            self.assertAlmostEqual(float(end[name]), float(last[name]), delta=1e-7)
        self.assertTrue(self.object(0, "sensitivity", path, "--parameters", "m")["rounding"]["corrected"])


class Graphs(Case):
    """The joints that are cut of a graph, and the reasons, in every print of model and check."""

    def test_cuts(self):
        for words, form in ((("check", "--all", SIX_BAR), "joint {joint} (revolute), in the loop {loop}; closure revolute with 5 equations; {reason}"),
                            (("show", "--model", SIX_BAR), "joint {joint} (revolute) is cut: closure revolute, 5 rows, loop {loop}; {reason}")):
            text, cuts = " ".join(self.expect(0, *words).stdout.split()), self.object(0, *words)["cuts"]
            self.assertEqual([cut["joint"] for cut in cuts], ["B", "Q"])
            for cut in cuts:
                self.assertKeys(cut, "joint kind closure rows loop reason start_given")
                self.assertIn(form.format(**cut), text)
        self.assertEqual(self.object(0, "check", FOUR_BAR)["cuts"], [])

    def test_loads_that_are_shared(self):
        """Two hinges on one axis: the weight is 68.67 N, and how they share it is not known."""
        path = self.model("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}\n"
                          "bodies: {b: {mass: 7, com: [0.1, 0, -0.3], inertia: {xx: 0.2, yy: 0.6, zz: 0.5}, "
                          "points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}}\n"
                          "joints: {hL: {revolute: [ground.L, b.L], axis: x}, hR: {revolute: [ground.R, b.R], axis: x}}\n"
                          "run: {t_end: 0.1, outputs: [reaction(hL), reaction(hR)]}\n")
        self.assertIn("loads that are not unique: reaction(hL).x, reaction(hL).y, reaction(hL).z, reaction(hR).x, ",
                      self.expect(0, "simulate", path).stderr)
        self.assertEqual(self.object(0, "check", path)["loads_not_unique"],
                         "hL, hR: x, y, z, my, mz")
        forces = self.object(0, "equilibrium", path)["reaction"]
        self.assertAlmostEqual(forces["hL"][2] + forces["hR"][2], 68.67, delta=1e-9)

    def test_bearings_that_share(self):
        """The same hinges with bearings: text and JSON mark that their loads are not unique; of least norm both have half of the weight."""
        text = ("kempe: 1\ngravity: [0, 0, -10]\nground: {points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}\n"
                "bodies: {b: {mass: 7, com: [0, 0, -0.3], inertia: {xx: 0.2, yy: 0.6, zz: 0.5}, points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}}\n"
                "joints: {hL: {revolute: [ground.L, b.L], axis: x}, hR: {revolute: [ground.R, b.R], axis: x}}\n"
                "bearings: {left: {joint: hL, at: [-10 mm, 10 mm]}, right: {joint: hR, at: [-10 mm, 10 mm]}}\n"
                "run: {t_end: 0.1, outputs: [bearing(left)]}\n")
        path = self.model(text)
        done = self.expect(0, "simulate", path)
        self.assertIn("joint reactions, on the second body, in ground axes: the largest of the motion from 0 to 0.1 s", done.stdout)
        self.assertRegex(done.stdout, r"\n  left 1 \*  .*\n  left 2 \*  .*\n  right 1 \*  .*\n  right 2 \*  ")
        self.assertIn("loads that are not unique: bearing(left)", done.stderr)
        least = self.object(0, "simulate", path, "--loads", "least-norm")
        self.assertEqual([(one["bearings"], one["bearing"], one["unique"]) for one in least["bearings"]],
                         [("left", 1, False), ("left", 2, False), ("right", 1, False), ("right", 2, False)])
        forces = [sum(one["radial"]["components"][2] for one in least["bearings"][k:k + 2]) for k in (0, 2)]
        for force in forces:
            self.assertAlmostEqual(force, 35, delta=1e-9)
        shown = least["outputs"]["bearing(left)"]
        self.assertAlmostEqual(shown[2] + shown[5], 35, delta=1e-9)
        self.assertIn("unknown value of reaction_peaks 'all'; available: rows, motion",
                      self.expect(3, "simulate", path, "--reaction-peaks", "all").stderr)
        path = self.model(text.replace("joint: hR", "joint: hX"))
        self.assertRegex(self.expect(2, "simulate", path).stderr, r"6:\d+: bearings 'right': unknown joint 'hX'; did you mean 'hL'\?")

    def test_start_of_cut_joints(self):
        """The assembly mode is that of the start values, also of a joint that is cut; rates that loops contradict are told."""
        path = self.model(SIX_BAR.read_text().replace("start: {q: {", "start: {q: {B: 1, "))
        self.assertIn("; its start value is part of the guess", " ".join(self.expect(0, "check", path).stdout.split()))
        path = self.model(SIX_BAR.read_text().replace("qd: {", "qd: {B: 1000, "))
        self.assertIn("the rate of the cut joint 'B' is ", self.expect(0, "assemble", path).stderr)
        self.assertIn("unknown coordinate 'Q': the joint is cut (cut: no in the model keeps it)",
                      self.expect(3, "simulate", SIX_BAR, "--independent", "Q").stderr)

    def test_mistakes(self):
        path = self.model(SIX_BAR.read_text().replace("O: {revolute: [ground.O, crank.O]}",
                                                      "O: {revolute: [ground.O, crank.O], cut: yes}"))
        line = path.read_text().split("\n").index("  O: {revolute: [ground.O, crank.O], cut: yes}") + 1
        self.assertIn(f":{line}:43: joint 'O': a cut joint has no coordinate, but the start holds it",
                      self.expect(2, "simulate", path).stderr)


class Settings(Case):
    def parameters(self, *words):
        return self.object(0, "show", "--model", SLIDER_CRANK, *words)["parameters"]

    def test_values(self):
        self.assertEqual(self.parameters("--set", "l=600 mm", "--set=r=l/2")["r"], 0.3)
        self.assertEqual(self.parameters()["l"], 0.5)
        for command in ["check", "assemble", "simulate", "compare", "generate --count", "show --stats", "ensemble --sample r=1:2",
                        "sensitivity"]:
            self.assertIn("no parameter 'll'", self.expect(2, *command.split(), SLIDER_CRANK, "--set", "ll=2").stderr)

    def test_mistakes(self):
        self.assertIn("did you mean 'rod_mass'?", self.expect(2, "check", SLIDER_CRANK, "--set", "rodmass=2").stderr)
        self.assertIn("--set l:1:5: ", self.expect(2, "check", SLIDER_CRANK, "--set", "l=2 * *").stderr)
        for word in "l", "=2", "l=":
            self.expect(3, "check", SLIDER_CRANK, "--set", word)


    UNUSED = ("kempe: 1\nparameters: {a: 1, b: '2*a', c: 3, l: '2*c', m: 1}\n"
              "include: [{file: sub.yaml, prefix: s_, set: {k: m, g: a}}]\n"
              "bodies: {b: {joint: {revolute: z, at: ground}, mass: m, com: [l, 0, 0], inertia: {zz: 1}}}\n"
              "run: {t_end: 0.1}\n")
    SUB = ("kempe: 1\nparameters: {k: 1, g: 2, o: 3}\n"
           "bodies: {d: {joint: {revolute: z, at: ground}, mass: k, com: [1, 0, 0], inertia: {zz: 1}}}\n")

    def test_unused(self):
        """Unused parameters are reported, with their places, in every command and in the results."""
        path = self.model(self.UNUSED)
        (self.folder / "sub.yaml").write_text(self.SUB)

        def warnings(*places):
            return "".join(f"kempe: warning: {self.folder}/{place}\n" for place in places)

        a, b = (f"model.yaml:2:{column}: parameter '{name}' is not used" for name, column in (("a", 14), ("b", 20)))
        g = "model.yaml:3:55: parameter 's_g' is not used: setting it where its file is included has no effect"
        for command in ("check", "assemble", "simulate", "show --model"):
            self.assertEqual(self.expect(0, *command.split(), path).stderr, warnings(a, b, g))
        self.assertIn("  unused parameters       a, b, s_g\n", self.expect(0, "check", path).stdout)
        self.assertIn("unused    parameters without any effect on the model: a, b, s_g\n",
                      self.expect(0, "simulate", path).stdout)
        for command in ("check", "simulate"):
            self.assertEqual(self.object(0, command, path)["unused_parameters"], ["a", "b", "s_g"])
            self.assertEqual(self.object(0, command, FOUR_BAR)["unused_parameters"], [])

    def test_unused_set(self):
        """To set in vain is told; what a setting displaces is no reason to warn of what it used."""
        path = self.model(self.UNUSED)
        (self.folder / "sub.yaml").write_text(self.SUB)
        said = self.expect(0, "check", path, "--set", "b=7", "--set", "l=2", "--set", "s_o=1").stderr
        self.assertIn("model.yaml:2:20: parameter 'b' is not used: setting it has no effect\n", said)
        self.assertIn("sub.yaml:2:26: parameter 's_o' is not used: setting it has no effect\n", said)
        self.assertNotIn("'c'", said)
        said = self.expect(0, "check", path, "--set", "c=7", "--set", "l=2").stderr
        self.assertIn("model.yaml:2:30: parameter 'c' is not used: setting it has no effect\n", said)
        self.assertNotIn("'c'", self.expect(0, "check", path, "--set", "c=7").stderr)

    def test_examples_use_their_parameters(self):
        for path in sorted(ROOT.glob("examples/*/*.yaml")):
            if path.name != "half_tram.yaml":  # a part of others
                self.assertEqual(shown(path).returncode, 0, shown(path).stderr)
                self.assertNotIn("is not used", shown(path).stderr)


class MissingLibrary(unittest.TestCase):
    """A library that is loaded at its first use is named where it is not there."""

    def test_umfpack(self):
        command = pathlib.Path(KEMPE).read_bytes()
        if b"libumfpack." not in command:
            self.skipTest("built without UMFPACK")
        with tempfile.TemporaryDirectory() as folder:
            without = pathlib.Path(folder) / "kempe"
            without.write_bytes(command.replace(b"libumfpack.", b"libabsent_."))
            without.chmod(0o755)
            run = [without, "simulate", FOUR_BAR, "--no-cache", "-q", "--t-end", "0.1", "--formulation", "dae", "--linear"]
            done = subprocess.run([*run, "umfpack"], capture_output=True, text=True, timeout=100)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertRegex(done.stderr, r"linear solver 'umfpack' cannot be loaded: libabsent_\.\S+: .*; install it, or choose klu")
            self.assertEqual(subprocess.run([*run, "klu"], capture_output=True, text=True, timeout=100).returncode, 0)


class Angles(Case):
    """--angle-unit deg: texts and tables in degrees, JSON of results in SI; tables in degrees are read back."""

    CRANK = ROOT / "examples/crank_rocker/crank_rocker.yaml"

    def rows(self, name):
        header, *rest = csv.reader((self.folder / name).read_text().splitlines())
        names, units = zip(*(re.fullmatch(r"(.*?)(?: \[(.*)\])?", column).groups("") for column in header))
        return units, names, rest

    def pair(self, *words):
        """The units of a command's table in degrees, after its numbers were compared with those in rad."""
        found = []
        for unit in "rad", "deg":
            done = kempe(*words, "--angle-unit", unit, "--units", "-o", f"{unit}.csv", cwd=self.folder)
            self.assertIn(done.returncode, (0, 1), done.stderr)
            found.append(self.rows(f"{unit}.csv"))
        (units, names, rows), (units_deg, names_deg, rows_deg) = found
        self.assertEqual((len(units), names), (len(names), names_deg))
        for unit, unit_deg in zip(units, units_deg):
            self.assertEqual(unit_deg, "deg" + unit[3:] if unit.startswith("rad") else unit)
        for row, row_deg in zip(rows, rows_deg, strict=True):
            for name, unit, x, y in zip(names, units, row, row_deg, strict=True):
                try:
                    factor = 180 / math.pi if unit.startswith("rad") else 1
                    self.assertAlmostEqual(float(x) * factor, float(y), delta=1e-14 * abs(float(y)), msg=name)
                except ValueError:
                    self.assertEqual(x, y, name)
        return ",".join(units_deg)

    def test_tables(self):
        short = ("--t-end", "0.1", "--output-step", "0.05", "--no-convergence-check")
        self.assertIn("s,deg,deg,deg,deg/s,", self.pair("simulate", FOUR_BAR, *short))
        self.assertIn("deg/s^2", self.pair("kinematics", FOUR_BAR, "--sweep", "crank=0:1:3"))
        self.assertIn(",deg/[crank]", self.pair("sensitivity", FOUR_BAR, "--parameters", "crank", *short))
        self.assertIn("deg,", self.pair("ensemble", FOUR_BAR, "--sample", "q.crank=0:0.1", "--instances", 2, "--t-end", 0.1))
        self.assertIn("deg/(N m)", self.pair("response", FOUR_BAR, "--inputs", "effort(crank)", "--outputs", "q(crank)",
                                             "--frequencies", "1:2:3"))
        self.pair("modes", FOUR_BAR, "--sweep", "qd.crank=0:1:3", "--at", "start")

    def test_pictures(self):
        """Curves in degrees are those in radians, with other names and numbers of the axes; so are the data of a page."""
        def drawn(words, unit):
            self.expect(0, *words, "--angle-unit", unit, "--svg", f"{unit}.svg", *(("--report", f"{unit}.html") if words[0] == "modes" else ()))
            text = (self.folder / f"{unit}.svg").read_text()
            paths = re.findall(r'<path class="(?:curve|critical)" [^>]*d="([^"]*)"', text)
            return [float(x) for path in paths for x in re.findall(r"-?\d+\.?\d*", path)], text
        governor, manchester = ROOT / "examples/governor/governor.yaml", ROOT / "examples/manchester/manchester_wheelset.yaml"
        for words, rad, deg in ((("modes", governor, "--rates", "shaft=6:8:3"), ["qd.shaft, rad/s<"], ["qd.shaft, deg/s<", " to 458.366 deg/s<"]),
                                (("contact", manchester, "--sweep", "axle.4=0:0.01:3"), ["contact angle, rad<", "axle.4, rad<", "0.01 rad<"],
                                 ["contact angle, deg<", "axle.4, deg<", "0.572958 deg<"]),
                                (("response", FOUR_BAR, "--inputs", "effort(crank)", "--outputs", "q(crank)", "--frequencies", "1:20:40"),
                                 ["SI units<", ", rad / (N m)<"], ["degrees and SI units<", ", deg / (N m)<"])):
            with self.subTest(words[0]):
                (curves, text), (curves_deg, text_deg) = drawn(words, "rad"), drawn(words, "deg")
                self.assertGreater(len(curves), 5)
                self.assertLessEqual(max(abs(x - y) for x, y in zip(curves, curves_deg, strict=True)), 0.11)
                self.assertEqual([label for label in rad if label not in text] + [label for label in deg if label not in text_deg], [])
        for unit, factor in (("rad", 1), ("deg", 180 / math.pi)):
            page = (self.folder / f"{unit}.html").read_text()
            shown = re.findall(r'"unit":"((?:rad|deg)[^"]*)","factor":([\d.]+)', page)
            self.assertEqual({(name, float(size)) for name, size in shown}, {(unit, factor), (f"{unit}/s", factor)})

    def test_text(self):
        for words, pattern in ((("assemble", FOUR_BAR), r"^  crank +\S+ +\S+ +(\S+)"),
                               (("equilibrium", FOUR_BAR), r"^  crank +(\S+)"),
                               (("check", FOUR_BAR, ), r"rocker   oscillates between (\S+) and"),
                               (("simulate", FOUR_BAR, "--t-end", "0.1"), r"^  rocker +\S+ +\S+ +(\S+)"),
                               (("kinematics", FOUR_BAR, "--sweep", "crank=0:1:3"), r"^rocker +\S+ +\S+ +\S+ +(\S+)"),
                               (("sensitivity", FOUR_BAR, "--parameters", "crank", "--t-end", 0.1), r"^  q.rocker +\S+ +(\S+)"),
                               (("response", FOUR_BAR, "--inputs", "effort(crank)", "--outputs", "q(crank)"),
                                r"^  q.crank / effort\(crank\), (?:rad|deg) / \(N m\) +0 +(\S+)")):
            def value(unit):
                text = self.expect(0, *words, "--angle-unit", unit).stdout
                found = re.search(pattern, text, re.M)
                self.assertTrue(found, text)
                return float(next(x for x in found.groups() if x))
            self.assertAlmostEqual(value("deg"), value("rad") * 180 / math.pi, delta=2e-5 * abs(value("deg")), msg=words)
        dead = self.expect(1, "kinematics", self.CRANK, "--sweep", "rocker=90 deg:150 deg:61", "--release", "motor",
                           "--angle-unit", "deg").stdout
        angle = 180 - math.degrees(math.acos((0.32**2 + 0.25**2 - 0.4**2) / (2 * 0.32 * 0.25)))
        self.assertIn(f"dead centre at rocker = {angle:.6g}", dead)
        self.assertIn(f"becomes no smaller than {angle:.6g}", dead)

    def test_json_stays_in_si(self):
        words = ("simulate", FOUR_BAR, "--t-end", "0.1", "--no-convergence-check")
        self.assertEqual(without_times(self.object(0, *words)), without_times(self.object(0, *words, "--angle-unit", "deg")))
        words = ("response", FOUR_BAR, "--inputs", "effort(crank)", "--outputs", "q(crank)", "--frequencies", "1:2:3")
        self.assertEqual(without_times(self.object(0, *words)), without_times(self.object(0, *words, "--angle-unit", "deg")))

    def test_read_back(self):
        """Tables in degrees are a reference, a motion and values as those in rad are."""
        short = ("simulate", FOUR_BAR, "--t-end", "0.1", "--output-step", "0.01", "--no-convergence-check")
        self.expect(0, *short, "--angle-unit", "deg", "-o", "deg.csv")
        error = self.object(0, *short, "--reference", "deg.csv")["error"]
        self.assertLess(max(error["q"], error["qd"]), 1e-12)
        self.expect(0, "kinematics", FOUR_BAR, "--sweep", "crank=0:1:3", "--angle-unit", "deg", "-o", "deg.csv")
        self.expect(0, "kinematics", FOUR_BAR, "--sweep", "crank=0:1:3", "-o", "rad.csv")
        for name in "deg", "rad":
            rows = [line.split(",", 1)[1] for line in (self.folder / f"{name}.csv").read_text().splitlines()]
            (self.folder / f"{name}.csv").write_text("\n".join(rows) + "\n")
        units, names, rest = self.rows("deg.csv")
        self.assertEqual((units[0], units[1], names[1]), ("", "deg", "q.crank"), "SI without a word, degrees with one")
        above = ["# units: " + ",".join(units), ",".join(names), *map(",".join, rest)]
        (self.folder / "above.csv").write_text("\n".join(above) + "\n")
        deg, above, rad = (self.object(0, "inverse", FOUR_BAR, "--actuators", "crank", "--motion", f"{name}.csv")["tau"]["crank"]
                           for name in ("deg", "above", "rad"))
        self.assertEqual(deg, above)
        for a, b in zip(deg, rad, strict=True):
            self.assertAlmostEqual(a, b, delta=1e-11)

    def test_mistakes(self):
        self.assertIn("there are rad and deg", self.expect(3, "simulate", FOUR_BAR, "--angle-unit", "grad").stderr)
        (self.folder / "wrong.csv").write_text("# units: s,m\nt,q.crank\n0,0\n")
        self.assertIn("wrong.csv:2:3: the unit of this column does not fit: rad is expected",
                      self.expect(2, "simulate", FOUR_BAR, "--reference", "wrong.csv").stderr)
        (self.folder / "wrong.csv").write_text("t, q.crank [m]\n0,0\n")
        self.assertIn("wrong.csv:1:4: the unit of this column does not fit: rad is expected",
                      self.expect(2, "simulate", FOUR_BAR, "--reference", "wrong.csv").stderr)
        (self.folder / "wrong.csv").write_text("t,q.crank [turns]\n0,0\n")
        self.assertIn("column 2: unknown unit 'turns'",
                      self.expect(2, "simulate", FOUR_BAR, "--reference", "wrong.csv").stderr)


class Systems(Case):
    """--units mm and us: tables, texts, pictures and pages in these; JSON in SI; what is read back is what was written."""

    CAR = ROOT / "examples/quarter_car/quarter_car.yaml"
    SLIDER = ROOT / "examples/driven_slider_crank/driven_slider_crank.yaml"
    GOVERNOR = ROOT / "examples/governor/governor.yaml"
    INCH, FORCE, POUND = 0.0254, 4.4482216152605, 0.45359237
    # Of each unit of SI that occurs: its name and the number of one in the system.
    SHOWN = {"mm": {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "m/s^2": ("mm/s^2", 1e3), "N m": ("N mm", 1e3), "N/m": ("N/mm", 1e-3),
                    "N": ("N", 1), "J": ("J", 1), "W": ("W", 1)},
             "us": {"m": ("in", 1 / INCH), "m/s": ("in/s", 1 / INCH), "m/s^2": ("in/s^2", 1 / INCH), "N": ("lbf", 1 / FORCE),
                    "N m": ("lbf in", 1 / FORCE / INCH), "N/m": ("lbf/in", INCH / FORCE), "J": ("lbf in", 1 / FORCE / INCH),
                    "W": ("hp", 1 / (550 * 12 * FORCE * INCH))}}

    def table(self, name):
        header, *rows = csv.reader((self.folder / name).read_text().splitlines())
        names, units = zip(*(re.fullmatch(r"(.*?)(?: \[(.*)\])?", column).groups("") for column in header))
        return names, units, rows

    def test_tables(self):
        studies = (("simulate", self.SLIDER, "--t-end", "0.1", "--no-convergence-check"), ("inverse", self.SLIDER, "--t-end", "0.1"),
                   ("kinematics", self.SLIDER, "--sweep", "crank=0:90 deg:5"))
        for words in studies:
            self.expect(0, *words, "--units", "-o", "si.csv")
            names, units, rows = self.table("si.csv")
            for system, shown in self.SHOWN.items():
                with self.subTest(words[0], system=system):
                    self.expect(0, *words, "--units", system, "-o", "other.csv")
                    other_names, other_units, other_rows = self.table("other.csv")
                    self.assertEqual(other_names, names)
                    unknown = [unit for unit in units if unit not in shown and unit not in ("", "s", "rad", "rad/s", "rad/s^2")]
                    self.assertEqual(unknown, [])
                    self.assertEqual([unit for name, unit in zip(names, other_units) if name.startswith("sensor.") and unit != "SI"], [])
                    for column, unit in enumerate(units):
                        name, factor = shown.get(unit, (unit, 1))
                        self.assertIn(other_units[column], (name, "SI") if unit == "" else (name,), names[column])
                        for x, y in zip(rows, other_rows, strict=True):
                            if x[column]:
                                self.assertAlmostEqual(float(x[column]) * factor, float(y[column]), delta=1e-12 * abs(float(y[column])))

    def test_json_stays_in_si(self):
        for words in (("simulate", self.SLIDER, "--t-end", "0.1", "--no-convergence-check"), ("equilibrium", self.GOVERNOR), ("assemble", self.SLIDER)):
            self.assertEqual(without_times(self.object(0, *words)), without_times(self.object(0, *words, "--units", "us")), words[0])

    def test_read_back(self):
        run = ("simulate", self.SLIDER, "--t-end", "0.1", "--output-step", "0.01", "--no-convergence-check")
        for system in "mm", "us":
            self.expect(0, *run, f"--units={system}", "-o", f"{system}.csv")
            error = self.object(0, *run, "--reference", f"{system}.csv")["error"]
            self.assertLess(max(error["q"], error["qd"], error["lambda"]), 1e-11)
        text = (self.folder / "us.csv").read_text()
        (self.folder / "wrong.csv").write_text(text.replace("[in]", "[lbf]"))
        self.assertIn("the unit of this column does not fit: m is expected", self.expect(2, *run, "--reference", "wrong.csv").stderr)

    def test_text(self):
        """The same state, found in the text; a picture of its curve is the same with other numbers at the axis."""
        slide = self.object(0, "simulate", self.SLIDER, "--t-end", "0.1")
        for system in "mm", "us":
            unit, factor = self.SHOWN[system]["m"]
            text = self.expect(0, "simulate", self.SLIDER, "--t-end", "0.1", "--units", system).stdout
            number, found = re.search(r"^  slider +(\S+) .*  (\S+), \S+, \S+$", text, re.M).groups()
            self.assertEqual(found, unit)
            self.assertAlmostEqual(float(number), factor * slide["q"]["slider"], delta=1e-5 * abs(float(number)))
            text = self.expect(0, "inverse", self.SLIDER, "--units", system, "--report", "page.html").stdout
            self.assertRegex(text, rf"(?m)^  crank  {self.SHOWN[system]['N m'][0]} ")
            self.assertIn(f'"{self.SHOWN[system]["N m"][0]}"', (self.folder / "page.html").read_text())
            self.expect(0, "simulate", self.SLIDER, "--t-end", "0.1", "--units", system, "--y", "q(slider)", "--plot", f"{system}.svg")
            self.assertIn(f">{unit}<", (self.folder / f"{system}.svg").read_text())
            self.assertIn(f", {unit}/s", self.expect(0, "assemble", self.SLIDER, "--units", system).stdout)
            text = self.expect(0, "equilibrium", self.GOVERNOR, "--rates", "shaft=60 rpm", "--units", system).stdout
            self.assertRegex(text, rf"(?m)^  slider .*  {unit}, {unit}/s$")
            self.assertRegex(text, rf"(?m)^potential  \S+ {self.SHOWN[system]['J'][0]}$")

    def test_metadata(self):
        """A file of another system has its word, one of SI none."""
        for system in "si", "mm", "us":
            told = system != "si"
            for ending in "json", "npz", "parquet":
                self.expect(0, "simulate", self.SLIDER, "--t-end", "0.01", "--units", system, "-o", f"a.{ending}")
            table = json.loads((self.folder / "a.json").read_text())
            self.assertEqual(table.get("system"), system if told else None)
            self.assertIn({"si": "m/s", "mm": "mm/s", "us": "in/s"}[system], table["units"])
            with zipfile.ZipFile(self.folder / "a.npz") as archive:
                self.assertEqual("system.npy" in archive.namelist(), told)
                if told:
                    self.assertEqual(archive.read("system.npy")[-8:].decode("utf-32-le"), system)
            foot = (self.folder / "a.parquet").read_bytes()
            self.assertEqual(b"system" in foot and system.encode() in foot[foot.index(b"system"):][:12], told)

    def test_check(self):
        """A box of 46.8 kg: m (b^2 + c^2)/12 about its edges."""
        box = self.model("kempe: 1\nbodies: {m: {joint: {name: A, revolute: z, at: ground}, "
                         "shape: {box: [100 mm, 200 mm, 300 mm], at: [50 mm, 0, 0], density: 7800 kg/m^3}}}\n")
        mass, inertia = 46.8, [46.8 * x / 12 for x in (0.2**2 + 0.3**2, 0.1**2 + 0.3**2, 0.1**2 + 0.2**2)]
        for system, units in (("si", ("kg", 1, "m", 1)), ("mm", ("kg", 1, "mm", 1e3)), ("us", ("lb", 1 / self.POUND, "in", 1 / self.INCH))):
            heavy, pounds, long, inches = units
            told = (f"m: {mass * pounds:.6g} {heavy}, centre [{0.05 * inches:.6g}, 0, 0] {long}, inertia "
                    + " ".join(f"{name} {x * pounds * inches**2:.6g}" for name, x in zip(("xx", "yy", "zz"), inertia)) + f" {heavy} {long}^2")
            self.assertIn(told, " ".join(self.expect(0, "check", box, "--units", system).stdout.split()))

    def test_inches_and_pounds(self):
        """The model of the how-to: half of the weight of 3 lb holds the lever, and its pin has the other half."""
        page = (ROOT / "docs/howto.md").read_text()
        lever = self.model(re.search(r"`lever.yaml`:\n\n```yaml\n(.*?)```", page, re.S).group(1))
        text = self.expect(0, "equilibrium", lever, "--hold", "A=0", "--solve-for", "load", "--units", "us").stdout
        self.assertIn("load = 1.5 lbf\n", text)
        self.assertRegex(text, r"force, lbf")
        self.assertRegex(text, r"(?m)^  A\b.* 1\.5 ")

    def test_found_parameters(self):
        """A parameter that is found has the unit of its file; one without a unit is in SI, which a text in other units says."""
        lever = ("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {{F: 10{}}}\n"
                 "bodies: {{m: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1 kg, com: [0.3, 0, 0], points: {{P: [0.5, 0, 0]}}}}}}\n"
                 "forces: {{f: {{at: m.P, force: [0, F, 0]}}}}\n")
        for unit, system, told in ((" N", "si", 9.81 * 0.6), (" N", "us", 9.81 * 0.6 / self.FORCE), ("", "si", 9.81 * 0.6), ("", "us", 9.81 * 0.6)):
            done = self.expect(0, "equilibrium", self.model(lever.format(unit)), "--hold", "A=0", "--solve-for", "F", "--units", system)
            name = {(" N", "si"): " N", (" N", "us"): " lbf", ("", "us"): " SI", ("", "si"): ""}[unit, system]
            self.assertIn(f"found      F = {told:.6g}{name}\n", done.stdout)

    def test_running_safety(self):
        """Loads, wear and the way are in the system: in kN where it has N, and work over a way is a force."""
        bogie = ROOT / "examples/bogie_track/bogie_track.yaml"
        factors = {"mm": (1e-3, "kN", 1e-3, "J/mm", 1e3, "mm"), "us": (1 / self.FORCE, "lbf", 1 / self.FORCE, "lbf", 1 / self.INCH, "in")}
        found = self.object(0, "simulate", bogie, "--t-end", "0.1", "--no-convergence-check")["running_safety"]
        wheel, axle = found["wheels"][0], found["axles"][0]
        for system, (force, force_unit, wear, wear_unit, way, way_unit) in factors.items():
            text = self.expect(0, "simulate", bogie, "--t-end", "0.1", "--no-convergence-check", "--units", system).stdout
            words = " ".join(text.split())
            self.assertIn(f"Q0, {force_unit} (Q0-Q)", words)
            self.assertIn(f"FL {wheel['Q0'] * force:.2f} ", words)
            self.assertIn(f"limit {axle['prudhomme'] * force:.3f} {force_unit}", words)
            self.assertIn(f"T gamma, {wear_unit}: mean", words)
            self.assertIn(f" FL {wheel['wear_mean'] * wear:.4g} {wheel['wear']['value'] * wear:.4g} ", words)
            self.assertIn(f"{found['way'] * way:.6g} {way_unit} travelled", words)

    def test_words(self):
        """--units has a system, or none."""
        self.expect(0, "simulate", "--units", self.SLIDER, "--t-end", "0.01", "-o", "a.csv")
        self.expect(0, "simulate", "--units", "si", self.SLIDER, "--t-end", "0.01", "-o", "b.csv")
        self.assertEqual((self.folder / "a.csv").read_text(), (self.folder / "b.csv").read_text())
        self.assertIn("there are si, mm and us", self.expect(3, "simulate", self.SLIDER, "--units=cgs").stderr)


class Equilibria(Case):
    """Equilibria: the keys of the object, options that go to the library, the message where there is none."""

    GOVERNOR = ROOT / "examples/governor/governor.yaml"
    FALLS = ("kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 1}}\n")

    def test_object(self):
        found = self.object(0, "equilibrium", FOUR_BAR, "--global", "--seed", 2)
        self.assertKeys(found, "model status reason build_s q qd lambda residual stable stability growing neutral left_out "
                               "free reaction potential iterations exchanges history hits count starts others")
        self.assertEqual((found["status"], found["stable"], found["count"]), ("complete", True, 4))
        self.assertEqual(sorted(other["stable"] for other in found["others"]), [False, False, True])
        self.assertEqual(len(found["history"]), found["iterations"])
        self.assertLess(found["residual"], 1e-13)
        again = self.object(0, "equilibrium", FOUR_BAR, "--global", "--seed", 2)
        self.assertEqual([other["q"] for other in found["others"]], [other["q"] for other in again["others"]])

    def test_steady(self):
        done = self.expect(0, "equilibrium", self.GOVERNOR, "--rates", "shaft=5.5")
        self.assertIn("neutral along 'shaft'", done.stdout)
        self.assertIn("excluded   'shaft': nothing depends on it\n", done.stdout)
        found = self.object(0, "equilibrium", self.GOVERNOR, "--rates", "shaft=5", "--hold", "slider=60 cm", "--solve-for", "qd(shaft)")
        self.assertEqual((list(found["free"]), found["left_out"]), (["qd(shaft)"], ["shaft"]))
        self.assertAlmostEqual(found["free"]["qd(shaft)"], found["qd"]["shaft"])
        self.assertAlmostEqual(found["q"]["slider"], 0.6)

    def test_none(self):
        path = self.model(self.FALLS)
        done = self.expect(1, "equilibrium", path)
        self.assertIn("nothing restrains 'S'", done.stderr)
        self.assertIn("gravity -9.81 N", done.stderr)
        self.assertEqual(self.object(1, "equilibrium", path)["status"], "failed")
        self.assertIn("from 100 random starts", self.expect(1, "equilibrium", path, "--global").stderr)
        self.expect(3, "equilibrium", path, "--rates", "T=1")
        self.expect(3, "equilibrium", path, "--rates", "S")
    def test_motions_begin_there(self):
        """The state of `equilibrium` is the first row of a run, of steady motions, too; the JSON says where a run began."""
        for path, words, at in ((FOUR_BAR, (), "equilibrium"), (self.GOVERNOR, ("--rates", "shaft=5.5"), "equilibrium shaft=5.5")):
            found, table = self.object(0, "equilibrium", path, *words), self.folder / "rows.csv"
            run = self.object(0, "simulate", path, "--at", at, "--t-end", 0.2, "-o", table)
            self.assertEqual((run["start_at"], run["start"]["stability"]), (at, found["stability"]))
            first = next(csv.DictReader(table.read_text().splitlines()))
            for name in found["q"]:
                self.assertAlmostEqual(float(first[f"q.{name}"]), found["q"][name], 12)
                self.assertAlmostEqual(float(first[f"qd.{name}"]), found["qd"][name], 12)
        for command in ("assemble", "compare"):
            made = self.object(0, command, FOUR_BAR, "--at", "equilibrium", *(() if command == "assemble" else ("--t-end", 0.1)))
            self.assertEqual((made["start_at"], made["start"]["stability"]), ("equilibrium", "stable"))
        path = self.model("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 20}\nbodies: {rod: {joint: {name: A, revolute: z, at: ground}, "
                          "mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}}\nforces: {s: {joint: A, torque: -k*q(A) + sin(9*t)}}\n"
                          "start: {at: equilibrium}\nrun: {t_end: 0.5, output_step: 0.05, outputs: [q]}\n")
        self.expect(0, "simulate", path, "--set", "k=23", "-o", self.folder / "swing.csv")
        for words in (("sensitivity",), ("optimize", "--minimize", "mean(q(A)^2)", "--parameter", "k:10:30"),
                      ("fit", "swing.csv", "--parameter", "k:10:30", "--columns", "q.A")):
            done = self.expect(0, words[0], path, *words[1:])
            self.assertIn("\n  each run begins at the equilibrium that its own start leads to\n", done.stdout)
        self.assertAlmostEqual(self.object(0, "fit", path, "swing.csv", "--parameter", "k:10:30", "--columns", "q.A")["parameters"]["k"]["value"], 23, 6)
        path = self.model(self.FALLS)
        failed = self.object(1, "simulate", path, "--at", "equilibrium")
        self.assertIn("nothing restrains 'S'", failed["reason"])
        self.assertEqual(self.object(0, "simulate", path, "--at", "start").get("start_at"), None)
        self.assertIn("unknown state 'rest'", self.expect(3, "simulate", path, "--at", "rest").stderr)
        self.assertIn("unknown option '--at'", self.expect(3, "fit", FOUR_BAR, "a.csv", "--at", "equilibrium").stderr)

    def test_what_has_no_place_has_a_speed(self):
        """A shaft with a motor goes on steadily: found without being asked for, by its name and with a sentence."""
        path = self.model("""kempe: 1
gravity: [0, 0, -9.81]
bodies:
  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0]}}
  b: {joint: {revolute: y, at: a.P}, mass: 1, com: [0, 0, -0.5], inertia: {yy: 0.1}}
parameters: {drag: 0.5}
forces: {motor: {joint: a, torque: "3 - drag*qd(a)"}}
""")
        text = self.expect(0, "equilibrium", path).stdout
        self.assertIn("found      qd(a) = 6 rad/s\n\nsteady     'a' at 6 rad/s\n           at constant speed: no force", text)
        for words in ((), ("--global",), ("--rates", "a=5", "--solve-for", "qd(a)")):
            found = self.object(0, "equilibrium", path, *words)
            self.assertAlmostEqual(found["qd"]["a"], 6, 9)
            self.assertAlmostEqual(found["free"]["qd(a)"], 6, 9)
        modes = self.object(0, "modes", path)
        self.assertEqual(modes["modes"], self.object(0, "modes", path, "--at", "equilibrium a=6")["modes"])
        varied = self.object(0, "modes", path, "--sweep", "drag=0.5:0.6:3")
        self.assertEqual(varied["status"], "complete")
        stopped = self.expect(1, "equilibrium", path, "--set", "drag=0").stderr
        self.assertIn("nothing restrains 'a'", stopped)
        path = self.model(path.read_text().replace("- drag", "+ drag*exp(-qd(a)) - 1e-9"))
        self.assertIn("and no steady motion is found from the start with the rates of a unknown", self.expect(1, "equilibrium", path).stderr)
        falls = self.model("kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                           "  a: {joint: {prismatic: z, at: ground}, mass: 1}\n")
        self.assertNotIn("steadily", self.expect(1, "equilibrium", falls).stderr)


class Fits(Case):
    """Parameters from measured motions: tables, a restart, a page, mistakes."""

    CRANK = ROOT / "tests/models/measured_crank.yaml"
    WORDS = ("motion.csv", "--columns", "q.crank,q.slider", "--parameter", "slider_mass:0.5:20", "--parameter", "guide:0:")

    def setUp(self):
        super().setUp()
        self.expect(0, "simulate", self.CRANK, "--t-end", 1, "--no-convergence-check", "-o", "motion.csv")

    def estimates(self, *words, code=0):
        done = self.expect(code, "fit", self.CRANK, *self.WORDS, *words, "-o", "found.csv")
        with open(self.folder / "found.csv", newline="") as file:
            return done, {row["parameter"]: row for row in csv.DictReader(file)}

    def test_estimates(self):
        far = "--set", "slider_mass=6", "--set", "guide=0.2"
        done, rows = self.estimates(*far, "--report", "fit.html", "--plot", "fit.svg")
        self.assertIn("complete, fit of slider_mass and guide to 102 measurements", done.stdout)
        self.assertEqual((rows["slider_mass"]["start"], rows["guide"]["lower"], rows["guide"]["upper"]), ("6", "0", ""))
        self.assertAlmostEqual(float(rows["slider_mass"]["value"]), 3, delta=1e-5)
        self.assertAlmostEqual(float(rows["guide"]["value"]), 1.5, delta=1e-5)
        self.assertIn("q.slider.measured", (self.folder / "fit.html").read_text())
        picture = (self.folder / "fit.svg").read_text()
        self.assertIn("q.crank", picture)
        # A point for each measurement, one for each residual, and four in the legend; a curve for each column and one there.
        self.assertEqual((picture.count("<circle"), picture.count('class="curve"')), (2 * 102 + 4, 4))
        found = self.object(0, "fit", self.CRANK, *self.WORDS, *far)
        self.assertEqual((found["rank"], found["search"], found["measurements"]), (2, "converged", 102))
        self.assertEqual(list(found["columns"]), ["q.crank", "q.slider"])
        self.assertEqual(without_times(found), without_times(self.object(0, "fit", self.CRANK, *self.WORDS, *far)))
        # Several searches have the same result by any number of threads.
        bounded = ("--parameter", "slider_mass:0.5:20,guide:0:4", "--set", "slider_mass=6", "--starts", 5)
        many = [self.object(0, "fit", self.CRANK, *self.WORDS[:3], *bounded, "--threads", count) for count in (1, 2, 3, "auto")]
        for one in many:
            self.assertEqual((one["searches"], without_times(one)), (5, without_times(many[0])))
        # The result is the start of another search, which ends at once.
        again = self.object(0, "fit", self.CRANK, *self.WORDS, *far, "--start", "found.csv")
        self.assertLess(again["runs"], found["runs"])
        self.assertEqual(again["parameters"]["guide"]["start"], float(rows["guide"]["value"]))

    def test_several_files(self):
        self.expect(0, "simulate", self.CRANK, "--set", "guide=3", "--t-end", 0.5, "--no-convergence-check", "-o", "other.csv")
        words = "motion.csv", "other.csv", "--columns", "q.crank,q.slider", "--parameter", "slider_mass:0.5:20,guide@1:0:"
        found = self.object(0, "fit", self.CRANK, *words, "--own", "guide@2=3", "--set", "slider_mass=6")
        self.assertEqual([(file["file"], file["rows"], file["measurements"]) for file in found["files"]],
                         [("motion.csv", 51, 102), ("other.csv", 26, 52)])
        for name, value in ("slider_mass", 3), ("guide@1", 1.5):
            self.assertAlmostEqual(found["parameters"][name]["value"], value, delta=1e-5)
        done = self.expect(0, "fit", self.CRANK, *words, "--own", "guide@2=3", "--report", "fit.html", "--plot", "fit.svg")
        self.assertIn("other.csv: 26 rows, 2 columns, 52 measurements, values of its own", done.stdout)
        self.assertIn("data file 1 of 2", (self.folder / "fit.html").read_text())
        self.assertIn("guide@2=3", self.expect(3, "fit", self.CRANK, *words[:-1], "guide", "--own", "guide@2=3").stderr)

    def test_most_runs(self):
        far = "--set", "slider_mass=6", "--set", "guide=0.2", "--most", 3
        done, _ = self.estimates(*far, code=5)
        self.assertIn("the search has not converged after 3 runs", done.stderr)

    def test_mistakes(self):
        (self.folder / "bad.csv").write_text("t,q.crank,q.wheel,q.slider [N]\n0,1,2,3\n")
        (self.folder / "units.csv").write_text("t,q.crank [N],q.slider\n0,1,2\n1,x,3\n")
        (self.folder / "cells.csv").write_text("t,q.crank,q.slider\n0,1,2\n1,x,3\n0.5,1,2\n")
        for code, words, told in [
                (3, ("motion.csv",), "needs --parameter"), (3, (), "the data is missing"),
                (2, ("motion.csv", "other.csv", "--parameter", "guide"), "cannot read 'other.csv'"),
                (3, ("motion.csv", "--parameter", "guid"), "did you mean 'guide'"),
                (3, ("motion.csv", "--parameter", "guide:2:1"), "the bound 2 is not below 1"),
                (3, ("motion.csv", "--parameter", "guide:1"), "two bounds are expected"),
                (3, ("motion.csv", "--parameter", "guide:2:3"), "its start 1.5 is not between its bounds 2 and 3"),
                (3, ("motion.csv", "--parameter", "guide", "--columns", "q.wheel"), "has no column 'q.wheel'"),
                (3, ("motion.csv", "--parameter", "guide", "--columns", "q.crank", "--deviations", "q.slider=1"),
                 "COLUMN=VALUE with a column of the data"),
                (3, ("motion.csv", "--parameter", "guide", "--columns", "q.crank", "--confidence", "2"), "confidence 2"),
                (2, ("none.csv", "--parameter", "guide"), "none.csv"),
                (2, ("bad.csv", "--parameter", "guide"), "bad.csv:1:11: 'q.wheel' is not an output of the model"),
                (2, ("units.csv", "--parameter", "guide"), "units.csv:1:3"),
                (2, ("cells.csv", "--parameter", "guide"), "cells.csv:4:1: times must increase"),
                (2, ("motion.csv", "--parameter", "guide", "--start", "motion.csv"), "motion.csv:1:1: columns 'parameter'")]:
            self.assertIn(told, self.expect(code, "fit", self.CRANK, *words).stderr)


class Optima(Case):
    """Best parameters: tables, a restart, a page, mistakes."""

    CURVE = ROOT / "tests/models/coupler_curve.yaml"
    WORDS = ("--minimize", "miss", "--parameter", "crank:0.5:1.5,coupler:1.5:4,rocker:1.5:4", "--parameter",
             "base:1.2:3,along:2:7,across:-1:1")

    def test_result(self):
        done = self.expect(0, "optimize", self.CURVE, *self.WORDS, "-o", "found.csv", "--report", "optimum.html", "--plot", "course.svg")
        self.assertIn("exact derivatives (SLSQP)", done.stdout)
        with open(self.folder / "found.csv", newline="") as file:
            rows = {row["parameter"]: row for row in csv.DictReader(file)}
        self.assertAlmostEqual(float(rows["along"]["value"]), 5, delta=1e-6)
        self.assertIn("position.coupler.P.x", (self.folder / "optimum.html").read_text())
        self.assertIn("<svg", (self.folder / "course.svg").read_text())
        found = self.object(0, "optimize", self.CURVE, *self.WORDS)
        self.assertEqual((found["method"], found["search"], found["goal"]), ("slopes", "converged", "minimize"))
        self.assertGreater(found["shortened"], 0)
        self.assertIn("a hundredfold tolerance changes miss by", done.stdout)
        self.assertTrue(1e-12 < found["difference"] < 1e-7)
        self.assertEqual(without_times(found), without_times(self.object(0, "optimize", self.CURVE, *self.WORDS)))
        again = self.object(0, "optimize", self.CURVE, *self.WORDS, "--start", "found.csv")
        self.assertLess(again["evaluations"], found["evaluations"])
        limited = self.object(5, "optimize", self.CURVE, *self.WORDS, "--limit", "max(position(coupler.P).y) < 3.9", "--starts", 2,
                              "--method", "values", "--most", 60)
        self.assertEqual((limited["method"], len(limited["searches"]), limited["limits"][0]["bound"]), ("values", 2, 3.9))

    def test_mistakes(self):
        for code, words, told in [
                (3, ("--parameter", "base:1:2"), "either --minimize QUANTITY or --maximize QUANTITY"),
                (3, ("--minimize", "miss"), "optimize needs --parameter"),
                (3, ("--minimize", "miss", "--maximize", "miss", "--parameter", "base:1:2"), "either --minimize"),
                (3, ("--minimize", "miss", "--parameter", "base"), "parameter 'base' needs two bounds"),
                (3, ("--minimize", "miss", "--parameter", "bass:1:2"), "did you mean 'base'"),
                (3, ("--minimize", "miss", "--parameter", "base:1:2"), "its start 2.2 is not between its bounds"),
                (2, ("--minimize", "max(", "--parameter", "base:1:3"), "quantity:1"),
                (3, ("--minimize", "at(miss, 7)", "--parameter", "base:1:3"), "after the end of the run"),
                (3, ("--minimize", "range(miss)", "--parameter", "base:1:3", "--method", "slopes"), "'range(miss)' has no exact derivative"),
                (3, ("--minimize", "miss", "--parameter", "base:1:3", "--method", "newton"), "available: slopes, values"),
                (1, ("--minimize", "miss", "--parameter", "base:1:9", "--set", "base=8"), "the start gives no value")]:
            self.assertIn(told, self.expect(code, "optimize", self.CURVE, *words).stderr)


class Sensitivities(Case):
    """Derivatives by parameters: tables of both methods, against runs with other values; mistakes."""

    WORDS = (FOUR_BAR, "--parameters", "crank,qd.crank", "--outputs", "q(rocker),position(coupler.C).x", "--t-end", 0.2)

    def rows(self, *words):
        done = self.expect(0, "sensitivity", *self.WORDS, *words, "-o", "slopes.csv")
        with open(self.folder / "slopes.csv", newline="") as file:
            return done, [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]

    def test_long_steps(self):
        """A driven cam prescribes the lift L(speed t) of its valve while they touch, which changes with the speed by L' t; no step passes the flights of the valve."""
        model, speed = ROOT / "examples/valve_train/valve_train.yaml", 2600 * math.pi / 30
        self.expect(0, "simulate", model, "--t-end", "0.1", "-o", "run.csv")
        run = list(csv.DictReader((self.folder / "run.csv").read_text().splitlines()))
        for more in (), ("--integrator", "dop853"), ("--rtol", "1e-10"), ("--integrator", "dopri5", "--rtol", "1e-4"):
            self.expect(0, "sensitivity", model, "--parameters", "speed", "--t-end", "0.1", "--no-convergence-check", *more, "-o", "slopes.csv")
            touching = 0
            for row, same in zip(csv.DictReader((self.folder / "slopes.csv").read_text().splitlines()), run, strict=True):
                self.assertAlmostEqual(float(row["q.lift"]), float(same["q.lift"]), delta=1e-7, msg=(more, row["t"]))
                if float(row["force.cam"] or 0) > 0:
                    touching += 1
                    self.assertAlmostEqual(float(row["q.lift/speed"]), float(row["qd.lift"]) * float(row["t"]) / speed, delta=1e-9)
            self.assertGreater(touching, 200)
        adjoint = self.object(0, "sensitivity", model, "--parameters", "speed", "--t-end", "0.1", "--no-convergence-check", "--method", "adjoint", "--outputs", "q(lift)")
        self.assertEqual(adjoint["status"], "complete, not checked")
        # Events do not depend on the way of a carriage, or the angle of a worm, which may be long.
        carried = self.model("kempe: 1\nparameters: {k: 4}\nbodies:\n  carriage: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                             "  ball: {joint: {name: y, prismatic: y, at: carriage}, mass: 1}\n"
                             "forces: {spring: {joint: y, force: '-k*q(y) - max(0, q(y))'}}\ndrives: {way: {joint: x, displacement: 1000*t}}\n"
                             "start: {q: {y: 0.5}}\nrun: {t_end: 10, rtol: 1e-6}\n")
        for far, parameter in (carried, "k"), (ROOT / "examples/crane/crane.yaml", "r"):
            self.assertLess(self.object(0, "sensitivity", far, "--parameters", parameter, "--no-convergence-check")["work"]["steps"], 200)
        # A driven four-bar linkage keeps its position and its turns.
        driven = self.model("kempe: 1\nparameters: {a: 0.3}\nground: {points: {D: [1, 0, 0]}}\nbodies:\n"
                            "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [a, 0, 0]}}\n"
                            "  coupler: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.05}, points: {C: [0.95, 0, 0]}}\n"
                            "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.02}, points: {C: [0.8, 0, 0]}}\n"
                            "loops: {C: {revolute: [coupler.C, rocker.C], axis: z}}\ndrives: {m: {joint: A, angle: 30*t}}\n"
                            "start: {q: {B: 45 deg, D: 90 deg}}\nrun: {t_end: 3, outputs: [q]}\n")
        self.expect(0, "simulate", driven, "-o", "run.csv")
        run = list(csv.DictReader((self.folder / "run.csv").read_text().splitlines()))
        for integrator in "radau", "dop853":
            self.expect(0, "sensitivity", driven, "--parameters", "a", "--integrator", integrator, "-o", "slopes.csv")
            for row, same in zip(csv.DictReader((self.folder / "slopes.csv").read_text().splitlines()), run, strict=True):
                for name in "q.B", "q.D":
                    self.assertAlmostEqual(float(row[name]), float(same[name]), delta=1e-9)

    def test_rows(self):
        done, rows = self.rows("--output-step", 0.1)
        self.assertIn("complete, derivatives of the motion with respect to crank and qd.crank, 0 to 0.2 s", done.stdout)
        self.assertEqual([row["t"] for row in rows], [0, 0.1, 0.2])
        self.assertEqual(list(rows[0]), "t q.rocker q.rocker/crank q.rocker/qd.crank position.coupler.C.x "
                                        "position.coupler.C.x/crank position.coupler.C.x/qd.crank".split())
        ends = []
        for value in 0.3 - 1e-4, 0.3 + 1e-4:
            self.expect(0, "simulate", FOUR_BAR, "--t-end", 0.2, "--set", f"crank={value}", "--no-convergence-check", "-o", "one.csv")
            with open(self.folder / "one.csv", newline="") as file:
                ends.append(float(list(csv.DictReader(file))[-1]["q.rocker"]))
        self.assertAlmostEqual(rows[2]["q.rocker/crank"], (ends[1] - ends[0]) / 2e-4, delta=1e-5)

    def test_adjoint(self):
        words = ("sensitivity", *self.WORDS)
        forward, adjoint = self.object(0, *words), self.object(0, *words, "--method=adjoint")
        self.assertKeys(forward, "model status reason build_s of method integrator t_end rtol atol work cpu_s parameters "
                                 "rows end")
        self.assertEqual((forward["method"], adjoint["method"], adjoint["rows"]), ("forward", "adjoint", 1))
        self.assertEqual(forward["parameters"], {"crank": 0.3, "qd.crank": 20})
        for column, by in forward["end"]["derivatives"].items():
            for name, slope in by.items():
                self.assertAlmostEqual(adjoint["end"]["derivatives"][column][name], slope, delta=1e-7)
        self.assertEqual(without_times(forward), without_times(self.object(0, *words)))

    def test_states(self):
        for of, at, column in (("equilibrium", "equilibrium", "q.rocker"), ("reactions", "start", "reaction.C.x"),
                               ("modes", "equilibrium", "mode.1.frequency")):
            words = ("sensitivity", FOUR_BAR, "--of", of, "--at", at, "--parameters", "crank,base")
            found = self.object(0, *words)
            self.assertEqual((found["of"], found["rows"], found["reason"]), (of, 1, ""))
            slope = found["end"]["derivatives"][column]["base"]
            ends = [self.object(0, *words, "--set", f"base={0.9 + step}")["end"]["values"][column]
                    for step in (-1e-4, 1e-4)]
            self.assertAlmostEqual((ends[1] - ends[0]) / 2e-4, slope, delta=1e-5 * max(abs(slope), 1))
            self.assertIn(column, self.expect(0, *words).stdout)

    def test_mistakes(self):
        for words, told in ((("--parameters", "crnk"), "did you mean 'crank'?"), (("--of", "colour"), "available: trajectory"),
                            (("--method", "back"), "available: forward, adjoint"), (("--outputs", "q(A)"), "q"),
                            (("--integrator", "bdf"), "does not support sensitivities"), (("--independent", "A"), "unknown coordinate 'A'")):
            self.assertIn(told, self.expect(3, "sensitivity", FOUR_BAR, *words).stderr)
        for words, told in ((("--of", "modes", "--at", "end"), "unknown state 'end'"),
                            (("--of", "equilibrium", "--at", "start"), "not an equilibrium"),
                            (("--of", "modes", "--outputs", "q"), "outputs cannot be chosen")):
            self.assertIn(told, self.expect(3, "sensitivity", FOUR_BAR, *words).stderr)
        self.assertIn("no parameter is given for the derivatives", self.expect(3, "sensitivity", ANDREWS).stderr)

    def test_places_without_restraint(self):
        """The place of a rotor in balance follows from the start: with a start that depends on a parameter its derivative is named."""
        rotor = self.model("kempe: 1\nparameters: {a: 0.3, m: 2}\nbodies:\n"
                           "  wheel: {joint: {name: W, revolute: z, at: ground}, mass: m, inertia: {zz: 0.1}}\n"
                           "  arm: {joint: {name: A, revolute: z, at: ground}, mass: m, com: [0.2, 0, 0], inertia: {zz: 0.1}}\n"
                           "forces: {k: {joint: A, torque: 20*(a - q(A))}}\nstart: {q: {W: a}}\n")
        words = ("sensitivity", rotor, "--of", "equilibrium", "--parameters")
        self.assertIn("no force restrains 'W' at the equilibrium", self.expect(0, *words, "a").stderr)
        self.assertEqual(self.expect(0, *words, "m").stderr, "")
        found = self.object(0, *words, "a")["end"]["derivatives"]
        self.assertEqual((found["q.W"]["a"], round(found["q.A"]["a"], 12)), (0, 1))


class Kinematics(Case):
    def test_extremes_of_outputs(self):
        """The rows with the least and the greatest value of an output: x of a crank of 0.5 m over a turn."""
        path = self.model("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [0.5, 0, 0]}}}\n"
                          "sensors: {far: position(a.P).x}\nrun: {outputs: [position(a.P), far]}\n")
        text = self.expect(0, "kinematics", path, "--sweep", "a=0 deg:270 deg:271", "--angle-unit", "deg", "--units", "mm").stdout
        self.assertRegex(text, r"(?m)^output +unit +least +at a, deg +greatest +at a, deg$")
        self.assertRegex(text, r"(?m)^position.a.P.x +mm +-500 +180 +500 +0$")
        self.assertRegex(text, r"(?m)^position.a.P.y +mm +-500 +270 +500 +90$")
        self.assertRegex(text, r"(?m)^position.a.P.z +mm +0 +0 +0 +0$")
        self.assertRegex(text, r"(?m)^sensor.far +SI +-0.5 +180 +0.5 +0$")

    """Coordinates led through a range: table, picture, dead centres, mistakes."""

    MODEL = ROOT / "examples/crank_rocker/crank_rocker.yaml"

    def test_turn(self):
        done = self.expect(0, "kinematics", self.MODEL, "--sweep", "motor=0:720 deg:9", "--speed", 2, "-o", "turn.csv")
        self.assertIn("crank-rocker: complete, 9 of 9 rows", done.stdout)
        self.assertIn("omitted, because they need forces: lambda(motor)", done.stdout)
        lines = (self.folder / "turn.csv").read_text().split("\n")
        self.assertTrue(lines[0].startswith("s,t,q.crank,q.coupler,q.rocker,qd.crank,"), lines[0])
        rows = list(csv.DictReader(lines))
        self.assertEqual(len(rows), 9)
        self.assertAlmostEqual(float(rows[8]["q.crank"]), 4 * math.pi, delta=1e-15)
        self.assertAlmostEqual(float(rows[8]["t"]), 2 * math.pi, delta=1e-14)
        self.assertAlmostEqual(float(rows[8]["q.rocker"]), float(rows[0]["q.rocker"]), delta=1e-14)
        self.assertEqual([float(row["qd.crank"]) for row in rows], [2] * 9)
        self.assertIn("velocity.coupler.P.y", rows[0])

    def test_forces_are_omitted_where_they_are_asked_for(self):
        """A model that names no outputs has lambda among its own, which nobody has asked for."""
        model = ("kempe: 1\nbodies:\n  a: {joint: {name: A, prismatic: x, at: ground}, mass: 1}\n  b: {joint: {name: B, prismatic: y, at: ground}, mass: 1}\n"
                 "loops: {c: {constraint: q(A) - q(B)}}\nrun: {%s}\n")
        for outputs, left_out in (("t_end: 1", []), ("t_end: 1, outputs: [q, lambda]", ["lambda"])):
            path = self.model(model % outputs)
            self.assertEqual("omitted, because" in self.expect(0, "kinematics", path, "--sweep", "A=0:1:3").stdout, bool(left_out))
            self.assertEqual(self.object(0, "kinematics", path, "--sweep", "A=0:1:3")["left_out"], left_out)

    def test_dead_centres(self):
        result = self.object(1, "kinematics", self.MODEL, "--sweep", "rocker=90 deg:150 deg:61",
                             "--release", "motor", "--svg", "half.svg", "-o", "half.csv")
        self.assertKeys(result, "model status reason build_s driven elastic speed released rows rows_asked coordinates outputs "
                                "dead_centres change_points left_out work")
        self.assertEqual((result["status"], result["released"], result["rows_asked"]), ("stopped", ["motor"], 61))
        low, high = result["dead_centres"]
        self.assertKeys(low, "s coordinate value extreme determined margin instead q")
        for dead, extreme, length in ((low, "least", 0.4), (high, "greatest", 0.2)):
            angle = math.pi - math.acos((0.32**2 + 0.25**2 - length**2) / (2 * 0.32 * 0.25))
            self.assertAlmostEqual(dead["value"], angle, delta=4e-15)
            self.assertEqual(dead["extreme"], extreme)
        self.assertEqual((low["instead"], result["coordinates"]["crank"]["least"] < -1), ("coupler, crank", True))
        svg = (self.folder / "half.svg").read_text()
        self.assertEqual([svg.count(f'<path class="{name}"') for name in ("curve", "cross")], [6, 6])
        again = self.object(1, "kinematics", self.MODEL, "--sweep", "rocker=90 deg:150 deg:61",
                            "--release", "motor", "--svg", "again.svg", "-o", "again.csv")
        self.assertEqual(without_times(result), without_times(again))
        for name in "svg", "csv":
            self.assertEqual((self.folder / f"half.{name}").read_bytes(), (self.folder / f"again.{name}").read_bytes())

    def test_time(self):
        self.expect(0, "kinematics", self.MODEL, "--sweep", "t=0.5:2:4", "-o", "t.csv")
        with open(self.folder / "t.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        with open(ROOT / "examples/crank_rocker/reference.csv", newline="") as file:
            wanted = {row["t"]: row for row in csv.DictReader(line for line in file if line[0] != "#")}
        self.assertEqual([row["t"] for row in rows], ["0.5", "1", "1.5", "2"])
        for row in rows:
            for name in "q.coupler q.rocker qd.coupler qd.rocker".split():
                self.assertAlmostEqual(float(row[name]), float(wanted[row["t"]][name]), delta=1e-14)

    def test_speed(self):
        for speed, taken in (("2", 2), ("90 deg/s", math.pi / 2), ("30 rpm", math.pi), ("0.5 rev/s", math.pi)):
            self.assertAlmostEqual(self.object(0, "kinematics", FOUR_BAR, "--sweep", "crank=0:1:3", "--speed", speed)["speed"], taken, 14)
        model = self.model(SLIDER_CRANK.read_text().replace("q: {crank: 0,", "q: {crank: 0.5,"))
        slide = model, "--sweep", "slider=-0.05:-0.1:3"
        for speed, taken in (("5 mm/s", 0.005), ("0.3", 0.3)):
            self.assertAlmostEqual(self.object(0, "kinematics", *slide, "--speed", speed)["speed"], taken, 14)
        self.assertIn("speed: 'crank': m/s is given, but rad/s, deg/s or rpm is expected",
                      self.expect(3, "kinematics", FOUR_BAR, "--sweep", "crank=0:1:3", "--speed", "5 mm/s").stderr)
        self.assertIn("speed: 'slider': 1/s is given, but m/s is expected", self.expect(3, "kinematics", *slide, "--speed", "2 rpm").stderr)
        for speed in "0", "-2", "-1 mm/s", "1:2", "1,a=2":
            self.assertIn("speed: one positive value is expected",
                          self.expect(3, "kinematics", *slide, f"--speed={speed}").stderr)
        self.assertIn("unknown unit 'm/hs'", self.expect(3, "kinematics", *slide, "--speed", "3 m/hs").stderr)

    def test_mistakes(self):
        self.assertIn("--sweep NAME=A:B", self.expect(3, "kinematics", FOUR_BAR).stderr)
        self.assertIn("did you mean 'crank'?", self.expect(3, "kinematics", FOUR_BAR, "--sweep", "crnk=0:1").stderr)
        self.assertIn("no position outputs",
                      self.expect(1, "kinematics", FOUR_BAR, "--sweep", "crank=0:1", "--svg", "none.svg").stderr)
        self.assertFalse((self.folder / "none.svg").exists())
        failed = self.object(1, "kinematics", FOUR_BAR, "--sweep", "rocker=2:3")
        self.assertEqual((failed["status"], failed["rows"], len(failed["dead_centres"])), ("failed", 0, 1))
        self.assertIn("'rocker' becomes no larger than", failed["reason"])
        none = self.object(1, "kinematics", FOUR_BAR, "--sweep", "t=0:1")
        self.assertIn("sweep or hold 1 more", none["reason"])


class Contact(Case):
    """Wheels on rails over a shift: table, picture, what follows, mistakes."""

    MODEL = ROOT / "examples/manchester/manchester.yaml"
    WHEELSET = ROOT / "examples/manchester/manchester_wheelset.yaml"
    RANGE = ("--sweep", "shift=0:10 mm:5", "--law", "fastsim")

    def test_table(self):
        result = self.object(0, "contact", self.MODEL, *self.RANGE, "-o", "c.csv", "--svg", "c.svg")
        self.assertKeys(result, "model status reason build_s over unit law residual iterations cpu_s rows")
        self.assertEqual((result["status"], result["over"], result["law"], len(result["rows"])), ("complete", "shift", "fastsim", 5))
        last = result["rows"][-1]
        self.assertKeys(last, "value q qd wheels")
        touching = [patch for patch in last["wheels"]["R"] if patch["touches"]]
        self.assertEqual(len(touching), 1)
        self.assertKeys(touching[0], "touches s y angle radius normal slip spin force moment a b by_law")
        self.assertAlmostEqual(touching[0]["y"], 0.721088, delta=1e-5)
        with open(self.folder / "c.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        patches = [(row["value"], wheel, patch) for row in result["rows"] for wheel in "LR" for patch in row["wheels"][wheel]]
        self.assertEqual(len(rows), len(patches))
        for row, (value, wheel, patch) in zip(rows, patches):
            self.assertEqual((float(row["shift"]), row["wheel"], float(row["normal"])), (value, wheel, patch["normal"]))
        picture = ElementTree.parse(self.folder / "c.svg").getroot()
        drawn = [path.get("class") for path in picture.iter("{http://www.w3.org/2000/svg}path")]
        self.assertEqual((drawn.count("wheel"), drawn.count("rail")), (2, 2))
        self.assertEqual(drawn.count("join"), sum(patch["touches"] for _, _, patch in patches))
        again = self.object(0, "contact", self.MODEL, *self.RANGE, "-o", "again.csv", "--svg", "again.svg")
        self.assertEqual(without_times(result), without_times(again))
        for ending in "svg", "csv":
            self.assertEqual((self.folder / f"c.{ending}").read_bytes(), (self.folder / f"again.{ending}").read_bytes())

    def test_what_follows(self):
        """Both wheels carry the load, nothing drives the axle, and left is right the other way round."""
        rows = {}
        for way in "", "-":
            result = self.object(0, "contact", self.WHEELSET, "--sweep", f"axle.3=0:{way}6 mm:4", "--hold", "axle.4")
            rows[way] = result["rows"]
        for here, there in zip(rows[""], rows["-"]):
            self.assertAlmostEqual(here["q"]["axle.1"], there["q"]["axle.1"], delta=1e-12)
            self.assertAlmostEqual(here["q"]["axle.5"], -there["q"]["axle.5"], delta=1e-12)
            self.assertAlmostEqual(here["qd"]["axle.6"], there["qd"]["axle.6"], delta=1e-9)
            forces = [patch for wheel in "LR" for patch in here["wheels"][wheel] if patch["touches"]]
            drive = sum(patch["force"][0] * patch["radius"] for patch in forces)
            self.assertLess(abs(drive), 1e-3 * sum(abs(patch["force"][0]) * patch["radius"] for patch in forces) + 1e-6)
        self.assertNotEqual(rows[""][0]["qd"]["axle.6"], rows[""][-1]["qd"]["axle.6"])

    def test_mistakes(self):
        self.assertIn("--sweep NAME=A:B:N", self.expect(3, "contact", self.MODEL).stderr)
        self.assertIn("did you mean 'left.1'", self.expect(3, "contact", self.MODEL, "--sweep", "lft.1=0:1").stderr)
        self.assertIn("no wheels", self.expect(3, "contact", FOUR_BAR, "--sweep", "crank=0:1").stderr)
        self.assertIn("unknown creep law", self.expect(3, "contact", self.MODEL, *self.RANGE[:2], "--law", "dry").stderr)
        off = self.object(1, "contact", self.WHEELSET, "--sweep", "axle.3=-20 mm:-60 mm:3", "--hold", "axle.4")
        self.assertEqual((off["status"], len(off["rows"])), ("stopped", 2))
        self.assertIn("wheel 'L' left its rail", off["reason"])


class Ensembles(Case):
    """Many instances: tables in and out, the same numbers however they are run, mistakes with their place."""

    def test_a_model_without_lengths(self):
        """Nanometres are judged by themselves, as in a run: tolerances of micrometres show nothing of them."""
        path = self.model("kempe: 1\nparameters: {k: 100}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1e-3}}\n"
                          "forces: {s: {joint: x, force: \"-k*q(x) + 1e-9*sin(300*t)*k\"}}\nrun: {t_end: 2}\n")
        (self.folder / "values.csv").write_text("k\n90\n100\n")
        words = "ensemble", path, "--values", "values.csv", "--rtol"
        self.assertIn("do not trust 2 of 2 instances", self.expect(5, *words, 1e-6).stderr)
        self.assertIn("complete, 2 instances", self.expect(0, *words, 1e-12).stdout)

    def test_the_model_itself(self):
        """Without values and samples: the quantities of one run, without statistics, which one instance has not."""
        path = self.model("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 2}}}\n"
                          "forces: {f: {joint: a, torque: 3}}\nrun: {t_end: 2}\n")
        words = "ensemble", path, "--quantity", "end = q(a), middle = mean(qd(a))", "--limit", "end < 4"
        text = self.expect(0, *words, "-o", "rows.csv").stdout
        self.assertIn("quantities of the instance\nlimits    pass\nend [rad]\n  value     3\nmiddle [rad/s]\n  value     1.5\n", text)
        self.assertNotIn("nan", text)
        self.assertEqual(len((self.folder / "rows.csv").read_text().splitlines()), 2)
        self.assertIn("limits    fail\n", self.expect(0, *words[:-1], "end < 2").stdout)
        self.assertIn("belong to a sample", self.expect(3, *words, "--instances", 5).stderr)
        self.assertIn("runs the model itself", self.expect(3, "ensemble", path).stderr)

    def test_an_option_of_another_command(self):
        self.assertIn("'kempe ensemble' has it", self.expect(3, "simulate", ANDREWS, "--quantity", "q(beta)").stderr)
        self.assertIn("did you mean '--output-step'?", self.expect(3, "simulate", ANDREWS, "--output-ste", "1").stderr)

    BARS = "crank,base,qd.crank\n0.3,0.9,20\n# four\n 0.31 ,0.88,-18.5\n0.29,0.91,2e1\n0.3,5,20\n"

    def table(self, text):
        (self.folder / "bars.csv").write_text(text)
        return "bars.csv"

    def rows(self, *words):
        done = kempe("ensemble", FOUR_BAR, *words, "-o", "ends.csv", cwd=self.folder)
        some = re.search(r"[1-9]\d* (stopped|failed)", done.stdout)
        self.assertEqual(done.returncode, 5 if some else 0, done.stderr)
        with open(self.folder / "ends.csv", newline="") as file:
            return done, list(csv.DictReader(file))

    def test_turns_within_steps(self):
        """A rotor makes 907 turns in 27 steps: q = W (t - T (1 - exp(-t/T))). Its unbalance pulls with m e w^2."""
        (self.folder / "rotor.yaml").write_text(
            "kempe: 1\nparameters: {e: 1 mm}\nbodies: {rotor: {joint: {name: A, revolute: z, at: ground}, mass: 10, com: [e, 0, 0], inertia: {zz: 0.1}, "
            "points: {P: [0.1, 0, 0]}}}\nforces: {motor: {joint: A, torque: 30 - 0.1*qd(A)}}\nrun: {t_end: 20}\n")
        words = "n=count(position(rotor.P).x > 0), x=max(position(rotor.P).x), F=max(reaction(A).x), r=range(position(rotor.P).y), d=duration(position(rotor.P).x > 0.05) from 15 to 20"
        (self.folder / "e.csv").write_text("e\n0.001\n")
        self.expect(0, "ensemble", "rotor.yaml", "--values", "e.csv", "--quantity", words, "-o", "ends.csv")
        with open(self.folder / "ends.csv", newline="") as file:
            row = {name: float(value) for name, value in next(csv.DictReader(file)).items() if name in "nxFrd"}
        last = (1 - math.exp(-20 / 1.0001)) * 300
        self.assertEqual(row["n"], 907)
        self.assertAlmostEqual(row["x"], 0.1, delta=1e-8)
        self.assertAlmostEqual(row["r"], 0.2, delta=1e-8)
        self.assertAlmostEqual(row["F"], 0.01 * last**2, delta=0.05)  # at a turn within the last 0.02 s
        self.assertAlmostEqual(row["d"], 5 / 3, delta=0.01)

    def test_at_rest(self):
        """A mass that hangs on a spring nearly still, 1000 m above the ground: its kinetic energy is below the rounding of its potential energy."""
        (self.folder / "hangs.yaml").write_text(
            "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 100}\nground: {points: {P: [0, 1000, 0]}}\nbodies: {bob: {joint: {name: x, prismatic: y, at: ground.P}, mass: 1}}\n"
            "forces: {spring: {joint: x, force: -k*q(x)}}\nstart: {q: {x: -9.81/k + 1e-9}}\nrun: {t_end: 1}\n")
        (self.folder / "k.csv").write_text("k\n100\n133\n170\n")
        self.expect(0, "ensemble", "hangs.yaml", "--values", "k.csv", "-o", "ends.csv")
        with open(self.folder / "ends.csv", newline="") as file:
            self.assertTrue(all(float(row["drift"]) < 1e-6 for row in csv.DictReader(file)))

    def test_values(self):
        done, rows = self.rows("--values", self.table(self.BARS), "--t-end", 0.5)
        self.assertIn("3 of 4 instances complete, 1 failed\n  1 failed: parameter 'across' is not a number", done.stdout)
        self.assertIn("(first: instance 4,", done.stdout)
        self.assertEqual([row["status"] for row in rows], ["complete", "complete", "complete", "failed"])
        self.assertEqual([row["crank"] for row in rows], ["0.3", "0.31", "0.29", "0.3"])
        self.assertEqual((rows[3]["q.crank"], rows[3]["t"]), ("", "0"))
        self.assertIn("parameter 'across'", rows[3]["reason"])
        done, _ = self.rows("--values", "bars.csv", "--t-end", 0.5, "--quantity", "never=first(q(crank) > 100)")
        self.assertIn("\nnever [s], known in 0 of 3 independent samples\n", done.stdout)
        self.assertNotIn("nan", done.stdout.split("statistics of")[1])
        one = self.object(0, "simulate", FOUR_BAR, "--t-end", 0.5, "--set", "crank=0.29", "--set", "base=0.91",
                          "--integrator", "dop853", "--no-convergence-check", "-o", "one.csv")
        with open(self.folder / "one.csv", newline="") as file:
            last = list(csv.DictReader(file))[-1]
        for name in "q.crank q.coupler q.rocker qd.rocker".split():
            self.assertAlmostEqual(float(rows[2][name]), float(last[name]), delta=1e-7)
        self.assertEqual(int(rows[2]["steps"]), one["work"]["steps"])

    def test_lanes(self):
        values = self.table(self.BARS)
        best = self.rows("--values", values, "--t-end", 0.5)[1]
        for words in (("--lanes", 1), ("--lanes", 3), ("--lanes", 8)):
            self.assertEqual(self.rows("--values", values, "--t-end", 0.5, *words)[1], best)
        done, alone = self.rows("--values", values, "--t-end", 0.5, "--alone")
        self.assertIn("every instance separately", done.stdout)
        self.assertEqual([row["single_run"] for row in alone], ["a request for separate runs"] * 4)
        for a, b in zip(best[:3], alone):
            self.assertAlmostEqual(float(a["q.rocker"]), float(b["q.rocker"]), delta=1e-8)

    def test_sample(self):
        words = ("--sample", "crank=0.29:0.31,q.coupler=-0.01:+1e-2", "--instances", 20, "--t-end", 0.1)
        first, again = self.object(0, "ensemble", FOUR_BAR, *words), self.object(0, "ensemble", FOUR_BAR, *words)
        self.assertEqual(without_times(first), without_times(again))
        self.assertKeys(first, "model status reason build_s count complete stopped failed lanes single_run rtol atol t_end threads "
                               "cpu_s wall_s columns coordinates instances")
        self.assertEqual((first["count"], first["complete"], first["columns"]), (20, 20, ["crank", "q.coupler"]))
        for one in first["instances"]:
            self.assertKeys(one, "values status reason t q qd steps rejected refused rhs exchanges h hdot drift single_run")
            self.assertTrue(0.29 <= one["values"][0] < 0.31 and -0.01 <= one["values"][1] < 0.01)
        other = self.object(0, "ensemble", FOUR_BAR, *words, "--seed", 2)
        self.assertNotEqual(first["instances"][0]["values"], other["instances"][0]["values"])

    def test_mistakes_in_tables(self):
        for text, told in (("crank,bse\n1,2\n", "bars.csv:1:7: the model has no parameter 'bse'; did you mean 'base'?"),
                           ("crank,crank\n1,2\n", "bars.csv:1:7: duplicate column"),
                           ("qd.crnk\n1\n", "bars.csv:1:1: the model has no coordinate 'crnk'; did you mean 'crank'?"),
                           ("crank,\n1,2\n", "bars.csv:1:7: a name is expected here"),
                           ("# a\ncrank, base\n1,x\n", "bars.csv:3:3: a finite number is expected here"),
                           ("crank\ninf\n", "bars.csv:2:1: a finite number is expected here"),
                           ("crank,base\n1\n", "bars.csv:2:1: 1 field where the header has 2 columns"),
                           ("crank\n0.3\n\0\n0.31\n", "bars.csv:3:1: a character of code 0 is here"),
                           ("crank\n", "bars.csv:2:1: no rows follow the header line"),
                           ("# nothing\n", "bars.csv:2:1: the header line with names of parameters is missing")):
            done = self.expect(2, "ensemble", FOUR_BAR, "--values", self.table(text))
            self.assertIn(told, done.stderr)
        self.expect(2, "ensemble", FOUR_BAR, "--values", "nowhere.csv")

    def test_mistakes(self):
        self.assertIn("--values", self.expect(3, "ensemble", FOUR_BAR).stderr)
        self.expect(3, "ensemble", FOUR_BAR, "--values", self.table(self.BARS), "--sample", "crank=1:2")
        for ranges in ("crank", "crank=1", "crank=1:", "crank=:2", "=1:2", "crank=1:2,", "crank=1:2;base=1:2", "crank=a:b"):
            self.assertIn("NAME=A:B", self.expect(3, "ensemble", FOUR_BAR, "--sample", ranges).stderr)
        self.assertIn("did you mean 'crank'?", self.expect(3, "ensemble", FOUR_BAR, "--sample", "crnk=1:2").stderr)
        self.assertIn("17 instances at a time", self.expect(3, "ensemble", FOUR_BAR, "--sample", "crank=1:2", "--lanes", 17).stderr)
        self.assertIn("no instance reached its end",
                      self.expect(1, "ensemble", FOUR_BAR, "--sample", "base=5:6", "--instances", 3).stderr)
        self.assertIn("setting of the run",
                      self.expect(3, "ensemble", self.model("kempe: 1\nparameters: {T: 1}\nbodies: {a: {joint: {revolute: z, "
                                                            "at: ground}, mass: 1, inertia: {zz: 1}}}\nrun: {t_end: T}\n"),
                                  "--sample", "T=1:2").stderr)


class Inverse(Case):
    def test_rows_where_drives_jump(self):
        """Accelerations and forces at the time of a jump of a drive are those before it, as in rows of a run; so are those of a sweep of time."""
        path = self.model("kempe: 1\nbodies:\n"
                          "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 3, points: {P: [0, 0, 0]}}\n"
                          "  arm: {joint: {name: A, revolute: z, at: cart.P}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.02}}\n"
                          "tables: {path: {x: [0, 0.5, 1, 2], y: [0, 0.2, 0.9, 1], method: monotone}}\n"
                          'drives: {d: {joint: x, displacement: "if(t < 1, 0, 0.5*(t - 1)^2)"}, e: {joint: A, angle: path(t)}}\n'
                          "run: {t_end: 2, output_step: 0.25, outputs: [q, qd, qdd, lambda]}\n")
        self.expect(0, "simulate", path, "-o", "run.csv")
        self.expect(0, "inverse", path, "--actuators", "x,A", "-o", "inverse.csv")
        self.expect(0, "kinematics", path, "--sweep", "t=0:2:9", "-o", "sweep.csv")
        run, inverse, sweep = (list(csv.DictReader((self.folder / f"{name}.csv").read_text().splitlines())) for name in ("run", "inverse", "sweep"))
        self.assertEqual(len(run), 9)
        for rows, names in ((inverse, {"lambda.d.1": "tau.x", "lambda.e.1": "tau.A", "qdd.A": "qdd.A"}), (sweep, {"qdd.x": "qdd.x", "qdd.A": "qdd.A", "qd.A": "qd.A"})):
            for mine, other in zip(run, rows):
                for name, its in names.items():
                    self.assertAlmostEqual(float(mine[name]), float(other[its]), delta=1e-9, msg=f"{its} at {mine['t']} s")

    def test_forces_of_the_model_are_named(self):
        """tau is in addition to what the model has along an actuated coordinate; a force elsewhere is not named."""
        self.expect(0, "new", "bar")
        said = "in addition to the model's forces along these coordinates: 'motor' along A\n"
        self.assertIn(said, self.expect(0, "inverse", "bar.yaml", "--actuators", "A").stdout)
        self.assertNotIn("in addition", self.expect(0, "inverse", "bar.yaml", "--actuators", "D").stdout)
        for actuator, forces in (("A", ["motor"]), ("D", [])):
            self.assertEqual(self.object(0, "inverse", "bar.yaml", "--actuators", actuator)["model_forces"], forces)

    def test_rows_at_jumps_have_the_forces_before(self):
        """A run's own motion needs no force of an actuator, also where inputs and conditions of t jump at the time of a row, and a sweep of
        time shows the forces that a run shows."""
        model = self.model("kempe: 1\ninputs: {u: {t: [-1, 0, 0.7], value: [5, 1, 3], method: hold}, place: {t: [0, 0.5, 1, 2], value: [0, 0.1, 0, 0], method: cubic}}\n"
                           "bodies:\n  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.2}}\n"
                           "  c: {joint: {name: X, prismatic: x, at: ground}, mass: 1}\ndrives: {d: {joint: X, displacement: place}}\n"
                           "forces: {f: {joint: A, torque: \"u + if(t >= 0.5, 2, 0) - if(t > 0.3, 1, 0)\"}}\nstart: {q: {A: 1}}\n"
                           "run: {t_end: 1, output_step: 0.1, outputs: [q, qd, qdd, force(f)]}\n")
        self.expect(0, "simulate", model, "-o", "run.csv")
        self.expect(0, "inverse", model, "--motion", "run.csv", "--actuators", "A,X", "-o", "forces.csv")
        self.expect(0, "kinematics", model, "--sweep", "t=0:1:11", "--hold", "A", "-o", "sweep.csv")
        run = self.rows("run.csv")
        self.assertEqual([row["force.f"] for row in run], [1, 1, 1, 1, 0, 0, 2, 2, 4, 4, 4])
        self.assertEqual([row["force.f"] for row in self.rows("sweep.csv")], [row["force.f"] for row in run])
        self.assertLess(max(abs(row["tau.A"]) for row in self.rows("forces.csv")), 1e-12)

    LED = ROOT / "examples/stewart/driven.yaml"
    LEGS = ",".join(f"slide{k}" for k in range(1, 7))
    ROBOT = ROOT / "examples/parallel_robot/parallel_robot.yaml"

    def rows(self, path):
        with open(self.folder / path, newline="") as file:
            return [{name: float(x) for name, x in row.items()} for row in csv.DictReader(file)]

    def test_keys(self):
        one = self.object(0, "inverse", self.LED, "--actuators", self.LEGS, "--t-end", 0.1, "-o", "legs.csv")
        self.assertKeys(one, "model status reason build_s motion source rows dof rank efforts norm length transmission transmission_t "
                             "residual residual_t singular left redundant actuators t tau power lambda reaction moment cpu_s")
        self.assertEqual((one["status"], one["motion"], one["rows"], one["dof"], one["efforts"]),
                         ("complete", "drives", 11, 6, "definite"))
        self.assertKeys(one["actuators"]["slide1"], "unit weight largest largest_t rms power power_t work")
        self.assertLess(one["residual"], 1e-14)
        rows = self.rows("legs.csv")
        self.assertEqual([row["t"] for row in rows], one["t"])
        for k, row in enumerate(rows):
            self.assertEqual(row["tau.slide3"], one["tau"]["slide3"][k])
            self.assertEqual(row["power.slide3"], one["power"]["slide3"][k])
            self.assertEqual([row[f"lambda.P2.{i}"] for i in (1, 2, 3)], one["lambda"]["P2"][k])
            self.assertEqual([row[f"reaction.P2.{x}"] for x in "xyz"], one["reaction"]["P2"][k])
            self.assertAlmostEqual(row["q.platform.1"], 0.1*math.sin(5*row["t"]), delta=1e-14)
        self.assertNotIn("lambda.x.1", rows[0])

    def test_there_and_back(self):
        """A trajectory is a motion, and so is what comes out; efforts that the model has are not asked for again."""
        self.expect(0, "simulate", self.ROBOT, "-o", "robot.csv", "--no-convergence-check")
        done = self.expect(0, "inverse", self.ROBOT, "--set", "k=0", "--motion", "robot.csv", "--actuators", "a1,b1", "-o",
                           "efforts.csv")
        self.assertIn("2 actuators, 2 degrees of freedom: the actuator forces are uniquely determined", done.stdout)
        for row in self.rows("efforts.csv"):  # those of the springs; accelerations are by splines
            self.assertAlmostEqual(row["tau.a1"], -60*(row["q.a1"] + math.radians(150)), delta=0.02)
            self.assertAlmostEqual(row["tau.b1"], -60*(row["q.b1"] + math.radians(30)), delta=0.02)
        self.expect(0, "inverse", self.ROBOT, "--set", "k=0", "--motion", "efforts.csv", "--actuators", "a1,b1", "-o",
                    "again.csv")
        for a, b in zip(self.rows("efforts.csv"), self.rows("again.csv")):
            self.assertAlmostEqual(a["tau.a1"], b["tau.a1"], delta=1e-10)

    def test_more_and_fewer(self):
        done = self.expect(0, "inverse", self.ROBOT, "--actuators", "a1,b1,a2", "--weights", "a2=4")
        self.assertIn("the actuator forces minimise the sum of weight*tau^2", done.stdout)
        self.assertIn("redundant", done.stdout)
        one = self.object(1, "inverse", self.ROBOT, "--actuators", "a1")
        self.assertEqual((one["status"], one["rank"], one["dof"], one["efforts"]), ("failed", 1, 2, "least squares"))
        self.assertIn("they act on 1 of 2 degrees of freedom", one["reason"])

    def test_same_bytes_twice(self):
        for name in ("a.csv", "b.csv"):
            self.expect(0, "inverse", self.LED, "--actuators", self.LEGS, "--t-end", 0.5, "-o", name)
        self.assertEqual((self.folder / "a.csv").read_bytes(), (self.folder / "b.csv").read_bytes())

    def test_mistakes(self):
        self.assertIn("--actuators", self.expect(3, "inverse", self.LED, "--actuators").stderr)
        self.assertIn("would move it", self.expect(3, "inverse", self.ROBOT).stderr)
        self.expect(2, "inverse", self.ROBOT, "--actuators", "a1", "--motion", "nowhere.csv")
        self.expect(1, "inverse", self.LED, "-o", "nowhere/out.csv")
class Linear(Case):
    """State spaces and frequency responses."""

    RIDE = ROOT / "examples/ride/ride.yaml"
    WORDS = "--inputs", "drive(road),force(body.L.z)", "--outputs", "q(body),acceleration(body.L).z"

    def test_state_space(self):
        found = self.object(0, "linearize", self.RIDE, *self.WORDS, "--independent", "body,lower")
        self.assertKeys(found, "model status reason build_s at state residual u q qd states inputs outputs y A B C D M G K L N Nd")
        self.assertEqual((found["at"], found["state"], found["u"]), ("equilibrium", "rests", ["body", "lower"]))
        self.assertEqual([x["name"] for x in found["states"]], ["q.body", "q.lower", "qd.body", "qd.lower"])
        self.assertEqual([(x["name"], x["unit"]) for x in found["inputs"]],
                         [("drive(road)", "m"), ("drive(road).d", "m/s"), ("drive(road).dd", "m/s^2"), ("force(body.L.z)", "N")])
        shapes = {name: (len(found[name]), len(found[name][0])) for name in "A B C D M G K L N Nd".split()}
        self.assertEqual(shapes, {"A": (4, 4), "B": (4, 4), "C": (2, 4), "D": (2, 4), "M": (2, 2), "G": (2, 2), "K": (2, 2),
                                  "L": (2, 4), "N": (5, 2), "Nd": (5, 2)})
        self.assertEqual(found["K"][0][0], 200e3)
        self.assertAlmostEqual(found["D"][1][3] * (298 - 17.6**2 / (4 * 0.16 * 2 / 3 + 40 * 0.16)), 1, delta=1e-13)

    def test_arrays(self):
        self.expect(0, "linearize", self.RIDE, *self.WORDS, "-o", "ride.npz")
        found = self.object(0, "linearize", self.RIDE, *self.WORDS)
        with zipfile.ZipFile(self.folder / "ride.npz") as archive:
            self.assertEqual(set(archive.namelist()), {f"{name}.npy" for name in (
                "A B C D M G K L N Nd states state_units inputs input_units outputs output_units coordinates q qd y").split()})
            for name in "A C N".split():
                data = archive.read(f"{name}.npy")
                length = struct.unpack("<H", data[8:10])[0]
                shape = ast.literal_eval(data[10 : 10 + length].decode())["shape"]
                values = struct.unpack("<%dd" % (shape[0] * shape[1]), data[10 + length :])
                self.assertEqual([list(values[k * shape[1] : (k + 1) * shape[1]]) for k in range(shape[0])], found[name])
        self.assertIn("nowhere/a.npz", self.expect(1, "linearize", self.RIDE, "-o", "nowhere/a.npz").stderr)

    def test_nothing_asked(self):
        done = self.expect(0, "linearize", FOUR_BAR, "--at", "start").stdout
        self.assertIn("which is not an equilibrium\n  It is valid only near this state", done)
        self.assertNotIn("input", done)
        found = self.object(0, "linearize", FOUR_BAR, "--at", "start")
        self.assertEqual((found["state"], found["inputs"], found["B"], found["C"]), ("moves", [], [[], []], []))

    def test_response(self):
        done = self.expect(0, "response", self.RIDE, "--inputs", "drive(road)", "--outputs", "q(body),travel", "--frequencies",
                           "0.2:50:40", "-o", "response.csv", "--svg", "response.svg")
        self.assertIn("q.body / drive(road)", done.stdout)
        reference = subprocess.run([sys.executable, ROOT / "examples/ride/reference_ride.py", "response.csv"], cwd=self.folder,
                                   capture_output=True, text=True, timeout=100)
        self.assertEqual(reference.returncode, 0, reference.stdout + reference.stderr)
        self.assertIn("40 frequencies", reference.stdout)
        picture = xml.etree.ElementTree.parse(self.folder / "response.svg")
        self.assertEqual(len([p for p in picture.iter() if p.get("class") == "curve"]), 6)
        found = self.object(0, "response", self.RIDE, "--inputs", "drive(road)", "--frequencies", "0.2:50:40", "--linear")
        self.assertKeys(found, "model status reason build_s at u q inputs outputs eigenvalues peaks frequency responses")
        self.assertEqual((len(found["frequency"]), found["frequency"][0], found["frequency"][-1]), (40, 0.2, 50))
        self.assertAlmostEqual(found["frequency"][1] - found["frequency"][0], 49.8 / 39, delta=1e-12)
        for pair in found["responses"]:
            self.assertEqual((len(pair["amplitude"]), len(pair["phase_deg"])), (40, 40))
        self.assertEqual(len(found["eigenvalues"]), 4)

    def test_pole(self):
        found = self.object(0, "response", self.model("kempe: 1\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
                                                      "forces: {f: {joint: a, spring: {stiffness: 4*3.141592653589793^2}}}\n"
                                                      "run: {outputs: [q]}\n"),
                            "--inputs", "effort(a)", "--frequencies", "0:2:3", "--linear")
        pair = found["responses"][0]
        self.assertIsNone(pair["amplitude"][1])
        self.assertAlmostEqual(pair["amplitude"][2] * 3 * 39.47841760435743, 1, delta=1e-13)
        self.assertEqual([(peak["frequency"], peak["amplitude"]) for peak in found["peaks"]], [(1, None)])

    def test_steady(self):
        """A wheel that turns on changes no force, whether the rate is the start's or asked for."""
        model = self.model("kempe: 1\nbodies:\n  wheel: {joint: {revolute: z, at: ground}, mass: 2, inertia: {xx: 1, yy: 1, zz: 2}}\n"
                           "  a: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                           "  crank: {joint: {revolute: y, at: ground}, mass: 1, com: [0.1, 0, 0], inertia: {xx: 1, yy: 1, zz: 1}}\n"
                           "forces:\n  f: {joint: a, spring: {stiffness: 100}}\n  g: {joint: crank, spring: {stiffness: 9}}\n"
                           "start: {qd: {wheel: 3, crank: spin}}\nparameters: {spin: 0}\nrun: {outputs: [q]}\n")
        words = ("--inputs", "effort(a)", "--frequencies", "1:2:3")
        start = self.object(0, "response", model, *words, "--at", "start")
        asked = self.object(0, "response", model, *words, "--at", "equilibrium wheel=3")
        self.assertEqual(start["responses"], asked["responses"])
        self.assertIn("about the start, which is a steady motion", self.expect(0, "response", model, *words, "--at", "start").stdout)
        self.assertEqual(self.object(0, "linearize", model, "--at", "equilibrium wheel=3")["state"], "steady")
        self.assertIn("changing with the motion", self.expect(1, "response", model, *words, "--at", "start", "--set", "spin=1").stderr)
        self.assertIn("the forces change", self.expect(1, "response", model, *words, "--at", "equilibrium crank=3").stderr)
        for of in ("modes", "reactions", "equilibrium"):
            found = self.object(0, "sensitivity", ROOT / "examples/governor/governor.yaml", "--of", of, "--parameters", "M",
                                "--at", "equilibrium shaft=5.5", *(() if of == "modes" else ("--outputs", "q(slider)")))
            self.assertEqual(found["status"], "complete")
        self.assertIn("begins at the start", self.expect(3, "sensitivity", FOUR_BAR, "--at", "equilibrium").stderr)

    def test_units_of_frequencies(self):
        """Angles per time are divided by 2 pi, also at one end alone."""
        of = lambda text: self.object(0, "response", self.RIDE, "--inputs", "drive(road)", "--frequencies", text)["frequency"]
        wanted = of("1:5:3")
        for text in ("1 Hz:5 Hz:3", "60 rpm:300 rpm:3", "1 rev/s:5 rev/s:3", "6.283185307179586 rad/s:5 Hz:3", "360 deg/s:5 1/s:3"):
            for a, b in zip(of(text), wanted):
                self.assertAlmostEqual(a, b, delta=1e-12)

    def test_mistakes(self):
        for words, sentence in (("--inputs drive(raod)", "the model has no drive 'raod'; did you mean 'road'?"),
                                ("--inputs k --outputs travl", "unknown output 'travl'"),
                                ("--inputs stiff", "no parameter 'stiff'"),
                                ("--inputs k --at end", "unknown state 'end'"),
                                ("--inputs k --frequencies 5", "A:B"), ("--inputs k --frequencies 1mm:5mm", "m is given, but 1/s is expected")):
            self.assertIn(sentence, self.expect(3, "response", self.RIDE, *words.split()).stderr)
        self.assertIn("a frequency response needs inputs", self.expect(3, "response", self.RIDE).stderr)
        self.assertIn("not an equilibrium",
                      self.expect(1, "response", self.RIDE, "--inputs", "k", "--at", "start", "--set", "support=0 N").stderr)
class Modes(Case):
    """Eigenvalues and shapes near a state, and over a parameter: text, JSON, CSV, pictures, mistakes."""

    CAR, WHEELSET = ROOT / "examples/quarter_car/quarter_car.yaml", ROOT / "examples/restrained_wheelset/restrained_wheelset.yaml"

    def test_sweep_on_another_branch(self):
        """Two wells at +-1 rad: from f = 1 the sweep stays in the right one, the model itself rests in the left one."""
        model = self.folder / "wells.yaml"
        model.write_text("kempe: 1\nparameters: {f: 0, k: 1 N*m}\n"
                         "bodies: {m: {joint: {name: x, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                         'forces: {well: {joint: x, torque: "k*(q(x) - q(x)^3 + f)"}}\nstart: {q: {x: -0.9}}\n')
        told = self.expect(0, "modes", model, "--sweep", "f=1:-0.2:13").stderr
        self.assertIn("passes the model's value 0 at another one: 'x' is 1 instead of -1 rad", told)
        self.assertIn("the sweep follows the equilibrium at f = 1, and", told)
        self.assertEqual(self.expect(0, "modes", model, "--sweep", "f=0.2:-0.2:5").stderr, "")

    OSCILLATORS = ("kempe: 1\nparameters: {a: 1, c: 1e-5}\nbodies:\n"
                   "  m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                   "  n: {joint: {name: y, prismatic: x, at: ground}, mass: 1}\n"
                   "forces:\n  f: {joint: x, force: '-a*q(x) + c*(q(y) - q(x))'}\n"
                   "  g: {joint: y, force: '-q(y) + c*(q(x) - q(y)) + LOAD'}\n")

    def test_uncertain_values(self):
        """Two frequencies that nearly meet at a = 1: the steps beside it are named, and none where they stay apart."""
        model = self.model(self.OSCILLATORS.replace("LOAD", "0"))
        self.assertIn("Modes could not be followed with certainty over 0.9 to 1.1 of a:",
                      self.expect(0, "modes", model, "--sweep", "a=0.5:1.5:11").stdout)
        self.assertEqual(self.object(0, "modes", model, "--sweep", "a=0.5:1.5:11")["locus"]["uncertain"], [[0.9, 1.1]])
        self.assertEqual(self.object(0, "modes", model, "--sweep", "a=0.5:1.5:11", "--set", "c=1e-3")["locus"]["uncertain"], [])

    def test_the_time_is_told(self):
        """Functions of time are taken at t = 0, and the text says so; without them it has no word of it."""
        for load, said in (("0", False), ("cos(t)", True)):
            model = self.model(self.OSCILLATORS.replace("LOAD", load))
            for words in (("modes", model), ("equilibrium", model), ("linearize", model),
                          ("response", model, "--inputs", "effort(x)", "--frequencies", "1:2:3")):
                self.assertEqual("t = 0" in self.expect(0, *words).stdout, said, words)

    def test_modes(self):
        text, one = self.expect(0, "modes", self.CAR).stdout, self.object(0, "modes", self.CAR)
        self.assertIn("quarter-car: complete, 2 modes at the equilibrium, stable: every mode decays\n  2 degrees of freedom: wheel, body\n", text)
        self.assertRegex(text, r"\n +1 +1\.1212\d +0\.2178\d* +0\.6358\d* +body 91 %, wheel 9 %\n")
        self.assertRegex(self.expect(0, "modes", self.CAR, "--all").stdout, r"\n +1 .* -1\.57274 \+- 7\.04504 i  body")
        self.assertKeys(one, "model status reason build_s at q qd u eigenvalues zeros stability reasons modes cpu_s")
        self.assertEqual((one["at"], one["u"], one["zeros"], one["stability"]), ("equilibrium", ["wheel", "body"], 0, "stable"))
        self.assertEqual(len(one["eigenvalues"]), 4)
        for upper, lower in (one["eigenvalues"][:2], one["eigenvalues"][2:]):
            self.assertEqual((upper[0], upper[1]), (lower[0], -lower[1]))
            self.assertGreater(upper[1], 0)
        for mode in one["modes"]:
            self.assertKeys(mode, "index eigenvalue frequency damping decay moves shape kinetic potential")
            self.assertEqual(mode["eigenvalue"], one["eigenvalues"][mode["index"]])
            self.assertAlmostEqual(sum(mode["kinetic"].values()), 1, delta=1e-12)
            self.assertAlmostEqual(sum(mode["potential"].values()), 1, delta=1e-12)
        self.assertEqual(without_times(one), without_times(self.object(0, "modes", self.CAR)))

    def test_reference(self):
        """The roots that the example's reference program computes."""
        with open(self.CAR.parent / "modes.csv", newline="") as file:
            wanted = [complex(float(row["re"]), float(row["im"])) for row in csv.DictReader(line for line in file if line[0] != "#")]
        found = [complex(*pair) for pair in self.object(0, "modes", self.CAR)["eigenvalues"]]
        self.assertEqual(len(found), 4)
        for s in wanted:
            self.assertLess(min(abs(s - root) for root in found), 1e-12 * abs(s))

    def test_critical_speed(self):
        """The closed form that the wheelset's reference program computes. The fastest eigenvalue grows with f, and rounding of it
        with that: 1e-10 of the speed at f = 1e7 N."""
        with open(self.WHEELSET.parent / "reference.csv", newline="") as file:
            rows = [row for row in csv.DictReader(line for line in file if line[0] != "#") if row["f"] != "inf"]
        self.assertEqual(len(rows), 3)
        for row in rows:
            critical, = self.object(0, "modes", self.WHEELSET, "--set", f"f={row['f']}", "--sweep", "V=90:115:3")["locus"]["critical"]
            close = 1e-17 * float(row["f"])
            self.assertLess(abs(critical["value"] / float(row["speed"]) - 1), close)
            self.assertLess(abs(2 * math.pi * critical["frequency"] / float(row["rate"]) - 1), close)

    def test_table(self):
        self.expect(0, "modes", self.CAR, "-o", "modes.csv")
        one = self.object(0, "modes", self.CAR)
        with open(self.folder / "modes.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([[float(row["re"]), float(row["im"])] for row in rows], one["eigenvalues"])
        self.assertEqual([float(rows[0]["re.body"]), float(rows[0]["im.body"])], one["modes"][0]["shape"]["body"])

    def test_start(self):
        one = self.object(0, "modes", FOUR_BAR, "--at", "start", "--independent", "rocker")
        self.assertEqual((one["at"], one["u"], one["qd"]["crank"]), ("start", ["rocker"], 20))
        self.assertIn("The start need not be an equilibrium", self.expect(0, "modes", FOUR_BAR, "--at", "start").stdout)
        self.assertIn("neutral: 4 free motions, no mode grows\n",
                      self.expect(0, "modes", ROOT / "examples/suspension/suspension.yaml").stdout)

    def test_varied(self):
        words = ("--sweep", "V=40:140:11", "--orders", "0.5,1", "-o", "v.csv", "--svg", "v.svg")
        text = self.expect(0, "modes", self.WHEELSET, *words).stdout
        self.assertIn(": complete, V from 40 to 140 m/s, 11 values: 1 change of stability\n  V = 103.914 m/s: a mode of 6.21645 Hz (39.0591 rad/s) grows above it\n", text)
        locus = self.object(0, "modes", self.WHEELSET, *words[:2])["locus"]
        self.assertKeys(locus, "name values eigenvalues critical")
        critical, = locus["critical"]
        self.assertAlmostEqual(critical["value"], 103.914411718, delta=1e-8)
        self.assertAlmostEqual(critical["eigenvalue"][1], 39.05908949, delta=2e-8)
        self.assertEqual(critical["grows"], "above")
        with open(self.folder / "v.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([float(row["V"]) for row in rows], locus["values"])
        for row, pairs in zip(rows, locus["eigenvalues"]):
            self.assertEqual([[float(row[f"re.{b}"]), float(row[f"im.{b}"])] for b in range(1, 5)], pairs)
        critical, = locus["critical"]
        self.assertKeys(critical, "value eigenvalue frequency branch grows")
        self.assertLess(abs(critical["eigenvalue"][0]), 1e-9)
        picture = ElementTree.parse(self.folder / "v.svg").getroot()
        drawn = [path.get("class") for path in picture.iter("{http://www.w3.org/2000/svg}path")]
        self.assertEqual([drawn.count(name) for name in ("curve", "cross", "critical", "order")], [8, 2, 1, 2])
        self.assertNotIn("real ones as far as", (self.folder / "v.svg").read_text())
        self.expect(0, "modes", self.WHEELSET, *words[:2], "--highest", 7, "--svg", "low.svg", "--report", "low.html")
        low = ElementTree.parse(self.folder / "low.svg").getroot()
        drawn = [path.get("class") for path in low.iter("{http://www.w3.org/2000/svg}path")]
        self.assertEqual([drawn.count(name) for name in ("curve", "cross")], [4, 2])
        self.assertIn('"highest":43.98', (self.folder / "low.html").read_text().replace(" ", ""))

    def test_steady(self):
        """A governor goes round; what varies is called by the rate."""
        governor = ROOT / "examples/governor/governor.yaml"
        one = self.object(0, "modes", governor, "--rates", "shaft=7")
        self.assertEqual((one["qd"]["shaft"], one["zeros"], one["stability"]), (7, 2, "neutral"))
        self.assertAlmostEqual(one["q"]["right"], one["q"]["left"], delta=1e-9)
        locus = self.object(0, "modes", governor, "--rates", "shaft=6:8:3", "--svg", "g.svg")["locus"]
        self.assertEqual((locus["name"], locus["values"]), ("qd.shaft", [6, 7, 8]))
        self.assertIn("real ones as far as -", (self.folder / "g.svg").read_text())
        for s in one["eigenvalues"]:
            size = max(abs(complex(*pair)) for pair in one["eigenvalues"])
            self.assertLess(min(abs(complex(*s) - complex(*pair)) for pair in locus["eigenvalues"][1]), 1e-9 * size)

    def test_stopped(self):
        words = ("modes", self.CAR, "--sweep", "body=100:-100:5")
        self.assertIn("\n  Stopped: 'body' was swept from 100 to ", self.expect(1, *words).stdout)
        self.assertEqual(self.object(1, *words)["status"], "stopped")

    def test_mistakes(self):
        for words, told in ((["--at", "strat"], "'strat'"), (["--sweep", "tire=1:2"], "did you mean 'tyre'?"),
                            (["--sweep", "tyre=1"], "two ends"), (["--svg", "x.svg"], "--sweep"), (["--rates", "hub=1"], "'hub'"), (["--independent", "hub"], "'hub'"),
                            (["--sweep", "tyre=1:2", "--orders", "a"], "'a'"), (["--highest", "-3"], "positive")):
            self.assertIn(told, self.expect(3, "modes", self.CAR, *words).stderr)
        free = self.model("kempe: 1\ngravity: [0, -9.81, 0]\nbodies: {a: {joint: {prismatic: y, at: ground}, mass: 1}}\n")
        self.assertIn("'a'", self.expect(1, "modes", free).stderr)
        self.assertEqual(self.object(1, "modes", free)["status"], "failed")


class Usage(Case):
    def test_help(self):
        text = self.expect(0, "--help").stdout
        self.assertEqual(self.expect(0, "help").stdout, text)
        self.assertIn("did you mean 'simulate'?", self.expect(3, "help", "simulat").stderr)
        for name in COMMANDS:
            self.assertIn(name, text)

    def test_help_of_each_command(self):
        for name in COMMANDS:
            text = self.expect(0, name, "--help").stdout
            self.assertEqual(self.expect(0, "help", name).stdout, text)
            result = "--json" if name != "workbench" else "output:"  # it serves a page
            self.assertIn(result, text)
            self.assertEqual([line for line in text.split("\n") if len(line) > 100 and not line.startswith("  kempe")], [])
            self.assertLess(text.index("\nexamples:"), text.index(result))
            self.assertIn(f"  kempe {name} {dict(new='four_bar', gather='bars.kempe', reduce='blade_mesh.npz').get(name, 'examples/')}", text)

    def test_version(self):
        self.assertRegex(self.expect(0, "--version").stdout, r"^kempe \d+\.\d+\.\d+\n$")

    def test_nothing(self):
        self.expect(3)

    def test_unknown_command(self):
        self.assertIn("'simulate'", self.expect(3, "simulte", ANDREWS).stderr)
        self.expect(3, "frobnicate", ANDREWS)

    def test_unknown_option(self):
        self.assertIn("'--rtol'", self.expect(3, "simulate", ANDREWS, "--rtoll", "1e-6").stderr)
        self.assertIn("'--formulations'", self.expect(3, "compare", ANDREWS, "--formulation", "dae").stderr)
        self.expect(3, "check", ANDREWS, "--frobnicate")

    def test_bad_numbers(self):
        for text in ("abc", "1e-6x", "-1", "0", "nan", "inf", ""):
            self.assertIn("--rtol", self.expect(3, "simulate", ANDREWS, "--rtol", text).stderr)

    def test_missing_words(self):
        self.expect(3, "check")
        self.expect(3, "simulate", ANDREWS, "--rtol")
        self.expect(3, "check", ANDREWS, FOUR_BAR)
        self.assertEqual(self.expect(0, "show", ANDREWS).stdout, self.expect(0, "show", ANDREWS, "--model").stdout)
        self.expect(3, "show", ANDREWS, "--model", "--stats")
        self.assertIn("--count", self.expect(3, "generate", ANDREWS).stderr)
        self.assertIn("languages are c", self.expect(3, "generate", ANDREWS, "--lang", "fortran").stderr)

    def test_unknown_names(self):
        for option, value in (("--formulation", "rode"), ("--integrator", "dop54"), ("--form", "shut"), ("--independent", "nobody")):
            self.expect(3, "simulate", ANDREWS, option, value)
        self.expect(3, "compare", ANDREWS, "--formulations", "reduced,rode")
        self.assertIn("M_C", self.expect(3, "generate", ANDREWS, "--count", "--sets", "M_C,K").stderr)
        self.expect(3, "generate", ANDREWS, "--count", "--scheme", "fast")


class New(Case):
    def test_first_model(self):
        self.assertIn("kempe simulate four_bar.yaml", self.expect(0, "new", "four_bar").stdout)
        self.assertEqual(self.object(0, "check", "four_bar.yaml")["dof"], 1)
        self.assertEqual(self.object(0, "check", "four_bar.yaml")["model"], "four_bar")
        self.assertIn(": complete, 0 to 5 s, 251 rows, estimated error ", self.expect(0, "simulate", "four_bar.yaml").stdout)

    def test_ending(self):
        self.assertEqual(self.object(0, "new", 'a "b".yaml'), {"status": "complete", "file": 'a "b".yaml'})
        self.assertEqual([path.name for path in self.folder.iterdir()], ['a "b".yaml'])

    def test_a_file_that_exists_is_kept(self):
        path = self.folder / "mine.yaml"
        path.write_text("mine")
        for name in ("mine", "mine.yaml"):
            self.assertIn("'mine.yaml' exists already", self.expect(1, "new", name).stderr)
        self.assertIn("exists already", self.object(1, "new", "mine")["reason"])
        self.assertEqual(path.read_text(), "mine")
        path.unlink()
        path.symlink_to("elsewhere.yaml")
        self.expect(1, "new", "mine")
        self.assertFalse((self.folder / "elsewhere.yaml").exists())

    def test_whole_or_not_at_all(self):
        self.assertIn("cannot write 'no/mine.yaml'", self.expect(1, "new", "no/mine").stderr)
        small = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        done = subprocess.run([KEMPE, "new", "mine"], cwd=self.folder, capture_output=True, text=True, timeout=100,
                              preexec_fn=small, restore_signals=False)
        self.assertEqual((done.returncode, list(self.folder.iterdir())), (1, []))
        self.assertIn("cannot write 'mine.yaml'", done.stderr)

    def test_elements(self):
        names = [line.split()[0] for line in self.expect(0, "new", "--elements").stdout.splitlines() if line.startswith("kempe:")]
        listed = self.object(0, "new", "--elements")["elements"]
        self.assertEqual([each["file"] for each in listed], names)
        self.assertEqual(sorted(name.removeprefix("kempe:") for name in names), sorted(path.name for path in (ROOT / "elements").iterdir()))
        for name in names:
            text = (ROOT / "elements" / name.removeprefix("kempe:")).read_text()
            self.assertEqual(self.expect(0, "show", name).stdout, text)
            self.assertEqual(self.object(0, "show", name), {"file": name, "text": text})
        self.assertIn("{P: point, Q: point}", self.expect(0, "new", "--elements").stdout)
        self.assertIn("did you mean 'kempe:gas_spring.yaml'?", self.expect(2, "show", "kempe:gas_sprin.yaml").stderr)
        self.assertIn("has no equations of its own", self.expect(3, "show", "kempe:gas_spring.yaml", "--equations").stderr)
        self.assertIn("include it there, with 'ports: {P: .., Q: ..}'", self.expect(2, "check", "kempe:gas_spring.yaml").stderr)
        self.assertIn("give one of them", self.expect(3, "new", "name", "--elements").stderr)
        start = str(ROOT / "examples/clutch_start/clutch_start.yaml")
        self.assertIn("is in Kempe's language already", self.expect(3, "show", start, "--as", "yaml").stderr)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_names(self):
        for words in ([], [""], ["."], [".."], ["folder/"], [".yaml"], ["a", "b"], ["a", "--set", "x=1"]):
            self.expect(3, "new", *words)
        self.assertEqual(list(self.folder.iterdir()), [])


class Input(Case):
    BAD = "kempe: 1\nname: bad\nbodies:\n  A:\n    joint: {name: A, revolut: z, at: ground.O}\n    mass: 1\n"

    def test_place_of_a_mistake(self):
        path = self.model(self.BAD)
        for name in ("check", "assemble", "simulate", "compare"):
            self.assertRegex(self.expect(2, name, path).stderr, r"(?m)^[^\n]*model\.yaml:5:\d+: ")

    def test_not_yaml(self):
        self.assertRegex(self.expect(2, "check", self.model("kempe: [1\n")).stderr, r"model\.yaml:\d+:\d+: ")

    def test_no_file(self):
        self.assertIn("nowhere.yaml", self.expect(2, "check", "nowhere.yaml").stderr)
        for name in (FOUR_BAR.with_suffix(""), FOUR_BAR.with_suffix(".yml")):
            self.assertEqual(self.expect(2, "check", name).stderr, f"kempe: cannot read '{name}': No such file or directory; did you mean '{FOUR_BAR}'?\n")

    def test_json_of_a_failure(self):
        for path in (self.model(self.BAD), 'no "such"\\file.yaml'):
            found = self.object(2, "check", path)
            self.assertKeys(found, "model status reason build_s")
            self.assertEqual((found["model"], found["status"]), (None, "failed"))
            self.assertNotEqual(found["reason"], "")

    def test_json_of_wrong_words(self):
        for words in (["check", FOUR_BAR, "--nonsense"], ["modes"], ["kinematics", FOUR_BAR], ["simulate", FOUR_BAR, "--rtol", "-1"],
                      ["modes", FOUR_BAR, "--svg", "x"], ["equilibrium", FOUR_BAR, "--seed", "1.5"]):
            found = self.object(3, *words)
            self.assertEqual((found["model"], found["status"], found["build_s"]), (None, "failed", None))
            self.assertNotEqual(found["reason"], "")

    def inches(self):
        return self.model("kempe: 1\nparameters: {crank: 12 in}\nbodies: {m: {joint: {name: A, revolute: z, at: ground}, "
                          "mass: 1 lb, com: [crank, 0, 0]}}\n")

    def test_units_without_a_unit_in_the_file(self):
        """A parameter that has no unit takes those with which its expressions can be read."""
        model = self.model("kempe: 1\nparameters: {crank: 0.3}\nbodies: {m: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [crank, 0, 0]}}\n")
        study = ("ensemble", model, "--t-end", "0.01", "--instances", "2", "--sample")
        self.expect(0, *study, "crank=10 in:1 ft")
        self.assertIn("expected m, got kg", self.expect(2, *study, "crank=10 lb:12 lb").stderr)
        self.assertIn("expected m, got 1/s", self.expect(2, *study, "crank=10 rpm:12 rpm").stderr)

    def test_units(self):
        """A value in another unit is refused, and so are ends of a range that do not go together."""
        governor, crank = ROOT / "examples/governor/governor.yaml", ROOT / "examples/crank_rocker/crank_rocker.yaml"
        for told, *words in (("an angle", "kinematics", crank, "--sweep", "motor=0 m:1 m"),
                             ("both ends", "kinematics", crank, "--sweep", "motor=10:30 deg"),
                             ("incompatible", "kinematics", crank, "--sweep", "motor=10 deg:3 m"),
                             ("unknown unit 'furlong'", "kinematics", crank, "--sweep", "motor=0:3 furlong"),
                             ("unknown unit 'm/'", "kinematics", crank, "--sweep", "motor=0:3 m/"),
                             ("its unit is written 'in'", "kinematics", crank, "--sweep", "motor=0:3 inch"),
                             ("did you mean 'kNm'?", "equilibrium", governor, "--rates", "shaft=5 knm"),
                             ("'crank': kg is given, but m", "ensemble", self.inches(), "--sample", "crank=1 lb:2 lb"),
                             ("'crank': kg is given, but m", "ensemble", self.inches(), "--sample", "crank=normal(12 in, 1 kg)"),
                             ("'crank': kg is given, but m", "optimize", self.inches(), "--minimize", "q(A)", "--parameter", "crank:1 lb:2 lb"),
                             ("'crank': kg is given, but m", "modes", self.inches(), "--sweep", "crank=1 lb:2 lb"),
                             ("'crank': kg is given, but m", "cycles", self.inches(), "--sweep", "crank=1 lb:2 lb"),
                             ("'q.A': m is given, but an angle", "ensemble", self.inches(), "--sample", "q.A=1 in:2 in"),
                             ("s is expected", "kinematics", crank, "--sweep", "t=0:3 m"),
                             ("rad/s", "equilibrium", governor, "--rates", "shaft=5 deg"),
                             ("m is expected", "equilibrium", governor, "--rates", "shaft=5", "--hold", "slider=5 rad", "--solve-for", "M"),
                             ("rad/s", "modes", governor, "--rates", "shaft=5 m/s"),
                             ("given twice", "modes", governor, "--rates", "shaft=5", "--at", "equilibrium shaft=5"),
                             ("without unit", "inverse", FOUR_BAR, "--actuators", "crank,rocker", "--weights", "crank=2 kg"),
                             ("the instant of the start", "inverse", FOUR_BAR, "--actuators", "crank", "--t-end", "1"),
                             ("NAME=A:B:N", "kinematics", crank, "--sweep", "motor=0:1:2.5")):
            self.assertIn(told, self.expect(3, *words).stderr)
        for rate in ("5.5", "5.5 rad/s", "5.5 rad*s^-1", "330 rad/min"):
            found = self.object(0, "equilibrium", governor, "--rates", f"shaft={rate}")
            self.assertAlmostEqual(found["qd"]["shaft"], 5.5, delta=1e-14)

    def test_bad_reference(self):
        (self.folder / "bad.csv").write_text("t,q.nobody\n0,1\n")
        self.expect(2, "simulate", ANDREWS, "--reference", "bad.csv")
        self.expect(2, "simulate", ANDREWS, "--reference", "nowhere.csv")


class Check(Case):
    def test_andrews(self):
        found = self.object(0, "check", ANDREWS)
        self.assertKeys(found, "model status reason build_s nbody nq nh rank dof redundant u v cond_Jv max_B blocks loops")
        self.assertEqual([found[k] for k in ("nbody", "nq", "nh", "rank", "dof")], [7, 7, 6, 6, 1])
        self.assertEqual(sorted(found["u"] + found["v"]), sorted(ANGLES))

    def test_slider_at_dead_centre_is_dependent(self):
        self.assertIn("slider", self.object(0, "check", SLIDER_CRANK)["v"])

    def test_text(self):
        self.assertIn("beta", self.expect(0, "check", ANDREWS).stdout)

    def test_diagnosis(self):
        found = self.object(0, "check", SLIDER_CRANK)
        self.assertKeys(found, "block_closures mobility dependent reactions_not_unique loads_not_unique repairs alternatives limits")
        self.assertKeys(found["mobility"], "dof counted generic_dof margin explanation second_order")
        self.assertAlmostEqual(found["limits"]["range"]["slider"]["low"], -0.4, delta=1e-12)
        self.assertEqual(abs(found["limits"]["range"]["crank"]["turns"]), 1)
        bennett = self.object(0, "check", ROOT / "tests/models/bennett_balls.yaml")
        self.assertEqual([d["when"] for d in bennett["dependent"]], ["always"] * 4)
        self.assertEqual({r["closure"]: r["may_lose"] for r in bennett["repairs"]}, {"B": 3, "X": 3})

    def test_one_end_of_a_range(self):
        """Along a parabola the motion does not end: its height has one dead centre, and no other end."""
        path = self.model("kempe: 1\nbodies:\n  a: {joint: {name: A, prismatic: x, at: ground}, mass: 1}\n  b: {joint: {name: B, prismatic: y, at: ground}, mass: 1}\n"
                          "loops: {c: {constraint: q(B) - q(A)^2}}\nstart: {q: {A: 0.5}}\n")
        text = self.expect(0, "check", path).stdout
        self.assertRegex(text, r"(?m)^ +B +followed from 0 to \S+ m, the (first|second) a dead centre$")
        self.assertNotIn("oscillates", text)

    def test_a_worm_ends_no_search(self):
        """Behind a worm the rotor turns sixty times in a cycle."""
        path = self.model((ROOT / "examples/four_bar/four_bar.yaml").read_text() +
                          "\ninclude: [{file: worm.yaml}]\n")
        (self.folder / "worm.yaml").write_text(
            "kempe: 1\nbodies: {rotor: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1e-3}}}\n"
            "loops: {worm: {coupler: {rotor: 1, crank: -60}}}\n")
        text = self.expect(0, "check", path).stdout
        self.assertRegex(text, r"(?m)^ +rotor +rotates fully, 60 times in a cycle$")
        self.assertRegex(text, r"(?m)^ +rocker +oscillates between ")

    def test_what_does_not_assemble(self):
        bar = "{name: %s, revolute: z, at: %s}, mass: 1, inertia: {zz: 1}, points: {E: [%s, 0, 0]}}"
        path = self.model("kempe: 1\nname: short\nground: {points: {O: [0, 0, 0], D: [3, 0, 0]}}\nbodies:\n"
                          "  a: {joint: " + bar % ("A", "ground.O", "0.5") + "\n"
                          "  b: {joint: " + bar % ("B", "a.E", "0.8") + "\n"
                          "  c: {joint: " + bar % ("C", "ground.D", "0.7") + "\n"
                          "loops: {L: {ball: [b.E, c.E]}}\nstart: {q: {A: 1, B: 1, C: 1}, hold: [A]}\n")
        done = self.expect(1, "check", path)
        self.assertIn("does not assemble", done.stdout)
        self.assertIn("the other links at most 2 m: 1 m are missing", " ".join(done.stdout.split()))
        found = self.object(1, "check", path)
        self.assertKeys(found, "status reason nbody nq nh rank dof redundant u v cond_Jv max_B blocks loops gap culprits")
        self.assertEqual((found["status"], found["dof"]), ("failed", None))


class Assemble(Case):
    def test_keys(self):
        found = self.object(0, "assemble", FOUR_BAR)
        self.assertKeys(found, "model status reason build_s q residual gap culprits")
        self.assertEqual(found["culprits"], [])
        for name in ("crank", "coupler", "rocker"):
            self.assertAlmostEqual(found["q"][name], 0, delta=1e-12)


    def test_branches(self):
        found = self.object(0, "assemble", FOUR_BAR, "--branches")
        self.assertKeys(found, "model status reason build_s kept starts closed branches")
        self.assertEqual(len(found["branches"]), 2)
        self.assertKeys(found["branches"][0], "q residual sign")
        self.assertEqual(found["branches"][0]["q"]["rocker"], 0)
        self.assertEqual({b["sign"] for b in found["branches"]}, {"+", "-"})
        other = self.object(0, "assemble", FOUR_BAR, "--branches", "--seed", "5")
        self.assertEqual(len(other["branches"]), 2)
        self.assertIn("branch 2", self.expect(0, "assemble", FOUR_BAR, "--branches").stdout)
        self.expect(3, "check", FOUR_BAR, "--branches")


class Simulate(Case):
    def test_energy_of_impacts(self):
        """A ball that falls from 1 m and rebounds with half the speed loses 3/4 of its energy each time: three impacts in 1.3 s."""
        path = self.model("kempe: 1\ngravity: [0, -10, 0]\nbodies: {ball: {joint: {name: y, prismatic: y, at: ground}, mass: 2}}\n"
                          "contacts: {floor: {joint: y, lower: 0, restitution: 0.5}}\nstart: {q: {y: 1}}\nrun: {t_end: 1.3}\n")
        text = " ".join(self.expect(0, "simulate", path).stdout.split())
        lost = 20 * (1 - 0.25**int(re.search(r"(\d) such events, together", text).group(1)))
        self.assertIn(f"together by {lost:.4g} J, the last at t = ", text)

    def test_plot_of_a_sensor(self):
        """A sensor is drawn by its own name, as a model requests it, on both axes; so is a state."""
        path = self.model("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                          "states: {heat: {rate: 1}}\nsensors: {turns: q(a)/(2*pi), half: q(a)/2}\nstart: {qd: {a: 1}}\n"
                          "run: {outputs: [q, turns, half, heat]}\n")
        self.expect(0, "simulate", path, "--plot", "own.svg", "--x", "turns", "--y", "half, heat")
        self.expect(0, "simulate", path, "--plot", "named.svg", "--x", "sensor(turns)", "--y", "sensor(half), state(heat)")
        self.assertEqual((self.folder / "own.svg").read_text(), (self.folder / "named.svg").read_text())

    SHORT = ("simulate", FOUR_BAR, "--t-end", 0.1, "--rtol", 1e-8)

    def test_threads(self):
        """The time on the wall is told where it is not that of the processor."""
        one, two = (self.object(0, *self.SHORT, *words) for words in ((), ("--threads", 2)))
        self.assertNotIn("wall_s", one)
        self.assertGreater(two["wall_s"], 0)
        self.assertEqual(without_times(one), without_times(two))
        said = self.expect(0, *self.SHORT, "--threads", 2, "--all").stdout
        self.assertRegex(said, r"cpu +\S+ ms integration of all threads, \S+ ms wall-clock time, \S+ ms preparation")

    def test_too_many_threads(self):
        said = self.expect(3, *self.SHORT, "--threads", 5000).stderr
        self.assertIn("5000 threads: 1 to 64 are possible", said)

    def test_keys(self):
        found = self.object(0, *self.SHORT)
        self.assertKeys(found, "model status reason build_s formulation form integrator rtol t q qd qdd lambda residual energy "
                               "work cpu_s")
        self.assertEqual((found["status"], found["t"], found["rtol"]), ("complete", 0.1, 1e-8))
        self.assertKeys(found["residual"], "h_max hdot_max")
        self.assertKeys(found["energy"], "drift_rel")
        self.assertKeys(found["work"], "steps rejected rhs newton factorizations exchanges")
        self.assertFalse({"impacts", "mode_changes"} & set(found["work"]))
        self.assertEqual(len(found["lambda"]["C"]), 2)
        self.assertEqual(sorted(found["q"]), ["coupler", "crank", "rocker"])

    def test_every_formulation(self):
        for formulation, integrator in (("reduced", ()), ("dae", ()), ("dae", ("--integrator", "ida")), ("projected", ())):
            found = self.object(0, *self.SHORT, "--formulation", formulation, *integrator)
            self.assertEqual(found["formulation"], formulation)
            self.assertLess(found["residual"]["h_max"], 1e-6)

    def test_chosen_integrator(self):
        """The integrator that Kempe takes by itself, and why, in both texts."""
        said = "a linear solver is given, and radau uses none"
        found = self.object(0, *self.SHORT, "--formulation", "dae", "--linear", "klu")
        self.assertEqual((found["integrator"], found["form"], found["integrator_choice"]), ("ida", "stabilized1", {"because": said}))
        self.assertIn(f"choice    integrator ida: {said}\n", self.expect(0, *self.SHORT, "--formulation", "dae", "--linear", "klu", "--all").stdout)
        found = self.object(0, *self.SHORT, "--formulation", "dae")
        lanes = found["integrator_choice"].keys() == {"because"}
        self.assertEqual((found["integrator"], found["form"]), ("radau", "index1") if lanes else ("ida", "stabilized1"))
        self.assertNotIn("integrator_choice", self.object(0, *self.SHORT, "--formulation", "dae", "--integrator", "ida"))
        self.assertIn("choose integrator 'ida'", self.expect(3, *self.SHORT, "--linear", "klu").stderr)

    def test_dynamics(self):
        for word in ("composite", "plain", "ner", "articulated"):
            found = self.object(0, *self.SHORT, "--algorithm", word)
            self.assertEqual(found["algorithm"], word)
        self.assertEqual(self.object(0, *self.SHORT)["algorithm"], "composite")
        bdf = self.object(0, *self.SHORT, "--algorithm", "articulated", "--integrator", "bdf")
        self.assertEqual(bdf["algorithm"], "composite", "its Jacobian is of M and C")
        done = self.expect(3, *self.SHORT, "--algorithm", "articulate")
        self.assertIn("did you mean 'articulated'?", done.stderr)
        shown = self.expect(0, "show", FOUR_BAR, "--program", "--algorithm", "articulated").stdout
        self.assertIn("qdd, lambda", shown)

    def test_change_points(self):
        text = "change points ignored"
        words = lambda *options: " ".join(self.expect(0, *self.SHORT, *options).stdout.split())
        self.assertIn(text, words("--change-points", "ignore"))
        self.assertNotIn(text, words())
        self.assertEqual(self.object(0, *self.SHORT)["change_points"], "cross")
        self.assertEqual(self.object(0, *self.SHORT, "--change-points", "ignore")["change_points"], "ignore")
        done = self.expect(3, *self.SHORT, "--change-points", "ignored")
        self.assertIn("unknown value of change_points 'ignored'", done.stderr)
        model = self.folder / "ignoring.yaml"
        model.write_text("kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground}, inertia: {zz: 1}}\n"
                         "run: {t_end: 0.1, change_points: ignore}\n")
        self.assertEqual(self.object(0, "simulate", model)["change_points"], "ignore")
        self.assertEqual(self.object(0, "simulate", model, "--change-points", "cross")["change_points"], "cross")
        self.assertIn("change_points ignore", self.expect(0, "show", model, "--model").stdout)

    def test_too_many_rows(self):
        """One rule and one sentence, whether the file or the command line asks for too many."""
        head = "kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground}, inertia: {zz: 1}}\n"
        said = "output_step = 1e-12 s gives 1e+12 rows up to t_end = 1 s, but at most 1000000 are stored; use a larger step"
        plain = self.model(head + "run: {t_end: 1}\n")
        self.assertEqual(self.expect(3, "simulate", plain, "--output-step", "1e-12").stderr, f"kempe: {said}\n")
        path = self.model(head + "run: {t_end: 1, output_step: 1e-12}\n")
        for command in ("check", "simulate", "sensitivity"):
            self.assertEqual(self.expect(2, command, path).stderr, f"{path}:4:30: {said}\n")
        path = self.model(head + "run: {t_end: 1 ms, output_step: 1 us}\n")
        self.expect(0, "simulate", path)
        long = self.expect(2, "simulate", path, "--t-end", "10").stderr
        self.assertEqual(long, f"{path}:4:33: {said.replace('1e-12', '1e-06').replace('1e+12', '1e+07').replace('= 1 s', '= 10 s')}\n")

    def test_csv(self):
        self.expect(0, *self.SHORT, "--output-step", 0.05, "-o", "out.csv")
        with open(self.folder / "out.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.expect(0, *self.SHORT, "--output-step", 0.05, "--units", "-o", "units.csv")
        named = (self.folder / "units.csv").read_text()
        os.remove(self.folder / "units.csv")
        self.assertTrue(named.startswith("t [s],q.crank [rad],"), named)
        self.assertEqual(re.sub(r" \[[^]]*\]", "", named), (self.folder / "out.csv").read_text())
        self.assertEqual([float(row["t"]) for row in rows], [0, 0.05, 0.1])
        self.assertKeys(rows[0], "t q.crank qd.crank lambda.C.1 lambda.C.2")
        self.assertEqual(os.listdir(self.folder), ["out.csv"], "no temporary may stay")

    def test_csv_that_cannot_be_written(self):
        self.expect(1, *self.SHORT, "-o", "no_such_folder/out.csv")
        self.assertEqual(os.listdir(self.folder), [])

    def test_no_file_that_is_read_is_written(self):
        part = "{kempe: 1, bodies: {rod: {mass: 1, inertia: {zz: 1}, joint: {revolute: z, at: ground}, com: [1, 0, 0]}}}\n"
        (self.folder / "part.yaml").write_text(part)
        whole = "kempe: 1\ninclude: [{file: part.yaml}]\nrun: {t_end: 0.1}\n"
        (self.folder / "data.csv").write_text("t,q.rod\n0,0\n0.1,0\n")
        path = self.model(whole)
        os.symlink("part.yaml", self.folder / "link.json")
        for words in (("--json", "model.yaml"), ("--json", "./model.yaml"), ("--json", "link.json"), ("--bogus", "--json", "model.yaml"),
                      ("--json", "part.yaml"), ("--reference", "data.csv", "-o", "data.csv"), ("-o", "a.json", "--json", "a.json")):
            self.expect(3, "simulate", path, *words)
            self.assertEqual([path.read_text(), (self.folder / "part.yaml").read_text(), os.path.exists(self.folder / "a.json")], [whole, part, False])
        self.expect(3, "show", path, "--json", "model.yaml")
        self.assertEqual(path.read_text(), whole)
        self.expect(0, "simulate", path, "--checkpoint", "run.checkpoint")
        self.expect(0, "simulate", path, "--t-end", "0.2", "--resume", "run.checkpoint", "--checkpoint", "run.checkpoint")

    def test_json_file(self):
        done = self.expect(0, *self.SHORT, "--json", "out.json")
        self.assertNotEqual(done.stdout, "")
        self.assertEqual(strict((self.folder / "out.json").read_text())["status"], "complete")

    def test_reference(self):
        found = self.object(0, "simulate", ANDREWS, "--rtol", 1e-8, "--reference", REFERENCE)
        self.assertLess(abs(found["q"]["beta"] - 15.810771195153707), 1e-4)

    def test_same_bytes_twice(self):
        first, second = (self.object(0, *self.SHORT) for _ in range(2))
        self.assertEqual(json.dumps(without_times(first)), json.dumps(without_times(second)))

    def test_same_table_twice(self):
        for name in ("a.csv", "b.csv"):
            self.expect(0, *self.SHORT, "-o", name)
        self.assertEqual((self.folder / "a.csv").read_bytes(), (self.folder / "b.csv").read_bytes())

    def test_a_run_not_to_be_trusted(self):
        pendulum = ROOT / "tests/models/pendulum.yaml"
        for rtol, integrator, told in (("0.1", "bdf", True), ("1e-9", "dop853", False)):
            done = kempe("simulate", pendulum, "--form", "newton", "--integrator", integrator, "--rtol", rtol)
            self.assertEqual(done.returncode, 5 if told else 0, done.stderr)
            self.assertEqual("the energy error is" in done.stderr, told)

    def test_rates_that_cannot_be_kept_are_told(self):
        """By each command that starts from the model's state, in the log and in its object, with both values."""
        path = self.model(FOUR_BAR.read_text().replace("qd: {crank: 20}", "qd: {crank: 20, rocker: 3}"))
        for words in ("assemble", "check", "equilibrium", "modes", "linearize", "simulate --t-end 0.1",
                      "kinematics --sweep crank=0:1", "sensitivity --parameters crank --t-end 0.1",
                      "inverse --actuators crank --independent crank", "compare --formulations reduced --t-end 0.1",
                      "response --inputs effort(crank) --outputs q(crank)"):
            command, *more = words.split()
            done = self.expect(0, command, path, *more, "--json", "-")
            for line in strict(done.stdout)["warnings"]:
                self.assertIn(f"kempe: warning: {line}\n", done.stderr, words)
            for name, given, taken in (("crank", "20", "8.92286"), ("rocker", "3", "3.45649")):
                line = (f"start: the rate of '{name}' is adjusted to {taken} rad/s (given: {given}) "
                        "to satisfy the closures")
                self.assertIn(line, strict(done.stdout)["warnings"], words)
                self.assertEqual(done.stderr.count(line), 1, words)
        found = self.object(0, "ensemble", path, "--sample", "crank=0.29:0.31", "--instances", 3, "--t-end", 0.1)
        self.assertIn("in 3 of 3 instances", "".join(found["warnings"]))
        changed = self.object(0, "assemble", path)["rates_changed"]
        self.assertEqual({name: rate["given"] for name, rate in changed.items()}, {"crank": 20, "rocker": 3})

    def test_rates_that_agree_are_kept_in_silence(self):
        for rates in ("{crank: 20}", "{rocker: 1}", "{}"):
            path = self.model(FOUR_BAR.read_text().replace("qd: {crank: 20}", f"qd: {rates}"))
            done = self.expect(0, "assemble", path, "--json", "-")
            self.assertEqual((strict(done.stdout)["warnings"], strict(done.stdout)["rates_changed"], done.stderr),
                             ([], {}, ""))
        driven = self.expect(0, "assemble", ROOT / "examples/driven_slider_crank/driven_slider_crank.yaml")
        self.assertNotIn("contradict", driven.stdout + driven.stderr)

    def test_rates_left_out_are_the_smallest(self):
        """A five-bar with one rate of two given: the sum of squares of the others is least along the closures."""
        path = ROOT / "examples/parallel_robot/parallel_robot.yaml"
        text = path.read_text()
        given, less = (self.object(0, "assemble", self.model(text.replace("qd: {a1: 3, b1: 1}", f"qd: {rates}")))["qd"]
                       for rates in ("{a1: 3, b1: 1}", "{a1: 3}"))
        other = self.object(0, "assemble", self.model(text.replace("qd: {a1: 3, b1: 1}", "qd: {b1: 1, a1: 0}")))["qd"]
        self.assertEqual(less["a1"], 3)
        names = [name for name in less if name != "a1"]
        # along the free direction with a1 kept, the sum of squares does not fall
        slope = sum(less[name] * other[name] for name in names)
        size = sum(less[name] ** 2 for name in names)
        self.assertLess(abs(slope), 1e-9 * size)
        self.assertLess(size, sum(given[name] ** 2 for name in names))

    PINNED = """kempe: 1
bodies:
  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0]}}
  b: {joint: {revolute: z, at: a.P}, mass: 1, inertia: {zz: 1}, points: {Q: [1, 0, 0]}}
ground: {points: {R: [1.5, 0.5, 0]}}
loops: {c: {ball: [b.Q, ground.R]}}
start: {q: {a: 60 deg, b: -90 deg}}
run: {t_end: 1}
"""

    def test_nothing_moves(self):
        """Neither checked nor run without a word; a mechanism that is fully driven is no such thing."""
        path = self.model(self.PINNED)
        self.assertIn(": cannot move, 0 degrees of freedom\n", self.expect(0, "check", path).stdout)
        self.assertIn("the mechanism cannot move: it has no degree of freedom", self.expect(0, "simulate", path).stdout)
        self.assertEqual(self.object(0, "simulate", path)["log"][0]["kind"], "rest")
        driven = ROOT / "examples/driven_slider_crank/driven_slider_crank.yaml"
        self.assertIn(": all motion is prescribed, 1 degree of freedom, driven by 'motor'\n",
                      self.expect(0, "check", driven).stdout)
        found = self.object(0, "check", driven)
        self.assertEqual((found["dof"], found["driven"]), (0, 1))
        self.assertEqual(self.object(0, "check", ROOT / "examples/ride/ride.yaml")["driven"], 1)
        self.assertEqual(self.object(0, "check", FOUR_BAR)["driven"], 0)
        self.assertNotIn("nothing", self.expect(0, "simulate", driven, "--t-end", 0.1).stderr)

    def test_a_structure_with_redundant_rows_runs(self):
        """Mobility 0, with rows that are redundant: assembled, run, and said to stand still."""
        found = self.expect(0, "simulate", ROOT / "tests/models/rounded_and_fixed.yaml")
        self.assertIn("the mechanism cannot move: it has no degree of freedom", found.stdout)

    def test_motion_without_mass_is_foreseen(self):
        path = self.model("kempe: 1\nbodies:\n  s: {joint: {cylindrical: z, at: ground}, inertia: {zz: 1}}\n"
                          "run: {t_end: 1}\n")
        why = "the accelerations are not determined: the motion of 's.1' moves no mass"
        done = self.expect(0, "check", path)
        self.assertIn(f"no run is possible {why}", " ".join(done.stdout.split()))
        self.assertIn(f"kempe: warning: {why}", done.stderr)
        self.assertIn(why, self.object(0, "check", path)["undetermined"])
        self.assertIn(why, self.expect(1, "simulate", path).stderr)
        self.assertIsNone(self.object(0, "check", FOUR_BAR)["undetermined"])

    def test_what_is_not_finite_is_named(self):
        pendulum = ("kempe: 1\nbodies:\n  a: {{joint: {{revolute: z, at: ground}}, mass: 1, inertia: {{zz: 1}}}}\n"
                    "forces: {{bad: {{joint: a, torque: '{}'}}}}\nrun: {{t_end: 1}}\n")
        for torque in ("1/q(a)", "sqrt(q(a) - 1)", "log(q(a))"):
            for words in (("reduced",), ("projected",), ("dae",), ("dae", "--integrator", "ida")):
                done = self.expect(1, "simulate", self.model(pendulum.format(torque)), "--formulation", *words)
                self.assertRegex(done.stderr, r"the forces on 'a' are not a finite number \((infinite|not a number)\) at t = 0 s; "
                                              "forces on it: 'bad'")

    def test_rows_in_time_alone(self):
        done = self.expect(2, "check", self.model(
            "kempe: 1\nground: {points: {P: [0, 0, 0]}}\nbodies:\n"
            "  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {Q: [0, 0, 0]}}\n"
            "loops: {c: {constraint: 'sin(t)'}}\n"))
        self.assertNotIn("stays at", done.stderr)
        self.assertIn("depends on t only", done.stderr)

    def test_an_empty_name(self):
        done = self.expect(2, "check", self.model("kempe: 1\nname: ''\nbodies: {}\n"))
        self.assertIn("must be a word, not an empty one", done.stderr)

    BARS = ("kempe: 1\nground: {points: {A: [0, 0, 0], D: [1, 0, 0]}}\ngravity: [0, -9.81, 0]\nbodies:\n"
            "  a: {joint: {name: A, revolute: z, at: ground.A}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.03}, points: {B: [CRANK, 0, 0]}}\n"
            "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.04}, points: {C: [0.9, 0, 0]}}\n"
            "  d: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.03}, points: {C: [0.6, 0, 0]}}\n"
            "loops: {C: {ball: [b.C, d.C]}}\nstart: {q: {A: 80 deg, B: -60 deg, D: 110 deg}, hold: [A], qd: {A: 5}}\n"
            "run: {t_end: 4, output_step: 20 ms}\n")

    def test_changes_of_the_assembly_mode(self):
        """Coupler and rocker in line end one mode of the crank's angle: they are in line as often as it is said, and never
        in a crank-rocker."""
        for crank, some in (("0.6", True), ("0.2", False)):
            found = self.object(0, "simulate", self.model(self.BARS.replace("CRANK", crank)), "-o", "bars.csv", "--no-convergence-check")
            with open(self.folder / "bars.csv") as file:
                rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
            side = [math.sin(row["q.A"] + row["q.B"] - row["q.D"]) > 0 for row in rows]
            self.assertEqual(found["mode_changes"], sum(a != b for a, b in zip(side, side[1:])))
            self.assertEqual(found["mode_changes"] > 0, some)
            said = self.expect(0, "simulate", "model.yaml", "--no-convergence-check").stdout
            first = next((k for k, (a, b) in enumerate(zip(side, side[1:])) if a != b), None)
            self.assertEqual("reaches another assembly mode at the same 'A'" in said, some)
            if some:
                self.assertIn(f"between t = {rows[first]['t']:.6g} and {rows[first + 1]['t']:.6g} s", said)

    def test_assembly_modes_that_are_not_watched(self):
        """No number stands for what is not known: a body that no loop holds, no held coordinate."""
        plain = self.BARS.replace("CRANK", "0.6")
        known = self.object(0, "simulate", self.model(plain), "--no-convergence-check")["mode_changes"]
        model = plain.replace("loops:", "  e: {joint: {name: E, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\nloops:")
        for hold, changes in (("[A, E]", known), ("[A]", None), ("[]", None)):
            self.assertEqual(self.object(0, "simulate", self.model(model.replace("hold: [A]", f"hold: {hold}")), "--no-convergence-check")["mode_changes"], changes)

    def test_what_counts_from_the_start_as_written(self):
        """A rope without a length in a linkage whose guess is not closed: the warning has the slack that the first row shows, and the same
        start, closed, has none. Teeth with play likewise."""
        bars = self.BARS.replace("CRANK", "0.6").replace("loops:", "ropes: {r: {along: [ground.D, b.C], stiffness: 1000, preload: 5}}\nsensors: {slack: free_length(r) - length(r)}\nloops:")
        bars = bars.replace("t_end: 4, output_step: 20 ms", "t_end: 0.02, outputs: [q, tension(r), slack]")
        said = self.expect(0, "simulate", self.model(bars), "-o", "bars.csv").stderr
        with open(self.folder / "bars.csv") as file:
            first = next(csv.DictReader(file))
        found = re.search(r"'r' counts from the start as it is written, and closing the loops changes its gap by ([-+.e0-9]+) m", said)
        self.assertAlmostEqual(float(found[1]), float(first["sensor.slack"]) + 5 / 1000, 4)
        self.assertIn("'r' counts from the start", self.object(0, "assemble", "model.yaml")["warnings"][0])
        closed = bars.replace("A: 80 deg, B: -60 deg, D: 110 deg", ", ".join(f"{k}: {first['q.' + k]}" for k in "ABD"))
        self.assertEqual(self.expect(0, "simulate", self.model(closed), "-o", "bars.csv").stderr, "")
        with open(self.folder / "bars.csv") as file:
            self.assertAlmostEqual(float(next(csv.DictReader(file))["tension.r"]), 5, 6)
        # instances with another base, whose guess is not closed, and one that has another mass only
        other = closed.replace("kempe: 1", "kempe: 1\nparameters: {base: 1, m: 1}").replace("D: [1, 0, 0]", "D: [base, 0, 0]").replace("mass: 1,", "mass: m,", 1)
        self.assertIn("m,", other)
        for name, changed in (("base", True), ("m", False)):
            for more in ((), ("--alone",)):
                said = self.expect(0, "ensemble", self.model(other), "--sample", f"{name}=1.001:1.002", "--instances", "3", "-o", "ends.csv", *more).stderr
                self.assertEqual("closing the loops changes the slack of ropes, or the play of teeth, in 3 of 3 instances, first in instance 1" in said, changed)
                with open(self.folder / "ends.csv") as file:
                    self.assertEqual({row["start"] for row in csv.DictReader(file)}, {"lengths changed" if changed else ""})
        for more in ("stiffness: 1e6", "restitution: 0.5"):
            gears = bars[:bars.index("ropes:")] + f"gears: {{m: {{between: [A, D], teeth: [20, 30], backlash: 900 mm, {more}}}}}\n" + bars[bars.index("loops:"):]
            gears = gears.replace(", tension(r), slack", "")
            said = self.expect(0, "simulate", self.model(gears)).stderr
            self.assertIn("'m_front' counts from the start", said)
            self.assertIn("'m_back' counts from the start", said)

    def test_assembly_modes_of_a_rod_that_changes_its_length(self):
        model = self.model("kempe: 1\nground: {points: {D: [1, 0, 0]}}\ngravity: [0, -9.81, 0]\nbodies:\n"
                           "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {B: [0.6, 0, 0]}}\n"
                           "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.04}, points: {C: [0.9, 0, 0]}}\n"
                           "loops: {C: {rod: [b.C, ground.D], length: 0.6 + 0.1*sin(2*t)}}\n"
                           "start: {q: {A: 80 deg, B: -60 deg}, hold: [A], qd: {A: 5}}\nrun: {t_end: 4, output_step: 20 ms}\n")
        found = self.object(0, "simulate", model, "-o", "rod.csv", "--no-convergence-check")
        with open(self.folder / "rod.csv") as file:
            rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
        def side(a, b):
            along, across = 0.9*math.cos(a + b), 0.9*math.sin(a + b)
            return along*(0.6*math.sin(a) + across) - across*(0.6*math.cos(a) + along - 1) > 0
        sides = [side(row["q.A"], row["q.B"]) for row in rows]
        self.assertEqual(found["mode_changes"], sum(a != b for a, b in zip(sides, sides[1:])))
        self.assertGreater(found["mode_changes"], 2)

    def test_redundant_rows_and_assembly_modes(self):
        """Bennett's linkage turns in one mode (tan(j1/2) tan(j2/2) is constant), whichever of its redundant rows are taken."""
        for name in ("bennett_balls", "bennett_hinge"):
            found = self.object(0, "simulate", str(ROOT / f"tests/models/{name}.yaml"), "--no-convergence-check")
            self.assertGreater(found["work"]["exchanges"], 3)
            self.assertEqual(found["mode_changes"], 0)

    SCISSORS = ("kempe: 1\nparameters: {F: 10 N}\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  a: {mass: 10, com: [0.5, 0, 0], inertia: {zz: 1}, points: {low: [0, 0, 0], mid: [0.5, 0, 0]}}\n"
                "  b: {mass: 10, com: [0.5, 0, 0], inertia: {zz: 1}, points: {low: [0, 0, 0], mid: [0.5, 0, 0]}}\n"
                "  roller: {mass: 1, inertia: {zz: 1e-3}, points: {axle: [0, 0, 0]}}\njoints:\n"
                "  P: {revolute: [ground.O, a.low]}\n  S: {prismatic: [ground.O, roller.axle], axis: x}\n"
                "  R: {revolute: [roller.axle, b.low]}\n  M: {revolute: [a.mid, b.mid]}\n"
                "forces: {jack: {joint: S, force: -F}}\nstart: {q: {P: SIDE, S: 0.8 m, M: OTHER}}\nrun: {t_end: 0.2}\n")

    def test_a_held_equilibrium_keeps_the_assembly_mode(self):
        """Scissors of 1 m at a width of 0.8 m: by virtual work F = m g w / h at the height h = sqrt(1 - w^2), on the side of the start."""
        for sign in (1, -1):
            text = self.SCISSORS.replace("SIDE", f"{sign * 36.87} deg").replace("OTHER", f"{sign * 106.26} deg")
            for given in (10, 130.8, -130.8):
                found = self.object(0, "equilibrium", self.model(text), "--hold", "S=0.8", "--solve-for", "F", "--set", f"F={given}")
                self.assertAlmostEqual(found["free"]["F"], sign * 130.8, places=8)
            one = self.object(0, "equilibrium", "model.yaml", "--hold", "S=0.4", "--solve-for", "F")
            self.assertAlmostEqual(one["free"]["F"], sign * 98.1 * 0.4 / math.sqrt(1 - 0.4 ** 2), places=8)

    def test_the_range_of_a_mechanism_of_five_coordinates(self):
        """A six-bar's short diagnosis names the links that turn; the ranges are under --all."""
        text = self.expect(0, "check", SIX_BAR).stdout
        self.assertRegex(text, r"range of motion +closed cycle: O, A rotate fully; D, P, E oscillate; ranges: --all\n")
        whole = self.expect(0, "check", SIX_BAR, "--all").stdout
        for name, word in {"O": "rotates fully", "A": "rotates fully", "D": "oscillates", "P": "oscillates", "E": "oscillates"}.items():
            self.assertRegex(whole, rf"\n +{name} +{word}")

    FIVE_BAR = ("kempe: 1\nground: {points: {O: [0, 0, 0], A: [-0.1, 0, 0], B: [0.1, 0, 0]}}\nbodies:\n"
                "  left: {mass: 1, inertia: {zz: 0.004}, points: {A: [0, 0, 0], E: [0.2, 0, 0]}}\n"
                "  right: {mass: 1, inertia: {zz: 0.004}, points: {B: [0, 0, 0], F: [0.2, 0, 0]}}\n"
                "  rod: {mass: 1, inertia: {zz: 0.004}, points: {E: [0, 0, 0], T: [0.3, 0, 0]}}\n"
                "  tool: {mass: 1, inertia: {zz: 0.004}, points: {F: [0, 0, 0], T: [0.3, 0, 0]}}\n"
                "joints:\n  A: {revolute: [ground.A, left.A]}\n  B: {revolute: [ground.B, right.B]}\n"
                "  E: {revolute: [left.E, rod.E]}\n  F: {revolute: [right.F, tool.F]}\n  T: {revolute: [rod.T, tool.T]}\n"
                "  path: {planar: [ground.O, tool.T], coordinates: [x, y, turn]}\nMORE"
                "start: {q: {A: 130 deg, B: 50 deg, E: -75 deg, F: 75 deg}}\nrun: {t_end: 0.1, outputs: [q]}\n")

    def test_named_coordinates_keep_their_joint(self):
        """A drive, a force, a held value or an expression of a coordinate with its own name keeps the joint in the tree."""
        for more in ("drives: {p: {joint: x, displacement: 0.01*t}}\n", "forces: {f: {joint: y, force: 3}}\n",
                     "forces: {f: {joint: A, torque: 3*q(y)}}\n"):
            found = self.object(0, "check", self.model(self.FIVE_BAR.replace("MORE", more)))
            self.assertEqual([cut["joint"] for cut in found["cuts"]].count("path"), 0, more)
        held = self.object(0, "assemble", self.model(self.FIVE_BAR.replace("MORE", "").replace("start: {", "start: {hold: [y], ").replace("A: 130", "y: 0.38, A: 130")))
        self.assertAlmostEqual(held["q"]["y"], 0.38, places=12)
        cut = self.object(0, "check", self.model(self.FIVE_BAR.replace("MORE", "")))
        self.assertEqual([one["joint"] for one in cut["cuts"]].count("path"), 1)

    def test_a_motion_of_a_cut_joint(self):
        """Columns of a cut joint prescribe no motion: the message names the joint and the remedy, which works."""
        self.model(self.FIVE_BAR.replace("MORE", ""))
        rows = [(0.1 * k, 0.01 * (0.1 * k) ** 2, 0.38) for k in range(11)]
        for head, extra, word in (("t,q.x,q.y", (), r"only columns of joint 'path' have positions, and it is cut: write 'cut: no'"),
                                  ("t,q.x,q.y,q.A", (2.2,), r"do not determine all others: .*; the columns of joint 'path' do not count")):
            (self.folder / "path.csv").write_text("\n".join([head, *(",".join(map(str, (*row, *extra))) for row in rows)]) + "\n")
            done = kempe("inverse", "model.yaml", "--motion", "path.csv", "--actuators", "A,B", cwd=self.folder)
            self.assertIn(done.returncode, (1, 2))
            self.assertRegex(done.stderr, word)
        self.model(self.FIVE_BAR.replace("MORE", "").replace("coordinates: [x, y, turn]", "coordinates: [x, y, turn], cut: no"))
        (self.folder / "path.csv").write_text("\n".join(["t,q.x,q.y", *(",".join(map(str, row)) for row in rows)]) + "\n")
        found = self.object(0, "inverse", "model.yaml", "--motion", "path.csv", "--actuators", "A,B", "--no-convergence-check")
        self.assertEqual(found["rank"], 2)

    def test_statistics_show_small_differences(self):
        """The ends of the interval of a mean differ in the text, also where values differ by 1e-6 of their size."""
        text = self.expect(0, "ensemble", FOUR_BAR, "--sample", "base=0.9:0.9000002", "--instances", "200", "--t-end", "0.01",
                           "--quantity", "b=base").stdout
        mean, low, high = map(float, re.search(r"mean +(\S+) \((\S+) to (\S+)\)", text).groups())
        self.assertTrue(low < mean < high, text)
        quantiles = [float(x) for x in re.search(r"quantiles 5 % (\S+), 50 % (\S+), 95 % (\S+)\n", text).groups()]
        self.assertEqual(len(set(quantiles)), 3, text)

    def test_outputs_at_an_equilibrium(self):
        """A mass on two springs, of which one is solved for, and a block that friction holds beside its balance."""
        self.model("kempe: 1\ngravity: [0, -10, 0]\nparameters: {k: 100 N/m}\n"
                   "bodies: {m: {joint: {name: y, prismatic: y, at: ground}, mass: 3, points: {P: [0, 2, 0]}},\n"
                   "  b: {joint: {name: s, prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {a: {joint: y, spring: {stiffness: k}}, c: {joint: y, force: 200*(0.1 - q(y))},\n"
                   "  pull: {joint: s, force: 3}, rub: {joint: s, friction: {force: 4}}}\n"
                   "sensors: {ten: 10*q(y)}\nrun: {t_end: 1, outputs: [q, force(a), force(c), position(m.P), ten, force(rub)]}\n")
        found = self.object(0, "equilibrium", "model.yaml", "--stick")["outputs"]
        y = -10 / 300
        for name, value in {"force(a)": -100 * y, "force(c)": 200 * (0.1 - y), "sensor(ten)": 10 * y, "force(rub)": -3}.items():
            self.assertAlmostEqual(found[name], value, places=9, msg=name)
        self.assertAlmostEqual(found["position(m.P)"][1], 2 + y, places=9)
        text = self.expect(0, "equilibrium", "model.yaml", "--stick", "--hold", "y=-20 mm", "--solve-for", "k").stdout
        self.assertRegex(text, r"\n  force\(a\)  6 N\n  force\(c\)  24 N\n  position\(m.P\)  x 0  y 1.98  z 0 m\n")
        found = self.object(0, "equilibrium", "model.yaml", "--stick", "--target", "force(a)=6", "--solve-for", "k")
        self.assertAlmostEqual(found["outputs"]["force(c)"], 24, places=9)
        self.assertAlmostEqual(found["free"]["k"], 300, places=6)

    def test_a_motion_that_explodes_ends_soon(self):
        """A negative damper: the amplitude is exp(2.5 t). A state of the same growth is left alone."""
        text = """
            kempe: 1
            states: {s: {start: 1, rate: "3*s"}}
            bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}
            forces: {f: {joint: x, force: "GAIN*qd(x) - 1e6*q(x) + 1e-9*s"}}
            start: {q: {x: 0.01}}
            run: {t_end: T_END, integrator: bdf}
            """
        found = self.object(1, "simulate", self.model(text.replace("GAIN", "5").replace("T_END", "100")))
        self.assertRegex(found["reason"], r"grows without end: at t = \S+ s 'x' has a rate of \S+ m/s")
        self.assertLess(found["work"]["steps"], 1e6)
        self.object(0, "simulate", self.model(text.replace("GAIN", "-2").replace("T_END", "4")), "--no-convergence-check")

    def test_samples_of_inputs_in_simulators(self):
        """Exported code keeps the first value of an input with samples, and says so; equations have none, and constants no samples."""
        model = self.model("kempe: 1\ninputs: {u: {t: [0, 0.7], value: [1, 3], method: hold}, v: {default: 2}}\n"
                           "bodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}\nforces: {f: {joint: X, force: u + v}}\nrun: {t_end: 1}\n")
        said = self.expect(0, "generate", model, "--lang", "c", "--simulator", "-o", self.folder).stderr
        self.assertEqual(re.findall("input '(.)': a generated simulator does not have its samples", said), ["u"])
        self.assertEqual(self.expect(0, "generate", model, "--lang", "c", "-o", self.folder).stderr, "")

    def test_pulses_of_parameters_in_simulators(self):
        """The longest step of exported code belongs to the present parameters: functions of time whose pulses depend on them are named."""
        for law, named in (("exp(-((t - 2)/w)^2)", ["f"]), ("exp(-((t - 2)/0.1)^2)*w", []), ("w*sin(t)", [])):
            model = self.model("kempe: 1\nparameters: {w: 0.1}\nbodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}\n"
                               f"forces: {{f: {{joint: X, force: '{law}'}}}}\nrun: {{t_end: 4}}\n")
            said = self.expect(0, "generate", model, "--lang", "c", "--simulator", "-o", self.folder).stderr
            self.assertEqual(re.findall("'(.)': a generated simulator finds pulses", said), named)

    def test_pulses_in_lanes_and_simulators(self):
        """The impulse of a pulse of 10 ms in a run of 10 s is the root of pi, wherever it is; a simulator has a longest step."""
        text = """
            kempe: 1
            name: pulse
            parameters: {c: 5.0123, w: 0.01}
            bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}
            forces: {f: {joint: x, force: "exp(-((t - c)/w)^2)/w"}}
            run: {t_end: 10}
            """
        path = self.model(text)
        found = self.object(0, "ensemble", path, "--sample", "c=2:8", "--instances", 20, "--quantity", "end=qd(x)")
        for instance in found["instances"]:
            self.assertAlmostEqual(instance["qd"][0], math.sqrt(math.pi), places=6)
        self.expect(0, "generate", path, "--lang", "c", "--simulator", "-o", self.folder)
        longest = re.search(r"\.longest = ([0-9.e-]+)", (self.folder / "pulse_simulator.c").read_text())
        self.assertLess(float(longest[1]), 0.02)

    def test_a_full_film_has_an_unstable_equilibrium(self):
        """Sommerfeld: W = 12 pi eta w R L (R/c)^2 e/((2 + e^2) sqrt(1 - e^2)) for a long bearing whose film is complete."""
        for rate in (100, 900):
            found = self.object(0, "equilibrium", ROOT / "tests/models/full_film_rotor.yaml", "--set", f"w={rate}")
            self.assertFalse(found["stable"])
            e = found["q"]["B_x"] / 1e-4
            load = 12 * math.pi * 0.03 * rate * 0.02 * 0.015 * (0.02 / 1e-4) ** 2 * e / ((2 + e * e) * math.sqrt(1 - e * e))
            self.assertAlmostEqual(load, 3 * 9.81, places=6)

    @staticmethod
    def legs(count, start):
        """Legs of six bars (Jansen's lengths) on one crank, each of which closes alone from angles of zero."""
        pins = ", ".join(f"c{k}: [{15 * math.cos(math.pi * k / 6)!r}, {15 * math.sin(math.pi * k / 6)!r}, 0]" for k in range(count))
        rest, loops = "mass: 1, inertia: {zz: 1}, points:", []
        text = ("kempe: 1\nground: {points: {O: [0, 0, 0], P: [-38, -7.8, 0]}}\nbodies:\n"
                f"  crank: {{joint: {{revolute: z, at: ground.O}}, {rest} {{{pins}}}}}\n")
        for k in range(count):
            for name, at, points in (("j", f"crank.c{k}", "X: [50, 0, 0]"), ("k", f"crank.c{k}", "Y: [61.9, 0, 0]"),
                                     ("b", "ground.P", "X: [41.5, 0, 0], Z: [2.60987951807, 40.0149788067, 0]"),
                                     ("c", "ground.P", "Y: [39.3, 0, 0]"), ("f", f"b{k}.Z", "W: [39.4, 0, 0]"),
                                     ("g", f"c{k}.Y", "W: [36.7, 0, 0]")):
                text += f"  {name}{k}: {{joint: {{revolute: z, at: {at}}}, {rest} {{{points}}}}}\n"
            loops += [f"x{k}: {{ball: [j{k}.X, b{k}.X]}}", f"y{k}: {{ball: [k{k}.Y, c{k}.Y]}}", f"w{k}: {{ball: [f{k}.W, g{k}.W]}}"]
        return text + "loops: {" + ", ".join(loops) + f"}}\nstart: {start}\nrun: {{t_end: 1}}\n"

    def test_independent_loops_close_one_by_one(self):
        for start in ("{q: {crank: 0}, hold: [crank]}", "{q: {crank: 200 deg}, hold: [crank]}", "{q: {crank: 0}}"):
            found = self.object(0, "assemble", self.model(self.legs(12, start)))
            self.assertLess(found["residual"], 1e-12)
        # One impossible leg among the others is the only one that is named.
        text = self.legs(6, "{q: {crank: 0}, hold: [crank]}").replace("g3: {joint: {revolute: z, at: c3.Y}, mass: 1, inertia: {zz: 1}, points: {W: [36.7,",
                                                                     "g3: {joint: {revolute: z, at: c3.Y}, mass: 1, inertia: {zz: 1}, points: {W: [400,")
        done = self.expect(1, "assemble", self.model(text))
        self.assertIn("loop 'w3' cannot be closed", done.stderr)
        for other in ("'w2'", "'x1'", "'y5'"):
            self.assertNotIn(other, done.stderr)

    def test_a_far_guess_is_told(self):
        bars = self.BARS.replace("CRANK", "0.2")
        self.assertNotIn("from its guess", self.expect(0, "assemble", self.model(bars)).stderr)
        far = self.expect(0, "assemble", self.model(bars.replace("B: -60 deg, D: 110 deg", "B: 160 deg, D: 110 deg"))).stderr
        self.assertRegex(far, r"closing the loops moves '[BD]' by \d+(\.\d+)? deg from its guess")

    def test_other_far_guesses_are_told(self):
        """Slides in lengths of the mechanism, balls by their rotation; loops without a start that a search has closed."""
        slide = self.model("kempe: 1\nground: {points: {A: [0, 0, 0]}}\nbodies:\n"
                           "  crank: {joint: {name: A, revolute: z, at: ground.A}, mass: 1, inertia: {zz: 1}, points: {B: [0.3, 0, 0]}}\n"
                           "  slider: {joint: {name: P, prismatic: x, at: ground.A}, mass: 1, points: {C: [0, 0, 0]}}\n"
                           "loops: {rod: {rod: [crank.B, slider.C], length: 0.8}}\n"
                           "start: {q: {A: 0, P: START}, hold: [A]}\n")
        text = slide.read_text()
        for start, told in (("1.05", False), ("1.6", False), ("3.1", True)): # closed at 1.1
            slide.write_text(text.replace("START", start))
            self.assertEqual("closing the loops moves 'P' by 2 m from its guess" in self.expect(0, "assemble", slide).stderr, told)
            self.assertEqual(len(self.object(0, "assemble", slide)["warnings"]), told)
        ball = self.model("kempe: 1\nground: {points: {W: [-0.8, 0.6, 0]}}\nbodies:\n"
                          "  rod: {joint: {name: S, spherical: x, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {T: [1, 0, 0]}}\n"
                          "loops: {b: {ball: [ground.W, rod.T]}}\nstart: {q: {S.3: ANGLE deg}}\n")
        text = ball.read_text()
        for angle, told in ((140, False), (5, True)):
            ball.write_text(text.replace("ANGLE", str(angle)))
            self.assertEqual("moves 'S.1' by more than 90 deg from its guess" in self.expect(0, "assemble", ball).stderr, told)
        legs = self.model(self.legs(12, "{q: {crank: 0}, hold: [crank]}"))
        self.assertRegex(self.expect(0, "assemble", legs).stderr,
                         r"start: the loop of '\w+' has no start value, and is closed by search: give start values if another")

    def test_growth_in_proportion_to_time(self):
        """Masses with forces F_i of the others. The motion is t sin(w t) if a pair of eigenvalues on the axis has one shape, and
        a power of t if zeros form a chain; equal eigenvalues with shapes of their own give neither."""
        grows = [("q(x1) - q(x0)", "-q(x1)", "-q(x2)"), ("q(x1)", "0", "-q(x2)"), ("qd(x1)", "0", "0"),
                 ("q(x1) - q(x0)", "q(x2) - q(x1)", "-q(x2)"), ("1e-3*q(x1) - 1e6*q(x0)", "-1e6*q(x1)", "-q(x2)"),
                 ("qd(x1) - 4*q(x0)", "-4*q(x1)", "-2*qd(x2)")]
        lasts = [("-q(x0)", "-q(x1)", "-q(x2)"), ("0", "0", "-q(x2)"), ("qd(x1)", "-qd(x0)", "-q(x2)"),
                 ("q(x1) - q(x0)", "-1.01*q(x1)", "-q(x2)"), ("q(x1) - q(x0) - 0.1*qd(x0)", "-q(x1) - 0.1*qd(x1)", "-q(x2)")]
        for forces in grows + lasts:
            text = "kempe: 1\nbodies:\n" + "".join(
                f"  b{k}: {{joint: {{name: x{k}, prismatic: x, at: ground}}, mass: 1}}\n" for k in range(3))
            text += "forces:\n" + "".join(f"  f{k}: {{joint: x{k}, force: '{force}'}}\n" for k, force in enumerate(forces))
            modes = self.object(0, "modes", self.model(text + "run: {t_end: 1}\n"))["stability"]
            balance = self.object(0, "equilibrium", "model.yaml")["stability"]
            self.assertEqual((modes == "unstable", balance == "unstable"), (forces in grows,) * 2, forces)

    SPRING = ("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {m: 2, k: 40, c: 0.5, x0: 0.05}\n"
              "bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: m}}\n"
              "forces: {f: {joint: x, force: '3*sin(4*t) - k*(q(x) - x0) - c*qd(x) - 20*q(x)^3'}}\n"
              "run: {t_end: 4, output_step: 0.05, outputs: [q, qd]}\n")

    @long_motion
    def test_a_fitted_column_with_few_measurements(self):
        """Four positions among 80 rates with noise: an interval of 95 % holds the mass that made the data."""
        self.expect(0, "simulate", self.model(self.SPRING), "-o", "exact.csv", "--no-convergence-check")
        with open(self.folder / "exact.csv") as file:
            exact = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)][1:]
        held, seeds = 0, 30
        for seed in range(seeds):
            noise = random.Random(seed)
            lines = ["t,q.x,qd.x"]
            for i, row in enumerate(exact):
                q = f"{row['q.x'] + noise.gauss(0, 0.002)!r}" if i in (9, 29, 49, 69) else ""
                lines.append(f"{row['t']!r},{q},{row['qd.x'] + noise.gauss(0, 0.05)!r}")
            (self.folder / "few.csv").write_text("\n".join(lines) + "\n")
            found = self.object(0, "fit", "model.yaml", "few.csv", "--parameter", "m:0.2:10,k:5:100,c:0.01:5,x0:-1:1", "--starts", "1")
            held += found["parameters"]["m"]["low"] <= 2 <= found["parameters"]["m"]["high"]
        self.assertGreaterEqual(held, 0.85 * seeds)
        self.assertIn("the column 'q.x' has 4 measurements for 4 parameters", "".join(found["warnings"]))

    @long_motion
    def test_a_fit_begins_at_several_places(self):
        """The angle of a rocker over several turns of its crank has minima of the residual that are not the motion."""
        self.expect(0, "new", "four_bar")
        self.expect(0, "simulate", "four_bar.yaml", "--set", "rho=2.5", "--no-convergence-check", "-o", "swing.csv")
        asked = "fit", "four_bar.yaml", "swing.csv", "--columns", "q.D", "--parameter", "rho:0.1:10"
        found = self.object(0, *asked)
        self.assertAlmostEqual(found["parameters"]["rho"]["value"], 2.5, places=7)
        one = kempe(*asked, "--starts", "1", cwd=self.folder)
        self.assertIn("the fitted motion does not follow the data", one.stderr)

    @long_motion
    def test_cycles_at_nearly_one_value_are_followed(self):
        """Roessler's oscillator, whose parameter hardly changes with small amplitudes (a period doubling at a = 0.109639), and an
        oscillator that is linear up to a rate of 1 m/s (amplitude 1.46 m at mu = 0.1, where its damping gains as much as it loses)."""
        roessler = ("kempe: 1\nparameters: {c: 5.7, a: -.05, b: 0.2}\n"
                    "bodies: {m: {joint: {name: z, prismatic: x, at: ground}, mass: 1}}\n"
                    "forces: {k: {joint: z, spring: {stiffness: 7, damping: 3}}}\nstates:\n"
                    "  x: {rate: '-y-w', start: 0.007}\n  y: {rate: 'x+a*y', start: -.035}\n  w: {rate: 'b+w*(x-c)', start: .035}\n")
        cycles = self.object(0, "cycles", self.model(roessler), "--sweep", "a=-.05:.15:21")["branches"][0]["cycles"]
        doubling = [one for one in cycles if one["point"] == "doubling"]
        self.assertEqual(len(doubling), 1)
        self.assertAlmostEqual(doubling[0]["value"], 0.109639, places=6)
        dead_zone = ("kempe: 1\nparameters: {mu: 0.1}\nbodies: {mass: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                     "forces: {law: {joint: x, force: 'mu*qd(x) - q(x) - 0.5*max(qd(x)-1,0) + 0.5*max(-qd(x)-1,0)'}}\n"
                     "start: {q: {x: 3}}\n")
        cycles = self.object(0, "cycles", self.model(dead_zone), "--sweep", "mu=-.1:.3:9")["branches"][0]["cycles"]
        at = [one for one in cycles if one["value"] == 0.1]
        self.assertEqual([one["stability"] for one in at], ["stable"])
        self.assertAlmostEqual(at[0]["outputs"]["q.x"]["amplitude"], 1.46, places=2)

    def test_full_turns_that_do_not_close(self):
        """An angle that enters a closure as a polynomial does not return after a full turn; by sine and cosine it does."""
        text = ("kempe: 1\nbodies:\n  A: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}}\n"
                "  B: {joint: {prismatic: x, at: ground}, mass: 1}\nloops: {K: {constraint: 'q(B) - LAW'}}\nrun: {t_end: 1}\n")
        for law, closed in (("0.002*(q(A)*(q(A)-2*pi))^2", False), ("0.01*q(A)", False), ("0.1*sin(q(A)) + 0.01*cos(3*q(A))", True)):
            said = self.expect(0, "check", self.model(text.replace("LAW", law))).stdout
            self.assertEqual("closed cycle" in said, closed, law)
            self.assertEqual("rotates fully" in said, closed, law)

    def test_two_drives_of_one_degree_of_freedom(self):
        bars = self.BARS.replace("CRANK", "0.3").replace("start:", "drives: {mA: {joint: A, angle: '80 deg + 2*t'}, mD: {joint: D, angle: '96.5 deg + 0.6*t'}}\nstart:")
        for command in ("simulate", "assemble", "check"):
            done = self.expect(1, command, self.model(bars.replace(", hold: [A], qd: {A: 5}", "")))
            self.assertIn("the drives 'mA', 'mD' prescribe 2 motions, but the mechanism has 1 degree of freedom", done.stderr + done.stdout)

    def test_rings_without_mass(self):
        """A gimbal whose outer and inner axes are parallel: its rings turn while the body stays."""
        rings = ("kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground}}\n  b: {joint: {revolute: y, at: a}}\n"
                 "  c: {joint: {revolute: x, at: b}, mass: 1, com: [0.3, 0, 0.1], inertia: {xx: 0.01, yy: 0.02, zz: 0.02}}\n"
                 "start: {q: {b: 90 deg}}\nrun: {t_end: 1}\n")
        said = " ".join(self.expect(0, "check", self.model(rings)).stdout.split())
        self.assertIn("the motion of 'a' together with 'c' moves no mass; give body 'a'", said)

    def test_a_weld_has_no_start_value(self):
        text = ("kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
                "  b: {joint: {name: W, weld: a}, mass: 1}\nstart: {q: {W: 1}}\n")
        done = self.expect(2, "check", self.model(text))
        self.assertIn("start q: joint 'W' is a weld and has no coordinate", done.stderr)

    def test_coordinates_of_a_load_and_states(self):
        """A slide with friction by load has coordinates of its load; those of states follow."""
        text = ("kempe: 1\nbodies:\n  a: {joint: {name: A, prismatic: [-2, -1, 1], at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n"
                "states:\n" + "".join(f"  y{k}: {{rate: 1}}\n" for k in range(6)) + "forces:\n  rub: {joint: A, friction: {mu: 0.1}}\n"
                "start: {qd: {A: 1}}\nrun: {t_end: 0.01, outputs: [q]}\n")
        self.assertEqual(sorted(self.object(0, "simulate", self.model(text))["q"]), ["A", "A_load1", "A_load2"])

    def test_a_rise_is_counted_once(self):
        """A state that an event changes, where friction by loads begins anew at each event: rounding at its instant is no further one."""
        for level in "0.6", "1.1":
            found = self.object(0, "simulate", ROOT / "tests/models/friction_counter.yaml", "--set", f"level={level}", "--no-convergence-check")
            self.assertEqual(found["state"]["count"], 2, level)

    def test_polynomials_do_not_turn_a_slip(self):
        """At a coarse tolerance the polynomial of a step begins against the motion that friction decided: the steps that follow are shorter. The error of energy is told."""
        model = ROOT / "tests/models/friction_five_bar.yaml"
        for formulation in "reduced", "projected":
            found = self.object(5, "simulate", model, "--rtol", "1e-3", "--atol", "1e-3", "--integrator", "radau", "--formulation", formulation,
                                "--max-steps", "1000", "--no-convergence-check")
            self.assertAlmostEqual(found["q"]["ja0"], -0.783, delta=3e-3)

    def test_times_have_units(self):
        for given, taken in (("0.02", 0.02), ("20 ms", 0.02), ("1/50", 0.02)):
            found = self.object(0, "simulate", FOUR_BAR, "--t-end", given, "--output-step", "5 ms", "--no-convergence-check")
            self.assertAlmostEqual(found["t"], taken, 15)
        for wrong in ("3 m", "0", "-1 s", "x", "nan"):
            self.assertIn("--t-end needs a positive time in s",
                          self.expect(3, "simulate", FOUR_BAR, "--t-end", wrong).stderr)

    def test_files_are_known_by_their_endings(self):
        for name in ("x.txt", "x.xlsx", "x.csv.gz"):
            done = self.expect(3, *self.SHORT, "-o", name)
            self.assertIn("--output writes .csv, .parquet, .npz, .mat, .json files", done.stderr)
            self.assertFalse((self.folder / name).exists())
        for name in ("x", "x.csv", "x.npz", "x.mat", "/dev/null"):
            self.expect(0, *self.SHORT, "-o", name)
        self.assertIn(".svg", self.expect(3, "kinematics", FOUR_BAR, "--sweep", "crank=0:1", "--svg", "x.pdf").stderr)
        self.assertIn(".html", self.expect(3, "compare", FOUR_BAR, "--report", "x.pdf").stderr)

    def test_a_bound_on_work(self):
        light = ROOT / "tests/models/light_carriage.yaml"
        self.assertIn("the limit of 50 steps (max_steps)",
                      self.object(1, "simulate", light, "--no-convergence-check", "--max-steps", 50)["reason"])
        hopeless = self.object(1, "simulate", light, "--set", "l=1e-18")
        self.assertIn("too much work", hopeless["reason"])
        self.assertLess(hopeless["work"]["steps"], 300000)

    PULSE = """kempe: 1
parameters: {F: 100}
bodies: {mass: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}
forces: {pulse: {joint: x, force: "F*exp(-((t - 5)/(10 ms))^2)"}}
run: {t_end: 6, output_step: 1, outputs: [q, qd]%s}
"""

    def test_a_longest_step(self):
        """A pulse of 10 ms after 5 s of rest, which functions of t alone show; a longest step of 5 ms bounds all steps."""
        impulse = 100 * 0.01 * math.pi**0.5 / 2
        path = self.model(self.PULSE % "")
        for integrator in ("dop853", "dopri5", "radau5", "radau", "bdf", "adams"):
            words = ("simulate", path, "--integrator", integrator, "--no-convergence-check")
            for longest in ((), ("--max-step", "5 ms")):
                found = self.object(0, *words, *longest)
                self.assertAlmostEqual(found["qd"]["x"], impulse, 5, (integrator, longest))
                self.assertEqual(found["work"]["steps"] >= 1200, bool(longest), integrator)
        path = self.model(self.PULSE % ", max_step: 5 ms")
        self.assertGreaterEqual(self.object(0, "simulate", path, "--no-convergence-check")["work"]["steps"], 1200)
        self.assertGreaterEqual(self.object(0, "simulate", path, "--formulation", "dae", "--no-convergence-check")["work"]["steps"], 1200)
        found = self.object(0, "ensemble", path, "--sample", "F=50:150", "--instances", 4, "--quantity", "at(qd(x), 6)", "-o", "runs.csv")
        with open(self.folder / "runs.csv", newline="") as file:
            for row in csv.DictReader(line for line in file if line[0] != "#"):
                self.assertAlmostEqual(float(row["at(qd(x), 6)"]), float(row["F"]) / 100 * impulse, 5)
        self.assertIn("--max-step needs a positive time", self.expect(3, "simulate", path, "--max-step", "0").stderr)

    @long_motion
    def test_an_absurd_force_ends(self):
        path = self.model(FOUR_BAR.read_text() + "forces: {push: {joint: crank, torque: 1e200}}\n")
        self.assertIn("too much work", self.object(1, "simulate", path, "--no-convergence-check")["reason"])

    def test_a_start_next_to_a_singular_place_goes_on(self):
        text = (ROOT / "examples/spatial_slider_crank/spatial_slider_crank.yaml").read_text()
        path = self.model(text.replace("dz: 2/3", "dz: 2/1e8"))
        self.assertNotEqual(path.read_text(), text)
        self.expect(0, "simulate", path, "--no-convergence-check")

    def test_a_bound_on_work_of_instances(self):
        found = self.object(1, "ensemble", FOUR_BAR, "--sample", "crank=0.29:0.31", "--instances", 3, "--t-end", 1,
                            "--max-steps", 20)
        self.assertIn("the limit of 20 steps (max_steps)", found["reason"] + json.dumps(found["instances"]))

    def test_a_lock_is_a_stop(self):
        """Exit code 1, and the object says that it has stopped, and why."""
        path = self.model(FOUR_BAR.read_text().replace("qd: {crank: 20}", "qd: {}").replace("hold: [crank], ", "")
                          + "drives: {motor: {joint: rocker, angle: t}}\n")
        found = self.object(1, "simulate", path)
        self.assertEqual(found["status"], "stopped")
        self.assertIn("the mechanism reaches a limit position", found["reason"])

    def test_interrupt(self):
        self.interrupt("simulate", FOUR_BAR, "--t-end", "1e6", "--output-step", "100", "--rtol", "1e-9", "--max-steps", "1000000000")

    def test_tolerance_below_rounding(self):
        """After many turns the rounding of an angle is above the tolerance: the reason of the end has the angle's name."""
        for integrator in ("radau", "dop853"):
            done = self.expect(1, "simulate", FOUR_BAR, "--t-end", "400", "--output-step", "100", "--rtol", "1e-13",
                               "--integrator", integrator, "--no-convergence-check")
            self.assertRegex(" ".join(done.stdout.split()), r"'crank' is 4\.1e\+03 rad, which is rounded to 9e-13 rad, and atol is 1e-13: use a larger rtol")

    def test_interrupt_without_result(self):
        """The object and a sentence are there also while there is nothing to show."""
        self.interrupt("response", ROOT / "examples/suspension/suspension.yaml", "--inputs", "force(chassis.R.z)",
                       "--frequencies", "1:2:900000")

    def interrupt(self, *words):
        run = subprocess.Popen([KEMPE, *words, "--json", "-"],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            run.wait(0.5)
        except subprocess.TimeoutExpired:
            pass
        run.send_signal(signal.SIGINT)
        text = run.communicate(timeout=60)[0]
        self.assertEqual(run.returncode, 1)
        found = strict(text)
        self.assertEqual(found["status"], "stopped")
        self.assertNotEqual(found["reason"], "")


class Numpy(Case):
    def test_npz(self):
        self.expect(0, "simulate", FOUR_BAR, "--t-end", "0.1", "--output-step", "0.05", "-o", "a.npz")
        self.expect(0, "simulate", FOUR_BAR, "--t-end", "0.1", "--output-step", "0.05", "-o", "b.npz")
        self.expect(0, "simulate", FOUR_BAR, "--t-end", "0.1", "--output-step", "0.05", "-o", "a.csv")
        self.assertEqual((self.folder / "a.npz").read_bytes(), (self.folder / "b.npz").read_bytes())
        arrays = {}
        with zipfile.ZipFile(self.folder / "a.npz") as archive:
            for name in archive.namelist():
                data = archive.read(name)
                self.assertEqual(data[:8], b"\x93NUMPY\x01\x00")
                length = struct.unpack("<H", data[8:10])[0]
                self.assertEqual((10 + length) % 64, 0)
                arrays[name] = ast.literal_eval(data[10 : 10 + length].decode()), data[10 + length :]
        with open(self.folder / "a.csv") as file:
            names, *rows = file.read().splitlines()
        head, body = arrays["names.npy"]
        width = int(head["descr"][2:])
        words = [body[4 * width * k : 4 * width * (k + 1)].decode("utf-32-le").rstrip("\0") for k in range(head["shape"][0])]
        self.assertEqual(words, names.split(","))
        head, body = arrays["values.npy"]
        self.assertEqual(head["shape"], (len(rows), len(words)))
        values = struct.unpack("<%dd" % (len(rows) * len(words)), body)
        self.assertEqual(list(values), [float(x) for row in rows for x in row.split(",")])

    def elements(self, data):
        """The elements of a level 5 file of MATLAB: (type, bytes), each filled up to eight."""
        while data:
            kind, size = struct.unpack("<II", data[:8])
            yield kind, data[8 : 8 + size]
            self.assertFalse(any(data[8 + size : 8 + size + -size % 8]))
            data = data[8 + size + -size % 8 :]

    def variable(self, data):
        """Name, shape and content of an array: numbers, a text, or a list of arrays."""
        (_, flags), (_, shape), (_, name), *rest = self.elements(data)
        shape = struct.unpack("<ii", shape)
        if flags[0] == 6:
            return name.decode(), shape, struct.unpack(f"<{math.prod(shape)}d", rest[0][1])
        if flags[0] == 4:
            return name.decode(), shape, rest[0][1].decode("utf-16-le")
        return name.decode(), shape, [self.variable(part)[2] for _, part in rest]

    def matlab(self, name):
        data = (self.folder / name).read_bytes()
        self.assertEqual((data[:10], data[124:128]), (b"MATLAB 5.0", b"\0\1IM"))
        found = [self.variable(part) for kind, part in self.elements(data[128:]) if self.assertEqual(kind, 14) is None]
        return {name: (shape, content) for name, shape, content in found}

    def test_mat(self):
        words = ("ensemble", FOUR_BAR, "--sample", "crank=0.28:0.32", "--instances", "5", "--t-end", "0.1", "-o")
        for name in "a.mat", "b.mat", "a.csv":
            self.expect(0, *words, name)
        self.assertEqual((self.folder / "a.mat").read_bytes(), (self.folder / "b.mat").read_bytes())
        found = self.matlab("a.mat")
        rows = list(csv.DictReader((self.folder / "a.csv").read_text().splitlines()))
        names = [name for name in rows[0] if name not in ("status", "verdict", "start", "single_run", "reason")]
        self.assertEqual(found["names"], ((len(names), 1), names))
        self.assertEqual((found["units"][0], found["units"][1][:3]), ((len(names), 1), ["", "s", "rad"]))
        self.assertEqual(found["values"][0], (5, len(names)))
        self.assertEqual(list(found["values"][1]), [float(row[name]) for name in names for row in rows])
        self.assertEqual(found["status"], ((5, 1), ["complete"] * 5))
        self.assertEqual(found["reason"], ((5, 1), [""] * 5))

    def test_matrices(self):
        words = ("linearize", ROOT / "examples/quarter_car/quarter_car.yaml", "--inputs", "effort(body)", "--outputs", "q", "-o", "l.mat")
        one = self.object(0, *words)
        found = self.matlab("l.mat")
        for name in "A", "B", "C", "D":
            self.assertEqual(found[name][0], (len(one[name]), len(one[name][0])))
            self.assertEqual(list(found[name][1]), [row[k] for k in range(len(one[name][0])) for row in one[name]])
        self.assertEqual(found["inputs"][1], ["effort(body)"])

    @unittest.skipUnless(shutil.which("octave"), "Octave is not installed")
    def test_octave_reads_mat(self):
        self.expect(0, "simulate", FOUR_BAR, "--t-end", "0.1", "-o", "a.mat")
        self.expect(0, "simulate", FOUR_BAR, "--t-end", "0.1", "-o", "a.csv")
        said = subprocess.run(["octave", "--no-gui", "--quiet", "--no-init-file", "--eval",
                               "t = load('a.mat'); disp(max(abs(t.values - csvread('a.csv', 1, 0))(:))), disp(t.names{2})"],
                              cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(said.stdout.split(), ["0", "q.crank"], said.stderr)

    def test_npz_that_cannot_be_written(self):
        """A folder that is missing is named before the run, whose result would be lost."""
        done = self.expect(1, "simulate", FOUR_BAR, "--t-end", "0.1", "-o", "nowhere/a.npz", "--json", "-")
        self.assertEqual(done.stderr, "kempe: cannot write 'nowhere/a.npz': No such file or directory\n")
        self.assertEqual((json.loads(done.stdout)["status"], json.loads(done.stdout)["build_s"]), ("failed", None))
        self.assertEqual(self.expect(1, "simulate", FOUR_BAR, "--json", "nowhere/a.json").stdout, "")


class Resume(Case):
    def rows(self, name):
        with open(self.folder / name, newline="") as file:
            return list(csv.DictReader(file))

    def test_files_that_cannot_be_written(self):
        model = ROOT / "examples/four_bar/four_bar.yaml"

        def small():  # as on a full disk: headers fit, sources do not
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))

        (self.folder / "code").mkdir()
        for words in (("generate", model, "--lang", "c", "-o", "code"), ("generate", model, "--lang", "c", "--simulator", "-o", "code"),
                      ("simulate", model, "--t-end", "1", "--checkpoint", "code/run.checkpoint"),
                      ("simulate", model, "--t-end", "1", "-o", "code/rows.csv"), ("fmu", model, "-o", "code/unit.fmu")):
            done = subprocess.run([KEMPE, *map(str, words), "--no-cache"], capture_output=True, text=True, check=False, cwd=self.folder,
                                  preexec_fn=small, restore_signals=False)
            self.assertEqual((done.returncode, os.listdir(self.folder / "code")), (1, []), (words, done.stderr))
            self.assertIn("cannot write", done.stderr)

    def test_goes_on_from_a_checkpoint(self):
        options = [SLIDER_CRANK, "--rtol", "1e-11", "--output-step", "0.5"]
        self.expect(0, "simulate", *options, "--t-end", "10", "-o", "whole.csv")
        self.expect(0, "simulate", *options, "--t-end", "4", "--checkpoint", "run.checkpoint")
        self.expect(0, "simulate", *options, "--t-end", "10", "--resume", "run.checkpoint", "-o", "resumed.csv")
        whole, resumed = self.rows("whole.csv"), self.rows("resumed.csv")
        self.assertEqual([row["t"] for row in whole], [row["t"] for row in resumed])
        for a, b in zip(whole, resumed):
            self.assertAlmostEqual(float(a["q.crank"]), float(b["q.crank"]), delta=1e-8)

    def test_doubts_before_a_checkpoint(self):
        """A run that has left a table is not trustworthy, and neither are runs that continue it, nor those that continue these."""
        model = self.model("kempe: 1\ntables: {f: {x: [0.1, 0.5, 9], y: [1, 2, 0], method: linear}}\n"
                           "bodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}\nforces: {f: {joint: X, force: f(t)}}\nrun: {t_end: 1}\n")
        for end, more in (("0.4", ()), ("0.6", ("--resume", "run.checkpoint")), ("1", ("--resume", "run.checkpoint"))):
            done = self.expect(5, "simulate", model, "--t-end", end, *more, "--checkpoint", "run.checkpoint")
            self.assertEqual(done.stderr.count("table 'f' is used at 0, beyond its points"), 1)
            self.assertEqual(done.stderr.count("before the checkpoint: table 'f' is used at 0"), bool(more))
        # a run that its repeat contradicts
        loose = ("--rtol", "1e-2", "--formulation", "reduced", "--integrator", "dopri5")
        hard = self.model("kempe: 1\nbodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}\n"
                          "forces: {f: {joint: X, force: -400*q(X) + 40*sin(q(X)*30)}}\nstart: {q: {X: 1}}\n")
        self.assertIn("do not trust the motion", self.expect(5, "simulate", hard, "--t-end", "4", *loose, "--checkpoint", "run.checkpoint").stderr)
        done = self.expect(5, "simulate", hard, "--t-end", "4.1", "--resume", "run.checkpoint", "--rtol", "1e-10", "--no-convergence-check")
        self.assertIn("before the checkpoint: do not trust the motion", done.stderr)

    def test_a_negative_level_of_friction(self):
        """A time after the zero of the level, of a number and of the load of a joint, is named with the level there; a level that only touches zero is none.

        Without rows between, in a dip within a step, and in units, it is named, too."""
        model = ("kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {{a: {{joint: {{name: X, prismatic: x, at: ground}}, mass: 1}}}}\n"
                 "forces: {{f: {{joint: X, friction: {{{}}}}}}}\nstart: {{qd: {{X: 4}}}}\nrun: {{t_end: 2, output_step: 0.01, outputs: [q]}}\n")
        for law, right, to in (('force: "0.5*cos(4*t)"', lambda t: 0.5 * math.cos(4 * t), 0.5), ('mu: "0.05*cos(4*t)"', lambda t: 0.05 * 9.81 * math.cos(4 * t), 0.5),
                               ('force: "0.5*(sin(0.3*t) - 0.28)^2 - 1e-5"', lambda t: 0.5 * (math.sin(0.3 * t) - 0.28)**2 - 1e-5, 1)):
            for more in (), ("--output-step", "2"), ("--formulation", "dae", "--integrator", "ida"):
                found = re.search(r"friction 'f' has the level (\S+) at t = (\S+) s, which must not be negative", self.expect(5, "simulate", self.model(model.format(law)), *more).stderr)
                self.assertAlmostEqual(float(found[1]), right(float(found[2])), delta=2e-4 * abs(right(float(found[2]))) + 1e-6)
                self.assertTrue(right(float(found[2])) < 0 and float(found[2]) < to, found[0])
        for law in 'force: "0.5*(1 - cos(4*t))"', 'force: "0.5*abs(sin(4*t))"', 'force: "0.5*sin(4*t)^2*qd(X)^2"':
            self.assertEqual(self.expect(0, "simulate", self.model(model.format(law))).stderr, "", law)

    def test_forces_of_redundant_contacts(self):
        """Three feet in a plane have forces that are not unique: the log says so, and a warning where an output has them; two feet have unique ones."""
        text = ("kempe: 1\ngravity: [0, -9.81, 0]\nground: {{points: {{O: [0, 0, 0]}}}}\nbodies: {{b: {{joint: {{name: j, planar: z, at: ground}}, mass: 3, "
                "inertia: {{zz: 0.1}}, points: {{A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}}}}}\ncontacts:\n{}run: {{t_end: 0.1, outputs: [q{}]}}\n")
        foot = "  {0}: {{point: b.{0}, on: {{plane: ground.O, normal: y}}, restitution: 0}}\n"
        words = "the forces of redundant contacts are not unique, and one solution is shown: 'A', 'B', 'C'"
        for feet, output, warned, logged in (("ABC", "", 0, 1), ("ABC", ", force(A)", 1, 1), ("AC", ", force(A)", 0, 0)):
            done = self.expect(0, "simulate", self.model(text.format("".join(map(foot.format, feet)), output)), "--json", "-")
            self.assertEqual(done.stderr.count(words), warned)
            self.assertEqual(sum(words in entry["text"] for entry in json.loads(done.stdout)["log"]), logged)

    def test_derivatives_of_a_run_that_a_condition_ends(self):
        """A fall by 0.9 m ends at sqrt(1.8/9.81) s: rows have derivatives there, at this time; an integral to t_end has none, and says why."""
        model = self.model("kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {h: 1.1}\nbodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\n"
                           "start: {q: {z: h}}\nrun: {t_end: 5, until: q(z) < 0.2, outputs: [q]}\n")
        self.assertIn(f"at t = {math.sqrt(1.8 / 9.81):.6g} s", self.expect(1, "sensitivity", model, "--parameters", "h").stdout)
        for more in ("--method", "adjoint"), ("--integral",), ("--integral", "--method", "adjoint"):
            said = self.expect(1, "sensitivity", model, "--parameters", "h", *more).stderr
            self.assertIn("the run ends as requested: q(z) < 0.2 at t = 0.428", said)
            self.assertIn("choose an earlier t_end", said)

    def test_inverse_dynamics_of_a_motion_that_a_condition_ends(self):
        """States along the drives come from a run, which the condition ends at asin(0.8)/2 s; inverse dynamics up to an earlier time does not meet it."""
        model = self.model("kempe: 1\nstates: {f: {rate: q(A) - f}}\nbodies: {a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                           "drives: {d: {joint: A, angle: 0.5*sin(2*t)}}\nforces: {t: {joint: A, torque: f}}\nrun: {t_end: 1, until: q(A) > 0.4}\n")
        said = self.expect(1, "inverse", model).stderr
        self.assertIn(f"the states along the drives: the run ends as requested: q(A) > 0.4 at t = {math.asin(0.8) / 2:.7f}", said)
        self.assertIn("choose an earlier t_end", said)
        self.expect(0, "inverse", model, "--t-end", "0.4")

    def test_estimated_error_of_a_run_that_is_repeated_in_parts(self):
        """The first line has the errors of all steps, which are larger than the largest difference within a part."""
        model = ROOT / "examples/curving/curving.yaml"
        title = self.expect(0, "simulate", model, "--t-end", "1").stdout.splitlines()[0]
        found = self.object(0, "simulate", model, "--t-end", "1")["convergence"]
        self.assertGreater(found["total"], 2 * found["difference"])
        self.assertTrue(title.endswith(f", estimated error {found['total']:.1e} (relative)"), title)

    def test_units_of_integrals(self):
        """An integral has the unit of its expression times s; of an expression without a known unit it has none, and limits of any dimension."""
        model = self.model("kempe: 1\nbodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\nstart: {qd: {x: 3}}\nsensors: {twice: 2*qd(x)}\nrun: {t_end: 1}\n")
        columns = {"integral(qd(x))": "m/s s", "integral(qd(x)^2)": "", "integral(twice)": "", "integral(energy.kinetic)": "J s"}
        words = [word for name in columns for word in ("--quantity", name)]
        self.expect(0, "ensemble", model, *words, "--limit", "integral(qd(x)^2) < 9.1 m^2/s", "--units", "si", "-o", "ends.csv")
        head = next(csv.reader((self.folder / "ends.csv").read_text().splitlines()))
        for name, unit in columns.items():
            self.assertIn(f"{name} [{unit}]" if unit else name, head)

    def test_quantities_of_contact_forces(self):
        """Means of forces lack the impulses of a ball that bounces; forces of three feet are those of one solution. Extremes of places have no warning."""
        ball = ("kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {e: 0.8}\nground: {points: {O: [0, 0, 0]}}\n"
                "bodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: 1, points: {C: [0, 0, 0]}}}\n"
                "contacts: {floor: {point: b.C, on: {plane: ground.O}, restitution: e}}\nstart: {q: {z: 0.2}}\nrun: {t_end: 1}\n")
        feet = ("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {m: 3}\nground: {points: {O: [0, 0, 0]}}\nbodies: {b: {joint: {name: j, planar: z, at: ground}, mass: m, "
                "inertia: {zz: 0.1}, points: {A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}}\ncontacts:\n"
                + "".join(f"  {k}: {{point: b.{k}, on: {{plane: ground.O, normal: y}}, restitution: 0}}\n" for k in "ABC") + "run: {t_end: 0.1, outputs: [q]}\n")
        impulses, open_ = "quantity 'x' lacks the impulses of impacts, such as of 'floor'", "the forces of redundant contacts are not unique in instances, such as 'A'"
        for text, quantity, sample, words in ((ball, "mean(force(floor))", "e=0.5:0.9", impulses), (ball, "rms(qdd(z))", "e=0.5:0.9", impulses), (ball, "integral(q(z))", "e=0.5:0.9", ""),
                                              (ball, "max(force(floor))", "e=0.5:0.9", ""), (feet, "max(force(A))", "m=1:2", open_), (feet, "max(q(j.2))", "m=1:2", "")):
            model = self.model(text)
            for way in ("ensemble", model, "--quantity", f"x={quantity}"), ("ensemble", model, "--quantity", f"x={quantity}", "--sample", sample, "--instances", "40"):
                said = self.expect(0, *way).stderr
                self.assertEqual(said.count(words), 1, said) if words else self.assertEqual(said, "")

    def test_friction_that_shares_with_a_contact(self):
        """Friction of 4 N on a vertical slide that rests on a foot: the foot may press with 5.81 to 13.81 N, and its friction brakes as much. A stop
        shares with the friction of its joint, but the motion is unique. Friction without a level, and friction that slips, share nothing."""
        text = ("kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n  foot: {joint: {name: y, prismatic: y, at: cart}, mass: 1, points: {P: [0, 0, 0]}}\n"
                "forces: {rub: {joint: y, friction: {force: LEVEL}}}\ncontacts: {floor: {CONTACT, restitution: 0}}\n"
                "start: {qd: {x: 3}}\nrun: {t_end: 0.2, outputs: [q, OUTPUT]}\n")
        foot, stop = "point: foot.P, on: {plane: ground.O, normal: y}, friction: 0.5", "joint: y, lower: 0"
        words = "the forces of redundant contacts and friction are not unique, and one solution is shown: 'rub', 'floor'"
        for contact, level, output, code, said in ((foot, "4", "qd", 5, "friction makes the motion depend on the forces of redundant contacts and friction"),
                                                   (foot, "0", "qd", 0, ""), (stop, "4", "qd", 0, ""), (stop, "4", "force(floor)", 0, words), (stop, "0", "force(floor)", 0, "")):
            model = self.model(text.replace("LEVEL", level).replace("CONTACT", contact).replace("OUTPUT", output))
            for way in ("reduced", "projected"):
                done = self.expect(code, "simulate", model, "--formulation", way)
                self.assertTrue(said in done.stderr if said else done.stderr == "", (contact, level, done.stderr))
        pressed = text.replace("LEVEL", "4").replace("CONTACT", "point: foot.P, on: {plane: ground.O, normal: y}").replace("OUTPUT", "qd")
        for above, code in ((pressed.replace("contacts:", "  slide: {joint: x, friction: {mu: 0.5}}\ncontacts:").replace("forces: {rub: {joint: y, friction: {force: 4}}}", "forces:\n  rub: {joint: y, friction: {force: 4}}"), 5),
                            (pressed.replace("point: foot.P, on: {plane: ground.O, normal: y}", "joint: y, lower: 0").replace("contacts:", "  slide: {joint: x, friction: {mu: 0.5}}\ncontacts:")
                             .replace("forces: {rub: {joint: y, friction: {force: 4}}}", "forces:\n  rub: {joint: y, friction: {force: 4}}"), 0)):
            self.expect(code, "simulate", self.model(above))
        shaken = self.model(text.replace("LEVEL", "4").replace("CONTACT", foot).replace("OUTPUT", "qd"))
        self.assertIn("redundant contacts in instances", self.expect(5, "ensemble", shaken, "--quantity", "v=qd(x)").stderr.replace("the forces of ", ""))

    def test_feet_that_strike_again(self):
        """An arm rocks a block on three feet that slip, which open and strike again at once: with equal coefficients there is one motion."""
        text = ("kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  b: {joint: {motions: [T1, T2, R3], coordinates: [x, y, a], at: ground}, mass: 3, inertia: {zz: 0.1}, points: {A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}\n"
                "  arm: {joint: {name: q, revolute: z, at: b.B}, mass: 0.5, com: [0, 0.2, 0], inertia: {zz: 0.01}}\n"
                "drives: {d: {joint: q, angle: '0.3*sin(20*t)'}}\ncontacts:\n"
                + "".join(f"  {k}: {{point: b.{k}, on: {{plane: ground.O, normal: y}}, restitution: 0, friction: {mu}}}\n" for k, mu in (("A", 0.1), ("B", "MU"), ("C", 0.1)))
                + "start: {qd: {x: 2}}\nrun: {t_end: 0.3, outputs: [q]}\n")
        self.assertEqual(self.expect(0, "simulate", self.model(text.replace("MU", "0.1"))).stderr, "")
        self.assertIn("friction makes the motion depend on the forces of redundant contacts", self.expect(5, "simulate", self.model(text.replace("MU", "0.5"))).stderr)

    def test_contacts_at_rest_that_might_as_well_move(self):
        """A block on four feet holds a torque about the normal as far as its feet press: 1.5 N m is held by the outer feet alone, not by the inner
        ones. A block on three feet in a plane strikes with a tangential rate that only its middle foot stops."""
        words = "friction makes the motion depend on the {} of redundant contacts"
        text = ("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  b: {joint: {motions: [T1, T2, T3, R3, R2, R1], coordinates: [x, y, z, yaw, pitch, roll], at: ground}, mass: 1, "
                "inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, points: {A: [1, 0, -0.2], B: [-1, 0, -0.2], C: [0, 0.3, -0.2], D: [0, -0.3, -0.2]}}\ncontacts:\n"
                + "".join(f"  {k}: {{point: b.{k}, on: {{plane: ground.O, normal: z}}, restitution: 0, friction: 0.3}}\n" for k in "ABCD")
                + "forces: {twist: {on: b, torque: [0, 0, LOAD]}}\nstart: {q: {z: 0.2}}\nrun: {t_end: 0.1, outputs: [q]}\n")
        self.assertEqual(self.expect(0, "simulate", self.model(text.replace("LOAD", "0.5"))).stderr, "")
        self.assertIn(words.format("forces"), self.expect(5, "simulate", self.model(text.replace("LOAD", "1.5"))).stderr)
        text = ("kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  b: {joint: {motions: [T1, T2, R3], coordinates: [x, y, a], at: ground}, mass: 3, inertia: {zz: 0.1}, points: {A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}\n"
                "contacts:\n" + "".join(f"  {k}: {{point: b.{k}, on: {{plane: ground.O, normal: y}}, restitution: 0, friction: {mu}}}\n" for k, mu in (("A", "MU"), ("B", 0.5), ("C", "MU")))
                + "start: {q: {y: 0.1}, qd: {x: 0.01}}\nrun: {t_end: 0.2, outputs: [q]}\n")
        self.assertEqual(self.expect(0, "simulate", self.model(text.replace("MU", "0.5"))).stderr, "")
        self.assertIn(words.format("impulses"), self.expect(5, "simulate", self.model(text.replace("MU", "0"))).stderr)

    def test_contacts_that_share_within_a_phase(self):
        """Loads that grow without an event: on three feet in a plane, one of which has more friction; a block on four feet, two of which carry
        nothing, turns about the others where those might press as well."""
        words = "friction makes the motion depend on the forces of redundant contacts"
        plane = ("kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                 "  b: {joint: {motions: [T1, T2, R3], coordinates: [x, y, a], at: ground}, mass: 1, inertia: {zz: 0.1}, points: {A: [-1, 0, 0], B: [0.1, 0, 0], C: [1, 0, 0]}}\n"
                 "contacts:\n" + "".join(f"  {k}: {{point: b.{k}, on: {{plane: ground.O, normal: y}}, restitution: 0, friction: {mu}}}\n" for k, mu in (("A", 0.1), ("B", 0.5), ("C", 0.1)))
                 + "forces: {push: {at: b.B, force: [\"LOAD*t\", 0, 0]}}\nrun: {t_end: 1, outputs: [q]}\n")
        space = ("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                 "  b: {joint: {motions: [T1, T2, T3, R3, R2, R1], coordinates: [x, y, z, yaw, pitch, roll], at: ground}, mass: 1, "
                 "inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, points: {A: [1, 0, -0.2], B: [-1, 0, -0.2], C: [0, 0.3, -0.2], D: [0, -0.3, -0.2]}}\ncontacts:\n"
                 + "".join(f"  {k}: {{point: b.{k}, on: {{plane: ground.O, normal: z}}, restitution: 0, friction: 0.3}}\n" for k in "ABCD")
                 + "forces: {twist: {on: b, torque: [0, 0, LOAD*t]}}\nstart: {q: {z: 0.2}}\nrun: {t_end: 1, outputs: [q]}\n")
        for text, little, much in ((plane, "0.9", "2"), (space, "0.8", "1.5")):
            self.assertEqual(self.expect(0, "simulate", self.model(text.replace("LOAD", little))).stderr, "")
            self.assertIn(words, self.expect(5, "simulate", self.model(text.replace("LOAD", much))).stderr)

    def test_friction_by_a_load_that_is_not_unique(self):
        """A door on two hinges, with friction by the load of one of them: no study with forces trusts it, and studies of positions do."""
        model = self.model("kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {m: 2}\nground: {points: {H1: [0, 0, 0], H2: [0, 0, 0.5]}}\n"
                           "bodies:\n  door: {mass: m, com: [0.3, 0, 0.25], inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, points: {a: [0, 0, 0], b: [0, 0, 0.5]}}\n"
                           "joints: {J1: {revolute: [ground.H1, door.a], axis: z}}\nloops: {J2: {revolute: [ground.H2, door.b], axis: z}}\n"
                           "forces: {f: {joint: J1, friction: {mu: 0.2, radius: 0.02}}, t: {joint: J1, torque: 1}}\nstart: {qd: {J1: 1}}\nrun: {t_end: 0.1}\n")
        sample = ("--sample", "m=1:2", "--instances", "2")
        for words in (("simulate",), ("ensemble", *sample), ("ensemble", *sample, "--alone"), ("sensitivity", "--parameters", "m"), ("equilibrium",),
                      ("linearize",), ("linearize", "--at", "start"), ("modes",), ("compare",)):
            said = self.expect(5, words[0], model, *words[1:]).stderr
            self.assertEqual(said.count("friction 'f' depends on a load that redundant constraints share"), 1, words)
        self.assertEqual(self.expect(0, "assemble", model).stderr, "")

    def test_a_checkpoint_has_the_past_of_delays(self):
        text = (
            "kempe: 1\nstates:\n  late: {{delay: {signal}, time: {delay}}}\n  sum: {{rate: late}}\n"
            "bodies: {{m: {{joint: {{name: x, prismatic: x, at: ground}}, mass: 1}}}}\nforces: {{f: {{joint: x, force: -q(x)}}}}\n"
            "start: {{q: {{x: 1}}}}\nrun: {{t_end: 2, output_step: {step}, rtol: 1e-10, outputs: [q, state]}}\n"
        )
        # the integral of the delayed signal up to 2 s; before the start the signal has the value of the start
        cases = (
            ("sin(3*t)", 0.2, 0.1, 0.73, (1 - math.cos(5.4)) / 3),
            ("sin(3*t)", 0.2, 0.1, 0.2, (1 - math.cos(5.4)) / 3),  # at the end of the past before the start
            ("sin(3*t)", 0.01, 1, 1.6, (1 - math.cos(5.97)) / 3),  # rows much farther apart than the delay
            ("q(x)", 0.5, 0.1, 1.1, 0.5 + math.sin(1.5)),
            ('"if(t > 0.4, 1, 0)"', 0.35, 0.25, 0.75, 1.25),  # jumps where the run continues
        )
        for signal, delay, step, at, right in cases:
            model = self.model(text.format(signal=signal, delay=delay, step=step))
            for integrator in ("dop853", "radau", "bdf"):
                options = [model, "--integrator", integrator]
                self.expect(0, "simulate", *options, "--t-end", at, "--checkpoint", "run.checkpoint")
                self.expect(0, "simulate", *options, "--resume", "run.checkpoint", "--checkpoint", "run.checkpoint", "-o", "resumed.csv")
                self.assertAlmostEqual(float(self.rows("resumed.csv")[-1]["state.sum"]), right, delta=1e-7)
        old = (self.folder / "run.checkpoint").read_text().replace("checkpoint 5", "checkpoint 4", 1)
        (self.folder / "old").write_text(old)
        done = self.expect(2, "simulate", model, "--t-end", "3", "--resume", "old")
        self.assertIn("the checkpoint has format 4, this version reads format 5", done.stderr)

    def test_numbers_without_the_unit_of_the_file(self):
        model = self.model(
            "kempe: 1\nparameters: {length: 300 mm, tilt: 10 deg, speed: 72 m/s}\n"
            "bodies: {m: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [length*cos(tilt)*speed/speed, 0, 0]}}\n"
        )
        self.assertEqual(self.expect(2, "check", model, "--set", "length=3 kg").stderr,
                         "--set length:1:1: parameter 'length', which is '300 mm' in the file: expected m, got kg\n")
        for setting, word in (("length=310", "write '310 mm'"), ("tilt=20", "write '20 deg'")):
            self.assertIn(word, self.expect(0, "check", model, "--set", setting).stderr)
        for setting in ("length=0.31", "length=310 mm", "tilt=0.2", "speed=70"):
            self.assertEqual(self.expect(0, "check", model, "--set", setting).stderr, "")
        done = self.expect(0, "kinematics", model, "--sweep", "A=0:360:5")
        self.assertIn("sweep: 'A' is 360 without a unit and is taken in rad, 57.3 turns: for degrees write '360 deg'", done.stderr)
        self.assertIn("'A' is 20 without a unit", self.expect(0, "kinematics", model, "--sweep", "A=0:20:5").stderr)
        for sweep in ("A=0:360 deg:5", "A=0 deg:360 deg:5", "A=0:6.3:5", "A=0:20*pi:5", "A=0:2 rev:5", "A=0:20 rad:5"):
            self.assertNotIn("turns", self.expect(0, "kinematics", model, "--sweep", sweep).stderr)

    BODY = "bodies: {m: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 1}}}\n"

    def test_sizes_without_a_unit(self):
        """Moments, centres of mass and gravity as in mm are named where the points are in m."""
        text = ("kempe: 1\nparameters: {l: 300 mm, J: 4500}\ngravity: [0, -9.81, 0]\n"
                "bodies: {a: {joint: {revolute: z, at: ground}, mass: 0.6, com: [l/2, 0, 0], inertia: {zz: 0.0045}, points: {P: [l, 0, 0]}}}\n")
        self.assertNotIn("without a unit", self.expect(0, "check", self.model(text)).stderr)
        for old, new, told in (("zz: 0.0045", "zz: 4500", "4:91: inertia zz of body 'a' is 4500 without a unit, taken in kg m^2: "
                                "a radius of gyration of 86.6 m with points of its body within 0.3 m; for mm write '4500 kg*mm^2'"),
                               ("zz: 0.0045", "zz: J", "inertia zz of body 'a' is 4500 without a unit"),
                               ("l/2", "-150", "component 1 of the com of body 'a' is -150 without a unit, taken in m, "
                                "with points of its body within 0.3 m; for mm write '-150 mm'"),
                               ("-9.81", "-9810", "gravity is -9810 without a unit and is taken in m/s^2"),
                               ("zz: 0.0045", "zz: 4500 kg*m^2", None), ("zz: 0.0045", "zz: 5", None), ("l/2", "20", None),
                               ("l/2", "150 mm", None), ("-9.81", "-9810 mm/s^2", None), ("300 mm, J: 4500}", "300, J: 4500}", None)):
            done = self.expect(0, "check", self.model(text.replace(old, new)))
            self.assertEqual(told is not None, "without a unit" in done.stderr, (new, done.stderr))
            self.assertIn(told or "", done.stderr)

    def test_angles_without_a_unit(self):
        """More than a turn without a unit is named where the model has degrees, 45 rad and more in any model."""
        for values, start, told in (("tilt: 10 deg", "60", "start q: 'A' is 60 without a unit and is taken in rad, 9.55 turns: for degrees write '60 deg'"),
                                    ("tilt: 10 deg", "-60", "-60 without a unit"), ("tilt: 10 deg, first: 60", "first", "60 without a unit"),
                                    ("tilt: 0.1", "20", None), ("tilt: 0.1", "-90", "-90 without a unit"), ("tilt: 0.1", "45", "for degrees write '45 deg'"), ("tilt: 10 deg", "6.3", None), ("tilt: 10 deg", "60 rad", None),
                                    ("tilt: 10 deg", "20*pi", None), ("tilt: 10 deg, first: 20*pi", "first", None), ("tilt: 10 deg", "60 deg", None)):
            model = self.model(f"kempe: 1\nparameters: {{{values}}}\n{self.BODY}"
                               f"forces: {{s: {{joint: A, spring: {{stiffness: 1, rest: tilt}}}}}}\nstart: {{q: {{A: {start}}}}}\n")
            done = self.expect(0, "assemble", model)
            self.assertEqual("turns" in done.stderr, told is not None, (values, start, done.stderr))
            self.assertIn(told or "", done.stderr)
            if told:
                self.assertRegex(done.stderr, r"model\S*:\d+:\d+: ")
        model = self.model("kempe: 1\nparameters: {tilt: 10 deg}\n" + self.BODY + "forces: {s: {joint: A, spring: {stiffness: 1, rest: tilt}}}\n")
        self.assertIn("parameter 'tilt' is set to 400", self.expect(0, "check", model, "--set", "tilt=400").stderr)
        self.assertIn("hold: 'A' is 60 without a unit", kempe("equilibrium", model, "--hold", "A=60", "--solve-for", "tilt", cwd=self.folder).stderr)
        self.assertNotIn("turns", kempe("equilibrium", model, "--hold", "A=60 deg", "--solve-for", "tilt", cwd=self.folder).stderr)

    def test_degrees_in_circular_functions(self):
        """A number beyond a turn in sin, cos or tan is named with its place, once; an angle with its unit and a rate times t are not."""
        for text, told in (("2*cos(30)", "4:42: the argument of cos is 30 without a unit and is taken in rad, 4.77 turns: for degrees write '30 deg'"),
                           ("2*sin(-45)", "the argument of sin is -45 without a unit"), ("2*tan(7)", "the argument of tan is 7"),
                           ("2*cos(30 deg)", None), ("2*cos(30*t)", None), ("2*cos(6)", None), ("2*sin(8*pi)", None), ("2*cos(30 rad)", None), ("2*cosh(3)", None)):
            model = self.model(f"kempe: 1\nparameters: {{k: 1 N*m}}\n{self.BODY}forces: {{motor: {{joint: A, torque: \"k*({text})\"}}}}\n")
            done = self.expect(0, "check", model)
            self.assertEqual(done.stderr.count("turns"), 1 if told else 0, (text, done.stderr))
            self.assertIn(told or "", done.stderr)

    def test_angles_without_a_unit_in_options(self):
        """The coordinate or the parameter is named, with what to write; with its unit there is nothing to say."""
        model = self.model("kempe: 1\nparameters: {tilt: 10 deg, k: 1 N*m}\n" + self.BODY +
                           "forces: {s: {joint: A, torque: -k*(q(A) - tilt) - 0.5*qd(A)}}\nrun: {t_end: 0.2, outputs: [q(A)]}\n")
        self.expect(0, "simulate", model, "-o", "data.csv")
        search = ("optimize", model, "--minimize", "max(qd(A))")
        for words, what in ((("modes", model, "--sweep", "q.A=0:60{}:3"), "sweep: 'q.A'"), (("modes", model, "--sweep", "tilt=0:60{}:3"), "sweep: 'tilt'"),
                            (("cycles", model, "--sweep", "tilt=0:60{}:2", "--outputs", "q(A)"), "sweep: 'tilt'"),
                            (("ensemble", model, "--sample", "q.A=0:60{}", "--instances", 2), "sampling: 'q.A'"), (("ensemble", model, "--sample", "tilt=0:60{}", "--instances", 2), "sampling: 'tilt'"),
                            ((*search, "--parameter", "q.A:0:60{}"), "bounds: 'q.A'"), ((*search, "--parameter", "tilt:0:60{}"), "bounds: 'tilt'"),
                            ((*search, "--parameter", "k:1:2", "--limit", "max(q(A)) < 60{}"), "limit:1:13: the limit of max(q(A))"),
                            (("fit", model, "data.csv", "--columns", "q.A", "--parameter", "q.A:0:60{}"), "bounds: 'q.A'"),
                            (("fit", model, "data.csv", "--columns", "q.A", "--parameter", "k", "--deviations", "q.A=60{}"), "deviations: 'q.A'")):
            for unit in "", " deg":
                done = kempe(*(str(word).format(unit) for word in words), cwd=self.folder)
                told = f"{what} is 60 without a unit and is taken in rad, 9.55 turns: for degrees write '60 deg'"
                self.assertEqual(told in done.stderr, unit == "", (words, unit, done.stderr))
                self.assertIn("turns" if unit == "" else "", done.stderr)
        for name in "q.A", "tilt":
            for unit in "", " [deg]":
                (self.folder / "values.csv").write_text(f"{name}{unit}\n60\n1\n")
                done = kempe("ensemble", model, "--values", "values.csv", cwd=self.folder)
                told = f"values.csv: '{name}' has 60 without a unit and is taken in rad, 9.55 turns: for degrees name the column '{name} [deg]'"
                self.assertEqual(told in done.stderr, unit == "", done.stderr)
        (self.folder / "values.csv").write_text("q.A [mm]\n60\n1\n")
        self.assertIn("values.csv: 'q.A': m is given, but an angle", self.expect(2, "ensemble", model, "--values", "values.csv").stderr)
        self.assertIn("the limit of max(q(A)): expected an angle (rad, deg, rev), got m",
                      self.expect(2, *search, "--parameter", "k:1:2", "--limit", "max(q(A)) < 60 mm").stderr)

    def test_examples_have_no_turns(self):
        for path in sorted(ROOT.glob("examples/*/*.yaml")):
            self.assertNotIn("without a unit and is taken", shown(path).stderr, path)

    def test_a_manifest_is_whole(self):
        study = ["ensemble", FOUR_BAR, "--sample", "crank=0.29:0.31", "--instances", "2", "--t-end", "0.1", "--chunk", "1"]
        self.assertIn("more than 1048576 parts", self.expect(3, *study, "--instances", 2000000, "--out", self.folder / "many").stderr)
        self.expect(0, *study, "--quantity", "a=q(rocker),b=q(coupler)", "--out", "bars.kempe")
        done = self.expect(2, *study, "--quantity", "a=q(rocker),b=q(rocker)", "--out", "bars.kempe", "--resume")
        self.assertIn("quantities", done.stderr)
        manifest = self.folder / "bars.kempe" / "manifest.json"
        text = manifest.read_text()
        for old, new in (('"rtol": ', '"rtol": 1'), ('"seed": ', '"seed": 1'), ("q(coupler)", "q(rocker)")):
            self.assertIn(old, text)
            manifest.write_text(text.replace(old, new))
            done = self.expect(2, "gather", "bars.kempe")
            self.assertIn("manifest.json is damaged", done.stderr)

    def test_what_is_no_checkpoint_of_this_model(self):
        self.expect(0, "simulate", SLIDER_CRANK, "--t-end", "1", "--checkpoint", "run.checkpoint")
        done = self.expect(2, "simulate", ANDREWS, "--resume", "run.checkpoint")
        self.assertRegex(done.stderr, r"run\.checkpoint:1:1: .*another model")
        text = (self.folder / "run.checkpoint").read_text()
        (self.folder / "spoilt").write_text(text[:-20] + "x" + text[-19:])
        done = self.expect(2, "simulate", SLIDER_CRANK, "--t-end", "2", "--resume", "spoilt")
        self.assertIn(": the checkpoint is damaged", done.stderr)
        self.expect(2, "simulate", SLIDER_CRANK, "--resume", SLIDER_CRANK)
        self.expect(3, "simulate", SLIDER_CRANK, "--t-end", "0.5", "--resume", "run.checkpoint")


class Compare(Case):
    RUN = ("compare", ANDREWS, "--rtol", "1e-5,1e-7", "--reference", REFERENCE)

    def test_prescribed_motion(self):
        driven = ROOT / "examples/driven_slider_crank/driven_slider_crank.yaml"
        told = self.expect(0, "compare", driven, "--rtol", "1e-3,1e-5").stdout
        self.assertIn(": no recommendation\n  All motion is prescribed", told)

    def test_keys(self):
        found = self.object(0, *self.RUN)
        self.assertKeys(found, "model status reason build_s reference runs")
        self.assertKeys(found["reference"], "source uncertainty")
        self.assertEqual({run["rtol"] for run in found["runs"]}, {1e-5, 1e-7})
        for run in found["runs"]:
            self.assertKeys(run, "formulation form integrator rtol status reason error residual energy work cpu_s")
            self.assertKeys(run["error"], "q qd lambda")
            self.assertEqual((run["status"], run["reason"] or ""), ("complete", ""), run)
            self.assertLess(run["error"]["q"], 1e-2, run)

    def test_choice(self):
        found = self.object(0, *self.RUN, "--formulations", "dae")
        self.assertEqual({run["formulation"] for run in found["runs"]}, {"dae"})

    def test_same_bytes_twice(self):
        words = (*self.RUN, "--formulations", "reduced")
        first, second = (self.object(0, *words) for _ in range(2))
        self.assertEqual(json.dumps(without_times(first)), json.dumps(without_times(second)))

    def test_csv(self):
        found = self.object(0, *self.RUN, "--formulations", "reduced", "--csv", "table.csv")
        with open(self.folder / "table.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertKeys(rows[0], "formulation form integrator rtol status reason error_q error_qd error_lambda h_max hdot_max drift_rel "
                                 "steps rejected rhs jacobians factorizations exchanges cpu_s difference")
        self.assertEqual(len(rows), len(found["runs"]))
        for row, run in zip(rows, found["runs"]):
            self.assertEqual((row["integrator"], float(row["rtol"]), int(row["rhs"])),
                             (run["integrator"], run["rtol"], run["work"]["rhs"]))
        self.assertEqual(os.listdir(self.folder), ["table.csv"])

    def test_own_reference(self):
        found = self.object(0, "compare", ANDREWS, "--rtol", "1e-5,1e-8", "--formulations", "reduced,projected")
        reference = found["reference"]
        self.assertKeys(reference, "source uncertainty uncertainty_qd uncertainty_lambda until amplification runs")
        self.assertLess(reference["uncertainty"], 1e-11)
        self.assertGreaterEqual(len({run["formulation"] for run in reference["runs"]}), 2)
        self.assertGreaterEqual(len({run["integrator"] for run in reference["runs"]}), 2)

    def test_equal_error_and_advice(self):
        found = self.object(0, *self.RUN)
        ways = {(run["formulation"], run["form"], run["integrator"]) for run in found["runs"]}
        self.assertEqual([round(math.log10(level["error"])) for level in found["equal_error"]], [-k for k in range(3, 12)])
        for level in found["equal_error"]:
            self.assertEqual(level.get("below_reference", False), level["error"] < 9.9 * found["reference"]["uncertainty"], level)
            if level.get("below_reference"):
                continue
            self.assertEqual({(way["formulation"], way["form"], way["integrator"]) for way in level["methods"]}, ways)
            ratios = [way["ratio"] for way in level["methods"] if way["ratio"]]
            self.assertTrue(not ratios or min(ratios) == 1, level)
        advice = found["advice"]
        self.assertIn((advice["formulation"], advice["form"], advice["integrator"]), ways)
        self.assertGreater(len(advice["reasons"]), 2)

    def test_recommendation_begins_the_text(self):
        """Its options choose the recommended method."""
        text = self.expect(0, *self.RUN, "--json", "compared.json").stdout
        first, second, *_ = text.split("\n")
        self.assertRegex(first, r"^\S+: complete, 0 to \S+ s: use( --\S+ \S+)+$")
        self.assertRegex(second, r"^  Error of q at most \S+, in \S+ ms of processor time")
        self.assertLessEqual(max(map(len, text.split("\n"))), 100)
        advice = json.loads((self.folder / "compared.json").read_text())["advice"]
        run = self.object(0, "simulate", ANDREWS, *first.split(": use ")[1].split())
        for key in ("formulation", "form", "integrator", "rtol"):
            self.assertEqual(run[key], advice[key])

    def test_tables(self):
        """Equal integrators on several formulations, and the best of each; ratios are products of their factors."""
        found = self.object(0, "compare", FOUR_BAR, "--rtol", "1e-5,1e-7,1e-9,1e-11", "--t-end", 0.5)
        same = {}
        for way in found["same_integrator"]:
            same.setdefault(way["integrator"], set()).add(way["formulation"])
        self.assertEqual(same, {"dop853": {"reduced", "projected"}, "radau": {"reduced", "projected", "dae"}, "ida": {"reduced", "dae"}})
        best = found["best_of_formulation"]
        self.assertEqual({way["formulation"] for way in best}, {"reduced", "projected", "dae"})
        self.assertEqual([best[0][key] for key in ("formulation", "form", "integrator")],
                         [found["advice"][key] for key in ("formulation", "form", "integrator")])
        for way in found["same_integrator"] + best:
            self.assertEqual([round(math.log10(at["error"])) for at in way["errors"]], [-6, -8])
            for at in way["errors"]:
                if at["ratio"] is not None:
                    product = at["ratio_steps"] * at["ratio_evaluations_per_step"] * at["ratio_time_per_evaluation"]
                    self.assertAlmostEqual(at["ratio"], product, delta=1e-9 * product)
        for run in found["runs"]:
            self.assertGreater(run["first_s"], run["build_s"] + run["cpu_s"])
            if "KEMPE_SANITIZED" not in os.environ:  # their allocator keeps no such count
                self.assertGreater(run["memory_bytes"], 1000)
        self.assertKeys(found["stiffness"], "stiff rtol rtol_tighter explicit_steps explicit_steps_tighter implicit_steps")

    def test_runs_are_details(self):
        text = self.expect(0, "compare", FOUR_BAR, "--t-end", 0.2).stdout
        self.assertIn("--all (99 runs; ", text)
        self.assertLessEqual(len(text.split("\n")), 35)
        full = self.expect(0, "compare", FOUR_BAR, "--t-end", 0.2, "--rtol", "1e-4,1e-6", "--all").stdout
        self.assertEqual(len(re.findall(r"^(?:reduced|projected|dae) .* 1e-0[46] \|.*\|.*\|", full, re.M)), 18)

    def test_budget(self):
        done = self.expect(1, "compare", ANDREWS, "--rtol", "1e-4", "--budget", "1e-9")
        self.assertIn("increase --budget", done.stdout)
        self.assertIn("needs a positive time", self.expect(3, "compare", ANDREWS, "--budget", "0").stderr)

    def test_open_mechanism(self):
        for words in ([], ["--json", "-"]):
            done = self.expect(1, "compare", ROOT / "tests/models/robotran.yaml", *words)
            self.assertIn("cannot be closed", " ".join(done.stdout.split()))
            self.assertNotIn("use ", done.stdout)

    def test_report_in_no_folder(self):
        self.expect(1, *self.RUN, "--report", "no_such_folder/report.html")
        self.assertEqual(os.listdir(self.folder), [])


    def test_errors_hold_between_instants_too(self):
        """Against a run near rounding at twenty thousand instants, by a motion whose errors are short peaks."""
        model = ROOT / "examples/slider_crank/slider_crank.yaml"
        found = self.object(0, "compare", model, "--formulations", "reduced", "--forms", "integrated", "--integrators",
                            "dop853,dopri5", "--rtol", "1e-4,1e-6")
        self.assertEqual(found["reference"]["instants"], 401)
        self.assertIn("Errors: the largest at 401 instants",
                      self.expect(0, "compare", model, "--formulations", "reduced", "--rtol", "1e-4").stdout)
        exact = self.rows(model, "dop853", 1e-13)
        for run in found["runs"]:
            rows = self.rows(model, run["integrator"], run["rtol"])
            error = max(abs(a - b) / max(abs(b), 1) for row, other in zip(rows, exact) for a, b in zip(row, other))
            self.assertGreater(run["error"]["q"], 0.8 * error)
            self.assertLess(run["error"]["q"], 1.001 * error)

    def test_a_short_table_hides_no_errors(self):
        """Errors between the few rows of a table are those against Kempe's own reference, unless the table contradicts it."""
        model, words = ROOT / "examples/slider_crank/slider_crank.yaml", ("--formulations", "reduced", "--rtol", "1e-4,1e-6", "--t-end", 2)
        self.expect(0, "simulate", model, "--rtol", 1e-13, "--t-end", 2, "--output-step", 1, "--no-convergence-check", "-o", "few.csv")
        own, few = self.object(0, "compare", model, *words), self.object(0, "compare", model, *words, "--reference", "few.csv")
        self.assertIn("few.csv, which agrees to", few["reference"]["source"])
        self.assertEqual(few["reference"]["instants"], 402)
        for run, other in zip(few["runs"], own["runs"]):
            self.assertAlmostEqual(run["error"]["q"], other["error"]["q"], delta=0.01 * other["error"]["q"])
        lines = (self.folder / "few.csv").read_text().splitlines()
        table = list(lines)
        column = table[0].split(",").index("q." + "crank")
        wrong = [",".join(str(float(x) + 1e-3) if k == column else x for k, x in enumerate(line.split(","))) for line in table[1:]]
        (self.folder / "wrong.csv").write_text("\n".join([table[0], *wrong]) + "\n")
        found = self.object(0, "compare", model, *words, "--reference", "wrong.csv")
        self.assertEqual((found["reference"]["instants"], found["reference"]["source"]), (3, "wrong.csv"))
        self.assertIn("only at the rows of wrong.csv", " ".join(found["warnings"]))

    def test_errors_do_not_depend_on_the_unit_of_time(self):
        """Rates are relative to the largest rate: a motion ten times as fast has the same errors."""
        text = (ROOT / "tests/models/pendulum.yaml").read_text()
        self.assertIn("gravity: [0, -9.81, 0]", text)
        fast = text.replace("gravity: [0, -9.81, 0]", "gravity: [0, -981, 0]")
        words = ("--formulations", "reduced", "--forms", "integrated", "--integrators", "dop853", "--rtol", "1e-6")
        slow, quick = (self.object(0, "compare", self.model(model), *words, "--t-end", end) for model, end in ((text, 1), (fast, 0.1)))
        self.assertAlmostEqual(quick["reference"]["scales"]["rate"] / slow["reference"]["scales"]["rate"], 10, delta=0.1)
        errors = [found["runs"][0]["error"]["qd"] for found in (slow, quick)]
        self.assertLess(abs(math.log(errors[0] / errors[1])), 1)

    def test_linear_solvers(self):
        found = self.object(0, "compare", FOUR_BAR, "--linear", "klu,dense", "--formulations", "dae", "--rtol", "1e-5,1e-7", "--t-end", 0.2)
        by_ida = [run for run in found["runs"] if run["integrator"] == "ida"]
        self.assertEqual([run["linear"] for run in by_ida], ["klu", "klu", "dense", "dense"])
        self.assertEqual([run["work"]["rhs"] > 0 for run in by_ida], [True] * 4)
        self.assertIn("stabilized1 ida/dense", self.expect(0, "compare", FOUR_BAR, "--linear", "dense", "--formulations", "dae", "--rtol",
                                                               "1e-5", "--t-end", 0.2).stdout)
        self.assertIn("unknown linear solver 'abacus'; available: auto", self.expect(3, "compare", FOUR_BAR, "--linear", "klu,abacus").stderr)

    def rows(self, model, integrator, rtol):
        coarse = integrator == "dopri5" and rtol > 1e-5  # the energy is off by 0.5 %
        self.expect(5 if coarse else 0, "simulate", model, "--integrator", integrator, "--rtol", rtol, "--output-step", 10 / 20000, "--no-convergence-check",
                    "-o", "rows.csv")
        lines = (self.folder / "rows.csv").read_text().splitlines()
        columns = [k for k, name in enumerate(lines[0].split(",")) if name.startswith("q.")]
        return [[float(line.split(",")[k]) for k in columns] for line in lines[1:]]

    def test_multipliers_that_are_not_unique_have_no_error(self):
        done = self.object(0, "compare", ROOT / "tests/models/bennett_balls.yaml", "--rtol", "1e-6", "--t-end", 1)
        self.assertTrue(all(run["error"]["lambda"] is None for run in done["runs"]))
        self.assertIn("6 of 6 multipliers are not unique", "".join(done["warnings"]))
        # Friction that slips has a given force, and no redundant constraint.
        slips = self.model("kempe: 1\nbodies: {a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}}\nforces: {f: {joint: X, friction: {force: 0.5}}}\n"
                           "start: {qd: {X: 1}}\nrun: {t_end: 1}\n")
        self.assertNotIn("not unique", "".join(self.object(0, "compare", slips)["warnings"]))

    def test_small_loads_are_held_against_large_ones(self):
        """A model whose forces are all a millionth has the same errors of lambda."""
        text = FOUR_BAR.read_text()
        light = text.replace("crank_mass: 1, coupler_mass: 1, rocker_mass: 1",
                             "crank_mass: 1e-6, coupler_mass: 1e-6, rocker_mass: 1e-6")
        self.assertNotEqual(text, light)
        errors = [self.object(0, "compare", self.model(model), "--formulations", "reduced", "--forms", "integrated",
                              "--integrators", "dop853,dopri5", "--rtol", "1e-6", "--t-end", 1)["runs"][0]["error"]["lambda"]
                  for model in (text, light)]
        self.assertLess(abs(errors[0] - errors[1]), 1e-2 * errors[0])


class ProfileFiles(Case):
    """Profiles of measuring instruments and other programs: the same cross-section in each format."""
    MODEL = """kempe: 1
profiles: {p: {%s}}
bodies: {a: {joint: {revolute: z, at: ground}}}
"""

    def profile(self, name, text, more=""):
        (self.folder / name).write_text(text)
        (self.folder / "model.yaml").write_text(self.MODEL % f"file: {name}{more}")
        made = self.object(0, "show", "model.yaml", "--model")["profiles"]["p"]
        return list(zip(made["y"], made["z"]))

    def refused(self, name, text, said):
        (self.folder / name).write_text(text)
        (self.folder / "model.yaml").write_text(self.MODEL % f"file: {name}")
        self.assertIn(said, self.expect(2, "show", "model.yaml", "--model").stderr)

    def same(self, points, wanted):
        self.assertEqual(len(points), len(wanted), points)
        for a, b in zip(points, wanted):
            self.assertAlmostEqual(a[0], b[0] / 1000, delta=1e-12)
            self.assertAlmostEqual(a[1], b[1] / 1000, delta=1e-12)

    # y outwards, z upwards, mm: a wheel with its flange at -50, a rail that is worn on its gauge side.
    WHEEL = [(-70, -12), (-60, -26), (-50, -28), (-40, -18), (-30, -4), (0, 0), (30, 1), (60, 2)]
    RAIL = [(-34, -16), (-30, -9), (-20, -3), (0, 0), (20, -1), (30, -6), (36, -16)]

    @staticmethod
    def rows(points, change, behind=""):
        return "".join("%.6f   %.6f%s\n" % (*change(*point), behind) for point in points)

    @staticmethod
    def simpack(kind, rows, options=""):
        return ("! profile\nheader.begin\n  version = 1\n  type = %d ! kind\nheader.end\nspline.begin\n"
                "  units.len.f = +1.0E+03\n  comment = 'one'\n%s  point.begin\n! y z\n%s  point.end\nspline.end\n" % (kind, options, rows))

    def test_miniprof(self):
        head = "Chars=Win\n\"RefPoint1=\"\nXYPoints=%d\nXOffset=0.0000\nColumnDef=%s\n\n"
        rail = self.rows(self.RAIL, lambda y, z: (-y, z), " 0.1 0.2")
        self.same(self.profile("up.ban", head % (7, "X,Y,A,C") + rail), self.RAIL)
        self.same(self.profile("down.BAN", head % (8, "Y,X") + '"0 0\n' + self.rows(self.RAIL, lambda y, z: (-z, -y))), self.RAIL)
        wheel = self.rows(self.WHEEL, lambda y, z: (y + 70, -z))
        self.same(self.profile("wheel.whl", head % (8, "X,Y") + wheel, ", origin: 70 mm"), self.WHEEL)
        self.same(self.profile("old.whl", "#MINIWHEELPROF\nx.whl\nMINIPROF 2020\nStock.......:\n\" 32.58 37.11\n(Sd/Sh/qR)\n\n" + wheel),
                  [(y + 70, z) for y, z in self.WHEEL])

    def test_comments_of_miniprof(self):
        """Behind a percent sign, an exclamation mark or a quotation mark, in headers and behind rows."""
        wheel = self.rows(self.WHEEL, lambda y, z: (y + 70, -z), " % worn")
        wanted = [(y + 70, z) for y, z in self.WHEEL]
        for name, head in {"new": "% MINIPROF, made by hand\nXYPoints=8 % points\n! 3 = 4\nColumnDef=X,Y\n\n% rows\n",
                           "no header": "% MINIPROF\n% a = b\n% c\n% d\n",
                           "old": "% one\n% two\n#MINIWHEELPROF\n% three\nMINIPROF 2020\n% four\nStock....:\n! five\n(Sd)\n\n% six\n"}.items():
            with self.subTest(name):
                self.same(self.profile("p.whl", head + wheel), wanted)

    def test_simpack(self):
        self.same(self.profile("r.prr", self.simpack(0, self.rows(self.RAIL, lambda y, z: (y, -z), " 1.0"))), self.RAIL)
        mirrored = self.rows(reversed(self.WHEEL), lambda y, z: (-y - 1, -z + 2))
        self.same(self.profile("w.prw", self.simpack(1, mirrored, "  shift.y = 1\n  shift.z = -2.\n  mirror.y = 1 ! 0 or 1\n")), self.WHEEL)
        self.same(self.profile("m.prw", self.simpack(1, self.rows(self.WHEEL, lambda y, z: (-z, -y)),
                                                     "  rotate = 90\n  units.ang.f = 57.295779513082323\n")
                               ), self.WHEEL)
        bounds = "  bound.y.min = -31\n  bound.y.max = 31\n"
        self.same(self.profile("b.prr", self.simpack(0, self.rows(self.RAIL, lambda y, z: (y, -z)), bounds)), self.RAIL[1:-1])

    def test_parts_that_cannot_touch(self):
        """The side of a rail below its widest place, the back of a flange that overhangs, a point twice."""
        rail = [(-33, -30), (-34, -20), *self.RAIL[:3], self.RAIL[2], *self.RAIL[3:], (36, -25), (35, -30)]
        self.same(self.profile("r.prr", self.simpack(0, self.rows(rail, lambda y, z: (y, -z)))), self.RAIL)
        wheel = [(-69, 0), (-70, -5), *self.WHEEL]
        self.same(self.profile("w.prw", self.simpack(1, self.rows(wheel, lambda y, z: (y, -z)))), self.WHEEL)

    def test_the_example(self):
        points = self.profile("s1002.whl", (ROOT / "examples/profiles/s1002.whl").read_text(), ", origin: 70 mm")
        with open(ROOT / "examples/profiles/s1002.csv", newline="") as file:
            wanted = [(float(row["y"]), float(row["z"])) for row in csv.DictReader(line for line in file if line[0] != "#")]
        self.assertEqual(len(points), len(wanted))
        for a, b in zip(points, wanted):
            self.assertLess(max(abs(a[0] - b[0]), abs(a[1] - b[1])), 1.1e-7, "four decimals of a mm")

    def test_an_origin_between_points_lies_on_the_profile(self):
        parabola = [(y, -y * y / 100) for y in range(-30, 31)]
        points = self.profile("r.prr", self.simpack(0, self.rows(parabola, lambda y, z: (y, -z))), ", origin: 10.5 mm")
        for y, z in points:
            self.assertAlmostEqual(z, -((1000 * y + 10.5) ** 2 - 10.5 ** 2) / 1e5, delta=1e-9)

    def test_refused(self):
        rail = self.rows(self.RAIL, lambda y, z: (y, -z))
        self.refused("a.prr", self.simpack(0, rail.replace("-30.000000", "-3x")), "a.prr:12:1: profile 'p': a number is expected here")
        self.refused("b.prr", self.simpack(1, rail), "b.prr:4:3: profile 'p': type is 0 for a rail (.prr) and 1 for a wheel (.prw)")
        self.refused("c.prr", self.simpack(0, rail).replace("units.len.f", "units.len"), "profile 'p': the file needs units.len.f")
        self.refused("d.prr", self.simpack(0, rail).partition("  point.end")[0], "profile 'p': the file ends without point.end")
        self.refused("e.ban", "XYPoints=9\n\n1 2\n2 3 4\n", "e.ban:4:1: profile 'p': XYPoints is 9, but the file ends after 2 points")
        self.refused("f.ban", "XYPoints=2\n\n1 2\n2 \n", "f.ban:4:3: profile 'p': a number is expected here")
        self.refused("g.ban", "ColumnDef=X,Z\n\n1 2\n", "g.ban:1:1: profile 'p': ColumnDef must name X and Y")
        self.refused("h.ban", "\n", "model.yaml:2:15: profile 'p': a profile needs at least four points, not 0")
        self.refused("i.txt", rail, "model.yaml:2:22: profile 'p': the ending of 'i.txt' must be .ban or .whl (MiniProf), .prr or .prw (Simpack)")
        (self.folder / "model.yaml").write_text(self.MODEL % "file: a.prr, unit: mm")
        self.assertIn("model.yaml:2:35: profile 'p': 'unit' does not go with 'file'", self.expect(2, "show", "model.yaml", "--model").stderr)
        (self.folder / "k.prr").write_text(self.simpack(0, rail))
        (self.folder / "model.yaml").write_text(self.MODEL % "file: k.prr, origin: 40 mm")
        self.assertIn("model.yaml:2:37: profile 'p': the origin must be between -0.034 m and 0.036 m", self.expect(2, "show", "model.yaml", "--model").stderr)


class Guidance(Case):
    def test_sums_of_contacts(self):
        """Q and Y are components of the total force, Y outwards on both sides; the wear number is a sum over contacts."""
        for name in ("curving", "profiles"):
            shutil.copytree(ROOT / "examples" / name, self.folder / name)
        model = self.folder / "curving/curving.yaml"
        model.write_text(model.read_text().replace("outputs: [q, qd,", "outputs: [guidance(FL), guidance(FR), q, qd,"))
        self.expect(0, "simulate", model, "--t-end", "3", "--no-convergence-check", "-o", "rows.csv")
        with open(self.folder / "rows.csv", newline="") as table:
            last = {name: float(x) for name, x in list(csv.DictReader(table))[-1].items() if x}
        for wheel, outwards in (("FL", 1), ("FR", -1)):
            load, lateral = last[f"guidance.{wheel}.Q"], last[f"guidance.{wheel}.Y"]
            self.assertAlmostEqual(load, last[f"force.{wheel}.z"], delta=1e-9 * load)
            self.assertAlmostEqual(lateral, -outwards * last[f"force.{wheel}.y"], delta=1e-9 * load)
            self.assertAlmostEqual(last[f"guidance.{wheel}.YQ"], lateral / load, delta=1e-12)
            wear = sum(abs(last[f"contact.{wheel}.{k}.{way}"] * last[f"contact.{wheel}.{k}.creep_{way}"])
                       for k in range(1, 9) if f"contact.{wheel}.{k}.N" in last for way in ("along", "across"))
            self.assertAlmostEqual(last[f"guidance.{wheel}.wear"], wear, delta=1e-9 * wear)
            self.assertGreater(lateral, 0.1 * load, "both wheels of the front axle are pressed outwards by their creep")


    @long_motion
    def test_limits_of_a_run(self):
        """Extremes, means and limits of Q, Y/Q and the wear number as quantities, against the rows of the same run."""
        model, names = ROOT / "examples/curving/curving.yaml", "Q Y YQ wear".split()
        text = model.read_text().replace("examples/", str(ROOT / "examples") + "/").replace("../", str(ROOT / "examples") + "/")
        (self.folder / "model.yaml").write_text(re.sub(r"outputs: \[[^]]*\]", "outputs: [guidance(FL)]", text))
        common = ("model.yaml", "--t-end", "0.5", "--no-convergence-check")
        self.expect(0, "simulate", *common, "--output-step", "0.00005", "-o", "rows.csv")
        with open(self.folder / "rows.csv", newline="") as table:
            rows = [{name: float(row[f"guidance.FL.{name}"]) for name in names} for row in csv.DictReader(table)]
        (self.folder / "values.csv").write_text("V\n15\n")
        self.expect(0, "ensemble", *common, "--values", "values.csv", "-o", "ends.csv",
                    "--quantity", "end = guidance(FL).Y, load = min(guidance(FL).Q), wear = mean(guidance(FL).wear)",
                    "--limit", "at(guidance(FL).YQ, 0.25) < 0.8, load > 900 kN")
        with open(self.folder / "ends.csv", newline="") as table:
            found = next(csv.DictReader(table))
        least, load = min(row["Q"] for row in rows), rows[-1]["Q"]
        self.assertGreater(load, 1e4)
        self.assertAlmostEqual(float(found["end"]), rows[-1]["Y"], delta=1e-5 * load)
        self.assertAlmostEqual(float(found["at(guidance(FL).YQ, 0.25)"]), rows[(len(rows) - 1) // 2]["YQ"], delta=1e-5)
        self.assertAlmostEqual(float(found["load"]), least, delta=1e-4 * load)
        mean = sum((a["wear"] + b["wear"]) / 2 for a, b in zip(rows, rows[1:])) / (len(rows) - 1)
        self.assertAlmostEqual(float(found["wear"]), mean, delta=1e-3 * mean)
        self.assertEqual((found["limits"], found["broken"]), ("fail", "load > 900 kN"))
        said = self.expect(2, "ensemble", *common, "--values", "values.csv", "--quantity", "t, max(guidance(FL).waer)").stderr
        self.assertEqual(said, "quantity:1:8: 'guidance(FL).waer': unknown component of guidance 'waer'; available: Q, Y, YQ, wear; "
                         "did you mean 'wear'?\n")


class RunningSafety(Case):
    """Values of running safety against the rows of the same run, and against formulas."""

    def run_curve(self, *options):
        text = (ROOT / "examples/curving/curving.yaml").read_text().replace("../", str(ROOT / "examples") + "/")
        outputs = "outputs: [guidance(FL), guidance(FR), velocity(front.L), velocity(front.R), q, qd,"
        (self.folder / "model.yaml").write_text(text.replace("outputs: [q, qd,", outputs))
        done = self.expect(0, "simulate", "model.yaml", "--no-convergence-check", "--json", "run.json", *options)
        with open(self.folder / "run.json") as file:
            return done.stdout, json.load(file)["running_safety"]

    @staticmethod
    def means_over(length, way, force):
        """Of a force over the way before each row from 200 on, by the trapezoidal rule on the rows."""
        steps = ((b - a) * (x + y) / 2 for a, b, x, y in zip(way, way[1:], force, force[1:]))
        integral = [0.0, *itertools.accumulate(steps)]
        for at in range(200, len(way)):
            k = bisect.bisect_left(way, way[at] - length)
            part = way[k] - (way[at] - length)
            slope = (force[k] - force[k - 1]) / (way[k] - way[k - 1])
            yield (integral[at] - integral[k] + part * (force[k] - part * slope / 2)) / length

    @staticmethod
    def filtered(force):
        """Rows of 1 ms through Butterworth's filter of 20 Hz as two sections of second degree, by the bilinear transform."""
        k = 1 / math.tan(math.pi * 20 * 1e-3)
        for damping in (2 * math.sin(math.pi / 8), 2 * math.cos(math.pi / 8)):
            a = [k * k + damping * k + 1, 2 - 2 * k * k, k * k - damping * k + 1]
            x, y = [force[0]] * 2 + list(force), [force[0]] * 2
            for n in range(2, len(x)):
                y.append((x[n] + 2 * x[n - 1] + x[n - 2] - a[1] * y[n - 1] - a[2] * y[n - 2]) / a[0])
            force = y[2:]
        return force

    @long_motion
    def test_against_rows(self):
        # Samples are at the ends of steps and between them: with shorter steps the means do not depend on where they fall.
        text, safety = self.run_curve("--t-end", 4, "--output-step", 0.001, "--max-step", 0.005, "-o", "rows.csv")
        with open(self.folder / "rows.csv", newline="") as file:
            rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
        across, ways, axle = {}, {}, safety["axles"][0]
        for number, (wheel, point) in enumerate((("FL", "front.L"), ("FR", "front.R"))):
            speed = [sum(row[f"velocity.{point}.{x}"] ** 2 for x in "xyz") ** 0.5 for row in rows]
            way = ways[wheel] = [0.0]
            for a, b, before, after in zip(speed, speed[1:], rows, rows[1:]):
                way.append(way[-1] + (after["t"] - before["t"]) * (a + b) / 2)
            ratio = [row[f"guidance.{wheel}.YQ"] for row in rows]
            load, across[wheel] = (self.filtered([row[f"guidance.{wheel}.{force}"] for row in rows]) for force in "QY")
            found = safety["wheels"][number]
            means = self.means_over(2, way, [y / q if q > 0 else 0 for y, q in zip(across[wheel], load)])
            self.assertEqual(found["name"], wheel)
            self.assertAlmostEqual(found["YQ_mean"]["value"], max(means), delta=1e-4)
            loaded = [y for row, y in zip(rows, ratio) if row[f"guidance.{wheel}.Q"] > 0.05 * found["Q0"]]
            self.assertAlmostEqual(found["YQ"]["value"], max(loaded), delta=5e-3)
            self.assertAlmostEqual(found["nadal"], (math.tan(found["flange_angle"]) - 0.3) / (1 + 0.3 * math.tan(found["flange_angle"])), delta=1e-12)
            self.assertAlmostEqual(math.degrees(found["flange_angle"]), 70, delta=0.1)
            self.assertAlmostEqual(found["Q0"], 22400 * 9.81 / 4, delta=1)
            least = min(row[f"guidance.{wheel}.Q"] for row in rows)
            self.assertAlmostEqual(found["unloading"]["value"], 1 - least / found["Q0"], delta=1e-3)
            self.assertAlmostEqual(found["unloading_filtered"]["value"], 1 - min(load) / found["Q0"], delta=1e-3)
            self.assertEqual(found["kept"], True)
            wear = [row[f"guidance.{wheel}.wear"] for row in rows]  # rows of 1 ms; samples are up to 40 ms apart
            mean = sum((b - a) * (x + y) / 2 for a, b, x, y in zip(way, way[1:], wear, wear[1:])) / way[-1]
            self.assertGreater(mean, 1)
            self.assertAlmostEqual(found["wear_mean"], mean, delta=5e-3 * mean)
            self.assertAlmostEqual(found["wear"]["value"], max(wear), delta=1e-2 * max(wear))
            self.assertAlmostEqual(found["wear"]["t"], rows[wear.index(max(wear))]["t"], delta=0.05)
        total = [left - right for left, right in zip(across["FL"], across["FR"])]
        mean = max(map(abs, self.means_over(2, ways["FL"], total)))
        self.assertAlmostEqual(axle["Y_mean"]["value"], mean, delta=2e-4 * 1e5)
        self.assertGreater(mean, 5000)
        self.assertAlmostEqual(axle["prudhomme"], 10e3 + 22400 * 9.81 / 2 / 3, delta=1)
        self.assertAlmostEqual(safety["way"], 60, delta=0.1)
        self.assertEqual(safety["Q0_at"], "equilibrium")
        self.assertAlmostEqual(safety["carried"], 1, delta=1e-6)
        self.assertLess(safety["difference"], 0.01)
        self.assertIn("Prud'homme's limit 46.624 kN", text)
        self.assertRegex(text, rf"FL +{safety['wheels'][0]['wear_mean']:.2f} +{safety['wheels'][0]['wear']['value']:.1f} ")

    def test_resumed(self):
        """Behind a checkpoint: the part is named, and loads at its beginning are not those of the start. No equilibrium is found, for a rotor turns faster and faster."""
        text = (ROOT / "examples/restrained_wheelset/wheelset_on_rails.yaml").read_text()
        text = text.replace("\nbodies:\n", "\nbodies:\n  rotor: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n", 1)
        text = text.replace("\nforces:\n", "\nforces:\n  drive: {joint: rotor, torque: 1}\n  lift: {joint: z, force: \"if(t < 0.1, 0, 50 kN)\"}\n", 1)
        (self.folder / "model.yaml").write_text(text)
        self.expect(0, "simulate", "model.yaml", "--t-end", 0.2, "--checkpoint", "run.checkpoint", "--json", "run.json", "--no-convergence-check")
        begun = json.loads((self.folder / "run.json").read_text())["running_safety"]
        self.assertEqual((begun["from"], begun["Q0_at"], round(begun["wheels"][0]["Q0"])), (0, "start", 75000))
        done = self.expect(0, "simulate", "model.yaml", "--t-end", 0.4, "--resume", "run.checkpoint", "--json", "run.json", "--no-convergence-check")
        safety = json.loads((self.folder / "run.json").read_text())["running_safety"]
        self.assertEqual((safety["from"], safety["Q0_at"]), (0.2, "unknown"))
        self.assertAlmostEqual(safety["way"], 16, delta=0.1)
        self.assertEqual([(wheel["Q0"], wheel["unloading"]["value"]) for wheel in safety["wheels"]], [(None, None)] * 2)
        self.assertIn("travelled from t = 0.2 s on, where the checkpoint ends; Q0 unknown", " ".join(done.stdout.split()))

    def test_independent_wheels(self):
        """Wheels that turn each on its own: pairs of opposite ones, with the load of both."""
        self.expect(0, "simulate", ROOT / "examples/tram/tram.yaml", "--t-end", 0.3, "--no-convergence-check", "--json", "run.json")
        safety = json.loads((self.folder / "run.json").read_text())["running_safety"]
        load = {wheel["name"]: wheel["Q0"] for wheel in safety["wheels"]}
        self.assertEqual([(axle["left"], axle["right"]) for axle in safety["axles"]], [(f"{bogie}_{end}L", f"{bogie}_{end}R") for bogie in "abc" for end in "FR"])
        for axle in safety["axles"]:
            self.assertAlmostEqual(axle["prudhomme"], 10e3 + (load[axle["left"]] + load[axle["right"]]) / 3, delta=0.1)
            self.assertLess(axle["Y_mean"]["value"], axle["prudhomme"])

    def test_too_short(self):
        text, safety = self.run_curve("--t-end", 0.1)
        self.assertIn("the distance is too short for means over 2 m", text)
        self.assertEqual((safety["wheels"][0]["YQ_mean"]["value"], safety["wheels"][0]["kept"]), (None, None))

    @long_motion
    def test_a_limit_that_is_not_kept(self):
        text, safety = self.run_curve("--t-end", 3.1, "--set", "R=120", "--set", "V=22", "--set", "cant=0")
        self.assertEqual([axle["kept"] for axle in safety["axles"]], [False, False])
        self.assertEqual([wheel["kept"] for wheel in safety["wheels"]], [True] * 4)
        self.assertEqual(text.count("above the limit"), 2)

    def test_oscillations_between_samples(self):
        """Loads that have whole periods between samples of 5 ms: the filter of 20 Hz leaves 0.001 of Q0, by its start."""
        text = (ROOT / "examples/restrained_wheelset/hunting_wheelset.yaml").read_text()
        model = self.folder / "shaken.yaml"
        for frequency in (391.7, 400, 800):
            model.write_text(text.replace("force: -load}", f"force: -load - 45 kN*sin(2*pi*{frequency}*t)}}"))
            done = self.expect(0, "simulate", model, "--t-end", "0.3", "--no-convergence-check", "--json", "-")
            for wheel in json.loads(done.stdout)["running_safety"]["wheels"]:
                self.assertAlmostEqual(wheel["unloading"]["value"], 0.3, delta=0.002)
                self.assertLess(wheel["unloading_filtered"]["value"], 0.002)

    def test_unloaded_wheels(self):
        """The answer says that wheels lose their load though all limits are kept, or how much of it is left."""
        text = (ROOT / "examples/restrained_wheelset/wheelset_on_rails.yaml").read_text().replace("outputs: [q, lambda(L), lambda(R)]", "outputs: [q]")
        for part, words in ((1.3, "2 of 2 wheels without load at times ('L' at t = "), (0.3, "1 limit kept; least load of a wheel 0.")):
            form = text.replace("rigid", "elastic") if part > 1 else text
            (self.folder / "model.yaml").write_text(form.replace("force: -load}", f"force: '-load*(1 + {part}*sin(2*pi*20*t))'}}"))
            done = self.expect(0, "simulate", "model.yaml", "--no-convergence-check", "--t-end", 0.2, "--json", "run.json")
            line = re.search(r"^safety +(.*\n.*)", done.stdout, re.M)[1]
            self.assertTrue(line.startswith(words) and "1 limit kept" in line, line)
            unloading = max(wheel["unloading"]["value"] for wheel in json.loads((self.folder / "run.json").read_text())["running_safety"]["wheels"])
            self.assertEqual(unloading >= 1, part > 1)
            if part < 1:
                self.assertAlmostEqual(float(re.search(r"least load of a wheel (\S+)", line)[1]), 1 - unloading, delta=1e-3)


class Trust(Case):
    """One policy: the status word in text and object, and the exit code that belongs to it."""

    def judged(self, code, word, *words):
        done = kempe(*words, cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertIn(f": {word}, ", done.stdout.split("\n")[0])
        self.assertEqual(self.object(code, *words)["status"], word)
        return done

    def test_loose_tolerances(self):
        """A(60 s) is 1109.540 at 1e-6 to 1e-12, and 0.36 rad more at 1e-4."""
        self.expect(0, "new", "four_bar.yaml")
        words = "simulate", "four_bar.yaml", "--set", "crank=0.2", "--t-end", 60
        for rtol in "1e-3", "1e-4":
            done = self.judged(5, "not trustworthy", *words, "--rtol", rtol)
            self.assertRegex(done.stderr, r"'[ABD]' differs by \S+ rad at t = ")
        self.judged(0, "complete", *words, "--rtol", "1e-6")
        self.assertAlmostEqual(self.object(0, *words, "--rtol", "1e-6")["q"]["A"], 1109.540, delta=2e-3)
        self.judged(0, "complete, not checked", *words, "--rtol", "1e-6", "--no-convergence-check")

    def test_status_in_parquet(self):
        """Tables of results carry their status as a note, which readers of Parquet show as metadata."""
        table = "kempe: 1\ntables: {f: {x: [0, END], y: [0, 1], method: linear}}\nbodies: {a: {joint: {name: S, prismatic: x, at: ground}, mass: 1}}\n" \
                "forces: {f: {joint: S, force: f(t)}}\nrun: {t_end: 1}\n"
        for end, code, word in ((2, 0, b"complete"), (0.5, 5, b"not trustworthy")):
            self.expect(code, "simulate", self.model(table.replace("END", str(end))), "-o", "run.parquet")
            foot = (self.folder / "run.parquet").read_bytes()
            self.assertIn(b"status", foot)
            self.assertIn(word, foot)
            self.assertEqual(word == b"complete", b"not trustworthy" not in foot)

    def test_an_end_that_the_model_requests_is_complete(self):
        """Thrown up at 5 m/s: 1 m at 5 t - 9.81/2 t^2 = 1, which the repeat finds at the same time."""
        path = self.model("kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {ball: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\n"
                          "start: {qd: {z: 5}}\nrun: {t_end: 2, until: q(z) > 1}\n")
        done = self.judged(0, "complete", "simulate", path)
        self.assertIn("the run ends as requested: q(z) > 1", done.stdout)
        self.assertAlmostEqual(self.object(0, "simulate", path)["t"], (5 - (25 - 2 * 9.81) ** 0.5) / 9.81, delta=1e-8)

    def test_instances_that_do_not_end(self):
        (self.folder / "values.csv").write_text("crank\n0.3\n50\n")
        words = "ensemble", FOUR_BAR, "--values", "values.csv", "--t-end", "0.1"
        self.judged(5, "not trustworthy", *words)
        self.expect(5, *words, "--out", "bars.kempe")
        self.judged(5, "not trustworthy", "gather", "bars.kempe")
        (self.folder / "values.csv").write_text("crank\n40\n50\n")
        self.expect(1, *words, "--out", "none.kempe")
        done = self.judged(1, "failed", "gather", "none.kempe")
        self.assertIn("no instance reached its end: 2", done.stderr)
        self.expect(1, "gather", "none.kempe", "-o", "none.csv")
        self.assertEqual((self.folder / "none.csv").read_text().count("failed"), 2)


class Comfort(Case):
    """Weighted accelerations and ride indices against closed forms and another program's filters."""

    SINE = """kempe: 1
gravity: [0, 0, -9.81]
parameters: {A: 1, f: 8}
bodies: {car: {joint: {name: z, prismatic: z, at: ground}, mass: 1, points: {P: [0, 0, 0]}}}
drives: {d: {joint: z, displacement: "-A/(2*pi*f)^2*sin(2*pi*f*t)"}}
sensors: {worse: 2*sin(2*pi*f*t)}
run: {t_end: 20, outputs: [q, acceleration(car.P), sensor(worse)]}
"""

    @staticmethod
    def gain(f, f4, step=None):
        """The modulus of a weighting, from the formula of EN 12299 in complex numbers."""
        s, (w1, w2, w4) = 2j * math.pi * f, (2 * math.pi * x for x in (0.4, 100, f4))
        h = s**2 / (s**2 + 2**0.5 * w1 * s + w1**2) * w2**2 / (s**2 + 2**0.5 * w2 * s + w2**2)
        h *= (1 + s / w4) / (1 + s / (0.63 * w4) + (s / w4) ** 2)
        if step:
            w5, w6 = 2 * math.pi * 2.5, 2 * math.pi * 4
            h *= 0.4 * (1 + s / (0.8 * w5) + (s / w5) ** 2) / (1 + s / (0.8 * w6) + (s / w6) ** 2)
        return abs(h)

    def judge(self, *options):
        text = self.expect(0, "comfort", "model.yaml", *options, "--json", "-").stdout
        return json.loads(text)

    def setUp(self):
        super().setUp()
        (self.folder / "model.yaml").write_text(self.SINE)

    def test_sines(self):
        axis = "acceleration(car.P).z"
        for f in (0.6, 1, 2, 8, 16, 40):
            found = self.judge("--set", f"f={f}", "--from", 10, "--vertical", axis, "--lateral", axis, "--seat-back", axis)
            signals = {s["direction"]: s for s in found["signals"]}
            for direction, weight in (("vertical", self.gain(f, 16, True)), ("lateral", self.gain(f, 2)), ("seat back", self.gain(f, 8))):
                for value in ("weighted", "median", "percentile_95", "largest"):
                    self.assertAlmostEqual(signals[direction][value] / (weight / 2**0.5), 1, delta=1e-4 if f < 30 else 3e-3, msg=f"{direction} at {f} Hz")
                self.assertAlmostEqual(signals[direction]["rms"], 2**-0.5, delta=1e-6)
            if f < 30:
                for direction, c in (("vertical", 0.588), ("lateral", 0.737)):
                    b = c * ((1.911 * f**2 + (0.25 * f**2) ** 2) / ((1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2)) ** 0.5
                    self.assertAlmostEqual(signals[direction]["Wz"], (100 * b / 2**0.5) ** (2 / 6.67), delta=1e-4)

    def test_published_factors(self):
        """Wd at third octaves from 0.5 to 10 Hz in thousandths, from ISO 2631-1:1997, table 3, as others have copied it."""
        nominal = (0.5, 0.63, 0.8, 1, 1.25, 1.6, 2, 2.5, 3.15, 4, 5, 6.3, 8, 10)
        for f, factor in zip(nominal, (853, 944, 992, 1011, 1008, 968, 890, 776, 642, 512, 409, 323, 253, 201)):
            self.assertAlmostEqual(1000 * self.gain(f, 2), factor, delta=1, msg=f"{f} Hz")

    def test_a_seat(self):
        """Wk at third octaves in thousandths, from ISO 2631-1:1997, table 3, as others have copied it."""
        for f, factor in ((0.5, 418), (1, 482), (2, 531), (4, 967), (5, 1039), (8, 1036), (16, 768), (31.5, 405)):
            found = self.judge("--set", f"f={f}", "--from", 10, "--seat", "acceleration(car.P).z")["signals"][0]
            self.assertEqual((found["direction"], found["weighting"], found["Wz"]), ("seat", "Wk", None))
            self.assertAlmostEqual(found["weighted"] * 2**0.5 * 1000, factor, delta=4 if f > 20 else 1, msg=f"{f} Hz")

    def test_another_program(self):
        model, axes = ROOT / "examples/ride/shaken_seat.yaml", {"longitudinal": "x", "lateral": "y", "vertical": "z", "seat-back": "x"}
        options = [word for name, axis in axes.items() for word in (f"--{name}", f"acceleration(seat.floor).{axis}")]
        self.expect(0, "comfort", model, *options, "--from", 5, "--rate", 2000, "-o", "windows.csv")
        with open(self.folder / "windows.csv", newline="") as table:
            found = [list(map(float, row)) for row in list(csv.reader(table))[1:]]
        with open(ROOT / "examples/ride/shaken_seat.csv", newline="") as table:
            wanted = list(csv.DictReader(line for line in table if line[0] != "#"))
        self.assertEqual([row[0] for row in found], [float(row["t"]) for row in wanted])
        for row, known in zip(found, wanted):
            for value, name in zip(row[1:], ("along_Wd", "across_Wd", "up_Wb", "along_Wc")):
                self.assertAlmostEqual(value, float(known[name]), delta=2e-6)
        whole = json.loads(self.expect(0, "comfort", model, "--from", 5, "--json", "-").stdout)
        self.assertEqual([s["direction"] for s in whole["signals"]], ["longitudinal", "lateral", "vertical"])
        squares = [s["percentile_95"] ** 2 for s in whole["signals"]]
        self.assertAlmostEqual(whole["mean_comfort"][0], 6 * sum(squares) ** 0.5, delta=1e-12)

    def test_a_sensor_and_percentiles(self):
        found = self.judge("--vertical", "sensor(worse)", "--from", 10)["signals"][0]
        self.assertAlmostEqual(found["weighted"], 2 * self.gain(8, 16, True) / 2**0.5, delta=1e-4)
        (self.folder / "model.yaml").write_text(self.SINE.replace("worse: 2*sin", "worse: t*sin"))
        found = self.judge("--vertical", "sensor(worse)", "--t-end", 25)["signals"][0]
        known = sorted(found["windows"])
        self.assertEqual(len(known), 5)
        self.assertAlmostEqual(found["median"], known[2], delta=1e-12)
        self.assertAlmostEqual(found["percentile_95"], known[3] + 0.8 * (known[4] - known[3]), delta=1e-12)

    def test_mistakes(self):
        for options, said in {("--t-end", 3): "windows of 5 s, but the run has 3 s",
                              ("--vertical", "q(z)"): "vertical: 'q.z' has the unit m; an acceleration in m/s^2 is needed",
                              ("--lateral", "acceleration(car.P)"): "lateral: 'acceleration(car.P)' has 3 values",
                              ("--vertical", "acceleration(car.Q).z"): "body 'car' has no point 'Q'",
                              ("--rate", 100): "it must be between 400 and 20000"}.items():
            self.assertIn(said, self.expect(3, "comfort", "model.yaml", *options).stderr)
        (self.folder / "model.yaml").write_text(self.SINE.replace("acceleration(car.P), ", ""))
        self.assertIn("no acceleration output found", self.expect(3, "comfort", "model.yaml").stderr)

    def test_a_run_that_stops(self):
        said = self.expect(1, "comfort", ROOT / "tests/models/locked_slider_crank.yaml", "--lateral", "qdd(slider)").stderr
        self.assertIn("the run stops before its end: the mechanism reaches a limit position", said)


class Units(Case):
    def test_derivatives_of_inputs(self):
        """An input has derivatives where a closure reads it."""
        path = self.model("kempe: 1\ninputs: {u: {default: 0}, F: {default: 1, unit: N}}\n"
                          "bodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n  b: {joint: {name: y, prismatic: x, at: ground}, mass: 1}\n"
                          "drives: {d: {joint: x, displacement: u}}\nforces: {f: {joint: y, force: 'F + u'}}\nrun: {t_end: 1}\n")
        for version in (2, 3):
            self.expect(0, "fmu", path, "-o", f"unit{version}.fmu", "--fmi", version)
            with zipfile.ZipFile(self.folder / f"unit{version}.fmu") as unit:
                root = ElementTree.fromstring(unit.read("modelDescription.xml"))
            self.assertEqual([v.get("name") for v in root.iter() if v.get("causality") == "input"], ["u", "u.d", "u.dd", "F"])


class Show(Case):
    def test_the_start_of_deformations(self):
        model = ("kempe: 1\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n    flexible: {beam: {length: 2, rhoA: 3, EIz: 300}, shapes: {y: 2}}\n"
                 "    points: {tip: {station: 2}}\n%srun: {t_end: 0.1}\n")
        for word in ("held", "free", "static"):
            self.assertEqual(self.object(0, "show", self.model(model % f"start: {{elastic: {word}}}\n"))["start"]["elastic"], word)
        self.assertEqual(self.object(0, "show", self.model(model % ""))["start"]["elastic"], "held")
        self.assertNotIn("elastic", self.object(0, "show", ANDREWS)["start"])

    def test_views(self):
        for view in ("--model", "--equations", "--program", "--stats"):
            self.assertNotEqual(self.expect(0, "show", ANDREWS, view).stdout, "")
            self.object(0, "show", ANDREWS, view)

    def test_passes(self):
        text = self.expect(0, "show", ANDREWS, "--equations", "--stats").stdout
        self.assertRegex(text, r"\n# after '[a-z ]+'\n")
        self.assertRegex(text, r"zero elimination +\d+ +\d+\.\d %")
        self.assertEqual(self.object(0, "show", ANDREWS, "--equations", "--stats")["view"], "passes")
        found = self.object(0, "show", ANDREWS, "--stats")
        counts = [step["operations"] for step in found["simplifications"]]
        self.assertEqual(counts, sorted(counts, reverse=True), "no step costs anything")
        self.assertGreater(counts[0], 10 * counts[-1])
        self.assertGreater(found["made"], found["needed"])
        ways = {each["name"]: each["operations"] for each in found["without_ways"]}
        self.assertEqual(min(ways.values()), ways["all of them"], "none of the ways costs anything")
        self.assertLess(ways["all of them"], ways["axes that stay"])

    def test_blocks(self):
        """A right-hand side has the operations of its blocks beside those of its stages."""
        wheelset = ROOT / "examples/wheelset/wheelset.yaml"
        found = self.object(0, "show", wheelset, "--stats")
        blocks, stages = found["at_start"], found["stages"]
        right_side = sum(stages[name]["paper"] for name in ("closure: h, J, h_t", "mass: M", "bias: C, jdqd"))
        self.assertGreater(blocks["equations"]["evaluations"], 0)
        self.assertGreater(blocks["equations"]["paper"], 10 * blocks["equations"]["evaluations"])
        self.assertEqual(blocks["averages"]["paper"], 0)
        self.assertEqual(blocks["right_hand_side"]["paper"], right_side + blocks["equations"]["paper"])
        self.assertRegex(self.expect(0, "show", wheelset, "--stats").stdout, r"solved by iteration .* \d+ evaluations\n")
        self.assertEqual(self.object(0, "show", ANDREWS, "--stats")["at_start"]["equations"]["paper"], 0)

    def test_same_bytes_twice(self):
        for view in ("--equations", "--program"):
            first, second = (self.expect(0, "show", ANDREWS, view).stdout for _ in range(2))
            self.assertEqual(first, second)


class Generate(Case):
    def count(self, *words, model=ANDREWS):
        return self.object(0, "generate", "--count", model, *words)

    def test_optimize(self):
        plain, long = (self.count("--keep-parameters", *more)["sets"] for more in ([], ["--optimize"]))
        self.assertLessEqual(long["M_C"]["runtime"]["paper"], plain["M_C"]["runtime"]["paper"])

    def test_accelerations(self):
        self.assertGreater(self.count("--sets", "qdd")["sets"]["qdd"]["paper"], 0)

    def test_keys(self):
        found = self.count()
        self.assertKeys(found, "model status reason build_s sets cpu_s scheme")
        self.assertEqual(list(found["sets"]), ["M_C", "invdyn", "h_J", "jdqd", "all"])
        for each in found["sets"].values():
            self.assertKeys(each, "paper robotran add mul div neg trig kept removed vsi_steps runtime")
            self.assertKeys(each["runtime"], "paper robotran")
            self.assertEqual(each["paper"], each["add"] + each["mul"] + each["div"])
            self.assertEqual(each["robotran"], each["paper"] + each["neg"] + each["trig"] + each["other"])
            self.assertLessEqual(each["runtime"]["paper"], each["paper"])

    def test_sets(self):
        found = self.count("--sets", "h,J,h_J,J")["sets"]
        self.assertEqual(list(found), ["h", "J", "h_J", "all"])
        self.assertEqual(found["h_J"], found["all"])
        self.assertLessEqual(found["h_J"]["paper"], found["h"]["paper"] + found["J"]["paper"])

    def test_choices(self):
        paper = [self.count("--sets", "M_C", *words)["sets"]["M_C"]["paper"]
                 for words in ([], ["--keep-parameters"], ["--keep-parameters", "--body-inputs"],
                               ["--scheme", "ner"])]
        self.assertLess(paper[0], paper[1])
        self.assertLess(paper[1], paper[2])
        self.assertLessEqual(paper[0], paper[3])

    def test_bodies_without_inputs(self):
        words = ["--sets", "C", "--body-inputs"]
        all, none, one = (self.count(*words, *more)["sets"]["C"]["paper"]
                          for more in ([], ["--no-inputs", ",".join(f"K{k}" for k in range(1, 8))], ["--no-inputs", "K3"]))
        self.assertLess(none, one)
        self.assertLess(one, all)
        self.assertEqual(none, self.count("--sets", "C")["sets"]["C"]["paper"])
        for name in ("K3,K9", "K"):
            self.assertIn(f"--no-inputs: unknown body '{name[-2:]}' in 'andrews'",
                          self.expect(3, "generate", "--count", ANDREWS, "--no-inputs", name).stderr)

    def test_text(self):
        self.assertRegex(self.expect(0, "generate", ANDREWS, "--count").stdout, r"\n  all +\d+ ")

    def test_languages(self):
        files = {"c": {"andrews.c", "andrews.h", "kempe_runtime.h"}, "python": {"andrews.py"},
                 "casadi": {"andrews_casadi.py"}, "jax": {"andrews_jax.py"}, "torch": {"andrews_torch.py"},
                 "octave": {f"andrews_{name}.m" for name in ("model", "M_C", "h_J", "M_C_prepare", "h_J_prepare")}}
        for language, names in files.items():
            with tempfile.TemporaryDirectory() as folder:
                out = pathlib.Path(folder) / "new"
                found = self.object(0, "generate", ANDREWS, "--lang", language, "--sets", "M_C,h_J", "--keep-parameters",
                                    "-o", str(out))
                self.assertEqual(set(found["files"]), {path.name for path in out.iterdir()})
                self.assertEqual(set(found["files"]), names)
                counts = self.count("--sets", "M_C,h_J", "--keep-parameters")["sets"]
                for name, routine in found["routines"].items():
                    self.assertEqual((routine["paper"], routine["robotran"]),
                                     (counts[name]["paper"], counts[name]["robotran"]))
                    text = "".join(path.read_text() for path in out.iterdir())
                    self.assertIn(found["hash"], text)
                    self.assertRegex(text, rf"\b{routine['paper']}\b.*\b{routine['robotran']}\b")

    def test_runtime(self):
        with tempfile.TemporaryDirectory() as folder:
            self.expect(0, "generate", ANDREWS, "--lang", "c", "-o", folder)
            self.assertEqual((pathlib.Path(folder) / "kempe_runtime.h").read_bytes(),
                             (ROOT / "include/kempe/runtime.h").read_bytes())

    def test_page(self):
        """The programs of docs/generate.md say the same."""
        page = (ROOT / "docs/generate.md").read_text()
        blocks = ["\n".join(line[4:] for line in block.strip("\n").split("\n")) + "\n"
                  for block in re.findall(r"(?:^    .*\n|^\n(?=    ))+", page, re.M)]
        said = {}
        with tempfile.TemporaryDirectory() as folder:
            for language in "c", "python", "octave":
                self.expect(0, "generate", ANDREWS, "--lang", language, "-o", folder)
            for block in blocks:
                if block.startswith("#include"):
                    (pathlib.Path(folder) / "main.c").write_text(block)
                elif block.startswith("cc "):
                    said["c"] = f"{block.strip()} && ./a.out"
                elif block.startswith("import andrews\n"):
                    (pathlib.Path(folder) / "main.py").write_text(block)
                    said["python"] = "for p in python3 /usr/bin/python3; do " \
                                     "$p -c 'import numpy' 2>/dev/null && exec $p main.py; done; echo skipped"
                elif block.startswith("[M, C]"):
                    (pathlib.Path(folder) / "main.m").write_text(block)
                    said["octave"] = "command -v octave-cli >/dev/null || exec echo skipped; " \
                                     "octave-cli --norc --no-history --quiet main.m"
            self.assertEqual(len(said), 3)
            for language, command in said.items():
                done = subprocess.run(["sh", "-c", command], cwd=folder, capture_output=True, text=True, timeout=300)
                self.assertEqual(done.returncode, 0, done.stderr)
                said[language] = done.stdout.split()
        expected = said.pop("c")
        self.assertEqual((expected[0], len(expected)), ("beta", 3))
        for language, words in said.items():
            if words == ["skipped"]:
                print(f"{language}: skipped")
                continue
            self.assertEqual(words[0], "beta")
            for mine, its in zip(words[1:], expected[1:], strict=True):
                self.assertAlmostEqual(float(mine), float(its), delta=1e-13 * (1 + abs(float(its))))

    def test_no_place(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "file"
            file.touch()
            told = self.expect(1, "generate", ANDREWS, "--lang", "c", "-o", str(file)).stderr
            self.assertIn("cannot make the folder", told)
            self.assertEqual(file.read_text(), "")

    def test_wheels(self):
        """Values that are found by iterations are written operation by operation; otherwise refused, with names."""
        model = ROOT / "examples/rolling_wheel/rolling_wheel.yaml"
        for sets in (["--sets", "M,jdqd"], []):
            self.expect(0, "generate", model, "--lang", "c", "-o", str(self.folder), *sets)
            refused = self.expect(3, "generate", model, "--lang", "octave", "--vectorised", *sets).stderr
            self.assertIn(f"set '{'jdqd' if sets else 'M_C'}' contains values that are found by iterations", refused)
            self.assertIn("contacts of wheels 'L', 'R'; request sets", refused)
            self.assertIn("such as 'M', by --sets, or omit --vectorised", refused)
        self.assertTrue((self.folder / "kempe_newton.h").exists())
        self.expect(0, "generate", model, "--lang", "python", "--sets", "M", "--vectorised", "-o", str(self.folder))
        refused = self.expect(3, "generate", ROOT / "examples/wheelset/wheelset.yaml", "--lang", "python", "--keep-parameters").stderr
        self.assertIn("algebraic unknowns 'touch_L', 'touch_R'; request sets", refused)
        self.assertIn("or omit --keep-parameters", refused)

    def test_sections_of_includes(self):
        """A section of an included file that is no mapping, or no list, is an error, and not left out."""
        leg, outer = self.folder / "leg.yaml", self.folder / "outer.yaml"
        body = "{joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}"
        outer.write_text(f"kempe: 1\ninclude: [{{file: leg.yaml, prefix: a_}}]\nbodies: {{c: {body}}}\nforces: {{f: {{joint: c, torque: 1}}}}\nstart: {{q: {{c: 1}}, hold: [c]}}\n")
        for section, told in (("forces: [{joint: b, torque: 1}]", "forces must be a mapping"), ("start: {hold: b}", "start hold must be a list"),
                              ("start: {q: [1]}", "start q must be a mapping")):
            leg.write_text(f"kempe: 1\nbodies: {{b: {body}}}\n{section}\n")
            self.assertIn(told, self.expect(2, "check", outer).stderr)
        leg.write_text(f"kempe: 1\nbodies: {{b: {body}}}\nforces:\nstart:\n")
        self.expect(0, "check", outer)

    def test_gravity_of_an_include(self):
        """It is not the gravity of the model: once told, at its place, where the model has none; in the result, too."""
        part, outer = self.folder / "part.yaml", self.folder / "outer.yaml"
        part.write_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies: {b: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0], inertia: {zz: 1}}}\n")
        outer.write_text("kempe: 1\ninclude: [{file: part.yaml, prefix: a, repeat: 3}]\n")
        told = self.expect(0, "check", outer).stderr
        self.assertEqual(told.count("gravity is ignored"), 1)
        self.assertIn(f"{part}:2:10: this gravity is ignored", told)
        self.assertIn("this gravity is ignored", self.object(0, "simulate", outer, "--t-end", "0.1")["warnings"][0])
        outer.write_text(outer.read_text() + "gravity: [0, 0, 0]\n")
        self.assertEqual(self.expect(0, "check", outer).stderr, "")

    def test_a_doubt_of_the_model(self):
        """The friction of a slide lacks what presses it across the plane: every computation with forces says so, and instances in a folder."""
        model = self.folder / "flat.yaml"
        model.write_text("""kempe: 1
gravity: [0, 0, -9.81]
parameters: {m: 5}
inputs: {push: {unit: N}}
ground: {points: {O: [0, 0, 0]}}
bodies:
  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.1, 0, 0]}}
  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.01}, points: {C: [0.3, 0, 0]}}
  slider: {mass: m, inertia: {zz: 0.1}, points: {C: [0, 0, 0]}}
joints: {C: {revolute: [rod.C, slider.C], cut: no}, S: {prismatic: [ground.O, slider.C], axis: x, cut: yes}}
forces:
  rub: {sliding: position(slider.C).x, friction: {mu: 0.3, reaction: S, speed: 1 mm/s}}
  push: {at: slider.C, force: [push, 0, 0]}
start: {q: {A: 60 deg, B: -80 deg}, hold: [A]}
run: {t_end: 0.05, outputs: [q]}
""")
        sampled = ("--sample", "m=4:5", "--instances", 2)
        for command, *more in (("simulate",), ("check",), ("compare",), ("inverse", "--actuators", "A"), ("equilibrium",), ("modes",), ("linearize",),
                               ("response", "--inputs", "push", "--outputs", "q(A)"), ("sensitivity", "--parameters", "m"), ("ensemble", *sampled),
                               ("ensemble", *sampled, "--out", "flat.kempe"), ("ensemble", *sampled, "--out", "flat.kempe", "--resume")):
            found = json.loads(self.expect(5, command, model, *more, "--json", "-").stdout)
            self.assertEqual(found["status"], "not trustworthy", command)
            self.assertTrue("warnings" not in found or "across the plane" in found["warnings"][0], command)
        self.expect(5, "gather", "flat.kempe", "-o", "flat.csv")
        self.assertEqual((self.folder / "flat.csv").read_text().count("not trustworthy"), 2)

    def test_unread_mechanics(self):
        """A spring of a vendor's own in a URDF file: an error, or allowed by name and then in the verdict."""
        path = self.folder / "r.urdf"
        path.write_text("<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>"
                        "</link><joint name='j' type='continuous'><parent link='a'/><child link='b'/><vendor_spring k='3'/></joint></robot>")
        refused = self.expect(2, "simulate", path, "--t-end", "0.1").stderr
        self.assertIn("r.urdf:1:", refused)
        self.assertIn("'vendor_spring' in 'joint' is not used; without it the machine is another one: --leave-out vendor_spring allows", refused)
        done = self.expect(5, "simulate", path, "--t-end", "0.1", "--leave-out", "vendor_spring", "--json", "-")
        found = json.loads(done.stdout)
        self.assertEqual(found["status"], "not trustworthy")
        self.assertIn("'vendor_spring' in 'joint' is not used; the machine differs from the file", found["warnings"][0])
        outer = self.folder / "outer.yaml"
        outer.write_text("kempe: 1\ninclude: [{file: r.urdf, leave_out: [vendor_spring]}]\n")
        self.expect(0, "simulate", outer, "--t-end", "0.1")

    def test_files_of_tables(self):
        """Cells beyond the header and columns of one name are refused; the mark of UTF-8 is passed over; only regular files are read."""
        model = self.folder / "table.yaml"
        model.write_text("kempe: 1\ntables: {f: {csv: f.csv, x: t, y: y}}\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: a, force: f(t)}}\n")
        data = self.folder / "f.csv"
        data.write_text("\ufefft,y\n0,1\n10,1\n", encoding="utf-8")
        self.expect(0, "simulate", model, "--t-end", "1")
        data.write_text("t,y\n0,1,5\n10,1,5\n")
        self.assertIn("f.csv:2:1: 3 cells where the header has 2 columns", self.expect(2, "check", model).stderr)
        data.write_text("t,y,y\n0,1,5\n10,1,5\n")
        self.assertIn("line 1 of '", self.expect(2, "check", model).stderr)
        self.assertIn("has two columns 'y'", self.expect(2, "check", model).stderr)
        data.unlink()
        os.mkfifo(data)
        self.assertIn("it is not a regular file", self.expect(2, "check", model).stderr)

    def test_files_without_an_end(self):
        """Pipes, terminals, devices and folders in place of files of every kind: an error at once."""
        model = self.folder / "table.yaml"
        model.write_text("kempe: 1\ninclude: [{file: part.yaml, prefix: p_}]\ntables: {f: {csv: f.csv, x: t, y: y}}\n"
                         "bodies: {a: {joint: {prismatic: x, at: ground}, shape: [{mesh: a.stl}], mass: 1}}\nforces: {f: {joint: a, force: f(t)}}\n")
        plain = self.folder / "plain.yaml"
        plain.write_text("kempe: 1\nparameters: {m: 1}\ninputs: {u: {unit: N}}\nbodies: {a: {joint: {name: A, prismatic: x, at: ground}, mass: m}}\n"
                         "forces: {u: {joint: A, force: u}}\nrun: {t_end: 0.1}\n")
        data = self.folder / "data.csv"
        data.write_text("t,q.A\n0,0\n0.1,0\n")
        leader, follower = os.openpty()
        self.addCleanup(os.close, leader)
        self.addCleanup(os.close, follower)
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        odd = [("/dev/zero", "it is not a regular file"), ("/dev/full", "it is not a regular file"), ("/dev/null", "it is not a regular file"),
               (os.ttyname(follower), "it is not a regular file"), (self.folder, "directory")]
        named = {"part.yaml": ("check", model), "f.csv": ("check", model), "a.stl": ("check", model), "u.csv": ("simulate", plain, "--input", "u=u.csv:y:hold")}
        given = {"model.yaml": ("check", "model.yaml"), "values.csv": ("ensemble", plain, "--values", "values.csv"),
                 "values.parquet": ("ensemble", plain, "--values", "values.parquet"), "run.ckpt": ("simulate", plain, "--resume", "run.ckpt"),
                 "reference.csv": ("simulate", plain, "--reference", "reference.csv"),
                 "measured.csv": ("fit", plain, "measured.csv", "--parameter", "m"), "estimates.csv": ("fit", plain, data, "--parameter", "m", "--start", "estimates.csv"),
                 "run.kempe/manifest.json": ("gather", "run.kempe")}
        (self.folder / "run.kempe").mkdir()
        for place, words in {**named, **given}.items():
            waits = place.endswith((".yaml", ".csv")) and place in given
            for what, told in odd + ([] if waits else [(pipe, "it is not a regular file")]):
                for other in named:
                    (self.folder / other).unlink(missing_ok=True)
                    (self.folder / other).write_text({"part.yaml": "kempe: 1\n", "f.csv": "t,y\n0,1\n10,1\n", "u.csv": "t,y\n0,1\n10,1\n"}.get(other, "solid\nendsolid\n"))
                (self.folder / place).unlink(missing_ok=True)
                (self.folder / place).symlink_to(what)
                done = kempe(*words, cwd=self.folder)
                self.assertIn(done.returncode, (2, 4), (place, what, done.stderr))
                self.assertIn(told, done.stderr, (place, what))
                (self.folder / place).unlink()
        with open(self.folder / "long.stl", "wb") as file:
            file.truncate(600 << 20)
        (self.folder / "a.stl").unlink(missing_ok=True)
        (self.folder / "a.stl").symlink_to("long.stl")
        self.assertIn("it is longer than 512 MiB, the most of a mesh", self.expect(2, "check", model).stderr)

    def test_moments_left_out(self):
        """The wrong axis: 2.07 rad for 1.66 rad; a warning of reading and of the result."""
        model = self.folder / "rod.yaml"
        text = "kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {rod: {joint: {name: A, revolute: y, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {%s: 0.0833}}}\n"
        model.write_text(text % "zz")
        done = self.expect(0, "simulate", model, "--t-end", "0.5", "--json", "-")
        self.assertIn("coordinate 'A' turns it about an axis without moment of inertia: yy is left out", json.loads(done.stdout)["warnings"][0])
        model.write_text(text % "yy")
        self.assertEqual(json.loads(self.expect(0, "simulate", model, "--t-end", "0.5", "--json", "-").stdout)["warnings"], [])
        model.write_text("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0]}}\n")
        self.assertIn("without inertia         a\n", self.expect(0, "check", model).stdout)
        model.write_text("kempe: 1\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n")  # it does not rotate
        self.assertNotIn("without inertia", self.expect(0, "check", model).stdout)

    def test_numbers_whose_squares_overflow(self):
        model = self.folder / "large.yaml"
        model.write_text("kempe: 1\nbodies:\n  a: {joint: {revolute: y, at: ground}, mass: 1, com: [1e308, 0, 0], inertia: {yy: 1}, points: {P: [1, 0, 1e308]}}\n"
                         "  b: {joint: {revolute: y, at: a.P}, mass: 1, inertia: {yy: 1}}\n")
        self.assertIn("their squares overflow", self.expect(1, "simulate", model, "--t-end", "1").stderr)

    def test_robotran(self):
        model = ROOT / "tests/models/robotran.mbs"
        refused = self.expect(2, "show", model, "--model").stderr
        self.assertIn("robotran.mbs:75:5: link 'coil' is not used: its law is in user code", refused)
        allowed = "--leave-out=link,extforce,colour,weather"
        found = self.count("--keep-parameters", "--body-inputs", allowed, model=model)
        self.assertEqual(found["model"], "everything")
        self.assertIn("tie_rod", self.expect(0, "show", model, "--model", allowed).stdout)

    def test_same_bytes_twice(self):
        first, second = (self.count() for _ in range(2))
        self.assertEqual(json.dumps(without_times(first)), json.dumps(without_times(second)))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("which command? python3 tests/cli/test_cli.py build/dev/kempe")
    KEMPE = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
