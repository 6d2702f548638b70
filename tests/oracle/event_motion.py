# SPDX-License-Identifier: BSD-3-Clause
"""Motions with events of small machines, written again from the laws: Dormand and Prince's formula of order 5 with short equal
steps, which end at kinks, samples, impacts and changes between sticking and slipping. Nothing is shared with Kempe."""
import math

import numpy as np

A = ((1 / 5,), (3 / 40, 9 / 40), (44 / 45, -56 / 15, 32 / 9), (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
     (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656))
B = (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
C = (0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1)
SAME = 1e-12  # s: times that are one
JUST_BEFORE = 1e-11  # s
GRAZES = 1e-5  # an event this near to its limit without passing it may be on either side
MOST_IMPACTS = 12


class Border(Exception):
    """The motion is so near to another one that rounding decides."""


class Held:
    """A coordinate with friction, a stop, or both: held between bounds of its force while it does not move."""

    def __init__(self, k, level=None, static=None, upper=None, restitution=0.0):
        self.k, self.upper, self.restitution = k, upper, restitution
        self.level, self.static = level, static or level  # functions of t; None: no friction
        self.sign, self.rests, self.touches = 0, False, False

    def bounds(self, t):
        """The force that may hold it, least and largest."""
        s = self.static(t) if self.static else 0.0
        return (-math.inf if self.touches else -s), s


class Motion:
    """`machine` has n, mass(x), force(t, x, v, z) with all forces but those of `held`, `rates(t, x, v, z)` of the continuous
    states, `kinks`: functions of (t, x, v, z) that are zero where a law has a kink, `samples`: (period, function that changes z),
    `breaks`: times, `delays`: (coordinate, time, value before) of which `past(i, t)` is the value, `impulses`: (time, function of
    x and v that gives v after it), `changes`: of kinks, functions that give z after a passage to a side."""

    def __init__(self, machine, x, v, step):
        self.m, self.t, self.step = machine, 0.0, step
        self.x, self.v, self.z = np.array(x, float), np.array(v, float), np.array(machine.start, float)
        self.impacts, self.next = 0, [0] * len(machine.samples)
        machine.track = [[] for _ in machine.delays]
        self.breaks = sorted(set(machine.breaks))
        for h in machine.held:
            h.sign, h.rests, h.touches = 0, False, h.upper is not None and abs(self.x[h.k] - h.upper) < SAME
        self.sides = machine.sides = {}
        for kink in machine.kinks:
            value = kink(0.0, self.x, self.v, self.z)
            if abs(value) > 1e-10:
                self.sides[kink] = math.copysign(1, value)
        self.sample()
        self.begin()
        for kick in (kick for at, kick in machine.impulses if at == 0):
            self.v = kick(self.x, self.v)
        self.mark()
        self.remember()

    # -- accelerations

    def solve(self, t, x, v, z):
        m, held = self.m, [h for h in self.m.held if h.rests]
        mass, force = m.mass(x), m.force(t, x, v, z)
        for h in m.held:
            if not h.rests and h.level:
                force[h.k] -= h.sign * h.level(t)
        free = [k for k in range(m.n) if all(h.k != k for h in held)]
        a = np.zeros(m.n)
        if free:
            a[free] = np.linalg.solve(mass[np.ix_(free, free)], force[free])
        return a, mass @ a - force  # what holds the held ones

    def slope(self, t, y):
        n, m = self.m.n, self.m
        x, v, z = y[:n], y[n:2 * n], y[2 * n:]
        v = v.copy()
        for h in m.held:
            if h.rests:
                v[h.k] = 0.0
        return np.concatenate((v, self.solve(t, x, v, z)[0], m.rates(t, x, v, z)))

    # -- modes

    def begin(self):
        """Chooses modes where rates are zero."""
        for h in self.m.held:
            if abs(self.v[h.k]) > 1e-9:
                h.sign, h.rests = math.copysign(1, self.v[h.k]), False
                h.touches = h.touches and False
                continue
            if not h.level and not h.touches:
                continue
            self.v[h.k], h.rests, h.sign = 0.0, True, 0
            needed = self.solve(self.t, self.x, self.v, self.z)[1][h.k]
            low, high = h.bounds(self.t)
            for bound in (low, high):
                if math.isfinite(bound) and abs(needed - bound) < GRAZES * (1 + abs(needed)):
                    raise Border("the holding force is at its limit")
            if not low <= needed <= high:
                h.rests, h.touches = False, False
                h.sign = -math.copysign(1, needed)

    def watched(self):
        """Functions of (t, y) that are positive now; where one becomes negative the step ends."""
        m, n, out = self.m, self.m.n, []
        for kink in m.kinks:
            value = kink(self.t, self.x, self.v, self.z)
            side = self.sides.get(kink, math.copysign(1, value) if abs(value) > 1e-10 else 0)
            out.append((("kink", kink), lambda t, y, f=kink, s=side: (s or 1) * f(t, y[:n], y[n:2 * n], y[2 * n:]), side))
        for h in m.held:
            if h.rests:
                def margin(t, y, h=h, which=0):
                    x, v, z = y[:n], y[n:2 * n].copy(), y[2 * n:]
                    v[h.k] = 0.0
                    needed, bounds = self.solve(t, x, v, z)[1][h.k], h.bounds(t)
                    return needed - bounds[0] if which == 0 else bounds[1] - needed
                for which in (0, 1):
                    if math.isfinite(h.bounds(self.t)[which]):
                        out.append((("slips", h), lambda t, y, f=margin, w=which: f(t, y, which=w), 1))
            else:
                if h.level:
                    out.append((("stops", h), lambda t, y, h=h: h.sign * y[n + h.k], 1))
                if h.upper is not None:
                    out.append((("strikes", h), lambda t, y, h=h: h.upper - y[h.k], 1))
        return out

    # -- steps

    def advance(self, y, h):
        k = [self.slope(self.t, y)]
        for c, row in zip(C[1:], A):
            before = JUST_BEFORE if c == 1 else 0.0  # a jump at the end of the step belongs to the next one
            k.append(self.slope(self.t + c * h - before, y + h * sum(a * s for a, s in zip(row, k))))
        return y + h * sum(b * s for b, s in zip(B, k))

    def run(self, end):
        while self.t < end - SAME:
            h = min(self.step, end - self.t)
            for (period, _), count in zip(self.m.samples, self.next):
                h = min(h, count * period - self.t)
            while self.breaks and self.breaks[0] < self.t + SAME:
                self.breaks.pop(0)
            if self.breaks:
                h = min(h, self.breaks[0] - self.t)
            self.one(h)
        return self

    def one(self, h):
        y, found = np.concatenate((self.x, self.v, self.z)), None
        watched = self.watched()
        new = self.advance(y, h)
        for what, f, side in watched:
            a, b = f(self.t, y), f(self.t + h, new)
            if side == 0:
                continue
            if b < 0 and (a > 1e-11 or what[0] in ("stops", "slips", "strikes")):
                at = self.locate(y, f, h)
                if not found or at < found[0]:
                    found = at, f, what
            elif 0 < b < GRAZES and what[0] != "kink" and f(self.t + h / 2, self.advance(y, h / 2)) < 0:
                raise Border("a limit is grazed")
        if found:
            h = found[0]
            new = self.advance(y, h)
        n = self.m.n
        self.t += h
        self.x, self.v, self.z = new[:n], new[n:2 * n], new[2 * n:]
        for kind_kink in [w for w in watched if w[0][0] == "kink"]:
            value = kind_kink[0][1](self.t, self.x, self.v, self.z)
            if abs(value) > 1e-10:
                self.sides[kind_kink[0][1]] = math.copysign(1, value)
        self.remember()
        if found:
            self.happen(found[2][0], found[2][1])
        self.sample()
        for at, kick in self.m.impulses:
            if abs(at - self.t) < SAME:
                self.v = kick(self.x, self.v)
                self.begin()
                self.mark()
        for h in self.m.held:
            if h.rests:
                self.v[h.k] = 0.0
        self.remember()

    def locate(self, y, f, h):
        low, high = 0.0, h
        for _ in range(60):
            middle = (low + high) / 2
            if f(self.t + middle, self.advance(y, middle)) < 0:
                high = middle
            else:
                low = middle
            if high - low < 1e-15:
                break
        return high

    def happen(self, kind, what):
        m = self.m
        if kind == "kink":
            side = -self.sides.get(what, 1)
            if what in self.sides:
                self.sides[what] = side
            if what in m.changes:
                self.z = m.changes[what](self.t, self.x, self.v, self.z, side)
            self.begin_again()
        elif kind == "strikes":
            self.impacts += 1
            if self.impacts > MOST_IMPACTS:
                raise Border("impacts accumulate")
            h, before = what, self.v[what.k]
            if before < 1e-4:
                raise Border("an impact is soft")
            unit = np.zeros(m.n)
            unit[h.k] = 1
            push = np.linalg.solve(m.mass(self.x), unit)
            self.v = self.v + push * (-(1 + h.restitution) * before / push[h.k])
            self.x[h.k] = h.upper
            h.touches = h.restitution == 0
            self.v[h.k] = 0.0 if h.touches else self.v[h.k]
            self.mark()
            self.begin()
        else:  # stops, slips
            h = what
            if kind == "stops":
                self.v[h.k] = 0.0
                self.begin()
            else:
                needed = self.solve(self.t, self.x, self.v, self.z)[1][h.k]
                h.rests, h.touches, h.sign = False, False, -math.copysign(1, needed)
            self.mark()

    def begin_again(self):
        """After a jump of a force."""
        for h in self.m.held:
            if h.rests:
                self.begin()
                break
        self.mark()

    def mark(self):
        """Jumps of now come back after each delay."""
        for _, time, _ in self.m.delays:
            self.breaks = sorted(set(self.breaks) | {self.t + time})

    def remember(self):
        for track, (k, _, _) in zip(self.m.track, self.m.delays):
            track.append((self.t, self.x[k], self.v[k]))

    def sample(self):
        for i, (period, change) in enumerate(self.m.samples):
            if self.next[i] * period < self.t + SAME:
                self.next[i] += 1
                self.z = change(self.t, self.x, self.v, self.z)
                for h in self.m.held:
                    if h.rests:
                        self.begin()


class Machine:
    """A machine for a motion; `past` is the value of a delayed coordinate."""

    def __init__(self, n, mass):
        self.n, self.mass, self.start, self.terms, self.state_rates, self.sides = n, mass, [], [], [], {}
        self.kinks, self.changes, self.samples, self.breaks, self.delays, self.impulses, self.held = [], {}, [], [], [], [], []

    def force(self, t, x, v, z):
        out = np.zeros(self.n)
        for k, term in self.terms:
            if k is None:
                out += term(t, x, v, z)
            else:
                out[k] += term(t, x, v, z)
        return out

    def rates(self, t, x, v, z):
        out = np.zeros(len(self.start))
        for i, rate in self.state_rates:
            out[i] = rate(t, x, v, z)
        return out

    def is_above(self, kink, t, x, v, z):
        """The side of a condition: it does not change within a step, whose stages may stand beyond its end."""
        return self.sides.get(kink, kink(t, x, v, z)) > 0

    def past(self, i, t):
        _, time, before = self.delays[i]
        at, track = t - time, self.track[i]
        if at <= SAME or not track:
            return before
        low, high = 0, len(track) - 1
        while high - low > 1:
            middle = (low + high) // 2
            if track[middle][0] <= at:
                low = middle
            else:
                high = middle
        (t0, q0, v0), (t1, q1, v1) = track[low], track[high]
        h = t1 - t0
        if h <= 0:
            return q1
        s = (at - t0) / h
        return ((1 + 2 * s) * (1 - s) ** 2 * q0 + s * (1 - s) ** 2 * h * v0 + s * s * (3 - 2 * s) * q1 + s * s * (s - 1) * h * v1)
