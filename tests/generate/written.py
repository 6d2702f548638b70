# SPDX-License-Identifier: BSD-3-Clause
"""Models written in Python and for packages that differentiate, for the tests of these languages."""

import importlib.util
import inspect
import json
import pathlib
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
KEMPE = sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/dev/kempe"

# Every function of the language of expressions, both kinds of tables, and an input.
FUNCTIONS = """kempe: 1
name: all functions
gravity: [0, -9.81, 0]
parameters: {T: 1 N*m, s: 1 s}
inputs: {w: {unit: N*m}}
tables:
  lin: {x: [-1, 0, 0.5], y: [2, 1, 3], method: linear}
  cub: {x: [-1, -0.5, 0, 0.5, 1, 1.4, 2], y: [2, 1, 3, 1, 0, 2, 1]}
bodies:
  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.1}, points: {P: [1, 0, 0]}}
  b: {joint: {revolute: z, at: a.P}, mass: 2, com: [0.2, 0.1, 0], inertia: {zz: 0.1}}
forces:
  e0: {joint: a, torque: "T*(sin(q(a))*cos(q(b)) + tan(q(a)) + sinh(q(a)) - cosh(q(b))*tanh(qd(a)*s)) + w*q(b)"}
  e1: {joint: a, torque: "T*(asin(q(a)/4) + acos(q(b)/4) + atan(qd(a)*s) + atan2(qd(a)*s, q(b)) + exp(q(a)/3))"}
  e2: {joint: b, torque: "T*(sqrt(q(a) + 3) + log(q(b) + 3))"}
  e3: {joint: b, torque: "T*(lin(q(a)) + cub(q(b)) + cub(qd(b)*s) + abs(q(a))*sign(qd(b)*s))"}
  e4: {joint: a, torque: "T*(min(q(a), q(b)) + max(qd(a)*s, t/s) + pow(q(a)^2 + 1, q(b)) + (q(b)^2 + 1)^0.3)"}
  e5: {joint: a, torque: "T*if(q(a) < q(b), log(abs(q(a)) + 1), sqrt(q(b) + 9))"}
"""


def command(code, *words):
    done = subprocess.run([KEMPE, *map(str, words)], capture_output=True, text=True, timeout=300)
    assert done.returncode == code, (words, done.stdout, done.stderr)
    return done


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def listed(x):
    return x if isinstance(x, (tuple, list)) else (x,)


class Written:
    """A model in Python and in other languages, which are attributes."""

    def __init__(self, folder, path, languages, *options):
        self.path, self.kept = path, "--keep-parameters" in options
        self.modules = []
        for language in ("python", *languages):
            said = json.loads(command(0, "generate", path, "--lang", language, "-o", folder, "--json", "-", *options).stdout)
            assert len(said["files"]) == 1
            self.modules.append(load(pathlib.Path(folder) / said["files"][0]))
        self.routines = [name.replace("+", "_") for name in said["routines"]]
        for language, module in zip(("python", *languages), self.modules, strict=True):
            setattr(self, language, module)
        self.n, self.m = len(self.python.coordinate_names), len(self.python.row_names)

    def arguments(self, function, rng, **given):
        """Numbers for all arguments of a function but p."""
        python = self.python
        sizes = {"q": self.n, "qd": self.n, "qdd": self.n, "lambda_": self.m, "u": 3*len(getattr(python, "input_names", ()))}
        return [given[name] if name in given else 0.3 if name == "t" else rng.uniform(-1, 1, sizes[name])
                for name in inspect.signature(function).parameters if name not in ("p", "steps")]

    def reference(self, routine, arguments):
        prepared = [getattr(self.python, routine + "_prepare")()] if self.kept else []
        return listed(getattr(self.python, routine)(*prepared, *arguments))

    def parts(self, arguments):
        """M, C, J and jdqd of t, q, qd and further arguments, by name."""
        found, names = {}, ("t", "q", "qd", "modes", "u")
        given = dict(zip([name for name in inspect.signature(self.modules[1].forward).parameters if name in names], arguments, strict=True))
        for routine in self.routines:
            wanted = [name for name in inspect.signature(getattr(self.modules[1], routine)).parameters if name != "p"]
            if set(wanted) <= set(given):
                shown = self.reference(routine, [given[name] for name in wanted])
                found.update(zip({"M_C": ("M", "C"), "h_J": ("h", "J"), "jdqd": ("jdqd",)}.get(routine, ()), shown))
        return found["M"], found["C"], found["J"], found["jdqd"]


def start_of(written, *options):
    """q, qd, qdd and the multipliers at the end of a short run by the library, with its time."""
    run = json.loads(command(0, "simulate", written.path, "--t-end", "0.02", "--json", "-", *options).stdout)
    rows = {f"{name}.{k + 1}": x for name, values in run["lambda"].items() for k, x in enumerate(values)}
    order = written.python.coordinate_names
    q, qd, qdd = (np.array([run[what][name] for name in order], float) for what in ("q", "qd", "qdd"))
    return q, qd, qdd, np.array([rows[name] for name in written.python.row_names]), run["t"]
