#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A step of many environments by steppers, and what lanes take for the same motion: microseconds for an instance, least of repeats.

    PYTHONPATH=build/release/python python3 bench/gymnasium_lanes.py

A run in lanes begins each instance: it closes the loops, chooses coordinates and an order of elimination. The repeat at another
tolerance begins at closed starts that are known. The further steps are what a longer run takes beyond a shorter one.
"""
import pathlib
import time
import warnings

import kempe
import numpy as np
from kempe.gymnasium import VectorEnvironment

MODEL = kempe.Model(pathlib.Path(__file__).parents[1] / "tests/models/cart_and_linkage.yaml")
COUNT, STEP, REPEATS = 256, 0.02, 25


def least(call):
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        made = call()
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times) / COUNT, made


def row(words, time_us, note=""):
    print(f"{words:<58}{time_us:>8.2f}  {note}", flush=True)


def steppers(random):
    task = {"step_time": STEP, "horizon": 4, "start": {"q(phi)": (-0.1, 0.1)}, "rtol": 1e-8, "threads": 1}
    envs = VectorEnvironment(MODEL, COUNT, {"u": (-20, 20)}, lambda values: np.cos(values["q(phi)"]), **task)
    envs.reset(seed=1)
    row("a step of 20 ms of a VectorEnvironment", least(lambda: envs.step(random.uniform(-5, 5, (COUNT, 1))))[0])
    envs.close()


def lanes(random):
    entries = MODEL.to_dict()
    entries.pop("inputs")
    model = kempe.Model.from_dict({**entries, "parameters": {"u": 0}})
    names, workspace = model.coordinates, model.system().workspace()
    starts = [workspace.close(0, [0, phi, 0, 0], [0.1, 0, 0, 0], hold=["x", "phi"]) for phi in random.uniform(-0.1, 0.1, COUNT)]
    rows = np.hstack([np.array(starts).reshape(COUNT, -1), random.uniform(-5, 5, (COUNT, 1))])
    ensemble = model.ensemble({**{f"q.{name}": [] for name in names}, **{f"qd.{name}": [] for name in names}, "u": []})

    def run(t_end, checked=False):
        options = {"t_end": t_end, "rtol": 1e-8, "threads": 1, "no_convergence_check": not checked}
        time_us, batch = least(lambda: ensemble.run_rows(rows, **options))
        return time_us, batch.instances["steps"].mean()

    first, taken = run(STEP)
    long, more = run(10 * STEP)
    checked, _ = run(STEP, True)
    row("a run of 20 ms in lanes, from given states", first, f"{taken:.2f} steps of the integrator")
    row("the same from closed starts that are known", checked - first)
    row("a further step of the integrator in a lane", (long - first) / (more - taken), f"of {more:.2f} in 200 ms")


warnings.simplefilter("ignore", kempe.KempeWarning)
print(f"{COUNT} instances, one thread{'us':>41}")
steppers(np.random.default_rng(1))
lanes(np.random.default_rng(1))
