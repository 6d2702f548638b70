#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A step of many environments in lanes and by steppers, and what lanes take for the same motion: microseconds for an instance, least of
repeats.

    PYTHONPATH=build/release/python python3 bench/gymnasium_lanes.py

An EnsembleStepper makes the steps of the VectorEnvironment. A run in lanes begins each instance: it closes the loops, chooses coordinates
and an order of elimination. The repeat at another tolerance begins at closed starts that are known. The further steps are what a longer
run takes beyond a shorter one.
"""
import pathlib
import time
import warnings

import kempe
import numpy as np
from kempe.gymnasium import VectorEnvironment

MODELS = pathlib.Path(__file__).parents[1] / "tests/models"
MODEL = kempe.Model(MODELS / "cart_and_linkage.yaml")
COUNT, STEP, REPEATS = 256, 0.02, 25


def least(call):
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        made = call()
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times) / COUNT, made


def row(words, time_us, note=""):
    print(f"{words:<58}{time_us:>8.2f}  {note}".rstrip(), flush=True)


def environments(random, lanes):
    task = {"step_time": STEP, "horizon": 4, "start": {"q(phi)": (-0.1, 0.1)}, "rtol": 1e-8, "threads": 1}
    envs = VectorEnvironment(MODEL, COUNT, {"u": (-20, 20)}, lambda values: np.cos(values["q(phi)"]), lanes=lanes, **task)
    envs.reset(seed=1)
    words = "in lanes" if lanes else "by steppers"
    row(f"a step of 20 ms of a VectorEnvironment {words}", least(lambda: envs.step(random.uniform(-5, 5, (COUNT, 1))))[0])
    envs.close()


def starts(random):
    return [[0, phi, phi, -phi] for phi in random.uniform(-0.1, 0.1, COUNT)]


def stepper(random, model, outputs, begins, words, lanes=0):
    many = model.ensemble_stepper(COUNT, outputs, lanes, t_end=4, rtol=1e-8, threads=1)
    given = starts(random) if begins else None

    def begin():
        for k in range(COUNT):
            many.begin(k, *([given[k]] if begins else []))

    begun = least(begin)[0]
    done = iter(range(1, REPEATS + 1))
    out = np.zeros((COUNT, len(many.names)))
    taken = least(lambda: many.advance(STEP * next(done), ["u"], random.uniform(-5, 5, (COUNT, 1)), out))[0]
    single = sum(many.single(k) != "" for k in range(COUNT))
    row(words, taken, f"{single} instances by steppers in the last step" if 0 < single < COUNT else "")
    return begun


def lanes(random):
    entries = MODEL.to_dict()
    entries.pop("inputs")
    model = kempe.Model.from_dict({**entries, "parameters": {"u": 0}})
    names, workspace = model.coordinates, model.system().workspace()
    closed = [workspace.close(0, [0, phi, 0, 0], [0.1, 0, 0, 0], hold=["x", "phi"]) for phi in random.uniform(-0.1, 0.1, COUNT)]
    rows = np.hstack([np.array(closed).reshape(COUNT, -1), random.uniform(-5, 5, (COUNT, 1))])
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
environments(np.random.default_rng(1), True)
environments(np.random.default_rng(1), False)
begun = stepper(np.random.default_rng(1), MODEL, "q, qd", True, "a step of an EnsembleStepper, with q and qd")
row("a start of one, with the call from Python", begun)
more = "q, qd, qdd, position(bar.end)"
stepper(np.random.default_rng(1), MODEL, more, True, "the same with accelerations and a position")
crank = (MODELS / "slider_stop.yaml").read_text().replace("forces:\n", "inputs: {u: {unit: N*m}}\nforces:\n  motor: {joint: A, torque: u}\n")
drive = (MODELS.parents[1] / "examples/stick_slip/stick_slip.yaml").read_text()
drive = drive.replace("forces:\n", "inputs: {u: {unit: N}}\nforces:\n  push: {joint: x, force: u}\n")
for words, given in (("in lanes", 0), ("by steppers", -1)):
    stepper(np.random.default_rng(1), kempe.Model.from_text(crank), "q, qd", False, f"a slider-crank that meets a spring, {words}", given)
    stepper(np.random.default_rng(1), kempe.Model.from_text(drive), "q, qd", False, f"a feed drive that sticks and slips, {words}", given)
lanes(np.random.default_rng(1))
