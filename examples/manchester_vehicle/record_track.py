#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes recorded_track.csv: a track as a recording car gives it, 250 m at 0.25 m, in mm. It is synthetic: waves of 3 m to 70 m with
the spectrum "low" of ERRI B176 (docs/model/tracks.md) and phases of a seed; the gauge has a tenth of the power of the alignment.

    python3 record_track.py > recorded_track.csv
"""
import math
import random

LENGTH, STEP, WAVES, REST, RISE = 250, 0.25, 200, 2, 10    # zero over REST at both ends: beyond them tables go on along their slope
LONGEST, SHORTEST = 2 * math.pi / 70, 2 * math.pi / 3      # rad/m
WC, WR, WS = 0.8246, 0.0206, 0.4380
A, B = 2.119e-7, 4.032e-7


def alignment(w):
    return A * WC**2 / ((w * w + WR**2) * (w * w + WC**2))


def level(w):
    return B * WC**2 / ((w * w + WR**2) * (w * w + WC**2))


def cross(w):
    return 4 * B * WC**2 * w * w / ((w * w + WR**2) * (w * w + WC**2) * (w * w + WS**2))


def gauge(w):
    return alignment(w) / 10


def waves(spectrum, phases):
    """Amplitude, frequency and phase of waves whose bands share the range in equal ratios."""
    ratio = (SHORTEST / LONGEST) ** (1 / WAVES)
    for k in range(WAVES):
        low = LONGEST * ratio**k
        w = low * math.sqrt(ratio)
        yield math.sqrt(2 * spectrum(w) * low * (ratio - 1)), w, phases.uniform(0, 2 * math.pi)


def main():
    phases = random.Random(1)
    found = [list(waves(spectrum, phases)) for spectrum in (alignment, level, cross, gauge)]
    print("# synthetic: record_track.py; mm over the way in m, to the left and upwards, left above right, wider")
    print("s,alignment,level,cross,gauge")
    for k in range(round(LENGTH / STEP) + 1):
        s = k * STEP
        shape = max(0, min(1, (s - REST) / RISE, (LENGTH - REST - s) / RISE))
        shape = shape * shape * (3 - 2 * shape)
        values = (1000 * shape * sum(a * math.cos(w * s + p) for a, w, p in each) for each in found)
        print(f"{s:g}," + ",".join(f"{round(value, 2) + 0:.2f}" for value in values))


if __name__ == "__main__":
    main()
