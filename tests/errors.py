#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/errors.md: its table of statuses is src/base/statuses.def, and the command prints each sentence that the page
explains: the model below, changed in one place, or called in one wrong way, for every sentence (`...` stands for
anything). Called with the path of the command:

    python3 tests/errors.py build/dev/kempe
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs/errors.md").read_text()

MODEL = """\
kempe: 1
gravity: [0, -9.81, 0]
parameters: {r: 300 mm, l: 0.8}
ground:
  points: {O: [0, 0, 0], D: [0.9, 0, 0]}
bodies:
  crank:
    joint: {name: A, revolute: z, at: ground.O}
    mass: 1
    com: [r/2, 0, 0]
    inertia: {zz: 0.0075}
    points: {B: [r, 0, 0]}
  coupler:
    joint: {name: B, revolute: z, at: crank.B}
    mass: 1
    inertia: {zz: 0.05}
    points: {C: [l, 0, 0]}
  rocker:
    joint: {name: D, revolute: z, at: ground.D}
    mass: 1
    inertia: {zz: 0.04}
    points: {C: [0.7, 0, 0]}
loops:
  C: {ball: [coupler.C, rocker.C]}
forces:
  motor: {joint: A, torque: 0.2}
start: {q: {A: 90 deg, B: -62 deg, D: 106 deg}, hold: [A]}
run: {t_end: 0.1}
"""

# A text of the model, its replacement, and the exit code of `kempe simulate model.yaml`.
CHANGES = [
    ("forces:\n", "  E: {ball: [coupler.C, rocker.C]}\nforces:\n  rub: {joint: A, torque: 0.1*lambda(C)}\n", 1),
    ("forces:\n", "drives: {m: {joint: A, angle: 90 deg + t}}\nforces:\n  lift: {joint: A, torque: -lambda(m)}\n", 1),
    ("forces:\n", "drives: {turn: {joint: A, angle: 120 deg + t}}\nforces:\n", 1),
    ("forces:\n", "algebraic: {root: {of: {b: 0.5}, zero: b^2 + 1 + 0*q(A)}}\nforces:\n  rub: {joint: A, torque: b}\n", 1),
    ("forces:\n", "include: [{file: kempe:gas_spring.yaml, ports: {P: ground.O}}]\nforces:\n", 2),
    ("forces:\n", "include: [{file: kempe:gas_spring.yaml, ports: {P: ground.O, Q: crank}}]\nforces:\n", 2),
    ("forces:\n", "include: [{file: kempe:gas_sprin.yaml}]\nforces:\n", 2),
    ("mass: 1\n    com", "masse: 1\n    com", 2),
    ("at: crank.B", "at: crnak.B", 2),
    ("coupler.C, rocker.C", "coupler.C, rocker.c", 2),
    ("[r/2, 0, 0]", "[R/2, 0, 0]", 2),
    ("zz: 0.0075", "zz: r^2/12", 2),
    ("r: 300 mm", "r: 12 inch", 2),
    ("r: 300 mm, l: 0.8", "r: l/4, l: 4*r", 2),
    ("r: 300 mm, l: 0.8", "r: 300 mm, l: 0.8, R: 1", 0),
    ("t_end: 0.1", "t_end: 0.1, output_step: 1e-12", 2),
    ("l: 0.8", "l: sqrt(0.6 - 1)", 2),
    ("inertia: {zz: 0.04}", "inertia: {xx: 1, yy: 1, zz: 3}", 2),
    ("torque: 0.2", "force: 0.2", 2),
    ("mass: 1\n    com", "mass: 1 + q(A)\n    com", 2),
    ("joint: A, torque", "joint: crank, torque", 2),
    ("torque: 0.2", "torque: max(0.2, t)", 2),
    ("  crank:\n", "  crank:\n   mass: 2\n", 2),
    ("revolute: z, at: ground.D", "revolute: z", 2),
    ("joint: {name: D, revolute: z", "joint: {name: D, motions: [R3, T1]", 2),
    ("l: 0.8", "l: 0.1", 1),
    ("    mass: 1\n    inertia: {zz: 0.04}\n    points: {C: [0.7, 0, 0]}\nloops:\n  C: {ball: [coupler.C, rocker.C]}\n",
     "", 2),
    ("  C: {ball: [coupler.C, rocker.C]}\nforces:\n  motor: {joint: A, torque: 0.2}\n"
     "start: {q: {A: 90 deg, B: -62 deg, D: 106 deg}, hold: [A]}\n",
     "  C: {constraint: q(A)^2 - q(B)^3, power: 0}\nstart: {q: {A: 1, B: 1}, goals: {B: -1}}\n", 1),
]

# Words after `kempe`, and the exit code.
CALLS = [
    ("simulat model.yaml", 3),
    ("simulate modell.yaml", 2),
    ("simulate model.yaml --rtoll 1e-6", 3),
    ("simulate model.yaml --set ll=2", 2),
    ("simulate model.yaml --formulation fast", 3),
    ("simulate model.yaml --integrator bdf --form integrated", 3),
    ("simulate model.yaml --independent X", 3),
    ("simulate model.yaml --independent A,B", 1),
    ("simulate model.yaml --algorithm bodies", 3),
    ("simulate model.yaml --change-points skip", 3),
    (f"check {ROOT}/tests/models/rounded_four_bar.yaml --closure-tolerance 1e-7", 1),
    ("check model.yaml --closure-tolerance -1", 3),
    (f"simulate {ROOT}/tests/models/rounded_inertia.yaml --algorithm articulated", 1),
    (f"simulate {ROOT}/tests/models/guide_friction.yaml --algorithm articulated", 1),
    (f"modes {ROOT}/tests/models/half_turn.yaml --at start", 1),
    ("simulate model.yaml --rtol 1e-20", 3),
    ("simulate model.yaml --output-step 1e-12", 3),
    ("simulate model.yaml -o nowhere/out.csv", 1),
    ("show model.yaml --model --stats", 3),
    ("fit model.yaml angles.csv --parameter l", 1),
    ("fit model.yaml angles.csv --parameter l:1:2", 3),
    ("fit model.yaml angles.csv --columns q.X --parameter l", 3),
    ("optimize model.yaml --minimize max(qd(D)) --parameter l", 3),
    ("optimize model.yaml --minimize range(qd(D)) --parameter l:0.7:0.9 --method slopes", 3),
    ("ensemble model.yaml --values values.csv", 2),
    ("ensemble model.yaml --values numbers.csv", 2),
    ("ensemble model.yaml --sample l=1", 3),
    ("ensemble model.yaml --sample l", 3),
    ("ensemble model.yaml --sample l=0.75:0.85 --instances 8 --t-end 0.01 --rtol 1e-8 --out RUN.kempe", 0),
    ("ensemble model.yaml --sample l=0.75:0.85 --instances 8 --t-end 0.01 --rtol 1e-8 --out RUN.kempe", 2),
    ("ensemble model.yaml --sample l=0.75:0.85 --instances 8 --t-end 0.01 --rtol 1e-6 --out RUN.kempe --resume", 2),
    ("ensemble model.yaml --sample l=0.75:0.85 --instances 8 --t-end 0.01 --rtol 1e-8 --out RUN.kempe --resume --set r=0.31", 2),
    ("ensemble model.yaml --sample l=0.75:0.85 --instances 8 --out other.kempe --shard auto", 3),
    ("ensemble model.yaml --sample l=0.75:0.85 --instances 8 --chunk 4 --t-end 0.01 --out parts.kempe --shard 1/2", 0),
    ("gather parts.kempe", 1),
    ("inverse model.yaml", 3),
    ("inverse model.yaml --actuators X", 3),
    ("inverse model.yaml --actuators A --weights B=2", 3),
    ("inverse model.yaml --actuators A --motion values.csv", 2),
    ("inverse model.yaml --actuators A --motion angles.csv", 2),
    ("inverse model.yaml --actuators A --motion turn.csv", 2),
    (f"inverse {ROOT}/examples/parallel_robot/parallel_robot.yaml --actuators a1", 1),
    ("linearize model.yaml --at end", 3),
    ("linearize model.yaml --inputs moment(A)", 3),
    ("response model.yaml", 3),
    ("response model.yaml --inputs r", 3),
    ("response model.yaml --inputs effort(A) --at start", 1),
    ("sensitivity model.yaml --parameters ll", 3),
    ("sensitivity model.yaml --of colour", 3),
    ("sensitivity model.yaml --method backward", 3),
    ("sensitivity model.yaml --of modes --at end", 3),
    ("sensitivity model.yaml --of equilibrium --at start", 3),
    ("sensitivity model.yaml --of modes --outputs q", 3),
    ("sensitivity model.yaml --integrator ida", 3),
    (f"sensitivity {ROOT}/examples/andrews/andrews.yaml", 3),
    ("kinematics model.yaml --sweep crank=0:1", 3),
    ("kinematics model.yaml --sweep t=0:1", 1),
    ("kinematics model.yaml --sweep A=0:1,D=0:1", 1),
    ("kinematics model.yaml --sweep D=0:1", 1),
    ("kinematics model.yaml --sweep A=0:1,A=0:2", 3),
    (f"simulate {ROOT}/tests/models/one_wheel.yaml --no-convergence-check --set push=-60000", 1),
    (f"simulate {ROOT}/tests/models/one_wheel.yaml --no-convergence-check --set attack=10", 1),
    (f"simulate {ROOT}/examples/rolling_wheel/rolling_wheel.yaml --no-convergence-check --set V=1000 --t-end 1", 1),
    (f"simulate {ROOT}/tests/models/hill.yaml --no-convergence-check", 0),
    (f"equilibrium {ROOT}/tests/models/friction.yaml", 1),
    (f"equilibrium {ROOT}/tests/models/never_steady.yaml", 1),
    ("equilibrium model.yaml --rates shaft=1", 3),
    ("equilibrium model.yaml --rates A=1", 1),
    ("equilibrium model.yaml --solve-for l", 3),
    (f"simulate {ROOT}/tests/models/friction.yaml", 1),
    (f"generate {ROOT}/tests/models/massless_end.yaml --count --sets qdd", 1),
]


def statuses():
    text = re.sub(r"/\*.*?\*/", "", (ROOT / "src/base/statuses.def").read_text(), flags=re.S)
    row = re.compile(r'KMP_STATUS\((\w+), (-?\d+), "([^"]*)", (\d), "([^"]*)"\)')
    rows = row.findall(re.sub(r",\n\s+", ", ", text))
    assert len(rows) == text.count("KMP_STATUS("), "a row of statuses.def is not understood"
    return [f"| `KEMPE_{name}` | {value} | {words} | {code} | {advice} |" for name, value, words, code, advice in rows]


def check_statuses():
    there = [line for line in PAGE.split("\n") if line.startswith("| `KEMPE_")]
    assert there == statuses(), "the table of docs/errors.md should be\n" + "\n".join(statuses())


LACKS = "this build has no "  # an optional library


def said(kempe, folder, words, code):
    done = subprocess.run([kempe, *words.split()], cwd=folder, capture_output=True, text=True, timeout=100)
    code = 1 if LACKS in done.stderr else code
    assert done.returncode == code, f"kempe {words}: exit code {done.returncode}, not {code}\n{done.stderr}"
    title, *rest = re.sub(r"(?<=[^\n])\n {4}(?=\S)", " ", done.stdout.split("\n\n")[0]), *done.stdout.split("\n\n")[1:]  # a title that is wrapped
    return (done.stderr + "\n\n".join([title, *rest])).split("\n")  # ends of runs stand with their results


def everything_said(kempe, folder):
    model = pathlib.Path(folder) / "model.yaml"
    lines = []
    for old, new, code in CHANGES:
        assert MODEL.count(old) == 1, f"{old!r} stands {MODEL.count(old)} times in the model"
        model.write_text(MODEL.replace(old, new))
        lines += said(kempe, folder, "simulate model.yaml", code)
    model.write_text(MODEL)
    (pathlib.Path(folder) / "values.csv").write_text("l,rr\n0.8,0.3\n")
    (pathlib.Path(folder) / "numbers.csv").write_text("l,r\n0.8,x\n")
    (pathlib.Path(folder) / "turn.csv").write_text("t,q.A [m]\n0,1\n0.1,2\n")
    (pathlib.Path(folder) / "angles.csv").write_text("t,q.A\n0,1\n0.1,\n")
    for words, code in CALLS:
        lines += said(kempe, folder, words, code)
    return lines


def main():
    check_statuses()
    kempe = str(pathlib.Path(sys.argv[1]).resolve())
    sentences = re.findall(r"^\| `(?!KEMPE_)([^`]+)` \|", PAGE, re.M)
    assert len(sentences) >= 25, f"{len(sentences)} sentences are found on the page"
    with tempfile.TemporaryDirectory() as folder:
        lines = everything_said(kempe, folder)
    missing = [s for s in sentences
               if not any(re.fullmatch(".*".join(map(re.escape, s.split("..."))), line) for line in lines)]
    if any(LACKS in line for line in lines):
        print("exit codes are right; without a library that this build lacks, some sentences cannot be said:", *missing)
        return 0
    if missing:
        print("never said:", *missing, "\nsaid were:", *filter(None, lines), sep="\n")
        return 1
    print(f"{len(sentences)} sentences of docs/errors.md are really said")
    return 0


if __name__ == "__main__":
    sys.exit(main())
