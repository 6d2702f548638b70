#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Live pages (docs/live_examples.py) in Chromium, opened from files: the mechanism moves, sliders and keys change the text and the run,
errors stand at their line with the library's sentence, and no text of a model or a message becomes HTML.

    python3 tests/live_pages.py build/wasm/javascript [unittest arguments]    the test
    python3 tests/live_pages.py build/wasm/javascript --times                 loading times, and the sizes by gzip -9
    python3 tests/live_pages.py build/wasm/javascript --all                   every page: does it move, and how long does a run take
    python3 tests/live_pages.py build/wasm/javascript --pictures FOLDER       screens of three pages
    python3 tests/live_pages.py build/wasm/javascript --picture FILE.png      one picture of three screens, docs/live_pages.png

Exit code 77: Chromium or the module (packaging/build_wasm) is not there.
"""
import base64
import gzip
import json
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import unittest

import browser

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "docs"))

import live_examples  # noqa: E402

SECONDS = 15  # for one thing to happen
MODULE = None
SCREENS = [browser.Screen(width, height, dark, plays=True) for width, height in ((1440, 900), (1024, 768), (390, 844)) for dark in (False, True)]
SHOWN = "four_bar stewart jansen_walker".split()
HOSTILE = "<img src=x onerror=alert(1)>"


class LivePage:
    """A page in the tab of a browser."""

    chromium = None

    def __init__(self, path, screen=browser.Screen(plays=True)):
        if LivePage.chromium is None:
            LivePage.chromium = browser.Chromium()
        self.browser = LivePage.chromium
        call = lambda method, **words: self.browser.call(method, self.browser.tab, **words)
        call("Emulation.setDeviceMetricsOverride", width=screen.width, height=screen.height, deviceScaleFactor=1, mobile=screen.width < 500)
        call("Emulation.setScrollbarsHidden", hidden=True)
        call("Emulation.setTouchEmulationEnabled", enabled=screen.width < 500)
        call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if screen.dark else "light"},
                                                     {"name": "prefers-reduced-motion", "value": "no-preference" if screen.plays else "reduce"}])
        self.call, self.browser.events = call, []
        call("Page.navigate", url=path.as_uri())
        self.browser.wait("Page.loadEventFired")
        self.until("document.documentElement.dataset.ready")

    def value(self, expression):
        return self.browser.value(expression)

    def until(self, expression, seconds=SECONDS):
        """The value of an expression as soon as it is true."""
        deadline = time.monotonic() + seconds
        while not (value := self.value(expression)):
            if time.monotonic() > deadline:
                raise TimeoutError(f"not within {seconds} s: {expression}; the page says {self.value('document.getElementById(`answer`)?.innerText')}")
            time.sleep(0.02)
        return value

    def type(self, old, new):
        """Replaces words of the model, as a key does."""
        self.value(f"""(() => {{ const text = document.getElementById("text");
            text.value = text.value.replace({json.dumps(old)}, () => {json.dumps(new)});
            text.dispatchEvent(new Event("input", {{ bubbles: true }})); }})()""")

    def key(self, key, code, **more):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode={"Enter": 13, " ": 32, "ArrowRight": 39}.get(key, 0), **more)

    def complaints(self):
        return [line for line in map(browser.complaint, self.browser.events) if line and not browser.HARMLESS.search(line)]

    def missing_files(self):
        """Names of files that the page asked for in vain, which are no complaints then."""
        found = [event["params"]["entry"] for event in self.browser.events if event.get("method") == "Log.entryAdded" and "ERR_FILE_NOT_FOUND" in event["params"]["entry"]["text"]]
        self.browser.events = [event for event in self.browser.events if event.get("params", {}).get("entry") not in found]
        return sorted({entry["url"].split("/")[-1] for entry in found})

    def screen(self):
        return base64.b64decode(self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True)["data"])


RUNS = "Number(document.getElementById('view').dataset.runs ?? 0)"
STATE = "document.getElementById('answer').dataset.state"
LINE = "document.getElementById('line').textContent"


class Live(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.pages = pathlib.Path(cls.folder.name)
        live_examples.write(MODULE, cls.pages, names=[*SHOWN, "tutorial_driven"])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def tearDown(self):
        self.assertEqual(self.page.complaints(), [])

    def open(self, name, screen=browser.Screen(plays=True)):
        self.page = LivePage(self.pages / f"{name}.html", screen)
        return self.page

    def test_moves_and_says_whether_to_trust_it(self):
        page = self.open("four_bar")
        self.assertEqual(page.until(f"{RUNS} && document.getElementById('view').dataset.bodies"), "4")
        before = page.value("document.getElementById('clock').textContent")
        page.until(f"document.getElementById('clock').textContent !== {json.dumps(before)}")
        self.assertGreater(page.value("ink(document.getElementById('view'))"), 200)
        self.assertGreater(page.value("ink(document.querySelector('figure canvas'))"), 200)
        page.until(f"{STATE} === 'complete'")
        self.assertRegex(page.value(LINE), r"four-bar: complete, 0 to 5 s, .* estimated error \S+ rad")

    def test_slider_changes_text_and_run(self):
        page = self.open("four_bar")
        runs, before = page.until(RUNS), page.value("document.getElementById('text').value")
        page.value("document.querySelector('[data-parameter=crank]').focus()")
        page.key("ArrowRight", "ArrowRight")
        page.until(f"{RUNS} > {runs}")
        self.assertNotIn("{crank: 0.3,", page.value("document.getElementById('text').value"))
        self.assertEqual(page.value("document.getElementById('text').value").count("\n"), before.count("\n"))
        page.value("document.getElementById('reset').click()")
        page.until(f"{RUNS} > {runs + 1}")
        self.assertEqual(page.value("document.getElementById('text').value"), before)

    def test_error_stands_at_its_line(self):
        page = self.open("four_bar")
        page.until(RUNS)
        wrong = page.value("document.getElementById('text').value").split("\n")
        line = next(k for k, words in enumerate(wrong, 1) if "mass: crank_mass" in words)
        page.type("mass: crank_mass", "mass: crank_mas")
        page.until(f"{STATE} === 'wrong'")
        self.assertEqual(page.value("document.querySelector('#lines .wrong').textContent"), str(line))
        sentence = page.value("document.querySelector('#marks .words').textContent")
        self.assertIn("unknown parameter 'crank_mas'; did you mean 'crank_mass'?", sentence)
        self.assertIn(f"line {line}: {sentence}", page.value(LINE))
        page.type("mass: crank_mas", "mass: crank_mass")
        page.until(f"{STATE}.startsWith('complete')")
        self.assertIsNone(page.value("document.querySelector('#marks .words')"))

    def test_an_untrusted_result_says_so(self):
        page = self.open("four_bar")
        runs = page.until(RUNS)
        page.type("t_end: 5, rtol: 1e-10, output_step: 10 ms", "t_end: 50, rtol: 1e-2, output_step: 0.1")
        page.until(f"{RUNS} > {runs}")
        page.until(f"{STATE} === 'not trustworthy'")
        self.assertIn("not trustworthy", page.value(LINE))
        self.assertTrue(page.value("document.getElementById('more').textContent"))

    def test_hostile_text_stays_text(self):
        page = self.open("four_bar")
        runs = page.until(RUNS)
        page.type("name: four-bar", f"name: '{HOSTILE}'")
        page.until(f"{RUNS} > {runs} && {LINE}.includes('<img')")
        page.type("mass: crank_mass", f"'{HOSTILE}': 1\n    mass: crank_mass")
        page.until(f"{STATE} === 'wrong'")
        self.assertIn("<img", page.value("document.querySelector('#marks .words').textContent"))
        page.type(f"'{HOSTILE}': 1\n    ", "")
        page.type("joint: {name: crank,", f"joint: {{name: '<b>c</b>',")
        page.until(f"{STATE} === 'wrong' || {RUNS} > {runs + 1}")
        self.assertEqual(page.value("document.querySelectorAll('main b, main script, main img:not(#still), main iframe').length"), 0)

    def test_keyboard_and_touch(self):
        page = self.open("four_bar", browser.Screen(390, 844, plays=True))
        runs = page.until(RUNS)
        page.value("document.getElementById('view').focus()")
        page.key(" ", "Space", text=" ")
        self.assertEqual(page.value("document.getElementById('play').textContent"), "Play")
        now = page.value("document.getElementById('clock').textContent")
        page.value("document.getElementById('time').focus()")
        page.key("ArrowRight", "ArrowRight")
        self.assertNotEqual(page.value("document.getElementById('clock').textContent"), now)
        x, y = page.value("(() => { const input = document.querySelector('[data-parameter=rocker]'); input.scrollIntoView({ block: 'center' }); "
                          "const box = input.getBoundingClientRect(); return [box.left + 0.7 * box.width, box.top + box.height / 2]; })()")
        page.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        page.until(f"{RUNS} > {runs}")
        self.assertNotIn("rocker: 0.7,", page.value("document.getElementById('text').value"))
        runs = page.value(RUNS)
        page.value("document.getElementById('text').focus()")
        page.key("Enter", "Enter", modifiers=2)
        page.until(f"{RUNS} > {runs}")
        page.value(browser.WIDTHS)
        self.assertEqual(page.value("document.documentElement.dataset.wide + document.documentElement.dataset.scrolls"), "false")

    def test_the_run_as_given_is_shown_without_the_module(self):
        """Without kempe_page.js the mechanism moves, the answer stands, and nothing can be changed; without a run either, the picture stays."""
        apart = self.pages / "apart"
        live_examples.write(MODULE, apart, names=["four_bar"])
        (apart / "kempe_page.js").unlink()
        self.page = page = LivePage(apart / "four_bar.html")
        page.until("document.getElementById('took').textContent.includes('cannot be computed here')")
        self.assertEqual(page.value(STATE), "complete")
        before = page.value("document.getElementById('clock').textContent")
        page.until(f"document.getElementById('clock').textContent !== {json.dumps(before)}")
        self.assertTrue(page.value("[...document.querySelectorAll('#sliders input')].every((input) => input.disabled) && document.getElementById('text').readOnly"))
        self.assertEqual(page.missing_files(), ["kempe_page.js"])
        text = (apart / "four_bar.html").read_text()
        (apart / "still.html").write_text(re.sub(r'(id="first-run">).*?(?=</script>)', r"\1null", text, flags=re.S))
        self.page = page = LivePage(apart / "still.html")
        page.until(f"{LINE}.includes('cannot move here')")
        self.assertTrue(page.until("document.getElementById('still').complete && document.getElementById('still').naturalWidth > 0"))
        self.assertEqual(page.missing_files(), ["kempe_page.js"])

    def test_the_run_as_given_is_that_of_the_page(self):
        """The page computes the poses, forces and answer that it has shown at once."""
        poses = """(() => { const { t_start: from, t_end: to } = shownPicture.picture.frames;
            return [0, 0.3, 0.77, 1].map((part) => [shownPicture.motion(from + part * (to - from)), forces.rows.map((row) => forces.at(Math.round(part * (forces.x.length - 1)), row))]); })()"""
        for name in ("four_bar", "stewart"):  # with all frames at once
            with self.subTest(name):
                page = self.open(name)
                self.assertEqual(page.value(RUNS), 0)
                given, line = page.value(poses), page.value(LINE)
                page.until(RUNS, 60)
                self.assertEqual(page.value(poses), given)
                self.assertEqual(page.value(LINE), line)

    def test_forces_are_arrows(self):
        """Each arrow of the four-bar has the length of its force, by the scale in the corner."""
        page = self.open("four_bar", browser.Screen())
        told = page.value("""[...document.querySelectorAll(".gauge path.force")].map((path) => { const [x, y, X, Y] = path.getAttribute("d").match(/-?[0-9.e-]+/g).map(Number); return [path.dataset.joint, Math.hypot(X - x, Y - y)]; })""")
        words, long = page.value("""(() => { const path = document.querySelector(".gauge .force-scale"), [x, y, X, Y] = path.getAttribute("d").match(/-?[0-9.e-]+/g).map(Number); return [path.dataset.words, X - x]; })()""")
        forces = page.value("Object.fromEntries(forces.rows.map((row) => [row.name, norm(forces.at(0, row))]))")
        value, unit = words.split()
        self.assertGreaterEqual({joint for joint, _ in told}, {"crank", "coupler", "rocker"})
        for joint, length in told:
            self.assertAlmostEqual(length / long * float(value) * {"N": 1, "kN": 1000}[unit], forces[joint], delta=0.01 * forces[joint] + 0.01)
        page.value("document.getElementById('by-force').click()")
        self.assertEqual(page.value("document.querySelectorAll('.gauge path.force').length"), 0)
        page.until(RUNS)
        self.assertEqual(page.value("document.querySelectorAll('.gauge path.force').length"), 0)  # as the reader has set it

    def test_models_of_several_files(self):
        page = self.open("tutorial_driven")
        page.until(RUNS)
        self.assertEqual(page.value("document.getElementById('file').options.length"), 2)
        page.value("document.getElementById('file').value = 'four_bar.yaml'; document.getElementById('file').dispatchEvent(new Event('change'))")
        page.type("rho*crank\n", "rho*krank\n")
        page.until(f"{STATE} === 'wrong'")
        self.assertIn("four_bar.yaml, line", page.value(LINE))
        self.assertTrue(page.value("document.querySelector('#marks .words').textContent.includes('krank')"))


class Sources(unittest.TestCase):
    def test_every_example_is_live(self):
        self.assertLessEqual({*live_examples.SHORTER}, set(live_examples.examples()))
        without = [name for name in live_examples.examples() if live_examples.reason_for_none(name)]
        self.assertEqual(without, [] if live_examples.command() else ["robot_leg"])

    def test_sliders_are_numbers_of_the_text(self):
        made = {s["name"]: s for s in live_examples.sliders("parameters: {a: 300 mm, b: 2*a, c: -4, d: 0 deg, e: 2 kg/m}  # f: 3\nbodies: {g: 1}\n")}
        self.assertEqual({name: (s["unit"], s["from"], s["to"]) for name, s in made.items()},
                         {"a": ("mm", 150, 450), "c": ("", -6, -2), "d": ("deg", -180, 180), "e": ("kg/m", 1, 3)})


# Steps of a page: the mark of its user timing, and a sentence.
STEPS = (("live page: drawn", "the mechanism moves, with plots and sliders"), ("kempe: start", "kempe_page.js is read"), ("kempe: parts", "its base64 is decoded"),
         ("kempe: compiled", "it is decompressed and compiled"), ("kempe: ready", "a change would be computed now"), ("live page: repeated", "the page has repeated the run itself"))
VISITS = 9


def processor_times():
    """Of each process of the browser, s."""
    return {process["id"]: process["cpuTime"] for process in LivePage.chromium.call("SystemInfo.getProcessInfo")["processInfo"]}


def visit(path, until):
    """The marks of a visit, ms from the beginning of its navigation on, and the processor time of the whole browser up to an expression."""
    before = processor_times() if LivePage.chromium else {}
    page = LivePage(path)
    page.until(until)
    spent = sum(seconds - before.get(number, 0) for number, seconds in processor_times().items()) if before else None
    return page, spent


def show_times(pages):
    """Medians of several visits: each step, and processor times with the module and without it; sizes of what a page loads."""
    alone = pages / "alone"  # without the module
    live_examples.write(MODULE, alone, names=SHOWN)
    (alone / "kempe_page.js").unlink()
    print(f"medians of {VISITS} visits (least, most) from the beginning of the page on, ms; load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for name in SHOWN:
        visit(alone / f"{name}.html", "true")  # the browser begins
        drawn = statistics.median(visit(alone / f"{name}.html", "document.documentElement.dataset.ready")[1] for _ in range(VISITS))
        visits = [visit(pages / f"{name}.html", "document.documentElement.dataset.module") for _ in range(VISITS)]
        ready, marks = statistics.median(spent for _, spent in visits), []
        for _ in range(VISITS):
            page, _ = visit(pages / f"{name}.html", "performance.getEntriesByName('live page: repeated').length")
            marks.append(dict(page.value("performance.getEntriesByType('mark').map(({ name, startTime }) => [name, startTime])")))
        print(f"{name}: processor time of all processes of the browser {1000 * drawn:.0f} ms until the mechanism moves, {1000 * ready:.0f} ms until the module is ready")
        for mark, what in STEPS:
            values = sorted(visit[mark] for visit in marks)
            print(f"    {what:46}{statistics.median(values):7.0f}  ({values[0]:.0f}, {values[-1]:.0f})", flush=True)
    shared = ["kempe_page.js", "live_scene.js", "live_page.js", "live_page.css"]
    sizes = {part: len(gzip.compress((pages / part).read_bytes(), 9)) for part in shared}
    own = {name: len(gzip.compress((pages / f"{name}.html").read_bytes(), 9)) for name in live_examples.live_examples() if (pages / f"{name}.html").exists()}
    largest = max(own, key=own.get)
    print(f"bytes by gzip -9: {', '.join(f'{part} {size}' for part, size in sizes.items())}, pages {min(own.values())} to {own[largest]} ({largest}), "
          f"together at most {sum(sizes.values()) + own[largest]}")


def show_all(pages, names):
    moving = 0
    for name in names:
        try:
            page = LivePage(pages / f"{name}.html", browser.Screen())
            page.until(f"{RUNS} || {STATE} === 'wrong'")
            moved = page.value(RUNS) > 0
            moving += moved
            print(f"{name:24} {'moves' if moved else 'fails'}  {page.value('document.getElementById(`took`).textContent')}  {page.value(LINE)[:140]}", *page.complaints())
        except (TimeoutError, RuntimeError) as error:
            print(f"{name:24} fails  {str(error)[:200]}")
    print(f"{moving} of {len(names)} pages move")


def screen_of(pages, name, screen):
    """A page at a good moment; the platform with a mistake in its text."""
    page = LivePage(pages / f"{name}.html", screen)
    page.until(RUNS, 60)
    if name == "stewart":
        page.type("mass: 10\n", "mass: 10 kgg\n")
        page.until(f"{STATE} === 'wrong'")
        page.value("document.querySelector('#text').scrollTop = 400; document.querySelector('#text').scrollLeft = 0")
    else:
        page.until(f"{STATE} === 'complete'")
    page.value("document.getElementById('play').textContent === 'Pause' && document.getElementById('play').click()")
    page.value("(() => { const input = document.getElementById('time'); input.value = 372; input.dispatchEvent(new Event('input')); })()")
    page.value("new Promise((done) => setTimeout(done, 300))")
    return page


def take_pictures(pages, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name in SHOWN:
        for screen in SCREENS:
            page = screen_of(pages, name, screen)
            page.value(browser.WIDTHS)
            print(name, screen, "wider than the page:", page.value("document.documentElement.dataset.wide") or "nothing")
            (folder / f"{name}_{screen.width}_{'dark' if screen.dark else 'light'}.png").write_bytes(page.screen())


# Of the composed picture: page, screen, height that is shown of it, and scale.
COMPOSED = (("jansen_walker", browser.Screen(1024, 768, plays=True), 1040, 0.55), ("stewart", browser.Screen(1024, 768, dark=True, plays=True), 1040, 0.55),
            ("four_bar", browser.Screen(390, 844, plays=True), 1040, 0.55))


def compose_picture(pages, file):
    parts = []
    for name, screen, height, scale in COMPOSED:
        image = base64.b64encode(screen_of(pages, name, screen).screen()).decode()
        parts.append(f'<div style="width:{scale * screen.width:.0f}px;height:{scale * height:.0f}px"><img style="width:100%" src="data:image/png;base64,{image}"></div>')
    sheet = pages / "sheet.html"
    sheet.write_text("<!doctype html><meta charset='utf-8'><title>Live pages</title><style>body { margin: 0; padding: 14px; display: flex; gap: 14px; background: #d5dadd; width: max-content; } "
                     f"div {{ overflow: hidden; border-radius: 8px; }}</style><script>onload = () => (document.documentElement.dataset.ready = 'yes')</script>{''.join(parts)}")
    width = sum(round(scale * screen.width) for _, screen, _, scale in COMPOSED) + 14 * (len(COMPOSED) + 1)
    page = LivePage(sheet, browser.Screen(width, round(COMPOSED[0][2] * COMPOSED[0][3]) + 28))
    file.write_bytes(page.screen())
    if shutil.which("zopflipng"):
        subprocess.run(["zopflipng", "-y", file, file], check=True, stdout=subprocess.DEVNULL)
    print(f"{file}: {file.stat().st_size} bytes")


def main(arguments):
    global MODULE
    if not arguments:
        print(__doc__)
        return 2
    MODULE = pathlib.Path(arguments.pop(0))
    if not browser.CHROMIUM or not (MODULE / "kempe_page.js").exists():
        print("skipped: Chromium or", MODULE / "kempe_page.js", "is not there")
        return 77
    if arguments and arguments[0] in ("--times", "--all", "--pictures", "--picture"):
        with tempfile.TemporaryDirectory() as folder:
            pages = pathlib.Path(folder)
            names = live_examples.write(MODULE, pages, names=SHOWN if arguments[0].startswith("--picture") else None)
            if arguments[0] == "--times":
                show_times(pages)
            elif arguments[0] == "--all":
                show_all(pages, arguments[1:] or names)
            elif arguments[0] == "--picture":
                compose_picture(pages, pathlib.Path(arguments[1]))
            else:
                take_pictures(pages, pathlib.Path(arguments[1]))
        return 0
    unittest.main(argv=[sys.argv[0], *arguments])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
