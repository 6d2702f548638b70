#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Klingel's wave of two cones on round rails, in 30 digits: the wavelength without any slip, and the formula.

    python3 reference_rolling_wheel.py > reference.csv

Both wheels are one body. Each touches its rail, a cylinder along the track, in one point; without slip these two points
stand still, so that the body turns about the line through them. The ground that the point at the middle of the axle
covers then is a differential equation of the lateral shift y and the yaw psi over the way x: linear near the middle with
eigenvalues +-2 pi i/L. Nothing is neglected but what is of second order in y and psi.
"""
from mpmath import atan, cos, findroot, matrix, mp, mpf, nstr, pi, sin, sqrt

mp.dps = 30
R0, B = mpf("0.46"), mpf("0.75")  # radius at the points of contact, half the distance of these


def turn(psi, phi):
    """Axes of the axle, not spinning, in those of the track: yaw about z, then roll about x."""
    c, s, d, e = cos(psi), sin(psi), cos(phi), sin(phi)
    return matrix([[c, -s * d, s * e], [s, c * d, -c * e], [0, e, d]])


def wheel(side, cone, s, angle):
    """Point and outward normal of a cone, axes of the axle; s outwards from where its radius is R0, angle from below."""
    radius = R0 - cone * s
    down = matrix([sin(angle), 0, -cos(angle)])
    point = matrix([radius * down[0], side * (B + s), radius * down[2]])
    return point, matrix([down[0], side * cone, down[2]]) / sqrt(1 + cone**2)


def contacts(cone, rail, y, psi):
    """Height and roll of the axle, and both points of contact, in axes of the track: the centre of either rail's circle is
    one radius of the rail from the wheel, along the wheel's normal, which has no component along the track."""
    normal = atan(cone)
    centre = (B + rail * sin(normal), -R0 - rail * cos(normal))  # outwards and up, of the right place below y = psi = 0

    def gaps(z, phi, sl, al, sr, ar):
        axes, at, out = turn(psi, phi), matrix([0, y, z]), []
        for side, s, angle in ((1, sl, al), (-1, sr, ar)):
            point, n = wheel(side, cone, s, angle)
            point, n = at + axes * point, axes * n
            out += [n[0], point[1] + rail * n[1] - side * centre[0], point[2] + rail * n[2] - centre[1]]
        return out

    z, phi, sl, al, sr, ar = findroot(gaps, [mpf(0)] * 6, tol=mpf(10) ** -50, maxsteps=30)
    axes, at = turn(psi, phi), matrix([0, y, z])
    return phi, at, [at + axes * wheel(side, cone, s, angle)[0] for side, s, angle in ((1, sl, al), (-1, sr, ar))]


def way(cone, rail, y, psi):
    """dy/dx and dpsi/dx of the middle of the axle."""
    phi, at, (left, right) = contacts(cone, rail, y, psi)
    along = left - right
    speed = matrix([along[1] * (at - left)[2] - along[2] * (at - left)[1],
                    along[2] * (at - left)[0] - along[0] * (at - left)[2],
                    along[0] * (at - left)[1] - along[1] * (at - left)[0]])
    # along = psi' z + phi' x' + spin' y'', x' the axle's x after yaw and y'' its y after yaw and roll
    axes = turn(psi, phi)
    basis = matrix([[0, cos(psi), axes[0, 1]], [0, sin(psi), axes[1, 1]], [1, 0, axes[2, 1]]])
    yaw = (basis**-1 * along)[0]
    return speed[1] / speed[0], yaw / speed[0]


def wavelength(cone, rail):
    step, columns = mpf(10) ** -8, []
    for k in range(2):
        ends = [way(cone, rail, *[sign * step * (k == i) for i in range(2)]) for sign in (1, -1)]
        columns.append([(a - b) / (2 * step) for a, b in zip(*ends)])
    a, c, b, d = columns[0][0], columns[0][1], columns[1][0], columns[1][1]
    assert abs(a + d) < mpf(10) ** -10
    return 2 * pi / sqrt(a * d - b * c)


def klingel(cone):
    return 2 * pi * sqrt(R0 * B / cone)


if __name__ == "__main__":
    print("# Two cones on round rails, r0 0.46 m, b 0.75 m; cone: its slope, rail: radius of the rail's top, m; by reference_rolling_wheel.py.")
    print("cone,rail,wavelength,klingel")
    for rail in ("0.08", "0.3"):
        for cone in ("0.1", "0.05", "0.025", "0.0125", "0.00625"):
            print(",".join([cone, rail, nstr(wavelength(mpf(cone), mpf(rail)), 15), nstr(klingel(mpf(cone)), 15)]))
