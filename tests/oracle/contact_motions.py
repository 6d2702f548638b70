#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Random plane mechanisms with rigid contacts: chains, boxes with tails and four-bars over a floor, with restitution, friction and a
stop. Judges each row of a run by numbers that follow from the positions alone:

    python3 tests/oracle/contact_motions.py PATH/TO/kempe [COUNT [FIRST [FORMULATION [INTEGRATOR]]]]
    python3 tests/oracle/contact_motions.py PATH/TO/kempe COUNT FIRST simulators

The second runs simulators in C99 of these models, compiled by cc.
No point is below the floor, no contact pulls, a contact pushes only where it touches, friction is within its cone, and the
energy balance closes. A run that stops, or takes more than 20 s of processor time, is an error.
"""
import cmath
import csv
import json
import math
import pathlib
import random
import resource
import subprocess
import sys
import tempfile

from simulated_models import table_of

BELOW, PULLS, TOUCHES, DRIFT = 1e-8, 1e-9, 1e-7, 1e-6
END, STEPS = 3, 600
MOST = 20  # s of processor time


def bar(name, joint, parent):
    return f"  {name}: {{joint: {{name: {joint}, revolute: z, at: {parent}}}, mass: 1, com: [0.2, 0, 0], inertia: {{zz: 0.02}}, points: {{E: [0.4, 0, 0]}}}}"


def box(choose, links):
    bodies = ["  b0: {joint: {name: b0, planar: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {L: [-0.5, -0.2, 0], E: [0.5, -0.2, 0], T: [0, 0.3, 0]}}"]
    bodies += [bar(f"b{k}", f"b{k}", f"b{k - 1}.E") for k in range(1, links)]
    q = [f"b0.2: {choose.uniform(0.8, 1.5):.3f}", f"b0.3: {choose.uniform(-0.4, 0.4):.3f}"]
    qd = [f"b0.1: {choose.uniform(-1, 1):.3f}", f"b0.3: {choose.uniform(-2, 2):.3f}"]
    return "{O: [0, 0, 0]}", bodies, ["b0.L", "b0.T"] + [f"b{k}.E" for k in range(links)], q, qd, []


def chain(choose, links):
    bodies = [bar(f"b{k}", f"b{k}", f"b{k - 1}.E" if k else "ground.D") for k in range(links + 1)]
    q = [f"b{k}: {choose.uniform(-0.4, 0.8):.3f}" for k in range(links + 1)]
    qd = [f"b{k}: {choose.uniform(-2, 2):.3f}" for k in range(links + 1)]
    return f"{{O: [0, 0, 0], D: [{choose.uniform(0.4, 0.9):.3f}, 0.9, 0]}}", bodies, [f"b{k + 1}.E" for k in range(links)], q, qd, []


def four_bar(choose, _):
    foot = f"[{choose.uniform(0.2, 1):.3f}, {choose.uniform(-0.9, -0.6):.3f}, 0]"
    bodies = ["  crank: {joint: {name: A, revolute: z, at: ground.A}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.0075}, points: {B: [0.3, 0, 0]}}",
              f"  coupler: {{joint: {{name: B, revolute: z, at: crank.B}}, mass: 1, com: [0.4, 0, 0], inertia: {{zz: 0.0533}}, points: {{C: [0.8, 0, 0], F: {foot}}}}}",
              "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.041}, points: {C: [0.7, 0, 0]}}"]
    more = ["loops: {C: {ball: [coupler.C, rocker.C]}}", f"  stop: {{joint: D, upper: {choose.uniform(2, 2.4):.3f}, restitution: {choose.choice([0, 0.5])}}}"]
    return ("{O: [0, 0, 0], A: [0, 0.5, 0], D: [0.9, 0.5, 0]}", bodies, ["coupler.F"],
            [f"A: {choose.uniform(1, 2):.3f}", "B: -1.1", "D: 1.85"], [f"A: {choose.uniform(-6, 6):.2f}"], more)


def numbers(text):
    """Numbers of a text between brackets, or after a colon."""
    return [float(x) for x in text[text.index("[") + 1:text.rindex("]")].split(",")] if "[" in text else float(text.split(":")[1])


def distances(kind, links, bodies, q, more):
    """Distances from the floor and from the stop at the start, from the angles alone: points are complex numbers."""
    if kind is box:
        at, turned = 1j * numbers(q[0]), cmath.exp(1j * numbers(q[1]))
        points = [at + turned * (x + 1j * y) for x, y in ((-0.5, -0.2), (0.5, -0.2), (0, 0.3))]
        return [p.imag for p in points + [points[1] + 0.4 * k * turned for k in range(1, links)]]
    if kind is chain:
        tips, angle = [0.9j], 0
        for text in q:
            angle += numbers(text)
            tips.append(tips[-1] + 0.4 * cmath.exp(1j * angle))
        return [tip.imag for tip in tips[2:]]
    b, d = 0.5j + 0.3 * cmath.exp(1j * numbers(q[0])), 0.9 + 0.5j
    across, apart = b - d, abs(b - d)
    inner = math.acos((0.49 + apart * apart - 0.64) / (1.4 * apart))  # at D, between rocker and the line to B
    rocker = min((cmath.phase(across) + side * inner for side in (1, -1)), key=lambda angle: abs(angle - 1.85))
    turned = (d + 0.7 * cmath.exp(1j * rocker) - b) / 0.8
    x, y, _ = numbers(bodies[1][bodies[1].index("F: [") + 3:])
    return [(b + turned * (x + 1j * y)).imag, float(more[1].split("upper: ")[1].split(",")[0]) - rocker]


def draw(choose):
    """A mechanism whose surfaces are apart at the start."""
    links, kind = choose.randint(1, 3), choose.choice([box, chain, four_bar])
    while True:
        parts = kind(choose, links)
        _, bodies, _, q, _, more = parts
        if min(distances(kind, links, bodies, q, more)) > 1e-3:
            return parts


def model(seed):
    """The text, and (name, coefficient of friction) of its contacts with the floor."""
    choose = random.Random(seed)
    ground, bodies, feet, q, qd, more = draw(choose)
    contacts, floor = [], []
    for k, foot in enumerate(feet):
        mu = round(choose.uniform(0.1, 0.8), 2) if choose.random() < 0.6 else 0
        friction = f", friction: {mu}" if mu else ""
        contacts.append(f"  c{k}: {{point: {foot}, on: {{plane: ground.O, normal: y}}, restitution: {choose.choice([0, 0, 0.3, 0.5, 0.8])}{friction}}}")
        floor.append((f"c{k}", mu))
    shown = [f"height{k}, force(c{k})" + (f", force(c{k}_friction)" if mu else "") for k, (_, mu) in enumerate(floor)]
    text = ["kempe: 1", "gravity: [0, -9.81, 0]", f"ground: {{points: {ground}}}", "bodies:", *bodies, *more[:1], "contacts:", *contacts, *more[1:],
            "sensors:", *(f'  height{k}: "position({foot}).y"' for k, foot in enumerate(feet)),
            f"start: {{q: {{{', '.join(q)}}}, qd: {{{', '.join(qd)}}}{', hold: [A]' if more else ''}}}",
            f"run: {{t_end: {END}, rtol: 1e-9, output_step: {1000 * END // STEPS} ms, outputs: [q, qd, {', '.join(shown)}, energy]}}"]
    return "\n".join(text) + "\n", floor


def faults(rows, floor):
    """The faults of the rows of a run, in words."""
    for row in rows:
        for k, (name, mu) in enumerate(floor):
            height, push = float(row[f"sensor.height{k}"]), float(row[f"force.{name}"])
            if height < -BELOW:
                yield f"{name} is {-height:.2g} m below the floor at {row['t']}"
            if push < -PULLS:
                yield f"{name} pulls with {-push:.2g} N at {row['t']}"
            if push > PULLS and height > TOUCHES:
                yield f"{name} pushes {height:.2g} m above the floor at {row['t']}"
            if mu and abs(float(row[f"force.{name}_friction"])) > mu * push * (1 + 1e-6) + 1e-6:
                yield f"the friction of {name} leaves its cone at {row['t']}"


def limited(command):
    return subprocess.run(command, capture_output=True, text=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MOST, MOST)))


def judge_simulator(kempe, path, floor, folder):
    """The same of a simulator, whose energy does not grow: contacts take it away."""
    text, reason, _ = table_of(kempe, path, folder, END, 1e-9, STEPS, limited)
    if reason:
        return reason
    rows = list(csv.DictReader(text.splitlines()))
    energy = [float(row["energy.total"]) for row in rows]
    most = max(after - before for before, after in zip(energy, energy[1:]))
    if most > DRIFT * max(map(abs, energy)):
        return f"the energy grows by {most:.2g} J"
    return next(faults(rows, floor), None)


def judge(kempe, seed, method, folder):
    text, floor = model(seed)
    path, table = folder / f"contacts{seed}.yaml", folder / f"contacts{seed}.csv"
    path.write_text(text)
    if method is None:
        return judge_simulator(kempe, path, floor, folder)
    done = subprocess.run([kempe, "simulate", path, *method, "--json", "-", "-o", table], capture_output=True, text=True,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MOST, MOST)))
    if done.returncode < 0:
        return f"takes more than {MOST} s"
    result = json.loads(done.stdout) if done.stdout.startswith("{") else {"status": "failed", "reason": done.stderr.strip()}
    if result["status"] not in ("complete", "complete, not checked", "not trustworthy"):  # a repeat may part at an impact: rows and energy are judged here
        return f"{result['status']}: {result['reason']}"
    if not result["energy"]["drift_rel"] <= DRIFT:
        return f"the energy balance is open by {result['energy']['drift_rel']:.2g}"
    with open(table, newline="") as file:
        return next(faults(csv.DictReader(file), floor), None)


def main():
    kempe, count, first = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20, int(sys.argv[3]) if len(sys.argv) > 3 else 0
    formulation, wrong = sys.argv[4] if len(sys.argv) > 4 else "reduced", 0
    method = None if formulation == "simulators" else ["--formulation", formulation] + (["--integrator", sys.argv[5]] if len(sys.argv) > 5 else [])
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            fault = judge(kempe, seed, method, pathlib.Path(folder))
            wrong += fault is not None
            if fault:
                print(f"seed {seed}: {fault}")
    print(f"{count} motions with contacts, {wrong} wrong")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
