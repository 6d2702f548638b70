#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes blade_four_bar.csv: the four-bar of blade_peers.py, whose coupler is a Craig-Bampton blade. Velocities of all nodes and the
consistent mass between them give mass matrix and inertia forces at each state; SciPy's DOP853 integrates. Needs NumPy and SciPy, and takes
some minutes.

    python3 bench/peers/blade_four_bar.py > bench/peers/blade_four_bar.csv
"""
import pathlib
import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import blade_peers as peer  # noqa: E402

FILE = peer.flexible_files.blade()
X, PHI = FILE["nodes"], FILE["modes"]                     # (p, 3), (p, 3, n)
COUNT, MODES = PHI.shape[0], PHI.shape[2]
MASS = np.zeros((COUNT, COUNT))
np.add.at(MASS, (FILE["mass_row"], FILE["mass_col"]), FILE["mass_value"])
STIFF = np.diag(FILE["K"])
DAMPING = 0.02 * np.sqrt(STIFF)
END = peer.MIDDLE
UNIT = np.array([[1, 0, 0], [0, 0, 0], [0, 0, 1.0]])      # the plane of x and z
TURN = np.array([[0, 0, -1], [0, 0, 0], [1, 0, 0.0]])     # a quarter from x to z


def axes(angle):
    """The turn from x to z, its first and second derivative."""
    c, s = np.cos(angle), np.sin(angle)
    return np.diag([0, 1.0, 0]) + c * UNIT + s * TURN, -s * UNIT + c * TURN, -c * UNIT - s * TURN


def arm(length, angle):
    return [length * R[:, 0] for R in axes(angle)]


def rates(_t, state):
    """Coordinates: absolute angles of crank, blade and rocker, then modes."""
    q, v = np.split(state, 2)
    (_, a1, a2), (R, R1, R2), (_, c1, c2) = arm(peer.CRANK, q[0]), axes(q[1]), arm(peer.ROCKER, q[2])
    u, ud = X + PHI @ q[3:], PHI @ v[3:]
    by = np.zeros((COUNT, 3, 3 + MODES))                  # velocities of the nodes by rates
    by[:, :, 0], by[:, :, 1], by[:, :, 3:] = a1, u @ R1.T, R @ PHI
    left = a2 * v[0]**2 + u @ R2.T * v[1]**2 + 2 * v[1] * ud @ R1.T # of accelerations, without those of coordinates
    moved = (MASS @ by.reshape(COUNT, -1)).reshape(by.shape)
    M = np.einsum("pak,pal->kl", by, moved)
    M[0, 0] += peer.CRANK_INERTIA
    M[2, 2] += peer.ROCKER_INERTIA
    force = -np.einsum("pak,pa->k", moved, left)
    force[3:] -= STIFF * q[3:] + DAMPING * v[3:]
    J = by[END].copy()
    J[:, 2] = -c1
    J, back = J[[0, 2]], (left[END] - c2 * v[2]**2)[[0, 2]]
    whole = np.block([[M, J.T], [J, np.zeros((2, 2))]])
    return np.concatenate([v, np.linalg.solve(whole, np.concatenate([force, -back]))[:3 + MODES]])


def start():
    """The loop closed at the given crank, with its rates, without deformation."""
    def gap(angles):
        return (arm(peer.CRANK, np.pi / 2)[0] + axes(angles[0])[0] @ X[END] - [peer.GROUND, 0, 0] - arm(peer.ROCKER, angles[1])[0])[[0, 2]]
    blade, rocker = fsolve(gap, np.radians([20, 100]), xtol=1e-14)
    J = np.column_stack([axes(blade)[1] @ X[END], -arm(peer.ROCKER, rocker)[1]])[[0, 2]]
    turning = np.linalg.solve(J, -peer.RATE * arm(peer.CRANK, np.pi / 2)[1][[0, 2]])
    return np.concatenate([[np.pi / 2, blade, rocker], np.zeros(MODES), [peer.RATE, *turning], np.zeros(MODES)])


def places(rtol):
    instants = np.linspace(0, peer.END, 16)
    found = solve_ivp(rates, (0, peer.END), start(), method="DOP853", rtol=rtol, atol=1e-14, t_eval=instants).y.T
    return np.column_stack([instants, [arm(peer.CRANK, y[0])[0] + axes(y[1])[0] @ (X[END] + PHI[END] @ y[3:3 + MODES]) for y in found]])


if __name__ == "__main__":
    coarse, fine = places(1e-11), places(1e-13)
    print(f"# By blade_four_bar.py, from the nodes of the blade; two tolerances differ by {abs(coarse - fine).max():.0e} m.")
    print("t,x,y,z")
    for row in fine:
        print(",".join([f"{row[0]:.2f}"] + [f"{x:.15g}" for x in row[1:]]))
