#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Digits of the robot's leg by equations of its own, in 30 digits (needs mpmath):

    examples/robot_leg/reference_robot_leg.py > examples/robot_leg/reference.csv

Each half of the leg is a double pendulum with the angles of its thigh and its shank against x, both from a hip down. The shanks
meet at the foot: two closures of four angles. The angles of the thighs and their rates are integrated, the shanks are where
two circles meet below the hips.
"""
import pathlib
import sys

from mpmath import acos, atan2, cos, lu_solve, matrix, mp, mpf, nstr, pi, sin, sqrt

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import extrapolation  # noqa: E402

mp.dps = 30
HIP, THIGH, SHANK = (mpf("0.03"), mpf("-0.03")), mpf("0.1"), mpf("0.2")
MASS, TURN = (mpf("0.2"), mpf("0.1")), (mpf("2e-4"), mpf("4e-4"))    # of a thigh and a shank, about its centre
OUT = (mpf("0.05"), mpf("0.1"))                                      # distance of the centre from the upper joint
LOSS, G = (mpf("0.005"), mpf("0.001")), mpf("9.81")                  # of a hip and a knee
STIFFNESS, DAMPING, RATE = 12, mpf("0.15"), 12
DEGREE = pi / 180
MIDDLE, CROUCH, SWING = (40 * DEGREE, 140 * DEGREE), (20 * DEGREE, -20 * DEGREE), 12 * DEGREE


class State(list):
    """A vector of numbers that adds and multiplies."""

    def __add__(self, other):
        return State(a + b for a, b in zip(self, other))

    def __sub__(self, other):
        return State(a - b for a, b in zip(self, other))

    def __mul__(self, x):
        return State(a * x for a in self)

    def __truediv__(self, x):
        return State(a / x for a in self)


def shanks(thigh):
    """The angles of both shanks. An angle turns about y: its direction is (cos, -sin) in x and z."""
    x = [HIP[k] + THIGH * cos(thigh[k]) for k in (0, 1)]
    z = [-THIGH * sin(thigh[k]) for k in (0, 1)]
    apart, way = sqrt((x[0] - x[1])**2 + (z[0] - z[1])**2), atan2(z[0] - z[1], x[0] - x[1])
    inner = acos(apart / (2 * SHANK))                    # from the line between the knees, the rear one first
    return [pi - way - inner, inner - way]


def motion(t, state):
    """The angles thigh, shank, of the front, then of the rear, their rates and accelerations."""
    below = shanks(state[:2])
    angle = [state[0], below[0], state[1], below[1]]
    c, s, length, sign = [cos(a) for a in angle], [sin(a) for a in angle], [THIGH, SHANK] * 2, [1, 1, -1, -1]
    det = length[1] * length[3] * (s[1] * c[3] - c[1] * s[3]) * sign[1] * sign[3]
    px = -sum(sign[k] * length[k] * s[k] * state[2 + k // 2] for k in (0, 2))  # sum of sign length (s, c) rate = 0
    pz = -sum(sign[k] * length[k] * c[k] * state[2 + k // 2] for k in (0, 2))
    rate = [state[2], (px * c[3] - pz * s[3]) * length[3] * sign[3] / det, state[3], (pz * s[1] - px * c[1]) * length[1] * sign[1] / det]
    m, f = matrix(6, 6), matrix(6, 1)
    for leg in (0, 1):
        a, b = 2 * leg, 2 * leg + 1
        lever = MASS[1] * THIGH * OUT[1]
        m[a, a] = MASS[0] * OUT[0]**2 + TURN[0] + MASS[1] * THIGH**2
        m[b, b] = MASS[1] * OUT[1]**2 + TURN[1]
        m[a, b] = m[b, a] = lever * cos(angle[a] - angle[b])
        bend = lever * sin(angle[a] - angle[b])
        target = MIDDLE[leg] + CROUCH[leg] * sin(RATE * t) + SWING * cos(RATE * t)
        motor, knee = STIFFNESS * (target - angle[a]) - DAMPING * rate[a], LOSS[1] * (rate[b] - rate[a])
        f[a] = -bend * rate[b]**2 + G * c[a] * (MASS[0] * OUT[0] + MASS[1] * THIGH) + motor - LOSS[0] * rate[a] + knee
        f[b] = bend * rate[a]**2 + G * c[b] * MASS[1] * OUT[1] - knee
    for k in range(4):
        m[4, k] = m[k, 4] = sign[k] * length[k] * s[k]
        m[5, k] = m[k, 5] = sign[k] * length[k] * c[k]
        f[4] -= sign[k] * length[k] * c[k] * rate[k]**2
        f[5] += sign[k] * length[k] * s[k] * rate[k]**2
    return angle, rate, lu_solve(m, f)


def rates(t, state):
    _, rate, acceleration = motion(t, state)
    return State([rate[0], rate[2], acceleration[0], acceleration[2]])


def main():
    start = State([52 * DEGREE, 152 * DEGREE, mpf(0), mpf(0)])
    print("# A five-bar in 30 digits by reference_robot_leg.py; a run with half the step agrees to 1e-17.")
    print("t," + ",".join(f"q.{name},qd.{name}" for name in ("hip_front", "knee_front", "hip_rear", "knee_rear")))
    ends = [mpf("0.1"), mpf("0.25"), mpf("0.5"), mpf(1), mpf(2)]
    for t, state in extrapolation.run(rates, start, ends, mpf(1) / int(sys.argv[1] if len(sys.argv) > 1 else 100), 13):
        angle, rate, _ = motion(t, state)
        values = [angle[0], rate[0], angle[1] - angle[0], rate[1] - rate[0], angle[2], rate[2], angle[3] - angle[2], rate[3] - rate[2]]
        print(",".join([nstr(t, 3)] + [nstr(x, 18) for x in values]))


if __name__ == "__main__":
    main()
