# SPDX-License-Identifier: BSD-3-Clause
"""Generated simulators of models, compiled without optimisation: the table of a motion."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from generate.quick_cc import quick_compiler  # noqa: E402

OBJECTS = tempfile.TemporaryDirectory()


def table_of(kempe, path, folder, end, tolerance, steps, run):
    """The table of a model's simulator in `steps` equal parts of a motion, the reason if it stopped, its events. `run` starts
    the program, with bounds of its own."""
    sources = folder / f"{path.stem}_c"
    made = subprocess.run([kempe, "generate", str(path), "--lang", "c", "--simulator", "-o", str(sources)], capture_output=True, text=True)
    if made.returncode:
        return "", made.stderr.strip(), 0
    name = next(file.name.removesuffix("_simulator.h") for file in sources.glob("*_simulator.h") if file.name != "kempe_simulator.h")
    made = subprocess.run([quick_compiler(OBJECTS.name), "-std=c99", "-ffp-contract=off", f"-I{sources}", f"-DMODEL={name}", f'-DMODEL_HEADER="{name}_simulator.h"',
                           "-o", str(sources / "run"), str(ROOT / "tests/generate/simulated_run.c"), *map(str, sources.glob("*.c")), "-lm"],
                          capture_output=True, text=True)
    if made.returncode:
        return "", made.stderr.strip(), 0
    done = run([str(sources / "run"), str(end), str(tolerance), str(steps), "table"])
    shutil.rmtree(sources)
    said = done.stderr.splitlines()
    if done.returncode or len(said) < 2:
        return "", said[-1] if said else f"no end within its bounds, exit status {done.returncode}", 0
    return done.stdout, "", int(re.search(r"([0-9]+) events", said[1]).group(1))
