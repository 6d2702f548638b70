#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The slow mode of bogie_on_rails.yaml without masses: a stiff frame that two axles steer, whose driven one feels its motors.

    python3 reference_bogie_track.py > reference.csv

With y of the driven axle, yaw psi and the other axle L ahead of it (behind it where the speed is negative) nothing else balances
than creep forces, 2 f22 (y'/V - psi) across each axle and, since wheels of which one has run up on its cone by slope*y against the other are
pulled together by the motors, +-f (b psi'/V + slope y/r0) along the driven one, f = f11/(1 + f11 r0^2/(motors V)):

    y'' - V g L/(S f22) y' + V^2 g y = 0,     g = b f slope/(r0 (L^2/S + b^2 f)),     S = 1/f22 + 1/f22 of the other axle.

Besides the damper c against the car body's yaw, which is -(y + a psi)/p: the ball is a ahead of the driven axle, P another p. It takes
c (psi' + (y' + a psi')/p) as a moment, and what of it goes through ball and P.

A torque T on each driven wheel gives forces T/r0 along rails, whose middle does not move with the bogie: X = 2 T/r0 turns it by X y, and
its reaction at the ball, along the car body, pushes it aside by X (psi + (y + a psi)/p). Of the wheel on the larger radius the force is
smaller. With braking, T < 0, these forces alone let the bogie oscillate, without motors that couple its wheels.

Weight on the slopes and creep by spin nearly balance each other and are left out, as are masses and how axles roll on their cones.
Hertz's ellipses and Kalker's coefficients: ../contact_tables.py.
"""
import cmath
import math
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from contact_tables import coefficients, ellipse  # noqa: E402

L, B, SLOPE, MOTORS, BALL, PIVOT = 1.7, 0.75, 0.05, 5000.0, 0.765, 5.5
SHEAR, POISSON, RAIL = 82e9, 0.28, 0.3  # of rails: the arc where the cone stands on it
LOADS, RADII = (16398.0, 11510.0), (0.32, 0.1875)  # of a driven wheel and of a small one


def contact(load, radius):
    """Hertz's semi-axes along and across and the approach of a cone on a rail, straight up."""
    cosine = math.cos(math.atan(SLOPE))
    a, b, approach = ellipse(cosine / radius, 1 / RAIL, load / cosine, SHEAR / (1 - POISSON))
    return a, b, approach / cosine


def creep(load, radius):
    a, b, _ = contact(load, radius)
    c11, c22 = coefficients(a, b, POISSON)[:2]
    return SHEAR * a * b * c11, SHEAR * a * b * c22


def mode(speed, damper, motors=MOTORS, torque=0.0):
    """Of forces across and moments about the driven axle by (y, psi) and their rates, all of which are lengths and angles forwards."""
    (f11, f22), (_, other) = (creep(*given) for given in zip(LOADS, RADII))
    v, way, r0 = abs(speed), math.copysign(1, speed), RADII[0]
    f = f11 / (1 + f11 * r0**2 / (motors * v)) if motors else 0.0
    x = 2 * torque / r0
    c0, c1 = [[0.0, 0.0], [2 * B * f * SLOPE / r0, 0.0]], [[0.0, 0.0], [0.0, 2 * B * f * B / v]]
    turns = way / PIVOT, 1 + BALL / PIVOT  # of the bogie against the car body, by y and psi
    for i in (0, 1):
        for ahead, f22_ in ((0, f22), (way * L, other)):
            arm = (1, ahead)
            c0[i][1] -= arm[i] * 2 * f22_
            for k in (0, 1):
                c1[i][k] += arm[i] * 2 * f22_ / v * arm[k]
        for k in (0, 1):
            c1[i][k] += damper * turns[i] * turns[k]
            c0[i][k] -= (1, way * BALL)[i] * x * turns[k]
    c0[1][0] -= x + 2 * B * torque * SLOPE / r0**2
    square = c1[0][0] * c1[1][1] - c1[0][1] * c1[1][0]
    linear = c0[0][0] * c1[1][1] + c1[0][0] * c0[1][1] - c0[0][1] * c1[1][0] - c1[0][1] * c0[1][0]
    last = c0[0][0] * c0[1][1] - c0[0][1] * c0[1][0]
    return (-linear + cmath.sqrt(linear**2 - 4 * square * last)) / (2 * square)


if __name__ == "__main__":
    print("# of bogie_on_rails.yaml: eigenvalue of its slow mode, 1/s; backwards it is the same but for the sign of re\nspeed,yaw_damper,motors,torque,re,im")
    coupled = [(v, c, MOTORS, 0.0) for c in (5000, 0) for v in (5, 10, 15, 20)]
    braked = [(10, c, 0.0, torque) for c in (0, 5000, 20000) for torque in (-600.0, -1200.0)]
    for given in coupled + braked:
        s, back = mode(*given), mode(-given[0], *given[1:])
        assert abs(back + s.conjugate()) < 1e-12 * abs(s)
        print(",".join("%.6g" % x for x in (*given, s.real, s.imag)))
