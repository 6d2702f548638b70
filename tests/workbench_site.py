#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The workbench as a page without a server (docs/site_workbench.py) in Chromium, opened from a file: the four-bar runs, an error stands
at its line with the library's sentence, the mouse draws and drags, files and links contain the text.

    python3 tests/workbench_site.py build/wasm/workbench [unittest arguments]
    python3 tests/workbench_site.py build/wasm/workbench --picture FILE.png       a screen of the page after a run

Exit code 77: Chromium or the module (WORKBENCH=ON packaging/build_wasm) is not there.
"""
import base64
import json
import math
import pathlib
import sys
import tempfile
import time
import unittest

import browser
from workbench_tab import DRAWN, Page

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "docs"))

import site_workbench  # noqa: E402

MODULE = None
LINK = """kempe: 1
parameters: {l: 0.5}
bodies:
  link:
    mass: 2*l
    joint: {revolute: z, at: ground}
    com: [l/2, 0, 0]
    inertia: {zz: l^3/6}
    points: {end: [l, 0, 0]}
"""
DOUBLE = """kempe: 1
gravity: [0, -9.81, 0]
include:
  - {file: link.yaml, prefix: upper_}
  - {file: link.yaml, prefix: lower_, at: upper_link.end}
run: {t_end: 0.2}
"""
TABLE = """kempe: 1
tables:
  pull: {csv: data/pull.csv, x: t, y: m, method: linear}
bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}}
forces: {push: {joint: A, torque: pull(t)}}
run: {t_end: 0.5}
"""
FOUR_BAR = (ROOT / "examples/four_bar/four_bar.yaml").read_text()


class SitePage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.file = pathlib.Path(cls.folder.name) / "workbench.html"
        cls.file.write_text(site_workbench.page(MODULE))
        cls.page = Page()

    @classmethod
    def tearDownClass(cls):
        cls.page.end()
        cls.folder.cleanup()

    def start(self, text=None, link=""):
        self.page.screen()
        self.page.open(self.file.as_uri() + link)
        if text is not None:
            self.page.checked(lambda: self.page.value(f"changeText({json.dumps(text)})"))
        return self.page

    def tearDown(self):
        self.page.value("bench.saved = bench.text, bench.others.forEach((file) => (file.saved = file.text))")  # a page with unsaved text asks before it is left
        self.assertEqual(self.page.complaints(), [])

    def test_runs_the_four_bar(self):
        page = self.start()
        self.assertEqual(page.model(), FOUR_BAR)
        self.assertEqual(page.text("#messages"), "")
        page.run("motion")
        self.assertRegex(page.text("#verdict"), r"^✓ Complete: 0 to 5 s$")
        self.assertEqual(page.value("byId('view').dataset.bodies"), "4")
        self.assertGreater(page.value("bench.run.column('t').y.length"), 100)
        page.press("#tab-pins")
        self.assertRegex(page.text("#verdict"), r"Largest pin force: \S+ N in \w+")

    def test_other_studies(self):
        page = self.start("kempe: 1\nname: pendulum\nbodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0, -0.5, 0], inertia: {zz: 0.05}}}\n"
                          "gravity: [0, -9.81, 0]\n")
        page.run("equilibrium")
        self.assertRegex(page.text("#verdict"), r"One equilibrium, stable")
        page.run("modes")
        self.assertRegex(page.text("#verdict"), r"1 mode, ")
        told = page.value("document.querySelector('#table .pressable').children[1].textContent")
        self.assertAlmostEqual(float(told), math.sqrt(9.81 * 0.5 / 0.3) / (2 * math.pi), places=4)  # of a rod about its end

    def test_an_error_stands_at_its_line(self):
        page = self.start(FOUR_BAR.replace("mass: crank_mass", "mass: crank_mas", 1))
        line = FOUR_BAR[:FOUR_BAR.index("mass: crank_mass")].count("\n") + 1
        self.assertRegex(page.text("#messages"), rf"line {line}:\d+: unknown parameter 'crank_mas'; did you mean 'crank_mass'\?")
        page.press("#run")
        page.until("byId('verdict').textContent.includes('mend it first')")
        page.checked(lambda: page.press("#undo"))
        self.assertEqual(page.text("#messages"), "")

    def take(self, files):
        """Files as the user opens them, by their names without folders."""
        self.page.checked(lambda: self.page.value(f"takeFiles(Object.entries({json.dumps(files)}).map(([name, text]) => new File([text], name))).then(() => 1)"))

    def test_a_missing_file_is_named(self):
        page = self.start("kempe: 1\nname: car\ninclude:\n  - file: wheel.yaml\n")
        self.assertRegex(page.text("#messages"), r"line 4:\d+: .*wheel\.yaml")
        self.assertIn("Open wheel.yaml with Files", page.text("#messages"))

    def test_several_files(self):
        page = self.start()
        self.take({"link.yaml": LINK, "double.yaml": DOUBLE})
        self.assertEqual((page.model(), page.text("#messages"), page.text("#file-name")), (DOUBLE, "", "double.yaml"))
        self.assertRegex(page.text("#model-files"), r"link\.yaml")
        page.run("motion")
        self.assertEqual(page.text("#verdict"), "✓ Complete: 0 to 0.2 s")
        start = page.place(page.value("modelPlaces(bench.model).find(({ body, point }) => body === 'lower_link' && point === 'end').world"))
        page.pull(start, [start[0] - 20, start[1] + 30])
        page.until("byId('view').dataset.closure")
        page.mouse("mouseReleased", [start[0] - 20, start[1] + 30])
        page.until("byId('keep-start')")
        page.value("[...document.querySelectorAll('#model-files button')].find((one) => one.textContent === 'link.yaml').id = 'that-file'")
        page.press("#that-file")
        self.assertEqual(page.model(), LINK)
        page.checked(lambda: page.value("modelEditor.setValue(modelEditor.getValue().replace('mass:', 'mas:'))"))
        self.assertRegex(page.text("#messages"), r"link\.yaml, line 5:\d+: .*mas")
        self.assertEqual(page.value("document.querySelectorAll('.CodeMirror-lint-marker-error').length"), 1)
        page.checked(lambda: page.press("#undo"))
        self.assertEqual((page.model(), page.text("#messages")), (LINK, ""))
        page.value("shareModel()")
        page.until("document.documentElement.dataset.shared")
        address = page.value("document.documentElement.dataset.shared")
        self.assertIn("#files=", address)
        page.value("Object.assign(bench, { saved: bench.text }), bench.others.forEach((file) => (file.saved = file.text))")
        page.open(address)
        self.assertEqual((page.model(), page.text("#messages"), page.text("#file-name")), (DOUBLE, "", "double.yaml"))
        page.checked(lambda: page.press("#model-files .away"))
        self.assertIn("link.yaml", page.text("#messages"))
        page.checked(lambda: page.press("#notice button"))
        self.assertEqual(page.text("#messages"), "")

    def test_a_table_in_a_folder(self):
        """A file is held by the name that the model has for it, folders included."""
        page = self.start(TABLE)
        self.assertIn("pull.csv", page.text("#messages"))
        self.take({"pull.csv": "t,m\n0,0\n1,5\n"})
        self.assertEqual((page.text("#messages"), page.value("[...bench.others.keys()]")), ("", ["data/pull.csv"]))
        self.assertEqual(page.model(), TABLE)
        page.run("motion")
        self.assertEqual(page.text("#verdict"), "✓ Complete: 0 to 0.5 s")
        hostile = "<img src=x onerror=window.hurt=1>"
        link = page.value(f"bench.others.set({json.dumps(hostile + '.csv')}, {{ text: '1' }}), bench.name = {json.dumps(hostile + '.yaml')}, linkOfModel()")
        page.value("bench.saved = bench.text, bench.others.forEach((file) => (file.saved = file.text))")
        self.start(link=link)
        self.assertEqual((page.text("#file-name"), page.model()), (hostile + ".yaml", TABLE))
        self.assertIn(hostile, page.text("#model-files"))
        self.assertEqual(page.value("[window.hurt ?? null, document.images.length]"), [None, 0])

    def test_the_mouse_adds_a_bar(self):
        page = self.start("")
        page.press("[data-tool=bar]")
        page.checked(lambda: (page.click(page.place([0, 0, 0])), page.click(page.place([0, 0.3, 0]))))
        self.assertIn(DRAWN[DRAWN.index("  bar1:"):DRAWN.index("  bar2:")], page.model())
        self.assertEqual(page.text("#messages"), "")

    def test_dragging_keeps_loops_closed(self):
        page = self.start(DRAWN[:DRAWN.index("\ndrives")])
        start = page.place([0.35, 0.5, 0])
        page.pull(start, [start[0] + 60, start[1] + 30])
        page.until("byId('view').dataset.closure")
        page.mouse("mouseReleased", [start[0] + 60, start[1] + 30])
        page.until("byId('keep-start')")
        self.assertLess(float(page.value("byId('view').dataset.closure")), 1e-10)
        ends = page.value("['bar2', 'bar3'].map((body) => modelPlaces(bench.model).find((p) => p.body === body && p.point === 'C').world)")
        self.assertLess(math.dist(*ends), 1e-10)
        self.assertGreater(math.dist(ends[0], [0.7, 0.7, 0]), 0.01)

    def test_files_and_links(self):
        page = self.start(DRAWN)
        page.press("#save")
        self.assertEqual(page.downloaded(".yaml").decode(), DRAWN)
        page.until("byId('saved').textContent === 'saved'")
        page.value("shareModel()")
        page.until("document.documentElement.dataset.shared")
        address = page.value("document.documentElement.dataset.shared")
        self.assertTrue(address.startswith(self.file.as_uri() + "#model="))
        self.start(link=address[address.index("#"):])
        self.assertEqual(page.model(), DRAWN)

    def test_a_long_run_is_stopped(self):
        page = self.start(DRAWN)
        page.value("byId('t-end').value = '100000'")
        page.press("#run")
        page.until("byId('run').textContent === 'Stop'")
        page.press("#run")
        page.until("!bench.running")
        self.assertIn("the computation was stopped", page.text("#verdict").lower())
        page.run("motion")
        self.assertEqual(page.text("#verdict"), "✓ Complete: 0 to 2 s")

    def test_the_language_server_completes(self):
        page = self.start("kempe: 1\ngra")
        page.value("modelEditor.focus(); modelEditor.setCursor({ line: 1, ch: 3 }); modelEditor.showHint()")
        page.until("document.querySelector('.CodeMirror-hints')?.textContent.includes('gravity')")


def take_picture(path):
    with tempfile.TemporaryDirectory() as folder:
        file, page = pathlib.Path(folder) / "workbench.html", Page()
        file.write_text(site_workbench.page(MODULE))
        page.screen()
        page.open(file.as_uri())
        page.run("motion")
        time.sleep(1)
        path.write_bytes(base64.b64decode(page.call("Page.captureScreenshot", format="png")["data"]))
        page.end()


def main(arguments):
    global MODULE
    if not arguments:
        print(__doc__)
        return 2
    MODULE = pathlib.Path(arguments.pop(0))
    if not browser.CHROMIUM or not (MODULE / "kempe_page.js").exists():
        print("skipped: Chromium or", MODULE / "kempe_page.js", "is not there")
        return 77
    if arguments and arguments[0] == "--picture":
        take_picture(pathlib.Path(arguments[1]))
        return 0
    unittest.main(argv=[sys.argv[0], *arguments])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
