#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The path of bowling_ball.yaml in closed form, 40 digits (mpmath).

    python3 examples/bowling_ball/reference_bowling_ball.py > reference.csv

The slip u = v + w x (-r z) changes by -7/2 mu g t along its own direction, which stays the same; v by -mu g t.
"""
from mpmath import mp, mpf, hypot, nstr

mp.dps = 40
R, M, MU, G = mpf("0.108"), mpf(7), mpf("0.12"), mpf("9.81")
SPEED, SPIN = (mpf(8), mpf("-0.5")), (mpf(-30), mpf(20))
SLIP = (SPEED[0] - R * SPIN[1], SPEED[1] + R * SPIN[0])
SIZE = hypot(*SLIP)
PUSH = [-MU * G * u / SIZE for u in SLIP]
ROLLS = 2 * SIZE / (7 * MU * G)

print(f"# closed form, 40 digits; rolls from t = {nstr(ROLLS, 20)}")
print("t,q.b.1,q.b.2,q.b.3,qd.b.1,qd.b.2,force.lane,force.lane_friction1,force.lane_friction2")
for k in range(28):
    t = mpf(k) / 10
    slips = min(t, ROLLS)
    rate = [v + a * slips for v, a in zip(SPEED, PUSH)]
    place = [v * slips + a * slips**2 / 2 + w * (t - slips) for v, a, w in zip(SPEED, PUSH, rate)]
    force = [M * a if t < ROLLS else mpf(0) for a in PUSH]
    print(",".join(nstr(x, 18) for x in (t, *place, R, *rate, M * G, *force)))
