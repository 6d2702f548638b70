#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Weighted accelerations of shaken_seat.yaml, with the filters of EN 12299 from their poles and zeros by scipy.signal.

    python3 reference_shaken_seat.py > shaken_seat.csv

Needs numpy and scipy. The analogue filters become digital ones by the bilinear transformation at 200,000 samples per
second, 1000 times the highest corner frequency: their error at 23 Hz, (pi f/rate)^2/3, is 4e-8. The accelerations are
the closed forms of the drives. Rows are windows of 5 s behind the first one, with the root mean squares of the accelerations
along (Wd, and Wc as at the back of a seat), across (Wd) and up (Wb). Digits: those that agree with half the rate.
"""
import numpy as np
from scipy import signal

TURN, UP = 2 * np.pi, ((0.6, 1.3), (0.35, 6.7), (0.25, 23))
ACROSS, ALONG = ((0.35, 0.9), (0.25, 5.2)), ((0.25, 2.1), (0.6, 11))


def roots(frequency, quality):
    """Of s^2 + s w/Q + w^2."""
    return np.roots([1, TURN * frequency / quality, (TURN * frequency) ** 2])


def weighting(f3, f4, q2, step=None):
    """Zeros, poles and gain: band from 0.4 to 100 Hz, transition, step."""
    q1 = 1 / np.sqrt(2)
    zeros, poles = [0, 0, -TURN * f3], [*roots(0.4, q1), *roots(100, q1), *roots(f4, q2)]
    gain = (TURN * 100) ** 2 * (TURN * f4) ** 2 / (TURN * f3)
    if step:
        k, f5, f6, q3, q4 = step
        zeros, poles, gain = [*zeros, *roots(f5, q3)], [*poles, *roots(f6, q4)], gain * k * (f6 / f5) ** 2
    return np.array(zeros), np.array(poles), gain


WB, WC, WD = weighting(16, 16, 0.63, (0.4, 2.5, 4, 0.8, 0.8)), weighting(8, 8, 0.63), weighting(2, 2, 0.63)


def windows(filter, sines, rate):
    t = np.arange(20 * rate) / rate
    acceleration = sum(a * np.sin(TURN * f * t) for a, f in sines)
    sections = signal.zpk2sos(*signal.bilinear_zpk(*filter, rate))
    weighted = signal.sosfilt(sections, acceleration).reshape(4, -1)
    return np.sqrt(np.mean(weighted**2, axis=1))[1:]


def table(rate):
    return np.column_stack([windows(*pair, rate) for pair in ((WD, ALONG), (WC, ALONG), (WD, ACROSS), (WB, UP))])


if __name__ == "__main__":
    fine, coarse = table(200000), table(100000)
    print("# root mean squares of the weighted accelerations of shaken_seat.yaml, m/s^2, in windows of 5 s that end at t, s;")
    print(f"# with half as many samples they differ by at most {np.max(abs(fine / coarse - 1)):.0e}: six digits. Made by reference_shaken_seat.py")
    print("t,along_Wd,along_Wc,across_Wd,up_Wb")
    for k, row in enumerate(fine):
        print(f"{10 + 5 * k}," + ",".join(f"{value:.6f}" for value in row))
