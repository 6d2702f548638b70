#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the toggle press, from its energy alone (needs mpmath):

    examples/toggle_press/reference_toggle_press.py > examples/toggle_press/reference.csv

The angle u of both links from the vertical is the only freedom, T = I(u) u'^2/2 and all forces have a potential V(u). Between
impacts u'^2 = 2 (E - V)/I, and t is a quadrature. At an impact E - V is multiplied by restitution^2. After enough impacts that
the rest takes less than 1e-15 s the ram stays, and the anvil's force balances the slope of V.
"""
from mpmath import cos, findroot, mp, mpf, pi, quad, sin, sqrt

mp.dps = 30
L, LINK, RAM, FORCE, G, E = mpf("0.3"), mpf(2), mpf(8), mpf(400), mpf("9.81"), mpf("0.4")
START, STOP, WEIGHT = pi / 3, 8 * pi / 180, (2 * LINK + 2 * RAM) * G
TIMES = ("0.05", "0.1", "0.15", "0.17", "0.2", "0.21", "0.22", "0.225", "0.23", "0.5", "1")


def inertia(u):
    upper, lower = LINK * L**2 / 3, LINK * ((L * cos(u) / 2)**2 + (3 * L * sin(u) / 2)**2 + L**2 / 12)
    return upper + lower + RAM * (2 * L * sin(u))**2


def slope(u):
    return FORCE * L * cos(u) + WEIGHT * L * sin(u)


def between(low, rise):
    """V(low + rise) - V(low), without cancellation."""
    return 2 * sin(rise / 2) * slope(low + rise / 2)


def passage(top, fall):
    """Time from rest at `top` down by an angle: with top - s^2 there is no singular end."""
    return quad(lambda s: 2 * s / sqrt(2 * between(top - s * s, s * s) / inertia(top - s * s)), [0, sqrt(fall)])


def flights():
    """(time at the top, height of the top in u, half the duration) of each flight, and the time of the last impact. The
    first flight begins at its top."""
    time, rise, found = mpf(0), START - STOP, []
    while True:
        half = passage(STOP + rise, rise)
        found.append((time, rise, half))
        time += half
        energy = E**2 * between(STOP, rise)
        rise = findroot(lambda x: between(STOP, x) - energy, (E**2 * rise / 2, E**2 * rise))
        half = passage(STOP + rise, rise)
        if half < mpf(10)**-17:
            return found, time
        time += half


def row(t, u, rate, force):
    q = (u - pi / 2, -2 * u, -2 * L * cos(u))
    qd = (rate, -2 * rate, 2 * L * sin(u) * rate)
    print(",".join([t, *(mp.nstr(x, 17, strip_zeros=False) for x in (*q, *qd, force))]))


def state(found, end, t):
    """u, its rate and the anvil's force."""
    if t >= end:
        return STOP, mpf(0), slope(STOP) / (2 * L * sin(STOP))
    at, rise, half = max((f for f in found if f[0] - f[2] <= t or f[0] == 0), key=lambda f: f[0])
    away, top = abs(t - at), STOP + rise
    guess = rise * (away / half)**2
    fall = findroot(lambda x: passage(top, x) - away, (guess * mpf("0.99"), guess))
    u = top - fall
    rate = sqrt(2 * between(u, fall) / inertia(u))
    return u, -rate if t >= at else rate, mpf(0)


def main():
    found, end = flights()
    print("# Quadrature of the energy between impacts, 30 digits, by reference_toggle_press.py.")
    print("t,q.upper,q.lower,q.ram,qd.upper,qd.lower,qd.ram,lambda.anvil.1")
    for t in TIMES:
        row(t, *state(found, end, mpf(t)))


if __name__ == "__main__":
    main()
