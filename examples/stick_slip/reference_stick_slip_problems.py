#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the problems of dry friction in tests/unit/test_friction.c, test_rest_sets.c and test_friction_reaction.c.

    python3 examples/stick_slip/reference_stick_slip_problems.py > problems.csv

Closed forms in 40 digits (mpmath), and three plane linkages: their equations in one angle are written here by hand, and integrated by
Gauss-Legendre collocation of order 16 in 34 digits, with a fixed step whose last part ends at each event.
"""
from mpmath import (asin, atan, cos, findroot, matrix, mp, mpf, nstr, pi, polyroots, quad, sin, sqrt)

mp.dps = 40
G = mpf("9.81")


def say(problem, quantity, value, digits=17):
    print(f"{problem},{quantity},{nstr(value, digits)}")


# -- closed forms


def belt():
    v, high, low = mpf("0.2"), mpf(1), mpf("0.6")
    d = high - low
    slip = 2 * (pi - atan(d / v))
    first = findroot(lambda t: low * sin(t) - v, mpf("0.34"))  # x' = F sin t of a spring that is free at t = 0
    x = low * (1 - cos(first))
    say("belt", "sticks", first)
    say("belt", "x there", x)
    say("belt", "breaks", first + (high - x) / v)
    say("belt", "slip", slip)
    say("belt", "period", slip + 2 * d / v)


def spring():
    for n in range(1, 5):
        say("spring", f"turn {n}", (-1)**n * (mpf("0.25") - mpf("0.06") * n))
    say("spring", "rest", 4 * pi / 10)


def incline():
    level, weight = mpf("0.5") * G * cos(pi / 9), G * sin(pi / 9)
    force = lambda t: 9 * sin(2 * pi * t)
    say("incline", "slips up", asin((weight + level) / 9) / (2 * pi))
    begin = asin((weight + level) / 9) / (2 * pi)
    rate = lambda t, t0, s: 9 / (2 * pi) * (cos(2 * pi * t0) - cos(2 * pi * t)) - (weight + s * level) * (t - t0)
    end = findroot(lambda t: rate(t, begin, 1), (mpf("0.38"), mpf("0.43")), solver="anderson")
    say("incline", "sticks", end)
    down = findroot(lambda t: force(t) - weight + level, (mpf("0.5"), mpf("0.55")), solver="anderson")
    say("incline", "slips down", down)
    say("incline", "reverses", findroot(lambda t: rate(t, down, -1), (mpf("1.25"), mpf("1.35")), solver="anderson"))


def pendulum():
    angle, t, torque = mpf("1.5"), mpf(0), mpf(1)
    for n in range(1, 7):
        gain = lambda th: G * (cos(th) - cos(angle)) - torque * abs(th - angle)
        near = -angle * mpf("0.8")
        far = findroot(gain, near)
        # sine substitution: the rate has a root at both ends
        middle, half = (angle + far) / 2, (angle - far) / 2
        t += quad(lambda s: abs(half) * cos(s) / sqrt(abs(2 * gain(middle + half * sin(s)))), [-pi / 2, 0, pi / 2])
        say("pendulum", f"turn {n}", far)
        say("pendulum", f"time {n}", t, 15)
        angle = far


def stack():
    say("stack", "floor slips", 3 * G * mpf("0.1") / 2)
    # together 2 t - 0.3 g = 3 a; the lower block has 0.4 g - 0.3 g = 2 a at most
    say("stack", "parts", (mpf("0.4") * G * mpf("1.5") - mpf("0.15") * G) / 2)


def rod():
    for degrees in (45, 60):
        a = mpf(degrees) * pi / 180
        say("rod", f"mu at {degrees} degrees", (1 + 3 * cos(a)**2) / (3 * sin(a) * cos(a)))
    say("rod", "least mu", mpf(4) / 3)


# -- linkages with one freedom: state (angle, rate)


def gauss(s):
    """Nodes on [0, 1] and the matrix of collocation."""
    coefficients = [mpf(1)]
    p0, p1 = [mpf(1)], [mpf(1), mpf(0)]
    for n in range(1, s):
        a = [(2 * n + 1) * c / (n + 1) for c in p1] + [mpf(0)]
        b = [mpf(0), mpf(0)] + [n * c / (n + 1) for c in p0]
        p0, p1 = p1, [x - y for x, y in zip(a, b)]
    coefficients = p1
    nodes = sorted((x + 1) / 2 for x in polyroots(coefficients, maxsteps=200, extraprec=200))
    left = matrix(s, s)
    right = matrix(s, s)
    for k in range(s):
        for j in range(s):
            left[j, k] = nodes[j]**k
            right[j, k] = nodes[j]**(k + 1) / (k + 1)
    a = right * left**-1
    weights = (matrix([[mpf(1) / (k + 1) for k in range(s)]]) * left**-1)
    return nodes, a, weights


NODES, MATRIX, WEIGHTS = gauss(8)


def advance(acceleration, q, v, h):
    """One step of collocation for q'' = acceleration(q, q'), by iteration."""
    stages = [acceleration(q, v)] * 8
    for _ in range(100):
        rates = [v + h * sum(MATRIX[i, j] * stages[j] for j in range(8)) for i in range(8)]
        places = [q + h * sum(MATRIX[i, j] * rates[j] for j in range(8)) for i in range(8)]
        new = [acceleration(x, y) for x, y in zip(places, rates)]
        off = max(abs(x - y) for x, y in zip(new, stages))
        stages = new
        if off < mpf(10)**-26 * (1 + max(abs(x) for x in stages)):
            break
    rates = [v + h * sum(MATRIX[i, j] * stages[j] for j in range(8)) for i in range(8)]
    return q + h * sum(WEIGHTS[0, j] * rates[j] for j in range(8)), v + h * sum(WEIGHTS[0, j] * stages[j] for j in range(8))


def until(acceleration, q, v, t, gap, h):
    """Steps up to a change of sign of gap(q, v), met by the length of the last one."""
    while True:
        q1, v1 = advance(acceleration, q, v, h)
        if gap(q1, v1) * gap(q, v) < 0:
            end = findroot(lambda s: gap(*advance(acceleration, q, v, s)), (h / 100, h), solver="anderson", tol=mpf(10)**-50)
            return (*advance(acceleration, q, v, end), t + end)
        q, v, t = q1, v1, t + h


R, ROD, MC, MR, MS = mpf("0.1"), mpf("0.3"), mpf(1), mpf("0.6"), mpf("0.8")


def crank(q):
    """Of the slider-crank: slope x' and curvature x'' of the slider, angle b of the rod with b' and b''."""
    root = sqrt(ROD**2 - (R * sin(q))**2)
    b1 = -R * cos(q) / root
    b2 = R * sin(q) / root - R * cos(q) * R * R * sin(q) * cos(q) / root**3
    x1 = -R * sin(q) - R * R * sin(q) * cos(q) / root
    u, du = R * R * sin(q) * cos(q), R * R * (cos(q)**2 - sin(q)**2)
    x2 = -R * cos(q) - du / root - u * u / root**3
    return root, b1, b2, x1, x2


def slider(level, pivot=mpf(0), mu=None):
    """Acceleration of the crank. Friction against the slider (constant or mu times the guide's load), and in the pivot."""
    def acceleration(q, v):
        root, b1, b2, x1, x2 = crank(q)
        # rod: centre in its middle, at half the sum of its ends' places
        ex1, ey1 = (x1 - R * sin(q)) / 2, R * cos(q) / 2
        ex2, ey2 = (x2 - R * cos(q)) / 2, -R * sin(q) / 2
        inertia = MC * R**2 / 3 + MR * (ex1**2 + ey1**2) + MR * ROD**2 / 12 * b1**2 + MS * x1**2
        centrifugal = MR * (ex1 * ex2 + ey1 * ey2) + MR * ROD**2 / 12 * b1 * b2 + MS * x1 * x2
        load = -MC * G * R / 2 * cos(q) - MR * G * ey1
        if mu is None:
            friction = -level * (1 if x1 * v > 0 else -1) * x1 - pivot * (1 if v > 0 else -1)
            return (load + friction - centrifugal * v**2) / inertia
        # the guide's load by moments of the rod about its centre, linear in acceleration and friction
        sense = 1 if x1 * v > 0 else -1
        def residual(a, n):
            f = -sense * mu * abs(n)
            push = MS * (x1 * a + x2 * v**2) - f            # of the rod on the slider, along x
            lift = MS * G - n                               # and upwards
            bx = MR * (ex1 * a + ex2 * v**2) + push         # of the crank on the rod
            by = MR * (ey1 * a + ey2 * v**2) + MR * G + lift
            cx, cy = root / 2, -R * sin(q) / 2              # half the rod, from the crank's end
            turn = cx * (-lift) - cy * (-push) - (cx * by - cy * bx)
            balance = inertia * a + centrifugal * v**2 - load - x1 * f
            return balance, turn - MR * ROD**2 / 12 * (b1 * a + b2 * v**2)
        best = None
        for side in (1, -1):                                # |n| = side n
            at = [residual(mpf(x), mpf(side * y)) for x, y in ((0, 0), (1, 0), (0, 1))]
            m = matrix([[at[1][k] - at[0][k], at[2][k] - at[0][k]] for k in range(2)])
            a, n = m**-1 * matrix([-at[0][0], -at[0][1]])
            best = a if n >= 0 and (best is None or side == 1) else best
        return best
    return acceleration


def linkages():
    mp.dps, h = 34, mpf(1) / 200
    law = slider(0, mu=mpf("0.4"))
    q, v, t = pi / 3, mpf(15), mpf(0)
    say("guide", "start acceleration", law(q, v), 16)
    for n in (1, 2):
        q, v, t = until(law, q, v, t, lambda q, v, n=n: q - n * pi, h)
        say("guide", f"dead centre {n}", t, 15)
        q += mpf(10)**-33
    q, v, t = until(law, q, v, t, lambda q, v: v, h)
    say("guide", "sticks", t, 15)
    say("guide", "angle", q, 16)
    law = slider(mpf(3), pivot=mpf("0.5"))
    q, v, t = 5 * pi / 180, -mpf(10)**-33, mpf(0)
    q, v, t = until(law, q, v, t, lambda q, v: q, h)
    say("pair", "dead centre", t, 15)
    q, v, t = until(law, q - mpf(10)**-33, v, t, lambda q, v: v, h)
    say("pair", "rests", t, 15)
    say("pair", "angle", q, 16)


def rest_sets():
    def excess(q):                                          # of the load over the guide's friction, at rest
        root, _, _, x1, _ = crank(q)
        def balance(n):
            f = (MC * G * R / 2 * cos(q) + MR * G * R * cos(q) / 2) / x1   # holds the slider
            push, lift = -f, MS * G - n
            cx, cy = root / 2, -R * sin(q) / 2
            bx, by = push, MR * G + lift
            return f, cx * (-lift) - cy * (-push) - (cx * by - cy * bx)
        f, at0 = balance(mpf(0))
        n = -at0 / (balance(mpf(1))[1] - at0)
        return abs(f) - mpf("0.4") * abs(n)
    for low in ("0.93", "1.97"):
        say("rest set of the guide", "end", findroot(excess, mpf(low)))
    pair = lambda q: mpf("0.7848") * cos(q) - mpf("0.5") - 3 * abs(crank(q)[3])
    say("rest set of the pair", "end", findroot(pair, mpf("0.5")))
    other = lambda q: -mpf("0.7848") * cos(q) - mpf("0.5") - 3 * abs(crank(q)[3])
    say("rest set of the pair", "other end", findroot(other, mpf("2.5")))


print("# closed forms in 40 digits; linkages by collocation of order 16")
print("problem,quantity,value")
for problem in (belt, spring, incline, pendulum, stack, rod, rest_sets, linkages):
    problem()
