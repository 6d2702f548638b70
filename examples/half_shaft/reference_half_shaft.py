#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The motion of half_shaft.yaml without a program for mechanisms, 30 digits (mpmath).

    python3 examples/half_shaft/reference_half_shaft.py > reference.csv

The shaft has no mass and each joint transmits the least rotation from one shaft to the next one, so that the wheel turns by
w = d + alpha(t). alpha is what the directions of the three shafts, turned into each other in turn, add to a direction of the
differential: zero in a plane. The torque T at both ends is the same, A d'' = engine - T and B w'' = T - c w'. So w obeys
J w'' + c w' = engine + A alpha'' with J = A + B. With v = w - A/J alpha one integral of it is v' + c/J v = v'(0) + c/J v(0) + engine t/J
- c A/J^2 (alpha(t) - alpha(0)), and v is a quadrature of alpha.
"""
from mpmath import atan2, cos, diff, exp, mp, mpf, nstr, quad, sin, sqrt

mp.dps = 30
REACH, LENGTH, ENGINE, C, A, B = mpf("0.7"), mpf("0.55"), mpf(600), mpf(15), mpf("0.2"), mpf("1.1")
J, SPEED = A + B, mpf(30)
K = C / J


def bump(t):
    return mpf("0.12") * sin(9 * t)


def steer(t):
    return mpf("0.5") * sin(4 * t)


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def carried(v, a, b):
    """v turned by the least rotation from the unit vector a to the unit vector b."""
    n = cross(a, b)
    once = cross(n, v)
    return [x + y + z / (1 + dot(a, b)) for x, y, z in zip(v, once, cross(n, once))]


def alpha(t):
    rise, angle = bump(t), steer(t)
    across = sqrt(LENGTH**2 - rise**2)
    first, shaft, wheel = [mpf(0), mpf(1), mpf(0)], [mpf(0), across / LENGTH, rise / LENGTH], [-sin(angle), cos(angle), mpf(0)]
    x = carried(carried([mpf(1), mpf(0), mpf(0)], first, shaft), shaft, wheel)
    zero = [cos(angle), sin(angle), mpf(0)]  # the wheel's x at w = 0
    return atan2(dot(cross(zero, x), wheel), dot(zero, x))


def right(t):
    """v' + K v, less its value at the start."""
    return ENGINE * t / J - K * A / J * (alpha(t) - alpha(0))


alpha_rate = diff(alpha, 0)
v = alpha(0) * B / J
v_rate = SPEED + alpha_rate * B / J
whole = v_rate + K * v
STEP = mpf("0.05")

print("# closed form and quadrature, 30 digits")
print("t,q.d,q.w,q.s.1,qd.d,qd.w,lambda.inner.3,lambda.outer.4")
for k in range(31):
    t = k * STEP
    if k:
        v = v * exp(-K * STEP) + quad(lambda s: exp(-K * (t - s)) * (whole + right(s)), [t - STEP, t - STEP / 2, t])
    rate, w = whole + right(t) - K * v, v + A / J * alpha(t)
    a1, a2 = diff(alpha, t), diff(alpha, t, 2)
    w_rate = rate + A / J * a1
    w_second = (ENGINE + A * a2 - C * w_rate) / J
    torque = B * w_second + C * w_rate
    print(",".join(nstr(x, 18) for x in (t, w - alpha(t), w, REACH - sqrt(LENGTH**2 - bump(t)**2), w_rate - a1, w_rate, torque, torque)))
