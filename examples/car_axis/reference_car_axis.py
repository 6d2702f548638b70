#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the car axis by its equations as published, index reduced, in 30 digits. Needs mpmath.

    python3 reference_car_axis.py > reference.csv

The equations of the Test Set for IVP Solvers, accelerations and multipliers by one linear solve; extrapolated midpoint rule
(../extrapolation.py). With half or twice as long steps all digits that are written are the same, to one in the last.
"""
import pathlib
import sys

from mpmath import cos, lu_solve, matrix, mp, mpf, nstr, sin, sqrt

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from extrapolation import run  # noqa: E402

mp.dps = 30
MASS, L, L0, R, OMEGA = mpf("5e-4"), mpf(1), mpf("0.5"), mpf("0.1"), mpf(10)


def solved(t, state):
    """Accelerations of xl, yl, xr, yr, then both multipliers."""
    xl, yl, xr, yr, vxl, vyl, vxr, vyr = state
    yb, vyb = R * sin(OMEGA * t), R * OMEGA * cos(OMEGA * t)
    xb = sqrt(L**2 - yb**2)
    vxb = -yb * vyb / xb
    ayb = -OMEGA**2 * yb
    axb = -(vxb**2 + vyb**2 + yb * ayb) / xb
    left, right = sqrt(xl**2 + yl**2), sqrt((xr - xb) ** 2 + (yr - yb) ** 2)
    f = [(L0 - left) * xl / left, (L0 - left) * yl / left - MASS, (L0 - right) * (xr - xb) / right,
         (L0 - right) * (yr - yb) / right - MASS]
    rows = [[xb, yb, 0, 0], [2 * (xl - xr), 2 * (yl - yr), 2 * (xr - xl), 2 * (yr - yl)]]
    bias = [2 * (vxl * vxb + vyl * vyb) + xl * axb + yl * ayb, 2 * ((vxl - vxr) ** 2 + (vyl - vyr) ** 2)]
    a, b = matrix(6, 6), matrix(6, 1)
    for i in range(4):
        a[i, i], b[i] = MASS, f[i]
        for k in range(2):
            a[i, 4 + k], a[4 + k, i] = -rows[k][i], rows[k][i]
    for k in range(2):
        b[4 + k] = -bias[k]
    return lu_solve(a, b)


def rates(t, state):
    return matrix([*state[4:], *solved(t, state)[:4]])


if __name__ == "__main__":
    start = matrix([0, "0.5", 1, "0.5", "-0.5", 0, "-0.5", 0])
    names = ("left.1", "left.2", "right.1", "right.2")
    print("# Car axis of the Test Set for IVP Solvers: its equations in 30 digits by reference_car_axis.py; two step sizes agree.")
    print(",".join(["t", *(f"q.{x}" for x in names), *(f"qd.{x}" for x in names), "lambda.A.1", "lambda.B.1"]))
    h = mpf(1) / int(sys.argv[1] if len(sys.argv) > 1 else 40)
    for t, state in run(rates, start, [mpf("0.5"), mpf(1), mpf(2), mpf(3)], h, 10):
        values = [*state, *solved(t, state)[4:]]
        print(",".join([nstr(t, 3)] + [nstr(x, 17) for x in values]))
