#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The documentation is true: models on its pages are read, commands on them are run, its tables have the rows of the
.def files, its links and the files that it names are there. Called with the path of the command:

    python3 tests/docs.py build/dev/kempe

Programs on the pages are compiled elsewhere: README.md by tests/CMakeLists.txt, docs/extending.md by tests/extending.py.
"""
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "schema"))
import generate  # noqa: E402

KEMPE = "kempe"  # set by main
PAGES = sorted([ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md"), *ROOT.glob("bench/*.md")])


def words(text):
    return set(re.findall(r"`([^`]+)`", text))


def section(page, title):
    """What stands under a heading, up to the next one of its level or above."""
    text = (ROOT / "docs" / page).read_text()
    return re.search(rf"^##+ {title}\n(.*?)(?=^## |\Z)", text, re.M | re.S).group(1)


def first_cells(text):
    return [line.split("|")[1] for line in text.split("\n") if line.startswith("| ")]


def blocks(text):
    """Indented and fenced blocks, without their indentation and fences."""
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.M | re.S)
    found = re.findall(r"(?:^    .*\n|^\n(?=    ))+", text, re.M)
    return fenced + ["\n".join(line[4:] for line in block.strip("\n").split("\n")) + "\n" for block in found]


def commands():
    """(page, the block's folder, words) of every line that begins with `kempe` and names a file that is there."""
    for page in PAGES:
        for block in blocks(page.read_text()):
            folder = "."
            for line in block.split("\n"):
                if line.startswith("cd "):
                    folder = line[3:]
                if re.match(r"kempe \w+ \S+\.yaml", line):
                    yield page, folder, shlex.split(line)[1:]


class Tables(unittest.TestCase):
    def there(self, table, macro, title, column=0, page="model_format.md"):
        rows = {row[column] for row in generate.rows(table, macro)}
        self.assertEqual(rows - words(section(page, title)), set(), f"{page}, {title}: rows of {table} are not there")
        return rows

    def test_joints(self):
        names = self.there("joints.def", "KMP_JOINT", "Joints")
        cells = words("".join(first_cells(section("model_format.md", "Joints"))))
        self.assertEqual(cells, names | {"at", "to", "name", "frame", "motions", "reversed", "coordinates"})

    def test_cuts(self):
        rows = [cell.split("`") for cell in section("model_format.md", "Graphs of joints").split("\n")
                if re.fullmatch(r"\| `\w+` +\| `\w+` +\| \d +\|", cell)]
        table = {(joint, closure, rows) for joint, closure, rows, _ in generate.rows("cuts.def", "KMP_CUT")}
        self.assertEqual({(row[1], row[3], row[4].strip(" |")) for row in rows}, table)

    def test_closures(self):
        kinds = {name for name, _ in generate.rows("closure_kinds.def", "KMP_CLOSURE")}
        cells = first_cells(section("model_format.md", "Loops"))[1:]
        self.assertEqual({re.search(r"\{(\w+):", cell).group(1) for cell in cells}, kinds)

    def test_forces(self):
        page = section("model_format.md", "Forces")
        cells = first_cells(page)[1:]
        self.assertEqual(len({re.search(r"`(\w+):", cell).group(1) for cell in cells}), len(cells))
        for kind, name, place, word, *_ in generate.rows("force_kinds.def", "KMP_FORCE"):
            if place == "wheel":
                continue  # of a section of its own
            with self.subTest(name):
                wanted = [place, *{"NULL": [], "effort": ["torque"]}.get(word, [word])]
                self.assertTrue(any(all(f"{key}:" in cell for key in wanted) for cell in cells), wanted)
        for kind, _, key, *_ in generate.rows("force_kinds.def", "KMP_FIELD"):
            with self.subTest(f"{kind} {key}"):
                self.assertTrue(any(f"{key}:" in cell for cell in cells) or key == "effort")

    def test_outputs(self):
        cells = words("".join(first_cells(section("model_format.md", "Run"))))
        names = {cell.split("(")[0] for cell in cells}
        self.assertEqual({row[1] for row in generate.rows("output_kinds.def", "KMP_OUTPUT")} - names, set())

    def test_functions_and_units(self):
        page = section("model_format.md", "Expressions")
        called = {word.split("(")[0] for word in words(page)}
        functions = {row[0] for row in generate.rows("functions.def", "KMP_FUNCTION")}
        self.assertEqual(functions - called, set())
        table = page[page.index("| dimension"):page.index("**Dimensions are checked")]
        units = words("".join(line.split("|")[2] for line in table.split("\n") if line.startswith("| ")))
        self.assertEqual(units, {row[0] for row in generate.rows("units.def", "KMP_UNIT")})

    def test_keys(self):
        for title, source, array in (("Top level", "reader.c", "kmp_model_keys"), ("Bodies", "read_bodies.c", "body_keys"),
                                     ("Start", "read_run.c", "start_keys"), ("Run", "read_run.c", "run_keys")):
            with self.subTest(title):
                cells = words("".join(first_cells(section("model_format.md", title))))
                self.assertEqual(set(generate.keys(source, array)) - cells, set())

    def test_solvers(self):
        page = (ROOT / "docs/solvers.md").read_text()
        for table in ("integrators", "linear"):
            text = re.sub(r"/\*.*?\*/", "", next((ROOT / "integrators").rglob(f"{table}.def")).read_text(), flags=re.S)
            self.assertEqual(set(re.findall(r"KMP_\w+\((\w+)\)", text)) - words(page), set())
        text = re.sub(r"/\*.*?\*/", "", (ROOT / "integrators/formulations/formulations.def").read_text(), flags=re.S)
        self.assertEqual(set(re.findall(r"KMP_FORMULATION\((\w+)\)", text)) - words(page), set())


    def test_languages(self):
        page = (ROOT / "docs/generate.md").read_text()
        text = re.sub(r"/\*.*?\*/", "", (ROOT / "src/generate/languages/languages.def").read_text(), flags=re.S)
        for language in re.findall(r"KMP_LANGUAGE\((\w+)\)", text):
            self.assertIn(f"--lang {language} ", page)
        sets = re.sub(r"/\*.*?\*/", "", (ROOT / "src/generate/sets.def").read_text(), flags=re.S)
        self.assertEqual(set(re.findall(r'"(\w+)"', sets)) - words(page), set())


class Pages(unittest.TestCase):
    def test_links(self):
        linked = set()
        for page in PAGES:
            prose = re.sub(r"`[^`]*`", "", re.sub(r"^    .*$", "", page.read_text(), flags=re.M))
            for link in re.findall(r"\]\(([^)#]+)[^)]*\)", prose):
                if "://" in link:
                    continue
                target = (page.parent / link).resolve()
                linked.add(target)
                with self.subTest(f"{page.relative_to(ROOT)}: {link}"):
                    self.assertTrue(target.exists())
        self.assertEqual(set(PAGES) - linked, {ROOT / "README.md"}, "pages that nobody links")

    def test_files_named(self):
        page = (ROOT / "docs/overview.md").read_text()
        folders = "include src constraints integrators examples tests bench docs packaging schema".split()
        for word in words(page):
            if re.fullmatch(rf"({'|'.join(folders)})(/[\w./*-]+)?", word) and not re.search("[A-Z]{4}", word):
                with self.subTest(word):
                    self.assertTrue(list(ROOT.glob(word)))

    def test_readme_shows_what_is_recorded(self):
        recorded = (ROOT / "bench/results/andrews.txt").read_text().rstrip("\n").split("\n")
        shown = re.search(r"<!-- table -->\n(.*?)\n<!-- /table -->", (ROOT / "README.md").read_text(), re.S).group(1)
        end = next(k for k, line in enumerate(recorded) if line.startswith("time to an error"))
        self.assertEqual(shown.split("\n"), [f"    {line}".rstrip() for line in [recorded[0][2:], "", *recorded[end:]]])


    def test_counts(self):
        """Counts on the page are those that are recorded."""
        recorded = {line.strip() for name in ("opcounts", "robotran", "paper")
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
                for block in blocks(page.read_text()):
                    if not block.startswith("kempe: 1") or page.name == "extending.md":
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
    def test_lines(self):
        count = 0
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(ROOT / "examples", pathlib.Path(folder) / "examples")
            for page, place, line in commands():
                with self.subTest(f"{page.relative_to(ROOT)}: {line}"):
                    done = subprocess.run([KEMPE, *line], cwd=pathlib.Path(folder) / place, capture_output=True,
                                          text=True, timeout=300)
                    self.assertEqual(done.returncode, 0, done.stderr)
                count += 1
        self.assertGreaterEqual(count, 10)

    def test_readme_has_every_command(self):
        out = subprocess.run([KEMPE, "--help"], capture_output=True, text=True, timeout=100).stdout
        names = re.findall(r"^  (\w+) ", out[out.index("commands:"):out.index("'kempe COMMAND")], re.M)
        readme = (ROOT / "README.md").read_text()
        shown = set(re.findall(r"^    kempe (\w+) examples/", readme, re.M))
        self.assertEqual((len(names) >= 5, shown), (True, set(names)))


if __name__ == "__main__":
    KEMPE = os.path.abspath(sys.argv.pop(1))
    unittest.main()
