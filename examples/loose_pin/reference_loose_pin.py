#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the slider-crank with a loose pin, from equations of its own. Needs numpy and scipy.

    python3 reference_loose_pin.py > reference.csv
    python3 reference_loose_pin.py events          times of contact without friction, of the digits in tests/unit/test_compliant.c
    python3 reference_loose_pin.py rigid           impacts of a rigid journal, of the digits in tests/unit/test_clearance.c

The rod turns about the crank's pin, which moves as prescribed: its moment of inertia about that pin times its angular acceleration is
the moment of the pin's acceleration and of the contact. The slider has one equation. The law of contact is written out. DOP853 of SciPy
is restarted where the journal touches its bearing and where it leaves; runs at two tolerances agree to the digits written.

A rigid journal strikes with Newton's law of restitution. Without restitution it then slides in the bearing: its force follows from
e.e'' + e'.e' = 0, and it leaves where this force is zero.
"""
import math
import sys

import numpy as np
from scipy.integrate import solve_ivp

SPEED = 5000 * math.pi / 30
CRANK, ROD, CENTRE, MASS, INERTIA, SLIDER = 0.05, 0.12, 0.06, 0.21, 2.5e-4, 0.14
BEARING, CLEARANCE, RESTITUTION = 0.01, 0.0005, 0.9
JOURNAL = BEARING - CLEARANCE
STIFFNESS = 4 / (3 * 2 * (1 - 0.3 ** 2) / 207e9) * math.sqrt(BEARING * JOURNAL / CLEARANCE)
CONTACT = 1e-9  # s: after a start of contact and after its end, no other is looked for


def geometry(t, y):
    """Place of the journal's centre in the bearing, its rate, both along the rod's direction and the slider's axis."""
    phi, phid, x, xd = y
    c, s = math.cos(phi), math.sin(phi)
    e = np.array([CRANK * math.cos(SPEED * t) + ROD * c - x, CRANK * math.sin(SPEED * t) + ROD * s])
    ed = np.array([-CRANK * SPEED * math.sin(SPEED * t) - ROD * s * phid - xd, CRANK * SPEED * math.cos(SPEED * t) + ROD * c * phid])
    return e, ed


def rates(t, y, impact, friction):
    phi, phid, x, xd = y
    pin = -CRANK * SPEED ** 2 * np.array([math.cos(SPEED * t), math.sin(SPEED * t)])
    turn = MASS * CENTRE * (math.sin(phi) * pin[0] - math.cos(phi) * pin[1])
    force = np.zeros(2)
    if impact:
        e, ed = geometry(t, y)
        size = math.hypot(*e)
        n, along = e / size, np.array([-e[1], e[0]]) / size
        depth, rate = size - CLEARANCE, n @ ed
        normal = STIFFNESS * abs(depth) ** 1.5 * (1 + 3 * (1 - RESTITUTION ** 2) / 4 * rate / impact)
        slip = along @ ed + JOURNAL * phid
        rub = friction * normal * slip / math.sqrt(slip ** 2 + 0.01 ** 2)
        force = -normal * n - rub * along
        turn += ROD * (math.cos(phi) * force[1] - math.sin(phi) * force[0]) - JOURNAL * rub
    return np.array([phid, turn / (INERTIA + MASS * CENTRE ** 2), xd, -force[0] / SLIDER])


def contacts(y, end, friction, tolerance):
    """Pieces (from, to, dense solution), each in contact or free, and the times between them."""
    t, impact, pieces = 0.0, 0.0, []
    while t < end:
        gap = lambda t, y, *_: math.hypot(*geometry(t, y)[0]) - CLEARANCE
        gap.terminal, gap.direction = True, -1 if impact else 1
        run = solve_ivp(rates, (t, end), y, "DOP853", events=gap, dense_output=True, rtol=tolerance, atol=tolerance * 1e-3,
                        first_step=CONTACT, args=(impact, friction))
        pieces.append((t, run.t[-1], run.sol))
        t, y = run.t[-1], run.y[:, -1]
        e, ed = geometry(t, y)
        impact = 0.0 if impact else e @ ed / math.hypot(*e)
    return pieces


# -- a rigid journal ----------------------------------------------------------------------------------------


def accelerations(t, y, normal):
    """Of the rod and the slider with a normal force, and e'' by them."""
    phi, phid = y[0], y[1]
    c, s = math.cos(phi), math.sin(phi)
    e = geometry(t, y)[0]
    force = -normal * e / math.hypot(*e) if normal else np.zeros(2)
    pin = -CRANK * SPEED ** 2 * np.array([math.cos(SPEED * t), math.sin(SPEED * t)])
    turn = MASS * CENTRE * (s * pin[0] - c * pin[1]) + ROD * (c * force[1] - s * force[0])
    a = np.array([turn / (INERTIA + MASS * CENTRE ** 2), -force[0] / SLIDER])
    return a, pin + ROD * np.array([-s * a[0] - c * phid ** 2, c * a[0] - s * phid ** 2]) - np.array([a[1], 0])


def sliding_force(t, y):
    e, ed = geometry(t, y)
    free, loaded = (e @ accelerations(t, y, normal)[1] + ed @ ed for normal in (0, 1))
    return free / (free - loaded)


def rigid_rates(t, y, closed, *_):
    a = accelerations(t, y, sliding_force(t, y) if closed else 0)[0]
    return np.array([y[1], a[0], y[3], a[1]])


def strike(t, y, restitution):
    """The rates after an impact, and the rate at which it strikes."""
    e, ed = geometry(t, y)
    n = e / math.hypot(*e)
    along = np.array([ROD * (n[1] * math.cos(y[0]) - n[0] * math.sin(y[0])), -n[0]])
    light = along / [INERTIA + MASS * CENTRE ** 2, SLIDER]
    rate = n @ ed
    jump = -(1 + restitution) * rate / (along @ light) * light
    return y + np.array([0, jump[0], 0, jump[1]]), rate


def impacts(y, count, restitution, tolerance):
    """The first events: time, and the rate of an impact or 0 where a sliding journal leaves."""
    t, closed, found = 0.0, False, []
    while len(found) < count:
        change = (lambda t, y, *_: sliding_force(t, y)) if closed else (lambda t, y, *_: CLEARANCE - math.hypot(*geometry(t, y)[0]))
        change.terminal, change.direction = True, -1
        run = solve_ivp(rigid_rates, (t, 1), y, "DOP853", events=change, rtol=tolerance, atol=tolerance * 1e-3, first_step=1e-9,
                        args=(closed,))
        t, y, rate = run.t[-1], run.y[:, -1], 0.0
        if not closed:
            y, rate = strike(t, y, restitution)
        closed = not closed and restitution == 0
        found.append((t, rate))
    return found


def print_rigid(start):
    for restitution, count in ((0.9, 12), (0, 8)):
        fine, coarse = (impacts(start, count, restitution, tolerance) for tolerance in (3e-14, 1e-12))
        print(f"restitution {restitution}")
        for (a, rate), (b, other) in zip(fine, coarse):
            print(f"{a:.14g} {rate:.12g}  (differ by {abs(a - b):.1e}, {abs(rate - other):.1e})")


def main():
    start = np.array([0, -CRANK * SPEED / ROD, CRANK + ROD, 0.0])
    if sys.argv[1:] == ["rigid"]:
        print_rigid(start)
        return
    if sys.argv[1:] == ["events"]:
        fine, coarse = (contacts(start, 0.001, 0, tolerance) for tolerance in (1e-13, 1e-12))
        for (_, a, _), (_, b, _) in zip(fine[:-1], coarse[:-1]):
            print(f"{a:.15g}  (differs by {abs(a - b):.1e})")
        return
    ends = [k * 0.001 for k in range(1, 13)]
    fine, coarse = (contacts(start, ends[-1], 0.1, tolerance) for tolerance in (1e-13, 1e-12))
    value = lambda pieces, t: next(sol(t) for a, b, sol in pieces if a <= t <= b)
    off = max(np.max(np.abs((value(fine, t) - value(coarse, t)) / [1, 1000, 1, 10])) for t in ends)
    digits = -math.ceil(math.log10(off))
    print("# Slider-crank with a loose pin: equations of its own, contacts located, by reference_loose_pin.py; two tolerances agree to "
          f"1e-{digits}.")
    print("t,q.A,q.B,qd.B,q.S,qd.S")
    for t in ends:
        phi, phid, x, xd = value(fine, t)
        print(",".join(f"{v:.13g}" for v in (t, SPEED * t, phi - SPEED * t, phid - SPEED, x, xd)))


if __name__ == "__main__":
    main()
