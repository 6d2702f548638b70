#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two functional mock-up units coupled by a master of few lines: two carts with hanging poles, a spring and a damper between
the carts. The master computes their force at each communication point, extrapolated to the middle of the step. The reference is
one model of both carts by kempe simulate; the error decreases with the square of the communication step.

    python3 examples/cart_pole/couple_cart_pole.py build/release/kempe [options of kempe fmu]        needs FMPy: pip install fmpy
"""
import csv
import pathlib
import subprocess
import sys
import tempfile

import fmpy
from fmpy.fmi3 import FMU3Slave

MODEL = pathlib.Path(__file__).with_name("cart_pole.yaml")
STIFFNESS, DAMPING, END = 40.0, 2.0, 1.0
START = {"q.x": 0.0, "q.phi": 2.6}, {"q.x": 0.3, "q.phi": 3.4}

BOTH = """kempe: 1
name: both carts
gravity: [0, -9.81, 0]
bodies:
""" + "".join(f"""  cart{k}: {{joint: {{name: x{k}, prismatic: x, at: ground}}, mass: 1.5, points: {{pin: [0, 0, 0]}}}}
  pole{k}: {{joint: {{name: phi{k}, revolute: z, at: cart{k}.pin}}, mass: 0.3, com: [0, 0.4, 0], inertia: {{zz: 0.016}}}}
""" for k in (1, 2)) + f"""forces:
  first: {{joint: x1, force: "{STIFFNESS}*(q(x2) - q(x1)) + {DAMPING}*(qd(x2) - qd(x1))"}}
  second: {{joint: x2, force: "{STIFFNESS}*(q(x1) - q(x2)) + {DAMPING}*(qd(x1) - qd(x2))"}}
start: {{q: {{x1: 0, phi1: 2.6, x2: 0.3, phi2: 3.4}}}}
"""


class Unit:
    def __init__(self, file, folder, start):
        unpacked = fmpy.extract(str(file), str(folder))
        about = fmpy.read_model_description(unpacked)
        self.reference = {v.name: v.valueReference for v in about.modelVariables}
        self.slave = FMU3Slave(guid=about.guid, unzipDirectory=unpacked, instanceName="cart",
                               modelIdentifier=about.coSimulation.modelIdentifier)
        self.slave.instantiate()
        self.slave.setFloat64([self.reference[name] for name in start], list(start.values()))
        self.slave.enterInitializationMode(tolerance=1e-10)
        self.slave.exitInitializationMode()

    def get(self, *names):
        return self.slave.getFloat64([self.reference[name] for name in names])

    def step(self, t, length, force):
        self.slave.setFloat64([self.reference["u"]], [force])
        self.slave.doStep(t, length)


def coupled(file, folder, steps):
    """The places of both carts and poles at the end."""
    units = [Unit(file, folder / f"{steps}{k}", start) for k, start in enumerate(START)]
    h = END / steps
    for k in range(steps):
        (x1, v1, a1), (x2, v2, a2) = (unit.get("q.x", "qd.x", "qdd.x") for unit in units)
        if k == 0:
            a1 = a2 = 0.0  # those of the start are without the force
        force = STIFFNESS * (x2 - x1 + (v2 - v1) * h / 2) + DAMPING * (v2 - v1 + (a2 - a1) * h / 2)
        units[0].step(k * h, h, force)
        units[1].step(k * h, h, -force)
    return [x for unit in units for x in unit.get("q.x", "q.phi")]


def reference(kempe, folder):
    model, rows = folder / "both.yaml", folder / "both.csv"
    model.write_text(BOTH)
    subprocess.run([kempe, "simulate", model, "--t-end", str(END), "--rtol", "1e-11", "-o", rows], check=True,
                   stdout=subprocess.DEVNULL)
    table = list(csv.reader(rows.open()))
    last = dict(zip(table[0], map(float, table[-1])))
    return [last[f"q.{name}"] for name in ("x1", "phi1", "x2", "phi2")]


def main():
    kempe = sys.argv[1] if len(sys.argv) > 1 else "kempe"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        file = folder / "cart.fmu"
        subprocess.run([kempe, "fmu", MODEL, "-o", file, *sys.argv[2:]], check=True, stdout=subprocess.DEVNULL)
        exact = reference(kempe, folder)
        errors = []
        for steps in (100, 200, 400, 800):
            errors.append(max(abs(a - b) for a, b in zip(coupled(file, folder, steps), exact)))
            print(f"communication step {1000 * END / steps:6.2f} ms   error {errors[-1]:.1e}")
        ratio = errors[-2] / errors[-1]
        print(f"ratio of the last errors {ratio:.2f}")
        return 0 if 3 < ratio < 5 and errors[-1] < 1e-4 else 1


if __name__ == "__main__":
    sys.exit(main())
