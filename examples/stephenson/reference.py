#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the six-bar's motion by an integral, in 40 digits. Needs mpmath.

    python3 reference.py > reference.csv

No equations of motion: positions are circles that meet, one pair after the other, as complex numbers; rates are those by the
crank's angle O. With one degree of freedom and no loss the energy says how fast the crank turns, and

    t = integral of sqrt(I(O) / (2 (E - V(O)))) dO

by Gauss's formula panel by panel, with O for a given t by Newton's iteration. `python3 reference.py 96` takes 96 panels a
turn instead of 48: all digits that are written are the same.
"""
import sys

from mpmath import mp, mpc, mpf, nstr, arg, conj, expj, im, pi, re, sqrt

mp.dps = 40
CRANK, COUPLER, ROCKER, ROD, LEVER = mpf("0.3"), mpf("0.9"), mpf("0.7"), mpf(1), mpf("0.6")
D, E = mpf(1), mpc("1.2", "0.3")                         # pivots; the crank's is the origin
PLATE, PLATE_INERTIA, CENTRE, P = mpf(2), mpf("0.12"), mpc("0.5", "0.15"), mpc("0.55", "0.45")  # of the coupler
G, START, RATE = mpf("9.81"), pi / 2, mpf(15)            # a bar has 1 kg/m
NODES = 24


def cross(a, b):
    return im(conj(a) * b)


def meet(a, ra, b, rb):
    """Where a circle of radius ra around a meets one of rb around b: left of the way from a to b."""
    way = b - a
    far = abs(way)
    along = (ra**2 - rb**2 + far**2) / (2 * far)
    return a + way / far * mpc(along, sqrt(ra**2 - along**2))


def pair(rate, u, v):
    """Rates of two bars u, v that end in one point: rate + i w u = i w' v."""
    return cross(v, 1j * rate) / cross(v, u), -cross(u, 1j * rate) / cross(u, v)


def bar(length, start, rate, turn, spin):
    """Inertia by the crank's rate, and potential over G, of a slender bar from `start` on."""
    half = length / 2 * turn
    return length * (abs(rate + 1j * spin * half) ** 2 + (length * spin) ** 2 / 12), length * im(start + half)


def state(angle):
    """I, V; the absolute angles of rocker and lever; their rates by the crank's angle."""
    a = CRANK * expj(angle)
    da = 1j * a
    b = meet(a, COUPLER, D, ROCKER)
    w_coupler, w_rocker = pair(da, b - a, b - D)
    turn = (b - a) / COUPLER
    p, dp = a + turn * P, da + 1j * w_coupler * turn * P
    q = meet(p, ROD, E, LEVER)
    w_rod, w_lever = pair(dp, q - p, q - E)
    parts = [bar(CRANK, 0, 0, a / CRANK, 1), bar(ROCKER, D, 0, (b - D) / ROCKER, w_rocker),
             bar(ROD, p, dp, (q - p) / ROD, w_rod), bar(LEVER, E, 0, (q - E) / LEVER, w_lever),
             (PLATE * abs(da + 1j * w_coupler * turn * CENTRE) ** 2 + PLATE_INERTIA * w_coupler**2,
              PLATE * im(a + turn * CENTRE))]
    return sum(x[0] for x in parts), G * sum(x[1] for x in parts), (arg(b - D), arg(q - E)), (w_rocker, w_lever)


FIRST = state(START)
ENERGY = FIRST[0] * RATE**2 / 2 + FIRST[1]


def rate_at(angle):
    inertia, potential = state(angle)[:2]
    return sqrt(2 * (ENERGY - potential) / inertia)


def gauss(n):
    """Nodes and weights on (0, 1): Newton's iteration on Legendre's polynomial."""
    found = []
    for k in range(n):
        x = mp.cos(pi * (k + mpf("0.75")) / (n + mpf("0.5")))
        for _ in range(8):
            before, now = mpf(1), x
            for j in range(2, n + 1):
                before, now = now, ((2 * j - 1) * x * now - (j - 1) * before) / j
            slope = n * (x * now - before) / (x * x - 1)
            x -= now / slope
        found.append(((1 + x) / 2, 1 / ((1 - x * x) * slope**2)))
    return found


RULE = gauss(NODES)


def time(low, high):
    return (high - low) * sum(w / rate_at(low + x * (high - low)) for x, w in RULE)


def run(ends, panels):
    """The crank's angle at each time: whole panels of the first turn are kept, as every turn takes the same time."""
    wide = 2 * pi / panels
    turn = [mpf(0)]
    for k in range(panels):
        turn.append(turn[-1] + time(START + k * wide, START + (k + 1) * wide))
    for end in ends:
        turns = int(end / turn[-1])
        left = end - turns * turn[-1]
        k = max(j for j in range(panels) if turn[j] <= left)
        low = START + k * wide
        angle = low + (left - turn[k]) * rate_at(low)
        for _ in range(8):
            angle -= (turn[k] + time(low, angle) - left) * rate_at(angle)
        yield end, angle + 2 * pi * turns


if __name__ == "__main__":
    print("# An integral over the crank's angle in 40 digits, by reference.py; two numbers of panels agree on all digits.")
    print("t,q.O,qd.O,q.D,qd.D,q.E,qd.E")
    for t, angle in run([mpf("0.5"), mpf(1), mpf("1.5"), mpf(2)], int(sys.argv[1]) if len(sys.argv) > 1 else 48):
        (rocker, lever), (w_rocker, w_lever) = state(angle)[2:]
        rate = rate_at(angle)
        values = [angle, rate, rocker, w_rocker * rate, lever, w_lever * rate]
        print(",".join([f"{float(t):g}"] + [nstr(x, 18, strip_zeros=False) for x in values]))
