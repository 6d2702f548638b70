# SPDX-License-Identifier: BSD-3-Clause
"""Motions with events of small machines, written again from the laws: Dormand and Prince's formula of order 5 with short equal
steps, which end at kinks, samples, impacts and changes between sticking and slipping. Nothing is shared with Kempe."""
import bisect
import math
import operator

A = ((1 / 5,), (3 / 40, 9 / 40), (44 / 45, -56 / 15, 32 / 9), (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
     (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656))
B = (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
C = (0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1)
E = (71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)  # the difference from a formula of order 4
FINE = 1e-9  # a step with a larger difference is halved
SHORTEST = 2e-5  # s
SAME = 1e-12  # s: times that are one
NEAR = 1e-15  # s: to which times of events are found
JUST_BEFORE = 1e-11  # s
GRAZES = 1e-5  # an event this near to its limit without passing it may be on either side
MOST_IMPACTS = 12
SHORTER = 4  # times, steps while a stiff contact touches


def moved(y, h, weights, slopes):
    """y and h times the weighted sum of slopes."""
    weights = [h * w for w in weights]
    return [a + sum(map(operator.mul, weights, own)) for a, own in zip(y, zip(*slopes))]


class Border(Exception):
    """The motion is so near to another one that rounding decides."""


class Held:
    """A coordinate with friction, stops, or both: held between bounds of its force while it does not move. `ratio(x)`: the rate that
    rubs over that of the coordinate; `press`: coefficients while it slips and sticks, and the size of what presses as a function of
    (t, x, v, z, accelerations, friction). `pawl`: the sign of the rates against which it has no limit."""

    def __init__(self, k, level=None, static=None, upper=None, restitution=0.0):
        self.k, self.upper, self.lower, self.restitution = k, upper, None, restitution
        self.level, self.static = level, static or level  # functions of t and the sign of the rate; None: no friction
        self.press, self.ratio = None, None
        self.pawl, self.catches = 0, True
        self.sign, self.rests, self.touches = 0, False, 0

    def rubs(self):
        return bool(self.level or self.press)

    def limit(self, side):
        return self.upper if side > 0 else self.lower


class Motion:
    """`machine` has n, mass(x), force(t, x, v, z) with all forces but those of `held`, `rates(t, x, v, z)` of the continuous
    states, `kinks`: functions of (t, x, v, z) that are zero where a law has a kink, `samples`: (period, function that changes z),
    `breaks`: times, `delays`: (coordinate, time, value before) of which `past(i, t)` is the value, `impulses`: (time, function of
    x and v that gives v after it), `changes`: of kinks, functions that give z after a passage to a side."""

    def __init__(self, machine, x, v, step):
        self.m, self.t, self.step, self.longest = machine, 0.0, step, step  # `longest`: after steps that were halved
        self.x, self.v, self.z = [float(a) for a in x], [float(a) for a in v], [float(a) for a in machine.start]
        self.impacts, self.next = 0, [0] * len(machine.samples)
        machine.track = [[] for _ in machine.delays]
        self.breaks = sorted(set(machine.breaks))
        for h in machine.held:
            h.sign, h.rests, h.touches = 0, False, 0
            for side in (1, -1):
                if h.limit(side) is not None and abs(self.x[h.k] - h.limit(side)) < SAME:
                    h.touches = side
        self.trace, self.rows = [], {}
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
        """Accelerations, and what holds the held ones. Levels that grow with the load are found by iteration."""
        m, held = self.m, [h for h in self.m.held if h.rests]
        mass, force = m.mass(x), m.force(t, x, v, z)
        slips = [h for h in m.held if not h.rests and h.rubs() and h.sign]
        free = [k for k in range(m.n) if all(h.k != k for h in held)]
        pressed, level = [h for h in slips if h.press], {}
        for h in slips:
            if h.level:
                force[h.k] -= h.sign * h.level(t, h.sign * self.sign_of_ratio(h, x)) * self.size_of_ratio(h, x)
        for _ in range(200):
            whole = list(force)
            for h in pressed:
                whole[h.k] -= h.sign * level.get(h, 0.0) * self.size_of_ratio(h, x)
            a = [0.0] * m.n
            if len(free) == 1:
                a[free[0]] = whole[free[0]] / mass[free[0]][free[0]]
            elif free:
                (p, q), (_, r) = mass
                a = [(r * whole[0] - q * whole[1]) / (p * r - q * q), (p * whole[1] - q * whole[0]) / (p * r - q * q)]
            needed, change = [sum(row[k] * a[k] for k in range(m.n)) - w for row, w in zip(mass, whole)], 0.0
            if not pressed:
                return a, needed
            for h in pressed:
                sign = h.sign if h.ratio is None else h.sign * math.copysign(1, h.ratio(x))
                new = h.press[0] * h.press[2](t, x, v, z, a, -sign * level.get(h, 0.0), needed)
                change = max(change, abs(new - level.get(h, 0.0)) / (1 + new))
                level[h] = new
            if change < 1e-14:
                return a, needed
        raise Border("friction grows with itself")

    @staticmethod
    def size_of_ratio(h, x):
        return 1.0 if h.ratio is None else abs(h.ratio(x))

    @staticmethod
    def sign_of_ratio(h, x):
        return 1.0 if h.ratio is None else math.copysign(1, h.ratio(x))

    def bounds(self, h, t, x, v, z, a, needed):
        """The force that may hold a coordinate, least and largest."""
        s, ratio = [0.0, 0.0], 1.0 if h.ratio is None else h.ratio(x)
        if h.press:
            s = [h.press[1] * h.press[2](t, x, v, z, a, needed[h.k] / ratio, needed) * abs(ratio)] * 2
        elif h.static:
            s = [h.static(t, way * math.copysign(1, ratio)) * abs(ratio) for way in (1, -1)]
        return (-math.inf if h.touches > 0 else -s[0]), (math.inf if h.touches < 0 else s[1])

    def slope(self, t, y):
        n, m = self.m.n, self.m
        x, v, z = y[:n], y[n:2 * n], y[2 * n:]
        for h in m.held:
            if h.rests:
                v[h.k] = 0.0
        return v + self.solve(t, x, v, z)[0] + m.rates(t, x, v, z)

    # -- modes

    def begin(self):
        """Chooses modes where rates are zero."""
        for h in self.m.held:
            if abs(self.v[h.k]) > 1e-9:
                h.sign, h.rests, h.touches = math.copysign(1, self.v[h.k]), False, 0
                continue
            if not h.rubs() and not h.touches:
                continue
            self.v[h.k], h.rests, h.sign = 0.0, True, 0
            a, needed = self.solve(self.t, self.x, self.v, self.z)
            low, high = self.bounds(h, self.t, self.x, self.v, self.z, a, needed)
            needed = needed[h.k]
            for bound in (low, high):
                if math.isfinite(bound) and abs(needed - bound) < GRAZES * (1 + abs(needed)):
                    raise Border("the holding force is at its limit")
            if not low <= needed <= high:
                h.rests, h.touches = False, 0
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
                    x, v, z = y[:n], y[n:2 * n], y[2 * n:]
                    v[h.k] = 0.0
                    a, needed = self.solve(t, x, v, z)
                    bounds = self.bounds(h, t, x, v, z, a, needed)
                    return needed[h.k] - bounds[0] if which == 0 else bounds[1] - needed[h.k]
                for which in (0, 1):
                    if h.touches != (1, -1)[which]:
                        out.append((("slips", h), lambda t, y, f=margin, w=which: f(t, y, which=w), 1))
            else:
                if h.rubs():
                    out.append((("stops", h), lambda t, y, h=h: h.sign * y[n + h.k], 1))
                for side in (1, -1):
                    if h.limit(side) is not None:
                        out.append((("strikes", (h, side)), lambda t, y, h=h, s=side: s * (h.limit(s) - y[h.k]), 1))
        return out

    # -- steps

    def advance(self, y, h, first=None):
        k = [first or self.slope(self.t, y)]
        for c, row in zip(C[1:], A):
            before = JUST_BEFORE if c == 1 else 0.0  # a jump at the end of the step belongs to the next one
            k.append(self.slope(self.t + c * h - before, moved(y, h, row, k)))
        self.stages = k
        return moved(y, h, B, k)

    def lacks(self, y, h, after):
        """The error of the last step by the formula of order 4, relative."""
        parts = [(h * e, s) for e, s in zip(E, [*self.stages, after])]
        return max(abs(sum(e * s[i] for e, s in parts)) / (1 + abs(y[i])) for i in range(len(y)))

    def run(self, end, times=()):
        """To the end; `rows` gets the state before the events of each of `times`."""
        times = sorted(times)
        if times and times[0] < SAME:
            self.row(times.pop(0))
        while self.t < end - SAME:
            h = min(self.longest, self.step / (SHORTER if any(self.sides.get(kink, 1) > 0 for kink in self.m.stiff) else 1), end - self.t)
            if times:
                h = min(h, times[0] - self.t)
            for begin, last, step in self.m.spells:
                h = min(h, step) if begin - SAME < self.t < last - SAME else h
            for (period, _), count in zip(self.m.samples, self.next):
                h = min(h, count * period - self.t)
            while self.breaks and self.breaks[0] < self.t + SAME:
                self.breaks.pop(0)
            if self.breaks:
                h = min(h, self.breaks[0] - self.t)
            try:
                self.one(h, times[0] if times else None)
            except OverflowError as error:
                raise Border("the motion runs away") from error
            while times and times[0] < self.t + SAME:
                times.pop(0)
        return self

    def row(self, t):
        now = self.t - JUST_BEFORE if t else 0.0  # a jump of an input comes after its row
        a, _ = self.solve(now, self.x, self.v, self.z)
        self.rows[t] = (list(self.x), list(self.v), a, list(self.z),
                        {name: value(now, self.x, self.v, self.z, a) for name, value in self.m.reactions.items()})

    def dips(self, watched, y, h, first, new, after):
        """True if a kink or a stop is passed and passed back within a step, by the cubic between its ends."""
        def inside(s):
            w = s * s * (3 - 2 * s)
            return [a + w * (b - a) + h * s * (1 - s) * ((1 - s) * c - s * d) for a, b, c, d in zip(y, new, first, after)]
        middle = inside(0.5)
        for (kind, _), f, side in watched:
            if kind not in ("kink", "strikes") or side == 0:
                continue
            a, m, b = f(self.t, y), f(self.t + h / 2, middle), f(self.t + h, new)
            if a <= 1e-11 and kind == "kink":  # it has been passed at the begin of the step
                if b < 0:
                    return True
                continue
            bend, slope = 2 * (a - 2 * m + b), 4 * m - 3 * a - b
            if m < 0 or (bend > 0 and 0 < -slope < 2 * bend and f(self.t - h * slope / (2 * bend), inside(-slope / (2 * bend))) < 0):
                return True
        return False

    def one(self, h, time=None):
        y, n = self.x + self.v + self.z, self.m.n
        watched, first, self.longest = self.watched(), self.slope(self.t, y), min(2 * self.longest, self.step)
        while True:
            found, new = [], self.advance(y, h, first)
            for what, f, side in watched:
                a, b = f(self.t, y), f(self.t + h, new)
                if side == 0:
                    continue
                if b < 0 and (a > 1e-11 or what[0] in ("stops", "slips", "strikes")):
                    found.append((self.locate(y, f, h, first, a, b), what))
                elif 0 < b < GRAZES and what[0] != "kink" and f(self.t + h / 2, self.advance(y, h / 2)) < 0:
                    raise Border("a limit is grazed")
            if found:
                h = min(at for at, _ in found)
                found = [what for at, what in found if at < h + SAME]
                new = self.advance(y, h, first)
            after = self.slope(self.t + h - JUST_BEFORE, new)
            if h <= SHORTEST or (self.lacks(y, h, after) < FINE and not self.dips([w for w in watched if w[0] not in found], y, h, first, new, after)):
                break
            h = self.longest = 0.47 * h  # two halves of a step to an event would end at it, unseen
        self.trace.append((self.t, y[:n], y[n:2 * n], first[n:2 * n], self.t + h, new[:n], new[n:2 * n], after[n:2 * n]))
        self.t += h
        self.x, self.v, self.z = new[:n], new[n:2 * n], new[2 * n:]
        if time is not None and abs(self.t - time) < SAME:
            self.row(time)
        for (kind, kink), _, _ in watched:
            if kind == "kink" and ("kink", kink) not in found:
                value = kink(self.t, self.x, self.v, self.z)
                if abs(value) > 1e-10:
                    self.sides[kink] = math.copysign(1, value)
        self.remember()
        for kind, what in found:
            self.happen(kind, what)
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

    def locate(self, y, f, h, first, before, after):
        """The time at which f becomes negative, from its values at both ends of a step: by secants (Illinois), every fourth time by halves."""
        low, high, last = 0.0, h, 0
        for k in range(120):
            middle = (low + high) / 2
            if before > 0 and k % 4 < 3:
                middle = min(max(low + (high - low) * before / (before - after), low + NEAR / 2), high - NEAR / 2)
            now = f(self.t + middle, self.advance(y, middle, first))
            if now < 0:
                high, after, before, last = middle, now, before / 2 if last < 0 else before, -1
            else:
                low, before, after, last = middle, now, after / 2 if last > 0 else after, 1
            if high - low < NEAR:
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
            (h, side), before = what, self.v[what[0].k]
            if side * before < 1e-4:
                raise Border("an impact is soft")
            mass = m.mass(self.x)
            if m.n == 1:
                push = [1 / mass[0][0]]
            else:
                (p, q), (_, r) = mass
                push = [w / (p * r - q * q) for w in ((r, -q) if h.k == 0 else (-q, p))]
            restitution = 0.0 if h.pawl == -side and h.catches else h.restitution
            impulse = -(1 + restitution) * before / push[h.k]
            self.v = [v + p * impulse for v, p in zip(self.v, push)]
            self.x[h.k] = h.limit(side)
            h.touches = side if restitution == 0 else 0
            self.v[h.k] = 0.0 if h.touches else self.v[h.k]
            if m.struck:
                m.struck(self, abs(impulse))
            self.mark()
            self.begin()
        else:  # stops, slips
            h = what
            if kind == "stops":
                self.v[h.k] = 0.0
                self.begin()
            else:
                needed = self.solve(self.t, self.x, self.v, self.z)[1][h.k]
                h.rests, h.touches, h.sign = False, 0, -math.copysign(1, needed)
                if len(m.held) > 1:
                    self.begin()
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
        self.spells = []  # (from, to, longest step)
        self.stiff = []  # kinks above which motions are fast
        self.reactions, self.struck = {}, None  # functions of (t, x, v, z, accelerations); what else an impact does

    def force(self, t, x, v, z):
        out = [0.0] * self.n
        for k, term in self.terms:
            if k is None:
                out = [a + b for a, b in zip(out, term(t, x, v, z))]
            else:
                out[k] += term(t, x, v, z)
        return out

    def rates(self, t, x, v, z):
        out = [0.0] * len(self.start)
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
        low = max(0, min(bisect.bisect_right(track, (at, math.inf)), len(track) - 1) - 1)
        high = min(low + 1, len(track) - 1)
        (t0, q0, v0), (t1, q1, v1) = track[low], track[high]
        h = t1 - t0
        if h <= 0:
            return q1
        s = (at - t0) / h
        return ((1 + 2 * s) * (1 - s) ** 2 * q0 + s * (1 - s) ** 2 * h * v0 + s * s * (3 - 2 * s) * q1 + s * s * (s - 1) * h * v1)
