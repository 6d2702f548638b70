#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the car in absolute coordinates, in long doubles. Needs numpy.

    python3 reference_suspension.py > reference.csv

Each of the 16 bodies has a place, a quaternion, a velocity and a turning rate; each joint is rows between two bodies (81 of
them), their multipliers follow from J M^-1 J'. No tree, no relative coordinate, no choice of independent ones. Extrapolated
midpoint rule (../extrapolation.py); twice as long steps give the same to 1e-14. Three minutes. Places of points are those at
the start, in ground axes.
"""
import pathlib
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from extrapolation import run  # noqa: E402

REAL = np.longdouble
G = REAL("9.81")


def vector(*x):
    """From decimal text or integers, without a detour by doubles."""
    return np.array([REAL(str(v)) for v in x])


class Body:
    def __init__(self, origin, mass, com, inertia):
        """`com` from the origin; inertia xx yy zz xy xz yz about it."""
        xx, yy, zz, xy, xz, yz = vector(*inertia)
        self.start = origin + com
        self.mass, self.inertia = REAL(str(mass)), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


bodies, names = [], {}
pins, hinges, rods, springs = [], [], [], []               # points that coincide; axes; distances; forces
FLAT = np.zeros(3, REAL)


def body(name, origin, mass, com, inertia):
    names[name] = len(bodies)
    bodies.append(Body(origin, mass, com, inertia))


def arm(name, place):
    """Index of a body (-1: the ground) and the place from its centre of mass, or on the ground."""
    k = names.get(name, -1)
    return k, place - bodies[k].start if k >= 0 else place


def pin(a, b, place):
    pins.append((*arm(a, place), *arm(b, place)))


def hinge(a, b, place, axis):
    pin(a, b, place)
    axis = axis / np.sqrt(axis @ axis)
    least = np.eye(3, dtype=REAL)[np.argmin(abs(axis))]
    across = np.cross(axis, least)
    across /= np.sqrt(across @ across)
    hinges.append((names[a], axis, names[b], across))
    hinges.append((names[a], axis, names[b], np.cross(axis, across)))


def rod(a, pa, b, pb):
    rods.append((*arm(a, pa), *arm(b, pb), np.sqrt((pb - pa) @ (pb - pa))))


def spring(a, pa, b, pb, k, c, free):
    springs.append((*arm(a, pa), *arm(b, pb), REAL(k), REAL(c), free))


def build():
    y = vector(0, 1, 0)
    body("chassis", FLAT, 1000, vector("-1.1", 0, "0.2"), (350, 1400, 1600, 0, -40, 0))
    body("rack", vector("-0.14", 0, "-0.05"), 4, FLAT, ("0.06", "0.001", "0.06", 0, 0, 0))
    for side, s in (("left", 1), ("right", -1)):
        m = vector(1, s, 1)                               # mirrors a place
        pu, pl = vector("-0.02", "0.42", "0.16") * m, vector(0, "0.32", "-0.11") * m
        u, low = pu + vector("-0.01", "0.24", "0.02") * m, pl + vector("0.01", "0.38", "-0.02") * m
        wheel = low + vector("-0.01", "0.05", "0.13") * m
        body(f"{side}_upper", pu, 3, vector("-0.004", "0.12", "0.01") * m, ("0.016", "0.011", "0.026", 0, 0, 0))
        body(f"{side}_lower", pl, 8, vector("0.005", "0.18", "-0.01") * m, ("0.10", "0.07", "0.16", f"{s * 0.004}", 0, 0))
        body(f"{side}_upright", low, 12, vector("-0.015", "0.01", "0.12") * m, ("0.12", "0.13", "0.05", 0, "0.006", f"{-s * 0.004}"))
        body(f"{side}_wheel", wheel, 18, vector(0, "0.02", 0) * m, ("0.6", 1, "0.6", 0, 0, 0))
        bar = vector("-0.30", "0.30", "0.02") * m
        body(f"{side}_bar", bar, "1.5", vector("0.08", "0.06", "0.01") * m, ("0.006", "0.009", "0.014", f"{-s * 0.005}", 0, 0))
        back = vector("-2.1", "0.55", "-0.02") * m
        rear = back + vector("-0.4", "0.2", "0.02") * m
        body(f"{side}_arm", back, 15, vector("-0.22", "0.06", "0.01") * m, ("0.10", "0.45", "0.50", 0, 0, 0))
        body(f"{side}_rear", rear, 18, FLAT, ("0.6", 1, "0.6", 0, 0, 0))
        hinge("chassis", f"{side}_upper", pu, vector(1, f"{s * 0.05}", "-0.08"))
        hinge("chassis", f"{side}_lower", pl, vector(1, f"{-s * 0.03}", "0.04"))
        hinge(f"{side}_upright", f"{side}_wheel", wheel, y)
        hinge("chassis", f"{side}_bar", bar, y)
        hinge("chassis", f"{side}_arm", back, y)
        hinge(f"{side}_arm", f"{side}_rear", rear, y)
        pin(f"{side}_upper", f"{side}_upright", u)
        pin(f"{side}_lower", f"{side}_upright", low)
        rod("rack", vector("-0.14", "0.34", "-0.05") * m, f"{side}_upright", low + vector("-0.15", "-0.02", "0.09") * m)
        rod(f"{side}_bar", bar + vector("0.22", "0.20", "0.03") * m, f"{side}_lower", pl + vector("-0.06", "0.20", "-0.01") * m)
        top, foot = vector("-0.02", "0.46", "0.38") * m, pl + vector(0, "0.23", 0) * m
        spring("chassis", top, f"{side}_lower", foot, 45000, 3000, np.sqrt((top - foot) @ (top - foot)) + REAL("0.145"))
        spring("chassis", vector("-2.45", "0.58", "0.40") * m, f"{side}_arm", back + vector("-0.35", "0.05", "0.02") * m,
               40000, 2500, REAL("0.47"))
        for name, centre, lift in ((f"{side}_upright", wheel, "0.015"), (f"{side}_arm", rear, "0.013")):
            ahead = vector(0, "0.75", 0) * m if name.endswith("upright") else vector("-2.5", "0.75", 0) * m
            spring("", ahead - vector(0, 0, "0.3"), name, centre, 200000, 400, REAL("0.3") + REAL(lift))
            spring("", ahead + vector(0, 2, 0) * m, name, centre, 80000, 500, REAL(2))
            spring("", ahead + vector(2, 0, 0), name, centre, 30000, 300, REAL(2))


build()
N = len(bodies)
RACK, CHASSIS = names["rack"], names["chassis"]
MASS = np.array([b.mass for b in bodies])


def turning(p):
    """Matrices of quaternions (n x 4)."""
    w, x, y, z = p.T
    size = w * w + x * x + y * y + z * z
    rows = [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]]
    return np.array(rows).transpose(2, 0, 1) / size[:, None, None]


def unpack(state):
    s = state.reshape(N, 13)
    return s[:, :3], s[:, 3:7], s[:, 7:10], s[:, 10:]


def skew(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]], dtype=REAL)


class Rows:
    """Rows J of (velocity, turning rate) of all bodies, and what J's change with time leaves at the accelerations."""

    def __init__(self, place, a, v, w):
        self.place, self.a, self.v, self.w, self.rows, self.bias = place, a, v, w, [], []

    def point(self, k, local):
        """Place, velocity, acceleration by the rates alone, lever."""
        if k < 0:
            return local, FLAT, FLAT, FLAT
        lever = self.a[k] @ local
        turn = np.cross(self.w[k], lever)
        return self.place[k] + lever, self.v[k] + turn, np.cross(self.w[k], turn), lever

    def add(self, terms, bias):
        """terms: body, its 6 coefficients."""
        row = np.zeros((N, 6), REAL)
        for k, linear, angular in terms:
            row[k, :3] += linear
            row[k, 3:] += angular
        self.rows.append(row.ravel())
        self.bias.append(bias)

    def gap(self, i, pi, j, pj, along, along_rate, along_second):
        """d . along = const with d from a point of i to one of j and `along` turning with i (rates given)."""
        a, va, ca, la = self.point(i, pi)
        b, vb, cb, lb = self.point(j, pj)
        d, rate, second = b - a, vb - va, cb - ca
        self.add([(j, along, np.cross(lb, along)), (i, -along, -np.cross(la, along) + np.cross(along, d))],
                 second @ along + 2 * rate @ along_rate + d @ along_second)

    def close(self):
        w = self.w
        for i, pi, j, pj in pins:
            a, b = self.point(i, pi), self.point(j, pj)
            for e, la, lb in zip(np.eye(3, dtype=REAL), skew(a[3]), skew(b[3])):
                self.add([(j, e, -lb), (i, -e, la)], e @ (b[2] - a[2]))
        axes = [(i, u, j, x) for i, u, j, x in hinges]
        eye = np.eye(3, dtype=REAL)
        axes += [(CHASSIS, eye[k], RACK, eye[(k + 1) % 3]) for k in range(3)]  # the rack does not turn
        for i, u, j, x in axes:
            u, x = self.a[i] @ u, self.a[j] @ x
            ud, xd = np.cross(w[i], u), np.cross(w[j], x)
            self.add([(i, FLAT, np.cross(u, x)), (j, FLAT, np.cross(x, u))],
                     np.cross(w[i], ud) @ x + 2 * ud @ xd + u @ np.cross(w[j], xd))
        for e in (eye[0], eye[2]):                        # nor moves but along y of the chassis
            along = self.a[CHASSIS] @ e
            rate = np.cross(w[CHASSIS], along)
            local = bodies[RACK].start - bodies[CHASSIS].start
            self.gap(CHASSIS, local, RACK, FLAT, along, rate, np.cross(w[CHASSIS], rate))
        for i, pi, j, pj, _ in rods:
            a, b = self.point(i, pi), self.point(j, pj)
            d, rate = b[0] - a[0], b[1] - a[1]
            self.add([(j, d, np.cross(b[3], d)), (i, -d, -np.cross(a[3], d))], d @ (b[2] - a[2]) + rate @ rate)
        return np.array(self.rows), np.array(self.bias)


def eliminate(s, b):
    """Solves with s, which is positive definite: long doubles are not in LAPACK."""
    n = len(b)
    m = np.column_stack([s, b])
    for k in range(n - 1):
        m[k + 1:, k:] -= np.outer(m[k + 1:, k] / m[k, k], m[k, k:])
    x = np.zeros(n, REAL)
    for k in range(n - 1, -1, -1):
        x[k] = (m[k, n] - m[k, k + 1:n] @ x[k + 1:]) / m[k, k]
    return x


def bar_angle(a, side):
    """Of half of the anti-roll bar, about y of the chassis."""
    r = a[CHASSIS].T @ a[names[f"{side}_bar"]]
    return np.arctan2(r[0, 2], r[0, 0])


def rates(_, state):
    place, p, v, w = unpack(state)
    a = turning(p)
    force = np.zeros((N, 6), REAL)
    force[:, 2] = -G * MASS
    for k, b in enumerate(bodies):
        world = a[k] @ b.inertia @ a[k].T
        force[k, 3:] -= np.cross(w[k], world @ w[k])
    rows = Rows(place, a, v, w)
    for i, pi, j, pj, k, c, free in springs:
        x, y = rows.point(i, pi), rows.point(j, pj)
        d, rate = y[0] - x[0], y[1] - x[1]
        length = np.sqrt(d @ d)
        pull = d / length * (k * (length - free) + c * (d @ rate) / length)
        for n, sign, at in ((i, 1, x), (j, -1, y)):
            if n >= 0:
                force[n, :3] += sign * pull
                force[n, 3:] += sign * np.cross(at[3], pull)
    axis = a[CHASSIS][:, 1]
    left, right = names["left_bar"], names["right_bar"]
    twist = 900 * (bar_angle(a, "right") - bar_angle(a, "left")) + 4 * (w[right] - w[left]) @ axis
    force[left, 3:] += axis * twist
    force[right, 3:] -= axis * twist
    local = bodies[RACK].start - bodies[CHASSIS].start    # the column holds the rack
    middle, speed, _, lever = rows.point(CHASSIS, local)
    shift, shift_rate = (place[RACK] - middle) @ axis, (v[RACK] - speed) @ axis + (place[RACK] - middle) @ np.cross(w[CHASSIS], axis)
    hold = -(60000 * shift + 800 * shift_rate) * axis
    force[RACK, :3] += hold
    force[CHASSIS, :3] -= hold
    force[CHASSIS, 3:] -= np.cross(place[RACK] - place[CHASSIS], hold)
    jacobian, bias = rows.close()
    free, weighted = np.zeros((N, 6), REAL), np.zeros((len(bias), N, 6), REAL)
    of_body = jacobian.reshape(-1, N, 6)
    free[:, :3] = force[:, :3] / MASS[:, None]
    weighted[:, :, :3] = of_body[:, :, :3] / MASS[None, :, None]
    for k, b in enumerate(bodies):
        inverse = a[k] @ b.inverse @ a[k].T
        free[k, 3:] = inverse @ force[k, 3:]
        weighted[:, k, 3:] = of_body[:, k, 3:] @ inverse
    weighted = weighted.reshape(len(bias), -1)
    multipliers = eliminate(jacobian @ weighted.T, -bias - jacobian @ free.ravel())
    qdd = (free.ravel() + weighted.T @ multipliers).reshape(N, 6)
    x, y, z = w.T
    turn = np.stack([-x * p[:, 1] - y * p[:, 2] - z * p[:, 3], x * p[:, 0] + y * p[:, 3] - z * p[:, 2],
                     y * p[:, 0] + z * p[:, 1] - x * p[:, 3], z * p[:, 0] + x * p[:, 2] - y * p[:, 1]], 1) / 2
    return np.hstack([v, turn, qdd]).ravel()


def start():
    spin = vector("0.5", "0.1", 0)
    state = np.zeros((N, 13), REAL)
    for k, b in enumerate(bodies):
        state[k, :3], state[k, 3] = b.start, 1
        state[k, 7:10] = vector(0, 0, "-0.4") + np.cross(spin, b.start)
        state[k, 10:] = spin
    for name in ("left_wheel", "right_wheel", "left_rear", "right_rear"):
        k = names[name]
        state[k, 10:] += vector(0, 40, 0)
    return state.ravel()


def coordinates(state):
    """The model's coordinates that are easily told, and their rates."""
    place, p, v, w = unpack(state)
    a = turning(p)
    c, out = a[CHASSIS], {}
    lever = c @ -bodies[CHASSIS].start
    origin, speed = place[CHASSIS] + lever, v[CHASSIS] + np.cross(w[CHASSIS], lever)
    for k, name in enumerate("xyz"):
        out[name] = origin[k], speed[k]
    roll, pitch, yaw = np.arctan2(-c[1, 2], c[2, 2]), np.arcsin(c[0, 2]), np.arctan2(-c[0, 1], c[0, 0])
    # w = e1 roll' + e2 pitch' + e3 yaw' of successive axes x, y, z
    e2 = np.array([REAL(0), np.cos(roll), np.sin(roll)])
    e3 = c[:, 2]
    yaw_rate = (w[CHASSIS] @ np.cross(vector(1, 0, 0), e2)) / (e3 @ np.cross(vector(1, 0, 0), e2))
    rest = w[CHASSIS] - yaw_rate * e3
    out["roll"], out["pitch"], out["yaw"] = (roll, rest[0]), (pitch, rest @ e2), (yaw, yaw_rate)
    axis = c[:, 1]
    middle = place[CHASSIS] + c @ (bodies[RACK].start - bodies[CHASSIS].start)
    d = place[RACK] - middle
    rate = v[RACK] - v[CHASSIS] - np.cross(w[CHASSIS], middle - place[CHASSIS])
    out["rack"] = d @ axis, rate @ axis + d @ np.cross(w[CHASSIS], axis)
    for side in ("left", "right"):
        for part in ("upper", "lower", "bar", "arm"):
            k = names[f"{side}_{part}"]
            e = next(u for i, u, j, _ in hinges if j == k)
            r = c.T @ a[k]
            sine = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) @ e
            out[f"{side}_{part}"] = np.arctan2(sine, np.trace(r) - 1), (w[k] - w[CHASSIS]) @ (c @ e)
    return out


def inverse3(m):
    """By cofactors."""
    rows = [np.cross(m[:, 1], m[:, 2]), np.cross(m[:, 2], m[:, 0]), np.cross(m[:, 0], m[:, 1])]
    return np.array(rows) / (m[:, 0] @ rows[0])


for each in bodies:
    each.inverse = inverse3(each.inertia)

if __name__ == "__main__":
    h = REAL(1) / int(sys.argv[1] if len(sys.argv) > 1 else 160)
    first = True
    for t, state in run(rates, start(), [REAL("0.25"), REAL("0.5"), REAL(1)], h, 9):
        found = coordinates(state)
        if first:
            print("# Absolute coordinates in long doubles by reference_suspension.py, a formulation of its own; two step sizes agree to 1e-14.")
            print(",".join(["t", *(f"q.{x}" for x in found), *(f"qd.{x}" for x in found)]))
            first = False
        print(",".join([f"{float(t):g}"] + [np.format_float_scientific(found[x][k], 14, False) for k in (0, 1) for x in found]))
