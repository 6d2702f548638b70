#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the slider-crank whose slider is loose in its guide, from equations of its own. Needs numpy and scipy.

    python3 reference_loose_slider.py > reference.csv

The pin of the slider is at its centre of mass and on the rod, whose other end moves as prescribed. The angles of rod and slider have
one equation each: for the rod the moment about the crank's pin of the forces on rod and slider, for the slider that of its corners.
DOP853 of SciPy is restarted where a corner begins or ends to touch; runs at two tolerances agree to the digits written.
"""
import math

import numpy as np
from scipy.integrate import solve_ivp

SPEED = 1500 * math.pi / 30
CRANK, ROD, CENTRE, MASS, INERTIA = 0.05, 0.12, 0.06, 0.21, 2.5e-4
SLIDER, SLIDER_INERTIA, LENGTH, HEIGHT, CLEARANCE = 0.14, 5e-5, 0.06, 0.03, 0.2e-3
STIFFNESS, DAMPING, FRICTION, SLOW, GRAVITY = 2e9, 0.3, 0.05, 0.01, 9.81
CORNERS = [(a * LENGTH / 2, b * HEIGHT / 2) for a in (1, -1) for b in (1, -1)]
MOMENT = INERTIA + MASS * CENTRE ** 2 + SLIDER * ROD ** 2  # about the crank's pin
FIRST = 1e-10  # s: of the first step after a change


def pin(t, y):
    """Place and rate of the slider's pin."""
    phi, phid = y[0], y[2]
    at = CRANK * np.array([math.cos(SPEED * t), math.sin(SPEED * t)]) + ROD * np.array([math.cos(phi), math.sin(phi)])
    rate = CRANK * SPEED * np.array([-math.sin(SPEED * t), math.cos(SPEED * t)]) + ROD * phid * np.array([-math.sin(phi), math.cos(phi)])
    return at, rate


def corner(t, y, k):
    """Its lever from the pin, its rate, and its depth with the rate of that."""
    c, s = math.cos(y[1]), math.sin(y[1])
    a, b = CORNERS[k]
    lever = np.array([c * a - s * b, s * a + c * b])
    at, rate = pin(t, y)
    rate = rate + y[3] * np.array([-lever[1], lever[0]])
    side = math.copysign(1, b)
    return lever, rate, side * (at[1] + lever[1]) - HEIGHT / 2 - CLEARANCE, side * rate[1]


def rates(t, y, touching):
    load, moment = np.array([0, -SLIDER * GRAVITY]), 0.0
    for k in touching:
        lever, rate, depth, approach = corner(t, y, k)
        normal = STIFFNESS * abs(depth) ** 1.5 * (1 + DAMPING * approach)
        force = np.array([-FRICTION * normal * rate[0] / math.sqrt(rate[0] ** 2 + SLOW ** 2), -math.copysign(normal, CORNERS[k][1])])
        load, moment = load + force, moment + lever[0] * force[1] - lever[1] * force[0]
    c, s = math.cos(y[0]), math.sin(y[0])
    end = -CRANK * SPEED ** 2 * np.array([math.cos(SPEED * t), math.sin(SPEED * t)])  # acceleration of the crank's pin
    cross = lambda f: c * f[1] - s * f[0]  # moment of a force at distance 1 along the rod
    turn = ROD * cross(load) - MASS * CENTRE * (c * GRAVITY + cross(end)) - SLIDER * ROD * cross(end)
    return np.array([y[2], y[3], turn / MOMENT, moment / SLIDER_INERTIA])


def begins(t, y, k, touching):
    """True for a corner that reaches its side together with another one, but for rounding."""
    depth, approach = corner(t, y, k)[2:]
    return k not in touching and depth > -1e-15 and approach > 0


def motion(end, tolerance):
    """Pieces (from, to, dense solution) with the same corners in contact."""
    t, y, touching, pieces = 0.0, np.array([0, 0, -CRANK * SPEED / ROD, 0.0]), (), []
    while t < end:
        changes = []
        for k in range(4):
            depth = lambda t, y, _, k=k: corner(t, y, k)[2]
            depth.terminal, depth.direction = True, -1 if k in touching else 1
            changes.append(depth)
        run = solve_ivp(rates, (t, end), y, "DOP853", events=changes, dense_output=True, rtol=tolerance, atol=tolerance * 1e-4,
                        first_step=FIRST, args=(touching,))
        pieces.append((t, run.t[-1], run.sol))
        t, y = run.t[-1], run.y[:, -1]
        touching = tuple(k for k in range(4) if (k in touching) != (len(run.t_events[k]) > 0 or begins(t, y, k, touching)))
    return pieces


def main():
    ends = [k * 0.001 for k in range(1, 11)]
    fine, coarse = (motion(ends[-1], tolerance) for tolerance in (3e-14, 1e-12))
    value = lambda pieces, t: next(sol(t) for a, b, sol in pieces if a <= t <= b)
    off = max(np.max(np.abs((value(fine, t) - value(coarse, t)) / [1, 1, 100, 100])) for t in ends)
    digits = -math.ceil(math.log10(off))
    print("# Slider-crank with a loose guide: equations of its own, contacts located, by reference_loose_slider.py; two tolerances agree "
          f"to 1e-{digits}.")
    print("t,q.A,q.B,q.P,qd.B,qd.P")
    for t in ends:
        phi, angle, phid, turning = value(fine, t)
        print(",".join(f"{v:.13g}" for v in (t, SPEED * t, phi - SPEED * t, angle - phi, phid - SPEED, turning - phid)))


if __name__ == "__main__":
    main()
