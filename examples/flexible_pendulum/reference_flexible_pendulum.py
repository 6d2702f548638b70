#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the flexible pendulum by equations of its own (needs NumPy and SciPy):

    python3 reference_flexible_pendulum.py > reference.csv

A place of the strip is r = R(theta) (x - s, v): v the deflection, a sum of xi^2, xi^3 and xi^4 with xi = x/length, and s half the
integral of v'^2, by which the strip becomes shorter. Virtual work of the accelerations is summed at points of Gauss.
"""
import math
import sys

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp

TIMES = [0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2]
LENGTH, THICK, WIDE, WEIGHT, SHAPES = 1.0, 0.004, 0.03, 0.5, 3
LINE, STIFF, GRAVITY = 7850 * THICK * WIDE, 210e9 * WIDE * THICK**3 / 12, np.array([0, -9.81])

nodes, weights = np.polynomial.legendre.leggauss(12)
XI = np.append((nodes + 1) / 2, 1)                        # and the end, which carries the weight
MASS = np.append(LINE * LENGTH * weights / 2, WEIGHT)
shapes = [Polynomial([0] * (2 + k) + [1]) for k in range(SHAPES)]
slopes, bends = [p.deriv() / LENGTH for p in shapes], [p.deriv(2) / LENGTH**2 for p in shapes]
V = np.array([p(XI) for p in shapes]).T
SHORT = np.array([[(LENGTH * (a * b).integ())(XI) for b in slopes] for a in slopes]).transpose(2, 0, 1) # s = z' SHORT z / 2
K = STIFF * np.array([[(LENGTH * (a * b).integ())(1) for b in bends] for a in bends])


def rates(_t, state):
    (theta, *z), (omega, *zd) = np.split(state, 2)
    z, zd = np.array(z), np.array(zd)
    c, s = math.cos(theta), math.sin(theta)
    turned, across = np.array([[c, -s], [s, c]]), np.array([[-s, -c], [c, -s]])
    local = np.stack([LENGTH * XI - SHORT @ z @ z / 2, V @ z], axis=1)
    moving = np.stack([-(SHORT @ z @ zd), V @ zd], axis=1)
    by = np.zeros((len(XI), 2, 1 + SHAPES))
    by[:, :, 0] = local @ across.T
    by[:, :, 1:] = turned @ np.stack([-(SHORT @ z), V], axis=1)
    left = -omega**2 * local @ turned.T + 2 * omega * moving @ across.T - (SHORT @ zd @ zd)[:, None] * turned[:, 0]
    weighted = (MASS[:, None, None] * by).reshape(-1, 1 + SHAPES).T
    force = weighted @ (GRAVITY - left).ravel()
    force[1:] -= K @ z
    return np.concatenate([state[1 + SHAPES:], np.linalg.solve(weighted @ by.reshape(-1, 1 + SHAPES), force)])


def run(tolerance):
    start = np.zeros(2 + 2 * SHAPES)
    return solve_ivp(rates, (0, TIMES[-1]), start, "DOP853", TIMES, rtol=tolerance, atol=1e-3 * tolerance).y.T


def main():
    table, other = run(1e-12), run(1e-11)
    print(f"# SciPy's DOP853; coordinates at tolerances of 1e-12 and 1e-11 differ by {abs(table - other)[:, 0].max():.0e}.", file=sys.stderr)
    print("# By reference_flexible_pendulum.py: the strip is a sum of polynomials in the axes of its hinge, with a formulation of its own.")
    print("t,q.pivot,qd.pivot")
    for t, state in zip(TIMES, table):
        print(f"{t:g},{state[0]:.14g},{state[1 + SHAPES]:.12g}")


if __name__ == "__main__":
    main()
