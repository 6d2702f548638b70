#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the walker from a plane body of prescribed shape (needs numpy, scipy):

    examples/jansen_walker/reference_jansen_walker.py > examples/jansen_walker/reference.csv

The crank turns uniformly, so that all legs are known functions of time in the axes of the trunk: intersections of circles, with
first and second derivatives. The unknowns that remain are the three coordinates of the trunk under Newton's and Euler's laws of the whole
machine. Each foot is open, sticks or slips. At each event all combinations of the feet that touch are tried, for accelerations
or for impulses, and exactly one must agree with Coulomb's law. Between events DOP853 of scipy runs at 1e-13 and at 1e-12.
"""
import itertools
import math

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

SIZE = 0.01
A, B, C, D, E, F, G, H, I, J, K, L, M = (SIZE * x for x in (38, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49, 50, 61.9, 7.8, 15))
RHO, TRUNK, TRUNK_CENTRE, TRUNK_INERTIA = 0.1, 40, 0.1j, 1
MU, GRAVITY, RATE, END = 0.3, 9.81, -math.pi / 3, 12
LEGS = {"rear1": (1, 0), "front1": (-1, 0), "rear2": (1, math.pi), "front2": (-1, math.pi)}
NONE = 1e-9  # distances, rates and accelerations that are zero
TIMES = (0.04, 0.06, 0.15, 0.5, 1, 1.4, 1.6, 2, 2.5, 3.05, 3.5, 4, 4.6, 5, 5.5, 6.05, 7, 8, 9, 10, 11, 12)

# -- numbers with two derivatives, in a row; complex ones are points ----------------------------------------------------------------


def times(x, y):
    return np.array([x[0] * y[0], x[1] * y[0] + x[0] * y[1], x[2] * y[0] + 2 * x[1] * y[1] + x[0] * y[2]])


def root(x):
    first = np.sqrt(x[0])
    rate = x[1] / (2 * first)
    return np.array([first, rate, (x[2] - 2 * rate**2) / (2 * first)])


def inverse(x):
    return np.array([1 / x[0], -x[1] / x[0]**2, 2 * x[1]**2 / x[0]**3 - x[2] / x[0]**2])


def constant(x):
    return np.array([x, 0, 0], dtype=complex)


def turned(angle):
    unit = np.exp(1j * angle)
    return np.array([unit, 1j * unit, -unit])


def meet(p, r, q, s, side):
    """The point where circles of radii r about p and s about q meet, to the left (1) or right (-1) of the line from p to q."""
    across = q - p
    square = times(across, np.conj(across))
    length = root(square)
    along = times((square + constant(r * r - s * s)) / 2, inverse(length))
    aside = root(constant(r * r) - times(along, along))
    return p + times(times(across, inverse(length)), along + side * 1j * aside)


def leg(angle):
    """Corners of a leg behind its frame point, and its bodies: mass, centre, moment of inertia, a direction."""
    b, o = constant(0), constant(A + 1j * L)
    a = o + M * turned(angle)
    u, g = meet(b, B, a, J, 1), meet(b, C, a, K, -1)
    w = meet(b, D, u, E, 1)
    h = meet(w, F, g, G, -1)
    f = meet(h, H, g, I, -1)
    bars = [(o, a, M), (a, u, J), (a, g, K), (w, h, F), (b, g, C)]
    bodies = [(RHO * l, (p + q) / 2, RHO * l**3 / 12, (q - p) / l) for p, q, l in bars]
    for corners, sides in (((b, u, w), (B, D, E)), ((g, h, f), (G, H, I))):
        mass, direction = RHO * sum(sides), corners[1] - corners[0]
        bodies.append((mass, sum(corners) / 3, mass * sum(s * s for s in sides) / 36, direction / abs(direction[0])))
    return f, bodies


def shape(t):
    """Feet in the axes of the trunk, and bodies: mass, place, moment of inertia, acceleration and rate of the angle; with
    derivatives by time."""
    feet, bodies = [], [(TRUNK, constant(TRUNK_CENTRE), TRUNK_INERTIA, 0.0, 0.0)]
    speed = np.array([1, RATE, RATE**2])
    for side, phase in LEGS.values():
        angle = phase + RATE * t
        foot, own = leg(angle if side == 1 else math.pi - angle)
        if side == -1:  # its mirror image; the crank then turns the other way
            speed = np.array([1, -RATE, RATE**2])
        place = lambda x: speed * (x if side == 1 else -np.conj(x)) - constant(side * A)
        feet.append(place(foot))
        for mass, centre, inertia, unit in own:
            unit = speed * unit
            turns = [side * (np.conj(unit[0]) * unit[k]).imag for k in (1, 2)]
            bodies.append((mass, place(centre), inertia, turns[1], turns[0]))
        speed = np.array([1, RATE, RATE**2])
    return feet, bodies


# -- the machine as one body --------------------------------------------------------------------------------------------------------


def machine(t, y):
    """Mass matrix of the accelerations in axes of the trunk and of its angle, their loads, and for each foot: place, rate, rows of
    its acceleration in both directions, the rest of that acceleration."""
    place, angle, rate, spin = complex(y[0], y[1]), y[2], complex(y[3], y[4]), y[5]
    axes = np.exp(1j * angle)
    feet, bodies = shape(t)
    mass, load = np.zeros((3, 3)), np.zeros(3)
    weight = -1j * GRAVITY * np.conj(axes)
    for m, c, inertia, turns, _ in bodies:
        x, v = c[0].real, c[0].imag
        mass += m * np.array([[1, 0, -v], [0, 1, x], [-v, x, x * x + v * v]])
        mass[2, 2] += inertia
        rest = weight - (-spin**2 * c[0] + 2j * spin * c[1] + c[2])
        load += m * np.array([rest.real, rest.imag, (np.conj(c[0]) * rest).imag])
        load[2] -= inertia * turns
    found = []
    for f in feet:
        columns = [axes, 1j * axes, 1j * axes * f[0]]
        rows = np.array([[c.real for c in columns], [c.imag for c in columns]])
        rest = axes * (-spin**2 * f[0] + 2j * spin * f[1] + f[2])
        at, moves = place + axes * f[0], rate + axes * (1j * spin * f[0] + f[1])
        found.append((at, moves, rows, np.array([rest.real, rest.imag])))
    return mass, load, found


def combine(mass, start, feet, states, before):
    """Three unknowns and the forces (or impulses) of feet in given states: mass u = start + rows' f, with rows u + before zero where a
    foot is closed. A state is None (open), 0 (sticks), 1 or -1 (slips)."""
    closed = [k for k, state in states.items() if state is not None]
    size = 3 + 2 * len(closed)
    matrix, right = np.zeros((size, size)), np.zeros(size)
    matrix[:3, :3], right[:3] = mass, start
    for n, k in enumerate(closed):
        at, rows = 3 + 2 * n, feet[k][2]
        matrix[:3, at:at + 2] = -rows.T
        matrix[at + 1, :3], right[at + 1] = rows[1], -before[k][1]
        if states[k] == 0:
            matrix[at, :3], right[at] = rows[0], -before[k][0]
        else:
            matrix[at, at], matrix[at, at + 1] = 1, states[k] * MU
    if np.linalg.cond(matrix) > 1e12:
        return None
    found = np.linalg.solve(matrix, right)
    forces = {k: found[3 + 2 * n:5 + 2 * n] for n, k in enumerate(closed)}
    after = {k: feet[k][2] @ found[:3] + before[k] for k in states}
    return found[:3], forces, after


def agrees(states, forces, after, free):
    """Coulomb's and Signorini's laws; `free`: feet whose direction of slip is not given."""
    for k, state in states.items():
        if state is None:
            good = after[k][1] > -NONE
        else:
            along, push = forces[k]
            good = push > -NONE and (abs(along) <= MU * push + NONE if state == 0 else k not in free or state * after[k][0] > -NONE)
        if not good:
            return False
    return True


def decide(mass, start, feet, before, choices):
    """The only combination of states that agrees; of two with equal unknowns the first one."""
    free = {k for k, options in choices.items() if 1 in options and -1 in options or 0 in options}
    found = []
    for combination in itertools.product(*choices.values()):
        states = dict(zip(choices, combination))
        solved = combine(mass, start, feet, states, before)
        if solved and agrees(states, *solved[1:], free) and all(np.abs(solved[0] - other[1]).max() > 1e-7 for other in found):
            found.append((states, *solved))
    if len(found) != 1:
        raise RuntimeError(f"{len(found)} solutions")
    return found[0]


# -- events -------------------------------------------------------------------------------------------------------------------------


def strike(t, y):
    """Rates after an impact of the feet that touch."""
    mass, _, feet = machine(t, y)
    axes = np.exp(1j * y[2])
    own = complex(y[3], y[4]) * np.conj(axes)
    now = np.array([own.real, own.imag, y[5]])
    touching = [k for k, f in enumerate(feet) if f[0].imag < NONE]
    if not any(feet[k][1].imag < -NONE for k in touching):
        return y
    before = {k: np.array([feet[k][1].real, feet[k][1].imag]) for k in touching}
    _, change, _, _ = decide(mass, np.zeros(3), feet, before, {k: (None, 0, 1, -1) for k in touching})
    new = axes * complex(*(now + change)[:2])
    return np.array([*y[:3], new.real, new.imag, y[5] + change[2]])


def settle(t, y, fired):
    """States of the feet from now on; `fired`: (foot, state) that have come to an end."""
    mass, load, feet = machine(t, y)
    choices, before = {}, {}
    for k, (at, moves, _, rest) in enumerate(feet):
        if at.imag < NONE and moves.imag < NONE:
            options = (0, 1, -1, None) if abs(moves.real) < NONE else (int(np.sign(moves.real)), None)
            choices[k] = tuple(s for s in options if (k, s) not in fired)
            before[k] = rest
    states = decide(mass, load, feet, before, choices)[0]
    return {k: states.get(k) for k in range(len(feet))}


def accelerate(t, y, states):
    mass, load, feet = machine(t, y)
    own, forces, _ = combine(mass, load, feet, states, {k: f[3] for k, f in enumerate(feet)})
    return own, forces, feet


def slope(t, y, states):
    own, _, _ = accelerate(t, y, states)
    new = np.exp(1j * y[2]) * complex(own[0], own[1])
    return np.array([*y[3:], new.real, new.imag, own[2]])


def left(t, y, states):
    """The reserve of each foot's state, positive until the state ends; the foot's number and its state."""
    _, forces, feet = accelerate(t, y, states)
    found = []
    for k, state in states.items():
        if state is None:
            found.append((feet[k][0].imag, k, None))
            continue
        along, push = forces[k]
        found.append((push, k, "lifts"))
        found.append((MU * push - abs(along) if state == 0 else state * feet[k][1].real, k, state))
    return found


def refine(t0, y0, guess, which, states, tolerance):
    """The event near a guess, on motions of their own from the start of the step."""
    def value(t):
        return left(t, travel(t0, y0, t, states, tolerance), states)[which][0]
    low, high = guess - 1e-9, guess + 1e-9
    while value(low) < 0 and low > t0:
        low = max(t0, low - 1e-7)
    while value(high) > 0:
        high += 1e-7
    return brentq(value, low, high, xtol=1e-15, rtol=1e-15)


def travel(t0, y0, t, states, tolerance):
    solver = DOP853(lambda s, y: slope(s, y, states), t0, y0, t, rtol=tolerance, atol=tolerance / 10)
    while solver.status == "running" and t > t0:
        solver.step()
    return solver.y


def until_event(t, y, states, end, tolerance, show):
    """The first event after t, or the end: time, state of motion, what has fired."""
    solver = DOP853(lambda s, y: slope(s, y, states), t, y, end, rtol=tolerance, atol=tolerance / 10, max_step=0.02)
    last = left(t, y, states)
    while solver.status == "running":
        from_t, from_y = solver.t, solver.y.copy()
        solver.step()
        dense = solver.dense_output()
        for at in np.linspace(from_t, solver.t, 9)[1:]:
            now = left(at, dense(at), states)
            fired = [n for n, (a, b) in enumerate(zip(last, now)) if a[0] > 0 >= b[0]]
            before, last = at - (solver.t - from_t) / 8, now
            if fired:
                roots = [brentq(lambda s: left(s, dense(s), states)[n][0], before, at, xtol=1e-15) for n in fired]
                first = min(range(len(fired)), key=lambda n: roots[n])
                event = refine(from_t, from_y, roots[first], fired[first], states, tolerance)
                show(from_t, from_y, event, states)
                y = travel(from_t, from_y, event, states, tolerance)
                ended = {(k, s if s != "lifts" else states[k]) for value, k, s in left(event, y, states) if value < NONE and s is not None}
                ended |= {(k, 0) for value, k, s in left(event, y, states) if s == "lifts" and value < NONE}
                return event, y, ended
        show(from_t, from_y, solver.t, states)
    return end, solver.y, None


def run(tolerance):
    rows = []

    def show(t0, y0, t1, states):
        for t in TIMES:
            if t0 < t <= t1:
                y = travel(t0, y0, t, states, tolerance)
                _, forces, _ = accelerate(t, y, states)
                rows.append([*y, *(forces[k][1] if k in forces else 0.0 for k in range(len(LEGS)))])

    t, y, fired = 0.0, np.array([0, 0.85, 0, 0, 0, 0.0]), set()
    while fired is not None:
        y = strike(t, y)
        states = settle(t, y, fired)
        t, y, fired = until_event(t, y, states, END, tolerance, show)
    return np.array(rows)


def main():
    rows, again = run(1e-13), run(1e-12)
    difference = np.abs(rows - again)[:, :6].max()
    print(f"# Three freedoms and modes of the feet, by reference_jansen_walker.py; runs at 1e-12 and 1e-13 agree to {difference:.0e}")
    print("t," + ",".join(f"{kind}.trunk.{k}" for kind in ("q", "qd") for k in (1, 2, 3)) + "," + ",".join(f"lambda.{leg}.1" for leg in LEGS))
    for t, row in zip(TIMES, rows):
        print(",".join([str(t), *(f"{x:.12f}" for x in row[:6]), *(f"{x:.9f}" for x in row[6:])]))


if __name__ == "__main__":
    main()
