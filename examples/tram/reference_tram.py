#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Wheel loads of the tram at rest, by statics alone.

    python3 reference_tram.py > reference.csv

Each car stands over its own pivot, so that articulations bear nothing, and a bogie's half-frames roll against each other
but do not bend: forces up and moments about the front axle are those of a beam on two axles.
"""

G, PIVOT, WHEELBASE = 9.81, 0.765, 1.7
TOTAL, MOTOR = 31900, 320
CARS = {"a": 8500, "b": 5500, "c": 8500}
BOGIE = (  # masses, and where their centres are behind the front axle
    (900, 0.25), (2 * 180, 0), (420, 0.9 + 0.45), (2 * 70, WHEELBASE), (300, PIVOT),
    (2 * 15, 0.5 + 0.4), (15, PIVOT - 0.10 - 0.225), (2 * 8, 0.45 + 0.05), (8, 0.9 + 0.35))


def loads():
    """Of one wheel, N, by bogie: front, rear."""
    bare = sum(m for m, _ in BOGIE)
    traverse = (TOTAL - sum(CARS.values()) - 3 * bare) / 3 - 2 * MOTOR
    for name, car in CARS.items():
        masses = BOGIE + ((2 * MOTOR, 0.30 - 0.05), (traverse + car, PIVOT))
        rear = sum(m * x for m, x in masses) / WHEELBASE
        yield name, (sum(m for m, _ in masses) - rear) * G / 2, rear * G / 2


def main():
    print("wheel,load")
    for name, front, rear in loads():
        for wheel, load in (("FL", front), ("FR", front), ("RL", rear), ("RR", rear)):
            print(f"{name}_{wheel},{load:.9g}")


if __name__ == "__main__":
    main()
