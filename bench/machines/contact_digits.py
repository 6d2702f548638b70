#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of problems of contact by closed forms and quadrature in 40 digits (mpmath), from the laws alone:

    contact_digits bounce > contact_bounce.csv
    contact_digits rolling > contact_rolling.csv
    contact_digits slider_crank > contact_slider_crank.csv
    contact_digits sphere > contact_sphere.csv
    contact_digits corners > contact_corners.csv
    contact_digits incline > contact_incline.csv
    contact_digits spin > contact_spin.csv
    contact_digits oblique > contact_oblique.csv
    contact_digits hollow > contact_hollow.csv
    contact_digits arc > contact_arc.csv
    contact_digits crest > contact_crest.csv
    contact_digits bowling > contact_bowling.csv
    contact_digits wall > contact_wall.csv
    contact_digits turntable > contact_turntable.csv
    contact_digits valley > contact_valley.csv
    contact_digits loop > contact_loop.csv
    contact_digits dome > contact_dome.csv
    contact_digits coin > contact_coin.csv
    contact_digits restitution > compliant_restitution.csv
    contact_digits depth > compliant_depth.csv
    contact_digits stiffness > compliant_stiffness.csv
"""
import sys

from mpmath import acos, asin, atan, cos, diff, ellipfun, ellipk, exp, findroot, log, mp, mpf, pi, quad, sin, sqrt, tan

from digit_table import Table

mp.dps = 40
G = mpf("9.81")


def bounce():
    """A ball from a height of 1 with restitution 0.8: impacts less than 1 us apart close the contact."""
    e, rate, time = mpf("0.8"), sqrt(2 * G), sqrt(2 / G)
    table = Table("contact_bounce", "q.z", "qd.z")
    while True:
        table.event(time, "impact 'floor'")
        rate *= e
        flight = 2 * rate / G
        for t in (mpf("0.5"), mpf(1), mpf(2), mpf(3)):
            if time < t < time + flight:
                table.state(t, rate * (t - time) - G * (t - time)**2 / 2, rate - G * (t - time))
        if flight < mpf("1e-6"):
            break
        time += flight
    table.event(time, "contact 'floor' closes")
    table.state(5, 0, 0)


def rolling():
    """A solid sphere slips, then rolls if friction is enough."""
    radius = mpf("0.1")
    table = Table("contact_rolling", "q.b.1", "qd.b.1", "q.b.3", "qd.b.3", "force.floor", "force.floor_friction")

    def run(degrees, mu, v, spin):
        """Rates down the slope, and of rolling: radius times the rate about the axis is -v."""
        a = mpf(degrees) * pi / 180
        push = mu * G * cos(a)
        table.event(0, "contact 'floor' closes")
        side = 1 if v + radius * spin > 0 else -1
        table.event(0, f"friction 'floor_friction' slips {'forward' if side > 0 else 'backward'}")
        slide, turn = G * sin(a) - side * push, -side * push * radius / (mpf("0.4") * radius**2)
        change = slide + radius * turn                       # of the rate of slip
        t = -(v + radius * spin) / change if side * change < 0 else mpf(3)
        end = min(t, mpf(2))
        x, angle = v * end + slide * end**2 / 2, spin * end + turn * end**2 / 2
        v, spin = v + slide * end, spin + turn * end
        if t > 2:
            table.state(2, x, v, angle, spin, G * cos(a), -side * push)
            return
        table.event(t, "friction 'floor_friction' sticks", x, v, angle, spin)
        roll, left = 5 * G * sin(a) / 7, 2 - t
        x += v * left + roll * left**2 / 2
        angle += spin * left - roll / radius * left**2 / 2
        v, spin = v + roll * left, spin - roll / radius * left
        table.state(2, x, v, angle, spin, G * cos(a), -2 * G * sin(a) / 7)

    run(10, mpf("0.15"), mpf(2), mpf(0))
    table.set = "slope=40deg"
    run(40, mpf("0.15"), mpf(2), mpf(0))
    table.set = "slope=0 spin=60"
    run(0, mpf("0.15"), mpf(2), mpf(60))


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


def slider_crank():
    """Slider limited at -0.3 m with restitution 0.5, crank at 20 rad/s from the outer dead centre; half a period for the place at the end."""
    mp.dps = 25
    table = Table("contact_slider_crank", "q.crank", "q.slider", how="energy and quadrature, 25 digits")
    at = findroot(lambda angle: slider(angle) + mpf("0.3"), mpf("1.6"))
    energy = inertia(mpf(0)) * 400 / 2 + potential(mpf(0))

    def passage(start, end, energy):
        return quad(lambda angle: 1 / sqrt(2 * (energy - potential(angle)) / inertia(angle)), [min(start, end), max(start, end)])

    first = passage(mpf(0), at, energy)
    rebound = (energy - potential(at)) / 4 + potential(at)
    second = first + passage(-at, at, rebound)
    table.event(first, "impact 'stop'", at, "-0.3")
    table.event(second, "impact 'stop'", -at, "-0.3")
    angle = -at + mpf("0.1")                                  # after the second impact it turns forward again
    energy = (rebound - potential(-at)) / 4 + potential(-at)
    table.state(second + passage(-at, angle, energy), angle, slider(angle))


def sphere():
    """A point mass on a smooth sphere of radius 1, from rest 0.5 rad off the top: it leaves where cos is 2/3 of that at the start."""
    mp.dps = 25
    start = mpf("0.5")
    leaves = acos(cos(start) * 2 / 3)
    # with the angle start + s^2 there is no singular end
    time = quad(lambda s: s / sqrt(G * sin(start + s * s / 2) * sin(s * s / 2)), [0, sqrt(leaves - start)])
    rate = sqrt(2 * G * (cos(start) - cos(leaves)))
    table = Table("contact_sphere", "q.p.1", "q.p.2", how="energy and quadrature, 25 digits")
    table.event(0, "contact 'c' closes")
    table.event(time, "contact 'c' opens", sin(leaves), cos(leaves))
    t = 1 - time
    table.state(1, sin(leaves) + rate * cos(leaves) * t, cos(leaves) - rate * sin(leaves) * t - G * t * t / 2)


def incline():
    """A puck of speed 2 across an incline of 30 deg. With the angle p from the slope, k = mu/tan(30 deg) and g' the gravity along the slope
    v sin(p)/tan(p/2)^k is constant, and dp/dt = -g' sin(p)/v. It stops where k > 1; with k = 1 the speed and its part down the slope have a
    constant sum."""
    mp.dps = 30
    along, begin = G / 2, pi / 2
    table = Table("contact_incline", "q.x", "q.y", "qd.x", "qd.y", "force.floor_friction1", "force.floor_friction2", how="quadrature, 30 digits")

    def run(mu, times):
        k = mu * sqrt(mpf(3))
        ends = [begin / 8, begin / 2, begin]
        speed = lambda p: 2 * tan(p / 2)**k / sin(p)
        time = lambda p: quad(lambda p: speed(p) / (along * sin(p)), [p, *[e for e in ends if e > p]])
        way = lambda p: quad(lambda p: speed(p)**2 / along / tan(p), [p, *[e for e in ends if e > p]])
        across = lambda p: quad(lambda p: speed(p)**2 / along, [p, *[e for e in ends if e > p]])
        table.event(0, "contact 'floor' closes")
        table.event(0, "friction 'floor_friction' slips")
        push = 2 * mu * G * cos(pi / 6)
        stop = time(mpf(0)) if k > 1 else mpf(100)
        for t in times:
            if t > stop:
                continue
            p = begin * exp(findroot(lambda u: time(begin * exp(u)) - t, (mpf(-12), mpf(0)), solver="illinois", tol=mpf(10)**-48))
            table.state(t, way(p), across(p), speed(p) * cos(p), speed(p) * sin(p), -push * cos(p), -push * sin(p))
        if k > 1:
            table.event(stop, "friction 'floor_friction' sticks", way(mpf(0)), across(mpf(0)))
            table.state(2, way(mpf(0)), across(mpf(0)), 0, 0, -2 * along, 0)

    run(tan(pi / 6), (mpf("0.25"), mpf("0.5"), mpf(1)))
    table.set = "mu=0.8"
    run(mpf("0.8"), (mpf("0.25"), mpf("0.5")))
    table.set = "mu=0.3"
    run(mpf("0.3"), (mpf("0.25"), mpf("0.5")))


def spin():
    """A stool on three feet spins until it stops; its feet slip across their radius."""
    table = Table("contact_spin", "q.s.4", "qd.s.4", "force.A_friction1", "force.A_friction2")
    mu, mass, radius, inertia, w = mpf("0.3"), mpf(3), mpf("0.2"), mpf("0.09"), mpf(8)
    fall = mu * mass * G * radius / inertia
    for name in "ABC":
        table.event(0, f"contact '{name}' closes")
        table.event(0, f"friction '{name}_friction' slips")
    t = mpf("0.2")
    angle, push = w * t - fall * t * t / 2, mu * mass * G / 3
    table.state(t, angle, w - fall * t, push * sin(angle), -push * cos(angle))
    for name in "ABC":
        table.event(w / fall, f"friction '{name}_friction' sticks", w**2 / fall / 2)
    table.state(1, w**2 / fall / 2, 0, 0, 0)


def oblique():
    """A puck falls from a height of 1 with rates 3 and 4 along the floor: the impulse of friction is mu times the normal one, against the
    slip, or takes it away. Then at rest on the floor a load that turns: slip begins at the level."""
    e, rate, time = mpf("0.6"), sqrt(2 * G), sqrt(2 / G)
    table = Table("contact_oblique", "q.x", "q.y", "q.z", "qd.x", "qd.y", "qd.z")
    for mu in (mpf("0.2"), mpf("0.9")):
        table.set = f"mu={mp.nstr(mu, 3)}"
        left = max(1 - mu * (1 + e) * rate / 5, mpf(0))
        t = mpf("0.6") - time
        table.event(time, "impact 'floor'")
        table.state(mpf("0.6"), 3 * time + 3 * left * t, 4 * time + 4 * left * t, mpf("0.1") + e * rate * t - G * t * t / 2, 3 * left, 4 * left,
                    e * rate - G * t)
    table.set = "mu=0.4 h=0 vx=0 vy=0 load=2"
    table.event(0, "contact 'floor' closes")
    table.event(0, "friction 'floor_friction' sticks")
    table.event(mpf("0.4") * G, "friction 'floor_friction' slips", 0, 0, mpf("0.1"))
    table.end(4)


def hollow():
    """A cylinder of radius r = 0.1 rolls from rest, 1 rad off the bottom, in a hollow of radius 1: a pendulum with 2/3 of g/(R - r)."""
    table = Table("contact_hollow", "q.c.1", "q.c.2", "q.c.3", "force.in", "force.in_friction", how="elliptic functions, 40 digits")
    reach, rate, k = mpf("0.9"), sqrt(2 * G / 3 / mpf("0.9")), sin(mpf(1) / 2)
    sn = ellipfun("sn")
    table.event(0, "contact 'in' closes")
    table.event(0, "friction 'in_friction' sticks")
    for t in (mpf(1), mpf(3), mpf(5)):
        a = 2 * asin(k * sn(ellipk(k**2) - rate * t, m=k**2))
        fall = 2 * G * (cos(a) - cos(mpf(1)))
        table.state(t, reach * sin(a), -reach * cos(a), (mpf(1) - a) * reach / mpf("0.1"), 2 * (G * cos(a) + 2 * fall / 3), 2 * G * sin(a) / 3)


def square(start, m, g):
    """w from rest at an angle, with dw/dp = -2 g sin p - 2 m (g cos p + w)."""
    b = -6 * m * g / (1 + 4 * m * m)
    a = 2 * g + 2 * m * b
    c = -(a * cos(start) + b * sin(start)) * exp(2 * m * start)
    return lambda p: a * cos(p) + b * sin(p) + c * exp(-2 * m * p)


def arc():
    """A point slides with friction in a hollow cylinder of radius 1, from rest 1.2 rad off the bottom, until it stops for ever;
    with the angle p from the bottom and w = p'^2, which each way with the sense s has by dw/dp = -2 g sin p - 2 s mu (g cos p + w)."""
    mp.dps = 30
    table = Table("contact_arc", "q.c.1", "q.c.2", "qd.c.1", "qd.c.2", how="closed form of the speed, quadrature of the time, 30 digits")

    p, t, sense, mu = mpf("-1.2"), mpf(0), 1, mpf("0.2")
    table.event(0, "contact 'on' closes")
    table.event(0, "friction 'on_friction' slips forward")
    while True:
        w = square(p, sense * mu, G)
        end = findroot(w, -p * mpf("0.8"))
        way = end - p
        t += quad(lambda u: abs(way) * sin(u) / 2 / sqrt(w(p + way * (1 - cos(u)) / 2)), [0, pi / 4, pi / 2, 3 * pi / 4, pi])
        p, sense = end, -sense
        if abs(tan(p)) <= mu:
            break
        table.event(t, f"friction 'on_friction' slips {'forward' if sense > 0 else 'backward'}", sin(p), -cos(p), 0, 0)
    table.event(t, "friction 'on_friction' sticks", sin(p), -cos(p), 0, 0)
    table.state(3, sin(p), -cos(p), 0, 0)


def crest():
    """The same point on the cylinder, from rest 0.6 rad off the crest: it leaves where w = g cos p, p being the angle from the crest."""
    mp.dps = 30
    table = Table("contact_crest", "q.c.1", "q.c.2", "qd.c.1", "qd.c.2", how="closed form of the speed, quadrature of the time, 30 digits")
    start = mpf("0.6")
    w = square(start, -mpf("0.2"), -G)
    leaves = findroot(lambda p: w(p) - G * cos(p), mpf("1.1"))
    way = leaves - start
    time = quad(lambda u: 2 * u * way / sqrt(w(start + way * u * u)), [0, mpf("0.5"), 1])
    table.event(0, "contact 'on' closes")
    table.event(0, "friction 'on_friction' slips backward")
    table.event(time, "contact 'on' opens", sin(leaves), cos(leaves))
    rate, t = sqrt(w(leaves)), mpf("1.2") - time
    table.state(mpf("1.2"), sin(leaves) + rate * cos(leaves) * t, cos(leaves) - rate * sin(leaves) * t - G * t * t / 2, rate * cos(leaves),
                -rate * sin(leaves) - G * t)


def corners():
    """A box 2 a wide falls flat at 1 m/s on corners with 0.8 and 0.2."""
    left, right, a, t = mpf("0.8"), mpf("0.2"), mpf("0.5"), mpf("0.25")
    up, turn = (left + right) / 2, (right - left) / (2 * a)
    table = Table("contact_corners", "q.b.2", "qd.b.2", "q.b.3", "qd.b.3")
    table.event(1, "impact 'L' struck at 1")
    table.state(1 + t, mpf("0.2") + up * t, up, turn * t, turn)


def bowling():
    """A ball slips with spin about two axes, along a parabola, and rolls on from 2 u/(7 mu g), where u is its slip at the start."""
    table = Table("contact_bowling", "q.b.1", "q.b.2", "qd.b.1", "qd.b.2", "force.floor", "force.floor_friction1", "force.floor_friction2")
    mu, radius, v, w = mpf("0.2"), mpf("0.1"), (mpf(3), mpf("0.5")), (mpf(25), mpf(5))
    slip = (v[0] - radius * w[1], v[1] + radius * w[0])
    size = sqrt(slip[0]**2 + slip[1]**2)
    push = [-mu * G * u / size for u in slip]
    end = 2 * size / (7 * mu * G)
    place = lambda t: [a * t + b * t * t / 2 for a, b in zip(v, push)]
    rate = lambda t: [a + b * t for a, b in zip(v, push)]
    table.event(0, "contact 'floor' closes")
    table.event(0, "friction 'floor_friction' slips")
    table.state(mpf("0.4"), *place(mpf("0.4")), *rate(mpf("0.4")), G, *push)
    table.event(end, "friction 'floor_friction' sticks", *place(end), *rate(end))
    table.state(2, *[a + b * (2 - end) for a, b in zip(place(end), rate(end))], *rate(end), G, 0, 0)


def wall():
    """A ball that rolls inside an upright cylinder: its height oscillates with sqrt(2/7) of its rate around the axis. The spin about
    the normal grows with the height."""
    table = Table("contact_wall", "q.b.1", "q.b.2", "q.b.3", "qd.b.1", "qd.b.2", "qd.b.3", "force.wall", "force.wall_friction1")
    radius, arm, turn, rise, spin = mpf("0.1"), mpf("0.5"), mpf(4), mpf("0.7"), mpf(15)
    w = turn * sqrt(mpf(2) / 7)
    middle = -5 * G / (2 * turn**2) - radius * spin / turn
    table.event(0, "contact 'wall' closes")
    table.event(0, "friction 'wall_friction' sticks")
    for t in (mpf(1), mpf(3)):
        z = middle - middle * cos(w * t) + rise / w * sin(w * t)
        table.state(t, arm * cos(turn * t), arm * sin(turn * t), z, -arm * turn * sin(turn * t), arm * turn * cos(turn * t),
                    middle * w * sin(w * t) + rise * cos(w * t), arm * turn**2, G - w * w * (z - middle))


def turntable():
    """A ball rolls on a table that turns: its velocity turns with 2/7 of the rate of the table."""
    table = Table("contact_turntable", "q.b.1", "q.b.2", "qd.b.1", "qd.b.2", "force.on")
    w, x, v = mpf(6) / 7, mpf(1), mpf("0.3")
    table.event(0, "contact 'on' closes")
    table.event(0, "friction 'on_friction' sticks")
    for t in (mpf(2), mpf(5)):
        table.state(t, x + v / w * sin(w * t), v / w * (1 - cos(w * t)), v * cos(w * t), v * sin(w * t), G)


def valley():
    """A point slides in a parabola y = x^2/2 with friction, from -0.8 until it stays. With v^2 = u: du/dx = -2 g (x + s mu) - 2 s mu u/(1 + x^2),
    s the sign of the rate, whose integrating factor is exp(2 s mu atan x)."""
    mp.dps = 25
    table = Table("contact_valley", "q.x", "q.y", how="quadrature, 25 digits")
    mu, x, t, side = mpf("0.1"), mpf("-0.8"), mpf(0), 1
    table.event(0, "contact 'on' closes")
    table.event(0, "friction 'on_friction' slips forward")
    while abs(x) > mu:
        weight = lambda at, s: exp(2 * s * mu * atan(at))
        square = lambda at, start, s: -2 * G * quad(lambda z: (z + s * mu) * weight(z, s), [start, at]) / weight(at, s)
        left = findroot(lambda at: square(at, x, side), (-x * mpf("0.7"), -x * mpf("0.9")), solver="secant")
        middle, half = (x + left) / 2, abs(left - x) / 2
        # x = middle + half sin(angle): the rate has the zeros of cos at both ends
        start = x
        pace = lambda angle: half * cos(angle) * sqrt(abs((1 + (middle + side * half * sin(angle))**2) / square(middle + side * half * sin(angle), start, side)))
        t += quad(pace, [-pi / 2, -pi / 4, 0, pi / 4, pi / 2])
        x, side = left, -side
        word = "sticks" if abs(x) <= mu else "slips forward" if side > 0 else "slips backward"
        table.event(t, f"friction 'on_friction' {word}", x, x * x / 2)
    table.state(5, x, x * x / 2)


def loop():
    """A ball rolls through the top of a bowl, along the great circle at 0.3 rad from x: a pendulum that turns, of the length 7/5 0.9."""
    table = Table("contact_loop", "q.b.1", "q.b.2", "q.b.3", "qd.b.1", "qd.b.2", "qd.b.3", "force.in", how="elliptic functions, 40 digits")
    arm, speed, side = mpf("0.9"), mpf(8), mpf("0.3")
    pull = 5 * G / (7 * arm)
    fastest = sqrt((speed / arm)**2 + 4 * pull)
    part = 4 * pull / fastest**2
    table.event(0, "contact 'in' closes")
    table.event(0, "friction 'in_friction' sticks")
    for t in (mpf("0.4"), mpf("1.5"), mpf(2)):
        u = ellipk(part) + fastest * t / 2
        s, c, rate = ellipfun("sn", u, m=part), ellipfun("cn", u, m=part), fastest * ellipfun("dn", u, m=part)
        out, up = 2 * s * c, 1 - 2 * c * c                 # sine and negative cosine of the angle from the bottom; out < 0 beyond the top
        table.state(t, -arm * out * cos(side), -arm * out * sin(side), arm * up, arm * up * rate * cos(side), arm * up * rate * sin(side),
                    arm * out * rate, arm * rate**2 - G * up)


def dome():
    """A ball rolls off a fixed ball from rest at 0.3 rad, along the great circle at 0.7 rad from x. It slips where 2 sin a = mu (17 cos a -
    10 cos 0.3), leaves where its normal force is zero, and flies."""
    mp.dps = 30
    table = Table("contact_dome", "q.b.1", "q.b.2", "q.b.3", "qd.b.1", "qd.b.2", "qd.b.3", how="closed form and quadrature, 30 digits")
    mu, arm, start, side = mpf("0.5"), mpf("1.2"), mpf("0.3"), mpf("0.7")
    slips = findroot(lambda a: 2 * sin(a) - mu * (17 * cos(a) - 10 * cos(start)), mpf("0.7"))
    rolling = lambda a: 20 * G / (7 * arm) * sin((a + start) / 2) * sin((a - start) / 2)             # squares of the angular rate
    fall = lambda a: quad(lambda z: (sin(z) - mu * cos(z)) * exp(2 * mu * (a - z)), [slips, a])
    slipping = lambda a: rolling(slips) * exp(2 * mu * (a - slips)) + 2 * G / arm * fall(a)
    leaves = findroot(lambda a: arm * slipping(a) - G * cos(a), (mpf("0.85"), mpf("0.95")), solver="secant")

    def state(a, rate):
        out, up = arm * cos(a) * rate, -arm * sin(a) * rate
        return [arm * sin(a) * cos(side), arm * sin(a) * sin(side), arm * cos(a), out * cos(side), out * sin(side), up]

    table.event(0, "contact 'on' closes")
    table.event(0, "friction 'on_friction' sticks")
    t = quad(lambda z: 2 * z / sqrt(rolling(start + z * z)), [0, sqrt(slips - start)], method="gauss-legendre")
    table.event(t, "friction 'on_friction' slips", *state(slips, sqrt(rolling(slips))))
    t += quad(lambda a: 1 / sqrt(slipping(a)), [slips, leaves])
    at = state(leaves, sqrt(slipping(leaves)))
    table.event(t, "contact 'on' opens", *at)
    left = mpf("1.2") - t
    place = [x + v * left for x, v in zip(at, at[3:])]
    table.state(mpf("1.2"), *place[:2], place[2] - G * left**2 / 2, *at[3:5], at[5] - G * left)


def coin():
    """A disc that rolls in a circle with a constant lean: moments about its centre balance."""
    table = Table("contact_coin", "q.b.1", "q.b.2", "q.b.3", "qd.b.1", "qd.b.2", "force.floor", "force.floor_friction1", "force.floor_friction2")
    radius, lean, turn = mpf("0.1"), mpf("1.2"), mpf(4)
    roll = (turn**2 * sin(lean) * cos(lean) / 4 - G * cos(lean) / radius) / (mpf("1.5") * turn * sin(lean))
    circle = radius * roll / turn
    table.event(0, "contact 'floor' closes")
    table.event(0, "friction 'floor_friction' sticks")
    for t in (mpf("0.5"), mpf(1)):
        x, y = -circle * sin(turn * t), circle * cos(turn * t)
        table.state(t, x, y, radius * sin(lean), -turn * y, turn * x, G, -turn**2 * x, -turn**2 * y)


def restitution_of(a):
    """Of F = K d^n (1 + a d') at a rate of 1, for any K and n: a (1 + e) = ln((1 + a)/(1 - a e))."""
    low, high = mpf(0), min(mpf(1), 1 / a)
    for _ in range(400):
        e = (low + high) / 2
        low, high = (e, high) if a * (1 + e) > log((1 + a) / (1 - a * e)) else (low, e)
    return e


def restitution():
    """Balls that meet a floor with 1 m/s after 1 ms, each with its own law."""
    factors = [mpf(x) for x in ("0.01", "0.1", "0.5", "1", "2")]
    names = [f"qd.a{k}" for k in range(1, 6)] + ["qd.lankarani_nikravesh", "qd.hunt_crossley", "qd.flores"]
    table = Table("compliant_restitution", *names, atol="1e-14")
    for c in (mpf(x) for x in ("0.9", "0.7", "0.5", "0.3")):
        table.set = f"c={mp.nstr(c, 3)}"
        laws = (3 * (1 - c * c) / 4, 3 * (1 - c) / 2, 8 * (1 - c) / (5 * c))
        table.state(mpf("0.2"), *(restitution_of(a) for a in (*factors, *laws)))


def depth():
    """Largest depth, force there and duration of F = K d^1.5 (1 + a d'), by its energy: d(v^2/2)/(1 + a v) = -K d^1.5 dd."""
    mp.dps = 60
    table = Table("compliant_depth", "q.z", "qd.z", "force.floor.normal", how="energy and quadrature, 30 digits", atol="1e-14")
    stiffness, start = mpf(10)**6, mpf("0.001")
    for a in (mpf("0.2"), mpf(0)):
        table.set = f"a={mp.nstr(a, 2)}"
        work = lambda v: v / a - log(1 + a * v) / a**2 if a else v * v / 2      # integral of v/(1 + a v)
        place = lambda v: (mpf("2.5") / stiffness * (work(mpf(1)) - work(v)))**mpf("0.4")
        most, e = place(mpf(0)), restitution_of(a) if a else mpf(1)
        # dt = -dv/(K d^1.5 (1 + a v)) is smooth in u of v = end (1 - u^5), for d^1.5 grows with u^3
        speed = lambda u, end: 5 * abs(end) * u**4 / (stiffness * place(end * (1 - u**5))**mpf("1.5") * (1 + a * end * (1 - u**5)))
        way = lambda end: quad(lambda u: speed(u, end), [0, mpf("0.5"), 1], method="gauss-legendre")
        table.event(start, "event contact 'floor' closes", 0, -1)
        table.state(start + way(mpf(1)), -most, 0, stiffness * most**mpf("1.5"))
        end = start + way(mpf(1)) + way(-e)
        table.event(end, "event contact 'floor' opens", 0, e)
        table.state(mpf("0.02"), e * (mpf("0.02") - end), e, 0)


def stiffness():
    """By Hertz: a steel sphere on a plane, a journal in a bearing, as forces at a depth of 1 m; Johnson's cylinder in a cylinder."""
    modulus = mpf("207e9") / (2 * (1 - mpf("0.09")))
    hertz = lambda radius: 4 * modulus / 3 * sqrt(radius)
    table = Table("compliant_stiffness", "force.sphere.normal", "force.socket.normal", "force.pin.normal")
    gap, load = mpf("5e-4"), mpf(10)**6
    reach = load / (pi * modulus) * (log(4 * pi * modulus * gap / load) - 1)
    table.set = f"depth={mp.nstr(reach, 25)}"
    table.state(0, hertz(mpf("0.02")), hertz(mpf("0.0095") * mpf("0.01") / gap), load)
    table.end(mpf("1e-12"))
    table.set = "depth=0.27e-3"
    table.refused("the depth of 'pin' reaches 0.51 clearances")


if __name__ == "__main__":
    {f.__name__: f for f in (bounce, rolling, slider_crank, sphere, corners, incline, spin, oblique, hollow, arc, crest, bowling, wall, turntable, valley, loop, dome, coin, restitution, depth, stiffness)}[sys.argv[1]]()
