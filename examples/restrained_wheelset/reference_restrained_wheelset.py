#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The critical speed of a wheelset on springs, in 40 digits: by the closed form, and by the roots of the quartic.

    python3 reference_restrained_wheelset.py > reference.csv

    (m s^2 + 2 f s/V + ky) (I s^2 + 2 f b^2 s/V + kpsi) + 4 f^2 b cone/r0 = 0
"""
from mpmath import findroot, inf, isinf, mp, mpf, nstr, polyroots, sqrt

mp.dps = 40
M, I, B, CONE, R0, KY, KPSI = mpf(1250), mpf(700), mpf("0.75"), mpf("0.05"), mpf("0.45"), mpf(250000), mpf(2000000)
A, STIFF = I + M * B**2, KPSI + KY * B**2


def closed_form(f):
    """By Routh and Hurwitz; f may be infinite."""
    cross = 0 if isinf(f) else B**2 * (I * KY - M * KPSI) ** 2 / (4 * f**2)
    return sqrt(B**2 * A * STIFF / (A**2 * B * CONE / R0 - cross)), sqrt(STIFF / A)


def rightmost(speed, f):
    """Of the roots of the quartic that with the largest real part, above the axis."""
    a, c = 2 * f / speed, 2 * f * B**2 / speed
    quartic = [M * I, M * c + I * a, M * KPSI + a * c + KY * I, a * KPSI + c * KY, KY * KPSI + 4 * f**2 * B * CONE / R0]
    return max((s for s in polyroots(quartic, maxsteps=500, extraprec=300) if s.imag >= 0), key=lambda s: s.real)


if __name__ == "__main__":
    print("# Closed form in 40 digits, by reference_restrained_wheelset.py; f in N, speed in m/s, rate in rad/s.")
    print("f,speed,rate")
    for f in (mpf(10) ** 7, mpf(10) ** 8, mpf(10) ** 9, inf):
        speed, rate = closed_form(f)
        if not isinf(f):
            found = findroot(lambda v, f=f: rightmost(v, f).real, (speed * mpf("0.99"), speed * mpf("1.01")), solver="illinois", tol=mpf(10)**-30)
            assert abs(found - speed) < mpf(10) ** -25 * speed, (found, speed)
            assert abs(rightmost(speed, f).imag - rate) < mpf(10) ** -25 * rate
        print(",".join(nstr(x, 18) if not isinf(x) else "inf" for x in (f, speed, rate)))
