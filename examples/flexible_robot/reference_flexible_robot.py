#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the flexible robot by equations of its own (needs NumPy and SciPy):

    python3 reference_flexible_robot.py > reference.csv

A place of a link is r = P + R(theta) (x - s, v): P the elbow, theta the angle of the line between both pins, v the deflection, a sum
of the polynomials xi (1 - xi) (2 xi - 1)^k, and s half the integral of v'^2, by which the link becomes shorter. Virtual work of the
accelerations is summed at points of Gauss. The tool is where two circles about the elbows meet, with the lengths of both lines as
radii: angles follow from deflections, which are integrated.

    python3 reference_flexible_robot.py --other

prints the motion of the robot in tests/unit/test_flexible.c, whose digits another program computed: a free tool, no damping.
"""
import math
import sys

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

TIMES = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4]
CRANK, LENGTH, APART, TOOL, PACE, SHAPES = 0.25, 0.45, 0.5, 1.2, 8, 3
WIDE, THICK = 0.04, 0.003
ROBOT = {"mass": 2700 * WIDE * THICK, "stiffness": 70e9 * WIDE * THICK**3 / 12, "ratio": 0.01, "turn": 0.001}
OTHER = {"mass": 0.32, "stiffness": 6, "ratio": 0, "turn": 0}  # by length, E I, of critical damping, of the tool


class Robot:
    def __init__(self, data):
        nodes, weights = np.polynomial.legendre.leggauss(16)
        xi, self.weight = (nodes + 1) / 2, data["mass"] * LENGTH * weights / 2
        shapes = [Polynomial([0, 1, -1]) * Polynomial([-1, 2])**k for k in range(SHAPES)]
        slopes = [p.deriv() / LENGTH for p in shapes]
        bends = [p.deriv(2) / LENGTH**2 for p in shapes]
        short = [[LENGTH * (a * b).integ() for b in slopes] for a in slopes]  # s = z' short z / 2
        self.x = LENGTH * xi
        self.v = np.array([p(xi) for p in shapes]).T
        self.g = np.array([[p(xi) for p in row] for row in short]).transpose(2, 0, 1)
        self.g_end = np.array([[p(1) for p in row] for row in short])
        self.slope = [np.array([p(end) for p in slopes]) for end in (0, 1)]
        over = lambda a, b: LENGTH * (a * b).integ()(1)
        self.k = data["stiffness"] * np.array([[over(a, b) for b in bends] for a in bends])
        mass = data["mass"] * np.array([[over(a, b) for b in shapes] for a in shapes])
        squares, modes = eigh(self.k, mass)
        self.d = mass @ modes @ np.diag(2 * data["ratio"] * np.sqrt(squares)) @ modes.T @ mass
        self.turn = data["turn"]

    def cranks(self, t):
        """Angles, rates and accelerations of both."""
        s, c = math.sin(PACE * t)**2, PACE * math.sin(2 * PACE * t)
        a = 2 * PACE**2 * math.cos(2 * PACE * t)
        return [(middle + way * s, way * c, way * a) for middle, way in ((2.2, -0.5), (0.9, 0.4))]

    def elbows(self, t):
        """Places, velocities and accelerations."""
        for origin, (angle, rate, more) in zip((0, APART), self.cranks(t)):
            out, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
            yield np.array([origin, 0]) + CRANK * out, CRANK * rate * across, CRANK * (more * across - rate**2 * out)

    def angles(self, places, z):
        """Of the lines between the pins of both links."""
        length = [LENGTH - y @ self.g_end @ y / 2 for y in z]
        way = places[1] - places[0]
        apart, along = math.hypot(*way), math.atan2(way[1], way[0])
        inner = [math.acos((apart**2 + a**2 - b**2) / (2 * apart * a)) for a, b in (length, length[::-1])]
        return along + inner[0], along + math.pi - inner[1]

    def places(self, theta, z, rates, x, v, g):
        """Of points of a link: derivatives by theta and z, and what the acceleration has besides; all in the axes of the ground."""
        omega, zd = rates
        gz, gzd, vz, vzd = g @ z, g @ zd, v @ z, v @ zd
        along, way = x - gz @ z / 2, -(gz @ zd)                # of a place in the axes of the link, and its rate
        turned = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
        by = turned @ np.stack([np.column_stack([-vz, -gz]), np.column_stack([along, v])], axis=1)
        rest = np.stack([-(gzd @ zd) - 2 * omega * vzd - omega**2 * along, 2 * omega * way - omega**2 * vz]).T
        return by, rest @ turned.T, np.stack([along, vz]).T @ turned.T

    def end(self, theta, z, rates):
        return [one[0] for one in self.places(theta, z, rates, np.array([LENGTH]), np.zeros((1, SHAPES)), self.g_end[None])]

    def rates(self, t, z, zd):
        """Angles, and their rates, by which both ends stay together."""
        elbows = list(self.elbows(t))
        theta = self.angles([e[0] for e in elbows], z)
        ends = [self.end(theta[i], z[i], (0, zd[i]))[0] for i in (0, 1)]
        apart = elbows[1][1] + ends[1][:, 1:] @ zd[1] - elbows[0][1] - ends[0][:, 1:] @ zd[0]
        return elbows, theta, np.linalg.solve(np.column_stack([ends[0][:, 0], -ends[1][:, 0]]), apart)

    def solve(self, t, state):
        z, zd = state[:2 * SHAPES].reshape(2, SHAPES), state[2 * SHAPES:].reshape(2, SHAPES)
        elbows, theta, omega = self.rates(t, z, zd)
        n = SHAPES + 1
        m, f, closure, apart = np.zeros((2 * n, 2 * n)), np.zeros(2 * n), np.zeros((2, 2 * n)), np.zeros(2)
        for i in (0, 1):
            own = slice(i * n, (i + 1) * n)
            by, rest, _ = self.places(theta[i], z[i], (omega[i], zd[i]), self.x, self.v, self.g)
            weighted = (self.weight[:, None, None] * by).reshape(-1, n).T
            m[own, own] += weighted @ by.reshape(-1, n)
            f[own] -= weighted @ (rest + elbows[i][2]).ravel()
            f[own][1:] -= self.k @ z[i] + self.d @ zd[i]
            by, rest, _ = self.end(theta[i], z[i], (omega[i], zd[i]))
            if i == 0:
                m[own, own] += TOOL * by.T @ by
                f[own] -= TOOL * by.T @ (rest + elbows[i][2])
                spin = np.array([1, *self.slope[1]])
                m[own, own] += self.turn * np.outer(spin, spin)
            closure[:, own] = (1 - 2 * i) * by
            apart += (1 - 2 * i) * (rest + elbows[i][2])
        whole = np.block([[m, closure.T], [closure, np.zeros((2, 2))]])
        return np.linalg.solve(whole, np.concatenate([f, -apart])), theta, omega

    def run(self, tolerance):
        def derivative(t, state):
            more = self.solve(t, state)[0]
            return np.concatenate([state[2 * SHAPES:], more[1:1 + SHAPES], more[2 + SHAPES:2 + 2 * SHAPES]])

        done = solve_ivp(derivative, (0, TIMES[-1]), np.zeros(4 * SHAPES), "DOP853", TIMES, rtol=tolerance, atol=1e-3 * tolerance)
        return done.y.T

    def row(self, t, state):
        """Angles of motors and elbows, their rates, and the force at the pin."""
        z, zd = state[:2 * SHAPES].reshape(2, SHAPES), state[2 * SHAPES:].reshape(2, SHAPES)
        more, theta, omega = self.solve(t, state)
        q, qd = [], []
        for i, (angle, rate, _) in enumerate(self.cranks(t)):
            q += [angle, theta[i] + self.slope[0] @ z[i] - angle]
            qd += [rate, omega[i] + self.slope[0] @ zd[i] - rate]
        return [*q, *qd, *more[-2:]]


def print_other():
    robot = Robot(OTHER)
    for t, state in zip(TIMES, robot.run(1e-13)):
        z = state[:2 * SHAPES].reshape(2, SHAPES)
        (elbow, _, _), _ = elbows = list(robot.elbows(t))
        theta = robot.angles([e[0] for e in elbows], z)
        tool = elbow + robot.end(theta[0], z[0], (0, z[0]))[2]
        middle = [z[i] @ [0.25, 0, 0] for i in (0, 1)]
        print(f"t {t:g}  tool {tool[0]:.12f} {tool[1]:.12f}  angles {theta[0]:.12f} {theta[1]:.12f}  "
              f"middles {middle[0]:.10e} {middle[1]:.10e}")


def main():
    if sys.argv[1:] == ["--other"]:
        return print_other()
    robot = Robot(ROBOT)
    table, other = ([robot.row(t, y) for t, y in zip(TIMES, robot.run(tolerance))] for tolerance in (1e-13, 1e-11))
    names = ["motor_l", "elbow_l", "motor_r", "elbow_r"]
    differ = max(abs(a - b) for one, two in zip(table, other) for a, b in zip(one[:4], two[:4]))
    print("# By reference_flexible_robot.py: a link is a sum of polynomials between its pins, with a formulation of its own.")
    print(f"# SciPy's DOP853; angles at tolerances of 1e-13 and 1e-11 differ by {differ:.0e}.", file=sys.stderr)
    print(",".join(["t", *(f"q.{name}" for name in names), *(f"qd.{name}" for name in names), "lambda.pin.1", "lambda.pin.2"]))
    for t, row in zip(TIMES, table):
        print(",".join([f"{t:g}", *(f"{x:.14g}" for x in row[:4]), *(f"{x:.12g}" for x in row[4:])]))


if __name__ == "__main__":
    main()
