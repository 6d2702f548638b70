#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Memory over many calls of each kind: what the heap has given out, and the pages of the process.

    PYTHONPATH=build/release/python python3 python/tests/growth.py [CALLS]

CALLS (a million) is the number of calls of the cheap kinds; functions that cost more are called less often. After a tenth of the
calls memory must not grow: each kind is repeated nine times as long, and the growth in between is printed."""

import contextlib
import ctypes
import gc
import pathlib
import pickle
import resource
import sys

import kempe
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
BYTES, PAGES = 16_000, 1_000_000  # growth that is none: caches of the interpreter, pages that the heap keeps


class Heap(ctypes.Structure):
    """struct mallinfo2 of the C library."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in "arena ordblks smblks hblks hblkhd usmblks fsmblks used free keepcost".split()
    ]


def memory():
    """Bytes that are in use on the heap, and bytes of the process in memory."""
    gc.collect()
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = Heap
    heap = mallinfo()
    pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
    return heap.used + heap.hblkhd, pages * resource.getpagesize()


def kinds():
    """name: (a share of the calls, a call)"""
    path = ROOT / "examples/four_bar/four_bar.yaml"
    text = path.read_text()
    model = kempe.Model(path)
    system = model.system()
    damped = model.system(force=lambda t, q, qd: -0.1 * qd).workspace()
    broken = model.system(force=lambda t, q, qd: 1 / 0)
    workspace, outputs, run = system.workspace(), system.outputs("position(coupler.C)"), system.simulate(t_end=0.5)
    stepper = system.stepper(t_end=1e9)
    q, qd = run.q[3].copy(), run.qd[3].copy()
    repeat(stepper.step, 25_000)  # its log keeps the first thousand exchanges
    rows = np.tile(q, (8, 1)), np.tile(qd, (8, 1))

    def refused():
        with contextlib.suppress(ValueError):
            workspace.evaluate(0.0, [1.0])

    def failed():
        with contextlib.suppress(kempe.FailedError):
            model.simulate(max_steps=3)

    def raised():
        with contextlib.suppress(ZeroDivisionError):
            broken.simulate(t_end=0.1)

    def unread():
        with contextlib.suppress(kempe.InputError):
            kempe.Model.from_text("kempe: 1\nbodies: {a: {mas: 1}}\n")

    def whole():
        fresh = kempe.Model.from_text(text)
        views = fresh.simulate(t_end=0.05).q, fresh.system().linearize().A, fresh.system().modes().eigenvalues
        return views, pickle.loads(pickle.dumps(fresh))

    return {
        "evaluate": (1, lambda: workspace.evaluate(0.0, q, qd)),
        "evaluate, lists": (1, lambda: workspace.evaluate(0.0, [0.1, 0.2, 0.3])),
        "forward_dynamics": (1, lambda: workspace.forward_dynamics(0.0, q, qd)),
        "inverse_dynamics": (1, lambda: workspace.inverse_dynamics(0.0, q, qd, qd)),
        "M, a copy": (1, lambda: workspace.M),
        "outputs.at": (1, lambda: outputs.at(0.0, q, qd)),
        "view of a run": (1, lambda: run.q),
        "rates, a force in Python": (0.3, lambda: damped.rates(0.0, rows[0][0].repeat(2))),
        "evaluate_states": (0.1, lambda: workspace.evaluate_states(0.0, *rows)),
        "stepper.step": (0.1, stepper.step),
        "ValueError": (0.1, refused),
        "columns and outputs of a run": (0.01, lambda: (run.rows["q.crank"], run["position(coupler.C).x"])),
        "InputError": (0.003, unread),
        "FailedError with a run": (0.003, failed),
        "an exception in a force": (0.003, raised),
        "simulate": (0.003, lambda: model.simulate(t_end=0.1)),
        "model, run, state space, modes": (0.0005, whole),
    }


def repeat(call, times):
    for _ in range(times):
        call()


def growth(calls):
    """Rows of kind, calls, growth of the heap and of the process in bytes."""
    gc.collect()
    gc.freeze()  # what is there before is not looked at again by each collection
    try:
        for name, (share, call) in kinds().items():
            times = max(10, int(calls * share))
            repeat(call, times // 10)
            before = memory()
            repeat(call, times - times // 10)
            after = memory()
            yield name, times, after[0] - before[0], after[1] - before[1]
    finally:
        gc.unfreeze()


def grows(row):
    return row[2] > BYTES or row[3] > PAGES


def main(arguments):
    rows = []
    print(f"{'':32}{'calls':>10}{'heap, bytes':>14}{'process, bytes':>16}")
    for row in growth(int(arguments[0]) if arguments else 1_000_000):
        rows.append(row)
        print(f"{row[0]:32}{row[1]:10d}{row[2]:14d}{row[3]:16d}", flush=True)
    return int(any(map(grows, rows)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
