#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the scissor lift: closed forms of a mechanism whose roller moves by a law.

    python3 reference_scissor_lift.py > reference.csv

The drum gives the way s of the roller, and s = l cos(angle) the angle of all bars. The tension follows from the rate of the energy,
the forces on the foot and the roller from the motion of the centre of mass and the moment of momentum of the whole lift.
"""
import math

BAR, SHEAVE, DRUM, DRUM_INERTIA, GRAVITY, CELLS = 1.6, 0.06, 0.08, 0.03, 9.81, 3
MASS_BAR, MASS_ROLLER, MASS_SHOE, MASS_LOAD, ASIDE, ABOVE = 9.0, 6.0, 2.0, 320.0, 0.7, 0.2
LIFT, TIME, STEP = 0.45, 12.0, 0.5


def law(t):
    """Way of the roller with its first two derivatives: a polynomial of the fifth degree."""
    u = t / TIME
    return (LIFT * u**3 * (10 - 15 * u + 6 * u * u), LIFT / TIME * 30 * u**2 * (1 - u) ** 2,
            LIFT / TIME**2 * 60 * u * (1 - u) * (1 - 2 * u))


def angle(t):
    """Angle of the bars with its first two derivatives, from s = l cos(angle)."""
    way, rate, acceleration = law(t)
    cosine = math.cos(math.radians(12)) - way / BAR
    sine = math.sqrt(1 - cosine * cosine)
    first = rate / (BAR * sine)
    return math.acos(cosine), first, (acceleration / BAR - cosine * first * first) / sine


def masses():
    """(mass, x, y, inertia) with x = a + b l cos(angle) as (a, b) and y = a + b l sin(angle) as (a, b)."""
    parts = [(MASS_ROLLER, (0, 1), (0, 0)), (MASS_SHOE, (0, 1), (0, CELLS)), (MASS_LOAD, (ASIDE, 0), (ABOVE, CELLS))]
    return parts + 2 * [(MASS_BAR, (0, 0.5), (0, k + 0.5)) for k in range(CELLS)]


def loads(t):
    """Tension, torque of the motor, force on the foot, force on the roller."""
    q, v, a = angle(t)
    c, s = BAR * math.cos(q), BAR * math.sin(q)
    c2, s2 = -s * a - c * v * v, c * a - s * v * v  # second derivatives
    power = 2 * CELLS * MASS_BAR * BAR**2 / 12 * a  # generalised force over the rate of the angle
    across = up = moment = 0.0
    for mass, (x0, x1), (y0, y1) in masses():
        force = mass * x1 * c2, mass * (y1 * s2 + GRAVITY)
        power += force[0] * x1 * -s + force[1] * y1 * c
        across, up = across + force[0], up + force[1]
        moment += (x0 + x1 * c) * force[1] - (y0 + y1 * s) * force[0]  # rates of rotation of both bars of a cell cancel
    tension = power / (2 * s)
    torque = tension * DRUM + DRUM_INERTIA * 2 * law(t)[2] / DRUM
    return tension, torque, (across + 2 * tension, up - moment / c), (0.0, moment / c)


def main():
    print("# Scissor lift: closed forms by reference_scissor_lift.py.")
    print("t,q.roller,q.foot,tension.hoist,lambda.motor.1,reaction.foot.x,reaction.foot.y,reaction.roller.x,reaction.roller.y")
    for step in range(round(TIME / STEP) + 1):
        t = step * STEP
        tension, torque, foot, roller = loads(t)
        row = t, BAR * math.cos(angle(t)[0]), angle(t)[0], tension, torque, *foot, *roller
        print(",".join(f"{value:.15g}" for value in row))


if __name__ == "__main__":
    main()
