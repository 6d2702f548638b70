#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the planar parallel robot, with hinges of the plane or hinges in space in a tilted plane.

    python3 make_parallel_robot.py > parallel_robot.yaml
    python3 make_parallel_robot.py spatial > parallel_robot_spatial.yaml
"""
import sys

SPATIAL = sys.argv[1:] == ["spatial"]
ARMS = (("l", -1), ("r", 1))
HINGE = "[1, -2, 2]" if SPATIAL else "z"


def place(x, y):
    """(x, y) of the plane, whose axes are (2, 2, 1)/3 and (-2, 1, 2)/3 in space."""
    if not SPATIAL:
        return f"[{x}, {y}, 0]"
    if y == "0":
        return f"[2*{x}/3, 2*{x}/3, {x}/3]"
    return f"[(-2*{y} + 2*{x})/3, ({y} + 2*{x})/3, (2*{y} + {x})/3]"


def disc(i):
    """Inertia of a body that looks the same in all directions of the plane, where its angle does not count."""
    return f"{{xx: {i}, yy: {i}, zz: {i}}}" if SPATIAL else f"{{zz: {i}}}"


def bar(body, joint, at, mass, length, end):
    yield f"  {body}:"
    yield f"    joint: {{name: {joint}, revolute: {HINGE}, at: {at}}}"
    yield f"    mass: {mass}"
    yield f"    com: {place(length + '/2', '0')}"
    i = mass.replace("m_", "i_")                          # a ninth of that of the bar
    yield (f"    inertia: {{xx: 5*{i}, yy: 5*{i}, zz: 8*{i}, xy: -4*{i}, xz: -2*{i}, yz: -2*{i}}}" if SPATIAL else
           f"    inertia: {{zz: {mass}*{length}^2/12}}")
    yield f"    points: {{{end}: {place(length, '0')}}}"


def arm(side, way):
    """Crank and bar on the ground, elbow on the crank, rod and bar on the elbow."""
    n = {"l": "a", "r": "b"}[side]
    u, v = ("(-ux)", "vx") if way < 0 else ("ux", "(-vx)")
    yield from bar(f"crank_{side}", f"{n}1", f"ground.{side.upper()}", "m_crank", "a", "E")
    yield from bar(f"crank_bar_{side}", f"{n}2", f"ground.{side.upper()}U", "m_bar", "a", "U")
    yield f"  elbow_{side}:                                                # level: its angle is that of the crank, backwards"
    yield f"    joint: {{name: {n}3, revolute: {HINGE}, at: crank_{side}.E}}"
    yield "    mass: m_elbow"
    yield f"    inertia: {disc('1e-3')}"
    yield f"    points: {{U: {place(u, 'uy')}, V: {place(v, 'vy')}}}"
    yield from bar(f"rod_{side}", f"{n}4", f"elbow_{side}", "m_rod", "b", "P")
    yield from bar(f"rod_bar_{side}", f"{n}5", f"elbow_{side}.V", "m_rod_bar", "b", "V")


def closure(name, one, other):
    return f"  {name}: {{revolute: [{one}, {other}], axis: {HINGE}}}" if SPATIAL else f"  {name}: {{ball: [{one}, {other}]}}"


def lines():
    yield "# Planar parallel robot: crank and rod of each of its two arms have a parallelogram beside them and keep the platform"
    yield "# level. One arm would do for that: a row of the five loops is redundant. Written by make_parallel_robot.py."
    if SPATIAL:
        yield "# Here with hinges in space: 25 rows, of which 9 are independent, and the same motion. The plane is normal to (1, -2, 2), its"
        yield "# points are x (2, 2, 1)/3 + y (-2, 1, 2)/3."
    yield "kempe: 1"
    yield "name: parallel robot" + (" in space" if SPATIAL else "")
    yield "gravity: [2*g/3, -g/3, -2*g/3]" if SPATIAL else "gravity: [0, -g, 0]"
    yield ""
    yield "parameters:"
    yield "  {g: 9.81, a: 400 mm, b: 600 mm, apart: 200 mm, wide: 100 mm,  # crank, rod, half the pivots' distance, platform"
    yield "   ux: 86.6 mm, uy: 50 mm, vx: 70 mm, vy: 70 mm,           # where the bars of the parallelograms begin"
    if SPATIAL:
        yield "   i_crank: m_crank*a^2/108, i_bar: m_bar*a^2/108, i_rod: m_rod*b^2/108, i_rod_bar: m_rod_bar*b^2/108,"
    yield "   m_crank: 1, m_bar: 0.5, m_elbow: 0.3, m_rod: 0.8, m_rod_bar: 0.4, m_platform: 2, k: 60}"
    yield ""
    yield "ground:"
    yield "  points:"
    for side, way in ARMS:
        yield f"    {side.upper()}: {place('(-apart)' if way < 0 else 'apart', '0')}"
        yield f"    {side.upper()}U: {place('(-apart - ux)' if way < 0 else '(apart + ux)', 'uy')}"
    yield ""
    yield "bodies:                                                   # uniform slender bars"
    yield from arm(*ARMS[0])
    yield "  platform:"
    yield f"    joint: {{name: p, revolute: {HINGE}, at: rod_l.P}}"
    yield "    mass: m_platform"
    yield f"    inertia: {disc('0.01')}"
    yield f"    points: {{VL: {place('vx', 'vy')}, R: {place('wide', '0')}, VR: {place('(wide - vx)', 'vy')}}}"
    yield from arm(*ARMS[1])
    yield ""
    yield "loops:"
    for side, _ in ARMS:
        yield closure(f"U{side}", f"crank_bar_{side}.U", f"elbow_{side}.U")
        yield closure(f"V{side}", f"rod_bar_{side}.V", f"platform.V{side.upper()}")
    yield closure("R", "rod_r.P", "platform.R")
    yield ""
    yield "forces:"
    yield "  spring_l: {joint: a1, spring: {stiffness: k, rest: -150 deg}}"
    yield "  spring_r: {joint: b1, spring: {stiffness: k, rest: -30 deg}}"
    yield ""
    yield "start:"
    yield "  q: {a1: -150 deg, a2: -150 deg, a3: 150 deg, a4: -34 deg, a5: -34 deg, p: 34 deg,"
    yield "      b1: -30 deg, b2: -30 deg, b3: 30 deg, b4: -146 deg, b5: -146 deg}"
    yield "  hold: [a1, b1]"
    yield "  qd: {a1: 3, b1: 1}"
    yield ""
    yield "run: {t_end: 2, rtol: 1e-10, output_step: 10 ms, outputs: [q, qd, position(platform.R)]}"


print("\n".join(lines()))
