#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes windows_40.csv: 40 windows before they are flat, as the pendulum that they are (examples/turning.py). Needs mpmath.

    python3 bench/peers/windows_40.py > bench/peers/windows_40.csv
"""
import pathlib
import sys

from mpmath import mpf, nstr, pi, sin

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples"))
from turning import G, Turning  # noqa: E402

N = mpf(40)

if __name__ == "__main__":
    # the bars turn backwards: the angle counts from the other side
    motion = Turning(lambda angle: ((N + 1) / 3 + N, ((N + 1) / 2 + N) * G * sin(angle)), pi / 2, mpf(1))
    (turned,) = motion.angles([mpf("0.6")], 96)
    print("# 40 windows at 0.6 s: an integral over the angle in 40 digits, by windows_40.py.")
    print("t,q.a0,q.a40,q.b0,q.b39")
    print(",".join(["0.6"] + [nstr(x, 18) for x in (pi - turned, pi - turned, turned - pi, turned - pi)]))
