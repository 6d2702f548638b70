#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/workbench_screens.png: the workbench and two report pages on screens of 1440, 1024 and 390 pixels, light and dark.

    python3 docs/workbench_screens.py build/dev/kempe [FOLDER]     FOLDER: each screen as a separate file, too

Chromium draws the screens and the sheet of all of them.
"""
import base64
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path.append(str(ROOT / "tests"))
from workbench_tab import Page  # noqa: E402

SCREENS = ((1440, 900), (1024, 768), (390, 844))
SHEET, HEIGHT, GAP = 755, 210, 10  # pixels: its width, the height of a row, the space between screens
FOUR_BAR = ROOT / "examples/four_bar/four_bar.yaml"

# The states of the page, as JavaScript after its model was run.
STATES = {
    "a joint with its forces": "showTime(0.7), pick('crank'), showPanel('mechanism')",
    "curves of a study": "pick(null), chooseStudy('motion'), studies.group = 'qd|rad/s', showStudy(), showPanel('results')",
    "an error at its line": "modelEditor.setValue(bench.saved.replace('mass: crank_mass', 'mas: crank_mass')), showPanel('text')",
}

# A picture with 16 levels of each colour, whose file is half as large.
FEW_COLOURS = """(async () => {
    const image = new Image(), canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    image.src = "data:image/png;base64,%s";
    await image.decode();
    Object.assign(canvas, { width: image.width, height: image.height });
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height);
    pixels.data.forEach((x, k) => (pixels.data[k] = 17 * Math.round(x / 17)));
    context.putImageData(pixels, 0, 0);
    return canvas.toDataURL("image/png").split(",")[1];
})()"""


def shot(page):
    time.sleep(0.8)
    return page.call("Page.captureScreenshot", format="png")["data"]


def workbench_screens(page, kempe, folder, dark_first):
    """One row of screens for each state, alternately light and dark."""
    model = folder / "four_bar.yaml"
    model.write_text(FOUR_BAR.read_text())
    with subprocess.Popen([kempe, "workbench", model, "--no-browser"], stdout=subprocess.PIPE, text=True) as server:
        address = server.stdout.readline().strip()
        for k, (name, script) in enumerate(STATES.items()):
            row = []
            for n, (width, height) in enumerate(SCREENS):
                page.screen(width, height, (k + n + dark_first) % 2 == 1)
                page.open(address)
                page.value("runStudy().then(() => 1)")
                before = page.checks()
                page.value(f"{script}, 1")
                if "setValue" in script:
                    page.until(f"Number(document.documentElement.dataset.checked) > {before}")
                row.append(shot(page))
                page.value("bench.saved = bench.text")
            yield f"workbench, {name}", row
        server.terminate()


def report_screens(page, kempe, folder, dark_first):
    car = ROOT / "examples/quarter_car/quarter_car.yaml"
    for k, (command, model, name) in enumerate((("simulate", FOUR_BAR, "report of a run"), ("modes", car, "report of modes"))):
        path = folder / f"{command}.html"
        subprocess.run([kempe, command, model, "--report", path], check=True, stdout=subprocess.DEVNULL)
        row = []
        for n, (width, height) in enumerate(SCREENS):
            page.screen(width, height, (k + n + dark_first + 1) % 2 == 1)
            page.open(path.as_uri())
            row.append(shot(page))
        yield name, row


def sheet_of(rows):
    """All rows on one page, each screen to the same scale within its row."""
    pictures = "".join(f'<h1>{name}</h1><p>{"".join(f"<img src=data:image/png;base64,{data}>" for data in row)}</p>' for name, row in rows)
    return (f"<!DOCTYPE html><html data-ready=yes><style>body{{margin:{GAP}px;width:{SHEET - 2 * GAP}px;background:#8a9299;font:13px sans-serif}}"
            f"h1{{font-size:13px;margin:6px 0 3px;color:#fff}}p{{display:flex;gap:{GAP}px;margin:0}}img{{height:{HEIGHT}px}}</style>{pictures}")


def main(arguments):
    if len(arguments) not in (1, 2):
        print(__doc__)
        return 2
    kempe, page = pathlib.Path(arguments[0]).resolve(), Page()
    with tempfile.TemporaryDirectory() as place:
        folder, rows = pathlib.Path(place), []
        for dark_first in (0, 1) if len(arguments) == 2 else (0,):
            taken = [*workbench_screens(page, kempe, folder, dark_first), *report_screens(page, kempe, folder, dark_first)]
            rows = rows or taken
            for name, row in taken if len(arguments) == 2 else ():
                for (width, _), data in zip(SCREENS, row):
                    path = pathlib.Path(arguments[1]) / f"{name.replace(' ', '_').replace(',', '')}_{width}_{dark_first}.png"
                    path.write_bytes(base64.b64decode(data))
        sheet = folder / "sheet.html"
        sheet.write_text(sheet_of(rows))
        page.screen(SHEET, len(rows) * (HEIGHT + 32) + 2 * GAP)
        page.open(sheet.as_uri())
        few = page.value(FEW_COLOURS % shot(page))
        (ROOT / "docs/workbench_screens.png").write_bytes(base64.b64decode(few))
    page.end()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
