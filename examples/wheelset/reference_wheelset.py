#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wheelset of the Test Set for IVP Solvers by itself: the published equations in index-1 form, with scipy.

    python3 examples/wheelset/reference_wheelset.py > reference.csv

prints the published row and the contacts; T_END and RTOL may follow its name. State p = (x, y, z, yaw, roll), p', beta. At each state the
contacts follow from the two conditions of each side, the multipliers from the rows differentiated twice along the motion (their
second derivatives by differences of the exact first ones), accelerations from the published equations; the terms of the
multipliers stand as they are published, those of yaw without the division by cos(roll) that Lagrange's equations have.
"""
import sys
import numpy as np
from scipy.integrate import solve_ivp

M, G9, V, R0, I1, I2, A, DELTA, RS = 16.08, 9.81, 30.0, 0.1, 0.0605, 0.366, 0.1506, 0.0262, 0.06
MU, XL, CX, CZ, E, GG, NU, GM = 0.12, 0.19, 6400.0, 6400.0, 1.3537956, 0.7115218, 0.28, 7.92e10
C11, C22, C23 = 4.72772197, 4.27526987, 1.97203505
SIDES = (1, -1)  # L: xi > 0, R: xi < 0


def wheel(xi):
    return R0 + np.tan(DELTA) * (A - abs(xi)), -np.sign(xi) * np.tan(DELTA)


def rail(x):
    d = abs(x) - A - RS * np.sin(DELTA)
    w = np.sqrt(RS**2 - d * d)
    return w - R0 - RS * np.cos(DELTA), -np.sign(x) * d / w, -RS**2 / w**3


def place(p, psi, xi):
    st, ct, sf, cf = np.sin(p[3]), np.cos(p[3]), np.sin(p[4]), np.cos(p[4])
    r, _ = wheel(xi)
    return p[0] + xi * ct * cf + r * (ct * sf * np.cos(psi) - st * np.sin(psi))


def conditions(u, p):
    psi, xi = u
    st, ct, sf, cf = np.sin(p[3]), np.cos(p[3]), np.sin(p[4]), np.cos(p[4])
    r1 = wheel(xi)[1]
    g1 = rail(place(p, psi, xi))[1]
    return [g1 * (r1 * sf + cf * np.cos(psi)) + r1 * ct * cf - ct * sf * np.cos(psi) + st * np.sin(psi),
            r1 * st * cf - st * sf * np.cos(psi) - ct * np.sin(psi)]


def contacts(p):
    """(psi, xi) of each side, by Newton with differences."""
    found = []
    for s in SIDES:
        u = np.array([0.0, 0.1506 * s])
        for _ in range(30):
            f = np.array(conditions(u, p))
            J = np.empty((2, 2))
            for k in range(2):
                h = 1e-6
                e = np.zeros(2)
                e[k] = h
                J[:, k] = (np.array(conditions(u + e, p)) - np.array(conditions(u - e, p))) / (2 * h)
            d = np.linalg.solve(J, f)
            u = u - d
            if max(abs(d)) < 1e-15:
                break
        found.append(u)
    return found


def row(p, psi, xi):
    """g1 and its derivative by p, the contact standing still (the conditions make its motion count for nothing)."""
    st, ct, sf, cf, sp, cp = np.sin(p[3]), np.cos(p[3]), np.sin(p[4]), np.cos(p[4]), np.sin(psi), np.cos(psi)
    r, _ = wheel(xi)
    g, g1, _ = rail(place(p, psi, xi))
    return g - p[1] - xi * sf + r * cf * cp, np.array(
        [g1, -1, 0, g1 * (-r * (ct * sp + cp * sf * st) - cf * st * xi), -cp * r * sf - cf * xi + g1 * (cf * cp * ct * r - ct * sf * xi)])


def rows(p):
    return np.array([row(p, *u)[1] for u in contacts(p)])


def creep(p, v, beta, u, e, Q, delta, n, s):
    psi, xi = u
    sp, cp, sf, cf = np.sin(psi), np.cos(psi), np.sin(p[4]), np.cos(p[4])
    r, r1 = wheel(xi)
    _, g1, g2 = rail(place(p, psi, xi))
    om = V / R0 + beta
    c = (3 * abs(n) * (1 - NU) * E / (2 * 3.1415926 * (1 / (2 * r * np.sqrt(1 + r1**2)) - g2 / (2 * (1 + g1**2)**1.5))
                                      * GM * np.sqrt(GG)))**(1 / 3)
    th = p[3] / np.cos(delta)
    s_, c_ = np.sin(th), np.cos(th)
    sd, cd = np.sin(delta), np.cos(delta)
    w1 = -om * r * (s_ * cp + c_ * sf * sp) + v[0] - v[3] * (r * (s_ * sf * cp + c_ * sp) + xi * s_ * cf) - v[4] * c_ * (xi * sf - r * cf * cp)
    w2 = om * r * cf * sp + v[1] + v[4] * (xi * cf + r * sf * cp)
    w3 = -om * r * (c_ * cp - s_ * sf * sp) + V + v[2] - v[3] * (xi * c_ * cf + r * (c_ * sf * cp - s_ * sp)) + v[4] * s_ * (xi * sf - r * cf * cp)
    vr = np.sqrt((w1 - 2 * v[0])**2 + (w2 - 2 * v[1])**2 + (w3 - 2 * v[2] - 2 * V)**2) / 2
    nx = (s_ * w1 + c_ * w3) / vr
    ny = (c_ * cd * w1 + s * sd * w2 - s_ * cd * w3) / vr
    turn = (-s * sd * om + cd * v[3]) / vr
    tx = -MU * n * np.tanh(GM * c**2 * C11 * nx / (MU * n))
    ty = -MU * n * np.tanh((GM * c**2 * C22 * ny + GM * c**3 * C23 * turn) / (MU * n))
    size = np.hypot(tx, ty)
    if size > MU * abs(n):
        tx, ty = tx * MU * abs(n) / size, ty * MU * abs(n) / size
    return np.array([s_ * tx + c_ * cd * ty, s * sd * ty, c_ * tx - s_ * cd * ty])


def forces(p, v, beta, u, Q, e):
    """M qdd = what this returns, of (x, y, z, yaw, roll, beta)."""
    st, ct, sf, cf = np.sin(p[3]), np.cos(p[3]), np.sin(p[4]), np.cos(p[4])
    delta = []
    for (psi, xi), s in zip(u, SIDES):
        r1 = wheel(xi)[1]
        delta.append(np.arctan(((r1 * cf - sf * np.cos(psi)) * ct + np.sin(psi) * st) / (-s * (r1 * sf + np.cos(psi) * cf))))
    W1, W2 = Q[0, 0] * e[0] + Q[1, 0] * e[1], Q[0, 1] * e[0] + Q[1, 1] * e[1]
    D = -np.sin(delta[0] + delta[1])
    n = [(np.cos(delta[1]) * W1 - np.sin(delta[1]) * W2) / D, (-np.cos(delta[0]) * W1 - np.sin(delta[0]) * W2) / D]
    om = V / R0 + beta
    f = np.array([-2 * CX * p[0], -M * G9, -2 * CZ * p[2],
                  I2 * v[3] * v[4] * sf - I1 * om * v[4] - (I1 - I2) * v[3] * sf * v[4] - 2 * XL**2 * CZ * p[3] * cf,
                  I1 * om * v[3] * cf + (I1 - I2) * v[3]**2 * sf * cf,
                  -I1 * v[3] * v[4] * cf - 2 * XL**2 * CZ * p[3] * sf])
    f[:5] += Q.T @ e
    for (psi, xi), s, d, nn in zip(u, SIDES, delta, n):
        T = creep(p, v, beta, (psi, xi), e, Q, d, nn, s)
        r, sp, cp = wheel(xi)[0], np.sin(psi), np.cos(psi)
        f[:3] += T
        f[3] += -(xi * st + r * sp * ct * cf) * T[0] - r * sp * sf * T[1] + (-xi * ct + r * sp * st * cf) * T[2]
        f[4] += -(xi * ct * sf - r * cp * ct * cf) * T[0] + (xi * cf + r * cp * sf) * T[1] + (xi * st * sf - r * cp * st * cf) * T[2]
        f[5] += -r * (cp * st + sp * ct * sf) * T[0] + r * sp * cf * T[1] - r * (cp * ct - sp * st * sf) * T[2]
    return f


LAST = [np.array([-83.593, -74.144])]


def accelerations(y):
    p, v, beta = y[:5], y[5:10], y[10]
    u = contacts(p)
    Q = np.array([row(p, *k)[1] for k in u])
    size = np.linalg.norm(v)
    h = 1e-5 / max(size, 1e-3)
    jdqd = (rows(p + h * v) - rows(p - h * v)) @ v / (2 * h)
    mass = np.array([M, M, M, I2 * np.cos(p[4]), I2])

    def gap(e):
        return Q @ (forces(p, v, beta, u, Q, e)[:5] / mass) + jdqd

    e = LAST[0].copy()
    for _ in range(30):
        g = gap(e)
        J = np.column_stack([(gap(e + d) - gap(e - d)) / 2e-3 for d in (np.array([1e-3, 0]), np.array([0, 1e-3]))])
        d = np.linalg.solve(J, g)
        e = e - d
        if max(abs(d)) < 1e-12 * max(abs(e)):
            break
    LAST[0] = e
    f = forces(p, v, beta, u, Q, e)
    a = f[:5] / mass
    return a, f[5] / I1 - a[3] * np.sin(p[4]), u, e


def rhs(_, y):
    a, b, _, _ = accelerations(y)
    return np.concatenate([y[5:10], a, [b]])


def start():
    """x, z and yaw as published; y and roll such that both wheels touch."""
    p = np.array([1.4941e-3, 4.0089e-7, 1.1241e-6, -2.8573e-4, 2.6459e-4])
    for _ in range(10):
        g = np.array([row(p, *u)[0] for u in contacts(p)])
        d = np.linalg.solve(rows(p)[:, [1, 4]], g)
        p[[1, 4]] -= d
    return np.concatenate([p, np.zeros(6)])


if __name__ == "__main__":
    t_end = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    rtol = float(sys.argv[2]) if len(sys.argv) > 2 else 1e-9
    run = solve_ivp(rhs, (0, t_end), start(), method="DOP853", rtol=rtol, atol=1e-12, first_step=1e-5)
    y = run.y[:, -1]
    _, _, u, e = accelerations(y)
    names = ["x", "y", "z", "yaw", "roll"]
    columns = ["t", *(f"q.{x}" for x in names), *(f"qd.{x}" for x in names), "beta", "lambda.L.1", "lambda.R.1",
               *(f"{x}.{side}" for side in "LR" for x in ("psi", "xi"))]
    print(f"# The published equations in index-1 form by reference_wheelset.py, DOP853 at rtol {rtol:g}.")
    print(",".join(columns))
    print(",".join([repr(t_end), *(f"{x:.14g}" for x in (*y, *e, *u[0], *u[1]))]))
