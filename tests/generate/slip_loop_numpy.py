# SPDX-License-Identifier: BSD-3-Clause
"""Friction of rigid contacts in generated equations of a model with the name machine, which needs nothing of Kempe:

    kempe generate machine.yaml --lang python --drives --sets M_C+h_J+jdqd,friction,impact -o folder
    python3 slip_loop_numpy.py folder motion STEP Q.. QD.. TIME..
    python3 slip_loop_numpy.py folder impact Q.. QD..

A motion on closed contacts whose friction slips: states at the times, and the friction. An impact of all contacts, whose
friction sticks within its bound and otherwise slips: the rates after it. Each contact has slip in two directions."""
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[1])
import machine  # noqa: E402

N, ROWS = len(machine.coordinate_names), len(machine.row_names)
SENSE, HELD = 0, 1
ALONG = np.array(machine.friction_rows)


def modes_of(sticks):
    """All contacts closed, all their friction in stick or in slip."""
    modes = [0.0]*(machine.mode_entries*machine.elements)
    for first in machine.contact_modes:
        modes[first + HELD] = 1.0
    for first in machine.friction_modes:
        modes[first + (HELD if sticks else SENSE)] = 1.0
    return modes


SLIPS, STICKS = modes_of(False), modes_of(True)


def solve(M, J, first, second):
    """M x - J' y = first, J x = second; a row that is zero has y = 0."""
    matrix = np.block([[M, -J.T], [J, np.diag([0.0 if np.any(row) else 1.0 for row in J])]])
    solution = np.linalg.solve(matrix, np.concatenate([first, second]))
    return solution[:N], solution[N:]


def accelerate(t, q, qd):
    """C is an affine function of lambda, and so is what follows from it: lambda is where both are the same."""
    def follows(lambda_):
        M, C, _, J, jdqd = machine.M_C_h_J_jdqd(t, q, qd, lambda_, SLIPS)
        return solve(M, J, -C, -jdqd)
    start = follows(np.zeros(ROWS))[1]
    slope = np.stack([follows(unit)[1] - start for unit in np.eye(ROWS)], 1)
    lambda_ = np.linalg.solve(np.eye(ROWS) - slope, start)
    return follows(lambda_)[0], lambda_


def move(size, q, qd, times):
    t = 0.0
    for end in times:
        for _ in range(round((end - t)/size)):
            v, a = qd, accelerate(t, q, qd)[0]
            q_end, qd_end = q, qd
            for part, weight in ((0.5, 1/6), (0.5, 1/3), (1.0, 1/3), (0.0, 1/6)):
                q_end, qd_end = q_end + weight*size*v, qd_end + weight*size*a
                if part:
                    at = (t + part*size, q + part*size*v, qd + part*size*a)
                    v, a = at[2], accelerate(*at)[0]
            t, q, qd = t + size, q_end, qd_end
        rub = machine.friction(t, q, qd, accelerate(t, q, qd)[1], SLIPS)[3]
        print(*(f"{number:.17g}" for number in (t, *q, *qd, *rub)))


def strike(q, qd):
    M, _, _, J, _ = machine.M_C_h_J_jdqd(0.0, q, qd, np.zeros(ROWS), STICKS)
    rates, impulse = solve(M, J, M @ qd, machine.impact(0.0, q, qd, STICKS))
    _, _, holding, rub = machine.friction(0.0, q, qd, impulse, STICKS)
    if np.hypot(*rub) > holding[0]:  # the rows of friction are left out, and its bound acts along them
        open_rows = J.copy()
        open_rows[ALONG] = 0.0
        given = machine.impact(0.0, q, qd, SLIPS)
        way = rub/np.hypot(*rub)
        normal = solve(M, open_rows, M @ qd, given)[1]
        level = machine.friction(0.0, q, qd, normal, SLIPS)[1]
        rates, _ = solve(M, open_rows, M @ qd + J[ALONG].T @ (level*way), given)
    print(*(f"{number:.17g}" for number in rates))


numbers = [float(word) for word in sys.argv[3:]]
if sys.argv[2] == "motion":
    move(numbers[0], np.array(numbers[1:N + 1]), np.array(numbers[N + 1:2*N + 1]), numbers[2*N + 1:])
else:
    strike(np.array(numbers[:N]), np.array(numbers[N:]))
