#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pages of `kempe compare --report` and `kempe modes --report`: made of several models, small, without anything from
elsewhere, and drawn by Chromium without a complaint. Called with the path of the command:

    python3 tests/report_pages.py build/dev/kempe [unittest arguments]

Ends with 77 (skipped) where Chromium is not installed.
"""
import base64
import html.parser
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

import browser
from browser import Screen

ROOT = pathlib.Path(__file__).resolve().parents[1]
MOST_BYTES = 3_000_000
COST, HISTORY, CLOSURES = ["by-cpu", "by-rhs"], ["over-energy", "over-step"], ["over-h", "over-hdot"]
KEMPE = "kempe"  # set by main


def sampled(cases, every):
    """All cases of a full check, otherwise one of so many."""
    return cases if "KEMPE_FULL" in os.environ else dict(list(cases.items())[::every])


TELEPHONE = Screen(width=360, height=740)

#   name: model, options, exit code, runs shown in detail, whether it moves, the screen
FLAT, DARK = Screen(flat=True), Screen(width=500, dark=True)
CASES = {
    "stewart": ("examples/stewart/stewart.yaml", ["--rtol", "1e-5,1e-7", "--t-end", "0.2"], 0, 3, True, DARK),
    "andrews": ("examples/andrews/andrews.yaml", ["--rtol", "1e-4,1e-6,1e-8,1e-10"], 0, 3, True, Screen()),
    "pendulum": ("tests/models/pendulum.yaml", ["--rtol", "1e-5,1e-7", "--t-end", "1"], 0, 3, True, TELEPHONE),
    "four_bar": ("examples/four_bar/four_bar.yaml", ["--rtol", "1e-5,1e-7,1e-9", "--t-end", "0.5"], 0, 3, True, FLAT),
    "parallelogram": ("tests/models/parallelogram.yaml", ["--rtol", "1e-5,1e-7", "--t-end", "0.6"], 0, 3, True, Screen()),
    "rolling": ("examples/rolling_wheel/rolling_wheel.yaml", ["--rtol", "1e-5,1e-7", "--t-end", "2", "--integrators", "radau5,ida"], 0, 2, True, FLAT),
    "friction": ("tests/models/friction_loop.yaml", ["--rtol", "1e-5"], 1, 0, False, Screen()),
    "open": ("tests/models/robotran.yaml", ["--rtol", "1e-5"], 1, 0, False, Screen()),
}

#   name: model, options, modes in the list, of these zeros, curves in the plane, critical values
MODES = {
    "quarter_car": ("examples/quarter_car/quarter_car.yaml", ["--sweep", "damper=0:4000:21", "--orders", "0.01"], 2, 0, 4, 0),
    "car": ("examples/suspension/suspension.yaml", [], 15, 4, 0, 0),
    "wheelset": ("examples/restrained_wheelset/restrained_wheelset.yaml", ["--sweep", "V=40:140:11"], 2, 0, 4, 1),
}


class Page(html.parser.HTMLParser):
    """Tags with their attributes, texts of elements with an id."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.by_id, self.open = [], {}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append((tag, attributes))
        if "id" in attributes:
            self.by_id[attributes["id"]] = attributes
        if tag not in ("meta", "link", "img", "input", "br"):
            self.open.append((tag, attributes.get("id")))

    def handle_endtag(self, tag):
        while self.open and self.open.pop()[0] != tag:
            pass

    def handle_data(self, text):
        for _, name in self.open:
            if name:
                self.by_id[name]["text"] = self.by_id[name].get("text", "") + text

    def words(self, name):
        return " ".join(self.by_id[name].get("text", "").split())


def data_of(page):
    """The data of a page, from its file: the browser gives no copy of them."""
    text = page.read_text()
    begin = text.index(">", text.index('id="data"')) + 1
    return json.loads(text[begin:text.index("</script>", begin)])


def kempe(*words, **environment):
    return subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, timeout=300,
                          env={**os.environ, **environment})


def method_of(run):
    return tuple(run.get(word) for word in ("formulation", "form", "integrator", "linear"))


def open_page(page, screen=Screen()):
    """The page as it is drawn, and its complaints."""
    text, said = browser.draw(page, screen)
    return Page(text), said


def check_narrow(self, drawn, screen):
    """Nothing is wider than a telephone, and the page does not scroll sideways."""
    if screen.width > TELEPHONE.width:
        return
    root = drawn.tags[0][1]
    self.assertEqual((int(root["data-width"]), root["data-wide"], root["data-scrolls"]), (TELEPHONE.width, "", "false"))


def check_by_itself(self, page):
    text = page.read_text()
    self.assertLess(len(text.encode()), MOST_BYTES)
    own = Page(text)
    loads = [(tag, key) for tag, attributes in own.tags for key in attributes if key in ("src", "href", "srcset")]
    self.assertEqual(loads, [])
    self.assertEqual([tag for tag, _ in own.tags if tag in ("link", "iframe", "object", "base")], [])
    policy = [a["content"] for tag, a in own.tags if a.get("http-equiv") == "Content-Security-Policy"]
    self.assertTrue(policy[0].startswith("default-src 'none'"), policy)
    self.assertNotIn("http", policy[0])
    ours = text[text.rindex("<script>"):]
    self.assertIsNone(re.search(r"\bfetch\(|XMLHttpRequest|\bimport\b|url\(|https?://", ours))
    names = re.findall(r"^(?:function|const|let) (\w+)", ours, re.M)
    self.assertEqual(sorted(name for name in set(names) if names.count(name) > 1), [])
    for licence in ("three.js authors", "Chart.js Contributors", "Permission is hereby granted"):
        self.assertIn(licence, text)


class Folder(unittest.TestCase):
    """Tests with a folder of their own."""

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.place.name)

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()


class Case(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.pages = {}
        for name, (model, options, code, *_) in sampled(CASES, 2).items():
            page = cls.folder / f"{name}.html"
            done = kempe("compare", ROOT / model, *options, "--report", page)
            if done.returncode != code or not page.exists():
                raise AssertionError(f"{name}: exit code {done.returncode}\n{done.stderr}")
            cls.pages[name] = page

    def test_small_and_by_itself(self):
        for name, page in self.pages.items():
            with self.subTest(name):
                check_by_itself(self, page)

    def check_words(self, name, page, data):
        self.assertTrue(page.words("answer"))
        if CASES[name][2] == 0:
            self.assertTrue(page.words("answer").startswith("\u2713Use " + data["advice"]["formulation"]))
            self.assertEqual(len(re.findall("CPU time|error of q|evaluations", page.words("facts"))), 3)
            self.assertIn("Reference", page.words("reference"))
        else:
            reason = {"friction": "slides", "open": "cannot be closed"}[name]
            self.assertIn("No run reached the end", page.words("answer"))
            self.assertIn(reason, page.words("because"))
            self.assertIn(reason if data["runs"] else "", page.words("failures"))

    def check_plots(self, page, data, shown):
        for plot in COST + HISTORY + (CLOSURES if data["m"] > 0 else []):
            drawn = page.by_id[plot]
            self.assertGreater(int(drawn["data-ink"]), 100, plot)
            self.assertGreaterEqual(int(drawn["data-lines"]), len({method_of(run) for run in data["runs"]}) if plot in COST else shown)
            steps = sum(len(run["steps"]) for run in data["shown"])  # of the runs that were the cheapest this time
            least = {"over-step": steps, "over-energy": 20}.get(plot, 3)
            self.assertGreater(int(drawn["data-points"]), least, plot)
        points = sum(run["error"]["q"] is not None for run in data["runs"])
        self.assertEqual(int(page.by_id["by-cpu"]["data-points"]), points)

    def check_stage(self, name, stage, data):
        _, _, _, _, moves, screen = CASES[name]
        self.assertGreater(int(stage["data-ink"]), 100)
        self.assertIn(stage["data-view"], ["canvas"] if screen == FLAT else ["canvas", "webgl"])
        self.assertEqual(stage["data-planar"], str(name not in ("stewart", "open")).lower())
        self.assertEqual(stage["data-follows"], str(name == "rolling").lower())
        self.assertEqual(int(stage["data-frames"]) > 1, moves)

    def test_drawn(self):
        for name, page in self.pages.items():
            with self.subTest(name):
                _, _, code, shown, _, screen = CASES[name]
                drawn, said = open_page(page, screen)
                self.assertEqual(said, [])
                self.assertEqual(drawn.tags[0][1].get("data-ready"), "yes")
                check_narrow(self, drawn, screen)
                data = data_of(page)
                ended = {run["formulation"] for run in data["runs"] if run["status"].startswith("complete")}
                shown = len(ended) if name == "rolling" else shown  # slow runs are left out after a time
                self.assertGreaterEqual(shown, 2 if code == 0 else 0)
                self.assertEqual(len(data["shown"]), shown)
                self.check_words(name, drawn, data)
                if code == 0:
                    self.check_plots(drawn, data, shown)
                self.check_stage(name, drawn.by_id["view"], data)
                if name == "parallelogram":
                    self.assertIn("change point", drawn.words("marks"))
                    self.assertIn("change point", drawn.words("log"))

    def test_a_page_that_complains_is_noticed(self):
        """The marks that these tests look for are there when something is wrong; and the switch of quantities does its work."""
        broken = self.folder / "broken.html"
        text = self.pages["pendulum"].read_text()
        broken.write_text(text.replace("\nbegin();\n", "\nbegin();\nbyId('rates').click();\n"
                                       "new Image().src = 'https://kempe.invalid/';\nnone();\n"))
        drawn, said = open_page(broken)
        self.assertTrue(any("none is not defined" in line for line in said), said)
        self.assertTrue(any("Content Security Policy" in line for line in said), said)
        self.assertEqual((drawn.by_id["rates"]["aria-pressed"], drawn.by_id["by-cpu"]["data-quantity"]), ("true", "qd"))

    def test_same_bytes(self):
        """All but measured times is the same again."""

        def without_times(page):
            data = data_of(page)
            for run in data["runs"]:
                for key in ("cpu_s", "build_s", "first_s", "memory_bytes"):
                    del run[key]
            times = ("shown", "picture") if page.stem != "again" else ()
            timed = ("advice", "build_s", "equal_error", "same_integrator", "best_of_formulation", "failures", "warnings", *times)
            return {key: data[key] for key in data if key not in timed}, data

        again = self.folder / "again.html"
        model, options, *_ = CASES["pendulum"]
        kempe("compare", ROOT / model, *options, "--report", again)
        first, one = without_times(self.pages["pendulum"])
        _, two = without_times(again)
        for key in first:
            self.assertEqual(first[key], two[key], key)
        if one["shown"][0]["run"] == two["shown"][0]["run"]:
            self.assertEqual(one["shown"][0], two["shown"][0])
            self.assertEqual(one["picture"], two["picture"])


class Modes(Folder):
    """Pages of modes."""

    def make(self, name):
        model, options, *_ = MODES[name]
        page = self.folder / f"{name}.html"
        done = kempe("modes", ROOT / model, *options, "--report", page)
        self.assertEqual(done.returncode, 0, done.stderr)
        return page

    def test_drawn(self):
        for name, (_, _, modes, zeros, curves, critical) in MODES.items():
            with self.subTest(name):
                page = self.make(name)
                check_by_itself(self, page)
                screen = TELEPHONE if name == "car" else Screen()
                drawn, said = open_page(page, screen)
                self.assertEqual(said, [])
                self.assertEqual(drawn.tags[0][1].get("data-ready"), "yes")
                check_narrow(self, drawn, screen)
                data = data_of(page)
                self.assertEqual((len(data["modes"]), sum(mode["index"] < data["zeros"] for mode in data["modes"])), (modes, zeros))
                buttons = [a for tag, a in drawn.tags if tag == "button" and "data-mode" in a]
                self.assertEqual([a["aria-pressed"] for a in buttons].index("true"), zeros)
                self.assertEqual(len(buttons), modes)
                self.assertEqual(drawn.words("answer"), f"\u2713Complete: {data['stability']}")
                self.assertIn(f"Mode {zeros + 1}:", drawn.words("stage-note"))
                plane, right, stage = (drawn.by_id[key] for key in ("plane", "campbell", "view"))
                self.assertEqual(int(plane["data-lines"]), curves + 1 + (curves > 0))
                for canvas in (plane, right, stage):
                    self.assertGreater(int(canvas["data-ink"]), 100)
                self.assertEqual(int(stage["data-frames"]), data["frames"] * modes)
                if curves:
                    self.assertEqual(len(data["locus"]["critical"]), critical)
                if name == "quarter_car":
                    self.check_choice(data)

    def check_choice(self, data):
        """The frames go from the state in both directions, and choosing another mode shows another."""
        _, said = browser.run("document.querySelectorAll('#modes button')[1].click();")
        self.assertEqual(said, [])
        self.assertIn("Mode 2:", Page(browser.document()).words("stage-note"))
        frames = data["frames"]
        unit, raw = data["picture"]["frames"]["unit"], base64.b64decode(data["picture"]["frames"]["position"])
        height = [x * unit for x in struct.unpack(f"<{len(raw) // 2}h", raw)][2::6]  # of the wheel, frame by frame
        for k, mode in enumerate(data["modes"]):
            own = height[k * frames:(k + 1) * frames]
            wanted = abs(complex(*mode["shape"]["wheel"])) * data["moving"][k]["amplitude"]
            self.assertEqual(own[0], own[-1])
            self.assertAlmostEqual((max(own) - min(own)) / 2, wanted, delta=0.01 * wanted + unit)

    def test_same_bytes(self):
        first = self.make("wheelset").read_bytes()
        self.assertEqual(self.make("wheelset").read_bytes(), first)


def main():
    global KEMPE
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    KEMPE = os.path.abspath(sys.argv.pop(1))
    if not browser.CHROMIUM:
        print("skipped: chromium is not installed")
        sys.exit(77)
    unittest.main(module="__main__")


if __name__ == "__main__":
    main()
