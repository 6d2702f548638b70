#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Cooperrider's complex bogie by NumPy and SciPy: eigenvalues, a motion, and limit cycles over the speed.

    python3 reference_cooperrider.py > reference.csv
    python3 reference_cooperrider.py cycles > cycles.csv

The equations are written out here for seven coordinates: y and yaw of the front wheelset, of the rear one, y, yaw and roll of
the frame (N. K. Cooperrider, J. Eng. Ind. 94 (1972) 752; C. Kaas-Petersen, Acta Mech. 61 (1986) 89). The critical speed is that at
which a pair of eigenvalues crosses the imaginary axis. A limit cycle is symmetric: after half a period all signs are reversed.
Newton's method finds its state, period and speed for a given amplitude of the front wheelset.
"""
import csv
import pathlib
import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

MW, IW, MF, IF = 1022, 678, 2918, 6780
A, B, D1, D2, H1, H2 = 0.716, 1.074, 0.620, 0.680, 0.0762, 0.6584
R0, CONICITY = 0.4572, 0.05
K1, K2, K3, K4, K5, K6 = 1.823e6, 3.646e6, 3.646e6, 0.1823e6, 0.3333e6, 2.710e6
DAMPER1, DAMPER2 = 20e3, 29.2e3
CREEP, PSI, PHI, LIMIT = 6.563e6, 0.54219, 0.60252, 0.15 * 66670
CLEARANCE, FLANGE = 9.1e-3, 14.60e6
MASS = np.array([MW, IW, MW, IW, MF, IF, IF], float)
COORDINATES = ("y1", "yaw1", "y2", "yaw2", "y3", "yaw3", "roll")


def creep_forces(across, along):
    """By Vermeulen and Johnson: the resultant saturates at the limit."""
    u = CREEP / LIMIT * np.hypot(across / PSI, along / PHI)
    share = 1 - u / 3 + u * u / 27 if u < 3 else 1 / u
    return CREEP * share * across / PSI, CREEP * share * along / PHI


def linear_creep_forces(across, along):
    return CREEP * across / PSI, CREEP * along / PHI


def flange(y):
    return FLANGE * (y - min(CLEARANCE, max(-CLEARANCE, y)))


def slope(speed, x, creep=creep_forces):
    """Rates of x = (q, qd)."""
    q1, q2, q3, q4, q5, q6, q7, v1, v2, v3, v4, v5, v6, v7 = x
    a1 = 2 * K1 * (q1 - q5 - B * q6 - H1 * q7)
    a2 = 2 * K1 * (q3 - q5 + B * q6 - H1 * q7)
    a3 = 2 * K2 * D1**2 * (q2 - q6)
    a4 = 2 * K2 * D1**2 * (q4 - q6)
    a5 = 2 * DAMPER2 * (v5 - H2 * v7) + 2 * K4 * (q5 - H2 * q7)
    a6 = K6 * q6
    a7 = 2 * DAMPER1 * D2**2 * v7 + 2 * K5 * D2**2 * q7 + 4 * K3 * D1**2 * q7
    across1, along1 = creep(v1 / speed - q2, A * v2 / speed + CONICITY * q1 / R0)
    across2, along2 = creep(v3 / speed - q4, A * v4 / speed + CONICITY * q3 / R0)
    force = np.array([-a1 - 2 * across1 - flange(q1), -a3 - 2 * A * along1, -a2 - 2 * across2 - flange(q3), -a4 - 2 * A * along2,
                      a1 + a2 - a5, B * (a1 - a2) + a3 + a4 - a6, H1 * (a1 + a2) + H2 * a5 - a7])
    return np.concatenate([x[7:], force / MASS])


# -- the bogie running straight ahead ---------------------------------------------------------------------------------------------


def eigenvalues(speed):
    """Of the equations without flanges and with creep forces that are linear: differences of a linear function are exact."""
    unit = np.eye(14)
    return np.linalg.eigvals(np.array([slope(speed, CLEARANCE * x, linear_creep_forces) / CLEARANCE for x in unit]).T)


def critical_speed():
    return brentq(lambda speed: eigenvalues(speed).real.max(), 60, 75, xtol=1e-12, rtol=1e-14)


def flow(x, duration, speed):
    """The state after a duration."""
    return solve_ivp(lambda _, y: slope(speed, y), (0, duration), x, method="DOP853", rtol=1e-12, atol=1e-15).y[:, -1]


# -- limit cycles -----------------------------------------------------------------------------------------------------------------


def cycle(move, amplitude, guess):
    """(state, period, speed) of the limit cycle with q1 = amplitude, qd1 = 0 at its beginning, by Newton's method from a guess.

    move(state, duration, speed): the state after a duration."""
    free = [k for k in range(14) if k not in (0, 7)]
    scale = np.array([1e-3 if k < 7 else 1e-2 for k in free] + [0.1, 10.0])
    z = np.concatenate([guess[0][free], [guess[1], guess[2]]]) / scale

    def miss(z):
        x = np.zeros(14)
        x[0] = amplitude
        x[free] = (z * scale)[:12]
        period, speed = (z * scale)[12:]
        return (move(x, period / 2, speed) + x) / np.repeat([1e-3, 1e-2], 7), x, period, speed

    for _ in range(12):
        f, x, period, speed = miss(z)
        jacobian = np.empty((14, 14))
        for k in range(14):
            step = np.zeros(14)
            step[k] = 1e-5
            jacobian[:, k] = (miss(z + step)[0] - miss(z - step)[0]) / 2e-5
        change = np.linalg.solve(jacobian, -f)
        z = z + change
        if np.abs(change).max() < 1e-9:
            return miss(z)[1:]
    raise ArithmeticError(f"no limit cycle is found at an amplitude of {1e3 * amplitude} mm")


def first_guess(move, speed, amplitude):
    """The state at a maximum of q1 on the stable limit cycle, which a long motion approaches, and the period."""
    x, step = np.zeros(14), 1e-3
    x[0] = amplitude
    x = move(x, 20.0, speed)
    before, maxima = x, []
    for k in range(2000):
        after = move(before, step, speed)
        if before[7] > 0 >= after[7]:
            maxima.append((step * (k + before[7] / (before[7] - after[7])), after))
        before = after
    period = (maxima[-1][0] - maxima[0][0]) / (len(maxima) - 1)
    return maxima[-1][1], period, speed


def branch(move, start, amplitudes):
    """Limit cycles for amplitudes one after another; the guess of each is the one before."""
    found = [start]
    for amplitude in amplitudes:
        found.append(cycle(move, amplitude, found[-1]))
    return found[1:]


AMPLITUDES = [1e-3 * x for x in (10.194, 10, 9.744, 9.6, 9.45, 9.355, 9.25, 9.144, 9, 8.494, 8, 7, 6, 5, 4, 2.994, 2, 1, 0.5)]


def extremes(move, found):
    """Largest q1, q3 and q5 of a limit cycle."""
    x, period, speed = found
    most = np.abs(x[[0, 2, 4]])
    rows = [x]
    for _ in range(200):
        rows.append(move(rows[-1], period / 400, speed))
    for i, k in enumerate((0, 2, 4)):
        y = np.abs([row[k] for row in rows])
        at = int(y.argmax())
        # the parabola through the largest value and its neighbours, which repeat with the other sign
        left, middle, right = y[at - 1] if at > 0 else y[-2], y[at], y[at + 1] if at < 200 else y[1]
        bend = left - 2 * middle + right
        most[i] = middle - (right - left) ** 2 / (8 * bend) if bend < 0 else middle
    return most


def fold(move, near):
    """The limit cycle of the lowest speed."""
    def speed(amplitude):
        return cycle(move, amplitude, near)[2]

    best = minimize_scalar(speed, bounds=(9.3e-3, 9.4e-3), method="bounded", options={"xatol": 1e-9})
    return cycle(move, best.x, near)


def table(move):
    """The branches, the fold among them, in the order of their amplitudes."""
    start = cycle(move, AMPLITUDES[0], first_guess(move, 70.0, 12e-3))
    found = [start, *branch(move, start, AMPLITUDES[1:])]
    nearest = min(found, key=lambda c: c[2])
    found.append(fold(move, nearest))
    return sorted(found, key=lambda c: -c[0][0])


def write_cycles(move, critical, out):
    w = csv.writer(out, lineterminator="\n")
    w.writerow(["y1 [mm]", "V [m/s]", "T [s]", "y2 [mm]", "y3 [mm]"])
    for found in table(move):
        q1, q3, q5 = 1e3 * extremes(move, found)
        w.writerow([f"{1e3 * found[0][0]:.6f}", f"{found[2]:.6f}", f"{found[1]:.7f}", f"{q3:.4f}", f"{q5:.4f}"])
    speed, omega = critical
    w.writerow(["0", f"{speed:.9f}", f"{2 * np.pi / omega:.10f}", "0", "0"])


if __name__ == "__main__":
    if sys.argv[1:] == ["cycles"]:
        speed = critical_speed()
        print("# Limit cycles of the bogie by reference_cooperrider.py: amplitudes, speed, period; the last row is the critical speed.")
        write_cycles(flow, (speed, abs(max(eigenvalues(speed), key=lambda s: s.real).imag)), sys.stdout)
    else:
        print("# The motion at 60 m/s from a displacement of the front wheelset by 5 mm, by reference_cooperrider.py.")
        print("t," + ",".join(f"q.{c}" for c in COORDINATES) + "," + ",".join(f"qd.{c}" for c in COORDINATES))
        x = np.zeros(14)
        x[0] = 5e-3
        for k in range(31):
            print(f"{0.1 * k:.1f}," + ",".join(f"{v:.15e}" for v in x))
            x = flow(x, 0.1, 60.0)
