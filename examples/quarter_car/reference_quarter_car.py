#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the reference: the quarter car's motion as a sum over its four modes, in 40 digits.

    python3 reference_quarter_car.py > reference.csv
    python3 reference_quarter_car.py modes > modes.csv

The modes are the roots of the quartic (mb s^2 + c s + k) (mw s^2 + c s + k + kt) = (c s + k)^2, the body goes
(c s + k) / (mb s^2 + c s + k) times as far as the wheel, and the start says how much of each there is.
"""
import sys

from mpmath import exp, lu_solve, matrix, mp, mpf, nstr, polyroots

mp.dps = 40
MB, MW, K, C, KT, G = mpf(320), mpf(40), mpf(18000), mpf(1200), mpf(180000), mpf("9.81")
TYRE, STRUT = mpf("0.32"), mpf("0.7")  # free lengths


def modes():
    roots = polyroots([MB * MW, C * (MB + MW), MB * (K + KT) + MW * K, C * KT, K * KT], maxsteps=200, extraprec=200)
    return sorted(roots, key=lambda s: (abs(s), -s.imag))


def motion():
    """Of t: heights of wheel and body, and their rates."""
    rest = (TYRE - (MB + MW) * G / KT, TYRE - (MB + MW) * G / KT + STRUT - MB * G / K)
    start = [mpf("0.3") - rest[0], mpf("0.9") - rest[1], mpf(0), mpf("0.4")]
    roots = modes()
    shapes = [(mpf(1), (C * s + K) / (MB * s**2 + C * s + K)) for s in roots]
    columns = [[a, b, s * a, s * b] for s, (a, b) in zip(roots, shapes)]
    parts = lu_solve(matrix(columns).T, matrix(start))

    def at(t):
        grown = [part * exp(s * t) for part, s in zip(parts, roots)]
        place = [rest[i] + sum(g * shape[i] for g, shape in zip(grown, shapes)).real for i in (0, 1)]
        rate = [sum(g * s * shape[i] for g, s, shape in zip(grown, roots, shapes)).real for i in (0, 1)]
        return place, rate

    return at


if __name__ == "__main__":
    if sys.argv[1:] == ["modes"]:
        print("# Roots of the quartic in 40 digits, by reference_quarter_car.py.")
        print("re,im")
        for s in modes():
            print(",".join(nstr(x, 18) for x in (s.real, s.imag)))
    else:
        at = motion()
        print("# The sum of four modes in 40 digits, by reference_quarter_car.py.")
        print("t,q.wheel,q.body,qd.wheel,qd.body")
        for t in ("0.1", "0.5", "1", "2", "3"):
            (wheel, body), (wheel_rate, body_rate) = at(mpf(t))
            print(",".join([t] + [nstr(x, 18) for x in (wheel, body - wheel, wheel_rate, body_rate - wheel_rate)]))
