#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes reference.csv: the limousine in absolute coordinates, in long doubles. Needs numpy.

    python3 reference_limousine.py > reference.csv

Each of the 20 bodies has a place, a quaternion, a velocity and a turning rate; joints and rods are 73 rows between two
bodies, whose multipliers follow from J M^-1 J'. Bushings turn back by the quaternion between their bodies. Extrapolated
midpoint rule (../extrapolation.py). Half an hour. Places of points are those at the start, in ground axes, where all bodies' axes are
parallel.
"""
import pathlib
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from extrapolation import run  # noqa: E402

REAL = np.longdouble
ZERO = np.zeros(3, REAL)
EYE = np.eye(3, dtype=REAL)


def vector(*x):
    """From decimal text or integers, without a detour by doubles."""
    return np.array([REAL(str(v)) for v in x])


names, place0, mass, inertia, origin = [], [], [], [], {}
balls, hinges, rods, springs, bushings, brakes = [], [], [], [], [], []


def body(name, at, m, com, xx, yy, zz, xy=0, xz=0, yz=0):
    """`at`: its origin; `com` from there; inertia about the centre of mass."""
    names.append(name)
    origin[name] = at
    place0.append(at + com)
    mass.append(REAL(str(m)))
    i = {k: REAL(str(v)) for k, v in dict(xx=xx, yy=yy, zz=zz, xy=xy, xz=xz, yz=yz).items()}
    inertia.append(np.array([[i["xx"], i["xy"], i["xz"]], [i["xy"], i["yy"], i["yz"]], [i["xz"], i["yz"], i["zz"]]]))


def at(name, place):
    """A body's number (-1: the ground) and the place from its centre of mass."""
    k = names.index(name) if name else -1
    return k, place - place0[k] if name else place


def length(x):
    return np.sqrt(x @ x)


def rod(a, pa, b, pb):
    rods.append((*at(a, pa), *at(b, pb), length(pb - pa)))


def bushing(a, pa, b, pb, k, c, kr=(0, 0, 0), cr=(0, 0, 0)):
    bushings.append((*at(a, pa), *at(b, pb), vector(*k), vector(*c), vector(*kr), vector(*cr)))


def hinge(a, b, place):
    """About y."""
    balls.append((*at(a, place), *at(b, place)))
    hinges.append((names.index(a), names.index(b)))


def corner(prefix, carrier, middle, s):
    def p(x, y, z):
        return middle + vector(x, y, z) * vector(1, s, 1)
    arm, upright, wheel, bar = (f"{prefix}_{part}" for part in ("arm", "upright", "wheel", "bar"))
    low = p(0, "0.37", "-0.10")
    ball = low + vector("0.01", "0.38", "-0.03") * vector(1, s, 1)
    hub = ball + vector("-0.01", "0.03", "0.13") * vector(1, s, 1)
    centre = ball + vector("-0.01", "0.06", "0.13") * vector(1, s, 1)
    body(arm, low, 7, vector("-0.01", "0.17", "-0.01") * vector(1, s, 1), "0.11", "0.09", "0.19", xy=f"{s * 0.003}")
    body(upright, ball, 14, vector("-0.01", "0.01", "0.13") * vector(1, s, 1), "0.16", "0.18", "0.07", xz="0.006", yz=f"{-s * 0.004}")
    body(wheel, hub, 22, vector(0, "0.03", 0) * vector(1, s, 1), "0.8", "1.4", "0.8")
    pivot = p("-0.30", "0.32", "0.02")
    body(bar, pivot, "1.6", vector("0.08", "0.05", "0.01") * vector(1, s, 1), "0.03", "0.01", "0.035", xy=f"{-s * 0.005}")
    balls.append((*at(arm, ball), *at(upright, ball)))
    hinge(upright, wheel, hub)
    hinge(carrier, bar, pivot)
    rod(carrier, p("0.13", "0.48", "0.17"), upright, ball + vector(0, "-0.03", "0.33") * vector(1, s, 1))
    rod(carrier, p("-0.16", "0.47", "0.16"), upright, ball + vector("-0.04", "-0.03", "0.33") * vector(1, s, 1))
    front = prefix[0] == "F"
    inner = p("-0.15", "0.36", "-0.05")
    rod("rack" if front else "chassis", inner, upright, ball + vector("-0.15", "-0.02", "0.09") * vector(1, s, 1))
    rod(bar, pivot + vector("0.23", "0.28", "0.04") * vector(1, s, 1), arm, low + vector("-0.06", "0.24", "0.01") * vector(1, s, 1))
    for x, share in (("0.18", 1), ("-0.20", 2)):
        eye = p(x, "0.37", "-0.10")
        bushing(carrier, eye, arm, eye, (500000, 8000000 // share, 8000000 // share), (3000,) * 3, (25, 500, 500), ("0.3",) * 3)
    brakes.append((names.index(upright), names.index(wheel)))
    top, foot = p(0, "0.52", "0.50"), low + vector(0, "0.22", "0.01") * vector(1, s, 1)
    k, c, free = (60000, 4000, "0.736") if front else (55000, 3600, "0.72")
    springs.append((*at("chassis", top), *at(arm, foot), REAL(k), REAL(c), REAL(free)))
    post = p(0, "0.81", "0.020" if front else "0.017")
    bushings.append((-1, post, *at(upright, centre), vector(180000, 160000, 250000), vector(300, 300, 300), ZERO, ZERO))


def build():
    body("chassis", ZERO, 1450, vector("-1.6", 0, "0.24"), 520, 2400, 2600, xz=-60)
    body("subframe", ZERO, 32, vector("-0.03", 0, "-0.04"), "2.2", "1.3", "3.2")
    engine = vector("-0.15", 0, "0.20")
    body("engine", engine, 230, vector("-0.08", "0.01", "0.02"), 9, 24, 22, xz="1.5")
    body("rack", vector("-0.15", 0, "-0.05"), 4, ZERO, "0.06", "0.001", "0.06")
    back = vector("-3.1", 0, 0)
    for prefix, carrier, middle, s in (("FL", "subframe", ZERO, 1), ("FR", "subframe", ZERO, -1), ("RL", "chassis", back, 1),
                                       ("RR", "chassis", back, -1)):
        corner(prefix, carrier, middle, s)
    for x, y in (("0.30", "0.42"), ("0.30", "-0.42"), ("-0.35", "0.40"), ("-0.35", "-0.40")):
        eye = vector(x, y, "0.02")
        bushing("chassis", eye, "subframe", eye, (5000000, 5000000, 7500000), (4000,) * 3)
    for carrier, x, y in (("subframe", "0.20", "0.30"), ("subframe", "0.20", "-0.30"), ("chassis", "-0.70", "0.20"), ("chassis", "-0.70", "-0.20")):
        eye = engine + vector(x, y, "-0.15")
        bushing(carrier, eye, "engine", eye, (154000, 132000, 220000), (900,) * 3)
    for axle, middle, k in (("F", ZERO, 1400), ("R", back, 700)):
        eye = middle + vector("-0.30", 0, "0.02")
        bushing(f"{axle}L_bar", eye, f"{axle}R_bar", eye, (0, 0, 0), (0, 0, 0), (0, k, 0), (0, 4, 0))


build()
N = len(names)
SUBFRAME, RACK = names.index("subframe"), names.index("rack")
MASS, INERTIA = np.array(mass), np.array(inertia)


def inverse3(m):
    """By cofactors."""
    rows = [np.cross(m[:, 1], m[:, 2]), np.cross(m[:, 2], m[:, 0]), np.cross(m[:, 0], m[:, 1])]
    return np.array(rows) / (m[:, 0] @ rows[0])


INVERSE = np.array([inverse3(m) for m in INERTIA])


def turning(p):
    """Matrices of quaternions (n x 4)."""
    w, x, y, z = p.T
    size = w * w + x * x + y * y + z * z
    rows = [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]]
    return np.array(rows).transpose(2, 0, 1) / size[:, None, None]


def between(p, i, j):
    """The quaternion of j against i, of length one."""
    a, b = (np.concatenate([p[k, :1], p[k, 1:]]) / length(p[k]) if k >= 0 else vector(1, 0, 0, 0) for k in (i, j))
    e0 = a[0] * b[0] + a[1:] @ b[1:]
    e = a[0] * b[1:] - b[0] * a[1:] - np.cross(a[1:], b[1:])
    return (e0, e) if e0 >= 0 else (-e0, -e)


class Moving:
    """All bodies at a state."""

    def __init__(self, state):
        s = state.reshape(N, 13)
        self.x, self.p, self.v, self.w = s[:, :3], s[:, 3:7], s[:, 7:10], s[:, 10:]
        self.a = turning(self.p)

    def axes(self, k):
        return self.a[k] if k >= 0 else EYE

    def rate(self, k):
        return self.w[k] if k >= 0 else ZERO

    def point(self, k, local):
        """Place, velocity, acceleration by the rates alone, lever."""
        if k < 0:
            return local, ZERO, ZERO, ZERO
        lever = self.a[k] @ local
        turn = np.cross(self.w[k], lever)
        return self.x[k] + lever, self.v[k] + turn, np.cross(self.w[k], turn), lever


def push(force, m, k, lever, f):
    if k >= 0:
        force[k, :3] += f
        force[k, 3:] += np.cross(lever, f)


def turn(force, k, moment):
    if k >= 0:
        force[k, 3:] += moment


def add_springs(m, force):
    for i, pi, j, pj, k, c, free in springs:
        a, b = m.point(i, pi), m.point(j, pj)
        d, rate = b[0] - a[0], b[1] - a[1]
        size = length(d)
        pull = d / size * (k * (size - free) + c * (d @ rate) / size)
        push(force, m, i, a[3], pull)
        push(force, m, j, b[3], -pull)


def add_bushings(m, force):
    for i, pi, j, pj, k, c, kr, cr in bushings:
        a, b, axes = m.point(i, pi), m.point(j, pj), m.axes(i)
        d, rate = b[0] - a[0], b[1] - a[1]
        pull = axes @ (k * (axes.T @ d) + c * (axes.T @ (rate - np.cross(m.rate(i), d))))
        push(force, m, i, a[3] + d, pull)
        push(force, m, j, b[3], -pull)
        if kr.any():
            e0, e = between(m.p, i, j)
            back = axes @ (2 * (e0 * kr * e + np.cross(e, kr * e)) + cr * (axes.T @ (m.rate(j) - m.rate(i))))
            turn(force, i, back)
            turn(force, j, -back)


def angle(m, i, j):
    """Of j against i about their y."""
    r = m.a[i].T @ m.a[j]
    return np.arctan2(r[0, 2], r[0, 0]), (m.w[j] - m.w[i]) @ m.a[i][:, 1]


def shift(m):
    """Of the rack along y of the subframe, and its rate; the place there that is not shifted."""
    axis = m.a[SUBFRAME][:, 1]
    middle = m.point(SUBFRAME, place0[RACK] - place0[SUBFRAME])
    d = m.x[RACK] - middle[0]
    return d @ axis, (m.v[RACK] - middle[1]) @ axis + d @ np.cross(m.w[SUBFRAME], axis)


def add_joints(m, force):
    for i, j in brakes:
        q, qd = angle(m, i, j)
        back = (3000 * q + 5 * qd) * m.a[i][:, 1]
        turn(force, i, back)
        turn(force, j, -back)
    q, qd = shift(m)
    hold = -(80000 * q + 800 * qd) * m.a[SUBFRAME][:, 1]
    push(force, m, RACK, ZERO, hold)
    push(force, m, SUBFRAME, m.x[RACK] - m.x[SUBFRAME], -hold)


class Rows:
    """Rows J of (velocity, turning rate) of all bodies, and what J's change with time leaves at the accelerations."""

    def __init__(self, m):
        self.m, self.rows, self.bias = m, [], []
        self.close()

    def add(self, terms, bias):
        row = np.zeros((N, 6), REAL)
        for k, linear, angular in terms:
            row[k, :3] += linear
            row[k, 3:] += angular
        self.rows.append(row.ravel())
        self.bias.append(bias)

    def across(self, i, u, j, x):
        """An axis of i stays perpendicular to one of j."""
        m = self.m
        u, x = m.a[i] @ u, m.a[j] @ x
        ud, xd = np.cross(m.w[i], u), np.cross(m.w[j], x)
        self.add([(i, ZERO, np.cross(u, x)), (j, ZERO, np.cross(x, u))], np.cross(m.w[i], ud) @ x + 2 * ud @ xd + u @ np.cross(m.w[j], xd))

    def close(self):
        m = self.m
        for i, pi, j, pj in balls:
            a, b = m.point(i, pi), m.point(j, pj)
            for e in EYE:
                self.add([(j, e, np.cross(b[3], e)), (i, -e, -np.cross(a[3], e))], e @ (b[2] - a[2]))
        for i, j in hinges:
            self.across(i, EYE[1], j, EYE[0])
            self.across(i, EYE[1], j, EYE[2])
        for k in range(3):                                # the rack does not turn, nor moves but along y
            self.across(SUBFRAME, EYE[k], RACK, EYE[(k + 1) % 3])
        a = m.point(SUBFRAME, place0[RACK] - place0[SUBFRAME])
        d, rate, second = m.x[RACK] - a[0], m.v[RACK] - a[1], -a[2]
        for e in (EYE[0], EYE[2]):
            along = m.a[SUBFRAME] @ e
            ad = np.cross(m.w[SUBFRAME], along)
            self.add([(RACK, along, ZERO), (SUBFRAME, -along, -np.cross(a[3], along) + np.cross(along, d))],
                     second @ along + 2 * rate @ ad + d @ np.cross(m.w[SUBFRAME], ad))
        for i, pi, j, pj, _ in rods:
            a, b = m.point(i, pi), m.point(j, pj)
            d, rate = b[0] - a[0], b[1] - a[1]
            self.add([(j, d, np.cross(b[3], d)), (i, -d, -np.cross(a[3], d))], d @ (b[2] - a[2]) + rate @ rate)


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


def rates(_, state):
    m = Moving(state)
    force = np.zeros((N, 6), REAL)
    force[:, 2] = -REAL("9.81") * MASS
    world = m.a @ INERTIA @ m.a.transpose(0, 2, 1)
    force[:, 3:] -= np.cross(m.w, (world @ m.w[:, :, None])[:, :, 0])
    add_springs(m, force)
    add_bushings(m, force)
    add_joints(m, force)
    rows = Rows(m)
    jacobian, bias = np.array(rows.rows), np.array(rows.bias)
    inverse = m.a @ INVERSE @ m.a.transpose(0, 2, 1)
    free, of_body = np.zeros((N, 6), REAL), jacobian.reshape(-1, N, 6)
    free[:, :3] = force[:, :3] / MASS[:, None]
    free[:, 3:] = (inverse @ force[:, 3:, None])[:, :, 0]
    weighted = np.concatenate([of_body[:, :, :3] / MASS[None, :, None], (inverse[None] @ of_body[:, :, 3:, None])[..., 0]], 2).reshape(len(bias), -1)
    multipliers = eliminate(jacobian @ weighted.T, -bias - jacobian @ free.ravel())
    qdd = (free.ravel() + weighted.T @ multipliers).reshape(N, 6)
    x, y, z = m.w.T
    p = m.p
    spin = np.stack([-x * p[:, 1] - y * p[:, 2] - z * p[:, 3], x * p[:, 0] + y * p[:, 3] - z * p[:, 2],
                     y * p[:, 0] + z * p[:, 1] - x * p[:, 3], z * p[:, 0] + x * p[:, 2] - y * p[:, 1]], 1) / 2
    return np.hstack([m.v, spin, qdd]).ravel()


def start():
    spin = vector("0.3", "0.1", 0)
    state = np.zeros((N, 13), REAL)
    for k in range(N):
        state[k, :3], state[k, 3] = place0[k], 1
        state[k, 7:10] = vector(0, 0, "-0.3") + np.cross(spin, place0[k])
        state[k, 10:] = spin
    return state.ravel()


def six(m, i, name):
    """Coordinates of a free body against body i, and their rates: offset, then angles about successive axes x, y, z."""
    j, at0 = names.index(name), origin[name]
    a, (x0, v0, _, _) = m.axes(i), m.point(i, at0 - place0[i] if i >= 0 else at0)
    x, v, _, _ = m.point(j, at0 - place0[j])
    d = a.T @ (x - x0)
    rate = a.T @ (v - v0 - np.cross(m.rate(i), x - x0))
    c, w = a.T @ m.a[j], a.T @ (m.w[j] - m.rate(i))
    angles = np.arctan2(-c[1, 2], c[2, 2]), np.arcsin(c[0, 2]), np.arctan2(-c[0, 1], c[0, 0])
    e2, e3 = np.array([REAL(0), np.cos(angles[0]), np.sin(angles[0])]), c[:, 2]
    normal = np.cross(EYE[0], e2)
    yaw = (w @ normal) / (e3 @ normal)
    rest = w - yaw * e3
    return [*zip(d, rate), *zip(angles, (rest[0], rest @ e2, yaw))]


def coordinates(state):
    """The model's coordinates, but for the uprights' angles, and their rates."""
    m, out = Moving(state), {}
    out.update(zip(("x", "y", "z", "roll", "pitch", "yaw"), six(m, -1, "chassis")))
    carriers = {"subframe": "chassis", "engine": "chassis", "FL_arm": "subframe", "FR_arm": "subframe", "RL_arm": "chassis", "RR_arm": "chassis"}
    for name, carrier in carriers.items():
        for k, value in enumerate(six(m, names.index(carrier), name)):
            out[f"{name}.{k + 1}"] = value
    out["rack"] = shift(m)
    for i, j in hinges:
        out[names[j]] = angle(m, i, j)
    return out


if __name__ == "__main__":
    h = REAL(1) / int(sys.argv[1] if len(sys.argv) > 1 else 2000)
    first = True
    for t, state in run(rates, start(), [REAL("0.02"), REAL("0.05")], h, 8):
        found = coordinates(state)
        if first:
            print("# Absolute coordinates in long doubles by reference_limousine.py, a formulation of its own; two step sizes agree to 1e-13.")
            print(",".join(["t", *(f"q.{x}" for x in found), *(f"qd.{x}" for x in found)]))
            first = False
        print(",".join([f"{float(t):g}"] + [np.format_float_scientific(found[x][k], 14, False) for k in (0, 1) for x in found]), flush=True)
