#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Commands by processors without AVX, or without fused operations, beside the same commands by this one. QEMU has such processors: an
instruction that they lack would end the command.

    python3 tests/old_processors.py build/dev/kempe           every command, by both processors
    python3 tests/old_processors.py build/dev/kempe --some    the sample that the test runs

Exit codes, texts and files are equal, to the last bit of each number, where an integrator is named; times are not compared. Functions of
the C library, as exp and pow, have other last digits on processors without fused operations: the reference also runs without these.
Counted time, which is more without machine code, chooses an integrator that is not named, and the iteration of `radau`: there tables
agree within 1e-6 of the largest number of a column.
The exit code is 77, which skips a test, where QEMU's user mode is missing or this processor is not of x86-64.
"""
import concurrent.futures
import json
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile

from windows_commands import FOUR, MORE, ROOT, SOME, compare, run

PROCESSORS = {  # as QEMU names them, without what it cannot do
    "Nehalem": "no AVX",
    "SandyBridge,-x2apic,-tsc-deadline": "AVX, no fused operations"}
WITHOUT = ["env", "GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2"]  # the C library as on the old processor
WITHIN = 1e-6
EQUAL = """simulate examples/andrews/andrews.yaml --t-end 0.02 --integrator dop853 --no-convergence-check -o OUT/run.csv
simulate examples/stewart/stewart.yaml --t-end 0.1 --formulation dae --integrator ida --no-convergence-check -o OUT/run.csv
ensemble examples/four_bar/four_bar.yaml --sample crank=0.28:0.32 --instances 24 --t-end 0.2 -o OUT/ends.csv
ensemble examples/slider_crank/slider_crank.yaml --sample l=0.45:0.55 --instances 24 --lanes 8 --t-end 0.2 -o OUT/ends.csv"""
CLOSE = """simulate examples/four_bar/four_bar.yaml --t-end 0.5 --no-convergence-check -o OUT/run.csv
simulate examples/andrews/andrews.yaml --t-end 0.02 --integrator radau --no-convergence-check -o OUT/run.csv
simulate examples/slider_crank/slider_crank.yaml --t-end 0.5 --formulation dae --no-convergence-check -o OUT/run.csv"""
CHOSEN = {"compare", "cycles"}  # their subject is the choice, or an estimated error


def named(line):
    """The line with an integrator where it has none; "": it leaves the choice to Kempe."""
    command = line.partition(" ")[0]
    if command in CHOSEN or "--integrator radau" in line or ("--formulation dae" in line and "--integrator" not in line):
        return ""
    plain = command not in {"simulate", "sensitivity", "optimize"} or "--integrator" in line or "no-such" in line
    return line if plain else line.replace("--t-end", "--integrator dop853 --t-end")


def equal(line, here, start):
    """(True, a row) of a line whose texts and files must be equal."""
    agrees, row = compare(line, [*WITHOUT, here], start)
    same = row.endswith(("equal", "largest difference 0.0e+00"))  # the second: times in a file differ
    return agrees and same and ("exit code" not in row or line not in EQUAL), row


def close(line, here, start):
    """(True, a row) of a line whose table must be near."""
    with tempfile.TemporaryDirectory() as top:
        tables = []
        for name, words in (("here", [here]), ("there", start)):
            folder = pathlib.Path(top) / name
            folder.mkdir()
            codes, said = run(words, line, folder)
            if codes != [0]:
                return False, f"exit codes {codes}: {said[-200:]!r}"
            rows = [line.split(",") for line in (folder / "run.csv").read_text().splitlines() if line[0] in "-.0123456789"]
            tables.append([list(map(float, column)) for column in zip(*rows)])
        if [len(column) for column in tables[0]] != [len(column) for column in tables[1]] or len(tables[0]) < 2:
            return False, "the tables have other rows or columns"
        apart = max(max(abs(a - b) for a, b in zip(one, other)) / (max(map(abs, one)) or 1) for one, other in zip(*tables))
        return apart <= WITHIN, f"largest difference {apart:.1e}"


TOLD = f"""simulate {FOUR} --t-end 0.05 --integrator dop853
kinematics {FOUR} --sweep crank=0:0.2:3
sensitivity {FOUR} --parameters crank --t-end 0.05 --integrator dop853
contact examples/conicity/conicity.yaml --sweep shift=0:0.001:2"""


def told(words, ran):
    """A line of commands whose text, JSON and warnings do not say that this back end has run; "" without one."""
    for line in TOLD.splitlines():
        for asked in ((), ("--backend", "native")):
            with tempfile.TemporaryDirectory() as top:
                done = subprocess.run([*words, *line.split(), *asked, "--json", f"{top}/run.json"], capture_output=True, text=True, cwd=ROOT)
                result = json.loads(pathlib.Path(f"{top}/run.json").read_text())
            said = result.get("backend") or result["work"]["backend"]
            warns = ran == "tape" and bool(asked)
            warned = [any("back end 'native': this processor has no machine code" in text for text in texts) for texts in ([done.stderr], result["warnings"])]
            if said != ran or warned != [warns, warns] or ("back end tape" in " ".join(done.stdout.split())) != (ran == "tape"):
                return f"{line} {' '.join(asked)}: {said}, {ran} has run: {done.stdout[-200:]}{done.stderr}"
    return ""


def main(words):
    here = os.path.abspath(words[0])
    emulator = shutil.which("qemu-x86_64-static") or shutil.which("qemu-x86_64")
    if not emulator or platform.machine() != "x86_64":
        print("skipped: qemu-x86_64 is missing (Debian package qemu-user)" if not emulator else "skipped: this is no processor of x86-64")
        return 77
    others = [] if "--some" in words else [line for line in map(named, (SOME + "\n" + MORE).splitlines()) if line]
    checks = [(equal, line) for line in EQUAL.splitlines() + others] + [(close, line) for line in CLOSE.splitlines()]
    wrong = 0
    for name, lacks in PROCESSORS.items():
        print(f"{name.partition(',')[0]}: {lacks}", flush=True)
        start = [emulator, "-cpu", name, here]
        with concurrent.futures.ThreadPoolExecutor(int(os.environ.get("PARALLEL", "1"))) as pool:
            done = pool.map(lambda check, start=start: check[0](check[1], here, start), checks)
            bad = 0
            for (_, line), (agrees, row) in zip(checks, done):
                bad += not agrees
                print(f"{'agrees' if agrees else 'DIFFERS':8}{line.replace('OUT/', ''):110.110}  {row}".rstrip(), flush=True)
        untold = told([here], "native") or told(start, "tape")
        bad += bool(untold)
        print(untold or "texts and JSON say which back end has run", flush=True)
        wrong += bad
        print(f"{len(checks) - bad + bool(untold)} of {len(checks)} lines of commands agree", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
