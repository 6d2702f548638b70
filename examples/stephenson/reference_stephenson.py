#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the six-bar's motion by an integral over the crank's angle (../turning.py), in 40 digits.

    python3 reference_stephenson.py > reference.csv

`python3 reference_stephenson.py 96` takes 96 panels a turn instead of 48: all digits that are written are the same.
"""
import pathlib
import sys

from mpmath import arg, expj, im, mpc, mpf, nstr, pi

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from turning import G, Turning, bar, meet, pair  # noqa: E402

CRANK, COUPLER, ROCKER, ROD, LEVER = mpf("0.3"), mpf("0.9"), mpf("0.7"), mpf(1), mpf("0.6")
D, E = mpf(1), mpc("1.2", "0.3")                         # pivots; the crank's is the origin
PLATE, PLATE_INERTIA, CENTRE, P = mpf(2), mpf("0.12"), mpc("0.5", "0.15"), mpc("0.55", "0.45")  # of the coupler


def state(angle):
    """I, V; the absolute angles of rocker and lever; their rates by the crank's angle. A bar has 1 kg/m."""
    a = CRANK * expj(angle)
    da = 1j * a
    b = meet(a, COUPLER, D, ROCKER)
    w_coupler, w_rocker = pair(da, b - a, b - D)
    turn = (b - a) / COUPLER
    p, dp = a + turn * P, da + 1j * w_coupler * turn * P
    q = meet(p, ROD, E, LEVER)
    w_rod, w_lever = pair(dp, q - p, q - E)
    parts = [bar(CRANK, 0, 0, a, 1), bar(ROCKER, D, 0, b - D, w_rocker), bar(ROD, p, dp, q - p, w_rod),
             bar(LEVER, E, 0, q - E, w_lever),
             (PLATE * abs(da + 1j * w_coupler * turn * CENTRE) ** 2 + PLATE_INERTIA * w_coupler**2,
              PLATE * G * im(a + turn * CENTRE))]
    return sum(x[0] for x in parts), sum(x[1] for x in parts), (arg(b - D), arg(q - E)), (w_rocker, w_lever)


if __name__ == "__main__":
    times = [mpf("0.5"), mpf(1), mpf("1.5"), mpf(2)]
    motion = Turning(lambda angle: state(angle)[:2], pi / 2, mpf(15))
    print("# An integral over the crank's angle in 40 digits, by reference_stephenson.py; two numbers of panels agree on all digits.")
    print("t,q.O,qd.O,q.D,qd.D,q.E,qd.E")
    for t, angle in zip(times, motion.angles(times, int(sys.argv[1]) if len(sys.argv) > 1 else 48)):
        (rocker, lever), (w_rocker, w_lever) = state(angle)[2:]
        rate = motion.rate(angle)
        values = [angle, rate, rocker, w_rocker * rate, lever, w_lever * rate]
        print(",".join([f"{float(t):g}"] + [nstr(x, 18, strip_zeros=False) for x in values]))
