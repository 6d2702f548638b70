#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the Geneva drive in closed form:

    python3 reference_geneva_drive.py > reference.csv

With the crank at the angle a from the line of both axes, the slot is at phi = atan2(l sin a, 1 - l cos a), l = sin(45 deg), as long as
the pin is in it. The torque on the wheel is J phi'' w^2 + M, with M of the brake; its arm is the distance of the pin from the wheel's axis.
"""
import math

L, C, J, BRAKE, SPEED = math.sin(math.pi / 4), 0.1, 2e-4, 0.2, 10.0
END, STEP = 1.3, 0.01


def wheel(a):
    """phi and its first two derivatives by a."""
    s, c = L * math.sin(a), 1 - L * math.cos(a)
    square = s * s + c * c
    first = (L * math.cos(a) - L * L) / square
    second = -L * math.sin(a) / square - first * 2 * L * math.sin(a) / square
    return math.atan2(s, c), first, second


def main():
    print("# Geneva drive in closed form, by reference_geneva_drive.py.")
    print("t,q.a,q.w,qd.w,force.pin,lambda.turn.1")
    for k in range(round(END / STEP) + 1):
        t = k * STEP
        a = SPEED * t - math.pi / 2
        turns = round(a / (2 * math.pi))
        within = a - 2 * math.pi * turns
        phi, rate, force, torque = math.copysign(math.pi / 4, within), 0.0, 0.0, 0.0
        if abs(within) < math.pi / 4:
            phi, first, second = wheel(within)
            moment = J * second * SPEED * SPEED + BRAKE
            rate, torque = -first * SPEED, moment * first
            force = moment / math.sqrt(C * C * (1 + L * L - 2 * L * math.cos(within)))
        print(f"{t:.15g},{a:.15g},{-math.pi / 4 - phi - math.pi / 2 * turns:.15g},{rate:.15g},{force:.15g},{torque:.15g}")


if __name__ == "__main__":
    main()
