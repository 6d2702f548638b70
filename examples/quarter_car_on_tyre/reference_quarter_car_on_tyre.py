#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the quarter car on a tyre: Newton's equations in the plane with the pure longitudinal Magic Formula, with SciPy.

    python3 reference_quarter_car_on_tyre.py > reference.csv

Pieces of the motion end where the bump begins and ends. The formula is Pacejka 2012, equations 4.E9 to 4.E18, with the coefficients of
passenger_car_tyre.tir.
"""
import math

import numpy as np
from scipy.integrate import solve_ivp

BODY, UNSPRUNG, SPIN, GRAVITY = 350.0, 45.0, 0.9, 9.81
SPRING, DAMPER, REST = 20000.0, 1500.0, -0.37
RADIUS, STIFFNESS, DAMPING, NOMINAL = 0.313, 2e5, 50.0, 4000.0
RELAXATION, LOW = 0.15, 0.1
FROM, LENGTH, HEIGHT = 2.0, 1.2, 0.03
END, STEP = 1.0, 0.02


def bump(x, on):
    """Height of the road and two derivatives."""
    if not on:
        return 0.0, 0.0, 0.0
    w, a = 2 * math.pi / LENGTH, 2 * math.pi * (x - FROM) / LENGTH
    return HEIGHT * (1 - math.cos(a)) / 2, HEIGHT * w * math.sin(a) / 2, HEIGHT * w * w * math.cos(a) / 2


def longitudinal(load, kappa):
    """F_x of pure slip."""
    d = (load - NOMINAL) / NOMINAL
    x = kappa - 0.002 + 0.002 * d
    most = (1.210 - 0.037 * d) * load
    bent = 0.344 + 0.095 * d - 0.020 * d * d
    b = load * (21.51 - 0.163 * d) * math.exp(0.245 * d) / (1.685 * most) * x
    return most * math.sin(1.685 * math.atan(b - bent * (b - math.atan(b))))


def rates(t, state, on):
    x, body, wheel, turned, vx, vbody, vwheel, spin, kappa = state
    height, slope, curvature = bump(x, on)
    root = math.sqrt(1 + slope * slope)
    normal, ahead = np.array([-slope, 1.0]) / root, np.array([1.0, slope]) / root
    radius = (wheel - height) / root
    closing = -((vwheel - slope * vx) / root - (wheel - height) * slope * curvature * vx / root**3)
    depth = RADIUS - radius
    load = STIFFNESS * depth + DAMPING * closing
    forwards = ahead @ [vx, vwheel]
    speed = math.hypot(forwards, LOW)
    along = longitudinal(load, kappa)
    moment = -0.01 * load * RADIUS * forwards / speed
    force = load * normal + along * ahead
    pull = SPRING * (wheel - body - REST) + DAMPER * (vwheel - vbody)
    slip = (spin * (RADIUS - depth / 3) - forwards - speed * kappa) / RELAXATION
    return [vx, vbody, vwheel, spin, force[0] / (BODY + UNSPRUNG), pull / BODY - GRAVITY, (force[1] - pull) / UNSPRUNG - GRAVITY,
            (moment - radius * along) / SPIN, slip]


def motion(tolerance):
    times = np.arange(0, END + STEP / 2, STEP)
    state, t, values = [0, 0.493, 0.293, 0, 10, 0, 0, 10 / 0.3063, 0], 0.0, np.empty((len(times), 9))
    values[0] = state
    for on, edge in ((False, FROM), (True, FROM + LENGTH), (False, math.inf)):
        def ends(t, y, on, edge=edge):
            return y[0] - min(edge, 1e3)
        ends.terminal = True
        done = solve_ivp(rates, (t, END), state, "DOP853", args=(on,), rtol=tolerance, atol=tolerance, events=ends, dense_output=True, max_step=5e-3)
        inside = (times > t) & (times <= done.t[-1])
        if inside.any():
            values[inside] = done.sol(times[inside]).T
        t, state = done.t[-1], done.y[:, -1]
    return times, values


def main():
    times, values = motion(3e-14)
    differ = np.abs(values - motion(1e-12)[1]).max()
    print(f"# Quarter car on a tyre: equations of its own, by reference_quarter_car_on_tyre.py; two tolerances agree to {differ:.0e}.")
    print("t,q.x,q.z,q.u,q.spin,qd.x,qd.z,qd.u,qd.spin")
    for t, (x, z, w, a, vx, vz, vw, spin, _) in zip(times, values):
        print(",".join(f"{value:.15g}" for value in (t, x, z, w - z, a, vx, vz, vw - vz, spin)))


if __name__ == "__main__":
    main()
