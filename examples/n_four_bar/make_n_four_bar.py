#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the IFToMM benchmark A02 with N windows.

    python3 make_n_four_bar.py N > n_four_bar.yaml
    python3 make_n_four_bar.py N spatial > n_four_bar_spatial.yaml
"""
import sys

SPATIAL = sys.argv[2:] == ["spatial"]


def lines(n):
    yield f"# IFToMM A02, N = {n}: square windows of bars of 1 m and 1 kg. Whenever the bars lie flat the mobility jumps from 1 to"
    yield f"# {n + 1} and the closures lose rows; the motion goes on as that of a parallelogram. Angles from +x. Written by make_n_four_bar.py."
    if SPATIAL:
        yield "# Here with hinges in space, five rows each of which two are independent; +x is (2, 2, 1)/3, upwards is (-2, 1, 2)/3."
    yield "kempe: 1"
    yield f"name: four-bar windows, N = {n}" + (", in space" if SPATIAL else "")
    yield "gravity: [2*9.81/3, -9.81/3, -2*9.81/3]" if SPATIAL else "gravity: [0, -9.81, 0]"
    yield "parameters: {l: 1, m: 1, i: m*l^2/108}" if SPATIAL else "parameters: {l: 1, m: 1}"
    yield "ground:\n  points:"
    for i in range(n + 1):
        yield f"    G{i}: [{2 * i}*l/3, {2 * i}*l/3, {i}*l/3]" if SPATIAL else f"    G{i}: [{i}*l, 0, 0]"
    yield "bodies:"
    for i in range(n + 1):
        yield from bar(f"v{i}", f"a{i}", f"ground.G{i}")
    for i in range(n):
        yield from bar(f"h{i}", f"b{i}", f"v{i}.T")
    yield "loops:"
    for i in range(n):
        points = f"[h{i}.T, v{i + 1}.T]"
        yield f"  C{i}: {{revolute: {points}, axis: [1, -2, 2]}}" if SPATIAL else f"  C{i}: {{ball: {points}}}"
    yield "start:"
    yield "  q: {" + ", ".join([f"a{i}: 90 deg" for i in range(n + 1)] + [f"b{i}: -90 deg" for i in range(n)]) + "}"
    yield "  qd: {a0: -1}"
    yield "run: {t_end: 20, rtol: 1e-10, output_step: 50 ms, outputs: [q, qd, position(v0.T)]}"


def bar(body, joint, at):
    yield f"  {body}:"
    yield f"    joint: {{name: {joint}, revolute: {'[1, -2, 2]' if SPATIAL else 'z'}, at: {at}}}"
    yield "    mass: m"
    if SPATIAL:
        yield "    com: [l/3, l/3, l/6]"
        yield "    inertia: {xx: 5*i, yy: 5*i, zz: 8*i, xy: -4*i, xz: -2*i, yz: -2*i}"
        yield "    points: {T: [2*l/3, 2*l/3, l/3]}"
    else:
        yield "    com: [l/2, 0, 0]"
        yield "    inertia: {zz: m*l^2/12}"
        yield "    points: {T: [l, 0, 0]}"


print("\n".join(lines(int(sys.argv[1]))))
