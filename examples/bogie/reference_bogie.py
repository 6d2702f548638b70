#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes closures.csv and reference.csv: the bogie, and the bogie thrown (shake.yaml), in long doubles. Needs numpy.

    python3 reference_bogie.py closures > closures.csv
    python3 reference_bogie.py > reference.csv

Joints are lines in space, each of which is moved by those before it. From these lines follow places, velocities, the
accelerations that the rates alone make, and the columns of all Jacobians (axis, axis x lever); M is the sum of J' m J over the bodies,
accelerations and multipliers come from M qdd - J' lambda = Q, J qdd = -b. Nothing is recursive but the places. Closed positions are
Newton's; motions are extrapolated (../extrapolation.py). Minutes.
"""
import pathlib
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from extrapolation import run  # noqa: E402

REAL = np.longdouble
ZERO = np.zeros(3, REAL)


def vector(*x):
    """From decimal text or integers, without a detour by doubles."""
    return np.array([REAL(str(v)) for v in x])


# Body: parent, its place there, motions and their coordinates, mass, centre of mass, moments of inertia.
BODIES = {
    "HF": (None, (0, 0, "0.32"), "T1 T2 T3 R3 R1 R2", "x y z yaw roll pitch", 900, ("-0.25", 0, 0), (220, 180, 370)),
    "WFL": ("HF", (0, "0.75", 0), "R2", "spin_FL", 180, (0, 0, 0), (6, 11, 6)),
    "WFR": ("HF", (0, "-0.75", 0), "R2", "spin_FR", 180, (0, 0, 0), (6, 11, 6)),
    "HR": ("HF", ("-0.9", 0, "-0.05"), "R1 R2 R3", "warp rear_pitch rear_yaw", 420, ("-0.45", 0, "-0.03"), (110, 60, 150)),
    "WRL": ("HR", ("-0.8", "0.75", "-0.0825"), "R2", "spin_RL", 70, (0, 0, 0), ("0.8", "1.3", "0.8")),
    "WRR": ("HR", ("-0.8", "-0.75", "-0.0825"), "R2", "spin_RR", 70, (0, 0, 0), ("0.8", "1.3", "0.8")),
    "CR": ("HF", ("-0.765", 0, 0), "T3 R2", "stroke tilt", 300, (0, 0, "0.05"), (90, 15, 100)),
    "L1": ("HF", ("-0.5", "0.55", "-0.17"), "R3 R2", "L1_yaw L1_pitch", 15, ("-0.4", 0, 0), ("0.02", "0.8", "0.8")),
    "L2": ("HF", ("-0.5", "-0.55", "-0.17"), "R3 R2", "L2_yaw L2_pitch", 15, ("-0.4", 0, 0), ("0.02", "0.8", "0.8")),
    "L3": ("CR", ("0.10", 0, "-0.15"), "R3 R2", "L3_yaw L3_pitch", 15, ("0.225", 0, 0), ("0.02", "0.25", "0.25")),
    "K1": ("HF", ("-0.45", "0.42", "-0.10"), "R2", "K1", 8, ("-0.05", 0, 0), ("0.02", "0.05", "0.05")),
    "K2": ("HF", ("-0.45", "-0.42", "-0.10"), "R2", "K2", 8, ("-0.05", 0, 0), ("0.02", "0.05", "0.05")),
    "K3": ("HR", ("-0.35", "0.30", "0.05"), "R1", "K3", 8, (0, "0.05", 0), ("0.05", "0.02", "0.05")),
}
BALLS = [("HR", ("-0.4", "0.55", "-0.12"), "L1", ("-0.8", 0, 0)), ("HR", ("-0.4", "-0.55", "-0.12"), "L2", ("-0.8", 0, 0)),
         ("HF", ("-0.215", 0, "-0.15"), "L3", ("0.45", 0, 0))]
RODS = [("K1", ("-0.15", 0, 0), "CR", ("0.165", "0.42", "0.08"), "0.18"),
        ("K2", ("-0.15", 0, 0), "CR", ("0.165", "-0.42", "0.08"), "0.18"),
        ("K3", (0, "0.15", 0), "HF", ("-1.25", "0.45", "0.20"), "0.20")]
SPRINGS = {"K1": (7900, 340, 2600), "K2": (7900, 340, 2600), "K3": (5600, 70, 0)}  # stiffness, damping, preload

# As Kempe orders them: parents first, else as written.
NAMES = [name for body in BODIES.values() for name in body[3].split()]
CLOSURES = ["L1.1", "L1.2", "L1.3", "L2.1", "L2.2", "L2.3", "L3.1", "L3.2", "L3.3", "K1.1", "K2.1", "K3.1"]
DEPENDENT = [NAMES.index(x) for x in "rear_pitch rear_yaw tilt L1_yaw L1_pitch L2_yaw L2_pitch L3_yaw L3_pitch K1 K2 K3".split()]
OTHERS = [i for i in range(len(NAMES)) if i not in DEPENDENT]
N, PLACES = len(NAMES), {}

for _name, (_parent, _at, _motions, _coordinates, _mass, _com, _inertia) in BODIES.items():
    PLACES[_name] = (_parent, vector(*_at), [(m[0], int(m[1]) - 1, NAMES.index(c)) for m, c in zip(_motions.split(), _coordinates.split())],
                     REAL(str(_mass)), vector(*_com), np.diag(vector(*_inertia)))
BALLS = [(a, vector(*pa), b, vector(*pb)) for a, pa, b, pb in BALLS]
RODS = [(a, vector(*pa), b, vector(*pb), REAL(length)) for a, pa, b, pb, length in RODS]


def turned(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    out = np.eye(3, dtype=REAL)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[i, i], out[i, j], out[j, i], out[j, j] = c, -s, s, c
    return out


class Moving:
    """All bodies at q, with rates qd; the lines of their joints."""

    def __init__(self, q, qd):
        self.bodies = {None: (np.eye(3, dtype=REAL), ZERO, ZERO, ZERO, ZERO, ZERO, [])}
        for name, (parent, at, motions, *_) in PLACES.items():
            self.bodies[name] = self.hang(self.bodies[parent], at, motions, q, qd)

    @staticmethod
    def hang(parent, at, motions, q, qd):
        turn, x, v, a, w, wd, lines = parent
        lever = turn @ at
        x, v, a = x + lever, v + np.cross(w, lever), a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever))
        lines = list(lines)
        for kind, axis, i in motions:
            e = turn[:, axis]
            if kind == "T":
                lever, rate = e * q[i], e * qd[i]
                a = a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever)) + 2 * np.cross(w, rate)
                x, v = x + lever, v + np.cross(w, lever) + rate
            else:
                wd, w = wd + np.cross(w, e) * qd[i], w + e * qd[i]
                turn = turn @ turned(axis, q[i])
            lines.append((kind, e, x, i))
        return turn, x, v, a, w, wd, lines

    def point(self, name, local):
        """Place, velocity, acceleration by the rates alone, Jacobian, that of the turning."""
        turn, x, v, a, w, wd, lines = self.bodies[name]
        lever = turn @ local
        place = x + lever
        jacobian, turning = np.zeros((3, N), REAL), np.zeros((3, N), REAL)
        for kind, e, origin, i in lines:
            if kind == "T":
                jacobian[:, i] = e
            else:
                jacobian[:, i], turning[:, i] = np.cross(e, place - origin), e
        return place, v + np.cross(w, lever), a + np.cross(wd, lever) + np.cross(w, np.cross(w, lever)), jacobian, turning

    def rows(self):
        """h, J, and J's change times the rates."""
        h, jacobian, bias = [], [], []
        for i, pi, j, pj in BALLS:
            one, other = self.point(i, pi), self.point(j, pj)
            h.extend(other[0] - one[0])
            jacobian.extend(other[3] - one[3])
            bias.extend(other[2] - one[2])
        for i, pi, j, pj, length in RODS:
            one, other = self.point(i, pi), self.point(j, pj)
            d, rate = other[0] - one[0], other[1] - one[1]
            h.append((d @ d - length * length) / 2)
            jacobian.append(d @ (other[3] - one[3]))
            bias.append(d @ (other[2] - one[2]) + rate @ rate)
        return np.array(h), np.array(jacobian), np.array(bias)


def solve(matrix, b):
    """By elimination with row pivots: long doubles are not in LAPACK. b may have several columns."""
    n = len(matrix)
    m = np.column_stack([matrix, b])
    for k in range(n):
        p = k + np.argmax(np.abs(m[k:, k]))
        m[[k, p]] = m[[p, k]]
        m[k + 1:, k:] -= np.outer(m[k + 1:, k] / m[k, k], m[k, k:])
    x = np.zeros((n, m.shape[1] - n), REAL)
    for k in range(n - 1, -1, -1):
        x[k] = (m[k, n:] - m[k, k + 1:n] @ x[k + 1:]) / m[k, k]
    return x[:, 0] if b.ndim == 1 else x


def close(q):
    """The closed position with the same independent coordinates, by Newton."""
    q, steps = q.copy(), 0
    while True:
        h, jacobian, _ = Moving(q, np.zeros(N, REAL)).rows()
        change = solve(jacobian[:, DEPENDENT], -h)
        q[DEPENDENT] += change
        steps += 1
        if np.abs(change).max() < 1e-17 or steps == 20:
            return q, np.abs(h).max(), steps


def accelerations(q, qd):
    """With the multipliers."""
    m = Moving(q, qd)
    mass, force = np.zeros((N, N), REAL), np.zeros(N, REAL)
    for name, (_, _, _, kg, com, inertia) in PLACES.items():
        _, _, a, jacobian, turning = m.point(name, com)
        turn, _, _, _, w, wd, _ = m.bodies[name]
        world = turn @ inertia @ turn.T
        mass += kg * jacobian.T @ jacobian + turning.T @ world @ turning
        force -= kg * jacobian.T @ a + turning.T @ (world @ wd + np.cross(w, world @ w))
    for name, (k, c, preload) in SPRINGS.items():
        i = NAMES.index(name)
        force[i] += preload - k * q[i] - c * qd[i]
    _, jacobian, bias = m.rows()
    both = solve(mass, np.column_stack([force, jacobian.T]))
    multipliers = solve(jacobian @ both[:, 1:], -bias - jacobian @ both[:, 0])
    return both[:, 0] + both[:, 1:] @ multipliers, multipliers


def rates(_, state):
    return np.concatenate([state[N:], accelerations(state[:N], state[N:])[0]])


def named(**values):
    out = np.zeros(N, REAL)
    for name, value in values.items():
        out[NAMES.index(name)] = REAL(value)
    return out


def start():
    v = REAL(10)
    qd = named(x=v, spin_FL=v / REAL("0.32"), spin_FR=v / REAL("0.32"), spin_RL=v / REAL("0.1875"), spin_RR=v / REAL("0.1875"),
               y="0.5", z=1, yaw="0.8", roll="-1.2", pitch="0.6", warp=2, stroke="-0.6")
    _, jacobian, _ = Moving(np.zeros(N, REAL), qd).rows()
    qd[DEPENDENT] = solve(jacobian[:, DEPENDENT], -jacobian[:, OTHERS] @ qd[OTHERS])
    return np.concatenate([np.zeros(N, REAL), qd])


def digits(values):
    return [np.format_float_scientific(x, 15, False) for x in values]


def closures():
    moving = NAMES.index("warp"), NAMES.index("stroke"), *DEPENDENT
    print("# Closed positions with all other coordinates zero, by reference_bogie.py in long doubles.")
    print(",".join(NAMES[i] for i in moving))
    for given in ({"warp": "0.05"}, {"stroke": "0.03"}, {"warp": "-0.08"}, {"stroke": "-0.04"}, {"warp": "0.06", "stroke": "-0.03"}):
        q, residual, steps = close(named(**given))
        assert residual < 1e-17, (given, residual, steps)
        print(",".join(np.format_float_positional(q[i] if abs(q[i]) > 1e-15 else REAL(0), 16, False, False) for i in moving))


def in_frame(state, multipliers):
    """Of the balls in the axes of the front half-frame, which carries both sides of each, as Kempe has them."""
    axes = Moving(state[:N], state[N:]).bodies["HF"][0]
    return np.concatenate([(multipliers[:9].reshape(3, 3) @ axes).ravel(), multipliers[9:]])


def motion(h):
    print("# Lines in space in long doubles by reference_bogie.py, a formulation of its own; two step sizes agree to 3e-15, lambda to 5e-11 N.")
    print(",".join(["t", *(f"q.{x}" for x in NAMES), *(f"qd.{x}" for x in NAMES), *(f"lambda.{x}" for x in CLOSURES)]))
    for t, state in run(rates, start(), [REAL("0.05"), REAL("0.2"), REAL("0.5")], h, 8):
        multipliers = in_frame(state, accelerations(state[:N], state[N:])[1])
        print(",".join([f"{float(t):g}", *digits(np.concatenate([state, multipliers]))]), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["closures"]:
        closures()
    else:
        motion(REAL(1) / int(sys.argv[1] if len(sys.argv) > 1 else 200))
