#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Linear equations of the coach with a flexible car body, with equations of their own.

    python3 reference_flexible_car.py > reference.csv
    python3 reference_flexible_car.py modes
    kempe response flexible_car_shaken.yaml --inputs 'drive(z1),drive(z2),drive(z3),drive(z4),drive(y1),drive(y2),drive(y3),drive(y4)' --outputs 'acceleration(car.middle).z,acceleration(car.above_front).z,acceleration(car.middle).y,acceleration(car.end).y' --frequencies 0.5:40:200 -o response.csv
    python3 reference_flexible_car.py response.csv

Needs numpy and scipy. The car body is a free beam by Rayleigh: deflections v and w along y and z and the twist p are sums of Legendre
polynomials over its length, the rigid motions among them, and a frame of reference does not occur. A section turns by (p, -w', v'), and
what is fixed to it is moved by this rotation. Energies are integrals by Gauss's rule. The damping is a part of critical damping for
each elastic mode of the free body. Below the body are two bogie frames on wheelsets whose motion is given:

    (s^2 M + s C + K) q = -(s C_given + K_given) given,     acceleration = s^2 row q.

Spectra of accelerations on a straight track follow from the level of the spectrum "low" of ERRI B176, which all axles meet one after
the other, and weighted ones from the filter Wb of EN 12299.
"""
import csv
import functools
import math
import sys

import numpy as np
from numpy.polynomial import Legendre
from scipy.linalg import eigh

MASS, IXX, IYY, CENTRES, WHEELBASE = 32000.0, 56800.0, 1.97e6, 19.0, 2.56
HIGH, SECONDARY, FLOOR, R0, FRAME_HIGH = 1.8, 0.8275, 1.2, 0.46, 0.6
EI, EI_LATERAL, GJ, RATIO = 4e9, 6e9, 8e8, 0.015
FRAME = 2615.0, (1722.0, 1476.0, 3067.0)
SECONDARY_K, SECONDARY_C = (160e3, 160e3, 430e3), (25e3, 32e3, 20e3)       # of a side: along, across, vertical
BENDING, ANTI_ROLL = 10.5e3, 940e3
PRIMARY_K, PRIMARY_C = (31391e3, 3884e3, 1220e3), (15e3, 2e3, 4e3)         # of an axle box
SHAPES = 5, 5, 3                                           # elastic ones: across, vertical, twist
LENGTH = math.sqrt(12 * (IYY - IXX / 2) / MASS)
PLACES = tuple(c + w for c in (CENTRES / 2, -CENTRES / 2) for w in (WHEELBASE / 2, -WHEELBASE / 2))  # of the axles
OUTPUTS = {"acceleration.car.middle.z": (0, 2), "acceleration.car.above_front.z": (CENTRES / 2, 2), "acceleration.car.middle.y": (0, 1),
           "acceleration.car.end.y": (LENGTH / 2, 1)}      # place from the middle, direction
INPUTS = [f"{d}{k}" for d in "zy" for k in (1, 2, 3, 4)]


def cross(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


class Beam:
    """Coordinates: x of the axis, then coefficients of v, w and p."""

    def __init__(self, shapes=SHAPES, vertical=EI):
        counts = shapes[0] + 2, shapes[1] + 2, shapes[2] + 1
        self.first = 1, 1 + counts[0], 1 + counts[0] + counts[1]
        self.size = 1 + sum(counts)
        self.families = [[Legendre.basis(j) for j in range(n)] for n in counts]
        nodes, weights = np.polynomial.legendre.leggauss(2 * max(counts))
        half = LENGTH / 2
        line, section = MASS / LENGTH, IXX / 2 / LENGTH
        self.M, self.K = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        self.M[0, 0] = MASS
        for f, terms in enumerate((((0, line), (1, section), (2, EI_LATERAL)), ((0, line), (1, section), (2, vertical)),
                                   ((0, 2 * section), (1, GJ)))):
            part = slice(self.first[f], self.first[f] + counts[f])
            for order, factor in terms:
                values = np.array([p.deriv(order)(nodes) if order else p(nodes) for p in self.families[f]]) / half**order
                matrix = self.K if factor is terms[-1][1] else self.M
                matrix[part, part] += factor * half * (values * weights) @ values.T
        squares, modes = eigh(self.K, self.M)
        self.rates = np.sqrt(np.where(squares < 1e-6 * squares[-1], 0, squares))
        self.modes = modes
        moved = self.M @ modes
        self.C = moved @ np.diag(2 * RATIO * self.rates) @ moved.T

    def point(self, x, below=(0, 0, 0)):
        """Displacement and rotation of what is fixed to the section at x from the middle: 3 x size each."""
        moved, turned = np.zeros((3, self.size)), np.zeros((3, self.size))
        moved[0, 0] = 1
        for f in range(3):
            for j, p in enumerate(self.families[f]):
                k, at, slope = self.first[f] + j, p(2 * x / LENGTH), p.deriv()(2 * x / LENGTH) * 2 / LENGTH
                if f < 2:
                    moved[1 + f, k] = at
                    turned[2 - f, k] = slope if f == 0 else -slope
                else:
                    turned[0, k] = at
        return moved - cross(np.array(below)) @ turned, turned


class Coach:
    def __init__(self, beam):
        self.beam, n = beam, beam.size
        size = n + 12
        self.M, self.C, self.K = (np.zeros((size, size)) for _ in range(3))
        self.M[:n, :n], self.C[:n, :n], self.K[:n, :n] = beam.M, beam.C, beam.K
        self.given_c, self.given_k = np.zeros((size, 8)), np.zeros((size, 8))
        for b, x in enumerate((CENTRES / 2, -CENTRES / 2)):
            own = slice(n + 6 * b, n + 6 * b + 6)
            self.M[own, own] = np.diag([FRAME[0]] * 3 + [*FRAME[1]])
            upper = self.padded(slice(0, n), *beam.point(x, (0, 0, SECONDARY - HIGH)))
            lower = self.padded(own, *self.of_frame((0, 0, SECONDARY - FRAME_HIGH)))
            k, c = 2 * np.array(SECONDARY_K), 2 * np.array(SECONDARY_C)
            self.spring([a - b for a, b in zip(lower, upper)], k, (k[2] + 2 * BENDING + ANTI_ROLL, 2 * BENDING, k[0]),
                        c, (c[2], 0, c[0]))
            for a, way in enumerate((WHEELBASE / 2, -WHEELBASE / 2)):
                k, c = 2 * np.array(PRIMARY_K), 2 * np.array(PRIMARY_C)
                box = self.padded(own, *self.of_frame((way, 0, R0 - FRAME_HIGH)))
                self.spring(box, k, (k[2], 0, k[0]), c, (c[2], 0, c[0]), 2 * b + a)

    @staticmethod
    def of_frame(place):
        eye, none = np.eye(3), np.zeros((3, 3))
        return np.hstack([eye, -cross(np.array(place))]), np.hstack([none, eye])

    def padded(self, own, moved, turned):
        rows = np.zeros((3, len(self.M))), np.zeros((3, len(self.M)))
        for row, part in zip(rows, (moved, turned)):
            row[:, own] = part
        return rows

    def spring(self, rows, along_k, about_k, along_c, about_c, axle=None):
        """Along and about three axes, between bodies or to an axle whose displacement is given."""
        for matrix, given, along, about in ((self.K, self.given_k, along_k, about_k), (self.C, self.given_c, along_c, about_c)):
            matrix += rows[0].T @ np.diag(along) @ rows[0] + rows[1].T @ np.diag(about) @ rows[1]
            if axle is not None:
                given[:, axle] -= along[2] * rows[0][2]
                given[:, 4 + axle] -= along[1] * rows[0][1]

    def row(self, x, direction):
        """Displacement of the floor above x."""
        row = np.zeros(len(self.M))
        row[:self.beam.size] = self.beam.point(x, (0, 0, FLOOR - HIGH))[0][direction]
        return row

    def response(self, frequencies):
        """Accelerations of OUTPUTS by displacements of INPUTS: for each frequency one row for each output."""
        s = 2j * math.pi * np.atleast_1d(frequencies)[:, None, None]
        q = np.linalg.solve(s * s * self.M + s * self.C + self.K, -(s * self.given_c + self.given_k))
        return s * s * (np.array([self.row(*place) for place in OUTPUTS.values()]) @ q)


@functools.cache
def coach(flexible=True, vertical=EI):
    return Coach(Beam(SHAPES if flexible else (0, 0, 0), vertical))


def wave(output, frequencies, speed, flexible=True, vertical=EI):
    """Acceleration by a level of 1 m that all axles meet."""
    response = coach(flexible, vertical).response(frequencies)[:, list(OUTPUTS).index(output), :4]
    return (response * np.exp(2j * math.pi * np.outer(frequencies, PLACES) / speed)).sum(axis=1)


def level(frequency, speed):
    """Spectral density of the spectrum "low" of ERRI B176, m^2/Hz."""
    w = 2 * math.pi * frequency / speed
    return 4.032e-7 * 0.8246**2 / ((w**2 + 0.0206**2) * (w**2 + 0.8246**2)) * 2 * math.pi / speed


def weighting(frequency):
    """Wb of EN 12299."""
    s, w = 2j * math.pi * frequency, lambda f: 2 * math.pi * f
    band = s**2 / (s**2 + math.sqrt(2) * w(0.4) * s + w(0.4) ** 2) * w(100) ** 2 / (s**2 + math.sqrt(2) * w(100) * s + w(100) ** 2)
    transition = (1 + s / w(16)) / (1 + s / (0.63 * w(16)) + (s / w(16)) ** 2)
    step = 0.4 * (1 + s / (0.8 * w(2.5)) + (s / w(2.5)) ** 2) / (1 + s / (0.8 * w(4)) + (s / w(4)) ** 2)
    return band * transition * step


def weighted(output, speed, flexible=True, vertical=EI, waves=(2.0, 70.0), step=0.05):
    """Root mean square of the weighted acceleration on the track, in m/s^2, by waves of these lengths."""
    f = np.arange(speed / waves[1], speed / waves[0], step)
    return math.sqrt((abs(wave(output, f, speed, flexible, vertical) * weighting(f)) ** 2 * level(f, speed)).sum() * step)


def compare(path):
    """The largest relative difference of a table of `kempe response`, with the larger of both and 1e-6 of the largest of its column."""
    with open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    names = rows[0][1::2]
    table = np.array([[float(x) for x in row] for row in rows[1:]])
    found = table[:, 1::2] * np.exp(1j * np.radians(table[:, 2::2]))
    known = coach().response(table[:, 0])
    worst = 0.0
    for k, name in enumerate(names):
        output, given = name.removesuffix(".amplitude").split("/")
        exact = known[:, list(OUTPUTS).index(output), INPUTS.index(given.removeprefix("drive(").removesuffix(")"))]
        scale = np.maximum(abs(exact), 1e-6 * abs(known[:, list(OUTPUTS).index(output)]).max())
        worst = max(worst, (abs(found[:, k] - exact) / scale).max())
    print(f"{len(table)} frequencies, {len(names)} pairs, largest relative difference {worst:.1e}")
    return worst


def table():
    print("# Accelerations by displacements of an axle, 1/s^2: real and imaginary parts, by reference_flexible_car.py")
    pairs = [(o, g) for o in OUTPUTS for g in (("z1", "z2", "z3", "z4") if o.endswith("z") else ("y1", "y2", "y3", "y4"))]
    print("frequency," + ",".join(f"{o}/{g}.{part}" for o, g in pairs for part in ("re", "im")))
    for f in (0.5, 1, 2, 4, 6, 8, 8.5, 8.8, 9, 10, 11, 12, 16, 20, 24, 30, 40):
        values = coach().response(f)[0]
        found = [values[list(OUTPUTS).index(o), INPUTS.index(g)] for o, g in pairs]
        print(f"{f:g}," + ",".join(f"{x:.11e}" for value in found for x in (value.real, value.imag)))


def modes():
    """Frequencies of the free body with more and more shapes; the first one of Euler and Bernoulli, without rotary inertia."""
    for n in range(1, 9):
        rates = Beam((n, n, n)).rates / (2 * math.pi)
        print(n, *(f"{f:.5f}" for f in rates[rates > 0][:6]))
    print(f"Euler and Bernoulli: {4.730040744862704**2 / LENGTH**2 * math.sqrt(EI * LENGTH / MASS) / (2 * math.pi):.5f} Hz")


if __name__ == "__main__":
    if not sys.argv[1:]:
        table()
    elif sys.argv[1] == "modes":
        modes()
    else:
        sys.exit(not compare(sys.argv[1]) < 1e-8)
