# SPDX-License-Identifier: BSD-3-Clause
"""Motion of a plane mechanism of one degree of freedom without loss, while its crank keeps turning one way: needs mpmath.

No equations of motion: positions are circles that meet, one pair after the other, as complex numbers; rates are those by the
crank's angle. The energy says how fast the crank turns, and with the inertia I and the potential V at its angle

    t = integral of sqrt(I / (2 (E - V))) over the angle

by Gauss's formula panel by panel, with the angle for a given t by Newton's iteration.
"""
from mpmath import conj, cos, im, mp, mpc, mpf, pi, sqrt

mp.dps = 40
G = mpf("9.81")
NODES = 24


def cross(a, b):
    return im(conj(a) * b)


def meet(a, ra, b, rb):
    """The point where a circle of radius ra around a meets one of rb around b: left of the way from a to b."""
    way = b - a
    far = abs(way)
    along = (ra**2 - rb**2 + far**2) / (2 * far)
    return a + way / far * mpc(along, sqrt(ra**2 - along**2))


def pair(rate, u, v):
    """Rates w, w' of two bars u, v that end in one point: rate + i w u = i w' v."""
    return cross(v, 1j * rate) / cross(v, u), -cross(u, 1j * rate) / cross(u, v)


def bar(mass, start, rate, along, spin):
    """Inertia by the crank's rate, and potential, of a uniform slender bar from `start` on, `along` its length."""
    centre = along / 2
    return mass * (abs(rate + 1j * spin * centre) ** 2 + abs(spin * along) ** 2 / 12), mass * G * im(start + centre)


def gauss(n):
    """Nodes and weights on (0, 1): Newton's iteration on Legendre's polynomial."""
    found = []
    for k in range(n):
        x = cos(pi * (k + mpf("0.75")) / (n + mpf("0.5")))
        for _ in range(8):
            before, now = mpf(1), x
            for j in range(2, n + 1):
                before, now = now, ((2 * j - 1) * x * now - (j - 1) * before) / j
            slope = n * (x * now - before) / (x * x - 1)
            x -= now / slope
        found.append(((1 + x) / 2, 1 / ((1 - x * x) * slope**2)))
    return found


RULE = gauss(NODES)


class Turning:
    """inertia(angle): I and V; from an angle and a rate on."""

    def __init__(self, inertia, start, rate):
        self.inertia, self.start = inertia, start
        mass, height = inertia(start)
        self.energy = mass * rate**2 / 2 + height

    def rate(self, angle):
        mass, height = self.inertia(angle)
        return sqrt(2 * (self.energy - height) / mass)

    def time(self, low, high):
        return (high - low) * sum(w / self.rate(low + x * (high - low)) for x, w in RULE)

    def angles(self, ends, panels):
        """Of the crank at each time: the panels of the first turn are kept, as every turn takes the same time."""
        wide = 2 * pi / panels
        turn = [mpf(0)]
        for k in range(panels):
            turn.append(turn[-1] + self.time(self.start + k * wide, self.start + (k + 1) * wide))
        for end in ends:
            turns = int(end / turn[-1])
            left = end - turns * turn[-1]
            k = max(j for j in range(panels) if turn[j] <= left)
            low = self.start + k * wide
            angle = low + (left - turn[k]) * self.rate(low)
            for _ in range(10):
                angle -= (turn[k] + self.time(low, angle) - left) * self.rate(angle)
            yield angle + 2 * pi * turns
