# SPDX-License-Identifier: BSD-3-Clause
"""Elements of element_machines: contacts with outlines and cams, followers of cams, ropes, gears, a pin that closes a loop. Each has loads that
are known, rows of constraints with a multiplier, modes that events change, and the columns of Kempe's table that show it."""
import math

import numpy as np

from element_mechanics import Row, Wrench
from jointed_bodies import NOTHING, cross, number, unit


DEEPEST = 5e-3  # m: the reference of a law ends there; in hollow corners below the radius of the disc


class Element:
    begin = ()  # values of its states at the start
    restitution = 0.0

    def wrenches(self):
        return []

    def rows(self):
        return []

    def watched(self):
        return []

    def rates(self):
        return []

    def mode_key(self):
        return ()

    def shown(self, forces):
        return []

    def columns(self, row):
        """The same as `shown` of a row of Kempe's."""
        return []

    def pushes(self, forces):
        """Wrenches that follow from the multipliers and move nothing."""
        return []

    def start(self, solved):
        pass

    def pressed(self):
        """Numbers of rigid contacts that are closed."""
        return []

    def is_passed(self):
        """It is beyond a bound that an event should have found."""
        return False

    def held(self):
        """Rows of rates that are zero at the start."""
        return self.rows()


class Place:
    """A place of a body with axes, which its `at` names in the text; z of the axes is across the plane."""

    def __init__(self, machine, body, at, axes):
        self.body, (x, turn, _, _) = body, machine.pose(body)
        self.at, self.axes, self.machine = turn.T @ (at - x), turn.T @ axes, machine
        self.word = machine.place(body, self.at, self.axes)

    def now(self):
        x, turn, v, w = self.machine.pose(self.body)
        return x + turn @ self.at, turn @ self.axes, w


def speed_at(machine, body, at):
    x, _, v, w = machine.pose(body)
    return v + cross(w, at - x)


class Candidate:
    """A disc or a point about a place on one body that may touch the surface `which` of a shape at a place of another one."""

    def __init__(self, machine, centre, local, r, shape_place, shape, which, sides_only=False):
        self.sides_only = sides_only  # of two corners the other one is the candidate
        self.machine, self.centre, self.local, self.r = machine, centre, np.array([*local, 0.0]), r
        self.on, self.shape, self.which = shape_place, shape, which
        self.mode = "open"

    def look(self):
        """Gap, direction from the shape, its second derivative across, place of the disc's centre."""
        o, axes, _ = self.centre.now()
        p = o + axes @ self.local
        s, own, _ = self.on.now()
        self.local_place = own[:, :2].T @ (p - s)
        found = self.shape.distances(self.local_place)
        d, n, bend = found[min(self.which, len(found) - 1)]
        if self.sides_only and bend:
            d = 1.0 + self.r
        self.gap, self.n, self.bend, self.p = d - self.r, own[:, :2] @ np.asarray(n), bend, p
        self.t = cross(own[:, 2], self.n)
        self.k = p - self.r * self.n
        return self

    def gap_rate(self):
        return self.n @ (speed_at(self.machine, self.centre.body, self.p) - speed_at(self.machine, self.on.body, self.p))

    def slip(self):
        """Of the disc's material along the shape's, at the place of contact."""
        return self.t @ (speed_at(self.machine, self.centre.body, self.k) - speed_at(self.machine, self.on.body, self.k))

    def row(self, name, friction=0.0):
        a, b = self.centre.body, self.on.body
        w = self.machine.pose(b)[3]
        relative = speed_at(self.machine, a, self.p) - speed_at(self.machine, b, self.p)
        right = 2 * self.n @ cross(w, relative) - self.bend * (self.t @ relative) ** 2 * (0.9 if self.machine.fault == "bend" else 1)
        push = -friction * math.copysign(1, self.slip()) * self.t if friction else NOTHING
        place = self.p if self.machine.fault == "rim" else self.k
        extra = [Wrench(a, place, push), Wrench(b, place, -push)] if friction else ()
        return Row(name, [(a, self.p, self.n, NOTHING, None), (b, self.p, -self.n, NOTHING, None)], right, extra)


class Contact(Element):
    """Candidates of one name: rigid with a restitution, or with a law of depth and rate."""

    def __init__(self, name, candidates, law, friction, restitution):
        self.name, self.candidates, self.law = name, candidates, law
        self.friction, self.restitution = friction, restitution
        self.corners = len({id(c.shape) for c in candidates}) > 1  # of two outlines: where two corners meet the pieces are a choice

    def mode_key(self):
        return tuple(c.mode for c in self.candidates)

    def force(self, c):
        """The normal force by the law, and its part that may pull."""
        kind, k, power, loss = self.law
        depth, rate = max(-c.gap, 0.0), -c.gap_rate()
        if kind == "kelvin_voigt":
            return k * depth + loss * rate
        return k * depth**power * (1 + loss * rate)

    def pulls(self, c):
        kind, k, _, loss = self.law
        rate = -c.gap_rate()
        return k * -c.gap + loss * rate if kind == "kelvin_voigt" else 1 + loss * rate

    def rub(self, c, n):
        mu, speed = self.friction
        v = c.slip()
        return -mu * n * v / math.hypot(v, speed)

    def wrenches(self):
        out = []
        if self.law:
            for c in self.candidates:
                if c.mode == "push":
                    c.look()
                    n = self.force(c)
                    f = n * c.n + (self.rub(c, n) * c.t if self.friction else 0)
                    place = c.p if c.machine.fault == "rim" else c.k
                    out += [Wrench(c.centre.body, place, f), Wrench(c.on.body, place, -f)]
        return out

    def rows(self):
        return [self.row_of(k) for k, c in enumerate(self.candidates) if c.mode == "closed"]

    def row_of(self, k):
        c = self.candidates[k].look()
        return c.row(f"{self.name}.{k}", self.friction if c.mode == "closed" else 0.0)

    def start(self, solved):
        for k, c in enumerate(self.candidates):
            c.look().mode = "open"
            if self.law and c.gap < 0:
                c.mode = "push" if self.pulls(c) > 0 else "idle"
        for k, c in enumerate(self.candidates):
            if not self.law and abs(c.look().gap) < 1e-9 and abs(c.gap_rate()) < 1e-9:
                c.mode = "closed"
                if solved()[1][f"{self.name}.{k}"] < 0:
                    c.mode = "open"

    def pressed(self):
        return [k for k, c in enumerate(self.candidates) if c.mode == "closed"]

    def is_passed(self):
        return any(c.look().gap * (-1 if c.mode == "open" else 1) > 1e-9 for c in self.candidates if c.mode != "closed")

    def change(self, which):
        self.candidates[which[0]].mode = which[1]

    def watched(self):
        out = []
        resting = any(c.mode == "closed" for c in self.candidates)
        for k, c in enumerate(self.candidates):
            gap = lambda forces, c=c: c.look().gap  # noqa: E731
            if hasattr(c.shape, "within"):
                out.append((-1, lambda forces, c=c: c.look() and c.shape.within(c.local_place), ("border", self, k)))
            if self.law:
                pulls = lambda forces, c=c: self.pulls(c.look())  # noqa: E731
                kinks = self.law[0] != "hertz"
                deepest = min(DEEPEST, 0.8 * c.r) if c.shape.hollow else DEEPEST
                out.append((-1, lambda forces, c=c, d=deepest: c.look().gap + d, ("border", self, k)))
                if c.mode == "open":
                    alone = not self.corners or all(other.mode == "open" for other in self.candidates)
                    out.append((-1, gap, ("mode", self, (k, "push")) if alone else ("border", self, k)))
                else:
                    out.append((1, gap, ("mode", self, (k, "open"))))
                if c.mode == "push" and kinks:
                    out.append((-1, pulls, ("mode", self, (k, "idle"))))
                if c.mode == "idle":
                    out.append((1, pulls, ("mode", self, (k, "push"))))
            elif c.mode == "closed":
                out.append((-1, lambda forces, k=k: forces[f"{self.name}.{k}"], ("mode", self, (k, "open"))))
                # A corner that slides over a corner leaves it: the next side goes away from it.
                out.append((1, lambda forces, c=c: c.look().gap_rate() - 1e-6, ("border", self, k)))
                if self.friction:
                    out.append((0, lambda forces, c=c: c.look().slip(), ("border", self, k)))
            else:
                out.append((-1, gap, ("border" if resting or self.friction else "impact", self, k)))
        return out

    def held(self):
        return self.rows() if not self.law else []

    def shown(self, forces):
        if self.law:
            return [sum(self.force(c.look()) for c in self.candidates if c.mode == "push")]
        return [sum(forces.get(f"{self.name}.{k}", 0.0) for k, _ in enumerate(self.candidates))]

    def columns(self, row):
        return [float(row.get(f"force.{self.name}") or row[f"force.{self.name}.normal"])]


class Face(Element):
    """A flat face on one body touches a cam of another one: a closure."""

    def __init__(self, machine, name, face, on, shape):
        self.machine, self.name, self.face, self.on, self.shape = machine, name, face, on, shape

    def rows(self):
        f, axes, wa = self.face.now()
        c, own, wb = self.on.now()
        m = axes[:, 0]  # away from the cam
        z = own[:, 2]
        local = own[:, :2].T @ m
        reach, across, bend = self.shape.support(math.atan2(local[1], local[0]))
        t = cross(z, m)
        self.k = c + reach * m + across * t
        a, b = self.face.body, self.on.body
        turn = (wb - wa) @ z
        relative = speed_at(self.machine, b, self.k) - speed_at(self.machine, a, self.k)
        # seen from the face the outermost place moves over the cam: - n (b - a - 2 wa x relative) - (reach + bend) turn^2 = 0
        right = (reach + bend) * turn**2 * (0.9 if self.machine.fault == "support" else 1) - 2 * m @ cross(wa, relative)
        self.gap = m @ (f - c) - reach
        return [Row(f"{self.name}.0", [(a, self.k, m, NOTHING, None), (b, self.k, -m, NOTHING, None)], right)]

    def shown(self, forces):
        return [forces[f"{self.name}.0"]]

    def columns(self, row):
        return [float(row[f"lambda.{self.name}.1"])]


class Follower(Element):
    """A roller or an edge on a cam that it does not leave: a closure."""

    def __init__(self, name, candidate):
        self.name, self.candidate = name, candidate

    def rows(self):
        return [self.candidate.look().row(f"{self.name}.0")]

    def shown(self, forces):
        return [forces[f"{self.name}.0"]]

    def columns(self, row):
        return [float(row[f"lambda.{self.name}.1"])]


class Pin(Element):
    """Places of two bodies that are one in the plane of a carrier."""

    def __init__(self, machine, name, first, second, carrier, plane):
        self.machine, self.name, self.first, self.second, self.carrier, self.plane = machine, name, first, second, carrier, plane

    def rows(self):
        (p, _, _), (q, _, _) = self.first.now(), self.second.now()
        _, turn, _, w = self.machine.pose(self.carrier)
        relative = speed_at(self.machine, self.first.body, p) - speed_at(self.machine, self.second.body, q)
        out = []
        for k in range(2):
            e = turn @ self.plane[:, k]
            out.append(Row(f"{self.name}.{k}", [(self.first.body, p, e, NOTHING, None), (self.second.body, q, -e, NOTHING, None)], -cross(w, e) @ relative))
        return out


class Rope(Element):
    """From an end over a sheave, or straight, to an end: elastic, or of one length; between bodies that move in the plane of a carrier."""

    def __init__(self, machine, name, places, radii, carrier, normal, law):
        self.machine, self.name, self.places, self.radii = machine, name, places, radii
        self.carrier, self.normal, self.law, self.mode = carrier, normal, law, "taut"

    def mode_key(self):
        return (self.mode,)

    def look(self):
        """The spans: centres, direction, length; rates of the length, and the row without its multiplier."""
        k = self.machine.pose(self.carrier)[1] @ self.normal
        cx, _, cv, cw = self.machine.pose(self.carrier)
        at = [place.now()[0] for place in self.places]
        moving = [speed_at(self.machine, place.body, p) - speed_at(self.machine, self.carrier, p) for place, p in zip(self.places, at)]
        self.length, self.rate, self.terms, self.right, ways = 0.0, 0.0, [], 0.0, []
        for i in range(len(at) - 1):
            d, p = at[i + 1] - at[i], self.radii[i + 1] - self.radii[i]
            d = d - (d @ k) * k
            size = math.hypot(*d)
            base, turn = d / size, math.asin(p / size)
            # rims are passed along e: d.(k x e) = p
            e = math.cos(turn) * base - math.sin(turn) * cross(k, base)
            span = d @ e
            self.length += span
            u = moving[i + 1] - moving[i]
            self.rate += e @ u
            self.right -= (u @ cross(k, e)) ** 2 / span - 2 * e @ cross(cw, u)
            for place, where, sign in ((self.places[i + 1], at[i + 1], 1), (self.places[i], at[i], -1)):
                self.terms += [(place.body, where, sign * e, NOTHING, None), (self.carrier, where, -sign * e, NOTHING, None)]
            ways.append(e)
        for i, radius in enumerate(self.radii):
            if radius:
                e, f = ways[i - 1], ways[i]
                angle = math.copysign(1, radius) * math.atan2(k @ cross(e, f), e @ f) % (2 * math.pi)
                self.length += abs(radius) * angle
                self.wrap = angle
        return self

    def pull(self):
        stiffness, damping, free = self.law
        self.look()
        return stiffness * (self.length - free + damping * self.rate)

    def wrenches(self):
        if self.law is None or self.mode != "taut":
            return []
        tension = self.pull()
        return [Wrench(b, at, -tension * e) for b, at, e, _, _ in self.terms]

    def rows(self):
        if self.law is not None:
            return []
        self.look()
        return [Row(f"{self.name}.0", [(b, at, -e, NOTHING, None) for b, at, e, _, _ in self.terms], -self.right)]

    def start(self, solved):
        if self.law is not None:
            self.mode = "taut" if self.pull() > 0 and self.length > self.law[2] else "slack"

    def change(self, mode):
        self.mode = mode

    def is_passed(self):
        if self.law is None:
            return False
        pull = self.pull()
        over = self.length - self.law[2]
        if self.mode == "slack":
            return over > 1e-9
        return over < -1e-9 or self.law[1] and pull * (1 if self.mode == "taut" else -1) < -1e-6

    def watched(self):
        if self.law is None:
            return []
        over = lambda forces: self.look().length - self.law[2]  # noqa: E731
        pull = lambda forces: self.pull()  # noqa: E731
        if self.mode == "slack":
            return [(1, over, ("mode", self, "taut"))]
        out = [(-1, over, ("mode", self, "slack"))]
        if self.law[1]:
            out.append((-1, pull, ("mode", self, "idle")) if self.mode == "taut" else (1, pull, ("mode", self, "taut")))
        return out

    def shown(self, forces):
        if self.law is None:
            return [forces[f"{self.name}.0"]]
        return [self.pull() if self.mode == "taut" else 0.0]

    def columns(self, row):
        return [float(row[f"tension.{self.name}"])]


class Mesh(Element):
    """A pair of spur wheels about axes in one carrier."""

    def __init__(self, machine, name, wheels, carrier, pitch, along, separating, apart):
        self.machine, self.name, self.wheels, self.carrier = machine, name, wheels, carrier
        self.pitch, self.along, self.separating, self.apart = pitch, along, separating, apart

    def look(self):
        x, turn, v, w = self.machine.pose(self.carrier)
        self.at, self.t = x + turn @ self.pitch, turn @ self.along
        return v + cross(w, self.at - x), w

    def rows(self):
        speed, w = self.look()
        i, j = self.wheels
        relative = speed_at(self.machine, j, self.at) - speed_at(self.machine, i, self.at)
        return [Row(f"{self.name}.0", [(j, self.at, self.t, NOTHING, speed), (i, self.at, -self.t, NOTHING, speed)], -cross(w, self.t) @ relative)]

    def pushes(self, forces):
        self.look()
        push = abs(forces[f"{self.name}.0"]) * self.separating * (self.machine.pose(self.carrier)[1] @ self.apart)
        return [Wrench(self.wheels[0], self.at, -push), Wrench(self.wheels[1], self.at, push)]

    def shown(self, forces):
        return [forces[f"{self.name}.0"]]

    def columns(self, row):
        return [float(row[f"lambda.{self.name}.1"])]
