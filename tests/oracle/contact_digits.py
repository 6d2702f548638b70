#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of tests/unit/test_rigid_contacts.c, by closed forms and quadrature in 40 digits, from the laws alone; and the
rows of bench/machines/bouncing_ball.csv and rolling_sphere.csv:

    python3 tests/oracle/contact_digits.py
"""
from mpmath import acos, asin, cos, diff, findroot, mp, mpf, pi, quad, sin, sqrt, tan

mp.dps = 40
G = mpf("9.81")


def show(name, *values):
    print(f"{name:42}", *(mp.nstr(value, 22) for value in values))


def bouncing():
    """A ball of height 1 with restitution 0.8."""
    e, first = mpf("0.8"), sqrt(2 / G)
    rate = e * sqrt(2 * G)
    times, t = [first], first
    while t + 2 * rate / G < 3:
        t += 2 * rate / G
        times.append(t)
        rate *= e
    left = 3 - t
    show("impacts", *times[:3])
    show("state at t = 3", rate * left - G * left**2 / 2, rate - G * left)
    show("end of all impacts", first * (1 + e) / (1 - e))


def rolling():
    """A solid sphere, slip to roll down 10 degrees, from 2 m/s without spin."""
    angle, mu, v0 = pi / 18, mpf("0.15"), 2
    t = 2 * v0 / (7 * mu * G * cos(angle) - 2 * G * sin(angle))
    slide = G * (sin(angle) - mu * cos(angle))
    v, x, roll = v0 + slide * t, v0 * t + slide * t**2 / 2, 5 * G * sin(angle) / 7
    show("rolls from t, v, x", t, v, x)
    show("x(2)", x + v * (2 - t) + roll * (2 - t)**2 / 2)
    show("friction slipping, rolling", mu * G * cos(angle), 2 * G * sin(angle) / 7)
    show("needs mu", 2 * tan(angle) / 7)


def ball_at(t):
    """Height and rate of the bouncing ball at a time before the impacts accumulate."""
    e, rate = mpf("0.8"), sqrt(2 * G)
    start = sqrt(2 / G)
    while t > start:
        rate *= e
        if t <= start + 2 * rate / G:
            return rate * (t - start) - G * (t - start)**2 / 2, rate - G * (t - start)
        start += 2 * rate / G
    return 1 - G * t**2 / 2, -G * t


def sphere_at(t):
    """Way, angle and rates of the sphere that slips down 10 degrees, then rolls."""
    angle, mu, radius = pi / 18, mpf("0.15"), mpf("0.1")
    end = 4 / (7 * mu * G * cos(angle) - 2 * G * sin(angle))
    slide, spin = G * (sin(angle) - mu * cos(angle)), -5 * mu * G * cos(angle) / (2 * radius)
    slips, roll, rest = min(t, end), 5 * G * sin(angle) / 7, max(t - end, 0)
    v, w = 2 + slide * slips, spin * slips
    x, turned = 2 * slips + slide * slips**2 / 2 + v * rest + roll * rest**2 / 2, spin * slips**2 / 2 + w * rest - roll / radius * rest**2 / 2
    return x, turned, v + roll * rest, w - roll / radius * rest


def machines():
    for name, columns, state in (("bouncing_ball", "q.z,qd.z", ball_at), ("rolling_sphere", "q.x,q.turn,qd.x,qd.turn", sphere_at)):
        print(f"\nbench/machines/{name}.csv\n# Closed form, by tests/oracle/contact_digits.py\nt,{columns}")
        for t in ("0.5", "1", "2", "3"):
            print(t, *(mp.nstr(value, 20) for value in state(mpf(t))), sep=",")


R, L, M1, M2, M3 = (mpf(x) for x in ("0.2", "0.5", "1", "2", "3"))


def rod(angle):
    return -asin(R * sin(angle) / L)


def slider(angle):
    return R * cos(angle) + L * cos(rod(angle)) - R - L


def inertia(angle):
    """2 T / w^2 of the slider-crank: bars about their centres."""
    turn, out = diff(rod, angle), diff(slider, angle)
    x, y = -R * sin(angle) - L / 2 * sin(rod(angle)) * turn, R * cos(angle) + L / 2 * cos(rod(angle)) * turn
    return M1 * R**2 / 3 + M2 * (x * x + y * y + L**2 / 12 * turn**2) + M3 * out**2


def potential(angle):
    return G * (M1 * R / 2 * sin(angle) + M2 * (R * sin(angle) + L / 2 * sin(rod(angle))))


def stopped_slider_crank():
    """Slider limited at -0.3 m with restitution 0.5, crank at 20 rad/s from the outer dead centre."""
    mp.dps = 25
    at = findroot(lambda angle: slider(angle) + mpf("0.3"), mpf("1.6"))
    energy = inertia(mpf(0)) * 400 / 2 + potential(mpf(0))

    def passage(start, end, energy):
        return quad(lambda angle: 1 / sqrt(2 * (energy - potential(angle)) / inertia(angle)), [min(start, end), max(start, end)])

    first = passage(mpf(0), at, energy)
    kinetic = energy - potential(at)
    rebound = kinetic / 4 + potential(at)
    show("first impact at t, crank", first, at)
    show("rate of the slider before", diff(slider, at) * sqrt(2 * kinetic / inertia(at)))
    show("kinetic energy before, after", kinetic, kinetic / 4)
    second = first + passage(-at, at, rebound)
    kinetic = rebound - potential(-at)
    show("second impact at t, energy before", second, kinetic)


def off_a_sphere():
    """A point mass on a smooth sphere of radius 1, from rest 0.5 rad off the top: it leaves where cos is 2/3 of that at the start."""
    mp.dps = 25
    start = mpf("0.5")
    leaves = acos(cos(start) * 2 / 3)
    # with the angle start + s^2 there is no singular end
    time = quad(lambda s: s / sqrt(G * sin(start + s * s / 2) * sin(s * s / 2)), [0, sqrt(leaves - start)])
    rate = sqrt(2 * G * (cos(start) - cos(leaves)))
    show("leaves at t, angle", time, leaves)
    t = 1 - time
    show("x, y at t = 1", sin(leaves) + rate * cos(leaves) * t, cos(leaves) - rate * sin(leaves) * t - G * t * t / 2)


def two_corners():
    """A box 2 a wide, centre h above its base, of mass m and inertia I, falls flat at 1 m/s on corners with 0.8 and 0.2."""
    left, right, a = mpf("0.8"), mpf("0.2"), mpf("0.5")
    show("vertical rate, turning rate after", (left + right) / 2, (right - left) / (2 * a))


if __name__ == "__main__":
    bouncing()
    rolling()
    stopped_slider_crank()
    off_a_sphere()
    two_corners()
    mp.dps = 40
    machines()
