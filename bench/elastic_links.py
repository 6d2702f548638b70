#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Flexible bodies: time against error, shapes against segments, operations, preparation.

    bench/elastic_links.py KEMPE

A robot of five bars, whose two distal links bend (0.4 s, driven, undamped), and a slider-crank in space, whose rod bends in two planes and
twists (0.2 s). Errors are those of the tool's or slider's place, largest at the instants of digits that an independent program gives (Lagrange's
equations by automatic derivatives; two tolerances agree to 1e-12). Segments are chains of N rigid pieces for each link; their error
is that of the model, against the limit of N. Processor times of the integration, the least of nine runs, without the cache."""
import argparse
import json
import os
import re
import subprocess
import tempfile

PLACES = {0.05: (0.258232060437, 0.437835976972), 0.1: (0.264400712972, 0.509131225500),
          0.2: (0.271261100302, 0.580077340261), 0.4: (0.255789999179, 0.403457120580)}
SLIDER = {0.02: 0.3824633820877, 0.05: 0.3772647749290, 0.1: 0.3951865816245, 0.2: 0.3859945478990}
LIMIT = {0.1: (0.264400711723, 0.509131217377)}


def robot(body):
    text = "kempe: 1\ngravity: [0, 0, 0]\nground: {points: {O1: [0, 0, 0], O2: [0.5, 0, 0]}}\nbodies:\n"
    for i in (1, 2):
        text += (f"  c{i}: {{joint: {{name: A{i}, revolute: z, at: ground.O{i}}}, mass: 0.6, inertia: {{zz: 0.0125}}, "
                 "points: {P: [0.25, 0, 0]}}\n"
                 f"  l{i}: {{joint: {{name: B{i}, revolute: z, at: c{i}.P}}, flexible: {{beam: {{length: 0.45, rhoA: 0.32, EIz: 6}}, "
                 f"{body}}}, points: {{E: {{station: 0.45}}}}}}\n")
    return (text + "  tool: {joint: {name: T, revolute: z, at: l1.E}, mass: 1.2, inertia: {zz: 0.001}, points: {Q: [0, 0, 0]}}\n"
            "loops: {L: {ball: [tool.Q, l2.E]}}\n"
            'drives: {d1: {joint: A1, angle: "2.2 - 0.5*sin(8*t)^2"}, d2: {joint: A2, angle: "0.9 + 0.4*sin(8*t)^2"}}\n'
            "start: {q: {B1: -1.7381865298439, B2: 1.7640981195929}}\n"
            "run: {t_end: 0.4, output_step: 0.05, outputs: [position(tool.Q)]}\n")


def slider_crank(stiffening="full", shapes="y: 2, z: 2, torsion: 1"):
    return ("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {S: [0, 0.02, -0.03]}}\nbodies:\n"
            "  crank: {joint: {name: A, revolute: x, at: ground}, mass: 0.1, inertia: {xx: 0.001}, points: {P: [0, 0.1, 0]}}\n"
            "  rod:\n    joint: {name: B, motions: [R3, R2], coordinates: [B1, B2], at: crank.P}\n    flexible:\n"
            "      beam: {length: 0.4, young: 7 GPa, shear: 2.6 GPa, density: 1500, section: {numbers: {A: 9.6e-5, Iy: 5.12e-10, "
            f"Iz: 1.152e-9, J: 1.2e-9}}}}}}\n      shapes: {{{shapes}}}\n      stiffening: {stiffening}\n"
            "    points: {E: {station: 0.4, offset: [0, 0.02, 0]}}\n"
            "  slider: {joint: {name: X, prismatic: x, at: ground.S}, mass: 0.4, points: {C: [0, 0, 0]}}\n"
            "loops: {L: {ball: [slider.C, rod.E]}}\ndrives: {d: {joint: A, angle: 50*t}}\n"
            "start: {q: {B1: -0.2518, B2: 0.0751, X: 0.3913}}\nrun: {t_end: 0.2, output_step: 0.01, outputs: [q(X)]}\n")


def simulate(kempe, text, *more):
    """The result as JSON, and its rows by time."""
    with tempfile.TemporaryDirectory() as folder:
        model, rows = os.path.join(folder, "model.yaml"), os.path.join(folder, "rows.csv")
        with open(model, "w", encoding="utf-8") as file:
            file.write(text)
        done = subprocess.run([kempe, "simulate", model, "--no-cache", "-q", "--no-convergence-check", "--json", "-", "-o", rows, *more],
                              capture_output=True, text=True, check=True)
        with open(rows, encoding="utf-8") as file:
            lines = [line.strip().split(",") for line in file if not line.startswith("#")]
        return json.loads(done.stdout), {round(float(line[0]), 9): [float(x) for x in line[1:]] for line in lines[1:]}


def error(rows, digits):
    return max(abs(a - b) for t, place in digits.items()
               for a, b in zip(rows[t], place if isinstance(place, tuple) else (place,)))


def timed(kempe, text, *more):
    found = [simulate(kempe, text, *more) for _ in range(9)]
    best = min(result["cpu_s"] for result, _ in found)
    return best, min(result["build_s"] for result, _ in found), found[0]


def operations(kempe, text):
    """Of M, and of C."""
    with tempfile.TemporaryDirectory() as folder:
        model = os.path.join(folder, "model.yaml")
        with open(model, "w", encoding="utf-8") as file:
            file.write(text)
        said = subprocess.run([kempe, "show", model, "--stats", "--no-cache"], capture_output=True, text=True, check=True).stdout
    return [int(re.search(rf"^  {name} .*?\| +(\d+)", said, re.M).group(1)) for name in "MC"]


def against_error(kempe, name, text, digits):
    print(f"\n{name}: M and C take {' and '.join(map(str, operations(kempe, text)))} operations\n")
    print("| rtol | integrator | ms | steps | error, m |\n|---|---|--:|--:|--:|")
    for rtol in ("1e-4", "1e-6", "1e-8", "1e-10", "1e-12"):
        for integrator in ("default", "dop853", "radau"):
            more = () if integrator == "default" else ("--integrator", integrator)
            best, _, (result, rows) = timed(kempe, text, "--rtol", rtol, *more)
            print(f"| {rtol} | {integrator} | {1e3 * best:.2f} | {result['work']['steps']} | {error(rows, digits):.1e} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kempe")
    kempe = parser.parse_args().kempe
    against_error(kempe, "robot, three shapes a link, first", robot("shapes: {y: 3}, frame: chord"), PLACES)
    against_error(kempe, "slider-crank in space, 2 + 2 + 1 shapes, full", slider_crank(), SLIDER)
    print("\nrobot in segments, radau at rtol 1e-10, at t = 0.1 s\n\n| pieces a link | ms | right-hand sides | preparation, ms | "
          "error of the model, m |\n|--:|--:|--:|--:|--:|")
    for pieces in (4, 8, 16, 32):
        best, build, (result, rows) = timed(kempe, robot(f"shapes: {{y: 1}}, segments: {pieces}"), "--rtol", "1e-10", "--integrator",
                                            "radau", "--t-end", "0.1")
        print(f"| {pieces} | {1e3 * best:.2f} | {result['work']['rhs']} | {1e3 * build:.2f} | {error(rows, LIMIT):.1e} |", flush=True)
    print("\npreparation with 12 shapes, ms\n\n| shapes | none | first | full |\n|---|--:|--:|--:|")
    for shapes in ("y: 12", "y: 6, z: 6", "y: 5, z: 5, torsion: 2"):
        builds = [timed(kempe, slider_crank(word, shapes), "--t-end", "1e-4", "--output-step", "1e-4")[1]
                  for word in ("none", "first", "full")]
        print(f"| {shapes} | " + " | ".join(f"{1e3 * build:.1f}" for build in builds) + " |", flush=True)


if __name__ == "__main__":
    main()
