#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""All equilibria of the double four-bar on the way that its start belongs to, from its potential alone: the joints are
circles intersected one after the other, the potential V a function of the crank's angle, an equilibrium a zero of its
slope, found by bisection; V is differentiated as a power series (mpmath). Nothing of it is an equation of motion.

    python3 examples/double_four_bar/reference_double_four_bar.py            crank, rocker, lever, V and V'' of each
"""
from mpmath import mp, mpf, cos, sin, sqrt, atan2, diff, pi

mp.dps = 40
A, BAR, C, FX, FY, ROD, L = map(mpf, ("0.35", "0.75", "0.45", "0.4", "0.15", "0.7", "0.5"))
D, E, S = (mpf("0.8"), mpf(0)), (mpf("1.5"), mpf("0.05")), (mpf("1.7"), mpf("0.9"))
RHO, LOAD, K, FREE, G = mpf(2), mpf("1.5"), mpf(60), mpf("0.6"), mpf("9.81")


def circles(p, r, q, s):
    """The point where circles about p and q meet, left of the way from p to q."""
    dx, dy = q[0] - p[0], q[1] - p[1]
    square = dx * dx + dy * dy
    along = (square + r * r - s * s) / (2 * square)
    across = sqrt(r * r / square - along * along)
    return p[0] + along * dx - across * dy, p[1] + along * dy + across * dx


def positions(angle):
    b = (A * cos(angle), A * sin(angle))
    c = circles(b, BAR, D, C)
    x, y = (c[0] - D[0]) / C, (c[1] - D[1]) / C                  # axes of the rocker
    f = (D[0] + FX * x - FY * y, D[1] + FX * y + FY * x)
    return b, c, f, circles(f, ROD, E, L), (x, y)


def potential(angle):
    b, c, f, g, (x, y) = positions(angle)
    height = RHO * A * b[1] / 2 + RHO * BAR * (b[1] + c[1]) / 2
    height += mpf("1.2") * (mpf("0.28") * y + mpf("0.05") * x)
    height += RHO * ROD * (f[1] + g[1]) / 2 + RHO * L * (g[1] + E[1]) / 2 + LOAD * g[1]
    stretch = sqrt((g[0] - S[0]) ** 2 + (g[1] - S[1]) ** 2) - FREE
    return G * height + K * stretch ** 2 / 2


def main():
    slope = lambda angle: diff(potential, angle)
    steps = 72
    for k in range(steps):
        low, high = 2 * pi * k / steps, 2 * pi * (k + 1) / steps
        at_low = slope(low)
        if at_low * slope(high) > 0:
            continue
        for _ in range(110):
            middle = (low + high) / 2
            if at_low * slope(middle) > 0:
                low = middle
            else:
                high = middle
        _, c, _, g, _ = positions(low)
        rocker, lever = atan2(c[1] - D[1], c[0] - D[0]), atan2(g[1] - E[1], g[0] - E[0])
        bend = diff(potential, low, 2)
        row = [mp.nstr(x, 20) for x in (low, rocker, lever, potential(low))]
        print(*row, mp.nstr(bend, 6), "stable" if bend > 0 else "unstable")


if __name__ == "__main__":
    main()
