#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the references: the four-bar's motion by an integral over the crank's angle (../turning.py), in 40 digits.

    python3 reference_four_bar.py 1 1 1 > reference.csv
    python3 reference_four_bar.py 1e-6 1 1e6 3000 > reference_ill.csv

Masses of crank, coupler and rocker; panels a turn, 48 of them if nothing is said. With twice as many all digits that are
written are the same. With the ill-scaled masses the crank whips round wherever the rocker turns back, within 1e-3 rad: that
takes many panels, and a minute.
"""
import pathlib
import sys

from mpmath import arg, expj, mpf, nstr, pi

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from turning import Turning, bar, meet, pair  # noqa: E402

CRANK, COUPLER, ROCKER, D = mpf("0.3"), mpf("0.8"), mpf("0.7"), mpf("0.9")  # D: the rocker's pivot


def state(masses, angle):
    """I, V; the rocker's absolute angle, its rate by the crank's angle."""
    b = CRANK * expj(angle)
    c = meet(b, COUPLER, D, ROCKER)
    w_coupler, w_rocker = pair(1j * b, c - b, c - D)
    parts = [bar(masses[0], 0, 0, b, 1), bar(masses[1], b, 1j * b, c - b, w_coupler),
             bar(masses[2], D, 0, c - D, w_rocker)]
    return sum(x[0] for x in parts), sum(x[1] for x in parts), arg(c - D), w_rocker


if __name__ == "__main__":
    masses, times = [mpf(x) for x in sys.argv[1:4]], [mpf("0.5"), mpf(1), mpf(2), mpf(5)]
    start = pi / 2                                        # angles of the model count from there
    motion = Turning(lambda angle: state(masses, angle)[:2], start, mpf(20))
    print(f"# Masses {' : '.join(sys.argv[1:4])}: an integral over the crank's angle in 40 digits, by reference_four_bar.py; two numbers of")
    print("# panels agree on all digits.")
    print("t,q.crank,qd.crank,q.rocker,qd.rocker")
    for t, angle in zip(times, motion.angles(times, int(sys.argv[4]) if len(sys.argv) > 4 else 48)):
        _, _, rocker, w_rocker = state(masses, angle)
        rate = motion.rate(angle)
        values = [angle - start, rate, rocker - state(masses, start)[2], w_rocker * rate]
        print(",".join([f"{float(t):g}"] + [nstr(x, 18, strip_zeros=False) for x in values]))
