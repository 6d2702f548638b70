#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes stewart.yaml, whose six legs are alike.

    python3 make_stewart.py > stewart.yaml
"""
BASE = [-10, 10, 110, 130, 230, 250]
PLATFORM = [-50, 50, 70, 170, 190, 290]

HEAD = """# A passive Gough-Stewart platform, 6-UPS: base points on a circle of radius 1 m, platform points on one of 0.5 m, 1 m
# above. Each leg hangs on the ground by a universal joint (about x, then y), its upper half slides in the lower one, and
# a ball joint to the platform closes the loop; a spring and damper acts along each leg. Written by make_stewart.py.
kempe: 1
name: stewart
gravity: [0, 0, -9.81]

parameters:
  {base: 1, top: 0.5, height: 1,
   k: 2000, c: 10, lower: 1, upper: 0.5,                  # springs, masses of the halves of a leg
   axial1: 0.001, across1: 0.02, axial2: 0.0005, across2: 0.01"""


def put_parameters(i, base, platform):
    print(f"   bx{i}: base*cos({base} deg), by{i}: base*sin({base} deg), px{i}: top*cos({platform} deg), "
          f"py{i}: top*sin({platform} deg),")
    print(f"   l{i}: sqrt((px{i} - bx{i})^2 + (py{i} - by{i})^2 + height^2), ex{i}: (px{i} - bx{i})/l{i}, "
          f"ey{i}: (py{i} - by{i})/l{i}, ez{i}: height/l{i}", end="")


def inertia(i, half):
    more = f"(axial{half} - across{half})"
    entries = [f"{a}{a}: across{half} + {more}*e{a}{i}^2" for a in "xyz"]
    entries += [f"{a}{b}: {more}*e{a}{i}*e{b}{i}" for a, b in ("xy", "xz", "yz")]
    return "{" + ", ".join(entries) + "}"


def put_leg(i):
    print(f"""  lower{i}:
    joint: {{name: leg{i}, motions: [R1, R2], at: ground.B{i}}}
    mass: lower
    com: [0.25*ex{i}, 0.25*ey{i}, 0.25*ez{i}]
    inertia: {inertia(i, 1)}
    points: {{P: [l{i}*ex{i}, l{i}*ey{i}, l{i}*ez{i}]}}
  upper{i}:
    joint: {{name: slide{i}, prismatic: [ex{i}, ey{i}, ez{i}], at: lower{i}.P}}
    mass: upper
    com: [-0.25*ex{i}, -0.25*ey{i}, -0.25*ez{i}]
    inertia: {inertia(i, 2)}
    points: {{P: [0, 0, 0]}}""")


print(HEAD, end="")
for i, (base, platform) in enumerate(zip(BASE, PLATFORM), 1):
    print(",")
    put_parameters(i, base, platform)
print("}\n\nground:\n  points:")
for i in range(1, 7):
    print(f"    B{i}: [bx{i}, by{i}, 0]")
print("    P: [0, 0, height]")
print("""
bodies:
  platform:
    joint: {name: platform, motions: [T1, T2, T3, R1, R2, R3], at: ground.P}
    mass: 10
    inertia: {xx: 0.6, yy: 0.7, zz: 1.2}
    points:""")
for i in range(1, 7):
    print(f"      P{i}: [px{i}, py{i}, 0]")
for i in range(1, 7):
    put_leg(i)
print("\nloops:")
for i in range(1, 7):
    print(f"  P{i}: {{ball: [upper{i}.P, platform.P{i}]}}")
print("\nforces:")
for i in range(1, 7):
    print(f"  spring{i}: {{spring: [ground.B{i}, platform.P{i}], stiffness: k, damping: c, free_length: l{i}}}")
print("""
start:
  hold: [platform.1, platform.2, platform.3, platform.4, platform.5, platform.6]
  qd: {platform.1: 0.5, platform.2: 0, platform.3: 0, platform.4: -0.5, platform.5: 0, platform.6: 1}

run: {t_end: 1, rtol: 1e-10, output_step: 10 ms}""")
