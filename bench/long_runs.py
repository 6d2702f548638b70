#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs of long mechanisms: time of preparation, time of a right-hand side, peak memory, and how each grows with the length.

    bench/long_runs.py KEMPE [--most N] [--only NAME] [--formulation NAME]
    bench/long_runs.py KEMPE --studies [--most N] [--only NAME]    equilibrium, modes and linearize, as whole processes

A chain of N equal links hangs from the ground, level at the start. A scissor lift of N cells stands on the ground: two bars a cell, and
N - 1 closed loops. A grid of N x N meshes of rods hangs from N + 1 points: 2 N^2 + N rods and N^2 loops. Each is simulated for 0.1 s with the default algorithm at rtol 1e-8, without the cache and without a repetition: on the reduced
formulation by dop853, trees and lifts also on the projected one by dop853 and on the dae by radau. A right-hand side is that of steps of at most 2 ms, with the integrator's own work: the time and the evaluations beyond those of a run of
long steps, whose start and output they share. Processor times, the least of three runs. The exponent is that of the growth since the line
before."""
import argparse
import json
import math
import os
import subprocess

import tables

BAR = "mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.0833}"
LONGEST = 60  # s of a run; the next length is left out


def chain(n):
    text = "kempe: 1\nname: chain\ngravity: [0, -9.81, 0]\nbodies:\n"
    for i in range(n):
        at = f"b{i - 1}.T" if i else "ground"
        text += f"  b{i}: {{joint: {{name: a{i}, revolute: z, at: {at}}}, {BAR}, points: {{T: [1, 0, 0]}}}}\n"
    return text


def scissors(n):
    """Cell i has the bars l and r, which cross at their middles; the ends of a cell carry the next one."""
    angle = 0.5
    text = "kempe: 1\nname: scissors\ngravity: [0, -9.81, 0]\nbodies:\n"
    for i in range(n):
        at = f"l{i - 1}.E" if i else "ground"
        sign = 1 if i % 2 == 0 else -1
        text += f"  l{i}: {{joint: {{name: a{i}, revolute: z, at: {at}}}, {BAR}, points: {{M: [0.5, 0, 0], E: [1, 0, 0]}}}}\n"
        text += (f"  r{i}: {{joint: {{name: c{i}, revolute: z, at: l{i}.M}}, mass: 1, inertia: {{zz: 0.0833}}, "
                 f"points: {{A: [-0.5, 0, 0], E: [0.5, 0, 0]}}}}\n")
    text += "loops:\n"
    for i in range(1, n):
        text += f"  k{i}: {{ball: [r{i}.A, r{i - 1}.E]}}\n"
    text += "start:\n  q: {"
    turns = []
    for i in range(n):
        # The bar l rises at +angle and -angle from the side that it begins on, r the other way.
        direction = angle if i % 2 == 0 else math.pi - angle
        before = 0 if i == 0 else (angle if (i - 1) % 2 == 0 else math.pi - angle)
        turns += [f"a{i}: {direction - before:.17g}", f"c{i}: {math.pi - 2 * direction:.17g}"]
    return text + ", ".join(turns) + "}\n"


def grid(n):
    """Rods v hang one below the other in zigzag, rods h join the columns; the loops are assembled."""
    text = "kempe: 1\nname: grid\ngravity: [0, -9.81, 0]\nground: {points: {"
    text += ", ".join(f"G{c}: [{c}, 0, 0]" for c in range(n + 1)) + "}}\nbodies:\n"
    loops, turns = "", []
    for r in range(1, n + 1):
        for c in range(n + 1):
            at = f"v{r - 1}x{c}.T" if r > 1 else f"ground.G{c}"
            text += f"  v{r}x{c}: {{joint: {{name: a{r}x{c}, revolute: z, at: {at}}}, {BAR}, points: {{T: [1, 0, 0]}}}}\n"
            turns.append(f"a{r}x{c}: {-80 if r == 1 else 10 if r % 2 == 0 else -10} deg")
        for c in range(n):
            text += f"  h{r}x{c}: {{joint: {{name: b{r}x{c}, revolute: z, at: v{r}x{c}.T}}, {BAR}, points: {{T: [1, 0, 0]}}}}\n"
            loops += f"  C{r}x{c}: {{ball: [h{r}x{c}.T, v{r}x{c + 1}.T]}}\n"
            turns.append(f"b{r}x{c}: {80 if r % 2 == 1 else 90} deg")
    return text + "loops:\n" + loops + "start:\n  q: {" + ", ".join(turns) + "}\n"


STUDIES = ("equilibrium", "modes", "linearize")
KINDS = (("chain", chain, (30, 100, 300, 1000, 3000, 10000)), ("scissors", scissors, (10, 30, 100, 300, 1000, 3000)),
         ("grid", grid, (4, 7, 10, 16, 22)))


INTEGRATORS = {"reduced": "dop853", "projected": "dop853", "dae": "radau"}


def run(kempe, formulation, path, *more):
    """The result and its peak memory in MB; None: it fails."""
    words = [kempe, "simulate", path, "--no-cache", "-q", "--t-end", "0.1", "--output-step", "0.1", "--formulation", formulation,
             "--integrator", INTEGRATORS[formulation], "--no-convergence-check", "--json", "-", *more]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        text = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    result = json.loads(text or "{}")
    return (result, used.ru_maxrss / 1024) if process.returncode == 0 and "work" in result else None


def measure(kempe, formulation, path):
    """Preparation and right-hand side in s, peak memory in MB; None: it fails."""
    found = None
    for _ in range(3):
        long, short = run(kempe, formulation, path), run(kempe, formulation, path, "--max-step", "2e-3")
        if not long or not short:
            return None
        evaluations = short[0]["work"]["rhs"] - long[0]["work"]["rhs"]
        now = (long[0]["build_s"], (short[0]["cpu_s"] - long[0]["cpu_s"]) / max(1, evaluations), long[1])
        found = tuple(map(min, found, now)) if found else now
        if now[0] > LONGEST / 3:
            break
    return found


def study(kempe, word, path):
    """Processor time in s and peak memory in MB of a whole process, the least of three; None: it fails."""
    found = None
    for _ in range(3):
        with subprocess.Popen([kempe, word, path, "--no-cache", "-q"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in (0, 5):
            return None
        now = (used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)
        found = tuple(map(min, found, now)) if found else now
        if now[0] > LONGEST / 3:
            break
    return found


def print_studies(given):
    columns = (("time", 1e3, True), ("memory", 1, False))
    for word in STUDIES:
        for name, make, lengths in KINDS:
            if given.only in (None, name):
                tables.growth(f"{name}, {word}: processor time, ms; peak memory, MB; exponents of growth", columns, make,
                              [n for n in lengths if n <= min(given.most, 1000)], lambda path, on=word: study(given.kempe, on, path), LONGEST)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kempe")
    parser.add_argument("--most", type=int, default=10000, help="the largest number of links or cells")
    parser.add_argument("--only", help="chain, scissors or grid")
    parser.add_argument("--formulation", choices=INTEGRATORS, help="this one alone")
    parser.add_argument("--studies", action="store_true", help="equilibrium, modes and linearize in place of runs")
    given = parser.parse_args()
    if given.studies:
        print_studies(given)
        return
    columns = (("preparation", 1e3, True), ("right-hand side", 1e6, True), ("memory", 1, False))
    for formulation, integrator in INTEGRATORS.items():
        for name, make, lengths in KINDS:
            wanted = given.only in (None, name) and given.formulation in (None, formulation)
            if wanted and (formulation == "reduced" or name != "grid"):
                tables.growth(f"{name}, {formulation} by {integrator}: preparation, ms; right-hand side, us; peak memory, MB; "
                              "exponents of growth", columns, make, [n for n in lengths if n <= given.most],
                              lambda path, on=formulation: measure(given.kempe, on, path), LONGEST)


if __name__ == "__main__":
    main()
