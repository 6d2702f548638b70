#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes target.csv: the coupler curve of Chebyshev's lambda linkage in closed form, crank 1, coupler and rocker 2.5,
base 2, the point at 5 on the coupler's line; 36 places of the crank, 10 degrees apart.

    python3 examples/coupler_fit/target.py > examples/coupler_fit/target.csv
"""
import math

CRANK, COUPLER, ROCKER, BASE, ALONG = 1, 2.5, 2.5, 2, 5

print("# Chebyshev's lambda linkage: where its coupler point is, m, while the crank turns by so many degrees. By target.py.")
print("turned,x,y")
for k in range(36):
    angle = math.radians(90 + 10 * k)
    a = complex(CRANK * math.cos(angle), CRANK * math.sin(angle))
    d = BASE - a                                     # from the crank's tip to the other pivot
    far = (COUPLER**2 - ROCKER**2 + abs(d) ** 2) / (2 * abs(d))
    b = a + d / abs(d) * complex(far, math.sqrt(COUPLER**2 - far**2))
    p = a + (b - a) / COUPLER * ALONG
    print(f"{10 * k},{p.real:.16g},{p.imag:.16g}")
