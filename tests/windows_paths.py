#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Paths of Windows, under Wine: drive letters and backslashes in models, included files, output files, result folders, the cache and units;
names in UTF-8; files with lines that end with LF alone. Each command is compared with the same one with plain paths.

    python3 tests/windows_paths.py build/windows/kempe/kempe.exe

The exit code is 77, which skips a test, where Wine or the build for Windows is missing.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from windows_commands import session, wine_of

ROOT = pathlib.Path(__file__).resolve().parent.parent
MODEL = ROOT / "examples/four_bar/four_bar.yaml"
SHORT = ["--t-end", "0.1", "--no-convergence-check"]
KEMPE = []


def on_drive(path):
    """A whole path as Windows writes it: Wine has the root of this system as the drive Z."""
    return "Z:" + str(path).replace("/", "\\")


def run(folder, *words, code=0, cache="off"):
    """The text that a command prints in a folder."""
    done = subprocess.run([*KEMPE, *map(str, words)], capture_output=True, cwd=folder, timeout=300, check=False,
                          env={**os.environ, "WINEDEBUG": "-all", "KEMPE_CACHE": str(cache)})
    said = re.sub(rb"[0-9a-f]{4}:[a-z]+:[^\n]*\n", b"", done.stdout + done.stderr)
    assert done.returncode == code, said.decode(errors="replace")
    return said


class Paths(unittest.TestCase):
    def setUp(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)
        (self.folder / "parts" / "bars").mkdir(parents=True)
        (self.folder / "parts" / "bars" / "linkage.yaml").write_text(MODEL.read_text())
        run(self.folder, "simulate", MODEL, *SHORT, "-o", "plain.csv")
        self.plain = (self.folder / "plain.csv").read_bytes()

    def same(self, name):
        self.assertEqual((self.folder / name).read_bytes(), self.plain)

    def test_model_and_output_on_a_drive(self):
        run(self.folder, "simulate", on_drive(MODEL), *SHORT, "-o", on_drive(self.folder / "run.csv"))
        self.same("run.csv")
        run(self.folder, "simulate", "parts\\bars\\linkage.yaml", *SHORT, "-o", ".\\parts\\run.csv")
        self.same("parts/run.csv")
        run(self.folder, "simulate", "parts\\bars/linkage.yaml", *SHORT, "-o", "mixed.csv")
        self.same("mixed.csv")

    def test_included_files(self):
        tables = []
        for file in ("parts/bars/linkage.yaml", "parts\\bars\\linkage.yaml", on_drive(self.folder / "parts/bars/linkage.yaml"),
                     on_drive(self.folder / "parts/bars/linkage.yaml").replace("\\", "/")):
            (self.folder / "whole.yaml").write_text(f"kempe: 1\nname: whole\ngravity: [0, -9.81, 0]\ninclude:\n  - file: '{file}'\n")
            run(self.folder, "simulate", "whole.yaml", *SHORT, "-o", "whole.csv")
            rows = (self.folder / "whole.csv").read_bytes().split(b"\n", 1)[1]
            tables.append(rows)
        self.assertIn(self.plain.splitlines()[1], tables[0])  # the start
        self.assertEqual(len(set(tables)), 1)

    def test_a_missing_file_is_named_as_it_was_given(self):
        said = run(self.folder, "check", "Z:\\none\\model.yaml", code=2)
        self.assertIn(rb"Z:\none\model.yaml", said)

    def test_a_mistake_has_its_place(self):
        (self.folder / "parts" / "wrong.yaml").write_text("kempe: 1\nname: wrong\nbodys: {}\n")
        said = run(self.folder, "check", on_drive(self.folder / "parts" / "wrong.yaml"), code=2)
        self.assertIn(rb"wrong.yaml:3:1:", said)

    def test_result_folder(self):
        sampled = ["ensemble", MODEL, "--sample", "crank=0.28:0.32", "--instances", "8", "--t-end", "0.1"]
        run(self.folder, *sampled, "-o", "plain_ends.csv")
        run(self.folder, *sampled, "--out", on_drive(self.folder / "bars.kempe"))
        run(self.folder, "gather", on_drive(self.folder / "bars.kempe"), "-o", ".\\ends.csv")
        self.assertEqual((self.folder / "ends.csv").read_bytes(), (self.folder / "plain_ends.csv").read_bytes())

    def test_cache(self):
        place = self.folder / "kept results"
        for name in ("first.csv", "second.csv"):
            run(self.folder, "simulate", MODEL, *SHORT, "-o", name, cache=on_drive(place))
            self.same(name)
        self.assertTrue([path for path in place.rglob("*") if path.is_file()])

    def test_names_in_utf_8(self):
        (self.folder / "Öl–Φ.yaml").write_text(MODEL.read_text().replace("name: four-bar", "name: Gelenkviereck Ä"))
        said = run(self.folder, "simulate", "Öl–Φ.yaml", *SHORT, "-o", "Länge µ.csv")
        self.assertIn("Gelenkviereck Ä", said.decode())
        self.same("Länge µ.csv")

    def test_lines_end_with_lf(self):
        (self.folder / "crlf.yaml").write_bytes(MODEL.read_bytes().replace(b"\n", b"\r\n"))
        said = run(self.folder, "simulate", "crlf.yaml", *SHORT, "-o", "crlf.csv", "--json", "run.json", "--plot", "curves.svg", "--report", "page.html")
        self.same("crlf.csv")
        run(self.folder, "generate", MODEL, "--lang", "c", "-o", "code")
        run(self.folder, "fmu", MODEL, "-o", "unit.fmu", "--no-binary")
        self.assertNotIn(b"\r", said)
        names = [path for path in self.folder.rglob("*") if path.suffix in (".csv", ".json", ".svg", ".html", ".c", ".h")]
        self.assertGreater(len(names), 6)
        for path in names:
            self.assertNotIn(b"\r", path.read_bytes(), path.name)

    def test_a_unit_without_a_compiler(self):
        said = run(self.folder, "fmu", MODEL, "-o", "unit.fmu", code=1)
        self.assertIn(b"'gcc' for x86_64-windows does not run: install mingw-w64", said)
        self.assertFalse((self.folder / "unit.fmu").exists())


if __name__ == "__main__":
    windows, wine = os.path.abspath(sys.argv.pop(1)), wine_of()
    if not wine or not os.path.exists(windows):
        print(f"skipped: {'Wine is missing' if not wine else windows + ' is missing: packaging/build_windows makes it'}")
        sys.exit(77)
    KEMPE = [wine, windows]
    with session(wine):
        unittest.main()
