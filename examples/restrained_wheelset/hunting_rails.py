#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Limit cycles of the wheelset on rails in space, with bounded creep forces, from the equations of rails.py.

    python3 hunting_rails.py > hunting.csv

At a speed the wheelset runs over two periods from the shape of its slow mode. All other modes decay within the first one. The
lateral speeds at both ends of the second one are equal in a limit cycle: the secant method finds the speed at which they are.
Runs by SciPy. The load that keeps the speed is its mean over the second period.
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
    y = way.sol(np.linspace(0, period, 2001))[0]
    k = int(np.argmax(y))
    a, b, c = y[k - 1:k + 2]
    return end[1:5], period, b - (c - a) ** 2 / (8 * (a - 2 * b + c)), end[5] / period


def growth(wheelset, speed, start):
    """Of the lateral speed over a period, and the period's results."""
    first, *_ = run(wheelset, speed, start)
    second, *found = run(wheelset, speed, first)
    return second[1] / first[1] - 1, found


def cycle(wheelset, speed, start):
    """The speed of a limit cycle near a start, between a speed and the next ones, and its results."""
    low, high = speed, speed + 0.1
    (at_low, _), (at_high, found) = growth(wheelset, low, start), growth(wheelset, high, start)
    for _ in range(10):
        low, high, at_low = high, high - at_high * (high - low) / (at_high - at_low), at_high
        at_high, found = growth(wheelset, high, start)
        if abs(at_high) < 1e-7:
            return high, found
    raise ArithmeticError("no limit cycle is found")


if __name__ == "__main__":
    w = Wheelset(0.05, friction=FRICTION)
    critical, rate = w.critical(95, 108)
    print("# The wheelset on rails with friction 0.1, by hunting_rails.py: limit cycles; the first row is the critical speed.")
    print("speed,period,amplitude,load", flush=True)
    print(f"{critical:.9g},{2 * np.pi / rate:.9g},0,", flush=True)
    values, vectors = np.linalg.eig(w.jacobian(critical))
    mode = vectors[:, np.argmax(values.imag)]
    mode = mode / mode[2]  # of y, yaw, their rates, x', spin': where y' is 1 y is 0
    w.drive, speed = True, critical
    for amplitude in (2e-3, 3.5e-3):
        fast = amplitude * rate
        start = np.array([fast * mode[1].real, fast, fast * mode[3].real, speed / w.r0])
        speed, (period, reached, load) = cycle(w, speed, start)
        print(f"{speed:.9g},{period:.9g},{reached:.9g},{load:.9g}", flush=True)
