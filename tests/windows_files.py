#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Files that the command for Windows writes, under Wine, and that are opened here: the page of a report, a functional mock-up unit, a
checkpoint and the result folder of an ensemble. Their contents equal those of files that were written here.

    python3 tests/windows_files.py build/dev/kempe build/windows/kempe/kempe.exe

The exit code is 77, which skips a test, where Wine or the build for Windows is missing.
"""
import html
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
import zipfile

import browser
from windows_commands import differences, session, wine_of
from windows_units import importer, rows

ROOT = pathlib.Path(__file__).resolve().parent.parent
MODEL = str(ROOT / "examples/four_bar/four_bar.yaml")
SHORT = ["--t-end", "0.2", "--no-convergence-check"]
HERE, THERE = [], []


def run(start, folder, *words):
    done = subprocess.run([*start, *words], capture_output=True, cwd=folder, timeout=500, check=False,
                          env={**os.environ, "WINEDEBUG": "-all", "KEMPE_CACHE": "off", "KEMPE_JAVASCRIPT": "/usr/share/javascript"})
    assert done.returncode == 0, (done.stdout + done.stderr).decode(errors="replace")
    return done.stdout


def unit(folder):
    """The folder of a unit that was unpacked, with a binary that is compiled here from its sources."""
    with zipfile.ZipFile(folder / "unit.fmu") as archive:
        archive.extractall(folder / "unit")
    sources = folder / "unit/sources"
    about = ElementTree.parse(sources / "buildDescription.xml").getroot()
    binaries = folder / "unit/binaries/x86_64-linux"
    binaries.mkdir(parents=True)
    name = about.find("BuildConfiguration").get("modelIdentifier")
    files = [sources / file.get("name") for file in about.iter("SourceFile")]
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-ffp-contract=off", "-o", binaries / f"{name}.so", *files, "-lm"], check=True)
    return folder / "unit"


class Written(unittest.TestCase):
    def setUp(self):
        top = tempfile.TemporaryDirectory()
        self.addCleanup(top.cleanup)
        self.here, self.there = pathlib.Path(top.name) / "here", pathlib.Path(top.name) / "there"
        self.here.mkdir()
        self.there.mkdir()

    def write(self, *words):
        run(HERE, self.here, *words)
        run(THERE, self.there, *words)

    def near(self, one, other):
        count, _, why = differences(one, other, True, False)
        self.assertGreater(count, 20)
        self.assertEqual(why, "")

    def test_checkpoint(self):
        self.write("simulate", MODEL, *SHORT, "--integrator", "dop853", "--checkpoint", "half.kempe")
        for folder in (self.here, self.there):
            run(HERE, folder, "simulate", MODEL, "--t-end", "0.4", "--no-convergence-check", "--integrator", "dop853",
                "--resume", "half.kempe", "-o", "run.csv")
        self.near(*((folder / "run.csv").read_bytes() for folder in (self.here, self.there)))

    def test_result_folder(self):
        self.write("ensemble", MODEL, "--sample", "crank=0.28:0.32", "--instances", "16", "--t-end", "0.2", "--out", "bars.kempe")
        for folder in (self.here, self.there):
            run(HERE, folder, "gather", "bars.kempe", "-o", "bars.csv")
        self.near(*((folder / "bars.csv").read_bytes() for folder in (self.here, self.there)))

    def test_unit(self):
        self.write("fmu", MODEL, "-o", "unit.fmu", "--no-binary")
        start = [importer(self.here, "linux")]
        one, other = (rows(start, unit(folder), "linux", 3, "cs", 1, 20) for folder in (self.here, self.there))
        self.assertGreater(len(one), 20)
        self.assertEqual(one, other)

    @unittest.skipUnless(browser.CHROMIUM, "Chromium is missing")
    def test_page(self):
        self.write("simulate", MODEL, *SHORT, "--report", "page.html")
        texts = []
        for folder in (self.here, self.there):
            text, said = browser.draw(folder / "page.html")
            self.assertEqual(said, [])
            texts.append(re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]*>", " ", text))).encode())
        self.assertIn(b"four-bar", texts[0])
        self.near(*(re.sub(rb"[\d.]+ (?:ms|s)\b", b"TIME", text) for text in texts))


def main(words):
    wine = wine_of()
    if not wine or not os.path.exists(words[1]):
        print(f"skipped: {'Wine is missing' if not wine else words[1] + ' is missing: packaging/build_windows makes it'}")
        return 77
    HERE[:], THERE[:] = [os.path.abspath(words[0])], [wine, os.path.abspath(words[1])]
    with session(wine):
        return 0 if unittest.main(argv=[sys.argv[0], *words[2:]], exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
