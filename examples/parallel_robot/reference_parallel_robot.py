#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the robot's motion by equations of its own, in 30 digits. Needs mpmath.

    python3 reference_parallel_robot.py > reference.csv

The two parallelograms of an arm keep its elbow and the platform level, so that an arm has two angles: theta of its crank,
phi of its rod. Four angles, two closures; theta of both arms and their rates are integrated, phi is where two circles
meet. Extrapolated midpoint rule (Gragg, Bulirsch, Stoer); a run with half as long steps agrees on all digits that are
written.
"""
from mpmath import acos, atan2, cos, lu_solve, matrix, mp, mpf, nstr, pi, sin, sqrt

mp.dps = 30
A, B, HALF = mpf("0.4"), mpf("0.6"), mpf("0.15")  # crank, rod, half of what the platform's hinges are nearer than the pivots
CRANK, ELBOW, ROD, PLATFORM, G = mpf("1.5"), mpf("0.3"), mpf("1.2"), mpf(2), mpf("9.81")  # bars of a pair together
STIFFNESS = 60                                           # of the springs that hold the cranks where they start
START = [pi * -150 / 180, pi * -30 / 180, mpf(3), mpf(1)]


def rods(left, right):
    """phi of both arms: the platform is below the elbows."""
    x, y = 2 * HALF + A * (cos(right) - cos(left)), A * (sin(right) - sin(left))
    far, way = sqrt(x * x + y * y), atan2(y, x)
    return way - acos(far / (2 * B)), pi + way + acos(far / (2 * B))


def rates(state):
    """State: theta of both arms, their rates. The angles are theta, phi of the left arm, then of the right one."""
    angle = [state[0], 0, state[1], 0]
    angle[1], angle[3] = rods(state[0], state[1])
    c, s, r = [cos(x) for x in angle], [sin(x) for x in angle], [A, B, A, B]
    sign = [1, 1, -1, -1]
    det = r[1] * r[3] * (s[1] * c[3] - c[1] * s[3])      # sum of sign r (-s, c) rate = 0, for phi
    px, py = (sum(-sign[k] * r[k] * s[k] * state[2 + k // 2] for k in (0, 2)),
              sum(sign[k] * r[k] * c[k] * state[2 + k // 2] for k in (0, 2)))
    rate = [state[2], (px * r[3] * c[3] + py * r[3] * s[3]) / det, state[3], 0]
    rate[3] = (px * r[1] * c[1] + py * r[1] * s[1]) / det
    m, f = matrix(6, 6), matrix(6, 1)
    for k in (0, 2):
        end = PLATFORM if k == 0 else 0                  # the platform goes with the left arm
        m[k, k] = A**2 * (CRANK / 3 + ELBOW + ROD + end)
        m[k + 1, k + 1] = B**2 * (ROD / 3 + end)
        lever = A * B * (ROD / 2 + end)
        m[k, k + 1] = m[k + 1, k] = lever * cos(angle[k] - angle[k + 1])
        f[k] = -lever * sin(angle[k] - angle[k + 1]) * rate[k + 1]**2 - G * A * c[k] * (CRANK / 2 + ELBOW + ROD + end)
        f[k] -= STIFFNESS * (angle[k] - START[k // 2])
        f[k + 1] = lever * sin(angle[k] - angle[k + 1]) * rate[k]**2 - G * B * c[k + 1] * (ROD / 2 + end)
    for k in range(4):
        m[4, k] = m[k, 4] = -sign[k] * r[k] * s[k]
        m[5, k] = m[k, 5] = sign[k] * r[k] * c[k]
        f[4] += sign[k] * r[k] * c[k] * rate[k]**2
        f[5] += sign[k] * r[k] * s[k] * rate[k]**2
    x = lu_solve(m, f)
    return [state[2], state[3], x[0], x[2]], angle, rate


def step(state, h, columns=9):
    table = []
    for k in range(columns):
        n = 2 * (k + 1)
        d = h / n
        before, now = state, [a + d * b for a, b in zip(state, rates(state)[0])]
        for _ in range(n - 1):
            before, now = now, [a + 2 * d * b for a, b in zip(before, rates(now)[0])]
        row = [[(a + b + d * c) / 2 for a, b, c in zip(before, now, rates(now)[0])]]
        for j in range(k):
            ratio = mpf(n) ** 2 / (2 * (k - j)) ** 2 - 1
            row.append([a + (a - b) / ratio for a, b in zip(row[j], table[k - 1][j])])
        table.append(row)
    return table[-1][-1]


def run(ends, h):
    state, t = START, mpf(0)
    for end in ends:
        while t < end - h / 2:
            state, t = step(state, h), t + h
        yield end, state


if __name__ == "__main__":
    import sys
    print("# The level platform as a five-bar: 30 digits by reference_parallel_robot.py, a formulation of its own.")
    print("t,q.a1,qd.a1,q.a4,qd.a4,q.b1,qd.b1,q.b4,qd.b4")
    for t, state in run([mpf("0.25"), mpf("0.5"), mpf(1), mpf(2)], mpf(1) / int(sys.argv[1] if len(sys.argv) > 1 else 32)):
        _, angle, rate = rates(state)
        angle[3] -= 2 * pi
        print(",".join([nstr(t, 3)] + [nstr(x[k], 18) for k in range(4) for x in (angle, rate)]))
