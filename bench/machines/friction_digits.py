#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of problems of dry friction by closed forms in 40 digits (mpmath), from the laws alone:

    friction_digits belt > friction_belt.csv
    friction_digits spring > friction_spring.csv
    friction_digits incline > friction_incline.csv
    friction_digits pendulum > friction_pendulum.csv
    friction_digits stack > friction_stack.csv
    friction_digits shares > friction_shares.csv
    friction_digits rod > friction_rod.csv
"""
import sys

from mpmath import asin, atan, cos, findroot, mp, mpf, pi, quad, sin, sqrt

from digit_table import Table

mp.dps = 40
G = mpf("9.81")


def belt():
    """Limit cycle of a block on a belt: the spring pulls it back from the static level, then it slips about the other one."""
    v, high, low, end = mpf("0.2"), mpf(1), mpf("0.6"), mpf(50)
    slip = 2 * (pi - atan((high - low) / v))
    first = findroot(lambda t: low * sin(t) - v, mpf("0.34"))  # x' = F sin t of a spring that is free at t = 0
    back = 2 * low - high                                      # where it sticks again
    table = Table("friction_belt", "q.s", "qd.s")
    table.event(0, "friction 'rub' slips backward")
    x = low * (1 - cos(first))
    table.event(first, "friction 'rub' sticks", x - v * first, 0)
    t = first + (high - x) / v
    while True:
        table.event(t, "friction 'rub' slips backward", high - v * t, 0)
        t += slip
        table.event(t, "friction 'rub' sticks", back - v * t, 0)
        if t + (high - back) / v > end:
            break
        t += (high - back) / v
    table.state(end, back + v * (end - t) - v * end, 0)


def spring():
    table = Table("friction_spring", "q.x", "qd.x", "force.rub")
    for static, turns in ((None, 4), (8, 3)):
        table.set = f"static={static}" if static else ""
        for n in range(turns):
            x = (-1)**n * (mpf("0.25") - mpf("0.06") * n)
            table.event(n * pi / 10, f"friction 'rub' slips {'forward' if n % 2 else 'backward'}", x, 0)
        x = (-1)**turns * (mpf("0.25") - mpf("0.06") * turns)
        table.event(turns * pi / 10, "friction 'rub' sticks")
        table.state(5, x, 0, 100 * x)


def incline():
    level, weight = mpf("0.5") * G * cos(pi / 9), G * sin(pi / 9)
    force = lambda t: 9 * sin(2 * pi * t)
    rate = lambda t, t0, s: 9 / (2 * pi) * (cos(2 * pi * t0) - cos(2 * pi * t)) - (weight + s * level) * (t - t0)
    way = lambda t, t0, s: (9 / (2 * pi) * (cos(2 * pi * t0) * (t - t0) - (sin(2 * pi * t) - sin(2 * pi * t0)) / (2 * pi))
                            - (weight + s * level) * (t - t0)**2 / 2)
    between = lambda f, a, b: findroot(f, (mpf(a), mpf(b)), solver="anderson")
    table = Table("friction_incline", "q.x", "qd.x")
    table.event(0, "friction 'rub' sticks", 0, 0)
    up = asin((weight + level) / 9) / (2 * pi)
    table.event(up, "friction 'rub' slips forward", 0, 0)
    stick, x = between(lambda t: rate(t, up, 1), "0.38", "0.43"), mpf(0)
    for n in range(3):
        x += way(stick, up, 1)
        table.event(stick, "friction 'rub' sticks", x, 0)
        down = between(lambda t: force(t) - weight + level, n + mpf("0.5"), n + mpf("0.55"))
        table.event(down, "friction 'rub' slips backward", x, 0)
        if n == 2:
            table.state(3, x + way(3, down, -1), rate(3, down, -1))
            break
        up = between(lambda t: rate(t, down, -1), n + mpf("1.25"), n + mpf("1.35"))
        x += way(up, down, -1)
        assert force(up) > weight + level                     # stick is refused: up at once
        table.event(up, "friction 'rub' slips forward", x, 0)
        stick = between(lambda t: rate(t, up, 1), up + mpf("0.02"), n + mpf("1.45"))


def pendulum():
    angle, t, torque = mpf("1.5"), mpf(0), mpf(1)
    table = Table("friction_pendulum", "q.th", "qd.th", "force.rub")
    for n in range(7):
        held = abs(G * sin(angle)) < torque
        table.event(t, "friction 'rub' sticks" if held else f"friction 'rub' slips {'forward' if n % 2 else 'backward'}", angle, 0)
        if held:
            break
        gain = lambda th: G * (cos(th) - cos(angle)) - torque * abs(th - angle)
        far = findroot(gain, -angle * mpf("0.8"))
        middle, half = (angle + far) / 2, (angle - far) / 2    # sine substitution: the rate has a root at both ends
        t += quad(lambda s: abs(half) * cos(s) / sqrt(abs(2 * gain(middle + half * sin(s)))), [-pi / 2, 0, pi / 2])
        angle = far
    table.state(7, angle, 0, G * sin(angle))


def stack():
    """2 kg on the ground, 1 kg on it, pulled with 2 t until t = 6: one of two that stick breaks away, the other must not."""
    table = Table("friction_stack", "q.x1", "qd.x1", "q.s", "qd.s")
    low, high = mpf("0.1") * 3 * G, mpf("0.4") * G
    table.event(0, "friction 'floor' sticks")
    table.event(0, "friction 'between' sticks")
    breaks = low / 2
    table.event(breaks, "friction 'floor' slips forward", 0, 0, 0, 0)
    parts = ((high - low) / 2 * 3 + low) / 2                  # together 2 t - low = 3 a; high - low = 2 a at most
    v = ((parts**2 - breaks**2) - low * (parts - breaks)) / 3
    x = ((parts**3 - breaks**3) / 3 - breaks**2 * (parts - breaks) - low * (parts - breaks)**2 / 2) / 3
    table.event(parts, "friction 'between' slips forward", x, v, 0, 0)
    t, a = 6 - parts, (high - low) / 2
    x1, v1 = x + v * t + a * t * t / 2, v + a * t
    v2 = v + 36 - parts**2 - high * t
    x2 = x + v * t + (mpf(216) - parts**3) / 3 - parts**2 * t - high * t * t / 2
    table.state(6, x1, v1, x2 - x1, v2 - v1)
    t = (v2 - v1) / (high + a)
    x1, x2, v1, v2 = x1 + v1 * t + a * t * t / 2, x2 + v2 * t - high * t * t / 2, v1 + a * t, v2 - high * t
    table.event(6 + t, "friction 'between' sticks", x1, v1, x2 - x1, 0)
    stops = 6 + t + v1 / (low / 3)
    way = v1**2 / (2 * low / 3)
    table.event(stops, "friction 'floor' sticks", x1 + way, 0, x2 - x1, 0)
    table.state(14, x1 + way, 0, x2 - x1, 0)


def shares():
    """Levels 1 and 5 on one coordinate under a load 4 t: both hold until it exceeds 6."""
    table = Table("friction_shares", "q.x", "qd.x")
    for word in ("weak", "strong"):
        table.event(0, f"friction '{word}' sticks")
    table.state(1, 0, 0)
    for word in ("weak", "strong"):
        table.event(mpf("1.5"), f"friction '{word}' slips forward")
    table.state(2, 4 * mpf("0.5")**3 / 6, 4 * mpf("0.5")**2 / 2)


def rod():
    """A rod whose end slides on rough ground: beyond a coefficient slip has two solutions, or none."""
    table = Table("friction_rod", "qd.j.1")
    for degrees in (45, 60):
        a = mpf(degrees) * pi / 180
        most = (1 + 3 * cos(a)**2) / (3 * sin(a) * cos(a))
        for far in (mpf("-1e-6"), mpf("1e-6")):
            table.set = f"a={degrees}deg v=-1 mu={mp.nstr(most + far, 20)}"
            if far < 0:
                table.event(0, "friction 'rub' slips backward")
                table.end(mpf("1e-9"))
            else:
                table.refused("'rub' can neither slip nor stick at t = 0")
        table.set = f"a={degrees}deg v=1 mu={mp.nstr(most + mpf('1e-2'), 20)}"
        table.event(0, "growth the level of 'rub' grows by")
        table.event(0, "friction 'rub' slips forward")
        table.event(0, "solutions force 'rub' has two solutions")
        table.end(mpf("1e-9"))


if __name__ == "__main__":
    {f.__name__: f for f in (belt, spring, incline, pendulum, stack, shares, rod)}[sys.argv[1]]()
