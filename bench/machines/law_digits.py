#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of problems with laws, states and samples by closed forms in 40 digits (mpmath), from the laws alone:

    law_digits duffing > duffing.csv
    law_digits quadratic_damper > quadratic_damper.csv
    law_digits tabulated_damper > tabulated_damper.csv
    law_digits oil_column > oil_column.csv
    law_digits orifice > orifice.csv
    law_digits orifice_empties > orifice_empties.csv
    law_digits lag > lag.csv
    law_digits electric_motor > electric_motor.csv
    law_digits pid_mass > pid_mass.csv
    law_digits sampled_rotor > sampled_rotor.csv
    law_digits sampled_cart > sampled_cart.csv
    law_digits relay > relay.csv
"""
import sys

from mpmath import cos, ellipfun, ellipk, exp, expm, eye, findroot, lambertw, matrix, mp, mpf, quad, sin, sqrt

from digit_table import Table

mp.dps = 40


def duffing():
    """x'' = -x - x^3 from 1: x = cn(w t, m) with w^2 = 2, m = 1/4."""
    w, m = sqrt(2), mpf("0.25")
    sn, cn, dn = (ellipfun(name) for name in ("sn", "cn", "dn"))
    table = Table(None, "q.x", "qd.x", how="Jacobi's elliptic functions, 40 digits")
    table.state(4 * ellipk(m) / w, 1, 0)
    table.state(10, cn(10 * w, m=m), -w * sn(10 * w, m=m) * dn(10 * w, m=m))


def quadratic_damper():
    """x'' = -x - x'|x'| from 1. On a way down y = x'^2 has y' = 2 y - 2 x in x: y = x + 1/2 + c e^(2 x), so that turns follow by Lambert's
    function; the time is a quadrature."""
    table = Table(None, "q.x", "qd.x", how="Lambert's function and quadrature, 40 digits")
    mp.dps = 60
    far, t, side = mpf(1), mpf(0), 1
    while True:
        rate = lambda x: x + mpf("0.5") - (far + mpf("0.5")) * exp(2 * (x - far))    # of the squared rate, x of the side
        end = -(1 + lambertw(-(1 + 2 * far) * exp(-2 * far - 1)).real) / 2
        middle, half = (far + end) / 2, (far - end) / 2
        passed = lambda a: quad(lambda s: half * cos(s) / sqrt(rate(middle + half * sin(s))), [a, (a + mp.pi / 2) / 2, mp.pi / 2],
                                method="gauss-legendre")
        whole = passed(-mp.pi / 2)
        if t + whole > 20:
            a = findroot(lambda a: t + passed(a) - 20, (mpf("-0.3"), mpf("0.1")), solver="anderson", tol=mpf(10)**-50)
            x = middle + half * sin(a)
            table.state(20, side * x, -side * sqrt(rate(x)))
            break
        t += whole
        side, far = -side, -end
        table.state(t, side * far, 0)


def tabulated_damper():
    """Straight lines: m x'' = -k x - (c x' + d) in each part of the table, to a knot of the rate."""
    mp.dps = 30
    knots, forces = [mpf(x) for x in ("-1", "-0.2", "0", "0.2", "1")], [mpf(x) for x in (-680, -360, 0, 120, 280)]
    m, k, t, x, v, end = mpf(300), mpf(20000), mpf(0), mpf("0.1"), mpf(0), mpf(2)
    table = Table(None, "q.x", "qd.x", how="closed form between the knots, 30 digits")
    part = 1                                                  # of the rates -0.2 .. 0: the spring pulls back
    while t < end:
        slope = (forces[part + 1] - forces[part]) / (knots[part + 1] - knots[part])
        rest = -(forces[part] - slope * knots[part]) / k
        decay, w = slope / (2 * m), sqrt(k / m - (slope / (2 * m))**2)
        a, b = x - rest, (v + decay * (x - rest)) / w
        place = lambda s: rest + exp(-decay * s) * (a * cos(w * s) + b * sin(w * s))
        rate = lambda s: exp(-decay * s) * ((b * w - decay * a) * cos(w * s) - (a * w + decay * b) * sin(w * s))
        s, step, leaves = mpf(10)**-9, mpf(1) / 1000, None     # it begins on a knot
        while leaves is None and t + s < end:
            for knot in (part, part + 1):
                beyond = lambda s: rate(s) - knots[knot]
                if beyond(s) * beyond(s + step) < 0:
                    leaves = findroot(beyond, (s, s + step), solver="anderson", tol=mpf(10)**-50), knot
            s += step
        if leaves is None or t + leaves[0] > end:
            table.state(end, place(end - t), rate(end - t))
            return
        s, knot = leaves
        x, v, t = place(s), knots[knot], t + s
        if knot == 2:
            table.state(t, x, 0)
        part += 1 if knot > part else -1


def linear(a, x, t):
    return expm(matrix(a) * t) * matrix(x)


def oil_column():
    b, area, mass, flow = mpf("1.2e9") / mpf("1e-3"), mpf("2e-3"), mpf(200), mpf("1e-4")
    table = Table(None, "q.x", "qd.x", "state.p")
    w, mean = area * sqrt(b / mass), flow / area
    t = mpf("0.1")
    table.state(t, mean * (t - sin(w * t) / w), mean * (1 - cos(w * t)), mass * mean * w * sin(w * t) / area)


def orifice():
    """p' = -12000 sqrt p: the root of p falls on a straight line, below 100 Pa p itself falls like an exponential."""
    p0, rate, laminar = mpf("1e7"), mpf(6000), mpf(100)
    table = Table(None, "state.p")
    table.state(mpf("0.1"), (sqrt(p0) - rate / 10)**2)
    t = (sqrt(p0) - sqrt(laminar)) / rate
    table.event(t, "event 'p': p > laminar became false", laminar)
    table.state(t + mpf("1e-3"), laminar * exp(-2 * rate * mpf("1e-3") / sqrt(laminar)))


def orifice_empties():
    table = Table(None, "state.p")
    table.state(mpf("0.1"), (sqrt(mpf("1e7")) - 600)**2)
    table.refused("the step size became too small: the motion is singular", sqrt(mpf("1e7")) / 6000)


def lag():
    table = Table(None, "state.y")
    table.state(1, 1 - exp(mpf(-5)))


def electric_motor():
    r, l, k, j, b, u = (mpf(x) for x in ("2", "5e-3", "0.1", "1e-3", "1e-4", "12"))
    table = Table(None, "q.A", "qd.A", "state.i", how="exponential of a matrix, 40 digits")
    for t in ("0.01", "0.1", "1"):
        x = linear([[0, 1, 0, 0], [0, -b / j, k / j, 0], [0, -k / l, -r / l, u / l], [0, 0, 0, 0]], [0, 0, 0, 1], mpf(t))
        table.state(mpf(t), *x[:3])


def pid_mass():
    """x'' = 100 e + 200 int e - 15 x' - 5, e = 1 - x."""
    table = Table(None, "q.x", "qd.x", "state.u.integral", how="exponential of a matrix, 40 digits; the integral's part is 200 times it")
    for t in ("0.1", "0.5", "2"):
        x = linear([[0, 1, 0, 0], [-100, -15, 200, 95], [-1, 0, 0, 1], [0, 0, 0, 0]], [0, 0, 0, 1], mpf(t))
        table.state(mpf(t), x[0], x[1], 200 * x[2])


def sampled(names, plant, law, period, rows):
    """Linear motion under a force that is held between samples."""
    table = Table(None, *names, how="exponential of a matrix between samples, 40 digits")
    step, x = expm(matrix(plant) * period), matrix([0, 0, 0])
    for k in range(max(rows) + 1):
        if k in rows:
            table.state(k * period, x[0], x[1])
        x[2] = law(x)
        x = step * x


def sampled_rotor():
    sampled(("q.A", "qd.A"), [[0, 1, 0], [0, 0, 100], [0, 0, 0]], lambda x: 2 * (1 - x[0]) - x[1] / 10, mpf("0.01"), (1, 10, 50, 100))


def sampled_cart():
    sampled(("q.x", "qd.x"), [[0, 1, 0], [-25, 0, mpf("0.5")], [0, 0, 0]], lambda x: 200 * (mpf("0.3") - x[0]) - 40 * x[1], mpf("0.02"),
            (1, 10, 50))


def relay():
    """Force 1 until x exceeds 1, then -1 until x is below -1, and so on: parabolas."""
    x, v, t, force = mpf(0), mpf(0), mpf(0), 1
    table = Table(None, "q.x", "qd.x")
    while True:
        # x + v s + f s^2/2 = f, the later root
        s = (-v + force * sqrt(v * v - 2 * force * (x - force))) / force
        if t + s > 10:
            s = 10 - t
            table.state(10, x + v * s + force * s * s / 2, v + force * s)
            return
        x, v, t = mpf(force), v + force * s, t + s
        force = -force


if __name__ == "__main__":
    {f.__name__: f for f in (duffing, quadratic_damper, tabulated_damper, oil_column, orifice, orifice_empties, lag, electric_motor, pid_mass,
                             sampled_rotor, sampled_cart, relay)}[sys.argv[1]]()
