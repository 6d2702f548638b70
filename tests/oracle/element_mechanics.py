# SPDX-License-Identifier: BSD-3-Clause
"""Motions of jointed bodies with elements (element_machines): Newton's and Euler's equations by the coordinates of the joints, constraints
with multipliers, contacts that open and strike, located by the roots of SciPy's dense output."""
import math

import numpy as np
from scipy.integrate import solve_ivp

from jointed_bodies import NOTHING, Balance, cross

RTOL, ATOL = 1e-11, 1e-13
SHORTEST = 1e-3  # s between impacts: closer ones are left to the accumulation of Kempe
MOST_EVENTS = 12


def skew(v):
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


class Wrench:
    """A force at a place of a body and a torque on it; the ground takes none."""

    def __init__(self, body, at, force, torque=NOTHING):
        self.body, self.at, self.force, self.torque = body, at, force, torque


class Row:
    """A sum of accelerations of places along directions that is known: terms (body, place, direction, turning, velocity of the
    place), the sum itself, and wrenches by a multiplier of one in place of the row's own directions."""

    def __init__(self, name, terms, right, extra=()):
        self.name, self.terms, self.right, self.extra = name, terms, right, extra


class Border(Exception):
    """The reference ends here: from now on it says nothing."""


class Reduced:
    """The equations at a state, by rates of the coordinates."""

    def __init__(self, machine):
        self.machine, n = machine, len(machine.bodies)
        self.mass, self.force = np.zeros((n, n)), np.zeros(n)
        zero = np.zeros((3, n))
        for k, b in enumerate(machine.bodies):
            p, z = b.parent, b.base[:, 2]
            jv, jw, a, alpha, w, px = (p.jv, p.jw, p.a, p.alpha, p.w, p.x) if p else (zero, zero, NOTHING, NOTHING, NOTHING, NOTHING)
            arm = b.x - px
            b.jv, b.jw = jv - skew(arm) @ jw, jw.copy()
            b.a = a + cross(alpha, arm) + cross(w, cross(w, arm))
            b.alpha = alpha
            if b.slides:
                b.jv[:, k] += z
                b.a = b.a + 2 * b.qd * cross(w, z)
            else:
                b.jw[:, k] += z
                b.alpha = alpha + b.qd * cross(w, z)
            c = b.R @ b.com
            jc = b.jv - skew(c) @ b.jw
            inertia = b.R @ b.inertia @ b.R.T
            bent = b.a + cross(b.alpha, c) + cross(b.w, cross(b.w, c))
            self.mass += b.mass * jc.T @ jc + b.jw.T @ inertia @ b.jw
            self.force += jc.T @ (b.mass * (machine.gravity - bent)) - b.jw.T @ (inertia @ b.alpha + cross(b.w, inertia @ b.w))
            self.force[k] += b.torque

    def effort(self, wrench):
        b = wrench.body
        if b is None:
            return 0.0
        return b.jv.T @ wrench.force + b.jw.T @ (cross(wrench.at - b.x, wrench.force) + wrench.torque)

    def load(self, wrenches):
        for wrench in wrenches:
            self.force += self.effort(wrench)

    def row(self, row):
        """Its factors of accelerations, what they must give, and its force on the coordinates."""
        line, right = np.zeros(len(self.force)), row.right
        for body, at, direction, turning, speed in row.terms:
            if body is None:
                continue
            arm = at - body.x
            line += body.jv.T @ direction + body.jw.T @ (cross(arm, direction) + turning)
            swept = cross(body.w, arm) if speed is None else speed - body.v
            right -= direction @ (body.a + cross(body.alpha, arm) + cross(body.w, swept)) + turning @ body.alpha
        return line, right, line + sum(self.effort(w) for w in row.extra)


def rates_of(row):
    """The sum of velocities whose acceleration a row is."""
    return sum(direction @ (b.v + cross(b.w, at - b.x)) + turning @ b.w for b, at, direction, turning, _ in row.terms if b is not None)


def solve(reduced, rows):
    """Accelerations and multipliers."""
    lines = [reduced.row(row) for row in rows]
    n, m = len(reduced.force), len(rows)
    whole, right = np.zeros((n + m, n + m)), np.zeros(n + m)
    whole[:n, :n], right[:n] = reduced.mass, reduced.force
    for k, (line, known, column) in enumerate(lines):
        whole[:n, n + k] = -column
        whole[n + k, :n] = line
        right[n + k] = known
    found = np.linalg.solve(whole, right)
    return found[:n], found[n:]


class Motion:
    """The motion of a machine from its start to an end, rows at times, and where the reference ends (`until`)."""

    def __init__(self, machine, times):
        self.machine, self.times, self.rows, self.until, self.events = machine, times, [], times[-1], []
        n = len(machine.bodies)
        self.n = n
        self.kept = None
        y = np.concatenate([[b.q for b in machine.bodies], [b.qd for b in machine.bodies], *[e.begin for e in machine.elements]])
        try:
            self.advance(y)
        except Border as border:
            self.until = border.args[0]

    def put(self, y):
        for k, b in enumerate(self.machine.bodies):
            b.q, b.qd = y[k], y[self.n + k]
        self.machine.move()
        at = 2 * self.n
        for e in self.machine.elements:
            e.state = y[at:at + len(e.begin)]
            at += len(e.begin)

    def equations(self, t, y):
        """(accelerations, multipliers by name, rates of states) at a state; the last one is kept."""
        key = (t, y.tobytes(), tuple(e.mode_key() for e in self.machine.elements))
        if self.kept and self.kept[0] == key:
            return self.kept[1]
        self.put(y)
        reduced, rows = Reduced(self.machine), []
        for e in self.machine.elements:
            reduced.load(e.wrenches())
            rows += e.rows()
        a, forces = solve(reduced, rows)
        found = a, {row.name: f for row, f in zip(rows, forces)}, np.concatenate([e.rates() for e in self.machine.elements])
        self.kept = key, found
        return found

    def slope(self, t, y):
        a, _, rates = self.equations(t, y)
        return np.concatenate([y[self.n:2 * self.n], a, rates])

    def watched(self):
        """Functions of SciPy with their direction and what follows."""
        out = []
        for e in self.machine.elements:
            for direction, value, then in e.watched():
                def function(t, y, value=value):
                    forces = self.equations(t, y)[1]
                    self.put(y)
                    return value(forces)
                function.direction, function.terminal = direction, True
                out.append((function, then))
        return out

    def show(self, t, y):
        a, forces, _ = self.equations(t, y)
        self.put(y)
        return [*y[:self.n], *y[self.n:2 * self.n], *[x for e in self.machine.elements for x in e.shown(forces)]]

    def advance(self, y):
        t, last, left = 0.0, -math.inf, list(self.times)
        for e in 2 * list(self.machine.elements):  # a contact is decided by the modes of all others
            self.put(y)
            e.start(lambda: self.fresh(0.0, y))
        self.refuse_several(y)
        while left:
            watched = self.watched()
            for _ in range(2):  # the starting values of both sides
                self.kept = None
            while left and left[0] <= t:
                self.rows.append(self.show(t, y))
                left.pop(0)
            if not left:
                break
            run = self.segment(t, left[-1], y, [f for f, _ in watched])
            end = run.t[-1]
            while left and left[0] < end + (1e-12 if run.status == 0 else 0):
                self.rows.append(self.show(left[0], run.sol(left[0])))
                left.pop(0)
            if run.status == 0:
                break
            which = next(k for k, times in enumerate(run.t_events) if len(times) and times[-1] == end)
            t, y = end, run.y[:, -1].copy()
            self.put(y)
            y = self.changed(t, y, watched[which][1])
            self.events.append(t)
            if len(self.events) > MOST_EVENTS or t - last < SHORTEST and watched[which][1][0] == "impact":
                raise Border(t)
            last = t

    def refuse_several(self, y):
        """Of a contact with friction that would open as well as press there are two motions (Painleve)."""
        for e in self.machine.elements:
            for which in e.pressed():
                e.change((which, "open"))
                a = self.fresh(0.0, y)[0]
                line, right, _ = Reduced(self.machine).row(e.row_of(which))
                e.change((which, "closed"))
                if line @ a > right:
                    raise ValueError("two motions")
        self.kept = None

    def segment(self, t, end, y, watched):
        """To the next event; with shorter steps where two events are within one of them."""
        longest = self.times[-1] / (40 if self.machine.strikes else 8)
        for shorter in (1, 8):
            run = solve_ivp(self.slope, (t, end), y, method="DOP853", rtol=RTOL, atol=ATOL, dense_output=True, events=watched, max_step=longest / shorter)
            if run.status >= 0 and not self.passed(run):
                return run
        raise Border(t)

    def passed(self, run):
        """A gap that closes and opens again within a step."""
        for before, after in zip(run.t, run.t[1:]):
            for part in (0.15, 0.35, 0.6, 0.85):
                self.put(run.sol(before + part * (after - before)))
                if any(e.is_passed() for e in self.machine.elements):
                    return True
        return False

    def fresh(self, t, y):
        self.kept = None
        found = self.equations(t, y)
        self.put(y)
        return found

    def changed(self, t, y, then):
        """The state after an event: (kind, element, candidate)."""
        kind, element, which = then
        if kind == "border":
            raise Border(t)
        if kind == "mode":
            element.change(which)
            return y
        row = element.row_of(which)
        speed = rates_of(row)
        reduced, rows = Reduced(self.machine), [r for e in self.machine.elements for r in e.rows()]
        lines = [reduced.row(r) for r in rows + [row]]
        m, n = len(lines), self.n
        whole, right = np.zeros((n + m, n + m)), np.zeros(n + m)
        whole[:n, :n] = reduced.mass
        for k, (line, _, _) in enumerate(lines):
            whole[:n, n + k], whole[n + k, :n] = -line, line
        right[-1] = -(1 + element.restitution) * speed
        y = y.copy()
        y[n:2 * n] += np.linalg.solve(whole, right)[:n]
        if element.restitution == 0:
            element.change((which, "closed"))
            if self.fresh(t, y)[1][row.name] < 0:
                element.change((which, "open"))
        self.kept = None
        return y


def loads(machine, forces):
    """Forces and moments of all joints by six accelerations of each body, and the accelerations of the coordinates."""
    balance = Balance(machine)

    def put(wrench):
        if wrench.body is not None:
            balance.load(wrench.body, wrench.at, wrench.force, wrench.torque, alone=True)

    for e in machine.elements:
        for wrench in e.wrenches():
            put(wrench)
        for wrench in e.pushes(forces):
            put(wrench)
        for row in e.rows():
            line, right = np.zeros(balance.size), row.right
            for body, at, direction, turning, speed in row.terms:
                line += balance.jacobian(body, at, direction, turning)
                if body is not None:
                    right -= direction @ balance.bias(body, body.v + cross(body.w, at - body.x) if speed is None else speed)
            column = line.copy()
            for w in row.extra:
                column += balance.jacobian(w.body, w.at, w.force, w.torque)
            balance.add(line, right, column)
    balance.solve()
    return balance.accelerations(), balance.loads()
