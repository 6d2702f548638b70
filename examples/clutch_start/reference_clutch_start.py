#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The motion of clutch_start.yaml in closed form, 30 digits (mpmath).

    python3 examples/clutch_start/reference_clutch_start.py > reference.csv

The torque of the clutch is T t/time up to `time`, then T. The drum and its chain are one inertia I at the shaft. It rests until the
clutch has the torque D of the brake there. From then on all rates are polynomials of t, until both shafts have one rate, a root. The
heat is the integral of the torque times the slip. Afterwards engine and shaft are one body.
"""
from mpmath import mp, mpf, nstr, quad

mp.dps = 30
J, M, START, TIME = mpf("0.12"), mpf(10), mpf(150), mpf("0.2")
ARM = mpf(2) / 3 * (mpf("0.1") ** 3 - mpf("0.06") ** 3) / (mpf("0.1") ** 2 - mpf("0.06") ** 2)
T = mpf("0.3") * 2 * ARM * 600
RATIO = mpf(17) / 38
ONE = mpf("0.35") * mpf("0.12") * mpf("0.18") * 50
DRAG = ONE / (mpf("0.09") - mpf("0.035")) + ONE / (mpf("0.09") + mpf("0.035"))
D = RATIO * DRAG
I = mpf("0.01") + RATIO**2 * mpf("1.2")
BEGIN = TIME * D / T


def torque(t):
    return T * min(t, TIME) / TIME


def impulse(t):
    """The integral of the torque."""
    return T * t**2 / (2 * TIME) if t < TIME else T * (t - TIME / 2)


def moment(t):
    """The integral of the impulse."""
    return T * t**3 / (6 * TIME) if t < TIME else T * (TIME**2 / 6 + TIME / 2 * (t - TIME) + (t - TIME) ** 2 / 2)


def engine(t):
    return START * t + (M * t**2 / 2 - moment(t)) / J, START + (M * t - impulse(t)) / J


def shaft(t):
    if t < BEGIN:
        return mpf(0), mpf(0)
    since = t - BEGIN
    return ((moment(t) - moment(BEGIN) - impulse(BEGIN) * since - D * since**2 / 2) / I, (impulse(t) - impulse(BEGIN) - D * since) / I)


def slip(t):
    return engine(t)[1] - shaft(t)[1]


# Behind TIME the slip is linear.
TOGETHER = TIME + slip(TIME) / ((T - M) / J + (T - D) / I)
HEAT = quad(lambda t: torque(t) * slip(t), [0, BEGIN, TIME, TOGETHER])


def row(t):
    if t <= TOGETHER:
        (a, va), (b, vb) = engine(t), shaft(t)
        knots = [x for x in (mpf(0), BEGIN, TIME) if x < t] + [t]
        heat = quad(lambda s: torque(s) * slip(s), knots) if t > 0 else mpf(0)
        carried = torque(t)
    else:
        since, second = t - TOGETHER, (M - D) / (J + I)
        (a, va), (b, vb) = engine(TOGETHER), shaft(TOGETHER)
        a, b = (x + va * since + second * since**2 / 2 for x in (a, b))
        va = vb = va + second * since
        heat, carried = HEAT, M - J * second
    return t, a, b, RATIO * b, va, vb, RATIO * vb, heat, -carried


if __name__ == "__main__":
    print(f"# closed form, 30 digits; the shaft begins at {nstr(BEGIN, 15)} s, both have one rate at {nstr(TOGETHER, 15)} s, heat {nstr(HEAT, 15)} J")
    print("t,q.engine,q.shaft,q.drum,qd.engine,qd.shaft,qd.drum,state.clutch_heat,force.clutch_plates")
    for k in range(21):
        print(",".join(nstr(x, 18) for x in row(k * mpf("0.05"))))
