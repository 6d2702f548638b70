#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Applies docs/extending.md: a copy of the sources gets exactly the files and rows that the page shows, is built, and
runs the page's model with the new kinds of joint and closure, the new function and the new back end; its equations
are written in the new language. The build is that of tests/packaging/consume.sh shared, which is tested by it, of the core and
the wing that has the languages.

    CC=cc BUILD=build/dev python3 tests/extending.py
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
WINGS = "-DKEMPE_ANALYSES=OFF -DKEMPE_RAIL=OFF -DKEMPE_ROAD=OFF -DKEMPE_ENSEMBLE=OFF -DKEMPE_PICTURE=OFF -DKEMPE_REPORT=OFF -DKEMPE_LANGUAGE_SERVER=OFF -DKEMPE_WORKBENCH=OFF"
STEP = re.compile(r"^`([^`]+)`, (a new file|one row more):\n\n((?:    .*\n|\n)+)", re.MULTILINE)
PARTS = "CMakeLists.txt LICENSE README.md packaging schema include src constraints integrators third_party docs bench examples tests/packaging".split()


def steps():
    """(path, whether it is new, text) in the order of the page."""
    page = (ROOT / "docs/extending.md").read_text()
    for path, what, block in STEP.findall(page):
        lines = [line[4:] for line in block.rstrip("\n").split("\n")]
        yield path, what == "a new file", "\n".join(lines) + "\n"


def copy(to):
    for name in PARTS:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, to / name)
        else:
            shutil.copy(source, to / name)


def apply(root):
    count = 0
    for path, new, text in steps():
        target = root / path
        assert target.exists() != new, f"{path}: {'stands already' if new else 'is not there'}"
        with target.open("w" if new else "a") as file:
            file.write(text)
        count += 1
    assert count >= 8, f"{count} steps are found on the page"
    return count


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=500)
    assert done.returncode == 0, f"{' '.join(map(str, words))}:\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done.stdout


def build(root):
    """The command, installed beside a shared library."""
    work = root / "work"
    work.mkdir()
    cached = {"CCACHE_BASEDIR": str(root), "CCACHE_NOHASHDIR": "1"}  # a launcher that keeps objects finds those of another copy
    done = subprocess.run([root / "tests/packaging/consume.sh", "shared"], capture_output=True, text=True, timeout=500,
                          env={**os.environ, **cached, "SOURCE": str(root), "WORK": str(work), "OPTIONS": WINGS, "BUILD": os.path.abspath(os.environ["BUILD"])})
    print(done.stdout[-3000:], done.stderr[-3000:], sep="")
    if done.returncode:
        sys.exit(done.returncode)
    return work / "prefix/bin/kempe"


def simulate(kempe, model, *words):
    return json.loads(run(kempe, "simulate", model, "--json", "-", *words))


def judge(kempe, model):
    check = json.loads(run(kempe, "check", model, "--json", "-"))
    assert (check["nq"], check["nh"], check["dof"]) == (3, 1, 2), check
    plain, tape = (simulate(kempe, model, "--backend", name) for name in ("plain", "tape"))
    dae = simulate(kempe, model, "--formulation", "dae", "--integrator", "ida")
    assert plain["status"] == tape["status"] == dae["status"] == "complete"
    assert set(plain["q"]) == {"post.1", "post.2", "arm"}, plain["q"]
    for name in plain["q"]:
        for values in ("q", "qd", "qdd"):
            assert plain[values][name] == tape[values][name], f"{values} {name}: the back ends differ"
        assert abs(dae["q"][name] - tape["q"][name]) < 1e-6, f"{name}: the formulations differ"
    # the extended model has a function that Julia was not told of
    run(kempe, "generate", ROOT / "examples/four_bar/four_bar.yaml", "--lang", "julia", "--sets", "M_C+h_J", "--keep-parameters", "-o", model.parent)
    written = (model.parent / "four_bar.jl").read_text()
    assert "function M_C_h_J(k, t, q, qd)\n    M = zeros(3, 3)\n" in written and "    return M, C, h, J\nend" in written
    assert plain["residual"]["h_max"] < 1e-12
    assert plain["energy"]["drift_rel"] < 1e-7


def main():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        copy(root)
        count = apply(root)
        judge(build(root), root / "extended.yaml")
    print(f"{count} steps of docs/extending.md applied, built and run")
    return 0


if __name__ == "__main__":
    sys.exit(main())
