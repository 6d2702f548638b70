# SPDX-License-Identifier: BSD-3-Clause
"""Signed distances of a place from plane shapes (element_machines): each shape gives a list of (distance, direction away from the solid,
second derivative of the distance across it), one for each surface that may touch, and random places on its boundary."""
import math

import numpy as np
from scipy.interpolate import CubicSpline

from jointed_bodies import number


def pairs(points):
    return "[" + ", ".join(f"[{number(x)}, {number(y)}]" for x, y in points) + "]"


def along(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def from_arc(p, centre, radius, hollow=False):
    d = p - centre
    size = math.hypot(*d)
    return (radius - size, -d / size, -1 / size) if hollow else (size - radius, d / size, 1 / size)


class Polygon:
    """A convex polygon, its corners with a radius; hollow: free inside, where each side is a surface."""

    def __init__(self, rng, hollow=False, teeth=False):
        count, size = int(rng.integers(3, 7)), rng.uniform(0.05, 0.2)
        while True:
            angles = np.sort(rng.uniform(0, 2 * np.pi, count))
            gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
            if gaps.max() < 0.8 * np.pi and gaps.min() > 0.35:
                break
        self.corners, self.hollow = [size * along(a) for a in angles], hollow
        if rng.random() < 0.3:
            w, h = rng.uniform(0.05, 0.2, 2)
            self.corners = [np.array(c) for c in ((-w, -h), (w, -h), (w, h), (-w, h))]
            self.text = f"rectangle: [{number(2 * w)}, {number(2 * h)}]"
        elif rng.random() < 0.5 and not hollow:
            self.text = f"closed: yes, path: {pairs(self.corners)}"
        else:
            self.text = f"polygon: {pairs(self.corners)}"
        self.round = rng.uniform(0.002, 0.008) if rng.random() < 0.5 and not hollow else 0.0
        self.text += f", round: {number(self.round)}" if self.round else ""
        self.text += ", hollow: yes" if hollow else ""
        self.sides = []
        for a, b in zip(self.corners, self.corners[1:] + self.corners[:1]):
            t = (b - a) / np.linalg.norm(b - a)
            self.sides.append((a, b, t, np.array([t[1], -t[0]])))
        # corners of the polygon inwards by the radius, which is then the distance of its surface
        self.inner = []
        for (_, _, _, m), (a, _, _, n) in zip(self.sides[-1:] + self.sides[:-1], self.sides):
            self.inner.append(a - self.round * (m + n) / (1 + m @ n))

    def distances(self, p):
        if self.hollow:
            return [(-((p - a) @ n), -n, 0.0) for a, _, _, n in self.sides]
        best, inside = None, max((p - q) @ side[3] for q, side in zip(self.inner, self.sides))
        if inside < 0:
            return [max(((p - a) @ n, tuple(n)) for a, _, _, n in self.sides) + (0.0,)]
        for q, r, (_, _, t, n) in zip(self.inner, self.inner[1:] + self.inner[:1], self.sides):
            s, length = (p - q) @ t, np.linalg.norm(r - q)
            if 0 <= s <= length and (p - q) @ n >= 0:
                return [((p - q) @ n - self.round, n, 0.0)]
            for c in (q, r):
                size = math.hypot(*(p - c))
                best = min(best or (math.inf, None), (size, tuple(c)))
        return [from_arc(p, np.array(best[1]), self.round)]

    def boundary(self, rng, r):
        """A random place of the centre of a disc that touches, and the direction there; discs go round corners too."""
        k = int(rng.integers(len(self.sides)))
        q, e, (_, _, t, n) = self.inner[k], self.inner[(k + 1) % len(self.inner)], self.sides[k]
        if self.hollow:
            a, b, t, n = self.sides[k]
            return a + (b - a) * rng.uniform(0.35, 0.65) - r * n, -n
        if r + self.round > 0 and rng.random() < 0.3:
            m = self.sides[k - 1][3]
            n = m + (n - m) * rng.uniform(0.1, 0.9)
            n = n / np.linalg.norm(n)
            return q + (r + self.round) * n, n
        return q + (e - q) * rng.uniform(0.1, 0.9) + (r + self.round) * n, n


class Slot:
    """Free within a distance of half its width from the line between the centres of its ends."""

    hollow = True

    def __init__(self, rng, r):
        self.length, self.half = rng.uniform(0.05, 0.3), r + rng.uniform(0.0005, 0.02)
        self.text = f"slot: {number(self.length)}, width: {number(2 * self.half)}"
        self.at = rng.uniform(-0.1, 0.1, 2) if rng.random() < 0.3 else np.zeros(2)
        self.text += f", at: [{number(self.at[0])}, {number(self.at[1])}]" if self.at.any() else ""

    def distances(self, p):
        p = p - self.at
        x = min(max(p[0], 0.0), self.length)
        if x in (0.0, self.length):
            return [from_arc(p, np.array([x, 0.0]), self.half, True)]
        return [(self.half - abs(p[1]), np.array([0.0, -math.copysign(1, p[1])]), 0.0)]

    def boundary(self, rng, r):
        side = rng.choice([-1, 1])
        if rng.random() < 0.25:
            d = along(rng.uniform(-1.4, 1.4))
            d[0] *= side
            return self.at + np.array([self.length * (side > 0), 0.0]) + (self.half - r) * d, -d
        return self.at + np.array([rng.uniform(0.1, 0.9) * self.length, side * (self.half - r)]), np.array([0.0, -side])


class Path:
    """A line, an arc through a place, a line, joined smoothly; the solid on the left."""

    hollow = False

    def __init__(self, rng):
        self.first, self.last = rng.uniform(0.05, 0.2, 2)
        self.radius, self.bend = rng.uniform(0.03, 0.12), rng.uniform(0.4, 1.6) * rng.choice([-1, 1])
        # from (0, 0) along -x, the solid below; a bend to the left goes down, round a solid
        turn, self.centre = self.bend, np.array([-self.first, -math.copysign(self.radius, self.bend)])
        start = np.array([-self.first, 0.0])
        place = lambda a: self.centre + self.radius * math.copysign(1, turn) * along(math.pi / 2 + a)  # noqa: E731
        self.end = place(turn)
        self.way = along(math.pi + turn)
        tail = self.end + self.last * self.way
        self.text = (f"path: [[0, 0], [{number(start[0])}, {number(start[1])}], {{arc: [{number(self.end[0])}, {number(self.end[1])}], through: "
                     f"[{number(place(turn / 2)[0])}, {number(place(turn / 2)[1])}]}}, [{number(tail[0])}, {number(tail[1])}]]")

    def distances(self, p):
        if p[0] > -self.first:
            return [(p[1], np.array([0.0, 1.0]), 0.0)]
        n = np.array([self.way[1], -self.way[0]])
        if (p - self.end) @ self.way > 0:
            return [((p - self.end) @ n, n, 0.0)]
        return [from_arc(p, self.centre, self.radius, self.bend < 0)]

    def within(self, p):
        """Negative beyond its ends, of which the reference says nothing."""
        return min(-p[0], self.last - (p - self.end) @ self.way)

    def boundary(self, rng, r):
        n = np.array([self.way[1], -self.way[0]])
        which = rng.random()
        if which < 0.3:
            return np.array([-rng.uniform(0.2, 0.9) * self.first, r]), np.array([0.0, 1.0])
        if which < 0.6:
            return self.end + rng.uniform(0.1, 0.8) * self.last * self.way + r * n, n
        d = along(math.pi / 2 + rng.uniform(0.1, 0.9) * self.bend)
        return (self.centre + (self.radius + r) * d, d) if self.bend > 0 else (self.centre - (self.radius - r) * d, d)


class Circle:
    hollow = False

    def __init__(self, rng):
        self.radius, self.at = rng.uniform(0.03, 0.1), rng.uniform(-0.05, 0.05, 2)
        self.text = f"circle: {number(self.radius)}, at: [{number(self.at[0])}, {number(self.at[1])}]"

    def distances(self, p):
        return [from_arc(p, self.at, self.radius)]

    def boundary(self, rng, r):
        d = along(rng.uniform(-3, 3))
        return self.at + (self.radius + r) * d, d

    def support(self, angle):
        """The reach in a direction with two derivatives by its angle."""
        a, b = self.at @ along(angle), self.at @ along(angle + math.pi / 2)
        return self.radius + a, b, -a


class Segment:
    """A straight line, solid on the left of it; wide enough that its ends are far."""

    hollow = False

    def __init__(self, rng):
        self.ends = [rng.uniform(-0.1, 0.1, 2) + np.array([0.3, 0.0]), rng.uniform(-0.1, 0.1, 2) + np.array([-0.3, 0.0])]
        self.text = f"segment: {pairs(self.ends)}"
        t = (self.ends[1] - self.ends[0]) / np.linalg.norm(self.ends[1] - self.ends[0])
        self.n, self.t, self.length = np.array([t[1], -t[0]]), t, np.linalg.norm(self.ends[1] - self.ends[0])

    def within(self, p):
        along_it = (p - self.ends[0]) @ self.t
        return min(along_it, self.length - along_it)

    def distances(self, p):
        return [((p - self.ends[0]) @ self.n, self.n, 0.0)]

    def boundary(self, rng, r):
        return self.ends[0] + (self.ends[1] - self.ends[0]) * rng.uniform(0.3, 0.7) + r * self.n, self.n


# -- cams


def lift(by, x):
    """A rise of one over 0 .. 1, with two derivatives."""
    pi = math.pi
    if by == "harmonic":
        return (1 - math.cos(pi * x)) / 2, pi / 2 * math.sin(pi * x), pi * pi / 2 * math.cos(pi * x)
    if by == "cycloidal":
        return x - math.sin(2 * pi * x) / (2 * pi), 1 - math.cos(2 * pi * x), 2 * pi * math.sin(2 * pi * x)
    if by == "polynomial_345":
        p = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])
    elif by == "polynomial_4567":
        p = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    elif by == "modified_sine":
        k = pi / (4 + pi)
        if x < 1 / 8:
            return k * (x - math.sin(4 * pi * x) / (4 * pi)), k * (1 - math.cos(4 * pi * x)), 4 * pi * k * math.sin(4 * pi * x)
        if x < 7 / 8:
            a = 4 * pi / 3 * x + pi / 3
            return (k * (2 / pi + x - 9 / (4 * pi) * math.sin(a)), k * (1 - 3 * math.cos(a)), 4 * pi * k * math.sin(a))
        s, v, a = lift(by, 1 - x)
        return 1 - s, v, -a
    elif by == "modified_trapezoid":
        c = 8 * pi / (2 + pi)  # the largest acceleration; quarters of sines over an eighth
        if x < 1 / 8:
            w = 4 * pi
            return c * (x / w - math.sin(w * x) / w**2), c * (1 - math.cos(w * x)) / w, c * math.sin(w * x)
        v1, s1 = c / (4 * pi), c * (1 / (32 * pi) - 1 / (16 * pi * pi))
        if x < 3 / 8:
            u = x - 1 / 8
            return s1 + v1 * u + c * u * u / 2, v1 + c * u, c
        if x <= 1 / 2:
            v3, s3, u, w = v1 + c / 4, s1 + v1 / 4 + c / 32, x - 3 / 8, 4 * pi
            return s3 + v3 * u + c * (1 - math.cos(w * u)) / w**2, v3 + c * math.sin(w * u) / w, c * math.cos(w * u)
        s, v, a = lift(by, 1 - x)
        return 1 - s, v, -a
    return p(x), p.deriv()(x), p.deriv(2)(x)


LAWS = ("harmonic", "cycloidal", "polynomial_345", "polynomial_4567", "modified_sine", "modified_trapezoid")


class Lift:
    """A cam by the law of its follower, which is the follower that it has."""

    hollow = False

    def __init__(self, rng, follower, r):
        self.follower, self.r, self.base = follower, r, rng.uniform(0.04, 0.08)
        rise, ends = rng.uniform(0.004, 0.012), np.sort(rng.uniform(0, 2 * np.pi, 3))
        while np.diff(np.concatenate([[0], ends, [2 * np.pi]])).min() < 0.9:
            ends = np.sort(rng.uniform(0, 2 * np.pi, 3))
        by = [str(rng.choice(LAWS)) for _ in range(2)]
        self.parts = [(ends[0], rise, by[0]), (ends[1], 0.0, None), (ends[2], -rise, by[1]), (2 * np.pi, 0.0, None)]
        words = ", ".join(f"{{to: {number(to)}" + (f", rise: {number(up)}, by: {law}" if law else "") + "}" for to, up, law in self.parts)
        word = {"roller": f"roller: {number(r)}", "knife": "knife: yes", "flat": "flat: yes"}[follower]
        self.text = f"law: [{words}], base: {number(self.base)}, follower: {{{word}}}"

    def lifts(self, angle):
        """Over the angle of the cam: distance of the follower's place from its centre, with two derivatives."""
        angle, begin, height = angle % (2 * math.pi), 0.0, self.base + self.r
        for to, up, law in self.parts:
            if angle <= to:
                if law is None:
                    return height, 0.0, 0.0
                s, v, a = lift(law, (angle - begin) / (to - begin))
                return height + up * s, up * v / (to - begin), up * a / (to - begin) ** 2
            begin, height = to, height + up
        return height, 0.0, 0.0

    def distances(self, p):
        """Of the follower's place from the curve on which it is, to second order there; the roller's radius is added."""
        size, angle = math.hypot(*p), math.atan2(p[1], p[0])
        s, v, a = self.lifts(-angle)
        f, f1, f2 = s, -v, a  # by the polar angle
        e, t = p / size, np.array([-p[1], p[0]]) / size
        gradient = e - f1 / size * t
        hessian = np.outer(t, t) / size - f2 / size**2 * np.outer(t, t) + f1 / size**2 * (np.outer(e, t) + np.outer(t, e))
        length = np.linalg.norm(gradient)
        n = gradient / length
        across = np.array([-n[1], n[0]])
        return [((size - f) / length + self.r, n, across @ hessian @ across / length)]

    def boundary(self, rng, r):
        angle = rng.uniform(-3, 3)
        p = self.lifts(-angle)[0] * along(angle)
        return p, self.distances(p)[0][1]

    def support(self, angle):
        s, v, a = self.lifts(-angle)
        return s, -v, a


class Curve:
    """A cam by a table of its radius over the polar angle."""

    hollow = False

    def __init__(self, rng):
        while True:
            count = int(rng.integers(10, 20))
            self.angles = np.linspace(0, 2 * np.pi, count + 1) + rng.uniform(-1, 1)
            inner = slice(1, count)
            self.angles[inner] += rng.uniform(-0.1, 0.1, count - 1)
            base = rng.uniform(0.05, 0.09)
            a, b = rng.uniform(-0.12, 0.12, 2)
            self.radii = base * (1 + a * np.cos(self.angles) + b * np.sin(2 * self.angles) / 2)
            self.radii[-1] = self.radii[0]
            self.spline = CubicSpline(self.angles, self.radii, bc_type="periodic")
            if all(self.curvature(x) > 2 for x in np.linspace(0, 2 * np.pi, 400)):
                break
        self.text = "polar: {table}"
        self.table = f"x: [{', '.join(number(x) for x in self.angles)}], y: [{', '.join(number(y) for y in self.radii)}], periodic: yes"

    def radius(self, angle, order=0):
        first = self.angles[0]
        return float(self.spline(first + (angle - first) % (2 * math.pi), order))

    def curvature(self, angle):
        r, r1, r2 = (self.radius(angle, k) for k in range(3))
        return (r * r + 2 * r1 * r1 - r * r2) / (r * r + r1 * r1) ** 1.5

    def place(self, angle):
        """The place, its direction along the curve, its direction outwards."""
        r, r1 = self.radius(angle), self.radius(angle, 1)
        t = r1 * along(angle) + r * along(angle + math.pi / 2)
        t = t / np.linalg.norm(t)
        return r * along(angle), t, np.array([t[1], -t[0]])

    def distances(self, p):
        """By the foot of the perpendicular."""
        angle = math.atan2(p[1], p[0])
        for _ in range(50):
            c, t, n = self.place(angle)
            r, r1 = self.radius(angle), self.radius(angle, 1)
            d = (p - c) @ n
            step = (p - c) @ t / (math.hypot(r, r1) * (1 + self.curvature(angle) * d))
            angle += step
            if abs(step) < 1e-15:
                break
        c, t, n = self.place(angle)
        d, k = (p - c) @ n, self.curvature(angle)
        return [(d, n, k / (1 + k * d))]

    def boundary(self, rng, r):
        c, _, n = self.place(rng.uniform(-3, 3))
        return c + r * n, n

    def support(self, direction):
        """The place whose outward direction has an angle."""
        angle, wanted = direction, along(direction)
        for _ in range(60):
            c, t, n = self.place(angle)
            off = math.atan2(n[0] * wanted[1] - n[1] * wanted[0], n @ wanted)
            step = off / (self.curvature(angle) * math.hypot(self.radius(angle), self.radius(angle, 1)))
            angle += step
            if abs(step) < 1e-15:
                break
        c, t, _ = self.place(angle)
        return c @ wanted, c @ t, 1 / self.curvature(angle) - c @ wanted
