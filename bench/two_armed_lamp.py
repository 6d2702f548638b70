#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes two-armed desk lamps, lampSEED.yaml each: planar, every arm a chain of two parallelograms that keeps the platform
level, so that ten closure rows have rank nine and the mobility is two.

    bench/two_armed_lamp.py [--digits N] [--into FOLDER] SEED...

--digits rounds every point to N significant digits, as a drawing would have it."""
import argparse
import math
import pathlib
import random

HEAD = """kempe: 1
name: two-armed lamp
gravity: [0, -9.81, 0]
ground: {{points: {{A1: {a1}, A2: {a2}, B1: {b1}, B2: {b2}, S: [0.1, -0.2, 0]}}}}
bodies:
"""
BAR = """  {name}:
    joint: {{revolute: z, at: {at}}}
    mass: {mass}
    com: {com}
    inertia: {{zz: {inertia!r}}}
    points: {{{points}}}
"""
TAIL = """loops:
  L2: {ball: [guide_l.E, elbow_l.E2]}
  L3: {ball: [strut_l.F, platform.F3]}
  R2: {ball: [guide_r.H, elbow_r.H2]}
  R3: {ball: [rod_r.G, platform.G2]}
  R4: {ball: [strut_r.G, platform.G3]}
forces:
  spring: {spring: [ground.S, platform.M], stiffness: 800, free_length: 0.4}
run: {t_end: 3, output_step: 0.05, rtol: 1e-8}
"""


class Drawer:
    """Random vectors of the plane as complex numbers, each off by up to `off` either way."""

    def __init__(self, seed, off, which):
        self.dice, self.off, self.noise = random.Random(seed), off, random.Random(f"{seed} {which}")

    def polar(self, angles, lengths):
        """The angle is drawn first."""
        angle, length = self.dice.uniform(*angles), self.dice.uniform(*lengths)
        off = complex(self.noise.uniform(-1, 1), self.noise.uniform(-1, 1)) * self.off
        return complex(length * math.cos(angle), length * math.sin(angle)) + off


class Writer:
    """Vectors as text with a number of digits, and bars that are written with them."""

    def __init__(self, digits):
        self.digits = digits

    def point(self, v):
        return f"[{v.real:.{self.digits}g}, {v.imag:.{self.digits}g}, 0]"

    def bar(self, name, at, v, mass, **points):
        """A slender bar from its joint along v; the points are vectors from its joint."""
        inertia = mass * (v.real**2 + v.imag**2) / 12
        return BAR.format(name=name, at=at, mass=mass, com=self.point(v / 2), inertia=inertia,
                          points=", ".join(f"{k}: {self.point(p)}" for k, p in points.items()))


def lamp(seed, digits=17, off=0.0, which=0):
    """The model of a seed as text. off: links that differ by up to so much, of parallelograms that stay exact; there are
    many such lamps, which are numbered."""
    draw = Drawer(seed, off, which)
    a1 = complex(-0.3, 0)
    a2 = a1 + draw.polar((.3, 1.2), (.1, .3))
    c = draw.polar((2., 2.8), (.4, .7))
    e1, e2 = a1 + c, a2 + c
    e3 = e2 + draw.polar((-2., -1.), (.1, .3))
    d = draw.polar((-1.6, -.9), (.7, 1.))
    f2, f3 = e2 + d, e3 + d
    b1 = complex(0.5, 0)
    b2 = b1 + draw.polar((1.8, 2.8), (.1, .3))
    e = draw.polar((.3, 1.), (.4, .7))
    h1, h2 = b1 + e, b2 + e
    h3 = h2 + draw.polar((-2.2, -1.2), (.1, .3))
    f = draw.polar((-2.2, -1.6), (.7, 1.))
    g2, g3 = h2 + f, h3 + f
    m = g2 - f2
    w = Writer(digits)
    return (HEAD.format(a1=w.point(a1), a2=w.point(a2), b1=w.point(b1), b2=w.point(b2))
            + w.bar("crank_l", "ground.A1", c, 1, E=c) + w.bar("guide_l", "ground.A2", c, 1, E=c)
            + w.bar("elbow_l", "crank_l.E", e2 - e1, 1, E2=e2 - e1, E3=e3 - e1)
            + w.bar("rod_l", "elbow_l.E2", d, 2, F=d) + w.bar("strut_l", "elbow_l.E3", d, 2, F=d)
            + w.bar("platform", "rod_l.F", m, 5, F3=f3 - f2, G2=m, G3=g3 - f2, M=m / 2)
            + w.bar("crank_r", "ground.B1", e, 1, H=e) + w.bar("guide_r", "ground.B2", e, 1, H=e)
            + w.bar("elbow_r", "crank_r.H", h2 - h1, 1, H2=h2 - h1, H3=h3 - h1)
            + w.bar("rod_r", "elbow_r.H2", f, 2, G=f) + w.bar("strut_r", "elbow_r.H3", f, 2, G=f) + TAIL)


def main():
    parser = argparse.ArgumentParser(description="Writes two-armed desk lamps.")
    parser.add_argument("--digits", type=int, default=17)
    parser.add_argument("--into", type=pathlib.Path, default=pathlib.Path("."))
    parser.add_argument("seed", type=int, nargs="+")
    args = parser.parse_args()
    args.into.mkdir(parents=True, exist_ok=True)
    for seed in args.seed:
        (args.into / f"lamp{seed}.yaml").write_text(lamp(seed, args.digits), encoding="utf-8")


if __name__ == "__main__":
    main()
