# SPDX-License-Identifier: BSD-3-Clause
"""Pages in Chromium: one tab draws all pages of a test one after another, on the screens that it asks for; a tab of its own would
cost each page a process. It is spoken to over the pipes of its debugging protocol
(https://chromedevtools.github.io/devtools-protocol/): a JSON object and a zero byte each way."""
import atexit
import dataclasses
import functools
import json
import os
import re
import select
import shutil
import subprocess
import tempfile
import time

# The first one has no windows, which saves a fifth of the time.
CHROMIUM = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"))), None)
HARMLESS = re.compile("software WebGL|GPU stall|GL Driver Message")  # of a machine without a graphics card
SECONDS = 120  # for one page
# Scripts are not optimised, and their memory is tidied by the thread that runs them: an eighth of a page's time.
SOONER = ["--js-flags=--no-opt,--single-threaded", "--num-raster-threads=1"]
SETTLED = 100  # virtual milliseconds after the page was loaded, for what it draws by and by

# Elements that are wider than the page, unless they scroll by themselves, and whether the page scrolls sideways.
WIDTHS = """(() => {
    const root = document.documentElement;
    const scrolls = (e) => e && e !== root && (/auto|scroll|hidden/.test(getComputedStyle(e).overflowX) || scrolls(e.parentElement));
    const wide = [...document.body.querySelectorAll("*")].filter((e) => e.getBoundingClientRect().right > root.clientWidth + 0.5 && !scrolls(e.parentElement));
    root.dataset.width = root.clientWidth;
    root.dataset.wide = wide.map((e) => e.tagName + "#" + e.id + "." + e.className).join(" ");
    root.dataset.scrolls = root.scrollWidth > root.clientWidth;
})()"""
# The document without the texts of its programs and its data, which are most of a page.
DOCUMENT = """(() => {
    for (const script of document.scripts) script.textContent = "";
    return document.documentElement.outerHTML;
})()"""
FLAT = """{
    const context = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
        return /webgl/.test(kind) ? null : context.call(this, kind, ...rest);
    };
}"""


@dataclasses.dataclass(frozen=True)
class Screen:
    width: int = 1280
    height: int = 800
    dark: bool = False
    flat: bool = False  # canvases without WebGL
    plays: bool = False  # otherwise the animation waits, as for readers who ask for less motion; its pictures are most of a page's time


class Chromium:
    def __init__(self):
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_read, self.to = os.pipe()
        self.back, to_write = os.pipe()

        def pipes():  # the protocol's file descriptors are 3 and 4
            kept = os.dup(to_read), os.dup(to_write)
            os.dup2(kept[0], 3)
            os.dup2(kept[1], 4)
        self.process = subprocess.Popen(
            [CHROMIUM, "--headless", "--no-sandbox", f"--user-data-dir={self.folder.name}", "--disable-dev-shm-usage",
             "--no-startup-window", "--remote-debugging-pipe", *SOONER], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=pipes, pass_fds=(3, 4))
        os.close(to_read)
        os.close(to_write)
        self.number, self.bytes, self.events = 0, b"", []
        atexit.register(self.end)

    def end(self):
        self.process.terminate()
        self.process.wait()
        self.folder.cleanup()

    def message(self, deadline):
        while b"\0" not in self.bytes:
            if not select.select([self.back], [], [], max(0, deadline - time.monotonic()))[0]:
                raise TimeoutError(f"no word from Chromium within {SECONDS} s")
            received = os.read(self.back, 1 << 20)
            if not received:
                raise EOFError("Chromium ended")
            self.bytes += received
        text, self.bytes = self.bytes.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, session=None, **parameters):
        self.number += 1
        words = {"id": self.number, "method": method, "params": parameters, **({"sessionId": session} if session else {})}
        os.write(self.to, json.dumps(words).encode() + b"\0")
        deadline = time.monotonic() + SECONDS
        while (said := self.message(deadline)).get("id") != self.number:
            self.events.append(said)
        if "error" in said:
            raise RuntimeError(f"{method}: {said['error']}")
        return said["result"]

    def wait(self, method):
        deadline = time.monotonic() + SECONDS
        while not any(event.get("method") == method for event in self.events):
            self.events.append(self.message(deadline))

    @functools.cached_property
    def tab(self):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable", session)
        return session

    def draw(self, page, screen):
        """The document of a page once it is drawn, and what it complained of. The page stays open until the next one."""
        if screen.plays:
            self.__dict__.pop("tab", None)  # whose time was stopped, which an animation would see
        self.call("Emulation.setDeviceMetricsOverride", self.tab, width=screen.width, height=screen.height, deviceScaleFactor=1,
                  mobile=screen.width < 500)
        self.call("Emulation.setEmulatedMedia", self.tab,
                  features=[{"name": "prefers-color-scheme", "value": "dark" if screen.dark else "light"},
                            {"name": "prefers-reduced-motion", "value": "no-preference" if screen.plays else "reduce"}])
        flat = self.call("Page.addScriptToEvaluateOnNewDocument", self.tab, source=FLAT if screen.flat else "")["identifier"]
        if not screen.plays:
            self.call("Emulation.setVirtualTimePolicy", self.tab, policy="advance")
        self.events = []
        self.call("Page.navigate", self.tab, url=page.as_uri())
        self.wait("Page.loadEventFired")
        self.call("Emulation.setVirtualTimePolicy", self.tab, policy="pauseIfNetworkFetchesPending", budget=SETTLED)
        self.wait("Emulation.virtualTimeBudgetExpired")
        self.call("Page.removeScriptToEvaluateOnNewDocument", self.tab, identifier=flat)
        self.value(WIDTHS)
        return self.document(), self.complaints()

    def value(self, expression):
        """Of an expression in the page that was drawn last."""
        told = self.call("Runtime.evaluate", self.tab, expression=expression, returnByValue=True)
        if "exceptionDetails" in told:
            raise RuntimeError(told["exceptionDetails"]["exception"].get("description"))
        return told["result"].get("value")

    def document(self):
        return self.value(DOCUMENT)

    def complaints(self):
        return [line for line in map(complaint, self.events) if line and not HARMLESS.search(line)]


def complaint(event):
    """The words of an event of the console; None for all other events."""
    parameters = event.get("params", {})
    if event.get("method") == "Runtime.exceptionThrown":
        details = parameters["exceptionDetails"]
        return f"{details['text']} {details.get('exception', {}).get('description', '')}"
    if event.get("method") == "Runtime.consoleAPICalled":
        return " ".join(str(argument.get("value", argument.get("description"))) for argument in parameters["args"])
    if event.get("method") == "Log.entryAdded":
        return parameters["entry"]["text"]
    return None


running = None


def draw(page, screen=Screen()):
    global running
    running = running or Chromium()
    return running.draw(page, screen)


def run(script):
    """In the page that was drawn last: the value that a script returns, and all complaints."""
    return running.value(f"(() => {{ {script} }})()"), running.complaints()


def document():
    """The document of the page that was drawn last, as it is now."""
    return running.document()
