#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the slider-crank with a loose pin, from equations of its own. Needs numpy and scipy.

    python3 reference_loose_pin.py > reference.csv
    python3 reference_loose_pin.py events          times of contact without friction, of the digits in tests/unit/test_compliant.c

The rod turns about the crank's pin, which moves as prescribed: its moment of inertia about that pin times its angular acceleration is
the moment of the pin's acceleration and of the contact. The slider has one equation. The law of contact is written out. DOP853 of SciPy
is restarted where the journal touches its bearing and where it leaves; runs at two tolerances agree to the digits written.
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


def main():
    start = np.array([0, -CRANK * SPEED / ROD, CRANK + ROD, 0.0])
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
