#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The feed drive of stick_slip.yaml by exponentials of matrices in 40 digits (mpmath).

    python3 examples/stick_slip/reference_stick_slip.py > reference.csv

While the table sticks, and while it slips, the equations are linear with constant coefficients. Times of transitions are roots of
the rate of the table and of the reserve of its friction, found on the exponentials themselves.
"""
from mpmath import mp, mpf, matrix, expm, findroot, nstr

mp.dps = 40
U, R, L, K, B = mpf("1.2"), mpf(2), mpf("5e-3"), mpf("0.1"), mpf("1e-4")
LEAD, STIFF, DAMP, J, M, SLIP, STICK = mpf("1e-3"), mpf(20000), mpf(20), mpf("1e-3"), mpf(5), mpf(15), mpf(30)
CURRENT, ANGLE, SPEED, PLACE, RATE, ONE = range(6)


def equations(sense):
    """y' = a y of current, angle and speed of the screw, place and rate of the table, and 1; sense 0: it sticks."""
    a = matrix(6, 6)
    pull = {ANGLE: LEAD * STIFF, SPEED: LEAD * DAMP, PLACE: -STIFF, RATE: -DAMP}
    a[CURRENT, CURRENT], a[CURRENT, SPEED], a[CURRENT, ONE] = -R / L, -K / L, U / L
    a[ANGLE, SPEED], a[SPEED, CURRENT], a[SPEED, SPEED] = 1, K / J, -B / J
    for k, value in pull.items():
        a[SPEED, k] -= LEAD * value / J
        a[RATE, k] += value / M if sense else 0
    if sense:
        a[PLACE, RATE], a[RATE, ONE] = 1, -sense * SLIP / M
    return a


def pull(y):
    return STIFF * (LEAD * y[ANGLE] - y[PLACE]) + DAMP * (LEAD * y[SPEED] - y[RATE])


def row(t, y, sense):
    force = -sense * SLIP if sense else -pull(y)
    print(",".join([nstr(t, 20)] + [nstr(y[k], 18, min_fixed=-3, max_fixed=3) for k in (ANGLE, PLACE, SPEED, RATE, CURRENT)] + [nstr(force, 18)]))


def main():
    y, t, sense, rows, end = matrix([0, 0, 0, 0, 0, 1]), mpf(0), 0, 0, mpf(2)
    step, small = mpf("0.02"), mpf("5e-4")
    print("# exponentials of matrices in 40 digits; rows every 0.02 s; transitions: see the last column")
    print("t,q.screw,q.x,qd.screw,qd.x,state.i,force.guide")
    while rows <= 100:
        a = equations(sense)
        part = expm(a * small)
        gap = (lambda y: y[RATE]) if sense else (lambda y: STICK - abs(pull(y)))
        begin, ahead, at = t, y, t
        while at < end + step:
            after = part * ahead
            if at > begin and gap(after) * gap(ahead) <= 0:
                break
            if at == begin and not sense and gap(after) <= 0:
                break
            ahead, at = after, at + small
        found = at >= end + step
        event = end + step if found else findroot(lambda s: gap(expm(a * (s - begin)) * y), (at, at + small), solver="anderson", tol=mpf(10)**-60)
        while rows <= 100 and rows * step <= event:
            row(rows * step, expm(a * (rows * step - begin)) * y, sense)
            rows += 1
        y, t = expm(a * (event - begin)) * y, event
        if sense:
            sense, y[RATE] = 0, mpf(0)
            assert abs(pull(y)) <= STICK
        else:
            sense = 1 if pull(y) > 0 else -1


main()
