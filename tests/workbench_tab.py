# SPDX-License-Identifier: BSD-3-Clause
"""A tab of Chromium with the page of the workbench, a mouse, a finger and a keyboard; a workbench that it opens; and the four-bar that its
tests draw."""
import json
import pathlib
import shutil
import subprocess
import tempfile
import time
import unittest

import browser

SECONDS = 20  # for what a page does after a press
browser.SECONDS = 30

DRAWN = """kempe: 1
name: mechanism
gravity: [0, -9.81, 0]

ground:
  points: {A: [0, 0, 0], D: [0.9, 0, 0]}

bodies:
  bar1:
    points: {A: [0, 0, 0], B: [0, 0.3, 0]}
    shape: {line: [A, B], mass: 0.3}
  bar2:
    points: {B: [0, 0, 0], C: [0.7, 0.4, 0]}
    shape: {line: [B, C], mass: 0.81}
  bar3:
    points: {C: [0, 0, 0], D: [0.2, -0.7, 0]}
    shape: {line: [C, D], mass: 0.73}

joints:
  A: {revolute: [ground.A, bar1.A]}
  B: {revolute: [bar1.B, bar2.B]}
  C: {revolute: [bar2.C, bar3.C]}
  D: {revolute: [ground.D, bar3.D]}

drives:
  motor: {joint: A, angle: 60 rpm*t}
"""


class Page:
    """A tab with a mouse, a finger and a keyboard."""

    def __init__(self):
        self.chromium = browser.Chromium()
        self.session = self.chromium.tab
        self.downloads = pathlib.Path(tempfile.mkdtemp())
        self.call("Page.bringToFront")
        self.chromium.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.downloads))

    def end(self):
        shutil.rmtree(self.downloads)
        self.chromium.end()

    def call(self, method, **parameters):
        return self.chromium.call(method, self.session, **parameters)

    def screen(self, width=1440, height=900, dark=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500)
        self.call("Emulation.setTouchEmulationEnabled", enabled=width < 500)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
                                                          {"name": "prefers-reduced-motion", "value": "reduce"}])

    def open(self, address):
        self.chromium.events = []
        self.call("Page.navigate", url="about:blank")
        self.until("location.href === 'about:blank'")
        self.call("Page.navigate", url=address)
        self.until("document.documentElement.dataset.ready === 'yes'")

    def value(self, expression):
        told = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in told:
            raise RuntimeError(told["exceptionDetails"].get("exception", {}).get("description"))
        return told["result"].get("value")

    def until(self, expression):
        deadline = time.monotonic() + SECONDS
        while time.monotonic() < deadline:
            try:
                if self.value(f"Boolean({expression})"):
                    return
            except RuntimeError:
                pass  # a script of the page is not loaded yet
            time.sleep(0.03)
        raise AssertionError(f"not so within {SECONDS} s: {expression}; {self.complaints()}")

    def complaints(self):
        return [line for line in map(browser.complaint, self.chromium.events) if line and not browser.HARMLESS.search(line)]

    def text(self, selector):
        return self.value(f"document.querySelector({json.dumps(selector)}).textContent")

    def model(self):
        return self.value("modelEditor.getValue()")

    def checks(self):
        return int(self.value("Number(document.documentElement.dataset.checked || 0)"))

    def checked(self, change):
        """After a change of the text and the check that follows it."""
        before = self.checks()
        change()
        self.until(f"Number(document.documentElement.dataset.checked || 0) > {before}")

    def mouse(self, kind, place, **more):
        self.call("Input.dispatchMouseEvent", **{"type": kind, "x": place[0], "y": place[1], "button": "left", "clickCount": 1, "pointerType": "mouse", **more})

    def click(self, place):
        self.mouse("mouseMoved", place, button="none")
        self.mouse("mousePressed", place)
        self.mouse("mouseReleased", place)

    def pull(self, start, end, steps=8):
        self.mouse("mouseMoved", start, button="none")
        self.mouse("mousePressed", start)
        for k in range(1, steps + 1):
            self.mouse("mouseMoved", [a + (b - a) * k / steps for a, b in zip(start, end)], buttons=1)

    def tap(self, place):
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": place[0], "y": place[1]}])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def fingers(self, *paths, steps=6):
        """Fingers that go along lines at the same time, each from a place to another one."""
        at = lambda part: [{"x": a[0] + part * (b[0] - a[0]), "y": a[1] + part * (b[1] - a[1]), "id": k} for k, (a, b) in enumerate(paths)]
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=at(0))
        for k in range(1, steps + 1):
            self.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=at(k / steps))
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def middle(self, selector):
        return self.value(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.scrollIntoView({{block: 'nearest'}}); const b = e.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; }})()")

    def press(self, selector):
        self.click(self.middle(selector))

    def place(self, point):
        """Pixels of a point of the ground."""
        return self.value(f"(() => {{ const b = document.getElementById('view').getBoundingClientRect(), [x, y] = seeNow()({json.dumps(point)}); return [b.left + x, b.top + y]; }})()")

    def type_key(self, key, code=0, modifiers=0, text=""):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, modifiers=modifiers, **({"text": text} if text and kind == "keyDown" else {}))

    def letter(self, letter):
        self.type_key(letter, ord(letter.upper()), text=letter)

    def cross_to(self, point):
        """Moves the cross of a tool by the arrow keys to a point of the ground."""
        box = self.value("(() => { const b = byId('view').getBoundingClientRect(); return [b.left, b.top]; })()")
        target = [a - b for a, b in zip(self.place(point), box)]
        for _ in range(200):
            cross, step = self.value("[drawing.cross || [byId('view').clientWidth / 2, byId('view').clientHeight / 2], Math.max(gridStep() * frameNow().scale, 4)]")
            away = [b - a for a, b in zip(cross, target)]
            k = max((0, 1), key=lambda i: abs(away[i]))
            if abs(away[k]) <= 0.5 * step + 0.5:
                return
            self.type_key((("ArrowLeft", "ArrowRight"), ("ArrowUp", "ArrowDown"))[k][away[k] > 0], modifiers=8 if abs(away[k]) > 6 * step else 0)
        raise AssertionError(f"the cross does not come to {point}: {away}")

    def write(self, text):
        self.call("Input.insertText", text=text)

    def run(self, tab=None):
        if tab:
            self.press(f"#tab-{tab}")
        self.press("#run")
        self.until("!bench.running && resultNow()")

    def downloaded(self, ending):
        deadline = time.monotonic() + SECONDS
        while time.monotonic() < deadline:
            found = [path for path in self.downloads.iterdir() if path.name.endswith(ending)]
            if found and found[0].stat().st_size > 0:
                return found[0].read_bytes()
            time.sleep(0.05)
        raise AssertionError(f"no file *{ending}: {self.text('#hint')}")


class Bench(unittest.TestCase):
    """A workbench on a file of its own, opened in a tab."""
    KEMPE = None
    expected = ()  # complaints of the browser that belong to a test
    NAME = "machine.yaml"

    @classmethod
    def setUpClass(cls):
        cls.page = Page()
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.file = cls.folder / cls.NAME
        cls.file.write_text("")
        cls.server = subprocess.Popen([cls.KEMPE, "workbench", cls.file, "--no-browser"], stdout=subprocess.PIPE, text=True)
        cls.address = cls.server.stdout.readline().strip()

    @classmethod
    def tearDownClass(cls):
        cls.page.end()
        cls.server.terminate()
        cls.server.communicate()
        shutil.rmtree(cls.folder)

    def start(self, text, width=1440, height=900, dark=False, link=""):
        self.file.write_text(text)
        self.page.screen(width, height, dark)
        self.page.open(self.address + link)
        return self.page

    def tearDown(self):
        self.page.value("Object.assign(bench, { saved: bench.text, removed: false }), 1")  # a page with unsaved text asks before it is left
        self.assertEqual([line for line in self.page.complaints() if line not in self.expected], [])


def reason_to_skip(kempe):
    """Chromium, or the library that serves the page, is not installed; None: both are."""
    if not browser.CHROMIUM:
        return "Chromium is not installed"
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "m.yaml"
        path.write_text(DRAWN)
        with subprocess.Popen([kempe, "workbench", path, "--no-browser"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
            address = server.stdout.readline().strip()
            server.terminate()
            told = "" if address else server.stderr.read().strip()
    return told if "microhttpd" in told else None
