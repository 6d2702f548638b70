#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Limit cycles of the wheelset on rails in space, with bounded creep forces, from the equations of rails.py.

    python3 hunting_rails.py > hunting.csv

A cycle is found by Newton's method for the state at the instant where the axle passes the middle, and for the speed, at
a given yaw rate there. Runs by SciPy, over one period; slopes by central differences. The largest real multiplier, and the
mean of the load that keeps the speed.
"""
import numpy as np
from rails import Wheelset
from scipy.integrate import solve_ivp

FRICTION = 0.1


def run(wheelset, speed, start):
    """From y = 0 at yaw, y', yaw', spin' until y = 0 again in the same direction: its state, time, amplitude, mean load."""

    def rates(t, u):
        q, qd = wheelset.closed([speed * t, u[0], u[1], 0], [speed, u[2], u[3], u[4]])
        x = wheelset.accelerations(q, qd)
        return [u[2], u[3], x[1], x[3], x[5], x[0]]

    def passes(t, u):
        return u[0] if t > 0.02 else 1e-3

    passes.terminal, passes.direction = True, 1
    way = solve_ivp(rates, (0, 1), [0.0, *start, 0.0], method="DOP853", rtol=1e-9, atol=1e-11, events=passes, dense_output=True)
    end, period = way.y_events[0][0], way.t_events[0][0]
    times = np.linspace(0, period, 2001)
    y = way.sol(times)[0]
    k = int(np.argmax(y))
    a, b, c = y[k - 1:k + 2]
    return end[1:5], period, b - (c - a) ** 2 / (8 * (a - 2 * b + c)), end[5] / period


def cycle(wheelset, speed, start, fixed):
    """With y' = fixed at the start: unknown are yaw, yaw', spin' there and the speed."""
    z = np.array([start[0], start[2], start[3], speed])
    sizes = np.array([1e-5, 1e-3, 1e-2, 1e-2])

    def gap(z):
        state = np.array([z[0], fixed, z[1], z[2]])
        end, *found = run(wheelset, z[3], state)
        return end - state, found

    here, found = gap(z)
    slope = np.array([(gap(z + h * e)[0] - here) / h for h, e in zip(sizes, np.eye(4))]).T
    for _ in range(12):
        step = np.linalg.solve(slope, here)
        z = z - step
        here, found = gap(z)
        if (abs(step) < 1e-4 * sizes).all():
            break
    return z, found


if __name__ == "__main__":
    w = Wheelset(0.05, friction=FRICTION)
    critical, rate = w.critical(95, 108)
    print("# The wheelset on rails with friction 0.1, by hunting_rails.py: limit cycles; the first row is the critical speed.")
    print("speed,period,amplitude,load", flush=True)
    print(f"{critical:.9g},{2 * np.pi / rate:.9g},0,", flush=True)
    values, vectors = np.linalg.eig(w.jacobian(critical))
    mode = vectors[:, np.argmax(values.imag)]
    mode = mode / mode[2]  # of y, yaw, their rates, x', spin': y' is 1, and y then 0
    w.drive, speed = True, critical
    for amplitude in (2e-3, 3.5e-3):
        fixed = amplitude * rate
        guess = np.array([fixed * mode[1].real, fixed, fixed * mode[3].real, speed / w.r0])
        (_, _, _, speed), (period, reached, load) = cycle(w, speed, guess, fixed)
        print(f"{speed:.9g},{period:.9g},{reached:.9g},{load:.9g}", flush=True)
