#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two wheels that turn by themselves on one axle: eigenvalues of the straight run, from its own equations.

    python3 independent.py V SPIN [NAME=VALUE ..]     eigenvalues; SPIN is the inertia of a wheel about the axle
    python3 independent.py > independent.csv          eigenvalues over speeds and inertias, speeds where waves begin to grow

Newton's and Euler's equations of an axle and two wheels, y and yaw free, height and roll as both contacts want them. Cones
on rails whose tops are circles, in closed form; Hertz's ellipses and Kalker's table (../contact_tables.py). The state is y, yaw, their rates, the
speed and the rates of both wheels; derivatives are taken by complex steps. Nothing of it is shared with the library.

Springs are `ky` and `kpsi`. Parts are left out by 0, and are 1 otherwise: `gyro` (moments of the wheels that turn, as the axle
rolls and yaws), `turn` (what it takes to change their rates; not 0 itself), `c11`, `c22`, `c23`, `c33` of the creep forces.
"""
import pathlib
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from contact_tables import coefficients, ellipse  # noqa: E402

STEP, GRAVITY = 1e-25, 9.81
Z, X = np.array([0, 0, 1.0]), np.array([1.0, 0, 0])


class Vehicle:
    """q = x, y, z, yaw, roll, left, right; u = y, yaw, y', yaw', x', left', right'."""

    def __init__(self, spin, cone=0.025, r0=0.46, b=0.75, rail=0.08, shear=82e9, nu=0.28, least=0.01, **parts):
        self.spin, self.cone, self.r0, self.b, self.rail, self.shear, self.nu, self.least = spin, cone, r0, b, rail, shear, nu, least
        self.parts = dict(gyro=1, turn=1, c11=1, c22=1, c23=1, c33=1, ky=0, kpsi=0, mass=600, wheel=200) | parts
        tilt = np.hypot(1, cone)
        self.centre = b + rail * cone / tilt, -rail  # of a rail's top, outwards and up
        self.height = r0 - rail + rail / tilt

    def axes(self, yaw, roll):
        c, s, d, e = np.cos(yaw), np.sin(yaw), np.cos(roll), np.sin(roll)
        return np.array([[c, -s * d, s * e], [s, c * d, -c * e], [0 * d, e, d]])

    def touch(self, q, side):
        """Arm from the axle's middle to the point of contact, the cone's normal there, the gap and the radius.

        Wheel and rail can touch where the normal (sin t, cone, -cos t) of the generator at t has no part along the track. That
        generator is a straight line, the rail's top a circle: the foot of the circle's centre on it, and the distance."""
        axes, tilt = self.axes(q[3], q[4]), np.hypot(1, self.cone)
        t = np.arctan(axes[0, 2] / axes[0, 0]) - np.arcsin(side * self.cone * axes[0, 1] / np.sqrt(axes[0, 0] ** 2 + axes[0, 2] ** 2))
        across = np.array([np.sin(t), 0 * t, -np.cos(t)])
        n = axes @ (across + np.array([0, side * self.cone, 0])) / tilt
        start, line = axes @ (self.r0 * across + [0, side * self.b, 0]), axes @ ([0, side, 0] - self.cone * across) / tilt
        to = np.array([0, side * self.centre[0] - q[1], self.centre[1] - q[2]]) - [0, start[1], start[2]]
        s = (to @ line) / (line[1:] @ line[1:])
        return start + s * line, n, to @ n - self.rail, self.r0 - self.cone * s / tilt

    def closed(self, y, yaw):
        """Height and roll at which both gaps are zero."""
        z, roll = self.height + 0 * y, 0 * y
        for _ in range(8):
            gaps, rows = [], []
            for side in (1, -1):
                arm, n, gap, _ = self.touch([0, y, z, yaw, roll], side)
                gaps.append(gap)
                rows.append(self.row(yaw, arm, n)[[2, 4]])
            z, roll = np.array([z, roll]) - np.linalg.solve(np.array(rows), np.array(gaps))
        return z, roll

    @staticmethod
    def row(yaw, arm, n):
        """The gap's derivatives by q: how the point of the wheel moves along -n; nothing changes as a wheel turns."""
        ahead, moment = np.array([np.cos(yaw), np.sin(yaw), 0]), np.cross(arm, n)
        return -np.array([0 * n[0], n[1], n[2], Z @ moment, ahead @ moment, 0, 0])

    def creep(self, slip, turn, normal, radius, speed):
        """Force along and to the left, moment about the normal: G a b (C11 xi, C22 eta + sqrt(ab) C23 spin, ..)."""
        p = self.parts
        a, b, _ = ellipse(1 / (radius * np.hypot(1, self.cone)), 1 / self.rail, normal, self.shear / (1 - self.nu))
        c = [value * p[name] for value, name in zip(coefficients(a, b, self.nu), ("c11", "c22", "c23", "c33"))]
        xi, eta, spin, size, gab = slip[0] / speed, slip[1] / speed, turn / speed, np.sqrt(a * b), self.shear * a * b
        return -gab * c[0] * xi, -gab * (c[1] * eta + size * c[2] * spin), gab * size * (c[2] * eta - size * c[3] * spin)

    def bodies(self, ahead, e):
        """Of the axle and both wheels: what moves their centres and turns them over the rates of q, the centre's place, mass,
        inertia across and about the axle, the last one for its change and for its turning with the axle."""
        p = self.parts
        wheel = p["wheel"], 62.5, self.spin * p["turn"], self.spin * p["gyro"]
        for place, left, right, inertia in (0, 0, 0, (p["mass"], 250, 20, 20)), (1, 1, 0, wheel), (-1, 0, 1, wheel):
            arm = place * self.b * e
            moves, turns = np.zeros((2, 3, 7), complex)
            moves[:, :5] = np.column_stack([np.eye(3), np.cross(Z, arm), np.cross(ahead, arm)])
            turns[:, 3:] = np.column_stack([Z, ahead, left * e, right * e])
            yield moves, turns, arm, inertia

    @staticmethod
    def inertia(body, qd, e, ahead):
        """Mass matrix and what else the inertia takes: H = A (w - (e.w) e) + B (e.w) e of a body that is round about e."""
        moves, turns, _, (m, across, about, gyro) = body
        w, axle = turns @ qd, qd[3] * Z + qd[4] * ahead
        de = np.cross(axle, e)
        bend = qd[3] * qd[4] * np.cross(Z, ahead) + (w - axle) @ e * de  # w' without accelerations
        mass = m * moves.T @ moves + across * turns.T @ turns + (about - across) * np.outer(e @ turns, e @ turns)
        rest = across * bend + (about - across) * (e @ bend + w @ de) * e + (gyro - across) * (e @ w) * de
        return mass, turns.T @ rest

    def pull(self, body, contact, qd, load):
        """Generalised force of the creep of a wheel."""
        (moves, turns, centre, _), (arm, n, _, radius) = body, contact
        v, w, out, t = moves @ qd, turns @ qd, arm - centre, np.cross(-n, X)
        slip, speed = v + np.cross(w, out), np.sqrt(v[0] ** 2 + self.least**2)
        along, across, moment = self.creep((slip @ X, slip @ t), -(w @ n), load, radius, speed)
        force = along * X + across * t
        return moves.T @ force + turns.T @ (np.cross(out, force) - moment * n)

    def flow(self, u):
        """Rates of u. Terms of second order, as the change of the rows along the run, are left out."""
        p, (y, yaw, dy, dyaw, speed, left, right) = self.parts, u
        z, roll = self.closed(y, yaw)
        ahead, e = np.array([np.cos(yaw), np.sin(yaw), 0]), self.axes(yaw, roll)[:, 1]
        contacts = [self.touch([0, y, z, yaw, roll], side) for side in (1, -1)]
        rows = np.array([self.row(yaw, arm, n) for arm, n, _, _ in contacts])
        qd = np.array([speed, dy, 0, dyaw, 0, left, right])
        qd[[2, 4]] = np.linalg.solve(rows[:, [2, 4]], -rows @ qd)
        bodies, mass, force = list(self.bodies(ahead, e)), 0, np.array([0, -p["ky"] * y, 0, -p["kpsi"] * yaw, 0, 0, 0])
        for body in bodies:
            own, rest = self.inertia(body, qd, e, ahead)
            mass, force = mass + own, force - rest - body[3][0] * GRAVITY * body[0][2]
        normal = np.full(2, 0.5 * GRAVITY * (p["mass"] + 2 * p["wheel"]))
        system = np.block([[mass, -rows.T], [rows, np.zeros((2, 2))]])
        for _ in range(60):
            pull = sum(self.pull(body, contact, qd, load) for body, contact, load in zip(bodies[1:], contacts, normal))
            found = np.linalg.solve(system, np.concatenate([force + pull, [0, 0]]))
            change, normal = abs(found[7:] - normal).max(), found[7:]
            if change < 1e-13 * abs(normal).max():
                break
        return np.array([dy, dyaw, found[1], found[3], found[0], found[5], found[6]])

    def jacobian(self, speed):
        rest = np.array([0, 0, 0, 0, speed, speed / self.r0, speed / self.r0], complex)
        return np.array([self.flow(rest + 1j * STEP * e).imag / STEP for e in np.eye(7)]).T

    def eigenvalues(self, speed):
        """Those above or on the real axis, less the one that is zero: any speed goes on."""
        found = sorted(np.linalg.eigvals(self.jacobian(speed)), key=abs)[1:]
        return [s for s in found if s.imag >= 0]

    def wave(self, speed):
        """The pair that steers: the slowest one."""
        return next(s for s in self.eigenvalues(speed) if s.imag > 0)

    def critical(self, low, high):
        """Speed between low and high at which the wave neither grows nor decays."""
        while high - low > 1e-10 * high:
            middle = 0.5 * (low + high)
            if (self.wave(middle).real > 0) == (self.wave(low).real > 0):
                low = middle
            else:
                high = middle
        return low


def table():
    """Rows of independent.csv."""
    springs = {"ky": 25e3, "kpsi": 2e5}
    for spin in (0.001, 1, 40):
        for speed in (0.2, 2, 10, 20, 40):
            for s in Vehicle(spin).eigenvalues(speed):
                yield speed, spin, 0, 0, s
    for spin in (0.001, 40):
        for s in Vehicle(spin, **springs).eigenvalues(20):
            yield 20, spin, *springs.values(), s
    for spin, low, high in ((40, 3.5, 10), (40, 10, 20)):
        v = Vehicle(spin)
        speed = v.critical(low, high)
        yield speed, spin, 0, 0, 1j * v.wave(speed).imag
    for spin, low, high in ((1, 60, 120), (10, 20, 60), (40, 20, 60)):
        v = Vehicle(spin, **springs)
        speed = v.critical(low, high)
        yield speed, spin, *springs.values(), 1j * v.wave(speed).imag


if __name__ == "__main__":
    if len(sys.argv) >= 3:
        given = dict(word.split("=") for word in sys.argv[3:])
        for s in Vehicle(float(sys.argv[2]), **{name: float(x) for name, x in given.items()}).eigenvalues(float(sys.argv[1])):
            print(f"{s:.9g}")
        sys.exit()
    print("# Wheels that turn by themselves, by independent.py: speed m/s, inertia of a wheel about the axle kg m^2, springs N/m and")
    print("# N m, and eigenvalues 1/s, those with an imaginary part once; where the real part is 0 the speed was looked for.")
    print("V,spin,ky,kpsi,re,im")
    for speed, spin, ky, kpsi, s in table():
        print(f"{speed:.10g},{spin:g},{ky:g},{kpsi:g},{s.real:.10g},{s.imag:.10g}")
