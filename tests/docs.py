#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The documentation is true: models on its pages are read, commands on them are run, its tables have the rows of the
.def files, its links and the files that it names are there. Called with the path of the command:

    python3 tests/docs.py build/dev/kempe

Commands that take long are run shortened (`shortened`), as they stand on the page with KEMPE_FULL=1. Programs on the pages are compiled elsewhere: docs/library.md by tests/CMakeLists.txt, docs/extending.md by tests/extending.py.
"""
import json
import os
import pathlib
import re
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "schema"))
sys.path.insert(0, str(ROOT / "docs"))
import api  # noqa: E402
import figures  # noqa: E402
import elements_page  # noqa: E402
import gallery  # noqa: E402
import generate_schema  # noqa: E402
import model_pages  # noqa: E402
import pictures  # noqa: E402
import problems  # noqa: E402
import python_pages  # noqa: E402
from generate.quick_cc import quick_compiler, quick_path  # noqa: E402

KEMPE = "kempe"  # set by main
QUICK_CC = "cc"  # without optimisation, set where commands run
FULL = "KEMPE_FULL" in os.environ
os.environ["BROWSER"] = "true"  # `kempe view` opens nothing
# With KEMPE_FULL=1 alone: tests/bogie_track.py has other modes of the same model, docs/problems.py runs of the same two,
# tests/limit_cycles_published.py the same branch and other wheels on rails, docs/ensemble.md the same tracks for 2 s, tests/flexible_car.py
# the same runs.
LONG = ("cycles examples/cooperrider/cooperrider.yaml --set start=0 --sweep V=60:75:16", "cycles examples/wheelset/wheelset.yaml", "cycles examples/restrained_wheelset/hunting_wheelset.yaml",
        "--sweep speed=0.5:20:40", "compare examples/wheelset/wheelset.yaml", "compare examples/four_bar/four_bar_ill.yaml",
        "manchester_vehicle_track.yaml --sample seed=1:20:20", "flexible_car.yaml --from 5", "flexible_car_tram.yaml --from 5")
# Motions of these vehicles end early: tests/manchester_vehicle.py and tests/bogie_track.py judge them.
EARLY = {"manchester_vehicle_recorded.yaml": "2 s", "manchester_vehicle_curve.yaml": "1 s", "manchester_vehicle_faults.yaml": "1 s", "bogie_track.yaml": "6 s", "manchester_vehicle_track.yaml": "1.2 s"}
# Commands that a page shows for an end before their end (1) or a doubt (5), by their page and first words. All others exit with 0.
ENDS = {
    ("docs/howto.md", "equilibrium friction.yaml --stick"): 5,
    ("docs/kinematics.md", "kinematics examples/crank_rocker/crank_rocker.yaml --sweep rocker="): 1,
    ("examples/crank_rocker/README.md", "kinematics examples/crank_rocker/crank_rocker.yaml --sweep rocker="): 1,
}
PAGES = sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md"), *ROOT.glob("bench/*.md")])


def words(text):
    return set(re.findall(r"`([^`]+)`", text))


def section(page, title):
    """The text under a heading, up to the next one of its level or above."""
    text = (ROOT / "docs" / page).read_text()
    return re.search(rf"^##+ {title}\n(.*?)(?=^## |\Z)", text, re.M | re.S).group(1)


def first_cells(text):
    return [line.split("|")[1] for line in text.split("\n") if line.startswith("| ")]


def blocks(text):
    """Indented and fenced blocks, without their indentation and fences."""
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.M | re.S)
    found = re.findall(r"(?:^    .*\n|^\n(?=    ))+", text, re.M)
    return fenced + ["\n".join(line[4:] for line in block.strip("\n").split("\n")) + "\n" for block in found]


def anchors(page):
    """The anchors that repository hosts give the headings of a page."""
    titles = re.findall(r"^#+ (.*)$", re.sub(r"^    .*$", "", page.read_text(), flags=re.M), re.M)
    slugs = [re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles]
    return {slug if slugs[:k].count(slug) == 0 else f"{slug}-{slugs[:k].count(slug)}" for k, slug in enumerate(slugs)}


def commands(page):
    """(the block's folder, words) of every line that begins with `kempe` and names a model or a result folder."""
    if page.name == "gallery.md":
        return  # commands of the examples' own pages
    for block in blocks(page.read_text()):
        folder = "."
        for line in block.split("\n"):
            if line.startswith("cd "):
                folder = line[3:]
            if re.match(r"kempe (new \w|\w+ \S+\.(yaml|urdf|mjcf|sdf|kempe|mtx)\b)", line):
                yield folder, shlex.split(line)[1:]


def ran(words, folder):
    """A command at its end; a server is interrupted when it has printed its address."""
    if words[0] != "workbench":
        path = quick_path(QUICK_CC.parent) if "--platforms" in words and not FULL else os.environ["PATH"]
        return subprocess.run([KEMPE, *words], cwd=folder, capture_output=True, text=True, timeout=300, env={**os.environ, "PATH": path})
    with subprocess.Popen([KEMPE, *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        address = server.stdout.readline()
        server.terminate()
        return subprocess.CompletedProcess(words, server.wait(timeout=60), address, server.stderr.read())


def shortened(line):
    """Comparisons at two tolerances, the first two that are listed or 1e-4 and 1e-6; sweeps of at most five values,
    of limit cycles and ensembles two, of conicities, which few values do not resolve, 200; 200 instances; motions that settle for a tenth of the time, those of vehicles to an early end; units compiled without
    optimisation. Integers stay integers, such as the seeds of tracks."""
    most = 2 if line[0] in ("cycles", "ensemble") else 200 if "--conicity" in line else 5
    line = [re.sub(r"=1:(\d+):\1$", lambda m: f"=1:{min(int(m.group(1)), most)}:{min(int(m.group(1)), most)}", word) for word in line]
    line = [re.sub(r"(=[^:,]+:[^:,]+):(\d+)$", lambda m: f"{m.group(1)}:{min(int(m.group(2)), most)}", word) for word in line]
    if line[0] == "cycles" and "--settle" in line:
        k = line.index("--settle") + 1
        line = [*line[:k], re.sub(r"0 s$", " s", line[k]), *line[k + 1:]]
    line = [str(min(int(word), 200)) if before == "--instances" else word for before, word in zip(["", *line], line)]
    if line[0] in ("simulate", "ensemble") and (end := EARLY.get(line[1].rsplit("/", 1)[-1])):
        return [*line, "--t-end", end] if "--t-end" not in line else [end if before == "--t-end" else word for before, word in zip(["", *line], line)]
    if line[0] == "fmu" and not {"--no-binary", "--binary", "--compiler", "--platforms"} & set(line):
        return [*line, "--compiler", str(QUICK_CC)]
    if line[0] != "compare":
        return line
    if "--rtol" not in line:
        return [*line, "--rtol", "1e-4,1e-6"]
    k = line.index("--rtol") + 1
    return [*line[:k], ",".join(line[k].split(",")[:2]), *line[k + 1:]]


def reads_examples(line):
    """True where a command needs no file of its page and writes none: it does the same on all pages."""
    named = [word for word in line if re.search(r"\.\w*[a-z]\w*$", word)]
    return line[0] != "new" and all(word.startswith(("examples/", "tests/")) for word in named) and not {"-o", "--out", "--svg", "--json", "--report"} & set(line)


def wanted_end(page, line):
    name, words = page.relative_to(ROOT).as_posix(), " ".join(line)
    return next((end for (where, first), end in ENDS.items() if where == name and words.startswith(first)), 0)


def quotations(page):
    """(the block's folder, words, quoted lines) of every command of a block with lines of its output below it. "..." stands
    for lines that are left out."""
    for block in blocks(page.read_text()):
        folder, words, quoted = ".", None, []
        for line in [*block.split("\n"), "cd"]:
            if line.startswith("cd "):
                folder = line[3:]
            command = re.match(r"(?:\$ )?(?:kempe (\w+ \S+\.yaml.*)|(cd|python3|kempe)\b)", line)
            if command and words and any(text.strip(" .") for text in quoted):
                yield folder, words, quoted
            if command:
                words, quoted = shlex.split(command.group(1) or "", comments=True), []
            elif words:
                quoted.append(line)


def alike(quoted, printed):
    """True where a quoted line is the printed one: words without regard to spaces, numbers to 2 units of the fourth digit.
    Times and what is rounding alone are any."""
    number = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
    times = re.compile(rf"(?<![\w.]){number}(?= (?:ms|us)\b)")
    pieces = [re.split(rf"((?<![\w.]){number}(?![\w.]))", times.sub("T", " ".join(line.split()))) for line in (quoted, printed)]
    if len(pieces[0]) != len(pieces[1]) or pieces[0][::2] != pieces[1][::2]:
        return False
    pairs = [(float(a), float(b)) for a, b in zip(pieces[0][1::2], pieces[1][1::2])]
    return all(abs(a - b) <= 2e-4 * abs(b) or max(abs(a), abs(b)) < 1e-12 for a, b in pairs)


def missing(quoted, printed):
    """The first quoted line that is not printed there; None: all are. They follow each other but for "..."."""
    lines, at, anywhere = [line for line in printed.split("\n") if line.strip()], 0, True
    for line in filter(str.strip, quoted):
        if line.strip() == "...":
            anywhere = True
            continue
        found = next((k for k in range(at, len(lines) if anywhere else min(at + 1, len(lines))) if alike(line, lines[k])), None)
        if found is None:
            return line
        at, anywhere = found + 1, False
    return None


def files(page):
    """Models and tables that a page names before it shows them: `NAME.yaml` ends a paragraph, the block follows."""
    return dict(re.findall(r"`(\w+\.(?:yaml|csv|urdf|mjcf|sdf))`[^`\n]*:\n\n```(?:yaml|text|xml)\n(.*?)^```", page.read_text(), re.M | re.S))


class Tables(unittest.TestCase):
    def kinds(self):
        """(kind, what a model writes, heading) of all kinds of joints, closures and forces."""
        for name, _ in generate_schema.rows("joints.def", "KMP_JOINT"):
            yield name, f"{name}:", model_pages.heading(name, True)
        for name, *_ in generate_schema.rows("closure_kinds.def", "KMP_CLOSURE"):
            yield name, f"{name}:", model_pages.heading(name)
        pages = model_pages.texts()
        for kind, name, place, word, _ in generate_schema.rows("force_kinds.def", "KMP_FORCE"):
            if place not in ("wheel", "contact", "state"):  # of pages of their own
                titles = [title for text in pages.values() for title, body in model_pages.sections(text) if f"<!-- force: {kind} -->" in body]
                yield name, {"NULL": f"{place}:", "effort": "torque:"}.get(word, f"{word}:"), titles[0]

    def test_every_kind_has_an_example_that_runs(self):
        pages = [re.split(r"^##? (.*)\n", path.read_text(), flags=re.M) for path in (ROOT / "docs/model").glob("*.md")]
        bodies = {title: body for parts in pages for title, body in zip(parts[1::2], parts[2::2])}
        for kind, written, title in self.kinds():
            with self.subTest(kind):
                body = bodies.get(title) or ""
                if title == "Point on curve":
                    body += bodies["Example"] + "".join(body for parts in pages for body in parts if "point_on_curve:" in body)
                models = re.findall(r"^```yaml\n(.*?)^```", body, re.M | re.S)
                self.assertTrue(any(written in model for model in models), f"no model with {written}")
                self.assertRegex(body, r"(?m)^    kempe \w+ \w+\.yaml")

    def test_figures_of_kinds(self):
        """Every kind of joint has a figure, and every closure between points."""
        text = (ROOT / "docs/model/joint_kinds.md").read_text()
        for name, _ in generate_schema.rows("joints.def", "KMP_JOINT"):
            self.assertIn(f"(figures/joint_{name}.svg)", text)
        text = "".join((ROOT / f"docs/model/{page}.md").read_text() for page in ("closures", "curves", "cams"))
        between = [name for name, needs, *_ in generate_schema.rows("closure_kinds.def", "KMP_CLOSURE") if needs not in ("TERMS", "EXPRESSION")]
        self.assertEqual(text.count("](figures/"), len(between))

    def test_cuts(self):
        """The closure that a joint becomes has the rows of its kind."""
        kinds = dict(re.findall(r"^\| \[`(\w+)`\].*\| (\w+) \|$", model_pages.closure_kinds(""), re.M))
        cuts = generate_schema.rows("cuts.def", "KMP_CUT")
        self.assertEqual([kinds[closure] for _, closure, _, _ in cuts], [count for _, _, count, _ in cuts])

    def test_units_of_keys(self):
        """Units of keys are units of the language; those of forces have the dimensions of their rows of force_kinds.def."""
        units = {row[0]: [float(power) for power in row[3:6]] for row in generate_schema.rows("units.def", "KMP_UNIT")}

        def dimension(text):
            total = [0.0] * 3
            for sign, part in re.findall(r"(^|/| )([^/ ]+)", text):
                name, _, power = part.partition("^")
                for k in range(3):
                    total[k] += (-1 if sign == "/" else 1) * float(power or 1) * (units[name][k] if name != "1" else 0)
            return total
        of_coordinates = ("rad or m", "rad/s or m/s", "unit of the first coordinate", "kg m^2 or kg")
        tables = [path.stem.removesuffix("_keys") for path in generate_schema.key_tables()]
        for table, row in [(table, row) for table in tables for row in generate_schema.keys(table)]:
            if row.unit and row.unit not in of_coordinates:
                self.assertEqual(len(dimension(row.unit)), 3, f"{table} {row.key}")  # of units that there are
        forces = {row.key: row.unit for row in generate_schema.keys("force") if row.unit}
        for kind in ("SPRING", "BUSHING"):
            for key, _, (effort, coordinate, time), _, _ in generate_schema.fields(kind):
                if key in forces:
                    self.assertEqual(dimension(forces[key]), [effort + coordinate, effort, time - 2 * effort], f"{kind} {key}")
        for macro in ("KMP_CLOSURE_NUMBER", "KMP_COUPLING_NUMBER"):
            for row in generate_schema.rows("closure_numbers.def", macro):
                self.assertEqual(len(dimension(row[2])), 3, row[0])

    def printed(self, *words, model=None):
        with tempfile.TemporaryDirectory() as folder:
            if model:
                (pathlib.Path(folder) / "model.yaml").write_text(model)
            return subprocess.run([KEMPE, *words], cwd=folder, capture_output=True, text=True, check=True).stdout

    def test_values_of_absent_keys(self):
        """Numbers and words that the tables give for absent keys are those that the program uses."""
        given = lambda table, key: next(row.absent for row in generate_schema.keys(table) if row.key == key).strip("`")
        example = (ROOT / "examples/manchester/manchester_wheelset.yaml").read_text()
        keys = ("contact", "creep", "friction", "shear_modulus", "poisson", "damping", "speed")
        model = re.sub(rf", (?:{'|'.join(keys)}): [^,}}]+(?=[,}}])", "", example) + "\n"
        wheels = [line for line in model.split("\n") if "on: line." in line]
        self.assertEqual([key for key in keys for line in wheels if f"{key}:" in line], [])
        model = model.replace("../profiles", str(ROOT / "examples/profiles"))
        shown = json.loads(self.printed("show", "model.yaml", "--model", "--json", "-", model=model))["wheels"]["L"]
        for key in keys:
            wanted = given("wheel", key)
            self.assertEqual(shown[key], wanted if wanted.isalpha() else float(wanted), key)
        model = "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
        text = self.printed("simulate", "model.yaml", "--no-cache", model=model)
        self.assertIn(f"formulation {given('run', 'formulation')}", text)
        self.assertEqual([float(x) for x in re.search(r"rtol (\S+), atol ([^\s;]+)", " ".join(text.split())).groups()], [float(given("run", "rtol"))] * 2)
        self.assertEqual(given("run", "atol"), "rtol")
        self.assertIn(f"at t = {given('run', 't_end')} s", text)
        self.assertIn(f", {int(given('run', 'output_step').split('/')[1]) + 1} rows", text)

    def test_key_without_page_is_found(self):
        """A table of keys that no page shows fails, and so does a page that differs."""
        pages = model_pages.texts()
        with unittest.mock.patch.object(model_pages, "texts", lambda: {name: text.replace("<!-- keys: wheel -->", "") for name, text in pages.items()}):
            self.assertEqual(model_pages.without_page(), [("keys", "wheel")])
        rows = generate_schema.keys
        more = lambda table: [*rows(table), generate_schema.Key("colour", "word", "", "none", "colour")] if table == "body" else rows(table)
        with unittest.mock.patch.object(generate_schema, "keys", more):
            self.assertNotEqual(model_pages.made()["bodies.md"], pages["bodies.md"])

    def test_functions_and_units(self):
        page = (ROOT / "docs/model/expressions.md").read_text()
        called = {word.split("(")[0] for word in words(page)}
        functions = {row[0] for row in generate_schema.rows("functions.def", "KMP_FUNCTION")}
        self.assertEqual(functions - called, set())
        table = page[page.index("| dimension"):page.index("## Dimensions")]
        units = words("".join(line.split("|")[2] for line in table.split("\n") if line.startswith("| ")))
        self.assertEqual(units, {row[0] for row in generate_schema.rows("units.def", "KMP_UNIT")})

    def test_choices(self):
        """Words that a key may have are on the pages of the run."""
        page = (ROOT / "docs/model/run.md").read_text()
        for table, macro in (("dynamics.def", "KMP_DYNAMICS"), ("change_points.def", "KMP_CHANGE_POINTS"),
                             ("reaction_peaks.def", "KMP_REACTION_PEAKS")):
            self.assertEqual({row[-1] for row in generate_schema.rows(table, macro)} - words(page), set())

    def test_solvers(self):
        page = (ROOT / "docs/solvers.md").read_text()
        for table in ("integrators", "linear"):
            text = re.sub(r"/\*.*?\*/", "", next((ROOT / "integrators").rglob(f"{table}.def")).read_text(), flags=re.S)
            self.assertEqual(set(re.findall(r"KMP_\w+\((\w+)\)", text)) - words(page), set())
        text = re.sub(r"/\*.*?\*/", "", (ROOT / "integrators/formulations/formulations.def").read_text(), flags=re.S)
        self.assertEqual(set(re.findall(r"KMP_FORMULATION\((\w+)\)", text)) - words(page), set())


    def test_languages(self):
        page = (ROOT / "docs/generate.md").read_text()
        text = re.sub(r"/\*.*?\*/", "", (ROOT / "src/exchange/code/languages.def").read_text(), flags=re.S)
        for language in re.findall(r"KMP_LANGUAGE\((\w+)\)", text):
            self.assertIn(f"--lang {language} ", page)
        sets = re.sub(r"/\*.*?\*/", "", (ROOT / "src/studies/show/sets.def").read_text(), flags=re.S)
        self.assertEqual(set(re.findall(r'KMP_(?:EQUATIONS\(\w+, |GROUP\()"(\w+)"', sets)) - words(page), set())


class Pages(unittest.TestCase):
    def test_links(self):
        linked = set()
        for page in PAGES:
            prose = re.sub(r"`[^`]*`", "", re.sub(r"^    .*$", "", page.read_text(), flags=re.M))
            for link, heading in re.findall(r"\]\(([^)#]*)#?([^)]*)\)", prose):
                if "://" in link:
                    continue
                target = (page.parent / link).resolve() if link else page
                linked.update({target} - {page})
                with self.subTest(f"{page.relative_to(ROOT)}: {link}#{heading}"):
                    self.assertTrue(target.exists())
                    if heading:
                        self.assertIn(heading, anchors(target))
        self.assertEqual(set(PAGES) - linked, {ROOT / "README.md"}, "pages that nobody links")

    def test_generated_pages(self):
        """They are what their scripts write (docs/commands.md: tests/words.py)."""
        self.assertEqual([script.main(["--check"]) for script in (api, elements_page, gallery, figures, model_pages, python_pages)], [0] * 6)

    def test_published_problems(self):
        """The errors on the page are those of runs now, but for rounding."""
        self.assertEqual(problems.main([KEMPE, "--check"]), 0)

    def test_files_named(self):
        page = (ROOT / "docs/overview.md").read_text()
        folders = "include src constraints integrators examples tests bench docs packaging schema".split()
        for word in words(page):
            if re.fullmatch(rf"({'|'.join(folders)})(/[\w./*-]+)?", word) and not re.search("[A-Z]{4}", word):
                with self.subTest(word):
                    self.assertTrue(list(ROOT.glob(word)))

    def test_start_in_words(self):
        """The end of ./start, from what `kempe compare` prints."""
        program = re.search(r"^awk '\n(.*?)^' ", (ROOT / "start").read_text(), re.M | re.S).group(1).replace("'\"'\"'", "'")
        methods = re.search(r"^methods=\((.*)\)$", (ROOT / "start").read_text(), re.M).group(1).split()
        printed = subprocess.run([KEMPE, "compare", "examples/andrews/andrews.yaml", "--reference", "examples/andrews/reference.csv", "--all", *methods],
                                 cwd=ROOT, capture_output=True, text=True, check=True).stdout
        said = subprocess.run(["awk", program], input=printed, capture_output=True, text=True, check=True).stdout.split("\n")
        rows = [line for line in said if re.search(r"\) +\d+\.\d\d ms +\d+\.\d\d ms$", line)]
        self.assertEqual(len(rows), 7)
        cheapest = re.search(r"^fastest, ms +(.*)", printed, re.M).group(1).split()
        times = [re.findall(r"\d+\.\d\d(?= ms)", row) for row in rows]
        least = [f"{float(cheapest[k]):.2f}" for k in (3, 5)]
        self.assertEqual([min(column, key=float) for column in zip(*times)], least)
        self.assertTrue(any(re.match(r"Recommended: --formulation (reduced|projected|dae) --integrator \w+ --rtol \S+\.$", line) for line in said))
        self.assertTrue(any(line.startswith("There the loops are closed to ") for line in said))
        self.assertLessEqual(len(said), 20)

    def test_readme(self):
        """One minute long; its model is the one that `kempe new` writes."""
        text = (ROOT / "README.md").read_text()
        self.assertLessEqual(len(text.split("\n")), 131)
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([KEMPE, "new", "four_bar"], cwd=folder, check=True, capture_output=True)
            self.assertIn((pathlib.Path(folder) / "four_bar.yaml").read_text(), blocks(text))

    def test_readme_has_the_figures_that_are_recorded(self):
        text = re.sub(r"\s+", " ", (ROOT / "README.md").read_text())
        record = lambda name, pattern: re.search(pattern, (ROOT / "bench" / name).read_text(), re.M).groups()
        of = lambda name, column: re.findall(r"[\d.]+ \((\S+)x\)", record("README.md", rf"^(\| {name}.*)$")[0])[column]
        andrews, = record("README.md", r"^\| Kempe, reduced, radau \|.* ([\d.]+) \|$")
        self.assertIn(f"to an error of 1e-8 takes {andrews} ms. heyoka takes {of('heyoka, reduced ODE', 2)} times as long, Hairer's RADAU "
                      f"{of('RADAU, orders 5 to 13, reduced', 2)} times, Pinocchio with an error-controlled integrator {of('Pinocchio, Dormand', 2)} times. "
                      f"To 1e-3 MuJoCo takes {of('MuJoCo, stiffest', 0)} times as long", text)
        four_bar = (ROOT / "bench/README.md").read_text().split("The four-bar over ten turns")[1]
        self.assertIn("heyoka is the faster one, {} times".format(re.search(r"^\| heyoka.*?\((\S+)x\)", four_bar, re.M)[1]), text)
        same, best = ((ROOT / "bench/results/formulations.txt").read_text().split(f"({part}) ")[2].split("(a) ")[0].split("(b) ")[0]
                      for part in "ab")
        columns = lambda table: list(zip(*([float(x.rstrip("x")) if re.match(r"[\d.]", x) else None for x in line.strip("| ").split(" | ")[1:]]
                                           for line in table.split("\n")[4:] if line.startswith("| "))))
        others = columns(best)[2:]
        self.assertEqual(len(others[0]), 25)
        self.assertIn("`reduced` takes at most {:g} times the time of the best formulation, `projected` {:g} and `dae` {:g} times. The medians are {:g}, {:g} "
                      "and {:g}.".format(*map(max, others), *map(statistics.median, others)), text)
        dop853, radau, ida = (columns(same)[k] for k in (0, 2, 5))
        spans = [f(a / b for a, b in zip(one, radau) if a and b) for one in (dop853, ida) for f in (min, max)]
        self.assertIn("DOP853 takes {:g} to {:g} times as long as Radau, IDA {:g} to {:g} times".format(*(float(f"{x:.2g}") for x in spans)), text)
        closed, = record("results/andrews.txt", r"loops (?:are )?closed to (\S+)(?: of the size of the mechanism)?$")
        self.assertIn(f"to {closed} of the characteristic length", text)
        self.assertIn("{} of {} runs reach their end, in up to {} times".format(*record("results/lamps.txt", r"^all: (\d+) of (\d+),"), *record("results/lamps.txt", r"worst (\S+)$")), text)
        models, = record("results/oracle.txt", r"^(\d+) random models of seed \d+: 0 disagreements without a warning, 0 with one;")
        self.assertIn(f"On [{models} random models]", text)
        self.assertIn("{} runs did not pass, and {} models were refused".format(*record("results/oracle.txt", r"(\d+) runs that Kempe itself does not trust; (\d+) refused")), text)
        ensemble = (ROOT / "bench/results/ensemble.txt").read_text()
        faster, wide = (re.findall(rf"against {of}: (\S+) times as fast", ensemble) for of in ("runs one by one", "four lanes"))
        self.assertIn(f"run [{float(faster[0]):.1f} times](bench/results/ensemble.txt) as fast", text)
        self.assertIn(f"Andrews' mechanisms {float(faster[1]):.1f} times", text)
        self.assertIn("With four lanes these are {:.1f} and {:.1f} times".format(*(float(a) / float(b) for a, b in zip(faster, wide))), text)

    def test_the_first_page_has_the_figures_that_are_recorded(self):
        """Each number of the site's first page, with the processor that its record names."""
        figures = re.findall(r'<li><b>(.*?)</b>(.*?)<small><a href="(.*?)\.html[^"]*">(.*?)</a>', (ROOT / "docs/site/front.txt").read_text())
        record = lambda name: (ROOT / "bench" / name).read_text()
        peers, oracle, lamps, ensemble = (record(name) for name in ("README.md", "results/oracle.txt", "results/lamps.txt", "results/ensemble.txt"))
        time, = re.findall(r"^\| Kempe, reduced, radau \|.* ([\d.]+) \|$", peers, re.M)
        models, wrong, untrusted, refused = re.search(r"^(\d+) random models .*?: (\d+) disagreements without a warning.*?; (\d+) runs .*?; (\d+) refused", oracle, re.M).groups()
        passed, runs = re.search(r"^all: (\d+) of (\d+),", lamps, re.M).groups()
        times, = re.findall(r"against runs one by one: (\S+) times as fast", ensemble)[:1]
        count, = re.findall(r"^four_bar: (\d+) instances", ensemble, re.M)
        self.assertEqual([figure[0] for figure in figures], [f"{time} ms", f"{wrong} of {models}", f"{passed} of {runs}", f"{float(times):.1f} times"])
        self.assertIn(f"it does not trust {untrusted} and refuses {refused}", figures[1][1])
        self.assertEqual(("ten thousand" in figures[3][1], count), (True, "10000"))
        for (_, _, page, processor), text in zip(figures, (record("results/peers-2026-11-22-epyc.md"), oracle, lamps, ensemble)):
            self.assertTrue((ROOT / f"{page}.md").exists(), page)
            self.assertIn(" ".join(processor.split()[:2]), text.replace("(R)", ""))

    def test_pictures(self):
        """Pictures are of the motions that the command computes now, to a fraction of a pixel."""
        number = re.compile(r"-?\d+\.\d+")
        for name, draw in (("walk", pictures.walk), ("four_bar", pictures.four_bar)):
            kept, made = (ROOT / f"docs/{name}.svg").read_text(), draw(KEMPE)
            self.assertEqual(number.sub("#", kept), number.sub("#", made))
            off = max(abs(float(a) - float(b)) for a, b in zip(number.findall(kept), number.findall(made)))
            self.assertLess(off, 0.3)

    def test_compare_shows_what_is_recorded(self):
        recorded = (ROOT / "bench/results/andrews.txt").read_text().rstrip("\n").split("\n")
        shown = re.search(r"<!-- table -->\n(.*?)\n<!-- /table -->", (ROOT / "docs/compare.md").read_text(), re.S).group(1)
        end = next(k for k, line in enumerate(recorded) if line.lower().startswith("(a) the same"))
        self.assertEqual(shown.split("\n"), [f"    {line}".rstrip() for line in [recorded[0][2:], "", *recorded[end:]]])

    def test_tables_of_records(self):
        """Pages have whole records of the bench set."""
        for name, page, mark in (("formulations", "compare.md", "formulations"), ("before_after", "decisions/speed.md", "table")):
            shown = re.search(rf"<!-- {mark} -->\n(.*?)<!-- /{mark} -->", (ROOT / "docs" / page).read_text(), re.S).group(1)
            self.assertEqual(shown, (ROOT / f"bench/results/{name}.txt").read_text().split("\n", 3)[3])

    def test_json_of_a_simulation(self):
        """Its keys are the page's; two of them come with a reference."""
        out = subprocess.run([KEMPE, "simulate", "examples/driven_slider_crank/driven_slider_crank.yaml", "--json", "-", "--reference",
                              "examples/driven_slider_crank/reference.csv"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        self.assertEqual(words("".join(first_cells(section("outputs.md", "JSON of a simulation")))), set(json.loads(out)))

    def test_counts(self):
        """Counts on the page are those that are recorded."""
        recorded = {line.strip() for name in ("opcounts", "loop_counts", "robotran", "paper")
                    for line in (ROOT / f"bench/results/{name}.txt").read_text().split("\n")}
        page = (ROOT / "docs/counts.md").read_text()
        lines = [line.strip() for block in blocks(page) for line in block.split("\n") if re.search(r"\d", line)]
        self.assertEqual([line for line in lines if line not in recorded and not line.startswith("python3")], [])
        self.assertGreaterEqual(len(lines), 10)
        table = (ROOT / "bench/results/robotran.txt").read_text()
        for name, robotran, ner, own, ratio in re.findall(r"^\| (\w+) \| (\d+) \| (\d+) \| (\d+) \| ([\d.]+) \|$", page, re.M):
            with self.subTest(name):
                part = table[table.index(f"\n{name}\n"):]
                found = [re.search(rf"^  {row} +(\d+) +\d+ \| +(\d+) .*\| +([\d.]+)$", part, re.M).groups()
                         for row in ("M_C", "M_C, scheme ner")]
                self.assertEqual((own, robotran, ratio, ner), (*found[0], found[1][0]))


class Models(unittest.TestCase):
    def test_blocks(self):
        count = 0
        with tempfile.TemporaryDirectory() as folder:
            for page in PAGES:
                named = files(page).values()  # run by the page's own commands
                for block in blocks(page.read_text()):
                    if not block.startswith("kempe: 1") or page.name == "extending.md" or block in named:
                        continue
                    model = pathlib.Path(folder) / "model.yaml"
                    model.write_text(block)
                    for command in (["check"], ["show", "--model"]):
                        done = subprocess.run([KEMPE, command[0], model, *command[1:]], capture_output=True, text=True,
                                              timeout=100)
                        self.assertEqual(done.returncode, 0, f"{page.relative_to(ROOT)}\n{done.stderr}")
                    count += 1
        self.assertGreaterEqual(count, 2)


class Commands(unittest.TestCase):
    done = {}  # commands that do the same on several pages

    def test_lines(self):
        count = 0
        global QUICK_CC
        with tempfile.TemporaryDirectory() as shared:
            QUICK_CC = quick_compiler(shared)
            shutil.copytree(ROOT / "examples", pathlib.Path(shared) / "examples")
            for page in PAGES:
                with tempfile.TemporaryDirectory() as folder:
                    (pathlib.Path(folder) / "examples").symlink_to(pathlib.Path(shared) / "examples")
                    (pathlib.Path(folder) / "tests").symlink_to(ROOT / "tests")
                    count += self.run_page(page, pathlib.Path(folder))
        self.assertGreaterEqual(count, 10)

    def run_page(self, page, folder):
        for name, text in files(page).items():
            (folder / name).write_text(text)
        for name in re.findall(r"`kempe new (\w+)`", page.read_text()):
            subprocess.run([KEMPE, "new", name], cwd=folder, capture_output=True, check=True)
        lines = list(commands(page))
        outputs = {}
        read = {name for _, line in lines for word in line for name in re.findall(r"\w+\.(?:yaml|csv|urdf|mjcf|sdf)", word)}
        self.assertEqual(set(files(page)) - read, set(), "models and tables that no command reads")
        for place, line in lines:
            if not FULL and any(words in " ".join(line) for words in LONG):
                continue
            with self.subTest(f"{page.relative_to(ROOT)}: {line}"):
                words = tuple(line if FULL else shortened(line))
                done = self.done.get(words) if place == "." else None
                done = done or ran(words, folder / place)
                if place == "." and reads_examples(words):
                    self.done[words] = done
                self.assertEqual(done.returncode, wanted_end(page, line), done.stderr)
                if FULL or shortened(line) == line:
                    outputs[place, *line] = done.stdout + done.stderr
        for place, line, quoted in quotations(page):
            with self.subTest(f"{page.relative_to(ROOT)}: output of {line}"):
                printed = outputs.get((place, *line)) or self.output(folder / place, line)
                self.assertIsNone(missing(quoted, printed), printed)
        return len(lines)

    def output(self, folder, line):
        done = ran(line, folder)
        return done.stdout + done.stderr

    def test_quotations_that_are_wrong_are_found(self):
        printed = "drift 1.01e-07 (relative)\ncpu 1.23 ms\n  A  rad  73.658\n  |h| 5.8e-15\n"
        for quoted in (["drift 1.01e-07 (relative)", "...", "A rad 73.658"], ["cpu  9.9 ms"], ["|h| 1e-16"]):
            self.assertIsNone(missing(quoted, printed))
        for quoted in (["drift 1.02e-07 (relative)"], ["A rad 73.658", "drift 1.01e-07 (relative)"], ["A deg 73.658"], ["A rad 73.7"],
                       ["drift 1.01e-07 (relative)", "A rad 73.658"]):
            self.assertIsNotNone(missing(quoted, printed))

    def test_pages_of_first_steps(self):
        """The how-to has recipes enough, each of which runs a command."""
        recipes = re.findall(r"^## .*\n((?:(?!^## ).*\n)*)", (ROOT / "docs/howto.md").read_text(), re.M)
        self.assertGreaterEqual(len(recipes), 15)
        self.assertEqual([recipe[:60] for recipe in recipes if "\n    kempe " not in recipe], [])

    def test_every_command_is_shown(self):
        """In the README's table, in its order; each also as a line of some page that is run."""
        out = subprocess.run([KEMPE, "--help"], capture_output=True, text=True, timeout=100).stdout
        names = re.findall(r"^  (\w+) ", out[out.index("commands:"):out.index("'kempe help COMMAND")], re.M)
        shown = re.search(r"^## Commands\n(.*?)^## ", (ROOT / "README.md").read_text(), re.M | re.S).group(1)
        self.assertGreaterEqual(len(names), 5)
        self.assertEqual(set(re.findall(r"`(\w+)`", "".join(first_cells(shown)))), set(names))
        self.assertEqual(set(names) - {line[0] for page in PAGES for _, line in commands(page)}, set())


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
