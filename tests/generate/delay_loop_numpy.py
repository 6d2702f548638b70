# SPDX-License-Identifier: BSD-3-Clause
"""An integrator of a user for generated equations with continuous delays, which needs nothing of Kempe:

    kempe generate MODEL.yaml --lang python --drives --sets M_C+h_J+jdqd,delay -o folder
    python3 delay_loop_numpy.py folder NAME STEPS END Q.. QD..

Runge-Kutta steps of order 4, of which each delay has a whole number. The signals at the ends of steps are kept; between
them they are polynomials of degree 5, of which none extends over a multiple of the delay: derivatives may jump there.
Prints q and qd at the end."""
import importlib
import math
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
machine = importlib.import_module(sys.argv[2])

N, DEGREE = len(machine.coordinate_names), 5
STEPS, SIZE = int(sys.argv[3]), float(sys.argv[4])/int(sys.argv[3])
kept = []


def between(d, first, steps):
    """The signal of delay d after so many steps, by those from number `first` on."""
    nodes = range(first, first + DEGREE + 1)
    return sum(kept[i][d]*math.prod((steps - j)/(i - j) for j in nodes if j != i) for i in nodes)


def late(d, steps, now):
    """The signal that delay d has after so many steps, within step `now`."""
    at, begin = steps - lag[d], now - lag[d]
    if begin < 0:
        return machine.delay(at*SIZE, [0.0]*N, [0.0]*N)[1][d] if machine.delay_given[d] else kept[0][d]
    low = begin//lag[d]*lag[d]
    return between(d, min(max(math.floor(at) - DEGREE//2, low), low + lag[d] - DEGREE), at)


def set_delays(t, qd, now):
    for d, place in enumerate(machine.delay_places):
        qd[place] = late(d, t/SIZE, now)


def accelerate(t, q, qd, now):
    """M qdd + C = J' lambda, J qdd + jdqd = 0."""
    qd = qd.copy()
    set_delays(t, qd, now)
    M, C, _, J, jdqd = machine.M_C_h_J_jdqd(t, q, qd)
    matrix = np.block([[M, J.T], [J, np.zeros((len(J), len(J)))]])
    return np.linalg.solve(matrix, -np.concatenate([C, jdqd]))[:N]


start = np.array([float(x) for x in sys.argv[5:]])
q, qd = start[:N], start[N:]
signal, _, delays = machine.delay(0.0, q, qd)
lag = [round(x/SIZE) for x in delays]
kept.append(signal)
for now in range(STEPS):
    t, v, a = now*SIZE, [], []
    for part in (0.0, 0.5, 0.5, 1.0):
        v.append(qd + part*SIZE*(a[-1] if a else 0.0))
        a.append(accelerate(t + part*SIZE, q + part*SIZE*(v[-2] if len(v) > 1 else 0.0), v[-1], now))
    q = q + SIZE*(v[0] + 2*v[1] + 2*v[2] + v[3])/6
    qd = qd + SIZE*(a[0] + 2*a[1] + 2*a[2] + a[3])/6
    set_delays(t + SIZE, qd, now)
    kept.append(machine.delay(t + SIZE, q, qd)[0])
for x, rate in zip(q, qd):
    print(f"{x:.17g} {rate:.17g}")
