#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Steps per second of environments of Gymnasium: a cart with a linkage, whose force is drawn anew for each step of 20 ms.

    PYTHONPATH=build/release/python python3 bench/gymnasium_steps.py
"""
import pathlib
import statistics
import time

import kempe
import numpy as np
from kempe.gymnasium import Environment, VectorEnvironment

MODEL = kempe.Model(pathlib.Path(__file__).parents[1] / "tests/models/cart_and_linkage.yaml")
TASK = {
    "step_time": 0.02,
    "horizon": 4,
    "start": {"q(phi)": (-0.1, 0.1)},
    "limits": {"q(phi)": (-0.5, 0.5)},
    "rtol": 1e-8,
}


def upright(values):
    return np.cos(values["q(phi)"]) - 1e-3 * values["u"] ** 2


def one(steps):
    env, random = Environment(MODEL, {"u": (-20, 20)}, upright, **TASK), np.random.default_rng(1)
    env.reset(seed=1)
    actions, episodes = random.uniform(-5, 5, (steps, 1)), 0
    begin = time.perf_counter()
    for action in actions:
        if any(env.step(action)[2:4]):
            env.reset()
            episodes += 1
    return steps / (time.perf_counter() - begin), episodes


def many(count, steps, threads):
    envs = VectorEnvironment(MODEL, count, {"u": (-20, 20)}, upright, threads=threads, **TASK)
    envs.reset(seed=1)
    random, episodes, begin = np.random.default_rng(1), 0, time.perf_counter()
    for _ in range(steps):
        ended = envs.step(random.uniform(-5, 5, (count, 1)))[2:4]
        episodes += int(ended[0].sum() + ended[1].sum())
    seconds = time.perf_counter() - begin
    envs.close()
    return count * steps / seconds, episodes


def row(name, measure):
    found = [measure() for _ in range(5)]
    print(f"{name:<34}{statistics.median(rate for rate, _ in found):>12.0f}{found[0][1]:>12}", flush=True)


print(f"{'':<34}{'steps per s':>12}{'episodes':>12}")
row("Environment", lambda: one(20000))
for threads in (1, 2):
    for count in (16, 256, 1024):
        row(f"VectorEnvironment {count}, threads {threads}", lambda c=count, t=threads: many(c, max(20000 // c, 40), t))
