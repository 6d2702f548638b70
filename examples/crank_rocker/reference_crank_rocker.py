#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the reference: positions and rates of the crank-rocker in closed form, in 40 digits.

    python3 reference_crank_rocker.py > reference.csv
"""
from mpmath import acos, arg, conj, expj, mp, mpf, nstr, pi, sqrt

mp.dps = 40
CRANK, COUPLER, ROCKER, BASE = mpf("0.1"), mpf("0.3"), mpf("0.25"), mpf("0.32")


def joint(a):
    """The joint of coupler and rocker: two circles, about the crank's end and D, the upper point."""
    way = BASE - a
    along = (abs(way)**2 + COUPLER**2 - ROCKER**2) / (2 * abs(way))
    return a + way / abs(way) * (along + 1j * sqrt(COUPLER**2 - along**2))


def state(t):
    """Angles as the model counts them, and their rates: the velocities of both bars at the joint are one."""
    a = CRANK * expj(t)
    b = joint(a)
    bar, lever = b - a, b - BASE
    # 1j a + 1j w bar = 1j v lever: times what leaves out the one or the other
    w = -(a * conj(lever)).imag / (bar * conj(lever)).imag
    v = (a * conj(bar)).imag / (lever * conj(bar)).imag
    return [t, arg(bar) - t, arg(lever), mpf(1), w - 1, v] # neither bar comes near the negative x axis


def limit(length):
    return pi - acos((BASE**2 + ROCKER**2 - length**2) / (2 * BASE * ROCKER))


if __name__ == "__main__":
    print("# Closed form in 40 digits, by reference_crank_rocker.py: circles of coupler and rocker intersected.")
    print(f"# Dead centres of the rocker, rad: {nstr(limit(COUPLER + CRANK), 17)} and {nstr(limit(COUPLER - CRANK), 17)}.")
    print("t,q.crank,q.coupler,q.rocker,qd.crank,qd.coupler,qd.rocker")
    for k in range(0, 26):
        t = mpf(k) / 2
        print(",".join([f"{float(t):g}"] + [nstr(x, 18, strip_zeros=False) for x in state(t)]))
