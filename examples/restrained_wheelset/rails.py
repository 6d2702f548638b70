#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wheelset on rails in space, from its own equations: eigenvalues at a speed, and critical speeds.

    python3 rails.py CONE V             eigenvalues
    python3 rails.py > rails.csv        critical speeds over the slope of the cones, beside the closed form

Two cones on rails that are as round as the wheels, contact rigid, patches by Hertz and linear forces by Kalker, for
ellipses that are all but circles: sizes go with the radius that a wheel rolls on, creepages with the speed of its own
centre. Newton's and Euler's equations of one body, the normal forces among the unknowns; the way around a straight run
at V by central differences. Nothing of it is shared with the library.
"""
import math
import sys

import numpy as np

G, NU = 82e9, 0.25
# Kalker 1990, table E.3, nu 1/4: C11, C22, C23, C33 at b/a = 0.9 across the direction of rolling, 1, and 0.9 along it.
TABLE = np.array([[4.01, 3.54, 1.36, 1.27], [4.12, 3.67, 1.47, 1.19], [4.22, 3.81, 1.59, 1.11]])
C11, C22 = TABLE[1, :2]
STEP = 3e-5  # of differences, with values at four places each: critical speeds move by less than 1e-7 with the half of it
WEIGHTS = ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12))


def newton(f, x):
    """The zero of two functions of two unknowns."""
    x = np.array(x, float)
    for _ in range(30):
        here, h = np.array(f(*x)), 1e-7
        slope = np.array([(np.array(f(*(x + h * e))) - np.array(f(*(x - h * e)))) / (2 * h) for e in np.eye(2)]).T
        step = np.linalg.solve(slope, here)
        x -= step
        if abs(step).max() < 1e-15:
            break
    return x


class Wheelset:
    """q = x, y, z, yaw, roll, spin. The middle of the axle is at z = 0 when it runs straight."""

    def __init__(self, cone, load=1.5e5, m=1250.0, yaw=700.0, spin=100.0, r0=0.45, b=0.75, ky=2.5e5, kpsi=2e6, g=82e9, friction=math.inf):
        self.cone, self.load, self.m, self.it, self.i_s, self.r0, self.b = cone, load, m, yaw, spin, r0, b
        self.ky, self.kpsi, self.g, self.friction = ky, kpsi, g, friction
        self.drive = False  # True: a load along x keeps the speed
        self.rail = r0
        self.centre = (b + self.rail * math.sin(math.atan(cone)), -r0 - self.rail * math.cos(math.atan(cone)))

    @staticmethod
    def axes(q):
        c, s, d, e = math.cos(q[3]), math.sin(q[3]), math.cos(q[4]), math.sin(q[4])
        return np.array([[c, -s * d, s * e], [s, c * d, -c * e], [0, e, d]])

    def rates(self, q):
        """Angular velocity over yaw, roll and spin rates."""
        a = self.axes(q)
        return np.array([[0, math.cos(q[3]), a[0, 1]], [0, math.sin(q[3]), a[1, 1]], [1, 0, a[2, 1]]])

    def touch(self, q, side):
        """Arm to the point of contact, the wheel's outward normal, and the gap."""
        axes, tilt = self.axes(q), math.sqrt(1 + self.cone**2)

        def point(s, angle):
            r = self.r0 - self.cone * s
            arm = axes @ (r * math.sin(angle), side * (self.b + s), -r * math.cos(angle))
            n = axes @ (math.sin(angle), side * self.cone, -math.cos(angle)) / tilt
            return arm, n, (side * self.centre[0] - q[1] - arm[1], self.centre[1] - q[2] - arm[2])

        def apart(s, angle):
            _, n, to = point(s, angle)
            return n[0], (to[0] * n[2] - to[1] * n[1]) / self.rail

        arm, n, to = point(*newton(apart, (0, 0)))
        return arm, n, to[0] * n[1] + to[1] * n[2] - self.rail

    def row(self, q, side):
        """Of the gap, over the rates of q."""
        arm, n, _ = self.touch(q, side)
        return -np.concatenate([n, self.rates(q).T @ np.cross(arm, n)])

    def stiffness(self, normal, along, across):
        """G a b and sqrt(a b) of a patch between surfaces with these curvatures, and the logarithm of a/b; all but a circle:
        with x = log(along/across) a b is off by x^2/36, log(a/b) by x^3/324 (Hertz)."""
        size = (3 * normal * (1 - NU) / (4 * self.g * math.sqrt(along * across))) ** (1 / 3)
        return self.g * size**2, size, math.log(across / along) * 2 / 3

    @staticmethod
    def coefficients(longer):
        """Kalker's, their logarithms parabolas over log(a/b) through three rows of the table."""
        last, rows = math.log(0.9), np.log(TABLE)
        x = -longer / last
        return np.exp(rows[1] + 0.5 * x * (rows[2] - rows[0]) + 0.5 * x * x * (rows[2] - 2 * rows[1] + rows[0]))

    def creep(self, v, w, arm, n, normal, e):
        side = math.copysign(self.b, arm @ e)
        speed, rolls = (v + np.cross(w, side * e))[0], np.linalg.norm(arm - (arm @ e) * e)
        gab, size, longer = self.stiffness(normal, 1 / (rolls * math.sqrt(1 + self.cone**2)), 1 / self.rail)
        c11, c22, c23, c33 = self.coefficients(longer)
        up, x = -n, np.array([1.0, 0, 0])
        across, slip = np.cross(up, x), v + np.cross(w, arm)
        xi, eta, spin = slip[0] / speed, slip @ across / speed, w @ up / speed
        force = -gab * c11 * xi * x - gab * (c22 * eta + size * c23 * spin) * across
        part = self.part(np.linalg.norm(force) / (self.friction * normal))
        return part * force, part * gab * size * (c23 * eta - size * c33 * spin) * up

    @staticmethod
    def part(t):
        """Of linear forces that are t times the bound of friction (Shen, Hedrick and Elkins 1983)."""
        return 1 - t / 3 + t * t / 27 if t < 3 else 1 / t

    def accelerations(self, q, qd):
        e, rates = self.axes(q)[:, 1], self.rates(q)
        v, w = qd[:3], rates @ qd[3:]
        turning = sum(k * self.rates(q + i * STEP * qd) for i, k in WEIGHTS) @ qd[3:] / STEP
        contacts = [self.touch(q, side) for side in (1, -1)]
        rows = [self.row(q, side) for side in (1, -1)]
        jdqd = [sum(k * self.row(q + i * STEP / np.linalg.norm(qd[1:5]) * qd, side) for i, k in WEIGHTS) @ qd / STEP
                * np.linalg.norm(qd[1:5]) if np.linalg.norm(qd[1:5]) > 0 else 0.0 for side in (1, -1)]
        inertia = self.it * np.eye(3) + (self.i_s - self.it) * np.outer(e, e)
        left, right = np.zeros((8, 8)), np.zeros(8)
        left[:3, :3], left[3:6, 3:6] = self.m * np.eye(3), inertia @ rates
        gyro = inertia @ turning + (self.i_s - self.it) * (w @ e) * np.cross(w, e)
        for k, (arm, n, _) in enumerate(contacts):
            left[:3, 6 + k], left[3:6, 6 + k], left[6 + k, :6] = n, np.cross(arm, n), rows[k]
        if self.drive:
            left[:, 0] = 0
            left[0, 0] = -1  # x' is constant: the load takes the place of its change
        normal = [self.load / 2] * 2
        for _ in range(60):
            force, moment = np.array([0, -self.ky * q[1], -self.load]), np.array([0, 0, -self.kpsi * q[3]])
            for k, (arm, n, _) in enumerate(contacts):
                f, twist = self.creep(v, w, arm, n, normal[k], e)
                force, moment = force + f, moment + twist + np.cross(arm, f)
            right[:3], right[3:6], right[6:] = force, moment - gyro, -np.array(jdqd)
            x = np.linalg.solve(left, right)
            before, normal = normal, x[6:]
            if abs(normal - before).max() < 1e-14 * self.load:
                break
        return x[:6]  # of x the load, where it is driven

    def closed(self, u, ud):
        """q and qd with z and roll as the contacts want them; u = x, y, yaw, spin."""
        put = lambda z, phi: np.array([u[0], u[1], z, u[2], phi, u[3]])
        q = put(*newton(lambda z, phi: [self.touch(put(z, phi), side)[2] for side in (1, -1)], (0, 0)))
        j = np.array([self.row(q, side) for side in (1, -1)])
        dz = np.linalg.solve(j[:, [2, 4]], -j[:, [0, 1, 3, 5]] @ ud)
        return q, np.array([ud[0], ud[1], dz[0], ud[2], dz[1], ud[3]])

    def jacobian(self, speed):
        """Of y, yaw, their rates, x' and spin' around the straight run."""
        def flow(state):
            q, qd = self.closed([0, state[0], state[1], 0], [state[4], state[2], state[3], state[5]])
            qdd = self.accelerations(q, qd)
            return np.array([state[2], state[3], qdd[1], qdd[3], qdd[0], qdd[5]])

        rest, sizes = np.array([0, 0, 0, 0, speed, speed / self.r0]), np.array([1, 1, speed, speed, speed, speed]) * STEP
        return np.array([sum(k * flow(rest + i * h * e) for i, k in WEIGHTS) / h for h, e in zip(sizes, np.eye(6))]).T

    def eigenvalues(self, speed):
        return sorted(np.linalg.eigvals(self.jacobian(speed)), key=lambda s: (abs(s), -s.imag))

    def critical(self, low, high):
        """Speed between low and high where the pair that grows first begins to, and its rate."""
        rightmost = lambda v: max((s for s in self.eigenvalues(v) if s.imag > 1), key=lambda s: s.real)
        a, b, fa, fb = low, high, rightmost(low).real, rightmost(high).real
        assert fa < 0 < fb, (low, high, fa, fb)
        while b - a > 1e-10 * b:
            c = b - fb * (b - a) / (fb - fa)
            fc = rightmost(c).real
            if (fc < 0) == (fb < 0):
                b, fb, fa = c, fc, fa / 2
            else:
                a, fa, b, fb = b, fb, c, fc
                a, fa, b, fb = (a, fa, b, fb) if a < b else (b, fb, a, fa)
            if abs(fc) < 1e-9:
                return c, rightmost(c).imag
        return b, rightmost(b).imag

    def closed_form(self):
        """Routh and Hurwitz on two equations: creep along f11, across f22, no spin, no gravity."""
        gab = self.stiffness(self.load / 2 * math.sqrt(1 + self.cone**2), 1 / self.rail, 1 / self.rail)[0]
        f11, f22, m, i, b, ky, kpsi = gab * C11, gab * C22, self.m, self.it, self.b, self.ky, self.kpsi
        w2 = (f22 * kpsi + f11 * b * b * ky) / (m * f11 * b * b + f22 * i)
        a = (m * i * w2**2 + ky * kpsi + 4 * f11 * f22 * b * self.cone / self.r0) / w2 - m * kpsi - ky * i
        return math.sqrt(4 * f11 * f22 * b * b / a), math.sqrt(w2)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        for s in Wheelset(float(sys.argv[1])).eigenvalues(float(sys.argv[2])):
            print(f"{s:.10g}")
        sys.exit()
    print("# The wheelset on rails, by rails.py: slope, shear modulus Pa, inertia of spin kg m^2, critical speed m/s and rate rad/s,")
    print("# and the speed of the closed form with these creep coefficients.")
    print("cone,shear_modulus,spin,speed,rate,closed")
    for g, spin in ((82e9, 100), (82e9, 0.1), (82e12, 0.1)):
        for cone in (0.1, 0.05, 0.025, 0.0125):
            w = Wheelset(cone, g=g, spin=spin)
            speed, _ = w.closed_form()
            found, rate = w.critical(0.8 * speed, 1.2 * speed)
            print(f"{cone},{g:g},{spin:g},{found:.9g},{rate:.9g},{speed:.9g}", flush=True)
