#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Values for an ensemble of four-bars: lengths and masses that scatter by up to 5 % about those of four_bar.yaml.

    python3 examples/four_bar/bars.py 10000 > bars.csv
    kempe ensemble examples/four_bar/four_bar.yaml --values bars.csv -o ends.csv
"""
import random
import sys

BARS = {"crank": 0.3, "coupler": 0.8, "rocker": 0.7, "base": 0.9, "crank_mass": 1, "coupler_mass": 1, "rocker_mass": 1}

chance = random.Random(1)
print(",".join(BARS))
for _ in range(int(sys.argv[1]) if len(sys.argv) > 1 else 10000):
    print(",".join(repr(value * chance.uniform(0.95, 1.05)) for value in BARS.values()))
