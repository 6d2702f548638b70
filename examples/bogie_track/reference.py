#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The slow mode of on_rails.yaml without masses: a stiff frame that two axles steer, whose driven one feels its motors.

    python3 reference.py > reference.csv

With y of the driven axle, yaw psi and the other axle L ahead of it (behind it where the speed is negative) nothing else balances
than creep forces, 2 f22 (y'/V - psi) across each axle and, since wheels of which one has run up on its cone by slope*y against the other are
pulled together by the motors, +-f (b psi'/V + slope y/r0) along the driven one, f = f11/(1 + f11 r0^2/(motors V)):

    y'' - V g L/(S f22) y' + V^2 g y = 0,     g = b f slope/(r0 (L^2/S + b^2 f)),     S = 1/f22 + 1/f22 of the other axle.

Weight on the slopes and creep by spin nearly balance each other and are left out, as are masses.
"""
import math

L, B, SLOPE, MOTORS = 1.7, 0.75, 0.05, 5000.0
SHEAR, POISSON, RAIL = 82e9, 0.28, 0.3  # of rails: the arc where the cone stands on it
# Kalker 1990, table E.3, b/a or a/b from 1/10 to 1: C11 and C22 at nu 0, 1/4, 1/2 for a < b, then for a > b.
TABLE = {
    0.5: ((2.88, 3.62, 4.83), (2.88, 3.01, 3.14), (4.37, 5.10, 6.11), (4.37, 4.90, 5.56)),
    0.6: ((2.98, 3.72, 4.91), (2.98, 3.14, 3.31), (4.06, 4.78, 5.80), (4.06, 4.50, 5.04)),
    0.7: ((3.09, 3.81, 4.97), (3.09, 3.28, 3.48), (3.82, 4.54, 5.58), (3.82, 4.21, 4.67)),
    0.8: ((3.19, 3.91, 5.05), (3.19, 3.41, 3.65), (3.65, 4.36, 5.42), (3.65, 3.99, 4.39)),
    0.9: ((3.29, 4.01, 5.12), (3.29, 3.54, 3.82), (3.51, 4.22, 5.30), (3.51, 3.81, 4.16)),
    1.0: ((3.40, 4.12, 5.20), (3.40, 3.67, 3.98), (3.40, 4.12, 5.20), (3.40, 3.67, 3.98)),
}


def at(row, nu):
    """1/C is a parabola through its values at nu 0, 1/4, 1/2."""
    x, (a, b, c) = 4 * nu, (1 / v for v in row)
    return 1 / (a + x * (b - a) + x * (x - 1) / 2 * (c - 2 * b + a))


def kalker(ratio, nu):
    """C11, C22 of an ellipse with a/b = ratio, a along."""
    g, column = min(ratio, 1 / ratio), 0 if ratio < 1 else 2
    low = max(k for k in TABLE if k <= g and k < 1)
    high = round(low + 0.1, 1)
    part = (g - low) / (high - low)
    return [(1 - part) * at(TABLE[low][column + i], nu) + part * at(TABLE[high][column + i], nu) for i in (0, 1)]


def integrals(m):
    """Complete elliptic integrals K and E by the arithmetic-geometric mean."""
    a, b, total, power = 1.0, math.sqrt(1 - m), 0.0, 0.5
    c = math.sqrt(m)
    for _ in range(8):
        total += power * c * c
        a, b, c, power = (a + b) / 2, math.sqrt(a * b), (a - b) / 2, 2 * power
    k = math.pi / (2 * a)
    return k, k * (1 - total)


def ellipse(load, radius):
    """Hertz's semi-axes along and across: a cone of that radius on a rail."""
    along, across = 1 / (2 * radius), 1 / (2 * RAIL)
    small, large = sorted((along, across))
    low, high = 1e-9, 1 - 1e-9  # m = 1 - (shorter/longer)^2
    for _ in range(200):
        m = (low + high) / 2
        k, e = integrals(m)
        if (e / (1 - m) - k) / (k - e) < large / small:
            low = m
        else:
            high = m
    k, e = integrals(m)
    modulus = 2 * SHEAR * (1 + POISSON)
    longer = (3 * load * (1 - POISSON**2) * 2 * e / (2 * math.pi * modulus * (1 - m) * (along + across))) ** (1 / 3)
    shorter = longer * math.sqrt(1 - m)
    return (longer, shorter) if along < across else (shorter, longer)


def creep(load, radius):
    a, b = ellipse(load, radius)
    c11, c22 = kalker(a / b, POISSON)
    return SHEAR * a * b * c11, SHEAR * a * b * c22


def mode(speed):
    (f11, front), (_, other), r0 = creep(16386, 0.32), creep(11501, 0.1875), 0.32
    f = f11 / (1 + f11 * r0**2 / (MOTORS * abs(speed)))
    s = 1 / front + 1 / other
    g = B * f * SLOPE / (r0 * (L**2 / s + B**2 * f))
    growth = speed * g * L / (s * front) / 2
    return growth, math.sqrt(speed**2 * g - growth**2)


if __name__ == "__main__":
    print("# of on_rails.yaml: eigenvalue of its slow mode, 1/s\nspeed,re,im")
    for v in (5, 10, 15, 20, -5, -10, -15, -20):
        print("%g,%.6g,%.6g" % (v, *mode(v)))
