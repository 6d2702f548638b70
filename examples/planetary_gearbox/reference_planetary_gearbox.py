#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the planetary gearbox: its equations in the angles of sun, arm and planets, written by hand, with SciPy.

    python3 reference_planetary_gearbox.py > reference.csv

All three planets are alike, and their teeth touch on one flank from the start on, so that one planet stands for all.
"""
import math

import numpy as np
from scipy.integrate import solve_ivp

DISTANCE, STIFFNESS, DAMPING, FULL = 0.066, 1.5e8, 1500.0, 40.0
SUN, PLANET, RING = (DISTANCE * teeth / 44 for teeth in (20, 24, 68))
J_SUN, J_ARM, M_PLANET, J_PLANET = 1.2e-3, 0.06, 0.5, 2e-4
END, STEP = 0.1, 0.005


def teeth(state):
    """The forces of one planet's meshes with the sun and the ring: elongations along the pitch circles times stiffness."""
    sun, arm, planet, w_sun, w_arm, w_planet = state
    inner = SUN * (sun - arm) + PLANET * planet, SUN * (w_sun - w_arm) + PLANET * w_planet
    outer = PLANET * planet + RING * arm, PLANET * w_planet + RING * w_arm
    return tuple(STIFFNESS * e + DAMPING * rate for e, rate in (inner, outer))


def rates(t, state):
    w_sun, w_arm, w_planet = state[3:]
    inner, outer = teeth(state)
    motor = FULL * (1 - math.exp(-t / 0.005)) * (1 - w_sun / 300)
    # The planet turns by arm + planet: T = (J_SUN w_sun^2 + (J_ARM + 3 M_PLANET a^2) w_arm^2 + 3 J_PLANET (w_arm + w_planet)^2)/2.
    mass = np.array([[J_SUN, 0, 0], [0, J_ARM + 3 * (M_PLANET * DISTANCE ** 2 + J_PLANET), 3 * J_PLANET], [0, 3 * J_PLANET, 3 * J_PLANET]])
    force = np.array([motor - 3 * SUN * inner, 3 * (SUN * inner - RING * outer) - 2 * w_arm, -3 * PLANET * (inner + outer)])
    return [*state[3:], *np.linalg.solve(mass, force)]


def motion(tolerance):
    times = np.arange(0, END + STEP / 2, STEP)
    done = solve_ivp(rates, (0, END), np.zeros(6), "DOP853", times, rtol=tolerance, atol=1e-3 * tolerance)
    return times, done.y.T


def main():
    times, values = motion(3e-14)
    other = motion(1e-12)[1]
    differ = np.abs(values - other).max(axis=0) / np.abs(values).max(axis=0)
    print(f"# Planetary gearbox with elastic teeth: equations of its own, by reference_planetary_gearbox.py; two tolerances agree to {differ.max():.0e}.")
    names = ("sun", "arm", *(f"planet_{k}" for k in "abc"))
    print(",".join(["t", *(f"q.{name}" for name in names), *(f"qd.{name}" for name in names)]))
    for t, row in zip(times, values):
        q, qd = row[:3], row[3:]
        print(",".join(f"{x:.15g}" for x in (t, *q, q[2], q[2], *qd, qd[2], qd[2])))


if __name__ == "__main__":
    main()
