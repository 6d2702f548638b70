#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the flexible blade by equations of its own, with the nodes of the mesh (needs NumPy and SciPy):

    python3 reference_flexible_blade.py > reference.csv

Both end faces are rigid. Static modes of the outer one and four modes of the blade between both faces are made orthogonal by dense
matrices. A node is at R(angle) (x + phi z), R a rotation about the hinge u. The kinetic energy is J rate^2 / 2 + rate c zd + zd zd / 2,
with J = (u x r) M (u x r) and c = phi M (u x r), which are polynomials of z. Lagrange's equations with the distance of node 313 from
the pin as a constraint are integrated at two tolerances, whose digits agree to 1e-10.
"""
import math

import numpy as np
from mesh_flexible_blade import SIZE, mesh
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq

TIMES = [0.02, 0.05, 0.1, 0.15]
HINGE, CENTRE, CRANK, ROD, PACE, GRAVITY = np.array([0, math.sqrt(3) / 2, 0.5]), np.array([0.5, 0.05, -0.35]), 0.06, 0.32, 40, 9.81
NODE, KEPT, RATIO = 313, 4, 0.01


def modes(nodes, stiffness, mass):
    """Frequencies and displacements (nodes, 3, modes)."""
    wide = np.kron(mass, np.eye(3))
    root, tip = (np.repeat(np.isclose(nodes[:, 0], x), 3) for x in (0, SIZE[0]))
    free = ~(root | tip)
    static = np.zeros((3 * len(nodes), 6))
    for k in np.flatnonzero(tip[::3]):
        x, y, z = nodes[k] - [SIZE[0], 0, 0]
        static[3 * k:3 * k + 3] = [[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]]
    static[free] = -np.linalg.solve(stiffness[np.ix_(free, free)], stiffness[free] @ static)
    held = np.zeros((3 * len(nodes), KEPT))
    held[free] = eigh(stiffness[np.ix_(free, free)], wide[np.ix_(free, free)], subset_by_index=(0, KEPT - 1))[1]
    basis = np.hstack([static, held])
    squares, parts = eigh(basis.T @ stiffness @ basis, basis.T @ wide @ basis)
    phi = basis @ parts
    size = np.abs(phi)
    first = (size > size.max(0) * (1 - 1e-6)).argmax(0)  # the first of the largest ones is positive
    return np.sqrt(squares), (phi * np.sign(phi[first, np.arange(len(squares))])).reshape(len(nodes), 3, -1)


class Blade:
    def __init__(self):
        nodes, stiffness, mass = mesh()
        self.w, phi = modes(nodes, stiffness, mass)
        place, turned = np.cross(HINGE, nodes), np.cross(HINGE, phi, axisb=1, axisc=1)
        moved = np.einsum("ij,jak->iak", mass, turned)
        self.J = np.sum(place * (mass @ place)), 2 * np.einsum("ia,iak->k", place, moved), np.einsum("iak,ial->kl", turned, moved)
        self.c = np.einsum("iak,ij,ja->k", phi, mass, place, optimize=True), np.einsum("iak,ial->kl", phi, moved)
        self.s = mass.sum(0) @ nodes, np.einsum("j,jak->ak", mass.sum(0), phi)
        self.node = nodes[NODE], phi[NODE]

    def turn(self, angle):
        u = np.array([[0, -HINGE[2], HINGE[1]], [HINGE[2], 0, -HINGE[0]], [-HINGE[1], HINGE[0], 0]])
        return np.eye(3) + math.sin(angle) * u + (1 - math.cos(angle)) * u @ u

    def pin(self, t):
        """Place, velocity, acceleration."""
        c, s = CRANK * math.cos(PACE * t), CRANK * math.sin(PACE * t)
        return CENTRE + [c, 0, s], PACE * np.array([-s, 0, c]), PACE**2 * np.array([-c, 0, -s])

    def gap(self, t, angle):
        return np.linalg.norm(self.turn(angle) @ self.node[0] - self.pin(t)[0]) - ROD

    def distance(self, t, q, qd):
        """Gradient of the distance to the pin by the coordinates, and its second derivative without accelerations; its rate less
        that of the coordinates."""
        R, (at, rate, more) = self.turn(q[0]), self.pin(t)
        r, v = self.node[0] + self.node[1] @ q[1:], self.node[1] @ qd[1:]
        way = np.column_stack([R @ np.cross(HINGE, r), R @ self.node[1]])
        d, dd = R @ r - at, way @ qd - rate
        drift = R @ (qd[0]**2 * np.cross(HINGE, np.cross(HINGE, r)) + 2 * qd[0] * np.cross(HINGE, v)) - more
        n = d / np.linalg.norm(d)
        return n @ way, n @ drift + (dd @ dd - (n @ dd)**2) / np.linalg.norm(d), -n @ rate

    def solve(self, t, q, qd):
        """Accelerations, and the multiplier of the distance."""
        z, zd, rate, R = q[1:], qd[1:], qd[0], self.turn(q[0])
        J, slope = self.J[0] + self.J[1] @ z + z @ self.J[2] @ z, self.J[1] + 2 * self.J[2] @ z
        c, s = self.c[0] + self.c[1] @ z, self.s[0] + self.s[1] @ z
        n = len(q)
        A, b = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
        A[0, 0], A[0, 1:n], A[1:n, 0], A[1:n, 1:n] = J, c, c, np.eye(n - 1)
        b[0] = -rate * slope @ zd - GRAVITY * (R @ np.cross(HINGE, s))[2]
        b[1:n] = rate**2 * slope / 2 - 2 * rate * self.c[1] @ zd - self.w**2 * z - 2 * RATIO * self.w * zd - GRAVITY * R[2] @ self.s[1]
        row, drift, _ = self.distance(t, q, qd)
        A[n, :n], A[:n, n], b[n] = row, -row, -drift
        x = np.linalg.solve(A, b)
        return x[:n], x[n]

    def motion(self, rtol):
        q, qd = np.zeros(1 + len(self.w)), np.zeros(1 + len(self.w))
        q[0] = brentq(lambda angle: self.gap(0, angle), 0, 0.3, xtol=1e-15)
        row, _, own = self.distance(0, q, qd)
        qd[0] = -own / row[0]
        n = len(q)
        run = solve_ivp(lambda t, y: np.concatenate([y[n:], self.solve(t, y[:n], y[n:])[0]]), (0, TIMES[-1]), np.concatenate([q, qd]),
                        "DOP853", TIMES, rtol=rtol, atol=1e-15)
        return [(t, *y[:4], *y[n:n + 4], self.solve(t, y[:n], y[n:])[1] / ROD) for t, y in zip(run.t, run.y.T)]


def main():
    blade = Blade()
    coarse, fine = blade.motion(1e-11), blade.motion(1e-12)
    apart = max(abs(a - b) for x, y in zip(coarse, fine) for a, b in zip(x, y))
    assert apart < 1e-6, apart
    print("# By reference_flexible_blade.py: the nodes of the mesh, and Lagrange's equations. Digits of two runs agree to 1e-10.")
    names = ["hinge", "blade.mode1", "blade.mode2", "blade.mode3"]
    print(",".join(["t", *(f"{what}.{name}" for what in ("q", "qd") for name in names), "lambda.rod.1"]))
    for row in fine:
        print(",".join(f"{x:.11g}" for x in row))


if __name__ == "__main__":
    main()
