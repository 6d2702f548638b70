#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes four_bar_10.csv: the four-bar at 10 s by an integral over the crank's angle (examples/turning.py), in 40 digits.
Needs mpmath.

    python3 bench/peers/four_bar_10.py > bench/peers/four_bar_10.csv
"""
import pathlib
import sys

from mpmath import arg, expj, mpf, nstr, pi

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples"))
from turning import Turning, bar, meet, pair  # noqa: E402

CRANK, COUPLER, ROCKER, D = mpf(1), mpf("2.5"), mpf(2), mpf("2.5")


def state(angle):
    """I, V; the coupler's and the rocker's absolute angle."""
    b = CRANK * expj(angle)
    c = meet(b, COUPLER, D, ROCKER)
    w_coupler, w_rocker = pair(1j * b, c - b, c - D)
    parts = [bar(CRANK, 0, 0, b, 1), bar(COUPLER, b, 1j * b, c - b, w_coupler), bar(ROCKER, D, 0, c - D, w_rocker)]
    return sum(x[0] for x in parts), sum(x[1] for x in parts), arg(c - b), arg(c - D)


if __name__ == "__main__":
    motion = Turning(lambda angle: state(angle)[:2], pi / 2, mpf(4))
    angle, = motion.angles([mpf(10)], int(sys.argv[1]) if len(sys.argv) > 1 else 48)
    _, _, coupler, rocker = state(angle)
    print("# An integral over the crank's angle in 40 digits, by four_bar_10.py; two numbers of panels agree on all digits.")
    print("t,q.crank,q.coupler,q.rocker")
    print(",".join(["10"] + [nstr(x, 18) for x in (angle, coupler - angle, rocker)]))
