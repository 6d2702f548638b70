#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the ratchet jack: geometry of the pawls.

    python3 reference_ratchet_jack.py > reference.csv

The tip of a pawl in a corner of the teeth is where two circles meet, about the axis of the wheel and about the seat. The driving pawl carries
the wheel while the lever is behind its corner, the pawl on the ground holds it from two teeth on.
"""
import math

TEETH, ROOT, LENGTH, OUT, TIME, PINION, END, STEP = 24, 0.052, 0.04, 0.004, 0.8, 0.025, 2.4, 0.02
PITCH = 2 * math.pi / TEETH
SEAT = math.hypot(ROOT + OUT, LENGTH)
CORNER = math.atan2(LENGTH, ROOT + OUT) - math.acos((ROOT**2 + SEAT**2 - LENGTH**2) / (2 * ROOT * SEAT))


def lever(t):
    return 0.3 * PITCH - 2.6 * PITCH * (1 - math.cos(2 * math.pi * t / TIME)) / 2


def wheel(t):
    stroke = math.floor(t / TIME)
    back = t - stroke * TIME > TIME / 2
    moved = lever(t)
    turned = moved if moved < (-2 * PITCH if back else 0) else -2 * PITCH if back else 0.0
    return CORNER - 2 * PITCH * stroke + turned


def main():
    print("# Ratchet jack: geometry of the pawls, by reference_ratchet_jack.py.")
    print("t,q.wheel,q.lever,q.rack")
    for step in range(1, round(END / STEP)):
        t = step * STEP
        if step % round(TIME / STEP):  # between two strokes rounding decides on the stroke
            print(",".join(f"{value:.15g}" for value in (t, wheel(t), lever(t), -PINION * wheel(t))))


if __name__ == "__main__":
    main()
