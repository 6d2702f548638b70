#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The quarter car's response in closed form, beside a table that `kempe response` wrote:

    kempe response ride.yaml --inputs 'drive(road)' --outputs 'q(body),travel' -o response.csv
    python3 reference_ride.py response.csv

With z of the body, a the angle of the wishbones, level at rest, and s = i omega:

    (s^2 M + s G + K) (z, a) = (kt + s ct) (1, L) road,
    M = [mb + mw + 2 ma, (mw + ma) L; ., (mw + 2/3 ma) L^2],   K = kt [1, L; L, L^2] + k [0, 0; 0, f^2],   G likewise.

The springs' loads do not count: their ends move on circles to which they are tangent.
"""
import csv
import math
import sys

mb, mw, ma, L, f, k, c, kt, ct = 250, 40, 4, 0.4, 0.25, 60e3, 3500, 200e3, 100


def response(hz):
    """z and L a for a road of 1 m."""
    s = 2j * math.pi * hz
    tyre, spring = kt + s * ct, k + s * c
    m11 = s * s * (mb + mw + 2 * ma) + tyre
    m12 = (s * s * (mw + ma) + tyre) * L
    m22 = (s * s * (mw + 2 / 3 * ma) + tyre) * L * L + spring * f * f
    determinant = m11 * m22 - m12 * m12
    return tyre * (m22 - m12 * L) / determinant, L * tyre * s * s * L * (mb + ma) / determinant


def main():
    worst = 0
    with open(sys.argv[1]) as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    for row in rows[1:]:
        hz, *cells = map(float, row)
        for exact, amplitude, phase in zip(response(hz), cells[::2], cells[1::2], strict=True):
            got = amplitude * complex(math.cos(math.radians(phase)), math.sin(math.radians(phase)))
            worst = max(worst, abs(got - exact) / abs(exact))
    print(f"{len(rows) - 1} frequencies, largest relative difference {worst:.1e}")
    return worst > 1e-12


if __name__ == "__main__":
    sys.exit(main())
