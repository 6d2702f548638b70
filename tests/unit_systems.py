#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every number of the texts and tables of a command, in SI and in another system of units: python3 tests/unit_systems.py build/dev/kempe

The unit of a number is found by the layout of the text that it stands in, in each of both texts by itself: behind the number, at the
end of its row, in the head of its column, in the title of its block. Both then are one quantity."""
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
INCH, POUND, FORCE = 0.0254, 0.45359237, 4.4482216152605
# The size of units in SI and their dimensions, as powers of 2 (m), 3 (kg) and 5 (s); angles have none.
NEWTON, JOULE = 2 * 3 / 25, 4 * 3 / 25
WORDS = {"m": (1, 2), "mm": (1e-3, 2), "um": (1e-6, 2), "in": (INCH, 2), "mm2": (1e-6, 4), "kg": (1, 3), "lb": (POUND, 3), "N": (1, NEWTON),
         "kN": (1e3, NEWTON), "lbf": (FORCE, NEWTON), "Pa": (1, NEWTON / 4), "MPa": (1e6, NEWTON / 4), "psi": (FORCE / INCH**2, NEWTON / 4),
         "J": (1, JOULE), "W": (1, JOULE / 5), "hp": (550 * 12 * FORCE * INCH, JOULE / 5), "s": (1, 5), "min": (60, 5), "Hz": (1, 1 / 5), "rad": (1, 1),
         "deg": (math.pi / 180, 1), "SI": (1, 1)}
FOREIGN = {"us": {"m", "mm", "um", "mm2", "kg", "N", "kN", "Pa", "MPa", "J", "W"}, "mm": {"m", "um", "mm2", "Pa", "in", "lb", "lbf", "psi", "hp"}}
WORD = r"(?:" + "|".join(sorted(WORDS, key=len, reverse=True)) + r")(?:\^\d+)?"
UNIT = rf"(?:1/)?{WORD}(?:(?: / |[ /])(?:\({WORD}(?:[ /]{WORD})*\)|{WORD}))*(?![\w(^'])"
NUMBER = re.compile(r"(?:(?<![\w.+(^])|(?<= \())-?\d+(?:\.\d+)?(?:e[+-]\d+)?(?![\w.]*[A-Za-z_])")
PAIR = re.compile(rf", ({WORD}\S* / {UNIT}|{WORD}\S* / \({UNIT}\))(?=\s{{2}}|$)")  # of a response


def measure(unit):
    """The size of a unit and its dimension."""
    sizes = []
    for k in range(2):
        words = re.sub(r"[A-Za-z]\w*", lambda word: repr(WORDS[word.group()][k]), re.sub(r" */ *", "/", unit).replace("^", "**"))
        sizes.append(eval(words.replace(" ", "*")))
    return sizes


def unit_of(lines, row, found, title, given):
    """The unit of a number in a line by the layout of its paragraph; None: it has none."""
    line, end = lines[row], found.end()
    behind = re.match(rf"(?: |\n\s+)({UNIT})(?![\w(])", "\n".join([line[end:], *lines[row + 1:row + 2]]))
    if behind and not re.match(" in (instance|qd?|lambda)\\b", line[end:]):
        return behind.group(1)
    ahead = re.match(r" to (-?\d\S*)", line[end:])
    if ahead:  # "0 to 3 m"
        return unit_of(lines, row, re.compile(r"-?\d[\d.e+-]*").search(line, end + 4), title, given)
    if re.match(r" %|\)? of the variance", line[end:]) or re.search(r"(instance|branch|window|zone|Branch) $", line[:found.start()]):
        return None
    if title and re.match(r"  (mean|quantiles|extremes) ", line) or title and re.match(r"\s{12}\(?-?\d", line):
        return title
    heads = [other for other in reversed(lines[:row]) if "  value  per" in other or not PAIR.search(other) and not NUMBER.search(re.sub(UNIT, "", other).replace("95 %", ""))]
    per = next((head for head in heads if "  value  per" in head), None)
    own = re.match(rf" *\S+ +({UNIT})  ", line)
    if per:  # a derivative: the unit of its row over that of its parameter
        over = re.search(rf"  per ({UNIT}) (?:unit )?of \S+$", per[:end])
        unit = own.group(1) if own else "SI" if over else None
        return f"{unit} / ({over.group(1)})" if over else unit
    last = re.search(rf"  ({UNIT}(?:, {UNIT})*)(?:  \D*)?$", line)
    if last and end <= last.start():
        units, numbers = last.group(1).split(", "), NUMBER.findall(line[:last.start()])
        return units[max(0, len(NUMBER.findall(line[:found.start()])) - len(numbers) + len(units))]
    named = re.search(rf"  [a-z]+ -?\d\S* ({UNIT})$", line)  # "x 1  y 2 m"
    if named:
        return named.group(1)
    for head in heads:
        for over in range(0 if line.startswith("  Rounding") else 3):  # a long number moves those behind it
            front, behind = head[:end - over], head[end - over:end - over + 1]
            if len(front) < end - over or behind.strip():
                continue
            if re.search(r"(?:^|\s)amplitude$", front):
                return given
            if re.search(r"\sat t$", front):
                return "s"
            if re.search(r"\s[xyz]$", front):
                return re.search(rf", ({UNIT})\s", head).group(1)
            cell = re.search(rf"(?:, *|\s)({UNIT})$", front)
            first = re.match(rf"  ({UNIT}) {{4,}}rms ", head)
            if cell or first:
                return cell.group(1) if cell else None if front.endswith("Wz") else first.group(1)
            if re.search(r"\w$", front):
                break  # a head without a unit
    alone = next((re.fullmatch(rf"\w+, ({UNIT})", head) for head in heads if len(head) < end), None)
    return alone.group(1) if alone and end <= 13 else own.group(1) if own else None


def quantities(text):
    """The numbers of a text, each with half of its last digit and its unit."""
    found = []
    for paragraph in re.split(r"\n\s*\n", text):
        lines, title, given = paragraph.split("\n"), None, None
        for row, line in enumerate(lines):
            head = re.search(rf"^\S.* \[({UNIT})\]", line)
            title = head.group(1) if head else None if re.match(r"\S", line) else title
            pair = PAIR.search(line)
            given = pair.group(1) if pair else given
            for number in NUMBER.finditer(line):
                mantissa, _, power = number.group().partition("e")
                digit = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
                found.append((float(number.group()), digit / 2, unit_of(lines, row, number, title, given), line, number.group()))
    return found


class Systems(unittest.TestCase):
    CAR, BAR = EXAMPLES / "quarter_car/quarter_car.yaml", EXAMPLES / "four_bar/four_bar.yaml"
    WHEELSET = EXAMPLES / "restrained_wheelset/hunting_wheelset.yaml"

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def model(self, text):
        (self.folder / "model.yaml").write_text("kempe: 1\n" + textwrap.dedent(text))
        return "model.yaml"

    def run_in(self, system, *words, code=0):
        done = subprocess.run([KEMPE, *map(str, words), f"--units={system}"], capture_output=True, text=True, cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stdout

    def same(self, a, b, what, system, near=0, beside=0):
        """Both numbers with their units are one quantity, and the second unit is of the system."""
        size, dimension = measure(a[1] or "1")
        other_size, other_dimension = measure(b[1] or "1")
        self.assertAlmostEqual(dimension, other_dimension, delta=1e-9 * dimension, msg=what)
        self.assertFalse(FOREIGN[system] & set(re.findall(r"[A-Za-z]\w*", b[1] or "")), what)
        self.assertLessEqual(abs(a[0] * size - b[0] * other_size), 1.001 * (near * size + beside * other_size) + 1e-12 * abs(a[0] * size), what)

    def compare_texts(self, texts, system, least):
        """`least`: so many numbers at least have another unit in the other system."""
        self.assertEqual([line for text in texts for line in text.splitlines() if len(line) > 100], [])
        both = [quantities(re.sub(r"\(conicity at 4 mm .*?\)", "", text)) for text in texts]
        self.assertEqual(len(both[0]), len(both[1]), "\n".join(texts))
        changed = 0
        for a, b in zip(*both):
            if a[4] == b[4] and re.fullmatch(r"-?\d+", a[4]):
                continue  # a count, or 0
            changed += a[2] != b[2] and "SI" not in (b[2] or "")
            self.same((a[0], a[2]), (b[0], b[2]), f"{a}\n{b}", system, a[1], b[1])
        self.assertGreaterEqual(changed, least, texts[1])

    def compare_tables(self, system):
        tables = []
        for name in "si", system:
            head, *rows = csv.reader((self.folder / f"{name}.csv").read_text().splitlines())
            tables.append(([re.fullmatch(r"(.*?)(?: \[(.*)\])?", column).groups() for column in head], rows))
        (heads, rows), (others, other_rows) = tables
        self.assertEqual([name for name, _ in heads], [name for name, _ in others])
        own = next((k for k, (name, _) in enumerate(heads) if name == "unit"), None)  # a unit for each row
        for row, other in zip(rows, other_rows, strict=True):
            for k, ((name, unit), (_, shown)) in enumerate(zip(heads, others)):
                if k == own or name in ("rank", "cpu_s", "build_s", "first_s", "ratio"):
                    continue
                try:
                    x, y = float(row[k]), float(other[k])
                except ValueError:
                    self.assertEqual(row[k], other[k])
                    continue
                by_row = own is not None and not unit
                units = (row[own], other[own]) if by_row else (unit, shown)
                units = [re.sub(r"/?\[.*?\]$", "", x or "") for x in units]
                self.same((x, units[0]), (y, units[1]), f"{name}: {row}, {other}", system, 1e-13 * abs(x), 1e-13 * abs(y))

    def check(self, *words, least, system="us", views=()):
        """`views`: options of pictures and pages, whose units are those of the system."""
        with self.subTest(" ".join(map(str, words))):
            views = [word for view in ("plot", *views) for word in (f"--{view}", f"{view}.{'html' if view == 'report' else 'svg'}")]
            texts = [self.run_in(name, *words, "--json", f"{name}.json", "-o", f"{name}.csv", *views) for name in ("si", system)]
            self.compare_texts(texts, system, least)
            self.compare_tables(system)
            for file in views[1::2]:
                shown = re.findall(rf'>[^<]*, ({UNIT})<|"unit":"([^"]*)"', (self.folder / file).read_text())
                self.assertEqual([pair for pair in shown if FOREIGN[system] & set(re.findall(r"[A-Za-z]\w*", " ".join(pair)))], [])
            a, b = (self.without_times(json.loads((self.folder / f"{name}.json").read_text())) for name in ("si", system))
            self.assertEqual(a, b, "objects are in SI")

    def without_times(self, x):
        if isinstance(x, dict):
            return {key: self.without_times(value) for key, value in x.items() if not key.endswith("_s") and key != "warnings"}
        return [self.without_times(value) for value in x] if isinstance(x, list) else x

    def test_modes(self):
        self.check("modes", self.CAR, "--sweep", "damper=0:6000:7", least=1, views=("svg", "report"))
        self.check("modes", EXAMPLES / "coupler_fit/coupler_fit.yaml", "--at", "start", least=0)
        rack = self.model("""
            bodies: {a: {joint: {name: turn, revolute: z, at: ground}, mass: 1 kg, inertia: {zz: 0.01 kg*m^2}}, b: {joint: {name: slide, prismatic: x, at: ground}, mass: 2 kg}}
            loops: {R: {coupler: {slide: 1, turn: -30 mm}}}""")
        self.check("modes", rack, least=1, system="mm")

    def test_response(self):
        self.check("response", EXAMPLES / "suspension/suspension.yaml", "--inputs", "force(chassis.R.z)", "--outputs", "position(chassis.R).z,q(z)",
                   "--frequencies", "0.2:30:20", least=4, views=("svg", "report"))
        self.check("response", self.BAR, "--inputs", "effort(crank)", "--outputs", "q(crank)", "--frequencies", "1:2:3", least=1)

    def test_cycles(self):
        self.check("cycles", self.WHEELSET, "--sweep", "V=100.65:100.72:2", "--outputs", "q(y)", least=30, views=("svg", "report"))
        oscillator = self.model("""
            parameters: {a: 0.1 m^2}
            bodies: {mass: {joint: {name: x, prismatic: x, at: ground}, mass: 1 kg}}
            forces: {law: {joint: x, force: "(a - q(x)^2)*qd(x)*1 N*s/m^3 - q(x)*1 N/m"}}""")
        self.check("cycles", oscillator, "--sweep", "a=-1 m^2:1 m^2:3", least=10, system="mm")

    def test_contact(self):
        self.check("contact", EXAMPLES / "conicity/conicity.yaml", "--sweep", "shift=-9 mm:9 mm:31", "--conicity", "5 mm:7 mm:3", least=60, views=("svg",))
        self.check("contact", EXAMPLES / "manchester/manchester.yaml", "--sweep", "shift=0:10 mm:3", "--law", "fastsim1", "--pressure", "analyn", "--all", least=80)

    def test_comfort(self):
        self.check("comfort", EXAMPLES / "ride/shaken_seat.yaml", least=15)
        self.check("comfort", EXAMPLES / "ride/ride.yaml", "--vertical", "acceleration(body.L).z", "--t-end", "5", least=0, system="mm")

    def test_sensitivity(self):
        for of in ((), ("--of", "equilibrium"), ("--of", "modes")):
            self.check("sensitivity", self.CAR, *of, "--parameters", "damper,tyre", *(() if of else ("--t-end", "0.1")), least=3)
        self.check("sensitivity", self.BAR, "--t-end", "0.1", "--parameters", "crank,base", least=2)

    def test_searches(self):
        for model, outputs, parameter, least in ((self.CAR, "q.body,q.wheel", "damper:500:3000", 8), (self.BAR, "q.rocker", "crank:0.28:0.33", 0)):
            self.run_in("si", "simulate", model, "--t-end", "0.3", "-o", "data.csv")
            self.check("fit", model, "data.csv", "--columns", outputs, "--parameter", parameter, least=least, views=("report",))
        self.check("optimize", self.CAR, "--minimize", "max(q(wheel))", "--parameter", "damper:500:3000", "--limit", "max(q(body)) < 0.7", "--t-end", "0.2", least=6, views=("report",))
        self.check("optimize", self.BAR, "--minimize", "max(qd(rocker))", "--parameter", "base:0.85:0.95", "--t-end", "0.2", least=0, system="mm")

    def test_ensembles(self):
        for model, sample, quantity, least in ((self.CAR, "damper=1000:2000", "max(q(body))", 8), (self.BAR, "crank=0.28:0.32", "max(qd(rocker)),energy.kinetic", 6)):
            words = ("ensemble", model, "--sample", sample, "--quantity", quantity, "--instances", 8, "--t-end", 0.3)
            with self.subTest(model.stem):
                texts = [re.sub(r"\nrun .*", "", self.run_in(system, *words, "-o", f"{system}.csv", "--json", f"{system}.json")) for system in ("si", "us")]
                self.compare_texts(texts, "us", least)
                self.compare_tables("us")
                a, b = (self.without_times(json.loads((self.folder / f"{name}.json").read_text())) for name in ("si", "us"))
                self.assertEqual(a, b)
                self.run_in("us", *words, "--out", f"{model.stem}.kempe")
                texts = [re.sub(r"\n(run|folder) .*", "", self.run_in(system, "gather", f"{model.stem}.kempe", "-o", f"{system}.csv")) for system in ("si", "us")]
                self.compare_texts(texts, "us", least - 1)
                self.compare_tables("us")

    def test_compare(self):
        """The sizes that errors are relative to, and the errors of models of bodies. Times differ from run to run."""
        for model, words, least in ((self.BAR, (), 3), (EXAMPLES / "flexible_pendulum/flexible_pendulum.yaml", ("--bodies", "rigid,none"), 3)):
            texts = [self.run_in(system, "compare", model, "--t-end", "0.1", "--rtol", "1e-5", *words) for system in ("si", "us")]
            kept = ["\n".join(re.findall(r"^Errors: .*(?:\n    .*)*|(?<=^rigid).*?(?=\d\S* m|\d\S* in).*", text, re.M)) for text in texts]
            self.compare_texts([re.sub(r"(?m)^ +[\d.]+ +[\d.]+ +\d+ +\d+", "", text) for text in kept], "us", least)

    def test_first_six(self):
        slider = EXAMPLES / "driven_slider_crank/driven_slider_crank.yaml"
        for words, least in ((("check", slider), 0), (("assemble", slider), 0), (("simulate", slider, "--t-end", "0.1"), 10), (("inverse", slider, "--t-end", "0.1"), 3),
                             (("kinematics", slider, "--sweep", "crank=0:90 deg:5"), 3), (("equilibrium", self.CAR), 2)):
            with self.subTest(words[0]):
                texts = [re.sub(r"\n(method|cpu|\d+ steps)\b.*(\n {4,}\S.*)*", "", self.run_in(system, *words)) for system in ("si", "us")]
                self.compare_texts(texts, "us", least)

    def test_efforts(self):
        """The reaction of a row between coordinates is its multiplier, and has its unit; the depth of a stop of a rotation is an angle."""
        model = self.model("""
            gravity: [0, -9.81, 0]
            bodies:
              arm: {joint: {name: A, revolute: z, at: ground}, mass: 2, com: [0.5, 0, 0], inertia: {zz: 0.1}}
              slide: {joint: {name: S, prismatic: y, at: ground}, mass: 1}
              wheel: {joint: {name: W, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.02}}
            drives: {turn: {joint: A, angle: 0.3*t}, move: {joint: S, displacement: 0.2*t}}
            loops: {pair: {coupler: {W: 1, A: 3}}}
            contacts: {stop: {joint: W, lower: -0.01, law: kelvin_voigt, stiffness: 20, damping: 0.3}}
            run: {t_end: 0.1, outputs: [lambda, reaction(turn), reaction(move), reaction(pair), force(stop)]}""")
        for system, torque in (("si", "N m"), ("mm", "N mm"), ("us", "lbf in")):
            self.run_in(system, "simulate", model, "-o", "rows.csv")
            head, *_, last = csv.reader((self.folder / "rows.csv").read_text().splitlines())
            row = {column.split(" [")[0]: (column.split(" [")[-1].strip("]"), float(value)) for column, value in zip(head, last)}
            for name in "turn", "move", "pair":
                self.assertEqual(row[f"reaction.{name}.x"], row[f"lambda.{name}.1"])
            self.assertEqual([row[f"force.stop.{name}"][0] for name in ("normal", "depth", "rate")], [torque, "rad", "rad/s"])
            self.assertAlmostEqual(row["force.stop.depth"][1], 0.08, 12)

    def test_refused(self):
        for command, why in (("linearize", "its matrices"), ("generate", "computes in SI"), ("fmu", "are in SI"), ("show", "in SI"), ("view", "in SI")):
            for words in (("--units", "mm"), ("--units=mm",), ("--units",)):
                done = subprocess.run([KEMPE, command, self.BAR, *words], capture_output=True, text=True, cwd=self.folder)
                self.assertEqual(done.returncode, 3)
                self.assertRegex(done.stderr, rf"^kempe: --units: {command} has no choice of units: .*{why}")
        done = subprocess.run([KEMPE, "modes", self.BAR, "--units=cgs"], capture_output=True, text=True, cwd=self.folder)
        self.assertEqual((done.returncode, "there are si, mm and us" in done.stderr), (3, True))


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
