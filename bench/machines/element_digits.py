#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of problems with ropes, belts, gears and bearings by closed forms in 40 digits (mpmath), from statics and Newton's laws alone:

    element_digits unwound_string > element_unwound_string.csv
    element_digits bungee > element_bungee.csv
    element_digits capstan > element_capstan.csv
    element_digits tackle > element_tackle.csv
    element_digits timing_belt > element_timing_belt.csv
    element_digits winch > element_winch.csv
    element_digits pendulum_on_a_peg > element_pendulum_on_a_peg.csv
    element_digits bevel_differential > element_bevel_differential.csv
    element_digits worm > element_worm.csv
    element_digits lossy_pair > element_lossy_pair.csv
    element_digits elastic_backlash > element_elastic_backlash.csv
    element_digits clutch > element_clutch.csv
    element_digits slider_crank_loads > element_slider_crank_loads.csv

Without a name it writes all tables into this folder.
"""
import contextlib
import pathlib
import sys

from mpmath import atan, cos, exp, findroot, mp, mpf, pi, quad, sin, sqrt, tan

from digit_table import Table

mp.dps = 40
GRAVITY = mpf("9.81")


def unwound_string():
    """Without gravity the rate of a mass on its string is constant: the free part l has l^2 = l0^2 + 2 R v t, and T = m v^2/l."""
    radius, speed, free = mpf("0.1"), mpf(2), mpf("0.5")
    table = Table(None, "length.s", "tension.s", "q.x", "q.y")
    for t in (mpf("0.25"), mpf("0.5"), mpf(1)):
        length = sqrt(free**2 + 2 * radius * speed * t)
        angle = (length - free) / radius                      # the string is radius*angle longer than at first
        table.state(t, length, speed**2 / length, radius * cos(angle) + length * sin(angle), radius * sin(angle) - length * cos(angle))


def bungee():
    """A fall of 10 m, then an oscillation about the static extension until the rope is slack again, then a free flight."""
    mass, stiffness, free, fall = mpf(70), mpf(500), mpf(12), mpf(10)
    w, static = sqrt(stiffness / mass), mass * GRAVITY / stiffness
    taut, speed = sqrt(2 * fall / GRAVITY), sqrt(2 * GRAVITY * fall)
    extension = lambda s: static * (1 - cos(w * s)) + speed / w * sin(w * s)
    slack = taut + 2 * (pi - atan(speed / (w * static))) / w  # where the rate is the opposite one
    table = Table(None, "q.z", "tension.bungee")
    table.state(1, fall - free - GRAVITY / 2, 0)
    for t in (2, mpf("2.25"), mpf("2.75")):
        table.state(t, -free - extension(t - taut), stiffness * extension(t - taut))
    table.state(3, -free + speed * (3 - slack) - GRAVITY / 2 * (3 - slack)**2, 0)


def capstan():
    """Two masses over a post: it slips beyond exp(mu pi), and holds within."""
    factor = exp(mpf("0.2") * pi)
    table = Table(None, "q.a", "q.b", "tension.rope")
    for mass in ("3", "0.4", "1", "1.874456", "1.8745", "0.53349", "0.53348"):
        table.set, m = f"m={mass}", mpf(mass)
        down, up = (m - factor) / (m + factor), (1 - factor * m) / (1 + factor * m)
        rate = GRAVITY * (down if down > 0 else -up if up > 0 else 0)
        table.state(mpf("0.4"), -rate * mpf("0.08"), rate * mpf("0.08"), GRAVITY + rate)


def tackle():
    """Four falls over four sheaves that turn with the rope: each takes J a/r^2 from the tension."""
    load, weight, spin = mpf(200), mpf(60), mpf("0.02") / mpf("0.08")**2
    # rope accelerations 4a, 4a, 3a, 2a, a from the weight to the dead end, when the load rises by a; sheaves 4, 3, 2, 1
    a = GRAVITY * (4 * weight - load) / (load + 16 * weight + spin * (1 + 4 + 9 + 16))
    tensions = [weight * (GRAVITY - 4 * a)]
    for k in (4, 3, 2, 1):
        tensions.append(tensions[-1] - spin * k * a)
    assert abs(sum(tensions[1:]) - load * (GRAVITY + a)) < mpf(10)**-30
    table = Table(None, "q.z", "q.w", *(f"tension.fall_{k}" for k in (5, 4, 3, 2, 1)))
    table.state(mpf("0.2"), a * mpf("0.02"), -4 * a * mpf("0.02"), *tensions)


def timing_belt():
    """Two wheels, a constant torque: both spans by one elongation u, and the common motion."""
    near, far, r1, r2, j1, j2, torque = mpf("0.4"), mpf(60000), mpf("0.05"), mpf("0.12"), mpf("2e-4"), mpf("5e-3"), mpf(4)
    stiffness = 2 * far / sqrt(near**2 - (r2 - r1)**2)        # of both spans
    mobility = r1**2 / j1 + r2**2 / j2
    w, static = sqrt(stiffness * mobility), r1 * torque / j1 / (stiffness * mobility)
    table = Table(None, "q.a", "q.b", "tension.timing_1", "tension.timing_2")
    for t in (mpf("1e-3"), mpf("5e-3"), mpf("0.01")):
        u, twice = static * (1 - cos(w * t)), static * (t**2 / 2 - (1 - cos(w * t)) / w**2)  # and its second integral
        q1, q2 = torque / j1 * t**2 / 2 - r1 * stiffness * twice / j1, r2 * stiffness * twice / j2
        table.state(t, q1, q2, 300 - stiffness / 2 * u, 300 + stiffness / 2 * u)


def winch():
    """A load turns the drum whose brake is off."""
    load, radius, spin = mpf(100), mpf("0.15"), mpf(2)
    a = load * GRAVITY / (load + spin / radius**2)
    table = Table(None, "q.z", "q.drum", "tension.hoist", "reaction.drum.z")
    table.state(1, -a / 2, -a / 2 / radius, load * (GRAVITY - a), 10 * GRAVITY + load * (GRAVITY - a))


def pendulum_on_a_peg():
    """A pendulum of 1 m from -60 degrees; below the vertical it winds round a peg of 0.05 m at half its length. Quadratures of the energy."""
    radius, start, free = mpf("0.05"), pi / 3, mpf("0.5")
    rate = lambda s: 2 * sqrt(GRAVITY * sin(start - s * s / 2) * sin(s * s / 2))  # of the angle start - s^2
    substituted = lambda s: 2 * s / rate(s)
    touches = quad(substituted, [0, sqrt(start) / 2, sqrt(start)])
    speed = rate(sqrt(start))

    def wound(w):
        """Free length, square of the speed of the mass at a wrap w; the tangent point falls by radius*sin(w)."""
        length = free - radius * w
        rises = free - radius * sin(w) - length * cos(w)
        return length, speed**2 - 2 * GRAVITY * rises

    passed = lambda w: quad(lambda s: wound(s)[0] / sqrt(wound(s)[1]), [0, w / 2, w])
    table = Table(None, "wrap.rope.2", "tension.rope")
    before = mpf("0.4")
    s = findroot(lambda s: quad(substituted, [0, s / 2, s]) - before, mpf("0.8"))
    table.state(before, 0, rate(s)**2 + GRAVITY * cos(start - s * s))
    for later in (mpf("0.1"), mpf("0.2")):
        w = findroot(lambda w: passed(w) - later, (mpf("0.5"), mpf("1.2")), solver="anderson", tol=mpf(10)**-50)
        length, square = wound(w)
        table.state(touches + later, w, square / length + GRAVITY * cos(w))


def bevel_differential():
    """Three rates with one relation: the cage has half the sum of both side gears."""
    cage, pinions, left, right = mpf("0.05"), (mpf("1e-4"), mpf("0.2"), mpf("0.04")), mpf("0.3"), mpf("0.5")
    own, mass, arm = pinions
    carried = cage + 2 * (mass * arm**2 + own)                # their inertia is the same about all axes
    ratio = mpf(16) / 10                                      # a pinion turns by ratio*(left - right)/2 in the cage
    a, b = carried / 4 + 2 * own * ratio**2 / 4, carried / 4 - 2 * own * ratio**2 / 4
    m11, m12, m22, f1, f2 = left + a, b, right + a, mpf(20) - 10, mpf(20)
    determinant = m11 * m22 - m12**2
    l, r = (f1 * m22 - f2 * m12) / determinant, (f2 * m11 - f1 * m12) / determinant
    table = Table(None, "q.left", "q.right", "q.cage")
    half = mpf("0.5")**2 / 2
    table.state(mpf("0.5"), l * half, r * half, (l + r) / 2 * half)


def worm():
    """Balance of a block on the helix: a normal force with friction along the thread, at a normal pressure angle of 20 degrees."""
    lead, mu, arm, teeth, pressed = atan(mpf("0.1")), mpf("0.12"), mpf("0.08"), 40, cos(pi / 9)
    table = Table(None, "q.worm", "q.wheel", "lambda.mesh.1")
    inertia, ratio, t = (mpf("1e-3"), mpf("0.4")), mpf(1) / teeth, mpf("0.5")
    for torque in ("3", "2.8", "-0.3", "-0.4"):
        table.set, drives = f"T={torque}", mpf(torque)
        side = 1 if drives > 0 else -1                        # of the worm's rate
        # force F on the wheel along its circle, H = F*lever on the worm along its circle
        lever = (pressed * sin(lead) + side * mu * cos(lead)) / (pressed * cos(lead) - side * mu * sin(lead))
        radius = arm / teeth / tan(lead)
        a = (drives - 50 / arm * lever * radius) / (inertia[0] + inertia[1] * ratio / arm * lever * radius)
        slips = a * side > 0
        a = a if slips else mpf(0)
        force = (50 + inertia[1] * ratio * a) / arm
        table.state(t, a * t**2 / 2, a * ratio * t**2 / 2, *([force] if slips else []))


def lossy_pair():
    """Two wheels of 2 to 1 with an efficiency of 0.8 either way."""
    table = Table(None, "q.one", "q.two")
    spin1, spin2, t = mpf(1), mpf("1.5"), mpf("0.4")
    for first, second in (("10", "-5"), ("10", "-18"), ("10", "-15.5"), ("10", "-26")):
        table.set = f"T1={first} T2={second}"
        first, second = mpf(first), mpf(second)
        # the first wheel at 2a, the second at a; torque u into the mesh from the first, e*2u or 2u/e out of it
        forward = (2 * mpf("0.8") * first + second) / (spin2 + 4 * mpf("0.8") * spin1)
        backward = (2 / mpf("0.8") * first + second) / (spin2 + 4 / mpf("0.8") * spin1)
        a = forward if forward > 0 else backward if backward < 0 else mpf(0)
        table.state(t, a * t**2, a * t**2 / 2)


def elastic_backlash():
    """A wheel between both flanks of another one: free flight, half a period of the elastic teeth, back."""
    r1, r2, j1, j2, stiffness, play, speed = mpf("0.03"), mpf("0.05"), mpf("1e-4"), mpf("8e-4"), mpf("2e8"), mpf("8e-5"), mpf("0.2")
    mass = 1 / (r1**2 / j1 + r2**2 / j2)
    w, flight = sqrt(stiffness / mass), play / speed
    table = Table(None, "q.one", "q.two", "reaction.mesh.z", atol="1e-15")
    for t in (flight / 4, flight / 2 + pi / (4 * w), flight / 2 + pi / (2 * w), flight):
        s = t - flight / 2
        inside = 0 < s < pi / w
        path = speed * t if s < 0 else play / 2 + speed / w * sin(w * s) if inside else play / 2 - speed * (s - pi / w)
        force = stiffness * speed / w * sin(w * s) if inside else mpf(0)
        # the path r1 q1 + r2 q2 is all of one motion of the pair; its centre of inertia stays at the rate of the first wheel
        common = speed / r1 * t
        slack = speed * t - path
        q1 = common - slack * mass * r1 / j1
        table.state(t, q1, -slack * mass * r2 / j2, *([force] if force else []))


def clutch():
    """A plate clutch closes within 0.1 s between a turning shaft and one at rest: both have one rate later, and it holds."""
    first, second, motor, load, level, ramp = mpf("0.1"), mpf("0.3"), mpf(5), mpf(3), mpf(20), mpf("0.1")
    carried = lambda t: level * t**2 / (2 * ramp) if t < ramp else level * (t - ramp / 2)    # integral of the torque
    rates = lambda t: (100 + (motor * t - carried(t)) / first, (carried(t) - load * t) / second)
    angles = lambda t: (100 * t + motor * t**2 / 2 / first - quad(carried, [0, ramp, t]) / first,
                        (quad(carried, [0, ramp, t]) - load * t**2 / 2) / second)
    meet = findroot(lambda t: rates(t)[0] - rates(t)[1], mpf("0.5"))
    together = (motor - load) / (first + second)
    table = Table(None, "q.a", "q.b", "qd.a", "qd.b")
    table.event(0, "friction 'clutch' slips forward")
    table.state(mpf("0.3"), *angles(mpf("0.3")), *rates(mpf("0.3")))
    table.event(meet, "friction 'clutch' sticks", *angles(meet), *rates(meet))
    rate, s = rates(meet)[0], 1 - meet
    table.state(1, *(angle + rate * s + together * s * s / 2 for angle in angles(meet)), *[rate + together * s] * 2)


def slider_crank_loads():
    """Loads of all joints of a slider-crank at constant speed under gravity and a gas force, by Newton's laws of each body."""
    r, l, rate = mpf("0.05"), mpf("0.15"), 10 * pi
    crank, rod, piston, spin = mpf(2), mpf("0.5"), mpf("0.4"), mpf("0.001")
    table = Table(None, *(f"reaction.{joint}.{axis}" for joint in ("crank", "rod") for axis in "xy"), "reaction.piston.y", "lambda.motor.1")
    for t in (mpf("0.01"), mpf("0.07"), mpf("0.13")):
        a, s = rate * t, -r * sin(rate * t) / l               # s, c: sine and cosine of the rod's angle
        c = sqrt(1 - s * s)
        turn = -r * rate * cos(a) / (l * c)                   # rate of the rod, then its acceleration
        turned = (r * rate**2 * sin(a) / l + turn**2 * s) / c
        pin = -r * rate**2 * cos(a), -r * rate**2 * sin(a)
        along = lambda x: (pin[0] - x * (turned * s + turn**2 * c), pin[1] + x * (turned * c - turn**2 * s))
        push = piston * along(l)[0] + 500 * max(mpf(0), cos(a))                  # of the rod on the piston
        middle = along(l / 2)
        fx = rod * middle[0] + push                           # of the crank on the rod
        # moments about the wrist: fy has the arm -l c, fx the arm l s
        fy = (rod * (middle[1] + GRAVITY) * l / 2 * c - rod * middle[0] * l / 2 * s - spin * turned + fx * l * s) / (l * c)
        guide = fy - rod * (middle[1] + GRAVITY)              # of the piston on the rod, downwards
        table.state(t, fx, fy + crank * GRAVITY, fx, fy, piston * GRAVITY - guide, r * (cos(a) * fy - sin(a) * fx))


TABLES = (unwound_string, bungee, capstan, tackle, timing_belt, winch, pendulum_on_a_peg, bevel_differential, worm, lossy_pair,
          elastic_backlash, clutch, slider_crank_loads)

if __name__ == "__main__":
    if len(sys.argv) > 1:
        {f.__name__: f for f in TABLES}[sys.argv[1]]()
    else:
        for make in TABLES:
            with open(pathlib.Path(__file__).parent / f"element_{make.__name__}.csv", "w", encoding="utf-8") as to, contextlib.redirect_stdout(to):
                make()
