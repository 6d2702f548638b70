#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the valve train: the law of the cam while the roller is on it, a harmonic oscillation while it flies.

    python3 reference_valve_train.py > reference.csv

The roller lifts off where the force of the cam is zero, and flies until its place is again the place of the law. It then has the
rate of the law, because restitution is zero. Both instants are roots by mpmath with 30 digits.
"""
from mpmath import cos, findroot, mp, mpf, nstr, pi, sin, sqrt

mp.dps = 30
SPEED, STIFFNESS, PRELOAD, MASS, GRAVITY, RISE = 2600 * 2 * pi / 60, mpf(20000), mpf(250), mpf("0.25"), mpf("9.81"), mpf("0.009")
END, STEP = mpf("0.025"), mpf("0.00025")
UP, TOP, DOWN = 80 * pi / 180, 100 * pi / 180, pi


def law(angle, order=0):
    """Lift over the angle of the cam, or a derivative."""
    angle = angle - 2 * pi * int(angle / (2 * pi))
    if angle < UP:
        x, width = angle / UP, UP
        value = [35 * x ** 4 - 84 * x ** 5 + 70 * x ** 6 - 20 * x ** 7, 140 * x ** 3 - 420 * x ** 4 + 420 * x ** 5 - 140 * x ** 6,
                 420 * x ** 2 - 1680 * x ** 3 + 2100 * x ** 4 - 840 * x ** 5][order]
    elif angle < TOP:
        return RISE if order == 0 else mpf(0)
    elif angle < DOWN:
        x, width = (angle - TOP) / (DOWN - TOP), DOWN - TOP
        value = [1 - x + sin(2 * pi * x) / (2 * pi), cos(2 * pi * x) - 1, -2 * pi * sin(2 * pi * x)][order]
    else:
        return mpf(0)
    return RISE * value / width ** order


def on_cam(t):
    return law(SPEED * t), SPEED * law(SPEED * t, 1)


def force(t):
    """Of the cam along the valve, on which the roller stays."""
    return MASS * (SPEED ** 2 * law(SPEED * t, 2) + GRAVITY) + PRELOAD + STIFFNESS * law(SPEED * t)


def flight(t0):
    """The motion behind a lift-off at t0: about the place without force."""
    w, rest = sqrt(STIFFNESS / MASS), -(PRELOAD + MASS * GRAVITY) / STIFFNESS
    y, v = on_cam(t0)
    return lambda t: (rest + (y - rest) * cos(w * (t - t0)) + v / w * sin(w * (t - t0)),
                      v * cos(w * (t - t0)) - w * (y - rest) * sin(w * (t - t0)))


def first(f, begin, negative):
    """The first change of sign of f after begin: in steps, then a root."""
    step = END / 20000
    t = begin + step
    while t < END and (f(t) < 0) != negative:
        t += step
    return None if t >= END else findroot(f, (t - step, t), solver="anderson", tol=mpf(10) ** -25)


def phases():
    """(end, motion) of each phase."""
    t, found = mpf(0), []
    while t is not None:
        leaves = first(force, t, True)
        found.append((leaves or END, on_cam))
        if leaves is None:
            break
        flies = flight(leaves)
        t = first(lambda s: flies(s)[0] - law(SPEED * s), leaves + END / 20000, True)
        found.append((t or END, flies))
    return found


def main():
    found = phases()
    events = ", ".join(nstr(end, 12) for end, _ in found[:-1])
    print(f"# Valve train: closed forms, by reference_valve_train.py with 30 digits; the roller leaves and strikes at {events} s.")
    print("t,q.cam_angle,q.lift,qd.cam_angle,qd.lift")
    for k in range(int(END / STEP + mpf("0.5")) + 1):
        t = k * STEP
        y, v = next(motion for end, motion in found if t <= end)(t)
        print(",".join(nstr(x, 16) for x in (t, SPEED * t, y, SPEED, v)))


if __name__ == "__main__":
    main()
