#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The page of `kempe workbench` in a browser: what one draws becomes the text that a person would write, loops stay closed while bodies
are dragged, errors stand at their lines, studies tell their answer, files are right, and text of a model is never code of the page.

    python3 tests/workbench_page.py build/dev/kempe [unittest arguments]

A sample of its tests runs without arguments, all of them with KEMPE_FULL=1.
Ends with 77 (skipped) where Chromium, or the library that serves the page, is not installed.
"""
import base64
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import time
import unittest

from workbench_tab import DRAWN, Bench, reason_to_skip

ROOT = pathlib.Path(__file__).resolve().parent.parent
KEMPE = pathlib.Path(sys.argv.pop(1)).resolve() if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else ROOT / "build/dev/kempe"
SKIPPED = 77

# Beyond the workbench's own text: comments and keys that it does not know stay as they are.
PENDULUM = """# A lamp, drawn by hand.
kempe: 1
name: lamp   # of the hall
gravity: [0, -9.81, 0]
parameters: {length: 0.4, bulb: 0.5}

bodies:
  lamp:
    joint: {name: A, revolute: z, at: ground}
    mass: bulb
    com: [0, -length, 0]     # the bulb
    inertia: {zz: bulb*length^2/10}
    points: {end: [0, -length, 0]}

start: {q: {A: 30 deg}}
run: {t_end: 1}
"""

EVIL = "<img src=x onerror=window.hurt=1><script>window.hurt=1</script>"


whole = unittest.skipUnless("KEMPE_FULL" in os.environ or len(sys.argv) > 1, "one of those that KEMPE_FULL=1 runs")


def place_of(text, at, more):
    """The place of the editor, as JavaScript, some letters behind an index of a text."""
    return json.dumps({"line": text[:at].count("\n"), "ch": at - text.rfind("\n", 0, at) - 1 + more})


class Workbench(Bench):
    KEMPE = KEMPE

    # -- drawing ------------------------------------------------------------------------------------------------

    def draw_four_bar(self, page):
        page.press("[data-tool=bar]")
        for start, end in (([0, 0, 0], [0, 0.3, 0]), ([0, 0.3, 0], [0.7, 0.7, 0]), ([0.7, 0.7, 0], [0.9, 0, 0])):
            page.checked(lambda start=start, end=end: (page.click(page.place(start)), page.click(page.place(end))))
        page.press("[data-tool=pin]")
        page.checked(lambda: page.click(page.place([0.9, 0, 0])))
        page.press("[data-tool=motor]")
        page.checked(lambda: page.click(page.place([0, 0, 0])))

    def test_four_bar_by_mouse_from_an_empty_page(self):
        page, begun = self.start(""), time.monotonic()
        self.draw_four_bar(page)
        page.run("pins")
        self.assertLess(time.monotonic() - begun, 120)
        self.assertEqual(page.model(), DRAWN)
        self.assertEqual(page.text("#messages"), "")
        told = re.fullmatch(r"✓ Largest pin force: (.*) N in (\w+) at t = (.*) s", page.text("#verdict"))
        self.assertIsNotNone(told, page.text("#verdict"))
        path = self.folder / "drawn.yaml"
        path.write_text(DRAWN)
        command = subprocess.run([KEMPE, "simulate", path, "--t-end", "2", "-q", "--json", "-"], capture_output=True, text=True, check=True)
        worst = max(json.loads(command.stdout)["reactions"], key=lambda row: row["force"]["peak"] if row["force"] else 0)
        self.assertEqual(told[2], worst["joint"])
        self.assertAlmostEqual(float(told[1]), worst["force"]["peak"], delta=2e-3 * worst["force"]["peak"])
        page.press("#save")
        page.until("byId('saved').textContent === 'saved'")
        self.assertEqual(self.file.read_text(), DRAWN)

    @whole
    def test_each_change_by_the_mouse_is_one_step_of_undo(self):
        page = self.start("")
        self.draw_four_bar(page)
        self.assertEqual(page.model(), DRAWN)
        for _ in range(5):
            page.press("#undo")
        self.assertEqual(page.model(), "")
        for _ in range(5):
            page.press("#redo")
        self.assertEqual(page.model(), DRAWN)

    @whole
    def test_parts_in_a_text_of_a_person(self):
        page = self.start(PENDULUM)
        page.press("[data-tool=spring]")
        page.checked(lambda: (page.click(page.place([0.3, 0, 0])), page.click(page.place([0.4 * math.sin(math.radians(30)), -0.4 * math.cos(math.radians(30)), 0]))))
        text = page.model()
        self.assertEqual(text.replace("ground:\n  points: {B: [0.3, 0, 0]}\n\n", "").replace(text[text.index("forces:"):text.index("start:")], ""), PENDULUM)
        self.assertRegex(text, r"\nforces:\n  spring1: \{spring: \[ground\.B, lamp\.end\], stiffness: 1 kN/m, damping: 10, free_length: 0\.\d+\}\n\nstart:")
        page.press("[data-tool=slider]")
        end = page.place(page.value("modelPlaces(bench.model).find(({body, point}) => body === 'lamp' && point === 'end').world"))
        page.checked(lambda: (page.pull(end, [end[0] + 90, end[1] + 3]), page.mouse("mouseReleased", [end[0] + 90, end[1] + 3])))
        self.assertIn("slider1_guide: {prismatic: [ground.end, slider1.end], axis: x}", page.model())
        self.assertIn("end: {revolute: [lamp.end, slider1.end]}", page.model())
        self.assertEqual(page.text("#messages"), "")
        for line in PENDULUM.splitlines():
            self.assertIn(line, page.model())

    def test_keyboard_draws_a_bar(self):
        page = self.start("")
        page.value("byId('view').focus()")
        page.type_key("b", 66, text="b")
        page.type_key("ArrowRight", 39)
        page.type_key("Enter", 13)
        for _ in range(6):
            page.type_key("ArrowUp", 38)
        page.checked(lambda: page.type_key("Enter", 13))
        self.assertIn("bar1:", page.model())
        self.assertEqual(page.text("#messages"), "")
        page.type_key("Escape", 27)
        page.type_key("j", 74, text="j")
        self.assertIn("A: ground, bar1", page.text("#picked"))
        page.checked(lambda: page.type_key("z", 90, modifiers=2))
        self.assertEqual(page.model(), "")

    @whole
    def test_a_finger_draws_a_bar(self):
        page = self.start("", 390, 844)
        page.tap(page.middle("[data-tool=bar]"))
        page.checked(lambda: (page.tap(page.place([0.2, 0.2, 0])), page.tap(page.place([0.6, 0.4, 0]))))
        self.assertIn("bar1:", page.model())
        page.tap(page.middle("nav [data-panel=text]"))
        self.assertTrue(page.value("byId('editor').clientHeight > 100 && byId('mechanism-panel').clientHeight === 0"))

    # -- dragging -----------------------------------------------------------------------------------------------

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
        page.checked(lambda: page.press("#keep-start"))
        self.assertRegex(page.model(), r"\nstart: \{q: \{A: -?[\d.]+ deg, B: -?[\d.]+ deg, D: -?[\d.]+ deg\}\}\n")
        self.assertEqual(page.text("#messages"), "")

    @whole
    def test_a_pin_of_the_ground_and_a_coupler_point(self):
        page = self.start(DRAWN)
        page.checked(lambda: (page.pull(page.place([0.9, 0, 0]), page.place([0.8, 0, 0])), page.mouse("mouseReleased", page.place([0.8, 0, 0]))))
        self.assertEqual(page.model(), DRAWN.replace("D: [0.9, 0, 0]", "D: [0.8, 0, 0]"))
        page.press("#undo")
        self.assertEqual(page.model(), DRAWN)
        page.until("modelPlaces(bench.model).some(({ world }) => Math.hypot(world[0] - 0.9, world[1]) < 1e-9)")
        page.press("[data-tool=point]")
        page.checked(lambda: (page.click(page.place([0.35, 0.5, 0])), page.click(page.place([0.3, 0.8, 0]))))
        self.assertEqual(page.model(), DRAWN.replace("C: [0.7, 0.4, 0]", "C: [0.7, 0.4, 0], E: [0.3, 0.5, 0]"))
        page.run("curves")
        self.assertRegex(page.text("#verdict"), r"✓ bar2\.E moves within ")

    @whole
    def test_a_joint_tells_its_values(self):
        page = self.start(DRAWN)
        page.run("motion")
        page.click(page.place([0, 0, 0]))
        self.assertIn("largest force", page.text("#picked"))
        page.value("showTime(1)")
        told = dict(page.value("[...document.querySelectorAll('#picked tr')].map((row) => [row.cells[0].textContent, Number(row.cells[1].textContent)])"))
        self.assertAlmostEqual(told["position"], 2 * math.pi, delta=1e-3)
        self.assertAlmostEqual(told["velocity"], 2 * math.pi, delta=1e-3)

    # -- the text -----------------------------------------------------------------------------------------------

    def test_errors_stand_at_their_lines(self):
        page = self.start(DRAWN.replace("mass: 0.81", "mas: 0.81"))
        line = 1 + DRAWN[:DRAWN.index("mass: 0.81")].count("\n")
        self.assertRegex(page.text("#messages"), rf"^line {line}:\d+: .*mas")
        self.assertEqual(page.value("document.querySelectorAll('.CodeMirror-lint-marker-error').length"), 1)
        page.press("#messages button")
        self.assertEqual(page.value("modelEditor.getCursor().line"), line - 1)
        page.checked(lambda: page.value(f"modelEditor.setValue({json.dumps(DRAWN)})"))
        self.assertEqual(page.text("#messages"), "")
        self.assertEqual(page.value("document.querySelectorAll('.CodeMirror-lint-marker-error').length"), 0)

    @whole
    def test_completion_and_explanations(self):
        page = self.start(DRAWN)
        at = DRAWN.index("    shape: {line: [A, B]")
        offered = page.value(f"completionsAt({json.dumps(DRAWN[:at] + '    ' + DRAWN[at:])}, {place_of(DRAWN, at, 4)}).then((found) => found.list.map((one) => one.text.trim()))")
        self.assertIn("mass:", offered)
        self.assertNotIn("points:", offered)
        at = DRAWN.index("ground.A, bar1.A")
        named = "({ from, list }) => list.map((one) => one.text)"
        self.assertEqual(page.value(f"completionsAt({json.dumps(DRAWN[:at] + 'b' + DRAWN[at:])}, {place_of(DRAWN, at, 1)}).then({named})"), ["bar1", "bar2", "bar3"])
        self.assertEqual(page.value(f"completionsAt({json.dumps(DRAWN[:at] + 'bar2.' + DRAWN[at:])}, {place_of(DRAWN, at, 5)}).then({named})"), ["B", "C"])  # behind the dot
        self.assertIn("gravity", page.value(f"explanationAt({json.dumps(DRAWN)}, {place_of(DRAWN, DRAWN.index('gravity'), 2)})").lower())
        self.assertIn("bar1.B", page.value(f"explanationAt({json.dumps(DRAWN)}, {place_of(DRAWN, DRAWN.index('bar1.B'), 5)})"))
        page.value("modelEditor.focus(), modelEditor.setCursor(modelEditor.lineCount(), 0)")
        page.write("sta")
        page.until("document.querySelector('.CodeMirror-hints')")
        self.assertIn("start:", page.text(".CodeMirror-hints"))

    @whole
    def test_another_name_for_a_body(self):
        page = self.start(DRAWN)
        line, column = DRAWN[:DRAWN.index("bar2:")].count("\n"), 3
        page.value(f"modelEditor.focus(), modelEditor.setCursor({{ line: {line}, ch: {column} }})")
        page.type_key("F2", 113)
        page.until("document.querySelector('.CodeMirror-dialog input')?.value === 'bar2'")
        page.write("coupler")
        page.checked(lambda: page.type_key("Enter", 13, text="\r"))
        self.assertEqual(page.model(), DRAWN.replace("bar2", "coupler"))
        page.checked(lambda: page.press("#undo"))  # one step
        self.assertEqual(page.model(), DRAWN)

    def test_changes_on_disk(self):
        page = self.start(DRAWN)
        self.file.write_text(DRAWN.replace("0.81", "0.9"))
        page.until("modelEditor.getValue().includes('mass: 0.9}')")
        page.value("changeText(bench.text + '# mine\\n')")
        self.file.write_text(DRAWN.replace("0.81", "0.7"))
        page.until("!byId('notice').hidden")
        self.assertIn("changed by another program", page.text("#notice"))
        self.assertIn("# mine", page.model())
        page.press("#notice button")
        page.press("#save")
        page.until("byId('saved').textContent === 'saved'")
        self.assertIn("# mine", self.file.read_text())

    def test_text_of_a_model_is_no_code(self):
        hostile = DRAWN.replace("name: mechanism", f"name: '{EVIL}'").replace("mass: 0.3}", f"mass: 0.3}} # {EVIL}")
        page = self.start(hostile)
        for tab in ("motion", "pins", "curves", "dead", "equilibrium", "modes"):
            page.run(tab)
        page.checked(lambda: page.value(f"modelEditor.setValue({json.dumps(DRAWN + EVIL + ': 1' + chr(10))})"))
        self.assertIn("img", page.text("#messages"))
        page.run("motion")
        page.checked(lambda: page.value("modelEditor.setValue(" + json.dumps(DRAWN.replace("bar2.C", f"'bar2.{EVIL}'")) + ")"))
        self.assertIn("img", page.text("#messages"))
        page.value("document.querySelectorAll('.CodeMirror-lint-marker').forEach((mark) => mark.dispatchEvent(new MouseEvent('mouseover', { bubbles: true })))")
        self.assertIsNone(page.value("window.hurt ?? null"))
        self.assertEqual(page.value("document.querySelectorAll('img, [onerror]').length"), 0)

    # -- studies ------------------------------------------------------------------------------------------------

    @whole
    def test_studies_tell_their_answer_first(self):
        page = self.start(PENDULUM)
        wanted = {"motion": r"✓ Complete: 0 to 1 s", "pins": r"✓ Largest pin force: [\d.]+ N in A", "curves": r"✓ lamp\.end moves within .* by ", "dead": "✓ No dead centre: A goes",
                  "equilibrium": "✓ One equilibrium, stable", "modes": "✓ 1 mode, undamped"}
        for tab, words in wanted.items():
            page.run(tab)
            self.assertRegex(page.text("#verdict"), words)
        frequency = math.sqrt(9.81 * 0.4 / (0.4**2 + 0.4**2 / 10)) / (2 * math.pi)
        self.assertAlmostEqual(float(page.value("byId('table').rows[1].cells[1].textContent")), frequency, delta=1e-4 * frequency)
        self.assertTrue(page.value("shownScene.playing"))
        page.press("#tab-equilibrium")
        page.value("byId('range-of').value = 'length'; byId('range-of').dispatchEvent(new Event('change'))")
        page.run()
        self.assertRegex(page.text("#verdict"), "✓ Equilibrium at 11 of 11 values of length, all stable")
        self.assertEqual(page.value("byId('table').rows.length"), 12)

    @whole
    def test_dead_centre_of_the_rocker(self):
        page = self.start(DRAWN)
        page.press("#tab-dead")
        page.value("byId('sweep').value = 'D'; byId('sweep').dispatchEvent(new Event('change'))")
        page.run()
        self.assertRegex(page.text("#verdict"), r"✓ Dead centre: D = 39\.84\d deg is its greatest value")
        crank, coupler, base = 0.3, math.hypot(0.7, 0.4), 0.9
        rocker, reach = math.hypot(0.2, 0.7), crank + coupler
        inner = math.acos((rocker**2 + base**2 - reach**2) / (2 * rocker * base))
        least = math.acos((rocker**2 + base**2 - (coupler - crank)**2) / (2 * rocker * base))
        drawn = math.atan2(0.7, 0.2)  # of the rocker from the base, as drawn
        value = float(re.search(r"D = ([\d.]+) deg", page.text("#verdict"))[1])
        self.assertTrue(any(abs(value - abs(math.degrees(drawn - angle))) < 0.01 for angle in (inner, least)), (value, inner, least, drawn))

    @whole
    def test_sliders_and_a_kept_run(self):
        page = self.start(PENDULUM)
        page.run("motion")
        page.press("#keep-run")
        page.value("byId('parameters').open = true")
        page.value("(() => { const box = document.querySelector('[data-parameter=length] input'); box.value = 0.6; box.dispatchEvent(new Event('input')); })()")
        page.until("bench.values.length === 0.6 && !bench.running && (byId('plot').dataset.curves || '').includes('kept run')")
        self.assertEqual(page.model(), PENDULUM)
        page.checked(lambda: page.press("[data-parameter=length] button"))
        self.assertEqual(page.model(), PENDULUM.replace("length: 0.4", "length: 0.6"))

    # -- files --------------------------------------------------------------------------------------------------

    @whole
    def test_files_to_take_away(self):
        page = self.start(DRAWN + "\nrun: {t_end: 1}\n")
        page.run("motion")
        begins = {"csv": b"t,q.A", "svg": b"<svg", "png": b"\x89PNG", "curves-png": b"\x89PNG", "glb": b"glTF", "html": b"<!DOCTYPE html>", "yaml": b"kempe: 1", "video": b"\x1aE\xdf\xa3"}
        endings = {"csv": ".csv", "svg": ".svg", "png": "machine.png", "curves-png": "_curves.png", "glb": ".glb", "html": ".html", "yaml": ".yaml", "video": ".webm"}
        for kind, begin in begins.items():
            page.value("byId('more').open = true")
            page.until(f"!document.querySelector('[data-download={kind}]').disabled")
            page.press(f"[data-download={kind}]")
            self.assertEqual(page.downloaded(endings[kind])[:len(begin)], begin, kind)
        rows = (page.downloads / "machine.csv").read_text().splitlines()
        self.assertEqual(float(rows[-1].split(",")[0]), 1)

    @whole
    def test_a_link_contains_the_model(self):
        page = self.start(DRAWN)
        link = page.value("linkOfModel()")
        self.assertRegex(link, r"^#model=[\w-]+$")
        page.value("shareModel().then(() => 1)")
        self.assertEqual(page.value("document.documentElement.dataset.shared"), link)  # without the token of the address
        page = self.start("", link=link)
        page.until("modelEditor.getValue() !== ''")
        self.assertEqual(page.model(), DRAWN)
        self.assertEqual(self.file.read_text(), "")
        page.press("#undo")
        self.assertEqual(page.model(), "")

    # -- screens ------------------------------------------------------------------------------------------------

    @whole
    def test_screens(self):
        for width, height in ((1440, 900), (1024, 768), (390, 844)):
            for dark in (False, True):
                page = self.start(DRAWN, width, height, dark)
                page.value("runStudy().then(() => 1)")
                for panel in ("text", "results", "mechanism"):
                    page.value(f"showPanel('{panel}')")
                    self.assertFalse(page.value("document.documentElement.scrollWidth > document.documentElement.clientWidth"), (width, panel))
                drawn = page.value("ink(byId('view'))")
                self.assertGreater(drawn, 100)
                if len(sys.argv) > 1 and sys.argv[1] == "--pictures":
                    shot = page.call("Page.captureScreenshot", format="png")["data"]
                    pathlib.Path(f"workbench_{width}_{'dark' if dark else 'light'}.png").write_bytes(base64.b64decode(shot))


if __name__ == "__main__":
    reason = reason_to_skip(KEMPE)
    if reason:
        print(f"skipped: {reason}")
        sys.exit(SKIPPED)
    unittest.main()
