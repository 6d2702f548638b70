#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the slider-crank with a flexible rod by equations of its own (needs NumPy and SciPy):

    python3 reference_flexible_slider_crank.py > reference.csv

A place of the rod is r = P + R (x - s, v, w): P the pin of the crank, R = Rx(A) Rz(B) Ry(C) the axes of the section there, v and w the
deflections, sums of xi^2, xi^3 and xi^4 with xi = x/length, and s half the integral of v'^2 + w'^2, by which the rod becomes shorter.
Virtual work of the accelerations is summed at points of Gauss, and a force at the end holds it on the slider.
"""
import sys

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import fsolve

TIMES = [0.0125, 0.025, 0.0375, 0.05, 0.0625, 0.075, 0.0875, 0.1]
CENTRE, CRANK, LENGTH, SLIDER, PACE = np.array([0, 0.1, 0.12]), 0.08, 0.3, 1.0, 40.0
DIAMETER, RATIO, GRAVITY, SHAPES = 0.005, 0.01, np.array([0, 0, -9.81]), 3
LINE, STIFF = 2700 * np.pi * DIAMETER**2 / 4, 70e9 * np.pi * DIAMETER**4 / 64
AXES = (0, 2, 1)                                          # of the turns A, B, C


def turns(angle, axis):
    """A turn about an axis with its first and second derivative."""
    c, s, (i, j) = np.cos(angle), np.sin(angle), ((axis + 1) % 3, (axis + 2) % 3)
    found = np.zeros((3, 3, 3))
    found[0, axis, axis] = 1
    for k, (along, across) in enumerate(((c, s), (-s, c), (-c, -s))):
        found[k, i, i] = found[k, j, j] = along
        found[k, j, i], found[k, i, j] = across, -across
    return found


def attitude(angles, rates):
    """R, its derivatives by the three angles, and its second derivative in time with constant rates."""
    a, b, c = (turns(angle, axis) for angle, axis in zip(angles, AXES))
    ab, bc = a[0] @ b[0], b[0] @ c[0]
    second = rates[0]**2 * a[2] @ bc + rates[1]**2 * a[0] @ b[2] @ c[0] + rates[2]**2 * ab @ c[2]
    second += 2 * (rates[0] * rates[1] * a[1] @ b[1] @ c[0] + rates[0] * rates[2] * a[1] @ b[0] @ c[1] + rates[1] * rates[2] * a[0] @ b[1] @ c[1])
    return ab @ c[0], [a[1] @ bc, a[0] @ b[1] @ c[0], ab @ c[1]], second


class Rod:
    def __init__(self):
        nodes, weights = np.polynomial.legendre.leggauss(12)
        xi = (nodes + 1) / 2
        shapes = [Polynomial([0] * (2 + k) + [1]) for k in range(SHAPES)]
        slopes, bends = [p.deriv() / LENGTH for p in shapes], [p.deriv(2) / LENGTH**2 for p in shapes]
        short = [[LENGTH * (a * b).integ() for b in slopes] for a in slopes] # s = (y' short y + z' short z) / 2
        at = lambda x: (LENGTH * x, np.array([p(x) for p in shapes]).T, np.array([[p(x) for p in row] for row in short]).transpose(2, 0, 1))
        self.weight, self.inside, self.end = LINE * LENGTH * weights / 2, at(xi), at(np.array([1.0]))
        over = lambda a, b: LENGTH * (a * b).integ()(1)
        self.k = STIFF * np.array([[over(a, b) for b in bends] for a in bends])
        mass = LINE * np.array([[over(a, b) for b in shapes] for a in shapes])
        squares, modes = eigh(self.k, mass)
        self.d = mass @ modes @ np.diag(2 * RATIO * np.sqrt(squares)) @ modes.T @ mass

    def places(self, which, t, q, qd):
        """Of points of the rod: places, their derivatives by (B, C, X, y, z), and what accelerations have besides."""
        x, shape, short = which
        angles, rates = [PACE * t, *q[:2]], [PACE, *qd[:2]]
        R, by, second = attitude(angles, rates)
        arm = turns(angles[0], 0)
        bent, bent_d = (np.split(v[3:], 2) for v in (q, qd))
        local = np.stack([x - sum(short @ e @ e for e in bent) / 2, *(shape @ e for e in bent)], axis=1)
        moving = np.stack([-sum(short @ e @ d for e, d in zip(bent, bent_d)), *(shape @ d for d in bent_d)], axis=1)
        inner = np.zeros((len(x), 3, 2 * SHAPES))
        for k in (0, 1):
            own = slice(k * SHAPES, (k + 1) * SHAPES)
            inner[:, 0, own], inner[:, 1 + k, own] = -(short @ bent[k]), shape
        places = CENTRE + CRANK * arm[0, :, 1] + local @ R.T
        found = np.zeros((len(x), 3, 3 + 2 * SHAPES))
        found[:, :, 0], found[:, :, 1], found[:, :, 3:] = local @ by[1].T, local @ by[2].T, R @ inner
        turning = sum(rate * way for rate, way in zip(rates, by))
        left = PACE**2 * CRANK * arm[2, :, 1] + local @ second.T + 2 * moving @ turning.T
        left -= sum(short @ d @ d for d in bent_d)[:, None] * R[:, 0]
        return places, found, left

    def gap(self, t, q):
        return self.places(self.end, t, q, 0 * q)[0][0] - [q[2], 0, 0]

    def solve(self, t, state):
        """Accelerations, and the multipliers of the end on the slider."""
        q, qd = np.split(state, 2)
        _, by, left = self.places(self.inside, t, q, qd)
        weighted = (self.weight[:, None, None] * by).reshape(-1, by.shape[2]).T
        M, f = weighted @ by.reshape(-1, by.shape[2]), weighted @ (GRAVITY - left).ravel()
        M[2, 2] += SLIDER
        for k in (0, 1):
            own = slice(3 + k * SHAPES, 3 + (k + 1) * SHAPES)
            f[own] -= self.k @ q[own] + self.d @ qd[own]
        _, by, left = self.places(self.end, t, q, qd)
        J = by[0].copy()
        J[0, 2] = -1
        whole = np.block([[M, -J.T], [J, np.zeros((3, 3))]])
        found = np.linalg.solve(whole, np.concatenate([f, -left[0]]))
        return found[:-3], found[-3:]

    def start(self):
        q, qd = np.zeros(3 + 2 * SHAPES), np.zeros(3 + 2 * SHAPES)
        q[:3] = fsolve(lambda x: self.gap(0, np.concatenate([x, q[3:]])), [-0.7, 0.35, 0.2], xtol=1e-14)
        _, by, _ = self.places(self.end, 0, q, qd)
        J = by[0][:, :3].copy()
        J[0, 2] = -1
        _, ways, _ = attitude([0, *q[:2]], [0, 0, 0])
        qd[:3] = np.linalg.solve(J, -PACE * (CRANK * turns(0, 0)[1, :, 1] + LENGTH * ways[0][:, 0]))
        return np.concatenate([q, qd])

    def run(self, tolerance):
        rates = lambda t, state: np.concatenate([np.split(state, 2)[1], self.solve(t, state)[0]])
        return solve_ivp(rates, (0, TIMES[-1]), self.start(), "DOP853", TIMES, rtol=tolerance, atol=1e-2 * tolerance).y.T


def main():
    rod = Rod()
    table, other = rod.run(1e-11), rod.run(1e-9)
    names, n = ["motor", "swing", "tilt", "guide"], 3 + 2 * SHAPES
    print(f"# SciPy's DOP853; coordinates at tolerances of 1e-11 and 1e-9 differ by {abs(table - other)[:, :3].max():.0e}.", file=sys.stderr)
    print("# By reference_flexible_slider_crank.py: the rod is a sum of polynomials in the axes of its pin, with a formulation of its own.")
    print(",".join(["t", *(f"q.{name}" for name in names), *(f"qd.{name}" for name in names), *(f"lambda.wrist.{k}" for k in (1, 2, 3))]))
    for t, state in zip(TIMES, table):
        row = [PACE * t, *state[:3], PACE, *state[n:n + 3]]
        print(",".join([f"{t:g}", *(f"{x:.14g}" for x in row), *(f"{x:.12g}" for x in rod.solve(t, state)[1])]))


if __name__ == "__main__":
    main()
