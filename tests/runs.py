# SPDX-License-Identifier: BSD-3-Clause
"""Running the command for tests of models, and reading what it says and writes. `main` takes the command from the arguments."""
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
command = None
FULL = "KEMPE_FULL" in os.environ  # ./check full: every case of what ./check samples


def rows(path):
    """Numbers of a table; lines that begin with # are no part of it."""
    with open(path, newline="") as file:
        return [{key: float(x) for key, x in row.items()} for row in csv.DictReader(line for line in file if line[0] != "#")]


def settings(**values):
    return [word for name, value in values.items() for word in ("--set", f"{name}={value}")]


CODES = {"complete": 0, "complete, not checked": 0, "not trustworthy": 5, "stopped": 1, "failed": 1}


def kempe(*words, status=0):
    """Its result in JSON; `status` None: whatever it is, with the exit code that belongs to it."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "out.json"
        done = subprocess.run([command, *map(str, words), "--json", str(path)], capture_output=True, text=True, timeout=250,
                              env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
        found = json.loads(path.read_text()) if path.exists() else {"status": "failed"}
        if done.returncode != (CODES[found["status"]] if status is None else status):
            raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
        return found


def simulated(model, *words, status=0, **values):
    """The result of a run, and its rows."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "run.csv"
        said = kempe("simulate", model, "--no-convergence-check", *words, *settings(**values), "-o", path, status=status)
        return said, rows(path)


def main():
    global command
    command = os.path.abspath(sys.argv.pop(1))
    with tempfile.TemporaryDirectory() as folder:
        os.environ["KEMPE_CACHE"] = folder  # cases with the same equations derive them once
        unittest.main()
