#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The forces of the bearings of unbalanced_shaft.yaml by statics, in 40 digits (mpmath).

    python3 examples/unbalanced_shaft/reference_unbalanced_shaft.py > reference.csv

With --loads: the largest radial forces and the equivalent loads of a turn.
"""
import sys

from mpmath import cos, mp, mpf, nstr, pi, quad, sin, sqrt

mp.dps = 40
M, G, E, SPAN, OVER, W = mpf(5), mpf("9.81"), mpf("0.2e-3"), mpf("0.12"), mpf("0.05"), 50 * pi
SECOND = (SPAN + OVER) / SPAN
FIRST = 1 - SECOND


def force(t):
    """Of both bearings together, across the axis: m a - m g."""
    return -M * E * W**2 * cos(W * t), M * G - M * E * W**2 * sin(W * t)


def equivalent(p):
    turn = 2 * pi / W
    return (quad(lambda t: sqrt(force(t)[0]**2 + force(t)[1]**2)**p, [0, turn / 4, turn / 2, 3 * turn / 4, turn]) / turn)**(1 / p)


if __name__ == "__main__":
    if "--loads" in sys.argv:
        most = M * G + M * E * W**2
        for part, p in ((-FIRST, mpf(10) / 3), (SECOND, mpf(3))):
            print("largest", nstr(part * most, 18), "equivalent", nstr(part * equivalent(p), 18))
        sys.exit()
    print("# closed form, 40 digits")
    print("t,q.pin,qd.pin,bearing.main.1.y,bearing.main.1.z,bearing.main.2.y,bearing.main.2.z,bearing.main.axial")
    for k in (0, 3, 8, 15, 23, 31, 40):
        t = mpf(k) / 1000
        y, z = force(t)
        print(",".join(nstr(x, 18) for x in (t, W * t, W, FIRST * y, FIRST * z, SECOND * y, SECOND * z, mpf(0))))
