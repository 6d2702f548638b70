#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the crane: Newton's equation of the hook with the tension that the rope's length needs, with SciPy.

    python3 reference_crane.py > reference.csv

The rope pulls the hook along both of its spans, which are tangents of circles. The tension follows from the second derivative of the
path's length. Derivatives along the velocity are taken with an imaginary step.
"""
import cmath
import math

import numpy as np
from scipy.integrate import solve_ivp

SHEAVE, DRUM, TEETH, MASS, GRAVITY, FULL, RISE = 0.2, 0.15, 40, 800.0, 9.81, 60.0, 0.4
TIP, ANCHOR = np.array([0.0, 0.0]), np.array([3 * SHEAVE, 0.0])
START = np.array([2 * SHEAVE + 0.6, -6.0])
END, STEP = 10.0, 0.25


def worm(t):
    """Angle, rate and acceleration of the worm."""
    fade = math.exp(-t / RISE)
    return FULL * (t - RISE * (1 - fade)), FULL * (1 - fade), FULL * fade / RISE


def along(a, b, offset):
    """The direction of a common tangent of circles about a and b, turned against the line of centres by -asin(offset/distance)."""
    d = b - a
    square = d[0] * d[0] + d[1] * d[1]
    c, s = cmath.sqrt(square - offset * offset), offset
    return np.array([d[0] * c + d[1] * s, d[1] * c - d[0] * s]) / square


def pull(place):
    """Sum of the directions of both spans, from the hook."""
    return along(place, ANCHOR, -SHEAVE) - along(TIP, place, 2 * SHEAVE)


def rates(t, state):
    place, v = state[:2], state[2:]
    n = pull(place).real
    turning = pull(place + 1e-30j * v).imag / 1e-30
    shortening = DRUM / TEETH * worm(t)[2]  # n.v is the rate at which the path becomes shorter
    weight = np.array([0.0, -GRAVITY])
    tension = MASS * (shortening - turning @ v - n @ weight) / (n @ n)
    return [*v, *(tension / MASS * n + weight)]


def motion(tolerance):
    times = np.arange(0, END + STEP / 2, STEP)
    done = solve_ivp(rates, (0, END), [*START, 0, 0], "DOP853", times, rtol=tolerance, atol=tolerance)
    return times, done.y.T


def main():
    times, values = motion(3e-14)
    differ = np.abs(values - motion(1e-12)[1]).max()
    print(f"# Crane: equations of its own, by reference_crane.py; two tolerances agree to {differ:.0e}.")
    print("t,q.worm,q.drum,q.x,q.z,qd.worm,qd.drum,qd.x,qd.z")
    for t, (x, z, vx, vz) in zip(times, values):
        angle, rate, _ = worm(t)
        print(",".join(f"{value:.15g}" for value in (t, angle, angle / TEETH, x, z, rate, rate / TEETH, vx, vz)))


if __name__ == "__main__":
    main()
