#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Units with binaries for Linux and Windows: a small importer, compiled for both, simulates each by both binaries; all variables agree
within 1e-9 of the largest value of each. The binaries for Windows run under Wine.

    python3 tests/windows_units.py build/dev/kempe            every unit
    python3 tests/windows_units.py build/dev/kempe --some     the sample that the test runs

The exit code is 77, which skips a test, where Wine or mingw-w64 is missing. Units on the library need kempe_unit-x86_64-windows.dll beside
the command, which packaging/build_windows makes.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile

from generate.quick_cc import quick_path
from windows_commands import session, wine_of

ROOT = pathlib.Path(__file__).resolve().parent.parent
WITHIN = 1e-9  # of the largest value of a variable: msvcrt and glibc differ in the last digits of functions
COMPILERS = {"linux": "cc", "windows": "x86_64-w64-mingw32-gcc"}
# Model, version, kind, end (s), steps: exchanges of states, events, spatial loops, impacts, friction that sticks; last on the library.
SOME = [("four_bar", 3, "cs", 1, 20), ("four_bar", 2, "cs", 1, 20)]
MORE = [("four_bar", 3, "me", 1, 1000), ("delta_robot", 3, "cs", 0.5, 20), ("loose_slider", 3, "cs", 0.003, 20), ("stick_slip", 3, "cs", 1, 20),
        ("bowling_ball", 2, "cs", 1, 20), ("driven_slider_crank", 3, "me", 0.5, 500)]
ON_LIBRARY = [("stick_slip", 3, "library", 1, 20), ("toggle_press", 2, "library", 0.4, 20)]


def importer(folder, system):
    """The importer, compiled for Linux or Windows."""
    out = folder / f"importer_{system}.exe"
    side = "windows" if system == "windows" else "posix"
    options = ["-static", "-D__USE_MINGW_ANSI_STDIO=1", "-lshell32"] if system == "windows" else ["-D_GNU_SOURCE", "-ldl", "-lpthread"]
    subprocess.run([COMPILERS[system], "-O1", f"-I{ROOT}/third_party/fmi", f"-I{ROOT}/src", "-o", out, ROOT / "tests/windows_unit.c",
                    ROOT / f"src/platform/platform_{side}.c", *options], check=True)
    return out


def export(kempe, folder, model, fmi, kind):
    """The folder of an unpacked unit for both platforms."""
    unit = folder / f"{model}{fmi}{kind}"
    options = ["--binary"] if kind == "library" else ["--kind", "me,cs"]
    done = subprocess.run([kempe, "fmu", ROOT / f"examples/{model}/{model}.yaml", "-o", f"{unit}.fmu", "--fmi", str(fmi), "--quiet",
                           "--platforms", "x86_64-linux,x86_64-windows", *options], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    with zipfile.ZipFile(f"{unit}.fmu") as archive:
        archive.extractall(unit)
    return unit


def rows(start, unit, system, fmi, kind, end, steps):
    """The table that the importer prints: all continuous variables behind each step."""
    about = ElementTree.parse(unit / "modelDescription.xml").getroot()
    kinds = [about.find(name) for name in ("ModelExchange", "CoSimulation")]
    name = next(kind.get("modelIdentifier") for kind in kinds if kind is not None)
    variables = about.iter("Float64") if fmi == 3 else (v for v in about.iter("ScalarVariable") if v.find("Real") is not None)
    references = [v.get("valueReference") for v in variables
                  if v.get("causality") in ("local", "output", None) and not v.get("name").startswith("solver.")]
    platform = {("linux", 2): "linux64", ("linux", 3): "x86_64-linux", ("windows", 2): "win64", ("windows", 3): "x86_64-windows"}[system, fmi]
    whole = f"Z:{unit}" if system == "windows" else str(unit)
    resources = f"file:///{whole.lstrip('/')}/resources" if fmi == 2 else f"{whole}/resources/"
    if system == "windows" and fmi == 3:
        resources = resources.replace("/", "\\")
    token = about.get("guid") if fmi == 2 else about.get("instantiationToken")
    library = f"{whole}/binaries/{platform}/{name}{'.dll' if system == 'windows' else '.so'}"
    done = subprocess.run([*start, library, str(fmi), "me" if kind == "me" else "cs", token, resources, str(end), str(steps),
                           *references[:250]], capture_output=True, text=True, check=False, env={**os.environ, "WINEDEBUG": "-all"})
    if done.returncode != 0:
        raise RuntimeError(f"{system}: {done.stdout[-300:]}{done.stderr[-300:]}")
    return [[float(word) for word in line.split()] for line in done.stdout.splitlines()]


def compare(one, other):
    """(numbers, the largest difference relative to the largest value of each variable)."""
    if len(one) != len(other) or len(one[0]) != len(other[0]):
        return 0, 1.0
    worst = 0.0
    for column, beside in zip(zip(*one), zip(*other)):
        scale = max(map(abs, column)) or 1.0
        worst = max([worst, *(abs(a - b) / scale if a == a or b == b else 0.0 for a, b in zip(column, beside))])
    return len(one) * len(one[0]), worst


def main(words):
    kempe = os.path.abspath(words[0])
    wine = wine_of()
    if not wine or not shutil.which(COMPILERS["windows"]):
        print(f"skipped: {'mingw-w64' if wine else 'Wine'} is missing")
        return 77
    units = SOME + ([] if "--some" in words else MORE)
    if "--some" not in words and (pathlib.Path(kempe).parent / "kempe_unit-x86_64-windows.dll").exists():
        units += ON_LIBRARY
    wrong = 0
    with session(wine), tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top)
        if "--some" in words and "KEMPE_FULL" not in os.environ:  # the compilers of the units, which took most of the time
            os.environ["PATH"] = quick_path(folder)
        starts = {"linux": [importer(folder, "linux")], "windows": [wine, importer(folder, "windows")]}
        for model, fmi, kind, end, steps in units:
            unit = export(kempe, folder, model, fmi, kind)
            try:
                count, worst = compare(*(rows(starts[system], unit, system, fmi, kind, end, steps) for system in starts))
                row = f"{count} numbers, largest difference {worst:.1e}"
            except RuntimeError as error:
                worst, row = 1.0, str(error)
            wrong += not worst <= WITHIN
            print(f"{'agrees' if worst <= WITHIN else 'DIFFERS':8}FMI {fmi}.0 {kind:8} {model:22} {row}", flush=True)
    print(f"{len(units) - wrong} of {len(units)} units agree")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
