#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Four-bars of a sample by a peer's own way to run many instances, on one thread, then on two:

    batch_peers.py heyoka|numba|mujoco|exudyn ROWS.csv TREES.json END ERROR SECONDS

ROWS: the sample as Kempe wrote it. TREES: some of its instances as `peers/tree.py` writes them, for peers that take bodies.
Prints a line a setting: `way|setting|instances|threads|CPU seconds of an instance|wall-clock seconds of an instance|error`. A way goes
to finer settings until its error is at most ERROR or an instance has taken SECONDS; its last setting runs on two threads too.

heyoka and SciPy integrate Lagrange's equation of the one degree of freedom in closed form, written by hand below: fewer unknowns and
operations than equations that a program derives.
"""
import csv
import json
import math
import multiprocessing
import os
import pathlib
import sys
import time

import numpy as np

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "peers")]
import closed  # noqa: E402
import crank_energy  # noqa: E402

NAMES = ("crank", "coupler", "rocker", "base")
START, RATE = math.pi / 2, 20.0
END = ERROR = SECONDS = 0.0                               # set by main


def acceleration(a, w, crank, coupler, rocker, base, cos, sin, sqrt):
    """Of the crank at its angle a and rate w. Vectors along the bars turn with k times the crank's rate: I w' + I' w^2 / 2 + V' = 0."""
    g = 9.81
    c1, s1 = cos(a), sin(a)
    bx, by = crank * c1, crank * s1
    fx, fy = base - bx, -by
    square = fx * fx + fy * fy
    along = (coupler * coupler - rocker * rocker + square) / (2 * square)
    across = sqrt(coupler * coupler / square - along * along)
    ux, uy = along * fx - across * fy, along * fy + across * fx   # coupler
    vx, vy = ux - fx, uy - fy                                     # rocker
    both = 1 / (ux * vy - uy * vx)                                # 1 / (coupler rocker sin)
    k2, k4 = (by * vx - bx * vy) * both, (by * ux - bx * uy) * both
    bu, bv, uv = bx * ux + by * uy, bx * vx + by * vy, ux * vx + uy * vy
    l2, r2 = coupler * coupler, rocker * rocker
    left = k4 * k4 * r2 - bv - k2 * k2 * uv                       # along the rocker: b + k2^2 u - k4^2 v
    down = bu + k2 * k2 * l2 - k4 * k4 * uv                       # along the coupler
    j2, j4 = -left * both, down * both                            # dk2/da, dk4/da, by sign of `both`
    turn = bx * uy - by * ux
    inertia = crank * crank * (1.0 / 3 + 1) + l2 * k2 * k2 / 3 + k2 * bu + r2 * k4 * k4 / 3
    half = l2 * k2 * j2 / 3 + r2 * k4 * j4 / 3 + 0.5 * (j2 * bu + k2 * (k2 - 1) * (-turn))
    slope = g * (1.5 * bx + 0.5 * k2 * ux + 0.5 * k4 * vx)
    return -(half * w * w + slope) / inertia


def coordinates(lengths, angle):
    """Of crank, coupler on the crank, rocker, at an angle of the crank."""
    lengths = np.asarray(lengths).T
    now, before = crank_energy.state(lengths, angle), crank_energy.state(lengths, np.full_like(angle, START))
    return np.stack([angle - START, now[4] - before[4] - (angle - START), now[5] - before[5]], axis=1)


def error(q, reference):
    return float(np.max(np.abs(q - reference) / np.maximum(np.abs(reference), 1)))


def measure(run):
    spent, begin = os.times(), time.perf_counter()
    q = run()
    wall, now = time.perf_counter() - begin, os.times()
    return q, sum(now[:4]) - sum(spent[:4]), wall


def sweep(way, settings, lengths, make):
    """make(setting) -> run(lengths, threads) -> q."""
    reference = crank_energy.ends(lengths, END)
    for setting in settings:
        run = make(setting)
        for threads in (1, 2):
            try:
                q, cpu, wall = measure(lambda: run(lengths, threads))
                off = error(q, reference)
            except Exception as trouble:                  # a peer's own complaint is its result
                print(f"{way}, {setting}: {type(trouble).__name__}: {trouble}".replace("\n", " ")[:200], file=sys.stderr)
                return
            count = len(lengths)
            print(f"{way}|{setting:g}|{count}|{threads}|{cpu / count:.6g}|{wall / count:.6g}|{off:.3g}", flush=True)
            last = off <= ERROR or cpu / count > SECONDS
            if not last:
                break
        if last:
            return


def shared(work, lengths, threads):
    """The halves of a sample by two processes, which begin with what is compiled."""
    global halved
    if threads == 1:
        return work(lengths)
    halved = work
    with multiprocessing.get_context("fork").Pool(threads) as pool:
        return np.concatenate(pool.map(half, np.array_split(lengths, threads)))


def half(lengths):
    return halved(lengths)


def heyoka(lengths, _):
    """Taylor's method in batches as wide as heyoka recommends, and of eight; compiled before the clock starts."""
    import heyoka as hy
    a, w = hy.make_vars("a", "w")
    equation = acceleration(a, w, *(hy.par[k] for k in range(4)), hy.cos, hy.sin, hy.sqrt)

    def batches(width):
        def make(tolerance):
            taylor = hy.taylor_adaptive_batch([(a, w), (w, equation)], np.zeros((2, width)), tol=tolerance, pars=np.ones((4, width)))

            def work(rows):
                out = np.empty(len(rows))
                for k in range(0, len(rows), width):
                    batch = rows[np.minimum(np.arange(k, k + width), len(rows) - 1)]
                    taylor.pars[:] = batch.T
                    taylor.state[0], taylor.state[1] = START, RATE
                    taylor.set_time(0.0)
                    taylor.propagate_until(END)
                    out[k:k + width] = taylor.state[0][:len(rows) - k]
                return coordinates(rows, out)

            return lambda rows, threads: shared(work, rows, threads)

        sweep(f"heyoka, Taylor in batches of {width}, tolerance", [10.0**-k for k in range(6, 17)], lengths[:1024], make)

    for width in sorted({hy.recommended_simd_size(), 8}):
        batches(width)


def numba(lengths, _):
    """SciPy's DOP853 on a compiled right-hand side."""
    from numba import njit
    from scipy.integrate import solve_ivp
    cos, sin, sqrt, equation = np.cos, np.sin, np.sqrt, njit(acceleration)

    @njit
    def rates(t, y, lengths):
        return np.array([y[1], equation(y[0], y[1], lengths[0], lengths[1], lengths[2], lengths[3], cos, sin, sqrt)])

    rates(0.0, np.array([START, RATE]), lengths[0])       # compiles

    def make(rtol):
        def work(rows):
            solve = lambda row: solve_ivp(rates, (0, END), [START, RATE], method="DOP853", rtol=rtol, atol=rtol, args=(row,)).y[0, -1]
            return coordinates(rows, np.array([solve(row) for row in rows]))

        return lambda rows, threads: shared(work, rows, threads)

    sweep("SciPy with Numba, DOP853, rtol", [10.0**-k for k in range(6, 14)], lengths[:64], make)


def mujoco(lengths, trees):
    """rollout over one model for each instance, on its own threads: the equations of motion with the stiffest softness of the step."""
    import mujoco as mj
    from mujoco.rollout import rollout

    def make(steps):
        made = [closed.mujoco_make(given, END / steps, "RK4", True) for given in trees]

        def run(rows, threads):
            models, data = [m for m, _ in made], [mj.MjData(made[0][0]) for _ in range(threads)]
            start = np.array([np.concatenate([[0.0], given.q, given.qd]) for given in trees])
            states, _ = rollout(models, data, start, nstep=int(steps))
            return states[:, -1, 1:4].copy()

        return run

    sweep("MuJoCo, rollout, RK4, stiffest, steps", [5000 * 4**k for k in range(5)], lengths[:len(trees)], make)


def exudyn(lengths, trees):
    """ParameterVariation over the instances, in two processes of its own for two threads."""
    from exudyn.processing import ParameterVariation

    def way(name, index2, radius, settings):
        def make(steps):
            global exudyn_settings
            exudyn_settings = (trees, END, steps, index2, radius)

            def run(rows, threads):
                _, values = ParameterVariation(exudyn_instance, {"instance": [float(k) for k in range(len(rows))]}, useMultiProcessing=threads > 1,
                                               showProgress=False, numberOfThreads=threads)
                return np.array([np.asarray(v) for v in values])

            return run

        sweep(name, settings, lengths[:len(trees)], make)

    counts = [5000 * 4**k for k in range(5)]
    way("Exudyn, ParameterVariation, generalised alpha (0.9), index 3, steps", False, 0.9, counts)
    way("Exudyn, ParameterVariation, trapezoidal, index 2, steps", True, 1.0, counts)


def exudyn_instance(parameters):
    trees, end, *settings = exudyn_settings
    return list(closed.exudyn_run(trees[round(parameters["instance"])], end, *settings)[1])


if __name__ == "__main__":
    END, ERROR, SECONDS = (float(x) for x in sys.argv[4:7])
    with open(sys.argv[2], encoding="utf-8") as file:
        sample = np.array([[float(row[name]) for name in NAMES] for row in csv.DictReader(file)])
    some = []
    for tree in json.loads(pathlib.Path(sys.argv[3]).read_text()):
        some.append(closed.Given.__new__(closed.Given))
        some[-1].__dict__ = tree
    {"heyoka": heyoka, "numba": numba, "mujoco": mujoco, "exudyn": exudyn}[sys.argv[1]](sample, some)
